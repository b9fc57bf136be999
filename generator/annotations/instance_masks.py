"""Masks of visible pixels."""

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np

from gen_data.annotations.instance_extents import visible_mask
from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.sample import MaskPx, ObjectTruth
from gen_data.core.scene import Scene


class InstanceMasks(Strict):
    """Visible pixels of an instance; masks of instances never overlap."""

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE})
    type: Literal["instance_masks"] = "instance_masks"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``mask``; its pixels fill the box exactly. Shape [0, 0] for the invisible."""
        if truth.box is None:
            return replace(truth, mask=MaskPx(0, 0, np.zeros((0, 0), dtype=bool)))
        pixels = visible_mask(reading, truth)
        return replace(truth, mask=MaskPx(truth.box.x_min, truth.box.y_min, pixels))
