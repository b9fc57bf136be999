"""Printed matter as it looks in use: the prints of ``printed_matter`` with their wear."""

import math

from gen_data.content.procedural import books, packaging
from gen_data.content.procedural.textures import printed_matter
from gen_data.content.procedural.textures.print_wear import (
    METAL,
    PAPER,
    Sheet,
    label_sheet,
    wear_print,
)
from gen_data.core import asset_types, se3

# Widths and heights of labels vary between bottles; these are typical [m].
_WRAP_M, _FRONT_M = (0.22, 0.085), (0.07, 0.08)


def label(seed: int) -> asset_types.TextureData:
    """Wrap-around label of a bottle or jar, scuffed and torn; 512 x 256."""
    clean = printed_matter.label(seed)
    return wear_print(clean, label_sheet(*_WRAP_M, PAPER), "label", seed)


def front_label(seed: int) -> asset_types.TextureData:
    """A label on the front of a bottle, scuffed and torn."""
    clean = printed_matter.front_label(seed)
    return wear_print(clean, label_sheet(*_FRONT_M, PAPER), "front_label", seed)


def can_label(seed: int) -> asset_types.TextureData:
    """All around a can, scuffed: paper shows on food cans, metal on others."""
    size = packaging.can_size(seed)
    width_m, core = 2.0 * math.pi * size.radius_m, PAPER if size.food else METAL
    sheet = label_sheet(width_m, 0.9 * size.height_m, core)
    return wear_print(printed_matter.can_label(seed), sheet, "can_label", seed)


def carton(seed: int) -> asset_types.TextureData:
    """The six faces of a folding box with rubbed edges."""
    sheet = _box_sheet(packaging.carton_size_m(seed), level="top")
    return wear_print(printed_matter.carton(seed), sheet, "carton", seed)


def milk_label(seed: int) -> asset_types.TextureData:
    """The faces of a milk carton with rubbed edges."""
    sheet = _box_sheet(packaging.milk_size_m(seed))
    return wear_print(printed_matter.milk_label(seed), sheet, "milk_label", seed)


def book_cover(seed: int) -> asset_types.TextureData:
    """Back, spine and front of a book with rubbed edges; the front cover lies upward."""
    length, width, thickness = books.book_size_m(seed)
    size_m = {"front": (width, length), "back": (width, length), "spine": (thickness, length)}
    sheet = Sheet(books.COVER_ATLAS, size_m, level="front")
    return wear_print(printed_matter.book_cover(seed), sheet, "book_cover", seed)


def _box_sheet(size_m: se3.Vec3, level: str = "") -> Sheet:
    """The sheet of a box with this depth, width and height, laid out by ``CARTON_ATLAS``."""
    depth, width, height = size_m
    side, front, lid = (depth, height), (width, height), (width, depth)
    faces = {"front": front, "back": front, "left": side, "right": side, "top": lid, "bottom": lid}
    return Sheet(packaging.CARTON_ATLAS, faces, level=level)
