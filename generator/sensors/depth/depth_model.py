"""Data sheet of a depth camera."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.streams import Rng
from gen_data.generator.sensors.depth.active_stereo import ActiveStereo
from gen_data.generator.sensors.depth.structured_light import StructuredLight
from gen_data.generator.sensors.depth.time_of_flight import TimeOfFlight
from gen_data.generator.sensors.depth.view import Measured, View

SidePx = Annotated[int, Field(ge=8, le=4096)]


class Ideal(Strict):
    """Depth without errors."""

    kind: Literal["ideal"] = "ideal"

    def measure(self, view: View, rng: Rng) -> Measured:
        """Measure true depth; white surfaces have an infrared value of 1000 at 1 m."""
        del rng
        hits = view.trace()
        signal = 1000.0 * hits.reflectance[..., 0] / np.square(hits.range_m[..., 0])
        infrared = np.rint(np.clip(signal, 0, 65_535)).astype(np.uint16)
        return Measured(view.z_depth_m(0.0), infrared)


class DepthModel(Strict):
    """Data sheet of a depth camera.

    Attributes:
        size_px: Width and height of its images.
        hfov_deg: Horizontal field of view.
        range_m: Smallest and largest reported depth.
        principle: Principle of measurement: ``ideal``, ``structured_light``, ``active_stereo`` or
            ``time_of_flight``.
    """

    size_px: tuple[SidePx, SidePx] = (640, 480)
    hfov_deg: float = Field(60.0, ge=1, le=150)
    range_m: tuple[float, float] = (0.2, 10.0)
    principle: Annotated[
        Ideal | StructuredLight | ActiveStereo | TimeOfFlight, Field(discriminator="kind")
    ] = Ideal()

    @model_validator(mode="after")
    def _range_rises(self) -> DepthModel:
        low, high = self.range_m
        if not 0.0 <= low < high:
            raise ValueError(f"range_m must rise from 0 or more, got [{low:g}, {high:g}]")
        return self
