"""Misses of a detector by size, occlusion, brightness and class, and where it fails most."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.lab.matching.label_files import Box, RealObject
from gen_data.lab.study import evaluation, real_pictures

SMALL_PX2, LARGE_PX2 = 32**2, 96**2
"""Bounds of COCO's areas."""
DARK, BRIGHT = 64.0, 160.0
"""Bounds of the mean 8-bit luma of a box: below is dark, above is bright."""
SHOWN_PX = 480
"""Longest side of a picture in the page."""
FOUND, MISSED, ALARM = (60, 190, 60), (235, 40, 40), (250, 170, 20)
"""Colours (RGB) of objects that were found and missed, and of false alarms; see html_page.css."""


@dataclass(frozen=True, slots=True)
class Share:
    """Objects of a group that were found, over all runs of a variant."""

    found: int
    count: int


Groups = Mapping[tuple[str, str], Share]
"""Shares by kind of group and group: ``("size", "small")``."""


def count_groups(runs: Sequence[evaluation.Evaluation]) -> Groups:
    """Found and all objects of every group, summed over runs on the same pictures."""
    counts: dict[tuple[str, str], list[int]] = defaultdict(lambda: [0, 0])
    for run in runs:
        for match in run.matches:
            if match.thing is None:
                continue
            for group in _groups(run.pictures[match.picture], match.thing):
                counts[group][0] += match.box is not None
                counts[group][1] += 1
    return {group: Share(*pair) for group, pair in sorted(counts.items())}


def worst_pictures(runs: Sequence[evaluation.Evaluation], most: int) -> list[tuple[int, int]]:
    """Numbers of the pictures with most misses and false alarms per run, and their sums."""
    faults: dict[int, int] = defaultdict(int)
    for run in runs:
        for match in run.matches:
            faults[match.picture] += match.box is None or match.thing is None
    ranked = sorted(faults.items(), key=lambda item: (-item[1], item[0]))
    return [(number, count) for number, count in ranked[:most] if count]


def draw_faults(run: evaluation.Evaluation, number: int) -> NDArray[np.uint8]:
    """A picture with the objects that were found and missed, and the false alarms; RGB."""
    image = real_pictures.read_image(run.pictures[number].path)
    # Small pictures are enlarged: lines must not hide the marked objects.
    scale = SHOWN_PX / max(image.shape[:2])
    filter_ = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_LINEAR
    shown = cv2.resize(image, None, fx=scale, fy=scale, interpolation=filter_)
    for match in run.matches:
        if match.picture == number:
            box, color = _look(match)
            x0, y0, x1, y1 = (round(scale * side) for side in box)
            cv2.rectangle(shown, (x0, y0), (x1, y1), color, 2)
    return np.asarray(shown, np.uint8)


def _look(match: evaluation.Match) -> tuple[Box, tuple[int, int, int]]:
    if match.thing is not None:
        return match.thing.box, FOUND if match.box is not None else MISSED
    assert match.box is not None, "a false alarm has a box"
    return match.box, ALARM


def _groups(picture: real_pictures.RealPicture, thing: RealObject) -> Iterator[tuple[str, str]]:
    x0, y0, x1, y1 = thing.box
    area_px2 = (x1 - x0) * (y1 - y0)
    yield "class", thing.name
    name = "small" if area_px2 < SMALL_PX2 else "medium" if area_px2 < LARGE_PX2 else "large"
    yield "size", name
    yield "occlusion", thing.occlusion or "not annotated"
    luma = _mean_luma(picture.path, thing.box)
    yield "brightness", "dark" if luma < DARK else "bright" if luma > BRIGHT else "middle"


def _mean_luma(path: Path, box: Box) -> float:
    """Mean 8-bit luma (BT.601) of a box; 0 where it lies outside."""
    grey = _luma(path)
    height, width = grey.shape
    x0, y0 = max(int(box[0]), 0), max(int(box[1]), 0)
    part = grey[y0 : min(round(box[3]), height), x0 : min(round(box[2]), width)]
    return float(part.mean()) if part.size else 0.0


@lru_cache(256)
def _luma(path: Path) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(real_pictures.read_image(path), cv2.COLOR_RGB2GRAY), np.uint8)
