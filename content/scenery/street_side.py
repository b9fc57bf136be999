"""The street side of a building: ground floor, upper floors, and their fittings.

Everything is in the wall's frame; see ``facade``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.scenery import facade, shop_fronts
from gen_data.content.scenery import facade_fittings as fittings
from gen_data.content.scenery.basic_shapes import Span, post, quad
from gen_data.content.scenery.building_designs import Design
from gen_data.content.scenery.facade import BASE, FACADE, METAL, TRIM, Opening
from gen_data.content.scenery.facade_shapes import Bounds, Box, ledges, rectangles
from gen_data.core.variant_rng import VariantRng

_DOOR_M = (1.15, 2.5)


@dataclass(frozen=True, slots=True)
class Stretch:
    """A plane part of the street side.

    Attributes:
        y_m: Its extent to the sides.
        centres: Middles of its bays.
        has_entrance: Whether one of its bays is the entrance.
    """

    y_m: Span
    centres: tuple[float, ...]
    has_entrance: bool = True


def front(plan: Design, rng: VariantRng) -> Patch:
    """The street side; the wing, if there is one, stands before the wall's plane."""
    pitch, half = plan.width_m / plan.bays, 0.5 * plan.width_m
    centres = tuple(bay_centres(plan))
    if plan.wing == 0:
        return join_patches(_stretch(plan, Stretch((-half, half), centres), rng))
    left = rng.chance(0.5)
    edge = plan.wing * pitch - half if left else half - plan.wing * pitch
    rest, wing = ((edge, half), (-half, edge)) if left else ((-half, edge), (edge, half))
    main = Stretch(rest, tuple(y for y in centres if rest[0] < y < rest[1]))
    other = Stretch(wing, tuple(y for y in centres if wing[0] < y < wing[1]), has_entrance=False)
    before = join_patches(_stretch(plan, other, rng)).moved(plan.wing_out_m)
    return join_patches([*_stretch(plan, main, rng), before, *_cheeks(plan, wing)])


def _cheeks(plan: Design, y_m: Span) -> list[Patch]:
    """The two side walls of a wing, and its floor."""
    x, top, (y0, y1) = plan.wing_out_m, plan.eaves_m, y_m
    left = quad([(0.0, y0, 0.0), (x, y0, 0.0), (x, y0, top), (0.0, y0, top)], FACADE)
    right = quad([(x, y1, 0.0), (0.0, y1, 0.0), (0.0, y1, top), (x, y1, top)], FACADE)
    floor = quad([(0.0, y0, 0.0), (0.0, y1, 0.0), (x, y1, 0.0), (x, y0, 0.0)], BASE)
    return [left, right, floor]


def wing_span(plan: Design, built: Patch) -> Span | None:
    """Where the wing of a built front is; None without one."""
    if plan.wing == 0:
        return None
    corners = built.corners_m[built.slots == FACADE].reshape(-1, 3)
    y = corners[corners[:, 0] > plan.wing_out_m - 1e-6][:, 1]
    return (float(y.min()), float(y.max()))


def _stretch(plan: Design, part: Stretch, rng: VariantRng) -> list[Patch]:
    ground = _ground(plan, part, rng)
    holes, upper = _upper(plan, part, rng)
    made = [ground, *upper, *_bands(plan, part, rng), *_traces(plan, part, rng)]
    if plan.floors > 1:
        made.append(facade.cut_openings(part.y_m, (plan.ground_m, plan.eaves_m), holes))
        half = 0.5 * plan.width_m
        if rng.chance(plan.fittings) and not plan.ribbons:
            made += fittings.fixtures(holes, half, plan.eaves_m, rng)
    return made


def _ground(plan: Design, part: Stretch, rng: VariantRng) -> Patch:
    slot = BASE if plan.trimmed else FACADE
    if plan.shops:
        return shop_fronts.ground_floor(0.5 * plan.width_m, plan.ground_m, slot, rng)
    if plan.ground == "lobby":
        return _lobby(plan, part, rng)
    if plan.ground == "gates":
        return _gates(plan, part, rng)
    return _dwelling(plan, part, rng)


def _dwelling(plan: Design, part: Stretch, rng: VariantRng) -> Patch:
    """A ground floor of windows, one entrance, perhaps a garage."""
    plinth = 0.15 if plan.style in ("modern", "commercial") else rng.choose((0.3, 0.45, 0.6))
    count = len(part.centres)
    entrance = int(rng.random() * count) if part.has_entrance else -1
    stable = plan.ground == "garage" and part.has_entrance and count > 2
    car = rng.choose((0, count - 1)) if stable else -1
    raised = plan.porch == "columns" or rng.chance(0.3)
    foot = rng.choose((0.34, 0.51)) if raised and plan.ground_m > 3.2 else 0.15
    w, h = plan.window_m
    holes, parts = [], []
    for k, y in enumerate(part.centres):
        if k == entrance:
            hole, made = _entrance(plan, y, foot, rng)
            parts += made
        elif k == car:
            wide = min(2.5, plan.width_m / plan.bays - 0.3)
            hole = Opening((y - 0.5 * wide, y + 0.5 * wide), (0.02, 2.15), 0.15)
            parts.append(facade.garage_door(hole))
        else:
            sill = max(plan.sill_m, plinth) + 0.12
            top = min(sill + h, plan.ground_m - 0.3)
            hole = window_opening(plan, y, sill, (w, top - sill))
            parts.append(fitted_window(plan, hole, rng))
        holes.append(hole)
    slot = BASE if plan.trimmed else FACADE
    wall = facade.cut_openings(part.y_m, (0.0, plan.ground_m), holes, slot, (plinth, BASE))
    return join_patches([wall, *parts])


def _entrance(plan: Design, y: float, foot: float, rng: VariantRng) -> tuple[Opening, list[Patch]]:
    """The opening of the main door, and the door with its steps, roof and bells."""
    wide = _DOOR_M[0] * rng.choose((0.95, 1.0, 1.0, 1.5))
    top = min(foot + rng.between(2.3, _DOOR_M[1]), plan.ground_m - 0.35)
    hole = Opening((y - 0.5 * wide, y + 0.5 * wide), (foot, top), rng.between(0.12, 0.3))
    parts = [facade.door(hole, rng), fittings.doorside(hole.y_m[1] + 0.15, foot, rng)]
    if foot > 0.2:
        parts.append(fittings.steps((hole.y_m[0] - 0.2, hole.y_m[1] + 0.2), foot))
    if plan.porch != "none":
        parts += fittings.porch(y, top, plan.porch, rng)
    elif plan.trimmed and rng.chance(0.5):
        parts.append(facade.pediment(hole))
    return hole, parts


def _lobby(plan: Design, part: Stretch, rng: VariantRng) -> Patch:
    """A ground floor of glass between piers, with doors in one bay."""
    pitch = plan.width_m / plan.bays
    wide, top = pitch - rng.between(0.3, 0.7), plan.ground_m - rng.between(0.5, 0.9)
    low = rng.choose((0.08, 0.08, 0.5))
    entrance = len(part.centres) // 2 if part.has_entrance else -1
    holes, parts = [], []
    for k, y in enumerate(part.centres):
        y_m = (y - 0.5 * wide, y + 0.5 * wide)
        if k == entrance:
            hole = Opening(y_m, (0.05, top), 0.25, upright=3)
            depth_m = 0.25 + facade.GLASS_SETBACK_M
            parts += [facade.reveal(hole, depth_m), facade.frame(hole)]
            parts.append(facade.panes(hole, rng, -depth_m))
            bars = [(-0.25, -0.19, a, a + 0.04, 0.7, 1.6) for a in (y - 0.12, y + 0.08)]
            parts.append(ledges(bars, METAL))
            if plan.porch != "none":
                parts += fittings.porch(y, top, plan.porch, rng)
        else:
            hole = Opening(y_m, (low, top), 0.14, upright=rng.choose((1, 2, 2)))
            parts.append(facade.window(hole, rng))
        holes.append(hole)
    wall = facade.cut_openings(part.y_m, (0.0, plan.ground_m), holes)
    return join_patches([wall, *parts])


def _gates(plan: Design, part: Stretch, rng: VariantRng) -> Patch:
    pitch = plan.width_m / plan.bays
    high = min(plan.ground_m - 0.7, rng.between(3.4, 4.4))
    kinds = rng.shuffled(("gate", "gate", "door", *("window" for _ in part.centres)))
    holes, parts = [], []
    for y, kind in zip(part.centres, kinds, strict=False):
        if kind == "gate":
            wide = min(3.6, pitch - 0.4)
            hole = Opening((y - 0.5 * wide, y + 0.5 * wide), (0.02, high), 0.2)
            parts += [facade.garage_door(hole), _dock(hole, rng)]
        elif kind == "door":
            hole = Opening((y - 0.55, y + 0.55), (0.15, 2.3), 0.15)
            parts += [facade.door(hole, rng), *fittings.porch(y, 2.3, "canopy", rng)]
        else:
            wide = min(plan.window_m[0], pitch - 0.5)
            z1 = plan.ground_m - 0.6
            hole = window_opening(plan, y, z1 - min(plan.window_m[1], z1 - 0.9), (wide, min(
                plan.window_m[1], z1 - 0.9)))  # fmt: skip
            parts.append(facade.window(hole, rng))
        holes.append(hole)
    wall = facade.cut_openings(part.y_m, (0.0, plan.ground_m), holes, FACADE, (0.4, BASE))
    return join_patches([wall, *parts])


def _dock(hole: Opening, rng: VariantRng) -> Patch:
    """Bumpers on both sides of a gate, a number above it, perhaps a canopy."""
    (y0, y1), top = hole.y_m, hole.z_m[1]
    parts = [ledges([(0.0, 0.15, y - 0.1, y + 0.1, 0.2, 0.9) for y in (y0 - 0.2, y1 + 0.2)],
                    facade.DARK)]  # fmt: skip
    middle = 0.5 * (y0 + y1)
    parts.append(rectangles(0.01, [(middle - 0.3, middle + 0.3, top + 0.1, top + 0.6)],
                            rng.choose((facade.ACCENT, facade.WHITE))))  # fmt: skip
    if rng.chance(0.3):
        parts.append(ledges([(0.0, 1.4, y0 - 0.3, y1 + 0.3, top + 0.15, top + 0.3)], METAL))
    return join_patches(parts)


def _upper(plan: Design, part: Stretch, rng: VariantRng) -> tuple[list[Opening], list[Patch]]:
    """Windows of the upper floors, all in line, and balconies before some of them."""
    if plan.ribbons:
        return ribbons(plan, part.y_m, rng)
    count = len(part.centres)
    first, out_m = int(rng.random() * count), rng.between(1.0, 1.6)
    mirrored = count - 1 - first
    outside = {first, mirrored if abs(mirrored - first) > 1 else first}
    if rng.chance(0.2) and plan.balconies == "slab" and plan.floors < 8:
        outside = set(range(count))
    holes, parts = [], []
    for floor in range(1, plan.floors):
        level = plan.ground_m + (floor - 1) * plan.storey_m
        for k, y in enumerate(part.centres):
            if k == plan.oriel:
                continue
            tall = plan.balconies != "none" and k in outside
            w, h = plan.window_m
            hole = window_opening(plan, y, level + plan.sill_m, (w, h))
            if tall:
                head = level + plan.sill_m + h
                hole = window_opening(plan, y, level + 0.1, (w, head - level - 0.1))
            holes.append(hole)
            parts.append(fitted_window(plan, hole, rng, bare=tall))
            if tall:
                parts += _balcony(plan, part, y, (level + 0.08, out_m), rng)
            elif rng.chance(0.12 * plan.fittings):
                parts.append(fittings.flower_box(hole.y_m, hole.z_m[0] + 0.14, 0.06, rng))
    if plan.oriel >= 0 and plan.floors > 1:
        parts.append(_oriel(plan, part.centres[plan.oriel], rng))
    if plan.timbered and plan.floors > 1 and plan.oriel < 0:
        parts.append(_timber(plan, part, rng))
    return holes, parts


def ribbons(plan: Design, y_m: Span, rng: VariantRng) -> tuple[list[Opening], list[Patch]]:
    """One band of windows per upper floor."""
    holes, parts = [], []
    edge = 0.3 if plan.style == "tower" else 0.4
    y0, y1 = y_m[0] + edge, y_m[1] - edge
    upright = max(1, round((y1 - y0) / (1.5 if plan.floors < 8 else 3.0)))
    fins = rng.chance(0.25) and plan.floors < 8
    for floor in range(1, plan.floors):
        z = plan.ground_m + (floor - 1) * plan.storey_m + plan.sill_m
        high = min(plan.window_m[1], plan.storey_m - plan.sill_m - 0.25)
        hole = Opening((y0, y1), (z, z + high), max(0.11, plan.recess_m), upright=upright)
        holes.append(hole)
        parts.append(facade.window(hole, rng))
    if fins:
        z_m = (plan.ground_m, plan.eaves_m - 0.1)
        at = np.linspace(y0, y1, upright + 1).tolist()
        parts.append(ledges([(0.0, 0.25, y - 0.04, y + 0.04, *z_m) for y in at], METAL))
    return holes, parts


def _oriel(plan: Design, y: float, rng: VariantRng) -> Patch:
    """A bay that stands out over all upper floors, with a window on each."""
    half, out_m = 0.46 * plan.width_m / plan.bays, rng.between(0.6, 0.9)
    levels = [plan.ground_m + k * plan.storey_m for k in range(plan.floors - 1)]
    w = min(1.25 * plan.window_m[0], 2.0 * half - 0.4)
    holes = [window_opening(plan, y, z + plan.sill_m, (w, plan.window_m[1])) for z in levels]
    span = (levels[0] + 0.2, plan.eaves_m - 0.55)
    return facade.oriel((y - half, y + half), span, out_m, holes, rng)


def _balcony(
    plan: Design, part: Stretch, y: float, place_m: tuple[float, float], rng: VariantRng
) -> list[Patch]:
    """A balcony or a railing at (level, reach) before the bay about y."""
    level, out_m = place_m
    w = plan.window_m[0]
    if plan.balconies == "french":
        return [facade.railing((y - 0.5 * w - 0.05, y + 0.5 * w + 0.05), level, 0.04)]
    half = min(0.5 * plan.width_m / plan.bays + 0.2, 0.5 * w + 0.8)
    half = min(half, y - part.y_m[0], part.y_m[1] - y)
    closed = plan.style in ("modern", "tower") or plan.floors * plan.bays > 20
    y_m = (y - half, y + half)
    parts = [facade.balcony(y_m, level, out_m, solid=closed)]
    if rng.chance(plan.fittings) and plan.floors < 8:
        parts += fittings.balcony_things(y_m, level, out_m, rng)
    return parts


def fitted_window(plan: Design, hole: Opening, rng: VariantRng, *, bare: bool = False) -> Patch:
    """A window with its sill, border and shutters."""
    if plan.floors > 8:
        # Upper storeys of towers are far away: panes in plain frames.
        depth_m = hole.recess_m
        lower = (hole.y_m[0], hole.y_m[1], hole.z_m[0], hole.z_m[0] + 0.07)
        bar = rectangles(0.004 - depth_m, [lower], facade.FRAME)
        return join_patches([facade.reveal(hole, depth_m), bar, facade.panes(hole, rng, -depth_m)])
    parts = [facade.window(hole, rng)]
    if not bare:
        parts.append(facade.sill(hole))
    if plan.surround != "none" and hole.arch_m == 0.0 and not bare:
        parts.append(facade.surround(hole, 0.13))
        if plan.surround == "pediment":
            parts.append(facade.pediment(hole))
    elif plan.trimmed and hole.arch_m == 0.0:
        parts.append(facade.lintel(hole))
    # Half of the wall between two windows may be covered by one shutter.
    free = 0.5 * (plan.width_m / plan.bays - plan.window_m[0]) - 0.02
    if plan.shutters == "leaves" and not bare and free > 0.5 * hole.width_m:
        parts.append(facade.leaves(hole))
    if plan.shutters == "roller" and hole.arch_m == 0.0 and rng.chance(0.35):
        parts.append(facade.roller(hole, rng.choose((0.2, 0.35, 0.6, 0.96))))
    return join_patches(parts)


def _bands(plan: Design, part: Stretch, rng: VariantRng) -> list[Patch]:
    y0, y1 = part.y_m
    level, top = plan.ground_m - 0.02, plan.eaves_m
    boxes: list[Box] = []
    if plan.trimmed or plan.shops:
        boxes.append((0.0, 0.1, y0, y1, level, level + 0.16))
    if plan.trimmed or plan.surround == "pediment":
        boxes += [
            (0.0, 0.14, y0, y1, top - 0.42, top - 0.3),
            (0.0, 0.3, y0, y1, top - 0.3, top - 0.08),
        ]
        if rng.chance(0.5):
            count = round((y1 - y0) / 0.9)
            at = np.linspace(y0 + 0.1, y1 - 0.25, max(2, count)).tolist()
            boxes += [(0.14, 0.26, y, y + 0.22, top - 0.42, top - 0.3) for y in at]
    elif rng.chance(0.25):
        boxes.append((0.0, 0.06, y0, y1, top - 0.3, top - 0.05))
    if plan.quoins:
        for k in range(int((top - 0.5) / 0.6)):
            w, z = (0.5, 0.3)[k % 2], 0.6 * k + 0.02
            boxes += [(0.0, 0.04, y0, y0 + w, z, z + 0.57), (0.0, 0.04, y1 - w, y1, z, z + 0.57)]
    parts = [ledges(boxes, TRIM)] if boxes else []
    if plan.roof != "flat" or rng.chance(0.3):
        side = rng.choose((y0 + 0.15, y1 - 0.15))
        pipe = post(0.05, (0.0, plan.eaves_m - 0.1), (0.08, side, 0.0), 6)
        parts.append(pipe.painted(METAL))
    return parts


def _timber(plan: Design, part: Stretch, rng: VariantRng) -> Patch:
    """Posts, rails and braces of a timber frame on the upper floors."""
    (y0, y1), w = part.y_m, 0.16
    places: list[Bounds] = []
    braces = []
    for floor in range(1, plan.floors):
        z0 = plan.ground_m + (floor - 1) * plan.storey_m
        z1 = min(z0 + plan.storey_m, plan.eaves_m)
        places += [(y0, y1, z0, z0 + 0.2), (y0, y1, z1 - 0.12, z1)]
        half = 0.5 * plan.window_m[0] + 0.02
        posts = [y0, y1 - w]
        for y in part.centres:
            posts += [y - half - w, y + half]
        places += [(y, y + w, z0 + 0.2, z1 - 0.12) for y in posts]
        rail = z0 + plan.sill_m - 0.22
        edges = [y0, *(y for c in part.centres for y in (c - half, c + half)), y1]
        places += [(a, b, rail, rail + 0.12) for a, b in zip(edges[::2], edges[1::2], strict=True)]
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            if b - a > 0.7:
                flip = rng.chance(0.5)
                low, high = (b - 0.3, a + 0.1) if flip else (a + 0.1, b - 0.3)
                loop = [
                    (low, rail + 0.12),
                    (low + 0.16, rail + 0.12),
                    (high + 0.16, z1 - 0.12),
                    (high, z1 - 0.12),
                ]
                braces.append(quad([(0.012, *p) for p in loop], TRIM))
    return join_patches([rectangles(0.014, places, TRIM), *braces])


def _traces(plan: Design, part: Stretch, rng: VariantRng) -> list[Patch]:
    """Cables, repairs and posters that time leaves on a front."""
    (y0, y1), parts = part.y_m, []
    if rng.chance(0.4 * plan.age) and part.has_entrance and plan.cladding != "sheet":
        z = plan.ground_m - 0.2 if not plan.shops else plan.ground_m + 0.35
        half = 0.5 * (y1 - y0)
        parts += [p.moved(y=0.5 * (y0 + y1)) for p in fittings.cables(half, z, rng)]
    if len(part.centres) < 2 or plan.shops or plan.ground != "dwelling":
        return parts
    gap = part.centres[1] - part.centres[0] - plan.window_m[0]
    shut = plan.shutters == "leaves" or plan.surround != "none"
    if gap > 1.1 and not shut:
        # Between two bays no window is in the way.
        k = int(rng.random() * (len(part.centres) - 1))
        a = part.centres[k] + 0.5 * plan.window_m[0] + 0.1
        if rng.chance(0.5 * plan.age):
            parts += fittings.repairs((a, a + gap - 0.2), (0.7, plan.eaves_m - 0.6), plan.age, rng)
        elif rng.chance(0.3 * plan.age):
            parts.append(shop_fronts.poster(0.006, (a + 0.25, 1.1), 0.5, rng))
    return parts


def window_opening(plan: Design, y: float, z0: float, size_m: tuple[float, float]) -> Opening:
    """The opening of a window of a design about y, its sill at z0."""
    w, h = size_m
    upright, level = plan.panes
    arch = min(0.5 * w, 0.3 * h) * (0.45 if plan.window_m[0] > 1.25 else 1.0)
    made = Opening((y - 0.5 * w, y + 0.5 * w), (z0, z0 + h), plan.recess_m, upright, level)
    if not plan.arched or plan.floors > 8:
        return made
    return Opening(made.y_m, made.z_m, made.recess_m, upright, level, arch)


def bay_centres(plan: Design) -> Sequence[float]:
    """Middles of the bays along the street side."""
    pitch = plan.width_m / plan.bays
    return [(k + 0.5) * pitch - 0.5 * plan.width_m for k in range(plan.bays)]
