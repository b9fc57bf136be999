"""Borders of lanes in pictures: coloured by kind, darker where something hides them."""

from collections.abc import Sequence

import cv2
import numpy as np

from gen_data.core.sample import BorderTruth
from gen_data.exporters.label_parts import border_color, split_border
from gen_data.preview.overlay import Image

_SHIFT = 4
"""Fractional bits of OpenCV's drawing coordinates; its pixel centres are integers."""


def draw_borders(image: Image, borders: Sequence[BorderTruth], unit: float = 1.0) -> None:
    """Draw borders into a photograph, uint8 [h, w, 3], in place; hidden parts are thinner, too.

    Args:
        image: The photograph.
        borders: Borders of its camera.
        unit: As of ``draw_labels``.
    """
    parts = [(seen, b.kind, line) for b in borders for seen, line in split_border(b)]
    # Visible parts last: they are on top.
    for seen, kind, line in sorted(parts, key=lambda part: part[0]):
        places = np.rint((np.array(line) - 0.5) * (1 << _SHIFT)).astype(np.int32)
        width = max(1, round(2.0 * unit if seen else unit))
        color = border_color(kind, visible=seen)
        cv2.polylines(image, [places], isClosed=False, color=color, thickness=width,
                      lineType=cv2.LINE_AA, shift=_SHIFT)  # fmt: skip
