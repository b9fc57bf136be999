"""One thing that stands still and is only looked at."""

from __future__ import annotations

from typing import Literal

from generator.core.interfaces import AssetIndex
from generator.core.scene import Scene
from scene_templates.element import PlacedElement, standing, with_static


class Prop(PlacedElement):
    """Any asset, standing still: a gantry, a plinth, a tray.

    Attributes:
        asset: Its id, such as ``gantry?size_m=1.6,1,1.8``.
        annotate: Whether labels are written for it.
    """

    type: Literal["prop"] = "prop"
    asset: str
    annotate: bool = False

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """A static body and its instance."""
        return with_static(
            scene,
            assets,
            name=self.name,
            asset=self.asset,
            T_world_body=standing(assets, self.asset, self.pose(scene)),
            annotated=self.annotate,
        )
