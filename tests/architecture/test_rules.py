"""The rules of the house that a machine can check."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("generator", "randomizers", "exporters", "scene_templates", "benchmarks", "tests")
OURS = ("generator", "randomizers", "exporters", "scene_templates")
LINES_PER_FUNCTION_MAX = 70


def run_tool(*command: str) -> subprocess.CompletedProcess[str]:
    """Run a development tool of this environment from the repository's root."""
    tool = Path(sys.executable).with_name(command[0])
    name = str(tool) if tool.exists() else shutil.which(command[0])
    assert name is not None, f"{command[0]} is missing: pip install -e '.[test]'"
    return subprocess.run(
        [name, *command[1:]], cwd=ROOT, capture_output=True, text=True, check=False
    )


def assert_clean(done: subprocess.CompletedProcess[str]) -> None:
    """The tool found nothing to complain about."""
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"


def python_files(*packages: str) -> list[Path]:
    """Every module of some packages, sorted."""
    return sorted(path for name in packages for path in (ROOT / name).rglob("*.py"))


def test_linter_finds_nothing() -> None:
    """Ruff's rules of pyproject.toml hold in every package."""
    assert_clean(run_tool("ruff", "check", *PACKAGES))


def test_code_is_formatted() -> None:
    """The formatter would change nothing."""
    assert_clean(run_tool("ruff", "format", "--check", *PACKAGES))


def test_imports_point_downward() -> None:
    """The layers of ARCHITECTURE.md are respected."""
    assert_clean(run_tool("lint-imports"))


def test_types_are_strict() -> None:
    """Mypy accepts every package in strict mode."""
    assert_clean(run_tool("mypy"))


@pytest.mark.parametrize("path", python_files(*OURS), ids=lambda p: str(p.relative_to(ROOT)))
def test_functions_stay_short(path: Path) -> None:
    """No function is longer than 70 lines."""
    tree = ast.parse(path.read_text())
    functions = [
        n for n in ast.walk(tree) if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef))
    ]
    too_long = [
        f"{f.name}: {length} lines"
        for f in functions
        if (length := (f.end_lineno or f.lineno) - f.lineno + 1) > LINES_PER_FUNCTION_MAX
    ]
    assert not too_long


def test_only_the_command_line_prints_and_reads_the_environment() -> None:
    """Library code has no hidden inputs and no output of its own; packs say where they are."""
    offenders = [
        f"{path.relative_to(ROOT)}: {node.attr}"
        for path in python_files(*OURS)
        if "cli" not in path.parts and path != ROOT / "generator" / "assets" / "paths.py"
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and (node.value.id, node.attr) in {("os", "environ"), ("os", "getenv")}
    ]
    assert not offenders


def test_help_answers_quickly() -> None:
    """``gen-data --help`` needs no heavy import: the quickest of five runs is under 0.3 s."""
    command = [sys.executable, "-c", "from generator.cli.main import main; main()", "--help"]
    seconds = []
    for _ in range(5):
        started_s = time.perf_counter()
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
        seconds.append(time.perf_counter() - started_s)
    assert "--config" in done.stdout
    assert min(seconds) < 0.3


def test_help_imports_no_engine() -> None:
    """numpy-only at most: pybullet, warp, open3d, cv2, rerun and pydantic stay unloaded."""
    program = (
        "import sys; sys.argv = ['gen-data', '--help']\n"
        "from generator.cli.main import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "heavy = {'pybullet', 'warp', 'open3d', 'cv2', 'rerun', 'pydantic', 'trimesh', 'scipy'}\n"
        "print('LOADED', sorted(heavy & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert "LOADED []" in done.stdout
