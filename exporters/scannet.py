"""ScanNet: frames of RGB-D scans as its reader exports them, with NYU-40 labels.

::

    scans/scene0003_00/color/12.jpg           8-bit colour
    scans/scene0003_00/depth/12.png           16-bit, millimetres, 0 = none
    scans/scene0003_00/pose/12.txt            T_world_camera, 4 x 4
    scans/scene0003_00/label-filt/12.png      16-bit, class of every pixel, 0 = none
    scans/scene0003_00/instance-filt/12.png   16-bit, instance of every pixel with a class
    scans/scene0003_00/intrinsic/{intrinsic,extrinsic}_{color,depth}.txt   4 x 4
    scans/scene0003_00/scene0003_00.txt       sizes and intrinsics by name
    scannetv2_{train,val,test}.txt            names of scans
    scannetv2-labels.combined.tsv             names of classes

A space is a scene of the data set and a scan one of its views. Frames are numbered from 0. Depth is
registered to the colour image: both have the same intrinsics, with pixel centres at whole
numbers. Classes are numbers of a public list from 1 (``label_maps.yaml``): NYU-40's, as ScanNet's
tools have after their mapping, or ADE20K's, as in its annotation images. Instances have the ids of
the data set, the same in all frames; ScanNet's images hold them in 8 bits, too few for large rooms.

Reference: Dai et al., "ScanNet: Richly-annotated 3D Reconstructions of Indoor Scenes", CVPR 2017;
its SensReader and its benchmark's scripts.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core.capture import Channel, ImageEncoding
from gen_data.core.interfaces import DatasetInfo, media_path
from gen_data.core.reported import reported
from gen_data.core.sample import Sample
from gen_data.core.se3 import Array
from gen_data.exporters import base, label_map, label_png, rgbd_sequences, sequences
from gen_data.exporters.conventions import PINHOLE, Conventions
from gen_data.exporters.image_files import encode_channel, link_or_copy, read_image, read_pixels

UNITS_PER_M = 1000
SPACES_MAX = 10_000
"""Names of spaces have four digits."""
JPEG = ImageEncoding("jpeg", 95)
"""Encoding of photographs that are PNG files in the data set."""
SPLITS = ("train", "val", "test")
IMAGES = {"color": ".jpg", "depth": ".png", "label-filt": ".png", "instance-filt": ".png"}


class ScanNet(rgbd_sequences.RgbdExporter):
    """ScanNet's exported frames of one camera, with a class and an instance per pixel.

    Attributes:
        camera: Sensor of the images; empty = the first one, by name, with the rgb channel.
        classes: Public list of the labels: ``nyu40`` or ``ade20k``.
    """

    image_formats: ClassVar[frozenset[str]] = base.PNG_OR_JPEG
    channels: ClassVar[tuple[Channel, ...]] = (Channel.Z_DEPTH, Channel.INSTANCE)
    type: Literal["scannet"] = "scannet"
    conventions: ClassVar[Conventions] = Conventions(pixel_centre="i", lens=PINHOLE)
    own_classes: ClassVar[bool] = True
    classes: Literal["nyu40", "ade20k"] = "nyu40"

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without such a camera, or with more scenes than names.

        Raises:
            ConfigError: see ``RgbdExporter.check``, or there are too many sequences.
        """
        super().check(info)
        sequences.check_sequence_count(info, SPACES_MAX * info.views_per_scene, self.type)

    def write_frame(
        self, info: DatasetInfo, sample: Sample, camera: str, shard_dir: Path
    ) -> dict[str, Any]:
        """Write the images in the format's units; return pose, size and calibration."""
        for kind, data in self._images(info, sample, camera, shard_dir).items():
            name = f"{kind}/{sample.index:09d}{IMAGES[kind]}"
            sequences.write_bytes(shard_dir / self.type / name, data)
        view = sample.truth[camera].camera
        k = view.intrinsics
        return {
            "pose": reported(view).T_world_camera.matrix().tolist(),
            "size_px": [k.width_px, k.height_px],
            "pinhole": rgbd_sequences.opencv_pinhole(k),
        }

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link the frames of all shards into scans and list them by split."""
        camera = self._camera(info)
        scans: dict[str, list[str]] = {split: [] for split in SPLITS}
        for number, frames in sequences.read_sequences(shard_dirs, self.type).items():
            space, scan = divmod(number, info.views_per_scene)
            name = f"scene{space:04d}_{scan:02d}"
            folder = dataset_dir / "scans" / name
            scans.setdefault(frames[0].row["split"], []).append(f"{name}\n")
            for k, frame in enumerate(frames):
                for kind, suffix in IMAGES.items():
                    source = frame.shard_dir / self.type / f"{kind}/{frame.index:09d}{suffix}"
                    if kind == "color" and _has_jpeg(info, camera):
                        source = info.media_path(frame.shard_dir, camera, Channel.RGB, frame.index)
                    link_or_copy(source, folder / kind / f"{k}{suffix}")
                sequences.write_text(
                    folder / f"pose/{k}.txt", matrix_text(np.array(frame.row["pose"]))
                )
            for path, text in camera_texts(frames[0].row, len(frames)).items():
                sequences.write_text(folder / path.format(name=name), text)
        for split, names in scans.items():
            sequences.write_text(dataset_dir / f"scannetv2_{split}.txt", "".join(names))
        sequences.write_text(
            dataset_dir / "scannetv2-labels.combined.tsv", label_table(self.classes)
        )

    def _images(
        self, info: DatasetInfo, sample: Sample, camera: str, shard_dir: Path
    ) -> Mapping[str, bytes]:
        """Files of a frame by kind; no photograph if the shard has it as JPEG."""
        path = media_path(shard_dir, camera, Channel.INSTANCE, sample.index)
        ids = read_image(path, Channel.INSTANCE, info.depth_scale_m)
        labels = classes_of_instances(sample, camera, self.classes, int(ids.max(initial=0)))
        instances = np.where(labels > 0, np.arange(len(labels)), 0).astype(np.uint16)
        images = {
            "depth": rgbd_sequences.depth_png(info, shard_dir, camera, sample.index, UNITS_PER_M),
            "label-filt": label_png.encode_label_png(ids, labels),
            "instance-filt": label_png.encode_label_png(ids, instances),
        }
        if not _has_jpeg(info, camera):
            photo = read_pixels(media_path(shard_dir, camera, Channel.RGB, sample.index))
            images["color"] = encode_channel(Channel.RGB, photo, info.depth_scale_m, JPEG)
        return images


def classes_of_instances(
    sample: Sample, camera: str, classes: str, largest: int
) -> NDArray[np.uint16]:
    """Class number of every instance id up to the largest, uint16 [n]; 0 = none or ignored."""
    scene, numbers = sample.scene_of(camera), class_numbers(classes)
    largest = max(largest, max((i.instance_id for i in scene.instances), default=0))
    labels = np.zeros(largest + 1, np.uint16)
    for instance in scene.instances:
        labels[instance.instance_id] = numbers.get(instance.category, 0)
    for thing in sample.truth[camera].objects:
        if thing.ignored:
            labels[thing.instance.instance_id] = 0
    return labels


@lru_cache(maxsize=4)
def class_numbers(classes: str) -> Mapping[str, int]:
    """Number, from 1, of the class of each category in a public list."""
    listed = enumerate(label_map.public_classes(classes).items(), 1)
    return {category: k for k, (name, own) in listed for category in own or (name,)}


def label_table(classes: str) -> str:
    """A row per class, in the columns of ScanNet's table that its scripts read."""
    head = f"id\traw_category\tcategory\t{classes}id\t{classes}class\n"
    rows = (
        f"{k}\t{n}\t{n}\t{k}\t{n}\n" for k, n in enumerate(label_map.public_classes(classes), 1)
    )
    return head + "".join(rows)


def camera_texts(row: Mapping[str, Any], frame_count: int) -> Mapping[str, str]:
    """Calibration files of a scan by path; the same for colour and depth."""
    fx, fy, cx, cy = row["pinhole"]
    matrix = np.eye(4)
    matrix[0, 0], matrix[1, 1], matrix[:2, 2] = fx, fy, (cx, cy)
    identity, texts = np.eye(4), {}
    facts: dict[str, object] = {"axisAlignment": " ".join(f"{v:g}" for v in identity.ravel())}
    for kind in ("color", "depth"):
        texts[f"intrinsic/intrinsic_{kind}.txt"] = matrix_text(matrix)
        texts[f"intrinsic/extrinsic_{kind}.txt"] = matrix_text(identity)
        facts |= {f"{kind}Width": row["size_px"][0], f"{kind}Height": row["size_px"][1]}
        facts |= {f"fx_{kind}": fx, f"fy_{kind}": fy, f"mx_{kind}": cx, f"my_{kind}": cy}
        facts[f"num{kind.capitalize()}Frames"] = frame_count
    texts["{name}.txt"] = "".join(f"{key} = {facts[key]}\n" for key in sorted(facts))
    return texts


def matrix_text(matrix: Array) -> str:
    """A row per line, to a nanometre."""
    return "".join(" ".join(f"{v + 0.0:.9f}" for v in row) + "\n" for row in matrix.tolist())


def _has_jpeg(info: DatasetInfo, camera: str) -> bool:
    return info.encoding(camera, Channel.RGB).format == "jpeg"
