"""TUM RGB-D benchmark: colour and depth images named by their time, and the camera's trajectory.

::

    <split>/000003/rgb/0.100000.png      8-bit colour
    <split>/000003/depth/0.100000.png    16-bit, 5000 units per metre, 0 = none
    <split>/000003/rgb.txt  depth.txt    timestamp filename
    <split>/000003/groundtruth.txt       timestamp tx ty tz qx qy qz qw
    <split>/000003/accelerometer.txt     timestamp ax ay az; with an IMU
    <split>/000003/calibration.txt       fx fy cx cy

Folders are sequences. Timestamps are seconds from the start of the sequence's scene. The pose is
the colour camera's optical centre in the world (X right, Y down, Z forward). Depth is
z-depth, registered to the colour image; surfaces beyond 13.1 m have none. The principal point has
pixel centres at whole numbers. Accelerations [m/s^2] are specific forces along the IMU's axes.
With a wrong clock, images have reported times, and the trajectory has true ones.

Reference: Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012, and the
benchmark's page on file formats; DROID-SLAM and DPVO read ``calibration.txt``.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

from gen_data.core import capture, errors
from gen_data.core.interfaces import DatasetInfo, media_path
from gen_data.core.sample import Sample
from gen_data.exporters import image_files, measurement_tables, rgbd_sequences, sensor_selection
from gen_data.exporters.conventions import PINHOLE, READING, Conventions
from gen_data.exporters.sequences import Frame, read_sequences, write_bytes, write_text

UNITS_PER_M = 5000
FORCES = ("force_x_m_s2", "force_y_m_s2", "force_z_m_s2")


class TumRgbd(rgbd_sequences.RgbdExporter):
    """TUM's RGB-D benchmark: a folder per sequence of one camera.

    Attributes:
        camera: Sensor of the images; empty = the first one, by name, with the rgb channel.
        imu: Sensor of ``accelerometer.txt``; empty = the first IMU, by name, if there is one.
    """

    type: Literal["tum_rgbd"] = "tum_rgbd"
    conventions: ClassVar[Conventions] = Conventions(pixel_centre="i", lens=PINHOLE, time=READING)
    imu: str = ""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: the camera is missing, is not a pinhole or has no depth, or there is no
                such IMU.
        """
        super().check(info)
        self._imu(info)

    def write_frame(
        self, info: DatasetInfo, sample: Sample, camera: str, shard_dir: Path
    ) -> dict[str, Any]:
        """Write depth in the format's units; return time, pose and calibration."""
        data = rgbd_sequences.depth_png(info, shard_dir, camera, sample.index, UNITS_PER_M)
        write_bytes(shard_dir / self.type / f"{sample.index:09d}.png", data)
        view = sample.truth[camera].camera
        w, *xyz = view.T_world_camera.quaternion_wxyz
        return {
            **sensor_selection.times(sample, camera),
            "pose": [*view.T_world_camera.translation_m, *xyz, w],
            "calibration": rgbd_sequences.opencv_pinhole(view.intrinsics),
        }

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link the images of all shards and list the frames of each sequence."""
        camera, imu = self._camera(info), self._imu(info)
        folders: dict[int, Path] = {}
        for number, frames in read_sequences(shard_dirs, self.type).items():
            folder = folders[number] = dataset_dir / frames[0].row["split"] / f"{number:06d}"
            for frame in frames:
                name = f"{_time(sensor_selection.row_stamp_s(frame.row))}.png"
                rgb = media_path(frame.shard_dir, camera, capture.Channel.RGB, frame.index)
                image_files.link_or_copy(rgb, folder / "rgb" / name)
                depth = frame.shard_dir / self.type / f"{frame.index:09d}.png"
                image_files.link_or_copy(depth, folder / "depth" / name)
            for name, text in sequence_texts(frames).items():
                write_text(folder / name, text)
        for number, rows in measurement_tables.sequence_rows(info, shard_dirs, imu) if imu else ():
            if number in folders:
                lines = (_line(row["time_s"], [row[name] for name in FORCES]) for row in rows)
                text = "# specific forces\n# file: accelerometer\n# timestamp ax ay az\n"
                write_text(folders[number] / "accelerometer.txt", text + "".join(lines))

    def _imu(self, info: DatasetInfo) -> str:
        known = [name for name, kind in info.devices.items() if kind == "imu"]
        if self.imu and self.imu not in known:
            raise errors.ConfigError(
                f"exporter '{self.type}': there is no IMU '{self.imu}'; expected one of: "
                f"{', '.join(known) or 'none'}{errors.did_you_mean(self.imu, known)}"
            )
        return self.imu or next(iter(known), "")


def sequence_texts(frames: Sequence[Frame]) -> Mapping[str, str]:
    """Text files of one sequence, by name."""
    rows: list[Mapping[str, Any]] = [frame.row for frame in frames]
    stamps = [_time(sensor_selection.row_stamp_s(row)) for row in rows]
    texts = {
        f"{kind}.txt": f"# {title}\n# file: {kind}\n# timestamp filename\n"
        + "".join(f"{stamp} {kind}/{stamp}.png\n" for stamp in stamps)
        for kind, title in (("rgb", "color images"), ("depth", "depth maps"))
    }
    head = "# ground truth trajectory\n# file: groundtruth\n# timestamp tx ty tz qx qy qz qw\n"
    poses = "".join(_line(row["time_s"], row["pose"]) for row in rows)
    calibration = " ".join(f"{v:.9g}" for v in rows[0]["calibration"]) + "\n"
    return {**texts, "groundtruth.txt": head + poses, "calibration.txt": calibration}


def _line(time_s: float, values: Iterable[float]) -> str:
    return " ".join([_time(time_s), *(f"{float(v) + 0.0:.9f}" for v in values)]) + "\n"


def _time(time_s: float) -> str:
    """A timestamp in microseconds, as in the benchmark's names."""
    return f"{float(time_s) + 0.0:.6f}"
