"""PNG files read back by decoders that are not ours."""

import io
import zlib
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from gen_data.core.boxes import tight_box
from gen_data.exporters.label_png import encode_label_png
from gen_data.exporters.label_regions import find_regions
from gen_data.exporters.png import SIGNATURE, RowFilter, decode_png, encode_png


def noise(shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
    count = int(np.prod(shape))
    return (np.arange(count, dtype=np.uint64) * 2654435761 >> 7).astype(dtype).reshape(shape)


@pytest.mark.parametrize("row_filter", list(RowFilter))
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("shape", [(7, 5), (1, 1), (33, 64), (7, 5, 3), (1, 9, 3), (9, 1, 3)])
def test_opencv_and_the_fast_decoder_read_back_every_value(
    shape: tuple[int, ...], dtype: Any, row_filter: RowFilter
) -> None:
    """Both filters, both depths, grey and colour; Pillow refuses a chunk whose CRC is wrong."""
    pixels = noise(shape, dtype)
    data = encode_png(pixels, row_filter, 1)
    Image.open(io.BytesIO(data)).verify()
    theirs = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    ours = decode_png(data)
    assert ours is not None
    assert theirs.dtype == ours.dtype == dtype
    np.testing.assert_array_equal(theirs[..., ::-1] if len(shape) == 3 else theirs, pixels)
    np.testing.assert_array_equal(ours, pixels)
    np.testing.assert_array_equal(decode_png(data, is_bgr=True), theirs)


def test_a_file_has_three_chunks() -> None:
    """Header, one block of data that any zlib inflates to filtered rows, end."""
    pixels = np.arange(6, dtype=np.uint8).reshape(2, 3)
    data = encode_png(pixels, RowFilter.SUB, 1)
    assert data.startswith(SIGNATURE)
    assert [data.count(kind) for kind in (b"IHDR", b"IDAT", b"IEND")] == [1, 1, 1]
    start = data.index(b"IDAT")
    length = int.from_bytes(data[start - 4 : start], "big")
    rows = zlib.decompress(data[start + 4 : start + 4 + length])
    assert rows == bytes([1, 0, 1, 1, 1, 3, 1, 1])


@pytest.mark.parametrize("wrong", [np.zeros((2, 2), np.float32), np.zeros((2, 2, 2), np.uint8)])
def test_other_arrays_are_refused(wrong: NDArray[Any]) -> None:
    """Neither floating point nor two channels."""
    with pytest.raises(ValueError, match="cannot write"):
        encode_png(wrong, RowFilter.SUB, 1)


def test_the_fast_decoder_leaves_other_files_to_opencv() -> None:
    """Several chunks of data, a palette, truncated files, wrong bytes in header and data."""
    pixels = noise((16, 16, 3), np.uint8)
    own = encode_png(pixels, RowFilter.SUB, 1)
    damaged = [bytearray(own), bytearray(own)]
    damaged[0][60] ^= 1
    damaged[1][18] ^= 1
    palette = encode_label_png(
        pixels[..., 0], np.arange(256, dtype=np.uint8), noise((256, 3), np.uint8)
    )
    several = cv2.imencode(".png", noise((200, 200, 3), np.uint8))[1].tobytes()
    assert several.count(b"IDAT") > 1
    for data in (b"", own[:50], own[:-1], *map(bytes, damaged), palette, several):
        assert decode_png(data) is None


def shapes(height: int, width: int) -> NDArray[np.uint16]:
    """Rectangles, one-pixel lines, a checkerboard and noise, up to all borders."""
    image = np.zeros((height, width), np.uint16)
    image[height // 3 :, width // 4 : width // 2] = 7
    image[:, -1:], image[-1:], image[:1] = 300, 4, 7
    image[height // 2 :, width // 2 :] = (
        np.indices(image.shape).sum(axis=0)[: -(-height // 2), : -(-width // 2)] % 2
    )
    image[: height // 4, width // 2 :] = noise((height // 4, width - width // 2), np.uint16) % 301
    return image


@pytest.mark.parametrize("size", [(1, 1), (1, 700), (700, 1), (3, 2), (48, 64), (300, 400)])
@pytest.mark.parametrize(
    "values",
    [noise((301,), np.uint8), noise((301,), np.uint16), noise((301, 3), np.uint8),
     np.zeros(301, np.uint8), np.full((301, 3), 200, np.uint8)],
)  # fmt: skip
def test_label_images_have_their_values(size: tuple[int, int], values: NDArray[Any]) -> None:
    """OpenCV and zlib, which checks the sum, read every pixel; also of labels of equal values."""
    labels = shapes(*size)
    data = encode_label_png(labels, values)
    read = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    assert read.dtype == values.dtype
    np.testing.assert_array_equal(read[..., ::-1] if values.ndim == 2 else read, values[labels])
    start = data.index(b"IDAT")
    rows = zlib.decompress(data[start + 4 : -16])
    assert len(rows) == size[0] * (1 + size[1] * values[:1].nbytes)
    Image.open(io.BytesIO(data)).verify()


def test_label_images_avoid_long_codes_are_small_and_have_a_palette() -> None:
    """Counts that grow like Fibonacci's numbers give Huffman codes of more than 15 bits."""
    counts = [1, 1]
    while len(counts) < 24:
        counts.append(counts[-1] + counts[-2])
    values = np.repeat(np.arange(1, 25), counts)
    labels = np.zeros((2, 2 * len(values)), np.uint8)
    labels[1, ::2] = values
    data = encode_label_png(labels, np.arange(256, dtype=np.uint8))
    np.testing.assert_array_equal(
        cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED), labels
    )
    # Not larger than those of a general compressor by more than a fifth.
    labels = np.zeros((480, 640), np.uint8)
    for k in range(1, 12):
        cv2.circle(labels, (50 * k, 30 * k), 40 + 5 * k, k, -1)
    general = encode_png(labels, RowFilter.UP, 2)
    assert len(encode_label_png(labels, np.arange(256, dtype=np.uint8))) < 1.2 * len(general)
    # Pillow reads both, and the colours through them.
    colors = noise((256, 3), np.uint8)
    pixels = noise((9, 31), np.uint8)
    data = encode_label_png(pixels, np.arange(256, dtype=np.uint8), colors)
    with Image.open(io.BytesIO(data)) as image:
        assert image.mode == "P"
        np.testing.assert_array_equal(np.asarray(image), pixels)
        np.testing.assert_array_equal(np.asarray(image.convert("RGB")), colors[pixels])


@pytest.mark.parametrize("size", [(1, 1), (48, 64), (3, 2)])
def test_regions_are_those_of_their_masks(size: tuple[int, int]) -> None:
    """Every label that occurs, with its number of pixels and its tight box."""
    labels = shapes(*size)
    regions = find_regions(labels)
    assert sorted(regions) == np.unique(labels).tolist()
    for label, region in regions.items():
        mask = labels == label
        assert (region.area_px, region.box) == (np.count_nonzero(mask), tight_box(mask))
