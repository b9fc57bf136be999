"""Values that no sensor can have are refused when they are read."""

import json
from typing import Any

import pytest
from pydantic import ValidationError

from gen_data.sensors import TABLE

FOLDS = "folds over inside the image"
SMALL = {"size_px": [60, 40]}
ROWS: list[tuple[str, dict[str, Any], str]] = [
    ("depth_camera", {"model": "kinect_v3"}, "did you mean 'kinect_v"),
    ("depth_camera", {"channels": ["measured"]}, "channels"),
    ("depth_camera", {"model": {"range_m": [3, 1]}}, "range_m must rise"),
    ("depth_camera", {"model": {"principle": {"kind": "sonar"}}}, "sonar"),
    ("event_camera", {"threshold": 0.0}, "threshold"),
    ("event_camera", {"threshold_spread": -0.1}, "threshold_spread"),
    ("event_camera", {"leak_hz": -1.0}, "leak_hz"),
    ("event_camera", {"frames_per_step": 0}, "frames_per_step"),
    ("gnss", {"noise": -0.1}, "noise"),
    ("gnss", {"origin_deg": [91.0, 0.0]}, "origin_deg"),
    ("imu", {"noise": -1.0}, "noise"),
    ("imu", {"model": "RT3004"}, "model"),
    ("odometer", {"scale_error": -0.1}, "scale_error"),
    ("odometer", {"speed_noise_m_s": -0.1}, "speed_noise_m_s"),
    ("radar", {"noise": -1.0}, "noise"),
    ("radar", {"false_alarms": -1.0}, "false_alarms"),
    ("radar", {"model": "ARS408"}, "model"),
    ("radar", {"rate_hz": 0.0}, "rate_hz"),
    ("rgb_camera", {"channels": ["rgb", "infrared"]}, "channels"),
    ("rgb_camera", {"channels": []}, "channels"),
    ("rgb_camera", {"channels": ["amodal"]}, "channels"),
    ("rgb_camera", {"size_px": [640, 0]}, "size_px"),
    ("rgb_camera", {"channels": ["depth_layers"], "layers": 9}, "layers"),
    ("rgb_camera", {"channels": ["depth_layers"], "layers": 0}, "layers"),
    ("rgb_camera", {"channels": ["depth"], "layers": 2}, "no channel has any; add one of depth_l"),
    ("depth_camera", {"layers": 4}, "no channel has any; add one of depth_layers"),
    ("rgb_camera", {"hfov_deg": 180.0}, "hfov_deg"),
    ("rgb_camera", {"hfov_deg": 175}, "too wide for a pinhole"),
    ("rgb_camera", {"lens": {"model": "brown_conrady", "k1": -0.9}},
     # Slopes 1 + 3 k1 r^2 and 1 + 3 k1 t^2 are 0 at tan(31.324 degrees) and at 60.395 degrees.
     f"{FOLDS}.* with field_deg of at most 62.6"),
    ("rgb_camera", {"lens": {"model": "kannala_brandt", "k1": -0.3}, "hfov_deg": 100},
     f"{FOLDS}.* with field_deg of at most 120.7"),
    ("rgb_camera", {"lens": {"model": "brown_conrady"}, "hfov_deg": 190},
     "nothing at 95 degrees from its axis"),
    ("rgb_camera", {"lens": {"model": "kannala_brandt", "p1": 0.1}}, "p1"),
    ("rgb_camera", {"lens": {"model": "wide"}}, "model"),
    ("rgb_camera", {"image_pipeline": {"preset": "fone"}}, "phone.*did you mean 'phone'"),
    ("rgb_camera", {"image_pipeline": {"color_matrix": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}},
     "grey pixels grey"),
    ("rgb_camera", {"image_pipeline": {"exposure_control": {"time_s": [0.1, 0.01]}}},
     "time_s must rise"),
    ("rgb_camera", {"image_pipeline": {"vignetting": 1.5}}, "1.5"),
    ("plate_camera", {"image_pipeline": {"jpeg_quality": 90}}, "photograph was developed before"),
    *(("plate_camera", {field: value}, f"{field}: the photograph gives it") for field, value in
      {"hfov_deg": 70.0, "rig": "ego", "lens": {"model": "pinhole"}, "yaw_deg": 3.0}.items()),
    ("rgb_camera", {"hfov_deg": "60"}, "hfov_deg"),
    ("rgb_camera", {"shutter": 0.01}, "shutter"),
    ("rgb_camera", {"exposure": {"time_s": 0.0}}, "exposure"),
    ("rgb_camera", {"exposure": {"time_s": 0.01, "samples": 0}}, "exposure"),
    ("rgb_camera", {"exposure": {"samples": 4}}, "exposure"),
    ("rgb_camera", {"rolling_shutter": {"readout_s": -0.01}}, "rolling_shutter"),
    ("rgb_camera", {"rolling_shutter": {"readout_s": 0.01, "direction": "left"}}, "direction"),
    ("watcher", {"events": ["crash"]}, "events"),
    *(("lidar", {"window": share}, "window") for share in (0.0, 1.1, -0.5)),
    # Distributions count by their largest value; an HDL-64E has 64 lasers.
    ("rgb_camera", SMALL | {"faults": {"dead_lines": {"uniform_integer": [0, 101]}}},
     "dead_lines: 101 is more than the 100 rows and columns"),
    ("lidar", {"faults": {"dead_beams": 65}}, "65 is more than the 64 beams of the sensor"),
    ("imu", {"faults": {"dead_pixels": 0.1}}, "dead_pixels"),
    ("depth_camera", {"faults": {"dead_pixels": 0.1}}, "dead_pixels"),
    ("radar", {"faults": {"clock": {"offset_s": 61}}}, "offset_s"),
    ("gnss", {"faults": {"clock": {"jitter_s": -0.1}}}, "jitter_s"),
    ("radar", {"faults": {"delivery": {"lost": 1.1}}}, "lost"),
    ("lidar", {"faults": {"extrinsics": {"rotation_deg": -1}}}, "rotation_deg"),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "wrong", "why"), ROWS)
def test_the_message_names_the_field(kind: str, wrong: dict[str, Any], why: str) -> None:
    with pytest.raises(ValidationError, match=why):
        read(kind, **wrong)


def read(kind: str, **fields: Any) -> Any:
    return TABLE.load(kind).model_validate_json(json.dumps({"type": kind, **fields}))


def test_as_many_faults_as_a_sensor_has_parts_and_a_developed_photograph_are_accepted() -> None:
    read("rgb_camera", **SMALL, faults={"dead_lines": {"uniform_integer": [0, 100]}})
    read("lidar", faults={"dead_beams": 64})
    assert read("plate_camera", image_pipeline={"preset": "photograph", "jpeg_quality": 90})
