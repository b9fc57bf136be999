"""Open containers."""

import math
from typing import Literal

from pydantic import Field

from gen_data.assets.families import declared
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Scene
from gen_data.core.se3 import SE3
from gen_data.scene_templates.element import (
    PlacedElement,
    add_background,
    add_static,
    parametric_id,
)

_FAMILIES = {
    "bin": "bin", "crate": "open_crate", "bowl": "serving_bowl", "bag": "shopping_bag",
    "sink": "sink", "stand": "market_stand",
}  # fmt: skip

_HOLLOW = ("sink", "stand")


class Bin(PlacedElement):
    """A container whose floor is a walled surface, on which dropped objects stay.

    Attributes:
        style: ``bin``, ``crate`` of slats, round ``bowl``, shopping ``bag``, ``sink`` in a worktop,
            or ``stand`` of a shop: crates ``<name>/0`` to ``<name>/2`` that slope towards -Y.
        size_m: Outer length, width and height; of a bowl its diameter, twice, and its height.
        look: Number of the wood, plastic, cloth or glaze; not of a ``bin``.
        annotate: Whether to write labels for it. A sink or stand without is background: cameras may
            be inside its bounding box.
    """

    type: Literal["bin"] = "bin"
    style: Literal["bin", "crate", "bowl", "bag", "sink", "stand"] = "bin"
    size_m: tuple[float, float, float] = (0.6, 0.4, 0.22)
    look: int = Field(0, ge=0)
    annotate: bool = False

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add a static body, its instance, and the surface of its floor, or one per crate."""
        family = _FAMILIES[self.style]
        looks = {} if self.style == "bin" else {"seed": self.look}
        asset, pose = parametric_id(family, size_m=self.size_m, **looks), self.pose(scene)
        if self.style in _HOLLOW and not self.annotate:
            scene = add_background(scene, assets, self.name, asset, pose)
        else:
            scene = add_static(scene, assets, self.name, asset, pose, annotated=self.annotate)
        if self.style == "stand":
            return self._add_tiers(scene)
        length_m, width_m, floor_m = declared(family, "interior_m")(self.size_m)
        return self.add_surface(scene, floor_m, (length_m, width_m), clearance_m=1.5, walled=True)

    def _add_tiers(self, scene: Scene) -> Scene:
        tiers = declared("market_stand", "tiers")(self.size_m)
        for k, (at_m, tilt_rad, size_m) in enumerate(tiers):
            half = 0.5 * tilt_rad
            slope = SE3(at_m, (math.cos(half), math.sin(half), 0.0, 0.0))
            pose = (self.pose(scene) @ slope).rounded()
            scene = self.add_surface(scene, 0.0, size_m, name=f"{self.name}/{k}", clearance_m=0.5,
                                     walled=True, T_world_surface=pose)  # fmt: skip
        return scene
