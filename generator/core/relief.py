"""Relief of the ground: a profile along every road, blended into the land around them.

Streets are laid out on level ground and lifted once. The ground is a smooth field, sampled on a
grid of the world and linear on each triangle of it. Meshes are cut along the lines of that grid:
all layers of a street, such as asphalt and paint, follow the same planes; no crack opens and no
layer sinks into another one.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array

Ints = NDArray[np.int64]

CELL_M = 4.0
"""Cells of the grid. On a crest of K = 2, the tightest one at 30 km/h, the planes are up to 10 mm
below the parabola; whatever stands on the ground stands on the planes."""
WIDE_CELL_M, GENTLE_M, WIDE_BEND_M = 8.0, 3000.0, 500.0
"""Cells of gentle roads, such as motorways, and their smallest radii, of vertical curves and in
plan: planes are up to 3 mm below a parabola, and meshes have half of the faces."""
BESIDE_CELLS = 1.5
"""Cells for which a road goes on, or is level, beyond its edges: more than the diagonal of a cell,
over which the edge would tilt."""
_REACH_M = 160.0
"""Distance from all roads beyond which the ground has the height of its rim."""
_SOFT_M2 = 0.25
"""Squared distance at which the weight of a road falls to a quarter."""
_INSIDE = (0.4, 0.9)
"""Distances, in radii of a bend, between which the land inside it takes its height from all of the
road instead of the nearest point."""
_BANK_M, _SHOULDER_M = 25.0, 70.0
"""Next to a road, the land bends to its slope over the first distance, and back to level from there
to the second one."""


@dataclass(frozen=True, slots=True)
class RoadProfile:
    """Heights along one road, level across it, and slopes of the land on its sides.

    Attributes:
        x_m, y_m, yaw_rad: Start of its reference line.
        curvature_per_m: Curvature of its reference line, positive to the left.
        length_m: Length of its reference line.
        half_width_m: Distance from the reference line within which the profile alone decides; cells
            that end within it are level across.
        left, right: Rise of the land on its sides, away from the road, per metre.
        start_m: Height at its start.
        grade: Rise per metre at its start.
        curves: Three vertical curves, in order, each ``start_m, length_m, change``: parabolas
            along which the grade changes by so much.
        bends: Bends of its reference line in plan, in order, each ``start_m, spiral_m, arc_m,
            curvature_per_m, bank``: between two clothoids, an arc, in which the road slopes down to
            the inside by ``bank``.
    """

    x_m: float
    y_m: float
    yaw_rad: float
    curvature_per_m: float
    length_m: float
    half_width_m: float
    left: float
    right: float
    start_m: float
    grade: float
    curves: tuple[float, float, float, float, float, float, float, float, float]
    bends: tuple[float, ...] = ()

    def height(self, s_m: Array, cell_m: float = CELL_M) -> Array:
        """Heights [n] at arc lengths [n] of the reference line, constant beyond its ends.

        Both end grades go on for ``BESIDE_CELLS``.
        """
        end_m = BESIDE_CELLS * cell_m
        s = np.clip(s_m, -end_m, self.length_m + end_m)
        z: Array = self.start_m + self.grade * s
        for start, length, change in self._bends():
            z = z + change * _bend(s - start, length)
        return z

    def slope(self, s_m: float) -> float:
        """Grade at an arc length within the road."""
        return self.grade + sum(
            change * min(max((s_m - start) / length, 0.0), 1.0)
            for start, length, change in self._bends()
        )

    def _bends(self) -> Iterator[tuple[float, float, float]]:
        return zip(self.curves[0::3], self.curves[1::3], self.curves[2::3], strict=True)

    @property
    def is_gentle(self) -> bool:
        """Whether wide cells are near to it."""
        crests = (length / abs(k) >= GENTLE_M for _, length, k in self._bends() if k)
        bends = (0.0, *(k for _, _, _, k, _ in self._turns()))
        return all(crests) and all(
            abs(self.curvature_per_m + k) <= 1.0 / WIDE_BEND_M for k in bends
        )

    def line(self) -> Array:
        """Points [n, 2] of its reference line, a few metres apart."""
        return _stations(self)[:, 1:3]

    def weigh(self, x_m: Array, y_m: Array, cell_m: float) -> tuple[Array, Array]:
        """Its heights on a grid [m, n], and their weights, which fall with the distance from it.

        Args:
            x_m: Places of the rows, [m, 1].
            y_m: Places of the columns, [1, n].
            cell_m: Their distance.
        """
        s, t = self._along_and_left(x_m, y_m)
        beyond = s - np.clip(s, 0.0, self.length_m)
        aside = np.maximum(np.abs(t) - self.half_width_m, 0.0)
        weight = 1.0 / np.square(beyond * beyond + aside * aside + _SOFT_M2)
        height = self.height(s, cell_m) + self._bank(s, t) + self._land(t)
        if self.bends:
            # Where legs of the road are equally near, the nearest one would change at a step.
            first, last = self._inside_m()
            far = np.abs(t) > first
            share = np.clip((np.abs(t[far]) - first) / (last - first), 0.0, 1.0)
            share = share * share * (3.0 - 2.0 * share)
            row, column = np.nonzero(far)
            away = self._far(x_m[row, 0], y_m[0, column])
            height[far] = (1.0 - share) * height[far] + share * away
        return height, weight

    def _land(self, t_m: Array) -> Array:
        """Rise of the land above the road at distances to its left."""
        aside = np.maximum(np.abs(t_m) - self.half_width_m, 0.0)
        rise = np.where(t_m > 0.0, self.left, self.right)
        land: Array = rise * (_bend(aside, _BANK_M) - _bend(aside - _BANK_M, _SHOULDER_M - _BANK_M))
        return land

    def _bank(self, s_m: Array, t_m: Array) -> Array:
        """Rise above the reference line by superelevation, which grows along the clothoids."""
        across = np.clip(t_m, -self.half_width_m, self.half_width_m)
        slope = np.zeros(np.shape(s_m))
        for start, spiral, arc, curvature, bank in self._turns():
            ends = (start, start + spiral, start + spiral + arc, start + 2.0 * spiral + arc)
            slope = slope - np.sign(curvature) * bank * np.interp(s_m, ends, (0.0, 1.0, 1.0, 0.0))
        rise: Array = slope * across
        return rise

    def _turns(self) -> Iterator[tuple[float, float, float, float, float]]:
        return zip(*(self.bends[k::5] for k in range(5)), strict=True)

    def _inside_m(self) -> tuple[float, float]:
        """Distances from the line between which the land inside its sharpest bend is blended."""
        sharpest = max(abs(self.curvature_per_m + k) for _, _, _, k, _ in self._turns())
        # Next to the road, its own profile decides even in bends that are only slightly wider.
        first = max(_INSIDE[0] / sharpest, self.half_width_m)
        return first, max(_INSIDE[1] / sharpest, first + CELL_M)

    def heading(self, s_m: Array) -> Array:
        """Headings [n] of its reference line at arc lengths [n]."""
        heading: Array = self.yaw_rad + self.curvature_per_m * s_m
        for start, spiral, arc, curvature, _ in self._turns():
            ramp = _bend(s_m - start, spiral) - _bend(s_m - start - spiral - arc, spiral)
            heading = heading + curvature * ramp
        return heading

    def _along_and_left(self, x_m: Array, y_m: Array) -> tuple[Array, Array]:
        """Arc lengths and distances to the left of the nearest points of the line."""
        if self.bends:
            return self._near_bends(x_m, y_m)
        c, s = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        u = c * (x_m - self.x_m) + s * (y_m - self.y_m)
        v = c * (y_m - self.y_m) - s * (x_m - self.x_m)
        if self.curvature_per_m == 0.0:
            return u, v
        side, radius = np.sign(self.curvature_per_m), 1.0 / abs(self.curvature_per_m)
        along = radius * np.arctan2(u, radius - side * v)
        return along, side * (radius - np.hypot(u, radius - side * v))

    def _near_bends(self, x_m: Array, y_m: Array) -> tuple[Array, Array]:
        stations = _stations(self)
        shape = np.broadcast_shapes(x_m.shape, y_m.shape)
        best, nearest = np.full(shape, np.inf), np.zeros(shape, np.int64)
        for number, (_, x, y, _, _) in enumerate(stations):
            square = np.square(x_m - x) + np.square(y_m - y)
            np.copyto(nearest, number, where=square < best)
            np.minimum(square, best, out=best)
        at, x, y, heading, bent = (column.take(nearest) for column in stations.T)
        c, s = np.cos(heading), np.sin(heading)
        u, v = c * (x_m - x) + s * (y_m - y), c * (y_m - y) - s * (x_m - x)
        # The line near a station is its arc of curvature.
        side, radius = np.where(bent < 0.0, -1.0, 1.0), 1.0 / np.maximum(np.abs(bent), 1e-7)
        along = at + radius * np.arctan2(u, radius - side * v)
        return along, side * (radius - np.hypot(u, radius - side * v))

    def _far(self, x_m: Array, y_m: Array) -> Array:
        """Smooth heights [n] of land far from the line, by Shepard's weights."""
        stations = _stations(self)
        total, heights = np.zeros(x_m.shape), np.zeros(x_m.shape)
        z = self.height(stations[:, 0])
        for number, (_, x, y, heading, _) in enumerate(stations):
            dx, dy = x_m - x, y_m - y
            square = dx * dx + dy * dy
            weight = 1.0 / np.square(square + CELL_M * CELL_M)
            total += weight
            land_m = self._land(np.cos(heading) * dy - np.sin(heading) * dx)
            heights += weight * (z[number] + land_m)
        smooth: Array = heights / total
        return smooth


@dataclass(frozen=True, slots=True)
class Relief:
    """Height of the ground of a street above the level world in which it is laid out.

    Where roads overlap, at junctions, their profiles are level and at the same height.
    Source of the weights: Shepard, "A two-dimensional interpolation function for irregularly-spaced
    data", ACM National Conference, 1968.

    Attributes:
        roads: At least one.
    """

    roads: tuple[RoadProfile, ...]

    @property
    def cell_m(self) -> float:
        """Cells of its grid."""
        return WIDE_CELL_M if all(road.is_gentle for road in self.roads) else CELL_M

    def height(self, points_m: Array) -> Array:
        """Heights [n] of the ground at places [n, 2 or more], x and y first."""
        grid = _sampled(self)
        return grid.on_planes(grid.find(points_m))

    def surface(self, points_m: Array) -> tuple[Array, Array]:
        """Heights as by ``height``, and slopes [2, n] along x and y of the smooth ground."""
        grid = _sampled(self)
        places = grid.find(points_m)
        return grid.on_planes(places), grid.smooth_slopes(places)

    def numbers(self) -> tuple[float, ...]:
        """All values in a row, for ids of assets; before its bends each road has their number."""
        rows = []
        for road in self.roads:
            *plain, curves, bends = (getattr(road, field.name) for field in fields(road))
            rows += [*plain, *curves, len(bends) // 5, *bends]
        return tuple(float(number) for number in rows)

    @classmethod
    def of(cls, numbers: Sequence[float]) -> "Relief":
        """The inverse of ``numbers``. Raises ValueError if they are of another number."""
        plain = len(fields(RoadProfile)) - 2
        roads, at = [], 0
        while at + plain + 9 < len(numbers):
            bends = at + plain + 10
            end = bends + 5 * int(numbers[bends - 1])
            curves, row = numbers[at + plain : bends - 1], numbers[bends:end]
            roads.append(RoadProfile(*numbers[at : at + plain], tuple(curves), tuple(row)))  # type: ignore[call-arg, arg-type]
            at = end
        if not roads or at != len(numbers):
            raise ValueError(
                f"{len(numbers)} numbers are not a relief; expected {plain + 10} per road, the "
                "last of which is its number of bends, and 5 per bend"
            )
        return cls(tuple(roads))


@lru_cache(maxsize=16)
def _stations(road: RoadProfile) -> Array:
    """Arc lengths, points, headings and curvatures [n, 5] of the reference line of a road."""
    s = np.linspace(0.0, road.length_m, 2 + int(road.length_m / CELL_M))
    if not road.bends:
        turn = road.curvature_per_m * s
        chord = s * np.sinc(turn / (2.0 * np.pi))
        heading = road.yaw_rad + 0.5 * turn
        x, y = road.x_m + chord * np.cos(heading), road.y_m + chord * np.sin(heading)
    else:
        x, y = (
            start + np.concatenate([[0.0], np.cumsum(_simpson(of, road.heading, s))])
            for start, of in ((road.x_m, np.cos), (road.y_m, np.sin))
        )
    step = 0.5
    bent = (road.heading(s + step) - road.heading(s - step)) / (2.0 * step)
    return np.column_stack([s, x, y, road.heading(s), bent])


def _simpson(of: Callable[[Array], Array], angle: Callable[[Array], Array], s_m: Array) -> Array:
    """Integrals [n - 1] of a function of an angle between arc lengths [n]."""
    a, b = s_m[:-1], s_m[1:]
    quarters = [of(angle(a + share * (b - a))) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    weights = (1.0, 4.0, 2.0, 4.0, 1.0)
    pieces: Array = (b - a) / 12.0 * sum(w * q for w, q in zip(weights, quarters, strict=True))
    return pieces


def _bend(past_m: Array, length_m: float) -> Array:
    """Rise of a line whose slope turns from 0 to 1 over a length, at distances from its start."""
    past = np.maximum(past_m, 0.0)
    within = np.minimum(past, length_m)
    rise: Array = within * within / (2.0 * length_m) + (past - within)
    return rise


_Places = tuple[tuple[Ints, Ints, Ints, Ints], Array, Array]
"""Corners of cells, and shares along x and y, by ``_Grid.find``."""


@dataclass(frozen=True, eq=False, slots=True)
class _Grid:
    """The smooth ground at the nodes of the grid, as far as roads shape it.

    Attributes:
        cell_m: Distance of nodes.
        first: Numbers of the first node along x and y; node k is at ``k * cell_m``.
        heights_m: [m, n].
        slopes: Along x and along y, [2, m, n].
    """

    cell_m: float
    first: Array
    heights_m: Array
    slopes: Array

    def find(self, points_m: Array) -> _Places:
        """Cells of places [n, 2 or more], and where in them they are; outside, at the rim.

        Returns:
            Numbers [n] in the flat grid of a cell's corners: of least x and y, north, east, and
            north-east of it; and shares [n] of the cell along x and y.
        """
        points = np.asarray(points_m, np.float64)
        cells, shares = [], []
        # Axis by axis: numpy is slow on the short axis of [n, 2].
        for axis, count in enumerate(self.heights_m.shape):
            at = points[:, axis] / self.cell_m - self.first[axis]
            at = np.minimum(np.maximum(at, 0.0), count - 1.0)
            cell = np.minimum(np.floor(at), count - 2.0)
            cells.append(cell.astype(np.int64))
            shares.append(at - cell)
        width = self.heights_m.shape[1]
        here = cells[0] * width + cells[1]
        return (here, here + 1, here + width, here + width + 1), shares[0], shares[1]

    def on_planes(self, places: _Places) -> Array:
        """Heights [n] of the triangles of cells."""
        corners, u, v = places
        here, north_z, east_z, cross_z = (self.heights_m.take(corner) for corner in corners)
        east, north, cross = east_z - here, north_z - here, cross_z - here
        # The diagonal of a cell runs from its corner of least x and y to its opposite corner.
        lower: Array = u * east + v * (cross - east)
        upper: Array = v * north + u * (cross - north)
        heights: Array = here + np.where(u >= v, lower, upper)
        return heights

    def smooth_slopes(self, places: _Places) -> Array:
        """Slopes [2, n] along x and y, for shading."""
        corners, u, v = places
        mixed = []
        for slope in self.slopes:
            here, north, east, cross = (slope.take(corner) for corner in corners)
            near, far = (1.0 - u) * here + u * east, (1.0 - u) * north + u * cross
            mixed.append((1.0 - v) * near + v * far)
        return np.stack(mixed)


@lru_cache(maxsize=4)
def _sampled(relief: Relief) -> _Grid:
    """The grid of a relief, which all meshes, lanes and bodies of a scene ask."""
    cell_m = relief.cell_m
    lines = np.concatenate([road.line() for road in relief.roads])
    first = np.floor((lines.min(axis=0) - _REACH_M) / cell_m)
    last = np.ceil((lines.max(axis=0) + _REACH_M) / cell_m)
    x, y = (cell_m * np.arange(a, b + 1.0) for a, b in zip(first, last, strict=True))
    weighed = [road.weigh(x[:, None], y[None], cell_m) for road in relief.roads]
    total = sum(weight for _, weight in weighed)
    # Rounded as poses are: the same bits on every processor.
    heights = np.round(sum(height * weight for height, weight in weighed) / total, 6)
    slopes = np.stack([np.gradient(heights, cell_m, axis=k) for k in (0, 1)])
    return _Grid(cell_m, first, heights, slopes)
