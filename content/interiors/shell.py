"""Shells of rooms: floors, ceilings, walls with openings, doors, windows, the view outside."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.interiors.parts import Box, rod, solid
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.furniture import check_size, rectangle
from gen_data.content.procedural.material_presets import (
    STAINLESS,
    metal_material,
    painted_material,
    patterned_material,
)
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.core.asset_types import Keypoint, Material
from gen_data.core.se3 import Vec3

OPENINGS_MAX = 3
"""Openings of one wall."""
NO_OPENINGS = (0.0,) * (4 * OPENINGS_MAX)
NO_SPLASHBACK = (0.0, 0.0, 0.0, 0.0)
SKIRTING_M = (0.07, 0.012)
"""Height and thickness of skirting boards."""
_FRAME_M = 0.06
_TILE_M = 0.008
"""Thickness of tiles with their bed: less than the gap behind furniture."""


SILL_REACH_M, SILL_BESIDE_M = 0.05, 0.04
"""Protrusion of window sills from the wall, and past the sides of the opening [m]."""


def floor(size_m: tuple[float, float] = (4.0, 4.0)) -> Solid:
    """A floor, its upper side at z = 0. Slot: floor. Raises AssetError if a size is not usable."""
    x, y, _ = check_size("floor", (*size_m, 1.0), 0.2)
    face = rectangle((-x / 2, -y / 2, 0.0), (x, 0.0, 0.0), (0.0, y, 0.0))
    slab = (-x / 2, -y / 2, -0.2), (x / 2, y / 2, 0.0)
    return solid([face], [patterned_material("texture/wood_planks?seed=0", 1.6, 0.45)], [slab])


def ceiling(size_m: tuple[float, float] = (4.0, 4.0)) -> Solid:
    """A ceiling, its lower side at z = 0. Slot: ceiling.

    Raises:
        AssetError: if a size is not usable.
    """
    x, y, _ = check_size("ceiling", (*size_m, 1.0), 0.2)
    face = rectangle((-x / 2, y / 2, 0.0), (x, 0.0, 0.0), (0.0, -y, 0.0))
    # A second side keeps the sun out for renderers that cull back faces.
    slab = (-x / 2, -y / 2, 0.0), (x / 2, y / 2, 0.2)
    patches = [face, shapes.block(*slab).moved(z=0.001)]
    return solid(patches, [painted_material("#f4f3ef", 0.9)], [slab])


def wall(
    size_m: Vec3 = (4.0, 2.6, 0.12),
    openings: tuple[float, ...] = NO_OPENINGS,
    splashback: tuple[float, ...] = NO_SPLASHBACK,
) -> Solid:
    """A wall along X whose inner side, at y = 0, faces +Y. Slots: wall, skirting, splashback.

    Args:
        size_m: Length, height, thickness.
        openings: Per opening the place of its middle along X, its width, and its lower and upper
            edge; width 0 = none.
        splashback: Ends along X and lower and upper edge of a covering; without extent = none.

    Raises:
        AssetError: if a size is not usable.
    """
    length, height, thick = check_size("wall", size_m, 0.01)
    holes = sorted(
        (x - 0.5 * w, x + 0.5 * w, low, high)
        for x, w, low, high in zip(*(openings[k::4] for k in range(4)), strict=True)
        if w > 0.0
    )
    boxes = []
    edges = [-0.5 * length, *(x for hole in holes for x in hole[:2]), 0.5 * length]
    for k, (a, b) in enumerate(pairwise(edges)):
        if b - a < 1e-4:
            continue
        if k % 2 == 0:
            boxes.append(((a, -thick, 0.0), (b, 0.0, height)))
            continue
        low, high = holes[k // 2][2:]
        if low > 0.0:
            boxes.append(((a, -thick, 0.0), (b, 0.0, low)))
        if high < height:
            boxes.append(((a, -thick, high), (b, 0.0, height)))
    boards = [_skirting(a[0], b[0]) for a, b in boxes if a[2] == 0.0]
    patches = [*(shapes.block(*box) for box in boxes), *boards]
    x0, x1, z0, z1 = splashback
    if x1 > x0 and z1 > z0:
        patches.append(shapes.block((x0, 0.0, z0), (x1, _TILE_M, z1), 0.0, 2))
    paint = patterned_material("texture/plaster?seed=3", 1.5, 0.9)
    glaze = painted_material("#f1f0ec", 0.25)
    return solid(patches, [paint, painted_material("#eceae4", 0.5), glaze], boxes)


def _skirting(x0: float, x1: float) -> Patch:
    """A board along a wall, its upper edge sloped: a level one is thinner than a pixel."""
    height, thick = SKIRTING_M
    profile = [(0.0, 0.0), (thick, 0.0), (thick, height - 1.6 * thick), (0.0, height)]
    corners = np.array([[(x, y, z) for y, z in profile] for x in (x0, x1)])
    ends = [shapes.fan(corners[0, ::-1], 1), shapes.fan(corners[1], 1)]
    return join_patches([shapes.grid(corners[:, [1, 2, 3]], slot=1), *ends])


def door_frame(size_m: Vec3 = (0.9, 2.05, 0.12)) -> Solid:
    """The frame of a door, its opening along Y, its middle at the origin. Slots: frame, threshold.

    Its leaf hangs at the keypoint ``hinge`` and opens towards +X.

    Args:
        size_m: Width and height of the opening, thickness of the wall.

    Raises:
        AssetError: if a size is not usable.
    """
    w, h, t = check_size("door_frame", size_m, 0.02)
    a, c = 0.5 * t + 0.015, 0.03
    boxes = [
        ((-a, -0.5 * w - 0.05, 0.0), (a, -0.5 * w + c, h + 0.05)),
        ((-a, 0.5 * w - c, 0.0), (a, 0.5 * w + 0.05, h + 0.05)),
        ((-a, -0.5 * w + c, h - c), (a, 0.5 * w - c, h + 0.05)),
    ]
    # Leaves end above it: no light shines through below them.
    threshold: Box = ((-a, -0.5 * w + c, 0.0), (a, 0.5 * w - c, 0.006))
    patches = [*(shapes.block(*b, 0.003) for b in boxes), shapes.block(*threshold, 0.002, 1)]
    looks = [painted_material("#f0eee9", 0.4), painted_material("#8a7d6c", 0.5)]
    made = solid(patches, looks, [*boxes, threshold])
    return replace(made, keypoints=(Keypoint("hinge", (0.5 * t - 0.022, -0.5 * w + 0.03, 0.0)),))


def door_leaf(size_m: tuple[float, float] = (0.84, 2.02), style: int = 0) -> Solid:
    """A door's leaf that hangs at the origin and is closed along +Y. Slots: leaf, handle, pane.

    Args:
        size_m: Width and height.
        style: 0 plain, 1 with two panels, 2 with four panels, 3 with a pane.

    Raises:
        AssetError: if a size is not usable.
    """
    w, h, _ = check_size("door_leaf", (*size_m, 1.0), 0.2)
    t = 0.02
    z0 = 0.008
    rails = [0.5 * h + 0.02] if style in (1, 2) else []
    patches: list[Patch] = [shapes.block((-t, 0.0, z0), (t, w, h), 0.002)]
    columns = {1: [(0.13, w - 0.13)], 2: [(0.11, 0.5 * w - 0.04), (0.5 * w + 0.04, w - 0.11)]}
    for y0, y1 in columns.get(style, []):
        for a, b in pairwise([0.16, *rails, h - 0.1]):
            panel = _raised_panel((y0, y1), (a + 0.04, b - 0.04)).moved(t)
            patches += [panel, panel.rotated("z", math.pi).moved(0.0, y0 + y1)]
    if style == 3:
        patch = shapes.block((-t - 0.002, 0.16, 0.9), (t + 0.002, w - 0.16, h - 0.16), 0.0, 2)
        patches.append(patch)
    for sign in (-1, 1):
        patches += [
            shapes.block(
                *_sorted((sign * t, w - 0.09, 0.94), (sign * (t + 0.006), w - 0.05, 1.12)), 0.002, 1
            ),
            rod((sign * t, w - 0.07, 1.06), (sign * (t + 0.05), w - 0.07, 1.06), 0.009, 1),
            rod((sign * (t + 0.05), w - 0.06, 1.06), (sign * (t + 0.05), w - 0.19, 1.06), 0.009, 1),
        ]
    paint = painted_material(("#f2f0eb", "#e9e4d9", "#f2f0eb", "#dfe3e4")[style % 4], 0.4)
    pane = Material((0.75, 0.8, 0.8), 0.5)
    looks = [paint, metal_material(STAINLESS, 0.3), pane]
    return solid(patches, looks, [((-t, 0.0, z0), (t, w, h))])


def _raised_panel(ys: tuple[float, float], zs: tuple[float, float]) -> Patch:
    """A panel before the plane x = 0 that faces +X, with wide sloped borders."""
    slope = 0.03
    ring = [[ys[0], zs[0]], [ys[1], zs[0]], [ys[1], zs[1]], [ys[0], zs[1]]]
    outer = np.array([[0.0, y, z] for y, z in ring])
    inset = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * slope
    inner = np.insert(outer[:, 1:] + inset, 0, 0.009, axis=1)
    rows = np.stack([np.concatenate([loop, loop[:1]]) for loop in (outer, inner)])
    return join_patches([shapes.grid(rows), shapes.fan(inner)])


def _sorted(a: Vec3, b: Vec3) -> tuple[Vec3, Vec3]:
    low = (min(a[0], b[0]), min(a[1], b[1]), min(a[2], b[2]))
    return low, (max(a[0], b[0]), max(a[1], b[1]), max(a[2], b[2]))


def window(size_m: Vec3 = (1.4, 1.3, 0.12), panes: int = 2) -> Solid:
    """A window in an opening along Y, inside towards +X; origin at the opening's lower middle.

    Slots: frame, sill, pane.

    Args:
        size_m: Width and height of the opening, thickness of the wall.
        panes: Number of casements side by side.

    Raises:
        AssetError: if a size is not usable.
    """
    w, h, t = check_size("window", size_m, 0.02)
    f = _FRAME_M
    x0, x1 = -0.5 * t + 0.01, -0.5 * t + 0.065
    boxes = [
        ((x0, -0.5 * w, 0.0), (x1, 0.5 * w, f)),
        ((x0, -0.5 * w, h - f), (x1, 0.5 * w, h)),
        ((x0, -0.5 * w, f), (x1, -0.5 * w + f, h - f)),
        ((x0, 0.5 * w - f, f), (x1, 0.5 * w, h - f)),
    ]
    for k in range(1, panes):
        y = w * (k / panes - 0.5)
        boxes.append(((x0, y - f, f), (x1 + 0.008, y + f, h - f)))
    at = w * (1.0 / panes - 0.5) if panes > 1 else 0.5 * w - 0.5 * f
    grip = shapes.block((x1, at - 0.012, 0.42 * h), (x1 + 0.04, at + 0.012, 0.42 * h + 0.12), 0.004)
    sill = (
        (x1, -0.5 * w - SILL_BESIDE_M, -0.025),
        (0.5 * t + SILL_REACH_M, 0.5 * w + SILL_BESIDE_M, 0.003),
    )
    patches = [*(shapes.block(*b, 0.006) for b in boxes), grip, shapes.block(*sill, 0.004, 1)]
    glass = Material((0.95, 0.97, 0.96), 0.02, transmission=1.0, role="glass")
    x = 0.5 * (x0 + x1)
    pane = rectangle((x, -0.5 * w, 0.0), (0.0, w, 0.0), (0.0, 0.0, h)).painted(2)
    patches += [pane, pane.flipped()]
    materials = [painted_material("#f3f2ee", 0.35), painted_material("#ece9e2", 0.3), glass]
    return solid(patches, materials, [*boxes, sill])


def outside(radius_m: float = 130.0) -> Solid:
    """The ground around a building, at z = 0, from its middle to a horizon. Slot: ground.

    Args:
        radius_m: Radius of the disc.
    """
    turn = 2.0 * math.pi * np.arange(49) / 48
    reach = np.array([0.05, 0.15, 0.4, 1.0])[:, None] * radius_m
    axes = np.broadcast_arrays(reach * np.cos(turn), reach * np.sin(turn), np.zeros(1))
    points = np.stack(axes, axis=2)
    middle = shapes.fan(points[0, :-1])
    ground = patterned_material("texture/grass?seed=0", 3.0, 1.0)
    ring = shapes.grid(points).flipped()
    slab = (-radius_m, -radius_m, -1.0), (radius_m, radius_m, 0.0)
    return solid([middle, ring], [ground], [slab])


def blind(size_m: Vec3 = (1.4, 0.5, 0.03), style: int = 0) -> Solid:
    """A blind before a window, hanging down from z = 0, its back at x = 0. Slots: cloth, rail.

    Args:
        size_m: Width, drop, depth.
        style: 0 roller blind, 1 slats.

    Raises:
        AssetError: if a size is not usable.
    """
    w, drop, d = check_size("blind", size_m, 0.01)
    rail: Box = ((0.0, -0.5 * w, -0.035), (d, 0.5 * w, 0.0))
    patches: list[Patch] = [shapes.block(*rail, 0.004, 1)]
    x = 0.5 * d
    if style == 1:
        count = max(2, round(drop / 0.022))
        for k in range(count):
            z = -0.04 - (drop - 0.05) * k / (count - 1)
            slat = shapes.block((-0.011, -0.5 * w, -0.0006), (0.011, 0.5 * w, 0.0006))
            patches.append(slat.rotated("y", 0.7).moved(x, 0.0, z))
    else:
        patch = shapes.block((x, -0.5 * w + 0.01, -drop), (x + 0.001, 0.5 * w - 0.01, -0.03))
        patches.append(patch)
    end: Box = ((x - 0.008, -0.5 * w, -drop - 0.012), (x + 0.008, 0.5 * w, -drop))
    patches.append(shapes.block(*end, 0.003, 1))
    cloth = replace(painted_material("#ece8dd", 0.9), diffuse_transmission=(0.3, 0.28, 0.24))
    looks = [
        cloth if style == 0 else painted_material("#e9e8e4", 0.4),
        painted_material("#f0efec", 0.4),
    ]
    return solid(patches, looks, [((0.0, -0.5 * w, -drop), (d, 0.5 * w, 0.0))])
