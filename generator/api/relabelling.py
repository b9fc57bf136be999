"""Samples whose labels a label map has changed."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from gen_data.api.config import read_document, read_model
from gen_data.api.sample import SampleRecord, SampleSource
from gen_data.core.capture import Capture, Channel, Measurements, PointCloud, SensorReading
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import EgoTruth, ImageTruth
from gen_data.core.scene import Scene

if TYPE_CHECKING:
    from gen_data.exporters.label_map import AppliedLabelMap, LabelMap

LabelMapLike = str | PathLike[str] | Mapping[str, Any]
"""A file with a label map, or its content."""


@dataclass(frozen=True, eq=False)
class RelabelledSample:
    """A sample with mapped labels; its images are the other sample's."""

    record: SampleRecord
    applied: "AppliedLabelMap"

    @property
    def index(self) -> int:
        """Number of the sample."""
        return self.record.index

    @property
    def split(self) -> str:
        """Its split."""
        return self.record.split

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of all cameras of the data set."""
        return self.record.cameras

    @cached_property
    def capture(self) -> Capture:
        """Readings of all sensors; category ids are the classes of instances."""
        from gen_data.exporters.point_cloud_io import class_facts, class_table, with_classes
        from gen_data.runner.stored import ReadOnAccess

        read = self.record.capture
        classes = class_facts(self.applied.info, self.scene).get("classes")
        if classes is None:
            return read

        def reading(name: str) -> SensorReading:
            found = read.readings[name]
            images = found.channels

            def image(channel: Channel) -> NDArray[Any]:
                if channel is not Channel.CATEGORY:
                    return images[channel]
                mapped: NDArray[Any] = class_table(classes)[images[Channel.INSTANCE]]
                return mapped

            # Category ids without instance ids are of other categories.
            kept = (c for c in images if c is not Channel.CATEGORY or Channel.INSTANCE in images)
            return replace(found, channels=ReadOnAccess(kept, image))

        def cloud(name: str) -> PointCloud:
            found = read.clouds[name]
            return replace(found, points=with_classes(found.points, classes))

        def table(name: str) -> Measurements:
            found = read.tables[name]
            return replace(found, rows=with_classes(found.rows, classes))

        return Capture(
            ReadOnAccess(read.readings, reading),
            ReadOnAccess(read.clouds, cloud),
            ReadOnAccess(read.tables, table),
        )

    @property
    def frame(self) -> EgoTruth | None:
        """Annotations of the sample as a whole."""
        return self.record.frame

    @cached_property
    def truth(self) -> Mapping[str, ImageTruth]:
        """Mapped annotations by camera."""
        return {name: self.applied.map_image(t) for name, t in self.record.truth.items()}

    @cached_property
    def scene(self) -> Scene:
        """The world with mapped instances."""
        return self.applied.map_scene(self.record.scene)


@dataclass(frozen=True)
class RelabelledSamples:
    """Samples of another source, with mapped labels; picklable."""

    source: SampleSource
    label_map: "LabelMap"

    def sample(self, index: int) -> SampleRecord:
        """Return the sample of that number."""
        return RelabelledSample(self.source.sample(index), self._applied)

    @property
    def categories(self) -> tuple[str, ...]:
        """Names of the classes in the order of their ids."""
        return self._applied.info.categories

    @property
    def config(self) -> Mapping[str, Any]:
        """The resolved configuration of the source."""
        return self.source.config

    def close(self) -> None:
        """Release the engines of the source."""
        self.source.close()

    @cached_property
    def _applied(self) -> "AppliedLabelMap":
        from gen_data.exporters.label_map import AppliedLabelMap

        categories = self.source.categories
        self.label_map.check(categories)
        return AppliedLabelMap(self.label_map, DatasetInfo("", 0, 1, 1, categories, ()))


def load_label_map(source: LabelMapLike | None, config: Mapping[str, Any]) -> "LabelMap":
    """Read a label map; None = the configuration's.

    Raises:
        ConfigError: it is invalid, or the configuration has none.
    """
    from gen_data.exporters.label_map import LabelMap

    if source is None:
        own = (config.get("labels") or {}).get("map")
        if own is None:
            raise ConfigError("labels.map: the configuration has none; give a file or a mapping")
        source = own
    return read_model(read_document(source, "label map"), LabelMap)
