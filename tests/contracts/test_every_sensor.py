"""Contract of every sensor in the table, built-in or third-party."""

import json
import pickle
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from gen_data.core.capture import POINT, Channel, Measurements, PointCloud, SensorReading
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import Modality, Renderer
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.measurement_dtypes import TIME, columns_dtype
from gen_data.core.motion import Trajectory
from gen_data.core.reported import reported_s
from gen_data.core.scene import Body, Camera, Environment, Instance, Light, Rig, Scene
from gen_data.core.scene_time import add_twists, place_sensors, scene_at
from gen_data.core.se3 import SE3
from gen_data.core.serialization import canonical_json, from_plain
from gen_data.core.streams import Streams
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.sensors import TABLE
from gen_data.sensors.sensor_faults import deliver
from tests.renderers.fake_library import FakeLibrary, box_mesh, plane_mesh

GIVEN: dict[str, dict[str, Any]] = {
    "rgb_camera": {"size_px": [32, 24]}, "depth_camera": {"size_px": [32, 24]},
    "lidar": {"model": "VLP-16"}, "event_camera": {"size_px": [32, 24], "frames_per_step": 2},
}  # fmt: skip
"""Fields that make a sensor faster than by default."""

OFF_RIGS = ("plate_camera",)
"""Sensors whose place a photograph gives: tests/sensors/test_plate_camera.py."""

each = pytest.mark.parametrize("kind", [kind for kind in TABLE if kind not in OFF_RIGS])
device = pytest.mark.parametrize(
    "kind", [kind for kind in TABLE if TABLE.load(kind)().describe().modality is Modality.DEVICE]
)


@cache
def renderer() -> Renderer:
    meshes = {"box": box_mesh((4.0, 1.8, 1.0)), "ground": plane_mesh(300.0)}
    return WarpRenderer(FakeLibrary(meshes), "cpu")


@cache
def street() -> Scene:
    """A box with a rig that drives at 8 m/s, an oncoming box, and the ground."""
    poses = {
        "ego": tuple(SE3((0.8 * k, 0.0, 0.5)) for k in range(31)),
        "car": tuple(SE3((30.0 - 0.5 * k, 3.0, 0.5)) for k in range(31)),
    }
    boxes = [
        Body(name, "box", way[0], instance_id=k) for k, (name, way) in enumerate(poses.items(), 1)
    ]
    bounds = ((-2.0, -0.9, -0.5), (2.0, 0.9, 0.5))
    things = [
        Instance(k, b.name, "car", 1, b.asset, True, (), b.T_world_body, *bounds)
        for k, b in enumerate(boxes, 1)
    ]
    lens = Intrinsics.from_hfov(32, 24, 1.0)
    return add_twists(
        Scene(
            "test",
            bodies=(*boxes, Body("ground", "ground")),
            instances=tuple(things),
            cameras=(Camera("color", SE3(), lens, rig="ego"),),
            rigs=(Rig("ego", "ego", SE3((0.0, 0.0, 1.0))),),
            lights=(Light("sun", "sun", direction=(0.0, 0.6, -0.8), illuminance_lux=5e4),),
            environment=Environment(luminance_cd_m2=3000.0),
            tracks=tuple(Trajectory(name, 0.1, way) for name, way in poses.items()),
        )
    )


def made(kind: str, **fields: Any) -> Any:
    plain = {"type": kind, "name": "unit", "rig": "ego", **GIVEN.get(kind, {}), **fields}
    return TABLE.load(kind).model_validate_json(json.dumps(plain))


def seen(sensor: Any, step: int = 3, seed: int = 0) -> SensorReading | PointCloud | Measurements:
    scene = place_sensors(sensor.mount(street()))
    rng = Streams(seed, scene=0, view=0, step=step).rng("sensor/unit")
    channels = frozenset({Channel.INSTANCE})
    return sensor.capture(scene_at(scene, 0.1 * step), renderer(), channels, rng)


def data(returned: SensorReading | PointCloud | Measurements) -> bytes:
    if isinstance(returned, SensorReading):
        return b"".join(returned.channels[c].tobytes() for c in sorted(returned.channels))
    return (returned.rows if isinstance(returned, Measurements) else returned.points).tobytes()


@each
def test_mounting_adds_it_by_its_name_and_leaves_the_scene_alone(kind: str) -> None:
    """The new scene has it among cameras, lidars or devices; it survives serialisation."""
    before = canonical_json(street())
    scene = place_sensors(made(kind).mount(street()))

    assert canonical_json(street()) == before
    names = [s.name for s in (*scene.cameras, *scene.lidars, *scene.devices)]
    assert names.count("unit") == 1
    assert from_plain(Scene, json.loads(canonical_json(scene))) == scene


@each
def test_it_is_where_its_description_says(kind: str) -> None:
    """By its modality among cameras, lidars or devices; it returns what its modality names."""
    sensor = made(kind, rate_hz=10.0, time_offset_s=0.01)
    info, scene = sensor.describe(), sensor.mount(street())
    places = {
        Modality.CAMERA: (scene.cameras, SensorReading), Modality.LIDAR: (scene.lidars, PointCloud),
        Modality.DEVICE: (scene.devices, Measurements),
    }  # fmt: skip
    mounted, returned = places[info.modality]

    assert (info.name, info.rate_hz, info.time_offset_s) == ("unit", 10.0, 0.01)
    assert info.name in [other.name for other in mounted]
    assert isinstance(seen(made(kind)), returned)
    assert bool(info.channels) == (info.modality is Modality.CAMERA)
    assert bool(info.columns) == bool(info.kind) == (info.modality is Modality.DEVICE)


@each
def test_a_wrong_clock_changes_stamps_only(kind: str) -> None:
    """Half a second at time 0, and 1 % of the time since; errors of size 0 change nothing."""
    wrong = {"clock": {"offset_s": 0.5, "drift_ppm": 10_000}}
    clean, rng = seen(made(kind)), Streams(0, scene=0, view=0, step=3).rng("sensor/unit")
    late = deliver(made(kind, faults=wrong), seen(made(kind, faults=wrong)), rng)

    assert late.time_s == clean.time_s
    assert reported_s(late) == pytest.approx(1.01 * clean.time_s + 0.5, abs=1e-9)
    if isinstance(late, Measurements) and isinstance(clean, Measurements):
        stamps_s = 1.01 * clean.rows["time_s"] + 0.5
        assert late.rows["time_s"] == pytest.approx(stamps_s, abs=1e-9)
        late.rows["time_s"] = clean.rows["time_s"]
    assert data(late) == data(clean)
    none = made(kind, faults={"clock": {"offset_s": 0, "drift_ppm": 0, "jitter_s": 0}})
    same = deliver(none, seen(none), rng)
    assert (data(same), same.faults, reported_s(same)) == (data(clean), {}, clean.time_s)


@each
def test_an_unknown_rig_is_named_with_those_there_are(kind: str) -> None:
    """Before anything is made."""
    with pytest.raises(ConfigError, match=r"'unit': the scene has no rig 'eg'; its rigs: ego"):
        made(kind, rig="eg").mount(street())


@each
def test_it_moves_with_its_rig(kind: str) -> None:
    """0.8 m in 0.1 s."""
    scene = place_sensors(made(kind, offset_m=[0.5, 0.0, 0.2]).mount(street()))

    def place(s: Scene) -> np.ndarray:
        poses = [c.T_world_camera for c in s.cameras if c.name == "unit"]
        poses += [lidar.T_world_lidar for lidar in s.lidars]
        poses += [d.T_world_device for d in s.devices]
        return np.array(poses[0].translation_m)

    assert np.allclose(place(scene), [0.5, 0.0, 1.7], atol=1e-6)
    assert np.allclose(place(scene_at(scene, 0.1)), [1.3, 0.0, 1.7], atol=1e-6)


@each
def test_a_step_made_alone_has_the_same_bytes_in_any_process(kind: str) -> None:
    """Equal readings from a copy in another process, after another step."""
    sensor = made(kind)
    copy = pickle.loads(pickle.dumps(sensor))
    seen(copy, step=2)

    assert data(seen(copy)) == data(seen(sensor))


@device
def test_rows_are_of_the_type_that_is_documented(kind: str) -> None:
    """Every column has a meaning, and its unit at the end of its name."""
    returned = seen(made(kind))

    assert isinstance(returned, Measurements)
    columns = made(kind).describe().columns
    assert returned.rows.dtype == columns_dtype(columns)
    assert returned.device.name == "unit"
    assert returned.device.T_world_device.translation_m[0] == pytest.approx(2.4)
    assert returned.time_s == pytest.approx(0.3)
    assert columns[0] == TIME
    assert all(column.meaning for column in columns)


@device
def test_rows_lie_between_the_last_step_and_this_one(kind: str) -> None:
    for step in range(4):
        returned = seen(made(kind), step)
        assert isinstance(returned, Measurements)
        times_s = returned.rows["time_s"]
        assert (np.diff(times_s) >= 0.0).all()
        assert (times_s <= 0.1 * step + 1e-9).all()
        assert (times_s > 0.1 * (step - 1) - 1e-9).all()


@device
def test_a_rate_that_does_not_fit_is_told_with_one_that_does(kind: str) -> None:
    """Neither a whole number of readings per step nor of steps per reading."""
    scene = replace(street(), step_s=0.1)
    for rate_hz, remedy in ((23.0, "such as 20 Hz"), (4.0, "such as 5 Hz")):
        with pytest.raises(ConfigError, match=f"rate_hz {rate_hz:g} does not fit .*{remedy}"):
            made(kind, rate_hz=rate_hz).mount(scene)


def test_points_of_laser_scanners_are_of_the_type_that_is_documented() -> None:
    returned = seen(made("lidar"))

    assert isinstance(returned, PointCloud)
    assert returned.points.dtype == POINT
