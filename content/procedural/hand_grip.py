"""Grips on objects of any shape: where they lie in a hand, and how far fingers and thumb close.

Grips are found in the frame of a right hand, see ``hand_shape``. An object is described by
its sections across the palm, one next to each finger; every section is convex.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gen_data.content.procedural import hand_shape
from gen_data.content.procedural.patches import Array

_DIRECTIONS = 48
_TURNS = 2.0 * math.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
_ACROSS = np.stack([np.cos(_TURNS), np.sin(_TURNS)], axis=1)
_FRONT, _BACK, _TOP, _LOW = 0, _DIRECTIONS // 2, _DIRECTIONS // 4, 3 * _DIRECTIONS // 4
LEVELS_M = (0.0285, 0.007, -0.0138, -0.0312)
"""Heights of the sections along the hand's Y, from the middle of the grip at Y = -4 mm [m]."""
_MIDDLE_M = -0.004
_PALM_M = 0.0145
_WIDTH_M = (-0.004, 0.0, 0.004)
_BAND_M = 0.015
"""Dense meshes are convex over this distance at most."""
_DENSE = 10
_FREE = (0.5, 1.15, 1.6)
"""Dips [rad] of a finger that has nothing to touch."""
_YIELD_M = 0.0015
_PUSHES = 6


class Grip(NamedTuple):
    """A hand closed on something.

    Attributes:
        bends_deg: Dips of the bones of index, middle, ring, little finger and thumb [degree].
        shift_m: From the point of the object around which it was gripped to the hand's frame.
        gaps_m: Distance of the object from the same digits; infinite = nothing there.
    """

    bends_deg: tuple[float, ...]
    shift_m: tuple[float, float, float]
    gaps_m: tuple[float, ...]


def round_sections(radii_m: Sequence[float]) -> list[Array | None]:
    """Sections of a body of revolution about Y, by its radius next to each finger [m]."""
    return [np.full(_DIRECTIONS, radius) for radius in radii_m]


def sections(points_m: Array) -> list[Array | None]:
    """Sections of an object's vertices, [n, 3]; None next to a finger with nothing to hold.

    Object and hand have the same axes; the grip is around the points' origin. A section belongs
    to the convex hull of the vertices within 15 mm if there are many, else of all: the extent in 48
    directions from X to Z [m], the largest one over half the width of a finger.
    """
    made: list[Array | None] = []
    for level in LEVELS_M:
        beside = [_section(points_m, level + offset) for offset in _WIDTH_M]
        found = [section for section in beside if section is not None]
        made.append(np.max(found, axis=0) if found else None)
    return made


def _section(points_m: Array, level_m: float) -> Array | None:
    height = points_m[:, 1] - level_m
    near = np.abs(height) < _BAND_M
    dense = min((near & (height >= 0.0)).sum(), (near & (height < 0.0)).sum()) >= _DENSE
    points, height = (points_m[near], height[near]) if dense else (points_m, height)
    if not len(points) or height.min() > 0.0 or height.max() < 0.0:
        return None
    extent = points[:, (0, 2)] @ _ACROSS.T
    ticks, owner = np.unique(np.round(height, 3), return_inverse=True)
    widest = np.full((len(ticks), _DIRECTIONS), -np.inf)
    np.maximum.at(widest, owner.reshape(-1), extent)
    low, high = ticks <= 0.0, ticks >= 0.0
    if not low.any() or not high.any():
        return np.asarray(widest.max(axis=0))
    below, above = ticks[low][:, None], ticks[high][None]
    share = np.where(above > below, -below / np.maximum(above - below, 1e-9), 0.0)[..., None]
    between = widest[low][:, None] * (1.0 - share) + widest[high][None] * share
    return np.asarray(between.max(axis=(0, 1)))


def close_on(across: Sequence[Array | None]) -> Grip | None:
    """Close a hand on sections, in the palm below the knuckles; None if there is nothing.

    The object is pushed out of the palm and of the ball of the thumb, and the hand closes again.
    """
    solid = [section for section in across if section is not None]
    if not solid:
        return None
    reach = np.max(solid, axis=0)
    # Slim objects lie across the roots of the fingers, thick ones further back.
    half = 0.5 * min(reach[_FRONT] + reach[_BACK], reach[_TOP] + reach[_LOW])
    x = 0.0806 - 1.3 * half + reach[_BACK]
    z = -_PALM_M - reach[_TOP]
    for _ in range(_PUSHES):
        placed = [None if s is None else s + _ACROSS @ np.array([x, z]) for s in across]
        turns = _close(placed)
        bones = hand_shape.closed_bones(turns[:4], turns[4], 8.0)
        depth = -_palm_gap(bones, placed)
        if depth <= _YIELD_M:
            break
        z -= depth - 0.5 * _YIELD_M
    bends = tuple(round(math.degrees(turn), 1) for digit in turns for turn in digit)
    gaps = tuple(_gap(bones, k, placed) for k in range(5))
    return Grip(bends, (float(x), _MIDDLE_M, float(z)), gaps)


def _close(placed: Sequence[Array | None]) -> list[list[float]]:
    """Dips [rad] of fingers and thumb."""
    made = [
        list(_FREE) if section is None else hand_shape.close_straight(k + 1, _distance(section))
        for k, section in enumerate(placed)
    ]
    beside = _beside_thumb(placed)
    return [*made, hand_shape.close_straight(0, _distance(beside))]


def _beside_thumb(placed: Sequence[Array | None]) -> Array:
    """The section that the thumb closes on: the index finger's, or the nearest one."""
    return next(section for section in placed if section is not None)


def _distance(section: Array) -> hand_shape.Distance:
    """Distance from a convex section; negative inside."""

    def away(x: Array, z: Array) -> Array:
        return np.asarray((np.stack([x, z], axis=-1) @ _ACROSS.T - section).max(axis=-1))

    return away


def _gap(bones: hand_shape.Bones, digit: int, placed: Sequence[Array | None]) -> float:
    """Distance between the flesh of a digit, 4 = thumb, and its section [m]."""
    section = _beside_thumb(placed) if digit == 4 else placed[digit]
    if section is None:
        return math.inf
    number = (digit + 1) % 5
    chain, radii = bones.chains[number], hand_shape.bone_radii(number)
    share = np.linspace(0.15, 1.0, 9)[:, None]
    least = math.inf
    for bone in range(3):
        points = chain[bone] + share * (chain[bone + 1] - chain[bone])
        flesh = radii[bone] + (radii[bone + 1] - radii[bone]) * share[:, 0]
        least = min(least, float((_distance(section)(points[:, 0], points[:, 2]) - flesh).min()))
    return least


def _palm_gap(bones: hand_shape.Bones, placed: Sequence[Array | None]) -> float:
    """Distance of the sections' outlines from the palm and the ball of the thumb [m]."""
    gap = math.inf
    for section, level in zip(placed, LEVELS_M, strict=True):
        if section is not None:
            outline = _outline(section)
            points = np.insert(outline, 1, level + _MIDDLE_M, axis=1)
            gap = min(gap, float(hand_shape.measure_flesh(points, bones, 1.0).palm.min()))
    return gap


def _outline(section: Array) -> Array:
    """Points (x, z) along a section's outline, about 2 mm apart, [n, 2]."""
    step = 2.0 * math.pi / _DIRECTIONS
    after = np.roll(section, -1)
    # Where the lines of two directions meet.
    along = (after - section * math.cos(step)) / math.sin(step)
    sideways = np.stack([-_ACROSS[:, 1], _ACROSS[:, 0]], axis=1)
    corners = section[:, None] * _ACROSS + along[:, None] * sideways
    following = np.roll(corners, -1, axis=0)
    made = []
    for a, b in zip(corners, following, strict=True):
        count = 1 + int(math.dist(a, b) / 0.002)
        made.append(a + np.arange(count)[:, None] / count * (b - a))
    return np.concatenate(made)
