"""Photographs as JPEG and WebP: files that other decoders read, in every format that takes them."""

from __future__ import annotations

import json
import tarfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import h5py
import numpy as np
import pytest

from gen_data.core.capture import PNG, Channel, ImageEncoding
from gen_data.core.errors import ConfigError
from gen_data.exporters import TABLE
from gen_data.exporters.base import check_image_formats
from gen_data.exporters.coco import Coco
from gen_data.exporters.hdf5 import Hdf5
from gen_data.exporters.image_files import encode_channel, read_image
from gen_data.exporters.kitti import Kitti
from gen_data.exporters.voc import Voc
from gen_data.exporters.webdataset import WebDataset
from gen_data.exporters.yolo import Yolo
from gen_data.runner.stored import ImageFiles
from gen_data.sensors.camera.rgb_encoding import RgbEncoding

JPEG, WEBP, LOSSLESS = (
    ImageEncoding("jpeg", 92),
    ImageEncoding("webp", 92),
    ImageEncoding("webp_lossless"),
)
MAGIC = {".jpg": b"\xff\xd8\xff", ".webp": b"RIFF"}


@pytest.fixture(params=[JPEG, WEBP, LOSSLESS], ids=lambda encoding: encoding.format)
def encoding(request: Any) -> ImageEncoding:
    """One of the encodings beside PNG."""
    return request.param


@pytest.fixture
def info(world: Any, encoding: ImageEncoding) -> Any:
    """The street's data set in this encoding."""
    info = world.info(7)
    return replace(info, sensors=tuple(replace(s, rgb_encoding=encoding) for s in info.sensors))


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


def test_quality_changes_the_size() -> None:
    """Of both formats with a loss; the best is larger than the worst."""
    image = photograph()
    for kind in ("jpeg", "webp"):
        sizes = [
            len(
                encode_channel(
                    Channel.RGB, image, 0.001, RgbEncoding(format=kind, quality=q).described()
                )
            )
            for q in (10, 95)
        ]
        assert sizes[0] < 0.7 * sizes[1]


def test_formats_without_loss_have_no_quality() -> None:
    """The error names the formats that have one."""
    assert RgbEncoding().described() == PNG
    for kind in ("png", "webp_lossless"):
        with pytest.raises(ValueError, match="leave out quality, or use jpeg or webp"):
            RgbEncoding(format=kind, quality=90)


def test_stored_images_are_found(
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


def photographs(folder: Path, encoding: ImageEncoding) -> list[Path]:
    """All files that begin as the encoding does and have its ending."""
    found = sorted(folder.rglob(f"*{encoding.suffix}"))
    assert all(p.read_bytes().startswith(MAGIC[encoding.suffix]) for p in found)
    return found


@pytest.mark.parametrize(
    "exporter", [Coco(), Yolo(tasks=("detect",)), Voc(images="png")], ids=lambda e: e.type
)
def test_formats_link_photographs_under_their_ending(
    tmp_path: Path, exporter: Any, info: Any, world: Any, encoding: ImageEncoding
) -> None:
    """One per sample, the same file as in the shard, and named so in the labels."""
    folder = world.export(exporter, info, world.samples, tmp_path)
    found = photographs(folder, encoding)
    assert len(found) == 7
    shard_files = {p.stat().st_ino for p in photographs(tmp_path / "shards", encoding)}
    assert {p.stat().st_ino for p in found} <= shard_files
    if exporter.type == "coco":
        listed = json.loads((folder / "annotations/instances_train.json").read_bytes())["images"]
        assert all((folder / "train" / image["file_name"]).exists() for image in listed)
        depths = [folder / image["files"]["depth"] for image in listed]
        assert all(
            cv2.imread(str(path), cv2.IMREAD_UNCHANGED).dtype == np.uint16 for path in depths
        )
    if exporter.type == "voc":
        text = next((folder / "VOCdevkit/VOC2012/Annotations").iterdir()).read_text()
        assert f"{encoding.suffix}</filename>" in text


def test_voc_encodes_jpeg_only_from_other_formats(
    tmp_path: Path, info: Any, world: Any, encoding: ImageEncoding
) -> None:
    """A second generation of JPEG would lose more."""
    folder = world.export(Voc(), info, world.samples, tmp_path)
    found = photographs(folder, JPEG)
    assert len(found) == 7
    linked = {p.stat().st_nlink > 1 for p in found}
    own = list(tmp_path.glob("shards/*/voc/*.jpg"))
    assert linked == {True}
    assert len(own) == (0 if encoding is JPEG else 7)


def test_containers_take_every_encoding(
    tmp_path: Path, info: Any, world: Any, encoding: ImageEncoding
) -> None:
    """Tar files keep the encoded bytes, HDF5 files the pixels."""
    tars = world.export(WebDataset(), info, world.samples, tmp_path / "tar")
    names: list[str] = []
    for path in tars.rglob("*.tar"):
        with tarfile.open(path) as tar:
            names += tar.getnames()
    assert sum(name.endswith(f".rgb{encoding.suffix}") for name in names) == 7
    boxes = world.export(Hdf5(), info, world.samples, tmp_path / "hdf5")
    with h5py.File(next(boxes.rglob("000000000_*.hdf5"))) as file:
        made = world.samples[0].capture.readings["color"].channels[Channel.RGB]
        assert np.abs(np.asarray(file["colors"]).astype(int) - made).mean() <= 4


def test_other_formats_refuse_them_with_a_remedy(info: Any, encoding: ImageEncoding) -> None:
    """KITTI's images are PNG; so are those of formats that say nothing."""
    with pytest.raises(ConfigError, match=f"'color' writes {encoding.format} files.*rgb_encoding"):
        check_image_formats(Kitti(), info)
    check_image_formats(Coco(), info)


def test_every_format_takes_png(world: Any) -> None:
    """The default; a plug-in without the attribute takes it too."""
    assert "kitti" in TABLE
    check_image_formats(Kitti(), world.info(7))
