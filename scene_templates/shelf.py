"""Shelves with several boards."""

from typing import Literal

from pydantic import Field

from gen_data.assets.families import declared
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Scene
from gen_data.scene_templates.element import PlacedElement, add_static, parametric_id

SIDE_M = 0.03
"""Width lost to each side board."""


class Shelf(PlacedElement):
    """A shelf open towards -Y; ``<name>/0`` is its lowest board.

    Attributes:
        size_m: Width, depth and height.
        levels: Number of boards.
        style: Type of shelf: bookcase, rack, or the inside of an open refrigerator.
        annotate: Whether to write labels for it.
    """

    type: Literal["shelf"] = "shelf"
    size_m: tuple[float, float, float] = (0.9, 0.32, 1.6)
    levels: int = Field(4, ge=1, le=12)
    style: Literal["bookcase", "rack", "refrigerator"] = "bookcase"
    annotate: bool = False

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add a static body, its instance, and one surface per board."""
        asset = parametric_id("shelf", size_m=self.size_m, levels=self.levels, style=self.style)
        pose = self.pose(scene)
        scene = add_static(scene, assets, self.name, asset, pose, annotated=self.annotate)
        board_m = (self.size_m[0] - 2 * SIDE_M, self.size_m[1] - SIDE_M)
        clearance_m = declared("shelf", "clearance_m")(self.size_m, self.levels)
        levels_m = declared("shelf", "levels_m")(self.size_m, self.levels)
        for level, height_m in enumerate(levels_m):
            name = f"{self.name}/{level}"
            scene = self.add_surface(scene, height_m, board_m, name=name, clearance_m=clearance_m)
        return scene
