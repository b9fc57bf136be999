"""JPEG quality, on the scale of libjpeg: from a file's tables, or from the pixels.

A JPEG file states its quantisation steps. Where pixels were decoded and stored otherwise, the
coefficients of the discrete cosine transform lie near multiples of the steps; the quality is that
with the most likely steps (Fan and de Queiroz, "Identification of bitmap compression history: JPEG
detection and quantizer estimation", IEEE Transactions on Image Processing 12, 2003). Scaling,
cropping off the grid of blocks and strong processing after compression hide it.

Tables come from ITU-T T.81, annex K.1, scaled as libjpeg does.
"""

from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, se3
from gen_data.lab.matching import indirect_inference, recordings
from gen_data.lab.matching.picture import Picture

NAME, UNIT, PATH = "JPEG quality", "libjpeg", "image_pipeline.jpeg_quality"
STATISTIC = "quantisation steps of the file, or of the coefficients of its blocks"
AXIS = indirect_inference.Axis(1.0, 100.0, step=1.0, plausible=20.0, enough=2.0)
_STEPS = np.array([
    16, 11, 10, 16, 24, 40, 51, 61, 12, 12, 14, 19, 26, 58, 60, 55, 14, 13, 16, 24, 40, 57, 69, 56,
    14, 17, 22, 29, 51, 87, 80, 62, 18, 22, 37, 56, 68, 109, 103, 77, 24, 35, 55, 64, 81, 104, 113,
    92, 49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99,
])  # fmt: skip
"""Luma steps of quality 50, row by row."""
QUALITIES = range(20, 99)
"""Qualities that are sought in pixels: finer steps than at 98 are lost in rounding."""
ROUNDING = 0.4
"""Assumed standard deviation of coefficients from multiples of their steps: rounding to colours."""
OUTLIERS = 0.02
"""Assumed share of coefficients that clipping moves from their multiples."""
BLOCKS_MAX = 800
LEAST = 1.5
"""Smallest coefficients that tell steps apart."""
COEFFICIENTS_MIN = 300
EVIDENCE = 0.15
"""Mean log-likelihood per coefficient, in excess of no compression, that counts as found."""


def measure(photo: recordings.Photo) -> float:
    """Quality of the last compression; NaN if none is found."""
    if photo.quantisation is not None:
        return table_quality(photo.quantisation)
    return pixel_quality(Picture(photo.rgb))


def table_quality(steps: NDArray[Any]) -> float:
    """The quality whose luma table is nearest to one in any order, [64]; exact for libjpeg's.

    NaN for the finest table, all ones, that loses next to nothing.
    """
    if steps.max() <= 1:
        return float("nan")
    mine = np.sort(steps)
    distances = [np.abs(np.log(mine / np.sort(table.ravel()))).sum() for table in _tables()]
    return float(1 + int(np.argmin(distances)))


@cache
def _tables() -> tuple[se3.Array, ...]:
    """Luma steps of the qualities 1 to 100, [8, 8] each."""
    made = []
    for quality in range(1, 101):
        scale = 5000 // quality if quality < 50 else 200 - 2 * quality
        made.append(np.clip((_STEPS * scale + 50) // 100, 1, 255).reshape(8, 8).astype(np.float64))
    return tuple(made)


def pixel_quality(picture: Picture) -> float:
    """The most likely quality of decoded pixels; NaN if they show no compression."""
    blocks = _coefficients(picture.grey)
    row, column = np.nonzero(np.add.outer(np.arange(8), np.arange(8)) > 0)
    size = np.abs(blocks[:, row, column])
    block, frequency = np.nonzero(size >= LEAST)
    if len(block) < COEFFICIENTS_MIN:
        return float("nan")
    size = size[block, frequency].astype(np.float64)
    scores = []
    for quality in QUALITIES:
        steps = _tables()[quality - 1][row, column][frequency]
        # Coefficients that are not 0 are at least one step away from it.
        away = size - steps * np.maximum(np.rint(size / steps), 1.0)
        peak = np.exp(-0.5 * (away / ROUNDING) ** 2) / (ROUNDING * np.sqrt(2.0 * np.pi))
        likelihood = (1.0 - OUTLIERS) * steps * peak + OUTLIERS
        scores.append(float(np.log(likelihood).mean()))
    best = int(np.argmax(scores))
    return float(QUALITIES[best]) if scores[best] > EVIDENCE else float("nan")


def _coefficients(grey: asset_types.Float32) -> asset_types.Float32:
    """Discrete cosine transform of at most ``BLOCKS_MAX`` blocks, spread evenly, [n, 8, 8]."""
    rows, columns = (side // 8 for side in grey.shape)
    blocks = grey[: 8 * rows, : 8 * columns].reshape(rows, 8, columns, 8).swapaxes(1, 2)
    blocks = blocks.reshape(-1, 8, 8)
    blocks = blocks[:: max(1, len(blocks) // BLOCKS_MAX)]
    basis = cv2.dct(np.eye(8, dtype=np.float32), flags=cv2.DCT_ROWS).T
    return np.asarray(basis @ blocks @ basis.T, np.float32)


def distribution(qualities: se3.Array) -> Any:
    """YAML for qualities found in pictures, [n]: a number, a choice, or a uniform range."""
    values, counts = np.unique(np.rint(qualities).astype(int), return_counts=True)
    if len(values) == 1:
        return int(values[0])
    if len(values) <= 3:
        return {"choice": {str(v): int(n) for v, n in zip(values, counts, strict=True)}}
    low, high = np.percentile(qualities, [2.5, 97.5])
    return {"uniform": [round(float(low)), round(float(high))]}
