"""Image boxes of visible pixels and of whole silhouettes."""

from dataclasses import replace
from typing import ClassVar, Literal

from gen_data.annotations.instance_extents import find_silhouette, silhouette_box
from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.sample import ObjectTruth
from gen_data.core.scene import Scene


class Boxes2d(Strict):
    """Tight boxes [px]: ``box`` of visible pixels, ``amodal_box`` of the silhouette.

    The amodal box includes hidden parts and parts outside the image; None for an instance outside
    the renderer's canvas of three images width and height.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE, Channel.AMODAL})
    type: Literal["boxes2d"] = "boxes2d"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``amodal_box``; ``box`` is part of every truth."""
        return replace(truth, amodal_box=silhouette_box(find_silhouette(reading, truth.instance)))
