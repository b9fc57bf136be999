"""Furnishing of rooms: pieces placed one after the other, by rejection from their rules."""

from collections import Counter

from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetIndex
from gen_data.core.streams import Rng
from gen_data.rooms import TABLE, places, reachability, small_objects
from gen_data.rooms.floor_plan import Room, direction, draw_count
from gen_data.rooms.layout import Conflict, Layout, Options, Piece
from gen_data.rooms.rules import RoomType

DOOR_ZONE_M = 0.95
"""Depth of the floor before doors that stays free: the swing of a leaf."""


def find_place(name: str) -> places.Place:
    """The place of that name.

    Raises:
        ConfigError: there is none, or a third-party object is not a Place.
    """
    place: object = TABLE.load(name)
    if not isinstance(place, places.Place):
        raise ConfigError(f"{TABLE.kind} '{name}': is not a gen_data.rooms.places.Place")
    return place


def furnish(
    room: Room, rules: RoomType, options: Options, assets: AssetIndex, rng: Rng, clutter: float
) -> list[Piece]:
    """Draw the pieces of a room.

    Args:
        room: The room with its openings.
        rules: Rules of its type.
        options: Ids of assets by family.
        assets: Their extents.
        rng: Random stream.
        clutter: Factor on the numbers of small objects.

    Raises:
        Conflict: a required piece has no place, or something cannot be reached.
    """
    layout = Layout(room, assets, rng, look=float(rng.random()))
    for opening in room.openings:
        if opening.kind == "door":
            x, y = room.at_wall(opening.wall, opening.along_m, 0.5 * DOOR_ZONE_M)
            c, s = direction(opening.wall)
            layout.zones.append(((x, y, c, s, 0.5 * DOOR_ZONE_M, 0.5 * opening.width_m + 0.05), -1))
    larger = room.size_m[0] * room.size_m[1] / rules.usual_area_m2
    for rule in rules.pieces:
        layout.refused = Counter()
        low, high = rule.count
        wanted = draw_count(rng, (low, high))
        place = find_place(rule.place)
        if rule.clutter:
            wanted = round(wanted * clutter)
        if rule.optional and place.scales:
            wanted = round(wanted * larger)
        placed = place.put(layout, rule, options, wanted)
        related = not rule.of or any(p.role in rule.of for p in layout.pieces)
        required = not rule.optional and not place.is_extra
        if placed < low and related and required:
            reason = layout.refused.most_common(1)
            raise Conflict(rule.piece, reason[0][0] if reason else "no place")
    unreachable = reachability.find_unreachable(
        layout, {rule.piece for rule in rules.pieces if rule.movable}
    )
    if unreachable:
        raise Conflict(unreachable, "cannot be reached from a door")
    for rule in rules.pieces:
        if rule.things or rule.inside:
            small_objects.put_small_objects(layout, rule, options, clutter)
    return layout.pieces
