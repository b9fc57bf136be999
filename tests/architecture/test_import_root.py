"""One import root: the repository's folders are packages below ``gen_data`` and nothing else."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("configs", "content", "exporters", "generator", "lab", "randomizers", "scene_templates")
LINKS = {
    **{
        path.name: f"../generator/{path.name}"
        for path in sorted((ROOT / "generator").iterdir())
        if path.is_dir() and path.name != "__pycache__"
    },
    **{name: f"../{name}" for name in FOLDERS if name != "generator"},
}
"""Links in ``gen_data/`` and their targets: every package of the core, and the other folders."""
CODE = ("gen_data", *FOLDERS, "benchmarks", "tests")
IMPORT = re.compile(rf"\b(from|import)\b.*(?<![\w.])({'|'.join(FOLDERS)})\b")
"""A line that may import a folder by its bare name; only files with one are parsed."""


@pytest.mark.parametrize("name", LINKS)
def test_the_import_root_links_to_the_folder(name: str) -> None:
    """``gen_data/<package>`` is a relative link, so a checkout can lie anywhere.

    Type checkers and import graphs follow it; a checkout without symbolic links has a text there.
    """
    link = ROOT / "gen_data" / name
    target = link.readlink().as_posix() if link.is_symlink() else link.read_text()
    assert target == LINKS[name]


def test_no_source_imports_a_folder_by_its_bare_name() -> None:
    """A second name for a module would make two copies of its classes."""
    offenders = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for top in CODE
        for path in sorted((ROOT / top).rglob("*.py"))
        if IMPORT.search(source := path.read_text())
        for node in ast.walk(ast.parse(source))
        if {name.partition(".")[0] for name in _imported(node)} & set(FOLDERS)
    ]
    assert not offenders


@pytest.mark.slow
def test_a_sample_imports_no_folder_by_its_bare_name() -> None:
    """Tables of plug-ins, ``module:Class``, name modules below the import root too."""
    program = (
        "import sys\n"
        "from gen_data.cli.main import main\n"
        "sys.argv = ['gen-data', 'describe']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "from gen_data import exporters, randomizers, scene_templates\n"
        "from gen_data import annotations, renderers, sensors\n"
        "tables = (exporters, randomizers, scene_templates, annotations, renderers, sensors)\n"
        "for kinds in tables:\n"
        "    for kind in kinds.TABLE:\n        kinds.TABLE.load(kind)\n"
        f"bare = {{name.partition('.')[0] for name in sys.modules}} & set({FOLDERS!r})\n"
        "print('BARE', sorted(bare))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert "BARE []" in done.stdout


def _imported(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom) and node.module and not node.level:
        return [node.module]
    return []
