"""Centre lines as paths of arcs, as nuScenes' map expansion has them.

A path consists of three parts, left or right turns of one radius or straights, in the words of
Dubins' curves. Each step between two points of a centre line becomes a path with one part: the arc
through both points that turns as the line does; straight steps in one direction are joined.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from gen_data.core.se3 import Array

STRAIGHT_RAD = 1e-4
"""Steps that turn by less are straight."""
STRAIGHT_RADIUS_M = 999.999
"""Radius that a path states if no part of it is an arc."""
DECIMALS = 6


def arc_paths(line: Array) -> list[dict[str, Any]]:
    """Paths along the points [n, 2] of a line, in order; their ends are points of the line."""
    return [_path(*step) for step in _steps(line)]


def _steps(line: Array) -> Iterator[tuple[Array, Array, float, float]]:
    """Start, end, direction of the chord and turn of each step."""
    chords = np.diff(line, axis=0)
    yaw = np.unwrap(np.arctan2(chords[:, 1], chords[:, 0]))
    # Directions at the points: means of the steps around them; the ends continue their steps.
    inner = 0.5 * (yaw[:-1] + yaw[1:])
    at = np.concatenate([[2.0 * yaw[0] - inner[0]], inner, [2.0 * yaw[-1] - inner[-1]]]) \
        if len(yaw) > 1 else np.repeat(yaw, 2)  # fmt: skip
    turns = np.diff(at)
    start = 0
    for k in range(len(chords)):
        straight = abs(turns[k]) < STRAIGHT_RAD
        goes_on = k + 1 < len(chords) and abs(turns[k + 1]) < STRAIGHT_RAD
        if straight and goes_on and abs(yaw[k + 1] - yaw[start]) < STRAIGHT_RAD:
            continue
        chord = line[k + 1] - line[start]
        direction = math.atan2(chord[1], chord[0])
        yield line[start], line[k + 1], direction, 0.0 if straight else float(turns[k])
        start = k + 1


def _path(start: Array, end: Array, direction: float, turn: float) -> dict[str, Any]:
    chord_m = math.dist(start, end)
    radius_m, lengths_m = STRAIGHT_RADIUS_M, [0.0, chord_m, 0.0]
    if turn:
        radius_m = 0.5 * chord_m / math.sin(0.5 * abs(turn))
        lengths_m = [radius_m * abs(turn), 0.0, 0.0]
    return {
        "start_pose": _pose(start, direction - 0.5 * turn),
        "end_pose": _pose(end, direction + 0.5 * turn),
        "shape": "RSR" if turn < 0.0 else "LSL",
        "radius": round(radius_m, DECIMALS),
        "segment_length": [round(v, DECIMALS) for v in lengths_m],
    }


def _pose(point: Array, yaw: float) -> list[float]:
    values = (float(point[0]), float(point[1]), math.remainder(yaw, math.tau))
    return [round(v, DECIMALS) + 0.0 for v in values]
