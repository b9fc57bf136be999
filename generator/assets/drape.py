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
from gen_data.core.relief import CELL_M, Relief
from gen_data.core.se3 import SE3, Array

Ints = NDArray[np.integer]

VERSION = 1
"""Raised whenever the same arguments make other bytes."""
FACT = "draped"
"""Families declare under this name how their meshes follow the ground: ``layers`` are cut along the
lines of its grid, and stay as far apart as they are on level ground; ``land`` is divided only where
it would deviate from the ground by more than ``LAND_M``."""
LAND_M = 0.02
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
        return self.relief.height(self.world(points_m))

    def world(self, points_m: Array) -> Array:
        """Points [n, 3] of the body in the world."""
        return self.T_world_body.apply(np.asarray(points_m, np.float64) * self.scale)

    def raised(self, points_m: Array) -> Array:
        """Points [n, 3] of the body, raised by the height of the ground below them."""
        raised = np.array(points_m, np.float64)
        raised[:, 2] += self.height(points_m) / self.scale
        return raised

    def turned(self, points_m: Array, normals: Array) -> Array:
        """Normals [n, 3] of the surface after it was raised."""
        gradient = self.relief.gradient(self.world(points_m))
        slopes = np.column_stack([gradient, np.zeros(len(gradient))])
        along = self.T_world_body.inverse().rotate(slopes)
        made = normals - along * normals[:, 2:]
        length = np.sqrt((made * made).sum(axis=1, keepdims=True))
        turned: Array = made / np.maximum(length, 1e-12)
        return turned


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
    level = corners[:, :3]
    return replace(
        mesh,
        vertices_m=ground.raised(level).astype(np.float32),
        faces=faces.astype(np.int32),
        normals=ground.turned(level, corners[:, 3:6]).astype(np.float32),
        uvs=corners[:, 6:].astype(np.float32),
        face_slots=slots.astype(np.int32),
    )


def _refined(corners: Array, faces: Ints, slots: Ints, ground: _Ground) -> tuple[Array, Ints, Ints]:
    """Halve edges whose middles are too far from the ground; neighbours agree on every edge."""
    done_faces, done_slots = [], []
    for _ in range(_ROUNDS):
        height = ground.height(corners[:, :3])
        one, other = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        key = np.minimum(one, other) * len(corners) + np.maximum(one, other)
        key, which = np.unique(key, return_inverse=True)
        edges = np.stack(np.divmod(key, len(corners)), axis=1)
        middles = 0.5 * (corners[edges[:, 0]] + corners[edges[:, 1]])
        off = ground.height(middles[:, :3]) - height[edges].mean(axis=1)
        halved = np.abs(off) > LAND_M
        number = np.full(len(edges), -1)
        number[halved] = len(corners) + np.arange(int(halved.sum()))
        corners = np.concatenate([corners, middles[halved]])
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
    for along_x, along_y in ((1.0, 0.0), (0.0, 1.0), (1.0, -1.0)):
        plan = ground.world(corners[:, :3]) / CELL_M
        at = along_x * plan[:, 0] + along_y * plan[:, 1]
        corners, faces, slots = _cut(corners, at, faces, slots)
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
    done_faces, done_slots = [], []
    near = np.round(at)
    at = np.where(np.abs(at - near) < _NEAR, near, at)
    while len(faces):
        # Corner by corner: reductions over the short axis of [m, 3] take ten times as long.
        x, y, z = (at.take(faces[:, k]) for k in range(3))
        low, high = np.minimum(np.minimum(x, y), z), np.maximum(np.maximum(x, y), z)
        first, last = np.floor(low) + 1.0, np.ceil(high) - 1.0
        crossing = first <= last
        done_faces.append(faces[~crossing])
        done_slots.append(slots[~crossing])
        if not crossing.any():
            break
        faces, slots = faces[crossing], slots[crossing]
        line = np.round(0.5 * (low + high))[crossing]
        line = np.minimum(np.maximum(line, first[crossing]), last[crossing])
        a, b, c = _alone_first(faces, *(of[crossing] - line for of in (x, y, z)))
        corners, at, ab = _split(corners, at, a, b, line)
        corners, at, ac = _split(corners, at, a, c, line)
        # A corner on the line leaves a part without area.
        parts = ((a, ab, ac), (ab, b, c), (ab, c, ac))
        whole = [(i != j) & (j != k) & (k != i) for i, j, k in parts]
        faces = np.concatenate(
            [np.stack(part, axis=1)[kept] for part, kept in zip(parts, whole, strict=True)]
        )
        slots = np.concatenate([slots[kept] for kept in whole])
    return corners, np.concatenate(done_faces), np.concatenate(done_slots)


def _alone_first(faces: Ints, x: Array, y: Array, z: Array) -> tuple[Ints, Ints, Ints]:
    """Corners of triangles, turned until the first one is alone on its side of a line.

    Of corners above, on and below the line, one side has a single corner, and the other one or two.

    Args:
        faces: Indices [m, 3].
        x: Heights [m] of the first corners above the line.
        y: Heights [m] of the second corners.
        z: Heights [m] of the third corners.
    """
    above = (x > 0.0, y > 0.0, z > 0.0)
    is_above = above[0].astype(np.int8) + above[1] + above[2] == 1
    first, second = (
        np.where(is_above, over, height < 0.0) for over, height in zip(above, (x, y), strict=False)
    )
    turn = np.where(first, 0, np.where(second, 1, 2))
    rows = np.arange(len(faces))
    a, b, c = (faces[rows, (turn + k) % 3] for k in range(3))
    return a, b, c


def _split(corners: Array, at: Array, a: Ints, b: Ints, line: Array) -> tuple[Array, Array, Ints]:
    """Corners with those added where edges meet lines, and the number of each edge's.

    Edges that two triangles share get one corner.
    """
    low, high = np.minimum(a, b), np.maximum(a, b)
    key = (low * len(at) + high) * 2**20 + (line.astype(np.int64) + 2**19)
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    low, high, line = low[first], high[first], line[first]
    share = ((line - at[low]) / (at[high] - at[low]))[:, None]
    made = corners[low] + share * (corners[high] - corners[low])
    on = at[b] == line[which.ravel()]
    number = np.where(on, b, len(at) + which.ravel())
    return np.concatenate([corners, made]), np.concatenate([at, line]), number
