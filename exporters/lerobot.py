"""LeRobot data sets: episodes of a robot arm, for imitation learning.

::

    <split>/<robot>/                                  one data set per split and robot model
        meta/info.json, stats.json                    frame rate, features, totals; statistics
        meta/tasks.parquet                            sentences
        meta/episodes/chunk-000/file-000.parquet      place, length, task, statistics of episodes
        data/chunk-000/file-000.parquet               one row per frame, images embedded as PNG

That is format v3.0. Format v2.1, which LeRobot 0.3 and policies built on it read, has a file per
episode and JSON lines in ``meta``.

Features: ``observation.state``, the positions of all movable joints [rad or m];
``action``, their positions one step later, which a position controller would be given; and
``observation.images.<camera>``. Demonstrations of tasks (randomizer ``arm_task``) add
``observation.ee_pose``, the grasp frame in the frame of the arm's base [m, quaternion w x y z];
``observation.gripper`` and ``action.gripper``, its opening from 0 to 1; and texts
``annotation.{phase,held,contacts,failure}`` with ``annotation.succeeded``; twins also
``annotation.recovered``, the failure that happened in a success. Of every contact, in
the order of ``contacts`` and separated by commas, ``annotation.contact_forces_n`` has the normal
force and ``annotation.contact_points_m`` the point ``x y z`` in the world. ``timestamp`` is the
frame's number divided by the frame rate.

``geometry`` adds arrays: ``annotation.depth.<camera>`` and ``annotation.instance.<camera>``
[h, w], the 16-bit images of the shards; ``annotation.object_id`` [n] and
``annotation.object_pose`` [n, 7] of the annotated objects in the world, whose categories
``annotation.objects`` lists; ``annotation.contact_id`` [n, 2], instances in contact, and
``annotation.contact`` [n, 4]: normal force and point; ``annotation.relation`` [n, 3]: subject,
predicate and object, whose numbers ``info.json`` explains; ``annotation.K.<camera>``,
``annotation.T_world_camera.<camera>`` and, of bent lenses, ``annotation.distortion.<camera>``.
Arrays have no statistics, since policies do not read them. Rows without a value are 0.

Joints are named in ``info.json``, in the order of the robot's description. A task of several arms
has the joints, hands and openings of all, one arm after the other, with names ``<arm>.<joint>``.

An episode is a sequence: all instants of one view. Robots of different models have different
joints and hence separate data sets; so have splits, since training takes all episodes of a data
set. The task is a sentence made of the arm's goals and the objects that move.

Bytes of Parquet files depend on the release of pyarrow.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, groupby
from pathlib import Path
from typing import Any, ClassVar, Literal

from gen_data.core import capture, demonstrations, errors
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.core.scene import Articulation, Scene
from gen_data.exporters import (
    base,
    fragments,
    lerobot_files,
    lerobot_statistics,
    sequences,
    step_geometry,
)
from gen_data.exporters.conventions import ANY_LENS, Conventions
from gen_data.exporters.sensor_selection import rgb_camera, rgb_cameras

PHRASES = {
    "joints": "move to a posture",
    "reach": "reach a pose",
    "hold": "hold {object}",
    "grasp": "pick up {object}",
    "place": "put it down",
}
"""Phrase for each kind of an arm's goals."""


class LeRobot(base.AssetExporter):
    """LeRobot: joint positions and images of the episodes of one arm.

    Attributes:
        arm: Name of the arm; empty = the first one. Arms that its task names are exported with it.
        version: Format: ``v3.0`` for LeRobot 0.4 and later, ``v2.1`` for earlier releases.
        geometry: Geometry of every step: ``depth`` and ``instances``, images of these channels;
            ``poses`` of objects, ``contacts``, ``relations`` (a scene graph, of the annotation of
            that name) and ``calibration`` of the cameras.
    """

    type: Literal["lerobot"] = "lerobot"
    conventions: ClassVar[Conventions] = Conventions(
        lens=ANY_LENS, time="s from the episode's start"
    )

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    arm: str = ""
    version: Literal["v3.0", "v2.1"] = "v3.0"
    geometry: tuple[step_geometry.Part, ...] = ()

    @property
    def needs(self) -> frozenset[str]:
        """The annotation of the scene graph, where it is asked for."""
        return frozenset({"relations"} & {*self.geometry})

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: there are no sequences, a camera is missing, skips steps or lacks a
                channel, or a library is missing.
        """
        base.check_installed(self.type, "pyarrow")
        if info.steps_per_scene < 2:
            raise errors.ConfigError(
                f"exporter '{self.type}': episodes are sequences, but steps_per_scene is 1; "
                "set steps_per_scene, and an arm that moves"
            )
        step_geometry.check(info, self.geometry, self._cameras(info), self.type)
        for name in self._cameras(info):
            rate_hz = info.sensor(name).rate_hz
            if rate_hz is not None and rate_hz * info.step_s < 1.0 - 1e-9:
                raise errors.ConfigError(
                    f"exporter '{self.type}': camera '{name}' reads {rate_hz:g} times per second, "
                    f"but frames are {info.step_s:g} s apart; omit its rate_hz, or list the other "
                    "cameras in the exporter's cameras"
                )
            if "lost" in info.sensor(name).faults:
                raise errors.ConfigError(
                    f"exporter '{self.type}': sensor '{name}': faults.delivery.lost: frames have "
                    "an image of every camera; set it to 0, or list the other cameras in the "
                    "exporter's cameras"
                )

    def check_scene(self, scene: Scene) -> None:
        """Reject scenes without the arm. Raises ConfigError if the scene has no such arm."""
        self._find_arms(scene)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a line per frame: joints, task and statistics of images.

        Raises:
            ConfigError: a scene has no such arm; see also ``check``.
        """
        self.check(info)
        rows = (self._row(info, sample, shard_dir) for sample in samples)
        sequences.write_frames(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the episodes of all shards, then the totals of each data set."""
        folders: dict[tuple[str, str], lerobot_files.RobotFiles] = {}
        arrays = self._arrays(shard_dirs)
        for episode in self._episodes(shard_dirs):
            key = data_set(first := episode[0].row)
            if key not in folders:
                folder = dataset_dir / key[0] / key[1].replace("/", "_")
                layout = lerobot_files.LAYOUTS[self.version]
                folders[key] = layout(info, folder, first, arrays.get(key, {}))
            folders[key].add_episode(episode)
        for files in folders.values():
            files.close()

    def _episodes(self, shard_dirs: Sequence[Path]) -> Iterator[list[sequences.Frame]]:
        lines = fragments.fragment_rows(shard_dirs, self.type, sequences.FRAMES)
        return sequences.unbroken_episodes(sequences.Frame(*line) for line in lines)

    def _arrays(
        self, shard_dirs: Sequence[Path]
    ) -> dict[tuple[str, str], dict[str, step_geometry.Array]]:
        """Arrays of geometry of each data set, with room for the largest of its steps."""
        if not self.geometry:
            return {}
        firsts: dict[tuple[str, str], Mapping[str, Any]] = {}
        most: dict[tuple[str, str], dict[str, int]] = {}
        for frame in chain.from_iterable(self._episodes(shard_dirs)):
            key = data_set(frame.row)
            firsts.setdefault(key, frame.row)
            counts = most.setdefault(key, {})
            for name, value in frame.row["geometry"].items():
                counts[name] = max(counts.get(name, 1), len(value))
        return {
            key: step_geometry.array_features(self.geometry, first["images"], most[key])
            for key, first in firsts.items()
        }

    def _cameras(self, info: DatasetInfo) -> tuple[str, ...]:
        if not self.cameras:
            return rgb_cameras(info) or (rgb_camera(info, "", self.type),)
        names = base.select_names(self.cameras, info.cameras, f"exporter '{self.type}': cameras")
        return tuple(rgb_camera(info, name, self.type) for name in names)

    def _row(self, info: DatasetInfo, sample: Sample, shard_dir: Path) -> dict[str, Any]:
        arms, time_s = self._find_arms(sample.scene), sample.scene.time_s
        images = {
            camera: lerobot_statistics.image_sums(
                info.media_path(shard_dir, camera, capture.Channel.RGB, sample.index)
            )
            for camera in self._cameras(info)
        }
        robots = [self.library.robot(arm.asset) for arm in arms]
        pairs = list(zip(arms, robots, strict=True))
        steps = [demonstrations.demonstration_step(a, r, time_s, info.step_s) for a, r in pairs]
        geometry = step_geometry.step_values(sample, steps[0], self.geometry, images)
        return sequences.frame_facts(info, sample) | {
            **({"geometry": geometry} if self.geometry else {}),
            **({"arms": [arm.name for arm in arms]} if len(arms) > 1 else {}),
            "labels": _labels([step for step in steps if step], sample.scene.twins),
            "robot": "+".join(arm.asset for arm in arms),
            "joints": [
                f"{arm.name}.{joint.name}" if len(arms) > 1 else joint.name
                for arm, robot in pairs
                for joint in robot.movable
            ],
            "state": _positions(arms, time_s),
            "action": _positions(arms, time_s + info.step_s),
            "task": task_sentence(sample.scene, arms[0]),
            "images": images,
        }

    def _find_arms(self, scene: Scene) -> tuple[Articulation, ...]:
        """The arm, and the arms that its task names, which share its episode."""
        for arm in scene.articulations:
            if self.arm in ("", arm.name):
                named = {name for goal in arm.task for name in goal.arms} - {arm.name}
                others = (a for a in scene.articulations if a.name in named)
                return (arm, *(replace(a, episode=arm.episode) for a in others))
        known = ", ".join(arm.name for arm in scene.articulations) or "none"
        raise errors.ConfigError(
            f"exporter '{self.type}': the scene has no arm '{self.arm}'; expected one of: {known}"
            if self.arm
            else f"exporter '{self.type}': the scene has no arm; add an element of type robot and "
            "the randomizer arm_motion"
        )


def data_set(row: Mapping[str, Any]) -> tuple[str, str]:
    """Split and robot of a frame: robots of different models have different joints."""
    return row["split"], row["robot"]


def _positions(arms: Sequence[Articulation], time_s: float) -> list[float]:
    return [q for arm in arms for q in demonstrations.joint_positions(arm, time_s)]


def _labels(steps: Sequence[demonstrations.DemonstrationStep], twins: bool) -> dict[str, Any]:
    """Features of a demonstration at one instant, with numbers of all its arms."""
    if not steps:
        return {}
    step, poses = steps[0], [s.T_base_grasp for s in steps]
    pose = [v for p in poses for v in (*p.translation_m, *p.quaternion_wxyz)]
    openings: list[Any] = [[s.opening for s in steps], [s.opening_action for s in steps]]
    if len(steps) == 1:
        openings = [values[0] for values in openings]
    contacts = ", ".join(step.contacts)
    forces = ", ".join(f"{force_n:g}" for force_n in step.contact_forces_n)
    points = ", ".join(f"{x:g} {y:g} {z:g}" for x, y, z in step.contact_points_m)
    values = (pose, *openings, step.phase, step.held, contacts, forces, points, step.succeeded,
              step.failure, step.recovered)  # fmt: skip
    labels = dict(zip(lerobot_files.LABELS, values, strict=True))
    if not twins:
        del labels["annotation.recovered"]
    return labels


def task_sentence(scene: Scene, arm: Articulation) -> str:
    """Task of an arm in words, the same at all instants of a sequence."""
    if arm.assignment is not None:
        return arm.assignment.instruction
    goals = arm.task or ((arm.goal,) if arm.goal is not None else ())
    if not goals:
        return "Stay in place."
    moving = {track.body for track in scene.tracks}
    carried = {
        body.instance_id
        for body in scene.bodies
        if body.name in moving and body.instance_id != arm.instance_id
    }
    names = sorted({i.category for i in scene.instances if i.instance_id in carried})
    thing = f"the {names[0]}" if len(names) == 1 else "an object"
    phrases = [PHRASES[goal.kind].format(object=thing) for goal in goals]
    text = ", then ".join(phrase for phrase, _ in groupby(phrases))
    return f"{text[0].upper()}{text[1:]}."
