"""Base class of exporters, with defaults for the optional members of ``Exporter``."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import ClassVar, TypeVar, get_args

from pydantic import Field, PrivateAttr, model_validator

from gen_data.config.base_model import Strict
from gen_data.core import capture, errors, interfaces, optional_packages
from gen_data.core.scene import Scene
from gen_data.exporters.conventions import Conventions

PNG_ONLY = frozenset({"png"})
PNG_OR_JPEG = frozenset({"png", "jpeg"})
ANY_FORMAT: frozenset[str] = frozenset(get_args(capture.ImageFormat))

E = TypeVar("E", bound="ExporterBase")
A = TypeVar("A", bound="AssetExporter")
W = TypeVar("W", bound="WrappedExporter")


class Rectify(Strict):
    """Images of bent lenses rectified to pinholes of the same size and pose.

    By default the widest pinhole of less than 150 degrees with a centred principal point and the
    aspect of the pixels, whose every pixel the original shows.

    Attributes:
        hfov_deg: Horizontal field of view instead, of square pixels; pixels that the original does
            not show are black and without labels.
        keep_focal: Take focal lengths and principal point of the lens, without its distortion;
            pixels that the original does not show are black and without labels.
    """

    hfov_deg: float | None = Field(None, gt=0.0, lt=175.0)
    keep_focal: bool = False

    @model_validator(mode="after")
    def _has_one_choice(self) -> "Rectify":
        if self.keep_focal and self.hfov_deg is not None:
            raise ValueError("give hfov_deg or keep_focal, not both")
        return self


class ExporterBase(Strict):
    """An exporter that needs no annotator and no geometry, and accepts any data set.

    Attributes:
        cameras: Names of the cameras to export, or patterns such as ``front_*``; empty = all.
        sensors: Names or patterns of the other sensors to export: laser scanners, radars, IMUs;
            empty = all.
        rectify: Replace images and labels of bent lenses by pinholes' ones: ``true``, or
            ``{hfov_deg: 90}`` for a horizontal field of view [degrees], or ``{keep_focal: true}``
            for the focal lengths of the lens. Texts about images cannot be rectified.
    """

    cameras: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()
    rectify: bool | Rectify = False

    conventions: ClassVar[Conventions]
    """Meaning of its numbers; every exporter of the project states it."""

    image_formats: ClassVar[frozenset[str]] = PNG_ONLY
    """Formats of photographs that it can hold; see ``check_image_formats``."""

    annotators: ClassVar[frozenset[str]] = frozenset()
    """Names of the annotators that it reads, whatever its fields are."""

    holds_twice: ClassVar[bool] = False
    """Whether it can hold a doubled reading twice; see ``check_delivery``."""

    shows_truth: ClassVar[bool] = False
    """Whether it shows the world as it is, also readings that are lost."""

    own_classes: ClassVar[bool] = False
    """Whether the format prescribes its classes, whatever its fields are; see ``Exporter``."""

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators that it reads."""
        return self.annotators

    @property
    def has_own_classes(self) -> bool:
        """Whether the format prescribes its classes; see ``Exporter``."""
        return self.own_classes

    def check(self, info: interfaces.DatasetInfo) -> None:
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

    def with_assets(self: E, assets: interfaces.AssetLibrary) -> E:
        """Return the exporter for writing; formats with geometry keep the library."""
        del assets
        return self


class AssetExporter(ExporterBase):
    """An exporter that reads the library of assets while it writes."""

    _assets: interfaces.AssetLibrary | None = PrivateAttr(None)

    def with_assets(self: A, assets: interfaces.AssetLibrary) -> A:
        """Return the exporter with a library."""
        bound = self.model_copy()
        bound._assets = assets
        return bound

    @property
    def library(self) -> interfaces.AssetLibrary:
        """The library of ``with_assets``."""
        assert self._assets is not None, "call with_assets first"
        return self._assets


@dataclass(frozen=True)
class WrappedExporter:
    """An exporter that shows another one a data set with changes; other members are its own.

    Attributes:
        exporter: The other one.
    """

    exporter: interfaces.Exporter

    @property
    def type(self) -> str:
        """Name of the exporter."""
        return self.exporter.type

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators that it reads."""
        return self.exporter.needs

    @property
    def has_own_classes(self) -> bool:
        """Whether the format prescribes its classes."""
        return self.exporter.has_own_classes

    def check(self, info: interfaces.DatasetInfo) -> None:
        """Refuse as the exporter does."""
        self.exporter.check(info)

    def with_assets(self: W, assets: interfaces.AssetLibrary) -> W:
        """Return the exporter with a library."""
        return replace(self, exporter=self.exporter.with_assets(assets))


def check_classes(exporter: str, info: interfaces.DatasetInfo, known: Collection[str]) -> None:
    """Reject a data set without a single object that a format has a class for.

    Args:
        exporter: Its name.
        info: Facts about the data set.
        known: Categories with a class; case and underscores do not count.

    Raises:
        ConfigError: the text names them.
    """
    if not {*map(_plain, known)} & {*map(_plain, info.categories)}:
        raise errors.ConfigError(
            f"exporter '{exporter}': no category of the data set has a class in this format; "
            f"expected at least one of: {', '.join(known)}. Use coco for other categories"
        )


def check_distinct(
    exporter: str, info: interfaces.DatasetInfo, written: Callable[[str], str]
) -> None:
    """Reject categories that a format writes alike, whose objects readers would mix up.

    Args:
        exporter: Its name.
        info: Facts about the data set.
        written: The form of a category in the files.

    Raises:
        ConfigError: the text names two of them.
    """
    seen: dict[str, str] = {}
    for category in info.categories:
        other = seen.setdefault(written(category), category)
        if other != category:
            raise errors.ConfigError(
                f"exporter '{exporter}': the categories '{other}' and '{category}' are both "
                f"'{written(category)}' in its files; rename one, or merge them by a label map"
            )


def _plain(category: str) -> str:
    return category.lower().replace("_", " ")


def check_image_formats(exporter: interfaces.Exporter, info: interfaces.DatasetInfo) -> None:
    """Reject photographs in files that a format cannot hold.

    Raises:
        ConfigError: the text names camera and remedy.
    """
    known: frozenset[str] = getattr(exporter, "image_formats", PNG_ONLY)
    for camera in info.cameras:
        used = info.encoding(camera, capture.Channel.RGB).format
        if capture.Channel.RGB in info.media[camera] and used not in known:
            raise errors.ConfigError(
                f"exporter '{exporter.type}': camera '{camera}' writes {used} files, but the "
                f"exporter takes {', '.join(sorted(known))} only; change rgb_encoding of the "
                "sensor, or export in a format that takes them, such as coco, yolo or huggingface"
            )


def check_delivery(exporter: interfaces.Exporter, info: interfaces.DatasetInfo) -> None:
    """Reject lost or doubled readings that a format cannot express.

    A lost reading is missing, as of a sensor that does not read at a step. Most formats hold one
    reading of a sensor per sample. Rows of devices are lost and doubled in their files already.

    Raises:
        ConfigError: the text names sensor and remedy.
    """
    if getattr(exporter, "shows_truth", False):
        return
    place = f"exporter '{exporter.type}': sensor '{{}}': faults.delivery.{{}}: {{}}; set it to 0"
    for sensor in info.sensors:
        if "lost" in sensor.faults and sensor.channels and "language" in exporter.needs:
            fact = "texts may be about two images, of which one may be lost"
            raise errors.ConfigError(place.format(sensor.name, "lost", fact))
        if "doubled" in sensor.faults and sensor.modality in _held_once(exporter):
            remedy = (
                ", leave the sensor out with the field cameras or sensors of the exporter, or "
                "export mcap"
            )
            fact = "the format holds a reading once"
            raise errors.ConfigError(place.format(sensor.name, "doubled", fact) + remedy)


def _held_once(exporter: interfaces.Exporter) -> set[interfaces.Modality]:
    """Kinds of sensors of which a format holds no reading twice."""
    if getattr(exporter, "holds_twice", False):
        return set()
    stated: Conventions | None = getattr(exporter, "conventions", None)
    kinds = set()
    if stated is None or stated.pixel_centre or stated.box or stated.lens:
        kinds.add(interfaces.Modality.CAMERA)
    if stated is None or stated.ring or stated.intensity or hasattr(exporter, "lidar"):
        kinds.add(interfaces.Modality.LIDAR)
    return kinds


def select_names(patterns: Sequence[str], known: Sequence[str], place: str) -> tuple[str, ...]:
    """Names that fit some pattern, in the order of the patterns; all if there is no pattern.

    Args:
        patterns: Names, or patterns with ``*``, ``?`` and ``[...]``.
        known: Names to select from.
        place: The field, for messages.

    Raises:
        ConfigError: a pattern fits no name.
    """
    found: dict[str, None] = {}
    for pattern in patterns:
        fitting = [name for name in known if fnmatchcase(name, pattern)]
        if not fitting:
            raise errors.ConfigError(
                f"{place}: '{pattern}' fits no sensor of the data set; expected some of: "
                f"{errors.list_names(known) or 'none'}{errors.did_you_mean(pattern, known)}"
            )
        found |= dict.fromkeys(fitting)
    return tuple(found if patterns else known)


def check_installed(exporter: str, *modules: str) -> None:
    """Reject a format whose writing library is absent.

    Args:
        exporter: Type of the exporter.
        modules: Names of the modules that it imports.

    Raises:
        ConfigError: a module is missing; the text names the remedy.
    """
    missing = optional_packages.missing_packages(*modules)
    if missing:
        raise errors.ConfigError(f"exporter '{exporter}' {missing}")
