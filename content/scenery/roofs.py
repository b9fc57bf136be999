"""Roofs, dormers and chimneys.

All of them lie over a rectangle about the Z axis, ``depth_m`` along X and ``width_m`` along Y,
whose walls end at height 0. Tiles follow texture coordinates: u along the eaves, v up the slope,
one repeat per ``TILE_REPEAT_M``.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from gen_data.content.procedural.patches import Array, Patch, join_patches
from gen_data.content.procedural.surface_shapes import block, fan
from gen_data.content.scenery import facade
from gen_data.content.scenery.basic_shapes import Span, post, quad
from gen_data.content.scenery.facade import BASE, CHIMNEY, FACADE, METAL, ROOF, TRIM
from gen_data.core.variant_rng import VariantRng

TILE_REPEAT_M = 1.8
Point = tuple[float, float]


def gable_profile(depth_m: float, pitch_rad: float, eaves_m: float) -> list[Point]:
    """(x, z) from the front eaves over the ridge to the back eaves."""
    half, rise = 0.5 * depth_m, math.tan(pitch_rad)
    low = -eaves_m * rise
    return [(half + eaves_m, low), (0.0, half * rise), (-half - eaves_m, low)]


def mansard_profile(depth_m: float, height_m: float, eaves_m: float) -> list[Point]:
    """(x, z) of a roof with a steep lower and a flat upper slope."""
    half = 0.5 * depth_m
    knee, rise = half - 0.36 * height_m, height_m
    ridge = rise + 0.32 * knee
    return [(half + eaves_m, -0.1), (half - 0.05, 0.12), (knee, rise), (0.0, ridge),
            (-knee, rise), (0.05 - half, 0.12), (-half - eaves_m, -0.1)]  # fmt: skip


def over_profile(profile: Sequence[Point], width_m: float, verge_m: float, thick_m: float) -> Patch:
    """A roof of constant cross-section along Y, with the gable walls that it covers.

    Args:
        profile: (x, z) of its upper side, front to back; symmetric, its ends are the eaves.
        width_m: Distance of the gable walls.
        verge_m: How far it reaches over them.
        thick_m: Vertical thickness.
    """
    y = 0.5 * width_m + verge_m
    parts = []
    run = 0.0
    for (x0, z0), (x1, z1) in pairwise(profile):
        length = math.hypot(x1 - x0, z1 - z0)
        u, v = (0.0, 2 * y / TILE_REPEAT_M), (run / TILE_REPEAT_M, (run + length) / TILE_REPEAT_M)
        top = [(x0, -y, z0), (x0, y, z0), (x1, y, z1), (x1, -y, z1)]
        # The image's lower edge points to the eaves on both slopes.
        parts.append(quad(top if x1 >= 0.0 else [top[2], top[3], top[0], top[1]], ROOF, (u, v)))
        a, b, c, d = (x0, z0 - thick_m), (x1, z1 - thick_m), (x1, z1), (x0, z0)
        below = [(a[0], y, a[1]), (a[0], -y, a[1]), (b[0], -y, b[1]), (b[0], y, b[1])]
        parts.append(quad(below, TRIM))
        for side in (-y, y):
            edge = [(p[0], side, p[1]) for p in ((b, a, d, c) if side < 0 else (a, b, c, d))]
            parts.append(quad(edge, TRIM))
        run += length
    for (x, z), y1 in ((profile[0], y), (profile[-1], -y)):
        low = z - thick_m
        parts.append(quad([(x, -y1, low), (x, y1, low), (x, y1, z), (x, -y1, z)], METAL))
    return join_patches([*parts, *_gables(profile, width_m, thick_m)])


def hip(depth_m: float, width_m: float, pitch_rad: float, eaves_m: float) -> Patch:
    """Four slopes; the ridge runs along the longer side. ``depth_m`` may exceed ``width_m``."""
    if depth_m > width_m:
        return hip(width_m, depth_m, pitch_rad, eaves_m).rotated("z", 0.5 * math.pi)
    x, y = 0.5 * depth_m + eaves_m, 0.5 * width_m + eaves_m
    low, thick = -eaves_m * math.tan(pitch_rad), 0.12
    top, ridge = low + x * math.tan(pitch_rad), y - x
    slope = x / math.cos(pitch_rad) / TILE_REPEAT_M
    u = (0.0, 2 * y / TILE_REPEAT_M)
    front = quad([(x, -y, low), (x, y, low), (0, ridge, top), (0, -ridge, top)], ROOF, (u, (0, 1)))
    front = _map_slope(front, axis=1, v_top=slope, z_m=(low, top))
    corners = np.array([[(x, y, low), (-x, y, low), (0.0, ridge, top)]])
    side = Patch(corners, np.zeros((1, 3, 2)), np.array([ROOF]))
    side = _map_slope(side, axis=0, v_top=slope, z_m=(low, top))
    half = join_patches([front, side])
    rim = block((-x, -y, low - thick), (x, y, low - 0.001), slot=METAL)
    return join_patches([half, half.rotated("z", math.pi), rim])


def flat(depth_m: float, width_m: float, parapet_m: float) -> Patch:
    """A gravel deck behind a parapet with a metal coping."""
    x, y, t = 0.5 * depth_m, 0.5 * width_m, 0.25
    deck = quad([(x, -y, 0.02), (x, y, 0.02), (-x, y, 0.02), (-x, -y, 0.02)], BASE)
    sides = [((x - t, x), (-y, y), (0.03, 0.0)), ((-x, t - x), (-y, y), (0.03, 0.0))]
    sides += [((t - x, x - t), span, (0.0, 0.03)) for span in ((y - t, y), (-y, t - y))]
    parts = [deck]
    for (x0, x1), (y0, y1), (a, b) in sides:
        parts.append(block((x0, y0, 0.0), (x1, y1, parapet_m), slot=FACADE))
        low, high = (x0 - a, y0 - b, parapet_m), (x1 + a, y1 + b, parapet_m + 0.05)
        parts.append(block(low, high, slot=METAL))
    return join_patches(parts)


def chimney(x: float, y: float, z_m: Span) -> Patch:
    """A brick stack with a cover plate and a pot."""
    w = 0.28
    stack = block((x - w, y - w, z_m[0]), (x + w, y + w, z_m[1]), slot=CHIMNEY)
    plate = block((x - w - 0.06, y - w - 0.06, z_m[1]), (x + w + 0.06, y + w + 0.06, z_m[1] + 0.08))
    pot = post(0.11, (z_m[1] + 0.08, z_m[1] + 0.35), (x, y, 0.0), 8)
    return join_patches([stack, plate.painted(TRIM), pot.painted(METAL)])


def dormer(x: float, y: float, z0: float, reach_m: float, rng: VariantRng) -> Patch:
    """A small window house that looks out of a slope towards +X.

    Args:
        x: Where its front stands.
        y: Middle of its front.
        z0: Foot of its front.
        reach_m: How far it goes back into the roof.
        rng: Draws its curtains.
    """
    w, h = 0.75, 1.45
    hole = facade.Opening((-0.5, 0.5), (0.2, 1.35), 0.08)
    parts = [
        facade.cut_openings((-w, w), (0.0, h), (hole,), TRIM),
        facade.reveal(hole, 0.11, TRIM),
        facade.frame(hole),
        facade.panes(hole, rng, -0.11),
    ]
    parts = [join_patches(parts).moved(x, y, z0)]
    back, top = x - reach_m, z0 + h
    for side in (-1, 1):
        corners = [(u, y + side * w, v) for u, v in ((back, z0), (x, z0), (x, top), (back, top))]
        parts.append(quad(corners[::-side], ROOF))
    lid = block((back, y - w - 0.12, top), (x + 0.18, y + w + 0.12, top + 0.12), slot=METAL)
    return join_patches([*parts, lid])


def unit(x: float, y: float, size_m: tuple[float, float, float]) -> Patch:
    """A box of machinery or a stair head on a flat roof."""
    a, b, h = size_m
    return block((x - 0.5 * a, y - 0.5 * b, 0.0), (x + 0.5 * a, y + 0.5 * b, h), slot=METAL)


def _gables(profile: Sequence[Point], width_m: float, thick_m: float) -> list[Patch]:
    """The two walls between the height 0 and the roof's underside."""
    inner = [(x, max(0.0, z - 0.5 * thick_m)) for x, z in profile[1:-1]]
    foot = max(x for x, _ in inner)
    if len(inner) == 1:
        # A gable: its feet are where the slope meets the height 0.
        rise = (profile[1][1] - profile[0][1]) / (profile[0][0] - profile[1][0])
        foot = profile[1][1] / rise
    outline = [(foot, 0.0), *inner, (-foot, 0.0)]
    walls = []
    for side in (-0.5 * width_m, 0.5 * width_m):
        loop = np.array([(x, side, z) for x, z in (outline if side > 0 else outline[::-1])])
        walls.append(fan(loop[::-1], FACADE))
    return walls


def _map_slope(patch: Patch, axis: int, v_top: float, z_m: Span) -> Patch:
    """The patch with u along an axis and v with the height."""
    corners: Array = patch.corners_m
    u = corners[..., axis] / TILE_REPEAT_M
    v = (corners[..., 2] - z_m[0]) / (z_m[1] - z_m[0]) * v_top
    return Patch(corners, np.stack([u, v], axis=2), patch.slots)
