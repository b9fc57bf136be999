"""Scenes as labels refer to them: category ids, instance frames, boxes, rounding."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gen_data.core import asset_types, scene_time
from gen_data.core.bounded_cache import CountCache, ObjectCache
from gen_data.core.decimals import round_near
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import PERSON_MARGIN_M, Body, Box3dExtent, Instance, Scene
from gen_data.core.se3 import SE3, Array, Vec3

PEOPLE = frozenset({"person", "pedestrian"})
_measured: ObjectCache[CountCache[dict[str, Any]]] = ObjectCache(1)
"""``_own_measures`` of the latest library: streets are full of equal objects."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """A view through time: the only source of scenes for sensors and labels.

    Invariant: every scene depends only on the view at time 0 and its instant, and its instances
    have the frames, boxes and motion of that instant.

    Attributes:
        view: Finalized scene at time 0, with its sensors in their places.
        category_ids: By name of the category.
    """

    view: Scene
    assets: AssetLibrary
    category_ids: Mapping[str, int]
    _scenes: dict[float, Scene] = field(default_factory=dict)

    def at(self, time_s: float) -> Scene:
        """The scene at an instant [s]; cached."""
        if time_s == self.view.time_s:
            return self.view
        if time_s not in self._scenes:
            moved = scene_time.scene_at(self.view, time_s)
            ids = self.category_ids
            self._scenes[time_s] = finalize_scene(moved, self.assets, ids, before=self.view)
        return self._scenes[time_s]


def finalize_scene(
    scene: Scene, assets: AssetLibrary, category_ids: Mapping[str, int], before: Scene | None = None
) -> Scene:
    """Fill in category id, attributes, frame, keypoints and tight box of every instance.

    An instance of one body has that body's frame. An instance of several bodies (a robot) has
    the frame of its articulation's base, and the box around all its bodies' vertices. Bounds
    without mirrors are the bounds of the single body's asset, unless ``scene.box3d`` is ``all``.
    Objects that a finalized scene ``before`` shares are not measured again.
    """
    known = () if before is None else (*before.bodies, *before.instances)
    still = {id(item) for item in known}
    members: dict[int, list[Body]] = {}
    for body in scene.bodies:
        members.setdefault(body.instance_id, []).append(body)
    bases = {a.instance_id: a.T_world_base for a in scene.articulations}

    def finalize(instance: Instance) -> Instance:
        bodies = members.get(instance.instance_id, [])
        T_world_base = bases.get(instance.instance_id)
        if T_world_base is None and still.issuperset(map(id, (instance, *bodies))):
            return instance
        found = _describe(instance, assets, category_ids)
        if bodies:
            found |= _measure(bodies, T_world_base, assets, scene.box3d)
        return replace(instance, **found)

    instances = tuple(map(finalize, scene.instances))
    return scene_time.add_twists(replace(scene, instances=instances))


def _describe(
    instance: Instance, assets: AssetLibrary, category_ids: Mapping[str, int]
) -> dict[str, Any]:
    """Category id, and attributes of the asset and of the instance; the latter win."""
    asset = assets.get(instance.asset)
    attributes = {**dict(asset.attributes), **dict(instance.attributes)}
    return {
        "category_id": category_ids.get(instance.category, 0),
        "subcategory": instance.subcategory or asset.subcategory,
        "attributes": tuple(sorted(attributes.items())),
    }


def _measure(
    bodies: list[Body], T_world_base: SE3 | None, assets: AssetLibrary, box3d: Box3dExtent
) -> dict[str, Any]:
    """Frame, box and keypoints of an instance that consists of these bodies."""
    if T_world_base is None and len(bodies) == 1:
        body = bodies[0]
        known = _measured.get(assets, lambda: CountCache(2048))
        own = known.get(
            f"{body.asset} {body.scale!r} {box3d}", lambda: _own_measures(body, assets, box3d)
        )
        return {"T_world_instance": body.T_world_body, **own}
    T_world_instance = bodies[0].T_world_body if T_world_base is None else T_world_base
    T_instance_world = T_world_instance.inverse()
    lows, highs = [], []
    for body in bodies:
        vertices_m = assets.mesh(body.asset).vertices_m.astype(np.float64) * body.scale
        placed = (T_instance_world @ body.T_world_body).apply(vertices_m)
        lows.append(placed.min(axis=0))
        highs.append(placed.max(axis=0))
    return {
        "T_world_instance": T_world_instance,
        "box_min_m": _round_to_micrometre(np.min(lows, axis=0)),
        "box_max_m": _round_to_micrometre(np.max(highs, axis=0)),
    }


def _own_measures(body: Body, assets: AssetLibrary, box3d: Box3dExtent) -> dict[str, Any]:
    """Boxes and keypoints of an instance of a single body, in its frame, wherever it is."""
    low, high = assets.bounds_m(body.asset)
    return {
        "box_min_m": _scale(low, body.scale),
        "box_max_m": _scale(high, body.scale),
        "body_bounds_m": _labelled_bounds(body, assets, box3d),
        "keypoints": tuple(
            asset_types.Keypoint(
                point.name, _scale(point.position_m, body.scale), point.radius_m * body.scale
            )
            for point in assets.keypoints(body.asset)
        ),
    }


def _labelled_bounds(
    body: Body, assets: AssetLibrary, box3d: Box3dExtent
) -> tuple[Vec3, Vec3] | None:
    """Bounds of the part of a body that its 3D box encloses; None = all of it."""
    if box3d == "all":
        return None
    bounds_m = assets.body_bounds_m(body.asset)
    if box3d == "annotated" and assets.get(body.asset).category in PEOPLE:
        (x0, y0, z0), (x1, y1, z1) = assets.stride_bounds_m(body.asset)
        m = PERSON_MARGIN_M
        bounds_m = ((x0 - m, y0 - m, z0), (x1 + m, y1 + m, z1 + m))
    if bounds_m is None:
        return None
    low, high = bounds_m
    return _scale(low, body.scale), _scale(high, body.scale)


def _scale(corner_m: Vec3, scale: float) -> Vec3:
    x, y, z = corner_m
    x, y, z = x * scale, y * scale, z * scale
    return (round_near(x, 1e6, 6), round_near(y, 1e6, 6), round_near(z, 1e6, 6))


def _round_to_micrometre(corner_m: Array) -> Vec3:
    x, y, z = (round(float(v), 6) for v in corner_m)
    return (x, y, z)
