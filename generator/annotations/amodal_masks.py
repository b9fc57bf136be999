"""Amodal masks: whole silhouettes."""

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np

from gen_data.annotations.instance_extents import find_silhouette, silhouette_box, silhouette_crop
from gen_data.config.base_model import Strict
from gen_data.core.boxes import tight_box
from gen_data.core.capture import Channel, SensorReading, Silhouette
from gen_data.core.sample import MaskPx, ObjectTruth
from gen_data.core.scene import Scene


class AmodalMasks(Strict):
    """Pixels of an instance as if nothing occluded it; masks of instances may overlap."""

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE, Channel.AMODAL})
    type: Literal["amodal_masks"] = "amodal_masks"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``amodal_mask``, clipped to the image and tight; [0, 0] if nothing is inside."""
        camera = reading.camera.intrinsics
        silhouette = find_silhouette(reading, truth.instance)
        return replace(truth, amodal_mask=clip_mask(silhouette, camera.width_px, camera.height_px))


def clip_mask(silhouette: Silhouette, width_px: int, height_px: int) -> MaskPx:
    """The part of a silhouette inside an image, tight; shape [0, 0] when there is none."""
    outer = silhouette_box(silhouette)
    inner = outer.clipped(width_px, height_px) if outer else None
    # The part inside the image may be smaller than the clipped box.
    box = tight_box(silhouette_crop(silhouette, inner), inner.x_min, inner.y_min) if inner else None
    if box is None:
        return MaskPx(0, 0, np.zeros((0, 0), dtype=bool))
    return MaskPx(box.x_min, box.y_min, silhouette_crop(silhouette, box))
