"""The surface of the roads of an OpenDRIVE file."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.patches import Array, Patch
from gen_data.generator.assets.roads.deck import PAINT_LIFT_M, surface
from gen_data.generator.assets.roads.road_materials import (
    SLOT_OF,
    StreetLook,
    make_street_solid,
    number_slots,
)
from gen_data.generator.roads.lane_graph import stations
from gen_data.generator.roads.opendrive import Network, Road, Section
from gen_data.generator.roads.opendrive_lanes import heights_m, origin_m

_STEP_M = 2.5
_DASH_M, _GAP_M = 3.0, 6.0


def network_solid(network: Network) -> Solid:
    """Every lane as a strip, kerbs where heights differ, and the lane marks.

    Slots are those of ``street_materials``; the origin is ``origin_m``.
    """
    look = StreetLook()
    slots = number_slots(look)
    x, y = origin_m(network)
    patches: list[Patch] = []
    hulls: list[Array] = []
    for road in network.roads.values():
        for section in road.sections:
            patches += (p.moved(-x, -y) for p in _strips(road, section, slots))
            patches += (p.moved(-x, -y) for p in _marks(road, section, slots["marking"]))
            hulls += (hull - np.array([x, y, 0.0]) for hull in _hulls(road, section))
    return make_street_solid(patches, look, hulls)


def _strips(road: Road, section: Section, slots: dict[str, int]) -> Iterator[Patch]:
    s = stations(section.start_m, section.end_m, _STEP_M)
    edges = road.boundaries_m(section, s)
    for side in (1, -1):
        below = np.zeros(len(s))
        for number in sorted((n for n in section.lanes if n * side > 0), key=abs):
            lane = section.lanes[number]
            inner, outer = (np.full(len(s), h) for h in heights_m(lane))
            t_in, t_out = edges[number - side], edges[number]
            if abs(float(inner[0] - below[0])) > 1e-6:
                yield _band(road, s, (t_in, t_in), (below, inner), side, "kerb", slots)
            if float(np.abs(t_out - t_in).max()) > 1e-3:
                slot = SLOT_OF.get(lane.kind, "asphalt")
                yield _band(road, s, (t_in, t_out), (inner, outer), side, slot, slots)
            below = outer


def _band(
    road: Road,
    s_m: Array,
    t_m: tuple[Array, Array],
    lift_m: tuple[Array, Array],
    side: int,
    slot: str,
    slots: dict[str, int],
) -> Patch:
    """A strip from its inner to its outer edge; counter-clockwise seen from above."""
    lines = [road.points(s_m, t, lift) for t, lift in zip(t_m, lift_m, strict=True)]
    lines = lines if side > 0 else lines[::-1]
    points = np.stack(lines, axis=1)
    # The plan is the world's, so that roads that overlap in a junction show one surface.
    plan = points[..., :2] + points[..., 2:] * np.array([1.0, 1.0])
    return surface(points, plan, slot, slots[slot])


def _marks(road: Road, section: Section, slot: int) -> Iterator[Patch]:
    whole = stations(section.start_m, section.end_m, _STEP_M)
    for number, lane in section.lanes.items():
        if lane.mark.kind in ("none", "curb", "grass", "edge", "custom") or road.junction:
            continue
        broken = lane.mark.kind.startswith("broken")
        for s in _dashes(section) if broken else (whole,):
            t = road.boundaries_m(section, s)[number]
            lift = np.full(len(s), PAINT_LIFT_M + heights_m(lane)[1] * (number != 0))
            half = 0.5 * lane.mark.width_m
            points = np.stack([road.points(s, t - half, lift), road.points(s, t + half, lift)], 1)
            plan = np.stack([np.stack([s, t - half], 1), np.stack([s, t + half], 1)], axis=1)
            yield surface(points, plan, "marking", slot)


def _dashes(section: Section) -> Iterator[Array]:
    start = section.start_m + 0.5 * _GAP_M
    while start + 1.0 < section.end_m:
        yield stations(start, min(start + _DASH_M, section.end_m), _STEP_M)
        start += _DASH_M + _GAP_M


def _hulls(road: Road, section: Section) -> Iterator[Array]:
    """Slabs of at most 20 m under each side of a road."""
    s = stations(section.start_m, section.end_m, 20.0)
    edges = road.boundaries_m(section, s)
    low, high = edges[min(edges)], edges[max(edges)]
    flat = np.zeros(len(s))
    right, left = road.points(s, low, flat), road.points(s, high, flat)
    for k in range(len(s) - 1):
        top = np.stack([right[k], right[k + 1], left[k], left[k + 1]])
        if float(np.abs(high - low)[k : k + 2].max()) > 0.01:
            yield np.concatenate([top, top - np.array([0.0, 0.0, 0.3])])
