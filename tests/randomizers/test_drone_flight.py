"""Flights of drones: mechanics of coordinated turns, the gimbal, and its target."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.errors import ConfigError, LayoutRejected
from gen_data.core.scene import Body, Lane, Rig, Scene
from gen_data.core.se3 import SE3, Array
from gen_data.randomizers.drone_flight import GRAVITY_M_S2, LEAN_PER_M_S, DroneFlight
from tests.streets import thin_street

ROAD = Lane("road", "driving", ((-200.0, 0.0, 3.0), (200.0, 0.0, 3.0)), 3.5, road="main")
SCENE = Scene(
    "street",
    bodies=(
        Body("drone", "drone?seed=0", SE3((0.0, 0.0, 50.1))),
        Body("drone_gimbal", "gimbal", SE3((0.0, 0.0, 50.0))),
    ),
    rigs=(Rig("drone", "drone"), Rig("drone_gimbal", "drone_gimbal")),
    lanes=(ROAD,),
)


class Nothing:
    """A library that is asked for nothing: the scene has no solid bodies."""


def flown(seed: int = 0, scene: Scene = SCENE, **fields: Any) -> Scene:
    rng = np.random.Generator(np.random.Philox(seed))
    return DroneFlight(name="flight", **fields)(scene, Nothing(), rng)  # type: ignore[arg-type]


def poses(scene: Scene, body: str, times_s: Array) -> list[SE3]:
    track = scene.track(body)
    assert track is not None
    return [track.pose(float(t)) for t in times_s]


TIMES_S = np.arange(0.0, 10.0, 0.05)


@pytest.mark.parametrize("seed", range(5))
def test_the_specific_force_stays_in_the_airframes_plane_of_symmetry(seed: int) -> None:
    """In a coordinated turn nothing pushes sideways: acceleration by differences of places."""
    scene = flown(seed, swing_deg=8.0, bank_deg=10.0, speed_m_s=8.0)
    frames = poses(scene, "drone_gimbal", TIMES_S)
    places = np.array([pose.translation_m for pose in frames])
    force = np.diff(places, n=2, axis=0) / 0.05**2 + [0.0, 0.0, GRAVITY_M_S2]
    airframes = poses(scene, "drone", TIMES_S)[1:-1]
    sideways = [pose.rotation()[:, 1] @ f for pose, f in zip(airframes, force, strict=True)]

    assert np.abs(sideways).max() < 0.02 * GRAVITY_M_S2
    assert np.abs(np.diff(places, n=2, axis=0) / 0.05**2).max() > 0.5  # it does turn


def test_a_constant_bank_flies_a_circle_of_the_known_radius() -> None:
    """v^2 / (g tan(bank)), to the left."""
    scene = flown(bank_deg=10.0, swing_deg=0.0, speed_m_s=5.0, residual=0.0, duration_s=30.0)
    places = np.array(
        [pose.translation_m for pose in poses(scene, "drone_gimbal", np.arange(0.0, 28.0, 0.5))]
    )
    circle = np.column_stack([2 * places[:, :2], np.ones(len(places))])
    (x, y, rest), *_ = np.linalg.lstsq(circle, (places[:, :2] ** 2).sum(1), rcond=None)
    radius_m = math.sqrt(rest + x * x + y * y)
    first, second = places[1] - places[0], places[2] - places[1]

    assert radius_m == pytest.approx(25.0 / (GRAVITY_M_S2 * math.tan(math.radians(10.0))), rel=1e-3)
    assert first[0] * second[1] - first[1] * second[0] > 0.0
    assert np.ptp(places[:, 2]) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_the_optical_axis_meets_the_road_at_time_0(seed: int) -> None:
    """At the drawn height above the ground there, and no nearer to the road's ends than allowed."""
    pose = flown(seed, offset_m=0.0, residual=0.0, from_end_m=90.0).rig_pose("drone_gimbal")
    eye, axis = np.array(pose.translation_m), pose.rotation()[:, 0]
    hit = eye + axis * ((3.0 - eye[2]) / axis[2])

    assert 30.0 <= eye[2] - 3.0 <= 80.0
    assert hit[1] == pytest.approx(0.0, abs=0.01)
    assert abs(hit[0]) <= 110.01


def test_a_perfect_gimbal_holds_the_horizon_and_a_free_one_banks() -> None:
    """The image's rows are level, whatever the airframe does."""
    fields = {"bank_deg": 12.0, "swing_deg": 10.0, "pitch_deg": -50.0, "speed_m_s": 9.0}
    for pose in poses(flown(residual=0.0, **fields), "drone_gimbal", TIMES_S):
        assert pose.rotation()[2, 1] == pytest.approx(0.0, abs=1e-5)
        assert math.degrees(math.asin(pose.rotation()[2, 0])) == pytest.approx(-50.0, abs=0.01)
    free = flown(residual=1.0, **fields)
    banks = [math.asin(-p.rotation()[2, 1]) for p in poses(free, "drone_gimbal", TIMES_S)]
    assert math.degrees(max(banks)) > 5.0


def test_the_airframe_leans_forward_with_speed_and_carries_the_gimbal() -> None:
    """By the stated angle; both keep the template's distance."""
    scene = flown(speed_m_s=10.0, bank_deg=0.0, swing_deg=0.0)
    airframe, gimbal = (scene.body(name).T_world_body for name in ("drone", "drone_gimbal"))

    assert math.asin(-airframe.rotation()[2, 0]) == pytest.approx(10.0 * LEAN_PER_M_S, abs=1e-5)
    assert math.dist(airframe.translation_m, gimbal.translation_m) == pytest.approx(0.1, abs=1e-5)


def test_flights_cover_the_sequence_and_the_exposures_around_it() -> None:
    scene = flown(duration_s=4.0)
    for track in scene.tracks:
        assert track.start_s == -1.0
        assert track.end_s >= 5.0 - 1e-9
    assert DroneFlight(name="flight", duration_s=4.0).motion_duration_s == 4.0


@pytest.mark.parametrize(("given", "error", "message"), [
    ({"scene": replace(SCENE, rigs=())}, ConfigError, "no drone 'drone'; there is none: list an"),
    ({"roads": ("side",)}, ConfigError, "no driving lane on side; there is main"),
    ({"from_end_m": 201.0}, LayoutRejected, None),
], ids=["a template without a drone", "no such road", "roads that are too short"])  # fmt: skip
def test_what_is_missing_is_named(given: dict[str, Any], error: Any, message: str | None) -> None:
    with pytest.raises(error, match=message):
        flown(**given)


@pytest.mark.slow
def test_the_shipped_drone_looks_down_at_a_street_from_its_height() -> None:
    """The camera is the gimbal's, 30 to 80 m up, and nothing of the drone is in its image."""
    small = ("sensors[0].size_px=[160, 90]", "exporters=[]", "annotations=[]")
    behind = ("lot_lines", "yards", "back_plants")
    with open_pipeline(thin_street("drone", *small, without=behind), frozenset()) as made:
        sample = made.sample(0)
    reading = sample.capture.readings["camera"]
    (depth,) = (image for channel, image in reading.channels.items() if channel.value == "depth")

    assert 25.0 < reading.camera.T_world_camera.translation_m[2] < 85.0
    assert float(np.min(depth)) > 5.0
    assert reading.camera.shutter.rolls
