"""Visible pixels of the parts of articulated objects."""

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np

from gen_data.annotations.instance_extents import crop, instance_error, visible_mask
from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.sample import ObjectTruth
from gen_data.core.scene import Scene


class PartMasks(Strict):
    """Number of visible pixels of each part; the masks themselves are the part image.

    Pixels with part id 0 belong to the instance as a whole and to none of its parts.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE, Channel.PART})
    type: Literal["part_masks"] = "part_masks"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``part_px`` for an instance with parts, every part named; else None.

        Raises:
            SampleError: if a pixel shows a part that the instance does not have.
        """
        instance = truth.instance
        if not instance.parts:
            return truth
        counts = np.zeros(len(instance.parts) + 1, dtype=np.intp)
        if truth.box is not None:
            shown = crop(reading.channels[Channel.PART], truth.box)[visible_mask(reading, truth)]
            counts = np.bincount(shown, minlength=len(counts))
        if len(counts) > len(instance.parts) + 1:
            shown_part, known = len(counts) - 1, len(instance.parts)
            fault = f"the part image shows part {shown_part}; it has {known} parts"
            raise instance_error(reading, instance, fault)
        names = instance.parts
        return replace(truth, part_px={name: int(counts[k]) for k, name in enumerate(names, 1)})
