"""Boughs that fruit hangs from."""

from typing import Literal

from pydantic import Field

from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Scene
from gen_data.scene_templates.element import PlacedElement, add_background, parametric_id


class FruitBough(PlacedElement):
    """A limb of a tree with leaves, in which ``objects`` with the placement ``hang`` hang.

    It is background without an instance: cameras may be among its leaves.

    Attributes:
        size_m: Length, depth and height of the foliage.
        look: Number of its shape and colours.
    """

    type: Literal["fruit_bough"] = "fruit_bough"
    size_m: tuple[float, float, float] = (1.1, 0.8, 0.8)
    look: int = Field(0, ge=0)

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add a static body, and the surface below which nothing hangs."""
        asset = parametric_id("fruit_bough", size_m=self.size_m, seed=self.look)
        scene = add_background(scene, assets, self.name, asset, self.pose(scene))
        return self.add_surface(scene, 0.0, self.size_m[:2], clearance_m=self.size_m[2])
