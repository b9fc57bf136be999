"""Photographs as JPEG and WebP: files that other decoders read, in every format that takes them."""

import configparser
import io
import json
import logging
import tarfile
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
from PIL import Image

from gen_data.core.capture import PNG, Channel, ImageEncoding
from gen_data.core.errors import ConfigError
from gen_data.exporters import TABLE
from gen_data.exporters.base import check_image_formats
from gen_data.exporters.coco import Coco
from gen_data.exporters.croissant import Croissant
from gen_data.exporters.hdf5 import Hdf5
from gen_data.exporters.image_files import encode_channel, read_image
from gen_data.exporters.kitti import Kitti
from gen_data.exporters.motchallenge import MotChallenge
from gen_data.exporters.nuscenes import NuScenes
from gen_data.exporters.voc import Voc
from gen_data.runner.stored import ImageFiles
from gen_data.sensors.camera.rgb_encoding import RgbEncoding
from tests.exporters.drives import drive_info
from tests.exporters.label_readers import json_lines, parquet, records
from tests.exporters.test_mcap import messages

JPEG, WEBP = (ImageEncoding(kind, 92) for kind in ("jpeg", "webp"))
LOSSLESS = ImageEncoding("webp_lossless")
ERROR_MAX = 4.0
"""Mean difference to the rendered image, of 255; other images differ by more than 20."""
MAGIC = {".jpg": b"\xff\xd8\xff", ".webp": b"RIFF"}


@pytest.fixture(params=[JPEG, WEBP, LOSSLESS], ids=lambda encoding: encoding.format)
def encoding(request: Any) -> ImageEncoding:
    return request.param


@pytest.fixture
def info(world: Any, encoding: ImageEncoding) -> Any:
    return encoded(world.info(7), encoding)


def encoded(info: Any, encoding: ImageEncoding) -> Any:
    sensors = (replace(s, rgb_encoding=encoding) if s.channels else s for s in info.sensors)
    return replace(info, sensors=tuple(sensors))


def photograph() -> Any:
    """A smooth image with edges and saturated colours."""
    rows, columns = np.indices((96, 128), dtype=np.float64)
    image = np.stack([2 * columns, 2.5 * rows, 255 - columns - rows], axis=-1)
    image[30:60, 40:90] = (250, 10, 30)
    return np.clip(image, 0, 255).astype(np.uint8)


def test_photographs_come_back(tmp_path: Path, encoding: ImageEncoding) -> None:
    """Channels in order; without loss where the format has none; depth stays exact."""
    image = photograph()
    path = tmp_path / f"image{encoding.suffix}"
    path.write_bytes(encode_channel(Channel.RGB, image, 0.001, encoding))
    assert path.read_bytes().startswith(MAGIC[encoding.suffix])
    read = read_image(path, Channel.RGB, 0.001)
    error = np.abs(read.astype(int) - image)
    assert error.mean() <= (0 if encoding is LOSSLESS else 2)
    assert encode_channel(Channel.RGB, image, 0.001, encoding) == path.read_bytes()


def test_quality_changes_the_size_and_formats_without_loss_have_none() -> None:
    """Of both formats with a loss; the best is larger than the worst."""
    image = photograph()
    for kind in ("jpeg", "webp"):
        encodings = [RgbEncoding(format=kind, quality=q).described() for q in (10, 95)]
        sizes = [len(encode_channel(Channel.RGB, image, 0.001, e)) for e in encodings]
        assert sizes[0] < 0.7 * sizes[1]
    # The error names the formats that have one.
    assert RgbEncoding().described() == PNG
    for kind in ("png", "webp_lossless"):
        with pytest.raises(ValueError, match="leave out quality, or use jpeg or webp"):
            RgbEncoding(format=kind, quality=90)


def test_stored_images_are_read_and_other_formats_refuse_them_with_a_remedy(
    tmp_path: Path, info: Any, world: Any, encoding: ImageEncoding
) -> None:
    """Photographs have the encoding's ending, labels stay PNG; both are read again."""
    folder = world.export(Coco(), info, world.samples[:1], tmp_path)
    shard = folder.parent / "shards/000000"
    assert (shard / f"color/rgb/000000000{encoding.suffix}").exists()
    assert (shard / "color/instance/000000000.png").exists()
    made = world.samples[0].capture.readings["color"]
    stored = ImageFiles(info, shard, made.camera, 0)
    np.testing.assert_array_equal(stored[Channel.INSTANCE], made.channels[Channel.INSTANCE])
    error = np.abs(stored[Channel.RGB].astype(int) - made.channels[Channel.RGB])
    assert error.mean() <= (0 if encoding is LOSSLESS else 4)
    # KITTI's images are PNG, as in all formats that state nothing.
    with pytest.raises(ConfigError, match=f"'color' writes {encoding.format} files.*rgb_encoding"):
        check_image_formats(Kitti(), info)
    check_image_formats(Coco(), info)


def test_voc_encodes_jpeg_only_from_other_formats(
    tmp_path: Path, info: Any, world: Any, encoding: ImageEncoding
) -> None:
    """A second generation of JPEG would lose more."""
    folder = world.export(Voc(), info, world.samples, tmp_path)
    found = sorted(folder.rglob("*.jpg"))
    assert len(found) == 7
    assert all(path.read_bytes().startswith(MAGIC[".jpg"]) for path in found)
    linked = {p.stat().st_nlink > 1 for p in found}
    own = list(tmp_path.glob("shards/*/voc/*.jpg"))
    assert linked == {True}
    assert len(own) == (0 if encoding is JPEG else 7)


Found = tuple[bytes, str]
"""File of the first photograph, and the format that the data set states."""


def file_of(path: Path) -> Found:
    return path.read_bytes(), path.suffix


def in_parquet(folder: Path) -> Found:
    """As ``datasets`` embeds images."""
    image = parquet(next((folder / "data").glob("train-*")))["image"][0].as_py()
    return image["bytes"], Path(image["path"]).suffix


def in_mcap(folder: Path) -> Found:
    """The first message of the camera, and Foxglove's name of its format."""
    read = messages(sorted(folder.glob("train/*.mcap"))[0])
    message = next(found for topic, _, _, found in read if topic == "/camera/color/rgb")
    return bytes(message.data), message.format


def in_solo(folder: Path) -> Found:
    frame = json.loads((folder / "train/sequence.0/step0.frame_data.json").read_text())
    capture = frame["captures"][0]
    path = folder / "train/sequence.0" / capture["filename"]
    assert path.suffix == ".jpg"
    return path.read_bytes(), capture["imageFormat"]


def in_recording(folder: Path) -> Found:
    """The first blob and its media type."""
    import rerun.chunk

    store = rerun.chunk.RrdReader(str(next(folder.glob("train/*.rrd")))).store()
    for chunk in store.stream():
        columns = chunk.to_record_batch()
        if chunk.entity_path == "/world/cameras/color/image/rgb":
            values = {
                name.partition(":")[2]: columns[name][0].as_py() for name in columns.schema.names
            }
            return bytes(values["blob"][0]), values["media_type"][0]
    raise AssertionError("no photograph")


def in_tar(folder: Path) -> Found:
    """The first member with the name of an image of the colour camera."""
    with tarfile.open(sorted(folder.glob("train/*.tar"))[0]) as tar:
        (name,) = (n for n in tar.getnames() if ".rgb." in n)
        member = tar.extractfile(name)
        assert member is not None
        return member.read(), Path(name).suffix


def in_records(folder: Path) -> Found:
    """Under the keys by which TensorFlow's API decodes it."""
    (record,) = records(folder / "train-00000-of-00001.tfrecord")
    (data,), (kind,), (name,) = (
        record[f"image/{key}"][1] for key in ("encoded", "format", "filename")
    )
    assert name.decode() == "000000000_color." + {"jpeg": "jpg"}.get(kind.decode(), kind.decode())
    return data, kind.decode()


def document(folder: Path, name: str) -> Any:
    return json.loads((folder / name).read_text())


def named_in_xml(path: Path, name: str) -> str:
    """A text below the root of an XML file, or the attribute ``name`` of one."""
    node = ElementTree.parse(path).find(name)
    assert node is not None
    return node.get("name") or str(node.text)


BOP, COCO = "train/000000/", "annotations/{}_train.json"
PHOTOGRAPHS: dict[str, Callable[[Path], Path]] = {
    "bop": lambda f: f / BOP / document(f, BOP + "scene_gt_coco.json")["images"][0]["file_name"],
    "coco": lambda f: f / "train" / document(f, COCO.format("instances"))["images"][0]["file_name"],
    "coco_panoptic": lambda f: (
        f / "train" / document(f, COCO.format("panoptic"))["images"][0]["file_name"]
    ),
    "control_clips": lambda f: (
        f / "train" / json_lines(f / "train/metadata.jsonl")[0]["image_file_name"]
    ),
    "cvat": lambda f: f / "train/images" / named_in_xml(f / "train/annotations.xml", "image"),
    "label_studio": lambda f: (
        f
        / unquote(document(f, "train/tasks.json")[0]["data"]["image"]).partition("=label_studio/")[
            2
        ]
    ),
    "voc": lambda f: (
        f
        / "VOCdevkit/VOC2012/JPEGImages"
        / named_in_xml(next((f / "VOCdevkit/VOC2012/Annotations").iterdir()), "filename")
    ),
    "yolo": lambda f: next((f / "detect/images/train").iterdir()),
}
"""The file that the first entry of a data set names."""
READERS: dict[str, Callable[[Path], Found]] = {
    "huggingface": in_parquet,
    "mcap": in_mcap,
    "rerun": in_recording,
    "solo": in_solo,
    "tfrecord": in_records,
    "webdataset": in_tar,
    **{kind: lambda f, path=path: file_of(path(f)) for kind, path in PHOTOGRAPHS.items()},
}
OPTIONS: dict[str, Any] = {"voc": {"images": "png"}, "yolo": {"tasks": ("detect",)}}
STATED = {"mcap": {"jpeg": "jpeg", "webp": "webp"}, "rerun": {"jpeg": "image/jpeg"},
          "solo": {"jpeg": "Jpg"}, "tfrecord": {"jpeg": "jpeg"}}  # fmt: skip
"""Statements of a data set, by format; others state the ending of the file."""


@pytest.mark.parametrize("kind", READERS)
def test_readers_find_photos(
    kind: str, encoding: ImageEncoding, world: Any, tmp_path: Path
) -> None:
    """The first one, in the stated format, with the pixels of the first sample; labels are PNG."""
    exporter = TABLE.load(kind)(**OPTIONS.get(kind, {}))
    info = encoded(world.info(1, lidars=("top",)), encoding)
    written = encoding.format.removesuffix("_lossless")
    if encoding.format not in exporter.image_formats:
        with pytest.raises(ConfigError, match=f"'color' writes {encoding.format} files"):
            check_image_formats(exporter, info)
        return
    check_image_formats(exporter, info)
    folder = world.export(exporter, info, world.with_bodies(world.samples[:1]), tmp_path)
    data, found = READERS[kind](folder)
    assert found == STATED.get(kind, {}).get(written, encoding.suffix)
    image = Image.open(io.BytesIO(data))
    assert image.format == written.upper()
    assert is_near(image, world.samples[0].capture.readings["color"].channels[Channel.RGB])
    shard = tmp_path / f"shards/000000/color/rgb/000000000{encoding.suffix}"
    assert shard.read_bytes() == data
    labels = [path.read_bytes()[:4] for path in folder.rglob("*.png")]
    assert set(labels) == {b"\x89PNG"} if kind.startswith("coco") else {*labels} <= {b"\x89PNG"}


def is_near(image: Any, expected: Any) -> bool:
    """Whether an image is the rendered one but for the loss of its encoding."""
    return bool(np.abs(np.asarray(image, int) - expected).mean() < ERROR_MAX)


def test_hdf5_has_the_pixels(tmp_path: Path, info: Any, world: Any) -> None:
    boxes = world.export(Hdf5(), info, world.samples, tmp_path)
    with h5py.File(next(boxes.rglob("000000000_*.hdf5"))) as file:
        made = world.samples[0].capture.readings["color"].channels[Channel.RGB]
        assert is_near(file["colors"], made)


def test_formats_without_photographs_take_every_camera(world: Any) -> None:
    """They neither link nor embed its files."""
    info = encoded(world.info(7), WEBP)
    for kind in ("birdseye", "pointclouds", "semantickitti", "tables", "usd"):
        check_image_formats(TABLE.load(kind)(), info)


def test_croissant_states_the_type(world: Any, tmp_path: Path) -> None:
    """Rows are joined with JPEG files; cameras with different files are refused."""
    info = encoded(world.info(7), JPEG)
    folder = world.export(Croissant(), info, world.samples, tmp_path)
    document = json.loads((folder / "croissant.json").read_text())
    (photographs,) = (d for d in document["distribution"] if d["@id"] == "image-files")
    assert photographs["encodingFormat"] == "image/jpeg"
    assert len(list(folder.glob(photographs["includes"]))) == 7
    pair = world.info(7, ("left", "right"))
    first, *others = pair.sensors
    mixed = replace(pair, sensors=(replace(first, rgb_encoding=JPEG), *others))
    with pytest.raises(ConfigError, match=r"write \.jpg and \.png files; expected one format"):
        Croissant().check(mixed)


@pytest.mark.slow
def test_mlcroissant_reads_jpeg(world: Any, tmp_path: Path) -> None:
    """The pixels of the first row."""
    folder = world.export(Croissant(), encoded(world.info(7), JPEG), world.samples, tmp_path)
    logging.disable()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import mlcroissant

            loaded = mlcroissant.Dataset(jsonld=str(folder / "croissant.json"))
            rows = {row["images/sample"]: row for row in loaded.records("images")}
    finally:
        logging.disable(logging.NOTSET)
    expected = world.samples[0].capture.readings["color"].channels[Channel.RGB]
    assert len(rows) == 7
    assert is_near(rows[0]["images/content"], expected)


def test_tables_of_sequences_name_jpeg_files(world: Any, samples: Any, tmp_path: Path) -> None:
    """Rows of images in nuScenes, and the ending in MOTChallenge's description of a sequence."""
    info = encoded(drive_info(world), JPEG)
    tables = world.export(NuScenes(), info, samples, tmp_path / "nuscenes")
    rows = json.loads((tables / "v1.0-mini/sample_data.json").read_text())
    images = [row for row in rows if row["fileformat"] == "jpg"]
    assert len(images) == 16
    assert all((tables / row["filename"]).read_bytes()[:2] == b"\xff\xd8" for row in images)
    assert {row["fileformat"] for row in rows} == {"jpg", "pcd"}
    tracks = world.export(MotChallenge(), info, samples, tmp_path / "mot")
    folder = tracks / "street-val/street-0001"
    facts = configparser.ConfigParser()
    facts.read(folder / "seqinfo.ini")
    images = folder / facts["Sequence"]["imDir"] / f"000001{facts['Sequence']['imExt']}"
    assert images.read_bytes()[:2] == b"\xff\xd8"
