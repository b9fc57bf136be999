"""Shell commands of all pages but the tutorials: each runs at a small size, or a reason is stated.

``tests/documents/test_tutorials.py`` runs tutorials, ``.ci/bare_root`` the README on a bare system.
"""

import shlex
from pathlib import Path

import pytest

from tests.documents import test_tutorials
from tests.documents.test_documents import OLD_NAMES, ROOT

INSTALLATION = {ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "docs/installation.md"}
"""Pages whose commands make environments, which `.ci/bare_root` and `.ci/run` do."""
PAGES = sorted({*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")} - INSTALLATION)
SMALL = "--set sensors[0].size_px=[96,72]"

NOT_RUN = {
    "pip install": "`.ci/bare_root` installs every extra",
    "LABEL_STUDIO_": "starts a server",
    "rerun ": "opens a window",
    "qc_opendrive ": "a checker that no extra installs, and a configuration of one's own",
    "gen-data edit ": "serves until it is interrupted; tests/edit/test_browser.py",
    "gen-data match ": "reads recordings of one's own; tests/end_to_end/test_match.py has some",
    "gen-data --config matched.yaml": "uses the result of the command before it",
    "gen-data --config real.yaml": "a configuration of one's own",
    "PER_TASK=": "needs SLURM",
    "FIRST=": "needs SLURM",
    "gen-data --config street.yaml --n 100000 --workers": "needs SLURM",
    'gen-data merge "$SCRATCH"': "needs SLURM",
    "k=0": "needs other machines",
    "for host in": "needs other machines",
    "ssh ": "needs other machines",
    "k=$((k + 1))": "needs other machines",
    "done": "needs other machines",
    "wait": "needs other machines",
    "gen-data merge part-*": "needs other machines",
    "gen-data --config street.yaml --n 1000000 --out": "needs a cluster; tests/runner/test_ray.py",
    "gen-data verify s3:": "needs object storage; tests/runner/test_object_store.py",
    "docker ": "needs Docker; `.ci/run` runs it where it is",
    "python -m benchmarks.readers": "installs 4.6 GB; tests/benchmarks/test_readers.py runs it",
    "python -m benchmarks.gpu": "needs a GPU; tests/benchmarks/test_gpu.py runs both on a CPU",
    "python -m benchmarks.faults": "hours; tests/determinism/test_fault_campaigns.py is short",
}
"""Beginnings of commands, and why they are not run here."""

BEFORE = {
    "carry_over": (
        "gen-data --config tabletop.yaml --n 2 {small}",
        "gen-data --config tabletop.yaml --n 2 --seed 8 --out real {small}",
    ),
    "certificates": ("gen-data --config tabletop.yaml --n 2 --out out/table {small}",),
    "report": (
        "gen-data --config tabletop.yaml --n 2 {small}",
        "gen-data --config tabletop.yaml --n 2 --seed 8 --out out/fisheye {small}",
    ),
    "trust": ("gen-data --config street.yaml --n 1 {small}",),
}
"""Data sets that pages take for granted."""

SMALLER = {
    "--n 1380": f"--n 1 {SMALL}", "--n 1600": f"--n 2 {SMALL}",
    "--n 60": f"--n 1 {SMALL} --out out/suction",
    "--n 60 --seed 1 --out out/table": "--n 1 --seed 1 --out out/small",
    "--n 300 --light 30": "--n 1 --light 1", "--n 300 --light 40": "--n 1 --light 1",
    "--n 300 --light 40 --scans 300": "--n 1 --light 1 --scans 1",
    "--n 60 --html carry_over.html": "--n 2 --html carry_over.html", "--probe 20": "--probe 1",
    "certify out/table": "certify out/table --samples 1 --rays 10 --scenes 0",
}  # fmt: skip
"""Texts that are replaced, so that commands run within seconds; the first that fits."""


def commands(page: Path) -> list[str]:
    """Lines of a page's blocks of shell commands, without comments and empty ones."""
    blocks = [text for kind, text in test_tutorials.BLOCK.findall(page.read_text("utf-8"))
              if kind in ("bash", "sh")]  # fmt: skip
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    return [line.strip() for line in lines if line.strip() and not line.startswith("#")]


def reason_against(command: str) -> str:
    """Why a command is not run; empty if it is."""
    return next((why for start, why in NOT_RUN.items() if command.startswith(start)), "")


RUN = {
    page.stem: [line for line in commands(page) if not reason_against(line)]
    for page in PAGES
    if page not in OLD_NAMES
}


def test_reasons_are_those_of_commands_that_exist() -> None:
    """A reason for a command that no page has any more is removed."""
    lines = [line for page in PAGES for line in commands(page)]

    for start in NOT_RUN:
        assert any(line.startswith(start) for line in lines), start


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("name", [name for name, lines in RUN.items() if lines])
def test_commands_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the first to the last one of the page, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    prepared = [line.format(small=SMALL) for line in BEFORE.get(name, ())]
    for line in [*prepared, *map(shortened, RUN[name])]:
        test_tutorials.run(shlex.split(line, comments=True), tmp_path)


def shortened(line: str) -> str:
    """The command at a small size."""
    for long, short in sorted(SMALLER.items(), key=lambda pair: -len(pair[0])):
        if long in line:
            return line.replace(long, short)
    return line
