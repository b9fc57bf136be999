"""Statistics of laser scans in KITTI's format: points per scan, and points on cars."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gen_data.generator.core.errors import StorageError

SCANS_MAX = 200
"""Largest number of scans to read, chosen evenly: scans are similar."""


@dataclass(frozen=True, slots=True)
class Scan:
    """One sweep.

    Attributes:
        points: Number of points.
        dark: Number of points with reflectance 0.
        cars: Horizontal distance [m] and number of points of every unoccluded car.
    """

    points: int
    dark: int
    cars: tuple[tuple[float, int], ...]


def read_scans(folder: Path) -> Iterator[Scan]:
    """Read the scans of a data set, or of its ``kitti`` folder; none without a laser scanner.

    Raises:
        StorageError: a file does not have the expected layout.
    """
    for root in (folder / "kitti/training", folder / "training"):
        labelled = sorted((root / "velodyne_labels").glob("*.label"))
        for path in labelled[:: max(1, math.ceil(len(labelled) / SCANS_MAX))]:
            yield _read_scan(root, path)


def _read_scan(root: Path, path: Path) -> Scan:
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
        raise StorageError(f"{path}: not a scan with labels in KITTI's format: {error}") from error
    return Scan(len(points), int((points[:, 3] == 0.0).sum()), cars)
