"""Trees: trunk and branches that grow into a crown, leaves in clusters at the twigs' ends."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gen_data.generator.assets.procedural import collision_hulls as hulls
from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.assets.procedural.family import Facts, Solid, check_option
from gen_data.generator.assets.procedural.material_presets import (
    hex_to_linear,
    jitter_color,
    patterned_material,
)
from gen_data.generator.assets.procedural.noise import uniform
from gen_data.generator.assets.procedural.patches import Array, Patch, finish_mesh, unit
from gen_data.generator.assets.procedural.surface_shapes import circle, sweep
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.assets.scenery.branching import (
    Lobe,
    Skeleton,
    grow_skeleton,
    points_in,
    wood,
)
from gen_data.generator.assets.scenery.foliage import (
    Habit,
    Sprays,
    leaf_mesh,
    merge_meshes,
    sprays_about,
)
from gen_data.generator.core.asset_types import ConvexParts, Material, MeshData
from gen_data.generator.core.errors import AssetError

_LEAVES = 4200
"""Triangles of foliage on a tree in full leaf."""
_TWIGS = 2400
_OPTICAL_DEPTH = 2.3
"""Layers of leaves that a line of sight meets on its way through a crown."""
_LEAF_WIDTH = 0.62
_ATTRACTORS = 900
_STEP = 0.12
"""Length of an internode, of the widest lobe's radius."""


@dataclass(frozen=True, slots=True)
class Species:
    """A row of ``species.yaml``: how trees of a kind vary, as (low, high).

    Attributes:
        overlap_m: How far the crown reaches below its lowest branches.
        width: Radius of the crown, as a share of its height (of half of it for one lobe).
        greens: Alternatives for ``Shape.green``.
        boughs: Number of lobes around a body, whose middle lies ``middle`` of the crown below
            the top; 0 = none.
        stacked: (height, width) of lobes above one another, as shares of the crown's.
    """

    height_m: tuple[float, float]
    clear_m: tuple[float, float]
    overlap_m: float
    width: tuple[float, float]
    trunk_m: tuple[float, float]
    greens: tuple[tuple[str, ...], ...]
    bark: str
    droop: float = 0.15
    boughs: int = 0
    middle: float = 0.5
    stacked: tuple[tuple[float, float], ...] = ()


_SPECIES = load_table(__package__, "species", Species)
SPECIES = (*_SPECIES, "conifer")


@dataclass(frozen=True, slots=True)
class Shape:
    """Measures and colours of one tree.

    Attributes:
        height_m: Overall.
        clear_m: From the ground to the lowest branches.
        trunk_m: Radius of the trunk at its foot.
        lobes: Ellipsoids that the crown fills.
        green: sRGB of the leaves, from the crown's depth to its surface.
        bark: sRGB of the bark.
    """

    height_m: float
    clear_m: float
    trunk_m: float
    lobes: tuple[Lobe, ...]
    green: tuple[str, ...]
    bark: str
    droop: float


def tree(seed: int, species: str, leaves: float) -> Solid:
    """A tree; its trunk stands on the origin. Slots: bark, then four shades of leaf.

    Args:
        seed: Variant.
        species: One of ``SPECIES``.
        leaves: Share of the leaves that it wears, 0 in winter to 1 in summer.

    Raises:
        AssetError: for an unknown species or a share outside of [0, 1].
    """
    check_option("tree", "species", species, SPECIES)
    if not 0.0 <= leaves <= 1.0:
        raise AssetError(f"tree: leaves={leaves} is not a share between 0 and 1")
    rng = variant_rng(f"tree/{species}", seed)
    if species == "conifer":
        return _conifer(rng)
    return _broadleaf(_draw_shape(_SPECIES[species], rng), leaves, rng)


def tree_facts(seed: int, species: str, leaves: float) -> Facts:  # noqa: ARG001
    """Species, and whether it is bare."""
    return Facts(species, {"foliage": "bare" if leaves < 0.05 else "leafy"})


def _broadleaf(shape: Shape, leaves: float, rng: VariantRng) -> Solid:
    trunk = _trunk(shape, rng)
    points = points_in(shape.lobes, _ATTRACTORS, rng)
    step_m = min(max(0.1, _STEP * max(lobe.axes_m[0] for lobe in shape.lobes)), 0.35)
    skeleton = grow_skeleton(trunk, points, step_m, shape.trunk_m)
    bark = _bark(shape.bark)
    # Thin twigs hide behind leaves; without leaves they are the crown.
    thinnest = 0.0 if leaves < 0.05 else 0.2 * shape.trunk_m
    mesh = finish_mesh(_flare_roots(wood(skeleton, thinnest, 2)), (bark,), 60.0)
    hull = hulls.frustum((shape.trunk_m, 0.0), (0.7 * shape.trunk_m, shape.clear_m), 10)
    count = round(_LEAVES * leaves)
    if count:
        greens = leaf_greens(shape.green, rng)
        sprays = _crown(shape, skeleton, count, len(greens), rng)
        mesh = merge_meshes(mesh, leaf_mesh(sprays, greens, _LEAF_WIDTH, rng))
    else:
        mesh = merge_meshes(mesh, _bare_twigs(shape, skeleton, bark, rng))
    return Solid(mesh, ConvexParts((np.round(hull, 6),)))


def _crown(shape: Shape, skeleton: Skeleton, count: int, shades: int, rng: VariantRng) -> Sprays:
    """Leaves at the twigs' ends, as large as it takes to fill the crown."""
    outer = np.array([lobe.centre_m for lobe in shape.lobes]).mean(axis=0)
    radius = math.sqrt(math.prod(max(lobe.axes_m[i] for lobe in shape.lobes) for i in (0, 2)))
    width = max(abs(lobe.centre_m[0]) + lobe.axes_m[0] for lobe in shape.lobes)
    area = math.pi * max(radius, 0.7 * width) ** 2
    # Half of a leaf's area faces a line of sight, on average.
    each = 2.0 * _OPTICAL_DEPTH * area / _LEAVES
    length = math.sqrt(2.0 * each / _LEAF_WIDTH)
    middle = outer - np.array([0.0, 0.0, 0.25 * radius])
    habit = Habit(count, length, 1.6 * length, shades, shape.droop)
    return sprays_about(skeleton.twigs(), middle, habit, rng)


def _bare_twigs(shape: Shape, skeleton: Skeleton, bark: Material, rng: VariantRng) -> MeshData:
    """The finest twigs of a winter crown, each a thin sliver."""
    middle = np.array([0.0, 0.0, shape.clear_m])
    length = 0.1 * (shape.height_m - shape.clear_m)
    habit = Habit(_TWIGS, length, 0.1 * length, 1, -0.3)
    sprays = sprays_about(skeleton.twigs(), middle, habit, rng)
    return leaf_mesh(sprays, (bark,), 0.03, rng)


def _trunk(shape: Shape, rng: VariantRng) -> Array:
    """Centre line from the ground to the first branches, gently bent."""
    count = max(4, round(shape.clear_m / 0.4))
    t = np.linspace(0.0, 1.0, count)
    sway = 0.05 * shape.clear_m
    x = sway * (uniform(1, rng) - 0.5) * np.sin(2.4 * t) * t
    y = sway * (uniform(1, rng) - 0.5) * np.sin(2.9 * t) * t
    return np.stack([np.round(axis, 4) for axis in (x, y, t * shape.clear_m)], axis=1)


def _flare_roots(patch: Patch) -> Patch:
    """Wood with a root flare: wider by half at the ground, on which it stands level."""
    z = patch.corners_m[..., 2]
    factor = 1.0 + 0.45 * np.clip(1.0 - z / 0.5, 0.0, 1.0) ** 2
    x, y = factor * patch.corners_m[..., 0], factor * patch.corners_m[..., 1]
    return replace(patch, corners_m=np.stack([x, y, np.where(z < 0.05, 0.0, z)], axis=2))


def _conifer(rng: VariantRng) -> Solid:
    """A spruce: whorls of drooping branches along a straight trunk, evergreen."""
    height, base_m = rng.between(6.0, 12.0), rng.between(0.1, 0.17)
    clear, spread = rng.between(0.2, 0.9), rng.between(0.17, 0.24) * height
    line = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 0.6 * height), (0.0, 0.0, height)])
    trunk = sweep(line, circle(base_m, 8), up=(1.0, 0.0, 0.0), scale=np.array([1.0, 0.5, 0.08]))
    whorls = 20
    fans: list[tuple[Array, Array, Array]] = []
    for level in range(whorls):
        share = (level + 0.2 * uniform(1, rng)[0]) / whorls
        z = clear + (height - clear) * share**0.9
        reach = spread * (1.0 - share) ** 0.85 + 0.12
        for k in range(9):
            turn = 2.0 * math.pi * (k + 0.5 * (level % 2) + 0.5 * rng.between(-0.5, 0.5)) / 9
            fans.append(_fan(z, turn, reach * rng.between(0.75, 1.1), 0.5 - share, rng))
    places, growth, reach_m = (np.concatenate(part) for part in zip(*fans, strict=True))
    # The lowest sprays rest on the ground.
    growth[:, 2] = np.maximum(growth[:, 2], (0.03 - places[:, 2]) / reach_m)
    axis = places * np.array([1.0, 1.0, 0.0])
    outward = unit(axis) * 0.85 + np.array([0, 0, 0.53])
    depth = np.sqrt((axis**2).sum(axis=1)) / (spread * np.clip(1 - places[:, 2] / height, 0.1, 1.0))
    slots = np.clip(np.floor(depth * 3.2 + uniform(len(depth), rng) - 0.5), 0, 3).astype(np.int64)
    sprays = Sprays(places, outward, growth, reach_m, slots)
    greens = leaf_greens(("#1f2b1c", "#2a3a25", "#35472d", "#425537"), rng)
    wooden = finish_mesh(trunk, (_bark("#6a5a4c"),), 60.0)
    mesh = merge_meshes(wooden, leaf_mesh(sprays, greens, 0.42, rng))
    hull = hulls.frustum((base_m, 0.0), (0.6 * base_m, 0.5 * height), 10)
    return Solid(mesh, ConvexParts((np.round(hull, 6),)))


def _fan(
    z: float, turn: float, reach: float, sag: float, rng: VariantRng
) -> tuple[Array, Array, Array]:
    """Sprays of needles along one branch: feet, directions and lengths."""
    count = 24
    t = np.sqrt(np.arange(1, count + 1) / count)
    out = np.array([math.cos(turn), math.sin(turn), 0.0])
    side = np.array([-math.sin(turn), math.cos(turn), 0.0])
    dip = np.maximum(-0.28 * (0.6 + sag) * reach * t**1.5, 0.15 - z)
    wing = np.where(np.arange(count) % 2 == 0, 1.0, -1.0) * (0.3 + 0.7 * uniform(count, rng))
    spread = (0.26 * reach * t * (1.15 - t))[:, None] * (wing[:, None] * side)
    at = (reach * t)[:, None] * out + spread + np.stack([0 * t, 0 * t, z + dip], axis=1)
    fall = np.array([0.0, 0.0, -0.45]) * (0.4 + uniform((count, 1), rng))
    growth = unit(out + 0.9 * wing[:, None] * side + fall)
    return at, growth, (0.22 + 0.2 * reach) * (0.7 + 0.5 * uniform(count, rng))


def _bark(code: str) -> Material:
    bark = patterned_material("texture/bark?seed=0", 0.8, 0.95, hex_to_linear(code))
    return replace(bark, role="bark")


def leaf_greens(codes: tuple[str, ...], rng: VariantRng) -> tuple[Material, ...]:
    """Shades of leaf that vary together from tree to tree."""
    r, g, b = jitter_color((1.0, 1.0, 1.0), 0.0, rng)
    warm, level = rng.between(0.85, 1.18), rng.between(0.85, 1.15)
    colors = (
        (level * warm * c[0] * r, level * c[1] * g, level * c[2] * b)
        for c in map(hex_to_linear, codes)
    )
    return tuple(Material(c, roughness=0.75, specular=0.35, role="leaf") for c in colors)


def _draw_shape(species: Species, rng: VariantRng) -> Shape:
    height, clear = rng.between(*species.height_m), rng.between(*species.clear_m)
    crown = height - clear + species.overlap_m
    wide = rng.between(*species.width) if species.width[0] < species.width[1] else species.width[0]
    if species.boughs:
        centre_z = height - species.middle * crown
        lobes = _draw_boughs(crown * wide, crown, centre_z, species.boughs, rng)
    elif species.stacked:
        r = crown * wide
        lobes = tuple(
            Lobe((0.0, 0.0, clear + crown * z), (w * r, w * r, 0.24 * crown))
            for z, w in species.stacked
        )
    else:
        r = 0.5 * crown
        lobes = (Lobe((0.0, 0.0, height - r), (wide * r, wide * r, r)),)
    green = rng.choose(species.greens) if len(species.greens) > 1 else species.greens[0]
    trunk = rng.between(*species.trunk_m)
    return Shape(height, clear, trunk, lobes, green, species.bark, species.droop)


def _draw_boughs(
    radius: float, height: float, centre_z: float, count: int, rng: VariantRng
) -> tuple[Lobe, ...]:
    """A crown of one body and several overlapping boughs around it."""
    lobes = [Lobe((0.0, 0.0, centre_z), (0.72 * radius, 0.72 * radius, 0.42 * height))]
    for k in range(count):
        turn = 2.0 * math.pi * (k + rng.between(-0.3, 0.3)) / count
        away, r = rng.between(0.42, 0.6) * radius, rng.between(0.4, 0.55) * radius
        z = centre_z + rng.between(-0.24, 0.26) * height
        lobes.append(Lobe((away * math.cos(turn), away * math.sin(turn), z), (r, r, 0.8 * r)))
    return tuple(lobes)
