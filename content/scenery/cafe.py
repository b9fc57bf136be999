"""Cafe tables and parasols on pavements, market stalls.

Sizes: assumed from makers' catalogues, 10 %.
"""

import math

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets as presets
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.procedural.surface_shapes import block, cone, grid, lathe
from gen_data.content.scenery import clutter_shapes as clutter
from gen_data.content.scenery.awnings import awning_cloth, hanging_cloth
from gen_data.content.scenery.basic_shapes import make_solid, post
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, variant_rng

CHAIRS = ("slats", "woven", "shell", "slats", "woven")
_CLOTHS = ("#e9e2d0", "#b3261e", "#22406f", "#2f5f3a", "#d9a520", "#5a5d60", "#f2f0ea", "#7a2f3f",
           "#c8743a")  # fmt: skip
_FRAMES = ("#232527", "#3b3d3f", "#8d9091", "#e4e2da", "#2f4236", "#7a2a24")
_SEATS = ("#7a5638", "#b98a5a", "#2b2b2c", "#d8d2c2", "#8c2f2a", "#3d5a4a")
_SLOT_CANVAS, _SLOT_STRIPE = 4, 5


def cafe_set(seed: int) -> Solid:
    """A table with two to four chairs, cups on some, under a parasol on every third.

    Slots: frame, seats, table top, crockery, canvas, stripes.
    """
    rng = variant_rng("cafe_set", seed)
    kind, count = rng.turn(CHAIRS, "chairs"), rng.turn((2, 4, 3, 2, 4, 2), "count")
    half = 0.3 if count == 2 else 0.5 * rng.between(0.68, 0.84, "width_m")
    high = rng.between(0.71, 0.75, "table_m")
    round_top = rng.chance(0.55, "round_top")
    parts = _table(half, high, round_top)
    first = rng.choose((0.0, 0.5)) * math.pi
    for k in range(count):
        turn = first + 2.0 * math.pi * k / count + rng.between(-0.35, 0.35)
        away = half + rng.between(0.12, 0.36)
        one = join_patches(clutter.chair(kind, rng.between(0.43, 0.46), 0, 1))
        # It faces the table, from behind +X before the turn.
        placed = one.rotated("z", math.pi + rng.between(-0.3, 0.3)).moved(away + 0.2)
        parts.append(placed.rotated("z", turn))
    parts += _crockery(high, half, count, rng)
    if _has_parasol(seed):
        parts += _canopy(
            0.5 * rng.between(2.3, 3.0, "parasol_m"),
            4 if rng.chance(0.5) else 8,
            rng.chance(0.3, "striped"),
        )
        parts.append(post(0.02, (high, 2.5)))
    low, top = join_patches(parts).bounds_m()
    # The middle of the group, not the table, is the origin.
    x, y = -0.5 * float(low[0] + top[0]), -0.5 * float(low[1] + top[1])
    parts = clutter.on_ground([part.moved(x, y) for part in parts])
    grain = presets.patterned_material("texture/wood_grain?seed=5", 1.2, 0.7, (0.75, 0.66, 0.58))
    plain = clutter.worn_paint(("#e4e2da", "#3b3d3f", "#8d9091", "#5a3a2a"), 0.4, rng)
    woven = presets.patterned_material(
        "texture/fabric?seed=3", 0.12, 0.85, presets.draw_linear(_SEATS, 0.1, rng)
    )
    seats = {"slats": grain, "woven": woven}.get(kind, clutter.worn_paint(_SEATS, 0.45, rng))
    materials = (
        clutter.worn_paint(_FRAMES, 0.4, rng),
        seats,
        rng.choose((grain, plain, plain)),
        presets.ceramic_material(rng, presets.GLAZES[:3]),
        *_canvas(rng),
    )
    disc = hulls.frustum((half, 0.0), (half, high), 12) + np.array([x, y, 0.0])
    return make_solid(parts, materials, [disc])


def cafe_set_facts(seed: int) -> Facts:
    """Kind of its chairs, and whether it has a parasol."""
    attributes = {
        "chairs": variant_rng("cafe_set", seed).turn(CHAIRS, "chairs"),
        "parasol": "yes" if _has_parasol(seed) else "no",
    }
    return Facts("cafe_set", attributes)


def _has_parasol(seed: int) -> bool:
    return variant_rng("cafe_set", seed).turn((False, False, True), "parasol")


def _table(half: float, high: float, round_top: bool) -> list[Patch]:
    """A bistro table on one foot; frame slot 0, top slot 2."""
    if round_top:
        top = cone((half, high - 0.03), (half, high), 20, 2)
    else:
        top = block((-half, -half, high - 0.03), (half, half, high), 0.01, 2)
    foot = lathe([(0.0, 0.0), (0.23, 0.0), (0.2, 0.025), (0.03, 0.05), (0.025, high - 0.03)], 12)
    return [top, foot]


def _crockery(high: float, half: float, count: int, rng: VariantRng) -> list[Patch]:
    """Cups on saucers, glasses, a vase; slot 3."""
    parts = []
    for k in range(rng.choose((0, 1, 2, count))):
        turn, away = 2.0 * math.pi * k / count + rng.between(-0.4, 0.4), 0.6 * half
        saucer = [(0.0, 0.0), (0.07, 0.008), (0.03, 0.012), (0.035, 0.02), (0.042, 0.07),
                  (0.035, 0.065), (0.0, 0.03)]  # fmt: skip
        glass = [(0.0, 0.0), (0.03, 0.0), (0.036, 0.13), (0.0, 0.12)]
        made = lathe(saucer if rng.chance(0.6) else glass, 9, 3)
        parts.append(made.moved(away * math.cos(turn), away * math.sin(turn), high))
    if rng.chance(0.5):
        vase = lathe([(0.0, 0.0), (0.035, 0.0), (0.04, 0.06), (0.02, 0.13), (0.0, 0.12)], 8, 3)
        parts.append(vase.moved(0.02, 0.03, high))
    return parts


def parasol(rng: VariantRng) -> Solid:
    """A parasol of 2.5 to 4 m, square or round, open or (every fourth) furled.

    Slots: steel, pole, base, -, canvas, stripes.
    """
    furled, half = _is_furled(rng.seed), 0.5 * rng.between(2.5, 4.0, "width_m")
    parts = [block((-0.35, -0.35, 0.0), (0.35, 0.35, 0.08), 0.015, 2)]
    parts.append(post(0.028, (0.08, 2.75)).painted(1))
    if furled:
        folds = 12
        turn = np.linspace(0.0, 2.0 * math.pi, folds + 1)
        wave = 1.0 + 0.35 * np.cos(6.0 * turn)
        rows = []
        for z, r in ((1.05, 0.09), (1.3, 0.13), (2.2, 0.1), (2.72, 0.03)):
            ring = np.stack([r * wave * np.cos(turn), r * wave * np.sin(turn), 0 * turn + z], 1)
            rows.append(ring)
        parts.append(grid(np.stack(rows), slot=_SLOT_CANVAS))
    else:
        parts += _canopy(half, 4 if rng.seed % 2 else 8, rng.chance(0.4, "striped"))
    wood = presets.patterned_material("texture/wood_grain?seed=2", 1.0, 0.6, (0.6, 0.45, 0.32))
    materials = (
        clutter.worn_steel(rng),
        rng.choose((wood, clutter.worn_steel(rng), presets.painted_material("#e4e2da", 0.4))),
        presets.patterned_material("texture/concrete?seed=3", 1.0, 0.9, (0.6, 0.6, 0.58)),
        wood,
        *_canvas(rng),
    )
    return make_solid(parts, materials, [hulls.box((-0.35, -0.35, 0.0), (0.35, 0.35, 0.1))])


def parasol_facts(seed: int) -> Facts:
    """Whether it is open."""
    return Facts("parasol", {"state": "furled" if _is_furled(seed) else "open"})


def _is_furled(seed: int) -> bool:
    return variant_rng("parasol", seed).turn((False, False, False, True), "furled")


def _canopy(half: float, sides: int, striped: bool) -> list[Patch]:
    """A canopy at 2.2 to 2.7 m with a valance, ribs below; slots 0, 4 and 5."""
    eaves, top, radius = 2.2, 2.72, half * (math.sqrt(2.0) if sides == 4 else 1.0)
    corners = [
        (radius * math.cos(t), radius * math.sin(t))
        for t in (2.0 * math.pi * (k + 0.5) / sides for k in range(sides))
    ]
    parts = []
    for k, (x1, y1) in enumerate(corners):
        x0, y0 = corners[k - 1]
        slot = _SLOT_STRIPE if striped and k % 2 else _SLOT_CANVAS
        panel = np.array([[(x0, y0, eaves), (x1, y1, eaves)], [(0.0, 0.0, top)] * 2])
        hem = np.array([[(x0, y0, eaves - 0.2), (x1, y1, eaves - 0.2)],
                        [(x0, y0, eaves), (x1, y1, eaves)]])  # fmt: skip
        for sheet in (grid(panel, slot=slot), grid(hem, slot=slot)):
            # Cloth is seen from both sides.
            parts += [sheet, _underside(sheet)]
        parts.append(clutter.bar((x1, y1, eaves - 0.01), (0.0, 0.0, top - 0.03), 0.009, 3))
    parts.append(cone((0.04, top), (0.01, top + 0.08), 8))
    return parts


def _underside(sheet: Patch) -> Patch:
    """The other side of a sheet about the Z axis, 4 mm nearer to it."""
    inner = sheet.flipped().scaled(0.997, 0.997, 1.0)
    return inner.moved(z=-0.004)


def _canvas(rng: VariantRng) -> tuple[Material, Material]:
    """Cloth of canopies, and of their stripes."""
    color, other = rng.choose(_CLOTHS), rng.choose(("#f2f0ea", "#e9e2d0", "#d9a520"))
    return (
        Material(presets.draw_linear((color,), 0.1, rng), roughness=0.9, specular=0.3),
        Material(presets.draw_linear((other,), 0.06, rng), roughness=0.9, specular=0.3),
    )


def market_stall(rng: VariantRng) -> Solid:
    """A stall that sells towards +X: awning, table with crates of produce, boxes below.

    Slots: steel, wood, cloth of the table, crates, canvas, stripes, three kinds of produce.
    """
    half, deep, table = 0.5 * rng.between(2.4, 3.4, "width_m"), 1.0, 0.82
    parts = []
    for x in (-deep, deep - 0.1):
        high = 2.5 if x < 0 else 2.15
        for y in (-half + 0.05, half - 0.05):
            parts.append(clutter.bar((x, y, 0.0), (x, y, high), 0.02, 5))
        parts.append(clutter.bar((x, -half, high), (x, half, high), 0.02, 5))
    parts += _awning(half, deep, rng.chance(0.7, "striped"))
    front = deep - 0.35
    parts.append(block((-0.35, -half + 0.1, table - 0.04), (front, half - 0.1, table), 0.0, 1))
    for y in np.linspace(-half + 0.3, half - 0.3, 3).tolist():
        for x in (-0.3, front - 0.05):
            parts.append(block((x, y - 0.03, 0.0), (x + 0.05, y + 0.03, table - 0.04), 0.0, 1))
    parts += hanging_cloth(front + 0.03, (-half + 0.1, half - 0.1), (0.12, table), 2)
    columns = max(3, int((2 * half - 0.3) / 0.55))
    for row in range(2):
        for k in range(columns):
            y = (k + 0.5) * (2 * half - 0.3) / columns - half + 0.15
            x = front - 0.24 - 0.42 * row
            parts += [part.moved(x, y, table + 0.07 * row) for part in _crate(6 + k % 3, rng)]
    for _ in range(3):
        y = rng.between(-half + 0.4, half - 0.4)
        box = block((-0.25, -0.2, 0.0), (0.25, 0.2, rng.between(0.2, 0.35)), 0.0, 3)
        parts.append(box.rotated("z", rng.between(-0.4, 0.4)).moved(-0.7, y))
    fruits = rng.shuffled(("#b8261e", "#d9821e", "#5f8a2a", "#d9c43a", "#6a3a2a", "#7a2a4a",
                           "#e4dcc4", "#3f6a2f"))  # fmt: skip
    grain = presets.patterned_material("texture/wood_grain?seed=5", 1.2, 0.8, (0.7, 0.6, 0.5))
    crate = rng.choose((grain, clutter.worn_paint(("#2f6f4a", "#22406f", "#3b3d3f"), 0.55, rng)))
    materials = (
        clutter.worn_steel(rng),
        grain,
        Material(presets.draw_linear(("#2f6f4a", "#22406f", "#5a5d60", "#7a2a24"), 0.1, rng), 0.85),
        crate,
        *_canvas(rng),
        *(_produce(color, rng) for color in fruits[:3]),
    )
    hull = hulls.box((-0.35, -half + 0.1, 0.0), (front, half - 0.1, table))
    return make_solid(parts, materials, [hull])


def _produce(color: str, rng: VariantRng) -> Material:
    texture_id = f"texture/produce?seed={rng.choose((0, 1, 2, 3))}"
    return presets.patterned_material(
        texture_id, 0.56, 0.45, presets.draw_linear((color,), 0.1, rng)
    )


def _awning(half: float, deep: float, striped: bool) -> list[Patch]:
    """A sloping sheet over a stall with a valance in front, striped along Y."""
    edges = np.linspace(-half - 0.1, half + 0.1, 9).tolist()
    slots = [_SLOT_STRIPE if striped and k % 2 else _SLOT_CANVAS for k in range(8)]
    return awning_cloth((deep + 0.25, 2.12), (-deep - 0.1, 2.52), edges, slots, 0.24)


def _crate(slot: int, rng: VariantRng) -> list[Patch]:
    """A crate of 0.4 x 0.5 m, heaped with produce: its shape is a texture's."""
    x, y, high = 0.2, 0.25, 0.13
    walls = clutter.hopper(
        clutter.Rectangle(-x, x, -y, y), clutter.Rectangle(-x, x, -y, y), (0.0, high), 3, True
    )
    v, u = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 6), indexing="ij")
    heap = rng.between(0.08, 0.13) * (1 - (2 * u - 1) ** 4) * (1 - (2 * v - 1) ** 4)
    points = np.stack([(2 * u - 1) * x * 0.97, (2 * v - 1) * y * 0.97, high + heap - 0.01], axis=2)
    return [walls, grid(points, slot=slot)]
