"""A depth camera's data sheet."""

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
    """No error at all."""

    kind: Literal["ideal"] = "ideal"

    def measure(self, view: View, rng: Rng) -> Measured:
        """The true depth; the infrared image is that of a lamp beside the lens, 1000 at 1 m."""
        del rng
        met = view.lit()
        signal = 1000.0 * met.reflectance[..., 0] / np.square(met.range_m[..., 0])
        infrared = np.rint(np.clip(signal, 0, 65_535)).astype(np.uint16)
        return Measured(view.z_depth_m(0.0), infrared)


class DepthModel(Strict):
    """What a depth camera is.

    Attributes:
        size_px: Width and height of its images.
        hfov_deg: Horizontal field of view.
        range_m: Least and largest depth it reports.
        principle: How it measures: ``ideal``, ``structured_light``, ``active_stereo`` or
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
