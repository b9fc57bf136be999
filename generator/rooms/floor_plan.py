"""Floor plans: rooms as rectangles, their walls and the openings in them.

Wall ``k`` of a room is the one on the side of direction ``180 + 90 k`` degrees; furniture with its
back to it faces ``90 k`` degrees. Places along a wall count from its middle, to the left as seen
facing into the room.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from gen_data.core.streams import Rng
from gen_data.rooms.rules import APARTMENT, Range, RoomType, find_room_type

WALL_M = 0.1
"""Thickness of the walls of one room; rooms that touch share a wall of twice as much."""
DOOR_M = (0.88, 2.04)
"""Width and height of the openings of doors; DIN 18101 has leaves of 0.86 m by 1.985 m."""
_ASIDE_M = 0.12
"""Smallest distance of an opening from a corner or another opening."""
_TRIES = 40
Opening_Kind = Literal["door", "window"]


@dataclass(frozen=True, slots=True)
class Opening:
    """A hole in a wall.

    Attributes:
        along_m: Place of its middle along the wall.
        width_m: Width.
        low_m, high_m: Heights of its lower and upper edge.
        framed: Whether the door hangs in this room; false for its other side.
    """

    kind: Opening_Kind
    wall: int
    along_m: float
    width_m: float
    low_m: float
    high_m: float
    framed: bool = True


@dataclass(frozen=True, slots=True)
class Room:
    """One room of a plan.

    Attributes:
        name: Unique in the plan.
        kind: Name of its type.
        center_m: Middle of its floor, world.
        size_m: Inner length, width and height along X, Y and Z.
    """

    name: str
    kind: str
    center_m: tuple[float, float]
    size_m: tuple[float, float, float]
    openings: tuple[Opening, ...] = ()

    def wall_length_m(self, wall: int) -> float:
        """Inner length of a wall."""
        return self.size_m[1 - wall % 2]

    def at_wall(self, wall: int, along_m: float, away_m: float) -> tuple[float, float]:
        """World coordinates of a point at a distance from a wall."""
        c, s = direction(wall)
        half = 0.5 * self.size_m[wall % 2] - away_m
        x, y = self.center_m
        return (x - half * c - along_m * s, y - half * s + along_m * c)


def direction(quarter: int) -> tuple[float, float]:
    """Cosine and sine of a number of quarter turns, exact."""
    return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarter % 4]


def between(rng: Rng, limits: Range) -> float:
    """Draw uniformly, rounded to millimetres."""
    return round(limits[0] + (limits[1] - limits[0]) * float(rng.random()), 3)


def draw_count(rng: Rng, limits: tuple[int, int]) -> int:
    """Draw an integer, both limits included."""
    return limits[0] + min(int(rng.random() * (limits[1] - limits[0] + 1)), limits[1] - limits[0])


def draw_plan(
    kind: str, size_m: tuple[Range, Range, Range] | None, rng: Rng, field: str
) -> tuple[Room, ...]:
    """Draw the rooms of a type, with doors and windows.

    Args:
        kind: Type of the room, or ``apartment``.
        size_m: Ranges of length, width and height; None = the type's ranges.
        rng: Random stream.
        field: Place of ``kind`` in the configuration, for the error.

    Raises:
        ConfigError: there is no such type.
    """
    if kind == APARTMENT:
        return _draw_apartment(size_m, rng)
    rules = find_room_type(kind, field)
    x, y, z = (between(rng, limits) for limits in size_m or rules.size_m)
    return (_open(Room("0", kind, (0.0, 0.0), (x, y, z)), rules, range(4), 1, rng),)


def _draw_apartment(size_m: tuple[Range, Range, Range] | None, rng: Rng) -> tuple[Room, ...]:
    """A living room along one side, a kitchen, a bathroom and a bedroom along the other."""
    length, width, height = (
        between(rng, r) for r in size_m or ((8.6, 10.5), (7.2, 8.6), (2.45, 2.8))
    )
    front = round(width * between(rng, (0.5, 0.56)), 3)
    back = round(width - front - 2 * WALL_M, 3)
    names = ["kitchen", "bathroom", "bedroom"]
    if rng.random() < 0.5:
        names.reverse()
    inner = length - 4 * WALL_M
    share = {"kitchen": between(rng, (0.3, 0.34)), "bathroom": between(rng, (0.24, 0.27))}
    share["bedroom"] = 1.0 - sum(share.values())
    living_y = round(0.5 * (front - width), 3)
    living = Room("living_room", "living_room", (0.0, living_y), (length, front, height))
    living = _open(living, find_room_type("living_room", ""), (0, 1, 2), 1, rng)
    rooms, x = [], -0.5 * length
    back_y = round(0.5 * (width - back), 3)
    for name in names:
        wide = round(inner * share[name], 3)
        middle = round(x + 0.5 * wide, 3)
        along = round(between(rng, (-0.5, 0.5)) * (wide - DOOR_M[0] - 0.5), 3)
        room = Room(name, name, (middle, back_y), (wide, back, height))
        # Wall 1 of the back rooms is wall 3 of the living room; they count in opposite senses.
        door = Opening("door", 1, along, DOOR_M[0], 0.0, DOOR_M[1])
        room = Room(*_head(room), (door,))
        world_x = room.at_wall(1, along, 0.0)[0]
        other = Opening(
            "door",
            3,
            round(world_x - living.center_m[0], 3),
            DOOR_M[0],
            0.0,
            DOOR_M[1],
            framed=False,
        )
        living = Room(*_head(living), (*living.openings, other))
        outer = [3, *([0] if name == names[0] else []), *([2] if name == names[-1] else [])]
        rooms.append(_open(room, find_room_type(name, ""), outer, 0, rng))
        x += wide + 2 * WALL_M
    return (living, *rooms)


def _head(room: Room) -> tuple[str, str, tuple[float, float], tuple[float, float, float]]:
    return room.name, room.kind, room.center_m, room.size_m


def _open(
    room: Room, rules: RoomType, walls: range | tuple[int, ...] | list[int], doors: int, rng: Rng
) -> Room:
    """The room with doors, then windows, in some of its walls, where they fit."""
    size = rules.door_m or DOOR_M
    for _ in range(doors):
        room = _add(
            room, "door", (size[0], 0.0, min(size[1], room.size_m[2] - 0.2)), list(walls), rng
        )
    for _ in range(draw_count(rng, rules.windows)):
        low = between(rng, rules.sill_m)
        if rules.clerestory:
            low = room.size_m[2] - 1.5
        high = min(room.size_m[2] - 0.25, low + between(rng, (1.2, 1.45)))
        if rules.french_windows and rng.random() < rules.french_windows:
            low = 0.1
        width = between(rng, rules.window_width_m)
        room = _add(room, "window", (width, low, high), list(walls), rng)
    return room


def _add(
    room: Room, kind: Opening_Kind, shape: tuple[float, float, float], walls: list[int], rng: Rng
) -> Room:
    width, low, high = shape
    for _ in range(_TRIES):
        wall = walls[min(int(rng.random() * len(walls)), len(walls) - 1)]
        free = room.wall_length_m(wall) - width - 2 * _ASIDE_M
        along = round((float(rng.random()) - 0.5) * free, 3)
        others = [o for o in room.openings if o.wall == wall]
        clear = all(
            abs(o.along_m - along) > 0.5 * (o.width_m + width) + 2 * _ASIDE_M for o in others
        )
        if free > 0.0 and clear and len(others) < 3:
            opening = Opening(kind, wall, along, width, round(low, 3), round(high, 3))
            return Room(*_head(room), (*room.openings, opening))
    return room


def walls_of(room: Room) -> Iterator[tuple[int, tuple[Opening, ...]]]:
    """Yield each wall and its openings."""
    for wall in range(4):
        yield wall, tuple(o for o in room.openings if o.wall == wall)


def outer_radius_m(rooms: tuple[Room, ...]) -> float:
    """Radius around the world's origin that holds all rooms."""
    return max(
        math.hypot(abs(r.center_m[0]) + 0.5 * r.size_m[0], abs(r.center_m[1]) + 0.5 * r.size_m[1])
        for r in rooms
    )
