"""Open containers."""

from typing import Literal

from gen_data.assets.families import declared
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Scene
from gen_data.scene_templates.element import PlacedElement, add_static, parametric_id


class Bin(PlacedElement):
    """A container whose floor is a walled surface, on which dropped parts stay.

    Attributes:
        size_m: Outer length, width and height.
        annotate: Whether to write labels for it.
    """

    type: Literal["bin"] = "bin"
    size_m: tuple[float, float, float] = (0.6, 0.4, 0.22)
    annotate: bool = False

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add a static body, its instance, and the surface of its floor."""
        asset, pose = parametric_id("bin", size_m=self.size_m), self.pose(scene)
        scene = add_static(scene, assets, self.name, asset, pose, annotated=self.annotate)
        length_m, width_m, floor_m = declared("bin", "interior_m")(self.size_m)
        return self.add_surface(scene, floor_m, (length_m, width_m), clearance_m=1.5, walled=True)
