"""Road works and building sites: cones, beacons, barriers, site fences, scaffolds.

Barriers, fences and scaffolds run along Y and face +X.
"""

import math

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets as presets
from gen_data.content.procedural import surface_shapes as surfaces
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.scenery import clutter_shapes as clutter
from gen_data.content.scenery.basic_shapes import facing_rectangle, make_solid, post
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, variant_rng

CONES = ("cone", "cone", "beacon", "cone", "fallen", "post")
BARRIERS = ("boards", "new_jersey", "plastic", "boards", "water_filled", "trestle")
_RED, _WHITE, _BLACK = "#b9261c", "#e8e7e2", "#242526"
_FEET = "#2b2c2d"


def traffic_cone(seed: int) -> Solid:
    """A cone (EN 13422: 0.5, 0.75 or 1 m), one that fell over, a beacon or a flexible post.

    Slots: colour, white, foot.
    """
    rng = variant_rng("traffic_cone", seed)
    kind = rng.turn(CONES, "kind")
    color = rng.choose(("#e2561b", "#e2561b", "#d8401f", "#c9c41f"))
    dirt = rng.between(0.55, 1.0, "dirt")
    red, green, blue = (dirt * c for c in presets.hex_to_linear(_WHITE))
    materials = (
        clutter.worn_paint((_RED if kind == "beacon" else color,), 0.6, rng),
        Material((red, green, blue), roughness=0.45),
        presets.painted_material(rng.choose((_FEET, "#55585a", "#c94d1a")), 0.85),
    )
    if kind == "beacon":
        parts, high, half = _beacon()
    elif kind == "post":
        parts, high, half = _flexible_post()
    else:
        high = rng.choose((0.5, 0.75, 0.75, 1.0), "height_m")
        parts, half = _cone(high)
    if kind == "fallen":
        # It rests on the rim of its foot and on its tip.
        lean = 0.5 * math.pi + math.asin(min(0.9, (half - 0.03) / high))
        lying = join_patches(parts).rotated("y", lean).rotated("z", rng.between(0.0, 6.28))
        low, _ = lying.bounds_m()
        x, y = (-0.5 * float(sum(b[k] for b in lying.bounds_m())) for k in (0, 1))
        parts = [lying.moved(x, y, -float(low[2]))]
        return make_solid(parts, materials, [hulls.extreme(parts[0].corners_m, 24)])
    hull = hulls.box((-half, -half, 0.0), (half, half, 0.06))
    return make_solid(parts, materials, [hull, hulls.frustum((0.2 * high, 0.0), (0.04, high), 10)])


def _cone(high: float) -> tuple[list[Patch], float]:
    """A cone with two sleeves on a square foot; also half the foot's width."""
    half = 0.2 * high + 0.05
    low, top = 0.155 * high, 0.035 * high
    levels = (0.0, 0.3, 0.52, 0.66, 0.84, 1.0)
    profile = [(low * (1 - t) + top * t, 0.035 + t * (high - 0.035)) for t in levels]
    pieces = [surfaces.lathe(profile[k : k + 2], 16, slot=k % 2) for k in range(5)]
    r, z = profile[-1]
    tip = surfaces.lathe([(r, z), (0.6 * r, z), (0.5 * r, z - 0.05), (0.0, z - 0.05)], 16)
    foot = surfaces.rounded_box((2 * half, 2 * half, 0.035), 0.012, 1).moved(z=0.0175).painted(2)
    return [*pieces, tip, foot], half


def _beacon() -> tuple[list[Patch], float, float]:
    """A board of 1.0 x 0.25 m with slanted red fields on a foot (German sign 605)."""
    half, low, high, x = 0.125, 0.14, 1.14, 0.012
    parts = [
        surfaces.block((-0.01, -half, low), (0.01, half, high), slot=1),
        surfaces.block((-0.24, -0.2, 0.0), (0.24, 0.2, 0.11), 0.015, 2),
        surfaces.block((-0.02, -0.03, 0.1), (0.02, 0.03, low), slot=2),
    ]
    step = (high - low) / 7
    for k in range(0, 7, 2):
        z = low + k * step
        rows = np.array([[(x, -half, z), (x, half, z - 0.25)], [(x, -half, z + step),
                          (x, half, z + step - 0.25)]])  # fmt: skip
        front = np.clip(rows, None, np.array([1.0, 1.0, high]))
        front[..., 2] = np.maximum(front[..., 2], low)
        parts += [surfaces.grid(front), surfaces.grid(front * np.array([-1.0, 1.0, 1.0])).flipped()]
    return parts, high, 0.24


def _flexible_post() -> tuple[list[Patch], float, float]:
    """A post of 0.75 m that bends when it is run over, with two white bands."""
    rings = [(0.04, 0.03), (0.04, 0.42), (0.04, 0.5), (0.04, 0.58), (0.04, 0.66), (0.04, 0.75)]
    parts = [surfaces.lathe(rings[k : k + 2], 12, slot=k % 2) for k in range(5)]
    parts.append(surfaces.lathe([(0.04, 0.75), (0.03, 0.77), (0.0, 0.77)], 12))
    parts.append(surfaces.cone((0.11, 0.0), (0.08, 0.035), 14, 2))
    return parts, 0.77, 0.11


def road_barrier(rng: VariantRng) -> Solid:
    """A barrier section of about 2 m at road works. Slots: red, white, feet, steel, lamp, concrete.

    Kinds: boards on posts, concrete safety shapes, plastic grilles, water-filled plastic shapes,
    boards on trestles.
    """
    kind = rng.turn(BARRIERS, "kind")
    stone = presets.patterned_material("texture/concrete?seed=3", 2.0, 0.92, (0.9, 0.89, 0.86))
    color = rng.choose((_RED, _RED, "#d9571e"))
    materials = (
        clutter.worn_paint((color,), 0.45, rng),
        clutter.worn_paint((_WHITE,), 0.45, rng),
        presets.painted_material(_FEET, 0.85),
        clutter.worn_steel(rng),
        Material((0.85, 0.42, 0.05), roughness=0.2, role="lamp"),
        stone,
    )
    if kind in {"new_jersey", "water_filled"}:
        parts, hull = _safety_shape(kind == "water_filled", rng.seed, rng)
    elif kind == "plastic":
        parts, hull = _grille(rng)
    else:
        parts, hull = _boards(kind == "trestle", rng)
    return make_solid(parts, materials, [hull])


def _safety_shape(plastic: bool, seed: int, rng: VariantRng) -> tuple[list[Patch], np.ndarray]:
    """A New Jersey profile: foot 0.6 m wide (0.41 m plastic), 0.8 m high (EN 1317 systems)."""
    half, wide = (0.6, 0.68) if plastic else (1.0, 1.0)
    high = rng.between(0.8, 0.85, "height_m")
    flank = [(0.0, 0.3), (0.075, 0.3), (0.33, 0.17), (high, 0.09)]
    outline = np.array([(wide * x, z) for z, x in flank] + [(-wide * x, z) for z, x in flank[::-1]])
    # The outline's second axis becomes Z, the extrusion runs along -Y.
    body = surfaces.extrude(outline, 2 * half, 0.01).rotated("x", 0.5 * math.pi).moved(y=half)
    slot = 5 if not plastic else (seed // 6) % 2
    parts = [body.painted(slot)]
    if plastic:
        for y in (-0.3, 0.3):
            parts.append(surfaces.block((-0.16, y - 0.05, 0.0), (0.16, y + 0.05, 0.05), 0.0, 2))
        parts.append(post(0.05, (high - 0.01, high + 0.03), (0.0, 0.35, 0.0), 10).painted(2))
    else:
        for y in np.linspace(-0.7, 0.7, 3):
            mark = facing_rectangle(0.235, (y - 0.05, y + 0.05), (0.28, 0.4), 4 if seed % 2 else 1)
            parts.append(mark.rotated("y", 0.0).moved(0.0))
    return parts, hulls.extreme(body.corners_m, 24)


def _grille(rng: VariantRng) -> tuple[list[Patch], np.ndarray]:
    """A plastic barrier for pedestrians, 2 x 1 m, with a striped top rail."""
    half, high, foot = 1.0, 1.0, 0.1
    parts = [
        surfaces.block((-0.022, -half, z), (0.022, half, z + 0.05), 0.01)
        for z in (foot + 0.05, foot + 0.28, high - 0.3)
    ]
    bars = [half * (2 * k / 13 - 1) for k in range(1, 13)]
    parts += [
        surfaces.block((-0.014, y - 0.018, foot + 0.05), (0.014, y + 0.018, high - 0.28))
        for y in bars
    ]
    ends = (-half + 0.03, half - 0.03)
    parts += [surfaces.block((-0.022, y - 0.03, foot), (0.022, y + 0.03, high), 0.01) for y in ends]
    parts += _striped(half, (high - 0.22, high), 10)
    for y in (-half + 0.2, half - 0.2):
        parts.append(surfaces.block((-0.35, y - 0.06, 0.0), (0.35, y + 0.06, foot), 0.012, 2))
    if rng.chance(0.4):
        parts += _lamp(half - 0.25, high)
    return parts, hulls.box((-0.05, -half, 0.0), (0.05, half, high))


def _boards(trestle: bool, rng: VariantRng) -> tuple[list[Patch], np.ndarray]:
    """Striped boards on posts with heavy feet, or on a trestle."""
    half, high = (0.6, 1.0) if trestle else (rng.choose((1.0, 1.25)), 1.05)
    parts = _striped(half, (high - 0.25, high), round(8 * half))
    if trestle or rng.chance(0.6):
        parts += _striped(half, (0.35, 0.5), round(8 * half))
    ends = (-half + 0.12, half - 0.12)
    for y in ends:
        if trestle:
            for x in (-0.32, 0.32):
                parts.append(clutter.bar((x, y, 0.02), (0.0, y, high - 0.05), 0.028, 4, 1))
            continue
        parts.append(surfaces.block((-0.035, y - 0.025, 0.05), (0.005, y + 0.025, 1.15), 0.0, 3))
        parts.append(surfaces.block((-0.4, y - 0.14, 0.0), (0.4, y + 0.14, 0.1), 0.015, 2))
        if rng.chance(0.5):
            parts += _lamp(y, 1.15)
    return clutter.on_ground(parts), hulls.box((-0.1, -half, 0.0), (0.1, half, high))


def _lamp(y: float, z: float) -> list[Patch]:
    """A warning lamp: a battery box with an amber disc."""
    disc = surfaces.cone((0.09, 0.0), (0.09, 0.06), 14, 4).rotated("y", 0.5 * math.pi)
    box = surfaces.block((-0.05, y - 0.08, z), (0.05, y + 0.08, z + 0.12), 0.01, 2)
    return [box, disc.moved(-0.03, y, z + 0.2)]


def _striped(half: float, z_m: tuple[float, float], fields: int) -> list[Patch]:
    """A board with slanted red fields on both faces; slots 0 and 1."""
    (z0, z1), step = z_m, 2 * half / max(fields, 2)
    lean = 0.6 * (z1 - z0)
    parts = [surfaces.block((0.006, -half, z0), (0.026, half, z1), slot=1)]
    for k in range(-1, fields, 2):
        a, b = -half + k * step, -half + (k + 1) * step
        # Corners: foot a, foot b, head b, head a; fields are cut at the board's ends.
        foot = np.clip([a, b], -half, half)
        head = np.clip([a + lean, b + lean], -half, half)
        if head[1] - head[0] < 1e-3:
            continue
        for x, turned in ((0.0275, False), (0.0045, True)):
            rows = np.array([[(x, foot[0], z0), (x, foot[1], z0)], [(x, head[0], z1),
                             (x, head[1], z1)]])  # fmt: skip
            parts.append(surfaces.grid(rows).flipped() if turned else surfaces.grid(rows))
    return parts


def construction_fence(rng: VariantRng) -> Solid:
    """A site fence panel of 3.5 x 2.0 m in concrete feet; hoarding or netting on some.

    Panel size: usual of mobile site fences (assumed, 5 %). Slots: steel, feet, sheet, sign.
    """
    kind = rng.turn(_SITE_FENCES, "covering")
    half, high, foot = 1.75, 2.0, 0.13
    frame = [(-half, foot), (-half, high), (half, high), (half, foot)]
    parts = [clutter.rod([(0.0, y, z) for y, z in frame], 0.021, 6)]
    parts.append(clutter.bar((0.0, -half, foot + 0.1), (0.0, half, foot + 0.1), 0.015, 5))
    parts += [
        clutter.wire((0.0, float(y), foot + 0.1), (0.0, float(y), high), 0.002)
        for y in np.arange(-half + 0.1, half, 0.1)
    ]
    parts += [
        clutter.wire((0.0, -half, float(z)), (0.0, half, float(z)), 0.002)
        for z in np.arange(foot + 0.35, high, 0.25)
    ]
    # The next panel's foot carries the other end.
    y = -half + 0.09
    parts.append(surfaces.block((-0.34, y - 0.11, 0.0), (0.34, y + 0.11, foot + 0.02), 0.012, 1))
    if kind in {"netting", "sheet"}:
        x = 0.024
        waves = np.linspace(-half + 0.03, half - 0.03, 12)
        rows = [[(x + 0.012 * math.sin(5.0 * float(y) + z), float(y), z) for y in waves]
                for z in (foot + 0.12, 1.1, high - 0.04)]  # fmt: skip
        sheet = surfaces.grid(np.array(rows), slot=2)
        parts += [sheet, sheet.flipped().moved(-0.006)]
    if kind == "sign":
        low = 1.1
        parts.append(surfaces.block((0.022, -0.3, low), (0.027, 0.3, low + 0.75), 0.0, 2))
        parts.append(facing_rectangle(0.029, (-0.27, 0.27), (low, low + 0.75), 3))
    color = rng.choose(("#3f6a50", "#44638a", "#d8d8d2", "#b8836a"))
    concrete = presets.patterned_material("texture/concrete?seed=3", 1.5, 0.9)
    cloth = Material(presets.draw_linear((color,), 0.15, rng), roughness=0.85)
    sign = presets.printed_material(f"texture/poster?seed={rng.seed % 12}", 0.4)
    hull = hulls.box((-0.05, -half, 0.0), (0.05, half, high))
    return make_solid(parts, (clutter.worn_steel(rng), concrete, cloth, sign), [hull])


_SITE_FENCES = ("plain", "netting", "sign", "sheet")


def scaffold(rng: VariantRng) -> Solid:
    """One bay of a facade scaffold: 2.57 m long, 0.73 m deep, lifts of 2 m; 3 to 5 lifts.

    Bay sizes of frame scaffolds (system widths of EN 12810: SW06 to SW09; 2.57 m is usual,
    assumed). The facade is at -X. Slots: steel, decks, boards, netting.
    """
    # Neighbouring bays have separate standards, side by side.
    half, x0, x1, lifts = 1.25, -0.365, 0.365, rng.turn((3, 4, 3, 5), "lifts")
    top = 2.0 * lifts
    parts = []
    for x in (x0, x1):
        for y in (-half, half):
            end = top + (1.0 if x == x1 else 0.0)
            parts.append(clutter.bar((x, y, 0.04), (x, y, end), 0.024, 7))
            parts.append(surfaces.block((x - 0.07, y - 0.035, 0.0), (x + 0.07, y + 0.035, 0.015)))
    for k in range(1, lifts + 1):
        z = 2.0 * k
        parts += [clutter.bar((x0, y, z - 0.05), (x1, y, z - 0.05), 0.02, 5) for y in (-half, half)]
        for x in (x0 + 0.03, x0 + 0.38):
            parts.append(surfaces.block((x, -half, z - 0.03), (x + 0.32, half, z + 0.01), 0.0, 1))
        parts += [clutter.bar((x1, -half, z + h), (x1, half, z + h), 0.017, 5) for h in (0.5, 1.0)]
        part = surfaces.block((x1 - 0.03, -half, z + 0.01), (x1 - 0.005, half, z + 0.16), 0.0, 2)
        parts.append(part)
    for k in range(lifts):
        if k % 2 == rng.seed % 2:
            low, high = 2.0 * k + 0.1, 2.0 * k + 1.9
            parts.append(clutter.bar((x1 + 0.03, -half, low), (x1 + 0.03, half, high), 0.017, 5))
    if rng.turn((False, True), "netting"):
        x = x1 + 0.06
        waves = np.linspace(-half, half, 9)
        rows = [[(x + 0.03 * math.sin(3.0 * float(y) + 1.7 * z), float(y), z) for y in waves]
                for z in np.linspace(2.0, top + 0.9, 2 * lifts).tolist()]  # fmt: skip
        net = surfaces.grid(np.array(rows), slot=3)
        parts += [net, net.flipped().moved(-0.006)]
    planks = presets.patterned_material("texture/wood_planks?seed=2", 1.4, 0.85, (0.6, 0.53, 0.46))
    boards = rng.choose((presets.painted_material("#d9a520", 0.6), planks))
    net_color = rng.choose(("#6f9a7c", "#d5d6d2", "#7f97ab"))
    cloth = Material(presets.draw_linear((net_color,), 0.15, rng), roughness=0.9, opacity=0.75)
    steel = clutter.worn_steel(rng)
    decks = rng.choose((planks, steel))
    hull = [hulls.box((x0, -half, 1.9), (x1, half, top))]
    return make_solid(parts, (steel, decks, boards, cloth), hull)


def scaffold_facts(seed: int) -> Facts:
    """Whether it carries netting."""
    attributes = {
        "netting": "yes" if variant_rng("scaffold", seed).turn((False, True), "netting") else "no"
    }
    return Facts("scaffold", attributes)
