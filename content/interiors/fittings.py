"""Room fittings: lamps, curtains, rugs, pictures, mirrors, screens."""

import math
from dataclasses import replace

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.interiors.parts import (
    HOUSEHOLD,
    Box,
    Measures,
    board,
    cloth,
    disc,
    drawn,
    front,
    lacquer,
    rod,
    solid,
    wood,
)
from gen_data.content.interiors.wall_art import MOTIFS, PHOTOGRAPHS, is_upright
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.furniture import rectangle
from gen_data.content.procedural.material_presets import (
    ALUMINIUM,
    PALETTES,
    STAINLESS,
    draw_linear,
    metal_material,
    painted_material,
    patterned_material,
    printed_material,
)
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.core.asset_types import Keypoint, Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, variant_rng

LAMP = "lamp"
"""Role of slots that shine, and keypoint in the middle of the light."""


def _scaled(color: Vec3, factor: float) -> Vec3:
    r, g, b = color
    return (factor * r, factor * g, factor * b)


def _with_lamp(made: Solid, at_m: Vec3) -> Solid:
    return replace(made, keypoints=(Keypoint(LAMP, at_m, 0.2),))


def _shade(rng: VariantRng) -> Material:
    color = rng.choose(((0.86, 0.83, 0.76), (0.9, 0.9, 0.88), (0.7, 0.55, 0.38), (0.45, 0.5, 0.52)))
    return Material(color, 0.9, role=LAMP)


def _tube(r0: float, r1: float, z0: float, z1: float, slot: int) -> Patch:
    t = 0.003
    profile = [(r0, z0), (r1, z1), (r1 - t, z1), (r0 - t, z0), (r0, z0)]
    return shapes.lathe(profile, 40, slot)


def ceiling_lamp(rng: VariantRng) -> Solid:
    """A lamp under the ceiling, which is at z = 0. Slots: metal, shade."""
    options = (
        painted_material("#26282b", 0.4),
        metal_material(STAINLESS, 0.3),
        painted_material("#eeece6", 0.4),
    )
    paint = rng.choose(options)
    if rng.seed % 3 == 0:
        r, h = rng.between(0.16, 0.26, "radius_m"), rng.between(0.07, 0.12, "height_m")
        glow = shapes.lathe(
            [(r, -0.02), (r, -0.5 * h), (0.86 * r, -0.85 * h), (0.5 * r, -h), (0.0, -1.04 * h)][
                ::-1
            ],
            40,
            1,
        )
        patches = [disc(0, 0, -0.03, 0.0, r + 0.012, 0, 40), glow]
        made = solid(patches, [paint, _shade(rng)], [((-r, -r, -h), (r, r, 0.0))])
        return _with_lamp(made, (0.0, 0.0, -h - 0.06))
    drop = rng.between(0.35, 0.7)
    r, h = rng.between(0.16, 0.26, "radius_m"), rng.between(0.14, 0.24, "height_m")
    patches = [
        disc(0, 0, -0.025, 0.0, 0.05, 0),
        rod((0.0, 0.0, -drop + h), (0.0, 0.0, -0.02), 0.004, 0, 6),
        _tube(r, r * rng.between(0.35, 1.0), -drop, -drop + h, 1),
        shapes.ball(lambda d: 0.045 * d, 10, 16).moved(0.0, 0.0, -drop + 0.5 * h).painted(1),
        rod((-0.9 * r, 0.0, -drop + 0.95 * h), (0.9 * r, 0.0, -drop + 0.95 * h), 0.003, 0, 6),
    ]
    made = solid(patches, [paint, _shade(rng)], [((-r, -r, -drop), (r, r, -drop + h))])
    return _with_lamp(made, (0.0, 0.0, -drop - 0.02))


def tube_lamp(rng: VariantRng) -> Solid:
    """A long lamp under the ceiling, which is at z = 0. Slots: housing, tube."""
    w, d = rng.between(1.15, 1.5, "width_m"), rng.between(0.1, 0.2, "depth_m")
    box: Box = ((-0.5 * d, -0.5 * w, -0.06), (0.5 * d, 0.5 * w, 0.0))
    tube: Box = ((-0.4 * d, -0.48 * w, -0.075), (0.4 * d, 0.48 * w, -0.06))
    looks = [painted_material("#ecebe7", 0.4), Material((0.9, 0.9, 0.9), 0.6, role=LAMP)]
    made = solid([shapes.block(*box, 0.006), shapes.block(*tube, 0.005, 1)], looks, [box])
    return _with_lamp(made, (0.0, 0.0, -0.13))


def standing_lamp(family: str, seed: int, measures: Measures) -> Solid:
    """A lamp on a pole with a foot. Slots: metal, shade.

    Measures: height, radii of shade and foot.
    """
    rng = variant_rng(family, seed)
    z, r, foot_m = drawn(rng, measures).values()
    h = r * rng.between(0.9, 1.3)
    options = (
        metal_material(STAINLESS, 0.3),
        painted_material("#26282b", 0.4),
        metal_material((0.75, 0.58, 0.34), 0.3),
    )
    paint = rng.choose(options)
    patches = [
        disc(0, 0, 0.0, 0.02, foot_m, 0, 32),
        rod((0.0, 0.0, 0.01), (0.0, 0.0, z - 0.5 * h), 0.011, 0),
        _tube(r, r * rng.between(0.6, 1.0), z - h, z, 1),
        shapes.ball(lambda d: 0.03 * d, 10, 14).moved(0.0, 0.0, z - 0.4 * h).painted(1),
        rod((-0.6 * r, 0.0, z - 0.5 * h), (0.6 * r, 0.0, z - 0.5 * h), 0.003, 0, 6),
    ]
    boxes: list[Box] = [
        ((-foot_m, -foot_m, 0.0), (foot_m, foot_m, 0.03)),
        ((-0.7 * r, -0.7 * r, z - h), (0.7 * r, 0.7 * r, z)),
    ]
    return _with_lamp(solid(patches, [paint, _shade(rng)], boxes), (0.0, 0.0, z + 0.06))


def curtain(rng: VariantRng) -> Solid:
    """A curtain on a piece of rail; origin at the middle below. Slots: cloth, rail."""
    w, h = rng.between(0.4, 0.7, "width_m"), rng.between(2.1, 2.35, "height_m")
    count = round(w / 0.095)
    y = np.linspace(-0.5 * w, 0.5 * w, count * 10 + 1)[None, :]
    z = np.linspace(0.0, h, 24)[:, None]
    down = 1.0 - z / h
    # Pleats are even at the rail; below they open, lean and join, each in its own way.
    turn = 2.0 * math.pi * count * (y / w + 0.5)
    drift = np.zeros_like(y * z)
    for k in range(1, 4):
        phase, way = rng.between(0.0, 6.3), rng.between(-1.0, 1.0)
        drift = drift + way * np.sin(2.0 * math.pi * k * (y / w) + phase) / k
    sway = turn + 1.4 * down * drift
    depth = 0.017 + 0.016 * down**0.7 + 0.008 * down * np.sin(0.5 * turn + 2.0 * drift)
    x = depth * np.sin(sway) + 0.006 * down * np.sin(2.0 * sway + 1.0)
    # Towards the rail pleats are pinched: narrow ridges between flat cloth.
    pinch = np.clip(1.0 - (h - z) / 0.16, 0.0, 1.0)
    x = x * (1.0 - pinch) + pinch * 0.02 * np.clip(np.sin(turn), -0.3, 1.0)
    gather = 1.0 - rng.choose((0.0, 0.05, 0.12)) * np.sin(math.pi * np.clip(down * 1.1, 0.0, 1.0))
    hem = 0.012 + 0.008 * np.sin(sway[:1] * 0.5)
    points = np.stack(np.broadcast_arrays(x, y * gather, hem + z * (h - 0.012) / h), axis=2)
    sheet = shapes.grid(points)
    low = points[:3] + np.array([0.0035, 0.0, 0.0])
    patches = [
        sheet,
        sheet.flipped(),
        shapes.grid(low),
        rod((0.0, -0.5 * w - 0.04, h + 0.015), (0.0, 0.5 * w + 0.04, h + 0.015), 0.012, 1),
    ]
    for k in range(count + 1):
        at = (k / count - 0.5) * 0.98 * w
        ring = shapes.lathe(
            [(0.014, -0.002), (0.018, -0.002), (0.018, 0.002), (0.014, 0.002), (0.014, -0.002)],
            16,
            1,
        )
        patches.append(ring.rotated("x", 0.5 * math.pi).moved(0.0, at, h + 0.011))
    light = cloth(rng)
    made = replace(light, diffuse_transmission=_scaled(light.base_color, 0.3))
    looks = [made, metal_material(STAINLESS, 0.35)]
    return solid(patches, looks, [((-0.03, -0.5 * w, 0.0), (0.03, 0.5 * w, h))])


def rug(rng: VariantRng) -> Solid:
    """A rug, rectangular or round. Slots: pile, border."""
    pile = patterned_material(
        f"texture/carpet?seed={int(rng.between(0, 16))}", rng.between(0.4, 0.6), 1.0
    )
    edge = replace(pile, texture=f"texture/carpet?seed={int(rng.between(0, 16))}")
    t = 0.012
    if rng.seed % 4 == 3:
        r = rng.between(0.6, 1.0, "radius_m")
        patches = [disc(0, 0, 0, t, r, 0, 56)]
        return solid(patches, [pile, edge], [((-0.7 * r, -0.7 * r, 0.0), (0.7 * r, 0.7 * r, t))])
    x = 0.5 * rng.between(1.2, 2.0, "depth_m")
    y = 0.5 * rng.between(1.8, 3.0, "width_m")
    b = rng.between(0.04, 0.14)
    whole: Box = ((-x, -y, 0.0), (x, y, t))
    inner: Box = ((-x + b, -y + b, t - 0.001), (x - b, y - b, t + 0.001))
    return solid([shapes.block(*whole, 0.004, 1), shapes.block(*inner)], [pile, edge], [whole])


def photograph(seed: int, *, upright: bool) -> str:
    """Id of a photographic print."""
    kind = PHOTOGRAPHS[seed % len(PHOTOGRAPHS)]
    return f"texture/wall_art?seed={kind + MOTIFS * (2 * (seed // 4 % 3) + (not upright))}"


def picture(rng: VariantRng) -> Solid:
    """A framed picture; origin at the middle below, on the wall. Slots: frame, mount, print."""
    # From postcards to large prints; the small ones are common.
    long = rng.choose((rng.between(0.13, 0.24), rng.between(0.26, 0.45), rng.between(0.45, 0.92)))
    if rng.seed % 9 == 8:
        image, short, upright = f"texture/poster?seed={rng.seed % 12}", long / math.sqrt(2.0), True
    else:
        image, short = f"texture/wall_art?seed={rng.seed}", 0.75 * long
        upright = is_upright(rng.seed)
    wide, high = (short, long) if upright else (long, short)
    f = rng.between(0.01, 0.018 + 0.012 * long)
    mount = rng.choose((0.0, rng.between(0.1, 0.2) * long, rng.between(0.15, 0.3) * short))
    w, h = wide + 2.0 * (f + mount), high + 2.0 * (f + mount)
    deep = rng.between(0.014, 0.03, "depth_m")
    patches = _frame(w, h, f, deep, 0.002)
    y, a = 0.5 * wide, f + mount
    patches.append(rectangle((0.0112, -y, a), (0.0, wide, 0.0), (0.0, 0.0, high)).painted(2))
    back: Box = ((0.0, -0.5 * w + 0.004, 0.004), (0.01, 0.5 * w - 0.004, h - 0.004))
    patches.append(shapes.block(*back, 0.0, 1))
    if mount > 0.0:
        # The mount is a card with a window: its bevelled edge catches light.
        patches += [
            p.painted(1)
            for p in _frame(wide + 0.016, high + 0.016, 0.008, 0.0025, 0.0008, (0.01, a - 0.008))
        ]
    options = (
        painted_material("#1f1f20", 0.4),
        wood(rng),
        wood(rng),
        metal_material((0.8, 0.66, 0.38), 0.35),
        metal_material(ALUMINIUM, 0.4),
        painted_material("#f0efeb", 0.5),
    )
    edge = rng.choose(options)
    card = painted_material(rng.choose(("#f3f1ea", "#f7f6f2", "#e6e0d2", "#3a3b3d")), 0.85)
    gloss = 0.12 if rng.chance(0.6) else 0.7
    return solid(patches, [edge, card, printed_material(image, gloss)], [back])


def mirror(rng: VariantRng) -> Solid:
    """A mirror for walls; origin at the middle of its lower edge. Slots: frame, glass."""
    w, h = rng.between(0.45, 0.9, "width_m"), rng.between(0.6, 1.1, "height_m")
    f = rng.between(0.008, 0.04)
    glass = rectangle(
        (0.011, -0.5 * w + f, f), (0.0, w - 2 * f, 0.0), (0.0, 0.0, h - 2 * f)
    ).painted(1)
    back: Box = ((0.0, -0.5 * w + 0.004, 0.004), (0.01, 0.5 * w - 0.004, h - 0.004))
    silver = Material((0.93, 0.94, 0.93), 0.02, metallic=1.0, role="mirror")
    patches = [*_frame(w, h, f, 0.025), shapes.block(*back), glass]
    return solid(patches, [front(rng), silver], [back])


def _frame(
    w: float,
    h: float,
    f: float,
    depth_m: float,
    radius_m: float = 0.003,
    at_m: tuple[float, float] = (0.0, 0.0),
) -> list[Patch]:
    """Four bars around an opening; ``at_m``: back and lower edge."""
    y, (x, z) = 0.5 * w, at_m
    parts: list[Box] = [
        ((x, -y, z), (x + depth_m, y, z + f)),
        ((x, -y, z + h - f), (x + depth_m, y, z + h)),
        ((x, -y, z + f), (x + depth_m, -y + f, z + h - f)),
        ((x, y - f, z + f), (x + depth_m, y, z + h - f)),
    ]
    return [board(*p, 0, radius_m) for p in parts]


def radiator(rng: VariantRng) -> Solid:
    """A heater for walls; origin at the middle of its lower edge. Slots: panel, valve."""
    w, h = rng.between(0.6, 1.4, "width_m"), rng.between(0.4, 0.6, "height_m")
    count = round(w / 0.05)
    patches = [shapes.block((0.03, -0.5 * w, 0.0), (0.09, 0.5 * w, h), 0.008)]
    # A pressed sheet: waves, which shade softly at any distance, rather than ribs.
    y = np.linspace(-0.49 * w, 0.49 * w, 8 * count + 1)
    z = np.array([0.02, 0.035, h - 0.035, h - 0.02])
    rise = np.array([0.0, 1.0, 1.0, 0.0])[:, None]
    x = 0.0902 + 0.007 * rise * (0.5 - 0.5 * np.cos(2.0 * math.pi * count * (y / (0.98 * w) + 0.5)))
    sheet = shapes.grid(np.stack(np.broadcast_arrays(x, y[None, :], z[:, None]), axis=2))
    patches.append(sheet)
    patches += [
        rod((0.05, 0.5 * w, 0.06), (0.05, 0.5 * w + 0.06, 0.06), 0.018, 1, 14),
        rod((0.05, 0.5 * w + 0.05, 0.06), (0.05, 0.5 * w + 0.05, -0.1), 0.008, 1),
        shapes.block((0.0, -0.3 * w, 0.1), (0.03, -0.3 * w + 0.03, h - 0.1), 0.0),
        shapes.block((0.0, 0.3 * w, 0.1), (0.03, 0.3 * w + 0.03, h - 0.1), 0.0),
    ]
    looks = [painted_material("#f1f0ec", 0.35), painted_material("#e5e3dd", 0.4)]
    return solid(patches, looks, [((0.0, -0.5 * w, 0.0), (0.1, 0.5 * w, h))])


def screen(family: str, seed: int, measures: Measures) -> Solid:
    """A screen on its stand, on or off. Slots: housing, screen. Measures: width, lower edge."""
    w, lift_m = drawn(variant_rng(family, seed), measures).values()
    h = w * 9 / 16 + 0.02
    y = 0.5 * w
    panel: Box = ((-0.02, -y, lift_m), (0.015, y, lift_m + h))
    glass = rectangle(
        (0.0155, -y + 0.008, lift_m + 0.012), (0.0, w - 0.016, 0.0), (0.0, 0.0, h - 0.02)
    ).painted(1)
    patches = [shapes.block(*panel, 0.004), glass]
    if family == "monitor":
        patches += [
            shapes.block((-0.09, -0.11, 0.0), (0.09, 0.11, 0.012), 0.004),
            shapes.block((-0.045, -0.03, 0.01), (-0.02, 0.03, lift_m + 0.15), 0.004),
        ]
    else:
        for sy in (-1, 1):
            patches += [
                shapes.block(
                    (-0.1, sy * 0.36 * w - 0.012, 0.0), (0.1, sy * 0.36 * w + 0.012, 0.01), 0.003
                ),
                shapes.block(
                    (-0.01, sy * 0.36 * w - 0.01, 0.01),
                    (0.005, sy * 0.36 * w + 0.01, lift_m + 0.01),
                    0.002,
                ),
            ]
    points = [
        (-0.022, 0.12 * w, lift_m + 0.35 * h),
        (-0.05, 0.12 * w, lift_m + 0.12 * h),
        (-0.07, 0.1 * w, 0.02),
        (-0.085, 0.02 * w, 0.0045),
        (-0.09, -0.12 * w, 0.0045),
    ]
    drop = np.array(points)
    line = shapes.spline(drop.tolist(), 24)
    line[:, 2] = np.maximum(line[:, 2], 0.0042)
    patches.append(shapes.sweep(line, shapes.circle(0.0038, 7), up=(0.0, 1.0, 0.0)))
    patch = shapes.block(
        (-0.045, -0.3 * w, lift_m + 0.15 * h), (-0.02, 0.3 * w, lift_m + 0.6 * h), 0.006
    )
    patches.append(patch)
    dark = Material((0.01, 0.01, 0.011), 0.12, role="screen")
    foot: Box = ((-0.1, -0.4 * w, 0.0), (0.1, 0.4 * w, 0.012))
    return solid(patches, [painted_material("#17181a", 0.35), dark], [panel, foot])


def laptop(seed: int = 0) -> Solid:
    """A laptop without its lid. Slots: housing, keys."""
    rng, d, w = _laptop(seed)
    base: Box = ((-0.5 * d, -0.5 * w, 0.0), (0.5 * d, 0.5 * w, 0.016))
    patches = [shapes.block(*base, 0.004)]
    for row in range(5):
        for k in range(13):
            x, y = -0.5 * d + 0.04 + 0.02 * row, -0.44 * w + (k + 0.5) * 0.88 * w / 13
            patches.append(
                shapes.block((x - 0.008, y - 0.009, 0.015), (x + 0.008, y + 0.009, 0.0175), 0.0, 1)
            )
    patches.append(shapes.block((0.14 * d, -0.06, 0.0155), (0.42 * d, 0.06, 0.0165), 0.0, 1))
    made = solid(patches, [_housing(rng), painted_material("#1b1c1e", 0.5)], [base])
    return replace(made, keypoints=(Keypoint("lid", (-0.5 * d, 0.0, 0.016), 0.05),))


def laptop_lid(seed: int = 0) -> Solid:
    """The lid of the laptop of the same seed, closed along +X. Slots: housing, screen."""
    rng, d, w = _laptop(seed)
    lid: Box = ((0.0, -0.5 * w, 0.002), (d, 0.5 * w, 0.009))
    screen = rectangle(
        (d - 0.012, -0.5 * w + 0.01, 0.0015), (0.0, w - 0.02, 0.0), (-d + 0.03, 0.0, 0.0)
    )
    screen = screen.flipped().painted(1)
    looks = [_housing(rng), Material((0.01, 0.01, 0.011), 0.15, role="screen")]
    return solid([shapes.block(*lid, 0.003), screen], looks, [lid])


def _laptop(seed: int) -> tuple[VariantRng, float, float]:
    rng = variant_rng("laptop", seed)
    w = rng.between(0.3, 0.36, "width_m")
    return rng, 0.66 * w, w


def _housing(rng: VariantRng) -> Material:
    return metal_material(ALUMINIUM, 0.4) if rng.chance(0.6) else painted_material("#2a2c2f", 0.45)


def house_plant(rng: VariantRng) -> Solid:
    """A plant in a pot. Slots: pot, soil, leaves."""
    big = rng.turn((True, False), "big")
    r, h = (
        (rng.between(0.14, 0.2), rng.between(0.24, 0.36))
        if big
        else (rng.between(0.06, 0.09), rng.between(0.1, 0.15))
    )
    pot = shapes.lathe(
        [(0.0, 0.0), (0.75 * r, 0.0), (r, h), (0.92 * r, h), (0.9 * r, 0.85 * h), (0.0, 0.85 * h)],
        32,
    )
    soil = disc(0, 0, 0.84 * h, 0.88 * h, 0.9 * r, 1)
    patches = [pot, soil]
    count = rng.whole(16, 30, "count") if big else rng.whole(9, 16, "count")
    length = rng.between(0.45, 0.8, "length_m") if big else rng.between(0.12, 0.24, "length_m")
    for k in range(count):
        # Leaves grow the golden angle apart (Vogel, Mathematical Biosciences 44, 1979): to all
        # sides, which balances the plant.
        turn = k * math.pi * (3.0 - math.sqrt(5.0)) + rng.between(-0.4, 0.4)
        blade = _leaf(rng, length * rng.between(0.6, 1.0)).rotated("z", turn)
        patches.append(blade.moved(0.0, 0.0, 0.86 * h))
    green = (
        0.06 * rng.between(0.7, 1.2),
        0.16 * rng.between(0.7, 1.2),
        0.04 * rng.between(0.7, 1.2),
    )
    leaf = Material(green, 0.45, diffuse_transmission=_scaled(green, 0.8), role="leaf")
    color = draw_linear(("#b5643c", "#f0ede6", "#3a3d40", "#8a9a8d", "#d8c7ab"), 0.1, rng)
    clay = Material(color, 0.6)
    top = h + 0.6 * length
    boxes = [((-r, -r, 0.0), (r, r, h)), ((-0.6 * r, -0.6 * r, h), (0.6 * r, 0.6 * r, top))]
    return solid(patches, [clay, Material((0.05, 0.035, 0.025), 1.0), leaf], boxes)


def _leaf(rng: VariantRng, length: float) -> Patch:
    """A pointed, bent leaf on a stalk in the plane y = 0, from the origin outwards."""
    steps = 7
    lean, bend = rng.between(0.15, 0.7), rng.between(0.5, 1.5)
    s = np.linspace(0.0, 1.0, steps)
    angle = lean + bend * s * s
    x = np.concatenate([[0.0], np.cumsum(np.sin(angle[:-1]))]) * length / (steps - 1)
    z = np.concatenate([[0.0], np.cumsum(np.cos(angle[:-1]))]) * length / (steps - 1)
    wide = 0.14 * length * np.sin(np.pi * np.clip((s - 0.25) / 0.75, 0.0, 1.0)) + 0.004
    side = np.array([-1.0, 0.0, 1.0])
    axes = np.broadcast_arrays(
        x[:, None], wide[:, None] * side, z[:, None] + 0.15 * wide[:, None] * np.abs(side)
    )
    points = np.stack(axes, axis=2)
    sheet = shapes.grid(points, slot=2)
    return join_patches([sheet, sheet.flipped()])


def waste_basket(rng: VariantRng) -> Solid:
    """A waste basket. Slot: body."""
    r, h = rng.between(0.12, 0.17, "radius_m"), rng.between(0.26, 0.36, "height_m")
    profile = [
        (0.0, 0.0),
        (0.8 * r, 0.0),
        (r, h),
        (r + 0.006, h),
        (r + 0.006, h + 0.008),
        (r - 0.004, h + 0.008),
        (0.8 * r - 0.004, 0.006),
        (0.0, 0.006),
    ]
    body = shapes.lathe(profile, 36)
    paint = (
        Material(draw_linear(HOUSEHOLD, 0.1, rng), 0.4)
        if rng.chance(0.5)
        else painted_material("#2b2d30", 0.4)
    )
    return solid([body], [paint], [((-0.8 * r, -0.8 * r, 0.0), (0.8 * r, 0.8 * r, h))])


def wall_clock(rng: VariantRng) -> Solid:
    """A round clock for walls; origin at its lowest point. Slots: case, face, hands."""
    r = rng.between(0.12, 0.18, "radius_m")
    case = shapes.lathe(
        [(0.0, 0.0), (r, 0.0), (r, 0.035), (r - 0.012, 0.04), (r - 0.012, 0.025), (0.0, 0.025)], 48
    )
    patches = [case.rotated("y", 0.5 * math.pi).moved(0.0, 0.0, r)]
    face = shapes.fan(np.insert(shapes.circle(r - 0.013, 48), 0, 0.026, axis=1), 1)
    patches.append(face.moved(0.0, 0.0, r))
    for k in range(12):
        tick = shapes.block((0.0265, -0.003, 0.8 * r), (0.0275, 0.003, 0.88 * r), 0.0, 2)
        patches.append(tick.rotated("x", math.pi * k / 6).moved(0.0, 0.0, r))
    for length, wide in ((0.5, 0.005), (0.75, 0.0035)):
        hand = shapes.block((0.028, -wide, -0.1 * r), (0.0295, wide, length * r), 0.0, 2)
        patches.append(hand.rotated("x", rng.between(0.0, 2 * math.pi)).moved(0.0, 0.0, r))
    looks = [lacquer(rng), painted_material("#f6f4ee", 0.5), painted_material("#1c1c1d", 0.5)]
    return solid(patches, looks, [((0.0, -r, 0.0), (0.04, r, 2 * r))])


def whiteboard(rng: VariantRng) -> Solid:
    """A board to write on; origin at the middle below, on the wall. Slots: frame, board."""
    w, h = rng.between(1.2, 1.8, "width_m"), rng.between(0.9, 1.2, "height_m")
    back: Box = ((0.0, -0.5 * w + 0.004, 0.004), (0.012, 0.5 * w - 0.004, h - 0.004))
    tray: Box = ((0.0, -0.3 * w, -0.01), (0.06, 0.3 * w, 0.0))
    patches = [*_frame(w, h, 0.02, 0.022), shapes.block(*back, 0.0, 1), shapes.block(*tray, 0.003)]
    face = rectangle((0.0125, -0.5 * w + 0.02, 0.02), (0.0, w - 0.04, 0.0), (0.0, 0.0, h - 0.04))
    patches.append(face.painted(2))
    for k in range(int(rng.between(1, 5))):
        y = rng.between(-0.25, 0.2) * w
        patches.append(rod((0.03, y, 0.009), (0.03, y + 0.13, 0.009), 0.009, 3 + k % 3, 12))
    inks = [painted_material(ink, 0.4) for ink in ("#1f2a5a", "#a3261d", "#1f1f20")]
    written = printed_material(f"texture/whiteboard_notes?seed={rng.seed}", 0.15)
    looks = [metal_material(ALUMINIUM, 0.4), painted_material("#f5f6f5", 0.15), written, *inks]
    return solid(patches, looks, [back])


def book_row(rng: VariantRng) -> Solid:
    """Books that stand side by side, spines towards +X. Slots: one per cloth, pages last."""
    covers = [
        Material(draw_linear((*PALETTES["cloth"], *_JACKETS), 0.15, rng), rng.between(0.3, 0.8))
        for _ in range(9)
    ]
    band = Material(draw_linear(("#a08a55", "#a39e92", "#77757a"), 0.1, rng), 0.5)
    patches: list[Patch] = []
    y, tallest, end = 0.0, 0.0, rng.between(0.16, 0.4, "width_m")
    while y < end:
        # Series are alike; single books are not.
        thick, h, d = rng.between(0.01, 0.045), rng.between(0.165, 0.285), rng.between(0.12, 0.19)
        slot = int(rng.random() * 9)
        alike = rng.choose((1, 1, 1, 2, 3, 5))
        for _ in range(alike):
            x1 = 0.09 - rng.between(0.0, 0.014)
            patches += _standing_book((x1 - d, y, x1), thick, h, slot, rng)
            y, tallest = y + thick + 0.0008, max(tallest, h)
            if y > end:
                break
    if rng.chance(0.5):
        # The last ones lean against the row.
        for _ in range(int(rng.between(1, 3))):
            thick = rng.between(0.012, 0.03)
            h = rng.between(0.17, 0.24)
            lean = rng.between(0.1, 0.22)
            book = _standing_book((-0.06, 0.0, 0.08), thick, h, int(rng.random() * 9), rng)
            # About its lower edge on the outer side, towards the row.
            turned = [p.moved(0.0, -thick, 0.0).rotated("x", lean) for p in book]
            reach = min(float(p.bounds_m()[0][1]) for p in turned)
            patches += [p.moved(0.0, y - reach + 0.0005, 0.0) for p in turned]
            y -= reach
    low = min(float(p.bounds_m()[0][2]) for p in patches)
    patches = [p.moved(0.0, 0.0, -min(low, 0.0)) for p in patches]
    moved = [patch.moved(0.0, -0.5 * y, 0.0) for patch in patches]
    looks = [*covers, painted_material("#e9e2d0", 0.9), band]
    return solid(moved, looks, [((-0.1, -0.5 * y, 0.0), (0.09, 0.5 * y, tallest))])


_JACKETS = ("#f2efe6", "#e8dcc0", "#1c1d20", "#c0392b", "#e0a526", "#2c6e8f", "#3f6b4f", "#f7f7f4")
"""Colours of books' jackets, sRGB."""


def _standing_book(
    span: tuple[float, float, float], thick: float, h: float, slot: int, rng: VariantRng
) -> list[Patch]:
    """A book with its spine at +X; span: back, side and front. Pages in slot 9, print in 10."""
    x0, y, x1 = span
    made = [
        shapes.block((x0, y, 0.0), (x1, y + 0.002, h), 0.0, slot),
        shapes.block((x0, y + thick - 0.002, 0.0), (x1, y + thick, h), 0.0, slot),
        shapes.block((x1 - 0.003, y, 0.0), (x1, y + thick, h), 0.001, slot),
        shapes.block(
            (x0 + 0.004, y + 0.002, 0.004), (x1 - 0.003, y + thick - 0.002, h - 0.004), 0.0, 9
        ),
    ]
    # A title and an author on the spine: lines of small letters.
    for low, high in ((0.48, rng.between(0.62, 0.85)), (0.2, 0.38)):
        for line in range(1 if rng.chance(0.6) else 2):
            if rng.chance(0.7):
                side, wide = thick * (0.42 + 0.16 * line), 0.09 * thick
                print_ = rectangle(
                    (x1 + 0.0003, y + side, low * h), (0.0, wide, 0.0), (0.0, 0.0, (high - low) * h)
                )
                made.append(print_.painted(10))
    return made


def picture_frame(rng: VariantRng) -> Solid:
    """A framed photograph that stands, leaning back. Slots: frame, mount, print."""
    w = rng.between(0.1, 0.2, "width_m")
    h = rng.between(0.13, 0.24, "height_m")
    f = rng.between(0.008, 0.02)
    image = rectangle(
        (0.006, -0.5 * w + f, f), (0.0, w - 2 * f, 0.0), (0.0, 0.0, h - 2 * f)
    ).painted(2)
    patches = [
        *_frame(w, h, f, 0.014),
        shapes.block((0.0, -0.5 * w + 0.003, 0.003), (0.005, 0.5 * w - 0.003, h - 0.003), 0.0, 1),
        image,
    ]
    leaning = [patch.rotated("y", -0.22) for patch in patches]
    stand = board((-0.055, -0.015, 0.0), (-0.05, 0.015, 0.45 * h), 1)
    look = printed_material(photograph(rng.seed, upright=True), 0.15)
    boxes: list[Box] = [((-0.22 * h, -0.5 * w, 0.0), (0.014, 0.5 * w, h))]
    return solid([*leaning, stand], [front(rng), painted_material("#4a4038", 0.8), look], boxes)
