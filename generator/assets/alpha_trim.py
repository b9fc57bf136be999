"""Holes of textures that a mesh does not reach.

Atlases are transparent beside what they hold. Faces touch that along seams only, where holes would
be pinholes: such coverage is left out, and the mesh stays solid and quick to draw.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.assets.texture_maps import find_maps
from gen_data.generator.assets.triangle_soup import Float64, MaterialSlot, TriangleSoup
from gen_data.generator.core.asset_types import UInt8

HOLES_MIN = 0.02
"""Share of a slot's area that must lie in holes for them to count."""
# Barycentric weights of points well inside a triangle.
_INSIDE = np.array(
    [[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 0.5], [2, 0.5, 2], [0.5, 2, 2]]
)
_WEIGHTS = _INSIDE / _INSIDE.sum(axis=1, keepdims=True)


def trim_unreached_holes(soup: TriangleSoup, image: Callable[[str], UInt8]) -> TriangleSoup:
    """The soup without coverage of which its faces reach hardly any hole.

    Args:
        soup: Its slots name images as readers do.
        image: Pixels of an image, [height, width, 3 or 4].
    """
    slots = [_kept(soup, k, slot, image) for k, slot in enumerate(soup.slots)]
    return replace(soup, slots=tuple(slots))


def _kept(
    soup: TriangleSoup, number: int, slot: MaterialSlot, image: Callable[[str], UInt8]
) -> MaterialSlot:
    maps = find_maps(slot.material.texture)
    if maps is None or not maps.alpha:
        return slot
    name, _, channel = maps.alpha.partition("!")
    pixels, at = image(name), int(channel or 0)
    faces = soup.face_slots == number
    if soup.uvs is not None and at < pixels.shape[2] and faces.any():
        holes = pixels[..., at] < maps.cutoff * 255.0
        if _share(soup.corners[faces], soup.uvs[faces], holes) >= HOLES_MIN:
            return slot
    solid = replace(maps, alpha="", cutoff=0.5)
    return replace(slot, material=replace(slot.material, texture=solid.name()))


def _share(corners: Float64, uvs: Float64, holes: NDArray[np.bool_]) -> float:
    """Share of the area of triangles [m, 3, 3] that lies in holes of an image."""
    points = np.einsum("sc,mcd->msd", _WEIGHTS, uvs, optimize=False)
    height, width = holes.shape
    columns = np.floor(points[..., 0] * width).astype(np.int64) % width
    rows = np.floor((1.0 - points[..., 1]) * height).astype(np.int64) % height
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.sqrt((sides * sides).sum(axis=1))
    of_faces = holes[rows, columns].mean(axis=1)
    return float((of_faces * areas).sum() / max(float(areas.sum()), 1e-30))
