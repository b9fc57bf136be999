"""Packaging: drink and food cans, folding boxes and milk cartons."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gen_data.assets.family import Solid
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets, surface_shapes, vessels
from gen_data.content.procedural.patches import Patch, join_patches, make_centred_solid, rotate
from gen_data.content.procedural.wear import draw_wear, dulled
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

_SIZES = load_table(__package__, "package_sizes", tuple[tuple[float, ...], ...])


class CanSize(NamedTuple):
    """Radius and height [m] of a common size; ``food`` cans have beaded ends."""

    radius_m: float
    height_m: float
    food: bool


def can_size(seed: int) -> CanSize:
    """Size of a variant."""
    kind = ("drink", "food")[seed // 4 % 2]
    radius, height = in_turn(_SIZES[f"{kind}_cans"], seed % 4)
    return CanSize(radius, height, kind == "food")


def label_aspect(seed: int) -> float:
    """Width by height of the unrolled print of a can."""
    size = can_size(seed)
    return 2 * math.pi * size.radius_m / (size.height_m * (0.9 if size.food else 0.8))


def can(rng: VariantRng) -> Solid:
    """A drink can or food can. Slots: print, metal, tab."""
    size = can_size(rng.seed)
    r, h = size.radius_m, size.height_m
    texture, wear = f"texture/can_label?seed={rng.seed}", draw_wear("can_label", rng.seed)
    if size.food:
        print_ = material_presets.printed_material(texture, dulled(rng.between(0.5, 0.7), wear))
        patches, stages = _food_can(r, h)
        lid: list[Patch] = []
    else:
        print_ = material_presets.printed_material(
            texture, dulled(rng.between(0.25, 0.38), wear), 0.35
        )
        patches, stages = _drink_can(r, h)
        lid = [piece.moved(z=h - 0.0045) for piece in _tab(0.68 * r)]
    body = material_presets.metal_material(
        material_presets.STEEL if size.food else material_presets.ALUMINIUM, rng.between(0.22, 0.35)
    )
    # Three in ten cans are dented (assumed, 0.1 to 0.5).
    for _ in range(rng.choose((0, 0, 0, 0, 0, 0, 0, 1, 1, 3))):
        place = rng.between(-3.1, 3.1), h * rng.between(0.25, 0.75)
        depth, width = rng.between(0.001, 0.0028), rng.between(0.006, 0.016)
        patches = [_press(patch, place, depth, width) for patch in patches]
    materials = (print_, body, material_presets.metal_material(material_presets.ALUMINIUM, 0.3))
    return make_centred_solid([*patches, *lid], materials, hulls.stack(stages))


def _press(patch: Patch, place: surface_shapes.Point2, depth: float, width: float) -> Patch:
    """The patch with a dent at an angle about Z [rad] and a height [m]."""
    corners = patch.corners_m.copy()
    turn = np.arctan2(corners[..., 1], corners[..., 0]) - place[0]
    radius = np.sqrt(corners[..., 0] ** 2 + corners[..., 1] ** 2)
    along = radius * (np.mod(turn + math.pi, 2.0 * math.pi) - math.pi)
    away = np.sqrt(along**2 + (0.6 * (corners[..., 2] - place[1])) ** 2) / width
    push = depth * np.exp(-(away**2)) * (radius > 0.5 * radius.max())
    corners[..., :2] *= (1.0 - push / np.maximum(radius, 1e-6))[..., None]
    return replace(patch, corners_m=corners)


def _drink_can(r: float, h: float) -> tuple[list[Patch], list[surface_shapes.Point2]]:
    """Two-piece aluminium can: domed base, necked top, recessed lid."""
    neck, rim = r - 0.0062, r - 0.006
    z0, z1 = 0.1 * h, h - 0.024
    v1 = (z1 - z0) / (h - 0.004 - z0)
    dome = [(0.0, 0.009), (0.55 * r, 0.006), (0.72 * r, 0.0), (0.76 * r, 0.0), (r, 0.012), (r, z0)]
    taper = [(r, z1), (r, h - 0.014), (neck, h - 0.0035), (neck, h - 0.002), (rim, h)]
    lid = [(rim - 0.002, h), (rim - 0.0028, h - 0.005), (0.0, h - 0.005)]
    corners = [*taper, *lid]
    top = surface_shapes.fillet(corners, [0.0, 0.02, 0.004, 0.0, 0.0006, 0.0006, 0.0008, 0.0], 2)
    split = next(i for i, (_, z) in enumerate(top) if z > h - 0.0045)
    patches = [
        surface_shapes.lathe(
            surface_shapes.fillet(dome, [0.0, 0.03, 0.001, 0.002, 0.012, 0.0], 2), 40, 1
        ),
        surface_shapes.lathe(vessels.subdivide([(r, z0), (r, z1)], 0.006), 40, 0, v=(0.0, v1)),
        surface_shapes.lathe(top[: split + 1], 40, 0, v=(v1, 1.0)),
        surface_shapes.lathe(top[split:], 40, 1),
    ]
    stages = [(0.76 * r, 0.0), (r, 0.012), (r, h - 0.015), (neck, h - 0.0035), (rim, h)]
    return patches, stages


def _food_can(r: float, h: float) -> tuple[list[Patch], list[surface_shapes.Point2]]:
    """Three-piece steel can: seamed ends, paper label between."""
    seam = 0.0035
    end = [(0.0, 0.003), (0.8 * r, 0.003), (0.82 * r, 0.004), (0.9 * r, 0.004),
           (0.93 * r, 0.0), (r, 0.0), (r, seam), (r - 0.001, seam + 0.001)]  # fmt: skip
    wall = r - 0.001
    body = [(wall, seam + 0.001), (wall, h - seam - 0.001)]
    top = [(radius, h - z) for radius, z in end[::-1]]
    patches = [
        surface_shapes.lathe(end, 36, 1),
        surface_shapes.lathe(vessels.subdivide(body, 0.006), 36, 0, v=(0.0, 1.0)),
        surface_shapes.lathe(top, 36, 1),
    ]
    return patches, [(r, 0.0), (r, h)]


def _tab(length: float) -> list[Patch]:
    """Pull tab lying on the lid, its origin at the rivet."""
    ring_ = surface_shapes.circle(1.0, 14) * np.array([0.5 * length, 0.3 * length])
    hole = surface_shapes.circle(1.0, 10) * np.array([0.22 * length, 0.17 * length])
    hole = hole + np.array([0.18 * length, 0.0])
    plate = surface_shapes.extrude(ring_, 0.0012, 0.0003, [hole], 2)
    rivet = surface_shapes.lathe([(0.0, 0.0), (0.0035, 0.0), (0.0033, 0.002), (0.0, 0.0022)], 12, 2)
    return [plate.moved(x=0.18 * length), rivet.moved(x=-0.12 * length)]


CARTON_ATLAS = load_table(__package__, "carton_atlas", tuple[float, float, float, float])


def carton_size_m(seed: int) -> Vec3:
    """Depth (X), width (Y) and height of a carton; its front faces +X."""
    rng = variant_rng("carton/size", seed)
    x, y, z = (side * rng.between(0.92, 1.08) for side in in_turn(_SIZES["cartons"], seed))
    return (x, y, z)


def milk_size_m(seed: int) -> Vec3:
    """Depth, width and height of a milk carton without its gable."""
    rng = variant_rng("milk_carton/size", seed)
    side = rng.between(0.066, 0.075)
    return (side, side, side * rng.choose((1.4, 2.4, 2.7)))


def carton(seed: int) -> Solid:
    """A printed folding box; its front faces +X. Slot: print."""
    rng = variant_rng("carton", seed)
    size = carton_size_m(seed)
    body = surface_shapes.rounded_box(size, 0.0012, 1, uv=CARTON_ATLAS)
    x, y, z = (0.5 * side for side in size)
    rough = dulled(rng.between(0.35, 0.65), draw_wear("carton", seed))
    print_ = material_presets.printed_material(f"texture/carton?seed={seed}", rough)
    return make_centred_solid([body], (print_,), [hulls.box((-x, -y, -z), (x, y, z))])


def milk_carton(seed: int) -> Solid:
    """A gable-top carton with a screw cap; its front faces +X. Slots: print, cap."""
    rng = variant_rng("milk_carton", seed)
    x, y, z = milk_size_m(seed)
    body = surface_shapes.rounded_box((x, y, z), 0.0015, 1, uv=CARTON_ATLAS).moved(z=z / 2)
    rise, fin = 0.33 * x, 0.016
    roof = _gable(x, y, rise, fin).moved(z=z)
    rough = dulled(rng.between(0.35, 0.5), draw_wear("milk_label", seed))
    print_ = material_presets.printed_material(f"texture/milk_label?seed={seed}", rough)
    patches, parts = [body, roof], [hulls.box((-x / 2, -y / 2, 0.0), (x / 2, y / 2, z))]
    if rng.chance(0.7):
        tilt = math.atan2(rise, 0.5 * x)
        at = (0.27 * x, 0.0, z + 0.46 * rise)
        patches.append(_screw_cap().rotated("y", tilt).moved(*at))
        cap = hulls.frustum((0.013, -0.004), (0.013, 0.009), 12)
        parts.append(rotate(cap, "y", tilt) + np.array(at))
    ridge = z + rise
    prism = np.array(
        [(u, v, w) for a, w in ((0.5 * x, z), (0.002, ridge))
         for u in (-a, a) for v in (-0.5 * y, 0.5 * y)]
    )  # fmt: skip
    fin_hull = hulls.box((-0.002, -y / 2, ridge), (0.002, y / 2, ridge + fin))
    parts += [prism, fin_hull]
    return make_centred_solid(
        patches, (print_, material_presets.plastic_material(rng, material_presets.CAPS)), parts
    )


def _screw_cap() -> Patch:
    """A flat cap about Z, its foot below z = 0; slot 1."""
    profile = [(0.0, -0.004), (0.013, -0.004), (0.013, 0.009), (0.0, 0.009)]
    return surface_shapes.lathe(surface_shapes.fillet(profile, [0.0, 0.0, 0.0015, 0.0], 2), 24, 1)


def _gable(x: float, y: float, rise: float, fin: float) -> Patch:
    """Roof of two slopes that meet in an upright fin along Y; the ends are tucked in."""
    u0, v0, u1, v1 = CARTON_ATLAS["top"]
    t, tuck, top = 0.0012, 0.12 * y, rise + fin
    made = []
    for s in (1.0, -1.0):
        section = ((s * x / 2, 0.0), (s * t, rise), (s * t, top))
        rows = np.array([[(u, v, w) for v in (-s * y / 2, s * y / 2)] for u, w in section])
        made.append(surface_shapes.grid(rows, np.array([u0, u1]), np.array([v0, 0.8 * v1, v1])))
    crest = np.array([[(u, v, top) for v in (-y / 2, y / 2)] for u in (t, -t)])
    made.append(surface_shapes.grid(crest, np.array([u0, u0]), np.array([v0, v0])))
    for s in (1.0, -1.0):
        inner, end = (0.0, s * (y / 2 - tuck), 0.55 * rise), s * y / 2
        slopes = ((s * x / 2, 0.0), (-s * x / 2, 0.0), (-s * t, rise), (s * t, rise))
        a, b, c, d, e, f = ((u, end, w) for u, w in (*slopes, (-s * t, top), (s * t, top)))
        corners = [(a, b, inner), (b, c, inner), (d, a, inner), (c, d, inner), (d, c, e), (d, e, f)]
        uvs = np.broadcast_to(np.array([u0 + 0.1, 0.5 * v1]), (6, 3, 2))
        made.append(Patch(np.array(corners), uvs.copy(), np.zeros(6, dtype=np.int64)))
    return join_patches(made)
