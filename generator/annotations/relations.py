"""Scene graphs: relations between objects, from their final poses and meshes."""

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gen_data.annotations.instance_extents import find_extents
from gen_data.annotations.surface_contacts import (
    Contacts,
    are_within,
    find_contacts,
    hits_by_rays,
    meet_along,
)
from gen_data.config.base_model import Strict
from gen_data.core.boxes import BoxPx
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.sample import EgoTruth, ImageTruth, Predicate, Relation
from gen_data.core.scene import Body, Instance, Motion, Scene
from gen_data.core.se3 import SE3, Array

UPWARD = 0.5
"""A contact carries the upper object if its normal is at most 60 degrees from the vertical: more
than the friction angle of nearly all materials (assumed)."""
PLUMB_M = 1e-4
"""Points whose verticals are at most this far apart are over each other."""
OPPOSITE = -0.5
"""Fingers hold an object by contacts whose normals differ by at least 120 degrees."""
SHELL = frozenset({"floor", "wall", "ceiling"})
"""Categories of the surfaces of rooms: a lamp below a ceiling does not carry it."""
COMPASS = np.array([[np.cos(a), np.sin(a), 0.0] for a in np.arange(8) * np.pi / 4])
"""Eight horizontal directions in which a container must have a wall."""


class Relations(Strict):
    """Relations between instances, each decided by exact geometry.

    In space, for images between instances that are both visible:

    ``supported_by``: the subject's mesh touches the object's from above, at more points than from
    below. Fixed objects are supported by fixed objects only, which reach lower or end where they
    begin; floors, walls and ceilings by nothing.
    ``inside``: the centre of the subject's box and most of its surface are in the convex hull of
    the object, which has walls in eight horizontal directions around that centre.
    ``on``: supported, and neither inside nor held.
    ``held_by``: a robot touches the subject from opposite sides.
    ``near``: the distance of the meshes is less than a share of the smaller one's longest side;
    stated once, for the smaller instance id, and where none of the above is.

    In images, between annotated instances, as the viewer sees them; their inverses ``right_of`` and
    ``behind`` follow from them:

    ``left_of``: the box of visible pixels ends before the object's begins.
    ``in_front_of``: the boxes share columns of the image, and the subject's mesh ends before the
    object's begins, along the horizontal direction away from the viewer.

    Attributes:
        contact_m: Meshes at most this far apart touch; also deepest overlap. Resting objects
            of shipped scenes were within 1.1 mm; physics collides convex parts.
        near: Largest distance of near objects, as share of the longest side of the smaller one.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE})
    type: Literal["relations"] = "relations"
    contact_m: float = Field(0.002, gt=0, le=0.02)
    near: float = Field(0.5, ge=0)

    def annotate_image(
        self, scene: Scene, assets: AssetLibrary, reading: SensorReading, truth: ImageTruth
    ) -> ImageTruth:
        """Fill in ``relations``."""
        boxes = {t.instance.instance_id: t.box for t in truth.objects if t.box is not None}
        shown = find_extents(reading.channels[Channel.INSTANCE]).keys()
        listed = {i.instance_id for i in scene.instances if not i.annotated} | boxes.keys()
        seen = shown & listed
        in_space = (r for r in self._in_space(scene, assets) if {r.subject, r.object} <= seen)
        shapes = _shapes(_geometry(scene), assets)
        away = _away(reading.camera.T_world_camera)
        return replace(truth, relations=_ordered([*in_space, *_views(boxes, shapes, away)]))

    def annotate_frame(
        self, scenes: Mapping[str, Scene], assets: AssetLibrary, truth: EgoTruth
    ) -> EgoTruth:
        """Fill in ``relations`` in space."""
        return replace(truth, relations=_ordered(self._in_space(scenes[""], assets)))

    def _in_space(self, scene: Scene, assets: AssetLibrary) -> tuple[Relation, ...]:
        return _relate(_geometry(scene), assets, self.contact_m, self.near)


@dataclass(frozen=True, slots=True)
class Thing:
    """An instance as far as relations depend on it.

    Attributes:
        instance_id: Its id.
        annotated: Whether it is annotated.
        pieces: Mesh, pose and scale of its bodies.
        motion: ``dynamic`` if any of its bodies is, else the motion of its first body.
        box: Pose and corners of its box.
        robot: Whether it is a robot.
        shell: Whether it is a surface of a room.
    """

    instance_id: int
    annotated: bool
    pieces: tuple[tuple[str, SE3, float], ...]
    motion: Motion
    box: tuple[SE3, tuple[float, float, float], tuple[float, float, float]]
    robot: bool
    shell: bool


class Shape:
    """The geometry of one object in the world, computed when it is needed."""

    def __init__(self, thing: Thing, assets: AssetLibrary) -> None:
        self.thing = thing
        self._assets = assets
        pose, low, high = thing.box
        corners = pose.apply(np.array(list(itertools.product(*zip(low, high, strict=True)))))
        self.low_m, self.high_m = corners.min(0), corners.max(0)
        self.center_m: Array = corners.mean(0)
        self.longest_m = max(b - a for a, b in zip(low, high, strict=True))

    @cached_property
    def triangles_m(self) -> Array:
        """Its meshes, [n, 3, 3]."""
        parts = []
        for asset, pose, scale in self.thing.pieces:
            mesh = self._assets.mesh(asset)
            corners = pose.apply(mesh.vertices_m.astype(np.float64) * scale)
            parts.append(corners[mesh.faces])
        return np.concatenate(parts)

    @cached_property
    def hull(self) -> Array | None:
        """Planes of its convex hull, [n, 4]: ``normal . p + offset <= 0`` inside; None if flat."""
        from scipy.spatial import ConvexHull, QhullError

        try:
            return np.asarray(ConvexHull(self.triangles_m.reshape(-1, 3)).equations)
        except QhullError:
            return None

    @cached_property
    def heights_m(self) -> tuple[float, float]:
        """The lowest and the highest point; boxes of tilted objects reach farther."""
        z_m = self.triangles_m[..., 2]
        return float(z_m.min()), float(z_m.max())

    def is_around(self, other: "Shape") -> bool:
        """Whether it contains another shape, as ``Relations`` defines it."""
        center = other.center_m
        if (center < self.low_m).any() or (center > self.high_m).any() or self.hull is None:
            return False
        if not (self.hull[:, :3] @ center + self.hull[:, 3] <= 0.0).all():
            return False
        triangles = other.triangles_m
        sides = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        area = np.sqrt((sides * sides).sum(1))
        contained = (triangles.mean(1) @ self.hull[:, :3].T + self.hull[:, 3] <= 0.0).all(1)
        if area[contained].sum() < 0.5 * area.sum():
            return False
        hits = hits_by_rays(np.tile(center, (len(COMPASS), 1)), COMPASS, self.triangles_m)
        return bool(np.isfinite(hits).any(axis=1).all())


Geometry = tuple[Thing, ...]


def _geometry(scene: Scene) -> Geometry:
    bodies: dict[int, list[Body]] = {}
    for body in scene.bodies:
        bodies.setdefault(body.instance_id, []).append(body)
    robots = {a.instance_id for a in scene.articulations}
    return tuple(
        _thing(i, bodies[i.instance_id], i.instance_id in robots)
        for i in scene.instances
        if i.instance_id in bodies
    )


def _thing(instance: Instance, bodies: Sequence[Body], robot: bool) -> Thing:
    moves = any(body.motion == "dynamic" for body in bodies)
    return Thing(
        instance.instance_id,
        instance.annotated,
        tuple((body.asset, body.T_world_body, body.scale) for body in bodies),
        "dynamic" if moves else bodies[0].motion,
        (instance.T_world_instance, instance.box_min_m, instance.box_max_m),
        robot,
        instance.category in SHELL,
    )


@lru_cache(maxsize=2)
def _shapes(things: Geometry, assets: AssetLibrary) -> dict[int, Shape]:
    return {thing.instance_id: Shape(thing, assets) for thing in things}


@lru_cache(maxsize=2)
def _relate(
    things: Geometry, assets: AssetLibrary, contact_m: float, near: float
) -> tuple[Relation, ...]:
    """Relations in space; cached, since all cameras of a sample share them."""
    shapes = list(_shapes(things, assets).values())
    if len(shapes) < 2:
        return ()
    low, high = (np.array([getattr(s, name) for s in shapes]) for name in ("low_m", "high_m"))
    longest = np.array([s.longest_m for s in shapes])
    found: list[Relation] = []
    for k, one in enumerate(shapes):
        reach = np.maximum(near * np.minimum(longest, longest[k]), contact_m)[k + 1 :, None]
        apart = (low[k + 1 :] > high[k] + reach) | (low[k] > high[k + 1 :] + reach)
        for j in np.flatnonzero(~apart.any(1)):
            other = shapes[k + 1 + int(j)]
            if one.thing.annotated or other.thing.annotated:
                found += _relate_pair(one, other, contact_m, float(reach[j, 0]))
    return tuple(found)


def _relate_pair(one: Shape, other: Shape, contact_m: float, near_m: float) -> Iterator[Relation]:
    """Relations in space of two objects, in both directions."""
    contacts = find_contacts(one.triangles_m, other.triangles_m, contact_m)
    close = False
    for a, b, touching in ((one, other, contacts), (other, one, contacts.inverse())):
        if not a.thing.annotated:
            continue

        def relate(predicate: Predicate, a: Shape = a, b: Shape = b) -> Relation:
            return Relation(a.thing.instance_id, predicate, b.thing.instance_id)

        held = b.thing.robot and bool((touching.normals @ touching.normals.T < OPPOSITE).any())
        supported = (
            _may_carry(b, a, contact_m)
            and float(touching.normals[:, 2].sum()) > 0.0
            and _lies_over(a, b, touching, contact_m)
        )
        inside = b.is_around(a)
        close |= held or supported or inside
        if held:
            yield relate("held_by")
        if inside:
            yield relate("inside")
        if supported:
            yield relate("supported_by")
            if not (inside or held):
                yield relate("on")
    both = one.thing.annotated and other.thing.annotated
    if both and not close and are_within(one.triangles_m, other.triangles_m, near_m):
        first, second = sorted((one.thing.instance_id, other.thing.instance_id))
        yield Relation(first, "near", second)


def _may_carry(below: Shape, above: Shape, contact_m: float) -> bool:
    """Whether one object may support another; fixed objects that stand side by side do not."""
    if above.thing.motion == "dynamic":
        return True
    if above.thing.shell or below.thing.motion == "dynamic":
        return False
    low_m, _ = above.heights_m
    return low_m > below.heights_m[0] + contact_m or low_m >= below.heights_m[1] - contact_m


def _lies_over(above: Shape, below: Shape, contacts: Contacts, contact_m: float) -> bool:
    """Whether one object meets another from above: where they touch, the one is over the other.

    Edges that pass each other at a distance have a slanted normal, too, and carry nothing. The
    contacts are from the upper object to the lower one.
    """
    up = contacts.normals[:, 2] >= UPWARD
    upper_m, gaps_m = contacts.points_m[up], contacts.gaps_m[up, None]
    offsets_m = gaps_m * contacts.normals[up]
    if (np.hypot(offsets_m[:, 0], offsets_m[:, 1]) <= PLUMB_M).any():
        return True
    # Rays begin behind the surfaces, which may overlap by the same distance.
    down_m, length_m = np.array([0.0, 0.0, -contact_m]), contact_m + contact_m / UPWARD
    return meet_along(upper_m - down_m, down_m, below.triangles_m, length_m) or meet_along(
        upper_m - offsets_m + down_m, -down_m, above.triangles_m, length_m
    )


def _away(T_world_camera: SE3) -> Array:
    """Horizontal unit vector away from the viewer: across the image's rows, also straight down."""
    x, y, _ = T_world_camera.rotation()[:, 0]
    return np.array([-y, x, 0.0]) / max(float(np.hypot(x, y)), 1e-12)


def _views(
    boxes: Mapping[int, BoxPx], shapes: Mapping[int, Shape], away: Array
) -> Iterator[Relation]:
    depths: dict[int, tuple[float, float]] = {}

    def depth(number: int) -> tuple[float, float]:
        if number not in depths:
            along = shapes[number].triangles_m.reshape(-1, 3) @ away
            depths[number] = (float(along.min()), float(along.max()))
        return depths[number]

    for a, b in itertools.permutations(boxes, 2):
        if boxes[a].x_max <= boxes[b].x_min:
            yield Relation(a, "left_of", b)
        elif boxes[b].x_max > boxes[a].x_min and depth(a)[1] <= depth(b)[0]:
            yield Relation(a, "in_front_of", b)


def _ordered(relations: Iterable[Relation]) -> tuple[Relation, ...]:
    return tuple(sorted(set(relations), key=lambda r: (r.subject, r.object, r.predicate)))
