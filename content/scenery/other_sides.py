"""Side walls and backs of buildings; in a wall's frame, see ``facade``."""

from dataclasses import replace

from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.scenery import facade, shop_fronts, street_side
from gen_data.content.scenery import facade_fittings as fittings
from gen_data.content.scenery.basic_shapes import post
from gen_data.content.scenery.building_designs import Design
from gen_data.content.scenery.facade import BASE, DOOR, FACADE, METAL, TRIM, Opening
from gen_data.content.scenery.facade_shapes import ledges
from gen_data.core.variant_rng import VariantRng


def side(plan: Design, rng: VariantRng) -> Patch:
    """A side wall: with windows, or a firewall where the next house of a row may stand."""
    if not plan.sided:
        return _firewall(plan, rng)
    wall = plain_wall(plan, plan.depth_m, max(2, round(plan.depth_m / 4.0)), rng)
    extras = []
    half = 0.5 * plan.depth_m
    if rng.chance(0.3 * plan.age):
        extras.append(fittings.ivy((-half, rng.between(-0.3, 0.3) * half), 0.7 * plan.eaves_m, rng))
    if plan.style == "warehouse" and rng.chance(0.5):
        extras += fittings.graffiti((-half + 0.5, half - 0.5), rng)
    return join_patches([wall, *extras])


def _firewall(plan: Design, rng: VariantRng) -> Patch:
    """A wall without windows, or with a few small ones; an advert, ivy, repairs, graffiti."""
    half, top = 0.5 * plan.depth_m, plan.eaves_m
    holes, parts = [], []
    kind = rng.choose(("windows", "windows", "advert", "ivy", "repairs", "repairs"))
    if kind == "windows":
        column = rng.between(-0.6, 0.6) * half
        for floor in range(1, plan.floors):
            z = plan.ground_m + (floor - 1) * plan.storey_m + 1.0
            w = rng.choose((0.5, 0.8, 0.8))
            holes.append(Opening((column, column + w), (z, z + 1.0), 0.12, 1))
            if rng.chance(0.3) and column < 0.3 * half:
                far = column + 2.2
                holes.append(Opening((far, far + w), (z, z + 1.0), 0.12, 1))
        parts += [join_patches([facade.window(o, rng), facade.sill(o)]) for o in holes]
    elif kind == "advert":
        size = min(0.8 * 2.0 * half, top - 3.5, rng.between(3.5, 7.0))
        if size > 2.0:
            at = (rng.between(-half + 0.3, half - 0.3 - size), rng.between(2.6, top - size - 0.4))
            y, z = at
            rim = [(0.0, 0.06, y - 0.1, y + size + 0.1, z - 0.1, z + size + 0.1)]
            parts += [ledges(rim, METAL), shop_fronts.poster(0.065, at, size, rng)]
    elif kind == "ivy":
        wide = rng.between(0.5, 1.6) * half
        a = rng.between(-half, half - wide)
        parts.append(fittings.ivy((a, a + wide), rng.between(0.5, 0.95) * top, rng))
    else:
        parts += fittings.repairs((-half + 0.3, half - 0.3), (0.4, top - 0.4), 1.0 + plan.age, rng)
    if rng.chance(0.4) and kind != "ivy":
        parts += fittings.graffiti((-half + 0.4, half - 0.4), rng)
    if rng.chance(0.4):
        vent = rng.between(-half + 0.5, half - 0.5)
        parts.append(post(0.09, (2.2, top + 0.4), (0.14, vent, 0.0), 6).painted(METAL))
    return join_patches([facade.cut_openings((-half, half), (0.0, top), holes), *parts])


def back(plan: Design, rng: VariantRng) -> Patch:
    """The rear: plain windows, a door, balconies or a fire ladder, air conditioners."""
    parts = [plain_wall(plan, plan.width_m, max(2, plan.bays - 2), rng)]
    half = 0.5 * plan.width_m
    if rng.chance(0.6):
        side = rng.choose((0.12 - half, half - 0.12))
        parts.append(post(0.05, (0.0, plan.eaves_m - 0.1), (0.08, side, 0.0), 6).painted(METAL))
    if plan.floors in (2, 3, 4, 5) and rng.chance(0.4):
        pitch = plan.width_m / max(2, plan.bays - 2)
        y = -half + pitch
        for floor in range(1, plan.floors):
            level = plan.ground_m + (floor - 1) * plan.storey_m
            y_m = (max(-half, y - 0.45 * pitch), min(half, y + 0.45 * pitch))
            parts.append(facade.balcony(y_m, level, 1.2, solid=True))
            parts += fittings.balcony_things(y_m, level, 1.2, rng) if rng.chance(0.5) else []
    elif rng.chance(plan.fittings) and plan.floors > 1:
        z = plan.ground_m + 0.1
        parts.append(fittings.air_conditioner(rng.between(-half + 0.3, half - 1.3), z, rng))
    return join_patches(parts)


def plain_wall(plan: Design, width_m: float, bays: int, rng: VariantRng) -> Patch:
    """A wall of plain windows in line, with some left out; a band per floor for ribbons."""
    half, w = 0.5 * width_m, min(1.1, plan.window_m[0])
    h = min(1.4, plan.window_m[1])
    if plan.ribbons:
        holes, parts = street_side.ribbons(plan, (-half, half), rng)
        pieces = [facade.cut_openings((-half, half), (0.0, plan.eaves_m), holes), *parts]
        return join_patches(pieces)
    holes, parts = [], []
    skipped = rng.choose((0.0, 0.1, 0.3))
    for floor in range(plan.floors):
        level = plan.ground_m + (floor - 1) * plan.storey_m if floor else 0.2
        for k in range(bays):
            y = -half + width_m * (k + 0.5) / bays
            if rng.chance(skipped):
                continue
            high = min(h, (plan.storey_m if floor else plan.ground_m - 0.2) - 1.1)
            small = 0.6 if rng.chance(0.15) else 1.0
            z = level + 0.9 + (1.0 - small) * high
            hole = Opening((y - 0.5 * w * small, y + 0.5 * w * small), (z, z + small * high), 0.12)
            hole = replace(hole, upright=plan.panes[0] if small == 1.0 else 1)
            holes.append(hole)
            parts.append(_plain_window(plan, hole, rng))
    base = (0.3, BASE) if plan.style != "tower" else None
    wall = facade.cut_openings((-half, half), (0.0, plan.eaves_m), holes, FACADE, base)
    return join_patches([wall, *parts])


def _plain_window(plan: Design, hole: Opening, rng: VariantRng) -> Patch:
    if plan.floors > 8:
        return street_side.fitted_window(plan, hole, rng)
    parts = [facade.window(hole, rng), facade.sill(hole)]
    if plan.shutters == "leaves" and rng.chance(0.7):
        parts.append(facade.leaves(hole))
    return join_patches(parts)


def gate(plan: Design, rng: VariantRng) -> Patch:
    """A fence or wall between the building and its neighbour, along +Y from y = 0 at x = 0."""
    long, high = plan.gate_m, rng.between(1.1, 2.0)
    kind = rng.choose(("boards", "wall", "rail"))
    if kind == "wall":
        body = ledges([(-0.2, 0.0, 0.0, long, 0.0, high)], BASE)
        rear = ledges([(-0.2, 0.0, -long, 0.0, 0.0, high)], BASE).rotated("z", 3.141592653589793)
        cope = ledges([(-0.24, 0.04, 0.0, long, high, high + 0.06)], TRIM)
        return join_patches([body, rear.moved(x=-0.2), cope])
    if kind == "rail":
        return facade.railing((0.0, long), min(0.4, high - 1.0), -0.05)
    slot = rng.choose((DOOR, TRIM))
    count = max(3, round(long / 0.16))
    step = long / count
    boards = [(-0.06, -0.03, k * step, k * step + 0.9 * step, 0.05, high) for k in range(count)]
    front = ledges(boards, slot)
    rear = ledges([(-0.09, -0.06, 0.0, long, z, z + 0.08) for z in (0.3, high - 0.3)], slot)
    return join_patches([front, front.flipped().moved(x=-0.004), rear])
