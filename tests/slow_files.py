"""Files with slow tests that CI runs for a commit: ``python -m tests.slow_files``.

All slow tests together take longer than CI has. It runs a fifth of their files, which the commit
decides, and all that changed within three hours of it: those of the same piece of work. So a file
runs with each change of its statements, and else in every fifth run. ``python -m pytest -m slow``
runs all.
"""

import ast
import re
import subprocess
import zlib
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).parents[1]
MARKED = re.compile(r"mark\.slow|tests\.tiers|needs_open3d")
SHARE = 5
"""One file of so many runs although it did not change."""
RECENT_S = 3 * 3600


def marked_files(folder: Path) -> list[str]:
    """Test files below a folder that may have slow tests, from its parent, in order."""
    found = [path for path in folder.rglob("test_*.py") if MARKED.search(path.read_text("utf-8"))]
    return sorted(path.relative_to(folder.parent).as_posix() for path in found)


def choose(files: Iterable[str], changed: Iterable[str], commit: str) -> list[str]:
    """The files of a commit's share, by their names, and the changed ones; ``commit`` is hex."""
    turn, always = int(commit, 16) % SHARE, set(changed)
    return [f for f in files if f in always or zlib.crc32(f.encode()) % SHARE == turn]


def changed_files(root: Path) -> list[str]:
    """Files that commits of the last hours before HEAD's changed, from the root.

    Files of Python whose comments and docstrings alone changed are left out.
    """
    at_s = int(_git(root, "log", "-1", "--format=%ct"))
    since = f"--since={at_s - RECENT_S}"
    names = set(_git(root, "log", since, "--name-only", "--format=", "HEAD").split())
    before = _git(root, "rev-list", "-1", f"--before={at_s - RECENT_S}", "HEAD").strip()
    if before:
        names &= set(_git(root, "diff", "--name-only", before, "HEAD").split())
    return [name for name in names if not (before and _has_equal_statements(root, before, name))]


def _has_equal_statements(root: Path, before: str, name: str) -> bool:
    """Whether a file of Python differs from an older commit's in comments and docstrings only."""
    if not name.endswith(".py"):
        return False
    try:
        old, new = (_git(root, "show", f"{commit}:{name}") for commit in (before, "HEAD"))
    except subprocess.CalledProcessError:
        return False  # It is new, or gone.
    return _statements(old) == _statements(new)


def _statements(text: str) -> str:
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [s for s in node.body if not _is_text(s)]
    return ast.dump(tree)


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _git(root: Path, *arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=root, check=True, capture_output=True, text=True)
    return done.stdout


if __name__ == "__main__":
    head = _git(ROOT, "rev-parse", "HEAD").strip()
    print(*choose(marked_files(ROOT / "tests"), changed_files(ROOT), head), sep="\n")
