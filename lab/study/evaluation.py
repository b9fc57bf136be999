"""COCO's average precision of detections, for any choice of pictures, and missed objects.

The figures are pycocotools' figures, which COCO's own evaluation uses.
"""

import contextlib
import copy
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core.errors import ConfigError
from gen_data.lab.matching.label_files import Box, RealObject
from gen_data.lab.study.real_pictures import RealPicture, RealSet

MATCH_IOU = 0.5
"""Intersection over union from which a detection finds an object, in counts of misses."""


@dataclass(frozen=True)
class Evaluation:
    """Detections of one detector, matched with the objects of some pictures.

    Attributes:
        judged: COCO's evaluation of every picture.
        pictures: The pictures, in the order of ``judged``.
    """

    judged: Any
    pictures: tuple[RealPicture, ...]

    def average_precisions(self, chosen: NDArray[np.int64] | None = None) -> NDArray[np.float64]:
        """AP and AP50 by class [2, classes] over pictures with these numbers; None = all.

        A number may occur repeatedly. NaN = the class has no object in these pictures.
        """
        judged = copy.copy(self.judged)
        if chosen is not None:
            numbers, count = chosen.tolist(), len(self.pictures)
            judged.evalImgs = [
                judged.evalImgs[row * count + number]
                for row in range(len(judged.params.catIds))
                for number in numbers
            ]
            # COCO's code reads the number of pictures from its parameters.
            judged.params = judged._paramsEval = copy.copy(judged.params)
            judged.params.imgIds = list(range(len(numbers)))
        with contextlib.redirect_stdout(io.StringIO()):
            judged.accumulate()
        precision = judged.eval["precision"][:, :, :, 0, -1]  # IoU, recall, class; all areas
        precision = np.where(precision > -1, precision, np.nan)
        return np.stack([precision.mean(axis=(0, 1)), precision[0].mean(axis=0)])

    @cached_property
    def matches(self) -> "list[Match]":
        """Objects that were found, missed, and false alarms; see ``match_objects``."""
        return match_objects(self)[0]

    def summary(self, chosen: NDArray[np.int64] | None = None) -> NDArray[np.float64]:
        """AP and AP50 [2], the means over classes that occur."""
        with np.errstate(invalid="ignore"):
            mean: NDArray[np.float64] = np.nanmean(self.average_precisions(chosen), axis=1)
        return mean


def evaluate(
    real: RealSet,
    results: Sequence[Mapping[str, Any]],
    pictures: Sequence[RealPicture] | None = None,
) -> Evaluation:
    """Match COCO results with the objects of a real set.

    Args:
        real: The objects; results of other categories are left out.
        results: ``image_id``, ``category_id``, ``bbox`` (x, y, width, height [px]) and ``score``.
        pictures: The pictures that count; None = all.
    """
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval

    chosen = real.pictures if pictures is None else tuple(pictures)
    known, classes = {picture.image_id for picture in chosen}, set(real.category_ids.values())
    kept = [
        {key: row[key] for key in ("image_id", "category_id", "bbox", "score")}
        for row in results
        if row["image_id"] in known and row["category_id"] in classes
    ]
    with contextlib.redirect_stdout(io.StringIO()):
        truth, found = COCO(), COCO()
        truth.dataset = real.to_coco(chosen)
        truth.createIndex()
        if kept:
            found = truth.loadRes(kept)
        else:
            found.dataset = {**truth.dataset, "annotations": []}
            found.createIndex()
        judged = COCOeval(truth, found, "bbox")
        judged.params.catIds = sorted(classes)
        # The headline figures only: all areas, and at most 100 detections per picture.
        judged.params.areaRng, judged.params.areaRngLbl = [[0.0, 1e10]], ["all"]
        judged.params.maxDets = [100]
        judged.evaluate()
    return Evaluation(judged, tuple(sorted(chosen, key=lambda picture: picture.image_id)))


def read_results(path: Path, real: RealSet) -> list[dict[str, Any]]:
    """Read a file of COCO results of any detector on the pictures of a real set.

    Raises:
        ConfigError: it is not such a file, or results of other pictures or classes.
    """
    try:
        return check_results(json.loads(path.read_text(encoding="utf-8")), path, real)
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}; expected a file with COCO results") from error
    except ValueError as error:
        raise ConfigError(f"{path}: not COCO results ({error}); expected {_WANTED}") from error


_WANTED = "a list of {image_id, category_id, bbox: [x, y, width, height], score}"


def check_results(rows: Any, path: Path, real: RealSet) -> list[dict[str, Any]]:
    """Content of a file of results, with these four keys.

    Raises:
        ConfigError: it is something else, or results of other pictures or classes.
    """
    if not isinstance(rows, list):
        raise ConfigError(f"{path}: not COCO results; expected {_WANTED}")
    try:
        checked = [
            {
                "image_id": row["image_id"],
                "category_id": row["category_id"],
                "bbox": [_finite(value) for value in row["bbox"]],
                "score": _finite(row["score"]),
            }
            for row in rows
        ]
        if wrong := [row["bbox"] for row in checked if len(row["bbox"]) != 4]:
            raise ValueError(f"bbox: {wrong[0]}")
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{path}: not COCO results ({error!r}); expected {_WANTED}") from error
    pictures = {picture.image_id for picture in real.pictures}
    for key, known in (("image_id", pictures), ("category_id", set(real.category_ids.values()))):
        strange = sorted({row[key] for row in checked} - known, key=str)
        if strange and len(strange) == len({row[key] for row in checked}):
            raise ConfigError(
                f"{path}: has results of another data set: none of its {key} values, such as "
                f"{strange[0]}, is in {real.source}"
            )
    return checked


def _finite(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{number} is not finite")
    return number


@dataclass(frozen=True, slots=True)
class Match:
    """An object and whether it was found, or a false alarm.

    Attributes:
        picture: Number of the picture in the evaluation.
        thing: The object; None = a false alarm.
        box: Box of the detection that found it, or of the false alarm; None = missed.
        name: Class of the object or false alarm.
        score: Score of that detection; 0 = missed.
    """

    picture: int
    thing: RealObject | None
    box: Box | None
    name: str
    score: float


def match_objects(evaluation: Evaluation) -> tuple[list[Match], float]:
    """Objects that were found, missed, and false alarms, at the score of the best F1.

    Returns:
        The matches at an intersection over union of ``MATCH_IOU``, and the smallest score of
        the detections that count.
    """
    judged = evaluation.judged
    names = {row["id"]: row["name"] for row in judged.cocoGt.dataset["categories"]}
    numbers = {picture.image_id: k for k, picture in enumerate(evaluation.pictures)}
    every: list[Match] = []
    alarms: list[Match] = []
    for entry in judged.evalImgs:
        if entry is None:
            continue
        name, picture = names[entry["category_id"]], numbers[entry["image_id"]]
        scores = dict(zip(entry["dtIds"], entry["dtScores"], strict=True))
        rows = [judged.cocoGt.anns[k] for k in entry["gtIds"]]
        for row, ignored, found in zip(
            rows, entry["gtIgnore"], entry["gtMatches"][0].astype(int), strict=True
        ):
            if ignored:
                continue
            thing = RealObject(name, _sides(row["bbox"]), False, row["occlusion"])
            box = _sides(judged.cocoDt.anns[found]["bbox"]) if found else None
            every.append(Match(picture, thing, box, name, scores.get(found, 0.0)))
        for number, matched, ignored in zip(
            entry["dtIds"], entry["dtMatches"][0], entry["dtIgnore"][0], strict=True
        ):
            if not matched and not ignored:
                box = _sides(judged.cocoDt.anns[number]["bbox"])
                alarms.append(Match(picture, None, box, name, scores[number]))
    least = _best_threshold(every, alarms)
    found_or_missed = [
        match if match.score >= least else Match(match.picture, match.thing, None, match.name, 0.0)
        for match in every
    ]
    return [*found_or_missed, *(alarm for alarm in alarms if alarm.score >= least)], least


def _best_threshold(objects: Sequence[Match], alarms: Sequence[Match]) -> float:
    """Score of the largest F1 = 2 found / (objects + detections)."""
    found = [match.score for match in objects if match.box is not None]
    scores = np.array(found + [match.score for match in alarms])
    if not found:
        return 0.0 if not scores.size else float(scores.max())
    is_found = np.arange(len(scores)) < len(found)
    order = np.argsort(-scores, kind="stable")
    true = np.cumsum(is_found[order])
    f1 = 2.0 * true / (len(objects) + np.arange(1, len(scores) + 1))
    return float(scores[order][int(np.argmax(f1))])


def _sides(bbox: Sequence[float]) -> Box:
    x, y, width, height = bbox
    return x, y, x + width, y + height
