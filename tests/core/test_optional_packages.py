"""Features without their package say which extra brings it."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from gen_data.assets.image_decoding import read_exr
from gen_data.cli.main import cli
from gen_data.core import distribution, errors, optional_packages
from gen_data.core.optional_packages import EXTRAS, missing_packages
from gen_data.exporters import rerun, usd
from gen_data.usd.stage_reader import OpenStage
from tests.wheels import HAS_RERUN, INSTALLED

PROJECT = Path(__file__).parents[2] / "pyproject.toml"


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(optional_packages, "find_spec", lambda name: None)


def extra_lists() -> dict[str, str]:
    """Text of each list of optional dependencies; Python 3.10 has no reader of TOML."""
    section = PROJECT.read_text().split("[project.optional-dependencies]")[1].split("\n[")[0]
    return dict(re.findall(r"^([\w-]+) = \[(.*?)\]$", section, re.MULTILINE | re.DOTALL))


def test_each_extra_brings_the_packages_that_messages_promise() -> None:
    lists = extra_lists()

    for package, extra in EXTRAS.values():
        assert f'"{package}>=' in lists[extra]
        assert re.search(rf"\W{extra}\W", lists["all"])


def test_what_is_installed_is_not_missing() -> None:
    """The tests' own environment has every extra, as far as there are wheels."""
    without_wheel = {"pybullet"} - {*INSTALLED} | ({"rerun"} if not HAS_RERUN else set())
    assert missing_packages(*EXTRAS.keys() - without_wheel) == ""


def test_features_without_their_package_name_the_extra_before_they_begin(
    bare: None, tmp_path: Path
) -> None:
    """Exporters by ``check``, readers by the file, and the preview with the rest."""
    assert missing_packages("pxr", "h5py", "mcap") == (
        "needs the packages h5py, mcap, usd-core: " + distribution.install_command("formats", "usd")
    )

    with pytest.raises(errors.ConfigError, match=r"exporter 'usd' needs .*\[usd\]'"):
        usd.Usd().check(None)  # type: ignore[arg-type]
    with pytest.raises(errors.ConfigError, match=r"exporter 'rerun' needs .*\[preview\]'"):
        rerun.Rerun().check(None)  # type: ignore[arg-type]

    with pytest.raises(errors.AssetError, match=r"mine\.usda: needs .*\[usd\]'"):
        OpenStage(tmp_path / "mine.usda", "mine.usda")
    with pytest.raises(errors.AssetError, match=r"sky\.exr: needs .*\[exr\]'"):
        read_exr(b"", "sky.exr")

    done = CliRunner().invoke(cli, ["preview", "tabletop.yaml"])

    assert isinstance(done.exception, errors.ConfigError)
    assert distribution.install_command("preview") in str(done.exception)
    assert "contact-sheet" in str(done.exception)
