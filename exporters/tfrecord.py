"""TFRecord: ``tf.train.Example`` with the keys of TensorFlow's Object Detection API.

::

    train-00000-of-00002.tfrecord     one record per image of every camera
    label_map.pbtxt                   ids and names of the categories, from 1

Keys of the API: ``image/encoded`` (PNG or JPEG), ``image/format``, ``image/height``,
``image/width``, ``image/filename``, ``image/source_id`` (COCO's image id), ``image/key/sha256``,
and by object
``image/object/bbox/{xmin,xmax,ymin,ymax}`` (fractions of width and height),
``image/object/class/{text,label}``, ``image/object/area`` (visible pixels),
``image/object/is_crowd``, ``image/object/{difficult,truncated}``. With ``masks: png``,
``image/object/mask`` has a PNG per object, 1 = visible.

An image without objects has the same keys, with empty lists. Additional keys:
``image/depth/encoded`` and the like, PNG files of the camera's other channels;
``image/sensor``, ``image/sample``, ``image/scene``, ``image/intrinsics`` (3 x 3) and
``image/T_world_camera`` (4 x 4), row by row; ``image/object/instance_id``. Images of other lenses
than a pinhole have ``image/lens/model``, ``image/lens/distortion`` (coefficients in the order of
OpenCV's functions, to be applied before the intrinsics) and ``image/lens/half_field_rad``, the
angle to the axis at which the image ends. ``image/conventions`` is JSON.

A record is its length (uint64), the masked CRC32C of the length, the data, and the masked CRC32C of
the data. Feature maps are written sorted by key: the same values give the same bytes.

References: https://www.tensorflow.org/tutorials/load_data/tfrecord#tfrecords_format_details;
tensorflow/core/example/{example,feature}.proto; https://protobuf.dev/programming-guides/encoding;
tensorflow/models, research/object_detection/core/standard_fields.py (TfExampleFields).
"""

import json
import math
import struct
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from gen_data.core import capture, serialization
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.lens import Lens
from gen_data.core.reported import reported
from gen_data.core.sample import ImageTruth, ObjectTruth, Sample
from gen_data.exporters import base, ignored_regions, png, sensor_selection, sequences
from gen_data.exporters.conventions import Conventions
from gen_data.exporters.fragments import fragment_rows, numbered_stem, write_fragment
from gen_data.exporters.lens_fields import lens_fields

IMAGES = "images"
DIFFICULT = 0.25
"""Visible fraction below which an object is difficult; the API leaves the choice to data sets."""

LABELS = "labels.bin"

FLOATS = frozenset(
    {
        *(f"image/object/bbox/{side}" for side in ("xmin", "xmax", "ymin", "ymax")),
        "image/object/area",
        "image/intrinsics",
        "image/T_world_camera",
        "image/lens/distortion",
        "image/lens/half_field_rad",
    }
)
"""Keys whose values are floats."""
INTEGERS = frozenset(
    {
        *(f"image/{name}" for name in ("height", "width", "sample", "scene")),
        *(
            f"image/object/{name}"
            for name in ("class/label", "is_crowd", "difficult", "truncated", "instance_id")
        ),
    }
)
"""Keys whose values are integers; all others are bytes. An empty list has a kind, too."""

Feature = Sequence[bytes] | Sequence[int] | Sequence[float]


class TfRecord(base.ExporterBase):
    """TFRecord files with the keys of the Object Detection API.

    Attributes:
        rows_per_file: Images in each file except the last one of a split.
        masks: Whether objects have their visible masks as PNG files.
    """

    type: Literal["tfrecord"] = "tfrecord"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5",
        box="edges of pixels as fractions of width and height",
        lens="any; `image/lens/*`",
    )

    image_formats: ClassVar[frozenset[str]] = base.PNG_OR_JPEG
    rows_per_file: int = Field(1000, ge=1)
    masks: Literal["png", "none"] = "none"

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators that it reads."""
        return frozenset({"instance_masks"} if self.masks == "png" else ())

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no sensor writes the rgb channel, or the CRC library is missing.
        """
        base.check_installed(self.type, "google_crc32c")
        sensor_selection.rgb_camera(info, "", self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the encoded labels of all images to one file, and a JSON line per image."""
        self.check(info)
        rows: list[dict[str, Any]] = []
        parts: list[bytes] = []
        offset = 0
        for sample, sensor in sensor_selection.photographs(info, samples):
            labels = encode_features(self._labels(info, sample, sensor))
            where = {"split": sample.split, "sample": sample.index, "sensor": sensor}
            rows.append(where | {"offset": offset, "size": len(labels)})
            parts.append(labels)
            offset += len(labels)
        write_fragment(shard_dir / self.type, IMAGES, rows)
        sequences.write_bytes(shard_dir / self.type / LABELS, b"".join(parts))

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Join labels and images to records, and write the label map."""
        totals = Counter(row["split"] for _, row in fragment_rows(shard_dirs, self.type, IMAGES))
        written: Counter[str] = Counter()
        dataset_dir.mkdir(parents=True, exist_ok=True)
        for shard_dir, row in fragment_rows(shard_dirs, self.type, IMAGES):
            split = row["split"]
            stem = numbered_stem(split, written[split], totals[split], self.rows_per_file)
            example = encode_example(
                self._read_labels(shard_dir, row)
                + encode_features(_images(info, shard_dir, row["sensor"], row["sample"]))
            )
            # A split's records come in order, but splits alternate: files are opened per record.
            with (dataset_dir / f"{stem}.tfrecord").open("ab") as file:
                file.write(frame_record(example))
            written[split] += 1
        sequences.write_text(dataset_dir / "label_map.pbtxt", label_map(info.categories))

    def _labels(self, info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Feature]:
        truth = sample.truth[sensor]
        visible = [thing for thing in truth.objects if thing.box is not None]
        things = list(ignored_regions.each_class(info, visible))
        labels = _image_labels(info, sample, sensor) | _object_labels(truth, things)
        if self.masks == "png":
            labels["image/object/mask"] = [_mask_png(truth, thing) for thing in things]
        return labels

    def _read_labels(self, shard_dir: Path, row: Mapping[str, Any]) -> bytes:
        with (shard_dir / self.type / LABELS).open("rb") as file:
            file.seek(row["offset"])
            return file.read(row["size"])


def _image_labels(info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Feature]:
    camera, encoding = sample.truth[sensor].camera, info.encoding(sensor, capture.Channel.RGB)
    return {
        "image/filename": [f"{sample.index:09d}_{sensor}{encoding.suffix}".encode()],
        "image/source_id": [str(sample.image_id(sensor)).encode()],
        "image/format": [encoding.format.encode()],
        "image/height": [camera.intrinsics.height_px],
        "image/width": [camera.intrinsics.width_px],
        "image/sensor": [sensor.encode()],
        "image/sample": [sample.index],
        "image/scene": [sample.scene_index],
        **_lens_labels(camera.intrinsics.lens),
        "image/intrinsics": camera.intrinsics.matrix().ravel().tolist(),
        "image/T_world_camera": reported(camera).T_world_camera.matrix().ravel().tolist(),
        "image/conventions": [serialization.canonical_json(TfRecord.conventions.facts()).encode()],
    }


def _lens_labels(lens: Lens) -> dict[str, Feature]:
    """Keys of a lens; none for a pinhole."""
    known = lens_fields(lens).get("lens")
    if known is None:
        return {}
    return {
        "image/lens/model": [known["model"].encode()],
        "image/lens/distortion": known.get("distortion", []),
        "image/lens/half_field_rad": [known.get("half_field_rad", math.pi)],
    }


def _object_labels(truth: ImageTruth, things: Sequence[ObjectTruth]) -> dict[str, Feature]:
    """Labels of visible objects: lists of equal length."""
    width, height = truth.camera.intrinsics.width_px, truth.camera.intrinsics.height_px
    boxes = [thing.box for thing in things if thing.box is not None]
    instances = [thing.instance for thing in things]
    return {
        "image/object/bbox/xmin": [box.x_min / width for box in boxes],
        "image/object/bbox/xmax": [box.x_max / width for box in boxes],
        "image/object/bbox/ymin": [box.y_min / height for box in boxes],
        "image/object/bbox/ymax": [box.y_max / height for box in boxes],
        "image/object/class/text": [thing.category.encode() for thing in instances],
        "image/object/class/label": [thing.category_id for thing in instances],
        "image/object/area": [float(thing.visible_px) for thing in things],
        "image/object/is_crowd": [int(thing.ignored) for thing in things],
        "image/object/difficult": [int(_is_difficult(thing)) for thing in things],
        "image/object/truncated": [int((thing.truncation or 0.0) > 0.0) for thing in things],
        "image/object/instance_id": [thing.instance_id for thing in instances],
    }


def _is_difficult(thing: ObjectTruth) -> bool:
    return thing.visible_fraction is not None and thing.visible_fraction < DIFFICULT


def _mask_png(truth: ImageTruth, thing: ObjectTruth) -> bytes:
    """Visible mask as a PNG file of the image's size, 1 = visible."""
    assert thing.mask is not None, "the annotation instance_masks is in `needs`"
    camera, mask = truth.camera.intrinsics, thing.mask
    pixels = np.zeros((camera.height_px, camera.width_px), np.uint8)
    rows, columns = mask.pixels.shape
    pixels[mask.y_px : mask.y_px + rows, mask.x_px : mask.x_px + columns] = mask.pixels
    return png.encode_png(pixels, png.RowFilter.UP, 1)


def _images(info: DatasetInfo, shard_dir: Path, sensor: str, index: int) -> dict[str, Feature]:
    images: dict[str, Feature] = {}
    for channel in info.media[sensor]:
        data = info.media_path(shard_dir, sensor, channel, index).read_bytes()
        if channel is capture.Channel.RGB:
            images["image/encoded"] = [data]
            images["image/key/sha256"] = [sha256(data).hexdigest().encode()]
        else:
            images[f"image/{channel.value}/encoded"] = [data]
    return images


def label_map(categories: Sequence[str]) -> str:
    """Label map of the Object Detection API, a text protobuf; ids start at 1."""
    # JSON's escapes are valid in a text protobuf.
    items = (
        f"item {{\n  id: {number}\n  name: {json.dumps(name, ensure_ascii=False)}\n}}\n"
        for number, name in enumerate(categories, 1)
    )
    return "".join(items)


def encode_example(features: bytes) -> bytes:
    """Wire format of ``tf.train.Example`` from entries of its feature map."""
    return _message(1, features)


def encode_features(
    features: Mapping[str, Feature],
    floats: Collection[str] = FLOATS,
    integers: Collection[str] = INTEGERS,
) -> bytes:
    """Wire format of entries of ``Features.feature``, sorted by key.

    Args:
        features: Values by key.
        floats: Keys whose values are floats.
        integers: Keys whose values are integers; all others are bytes.
    """
    entries = (
        _message(1, key.encode())
        + _message(2, _encode_feature(features[key], key in floats, key in integers))
        for key in sorted(features)
    )
    return b"".join(_message(1, entry) for entry in entries)


def _encode_feature(values: Feature, is_float: bool, is_integer: bool) -> bytes:
    """Wire format of a ``Feature``: a list of bytes (1), floats (2) or integers (3)."""
    if is_float:
        return _message(2, _message(1, struct.pack(f"<{len(values)}f", *values)))
    if is_integer:
        return _message(3, _message(1, b"".join(_varint(int(value)) for value in values)))
    return _message(1, b"".join(_message(1, value) for value in values if isinstance(value, bytes)))


def _message(number: int, data: bytes) -> bytes:
    """A length-delimited field: tag, size, bytes."""
    return _varint(number << 3 | 2) + _varint(len(data)) + data


def _varint(value: int) -> bytes:
    """Base-128 number, the lowest seven bits first; ``value`` is not negative."""
    data = bytearray()
    while value > 0x7F:
        data.append(value & 0x7F | 0x80)
        value >>= 7
    data.append(value)
    return bytes(data)


def frame_record(data: bytes) -> bytes:
    """One record of a TFRecord file."""
    size = struct.pack("<Q", len(data))
    return b"".join((size, _masked_crc(size), data, _masked_crc(data)))


def _masked_crc(data: bytes) -> bytes:
    import google_crc32c

    crc = google_crc32c.value(data)
    return struct.pack("<I", ((crc >> 15 | crc << 17) + 0xA282EAD8) & 0xFFFFFFFF)
