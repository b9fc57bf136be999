"""Bicycles left at the street, kick scooters, trailers."""

import math

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.procedural.surface_shapes import block, cone, rounded_box
from gen_data.content.scenery.basic_shapes import facing_rectangle, make_solid, post
from gen_data.content.scenery.clutter_shapes import (
    Rectangle,
    bar,
    hopper,
    on_ground,
    rod,
    worn_paint,
)
from gen_data.content.scenery.street_furniture import GALVANISED
from gen_data.content.vehicles import bicycle, wheels
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

PARKINGS = ("stand", "leaning", "hoop", "stand", "rack", "fallen", "hoop_pair", "rack")
_LEAN_RAD = {"stand": -0.09, "leaning": 0.2, "hoop": 0.06, "fallen": 1.38}
TRAILERS = ("box", "flat", "cargo", "boat")


def parked_bicycle(rng: VariantRng) -> Solid:
    """A bicycle without rider along X: on its stand, against a wall at -Y, at a hoop, fallen over.

    Some variants are rows of bicycles side by side in a rack. Slots: the bicycles', then the hoop's
    or rack's.
    """
    kind = rng.turn(PARKINGS, "parking")
    steel = (GALVANISED if rng.chance(0.6) else material_presets.painted_material("#3b3d3f", 0.5),)
    count = {"rack": 3, "hoop_pair": 2}.get(kind, 1)
    pieces: list[tuple[list[Patch], tuple[Material, ...]]] = []
    for k in range(count):
        machine, finish = bicycle.bicycle_parts((rng.seed * 5 + 7 * k) % 36)
        lean = _LEAN_RAD.get(kind, rng.between(-0.05, 0.05))
        along = math.pi if kind == "hoop_pair" and k else 0.0
        away = (k - 0.5 * (count - 1)) * (0.55 if kind == "rack" else 0.6)
        turn = along + rng.between(-0.04, 0.04)
        # It leans to -Y about the ground line of its wheels.
        placed = join_patches(machine).rotated("x", lean).rotated("z", turn)
        pieces.append(([placed.moved(rng.between(-0.05, 0.05), away)], finish))
    if kind == "stand":
        pieces.append(([bar((-0.12, 0.06, 0.29), (-0.2, 0.19, 0.0), 0.009, 5)], steel))
    if kind.startswith("hoop"):
        pieces.append(([_hoop()], steel))
    if kind == "rack":
        pieces.append((_rack(count), steel))
    parts, materials = _stack(pieces)
    corners = np.concatenate([part.corners_m.reshape(-1, 3) for part in parts])
    # Without the ends of handlebars and tyres.
    (x0, y0, _), (x1, y1, _) = (0.9 * edge for edge in (corners.min(axis=0), corners.max(axis=0)))
    top = 0.3 if kind == "fallen" else 0.8
    hull = hulls.box((float(x0), float(y0), 0.0), (float(x1), float(y1), top))
    return make_solid(on_ground(parts), materials, [hull])


def parked_bicycle_facts(seed: int) -> Facts:
    """How it is parked."""
    return Facts(
        "parked",
        {"parking": variant_rng("parked_bicycle", seed).turn(PARKINGS, "parking"), "rider": "no"},
    )


def _stack(
    pieces: list[tuple[list[Patch], tuple[Material, ...]]],
) -> tuple[list[Patch], tuple[Material, ...]]:
    """Pieces with separate materials as parts with slots of one list; equal ones are shared."""
    materials: list[Material] = []
    parts = []
    for patches, own in pieces:
        numbers = []
        for material in own:
            if material not in materials:
                materials.append(material)
            numbers.append(materials.index(material))
        table = np.array(numbers, dtype=np.int64)
        parts += [Patch(p.corners_m, p.uvs, table[p.slots]) for p in patches]
    return parts, tuple(materials)


def _hoop() -> Patch:
    """A hoop of 0.7 x 0.8 m next to the bicycle, as in the racks of street_furniture."""
    bend = [(0.35, 0.0), (0.35, 0.65), (0.31, 0.76), (0.2, 0.8)]
    path = [(-x, 0.0, z) for x, z in bend] + [(x, 0.0, z) for x, z in bend[::-1]]
    return rod(path, 0.024, 7).moved(-0.05, -0.16)


def _rack(count: int) -> list[Patch]:
    """Loops that hold front wheels, on two rails along Y."""
    half, parts = 0.275 * count + 0.15, []
    parts += [bar((x, -half, 0.03), (x, half, 0.03), 0.02) for x in (0.35, 0.85)]
    for k in range(count):
        y = (k - 0.5 * (count - 1)) * 0.55
        for side in (-0.045, 0.045):
            loop = [(0.38, y + side, 0.04), (0.5, y + side, 0.42), (0.66, y + side, 0.42),
                    (0.8, y + side, 0.04)]  # fmt: skip
            parts.append(rod(loop, 0.009, 4))
    return parts


def kick_scooter(rng: VariantRng) -> Solid:
    """An electric kick scooter along X, on its stand or fallen over.

    1.15 x 0.45 x 1.18 m, wheels of 10 inch (assumed from data sheets of shared scooters, 5 %).
    Slots: frame, deck, tyre, trim, headlight, taillight.
    """
    axle, r = 0.43, 0.125
    head = (0.33, 0.0, 0.32)
    grip = (0.24, 0.0, 1.14)
    handlebar = [(0.22, -0.24, 1.13), (0.25, -0.1, 1.15), (0.25, 0.1, 1.15), (0.22, 0.24, 1.13)]
    tyre = cone((r, -0.03), (r, 0.03), 16, 2).rotated("x", 0.5 * math.pi)
    hub = cone((0.05, -0.034), (0.05, 0.034), 10, 3).rotated("x", 0.5 * math.pi)
    parts = [piece.moved(x, 0.0, r) for x in (axle, -axle) for piece in (tyre, hub)]
    parts += [
        rounded_box((0.62, 0.17, 0.06), 0.02, 1).moved(-0.08, 0.0, 0.155),
        block((-0.37, -0.075, 0.185), (0.2, 0.075, 0.191), 0.0, 1),
        rod([(0.2, 0.0, 0.16), (0.28, 0.0, 0.22), head], 0.032, 7),
        rod([(axle, 0.0, r), (axle - 0.02, 0.0, 0.28), head, grip], 0.024, 7),
        rod([(-0.36, 0.0, 0.16), (-axle, 0.0, r)], 0.03, 6),
        rod(handlebar, 0.014, 6, 3),
        rounded_box((0.06, 0.05, 0.05), 0.015, 1).moved(0.29, 0.0, 1.05).painted(4),
        block((-0.56, -0.035, 0.2), (-0.54, 0.035, 0.23), 0.0, 5),
        rod([(-0.3, 0.0, 0.24), (-0.46, 0.0, 0.28), (-0.55, 0.0, 0.22)], 0.03, 5, 3),
        rod([(-0.05, 0.06, 0.13), (-0.08, 0.16, 0.03)], 0.009, 5, 3),
    ]  # fmt: skip
    fallen = _is_fallen(rng.seed)
    lean = 1.42 if fallen else -0.12
    body = join_patches(parts).rotated("x", lean)
    color = in_turn(("#2fb35a", "#17181a", "#e9e9e4", "#e0622a", "#1fa0a8", "#7fc31f"), rng.seed)
    materials = (
        worn_paint((color,), 0.35, rng),
        material_presets.painted_material("#1c1d1e", 0.9),
        Material((0.02, 0.02, 0.02), roughness=0.85, role="tyre"),
        material_presets.painted_material(rng.choose(("#17181a", "#2f3234")), 0.5),
        Material((0.62, 0.65, 0.68), roughness=0.1, role="headlight"),
        Material((0.3, 0.008, 0.01), roughness=0.12, role="taillight"),
    )
    half_y = 0.4 if fallen else 0.1
    hull = hulls.box((-0.5, -half_y, 0.0), (0.5, half_y, 0.25))
    return make_solid(on_ground([body]), materials, [hull])


def kick_scooter_facts(seed: int) -> Facts:
    """Whether it stands or has fallen over."""
    return Facts("kick_scooter", {"parking": "fallen" if _is_fallen(seed) else "stand"})


def _is_fallen(seed: int) -> bool:
    return variant_rng("kick_scooter", seed).turn((False,) * 4 + (True,), "fallen")


def trailer(rng: VariantRng) -> Solid:
    """A one-axle car trailer along X, its drawbar at +X: a tarpaulin box, flat, cargo or boat.

    Boxes of 2.0-2.6 x 1.1-1.3 m (assumed from makers' catalogues). Slots: body, second, rim, tyre,
    taillights, tarpaulin, steel, and the slots of the wheels.
    """
    kind = rng.turn(TRAILERS, "kind")
    half, floor = 0.5 * rng.between(2.0, 2.6, "length_m"), 0.52
    wide = 0.5 * rng.between(1.1, 1.3, "width_m")
    reach = half + 1.15
    parts: list[Patch] = []
    for side in (-1.0, 1.0):
        part = bar(
            (reach - 0.1, 0.0, floor - 0.06),
            (half - 0.4, side * 0.9 * wide, floor - 0.06),
            0.035,
            4,
            6,
        )
        parts.append(part)
        made = _paint_wheel(wheels.wheel(0.29, 0.16, "steel"))
        placed = made if side > 0 else made.rotated("z", math.pi)
        parts.append(placed.moved(-0.1, side * (wide + 0.12), 0.29))
        turn = np.linspace(0.15 * math.pi, 0.85 * math.pi, 6)
        arch = [
            (-0.1 + 0.36 * math.cos(t), side * (wide + 0.12), 0.3 + 0.36 * math.sin(t))
            for t in turn.tolist()
        ]
        parts.append(rod(arch, 0.07, 5, 1))
        y = side * (wide - 0.16)
        parts.append(block((-half - 0.02, y - 0.1, 0.42), (-half, y + 0.1, 0.52), 0.0, 4))
    parts.append(bar((-0.1, -wide - 0.1, 0.29), (-0.1, wide + 0.1, 0.29), 0.035, 6, 6))
    parts.append(rounded_box((0.2, 0.09, 0.09), 0.03, 1).moved(reach, 0.0, floor - 0.02).painted(6))
    parts.append(post(0.028, (0.06, floor), (reach - 0.35, 0.0, 0.0), 8).painted(6))
    parts.append(
        cone((0.07, -0.025), (0.07, 0.025), 10, 3)
        .rotated("x", 0.5 * math.pi)
        .moved(reach - 0.35, 0.0, 0.07)
    )
    parts.append(block((-half, -wide, floor - 0.05), (half, wide, floor), 0.0, 6))
    parts += _load(kind, half, wide, floor)
    parts.append(
        facing_rectangle(-half - 0.02, (-0.26, 0.26), (0.35, 0.46), 7)
        .rotated("z", math.pi)
        .moved(-2.0 * half - 0.04)
    )
    body_color = rng.choose(("#c9cccd", "#6a6e70", "#2f4f7a", "#7a2f2a", "#3f4a3f"))
    sheet = rng.choose(("#22406f", "#8d9091", "#2f5f3a", "#26282a", "#b0392c"))
    materials = (
        material_presets.painted_material(body_color, 0.4),
        material_presets.painted_material("#1a1b1c", 0.6),
        Material((0.5, 0.5, 0.51), roughness=0.35, metallic=0.9, role="rim"),
        Material((0.02, 0.02, 0.02), roughness=0.85, role="tyre"),
        Material((0.3, 0.008, 0.01), roughness=0.12, role="taillight"),
        material_presets.painted_material(sheet, 0.65),
        GALVANISED,
        material_presets.printed_material(f"texture/licence_plate?seed={rng.seed % 12}", 0.4),
        material_presets.patterned_material(
            "texture/wood_planks?seed=2", 1.2, 0.8, (0.55, 0.5, 0.45)
        ),
    )
    shells = [hulls.box((-half, -wide, 0.2), (half, wide, floor + 0.4))]
    return make_solid(on_ground(parts), materials, shells)


def _paint_wheel(made: Patch) -> Patch:
    """A vehicle's wheel in the slots of a trailer: tyre 3, else 2."""
    tyre = made.slots == 4
    return Patch(made.corners_m, made.uvs, np.where(tyre, 3, 2).astype(np.int64))


def _load(kind: str, half: float, wide: float, floor: float) -> list[Patch]:
    """Side boards, a tarpaulin over hoops, a closed box, or a boat on rollers."""
    if kind == "boat":
        keel = Rectangle(-half, 0.2 * half, -0.35 * wide, 0.35 * wide)
        deck = Rectangle(-half - 0.1, 0.5 * half, -0.95 * wide, 0.95 * wide)
        bow = Rectangle(0.2 * half, half + 0.7, -0.04, 0.04)
        parts = [hopper(keel, deck, (floor + 0.08, floor + 0.65), 0)]
        nose = hopper(Rectangle(0.1 * half, 0.4 * half, -0.3 * wide, 0.3 * wide),
                      Rectangle(0.45 * half, bow.x1, -0.5 * wide, 0.5 * wide),
                      (floor + 0.1, floor + 0.68), 0)  # fmt: skip
        cover = hopper(deck, Rectangle(-half, 0.3 * half, -0.4 * wide, 0.4 * wide),
                       (floor + 0.65, floor + 0.95), 5)  # fmt: skip
        return [*parts, nose, cover]
    side = 0.36
    walls = [
        block((-half, y - 0.02, floor), (half, y + 0.02, floor + side)) for y in (-wide, wide)
    ] + [block((x - 0.02, -wide, floor), (x + 0.02, wide, floor + side)) for x in (-half, half)]
    if kind == "box":
        low = Rectangle(-half - 0.03, half + 0.03, -wide - 0.03, wide + 0.03)
        top = Rectangle(-half, half, -wide, wide)
        ridge = Rectangle(-half, half, -0.25 * wide, 0.25 * wide)
        cover = hopper(low, top, (floor + side - 0.12, floor + 1.25), 5)
        return [*walls, cover, hopper(top, ridge, (floor + 1.25, floor + 1.38), 5)]
    if kind == "cargo":
        box = rounded_box((2 * half, 2 * wide, 1.5), 0.06, 1).moved(0.0, 0.0, floor + 0.75)
        return [box.painted(0)]
    bed = block((-half + 0.03, -wide + 0.03, floor), (half - 0.03, wide - 0.03, floor + 0.02), 0, 8)
    return [*walls, bed]
