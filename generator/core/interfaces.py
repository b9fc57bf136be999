"""The seams: everything that the assembly, the runner and the pipeline use of a plug-in.

How a plug-in is made
---------------------
A plug-in is a class that is named in the ``TABLE`` of its package, or by an entry point of the
group ``gen_data.<kind>``. Classes of the kinds ``element``, ``randomizer``, ``sensor``,
``annotation``, ``exporter`` and ``renderer`` derive from
``gen_data.generator.config.base_model.Strict``: their fields are the keys of their entry in YAML,
and instances are made by validation of that entry. The field ``type`` is ``Literal["<name in the
table>"]`` (``renderer`` instead of ``type`` for a renderer) with the name as its default. Instances
are frozen, picklable, and made before any engine is opened, so loading their module imports no
heavy library.

Every member of a Protocol below is required. Bases supply those that few plug-ins need:
``gen_data.randomizers.base.RandomizerBase``, ``gen_data.scene_templates.element.Element``,
``gen_data.generator.sensors.mounting.Mounted`` and ``Instrument``,
``gen_data.exporters.base.ExporterBase``. A class that lacks a member is refused when it is loaded.

The kind ``asset_family`` differs: its entry points name instances of
``gen_data.generator.assets.procedural.family.Family``, ``TextureFamily`` or ``EnvironmentFamily``.

Randomizers get no engine, annotators get no rng, exporters see one shard and compute ids instead
of counting: forbidden operations are impossible, not merely discouraged.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import TracebackType
from typing import Protocol, runtime_checkable

from gen_data.generator.core.asset_types import (
    Asset,
    ConvexParts,
    Float32,
    Keypoint,
    Material,
    MeshData,
    RobotModel,
    TextureData,
)
from gen_data.generator.core.capture import (
    Channel,
    LidarHits,
    LidarRays,
    Measurements,
    PointCloud,
    SensorReading,
)
from gen_data.generator.core.errors import Rejection
from gen_data.generator.core.lens import LensModel
from gen_data.generator.core.measurement_dtypes import Column
from gen_data.generator.core.sample import EgoTruth, ImageTruth, ObjectTruth, Sample
from gen_data.generator.core.scene import Camera, Lane, Lidar, Scene, StageModel
from gen_data.generator.core.se3 import Vec3
from gen_data.generator.core.streams import Rng


class Stage(str, Enum):
    """When a randomizer runs."""

    BUILD = "scene"
    """Once per scene, before physics."""
    VIEW = "view"
    """Once per view, after physics."""


class AssetIndex(Protocol):
    """What there is, without geometry."""

    def get(self, asset_id: str) -> Asset:
        """The entry of that id. Raises AssetError with the nearest ids if unknown."""
        ...

    def find(self, tags: Iterable[str], kind: str = "object") -> tuple[Asset, ...]:
        """All assets of the kind that carry every tag, sorted by id; may be empty."""
        ...

    def materials(self, asset_id: str) -> tuple[Material, ...]:
        """The asset's own materials, one per mesh slot."""
        ...

    def bounds_m(self, asset_id: str) -> tuple[Vec3, Vec3]:
        """Smallest and largest coordinates of the asset's mesh in its own frame [m]."""
        ...

    def keypoints(self, asset_id: str) -> tuple[Keypoint, ...]:
        """Named points of the asset, in its own frame; empty if it has none."""
        ...

    def lanes(self, asset_id: str) -> tuple[Lane, ...]:
        """Lanes of a road network, in its own frame; empty for anything else."""
        ...

    def robot(self, asset_id: str) -> RobotModel:
        """Kinematics of a robot. Raises AssetError if the asset is no robot."""
        ...

    def stage(self, asset_id: str) -> StageModel:
        """What a stage file holds. Raises AssetError if the asset is no stage."""
        ...


class AssetLibrary(AssetIndex, Protocol):
    """The index, and the geometry behind it; everything is cached by content hash."""

    def __hash__(self) -> int:
        """Of its identity: what is worked out from its geometry may be remembered with it."""
        ...

    def mesh(self, asset_id: str) -> MeshData:
        """Visual geometry. Also for robot links: ``franka_panda/panda_link3``."""
        ...

    def convex_parts(self, asset_id: str) -> ConvexParts:
        """Collision geometry."""
        ...

    def texture(self, texture_id: str) -> TextureData:
        """Images of a texture."""
        ...

    def environment(self, environment_id: str) -> Float32:
        """Equirectangular relative radiance, linear RGB, mean luminance 1, float32 [h, 2h, 3].

        Row 0 is the zenith; column 0 is the direction -X, the centre column is +X, and columns
        grow clockwise seen from above (towards -Y).
        """
        ...


class Element(Protocol):
    """One line of a template. Draws nothing: every scene of a template has the same elements."""

    @property
    def name(self) -> str:
        """Instance name from the YAML; unique in the template."""
        ...

    @property
    def follows_others(self) -> bool:
        """Whether it is added after the elements that do not, whatever the order of the lines.

        For groups of objects, which keep clear of everything that stands on their surfaces.
        """
        ...

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """A new scene with this element at its nominal place.

        Raises:
            ConfigError: a relation names nothing, or cannot hold.
        """
        ...


class Randomizer(Protocol):
    """Frozen parameters and one pure method."""

    @property
    def name(self) -> str:
        """Instance name from the YAML: the key of its random stream."""
        ...

    @property
    def stage(self) -> str:
        """When it runs: the value of a Stage."""
        ...

    @property
    def motion_duration_s(self) -> float | None:
        """How long the motion that it draws lasts, from time 0 [s]; None if it draws none.

        Sequences that are longer are refused.
        """
        ...

    def possible_assets(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of the assets that only it may bring into a scene; they are part of the plan.

        Assets of nominal bodies and of object groups are known without it.
        """
        ...

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """A new scene; the given one stays as it is.

        Raises:
            LayoutRejected: this draw cannot be carried out; the next attempt may.
            ConfigError: no draw can.
        """
        ...


@dataclass(frozen=True, slots=True)
class Settled:
    """A scene at rest, or why it was refused.

    Attributes:
        scene: All poses rounded and frozen; robot links placed.
        rejection: None when the scene is good.
    """

    scene: Scene
    rejection: Rejection | None = None


class PhysicsEngine(Protocol):
    """Settles bodies and moves arms. A pure function of the scene: no memory between calls."""

    def __enter__(self) -> PhysicsEngine:
        """Start the engine."""
        ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Release everything the engine holds."""
        ...

    def settle(self, scene: Scene) -> Settled:
        """The scene at rest."""
        ...


class Renderer(Protocol):
    """Light and rays. A pure function of its arguments; it may cache assets."""

    def render(self, scene: Scene, camera: Camera, channels: frozenset[Channel]) -> SensorReading:
        """Every requested channel of one camera, with the type and values listed at ``Channel``.

        The reading's ``sensor`` is the camera's name. ``AMODAL`` fills its ``silhouettes`` instead
        of its ``channels``. Renderers end at ``RADIANCE``: cameras develop ``RGB`` from it and set
        ``ev100``.
        """
        ...

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        """The first surface on every ray of a laser scanner's beams, and how well it reflects."""
        ...


class RendererSettings(Protocol):
    """The section ``render:`` as one renderer reads it: its plug-in class."""

    def open(self, assets: AssetLibrary) -> Renderer:
        """A renderer with these settings.

        Raises:
            ConfigError: this machine cannot render so.
        """
        ...


class Modality(str, Enum):
    """The form of a sensor's readings."""

    CAMERA = "camera"
    """Images: ``SensorReading``. The sensor is among ``Scene.cameras``."""
    LIDAR = "lidar"
    """Points: ``PointCloud``. The sensor is among ``Scene.lidars``."""
    DEVICE = "device"
    """Rows of numbers: ``Measurements``. The sensor is among ``Scene.devices``."""


@dataclass(frozen=True, slots=True)
class SensorInfo:
    """Self-description of one sensor; the same for all scenes.

    Attributes:
        name: Instance name from the YAML.
        modality: The form of its readings.
        kind: Of a device: ``Device.kind``, such as ``radar``; empty for the others.
        channels: Of a camera: channels that are written as images, in the order of ``Channel``.
        lens: Of a camera: model of its lens.
        columns: Of a device: columns of its rows; the first is
            ``gen_data.generator.core.measurement_dtypes.TIME``.
        rate_hz: SensorReadings per second; None = one at every step. Cameras and laser scanners
            read at most once per step.
        time_offset_s: How much later than the step's instant it reads [s].
        needs_clear_view: Whether a place inside the body that carries it is refused.
    """

    name: str
    modality: Modality
    kind: str = ""
    channels: tuple[Channel, ...] = ()
    lens: LensModel = "pinhole"
    columns: tuple[Column, ...] = ()
    rate_hz: float | None = None
    time_offset_s: float = 0.0
    needs_clear_view: bool = False


class Sensor(Protocol):
    """Image formation."""

    @property
    def name(self) -> str:
        """Instance name from the YAML."""
        ...

    def describe(self) -> SensorInfo:
        """What the rest of the program has to know of it."""
        ...

    def mount(self, scene: Scene) -> Scene:
        """The scene with the sensor's nominal camera, lidar or device in it, by its name.

        Raises:
            ConfigError: the scene lacks what it is mounted on, or its rate does not fit.
        """
        ...

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> SensorReading | PointCloud | Measurements:
        """One reading, of the type that its modality names.

        Args:
            scene: At the instant of the reading.
            renderer: To see the scene with.
            channels: Needed by annotators, besides the sensor's own.
            rng: Stream of this sensor at this step.

        Raises:
            SampleError: a randomizer made the sensor unfit.
        """
        ...


@runtime_checkable
class Annotator(Protocol):
    """Truth computed from Scene and SensorReading, one object at a time. No randomness."""

    @property
    def channels(self) -> frozenset[Channel]:
        """What it needs to have been rendered."""
        ...

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """The truth with this annotator's fields filled in."""
        ...


@runtime_checkable
class ImageAnnotator(Protocol):
    """Truth about an image as a whole: what is no single object's. No randomness."""

    @property
    def channels(self) -> frozenset[Channel]:
        """What it needs to have been rendered."""
        ...

    def annotate_image(
        self, scene: Scene, assets: AssetLibrary, reading: SensorReading, truth: ImageTruth
    ) -> ImageTruth:
        """The truth with this annotator's fields filled in."""
        ...


@runtime_checkable
class FrameAnnotator(Protocol):
    """Truth about a sample as a whole. No randomness."""

    @property
    def channels(self) -> frozenset[Channel]:
        """What it needs to have been rendered."""
        ...

    def annotate_frame(
        self, scenes: Mapping[str, Scene], assets: AssetLibrary, truth: EgoTruth
    ) -> EgoTruth:
        """The truth with this annotator's fields filled in.

        Args:
            scenes: The scene at the sample's instant by ``""``, and by the name of every laser
                scanner that has read the scene at the instant of its reading.
            assets: Geometry.
            truth: So far.
        """
        ...


AnyAnnotator = Annotator | ImageAnnotator | FrameAnnotator
"""An annotation plug-in has ``channels`` and the method of one of these Protocols, or of several.

It fills in its own fields of the truth and leaves the rest as it is; it changes no argument.
"""


@dataclass(frozen=True, slots=True)
class DatasetInfo:
    """Facts about the data set as a whole, for exporters.

    Attributes:
        categories: Names; category id ``k`` is ``categories[k - 1]``.
        sensors: Every sensor, sorted by name.
        depth_scale_m: Metres per unit of the 16-bit depth images.
        steps_per_scene: Instants of one view: the length of a sequence.
        step_s: Time between them.
    """

    name: str
    seed: int
    n: int
    views_per_scene: int
    categories: tuple[str, ...]
    sensors: tuple[SensorInfo, ...]
    depth_scale_m: float = 0.0001
    steps_per_scene: int = 1
    step_s: float = 0.1

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of the cameras, sorted."""
        return tuple(s.name for s in self._of(Modality.CAMERA))

    @property
    def lidars(self) -> tuple[str, ...]:
        """Names of the laser scanners, sorted."""
        return tuple(s.name for s in self._of(Modality.LIDAR))

    @property
    def devices(self) -> Mapping[str, str]:
        """``{sensor: kind}`` of all other sensors, sorted by name."""
        return {s.name: s.kind for s in self._of(Modality.DEVICE)}

    @property
    def media(self) -> Mapping[str, tuple[Channel, ...]]:
        """``{camera: channels written as images}``."""
        return {s.name: s.channels for s in self._of(Modality.CAMERA)}

    def sensor(self, name: str) -> SensorInfo:
        """The sensor of that name. Raises KeyError if there is none."""
        for sensor in self.sensors:
            if sensor.name == name:
                return sensor
        raise KeyError(name)

    def _of(self, modality: Modality) -> list[SensorInfo]:
        found = [s for s in self.sensors if s.modality is modality]
        return sorted(found, key=lambda s: s.name)


class Exporter(Protocol):
    """One output format, written shard by shard.

    The images of a sample are already in the shard folder at ``media_path(...)`` when
    ``write_shard`` sees it: an exporter adds its labels and, in ``finalize``, links images.
    """

    @property
    def type(self) -> str:
        """Its name in the table: the folder that ``finalize`` writes."""
        ...

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators whose fields it reads."""
        ...

    def check(self, info: DatasetInfo) -> None:
        """Refuse a data set that the format cannot hold.

        Raises:
            ConfigError: naming what it lacks, before anything is made.
        """
        ...

    def with_assets(self, assets: AssetLibrary) -> Exporter:
        """The exporter that writes; a format that holds geometry keeps the library."""
        ...

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write this format's labels of one shard. Every file name depends on indices only."""
        ...

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Merge all shards, given in index order, into the format's own layout."""
        ...


def media_path(shard_dir: Path, sensor: str, channel: Channel, index: int) -> Path:
    """Where the image of one channel of one sample lies."""
    return shard_dir / sensor / channel.value / f"{index:09d}.png"


def cloud_path(shard_dir: Path, sensor: str, index: int) -> Path:
    """Where the points of one sweep lie: a NumPy file with an array of ``POINT`` records."""
    return shard_dir / sensor / "points" / f"{index:09d}.npy"


def table_path(shard_dir: Path, sensor: str, index: int) -> Path:
    """Where the rows of one reading lie: a NumPy file of ``core.measurement_dtypes`` records."""
    return shard_dir / sensor / "rows" / f"{index:09d}.npy"
