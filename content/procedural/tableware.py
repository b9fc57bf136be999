"""Mugs, cups, glasses, bowls, vases and plates: bodies of revolution, hollow in physics too.

Kinds and their measures are rows of ``vessels.yaml``, handles of ``handles.yaml``.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from gen_data.assets.family import Facts, Solid, axis_symmetries
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural import vessels
from gen_data.content.procedural.material_presets import (
    GLAZES,
    PALETTES,
    PLASTICS,
    STAINLESS,
    ceramic_material,
    draw_linear,
    hex_to_linear,
    lighten,
    metal_material,
    painted_material,
    plastic_material,
    printed_material,
)
from gen_data.content.procedural.patches import Array, Patch, make_centred_solid
from gen_data.content.procedural.plated_food import SMALL, meal_on_plate, serve
from gen_data.content.procedural.textures.tableware_prints import decor_ground
from gen_data.content.procedural.vessel_contents import FOODS, Filling, fill
from gen_data.content.procedural.vessels import Choice, Walls, radius_at
from gen_data.core.asset_types import Material, Symmetry
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

Point2 = shapes.Point2
_SEE_THROUGH = ("glass", "clear_plastic")
# Transmittance of one wall, RGB; soda-lime glass is slightly green.
_TINTS: tuple[Vec3, ...] = ((0.97, 0.98, 0.97), (0.97, 0.98, 0.97), (0.97, 0.98, 0.97),
                            (0.97, 0.98, 0.97), (0.86, 0.93, 0.95), (0.86, 0.95, 0.88),
                            (0.95, 0.88, 0.72))  # fmt: skip


@dataclass(frozen=True, slots=True)
class Handle:
    """Ranges of a handle.

    Attributes:
        high, low: Heights of its ends, as shares of the vessel's height.
        reach_m: How far it stands off the wall.
        square: Exponent of its outline: 0.3 is nearly square, 1 an ellipse.
        belly: Smaller below where negative.
        thick_m, wide_m: Half axes of its section, in the plane of the handle and across.
    """

    high: Point2
    low: Point2
    reach_m: Point2
    square: Point2
    belly: Point2
    thick_m: Point2
    wide_m: Point2


# Food keeps this distance from a plate: surfaces must not coincide.
_ON_PLATE_M = 0.0001
# Limit on the convex parts of an object.
_PARTS_MAX = 24
HANDLES: Mapping[str, Handle] = load_table(__package__, "handles", Handle)


def vessel_symmetries(group: str, seed: int) -> tuple[Symmetry, ...]:
    """Any turn about Z, or turns of its flat sides; none where a handle or a print shows it."""
    choice = vessels.choose(group, seed)
    lopsided = choice.handle or choice.decor not in ("plain", "bands", "rim") or choice.straw
    if lopsided or choice.content in _UNEVEN or choice.finish == "wood":
        return ()
    return axis_symmetries(z=choice.facets)


_UNEVEN = {*FOODS, "iced_tea", "iced_coffee", "water", "cola", "whisky", "cappuccino", "latte",
           "coffee", "white_coffee", "cocoa", "espresso"}  # fmt: skip


def vessel_facts(group: str, seed: int) -> Facts:
    """Kind and contents."""
    choice = vessels.choose(group, seed)
    contents = {"contents": choice.content} if choice.content else {}
    return Facts(choice.kind.partition("/")[2], contents)


def vessel(group: str, seed: int) -> Solid:
    """Walls, handle, contents, then parts that stand on, around or under the vessel."""
    choice, rng = vessels.choose(group, seed), variant_rng(group, seed)
    style = vessels.STYLES[choice.kind]
    walls = vessels.draw_walls(style, rng)
    patches = vessels.make_walls(walls)
    if choice.facets:
        top = walls.outer[-1][1]
        patches[1] = vessels.cut_facets(patches[1], choice.facets, 0.04 * top, 0.82 * top)
    materials = list(_wall_materials(choice, seed, rng))
    grip: list[Array] = []
    if choice.handle:
        bar, grip = _handle(HANDLES[choice.handle], walls, rng)
        patches.append(bar.painted(2))
        materials.append(_grip_material(choice, seed, materials))
    filling = Filling([], [], [], 0.0)
    is_hidden = choice.lid and choice.finish not in _SEE_THROUGH
    if not is_hidden:
        clear = choice.finish in _SEE_THROUGH
        level = rng.between(*style.fill)
        filling = fill(choice.content, walls, level, rng, len(materials), clear)
    patches, materials = [*patches, *filling.patches], [*materials, *filling.materials]
    stem = style.floor_share > 0.0 or filling.solid_to_m > 0.0
    others = [make for is_wanted, make in _PARTS if is_wanted(choice)]
    left = _PARTS_MAX - len(grip) - len(filling.parts) - len(others)
    parts = [*vessels.hollow_hulls(walls, filling.solid_to_m, 4 if stem else 2, left), *grip]
    if group in ("vase", "carafe"):
        # Nothing falls into a narrow neck.
        parts = vessels.solid_hulls(walls)
    for make in others:
        more, material, hull = make(choice, walls, rng)
        patches += [patch.painted(len(materials)) for patch in more]
        materials.append(material)
        parts.append(hull)
    return make_centred_solid(patches, materials, [*parts, *filling.parts])


def _wall_materials(choice: Choice, seed: int, rng: VariantRng) -> tuple[Material, Material]:
    outside = _FINISHES[choice.finish](rng)
    if choice.finish in (*_SEE_THROUGH, "wood", "steel"):
        return outside, outside
    if choice.finish in ("party", "enamel", "paper", "painted_steel"):
        white = painted_material("#f1efe9", outside.roughness)
        inside = metal_material(STAINLESS, 0.3) if choice.finish == "painted_steel" else white
    elif choice.finish == "plastic":
        inside = outside if rng.chance(0.6) else plastic_material(rng, ("#f0f0ec", "#e8e4da"))
    elif rng.chance(0.5):
        inside = outside
    else:
        inside = Material(lighten(outside.base_color, rng.between(0.5, 0.95)), outside.roughness)
    if choice.decor == "plain":
        return outside, inside
    rough = 0.85 if choice.decor in ("dip", "drips") else rng.between(0.1, 0.3)
    texture = f"texture/ceramic_decor?kind={choice.decor}&seed={seed}"
    cream = Material(draw_linear(("#f4f1ea", "#f4f1ea", "#efe8d8"), 0.04, rng), 0.2)
    return printed_material(texture, rough), cream


def _grip_material(choice: Choice, seed: int, walls: list[Material]) -> Material:
    """Colour of the wall's glaze: the one under a pattern, seldom the one of the inside."""
    if choice.decor == "plain":
        return walls[0]
    if variant_rng("handle", seed).chance(0.1):
        return walls[1]
    r, g, b = decor_ground(seed, choice.decor)
    return painted_material(f"#{r:02x}{g:02x}{b:02x}", 0.2)


def _glass(rng: VariantRng) -> Material:
    return Material(rng.choose(_TINTS), roughness=0.04, transmission=1.0, ior=1.52, thin=False)


def _clear_plastic(rng: VariantRng) -> Material:
    tint = (0.97, 0.98, 0.98)
    return Material(tint, rng.between(0.04, 0.1), transmission=1.0, ior=1.57, thin=False)


def _steel(rng: VariantRng) -> Material:
    return metal_material(STAINLESS, rng.between(0.18, 0.38))


def _wood(rng: VariantRng) -> Material:
    texture, tint = f"texture/wood_grain?seed={int(rng.between(0, 18))}", rng.between(0.75, 1.0)
    return Material((tint, tint, tint), rng.between(0.4, 0.6), texture=texture,
                    texture_scale_m=0.18, printed=True)  # fmt: skip


def _white_or(codes: tuple[str, ...], share: float) -> Callable[[VariantRng], Material]:
    """Glazed ceramic that is white with a probability, else of one of the colours."""

    def make(rng: VariantRng) -> Material:
        return ceramic_material(rng, GLAZES[:2] if rng.chance(share) else codes)

    return make


_FINISHES: Mapping[str, Callable[[VariantRng], Material]] = {
    # Half of the mugs in shops are white (assumed, 0.4 to 0.6).
    "ceramic": _white_or(GLAZES, 0.45),
    "porcelain": _white_or(GLAZES[:5], 0.8),
    "stoneware": _white_or(("#8f8a7c", "#5f6a6b", "#3a4654", "#a07a56", "#cfc4ae", "#2e2c2a"), 0.1),
    "enamel": _white_or(("#2d4f7c", "#3d6b5c", "#b5432e", "#1d1f22"), 0.6),
    "glass": _glass,
    "clear_plastic": _clear_plastic,
    "steel": _steel,
    "painted_steel": lambda rng: replace(plastic_material(rng, PLASTICS), roughness=0.42),
    "plastic": plastic_material,
    "party": lambda rng: plastic_material(rng, ("#c3121f", "#c3121f", "#1f4fa0", "#202124")),
    "paper": lambda rng: painted_material(rng.choose(("#f0eee8", "#f0eee8", "#b98e5f")), 0.55),
    "wood": _wood,
    "terracotta": lambda rng: painted_material(rng.choose(("#b5643f", "#c4754c", "#a85a3a")), 0.85),
}


def _handle(style: Handle, walls: Walls, rng: VariantRng) -> tuple[Patch, list[Array]]:
    """A handle in the plane y = 0, and its collision parts; its ends are inside the wall."""
    height = walls.outer[-1][1]
    high, low = height * rng.between(*style.high), height * rng.between(*style.low)
    reach, square = rng.between(*style.reach_m), rng.between(*style.square)
    belly = rng.between(*style.belly)
    ends = [radius_at(walls.outer, z) - 0.5 * walls.wall_m for z in (high, low)]
    turn = np.linspace(0.5 * np.pi, -0.5 * np.pi, 121)
    # A superellipse: it leaves the wall level and bulges less below where belly is negative.
    out = np.maximum(np.cos(turn), 0.0) ** square * (1.0 + 0.5 * belly * (1.0 - np.sin(turn)))
    share = 0.5 * (1.0 + np.sin(turn))
    z = low + (high - low) * share
    wall = [radius_at(walls.outer, float(h)) - 0.5 * walls.wall_m for h in z]
    foot = np.maximum(ends[1] + (ends[0] - ends[1]) * share, np.array(wall))
    line = np.stack([foot + reach * out, np.zeros_like(z), z], axis=1)
    line[[0, -1], 0] = ends
    path = shapes.space_evenly(line, 21)
    thick, wide = rng.between(*style.thick_m), rng.between(*style.wide_m)
    section = shapes.circle(1.0, 12) * np.array((thick, wide))
    flare = 1.0 + 0.35 * np.abs(np.linspace(-1.0, 1.0, len(path))) ** 6
    bar = shapes.sweep(path, section, scale=flare)
    return bar, hulls.tube(path[[0, 5, 10, 15, 20]], 0.4 * (thick + wide))


Part = tuple[list[Patch], Material, Array]


def _lid(choice: Choice, walls: Walls, rng: VariantRng) -> Part:
    """A lid with a raised edge; of clear cups a dome."""
    r, z = walls.outer[-1]
    lip = [
        (0.0, z - 0.005),
        (r + 0.0008, z - 0.005),
        (r + 0.0024, z - 0.004),
        (r + 0.0024, z + 0.001),
    ]
    if choice.finish == "clear_plastic":
        dome = [(0.96 * r, z + 0.004), (0.86 * r, z + 0.02), (0.55 * r, z + 0.033),
                (0.0, z + 0.036)]  # fmt: skip
        made = shapes.fillet([*lip, *dome], [0.0, 0.0, 0.0, 0.001, 0.003, 0.02, 0.03, 0.0], 3)
        clear = Material((0.97, 0.98, 0.98), 0.05, transmission=1.0, ior=1.57, printed=True)
        return (
            [shapes.lathe(made, 40)],
            clear,
            hulls.frustum((r + 0.0024, z - 0.004), (0.5 * r, z + 0.036)),
        )
    crown = [(r - 0.0015, z + 0.011), (r - 0.005, z + 0.0115), (r - 0.008, z + 0.006),
             (0.0, z + 0.0055)]  # fmt: skip
    profile = shapes.fillet([*lip, *crown], [0.0, 0.0, 0.0, 0.0005, 0.002, 0.001, 0.002, 0.0], 2)
    codes = ("#f1efe9", "#f1efe9", "#1d1d1f", "#5a4636")
    material = plastic_material(rng, codes)
    return (
        [shapes.lathe(profile, 40)],
        material,
        hulls.frustum((r + 0.0024, z - 0.004), (r - 0.003, z + 0.0115)),
    )


def _sleeve(_: Choice, walls: Walls, rng: VariantRng) -> Part:
    """A band of corrugated board around a paper cup."""
    height = walls.outer[-1][1]
    z0, z1 = height * rng.between(0.22, 0.32), height * rng.between(0.62, 0.74)
    (r0, r1), t = (radius_at(walls.outer, z) for z in (z0, z1)), 0.0009
    ring = [(r0 - t, z0), (r0 + t, z0), (r1 + t, z1), (r1 - t, z1), (r0 - t, z0)]
    kraft = Material(draw_linear(("#b1875a", "#a67c50", "#3a2f2a"), 0.08, rng), 0.8)
    return [shapes.lathe(ring, 40)], kraft, hulls.frustum((r0 + t, z0), (r1 + t, z1))


def _straw(choice: Choice, walls: Walls, rng: VariantRng) -> Part:
    r, z = walls.outer[-1]
    top = z + rng.between(0.04, 0.065) + (0.02 if choice.lid else 0.0)
    foot = (-0.45 * radius_at(walls.inner[4:-1], walls.floor_m + 0.004), 0.0, walls.floor_m + 0.002)
    lean = (0.3 if choice.lid else 0.86) * (r - walls.wall_m)
    slope = (lean - foot[0]) / (z - foot[2])
    tip = (foot[0] + slope * (top - foot[2]), 0.0, top)
    path = np.linspace(foot, tip, 5)
    radius = rng.between(0.003, 0.004)
    straw = shapes.sweep(path, shapes.circle(radius, 10), up=(1.0, 0.0, 0.0))
    codes = ("#f2f2ee", "#1f1f22", "#c3121f", "#2e8a4e", "#b98e5f")
    return [straw], plastic_material(rng, codes), hulls.tube(path[[0, 4]], 0.9 * radius)[0]


def _saucer(_: Choice, walls: Walls, rng: VariantRng) -> Part:
    """A saucer whose well holds the foot; the cup keeps its place, the saucer is below."""
    foot, wide = walls.outer[0][0], walls.outer[-1][0]
    radius, rise = wide * rng.between(1.55, 1.8), rng.between(0.0105, 0.013, "rise_m")
    low = -0.003
    profile = [(0.0, low - 0.002), (0.8 * foot, low - 0.002), (0.82 * foot, low - 0.004),
               (foot, low - 0.004), (1.3 * foot, low - 0.001), (radius, low + rise - 0.002),
               (radius + 0.0012, low + rise), (radius - 0.001, low + rise + 0.001),
               (1.35 * foot, low + 0.0035), (1.12 * foot, low + 0.0028),
               (0.0, low + 0.0028)]  # fmt: skip
    rounding = [0.0, 0.0, 0.0, 0.002, 0.02, 0.001, 0.001, 0.001, 0.02, 0.004, 0.0]
    plate = shapes.lathe(shapes.fillet(profile, rounding, 2), 48)
    hull = hulls.frustum((foot, low - 0.004), (radius, low + 0.0095), 24)
    return [plate], ceramic_material(rng, GLAZES[:2]), hull


_PARTS: tuple[tuple[Callable[[Choice], bool], Callable[[Choice, Walls, VariantRng], Part]], ...] = (
    (lambda c: c.saucer, _saucer),
    (lambda c: c.sleeve, _sleeve),
    (lambda c: c.lid, _lid),
    (lambda c: c.straw, _straw),
)


def plate(seed: int) -> Solid:
    """A plate, clean or with a meal. Slots: outside, inside, rim, then food."""
    rng, meal = variant_rng("plate", seed), meal_on_plate(seed)
    # Side, dessert, dinner, pizza plates (assumed, within 5 %).
    sizes: tuple[float, ...] = (0.085, 0.105, 0.13, 0.14, 0.12, 0.155)
    if meal:
        sizes = (0.105, 0.11) if meal in SMALL else (0.13, 0.14, 0.135, 0.155)
    radius = in_turn(sizes, seed) * rng.between(0.96, 1.04)
    rise, wall = rng.between(0.016, 0.026, "rise_m"), rng.between(0.0035, 0.005, "wall_m")
    well, foot = radius * rng.between(0.58, 0.86), radius * rng.between(0.48, 0.56)
    step = rise * rng.between(0.35, 0.7)
    bend, floor = well + 0.35 * (radius - well), 0.002 + wall
    upper = shapes.fillet([(radius, rise), (bend, step + 0.002), (well, floor)], 0.014, 3)
    within = shapes.fillet([(bend, step + 0.002), (well, floor), (0.0, floor)], 0.014, 3)
    split = (0.5 * (bend + well), 0.5 * (step + 0.002 + floor))
    upper, within = [*upper[:-1], split], [split, *within[1:]]
    under = [(0.0, 0.002), (foot - 0.004, 0.002), (foot - 0.003, 0.0), (foot, 0.0),
             (foot + 0.002, 0.002), (well, 0.0025), (bend, step + 0.002 - wall),
             (radius, rise - 0.8 * wall)]  # fmt: skip
    lower = shapes.fillet(under, [0.0] * 5 + [0.012, 0.012, 0.0], 3)
    edge = radius + 0.4 * wall
    lip = (edge, rise - 0.4 * wall)
    patches = [
        shapes.lathe([*lower, lip, upper[0]], 48, 0),
        shapes.lathe(upper, 48, 2, v=(1.0, 0.0)),
        shapes.lathe(within, 48, 1),
    ]
    materials = _plate_materials(seed, rng)
    parts = [
        hulls.frustum((foot, 0.0), (well, floor), 24),
        *hulls.wedges([(well - 0.004, 0.0015), (well - 0.004, floor), (bend, step + 0.002),
                       (edge, rise), (edge, rise - 0.8 * wall)], 20),
    ]  # fmt: skip
    if meal:
        served = serve(meal, seed, 0.94 * well, len(materials), variant_rng("plate/meal", seed))
        patches += [patch.moved(z=floor + _ON_PLATE_M) for patch in served.patches]
        materials += served.materials
        parts += [hull + np.array([0.0, 0.0, floor]) for hull in served.hulls]
    return make_centred_solid(patches, materials, parts)


def plate_facts(seed: int) -> Facts:
    """The meal on it."""
    meal = meal_on_plate(seed)
    return Facts("", {"contents": meal} if meal else {})


def _plate_decor(seed: int) -> str:
    options = ("plain", "plain", "plain", "bands", "rim", "willow", "motif", "speckled")
    return variant_rng("plate/decor", seed).choose(options)


def plate_symmetries(seed: int) -> tuple[Symmetry, ...]:
    """Any turn about Z of clean plates whose rim is plain or has lines."""
    is_even = _plate_decor(seed) in ("plain", "bands", "rim") and not meal_on_plate(seed)
    return axis_symmetries(z=0) if is_even else ()


def _plate_materials(seed: int, rng: VariantRng) -> list[Material]:
    decor = _plate_decor(seed)
    outside = ceramic_material(rng, PALETTES["glazes"][:2] if rng.chance(0.5) else GLAZES)
    if decor == "plain":
        inside = outside
        if rng.chance(0.2):
            inside = Material(draw_linear(GLAZES, 0.08, rng), outside.roughness)
        return [outside, inside, inside]
    white = Material(hex_to_linear("#f0ede6"), outside.roughness)
    texture = f"texture/ceramic_decor?kind={decor}&seed={seed + 500}"
    return [white, white, printed_material(texture, outside.roughness)]
