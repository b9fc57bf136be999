"""Published statistics of KITTI's object training set (7,481 images).

* Objects: counted in ``label_2`` of the object benchmark's training set (A. Geiger, P. Lenz,
  R. Urtasun, "Are we ready for Autonomous Driving? The KITTI Vision Benchmark Suite", CVPR 2012;
  https://www.cvlibs.net/datasets/kitti/eval_object.php).
* Mean sizes: ``g_type_mean_size`` of Frustum PointNets (C. R. Qi et al., CVPR 2018,
  models/model_util.py).
* Points per scan: about 120,000 on average (A. Geiger et al., "Vision meets Robotics: The KITTI
  Dataset", IJRR 2013). SemanticKITTI (J. Behley et al., ICCV 2019) counts 4,549 million in 43,552
  scans of the odometry sequences: 104,450 each.
* Difficulties: the devkit's evaluate_object.cpp.
"""

from __future__ import annotations

from dataclasses import dataclass

IMAGES = 7481
POINTS_PER_SCAN = (120_000, 104_450)
"""Points per scan of the raw recordings, and of the odometry sequences."""


@dataclass(frozen=True, slots=True)
class KittiType:
    """One of KITTI's types: number of objects, and mean height, width and length [m]."""

    objects: int
    size_hwl_m: tuple[float, float, float]


TYPES = {
    "Car": KittiType(28742, (1.526, 1.629, 3.883)),
    "Van": KittiType(2914, (2.205, 1.901, 5.068)),
    "Truck": KittiType(1094, (3.252, 2.585, 10.136)),
    "Pedestrian": KittiType(4487, (1.763, 0.661, 0.844)),
    "Person_sitting": KittiType(222, (1.275, 0.598, 0.801)),
    "Cyclist": KittiType(1627, (1.737, 0.597, 1.763)),
    "Tram": KittiType(511, (3.531, 2.532, 16.172)),
    "Misc": KittiType(973, (1.923, 1.543, 3.643)),
}


@dataclass(frozen=True, slots=True)
class Difficulty:
    """Limits for an object to count at a difficulty.

    Attributes:
        height_px: Smallest height of its box.
        occlusion_level, truncation: Largest values.
    """

    name: str
    height_px: float
    occlusion_level: int
    truncation: float


DIFFICULTIES = (
    Difficulty("easy", 40.0, 0, 0.15),
    Difficulty("moderate", 25.0, 1, 0.30),
    Difficulty("hard", 25.0, 2, 0.50),
)
