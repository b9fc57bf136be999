"""Sensors on rigs: where they are, when they read, and their refusals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gen_data.assets.library import open_library
from gen_data.core.capture import POINT, PointCloud, SensorReading
from gen_data.core.errors import ConfigError, ConfigWarning
from gen_data.core.interfaces import DatasetInfo, Modality, SensorInfo
from gen_data.core.motion import StateChange, Trajectory
from gen_data.core.sample import EgoTruth, ImageTruth, Sample
from gen_data.core.scene import Body, Lane, Rig, Scene
from gen_data.core.scene_time import place_sensors, scene_at
from gen_data.core.se3 import SE3
from gen_data.pipeline import Pipeline
from gen_data.pipeline.finalize_scene import Timeline
from gen_data.pipeline.pipeline import PipelineConfig
from gen_data.randomizers.camera_on_lane import CameraOnLane
from gen_data.randomizers.camera_pose import CameraPose
from gen_data.scene_templates.robot import Robot
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.lidar.lidar_sensor import LidarSensor
from gen_data.sensors.mounting import stride, warn_of_early_readings
from tests.pipeline.test_pipeline import AcceptingPhysics
from tests.randomizers.doubles import FakeAssets, rng_of

CAR = "car?seed=0"


def driven(*sensors: Any) -> Scene:
    """A car at (10, 5) that faces +Y and drives 4 m/s; its rig is 1 m behind the middle."""
    start = SE3.about_z(0.5 * math.pi, (10.0, 5.0, 0.0))
    way = tuple(start @ SE3((0.4 * k, 0.0, 0.0)) for k in range(-5, 15))
    scene = Scene(
        "drive",
        bodies=(Body("ego", CAR, start, collides=False),),
        rigs=(Rig("ego", "ego", SE3((-1.0, 0.0, 0.0))),),
        tracks=(Trajectory("ego", 0.1, way, -0.5),),
    )
    for sensor in sensors:
        scene = sensor.mount(scene)
    return place_sensors(scene)


def test_a_camera_is_where_its_rig_carries_it() -> None:
    """2 m ahead, 0.5 m left, 1.8 m up on a rig at (10, 4) that faces +Y; it looks to its left."""
    camera = RgbCamera(name="side", rig="ego", offset_m=(2.0, 0.5, 1.8), yaw_deg=90.0)
    scene = driven(camera)

    for time_s, y in ((0.0, 4.0), (0.5, 6.0)):
        pose = scene_at(scene, time_s).camera("side").T_world_camera
        assert pose.translation_m == pytest.approx((9.5, y + 2.0, 1.8), abs=1e-5)
        np.testing.assert_allclose(pose.rotation()[:, 2], [-1.0, 0.0, 0.0], atol=1e-6)
        np.testing.assert_allclose(pose.rotation()[:, 1], [0.0, 0.0, -1.0], atol=1e-6)


def test_turns_are_left_then_up_then_clockwise() -> None:
    """Yaw 30, pitch 20, roll 10 degrees, against rotation matrices multiplied by hand."""
    sensor = LidarSensor(rig="ego", yaw_deg=30.0, pitch_deg=20.0, roll_deg=10.0)
    y, p, r = (math.radians(v) for v in (30.0, -20.0, 10.0))
    about_z = [[math.cos(y), -math.sin(y), 0], [math.sin(y), math.cos(y), 0], [0, 0, 1]]
    about_y = [[math.cos(p), 0, math.sin(p)], [0, 1, 0], [-math.sin(p), 0, math.cos(p)]]
    about_x = [[1, 0, 0], [0, math.cos(r), -math.sin(r)], [0, math.sin(r), math.cos(r)]]

    expected = np.array(about_z) @ np.array(about_y) @ np.array(about_x)
    np.testing.assert_allclose(sensor.T_rig_sensor.rotation(), expected, atol=1e-7)


def test_a_rate_that_does_not_fit_the_step_is_refused() -> None:
    """12 Hz in steps of 0.1 s; and one faster than the steps; with a rate that fits."""
    assert (stride("cam", 5.0, 0.1), stride("cam", None, 0.1)) == (2, 1)
    with pytest.raises(ConfigError, match=r"'cam': rate_hz 12 does not fit .* such as 10 Hz"):
        stride("cam", 12.0, 0.1)
    with pytest.raises(ConfigError, match=r"rate_hz 4 does not fit .* such as 5 Hz"):
        stride("cam", 4.0, 0.1)


@pytest.mark.parametrize("randomizer", [CameraPose(name="p"), CameraOnLane(name="l")])
def test_randomizers_of_poses_leave_cameras_on_rigs_alone(randomizer: Any) -> None:
    """They follow their rigs; those without one are moved."""
    lane = Lane("lane", "driving", ((-90.0, 40.0, 0.0), (90.0, 40.0, 0.0)), 3.5)
    scene = replace(
        driven(RgbCamera(name="front", rig="ego"), RgbCamera(name="free")),
        bodies=(Body("ego", "brick"),),
        lanes=(lane,),
    )

    moved = randomizer(scene, FakeAssets(), rng_of("poses"))

    assert moved.camera("front") == scene.camera("front")
    assert moved.camera("free") != scene.camera("free")


def test_a_randomizer_of_poses_does_not_know_a_camera_on_a_rig() -> None:
    """Asked for by name, it lists cameras that it could move."""
    scene = driven(RgbCamera(name="front", rig="ego"), RgbCamera(name="free"))

    with pytest.raises(ConfigError, match=r"no camera 'front' without a rig; expected .*free"):
        CameraPose(name="p", camera="front")(scene, FakeAssets(), rng_of("poses"))


class Watching:
    """A sensor that returns where it was, by the scene it was handed."""

    def __init__(self, name: str, lidar: bool = False) -> None:
        self.name, self.lidar = name, lidar

    def capture(self, scene: Scene, *_: Any) -> SensorReading | PointCloud:
        if self.lidar:
            return PointCloud(self.name, scene.lidar(self.name), np.zeros(0, POINT), scene.time_s)
        return SensorReading(self.name, scene.camera(self.name), {}, time_s=scene.time_s)


def sampled(
    index: int, offsets_s: Mapping[str, float] = {}, **recipe: Any
) -> tuple[Sample, dict[str, float], dict[str, float]]:
    """The reading of a camera and a scanner, and the times that truth was asked for."""
    annotated: dict[str, float] = {}
    swept: dict[str, float] = {}

    def image_truth(scene: Scene, reading: SensorReading) -> ImageTruth:
        annotated[reading.sensor] = scene.time_s
        return ImageTruth(reading.camera, ())

    def frame_truth(scenes: Any, capture: Any) -> EgoTruth:
        swept.update({name: scene.time_s for name, scene in scenes.items()})
        return EgoTruth()

    scene = driven(
        RgbCamera(name="early", rig="ego"),
        RgbCamera(name="late", rig="ego"),
        LidarSensor(name="top", rig="ego"),
    )
    infos = tuple(
        SensorInfo(name, modality, time_offset_s=offsets_s.get(name, 0.0))
        for name, modality in (
            ("early", Modality.CAMERA),
            ("late", Modality.CAMERA),
            ("top", Modality.LIDAR),
        )
    )
    watching = (Watching("early"), Watching("late"), Watching("top", lidar=True))
    made = PipelineConfig(
        open_scene=lambda streams: (scene, (), watching),  # type: ignore[arg-type]
        channels=frozenset(),
        image_truth=image_truth,
        frame_truth=frame_truth,
        split_shares={"train": 1.0},
        layout_attempts_max=1,
        info=DatasetInfo("t", 1, 9, 1, (), infos, steps_per_scene=4),
        exporters={},
        **recipe,
    )
    pipeline = Pipeline(made, open_library(()), AcceptingPhysics, lambda: None)  # type: ignore[arg-type]
    with pipeline:
        return pipeline.sample(index), annotated, swept


def test_sensors_read_at_their_own_offsets_and_labels_are_of_then() -> None:
    """At step 2 (0.2 s): one camera 0.05 s earlier, the scanner 0.025 s later; 4 m/s along +Y."""
    sample, annotated, swept = sampled(2, offsets_s={"early": -0.05, "top": 0.025})
    capture = sample.capture

    instants_s = {name: scene.time_s for name, scene in sample.instants.items()}
    assert instants_s == pytest.approx({"early": 0.15, "top": 0.225})
    assert sample.scene_of("top").body("ego").T_world_body.translation_m[1] == pytest.approx(5.9)
    assert sample.scene_of("late") is sample.scene
    assert annotated == pytest.approx({"early": 0.15, "late": 0.2})
    assert swept == pytest.approx({"": 0.2, "top": 0.225})
    assert capture.readings["early"].time_s == pytest.approx(0.15)
    assert capture.clouds["top"].time_s == pytest.approx(0.225)
    y = {
        "early": capture.readings["early"].camera.T_world_camera.translation_m[1],
        "late": capture.readings["late"].camera.T_world_camera.translation_m[1],
        "top": capture.clouds["top"].lidar.T_world_lidar.translation_m[1],
    }
    assert y == pytest.approx({"early": 4.6, "late": 4.8, "top": 4.9}, abs=1e-5)


def test_a_sensor_that_reads_early_sees_what_has_not_changed_yet_in_any_order() -> None:
    """A lamp lights at 0.18 s; at step 2 (0.2 s) a camera reads 0.05 s earlier, another at once."""
    lamp, lit = Body("lamp", "unlit"), StateChange(0.18, "lamp", asset="lit")
    view = replace(driven(), bodies=(*driven().bodies, lamp), changes=(lit,), instances=())
    timeline = Timeline(view, open_library(()), {})
    assets = [timeline.at(time_s).body("lamp").asset for time_s in (0.2, 0.2 - 0.05, 0.2)]

    assert assets == ["lit", "unlit", "lit"]

    one, other = (Timeline(driven(), open_library(()), {}) for _ in range(2))
    for time_s in (0.1, 0.35, 0.05):
        one.at(time_s)

    assert one.at(0.2) == other.at(0.2)


def test_slower_sensors_are_missing_from_the_steps_between() -> None:
    """The scanner reads at every second step, the late camera at every third."""
    strides = {"top": 2, "late": 3}
    present = [
        sorted([*sample.capture.readings, *sample.capture.clouds])
        for sample, _, _ in (sampled(index, strides=strides) for index in range(4))
    ]

    assert present == [["early", "late", "top"], ["early"], ["early", "top"], ["early", "late"]]


@pytest.mark.parametrize("robot", ["franka_panda", "xarm6", "kuka_iiwa"])
def test_a_rig_on_a_wrist_looks_out_of_the_hand(robot: str) -> None:
    """Its X axis is the grasp frame's Z; where there is no gripper, the last link's."""
    library = open_library(())
    scene = Robot(name="arm", asset=robot).add(Scene("t"), library)
    model = library.robot(robot)
    (rig,) = scene.rigs
    pose = scene.rig_pose("arm_wrist")

    assert rig.body in {body.name for body in scene.bodies}
    if model.gripper is not None:
        assert rig.body == f"arm/{model.gripper.link}"
        hand = scene.body(rig.body).T_world_body
        out = (hand @ model.gripper.T_link_grasp).rotation()
        np.testing.assert_allclose(pose.rotation()[:, 0], out[:, 2], atol=1e-6)
        np.testing.assert_allclose(pose.rotation()[:, 1], out[:, 1], atol=1e-6)
        np.testing.assert_allclose(pose.translation_m, hand.translation_m, atol=1e-6)
    else:
        last = scene.bodies[-1].T_world_body.rotation()
        np.testing.assert_allclose(pose.rotation()[:, 0], last[:, 2], atol=1e-6)


def test_a_wrist_camera_follows_the_arm() -> None:
    """It moves with the body that carries it."""
    library = open_library(())
    scene = Robot(name="arm").add(Scene("t"), library)
    scene = RgbCamera(name="eye", rig="arm_wrist", offset_m=(0.0, 0.0, 0.07)).mount(scene)
    before = place_sensors(scene).camera("eye").T_world_camera
    hand = scene.body("arm/panda_hand")
    lifted = replace(hand, T_world_body=SE3((0.0, 0.0, 0.1)) @ hand.T_world_body)

    after = place_sensors(scene.with_bodies(lifted)).camera("eye").T_world_camera

    assert np.subtract(after.translation_m, before.translation_m) == pytest.approx(
        (0.0, 0.0, 0.1), abs=1e-6
    )


def test_sensors_that_read_before_anything_moves_are_named(recwarn: Any) -> None:
    """Velocities of moving bodies would be 0 in the first image of each sequence."""
    early, late = RgbCamera(name="early", time_offset_s=-0.02), RgbCamera(time_offset_s=0.02)

    warn_of_early_readings([late], 4)
    warn_of_early_readings([early], 1)
    assert not recwarn
    with pytest.warns(ConfigWarning, match=r"early: .*add 0\.02 to time_offset_s of every sensor"):
        warn_of_early_readings([late, early], 4)
