"""Shoes: their placement on textures, and the images of these textures.

A shoe is unrolled about a level axis just above the sole, which ends before heel and toe: columns
are the distance along the foot, rows the angle from straight up (the texture's lower edge) to the
sole, then the distance down its rim. Both sides share one field, without a seam.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.people.body import Array
from gen_data.content.procedural.textures.texture_images import color, mix_colors, texture
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import SIZE_PX, fbm, perlin, smoothstep
from gen_data.core.variant_rng import variant_rng

_HEEL_M, _LENGTH_M = -0.08, 0.3
"""Left edge of the texture and its width, in the template frame."""
_AXIS_X_M, _AXIS_Y_M, _AXIS_Z_M = (-0.01, 0.15), 0.22, -0.8
"""Ends and place of the axis: of the left foot of the people pack."""
_SOLE_Z_M, _RIM_M = -0.794, 0.027
"""Upper edge of the sole (``body_regions.SOLE``), and its thickness."""
_SOLE_DEG, _RIM_DEG = 84.0, 60.0
"""Row where the rim of the sole begins, and its rows."""


@dataclass(frozen=True, slots=True)
class ShoeDesign:
    """Colours of a shoe, sRGB, and its kind."""

    upper: str
    sole: str
    lace: str
    kind: Literal["trainer", "leather", "boot", "slip_on"]


DESIGNS = load_table(__package__, "shoe_designs", ShoeDesign)


def lay_out_shoes(template_m: Array) -> Array:
    """Texture coordinates of shoes, [n, 2], from places in the template frame."""
    x, y, z = template_m.T
    off = np.maximum(np.hypot(np.abs(y) - _AXIS_Y_M, x - np.clip(x, *_AXIS_X_M)), 1e-6)
    # Relative to the sole's edge, which is level: triangles are too coarse for an edge by angle.
    share = np.arctan2(off, z - _AXIS_Z_M) / np.arctan2(off, _SOLE_Z_M - _AXIS_Z_M)
    down = _RIM_DEG * (_SOLE_Z_M - z) / _RIM_M
    turn_deg = _SOLE_DEG * np.minimum(share, 1.0) + np.maximum(down, 0.0)
    return np.stack([(x - _HEEL_M) / _LENGTH_M, turn_deg / 180.0], axis=1)


_PLACES = (np.arange(SIZE_PX, dtype=np.float32) + np.float32(0.5)) / np.float32(SIZE_PX)
_X_M = (_HEEL_M + _LENGTH_M * _PLACES)[None, :]
_TURN_DEG = (180.0 * (1.0 - _PLACES))[:, None]
_LACED_M = (0.055, 0.13)
"""From the ankle to the last pair of eyelets."""
_HALF_TONGUE_DEG = 27.0


def shoe(seed: int) -> TextureData:
    """The shoe of a row of ``shoe_designs.yaml``, in turn."""
    name = list(DESIGNS)[seed % len(DESIGNS)]
    design, rng = DESIGNS[name], variant_rng("shoe", seed)
    shades = 1.0 + 0.05 * perlin((48, 48), rng) + 0.08 * fbm((5, 5), 2, rng)
    image: Float32 = color(design.upper) * shades[..., None]
    seams = _seams(design.kind)
    image = image * (1.0 - 0.45 * seams)[..., None]
    height: Float32 = -1.2 * seams
    if design.kind != "slip_on":
        tongue = _between(_X_M, *_LACED_M) * _below(_TURN_DEG, _HALF_TONGUE_DEG - 9.0)
        image = image * (1.0 - 0.25 * tongue)[..., None]
        laces = _laces()
        image = mix_colors(image, color(design.lace), laces)
        height = height + 2.5 * laces - 0.8 * tongue
    if design.kind == "trainer" and seed % 2:
        stripe = _stripes()
        image = mix_colors(image, color(design.sole), stripe)
        height = height + 0.5 * stripe
    rim = smoothstep(_SOLE_DEG - 1.0, _SOLE_DEG + 1.0, _TURN_DEG) + np.zeros_like(_X_M)
    worn = 1.0 - 0.22 * smoothstep(98.0, 135.0, _TURN_DEG)
    worn = worn - 0.1 * np.maximum(fbm((9, 9), 2, rng), 0.0)
    image = mix_colors(image, color(design.sole) * worn[..., None], rim)
    joint = _line(_TURN_DEG, _SOLE_DEG, 2.5) + 0.6 * _line(_TURN_DEG, 108.0, 2.0)
    shaded = image * (1.0 - 0.5 * np.minimum(joint, 1.0))[..., None]
    return texture(np.asarray(shaded, np.float32), None, np.asarray(height - joint, np.float32))


def _seams(kind: str) -> Float32:
    """Stitched edges: the heel's counter, the facing of the laces, the toe cap."""
    counter = _line(_X_M + 0.0006 * (_TURN_DEG - 45.0), -0.005, 0.003)
    if kind == "slip_on":
        return np.asarray(counter + np.zeros_like(_TURN_DEG), np.float32)
    facing = _line(_TURN_DEG, _HALF_TONGUE_DEG, 2.0) * _between(_X_M, *_LACED_M)
    cap = _line(_X_M + 0.0004 * _TURN_DEG, 0.168, 0.003)
    return np.asarray(np.clip(counter + facing + cap, 0.0, 1.0), np.float32)


def _laces() -> Float32:
    """Five bars over the tongue, and a bow."""
    first, last = _LACED_M
    pitch_m = (last - first) / 5.0
    along = (_X_M - first) / pitch_m
    bars = smoothstep(0.24, 0.16, np.abs(along - np.floor(along) - 0.5))
    bars = bars * _between(_X_M, first, last) * _below(_TURN_DEG, _HALF_TONGUE_DEG - 3.0)
    bow = np.hypot((_X_M - first - 0.004) / 0.007, (_TURN_DEG - 22.0) / 20.0)
    loops = smoothstep(0.3, 0.15, np.abs(bow - 0.8))
    return np.asarray(np.maximum(bars, loops), np.float32)


def _stripes() -> Float32:
    """Two slanted bands on the side."""
    along = (_X_M - 0.035 - 0.0007 * (_TURN_DEG - 55.0)) / 0.02
    bands = smoothstep(0.3, 0.22, np.abs(along - np.floor(along) - 0.5))
    side = _between(_TURN_DEG, 36.0, _SOLE_DEG - 3.0)
    return np.asarray(bands * side * _between(along, 0.0, 2.0), np.float32)


def _line(position: Float32, at: float, width: float) -> Float32:
    return np.asarray(smoothstep(width, 0.4 * width, np.abs(position - at)), np.float32)


def _between(position: Float32, low: float, high: float) -> Float32:
    return np.asarray((position >= low) & (position < high), np.float32)


def _below(position: Float32, high: float) -> Float32:
    return np.asarray(smoothstep(high + 1.5, high - 1.5, position), np.float32)
