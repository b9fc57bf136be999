"""What a user may write under ``physics:``."""

from __future__ import annotations

import subprocess
import sys

import pytest
from pydantic import ValidationError

from gen_data.generator.physics import PhysicsConfig


@pytest.mark.parametrize(
    "wrong",
    [
        {"settle_time_s_max": -1.0},
        {"time_step_s": 0.1},
        {"guard_walls": "yes"},
        {"gravity_m_s2": 3.7},
        {"layout_attempts_max": 0},
    ],
)
def test_nonsense_is_refused(wrong: dict[str, object]) -> None:
    """Negative times, coarse steps, words for booleans, unknown keys, no attempt at all."""
    with pytest.raises(ValidationError):
        PhysicsConfig(**wrong)


def test_every_field_says_what_it_means() -> None:
    """The schema and the command line show these sentences."""
    assert all(field.description for field in PhysicsConfig.model_fields.values())


def test_reading_a_configuration_loads_no_engine() -> None:
    """The command line starts without pybullet."""
    code = "import sys, gen_data.generator.physics; sys.exit('pybullet' in sys.modules)"

    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
