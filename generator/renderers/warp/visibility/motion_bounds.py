"""Speed of motion in an image, and the number of instants that it requires."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.se3 import Array
from gen_data.generator.core.shutter import INSTANT
from gen_data.generator.renderers.warp.frame_context import (
    CameraState,
    CameraView,
    RowBand,
    is_moving,
)
from gen_data.generator.renderers.warp.visibility.banded_gbuffer import copy_gbuffer, full_band
from gen_data.generator.renderers.warp.visibility.reprojection import (
    find_carriers,
    gather_points,
    reproject,
)

BAND_PX = 0.25
"""Largest motion of visible points within a band of rows."""
BLUR_PX = 0.3
"""Largest motion within a slice of an exposure, if the camera's number of samples allows."""
_STRIDE_PX = 4


@dataclass(frozen=True, eq=False, slots=True)
class ShutterSampling:
    """Sampling in time that an image requires.

    Attributes:
        speeds_px_s: Speed of the fastest point in or near each row, shape [height].
        samples: Slices per exposure.
        blurred: Rows with visible motion during their exposure, shape [height].
    """

    speeds_px_s: Array
    samples: int
    blurred: NDArray[np.bool_]


def plan_sampling(rendered: CameraView) -> ShutterSampling:
    """Plan the sampling of an image, given at the middle of the time its shutter is open."""
    middle, gbuffer = rendered.state, copy_gbuffer(rendered)
    shutter = middle.camera.shutter
    ends = [_global_shutter_band(middle.later(side * shutter.open_s)) for side in (-0.5, 0.5)]
    carriers = find_carriers(middle.scene)
    points = gather_points(gbuffer, carriers, _STRIDE_PX)
    before, after = (reproject(points, [end], carriers, _STRIDE_PX).image_px for end in ends)
    way = after - before
    length = np.where(np.isfinite(way).all(axis=-1), np.sqrt((way * way).sum(axis=-1)), 0.0)
    vertical = np.where(length > 0.0, np.abs(way[..., 1]), 0.0)
    speeds = _dilate_rows(
        length.max(axis=1) / shutter.open_s, vertical.max(axis=1), len(gbuffer.z_m)
    )
    wanted = math.ceil(float(speeds.max()) * shutter.exposure_s / BLUR_PX)
    blurred = speeds * shutter.exposure_s > BLUR_PX
    return ShutterSampling(speeds, min(max(wanted, 1), shutter.samples), blurred)


def split_bands(
    rendered: CameraView, sampling: ShutterSampling | None = None
) -> tuple[RowBand, ...]:
    """Bands of rows, each at its instant, within which nothing moves farther than ``BAND_PX``.

    ``rendered`` is the image at the middle of its exposure; without ``sampling``, plan it.
    """
    middle = rendered.state
    shutter = middle.camera.shutter
    if not shutter.rolls or not is_moving(middle, shutter.open_s):
        return (full_band(middle),)
    sampling = sampling or plan_sampling(rendered)
    per_row_s = abs(shutter.readout_s) / len(sampling.speeds_px_s)
    return make_bands(middle, band_starts(sampling.speeds_px_s * per_row_s))


def make_bands(middle: CameraState, starts: Sequence[int]) -> tuple[RowBand, ...]:
    """Bands that begin at the given rows, each at the instant of its middle."""
    height = middle.camera.intrinsics.height_px
    delay_s = middle.camera.shutter.delay_s
    return tuple(
        RowBand(first, end, middle.later(delay_s(0.5 * (first + end), height)))
        for first, end in zip(starts, [*starts[1:], height], strict=True)
    )


def band_starts(motion_px: Array) -> list[int]:
    """First rows of bands, each as high as the motion from row to row [height] allows."""
    travelled = np.concatenate([[0.0], np.cumsum(motion_px)])[:-1]
    begins: NDArray[np.bool_] = np.diff(np.floor(travelled / BAND_PX), prepend=-1.0) > 0.0
    return [int(row) for row in np.flatnonzero(begins)]


def _dilate_rows(speeds: Array, travels_px: Array, height: int) -> Array:
    """Highest speed of anything that may reach each row while the shutter is open, [height].

    Given speeds in every few rows, and the vertical motion of the same points in that time.
    """
    highest = np.zeros(height)
    reaches = np.ceil(0.5 * np.minimum(travels_px, 2.0 * height)).astype(int) + 2 * _STRIDE_PX
    for k, (speed, reach) in enumerate(zip(speeds, reaches, strict=True)):
        rows = slice(max(k * _STRIDE_PX - reach, 0), (k + 1) * _STRIDE_PX + reach)
        highest[rows] = np.maximum(highest[rows], speed)
    return highest


def _global_shutter_band(state: CameraState) -> RowBand:
    """The whole image with all rows exposed at one instant."""
    camera = replace(state.camera, shutter=INSTANT)
    return full_band(replace(state, camera=camera))
