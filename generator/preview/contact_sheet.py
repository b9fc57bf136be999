"""Contact sheets: tiles of samples and sensors on one PNG."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import cv2
import numpy as np

from gen_data.core import capture, errors, plugins, whole_files
from gen_data.core.sample import Sample, SensorTracks
from gen_data.preview.lane_view import draw_borders
from gen_data.preview.overlay import Image, channel_image, draw_labels, draw_tracks, layer_images
from gen_data.preview.sensor_views import range_view, top_view
from gen_data.preview.text_view import draw_texts
from gen_data.preview.voxel_view import oblique_view
from gen_data.sensors.lidar import pseudo_lidar

GAP_PX = 4
BACKGROUND = 24
CAPTION_PX = 22
"""Height of the caption below a tile."""
INK = (225, 225, 225)


@dataclass(frozen=True, eq=False, slots=True)
class Tile:
    """One image of a sheet, uint8 [h, w, 3], and its caption."""

    caption: str
    image: Image


def make_tiles(
    samples: Iterable[Sample],
    channels: Mapping[str, Sequence[capture.Channel]],
    *,
    labels: bool,
    views: Mapping[str, str] = MappingProxyType({}),
    width_px: int = 0,
) -> Iterator[Tile]:
    """Yield a tile per sample, camera and channel or layer, two per scan, one of the occupancy.

    Tracked points are drawn with their ways through the samples of the sequence that are shown.

    Args:
        samples: Samples to show.
        channels: Channels of every camera.
        labels: Whether to draw labels on colour images.
        views: ``module:function`` that draws the readings of a device, by the device's name.
        width_px: Width of a tile, for lines and names of a legible size; 0 = the image's width.
    """
    ways = _Ways()
    for sample in samples:
        aspect = 1.0
        ways.add(sample)
        for name, reading in sorted(sample.capture.readings.items()):
            aspect = reading.camera.intrinsics.width_px / reading.camera.intrinsics.height_px
            shown = [c for c in channels[name] if c in reading.channels]
            for channel in shown:
                caption = name if len(shown) == 1 else f"{name} {channel.value}"
                if labels and channel is capture.Channel.RGB:
                    unit = reading.camera.intrinsics.width_px / width_px if width_px else 1.0
                    image = draw_labels(reading, sample.truth[name], unit)
                    draw_borders(image, sample.truth[name].borders or (), unit)
                    draw_texts(image, sample.truth[name].texts or (), unit)
                    if name in ways.seen:
                        draw_tracks(image, ways.seen[name], unit)
                    yield Tile(caption, image)
                else:
                    yield from _channel_tiles(caption, reading, channel)
        for name, cloud in sorted(sample.capture.clouds.items()):
            if cloud.lidar.model == pseudo_lidar.MODEL:
                # The depth image of its camera has the same contents.
                continue
            yield Tile(name, top_view(cloud, sample.scene, aspect))
            yield Tile(f"{name} range, intensity, class", range_view(cloud))
        for name, table in sorted(sample.capture.tables.items()):
            if name in views:
                draw = plugins.loaded(views[name], f"view of '{name}'")
                yield Tile(name, draw(table, sample.scene, aspect))
        if sample.frame is not None and sample.frame.occupancy is not None:
            yield Tile("occupancy", oblique_view(sample.frame.occupancy, sample.scene))


def _channel_tiles(
    caption: str, reading: capture.SensorReading, channel: capture.Channel
) -> Iterator[Tile]:
    if channel not in capture.LAYERS:
        yield Tile(caption, channel_image(reading, channel))
        return
    for number, image in enumerate(layer_images(reading, channel)):
        yield Tile(f"{reading.sensor} {channel.value} {number}", image)


@dataclass
class _Ways:
    """Tracked points in the samples of a sequence so far, by sensor."""

    seen: dict[str, list[SensorTracks]] = field(default_factory=dict)
    sequence: tuple[int, int] = (-1, -1)

    def add(self, sample: Sample) -> None:
        """Add a sample; one of another sequence forgets all before it."""
        sequence = (sample.scene_index, sample.view_index)
        if sequence != self.sequence:
            self.seen, self.sequence = {}, sequence
        if sample.frame is not None and sample.frame.tracks is not None:
            for name, tracks in sample.frame.tracks.sensors.items():
                self.seen.setdefault(name, []).append(tracks)


def render_tiles(shown: Iterable[Tile], width_px: int, *, captions: bool) -> list[Image]:
    """Scale the images of tiles to ``width_px``, optionally with captions below."""
    return [
        _add_caption(_scale(tile.image, width_px), tile.caption)
        if captions
        else _scale(tile.image, width_px)
        for tile in shown
    ]


def arrange_tiles(images: Sequence[Image], columns: int) -> Image:
    """Arrange tiles in rows of ``columns``, with a small gap; 0 = for a sheet of about 4:3.

    Raises:
        ConfigError: there is no tile.
    """
    if not images:
        raise errors.ConfigError("a contact sheet needs at least one sample")
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
        StorageError: the file cannot be written.
    """
    done, encoded = cv2.imencode(".png", sheet[..., ::-1])
    if not done:
        raise errors.StorageError(f"{path}: the contact sheet could not be encoded")
    try:
        whole_files.write_whole({path: encoded.tobytes()})
    except OSError as error:
        raise errors.StorageError(f"{path}: {error.strerror}") from error


def _add_caption(image: Image, caption: str) -> Image:
    strip: Image = np.full((CAPTION_PX, image.shape[1], 3), BACKGROUND, np.uint8)
    face = cv2.FONT_HERSHEY_SIMPLEX
    cv2.putText(strip, caption, (5, CAPTION_PX - 6), face, 0.5, INK, 1, cv2.LINE_AA)
    return np.concatenate([image, strip])


def _scale(image: Image, width_px: int) -> Image:
    height_px = round(image.shape[0] * width_px / image.shape[1])
    how = cv2.INTER_AREA if width_px < image.shape[1] else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(image, (width_px, height_px), interpolation=how), np.uint8)
