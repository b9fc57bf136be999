"""A zebra crossing laid over a road."""

from __future__ import annotations

from typing import Any

import numpy as np

from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.patches import make_solid_in_place
from gen_data.generator.assets.roads.deck import PAINT_LIFT_M
from gen_data.generator.assets.roads.markings import ZEBRA_BAR_M
from gen_data.generator.assets.roads.road import make_deck
from gen_data.generator.assets.roads.road_materials import street_materials
from gen_data.generator.roads.cross_section import RoadShape


def crosswalk(
    *, seed: int = 0, wear: float = 0.3, station_m: float = 20.0, width_m: float = 4.0, **shape: Any
) -> Solid:
    """Bars across a road, in the road's frame, over asphalt that hides its other lines.

    Args:
        seed: Of textures; the road's own.
        wear: 0 freshly painted to 1 worn out; the road's own.
        station_m: Its middle, along the road.
        width_m: Along the road, the length of its bars.
        shape: Fields of ``RoadShape``.
    """
    profile = RoadShape(**shape)
    deck = make_deck(profile, seed, wear, "paving", "grass")
    low, high = -profile.carriageway_m(-1), profile.carriageway_m(1)
    span = (station_m - 0.5 * width_m, station_m + 0.5 * width_m)
    columns = deck.t_m[(deck.t_m > low + 0.4) & (deck.t_m < high - 0.4)]
    inner = (low + 0.36, *(float(t) for t in columns), high - 0.36)
    patches = [deck.ribbon(span, inner, "asphalt", PAINT_LIFT_M + 0.0008)]
    count = int((high - low - 1.5 * ZEBRA_BAR_M) // (2.0 * ZEBRA_BAR_M)) + 1
    first = 0.5 * (low + high) - (count - 0.5) * ZEBRA_BAR_M
    for k in range(count):
        t0 = first + 2.0 * k * ZEBRA_BAR_M
        t1 = t0 + ZEBRA_BAR_M
        bar = deck.columns_between(t0, t1)
        patches.append(deck.ribbon(span, bar, "marking", PAINT_LIFT_M + 0.002))
    s, t = np.meshgrid(span, [low, high], indexing="ij")
    top = deck.at(s, t).reshape(-1, 3)
    hull = np.concatenate([top, top - np.array([0.0, 0.0, 0.02])])
    materials = tuple(street_materials(seed, wear, "paving", "grass").values())
    return make_solid_in_place(patches, materials, [hull])
