"""Base of formats with colour and depth images of one moving pinhole camera."""

from abc import abstractmethod
from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar

from gen_data.core import capture, intrinsics
from gen_data.core.interfaces import DatasetInfo, media_path
from gen_data.core.sample import Sample
from gen_data.exporters import base, image_files, png, sensor_selection, sequences


class RgbdExporter(base.ExporterBase):
    """An exporter of one camera with the rgb and depth channels.

    Attributes:
        camera: Sensor of the images; empty = the first one, by name, with the rgb channel.
    """

    channels: ClassVar[tuple[capture.Channel, ...]] = (capture.Channel.Z_DEPTH,)
    """Channels that the camera must write besides rgb."""
    type: str
    camera: str = ""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without such a camera.

        Raises:
            ConfigError: the camera is missing, is not a pinhole or lacks a channel.
        """
        sensor_selection.require_channels(info, self._camera(info), self.channels, self.type)

    def _camera(self, info: DatasetInfo) -> str:
        return sensor_selection.pinhole_camera(info, self.camera, self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the files of each frame and a line for it.

        Raises:
            ConfigError: see ``check``.
            StorageError: an image is missing.
        """
        self.check(info)
        camera = self._camera(info)
        rows = [
            sequences.frame_facts(info, sample) | self.write_frame(info, sample, camera, shard_dir)
            for sample in samples
            if camera in sample.truth
        ]
        sequences.write_frames(shard_dir / self.type, rows)

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
    path = media_path(shard_dir, camera, capture.Channel.Z_DEPTH, index)
    depth_m = image_files.read_image(path, capture.Channel.Z_DEPTH, info.depth_scale_m)
    return png.encode_png(image_files.depth_units(depth_m, 1.0 / units_per_m), png.RowFilter.SUB, 1)


def opencv_pinhole(k: intrinsics.Intrinsics) -> tuple[float, float, float, float]:
    """Focal lengths and principal point [px], with pixel centres at whole numbers."""
    return k.fx_px, k.fy_px, k.cx_px - 0.5, k.cy_px - 0.5
