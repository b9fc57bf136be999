"""Borders of lanes in pictures: coloured by kind, darker where something hides them."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby, pairwise

import cv2
import numpy as np

from gen_data.core.sample import BorderTruth
from gen_data.preview.overlay import Image
from gen_data.preview.palette import Rgb

COLORS: Mapping[str, Rgb] = {"lane": (0, 225, 255), "road": (255, 210, 0), "edge": (255, 70, 70)}
"""By kind: between lanes of one direction, between directions, edges of the carriageway."""
HIDDEN = 0.5
"""Brightness of hidden parts."""
_SHIFT = 4
"""Fractional bits of OpenCV's drawing coordinates; its pixel centres are integers."""

Points = tuple[tuple[float, float], ...]


def border_color(kind: str, *, visible: bool = True) -> Rgb:
    """SRGB colour of a border; darker for a hidden part."""
    red, green, blue = COLORS[kind]
    share = 1.0 if visible else HIDDEN
    return (round(share * red), round(share * green), round(share * blue))


def split_border(border: BorderTruth) -> Iterator[tuple[bool, Points]]:
    """Visible and hidden parts of a border in an image, in order; they share their ends.

    A part is visible where all of its points are.
    """
    steps = zip(pairwise(border.visible), pairwise(border.points_px), strict=True)
    for seen, part in groupby(steps, key=lambda step: all(step[0])):
        ends = [points for _, points in part]
        yield seen, (ends[0][0], *(end for _, end in ends))


def draw_borders(image: Image, borders: Sequence[BorderTruth], unit: float = 1.0) -> None:
    """Draw borders into a photograph, uint8 [h, w, 3], in place; hidden parts are thinner, too.

    Args:
        image: The photograph.
        borders: Of its camera.
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
