"""Laser scans of a data set in KITTI's format: how full they are, and how many points cars have."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gen_data.generator.core.errors import StorageError

SCANS_MAX = 200
"""Scans are alike; of a larger data set, as many are read, evenly chosen."""


@dataclass(frozen=True, slots=True)
class Scan:
    """One sweep.

    Attributes:
        points: How many.
        dark: How many of them have reflectance 0.
        cars: Distance over the ground [m] and points of every car that is not occluded.
    """

    points: int
    dark: int
    cars: tuple[tuple[float, int], ...]


def scans(folder: Path) -> Iterator[Scan]:
    """Scans of a data set, or of its ``kitti`` folder; none where it has no laser scanner.

    Raises:
        StorageError: if a file is not laid out as expected.
    """
    for root in (folder / "kitti/training", folder / "training"):
        labelled = sorted((root / "velodyne_labels").glob("*.label"))
        for path in labelled[:: max(1, math.ceil(len(labelled) / SCANS_MAX))]:
            yield _scan(root, path)


def _scan(root: Path, path: Path) -> Scan:
    try:
        points = np.fromfile(root / f"velodyne/{path.stem}.bin", "<f4").reshape(-1, 4)
        rows = np.fromfile(path, "<u4") >> np.uint32(16)
        lines = (root / f"label_2/{path.stem}.txt").read_text(encoding="utf-8").splitlines()
        if len(rows) != len(points):
            raise ValueError(f"{len(rows)} labels for {len(points)} points")
        counts = np.bincount(rows, minlength=len(lines) + 1)
        labels = [line.split(" ") for line in lines]
        cars = tuple(
            (math.hypot(float(label[11]), float(label[13])), int(counts[number]))
            for number, label in enumerate(labels, 1)
            if label[0] == "Car" and label[2] == "0"
        )
    except (OSError, ValueError, IndexError) as error:
        raise StorageError(f"{path}: not a scan with labels of KITTI's: {error}") from error
    return Scan(len(points), int((points[:, 3] == 0.0).sum()), cars)
