"""Lane borders, in the world and in images."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.lane_geometry import lane_borders
from gen_data.core.lane_projection import project_borders
from gen_data.core.sample import BorderTruth, EgoTruth, ImageTruth
from gen_data.core.scene import Scene
from gen_data.core.se3 import Array

OCCLUDER_MIN_M = 0.15
"""Hits less than this above the ground hide no border: kerbs, wet leaves, rounding."""
NEARER = 0.9
"""Hits nearer than this part of the distance hide a border, however low they are."""


class Lanes(Strict):
    """Borders of driving lanes: lines in the world, and their points in every image.

    Occluded points are included, as in CULane and TuSimple, and flagged.

    Attributes:
        far_m: Points farther from the camera are left out.
        step_px: Approximate distance of the points of a line in the image.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.RANGE})
    type: Literal["lanes"] = "lanes"
    far_m: float = Field(100.0, gt=0)
    step_px: float = Field(8.0, ge=1)

    def annotate_image(
        self, scene: Scene, assets: AssetLibrary, reading: SensorReading, truth: ImageTruth
    ) -> ImageTruth:
        """Fill in ``borders``, in the order of the scene's lanes."""
        del assets
        borders = lane_borders(scene.lanes)
        numbers, p_camera, uv = project_borders(scene, reading.camera, borders, self.far_m)
        lines = [start + thin_line(uv[start:end], self.step_px) for start, end in runs(numbers)]
        rows = np.concatenate([np.zeros(0, np.intp), *lines])
        visible = is_seen(reading, p_camera[rows], uv[rows]).tolist()
        points = [(round(u, 2), round(v, 2)) for u, v in uv[rows].tolist()]
        found, done = [], 0
        for line in lines:
            border = borders[numbers[line[0]] >> 32]
            own = slice(done, done := done + len(line))
            found.append(
                BorderTruth(border.name, border.kind, tuple(points[own]), tuple(visible[own]))
            )
        return replace(truth, borders=tuple(found))

    def annotate_frame(
        self, scenes: Mapping[str, Scene], assets: AssetLibrary, truth: EgoTruth
    ) -> EgoTruth:
        """Fill in ``borders``."""
        del assets
        return replace(truth, borders=lane_borders(scenes[""].lanes))


def runs(numbers: NDArray[np.intp]) -> list[tuple[int, int]]:
    """Half-open ranges of two or more consecutive numbers in an ascending list."""
    gaps = np.flatnonzero(np.diff(numbers) != 1) + 1
    return [(a, b) for a, b in pairwise([0, *gaps.tolist(), len(numbers)]) if b - a > 1]


def thin_line(uv: Array, step_px: float) -> NDArray[np.intp]:
    """Indices of points about a step apart along a line of image points, including both ends."""
    du, dv = (uv[1:] - uv[:-1]).T
    lengths = np.sqrt(du * du + dv * dv)
    bins = (np.concatenate([[0.0], np.cumsum(lengths)]) / step_px).astype(np.int64)
    first = [0, *(np.flatnonzero(bins[1:] != bins[:-1]) + 1).tolist()]
    return np.array(first if first[-1] == len(uv) - 1 else [*first, len(uv) - 1])


def is_seen(reading: SensorReading, p_camera: Array, uv: Array) -> NDArray[np.bool_]:
    """Whether points on the ground, [n, 3] in the camera frame, are visible, bool [n].

    They are unless objects on the ground or crests occlude them. ``uv`` are their image
    coordinates, [n, 2]. Between rows of pixels, ground far ahead recedes by metres, and slopes fall
    by more than low occluders are high: there the inverse range is interpolated, which is linear
    in the image for a plane.
    """
    ranges_m = reading.channels[Channel.RANGE]
    height, width = ranges_m.shape
    columns, rows = (uv[:, k].astype(np.intp) for k in (0, 1))
    range_m = np.maximum(ranges_m[rows, columns], _range_between(ranges_m, uv))
    away_m = np.sqrt((p_camera * p_camera).sum(axis=1))
    first_hit = p_camera * (np.minimum(range_m, away_m) / away_m)[:, None]
    above_m = reading.camera.T_world_camera.rotate(first_hit - p_camera)[:, 2]
    # On hills, occluders may be lower than the point: they are much nearer, around the pixel, too.
    beyond_m = np.zeros(len(uv))
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            near = np.clip(rows + down, 0, height - 1), np.clip(columns + right, 0, width - 1)
            beyond_m = np.maximum(beyond_m, ranges_m[near])
    return np.asarray((above_m < OCCLUDER_MIN_M) & (beyond_m > NEARER * away_m))


def _range_between(ranges_m: NDArray[np.float32], uv: Array) -> Array:
    """Ranges [n] at image coordinates [n, 2], whose inverse is bilinear between centres of pixels.

    At most 1e9 m.
    """
    height, width = ranges_m.shape
    low, share = np.divmod(uv - 0.5, 1.0)
    column, row = low.T.astype(np.intp)
    x, y = share.T
    inverse = np.full(len(uv), 1e-9)
    for down, by_row in ((0, 1.0 - y), (1, y)):
        for right, by_column in ((0, 1.0 - x), (1, x)):
            at = np.clip(row + down, 0, height - 1), np.clip(column + right, 0, width - 1)
            inverse += by_row * by_column / ranges_m[at]
    return 1.0 / inverse
