"""Rules that no linter knows; ruff, mypy and lint-imports run before the tests in ``.ci/run``."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
OURS = ("generator", "randomizers", "exporters", "scene_templates")
LINES_PER_FUNCTION_MAX = 70


def python_files(*packages: str) -> list[Path]:
    """Every module of some packages, sorted."""
    return sorted(path for name in packages for path in (ROOT / name).rglob("*.py"))


def test_functions_stay_short() -> None:
    """No function has more than 70 lines, comments and blank lines apart."""
    too_long = [
        f"{path.relative_to(ROOT)}: {node.name}: {length} lines"
        for path in python_files(*OURS)
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        and (length := lines_of_code(path, node)) > LINES_PER_FUNCTION_MAX
    ]
    assert not too_long


def lines_of_code(path: Path, function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function that are neither blank nor a comment."""
    lines = path.read_text().splitlines()[function.lineno - 1 : function.end_lineno]
    return sum(bool(line.strip()) and not line.lstrip().startswith("#") for line in lines)


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


def test_help_imports_click_and_nothing_else() -> None:
    """``gen-data --help`` answers at once because it loads no library but its own parser."""
    program = (
        "import sys\n"
        "before = set(sys.modules)\n"
        "from gen_data.generator.cli.main import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "loaded = {name.partition('.')[0] for name in set(sys.modules) - before}\n"
        "print('LOADED', *sorted(loaded - sys.stdlib_module_names))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, "--help"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert "--config" in done.stdout
    assert done.stdout.splitlines()[-1] == "LOADED click gen_data"


def test_no_test_measures_the_wall_clock() -> None:
    """A busy machine fails no test: instants are compared with deadlines, never subtracted."""
    clocks = {("time", name) for name in ("time", "monotonic", "perf_counter")}
    offenders = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in python_files("tests")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub)
        for call in ast.walk(node.left)
        if isinstance(call, ast.Call)
        and isinstance(call.func, ast.Attribute)
        and isinstance(call.func.value, ast.Name)
        and (call.func.value.id, call.func.attr) in clocks
    ]
    assert not offenders
