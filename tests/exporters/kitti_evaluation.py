"""KITTI's average precision of 2D boxes, from its published definition.

Geiger et al., "Are we ready for Autonomous Driving?", CVPR 2012, section 2.3, and the benchmark's
readme: detections are assigned in the order of their scores, truth below the difficulty's limits
and of neighbouring classes counts neither way, as do detections in ``DontCare``. Precision is
interpolated at 40 recalls (Simonelli et al., "Disentangling Monocular 3D Object Detection", 2019).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

NEIGHBOURS = {"Car": "Van", "Pedestrian": "Person_sitting"}
IOU_MIN = {"Car": 0.7, "Pedestrian": 0.5, "Cyclist": 0.5}
RECALLS = np.arange(1, 41) / 40.0


@dataclass(frozen=True)
class Difficulty:
    height_min_px: float
    occlusion_max: int
    truncation_max: float


EASY, MODERATE, HARD = Difficulty(40, 0, 0.15), Difficulty(25, 1, 0.3), Difficulty(25, 2, 0.5)


@dataclass(frozen=True)
class Row:
    """Columns of a label file that the evaluation of 2D boxes reads."""

    kind: str
    truncation: float
    occlusion: int
    box: NDArray[np.float64]
    score: float

    @staticmethod
    def parse(line: str) -> Row:
        """From a line of a label file, or of a result with its score."""
        word = line.split()
        box = np.array(word[4:8], float)
        return Row(
            word[0], float(word[1]), int(word[2]), box, float(word[15]) if word[15:] else 1.0
        )


def overlap(one: NDArray[np.float64], other: NDArray[np.float64], *, of_one: bool) -> float:
    """IoU of two boxes; the covered share of the first with ``of_one``."""
    sides = np.minimum(one[2:], other[2:]) - np.maximum(one[:2], other[:2])
    common = float(np.prod(np.maximum(sides, 0.0)))
    areas = [float(np.prod(box[2:] - box[:2])) for box in (one, other)]
    return common / (areas[0] if of_one else sum(areas) - common)


def average_precision(
    frames: Sequence[tuple[Sequence[Row], Sequence[Row]]], kind: str, difficulty: Difficulty
) -> float:
    """AP of the detections (second) against the truth (first) of each frame; NaN without truth."""
    scores: list[tuple[float, bool]] = []
    counted = 0
    for truth, found in frames:
        rows = [row for row in truth if row.kind in (kind, NEIGHBOURS.get(kind))]
        counts = [
            row.kind == kind
            and row.box[3] - row.box[1] >= difficulty.height_min_px
            and row.occlusion <= difficulty.occlusion_max
            and row.truncation <= difficulty.truncation_max
            for row in rows
        ]
        counted += sum(counts)
        free = set(range(len(rows)))
        ignored = [row.box for row in truth if row.kind == "DontCare"]
        for row in sorted((r for r in found if r.kind == kind), key=lambda r: -r.score):
            near = {k: overlap(row.box, rows[k].box, of_one=False) for k in free}
            near = {k: iou for k, iou in near.items() if iou >= IOU_MIN[kind]}
            if near:
                best = max(near, key=lambda k: (counts[k], near[k]))
                free.remove(best)
                if counts[best]:
                    scores.append((row.score, True))
            elif row.box[3] - row.box[1] >= difficulty.height_min_px and not any(
                overlap(row.box, box, of_one=True) >= IOU_MIN[kind] for box in ignored
            ):
                scores.append((row.score, False))
    if counted == 0:
        return float("nan")
    hits = np.array([hit for _, hit in sorted(scores, key=lambda pair: -pair[0])], float)
    ranks = np.arange(1, len(hits) + 1)
    recall, precision = np.cumsum(hits) / counted, np.cumsum(hits) / ranks
    best = [precision[recall >= r - 1e-9].max(initial=0.0) for r in RECALLS]
    return float(np.mean(best))
