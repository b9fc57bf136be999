"""Beams of several rays at the edges of a scene, and of one ray elsewhere."""

import numpy as np
import pytest

from gen_data.core.capture import LidarHits, LidarRays
from gen_data.core.scene import Lidar, Scene
from gen_data.sensors.lidar import beam_edges
from gen_data.sensors.lidar.lidar_sensor import LidarSensor
from gen_data.sensors.lidar.scan_pattern import make_sweep
from tests.sensors.scanned import capture, echoes, paths_of, with_mirrors

HALF_POST_RAD = np.radians(1.0)
POST_ID, GROUND_ID = 7, 3
STAGGERED = tuple((-3.0 - 2.0 * k, 3.0 * (-1) ** k) for k in range(8))
"""Elevation and azimuth offset of lasers [deg], all below the horizon."""


def directions(beams: LidarRays) -> np.ndarray:
    """Of each ray [n, subrays, 3]: the axis, and six around half of the beam's light."""
    axis = beams.directions.astype(np.float64)
    across = np.cross([0.0, 0.0, 1.0], axis)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(axis, across)
    rays = [axis]
    for k in range(beams.subrays - 1):
        turn = k * np.pi / 3.0
        away = np.tan(0.5 * beams.divergence_rad) / np.sqrt(2.0)
        rays.append(axis + away * (np.cos(turn) * across + np.sin(turn) * up))
    return np.stack(rays, axis=1)


class Post:
    """A renderer of level ground 1.7 m below, and of a post 10 m ahead that is 2 degrees wide."""

    def __init__(self) -> None:
        self.traced = 0

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        d = directions(beams)
        self.traced += d.shape[0] * d.shape[1]
        level = np.hypot(d[..., 0], d[..., 1])
        to_ground = np.where(d[..., 2] < 0.0, -1.7 / np.minimum(d[..., 2], -1e-9), np.inf)
        to_post = np.where(
            np.abs(np.arctan2(d[..., 1], d[..., 0])) < HALF_POST_RAD, 10.0 / level, np.inf
        )
        ids = np.where(to_post < to_ground, POST_ID, GROUND_ID)
        return echoes(np.minimum(to_ground, to_post), ids=ids, categories=ids)


@pytest.mark.parametrize("beams", [(), STAGGERED])
def test_beams_on_one_plane_have_no_edges_and_beams_at_a_post_do(
    beams: tuple[tuple[float, float], ...],
) -> None:
    """On each ring the last beam before either side of the post, and the first one on it."""
    sensor = LidarSensor(model="VLP-16", beams=beams or tuple((e, 0.0) for e, _ in STAGGERED))
    sweep, model = make_sweep(sensor.device, 0.0), sensor.device
    rays = LidarRays(sweep.directions, 0.0, 1, 100.0)
    hits = Post().scan(Scene("t"), Lidar("l", ""), rays)
    down = -sweep.directions[:, 2].astype(np.float64)
    assert not len(beam_edges.find_edges((1.7 / down).astype(np.float32), model))

    azimuth = np.arctan2(sweep.directions[:, 1], sweep.directions[:, 0]).astype(np.float64)
    step = 2.0 * np.pi / model.columns
    # The lower rings meet the ground before the post, which ends there.
    upper = 1.7 / down > 10.0 / np.hypot(sweep.directions[:, 0], sweep.directions[:, 1]) + 0.8
    found = np.zeros(len(azimuth), bool)
    found[beam_edges.find_edges(hits.range_m[:, 0], model)] = True
    beside = np.abs(np.abs(azimuth) - HALF_POST_RAD) < step
    assert found[upper & beside].all() and (upper & beside).sum() >= 4 * len(
        np.unique(sweep.ring[upper])
    )
    assert not found[np.abs(azimuth) > HALF_POST_RAD + 1.5 * step].any()


@pytest.mark.parametrize("model", ["VLP-16", "HDL-64E", "OS1-128", "livox"])
def test_beams_of_seven_rays_at_edges_find_the_points_of_seven_rays_everywhere(model: str) -> None:
    """For less than a third of the rays; of rosettes, whose rings are unknown, some of them."""
    traced, points = {}, {}
    for divergence in (True, "edges", False):
        sensor = LidarSensor(model=model, ideal=True, divergence=divergence)
        renderer = Post()
        points[divergence] = capture(sensor, renderer).points
        traced[divergence] = renderer.traced
    on_post = {d: int((p["instance_id"] == POST_ID).sum()) for d, p in points.items()}

    assert traced["edges"] < traced[True] / 3
    assert on_post[False] <= on_post["edges"] <= on_post[True]
    if model != "livox":
        # Beams at the foot of the post meet both within a pulse length.
        np.testing.assert_array_equal(points["edges"]["ring"], points[True]["ring"])
        same = points["edges"]["instance_id"] == points[True]["instance_id"]
        assert same.mean() > 0.9999
    if model == "HDL-64E":  # whose beams lie closest
        assert on_post["edges"] > on_post[False]


class Rooms(Post):
    """As Post; three of the traced beams also see instance 5 in a mirror, the next one a pane."""

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        hits = super().scan(scene, lidar, beams)
        post = np.flatnonzero(hits.instance_id[:, 0] == POST_ID)
        # Of all beams the ones in the middle of the post, where there is no edge.
        aside = np.abs(np.arctan2(beams.directions[post, 1], beams.directions[post, 0]))
        post = np.sort(post[np.argsort(aside, kind="stable")[:4]])
        return with_mirrors(hits, beams, post, 300.0)


def test_origins_belong_to_the_rays_of_both_kinds_of_beams() -> None:
    sensor = LidarSensor(model="VLP-16", divergence="edges", origins=True, returns="dual")
    path = paths_of(capture(sensor, Rooms()))
    assert (path == "mirror").sum() > 3 and (path == "glass").any()
