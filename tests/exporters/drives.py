"""Paths, readers and the data set of the drives that tests of sequence formats export."""

from pathlib import Path
from typing import Any

import numpy as np

DRIVE = "2011_09_26/2011_09_26_drive_{:04d}_sync"


FRAMES = [f"{k:06d}" for k in range(4)]


def drive_info(world: Any) -> Any:
    return world.info(8, ("left", "right"), ("top",), steps_per_scene=4)


def stems(folder: Path) -> list[str]:
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
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = values["R"].reshape(3, 3), values["T"]
    return matrix


def read_ply(path: Path) -> Any:
    """Records of a binary PLY file, by its header."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    words = [line.split() for line in header.decode("ascii").splitlines()]
    types = {"float": "<f4", "uint16": "<u2", "uint8": "u1"}
    return np.frombuffer(body, [(w[2], types[w[1]]) for w in words if w[0] == "property"])
