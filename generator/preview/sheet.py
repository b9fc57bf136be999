"""Contact sheet: many samples on one PNG."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import cv2
import numpy as np

from generator.core.capture import Channel
from generator.core.errors import ConfigError, StorageError
from generator.core.sample import Sample
from generator.preview.clouds import range_view, top_view
from generator.preview.overlay import Image, channel_image, labelled_image

GAP_PX = 4
BACKGROUND = 24


def tiles(
    samples: Iterable[Sample], channels: Sequence[Channel], *, labels: bool, width_px: int
) -> list[Image]:
    """One tile per sample, camera and channel it has, and two per scan, ``width_px`` wide."""
    shown = []
    for sample in samples:
        aspect = 1.0
        for name, reading in sorted(sample.capture.readings.items()):
            aspect = reading.camera.intrinsics.width_px / reading.camera.intrinsics.height_px
            for channel in (c for c in channels if c in reading.channels):
                drawn = labels and channel is Channel.RGB
                shown.append(
                    labelled_image(reading, sample.truth[name])
                    if drawn
                    else channel_image(reading, channel)
                )
        for _, cloud in sorted(sample.capture.clouds.items()):
            shown += [top_view(cloud, sample.scene, aspect), range_view(cloud)]
    return [_scaled(image, width_px) for image in shown]


def arranged(images: Sequence[Image], columns: int) -> Image:
    """Tiles in rows of ``columns``, with a small gap; 0 = as many as make a sheet of 4 to 3.

    Raises:
        ConfigError: if there is no tile.
    """
    if not images:
        raise ConfigError("a contact sheet needs at least one sample")
    height = max(image.shape[0] for image in images)
    width = max(image.shape[1] for image in images)
    columns = columns or max(1, round(math.sqrt(len(images) * 4.0 / 3.0 * height / width)))
    rows = math.ceil(len(images) / columns)
    columns = min(columns, len(images))
    sheet = np.full(
        (rows * (height + GAP_PX) + GAP_PX, columns * (width + GAP_PX) + GAP_PX, 3),
        BACKGROUND,
        np.uint8,
    )
    for number, image in enumerate(images):
        row, column = divmod(number, columns)
        y, x = GAP_PX + row * (height + GAP_PX), GAP_PX + column * (width + GAP_PX)
        sheet[y : y + image.shape[0], x : x + image.shape[1]] = image
    return sheet


def write_sheet(sheet: Image, path: Path) -> None:
    """Write a sheet as PNG.

    Raises:
        StorageError: if the file cannot be written.
    """
    done, encoded = cv2.imencode(".png", sheet[..., ::-1])
    if not done:
        raise StorageError(f"{path}: the contact sheet could not be encoded")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(encoded.tobytes())
    except OSError as error:
        raise StorageError(f"{path}: {error.strerror}") from error


def _scaled(image: Image, width_px: int) -> Image:
    height_px = round(image.shape[0] * width_px / image.shape[1])
    how = cv2.INTER_AREA if width_px < image.shape[1] else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(image, (width_px, height_px), interpolation=how), np.uint8)
