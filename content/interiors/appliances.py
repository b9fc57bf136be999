"""Small appliances and utensils of homes, offices and workshops. Sizes are assumed, as sold."""

import math
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.interiors.parts import (
    HOUSEHOLD,
    LACQUERS,
    Box,
    board,
    ceramic,
    cloth,
    cushion,
    disc,
    handle,
    lacquer,
    rod,
    solid,
    wood,
)
from gen_data.content.interiors.soft_goods import fabric, hang_garment, rumple, wool
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import (
    STAINLESS,
    STEEL,
    draw_linear,
    metal_material,
    painted_material,
)
from gen_data.content.procedural.patches import Patch
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng

_STEEL = metal_material(STAINLESS, 0.25)
_DARK = painted_material("#1d1e20", 0.4)


def _case(rng: VariantRng) -> Material:
    """Housing of an appliance: steel, white, black or a colour."""
    kind = rng.random()
    if kind < 0.35:
        return _STEEL
    if kind < 0.75:
        return painted_material(rng.choose(("#f1f0ec", "#1d1e20", "#c9c7c0")), 0.3)
    return Material(draw_linear(HOUSEHOLD, 0.1, rng), 0.3)


def microwave(rng: VariantRng) -> Solid:
    """A microwave oven. Slots: case, glass, steel."""
    d = rng.between(0.32, 0.38, "depth_m")
    w = rng.between(0.44, 0.5, "width_m")
    h = rng.between(0.25, 0.29, "height_m")
    x, y = 0.5 * d, 0.5 * w
    body: Box = ((-x, -y, 0.008), (x, y, h))
    patches = [
        shapes.block(*body, 0.008),
        shapes.block((x, -y + 0.01, 0.02), (x + 0.012, y - 0.12, h - 0.012), 0.004, 1),
        shapes.block((x, y - 0.115, 0.02), (x + 0.01, y - 0.01, h - 0.012), 0.003, 1),
        *handle(x + 0.01, y - 0.13, 0.5 * h, 0.6 * h, 2, upright=True),
        rod((x + 0.01, y - 0.06, 0.3 * h), (x + 0.022, y - 0.06, 0.3 * h), 0.022, 2, 20),
        shapes.block((-x + 0.02, -y + 0.02, 0.0), (x - 0.02, y - 0.02, 0.008), 0.0, 1),
    ]
    return solid(patches, [_case(rng), Material((0.02, 0.02, 0.022), 0.1), _STEEL], [body])


def toaster(rng: VariantRng) -> Solid:
    """A toaster with two slots. Slots: case, dark."""
    d = rng.between(0.16, 0.19, "depth_m")
    w = rng.between(0.26, 0.3, "width_m")
    h = rng.between(0.17, 0.2, "height_m")
    body: Box = ((-0.5 * d, -0.5 * w, 0.0), (0.5 * d, 0.5 * w, h))
    patches = [cushion(*body, 0, 0.03)]
    for x in (-0.03, 0.03):
        patch = shapes.block((x - 0.012, -0.36 * w, h), (x + 0.012, 0.36 * w, h + 0.001), 0.0, 1)
        patches.append(patch)
    lever = (-0.02, 0.5 * w, 0.6 * h), (0.02, 0.5 * w + 0.03, 0.6 * h + 0.012)
    patches.append(shapes.block(*lever, 0.003, 1))
    return solid(patches, [_case(rng), _DARK], [body])


def kettle(rng: VariantRng) -> Solid:
    """An electric kettle on its base. Slots: case, dark."""
    r, h = rng.between(0.07, 0.085, "radius_m"), rng.between(0.18, 0.23, "height_m")
    profile = [
        (0.0, 0.02),
        (r, 0.02),
        (r * 1.03, 0.08),
        (0.75 * r, h),
        (0.6 * r, h + 0.015),
        (0.0, h + 0.02),
    ]
    body = shapes.lathe(profile, 36)
    grip = [(0.75 * r, 0.95 * h), (r + 0.05, 0.9 * h), (r + 0.055, 0.5 * h), (r, 0.25 * h)]
    patches = [
        disc(0, 0, 0.0, 0.02, 1.05 * r, 1, 36),
        body,
        disc(0, 0, h + 0.015, h + 0.04, 0.015, 1),
    ]
    patches += [rod((-a[0], 0.0, a[1]), (-b[0], 0.0, b[1]), 0.011, 1) for a, b in pairwise(grip)]
    patches.append(rod((0.7 * r, 0.0, 0.75 * h), (1.25 * r, 0.0, 0.92 * h), 0.014, 0))
    return solid(patches, [_case(rng), _DARK], [((-r, -r, 0.0), (r, r, h + 0.03))])


def coffee_maker(rng: VariantRng) -> Solid:
    """A coffee maker with a jug. Slots: case, jug."""
    w, h = rng.between(0.17, 0.2, "width_m"), rng.between(0.3, 0.36, "height_m")
    boxes: list[Box] = [
        ((-0.12, -0.5 * w, 0.0), (0.12, 0.5 * w, 0.04)),
        ((-0.12, -0.5 * w, 0.04), (-0.02, 0.5 * w, h)),
        ((-0.02, -0.5 * w, h - 0.1), (0.12, 0.5 * w, h)),
    ]
    profile = [(0.0, 0.042), (0.055, 0.042), (0.062, 0.1), (0.045, h - 0.12), (0.0, h - 0.11)]
    jug = shapes.lathe(profile, 30, 1)
    patches = [*(shapes.block(*b, 0.008) for b in boxes), jug.moved(0.05)]
    patches.append(rod((0.11, 0.0, 0.08), (0.11, 0.0, h - 0.13), 0.008, 0))
    return solid(patches, [_case(rng), Material((0.03, 0.02, 0.015), 0.08)], boxes)


def cooking_pot(rng: VariantRng) -> Solid:
    """A pot, some with a lid. Slots: body, handles."""
    r, h = rng.between(0.08, 0.13, "radius_m"), rng.between(0.09, 0.16, "height_m")
    profile = [(0.0, 0.0), (r, 0.0), (r, h), (r - 0.003, h), (r - 0.003, 0.004), (0.0, 0.004)]
    patches = [shapes.lathe(profile, 40)]
    if rng.chance(0.6):
        lid = [(r + 0.004, h), (r, h + 0.01), (0.0, h + 0.022), (0.0, h)]
        patches.append(shapes.lathe(lid, 40))
        patches.append(disc(0, 0, h + 0.02, h + 0.045, 0.018, 1))
    for s in (-1, 1):
        a, b = s * r, s * (r + 0.035)
        patches += [
            rod((-0.03, a, 0.8 * h), (-0.03, b, 0.8 * h), 0.005, 1),
            rod((0.03, a, 0.8 * h), (0.03, b, 0.8 * h), 0.005, 1),
            rod((-0.034, b, 0.8 * h), (0.034, b, 0.8 * h), 0.006, 1),
        ]
    body = _STEEL if rng.chance(0.6) else Material(draw_linear(HOUSEHOLD, 0.1, rng), 0.2)
    return solid(patches, [body, _DARK], [((-0.75 * r, -r, 0.0), (0.75 * r, r, h))])


def frying_pan(rng: VariantRng) -> Solid:
    """A frying pan. Slots: body, handle."""
    r, h = rng.between(0.1, 0.14, "radius_m"), rng.between(0.04, 0.055, "height_m")
    profile = [(0.0, 0.0), (0.8 * r, 0.0), (r, h), (r - 0.004, h), (0.8 * r, 0.005), (0.0, 0.005)]
    patches = [
        shapes.lathe(profile, 40),
        rod((0.9 * r, 0.0, 0.8 * h), (r + 0.17, 0.0, h + 0.03), 0.011, 1),
    ]
    boxes: list[Box] = [
        ((-r, -r, 0.0), (r, r, h)),
        ((r, -0.012, 0.5 * h), (r + 0.17, 0.012, h + 0.04)),
    ]
    return solid(patches, [painted_material("#17181a", 0.45), _DARK], boxes)


def cutting_board(rng: VariantRng) -> Solid:
    """A cutting board. Slot: wood."""
    x, y = 0.5 * rng.between(0.2, 0.28, "depth_m"), 0.5 * rng.between(0.3, 0.42, "width_m")
    flat: Box = ((-x, -y, 0.0), (x, y, 0.018))
    return solid([board(*flat, 0, 0.005)], [wood(rng, 0.6)], [flat])


def printer(rng: VariantRng) -> Solid:
    """A printer with a sheet in its tray. Slots: case, dark, paper."""
    h = rng.between(0.17, 0.28, "height_m")
    body: Box = ((-0.18, -0.22, 0.0), (0.16, 0.22, h))
    patches = [
        cushion(*body, 0, 0.02),
        shapes.block((0.13, -0.16, 0.06), (0.161, 0.16, 0.1), 0.0, 1),
        shapes.block((0.1, -0.15, 0.045), (0.26, 0.15, 0.055), 0.003, 1),
        shapes.block((0.14, -0.105, 0.0555), (0.25, 0.105, 0.058), 0.0, 2),
        shapes.block((0.02, -0.12, h), (0.14, 0.0, h + 0.003), 0.001, 1),
    ]
    case = painted_material(rng.choose(("#efeeea", "#2a2c2f", "#d7d8d8")), 0.4)
    boxes: list[Box] = [body, ((0.16, -0.15, 0.045), (0.26, 0.15, 0.06))]
    return solid(patches, [case, _DARK, painted_material("#f7f7f4", 0.9)], boxes)


def speaker(rng: VariantRng) -> Solid:
    """A loudspeaker. Slots: case, cones."""
    d = rng.between(0.15, 0.25, "depth_m")
    w = rng.between(0.14, 0.22, "width_m")
    h = rng.between(0.24, 0.4, "height_m")
    x = 0.5 * d
    body: Box = ((-x, -0.5 * w, 0.0), (x, 0.5 * w, h))
    patches: list[Patch] = [board(*body, 0, 0.004)]
    for r, z in ((0.4 * w, 0.3 * h), (0.2 * w, 0.76 * h)):
        cone = [(0.0, 0.004), (0.3 * r, 0.008), (0.85 * r, 0.002), (r, 0.008), (r, 0.0)][::-1]
        patches.append(shapes.lathe(cone, 32, 1).rotated("y", 0.5 * math.pi).moved(x, 0.0, z))
    return solid(patches, [wood(rng) if rng.chance(0.5) else _DARK, _DARK], [body])


def desk_fan(rng: VariantRng) -> Solid:
    """A fan. Slots: case, cage."""
    r = rng.between(0.12, 0.17, "radius_m")
    z = r + 0.1
    patches = [
        disc(0, 0, 0.0, 0.02, 0.6 * r, 0, 32),
        rod((-0.03, 0, 0.02), (-0.03, 0, z), 0.014, 0),
    ]
    patches.append(rod((-0.1, 0.0, z), (0.02, 0.0, z), 0.035, 0, 18))
    for x in (-0.02, 0.05):
        for share in (1.0, 0.66, 0.33):
            rim = share * r
            ring = [(rim, 0.0), (rim + 0.004, 0.0), (rim + 0.004, 0.004), (rim, 0.004), (rim, 0.0)]
            patches.append(shapes.lathe(ring, 40, 1).rotated("y", 0.5 * math.pi).moved(x, 0.0, z))
    for k in range(4):
        blade = shapes.block((0.0, 0.01, 0.02), (0.004, 0.09, 0.9 * r), 0.0, 0)
        patch = blade.rotated("z", 0.35).rotated("x", 0.5 * math.pi * k).moved(0.012, 0.0, z)
        patches.append(patch)
    return solid(patches, [_case(rng), _STEEL], [((-0.1, -r, 0.0), (0.06, r, z + r))])


def router(rng: VariantRng) -> Solid:
    """A router with aerials. Slots: case, dark."""
    body: Box = ((-0.07, -0.11, 0.0), (0.07, 0.11, 0.032))
    patches = [cushion(*body, 0, 0.012)]
    for y in (-0.08, 0.08):
        patches.append(rod((-0.06, y, 0.02), (-0.065, y, rng.between(0.12, 0.19)), 0.006, 1))
    looks = [painted_material(rng.choose(("#f1f0ec", "#1d1e20")), 0.4), _DARK]
    return solid(patches, looks, [body])


def game_console(rng: VariantRng) -> Solid:
    """A game console. Slots: case, dark."""
    body: Box = ((-0.13, -0.15, 0.0), (0.13, 0.15, rng.between(0.05, 0.08, "height_m")))
    patches = [
        shapes.block(*body, 0.012),
        shapes.block((0.128, -0.13, 0.02), (0.132, 0.1, 0.024), 0.0, 1),
    ]
    looks = [painted_material(rng.choose(("#f3f3f3", "#161718")), 0.3), _STEEL]
    return solid(patches, looks, [body])


def basket(rng: VariantRng) -> Solid:
    """A woven basket, some with a blanket in it. Slots: body, cloth."""
    r, h = rng.between(0.14, 0.21, "radius_m"), rng.between(0.2, 0.38, "height_m")
    rows, columns = 40, 81
    s = np.linspace(0.0, 1.0, rows)[:, None]
    turn = np.linspace(0.0, 2.0 * math.pi, columns)[None, :]
    # Strands run around and pass before and behind the upright ones in turn.
    weave = np.sin(10.0 * turn) * np.cos(math.pi * (rows - 1) / 3.0 * s)
    reach = r * (0.82 + 0.2 * s - 0.04 * s * s) + 0.0035 * weave
    x, y = reach * np.cos(turn), reach * np.sin(turn)
    points = np.stack(np.broadcast_arrays(x, y, h * s), axis=2)
    points[:, -1] = points[:, 0]
    inner = points * np.array([0.94, 0.94, 1.0])
    ring = np.stack([r * np.cos(turn[0]), r * np.sin(turn[0]), np.full(columns, h)], axis=1)
    edge = shapes.sweep(0.96 * ring * (1, 1, 1 / 0.96), shapes.circle(0.011, 8), capped=False)
    patches: list[Patch] = [shapes.grid(points), shapes.grid(inner).flipped(), edge]
    patches.append(disc(0.0, 0.0, 0.0, 0.012, 0.81 * r, 0, 32))
    if rng.chance(0.6):
        inside = 0.9 * np.linspace(0.0, 1.0, 18)[:, None]
        hx, hy = r * inside * np.cos(turn), r * inside * np.sin(turn)
        z = rng.between(0.6, 0.85) * h + 0.35 * r * (1.0 - inside**2)
        z = z + 0.014 * rumple(hx, hy, rng, 0.13) * (1.0 - inside**6)
        z[:, -1] = z[:, 0]
        heap = shapes.grid(np.stack(np.broadcast_arrays(hx, hy, z), axis=2), slot=1)
        patches.append(heap.flipped())
    straw = ("#c9a87a", "#b58f5c", "#e0cfae", "#8b6a45", "#8b8f90")
    body = Material(draw_linear(straw, 0.1, rng), 0.85)
    soft = fabric(rng, 0.3)
    return solid(patches, [body, soft], [((-0.8 * r, -0.8 * r, 0.0), (0.8 * r, 0.8 * r, h))])


def ottoman(rng: VariantRng) -> Solid:
    """A padded footstool. Slots: cover, legs."""
    x = 0.5 * rng.between(0.4, 0.64, "depth_m")
    y = 0.5 * rng.between(0.44, 0.8, "width_m")
    z = rng.between(0.36, 0.44, "height_m")
    body: Box = ((-x, -y, 0.06), (x, y, z))
    patches = [cushion(*body, 0, 0.05)]
    patches += [disc(*at, 0.0, 0.07, 0.02, 1) for at in shapes.at_corners(x - 0.06, y - 0.06)]
    return solid(patches, [cloth(rng), wood(rng)], [((-x, -y, 0.0), (x, y, z))])


def coat_rack(rng: VariantRng) -> Solid:
    """A stand for coats, some with coats on it. Slots: wood, cloth."""
    h = rng.between(1.65, 1.85, "height_m")
    patches = [rod((0.0, 0.0, 0.02), (0.0, 0.0, h), 0.018, 0)]
    for k in range(4):
        a = 0.5 * math.pi * k + 0.4
        c, s = math.cos(a), math.sin(a)
        patches.append(rod((0.0, 0.0, 0.1), (0.22 * c, 0.22 * s, 0.012), 0.014, 0))
        patches.append(rod((0.0, 0.0, h - 0.12), (0.15 * c, 0.15 * s, h - 0.02), 0.01, 0))
        if rng.chance(0.4):
            coat = hang_garment(rng, rng.between(0.7, 1.0), 1)
            patches.append(coat.rotated("z", a).moved(0.13 * c, 0.13 * s, h - 0.05))
    return solid(patches, [wood(rng), wool(rng)], [((-0.2, -0.2, 0.0), (0.2, 0.2, h))])


def ladder(rng: VariantRng) -> Solid:
    """A step ladder, open. Slots: metal, feet."""
    h, w = rng.between(1.1, 1.7, "height_m"), 0.22
    patches: list[Patch] = []
    for sy in (-1, 1):
        patches.append(rod((0.3, sy * w, 0.02), (0.04, 0.8 * sy * w, h), 0.016, 0))
        patches.append(rod((-0.34, sy * w, 0.02), (-0.02, 0.8 * sy * w, h), 0.013, 0))
        for x in (0.3, -0.34):
            patches.append(disc(x, sy * w, 0.0, 0.03, 0.02, 1))
    steps = round(h / 0.24)
    for k in range(1, steps):
        t = k / steps
        x, y = 0.3 - 0.26 * t, w * (1.0 - 0.2 * t)
        patch = shapes.block((x - 0.05, -y, t * h - 0.012), (x + 0.03, y, t * h + 0.012), 0.003, 0)
        patches.append(patch)
    patches.append(shapes.block((-0.08, -0.8 * w, h - 0.01), (0.1, 0.8 * w, h + 0.015), 0.006, 1))
    looks = [metal_material((0.8, 0.8, 0.8), 0.35), _DARK]
    return solid(patches, looks, [((-0.34, -w, 0.0), (0.3, w, h))])


def bucket(rng: VariantRng) -> Solid:
    """A bucket. Slots: body, handle."""
    r, h = rng.between(0.12, 0.15, "radius_m"), rng.between(0.24, 0.3, "height_m")
    profile = [
        (0.0, 0.0),
        (0.75 * r, 0.0),
        (r, h),
        (r + 0.008, h),
        (r - 0.004, h - 0.01),
        (0.75 * r, 0.006),
        (0.0, 0.006),
    ]
    patches = [shapes.lathe(profile, 36)]
    for k in range(8):
        a, b = (math.pi * (k + s) / 8 for s in (0, 1))
        start = (-r * math.sin(a), r * math.cos(a), h - 0.02)
        end = (-r * math.sin(b), r * math.cos(b), h - 0.02)
        patches.append(rod(start, end, 0.003, 1, 6))
    looks = [Material(draw_linear(HOUSEHOLD, 0.1, rng), 0.4), metal_material(STEEL, 0.4)]
    return solid(patches, looks, [((-0.75 * r, -0.75 * r, 0.0), (0.75 * r, 0.75 * r, h))])


def fire_extinguisher(rng: VariantRng) -> Solid:
    """A fire extinguisher. Slots: red, dark."""
    r, h = rng.between(0.07, 0.09, "radius_m"), rng.between(0.4, 0.52, "height_m")
    profile = [(0.0, 0.0), (r, 0.0), (r, h - 0.06), (0.6 * r, h - 0.02), (0.02, h), (0.0, h)]
    body = shapes.lathe(profile, 32)
    patches = [body, disc(0, 0, h - 0.01, h + 0.04, 0.018, 1)]
    patches += [
        rod((0.0, 0.0, h + 0.035), (0.1, 0.0, h + 0.06), 0.008, 1),
        rod((0.02, r, 0.15), (0.02, r * 0.5, h), 0.009, 1),
    ]
    return solid(patches, [painted_material("#b01218", 0.25), _DARK], [((-r, -r, 0.0), (r, r, h))])


def soap_dispenser(rng: VariantRng) -> Solid:
    """A soap dispenser. Slots: body, pump."""
    r, h = rng.between(0.028, 0.038, "radius_m"), rng.between(0.11, 0.15, "height_m")
    patches = [
        disc(0, 0, 0.0, h, r, 0, 30),
        disc(0, 0, h, h + 0.012, 0.014, 1),
        rod((0, 0, h), (0, 0, h + 0.04), 0.004, 1),
    ]
    patches.append(rod((-0.005, 0.0, h + 0.04), (0.035, 0.0, h + 0.036), 0.005, 1))
    body = ceramic(0.2) if rng.chance(0.5) else lacquer(rng)
    return solid(patches, [body, _STEEL], [((-r, -r, 0.0), (r, r, h + 0.04))])


def toilet_paper(rng: VariantRng) -> Solid:
    """A roll of toilet paper. Slots: paper, core."""
    r = rng.between(0.04, 0.058, "radius_m")
    ring = [(0.02, 0.0), (r, 0.0), (r, 0.1), (0.02, 0.1), (0.02, 0.0)]
    boxes = [((-0.8 * r, -0.8 * r, 0.0), (0.8 * r, 0.8 * r, 0.1))]
    return solid([shapes.lathe(ring, 36)], [painted_material("#f4f2ec", 1.0)], boxes)


def tissue_box(rng: VariantRng) -> Solid:
    """A box of tissues. Slots: card, paper."""
    body: Box = ((-0.06, -0.11, 0.0), (0.06, 0.11, rng.between(0.06, 0.1, "height_m")))
    h = body[1][2]
    sheet = cushion((-0.015, -0.05, h - 0.01), (0.015, 0.05, h + 0.06), 1, 0.014)
    looks = [painted_material(rng.choose(HOUSEHOLD[:11]), 0.6), painted_material("#f7f6f2", 1.0)]
    return solid([shapes.block(*body, 0.002), sheet], looks, [body])


def alarm_clock(rng: VariantRng) -> Solid:
    """An alarm clock. Slots: case, face."""
    w, h = 0.5 * rng.between(0.1, 0.16, "width_m"), rng.between(0.06, 0.1, "height_m")
    body: Box = ((-0.03, -w, 0.0), (0.03, w, h))
    face = shapes.block((0.03, -0.85 * w, 0.12 * h), (0.031, 0.85 * w, 0.88 * h), 0.0, 1)
    lit = Material((0.01, 0.01, 0.01), 0.1) if rng.chance(0.6) else painted_material("#f2f0ea", 0.5)
    patches = [cushion(*body, 0, 0.015), face]
    return solid(patches, [painted_material(rng.choose(LACQUERS), 0.4), lit], [body])


def shoes(rng: VariantRng) -> Solid:
    """A pair of shoes. Slots: upper, sole."""
    patches: list[Patch] = []
    for y in (-0.06, 0.06):
        patches.append(cushion((-0.13, y - 0.045, 0.0), (0.14, y + 0.045, 0.025), 1, 0.012))
        patches.append(cushion((-0.12, y - 0.042, 0.015), (0.13, y + 0.042, 0.07), 0, 0.028))
        patches.append(cushion((-0.125, y - 0.04, 0.02), (-0.01, y + 0.04, 0.1), 0, 0.03))
    upper = Material(
        draw_linear(("#2a1d17", "#1c1b1b", "#f0efeb", "#39434d", "#8c2f39", "#8a5a34"), 0.1, rng),
        0.6,
    )
    looks = [upper, painted_material(rng.choose(("#e9e7e1", "#1b1b1c")), 0.8)]
    return solid(patches, looks, [((-0.13, -0.105, 0.0), (0.14, 0.105, 0.09))])
