"""Paths, readers and the data set of the drives that tests of sequence formats export."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

DRIVE = "2011_09_26/2011_09_26_drive_{:04d}_sync"


FRAMES = [f"{k:06d}" for k in range(4)]


def drive_info(world: Any) -> Any:
    return world.info(8, ("left", "right"), ("top",), steps_per_scene=4)


def stems(folder: Path) -> list[str]:
    """Names of files without their ends, sorted."""
    return sorted(path.stem for path in folder.iterdir())


def calibration(path: Path) -> dict[str, Any]:
    """Numbers of a calibration file by name, read as KITTI's devkit reads it."""
    rows = (line.split(None, 1) for line in path.read_text().splitlines())
    return {
        name.rstrip(":"): np.array(values.split(), float)
        for name, values in rows
        if not name.startswith("calib_time")
    }


def rigid(values: dict[str, Any]) -> Any:
    """[4, 4] of ``R`` and ``T``."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = values["R"].reshape(3, 3), values["T"]
    return matrix
