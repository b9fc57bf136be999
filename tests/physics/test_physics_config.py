"""Values that a user may write under ``physics:``."""

import subprocess
import sys
from pathlib import Path

import pytest
from pydantic import ValidationError

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core.errors import ConfigError
from gen_data.physics import PhysicsConfig, open_engine
from gen_data.runner.identity import make_plan
from tests.physics.doubles import Solids


@pytest.mark.parametrize("wrong", [
    {"settle_time_s_max": -1.0}, {"time_step_s": 0.1}, {"guard_walls": "yes"},
    {"gravity_m_s2": 3.7}, {"layout_attempts_max": 0},
])  # fmt: skip
def test_nonsense_is_refused(wrong: dict[str, object]) -> None:
    """Negative times, coarse steps, words for booleans, unknown keys, no attempt at all."""
    with pytest.raises(ValidationError):
        PhysicsConfig(**wrong)


def test_every_field_says_what_it_means() -> None:
    """The schema and the command line show these sentences."""
    assert all(field.description for field in PhysicsConfig.model_fields.values())


def test_reading_a_configuration_loads_no_engine() -> None:
    """The command line starts without pybullet and MuJoCo."""
    code = "import sys, gen_data.physics\nsys.exit(bool({'pybullet', 'mujoco'} & {*sys.modules}))"

    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_default_engine_is_pybullet_where_it_is_installed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Elsewhere mujoco, which has wheels for every platform."""
    for installed, expected in (({"pybullet", "mujoco"}, "pybullet"), ({"mujoco"}, "mujoco")):
        monkeypatch.setattr("gen_data.physics.physics_config.is_installed", installed.__contains__)
        assert PhysicsConfig().engine == expected


def test_an_engine_that_is_not_installed_is_refused_with_both_remedies(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The other engine, or the extra that brings its package."""
    monkeypatch.setattr("gen_data.physics.physics_config.is_installed", {"mujoco"}.__contains__)
    with (
        pytest.raises(ConfigError, match=r"physics\.engine: 'pybullet'.*'mujoco'.*\[bullet\]"),
        open_engine(Solids(), PhysicsConfig(engine="pybullet")),
    ):
        pass


def test_the_place_of_a_missing_engine_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Line and column of the value, before anything is generated."""
    monkeypatch.setattr("gen_data.physics.physics_config.is_installed", {"mujoco"}.__contains__)
    config = tmp_path / "mine.yaml"
    config.write_text("extends: tabletop.yaml\nphysics: {engine: pybullet}\n")

    with pytest.raises(ConfigError, match=r"mine\.yaml:2:19: physics\.engine: 'pybullet' is not"):
        PipelineFactory(load_config(config), n=1).check()


def test_the_plan_names_the_engine() -> None:
    """Also if the configuration does not: another machine must not take another one."""
    config = make_plan(PipelineFactory(load_config("tabletop.yaml"), n=1)).config

    assert config["physics"]["engine"] == PhysicsConfig().engine
