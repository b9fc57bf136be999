"""Recall of a detector by the detectability of objects, overall and for boxes of equal size.

::

    gen-data --config CONFIG --n 420 -o out/train
    gen-data --config CONFIG --n 160 --seed 1 -o out/test
    python examples/train_detector.py out/train --eval out/test/coco --save detector.pt
    python -m benchmarks.bench_detectability detector.pt out/test/coco

The folder is an export ``coco`` whose annotations have the key ``detectability``.
"""

import argparse
import json
from collections import defaultdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gen_data.lab.study.detector import Detector
from gen_data.lab.study.real_pictures import read_real
from gen_data.lab.study.training import detect_all

DETECTABILITY = (0, 5, 10, 20, 40, 80, np.inf)
SIZES_PX = (0, 16, 32, np.inf)
"""Limits of the longer side of boxes."""
IOU_MIN, SCORE_MIN = 0.5, 0.2


def main() -> None:
    """Print one row per size: recall and number of objects for each range of d'."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("detector", type=Path)
    parser.add_argument("folder", type=Path)
    given = parser.parse_args()
    model = Detector.load(given.detector)
    real = read_real(given.folder, "").restrict(model.classes)
    found: dict[tuple[int, int], list[list[float]]] = defaultdict(list)
    for result in detect_all(model, real, real.pictures):
        if result["score"] >= SCORE_MIN:
            found[result["image_id"], result["category_id"]].append(result["bbox"])
    rows = [
        (one["detectability"], max(one["bbox"][2:]), is_found(one["bbox"], found[key]))
        for path in (given.folder / "annotations").glob("*.json")
        for one in json.loads(path.read_text()).get("annotations", ())
        if not one["iscrowd"] and "detectability" in one
        for key in [(one["image_id"], one["category_id"])]
    ]
    values = np.array(rows, float)
    low, high = np.array(SIZES_PX[:-1]), np.array(SIZES_PX[1:])
    print("d'", *DETECTABILITY)
    for least, most in [(0.0, np.inf), *zip(low, high, strict=True)]:
        kept = values[(values[:, 1] >= least) & (values[:, 1] < most)]
        print(f"{least:g} to {most:g} px:", *recalls(kept[:, 0], kept[:, 2]), sep="  ")


def is_found(box: list[float], boxes: list[list[float]]) -> bool:
    """Whether one of the boxes (x, y, width, height) overlaps enough."""
    mine, others = np.array(box), np.reshape(boxes, (-1, 4))
    last = np.minimum(mine[:2] + mine[2:], others[:, :2] + others[:, 2:])
    common = np.prod(np.clip(last - np.maximum(mine[:2], others[:, :2]), 0, None), axis=1)
    whole = np.prod(mine[2:]) + np.prod(others[:, 2:], axis=1) - common
    return bool((common / whole >= IOU_MIN).any())


def recalls(detectability: NDArray[np.float64], found: NDArray[np.float64]) -> list[str]:
    """Share of found objects, and their number, for each range of d'."""
    number = np.digitize(detectability, DETECTABILITY[1:])
    parts = (found[number == k] for k in range(len(DETECTABILITY) - 1))
    return [f"{part.mean():.2f} ({len(part)})" if len(part) else "-" for part in parts]


if __name__ == "__main__":
    main()
