"""Further statistics that are compared and not fitted: remaining differences after a fit."""

from collections.abc import Callable

import cv2
import numpy as np

from gen_data.lab.matching.picture import CLIPPED, Picture
from gen_data.lab.matching.recordings import Scan


def _percentile(share: float) -> Callable[[Picture], float]:
    def measure(picture: Picture) -> float:
        return float(np.percentile(picture.grey[::3, ::3], share))

    return measure


def _clipped(picture: Picture) -> float:
    return float((picture.grey >= CLIPPED).mean())


def _gradient(picture: Picture) -> float:
    right = cv2.Sobel(picture.grey, cv2.CV_32F, 1, 0) / 8.0
    down = cv2.Sobel(picture.grey, cv2.CV_32F, 0, 1) / 8.0
    return float(cv2.magnitude(right, down).mean())


PICTURES: tuple[tuple[str, Callable[[Picture], float]], ...] = (
    ("grey value of 1 %", _percentile(1.0)),
    ("grey value of 50 %", _percentile(50.0)),
    ("grey value of 99 %", _percentile(99.0)),
    ("share of clipped pixels", _clipped),
    ("mean gradient [grey values per pixel]", _gradient),
)


def _median_range(scan: Scan) -> float:
    return float(np.median(scan.range_m))


SCANS: tuple[tuple[str, Callable[[Scan], float]], ...] = (("median range [m]", _median_range),)
