"""Extents of all ids in one pass, against one id at a time."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gen_data.annotations.instance_extents import Extent, find_extents
from gen_data.core.boxes import BoxPx, tight_box


@settings(max_examples=200, deadline=None)
@given(st.integers(1, 8), st.integers(1, 8), st.integers(0, 4), st.integers(0, 2**32 - 1))
def test_extents_are_count_and_box_of_every_id(
    height: int, width: int, largest: int, seed: int
) -> None:
    """Small images, in which runs often end and begin at row ends; ids may be missing."""
    ids = np.random.default_rng(seed).integers(0, largest + 1, (height, width), dtype=np.uint16)

    found = find_extents(ids)

    assert found == {
        int(k): Extent(int((ids == k).sum()), tight_box(ids == k)) for k in np.unique(ids) if k
    }


def test_extents_end_with_rows_reach_the_largest_id_and_leave_out_nothing() -> None:
    """Ids of the last pixel of row 0 and the first of row 1 are not neighbours; 0 is not an id."""
    ids = np.array([[0, 0, 7], [7, 0, 0]], np.uint16)

    assert find_extents(ids) == {7: Extent(2, BoxPx(0, 0, 3, 2))}
    assert find_extents(np.full((2, 3), 65_535, np.uint16)) == {
        65_535: Extent(6, BoxPx(0, 0, 3, 2))
    }
    assert find_extents(np.zeros((4, 5), np.uint16)) == {}
