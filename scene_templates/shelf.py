"""Shelves with several boards."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gen_data.generator.assets.procedural.furniture import shelf_clearance_m, shelf_levels_m
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Scene, SupportSurface
from gen_data.generator.core.se3 import SE3
from gen_data.scene_templates.element import PlacedElement, add_static, add_surface, parametric_id

SIDE_M = 0.03
"""Width lost to each side board."""


class Shelf(PlacedElement):
    """A shelf open towards -Y; ``<name>/0`` is its lowest board.

    Attributes:
        size_m: Width, depth and height.
        levels: Number of boards.
        style: Type of shelf: bookcase or rack.
        annotate: Whether to write labels for it.
    """

    type: Literal["shelf"] = "shelf"
    size_m: tuple[float, float, float] = (0.9, 0.32, 1.6)
    levels: int = Field(4, ge=1, le=12)
    style: Literal["bookcase", "rack"] = "bookcase"
    annotate: bool = False

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add a static body, its instance, and one surface per board."""
        T_world_shelf = self.pose(scene)
        asset = parametric_id("shelf", size_m=self.size_m, levels=self.levels, style=self.style)
        scene = add_static(
            scene,
            assets,
            name=self.name,
            asset=asset,
            T_world_body=T_world_shelf,
            annotated=self.annotate,
        )
        clearance_m = shelf_clearance_m(self.size_m, self.levels)
        for level, height_m in enumerate(shelf_levels_m(self.size_m, self.levels)):
            board = SupportSurface(
                name=f"{self.name}/{level}",
                body=self.name,
                T_world_surface=(T_world_shelf @ SE3((0.0, 0.0, height_m))).rounded(),
                size_m=(self.size_m[0] - 2 * SIDE_M, self.size_m[1] - SIDE_M),
                clearance_m=clearance_m,
            )
            scene = add_surface(scene, board)
        return scene
