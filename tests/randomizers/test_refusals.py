"""Values that no randomizer can have are refused when they are read."""

import json
from typing import Any

import pytest
from pydantic import ValidationError

from gen_data.randomizers import TABLE

PREETHAM = {"sky": "preetham"}
ROWS: list[tuple[str, dict[str, Any], str]] = [
    ("arm_configuration", {"mode": "reech"}, "there is no 'reech'.*did you mean 'reach'"),
    ("camera_intrinsics", {"principal_offset_px": [1.0]}, "principal_offset_px"),
    ("camera_intrinsics", {"principal_offset_px": [1.0, 2.0, 3.0]}, "principal_offset_px"),
    ("camera_intrinsics", {"principal_offset_px": "wide"}, "principal_offset_px"),
    ("camera_intrinsics", {"principal_offset_px": [1.0, "a"]}, "principal_offset_px"),
    ("camera_pose", {"fills": 0.2, "distance_m": 1.0}, "distance_m: excludes fills"),
    ("camera_pose", {"fills": 0.2, "jitter_m": 0.1}, "excludes fills; expected off_center"),
    ("camera_pose", {"off_center": 0.2}, "off_center: needs fills"),
    ("camera_pose", {"fills": 0.0}, "0 is not in"),
    ("camera_pose", {"fills": {"normal": {"mean": 0.2, "stddev": 0.1}}}, "add a clip"),
    ("ceiling_lights", {"kind": "dsik"}, "there is no 'dsik'.*did you mean 'disk'"),
    *(
        (kind, wrong, "every value must be in|is not in")
        for kind in ("objects", "distractors")
        for wrong in (
            {"count": 1_000_000_000},
            {"count": {"uniform_integer": [1, 501]}},
            {"scale": 0.00004},
        )
    ),
    ("lane_objects", {"gap_m": 0.0, "scale": 1e-9}, "scale"),
    ("lane_objects", {"gap_m": 0.0, "scale": 4e-5}, "scale"),
    ("lane_objects", {"count": 1_000_000_000}, "count"),
    ("lane_objects", {"min_count": 1_000_000_000}, "min_count"),
    ("lighting", {"illuminance_lux": -1.0}, "illuminance_lux"),
    ("lighting", {"illuminance_lux": float("nan")}, "finite"),
    ("lighting", {"kind": "spehre"}, "there is no 'spehre'.*did you mean 'sphere'"),
    ("lighting", {"width_m": 0.0}, "width_m"),
    ("lighting", {"panel_aspect": 0.0}, "panel_aspect must be above 0"),
    ("lighting", {"panel_aspect": 1.5}, "panel_aspect"),
    ("lighting", {"radius_m": -0.1}, "radius_m"),
    ("lighting", {"temperature_k": 100.0}, "1667"),
    ("lighting", {"luminous_flux_lm": -5.0}, "luminous_flux_lm"),
    ("lighting", {"luminous_flux_lm": 5.0, "illuminance_lux": 5.0}, "exclude each other"),
    ("time_of_day", PREETHAM | {"cloudiness": 0.2}, "has no clouds"),
    ("time_of_day", PREETHAM | {"sun_altitude_deg": {"uniform": [-5, 30]}}, "has no night"),
    ("time_of_day", PREETHAM | {"turbidity": 1.0}, "1.8"),
    ("time_of_day", PREETHAM | {"turbidity": float("nan")}, "finite"),
    ("traffic_lights", {"state": "gren"}, "there is no 'gren'.*did you mean 'green'"),
    ("vehicle_paint", {"weights": {"pink": 1.0}}, "unknown colour 'pink'; expected white, black"),
    ("weather", {"preset": "ClearNon"}, "did you mean 'ClearNoon'"),
    ("weather", {"preset": {"choice": {"WetNoon": 1, "ClearNon": 2}}}, "did you mean 'ClearNoon'"),
]


@pytest.mark.parametrize(("kind", "wrong", "why"), ROWS)
def test_the_message_states_the_fault(kind: str, wrong: dict[str, Any], why: str) -> None:
    text = json.dumps({"type": kind, "name": "it", **wrong})
    with pytest.raises(ValidationError, match=why):
        TABLE.load(kind).model_validate_json(text)
