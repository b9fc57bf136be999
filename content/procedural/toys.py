"""Toy blocks, balls and candles."""

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets as presets
from gen_data.content.procedural.patches import make_centred_solid, make_solid_in_place
from gen_data.content.procedural.surface_shapes import ball as sphere
from gen_data.content.procedural.surface_shapes import fillet, lathe, rounded_box
from gen_data.core.asset_types import Material, Symmetry
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

_SHAPES = ((0.04, 0.04, 0.04), (0.03, 0.06, 0.03), (0.03, 0.09, 0.03), (0.05, 0.05, 0.025),
           (0.06, 0.06, 0.03), (0.025, 0.075, 0.015))  # fmt: skip


def block(seed: int) -> Solid:
    """A wooden or plastic building block. Slot: body."""
    rng = variant_rng("block", seed)
    x, y, z = (side * rng.between(0.95, 1.05) for side in in_turn(_SHAPES, seed))
    if rng.chance(0.25):
        paint = Material(presets.draw_linear(presets.WOODS, 0.08, rng), 0.6)
    else:
        paint = presets.plastic_material(rng, presets.PLASTICS[:8])
    body = rounded_box((x, y, z), 0.0025, 2)
    hull = hulls.box((-x / 2, -y / 2, -z / 2), (x / 2, y / 2, z / 2))
    return make_centred_solid([body], (paint,), [hull])


def ball(rng: VariantRng) -> Solid:
    """A tennis, rubber, beach, basket or foot ball; the small ones are toys. Slot: cover."""
    kind = ball_kind(rng.seed)
    small, large = rng.between(0.02, 0.035), rng.between(0.05, 0.09)
    radius = {"tennis": 0.0334, "rubber": small}.get(kind, large)
    rough = {"tennis": 0.9, "basket": 0.65}.get(kind, rng.between(0.3, 0.5))
    body = sphere(lambda d: radius * d, 22, 36)
    cover = presets.printed_material(f"texture/ball_cover?seed={rng.seed}", rough)
    # A single small hull has flat sides that a ball would rest on; four rotated ones roll.
    parts = [hulls.extreme(body.corners_m, turn_rad=turn) for turn in (0.0, 0.5, 1.1, 1.7)]
    return make_centred_solid([body], (cover,), parts)


def plain_sphere(diameter_m: float = 0.2) -> Solid:
    """A smooth matte sphere to show surfaces and lights on. Slot: surface.

    Raises:
        ValueError: if it is not between 1 mm and 10 m wide.
    """
    if not 0.001 <= diameter_m <= 10.0:
        raise ValueError(f"a sphere of {diameter_m:g} m; expected 0.001 m to 10 m")
    radius = 0.5 * diameter_m
    body = sphere(lambda d: radius * d, 48, 96).moved(0.0, 0.0, radius)
    surface = Material((0.5, 0.5, 0.5), 0.5)
    return make_solid_in_place([body], (surface,), [hulls.extreme(body.corners_m)])


def plain_sphere_symmetries(diameter_m: float = 0.2) -> tuple[Symmetry, ...]:
    """Any turn about two axes through its centre, and so about every axis."""
    centre_m = (0.0, 0.0, 0.5 * diameter_m)
    return tuple(Symmetry(axis, 0, centre_m) for axis in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))


def ball_kind(seed: int) -> str:
    """Kind of a ball, by the sport it is for."""
    return ("tennis", "rubber", "beach", "basket", "foot")[seed % 5]


def candle(rng: VariantRng) -> Solid:
    """A pillar candle with a wick. Slots: wax, wick."""
    radius, height = rng.between(0.022, 0.04, "radius_m"), rng.between(0.05, 0.15, "height_m")
    rim = [(radius, height), (0.75 * radius, height - 0.003), (0.0, height - 0.006)]
    wax = fillet([(0.0, 0.0), (radius, 0.0), *rim], [0.0, 0.002, 0.003, 0.004, 0.0], 3)
    thread = ((0.0, -0.008), (0.001, -0.008), (0.001, 0.007), (0.0, 0.0075))
    wick = lathe([(r, height + z) for r, z in thread], 8, 1)
    colors = ("#f1e8d2", "#e9dcc0", "#a83a34", "#3f5a4a", "#d9a441", "#7d8fa3", "#c58b8b")
    material = Material(presets.draw_linear(colors, 0.05, rng), rng.between(0.4, 0.6))
    soot = Material((0.02, 0.02, 0.02), 0.9)
    tip = hulls.frustum((0.001, height), (0.001, height + 0.0075), 6)
    parts = [hulls.frustum((radius, 0.0), (radius, height)), tip]
    return make_centred_solid([lathe(wax, 32), wick], (material, soot), parts)
