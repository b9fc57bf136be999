"""Construction of pipelines from configurations."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import cv2

from gen_data.annotations.annotate import annotate_ego, annotate_reading
from gen_data.annotations.occupancy import VoxelOccupancy
from gen_data.annotations.text import Text
from gen_data.assemble import plugin_tables, preflight
from gen_data.assemble.config import Config, SceneConfig
from gen_data.assets.library import Library
from gen_data.config.error_positions import located_errors
from gen_data.config.problems import Problem, Problems, refuse
from gen_data.config.yaml_tree import find_text
from gen_data.core import interfaces, path_names, plates
from gen_data.core.capture import Channel
from gen_data.core.errors import AssetError, ConfigError, ConfigWarning, Refusals, one_of
from gen_data.core.scene import LABEL_IDS_MAX, Scene, SharedValue
from gen_data.exporters.base import ExporterBase, check_delivery, check_image_formats
from gen_data.exporters.label_map import MappedExporter, category_of
from gen_data.packs.provision import open_assets
from gen_data.physics import missing_engine, open_engine
from gen_data.pipeline import Pipeline, exporter_views, pipeline
from gen_data.pipeline.delivered import delivered
from gen_data.randomizers.base import RandomizerBase
from gen_data.scene_templates.builder import build_scene
from gen_data.sensors.camera.plate_camera import PlateCamera
from gen_data.sensors.mounting import check_not_buried, stride, within_steps
from gen_data.sensors.sensor_faults import faults_of

NOMINAL_SCENES_KEPT = 32


@dataclass(frozen=True)
class PipelineFactory:
    """Makes the same Pipeline in any process; picklable.

    Attributes:
        n: Number of samples of the data set, for exporters.
        extra_channels: Channels to render in addition to the needs of sensors and annotators.
        known_categories: Categories of a finished data set, if its scenes are used; None = the
            categories that the configuration's scenes may contain.
    """

    config: Config
    n: int
    extra_channels: frozenset[Channel] = frozenset()
    known_categories: tuple[str, ...] | None = None

    def __call__(self) -> Pipeline:
        """Make a pipeline, which is used as a context manager."""
        # One core per process: workers use the others.
        cv2.setNumThreads(1)
        config, library = self.config, self.library
        resolved = pipeline_config(config, library, self.n, self.categories, self.extra_channels)
        return Pipeline(
            resolved,
            library,
            open_physics=partial(open_engine, library, config.general.physics),
            open_renderer=lambda: self.renderer,
        )

    @cached_property
    def library(self) -> Library:
        """Assets, of this process: opening them takes as long as building a simple scene."""
        return open_assets(self.config.asset_folders)

    @cached_property
    def renderer(self) -> interfaces.Renderer:
        """Renderer of this process, with the assets that it has uploaded.

        Raises:
            ConfigError: this machine lacks the device; the message has its place.
        """
        with located_errors(self.config.document):
            return self.config.render.open(self.library)

    @cached_property
    def nominal(self) -> tuple[Scene, ...]:
        """Nominal scenes, one per probe, that cover all possible contents of a scene.

        Raises:
            ConfigError: a randomizer refers to something that neither they nor the assets have.
        """
        config, library = self.config, self.library
        built: dict[tuple[int, ...], Scene] = {}
        scenes = []
        for probe in config.probes:
            # A probe shares its elements with others, as the same objects: many shared values, such
            # as the weather, concern randomizers only.
            key = tuple(map(id, probe.elements))
            if key not in built:
                built[key] = _build(config, probe, library)
            scenes.append(_mounted(config, probe, built[key], library))
        _check_references(config, scenes, library)
        return tuple(scenes)

    def check(self) -> None:
        """Refuse a configuration that cannot give samples or exports, before any engine starts.

        Raises:
            ConfigError: a sequence is too long, the physics engine is not installed, cameras form
                no rectified pair, or a format cannot hold the data set; all of it at once.
        """
        refused, config = Refusals(), self.config
        for check in (_check_durations, _check_twins, _check_engine):
            with refused.collected():
                check(config)
        with refused.collected():
            _ = self.nominal
        if "nominal" not in self.__dict__:  # The other checks need the scenes.
            refused.raise_if_any()
        with refused.collected():
            ready_exporters(config, self.info, self.library)
        for probe, scene in zip(config.probes, self.nominal, strict=True):
            with refused.collected():
                check_scene(config, scene)
            for error in (
                *preflight.unrectified_pairs(probe, scene, self.library),
                *preflight.tiny_fiducials(probe, scene, self.library),
            ):
                with refused.collected(), located_errors(config.document):
                    raise error
            for annotator in annotators_of(config):
                if isinstance(annotator, VoxelOccupancy):
                    with refused.collected(), located_errors(config.document):
                        annotator.check(scene)
        if any(isinstance(annotator, Text) for annotator in annotators_of(config)):
            asking = (e.type for e in config.exporters if "text" in exporter_views.needs_of(e))
            place = "annotations.text"
            if "text" not in config.annotations:
                place = f"exporter '{next(asking)}'"
            with refused.collected(), located_errors(config.document):
                preflight.check_text(config.probes, self.nominal, self.library, place)
        refused.raise_if_any()
        warn_of_subcategories(config, self.categories, self.library)
        self._warn_of_doubtful_scenes()

    def _warn_of_doubtful_scenes(self) -> None:
        """Warn with a ConfigWarning of sensors far from their rigs and cameras that look away."""
        if not self.config.annotations and not self.config.exporters:
            return  # Images alone are made on purpose.
        texts: dict[str, None] = {}
        for probe, scene in zip(self.config.probes, self.nominal, strict=True):
            for find in (preflight.far_sensors, preflight.cameras_that_look_away):
                texts |= dict.fromkeys(find(probe, scene))
            texts |= dict.fromkeys(preflight.single_towers(scene, self.library))
        for text in texts:
            warnings.warn(text, ConfigWarning, stacklevel=3)

    @property
    def info(self) -> interfaces.DatasetInfo:
        """Facts about the data set."""
        return dataset_info(self.config, self.n, self.categories)

    @cached_property
    def categories(self) -> tuple[str, ...]:
        """Sorted names of all categories that a sample may contain.

        Raises:
            ConfigError: a category, which names files, cannot name one.
        """
        if self.known_categories is not None:
            return self.known_categories
        return collect_categories(self.nominal, self.library)

    def __getstate__(self) -> dict[str, object]:
        """Pickle the categories, because finding them takes a second."""
        categories = self.categories
        state = {
            k: v for k, v in self.__dict__.items() if k not in ("library", "nominal", "renderer")
        }
        return {**state, "categories": categories}


def _check_references(
    config: Config, scenes: Sequence[Scene], assets: interfaces.AssetIndex
) -> None:
    """Refuse names of groups, categories and textures in randomizers that do not exist."""
    problems = Problems()
    for probe, scene in zip(config.probes, scenes, strict=True):
        for number, randomizer in enumerate(probe.randomizers):
            if not isinstance(randomizer, RandomizerBase):
                continue
            try:
                randomizer.check(scene, assets)
            except ConfigError as error:
                path, _, fact = str(error).partition(": ")
                field = path.removeprefix(f"randomizers.{randomizer.name}.")
                # A field with its default has no position.
                item = config.document.entries["randomizers"].items[number]
                position = (item.get(field) or item).position
                problems.add(position, f"randomizers[{number}].{field}", fact)
    problems.raise_if_any()


def open_pipeline(config: Config, extra_channels: frozenset[Channel] = frozenset()) -> Pipeline:
    """Open a pipeline for single samples, outside of a data set."""
    return PipelineFactory(config, n=1, extra_channels=extra_channels)()


def pipeline_config(
    config: Config,
    library: Library,
    n: int,
    categories: tuple[str, ...],
    extra_channels: frozenset[Channel],
) -> pipeline.PipelineConfig:
    """Resolve everything that samples depend on.

    Raises:
        ConfigError: parts do not fit together, such as an exporter without images of a sensor.
    """
    _check_durations(config)
    if len(categories) > LABEL_IDS_MAX:
        raise ConfigError(
            f"{len(categories)} categories, but label images have room for {LABEL_IDS_MAX}; "
            "give the assets fewer categories"
        )
    annotators = annotators_of(config)
    info = dataset_info(config, n, categories)
    return pipeline.PipelineConfig(
        info=info,
        open_scene=scene_source(config, library),
        channels=frozenset().union(*(a.channels for a in annotators), extra_channels),
        image_truth=partial(
            annotate_reading,
            annotators=annotators,
            thresholds=config.general.labels,
            assets=library,
        ),
        frame_truth=lambda scenes, capture: annotate_ego(scenes, annotators, library, capture),
        sequence_annotators=tuple(
            a for a in annotators if isinstance(a, interfaces.SequenceAnnotator)
        ),
        split_shares=config.split_shares,
        split_assignment=config.general.splits.assign,
        layout_attempts_max=config.general.physics.layout_attempts_max,
        exporters=ready_exporters(config, info, library),
        strides=_strides(info),
        located_errors=partial(located_errors, config.document),
    )


def dataset_info(config: Config, n: int, categories: tuple[str, ...]) -> interfaces.DatasetInfo:
    """Facts about the data set of a configuration."""
    return interfaces.DatasetInfo(
        name=config.name,
        seed=config.general.seed,
        n=n,
        views_per_scene=config.general.samples_per_scene // config.general.steps_per_scene,
        categories=categories,
        sensors=tuple(sorted(map(_described, config.sensors), key=lambda s: s.name)),
        depth_scale_m=config.general.depth_scale_m,
        steps_per_scene=config.general.steps_per_scene,
        step_s=config.general.step_s,
        publication=interfaces.Publication(**config.general.dataset.model_dump()),
        twins=config.general.twins,
    )


def _described(sensor: interfaces.Sensor) -> interfaces.SensorInfo:
    return replace(sensor.describe(), faults=faults_of(sensor).kinds)


def _check_durations(config: Config) -> None:
    """Raise ConfigError if a sequence is longer than the motion in it."""
    steps, step_s = config.general.steps_per_scene, config.general.step_s
    lasts_s = (steps - 1) * step_s
    for scene in config.probes:
        for randomizer in scene.randomizers:
            duration_s = randomizer.motion_duration_s
            if duration_s is not None and duration_s < lasts_s - 1e-9:
                with located_errors(config.document):
                    raise ConfigError(
                        f"randomizers.{randomizer.name}.duration_s: {duration_s:g} s is shorter "
                        f"than the sequences, {steps} steps of {step_s:g} s; "
                        f"expected at least {lasts_s:g}"
                    )


def _check_twins(config: Config) -> None:
    """Raise ConfigError if there is no task that twins could fail at."""
    kinds = {getattr(r, "type", "") for scene in config.probes for r in scene.randomizers}
    node = config.document.get("twins")
    if config.general.twins and node is not None and "arm_task" not in kinds:
        refuse(
            node.position,
            "twins",
            "no arm demonstrates a task; expected an element of type robot and the randomizer "
            "arm_task, or twins: false",
        )


def _check_engine(config: Config) -> None:
    """Raise ConfigError if the physics engine is not installed."""
    missing = missing_engine(config.general.physics.engine)
    if missing:
        # The default has no position.
        node = config.document.get("physics", "engine") or config.document
        refuse(node.position, "physics.engine", missing)


def _strides(info: interfaces.DatasetInfo) -> dict[str, int]:
    """Steps between the readings of each sensor; devices may have several readings per step."""
    return {
        s.name: stride(s.name, s.rate_hz, info.step_s)
        for s in info.sensors
        if s.modality is not interfaces.Modality.DEVICE or not within_steps(s.rate_hz, info.step_s)
    }


def scene_source(config: Config, assets: interfaces.AssetIndex) -> pipeline.SceneSource:
    """Function that makes nominal scene, randomizers and sensors of a scene; it is cached."""

    @lru_cache(maxsize=NOMINAL_SCENES_KEPT)
    def make(
        shared: tuple[tuple[str, SharedValue], ...],
    ) -> tuple[Scene, Sequence[interfaces.Randomizer], Sequence[interfaces.Sensor]]:
        scene_config = config.scene_config(shared)
        nominal = nominal_scene(config, scene_config, assets)
        return nominal, scene_config.randomizers, scene_config.sensors

    return lambda streams: make(config.shared(streams))


def nominal_scene(
    config: Config, scene_config: SceneConfig, assets: interfaces.AssetIndex
) -> Scene:
    """Build the scene of the template and mount all sensors.

    Raises:
        ConfigError: an element or a sensor does not fit into it.
    """
    return _mounted(config, scene_config, _build(config, scene_config, assets), assets)


def _build(config: Config, scene_config: SceneConfig, assets: interfaces.AssetIndex) -> Scene:
    """The scene of the template, which depends on the elements alone."""
    template = config.general.template or config.name
    try:
        with located_errors(config.document):
            return build_scene(template, scene_config.elements, assets)
    except AssetError as error:
        place = find_text(config.document, error.asset_id) if error.asset_id else None
        if place is None:
            raise
        raise type(error)(f"{place[0]}: {place[1]}: {error}", error.asset_id) from None


def _mounted(
    config: Config, scene_config: SceneConfig, built: Scene, assets: interfaces.AssetIndex
) -> Scene:
    """The scene with all sensors, shared values and settings of the data set."""
    scene = replace(
        built,
        shared=scene_config.shared,
        step_s=config.general.step_s,
        box3d=config.general.labels.box3d,
        twins=config.general.twins,
    )
    refused = Refusals()
    for sensor in scene_config.sensors:
        with refused.collected(), located_errors(config.document):
            scene = sensor.mount(scene)
            info = sensor.describe()
            _check_mounted(scene, info)
            if plates.has_plate(scene):
                _check_on_plate(sensor)
            if info.needs_clear_view:
                check_not_buried(scene, info.name, assets)
    refused.raise_if_any()
    return scene


def _check_mounted(scene: Scene, info: interfaces.SensorInfo) -> None:
    """Raise ConfigError if ``mount`` and ``describe`` of a plug-in contradict each other."""
    mounted = {
        interfaces.Modality.CAMERA: [camera.name for camera in scene.cameras],
        interfaces.Modality.LIDAR: [lidar.name for lidar in scene.lidars],
        interfaces.Modality.DEVICE: [device.name for device in scene.devices],
    }
    if info.name not in mounted[info.modality]:
        raise ConfigError(
            f"sensor '{info.name}': describe() names a {info.modality.value}, but mount() adds no"
            f" {info.modality.value} of this name to the scene"
        )


def _check_on_plate(sensor: interfaces.Sensor) -> None:
    """Refuse a sensor that would need more of the world than a photograph shows.

    Raises:
        ConfigError: it is not the camera of the photograph.
    """
    if not isinstance(sensor, PlateCamera):
        raise ConfigError(
            f"sensor '{sensor.name}': the world of a photograph has no geometry but its ground; "
            "expected a plate_camera"
        )


def collect_categories(scenes: Sequence[Scene], assets: interfaces.AssetIndex) -> tuple[str, ...]:
    """Sorted names of all categories that a sample may contain."""
    placed = {i.category for scene in scenes for i in scene.instances if i.annotated}
    groups = [g.assets for scene in scenes for g in scene.groups if g.annotated]
    possible = {assets.get(asset_id).category for asset_id in frozenset[str]().union(*groups)}
    for category in sorted(placed | possible):
        try:
            path_names.check_name(category, path_names.CATEGORY_MAX)
        except ValueError as error:
            raise ConfigError(f"category {error}") from None
    return tuple(sorted(placed | possible))


def annotators_of(config: Config) -> Sequence[interfaces.AnyAnnotator]:
    """Annotators of the configuration, then the others that exporters need."""
    annotators = dict(config.annotations)
    label_map = config.general.labels.map
    for needs in (label_map.needs, *map(exporter_views.needs_of, config.exporters)):
        for name in sorted(needs - annotators.keys()):
            annotators[name] = plugin_tables.default_plugin(plugin_tables.ANNOTATIONS, name)
    return list(annotators.values())


def check_scene(config: Config, scene: Scene) -> None:
    """Refuse a scene that a format cannot hold.

    Raises:
        ConfigError: the text names exporter and remedy.
    """
    refused = Refusals()
    for exporter in config.exporters:
        if isinstance(exporter, ExporterBase):
            with refused.collected(), located_errors(config.document):
                exporter.check_scene(scene)
                view = exporter_views.view_of(exporter, exporter, config.general.labels)
                if isinstance(view, exporter_views.ExporterView):
                    view.check_scene(scene)
    refused.raise_if_any()


def _check_label_map(config: Config, categories: Sequence[str]) -> None:
    """Refuse classes that no object can have, at their places; warn of unknown categories."""
    problems, label_map = Problems(), config.general.labels.map
    classes = config.document.get("labels", "map", "classes") or config.document
    for name, fact in label_map.faults(categories).items():
        problems.add(classes.key_position(name), ("labels", "map", "classes", name), fact)
    problems.raise_if_any()
    label_map.check(categories)


def warn_of_subcategories(config: Config, categories: Sequence[str], library: Library) -> None:
    """Warn with a ConfigWarning of subcategories in the label map that no object has.

    Not an error: plug-ins may give subcategories to objects.
    """
    finer = [source for source in config.general.labels.map.named if "/" in source]
    known = frozenset[str]().union(*(a.words for a in library.find(()))) if finer else frozenset()
    for source in finer:
        category = category_of(source)
        if category in categories and source not in known:
            same = sorted(word for word in known if word.startswith(f"{category}/"))
            expected = one_of(source, same) if same else f"'{category}' has no subcategories"
            node = config.document.get("labels", "map")
            found = find_text(node, source, ("labels", "map")) if node else None
            position, field = found or (config.document.position, "labels.map")
            text = Problem(position, field, f"no object is '{source}'; {expected}")
            warnings.warn(str(text), ConfigWarning, stacklevel=3)


def ready_exporters(
    config: Config, info: interfaces.DatasetInfo, library: Library
) -> dict[str, interfaces.Exporter]:
    """Exporters of a configuration by name, with its label map and the library.

    Raises:
        ConfigError: formats cannot hold the data set, or one is listed twice.
    """
    refused = Refusals()
    exporters: dict[str, interfaces.Exporter] = {}
    label_map = config.general.labels.map
    with refused.collected():
        _check_label_map(config, info.categories)
    for own in config.exporters:
        exporter = own if label_map.is_identity else MappedExporter(own, label_map)
        exporter = exporter_views.view_of(own, exporter, config.general.labels)
        if exporter.type in exporters:
            raise ConfigError(f"exporters: '{exporter.type}' is listed twice")
        with refused.collected(), located_errors(config.document):
            if not isinstance(exporter, exporter_views.ExporterView):
                check_image_formats(own, info)
                check_delivery(own, info)
        with refused.collected(), located_errors(config.document):
            exporter.check(info)
        exporters[exporter.type] = delivered(own, exporter, info).with_assets(library)
    refused.raise_if_any()
    return exporters
