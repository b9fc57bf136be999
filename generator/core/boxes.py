"""Boxes in images and in space; whether oriented boxes overlap, on the ground and in space.

Convex bodies are disjoint if and only if some axis separates them: their projections onto it are
disjoint. For boxes it is enough to try the normals of their faces and, in space, the nine
directions across an edge of each (Gottschalk, Lin and Manocha, "OBBTree", SIGGRAPH 1996).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import SE3, Array, Vec3


@dataclass(frozen=True, slots=True)
class BoxPx:
    """An axis-aligned box of whole pixels, half-open: ``x_min <= x < x_max``.

    Corner convention of COCO: a box over the single pixel (3, 5) is (3, 5, 4, 6).
    Amodal boxes may reach outside the image.
    """

    x_min: int
    y_min: int
    x_max: int
    y_max: int

    @property
    def width_px(self) -> int:
        """Number of pixel columns."""
        return self.x_max - self.x_min

    @property
    def height_px(self) -> int:
        """Number of pixel rows."""
        return self.y_max - self.y_min

    def clipped(self, width_px: int, height_px: int) -> BoxPx | None:
        """The part inside an image, or None where nothing is left."""
        box = self.intersection(BoxPx(0, 0, width_px, height_px))
        return None if box.is_empty else box

    @property
    def is_empty(self) -> bool:
        """Whether it contains no pixel."""
        return self.x_min >= self.x_max or self.y_min >= self.y_max

    def intersection(self, other: BoxPx) -> BoxPx:
        """The common part; empty, at the other's first corner, if there is none."""
        x_min, y_min = max(self.x_min, other.x_min), max(self.y_min, other.y_min)
        x_max, y_max = min(self.x_max, other.x_max), min(self.y_max, other.y_max)
        if x_min >= x_max or y_min >= y_max:
            return BoxPx(other.x_min, other.y_min, other.x_min, other.y_min)
        return BoxPx(x_min, y_min, x_max, y_max)

    def union(self, other: BoxPx) -> BoxPx:
        """Smallest box around both, either of which may be empty."""
        if self.is_empty or other.is_empty:
            return other if self.is_empty else self
        x_min, y_min = min(self.x_min, other.x_min), min(self.y_min, other.y_min)
        return BoxPx(x_min, y_min, max(self.x_max, other.x_max), max(self.y_max, other.y_max))

    def window(self, x0: int = 0, y0: int = 0) -> tuple[slice, slice]:
        """Rows and columns of the box in an image whose first pixel is at ``x0``, ``y0``."""
        return slice(self.y_min - y0, self.y_max - y0), slice(self.x_min - x0, self.x_max - x0)


def tight_box(mask: NDArray[np.bool_], x0: int = 0, y0: int = 0) -> BoxPx | None:
    """Smallest box around the set pixels of ``mask``, shape [height, width]; None if none is set.

    ``x0``, ``y0`` is where the mask's first pixel lies in the image [px].
    """
    rows = np.flatnonzero(mask.any(axis=1))
    if rows.size == 0:
        return None
    columns = np.flatnonzero(mask.any(axis=0))
    return BoxPx(
        x0 + int(columns[0]), y0 + int(rows[0]), x0 + int(columns[-1]) + 1, y0 + int(rows[-1]) + 1
    )


_CORNER_SIGNS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True, slots=True)
class OrientedBox:
    """A box in space: its centre and axes are ``T_frame_box``, its full edge lengths ``size_m``."""

    T_frame_box: SE3
    size_m: Vec3

    def corners(self) -> Array:
        """The eight corners in the outer frame [m], shape [8, 3]; x varies slowest."""
        half = 0.5 * np.asarray(self.size_m)
        return self.T_frame_box.apply(_CORNER_SIGNS * half)

    def seen_from(self, T_other_frame: SE3) -> OrientedBox:
        """The same box, expressed in another frame."""
        return OrientedBox(T_other_frame @ self.T_frame_box, self.size_m)


_SLACK_M = 1e-12


def rectangles_overlap(a: Array, half_a_m: Array, b: Array, half_b_m: Array) -> NDArray[np.bool_]:
    """Whether rectangles have inner points in common, pair by pair; arrays are broadcast.

    ``a`` and ``b`` are their centres [m] and the directions of their first half extents: x, y,
    cosine, sine; shape [..., 4]. Half extents have the shape [..., 2].
    """
    first, second = (
        (of[..., 0], of[..., 1], of[..., 2], of[..., 3], half_m[..., 0], half_m[..., 1])
        for of, half_m in ((a, half_a_m), (b, half_b_m))
    )
    overlap: NDArray[np.bool_] = overlap_of(first, second)
    return overlap


Rectangle = tuple[Any, Any, Any, Any, Any, Any]
"""Centre x, y [m], direction of the first half extent (cosine, sine), half extents [m]; numbers, or
arrays of one shape."""


def overlap_of(a: Rectangle, b: Rectangle) -> Any:
    """``rectangles_overlap`` of rectangles in components: numbers give a bool, arrays an array."""
    (x_a, y_a, cos_a, sin_a, ax, ay), (x_b, y_b, cos_b, sin_b, bx, by) = a, b
    dx, dy = x_b - x_a, y_b - y_a
    # Of the angle between both: how much of one's extents counts along the other's axes.
    c = abs(cos_a * cos_b + sin_a * sin_b)
    s = abs(cos_a * sin_b - sin_a * cos_b)
    return (
        (abs(dx * cos_a + dy * sin_a) < ax + bx * c + by * s)
        & (abs(dy * cos_a - dx * sin_a) < ay + bx * s + by * c)
        & (abs(dx * cos_b + dy * sin_b) < bx + ax * c + ay * s)
        & (abs(dy * cos_b - dx * sin_b) < by + ax * s + ay * c)
    )


def boxes_touch(T_world_a: SE3, half_a_m: Vec3, T_world_b: SE3, half_b_m: Vec3) -> bool:
    """Whether two boxes, given by their centres and half extents, have a point in common."""
    between = np.asarray(T_world_b.translation_m) - np.asarray(T_world_a.translation_m)
    half_a, half_b = np.array(half_a_m), np.array(half_b_m)
    reach_m = float(np.sqrt(np.sum(half_a * half_a))) + float(np.sqrt(np.sum(half_b * half_b)))
    if float(between @ between) > reach_m * reach_m:
        return False
    edges_a, edges_b = T_world_a.rotation().T, T_world_b.rotation().T
    across = np.cross(edges_a[:, None], edges_b[None]).reshape(9, 3)
    axes = np.concatenate([edges_a, edges_b, across])
    span_m = np.abs(axes @ edges_a.T) @ half_a + np.abs(axes @ edges_b.T) @ half_b
    # Parallel edges give an axis of length 0, along which nothing may count as separated.
    return bool(np.all(np.abs(axes @ between) <= span_m + _SLACK_M))
