"""Defaults of the members of ``Exporter`` that not every format needs."""

from __future__ import annotations

from typing import TypeVar

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.interfaces import AssetLibrary, DatasetInfo

E = TypeVar("E", bound="ExporterBase")


class ExporterBase(Strict):
    """An exporter that reads no annotator's fields, holds any data set and needs no geometry."""

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators whose fields it reads."""
        return frozenset()

    def check(self, info: DatasetInfo) -> None:
        """Refuse a data set that the format cannot hold.

        Raises:
            ConfigError: naming what it lacks.
        """
        del info

    def with_assets(self: E, assets: AssetLibrary) -> E:
        """The exporter that writes; a format that holds geometry keeps the library."""
        del assets
        return self
