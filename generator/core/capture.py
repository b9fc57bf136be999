"""What sensors saw of one Scene at one instant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.core.scene import Camera


class Channel(str, Enum):
    """An image a renderer can make. Label channels come from the pixel-centre ray alone.

    ====================  ======================  ==========================================
    channel               array                   meaning; value for "nothing"
    ====================  ======================  ==========================================
    RGB                   uint8 [h, w, 3]         sRGB, anti-aliased
    Z_DEPTH               float32 [h, w]          along the optical axis [m]; inf
    RANGE                 float32 [h, w]          along the ray [m]; inf
    NORMALS               float32 [h, w, 3]       unit, camera frame, towards the camera; 0
    INSTANCE              uint16 [h, w]           instance id; 0
    PART                  uint16 [h, w]           part id within the instance; 0
    CATEGORY              uint16 [h, w]           category id; 0
    OBJECT_COORDINATES    float32 [h, w, 3]       position in the instance's box, [0, 1]; 0
    AMODAL                (silhouettes)           each instance alone, also outside the image
    ====================  ======================  ==========================================
    """

    RGB = "rgb"
    Z_DEPTH = "depth"
    RANGE = "range"
    NORMALS = "normals"
    INSTANCE = "instance"
    PART = "part"
    CATEGORY = "category"
    OBJECT_COORDINATES = "object_coordinates"
    AMODAL = "amodal"


@dataclass(frozen=True, eq=False, slots=True)
class Silhouette:
    """One instance as if nothing stood before it, on a canvas three images wide and high.

    Attributes:
        x_px, y_px: Where the mask's first pixel lies in the image; may be negative.
        mask: bool [h, w], tight around the silhouette; [0, 0] where nothing is in the canvas.
    """

    instance_id: int
    x_px: int
    y_px: int
    mask: NDArray[np.bool_]


@dataclass(frozen=True, eq=False, slots=True)
class Reading:
    """What one sensor returned.

    Attributes:
        channels: Arrays by channel, as listed at Channel.
        silhouettes: By instance id; empty unless AMODAL was asked for.
    """

    sensor: str
    camera: Camera
    channels: Mapping[Channel, NDArray[Any]]
    silhouettes: Mapping[int, Silhouette] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, slots=True)
class Capture:
    """All readings of one instant, by sensor name."""

    readings: Mapping[str, Reading]
