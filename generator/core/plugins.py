"""Plug-in tables: a name in YAML -> ``module:Class``, imported when first asked for."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import Any

from generator.core.errors import ConfigError, did_you_mean


@dataclass(frozen=True)
class PluginTable:
    """All plug-ins of one kind.

    Third-party packages add to a table through the entry-point group ``gen_data.<kind>``;
    a name of our own wins over theirs.

    Attributes:
        kind: What the plug-ins are, in the singular: ``randomizer``.
        entries: ``{name: "module:Class"}``.
    """

    kind: str
    entries: dict[str, str]

    def names(self) -> tuple[str, ...]:
        """Every known name, sorted."""
        return tuple(sorted(self._all()))

    def __iter__(self) -> Iterator[str]:
        """Names, sorted."""
        return iter(self.names())

    def __contains__(self, name: object) -> bool:
        """Whether the name is known."""
        return name in self._all()

    def load(self, name: str) -> Any:
        """The class that ``name`` stands for.

        Raises:
            ConfigError: if the name is unknown.
        """
        known = self._all()
        if name not in known:
            raise ConfigError(
                f"unknown {self.kind} '{name}'; expected one of {', '.join(sorted(known))}"
                f"{did_you_mean(name, known)}"
            )
        module, _, attribute = known[name].partition(":")
        return getattr(importlib.import_module(module), attribute)

    def _all(self) -> dict[str, str]:
        return {**_third_party(self.kind), **self.entries}


@cache
def _third_party(kind: str) -> dict[str, str]:
    # Reading the metadata of every installed package takes milliseconds; it cannot change.
    return {e.name: e.value for e in entry_points(group=f"gen_data.{kind}")}
