"""Meshes that follow the relief of the ground.

``road?length_m=150&at=0,0,0,1&relief=...`` is ``road?length_m=150`` in its place in a world with
that relief: each point is raised by the height of the ground below it; upright edges stay upright.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.asset_ids import AssetId
from gen_data.assets.importer import ImportedMesh
from gen_data.core.asset_types import ConvexParts, Keypoint, MeshData
from gen_data.core.errors import AssetError
from gen_data.core.relief import Relief
from gen_data.core.se3 import SE3, Array

Ints = NDArray[np.integer]

VERSION = 2
"""Raised whenever the same arguments make other bytes."""
FACT = "draped"
"""Families declare under this name how their meshes follow the ground: ``layers`` are cut along the
lines of its grid, and stay as far apart as they are on level ground; ``land`` is divided only where
it would deviate from the ground by more than ``LAND_M``."""
LAND_M = 0.02
_ALONG = (0.5, 0.25, 0.75)
"""Where edges are compared with the ground; a rise and a fall may cross at their middles."""
_ROUNDS = 12
_KEYS = ("at", "relief")
_NEAR = 1e-7
"""Corners this near to a line of the grid, in cells, are on it."""


def draped_id(asset: AssetId, T_world_body: SE3, scale: float, relief: Relief) -> str:
    """Id of an asset as it lies on the relief, for an upright body at a pose."""
    w, _, _, z = T_world_body.quaternion_wxyz
    x_m, y_m, _ = T_world_body.translation_m
    at = (x_m, y_m, round(2.0 * np.arctan2(z, w).item(), 9), scale)
    return str(AssetId(asset.name, {**asset.parameters, "at": at, "relief": relief.numbers()}))


def split_draped(asset: AssetId) -> tuple[AssetId, AssetId] | None:
    """The level asset, and the rest of a draped one's parameters; None if it is level."""
    if "relief" not in asset.parameters:
        return None
    level = {k: v for k, v in asset.parameters.items() if k not in _KEYS}
    rest = {k: v for k, v in asset.parameters.items() if k in _KEYS}
    return AssetId(asset.name, level), AssetId(asset.name, rest)


def drape(level: ImportedMesh, place: AssetId, kind: str) -> ImportedMesh:
    """A level mesh as it lies on the relief.

    Args:
        level: The mesh in the frame of its body.
        place: An id with the parameters ``at`` (x, y [m], yaw [rad] and scale of the body) and
            ``relief``.
        kind: ``layers`` or ``land``.

    Raises:
        AssetError: the parameters are wrong, or the asset has no mesh.
    """
    ground = _ground_below(place)
    if level.mesh is None:
        raise AssetError(f"asset '{place}': has no mesh to lay on the ground")
    collision = level.collision
    if collision is not None:
        collision = ConvexParts(_raised_parts(collision.parts_m, ground))
    return replace(
        level,
        mesh=_draped_mesh(level.mesh, ground, _refined if kind == "land" else _cut_on_grid),
        collision=collision,
        keypoints=tuple(_raised_point(point, ground) for point in level.keypoints),
        body_bounds_m=None,
    )


def raised(points_m: Array, place: AssetId) -> Array:
    """Points [..., 3] on a level asset as ``drape`` raises them. Raises AssetError as it does."""
    return _ground_below(place).raised(points_m.reshape(-1, 3)).reshape(points_m.shape)


def _ground_below(place: AssetId) -> "_Ground":
    at, numbers = place.parameters.get("at"), place.parameters["relief"]
    if not (isinstance(at, tuple) and len(at) == 4 and at[3] > 0.0 and isinstance(numbers, tuple)):
        raise AssetError(f"asset '{place}': expected at=x,y,yaw,scale and the numbers of a relief")
    x_m, y_m, yaw, scale = at
    try:
        relief = Relief.of(numbers)
    except ValueError as error:
        raise AssetError(f"asset '{place}': {error}") from error
    return _Ground(relief, SE3.about_z(yaw, (x_m, y_m, 0.0)), scale)


class _Ground:
    """The relief as a body sees it that stands on it."""

    def __init__(self, relief: Relief, T_world_body: SE3, scale: float) -> None:
        self.relief, self.T_world_body, self.scale = relief, T_world_body, scale

    def height(self, points_m: Array) -> Array:
        """Heights [n] of the ground below points [n, 3] of the body."""
        return self.relief.height(self.plan(points_m))

    def plan(self, points_m: Array) -> Array:
        """Places [n, 2] in the world below points [n, 3] of the body."""
        x, y = (np.asarray(points_m[:, k], np.float64) * self.scale for k in (0, 1))
        x, y = _turned_about_z(self.T_world_body, x, y)
        to_x, to_y, _ = self.T_world_body.translation_m
        return np.stack([x + to_x, y + to_y], axis=1)

    def raised(self, points_m: Array) -> Array:
        """Points [n, 3] of the body, raised by the height of the ground below them."""
        raised = np.array(points_m, np.float64)
        raised[:, 2] += self.height(points_m) / self.scale
        return raised

    def turned(self, slopes: Array, normals: Array) -> Array:
        """Normals [n, 3] of a surface that was raised, given the slopes [2, n] of the ground."""
        slope_x, slope_y = slopes
        along_x, along_y = _turned_about_z(self.T_world_body.inverse(), slope_x, slope_y)
        x, y, z = normals.T
        x, y = x - along_x * z, y - along_y * z
        length = np.maximum(np.sqrt(x * x + y * y + z * z), 1e-12)
        return np.stack([x / length, y / length, z / length], axis=1)


def _turned_about_z(pose: SE3, x: Array, y: Array) -> tuple[Array, Array]:
    """Coordinates [n] of level vectors after the rotation of an upright pose."""
    (a, b, _), (c, d, _), _ = pose.rotation()
    return a * x + b * y, c * x + d * y


def _raised_parts(parts_m: Sequence[Array], ground: _Ground) -> tuple[Array, ...]:
    """Points [n, 3] of each part, raised: all at once, since a road has dozens of parts."""
    if not parts_m:
        return ()
    ends = np.cumsum([len(part) for part in parts_m])[:-1]
    return tuple(np.split(ground.raised(np.concatenate(parts_m)), ends))


def _raised_point(point: Keypoint, ground: _Ground) -> Keypoint:
    x, y, z = (float(v) for v in ground.raised(np.array([point.position_m]))[0])
    return replace(point, position_m=(x, y, round(z, 6)))


_Cut = Callable[[Array, Ints, Ints, _Ground], tuple[Array, Ints, Ints]]
"""Corners with their columns [n, k], faces [m, 3] and slots [m], divided where the ground bends."""


def _draped_mesh(mesh: MeshData, ground: _Ground, divide: _Cut) -> MeshData:
    """The mesh, divided and raised."""
    columns = (mesh.vertices_m, mesh.normals, mesh.uvs)
    corners = np.concatenate([np.asarray(column, np.float64) for column in columns], axis=1)
    corners, faces, slots = divide(corners, mesh.faces.astype(np.int64), mesh.face_slots, ground)
    heights, slopes = ground.relief.surface(ground.plan(corners))
    corners[:, 2] += heights / ground.scale
    return replace(
        mesh,
        vertices_m=corners[:, :3].astype(np.float32),
        faces=faces.astype(np.int32),
        normals=ground.turned(slopes, corners[:, 3:6]).astype(np.float32),
        uvs=corners[:, 6:].astype(np.float32),
        face_slots=slots.astype(np.int32),
    )


def _refined(corners: Array, faces: Ints, slots: Ints, ground: _Ground) -> tuple[Array, Ints, Ints]:
    """Halve edges that are too far from the ground; neighbours agree on every edge."""
    done_faces, done_slots = [], []
    height = ground.height(corners[:, :3])
    for _ in range(_ROUNDS):
        one, other = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        key = np.minimum(one, other) * len(corners) + np.maximum(one, other)
        key, which = np.unique(key, return_inverse=True)
        one, other = np.divmod(key, len(corners))
        start, end = corners[one, :3], corners[other, :3]
        between = np.stack([ground.height((1.0 - u) * start + u * end) for u in _ALONG])
        chords = np.stack([(1.0 - u) * height[one] + u * height[other] for u in _ALONG])
        halved = np.flatnonzero((np.abs(between - chords) > LAND_M).any(axis=0))
        number = np.full(len(key), -1)
        number[halved] = len(corners) + np.arange(len(halved))
        middles = 0.5 * (corners[one[halved]] + corners[other[halved]])
        corners = np.concatenate([corners, middles])
        height = np.concatenate([height, between[0, halved]])
        inner = number[which.reshape(-1, 3)]
        # Nothing will divide a triangle whose edges are all near enough.
        active = (inner >= 0).any(axis=1)
        done_faces.append(faces[~active])
        done_slots.append(slots[~active])
        if not active.any():
            return corners, np.concatenate(done_faces), np.concatenate(done_slots)
        faces, slots = _divide(faces[active], slots[active], inner[active])
    return corners, np.concatenate([*done_faces, faces]), np.concatenate([*done_slots, slots])


def _divide(faces: Ints, slots: Ints, middles: Ints) -> tuple[Ints, Ints]:
    """Triangles with the middles [m, 3] of edges, from corner k to k + 1, as corners; -1 = none.

    Of two halved edges, the first corner after the whole edge decides on the diagonal.
    """
    count = (middles >= 0).sum(axis=1)
    # Turn triangles until a single halved edge, or a single whole edge, is the first one.
    special = np.where((count == 1)[:, None], middles >= 0, middles < 0)
    order = (special.argmax(axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(faces, order, axis=1).T
    ab, bc, ca = np.take_along_axis(middles, order, axis=1).T
    cases = (
        (count == 1, ((a, ab, c), (ab, b, c))),
        (count == 2, ((a, b, bc), (a, bc, ca), (ca, bc, c))),
        (count == 3, ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))),
    )
    made = [(np.stack(t, axis=1)[here], slots[here]) for here, parts in cases for t in parts]
    return np.concatenate([t for t, _ in made]), np.concatenate([s for _, s in made])


def _cut_on_grid(
    corners: Array, faces: Ints, slots: Ints, ground: _Ground
) -> tuple[Array, Ints, Ints]:
    """Cut along the lines of the grid and the diagonals of its cells."""
    x, y = np.zeros((2, 0))
    for along_x, along_y in ((1.0, 0.0), (0.0, 1.0), (1.0, -1.0)):
        new_x, new_y = (ground.plan(corners[len(x) :]) / ground.relief.cell_m).T
        x, y = np.concatenate([x, new_x]), np.concatenate([y, new_y])
        corners, faces, slots = _cut(corners, along_x * x + along_y * y, faces, slots)
    return corners, faces, slots


def _cut(corners: Array, at: Array, faces: Ints, slots: Ints) -> tuple[Array, Ints, Ints]:
    """Cut triangles at all whole values of a linear function of their corners.

    Each round cuts every triangle once, at the line nearest to its middle, until none crosses one.

    Args:
        corners: Columns to interpolate, [n, k].
        at: The function at the corners, [n].
        faces: Indices [m, 3].
        slots: Any value of each triangle [m].
    """
    done = []
    near = np.round(at)
    at = np.where(np.abs(at - near) < _NEAR, near, at)
    # Corner by corner: numpy is slow on the short axis of [m, 3].
    a, b, c = (np.ascontiguousarray(faces[:, k]) for k in range(3))
    while len(slots):
        x, y, z = _taken(at, a, b, c)
        low, high = np.minimum(np.minimum(x, y), z), np.maximum(np.maximum(x, y), z)
        first, last = np.floor(low) + 1.0, np.ceil(high) - 1.0
        done.append([of.take(np.flatnonzero(first > last)) for of in (a, b, c, slots)])
        crossing = np.flatnonzero(first <= last)
        if not len(crossing):
            break
        line = np.minimum(np.maximum(np.round(0.5 * (low + high)), first), last).take(crossing)
        a, b, c, slots = (of.take(crossing) for of in (a, b, c, slots))
        a, b, c = _alone_first((a, b, c), [height - line for height in _taken(at, a, b, c)])
        one, ab = _meetings(at, a, b, line, len(at))
        other, ac = _meetings(at, a, c, line, len(at) + len(one[0]))
        low, high, met = (np.concatenate(column) for column in zip(one, other, strict=True))
        corners, at = _with_meetings(corners, at, low, high, met)
        # A corner on the line leaves a part without area.
        parts = ((a, ab, ac), (ab, b, c), (ab, c, ac))
        whole = [np.flatnonzero((i != j) & (j != k) & (k != i)) for i, j, k in parts]
        pieces = [
            [of.take(kept) for of in (*part, slots)]
            for part, kept in zip(parts, whole, strict=True)
        ]
        a, b, c, slots = (np.concatenate(column) for column in zip(*pieces, strict=True))
    a, b, c, slots = (np.concatenate(column) for column in zip(*done, strict=True))
    return corners, np.stack([a, b, c], axis=1), slots


def _taken(values: Array, *corners: Ints) -> list[Array]:
    """Values at each corner [m] of triangles."""
    return [values.take(corner) for corner in corners]


def _alone_first(corners: Sequence[Ints], heights: Sequence[Array]) -> tuple[Ints, Ints, Ints]:
    """Corners of triangles, turned until the first one is alone on its side of a line.

    Of corners above, on and below the line, one side has a single corner, and the other one or two.

    Args:
        corners: Indices of the first, second and third corners, [m] each.
        heights: Heights of these corners above the line, [m] each.
    """
    a, b, c = corners
    above = [height > 0.0 for height in heights]
    is_above = above[0].astype(np.int8) + above[1] + above[2] == 1
    first, second = (
        np.where(is_above, over, height < 0.0)
        for over, height in zip(above[:2], heights[:2], strict=True)
    )

    def pick(of_first: Ints, of_second: Ints, of_third: Ints) -> Ints:
        return np.where(first, of_first, np.where(second, of_second, of_third))

    return pick(a, b, c), pick(b, c, a), pick(c, a, b)


def _meetings(
    at: Array, a: Ints, b: Ints, line: Array, count: int
) -> tuple[tuple[Ints, Ints, Array], Ints]:
    """Corners where edges meet lines, as columns of two ends and a line; the number of each edge's.

    Edges that two triangles share get one corner; new ones are numbered from ``count`` on.
    """
    low, high = np.minimum(a, b), np.maximum(a, b)
    key = (low * len(at) + high) * 2**20 + (line.astype(np.int64) + 2**19)
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    number = np.where(at.take(b) == line, b, count + which.ravel())
    return (low.take(first), high.take(first), line.take(first)), number


def _with_meetings(
    corners: Array, at: Array, low: Ints, high: Ints, line: Array
) -> tuple[Array, Array]:
    """Corners, and the function at them, with those added where edges meet lines."""
    start, made = corners.take(low, axis=0), corners.take(high, axis=0)
    made -= start
    made *= ((line - at.take(low)) / (at.take(high) - at.take(low)))[:, None]
    made += start
    return np.concatenate([corners, made]), np.concatenate([at, line])
