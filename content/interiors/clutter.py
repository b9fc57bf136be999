"""Small objects that lie about in homes, offices and workshops. Typical sizes, assumed."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.interiors.parts import (
    HOUSEHOLD,
    LACQUERS,
    Box,
    board,
    cushion,
    disc,
    front,
    lacquer,
    rod,
    solid,
    wood,
)
from gen_data.content.interiors.soft_goods import fabric
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.books import COVER_ATLAS
from gen_data.content.procedural.material_presets import (
    GLAZES,
    PALETTES,
    STAINLESS,
    STEEL,
    draw_linear,
    metal_material,
    painted_material,
    patterned_material,
    printed_material,
)
from gen_data.content.procedural.patches import Patch
from gen_data.core.asset_types import Keypoint, Material
from gen_data.core.keypoint_names import SUPPORT
from gen_data.core.variant_rng import VariantRng

_PAPER = painted_material("#f5f3ec", 0.85)
_DARK = painted_material("#1d1e20", 0.5)


def _plastic(rng: VariantRng) -> Material:
    return Material(draw_linear(HOUSEHOLD, 0.1, rng), 0.4)


def book_stack(rng: VariantRng) -> Solid:
    """Books lying on each other. Slots: covers, pages."""
    patches: list[Patch] = []
    z, reach = 0.0, [0.0, 0.0]
    for k in range(rng.whole(2, 7, "count")):
        x, y, t = rng.between(0.075, 0.1), rng.between(0.1, 0.13), rng.between(0.012, 0.04)
        parts = [
            shapes.block((-x, -y, 0.0), (x, y, 0.002), 0.0, k % 4),
            shapes.block((-x, -y, t - 0.002), (x, y, t), 0.0, k % 4),
            shapes.block((-x, -y, 0.0), (-x + 0.003, y, t), 0.001, k % 4),
            shapes.block(
                (-x + 0.003, -y + 0.004, 0.002), (x - 0.004, y - 0.004, t - 0.002), 0.0, 4
            ),
        ]
        turn = rng.between(-0.25, 0.25) if k else 0.0
        patches += [part.rotated("z", turn).moved(0.0, 0.0, z) for part in parts]
        z, reach = z + t + 0.0002, [max(reach[0], x), max(reach[1], y)]
    covers = [
        Material(draw_linear(PALETTES["cloth"], 0.15, rng), rng.between(0.35, 0.8))
        for _ in range(4)
    ]
    x, y = reach
    return solid(patches, [*covers, painted_material("#e9e2d0", 0.9)], [((-x, -y, 0.0), (x, y, z))])


def magazine(rng: VariantRng) -> Solid:
    """A magazine. Slots: pages, cover."""
    x, y, t = 0.14, 0.105, rng.between(0.003, 0.007, "thickness_m")
    body: Box = ((-x, -y, 0.0), (x, y, t))
    # The front of a cover's sheet.
    u0, v0, u1, v1 = COVER_ATLAS["front"]
    corners = [[(x, -y, t + 2e-4), (x, y, t + 2e-4)], [(-x, -y, t + 2e-4), (-x, y, t + 2e-4)]]
    face = shapes.grid(np.array(corners), np.array([u0, u1]), np.array([v0, v1]))
    look = printed_material(f"texture/book_cover?seed={rng.seed}", 0.3)
    return solid([shapes.block(*body), face.painted(1)], [_PAPER, look], [body])


def paper_stack(rng: VariantRng) -> Solid:
    """Sheets of paper in a loose stack, A4 (ISO 216). Slot: paper."""
    patches: list[Patch] = []
    z = 0.0
    for _ in range(rng.whole(2, 7, "count")):
        t = rng.between(0.0008, 0.006)
        sheet = shapes.block((-0.1485, -0.105, 0.0), (0.1485, 0.105, t))
        turned = sheet.rotated("z", rng.between(-0.12, 0.12))
        patches.append(turned.moved(rng.between(-0.01, 0.01), rng.between(-0.01, 0.01), z))
        z += t
    return solid(patches, [_PAPER], [((-0.15, -0.11, 0.0), (0.15, 0.11, z))])


def binder_row(rng: VariantRng) -> Solid:
    """Binders side by side, spines towards +X. Slots: covers, labels."""
    patches: list[Patch] = []
    y, count = 0.0, rng.whole(2, 8, "count")
    for _ in range(count):
        t = rng.choose((0.05, 0.08))
        slot = 0 if rng.chance(0.5) else 1
        patches += [
            shapes.block((-0.14, y + 0.001, 0.0), (0.14, y + t - 0.001, 0.318), 0.002, slot),
            shapes.block((0.14, y + 0.2 * t, 0.12), (0.1405, y + 0.8 * t, 0.27), 0.0, 2),
            disc(0.0, 0.0, 0.0, 0.001, 0.011, 3, 16)
            .rotated("y", 0.5 * math.pi)
            .moved(0.14, y + 0.5 * t, 0.06),
        ]
        y += t
    moved = [patch.moved(0.0, -0.5 * y, 0.0) for patch in patches]
    colors = ("#1d1e20", "#28406b", "#7c2327", "#3f5d3a", "#d9d6cf", "#5b5f64")
    looks = [painted_material(rng.choose(colors), 0.5) for _ in range(2)]
    box: Box = ((-0.14, -0.5 * y, 0.0), (0.14, 0.5 * y, 0.318))
    return solid(moved, [*looks, _PAPER, _DARK], [box])


def pen_cup(rng: VariantRng) -> Solid:
    """A cup with pens. Slots: cup, pens."""
    r, h = rng.between(0.034, 0.042, "radius_m"), rng.between(0.09, 0.11, "height_m")
    profile = [(0.0, 0.0), (r, 0.0), (r, h), (r - 0.003, h), (r - 0.003, 0.004), (0.0, 0.004)]
    cup = shapes.lathe(profile, 28)
    patches = [cup]
    for k in range(int(rng.between(4, 10))):
        a = rng.between(0.0, 2.0 * math.pi)
        low, high = 0.35 * r, 0.85 * r
        c, s = math.cos(a), math.sin(a)
        top = h + rng.between(0.02, 0.07)
        patch = rod((-low * c, -low * s, 0.006), (high * c, high * s, top), 0.004, 1 + k % 3, 8)
        patches.append(patch)
    looks = [lacquer(rng), _DARK, _plastic(rng), painted_material("#e9b93a", 0.5)]
    return solid(patches, looks, [((-r, -r, 0.0), (r, r, h))])


def desk_lamp(rng: VariantRng) -> Solid:
    """A lamp with a jointed arm. Slots: metal, shade, bulb."""
    a, b = rng.between(0.3, 0.4), rng.between(0.26, 0.34)
    lean, reach = rng.between(-0.5, -0.25), rng.between(0.9, 1.3, "reach_m")
    elbow = (math.sin(lean) * a, 0.0, 0.02 + math.cos(lean) * a)
    head = (elbow[0] + math.sin(reach) * b, 0.0, elbow[2] + math.cos(reach) * b)
    shade = shapes.lathe(
        [(0.065, -0.08), (0.03, 0.0), (0.022, 0.03), (0.0, 0.03), (0.0, 0.028), (0.02, 0.028),
         (0.028, -0.002), (0.063, -0.08), (0.065, -0.08)],
        30,
        1,
    )  # fmt: skip
    bulb = shapes.ball(lambda d: 0.026 * d, 10, 14).painted(2).moved(0.0, 0.0, -0.03)
    patches = [
        disc(0.0, 0.0, 0.0, 0.022, 0.085, 0, 32),
        rod((0.0, 0.0, 0.02), elbow, 0.008, 0),
        rod(elbow, head, 0.008, 0),
        *(p.rotated("y", -0.25).moved(*head) for p in (shade, bulb)),
    ]
    paint = painted_material(rng.choose(("#26282b", "#e9e7e1", "#a3261d", "#3d5a4c")), 0.35)
    glow = Material((0.9, 0.88, 0.84), 0.6, role="lamp")
    boxes: list[Box] = [
        ((-0.08, -0.08, 0.0), (0.08, 0.08, 0.022)),
        ((-0.1, -0.06, 0.02), (head[0], 0.06, head[2])),
    ]
    made = solid(patches, [metal_material(STAINLESS, 0.3), paint, glow], boxes)
    # Under the shade, which is turned by a quarter radian.
    below = (head[0] + 0.03, 0.0, head[2] - 0.116)
    return replace(made, keypoints=(Keypoint("lamp", below, 0.2),))


def dish_rack(rng: VariantRng) -> Solid:
    """Plates, cups and bowls that drain. Slots: wire, dishes, tray."""
    x, y = 0.16, 0.5 * rng.between(0.36, 0.46, "width_m")
    patches: list[Patch] = [shapes.block((-x, -y, 0.0), (x, y, 0.012), 0.004, 3)]
    for z in (0.025, 0.11):
        loop = [(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)]
        for (x0, y0), (x1, y1) in pairwise(loop):
            patches.append(rod((x0 * 0.95, y0 * 0.95, z), (x1 * 0.95, y1 * 0.95, z), 0.003, 0, 6))
    for k in range(int(rng.between(3, 9))):
        at, r = -0.8 * y + 0.035 * k, rng.choose((0.1, 0.125))
        plate = shapes.lathe(
            [(0.0, 0.0), (0.6 * r, 0.0), (r, 0.018), (r, 0.022), (0.6 * r, 0.005), (0.0, 0.005)],
            32,
            1,
        )
        patches.append(plate.rotated("x", -0.5 * math.pi + 0.18).moved(-0.03, at, 0.03 + r))
    for k in range(int(rng.between(0, 3))):
        r, h = 0.04, 0.09
        cup = shapes.lathe(
            [
                (0.0, h),
                (r, h),
                (0.85 * r, 0.0),
                (0.8 * r, 0.0),
                (0.94 * r, h - 0.004),
                (0.0, h - 0.004),
            ][::-1],
            26,
            2,
        )
        patches.append(cup.moved(0.09, 0.75 * y - 0.09 * k, 0.03))
    glaze = [Material(draw_linear(GLAZES, 0.05, rng), 0.12) for _ in range(2)]
    looks = [metal_material(STAINLESS, 0.25), *glaze, _plastic(rng)]
    return solid(patches, looks, [((-x, -y, 0.0), (x, y, 0.2))])


def plate_stack(rng: VariantRng) -> Solid:
    """Plates or bowls on each other. Slot: glaze."""
    r, deep = rng.between(0.1, 0.135, "radius_m"), rng.turn((False, True), "deep")
    rise, step = (0.06, 0.018) if deep else (0.02, 0.0085)
    radius = 0.7 * r if deep else r
    profile = [(0.0, 0.0), (0.55 * radius, 0.0), (radius, rise), (radius - 0.003, rise + 0.002),
               (0.52 * radius, 0.005), (0.0, 0.005)]  # fmt: skip
    count = rng.whole(2, 8, "count")
    one = shapes.lathe(profile, 36)
    patches = [
        one.moved(rng.between(-1, 1) * 0.002, rng.between(-1, 1) * 0.002, k * step)
        for k in range(count)
    ]
    top = rise + (count - 1) * step
    glaze = Material(draw_linear(GLAZES, 0.08, rng), 0.15)
    boxes = [((-0.7 * radius, -0.7 * radius, 0.0), (0.7 * radius, 0.7 * radius, top))]
    return solid(patches, [glaze], boxes)


def fruit_bowl(rng: VariantRng) -> Solid:
    """A bowl with apples and oranges. Slots: bowl, fruit."""
    r, h = rng.between(0.12, 0.15, "radius_m"), rng.between(0.06, 0.085, "height_m")
    profile = [(0.0, 0.0), (0.45 * r, 0.0), (0.8 * r, 0.4 * h), (r, h), (r - 0.005, h),
               (0.77 * r, 0.42 * h), (0.43 * r, 0.006), (0.0, 0.006)]  # fmt: skip
    patches = [shapes.lathe(profile, 40)]
    places = [(0.055, 0.2 + 2.0 * math.pi * k / 5, 0.045) for k in range(5)] + [(0.0, 0.0, 0.1)]
    for k, (away, a, z) in enumerate(places):
        size = rng.between(0.034, 0.04)
        fruit = shapes.ball(lambda d: d * (1.0, 1.0, 0.92), 12, 18).scaled(size, size, size)
        patches.append(fruit.painted(1 + k % 2).moved(away * math.cos(a), away * math.sin(a), z))
    skins = [
        Material(draw_linear(("#b32d22", "#c7a52c", "#7fa33a"), 0.1, rng), 0.3),
        Material(draw_linear(("#e08a1e", "#d9791a"), 0.05, rng), 0.45),
    ]
    bowl = wood(rng) if rng.chance(0.4) else Material(draw_linear(GLAZES, 0.08, rng), 0.15)
    return solid(patches, [bowl, *skins], [((-0.7 * r, -0.7 * r, 0.0), (0.7 * r, 0.7 * r, 0.13))])


def knife_block(rng: VariantRng) -> Solid:
    """Knives in a leaning block of wood. Slots: wood, handles, steel."""
    block = board((-0.05, -0.05, 0.0), (0.05, 0.05, 0.2), 0, 0.004).rotated("y", -0.35)
    patches = [block.moved(0.03, 0.0, 0.017)]
    for row in range(2):
        for k in range(3):
            knob = shapes.block((-0.01, -0.007, 0.0), (0.01, 0.007, 0.1), 0.003, 1)
            turned = knob.moved(-0.02 + 0.045 * row, (k - 1) * 0.03, 0.2).rotated("y", -0.35)
            patches.append(turned.moved(0.03, 0.0, 0.017))
    patches.append(board((-0.085, -0.05, 0.0), (0.075, 0.05, 0.018), 0, 0.002))
    box: Box = ((-0.08, -0.05, 0.0), (0.075, 0.05, 0.2))
    return solid(patches, [wood(rng), _DARK], [box])


def utensil_pot(rng: VariantRng) -> Solid:
    """A pot with wooden spoons and ladles. Slots: pot, wood, steel."""
    r, h = rng.between(0.05, 0.065, "radius_m"), rng.between(0.13, 0.17, "height_m")
    profile = [(0.0, 0.0), (0.9 * r, 0.0), (r, h), (r - 0.005, h), (0.86 * r, 0.006), (0.0, 0.006)]
    pot = shapes.lathe(profile, 30)
    patches = [pot]
    for _ in range(int(rng.between(3, 8))):
        a, top = rng.between(0.0, 2.0 * math.pi), h + rng.between(0.1, 0.18)
        c, s = math.cos(a), math.sin(a)
        tip = (1.1 * r * c, 1.1 * r * s, top)
        slot = 1 if rng.chance(0.6) else 2
        patches.append(rod((-0.4 * r * c, -0.4 * r * s, 0.01), tip, 0.005, slot, 8))
        head = shapes.ball(lambda d: d * (0.016, 0.022, 0.034), 8, 12).painted(slot)
        patches.append(head.moved(*tip))
    looks = [
        Material(draw_linear(GLAZES, 0.08, rng), 0.2),
        wood(rng, 0.6),
        metal_material(STAINLESS, 0.25),
    ]
    return solid(patches, looks, [((-0.9 * r, -0.9 * r, 0.0), (0.9 * r, 0.9 * r, h))])


def spice_rack(rng: VariantRng) -> Solid:
    """Small jars in two rows of a rack. Slots: rack, glass, caps, spices."""
    w = rng.between(0.28, 0.4, "width_m")
    patches: list[Patch] = [
        board((-0.06, -0.5 * w, 0.0), (0.06, -0.5 * w + 0.012, 0.26)),
        board((-0.06, 0.5 * w - 0.012, 0.0), (0.06, 0.5 * w, 0.26)),
    ]
    count = int((w - 0.03) / 0.05)
    for row in range(2):
        z = 0.13 * row + 0.004
        patches.append(board((-0.055, -0.5 * w + 0.012, z), (0.055, 0.5 * w - 0.012, z + 0.012)))
        patch = board((0.048, -0.5 * w + 0.012, z + 0.03), (0.056, 0.5 * w - 0.012, z + 0.05))
        patches.append(patch)
        for k in range(count):
            y = (k + 0.5) * (w - 0.03) / count - 0.5 * w + 0.015
            if rng.chance(0.15):
                continue
            patches.append(disc(0.0, y, z + 0.012, z + 0.075, 0.021, 2 + k % 3, 18))
            patches.append(disc(0.0, y, z + 0.075, z + 0.093, 0.0215, 1, 18))
    spices = [
        Material(draw_linear((c,), 0.15, rng), 0.3) for c in ("#7a3b16", "#7d8a3a", "#c79a2e")
    ]
    box: Box = ((-0.06, -0.5 * w, 0.0), (0.06, 0.5 * w, 0.26))
    looks = [front(rng), rng.choose((_DARK, metal_material(STAINLESS, 0.3))), *spices]
    return solid(patches, looks, [box])


def paper_towel(rng: VariantRng) -> Solid:
    """Kitchen paper on a stand. Slots: stand, paper."""
    r = rng.between(0.045, 0.065, "radius_m")
    roll = shapes.lathe([(0.02, 0.015), (r, 0.015), (r, 0.24), (0.02, 0.24), (0.02, 0.015)], 32, 1)
    patches = [disc(0, 0, 0.0, 0.014, 0.075, 0, 32), rod((0, 0, 0.01), (0, 0, 0.3), 0.008, 0), roll]
    stand = wood(rng) if rng.chance(0.5) else metal_material(STAINLESS, 0.25)
    looks = [stand, painted_material("#f6f5f1", 0.95)]
    return solid(patches, looks, [((-0.055, -0.055, 0.0), (0.055, 0.055, 0.26))])


def toothbrush_cup(rng: VariantRng) -> Solid:
    """A cup with toothbrushes. Slots: cup, brushes."""
    r, h = 0.036, rng.between(0.09, 0.11, "height_m")
    profile = [(0.0, 0.0), (r, 0.0), (1.05 * r, h), (r, h), (0.92 * r, 0.005), (0.0, 0.005)]
    cup = shapes.lathe(profile, 28)
    patches = [cup]
    for k in range(rng.turn((1, 2, 3), "count")):
        a = 2.1 * k + rng.between(0.0, 1.0)
        c, s = math.cos(a), math.sin(a)
        tip = (0.95 * r * c, 0.95 * r * s, h + 0.08)
        patches.append(rod((-0.5 * r * c, -0.5 * r * s, 0.008), tip, 0.0035, 1 + k % 2, 8))
        patch = shapes.block((-0.004, -0.006, -0.025), (0.012, 0.006, 0.0), 0.002, 3).moved(*tip)
        patches.append(patch)
    looks = [
        Material(draw_linear(GLAZES, 0.08, rng), 0.2),
        _plastic(rng),
        _plastic(rng),
        painted_material("#f2f4f4", 0.7),
    ]
    return solid(patches, looks, [((-r, -r, 0.0), (r, r, h))])


def shampoo(rng: VariantRng) -> Solid:
    """A bottle of shampoo or shower gel. Slots: bottle, cap, label."""
    x = 0.5 * rng.between(0.036, 0.052, "depth_m")
    y = 0.5 * rng.between(0.056, 0.08, "width_m")
    h = rng.between(0.15, 0.22, "height_m")
    body = shapes.rounded_box((2 * x, 2 * y, h), 0.95 * x, 4).moved(0.0, 0.0, 0.5 * h)
    flat = disc(0.0, 0.0, 0.0, 0.012, 0.9 * x, 0, 20)
    cap = disc(0.0, 0.0, h - 0.006, h + 0.025, 0.6 * x, 1, 20)
    label: Box = ((x - 0.001, -0.7 * y, 0.25 * h), (x + 0.0006, 0.7 * y, 0.72 * h))
    looks = [
        _plastic(rng),
        _plastic(rng),
        printed_material(f"texture/book_cover?seed={rng.seed + 5}", 0.35),
    ]
    patches = [body, flat, cap, shapes.block(*label, 0.0, 2)]
    return solid(patches, looks, [((-x, -y, 0.0), (x, y, h))])


def toilet_brush(rng: VariantRng) -> Solid:
    """A toilet brush in its pot. Slots: pot, handle."""
    pot = shapes.lathe([(0.0, 0.0), (0.05, 0.0), (0.045, 0.14), (0.02, 0.15), (0.0, 0.15)], 28)
    patches = [
        pot,
        rod((0.0, 0.0, 0.14), (0.0, 0.0, 0.38), 0.008, 1),
        disc(0, 0, 0.15, 0.16, 0.04, 1),
    ]
    look = metal_material(STAINLESS, 0.3) if rng.chance(0.5) else painted_material("#f2f1ee", 0.35)
    return solid(patches, [look, look], [((-0.045, -0.045, 0.0), (0.045, 0.045, 0.16))])


def bathroom_scale(rng: VariantRng) -> Solid:
    """A scale to stand on. Slots: body, display."""
    body: Box = ((-0.15, -0.15, 0.0), (0.15, 0.15, 0.028))
    display: Box = ((0.08, -0.045, 0.0275), (0.12, 0.045, 0.0288))
    paint = painted_material(rng.choose(("#f2f2f0", "#1d1e20", "#b9c2bd")), 0.15)
    patches = [shapes.block(*body, 0.01), shapes.block(*display, 0.0, 1)]
    return solid(patches, [paint, _DARK], [body])


def power_strip(rng: VariantRng) -> Solid:
    """A strip of sockets with a curled cable. Slots: body, sockets, cable."""
    count = rng.turn((3, 4, 5, 6), "sockets")
    half = 0.5 * (0.045 * count + 0.05)
    body: Box = ((-0.026, -half, 0.0), (0.026, half, 0.038))
    patches = [shapes.block(*body, 0.006)]
    for k in range(count):
        patches.append(disc(0.0, -half + 0.045 * (k + 1), 0.0372, 0.0386, 0.018, 1, 20))
    path = [(0.0, half, 0.012)]
    for k in range(7):
        a = 0.9 * k
        path.append((0.11 * math.sin(a) + rng.between(-0.02, 0.02), half + 0.1 + 0.045 * k, 0.006))
    cable = shapes.sweep(shapes.spline(path, 44), shapes.circle(0.004, 8), slot=2)
    pale = painted_material(rng.choose(("#f0efeb", "#1d1e20")), 0.45)
    return solid([*patches, cable], [pale, _DARK, pale], [body])


def game_box(rng: VariantRng) -> Solid:
    """Boxes of games or puzzles on each other. Slots: sides, prints."""
    patches: list[Patch] = []
    z, x, y = 0.0, 0.0, 0.0
    drawn = (rng.between(0.13, 0.19) for _ in range(rng.turn((1, 2, 3), "count")))
    sizes = sorted(drawn, reverse=True)
    for k, b in enumerate(sizes):
        a, t = min(b, rng.between(0.13, 0.15)), rng.between(0.04, 0.07)
        points = [[(a, -b, t + 3e-4), (a, b, t + 3e-4)], [(-a, -b, t + 3e-4), (-a, b, t + 3e-4)]]
        part = [
            shapes.block((-a, -b, 0.0), (a, b, t), 0.002, k % 2),
            shapes.grid(np.array(points)).painted(2),
        ]
        turn = rng.between(-0.1, 0.1) if k else 0.0
        patches += [p.rotated("z", turn).moved(0.0, 0.0, z) for p in part]
        z, x, y = z + t + 3e-4, max(x, a), max(y, b)
    colors = [Material(draw_linear(PALETTES["cloth"], 0.2, rng), 0.45) for _ in range(2)]
    look = printed_material(f"texture/book_cover?seed={rng.seed + 9}", 0.35)
    return solid(patches, [*colors, look], [((-x, -y, 0.0), (x, y, z))])


def plush_toy(rng: VariantRng) -> Solid:
    """A sitting bear or rabbit of plush. Slots: plush, belly, eyes."""
    s = rng.between(0.8, 1.3, "scale")
    rabbit = rng.turn((False, False, True), "rabbit")

    def lump(x: float, y: float, z: float, a: float, b: float, c: float, slot: int = 0) -> Patch:
        ball = shapes.ball(lambda d: d * (a, b, c), 12, 18).painted(slot).moved(x, y, z)
        # Flat where it sits.
        return replace(ball, corners_m=np.maximum(ball.corners_m, (-9.0, -9.0, 0.0)))

    patches = [
        lump(0.0, 0.0, 0.068, 0.07, 0.08, 0.085),
        lump(0.045, 0.0, 0.08, 0.035, 0.055, 0.06, 1),
        lump(0.01, 0.0, 0.205, 0.06, 0.066, 0.058),
        lump(0.06, 0.0, 0.19, 0.026, 0.03, 0.022, 1),
    ]
    for sy in (-1, 1):
        patches += [
            lump(0.085, sy * 0.062, 0.025, 0.055, 0.034, 0.034),
            lump(0.05, sy * 0.085, 0.12, 0.03, 0.026, 0.05),
            lump(
                0.0,
                sy * (0.032 if rabbit else 0.052),
                0.29 if rabbit else 0.255,
                0.012,
                0.018 if rabbit else 0.024,
                0.06 if rabbit else 0.024,
            ),
            lump(0.063, sy * 0.026, 0.22, 0.006, 0.006, 0.006, 2),
        ]
    moved = [patch.scaled(s, s, s) for patch in patches]
    color = draw_linear(("#8a5a34", "#c9a77a", "#5b4636", "#e6dccb", "#b9a7b7"), 0.1, rng)
    fur = Material(color, 1.0)
    belly = Material(draw_linear(("#e9d9bf", "#f0ebe2"), 0.05, rng), 1.0)
    box: Box = ((-0.06 * s, -0.09 * s, 0.0), (0.12 * s, 0.09 * s, 0.25 * s))
    return solid(moved, [fur, belly, painted_material("#101010", 0.1)], [box])


def backpack(rng: VariantRng) -> Solid:
    """A rucksack that stands. Slots: cloth, straps."""
    x = 0.5 * rng.between(0.18, 0.24, "depth_m")
    y = 0.5 * rng.between(0.28, 0.34, "width_m")
    h = rng.between(0.4, 0.5, "height_m")
    patches = [
        cushion((-x, -y, 0.0), (x, y, h), 0, 0.06),
        cushion((0.7 * x, -0.75 * y, 0.03), (x + 0.05, 0.75 * y, 0.5 * h), 0, 0.03),
        cushion((-x, -y, 0.0), (x, y, 0.05), 1, 0.024),
    ]
    for sy in (-1, 1):
        path = [
            (-x + 0.01, sy * 0.08, 0.93 * h),
            (-x - 0.05, sy * 0.09, 0.7 * h),
            (-x + 0.01, sy * 0.1, 0.15 * h),
        ]
        section = np.array([(-0.006, -0.028), (0.006, -0.028), (0.006, 0.028), (-0.006, 0.028)])
        patches.append(shapes.sweep(shapes.spline(path, 12), section, up=(1.0, 0.0, 0.0), slot=1))
    color = draw_linear(("#26323f", "#3d3d3f", "#7a2f33", "#3f5d3a", "#4b4064"), 0.15, rng)
    dark = Material(color, 0.85)
    return solid(patches, [dark, _DARK], [((-x, -y, 0.0), (x + 0.04, y, h))])


def guitar(rng: VariantRng) -> Solid:
    """A guitar on its stand. Slots: wood, fingerboard, top, stand."""
    t = np.linspace(0.0, 2.0 * math.pi, 49)[:-1]
    radius = 0.165 + 0.03 * np.cos(2.0 * t) + 0.028 * np.cos(t) * np.cos(t) * -np.cos(t)
    outline = np.stack([radius * np.sin(t) * 0.98, -1.25 * radius * np.cos(t)], axis=1)
    body = shapes.extrude(outline, -0.05, 0.05)
    top = shapes.extrude(outline * 0.985, 0.05, 0.0515).painted(2)
    parts = [
        body.painted(0),
        top,
        disc(0.0, 0.02, 0.0515, 0.0522, 0.048, 1, 30),
        shapes.block((-0.03, 0.1, 0.05), (0.03, 0.6, 0.07), 0.004, 1),
        shapes.block((-0.038, 0.6, 0.05), (0.038, 0.76, 0.066), 0.006, 0),
        shapes.block((-0.05, -0.12, 0.05), (0.05, -0.1, 0.06), 0.003, 1),
    ]
    # Upright: its length along Z, its top towards +X.
    stood = [p.rotated("x", 0.5 * math.pi).rotated("z", 0.5 * math.pi) for p in parts]
    lowest = min(float(p.corners_m[..., 2].min()) for p in stood)
    stood = [p.moved(0.0, 0.0, 0.06 - lowest).rotated("y", -0.16) for p in stood]
    legs = [rod((0.12, 0.0, 0.2), (0.14, sy * 0.16, 0.0), 0.009, 3) for sy in (-1, 1)] + [
        rod((-0.06, 0.0, 0.35), (-0.24, 0.0, 0.0), 0.009, 3),
        rod((-0.06, 0.0, 0.35), (0.13, 0.0, 0.07), 0.009, 3),
    ]
    look = Material(draw_linear(("#7a4a22", "#5b2b16", "#26282b"), 0.1, rng), 0.25, coat=0.6)
    spruce = Material(draw_linear(("#d9a766", "#c98f4a", "#26282b"), 0.05, rng), 0.25, coat=0.6)
    box: Box = ((-0.24, -0.17, 0.0), (0.14, 0.17, 0.6))
    return solid([*stood, *legs], [look, painted_material("#2b1d14", 0.4), spruce, _DARK], [box])


def dumbbells(rng: VariantRng) -> Solid:
    """A pair of dumbbells. Slots: heads, bars."""
    r = rng.between(0.035, 0.05, "radius_m")
    patches: list[Patch] = []
    for x in (-1.2 * r, 1.2 * r):
        patches.append(rod((x, -0.075, r), (x, 0.075, r), 0.014, 1, 12))
        patches += [rod((x, sy * 0.06, r), (x, sy * 0.13, r), r, 0, 6) for sy in (-1, 1)]
    head = painted_material(rng.choose(("#1d1e20", "#7a2f5a", "#2f5d7c")), 0.5)
    lowest = min(float(p.corners_m[..., 2].min()) for p in patches)
    moved = [p.moved(0.0, 0.0, -lowest) for p in patches]
    looks = [head, metal_material(STEEL, 0.3)]
    return solid(moved, looks, [((-2.2 * r, -0.13, 0.0), (2.2 * r, 0.13, 2 * r))])


def step_stool(rng: VariantRng) -> Solid:
    """Two steps to stand on. Slots: steps, legs."""
    w = rng.between(0.36, 0.42, "width_m")
    y = 0.5 * w
    steps: list[Box] = [((-0.22, -y, 0.4), (0.02, y, 0.425)), ((-0.02, -y, 0.2), (0.22, y, 0.225))]
    sides: list[Box] = [
        ((-0.22, sy * y - 0.01, 0.0), (0.2, sy * y + 0.01, 0.2)) for sy in (-0.94, 0.94)
    ] + [((-0.22, sy * y - 0.01, 0.2), (0.0, sy * y + 0.01, 0.4)) for sy in (-0.94, 0.94)]
    look = front(rng)
    boxes = [*steps, *sides]
    return solid([board(*b) for b in steps] + [board(*b, 1) for b in sides], [look, look], boxes)


def drill(rng: VariantRng) -> Solid:
    """A cordless drill that stands on its battery. Slots: body, rubber, steel."""
    patches = [
        shapes.block((-0.05, -0.035, 0.0), (0.06, 0.035, 0.045), 0.008, 1),
        cushion((-0.02, -0.018, 0.04), (0.022, 0.018, 0.16), 1, 0.014),
        rod((-0.055, 0.0, 0.18), (0.085, 0.0, 0.18), 0.031, 0, 20),
        rod((0.085, 0.0, 0.18), (0.13, 0.0, 0.18), 0.02, 1, 16),
        rod((0.13, 0.0, 0.18), (0.2, 0.0, 0.18), 0.004, 2, 8),
    ]
    paint = painted_material(rng.choose(("#1f6a5c", "#e0a81c", "#b3261e", "#1f4e8c")), 0.4)
    boxes: list[Box] = [
        ((-0.05, -0.035, 0.0), (0.06, 0.035, 0.045)),
        ((-0.05, -0.03, 0.045), (0.1, 0.03, 0.21)),
    ]
    return solid(patches, [paint, _DARK, metal_material(STEEL, 0.3)], boxes)


def tape_roll(rng: VariantRng) -> Solid:
    """A roll of adhesive tape. Slot: tape."""
    r, h = rng.between(0.045, 0.06, "radius_m"), rng.between(0.02, 0.05, "height_m")
    ring = shapes.lathe([(0.038, 0.0), (r, 0.0), (r, h), (0.038, h), (0.038, 0.0)], 36)
    colors = ("#b08a54", "#1d1e20", "#d9d8d4", "#b3261e", "#2f5d9c")
    return solid([ring], [painted_material(rng.choose(colors), 0.3)], [((-r, -r, 0.0), (r, r, h))])


def open_carton(rng: VariantRng) -> Solid:
    """An open box with packing paper in it. Slots: cardboard, paper."""
    x = 0.5 * rng.between(0.3, 0.48, "depth_m")
    y = 0.5 * rng.between(0.36, 0.6, "width_m")
    h = rng.between(0.2, 0.36, "height_m")
    t = 0.005
    walls: list[Box] = [
        ((-x, -y, 0.0), (x, y, t)),
        ((-x, -y, t), (-x + t, y, h)),
        ((x - t, -y, t), (x, y, h)),
        ((-x + t, -y, t), (x - t, -y + t, h)),
        ((-x + t, y - t, t), (x - t, y, h)),
    ]
    patches = [shapes.block(*b) for b in walls]
    for sx in (-1, 1):
        flap = shapes.block((0.0, -y + 0.005, 0.0), (x - 0.01, y - 0.005, 0.004))
        turned = (
            flap.rotated("y", -rng.between(0.4, 1.0))
            if sx > 0
            else flap.rotated("y", -math.pi + rng.between(0.4, 1.0))
        )
        patches.append(turned.moved(sx * (x - 0.002), 0.0, h))
    patches.append(cushion((-x + 0.008, -y + 0.008, t), (x - 0.008, y - 0.008, 0.72 * h), 1, 0.05))
    card = patterned_material(f"texture/cardboard?seed={rng.seed % 16}", 0.5, 0.85)
    return solid(patches, [card, fabric(rng) if rng.chance(0.4) else _PAPER], walls)


def trolley(rng: VariantRng) -> Solid:
    """A rolling table with three trays. Slots: trays, posts."""
    x, y = 0.2, 0.5 * rng.between(0.52, 0.72, "width_m")
    levels = (0.14, 0.46, 0.8)
    trays: list[Box] = [((-x, -y, z), (x, y, z + 0.012)) for z in levels]
    patches = [shapes.block(*b, 0.002) for b in trays]
    for z in levels:
        for low, high in (
            ((-x, -y, z), (-x + 0.004, y, z + 0.06)), ((x - 0.004, -y, z), (x, y, z + 0.06)),
            ((-x, -y, z), (x, -y + 0.004, z + 0.06)), ((-x, y - 0.004, z), (x, y, z + 0.06)),
        ):  # fmt: skip
            patches.append(shapes.block(low, high, 0.0))
    for at_x, at_y in shapes.at_corners(0.95 * x, 0.97 * y):
        patches.append(rod((at_x, at_y, 0.06), (at_x, at_y, 0.88), 0.01, 1))
        wheel = (at_x, at_y - 0.012, 0.03), (at_x, at_y + 0.012, 0.03)
        patches.append(rod(*wheel, 0.03, 1, 16))
    paint = painted_material(rng.choose(("#f0efeb", "#26282b", "#7fa39a", "#c9b9a0")), 0.4)
    made = solid(patches, [paint, _DARK], [((-x, -y, 0.0), (x, y, 0.812))])
    corners = (-x + 0.02, -y + 0.02, 0.812), (x - 0.02, y - 0.02, 0.812)
    return replace(made, keypoints=tuple(Keypoint(SUPPORT, corner) for corner in corners))


def radio(rng: VariantRng) -> Solid:
    """A radio with a cloth front. Slots: case, cloth, knobs."""
    w, h, d = rng.between(0.2, 0.3, "width_m"), rng.between(0.12, 0.16, "height_m"), 0.09
    case: Box = ((-0.5 * d, -0.5 * w, 0.0), (0.5 * d, 0.5 * w, h))
    mesh: Box = ((0.5 * d, -0.46 * w, 0.1 * h), (0.5 * d + 0.003, 0.15 * w, 0.9 * h))
    patches = [shapes.block(*case, 0.012), shapes.block(*mesh, 0.001, 1)]
    for k in range(2):
        y, z = 0.32 * w, h * (0.3 + 0.4 * k)
        patches.append(rod((0.5 * d, y, z), (0.5 * d + 0.014, y, z), 0.016, 2, 20))
    weave = patterned_material(f"texture/fabric?seed={rng.seed % 16}", 0.1, 0.95)
    shell = LACQUERS[rng.seed % len(LACQUERS)]
    body = wood(rng) if rng.chance(0.5) else painted_material(shell, 0.4)
    return solid(patches, [body, weave, metal_material(STAINLESS, 0.3)], [case])
