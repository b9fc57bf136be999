"""Base class of exporters, with defaults for the optional members of ``Exporter``."""

from __future__ import annotations

from typing import TypeVar

from gen_data.generator.config.base_model import Strict
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
