"""Scans of laser scanners by renderers of a few lines of numpy."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gen_data.core.asset_types import SURFACES
from gen_data.core.capture import PATHS, LidarHits, LidarRays, PointCloud, SecondaryHits
from gen_data.core.scene import Scene, Weather
from gen_data.core.streams import Rng, Streams
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.lidar.lidar_sensor import LidarSensor

MIRRORED = SURFACES.index("mirrored")


def rng(seed: int = 0) -> Rng:
    return Streams(seed=seed, scene=0).rng("sensor/lidar")


def scene_with(sensor: LidarSensor, weather: Weather | None = None) -> Scene:
    scene = sensor.mount(RgbCamera(name="color").mount(Scene("t")))
    return replace(scene, weather=weather or Weather())


def capture(
    sensor: LidarSensor, renderer: Any, weather: Weather | None = None, seed: int = 0
) -> PointCloud:
    cloud = sensor.capture(scene_with(sensor, weather), renderer, frozenset(), rng(seed))
    assert isinstance(cloud, PointCloud)
    return cloud


def echoes(
    ranges_m: ArrayLike, reflectance: float = 0.5, ids: ArrayLike = 7, categories: ArrayLike = 2
) -> LidarHits:
    """Hits where ranges are finite [n, subrays], square on, of instances and categories."""
    ranges_m = np.asarray(ranges_m, np.float32)
    hit = np.isfinite(ranges_m)
    return LidarHits(
        ranges_m,
        np.where(hit, np.float32(reflectance), np.float32(0)),
        hit.astype(np.float32),
        np.where(hit, ids, 0).astype(np.uint16),
        np.where(hit, categories, 0).astype(np.uint16),
        np.zeros(ranges_m.shape, np.uint8),
    )


def with_mirrors(
    hits: LidarHits, beams: LidarRays, rows: ArrayLike, reflectance: float
) -> LidarHits:
    """Hits of which four beams meet more, 50 m away.

    Three see instance 5 in a mirror, at (1, 2, 3) of the scanner; the last one 9 behind glass.
    """
    surface = np.array([MIRRORED] * 3 + [0], np.uint8)
    ids, shown = np.array([0, 0, 0, 9], np.uint16), np.array([5, 5, 5, 0], np.uint16)
    far_m, bright = np.full((2, 4), [[50.0], [reflectance]], np.float32)
    detours = SecondaryHits(np.asarray(rows) * beams.subrays, far_m, bright, ids, ids, surface)
    if beams.mirrored:
        places_m = np.full((4, 3), (1, 2, 3), np.float32)
        detours = replace(detours, mirrored_id=shown, mirrored_m=places_m)
    return replace(hits, detours=detours)


def paths_of(cloud: PointCloud) -> Any:
    """Names of the paths of points, which agree with surfaces and instances of ``with_mirrors``."""
    points, origins = cloud.points, cloud.origins
    assert origins is not None and len(origins) == len(points)
    path = np.array(PATHS)[origins["path"]]
    mirrored = points["surface"] == MIRRORED
    assert ((path == "mirror") == mirrored).all()
    assert ((path == "glass") == (points["instance_id"] == 9)).all()
    expected = np.where(mirrored, 5, points["instance_id"])
    np.testing.assert_array_equal(origins["true_instance_id"], expected)
    return path
