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
