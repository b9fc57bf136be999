"""Devices on a rig in the samples of a sequence: rates, steps made alone, bytes."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import pipeline_config
from gen_data.assets.library import open_library
from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.se3 import SE3
from gen_data.core.streams import Streams
from gen_data.pipeline import Pipeline
from gen_data.pipeline.delivered import DeliveredExporter
from gen_data.pipeline.pipeline import PipelineConfig
from gen_data.sensors.events.event_detector import EventDetector
from gen_data.sensors.mounting import Instrument
from gen_data.sensors.navigation.gnss import Gnss
from gen_data.sensors.navigation.imu import Imu
from gen_data.sensors.navigation.odometer import Odometer
from gen_data.sensors.radar.radar_sensor import Radar
from tests.pipeline.test_pipeline import AcceptingPhysics, TwoBoxes
from tests.sensors.streetcar import CAR_M, BoxRays, thing, world

SENSORS: tuple[Instrument, ...] = (
    Imu(), Gnss(rate_hz=5.0), Odometer(), Radar(offset_m=(2.2, 0.0, 0.5)), EventDetector(),
)  # fmt: skip
STEPS = 4


class Cars(TwoBoxes):
    def bounds_m(self, asset_id: str) -> Any:
        return CAR_M


def pipeline(seed: int = 3, sensors: tuple[Instrument, ...] = SENSORS) -> Pipeline:
    """Two views of an ego car behind a parked one, four steps each."""
    scene = world(others=[thing(2, "parked", "car", SE3((15.0, 0.0, 0.0)))])
    for sensor in sensors:
        scene = sensor.mount(scene)
    recipe = PipelineConfig(
        open_scene=lambda streams: (scene, (), sensors),
        channels=frozenset({Channel.INSTANCE}),
        image_truth=lambda scene, reading: None,  # type: ignore[arg-type, return-value]
        split_shares={"train": 1.0},
        layout_attempts_max=1,
        info=DatasetInfo(
            "test",
            seed,
            8,
            2,
            ("car",),
            tuple(s.describe() for s in sensors),
            steps_per_scene=STEPS,
        ),
        exporters={},
        strides={"gnss": 2},
    )
    return Pipeline(recipe, Cars(), AcceptingPhysics, BoxRays)  # type: ignore[arg-type]


def test_every_device_reports_at_its_rate() -> None:
    """The receiver at every second step, the inertial unit ten times in each."""
    with pipeline() as made:
        tables = [made.sample(k).capture.tables for k in range(STEPS)]

    assert ["gnss" in t for t in tables] == [True, False, True, False]
    assert [len(t["imu"].rows) for t in tables] == [1, 10, 10, 10]
    assert all(2 in t["radar"].rows["instance_id"] for t in tables)
    gap_m = [float(t["watcher"].rows["value"].min()) for t in tables]
    assert gap_m == pytest.approx([15.0 - 4.4 - k for k in range(STEPS)], abs=1e-4)


def with_faults(**faults: Any) -> tuple[Instrument, ...]:
    plain = [s.model_dump(mode="json", exclude_unset=True) | {"faults": faults} for s in SENSORS]
    return tuple(
        type(s).model_validate_json(json.dumps(p)) for s, p in zip(SENSORS, plain, strict=True)
    )


def test_a_wrong_calibration_is_one_through_a_sequence_and_no_reading_differs() -> None:
    wrong = with_faults(extrinsics={"rotation_deg": 1, "translation_m": {"uniform": [0, 0.1]}})
    with pipeline() as made, pipeline(sensors=wrong) as found:
        pairs = [(made.sample(k), found.sample(k)) for k in (0, STEPS - 1, STEPS)]
    errors = [
        {device.name: device.T_sensor_reported for device in sample.scene.devices}
        for _, sample in pairs
    ]
    assert errors[0] == errors[1]
    assert len(set(errors[0].values())) == len(SENSORS)
    assert not set(errors[0].values()) & {*errors[2].values(), None}
    for true, sample in pairs:
        devices = tuple(replace(d, T_sensor_reported=None) for d in sample.scene.devices)
        assert replace(sample.scene, devices=devices) == true.scene
        for name, table in true.capture.tables.items():
            assert sample.capture.tables[name].rows.tobytes() == table.rows.tobytes()


def test_formats_learn_which_faults_may_differ_from_0() -> None:
    faults = (
        "{clock: {jitter_s: 0.1}, extrinsics: {rotation_deg: {uniform: [0, 1]}}, "
        "delivery: {lost: 0.1, late_s: 0.1}}"
    )
    sensors = (
        f"sensors=[{{type: rgb_camera, faults: {faults}}}, "
        "{type: lidar, faults: {clock: {offset_s: 0}, extrinsics: {rotation_deg: 0}}}]"
    )
    spec = load_config("tabletop.yaml", overrides=(sensors, "exporters=[{type: coco}]"))
    info = pipeline_config(spec, open_library(()), 1, (), frozenset()).info
    assert {s.name: s.faults for s in info.sensors} == {
        "color": ("clock", "extrinsics", "lost"),
        "lidar": (),
    }


@pytest.mark.parametrize("view", ["", ", rectify: true"])
def test_exporters_have_readings_that_arrive_and_refuse_doubled_ones(view: str) -> None:
    def exporters(delivery: str) -> Any:
        sensors = f"sensors=[{{type: rgb_camera, faults: {{delivery: {delivery}}}}}]"
        formats = f"exporters=[{{type: coco{view}}}]"
        spec = load_config("tabletop.yaml", overrides=(sensors, formats))
        return pipeline_config(spec, open_library(()), 1, (), frozenset()).exporters

    assert isinstance(exporters("{lost: 0.1}")["coco"], DeliveredExporter)
    assert not isinstance(exporters("{lost: 0, late_s: 1}")["coco"], DeliveredExporter)
    with pytest.raises(ConfigError, match=r"exporters\[0\].*'color': faults\.delivery\.doubled: "):
        exporters("{doubled: 0.1}")


def test_wrong_clocks_reach_the_rows_and_nothing_else() -> None:
    """0.1 s and 1 % too late; noise and faults have their own streams."""
    late = with_faults(clock={"offset_s": 0.1, "drift_ppm": 10_000})
    with pipeline() as made, pipeline(sensors=late) as wrong:
        for k in range(STEPS):
            true, found = made.sample(k), wrong.sample(k)
            assert found.scene == true.scene
            for name, table in true.capture.tables.items():
                rows = found.capture.tables[name].rows.copy()
                assert rows["time_s"] == pytest.approx(1.01 * table.rows["time_s"] + 0.1, abs=1e-9)
                rows["time_s"] = table.rows["time_s"]
                assert rows.tobytes() == table.rows.tobytes()


def test_views_have_sequences_of_their_own() -> None:
    """The same way, another bias of the inertial unit."""
    with pipeline() as made:
        first, second = (made.sample(k).capture.tables["imu"].rows for k in (1, STEPS + 1))

    assert np.array_equal(first["time_s"], second["time_s"])
    assert not np.array_equal(first["rate_z_rad_s"], second["rate_z_rad_s"])


def test_streams_of_a_sequence_are_the_same_at_every_step() -> None:
    """And none of the streams of steps."""
    steps = [Streams(1, 2, view=0, step=k).rng("sensor/imu") for k in range(3)]
    shared = [rng.of_sequence().random() for rng in steps]

    assert len(set(shared)) == 1
    assert shared[0] not in [rng.random() for rng in steps]


def test_rates_reach_the_recipe() -> None:
    """A slow event camera reads at every fifth step."""
    sensors = "sensors=[{type: rgb_camera}, {type: event_camera, rate_hz: 2}]"
    spec = load_config("tabletop.yaml", overrides=(sensors, "exporters=[{type: tables}]"))
    recipe = pipeline_config(spec, open_library(()), 1, (), frozenset())

    assert recipe.strides["events"] == 5
    assert recipe.info.devices == {"events": "event_camera"}
