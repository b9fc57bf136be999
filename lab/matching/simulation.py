"""Simulated recordings: scenes of a configuration, captured with candidate parameters.

Scenes are rendered once, up to the light that enters a camera and the surfaces that laser rays hit.
The candidates' changes come after: photographs are developed and returns detected again, with the
same random streams for all candidates.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from gen_data.assemble.config import Config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core import asset_types, errors, se3, system_calls
from gen_data.core.boxes import BoxPx
from gen_data.core.capture import Channel, LidarHits
from gen_data.core.scene import Camera, Scene, Weather
from gen_data.core.streams import Streams
from gen_data.lab.matching.picture import Picture
from gen_data.lab.matching.quantities import CameraQuantity, LidarQuantity
from gen_data.lab.matching.recordings import Box, ImageLabels, Scan
from gen_data.pipeline.finalize_scene import Timeline
from gen_data.sensors.camera.image_pipeline import ImagePipeline, develop, take_shot
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.lidar.lidar_sensor import LidarSensor

BYTES_MAX = 1_000_000_000
"""Of the images of all scenes together; fewer scenes are rendered for large images."""
BYTES_PER_PIXEL = 16

T = TypeVar("T")
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False, slots=True)
class Exposure:
    """Everything in front of a camera, with its own settings.

    Attributes:
        radiance: Linear RGB [cd/m^2], float32 [h, w, 3].
        depth_m: As ``take_shot`` takes it; None if no stage needs it.
        pipeline: Settings of the scene's camera.
    """

    radiance: asset_types.Float32
    depth_m: asset_types.Float32 | None
    camera: Camera
    weather: Weather
    pipeline: ImagePipeline
    streams: Streams


@dataclass(frozen=True, eq=False, slots=True)
class Illumination:
    """Everything that a scanner's rays hit in one sweep."""

    scene: Scene
    hits: LidarHits
    sensor: LidarSensor
    streams: Streams


@dataclass(frozen=True, eq=False, slots=True)
class Simulated:
    """Scenes of a configuration, ready for candidates."""

    exposures: tuple[Exposure, ...]
    illuminations: tuple[Illumination, ...]


class _RecordedHits:
    """A renderer whose rays repeat recorded hits."""

    def __init__(self, hits: LidarHits) -> None:
        self.hits = hits

    def scan(self, *_: object) -> LidarHits:
        return self.hits


class _HitRecorder:
    """A renderer that keeps the hits of its last scan."""

    def __init__(self, renderer: Any) -> None:
        self.renderer = renderer
        self.hits: LidarHits | None = None

    def scan(self, *arguments: Any) -> LidarHits:
        hits: LidarHits = self.renderer.scan(*arguments)
        self.hits = hits
        return hits


def simulate_scenes(
    config: Config, camera: str, lidar: str, count: int, progress: Progress = lambda _: None
) -> Simulated:
    """Render scenes of a configuration for one camera and one laser scanner.

    Args:
        config: The configuration.
        camera: Name of the camera; empty = none.
        lidar: Name of the laser scanner; empty = none.
        count: Number of scenes; each shows its first view. Scenes without a valid layout are
            left out.
        progress: Called before each scene.

    Raises:
        SceneRejected: more than half as many scenes as ``count`` have no valid layout.
    """
    exposures: list[Exposure] = []
    illuminations: list[Illumination] = []
    with open_pipeline(config) as pipeline:
        ids = {name: number for number, name in enumerate(pipeline.info.categories, 1)}
        rejected = 0
        for number in range(2 * count):
            made = number - rejected
            if made == count:
                break
            progress(f"scene {made + 1} of {count}")
            try:
                accepted = pipeline.accepted_scene(number)
            except errors.SceneRejected:
                # Some scenes have no valid layout; where half have none, the message helps more.
                rejected += 1
                if rejected > count // 2:
                    raise
                continue
            view = pipeline.drawn_view(accepted, 0)
            timeline = Timeline(view.scene, pipeline.assets, ids)
            for sensor in accepted.sensors:
                scene = timeline.at(getattr(sensor, "time_offset_s", 0.0))
                if isinstance(sensor, RgbCamera) and sensor.name == camera:
                    exposures.append(_expose(sensor, scene, pipeline.renderer, view.streams))
                elif isinstance(sensor, LidarSensor) and sensor.name == lidar:
                    recorder = _HitRecorder(pipeline.renderer)
                    scan_with(sensor, scene, recorder, view.streams)
                    assert recorder.hits is not None
                    illuminations.append(Illumination(scene, recorder.hits, sensor, view.streams))
    return Simulated(tuple(exposures), tuple(illuminations))


def scenes_in_memory(sensor: RgbCamera, count: int) -> int:
    """Number of scenes, at most ``count``, whose images fit into ``BYTES_MAX``."""
    width_px, height_px = sensor.size_px
    return max(4, min(count, BYTES_MAX // (BYTES_PER_PIXEL * width_px * height_px)))


def _expose(sensor: RgbCamera, scene: Scene, renderer: Any, streams: Streams) -> Exposure:
    camera = scene.camera(sensor.name)
    depth = Channel.Z_DEPTH if camera.intrinsics.straight else Channel.RANGE
    focused = sensor.image_pipeline.focus is not None
    needed = frozenset({Channel.RADIANCE, depth} if focused else {Channel.RADIANCE})
    channels = renderer.render(scene, camera, needed).channels
    return Exposure(
        channels[Channel.RADIANCE], channels.get(depth), camera, scene.weather,
        sensor.image_pipeline, streams,
    )  # fmt: skip


def scan_with(sensor: LidarSensor, scene: Scene, renderer: Any, streams: Streams) -> Scan:
    """One sweep, as statistics take it."""
    rng = streams.rng(f"sensor/{sensor.name}")
    points = sensor.capture(scene, renderer, frozenset(), rng).points
    range_m = np.linalg.norm(points["position_m"].astype(np.float64), axis=1)
    return Scan("", range_m, points["intensity"].astype(np.float64))


def photograph(exposure: Exposure, pipeline: ImagePipeline) -> Picture:
    """Develop a photograph with a pipeline."""
    rng = exposure.streams.rng("match")
    photo = develop(
        take_shot(
            exposure.radiance, exposure.depth_m, exposure.camera, exposure.weather, pipeline, rng
        )
    )
    return Picture(photo.rgb)


def measure_exposures(
    exposures: Sequence[Exposure],
    quantities: Sequence[CameraQuantity],
    coordinates: se3.Array,
    count: int,
    prepare: Callable[[ImagePipeline], ImagePipeline],
) -> se3.Array:
    """Statistics [scenes, k] of photographs.

    Args:
        exposures: The scenes.
        quantities: Parameters and their statistics.
        coordinates: Values of the parameters, [k], or for each scene, [scenes, k].
        count: Number of scenes, at most.
        prepare: Further changes to every scene's own pipeline, before these.
    """
    used = exposures[:count]

    def measure(exposure: Exposure, own: se3.Array) -> list[float]:
        pipeline = prepare(exposure.pipeline)
        for quantity, coordinate in zip(quantities, own, strict=True):
            pipeline = quantity.apply(pipeline, float(coordinate))
        picture = photograph(exposure, pipeline)
        return [quantity.measure(picture) for quantity in quantities]

    grids = [quantity.axis.grid for quantity in quantities]
    rows = np.broadcast_to(coordinates, (len(used), len(quantities))) + _dither(len(used), grids)
    return np.array(list(map_in_threads(measure, used, rows)))


def _dither(scenes: int, grids: Sequence[float]) -> se3.Array:
    """Offsets [scenes, k] of parameters that the pipeline rounds to multiples; 0 = it does not.

    They are spread evenly over a step: the mean of the rounded values is the parameter, and
    mean statistics change steadily with it (dither: Schuchman, "Dither signals and their effect on
    quantization noise", IEEE Transactions on Communication Technology 12, 1964). Multiples of the
    golden ratio are even, however many there are.
    """
    shares = (0.5 + np.arange(scenes) * (math.sqrt(5.0) - 1.0) / 2.0) % 1.0 - 0.5
    return np.asarray(shares[:, None] * np.array(grids))


def measure_illuminations(
    illuminations: Sequence[Illumination],
    quantities: Sequence[LidarQuantity],
    coordinates: se3.Array,
    count: int,
) -> se3.Array:
    """Statistics [scenes, k] of scans with parameters [k], of so many scenes at most."""
    rows = []
    for one in illuminations[:count]:
        sensor = one.sensor
        for quantity, coordinate in zip(quantities, coordinates, strict=True):
            sensor = quantity.apply(sensor, float(coordinate))
        scan = rescan(one, sensor)
        rows.append([quantity.measure(scan) for quantity in quantities])
    return np.array(rows)


def rescan(one: Illumination, sensor: LidarSensor) -> Scan:
    """The scan of a scanner with other settings, whose rays are the same."""
    return scan_with(sensor, one.scene, _RecordedHits(one.hits), one.streams)


def label_scenes(config: Config, camera: str, count: int) -> list[ImageLabels]:
    """Boxes of visible parts in images of one camera, one image per scene."""
    labelled = []
    with open_pipeline(config) as pipeline:
        for number in range(count):
            accepted = pipeline.accepted_scene(number)
            view = pipeline.drawn_view(accepted, 0)
            sensors = [sensor for sensor in accepted.sensors if sensor.name == camera]
            truth = pipeline.read_sensors(view, sensors, 0).truth[camera]
            boxes = tuple(
                _box(o.instance.category, o.box) for o in truth.objects if o.box is not None
            )
            intrinsics = truth.camera.intrinsics
            labelled.append(ImageLabels(intrinsics.width_px, intrinsics.height_px, boxes))
    return labelled


def _box(category: str, box: BoxPx) -> Box:
    sides = (box.x_min, box.y_min, box.width_px, box.height_px)
    left, top, width, height = (float(side) for side in sides)
    return category, left, top, width, height


def map_in_threads(function: Callable[..., T], *items: Iterable[Any]) -> Iterator[T]:
    """Results in order, as of ``map``; most of the time goes to libraries that let threads run."""
    with ThreadPoolExecutor(system_calls.usable_cores()) as pool:
        yield from pool.map(function, *items)
