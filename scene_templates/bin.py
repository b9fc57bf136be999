"""An open container."""

from __future__ import annotations

from typing import Literal

from generator.assets.procedural.furniture import bin_interior_m
from generator.core.interfaces import AssetIndex
from generator.core.scene import Scene, Surface
from generator.core.se3 import SE3
from scene_templates.element import PlacedElement, parametric, with_static, with_surface


class Bin(PlacedElement):
    """A container whose floor is a walled surface: parts dropped in it stay in it.

    Attributes:
        size_m: Outer length, width and height.
        annotate: Whether labels are written for it.
    """

    type: Literal["bin"] = "bin"
    size_m: tuple[float, float, float] = (0.6, 0.4, 0.22)
    annotate: bool = False

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """A static body, its instance, and the surface of its floor."""
        T_world_bin = self.pose(scene)
        scene = with_static(
            scene,
            assets,
            name=self.name,
            asset=parametric("bin", size_m=self.size_m),
            T_world_body=T_world_bin,
            annotated=self.annotate,
        )
        length_m, width_m, floor_m = bin_interior_m(self.size_m)
        floor = Surface(
            name=self.name,
            body=self.name,
            T_world_surface=(T_world_bin @ SE3((0.0, 0.0, floor_m))).rounded(),
            size_m=(length_m, width_m),
            clearance_m=1.5,
            walled=True,
        )
        return with_surface(scene, floor)
