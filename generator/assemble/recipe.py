"""From a Spec to a running Pipeline."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import cv2

from generator.annotations.truth import AnyAnnotator, complete_truth, frame_truth
from generator.assemble.spec import Layout, Spec
from generator.assemble.tables import TABLES
from generator.assets.library import Library, open_library
from generator.core.capture import Channel
from generator.core.errors import ConfigError
from generator.core.interfaces import AssetIndex, DatasetInfo, Exporter, GeometryExporter, Renderer
from generator.core.scene import Scene, SharedValue
from generator.core.streams import Streams
from generator.physics import open_engine
from generator.pipeline import Pipeline
from generator.pipeline.pipeline import Blueprint, Recipe
from generator.sensors.mounting import refuse_buried, stride, within_steps
from scene_templates.builder import build

BLUEPRINTS_KEPT = 32
IMAGING = ("camera", "lidar")
LOOKING = (*IMAGING, "event_camera")
"""Modalities that see nothing from inside the body that carries them."""


@dataclass(frozen=True)
class PipelineFactory:
    """Makes the same Pipeline in any process; picklable.

    Attributes:
        n: Number of samples of the data set, as exporters are told.
        extra_channels: Channels to render beyond what sensors and annotators need.
    """

    spec: Spec
    n: int
    extra_channels: frozenset[Channel] = frozenset()

    def __call__(self) -> Pipeline:
        """A pipeline, to be used as a context manager."""
        # One process, one core: workers fill the others.
        cv2.setNumThreads(1)
        spec = self.spec
        library = open_library(spec.asset_folders)
        recipe = recipe_of(spec, library, self.n, self.categories, self.extra_channels)
        return Pipeline(
            recipe,
            library,
            open_physics=partial(open_engine, library, spec.head.physics),
            open_renderer=partial(_renderer, spec, library),
        )

    @cached_property
    def nominal(self) -> tuple[Scene, ...]:
        """Nominal scenes that between them hold whatever a scene may hold."""
        library = open_library(self.spec.asset_folders)
        return tuple(nominal_scene(self.spec, layout, library) for layout in self.spec.probes)

    @cached_property
    def categories(self) -> tuple[str, ...]:
        """Sorted names of all categories that a sample may contain."""
        return categories_of(self.nominal, open_library(self.spec.asset_folders))

    def __getstate__(self) -> dict[str, object]:
        """Other processes are told the categories, which take a second to find out."""
        categories = self.categories
        told = {name: value for name, value in self.__dict__.items() if name != "nominal"}
        return {**told, "categories": categories}


def open_pipeline(spec: Spec, extra_channels: frozenset[Channel] = frozenset()) -> Pipeline:
    """A pipeline to look at samples with, outside any data set."""
    return PipelineFactory(spec, n=1, extra_channels=extra_channels)()


def recipe_of(
    spec: Spec,
    library: Library,
    n: int,
    categories: tuple[str, ...],
    extra_channels: frozenset[Channel],
) -> Recipe:
    """Everything that samples depend on, resolved.

    Raises:
        ConfigError: when parts do not fit together, such as an exporter whose images no sensor
            writes.
    """
    _check_durations(spec)
    annotators = _annotators(spec)
    info = DatasetInfo(
        name=spec.name,
        seed=spec.head.seed,
        n=n,
        views_per_scene=spec.head.views_per_scene,
        categories=categories,
        sensors=tuple(sorted(s.name for s in spec.sensors if s.modality == "camera")),
        lidars=tuple(sorted(s.name for s in spec.sensors if s.modality == "lidar")),
        media={s.name: tuple(s.media) for s in spec.sensors if s.modality == "camera"},
        depth_scale_m=spec.head.depth_scale_m,
        devices={s.name: s.modality for s in spec.sensors if s.modality not in IMAGING},
        steps_per_scene=spec.head.steps_per_scene,
        step_s=spec.head.step_s,
        lenses={s.name: s.intrinsics().lens.model for s in spec.sensors if s.modality == "camera"},
    )
    exporters = _exporters(spec, info, library)
    needed = frozenset().union(*(a.channels for a in annotators), extra_channels)
    return Recipe(
        seed=spec.head.seed,
        views_per_scene=spec.head.views_per_scene,
        blueprint=blueprints(spec, library),
        channels=needed,
        image_truth=partial(
            complete_truth, annotators=annotators, thresholds=spec.head.labels, assets=library
        ),
        frame_truth=partial(frame_truth, annotators=annotators, assets=library),
        split_shares=spec.split_shares,
        split_assignment=spec.head.splits.assign,
        layout_attempts_max=spec.head.physics.layout_attempts_max,
        info=info,
        exporters=exporters,
        strides=_strides(spec),
        offsets_s={s.name: s.time_offset_s for s in spec.sensors if s.time_offset_s},
    )


def _check_durations(spec: Spec) -> None:
    """Raises ConfigError if a sequence goes on after what moves in it has come to its end."""
    lasts_s = (spec.head.steps_per_scene - 1) * spec.head.step_s
    for layout in spec.probes:
        for randomizer in layout.randomizers:
            duration_s = getattr(randomizer, "duration_s", None)
            if isinstance(duration_s, float) and duration_s < lasts_s - 1e-9:
                raise ConfigError(
                    f"randomizers.{randomizer.name}.duration_s: {duration_s:g} s is shorter than "
                    f"the sequences, {spec.head.steps_per_scene} steps of {spec.head.step_s:g} s; "
                    f"expected at least {lasts_s:g}"
                )


def _strides(spec: Spec) -> dict[str, int]:
    """Every how many steps a sensor reads; devices may also read several times in one."""
    return {
        s.name: stride(s.name, s.rate_hz, spec.head.step_s)
        for s in spec.sensors
        if s.modality in IMAGING or not within_steps(s.rate_hz, spec.head.step_s)
    }


def blueprints(spec: Spec, assets: AssetIndex) -> Callable[[Streams], Blueprint]:
    """The function that tells what one scene is made from; it remembers the last few."""

    @lru_cache(maxsize=BLUEPRINTS_KEPT)
    def made(shared: tuple[tuple[str, SharedValue], ...]) -> Blueprint:
        layout = spec.layout(shared)
        scene = nominal_scene(spec, layout, assets)
        return Blueprint(scene, layout.randomizers, layout.sensors)

    return lambda streams: made(spec.shared(streams))


def nominal_scene(spec: Spec, layout: Layout, assets: AssetIndex) -> Scene:
    """The template's scene with every sensor mounted."""
    scene = build(spec.head.template or spec.name, layout.elements, assets)
    scene = replace(scene, shared=layout.shared, step_s=spec.head.step_s)
    for sensor in layout.sensors:
        scene = sensor.mount(scene)
        if sensor.modality in LOOKING:
            refuse_buried(scene, sensor.name, sensor, assets)
    return scene


def _renderer(spec: Spec, library: Library) -> Renderer:
    render = spec.head.render
    renderer: Renderer = TABLES["renderer"].load(render.renderer)(
        library, render.device, render.settings
    )
    return renderer


def categories_of(scenes: Sequence[Scene], assets: AssetIndex) -> tuple[str, ...]:
    """Sorted names of all categories that a sample may contain."""
    placed = {i.category for scene in scenes for i in scene.instances if i.annotated}
    possible = {
        assets.get(asset_id).category
        for scene in scenes
        for group in scene.groups
        if group.annotated
        for asset_id in group.assets
    }
    return tuple(sorted(placed | possible))


def _annotators(spec: Spec) -> Sequence[AnyAnnotator]:
    """Those that were asked for, then those that exporters read besides."""
    annotators = dict(spec.annotations)
    for exporter in spec.exporters:
        for name in sorted(exporter.needs - annotators.keys()):
            annotators[name] = TABLES["annotation"].load(name)()
    return list(annotators.values())


def _exporters(spec: Spec, info: DatasetInfo, library: Library) -> dict[str, Exporter]:
    exporters: dict[str, Exporter] = {}
    for exporter in spec.exporters:
        name = exporter.type
        if name in exporters:
            raise ConfigError(f"exporters: '{name}' is listed twice")
        exporter.check(info)
        exporters[name] = (
            exporter.with_assets(library) if isinstance(exporter, GeometryExporter) else exporter
        )
    return exporters
