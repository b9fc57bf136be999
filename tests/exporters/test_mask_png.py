"""Binary masks as PNG files, read by two independent decoders."""

import io
import zlib

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from gen_data.core.sample import MaskPx
from gen_data.exporters.mask_png import adler32_of_runs, encode_mask


def decoded(png: bytes) -> np.ndarray:
    """Pixels as OpenCV reads them, after Pillow has read the same."""
    image = Image.open(io.BytesIO(png))
    assert image.mode == "L"
    pixels = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(np.asarray(image), pixels)
    return np.asarray(pixels)


@given(
    crop=hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, max_side=40)),
    above=st.integers(0, 700),
    left=st.integers(0, 700),
    below=st.integers(0, 30),
    right=st.integers(0, 30),
)
@settings(max_examples=150, deadline=None)
def test_masks_come_back(crop: np.ndarray, above: int, left: int, below: int, right: int) -> None:
    """Also at the image's edges, where runs of different rows meet."""
    expected = np.pad(crop, [(above, below), (left, right)]).astype(np.uint8) * 255
    png = encode_mask(MaskPx(left, above, crop), *expected.shape)
    np.testing.assert_array_equal(decoded(png), expected)


def test_runs_of_every_length_come_back_and_a_full_image_is_small() -> None:
    """A row of set pixels: the longest copy, two of them, and each possible rest."""
    for width in range(1, 600):
        png = encode_mask(MaskPx(0, 0, np.ones((1, width), bool)), 2, width)
        np.testing.assert_array_equal(decoded(png), [[255] * width, [0] * width])
    for mask in (None, MaskPx(0, 0, np.zeros((0, 0), bool))):
        assert not decoded(encode_mask(mask, 48, 64)).any()
    # Its bytes are of the runs.
    png = encode_mask(MaskPx(0, 0, np.ones((480, 640), bool)), 480, 640)
    assert decoded(png).min() == 255
    assert len(png) < 8_000


@given(
    borders=st.lists(st.integers(1, 5000), unique=True, max_size=40).map(sorted),
    after=st.integers(0, 9000),
)
@settings(max_examples=60, deadline=None)
def test_checksum_of_runs_is_that_of_their_bytes(borders: list[int], after: int) -> None:
    """Compared with zlib's, also where the last run is of 255."""
    size = (borders[-1] if borders else 0) + max(after, 1)
    data = np.zeros(size, np.uint8)
    for border in borders:
        data[border:] ^= 255
    ends = [*borders, size] if len(borders) % 2 else borders
    assert adler32_of_runs(np.array(ends, np.int64), size) == zlib.adler32(data.tobytes())
