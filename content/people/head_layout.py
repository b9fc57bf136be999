"""Placement of faces, eyes and hair on their textures, in coordinates of the template [m].

Heads are unrolled about an upright axis, and both halves share one field: no seam needs a cut.
Heights run along the texture, because a face is taller than half its width.
"""

import numpy as np

from gen_data.content.people.body import Array
from gen_data.core.asset_types import Float32

WIDTH_PX, HEIGHT_PX = 512, 256
FACE_RADIUS_M = 0.115
"""Angles about the head's axis times this radius are distances on the face [m]."""

_AXIS_X_M = 0.03
# Most texels belong to the face, between chin and hairline.
_Z_M, _U = (0.48, 0.6, 0.8, 0.86), (0.01, 0.15, 0.9, 0.99)
_ASIDE_M, _V = (0.0, 0.15, FACE_RADIUS_M * np.pi), (0.01, 0.7, 0.99)

EYE_M = np.array([0.1245, 0.0308, 0.7284])
"""Middle of the left eyeball."""
EYE_CELL_M = 0.032
EYE_COLUMNS, EYE_ROWS = 4, 2
"""The texture of eyes is a table of cells, one per colour."""

_WHORL_M = np.array([-0.005, 0.0, 0.845])
HAIR_REPEAT_M = 0.25
_TURN_M = 0.08
"""Angles about the whorl times this length are distances across strands [m]."""


def lay_out_head(template_m: Array) -> Array:
    """Texture coordinates (u, v) of skin, float64 [n, 2]."""
    x, y, z = template_m.T
    aside = FACE_RADIUS_M * np.arctan2(np.abs(y), x - _AXIS_X_M)
    return np.stack([np.interp(z, _Z_M, _U), np.interp(aside, _ASIDE_M, _V)], axis=1)


def lay_out_eyes(template_m: Array, cell: int) -> Array:
    """Texture coordinates of both eyes in one cell of ``eyes``, float64 [n, 2]."""
    y, z = np.abs(template_m[:, 1]) - EYE_M[1], template_m[:, 2] - EYE_M[2]
    inside = np.clip(np.stack([y, z], axis=1) / EYE_CELL_M + 0.5, 0.02, 0.98)
    row, column = divmod(cell % (EYE_COLUMNS * EYE_ROWS), EYE_COLUMNS)
    return np.asarray((inside + np.array([column, row])) / (EYE_COLUMNS, EYE_ROWS))


def lay_out_hair(template_m: Array) -> Array:
    """Texture coordinates of hair that grows out of a whorl and then hangs, float64 [n, 2]."""
    p = template_m - _WHORL_M
    level = np.sqrt((p[:, :2] ** 2).sum(axis=1))
    across = _TURN_M * np.arctan2(np.abs(p[:, 1]), -p[:, 0])
    return np.stack([across, level - p[:, 2]], axis=1) / HAIR_REPEAT_M


def face_texels() -> tuple[Float32, Float32]:
    """Of the texture of faces: distance from the middle line [m], a column, and height, a row."""
    u = (np.arange(WIDTH_PX) + 0.5) / WIDTH_PX
    v = 1.0 - (np.arange(HEIGHT_PX) + 0.5) / HEIGHT_PX
    aside, z = np.interp(v, _V, _ASIDE_M), np.interp(u, _U, _Z_M)
    return aside.astype(np.float32)[:, None], z.astype(np.float32)[None, :]
