"""``gen-data assets``: output and exit codes."""

import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner

from gen_data.cli.main import cli
from gen_data.core.errors import AssetError
from tests.end_to_end import running


def gen_data(*arguments: str, home: Path) -> subprocess.CompletedProcess[str]:
    return running.gen_data(*arguments, cwd=home, GEN_DATA_ASSETS=str(home))


def test_list_names_every_pack_and_the_folder(tmp_path: Path) -> None:
    """Nothing is installed; listing creates no files."""
    done = gen_data("assets", "list", home=tmp_path)
    assert done.returncode == 0
    for name in ("people", "catalogue", "hdri", "robots"):
        assert name in done.stdout
    assert str(tmp_path / "packs") in done.stdout
    assert list(tmp_path.iterdir()) == []


def test_show_tells_what_an_asset_is(tmp_path: Path) -> None:
    done = gen_data("assets", "show", "pybullet/teddy", home=tmp_path)
    assert done.returncode == 0
    assert "teddy bear" in done.stdout and "zlib" in done.stdout and "triangles" in done.stdout


def test_list_finds_assets_by_tags(tmp_path: Path) -> None:
    done = gen_data("assets", "list", "pybullet", "toy", home=tmp_path)
    assert "pybullet/teddy" in done.stdout and "franka" not in done.stdout


@pytest.mark.parametrize(("tags", "said"), [
    (("hausehold",), "no asset has the tag 'hausehold' (did you mean 'household'?)"),
    (("conveyor",), "no asset has the tag 'conveyor'"),
    (("toy", "robot"), "no asset has all of the tags toy, robot; each of them has some"),
    (("user",), "no asset has the tag 'user'"),
])  # fmt: skip
def test_a_list_without_an_asset_tells_why(tags: tuple[str, ...], said: str) -> None:
    """A misspelt tag is not mistaken for an asset that is not installed."""
    done = CliRunner().invoke(cli, ["assets", "list", *tags])

    assert isinstance(done.exception, AssetError)
    assert said in str(done.exception)
    assert done.stdout == ""


@pytest.mark.parametrize(("arguments", "code", "said"), [
    (("install", "catalog"), 2, "did you mean 'catalogue'"),
    (("install", "all", "--from", "archive"), 2, "--from takes the archive of one pack"),
    (("install", "hdri", "--from", "archive"), 3, "sha256 is"),
    (("install", "hdri", "--from", "nowhere"), 2, "does not exist"),
    (("remove", "hdri"), 3, "not installed"),
    (("verify", "hdri"), 3, "not installed"),
])  # fmt: skip
def test_errors_have_one_message_and_their_exit_code(
    arguments: tuple[str, ...], code: int, said: str, tmp_path: Path
) -> None:
    """Without a traceback, and with nothing installed."""
    (tmp_path / "archive").write_bytes(b"no archive")
    done = gen_data("assets", *arguments, home=tmp_path)
    assert done.returncode == code
    assert said in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "packs" / "hdri").exists()


def test_prepare_of_a_missing_configuration_says_so_alone(tmp_path: Path) -> None:
    done = gen_data("assets", "prepare", "missing.yaml", home=tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("gen-data: there is no configuration 'missing.yaml'")
