"""Scenes laid out on level ground, lifted onto their relief.

Randomizers find places, routes and views in a level world. The finished view is lifted once, by
four rules:

- Ground surfaces, and lines that hang from masts, are bent point by point (``assets/drape.py``).
- Buildings stay level at the height of the ground before their fronts, on a base that reaches down
  to the lowest ground below them. Detached houses behind gardens stand as high as the higher end of
  their front, and stairs and ramps lead down from the door (``house_entrances.py``).
- Vehicles, and objects that are wider than high, turn with the plane through four points of the
  ground: below the wheels, or below the corners. Cameras on driving lanes belong to a vehicle.
- All others stay upright: people at the height of the ground below their middle, objects at
  its lowest height below them.

Trajectories follow the same rules at each knot. Flying objects are raised by the height of the
highest
lane, and keeps its motion.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.assets import asset_ids, drape, families
from gen_data.core import asset_types, decimals, lane_geometry, motion, scene_time
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.relief import CELL_M, Relief
from gen_data.core.scene import Body, Camera, Lane, Light, Scene
from gen_data.core.se3 import SE3, Array, Vec3, unit_quaternions_to_rotations
from gen_data.pipeline import house_entrances
from gen_data.pipeline.house_entrances import Ways
from gen_data.traffic.axles import find_axles

Stance = Literal["tilted", "upright", "centred", "built", "raised", "flown"]
_FOOT_MAX_M = 1.5
"""Half extents of upright objects are cut to this: crowns of trees hang over other ground."""
_CAR_M = (2.7, 1.5)
"""Wheelbase and track of the vehicle that carries a camera: means of passenger cars, assumed."""
_STOREY_M = 1.0
"""Height up to which the walls of a building stand on the ground."""
_BASE_STEP_M, _SUNK_M, _INSET_M = 0.5, 0.05, 0.02
"""Depths of bases are multiples of the first; they reach below the lowest ground by the second, and
are narrower than the building by the third."""
# Without a texture, which further views of a scene would have to fetch.
_CONCRETE = asset_types.Material((0.36, 0.35, 0.33), 0.9, role="facade")
_TURN = 5e-4
"""Points of a lane are kept where its grade has changed by this much since the last one."""
_TWIST = 1e-3
"""Cross slopes of a lane that change by less than this are one."""
_FLYING = frozenset({"drone", "gimbal"})
_HOUSES = frozenset({"building", "garage"})
_BUILT: frozenset[Stance] = frozenset({"built", "raised"})


def lift_scene(scene: Scene, assets: AssetLibrary) -> Scene:
    """The scene on its relief; unchanged if its ground is level.

    Instances keep their old frames: they are measured afterwards.
    """
    relief = scene.relief
    if relief is None:
        return scene
    lanes = _lifted_lanes(scene.lanes, relief)
    heights_m = [point[2] for lane in lanes for point in lane.center_m] or [0.0]
    sky_m = max(heights_m)
    bodies, moves = _lift_bodies(scene.bodies, scene.lanes, assets, relief, sky_m)
    tracks = tuple(
        _lifted_track(track, scene.body(track.body), assets, relief, sky_m)
        for track in scene.tracks
    )
    tracked = {track.body: track.pose(scene.time_s).rounded() for track in tracks}
    low, high = scene.interior_m
    return replace(
        scene,
        bodies=tuple(
            replace(b, T_world_body=tracked[b.name]) if b.name in tracked else b for b in bodies
        ),
        tracks=tracks,
        lanes=lanes,
        lights=tuple(_lifted_light(light, moves, relief) for light in scene.lights),
        cameras=tuple(_lifted_camera(camera, scene.lanes, relief) for camera in scene.cameras),
        rigs=tuple(
            rig if rig.body else replace(rig, T_body_rig=_raised(rig.T_body_rig, relief))
            for rig in scene.rigs
        ),
        surfaces=tuple(
            replace(s, T_world_surface=(moves[s.body] @ s.T_world_surface).rounded())
            for s in scene.surfaces
        ),
        interior_m=(
            (low[0], low[1], low[2] + min(heights_m)),
            (high[0], high[1], high[2] + sky_m),
        ),
    )


@dataclass(frozen=True, slots=True)
class _Foot:
    """Points of a body on the ground, in its frame: the corners of a rectangle.

    Attributes:
        stance: How it stands.
        x_m, y_m: From rear to front and from right to left.
    """

    stance: Stance
    x_m: tuple[float, float]
    y_m: tuple[float, float]


def _corners(feet: Sequence[_Foot], poses: Sequence[SE3]) -> Array:
    """Rear right, rear left, front right, front left of feet [n] at their poses [n], [n, 4, 3].

    All at once: a street has hundreds of bodies.
    """
    sides = np.array([(foot.x_m, foot.y_m) for foot in feet]).reshape(-1, 2, 2)
    x, y = sides[:, 0].repeat(2, axis=1)[..., None], np.tile(sides[:, 1], 2)[..., None]
    quaternions = np.array([pose.quaternion_wxyz for pose in poses]).reshape(-1, 4)
    turns = unit_quaternions_to_rotations(quaternions)
    origins_m = np.array([pose.translation_m for pose in poses]).reshape(-1, 1, 3)
    corners: Array = turns[:, None, :, 0] * x + turns[:, None, :, 1] * y + origins_m
    return corners


def _foot(body: Body, assets: AssetLibrary) -> _Foot:
    asset = assets.get(body.asset)
    tags = frozenset(asset.tags)
    (x0, y0, z0), (x1, y1, z1) = _scaled(assets.bounds_m(body.asset), body.scale)
    if tags & _FLYING:
        return _Foot("flown", (0.0, 0.0), (0.0, 0.0))
    if tags & _HOUSES:
        low, high = _scaled(_ground_floor(body.asset, assets), body.scale)
        return _Foot("built", (low[0], high[0]), (low[1], high[1]))
    if "vehicle" in tags:
        axles = find_axles(assets, body.asset, body.scale)
        rear = axles.T_body_rear.translation_m[0]
        return _Foot("tilted", (rear, rear + axles.wheelbase_m), (y0, y1))
    is_low = max(x1 - x0, y1 - y0) > z1 - z0 and "tree" not in tags
    if is_low and min(x1 - x0, y1 - y0) > 0.0 and body.instance_id:
        return _Foot("tilted", (x0, x1), (y0, y1))
    if "pedestrian" in tags:
        return _Foot("centred", (x0, x1), (y0, y1))
    most = _FOOT_MAX_M if body.instance_id else math.inf
    (x0, x1), (y0, y1) = ((max(a, -most), min(b, most)) for a, b in ((x0, x1), (y0, y1)))
    return _Foot("upright", (x0, x1), (y0, y1))


@lru_cache(maxsize=4096)
def _ground_floor(asset: str, assets: AssetLibrary) -> tuple[Vec3, Vec3]:
    """Bounds of a building below balconies and eaves."""
    points = assets.vertices_m(asset)
    low = points[points[:, 2] < points[:, 2].min() + _STOREY_M]
    (x0, y0, z0), (x1, y1, z1) = (
        (float(x), float(y), float(z)) for x, y, z in (low.min(axis=0), low.max(axis=0))
    )
    return (x0, y0, z0), (x1, y1, z1)


def _scaled(bounds_m: tuple[Vec3, Vec3], scale: float) -> tuple[Vec3, Vec3]:
    (x0, y0, z0), (x1, y1, z1) = bounds_m
    return (scale * x0, scale * y0, scale * z0), (scale * x1, scale * y1, scale * z1)


@lru_cache(maxsize=2)
def _lift_bodies(
    level: tuple[Body, ...],
    lanes: tuple[Lane, ...],
    assets: AssetLibrary,
    relief: Relief,
    sky_m: float,
) -> tuple[tuple[Body, ...], Mapping[str, SE3]]:
    """The bodies on the relief, with the bases of buildings, and their moves by name.

    All views of a scene have the same ones.
    """
    # All bodies of an instance, such as a person with an umbrella, move as its first one does.
    first: dict[int, Body] = {}
    for body in level:
        first.setdefault(body.instance_id, body)
    leaders = {body.name: first[body.instance_id] if body.instance_id else body for body in level}
    draped = {body.name for body in level if _is_draped(body)}
    standing = [b for b in level if leaders[b.name] is b and b.name not in draped]
    land = house_entrances.Land.of(lanes, relief)
    feet = [_in_garden(_foot(body, assets), body, land.ways, assets) for body in standing]
    corners = _corners(feet, [body.T_world_body for body in standing])
    heights = relief.height(corners.reshape(-1, 3)).reshape(-1, 4)
    moves = {
        body.name: _move(foot.stance, points, z, sky_m)
        for body, foot, points, z in zip(
            standing, feet, corners.tolist(), heights.tolist(), strict=True
        )
    }
    bodies: list[Body] = []
    for body in level:
        if body.name in draped:
            parsed = asset_ids.parse_asset_id(body.asset)
            asset = drape.draped_id(parsed, body.T_world_body, body.scale, relief)
            bodies.append(replace(body, asset=asset))
            moves[body.name] = _rise(body.T_world_body, relief)
        else:
            move = moves[leaders[body.name].name]
            moves[body.name] = move
            bodies.append(replace(body, T_world_body=(move @ body.T_world_body).rounded()))
    for body, foot, z in zip(standing, feet, heights.tolist(), strict=True):
        if foot.stance not in _BUILT or max(z) == min(z):
            continue
        bodies += _base(body, foot, z, assets)
        if foot.stance == "raised":
            floor_m = _floor_m(foot.stance, z)
            bodies += house_entrances.entrances(body, floor_m, level, land, assets)
    return tuple(bodies), moves


def _is_draped(body: Body) -> bool:
    """Whether its mesh follows the ground: its family declares it, and it is upright."""
    _, x, y, _ = body.T_world_body.quaternion_wxyz
    return x == y == 0.0 and families.declared(body.asset, drape.FACT, None) is not None


def _move(
    stance: Stance, corners: Sequence[Sequence[float]], z: Sequence[float], sky_m: float
) -> SE3:
    """``T_lifted_level`` of something by its points on the ground [4, 3] and their heights [4]."""
    if stance == "flown":
        return SE3((0.0, 0.0, sky_m))
    if stance == "upright":
        return SE3((0.0, 0.0, min(z)))
    if stance in _BUILT:
        return SE3((0.0, 0.0, _floor_m(stance, z)))
    if stance == "centred":
        return SE3((0.0, 0.0, _mean(*z)))
    return _tilt(corners, z)


def _mean(a: float, b: float, c: float, d: float) -> float:
    return (a + b + c + d) / 4.0


def _tilt(corners: Sequence[Sequence[float]], z: Sequence[float]) -> SE3:
    """The motion of a plane, level at 0, onto the one nearest to the raised corners.

    Headings in plan stay: it turns about the level line across the steepest slope. Number by
    number: a street has hundreds of bodies with four corners each.
    """
    (x0, y0, _), (x1, y1, _), (x2, y2, _), (x3, y3, _) = corners
    z0, z1, z2, z3 = z
    ahead_x, ahead_y = 0.5 * (x2 + x3 - x0 - x1), 0.5 * (y2 + y3 - y0 - y1)
    left_x, left_y = 0.5 * (x1 + x3 - x0 - x2), 0.5 * (y1 + y3 - y0 - y2)
    rise_ahead, rise_left = 0.5 * (z2 + z3 - z0 - z1), 0.5 * (z1 + z3 - z0 - z2)
    # Slopes along x and y from the rises along both sides of the rectangle.
    area = ahead_x * left_y - ahead_y * left_x
    slope_x = (rise_ahead * left_y - rise_left * ahead_y) / area
    slope_y = (rise_left * ahead_x - rise_ahead * left_x) / area
    steepness = slope_x * slope_x + slope_y * slope_y
    cosine = 1.0 / math.sqrt(1.0 + steepness)
    # The quaternion of the shortest turn of Z to the normal, (-slope_x, -slope_y, 1) * cosine.
    w = math.sqrt(0.5 * (1.0 + cosine))
    turn = (w, slope_y * cosine / (2.0 * w), -slope_x * cosine / (2.0 * w), 0.0)
    x, y = _mean(x0, x1, x2, x3), _mean(y0, y1, y2, y3)
    return SE3((x, y, _mean(*z)), turn) @ SE3((-x, -y, 0.0))


def _base(body: Body, foot: _Foot, z: Sequence[float], assets: AssetLibrary) -> Iterator[Body]:
    """Blocks below a building whose floor is above the lowest ground; none if nothing is open."""
    floor_m = _floor_m(foot.stance, z)
    depth_m = math.ceil((floor_m - min(z) + _SUNK_M) / _BASE_STEP_M) * _BASE_STEP_M
    if floor_m - min(z) < _SUNK_M:
        return
    parts = [(foot.y_m, foot.x_m[1])]
    if foot.stance == "raised":
        # The landing of the stairs carries the steps at the door.
        parts = house_entrances.fronts_m(body, foot.y_m, assets)
    for number, ((right_m, left_m), front_m) in enumerate(parts):
        length_m = round(min(front_m, foot.x_m[1]) - foot.x_m[0] - _INSET_M, 2)
        width_m = round(left_m - right_m - _INSET_M / len(parts), 2)
        if min(length_m, width_m) <= 0.0:
            continue
        asset = _box((length_m, width_m, depth_m))
        x_m = foot.x_m[0] + 0.5 * (_INSET_M + length_m)
        pose = SE3((0.0, 0.0, floor_m)) @ body.T_world_body
        pose = pose @ SE3((x_m, 0.5 * (right_m + left_m), -_top_m(depth_m, assets) - 0.001))
        name = f"{body.name}/base{number or ''}"
        yield Body(name, asset, pose.rounded(), collides=False, materials=(_CONCRETE,))


def _box(size_m: Vec3) -> str:
    return str(asset_ids.AssetId("box", {"size_m": size_m}))


@lru_cache(maxsize=64)
def _top_m(height_m: float, assets: AssetLibrary) -> float:
    """Height of the upper side of boxes of one height; few bases are equally long."""
    return assets.bounds_m(_box((1.0, 1.0, height_m)))[1][2]


def _floor_m(stance: Stance, z: Sequence[float]) -> float:
    """Height of the ground floor of a building, by the ground at its corners [4]."""
    return max(z[2], z[3]) if stance == "raised" else 0.5 * (z[2] + z[3])


def _in_garden(foot: _Foot, body: Body, ways: Ways, assets: AssetLibrary) -> _Foot:
    """The foot of a house whose family has stairs, raised if its garden has room for them."""
    room_m = (
        families.declared(body.asset, house_entrances.STAIRS, None)
        if foot.stance == "built"
        else None
    )
    if room_m is None:
        return foot
    ends = [
        body.T_world_body.apply((np.asarray(door) * body.scale) + (room_m, 0.0, 0.0))[:2]
        for door in house_entrances.doors(body, assets)
    ]
    is_free = bool(ends) and not any(ways.reach(end) for end in ends)
    return replace(foot, stance="raised") if is_free else foot


def _rise(pose: SE3, relief: Relief) -> SE3:
    return SE3((0.0, 0.0, float(relief.height(np.array([pose.translation_m]))[0])))


def _raised(pose: SE3, relief: Relief) -> SE3:
    return (_rise(pose, relief) @ pose).rounded()


def _lifted_camera(camera: Camera, lanes: Iterable[Lane], relief: Relief) -> Camera:
    """A camera that no rig carries: it moves as a car does if it is above a driving lane."""
    pose = camera.T_world_camera
    if camera.rig:
        return camera
    place = np.array(pose.translation_m[:2])
    if not Ways.of(lane for lane in lanes if lane.kind == "driving").reach(place):
        return replace(camera, T_world_camera=_raised(pose, relief))
    x, y, _ = pose.rotate(np.array([0.0, 0.0, 1.0])).tolist()
    move = _ridden(pose, math.atan2(y, x), relief)
    return replace(camera, T_world_camera=(move @ pose).rounded())


def _ridden(pose: SE3, yaw_rad: float, relief: Relief) -> SE3:
    """The motion of a car's passenger at a place."""
    x, y, _ = pose.translation_m
    half = (0.5 * _CAR_M[0], 0.5 * _CAR_M[1])
    foot = _Foot("tilted", (-half[0], half[0]), (-half[1], half[1]))
    (corners,) = _corners([foot], [SE3.about_z(yaw_rad, (x, y, 0.0))])
    return _tilt(corners.tolist(), relief.height(corners).tolist())


def _lifted_track(
    track: motion.Trajectory, body: Body, assets: AssetLibrary, relief: Relief, sky_m: float
) -> motion.Trajectory:
    foot = _foot(body, assets)
    corners = _corners([foot] * len(track.knots), track.knots)
    heights = relief.height(corners.reshape(-1, 3)).reshape(-1, 4)
    knots = tuple(
        _move(foot.stance, points, z, sky_m) @ knot
        for knot, points, z in zip(track.knots, corners.tolist(), heights.tolist(), strict=True)
    )
    return replace(track, knots=knots)


def _lifted_light(light: Light, moves: Mapping[str, SE3], relief: Relief) -> Light:
    if light.kind == "sun":
        return light
    if light.body in moves:
        return scene_time.moved_light(light, moves[light.body])
    pose = SE3(light.position_m)
    if light.cutoff:
        # A headlight without a body belongs to the car that carries the camera.
        yaw_rad = math.atan2(light.direction[1], light.direction[0])
        return scene_time.moved_light(light, _ridden(pose, yaw_rad, relief))
    return scene_time.moved_light(light, _rise(pose, relief))


@lru_cache(maxsize=2)
def _lifted_lanes(lanes: tuple[Lane, ...], relief: Relief) -> tuple[Lane, ...]:
    """The lanes with their points on the ground, and more of them where that bends.

    The ground is asked for all points at once: a street has a hundred lanes of a few points.
    """
    if not lanes:
        return ()
    lines = [_refined(np.array(lane.center_m, np.float64)) for lane in lanes]
    halves = [
        0.5 * _across_m(lane) * lane_geometry.left_normals(points)
        for lane, (points, _) in zip(lanes, lines, strict=True)
    ]
    middle, half = np.concatenate([points for points, _ in lines]), np.concatenate(halves)
    ends = np.cumsum([len(points) for points, _ in lines])[:-1]
    heights, lefts, rights = (
        np.split(relief.height(at), ends) for at in (middle, middle + half, middle - half)
    )
    return tuple(
        _lifted_lane(lane, *line, height, left - right)
        for lane, line, height, left, right in zip(
            lanes, lines, heights, lefts, rights, strict=True
        )
    )


def _across_m(lane: Lane) -> float:
    return max(lane.width_m, 1.0)


def _lifted_lane(
    lane: Lane, points: Array, given: NDArray[np.bool_], height: Array, rise: Array
) -> Lane:
    """A lane from its refined line [n, 3], heights of the ground, and rises across it, [n]."""
    across_m = _across_m(lane)
    points[:, 2] += height
    bank = lane.bank + float(rise.mean()) / across_m
    banks = lane.bank + rise / across_m
    is_twisted = bool(banks.max() - banks.min() > _TWIST)
    # Differences by slices: numpy's function takes longer than the few points of a lane.
    steps = points[1:] - points[:-1]
    grades = steps[:, 2] / np.hypot(steps[:, 0], steps[:, 1])
    given[1:-1] |= _turns(grades)
    if is_twisted:
        given[1:] |= _turns(banks)
    center = [(x, y, z) for x, y, z in decimals.round_rows(points[given], 6)]
    return replace(
        lane,
        center_m=tuple(center),
        bank=round(bank, 9) + 0.0,
        banks=tuple((np.round(banks[given], 9) + 0.0).tolist()) if is_twisted else (),
    )


def _turns(slopes: Array) -> NDArray[np.bool_]:
    """Where slopes [n] along a line have changed by another ``_TURN`` since its start, [n - 1]."""
    turned = np.floor(np.cumsum(np.abs(slopes[1:] - slopes[:-1])) / _TURN)
    changed: NDArray[np.bool_] = turned > 0.0
    changed[1:] = turned[1:] > turned[:-1]
    return changed


def _refined(points: Array) -> tuple[Array, NDArray[np.bool_]]:
    """A line [n, 3] with further points, no two farther apart than a cell, and which were given."""
    step = points[1:] - points[:-1]
    count = np.maximum(np.ceil(np.hypot(step[:, 0], step[:, 1]) / CELL_M), 1.0).astype(np.int64)
    piece = np.repeat(np.arange(len(step)), count)
    number = 1 + np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)
    share = (number / count[piece])[:, None]
    line = np.concatenate([points[:1], points[piece] + share * step[piece]])
    return line, np.concatenate([[True], number == count[piece]])
