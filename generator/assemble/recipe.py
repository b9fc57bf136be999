"""From a Spec to a running Pipeline."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import cv2

from generator.annotations.truth import image_truth
from generator.assemble.spec import Layout, Spec
from generator.assemble.tables import TABLES
from generator.assets.library import Library, open_library
from generator.core.capture import Channel
from generator.core.errors import ConfigError
from generator.core.interfaces import Annotator, AssetIndex, DatasetInfo, Exporter, Renderer
from generator.core.scene import Scene, SharedValue
from generator.core.streams import Streams
from generator.physics import open_engine
from generator.pipeline import Pipeline
from generator.pipeline.pipeline import Blueprint, Recipe
from generator.sensors.mounting import stride
from scene_templates.builder import build

BLUEPRINTS_KEPT = 32
IMAGING = ("camera", "lidar")


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
        recipe = recipe_of(spec, library, self.n, self.extra_channels)
        return Pipeline(
            recipe,
            library,
            open_physics=partial(open_engine, library, spec.head.physics),
            renderer=_renderer(spec, library),
        )


def open_pipeline(spec: Spec, extra_channels: frozenset[Channel] = frozenset()) -> Pipeline:
    """A pipeline to look at samples with, outside any data set."""
    return PipelineFactory(spec, n=1, extra_channels=extra_channels)()


def recipe_of(
    spec: Spec, library: Library, n: int, extra_channels: frozenset[Channel] = frozenset()
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
        categories=categories_of(nominal_scenes(spec, library), library),
        sensors=tuple(sorted(s.name for s in spec.sensors if s.modality == "camera")),
        lidars=tuple(sorted(s.name for s in spec.sensors if s.modality == "lidar")),
        media={s.name: tuple(s.media) for s in spec.sensors if s.modality == "camera"},
        depth_scale_m=spec.head.depth_scale_m,
        devices={s.name: s.modality for s in spec.sensors if s.modality not in IMAGING},
        steps_per_scene=spec.head.steps_per_scene,
        step_s=spec.head.step_s,
    )
    exporters = _exporters(spec, info)
    needed = frozenset().union(*(a.channels for a in annotators), extra_channels)
    return Recipe(
        seed=spec.head.seed,
        views_per_scene=spec.head.views_per_scene,
        blueprint=blueprints(spec, library),
        sensors=spec.sensors,
        channels=needed,
        image_truth=partial(image_truth, annotators=annotators, thresholds=spec.head.labels),
        split_shares=spec.split_shares,
        layout_attempts_max=spec.head.physics.layout_attempts_max,
        info=info,
        exporters=exporters,
        strides=_strides(spec),
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
    """Every how many steps cameras and laser scanners read."""
    return {
        s.name: stride(s.name, s.rate_hz, spec.head.step_s)
        for s in spec.sensors
        if s.modality in IMAGING
    }


def blueprints(spec: Spec, assets: AssetIndex) -> Callable[[Streams], Blueprint]:
    """The function that tells what one scene is made from; it remembers the last few."""

    @lru_cache(maxsize=BLUEPRINTS_KEPT)
    def made(shared: tuple[tuple[str, SharedValue], ...]) -> Blueprint:
        layout = spec.layout(shared)
        return Blueprint(nominal_scene(spec, layout, assets), layout.randomizers)

    return lambda streams: made(spec.shared(streams))


def nominal_scene(spec: Spec, layout: Layout, assets: AssetIndex) -> Scene:
    """The template's scene with every sensor mounted."""
    scene = build(spec.head.template or spec.name, layout.elements, assets)
    scene = replace(scene, shared=layout.shared)
    for sensor in spec.sensors:
        scene = sensor.mount(scene)
    return scene


def nominal_scenes(spec: Spec, assets: AssetIndex) -> tuple[Scene, ...]:
    """Nominal scenes that between them hold whatever a scene may hold."""
    return tuple(nominal_scene(spec, layout, assets) for layout in spec.probes)


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


def _annotators(spec: Spec) -> Sequence[Annotator]:
    """Those that were asked for, then those that exporters read besides."""
    names = list(spec.annotations)
    for exporter in spec.exporters:
        names += sorted(exporter.needs - set(names))
    return [TABLES["annotation"].load(name)() for name in names]


def _exporters(spec: Spec, info: DatasetInfo) -> dict[str, Exporter]:
    exporters: dict[str, Exporter] = {}
    for exporter in spec.exporters:
        name = exporter.type
        if name in exporters:
            raise ConfigError(f"exporters: '{name}' is listed twice")
        exporter.check(info)
        exporters[name] = exporter
    return exporters
