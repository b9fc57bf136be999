"""Samples of surfaces and of the solids that they bound, for voxels.

Triangles are float [n, 3, 3]: corners [m], counter-clockwise seen from outside.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gen_data.annotations.bev_raster import plane_slopes, raster_spans
from gen_data.core.se3 import Array

Rows = NDArray[np.intp]

PLACE = np.array([0.4871, 0.4871, 0.5], np.float32)
"""Place of a lattice point in its cell. Columns keep away from round coordinates, where meshes have
edges, which two triangles share."""


def sample_surface(corners_m: Array, pitch_m: float) -> tuple[Array, Rows]:
    """Points [m, 3] on triangles, and the triangle of each, [m].

    Rows of points run along the longest edge of a triangle, at most a pitch apart, as do the points
    of a row; every triangle has one at least. A disc of surface with a radius of 0.71 pitches holds
    a point.
    """
    numbers = np.arange(len(corners_m))
    longest = _square_sides(corners_m).argmax(axis=0)
    a, b, c = (corners_m[numbers, (longest + k) % 3] for k in range(3))
    base, side = b - a, c - a
    length_m = np.sqrt(_squares(base))
    height_m = np.sqrt(_squares(_cross(base, side))) / np.maximum(length_m, 1e-12)

    rows = _pieces(height_m, pitch_m)
    triangle = np.repeat(numbers, rows)
    share = (_count_up(rows) + 0.5) / rows[triangle]
    points = _pieces(length_m[triangle] * (1.0 - share), pitch_m)
    row = np.repeat(np.arange(len(triangle)), points)
    triangle, share = triangle[row], share[row]
    along = (_count_up(points) + 0.5) / points[row] * (1.0 - share)
    found = a[triangle] + share[:, None] * side[triangle] + along[:, None] * base[triangle]
    return found, triangle


def thin_out(points_m: Array, kinds: NDArray[np.integer], cell_m: float) -> Rows:
    """Rows of points [n, 3] to keep: the first one of each kind in each cell of a lattice."""
    cells = np.floor(points_m / cell_m).astype(np.int64)
    cells -= cells.min(axis=0)
    _, ny, nz = (int(k) + 1 for k in cells.max(axis=0))
    keys = ((cells[:, 0] * ny + cells[:, 1]) * nz + cells[:, 2]) * (int(kinds.max()) + 1) + kinds
    return np.sort(np.unique(keys, return_index=True)[1])


def split_long(corners_m: Array, side_m: float, low_m: Array, high_m: Array) -> tuple[Array, Rows]:
    """Pieces of triangles that may reach into a box, [m, 3, 3], and the triangle of each, [m].

    Edges are halved until they are no longer than ``side_m``; pieces outside the box are dropped.
    """
    owner = np.arange(len(corners_m))
    done: list[tuple[Array, Rows]] = []
    while True:
        kept = _reach_into(corners_m, low_m, high_m)
        corners_m, owner = corners_m[kept], owner[kept]
        squares = _square_sides(corners_m)
        short = squares.max(axis=0, initial=0.0) <= side_m * side_m
        done.append((corners_m[short], owner[short]))
        if short.all():
            pieces, owners = zip(*done, strict=True)
            return np.concatenate(pieces), np.concatenate(owners)
        corners_m, owner, longest = (
            corners_m[~short],
            owner[~short],
            squares[:, ~short].argmax(axis=0),
        )
        a, b, c = (corners_m[np.arange(len(owner)), (longest + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        corners_m = np.concatenate([np.stack(p, axis=1) for p in ((a, middle, c), (middle, b, c))])
        owner = np.concatenate([owner, owner])


def inside_lattice(
    corners_m: Array, low_m: Array, pitch_m: float, shape: tuple[int, int, int]
) -> NDArray[np.bool_]:
    """Whether lattice points are inside the solids that triangles bound, bool ``shape``.

    Point (i, j, k) is at ``PLACE`` in cell (i, j, k) from ``low_m``. It is inside if
    surfaces above it that face up outnumber surfaces that face down: the winding number of closed
    surfaces, which may overlap. Columns in which the two do not balance cross an open surface, and
    are outside.
    """
    nx, ny, nz = shape
    cells = (corners_m - low_m) / pitch_m
    cells[..., :2] += 0.5 - PLACE[:2].astype(np.float64)
    cells = cells[_reach_into(cells[..., :2], (0.0, 0.0), (nx, ny))]
    row, first, last, owner = raster_spans(cells, (nx, ny))
    counts = last - first
    rows, owner = np.repeat(row, counts), np.repeat(owner, counts)
    columns = np.repeat(first, counts) + _count_up(counts)
    u, v = cells[:, 1] - cells[:, 0], cells[:, 2] - cells[:, 0]
    sign = np.sign(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).astype(np.int64)[owner]
    slope, origin = plane_slopes(cells)[owner], cells[owner, 0]
    z = origin[:, 2] + slope[:, 0] * (rows + 0.5 - origin[:, 0])
    z += slope[:, 1] * (columns + 0.5 - origin[:, 1])
    below = np.clip(np.ceil(z - 0.5), 0, nz).astype(np.int64)
    column = rows * ny + columns
    steps = np.bincount(column * (nz + 1) + below, sign, nx * ny * (nz + 1))
    steps = steps.reshape(nx, ny, nz + 1)
    winding = np.cumsum(steps[..., ::-1], axis=-1)[..., ::-1]
    return np.asarray((winding[..., 1:] > 0.5) & (np.abs(winding[..., :1]) < 0.5))


def enclosed_cells(shell: NDArray[np.bool_], closed_below: bool = False) -> NDArray[np.bool_]:
    """Cells of a lattice that are neither in a shell nor reached from outside, bool [x, y, z].

    Outside is beyond the lattice, above it and at its sides, below it unless it is closed there;
    paths lead through faces of cells. So also surfaces that do not join enclose something, such as
    the walls and roof of a house.
    """
    from scipy import ndimage

    padded = np.pad(shell, ((1, 1), (1, 1), (0 if closed_below else 1, 1)))
    regions, _ = ndimage.label(~padded)
    inner = regions[1:-1, 1:-1, : -1 if closed_below else None]
    inner = inner if closed_below else inner[..., 1:-1]
    return np.asarray((inner != regions[0, 0, -1]) & ~shell)


def is_closed(corners_m: Array) -> bool:
    """Whether triangles can bound a solid: the area vectors of a closed surface add up to zero."""
    areas = _cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    return bool(np.abs(areas.sum(axis=0)).max() < 1e-4 * np.abs(areas).sum())


def _reach_into(corners: Array, low: ArrayLike, high: ArrayLike) -> NDArray[np.bool_]:
    """Triangles [n] whose bounds overlap the box's; a reduction along rows is slower."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    above = np.maximum(np.maximum(a, b), c) >= low
    below = np.minimum(np.minimum(a, b), c) <= high
    return np.asarray(np.logical_and.reduce((above & below).T))


def _square_sides(corners_m: Array) -> Array:
    """Squared lengths of the edges from each corner to the next, [3, n]."""
    return np.stack([_squares(corners_m[:, (k + 1) % 3] - corners_m[:, k]) for k in range(3)])


def _squares(vectors: Array) -> Array:
    x, y, z = vectors.T
    return np.asarray(x * x + y * y + z * z)


def _cross(u: Array, v: Array) -> Array:
    (a, b, c), (d, e, f) = u.T, v.T
    return np.stack([b * f - c * e, c * d - a * f, a * e - b * d], axis=1)


def _pieces(length_m: Array, pitch_m: float) -> Rows:
    return np.maximum(np.ceil(length_m / pitch_m), 1).astype(np.intp)


def _count_up(counts: Rows) -> Rows:
    """0 to ``counts[0]`` - 1, then 0 to ``counts[1]`` - 1, and so on."""
    return np.asarray(np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts))
