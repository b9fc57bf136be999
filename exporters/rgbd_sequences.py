"""Base of formats with colour and depth images of one moving pinhole camera."""

from abc import abstractmethod
from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo, media_path
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import Sample
from gen_data.exporters.base import ExporterBase
from gen_data.exporters.image_files import depth_units, read_image
from gen_data.exporters.png import RowFilter, encode_png
from gen_data.exporters.sensor_selection import pinhole_camera
from gen_data.exporters.sequences import frame_facts, write_frames


class RgbdExporter(ExporterBase):
    """An exporter of one camera with the rgb and depth channels.

    Attributes:
        camera: Sensor of the images; empty = the first one, by name, with the rgb channel.
    """

    channels: ClassVar[tuple[Channel, ...]] = (Channel.Z_DEPTH,)
    """Channels that the camera must write besides rgb."""
    type: str
    camera: str = ""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without such a camera.

        Raises:
            ConfigError: the camera is missing, is not a pinhole or lacks a channel.
        """
        camera = self._camera(info)
        for channel in self.channels:
            if channel not in info.media[camera]:
                raise ConfigError(
                    f"exporter '{self.type}': camera '{camera}' does not write the channel "
                    f"{channel.value}; add it to the channels of the sensor"
                )

    def _camera(self, info: DatasetInfo) -> str:
        return pinhole_camera(info, self.camera, self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the files of each frame and a line for it.

        Raises:
            ConfigError: see ``check``.
            StorageError: an image is missing.
        """
        self.check(info)
        camera = self._camera(info)
        rows = [
            frame_facts(info, sample) | self.write_frame(info, sample, camera, shard_dir)
            for sample in samples
            if camera in sample.truth
        ]
        write_frames(shard_dir / self.type, rows)

    @abstractmethod
    def write_frame(
        self, info: DatasetInfo, sample: Sample, camera: str, shard_dir: Path
    ) -> dict[str, Any]:
        """Write the files of a frame and return its line without ``frame_facts``."""


def depth_png(
    info: DatasetInfo, shard_dir: Path, camera: str, index: int, units_per_m: int
) -> bytes:
    """Encode a depth image of a shard in other units; 0 = nothing or out of range.

    Raises:
        StorageError: the image is missing.
    """
    path = media_path(shard_dir, camera, Channel.Z_DEPTH, index)
    depth_m = read_image(path, Channel.Z_DEPTH, info.depth_scale_m)
    return encode_png(depth_units(depth_m, 1.0 / units_per_m), RowFilter.SUB, 1)


def opencv_pinhole(k: Intrinsics) -> tuple[float, float, float, float]:
    """Focal lengths and principal point [px], with pixel centres at whole numbers."""
    return k.fx_px, k.fy_px, k.cx_px - 0.5, k.cy_px - 0.5
