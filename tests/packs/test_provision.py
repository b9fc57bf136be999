"""The files of pybullet are fetched where it has no wheel: once, when they are first needed."""

import multiprocessing
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assets.library import open_library
from gen_data.core.errors import AssetError
from gen_data.packs import pack_table
from gen_data.packs.provision import open_assets, provide_pybullet
from tests.end_to_end.running import ROOT
from tests.packs.test_pybullet_pack import KINDS, pack_wheel, without_pybullet

TEDDY = "pybullet/teddy"


@pytest.fixture
def index(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> Callable[[str], None]:
    """A machine without pybullet; its package client runs the script handed to the function."""
    without_pybullet(monkeypatch)
    kinds = getattr(request, "param", KINDS)
    wheel = pack_wheel(tmp_path / "pybullet.whl", kinds)
    digest = sha256(wheel.read_bytes()).hexdigest()
    packs = tuple(
        replace(pack, sha256=digest) if pack.name == "pybullet" else pack
        for pack in pack_table.PACKS
    )
    monkeypatch.setattr(pack_table, "PACKS", packs)
    monkeypatch.setenv("GEN_DATA_ASSETS", str(tmp_path / "assets"))
    programs = tmp_path / "bin"
    programs.mkdir()
    monkeypatch.setenv("PATH", str(programs))

    def answer(script: str) -> None:
        pip = programs / "pip"
        pip.write_text(f"#!/bin/sh\necho called >> {tmp_path}/calls\n{script}\n")
        pip.chmod(0o755)

    answer(f"/bin/cp {wheel} .")
    return answer


def calls(tmp_path: Path) -> int:
    """Number of times that the package client was started."""
    log = tmp_path / "calls"
    return len(log.read_text().splitlines()) if log.exists() else 0


@pytest.mark.usefixtures("index")
@pytest.mark.parametrize("wanted", ["an id", "the id of a link", "tags"])
def test_they_are_fetched_when_an_asset_is_wanted(
    wanted: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """One line names files, source, size and licence; the second time, nothing."""
    ask = {
        "an id": lambda library: library.get(TEDDY),
        "the id of a link": lambda library: library.mesh("franka_panda/panda_link0"),
        "tags": lambda library: library.find(("sports", "toy")),
    }[wanted]

    ask(open_assets())
    (line,) = capfd.readouterr().err.splitlines()
    ask(open_assets())

    assert calls(tmp_path) == 1
    for part in ("PyPI pybullet 3.2.7", "103 MB", str(tmp_path / "assets"), "zlib"):
        assert part in line
    assert capfd.readouterr().err == ""


@pytest.mark.usefixtures("index")
def test_they_are_not_fetched_for_anything_else(tmp_path: Path) -> None:
    library = open_assets()

    assert library.find(("car",)) and library.find((), "plate") and library.find((), "texture")
    assert library.get("mug?seed=3")
    assert open_library(packs=tmp_path / "assets/packs").find((), "robot") == ()
    assert calls(tmp_path) == 0


@pytest.mark.usefixtures("index")
def test_nothing_is_fetched_if_forbidden(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Assets of other packages work, and errors of these name the command."""
    monkeypatch.setenv("GEN_DATA_OFFLINE", "1")
    library = open_assets()

    assert library.find((), "robot") == ()
    with pytest.raises(AssetError, match="run: gen-data assets install pybullet"):
        library.get(TEDDY)
    assert calls(tmp_path) == 0


def test_without_a_network_the_error_says_what_helps(index: Callable[[str], None]) -> None:
    """Fetch it elsewhere, or do without."""
    index("echo 'Temporary failure in name resolution' >&2; exit 1")

    with pytest.raises(AssetError) as caught:
        open_assets().get(TEDDY)

    message = str(caught.value)
    assert "found no network" in message
    assert "gen-data assets install pybullet --from FILE" in message
    assert "GEN_DATA_OFFLINE=1" in message


@pytest.mark.slow
def test_processes_that_start_together_fetch_once(
    index: Callable[[str], None], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The others wait for the first; a worker of a data loader is such a process."""
    index(f"/bin/sleep 0.3; /bin/cp {tmp_path}/pybullet.whl .")
    context = multiprocessing.get_context("fork")
    folder = tmp_path / "assets/packs"
    processes = [context.Process(target=provide_pybullet, args=(folder,)) for _ in range(4)]

    for process in processes:
        process.start()
    for process in processes:
        process.join()

    assert [process.exitcode for process in processes] == [0] * 4
    assert calls(tmp_path) == 1
    assert (folder / "pybullet/franka_panda/panda.urdf").is_file()
    assert len(capfd.readouterr().err.splitlines()) == 1


@pytest.mark.slow
@pytest.mark.parametrize("index", [("",)], indirect=True, ids=["all files"])
def test_a_run_fetches_them_before_workers(index: Callable[[str], None], tmp_path: Path) -> None:
    """The check of a configuration needs them already; arms and objects on the table are there."""
    factory = PipelineFactory(load_config("tabletop.yaml"), n=1)

    factory.check()

    assert calls(tmp_path) == 1
    assert "toy brick" in factory.categories


def test_programs_open_the_library_that_provides_them() -> None:
    """``open_assets``; only ``assets check`` and ``install`` work on installed packs."""
    opened = {
        path.relative_to(ROOT).as_posix()
        for folder in ("generator", "content", "lab", "randomizers", "exporters", "scene_templates")
        for path in (ROOT / folder).rglob("*.py")
        if "open_library(" in path.read_text("utf-8")
    }
    assert opened == {
        "generator/assets/library.py",
        "generator/cli/asset_commands.py",
        "generator/packs/provision.py",
    }
