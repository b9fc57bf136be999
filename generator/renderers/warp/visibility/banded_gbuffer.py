"""G-buffers assembled from bands of rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Float32, Int32
from gen_data.generator.core.capture import Channel
from gen_data.generator.core.intrinsics import Intrinsics
from gen_data.generator.renderers.warp.frame_context import (
    CameraState,
    CameraView,
    RowBand,
    render_view,
)
from gen_data.generator.renderers.warp.visibility.label_images import label_images

RadianceFunction = Callable[[CameraView], Float32]
"""Radiance of every pixel of a view [cd/m^2], float32 [h, w, 3]."""

# Spacing of the lattice of realtime shading; period of its sampling pattern; and half width of its
# smoothing.
_STRIDE_PX, _PATTERN_PX, _MARGIN_PX = 3, 12, 6


@dataclass(frozen=True, eq=False, slots=True)
class BandedGBuffer:
    """G-buffer of an image whose rows may differ in time.

    Attributes:
        bands: Bands in order of rows, covering the image.
        hits, z_m, weights: As of GBuffer, shapes [h, w, 2], [h, w], [h, w, 2].
    """

    bands: Sequence[RowBand]
    hits: Int32
    z_m: Float32
    weights: Float32

    @property
    def intrinsics(self) -> Intrinsics:
        """Intrinsics of the camera; the bands hold its poses."""
        return self.bands[0].state.camera.intrinsics


def full_band(state: CameraState) -> RowBand:
    """All rows at one instant."""
    return RowBand(0, state.camera.intrinsics.height_px, state)


def copy_gbuffer(rendered: CameraView) -> BandedGBuffer:
    """Copy of the G-buffer of an image of one instant."""
    lens = rendered.state.camera.intrinsics
    shape = (lens.height_px, lens.width_px)
    return BandedGBuffer(
        (full_band(rendered.state),),
        rendered.gbuffer.hits.numpy().reshape(*shape, 2).copy(),
        rendered.gbuffer.z_m.numpy().reshape(shape).copy(),
        rendered.gbuffer.weights.numpy().reshape(*shape, 2).copy(),
    )


def render_bands(
    bands: Sequence[RowBand],
    channels: frozenset[Channel],
    reference: CameraView,
    light: RadianceFunction | None = None,
) -> tuple[BandedGBuffer, dict[Channel, NDArray[Any]]]:
    """Render G-buffer and label images of bands that cover the image, each at its own instant.

    ``reference`` is the world at a nearby instant; ``light`` computes the channel RADIANCE, None =
    not requested.
    """
    lens = reference.state.camera.intrinsics
    shape = (lens.height_px, lens.width_px)
    hits, weights = np.zeros((*shape, 2), np.int32), np.zeros((*shape, 2), np.float32)
    z_m = np.zeros(shape, np.float32)
    parts: dict[Channel, list[NDArray[Any]]] = {}
    for band in bands:
        rows = slice(band.first, band.end)
        first, end = (band.first, band.end) if light is None else add_margin(band, lens.height_px)
        # Neighbouring bands share the most packed data.
        rendered = reference = render_view(band.state, reference.context, (first, end), reference)
        own = slice(band.first - first, band.end - first)
        gbuffer, rows_px = rendered.gbuffer, (end - first, lens.width_px)
        hits[rows] = gbuffer.hits.numpy().reshape(*rows_px, 2)[own]
        weights[rows] = gbuffer.weights.numpy().reshape(*rows_px, 2)[own]
        z_m[rows] = gbuffer.z_m.numpy().reshape(rows_px)[own]
        drawn = label_images(rendered, channels)
        if light is not None:
            drawn[Channel.RADIANCE] = light(rendered)
        for channel, image in drawn.items():
            parts.setdefault(channel, []).append(image[own].copy())
    images = {channel: np.concatenate(pieces) for channel, pieces in parts.items()}
    return BandedGBuffer(tuple(bands), hits, z_m, weights), images


def add_margin(band: RowBand, height_px: int) -> tuple[int, int]:
    """Rows to render so that light in a band equals that of the whole image."""
    first = max(band.first - _MARGIN_PX, 0) // _PATTERN_PX * _PATTERN_PX
    end = -(-(band.end + _MARGIN_PX) // _STRIDE_PX) * _STRIDE_PX + 1
    return first, min(end, height_px)
