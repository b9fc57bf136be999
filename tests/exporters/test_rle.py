"""Run-length encoding against pycocotools, the format's own implementation."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pycocotools import mask as coco_mask

from gen_data.core.boxes import tight_box
from gen_data.core.sample import MaskPx
from gen_data.exporters.rle import encode_rle, run_lengths


def tight(image: NDArray[np.bool_]) -> MaskPx:
    """The mask of an image with at least one pixel set."""
    box = tight_box(image)
    assert box is not None
    crop = image[box.y_min : box.y_max, box.x_min : box.x_max]
    return MaskPx(box.x_min, box.y_min, crop)


@settings(max_examples=300, deadline=None)
@given(
    st.integers(1, 9),
    st.integers(1, 9),
    st.sampled_from([0.05, 0.5, 0.95, 1.0]),
    st.integers(0, 2**32 - 1),
)
def test_rle_of_a_crop_is_what_pycocotools_makes_of_the_whole_mask(
    height: int, width: int, density: float, seed: int
) -> None:
    """Small images, whose masks often touch borders, fill columns and span column ends."""
    image = np.random.default_rng(seed).random((height, width)) < density
    if not image.any():
        image[-1, -1] = True
    ours = encode_rle(tight(image), height, width)
    theirs = coco_mask.encode(np.asfortranarray(image.astype(np.uint8)))
    assert ours == {"size": list(theirs["size"]), "counts": theirs["counts"].decode()}


def test_runs_begin_with_zeros_and_go_down_columns() -> None:
    """A last run of no zeros is left out; amodal masks outside the image are empty."""
    one = MaskPx(2, 1, np.ones((1, 1), dtype=bool))
    assert run_lengths(one, 3, 4) == [7, 1, 4]  # two columns and a row before it
    assert run_lengths(MaskPx(0, 0, np.ones((3, 4), dtype=bool)), 3, 4) == [0, 12]
    mask = MaskPx(0, 0, np.zeros((0, 0), dtype=bool))
    assert not coco_mask.decode(dict(encode_rle(mask, 5, 6))).any()
    assert run_lengths(mask, 5, 6) == [30]
