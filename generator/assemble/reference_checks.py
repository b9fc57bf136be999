"""Checks of the names in randomizers against the scene and the assets, before a run."""

from __future__ import annotations

from collections.abc import Sequence

from gen_data.generator.assemble.config import Config
from gen_data.generator.config.problems import Position, Problems
from gen_data.generator.config.yaml_tree import Node
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Scene
from gen_data.randomizers.base import RandomizerBase


def check_references(config: Config, scenes: Sequence[Scene], assets: AssetIndex) -> None:
    """Check that the groups, categories and textures that randomizers name exist.

    Args:
        config: The configuration.
        scenes: Nominal scene of each of its probes.
        assets: The library.

    Raises:
        ConfigError: some do not exist; each is reported with its position.
    """
    problems = Problems()
    for probe, scene in zip(config.probes, scenes, strict=True):
        for number, randomizer in enumerate(probe.randomizers):
            if not isinstance(randomizer, RandomizerBase):
                continue
            try:
                randomizer.check(scene, assets)
            except ConfigError as error:
                path, _, fact = str(error).partition(": ")
                field = path.removeprefix(f"randomizers.{randomizer.name}.")
                position = _find_position(config.document, number, field)
                problems.add(position, f"randomizers[{number}].{field}", fact)
    problems.raise_if_any()


def _find_position(document: Node, number: int, field: str) -> Position:
    """Position of a field of a randomizer; of the randomizer if the field has its default."""
    paths: tuple[tuple[str | int, ...], ...] = (
        ("randomizers", number, field),
        ("randomizers", number),
        ("randomizers",),
    )
    found = (document.get(*path) for path in paths)
    return next((node.position for node in found if node is not None), document.position)
