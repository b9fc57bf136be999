"""Imports go one way, module by module: also imports in functions, and imports for types only.

``lint-imports`` checks layers, and circles of siblings; circles of a package and its own module
are left.
"""

from graphlib import CycleError, TopologicalSorter

import grimp


def test_no_modules_import_one_another_in_a_circle() -> None:
    """A circle can only be read, tested and loaded as a whole."""
    graph = grimp.build_graph("gen_data", cache_dir=None)
    imports = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    circle: list[str] = []
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        circle = error.args[1]
    assert not circle
