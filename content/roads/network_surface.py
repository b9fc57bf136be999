"""The surface of the roads of an OpenDRIVE file."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.roads import deck, road_materials
from gen_data.roads.lane_graph import stations
from gen_data.roads.opendrive import Network, Road, Section
from gen_data.roads.opendrive_lanes import heights_m, origin_m

_STEP_M = 2.5
_DASH_M, _GAP_M = 3.0, 6.0
_SHAPED_PARTS = 4


def network_solid(network: Network) -> Solid:
    """Every lane as a strip, kerbs where heights differ, and the lane marks.

    Slots as in ``street_materials``; the origin is ``origin_m``.
    """
    look = road_materials.StreetLook(center_color="yellow")
    slots = road_materials.number_slots(look)
    x, y = origin_m(network)
    patches: list[Patch] = []
    hulls: list[Array] = []
    for road in network.roads.values():
        for section in road.sections:
            patches += (p.moved(-x, -y) for p in _strips(road, section, slots))
            if section.start_m == section.origin_m:
                # Parts of a section of the file have the same marks.
                patches += (p.moved(-x, -y) for p in _marks(road, section, slots))
            hulls += (hull - np.array([x, y, 0.0]) for hull in _hulls(road, section))
    return road_materials.make_street_solid(patches, look, hulls)


def _strips(road: Road, section: Section, slots: dict[str, int]) -> Iterator[Patch]:
    s = road.stations(section.start_m, section.end_m, _STEP_M)
    edges = road.boundaries_m(section, s)
    for side in (1, -1):
        below = np.zeros(len(s))
        for number in sorted((n for n in section.lanes if n * side > 0), key=abs):
            lane = section.lanes[number]
            inner, outer = (np.full(len(s), h) for h in heights_m(lane))
            t_in, t_out = edges[number - side], edges[number]
            kerb = _Band(road, section, s, side, slots)
            if abs(float(inner[0] - below[0])) > 1e-6:
                yield kerb.patch((t_in, t_in), (below, inner), "kerb")
            if float(np.abs(t_out - t_in).max()) > 1e-3:
                slot = road_materials.SLOT_OF.get(lane.kind, "asphalt")
                # A profile that bends within a lane takes several strips.
                parts = _SHAPED_PARTS if road.shape_m.stations else 1
                shares = np.linspace(0.0, 1.0, parts + 1)
                t = [t_in + share * (t_out - t_in) for share in shares[:-1]] + [t_out]
                lift = [inner + share * (outer - inner) for share in shares[:-1]] + [outer]
                for k in range(parts):
                    yield kerb.patch((t[k], t[k + 1]), (lift[k], lift[k + 1]), slot)
            below = outer


@dataclass(frozen=True)
class _Band:
    """Strips along one side of a section; ``slots`` are slot numbers by material."""

    road: Road
    section: Section
    s_m: Array
    side: int
    slots: dict[str, int]

    def patch(self, t_m: tuple[Array, Array], lift_m: tuple[Array, Array], slot: str) -> Patch:
        """A strip from its inner to its outer edge; counter-clockwise seen from above."""
        lines = [
            self.road.points(self.section, self.s_m, t, lift)
            for t, lift in zip(t_m, lift_m, strict=True)
        ]
        lines = lines if self.side > 0 else lines[::-1]
        points = np.stack(lines, axis=1)
        # Texture coordinates follow the world frame: overlapping roads in a junction show one
        # surface.
        plan = points[..., :2] + points[..., 2:] * np.array([1.0, 1.0])
        return deck.surface(points, plan, slot, self.slots[slot])


def _marks(road: Road, section: Section, slots: dict[str, int]) -> Iterator[Patch]:
    for number, lane in section.lanes.items():
        for start, end, mark in section.mark_spans(lane):
            for k, word in enumerate(() if road.junction else mark.lines):
                # Lines are listed from the inside out, in the centre from the left.
                first_m = mark.width_m * (len(mark.lines) - 1) * (-1 if number > 0 else 1)
                aside_m = first_m if k == 0 else -first_m
                whole = (road.stations(start, end, _STEP_M),)
                for s in _dashes(section.origin_m, start, end) if word == "broken" else whole:
                    t = road.boundaries_m(section, s)[number] + aside_m
                    lift = np.full(len(s), deck.PAINT_LIFT_M + heights_m(lane)[1] * (number != 0))
                    half = 0.5 * mark.width_m
                    sides = [road.points(section, s, t + i * half, lift) for i in (-1, 1)]
                    plan = np.stack([np.stack([s, t + i * half], 1) for i in (-1, 1)], axis=1)
                    slot = slots["center" if mark.is_yellow else "marking"]
                    yield deck.surface(np.stack(sides, 1), plan, "marking", slot)


def _dashes(origin_m: float, start_m: float, end_m: float) -> Iterator[Array]:
    """Stations of dashes between two arc lengths, in the rhythm of the whole section."""
    dash = origin_m + 0.5 * _GAP_M
    while dash + 1.0 < end_m:
        low, high = max(dash, start_m), min(dash + _DASH_M, end_m)
        if low + 1.0 < high:
            yield stations(low, high, _STEP_M)
        dash += _DASH_M + _GAP_M


def _hulls(road: Road, section: Section) -> Iterator[Array]:
    """Slabs of at most 20 m under each side of a road."""
    s = stations(section.start_m, section.end_m, 20.0)
    edges = road.boundaries_m(section, s)
    low, high = edges[min(edges)], edges[max(edges)]
    flat = np.zeros(len(s))
    right, left = (road.points(section, s, t, flat) for t in (low, high))
    for k in range(len(s) - 1):
        top = np.stack([right[k], right[k + 1], left[k], left[k + 1]])
        if float(np.abs(high - low)[k : k + 2].max()) > 0.01:
            yield np.concatenate([top, top - np.array([0.0, 0.0, 0.3])])
