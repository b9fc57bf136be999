"""Streets with their ground, found by rays of Embree that fall onto its meshes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import Instance, Scene
from gen_data.pipeline import Pipeline
from tests.embree import RayCaster

GROUND = frozenset({"road", "junction", "ground", "parking_area"})
"""Families on whose meshes things stand."""


class Street:
    """A view of a street with its ground."""

    def __init__(self, scene: Scene, assets: AssetLibrary) -> None:
        self.scene = scene
        ground = [
            b for b in self.scene.bodies
            if b.instance_id == 0 and b.asset.partition("?")[0] in GROUND
        ]  # fmt: skip
        meshes = [assets.mesh(b.asset) for b in ground]
        self._caster = RayCaster(*(
            (b.T_world_body.apply(m.vertices_m.astype(np.float64)), m.faces)
            for b, m in zip(ground, meshes, strict=True)
        ))  # fmt: skip

    @classmethod
    def first(cls, pipeline: Pipeline) -> Street:
        return cls(pipeline.drawn_view(pipeline.accepted_scene(0), 0).scene, pipeline.assets)

    def ground_m(self, places_m: ArrayLike) -> NDArray[np.float64]:
        """Height of the uppermost ground at places [n, 2 or more]."""
        places = np.asarray(places_m, np.float64)
        above = np.column_stack([places[:, :2], np.full(len(places), 60.0)])
        return np.asarray(60.0 - self._caster.cast(above, (0.0, 0.0, -1.0)).distance, np.float64)

    def vehicles(self) -> list[Instance]:
        return [i for i in self.scene.instances if wheels_m(i) is not None]


def wheels_m(instance: Instance) -> NDArray[np.float64] | None:
    """Lowest points of four wheels in the world, [4, 3]; None for what has none."""
    hubs = [k.position_m for k in instance.keypoints if k.name.startswith("wheel")]
    if len(hubs) != 4:
        return None
    low = np.array([(x, y, instance.box_min_m[2]) for x, y, _ in hubs])
    return instance.T_world_instance.apply(low)
