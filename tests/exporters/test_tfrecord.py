"""TFRecord export, read by the package tfrecord; sums by the package crc32c."""

import struct
from pathlib import Path
from typing import Any

import crc32c

from gen_data.exporters import tfrecord
from gen_data.exporters.tfrecord import TfRecord, encode_features, frame_record, label_map
from tests.exporters.datasets import made_of
from tests.exporters.label_readers import features, records

dataset = made_of(TfRecord(rows_per_file=2, masks="png"))


def sums_are_right(path: Path) -> bool:
    """Whether both sums of every record are as crc32c has them, masked."""
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


def test_records_have_the_apis_keys_and_kinds_and_other_channels(dataset: Path, world: Any) -> None:
    """Every sum is right, values have the kinds of the API, and ids are COCO's."""
    paths = sorted(dataset.glob("*.tfrecord"))
    assert all(map(sums_are_right, paths))
    found = [record for path in paths for record in records(path)]
    ids = {int(record["image/source_id"][1][0]) for record in found}
    assert ids == {sample.image_id("color") for sample in world.samples}
    for record in found:
        for side in ("xmin", "xmax", "ymin", "ymax"):
            assert record[f"image/object/bbox/{side}"][0] == "float_list"
        kind, labels = record["image/object/class/label"]
        assert kind == "int64_list"
        texts = [text.decode() for text in record["image/object/class/text"][1]]
        assert [world.categories[k - 1] for k in labels] == texts
    assert sorted(p.name for p in dataset.iterdir()) == [
        "label_map.pbtxt",
        *(f"train-{k:05d}-of-00003.tfrecord" for k in range(3)),
        "val-00000-of-00001.tfrecord",
    ]
    # PNG files, as in the shard.
    record, _ = records(dataset / "val-00000-of-00001.tfrecord")
    (depth,) = record["image/depth/encoded"][1]
    shard = dataset.parent / "shards/000000"
    assert depth == (shard / "color/depth/000000002.png").read_bytes()
    assert len(record["image/T_world_camera"][1]) == 16


def test_sums_are_of_the_specification_and_the_label_map_counts_from_one() -> None:
    """RFC 3720, B.4: CRC32C of 32 zero bytes is AA 36 91 8A; numbers up to 2**63."""
    record = frame_record(bytes(32))
    crc = 0x8A9136AA
    masked = (((crc >> 15) | (crc << 17)) + 0xA282EAD8) & 0xFFFFFFFF
    assert record[-4:] == struct.pack("<I", masked)
    size = 2**63 - 1
    data = tfrecord.encode_example(encode_features({"image/sample": [size]}))
    assert features(data) == {"image/sample": ("int64_list", [size])}
    text = label_map(("car", 'a "b"'))
    assert text == 'item {\n  id: 1\n  name: "car"\n}\nitem {\n  id: 2\n  name: "a \\"b\\""\n}\n'
