"""Placement of garments on their textures.

A garment texture covers a square of ``TILE_M`` and has three fields side by side: the front of
the trunk, one limb, the back of the trunk. Trunk coordinates unroll a cylinder about the spine;
limb coordinates run from the limb's middle line to the opposite side and back, which avoids a cut
along a seam. Both sleeves and both legs share the limb's field. Coordinates are in the template
frame [m].
"""

import math
from collections.abc import Sequence

import numpy as np

from gen_data.content.people.body import Array, Indices
from gen_data.core.asset_types import Float32

TILE_M = 1.28
FRONT_M, BACK_M = 0.32, 0.96
"""Middle lines of the trunk's front and back, from the texture's left edge."""
TRUNK_RADIUS_M = 0.143
"""Of the cylinder that the trunk is unrolled from: half its usual girth over pi."""
LIMB_M, LIMB_WIDTH_M = 0.56, 0.16
"""Left edge and width of the limb's field; the width is half the limb's girth."""
SHOULDER_ROW_M = 0.08
"""From the texture's upper edge to the shoulder, where sleeves begin."""
TOP_Z_M = 0.64
"""Height at the upper edge of trunks and legs."""

_SPINE_X_M = 0.01
# Joints of the pack's base shape, left side.
_ARM_M = np.array([[0.015, 0.168, 0.525], [0.013, 0.313, 0.349], [0.176, 0.431, 0.245]])
_LEG_M = np.array([[0.012, 0.11, 0.049], [0.032, 0.158, -0.369], [-0.001, 0.22, -0.745]])
_ARM_OUT = np.array([0.0, 0.77, 0.638])
_ARMS = frozenset({"sleeves", "arms"})
_LEGS = frozenset({"thighs", "shins", "ankles", "legs", "upper_legs"})
_TRUNK_FRONT, _TRUNK_BACK, _ARM, _LEG = range(4)
_FIELDS = 4


def lay_out(
    template_m: Array, faces: Indices, zones: Sequence[str], slots: Indices
) -> tuple[Indices, Indices, Array]:
    """Texture coordinates of a garment.

    Args:
        template_m: Its vertices in the template frame [m], shape [n, 3].
        faces: Its triangles, shape [m, 3].
        zones: Zone of each slot.
        slots: Slot of each triangle, shape [m].

    Returns:
        The vertex that each corner shows, int64 [k]; triangles of those corners, [m, 3]; their
        coordinates (u, v), float64 [k, 2]. Vertices on the border of two fields have two corners.
    """
    fields = _fields(template_m, faces, zones, slots)
    keys, inverse = np.unique(faces * _FIELDS + fields[:, None], return_inverse=True)
    corners, field = np.divmod(keys, _FIELDS)
    p = template_m[corners]
    uvs_m = np.zeros((len(corners), 2))
    for number, place in (
        (_TRUNK_FRONT, lambda q: _trunk(q, 1.0)),
        (_TRUNK_BACK, lambda q: _trunk(q, -1.0)),
        (_ARM, _arm),
        (_LEG, _leg),
    ):
        mine = field == number
        if mine.any():
            uvs_m[mine] = place(p[mine])
    return corners, inverse.reshape(faces.shape), uvs_m / TILE_M


def texel_places(size_px: int) -> tuple[Float32, Float32]:
    """Distance of texels from the upper and the left edge [m]: a column and a row."""
    centres = ((np.arange(size_px) + 0.5) * (TILE_M / size_px)).astype(np.float32)
    return centres[:, None], centres[None, :]


def _fields(template_m: Array, faces: Indices, zones: Sequence[str], slots: Indices) -> Indices:
    behind = template_m[faces, 0].mean(axis=1) < _SPINE_X_M
    kinds = np.array([_ARM if z in _ARMS else _LEG if z in _LEGS else -1 for z in zones])[slots]
    fields: Indices = np.where(kinds >= 0, kinds, np.where(behind, _TRUNK_BACK, _TRUNK_FRONT))
    return fields


def _trunk(p: Array, sign: float) -> Array:
    """Front (1) or back (-1) of the trunk, as seen from there."""
    turn = np.arctan2(p[:, 1], sign * (p[:, 0] - _SPINE_X_M))
    middle = FRONT_M if sign > 0.0 else BACK_M
    return np.stack([middle + sign * TRUNK_RADIUS_M * turn, TILE_M - TOP_Z_M + p[:, 2]], axis=1)


def _arm(p: Array) -> Array:
    """Sleeves: from the shoulder downward, around from the outer side."""
    p = np.stack([p[:, 0], np.abs(p[:, 1]), p[:, 2]], axis=1)
    first, second = np.diff(_ARM_M, axis=0)
    lengths = [math.sqrt(float((s * s).sum())) for s in (first, second)]
    # The upper arm also reaches above the shoulder, the forearm beyond the wrist.
    upper = np.minimum((p - _ARM_M[0]) @ first / lengths[0] ** 2, 1.0)
    lower = np.maximum((p - _ARM_M[1]) @ second / lengths[1] ** 2, 0.0)
    axis = _ARM_M[0] + upper[:, None] * first + lower[:, None] * second
    out = p - axis
    reach = np.maximum(np.sqrt((out * out).sum(axis=1)), 1e-6)
    turn = np.arccos(np.clip(out @ _ARM_OUT / reach, -1.0, 1.0))
    along = upper * lengths[0] + lower * lengths[1]
    return np.stack([_across(turn), TILE_M - SHOULDER_ROW_M - along], axis=1)


def _leg(p: Array) -> Array:
    """Trouser legs: by height, around from the front."""
    rising = _LEG_M[::-1]
    middle = [np.interp(p[:, 2], rising[:, 2], rising[:, k]) for k in (0, 1)]
    x, y = p[:, 0] - middle[0], np.abs(p[:, 1]) - middle[1]
    turn = np.arctan2(np.abs(y), x)
    return np.stack([_across(turn), TILE_M - TOP_Z_M + p[:, 2]], axis=1)


def _across(turn: Array) -> Array:
    return LIMB_M + LIMB_WIDTH_M * turn / math.pi
