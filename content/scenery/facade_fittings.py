"""Fittings of walls, balconies and roofs, and traces of age; in a wall's frame."""

import math

import numpy as np

from gen_data.content.procedural.patches import Array, Patch, join_patches
from gen_data.content.procedural.surface_shapes import circle, fan, grid, lathe
from gen_data.content.scenery.basic_shapes import Span, post, quad
from gen_data.content.scenery.facade import (
    ACCENT,
    AWNING,
    BASE,
    CEMENT,
    CHIMNEY,
    DARK,
    DOOR,
    FLOWER,
    GRAFFITI,
    METAL,
    PLANT,
    TRIM,
    WHITE,
    Opening,
)
from gen_data.content.scenery.facade_shapes import (
    Box,
    blotch,
    ledges,
    polygon,
    rectangles,
    without_slivers,
)
from gen_data.core.variant_rng import VariantRng


def satellite_dish(y: float, z: float, rng: VariantRng) -> Patch:
    """A dish of 0.6-0.85 m on an arm, turned to the side and up."""
    r = rng.between(0.3, 0.43)
    bowl = lathe([(0.0, 0.0), (0.6 * r, 0.09 * r), (r, 0.25 * r)], 10, WHITE)
    back = bowl.flipped().moved(z=0.012)
    tilt, turn = rng.between(0.9, 1.1), rng.between(-0.7, 0.7)
    dish = join_patches([bowl.flipped(), back.flipped().moved(z=-0.02)])
    dish = dish.rotated("y", tilt).rotated("z", turn).moved(0.38, y, z)
    arm = ledges([(0.0, 0.38, y - 0.02, y + 0.02, z - 0.02, z + 0.02)], METAL)
    feed = ledges([(0.38, 0.38 + 1.1 * r, y - 0.02, y + 0.02, z + 0.05, z + 0.1)], METAL)
    return join_patches([arm, feed.painted(DARK), dish])


def air_conditioner(y: float, z: float, rng: VariantRng) -> Patch:
    """An outdoor unit on brackets, with its pipe; 0.75-0.9 m wide (assumed, 0.1 m)."""
    w, h, d = rng.between(0.75, 0.9), rng.between(0.52, 0.65), rng.between(0.27, 0.33)
    body: Box = (0.06, 0.06 + d, y, y + w, z, z + h)
    fan = circle(0.4 * h, 10, (y + 0.58 * w, z + 0.5 * h))
    feet = [(0.0, d, y + k * w, y + k * w + 0.04, z - 0.04, z) for k in (0.12, 0.84)]
    pipe = [(0.0, 0.05, y + w + 0.03, y + w + 0.09, z + 0.1, z + rng.between(0.8, 1.8))]
    parts = [
        ledges([body], WHITE),
        polygon(0.062 + d, fan, DARK),
        ledges(feet, METAL),
        ledges(pipe, WHITE),
    ]
    return join_patches(parts)


def flower_box(y_m: Span, z: float, x: float, rng: VariantRng) -> Patch:
    """A trough of plants along a railing or a sill, its back in the plane x."""
    (y0, y1), d = y_m, 0.18
    box = ledges([(x, x + d, y0, y1, z - 0.16, z)], rng.choose((DOOR, WHITE, CHIMNEY)))
    count = max(3, round((y1 - y0) / 0.16))
    tufts = []
    for k in range(count):
        y = y0 + (y1 - y0) * (k + rng.between(0.3, 0.7)) / count
        r, up = rng.between(0.08, 0.14), rng.between(0.1, 0.26)
        tuft = _tuft(x + 0.5 * d, y, z, (r, up)).painted(FLOWER if rng.chance(0.4) else PLANT)
        tufts.append(tuft)
    return join_patches([box, *tufts])


def _tuft(x: float, y: float, z: float, size_m: tuple[float, float]) -> Patch:
    """A few leaves: a faceted bud of radius and height ``size_m``."""
    r, h = size_m
    return lathe([(0.0, z - 0.02), (r, z + 0.35 * h), (0.0, z + h)], 5).moved(x, y)


def balcony_things(y_m: Span, z0: float, out_m: float, rng: VariantRng) -> list[Patch]:
    """Contents of a balcony: flower boxes, chairs, washing, a dish, a parasol."""
    (y0, y1), parts = y_m, []
    if y1 - y0 < 1.2:
        return []
    if rng.chance(0.4):
        a = rng.between(y0 + 0.1, 0.5 * (y0 + y1))
        parts.append(flower_box((a, rng.between(a + 0.5, y1 - 0.05)), z0 + 0.98, out_m, rng))
    kind = rng.choose(("none", "chairs", "washing", "parasol", "screen", "cupboard", "chairs"))
    a, paint = rng.between(y0 + 0.15, y1 - 0.9), rng.choose((WHITE, DOOR, AWNING, DARK))
    if kind == "chairs":
        x = 0.45 * out_m
        seats = [(x, x + 0.45, a + k, a + k + 0.42, z0 + 0.4, z0 + 0.45) for k in (0.0, 0.45)]
        seats += [(x, x + 0.04, a + k, a + k + 0.42, z0 + 0.45, z0 + 0.9) for k in (0.0, 0.45)]
        parts.append(ledges(seats, paint))
    elif kind == "washing":
        line = [(y0 + 0.15, z0 + 1.45)]
        cloths = [(line[0][0] + k * 0.33, rng.between(0.35, 0.7)) for k in range(3)]
        for y, long in cloths:
            slot, z = rng.choose((WHITE, ACCENT, FLOWER, AWNING)), z0 + 1.5
            face = rectangles(0.75 * out_m, [(y, y + 0.28, z - long, z)], slot)
            parts += [face, face.flipped().moved(x=-0.004)]
        part = ledges([(0.75 * out_m, 0.75 * out_m + 0.01, y0, y1, z0 + 1.5, z0 + 1.51)], DARK)
        parts.append(part)
    elif kind == "parasol":
        x, y, z = 0.55 * out_m, 0.5 * (y0 + y1), z0 + 2.15
        cloth = lathe([(0.75, z - 0.3), (0.0, z)], 8, rng.choose((AWNING, ACCENT, WHITE)))
        stick = post(0.02, (z0, z - 0.02), sides=4).painted(METAL)
        parts += [join_patches([cloth, cloth.flipped().moved(z=-0.01), stick]).moved(x, y)]
    elif kind == "screen":
        parts.append(ledges([(out_m - 0.09, out_m - 0.07, y0, y1, z0, z0 + 0.92)], paint))
    elif kind == "cupboard":
        parts.append(ledges([(0.0, 0.4, a, a + 0.7, z0, z0 + rng.between(0.8, 1.7))], paint))
    if rng.chance(0.18):
        parts.append(satellite_dish(rng.choose((y0 + 0.4, y1 - 0.4)), z0 + 1.3, rng).moved(
            x=max(0.0, out_m - 0.5)))  # fmt: skip
    return parts


def fixtures(
    openings: list[Opening], half_m: float, eaves_m: float, rng: VariantRng
) -> list[Patch]:
    """Dishes and air conditioners below or next to some windows."""
    parts = []
    share = rng.choose((0.0, 0.0, 0.04, 0.1, 0.25))
    kind = rng.choose((satellite_dish, air_conditioner, air_conditioner))
    for hole in openings:
        y, z = hole.y_m[1] + 0.12, hole.z_m[0]
        if rng.chance(share) and z > 2.5 and y < half_m - 1.0 and z < eaves_m - 2.0:
            if kind is satellite_dish:
                parts.append(satellite_dish(y + 0.2, z + 0.4, rng))
            elif z > 3.2:
                parts.append(air_conditioner(hole.y_m[0] + 0.05, z - 0.8, rng))
    return parts


def cables(half_m: float, z: float, rng: VariantRng) -> list[Patch]:
    """Cables along a wall at about a height, sagging between clips, and one down from there."""
    parts = []
    for k in range(rng.choose((0, 0, 1, 2))):
        count, level = 8, z + 0.12 * k + rng.between(-0.1, 0.1)
        y = np.linspace(-half_m + 0.1, half_m - 0.1, count + 1)
        sag = [level - (0.05 if i % 2 else 0.0) for i in range(count + 1)]
        for i in range(count):
            low = [(0.03, y[i], sag[i]), (0.03, y[i + 1], sag[i + 1])]
            corners = [*low, *((x, b, c + 0.022) for x, b, c in low[::-1])]
            parts.append(quad(corners, DARK))
        down, foot = rng.between(-half_m + 0.3, half_m - 0.3), rng.choose((0.4, 0.5 * z))
        parts.append(ledges([(0.0, 0.025, down, down + 0.025, foot, level)], DARK))
    return parts


def doorside(y: float, z: float, rng: VariantRng) -> Patch:
    """Fittings at an entrance: bells, a number plate, a lamp, perhaps letter boxes."""
    parts = [ledges([(0.0, 0.02, y, y + 0.14, z + 1.2, z + 1.45)], METAL)]
    parts.append(ledges([(0.0, 0.02, y, y + 0.2, z + 1.7, z + 1.88)], rng.choose((ACCENT, WHITE))))
    parts.append(ledges([(0.0, 0.14, y + 0.02, y + 0.16, z + 1.98, z + 2.2)], WHITE))
    if rng.chance(0.4):
        boxes = [
            (0.0, 0.12, y, y + 0.36, z + 0.75 + 0.13 * k, z + 0.86 + 0.13 * k) for k in range(3)
        ]
        parts.append(ledges(boxes, rng.choose((METAL, WHITE, DOOR))))
    return join_patches(parts)


def repairs(y_m: Span, z_m: Span, share: float, rng: VariantRng) -> list[Patch]:
    """Fields of bare mortar and of brick where render has gone, within a blank stretch of wall."""
    parts = []
    (y0, y1), (z0, z1) = y_m, z_m
    for k in range(round(share * rng.choose((0, 2, 5)))):
        w = rng.between(0.3, 1.4)
        h = rng.between(0.5, 1.2) * w
        if y1 - y0 < w + 0.3 or z1 - z0 < h + 0.3:
            continue
        y, z = rng.between(y0 + 0.5 * w, y1 - 0.5 * w), rng.between(z0 + 0.5 * h, z1 - 0.5 * h)
        slot = rng.choose((CEMENT, CEMENT, CHIMNEY))
        parts.append(polygon(0.004 + 0.0015 * k, blotch(y, z, (w, h), rng), slot))
    return parts


def graffiti(y_m: Span, rng: VariantRng) -> list[Patch]:
    """A painted piece and tags at the foot of a blank wall."""
    (y0, y1), parts = y_m, []
    if y1 - y0 > 4.0 and rng.chance(0.6):
        w = rng.between(2.5, min(5.0, y1 - y0 - 0.4))
        h = rng.between(0.35, 0.5) * w
        a, z = rng.between(y0 + 0.1, y1 - w - 0.1), rng.between(0.15, 0.5)
        parts.append(_piece((a, a + w), (z, z + h), rng))
    for _ in range(rng.choose((0, 1, 2, 4))):
        parts.append(_tag(rng.between(y0 + 0.2, max(y0 + 0.3, y1 - 1.2)), rng))
    return parts


def _piece(y_m: Span, z_m: Span, rng: VariantRng) -> Patch:
    """A piece within a rounded, uneven outline, the image stretched over its bounds."""
    (y0, y1), (z0, z1) = y_m, z_m
    turn = 2.0 * math.pi * np.arange(20) / 20
    # A rounded rectangle: the fourth power keeps the letters' corners.
    c, s = np.cos(turn), np.sin(turn)
    radius = (c**4 + s**4) ** -0.25 * np.array([rng.between(0.88, 1.0) for _ in turn])
    y, z = 0.5 + 0.5 * radius * c, 0.5 + 0.5 * radius * s
    outline = np.stack([y0 + (y1 - y0) * y, z0 + (z1 - z0) * z], axis=1)
    made = polygon(0.006, outline, GRAFFITI)
    flat = (made.corners_m[..., 1:] - [y0, z0]) / [y1 - y0, z1 - z0]
    return Patch(made.corners_m, flat, made.slots)


def _tag(y: float, rng: VariantRng) -> Patch:
    """A signature of a few strokes, in one colour."""
    z, size = rng.between(0.6, 1.5), rng.between(0.25, 0.6)
    slot, strokes = rng.choose((DARK, DARK, ACCENT, FLOWER)), []
    for k in range(rng.choose((3, 4, 5))):
        start, speed = rng.between(0.0, 6.0), rng.between(3.0, 7.0)
        t = np.linspace(0.0, 1.0, 7)
        a = y + 0.45 * size * k + 0.4 * size * (t + 0.5 * np.sin(speed * t + start))
        b = z + 0.5 * size * np.sin(1.3 * speed * t + 2.0 * start)
        strokes += [_stroke(a[i : i + 2], b[i : i + 2], 0.035, slot) for i in range(6)]
    return join_patches(strokes)


def _stroke(y: Array, z: Array, width_m: float, slot: int) -> Patch:
    """A straight stroke between two points, facing +X."""
    along = np.array([y[1] - y[0], z[1] - z[0]])
    along = along / max(1e-6, math.hypot(*along))
    across = 0.5 * width_m * np.array([-along[1], along[0]])
    ends = [np.array([y[i], z[i]]) for i in (0, 1)]
    loop = [ends[0] - across, ends[1] - across, ends[1] + across, ends[0] + across]
    return quad([(0.007, *point) for point in loop], slot)


def ivy(y_m: Span, top_m: float, rng: VariantRng) -> Patch:
    """A climber from the ground up: rows of overlapping cushions, ragged and narrower above."""
    (y0, y1), parts = y_m, []
    middle, rows = 0.5 * (y0 + y1), max(3, min(7, round(top_m / 1.1)))
    for row in range(rows):
        share = row / rows
        wide = (y1 - y0) * (1.0 - 0.6 * share * rng.between(0.5, 1.0))
        drift = 0.15 * (y1 - y0) * rng.between(-1.0, 1.0) * share
        count = max(2, min(4, round(wide / 0.9)))
        for k in range(count):
            y = middle + drift + wide * ((k + rng.between(0.3, 0.7)) / count - 0.5)
            z = top_m * share + rng.between(0.1, 0.6)
            size = (1.7 * wide / count, rng.between(1.6, 2.4) * top_m / rows)
            # No leaf hangs in the air beyond the end of the wall.
            y = min(max(y, y0 + 0.5 * size[0]), max(y0 + 0.5 * size[0], y1 - 0.5 * size[0]))
            outline = blotch(y, z, size, rng)
            outline[:, 1] = np.clip(outline[:, 1], 0.0, top_m)
            parts += _cushion(outline, rng.between(0.05, 0.14))
    return join_patches(parts)


def _cushion(outline: Array, bulge_m: float) -> list[Patch]:
    """Leaves over an outline (y, z), which stand off the wall in the middle."""
    centre = outline.mean(axis=0)
    ring = np.insert(outline, 0, 0.01, axis=1)
    inner = np.insert(centre + 0.6 * (outline - centre), 0, bulge_m, axis=1)
    rim = np.stack([np.concatenate([loop, loop[:1]]) for loop in (ring, inner)])
    return [without_slivers(grid(rim, slot=PLANT)), without_slivers(fan(inner, PLANT))]


def aerial(rng: VariantRng) -> Patch:
    """A mast with rods, its foot at the origin; 1.2-2.2 m high."""
    high = rng.between(1.2, 2.2)
    mast = post(0.022, (-0.4, high), sides=4).painted(METAL)
    boom: list[Box] = [(-0.45, 0.45, -0.01, 0.01, high - 0.1, high - 0.08)]
    boom += [
        (x, x + 0.012, -0.28, 0.28, high - 0.095, high - 0.085)
        for x in (-0.42, -0.2, 0.02, 0.24, 0.43)
    ]
    rods = ledges(boom, METAL)
    return join_patches([mast, rods]).rotated("z", rng.between(0.0, 3.0))


def solar_panels(width_m: float, rng: VariantRng) -> Patch:
    """Modules of 1.0 by 1.7 m in a row, flat in the plane z = 0, from x = 0 up to -1.7."""
    count = max(2, int(rng.between(0.3, 0.8) * width_m / 1.03))
    left = rng.between(0.0, max(0.01, width_m - 1.03 * count)) - 0.5 * width_m
    parts = []
    for k in range(count):
        y = left + 1.03 * k
        loop = [(0.0, y, 0.0), (0.0, y + 1.0, 0.0), (-1.7, y + 1.0, 0.0), (-1.7, y, 0.0)]
        parts.append(quad(loop, DARK))
    return join_patches(parts)


def steps(y_m: Span, rise_m: float) -> Patch:
    """Outer steps up to a door's threshold at a height."""
    count = max(1, round(rise_m / 0.17))
    boxes = [
        (0.0, 0.3 * (count - k) + 0.1, *y_m, rise_m * k / count, rise_m * (k + 1) / count)
        for k in range(count)
    ]
    return ledges(boxes, BASE)


def porch(y: float, top_m: float, kind: str, rng: VariantRng) -> list[Patch]:
    """A roof over an entrance on posts, or a slab on brackets."""
    half, out_m = rng.between(0.8, 1.4), rng.between(0.8, 1.6)
    if kind == "canopy":
        low = top_m + 0.1
        slab = ledges([(0.0, 0.7 * out_m, y - 0.7 * half, y + 0.7 * half, low, low + 0.09)], METAL)
        return [slab]
    z, rise, parts = top_m + 0.12, rng.between(0.4, 0.8), []
    beam = ledges([(0.0, out_m, y - half, y + half, z, z + 0.16)], TRIM)
    for side in (-1.0, 1.0):
        column = post(0.09, (0.0, z), (out_m - 0.12, y + side * (half - 0.12), 0.0), 8)
        parts.append(column.painted(TRIM))
    a, b, x, base = y - half - 0.1, y + half + 0.1, out_m + 0.1, z + 0.16
    ridge = (y, base + rise)
    left = quad([(0.0, a, base), (x, a, base), (x, *ridge), (0.0, *ridge)], METAL)
    right = quad([(x, b, base), (0.0, b, base), (0.0, *ridge), (x, *ridge)], METAL)
    front = polygon(x, np.array([(a, base), (b, base), ridge]), TRIM)
    return [beam, *parts, left, right, front]
