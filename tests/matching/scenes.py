"""Scenes without a renderer: light in front of a camera, surfaces around a laser scanner.

Pictures are dead leaves: opaque shapes with a power law of sizes, whose edges and levels are those
of natural images (Lee, Mumford and Huang, "Occlusion models for natural images", 2001).
"""

import math
from collections.abc import Iterable
from typing import Any

import cv2
import numpy as np

from gen_data.core.asset_types import Float32
from gen_data.core.capture import LidarHits
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Camera, Lidar, Scene, Weather
from gen_data.core.se3 import SE3
from gen_data.core.streams import Streams
from gen_data.lab.matching.simulation import Exposure, Illumination
from gen_data.sensors.camera.image_pipeline import ImagePipeline
from gen_data.sensors.lidar.lidar_sensor import LidarSensor

WIDTH_PX, HEIGHT_PX, FINER = 320, 240, 4
CAMERA = Camera("color", SE3(), Intrinsics.from_hfov(WIDTH_PX, HEIGHT_PX, math.radians(60.0)))
SHEET = {"elevations_deg": ({"first": 10.0, "last": -10.0, "count": 8},), "rotation_hz": 10.0,
         "points_per_second": 32_000, "range_m": (0.5, 100.0), "range_noise_m": 0.01,
         "range_step_m": 0.0, "divergence_mrad": 3.0, "pulse_m": 0.5, "wavelength_nm": 905.0,
         "seen": {"reflectance": 0.1, "range_m": 20.0}, "white_intensity": 0.4}  # fmt: skip
RESPONSE = {"half": 0.2, "dark": 0.05, "range_exponent": 0.0, "noise": 0.02, "laser_spread": 0.05,
            "step": 0.01}  # fmt: skip
"""Of a scanner that reports 0 for dark surfaces."""


def leaves(seed: int) -> Float32:
    """Radiance [cd/m^2] of shapes of random colours, float32 [h, w, 3]."""
    rng = np.random.default_rng(seed)
    width, height = FINER * WIDTH_PX, FINER * HEIGHT_PX
    image = np.full((height, width, 3), 100.0, np.float32)
    for _ in range(250):
        x, y = float(rng.integers(width)), float(rng.integers(height))
        radius = FINER * min(80.0, 4.0 * (1.0 - rng.random()) ** -0.6)
        color = (100.0 * 2.0 ** rng.normal(0.0, 1.2) * 2.0 ** rng.normal(0.0, 0.25, 3)).tolist()
        if rng.integers(2):
            cv2.circle(image, (int(x), int(y)), int(radius), color, -1)
        else:
            corners = cv2.boxPoints(((x, y), (2.0 * radius, 1.4 * radius), rng.uniform(0.0, 90.0)))
            cv2.fillPoly(image, [corners.astype(np.int32)], color)
    return np.asarray(cv2.resize(image, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA))


def exposures(seeds: Iterable[int], pipeline: ImagePipeline) -> list[Exposure]:
    return [
        Exposure(leaves(seed), None, CAMERA, Weather(), pipeline, Streams(seed=seed, scene=0))
        for seed in seeds
    ]


def scanner(**changes: Any) -> LidarSensor:
    window = changes.pop("window", 1.0)
    sheet = {**SHEET, **changes}
    given = {"model": sheet, "window": window, "motion_distortion": "none"}
    return LidarSensor.model_validate(given)


def illuminations(seeds: Iterable[int], sensor: LidarSensor) -> list[Illumination]:
    """Walls at 2 to 60 m whose reflectances are 0.02 to 0.8, around a scanner."""
    lidar = Lidar("lidar", "", rig="ego", sweep_s=0.1)
    scene = Scene("test", lidars=(lidar,))
    made = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        pulses = 3200
        range_m = 2.0 ** rng.uniform(1.0, 5.9, (pulses, 1)).astype(np.float32)
        reflectance = 2.0 ** rng.uniform(-5.6, -0.3, (pulses, 1)).astype(np.float32)
        ids = np.zeros((pulses, 1), np.uint16)
        ones = np.ones((pulses, 1), np.float32)
        hits = LidarHits(
            range_m, reflectance.astype(np.float32), ones, ids, ids, ids.astype(np.uint8)
        )
        made.append(Illumination(scene, hits, sensor, Streams(seed=seed, scene=0)))
    return made
