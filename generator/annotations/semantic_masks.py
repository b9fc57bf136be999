"""Category images."""

from typing import ClassVar, Literal

from gen_data.annotations.instance_extents import crop, instance_error, visible_mask
from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.sample import ObjectTruth
from gen_data.core.scene import Scene


class SemanticMasks(Strict):
    """The category id of every pixel, written as an image; nothing is added to single objects."""

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE, Channel.CATEGORY})
    type: Literal["semantic_masks"] = "semantic_masks"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Check the category image against the truth, which stays unchanged.

        Raises:
            SampleError: if a visible pixel of the instance shows another category.
        """
        if truth.box is not None:
            instance = truth.instance
            shown = crop(reading.channels[Channel.CATEGORY], truth.box)
            if (shown[visible_mask(reading, truth)] != instance.category_id).any():
                raise instance_error(
                    reading, instance, "the category image shows another category than"
                    f" {instance.category_id} '{instance.category}' on its pixels",
                )  # fmt: skip
        return truth
