"""A checkout works without symbolic links: as it is, and built into a wheel."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.architecture.test_import_root import FOLDERS, LINKS, ROOT
from tests.repository import repository_files

BUILT = ("pyproject.toml", "setup.py", "README.md", "LICENSE")


def checkout(folder: Path, links: bool) -> Path:
    """Copy the sources of the build; without links, git writes their targets as texts instead."""
    for name in ("gen_data", *FOLDERS):
        ignored = shutil.ignore_patterns("__pycache__", "compiled")
        shutil.copytree(ROOT / name, folder / name, symlinks=True, ignore=ignored)
    for name in BUILT:
        shutil.copy(ROOT / name, folder)
    for name, target in LINKS.items():
        place = folder / "gen_data" / name
        place.unlink()
        if links:
            place.symlink_to(target)
        else:
            place.write_text(target)
    return folder


def run(code: str, folder: Path, first_on_path: Path | None = None) -> str:
    variables = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    if first_on_path:
        variables["PYTHONPATH"] = str(first_on_path)
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env=variables,
        text=True,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("links", [True, False])
def test_a_checkout_imports_its_own_folders(tmp_path: Path, links: bool) -> None:
    """Whatever an editable installation of another checkout points to, as in the tests' own."""
    place = checkout(tmp_path, links)
    code = (
        "import pickle\n"
        "from importlib.resources import files\n"
        "import gen_data.exporters, gen_data.core.se3 as se3\n"
        "from gen_data.assemble.config import load_config\n"
        "assert pickle.loads(pickle.dumps(se3.SE3())) == se3.SE3()\n"
        "assert files('gen_data.configs').joinpath('tabletop.yaml').is_file()\n"
        "print(load_config('tabletop.yaml').name)\n"
        "print(gen_data.exporters.__file__)\n"
        "print(se3.__file__)\n"
    )

    name, *files = run(code, place).splitlines()

    assert name == "tabletop"
    assert [Path(file).resolve() for file in files] == [
        place / "exporters/__init__.py",
        place / "generator/core/se3.py",
    ]


@pytest.mark.skipif(
    not ((ROOT / ".git").exists() and shutil.which("git")), reason="an archive, or no git"
)
def test_files_are_found_without_git() -> None:
    """The same ones as git finds; deleted ones and links to folders are none."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout

    files = {name for name in listed.splitlines() if (ROOT / name).is_file()}
    assert set(repository_files()) == files


@pytest.mark.slow
def test_wheels_are_equal_with_and_without_links_and_complete(tmp_path: Path) -> None:
    """Every module, schema, configuration and picture of the folders, in the same bytes."""
    contents = []
    for links in (True, False):
        place = tmp_path / f"links {links}"
        place.mkdir()
        checkout(place, links)
        built = tmp_path / f"wheel {links}"
        built.mkdir()
        run(f"from setuptools import build_meta; build_meta.build_wheel({str(built)!r})", place)
        with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel:
            contents.append({item.filename: item.CRC for item in wheel.infolist()})
    expected = {
        f"gen_data/{path.relative_to(ROOT).as_posix().removeprefix('generator/')}"
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and not {"__pycache__", "compiled"} & {*path.parts}
    }

    linked, unlinked = contents
    assert linked == unlinked
    assert expected <= linked.keys()


@pytest.mark.slow
def test_a_wheel_of_a_checkout_without_links_works(tmp_path: Path) -> None:
    """Unpacked, as an installation does it."""
    place = tmp_path / "checkout"
    place.mkdir()
    checkout(place, links=False)
    run(f"from setuptools import build_meta; build_meta.build_wheel({str(tmp_path)!r})", place)
    site = tmp_path / "site"
    with zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as wheel:
        wheel.extractall(site)
    code = (
        "import gen_data\n"
        "print(gen_data.__file__, len(gen_data.__path__))\n"
        "print(gen_data.Dataset('shelf.yaml')[0].index)\n"
    )

    assert run(code, tmp_path, site).split() == [str(site / "gen_data/__init__.py"), "1", "0"]
