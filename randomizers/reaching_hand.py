"""Hands that reach over the edge of a table, and hold, touch or point at something."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from gen_data.assets.asset_ids import AssetId, parse_asset_id
from gen_data.assets.families import declared
from gen_data.config import distributions as dist
from gen_data.core.asset_types import Float32
from gen_data.core.asset_words import check_categories
from gen_data.core.interfaces import AssetIndex
from gen_data.core.members import Member, add_members
from gen_data.core.scene import ObjectGroup, Scene, SupportSurface
from gen_data.core.se3 import SE3, Array, Vec3
from gen_data.core.streams import Rng
from gen_data.randomizers import asset_groups, base

_TRIES = 24
_RESTING = ("relaxed", "flat", "point", "fist", "relaxed")
_GAP_M = 0.002
"""Between a hand and the table."""
_WALL_M = 0.02
_DISC_M = 0.07
"""Radius of the discs around an arm that other objects keep clear of."""
_SECTORS = 24
_BAND_M = 0.06
"""Half height of the part of an object that a hand may cover."""
_FINGERS = ("index", "middle", "ring", "little")
_ROUND = 1.12
"""Largest ratio of an object's radii in different directions, its handle apart."""


@dataclass(frozen=True)
class _Reach:
    """A drawn place of a hand in the frame of its surface.

    Attributes:
        tip: Point on the surface of the held object, or of its fingertips.
        yaw_rad: Direction of the forearm towards the fingers.
    """

    tip: tuple[float, float]
    yaw_rad: float


class ReachingHand(asset_groups.GroupRandomizer):
    """Adds a hand that reaches over the edge of a surface; it holds an object or rests.

    Hand and held object do not move in physics; the object stands within the hand, which bends to
    its shape. List it before the randomizers that place objects on the same surface: they keep
    clear of the hand. The template needs an ``objects`` element with ``count: 0`` of hands.

    Attributes:
        probability: Whether there is a hand.
        holding: Whether it holds something; otherwise it rests, points or is closed.
        things: Name of the object group whose assets it may hold.
        held_categories: Categories that it may hold; the ones with an upright, round middle as
            thick as a hand can grasp.
        reach_m: Distance from the edge to the held object, or to its fingertips.
        turn_deg: Angle between forearm and the normal of the edge.
        raised_m: Height of a held object above the surface; low ones are raised to give the hand
            room.
    """

    type: Literal["reaching_hand"] = "reaching_hand"
    stage: Literal["scene"] = "scene"
    probability: dist.Flag = dist.Probability(0.15)
    holding: dist.Flag = dist.Probability(0.65)
    things: str = "clutter"
    held_categories: tuple[str, ...] = ("bottle", "can", "cup", "drinking glass", "jar", "mug")
    reach_m: dist.NonNegative = dist.Uniform(0.08, 0.3)
    turn_deg: dist.Scalar = dist.Uniform(-30.0, 30.0)
    raised_m: dist.NonNegative = dist.Choice({0.0: 2.0, 0.03: 1.0, 0.08: 1.0})

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """See ``GroupRandomizer.check``; objects to hold are checked, too."""
        super().check(scene, assets)
        self._find_things(scene)
        check_categories(self.held_categories, assets, f"randomizers.{self.name}.held_categories")

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with a hand, or unchanged if none is drawn or none has room."""
        group, weights = self.find_group(scene, assets)
        if not weights or not self.probability.draw(rng):
            return scene
        surface = scene.surface(group.surfaces[0])
        hand = asset_groups.draw_asset(weights, rng)
        thing = self._draw_thing(scene, assets, rng) if self.holding.draw(rng) else ""
        for _ in range(_TRIES):
            reach = self._draw_reach(surface, rng)
            members = self._hold(hand, thing, surface, reach, assets, rng)
            members = members or _rest(hand, surface, reach, assets, rng)
            discs = _cover(members, assets)
            outside = _is_behind_edge(members[0], surface, assets)
            if (
                outside
                and _is_free(members[0], scene, assets)
                and not _touch(discs, group.keep_out)
            ):
                first = sum(body.group == group.name for body in scene.bodies)
                return _keep_clear(
                    add_members(scene, group, members, assets, first), surface, discs
                )
        return scene

    def _draw_thing(self, scene: Scene, assets: AssetIndex, rng: Rng) -> str:
        """Draw the asset to hold: a category and then one of its assets; empty if there is none."""
        by_category: dict[str, list[str]] = {}
        for asset_id in self._find_things(scene).assets:
            category = assets.get(asset_id).category
            if category in self.held_categories:
                by_category.setdefault(category, []).append(asset_id)
        if not by_category:
            return ""
        return base.choose(tuple(by_category[base.choose(tuple(sorted(by_category)), rng)]), rng)

    def _find_things(self, scene: Scene) -> ObjectGroup:
        groups = {group.name: group for group in scene.groups}
        fault = f"randomizers.{self.name}.things: there is no object group"
        base.check_known(self.things, groups, fault)
        return groups[self.things]

    def _draw_reach(self, surface: SupportSurface, rng: Rng) -> _Reach:
        half_x, half_y = 0.5 * surface.size_m[0], 0.5 * surface.size_m[1]
        side, share = int(rng.integers(4)), float(rng.uniform(-0.8, 0.8))
        turn_rad = math.radians(self.turn_deg.draw(rng))
        depth_m = self.reach_m.draw(rng)
        inward = 0.5 * math.pi * side
        to_edge, along = (half_x, half_y) if side % 2 == 0 else (half_y, half_x)
        c, s = math.cos(inward), math.sin(inward)
        u, v = -to_edge + min(depth_m, to_edge), share * along
        return _Reach((c * u - s * v, s * u + c * v), inward + turn_rad)

    def _hold(
        self,
        hand: str,
        thing: str,
        surface: SupportSurface,
        reach: _Reach,
        assets: AssetIndex,
        rng: Rng,
    ) -> list[Member]:
        """A hand around an upright object; empty if that does not fit."""
        raised_m = self.raised_m.draw(rng)
        jitter_rad = float(rng.uniform(-0.25, 0.25))
        parsed = parse_asset_id(hand)
        if not thing or "index_1" not in {point.name for point in assets.keypoints(hand)}:
            return []
        seed = int(parsed.parameters.get("seed", 0))  # type: ignore[arg-type]
        low, high = assets.bounds_m(thing)
        heights = np.array([0.024, 0.003, -0.018, -0.035])
        radii = measure_radii(assets.vertices_m(thing), 0.02 * (high[2] - low[2]) + heights)
        if radii is None or high[2] - low[2] < 0.07:
            return []
        radii_mm = tuple(float(math.ceil(1e3 * r)) for r in radii)
        least_m, most_m = declared("hand", "radii_m")
        if not all(least_m <= 1e-3 * r <= most_m for r in radii_mm):
            return []
        asset = str(
            AssetId(
                parsed.name,
                {"pose": declared("hand", "grasp_pose"), "radii_mm": radii_mm, "seed": seed},
            )
        )
        points = {point.name: point.position_m for point in assets.keypoints(asset)}
        knuckle = points["index_1"]
        axis = declared("hand", "held_axis_m")(seed, [1e-3 * r for r in radii_mm])
        # The wrist is as high as the hand's middle, where radii were measured.
        middle_z = points["wrist"][2]
        hand_low = assets.bounds_m(asset)[0][2]
        at_m = -low[2] + 0.02 * (high[2] - low[2])
        base_m = max(raised_m, _GAP_M - hand_low + middle_z - at_m, 0.0005)
        yaw = reach.yaw_rad
        turn = 0.5 * math.pi * (-1.0 if declared("hand", "is_left")(seed) else 1.0)
        x, y = knuckle[0] + axis[0], knuckle[1] + axis[1]
        c, s = math.cos(yaw), math.sin(yaw)
        origin = (
            reach.tip[0] - c * x + s * y,
            reach.tip[1] - s * x - c * y,
            base_m + at_m - middle_z,
        )
        T = surface.T_world_surface
        hand_pose = T @ SE3.about_z(yaw, origin)
        thing_pose = T @ SE3.about_z(yaw + turn + jitter_rad, (*reach.tip, base_m - low[2]))
        return [Member(asset, hand_pose.rounded()), Member(thing, thing_pose.rounded())]


def measure_radii(vertices_m: Array | Float32, heights_m: Array) -> tuple[float, ...] | None:
    """Radii of an upright, round object about its Z axis at some heights [m].

    A handle is left out. The outside between vertices follows their convex hull within 6 cm:
    contents and inner walls do not count. None if the object is not round there.

    Args:
        vertices_m: Vertices in the object's frame, shape [n, 3].
        heights_m: Heights in that frame.
    """
    points = np.asarray(vertices_m, dtype=np.float64)
    centre = float(heights_m.mean())
    inside = np.abs(points[:, 2] - centre) < _BAND_M
    for side in (points[:, 2] >= centre + _BAND_M, points[:, 2] <= centre - _BAND_M):
        if side.any():
            # The nearest ring beyond the band.
            nearest = float(np.abs(points[side, 2] - centre).min())
            inside |= side & (np.abs(points[:, 2] - centre) < nearest + 0.001)
    band = points[inside]
    if (
        len(band) < _SECTORS
        or band[:, 2].max() < heights_m.max()
        or band[:, 2].min() > heights_m.min()
    ):
        return None
    # The axis of lathes passes through the middle of the widest ring without its handle.
    foot = points[points[:, 2] < points[:, 2].min() + 0.004]
    axis = 0.5 * (foot[:, :2].min(axis=0) + foot[:, :2].max(axis=0))
    offset = band[:, :2] - axis
    away = np.sqrt((offset**2).sum(axis=1))
    sector = (np.arctan2(offset[:, 1], offset[:, 0]) / (2.0 * math.pi) * _SECTORS).astype(
        int
    ) % _SECTORS
    widest = np.array([away[sector == k].max(initial=0.0) for k in range(_SECTORS)])
    filled = widest[widest > 0.0]
    plain = np.quantile(filled, 0.8)
    if len(filled) < 0.6 * _SECTORS or plain > _ROUND * np.quantile(filled, 0.1):
        return None
    wall = away <= 1.02 * plain
    return tuple(_envelope(band[wall, 2], away[wall], float(h)) for h in heights_m)


def _envelope(z: Array, r: Array, height: float) -> float:
    """Largest radius at a height on lines between any point below and any above."""
    levels = np.unique(np.round(z, 4))
    top = np.array([r[np.abs(z - level) < 1e-4].max() for level in levels])
    low, high = levels <= height, levels >= height
    if not low.any() or not high.any():
        return float(top.max())
    z0, z1 = levels[low][:, None], levels[high][None]
    share = np.where(z1 > z0, (height - z0) / np.maximum(z1 - z0, 1e-9), 0.0)
    between = top[low][:, None] + share * (top[high][None] - top[low][:, None])
    return float(between.max())


def _rest(
    hand: str, surface: SupportSurface, reach: _Reach, assets: AssetIndex, rng: Rng
) -> list[Member]:
    """A hand that lies on the surface with its fingertips at the place."""
    asset, pose = hand, base.choose(_RESTING, rng)
    if assets.keypoints(hand):
        parsed = parse_asset_id(hand)
        asset = str(AssetId(parsed.name, {**parsed.parameters, "pose": pose}))
    low, high = assets.bounds_m(asset)
    c, s = math.cos(reach.yaw_rad), math.sin(reach.yaw_rad)
    origin = (reach.tip[0] - c * high[0], reach.tip[1] - s * high[0], _GAP_M - low[2])
    return [Member(asset, (surface.T_world_surface @ SE3.about_z(reach.yaw_rad, origin)).rounded())]


def _ends(member: Member, assets: AssetIndex) -> tuple[Array, Array]:
    """Rear end of a hand's arm and its fingertips, world [m]."""
    low, high = assets.bounds_m(member.asset)
    middle_y = 0.5 * (low[1] + high[1])
    ends = np.array([[low[0], middle_y, 0.5 * (low[2] + high[2])], [high[0], middle_y, low[2]]])
    placed = member.T_world_body.apply(ends)
    return placed[0], placed[1]


def _is_behind_edge(member: Member, surface: SupportSurface, assets: AssetIndex) -> bool:
    """Whether the arm comes from beyond the edge; hands without joints may lie anywhere."""
    if not assets.keypoints(member.asset):
        return True
    rear, _ = _ends(member, assets)
    here = surface.T_world_surface.inverse().apply(rear)
    return bool((np.abs(here[:2]) > 0.5 * np.array(surface.size_m)).any())


def _is_free(member: Member, scene: Scene, assets: AssetIndex) -> bool:
    rear, _ = _ends(member, assets)
    low, high = (np.array(corner) for corner in scene.interior_m)
    return bool((rear > low + _WALL_M).all() and (rear < high - _WALL_M).all())


def _cover(members: Sequence[Member], assets: AssetIndex) -> tuple[Vec3, ...]:
    """Discs ``(x, y, radius)`` [m], world, over an arm and a held object."""
    rear, tip = _ends(members[0], assets)
    count = max(2, math.ceil(math.dist(rear[:2], tip[:2]) / _DISC_M))
    discs = [
        (round(float(x), 6), round(float(y), 6), _DISC_M)
        for x, y in np.linspace(rear[:2], tip[:2], count)
    ]
    for member in members[1:]:
        low, high = assets.bounds_m(member.asset)
        radius = 0.5 * math.hypot(high[0] - low[0], high[1] - low[1]) + 0.01
        x, y, _ = member.T_world_body.translation_m
        discs.append((round(x, 6), round(y, 6), round(radius, 6)))
    return tuple(discs)


def _touch(first: Sequence[Vec3], second: Sequence[Vec3]) -> bool:
    return any(math.hypot(a[0] - b[0], a[1] - b[1]) < a[2] + b[2] for a in first for b in second)


def _keep_clear(scene: Scene, surface: SupportSurface, discs: tuple[Vec3, ...]) -> Scene:
    """The scene whose groups on the surface keep clear of the discs."""
    groups = tuple(
        replace(group, keep_out=(*group.keep_out, *discs))
        if surface.name in group.surfaces
        else group
        for group in scene.groups
    )
    return replace(scene, groups=groups)
