"""Evaluations of written text: ICDAR 2015 and COCO-Text."""

import json
import sys
import unittest.mock
from pathlib import Path

import numpy as np

MOVED_PX = 60.0
"""More than the size of most words."""


def by_icdar(code: Path, data: Path, out: Path, moved: float) -> float:
    """Harmonic mean of ICDAR 2015's evaluation, in the version for Shapely of the detector DB."""
    del out
    sys.path.insert(0, str(code))
    from iou import DetectionIoUEvaluator

    judge, results = DetectionIoUEvaluator(), []
    for path in (data / "text/scene_text/icdar2015").glob("*/gt/*.txt"):
        rows = [row.split(",", 8) for row in path.read_text("utf-8-sig").splitlines()]
        corners = [np.array(row[:8], float).reshape(4, 2) for row in rows]
        words = [
            {"points": points, "text": row[8], "ignore": row[8] == "###"}
            for row, points in zip(rows, corners, strict=True)
        ]
        found = [{**word, "points": word["points"] + moved * MOVED_PX} for word in words]
        results.append(judge.evaluate_image(words, found))
    return float(judge.combine_results(results)["hmean"])


def by_coco_text(code: Path, data: Path, out: Path, moved: float) -> float:
    """F-score of COCO-Text's evaluation: boxes with half their area in common."""
    sys.modules["editdistance"] = unittest.mock.MagicMock()  # of transcriptions, which it compares
    sys.path.insert(0, str(code))
    from coco_evaluation import getDetections
    from coco_text import COCO_Text

    truth = data / "text/scene_text/coco_text/cocotext.v2.json"
    content = json.loads(truth.read_text())
    for word in content["anns"].values():
        word["bbox"] = [v + moved * MOVED_PX * (k < 2) for k, v in enumerate(word["bbox"])]
    out.mkdir(parents=True)
    (out / "found.json").write_text(json.dumps(content))
    given, found = COCO_Text(str(truth)), COCO_Text(str(out / "found.json"))
    counts = {k: len(v) for k, v in getDetections(given, found, imgIds=[]).items()}
    wrong = counts["false_positives"] + counts["false_negatives"]
    return 2 * counts["true_positives"] / (2 * counts["true_positives"] + wrong)
