"""Bus shelters, telephone boxes, petrol stations and level crossings.

Sizes: assumed from makers' catalogues and pictures, 10 %, where no source is named.
"""

import math
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets as presets
from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.procedural.surface_shapes import block, cone, grid, rounded_box, sweep
from gen_data.content.scenery.basic_shapes import facing_rectangle, make_solid, post
from gen_data.content.scenery.clutter_shapes import rod, worn_paint, worn_steel
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, variant_rng

ROOFS = ("flat", "vault", "pitched", "flat", "cantilever", "vault")
PHONES = ("glass", "paned", "pillar", "glass", "pillar", "paned")
_GLASS = Material((0.9, 0.95, 0.93), roughness=0.05, transmission=1.0, role="glass")


def bus_shelter(rng: VariantRng) -> Solid:
    """A shelter open to +X with a seat, an advertisement and a stop sign in front.

    Slots: frame, glass, roof, seat, two prints, sign.
    """
    kind = rng.turn(ROOFS, "roof")
    half = 0.5 * rng.between(3.0, 5.0, "width_m")
    x = 0.5 * rng.between(1.3, 1.7, "depth_m")
    high = rng.between(2.3, 2.5, "height_m")
    bays = 3 if half < 2.1 else 4
    edges = np.linspace(-half, half, bays + 1).tolist()
    parts = [block((-x - 0.03, y - 0.03, 0.0), (-x + 0.03, y + 0.03, high)) for y in edges]
    if kind != "cantilever":
        fronts = (-half, half)
        parts += [block((x - 0.35, y - 0.03, 0.0), (x - 0.29, y + 0.03, high)) for y in fronts]
    for a, b in pairwise(edges):
        pane = block((-x - 0.005, a + 0.05, 0.15), (-x + 0.005, b - 0.05, high - 0.15), 0.0, 1)
        parts.append(pane)
        parts += [block((-x - 0.015, a, z), (-x + 0.015, b, z + 0.03)) for z in (0.12, high - 0.15)]
    ends = (-half, half) if rng.chance(0.6) else (half,)
    for y in ends:
        parts.append(block((-x + 0.05, y - 0.005, 0.15), (x - 0.4, y + 0.005, high - 0.15), 0.0, 1))
    parts += [*_shelter_roof(kind, x, half, high), *_seat(x, half, rng)]
    # An advertisement stands across the end of the waiting area.
    low = 0.35
    panel = rounded_box((1.3, 0.16, 1.9), 0.03, 1).moved(-x + 0.72, -half + 0.1, low + 0.95)
    parts.append(panel)
    face = facing_rectangle(0.082, (-0.58, 0.58), (low + 0.08, low + 1.8))
    for turn, slot in ((0.5 * math.pi, 4), (-0.5 * math.pi, 5)):
        parts.append(face.painted(slot).rotated("z", turn).moved(-x + 0.72, -half + 0.1))
    parts.append(facing_rectangle(-x + 0.012, (0.1, 0.7), (1.0, 1.75), 5))
    parts += _stop_sign(x + 0.1, half - 0.3)
    color = worn_paint(("#2f3234", "#3b3d3f", "#6b7073", "#2f4236", "#8d9091"), 0.45, rng)
    wood = presets.patterned_material("texture/wood_grain?seed=2", 1.2, 0.7, (0.8, 0.75, 0.7))
    prints = [
        presets.printed_material(f"texture/poster?seed={(5 * rng.seed + k) % 12}", 0.35)
        for k in range(2)
    ]
    roof = worn_paint(("#5f6365", "#3b3d3f", "#c9cccb", "#7a2a24"), 0.5, rng)
    sign = presets.painted_material(rng.choose(("#2f7a3a", "#d9a520", "#1f5fa8", "#b3261e")), 0.4)
    materials = (color, _GLASS, roof, rng.choose((wood, color)), *prints, sign)
    walls = [
        hulls.box((-x - 0.03, -half, 0.0), (-x + 0.03, half, high)),
        hulls.box((-x, -half, high - 0.02), (x, half, high + 0.08)),
    ]
    return make_solid(parts, materials, walls)


def _shelter_roof(kind: str, x: float, half: float, high: float) -> list[Patch]:
    """A roof with overhang; slot 2."""
    y = half + 0.12
    if kind in {"flat", "cantilever"}:
        slab = block((-x - 0.1, -y, high), (x + 0.15, y, high + 0.09), 0.015, 2)
        return [slab.rotated("y", -0.05 if kind == "cantilever" else 0.0).moved(z=0.03)]
    if kind == "vault":
        turn = np.linspace(0.15 * math.pi, 0.85 * math.pi, 9)
        r = (x + 0.15) / math.cos(0.15 * math.pi)
        low = high - r * math.sin(0.15 * math.pi)
        outer = np.stack([r * np.cos(turn), low + r * np.sin(turn)], axis=1)
        inner = np.stack([0.97 * r * np.cos(turn), low + 0.97 * r * np.sin(turn)], axis=1)[::-1]
        outline: Array = np.concatenate([outer, inner])
        path = np.array([(0.0, y, 0.0), (0.0, -y, 0.0)])
        # The section's first axis is X, its second Z; its caps are not convex.
        shell = sweep(path, outline, up=(1.0, 0.0, 0.0), capped=False, slot=2)
        ends = [np.insert(p, 1, side, axis=1) for side in (-y, y) for p in (outer, inner[::-1])]
        caps = [
            grid(np.stack([ends[1], ends[0]]), slot=2),
            grid(np.stack([ends[2], ends[3]]), slot=2),
        ]
        return [shell, *caps]
    outline = np.array([(x + 0.15, high), (x + 0.15, high + 0.05), (0.0, high + 0.45),
                        (-x - 0.15, high + 0.05), (-x - 0.15, high)])  # fmt: skip
    path = np.array([(0.0, y, 0.0), (0.0, -y, 0.0)])
    return [sweep(path, outline, up=(1.0, 0.0, 0.0), slot=2)]


def _seat(x: float, half: float, rng: VariantRng) -> list[Patch]:
    """A bench of slats, or single seats; slot 3."""
    ys = (-0.35 * half, 0.55 * half)
    parts = [block((-x + 0.25, y - 0.025, 0.0), (-x + 0.3, y + 0.025, 0.44)) for y in ys]
    if rng.chance(0.5):
        for k in range(4):
            low = -x + 0.1 + 0.1 * k
            parts.append(block((low, -0.45 * half, 0.43), (low + 0.08, 0.65 * half, 0.46), 0, 3))
        return parts
    for y in np.arange(-0.4 * half, 0.6 * half, 0.55).tolist():
        shell = rounded_box((0.4, 0.44, 0.05), 0.02, 1).moved(-x + 0.32, y + 0.22, 0.45)
        parts.append(shell.painted(3))
    parts.append(block((-x + 0.24, -0.45 * half, 0.38), (-x + 0.31, 0.65 * half, 0.43)))
    return parts


def _stop_sign(x: float, y: float) -> list[Patch]:
    """A post with a round sign and a timetable; slots 0, 5 and 6."""
    disc = cone((0.2, 0.0), (0.2, 0.03), 18, 6).rotated("y", 0.5 * math.pi)
    box = block((x - 0.03, y - 0.2, 1.1), (x + 0.01, y + 0.2, 1.75))
    face = facing_rectangle(x + 0.012, (y - 0.18, y + 0.18), (1.13, 1.72), 5)
    return [post(0.03, (0.0, 2.7), (x - 0.05, y, 0.0)), disc.moved(x - 0.03, y, 2.55), box, face]


def phone_box(rng: VariantRng) -> Solid:
    """A telephone box: glass walls, small panes, or an open pillar with a hood.

    Slots: frame, glass, roof, telephone, notices.
    """
    kind = rng.turn(PHONES, "kind")
    half, high = 0.5 * rng.between(0.86, 0.96, "width_m"), rng.between(2.2, 2.45, "height_m")
    if kind == "pillar":
        parts = [
            block((-0.18, -0.3, 0.0), (-0.06, 0.3, 2.05), 0.02),
            block((-0.2, -0.42, 1.95), (0.45, 0.42, 2.1), 0.03, 2),
            *(block((-0.15, y - 0.015, 0.9), (0.4, y + 0.015, 1.95), 0.0, 1) for y in (-0.4, 0.4)),
        ]
    else:
        parts = _booth(half, high, rows=8 if kind == "paned" else 2)
    parts += [
        rounded_box((0.16, 0.3, 0.45), 0.02, 1).moved(-0.02, 0.0, 1.35).painted(3),
        rod([(0.08, -0.1, 1.5), (0.14, -0.14, 1.1), (0.09, -0.16, 1.42)], 0.012, 5, 3),
        facing_rectangle(-0.05 if kind == "pillar" else -half + 0.07, (0.18, 0.28), (1.2, 1.7), 4),
    ]
    colors = {
        "paned": ("#a31d1a", "#a31d1a", "#2f4a3a"),
        "glass": ("#8d9091", "#d9a520", "#b01f6a"),
    }
    frame = worn_paint(colors.get(kind, ("#55585a", "#b01f6a", "#2f5f9a")), 0.4, rng)
    materials = (
        frame,
        _GLASS,
        rng.choose((frame, presets.painted_material("#55585a", 0.5))),
        presets.painted_material("#26282a", 0.4),
        presets.printed_material(f"texture/poster?seed={rng.seed % 12}", 0.4),
    )
    return make_solid(parts, materials, [hulls.box((-half, -half, 0.0), (half, half, 2.0))])


def _booth(half: float, high: float, rows: int) -> list[Patch]:
    """Four posts, a roof, walls of panes on three sides and a door at +X."""
    parts = [
        block((-half, -half, 0.0), (half, half, 0.08), 0.01),
        block((-half - 0.04, -half - 0.04, high - 0.28), (half + 0.04, half + 0.04, high), 0.04, 2),
    ]
    for x in (-half, half - 0.06):
        for y in (-half, half - 0.06):
            parts.append(block((x, y, 0.08), (x + 0.06, y + 0.06, high - 0.27)))
    low, top = 0.12, high - 0.3
    for k in range(4):
        pane = block((half - 0.03, -half + 0.06, low), (half - 0.02, half - 0.06, top), 0.0, 1)
        parts.append(pane.rotated("z", 0.5 * math.pi * k))
        for z in np.linspace(low, top, rows + 1).tolist():
            sash = block(
                (half - 0.04, -half + 0.05, z - 0.015), (half - 0.01, half - 0.05, z + 0.015)
            )
            parts.append(sash.rotated("z", 0.5 * math.pi * k))
        if rows > 2:
            for y in (-0.3 * half, 0.3 * half):
                rail = block((half - 0.04, y - 0.01, low), (half - 0.01, y + 0.01, top))
                parts.append(rail.rotated("z", 0.5 * math.pi * k))
    return parts


def level_crossing_barrier(rng: VariantRng) -> Solid:
    """A half barrier of a level crossing, its boom along Y, lowered or (every third) raised.

    Traffic comes from +X. With lights and a saltire (Vienna Convention, A,28). Slots: red, white,
    grey, lens, black.
    """
    raised, reach = _is_raised(rng.seed), rng.between(3.5, 5.5, "reach_m")
    parts = [
        block((-0.22, -0.25, 0.0), (0.22, 0.25, 0.1), 0.01, 2),
        block((-0.18, -0.2, 0.1), (0.18, 0.2, 1.05), 0.02, 2),
        post(0.05, (0.0, 3.1), (-0.1, -0.55, 0.0)).painted(2),
    ]
    fields = round(reach / 0.5)
    boom = [block((0.19, -0.6, -0.09), (0.27, 0.0, 0.09), 0.01, 2)]
    for k in range(fields):
        a, b = reach * k / fields, reach * (k + 1) / fields
        boom.append(block((0.2, a, -0.06), (0.24, b, 0.06), 0.0, (k + 1) % 2))
    for part in boom:
        turned = part.rotated("x", 1.45 if raised else 0.0)
        parts.append(turned.moved(z=0.95))
    for turn in (0.62, -0.62):
        arm = block((0.0, -0.6, -0.07), (0.02, 0.6, 0.07), 0.0, 1)
        parts.append(arm.rotated("x", turn).moved(-0.04, -0.55, 2.75))
        for end in (-0.48, 0.48):
            tip = block((0.02, end - 0.12, -0.07), (0.022, end + 0.12, 0.07), 0.0, 0)
            parts.append(tip.rotated("x", turn).moved(-0.04, -0.55, 2.75))
    parts.append(block((-0.08, -0.72, 1.75), (-0.03, -0.38, 2.25), 0.01, 4))
    for z in (1.88, 2.12):
        lens = cone((0.09, 0.0), (0.07, 0.03), 14, 3).rotated("y", 0.5 * math.pi)
        parts.append(lens.moved(-0.03, -0.55, z))
    materials = (
        worn_paint(("#b9261c",), 0.4, rng),
        worn_paint(("#e8e7e2",), 0.4, rng),
        worn_steel(rng),
        Material((0.4, 0.02, 0.02), roughness=0.15, role="lamp"),
        presets.painted_material("#161718", 0.6),
    )
    hull = hulls.box((-0.22, -0.25, 0.0), (0.22, 0.25, 1.05))
    return make_solid(parts, materials, [hull])


def level_crossing_barrier_facts(seed: int) -> Facts:
    """Whether it is lowered."""
    return Facts("level_crossing", {"state": "raised" if _is_raised(seed) else "lowered"})


def _is_raised(seed: int) -> bool:
    return variant_rng("level_crossing_barrier", seed).turn((False, False, True), "raised")


def petrol_canopy(rng: VariantRng) -> Solid:
    """The canopy of a petrol station along Y, with islands of pumps below.

    Slots: fascia, ceiling, steel, pump body, pump front, hoses, kerb, lights, trim.
    """
    x, half, low = _canopy_m(rng)
    parts = [
        block((-x, -half, low), (x, half, low + 0.9), 0.03),
        block((-x + 0.05, -half + 0.05, low - 0.02), (x - 0.05, half - 0.05, low + 0.01), 0.0, 1),
        block((-x - 0.01, -half - 0.01, low + 0.12), (x + 0.01, half + 0.01, low + 0.3), 0.0, 8),
    ]
    for y in _islands_m(half):
        parts.append(block((-0.2, y - 0.2, 0.0), (0.2, y + 0.2, low), 0.0, 2))
        for side in (-1.6, 1.6):
            lamp = block((side - 0.3, y - 0.3, low - 0.05), (side + 0.3, y + 0.3, low - 0.02), 0, 7)
            parts.append(lamp)
        island = block((-2.3, y - 0.55, 0.0), (2.3, y + 0.55, 0.15), 0.03, 6)
        parts.append(island)
        for at in (-1.3, 1.3):
            parts += [part.moved(at, y, 0.15) for part in _pump()]
    brand = rng.choose(("#1f5fa8 #e9e9e4", "#d9a520 #b3261e", "#2f7a3a #e0c020", "#e9e9e4 #b3261e",
                        "#22406f #d9571e"))  # fmt: skip
    first, second = brand.split()
    materials = (
        worn_paint((first,), 0.4, rng),
        presets.painted_material("#d8d8d4", 0.5),
        worn_paint(("#c9cccb", "#8d9091"), 0.4, rng),
        worn_paint((first, "#e4e4e0"), 0.4, rng),
        presets.painted_material("#232527", 0.35),
        presets.painted_material("#121213", 0.6),
        presets.patterned_material("texture/concrete?seed=3", 1.8, 0.9),
        Material((0.85, 0.86, 0.84), roughness=0.3, role="lamp"),
        worn_paint((second,), 0.4, rng),
    )
    shells = [hulls.box((-x, -half, low), (x, half, low + 0.9))]
    return make_solid(parts, materials, shells)


def pump_islands_m(seed: int) -> tuple[float, ...]:
    """Places of the islands of pumps along Y, in the canopy's frame."""
    return _islands_m(_canopy_m(variant_rng("petrol_canopy", seed))[1])


def _canopy_m(rng: VariantRng) -> tuple[float, float, float]:
    """Half extents along X and Y, and the height below it."""
    depth_m, length_m = rng.between(7.0, 9.0, "depth_m"), rng.between(11.0, 16.0, "length_m")
    return 0.5 * depth_m, 0.5 * length_m, rng.between(4.5, 5.2, "clearance_m")


def _islands_m(half: float) -> tuple[float, ...]:
    count = 2 if half < 6.8 else 3
    return tuple(2.0 * half * ((k + 0.5) / count - 0.5) for k in range(count))


def _pump() -> list[Patch]:
    """A dispenser used from both sides along Y, with hoses."""
    parts = [
        block((-0.45, -0.26, 0.0), (0.45, 0.26, 1.55), 0.02, 3),
        block((-0.45, -0.3, 1.55), (0.45, 0.3, 2.1), 0.02, 3),
        block((-0.36, -0.305, 1.6), (0.36, 0.305, 2.0), 0.0, 4),
    ]
    for x in (-0.3, 0.3):
        for y in (-0.31, 0.31):
            hose = [(x, y, 2.0), (1.7 * x, y, 1.2), (1.5 * x, y, 0.5), (x, y, 1.15)]
            parts.append(rod(hose, 0.016, 4, 5))
            parts.append(block((x - 0.03, y - 0.03, 1.1), (x + 0.03, y + 0.03, 1.35), 0.0, 5))
    return parts
