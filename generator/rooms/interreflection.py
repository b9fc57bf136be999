"""Light that the surfaces of rooms send to each other, as irradiance volumes.

Rooms are boxes of diffuse patches that exchange light by radiosity (Goral et al., "Modeling the
interaction of light between diffuse surfaces", SIGGRAPH 1984). Furniture takes part as a mean: it
is in the way of a share of all exchange and reflects received light evenly. Open doors pass on the
light that arrives at their other side. Values are irradiance over pi, linear RGB [cd/m^2].
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gen_data.core.scene import IrradianceVolume, Light
from gen_data.core.se3 import Array, Vec3

_PATCH_M, _PATCHES = 0.7, (3, 9)
"""Wanted size of patches, and their number along a side."""
_PROBE_M, _PROBES = 1.2, (2, 5)
"""Wanted distance of probes, and their number along a side."""
_BOUNCES = 12
_DIGITS = 3
_FURNITURE = 0.35
"""Assumed mean reflectance of upholstery, wood and lacquer."""
_GLASS = 0.1
"""Reflectance of windows: two faces of a pane, and the frame's share."""
AXES: Array = np.repeat(np.eye(3), 2, axis=0) * np.tile([1.0, -1.0], 3)[:, None]
"""Directions of an ambient cube: +X, -X, +Y, -Y, +Z, -Z; sides of a room are numbered like this."""


@dataclass(frozen=True, slots=True)
class Hole:
    """A window or door: a rectangle in a side of a room.

    Attributes:
        side: Number of the side.
        low_m, high_m: Corners, world; equal along the side's normal.
        passes: Share of the light that passes; doors pass as much as they are open.
        twin: Room behind and number of its hole; None outdoors.
    """

    side: int
    low_m: Vec3
    high_m: Vec3
    passes: float = 1.0
    twin: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class LitRoom:
    """A box that light is reflected in.

    Attributes:
        low_m, high_m: Corners, world.
        reflectance: Reflectance of each side, linear RGB.
        holes: Windows and doors.
        furniture: Share of the paths between sides that end on furniture.
    """

    low_m: Vec3
    high_m: Vec3
    reflectance: tuple[Vec3, ...]
    holes: tuple[Hole, ...] = ()
    furniture: float = 0.0


@dataclass(frozen=True, eq=False, slots=True)
class _Patches:
    """Patches of a box about its middle, and probes in it.

    Attributes:
        centers_m, inward, half_m: Centres, normals and half extents, [n, 3].
        side, area_m2: Numbers of their sides, and areas, [n].
        factors: Share of each patch j in the light that patch i receives, [n, n]; rows sum to 1.
        gather: Share of each patch in the light that probes receive around each axis,
            [probes, 6, n].
        counts: Numbers of probes along X, Y and Z, of which Z is fastest.
    """

    centers_m: Array
    inward: Array
    half_m: Array
    side: Array
    area_m2: Array
    factors: Array
    gather: Array
    counts: tuple[int, int, int]


def find_interreflection(
    rooms: Sequence[LitRoom], lights: Sequence[Light]
) -> tuple[IrradianceVolume, ...]:
    """Light from the surfaces of each room; direct light of lamps and windows is left out."""
    patches = [_patches_of(tuple(np.subtract(r.high_m, r.low_m).tolist())) for r in rooms]
    cover = [_cover(room, p) for room, p in zip(rooms, patches, strict=True)]
    walls = [_reflectance(room, p, c) for room, p, c in zip(rooms, patches, cover, strict=True)]
    direct = [_direct(room, p, lights) for room, p in zip(rooms, patches, strict=True)]
    received = [np.zeros_like(d) for d in direct]
    for _ in range(_BOUNCES):
        # Light through doors is seen as direct light already where a lamp shines through.
        sent = [
            wall * (d + r) + _through_doors(room, c, received, cover, patches)
            for room, wall, d, r, c in zip(rooms, walls, direct, received, cover, strict=True)
        ]
        mean = [
            _FURNITURE * np.average(d + r, axis=0, weights=p.area_m2)
            for d, r, p in zip(direct, received, patches, strict=True)
        ]
        received = [
            (1.0 - room.furniture) * (p.factors @ s) + room.furniture * m
            for room, p, s, m in zip(rooms, patches, sent, mean, strict=True)
        ]
    return tuple(
        _volume(room, p, (1.0 - room.furniture) * (p.gather @ s) + room.furniture * m)
        for room, p, s, m in zip(rooms, patches, sent, mean, strict=True)
    )


def _volume(room: LitRoom, patches: _Patches, light: Array) -> IrradianceVolume:
    """A volume of light [probes, 6, 3], rounded to a few digits."""
    values = tuple(float(f"{v:.{_DIGITS}g}") for v in light.ravel().tolist())
    return IrradianceVolume(room.low_m, room.high_m, patches.counts, values)


def _through_doors(
    room: LitRoom,
    cover: Array,
    received: Sequence[Array],
    covers: Sequence[Array],
    patches: Sequence[_Patches],
) -> Array:
    """Light that the holes of a room send into it, [n, 3], as it arrives at their other sides."""
    sent = np.zeros((cover.shape[1], 3))
    for hole, share in zip(room.holes, cover, strict=True):
        if hole.twin is not None:
            there, number = hole.twin
            weights = covers[there][number] * patches[there].area_m2
            arriving = weights @ received[there] / max(float(weights.sum()), 1e-9)
            sent += share[:, None] * (hole.passes * arriving)
    return sent


def _reflectance(room: LitRoom, patches: _Patches, cover: Array) -> Array:
    """Reflectance of patches, [n, 3]: of their sides, less the part that holes cover and pass."""
    walls: Array = np.array(room.reflectance)[patches.side]
    for hole, share in zip(room.holes, cover, strict=True):
        left = _GLASS if hole.twin is None else 1.0 - hole.passes
        walls = walls * (1.0 - (1.0 - left) * share)[:, None]
    return walls


def _cover(room: LitRoom, patches: _Patches) -> Array:
    """Share of each patch that each hole covers, [holes, n]."""
    middle = 0.5 * np.add(room.low_m, room.high_m)
    shares = np.zeros((len(room.holes), len(patches.side)))
    for share, hole in zip(shares, room.holes, strict=True):
        across = [k for k in range(3) if k != hole.side // 2]
        low = np.subtract(hole.low_m, middle)[across]
        high = np.subtract(hole.high_m, middle)[across]
        centers, half = patches.centers_m[:, across], patches.half_m[:, across]
        common = np.minimum(centers + half, high) - np.maximum(centers - half, low)
        inside = (np.maximum(common, 0.0) / np.maximum(2.0 * half, 1e-9)).prod(axis=1)
        share[:] = np.where(patches.side == hole.side, inside, 0.0)
    return shares


def _direct(room: LitRoom, patches: _Patches, lights: Sequence[Light]) -> Array:
    """Light that patches receive from the lights in the room or shining in, [n, 3]."""
    middle = 0.5 * np.add(room.low_m, room.high_m)
    total = np.zeros((len(patches.side), 3))
    for light in lights:
        if light.kind == "sun":
            lux = _sunlight(room, patches, middle, light)
        elif all(
            a - 0.15 <= x <= b + 0.15
            for x, a, b in zip(light.position_m, room.low_m, room.high_m, strict=True)
        ):
            lux = _lamplight(patches, middle, light)
        else:
            continue
        total += (lux / math.pi)[:, None] * np.array(light.color)
    return total


def _lamplight(patches: _Patches, middle: Array, light: Light) -> Array:
    """Illuminance [lx] of patches by a lamp or panel, [n]; together they receive its whole flux."""
    way = patches.centers_m - (np.array(light.position_m) - middle)
    # No nearer than half a patch: patches stand for all of their points.
    square = (way * way).sum(axis=1) + 0.25 * patches.area_m2
    cosine = np.maximum(-(way * patches.inward).sum(axis=1), 0.0) / np.sqrt(square)
    flux_lm = 4.0 * math.pi * light.intensity_cd
    if light.kind != "sphere":
        ahead = np.maximum(way @ np.array(light.direction), 0.0) / np.sqrt(square)
        cosine, flux_lm = cosine * ahead, math.pi * light.intensity_cd
    lux: Array = cosine / square
    return lux * (flux_lm / max(float(lux @ patches.area_m2), 1e-9))


def _sunlight(room: LitRoom, patches: _Patches, middle: Array, sun: Light) -> Array:
    """Illuminance [lx] of patches by the sun through windows, [n]."""
    steps = np.stack(np.meshgrid(*[[-0.67, 0.0, 0.67]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points_m = middle + (patches.centers_m[:, None] + steps * patches.half_m[:, None])
    way = np.array(sun.direction)
    total = np.zeros(len(patches.side))
    for hole in room.holes:
        axis = hole.side // 2
        entering = float(-way @ AXES[hole.side])
        if hole.twin is not None or entering < 1e-3:
            continue
        far = (points_m[..., axis] - hole.low_m[axis]) / way[axis]
        at_m = points_m - far[..., None] * way
        across = [k for k in range(3) if k != axis]
        low, high = np.array(hole.low_m)[across], np.array(hole.high_m)[across]
        passes = ((at_m[..., across] > low) & (at_m[..., across] < high)).all(axis=-1)
        cosine = np.maximum(-patches.inward @ way, 0.0)
        share = cosine * np.where(patches.side == hole.side, 0.0, passes.mean(axis=1))
        flux_lm = sun.illuminance_lux * entering * float((high - low).prod())
        caught = float(share @ patches.area_m2)
        if caught > 0.0:
            total += share * (flux_lm / caught)
    return total


@lru_cache(maxsize=16)
def _patches_of(size_m: Vec3) -> _Patches:
    parts = [_counted(s, _PATCH_M, _PATCHES) for s in size_m]
    centers, half, side = [], [], []
    for number, axis_way in enumerate(AXES):
        axis = number // 2
        u, v = (k for k in range(3) if k != axis)
        grid_u, grid_v = ((np.arange(parts[k]) + 0.5) / parts[k] - 0.5 for k in (u, v))
        for a in grid_u * size_m[u]:
            for b in grid_v * size_m[v]:
                point, reach = 0.5 * axis_way * size_m, np.zeros(3)
                point[u], point[v] = a, b
                reach[u], reach[v] = 0.5 * size_m[u] / parts[u], 0.5 * size_m[v] / parts[v]
                centers.append(point)
                half.append(reach)
                side.append(number)
    centers_m, half_m, sides = np.array(centers), np.array(half), np.array(side)
    inward = -AXES[sides]
    area_m2 = np.where(half_m > 0.0, 2.0 * half_m, 1.0).prod(axis=1)
    counts = [_counted(s, _PROBE_M, _PROBES) for s in size_m]
    axes = [((np.arange(c) + 0.5) / c - 0.5) * s for c, s in zip(counts, size_m, strict=True)]
    probes_m = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    facing = np.maximum(_solid_angles(centers_m, centers_m, inward, area_m2), 0.0)
    way = centers_m[None] - centers_m[:, None]
    cosine = np.maximum((way * inward[:, None]).sum(axis=2), 0.0)
    factors = _normalized(facing * cosine / np.sqrt((way * way).sum(axis=2) + 1e-12))
    seen = _solid_angles(probes_m, centers_m, inward, area_m2)
    ahead = centers_m[None] - probes_m[:, None]
    ahead = ahead / np.sqrt((ahead * ahead).sum(axis=2, keepdims=True))
    gather = _normalized(seen[:, None] * np.maximum(np.einsum("kni,ai->kan", ahead, AXES), 0.0))
    return _Patches(
        centers_m,
        inward,
        half_m,
        sides,
        area_m2,
        factors,
        gather,
        (counts[0], counts[1], counts[2]),
    )


def _counted(length_m: float, wanted_m: float, limits: tuple[int, int]) -> int:
    return min(max(round(length_m / wanted_m), limits[0]), limits[1])


def _solid_angles(points_m: Array, centers_m: Array, inward: Array, area_m2: Array) -> Array:
    """Solid angles of patches from points, [points, n]; solid angles of discs, which stay bounded.

    Source: Wallace et al., "A ray tracing algorithm for progressive radiosity", SIGGRAPH 1989.
    """
    way = centers_m[None] - points_m[:, None]
    square = (way * way).sum(axis=2)
    cosine = np.maximum(-(way * inward[None]).sum(axis=2), 0.0) / np.sqrt(square + 1e-12)
    angles: Array = cosine * area_m2 / (square + area_m2 / math.pi)
    return angles


def _normalized(weights: Array) -> Array:
    shares: Array = weights / weights.sum(axis=-1, keepdims=True)
    return shares
