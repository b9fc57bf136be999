"""Tables and other supports."""

from typing import Literal

from pydantic import Field

from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Scene
from gen_data.scene_templates import element

CLEARANCE_M = 1.5


class SurfaceElement(element.PlacedElement):
    """A table or another asset whose top supports other elements.

    Attributes:
        asset: ``table``, made to the sizes below, or the id of an asset with its own size.
        top_size_m: Length and width of a table's top.
        height_m: Height of a table's top.
        style: Type of table: legs, trestle or bench.
        annotate: Whether to write labels for it.
    """

    type: Literal["surface"] = "surface"
    asset: str = "table"
    top_size_m: tuple[float, float] = (1.2, 0.8)
    height_m: float = Field(0.74, gt=0, le=2)
    style: Literal["legs", "trestle", "bench"] = "legs"
    annotate: bool = False

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add a static body, its instance, and the surface of its top."""
        asset = self.asset
        if asset == "table":
            size_m = (*self.top_size_m, self.height_m)
            asset = element.parametric_id("table", size_m=size_m, style=self.style)
        pose = element.stand_upright(assets, asset, self.pose(scene))
        scene = element.add_static(scene, assets, self.name, asset, pose, annotated=self.annotate)
        length_m, width_m, height_m = element.extent_m(assets, asset)
        return self.add_surface(scene, height_m, (length_m, width_m), clearance_m=CLEARANCE_M)
