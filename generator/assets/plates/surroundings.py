"""The light around a photograph's scene: its content, continued to all sides.

A photograph shows a part of its surroundings. Its columns are mirrored at its borders until they
are all around, its topmost and bottommost rows are continued to the poles, as image-based editing
does (Khan et al., "Image-based material editing", SIGGRAPH 2006). The upper half is then scaled so
that it lights level ground as brightly as the photograph shows it: skies are brighter than the
white of a photograph.
"""

import math
from dataclasses import replace

import cv2
import numpy as np

from gen_data.core import asset_types, colorimetry
from gen_data.core.plates import Plate, ground_illuminance
from gen_data.core.se3 import Array

_ROWS = 64
_SMALL_PX = 48
"""Long side of the image that is continued: about one pixel per texel of the surroundings."""
_FADE = 0.5
"""Beyond the upper and lower border colours fade to the border's mean, within this share of the
photograph's height."""


def surroundings(plate: Plate, rgb: asset_types.UInt8) -> tuple[Plate, asset_types.Float32]:
    """The plate with the luminance of its surroundings, and these, [64, 128, 3], of mean 1."""
    polar = math.pi * (np.arange(_ROWS) + 0.5) / _ROWS
    azimuth = math.pi - math.pi * (np.arange(2 * _ROWS) + 0.5) / _ROWS
    image = _continue(plate, rgb, polar, azimuth)
    image = _match_ground(image, polar, plate)
    weights = np.sin(polar)[:, None]
    level = colorimetry.luminance(image)
    mean = float((level * weights).sum() / (weights.sum() * level.shape[1]))
    return replace(plate, sky_mean=round(mean, 9)), (image / mean).astype(np.float32)


def _continue(plate: Plate, rgb: asset_types.UInt8, polar: Array, azimuth: Array) -> Array:
    """Linear colours in all directions, [rows, columns, 3]."""
    width_px, height_px = plate.size_px
    scale = min(_SMALL_PX / max(plate.size_px), 1.0)
    size = (max(round(width_px * scale), 1), max(round(height_px * scale), 1))
    small = colorimetry.srgb_decode(cv2.resize(rgb, size, interpolation=cv2.INTER_AREA) / 255.0)
    half = math.atan(0.5 * width_px / plate.focal_px)
    # A triangle wave: azimuths beyond the borders are mirrored back into the photograph.
    folded = np.abs((azimuth + half) % (4.0 * half) - 2.0 * half) - half
    level = np.stack([np.cos(folded), np.sin(folded)], axis=-1)
    directions = np.concatenate(
        [
            np.sin(polar)[:, None, None] * level[None],
            np.broadcast_to(np.cos(polar)[:, None, None], (len(polar), len(azimuth), 1)),
        ],
        axis=-1,
    )
    seen = plate.T_world_camera.inverse().rotate(directions)
    depth = np.maximum(seen[..., 2], 0.05)
    # Outside the field of view, only the border counts: up or down.
    rows = np.where(
        seen[..., 2] > 0.05,
        0.5 * height_px + plate.focal_px * seen[..., 1] / depth,
        np.where(np.cos(polar)[:, None] > 0.0, 0.0, height_px),
    )
    columns = 0.5 * width_px - plate.focal_px * np.tan(folded)
    x = np.broadcast_to(columns[None] * size[0] / width_px - 0.5, rows.shape)
    y = rows * size[1] / height_px - 0.5
    maps = (x.astype(np.float32), np.clip(y, 0, size[1] - 1).astype(np.float32))
    found = cv2.remap(small, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    border = np.where((y < 0.0)[..., None], small[0].mean(axis=0), small[-1].mean(axis=0))
    beyond = np.maximum(np.maximum(-y, y - (size[1] - 1)), 0.0) / (_FADE * size[1])
    share = np.minimum(beyond, 1.0)[..., None]
    return np.asarray(np.maximum(found * (1.0 - share) + border * share, 1e-4))


def _match_ground(image: Array, polar: Array, plate: Plate) -> Array:
    """The surroundings with an upper half that gives level ground the light without the sun."""
    share = 1.0 - (plate.sun.share if plate.sun else 0.0)
    cosines = np.maximum(np.cos(polar), 0.0)[:, None]
    texel = np.sin(polar)[:, None] * (math.pi / len(polar)) ** 2
    raw = float((colorimetry.luminance(image) * cosines * texel).sum())
    factor = max(share, 1e-3) * ground_illuminance(plate) / raw
    return np.where(np.cos(polar)[:, None, None] > 0.0, image * factor, image)
