"""What the pixels of an image show, put together from bands of rows."""

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
    RenderContext,
    RowBand,
    render_view,
)
from gen_data.generator.renderers.warp.visibility.label_images import label_images

RadianceFunction = Callable[[CameraView], Float32]
"""What comes from every pixel of a sight [cd/m^2], float32 [h, w, 3]."""

# The lattice that light is gathered on has a point every so many pixels; what it looks at repeats
# after so many, and is smoothed over so many to either side.
_STRIDE_PX, _PATTERN_PX, _MARGIN_PX = 3, 12, 6


@dataclass(frozen=True, eq=False, slots=True)
class BandedGBuffer:
    """What the pixels of an image show.

    Attributes:
        bands: In order of rows; together all of them.
        hits, z_m, weights: As of Seen, shapes [h, w, 2], [h, w], [h, w, 2].
    """

    bands: Sequence[RowBand]
    hits: Int32
    z_m: Float32
    weights: Float32

    @property
    def intrinsics(self) -> Intrinsics:
        """Of the camera; where it is, the bands say."""
        return self.bands[0].state.camera.intrinsics


def full_band(state: CameraState) -> RowBand:
    """All rows at one instant."""
    return RowBand(0, state.camera.intrinsics.height_px, state)


def copy_gbuffer(rendered: CameraView) -> BandedGBuffer:
    """What the pixels of an image of one instant show; a copy."""
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
    context: RenderContext,
    reference: CameraView,
    light: RadianceFunction | None = None,
) -> tuple[BandedGBuffer, dict[Channel, NDArray[Any]]]:
    """What pixels show, and images of it, each band at its own instant.

    Args:
        bands: In order of rows; together all of them.
        channels: Labels.
        context: Assets and settings.
        reference: The world at about that time.
        light: Makes the channel RADIANCE; None = it is not asked for.
    """
    lens = reference.state.camera.intrinsics
    shape = (lens.height_px, lens.width_px)
    hits, weights = np.zeros((*shape, 2), np.int32), np.zeros((*shape, 2), np.float32)
    z_m = np.zeros(shape, np.float32)
    parts: dict[Channel, list[NDArray[Any]]] = {}
    for band in bands:
        rows = slice(band.first, band.end)
        first, end = (band.first, band.end) if light is None else add_margin(band, lens.height_px)
        # Neighbours in time have most in common.
        rendered = reference = render_view(band.state, context, (first, end), reference)
        own = slice(band.first - first, band.end - first)
        gbuffer, rows_px = rendered.gbuffer, (end - first, lens.width_px)
        hits[rows] = gbuffer.hits.numpy().reshape(*rows_px, 2)[own]
        weights[rows] = gbuffer.weights.numpy().reshape(*rows_px, 2)[own]
        z_m[rows] = gbuffer.z_m.numpy().reshape(rows_px)[own]
        drawn = label_images(band.state.scene, rendered.world, rendered.view, gbuffer, channels)
        if light is not None:
            drawn[Channel.RADIANCE] = light(rendered)
        for channel, image in drawn.items():
            parts.setdefault(channel, []).append(image[own].copy())
    images = {channel: np.concatenate(pieces) for channel, pieces in parts.items()}
    return BandedGBuffer(tuple(bands), hits, z_m, weights), images


def add_margin(band: RowBand, height_px: int) -> tuple[int, int]:
    """Rows to render so that light in a band is as it is in the whole image."""
    first = max(band.first - _MARGIN_PX, 0) // _PATTERN_PX * _PATTERN_PX
    end = -(-(band.end + _MARGIN_PX) // _STRIDE_PX) * _STRIDE_PX + 1
    return first, min(end, height_px)
