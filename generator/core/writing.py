"""Writing on textures: strings, and the places of their characters, recorded while they are drawn.

A generator of textures records what it writes; outside of ``recording`` that does nothing. Corners
are listed from the top left of the upright character clockwise: top left, top right, bottom right,
bottom left.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array

NO_LANGUAGE, UNDETERMINED, SEVERAL = "zxx", "und", "mul"
"""ISO 639-2 codes: numbers and codes; invented names; words of several languages."""


@dataclass(frozen=True, eq=False, slots=True)
class Writing:
    """A line of text on a texture.

    Attributes:
        text: The line; empty = strokes that look like writing and mean nothing.
        language: ISO 639-1 code of the line, or one of the codes above.
        quads: Corners of the ink of each character that is not a space, in shares of the image's
            width and height from its top left, float64 [n, 4, 2]; one quad for an empty text.
        stroke: Width of the strokes over the height of the highest character.
    """

    text: str
    language: str
    quads: Array
    stroke: float

    def moved(self, scale: Array, shift: Array) -> "Writing":
        """The line on an image of which its own is a part: shares of that image, both [2]."""
        return Writing(self.text, self.language, self.quads * scale + shift, self.stroke)

    def turned(self) -> "Writing":
        """The line after a quarter turn of its image counter-clockwise."""
        quads = np.stack([self.quads[..., 1], 1.0 - self.quads[..., 0]], axis=-1)
        return Writing(self.text, self.language, quads, self.stroke)


_RECORD: ContextVar[list[Writing] | None] = ContextVar("_RECORD", default=None)


@contextmanager
def recording() -> Iterator[list[Writing]]:
    """Record the writing on one texture.

    Yields:
        Its lines in the order of drawing; complete when the context ends.
    """
    lines: list[Writing] = []
    token = _RECORD.set(lines)
    try:
        yield lines
    finally:
        _RECORD.reset(token)


def is_recorded() -> bool:
    """Whether anybody records writing."""
    return _RECORD.get() is not None


def record(lines: Iterable[Writing]) -> None:
    """Record lines of the texture that is drawn; nothing outside of ``recording``."""
    record = _RECORD.get()
    if record is not None:
        record.extend(lines)


def boxes_to_quads(boxes: NDArray[np.floating]) -> Array:
    """Corners [n, 4, 2] of upright boxes [n, 4]: left, top, right, bottom."""
    return np.asarray(boxes)[:, [[0, 1], [2, 1], [2, 3], [0, 3]]].astype(np.float64)
