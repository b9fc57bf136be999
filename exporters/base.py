"""Base class of exporters, with defaults for the optional members of ``Exporter``."""

from __future__ import annotations

from typing import ClassVar, TypeVar, get_args

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.capture import Channel, ImageFormat
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.interfaces import AssetLibrary, DatasetInfo, Exporter
from gen_data.generator.core.optional_packages import missing_packages
from gen_data.generator.core.scene import Scene

PNG_ONLY = frozenset({"png"})
PNG_OR_JPEG = frozenset({"png", "jpeg"})
ANY_FORMAT: frozenset[str] = frozenset(get_args(ImageFormat))

E = TypeVar("E", bound="ExporterBase")


class ExporterBase(Strict):
    """An exporter that needs no annotator and no geometry, and accepts any data set."""

    image_formats: ClassVar[frozenset[str]] = PNG_ONLY
    """Formats of photographs that it can hold; see ``check_image_formats``."""

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

    def check_scene(self, scene: Scene) -> None:
        """Reject a data set by one of its scenes, before anything is generated or written.

        Raises:
            ConfigError: the text names the missing element.
        """
        del scene

    def with_assets(self: E, assets: AssetLibrary) -> E:
        """Return the exporter for writing; formats with geometry keep the library."""
        del assets
        return self


def check_image_formats(exporter: Exporter, info: DatasetInfo) -> None:
    """Reject photographs in files that a format cannot hold.

    Raises:
        ConfigError: the text names camera and remedy.
    """
    known: frozenset[str] = getattr(exporter, "image_formats", PNG_ONLY)
    for camera in info.cameras:
        used = info.encoding(camera, Channel.RGB).format
        if Channel.RGB in info.media[camera] and used not in known:
            raise ConfigError(
                f"exporter '{exporter.type}': camera '{camera}' writes {used} files, but the "
                f"exporter takes {', '.join(sorted(known))} only; change rgb_encoding of the "
                "sensor, or export in a format that takes them, such as coco, yolo or huggingface"
            )


def check_installed(exporter: str, *modules: str) -> None:
    """Reject a format whose writing library is absent.

    Args:
        exporter: Type of the exporter.
        modules: Names of the modules that it imports.

    Raises:
        ConfigError: a module is missing; the text names the remedy.
    """
    missing = missing_packages(*modules)
    if missing:
        raise ConfigError(f"exporter '{exporter}' {missing}")
