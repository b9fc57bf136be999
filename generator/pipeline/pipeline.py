"""One sample from one index."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np

from gen_data.core import errors, interfaces
from gen_data.core.capture import Capture, Channel, Measurements, PointCloud, SensorReading
from gen_data.core.sample import EgoTruth, ImageTruth, Sample
from gen_data.core.scene import Scene
from gen_data.core.streams import Streams
from gen_data.pipeline import attempts, checked_renderer, splits
from gen_data.pipeline.finalize_scene import Timeline
from gen_data.pipeline.numerics import numerics_digests
from gen_data.pipeline.scene_stages import finish_settled, finish_view
from gen_data.sensors.sensor_faults import deliver, with_calibrations

if TYPE_CHECKING:
    from collections.abc import Iterator


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
        layout_attempts_max: Largest number of attempts at a scene, and at a view of a layout.
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
class DrawnView:
    """A view of a scene at the beginning of its sequence, with the streams that drew it.

    Attributes:
        number: Number of the view among the views of all scenes.
    """

    number: int
    scene: Scene
    streams: Streams


@dataclass(frozen=True, slots=True)
class AcceptedScene:
    """A settled scene, of which every view can be drawn, with its plug-ins and its history.

    Attributes:
        randomizers: Draw its views.
        sensors: Capture its views.
        attempt: Number of the accepted attempt, from 0.
        timings_s: CPU seconds by stage, all attempts together.
        views: All of its views, as drawn and not finished. None where drawing one raised an error
            other than LayoutRejected: the samples of that view raise it.
    """

    index: int
    scene: Scene
    randomizers: Sequence[interfaces.Randomizer]
    sensors: Sequence[interfaces.Sensor]
    attempt: int
    timings_s: Mapping[str, float]
    views: tuple[DrawnView | None, ...] = ()


class Pipeline:
    """Owner of the engines; ``sample(index)`` depends only on the configuration and the index.

    The last accepted scene and view are cached, because the next index is usually another view or
    instant of them, and the last scene that was rejected; the cache never changes a result.
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
        self._rejected: tuple[int, tuple[errors.Rejection, ...]] | None = None
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
            SceneRejected: no layout within the bounded number of attempts is valid and has a place
                for the cameras of every view.
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
        """The settled scene that its views share.

        Raises:
            SceneRejected: all attempts at it were rejected.
        """
        if self._rejected is not None and self._rejected[0] == scene_index:
            raise errors.SceneRejected(*self._rejected)
        if self._latest is None or self._latest.index != scene_index:
            try:
                self._latest = self._accept(scene_index)
            except errors.SceneRejected as rejected:
                self._rejected = scene_index, rejected.rejections
                raise
        return self._latest

    def split(self, scene_index: int) -> str:
        """Split of a scene and all of its views."""
        shares, assignment = self.config.split_shares, self.config.split_assignment
        return splits.split_of(scene_index, shares, assignment, self.info.seed)

    def _accept(self, scene_index: int) -> AcceptedScene:
        """The first layout that is valid and of which every view can be drawn.

        All views are drawn whichever is asked for: the attempt that is accepted, and with it every
        sample, depends on the index of the scene only.
        """
        assert self._physics is not None, "use the pipeline as a context manager"
        physics = self._physics
        timings: dict[str, float] = {}

        def settle(attempt: int) -> AcceptedScene:
            streams = Streams(self.info.seed, scene_index, attempt=attempt, index=scene_index)
            with _timed(timings, "randomize"):
                nominal, randomizers, sensors = self.config.open_scene(streams)
                build = interfaces.Stage.BUILD
                scene = attempts.randomize(nominal, randomizers, build, self.assets, streams)
            with _timed(timings, "physics"):
                settled = physics.settle(scene)
            if settled.rejection is not None:
                raise errors.LayoutRejected(settled.rejection)
            scene = self._finish_settled(settled.scene)
            accepted = AcceptedScene(scene_index, scene, randomizers, sensors, attempt, timings)
            with _timed(timings, "randomize"):
                numbers = range(self.info.views_per_scene)
                views = tuple(self._view_unless_wrong(accepted, number) for number in numbers)
            return replace(accepted, views=views)

        return attempts.first_accepted(scene_index, self.config.layout_attempts_max, settle)

    def _view_unless_wrong(self, accepted: AcceptedScene, view_index: int) -> DrawnView | None:
        """A view, not finished; None if drawing it raises an error other than LayoutRejected."""
        try:
            return self._draw_view(accepted, view_index)
        except errors.LayoutRejected:
            raise
        except Exception:
            return None

    def drawn_view(self, accepted: AcceptedScene, view_index: int) -> DrawnView:
        """A view of a scene at time 0."""
        number = accepted.index * self.info.views_per_scene + view_index
        if self._view is None or self._view.number != number:
            kept = accepted.views[view_index] if accepted.views else None
            drawn = kept or self._draw_view(accepted, view_index)
            self._view = replace(drawn, scene=self._finish(drawn.scene))
        return self._view

    def _draw_view(self, accepted: AcceptedScene, view_index: int) -> DrawnView:
        """A view, not finished. Raises LayoutRejected if this layout leaves no place for it."""
        scene, streams = attempts.draw_view(
            accepted.scene,
            accepted.index,
            view_index,
            accepted.randomizers,
            self.info,
            self.assets,
            self.config.layout_attempts_max,
        )
        return DrawnView(accepted.index * self.info.views_per_scene + view_index, scene, streams)

    def _finish_settled(self, scene: Scene) -> Scene:
        """The scene that its views share, from the one that physics settled."""
        return finish_settled(scene, self.assets, self._category_ids)

    def _finish(self, scene: Scene) -> Scene:
        """The scene of a view as it was drawn, ready for sensors."""
        finished = finish_view(scene, self.assets, self._category_ids, self._lifted)
        self._lifted = None if scene.relief is None else (scene, finished)
        return finished


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
