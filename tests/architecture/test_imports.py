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


GENERATOR = "gen_data.generator"
CONTENT = tuple(
    f"{GENERATOR}.{name}"
    for name in (
        *(f"assets.{part}" for part in ("interiors", "people", "procedural", "roads", "scenery")),
        *("assets.skies", "assets.vehicles", "packs.example_robot_data", "packs.mjcf"),
        *("packs.panoramas", "packs.pybullet_files", "packs.robosuite", "packs.sweethome3d"),
    )
)
"""Families and packs, which the core finds in the tables of ``generator/content``."""
CORE = tuple(
    f"{GENERATOR}.assets.{name}"
    for name in (
        *("procedural.data_tables", "procedural.family", "procedural.noise"),
        *("procedural.variant_rng", "skies.clouds", "skies.daylight", "skies.equirectangular"),
        "skies.sky",
    )
)
"""Modules among them that belong to the core."""


LABORATORY = tuple(
    f"{GENERATOR}.{name}" for name in ("certificate", "environment", "matching", "study")
)
"""Tools on top of the core, which finds their commands in tables of names."""


def is_below(name: str, packages: tuple[str, ...]) -> bool:
    """Whether a module is one of some packages or in one."""
    return any(name == package or name.startswith(f"{package}.") for package in packages)


def is_content(name: str) -> bool:
    """Whether a module belongs to the content."""
    return is_below(name, CONTENT) and not is_below(name, CORE)


def test_the_core_imports_no_content() -> None:
    """A new family changes no file outside the content."""
    found = [
        f"{name} -> {other}"
        for name, others in sorted(imports().items())
        if not is_content(name)
        for other in sorted(others)
        if is_content(other)
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
