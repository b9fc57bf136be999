"""Utility poles with their cables, and cabinets of networks at the street."""

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import (
    painted_material,
    patterned_material,
    printed_material,
)
from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import (
    block,
    circle,
    cone,
    lathe,
    rounded_box,
    sweep,
)
from gen_data.content.scenery import clutter_shapes, street_furniture
from gen_data.content.scenery.basic_shapes import facing_rectangle, make_solid, post
from gen_data.core import asset_types, se3
from gen_data.core.errors import AssetError
from gen_data.core.variant_rng import VariantRng, variant_rng

POLES = ("wood", "concrete", "wood_transformer", "wood_lamp", "concrete_double", "wood_double")
BOXES = ("telecom", "power", "kiosk", "meter", "parcel", "telecom_tall", "substation", "power")
SPAN_MAX_M = 80.0

_ARM_M, _BUNDLE_M = 8.4, 5.9
"""Heights of the power lines on their cross-arm and of the telephone cable."""
_CONDUCTORS = (-0.78, -0.36, 0.36, 0.78)
"""Places of the power lines across the street [m]."""
_SAG = 0.018
"""Sag as a share of the span: assumed, 0.01-0.03 at low voltage."""
_CONDUCTOR_RADIUS_M, _BUNDLE_RADIUS_M = 0.0055, 0.011
"""Aluminium of 70 mm^2; a telephone cable with its support wire (assumed, 30 %)."""


def utility_pole(seed: int, span_m: float) -> Solid:
    """A pole with cross-arm, insulators and the halves of the two spans that meet at it.

    Cables run along X, past the street on the left; they are level at mid-span, at the same places
    for every variant: poles ``span_m`` apart, as in rows without gaps, join. The body without
    cables has separate bounds. Slots: pole, insulators, steel, cables, lamp.

    Args:
        seed: Seed of the variant.
        span_m: Distance between poles, 0 = without cables.

    Raises:
        AssetError: if the span is not between 0 and 80 m.
    """
    if not 0.0 <= span_m <= SPAN_MAX_M:
        raise AssetError(f"utility_pole: span_m={span_m} is not between 0 and {SPAN_MAX_M:g}")
    rng = variant_rng("utility_pole", seed)
    kind = rng.turn(POLES, "kind")
    high = rng.between(8.9, 9.8, "height_m")
    foot = 0.15 if kind.startswith("concrete") else rng.between(0.12, 0.15, "foot_m")
    radii = (foot, 0.62 * foot)
    if kind.startswith("concrete"):
        pole = lathe([(0.0, 0.0), (radii[0], 0.0), (radii[1], high), (0.0, high)], 8)
        pole = pole.rotated("z", np.pi / 8)
    else:
        pole = cone((radii[0], 0.0), (radii[1], high), 12)
    parts = [pole, *_cross_arms(kind.endswith("double"), radii[1]), *_fittings(kind, radii[1], rng)]
    cables = _half_spans(span_m, radii[1]) if span_m else []
    body, cables = ([part.rotated("z", 0.5 * np.pi) for part in piece] for piece in (parts, cables))
    wood = patterned_material("texture/bark?seed=1", 1.0, 0.9, rng.choose(((0.17, 0.13, 0.1),
        (0.3, 0.25, 0.2))))  # fmt: skip
    stone = patterned_material("texture/concrete?seed=3", 2.0, 0.9, (0.8, 0.79, 0.76))
    materials = (
        stone if kind.startswith("concrete") else wood,
        painted_material(rng.choose(("#8b8f90", "#5a3d30", "#d8d8d2")), 0.3),
        street_furniture.GALVANISED,
        painted_material("#202122", 0.6),
        asset_types.Material((0.75, 0.76, 0.74), roughness=0.2, role="lamp"),
    )
    hull = hulls.frustum((radii[0], 0.0), (radii[1], high), 12)
    return make_solid([*body, *cables], materials, [hull], body=body)


def _cross_arms(double: bool, radius: float) -> list[Patch]:
    """Cross-arms with insulators and braces; a second one 0.6 m lower on some."""
    parts = []
    for z in (_ARM_M - 0.14, _ARM_M - 0.8)[: 2 if double else 1]:
        parts.append(block((-0.95, radius, z - 0.05), (0.95, radius + 0.09, z + 0.05), 0.0, 2))
        for side in (-1.0, 1.0):
            brace = ((0.0, radius + 0.02, z - 0.5), (0.5 * side, radius + 0.02, z - 0.05))
            parts.append(clutter_shapes.bar(*brace, 0.014, 4, 2))
        parts += [_insulator().moved(x, radius + 0.045, z + 0.05) for x in _CONDUCTORS]
    return parts


def _insulator() -> Patch:
    """A pin insulator, its groove 9 cm above its foot."""
    profile = [(0.0, 0.0), (0.015, 0.0), (0.015, 0.03), (0.045, 0.03), (0.05, 0.05), (0.028, 0.07),
               (0.04, 0.1), (0.02, 0.13), (0.0, 0.135)]  # fmt: skip
    return lathe(profile, 7, 1)


def _fittings(kind: str, radius: float, rng: VariantRng) -> list[Patch]:
    """A transformer, a lamp on an arm, a distribution box, step irons, by kind and chance."""
    parts = []
    if kind.endswith("transformer"):
        can = lathe([(0.0, 0.0), (0.26, 0.0), (0.28, 0.06), (0.28, 0.8), (0.24, 0.88), (0.0, 0.9)])
        parts.append(can.moved(0.36 + radius, 0.0, 6.5).painted(2))
        parts += [_insulator().scaled(1.2, 1.2, 1.8).moved(0.3 + x, 0.0, 7.4) for x in (0.0, 0.2)]
        parts += [block((0.0, -0.03, z), (0.2, 0.03, z + 0.05), 0.0, 2) for z in (6.7, 7.1)]
    if kind.endswith("lamp"):
        # No further out than the cross-arm: the middle of every variant is the same.
        arm = [(0.0, 0.0, 6.7), (0.2, 0.0, 7.0), (0.5, 0.0, 7.05)]
        parts.append(clutter_shapes.rod(arm, 0.025, 6, 2))
        parts.append(rounded_box((0.5, 0.24, 0.1), 0.03, 1).moved(0.69, 0.0, 7.05).painted(2))
        parts.append(block((0.48, -0.09, 6.985), (0.9, 0.09, 7.0), 0.0, 4))
    if rng.chance(0.6):
        z = rng.between(2.2, 3.2)
        parts.append(block((radius, -0.14, z), (radius + 0.16, 0.14, z + 0.4), 0.01, 2))
        duct = ((0.13, 0.05, 0.0), (0.13, 0.05, z))
        parts.append(clutter_shapes.bar(*duct, 0.02, 5, 2))
    parts.append(block((0.02, -0.1, 1.7), (0.155, 0.1, 1.85), 0.0, 1))
    # The clamp of the telephone cable.
    parts.append(post(0.03, (_BUNDLE_M - 0.08, _BUNDLE_M + 0.05), (radius + 0.04, 0.0, 0.0), 6))
    return [*parts[:-1], parts[-1].painted(2)]


def _half_spans(span_m: float, radius: float) -> list[Patch]:
    """Cables along Y from the pole to the middle of the span on both sides, as parabolas."""
    grips: list[tuple[se3.Vec3, float, float]] = [
        ((x, radius + 0.045, _ARM_M), _CONDUCTOR_RADIUS_M, x) for x in _CONDUCTORS
    ]
    grips.append(((radius + 0.04, 0.0, _BUNDLE_M), _BUNDLE_RADIUS_M, 0.12))
    t = np.linspace(0.0, 1.0, 9)
    parts = []
    for (x, y, z), thick, middle_x in grips:
        for side in (-1.0, 1.0):
            # Of the whole parabola, the vertex lies at t = 1.
            fall = _SAG * span_m * (1.0 - (1.0 - t) ** 2)
            along = y + (side * 0.5 * span_m - y) * t
            path = np.stack([x + (middle_x - x) * t, along, z - fall], axis=1)
            section = circle(thick, 3)
            parts.append(sweep(path, section, up=(1.0, 0.0, 0.0), capped=False, slot=3))
    return parts


def power_box(rng: VariantRng) -> Solid:
    """A cabinet of a network: telephone, power, gas meter, parcels, small substation.

    Faces +X. Slots: body, seams, plinth, sticker, roof. Sizes: assumed from makers' catalogues.
    """
    kind = rng.turn(BOXES, "kind")
    w, d, h = {
        "telecom": (0.75, 0.31, 1.05), "power": (0.79, 0.32, 1.1), "kiosk": (1.25, 0.45, 1.4),
        "meter": (0.45, 0.2, 0.95), "parcel": (1.5, 0.6, 1.95), "telecom_tall": (0.8, 0.5, 1.65),
        "substation": (2.2, 1.6, 1.75),
    }[kind]  # fmt: skip
    w, h = w * rng.between(0.92, 1.08), h * rng.between(0.95, 1.05)
    x, y, foot = 0.5 * d, 0.5 * w, rng.between(0.06, 0.16, "foot_m")
    parts = [
        block((-x, -y, foot), (x, y, h - 0.04), 0.012),
        block((-x + 0.02, -y + 0.02, 0.0), (x - 0.02, y - 0.02, foot + 0.01), 0.0, 2),
        _roof(kind, x, y, h),
    ]
    doors = {"kiosk": 2, "substation": 3, "parcel": 3, "meter": 1}.get(kind, rng.choose((1, 2)))
    parts += _doors(doors, (x, y, foot, h), rows=6 if kind == "parcel" else 1)
    if kind not in {"parcel", "meter"} and rng.chance(0.7):
        width = rng.between(0.14, 0.24)
        at, z = rng.between(-0.5, 0.5) * (w - width - 0.1), rng.between(0.45, 0.7) * h
        face = facing_rectangle(x + 0.003, (at - width / 2, at + width / 2), (z, z + 1.41 * width))
        parts.append(face.painted(3))
    colors = ("#8d9091", "#a5a79f", "#5e6f62", "#b0aea6", "#c9c5b6", "#6f7f6a")
    paint = (
        rng.choose(("#e0b21c", "#d9352b", "#274b8f")) if kind == "parcel" else rng.choose(colors)
    )
    materials = (
        painted_material(paint, 0.55),
        painted_material("#2f3132", 0.6),
        patterned_material("texture/concrete?seed=3", 1.5, 0.9),
        printed_material(f"texture/poster?seed={rng.seed % 12}", 0.4),
        painted_material(rng.choose(("#55585a", "#8d9091", "#3f4a42")), 0.6),
    )
    return make_solid(parts, materials, [hulls.box((-x, -y, 0.0), (x, y, h))])


def _roof(kind: str, x: float, y: float, h: float) -> Patch:
    """A flat lid, or a ridged roof on a substation."""
    if kind != "substation":
        return block((-x - 0.02, -y - 0.02, h - 0.05), (x + 0.025, y + 0.02, h), 0.01, 4)
    outline = np.array([(-x - 0.1, h - 0.06), (x + 0.1, h - 0.06), (x + 0.1, h), (0.0, h + 0.25),
                        (-x - 0.1, h)])  # fmt: skip
    path = np.array([(0.0, y + 0.1, 0.0), (0.0, -y - 0.1, 0.0)])
    # The section's first axis is X, its second -Y x X = Z.
    return sweep(path, outline, up=(1.0, 0.0, 0.0), slot=4)


def _doors(count: int, size: tuple[float, float, float, float], rows: int) -> list[Patch]:
    """Seams, louvres and handles on the front; slot 1."""
    x, y, foot, h = size
    low, high, front = foot + 0.05, h - 0.1, x + 0.002
    edges = np.linspace(-y + 0.03, y - 0.03, count + 1)
    parts = [facing_rectangle(front, (e - 0.004, e + 0.004), (low, high), 1) for e in edges]
    across = (-y + 0.03, y - 0.03)
    for z in np.linspace(low, high, rows + 1):
        parts.append(facing_rectangle(front, across, (float(z) - 0.005, float(z) + 0.005), 1))
    if rows > 1:
        return parts
    for edge in edges[:-1]:
        for k in range(4):
            z = high - 0.09 - 0.03 * k
            parts.append(
                facing_rectangle(front, (float(edge) + 0.1, float(edge) + 0.26), (z, z + 0.012), 1)
            )
        at = float(edge) + 0.05
        mid = 0.5 * (low + high)
        parts.append(block((x, at, mid), (x + 0.025, at + 0.03, mid + 0.14), 0.0, 1))
    return parts
