"""Visible, occluded and truncated fractions of instances."""

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np

from gen_data.annotations.instance_extents import find_silhouette, silhouette_box, silhouette_crop
from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.sample import ObjectTruth
from gen_data.core.scene import Scene


class Visibility(Strict):
    """Three shares in [0, 1], all ratios of pixel counts.

    ``visible_fraction`` is BOP's ``visib_fract``: it refers to the silhouette inside and outside
    the image, which keeps a truncated object below 1 even without occlusion (Hodan et al., "BOP
    Challenge 2020", section 2). An instance without a silhouette is fully truncated.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE, Channel.AMODAL})
    type: Literal["visibility"] = "visibility"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``visible_fraction``, ``occlusion`` and ``truncation``."""
        silhouette = find_silhouette(reading, truth.instance)
        outer = silhouette_box(silhouette)
        if outer is None:
            return replace(truth, visible_fraction=0.0, occlusion=0.0, truncation=1.0)
        camera = reading.camera.intrinsics
        inner = outer.clipped(camera.width_px, camera.height_px)
        whole_px = int(np.count_nonzero(silhouette.mask))
        inside_px = int(np.count_nonzero(silhouette_crop(silhouette, inner))) if inner else 0
        return replace(
            truth,
            visible_fraction=truth.visible_px / whole_px,
            occlusion=(inside_px - truth.visible_px) / inside_px if inside_px else 0.0,
            truncation=(whole_px - inside_px) / whole_px,
        )
