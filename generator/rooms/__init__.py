"""Rooms: rules, floor plans, layouts, and the bodies of their shells and furniture."""

from typing import Any

from gen_data.core.plugins import PluginTable

TABLE = PluginTable[Any](
    "room_place",
    {
        "above": "gen_data.rooms.places:ABOVE",
        "across": "gen_data.rooms.places:ACROSS",
        "around": "gen_data.rooms.places:AROUND",
        "below": "gen_data.rooms.places:BELOW",
        "beside": "gen_data.rooms.places:BESIDE",
        "ceiling": "gen_data.rooms.places:CEILING",
        "corner": "gen_data.rooms.places:CORNER",
        "door": "gen_data.rooms.places:DOOR",
        "free": "gen_data.rooms.places:FREE",
        "front": "gen_data.rooms.places:FRONT",
        "hang": "gen_data.rooms.places:HANG",
        "on": "gen_data.rooms.places:ON",
        "over": "gen_data.rooms.places:OVER",
        "under": "gen_data.rooms.places:UNDER",
        "wall": "gen_data.rooms.places:WALL",
        "window": "gen_data.rooms.places:WINDOW",
    },
)
"""Places of pieces in rooms, each a ``Place``: ``place`` in the rows of ``room_types.yaml``."""
