"""Cameras on lanes: dash cameras, cameras of pedestrians, cameras on poles."""

import math
from collections import Counter
from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetIndex
from gen_data.core.lane_geometry import LaneLine
from gen_data.core.scene import Camera, LaneKind, Scene
from gen_data.core.se3 import SE3, Vec3, look_at
from gen_data.core.streams import Rng, pick_by_weight
from gen_data.randomizers.base import RandomizerBase, check_known
from gen_data.randomizers.daylight import is_dark
from gen_data.randomizers.free_space import Footprint, Ground, hidden_share, is_clear, make_ground
from gen_data.randomizers.vehicle_lights import dipped_beam
from gen_data.traffic.lane_routes import project_on_lane

TRIES = 64
BESIDE_M = 12.0
"""Distance from a lane's middle within which objects count as ahead of a camera on it."""
HIDDEN_MAX = 0.1
"""Largest share of an image that near bodies may hide."""


class CameraOnLane(RandomizerBase):
    """Puts every camera that is not on a rig above a lane, looking along it.

    Attributes:
        lanes: Kinds of lanes to use.
        roads: Names of the elements whose lanes to use; empty = all.
        junctions: Whether lanes across junctions count, too, as often as drives pass them: of lanes
            with a common start, a vehicle takes one.
        height_m: Height above the ground.
        lateral: Position across the lane: -1 right edge, 0 middle, 1 left edge.
        yaw_deg: Rotation to the left of the lane's direction.
        pitch_deg: Upward tilt.
        roll_deg: Clockwise rotation about the viewing direction.
        reversed: Whether the camera looks against the lane's direction.
        ahead_m: Smallest length of lane in the viewing direction; at most half of the lane.
        free_m: Length and width of free ground around the camera, for the vehicle that carries
            it; the camera is at 30 % of the length from the front.
        clearance_m: Smallest distance to any body.
        near_m: Distance within which bodies may hide a tenth of the image at most, tested with
            their bounding boxes: no view out of a tree; 0 = not tested.
        towards: Name of an object group, such as people: one of its members is ahead of the camera,
            near the same lane; empty = the camera is anywhere.
        towards_m: Distance to that member along the lane.
        sought: Whether a view is drawn towards the group; otherwise, or without a free place
            before any member, the camera is anywhere.
        beam_cd: Luminous intensity of each of the carrier's two dipped beams, lit in the dark; 0 =
            no beams.
    """

    type: Literal["camera_on_lane"] = "camera_on_lane"
    stage: Literal["scene", "view"] = "view"
    lanes: tuple[LaneKind, ...] = ("driving",)
    roads: tuple[str, ...] = ()
    junctions: bool = False
    height_m: dist.Positive = dist.Constant(1.65)
    lateral: Annotated[dist.Scalar, dist.Bounds(-1, 1)] = dist.Constant(0.0)
    yaw_deg: dist.Scalar = dist.Normal(0.0, 1.0, clip=(-3.0, 3.0))
    pitch_deg: Annotated[dist.Scalar, dist.Bounds(-89, 89)] = dist.Normal(
        0.0, 0.7, clip=(-2.0, 2.0)
    )
    roll_deg: dist.Scalar = dist.Normal(0.0, 0.5, clip=(-2.0, 2.0))
    reversed: dist.Flag = dist.Constant(False)
    ahead_m: float = Field(40.0, ge=0)
    free_m: tuple[float, float] = (4.6, 1.9)
    clearance_m: float = Field(0.3, ge=0)
    near_m: float = Field(0.0, ge=0)
    towards: str = ""
    towards_m: dist.Positive = dist.Uniform(6.0, 30.0)
    sought: dist.Flag = dist.Constant(True)
    beam_cd: dist.NonNegative = dist.Constant(0.0)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with all cameras without a rig at one pose."""
        lines = [LaneLine(lane) for lane in scene.lanes if lane.kind in self.lanes]
        lines = [
            line
            for line in lines
            if (self.junctions or not line.lane.junction)
            and (not self.roads or line.lane.road in self.roads)
        ]
        if not lines:
            known = ", ".join(sorted({lane.kind for lane in scene.lanes})) or "none"
            raise ConfigError(
                f"randomizers.{self.name}.lanes: the scene has no lane of kind "
                f"{' or '.join(self.lanes)}; there is {known}"
            )
        groups = {group.name for group in scene.groups}
        ground = make_ground((b for b in scene.bodies if b.group in groups), assets)
        targets = self._draw_targets(scene, rng)
        for number in range(TRIES):
            wanted = targets if 2 * number < TRIES else ()
            pose = self._draw_pose(lines, wanted, ground, scene, assets, rng)
            if pose is not None:
                cameras = tuple(c if c.rig else _move_camera(c, pose[1]) for c in scene.cameras)
                lit = replace(scene, cameras=cameras)
                return self._add_beams(lit, pose[0], self.beam_cd.draw(rng))
        remedy = "other lanes, a smaller free_m or near_m, or less traffic"
        raise self.reject("no free place for a camera on a lane", remedy)

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Raise ConfigError if the group to look at is unknown."""
        super().check(scene, assets)
        if self.towards:
            known = {group.name: group for group in scene.groups}
            where = f"randomizers.{self.name}.towards: the template has no object group"
            check_known(self.towards, known, where)

    def _draw_targets(self, scene: Scene, rng: Rng) -> tuple[Vec3, ...]:
        """Places of the objects one of which the view is to have ahead; empty = none of them."""
        if not self.towards or not self.sought.draw(rng):
            return ()
        members = (body for body in scene.bodies if body.group == self.towards)
        return tuple(body.T_world_body.translation_m for body in members)

    def _draw_station_before(
        self, target: Vec3, lines: list[LaneLine], rng: Rng, *, turned: bool
    ) -> tuple[LaneLine, float] | None:
        """Lane and arc length from where a point is ahead; None if there is no such place."""
        found = [(line, project_on_lane(line, target[0], target[1])) for line in lines]
        near = [pair for pair in found if pair[1].away_m <= BESIDE_M]
        away_m = self.towards_m.draw(rng)
        if not near:
            return None
        line, place = near[pick_by_weight([1.0] * len(near), float(rng.uniform()))]
        at_m = place.at_m + (away_m if turned else -away_m)
        return (line, at_m) if 0.0 <= at_m <= line.length_m else None

    def _draw_pose(
        self,
        lines: list[LaneLine],
        targets: tuple[Vec3, ...],
        ground: Ground,
        scene: Scene,
        assets: AssetIndex,
        rng: Rng,
    ) -> tuple[SE3, SE3] | None:
        """Draw ``T_world_rig`` on the ground and ``T_world_camera``; None if not free."""
        starts = Counter(line.lane.center_m[0] for line in lines)
        weights = [line.length_m / starts[line.lane.center_m[0]] for line in lines]
        line = lines[pick_by_weight(weights, float(rng.uniform()))]
        turned = self.reversed.draw(rng)
        ahead_m = min(self.ahead_m, 0.5 * line.length_m)
        low, high = (ahead_m, line.length_m) if turned else (0.0, line.length_m - ahead_m)
        at_m = float(rng.uniform(low, high))
        if targets:
            target = targets[pick_by_weight([1.0] * len(targets), float(rng.uniform()))]
            station = self._draw_station_before(target, lines, rng, turned=turned)
            if station is None:
                return None
            line, at_m = station
        left_m = 0.5 * line.lane.width_m * self.lateral.draw(rng)
        height_m = self.height_m.draw(rng)
        yaw, pitch, roll = (
            math.radians(angle.draw(rng)) for angle in (self.yaw_deg, self.pitch_deg, self.roll_deg)
        )
        back = math.pi if turned else 0.0
        T_world_rig = line.pose(at_m, left_m) @ SE3.about_z(back)
        length_m, width_m = self.free_m
        T_world_middle = T_world_rig @ SE3((-0.2 * length_m, 0.0, 0.0))
        half = (0.5 * length_m, 0.5 * width_m)
        bounds_m = ((-half[0], -half[1], 0.0), (half[0], half[1], 1.0))
        if not ground.is_free(Footprint.of(T_world_middle, bounds_m)):
            return None
        T_world_turned = T_world_rig @ SE3.about_z(yaw)
        eye = (T_world_turned @ SE3((0.0, 0.0, height_m))).translation_m
        if not is_clear(eye, scene, assets, self.clearance_m):
            return None
        ahead = (math.cos(pitch), 0.0, height_m + math.sin(pitch))
        target = (T_world_turned @ SE3(ahead)).translation_m
        T_world_camera = look_at(eye, target, roll)
        if self.near_m > 0.0:
            placed = (_move_camera(c, T_world_camera) for c in scene.cameras if not c.rig)
            if any(hidden_share(c, scene, assets, self.near_m) > HIDDEN_MAX for c in placed):
                return None
        return T_world_rig, T_world_camera

    def _add_beams(self, scene: Scene, T_world_rig: SE3, beam_cd: float) -> Scene:
        """Return the scene with the carrier's headlights on if it is dark."""
        if beam_cd == 0.0 or not is_dark(scene):
            return scene
        ahead_m = 0.3 * self.free_m[0]
        beams = tuple(
            dipped_beam(f"{self.name}/{side}", T_world_rig @ SE3((ahead_m, y, 0.65)), beam_cd)
            for side, y in (("left", 0.6), ("right", -0.6))
        )
        return replace(scene, lights=(*scene.lights, *beams))


def _move_camera(camera: Camera, T_world_camera: SE3) -> Camera:
    return replace(camera, T_world_camera=T_world_camera.rounded())
