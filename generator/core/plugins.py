"""Plug-in tables: a name in YAML -> ``module:Class``, imported on first use."""

import importlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar

from gen_data.core.errors import ConfigError, one_of

P = TypeVar("P")
"""The Protocol that the plug-ins of a table implement."""


@dataclass(frozen=True)
class PluginTable(Generic[P]):
    """All plug-ins of one kind.

    Third-party packages add to a table through the entry-point group ``gen_data.<kind>``;
    a built-in name wins over an equal third-party name.

    Attributes:
        kind: Kind of the plug-ins, in the singular: ``randomizer``.
        entries: ``{name: "module:Class"}``.
        protocols: A plug-in has every member of at least one of these.
        tag: Field that holds the plug-in's own name.
    """

    kind: str
    entries: Mapping[str, str]
    protocols: tuple[type[object], ...] = ()
    tag: str = "type"

    def names(self) -> tuple[str, ...]:
        """Every known name, sorted."""
        return tuple(sorted({**third_party(self.kind), **self.entries}))

    def __iter__(self) -> Iterator[str]:
        """Names, sorted."""
        return iter(self.names())

    def __contains__(self, name: object) -> bool:
        """Whether the name is known."""
        return name in self.entries or name in third_party(self.kind)

    def load(self, name: str) -> type[P]:
        """The class that ``name`` stands for.

        Raises:
            ConfigError: if the name is unknown, or its class is not a plug-in of this kind.
        """
        if name not in self:
            known = self.names()
            raise ConfigError(f"unknown {self.kind} {name[:60]!r}; {one_of(name, known)}")
        path = self.entries.get(name) or third_party(self.kind)[name].value
        plugin: type[P] = loaded(path, f"{self.kind} '{name}'")
        fault = self._fault(plugin, name)
        if fault:
            raise ConfigError(f"{self.kind} '{name}': {path} {fault}")
        return plugin

    def _fault(self, plugin: type[P], name: str) -> str:
        """Why a class is not a plug-in of this kind; empty if it is one."""
        if not self.protocols:
            return ""
        if not hasattr(plugin, "model_validate_json"):
            return "cannot be read from YAML: derive it from gen_data.config.base_model.Strict"
        own = {m for base in plugin.__mro__ for m in (*vars(base), *_annotations(base))}
        lacking: list[list[str]] = [sorted(_members(protocol) - own) for protocol in self.protocols]
        if all(lacking):
            fewest = min(lacking, key=len)
            protocol = self.protocols[lacking.index(fewest)]
            return f"lacks {', '.join(fewest)}; see gen_data.core.interfaces.{protocol.__name__}"
        if f"'{name}'" not in str(_field_type(plugin, self.tag)).replace('"', "'"):
            return f"""needs a field `{self.tag}: Literal["{name}"] = "{name}"`"""
        return ""


def loaded(path: str, what: str) -> Any:
    """The object at ``module:Name``.

    Raises:
        ConfigError: there is none; the message begins with the subject ``what``.
    """
    module, _, attribute = path.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise ConfigError(f"{what}: {path} cannot be imported: {error}") from error


@cache
def third_party(kind: str) -> Mapping[str, EntryPoint]:
    """Entry points of the group ``gen_data.<kind>``, by name."""
    # Reading the metadata of every installed package takes milliseconds; it cannot change.
    return {e.name: e for e in entry_points(group=f"gen_data.{kind}")}


def package_of(entry: EntryPoint) -> str:
    """Name and version of the package that an entry point is from, with a space between."""
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist is not None else "unknown 0"


def _members(protocol: type[object]) -> set[str]:
    """Public names that a Protocol declares, its bases' included."""
    declared = {
        member
        for base in protocol.__mro__
        if base not in (object, Generic) and base.__module__ != "typing"
        for member in (*vars(base), *_annotations(base))
    }
    return {m for m in declared if m == "__call__" or not m.startswith("_")}


def _annotations(base: type) -> Mapping[str, object]:
    found: Mapping[str, object] = vars(base).get("__annotations__", {})
    return found


def _field_type(plugin: type, field: str) -> object:
    """Annotation of a field, of the most derived class that has one; None if there is none."""
    found = (_annotations(base)[field] for base in plugin.__mro__ if field in _annotations(base))
    return next(found, None)
