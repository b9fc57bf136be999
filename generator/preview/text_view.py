"""Words in pictures: outlines, green where they can be read, orange where not."""

from collections.abc import Sequence

import cv2
import numpy as np

from gen_data.core.sample import TextTruth, WordTruth
from gen_data.exporters.label_colors import Rgb
from gen_data.preview.overlay import Image

READABLE: Rgb = (60, 255, 60)
UNREADABLE: Rgb = (255, 140, 0)
_SHIFT = 4
"""Fractional bits of OpenCV's drawing coordinates; its pixel centres are integers."""


def word_color(word: WordTruth) -> Rgb:
    """SRGB colour of a word's outline."""
    return READABLE if word.readable else UNREADABLE


def draw_texts(image: Image, texts: Sequence[TextTruth], unit: float = 1.0) -> None:
    """Draw words into a photograph, uint8 [h, w, 3], in place.

    Fully visible words have their quad, others the quads of visible characters.

    Args:
        image: The photograph.
        texts: Texts of its camera.
        unit: As of ``draw_labels``.
    """
    for word in (word for text in texts for word in text.words):
        seen = [c for c in word.characters if c.visible_fraction > 0.0]
        whole = len(seen) == len(word.characters)
        quads = [word.quad_px] if whole else [c.quad_px for c in seen]
        places = np.rint((np.array(quads).reshape(-1, 4, 2) - 0.5) * (1 << _SHIFT))
        lines, width = list(places.astype(np.int32)), max(1, round(unit))
        cv2.polylines(image, lines, isClosed=True, color=word_color(word), thickness=width,
                      lineType=cv2.LINE_AA, shift=_SHIFT)  # fmt: skip
