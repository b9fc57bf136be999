"""The surface of a road, and patches that lie on it."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.roads import lane_textures, painted_signs, road_materials
from gen_data.roads.cross_section import RoadShape
from gen_data.roads.reference_line import ReferenceLine, beside

PAINT_LIFT_M = 0.003
SAGITTA_M = 0.008
"""How far a chord of the mesh may stray from the curve."""
ROW_M = 12.0
"""Distance of the rows of straight roads, which bends divide: tiles of ``lane_textures`` end at
rows."""


@dataclass(frozen=True, eq=False, slots=True)
class Deck:
    """A reference line with a cross section of straight segments.

    Attributes:
        line: The reference line.
        t_m: Distances to the left of it, rising, shape [k].
        z_m: Heights at them, shape [k].
        rows_m: Arc lengths of the rows of its mesh, rising.
        slots: Number of each material slot by name.

    Rows of the mesh lie at the same arc lengths for all strips and patches: neighbours share their
    vertices on bends.
    """

    line: ReferenceLine
    t_m: Array
    z_m: Array
    rows_m: Array
    slots: dict[str, int]
    _known: dict[bytes, Array] = field(default_factory=dict, init=False, repr=False)

    def at(self, s_m: Array, t_m: Array, lift_m: float = 0.0) -> Array:
        """Points [..., 3] on the surface, or over it."""
        points = np.zeros((*s_m.shape, 3))
        points[..., :2] = beside(self._poses(s_m), t_m)
        points[..., 2] = np.interp(t_m, self.t_m, self.z_m) + lift_m
        return points

    def _poses(self, s_m: Array) -> Array:
        """Poses of the line, [..., 3], or of the rows of a grid, [n, 1, 3], which strips share."""
        is_grid = s_m.ndim == 2 and bool((s_m == s_m[:, :1]).all())
        rows = s_m[:, 0] if is_grid else s_m.ravel()
        key = rows.tobytes()
        if key not in self._known:
            self._known[key] = self.line.poses(rows)
        columns = (len(rows), 1) if is_grid else s_m.shape
        return self._known[key].reshape(*columns, 3)

    def rows(self, start_m: float, end_m: float) -> Array:
        """Arc lengths from start to end with the common rows between them."""
        # Rows next to an end would make slivers.
        inside = self.rows_m[(self.rows_m > start_m + 0.02) & (self.rows_m < end_m - 0.02)]
        return np.concatenate([[start_m], inside, [end_m]])

    def columns_between(self, low_m: float, high_m: float) -> tuple[float, ...]:
        """Both distances and the deck's columns between them, for patches that follow its ruts."""
        # Columns next to an end would make slivers.
        inside = self.t_m[(self.t_m > low_m + 1e-4) & (self.t_m < high_m - 1e-4)]
        return (low_m, *(float(t) for t in inside), high_m)

    def ribbon(
        self, span_m: tuple[float, float], t_m: Sequence[float], slot: str, lift_m: float = 0.0
    ) -> Patch:
        """A strip along the road between two arc lengths; ``t_m`` rises across it."""
        s, t = _grid(self.rows(*span_m), np.array(t_m))
        return self.sheet(s, t, slot, lift_m)

    def lane(
        self, span_m: tuple[float, float], t_m: Sequence[float], slot: str, lift_m: float = 0.0
    ) -> Patch:
        """A strip between two arc lengths whose texture fits its width once and repeats by tiles.

        The texture is mirrored on the left of the reference line; neighbours differ.
        """
        s, t = _grid(self.rows(*span_m), np.array(t_m))
        u = (t - t[0, 0]) / (t[0, -1] - t[0, 0])
        u = u if t[0, 0] < -1e-9 else 1.0 - u
        uv = np.stack([u, s / lane_textures.TILE_M], axis=2)
        return mapped_surface(self.at(s, t, lift_m), uv, self.slots[slot])

    def edge(
        self, span_m: tuple[float, float], inner_m: float, outer_m: float, slot: str, lift_m: float
    ) -> Patch:
        """A strip along an edge of the carriageway: half its texture from inside to the edge."""
        low, high = sorted((inner_m, outer_m))
        s, t = _grid(self.rows(*span_m), np.array(self.columns_between(low, high)))
        u = 0.5 * (t - inner_m) / (outer_m - inner_m)
        uv = np.stack([u, s / road_materials.SCALES_M[slot]], axis=2)
        return mapped_surface(self.at(s, t, lift_m), uv, self.slots[slot])

    def sheet(self, s_m: Array, t_m: Array, slot: str, lift_m: float = 0.0) -> Patch:
        """A grid of points given by arc length and distance, both [rows, columns]."""
        return surface(
            self.at(s_m, t_m, lift_m), np.stack([s_m, t_m], axis=2), slot, self.slots[slot]
        )

    def path(self, s_m: Array, t_m: Array, width_m: float, slot: str, lift_m: float) -> Patch:
        """A line of a width along points in (s, t)."""
        along = np.stack([np.gradient(s_m), np.gradient(t_m)], axis=1)
        along /= np.sqrt((along * along).sum(axis=1, keepdims=True))
        across = 0.5 * width_m * np.stack([along[:, 1], -along[:, 0]], axis=1)
        s = np.stack([s_m + across[:, 0], s_m - across[:, 0]], axis=1)
        t = np.stack([t_m + across[:, 1], t_m - across[:, 1]], axis=1)
        return self.sheet(s, t, slot, lift_m)

    def paint(
        self,
        polygons: Iterable[Array],
        at_m: tuple[float, float],
        turned: bool = False,
        slot: str = "marking",
        lift_m: float = PAINT_LIFT_M,
    ) -> list[Patch]:
        """Convex polygons [n, 2] laid on the road, cut where its surface bends.

        Args:
            polygons: Counter-clockwise, X along the direction of travel, Y to its left.
            at_m: Arc length and distance of their origin.
            turned: Whether their X runs against the road.
            slot: Material.
            lift_m: Height over the surface.
        """
        sign = -1.0 if turned else 1.0
        columns = tuple(float(t) for t in self.t_m)
        patches = []
        for polygon in polygons:
            placed = np.array(at_m) + sign * polygon
            rows = self.rows(float(placed[:, 0].min()), float(placed[:, 0].max()))[1:-1]
            for part in painted_signs.split_convex(placed, 1, columns):
                for piece in painted_signs.split_convex(part, 0, tuple(float(s) for s in rows)):
                    patches.append(self._fan(piece, slot, lift_m))
        return patches

    def _fan(self, st: Array, slot: str, lift_m: float) -> Patch:
        points = self.at(st[:, 0], st[:, 1], lift_m)
        uv = st / road_materials.SCALES_M[slot]
        slots = np.full(len(st) - 2, self.slots[slot], dtype=np.int64)
        return Patch(_sectors(points[0], points[1:]), _sectors(uv[0], uv[1:]), slots)

    def disc(
        self, s_m: float, t_m: float, radius_m: float, slot: str, lift_m: float, sides: int = 20
    ) -> Patch:
        """A disc on the road, its texture once across it."""
        turn = 2.0 * math.pi * np.arange(sides + 1) / sides
        ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        st = np.array([s_m, t_m]) + radius_m * ring
        rim = self.at(st[:, 0], st[:, 1], lift_m)
        center = self.at(np.array([s_m]), np.array([t_m]), lift_m)[0]
        slots = np.full(sides, self.slots[slot], dtype=np.int64)
        middle = np.array([0.5, 0.5])
        return Patch(_sectors(center, rim), _sectors(middle, middle + 0.5 * ring), slots)


def _grid(s_m: Array, t_m: Array) -> tuple[Array, Array]:
    """Arc lengths and distances of every pair of both, [rows, columns] each."""
    shape = (len(s_m), len(t_m))
    # np.meshgrid takes ten times as long for a dozen numbers.
    return np.broadcast_to(s_m[:, None], shape).copy(), np.broadcast_to(t_m, shape).copy()


def _sectors(center: Array, rim: Array) -> Array:
    """Triangles [n - 1, 3, k] between a point [k] and the pieces of a line [n, k]."""
    return np.stack([np.broadcast_to(center, rim[1:].shape), rim[:-1], rim[1:]], axis=1)


def common_rows(shape: RoadShape) -> Array:
    """Arc lengths of the rows of a road's mesh, closer to each other on its bends."""
    rows = []
    for start in np.arange(0.0, shape.length_m, ROW_M):
        low, high = shape.curvature_range(float(start), float(start) + ROW_M)
        needed = math.sqrt(8.0 * SAGITTA_M / max(-low, high, 1e-9))
        count = max(1, math.ceil(ROW_M / needed - 1e-9))
        rows.append(start + ROW_M / count * np.arange(count))
    return np.concatenate(rows)


def surface(points: Array, plan_m: Array, slot: str, number: int) -> Patch:
    """A grid of points [rows, columns, 3]; its texture follows the plan [rows, columns, 2].

    Slots without a scale show their texture once.
    """
    if slot in road_materials.SCALES_M:
        uv = plan_m / road_materials.SCALES_M[slot]
    else:
        low, high = plan_m.min(axis=(0, 1)), plan_m.max(axis=(0, 1))
        uv = (plan_m - low) / np.maximum(high - low, 1e-9)
    return mapped_surface(points, uv, number)


def mapped_surface(points: Array, uv: Array, number: int) -> Patch:
    """A grid of points [rows, columns, 3] with texture coordinates [rows, columns, 2]."""
    corners, uvs = (_triangles(grid) for grid in (points, uv))
    return Patch(corners, uvs, np.full(len(corners), number, dtype=np.int64))


def _triangles(grid: Array) -> Array:
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    quads = np.stack([a, b, c, a, c, d], axis=2)
    triangles: Array = quads.reshape(-1, 3, grid.shape[2])
    return triangles
