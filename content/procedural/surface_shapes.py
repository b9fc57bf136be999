"""Shape generators: everything is a grid of quads or an extruded polygon.

All of them return ``Patch`` objects in metres, wound counter-clockwise seen from outside.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache

import numpy as np

from gen_data.assets.triangle_soup import face_crosses
from gen_data.content.procedural.patches import Array, Indices, Patch, join_patches, unit
from gen_data.core.se3 import Vec3

Point2 = tuple[float, float]
Corner = Sequence[float] | Array
UvRect = tuple[float, float, float, float]
WHOLE_IMAGE: UvRect = (0.0, 0.0, 1.0, 1.0)
_GRIDS_KEPT = 256

# Face of a box: (outward axis, image right, image up), with right x up = outward.
BOX_FACES: Mapping[str, tuple[Vec3, Vec3, Vec3]] = {
    "front": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "back": ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    "left": ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "right": ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "top": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)),
    "bottom": ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)),
}


def grid(points: Array, u: Array | None = None, v: Array | None = None, slot: int = 0) -> Patch:
    """Quads over points of shape [rows, columns, 3]; outward is (along columns) x (along rows).

    Args:
        points: Vertices [m].
        u: Horizontal texture coordinate per column; even by default.
        v: Vertical texture coordinate per row; by mean arc length by default.
        slot: Material slot.
    """
    rows, columns = points.shape[:2]
    u = np.linspace(0.0, 1.0, columns) if u is None else u
    if v is None:
        steps = np.sqrt(((points[1:] - points[:-1]) ** 2).sum(axis=2)).mean(axis=1)
        v = np.concatenate([[0.0], np.cumsum(steps)]) / max(float(steps.sum()), 1e-12)
    uv = np.zeros((rows, columns, 2))
    uv[..., 0], uv[..., 1] = u, v[:, None]
    places = _quads(rows, columns)
    slots = np.full(len(places), slot, dtype=np.int64)
    return Patch(points.reshape(-1, 3)[places], uv.reshape(-1, 2)[places], slots)


def lathe(
    profile: Sequence[Point2], segments: int = 32, slot: int = 0, v: Point2 | None = None
) -> Patch:
    """A profile of (radius, z) turned about Z.

    Walking along the profile, outside is on the right: up the outer wall, down the inner one.
    Texture: u runs once around, its middle at +X and upright to a viewer outside; v along the
    profile, over the given range or over all of [0, 1].
    """
    radius, z = (np.array([p[i] for p in profile], dtype=np.float64) for i in (0, 1))
    turn = 2.0 * math.pi * np.arange(segments) / segments - math.pi
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    around = np.concatenate([around, around[:1]])
    xy = radius[:, None, None] * around[None, :, :]
    points = np.concatenate([xy, np.broadcast_to(z[:, None, None], (*xy.shape[:2], 1))], axis=2)
    rows = None
    if v is not None:
        steps = np.sqrt(np.diff(radius) ** 2 + np.diff(z) ** 2)
        rows = v[0] + (v[1] - v[0]) * np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
    return grid(points, v=rows, slot=slot)


def cone(low: Point2, high: Point2, segments: int = 24, slot: int = 0) -> Patch:
    """A closed cylinder or truncated cone about Z between two (radius, z)."""
    return lathe([(0.0, low[1]), low, high, (0.0, high[1])], segments, slot)


def sweep(
    path: Array,
    section: Array,
    *,
    up: Vec3 = (0.0, 0.0, 1.0),
    scale: Array | None = None,
    capped: bool = True,
    slot: int = 0,
) -> Patch:
    """A cross-section carried along a path without twist.

    Args:
        path: Centre line [m], shape [n, 3].
        section: Counter-clockwise outline [m], shape [k, 2]; its first axis starts along ``up``.
        up: Direction of the section's first axis at the start.
        scale: Factors on the section per path point, shape [n] or [n, 2].
        capped: Whether open ends are closed by flat caps.
        slot: Material slot.
    """
    first, second = frames_along(path, up)
    factors = np.ones((len(path), 2)) if scale is None else np.asarray(scale, dtype=np.float64)
    factors = np.repeat(factors[:, None], 2, axis=1) if factors.ndim == 1 else factors
    outline = np.concatenate([section, section[:1]])
    a = outline[None, :, :1] * factors[:, None, :1]
    b = outline[None, :, 1:] * factors[:, None, 1:]
    points = path[:, None, :] + a * first[:, None, :] + b * second[:, None, :]
    ends = [] if not capped else [fan(points[0, :0:-1], slot), fan(points[-1, :-1], slot)]
    return join_patches([grid(points, slot=slot), *ends])


def frames_along(path: Array, up: Vec3) -> tuple[Array, Array]:
    """Two unit normals per path point; normals x are carried without rotation about the path.

    Double reflection: Wang et al., "Computation of rotation minimizing frames", ACM TOG 27(1),
    2008.
    """
    tangents = unit(np.gradient(path, axis=0))
    first = np.zeros_like(path)
    start = np.array(up) - (np.array(up) * tangents[0]).sum() * tangents[0]
    first[0] = start / math.sqrt(float((start * start).sum()))
    for i in range(len(path) - 1):
        step = path[i + 1] - path[i]
        reflected = first[i] - 2.0 * (step * first[i]).sum() / (step * step).sum() * step
        tangent = tangents[i] - 2.0 * (step * tangents[i]).sum() / (step * step).sum() * step
        rest = tangents[i + 1] - tangent
        size = float((rest * rest).sum())
        if size > 1e-18:
            reflected = reflected - 2.0 * (rest * reflected).sum() / size * rest
        first[i + 1] = reflected
    return first, np.cross(tangents, first)


def fan(loop: Array, slot: int = 0) -> Patch:
    """Triangles from the centroid to a loop, shape [n, 3], counter-clockwise from outside."""
    centre = np.broadcast_to(loop.mean(axis=0), loop.shape)
    corners = np.stack([centre, loop, np.roll(loop, -1, axis=0)], axis=1)
    turn = 2.0 * math.pi * np.arange(len(loop) + 1) / len(loop)
    rim = 0.5 + 0.5 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    uvs = np.stack([np.full((len(loop), 2), 0.5), rim[:-1], rim[1:]], axis=1)
    return Patch(corners, uvs, np.full(len(loop), slot, dtype=np.int64))


def ball(shape: Callable[[Array], Array], rings: int = 16, segments: int = 24) -> Patch:
    """A sphere's directions, shape [rows, columns, 3], mapped by ``shape`` to points [m]."""
    polar = math.pi * (np.arange(rings + 1) / rings - 0.5)
    turn = 2.0 * math.pi * np.arange(segments) / segments - math.pi
    turn = np.concatenate([turn, turn[:1]])
    radius = np.cos(polar)
    radius[[0, -1]] = 0.0
    x, y = radius[:, None] * np.cos(turn), radius[:, None] * np.sin(turn)
    directions = np.stack(np.broadcast_arrays(x, y, np.sin(polar)[:, None]), axis=2)
    return grid(shape(directions), v=np.linspace(0.0, 1.0, rings + 1))


def rounded_box(
    size_m: Vec3, radius_m: float, steps: int = 2, *, uv: Mapping[str, UvRect] | None = None
) -> Patch:
    """A box about the origin with rounded edges.

    Args:
        size_m: Outer size.
        radius_m: Edge radius, at most half the smallest side.
        steps: Quads from a face's border to the middle of the edge.
        uv: Image rectangle ``(u0, v0, u1, v1)`` per face of ``BOX_FACES``; all of it by default.
    """
    half = 0.5 * np.array(size_m)
    radius = min(radius_m, float(half.min()))
    patches = []
    for name, axes in BOX_FACES.items():
        outward, right, up = (np.array(axis) for axis in axes)
        a, b = (
            _rounded_ticks(float((half * np.abs(axis)).sum()), radius, steps)
            for axis in (right, up)
        )
        flat = outward * half + a[None, :, None] * right + b[:, None, None] * up
        core = np.clip(flat, -(half - radius), half - radius)
        away = flat - core
        length = np.sqrt((away**2).sum(axis=2, keepdims=True))
        points = core + radius * away / np.maximum(length, 1e-300)
        u0, v0, u1, v1 = (uv or {}).get(name, WHOLE_IMAGE)
        u, v = ((t - t[0]) / (t[-1] - t[0]) for t in (a, b))
        patches.append(grid(points, u0 + (u1 - u0) * u, v0 + (v1 - v0) * v))
    return join_patches(patches)


def block(
    low: Sequence[float] | Array,
    high: Sequence[float] | Array,
    radius_m: float = 0.0,
    slot: int = 0,
) -> Patch:
    """A box between two corners; a small edge radius catches highlights."""
    size: Vec3 = (high[0] - low[0], high[1] - low[1], high[2] - low[2])
    x, y, z = (0.5 * (a + b) for a, b in zip(low, high, strict=True))
    if radius_m > 0:
        made = rounded_box(size, radius_m, 1)
    else:
        made = _cube().scaled(0.5 * size[0], 0.5 * size[1], 0.5 * size[2])
    return made.moved(x, y, z).painted(slot)


def extrude(
    outline: Array,
    height_m: float,
    bevel_m: float = 0.0,
    holes: Sequence[Array] = (),
    slot: int = 0,
) -> Patch:
    """A polygon, shape [n, 2], raised from z = 0 to ``height_m``.

    Outline and holes may run either way round; edges at top and bottom are bevelled by
    ``bevel_m``, which must be smaller than half of the narrowest part.
    """
    loops = [_wind_loop(outline, 1.0), *(_wind_loop(hole, -1.0) for hole in holes)]
    inner = [_inset(loop, bevel_m) if bevel_m > 0 else loop for loop in loops]
    levels = [(loops, bevel_m), (loops, height_m - bevel_m)]
    if bevel_m > 0:
        levels = [(inner, 0.0), *levels, (inner, height_m)]
    walls = []
    for i in range(len(loops)):
        rows = [np.insert(np.concatenate([p[i], p[i][:1]]), 2, z, axis=1) for p, z in levels]
        walls.append(grid(np.stack(rows), slot=slot))
    top = _cap(inner, height_m, slot)
    return join_patches([*walls, top, _cap(inner, 0.0, slot).flipped()])


def at_corners(x_m: float, y_m: float) -> tuple[Point2, ...]:
    """Corners of a rectangle about the origin: (-x, -y), (-x, y), (x, -y), (x, y) [m]."""
    return ((-x_m, -y_m), (-x_m, y_m), (x_m, -y_m), (x_m, y_m))


def circle(radius_m: float, sides: int, centre: Point2 = (0.0, 0.0), phase: float = 0.0) -> Array:
    """Counter-clockwise points of a circle, shape [sides, 2]."""
    turn = 2.0 * math.pi * (np.arange(sides) + phase) / sides
    points: Array = radius_m * np.stack([np.cos(turn), np.sin(turn)], axis=1) + np.array(centre)
    return points


def fillet(
    points: Sequence[Point2], radii_m: Sequence[float] | float, steps: int = 3
) -> list[Point2]:
    """An open polyline with its inner corners rounded by arcs of the given radii."""
    radii = [radii_m] * len(points) if isinstance(radii_m, float) else list(radii_m)
    p = np.array(points, dtype=np.float64)
    made: list[Point2] = [points[0]]
    for i in range(1, len(p) - 1):
        before, after = p[i - 1] - p[i], p[i + 1] - p[i]
        lb, la = math.hypot(*before), math.hypot(*after)
        cosine = float((before * after).sum()) / (lb * la)
        half = 0.5 * math.acos(max(-1.0, min(1.0, cosine)))
        reach = min(radii[i] / max(math.tan(half), 1e-9), 0.49 * lb, 0.49 * la)
        # The arc of a nearly straight corner would have no length.
        if radii[i] <= 0.0 or half > 0.5 * math.pi - 1e-3:
            made.append(points[i])
            continue
        a, b = p[i] + before / lb * reach, p[i] + after / la * reach
        made.extend(_arc(a, p[i], b, half, steps))
    return [*made, points[-1]]


def spline(points: Sequence[Sequence[float]], count: int) -> Array:
    """A smooth curve through the points, shape [count, dimensions] (Catmull-Rom)."""
    p = np.array(points, dtype=np.float64)
    p = np.concatenate([[2 * p[0] - p[1]], p, [2 * p[-1] - p[-2]]])
    t = np.linspace(0.0, len(points) - 1.0, count)
    i = np.minimum(t.astype(np.int64), len(points) - 2)
    f = (t - i)[:, None]
    a, b, c, d = (p[i + k] for k in range(4))
    bend = c - a + f * (2 * a - 5 * b + 4 * c - d + f * (3 * (b - c) + d - a))
    curve: Array = b + 0.5 * f * bend
    return curve


def space_evenly(path: Array, count: int) -> Array:
    """Points at equal distances along a polyline, shape [count, dimensions]."""
    steps = np.sqrt(((path[1:] - path[:-1]) ** 2).sum(axis=1))
    length = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, float(length[-1]), count)
    return np.stack([np.interp(at, length, path[:, i]) for i in range(path.shape[1])], axis=1)


def map_along_grain(patch: Patch, repeat_m: float) -> Patch:
    """The patch with a texture's horizontal along its longest side, stretched to twice its length.

    It repeats every ``repeat_m`` across the grain. Each piece starts at another place of the image,
    like boards cut from different logs.
    """
    low, high = patch.bounds_m()
    axes = np.argsort(-np.round(high - low, 6), kind="stable")
    corners = patch.corners_m
    facing = np.abs(face_crosses(corners)).argmax(axis=1)
    u_axis = np.where(facing == axes[0], axes[1], axes[0])
    v_axis = 3 - facing - u_axis
    place = corners - low + 1.618 * (low + high)
    rows = np.arange(len(corners))
    uv = np.stack([place[rows, :, u_axis], place[rows, :, v_axis]], axis=2) / repeat_m
    return replace(patch, uvs=uv * [0.5, 1.0])


@lru_cache(maxsize=_GRIDS_KEPT)
def _quads(rows: int, columns: int) -> Indices:
    """Corners of the two triangles of each quad, shape [n, 3], as numbers of a grid's points."""
    points = np.arange(rows * columns, dtype=np.int64).reshape(rows, columns)
    a, b = points[:-1, :-1], points[:-1, 1:]
    c, d = points[1:, 1:], points[1:, :-1]
    return np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3)


def _rounded_ticks(half: float, radius: float, steps: int) -> Array:
    """Positions along a face whose projection on the rounding is even in angle."""
    angles = np.linspace(0.25 * math.pi, 0.0, steps + 1)
    edge = -(half - radius) - radius * np.tan(angles)
    return np.concatenate([edge, -edge[::-1] if half > radius + 1e-9 else -edge[-2::-1]])


@cache
def _cube() -> Patch:
    """A cube from -1 to 1."""
    patches = []
    for axes in BOX_FACES.values():
        outward, right, up = (np.array(axis) for axis in axes)
        rows = [[outward - right + s * up, outward + right + s * up] for s in (-1.0, 1.0)]
        patches.append(grid(np.array(rows)))
    return join_patches(patches)


def _wind_loop(loop: Array, sign: float) -> Array:
    return loop if _double_area(loop) * sign > 0 else loop[::-1]


def _inset(loop: Array, distance: float) -> Array:
    """The loop moved to its left by ``distance``, corners mitred."""
    step = unit(np.roll(loop, -1, axis=0) - loop)
    left = np.stack([-step[:, 1], step[:, 0]], axis=1)
    before = np.roll(left, 1, axis=0)
    mitre = (left + before) / np.maximum(1.0 + (left * before).sum(axis=1, keepdims=True), 0.3)
    moved: Array = loop + distance * mitre
    return moved


def _cap(loops: Sequence[Array], z: float, slot: int) -> Patch:
    flat = triangulate(loops[0], loops[1:])
    low, high = loops[0].min(axis=0), loops[0].max(axis=0)
    corners = np.concatenate([flat, np.full((*flat.shape[:2], 1), z)], axis=2)
    return Patch(corners, (flat - low) / (high - low), np.full(len(flat), slot, dtype=np.int64))


def triangulate(outline: Array, holes: Sequence[Array] = ()) -> Array:
    """Triangles, shape [n, 3, 2], of a counter-clockwise polygon with holes.

    Their corners are exactly the given points: walls and caps weld.

    Raises:
        ValueError: if the polygon crosses itself, or a hole lies outside its outline.
    """
    import mapbox_earcut

    points = np.concatenate([outline, *holes]).astype(np.float64)
    ends = np.cumsum([len(outline), *(len(hole) for hole in holes)], dtype=np.uint32)
    corners = mapbox_earcut.triangulate_float64(points, ends).reshape(-1, 3)
    triangles: Array = points[corners]
    areas = _double_areas(*np.moveaxis(triangles, 1, 0))
    expected = abs(_double_area(outline)) - sum(abs(_double_area(hole)) for hole in holes)
    # Polygons that are none are cut up all the same: their triangles overlap or leave gaps.
    if abs(np.abs(areas).sum() - expected) > 1e-9 * abs(_double_area(outline)):
        raise ValueError("the polygon crosses itself, or a hole lies outside its outline")
    triangles[areas < 0.0] = triangles[areas < 0.0][:, ::-1]
    return triangles


def _double_areas(a: Array, b: Array, c: Array) -> Array:
    """Twice the signed areas of triangles."""
    (ux, uy), (vx, vy) = (np.moveaxis(p - a, -1, 0) for p in (b, c))
    doubled: Array = ux * vy - uy * vx
    return doubled


def _double_area(loop: Array) -> float:
    """Twice the signed area inside a loop of points."""
    after = np.roll(loop, -1, axis=0)
    return float((loop[:, 0] * after[:, 1] - loop[:, 1] * after[:, 0]).sum())


def _arc(a: Array, corner: Array, b: Array, half: float, steps: int) -> list[Point2]:
    """Points of the arc that is tangent to both sides of a corner at ``a`` and ``b``."""
    middle = 0.5 * (a + b)
    to_centre = middle - corner
    length = math.hypot(*to_centre)
    centre = corner + to_centre / length * (length / math.cos(half) ** 2)
    radius = math.hypot(*(a - centre))
    ra, rb = (a - centre) / radius, (b - centre) / radius
    sweep_rad = math.acos(max(-1.0, min(1.0, float((ra * rb).sum()))))
    arc = []
    for t in np.linspace(0.0, 1.0, steps + 1):
        wa, wb = math.sin((1 - t) * sweep_rad), math.sin(t * sweep_rad)
        x, y = centre + radius * (wa * ra + wb * rb) / math.sin(sweep_rad)
        arc.append((float(x), float(y)))
    return arc
