"""Terrain around a street."""

from typing import Literal

from pydantic import Field

from gen_data.config.base_model import NAME_PATTERN
from gen_data.core import interfaces, se3
from gen_data.core.scene import Scene
from gen_data.scene_templates.element import PlacedElement, add_background, parametric_id
from gen_data.scene_templates.road import Ground


class GroundElement(PlacedElement):
    """A wide, slightly uneven plane just below the gutters of roads, without a label.

    Attributes:
        size_m: Extent along X and Y.
        cover: Material of the surface.
        relief_m: Depth of its hollows.
        level_m: Height of its highest points; the aprons of roads slope down to -0.1.
        seed: Seed of relief and texture.
    """

    type: Literal["ground"] = "ground"
    size_m: tuple[float, float] = (800.0, 800.0)
    cover: Ground = "grass"
    relief_m: float = Field(0.04, ge=0, le=1)
    level_m: float = -0.05
    seed: int = Field(0, ge=0, le=1_000_000)
    name: str = Field("ground", pattern=NAME_PATTERN)

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add a static body; background has no instance."""
        shape = {name: getattr(self, name) for name in ("size_m", "cover", "relief_m", "seed")}
        pose = self.pose(scene) @ se3.SE3((0.0, 0.0, self.level_m))
        return add_background(scene, assets, self.name, parametric_id("ground", **shape), pose)
