"""Polygons around masks, along the edges of their pixels.

Vertices are corners of pixels: polygons bound exactly the pixels of the mask, in the convention in
which pixel ``i`` covers ``[i, i + 1)``. Contours through pixel centres (OpenCV's ``findContours``)
lose half a pixel on every side.

Rasterisers disagree about pixels on an edge: pycocotools leaves them out on the right and below,
OpenCV's ``fillPoly`` and PIL's ``ImageDraw`` include them. ``drawable_polygons`` moves all edges
inwards by ``INSET_PX``, and all of them draw the same pixels.

Pixels that only touch at a corner belong to different polygons. A polygon surrounds its pixels
clockwise in the image (y down); it leads to each hole and back along one vertical line, because
COCO's list of polygons has no holes. The even-odd and the nonzero rule both leave holes empty.

Reference for the pairing of corners: O'Rourke, "Uniqueness of orthogonal connect-the-dots", 1988:
vertices of a rectilinear polygon, sorted along each line, are joined in pairs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from operator import itemgetter
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from gen_data.core.sample import MaskPx

Polygon = NDArray[np.int64]
"""Vertices [n, 2] as (x, y) in image coordinates [px]; the last is joined to the first."""
Outline = NDArray[np.float64]
"""Vertices [n, 2] that need not be corners of pixels; otherwise a ``Polygon``."""

INSET_PX = 0.02
"""Rasterisers that cut vertices to whole pixels draw exactly the mask; larger images lose less than
with a larger inset."""
TRACED_MASKS = 1024
"""Masks whose outlines are kept: about the masks of a shard, which each format reads in turn."""


def mask_polygons(mask: MaskPx) -> list[Polygon]:
    """Trace a mask: one polygon per group of pixels with common edges; empty for an empty mask.

    The polygons are disjoint, and in the order of their topmost left corners.
    """
    pixels = mask.pixels
    corners = _find_corners(pixels)
    bridges: dict[int, list[tuple[int, Polygon]]] = {}
    polygons = []
    # A hole is attached to a border above it; lower borders are complete before.
    for border in reversed(_trace_borders(corners)):
        path = _follow(border, corners, bridges)
        x, y = path[0].tolist()
        if border[0] % 2 == 0:
            outline = _without_repeats(path) if bridges else path
            polygons.append(outline + np.array([mask.x_px, mask.y_px]))
            continue
        solid = pixels[:y, x - 1] & pixels[:y, x]
        top = y - int(np.argmin(solid[::-1])) if not solid.all() else 0
        bridges.setdefault(corners.edge_at(x, top), []).append((x, path))
    return polygons[::-1]


@lru_cache(maxsize=TRACED_MASKS)
def drawable_polygons(mask: MaskPx) -> tuple[Outline, ...]:
    """Trace a mask as ``mask_polygons``, with all edges moved inwards by ``INSET_PX``.

    The outlines are read-only: formats that are written one after the other share them.
    """
    outlines = tuple(_inset(polygon) for polygon in mask_polygons(mask))
    for outline in outlines:
        outline.setflags(write=False)
    return outlines


def _inset(polygon: Polygon) -> Outline:
    # Clockwise with y down: the inside is to the right of each edge.
    along = np.sign(np.diff(polygon, axis=0, append=polygon[:1]))
    inwards = np.zeros((len(polygon) + 1, 2))
    inwards[1:, 0], inwards[1:, 1] = -along[:, 1], along[:, 0]
    inwards[0] = inwards[-1]
    before, after = inwards[:-1], inwards[1:]
    # A vertex between edges of one direction moves once.
    move = after + before * (after != before).any(axis=1, keepdims=True)
    outline: Outline = np.round(polygon + INSET_PX * move, 2)
    return outline


@overload
def join_polygons(polygons: Sequence[Polygon]) -> Polygon: ...
@overload
def join_polygons(polygons: Sequence[Outline]) -> Outline: ...
def join_polygons(polygons: Sequence[Polygon] | Sequence[Outline]) -> Polygon | Outline:
    """Join polygons to a single one by lines that lead to each and back.

    Each polygon is joined to the vertex of the longest one that is nearest to its first vertex,
    from its own vertex nearest to that one; the first of several that are equally near. For formats
    with one polygon per object.

    Raises:
        ValueError: there is no polygon.
    """
    if not polygons:
        raise ValueError("there is no polygon to join")
    if len(polygons) == 1:
        return polygons[0]
    longest = max(range(len(polygons)), key=lambda k: len(polygons[k]))
    base = polygons[longest]
    others = [polygon for k, polygon in enumerate(polygons) if k != longest]
    nearest = [_nearest(base, polygon[0]) for polygon in others]
    pieces, begin = [], 0
    for k in sorted(range(len(others)), key=nearest.__getitem__):
        end, polygon = nearest[k] + 1, others[k]
        there = _nearest(polygon, base[end - 1])
        detour = [polygon[there:], polygon[: there + 1], base[end - 1 : end]]
        pieces += [base[begin:end], *detour]
        begin = end
    return np.concatenate([*pieces, base[begin:]])


def _nearest(vertices: NDArray[Any], point: NDArray[Any]) -> int:
    """Index of the vertex [n, 2] nearest to a point [2]."""
    dx, dy = vertices[:, 0] - point[0], vertices[:, 1] - point[1]
    return int(np.argmin(dx * dx + dy * dy))


@dataclass(frozen=True, eq=False, slots=True)
class _Corners:
    """Corners of a mask's border, sorted by row, then column.

    Corners ``2 k`` and ``2 k + 1`` are the left and right end of horizontal edge ``k``. Where
    pixels touch at a point only, there are two corners.

    Attributes:
        points: As (x, y), int64 [n, 2].
        keys: ``y * stride + x``, int64 [n].
        across: Corner at the other end of each corner's vertical edge.
        holds_below: Whether the pixel to the lower right of each corner is set.
    """

    points: Polygon
    keys: NDArray[np.int64]
    stride: int
    across: list[int]
    holds_below: list[bool]

    def edge_at(self, x: int, y: int) -> int:
        """Number of the horizontal edge that contains a point of the border."""
        return int(np.searchsorted(self.keys, y * self.stride + x, "right") - 1) // 2


def _find_corners(pixels: NDArray[np.bool_]) -> _Corners:
    height, width = pixels.shape
    padded = np.zeros((height + 2, width + 2), bool)
    padded[1:-1, 1:-1] = pixels
    sides = padded[:, 1:] ^ padded[:, :-1]
    above, below = sides[:-1], sides[1:]
    touching = above & below & (padded[1:, 1:] ^ padded[:-1, 1:])
    stride = width + 1
    found = np.flatnonzero((above ^ below) | touching)
    keys = np.repeat(found, 1 + touching.ravel()[found])
    y, x = np.divmod(keys, stride)
    holds_below = padded[y + 1, x + 1]
    # Of two corners at one point, the first ends the edge from the left. It also ends the edge
    # from above if its pixel is the upper left one, and begins the edge downwards otherwise.
    second = np.zeros(len(keys), bool)
    second[1:] = keys[1:] == keys[:-1]
    downwards = np.where(touching.ravel()[keys], second == holds_below, False)
    order = np.argsort((x * (height + 1) + y) * 2 + downwards)
    across = np.zeros(len(keys), np.int64)
    across[order[0::2]], across[order[1::2]] = order[1::2], order[0::2]
    points = np.stack([x, y], axis=1)
    return _Corners(points, keys, stride, across.tolist(), holds_below.tolist())


def _trace_borders(corners: _Corners) -> list[list[int]]:
    """Closed borders in the order of their topmost left corners.

    Each is a list of the corners at which its horizontal edges begin. An outer border begins
    with an even corner and runs clockwise; a border of a hole begins with an odd one, at the right
    end of its topmost edge, and runs counter-clockwise.
    """
    across, borders = corners.across, []
    seen = bytearray(len(across))
    for left in range(0, len(across), 2):
        if seen[left]:
            continue
        first = left if corners.holds_below[left] else left + 1
        border = [first]
        while (corner := across[border[-1] ^ 1]) != first:
            border.append(corner)
        for corner in border:
            seen[corner & ~1] = 1
        borders.append(border)
    return borders


def _follow(
    border: Sequence[int], corners: _Corners, bridges: Mapping[int, Sequence[tuple[int, Polygon]]]
) -> Polygon:
    """Points of a border and of the holes that are attached to its edges by ``bridges``."""
    starts = np.array(border)
    path: Polygon = corners.points[np.stack([starts, starts ^ 1], axis=1).ravel()]
    detours = []
    for place, corner in enumerate(border) if bridges else ():
        y = corners.points[corner, 1]
        for x, hole in sorted(
            bridges.get(corner // 2, ()), key=itemgetter(0), reverse=bool(corner % 2)
        ):
            detours.append((2 * place + 1, np.concatenate([[(x, y)], hole, hole[:1], [(x, y)]])))
    if not detours:
        return path
    pieces, begin = [], 0
    for end, detour in detours:
        pieces += [path[begin:end], detour]
        begin = end
    return np.concatenate([*pieces, path[begin:]])


def _without_repeats(path: Polygon) -> Polygon:
    """Closed path without points equal to the one before."""
    before = np.roll(path, 1, axis=0)
    kept: Polygon = path[(path[:, 0] != before[:, 0]) | (path[:, 1] != before[:, 1])]
    return kept
