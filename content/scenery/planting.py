"""Hedges, shrubs, tall grass, flower beds and ivy: leaves of their true size on cards.

Pieces run along Y and face a street with +X, as fences do; their origin is on the ground.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import hex_to_linear, patterned_material
from gen_data.content.procedural.patches import Array, Indices, Patch, finish_mesh, join_patches
from gen_data.content.procedural.surface_shapes import ball, block
from gen_data.content.scenery import foliage, leaf_cards
from gen_data.core.asset_types import ConvexParts, Material, MeshData
from gen_data.core.noise import uniform
from gen_data.core.variant_rng import VariantRng, in_turn

_GREENS = (
    ("small", "#4f6a34", "#5d783d", "#6d8849"),
    ("ovate", "#5f7540", "#6f854b", "#809658"),
    ("scale", "#45603a", "#526d42", "#617c4e"),
    ("small", "#5b5a38", "#6b6a42", "#7d7a4e"),
    ("round", "#56743a", "#668545", "#789652"),
    ("ovate", "#5a3a3c", "#6b4646", "#7c5450"),
)
"""Kind of leaf and colours from depth to surface: privet, beech, yew or thuja, hornbeam in autumn
leaf, hazel, copper beech."""
_PETALS = ("#d8505c", "#e8d4ea", "#ecc04a", "#b060b4", "#f2efe8", "#e07a3c", "#7a6cc8")
_STRAW = ("#8f9a58", "#a39c62", "#7d8f4c", "#b3a672", "#6f8546")
_SOFTNESS = 0.6
_Ball = tuple[float, float, float, float]
"""Centre and radius [m]."""


def hedge(rng: VariantRng) -> Solid:
    """A hedge of 2, 3 or 4 m that joins others end to end: clipped, or wild every third time."""
    long = float(in_turn((2.0, 3.0, 4.0), rng.seed // 3))
    if hedge_facts(rng.seed).subcategory == "wild_hedge":
        return _wild_hedge(long, rng)
    wide, high = rng.between(0.45, 0.9, "width_m"), rng.between(0.8, 2.0, "height_m")
    core = block(
        (-0.5 * wide + 0.05, -0.5 * long, 0.0), (0.5 * wide - 0.05, 0.5 * long, high - 0.05)
    )
    size = rng.between(0.26, 0.36, "leaf_m")
    area = 2.0 * long * high + wide * (long + 2.0 * high)
    count = min(1400, round(4.5 * area / size**2))
    at, outward = _box_skin((wide, long, high), count, rng)
    sizes = size * (0.75 + 0.5 * uniform(count, rng))
    cards = leaf_cards.cards_about(at - 0.25 * sizes[:, None] * outward, outward, sizes,
                        _shades(count, rng), 0.3, rng)  # fmt: skip
    return _planted([core.painted(0)], cards, in_turn(_GREENS, int(rng.between(0, 5.99))), rng)


def hedge_facts(seed: int) -> Facts:
    """Whether it is clipped."""
    return Facts("wild_hedge" if seed % 3 == 2 else "hedge")


def shrub(rng: VariantRng) -> Solid:
    """A shrub, 0.5-3 m high, upright, round or spreading; every third one flowers."""
    wide, high = in_turn(((0.8, 1.0), (1.1, 0.8), (0.6, 1.4), (1.4, 0.7), (0.9, 1.2)), rng.seed)
    scale = rng.between(0.6, 1.7, "scale")
    radius, height = 0.6 * wide * scale, 1.1 * high * scale
    lobes = [(0.0, 0.0, 0.55 * height, 0.72 * radius), (0.0, 0.0, 0.4 * radius, 0.6 * radius)]
    for k in range(6):
        turn = 2.0 * math.pi * (k + rng.between(-0.3, 0.3)) / 6
        away, z = rng.between(0.35, 0.6) * radius, rng.between(0.3, 0.7) * height
        lobes.append(
            (away * math.cos(turn), away * math.sin(turn), z, rng.between(0.4, 0.6) * radius)
        )
    flowers = rng.choose(_PETALS) if rng.seed % 3 == 0 else ""
    return _lobed(lobes, height, rng.seed % 6, flowers, rng)


def grass_tuft(rng: VariantRng) -> Solid:
    """Tall grass and weeds, 0.12-0.7 m high, in a patch along a kerb or a joint."""
    high = in_turn((0.14, 0.28, 0.45, 0.62), rng.seed)
    long, wide = rng.between(0.15, 1.4, "length_m"), rng.between(0.05, 0.22, "width_m")
    count = max(18, round(rng.between(26, 40) * max(long, 0.5)))
    x, y = ((uniform(count, rng) - 0.5) * side for side in (wide, long))
    foot = np.stack([x, y, np.zeros(count)], axis=1)
    turn = 2.0 * math.pi * uniform(count, rng)
    lean = 0.5 * (uniform((count, 2), rng) - 0.5)
    along = np.concatenate([lean, np.ones((count, 1))], axis=1)
    along /= np.sqrt((along**2).sum(axis=1, keepdims=True))
    across = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    across -= (across * along).sum(axis=1, keepdims=True) * along
    across /= np.sqrt((across**2).sum(axis=1, keepdims=True))
    length = high * (0.6 + 0.5 * uniform(count, rng))
    up = np.tile([0.0, 0.0, 1.0], (count, 1))
    cards = leaf_cards.Cards(foot, along, across, up, length, 0.9 * np.maximum(length, 0.2),
                  _shades(count, rng))  # fmt: skip
    level = rng.between(1.0, 1.4)
    colors = rng.shuffled(_STRAW)[:3]
    shades = [leaf_cards.leaf_material("blades", code, level) for code in colors]
    if rng.seed % 4 == 1:
        # Dandelions and the like.
        shades[2] = leaf_cards.leaf_material("blossom", rng.choose(_PETALS[2:5]), 1.0)
    # Upright cards are seen from both sides: their normals are mostly their own.
    mesh = leaf_cards.drop_unused_slots(leaf_cards.card_mesh(cards, shades, 0.25, rng))
    hull = hulls.box((-0.5 * wide, -0.5 * long, 0.0), (0.5 * wide, 0.5 * long, 0.5 * high))
    return Solid(mesh, ConvexParts((np.round(hull, 6),)))


def flower_bed(rng: VariantRng) -> Solid:
    """A bed of 1.2-3 m with an edging of stone or steel, leaves and flowers in drifts."""
    wide = rng.between(0.6, 1.2, "width_m")
    long = rng.between(1.2, 3.0, "length_m")
    rim = rng.between(0.05, 0.2, "rim_m")
    x, y = 0.5 * wide, 0.5 * long
    soil = block((-x, -y, 0.0), (x, y, max(0.03, rim - 0.03))).painted(1)
    sides = [((-x - 0.06, -y - 0.06), (-x, y + 0.06)), ((x, -y - 0.06), (x + 0.06, y + 0.06)),
             ((-x, -y - 0.06), (x, -y)), ((-x, y), (x, y + 0.06))]  # fmt: skip
    edging = [block((*low, 0.0), (*high, rim), slot=2) for low, high in sides]
    count = round(150 * wide * long)
    across, along = ((uniform(count, rng) - 0.5) * 0.95 * side for side in (wide, long))
    at = np.stack([across, along, rim + rng.between(0.06, 0.25) * uniform(count, rng)], axis=1)
    size = 0.17 + 0.1 * uniform(count, rng)
    # Drifts: flowers of one colour stand together.
    drift = np.sin(3.1 * at[:, 1] + 6.0 * uniform(1, rng)) + 0.6 * (uniform(count, rng) - 0.5)
    bloom = uniform(count, rng) < 0.45
    slots = np.where(bloom, np.where(drift > 0.0, 3, 4), (uniform(count, rng) * 3).astype(np.int64))
    at[:, 2] += 0.1 * bloom
    outward = foliage.directions(count, rng) * 0.5 + np.array([0.0, 0.0, 0.9])
    cards = leaf_cards.cards_about(at, outward, size, slots, 0.5, rng)
    petals = [leaf_cards.leaf_material("blossom", code, 1.0) for code in rng.shuffled(_PETALS)[:2]]
    stone = rng.choose((
        patterned_material("texture/concrete?seed=3", 1.5, 0.9),
        patterned_material("texture/brick?seed=4", 1.1, 0.92, (0.9, 0.88, 0.86)),
        Material((0.16, 0.08, 0.05), 0.8, role="trim"),
    ))  # fmt: skip
    kind, *codes = _GREENS[int(rng.between(0, 1.99))]
    earth = Material(hex_to_linear("#4a3d32"), 0.95, specular=0.2)
    mesh = finish_mesh(join_patches([soil, *edging]), (earth, earth, stone), 40.0)
    leafy = leaf_cards.card_mesh(cards, (*_leaves(kind, codes, rng), *petals), _SOFTNESS, rng)
    return _boxed(foliage.merge_meshes(mesh, leafy))


def ivy_wall(rng: VariantRng) -> Solid:
    """Ivy on a wall at x = 0 that faces +X: a ragged patch 1.5-4 m wide and 2-6 m high."""
    wide, high = rng.between(1.5, 4.0, "width_m"), rng.between(2.0, 6.0, "height_m")
    lanes = 6
    tops = high * (0.35 + 0.65 * uniform(lanes, rng))
    tops[int(rng.between(1, lanes - 1))] = high
    count = min(900, round(7.0 * wide * high / 0.36))
    y = (uniform(count, rng) - 0.5) * wide
    top = np.interp(y, np.linspace(-0.5 * wide, 0.5 * wide, lanes), tops)
    z = top * uniform(count, rng) ** 0.8
    # Thick below and near the middle, a single layer of leaves at its edges.
    bulge = 0.03 + 0.16 * (1.0 - z / top) * uniform(count, rng)
    at = np.stack([bulge, y, np.maximum(z, 0.2)], axis=1)
    outward = np.array([1.0, 0.0, 0.25]) + 0.25 * foliage.directions(count, rng)
    size = 0.5 + 0.25 * uniform(count, rng)
    cards = leaf_cards.cards_about(at, outward, size, _shades(count, rng), 0.6, rng)
    flat = replace(cards, along=_towards_wall(cards.along), across=_towards_wall(cards.across))
    codes = rng.choose((("#3f5a30", "#4c693a", "#5d7a46"), ("#7a3a30", "#92473a", "#a55a44")))
    mesh = leaf_cards.drop_unused_slots(
        leaf_cards.card_mesh(flat, _leaves("ivy", codes, rng), 0.5, rng)
    )
    x = np.clip(mesh.vertices_m[:, 0], -0.02, 0.4).astype(np.float32)
    mesh = replace(mesh, vertices_m=np.column_stack([x, mesh.vertices_m[:, 1:]]))
    return _boxed(mesh)


def _towards_wall(vectors: Array) -> Array:
    """Directions that lie nearly in the wall's plane."""
    bent = vectors * np.array([0.35, 1.0, 1.0])
    flat: Array = bent / np.sqrt((bent**2).sum(axis=1, keepdims=True))
    return flat


def _wild_hedge(long: float, rng: VariantRng) -> Solid:
    """Shrubs in a row that nobody clips."""
    high = rng.between(1.2, 2.8, "height_m")
    spots = round(long / 0.8)
    lobes = []
    for k in range(2 * spots):
        y = ((k + 0.5) / (2 * spots) - 0.5) * long
        r = rng.between(0.42, 0.6)
        z = max(r, (0.35 if k % 2 else 0.72) * high * rng.between(0.8, 1.1))
        lobes.append((rng.between(-0.12, 0.12), y, z, r))
    return _lobed(lobes, high, int(rng.between(0, 4.99)), "", rng)


def _lobed(
    lobes: Sequence[_Ball], height: float, green: int, flowers: str, rng: VariantRng
) -> Solid:
    """A plant that fills balls (x, y, z, radius), with opaque cores inside them."""
    inner = [(x, y, z, 0.72 * r) for x, y, z, r in lobes]
    cores = [ball(lambda d: d, 5, 7).scaled(k, k, k).moved(x, y, z) for x, y, z, k in inner]
    size = min(0.42, 0.16 + 0.16 * height)
    parts = []
    for x, y, z, r in lobes:
        count = min(150, round(2.2 * 4.0 * math.pi * r * r / (0.5 * size * size)))
        outward = foliage.directions(count, rng)
        at = np.array([x, y, z]) + r * (0.72 + 0.28 * uniform((count, 1), rng)) * outward
        at[:, 2] = np.maximum(at[:, 2], 0.25 * size)
        sizes = size * (0.75 + 0.5 * uniform(count, rng))
        slots = _shades(count, rng)
        if flowers:
            slots = np.where(uniform(count, rng) < 0.3, 3, slots)
        parts.append(leaf_cards.cards_about(at, outward, sizes, slots, 0.35, rng))
    low = [replace(core, corners_m=np.maximum(core.corners_m, [-9.0, -9.0, 0.0])) for core in cores]
    return _planted(low, leaf_cards.join_cards(parts), _GREENS[green], rng, flowers)


def _planted(
    cores: Sequence[Patch],
    cards: leaf_cards.Cards,
    green: Sequence[str],
    rng: VariantRng,
    flowers: str = "",
) -> Solid:
    """Leaves over opaque cores of the same green; flowers take slot 3."""
    kind, *codes = green
    dark = patterned_material("texture/foliage?seed=0", 0.8, 0.9, hex_to_linear(codes[-1]))
    core = finish_mesh(join_patches(cores), (replace(dark, specular=0.2, role="leaf"),), 60.0)
    shades = _leaves(kind, codes, rng)
    if flowers:
        shades = (*shades, leaf_cards.leaf_material("blossom", flowers, 1.0))
    return _boxed(foliage.merge_meshes(core, leaf_cards.card_mesh(cards, shades, _SOFTNESS, rng)))


def _leaves(kind: str, codes: Sequence[str], rng: VariantRng) -> tuple[Material, ...]:
    level, warm = rng.between(0.95, 1.3), rng.between(0.9, 1.12)
    return leaf_cards.crown_shades(kind, codes, level, warm)


def _shades(count: int, rng: VariantRng) -> Indices:
    return (uniform(count, rng) * 3.0).astype(np.int64)


def _boxed(mesh: MeshData) -> Solid:
    """The mesh without unused slots, and a box around its lower nine tenths."""
    (x0, y0, z0), (x1, y1, z1) = mesh.bounds_m()
    hull = hulls.box((0.85 * x0, y0, z0), (0.85 * x1, y1, 0.9 * z1))
    return Solid(leaf_cards.drop_unused_slots(mesh), ConvexParts((np.round(hull, 6),)))


def _box_skin(size: tuple[float, float, float], count: int, rng: VariantRng) -> tuple[Array, Array]:
    """Points on the sides and the top of a box on the ground by area, and outward directions."""
    x, y, z = size
    areas = np.array([x * y, y * z, y * z, 0.4 * x * z, 0.4 * x * z])
    ends = np.cumsum(areas) / areas.sum()
    face = np.minimum(np.searchsorted(ends, uniform(count, rng), side="right"), 4)
    normals = np.array([(0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)], dtype=np.float64)
    outward = normals[face]
    inner = np.stack([(uniform(count, rng) - 0.5) * x, (uniform(count, rng) - 0.5) * y,
                      uniform(count, rng) * z], axis=1)  # fmt: skip
    rim = outward * np.array([0.5 * x, 0.5 * y, z])
    at = np.where(outward != 0.0, rim, inner)
    return at, outward
