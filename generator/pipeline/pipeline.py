"""One sample from one index."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import TracebackType
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from gen_data.core import errors, interfaces
from gen_data.core.capture import Capture, Channel, Measurements, PointCloud, SensorReading
from gen_data.core.sample import EgoTruth, ImageTruth, Sample
from gen_data.core.scene import LABEL_IDS_MAX, Scene
from gen_data.core.streams import Streams
from gen_data.pipeline import checked_renderer, splits
from gen_data.pipeline.finalize_scene import Timeline
from gen_data.pipeline.numerics import numerics_digests
from gen_data.pipeline.scene_stages import finish_settled, finish_view
from gen_data.sensors.sensor_faults import deliver, with_calibrations

if TYPE_CHECKING:
    from collections.abc import Iterator


T = TypeVar("T")
SceneSource = Callable[
    [Streams], tuple[Scene, Sequence[interfaces.Randomizer], Sequence[interfaces.Sensor]]
]
"""Pure function from streams to nominal scene (sensors mounted), randomizers and sensors."""


@dataclass(frozen=True, eq=False)
class PipelineConfig:
    """Configuration of a pipeline, as data and pure functions.

    Attributes:
        info: Facts about the data set, for exporters.
        open_scene: Makes the nominal scene.
        channels: Channels that annotators need.
        image_truth: Annotates one reading.
        frame_truth: Annotates a sample as a whole, given the scene at the sample's instant by
            ``""`` and at each laser scanner's by its name, and the readings; None = no such
            annotations.
        sequence_annotators: Add to the annotations of samples as a whole, which they need.
        split_shares: ``{split: share}`` in order; shares sum to 1.
        split_assignment: How scenes are assigned to splits.
        layout_attempts_max: Largest number of attempts at one scene.
        strides: Steps between readings, by sensor; 1 for all others.
        located_errors: Opens a block that adds places in the configuration to errors of plug-ins.
    """

    info: interfaces.DatasetInfo
    open_scene: SceneSource
    channels: frozenset[Channel]
    image_truth: Callable[[Scene, SensorReading], ImageTruth]
    split_shares: Mapping[str, float]
    layout_attempts_max: int
    exporters: Mapping[str, interfaces.Exporter]
    strides: Mapping[str, int] = field(default_factory=dict)
    frame_truth: Callable[[Mapping[str, Scene], Capture], EgoTruth | None] | None = None
    sequence_annotators: Sequence[interfaces.SequenceAnnotator] = ()
    split_assignment: splits.Assignment = "random"
    located_errors: Callable[[], AbstractContextManager[None]] = nullcontext


@dataclass(frozen=True, slots=True)
class AcceptedScene:
    """A settled scene with its plug-ins and its history.

    Attributes:
        randomizers: Draw its views.
        sensors: Capture its views.
        attempt: Number of the accepted attempt, from 0.
        timings_s: CPU seconds by stage, all attempts together.
    """

    index: int
    scene: Scene
    randomizers: Sequence[interfaces.Randomizer]
    sensors: Sequence[interfaces.Sensor]
    attempt: int
    timings_s: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class DrawnView:
    """A view of a scene at the beginning of its sequence, with the streams that drew it.

    Attributes:
        number: Number of the view among the views of all scenes.
    """

    number: int
    scene: Scene
    streams: Streams


class Pipeline:
    """Owner of the engines; ``sample(index)`` depends only on the configuration and the index.

    The last accepted scene and view are cached, because the next index is usually another view or
    instant of them; the cache never changes a result.
    """

    def __init__(
        self,
        config: PipelineConfig,
        assets: interfaces.AssetLibrary,
        open_physics: Callable[[], interfaces.PhysicsEngine],
        open_renderer: Callable[[], interfaces.Renderer],
    ) -> None:
        self.config, self.info, self.exporters = config, config.info, config.exporters
        self.assets = assets
        self._open_physics = open_physics
        self._open_renderer = open_renderer
        self._physics: interfaces.PhysicsEngine | None = None
        self._resources = ExitStack()
        self._latest: AcceptedScene | None = None
        self._view: DrawnView | None = None
        self._lifted: tuple[Scene, Scene] | None = None
        self._begun: tuple[Scene, tuple[object, ...]] | None = None
        self._offsets_s = {s.name: s.time_offset_s for s in config.info.sensors}
        self._category_ids = {name: i for i, name in enumerate(config.info.categories, 1)}

    @cached_property
    def renderer(self) -> interfaces.Renderer:
        """The renderer, opened by the context or on first use; merging shards needs none."""
        return checked_renderer.CheckedRenderer(self._bare_renderer)

    @cached_property
    def _bare_renderer(self) -> interfaces.Renderer:
        return self._open_renderer()

    def __enter__(self) -> "Pipeline":
        """Start the engines."""
        engine = self._open_physics()
        # Open the renderer now: a machine that cannot render fails early.
        _ = self.renderer
        self._physics = self._resources.enter_context(engine)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the physics engine."""
        self._physics = None
        self._resources.close()

    def numerics(self) -> Mapping[str, str]:
        """Digests of small computations with these engines; see ``numerics_digests``."""
        return numerics_digests(self.renderer, self._physics)

    def prepare_asset(self, asset_id: str, *, collides: bool) -> None:
        """Store the data that the renderer derives from an asset, and physics if it may collide.

        Raises:
            AssetError: the asset cannot be made or read.
        """
        engines: tuple[object, ...] = (self._bare_renderer, self._physics if collides else None)
        for engine in engines:
            if isinstance(engine, interfaces.AssetPreparation):
                engine.prepare_asset(asset_id)

    def sample(self, index: int) -> Sample:
        """Generate sample number ``index``, from 0.

        Raises:
            ConfigError: a plug-in finds that a drawn value of its fields does not fit the scene.
            SceneRejected: no valid layout within the bounded number of attempts.
            SampleError: the labels contradict each other.
        """
        view_number, step_index = divmod(index, self.info.steps_per_scene)
        scene_index, view_index = divmod(view_number, self.info.views_per_scene)
        with self.config.located_errors():
            accepted = self.accepted_scene(scene_index)
            first = view_index == 0 and step_index == 0
            timings: dict[str, float] = dict(accepted.timings_s) if first else {}
            with _timed(timings, "randomize"):
                view = self.drawn_view(accepted, view_index)
            sample = self.read_sensors(view, accepted.sensors, step_index, timings)
        return replace(sample, attempts=accepted.attempt + 1)

    def read_sensors(
        self,
        view: DrawnView,
        sensors: Sequence[interfaces.Sensor],
        step_index: int,
        timings_s: Mapping[str, float] | None = None,
    ) -> Sample:
        """Read all sensors at one instant of a view, and annotate the readings.

        Args:
            view: The view at time 0, with these sensors in their places.
            sensors: In the order in which they read.
            step_index: Number of the instant.
            timings_s: CPU seconds spent before, by stage.

        Raises:
            SampleError: the labels contradict each other.
        """
        timings = dict(timings_s or {})
        with _timed(timings, "randomize"):
            begun = with_calibrations(view.scene, sensors, view.streams)
            timeline = Timeline(begun, self.assets, self._category_ids)
            time_s = step_index * self.info.step_s
            scene = timeline.at(time_s)
            streams = replace(view.streams, step=step_index)
        capture, truth = self._capture(timeline, time_s, sensors, streams, timings)
        with _timed(timings, "annotate"):
            swept = {name: timeline.at(c.time_s) for name, c in capture.clouds.items()}
            seen = {name: timeline.at(r.time_s) for name, r in capture.readings.items()}
            described = self.config.frame_truth
            frame = described({"": scene, **swept}, capture) if described is not None else None
            if frame is not None and self.config.sequence_annotators:
                frame = self._annotate_sequence(view, timeline, scene, capture, frame)
        return Sample(
            index=view.number * self.info.steps_per_scene + step_index,
            scene_index=streams.scene,
            view_index=view.number % self.info.views_per_scene,
            step_index=step_index,
            split=self.split(streams.scene),
            scene=scene,
            capture=capture,
            truth=_count_lidar_points(truth, capture.clouds),
            view_attempts=streams.attempt + 1,
            timings_s=timings,
            cameras=self.info.cameras,
            frame=frame,
            instants={n: s for n, s in {**swept, **seen}.items() if s is not scene},
        )

    def _capture(
        self,
        timeline: Timeline,
        time_s: float,
        sensors: Sequence[interfaces.Sensor],
        streams: Streams,
        timings_s: dict[str, float],
    ) -> tuple[Capture, dict[str, ImageTruth]]:
        """Readings of all sensors, each at its own instant, and the annotations of all images."""
        readings: dict[str, SensorReading] = {}
        clouds: dict[str, PointCloud] = {}
        tables: dict[str, Measurements] = {}
        truth: dict[str, ImageTruth] = {}
        for sensor in sensors:
            if streams.step % self.config.strides.get(sensor.name, 1):
                continue
            rng = streams.rng(f"sensor/{sensor.name}")
            scene = timeline.at(time_s + self._offsets_s[sensor.name])
            with _timed(timings_s, "render"):
                seen = sensor.capture(scene, self.renderer, self.config.channels, rng)
                seen = deliver(sensor, seen, rng)
            if isinstance(seen, PointCloud):
                clouds[sensor.name] = seen
            elif isinstance(seen, Measurements):
                tables[sensor.name] = seen
            else:
                with _timed(timings_s, "annotate"):
                    truth[sensor.name] = self.config.image_truth(timeline.at(seen.time_s), seen)
                readings[sensor.name] = seen
        return Capture(readings, clouds, tables), truth

    def _annotate_sequence(
        self,
        view: DrawnView,
        timeline: Timeline,
        scene: Scene,
        capture: Capture,
        truth: EgoTruth,
    ) -> EgoTruth:
        """Annotations that depend on the whole sequence, of which this is one step."""
        annotators = self.config.sequence_annotators
        steps, step_s = self.info.steps_per_scene, self.info.step_s
        sequence = interfaces.ViewSequence(
            timeline.at,
            tuple(k * step_s for k in range(steps)),
            self.assets,
            self.renderer,
            view.streams,
        )
        if self._begun is None or self._begun[0] is not view.scene:
            self._begun = view.scene, tuple(a.begin(sequence) for a in annotators)
        for annotator, begun in zip(annotators, self._begun[1], strict=True):
            truth = annotator.annotate_step(sequence, begun, scene, capture, truth)
        return truth

    def accepted_scene(self, scene_index: int) -> AcceptedScene:
        """The settled scene that its views share."""
        if self._latest is None or self._latest.index != scene_index:
            self._latest = self._accept(scene_index)
        return self._latest

    def split(self, scene_index: int) -> str:
        """Split of a scene and all of its views."""
        shares, assignment = self.config.split_shares, self.config.split_assignment
        return splits.split_of(scene_index, shares, assignment, self.info.seed)

    def _accept(self, scene_index: int) -> AcceptedScene:
        assert self._physics is not None, "use the pipeline as a context manager"
        physics = self._physics
        timings: dict[str, float] = {}

        def settle(attempt: int) -> AcceptedScene:
            streams = Streams(self.info.seed, scene_index, attempt=attempt, index=scene_index)
            with _timed(timings, "randomize"):
                nominal, randomizers, sensors = self.config.open_scene(streams)
                scene = self._randomize(nominal, randomizers, interfaces.Stage.BUILD, streams)
            with _timed(timings, "physics"):
                settled = physics.settle(scene)
            if settled.rejection is not None:
                raise errors.LayoutRejected(settled.rejection)
            scene = finish_settled(settled.scene, self.assets, self._category_ids)
            return AcceptedScene(scene_index, scene, randomizers, sensors, attempt, timings)

        return self._first_accepted(scene_index, settle)

    def _first_accepted(self, scene_index: int, draw: Callable[[int], T]) -> T:
        """Result of the first attempt that is not rejected; SceneRejected if all are."""
        rejections: list[errors.Rejection] = []
        for attempt in range(self.config.layout_attempts_max):
            try:
                return draw(attempt)
            except errors.LayoutRejected as refused:
                rejections.append(refused.rejection)
        raise errors.SceneRejected(scene_index, tuple(rejections))

    def drawn_view(self, accepted: AcceptedScene, view_index: int) -> DrawnView:
        """A view of a scene at time 0."""
        number = accepted.index * self.info.views_per_scene + view_index
        if self._view is not None and self._view.number == number:
            return self._view

        def draw(attempt: int) -> DrawnView:
            streams = self.info.view_streams(accepted.index, view_index, attempt)
            scene = self._randomize(
                accepted.scene.twin(self.info.twin(view_index)),
                accepted.randomizers,
                interfaces.Stage.VIEW,
                streams,
            )
            return DrawnView(number, self._finish(scene), streams)

        self._view = self._first_accepted(accepted.index, draw)
        return self._view

    def _finish(self, scene: Scene) -> Scene:
        """The scene of a view as it was drawn, ready for sensors."""
        finished = finish_view(scene, self.assets, self._category_ids, self._lifted)
        self._lifted = None if scene.relief is None else (scene, finished)
        return finished

    def _randomize(
        self,
        scene: Scene,
        randomizers: Sequence[interfaces.Randomizer],
        stage: interfaces.Stage,
        streams: Streams,
    ) -> Scene:
        """Apply the randomizers of a stage; ConfigError if there are too many instances."""
        for randomizer in randomizers:
            if randomizer.stage == stage:
                rng = streams.rng(f"randomizer/{randomizer.name}")
                scene = randomizer(scene, self.assets, rng)
        if len(scene.instances) > LABEL_IDS_MAX:
            raise errors.ConfigError(
                f"scene {streams.scene}: {len(scene.instances)} instances, but label images have "
                f"room for {LABEL_IDS_MAX}; place fewer objects"
            )
        return scene


def _count_lidar_points(
    truth: Mapping[str, ImageTruth], clouds: Mapping[str, PointCloud]
) -> Mapping[str, ImageTruth]:
    if not clouds:
        return truth
    counts = {name: np.bincount(c.points["instance_id"]) for name, c in sorted(clouds.items())}

    def add_counts(image: ImageTruth) -> ImageTruth:
        objects = []
        for item in image.objects:
            k = item.instance.instance_id
            points = {name: int(n[k]) if k < len(n) else 0 for name, n in counts.items()}
            objects.append(replace(item, lidar_points=points))
        return replace(image, objects=tuple(objects))

    return {name: add_counts(image) for name, image in truth.items()}


@contextmanager
def _timed(timings_s: dict[str, float], stage: str) -> "Iterator[None]":
    """Add the CPU time of a block to a stage. Timings are logged, never part of a data file.

    An error of the block remembers the stage.
    """
    started_s = time.process_time()
    try:
        with errors.in_stage(stage):
            yield
    finally:
        timings_s[stage] = timings_s.get(stage, 0.0) + time.process_time() - started_s
