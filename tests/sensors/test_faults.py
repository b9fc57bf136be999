"""Faults of sensors: present as stated, with their truth, and nothing else changes."""

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.core.capture import Channel, LidarHits, Measurements, PointCloud, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.measurement_dtypes import table_rows
from gen_data.core.reported import arrived_s, copies, reported, reported_s
from gen_data.core.scene import Camera, Device, Lidar, Scene
from gen_data.core.se3 import SE3, look_at
from gen_data.core.serialization import canonical_json
from gen_data.core.streams import Streams
from gen_data.runner.labels import labels_line, parse_labels
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.lidar.lidar_faults import LidarFaults
from gen_data.sensors.navigation import gnss, imu
from gen_data.sensors.navigation.navigation_faults import GnssFaults, ImuFaults
from gen_data.sensors.sensor_faults import Clock, Delivery, deliver, with_calibrations

W, H = 64, 48
CAMERA = Camera("color", SE3(), Intrinsics(W, H, 50.0, 50.0, W / 2, H / 2), ev100=5.0)
SCENE = Scene("test", cameras=(CAMERA,))


class EvenLight:
    """A renderer of a scene with the same light [cd/m^2] everywhere."""

    def render(
        self, scene: Scene, camera: Camera, channels: frozenset[Channel], find_tones: Any = None
    ) -> SensorReading:
        radiance = np.full((H, W, 3), 2.0, np.float32)
        ids = np.full((H, W), 7, np.uint16)
        known = {Channel.RADIANCE: radiance, Channel.INSTANCE: ids}
        return SensorReading(camera.name, camera, {k: known[k] for k in channels})

    def scan(self, *_: Any) -> LidarHits:
        raise NotImplementedError


def stream(step: int = 0, seed: int = 5) -> Any:
    return Streams(seed=seed, scene=0, view=0, step=step).rng("sensor/color")


def photograph(faults: str | None, step: int = 0) -> SensorReading:
    text = f', "faults": {faults}' if faults else ""
    camera = RgbCamera.model_validate_json('{"channels": ["rgb", "instance"]' + text + "}")
    return camera.capture(SCENE, EvenLight(), frozenset(), stream(step))


def rgb(reading: SensorReading) -> NDArray[np.uint8]:
    return np.asarray(reading.channels[Channel.RGB])


CLEAN = photograph(None)
GREY = int(rgb(CLEAN)[0, 0, 0])


@pytest.mark.parametrize("faults", ["{}", '{"dead_pixels": 0, "dirt": 0, "dead_lines": 0}'])
def test_faults_of_size_0_change_no_byte(faults: str) -> None:
    found = photograph(faults)
    assert (rgb(found) == rgb(CLEAN)).all()
    assert found.faults == {}


def test_dead_pixels_and_lines_are_where_the_record_says_and_nowhere_else() -> None:
    found = photograph('{"dead_pixels": 0.01, "dead_lines": 3}')
    expected = np.full((H, W), GREY)
    for row, column, value in found.faults["dead_pixels"]:
        expected[row, column] = value
    expected[found.faults.get("dead_rows", [])] = 0
    expected[:, found.faults.get("dead_columns", [])] = 0
    assert len(found.faults["dead_pixels"]) == round(0.01 * H * W)
    assert len(found.faults.get("dead_rows", []) + found.faults.get("dead_columns", [])) == 3
    assert (rgb(found) == expected[..., None]).all()
    # Labels are as in the scene.
    assert (found.channels[Channel.INSTANCE] == 7).all()


def test_a_device_keeps_its_faults_through_a_sequence() -> None:
    faults = '{"dead_pixels": 0.005, "dead_lines": 2, "dirt": 0.2}'
    first, later = photograph(faults), photograph(faults, step=9)
    assert first.faults == later.faults
    other = RgbCamera.model_validate_json('{"channels": ["rgb"], "faults": ' + faults + "}")
    elsewhere = other.capture(SCENE, EvenLight(), frozenset(), stream(seed=6))
    assert elsewhere.faults != first.faults


def test_dirt_covers_its_share_and_darkens_even_light() -> None:
    """Half of each spot's radius is fully dirty, so at least half the share has less light."""
    found = photograph('{"dirt": 0.4}')
    spots = np.array(found.faults["dirt_spots"])
    rows, columns = np.mgrid[:H, :W] + 0.5
    far = np.hypot(columns[..., None] - spots[:, 0], rows[..., None] - spots[:, 1])
    behind = (far < spots[:, 2]).any(axis=-1)
    darker = rgb(found)[..., 0] < GREY
    assert (rgb(found)[~behind] == GREY).all()
    assert darker[(far < 0.5 * spots[:, 2]).any(axis=-1)].all()
    assert 0.2 < darker.mean() < 0.7


def test_overexposed_pictures_have_the_stops_of_their_record() -> None:
    """Against a camera that is set to so many stops more."""
    steps = [
        photograph('{"overexposed": {"probability": 0.5, "ev": 1.5}}', step=k) for k in range(40)
    ]
    failed = [found for found in steps if found.faults]
    assert 10 < len(failed) < 30
    brighter = RgbCamera.model_validate_json(
        '{"channels": ["rgb"], "image_pipeline": {"exposure_error_ev": 1.5}}'
    )
    expected = rgb(brighter.capture(SCENE, EvenLight(), frozenset(), stream()))
    for found in steps:
        assert found.faults in ({}, {"overexposed_ev": 1.5})
        assert (rgb(found) == (expected if found.faults else rgb(CLEAN))).all()


def cloud() -> PointCloud:
    """Points of four rings at each degree."""
    from gen_data.core.capture import POINT

    azimuth = np.radians(np.repeat(np.arange(-179.5, 180.0), 4))
    points: NDArray[Any] = np.zeros(len(azimuth), POINT)
    points["position_m"] = np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=1)
    points["ring"] = np.tile(np.arange(4), 360)
    return PointCloud("lidar", Lidar("lidar", ""), points)


def test_dead_beams_and_blocked_sectors_have_no_points_and_others_have_all() -> None:
    faults = LidarFaults.model_validate_json(
        '{"dead_beams": 1, "blocked": {"count": 2, "width_deg": 30}}'
    )
    found = faults.apply(cloud(), 4, stream())
    (dead,) = found.faults["dead_beams"]
    kept = cloud().points[cloud().points["ring"] != dead]
    for begin_deg, width_deg in found.faults["blocked_deg"]:
        assert width_deg == 30.0
        azimuth_deg = np.degrees(np.arctan2(kept["position_m"][:, 1], kept["position_m"][:, 0]))
        kept = kept[(azimuth_deg - begin_deg) % 360.0 >= width_deg]
    assert (found.points == kept).all()
    assert 300 * 3 <= len(kept) < 360 * 3
    nothing = LidarFaults().apply(cloud(), 4, stream())
    assert (nothing.points == cloud().points).all()
    assert nothing.faults == {}


TIMES_S = np.arange(0, 120.0, 0.5)


def table(columns: Any, **values: Any) -> Measurements:
    rows = table_rows(columns, len(TIMES_S), time_s=TIMES_S, **values)
    return Measurements("device", Device("device", "gnss", "ego"), rows)


def test_gnss_positions_jump_by_the_recorded_distance_and_back() -> None:
    """On a sphere of 6,371 km, 30 m are 30 / 111,195 degrees."""
    fixes = table(gnss.COLUMNS, latitude_deg=0.0 * TIMES_S, longitude_deg=0.0 * TIMES_S)
    text = '{"jumps": {"per_minute": 3, "distance_m": 30, "lasts_s": 4}}'
    found = GnssFaults.model_validate_json(text).apply(fixes, stream())
    assert 2 <= len(found.faults["jumps"]) <= 12
    inside = np.zeros(len(TIMES_S), bool)
    for begin_s, end_s, east_m, north_m in found.faults["jumps"]:
        assert math.hypot(east_m, north_m) == pytest.approx(30.0, abs=1e-4)
        assert end_s - begin_s == pytest.approx(4.0, abs=1e-5)
        inside |= (begin_s <= TIMES_S) & (end_s > TIMES_S)
    away_m = 111_195.0 * np.hypot(found.rows["latitude_deg"], found.rows["longitude_deg"])
    assert (away_m[~inside] == 0.0).all()
    alone = [k for k in np.flatnonzero(inside) if away_m[k] < 31.0]
    assert away_m[alone] == pytest.approx(30.0, abs=0.3)
    assert len(alone) >= 0.5 * inside.sum()


def test_imu_biases_step_and_stay() -> None:
    still = table(imu.COLUMNS)
    faults = ImuFaults.model_validate_json('{"bias_steps": {"per_minute": 2}}')
    found = faults.apply(still, imu.AXES, stream())
    record = np.array(found.faults["bias_steps"])
    assert 1 <= len(record) <= 10
    for k, axis in enumerate(imu.AXES):
        expected = sum((row[0] <= TIMES_S) * row[1 + k] for row in record)
        assert found.rows[axis] == pytest.approx(expected, abs=1e-9)
    # The first steps of a sequence do not depend on how long it is.
    half = replace(still, rows=still.rows[:120])
    early = faults.apply(half, imu.AXES, stream()).faults.get("bias_steps", [])
    assert early == [row for row in found.faults["bias_steps"] if row[0] <= TIMES_S[119]]


def clock(**fields: float) -> Clock:
    return Clock.model_validate_json(json.dumps(fields))


def test_a_drifting_clock_is_one_through_a_sequence_and_another_in_the_next() -> None:
    drawn = Clock.model_validate_json(
        '{"offset_s": {"uniform": [-1, 1]}, "drift_ppm": {"uniform": [-500, 500]}}'
    )

    def record(time_s: float, step: int, seed: int = 5) -> Any:
        return drawn.stamp(replace(CLEAN, time_s=time_s), stream(step, seed)).faults["clock"]

    first, later = record(0.0, 0), record(3.0, 7)
    assert first["reported_s"] == pytest.approx(first["offset_s"], abs=1e-9)
    assert {k: later[k] for k in ("offset_s", "drift_ppm")} == {
        k: first[k] for k in ("offset_s", "drift_ppm")
    }
    expected_s = 3.0 + later["offset_s"] + 3.0 * 1e-6 * later["drift_ppm"]
    assert later["reported_s"] == pytest.approx(expected_s, abs=1e-9)
    assert record(0.0, 0, seed=6)["offset_s"] != first["offset_s"]


def test_jitter_is_normal_and_of_each_stamp_and_the_record_has_the_truth() -> None:
    """Half a second between rows: errors of 10 ms never change their order."""
    readings = table(imu.COLUMNS)
    found = clock(jitter_s=0.01).stamp(readings, stream())
    error_s = found.rows["time_s"] - TIMES_S
    assert found.faults["clock"]["true_s"] == TIMES_S.tolist()
    assert len(np.unique(error_s)) == len(TIMES_S)
    assert abs(error_s.mean()) < 4 * 0.01 / math.sqrt(len(TIMES_S))
    assert error_s.std() == pytest.approx(0.01, rel=4 / math.sqrt(2 * len(TIMES_S)))
    assert (found.rows[list(imu.AXES)] == readings.rows[list(imu.AXES)]).all()


def test_stamps_of_one_reading_keep_their_order_and_equal_instants_stay_equal() -> None:
    times_s = np.repeat(np.arange(100) / 1000.0, 2)
    rows = table_rows(imu.COLUMNS, 200, time_s=times_s)
    readings = Measurements("device", Device("device", "imu", "ego"), rows)
    stamps_s = clock(jitter_s=0.01).stamp(readings, stream()).rows["time_s"]
    assert (np.diff(stamps_s) >= 0.0).all()
    assert (stamps_s[::2] == stamps_s[1::2]).all()


def calibrated(fields: str, view: int = 0) -> Scene:
    camera = RgbCamera.model_validate_json('{"faults": {"extrinsics": {' + fields + "}}}")
    pose = look_at((1.0, 2.0, 3.0), (4.0, 4.0, 2.0))
    scene = replace(SCENE, cameras=(replace(CAMERA, T_world_camera=pose),))
    return with_calibrations(scene, [camera], Streams(seed=5, scene=0, view=view))


def test_stated_poses_are_off_by_the_angle_and_the_distance_in_any_direction() -> None:
    """The angle of a rotation from its trace: 1 + 2 cos."""
    axes = []
    for view in range(60):
        (camera,) = calibrated('"rotation_deg": 1.5, "translation_m": 0.08', view).cameras
        error = camera.T_world_camera.inverse() @ reported(camera).T_world_camera
        turn = error.rotation()
        assert math.acos(0.5 * (np.trace(turn) - 1.0)) == pytest.approx(math.radians(1.5), rel=1e-4)
        assert math.hypot(*error.translation_m) == pytest.approx(0.08, abs=3e-6)
        axes.append(np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0]]))
        axes[-1] = np.append(axes[-1] / (2.0 * math.sin(math.radians(1.5))), error.translation_m[0])
    # Components of directions that are even on a sphere have a variance of a third.
    assert np.abs(np.mean(axes, axis=0) / (1.0, 1.0, 0.08)).max() < 4 * math.sqrt(1 / 3 / 60)


def test_errors_of_calibrations_of_size_0_leave_the_scene_and_its_bytes() -> None:
    plain = canonical_json(calibrated(""))
    assert "T_sensor_reported" not in plain
    assert canonical_json(calibrated('"rotation_deg": 0, "translation_m": 0.0')) == plain
    # A scene that is rendered again without the fault loses the error.
    wrong = calibrated('"rotation_deg": 1')
    assert canonical_json(with_calibrations(wrong, [RgbCamera()], Streams(5, 0, 0))) == plain


def test_readings_record_the_error_of_the_calibration() -> None:
    camera = RgbCamera.model_validate_json('{"faults": {"extrinsics": {"rotation_deg": 2}}}')
    (placed,) = calibrated('"rotation_deg": 2').cameras
    found = deliver(camera, replace(CLEAN, camera=placed), stream()).faults["extrinsics"]
    assert found["rotation_deg"] == pytest.approx(2.0, abs=1e-6)
    assert found["translation_m"] == 0.0
    stated = placed.T_world_camera.matrix() @ found["T_sensor_reported"]
    assert stated == pytest.approx(reported(placed).T_world_camera.matrix(), abs=2e-6)


def line(reading: Any, step: int = 0, **fields: Any) -> Any:
    delivery = Delivery.model_validate_json(json.dumps(fields))
    return delivery.draw(reading, stream(step)).of(reading)


def test_readings_are_lost_and_doubled_by_their_shares() -> None:
    """Standard deviations of shares of 400 readings."""
    found = [line(CLEAN, k, lost=0.3, doubled=0.5).faults.get("delivery", {}) for k in range(400)]
    lost, doubled = (np.array([f.get(name, False) for f in found]) for name in ("lost", "doubled"))
    assert not (lost & doubled).any()
    assert lost.mean() == pytest.approx(0.3, abs=4 * math.sqrt(0.3 * 0.7 / 400))
    assert doubled[~lost].mean() == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(280))
    assert [copies(line(CLEAN, k, lost=0.3, doubled=0.5)) for k in range(400)] == list(
        np.where(lost, 0, np.where(doubled, 2, 1))
    )


def test_late_readings_arrive_so_much_after_their_true_instant() -> None:
    late = line(replace(CLEAN, time_s=1.5), late_s=0.2)
    assert arrived_s(late) == pytest.approx(1.7, abs=1e-9)
    assert (late.time_s, reported_s(late)) == (1.5, 1.5)
    assert line(CLEAN, lost=0.0, doubled=0.0, late_s=0.0) is CLEAN


def test_rows_of_lost_instants_are_missing_and_of_doubled_ones_there_twice() -> None:
    """Two rows at each instant; a wrong clock stamps rows that arrive."""
    times_s = np.repeat(TIMES_S, 2)
    rows = table_rows(imu.COLUMNS, len(times_s), time_s=times_s, force_x_m_s2=np.arange(480.0))
    readings = Measurements("device", Device("device", "imu", "ego"), rows)
    fields = '{"clock": {"jitter_s": 0.001}, "delivery": {"lost": 0.25, "doubled": 0.25}}'
    sensor = imu.Imu.model_validate_json(f'{{"faults": {fields}}}')
    found = deliver(sensor, readings, stream())
    lost, doubled = (found.faults["delivery"][f"{name}_s"] for name in ("lost", "doubled"))
    assert not set(lost) & set(doubled)
    assert len(lost) / 240 == pytest.approx(0.25, abs=4 * math.sqrt(0.25 * 0.75 / 240))
    expected = [
        (time_s, k)
        for k, time_s in enumerate(times_s.tolist())
        if time_s not in lost
        for _ in range(2 if time_s in doubled else 1)
    ]
    assert found.faults["clock"]["true_s"] == [time_s for time_s, _ in expected]
    assert found.rows["force_x_m_s2"].tolist() == [k for _, k in expected]
    stamped = sensor.faults.clock.stamp(readings, stream()).rows["time_s"]
    stamps = dict(zip(times_s, stamped, strict=True))
    assert found.rows["time_s"].tolist() == [stamps[time_s] for time_s, _ in expected]


def test_labels_hold_the_truth_about_faults_and_are_as_before_without() -> None:
    from gen_data.core.capture import Capture
    from gen_data.core.sample import ImageTruth, Sample

    def line(reading: SensorReading) -> str:
        truth = {"color": ImageTruth(CAMERA, ())}
        return labels_line(Sample(0, 0, 0, "train", SCENE, Capture({"color": reading}), truth))

    found = photograph('{"dead_pixels": 0.002, "dirt": 0.1}')
    again = parse_labels(line(found)).images["color"]
    assert json.loads(json.dumps(again.faults)) == json.loads(json.dumps(found.faults))
    assert "faults" not in line(CLEAN)
