"""Names in randomizers are compared with the scene and the assets before a run."""

from __future__ import annotations

from collections.abc import Sequence

from gen_data.generator.assemble.config import Config
from gen_data.generator.config.problems import Position, Problems
from gen_data.generator.config.yaml_tree import Node
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Scene
from gen_data.randomizers.base import RandomizerBase


def check_references(spec: Config, scenes: Sequence[Scene], assets: AssetIndex) -> None:
    """Refuse randomizers whose fields name a group, category or texture that does not exist.

    Args:
        spec: The configuration.
        scenes: The nominal scene of each of its probes.
        assets: The library.

    Raises:
        ConfigError: one or more do; each is reported with its place.
    """
    problems = Problems()
    for probe, scene in zip(spec.probes, scenes, strict=True):
        for number, randomizer in enumerate(probe.randomizers):
            if not isinstance(randomizer, RandomizerBase):
                continue
            try:
                randomizer.check(scene, assets)
            except ConfigError as error:
                path, _, fact = str(error).partition(": ")
                field = path.removeprefix(f"randomizers.{randomizer.name}.")
                position = _find_position(spec.document, number, field)
                problems.add(position, f"randomizers[{number}].{field}", fact)
    problems.raise_if_any()


def _find_position(document: Node, number: int, field: str) -> Position:
    """Of a field of a randomizer; of the randomizer where the field is not written."""
    paths: tuple[tuple[str | int, ...], ...] = (
        ("randomizers", number, field),
        ("randomizers", number),
        ("randomizers",),
    )
    found = (document.get(*path) for path in paths)
    return next((node.position for node in found if node is not None), document.position)
