"""Buildings: a facade grammar over a design.

A building is four walls and a roof. Each wall is split into floors, floors into bays, and every
bay gets an opening with a window, a door or a shop front. Origin: the centre of the walls'
footprint on the ground; the front wall lies at x = depth / 2 and faces +X. Sills, cornices,
balconies and awnings reach beyond it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from gen_data.generator.assets.procedural import collision_hulls as hulls
from gen_data.generator.assets.procedural.family import Facts, Solid
from gen_data.generator.assets.procedural.patches import Patch, join_patches
from gen_data.generator.assets.procedural.surface_shapes import block
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.assets.scenery import facade, roofs
from gen_data.generator.assets.scenery.basic_shapes import make_solid, post, quad
from gen_data.generator.assets.scenery.building_designs import (
    Design,
    building_materials,
    draw_design,
)
from gen_data.generator.assets.scenery.facade import BASE, FACADE, METAL, TRIM, Opening

_DOOR_M = (1.15, 2.5)
_EAVES_M = 0.45


def building(seed: int, style: str) -> Solid:
    """A building of a style; see ``facade`` for its material slots."""
    plan = draw_design(style, seed)
    rng = variant_rng(f"building/{style}/details", seed)
    # The rear has plain windows in every second bay or so.
    sides = [
        (0.0, _front(plan, rng), plan.depth_m),
        (math.pi, _plain_wall(plan, plan.width_m, max(2, plan.bays - 2), rng), plan.depth_m),
        *((k * 0.5 * math.pi, _side(plan, rng), plan.width_m) for k in (1, -1)),
    ]
    walls = [wall.moved(0.5 * across).rotated("z", turn) for turn, wall, across in sides]
    x, y = 0.5 * plan.depth_m, 0.5 * plan.width_m
    floor = quad([(-x, -y, 0.0), (-x, y, 0.0), (x, y, 0.0), (x, -y, 0.0)], BASE)
    roof = _roof(plan, rng).moved(z=plan.eaves_m)
    hull = hulls.box((-x, -y, 0.0), (x, y, plan.eaves_m + 0.5))
    return make_solid([*walls, floor, roof], building_materials(plan, seed), [hull])


def building_facts(seed: int, style: str) -> Facts:
    """Style and number of floors, without building it."""
    return Facts(style, {"floors": str(draw_design(style, seed).floors)})


def garage(seed: int) -> Solid:
    """A garage for one or two cars; the doors face +X."""
    rng = variant_rng("garage", seed)
    doors, deep, high = (rng.choose((1, 1, 2)), rng.between(5.6, 6.5), rng.between(2.5, 2.9))
    half = 0.5 * (doors * 3.0 + 0.2)
    plan = draw_design("house", seed)
    holes = [
        Opening((-half + 0.35 + 3.0 * k, -half + 2.85 + 3.0 * k), (0.02, 2.15), 0.12)
        for k in range(doors)
    ]
    front = [facade.cut_openings((-half, half), (0.0, high), holes)]
    front += [facade.garage_door(hole) for hole in holes]
    x = 0.5 * deep
    plain = facade.cut_openings((-half, half), (0.0, high))
    side = facade.cut_openings((-x, x), (0.0, high)).moved(half)
    walls = [join_patches(front).moved(x), plain.moved(x).rotated("z", math.pi)]
    walls += [side.rotated("z", k * 0.5 * math.pi) for k in (1, -1)]
    floor = quad([(-x, -half, 0.0), (-x, half, 0.0), (x, half, 0.0), (x, -half, 0.0)], BASE)
    roof = block((-x - 0.05, -half - 0.05, high), (x + 0.12, half + 0.05, high + 0.16), slot=METAL)
    hull = hulls.box((-x, -half, 0.0), (x, half, high + 0.16))
    return make_solid([*walls, floor, roof], building_materials(plan, seed), [hull])


def _front(plan: Design, rng: VariantRng) -> Patch:
    """The street side: ground floor, upper floors, and the bands between them."""
    half = 0.5 * plan.width_m
    ground = _shops(plan, rng) if plan.shops else _dwelling(plan, rng)
    holes, upper = _upper(plan, rng)
    parts = [ground, *upper, *_bands(plan, rng)]
    if plan.floors > 1:
        parts.append(facade.cut_openings((-half, half), (plan.ground_m, plan.eaves_m), holes))
    return join_patches(parts)


def _dwelling(plan: Design, rng: VariantRng) -> Patch:
    """A ground floor of windows and one entrance."""
    half, entrance = 0.5 * plan.width_m, int(rng.random() * plan.bays)
    plinth = 0.15 if plan.style in ("modern", "commercial") else rng.choose((0.35, 0.5, 0.6))
    w, h = plan.window_m
    holes, parts = [], []
    for k, y in enumerate(_bay_centres(plan)):
        if k == entrance:
            top = min(0.15 + _DOOR_M[1], plan.ground_m - 0.35)
            hole = Opening((y - 0.5 * _DOOR_M[0], y + 0.5 * _DOOR_M[0]), (0.15, top), 0.22)
            parts.append(facade.door(hole, rng))
            parts += _canopy(plan, y, top, rng)
        else:
            sill = max(plan.sill_m, plinth) + 0.12
            top = min(sill + h, plan.ground_m - 0.3)
            hole = _window(plan, y, sill, (w, top - sill))
            parts.append(_fitted_window(plan, hole, rng))
        holes.append(hole)
    slot = BASE if plan.trimmed else FACADE
    wall = facade.cut_openings((-half, half), (0.0, plan.ground_m), holes, slot, (plinth, BASE))
    return join_patches([wall, *parts])


def _shops(plan: Design, rng: VariantRng) -> Patch:
    """A ground floor of display windows, shop doors, signs and awnings."""
    half, margin = 0.5 * plan.width_m, 0.45
    count = max(2, round((plan.width_m - 2 * margin) / rng.between(2.8, 3.6)))
    pitch = (plan.width_m - 2 * margin) / count
    top = plan.ground_m - rng.between(1.0, 1.25)
    doors = {int(rng.random() * count), count - 1}
    slot = BASE if plan.trimmed else FACADE
    holes, parts = [], []
    for k in range(count):
        y0, y1 = -half + margin + k * pitch + 0.18, -half + margin + (k + 1) * pitch - 0.18
        if k in doors:
            y1 = y0 + 1.1
            hole = Opening((y0, y1), (0.03, top), 0.3)
            parts.append(facade.door(hole, rng, slot))
        else:
            hole = Opening((y0, y1), (0.03, top), 0.18, upright=rng.choose((1, 2)))
            parts.append(facade.shop_front(hole, rng, slot))
        holes.append(hole)
    wall = facade.cut_openings((-half, half), (0.0, plan.ground_m), holes, slot)
    return join_patches([wall, *parts, *_shop_signs(plan, top, rng)])


def _shop_signs(plan: Design, top_m: float, rng: VariantRng) -> list[Patch]:
    """A name above the windows of one or two shops, and awnings."""
    half = 0.5 * plan.width_m - 0.5
    split = rng.between(-0.2, 0.2) * plan.width_m if plan.width_m > 13.0 else half
    parts = []
    for y0, y1 in ((-half, split - 0.3), (split + 0.3, half)):
        if y1 - y0 < 3.0:
            continue
        long = min(y1 - y0, rng.between(3.0, 5.0))
        middle = 0.5 * (y0 + y1)
        z = (top_m + 0.12, top_m + 0.12 + 0.18 * long)
        # Signs are four times as wide as they are high, or so.
        z = (z[0], min(z[1], plan.ground_m - 0.1))
        parts.append(facade.sign_board((middle - 0.5 * long, middle + 0.5 * long), z))
        if rng.chance(0.4):
            parts.append(facade.awning((y0, y1), top_m + 0.08, rng.between(0.9, 1.3)))
    return parts


def _upper(plan: Design, rng: VariantRng) -> tuple[list[Opening], list[Patch]]:
    """Windows of the upper floors, all in line, and balconies before some of them."""
    centres = _bay_centres(plan)
    first, out_m = int(rng.random() * plan.bays), rng.between(1.1, 1.4)
    mirrored = plan.bays - 1 - first
    outside = {first, mirrored if abs(mirrored - first) > 1 else first}
    holes, parts = [], []
    for floor in range(1, plan.floors):
        level = plan.ground_m + (floor - 1) * plan.storey_m
        for k, y in enumerate(centres):
            if k == plan.oriel:
                continue
            tall = plan.balconies != "none" and k in outside
            w, h = plan.window_m
            hole = _window(plan, y, level + plan.sill_m, (w, h))
            if tall:
                head = level + plan.sill_m + h
                hole = _window(plan, y, level + 0.1, (w, head - level - 0.1))
            holes.append(hole)
            parts.append(_fitted_window(plan, hole, rng, bare=tall))
            if tall:
                parts.append(_balcony(plan, y, level + 0.08, out_m))
    if plan.oriel >= 0 and plan.floors > 1:
        parts.append(_oriel(plan, centres[plan.oriel], rng))
    return holes, parts


def _oriel(plan: Design, y: float, rng: VariantRng) -> Patch:
    """A bay that stands out over all upper floors, with a window on each."""
    half, out_m = 0.46 * plan.width_m / plan.bays, rng.between(0.6, 0.9)
    levels = [plan.ground_m + k * plan.storey_m for k in range(plan.floors - 1)]
    w = min(1.25 * plan.window_m[0], 2.0 * half - 0.4)
    holes = [_window(plan, y, z + plan.sill_m, (w, plan.window_m[1])) for z in levels]
    span = (levels[0] + 0.2, plan.eaves_m - 0.55)
    return facade.oriel((y - half, y + half), span, out_m, holes, rng)


def _balcony(plan: Design, y: float, level: float, out_m: float) -> Patch:
    w = plan.window_m[0]
    if plan.balconies == "french":
        return facade.railing((y - 0.5 * w - 0.05, y + 0.5 * w + 0.05), level, 0.04)
    half = min(0.5 * plan.width_m / plan.bays + 0.2, 0.5 * w + 0.8)
    half = min(half, 0.5 * plan.width_m - abs(y))
    closed = plan.style == "modern" or plan.floors * plan.bays > 20
    return facade.balcony((y - half, y + half), level, out_m, solid=closed)


def _fitted_window(plan: Design, hole: Opening, rng: VariantRng, *, bare: bool = False) -> Patch:
    """A window with its sill, lintel and shutters."""
    parts = [facade.window(hole, rng)]
    if not bare:
        parts.append(facade.sill(hole))
    if plan.trimmed:
        parts.append(facade.lintel(hole))
    # Half of the wall between two windows may be covered by one shutter.
    free = 0.5 * (plan.width_m / plan.bays - plan.window_m[0]) - 0.02
    if plan.shutters == "leaves" and not bare and free > 0.5 * hole.width_m:
        parts.append(facade.leaves(hole))
    if plan.shutters == "roller" and rng.chance(0.35):
        parts.append(facade.roller(hole, rng.choose((0.2, 0.35, 0.6, 0.96))))
    return join_patches(parts)


def _bands(plan: Design, rng: VariantRng) -> list[Patch]:
    """String courses, cornice and a downpipe on the street side."""
    half = 0.5 * plan.width_m
    level, top = plan.ground_m - 0.02, plan.eaves_m
    bands = [(level, level + 0.16, 0.1)] if plan.trimmed or plan.shops else []
    if plan.trimmed:
        bands += [(top - 0.42, top - 0.3, 0.14), (top - 0.3, top - 0.08, 0.3)]
    parts = [block((0.0, -half, z0), (out, half, z1), slot=TRIM) for z0, z1, out in bands]
    if plan.roof != "flat":
        side = rng.choose((-1.0, 1.0)) * (half - 0.15)
        pipe = post(0.05, (0.0, plan.eaves_m - 0.1), (0.08, side, 0.0), 6)
        parts.append(pipe.painted(METAL))
    return parts


def _canopy(plan: Design, y: float, top: float, rng: VariantRng) -> list[Patch]:
    if plan.trimmed or not rng.chance(0.5):
        return []
    low, high = (0.0, y - 0.85, top + 0.1), (rng.between(0.8, 1.1), y + 0.85, top + 0.2)
    return [block(low, high, slot=METAL)]


def _side(plan: Design, rng: VariantRng) -> Patch:
    """A side wall: blank where the next house of the row stands."""
    if not plan.sided:
        half = 0.5 * plan.depth_m
        return facade.cut_openings((-half, half), (0.0, plan.eaves_m))
    return _plain_wall(plan, plan.depth_m, 2, rng)


def _plain_wall(plan: Design, width_m: float, bays: int, rng: VariantRng) -> Patch:
    half, w = 0.5 * width_m, min(1.1, plan.window_m[0])
    h = min(1.4, plan.window_m[1])
    holes = []
    for floor in range(plan.floors):
        level = plan.ground_m + (floor - 1) * plan.storey_m if floor else 0.2
        for k in range(bays):
            y = -half + width_m * (k + 0.5) / bays
            hole = Opening((y - 0.5 * w, y + 0.5 * w), (level + 0.9, level + 0.9 + h), 0.12)
            holes.append(hole)
    wall = facade.cut_openings((-half, half), (0.0, plan.eaves_m), holes)
    return join_patches([wall, *(facade.window(hole, rng) for hole in holes)])


def _roof(plan: Design, rng: VariantRng) -> Patch:
    if plan.roof == "flat":
        x, y = rng.between(-0.2, 0.1) * plan.depth_m, rng.between(-0.25, 0.25) * plan.width_m
        size_m = (rng.between(2.0, 3.5), rng.between(2.5, 4.0), rng.between(1.2, 2.4))
        unit = roofs.unit(x, y, size_m)
        return join_patches([roofs.flat(plan.depth_m, plan.width_m, rng.between(0.35, 0.8)), unit])
    if plan.roof == "hip":
        pitch, depth_m = 0.85 * plan.pitch_rad, min(plan.depth_m, plan.width_m)
        shell = roofs.hip(plan.depth_m, plan.width_m, pitch, 0.32)
        ridge = 0.5 * depth_m * math.tan(pitch)
        return join_patches([shell, roofs.chimney(-0.5, 0.4, (0.6 * ridge, ridge + 0.6))])
    if plan.roof == "mansard":
        rise = rng.between(2.5, 2.9)
        profile = roofs.mansard_profile(plan.depth_m, rise, 0.3)
        slope = 0.36
    else:
        profile = roofs.gable_profile(plan.depth_m, plan.pitch_rad, _EAVES_M)
        slope = 1.0 / math.tan(plan.pitch_rad)
    if plan.gable_front:
        return _gable_front(plan, rng)
    shell = roofs.over_profile(profile, plan.width_m, plan.verge_m, 0.24)
    ridge = max(z for _, z in profile)
    y = rng.between(-0.3, 0.3) * plan.width_m
    stack = roofs.chimney(-0.8, y, (ridge - 1.4, ridge + rng.between(0.5, 0.9)))
    return join_patches([shell, stack, *_dormers(plan, slope, rng)])


def _gable_front(plan: Design, rng: VariantRng) -> Patch:
    """A gable roof whose ridge runs along X, with a window in the gable."""
    profile = roofs.gable_profile(plan.width_m, plan.pitch_rad, _EAVES_M)
    shell = roofs.over_profile(profile, plan.depth_m, plan.verge_m, 0.24)
    ridge = max(z for _, z in profile)
    low = 0.22 * ridge
    attic = facade.attic_window((-0.55, 0.55), (low, low + min(1.3, 0.4 * ridge)), rng)
    stack = roofs.chimney(-0.2 * plan.depth_m, 0.6, (ridge - 1.4, ridge + 0.6))
    return join_patches([shell.rotated("z", 0.5 * math.pi), attic.moved(0.5 * plan.depth_m), stack])


def _dormers(plan: Design, slope: float, rng: VariantRng) -> list[Patch]:
    """Dormers on the street side; ``slope`` is how far the roof recedes per metre of height."""
    foot = 0.45
    x = 0.5 * plan.depth_m - slope * foot - 0.05
    reach = min(slope * 2.2 + 0.3, x)
    at = [plan.width_m * ((k + 0.5) / plan.dormers - 0.5) for k in range(plan.dormers)]
    return [roofs.dormer(x, y, foot, reach, rng) for y in at]


def _window(plan: Design, y: float, z0: float, size_m: tuple[float, float]) -> Opening:
    w, h = size_m
    upright, level = plan.panes
    return Opening((y - 0.5 * w, y + 0.5 * w), (z0, z0 + h), plan.recess_m, upright, level)


def _bay_centres(plan: Design) -> Sequence[float]:
    pitch = plan.width_m / plan.bays
    return [(k + 0.5) * pitch - 0.5 * plan.width_m for k in range(plan.bays)]
