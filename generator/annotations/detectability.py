"""How well an object can be told from the pixels around it, given the noise of its camera."""

from dataclasses import replace
from typing import ClassVar, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.annotations.instance_extents import crop
from gen_data.config.base_model import Strict
from gen_data.core.boxes import BoxPx
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.sample import ObjectTruth
from gen_data.core.scene import Scene

GAP_PX = 1
"""Pixels next to an object that count neither as object nor as background: the lens mixes both."""
RING_PX = 4
"""Width of the background around them."""


class Detectability(Strict):
    """Index d' of the ideal observer of one photograph: near 1 barely detectable, above 5 plain.

    The observer is given the object's expected pixels, and of the background the mean and variance
    per colour in a ring around the object; it decides which of both the visible pixels show. d'^2
    is the sum over them of the squared difference of the means over the mean of both variances
    (Barrett and Myers, "Foundations of Image Science", 2004, section 13.2.12, for uncorrelated
    noise). Size, contrast, blur, exposure, saturation, the noise of the sensor (EMVA standard 1288)
    and clutter have their effect; colour processing and compression have none. A camera without
    ``image_sensor`` has the noise of rounding to bytes. Laser scanners count returns: their index
    is the square root of ``lidar_points`` (Rose, "The sensitivity performance of the human eye on
    an absolute scale", J. Opt. Soc. Am. 38, 1948).

    Images without a photograph have none; hidden objects have 0.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE, Channel.SIGNAL})
    type: Literal["detectability"] = "detectability"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``detectability``."""
        del scene
        if reading.signal is None:
            return truth
        if truth.box is None:
            return replace(truth, detectability=0.0)
        window = _window(truth.box, *reading.signal.mean.shape[:2])
        seen = crop(reading.channels[Channel.INSTANCE], window) == truth.instance.instance_id
        mean = np.asarray(crop(reading.signal.mean, window), np.float64)
        variance = np.asarray(crop(reading.signal.stddev, window), np.float64) ** 2
        ring = _grown(seen, GAP_PX + RING_PX) & ~_grown(seen, GAP_PX)
        # The filters of a sensor repeat after two pixels.
        phases = [np.s_[row::2, column::2] for row in (0, 1) for column in (0, 1)]
        square = sum(
            _square(mean[phase], variance[phase], seen[phase], ring[phase]) for phase in phases
        )
        return replace(truth, detectability=round(float(np.sqrt(square)), 3))


def _window(box: BoxPx, height_px: int, width_px: int) -> BoxPx:
    """The box with its ring, in the image, from an even row and column on."""
    reach = GAP_PX + RING_PX
    x_min, y_min = (max(low - reach, 0) // 2 * 2 for low in (box.x_min, box.y_min))
    return BoxPx(x_min, y_min, min(box.x_max + reach, width_px), min(box.y_max + reach, height_px))


def _grown(mask: NDArray[np.bool_], by_px: int) -> NDArray[np.bool_]:
    kernel = np.ones((2 * by_px + 1, 2 * by_px + 1), np.uint8)
    return np.asarray(cv2.dilate(mask.astype(np.uint8), kernel) > 0)


def _square(
    mean: NDArray[np.float64],
    variance: NDArray[np.float64],
    seen: NDArray[np.bool_],
    ring: NDArray[np.bool_],
) -> float:
    """Share of the pixels of one filter in d'^2; arrays are [h, w, c] and [h, w]."""
    values, noise = mean[seen], variance[seen]
    if not ring.any():
        # Nothing else is near: against black.
        return float((values**2 / noise).sum())
    behind = mean[ring].mean(axis=0)
    clutter = variance[ring].mean(axis=0) + mean[ring].var(axis=0)
    return float(((values - behind) ** 2 / (0.5 * (noise + clutter))).sum())
