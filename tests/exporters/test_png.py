"""PNG files read back by decoders that are not ours."""

from __future__ import annotations

import io
import zlib
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from gen_data.exporters.png import SIGNATURE, RowFilter, encode_palette_png, encode_png


def noise(shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
    """Every value of the type, in an order without pattern."""
    count = int(np.prod(shape))
    return (np.arange(count, dtype=np.uint64) * 2654435761 >> 7).astype(dtype).reshape(shape)


@pytest.mark.parametrize("row_filter", list(RowFilter))
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("shape", [(7, 5), (1, 1), (33, 64), (7, 5, 3), (1, 9, 3)])
def test_opencv_reads_back_every_value(
    shape: tuple[int, ...], dtype: Any, row_filter: RowFilter
) -> None:
    """Both filters, both depths, grey and colour."""
    pixels = noise(shape, dtype)
    data = np.frombuffer(encode_png(pixels, row_filter, 1), np.uint8)
    read = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    assert read.dtype == dtype
    np.testing.assert_array_equal(read[..., ::-1] if len(shape) == 3 else read, pixels)


def test_pillow_verifies_every_checksum() -> None:
    """Pillow refuses a chunk whose CRC is wrong."""
    data = encode_png(noise((16, 16, 3), np.uint8), RowFilter.SUB, 1)
    Image.open(io.BytesIO(data)).verify()


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


def test_an_image_of_indices_has_its_palette() -> None:
    """Pillow reads both, and the colours through them."""
    colors = noise((256, 3), np.uint8)
    pixels = noise((9, 31), np.uint8)

    with Image.open(io.BytesIO(encode_palette_png(pixels, colors, 2))) as image:
        assert image.mode == "P"
        np.testing.assert_array_equal(np.asarray(image), pixels)
        np.testing.assert_array_equal(np.asarray(image.convert("RGB")), colors[pixels])
