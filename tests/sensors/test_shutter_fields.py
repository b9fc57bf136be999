"""From ``exposure`` and ``rolling_shutter`` in YAML to a camera's shutter."""

from typing import Any

import pytest

from gen_data.core.scene import Scene
from gen_data.core.shutter import INSTANT, Shutter
from gen_data.sensors.camera.rgb_camera import RgbCamera


def shutter(**fields: Any) -> Shutter:
    return RgbCamera.model_validate(fields).mount(Scene("t")).cameras[0].shutter


def test_a_camera_sees_an_instant_unless_an_exposure_or_a_readout_takes_time() -> None:
    """From the first light on any row to the last."""
    assert shutter() == INSTANT
    assert INSTANT.open_s == 0.0
    assert shutter(exposure={"time_s": 0.01}) == Shutter(0.01, 0.0, 8)
    assert shutter(exposure={"time_s": 0.01, "samples": 32}) == Shutter(0.01, 0.0, 32)

    both = shutter(exposure={"time_s": 0.01}, rolling_shutter={"readout_s": 0.03})

    assert both.open_s == pytest.approx(0.04)
    assert both.rolls


@pytest.mark.parametrize(("direction", "sign"), [("down", 1.0), ("up", -1.0)])
def test_rows_are_read_in_a_direction(direction: str, sign: float) -> None:
    """Upwards, the lower rows come first: their delay is negative."""
    rolling = shutter(rolling_shutter={"readout_s": 0.02, "direction": direction})

    assert rolling.delay_s(100.0, 100) == pytest.approx(0.01 * sign)
    assert rolling.delay_s(50.0, 100) == 0.0
    assert rolling.row_delays_s(2).tolist() == pytest.approx([-0.005 * sign, 0.005 * sign])
