"""Statistics of episodes as LeRobot stores them, for the normalisation of policies' inputs.

A feature has least and largest value, mean, deviation and count, and numbers also the quantiles
that LeRobot names. Images count in fractions of 255, with the shape [3, 1, 1]. Statistics of images
are exact over every ``n``-th pixel, with LeRobot's own ``n``: about 150 pixels along the longer
side.

Reference: https://github.com/huggingface/lerobot, release 0.4.4, lerobot/datasets/compute_stats.py.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.exporters.image_files import read_pixels

STATISTICS_PX, WHOLE_PX = 150, 300
"""Longer side of the images in statistics, and the length below which all pixels count [px]."""
DECIMALS = 9
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}


def image_sums(path: Path) -> dict[str, Any]:
    """Sums over every n-th pixel by channel, whole numbers from 0 to 255."""
    rgb = read_pixels(path)
    height, width = rgb.shape[:2]
    longer = max(width, height)
    stride = max(1, longer // STATISTICS_PX) if longer >= WHOLE_PX else 1
    values = np.arange(256)
    counts = [np.bincount(rgb[::stride, ::stride, k].ravel(), minlength=256) for k in range(3)]
    present = [np.flatnonzero(count) for count in counts]
    return {
        "size_px": [width, height],
        "count": int(counts[0].sum()),
        "min": [int(found[0]) for found in present],
        "max": [int(found[-1]) for found in present],
        "sum": [int(count @ values) for count in counts],
        "squares": [int(count @ (values * values)) for count in counts],
    }


def number_statistics(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Statistics of the numbers of an episode by feature, of the values as stored."""
    stats = {}
    for name in rows[0]:
        if isinstance(rows[0][name], str):
            continue
        stored = np.array([row[name] for row in rows])
        if stored.dtype.kind == "f":
            stored = stored.astype(np.float32)
        table = stored.astype(np.float64).reshape(len(rows), -1)
        columns = table.T.tolist()
        stats[name] = {
            "min": [min(values) for values in columns],
            "max": [max(values) for values in columns],
            # fsum is exact: the result is the same on every machine.
            "mean": [_mean(values) for values in columns],
            "std": [_deviation(values) for values in columns],
            "count": [len(rows)],
            **{
                key: np.round(np.quantile(table, share, axis=0), DECIMALS).tolist()
                for key, share in QUANTILES.items()
            },
        }
    return stats


def image_statistics(frames: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Statistics of the images of an episode by camera, from their sums."""
    stats = {}
    for camera in frames[0]:
        sums = [frame[camera] for frame in frames]
        columns: dict[str, list[Any]] = {name: [] for name in ("min", "max", "mean", "std")}
        for k in range(3):
            n = sum(one["count"] for one in sums)
            total = sum(one["sum"][k] for one in sums)
            squares = sum(one["squares"][k] for one in sums)
            # Whole numbers: nothing is lost in the difference.
            deviation = math.sqrt(n * squares - total * total) / n
            columns["min"].append([[min(one["min"][k] for one in sums) / 255.0]])
            columns["max"].append([[max(one["max"][k] for one in sums) / 255.0]])
            columns["mean"].append([[round(total / n / 255.0, DECIMALS)]])
            columns["std"].append([[round(deviation / 255.0, DECIMALS)]])
        stats[camera] = {**columns, "count": [len(frames)]}
    return stats


def merge_statistics(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, Any]:
    """Statistics by feature of two disjoint sets of frames together.

    Quantiles are means weighted by the number of frames, as LeRobot merges episodes' quantiles.
    """
    return {name: _merged(first[name], second[name]) for name in first}


def _merged(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, Any]:
    """Both sets of one feature; variances by Chan et al., "Updating formulae", 1979."""
    weights = [one["count"][0] for one in (first, second)]
    total = sum(weights)

    def average(values: Sequence[np.ndarray]) -> np.ndarray:
        return np.average(values, axis=0, weights=weights)

    def of_both(key: str) -> list[np.ndarray]:
        return [np.asarray(one[key], np.float64) for one in (first, second)]

    mean = average(of_both("mean"))
    spreads = zip(of_both("mean"), of_both("std"), strict=True)
    variance = average([std**2 + (one - mean) ** 2 for one, std in spreads])
    return {
        "min": np.minimum(*of_both("min")).tolist(),
        "max": np.maximum(*of_both("max")).tolist(),
        "mean": mean.tolist(),
        "std": np.sqrt(variance).tolist(),
        "count": [total],
        **{key: average(of_both(key)).tolist() for key in QUANTILES if key in first},
    }


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def _deviation(values: Sequence[float]) -> float:
    mean = _mean(values)
    return round(math.sqrt(math.fsum((v - mean) ** 2 for v in values) / len(values)), DECIMALS)
