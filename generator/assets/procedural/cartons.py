"""Folding boxes and milk cartons, printed on every side."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gen_data.generator.assets.procedural import collision_hulls as hulls
from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.material_presets import (
    CAPS,
    plastic_material,
    printed_material,
)
from gen_data.generator.assets.procedural.patches import (
    Patch,
    join_patches,
    make_centred_solid,
    rotate,
)
from gen_data.generator.assets.procedural.surface_shapes import (
    UvRect,
    fillet,
    grid,
    lathe,
    rounded_box,
)
from gen_data.generator.assets.procedural.variant_rng import in_turn, variant_rng
from gen_data.generator.core.se3 import Vec3

# Where each face of a carton lies in its image: four sides above, top and bottom below.
CARTON_ATLAS: Mapping[str, UvRect] = {
    "front": (0.002, 0.252, 0.338, 0.998),
    "left": (0.342, 0.252, 0.498, 0.998),
    "back": (0.502, 0.252, 0.838, 0.998),
    "right": (0.842, 0.252, 0.998, 0.998),
    "top": (0.002, 0.002, 0.498, 0.248),
    "bottom": (0.502, 0.002, 0.998, 0.248),
}
_CARTONS: tuple[tuple[float, float, float], ...] = (
    (0.065, 0.19, 0.28), (0.055, 0.17, 0.25), (0.07, 0.125, 0.075), (0.06, 0.09, 0.125),
    (0.035, 0.155, 0.21), (0.05, 0.1, 0.17), (0.04, 0.13, 0.18), (0.075, 0.15, 0.07))  # fmt: skip


def carton_size_m(seed: int) -> Vec3:
    """Depth (X), width (Y) and height of a carton; its front faces +X."""
    rng = variant_rng("carton/size", seed)
    x, y, z = (side * rng.between(0.92, 1.08) for side in in_turn(_CARTONS, seed))
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
    body = rounded_box(size, 0.0012, 1, uv=CARTON_ATLAS)
    half = tuple(0.5 * side for side in size)
    print_ = printed_material(f"texture/carton?seed={seed}", rng.between(0.35, 0.65))
    low, high = (-half[0], -half[1], -half[2]), (half[0], half[1], half[2])
    return make_centred_solid([body], (print_,), [hulls.box(low, high)])


def milk_carton(seed: int) -> Solid:
    """A gable-top carton with a screw cap; its front faces +X. Slots: print, cap."""
    rng = variant_rng("milk_carton", seed)
    x, y, z = milk_size_m(seed)
    body = rounded_box((x, y, z), 0.0015, 1, uv=CARTON_ATLAS).moved(z=z / 2)
    rise, fin = 0.33 * x, 0.016
    roof = _gable(x, y, rise, fin).moved(z=z)
    print_ = printed_material(f"texture/milk_label?seed={seed}", rng.between(0.35, 0.5))
    patches, parts = [body, roof], [hulls.box((-x / 2, -y / 2, 0.0), (x / 2, y / 2, z))]
    if rng.chance(0.7):
        tilt = math.atan2(rise, 0.5 * x)
        at = (0.27 * x, 0.0, z + 0.46 * rise)
        patches.append(_screw_cap().rotated("y", tilt).moved(*at))
        cap = hulls.frustum((0.013, -0.004), (0.013, 0.009), 12)
        parts.append(rotate(cap, "y", tilt) + np.array(at))
    ridge = z + rise
    prism = np.array(
        [(sx * 0.5 * x, sy * 0.5 * y, z) for sx in (-1, 1) for sy in (-1, 1)]
        + [(sx * 0.002, sy * 0.5 * y, ridge) for sx in (-1, 1) for sy in (-1, 1)]
    )
    fin_hull = hulls.box((-0.002, -y / 2, ridge), (0.002, y / 2, ridge + fin))
    parts += [prism, fin_hull]
    return make_centred_solid(patches, (print_, plastic_material(rng, CAPS)), parts)


def _screw_cap() -> Patch:
    """A flat cap about Z, its foot below z = 0; slot 1."""
    profile = [(0.0, -0.004), (0.013, -0.004), (0.013, 0.009), (0.0, 0.009)]
    return lathe(fillet(profile, [0.0, 0.0, 0.0015, 0.0], 2), 24, 1)


def _gable(x: float, y: float, rise: float, fin: float) -> Patch:
    """Roof of two slopes that meet in an upright fin along Y; the ends are tucked in."""
    top = CARTON_ATLAS["top"]
    u0, v0, u1, v1 = top
    t, tuck = 0.0012, 0.12 * y
    made = []
    for s in (1.0, -1.0):
        foot = [(s * x / 2, -s * y / 2, 0.0), (s * x / 2, s * y / 2, 0.0)]
        head = [(s * t, -s * y / 2, rise), (s * t, s * y / 2, rise)]
        tip = [(s * t, -s * y / 2, rise + fin), (s * t, s * y / 2, rise + fin)]
        made.append(
            grid(np.array([foot, head, tip]), np.array([u0, u1]), np.array([v0, 0.8 * v1, v1]))
        )
    crest = [
        [(t, -y / 2, rise + fin), (t, y / 2, rise + fin)],
        [(-t, -y / 2, rise + fin), (-t, y / 2, rise + fin)],
    ]
    made.append(grid(np.array(crest), np.array([u0, u0]), np.array([v0, v0])))
    for s in (1.0, -1.0):
        inner = (0.0, s * (y / 2 - tuck), 0.55 * rise)
        a, b = (-s * -x / 2, s * y / 2, 0.0), (-s * x / 2, s * y / 2, 0.0)
        c, d = (-s * t, s * y / 2, rise), (s * t, s * y / 2, rise)
        loop = [a, b, c, d]
        e, f = (-s * t, s * y / 2, rise + fin), (s * t, s * y / 2, rise + fin)
        corners = [(loop[i], loop[(i + 1) % 4], inner) for i in (0, 1, 3)]
        corners += [(c, d, inner), (d, c, e), (d, e, f)]
        n = len(corners)
        uvs = np.broadcast_to(np.array([u0 + 0.1, 0.5 * v1]), (n, 3, 2))
        made.append(Patch(np.array(corners), uvs.copy(), np.zeros(n, dtype=np.int64)))
    return join_patches(made)
