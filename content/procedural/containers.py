"""Open containers for piles: crates of slats, and round bowls."""

import math

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.furniture import check_size
from gen_data.content.procedural.material_presets import (
    PLASTICS,
    ceramic_material,
    painted_material,
    patterned_material,
)
from gen_data.content.procedural.patches import make_solid_in_place
from gen_data.core.asset_types import Material, Symmetry
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import in_turn, variant_rng

_WALL_M = 0.012
_FOOT_M = 0.008


def crate(size_m: Vec3 = (0.5, 0.34, 0.2), seed: int = 0) -> Solid:
    """An open crate of slats, as for fruit. Slot: body.

    Args:
        size_m: Outer length, width, height.
        seed: Of its wood, or of its plastic.
    """
    x, y, z = check_size("open_crate", size_m, 0.06)
    rows = max(2, round(z / 0.075))
    boxes = [((-x / 2, -y / 2, 0.0), (x / 2, y / 2, _WALL_M))]
    for k in range(rows):
        low, high = k * z / rows + (0.0 if k else _WALL_M), (k + 1) * z / rows - 0.012
        for side in (-1, 1):
            a, b = sorted((side * x / 2, side * (x / 2 - _WALL_M)))
            boxes.append(((a, -y / 2, low), (b, y / 2, high)))
            a, b = sorted((side * y / 2, side * (y / 2 - _WALL_M)))
            boxes.append(((-x / 2 + _WALL_M, a, low), (x / 2 - _WALL_M, b, high)))
    w = 0.03
    for sx in (-1, 1):
        for sy in (-1, 1):
            px, py = sx * (x / 2 - _WALL_M - w / 2), sy * (y / 2 - _WALL_M - w / 2)
            boxes.append(((px - w / 2, py - w / 2, _WALL_M), (px + w / 2, py + w / 2, z - 0.012)))
    patches = [shapes.map_along_grain(shapes.block(*b, 0.0015), 0.5) for b in boxes]
    return make_solid_in_place(patches, (_crate_look(seed),), [hulls.box(*b) for b in boxes])


def _crate_look(seed: int) -> Material:
    rng = variant_rng("open_crate", seed)
    if in_turn((True, True, False), seed):
        return patterned_material(f"texture/wood_grain?seed={seed % 18}", 0.0, 0.75)
    return painted_material(rng.choose(PLASTICS), 0.45)


def crate_interior_m(size_m: Vec3) -> Vec3:
    """Length and width of its floor between the walls, and its height above the ground."""
    return (size_m[0] - 2 * _WALL_M, size_m[1] - 2 * _WALL_M, _WALL_M)


def bowl(size_m: Vec3 = (0.28, 0.28, 0.09), seed: int = 0) -> Solid:
    """A round bowl, as for fruit. Slot: body.

    Args:
        size_m: Diameter, twice, and height.
        seed: Of its wood, or of its glaze.
    """
    x, y, z = check_size("serving_bowl", size_m, 0.04)
    r, t = 0.5 * min(x, y), 0.006
    # A quarter of an ellipse from the foot to the rim.
    turns = [k * math.pi / 16 for k in range(9)]
    outer = [(r * (0.45 + 0.55 * math.sin(a)), z * (1.0 - math.cos(a))) for a in turns]
    inner = [(radius - t, max(high + 0.3 * t, _FOOT_M)) for radius, high in outer[::-1]]
    profile = [(0.0, 0.0), *outer, (r - 0.5 * t, z + 0.003), *inner, (0.0, _FOOT_M)]
    rings = [
        part
        for (ra, za), (rb, zb) in zip(outer[0:-1:2], outer[2::2], strict=True)
        for part in hulls.ring((ra - t, ra, za), (rb - t, rb, zb), 14)
    ]
    floor = hulls.frustum((outer[0][0], 0.0), (outer[0][0], _FOOT_M))
    return make_solid_in_place([shapes.lathe(profile, 56)], (_bowl_look(seed),), [floor, *rings])


def _bowl_look(seed: int) -> Material:
    rng = variant_rng("serving_bowl", seed)
    if in_turn((False, True, False), seed):
        return patterned_material(f"texture/wood_grain?seed={seed % 18}", 0.0, 0.4)
    return ceramic_material(rng)


def bowl_interior_m(size_m: Vec3) -> Vec3:
    """Sides of the square in its mouth's circle, and the height of its floor."""
    side = math.sqrt(0.5) * min(size_m[:2])
    return (side, side, _FOOT_M)


def bowl_symmetries(size_m: Vec3 = (0.28, 0.28, 0.09), seed: int = 0) -> tuple[Symmetry, ...]:
    """Any turn about its axis, unless the grain of wood shows it."""
    if _bowl_look(seed).texture:
        return ()
    return (Symmetry((0.0, 0.0, 1.0), 0, (0.0, 0.0, 0.5 * size_m[2])),)
