"""Positions of boxes: the pitch of the camera.

Statistic: the mean height of the centres of the boxes of an image. A camera that tilts upwards by a
small angle moves its image down by that angle times its focal length.
"""

import math

import numpy as np

from gen_data.assemble.config import Config
from gen_data.lab.matching import indirect_inference, recordings
from gen_data.lab.matching.quantities import base
from gen_data.randomizers.camera_on_lane import CameraOnLane
from gen_data.sensors.mounting import Mounted


def measure(labels: recordings.ImageLabels) -> float:
    """Mean centre below the middle, in heights of the image; NaN without boxes."""
    if not labels.boxes:
        return float("nan")
    centres = [top + 0.5 * height for *_, top, _, height in labels.boxes]
    return float(np.mean(centres)) / labels.height_px - 0.5


def _change(config: Config, camera: str, coordinate: float) -> base.FieldChange:
    def shifted(value: float) -> float:
        return value + coordinate

    def kept(value: float) -> float:
        return value

    for number, randomizer in enumerate(config.probes[0].randomizers):
        if isinstance(randomizer, CameraOnLane):
            value = base.map_numbers(randomizer.pitch_deg.to_yaml(), shifted, kept)
            return base.FieldChange("randomizers", number, "pitch_deg", value)
    for number, sensor in enumerate(config.sensors):
        if isinstance(sensor, Mounted) and sensor.name == camera and sensor.rig:
            value = base.map_numbers(sensor.pitch_deg, shifted, kept)
            return base.FieldChange("sensors", number, "pitch_deg", value)
    raise base.NoParameter("no camera_on_lane and no rig sets a pitch; camera_pose aims at objects")


def _slope(focal_heights: float) -> float:
    return math.radians(focal_heights)


BOX_POSITIONS = base.LabelQuantity(
    "box positions", "degrees", "mean height of the centres of boxes",
    measure, _slope, _change,
    indirect_inference.Axis(-20.0, 20.0, step=1.0, plausible=5.0, enough=0.5, varies=False),
)  # fmt: skip
