"""KITTI's stereo and flow benchmark of 2015: rectified pairs of images, disparities and flow.

::

    training/image_2/000012_10.png      left colour image       000012_11.png  of the next step
    training/image_3/000012_10.png      right colour image      000012_11.png  of the next step
    training/disp_occ_0/000012_10.png   disparity of every pixel of image_2
    training/disp_noc_0/000012_10.png   the same where image_3 shows the point too
    training/flow_occ/000012_10.png     optical flow of every pixel of image_2 to 000012_11.png
    training/flow_noc/000012_10.png     the same where the point is still seen then
    training/calib_cam_to_cam/000012.txt
    ImageSets/{train,val,test}.txt      frame names             README.txt

* **Disparities** are 16-bit grey PNG: pixels times 256, 0 = none. They are exact at the pixel's
  centre; the point is in image_3 at x minus disparity.
* **Flow** is 16-bit RGB PNG: 64 times the pixels to the right and down, plus 32768; the third
  channel is 1 if the flow is valid. There are folders for the channels that the left camera writes.
* **Frames** are named by sample; the next step is present if the sequence has one. With flow,
  frames without a next one are left out: readers pair the k-th ``_10`` with the k-th ``_11``.
* **Calibration** is as in KITTI's raw data: ``P_rect_03`` has minus focal length times baseline.

Reference: Menze and Geiger, "Object Scene Flow for Autonomous Vehicles", CVPR 2015; its devkit.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import ClassVar, Literal

import cv2
import numpy as np

from gen_data.core import errors, stereo
from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo, media_path
from gen_data.core.sample import Sample
from gen_data.exporters import base, image_files, kitti_raw, png, sensor_selection, sequences
from gen_data.exporters.conventions import PINHOLE, Conventions

SPLITS = ("train", "val", "test")
LABELS = {Channel.DISPARITY: "disp_occ_0", Channel.DISPARITY_VISIBLE: "disp_noc_0"}
"""Folders of the left camera's channels."""
FLOWS = (Channel.FLOW_FORWARD, Channel.FLOW_OCCLUDED_FORWARD)


class KittiStereo(base.ExporterBase):
    """KITTI's stereo benchmark: pairs of colour images, and the left one's disparities."""

    type: Literal["kitti_stereo"] = "kitti_stereo"
    conventions: ClassVar[Conventions] = Conventions(pixel_centre="i", lens=PINHOLE)
    left: str = ""
    """Sensor that is image_2; empty = the first one, by name, that writes disparities."""
    right: str = ""
    """Sensor that is image_3; empty = the camera of the left one's disparities."""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: there is no pair of cameras, one is not a pinhole, or there are too many
                samples.
        """
        pair = self._pair(info).values()
        sensor_selection.check_calibrations(info, pair, self.type)
        sequences.check_frame_names(info, self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the calibration of each pair, and a line for it.

        Raises:
            ConfigError: see ``check``, or the images are not rectified.
        """
        self.check(info)
        pair = self._pair(info)
        rows = []
        for sample in samples:
            if all(name in sample.truth for name in pair.values()):
                text = self._calibration(sample, pair)
                path = shard_dir / self.type / f"calib_cam_to_cam/{sample.index:06d}.txt"
                sequences.write_text(path, text)
                if set(FLOWS) <= set(info.media[pair["02"]]):
                    data = visible_flow(shard_dir, pair["02"], sample.index)
                    sequences.write_bytes(self._flow_noc(shard_dir, sample.index), data)
                rows.append(sequences.frame_facts(info, sample))
        sequences.write_frames(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link all files of the shards into one tree and list the frames of each split."""
        pair = self._pair(info)
        frames_of: dict[str, list[str]] = {split: [] for split in SPLITS}
        # Without sequences no frame has a next one.
        is_paired = Channel.FLOW_FORWARD in info.media[pair["02"]] and info.steps_per_scene > 1
        for frames in sequences.read_sequences(shard_dirs, self.type).values():
            followers = {frame.index - 1: frame for frame in frames}
            for frame in frames:
                if is_paired and frame.index not in followers:
                    continue
                frames_of.setdefault(frame.row["split"], []).append(f"{frame.index:06d}\n")
                links = self._links(info, pair, frame, followers.get(frame.index))
                for source, target in links:
                    image_files.link_or_copy(source, dataset_dir / "training" / target)
        for split, names in frames_of.items():
            sequences.write_text(dataset_dir / f"ImageSets/{split}.txt", "".join(names))
        readme = _README.format(name=info.name, left=pair["02"], right=pair["03"])
        sequences.write_text(dataset_dir / "README.txt", readme)

    def _pair(self, info: DatasetInfo) -> dict[str, str]:
        known = sensor_selection.rgb_cameras(info)
        matched = [name for name in known if Channel.DISPARITY in info.media[name]]
        left = self.left or (matched[0] if matched else "")
        if left not in matched:
            camera = f"camera '{left}' does not write" if left else "no camera writes"
            raise errors.ConfigError(
                f"exporter '{self.type}': {camera} the channels rgb and disparity; add both to its "
                "channels and name its partner with stereo_with"
            )
        others = [name for name in known if name != left]
        partner = info.sensor(left).stereo_with
        right = self.right or partner or (others[0] if len(others) == 1 else "")
        if right not in others:
            raise errors.ConfigError(
                f"exporter '{self.type}': right: '{right}' is not another camera that writes the "
                f"rgb channel; expected one of: {', '.join(others) or 'none'}"
            )
        sensor_selection.check_partner(info, left, right, self.type)
        return {
            "02": sensor_selection.pinhole_camera(info, left, self.type),
            "03": sensor_selection.pinhole_camera(info, right, self.type),
        }

    def _calibration(self, sample: Sample, pair: Mapping[str, str]) -> str:
        left, right = (sample.scene.camera(pair[number]) for number in ("02", "03"))
        try:
            stereo.baseline_m(left, right)
        except ValueError as error:
            raise errors.ConfigError(
                f"exporter '{self.type}': cameras '{left.name}' and '{right.name}' are not a "
                f"rectified pair: {error}"
            ) from error
        reference = sequences.camera_mount(sample.scene, left.name)
        return kitti_raw.cameras_text(sample.scene, pair, reference, self.type)

    def _links(
        self,
        info: DatasetInfo,
        pair: Mapping[str, str],
        frame: sequences.Frame,
        follower: sequences.Frame | None,
    ) -> Iterator[tuple[Path, str]]:
        """Yield the files of one frame, each with its path below ``training``."""
        name = f"{frame.index:06d}"
        calibration = f"calib_cam_to_cam/{name}.txt"
        yield frame.shard_dir / self.type / calibration, calibration
        for number, camera in pair.items():
            for suffix, shown in (("10", frame), ("11", follower)):
                if shown is not None:
                    source = media_path(shown.shard_dir, camera, Channel.RGB, shown.index)
                    yield source, f"image_{int(number)}/{name}_{suffix}.png"
        for channel, folder in LABELS.items():
            if channel in info.media[pair["02"]]:
                source = media_path(frame.shard_dir, pair["02"], channel, frame.index)
                yield source, f"{folder}/{name}_10.png"
        if follower is None:
            return
        if Channel.FLOW_FORWARD in info.media[pair["02"]]:
            source = media_path(frame.shard_dir, pair["02"], Channel.FLOW_FORWARD, frame.index)
            yield source, f"flow_occ/{name}_10.png"
        if set(FLOWS) <= set(info.media[pair["02"]]):
            yield self._flow_noc(frame.shard_dir, frame.index), f"flow_noc/{name}_10.png"

    def _flow_noc(self, shard_dir: Path, index: int) -> Path:
        return shard_dir / self.type / f"flow_noc/{index:06d}.png"


def visible_flow(shard_dir: Path, camera: str, index: int) -> bytes:
    """Encode a camera's flow without points that are hidden one step later.

    Args:
        shard_dir: Folder of the shard's images.
        camera: Camera that writes ``FLOWS``.
        index: Index of the sample.
    """
    flow, hidden = (
        cv2.imread(str(media_path(shard_dir, camera, channel, index)), cv2.IMREAD_UNCHANGED)
        for channel in FLOWS
    )
    assert flow is not None, "images are written before labels"
    assert hidden is not None, "images are written before labels"
    kept = np.where(hidden[..., None] > 0, 0, flow[..., ::-1]).astype(np.uint16)
    return png.encode_png(kept, png.RowFilter.SUB, 1)


_README = """\
{name}: format of KITTI's stereo benchmark of 2015, sensors '{left}' and '{right}'

training/   All frames, or with flow all that have a next one; ImageSets/*.txt list the frames of
            each split.
image_2     RGB of '{left}'; _11 is the next step, where there is one.
image_3     RGB of '{right}'.
disp_occ_0  Disparity of image_2, 16-bit: pixels = value / 256; 0 = none, or 256 and more.
disp_noc_0  The same where image_3 shows the point too. Present if the data set keeps it.
flow_occ    Flow from _10 to _11, 16-bit RGB: pixels = (value - 32768) / 64 to the right and down;
            the third value is 1 where there is any. Present if the data set keeps it.
flow_noc    The same where the point is still seen in _11.
calib_cam_to_cam  As in KITTI's raw data, pixel centres at whole numbers; the images are rectified:
            P_rect_03 has minus focal length times baseline in its first row, last column.
"""
