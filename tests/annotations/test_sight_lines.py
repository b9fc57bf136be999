"""Rays to points: which are traced side by side."""

from typing import Any

import numpy as np

from gen_data.annotations.sight_lines import cast_rays
from gen_data.core.capture import LidarHits, LidarRays
from gen_data.core.scene import Lidar, Scene
from gen_data.core.streams import Streams


class Recorder:
    """A renderer that keeps the rays that it is asked for."""

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        del scene, lidar
        self.beams = beams
        nothing: Any = np.zeros((len(beams.directions), 1))
        return LidarHits(nothing, nothing, nothing, nothing, nothing, nothing)


def test_rays_of_two_sensors_are_traced_sensor_by_sensor_and_neighbours_together() -> None:
    """Every ray once; of each sensor without a gap; the next ray is nearly parallel."""
    rng = Streams(seed=3, scene=0).rng("rays")
    ways = rng.normal(size=(4000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    sensor = rng.integers(0, 2, 4000)
    recorder: Any = Recorder()

    cast_rays(
        Scene("s", ()), np.array([[0.0, 0.0, 1.0], [0.5, 0.0, 2.0]])[sensor], ways, 9.0, recorder
    )

    order = recorder.beams.order
    np.testing.assert_array_equal(np.sort(order), np.arange(4000))
    assert np.count_nonzero(np.diff(sensor[order])) == 1
    apart_deg = np.degrees(
        np.arccos(np.clip((ways[order][1:] * ways[order][:-1]).sum(axis=1), -1, 1))
    )
    # 72 sectors with 28 rays each of a sensor, on average 6.4 degrees apart in elevation.
    assert np.median(apart_deg) < 8.0
