"""Rules that no linter has; ruff, mypy and lint-imports run before the tests in ``.ci/run``."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from tests.end_to_end.running import environment

ROOT = Path(__file__).parents[2]
OURS = ("generator", "content", "lab", "randomizers", "exporters", "scene_templates")
LINES_PER_FUNCTION_MAX = 70


def python_files(*packages: str) -> list[Path]:
    return sorted(path for name in packages for path in (ROOT / name).rglob("*.py"))


def test_functions_stay_short() -> None:
    """No function has more than 70 lines, comments and blank lines apart."""
    too_long = [
        f"{path.relative_to(ROOT)}: {node.name}: {length} lines"
        for path in python_files(*OURS)
        for node in functions_in(ast.parse(path.read_text()))
        # Most are short, comments included.
        if (node.end_lineno or 0) - node.lineno >= LINES_PER_FUNCTION_MAX
        and (length := lines_of_code(path, node)) > LINES_PER_FUNCTION_MAX
    ]
    assert not too_long


def test_temporary_folders_have_a_lock() -> None:
    """Folders of that name without one are removed by any other process after a minute."""
    bare = [
        str(path.relative_to(ROOT))
        for path in python_files(*OURS)
        if path.name != "temporary_folders.py" and 'prefix="gen-data-' in path.read_text()
    ]
    assert not bare


def test_mappings_answer_whether_a_key_is_there_without_its_value() -> None:
    """``Mapping`` answers ``in`` by ``__getitem__``, which decodes an image or renders a sample."""
    costly = [
        f"{path.relative_to(ROOT)}: {node.name}"
        for path in python_files(*OURS)
        if "(Mapping[" in (source := path.read_text())
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ClassDef)
        and any(ast.unparse(base).startswith("Mapping[") for base in node.bases)
        and "__contains__" not in {f.name for f in node.body if isinstance(f, ast.FunctionDef)}
    ]
    assert not costly


def functions_in(node: ast.AST) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    """Functions among the statements of a module, nested ones included."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield child
        # Expressions, the most numerous nodes, hold no statements.
        if not isinstance(child, ast.expr):
            yield from functions_in(child)


def lines_of_code(path: Path, function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function that are neither blank nor a comment."""
    lines = path.read_text().splitlines()[function.lineno - 1 : function.end_lineno]
    return sum(bool(line.strip()) and not line.lstrip().startswith("#") for line in lines)


UNBOUNDED_CACHES = {
    # By type, of which the code has a fixed number.
    "schema.py: _attribute_docstrings",
    "schema.py: model_schema",
    "serialization.py: _builder",
    "serialization.py: _field_builders",
    "serialization.py: _fields_of",
    "struct_dtypes.py: struct_dtype",
    # By a name in a table of the code or of a plug-in.
    "base.py: distribution",
    "base.py: distribution_names",
    "device_presets.py: load_preset",
    "device_presets.py: preset_names",
    "image_pipeline.py: _preset",
    "label_map.py: public_classes",
    "nuscenes_classes.py: _index",
    "person.py: _pose_lots",
    "plugins.py: third_party",
    # By a setting of the run.
    "device.py: compile_kernels",
    "image_files.py: depths_of_units",
}
"""Caches without a bound, whose number of values does not depend on the number of samples."""


def test_every_cache_is_bounded() -> None:
    """``functools.cache`` of a function with arguments keeps a value for each of them."""
    unbounded = {
        f"{path.name}: {node.name}"
        for path in python_files(*OURS)
        if "cache\n" in (source := path.read_text()) or "maxsize=None" in source
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef)
        and any(has_no_bound(decorator) for decorator in node.decorator_list)
        and (node.args.args or node.args.kwonlyargs or node.args.vararg)
    }
    assert unbounded == UNBOUNDED_CACHES


def has_no_bound(decorator: ast.expr) -> bool:
    """Whether a decorator is ``cache``, or ``lru_cache`` with ``maxsize=None``."""
    name = decorator.func if isinstance(decorator, ast.Call) else decorator
    word = name.attr if isinstance(name, ast.Attribute) else getattr(name, "id", "")
    if not isinstance(decorator, ast.Call):
        return word == "cache"
    values = [*decorator.args, *(keyword.value for keyword in decorator.keywords)]
    return word == "lru_cache" and any(
        isinstance(value, ast.Constant) and value.value is None for value in values
    )


def test_only_the_command_line_prints_and_reads_the_environment() -> None:
    """Library code has no hidden inputs and does not print.

    Packs state their place and whether they may be fetched, and a fetch announces itself.
    """
    offenders = [
        f"{path.relative_to(ROOT)}: {node.attr}"
        for path in python_files(*OURS)
        if "cli" not in path.parts
        and not path.stem.endswith("_command")
        and path != ROOT / "generator" / "assets" / "paths.py"
        # Parsing takes longest: most files do not have the words.
        if "environ" in (source := path.read_text()) or "getenv" in source
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and (node.value.id, node.attr) in {("os", "environ"), ("os", "getenv")}
    ]
    assert not offenders


HEAVY = {"mujoco", "pxr", "pybullet", "warp"} | {"matplotlib", "pandas", "pyarrow", "rich", "torch"}
HEAVY |= {"networkx", "PIL", "scipy", "trimesh"}
"""Libraries that take a tenth of a second or more, or belong to a worker."""


def output_of(program: str, *arguments: str) -> list[str]:
    """Lines that a program prints; the last one lists the libraries that it imports."""
    report = (
        "import sys\nbefore = set(sys.modules)\n"
        f"{program}\n"
        "loaded = {name.partition('.')[0] for name in set(sys.modules) - before}\n"
        "public = {name for name in loaded if not name.startswith('_')}\n"
        "print('LOADED', *sorted(public - sys.stdlib_module_names))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", report, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        env=environment(),
    )
    return done.stdout.splitlines()


def test_help_imports_click_and_nothing_else() -> None:
    """``gen-data --help`` answers at once because it loads no library but its own parser."""
    program = "from gen_data.cli.main import main\ntry:\n    main()\nexcept SystemExit:\n    pass"

    *shown, loaded = output_of(program, "--help")

    assert "--config" in "\n".join(shown)
    assert loaded == "LOADED click gen_data"


def test_nothing_is_imported_before_the_first_worker_prepares_itself() -> None:
    """A worker's imports take longest, and begin when the command has read its arguments."""
    program = "import gen_data.cli.generate_command\nimport gen_data.runner.processes"

    assert output_of(program)[-1] == "LOADED click gen_data"


def test_planning_a_tabletop_loads_no_engine() -> None:
    """The command reads, checks and plans; physics, rendering and tables belong to workers."""
    program = (
        "from gen_data.assemble.config import load_config\n"
        "from gen_data.assemble.pipeline_factory import PipelineFactory\n"
        "from gen_data.runner.identity import make_plan\n"
        "from gen_data.runner import run\n"
        "factory = PipelineFactory(load_config('tabletop.yaml'), n=1)\n"
        "factory.check()\n"
        "make_plan(factory)"
    )

    loaded = set(output_of(program)[-1].split())

    assert {"numpy", "pydantic"} <= loaded
    assert loaded & HEAVY == set()


def test_no_test_measures_the_wall_clock() -> None:
    """A busy machine fails no test: instants are compared with deadlines, never subtracted."""
    clocks = {("time", name) for name in ("time", "monotonic", "perf_counter")}
    offenders = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in python_files("tests")
        if any(f"time.{name}" in (source := path.read_text()) for _, name in clocks)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub)
        for call in ast.walk(node.left)
        if isinstance(call, ast.Call)
        and isinstance(call.func, ast.Attribute)
        and isinstance(call.func.value, ast.Name)
        and (call.func.value.id, call.func.attr) in clocks
    ]
    assert not offenders
