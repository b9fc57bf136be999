"""Flights of a drone over a street, with a gimbal that looks at it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core import errors, interfaces, lane_geometry, motion, scene_time, streams
from gen_data.core.scene import Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.core.streams import pick_by_weight
from gen_data.randomizers.base import RandomizerBase
from gen_data.randomizers.free_space import is_clear

GRAVITY_M_S2 = 9.80665
TRIES = 64
STEP_S = 0.05
"""Time between knots of the trajectory."""
MARGIN_S = 1.0
"""Flight before the first and after the last instant: exposures begin and end there."""
LEAN_PER_M_S = math.radians(1.2)
"""Forward lean per speed [rad s/m]: 12 degrees at 10 m/s (assumed)."""


class DroneFlight(RandomizerBase):
    """Flies the template's drone over a lane; list it after buildings and trees, and after traffic.

    The drone flies at constant height and speed through coordinated turns: its bank angle swings
    about a mean, and turns the heading at ``g tan(bank) / speed`` [rad/s]: the specific
    force stays in the airframe's plane of symmetry (Stevens, Lewis and Johnson, "Aircraft Control
    and Simulation", 3rd edition, section 3.6). It leans forward with its speed. The gimbal keeps
    its angle to the horizon and to the heading, except for a residual of bank and lean. At time 0
    the optical axis meets the ground near a lane.

    Attributes:
        drone: Name of the template's ``drone`` element.
        roads: Names of the elements whose driving lanes to look at; empty = all.
        duration_s: Duration of the flight from time 0; limits the length of sequences.
        height_m: Height above the ground.
        speed_m_s: Speed over the ground.
        heading_deg: Heading at time 0, to the left of the lane's direction.
        bank_deg: Mean bank, positive in left turns; 0 = on average straight ahead.
        swing_deg: Largest deviation of the bank from its mean.
        period_s: Duration of one swing to both sides.
        pitch_deg: Angle of the optical axis to the horizon; -90 = straight down.
        yaw_deg: Angle of the optical axis to the left of the heading.
        from_end_m: Smallest distance of the point looked at from where the road network ends.
        offset_m: Distance of the point looked at from the lane's centre line, to its left.
        residual: Share of bank and lean that the gimbal leaves.
        clearance_m: Smallest distance to any body.
    """

    type: Literal["drone_flight"] = "drone_flight"
    drone: str = "drone"
    roads: tuple[str, ...] = ()
    duration_s: float = Field(10.0, gt=0, le=600)
    height_m: dist.Positive = dist.Uniform(30.0, 80.0)
    speed_m_s: dist.Positive = dist.Uniform(2.0, 12.0)
    heading_deg: dist.Scalar = dist.Uniform(-180.0, 180.0)
    bank_deg: Annotated[dist.Scalar, dist.Bounds(-45, 45)] = dist.Normal(0.0, 4.0, clip=(-10, 10))
    swing_deg: Annotated[dist.Scalar, dist.Bounds(0, 30)] = dist.Uniform(0.0, 10.0)
    period_s: dist.Positive = dist.Uniform(4.0, 10.0)
    pitch_deg: Annotated[dist.Scalar, dist.Bounds(-90, -5)] = dist.Uniform(-90.0, -40.0)
    yaw_deg: dist.Scalar = dist.Normal(0.0, 15.0, clip=(-45.0, 45.0))
    offset_m: dist.Scalar = dist.Uniform(-10.0, 10.0)
    from_end_m: float = Field(60.0, ge=0)
    residual: Annotated[dist.Scalar, dist.Bounds(0, 1)] = dist.Uniform(0.0, 0.05)
    clearance_m: float = Field(2.0, ge=0)

    @property
    def motion_duration_s(self) -> float:
        """End of the flight [s]."""
        return self.duration_s

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with the drone at time 0 of its flight, and its trajectories."""
        known = [rig.name for rig in scene.rigs]
        if self.drone not in known or f"{self.drone}_gimbal" not in known:
            raise errors.ConfigError(
                f"randomizers.{self.name}.drone: the template has no drone '{self.drone}'; there "
                f"is {', '.join(known) or 'none: list an element of type drone'}"
                f"{errors.did_you_mean(self.drone, known)}"
            )
        stretches = self._select_stretches(scene)
        hanging, frame = (
            scene.body(f"{self.drone}{part}").T_world_body for part in ("_gimbal", "")
        )
        T_gimbal_drone = SE3((hanging.inverse() @ frame).translation_m)
        for _ in range(TRIES):
            poses = self._draw_flight(stretches, T_gimbal_drone, rng)
            every_second = poses[:: round(1.0 / STEP_S)]
            if all(
                is_clear(p[0].translation_m, scene, assets, self.clearance_m) for p in every_second
            ):
                return self._fly(scene, poses)
        remedy = "a larger height_m, a smaller clearance_m or speed_m_s"
        raise self.reject("no free way for the drone", remedy)

    def _select_stretches(self, scene: Scene) -> "list[Stretch]":
        lanes = [lane for lane in scene.lanes if lane.kind == "driving" and not lane.junction]
        chosen = [lane for lane in lanes if not self.roads or lane.road in self.roads]
        if not chosen:
            known = sorted({lane.road for lane in lanes})
            raise errors.ConfigError(
                f"randomizers.{self.name}.roads: the scene has no driving lane on "
                f"{' or '.join(self.roads) or 'any road'}; there is {', '.join(known) or 'none'}"
            )
        entered = {name for lane in scene.lanes for name in lane.successors}
        stretches = []
        for line in map(lane_geometry.LaneLine, chosen):
            first_m = 0.0 if line.lane.name in entered else self.from_end_m
            last_m = line.length_m - (0.0 if line.lane.successors else self.from_end_m)
            if last_m > first_m:
                stretches.append(Stretch(line, first_m, last_m))
        if not stretches:
            raise self.reject("no road is long enough to look at", "a smaller from_end_m")
        return stretches

    def _draw_flight(
        self, stretches: "Sequence[Stretch]", T_gimbal_drone: SE3, rng: streams.Rng
    ) -> list[tuple[SE3, SE3]]:
        """Draw poses of the rigs of airframe and gimbal at all knots.

        ``T_gimbal_drone`` is the translation between them when the drone is level.
        """
        lengths_m = [one.last_m - one.first_m for one in stretches]
        over = stretches[pick_by_weight(lengths_m, float(rng.uniform()))]
        at_m = float(rng.uniform(over.first_m, over.last_m))
        target = over.line.pose(at_m, self.offset_m.draw(rng))
        w, _, _, z = target.quaternion_wxyz
        heading = 2.0 * math.atan2(z, w) + math.radians(self.heading_deg.draw(rng))
        flight = Flight(
            speed_m_s=self.speed_m_s.draw(rng),
            bank_rad=math.radians(self.bank_deg.draw(rng)),
            swing_rad=math.radians(self.swing_deg.draw(rng)),
            rate_rad_s=2.0 * math.pi / self.period_s.draw(rng),
            phase_rad=float(rng.uniform(0.0, 2.0 * math.pi)),
        )
        height_m = self.height_m.draw(rng)
        pitch = math.radians(self.pitch_deg.draw(rng))
        yaw = math.radians(self.yaw_deg.draw(rng))
        residual = self.residual.draw(rng)
        back_m = height_m * math.cos(pitch) / math.sin(-pitch)
        x, y, ground_m = target.translation_m
        eye = (
            x - back_m * math.cos(heading + yaw),
            y - back_m * math.sin(heading + yaw),
            ground_m + height_m,
        )
        lean = flight.speed_m_s * LEAN_PER_M_S
        poses = []
        for place, course, bank in flight.knots(eye, heading, self.duration_s):
            gimbal = SE3(
                place,
                attitude(course + yaw, -pitch + residual * lean, residual * bank).quaternion_wxyz,
            )
            turn = attitude(course, lean, bank)
            poses.append((SE3(place, turn.quaternion_wxyz) @ T_gimbal_drone, gimbal))
        return poses

    def _fly(self, scene: Scene, poses: Sequence[tuple[SE3, SE3]]) -> Scene:
        names = (self.drone, f"{self.drone}_gimbal")
        tracks = tuple(
            motion.Trajectory(
                scene.rig(name).body,
                STEP_S,
                tuple((pair[k] @ scene.rig(name).T_body_rig.inverse()).rounded() for pair in poses),
                -MARGIN_S,
            )
            for k, name in enumerate(names)
        )
        bodies = [
            replace(scene.body(track.body), T_world_body=track.pose(scene.time_s).rounded())
            for track in tracks
        ]
        others = tuple(track for track in scene.tracks if track.body not in names)
        return scene_time.place_sensors(
            replace(scene.with_bodies(*bodies), tracks=(*others, *tracks))
        )


@dataclass(frozen=True, slots=True)
class Stretch:
    """A part of a lane, by arc length."""

    line: lane_geometry.LaneLine
    first_m: float
    last_m: float


@dataclass(frozen=True, slots=True)
class Flight:
    """Motion at constant height and speed with a swinging bank angle.

    Attributes:
        bank_rad, swing_rad: Mean and amplitude of the bank, positive in left turns.
        rate_rad_s, phase_rad: Rate and phase of the swing.
    """

    speed_m_s: float
    bank_rad: float
    swing_rad: float
    rate_rad_s: float
    phase_rad: float

    def bank(self, time_s: float) -> float:
        """Bank angle at an instant."""
        return self.bank_rad + self.swing_rad * math.sin(self.rate_rad_s * time_s + self.phase_rad)

    def knots(
        self, start_m: Vec3, heading_rad: float, duration_s: float
    ) -> list[tuple[Vec3, float, float]]:
        """Place, course and bank at all knots; place and heading are given at time 0."""
        before, after = round(MARGIN_S / STEP_S), math.ceil((duration_s + MARGIN_S) / STEP_S)
        backward = self._integrate(start_m, heading_rad, -STEP_S, before)
        forward = self._integrate(start_m, heading_rad, STEP_S, after)
        return [*backward[:0:-1], *forward]

    def _integrate(
        self, start_m: Vec3, heading_rad: float, step_s: float, count: int
    ) -> list[tuple[Vec3, float, float]]:
        """Integrate by the midpoint rule, ``count`` steps from time 0."""
        (x, y, z), course = start_m, heading_rad
        found = [(start_m, course, self.bank(0.0))]
        for k in range(count):
            turn = GRAVITY_M_S2 * math.tan(self.bank((k + 0.5) * step_s)) / self.speed_m_s
            middle = course + 0.5 * step_s * turn
            course += step_s * turn
            x += step_s * self.speed_m_s * math.cos(middle)
            y += step_s * self.speed_m_s * math.sin(middle)
            found.append(((x, y, z), course, self.bank((k + 1) * step_s)))
        return found


def attitude(yaw_rad: float, down_rad: float, bank_rad: float) -> SE3:
    """Rotation of a frame X forward, Y left, Z up: heading, nose down, left side down."""
    nose = SE3((0.0, 0.0, 0.0), (math.cos(0.5 * down_rad), 0.0, math.sin(0.5 * down_rad), 0.0))
    side = SE3((0.0, 0.0, 0.0), (math.cos(0.5 * bank_rad), -math.sin(0.5 * bank_rad), 0.0, 0.0))
    return SE3.about_z(yaw_rad) @ nose @ side
