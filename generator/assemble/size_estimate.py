"""Size of a data set on disk, estimated from its configuration."""

from typing import Any

from gen_data.assemble.config import Config
from gen_data.core.capture import POINT
from gen_data.core.interfaces import DatasetInfo

BYTES_PER_PIXEL = {
    "rgb": 1.3,
    "depth": 0.75,
    "range": 0.75,
    "instance": 0.01,
    "part": 0.01,
    "category": 0.01,
    "normals": 0.5,
    "object_coordinates": 0.6,
    "measured_depth": 0.9,
    "infrared": 1.2,
    "depth_layers": 0.8,
    "instance_layers": 0.1,
    "material_layers": 0.1,
    "seen_in_mirror": 0.01,
    "mirrored_position": 0.3,
}
"""Sizes of PNG files, measured on tabletop and street; other channels are taken as 1."""

RECORDS_BYTES = 96_000
"""Scene and labels of a sample, its entries in records, sums and exports.

The largest that tabletop has, in a data set of few samples. Views of one scene share most of it.
"""
FILE_BYTES = 4_096
"""Least space of a file: one block."""


def estimate_image_bytes(config: Config, info: DatasetInfo) -> float:
    """Bytes of the images of a sample."""
    total = 0.0
    for sensor in config.sensors:
        size_px = getattr(sensor, "size_px", None)
        if size_px is not None:
            channels = info.sensor(sensor.name).channels
            rates = (BYTES_PER_PIXEL.get(channel.value, 1.0) for channel in channels)
            total += size_px[0] * size_px[1] * sum(rates) + FILE_BYTES * len(channels)
    return total


def estimate_point_bytes(config: Config) -> float:
    """Bytes of the laser scans of a sample, as if every ray had one return."""
    sizes_px = {s.name: s.size_px for s in config.sensors if hasattr(s, "size_px")}
    scanners: list[Any] = [s for s in config.sensors if hasattr(s, "count_rays")]
    total: float = sum(
        POINT.itemsize * scanner.count_rays(sizes_px.get(scanner.camera, (0, 0))) + FILE_BYTES
        for scanner in scanners
    )
    return total


def estimate_sample_bytes(config: Config, info: DatasetInfo) -> float:
    """Bytes of a sample with images, points, scene and labels."""
    return estimate_image_bytes(config, info) + estimate_point_bytes(config) + RECORDS_BYTES
