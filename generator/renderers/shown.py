"""What the pixels of an image show, put together from bands of rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.core.capture import Channel
from generator.core.geometry import Float32, Int32
from generator.core.intrinsics import Intrinsics
from generator.renderers.labels import label_images
from generator.renderers.moments import Band, Moment, Sight, sight
from generator.renderers.settings import RenderSettings
from generator.renderers.stock import AssetStock


@dataclass(frozen=True, eq=False, slots=True)
class Studio:
    """What all renderings have in common: assets and settings."""

    stock: AssetStock
    settings: RenderSettings


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


def shown_in(moment: Moment, see: Sight) -> Shown:
    """What the pixels of an image of one instant show; a copy."""
    lens = moment.camera.intrinsics
    shape = (lens.height_px, lens.width_px)
    return Shown(
        (whole_band(moment),),
        see.seen.hits.numpy().reshape(*shape, 2).copy(),
        see.seen.z_m.numpy().reshape(shape).copy(),
        see.seen.weights.numpy().reshape(*shape, 2).copy(),
    )


def drawn_bands(
    bands: Sequence[Band], channels: frozenset[Channel], studio: Studio
) -> tuple[Shown, dict[Channel, NDArray[Any]]]:
    """What pixels show, and label images of it, each band at its own instant."""
    lens = bands[0].moment.camera.intrinsics
    shape = (lens.height_px, lens.width_px)
    hits, weights = np.zeros((*shape, 2), np.int32), np.zeros((*shape, 2), np.float32)
    z_m = np.zeros(shape, np.float32)
    parts: dict[Channel, list[NDArray[Any]]] = {}
    for band in bands:
        rows, moment = slice(band.first, band.end), band.moment
        see = sight(moment, studio.stock, studio.settings.visibility, (band.first, band.end))
        hits[rows] = see.seen.hits.numpy().reshape(hits[rows].shape)
        weights[rows] = see.seen.weights.numpy().reshape(weights[rows].shape)
        z_m[rows] = see.seen.z_m.numpy().reshape(z_m[rows].shape)
        drawn = label_images(moment.scene, see.world, see.view, see.seen, channels)
        for channel, image in drawn.items():
            parts.setdefault(channel, []).append(image)
    images = {channel: np.concatenate(pieces) for channel, pieces in parts.items()}
    return Shown(tuple(bands), hits, z_m, weights), images
