"""Colours of vertices and faces, expressed by materials and images, which renderers interpolate.

A material whose corners all have one colour takes it as its base colour, a few colours of whole
faces become separate materials, and gradients an image with a small cell per triangle.
"""

from dataclasses import dataclass, replace

import numpy as np

from gen_data.assets.mesh_decimation import decimate
from gen_data.assets.triangle_soup import (
    Float64,
    Int64,
    MaterialSlot,
    TriangleSoup,
    first_occurrences,
)
from gen_data.core import asset_types, colorimetry

IMAGE = "vertex_colors"
"""Name of the image that holds gradients."""
_SAME = 1.0 / 512.0
"""Linear colours that differ by less are one colour: half a step of eight bits."""
_MAX_SLOTS = 24
"""Most colours of whole faces of one material that become materials."""
_CELL_PX, _SMALL_CELL_PX, _MAX_FINE_CELLS = 4, 2, 1 << 17


@dataclass(frozen=True, eq=False)
class ColoredSoup:
    """Triangles without corner colours.

    Attributes:
        image: sRGB of the image ``IMAGE``, uint8 [height, width, 3]; None = not needed.
        remarks: Colours that could not be kept.
    """

    soup: TriangleSoup
    image: asset_types.UInt8 | None = None
    remarks: tuple[str, ...] = ()


def resolve_colors(soup: TriangleSoup, max_faces: int) -> ColoredSoup:
    """Move corner colours to materials and, for gradients, to an image.

    A soup with gradients of more than ``max_faces`` triangles is decimated first, and its image
    takes the colours of the nearest vertices of the original.
    """
    if soup.colors is None:
        return ColoredSoup(soup)
    colors, remarks, graded = soup.colors, list[str](), list[int]()
    for k, slot in enumerate(soup.slots):
        chosen = soup.face_slots == k
        if not chosen.any():
            continue
        own = colors[chosen]
        whole = own.reshape(-1, 3)
        flat = bool((np.ptp(own, axis=1) < _SAME).all())
        codes = np.rint(own[:, 0] * 1024.0).astype(np.int64)
        number, first = first_occurrences(codes) if flat else (codes[:, 0], codes[:0, 0])
        if (np.ptp(whole, axis=0) < _SAME).all():
            soup = _tint(soup, k, whole[0])
        elif slot.material.texture:
            soup = _tint(soup, k, whole.mean(axis=0))
            name = f" of material '{slot.name}'" if slot.name else ""
            remarks.append(f"vertex colours{name}: only their mean tints the image")
        elif flat and len(first) <= _MAX_SLOTS:
            soup = _split(soup, chosen, number, own[first, 0], slot)
        else:
            graded.append(k)
    plain = replace(soup, colors=None)
    if not graded:
        return ColoredSoup(plain, None, tuple(remarks))
    if len(soup) > max_faces:
        plain = decimate(replace(plain, uvs=None) if not _textured(plain) else plain, max_faces)
        # Decimation gives every used material a slot, in the order of their first slots.
        used = {soup.slots[k].material for k in graded}
        return ColoredSoup(*_bake(plain, used, soup), tuple(remarks))
    return ColoredSoup(*_bake(soup, {soup.slots[k].material for k in graded}, None), tuple(remarks))


def _textured(soup: TriangleSoup) -> bool:
    return any(slot.material.texture for slot in soup.slots)


def _tint(soup: TriangleSoup, number: int, color: Float64) -> TriangleSoup:
    slots = list(soup.slots)
    slots[number] = _tinted(slots[number], color)
    return replace(soup, slots=tuple(slots))


def _tinted(slot: MaterialSlot, color: Float64) -> MaterialSlot:
    # Rounded, because powers of arrays differ in their last bits between processors.
    r, g, b = (round(float(a * c), 6) for a, c in zip(slot.material.base_color, color, strict=True))
    return replace(slot, material=replace(slot.material, base_color=(r, g, b)), from_file=True)


def _split(
    soup: TriangleSoup, chosen: np.ndarray, number: Int64, colors: Float64, slot: MaterialSlot
) -> TriangleSoup:
    face_slots = soup.face_slots.copy()
    face_slots[chosen] = len(soup.slots) + number
    added = tuple(_tinted(slot, color) for color in colors)
    return replace(soup, face_slots=face_slots, slots=(*soup.slots, *added))


def _bake(
    soup: TriangleSoup, graded: set[asset_types.Material], original: TriangleSoup | None
) -> tuple[TriangleSoup, asset_types.UInt8]:
    """Triangles of some materials with UVs into the image of their colours.

    Each triangle has a square cell of texels; its corners are at the centres of three of them, so
    that bilinear interpolation in the cell is linear on the triangle.
    """
    numbers = [k for k, slot in enumerate(soup.slots) if slot.material in graded]
    chosen = np.isin(soup.face_slots, numbers)
    count = int(chosen.sum())
    side = _CELL_PX if count <= _MAX_FINE_CELLS else _SMALL_CELL_PX
    bits = max(count - 1, 1).bit_length()
    columns, rows = 1 << (bits + 1) // 2, 1 << bits // 2
    width, height = columns * side, rows * side
    j, i = np.mgrid[0:side, 0:side].reshape(2, -1)
    s, t = i / (side - 1.0), j / (side - 1.0)
    if original is None:
        assert soup.colors is not None
        c0, c1, c2 = np.moveaxis(soup.colors[chosen], 1, 0)[:, :, None]
        texels = c0 + s[:, None] * (c1 - c0) + t[:, None] * (c2 - c0)
    else:
        beyond = np.maximum(s + t, 1.0)
        a, b = (s / beyond)[:, None], (t / beyond)[:, None]
        p0, p1, p2 = np.moveaxis(soup.corners[chosen], 1, 0)[:, :, None]
        texels = _nearest_colors(original, p0 + a * (p1 - p0) + b * (p2 - p0))
    encoded = np.rint(colorimetry.srgb_encode(np.clip(texels, 0.0, 1.0)) * 255.0).astype(np.uint8)
    column, row = _cells(soup.corners[chosen].mean(axis=1))
    cells = np.zeros((rows, columns, side, side, 3), np.uint8)
    # Free cells look like the last one: coarse levels of the image have no dark rims.
    last = int(np.argmax(_interleave((column, row))))
    cells[:] = encoded[last].reshape(side, side, 3)
    cells[row, column] = encoded.reshape(count, side, side, 3)
    image = np.ascontiguousarray(cells.swapaxes(1, 2).reshape(height, width, 3))
    left, top = column * side + 0.5, row * side + 0.5
    x = np.stack([left, left + side - 1.0, left], axis=1) / width
    y = np.stack([top, top, top + side - 1.0], axis=1) / height
    uvs = np.zeros((len(soup), 3, 2)) if soup.uvs is None else soup.uvs.copy()
    uvs[chosen] = np.stack([x, 1.0 - y], axis=2)
    slots = tuple(
        replace(slot, material=replace(slot.material, texture=IMAGE), from_file=True)
        if k in numbers
        else slot
        for k, slot in enumerate(soup.slots)
    )
    return replace(soup, uvs=uvs, slots=slots, colors=None), image


def _cells(centers: Float64) -> tuple[Int64, Int64]:
    """Column and row of the cell of each point [n, 3].

    Along a Z-order curve (Morton 1966) in both spaces: cells side by side belong to neighbours,
    which coarse levels of the image mix.
    """
    low, size = centers.min(axis=0), max(float(np.ptp(centers, axis=0).max()), 1e-12)
    steps = np.floor((centers - low) / size * 1023.0).astype(np.int64)
    rank = np.zeros(len(centers), np.int64)
    rank[np.argsort(_interleave(tuple(steps.T)), kind="stable")] = np.arange(len(centers))
    return _every_second_bit(rank), _every_second_bit(rank >> 1)


def _interleave(axes: tuple[Int64, ...]) -> Int64:
    """Numbers made of the bits of all axes in turn, the first axis lowest."""
    code = np.zeros_like(axes[0])
    for bit in range(_BITS):
        for k, values in enumerate(axes):
            code |= (values >> bit & 1) << (len(axes) * bit + k)
    return code


def _every_second_bit(codes: Int64) -> Int64:
    """Numbers of bits 0, 2, 4, ... of codes."""
    values = np.zeros_like(codes)
    for bit in range(_BITS):
        values |= (codes >> 2 * bit & 1) << bit
    return values


_BITS = 16


def _nearest_colors(soup: TriangleSoup, points: Float64) -> Float64:
    """Colours [..., 3] of the vertices nearest to points [..., 3]."""
    from scipy.spatial import cKDTree

    assert soup.colors is not None
    flat = soup.corners.reshape(-1, 3)
    _, first = first_occurrences(np.rint(flat / (np.ptp(flat, axis=0).max() * 1e-7)).astype(int))
    _, nearest = cKDTree(flat[first]).query(points.reshape(-1, 3))
    found: Float64 = soup.colors.reshape(-1, 3)[first][nearest].reshape(points.shape)
    return found
