"""Sizes of boxes: the distance of the camera from its objects.

Statistic: the mean size of the boxes of an image, relative to the image. For a pinhole, sizes are
inversely proportional to distances.
"""

from typing import Any

import numpy as np

from gen_data.assemble.config import Config
from gen_data.config.distributions import Distribution
from gen_data.lab.matching import indirect_inference, recordings
from gen_data.lab.matching.quantities import base
from gen_data.randomizers.camera_pose import CameraPose


def measure(labels: recordings.ImageLabels) -> float:
    """Mean logarithm, base 2, of the square root of the share of the image; NaN without boxes."""
    pixels = labels.width_px * labels.height_px
    areas = np.array([width * height for *_, width, height in labels.boxes if width * height > 0])
    return float(0.5 * np.log2(areas / pixels).mean()) if len(areas) else float("nan")


def _change(config: Config, camera: str, coordinate: float) -> base.FieldChange:
    for number, pose in enumerate(config.probes[0].randomizers):
        if isinstance(pose, CameraPose) and pose.camera in ("", camera):
            if pose.fills is None:
                value = _scaled(pose.distance_m, 2.0**-coordinate)
                return base.FieldChange("randomizers", number, "distance_m", value)
            value = _scaled(pose.fills, 2.0**coordinate)
            return base.FieldChange("randomizers", number, "fills", value)
    raise base.NoParameter("no camera_pose sets a distance")


def _scaled(distribution: Distribution[float], factor: float) -> Any:
    def scale(value: float) -> float:
        return factor * value

    return base.map_numbers(distribution.to_yaml(), scale, scale)


def _slope(focal_heights: float) -> float:
    del focal_heights
    return 1.0


BOX_SIZES = base.LabelQuantity(
    "box sizes", "factor", "mean log2 of the size of boxes over the image's size",
    measure, _slope, _change,
    indirect_inference.Axis(-3.0, 3.0, step=0.25, plausible=1.0, enough=0.15, varies=False),
    to_value=base.power_of_two,
)  # fmt: skip
