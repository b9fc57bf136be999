"""The scenes of a finished data set, rendered again with other sensors, weather or light.

Objects keep their ids, shapes and poses; randomizers that are not changed are not drawn again. The
two data sets are pairs: they differ in the changes only (counterfactual images).
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from gen_data.assemble.config import Config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assemble.size_estimate import estimate_sample_bytes
from gen_data.config.shared_values import REFERENCE
from gen_data.core import errors, scene_time, serialization
from gen_data.core.interfaces import DatasetInfo, Exporter, Randomizer, Sensor, Stage
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.core.streams import Streams
from gen_data.pipeline import Pipeline
from gen_data.pipeline.finalize_scene import finalize_scene
from gen_data.pipeline.pipeline import DrawnView
from gen_data.runner.failed_sample import FailedSample
from gen_data.runner.identity import format_licences, make_plan
from gen_data.runner.plan import Plan
from gen_data.runner.progress import Summary
from gen_data.runner.run import Settings, run
from gen_data.runner.stored import CheckedSamples, StoredSamples
from gen_data.runner.verify import check_source


@dataclass(frozen=True)
class RerenderFactory:
    """Makes the same RerenderedScenes in any process; picklable.

    Attributes:
        stored: The finished data set.
        factory: Factory of the changed configuration.
        changed_sensors: Names of the sensors that differ from the data set's.
        redrawn: Names of the randomizers to draw again, on top of the stored scenes.
        detached: Names of the shared values that no longer describe the scenes.
    """

    stored: StoredSamples
    factory: PipelineFactory
    changed_sensors: frozenset[str]
    redrawn: frozenset[str]
    detached: frozenset[str] = frozenset()

    def __call__(self) -> "RerenderedScenes":
        """Make the pipeline of a process."""
        return RerenderedScenes(self, self.factory())


@dataclass(frozen=True)
class RerenderedScenes:
    """A pipeline with the scenes of a finished data set."""

    plan: RerenderFactory
    pipeline: Pipeline

    @property
    def info(self) -> DatasetInfo:
        """Facts about the new data set."""
        return self.pipeline.info

    @property
    def exporters(self) -> Mapping[str, Exporter]:
        """Exporters by name."""
        return self.pipeline.exporters

    def __enter__(self) -> "RerenderedScenes":
        """Open the renderer; physics is not needed."""
        _ = self.pipeline.renderer
        return self

    def __exit__(self, *exception: object) -> None:
        """Drop the loaded data."""
        self.plan.stored.close()

    def numerics(self) -> Mapping[str, str]:
        """Digests of small computations; see ``Pipeline.numerics``."""
        return self.pipeline.numerics()

    def sample(self, index: int) -> Sample:
        """Render the scene of a sample again.

        Raises:
            ConfigError: a randomizer that was drawn again moved, added or removed an object.
        """
        step_index = index % self.info.steps_per_scene
        first = self.plan.stored.sample(index - step_index)
        streams = Streams(
            self.info.seed, first.scene_index, attempt=first.attempts - 1, index=first.scene_index
        )
        nominal, randomizers, sensors = self.pipeline.config.open_scene(streams)
        scene = self._with_sensors(first.scene, nominal, sensors)
        view_streams = self.info.view_streams(
            first.scene_index, first.view_index, first.view_attempts - 1
        )
        scene = self._redraw(scene, randomizers, {Stage.BUILD: streams, Stage.VIEW: view_streams})
        if scene.box3d != nominal.box3d:
            ids = {name: number for number, name in enumerate(self.info.categories, 1)}
            scene = replace(scene, box3d=nominal.box3d)
            scene = finalize_scene(scene, self.pipeline.assets, ids)
        number = first.scene_index * self.info.views_per_scene + first.view_index
        view = DrawnView(number, scene_time.place_sensors(scene), view_streams)
        return replace(
            self.pipeline.read_sensors(view, sensors, step_index),
            split=first.split,
            attempts=first.attempts,
        )

    def _with_sensors(self, scene: Scene, nominal: Scene, sensors: Sequence[Sensor]) -> Scene:
        """The scene with the sensors and shared values of the new configuration.

        Unchanged sensors stay as they are. A changed camera without a rig keeps its pose; a new one
        has the pose of the first camera without a rig.
        """
        kept = {s.name for s in sensors} - self.plan.changed_sensors
        old = {c.name: c for c in scene.cameras}
        free = [c for c in scene.cameras if not c.rig]
        cameras = []
        for camera in nominal.cameras:
            if camera.name in kept:
                cameras.append(old[camera.name])
            elif camera.rig or not free:
                cameras.append(camera)
            else:
                same_view = old.get(camera.name, free[0])
                cameras.append(replace(camera, T_world_camera=same_view.T_world_camera))
        lidars = {lidar.name: lidar for lidar in scene.lidars}
        devices = {device.name: device for device in scene.devices}
        return replace(
            scene,
            shared=tuple(pair for pair in nominal.shared if pair[0] not in self.plan.detached),
            cameras=tuple(cameras),
            lidars=tuple(lidars[n.name] if n.name in kept else n for n in nominal.lidars),
            devices=tuple(devices[n.name] if n.name in kept else n for n in nominal.devices),
        )

    def _redraw(
        self, scene: Scene, randomizers: Sequence[Randomizer], streams: Mapping[Stage, Streams]
    ) -> Scene:
        before = _geometry(scene)
        for stage in (Stage.BUILD, Stage.VIEW):
            for randomizer in randomizers:
                if randomizer.stage == stage and randomizer.name in self.plan.redrawn:
                    rng = streams[stage].rng(f"randomizer/{randomizer.name}")
                    scene = randomizer(scene, self.pipeline.assets, rng)
                    if _geometry(scene) != before:
                        raise errors.ConfigError(
                            f"randomizers.{randomizer.name}: moves, adds or removes objects, but "
                            "rerender keeps the scenes of the data set; generate a new data set "
                            "instead"
                        )
        return scene


def _geometry(scene: Scene) -> object:
    """Everything that stays the same: objects, their shapes, poses and motion.

    Their materials and attributes may change, such as a car's lights.
    """
    bodies = [
        (b.name, b.asset, b.scale, b.T_world_body, b.instance_id)
        for b in scene.bodies
        if b.instance_id
    ]
    objects = [
        (i.instance_id, i.name, i.category, i.asset, i.T_world_instance, i.box_min_m, i.box_max_m)
        for i in scene.instances
    ]
    return bodies, objects, scene.tracks, scene.articulations


def rerender(
    stored: StoredSamples,
    was: Config,
    now: Config,
    out: Path,
    settings: Settings,
    redraw: Sequence[str] = (),
) -> Summary:
    """Render the scenes of a finished data set again, as a separate data set.

    Args:
        stored: The data set.
        was: Its configuration.
        now: The changed configuration.
        out: Folder of the new data set.
        settings: Choices of the caller; the size of a sample and failed samples are added.
        redraw: Names of further randomizers to draw again.

    Raises:
        ConfigError: the change is none of sensors, rendering, annotations, exporters, labels or
            randomizers.
        GenDataError: see ``run``.
    """
    plan, maker = rerender_plan(stored, was, now, redraw)
    return run(
        plan,
        maker,
        out,
        replace(
            settings,
            sample_bytes=estimate_sample_bytes(now, maker.factory.info),
            failed=_absent(stored),
        ),
        licences=lambda used: format_licences(maker.factory, used),
    )


def _absent(stored: StoredSamples) -> tuple[FailedSample, ...]:
    """Samples that cannot be rendered again: those without a scene at the first instant."""
    absent = {failure.index: failure for failure in stored.failed}
    steps = stored.info.steps_per_scene
    for first in [index for index in absent if index % steps == 0]:
        for index in range(first, min(first + steps, stored.plan.n)):
            absent.setdefault(index, FailedSample(index, "scene", f"sample {first} does not exist"))
    return tuple(absent[index] for index in sorted(absent))


def rerender_plan(
    stored: StoredSamples, was: Config, now: Config, redraw: Sequence[str]
) -> tuple[Plan, RerenderFactory]:
    """Plan of a re-rendering, and the maker of its pipelines; arguments as of ``rerender``.

    Raises:
        ConfigError: see ``rerender``.
    """
    check_source(stored.folder)
    changes = Changes(was, now)
    changes.check(redraw)
    for name in sorted(changes.detached):
        warnings.warn(
            f"shared.{name}: a randomizer no longer refers to it but has its own value, so "
            f"images no longer have the attribute '{name}'; to change it: --set shared.{name}=...",
            errors.ConfigWarning,
            stacklevel=2,
        )
    factory = PipelineFactory(now, stored.plan.n, known_categories=stored.categories)
    maker = RerenderFactory(
        CheckedSamples(stored.folder),
        factory,
        changes.sensors,
        changes.randomizers | set(redraw),
        changes.detached,
    )
    plan = replace(
        make_plan(factory), name=stored.plan.name, scenes_of=f"{stored.dataset_id} {sorted(redraw)}"
    )
    return plan, maker


CHANGEABLE = frozenset(
    {"annotations", "dataset", "exporters", "labels", "randomizers", "render", "sensors", "shared"}
)
"""Sections in which a configuration may differ from the data set's."""


@dataclass(frozen=True)
class Changes:
    """Differences of two configurations."""

    was: Config
    now: Config

    @cached_property
    def sensors(self) -> frozenset[str]:
        """Names of sensors that are new or have other settings."""
        return _changed_entries(_sensors(self.was), _sensors(self.now))

    @cached_property
    def randomizers(self) -> frozenset[str]:
        """Names of randomizers that are new, changed, or refer to a changed shared value."""
        before, after = (c.resolved.get("shared") or {} for c in (self.was, self.now))
        values = {f'"{REFERENCE}{k}"' for k, v in after.items() if before.get(k) != v}
        entries = _randomizers(self.now)
        referring = {k for k, v in entries.items() if any(text in v for text in values)}
        return _changed_entries(_randomizers(self.was), entries) | referring

    @cached_property
    def detached(self) -> frozenset[str]:
        """Names of shared values to which a randomizer of the same name refers no longer.

        Attributes of images are shared values: they would not describe the scene.
        """
        before, after = _randomizers(self.was), _randomizers(self.now)
        return frozenset(
            name
            for name in self.was.resolved.get("shared") or {}
            for text in (f'"{REFERENCE}{name}"',)
            if any(text in entry and text not in after.get(k, "") for k, entry in before.items())
        )

    def check(self, redraw: Sequence[str]) -> None:
        """Reject changes that would change the scenes.

        Raises:
            ConfigError: the message names the section or randomizer.
        """
        was, now = self.was.resolved, self.now.resolved
        for key in sorted({*was, *now} - CHANGEABLE):
            if was.get(key) != now.get(key):
                raise errors.ConfigError(
                    f"{key}: cannot change, as rerender keeps the scenes of the data set; expected "
                    f"changes of {', '.join(sorted(CHANGEABLE))} only"
                )
        listed = _randomizers(self.now).keys()
        gone = sorted(_randomizers(self.was).keys() - listed)
        if gone:
            raise errors.ConfigError(
                f"randomizers.{gone[0]}: was drawn into the scenes of the data set and "
                "cannot be left out; change its settings instead"
            )
        unknown = sorted(set(redraw) - listed)
        if unknown:
            raise errors.ConfigError(
                f"--redraw {unknown[0]}: there is no such randomizer; expected some of "
                f"{', '.join(sorted(listed))}{errors.did_you_mean(unknown[0], listed)}"
            )


def _sensors(config: Config) -> dict[str, str]:
    pairs = zip(config.sensors, config.resolved["sensors"], strict=True)
    return {sensor.name: serialization.canonical_json(entry) for sensor, entry in pairs}


def _randomizers(config: Config) -> dict[str, str]:
    pairs = zip(config.probes[0].randomizers, config.resolved["randomizers"], strict=True)
    return {randomizer.name: serialization.canonical_json(entry) for randomizer, entry in pairs}


def _changed_entries(was: Mapping[str, str], now: Mapping[str, str]) -> frozenset[str]:
    return frozenset(name for name, entry in now.items() if was.get(name) != entry)
