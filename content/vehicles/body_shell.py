"""Bodies of vehicles: rings of superellipses stacked from the ground up, half of them modelled.

A ring runs from the middle of the front over the left side (y > 0) to the middle of the rear. Its
plan is |x|^p + |y|^q = 1 (Lamé's superellipse), with other exponents in front than behind: p
decides how early the side turns in, q how much the front bows. Patches made here have (position
along the ring, row) as texture coordinates, by which windows and lamps are cut out; ``mirror_half``
drops them and adds the right half.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gen_data.config.data_files import load_table
from gen_data.content.procedural.patches import Array, Patch, join_patches
from gen_data.content.procedural.surface_shapes import Point2, grid, spline
from gen_data.content.vehicles.vehicle_materials import PRINTED, VehicleSlot

Curve = Callable[[Array], Array]
Mask = NDArray[np.bool_]
Level = Callable[[Patch], Array]
"""Values at the corners of a patch, shape [n, 3]; positive inside."""
Bounds = tuple[float | None, float | None]
"""Lower and upper bound; None = unbounded."""

# Distance of lines from the surface under them.
_PROUD_M = 0.002
BODY_ROWS = load_table(__package__, "body_rows", tuple[tuple[float, float, float, float], ...])
_END_SHARES = (0.0, 0.32, 0.58, 0.78, 0.92)


@dataclass(frozen=True, eq=False)
class BodyOutline:
    """A ring of unit half length and unit half width.

    Attributes:
        along: Shape [n], from 1 at the front to -1 at the rear.
        across: Shape [n], 0 at both ends and nearly 1 between.
    """

    along: Array
    across: Array

    def front(self, across: float) -> float:
        """Place on the ring, in [0, 1], where the front half is that far from the middle."""
        return self._place(np.interp(across, self.across[: self._widest], self._indices()[0]))

    def rear(self, across: float) -> float:
        """The same on the rear half."""
        backwards = self.across[: self._widest - 1 : -1]
        return self._place(np.interp(across, backwards, self._indices()[1][::-1]))

    def side(self, along: float) -> float:
        """Place on the ring at that share of the length."""
        return self._place(np.interp(-along, -self.along, np.arange(len(self.along))))

    @property
    def _widest(self) -> int:
        return int(np.argmax(np.round(self.across, 9))) + 1

    def _indices(self) -> tuple[Array, Array]:
        index = np.arange(len(self.along), dtype=np.float64)
        return index[: self._widest], index[self._widest :]

    def _place(self, index: np.floating) -> float:
        return float(index) / (len(self.along) - 1)


@dataclass(frozen=True)
class Row:
    """One ring of a stack.

    Attributes:
        rise: Share of the way from the lower to the upper curve.
        front_m, rear_m: Largest and smallest x.
        half_m: Half width.
    """

    rise: float
    front_m: float
    rear_m: float
    half_m: float


def body_rows(name: str, front_m: float, rear_m: float, half_m: float) -> list[Row]:
    """Rows of the table ``body_rows.yaml`` for a body between two x, ``half_m`` wide to a side."""
    return [
        Row(rise, front_m - front, rear_m + rear, share * half_m)
        for rise, front, rear, share in BODY_ROWS[name]
    ]


def plan(front: Point2, rear: Point2, sides: int) -> BodyOutline:
    """A ring with exponents (p, q) in front and behind and ``sides`` steps along the side."""
    share = np.array(_END_SHARES)
    a, b = (_along(share, exponents) for exponents in (front, rear))
    side = np.linspace(a[-1], -b[-1], sides + 1)[1:-1]
    exponents = [np.where(side > 0, front[i], rear[i]) for i in (0, 1)]
    bulge = (1.0 - np.abs(side) ** exponents[0]) ** (1.0 / exponents[1])
    return BodyOutline(
        np.concatenate([a, side, -b[::-1]]), np.concatenate([share, bulge, share[::-1]])
    )


def level_height(height_m: float) -> Curve:
    """The same height [m] at every x."""
    return lambda x: np.full_like(x, height_m)


def smooth_height(points: Sequence[Point2]) -> Curve:
    """A smooth height [m] over x through points of ascending x; constant outside."""
    dense = spline(points, 24 * len(points))

    def height(x: Array) -> Array:
        value: Array = np.interp(x, dense[:, 0], dense[:, 1])
        return value

    return height


def stack(
    ring: BodyOutline,
    rows: Sequence[Row],
    low: Curve,
    high: Curve,
    *,
    crown_m: float,
    lid_rows: int = 3,
) -> Patch:
    """The left half of a body with a flat bottom and a lid that rises to ``crown_m`` amidships."""
    rings = [_ring(ring, row, low, high) for row in rows]
    bottom, top = (np.array(r) for r in (rings[0], rings[-1]))
    bottom[:, 1] = 0.0
    lids = []
    for k in range(1, lid_rows + 1):
        lid, share = top.copy(), 1.0 - k / lid_rows
        lid[:, 1] *= share
        lid[:, 2] += crown_m * ring.across**2 * (1.0 - share**2)
        lids.append(lid)
    points = np.stack([bottom, *rings, *lids])
    rises = [
        -1.0,
        *(row.rise for row in rows),
        *(1.0 + k / lid_rows for k in range(1, lid_rows + 1)),
    ]
    return grid(points, np.linspace(0.0, 1.0, points.shape[1]), np.array(rises))


def split_patch(patch: Patch, level: Level) -> tuple[Patch, Patch, Array]:
    """The parts where a level is positive and where it is not, and the line between them.

    The level is taken to be linear along edges. The line is segments, shape [n, 2, 3] [m].
    """
    value = np.round(level(patch), 9)
    # Corners that an earlier cut left on this line, but for rounding, must not be cut to slivers.
    value = np.where(np.abs(value) < 1e-7, 0.0, value)
    low, high = np.min(value.T, axis=0), np.max(value.T, axis=0)
    inside = [take_triangles(patch, (low >= 0) & (high > 0))]
    outside = [take_triangles(patch, high <= 0)]
    mixed = (low < 0) & (high > 0)
    if not mixed.any():  # Nearly half of all calls.
        return inside[0], outside[0], np.zeros((0, 2, 3))
    # Turn the corners until the first one is alone on its side, or lies on the line.
    part, v = take_triangles(patch, mixed), value[mixed]
    sign = np.sign(v)
    lonely = np.where((sign == 0).any(axis=1), (sign == 0).argmax(axis=1),
                      (sign != np.sign(sign.sum(axis=1))[:, None]).argmax(axis=1))  # fmt: skip
    turn = (lonely[:, None] + np.arange(3)) % 3
    rows = np.arange(len(v))[:, None]
    data = np.concatenate([part.corners_m, part.uvs], axis=2)[rows, turn]
    v = v[rows, turn]
    touching = v[:, 0] == 0
    lines = []
    for chosen, pieces in ((touching, _halve_triangles(data[touching], v[touching])),
                           (~touching, _cut_tips(data[~touching], v[~touching]))):  # fmt: skip
        for corners, positive in pieces[0]:
            for keep, side in ((positive, inside), (~positive, outside)):
                slots = part.slots[chosen][keep]
                side.append(Patch(corners[keep, :, :3], corners[keep, :, 3:], slots))
        lines.append(pieces[1][:, :, :3])
    return join_patches(inside), join_patches(outside), np.concatenate(lines)


def paint(patch: Patch, slot: int, *further: Level, **bounds: Bounds) -> Patch:
    """The patch with everything in a slot that lies inside ``levels(**bounds)`` and further levels.

    Triangles that lie outside of any one level stay as they are.
    """
    inside = (*levels(**bounds), *further)
    touched = np.ones(len(patch.slots), dtype=bool)
    for level in inside:
        touched &= np.max(level(patch).T, axis=0) > 1e-7
    done, patch = [take_triangles(patch, ~touched)], take_triangles(patch, touched)
    for level in inside:
        patch, outside, _ = split_patch(patch, level)
        done.append(outside)
    return join_patches([*done, patch.painted(slot)])


def refine_patch(patch: Patch, axis: str, places_m: Sequence[float]) -> Patch:
    """The patch with edges added along planes, which keep round holes round."""
    for place in places_m:
        patch = join_patches(split_patch(patch, _level(axis, place, 1.0))[:2])
    return patch


def gap(patch: Patch, x_m: float, width_m: float, slot: int, **bounds: Bounds) -> Patch:
    """A dark line across the side at ``x_m`` between bounds, a little in front of the patch."""
    for level in levels(**bounds):
        patch = split_patch(patch, level)[0]
    line = split_patch(patch, _level("x", x_m, 1.0))[2] + np.array([0.0, _PROUD_M, 0.0])
    upward = (line[:, 0, 2] < line[:, 1, 2])[:, None, None]
    line = np.where(upward, line, line[:, ::-1])
    half = np.array([0.5 * width_m, 0.0, 0.0])
    low, high = line[:, 0], line[:, 1]
    a, b, c, d = low + half, low - half, high - half, high + half
    corners = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Patch(
        corners, np.zeros((len(corners), 3, 2)), np.full(len(corners), slot, dtype=np.int64)
    )


def levels(**bounds: Bounds) -> tuple[Level, ...]:
    """Levels that are positive between a lower and an upper bound, in the given order.

    ``x``, ``y`` and ``z`` bound coordinates [m], ``ring`` the place along the ring, ``row`` the row
    of the stack, whose lid begins at 1.
    """
    return tuple(
        _level(name, limit, sign)
        for name, pair in bounds.items()
        for limit, sign in zip(pair, (1.0, -1.0), strict=True)
        if limit is not None
    )


def _level(name: str, limit: float, sign: float) -> Level:
    """Positive where a value exceeds (sign 1) or falls below (sign -1) a limit."""
    if name in ("ring", "row"):
        column = ("ring", "row").index(name)
        return lambda p: sign * (p.uvs[..., column] - limit)
    axis = "xyz".index(name)
    return lambda p: sign * (p.corners_m[..., axis] - limit)


def round_x_z(x_m: float, z_m: float, radius_m: float, beyond_y_m: float) -> Level:
    """Positive in a cylinder across the vehicle, outside of ``beyond_y_m``."""

    def level(p: Patch) -> Array:
        x, y, z = (p.corners_m[..., i] for i in range(3))
        return np.minimum(radius_m - np.hypot(x - x_m, z - z_m), y - beyond_y_m)

    return level


def mirror_half(half: Patch, swaps: Sequence[tuple[int, int]] = ()) -> Patch:
    """A left half and its mirror image, which exchanges the pairs of slots in ``swaps``.

    Print on the right half is not mirrored: it reads from left to right on both sides.
    """
    slots = half.slots.copy()
    for left, right in swaps:
        slots[half.slots == left] = right
    uvs = np.where([True, False], 1.0 - half.uvs, half.uvs)
    corners_m = half.corners_m * np.array([1.0, -1.0, 1.0])
    return drop_uvs(join_patches([half, Patch(corners_m, uvs, slots).flipped()]))


def drop_uvs(patch: Patch) -> Patch:
    """The patch without texture coordinates, except on printed slots."""
    printed = np.isin(patch.slots, PRINTED)[:, None, None]
    return replace(patch, uvs=np.where(printed, patch.uvs, 0.0))


def print_side(patch: Patch, x_m: Point2, z_m: Point2, *further: Level) -> Patch:
    """The patch with an image on its left side, between two x and two z, in the slot ``LIVERY``.

    The image's left border is at the larger x: the front. It is the last step of painting, since
    the rows and places along the ring are lost where the image is.
    """
    marked = paint(patch, VehicleSlot.LIVERY, *further, x=x_m, z=z_m)
    u = (x_m[1] - marked.corners_m[..., 0]) / (x_m[1] - x_m[0])
    v = (marked.corners_m[..., 2] - z_m[0]) / (z_m[1] - z_m[0])
    printed = (marked.slots == VehicleSlot.LIVERY)[:, None, None]
    return replace(marked, uvs=np.where(printed, np.stack([u, v], axis=2), marked.uvs))


def _along(across: Array, exponents: Point2) -> Array:
    value: Array = (1.0 - across ** exponents[1]) ** (1.0 / exponents[0])
    return value


def _ring(ring: BodyOutline, row: Row, low: Curve, high: Curve) -> Array:
    middle, half = 0.5 * (row.front_m + row.rear_m), 0.5 * (row.front_m - row.rear_m)
    x = middle + half * ring.along
    z = low(x) + row.rise * (high(x) - low(x))
    return np.stack([x, row.half_m * ring.across, z], axis=1)


def take_triangles(patch: Patch, chosen: Mask) -> Patch:
    """The chosen triangles."""
    return Patch(patch.corners_m[chosen], patch.uvs[chosen], patch.slots[chosen])


Pieces = tuple[list[tuple[Array, Mask]], Array]


def _halve_triangles(data: Array, value: Array) -> Pieces:
    """Cut triangles whose first corner lies on the line; with the side of each piece."""
    a, b, c = (data[:, i] for i in range(3))
    d = _crossing(b, c, value[:, 1], value[:, 2])
    pieces = [(np.stack([a, b, d], axis=1), value[:, 1] > 0),
              (np.stack([a, d, c], axis=1), value[:, 2] > 0)]  # fmt: skip
    return pieces, np.stack([a, d], axis=1)


def _cut_tips(data: Array, value: Array) -> Pieces:
    """Cut triangles whose first corner is alone on its side: one tip, two other pieces."""
    a, b, c = (data[:, i] for i in range(3))
    d, e = (_crossing(a, data[:, i], value[:, 0], value[:, i]) for i in (1, 2))
    tip = value[:, 0] > 0
    pieces = [(np.stack([a, d, e], axis=1), tip), (np.stack([d, b, c], axis=1), ~tip),
              (np.stack([d, c, e], axis=1), ~tip)]  # fmt: skip
    return pieces, np.stack([d, e], axis=1)


def _crossing(a: Array, b: Array, at_a: Array, at_b: Array) -> Array:
    """Points where the level is 0 between two points; independent of their order."""
    share = (at_a / (at_a - at_b))[:, None]
    point: Array = a + share * (b - a)
    return np.round(point, 9)
