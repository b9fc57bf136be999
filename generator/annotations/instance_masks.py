"""Masks of visible pixels."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np

from generator.annotations.pixels import visible_mask
from generator.config.strict import Strict
from generator.core.capture import Channel, Reading
from generator.core.sample import MaskPx, ObjectTruth
from generator.core.scene import Scene


class InstanceMasks(Strict):
    """The pixels in which the instance is seen; no two instances share one."""

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE})
    type: Literal["instance_masks"] = "instance_masks"

    def annotate(self, scene: Scene, reading: Reading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``mask``; its pixels fill the box exactly. Shape [0, 0] for the invisible."""
        if truth.box is None:
            return replace(truth, mask=MaskPx(0, 0, np.zeros((0, 0), dtype=bool)))
        pixels = visible_mask(reading, truth)
        return replace(truth, mask=MaskPx(truth.box.x_min, truth.box.y_min, pixels))
