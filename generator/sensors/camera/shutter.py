"""Exposure time and rolling shutter in a camera's configuration."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.shutter import INSTANT, Shutter


class ExposureTime(Strict):
    """Exposure time, which blurs moving objects.

    Brightness does not depend on it, but on ``ev100`` or the camera's meter.

    Attributes:
        time_s: Exposure time.
        samples: Largest number of instants averaged into an image; fewer are rendered where
            nothing moves by 0.3 px per sample, and one where nothing moves.
    """

    time_s: float = Field(gt=0, le=10)
    samples: int = Field(8, ge=1, le=256)


class RollingShutter(Strict):
    """Rows exposed one after the other, which skews moving objects.

    Attributes:
        readout_s: Time from the exposure of the first row to one row after the last.
        direction: Direction of the readout; ``down`` begins with the topmost row.
    """

    readout_s: float = Field(gt=0, le=10)
    direction: Literal["down", "up"] = "down"


def make_shutter(exposure: ExposureTime | None, rolling: RollingShutter | None) -> Shutter:
    """The shutter of a camera with these settings."""
    if exposure is None and rolling is None:
        return INSTANT
    readout_s = 0.0 if rolling is None else rolling.readout_s
    if rolling is not None and rolling.direction == "up":
        readout_s = -readout_s
    if exposure is None:
        return Shutter(readout_s=readout_s)
    return Shutter(exposure.time_s, readout_s, exposure.samples)
