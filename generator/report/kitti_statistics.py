"""Published statistics of KITTI's object training set, from ``kitti_statistics.yaml``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import yaml


@dataclass(frozen=True, slots=True)
class KittiType:
    """One of KITTI's types: number of objects, and mean height, width and length [m]."""

    objects: int
    size_hwl_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Difficulty:
    """Limits for an object to count at a difficulty.

    Attributes:
        height_px: Smallest height of its box.
        occlusion_level, truncation: Largest values.
    """

    name: str
    height_px: float
    occlusion_level: int
    truncation: float


_TABLES = yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text(encoding="utf-8"))
IMAGES: int = _TABLES["images"]
POINTS_PER_SCAN: tuple[int, int] = tuple(_TABLES["points_per_scan"])
"""Points per scan of the raw recordings, and of the odometry sequences."""
TYPES = {name: KittiType(**row) for name, row in _TABLES["types"].items()}
DIFFICULTIES = tuple(Difficulty(**row) for row in _TABLES["difficulties"])
