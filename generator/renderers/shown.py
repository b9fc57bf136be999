"""What the pixels of an image show, put together from bands of rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.core.capture import Channel
from generator.core.geometry import Float32, Int32
from generator.core.intrinsics import Intrinsics
from generator.renderers.labels import label_images
from generator.renderers.moments import Band, Moment, Sight, Studio, sight

Light = Callable[[Sight], Float32]
"""What comes from every pixel of a sight [cd/m^2], float32 [h, w, 3]."""

# The lattice that light is gathered on has a point every so many pixels; what it looks at repeats
# after so many, and is smoothed over so many to either side.
_STRIDE_PX, _PATTERN_PX, _MARGIN_PX = 3, 12, 6


@dataclass(frozen=True, eq=False, slots=True)
class Shown:
    """What the pixels of an image show.

    Attributes:
        bands: In order of rows; together all of them.
        hits, z_m, weights: As of Seen, shapes [h, w, 2], [h, w], [h, w, 2].
    """

    bands: Sequence[Band]
    hits: Int32
    z_m: Float32
    weights: Float32

    @property
    def intrinsics(self) -> Intrinsics:
        """Of the camera; where it is, the bands say."""
        return self.bands[0].moment.camera.intrinsics


def whole_band(moment: Moment) -> Band:
    """All rows at one instant."""
    return Band(0, moment.camera.intrinsics.height_px, moment)


def shown_in(see: Sight) -> Shown:
    """What the pixels of an image of one instant show; a copy."""
    lens = see.moment.camera.intrinsics
    shape = (lens.height_px, lens.width_px)
    return Shown(
        (whole_band(see.moment),),
        see.seen.hits.numpy().reshape(*shape, 2).copy(),
        see.seen.z_m.numpy().reshape(shape).copy(),
        see.seen.weights.numpy().reshape(*shape, 2).copy(),
    )


def drawn_bands(
    bands: Sequence[Band],
    channels: frozenset[Channel],
    studio: Studio,
    near: Sight,
    light: Light | None = None,
) -> tuple[Shown, dict[Channel, NDArray[Any]]]:
    """What pixels show, and images of it, each band at its own instant.

    Args:
        bands: In order of rows; together all of them.
        channels: Labels.
        studio: Assets and settings.
        near: The world at about that time.
        light: Makes the channel RADIANCE; None = it is not asked for.
    """
    lens = near.moment.camera.intrinsics
    shape = (lens.height_px, lens.width_px)
    hits, weights = np.zeros((*shape, 2), np.int32), np.zeros((*shape, 2), np.float32)
    z_m = np.zeros(shape, np.float32)
    parts: dict[Channel, list[NDArray[Any]]] = {}
    for band in bands:
        rows = slice(band.first, band.end)
        first, end = (band.first, band.end) if light is None else with_margin(band, lens.height_px)
        # Neighbours in time have most in common.
        see = near = sight(band.moment, studio, (first, end), near)
        own = slice(band.first - first, band.end - first)
        seen, rows_px = see.seen, (end - first, lens.width_px)
        hits[rows] = seen.hits.numpy().reshape(*rows_px, 2)[own]
        weights[rows] = seen.weights.numpy().reshape(*rows_px, 2)[own]
        z_m[rows] = seen.z_m.numpy().reshape(rows_px)[own]
        drawn = label_images(band.moment.scene, see.world, see.view, seen, channels)
        if light is not None:
            drawn[Channel.RADIANCE] = light(see)
        for channel, image in drawn.items():
            parts.setdefault(channel, []).append(image[own].copy())
    images = {channel: np.concatenate(pieces) for channel, pieces in parts.items()}
    return Shown(tuple(bands), hits, z_m, weights), images


def with_margin(band: Band, height_px: int) -> tuple[int, int]:
    """Rows to render so that light in a band is as it is in the whole image."""
    first = max(band.first - _MARGIN_PX, 0) // _PATTERN_PX * _PATTERN_PX
    end = -(-(band.end + _MARGIN_PX) // _STRIDE_PX) * _STRIDE_PX + 1
    return first, min(end, height_px)
