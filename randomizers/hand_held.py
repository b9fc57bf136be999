"""A hand that holds an object up, as people do for a photograph."""

import math
from collections.abc import Iterator, Sequence
from itertools import permutations
from typing import Literal, NamedTuple

import numpy as np

from gen_data.assets.asset_ids import AssetId, parse_asset_id
from gen_data.assets.families import declared
from gen_data.config import distributions as dist
from gen_data.core import errors
from gen_data.core.interfaces import AssetIndex
from gen_data.core.members import Member, add_members
from gen_data.core.scene import Scene, SupportSurface
from gen_data.core.se3 import SE3, Array
from gen_data.core.streams import Rng
from gen_data.randomizers import asset_groups, base
from gen_data.randomizers.free_space import is_in_the_open
from gen_data.randomizers.reaching_hand import measure_radii

_THINGS, _PLACES = 12, 200
_THICKEST_M, _LONGEST_M = 0.09, 0.45
"""Thickness between thumb and fingers, and largest extent, of an object in one hand."""
_TOUCH_M, _PRESS_M = 0.003, 0.0035
"""Flesh nearer than this touches; it yields by this much at most."""
_CLEAR_M = 0.03
_FACES, _FACES_THUMB = 0.3, 0.7
"""Smallest cosines of the angles between the view of a hand and its palm's or thumb's side."""
_RAISED_RAD = 0.25
_LOW_M, _TALL_M = 0.05, 0.08
"""Least heights of vessels and of other round objects that a hand holds around their wall."""
_ARM_M = (0.05, 0.14, 0.24, 0.34, 0.44)
"""Points of the forearm that keep clear of bodies, from the wrist."""


class _Held(NamedTuple):
    """A hand around an object: ids, and poses of both in the axes of the hand."""

    asset: str
    thing: str
    T_hand_thing: SE3
    T_hand_asset: SE3
    upright: bool


class HandHeld(asset_groups.GroupRandomizer):
    """Adds a hand that holds an object of a group in the air, above a surface.

    Fingers and thumb close on the sections of the object until they touch, whatever its shape;
    objects that are too thick for them lie on the open palm. Both stay where they are in physics.
    The template needs ``objects`` elements with ``count: 0`` of hands and of objects to hold.

    Attributes:
        objects: Name of the object group that is held.
        probability: Whether there is a hand.
        height_m: Height of the object's centre above the surface.
        elbow_azimuth_deg: Direction from the hand to its elbow: 0 = +X, 90 = +Y.
        elbow_elevation_deg: The same against the horizon; an elbow is below its hand, as a rule.
        roll_deg: Turn about the forearm; 0 = the thumb is above.
        viewer_azimuth_deg: Direction from the hand to somebody to whom its palm or its thumb is
            turned, which shows the held object; without it, the back of the hand may hide it.
        spill_deg: Largest tilt of open vessels, whose contents are level.
    """

    type: Literal["hand_held"] = "hand_held"
    stage: Literal["scene"] = "scene"
    objects: str = "held"
    probability: dist.Flag = dist.Constant(True)
    height_m: dist.NonNegative = dist.Uniform(0.15, 0.5)
    elbow_azimuth_deg: dist.Scalar = dist.Uniform(0.0, 360.0)
    elbow_elevation_deg: dist.Scalar = dist.Normal(-25.0, 25.0, clip=(-80.0, 40.0))
    roll_deg: dist.Scalar = dist.Normal(0.0, 60.0, clip=(-150.0, 150.0))
    viewer_azimuth_deg: dist.Scalar | None = None
    spill_deg: dist.NonNegative = dist.Uniform(0.0, 12.0)

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Raise ConfigError if a group or category is unknown, or hands do not close."""
        hands, _ = self.find_group(scene, assets)
        stiff = [asset for asset in hands.assets if declared(asset, "close_on", None) is None]
        if stiff:
            raise errors.ConfigError(
                f"randomizers.{self.name}.group: '{stiff[0]}' has no fingers that close; expected "
                "assets of the family 'hand'"
            )
        names = [group.name for group in scene.groups]
        fault = f"randomizers.{self.name}.objects: there is no object group"
        base.check_known(self.objects, names, fault)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with a hand and the object in it.

        Raises:
            LayoutRejected: no free place above the surface was found.
            ConfigError: no hand can hold the drawn objects.
        """
        hands, weights = self.find_group(scene, assets)
        group = next(g for g in scene.groups if g.name == self.objects)
        if not weights or not group.assets or not self.probability.draw(rng):
            return scene
        held = self._draw_held(weights, group.assets, assets, rng)
        surface = scene.surface(group.surfaces[0])
        viewer = None if self.viewer_azimuth_deg is None else self.viewer_azimuth_deg.draw(rng)
        for _ in range(_PLACES):
            T_world_hand = self._draw_pose(held, surface, assets, rng)
            if viewer is not None and not _shows(T_world_hand, held, math.radians(viewer)):
                continue
            if _is_free(T_world_hand, held, scene, assets):
                break
        else:
            raise self.reject("no free place for a hand", "other height_m or elbow_azimuth_deg")
        hand = Member(held.asset, (T_world_hand @ held.T_hand_asset).rounded())
        thing = Member(held.thing, (T_world_hand @ held.T_hand_thing).rounded())
        scene = add_members(scene, group, [thing], assets)
        return add_members(
            scene, hands, [hand], assets, sum(body.group == hands.name for body in scene.bodies)
        )

    def _draw_held(
        self,
        weights: asset_groups.CategoryWeights,
        things: Sequence[str],
        assets: AssetIndex,
        rng: Rng,
    ) -> _Held:
        """Draw a hand, a category, one of its assets, and the grip."""
        by_category: dict[str, list[str]] = {}
        for asset in things:
            by_category.setdefault(assets.get(asset).category, []).append(asset)
        for _ in range(_THINGS):
            hand = asset_groups.draw_asset(weights, rng)
            category = base.choose(tuple(sorted(by_category)), rng)
            thing = base.choose(tuple(by_category[category]), rng)
            held = _hold(hand, thing, assets, rng) or _carry(hand, thing, assets, rng)
            if held is not None:
                return held
        raise errors.ConfigError(
            f"randomizers.{self.name}.objects: no hand can hold '{thing}'; expected objects of at "
            f"most {_LONGEST_M:g} m"
        )

    def _draw_pose(self, held: _Held, surface: SupportSurface, assets: AssetIndex, rng: Rng) -> SE3:
        """``T_world_hand`` with the object's middle above the surface."""
        azimuth = math.radians(self.elbow_azimuth_deg.draw(rng))
        elevation = math.radians(self.elbow_elevation_deg.draw(rng))
        roll = math.radians(self.roll_deg.draw(rng))
        spill = math.radians(self.spill_deg.draw(rng))
        shares = rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4)
        height_m = self.height_m.draw(rng)
        if held.upright:
            elevation, roll = spill * math.sin(elevation), spill * math.sin(roll)
        level = math.cos(elevation)
        ahead = -np.array(
            [level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)]
        )
        side = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
        up = np.cross(ahead, side) * -1.0
        up = up if up[2] >= 0.0 else -up
        thumb = _is_left(held) * (math.cos(roll) * up + math.sin(roll) * np.cross(ahead, up))
        axes = np.stack([ahead, thumb, np.cross(ahead, thumb)], axis=1)
        T_world_hand = SE3.from_rotation(axes)
        place = (shares[0] * surface.size_m[0], shares[1] * surface.size_m[1], height_m)
        to = surface.T_world_surface.apply(np.array(place))
        x, y, z = to - (T_world_hand @ held.T_hand_thing).apply(_middle_m(held.thing, assets))
        return SE3((float(x), float(y), float(z))) @ T_world_hand


def _shows(T_world_hand: SE3, held: _Held, azimuth_rad: float) -> bool:
    """Whether the palm or the thumb of a hand faces somebody, whose eyes are a little above it."""
    eyes = _RAISED_RAD
    to = math.cos(eyes) * math.cos(azimuth_rad), math.cos(eyes) * math.sin(azimuth_rad)
    _, along_thumb, out_of_back = T_world_hand.inverse().rotate(np.array([*to, math.sin(eyes)]))
    return bool(out_of_back < -_FACES or _is_left(held) * along_thumb > _FACES_THUMB)


def _is_left(held: _Held) -> float:
    """-1 for a left hand, whose thumb is at -Y, else 1."""
    return -1.0 if declared("hand", "is_left")(_seed(held.asset)) else 1.0


def _seed(hand: str) -> int:
    return int(parse_asset_id(hand).parameters.get("seed", 0))  # type: ignore[arg-type]


def _middle_m(asset: str, assets: AssetIndex) -> Array:
    low, high = assets.bounds_m(asset)
    return np.asarray(0.5 * (np.array(low) + np.array(high)))


def _hold(hand: str, thing: str, assets: AssetIndex, rng: Rng) -> _Held | None:
    """A hand closed on an object, gripped along one of its axes; None if it fits none."""
    points = assets.vertices_m(thing).astype(np.float64)
    size = np.ptp(points, axis=0)
    if float(size.max()) > _LONGEST_M:
        return None
    seed = _seed(hand)
    mirror = np.array([1.0, -1.0 if declared("hand", "is_left")(seed) else 1.0, 1.0])
    upright = bool(declared(thing, "vessel", False))
    share = float(rng.uniform(0.3, 0.62))
    for R, sections in _ways(points, mirror, share, upright, rng):
        grip = declared("hand", "close_on")(sections[1])
        if grip is None or not _is_firm(grip.gaps_m):
            continue
        # From the point around which it was gripped, in the axes of the hand.
        shift = mirror * np.array(grip.shift_m) - R @ sections[0]
        bends = {"pose": "hold", "bends_deg": grip.bends_deg, "seed": seed}
        asset = str(AssetId(parse_asset_id(hand).name, bends))
        T_hand_thing = SE3.from_rotation(R, shift)
        return _Held(asset, thing, T_hand_thing, _wrist(asset, assets), upright)
    return None


def _ways(
    points: Array, mirror: Array, share: float, upright: bool, rng: Rng
) -> Iterator[tuple[Array, tuple[Array, list[Array | None]]]]:
    """Rotations of an object into a hand's axes, with the gripped point and the sections there.

    Upright round objects are held around their wall, as cups and bottles are, their handle away
    from the palm; everything else along any axis that leaves it thin enough.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    middle, size = 0.5 * (low + high), high - low
    levels = np.array(declared("hand", "levels_m"))
    if size[2] > (_LOW_M if upright else _TALL_M):
        at = np.array([0.0, 0.0, low[2] + max(share, min(0.5, 0.036 / size[2])) * size[2]])
        radii = measure_radii(points, at[2] + levels)
        if radii is not None and (upright or rng.uniform() < 0.7):
            foot = points[points[:, 2] < low[2] + 0.004]
            at[:2] = 0.5 * (foot[:, :2].min(axis=0) + foot[:, :2].max(axis=0))
            jitter = float(rng.uniform(-0.25, 0.25))
            c, s = math.cos(jitter), math.sin(jitter)
            # The object's Z along the thumb's side, its X away from the palm.
            R = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]) @ np.array(
                [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
            )
            R = np.diag([1.0, mirror[1], 1.0]) @ R @ np.diag([1.0, mirror[1], 1.0])
            yield R, (at, declared("hand", "round_sections")(radii))
    if upright:
        return
    ways = [
        (a, t, sign_a, sign_t)
        for a, t in permutations(range(3), 2)
        for sign_a in (-1.0, 1.0)
        for sign_t in (-1.0, 1.0)
        if size[t] <= _THICKEST_M and size[t] <= size[3 - a - t] + 0.01
    ]
    for number in rng.permutation(len(ways))[:8].tolist():
        a, t, sign_a, sign_t = ways[number]
        R = np.zeros((3, 3))
        R[1, a], R[2, t] = sign_a, sign_t
        R[0] = np.cross(R[1], R[2])
        at = middle.copy()
        if size[a] > 0.1:
            at[a] = low[a] + share * size[a]
        yield R, (at, declared("hand", "sections")(mirror * ((points - at) @ R.T)))


def _is_firm(gaps_m: Sequence[float]) -> bool:
    """Whether the thumb and two fingers touch, and none is pressed in."""
    touching = [gap < _TOUCH_M for gap in gaps_m]
    return min(gaps_m) > -_PRESS_M and touching[4] and sum(touching[:4]) >= 2


def _carry(hand: str, thing: str, assets: AssetIndex, rng: Rng) -> _Held | None:
    """An object that lies on an open palm on one of its sides; None if it is too large."""
    points = assets.vertices_m(thing).astype(np.float64)
    if float(np.ptp(points, axis=0).max()) > _LONGEST_M:
        return None
    asset = str(AssetId(parse_asset_id(hand).name, {"pose": "open", "seed": _seed(hand)}))
    down, turn = int(rng.integers(6)), 2.0 * math.pi * float(rng.uniform())
    if declared(thing, "vessel", False):
        down = 4
    axis = np.eye(3)[down // 2] * (-1.0 if down % 2 == 0 else 1.0)
    other = np.eye(3)[(down // 2 + 1) % 3]
    # In the asset's axes the palm faces up; a third of the hand's length is its middle.
    R = np.stack([other, np.cross(-axis, other), -axis])
    turned = SE3.about_z(turn) @ SE3.from_rotation(R)
    laid = turned.apply(points)
    palm = np.array(_palm_m(asset, assets))
    laid += palm - 0.5 * (laid.min(axis=0) + laid.max(axis=0))
    rise = _overlap_m(laid, assets.vertices_m(asset).astype(np.float64))
    offset = laid[0] - turned.apply(points[:1])[0] + np.array([0.0, 0.0, rise])
    x, y, z = (float(v) for v in offset)
    # The palm faces where a hand that holds has its thumb: up.
    side = 1.0 if declared("hand", "is_left")(_seed(asset)) else -1.0
    about_x = SE3(quaternion_wxyz=(math.sqrt(0.5), side * math.sqrt(0.5), 0.0, 0.0))
    T_hand_asset = about_x @ _wrist(asset, assets)
    T_asset_thing = SE3((x, y, z)) @ turned
    return _Held(asset, thing, T_hand_asset @ T_asset_thing, T_hand_asset, upright=True)


def _overlap_m(thing: Array, flesh: Array) -> float:
    """How far an object must rise until its convex hull rests on the vertices of a hand [m]."""
    from scipy.spatial import ConvexHull

    planes = ConvexHull(thing).equations
    low, high = planes[planes[:, 2] < -1e-6], planes[planes[:, 2] > 1e-6]
    here = np.insert(flesh[:, :2], 2, 1.0, axis=1)
    bottom = (here @ (-low[:, (0, 1, 3)] / low[:, 2:3]).T).max(axis=1)
    top = (here @ (-high[:, (0, 1, 3)] / high[:, 2:3]).T).min(axis=1)
    under = bottom < top
    return float((flesh[:, 2] - bottom)[under].max()) if under.any() else 0.0


def _palm_m(asset: str, assets: AssetIndex) -> tuple[float, float, float]:
    """Middle of an open hand between wrist and knuckles, in the asset's frame."""
    points = {point.name: np.array(point.position_m) for point in assets.keypoints(asset)}
    x, y, z = (0.35 * points["wrist"] + 0.65 * points["middle_1"]).tolist()
    return (x, y, z)


def _wrist(asset: str, assets: AssetIndex) -> SE3:
    """``T_hand_asset``: the wrist at the origin, with the axes of the asset."""
    at = next(point.position_m for point in assets.keypoints(asset) if point.name == "wrist")
    return SE3((-at[0], -at[1], -at[2]))


def _is_free(T_world_hand: SE3, held: _Held, scene: Scene, assets: AssetIndex) -> bool:
    """Whether hand, forearm and object keep clear of everything."""
    low, high = assets.bounds_m(held.thing)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1])
                        for z in (low[2], high[2])])  # fmt: skip
    arm = np.array([[-along, 0.0, 0.0] for along in _ARM_M])
    thing = (T_world_hand @ held.T_hand_thing).apply(corners)
    for point in np.concatenate([T_world_hand.apply(arm), thing]):
        x, y, z = (float(v) for v in point)
        if not is_in_the_open((x, y, z), scene, assets, _CLEAR_M):
            return False
    return True
