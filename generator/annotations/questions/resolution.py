"""Smallest differences that a camera could measure, at the place and size of an object.

* An edge lies anywhere in its pixel: a rectangular distribution of one pixel, whose standard
  deviation is ``1 / sqrt(12)`` px (JCGM 100:2008, "Guide to the expression of uncertainty in
  measurement", 4.3.7). In space that is ``range * angle of the pixel / sqrt(12)`` across the ray.
* Along the ray, a depth camera has the error of its readings: the root mean square of measured
  minus true depth over the object's visible pixels. Any other camera derives it from the apparent
  size:
  ``z = f s / n``, therefore ``sigma_z = z sigma_n / n`` (5.1.2 of the guide; the triangulation
  ``sigma_z = z^2 sigma_d / (f b)`` of Khoshelham and Oude Elberink, Sensors 12, 2012, with the
  object as base), where n is the diagonal of the visible box and has two edges.
* Errors of different objects are independent and add as squares (5.1.2). Resolutions are expanded
  uncertainties with coverage factor 2 (6.2).

They are lower bounds: calibration is perfect, and so is the knowledge of real sizes.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from gen_data.core.boxes import BoxPx
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.se3 import Array

COVERAGE = 2.0
EDGE_PX = 1.0 / math.sqrt(12.0)
PIXEL = COVERAGE * math.sqrt(2.0) * EDGE_PX
"""Resolution of a difference of two positions in the image [px]."""


@dataclass(frozen=True, eq=False)
class Sight:
    """A camera's best possible measurement of one object.

    Attributes:
        ray: Unit vector from the camera to the centre of its 3D box, world.
        range_m: That distance.
        edge_m: Standard uncertainty of a point across the ray.
        depth_m: The same along the ray.
    """

    ray: Array
    range_m: float
    edge_m: float
    depth_m: float

    def variance_m2(self, direction: Array) -> float:
        """Variance of one of its points along a unit vector of the world."""
        along = float(self.ray @ direction) ** 2
        return self.edge_m**2 * max(1.0 - along, 0.0) + self.depth_m**2 * along


def sight(reading: SensorReading, number: int, box: BoxPx, center_m: Array) -> Sight | None:
    """A camera's best measurement of an instance; None without a measurement of its depth.

    Args:
        reading: Reading of the camera, with the channel INSTANCE.
        number: Instance id.
        box: Around its visible pixels.
        center_m: Centre of its 3D box, world [3].
    """
    camera = reading.camera
    offset = center_m - np.array(camera.T_world_camera.translation_m)
    range_m = float(np.linalg.norm(offset))
    x_px, y_px = 0.5 * (box.x_min + box.x_max), 0.5 * (box.y_min + box.y_max)
    ends = camera.intrinsics.rays(np.array([[x_px - 0.5, y_px], [x_px + 0.5, y_px]]))
    pixel_rad = 2.0 * math.asin(0.5 * float(np.linalg.norm(ends[1] - ends[0])))
    depth_m = depth_noise_m(reading, number, box)
    if depth_m is None:
        depth_m = range_m * math.sqrt(2.0) * EDGE_PX / math.hypot(box.width_px, box.height_px)
    if not (math.isfinite(pixel_rad) and math.isfinite(depth_m) and range_m > 0.0):
        return None
    return Sight(offset / range_m, range_m, range_m * pixel_rad * EDGE_PX, depth_m)


def depth_noise_m(reading: SensorReading, number: int, box: BoxPx) -> float | None:
    """Error of a depth camera on an instance, root mean square [m]; None for other cameras.

    inf if it measured less than half of the visible pixels.
    """
    channels = reading.channels
    if Channel.MEASURED_DEPTH not in channels or Channel.Z_DEPTH not in channels:
        return None
    window = box.window()
    shown = channels[Channel.INSTANCE][window] == number
    measured_m = channels[Channel.MEASURED_DEPTH][window][shown].astype(np.float64)
    true_m = channels[Channel.Z_DEPTH][window][shown].astype(np.float64)
    found = np.isfinite(measured_m) & np.isfinite(true_m)
    if 2 * int(found.sum()) < found.size:
        return math.inf
    return float(np.sqrt(np.mean((measured_m[found] - true_m[found]) ** 2)))


def expanded(variances: Iterable[float]) -> float:
    """Expanded uncertainty of a sum or difference of independent numbers."""
    return COVERAGE * math.sqrt(math.fsum(variances))


def area_px(length_px: float) -> float:
    """Resolution of an area with an outline of this length [px]: of so many pixels on its edge."""
    return COVERAGE * EDGE_PX * math.sqrt(length_px)
