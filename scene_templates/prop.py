"""Single static objects."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Scene
from gen_data.scene_templates.element import (
    PlacedElement,
    add_background,
    add_static,
    stand_upright,
)


class Prop(PlacedElement):
    """A static asset, such as a gantry, a plinth or a tray.

    Attributes:
        asset: Id of the asset, such as ``gantry?size_m=1.6,1,1.8``.
        annotate: Whether to write labels for it.
        hollow: Whether cameras and lamps may be inside its bounding box, as under a gantry; it is
            background then, without an instance.
    """

    type: Literal["prop"] = "prop"
    asset: str = Field(examples=["mug?seed=0"])
    annotate: bool = False
    hollow: bool = False

    @model_validator(mode="after")
    def _is_consistent(self) -> Prop:
        if self.annotate and self.hollow:
            raise ValueError("annotate and hollow exclude each other")
        return self

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add a static body and, unless it is background, its instance."""
        pose = stand_upright(assets, self.asset, self.pose(scene))
        if self.hollow:
            return add_background(scene, assets, self.name, self.asset, pose)
        return add_static(scene, assets, self.name, self.asset, pose, annotated=self.annotate)
