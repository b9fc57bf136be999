"""Level crossings: rails and panels across a road; ``scenery.railway`` has the adjacent track."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural.patches import Patch
from gen_data.content.roads import road, road_materials
from gen_data.content.roads.deck import PAINT_LIFT_M, Deck
from gen_data.roads.cross_section import RoadShape, strips

GAUGE_M, HEAD_M = 1.435, 0.072
"""Standard gauge, and the head of the rail 60E1: 72 mm, 172 mm high (EN 13674-1, by the tables of
makers: Rail Section Properties, EN13674-1:2011; GNEE Rail)."""
PANEL_M = 3.2
"""Length of the crossing's surface along the road."""
_STOP_M = 3.5
"""Distance of the stop lines from the middle of the track (assumed)."""


def level_crossing(*, station_m: float = 60.0, **others: Any) -> Solid:
    """Panels, rails and grooves across a road, and stop lines, in the road's frame.

    Args:
        station_m: Middle of the track along the road.
        others: Fields of ``StreetLook`` and of ``RoadShape``, as for the road.
    """
    look, shape = road_materials.split_look(others)
    profile = RoadShape(**shape)
    deck = road.make_deck(profile, look)
    right, left = (_edge_m(profile, side) for side in (-1, 1))
    across = deck.columns_between(-right, left)
    start = station_m - 0.5 * PANEL_M
    patches = [
        deck.ribbon((start + k * PANEL_M / 4, start + (k + 1) * PANEL_M / 4 - 0.015), across,
                    "kerb", 0.004)
        for k in range(4)
    ]  # fmt: skip
    patches += _rails(deck, station_m, across)
    sign = 1.0 if profile.traffic == "right" else -1.0
    inner = 0.5 * profile.median_m + 0.1
    edges = ((-1.0, -sign * profile.carriageway_m(-1)), (1.0, sign * profile.carriageway_m(1)))
    for way, edge in edges:
        t = sorted((way * sign * inner, edge - way * sign * 0.15))
        s = station_m + way * _STOP_M
        line = deck.columns_between(t[0], t[1])
        patches.append(deck.ribbon((s - 0.25, s + 0.25), line, "marking", PAINT_LIFT_M))
    points = np.concatenate([patch.corners_m.reshape(-1, 3) for patch in patches])
    (x0, y0, z0), (x1, y1, z1) = points.min(axis=0), points.max(axis=0)
    ground = np.array([[x, y, z] for x in (x0, x1) for y in (y0, y1) for z in (z0 - 0.02, z1)])
    return road_materials.make_street_solid(patches, look, [ground])


def _edge_m(profile: RoadShape, side: int) -> float:
    """Distance of the outer edge of a sidewalk or verge, without the land before houses."""
    row = [strip for strip in strips(profile, side) if strip.kind != "garden"]
    return row[-1].outer_m if row else 0.0


def _rails(deck: Deck, station_m: float, across: tuple[float, ...]) -> Iterator[Patch]:
    """Heads of both rails and the grooves for flanges on their inner sides."""
    for way in (-1.0, 1.0):
        inner = station_m + way * 0.5 * GAUGE_M
        for slot, near, far in (("rail", 0.0, HEAD_M), ("groove", -0.06, 0.0)):
            a, b = sorted((inner + way * near, inner + way * far))
            yield deck.ribbon((a, b), across, slot, 0.006)
