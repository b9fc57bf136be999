"""Wear of printed matter: rubbed edges, creases, scuffs, dust, stains, torn labels.

A print is an atlas of faces. The borders of a face are the convex edges of its box or book, where
ink is rubbed off first and the board shows. Lengths are in metres on the object; measures and
shares are assumed, within a half.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.content.procedural import wear as traces
from gen_data.content.procedural.surface_shapes import UvRect
from gen_data.content.procedural.wear import COARSE, FINE, MEDIUM, Film, Size
from gen_data.core.asset_types import Float32, TextureData, UInt8
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, variant_rng

BOARD: Vec3 = (0.83, 0.79, 0.71)
PAPER: Vec3 = (0.92, 0.9, 0.85)
METAL: Vec3 = (0.78, 0.785, 0.79)
_GRIME: Vec3 = (0.33, 0.29, 0.24)
_DUST: Vec3 = (0.67, 0.64, 0.59)
_COFFEE: Vec3 = (0.42, 0.29, 0.17)
# How far from an edge ink is rubbed off, well used; how near a corner it is rubbed most; the width
# of the grime along edges.
_REACH_M, _CORNER_M, _GRIME_M = 0.0022, 0.009, 0.007
# Wear below which edges are as new.
_UNTOUCHED = 0.05
# Radius of the foot of a mug.
_RING_M = (0.03, 0.042)

Window = tuple[slice, slice]


@dataclass(frozen=True)
class Sheet:
    """Carrier of a print.

    Attributes:
        places: Position of each face in the image.
        size_m: Width and height of each face.
        core: Colour under the ink, sRGB in [0, 1].
        exposed: Abrasion of its borders: 1 = edges of a box, less where it lies flat.
        scratched: Share of the core that shows in the deepest scratches.
        level: The face that lies upward, where dust settles and mugs stand; empty = none.
        tears: Whether it is a label, of which pieces come off.
    """

    places: Mapping[str, UvRect]
    size_m: Mapping[str, tuple[float, float]]
    core: Vec3 = BOARD
    exposed: float = 1.0
    scratched: float = 0.5
    level: str = ""
    tears: bool = False


def label_sheet(width_m: float, height_m: float, core: Vec3) -> Sheet:
    """A sheet of one face that lies flat on a bottle or can."""
    whole = {"front": (0.0, 0.0, 1.0, 1.0)}
    # Lacquer over the print of drink cans is hard.
    deep = 0.2 if core == METAL else 0.5
    return Sheet(whole, {"front": (width_m, height_m)}, core, 0.3, deep, tears=core == PAPER)


def wear_print(clean: TextureData, sheet: Sheet, name: str, seed: int) -> TextureData:
    """A print with the wear of its family's variant; the roughness map has its dull places."""
    wear, rng = traces.draw_wear(name, seed), variant_rng(f"{name}/wear/places", seed)
    size_px = (clean.albedo.shape[0], clean.albedo.shape[1])
    rubbed, soiled = _rub_edges(sheet, wear, size_px, rng)
    count = int(3 + 45 * wear**1.5)
    scuffed = traces.scratches(count, 60.0 + 110.0 * wear, size_px, rng, 0.35)
    broken = np.maximum(traces.ramp_bytes(scuffed, 0.0, 1.0, sheet.scratched * (0.2 + 0.8 * wear)),
                        _creases(sheet, wear, size_px, rng))  # fmt: skip
    films = [Film(soiled, _GRIME), Film(np.maximum(rubbed, broken), sheet.core)]
    smudged = traces.noise_bytes(COARSE, size_px, rng)
    dull = np.maximum(rubbed, traces.ramp_bytes(smudged, 0.7 - 0.35 * wear, 0.8 - 0.2 * wear))
    worn = traces.lay_films(clean.albedo, films)
    if sheet.level:
        window = _window(sheet.places[sheet.level], size_px)
        _lay_in(worn, dull, window, _settle(sheet, wear, dull[window].shape, rng))
    if sheet.tears and rng.chance(0.6 * wear):
        window = _torn_window(size_px, rng)
        _lay_in(worn, dull, window, _tear(dull[window].shape, window[0].start > 0, rng))
    return TextureData(worn, traces.roughness_factor(dull, wear))


def _lay_in(image: UInt8, dull: UInt8, window: Window, films: Sequence[Film]) -> None:
    """Lay films over a part of an image, in place; the last one dulls it."""
    image[window] = traces.lay_films(np.ascontiguousarray(image[window]), films)
    dull[window] = np.maximum(dull[window], films[-1].share)


def _window(place: UvRect, size_px: Size) -> Window:
    """Rows and columns of a face."""
    (u0, v0, u1, v1), (height, width) = place, size_px
    return (
        slice(round((1 - v1) * height), round((1 - v0) * height)),
        slice(round(u0 * width), round(u1 * width)),
    )


def _edge_distances(count: int, length_m: float) -> Float32:
    """Distance of pixel centres from the nearer end [m], shape [count]."""
    along = (np.arange(count, dtype=np.float32) + 0.5) * np.float32(length_m / count)
    near: Float32 = np.minimum(along, np.float32(length_m) - along)
    return near


def _borders(rows: int, columns: int, deep: int, wide: int) -> Iterator[Window]:
    """Rows and columns of the four borders of a face, so many pixels deep and wide."""
    yield slice(0, deep), slice(0, columns)
    yield slice(max(rows - deep, 0), rows), slice(0, columns)
    yield slice(0, rows), slice(0, wide)
    yield slice(0, rows), slice(max(columns - wide, 0), columns)


def _rub_edges(sheet: Sheet, wear: float, size_px: Size, rng: VariantRng) -> tuple[UInt8, UInt8]:
    """Shares of bare board along edges, most at corners, and of grime next to it."""
    soil = traces.noise_bytes(COARSE, size_px, rng)
    rubbed, soiled = np.zeros(size_px, np.uint8), traces.ramp_bytes(soil, 0.4, 0.9, 0.05 * wear)
    if wear < _UNTOUCHED:
        return rubbed, soiled
    stretches = traces.noise_bytes(MEDIUM, size_px, rng)
    grain = traces.noise_bytes(FINE, size_px, rng)
    for name, place in sheet.places.items():
        window = _window(place, size_px)
        (rows, columns), (width_m, height_m) = rubbed[window].shape, sheet.size_m[name]
        across, down = _edge_distances(columns, width_m), _edge_distances(rows, height_m)
        border_m = _GRIME_M * sheet.exposed
        deep, wide = (math.ceil(border_m * n / length) for n, length in
                      ((rows, height_m), (columns, width_m)))  # fmt: skip
        for at in _borders(rows, columns, deep, wide):
            x, y = across[None, at[1]], down[at[0], None]
            corner = np.maximum(1.0 - (x + y) / np.float32(_CORNER_M), np.float32(0.0))
            # Edges are rubbed in stretches, the more the longer they have been in use.
            touched = stretches[window][at] * np.float32(1.0 / 255.0) + corner
            reach = np.clip(4.0 * (touched - np.float32(0.95 - 0.55 * wear)), 0.0, 1.9)
            reach *= 0.4 + grain[window][at] * np.float32(1.2 / 255.0)
            reach *= np.float32(sheet.exposed * wear * _REACH_M)
            near = np.minimum(x, y)
            rubbed[window][at] = traces.to_bytes((reach - near) * np.float32(2000.0) + 0.5)
            dark = np.maximum(1.0 - near / np.float32(border_m), 0.0) * np.float32(0.22 * wear)
            soiled[window][at] = np.maximum(soiled[window][at], traces.to_bytes(dark * touched))
    return rubbed, soiled


def _creases(sheet: Sheet, wear: float, size_px: Size, rng: VariantRng) -> UInt8:
    """Lines where board was folded and its ink has broken: across corners, and along spines."""
    from PIL.Image import new
    from PIL.ImageDraw import Draw

    image = new("L", (size_px[1], size_px[0]))
    pen = Draw(image)
    for _ in range(int(wear * 4.5 * rng.between(0.0, 1.0))):
        rows, columns = _window(rng.choose(tuple(sheet.places.values())), size_px)
        w, h = columns.stop - columns.start, rows.stop - rows.start
        reach, bend = rng.between(0.1, 0.3) * min(w, h), rng.between(-0.3, 0.3)
        is_right, is_low = rng.chance(0.5), rng.chance(0.5)
        line = []
        for t in (0.0, 0.3, 0.7, 1.0):
            x, y = reach * (t + bend * t * (1 - t)), 1.3 * reach * (1 - t - bend * t * (1 - t))
            line.append((round(columns.stop - 1 - x if is_right else columns.start + x),
                         round(rows.stop - 1 - y if is_low else rows.start + y)))  # fmt: skip
        pen.line(line, fill=int(rng.between(70, 150)), width=rng.choose((1, 1, 2)))
    if "spine" in sheet.places:
        rows, columns = _window(sheet.places["spine"], size_px)
        for _ in range(int(wear * 5.0 * rng.between(0.0, 1.0))):
            x = round(rng.between(columns.start, columns.stop))
            pen.line([x, rows.start, x, rows.stop], fill=int(rng.between(50, 130)))
    return np.asarray(image, dtype=np.uint8)


def _settle(sheet: Sheet, wear: float, size_px: Size, rng: VariantRng) -> list[Film]:
    """Rings of mugs and dust on the face that lies upward, of that size; dust comes last."""
    width_m, height_m = sheet.size_m[sheet.level]
    films: list[Film] = []
    rows, columns = size_px
    noise = traces.noise_bytes(COARSE, size_px, rng)
    if rng.chance(0.45 * wear):
        x = (np.arange(columns) + 0.5) * (width_m / columns) - rng.between(0.2, 0.8) * width_m
        y = (np.arange(rows) + 0.5) * (height_m / rows) - rng.between(0.2, 0.8) * height_m
        away = np.sqrt(x[None, :] ** 2 + y[:, None] ** 2) - rng.between(*_RING_M)
        share = 0.45 * np.clip(2.0 - np.abs(away) / 0.0011, 0.0, 1.0) * (noise / 255.0)
        films.append(Film(traces.to_bytes(share.astype(np.float32)), _COFFEE))
    # Dust gathers on idle objects, not through use: handling wipes it off.
    amount = 0.4 * rng.between(0.0, 1.0) ** 3
    level = float(traces.dust_share(np.ones(1, np.float32), amount)[0])
    return [*films, Film(traces.ramp_bytes(noise, 0.15, 0.6, level), _DUST)]


def _torn_window(size_px: Size, rng: VariantRng) -> Window:
    """Where a piece is torn off a label: rows from its upper or lower border, some columns."""
    height, width = size_px
    wide, deep = (round(rng.between(*share) * n) for share, n in
                  (((0.16, 0.36), width), ((0.16, 0.4), height)))  # fmt: skip
    left = round(rng.choose((0.0, 0.2, 0.6, 1.0)) * (width - wide))
    top = 0 if rng.chance(0.5) else height - deep
    return slice(top, top + deep), slice(left, left + wide)


def _tear(size_px: Size, is_low: bool, rng: VariantRng) -> list[Film]:
    """A piece torn off the upper or lower border: its shadow, then the fibres that stayed."""
    height, width = size_px
    x = np.abs(np.linspace(-1.6, 1.6, width, dtype=np.float32))
    y = np.linspace(0.0, 1.6, height, dtype=np.float32)[:: -1 if is_low else 1]
    ragged = traces.noise_bytes(MEDIUM, size_px, rng) * np.float32(1.2 / 255.0) - np.float32(0.6)
    away = x[None, :] + y[:, None] + ragged
    fibres = traces.ramp_bytes(traces.noise_bytes(FINE, size_px, rng), -1.5, 0.6)
    left = np.minimum(traces.to_bytes((1.0 - away) * 12.0), fibres)
    shadow = traces.to_bytes(np.minimum((1.16 - away) * 3.0, 0.3))
    return [Film(shadow, _GRIME), Film(left, PAPER)]
