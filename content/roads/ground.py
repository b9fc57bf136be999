"""The land around: a wide plane with low relief, finer in its middle than at its edges."""

import numpy as np

from gen_data.assets.family import Solid, check_option
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.patches import make_solid_in_place
from gen_data.content.roads import deck, road_materials
from gen_data.core.variant_rng import variant_rng

_CELLS = 56


def ground(
    *,
    seed: int = 0,
    size_m: tuple[float, float] = (800.0, 800.0),
    cover: str = "grass",
    relief_m: float = 0.04,
) -> Solid:
    """A plane around the origin whose highest points are at z = 0.

    Args:
        seed: Seed of relief and texture.
        size_m: Extent along X and Y.
        cover: A word of ``GROUNDS``.
        relief_m: Depth of the hollows.

    Raises:
        AssetError: the cover is unknown.
    """
    check_option("ground", "cover", cover, road_materials.GROUNDS)
    even = np.linspace(-1.0, 1.0, _CELLS + 1)
    graded = even * (0.25 + 0.75 * even * even)
    x, y = np.meshgrid(0.5 * size_m[0] * graded, 0.5 * size_m[1] * graded, indexing="ij")
    drawn = variant_rng("ground", seed).random((_CELLS + 1, _CELLS + 1))
    soft = 0.25 * sum(np.roll(drawn, shift, axis) for axis in (0, 1) for shift in (0, 1))
    z = -relief_m * (1.0 - np.clip(soft, 0.0, 1.0))
    plan = np.stack([x, y], axis=2)
    patch = deck.surface(np.stack([x, y, z], axis=2), plan, "ground", 0)
    low, high = (-0.5 * size_m[0], -0.5 * size_m[1]), (0.5 * size_m[0], 0.5 * size_m[1])
    slab = hulls.box((*low, -relief_m - 0.5), (*high, 0.0))
    return make_solid_in_place([patch], (road_materials.ground_material(cover, seed),), [slab])
