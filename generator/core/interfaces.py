"""Interfaces of plug-ins: all members that assembly, runner and pipeline use.

Writing a plug-in
-----------------
A plug-in is a class listed in the ``TABLE`` of its package, or an entry point of the group
``gen_data.<kind>``. Classes of the kinds ``element``, ``randomizer``, ``sensor``, ``annotation``,
``exporter`` and ``renderer`` derive from ``gen_data.config.base_model.Strict``: their
fields are the keys of their entry in YAML, and instances are created by validating that entry. The
field ``type`` is ``Literal["<name in the table>"]`` (``renderer`` instead of ``type`` for a
renderer) with the name as its default. Instances are frozen, picklable, and created before any
engine is opened, so importing their module must not import heavy libraries.

Every member of a Protocol below is required. Base classes provide members that few plug-ins need:
``gen_data.randomizers.base.RandomizerBase``, ``gen_data.scene_templates.element.Element``,
``gen_data.sensors.mounting.Mounted`` and ``Instrument``,
``gen_data.exporters.base.ExporterBase``. A class that lacks a member is refused when it is loaded.

The kind ``asset_family`` differs: its entry points name instances of
``gen_data.assets.family.Family``, ``TextureFamily`` or ``EnvironmentFamily``.

Forbidden operations are impossible by design: randomizers get no engine, annotators no rng (except
annotators of sequences, which choose once per view), and exporters process one shard at a time and
compute ids instead of counting.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Protocol, runtime_checkable

from numpy.typing import NDArray

from gen_data.core import (
    asset_types,
    errors,
    measurement_dtypes,
    plates,
    se3,
    serialization,
    streams,
)
from gen_data.core.capture import (
    PNG,
    Capture,
    Channel,
    ImageEncoding,
    LidarHits,
    LidarRays,
    Measurements,
    PointCloud,
    SensorReading,
)
from gen_data.core.lens import LensModel
from gen_data.core.sample import EgoTruth, ImageTruth, ObjectTruth, Sample
from gen_data.core.scene import Camera, Lane, Lidar, Scene, StageModel
from gen_data.core.writing import Writing


class Stage(str, Enum):
    """Stage of the pipeline in which a randomizer runs."""

    BUILD = "scene"
    """Once per scene, before physics."""
    VIEW = "view"
    """Once per view, after physics."""


class AssetIndex(Protocol):
    """Index of the assets: their properties and extents, no surfaces or images."""

    def get(self, asset_id: str) -> asset_types.Asset:
        """The asset of that id. Raises AssetError with the nearest ids if unknown."""
        ...

    def find(self, tags: Iterable[str], kind: str = "object") -> tuple[asset_types.Asset, ...]:
        """All assets of a kind that have all tags, sorted by id; may be empty."""
        ...

    def variants(self, family: str) -> tuple[asset_types.Asset, ...]:
        """All objects of a family that ``find`` offers, sorted by id; empty if there is none."""
        ...

    def materials(self, asset_id: str) -> tuple[asset_types.Material, ...]:
        """The asset's own materials, one per mesh slot."""
        ...

    def bounds_m(self, asset_id: str) -> tuple[se3.Vec3, se3.Vec3]:
        """Smallest and largest coordinates of the asset's mesh in its own frame [m]."""
        ...

    def body_bounds_m(self, asset_id: str) -> tuple[se3.Vec3, se3.Vec3] | None:
        """The same without a vehicle's exterior mirrors or a pole's cables; None without such."""
        ...

    def stride_bounds_m(self, asset_id: str) -> tuple[se3.Vec3, se3.Vec3]:
        """Bounds over a whole stride of a person who walks; bounds of the mesh for all others."""
        ...

    def vertices_m(self, asset_id: str) -> asset_types.Float32:
        """Vertices of the asset's mesh in its own frame [m], float32 [n, 3]; not to be written to.

        Raises AssetError if a link has no visual geometry.
        """
        ...

    def mean_color(self, texture_id: str) -> se3.Vec3:
        """Mean reflectance of a texture, linear RGB."""
        ...

    def keypoints(self, asset_id: str) -> tuple[asset_types.Keypoint, ...]:
        """Named points of the asset, in its own frame; empty if it has none."""
        ...

    def lanes(self, asset_id: str) -> tuple[Lane, ...]:
        """Lanes of a road network, in its own frame; empty for anything else."""
        ...

    def robot(self, asset_id: str) -> asset_types.RobotModel:
        """Kinematics of a robot. Raises AssetError if the asset is not a robot."""
        ...

    def stage(self, asset_id: str) -> StageModel:
        """Content of a stage file. Raises AssetError if the asset is not a stage."""
        ...

    def plate(self, asset_id: str) -> plates.Plate:
        """Camera, ground and light of a photograph. Raises AssetError if the asset is none.

        ``AssetLibrary.texture`` gives its pixels, ``AssetLibrary.environment`` the light around it.
        """
        ...


class AssetLibrary(AssetIndex, Protocol):
    """The index and the geometry of assets; everything is cached by content hash."""

    def __hash__(self) -> int:
        """Hash by identity: caches of derived geometry use it as a key."""
        ...

    def mesh(self, asset_id: str) -> asset_types.MeshData:
        """Visual geometry. Also for robot links: ``franka_panda/panda_link3``."""
        ...

    def convex_parts(self, asset_id: str) -> asset_types.ConvexParts:
        """Collision geometry."""
        ...

    def texture(self, texture_id: str) -> asset_types.TextureData:
        """Images of a texture."""
        ...

    def environment(self, environment_id: str) -> asset_types.Float32:
        """Equirectangular relative radiance, linear RGB, mean luminance 1, float32 [h, 2h, 3].

        Row 0 is the zenith; column 0 is the direction -X, the centre column is +X, and columns
        grow clockwise seen from above (towards -Y).
        """
        ...


@runtime_checkable
class FileFrames(Protocol):
    """An AssetLibrary with assets from files of the user."""

    def file_shift_m(self, asset_id: str) -> se3.Vec3 | None:
        """Offset added to the coordinates of a file, scaled and upright, on import [m].

        None for assets that are not of a user's file.
        """
        ...


@runtime_checkable
class DerivedArrays(Protocol):
    """An AssetLibrary that also stores arrays computed from its assets.

    All processes share them, and memory is needed only for the parts that are read.
    """

    def derived(
        self, asset_id: str, name: str, compute: Callable[[], dict[str, NDArray[Any]]]
    ) -> dict[str, NDArray[Any]]:
        """Arrays computed from an asset, read-only; computed if they are not stored.

        Args:
            asset_id: Also ``<asset>#<image>``.
            name: Name of the computation and everything else that the result depends on.
            compute: Computes them; its result depends on the asset and the name alone.
        """
        ...

    def is_stored(self, asset_id: str) -> bool:
        """Whether arrays of that asset are stored; each process computes the arrays of others."""
        ...


@runtime_checkable
class WrittenAssets(Protocol):
    """An AssetLibrary with the text written on its textures and meshes."""

    def writing(self, asset_id: str) -> tuple[Writing, ...]:
        """Lines of text on a texture, or of a mesh itself, in the order of drawing.

        Empty for assets without text, and for files. Raises AssetError as the library.
        """
        ...


@runtime_checkable
class AssetPreparation(Protocol):
    """An engine that computes arrays from assets, which ``DerivedArrays`` stores."""

    def prepare_asset(self, asset_id: str) -> None:
        """Compute and store the data that this engine derives from an asset and its textures.

        Nothing where it derives nothing from assets of that kind. Raises AssetError as the library.
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
        """Whether it is added after all elements that do not follow others.

        For groups of objects, which avoid everything on their surfaces.
        """
        ...

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """A new scene with this element at its nominal pose.

        Raises:
            ConfigError: a relation refers to nothing, or cannot be satisfied.
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
        """Stage in which it runs: the value of a Stage."""
        ...

    @property
    def motion_duration_s(self) -> float | None:
        """Duration of the motion that it draws, from time 0 [s]; None if it draws none.

        Longer sequences are refused.
        """
        ...

    def possible_assets(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of assets that it may add to a scene, which become part of the plan.

        Assets of nominal bodies and of object groups need not be listed.
        """
        ...

    def __call__(self, scene: Scene, assets: AssetIndex, rng: streams.Rng) -> Scene:
        """Return a new scene; the given one is unchanged.

        Raises:
            LayoutRejected: this draw has no solution, but another attempt may have one.
            ConfigError: no draw has a solution.
        """
        ...


@dataclass(frozen=True, slots=True)
class Settled:
    """A settled scene, or the reason for its rejection.

    Attributes:
        scene: With rounded poses and placed robot links.
        rejection: None = the scene is valid.
    """

    scene: Scene
    rejection: errors.Rejection | None = None


class PhysicsEngine(Protocol):
    """Settles bodies and moves arms: a pure function of the scene, without state."""

    def __enter__(self) -> "PhysicsEngine":
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
        """Settle a scene."""
        ...


@dataclass(frozen=True, slots=True)
class Tones:
    """Range of tones that a camera distinguishes.

    Attributes:
        white_cd_m2: Luminance that saturates a single exposure.
        brightest_cd_m2: Luminance that saturates all exposures that an image is merged from.
    """

    white_cd_m2: float
    brightest_cd_m2: float


FindTones = Callable[[asset_types.Float32], Tones]
"""Finds the tones of an image of radiance [cd/m^2], linear RGB, float32 [h, w, 3]."""


class Renderer(Protocol):
    """Renders images and traces rays: a pure function of its arguments, except for caches."""

    def render(
        self,
        scene: Scene,
        camera: Camera,
        channels: frozenset[Channel],
        find_tones: FindTones | None = None,
    ) -> SensorReading:
        """Render the requested channels of one camera, with types and values as in ``Channel``.

        The reading's ``sensor`` is the camera's name. ``AMODAL`` fills its ``silhouettes`` instead
        of its ``channels``. Renderers end at ``RADIANCE``: cameras develop ``RGB`` from it and set
        ``ev100``. Cameras whose pixels are means of many photosites give ``find_tones``: the
        radiance of a pixel on an edge is that whose tone is the mean of its samples' tones.
        """
        ...

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        """Find the first surface on every ray of a laser scanner's beams, and its reflectance."""
        ...


class RendererSettings(Protocol):
    """The section ``render:`` of a renderer's configuration: its plug-in class."""

    def open(self, assets: AssetLibrary) -> Renderer:
        """Open a renderer with these settings.

        Raises:
            ConfigError: the settings are not available on this machine.
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
    """Description of a sensor; the same for all scenes.

    Attributes:
        name: Instance name from the YAML.
        modality: The form of its readings.
        kind: Devices: ``Device.kind``, such as ``radar``; empty for others.
        channels: Cameras: channels written as images, in the order of ``Channel``.
        lens: Cameras: model of the lens.
        columns: Devices: columns of its rows; the first is
            ``gen_data.core.measurement_dtypes.TIME``.
        view: Devices: ``module:function`` that draws a reading for contact sheets, from
            Measurements, Scene and width over height, as uint8 [h, w, 3]; empty = none.
        rate_hz: Readings per second; None = one per step. Cameras and laser scanners read at most
            once per step.
        time_offset_s: Delay of readings after the step's instant [s].
        rgb_encoding: Cameras: encoding of the files of the rgb channel; others are PNG.
        origins: Laser scanners: whether scans have ``capture.ORIGIN`` records.
        motion_distortion: Laser scanners: the frame of points: ``raw``, at each pulse's instant;
            ``deskewed``, at the sweep's middle; ``none``, all pulses leave then.
        needs_clear_view: Whether a position inside the body that carries it is refused.
        faults: Kinds of errors in its readings: ``clock``, ``extrinsics``, ``lost``,
            ``doubled``.
        stereo_with: Cameras: the right camera of its disparities; empty = unknown, or none.
    """

    name: str
    modality: Modality
    kind: str = ""
    channels: tuple[Channel, ...] = ()
    lens: LensModel = "pinhole"
    columns: tuple[measurement_dtypes.Column, ...] = ()
    view: str = ""
    rate_hz: float | None = None
    time_offset_s: float = 0.0
    needs_clear_view: bool = False
    rgb_encoding: ImageEncoding = PNG
    origins: bool = False
    motion_distortion: Literal["raw", "deskewed", "none"] = "deskewed"
    faults: tuple[str, ...] = field(default=(), metadata={serialization.SPARSE: True})
    stereo_with: str = field(default="", metadata={serialization.SPARSE: True})


class Sensor(Protocol):
    """Reads a scene."""

    @property
    def name(self) -> str:
        """Instance name from the YAML."""
        ...

    def describe(self) -> SensorInfo:
        """Description of the sensor for the rest of the program."""
        ...

    def mount(self, scene: Scene) -> Scene:
        """Add the sensor's nominal camera, lidar or device to a scene, under its name.

        Raises:
            ConfigError: its rig or camera does not exist, or its rate does not fit the sequence.
        """
        ...

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: streams.Rng
    ) -> SensorReading | PointCloud | Measurements:
        """Capture one reading, of the type of its modality.

        Args:
            scene: At the instant of the reading.
            renderer: Renders the scene.
            channels: Required by annotators, besides the sensor's own.
            rng: Stream of this sensor at this step.

        Raises:
            SampleError: a randomizer gave the sensor invalid parameters.
        """
        ...


@runtime_checkable
class Annotator(Protocol):
    """Annotates one object at a time, from Scene and SensorReading, without randomness."""

    @property
    def channels(self) -> frozenset[Channel]:
        """Channels that it requires."""
        ...

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """The truth with this annotator's fields filled in."""
        ...


@runtime_checkable
class ImageAnnotator(Protocol):
    """Annotates an image as a whole, without randomness."""

    @property
    def channels(self) -> frozenset[Channel]:
        """Channels that it requires."""
        ...

    def annotate_image(
        self, scene: Scene, assets: AssetLibrary, reading: SensorReading, truth: ImageTruth
    ) -> ImageTruth:
        """The truth with this annotator's fields filled in."""
        ...


@runtime_checkable
class FrameAnnotator(Protocol):
    """Annotates a sample as a whole, without randomness."""

    @property
    def channels(self) -> frozenset[Channel]:
        """Channels that it requires."""
        ...

    def annotate_frame(
        self, scenes: Mapping[str, Scene], assets: AssetLibrary, truth: EgoTruth
    ) -> EgoTruth:
        """The truth with this annotator's fields filled in.

        Args:
            scenes: ``""``: the scene at the sample's instant; by the name of every laser scanner
                with a reading: the scene at the instant of that reading.
            assets: Geometry.
            truth: Annotations so far.
        """
        ...


@runtime_checkable
class CaptureAnnotator(Protocol):
    """Annotates a sample as a whole from the readings of all its sensors, without randomness."""

    @property
    def channels(self) -> frozenset[Channel]:
        """Channels that it requires."""
        ...

    def annotate_capture(
        self, scenes: Mapping[str, Scene], assets: AssetLibrary, capture: Capture, truth: EgoTruth
    ) -> EgoTruth:
        """The truth with this annotator's fields filled in.

        Args:
            scenes: As in ``FrameAnnotator``.
            assets: Geometry.
            capture: The sample's readings.
            truth: Annotations so far.
        """
        ...


@dataclass(frozen=True, eq=False, slots=True)
class ViewSequence:
    """All steps of one view, for annotators of sequences.

    Attributes:
        at: The scene at an instant [s], for sensors and labels.
        instants_s: Instants of its steps.
        assets: Geometry.
        renderer: Traces rays.
        streams: Random streams of the view, the same at all steps.
    """

    at: Callable[[float], Scene]
    instants_s: tuple[float, ...]
    assets: AssetLibrary
    renderer: Renderer
    streams: streams.Streams


@runtime_checkable
class SequenceAnnotator(Protocol):
    """Annotates samples with something that all steps of their sequence share.

    ``begin`` chooses it from the view alone: every step can do so by itself, with the same result,
    and samples depend on no other. The pipeline keeps the result while it works on the view.
    """

    @property
    def channels(self) -> frozenset[Channel]:
        """Channels that it requires."""
        ...

    def begin(self, view: ViewSequence) -> object:
        """Choose the state that the steps share: a pure function of the view.

        Raises:
            ConfigError: the scene lacks something that the annotator needs.
        """
        ...

    def annotate_step(
        self, view: ViewSequence, begun: Any, scene: Scene, capture: Capture, truth: EgoTruth
    ) -> EgoTruth:
        """The truth of one step with this annotator's fields filled in.

        Args:
            view: The whole sequence.
            begun: Result of ``begin``.
            scene: The scene at the sample's instant.
            capture: The sample's readings.
            truth: Annotations so far.
        """
        ...


AnyAnnotator = Annotator | ImageAnnotator | FrameAnnotator | CaptureAnnotator | SequenceAnnotator
"""An annotation plug-in has ``channels`` and the method of one of these Protocols, or of several.

It fills in its own fields of the truth and leaves the rest as it is; it changes no argument.
"""


@dataclass(frozen=True, slots=True)
class Publication:
    """How a data set is published; empty = not stated.

    Attributes:
        title: Name for readers; empty = the name of the configuration.
        description: Its content and purpose in a few sentences.
        license: SPDX identifier or URL; empty = only the licences of its assets are stated.
        creators: Names of persons or organisations.
        url: Its web page.
        date_published: Such as ``2026-11-22``.
        cite_as: Citation, such as a BibTeX entry.
        version: Version of the data, ``major.minor.patch``.
    """

    title: str = ""
    description: str = ""
    license: str = ""
    creators: tuple[str, ...] = ()
    url: str = ""
    date_published: str = ""
    cite_as: str = ""
    version: str = "1.0.0"


@dataclass(frozen=True, slots=True)
class DatasetInfo:
    """Properties of the data set as a whole, for exporters.

    Attributes:
        categories: Names; category id ``k`` is ``categories[k - 1]``.
        sensors: Every sensor, sorted by name.
        depth_scale_m: Metres per unit of the 16-bit depth images.
        views_per_scene: Views of a scene; twins count as two.
        steps_per_scene: Length of a sequence: instants per view.
        step_s: Time between them [s].
        twins: Whether each view is there twice, with another demonstration.
        publication: Title, licence and creators.
        own_categories: Categories of the data set if a label map has replaced them by its classes:
            stored images and points have their ids. Empty = the same.
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
    publication: Publication = Publication()
    twins: bool = False
    own_categories: tuple[str, ...] = ()

    def view_streams(self, scene: int, view: int, attempt: int) -> streams.Streams:
        """Random streams that draw a view of a scene: the same for twins."""
        twins = 2 if self.twins else 1
        drawn = view // twins
        number = scene * (self.views_per_scene // twins) + drawn
        return streams.Streams(self.seed, scene, view=drawn, attempt=attempt, index=number)

    def twin(self, view: int) -> int:
        """Which twin a view is: 0 fails, 1 recovers; 0 without twins."""
        return view % 2 if self.twins else 0

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of the cameras, sorted."""
        return tuple(s.name for s in self._with_modality(Modality.CAMERA))

    @property
    def lidars(self) -> tuple[str, ...]:
        """Names of the laser scanners, sorted."""
        return tuple(s.name for s in self._with_modality(Modality.LIDAR))

    @property
    def devices(self) -> Mapping[str, str]:
        """``{sensor: kind}`` of all other sensors, sorted by name."""
        return {s.name: s.kind for s in self._with_modality(Modality.DEVICE)}

    @property
    def views(self) -> Mapping[str, str]:
        """``{device: module:function}`` of the devices that draw their readings."""
        return {s.name: s.view for s in self._with_modality(Modality.DEVICE) if s.view}

    @property
    def media(self) -> Mapping[str, tuple[Channel, ...]]:
        """``{camera: channels written as images}``."""
        return {s.name: s.channels for s in self._with_modality(Modality.CAMERA)}

    def encoding(self, camera: str, channel: Channel) -> ImageEncoding:
        """Encoding of the files of one channel of a camera."""
        return self.sensor(camera).rgb_encoding if channel is Channel.RGB else PNG

    def media_path(self, shard_dir: Path, camera: str, channel: Channel, index: int) -> Path:
        """Path of the image of one channel of one sample, in the camera's encoding."""
        suffix = self.encoding(camera, channel).suffix
        return shard_dir / f"{camera}/{channel.value}/{index:09d}{suffix}"

    def sensor(self, name: str) -> SensorInfo:
        """The sensor of that name. Raises KeyError if there is none."""
        for sensor in self.sensors:
            if sensor.name == name:
                return sensor
        raise KeyError(name)

    def _with_modality(self, modality: Modality) -> list[SensorInfo]:
        found = [s for s in self.sensors if s.modality is modality]
        return sorted(found, key=lambda s: s.name)


class Exporter(Protocol):
    """An output format, written shard by shard.

    The images of samples are already in the shard folder, at ``media_path(...)``, when
    ``write_shard`` is called: an exporter adds labels and, in ``finalize``, links images.
    """

    @property
    def type(self) -> str:
        """Its name in the table, and of the folder that ``finalize`` writes."""
        ...

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators it depends on."""
        ...

    @property
    def has_own_classes(self) -> bool:
        """Whether the format prescribes its classes, which it derives from our categories.

        A label map then drops and ignores objects but renames none.
        """
        ...

    def check(self, info: DatasetInfo) -> None:
        """Refuse a data set that the format cannot hold.

        Raises:
            ConfigError: the data set lacks something, which the message names.
        """
        ...

    def with_assets(self, assets: AssetLibrary) -> "Exporter":
        """The exporter with access to the library, for formats with geometry."""
        ...

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the labels of one shard; file names depend on indices only."""
        ...

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Merge all shards, given in index order, into the format's own layout."""
        ...


def media_path(shard_dir: Path, sensor: str, channel: Channel, index: int) -> Path:
    """Path of the image of one channel of one sample, if it is PNG; else ``info.media_path``."""
    return shard_dir / f"{sensor}/{channel.value}/{index:09d}.png"


def cloud_path(shard_dir: Path, sensor: str, index: int) -> Path:
    """Path of the points of one sweep: a NumPy file with an array of ``POINT`` records."""
    return shard_dir / f"{sensor}/points/{index:09d}.npy"


def origins_path(shard_dir: Path, sensor: str, index: int) -> Path:
    """Path of the origins of the points of one sweep: an array of ``ORIGIN`` records."""
    return shard_dir / f"{sensor}/origins/{index:09d}.npy"


def reading_paths(shard_dir: Path, capture: Capture, index: int) -> dict[str, tuple[Path, ...]]:
    """Paths of the files of laser scanners and devices with a reading, by sensor."""
    paths = {
        name: (
            cloud_path(shard_dir, name, index),
            *([origins_path(shard_dir, name, index)] if cloud.lidar.origins else []),
        )
        for name, cloud in capture.clouds.items()
    }
    return {**paths, **{n: (table_path(shard_dir, n, index),) for n in capture.tables}}


def table_path(shard_dir: Path, sensor: str, index: int) -> Path:
    """Path of the rows of one reading: a NumPy file of ``core.measurement_dtypes`` records."""
    return shard_dir / f"{sensor}/rows/{index:09d}.npy"
