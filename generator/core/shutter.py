"""Exposure time and rolling shutter: exposure intervals of the rows of an image."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gen_data.core.se3 import Array


@dataclass(frozen=True, slots=True)
class Shutter:
    """Exposure of the rows of an image.

    The instant of an image is the middle of the exposure of its middle row. With a rolling shutter,
    a row with its centre at ``v`` is exposed around ``readout_s * (v / height - 0.5)`` from it.

    Attributes:
        exposure_s: Exposure time of every row; 0 = an instant.
        readout_s: Time from the exposure of the image's upper edge to the exposure of its lower
            edge;
            negative if the lower edge comes first, 0 = a global shutter.
        samples: Largest number of instants averaged into an exposure.
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
        """Delay of the exposure of image coordinate ``v_px`` after the image's instant [s]."""
        return self.readout_s * (v_px / height_px - 0.5)

    def row_delays_s(self, height_px: int) -> Array:
        """Delays of the centres of all rows [s], [height]."""
        return np.asarray(self.delay_s(np.arange(height_px) + 0.5, height_px))


INSTANT = Shutter()
"""A global shutter with an instantaneous exposure."""
