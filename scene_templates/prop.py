"""One thing that stands still and is only looked at."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Scene
from gen_data.scene_templates.element import PlacedElement, add_static, stand_upright


class Prop(PlacedElement):
    """Any asset, standing still: a gantry, a plinth, a tray.

    Attributes:
        asset: Its id, such as ``gantry?size_m=1.6,1,1.8``.
        annotate: Whether labels are written for it.
        hollow: Cameras and lamps may be within its bounding box, as under a gantry. It counts as
            background then: it has no instance.
    """

    type: Literal["prop"] = "prop"
    asset: str
    annotate: bool = False
    hollow: bool = False

    @model_validator(mode="after")
    def _is_one_or_the_other(self) -> Prop:
        if self.annotate and self.hollow:
            raise ValueError("annotate and hollow exclude each other")
        return self

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """A static body and, unless it is background, its instance."""
        return add_static(
            scene,
            assets,
            name=self.name,
            asset=self.asset,
            T_world_body=stand_upright(assets, self.asset, self.pose(scene)),
            annotated=self.annotate,
            unlabelled=self.hollow,
        )
