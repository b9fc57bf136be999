"""PNG files of the image channels: their pixel values and encoder settings.

====================  =====================  =====================================================
channel               PNG                    value; value for "nothing"
====================  =====================  =====================================================
rgb                   8-bit RGB              sRGB; JPEG or WebP if the camera's encoding is so
depth, range          16-bit grey            ``round(metres / depth_scale_m)``, half to even;
                                             0 = nothing, or farther than 65535 units
instance, part,       16-bit grey            the id; 0
category
normals               8-bit RGB              ``round((n + 1) / 2 * 255)``; (128, 128, 128)
object_coordinates    16-bit RGB             ``round(c * 65535)``; 0
measured_depth        16-bit grey            as depth
infrared              16-bit grey            as it is
disparity,            16-bit grey            ``round(256 * pixels)``, as KITTI's stereo benchmark
disparity_visible                            has it; 0 = nothing, or 256 px and more
flow_forward,         16-bit RGB             ``round(64 * pixels) + 32768`` to the right and
flow_backward                                down, then 1, as KITTI's flow benchmark has it;
                                             (0, 0, 0) = none, or 512 px and more
flow_occluded_...     8-bit grey             255 = hidden, or not in the image; 0 = seen
scene_flow            16-bit RGB             ``round(metres / depth_scale_m) + 32768`` per axis;
                                             (0, 0, 0) = nothing, or beyond 32767 units
depth_layers,         16-bit grey            as depth or instance, numbers of materials; all layers
instance_layers,                             below one another, the first on top: the image is as
material_layers                              many times higher as there are layers
seen_in_mirror        16-bit grey            the id; 0
mirrored_position     16-bit RGB             ``round(metres / (8 depth_scale_m)) + 32768`` per axis;
                                             (0, 0, 0) = nothing, or beyond 32767 units
====================  =====================  =====================================================

Filters predict from the left pixel, for ids from the pixel above. Compression uses the highest
level that still reduces the size noticeably for its time.
"""

import os
import shutil
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core.capture import LAYERS, PNG, Channel, ImageEncoding
from gen_data.core.errors import ConfigError, SampleError, StorageError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.exporters import measurement_tables, point_cloud_io
from gen_data.exporters.png import RowFilter, decode_png, encode_png

UInt16 = NDArray[np.uint16]

DEPTH_UNITS_MAX = 65_535
"""Largest value of a 16-bit depth image."""

FLOW_UNITS_PER_PX = 64
DEPTHS_PER_UNIT = {Channel.SCENE_FLOW: 1, Channel.MIRRORED_POSITION: 8}
"""Units of depth per unit of other lengths: the world is larger than a view of it."""
SIGNED_ZERO = 32_768
"""Value of 0 in 16-bit images of signed quantities."""

WEBP_LOSSLESS = 101

NO_NORMAL = 128
"""Value of all three components in images of normals without a surface."""

ENCODING = {
    Channel.RGB: (RowFilter.SUB, 1),
    Channel.Z_DEPTH: (RowFilter.SUB, 1),
    Channel.RANGE: (RowFilter.SUB, 1),
    Channel.INSTANCE: (RowFilter.UP, 2),
    Channel.PART: (RowFilter.UP, 2),
    Channel.CATEGORY: (RowFilter.UP, 2),
    Channel.NORMALS: (RowFilter.SUB, 1),
    Channel.OBJECT_COORDINATES: (RowFilter.SUB, 1),
    Channel.MEASURED_DEPTH: (RowFilter.SUB, 1),
    Channel.INFRARED: (RowFilter.SUB, 1),
    Channel.DISPARITY: (RowFilter.SUB, 1),
    Channel.DISPARITY_VISIBLE: (RowFilter.SUB, 1),
    Channel.FLOW_FORWARD: (RowFilter.SUB, 1),
    Channel.FLOW_BACKWARD: (RowFilter.SUB, 1),
    Channel.FLOW_OCCLUDED_FORWARD: (RowFilter.UP, 2),
    Channel.FLOW_OCCLUDED_BACKWARD: (RowFilter.UP, 2),
    Channel.SCENE_FLOW: (RowFilter.SUB, 1),
    Channel.DEPTH_LAYERS: (RowFilter.SUB, 1),
    Channel.INSTANCE_LAYERS: (RowFilter.UP, 2),
    Channel.MATERIAL_LAYERS: (RowFilter.UP, 2),
    Channel.SEEN_IN_MIRROR: (RowFilter.UP, 2),
    Channel.MIRRORED_POSITION: (RowFilter.SUB, 1),
}
"""Row filter and compression level of each channel, measured on rendered images."""


def write_media(info: DatasetInfo, sample: Sample, shard_dir: Path) -> None:
    """Write every exported image channel of a sample to its ``media_path``.

    Laser scans go to their ``cloud_path``, rows of devices to their ``table_path``. A sensor
    without a reading at this sample has no file.

    Raises:
        ConfigError: a channel is not an image.
        SampleError: a depth is negative or NaN.
    """
    for sensor in info.cameras:
        reading = sample.capture.readings.get(sensor)
        if reading is None:
            continue
        for channel in info.media[sensor]:
            path = info.media_path(shard_dir, sensor, channel, sample.index)
            path.parent.mkdir(parents=True, exist_ok=True)
            image, encoding = reading.channels[channel], info.encoding(sensor, channel)
            path.write_bytes(encode_channel(channel, image, info.depth_scale_m, encoding))
    for lidar in info.lidars:
        if lidar in sample.capture.clouds:
            point_cloud_io.write_cloud(sample.capture.clouds[lidar], shard_dir, sample.index)
    for device in info.devices:
        if device in sample.capture.tables:
            measurement_tables.write_table(sample.capture.tables[device], shard_dir, sample.index)


def encode_channel(
    channel: Channel, image: NDArray[Any], depth_scale_m: float, encoding: ImageEncoding = PNG
) -> bytes:
    """Encode one channel; see the table at the top of this module.

    Args:
        channel: Channel of the image.
        image: As listed at ``Channel``.
        depth_scale_m: Metres per unit of depth and range images.
        encoding: Encoding of the file; only photographs have others than PNG.

    Raises:
        ConfigError: the channel is not an image.
        SampleError: a depth is negative or NaN.
    """
    if channel not in ENCODING:
        known = ", ".join(c.value for c in ENCODING)
        raise ConfigError(f"channel '{channel.value}' cannot be written as an image; use {known}")
    if encoding != PNG:
        return _encode_photograph(image, encoding)
    row_filter, level = ENCODING[channel]
    return encode_png(_encode_pixels(channel, image, depth_scale_m), row_filter, level)


def _encode_photograph(image: NDArray[np.uint8], encoding: ImageEncoding) -> bytes:
    """Encode an image [h, w, 3] with OpenCV, whose bytes depend on its version only."""
    quality = {
        "jpeg": cv2.IMWRITE_JPEG_QUALITY,
        "webp": cv2.IMWRITE_WEBP_QUALITY,
        "webp_lossless": cv2.IMWRITE_WEBP_QUALITY,
    }[encoding.format]
    # Above 100, OpenCV's WebP has no loss.
    value = WEBP_LOSSLESS if encoding.format == "webp_lossless" else encoding.quality
    bgr = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    _, data = cv2.imencode(encoding.suffix, bgr, [quality, value])
    return data.tobytes()


PIXELS = {
    Channel.RGB: (np.uint8, 3),
    Channel.NORMALS: (np.uint8, 3),
    Channel.OBJECT_COORDINATES: (np.uint16, 3),
    Channel.FLOW_FORWARD: (np.uint16, 3),
    Channel.FLOW_BACKWARD: (np.uint16, 3),
    Channel.FLOW_OCCLUDED_FORWARD: (np.uint8, 1),
    Channel.FLOW_OCCLUDED_BACKWARD: (np.uint8, 1),
    Channel.SCENE_FLOW: (np.uint16, 3),
    Channel.MIRRORED_POSITION: (np.uint16, 3),
}
"""Type and number of components of the pixels in a file; other channels: uint16, 1."""


def read_image(
    path: Path,
    channel: Channel,
    depth_scale_m: float,
    size_px: tuple[int, int] | None = None,
    read: Callable[[Path], bytes] = Path.read_bytes,
) -> NDArray[Any]:
    """Read one channel from its file (rounded): the inverse of ``encode_channel``.

    Args:
        path: Image file.
        channel: Channel of the image.
        depth_scale_m: Metres per unit of depth and range images.
        size_px: Expected width and height of the camera's image; None = any. Layers need it.
        read: Reads a file.

    Returns:
        Array as listed at ``Channel``, including its values for "nothing".

    Raises:
        StorageError: the file is missing, no image, or one of another channel or size.
        ValueError: layers without ``size_px``.
    """
    if channel in LAYERS and size_px is None:
        raise ValueError(f"{channel}: the height of a layer is needed to tell layers apart")
    pixels = read_pixels(path, read=read)
    kind, components = PIXELS.get(channel, (np.uint16, 1))
    width_px, height_px = size_px or (pixels.shape[1], pixels.shape[0])
    if channel in LAYERS:
        # Any number of layers, at least one.
        height_px *= max(pixels.shape[0] // height_px, 1)
    shape = (height_px, width_px) if components == 1 else (height_px, width_px, components)
    if pixels.dtype != kind or pixels.shape != shape:
        raise StorageError(
            f"{path}: holds {pixels.dtype} pixels {list(pixels.shape)}; expected "
            f"{np.dtype(kind)} {list(shape)} of channel "
            f"{channel.value}; generate the data set again"
        )
    image = _decode_pixels(channel, pixels, depth_scale_m)
    if channel in LAYERS and size_px:
        return np.moveaxis(image.reshape(-1, size_px[1], width_px), 0, -1)
    return image


def read_pixels(
    path: Path, is_bgr: bool = False, read: Callable[[Path], bytes] = Path.read_bytes
) -> NDArray[Any]:
    """Read the pixels of an image file, uint8 or uint16, [h, w] or RGB [h, w, 3].

    ``is_bgr`` is for encoders of OpenCV, which take BGR.

    Raises:
        StorageError: the file is missing or no image.
    """
    try:
        data = read(path)
    except OSError:
        data = b""
    pixels = decode_png(data, is_bgr)
    if pixels is None and data:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
        if pixels is not None and pixels.ndim == 3 and not is_bgr:
            pixels = cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB)
    if pixels is None:
        raise StorageError(f"{path}: missing or no image file; generate the data set again")
    return pixels


def _decode_pixels(channel: Channel, pixels: NDArray[Any], depth_scale_m: float) -> NDArray[Any]:
    """Convert the pixels of a PNG to physical values."""
    match channel:
        case Channel.Z_DEPTH | Channel.RANGE | Channel.MEASURED_DEPTH | Channel.DEPTH_LAYERS:
            return np.asarray(depths_of_units(depth_scale_m)[pixels])
        case Channel.DISPARITY | Channel.DISPARITY_VISIBLE:
            return np.asarray(pixels / 256.0, np.float32)
        case Channel.FLOW_FORWARD | Channel.FLOW_BACKWARD:
            return _decode_signed(pixels, 1.0 / FLOW_UNITS_PER_PX)[..., :2]
        case Channel.SCENE_FLOW | Channel.MIRRORED_POSITION:
            return _decode_signed(pixels, DEPTHS_PER_UNIT[channel] * depth_scale_m)
        case Channel.FLOW_OCCLUDED_FORWARD | Channel.FLOW_OCCLUDED_BACKWARD:
            return np.asarray(pixels > 0, np.uint8)
        case Channel.NORMALS:
            unit = np.where(pixels == NO_NORMAL, 0.0, pixels / 127.5 - 1.0)
            length = np.linalg.norm(unit, axis=-1, keepdims=True)
            np.divide(unit, length, out=unit, where=length > 0.0)
            return np.asarray(unit, np.float32)
        case Channel.OBJECT_COORDINATES:
            return np.asarray(pixels / 65_535.0, np.float32)
        case _:
            return pixels


@cache
def depths_of_units(depth_scale_m: float) -> NDArray[np.float32]:
    """Depth [m] of every value of a 16-bit image, [65536]; inf for 0. Read-only."""
    units = np.arange(DEPTH_UNITS_MAX + 1)
    table = np.where(units > 0, units * depth_scale_m, np.inf).astype(np.float32)
    table.flags.writeable = False
    return table


def _decode_signed(pixels: NDArray[Any], unit: float) -> NDArray[np.float32]:
    """Invert ``_signed_units``: NaN where all three values are 0."""
    values = (pixels.astype(np.float64) - SIGNED_ZERO) * unit
    return np.where((pixels == 0).all(axis=-1, keepdims=True), np.nan, values).astype(np.float32)


def depth_units(depth_m: NDArray[np.floating], depth_scale_m: float) -> UInt16:
    """Depth in units of ``depth_scale_m``, half to even; 0 = nothing or out of range.

    Raises:
        SampleError: a depth is negative or NaN.
    """
    if not (depth_m >= 0).all():
        raise SampleError("a depth image holds a negative number or NaN; 'nothing' must be inf")
    units: NDArray[np.float64] = np.divide(depth_m, depth_scale_m, dtype=np.float64)
    np.rint(units, out=units)
    units[units > DEPTH_UNITS_MAX] = 0
    return units.astype(np.uint16)


def disparity_units(disparity_px: NDArray[np.floating]) -> UInt16:
    """Disparity in 1/256 px, half to even; 0 = nothing or out of range.

    A positive disparity that would round to 0 becomes 1, as 0 means nothing.
    """
    units = np.rint(disparity_px * 256.0)
    units = np.where(disparity_px > 0.0, np.maximum(units, 1.0), 0.0)
    return np.where(units > DEPTH_UNITS_MAX, 0.0, units).astype(np.uint16)


def flow_units(flow_px: NDArray[np.floating]) -> UInt16:
    """Flow in 1/64 px, offset by 32768, and a 1, uint16 [h, w, 3]; all 0 without flow."""
    units = _signed_units(flow_px, 1.0 / FLOW_UNITS_PER_PX)
    valid = (units > 0).any(axis=-1, keepdims=True)
    return np.concatenate([units, valid.astype(np.uint16)], axis=-1)


def _signed_units(values: NDArray[np.floating], unit: float) -> UInt16:
    """Vectors [..., n] in units, offset by 32768, half to even; all 0 for NaN or out of range."""
    units = np.rint(np.divide(values, unit, dtype=np.float64))
    # NaN compares false, so it becomes 0.
    known = (np.abs(units) < SIGNED_ZERO).all(axis=-1, keepdims=True)
    return np.where(known, units + SIGNED_ZERO, 0.0).astype(np.uint16)


def link_or_copy(source: Path, target: Path) -> None:
    """Link a file to a second path, or copy it if the file system has no hard links.

    Creates the target's folder; the target itself must not exist.
    """
    try:
        try:
            os.link(source, target)
        except FileNotFoundError:
            target.parent.mkdir(parents=True, exist_ok=True)
            os.link(source, target)
    except (FileExistsError, FileNotFoundError):
        raise
    except OSError:  # another file system, one without links, or too many links to the file
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)


def _encode_pixels(channel: Channel, image: NDArray[Any], depth_scale_m: float) -> NDArray[Any]:
    if channel in LAYERS:
        image = np.moveaxis(image, -1, 0).reshape(-1, image.shape[1])
    convert: dict[Channel, Callable[[], NDArray[Any]]] = {
        Channel.RGB: lambda: image,
        Channel.Z_DEPTH: lambda: depth_units(image, depth_scale_m),
        Channel.RANGE: lambda: depth_units(image, depth_scale_m),
        Channel.MEASURED_DEPTH: lambda: depth_units(image, depth_scale_m),
        Channel.DEPTH_LAYERS: lambda: depth_units(image, depth_scale_m),
        Channel.DISPARITY: lambda: disparity_units(image),
        Channel.DISPARITY_VISIBLE: lambda: disparity_units(image),
        Channel.FLOW_FORWARD: lambda: flow_units(image),
        Channel.FLOW_BACKWARD: lambda: flow_units(image),
        Channel.FLOW_OCCLUDED_FORWARD: lambda: image * np.uint8(255),
        Channel.FLOW_OCCLUDED_BACKWARD: lambda: image * np.uint8(255),
        Channel.SCENE_FLOW: lambda: _signed_units(image, depth_scale_m),
        Channel.MIRRORED_POSITION: lambda: _signed_units(
            image, DEPTHS_PER_UNIT[channel] * depth_scale_m
        ),
        Channel.NORMALS: lambda: np.rint((image + 1.0) * 0.5 * 255.0).astype(np.uint8),
        # Boxes are rounded to a micrometre: a surface may lie that much outside [0, 1], and
        # 65536 would wrap to 0.
        Channel.OBJECT_COORDINATES: lambda: np.rint(np.clip(image, 0, 1) * 65_535).astype(
            np.uint16
        ),
    }
    return convert.get(channel, lambda: image)()


def link_photograph(
    info: DatasetInfo, shard_dir: Path, image: Mapping[str, Any], target: Path
) -> None:
    """Link the photograph of a row with ``sensor`` and ``sample``; see ``link_or_copy``."""
    source = info.media_path(shard_dir, image["sensor"], Channel.RGB, image["sample"])
    link_or_copy(source, target)
