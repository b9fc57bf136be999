"""Open containers."""

from typing import Literal

from pydantic import Field

from gen_data.assets.families import declared
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Scene
from gen_data.scene_templates.element import PlacedElement, add_static, parametric_id

_FAMILIES = {"bin": "bin", "crate": "open_crate", "bowl": "serving_bowl"}


class Bin(PlacedElement):
    """A container whose floor is a walled surface, on which dropped objects stay.

    Attributes:
        style: ``bin``, ``crate`` of slats, or round ``bowl``.
        size_m: Outer length, width and height; of a bowl its diameter, twice, and its height.
        look: Number of the wood, plastic or glaze of crates and bowls.
        annotate: Whether to write labels for it.
    """

    type: Literal["bin"] = "bin"
    style: Literal["bin", "crate", "bowl"] = "bin"
    size_m: tuple[float, float, float] = (0.6, 0.4, 0.22)
    look: int = Field(0, ge=0)
    annotate: bool = False

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add a static body, its instance, and the surface of its floor."""
        family = _FAMILIES[self.style]
        looks = {} if self.style == "bin" else {"seed": self.look}
        asset, pose = parametric_id(family, size_m=self.size_m, **looks), self.pose(scene)
        scene = add_static(scene, assets, self.name, asset, pose, annotated=self.annotate)
        length_m, width_m, floor_m = declared(family, "interior_m")(self.size_m)
        return self.add_surface(scene, floor_m, (length_m, width_m), clearance_m=1.5, walled=True)
