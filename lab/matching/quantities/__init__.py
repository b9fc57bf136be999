"""Quantities that are fitted to recordings, one per file; these tuples list them in their order.

A quantity has a statistic of one recording that mainly its parameter changes, the parameter's path
in a configuration, and the coordinate in which the statistic is about linear in the parameter.
"""

from gen_data.lab.matching.quantities.base import CameraQuantity, LabelQuantity, LidarQuantity
from gen_data.lab.matching.quantities.blur import BLUR
from gen_data.lab.matching.quantities.box_positions import BOX_POSITIONS
from gen_data.lab.matching.quantities.box_sizes import BOX_SIZES
from gen_data.lab.matching.quantities.contrast import CONTRAST
from gen_data.lab.matching.quantities.dark_returns import DARK_RETURNS
from gen_data.lab.matching.quantities.dropout import DROPOUT
from gen_data.lab.matching.quantities.exposure import EXPOSURE
from gen_data.lab.matching.quantities.lidar_range import RANGE
from gen_data.lab.matching.quantities.noise import NOISE
from gen_data.lab.matching.quantities.read_noise import READ_NOISE
from gen_data.lab.matching.quantities.reflectance import REFLECTANCE
from gen_data.lab.matching.quantities.saturation import SATURATION
from gen_data.lab.matching.quantities.white_balance import WHITE_BALANCE

CAMERA: tuple[CameraQuantity, ...] = (
    EXPOSURE,
    CONTRAST,
    WHITE_BALANCE,
    SATURATION,
    BLUR,
    NOISE,
    READ_NOISE,
)
"""Fitted together, by simulation. JPEG's quality comes before: see ``jpeg_quality``."""
LIDAR: tuple[LidarQuantity, ...] = (REFLECTANCE, DARK_RETURNS, DROPOUT, RANGE)
LABELS: tuple[LabelQuantity, ...] = (BOX_SIZES, BOX_POSITIONS)

__all__ = ["CAMERA", "LABELS", "LIDAR", "CameraQuantity", "LabelQuantity", "LidarQuantity"]
