"""TFRecord export, read by the package tfrecord; sums by the package crc32c."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any

import crc32c
import numpy as np
import pytest
from PIL import Image
from tfrecord.reader import tfrecord_iterator

from gen_data.exporters import tfrecord
from gen_data.exporters.tfrecord import TfRecord, encode_features, frame_record, label_map


@pytest.fixture(scope="module")
def dataset(world: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Seven frames of a street with masks, at most two in a file."""
    folder = tmp_path_factory.mktemp("tfrecord")
    exporter = TfRecord(rows_per_file=2, masks="png")
    return world.export(exporter, world.info(7), world.samples, folder)


def features(data: bytes) -> dict[str, tuple[str, list[Any]]]:
    """Kind and values by key, parsed by protobuf."""
    from tfrecord import example_pb2

    example = example_pb2.Example()
    example.ParseFromString(data)
    found = {}
    for key, feature in example.features.feature.items():
        kind = feature.WhichOneof("kind")
        found[key] = (kind, list(getattr(feature, kind).value))
    return found


def records(path: Path) -> list[dict[str, tuple[str, list[Any]]]]:
    """Features of all records of a file; the reader has one buffer for all of them."""
    return [features(bytes(record)) for record in tfrecord_iterator(str(path))]


def sums_are_right(path: Path) -> bool:
    """Whether both sums of every record are those of crc32c, masked."""
    data, position = path.read_bytes(), 0
    while position < len(data):
        (size,) = struct.unpack_from("<Q", data, position)
        body = data[position + 12 : position + 12 + size]
        for content, place in ((data[position : position + 8], 8), (body, 12 + size)):
            crc = crc32c.crc32c(content)
            masked = (((crc >> 15) | (crc << 17)) + 0xA282EAD8) & 0xFFFFFFFF
            if data[position + place : position + place + 4] != struct.pack("<I", masked):
                return False
        position += 16 + size
    return position == len(data)


def faults(folder: Path, world: Any) -> list[str]:
    """Differences between the records of the train split and the samples."""
    paths = sorted(folder.glob("train-*.tfrecord"))
    if not all(map(sums_are_right, paths)):
        return ["crc"]
    found = [record for path in paths for record in records(path)]
    expected = [s for s in world.samples if s.split == "train"]
    ids = [record["image/source_id"][1] for record in found]
    if ids != [[str(s.image_id("color")).encode()] for s in expected]:
        return [f"source_id {ids}"]
    return [
        fault
        for record, sample in zip(found, expected, strict=True)
        for fault in record_faults(record, sample, world)
    ]


def record_faults(record: dict[str, Any], sample: Any, world: Any) -> list[str]:
    found = []
    visible = [t for t in sample.truth["color"].objects if t.box is not None]
    (height,), (width,) = record["image/height"][1], record["image/width"][1]
    image = np.asarray(Image.open(io.BytesIO(record["image/encoded"][1][0])))
    if image.shape != (height, width, 3):
        found.append("size")
    kinds = {record[f"image/object/bbox/{side}"][0] for side in ("xmin", "xmax", "ymin", "ymax")}
    if kinds != {"float_list"} or record["image/object/class/label"][0] != "int64_list":
        found.append(f"kinds {kinds}")
        return found
    sides = zip(
        *(record[f"image/object/bbox/{side}"][1] for side in ("xmin", "ymin", "xmax", "ymax")),
        strict=True,
    )
    boxes = [np.round(np.multiply(box, [width, height, width, height]), 3) for box in sides]
    truth = [[t.box.x_min, t.box.y_min, t.box.x_max, t.box.y_max] for t in visible]
    if not np.array_equal(np.reshape(boxes, (-1, 4)), np.reshape(truth, (-1, 4))):
        found.append("boxes")
    names = [world.categories[k - 1].encode() for k in record["image/object/class/label"][1]]
    if names != record["image/object/class/text"][1]:
        found.append("labels")
    if names != [t.instance.category.encode() for t in visible]:
        found.append("categories")
    masks = [np.asarray(Image.open(io.BytesIO(m))) for m in record["image/object/mask"][1]]
    for thing, mask in zip(visible, masks, strict=True):
        if not np.array_equal(mask == 1, image[..., 1] == 20 * thing.instance.instance_id):
            found.append(f"mask {thing.instance.instance_id}")
    return found


def test_records_hold_images_boxes_and_masks(dataset: Path, world: Any) -> None:
    """Every sum is right; the empty frame has all keys with empty lists."""
    assert faults(dataset, world) == []
    assert sorted(p.name for p in dataset.iterdir()) == [
        "label_map.pbtxt",
        *(f"train-{k:05d}-of-00003.tfrecord" for k in range(3)),
        "val-00000-of-00001.tfrecord",
    ]


def test_other_channels_are_additional_keys(dataset: Path) -> None:
    """PNG files, as in the shard."""
    record, _ = records(dataset / "val-00000-of-00001.tfrecord")

    (depth,) = record["image/depth/encoded"][1]
    shard = dataset.parent / "shards/000000"
    assert depth == (shard / "color/depth/000000002.png").read_bytes()
    assert len(record["image/T_world_camera"][1]) == 16


def test_the_label_map_counts_from_one() -> None:
    """Names are quoted."""
    text = label_map(("car", 'a "b"'))

    assert text == 'item {\n  id: 1\n  name: "car"\n}\nitem {\n  id: 2\n  name: "a \\"b\\""\n}\n'


def test_sums_of_the_specification() -> None:
    """RFC 3720, B.4: CRC32C of 32 zero bytes is AA 36 91 8A; numbers up to 2**63."""
    record = frame_record(bytes(32))

    crc = 0x8A9136AA
    masked = (((crc >> 15) | (crc << 17)) + 0xA282EAD8) & 0xFFFFFFFF
    assert record[-4:] == struct.pack("<I", masked)
    size = 2**63 - 1
    data = tfrecord.encode_example(encode_features({"image/sample": [size]}))
    assert features(data) == {"image/sample": ("int64_list", [size])}
