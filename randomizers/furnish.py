"""Furnished rooms: sizes, openings, surfaces and furniture by the rules of their type."""

import math
from collections import Counter
from dataclasses import replace
from typing import Annotated, Literal

from gen_data.assets.families import declared
from gen_data.config import distributions as dist
from gen_data.core.asset_types import Material
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Region, Scene
from gen_data.core.se3 import Vec3
from gen_data.core.streams import Rng
from gen_data.randomizers.base import RandomizerBase, choose, find_textures
from gen_data.randomizers.color_space import hsv_to_linear
from gen_data.rooms import bodies, furnishing, layout, outlook
from gen_data.rooms.floor_plan import Room, between, draw_plan
from gen_data.rooms.options import families_of, find_options
from gen_data.rooms.rules import APARTMENT, Range, find_room_type, room_types

TRIES, TRIES_PER_ROOM = 12, 3
"""Floor plans tried before the scene is rejected, and layouts of each of their rooms."""
_DOOR_STYLES = 4
_PALE_WALLS, _ACCENTS = 0.87, 0.15
"""Shares of rooms whose walls are near white, and of those where one wall stands out."""
_BLINDS = 0.45
"""Share of rooms with blinds."""


class Furnish(RandomizerBase):
    """Draws a room: size, openings, surfaces, and furniture by the rules of its type.

    Layouts keep these constraints: nothing overlaps; pieces that need a wall touch it; the floor
    before doors and before fronts that open is free; windows are not hidden; every door and every
    such front can be reached by a person.

    Attributes:
        room: Name of the template's ``room_layout`` element.
        length_m, width_m, height_m: Inner size along X, Y and Z; by default the type's.
        clutter: Factor on the numbers of small objects.
    """

    type: Literal["furnish"] = "furnish"
    stage: Literal["scene"] = "scene"
    room: str = "room"
    length_m: dist.Positive | None = None
    width_m: dist.Positive | None = None
    height_m: Annotated[dist.Scalar, dist.Bounds(2.0, 12.0)] | None = None
    clutter: dist.NonNegative = dist.Uniform(0.6, 1.6)

    def possible_assets(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of assets outside, and texture files; the element's group lists the furniture."""
        return (*super().possible_assets(assets), *outlook.outlook_assets())

    def possible_textures(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of the textures of floors and walls of any type of room."""
        families = {"floor"}
        for rules in room_types().values():
            families |= {*rules.floor, *rules.walls, *rules.splashback, *rules.accent}
        return find_textures(assets, tuple(sorted(families)), f"randomizers.{self.name}")

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with the room redrawn.

        Raises:
            ConfigError: there is no such element.
            LayoutRejected: no layout keeps the rules.
        """
        kind, annotated = self._find_element(scene)
        field = f"randomizers.{self.name}.room"
        options = find_options(assets, families_of(kind, field))
        rooms, pieces = self._draw_layout(kind, options, assets, rng)
        scene = bodies.remove_room(scene, self.room)
        builder = bodies.Builder(scene, assets, self.room, annotated=annotated)
        looks = {room.name: self._draw_looks(room, assets, rng) for room in rooms}
        builder.add_shells(
            rooms, looks, {room.name: placed for room, placed in zip(rooms, pieces, strict=True)}
        )
        builder.add_outlook(outlook.draw_outlook(rooms, rng))
        parts = _moving_parts(assets)
        for room, placed in zip(rooms, pieces, strict=True):
            builder.add_pieces(room, placed, parts)
        low, high = _interior(rooms)
        middle = tuple(0.5 * (a + b) for a, b in zip(low, high, strict=True))
        focus = Region((middle[0], middle[1], 0.9), (high[0] - low[0], high[1] - low[1], 1.4))
        return replace(builder.scene(), interior_m=(low, high), focus=focus)

    def _find_element(self, scene: Scene) -> tuple[str, bool]:
        """Type of the element's room, and whether its shell is annotated."""
        floors = [
            i
            for i in scene.instances
            if i.category == "floor" and i.name.startswith(f"{self.room}/")
        ]
        if not floors:
            raise ConfigError(
                f"randomizers.{self.name}.room: the template has no element '{self.room}' of type "
                "room_layout"
            )
        kinds = [dict(floor.attributes)["room"] for floor in floors]
        return kinds[0] if len(kinds) == 1 else APARTMENT, floors[0].annotated

    def _draw_layout(
        self, kind: str, options: dict[str, tuple[str, ...]], assets: AssetIndex, rng: Rng
    ) -> tuple[tuple[Room, ...], list[list[layout.Piece]]]:
        conflicts: Counter[tuple[str, str]] = Counter()
        clutter = self.clutter.draw(rng)
        for _ in range(TRIES):
            rooms = draw_plan(
                kind, self._draw_size(kind, rng), rng, f"randomizers.{self.name}.room"
            )
            made = []
            for room in rooms:
                pieces = _try_to_furnish(room, options, assets, rng, clutter, conflicts)
                if pieces is None:
                    break
                made.append(pieces)
            if len(made) == len(rooms):
                return rooms, made
        (piece, reason), count = conflicts.most_common(1)[0]
        total = sum(conflicts.values())
        raise self.reject(
            f"no layout keeps the rules; most often ({count} of {total}) {piece}: {reason}",
            "a larger length_m or width_m",
        )

    def _draw_size(self, kind: str, rng: Rng) -> tuple[Range, Range, Range] | None:
        given = (self.length_m, self.width_m, self.height_m)
        if all(one is None for one in given):
            return None
        usual = (
            ((8.6, 10.5), (7.2, 8.6), (2.45, 2.8))
            if kind == APARTMENT
            else find_room_type(kind, "").size_m
        )
        drawn = [
            limits if one is None else (round(one.draw(rng), 3),) * 2
            for one, limits in zip(given, usual, strict=True)
        ]
        return (drawn[0], drawn[1], drawn[2])

    def _draw_looks(self, room: Room, assets: AssetIndex, rng: Rng) -> bodies.Looks:
        rules = find_room_type(room.kind, "")
        field = f"randomizers.{self.name}"
        ground = choose(rules.floor, rng)
        floor = Material(
            (1.0, 1.0, 1.0),
            between(rng, declared(f"texture/{ground}", "floor_roughness", (0.8, 1.0))),
            texture=choose(find_textures(assets, (ground,), field), rng),
            texture_scale_m=between(
                rng, declared(f"texture/{ground}", "floor_repeat_m", (1.0, 1.6))
            ),
        )
        pale = rules.pale or rng.random() < _PALE_WALLS
        tint = _draw_pale(rng) if pale else _draw_muted(rng, 0.02, 0.07, (0.82, 0.94))
        wall = choose(rules.walls, rng)
        walls = self._draw_wall(wall, tint, assets, rng)
        white = 0.78 + 0.1 * float(rng.random())
        door, blind = int(rng.random() * _DOOR_STYLES), int(rng.random() * 2.0)
        looks = bodies.Looks(
            floor,
            walls,
            Material((white, white, white), 0.95),
            door,
            blind,
            _draw_blinds(room, rng),
        )
        if rules.splashback and wall != "tiles":
            behind = self._draw_wall(choose(rules.splashback, rng), tint, assets, rng)
            looks = replace(looks, splashback=behind)
        if not rules.accent or rng.random() >= _ACCENTS:
            return looks
        strong = _draw_muted(rng, 0.1, 0.32, (0.32, 0.75))
        accent = self._draw_wall(choose(rules.accent, rng), strong, assets, rng)
        return replace(looks, accent=accent, accent_wall=int(rng.random() * 4.0))

    def _draw_wall(self, family: str, tint: Vec3, assets: AssetIndex, rng: Rng) -> Material:
        """A wall covered by a drawn texture of a family; paint takes the tint."""
        options = find_textures(assets, (family,), f"randomizers.{self.name}")
        repeat_m = declared(f"texture/{family}", "wall_repeat_m", 1.4)
        roughness = declared(f"texture/{family}", "wall_roughness", 1.0)
        color = tint if family == "paint" else (1.0, 1.0, 1.0)
        return Material(color, roughness, texture=choose(options, rng), texture_scale_m=repeat_m)


def _draw_pale(rng: Rng) -> Vec3:
    """White, off-white, greige or pale grey: the darker, the more tinted."""
    hue, depth, cool = (float(rng.random()) for _ in range(3))
    saturation = (0.01 + 0.07 * depth) * (0.25 if cool < 0.25 else 1.0)
    hue = 0.55 + 0.08 * hue if cool < 0.25 else 0.08 + 0.07 * hue
    return hsv_to_linear(hue, saturation, 0.96 - 0.15 * depth * depth)


def _draw_muted(rng: Rng, low: float, high: float, values: Range) -> Vec3:
    """Any hue from orange to blue with a saturation in the given range; purples are rare."""
    return hsv_to_linear(
        between(rng, (0.05, 0.68)), between(rng, (low, high)), between(rng, values)
    )


def _draw_blinds(room: Room, rng: Rng) -> tuple[float, ...]:
    """Share of each opening that a blind covers; rooms have blinds at all windows or at none."""
    has_blinds = find_room_type(room.kind, "").blinds and rng.random() < _BLINDS
    shares = [round(0.08 + 0.55 * float(rng.random()) ** 2, 3) for _ in room.openings]
    return tuple(
        share if has_blinds and opening.kind == "window" else 0.0
        for opening, share in zip(room.openings, shares, strict=True)
    )


def _try_to_furnish(
    room: Room,
    options: dict[str, tuple[str, ...]],
    assets: AssetIndex,
    rng: Rng,
    clutter: float,
    conflicts: Counter[tuple[str, str]],
) -> list[layout.Piece] | None:
    """Pieces of a room; None if no layout of several keeps the rules. Conflicts are counted."""
    rules = find_room_type(room.kind, "")
    for _ in range(TRIES_PER_ROOM):
        try:
            return furnishing.furnish(room, rules, options, assets, rng, clutter)
        except layout.Conflict as conflict:
            conflicts[f"{room.kind}: {conflict.piece}", conflict.reason] += 1
    return None


def _moving_parts(assets: AssetIndex) -> dict[str, tuple[str, str]]:
    """Name of the part and its family, by the family of its piece."""
    found = {}
    for asset in assets.find(("part_of",)):
        family = asset.asset_id.partition("?")[0]
        piece, _, part = family.rpartition("/")
        if part in bodies.JOINTS:
            found[piece] = (part, family)
    return found


def _interior(rooms: tuple[Room, ...]) -> tuple[Vec3, Vec3]:
    low, high = [math.inf, math.inf], [-math.inf, -math.inf]
    for room in rooms:
        for axis in (0, 1):
            half = 0.5 * room.size_m[axis]
            low[axis] = min(low[axis], room.center_m[axis] - half)
            high[axis] = max(high[axis], room.center_m[axis] + half)
    return (low[0], low[1], 0.0), (high[0], high[1], rooms[0].size_m[2])
