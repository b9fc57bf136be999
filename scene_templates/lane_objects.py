"""Groups of objects along lanes: traffic, people, houses, trees, lamps."""

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gen_data.core import errors, interfaces
from gen_data.core.lane_geometry import LaneLine, pose_on_lane
from gen_data.core.members import Member, add_members
from gen_data.core.scene import LaneKind, ObjectGroup, Scene
from gen_data.scene_templates import element, objects


class LaneObjects(element.Element):
    """Objects along lanes; the ``lane_objects`` randomizer of the same name draws them.

    Attributes:
        lanes: Kinds of lanes to use.
        assets: Assets to choose from.
        count: Nominal number of objects, evenly spread.
        facing: Direction of the fronts: along the lane, or to its left; the street is on the left
            of all lanes except driving lanes.
        annotate: Whether to write labels for them.
    """

    type: Literal["lane_objects"] = "lane_objects"
    lanes: tuple[LaneKind, ...] = Field(min_length=1)
    assets: objects.AssetChoice = Field(examples=[{"tags": ["car"]}])
    count: int = Field(0, ge=0, le=2000)
    facing: Literal["along", "left"] = "along"
    annotate: bool = True

    def leave_out(self, scene: Scene) -> Scene:
        """Return the scene with a group of no objects, whose name randomizers accept."""
        return replace(scene, groups=(*scene.groups, objects.empty_group(self.name, "along")))

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add the group, and its objects evenly along the lanes."""
        own = [lane for lane in scene.lanes if lane.kind in self.lanes]
        if not own and self.count:
            known = ", ".join(sorted({lane.kind for lane in scene.lanes})) or "none"
            raise errors.ConfigError(
                f"elements.{self.name}.lanes: there is no lane of kind {' or '.join(self.lanes)}; "
                f"there is {known}: list the road before the objects along it"
            )
        group = ObjectGroup(
            name=self.name,
            surfaces=(),
            assets=self.assets.resolve(assets, f"elements.{self.name}.assets"),
            count=self.count,
            placement="along",
            annotated=self.annotate,
            lanes=self.lanes,
            facing=self.facing,
        )
        scene = replace(scene, groups=(*scene.groups, group))
        if not self.count:
            return scene
        lines = [LaneLine(lane) for lane in own]
        total_m = sum(line.length_m for line in lines)
        members = []
        for number in range(self.count):
            line, at_m = _locate(lines, total_m * (number + 0.5) / self.count)
            asset = group.assets[(number * len(group.assets)) // self.count]
            bounds_m = assets.bounds_m(asset)
            pose = pose_on_lane(line.pose(at_m), line.lane, bounds_m, self.facing)
            members.append(Member(asset, pose.rounded(), collides=False))
        return add_members(scene, group, members, assets)


def _locate(lines: list[LaneLine], at_m: float) -> tuple[LaneLine, float]:
    """Find the line, and the arc length on it, at an arc length along all lines together."""
    for line in lines[:-1]:
        if at_m < line.length_m:
            return line, at_m
        at_m -= line.length_m
    return lines[-1], at_m
