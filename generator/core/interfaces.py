"""The seams: what each room of the house promises to the others.

Randomizers get no engine, annotators get no rng, exporters see one shard and compute ids instead
of counting: what must not be done cannot be done.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Protocol, runtime_checkable

from generator.core.capture import Beams, Channel, Echoes, PointCloud, Reading, Table
from generator.core.errors import Rejection
from generator.core.geometry import (
    Asset,
    ConvexParts,
    Float32,
    Keypoint,
    Material,
    MeshData,
    RobotModel,
    TextureData,
)
from generator.core.lens import LensModel
from generator.core.sample import FrameTruth, ImageTruth, ObjectTruth, Sample
from generator.core.scene import Camera, Lane, Lidar, Scene, StageModel
from generator.core.se3 import Vec3
from generator.core.streams import Rng


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

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """A new scene; the given one stays as it is."""
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
    """Makes bodies rest and arms obey. A pure function of the scene: no memory between calls."""

    def settle(self, scene: Scene) -> Settled:
        """The scene at rest."""
        ...


class Renderer(Protocol):
    """Light and rays. A pure function of its arguments; what it caches are assets."""

    def render(self, scene: Scene, camera: Camera, channels: frozenset[Channel]) -> Reading:
        """Every asked channel of one camera; ``Reading.sensor`` is the camera's name."""
        ...

    def scan(self, scene: Scene, lidar: Lidar, beams: Beams) -> Echoes:
        """What the rays of a laser scanner's beams hit first, and how well it reflects."""
        ...


class Sensor(Protocol):
    """Image formation."""

    @property
    def name(self) -> str:
        """Instance name from the YAML."""
        ...

    def mount(self, scene: Scene) -> Scene:
        """The scene with the sensor's nominal camera, or its lidar, in it."""
        ...

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Reading | PointCloud | Table:
        """What the sensor sees; ``channels`` are what annotators need beyond its own."""
        ...


@runtime_checkable
class Annotator(Protocol):
    """Truth computed from Scene and Reading, one object at a time. No randomness."""

    @property
    def channels(self) -> frozenset[Channel]:
        """What it needs to have been rendered."""
        ...

    def annotate(self, scene: Scene, reading: Reading, truth: ObjectTruth) -> ObjectTruth:
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
        self, scene: Scene, assets: AssetLibrary, reading: Reading, truth: ImageTruth
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
        self, scenes: Mapping[str, Scene], assets: AssetLibrary, truth: FrameTruth
    ) -> FrameTruth:
        """The truth with this annotator's fields filled in.

        Args:
            scenes: The scene at the sample's instant by ``""``, and by the name of every laser
                scanner that has read the scene at the instant of its reading.
            assets: Geometry.
            truth: So far.
        """
        ...


@dataclass(frozen=True, slots=True)
class DatasetInfo:
    """What every exporter may know about the data set as a whole.

    Attributes:
        categories: Names; category id ``k`` is ``categories[k - 1]``.
        sensors: Names of the cameras, sorted.
        lidars: Names of the laser scanners, sorted.
        media: ``{sensor: channels written as images}``.
        depth_scale_m: Metres per unit of the 16-bit depth images.
        devices: ``{sensor: kind}`` of all other sensors, sorted by name.
        steps_per_scene: Instants of one view: the length of a sequence.
        step_s: Time between them.
        lenses: ``{camera: model of its lens}``; a pinhole where it is missing.
    """

    name: str
    seed: int
    n: int
    views_per_scene: int
    categories: tuple[str, ...]
    sensors: tuple[str, ...]
    media: Mapping[str, tuple[Channel, ...]]
    depth_scale_m: float = 0.0001
    lidars: tuple[str, ...] = ()
    devices: Mapping[str, str] = field(default_factory=dict)
    steps_per_scene: int = 1
    step_s: float = 0.1
    lenses: Mapping[str, LensModel] = field(default_factory=dict)


class Exporter(Protocol):
    """One output format, written shard by shard.

    The images of a sample are already in the shard folder at ``media_path(...)`` when
    ``write_shard`` sees it: an exporter adds its labels and, in ``finalize``, links images.
    """

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators whose fields it reads."""
        ...

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write this format's labels of one shard. Every file name depends on indices only."""
        ...

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Merge all shards, given in index order, into the format's own layout."""
        ...


@runtime_checkable
class GeometryExporter(Exporter, Protocol):
    """An exporter of a format that holds geometry."""

    def with_assets(self, assets: AssetLibrary) -> Exporter:
        """The exporter that writes; what scenes are made of, it takes from the library."""
        ...


def media_path(shard_dir: Path, sensor: str, channel: Channel, index: int) -> Path:
    """Where the image of one channel of one sample lies."""
    return shard_dir / sensor / channel.value / f"{index:09d}.png"


def cloud_path(shard_dir: Path, sensor: str, index: int) -> Path:
    """Where the points of one sweep lie: a NumPy file with an array of ``POINT`` records."""
    return shard_dir / sensor / "points" / f"{index:09d}.npy"


def table_path(shard_dir: Path, sensor: str, index: int) -> Path:
    """Where the rows of one reading lie: a NumPy file of ``generator.core.tables`` records."""
    return shard_dir / sensor / "rows" / f"{index:09d}.npy"
