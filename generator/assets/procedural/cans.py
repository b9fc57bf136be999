"""Drink cans and food cans with an all-around print."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gen_data.generator.assets.procedural import collision_hulls as hulls
from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.material_presets import (
    ALUMINIUM,
    STEEL,
    metal_material,
    printed_material,
)
from gen_data.generator.assets.procedural.patches import Patch, make_centred_solid
from gen_data.generator.assets.procedural.surface_shapes import (
    Point2,
    circle,
    extrude,
    fillet,
    lathe,
)
from gen_data.generator.assets.procedural.variant_rng import in_turn, variant_rng


@dataclass(frozen=True, slots=True)
class CanSize:
    """Radius and height [m] of a common size; ``food`` cans have beaded ends."""

    radius_m: float
    height_m: float
    food: bool


CANS = (
    CanSize(0.0331, 0.1152, False),
    CanSize(0.0331, 0.1152, False),
    CanSize(0.0265, 0.1345, False),
    CanSize(0.0331, 0.168, False),
    CanSize(0.0365, 0.109, True),
    CanSize(0.0365, 0.109, True),
    CanSize(0.0495, 0.118, True),
    CanSize(0.0425, 0.036, True),
)


def can_size(seed: int) -> CanSize:
    """Size of a variant, from ``CANS``."""
    return in_turn(CANS, seed)


def label_aspect(seed: int) -> float:
    """Width by height of the unrolled print of a can."""
    size = can_size(seed)
    return 2 * math.pi * size.radius_m / (size.height_m * (0.9 if size.food else 0.8))


def can(seed: int) -> Solid:
    """A drink can or food can. Slots: print, metal, tab."""
    rng = variant_rng("can", seed)
    size = can_size(seed)
    r, h = size.radius_m, size.height_m
    texture = f"texture/can_label?seed={seed}"
    if size.food:
        print_ = printed_material(texture, rng.between(0.5, 0.7))
        patches, stages = _food_can(r, h)
        lid: list[Patch] = []
    else:
        print_ = printed_material(texture, rng.between(0.25, 0.38), 0.35)
        patches, stages = _drink_can(r, h)
        lid = _tab(0.68 * r)
        lid = [piece.moved(z=h - 0.0045) for piece in lid]
    materials = (
        print_,
        metal_material(STEEL if size.food else ALUMINIUM, rng.between(0.22, 0.35)),
        metal_material(ALUMINIUM, 0.3),
    )
    return make_centred_solid([*patches, *lid], materials, hulls.stack(stages))


def _drink_can(r: float, h: float) -> tuple[list[Patch], list[Point2]]:
    """Two-piece aluminium can: domed base, necked top, recessed lid."""
    neck, rim = r - 0.0062, r - 0.006
    z0, z1 = 0.1 * h, h - 0.024
    v1 = (z1 - z0) / (h - 0.004 - z0)
    bottom = fillet(
        [(0.0, 0.009), (0.55 * r, 0.006), (0.72 * r, 0.0), (0.76 * r, 0.0), (r, 0.012), (r, z0)],
        [0.0, 0.03, 0.001, 0.002, 0.012, 0.0],
        2,
    )
    side = [(r, z0), (r, z1)]
    top = fillet(
        [(r, z1), (r, h - 0.014), (neck, h - 0.0035), (neck, h - 0.002), (rim, h),
         (rim - 0.002, h), (rim - 0.0028, h - 0.005), (0.0, h - 0.005)],
        [0.0, 0.02, 0.004, 0.0, 0.0006, 0.0006, 0.0008, 0.0],
        2,
    )  # fmt: skip
    split = next(i for i, (_, z) in enumerate(top) if z > h - 0.0045)
    patches = [
        lathe(bottom, 32, 1),
        lathe(side, 32, 0, v=(0.0, v1)),
        lathe(top[: split + 1], 32, 0, v=(v1, 1.0)),
        lathe(top[split:], 32, 1),
    ]
    stages = [(0.76 * r, 0.0), (r, 0.012), (r, h - 0.015), (neck, h - 0.0035), (rim, h)]
    return patches, stages


def _food_can(r: float, h: float) -> tuple[list[Patch], list[Point2]]:
    """Three-piece steel can: seamed ends, paper label between."""
    seam = 0.0035
    end = [(0.0, 0.003), (0.8 * r, 0.003), (0.82 * r, 0.004), (0.9 * r, 0.004),
           (0.93 * r, 0.0), (r, 0.0), (r, seam), (r - 0.001, seam + 0.001)]  # fmt: skip
    z0, z1 = seam + 0.001, h - seam - 0.001
    wall = r - 0.001
    body = [(wall, z0), (wall, z1)]
    top = [(radius, h - z) for radius, z in end[::-1]]
    patches = [lathe(end, 36, 1), lathe(body, 36, 0, v=(0.0, 1.0)), lathe(top, 36, 1)]
    return patches, [(r, 0.0), (r, h)]


def _tab(length: float) -> list[Patch]:
    """Pull tab lying on the lid, its origin at the rivet."""
    ring_ = circle(1.0, 14) * np.array([0.5 * length, 0.3 * length])
    hole = circle(1.0, 10) * np.array([0.22 * length, 0.17 * length]) + np.array(
        [0.18 * length, 0.0]
    )
    plate = extrude(ring_, 0.0012, 0.0003, [hole], 2)
    rivet = lathe([(0.0, 0.0), (0.0035, 0.0), (0.0033, 0.002), (0.0, 0.0022)], 12, 2)
    return [plate.moved(x=0.18 * length), rivet.moved(x=-0.12 * length)]
