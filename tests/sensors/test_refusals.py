"""Values that no sensor can have are refused when they are read."""

import json
from typing import Any

import pytest
from pydantic import ValidationError

from gen_data.sensors import TABLE

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
    ("rgb_camera", {"hfov_deg": "60"}, "hfov_deg"),
    ("rgb_camera", {"shutter": 0.01}, "shutter"),
    ("rgb_camera", {"exposure": {"time_s": 0.0}}, "exposure"),
    ("rgb_camera", {"exposure": {"time_s": 0.01, "samples": 0}}, "exposure"),
    ("rgb_camera", {"exposure": {"samples": 4}}, "exposure"),
    ("rgb_camera", {"rolling_shutter": {"readout_s": -0.01}}, "rolling_shutter"),
    ("rgb_camera", {"rolling_shutter": {"readout_s": 0.01, "direction": "left"}}, "direction"),
    ("watcher", {"events": ["crash"]}, "events"),
    ("imu", {"faults": {"dead_pixels": 0.1}}, "dead_pixels"),
    ("depth_camera", {"faults": {"dead_pixels": 0.1}}, "dead_pixels"),
    ("radar", {"faults": {"clock": {"offset_s": 61}}}, "offset_s"),
    ("gnss", {"faults": {"clock": {"jitter_s": -0.1}}}, "jitter_s"),
    ("radar", {"faults": {"delivery": {"lost": 1.1}}}, "lost"),
    ("lidar", {"faults": {"extrinsics": {"rotation_deg": -1}}}, "rotation_deg"),
]


@pytest.mark.parametrize(("kind", "wrong", "why"), ROWS)
def test_the_message_names_the_field(kind: str, wrong: dict[str, Any], why: str) -> None:
    with pytest.raises(ValidationError, match=why):
        TABLE.load(kind).model_validate_json(json.dumps({"type": kind, **wrong}))
