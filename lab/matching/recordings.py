"""Recordings as statistics take them, real or simulated."""

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from gen_data.core import asset_types, se3

Box = tuple[str, float, float, float, float]
"""Category, left, top, width and height [px]."""


@dataclass(frozen=True, eq=False, slots=True)
class Photo:
    """A photograph.

    Attributes:
        name: Its path in the folder.
        rgb: sRGB, uint8 [h, w, 3]; the middle of large ones.
        size_px: Width and height of the whole.
        quantisation: Luma table of its JPEG file, [64] in any order; None = another format.
    """

    name: str
    rgb: asset_types.UInt8
    size_px: tuple[int, int]
    quantisation: NDArray[Any] | None


@dataclass(frozen=True, eq=False, slots=True)
class Scan:
    """A sweep of a laser scanner.

    Attributes:
        name: Its path in the folder.
        range_m: Distances of its points from the scanner, [n].
        intensity: [0, 1], [n].
    """

    name: str
    range_m: se3.Array
    intensity: se3.Array


@dataclass(frozen=True, slots=True)
class ImageLabels:
    """Boxes in one image.

    Attributes:
        width_px, height_px: Width and height of the image.
    """

    width_px: int
    height_px: int
    boxes: tuple[Box, ...]
