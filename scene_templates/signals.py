"""Traffic lights of a junction."""

import math
from typing import ClassVar, Literal

from pydantic import Field

from gen_data.core import errors, interfaces, lane_geometry, se3
from gen_data.core.scene import Lane, Scene
from gen_data.scene_templates import element

SIGNAL_M = 0.6
"""Distance of the pole from the kerb."""


class Signals(element.Element):
    """A traffic light at every road into a junction, facing the incoming traffic.

    Attributes:
        junction: Name of the junction; list its roads before this element.
        mount: Mounting of the lights: on poles, or on mast arms above the road.
        beside_m: Width between the outer lane and the kerb: parking strips and verges.
        seed: Seed of the lights' design.
        annotate: Whether to write labels for them.
    """

    related: ClassVar[tuple[str, ...]] = ("junction",)

    type: Literal["signals"] = "signals"
    junction: str = Field(examples=["cross"])
    mount: Literal["pole", "mast_arm"] = "pole"
    beside_m: float = Field(0.0, ge=0, le=20)
    seed: int = Field(0, ge=0, le=1_000_000)
    annotate: bool = False

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add one light per incoming road."""
        crossing = {lane.name for lane in scene.lanes if lane.road == self.junction}
        coming = [lane for lane in scene.lanes if _is_entry(lane, crossing, self.junction)]
        if not coming:
            raise errors.ConfigError(
                f"elements.{self.name}.junction: no road leads to a junction '{self.junction}'; "
                "list the junction and its roads before its signals"
            )
        asset = element.parametric_id("traffic_light", mount=self.mount, seed=self.seed)
        for number, lane in enumerate(coming):
            line = lane_geometry.LaneLine(lane)
            right_m = 0.5 * lane.width_m + self.beside_m + SIGNAL_M
            stand = line.pose(line.length_m, -right_m) @ se3.SE3.about_z(math.pi)
            name, pose = f"{self.name}/{number}", element.stand_upright(assets, asset, stand)
            scene = element.add_static(scene, assets, name, asset, pose, annotated=self.annotate)
        return scene


def _is_entry(lane: Lane, crossing: set[str], junction: str) -> bool:
    """Whether a lane is the outermost one of a road that ends at the junction."""
    outermost = lane.kind == "driving" and not lane.right and lane.road != junction
    return outermost and bool(crossing & set(lane.successors))
