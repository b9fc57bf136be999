"""How long a camera's rows are exposed, and which when."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.shutter import INSTANT, Shutter


class ExposureTime(Strict):
    """How long images are exposed: what moves meanwhile is blurred.

    Brightness does not depend on it: ``ev100`` or the camera's meter decide that.

    Attributes:
        time_s: Exposure time.
        samples: Most instants that an image is the mean of; fewer are rendered where nothing moves
            as far as 0.3 px per sample, and one where nothing moves at all.
    """

    time_s: float = Field(gt=0, le=10)
    samples: int = Field(8, ge=1, le=256)


class RollingShutter(Strict):
    """Rows that are exposed one after the other: what moves sideways leans.

    Attributes:
        readout_s: From the exposure of the first row to that of the row after the last.
        direction: Where rows are read to; ``down`` begins with the topmost.
    """

    readout_s: float = Field(gt=0, le=10)
    direction: Literal["down", "up"] = "down"


def make_shutter(exposure: ExposureTime | None, rolling: RollingShutter | None) -> Shutter:
    """What a camera's settings amount to."""
    if exposure is None and rolling is None:
        return INSTANT
    readout_s = 0.0 if rolling is None else rolling.readout_s
    if rolling is not None and rolling.direction == "up":
        readout_s = -readout_s
    if exposure is None:
        return Shutter(readout_s=readout_s)
    return Shutter(exposure.time_s, readout_s, exposure.samples)
