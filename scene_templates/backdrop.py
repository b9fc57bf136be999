"""Backgrounds of scenes without a room."""

from typing import Literal

from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Scene
from gen_data.scene_templates.element import PlacedElement, add_background, stand_upright


class Backdrop(PlacedElement):
    """Flat ground (``plane``) or a studio backdrop (``backdrop``), without a label.

    Attributes:
        asset: ``plane`` or ``backdrop``, optionally with a size: ``plane?size_m=6,6``.
    """

    type: Literal["backdrop"] = "backdrop"
    asset: str = "plane"

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add a static body; background has no instance."""
        pose = stand_upright(assets, self.asset, self.pose(scene))
        return add_background(scene, assets, self.name, self.asset, pose)
