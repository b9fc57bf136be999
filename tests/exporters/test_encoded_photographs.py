"""Photographs as JPEG and WebP in formats that name or embed them, each found as its readers do."""

from __future__ import annotations

import configparser
import io
import json
import logging
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
import pyarrow.parquet
import pytest
from PIL import Image

from gen_data.core.capture import Channel, ImageEncoding
from gen_data.core.errors import ConfigError
from gen_data.exporters.base import check_image_formats
from gen_data.exporters.birdseye import Birdseye
from gen_data.exporters.bop import Bop
from gen_data.exporters.coco_panoptic import CocoPanoptic
from gen_data.exporters.control_clips import ControlClips
from gen_data.exporters.croissant import Croissant
from gen_data.exporters.cvat import Cvat
from gen_data.exporters.huggingface import HuggingFace
from gen_data.exporters.label_studio import LabelStudio
from gen_data.exporters.mcap import Mcap
from gen_data.exporters.measurement_tables import Tables
from gen_data.exporters.motchallenge import MotChallenge
from gen_data.exporters.nuscenes import NuScenes
from gen_data.exporters.pointclouds import PointClouds
from gen_data.exporters.rerun import Rerun
from gen_data.exporters.semantickitti import SemanticKitti
from gen_data.exporters.solo import Solo
from gen_data.exporters.usd import Usd
from tests.exporters.drives import drive_info

JPEG, WEBP = ImageEncoding("jpeg", 92), ImageEncoding("webp", 92)
ERROR_MAX = 4.0
"""Mean difference to the rendered image, of 255; other images differ by more than 20."""

Found = tuple[bytes, str]
"""File of the first photograph, and the format that the data set states."""


def encoded(info: Any, encoding: ImageEncoding) -> Any:
    """The data set with photographs of all cameras in this encoding."""
    sensors = (replace(s, rgb_encoding=encoding) if s.channels else s for s in info.sensors)
    return replace(info, sensors=tuple(sensors))


def lines(path: Path) -> list[dict[str, Any]]:
    """Rows of a JSON lines file."""
    return [json.loads(line) for line in path.read_text().splitlines()]


def file_of(path: Path) -> Found:
    """A file, and the format that its ending states."""
    return path.read_bytes(), path.suffix


def in_parquet(folder: Path) -> Found:
    """As ``datasets`` embeds images."""
    table = pyarrow.parquet.read_table(next((folder / "data").glob("train-*")))
    image = table["image"][0].as_py()
    return image["bytes"], Path(image["path"]).suffix


def in_mcap(folder: Path) -> Found:
    """The first message of the camera, and Foxglove's name of its format."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    with sorted(folder.glob("train/*.mcap"))[0].open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        _, _, _, message = next(reader.iter_decoded_messages(topics=["/camera/color/rgb"]))
        return bytes(message.data), message.format


def in_cvat(folder: Path) -> Found:
    """By the name in the XML file."""
    image = ElementTree.parse(folder / "train/annotations.xml").find("image")
    assert image is not None
    return file_of(folder / "train/images" / image.attrib["name"])


def in_label_studio(folder: Path) -> Found:
    """By the address in the first task."""
    url = json.loads((folder / "train/tasks.json").read_text())[0]["data"]["image"]
    return file_of(folder / unquote(url).partition("=label_studio/")[2])


def in_panoptic(folder: Path) -> Found:
    """By the entry of the image; segments stay PNG."""
    data = json.loads((folder / "annotations/panoptic_train.json").read_text())
    name = data["annotations"][0]["file_name"]
    assert (folder / "annotations/panoptic_train" / name).read_bytes().startswith(b"\x89PNG")
    return file_of(folder / "train" / data["images"][0]["file_name"])


def in_solo(folder: Path) -> Found:
    """By the first capture."""
    frame = json.loads((folder / "train/sequence.0/step0.frame_data.json").read_text())
    capture = frame["captures"][0]
    path = folder / "train/sequence.0" / capture["filename"]
    assert path.suffix == ".jpg"
    return path.read_bytes(), capture["imageFormat"]


def in_clips(folder: Path) -> Found:
    """By the line of the first frame."""
    return file_of(folder / "train" / lines(folder / "train/metadata.jsonl")[0]["image_file_name"])


def in_bop(folder: Path) -> Found:
    """By number, as bop_toolkit looks for either ending."""
    return file_of(next((folder / "train/000000/rgb").glob("000000.*")))


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


FORMATS: dict[str, tuple[Any, ImageEncoding, Callable[[Path], Found], str]] = {
    "huggingface": (HuggingFace(), JPEG, in_parquet, ".jpg"),
    "huggingface of webp": (HuggingFace(), WEBP, in_parquet, ".webp"),
    "mcap": (Mcap(), JPEG, in_mcap, "jpeg"),
    "mcap of webp": (Mcap(), WEBP, in_mcap, "webp"),
    "cvat": (Cvat(), JPEG, in_cvat, ".jpg"),
    "label_studio": (LabelStudio(), JPEG, in_label_studio, ".jpg"),
    "coco_panoptic": (CocoPanoptic(), JPEG, in_panoptic, ".jpg"),
    "solo": (Solo(), JPEG, in_solo, "Jpg"),
    "control_clips": (ControlClips(), JPEG, in_clips, ".jpg"),
    "bop": (Bop(), JPEG, in_bop, ".jpg"),
    "rerun": (Rerun(), JPEG, in_recording, "image/jpeg"),
}


@pytest.mark.parametrize("name", FORMATS)
def test_readers_find_the_photographs(name: str, world: Any, tmp_path: Path) -> None:
    """The first one, in the stated format; its pixels are those of the first sample."""
    exporter, encoding, find, stated = FORMATS[name]
    info = encoded(world.info(1, lidars=("top",)), encoding)
    check_image_formats(exporter, info)
    samples = world.with_bodies(world.samples[:1])
    data, found = find(world.export(exporter, info, samples, tmp_path))
    assert found == stated
    image = Image.open(io.BytesIO(data))
    assert image.format == {"jpeg": "JPEG", "webp": "WEBP"}[encoding.format]
    assert is_near(image, world.samples[0].capture.readings["color"].channels[Channel.RGB])


def is_near(image: Image.Image, expected: Any) -> bool:
    """Whether an image is the rendered one but for the loss of its encoding."""
    return bool(np.abs(np.asarray(image, int) - expected).mean() < ERROR_MAX)


def test_formats_without_photographs_take_every_camera(world: Any) -> None:
    """They neither link nor embed its files."""
    info = encoded(world.info(7), WEBP)
    for exporter in (Birdseye(), PointClouds(), SemanticKitti(), Tables(), Usd()):
        check_image_formats(exporter, info)


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
