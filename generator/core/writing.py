"""Writing on textures and meshes: strings, and the places of their characters.

A generator of textures records its lines; outside of ``recording`` that does nothing. Corners
are listed from the top left of the upright character clockwise: top left, top right, bottom right,
bottom left.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array

NO_LANGUAGE, UNDETERMINED, SEVERAL = "zxx", "und", "mul"
"""ISO 639-2 codes: numbers and codes; invented names; words of several languages."""

Kind = Literal["print", "scribble", "code"]
"""Characters; strokes that look like writing and mean nothing; a two-dimensional code."""


@dataclass(frozen=True, eq=False, slots=True)
class Writing:
    """A line of text on a texture or a mesh.

    Attributes:
        text: The line, or the content of a code; empty for scribbles.
        language: ISO 639-1 code of the line, or one of the codes above.
        quads: Corners of the ink of each character that is not a space; one quad for scribbles and
            codes. On a texture in shares of the image's width and height from its top left,
            float64 [n, 4, 2]; on a mesh in its frame [m], float64 [n, 4, 3].
        stroke: Width of the strokes over the height of the highest character; of a module over the
            side of a code.
        kind: See ``Kind``.
    """

    text: str
    language: str
    quads: Array
    stroke: float
    kind: Kind = "print"

    def moved(self, scale: Array, shift: Array) -> "Writing":
        """The line on an image of which its own is a part: shares of that image, both [2]."""
        return replace(self, quads=self.quads * scale + shift)

    def turned(self) -> "Writing":
        """The line after a quarter turn of its image counter-clockwise."""
        quads = np.stack([self.quads[..., 1], 1.0 - self.quads[..., 0]], axis=-1)
        return replace(self, quads=quads)


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
