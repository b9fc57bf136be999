"""Bushes and planters: a dense dark core under a skin of leaves."""

import math
from dataclasses import replace

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import hex_to_linear, patterned_material
from gen_data.content.procedural.patches import Array, Patch, finish_mesh, join_patches
from gen_data.content.procedural.surface_shapes import ball, block
from gen_data.content.scenery import foliage, leaf_cards, trees
from gen_data.core.asset_types import ConvexParts, Material
from gen_data.core.variant_rng import VariantRng

_GREENS = (
    ("#26331d", "#344527", "#455833", "#586c42"),
    ("#2c3a1f", "#3d4f2b", "#516737", "#687f49"),
    ("#2a3324", "#3b4632", "#4e5a42", "#636f54"),
)
_FLOWERS = ("#b33a4a", "#d8c7d9", "#d9b23a", "#9a4f9c", "#e6e2dc")


def bush(rng: VariantRng) -> Solid:
    """A free-growing shrub, 0.7-1.8 m high. Slots: core, then shades of leaf."""
    h = rng.between(0.7, 1.8, "height_m")
    lobes = []
    for k in range(5):
        turn = 2.0 * math.pi * (k + rng.between(-0.3, 0.3)) / 5
        r = rng.between(0.24, 0.36) * h
        away = rng.between(0.2, 0.34) * h if k else 0.0
        z = max(r, rng.between(0.35, 0.62) * h)
        lobes.append((away * math.cos(turn), away * math.sin(turn), z, r))
    core = join_patches([_round(x, y, z, 0.82 * r) for x, y, z, r in lobes])
    anchors = np.concatenate([_shell(x, y, z, r, 90, rng) for x, y, z, r in lobes])
    hull = hulls.frustum((0.45 * h, 0.0), (0.4 * h, 0.9 * h), 12)
    length = 0.12 + 0.03 * h
    return _leafy(core, anchors, 0.3 * h, foliage.Habit(2400, length, 0.6 * length), hull, rng)


def planter(rng: VariantRng) -> Solid:
    """A tub or trough with a plant, flowering in some. Slots: tub, soil and core, leaves."""
    w = rng.between(0.45, 0.6, "width_m")
    long = rng.between(0.6, 1.4, "length_m")
    h = rng.between(0.4, 0.6, "height_m")
    x, y = 0.5 * w + 0.03, 0.5 * long + 0.03
    tub = [
        block((-0.5 * w, -0.5 * long, 0.0), (0.5 * w, 0.5 * long, h - 0.05), 0.012),
        block((-x, -y, h - 0.05), (x, y, h), 0.01),
    ]
    spots = max(2, round(long / 0.35))
    heads = [
        (0.0, (k + 0.5) * long / spots - 0.5 * long, h + 0.08, rng.between(0.18, 0.26))
        for k in range(spots)
    ]
    core = join_patches([*(_round(*head[:3], 0.8 * head[3]).painted(1) for head in heads), *tub])
    anchors = np.concatenate([_shell(*head, 60, rng) for head in heads])
    anchors = anchors[anchors[:, 2] > h]
    hull = hulls.box((-0.5 * w, -0.5 * long, 0.0), (0.5 * w, 0.5 * long, h))
    stuff = (
        patterned_material("texture/concrete?seed=3", 1.5, 0.9, (0.8, 0.78, 0.75)),
        patterned_material("texture/wood_grain?seed=5", 1.2, 0.8, (0.5, 0.42, 0.36)),
    )
    greens = _shades(rng)
    if rng.chance(0.6):
        blossom = Material(hex_to_linear(rng.choose(_FLOWERS)), roughness=0.8, role="leaf")
        greens = (*greens[:3], leaf_cards.transmitting(blossom, leaf_cards.PETAL))
    mesh = finish_mesh(core, (rng.choose(stuff), _core_material(greens)), 50.0)
    sprays = foliage.sprays_about(
        anchors, np.array([0.0, 0.0, h - 0.2]), foliage.Habit(620, 0.095, 0.07), rng
    )
    leaves = foliage.leaf_mesh(sprays, greens, 0.7, rng)
    return Solid(foliage.merge_meshes(mesh, leaves), ConvexParts((np.round(hull, 6),)))


def _leafy(
    core: Patch, anchors: Array, middle_z: float, habit: foliage.Habit, hull: Array, rng: VariantRng
) -> Solid:
    greens = _shades(rng)
    mesh = finish_mesh(core, (_core_material(greens),), 70.0)
    sprays = foliage.sprays_about(anchors, np.array([0.0, 0.0, middle_z]), habit, rng)
    leaves = foliage.leaf_mesh(sprays, greens, 0.7, rng)
    return Solid(foliage.merge_meshes(mesh, leaves), ConvexParts((np.round(hull, 6),)))


def _shades(rng: VariantRng) -> tuple[Material, ...]:
    return trees.leaf_greens(rng.choose(_GREENS), rng)


def _core_material(greens: tuple[Material, ...]) -> Material:
    """Material that shows between the leaves: the same green, darker."""
    r, g, b = greens[1].base_color
    color = (1.1 * r, 1.1 * g, 1.1 * b)
    plain = patterned_material("texture/foliage?seed=0", 0.8, 0.9, color)
    return replace(plain, specular=0.2, role="leaf")


def _shell(x: float, y: float, z: float, r: float, count: int, rng: VariantRng) -> Array:
    points: Array = np.array([x, y, z]) + r * foliage.directions(count, rng)
    points[:, 2] = np.maximum(points[:, 2], 0.05)
    return points


def _round(x: float, y: float, z: float, r: float) -> Patch:
    return ball(lambda d: r * d + np.array([x, y, z]), 7, 10)
