"""Base class of exporters, with defaults for the optional members of ``Exporter``."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TypeVar

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.interfaces import AssetLibrary, DatasetInfo

E = TypeVar("E", bound="ExporterBase")


class ExporterBase(Strict):
    """An exporter that needs no annotator and no geometry, and accepts any data set."""

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators that it reads."""
        return frozenset()

    @property
    def has_own_classes(self) -> bool:
        """Whether the format prescribes its classes; see ``Exporter``."""
        return False

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that the format cannot represent.

        Raises:
            ConfigError: the text names the missing sensor or channel.
        """
        del info

    def with_assets(self: E, assets: AssetLibrary) -> E:
        """Return the exporter for writing; formats with geometry keep the library."""
        del assets
        return self


def check_installed(exporter: str, **packages: str) -> None:
    """Reject a format whose writing library is absent.

    Args:
        exporter: Type of the exporter.
        packages: Names of packages by the modules that they install.

    Raises:
        ConfigError: a module is missing; the text names the remedy.
    """
    absent = sorted({name for module, name in packages.items() if find_spec(module) is None})
    if absent:
        noun = "package" if len(absent) == 1 else "packages"
        raise ConfigError(
            f"exporter '{exporter}' needs the {noun} {', '.join(absent)}: "
            "pip install 'gen-data[formats]'"
        )
