"""Pictures on walls: motifs that differ, frames of usual sizes."""

from functools import cache
from itertools import combinations

import cv2
import numpy as np

from gen_data.content.interiors.wall_art import is_upright, wall_art
from gen_data.core.asset_types import UInt8
from tests.rooms.test_layouts import library
from tests.tiers import seeds

VARIANTS = 84


@cache
def picture(seed: int) -> UInt8:
    return wall_art(seed).albedo


def small(image: UInt8) -> np.ndarray:
    """An image of 12 by 12 pixels, by OpenCV."""
    return cv2.resize(image, (12, 12), interpolation=cv2.INTER_AREA).astype(np.float64)


@seeds(12, VARIANTS)
def test_no_two_motifs_look_alike(seeds: range) -> None:
    """Some part of 12 by 12 differs by a tenth of the range, of any two motifs."""
    pictures = [small(picture(seed)) for seed in range(seeds.stop)]

    assert min(np.abs(a - b).max() for a, b in combinations(pictures, 2)) > 25.0


@seeds(12, VARIANTS)
def test_motifs_have_the_side_ratio_of_their_frames(seeds: range) -> None:
    """Four to three, upright or lying."""
    for seed in seeds:
        h, w = picture(seed).shape[:2]
        assert (w, h) == ((384, 512) if is_upright(seed) else (512, 384))


def test_frames_are_thin_and_sizes_go_from_postcards_to_large_prints() -> None:
    """Of the bounding boxes of all variants."""
    sizes = []
    for seed in range(VARIANTS):
        low, high = library().bounds_m(f"picture?seed={seed}")
        sizes.append(max(high[1] - low[1], high[2] - low[2]))
        assert high[0] - low[0] < 0.035

    assert min(sizes) < 0.25
    assert 0.8 < max(sizes) < 1.4
