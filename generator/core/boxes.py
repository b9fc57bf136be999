"""Boxes in images and in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.se3 import SE3, Array, Vec3


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
        box = BoxPx(
            max(self.x_min, 0),
            max(self.y_min, 0),
            min(self.x_max, width_px),
            min(self.y_max, height_px),
        )
        return box if box.width_px > 0 and box.height_px > 0 else None


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


@dataclass(frozen=True, slots=True)
class OrientedBox:
    """A box in space: its centre and axes are ``T_frame_box``, its full edge lengths ``size_m``."""

    T_frame_box: SE3
    size_m: Vec3

    def corners(self) -> Array:
        """The eight corners in the outer frame [m], shape [8, 3]; x varies slowest."""
        half = 0.5 * np.asarray(self.size_m)
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
        return self.T_frame_box.apply(signs * half)

    def seen_from(self, T_other_frame: SE3) -> OrientedBox:
        """The same box, expressed in another frame."""
        return OrientedBox(T_other_frame @ self.T_frame_box, self.size_m)
