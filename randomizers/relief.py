"""Relief of streets: longitudinal profiles by the rules of road design, and slopes of the land."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from gen_data.assets.asset_ids import parse_asset_id
from gen_data.config import distributions as dist
from gen_data.core import errors, interfaces, relief, se3, streams
from gen_data.core.scene import Body, Scene
from gen_data.randomizers.base import RandomizerBase
from gen_data.roads import alignment, junction_shape, roundabout_shape
from gen_data.roads.cross_section import RoadShape, strips

GRADE_MAX = 0.15
LEVEL_M = 10.0
"""Length of road next to a junction that is as level as the junction."""
BESIDE_M = relief.BESIDE_CELLS * relief.CELL_M
"""Width of the land on both sides of a road that is level across, as the road is."""
_MEETING_M = 0.1
_BENDS_MAX = 3
_NOTHING = (0.0, 1.0, 0.0)
"""A vertical curve that changes nothing."""
_TRIES = 12

_ARMED: dict[str, type[junction_shape.JunctionShape] | type[roundabout_shape.RoundaboutShape]] = {
    "junction": junction_shape.JunctionShape,
    "roundabout": roundabout_shape.RoundaboutShape,
}


class ReliefOfRoads(RandomizerBase):
    """Gives the ground of a street its relief: hills and hollows along its roads.

    Each road gets a longitudinal profile of straight grades and vertical curves that are as long as
    its usual speed demands. Junctions, and the roads next to them, are level. On both sides the
    land rises or falls. Everything stands on the ground: the street is laid out on a plane and
    lifted after its view was drawn; other draws stay the same.

    Attributes:
        grade: Rise per metre of the straight grades; steeper ones are cut to ``grade_max``.
        grade_max: Steepest grade of any road.
        banked: Whether roads of 60 km/h and more slope down to the inside of their bends, by 2.5 to
            6 % (RASt 06, RAA).
        side_slope: Rise per metre of the land on each side of a road, away from it.
    """

    type: Literal["relief"] = "relief"
    grade: Annotated[dist.Scalar, dist.Bounds(-GRADE_MAX, GRADE_MAX)] = dist.Normal(
        0.0, 0.04, clip=(-0.12, 0.12)
    )
    grade_max: float = Field(0.12, gt=0, le=GRADE_MAX)
    banked: bool = True
    side_slope: Annotated[dist.Scalar, dist.Bounds(-0.3, 0.3)] = dist.Normal(
        0.0, 0.06, clip=(-0.15, 0.15)
    )

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with its relief; nothing is moved yet. Without roads it stays level."""
        if not any(_family(body) == "road" for body in scene.bodies):
            return scene
        self.check(scene, assets)
        places = _junction_arms(scene)
        known: dict[str, _End] = {}
        profiles: list[relief.RoadProfile] = []
        for body in scene.bodies:
            if _family(body) != "road":
                continue
            course = _Course.of(body, _speed_m_s(scene, body.name))
            start, end = (
                _place(pose, f"{body.name}/{word}", places)
                for word, pose in (("start", course.T_world_start), ("end", course.T_world_end))
            )
            if start.name in known and end.name in known:
                raise self._refusal(
                    f"the road '{body.name}' closes a ring of roads, whose heights would have to "
                    "agree; expected roads that branch"
                )
            if end.name in known:
                course, start, end = course.reversed(), end, start
            grade = 0.0 if start.is_level else self._draw_grade(rng)
            known.setdefault(start.name, _End(0.0, grade, start.is_level))
            first = known[start.name]
            profile = self._draw_profile(course, first, level_end=end.is_level, rng=rng)
            height_m = float(profile.height(np.array([course.length_m]))[0])
            known[end.name] = _End(height_m, profile.slope(course.length_m), end.is_level)
            profiles.append(profile)
        if all(
            not any((p.grade, p.left, p.right, *p.curves[2::3], *p.bends[4::5])) for p in profiles
        ):
            return scene
        ground = relief.Relief(tuple(profiles))
        more_m = relief.BESIDE_CELLS * ground.cell_m - BESIDE_M
        wider = (replace(p, half_width_m=round(p.half_width_m + more_m, 2)) for p in profiles)
        return replace(scene, relief=relief.Relief(tuple(wider)))

    def check(self, scene: Scene, assets: interfaces.AssetIndex) -> None:
        """Refuse scenes whose ground it cannot bend."""
        del assets
        if any("/" in lane.road for lane in scene.lanes):
            raise self._refusal(
                "the roads of an OpenDRIVE file have heights already; expected a scene without an "
                "element of type road_network"
            )
        if not any(_family(body) == "road" for body in scene.bodies):
            raise self._refusal(
                "the scene has no element of type road, along which profiles could lead; expected "
                "one"
            )
        if scene.articulations:
            raise self._refusal(
                f"the robot '{scene.articulations[0].name}' is planned on level ground; expected a "
                "scene without robots"
            )

    def _refusal(self, text: str) -> errors.ConfigError:
        return errors.ConfigError(f"randomizers.{self.name}.grade: {text}, or no relief")

    def _draw_profile(
        self, course: _Course, start: _End, *, level_end: bool, rng: streams.Rng
    ) -> relief.RoadProfile:
        """Draw the profile of a road from one of its ends to the other."""
        curves = self._draw_curves(course, start, level_end=level_end, rng=rng)
        left, right = (round(self.side_slope.draw(rng), 4) for _ in range(2))
        x_m, y_m, _ = course.T_world_start.translation_m
        yaw = 2.0 * math.atan2(*course.T_world_start.quaternion_wxyz[::-3])
        plan = (round(x_m, 3), round(y_m, 3), round(yaw, 6), round(course.curvature_per_m, 9))
        flat = tuple(round(number, 4) for curve in curves for number in curve)
        rest = _NOTHING * (_BENDS_MAX - len(curves))
        return relief.RoadProfile(
            *plan,
            round(float(course.length_m), 3),
            round(course.half_width_m, 2),
            left,
            right,
            round(start.height_m, 4),
            round(start.grade, 4),
            flat + rest,  # type: ignore[arg-type]
            course.bends if self.banked else _level(course.bends),
        )

    def _draw_curves(
        self, course: _Course, start: _End, *, level_end: bool, rng: streams.Rng
    ) -> list[tuple[float, float, float]]:
        """Draw vertical curves between straight grades: ``start_m, length_m, change``."""
        lead_m = LEVEL_M if start.is_level else 0.0
        room_m = course.length_m - lead_m - (LEVEL_M if level_end else 0.0)
        for attempt in range(_TRIES):
            # Where curves find no room, their grades are nearer to level.
            ease = 0.8**attempt
            count = int(rng.integers(1, _BENDS_MAX))
            grades = [start.grade, *(ease * self._draw_grade(rng) for _ in range(count))]
            changes = np.diff([*grades, 0.0] if level_end else grades)
            lengths = [course.curve_m(float(change)) for change in changes]
            free_m = room_m - sum(lengths)
            if free_m >= 0.0:
                break
        else:
            # A road too short for its speed: level, or back to level as gently as it can be.
            changes, lengths = np.array([-start.grade if level_end else 0.0]), [max(room_m, 1.0)]
            free_m = 0.0
        cuts = free_m * np.sort(rng.uniform(size=len(lengths)))
        starts = lead_m + cuts + np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
        return [
            (float(at), length, float(change))
            for at, length, change in zip(starts, lengths, changes, strict=True)
        ]

    def _draw_grade(self, rng: streams.Rng) -> float:
        return min(max(self.grade.draw(rng), -self.grade_max), self.grade_max)


@dataclass(frozen=True, slots=True)
class _Place:
    """A place where roads meet; at junctions it is level."""

    name: str
    pose: se3.SE3
    is_level: bool


@dataclass(frozen=True, slots=True)
class _End:
    """Height of an end of a road, and the grade with which roads lead away from it."""

    height_m: float
    grade: float
    is_level: bool


@dataclass(frozen=True, slots=True)
class _Course:
    """A road in plan, from the end at which its profile begins."""

    T_world_start: se3.SE3
    T_world_end: se3.SE3
    length_m: float
    curvature_per_m: float
    half_width_m: float
    speed_m_s: float
    bends: tuple[float, ...]

    @classmethod
    def of(cls, body: Body, speed_m_s: float) -> _Course:
        """The course of a road's body."""
        shape = RoadShape(**_shape_values(body, RoadShape))
        x, y, heading = (float(v) for v in shape.line().poses(np.array([shape.length_m]))[0])
        T_world_end = body.T_world_body @ se3.SE3.about_z(heading, (x, y, 0.0))
        half_m = max(_edge_m(shape, side) for side in (1, -1)) + BESIDE_M
        return cls(
            body.T_world_body,
            T_world_end,
            shape.length_m,
            shape.curvature_per_m,
            half_m,
            speed_m_s,
            tuple(
                number
                for start, spiral, arc, curvature in alignment.unpack(shape.bends)
                for number in (
                    start,
                    spiral,
                    arc,
                    curvature,
                    round(alignment.bank(1.0 / abs(curvature), speed_m_s), 4),
                )
            ),
        )

    def reversed(self) -> _Course:
        """The same road from its other end."""
        back = se3.SE3.about_z(math.pi)
        return replace(
            self,
            T_world_start=self.T_world_end @ back,
            T_world_end=self.T_world_start @ back,
            curvature_per_m=-self.curvature_per_m,
            bends=tuple(
                number
                for k in range(len(self.bends) - 5, -1, -5)
                for number in self._bend_reversed(*self.bends[k : k + 5])
            ),
        )

    def _bend_reversed(
        self, start_m: float, spiral_m: float, arc_m: float, curvature_per_m: float, bank: float
    ) -> tuple[float, ...]:
        start_m = round(self.length_m - start_m - 2.0 * spiral_m - arc_m, 3)
        return (start_m, spiral_m, arc_m, -curvature_per_m, bank)

    def curve_m(self, change: float) -> float:
        """Length of a vertical curve that changes the grade, by stopping sight distance.

        Source: AASHTO, A Policy on Geometric Design of Highways and Streets, 6th edition, 2011,
        equations 3-2 (brake reaction 2.5 s, deceleration 3.4 m/s^2), 3-43 (crests: eye at 1.08 m,
        object at 0.60 m) and 3-48 (sags: headlight beams); distances rounded up to 5 m as in tables
        3-34 and 3-36; at least 0.6 m per km/h.
        """
        speed_km_h = 3.6 * self.speed_m_s
        sight_m = 0.278 * speed_km_h * 2.5 + 0.039 * speed_km_h**2 / 3.4
        sight_m = 5.0 * math.ceil(sight_m / 5.0 - 1e-9)
        rate = sight_m**2 / (658.0 if change < 0.0 else 120.0 + 3.5 * sight_m)
        return max(100.0 * rate * abs(change), 0.6 * speed_km_h, 1.0)


def _level(bends: tuple[float, ...]) -> tuple[float, ...]:
    """The same bends without cross slopes."""
    return tuple(0.0 if k % 5 == 4 else number for k, number in enumerate(bends))


def _edge_m(shape: RoadShape, side: int) -> float:
    """Distance from the middle to the land next to a road."""
    return sum(strip.width_m for strip in strips(shape, side) if strip.kind != "garden")


def _family(body: Body) -> str:
    return body.asset.partition("?")[0]


def _shape_values(body: Body, kind: type) -> dict[str, Any]:
    names = {field.name for field in fields(kind)}
    return {k: v for k, v in parse_asset_id(body.asset).parameters.items() if k in names}


def _speed_m_s(scene: Scene, road: str) -> float:
    return max((lane.speed_m_s for lane in scene.lanes if lane.road == road), default=0.0)


def _junction_arms(scene: Scene) -> list[_Place]:
    """The ends of all arms of junctions, by the names of the junctions."""
    arms = []
    for body in scene.bodies:
        kind = _ARMED.get(_family(body))
        if kind is not None:
            shape = kind(**_shape_values(body, kind))
            for number in range(len(shape.arms_rad())):
                pose = body.T_world_body @ junction_shape.arm_pose(shape, number)
                arms.append(_Place(body.name, pose, is_level=True))
    return arms


def _place(pose: se3.SE3, name: str, places: list[_Place]) -> _Place:
    """The known place where a road ends, or else a new one of that name, which is added."""
    for place in places:
        if math.dist(place.pose.translation_m, pose.translation_m) < _MEETING_M:
            return place
    places.append(_Place(name, pose, is_level=False))
    return places[-1]
