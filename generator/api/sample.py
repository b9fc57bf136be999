"""Samples of the Python API: images, boxes and points by sensor name."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from gen_data.core import boxes, errors, se3
from gen_data.core.capture import Capture, Channel, PointCloud, SensorReading
from gen_data.core.sample import EgoTruth, ImageTruth, ObjectTruth, image_number
from gen_data.core.scene import Scene

T = TypeVar("T")


class ByName(Mapping[str, T], Generic[T]):
    """A read-only mapping whose missing names are reported with the names that exist."""

    def __init__(self, kind: str, values: Mapping[str, T]) -> None:
        self._kind = kind
        self._values = values

    def __getitem__(self, name: str) -> T:
        """Return the value of a name.

        Raises:
            UnknownNameError: there is none; it is also a KeyError.
        """
        if name not in self._values:
            names = ", ".join(self._values) or "none"
            raise errors.UnknownNameError(
                f"there is no {self._kind} '{name}'; expected one of: {names}"
                f"{errors.did_you_mean(str(name), self._values)}"
            )
        return self._values[name]

    def __contains__(self, name: object) -> bool:
        """Whether there is such a name; decodes nothing."""
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        """The names, in order."""
        return iter(self._values)

    def __len__(self) -> int:
        """Number of entries."""
        return len(self._values)

    def __repr__(self) -> str:
        """As a dictionary."""
        return repr(dict(self._values))


@dataclass(frozen=True, slots=True)
class Box2d:
    """The tight box around the visible pixels of an object.

    Attributes:
        category: Name.
        category_id: From 1, in the sorted order of the data set's categories.
        instance_id: Value of the object's pixels in ``CameraReading.instance_ids``.
        x_min, y_min, x_max, y_max: Half-open, in pixels: ``width = x_max - x_min``.
        visible_fraction: Visible share of the whole silhouette; None without the annotation
            ``visibility``.
    """

    category: str
    category_id: int
    instance_id: int
    x_min: int
    y_min: int
    x_max: int
    y_max: int
    visible_fraction: float | None = None

    @property
    def xyxy(self) -> tuple[int, int, int, int]:
        """Corners, in torchvision's order."""
        return self.x_min, self.y_min, self.x_max, self.y_max

    @property
    def xywh(self) -> tuple[int, int, int, int]:
        """Corner and size, in COCO's order."""
        return self.x_min, self.y_min, self.x_max - self.x_min, self.y_max - self.y_min


@dataclass(frozen=True, slots=True)
class Box3d:
    """The oriented box around an object.

    Attributes:
        category, category_id, instance_id: As for Box2d.
        box: In the world frame; ``box.corners()`` are its corners [m], shape [8, 3].
        box_camera: In the camera frame.
    """

    category: str
    category_id: int
    instance_id: int
    box: boxes.OrientedBox
    box_camera: boxes.OrientedBox | None = None


class CameraReading:
    """Images of one camera with their annotations.

    Arrays are [height, width, ...]; CONVENTIONS.md lists their values for "nothing".
    """

    def __init__(self, reading: SensorReading, truth: ImageTruth) -> None:
        self._reading = reading
        self._truth = truth

    @property
    def name(self) -> str:
        """The sensor's name."""
        return self._reading.sensor

    @property
    def channels(self) -> Mapping[str, NDArray[Any]]:
        """Images by channel name, such as ``normals``; decoded on access."""
        return ByName("channel", _ChannelNames(self._reading.channels))

    @property
    def rgb(self) -> NDArray[np.uint8]:
        """Colour image in sRGB, uint8 [height, width, 3]."""
        return self.channels["rgb"]

    @property
    def depth_m(self) -> NDArray[np.float32]:
        """Distance along the optical axis [m], float32 [height, width]; inf where there is none."""
        return self.channels["depth"]

    @property
    def instance_ids(self) -> NDArray[np.uint16]:
        """Instance id of each pixel, uint16 [height, width]; 0 where nothing was hit."""
        return self.channels["instance"]

    @property
    def category_ids(self) -> NDArray[np.uint16]:
        """Category id of each pixel, uint16 [height, width]; 0 where nothing was hit."""
        return self.channels["category"]

    @property
    def objects(self) -> tuple[ObjectTruth, ...]:
        """All annotations of all instances in the image, in the order of their ids."""
        return self._truth.objects

    @property
    def truth(self) -> ImageTruth:
        """All annotations of the image, including annotations of the whole image."""
        return self._truth

    @cached_property
    def boxes2d(self) -> tuple[Box2d, ...]:
        """Boxes of the annotated objects with a visible pixel, without ignored ones."""
        return tuple(
            Box2d(*_identity(item), *_corners(item.box), item.visible_fraction)
            for item in self._counting
            if item.box is not None
        )

    @cached_property
    def boxes3d(self) -> tuple[Box3d, ...]:
        """Oriented boxes of the annotated objects; empty without the annotation ``boxes3d``."""
        return tuple(
            Box3d(*_identity(item), item.box3d_world, item.box3d_camera)
            for item in self._counting
            if item.box3d_world is not None
        )

    @property
    def _counting(self) -> Iterator[ObjectTruth]:
        """Annotated objects that no label map ignores."""
        return (t for t in self._truth.objects if t.instance.annotated and not t.ignored)

    @property
    def K(self) -> se3.Array:  # noqa: N802
        """Intrinsic matrix, float64 [3, 3]; pixel ``i`` has its centre at ``i + 0.5``."""
        return self._reading.camera.intrinsics.matrix()

    @property
    def T_world_camera(self) -> se3.Array:  # noqa: N802
        """Transform from camera (X right, Y down, Z forward) to world, float64 [4, 4], metres."""
        return self._truth.camera.T_world_camera.matrix()

    @property
    def time_s(self) -> float:
        """Instant of depth, ids and boxes, from the start of the sequence [s]."""
        return self._reading.time_s

    @property
    def faults(self) -> Mapping[str, Any]:
        """True faults in the photograph, as plain data; empty without any."""
        return self._reading.faults

    @property
    def ev100(self) -> float | None:
        """Exposure value at ISO 100, set or metered; None without a colour image."""
        return self._reading.ev100

    def __repr__(self) -> str:
        """Name, channels and number of boxes."""
        names = ", ".join(channel.value for channel in self._reading.channels)
        return f"<CameraReading '{self.name}': {names}; {len(self.boxes2d)} boxes>"


class _ChannelNames(Mapping[str, NDArray[Any]]):
    """Images by the name of their channel."""

    def __init__(self, images: Mapping[Channel, NDArray[Any]]) -> None:
        self._images = images

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._images[Channel(name)]

    def __contains__(self, name: object) -> bool:
        return any(channel.value == name for channel in self._images)

    def __iter__(self) -> Iterator[str]:
        """The names, in order."""
        return (channel.value for channel in self._images)

    def __len__(self) -> int:
        return len(self._images)


class SampleRecord(Protocol):
    """The parts of a sample that the Python API shows; a stored sample reads them on access."""

    @property
    def index(self) -> int:
        """Number in the data set, from 0."""
        ...

    @property
    def split(self) -> str:
        """``train``, ``val`` or ``test``."""
        ...

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of all cameras of the data set."""
        ...

    @property
    def scene(self) -> Scene:
        """The world."""
        ...

    @property
    def capture(self) -> Capture:
        """Readings of all sensors."""
        ...

    @property
    def truth(self) -> Mapping[str, ImageTruth]:
        """Annotations by camera."""
        ...

    @property
    def frame(self) -> EgoTruth | None:
        """Annotations of the sample as a whole."""
        ...


class SampleSource(Protocol):
    """Source of the samples of a sequence."""

    def sample(self, index: int) -> SampleRecord:
        """Return the sample of that number."""
        ...

    @property
    def categories(self) -> tuple[str, ...]:
        """Sorted names; category id ``k`` is ``categories[k - 1]``."""
        ...

    @property
    def config(self) -> Mapping[str, Any]:
        """The resolved configuration as plain values."""
        ...

    def close(self) -> None:
        """Release the engines; a later call of ``sample`` restarts them."""
        ...


class Sample:
    """One element of a data set, generated or read from disk.

    Attributes:
        core: The sample as the generator's internal record.
    """

    def __init__(self, core: SampleRecord) -> None:
        self.core = core

    @property
    def index(self) -> int:
        """Number in the data set, from 0."""
        return self.core.index

    @property
    def split(self) -> str:
        """``train``, ``val`` or ``test``: the same for all views of a scene."""
        return self.core.split

    @property
    def scene(self) -> Scene:
        """The complete, frozen world: bodies, instances, lights, cameras."""
        return self.core.scene

    @cached_property
    def cameras(self) -> Mapping[str, CameraReading]:
        """Cameras with a reading in this sample, by name."""
        readings, truth = self.core.capture.readings, self.core.truth
        return ByName(
            "camera", {name: CameraReading(readings[name], truth[name]) for name in truth}
        )

    def image_id(self, camera: str) -> int:
        """Number of a camera's image, from 1, unique in the data set: its id in the COCO export."""
        names = self.core.cameras or tuple(sorted(self.core.truth))
        return image_number(self.index, names, camera)

    @property
    def lidars(self) -> Mapping[str, PointCloud]:
        """Scans of the laser scanners with a reading in this sample, by name."""
        return ByName("laser scanner", self.core.capture.clouds)

    @property
    def measurements(self) -> Mapping[str, NDArray[np.void]]:
        """Records of radars, inertial units and all other devices, by name."""
        tables = self.core.capture.tables
        return ByName("device", {name: table.rows for name, table in tables.items()})

    @property
    def boxes2d(self) -> Mapping[str, tuple[Box2d, ...]]:
        """Boxes of the annotated objects with a visible pixel, by camera."""
        return self._by_camera(lambda camera: camera.boxes2d)

    @property
    def boxes3d(self) -> Mapping[str, tuple[Box3d, ...]]:
        """Oriented boxes of the annotated objects, by camera."""
        return self._by_camera(lambda camera: camera.boxes3d)

    @property
    def objects(self) -> Mapping[str, tuple[ObjectTruth, ...]]:
        """All annotations of all instances, by camera."""
        return self._by_camera(lambda camera: camera.objects)

    @property
    def ego(self) -> EgoTruth | None:
        """The ego vehicle's pose, motion and surroundings; None without such annotations."""
        return self.core.frame

    def _by_camera(self, read: Callable[[CameraReading], T]) -> Mapping[str, T]:
        return ByName("camera", {name: read(camera) for name, camera in self.cameras.items()})

    def __repr__(self) -> str:
        """Index, split and sensors."""
        sensors = ", ".join(_names(self.cameras, self.lidars, self.core.capture.tables))
        return f"<Sample {self.index} ({self.split}): {sensors}>"


def _names(*groups: Iterable[str]) -> list[str]:
    return [name for group in groups for name in group]


def _corners(box: boxes.BoxPx) -> tuple[int, int, int, int]:
    return box.x_min, box.y_min, box.x_max, box.y_max


def _identity(item: ObjectTruth) -> tuple[str, int, int]:
    return item.instance.category, item.instance.category_id, item.instance.instance_id
