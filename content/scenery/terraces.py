"""Paved parts of gardens: terraces and decks with a table and chairs, slab paths, stairs.

Pieces run along Y, paths to doors along X; their origin is on the ground.
"""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import patterned_material
from gen_data.content.procedural.patches import finish_mesh, join_patches
from gen_data.content.procedural.surface_shapes import block
from gen_data.content.scenery import cafe, foliage
from gen_data.core.asset_types import ConvexParts, Material
from gen_data.core.variant_rng import VariantRng, variant_rng

_KINDS = ("terrace", "path", "deck", "path")
_PATH_M, _SLAB_M = (0.5, 60.0), 0.06
_JOINT_M = 0.06
"""Grass between the slabs of a path."""

_TREAD_M, _BEHIND_M = 0.29, 0.05
STONES = ((0.36, 0.35, 0.33), (0.27, 0.26, 0.26), (0.42, 0.38, 0.32), (0.33, 0.25, 0.21))
"""Concrete, granite, sandstone, brick of stairs and ramps; linear RGB, assumed."""


def terrace(rng: VariantRng) -> Solid:
    """A terrace or deck of 3 to 5 m with a table and chairs, or a path of 5 to 10 m.

    Slots: pavement, then the slots of the chairs.
    """
    kind = rng.turn(_KINDS, "kind")
    if kind == "path":
        wide = rng.between(0.6, 1.1, "width_m")
        long = rng.between(5.0, 10.0, "length_m")
        high = 0.03
        pieces = 12
    else:
        wide, long, pieces = rng.between(2.8, 4.0, "width_m"), rng.between(3.2, 5.0, "length_m"), 1
        high = rng.between(0.12, 0.2, "height_m") if kind == "deck" else 0.05
    x, edges = 0.5 * wide, np.linspace(-0.5 * long, 0.5 * long, pieces + 1)
    joint = _JOINT_M if pieces > 1 else 0.0
    slabs = [
        block((-x, float(start), 0.0), (x, float(end) - joint, high))
        for start, end in pairwise(edges)
    ]
    mesh = finish_mesh(join_patches(slabs), (_pavement(kind, rng),), 40.0)
    if kind != "path":
        chairs = cafe.cafe_set(int(rng.random() * 18)).mesh
        raised = chairs.vertices_m + np.array([0.0, 0.0, high], chairs.vertices_m.dtype)
        mesh = foliage.merge_meshes(mesh, replace(chairs, vertices_m=raised))
    hull = hulls.box((-x, -0.5 * long, 0.0), (x, 0.5 * long, high))
    return Solid(mesh, ConvexParts((np.round(hull, 6),)))


def garden_path(seed: int, length_m: float) -> Solid:
    """A path from a street to a door, 1 to 1.6 m wide.

    It consists of slabs with grass between them, or of one piece between edging stones. Slots:
    pavement.

    Raises:
        ValueError: the length is not from 0.5 to 60 m.
    """
    if not _PATH_M[0] <= length_m <= _PATH_M[1]:
        raise ValueError(f"length_m is {length_m:g}; expected a number from 0.5 to 60")
    rng = variant_rng("garden_path", seed)
    half, is_slabs = 0.5 * rng.between(1.0, 1.6, "width_m"), _is_slabs(seed)
    pieces = max(1, round(length_m / 0.7)) if is_slabs else 1
    joint = _JOINT_M if is_slabs else 0.0
    edges = np.linspace(-0.5 * length_m, 0.5 * length_m, pieces + 1)
    slabs = [
        block((float(start), -half, 0.0), (float(end) - joint, half, _SLAB_M))
        for start, end in pairwise(edges)
    ]
    x = 0.5 * length_m
    if not is_slabs:
        # Rows of edging stones, a little higher than the surface between them.
        slabs += [
            block((-x, side * half - 0.04, 0.0), (x, side * half + 0.04, _SLAB_M + 0.015))
            for side in (-1.0, 1.0)
        ]
    mesh = finish_mesh(join_patches(slabs), (_pavement("path", rng),), 40.0)
    return Solid(mesh, ConvexParts((np.round(hulls.box((-x, -half, 0.0), (x, half, _SLAB_M)), 6),)))


def door_stairs(seed: int, rise_m: float, width_m: float, landing_m: float) -> Solid:
    """Stairs from a landing before a door down to the ground, along +X; the door is at x = 0.

    The landing begins 5 cm behind the wall.

    Risers are at most 18 cm high, treads 29 cm deep (DIN 18065: 14 to 21 cm, 21 to 37 cm).

    Args:
        seed: Seed of the stone, which cycles through a few kinds.
        rise_m: Height of the landing.
        width_m: Width of landing and steps.
        landing_m: Depth of the landing before the wall; the usual one reaches beyond the steps that
            some houses have themselves.

    Raises:
        ValueError: the height is not from 0.05 to 5 m, the width not from 0.5 to 10 m, or the depth
            not from 0.5 to 5 m.
    """
    if not (0.05 <= rise_m <= 5.0 and 0.5 <= width_m <= 10.0 and 0.5 <= landing_m <= 5.0):
        raise ValueError(
            f"rise_m is {rise_m:g}, width_m {width_m:g}, landing_m {landing_m:g}; expected 0.05 to "
            "5, 0.5 to 10 and 0.5 to 5"
        )
    count, half = max(1, math.ceil(rise_m / 0.18)), 0.5 * width_m
    tops = rise_m * np.arange(count, 0, -1) / count
    ends = landing_m + _TREAD_M * np.arange(count)
    starts = [-_BEHIND_M, *ends[:-1]]
    boxes = [
        ((float(start), -half, 0.0), (float(end), half, float(top)))
        for start, end, top in zip(starts, ends, tops, strict=True)
    ]
    # Without a texture, which further views of a scene would have to fetch.
    stone = Material(STONES[seed % len(STONES)], 0.9)
    mesh = finish_mesh(join_patches([block(*box) for box in boxes]), (stone,), 40.0)
    parts = tuple(np.round(hulls.box(*box), 6) for box in boxes)
    return Solid(mesh, ConvexParts(parts))


def garden_path_facts(seed: int, **_: object) -> Facts:
    """Whether it consists of slabs or of one piece."""
    return Facts("slabs" if _is_slabs(seed) else "paved")


def _is_slabs(seed: int) -> bool:
    return seed % 3 == 0


def terrace_facts(seed: int) -> Facts:
    """Whether it is a terrace, a deck or a path."""
    return Facts(variant_rng("terrace", seed).turn(_KINDS, "kind"))


def _pavement(kind: str, rng: VariantRng) -> Material:
    if kind == "deck":
        wood = rng.choose(((0.75, 0.66, 0.58), (0.9, 0.85, 0.8), (0.6, 0.5, 0.42)))
        texture = f"texture/wood_planks?seed={rng.choose((0, 1, 2))}"
        return patterned_material(texture, 1.2, 0.8, wood)
    return rng.choose((
        patterned_material("texture/paving?seed=1", 1.6, 0.9),
        patterned_material("texture/paving?seed=2", 1.6, 0.9),
        patterned_material("texture/concrete?seed=3", 1.5, 0.9),
        patterned_material("texture/brick?seed=9", 1.0, 0.9),
    ))  # fmt: skip
