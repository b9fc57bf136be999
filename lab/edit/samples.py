"""One picture of the grid: a sample of a text, rendered small, with its draws.

A view is drawn with the camera of the configuration, as in a data set, and only then rendered with
fewer pixels: every thumbnail shows the sample that the run will contain.
"""

from __future__ import annotations

import hashlib
import pickle
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from gen_data.annotations.annotate import annotate_reading
from gen_data.assemble import plugin_tables
from gen_data.assemble.config import parse_config
from gen_data.assemble.pipeline_factory import PipelineFactory, nominal_scene, pipeline_config
from gen_data.config.distributions import Constant
from gen_data.config.schema import to_plain_yaml
from gen_data.core import errors, optional_packages, plates
from gen_data.core.bounded_cache import CountCache
from gen_data.core.capture import Channel
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.temporary_folders import temporary_folder
from gen_data.lab.edit.document import Fault, analyse
from gen_data.lab.edit.files import ASSETS
from gen_data.lab.edit.overlays import (
    KINDS,
    LAYERS,
    View,
    draw_view,
    find_empty,
    first_kind,
)
from gen_data.lab.edit.reuse import Memory, RememberingPhysics
from gen_data.packs.provision import open_assets
from gen_data.physics import open_engine
from gen_data.pipeline import Pipeline
from gen_data.report.drawn_parameters import Draw, observe_randomizer, shared_draws
from gen_data.report.image_statistics import measure_look

if TYPE_CHECKING:
    from gen_data.assemble.config import Config
    from gen_data.assets.library import Library
    from gen_data.core.interfaces import AnyAnnotator, AssetLibrary, Randomizer, Renderer
    from gen_data.core.sample import Sample
    from gen_data.core.scene import Scene
    from gen_data.core.streams import Rng, Streams
    from gen_data.physics.physics_config import PhysicsConfig
    from gen_data.pipeline.pipeline import AcceptedScene, DrawnView
    from gen_data.preview.overlay import Image

TEXTS_KEPT = 4
"""Latest texts whose pipelines are kept: variants of one field share most of their assets."""
ENGINES_KEPT = 2
"""Renderers and physics engines of the latest settings: some tens of megabytes of assets each."""
SCENES_KEPT = 12
"""Number of packed scenes: of a grid of 24, each of two processes renders 12."""
SAMPLES_KEPT = 32
"""Latest small samples, on which other labels are drawn without rendering."""
DRAWS_MAX = 300
"""Parameters of a sample whose draws are listed."""
QUALITY = 85


@dataclass(frozen=True, slots=True)
class Order:
    """Order of one picture.

    Attributes:
        text, file: Text and path of the configuration, as for ``document.analyse``.
        index: Number of the sample.
        overrides: ``KEY=VALUE`` each.
        width_px: Largest width of the rendered image; 0 = as configured.
        pinned: Values that replace draws, by parameter as in ``Shown.draws``.
    """

    text: str
    file: str
    index: int
    view: View
    overrides: tuple[str, ...] = ()
    width_px: int = 240
    pinned: tuple[tuple[str, Any], ...] = ()

    def run(self, studio: Studio) -> Shown:
        """Render and draw it."""
        return studio.show(self)


@dataclass(frozen=True, slots=True)
class Recording:
    """Order of one sample with all sensors at full size, for the Rerun viewer."""

    order: Order

    def run(self, studio: Studio) -> bytes:
        """Content of a ``.rrd`` file."""
        return studio.record(self.order)


@dataclass(frozen=True, slots=True)
class Check:
    """Order of the faults of a text in all outcomes of its shared values."""

    text: str
    file: str

    def run(self, studio: Studio) -> tuple[Fault, ...]:
        """Faults, each with its place; empty = none."""
        del studio
        return analyse(self.text, self.file).faults


@dataclass(frozen=True, slots=True)
class Labelled:
    """A labelled object of a picture, in pixels of the configured image.

    Attributes:
        name: Name in the scene, made of the element's name and a number; empty = unknown.
        number: Instance number, which selects the colour of its labels; 0 = unknown.
    """

    category: str
    width_px: float
    height_px: float
    occlusion: float | None
    name: str = ""
    number: int = 0


@dataclass(frozen=True, slots=True)
class Shown:
    """A picture with the facts of its sample.

    Attributes:
        jpeg: Encoded picture.
        sensors: First kind of picture by name of every sensor that has one.
        draws: Drawn values by parameter, as plain data.
        brightness: Mean grey value of the photograph in [0, 1]; None without one.
        per_scene, per_view: Numbers of samples.
        cpu_s: Processor time.
        empty: Layers of the view, or its kind, for which the sample has no data.
    """

    jpeg: bytes
    index: int
    sensors: Mapping[str, str]
    objects: tuple[Labelled, ...]
    draws: Mapping[str, tuple[Any, ...]]
    brightness: float | None
    per_scene: int
    per_view: int
    cpu_s: float = 0.0
    empty: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Taken:
    """A sample with the reading of one sensor.

    Attributes:
        factor: Columns of the rendered image divided by columns of the configured image.
    """

    sample: Sample
    draws: Mapping[str, tuple[Any, ...]]
    factor: float


@dataclass
class Kept:
    """Assets, engines and scenes kept between texts: opening takes longer than a sample.

    Attributes:
        engines: Physics engines by settings; a pybullet engine is a connection, and a process
            has at most 1024 of them.
    """

    library: Library
    renderers: CountCache[Renderer] = field(default_factory=lambda: CountCache(ENGINES_KEPT))
    engines: CountCache[RememberingPhysics] = field(
        default_factory=lambda: CountCache(ENGINES_KEPT)
    )
    memory: Memory = field(default_factory=Memory)

    def renderer(self, settings: str, make: Callable[[], Renderer]) -> Renderer:
        """The renderer with the given settings; it keeps the scenes of a grid."""

        def opened() -> Renderer:
            from gen_data.renderers.warp.renderer import WarpRenderer

            renderer = make()
            if isinstance(renderer, WarpRenderer):
                renderer.keep_scenes(SCENES_KEPT)
            return renderer

        return self.renderers.get(settings, opened)

    def physics(self, settings: PhysicsConfig) -> RememberingPhysics:
        """The physics engine with the given settings."""
        text = repr(settings)
        return self.engines.get(
            text,
            lambda: RememberingPhysics(open_engine(self.library, settings), text, self.memory),
        )


class Studio:
    """Renders orders in one process; keeps assets, engines, pipelines and the latest samples."""

    def __init__(self) -> None:
        self._libraries: CountCache[Kept] = CountCache(2)
        self._opened: CountCache[OpenedText] = CountCache(TEXTS_KEPT)
        self._taken: CountCache[Taken] = CountCache(SAMPLES_KEPT)

    def show(self, order: Order) -> Shown:
        """Render and draw an order.

        Raises:
            GenDataError: as a run of the configuration would.
        """
        started_s = time.process_time()
        # The user may add a file again with another camera pose, or another unit.
        own = _index_time_ns(Path(order.file).parent / ASSETS)
        text = repr((order.text, order.file, order.overrides, order.pinned, own))
        opened = self._opened.get(text, lambda: self._open(order))
        view = opened.choose_sensor(order.view)
        needed = opened.annotations(view)
        place = (text, order.index, order.width_px, view.sensor, KINDS[view.kind], sorted(needed))
        taken = self._taken.get(repr(place), lambda: opened.take(order.index, view, order.width_px))
        unit = 1.0 if order.width_px else 1.5
        image = draw_view(taken.sample, view, opened.info.views, unit)
        return Shown(
            encode(image),
            order.index,
            opened.sensors,
            tuple(_objects(taken, view.sensor)),
            taken.draws,
            _brightness(taken.sample, view.sensor),
            opened.info.views_per_scene * opened.info.steps_per_scene,
            opened.info.steps_per_scene,
            time.process_time() - started_s,
            find_empty(taken.sample, view)
            | ({order.view.kind} if view.kind != order.view.kind else frozenset()),
        )

    def record(self, order: Order) -> bytes:
        """Record a sample for the Rerun viewer.

        Raises:
            ConfigError: its package is not installed.
            GenDataError: as a run of the configuration would.
        """
        missing = optional_packages.missing_packages("rerun")
        if missing:
            raise errors.ConfigError(f"a recording {missing}")
        from gen_data.preview.rerun_recording import save_recording

        opened = self._open(order, first_scene_only=False)
        with temporary_folder("edit") as folder:
            path = folder / "sample.rrd"
            sample = opened.sample(order.index)
            save_recording(path, [sample], opened.library, info=opened.info)
            return path.read_bytes()

    def _open(self, order: Order, *, first_scene_only: bool = True) -> OpenedText:
        """Open a text, by default with the first outcome of its shared values checked.

        Categories that only other scenes have then have no number: scans show them in the colour of
        unlabelled points.
        """
        name, once = Path(order.file).stem, first_scene_only
        config = parse_config(
            order.text, order.file, name, overrides=order.overrides, first_scene_only=once
        )
        folders = config.asset_folders
        opened = repr([(folder, _index_time_ns(folder)) for folder in folders])
        kept = self._libraries.get(opened, lambda: Kept(open_assets(folders)))
        return OpenedText(config, kept, dict(order.pinned))


def _index_time_ns(folder: Path) -> int:
    """Modification time of a folder's index; 0 without one. A newer index has other assets."""
    index = folder / "assets.yaml"
    return index.stat().st_mtime_ns if index.exists() else 0


class OpenedText:
    """The pipeline of one text, whose randomizers record their draws.

    Attributes:
        info: Facts about its data set.
        library: Its assets.
        sensors: First kind of picture by name of every sensor that has one.
    """

    def __init__(self, config: Config, kept: Kept, pinned: Mapping[str, Any]) -> None:
        # Formats have no pictures: whether they can hold the data set is checked before a run.
        factory = PipelineFactory(replace(config, exporters=()), n=1)
        vars(factory)["library"] = library = kept.library
        renderer = kept.renderer(repr(config.render), lambda: factory.renderer)
        vars(factory)["renderer"] = renderer
        self._config, self.library, self._pinned = config, library, pinned
        self._draws: dict[str, list[Draw]] = {}
        self._memory, self._nominal = kept.memory, factory.nominal
        self._physics = kept.physics(config.general.physics)
        self._settings = pipeline_config(config, library, 1, factory.categories, frozenset())
        self._pipeline = RememberingPipeline(
            self._settings,
            library,
            open_physics=lambda: self._physics,
            open_renderer=lambda: renderer,
        )
        self._pipeline.memory = kept.memory
        # All inputs of a nominal scene, and some more.
        apart = ("randomizers", "annotations", "exporters", "render")
        self._frame = repr({k: v for k, v in config.document.plain().items() if k not in apart})
        self._resources = ExitStack()
        self._resources.enter_context(self._pipeline)
        self.info = self._pipeline.info
        kinds = {sensor.name: first_kind(sensor) for sensor in self.info.sensors}
        self.sensors = {name: kind for name, kind in kinds.items() if kind}

    def choose_sensor(self, view: View) -> View:
        """The view with the name of a sensor: the first that has such pictures, else the first.

        Raises:
            ConfigError: no sensor has pictures.
        """
        names = [name for name, kind in self.sensors.items() if kind == view.modality]
        if view.sensor in names:
            return view
        if names:
            return replace(view, sensor=names[0])
        if not self.sensors:
            raise errors.ConfigError("sensors: none of them has pictures; expected a camera")
        name, kind = next(iter(self.sensors.items()))
        return replace(view, sensor=name, kind=kind)

    def annotations(self, view: View) -> dict[str, AnyAnnotator]:
        """Annotators for a view, and for the statistics."""
        names = {LAYERS[layer] for layer in view.layers} | {"boxes2d"}
        names |= {"visibility"} & self._config.annotations.keys()
        table = plugin_tables.ANNOTATIONS
        own = self._config.annotations
        return {n: own[n] if n in own else plugin_tables.default_plugin(table, n) for n in names}

    def sample(self, index: int) -> Sample:
        """A whole sample, as in a data set."""
        open_scene = self._observed_scene if self._pinned else self._settings.open_scene
        self._pipeline.config = replace(self._settings, open_scene=open_scene)
        return self._pipeline.sample(index)

    def take(self, index: int, view: View, width_px: int) -> Taken:
        """Take a sample with one sensor.

        Raises:
            GenDataError: as a run would.
        """
        pipeline, info = self._pipeline, self.info
        number, step = divmod(index, info.steps_per_scene)
        scene_index, view_index = divmod(number, info.views_per_scene)
        annotators = list(self.annotations(view).values())
        needed = frozenset().union(KINDS[view.kind], *(one.channels for one in annotators))
        pipeline.config = replace(
            self._settings, open_scene=self._observed_scene, channels=needed, frame_truth=None
        )
        with pipeline.config.located_errors():
            accepted = pipeline.accepted_scene(scene_index)
            drawn = pipeline.drawn_view(accepted, view_index)
            scene, factor = self._with_small_camera(drawn.scene, view.sensor, width_px)
            pipeline.config = replace(
                pipeline.config, image_truth=partial(self._annotate, annotators, factor)
            )
            every = pipeline.config.strides.get(view.sensor, 1)
            sensors = [one for one in accepted.sensors if one.name == view.sensor]
            read = pipeline.read_sensors(
                replace(drawn, scene=scene), sensors, step // every * every
            )
        return Taken(read, self._plain_draws(), factor)

    def _with_small_camera(self, scene: Scene, name: str, width_px: int) -> tuple[Scene, float]:
        """The scene with at most ``width_px`` camera columns (0 = all), and their share."""
        camera = next((one for one in scene.cameras if one.name == name), None)
        if camera is None or not 0 < width_px < camera.intrinsics.width_px:
            return scene, 1.0
        small = replace(camera, intrinsics=shrink(camera.intrinsics, width_px))
        if plates.has_plate(scene) and scene.environment is not None:
            # The part of the photograph behind a scene follows from the size of the image.
            small = plates.fit_camera(small, self.library.plate(scene.environment.image))
        cameras = tuple(small if one is camera else one for one in scene.cameras)
        return replace(scene, cameras=cameras), width_px / camera.intrinsics.width_px

    def _annotate(
        self, annotators: list[AnyAnnotator], factor: float, scene: Scene, reading: Any
    ) -> Any:
        limits = self._config.general.labels
        smaller = limits.model_copy(
            update={
                "min_visible_px": max(1, round(limits.min_visible_px * factor**2)),
                "min_box_px": max(1, round(limits.min_box_px * factor)),
            }
        )
        return annotate_reading(scene, reading, annotators, smaller, self.library)

    def _observed_scene(self, streams: Streams) -> Any:
        config, shared = self._config, self._config.shared(streams)
        # The first scene was read with the text. As text: 1, 1.0 and true are equal.
        known = (one for one in config.probes if repr(one.shared) == repr(shared))
        scene = next(known, None) or config.scene_config(shared)
        built = dict(zip(map(id, config.probes), self._nominal, strict=True))
        nominal = self._memory.get(
            self.library,
            (self._frame, repr(shared)),
            lambda: self._known_nominal(
                built.get(id(scene)) or nominal_scene(config, scene, self.library)
            ),
        )
        self._draws["shared"] = list(shared_draws(config, nominal))
        observed = [
            Observed(one, self._draws, self._memory, self._pinned) for one in scene.randomizers
        ]
        return nominal, observed, scene.sensors

    def _known_nominal(self, nominal: Scene) -> Scene:
        """An equal scene of an earlier text, as after a change of an exposure or a label."""
        content = hashlib.sha256(pickle.dumps(nominal)).digest()
        return self._memory.get(self.library, ("nominal", content), lambda: nominal)

    def _plain_draws(self) -> dict[str, tuple[Any, ...]]:
        found: dict[str, list[Any]] = {}
        for name, distribution, value in (draw for log in self._draws.values() for draw in log):
            if not isinstance(distribution, Constant):
                found.setdefault(name, []).append(to_plain_yaml(value))
        return {name: tuple(values) for name, values in list(found.items())[:DRAWS_MAX]}


class RememberingPipeline(Pipeline):
    """A pipeline that finishes no scene twice, whose randomizers show the draws of the latest view.

    Attributes:
        memory: Scenes as they were finished.
    """

    memory: Memory

    def drawn_view(self, accepted: AcceptedScene, view_index: int) -> DrawnView:
        """The view, drawn again: the latest draws belong to the last view of its scene."""
        drawn = self._draw_view(accepted, view_index)
        return replace(drawn, scene=self._finish(drawn.scene))

    def _finish_settled(self, scene: Scene) -> Scene:
        settings = ("settled", self.info.categories)
        return self.memory.get(
            scene, settings, lambda: super(RememberingPipeline, self)._finish_settled(scene)
        )

    def _finish(self, scene: Scene) -> Scene:
        settings = ("view", self.info.categories)
        return self.memory.get(
            scene, settings, lambda: super(RememberingPipeline, self)._finish(scene)
        )


class Observed:
    """A randomizer that keeps its latest draws, without draws of rejected attempts."""

    motion_duration_s: float | None = None

    def __init__(
        self,
        randomizer: Randomizer,
        draws: dict[str, list[Draw]],
        memory: Memory,
        pinned: Mapping[str, Any],
    ) -> None:
        self.name, self.stage = randomizer.name, randomizer.stage
        own = f"{self.name}."
        self._pinned = {name: value for name, value in pinned.items() if name.startswith(own)}
        self._randomizer, self._draws, self._memory = randomizer, draws, memory

    def __call__(self, scene: Scene, assets: AssetLibrary, rng: Rng) -> Scene:
        """Apply the randomizer, unless it had the same scene and stream before."""

        def draw() -> tuple[Scene, list[Draw]]:
            log: list[Draw] = []
            observed = observe_randomizer(self._randomizer, log, self._pinned)
            return observed(scene, assets, rng), log

        settings = (
            type(self._randomizer),
            repr(self._randomizer),
            rng.streams,
            repr(self._pinned),
        )
        drawn, self._draws[self.name] = self._memory.get(scene, settings, draw)
        return drawn


def shrink(lens: Intrinsics, width_px: int) -> Intrinsics:
    """The same field of view with ``width_px`` columns; pixels keep their shape, rounded."""
    height_px = max(1, round(lens.height_px * width_px / lens.width_px))
    x, y = width_px / lens.width_px, height_px / lens.height_px
    return Intrinsics(
        width_px,
        height_px,
        lens.fx_px * x,
        lens.fy_px * y,
        lens.cx_px * x,
        lens.cy_px * y,
        lens.lens,
    )


def _objects(taken: Taken, sensor: str) -> Iterator[Labelled]:
    truth = taken.sample.truth.get(sensor)
    for item in truth.objects if truth else ():
        if item.box is not None:
            width, height = item.box.x_max - item.box.x_min, item.box.y_max - item.box.y_min
            kind, factor = item.instance.category, taken.factor
            yield Labelled(
                kind,
                width / factor,
                height / factor,
                item.occlusion,
                item.instance.name,
                item.instance.instance_id,
            )


def _brightness(sample: Sample, sensor: str) -> float | None:
    reading = sample.capture.readings.get(sensor)
    if reading is None or Channel.RGB not in reading.channels:
        return None
    rgb = np.asarray(reading.channels[Channel.RGB], np.uint8)
    return measure_look(np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), np.uint8)).brightness


def encode(image: Image) -> bytes:
    """A picture as JPEG."""
    _, data = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    return data.tobytes()
