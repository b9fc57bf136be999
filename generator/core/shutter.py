"""When the rows of an image are exposed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gen_data.generator.core.se3 import Array


@dataclass(frozen=True, slots=True)
class Shutter:
    """How long every row of an image is exposed, and which row when.

    The instant of an image is the middle of the exposure of its middle. With a rolling shutter,
    the point ``(u, v)`` of the image is exposed around ``readout_s * (v / height - 0.5)`` from it,
    where ``v`` is that of the row's centre.

    Attributes:
        exposure_s: How long every row is exposed; 0 = an instant.
        readout_s: From the exposure of the image's upper edge to that of its lower one; negative
            where the lower edge comes first, 0 = all rows at once (a global shutter).
        samples: Instants that an exposure is the mean of, at most.
    """

    exposure_s: float = 0.0
    readout_s: float = 0.0
    samples: int = 8

    @property
    def open_s(self) -> float:
        """From the first light on any row to the last."""
        return self.exposure_s + abs(self.readout_s)

    @property
    def rolls(self) -> bool:
        """Whether rows are exposed one after the other."""
        return self.readout_s != 0.0

    def delay_s(self, v_px: Any, height_px: int) -> Any:
        """How much later than the image's instant a place of it is exposed [s], as ``v_px``."""
        return self.readout_s * (v_px / height_px - 0.5)

    def row_delays_s(self, height_px: int) -> Array:
        """The same for the centres of all rows, shape [height]."""
        delays: Array = self.delay_s(np.arange(height_px) + 0.5, height_px)
        return delays


INSTANT = Shutter()
"""All at once."""
