"""Start poses of objects: layouts on surfaces, before physics settles them."""

import math
from bisect import insort
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gen_data.assets.asset_ids import parse_asset_id
from gen_data.assets.families import declared
from gen_data.config import distributions as dist
from gen_data.core.errors import LayoutRejected, Rejection
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Body, ObjectGroup, Scene, SupportSurface
from gen_data.core.se3 import SE3, Array, Vec3
from gen_data.core.streams import Rng

GAP_M = 0.004
"""Gap between placed objects."""
DROP_M = (0.01, 0.05)
"""Range of drop heights: enough to tumble, too little to bounce away."""
DROP_TRIES = 24
"""Attempts to find a free place before an object is dropped on top of others."""
SCATTER_TRIES = 200
BESIDE_M = (0.0005, 0.006)
"""Range of gaps in a row."""

_LIFT_M = 0.0005
_OPEN_M, _FRONT = 1.0, 0.15
"""Below a board at less than this height, rows stand in this front share of the free depth."""
_LEAN_RAD = 0.45
"""Largest angle between the axis of a hanging object and the vertical (assumed)."""
_TIDY = 0.6
"""Share of rows in which all objects face the same way (assumed)."""
_TOO_HIGH = Rejection("object higher than the space above the surface", "smaller objects or scale")


@dataclass(frozen=True)
class Item:
    """An object to place.

    Attributes:
        half_m: Scaled half extents along its own axes.
        stackable: Whether top and bottom are flat.
        outline_m: Its scaled vertices seen from above, around its centre, [n, 2]; None = a
            rectangle.
    """

    half_m: Vec3
    stackable: bool = False
    outline_m: Array | None = None

    @property
    def radius_m(self) -> float:
        """Radius of the bounding cylinder of the upright object."""
        return math.hypot(self.half_m[0], self.half_m[1])

    @property
    def reach_m(self) -> float:
        """Radius of the bounding sphere, at any rotation."""
        return math.hypot(*self.half_m)

    def span_m(self, yaw_rad: float) -> tuple[Vec3, Vec3]:
        """Smallest and largest coordinates of the upright object, turned about its centre."""
        hx, hy, hz = self.half_m
        outline = self.outline_m
        if outline is None:
            outline = np.array([[-hx, -hy], [-hx, hy], [hx, -hy], [hx, hy]])
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        turned = outline @ np.array([[c, s], [-s, c]])
        (x0, y0), (x1, y1) = turned.min(axis=0).tolist(), turned.max(axis=0).tolist()
        return (x0, y0, -hz), (x1, y1, hz)


@dataclass
class Floor:
    """A surface being filled: occupied cylinders ``(x, y, radius, top)`` in its frame [m]."""

    surface: SupportSurface
    taken: list[tuple[float, float, float, float]] = field(default_factory=list)
    closed: list[Vec3] = field(default_factory=list)
    hooks: tuple[Vec3, ...] = ()
    """Points from which objects hang, in its frame [m]."""
    spot: Vec3 | None = None
    """Disc ``(x, y, radius)`` [m] with the centres of a pile; None = the whole surface."""

    def top_under(self, x: float, y: float, radius_m: float) -> float:
        """Height of the objects below a disc [m]; 0 where the surface is bare."""
        # Highest first: on a crowded surface, the first few decide.
        for ox, oy, other_m, top in self.taken:
            if math.hypot(x - ox, y - oy) < radius_m + other_m + GAP_M:
                return top
        return 0.0

    def take(self, x: float, y: float, radius_m: float, top_m: float) -> None:
        """Add an object."""
        insort(self.taken, (x, y, radius_m, top_m), key=lambda disc: -disc[3])

    def is_closed(self, x: float, y: float, radius_m: float) -> bool:
        """Whether a disc touches a keep-out area."""
        return any(math.hypot(x - cx, y - cy) < radius_m + r for cx, cy, r in self.closed)

    def place(self, rng: Rng, radius_m: float) -> tuple[float, float]:
        """Draw a point where a disc fits on the surface; the centre along axes too short for it."""
        room_x = max(0.0, 0.5 * self.surface.size_m[0] - radius_m)
        room_y = max(0.0, 0.5 * self.surface.size_m[1] - radius_m)
        if self.spot is not None:
            x, y, reach_m = self.spot
            away = reach_m * math.sqrt(float(rng.uniform()))
            turn = 2.0 * math.pi * float(rng.uniform())
            x, y = x + away * math.cos(turn), y + away * math.sin(turn)
            return min(max(x, -room_x), room_x), min(max(y, -room_y), room_y)
        return float(rng.uniform(-room_x, room_x)), float(rng.uniform(-room_y, room_y))


def find_floors(scene: Scene, group: ObjectGroup, assets: AssetIndex) -> list[Floor]:
    """Find the surfaces of a group, with the objects already on them."""
    floors = []
    for name in group.surfaces:
        surface = scene.surface(name)
        T_surface_world = surface.T_world_surface.inverse()
        floor = Floor(surface)
        if group.placement == "hang":
            floor.hooks = _hooks_m(scene.body(surface.body).asset)
        for x, y, radius_m in group.keep_out:
            here = _transform(T_surface_world, (x, y, surface.T_world_surface.translation_m[2]))
            floor.closed.append((here[0], here[1], radius_m))
        for body in scene.bodies:
            if body.motion == "dynamic":
                cylinder = _cylinder(body, T_surface_world, assets)
                if -GAP_M < cylinder[3] < surface.clearance_m:
                    floor.take(*cylinder)
        floors.append(floor)
    return floors


def _hooks_m(asset: str) -> tuple[Vec3, ...]:
    hooks_of = declared(asset, "hooks_m", None)
    if hooks_of is None:
        return ()
    hooks: tuple[Vec3, ...] = hooks_of(**parse_asset_id(asset).parameters)
    return hooks


def lay_out(
    group: ObjectGroup,
    items: Sequence[Item],
    floors: list[Floor],
    rng: Rng,
    upright: Sequence[bool],
) -> list[SE3]:
    """Draw ``T_world_body`` of every item, by the group's placement.

    Raises:
        LayoutRejected: no free place was found, or an item is too high.
    """
    before = sum(len(floor.taken) for floor in floors)
    try:
        return _place_all(group, items, floors, rng, upright)
    except LayoutRejected as refused:
        placed = sum(len(floor.taken) for floor in floors) - before
        names = ", ".join(f"'{name}'" for name in group.surfaces)
        detail = f"{placed} of {len(items)} objects of '{group.name}' found a place on {names}"
        missing = float(len(items) - placed)
        raise LayoutRejected(replace(refused.rejection, detail=detail, excess=missing)) from None


def _place_all(
    group: ObjectGroup,
    items: Sequence[Item],
    floors: list[Floor],
    rng: Rng,
    upright: Sequence[bool],
) -> list[SE3]:
    """Poses by the group's placement; see ``lay_out``."""
    if group.placement == "stack":
        return _stack(group, items, floors, rng)
    if group.placement == "grid":
        return _arrange_in_grid(group, items, floors, rng)
    if group.placement == "scatter":
        return _scatter(group, items, floors, rng)
    if group.placement == "row":
        return _line_up(group, items, floors, rng)
    if group.placement == "hang":
        return _hang(group, items, floors, rng)
    if group.placement == "pile" and items:
        floors = [_choose_spot(group, items, floors, rng, upright)]
    return [
        _drop(group, item, floors[_draw_floor(floors, item, rng)], rng, stands)
        for item, stands in zip(items, upright, strict=True)
    ]


def _drop(group: ObjectGroup, item: Item, floor: Floor, rng: Rng, upright: bool) -> SE3:
    """Pose above a free place if one is found, else above the lowest objects."""
    clearance_m = floor.surface.clearance_m
    upright = upright or 2 * item.reach_m + DROP_M[1] > clearance_m
    radius_m = item.radius_m if upright else item.reach_m
    half_height_m = item.half_m[2] if upright else item.reach_m
    place = _find_lowest_place(floor, radius_m, rng)
    if place is None:
        raise _no_place(group)
    x, y, top_m = place
    fall_m = float(rng.uniform(*DROP_M)) if not upright else DROP_M[0]
    z = top_m + half_height_m + fall_m
    if z + half_height_m > clearance_m:
        raise _no_place(group)
    floor.take(x, y, radius_m, z + half_height_m)
    turn = _yaw(rng) if upright else SE3(quaternion_wxyz=dist.So3().draw(rng))
    return floor.surface.T_world_surface @ SE3((x, y, z)) @ turn


def _find_lowest_place(floor: Floor, radius_m: float, rng: Rng) -> Vec3 | None:
    """Find ``(x, y, height)`` of a bare place, else of the lowest one tried.

    None if every place tried is in a keep-out area.
    """
    lowest: Vec3 | None = None
    for _ in range(DROP_TRIES):
        x, y = floor.place(rng, radius_m)
        if floor.is_closed(x, y, radius_m):
            continue
        top_m = floor.top_under(x, y, radius_m)
        if lowest is None or top_m < lowest[2]:
            lowest = (x, y, top_m)
        if top_m == 0.0:
            break
    return lowest


def _scatter(group: ObjectGroup, items: Sequence[Item], floors: list[Floor], rng: Rng) -> list[SE3]:
    """Upright poses apart from everything else; the widest items choose first."""
    poses: dict[int, SE3] = {}
    for k in sorted(range(len(items)), key=lambda k: (-items[k].radius_m, k)):
        floor, x, y = _find_bare_place(group, items[k], floors, rng)
        poses[k] = _stand(items[k], floor, (x, y, 0.0), _yaw(rng))
    return [poses[k] for k in range(len(items))]


def _find_bare_place(
    group: ObjectGroup, item: Item, floors: list[Floor], rng: Rng
) -> tuple[Floor, float, float]:
    """Find a surface and a point on it with room for an upright item."""
    for _ in range(SCATTER_TRIES):
        floor = floors[_draw_floor(floors, item, rng)]
        x, y = floor.place(rng, item.radius_m)
        bare = floor.top_under(x, y, item.radius_m) == 0.0
        if bare and not floor.is_closed(x, y, item.radius_m):
            return floor, x, y
    raise _no_place(group)


def _arrange_in_grid(
    group: ObjectGroup, items: Sequence[Item], floors: list[Floor], rng: Rng
) -> list[SE3]:
    """Poses in rows, surface by surface, at multiples of a quarter turn."""
    poses = []
    share = -(-len(items) // len(floors))
    for number, floor in enumerate(floors):
        here = items[number * share : (number + 1) * share]
        cells = _find_cells(floor, here)
        if len(cells) < len(here):
            raise _no_place(group)
        for item, (x, y) in zip(here, cells, strict=False):
            quarter = SE3.about_z(0.5 * math.pi * int(rng.integers(4)))
            poses.append(_stand(item, floor, (x, y, 0.0), quarter))
    return poses


def _find_cells(floor: Floor, items: Sequence[Item]) -> list[tuple[float, float]]:
    """Centres of the free cells of the coarsest grid with a cell for every item; else empty."""
    half_m = max((max(item.half_m[:2]) for item in items), default=0.0)
    length_m, width_m = floor.surface.size_m
    for count in range(max(len(items), 1), 4 * len(items) + 64):
        columns = max(1, round((count * length_m / width_m) ** 0.5))
        rows = -(-count // columns)
        if min(length_m / columns, width_m / rows) < 2 * half_m + GAP_M:
            continue
        centers = [
            (length_m * ((k + 0.5) / columns - 0.5), width_m * ((row + 0.5) / rows - 0.5))
            for row in range(rows)
            for k in range(columns)
        ]
        radius_m = math.sqrt(2.0) * half_m
        free = [
            (x, y)
            for x, y in centers
            if not floor.is_closed(x, y, radius_m) and floor.top_under(x, y, half_m) == 0.0
        ]
        if len(free) >= len(items):
            return free
    return []


def _choose_spot(
    group: ObjectGroup,
    items: Sequence[Item],
    floors: list[Floor],
    rng: Rng,
    upright: Sequence[bool],
) -> Floor:
    """A surface with a spot on which the items of a pile have less than half the room they need."""
    floor = floors[_draw_floor(floors, max(items, key=lambda item: item.half_m[2]), rng)]
    radii_m = [i.radius_m if up else i.reach_m for i, up in zip(items, upright, strict=True)]
    reach_m = math.sqrt(0.45 * sum(r * r for r in radii_m[1:])) if len(items) > 1 else 0.0
    for _ in range(SCATTER_TRIES):
        x, y = floor.place(rng, reach_m + max(radii_m))
        if not floor.is_closed(x, y, reach_m):
            return replace(floor, spot=(x, y, reach_m))
    raise _no_place(group)


def _line_up(group: ObjectGroup, items: Sequence[Item], floors: list[Floor], rng: Rng) -> list[SE3]:
    """Upright poses side by side along a surface, all facing -Y or turned in any way.

    A row that is full continues behind the one before; the block of rows has a random place.
    """
    if not items:
        return []
    tidy = bool(rng.uniform() < _TIDY)
    for _ in range(SCATTER_TRIES):
        floor = floors[_draw_floor(floors, max(items, key=lambda item: item.half_m[2]), rng)]
        poses = _rows_at_a_place(items, floor, rng, tidy)
        if poses is not None:
            return poses
    raise _no_place(group)


def _rows_at_a_place(items: Sequence[Item], floor: Floor, rng: Rng, tidy: bool) -> list[SE3] | None:
    """Poses of a block of rows at a drawn place; None if it is taken."""
    length_m, width_m = floor.surface.size_m
    row_m = max(length_m / 3.0, length_m * float(rng.uniform()))
    x = y = deep = wide = 0.0
    places: list[tuple[Item, float, Vec3]] = []
    for item in items:
        turn = float(rng.uniform(-1.0, 1.0))
        yaw = -0.5 * math.pi + 0.06 * turn if tidy else math.pi * turn
        gap_m = float(rng.uniform(*BESIDE_M))
        low, high = item.span_m(yaw)
        if places and x + high[0] - low[0] > row_m:
            x, y, deep = 0.0, y + deep + gap_m, 0.0
        places.append((item, yaw, (x - low[0], y - low[1], 0.0)))
        x, deep = x + high[0] - low[0] + gap_m, max(deep, high[1] - low[1])
        wide = max(wide, x)
    room_x, room_y = length_m - wide, width_m - y - deep
    if min(room_x, room_y) < 0.0:
        return None
    to_x = room_x * float(rng.uniform()) - 0.5 * length_m
    back = float(rng.uniform()) * (1.0 if floor.surface.clearance_m >= _OPEN_M else _FRONT)
    to_y = room_y * back - 0.5 * width_m
    middle = (to_x + 0.5 * wide, to_y + 0.5 * (y + deep), 0.5 * math.hypot(wide, y + deep))
    if floor.is_closed(*middle) or floor.top_under(*middle) > 0.0:
        return None
    return [
        _stand(item, floor, (to_x + at[0], to_y + at[1], 0.0), SE3.about_z(yaw))
        for item, yaw, at in places
    ]


def _hang(group: ObjectGroup, items: Sequence[Item], floors: list[Floor], rng: Rng) -> list[SE3]:
    """Poses below drawn hooks, turned in any way about the vertical and a little from it."""
    hooks = [(floor, hook) for floor in floors for hook in floor.hooks]
    if len(hooks) < len(items):
        raise _no_place(group)
    chosen = np.argsort(rng.uniform(size=len(hooks)), kind="stable")
    poses = []
    for item, number in zip(items, chosen, strict=False):
        floor, hook = hooks[int(number)]
        lean = _LEAN_RAD * float(rng.uniform(-1.0, 1.0))
        turn = SE3.about_z(2.0 * math.pi * float(rng.uniform())) @ _about_x(lean)
        down = turn @ SE3((0.0, 0.0, -item.half_m[2]))
        poses.append(floor.surface.T_world_surface @ SE3(hook) @ down)
    return poses


def _about_x(angle_rad: float) -> SE3:
    return SE3(quaternion_wxyz=(math.cos(0.5 * angle_rad), math.sin(0.5 * angle_rad), 0.0, 0.0))


def _stack(group: ObjectGroup, items: Sequence[Item], floors: list[Floor], rng: Rng) -> list[SE3]:
    """Poses in towers of two to four, the widest at the bottom; items not flat stand alone."""
    poses: dict[int, SE3] = {}
    flat = [k for k, item in enumerate(items) if item.stackable]
    flat.sort(key=lambda k: (-items[k].radius_m, k))
    alone = [k for k, item in enumerate(items) if not item.stackable]
    while flat:
        height = min(int(rng.integers(2, 5)), len(flat))
        tower, flat = flat[:height], flat[height:]
        floor, x, y = _find_bare_place(group, items[tower[0]], floors, rng)
        z = 0.0
        for k in tower:
            poses[k] = _stand(items[k], floor, (x, y, z), _yaw(rng))
            z += 2 * items[k].half_m[2]
    for k in alone:
        floor, x, y = _find_bare_place(group, items[k], floors, rng)
        poses[k] = _stand(items[k], floor, (x, y, 0.0), _yaw(rng))
    return [poses[k] for k in range(len(items))]


def _stand(item: Item, floor: Floor, place: Vec3, turn: SE3) -> SE3:
    """Upright pose on a point in the surface's frame."""
    x, y, z = place
    top_m = z + 2 * item.half_m[2]
    if top_m > floor.surface.clearance_m:
        raise LayoutRejected(_TOO_HIGH)
    floor.take(x, y, item.radius_m, top_m)
    center = SE3((x, y, z + item.half_m[2] + _LIFT_M))
    return floor.surface.T_world_surface @ center @ turn


def _draw_floor(floors: list[Floor], item: Item, rng: Rng) -> int:
    """Draw a surface with enough clearance for the item, in proportion to its area."""
    areas = [
        f.surface.size_m[0] * f.surface.size_m[1]
        if 2 * item.half_m[2] + DROP_M[0] < f.surface.clearance_m
        else 0.0
        for f in floors
    ]
    total = sum(areas)
    if total == 0.0:
        raise LayoutRejected(_TOO_HIGH)
    draw = float(rng.uniform()) * total
    for number, area in enumerate(areas):
        draw -= area
        if draw < 0.0:
            return number
    return max(range(len(areas)), key=areas.__getitem__)


def _cylinder(
    body: Body, T_surface_world: SE3, assets: AssetIndex
) -> tuple[float, float, float, float]:
    low, high = assets.bounds_m(body.asset)
    item = Item(half_extents_m(low, high, body.scale))
    x, y, z = _transform(T_surface_world, body.T_world_body.translation_m)
    return (x, y, item.reach_m, z + item.reach_m)


def half_extents_m(low: Vec3, high: Vec3, scale: float) -> Vec3:
    """Half extents of a scaled bounding box."""
    x, y, z = (0.5 * scale * (b - a) for a, b in zip(low, high, strict=True))
    return (x, y, z)


def outline_m(asset: str, scale: float, assets: AssetIndex) -> Array:
    """Scaled vertices of an upright asset seen from above, around the middle of its bounds."""
    (x0, y0, _), (x1, y1, _) = assets.bounds_m(asset)
    middle = np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1)])
    return np.asarray(scale * (assets.vertices_m(asset)[:, :2].astype(np.float64) - middle))


def _yaw(rng: Rng) -> SE3:
    return SE3.about_z(float(rng.uniform(0.0, 2.0 * math.pi)))


def _transform(pose: SE3, point: Vec3) -> Vec3:
    return (pose @ SE3(point)).translation_m


def _no_place(group: ObjectGroup) -> LayoutRejected:
    remedy = f"fewer objects (randomizers.{group.name}.count) or a larger surface"
    return LayoutRejected(Rejection("no free place for an object", remedy))
