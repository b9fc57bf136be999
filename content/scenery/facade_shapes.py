"""Many flat pieces of a wall at once, in a wall's frame; see ``facade``."""

import math
from collections.abc import Sequence

import numpy as np

from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.procedural.surface_shapes import fan
from gen_data.core.variant_rng import VariantRng

Bounds = tuple[float, float, float, float]
"""Left, right, bottom and top: y0, y1, z0, z1 [m]."""
Box = tuple[float, float, float, float, float, float]
"""Back and front, left and right, bottom and top: x0, x1, y0, y1, z0, z1 [m]."""

_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
_CORNERS = np.array([[0, 2], [1, 2], [1, 3], [0, 3]])
# Corners of the five visible faces of a box, as columns of a Box; the back is left out.
_FACES = np.array(
    [
        [[1, 2, 4], [1, 3, 4], [1, 3, 5], [1, 2, 5]],
        [[0, 2, 4], [1, 2, 4], [1, 2, 5], [0, 2, 5]],
        [[1, 3, 4], [0, 3, 4], [0, 3, 5], [1, 3, 5]],
        [[0, 2, 5], [1, 2, 5], [1, 3, 5], [0, 3, 5]],
        [[0, 3, 4], [1, 3, 4], [1, 2, 4], [0, 2, 4]],
    ]
)


def rectangles(
    x: float, places: Sequence[Bounds], slot: int, images: Sequence[Bounds] | None = None
) -> Patch:
    """Upright rectangles that face +X, in the plane x.

    ``images`` are the parts (left, right, bottom, top) of the texture that each shows; by default
    all of it.
    """
    n = len(places)
    flat = np.array(places, dtype=np.float64).reshape(n, 4)[:, _CORNERS]
    points = np.concatenate([np.full((n, 4, 1), x), flat], axis=2)
    shown = np.tile([0.0, 1.0, 0.0, 1.0], (n, 1)) if images is None else np.array(images)
    return _quads(points, shown.reshape(n, 4)[:, _CORNERS], slot)


def ledges(boxes: Sequence[Box], slot: int) -> Patch:
    """Boxes against a wall, without the faces that touch it."""
    n = len(boxes)
    values = np.array(boxes, dtype=np.float64).reshape(n, 6)
    points = values[:, _FACES].reshape(n * 5, 4, 3)
    uvs = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64), (n * 5, 1, 1))
    return _quads(points, uvs, slot)


def polygon(x: float, outline: Array, slot: int) -> Patch:
    """A star-shaped polygon in the plane x that faces +X; its outline is (y, z), [n, 2]."""
    return fan(np.insert(outline, 0, x, axis=1), slot)


def blotch(y: float, z: float, size_m: tuple[float, float], rng: VariantRng) -> Array:
    """An irregular outline about a place, [11, 2]."""
    turn = 2.0 * math.pi * np.arange(11) / 11
    radius = np.array([rng.between(0.6, 1.0) for _ in turn])
    w, h = 0.5 * size_m[0], 0.5 * size_m[1]
    return np.stack([y + w * radius * np.cos(turn), z + h * radius * np.sin(turn)], axis=1)


def without_slivers(patch: Patch) -> Patch:
    """The patch without triangles that have no area."""
    corners = patch.corners_m
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    kept = (cross**2).sum(axis=1) > 1e-12
    return Patch(corners[kept], patch.uvs[kept], patch.slots[kept])


def _quads(points: Array, uvs: Array, slot: int) -> Patch:
    corners = points[:, _TRIANGLES].reshape(-1, 3, 3)
    images = uvs[:, _TRIANGLES].reshape(-1, 3, 2)
    return Patch(corners, images, np.full(len(corners), slot, dtype=np.int64))
