"""Imports go one way, module by module: also imports in functions, and imports for types only.

``lint-imports`` checks the layers of packages.
"""

from __future__ import annotations

from functools import cache
from graphlib import CycleError, TopologicalSorter

import grimp


@cache
def imports() -> dict[str, set[str]]:
    """Modules that each module of the package imports, anywhere in it."""
    graph = grimp.build_graph("gen_data", cache_dir=None)
    return {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}


def test_no_modules_import_one_another_in_a_circle() -> None:
    """A circle can only be read, tested and loaded as a whole."""
    circle: list[str] = []
    try:
        TopologicalSorter(imports()).prepare()
    except CycleError as error:
        circle = error.args[1]
    assert not circle


CONTENT = ("gen_data.content",)
"""Families and packs, which the core finds in the tables of ``content``."""
LABORATORY = ("gen_data.lab",)
"""Tools on top of the core, which finds their commands in tables of names."""


def is_below(name: str, packages: tuple[str, ...]) -> bool:
    """Whether a module is one of some packages or in one."""
    return any(name == package or name.startswith(f"{package}.") for package in packages)


def test_the_core_imports_no_content() -> None:
    """A new family changes no file outside the content."""
    found = [
        f"{name} -> {other}"
        for name, others in sorted(imports().items())
        if not is_below(name, (*CONTENT, *LABORATORY))
        for other in sorted(others)
        if is_below(other, CONTENT)
    ]
    assert not found


def test_the_core_imports_no_laboratory() -> None:
    """Only ``gen_data/__init__.py``, which offers the names of both, knows both."""
    found = [
        f"{name} -> {other}"
        for name, others in sorted(imports().items())
        if name != "gen_data" and not is_below(name, LABORATORY)
        for other in sorted(others)
        if is_below(other, LABORATORY)
    ]
    assert not found
