"""Place of pieces in rooms: a quarter of the room's length from its middle."""

from gen_data.rooms.layout import Layout, Options
from gen_data.rooms.places import Place, draw_asset
from gen_data.rooms.rules import Rule


def put_at_quarters(layout: Layout, rule: Rule, options: Options, wanted: int) -> int:
    """Place up to two pieces on the X axis of the room, square to its walls."""
    (x, y), (length_m, _, _) = layout.room.center_m, layout.room.size_m
    return sum(
        layout.put(
            rule, draw_asset(layout, rule, options), (x + side * 0.25 * length_m, y), 0.0, 0.0
        )
        for side in (-1, 1)[:wanted]
    )


PLACE = Place(put_at_quarters)
