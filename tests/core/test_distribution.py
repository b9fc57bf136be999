"""One name on package indices, and commands that install from where the code came."""

import json
import re
from importlib.metadata import PathDistribution
from pathlib import Path

import pytest

from gen_data.cli.doctor import CHECKS
from gen_data.core import distribution
from gen_data.core.distribution import DISTRIBUTION, install_command
from gen_data.core.errors import SampleError
from tests.repository import ROOT, repository_files

HISTORY = {"CHANGELOG.md", "tests/core/test_distribution.py"}
"""The page of past changes, and this list of forbidden text."""
AS_REQUIREMENT = re.compile(
    r"""gen-data\\*\[                            # with extras
    | ^name\ =\ "gen-data"
    | dependencies\ =\ \[[^\]]*["']gen-data["'=<>~!;\ ]
    | (?:pip|pipx|uvx?|tool)\ (?:install|run|download|wheel)[^\n`&]*[ '"]gen-data(?![-\w/.:])
    | \b(?:version|distribution|requires|metadata|files)\(["']gen-data["']
    """,
    re.MULTILINE | re.VERBOSE,
)
"""The name of the stranger's project, where a package is meant and not the command."""


@pytest.fixture
def origin(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The file of an installed wheel in which pip records its origin; not written yet."""
    record = tmp_path / "gen_data_perception-1.dist-info/direct_url.json"
    record.parent.mkdir()
    monkeypatch.setattr(distribution, "_FOLDER", tmp_path)
    monkeypatch.setattr(distribution, "distribution", lambda _: PathDistribution(record.parent))
    distribution._source.cache_clear()
    monkeypatch.setattr(distribution, "_source", distribution._source.__wrapped__)
    return record


def test_a_checkout_has_the_name_of_the_project_and_installs_extras_of_itself() -> None:
    """By its path: the command works in any folder."""
    assert f'[project]\nname = "{DISTRIBUTION}"\n' in (ROOT / "pyproject.toml").read_text()

    assert install_command("ray", "cloud") == f"pip install -e '{ROOT}[cloud,ray]'"


def test_nothing_asks_an_index_for_the_project_that_took_the_short_name() -> None:
    """Neither documents nor messages, workflows, plug-ins or the project's own extras."""
    found = [
        f"{name}:{text.count(chr(10), 0, hit.start()) + 1}: {hit.group()}"
        for name in repository_files()
        if name not in HISTORY
        for text in [(ROOT / name).read_text("utf-8", "replace")]
        for hit in AS_REQUIREMENT.finditer(text)
    ]
    assert not found


@pytest.mark.parametrize("text", [
    "pip install 'gen-data[ray]'", "uv pip install gen-data", "pip install --upgrade 'gen-data>=1'",
    'dependencies = ["numpy", "gen-data"]', 'version("gen-data")',
])  # fmt: skip
def test_the_search_finds_requirements(text: str) -> None:
    """Forbidden text stands for itself: the command, and folders of the user."""
    assert AS_REQUIREMENT.search(text)
    assert not AS_REQUIREMENT.search(text.replace("gen-data", DISTRIBUTION))


@pytest.mark.parametrize("name", ["checkout", "gen_data_perception-1-py3-none-any.whl"])
def test_extras_come_from_where_the_project_came(origin: Path, tmp_path: Path, name: str) -> None:
    """A folder or a wheel; spaces are quoted in the record and in the command."""
    source = tmp_path / "my folder" / name
    source.parent.mkdir()
    source.touch()
    origin.write_text(json.dumps({"url": source.as_uri(), "dir_info": {}}))

    assert install_command("ray") == f"pip install '{source}[ray]'"


@pytest.mark.parametrize(
    "record", ["", '{"url": "file:///nowhere/at/all"}', '{"url": "https://example.com/x.whl"}']
)
def test_without_its_source_an_installation_asks_the_index(origin: Path, record: str) -> None:
    origin.write_text(record)

    assert install_command("ray") == f"pip install '{DISTRIBUTION}[ray]'"


def test_doctor_finds_another_project_that_installs_the_same_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the top-level packages that installations record, whatever the project is called."""
    record = tmp_path / "textual_data-3.1.dist-info"
    record.mkdir()
    (record / "METADATA").write_text("Metadata-Version: 2.1\nName: textual-data\nVersion: 3.1\n")
    (record / "top_level.txt").write_text("gen_data\n")
    monkeypatch.syspath_prepend(tmp_path)

    (check,) = (one for one in CHECKS if one.name == "name")

    with pytest.raises(SampleError, match=r"gen_data is also installed by .*textual-data"):
        check.attempt()
    assert not check.required
    assert check.remedy.startswith(f"uninstall it and {DISTRIBUTION}")
