"""From a Spec to a running Pipeline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import cv2

from generator.annotations.truth import complete_truth, frame_truth
from generator.assemble.references import check_references
from generator.assemble.spec import SceneConfig, Spec
from generator.assemble.tables import ANNOTATIONS, default_plugin
from generator.assets.library import Library, open_library
from generator.config.places import place_of_text
from generator.core.capture import Channel
from generator.core.errors import ConfigError, UnknownAsset
from generator.core.interfaces import (
    AnyAnnotator,
    AssetIndex,
    DatasetInfo,
    Exporter,
    Modality,
    Randomizer,
    Sensor,
    SensorInfo,
)
from generator.core.scene import Scene, SharedValue
from generator.physics import open_engine
from generator.pipeline import Pipeline
from generator.pipeline.pipeline import Recipe, SceneSource
from generator.sensors.mounting import refuse_buried, stride, within_steps
from scene_templates.builder import build

NOMINAL_SCENES_KEPT = 32


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
            open_renderer=partial(spec.render.open, library),
        )

    @cached_property
    def nominal(self) -> tuple[Scene, ...]:
        """Nominal scenes that between them hold whatever a scene may hold.

        Raises:
            ConfigError: a randomizer names what neither they nor the assets have.
        """
        library = open_library(self.spec.asset_folders)
        scenes = tuple(nominal_scene(self.spec, config, library) for config in self.spec.probes)
        check_references(self.spec, scenes, library)
        return scenes

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
    annotators = annotators_of(spec)
    info = dataset_info(spec, n, categories)
    return Recipe(
        info=info,
        open_scene=scene_source(spec, library),
        channels=frozenset().union(*(a.channels for a in annotators), extra_channels),
        image_truth=partial(
            complete_truth, annotators=annotators, thresholds=spec.head.labels, assets=library
        ),
        frame_truth=partial(frame_truth, annotators=annotators, assets=library),
        split_shares=spec.split_shares,
        split_assignment=spec.head.splits.assign,
        layout_attempts_max=spec.head.physics.layout_attempts_max,
        exporters=_exporters(spec, info, library),
        strides=_strides(info),
    )


def dataset_info(spec: Spec, n: int, categories: tuple[str, ...]) -> DatasetInfo:
    """Facts about the data set of a configuration."""
    return DatasetInfo(
        name=spec.name,
        seed=spec.head.seed,
        n=n,
        views_per_scene=spec.head.views_per_scene,
        categories=categories,
        sensors=tuple(sorted((s.describe() for s in spec.sensors), key=lambda s: s.name)),
        depth_scale_m=spec.head.depth_scale_m,
        steps_per_scene=spec.head.steps_per_scene,
        step_s=spec.head.step_s,
    )


def _check_durations(spec: Spec) -> None:
    """Raises ConfigError if a sequence is longer than the motion in it."""
    lasts_s = (spec.head.steps_per_scene - 1) * spec.head.step_s
    for config in spec.probes:
        for randomizer in config.randomizers:
            duration_s = randomizer.motion_duration_s
            if duration_s is not None and duration_s < lasts_s - 1e-9:
                raise ConfigError(
                    f"randomizers.{randomizer.name}.duration_s: {duration_s:g} s is shorter than "
                    f"the sequences, {spec.head.steps_per_scene} steps of {spec.head.step_s:g} s; "
                    f"expected at least {lasts_s:g}"
                )


def _strides(info: DatasetInfo) -> dict[str, int]:
    """Steps from one reading of a sensor to the next; devices may read several times per step."""
    return {
        s.name: stride(s.name, s.rate_hz, info.step_s)
        for s in info.sensors
        if s.modality is not Modality.DEVICE or not within_steps(s.rate_hz, info.step_s)
    }


def scene_source(spec: Spec, assets: AssetIndex) -> SceneSource:
    """The nominal scene and the randomizers of given streams; the last few are remembered."""

    @lru_cache(maxsize=NOMINAL_SCENES_KEPT)
    def made(
        shared: tuple[tuple[str, SharedValue], ...],
    ) -> tuple[Scene, Sequence[Randomizer], Sequence[Sensor]]:
        config = spec.scene_config(shared)
        return nominal_scene(spec, config, assets), config.randomizers, config.sensors

    return lambda streams: made(spec.shared(streams))


def nominal_scene(spec: Spec, config: SceneConfig, assets: AssetIndex) -> Scene:
    """The template's scene with every sensor mounted.

    Raises:
        ConfigError: an element or a sensor has no place in it.
    """
    try:
        scene = build(spec.head.template or spec.name, config.elements, assets)
    except UnknownAsset as error:
        place = place_of_text(spec.document, error.asset_id)
        if place is None:
            raise
        raise UnknownAsset(f"{place[0]}: {place[1]}: {error}", error.asset_id) from None
    scene = replace(scene, shared=config.shared, step_s=spec.head.step_s)
    for sensor in config.sensors:
        scene = sensor.mount(scene)
        info = sensor.describe()
        _check_mounted(scene, info)
        if info.needs_clear_view:
            refuse_buried(scene, info.name, assets)
    return scene


def _check_mounted(scene: Scene, info: SensorInfo) -> None:
    """Raises ConfigError if a plug-in's ``mount`` and ``describe`` contradict each other."""
    mounted = {
        Modality.CAMERA: [camera.name for camera in scene.cameras],
        Modality.LIDAR: [lidar.name for lidar in scene.lidars],
        Modality.DEVICE: [device.name for device in scene.devices],
    }
    if info.name not in mounted[info.modality]:
        raise ConfigError(
            f"sensor '{info.name}': describe() names a {info.modality.value}, but mount() adds no"
            f" {info.modality.value} of this name to the scene"
        )


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


def annotators_of(spec: Spec) -> Sequence[AnyAnnotator]:
    """The configuration's, then those that exporters need besides."""
    annotators = dict(spec.annotations)
    for exporter in spec.exporters:
        for name in sorted(exporter.needs - annotators.keys()):
            annotators[name] = default_plugin(ANNOTATIONS, name)
    return list(annotators.values())


def _exporters(spec: Spec, info: DatasetInfo, library: Library) -> dict[str, Exporter]:
    exporters: dict[str, Exporter] = {}
    for exporter in spec.exporters:
        if exporter.type in exporters:
            raise ConfigError(f"exporters: '{exporter.type}' is listed twice")
        exporter.check(info)
        exporters[exporter.type] = exporter.with_assets(library)
    return exporters
