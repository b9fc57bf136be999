"""PNG files, read back by Pillow or by hand, never by the library that wrote them."""

import io
import os
import struct
import zlib
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError, SampleError, StorageError
from gen_data.core.interfaces import media_path
from gen_data.exporters.image_files import (
    depth_units,
    encode_channel,
    link_or_copy,
    read_image,
    write_media,
)

H, W = 37, 53


def read(data: bytes) -> tuple[str, NDArray[Any]]:
    with Image.open(io.BytesIO(data)) as image:
        return image.mode, np.asarray(image)


def read_rgb16(data: bytes) -> NDArray[np.uint16]:
    """Pixels of a 16-bit RGB PNG, which Pillow cuts to 8 bits: the PNG specification by hand."""
    chunks, at = {}, 8
    while at < len(data):
        (length,), kind = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        chunks[kind] = chunks.get(kind, b"") + data[at + 8 : at + 8 + length]
        at += 12 + length
    width, height, depth, colour = struct.unpack(">IIBB", chunks[b"IHDR"][:10])
    assert (depth, colour) == (16, 2), "16 bits, true colour"
    step, stride = 6, 6 * width
    raw, above, rows = zlib.decompress(chunks[b"IDAT"]), bytes(stride), []
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 :][:stride])
        for i in range(stride):
            a, c = (line[i - step], above[i - step]) if i >= step else (0, 0)
            line[i] = (line[i] + _predicted(kind, a, above[i], c)) % 256
        above = bytes(line)
        rows.append(above)
    return np.frombuffer(b"".join(rows), ">u2").reshape(height, width, 3).astype(np.uint16)


def _predicted(kind: int, a: int, b: int, c: int) -> int:
    paeth = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
    return (0, a, b, (a + b) // 2, paeth)[kind]


RGB = np.random.default_rng(0).integers(0, 256, (H, W, 3), dtype=np.uint8)
DEPTH_M = np.array([[1.0, 0.25, 0.75, 1.25], [np.inf, 32_767.5, 32_768.0, 0.0]], np.float32)
HALVES = [[2, 0, 2, 2], [0, 65_535, 0, 0]]
"""Depth in units of 0.5 m, half to even; 0 where there is nothing and 16 bits do not reach."""
NORMALS = np.array([[[-1, 0, 1], [1, -1, 0], [0, 0, 0]]], np.float32)


@pytest.mark.parametrize(
    ("channel", "values", "mode", "expected"),
    [(Channel.RGB, RGB, "RGB", RGB.tolist()), (Channel.Z_DEPTH, DEPTH_M, "I;16", HALVES),
     (Channel.RANGE, DEPTH_M, "I;16", HALVES),
     (Channel.NORMALS, NORMALS, "RGB", [[[0, 128, 255], [255, 0, 128], [128, 128, 128]]])],
    ids=["colours in order", "depth", "range", "normals, and 128 for none"],
)  # fmt: skip
def test_readers_find_every_value(channel: Channel, values: Any, mode: str, expected: Any) -> None:
    """A red image is red for every reader; OpenCV's BGR stays inside."""
    found, pixels = read(encode_channel(channel, values, 0.5))
    assert (found, pixels.tolist()) == (mode, expected)


@pytest.mark.parametrize("channel", [Channel.INSTANCE, Channel.PART, Channel.CATEGORY])
def test_ids_are_16_bit_grey_up_to_the_largest(channel: Channel) -> None:
    """Always 16 bits, also where all ids are small: readers need one rule."""
    ids = np.random.default_rng(1).integers(0, 65_536, (H, W), dtype=np.uint16)
    ids[0, 0], ids[0, 1] = 0, 65_535
    mode, pixels = read(encode_channel(channel, ids, 1.0))
    small_mode, _ = read(encode_channel(channel, ids % 3, 1.0))
    assert mode == small_mode == "I;16"
    np.testing.assert_array_equal(pixels, ids)


LAYERED = {
    Channel.DEPTH_LAYERS: np.stack([DEPTH_M, np.full_like(DEPTH_M, 2.5), DEPTH_M + 0.5], axis=-1),
    Channel.INSTANCE_LAYERS: np.arange(24, dtype=np.uint16).reshape(2, 4, 3),
    Channel.MATERIAL_LAYERS: np.arange(24, dtype=np.uint16).reshape(2, 4, 3) % 7,
}


@pytest.mark.parametrize("channel", LAYERED)
def test_layers_are_below_one_another_as_single_images_are(
    channel: Channel, tmp_path: Path
) -> None:
    """Each layer has the pixels of a single depth or id image; reading gives all back."""
    layers = LAYERED[channel]
    alone = Channel.Z_DEPTH if channel is Channel.DEPTH_LAYERS else Channel.INSTANCE
    data = encode_channel(channel, layers, 0.5)
    mode, pixels = read(data)
    assert (mode, pixels.shape) == ("I;16", (6, 4))
    for k, part in enumerate(pixels.reshape(3, 2, 4)):
        np.testing.assert_array_equal(part, read(encode_channel(alone, layers[..., k], 0.5))[1])

    path = tmp_path / "layers.png"
    path.write_bytes(data)
    found = read_image(path, channel, 0.5, (4, 2))
    assert (found.shape, found.dtype) == (layers.shape, layers.dtype)
    np.testing.assert_array_equal(encode_channel(channel, found, 0.5), data)
    with pytest.raises(StorageError, match=r"\[6, 4\]; expected uint16 \[4, 4\]"):
        read_image(path, channel, 0.5, (4, 4))


def test_depth_survives_the_file_to_half_a_unit(tmp_path: Path) -> None:
    """0.1 mm units: never more than 0.05 mm away, and equal to the result of the pure function."""
    depth_m = np.random.default_rng(2).uniform(0.3, 6.5, (H, W)).astype(np.float32)
    _, units = read(encode_channel(Channel.Z_DEPTH, depth_m, 0.0001))
    assert np.abs(units * 0.0001 - depth_m).max() <= 0.00005 + 1e-9
    np.testing.assert_array_equal(units, depth_units(depth_m, 0.0001))


def test_wrong_depths_are_errors_and_object_coordinates_16_bit_colour() -> None:
    """16-bit integers would wrap a negative depth to a far one."""
    for wrong in (-0.1, np.nan):
        with pytest.raises(SampleError, match="negative number or NaN"):
            encode_channel(Channel.Z_DEPTH, np.array([[1.0, wrong]], np.float32), 0.001)
    with pytest.raises(ConfigError, match=r"'amodal'.*rgb, depth, range, instance"):
        encode_channel(Channel.AMODAL, np.zeros((2, 2), bool), 1.0)
    # 1 is 65535, also a rounding above 1; every value comes back through the PNG specification.
    coordinates = np.random.default_rng(3).random((H, W, 3)).astype(np.float32)
    coordinates[0, :3] = [[0.0] * 3, [1.0] * 3, [1.0001, -0.0001, 0.5]]
    pixels = read_rgb16(encode_channel(Channel.OBJECT_COORDINATES, coordinates, 1.0))
    assert pixels[0, :3].tolist() == [[0, 0, 0], [65_535] * 3, [65_535, 0, 32_768]]
    inside = np.clip(coordinates, 0, 1)
    assert np.abs(pixels / 65_535 - inside).max() <= 0.5 / 65_535 + 1e-7


def test_every_channel_of_the_media_is_written_to_its_path(world: Any, tmp_path: Path) -> None:
    info, sample = world.info(7, devices={}), world.samples[4]
    write_media(info, sample, tmp_path)
    found = sorted(p for p in tmp_path.rglob("*") if p.is_file())
    assert found == sorted(media_path(tmp_path, "color", c, 4) for c in info.media["color"])
    _, ids = read(media_path(tmp_path, "color", Channel.INSTANCE, 4).read_bytes())
    np.testing.assert_array_equal(ids, sample.capture.readings["color"].channels[Channel.INSTANCE])


def test_files_are_linked_where_possible(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A copy is made otherwise; nothing is replaced, nor a missing source passed over."""
    a, link, copy = tmp_path / "a", tmp_path / "new/b", tmp_path / "c"
    a.write_bytes(b"data")
    link_or_copy(a, link)
    assert link.samefile(a)
    # Another file system, FAT, or too many links.
    refused = OSError(18, "Invalid cross-device link")
    monkeypatch.setattr(os, "link", Mock(side_effect=refused))
    link_or_copy(a, copy)
    assert (copy.read_bytes(), copy.samefile(a)) == (b"data", False)


@pytest.mark.parametrize(("source", "error"), [("a", FileExistsError), ("none", FileNotFoundError)])
def test_a_link_never_replaces_a_file(tmp_path: Path, source: str, error: Any) -> None:
    (tmp_path / "a").write_bytes(b"new")
    (tmp_path / "b").write_bytes(b"old")
    with pytest.raises(error):
        link_or_copy(tmp_path / source, tmp_path / ("b" if source == "a" else "c"))
    assert (tmp_path / "b").read_bytes() == b"old"
