"""The files of pybullet, for systems for which it has no wheel."""

import importlib.util
import zipfile
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pybullet_data
import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assets.library import Library, open_library
from gen_data.core.errors import UnknownAsset
from gen_data.packs.install import install
from gen_data.packs.pack_table import find_pack

KINDS = ("colors16.png", "franka_panda", "lego", "soccerball", "teddy")


def folder() -> Path:
    return Path(pybullet_data.getDataPath())


def pack_wheel(wheel: Path, kinds: tuple[str, ...] = ("",)) -> Path:
    """Write a wheel with a part of pybullet's files, and with some that nobody asked for."""
    with zipfile.ZipFile(wheel, "w") as file:
        for path in sorted(folder().rglob("*")):
            name = path.relative_to(folder()).as_posix()
            if path.is_file() and name.startswith(kinds):
                file.write(path, f"pybullet_data/{name}")
        file.writestr("pybullet_data/policies/ppo.pb", b"never wanted")
        file.writestr("pybullet.so", b"never wanted")
    return wheel


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """The pack, with a part of its files."""
    wheel = pack_wheel(tmp_path / "pybullet.whl", KINDS)
    pack = replace(find_pack("pybullet"), sha256=sha256(wheel.read_bytes()).hexdigest())
    install(pack, tmp_path / "packs", wheel)
    return tmp_path / "packs"


def without_pybullet(patch: pytest.MonkeyPatch) -> None:
    find: Callable[[str], object] = importlib.util.find_spec
    patch.setattr(
        importlib.util, "find_spec", lambda name: None if "pybullet" in name else find(name)
    )


def library(packs: Path, cache: Path) -> Library:
    return open_library(cache_dir=cache, packs=packs)


def test_the_pack_has_what_the_index_needs_and_nothing_else(installed: Path) -> None:
    names = {path.name for path in (installed / "pybullet").iterdir()}

    assert {"franka_panda", "teddy_vhacd.urdf", "pack.json"} <= names
    assert not names & {"policies", "pybullet.so", "pybullet_data"}


@pytest.mark.slow
def test_assets_are_the_same_as_those_of_pybullet(
    installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Description, digest of the files, and shape: a plan holds on both systems."""
    ids = ("pybullet/teddy", "pybullet/lego", "pybullet/soccerball")
    own = library(tmp_path / "none", tmp_path / "own cache")
    there = [(own.get(name), own.bounds_m(name)) for name in ids]
    robot = own.robot("franka_panda")
    without_pybullet(monkeypatch)
    packed = library(installed, tmp_path / "pack cache")

    assert [(packed.get(name), packed.bounds_m(name)) for name in ids] == there
    assert packed.robot("franka_panda") == robot


def test_without_pybullet_and_its_pack_everything_else_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An asset of it names the command that installs the pack."""
    without_pybullet(monkeypatch)
    bare = library(tmp_path / "none", tmp_path / "cache")

    assert bare.find(("household",))
    assert bare.find(("pybullet",)) == ()
    for missing in ("franka_panda", "pybullet/teddy", "franka_panda/panda_link0"):
        with pytest.raises(UnknownAsset, match="run: gen-data assets install pybullet"):
            bare.get(missing)
    with pytest.raises(UnknownAsset, match=r"^asset 'pybullet/no': unknown"):
        bare.get("pybullet/no")


def test_a_missing_arm_names_its_pack(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nothing may be fetched: before anything is generated, with the place of the name."""
    without_pybullet(monkeypatch)
    monkeypatch.setenv("GEN_DATA_OFFLINE", "1")
    monkeypatch.setenv("GEN_DATA_ASSETS", str(tmp_path))

    with pytest.raises(UnknownAsset, match=r"tabletop\.yaml:\d+:\d+.*assets install pybullet"):
        PipelineFactory(load_config("tabletop.yaml"), n=1).check()
