"""Labels of demonstrations in episodes, read by pyarrow and protobuf."""

import io
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from gen_data.core.capture import Channel
from gen_data.core.demonstrations import demonstration_step
from gen_data.core.errors import ConfigError
from gen_data.core.lens import Lens
from gen_data.core.sample import EgoTruth, Relation
from gen_data.core.scene import Assignment, ContactSpan, Episode, Span
from gen_data.core.se3 import SE3
from gen_data.exporters.lerobot import LeRobot
from gen_data.exporters.rlds import Rlds
from gen_data.exporters.step_geometry import Part
from tests.exporters.datasets import in_scene
from tests.exporters.drives import drive_info
from tests.exporters.label_readers import records
from tests.exporters.test_lerobot import rows_of, tasks_of
from tests.randomizers.doubles import two_link_arm
from tests.tiers import slow

INSTRUCTION = "Put the crate on the mat."
EPISODE = Episode(
    False,
    "slip",
    (Span("pick", 0.0, 0.2), Span("place", 0.2, 0.4)),
    (Span("crate/0", 0.1, 0.3),),
    (
        ContactSpan("arm/finger + crate/0", 0.1, 0.3, 0.1, (1.5, 2.5), ((0.1, 0.2, 0.3),) * 2),
        ContactSpan("crate/0 + table", 0.2, 0.3, 0.1, (9.81,), ((0.0, 0.5, 0.75),)),
    ),
)


def demonstrated(world: Any) -> Any:
    """Two sequences of four steps of 0.1 s, in which a crate slips."""
    assignment = Assignment("put", INSTRUCTION)
    return [with_arm(s, assignment=assignment, episode=EPISODE) for s in world.reach()]


def with_arm(sample: Any, **changes: Any) -> Any:
    (arm,) = sample.scene.articulations
    return in_scene(sample, articulations=(replace(arm, **changes),))


@pytest.fixture(scope="module")
def samples(world: Any) -> Any:
    return demonstrated(world)


@pytest.fixture
def export(world: Any, tmp_path: Path) -> Callable[..., Path]:
    """Writes episodes into a folder, and returns the part of the arms."""

    def written(exporter: Any, samples: Any, place: str = "train/toys_arm") -> Path:
        folder: Path = world.export(exporter, drive_info(world), samples, tmp_path / exporter.type)
        return folder / place

    return written


def test_lerobot_has_what_the_arm_does_each_step(samples: Any, export: Any) -> None:
    """At 0, 0.1, 0.2 and 0.3 s; the hand's pose follows from the step's joints."""
    folder = export(LeRobot(), samples)
    rows = rows_of(folder)
    assert list(tasks_of(folder).values()) == [INSTRUCTION]
    assert [row["annotation.phase"] for row in rows] == ["pick", "pick", "place", "place"]
    assert [row["annotation.held"] for row in rows] == ["", "crate/0", "crate/0", ""]
    assert [row["annotation.contacts"] for row in rows] == [
        "", "arm/finger + crate/0", "arm/finger + crate/0, crate/0 + table", ""]  # fmt: skip
    assert [row["annotation.contact_forces_n"] for row in rows] == ["", "1.5", "2.5, 9.81", ""]
    assert rows[2]["annotation.contact_points_m"] == "0.1 0.2 0.3, 0 0.5 0.75"
    assert {(row["annotation.succeeded"], row["annotation.failure"]) for row in rows} == {
        (False, "slip")
    }
    assert features_of(folder)["observation.ee_pose"]["shape"] == [7]
    for row in rows:
        assert np.linalg.norm(row["observation.ee_pose"][3:]) == pytest.approx(1.0, abs=1e-6)


def features_of(folder: Path) -> Any:
    return json.loads((folder / "meta/info.json").read_text())["features"]


def episodes_of(folder: Path) -> list[dict[str, Any]]:
    """Values by key, by protobuf."""
    (path,) = folder.glob("*.tfrecord")
    return [{key: found for key, (_, found) in one.items()} for one in records(path)]


def assert_written(folder: Path, samples: Any) -> None:
    """Lists of four steps; vectors of the steps follow one another; a failure has no reward."""
    (example,), described = episodes_of(folder), json.loads((folder / "metadata.json").read_text())
    assert set(example) == set(described)
    for key, fact in described.items():
        count = 4 if key.startswith("steps/") else 1
        assert len(example[key]) == count * fact["length"], key
    assert example["steps/is_first"] == [1, 0, 0, 0]
    assert example["steps/is_last"] == [0, 0, 0, 1]
    assert example["steps/reward"] == [0.0] * 4
    assert example["steps/language_instruction"] == [INSTRUCTION.encode()] * 4
    assert example["steps/phase"] == [b"pick", b"pick", b"place", b"place"]
    assert example["episode_metadata/failure"] == [b"slip"]
    assert example["steps/contact_forces_n"] == [b"", b"1.5", b"2.5, 9.81", b""]
    (arm,) = samples[0].scene.articulations
    track = arm.joint_track
    states = [track.positions(0.1 * k) for k in range(4)]
    assert example["steps/observation/state"] == pytest.approx(np.ravel(states), abs=1e-6)
    camera = next(iter(samples[0].truth))
    picture = example[f"steps/observation/image/{camera}"][2]
    expected = samples[2].capture.readings[camera].channels[Channel.RGB]
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(picture))), expected)


def test_rlds_has_an_episode_per_record(samples: Any, export: Any) -> None:
    """Of the lengths that its description states."""
    assert_written(export(Rlds(), samples), samples)


@pytest.mark.parametrize(
    ("missing", "rewards"), [((), [[0.0, 0.0, 0.0, 1.0]]), ((2,), [[0.0, 0.0], [1.0]])]
)
def test_rlds_rewards_the_last_step_of_a_success(
    samples: Any, export: Any, missing: tuple[int, ...], rewards: list[list[float]]
) -> None:
    """Steps are even: a sample that does not exist ends the episode, before its success."""
    success = replace(EPISODE, succeeded=True, failure="")
    done = [with_arm(s, episode=success) for s in samples if s.index not in missing]
    episodes = episodes_of(export(Rlds(), done))
    assert [one["steps/reward"] for one in episodes] == rewards
    assert [one["steps/is_terminal"] for one in episodes] == rewards


def test_the_hand_of_a_step_is_that_of_its_joints_and_without_a_task_there_is_none(
    samples: Any, world: Any
) -> None:
    """Shoulder and elbow at 0: the hand stands upright over the base, 0.3 + 0.3 + 0.35 m up."""
    arm = replace(samples[0].scene.articulations[0], joint_track=None)
    arm = replace(arm, joint_positions=(0.0, 0.0, 0.02, 0.02))
    step = demonstration_step(arm, two_link_arm(), 5.0, 0.1)
    assert step is not None
    assert step.T_base_grasp == SE3((0.0, 0.0, 0.95))
    assert (step.opening, step.opening_action) == (0.5, 0.5)
    assert step.phase == "place"
    (arm,) = world.reach()[0].scene.articulations
    assert demonstration_step(arm, two_link_arm(), 0.0, 0.1) is None


PARTS: tuple[Part, ...] = ("depth", "instances", "poses", "contacts", "relations", "calibration")


@pytest.fixture(scope="module")
def related(samples: Any) -> Any:
    """The same steps with a scene graph: the crate is on something, at the first step only."""
    edges = [(Relation(1, "on", 2), Relation(1, "near", 3)), *[()] * (len(samples) - 1)]
    frames = [EgoTruth(relations=found) for found in edges]
    return [replace(s, frame=frame) for s, frame in zip(samples, frames, strict=True)]


CONTACTS = [[2.5, 0.1, 0.2, 0.3], [9.81, 0.0, 0.5, 0.75]]
"""Of the third step."""


def assert_geometry(read: Callable[..., Any], sample: Any, unit_m: float) -> None:
    """Objects and cameras of a step, of which ``read`` has arrays by name and camera."""
    objects = [i for i in sample.scene.instances if i.annotated]
    assert np.atleast_1d(read("object_id")).tolist() == [i.instance_id for i in objects]
    poses = [(*i.T_world_instance.translation_m, *i.T_world_instance.quaternion_wxyz)
             for i in objects]  # fmt: skip
    assert np.allclose(read("object_pose"), poses, atol=1e-6)
    for name, truth in sample.truth.items():
        channels = sample.capture.readings[name].channels
        depth_m, exact_m = np.array(read("depth", name)) * unit_m, channels[Channel.Z_DEPTH]
        shown = np.isfinite(exact_m) & (exact_m < 65535.5 * unit_m)
        assert np.abs(depth_m - exact_m)[shown].max() < 0.51 * unit_m
        assert not depth_m[~shown].any()
        assert np.array_equal(read("instance", name), channels[Channel.INSTANCE])
        pose = truth.camera.T_world_camera.matrix()
        assert np.allclose(read("T_world_camera", name), pose, atol=1e-6)
        assert np.allclose(read("K", name), truth.camera.intrinsics.matrix(), rtol=1e-6)


@pytest.mark.parametrize("version", ["v3.0", "v2.1"])
def test_geometry_of_every_step_is_in_lerobot_as_arrays(
    related: Any, export: Any, version: Any
) -> None:
    """Depths and ids of the images, poses, contacts, relations, K and poses of cameras.

    The crate touches a finger and then the table, too: two rows, of which the first steps fill one
    or none. Predicates count from 0 in the list of ``info.json``.
    """
    folder = export(LeRobot(geometry=PARTS, version=version), related)
    rows, features = rows_of(folder), features_of(folder)

    (unit_m,) = {features[f"annotation.depth.{name}"]["unit_m"] for name in related[0].truth}
    for row, sample in zip(rows, related, strict=False):
        objects = [i for i in sample.scene.instances if i.annotated]
        assert row["annotation.objects"] == ", ".join(i.category for i in objects)
        assert_geometry(
            lambda *names, row=row: row[".".join(["annotation", *names])], sample, unit_m
        )
    touching = [np.array(row["annotation.contact"]) for row in rows]
    assert np.allclose(touching[2], CONTACTS, atol=1e-6)
    assert [int(one.any(axis=1).sum()) for one in touching] == [0, 1, 2, 0]
    names = features["annotation.relation"]["predicates"]
    first = [(a, names[p], b) for a, p, b in rows[0]["annotation.relation"]]
    assert first == [(1, "on", 2), (1, "near", 3)]
    assert not np.any(rows[1]["annotation.relation"])
    for name, feature in features.items():
        if feature["dtype"] not in ("image", "string"):
            assert np.shape(rows[0][name]) in ((tuple(feature["shape"])), ()), name


CALIBRATED = [LeRobot(geometry=("calibration",)), Rlds(geometry=("calibration",))]


@pytest.mark.parametrize("model", ["brown_conrady", "kannala_brandt"])
@pytest.mark.parametrize("exporter", CALIBRATED)
def test_coefficients_of_bent_lenses_have_the_names_that_tell_the_model(
    exporter: Any, model: Any, world: Any, related: Any, tmp_path: Path
) -> None:
    """OpenCV: calib3d has k1 k2 p1 p2 k3 k4 k5 k6, fisheye has k1 k2 k3 k4."""
    names = {"brown_conrady": "k1 k2 p1 p2 k3 k4 k5 k6", "kannala_brandt": "k1 k2 k3 k4"}[model]
    count = len(names.split())
    lens = Lens(model, tuple(0.001 * (k + 1) for k in range(count)), half_field_rad=1.2)

    def bent(truth: Any) -> Any:
        k = replace(truth.camera.intrinsics, lens=lens)
        return replace(truth, camera=replace(truth.camera, intrinsics=k))

    given = [replace(s, truth={n: bent(t) for n, t in s.truth.items()}) for s in related]
    info = drive_info(world)
    sensors = tuple(replace(s, lens=model) if s.name in info.cameras else s for s in info.sensors)
    folder = world.export(exporter, replace(info, sensors=sensors), given, tmp_path)
    folder = folder / "train/toys_arm"
    if exporter.type == "lerobot":
        features = json.loads((folder / "meta/info.json").read_text())["features"]
        found = features["annotation.distortion.left"]
    else:
        found = json.loads((folder / "metadata.json").read_text())["steps/distortion/left"]
    assert (found["names"], found["shape"]) == (names.split(), [count])


@pytest.mark.parametrize("exporter", CALIBRATED)
def test_no_matrix_stands_for_a_panorama(exporter: Any, world: Any) -> None:
    info = drive_info(world)
    panorama = replace(info.sensor("left"), lens="equirectangular")
    sensors = tuple(panorama if s.name == "left" else s for s in info.sensors)
    with pytest.raises(ConfigError, match="'equirectangular', which K does not describe"):
        exporter.check(replace(info, sensors=sensors))


def test_geometry_of_every_step_is_in_rlds_as_lists_and_images(related: Any, export: Any) -> None:
    """Arrays of the steps follow one another in the shape of ``metadata.json``."""
    folder = export(Rlds(geometry=PARTS), related)
    (example,), facts = episodes_of(folder), json.loads((folder / "metadata.json").read_text())
    assert_written(folder, related)

    contacts = np.reshape(example["steps/contact"], (4, *facts["steps/contact"]["shape"]))
    assert np.allclose(contacts[2], CONTACTS, atol=1e-6)
    edge = example["steps/relation"][:3]
    assert (edge[0], facts["steps/relation"]["predicates"][edge[1]], edge[2]) == (1, "on", 2)
    camera = next(iter(related[0].truth))
    file = example[f"steps/observation/instance/{camera}"][1]
    ids = related[1].capture.readings[camera].channels[Channel.INSTANCE]
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(file))), ids)


TFDS = """
import sys
import numpy, tensorflow_datasets
builder = tensorflow_datasets.builder_from_directory(sys.argv[1])
arrays = {}
def keep(name, value):
    for key, part in value.items() if isinstance(value, dict) else ():
        keep(f"{name}/{key}", part)
    if not isinstance(value, dict):
        arrays.setdefault(name, []).append(value)
for episode in tensorflow_datasets.as_numpy(builder.as_dataset(split=sys.argv[2])):
    keep("episode_metadata", episode["episode_metadata"])
    for step in episode["steps"]:
        keep("steps", step)
arrays["episodes"] = builder.info.splits[sys.argv[2]].num_examples
arrays["unit_m"] = builder.info.metadata["steps/observation/depth/left"]["unit_m"]
arrays["predicates"] = builder.info.metadata["steps/relation"]["predicates"]
numpy.savez(sys.argv[3], **arrays)
"""


def read_by_tfds(folder: Path, split: str) -> dict[str, Any]:
    """Arrays of all steps by key, in another process: TensorFlow keeps threads."""
    found = folder.parent / "found.npz"
    command = [sys.executable, "-c", TFDS, str(folder), split, str(found)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    with np.load(found) as arrays:
        return dict(arrays)


@slow
def test_tensorflow_datasets_reads_geometry_of_every_step(related: Any, export: Any) -> None:
    """Images, depth, masks, poses, contacts, scene graph and cameras, of the files in a folder."""
    pytest.importorskip("tensorflow_datasets")
    given = [replace(sample, split="val") for sample in related]
    folder = export(Rlds(geometry=PARTS, episodes_per_file=1), given, "val/toys_arm")
    read = read_by_tfds(folder, "val")
    images = ("depth", "instance")

    assert (read["episodes"], len(read["steps/is_first"])) == (2, len(given))
    assert read["steps/is_first"].dtype == bool
    assert read["episode_metadata/failure"].tolist() == [b"slip", b"slip"]
    assert read["steps/language_instruction"].tolist() == [INSTRUCTION.encode()] * len(given)
    order = read["episode_metadata/sequence"]
    expected = [given[4 * sequence + k] for sequence in order for k in range(4)]
    for k, sample in enumerate(expected):

        def found(name: str, camera: str = "", k: int = k) -> Any:
            if name in images:
                return read[f"steps/observation/{name}/{camera}"][k, ..., 0]
            return read["/".join(["steps", name, camera]).rstrip("/")][k]

        assert_geometry(found, sample, float(read["unit_m"]))
        (arm,) = sample.scene.articulations
        positions = arm.joint_track.positions(sample.scene.time_s)
        assert np.allclose(read["steps/observation/state"][k], positions, atol=1e-6)
        for camera in sample.truth:
            image = sample.capture.readings[camera].channels[Channel.RGB]
            assert np.array_equal(read[f"steps/observation/image/{camera}"][k], image)
    assert np.allclose(read["steps/contact"][2], CONTACTS, atol=1e-6)
    first = [(a, read["predicates"][p], b) for a, p, b in
             read["steps/relation"][list(order).index(0) * 4]]  # fmt: skip
    assert first == [(1, "on", 2), (1, "near", 3)]


def test_a_task_of_two_arms_has_the_joints_and_hands_of_both(samples: Any, export: Any) -> None:
    """One after the other, named by arm; the episode is of the arm with the task."""

    def joined(sample: Any) -> Any:
        (arm,) = sample.scene.articulations
        other = replace(arm, name="other", task=(), assignment=None, episode=None)
        goals = (*arm.task, replace(arm.task[0], arms=("arm", "other")))
        return in_scene(sample, articulations=(replace(arm, task=goals), other))

    folder = export(LeRobot(), list(map(joined, samples)), "train/toys_arm+toys_arm")
    rows, features = rows_of(folder), features_of(folder)

    names = features["observation.state"]["names"]
    assert names == ["arm.shoulder", "arm.elbow", "other.shoulder", "other.elbow"]
    assert features["observation.ee_pose"]["names"][6:8] == ["arm.qz", "other.x"]
    for row, sample in zip(rows, samples, strict=False):
        positions = sample.scene.articulations[0].joint_track.positions(sample.scene.time_s)
        assert np.allclose(row["observation.state"], [*positions, *positions], atol=1e-6)
        assert len(row["observation.gripper"]) == 2
        assert row["annotation.failure"] == "slip"


def test_twins_name_the_failure_that_they_recovered_from(samples: Any, export: Any) -> None:
    """Sequence 0 fails, sequence 1 recovers; both in one data set."""
    recovered = replace(EPISODE, succeeded=True, failure="", recovered="slip")
    given = [
        replace(
            in_scene(with_arm(s, episode=(EPISODE, recovered)[k // 4]), twins=True), split="train"
        )
        for k, s in enumerate(samples)
    ]
    rows = rows_of(export(LeRobot(), given))
    assert [(row["annotation.failure"], row["annotation.recovered"]) for row in rows] == [
        *[("slip", "")] * 4, *[("", "slip")] * 4]  # fmt: skip

    episodes = episodes_of(export(Rlds(), given))
    assert [one["episode_metadata/recovered"] for one in episodes] == [[b""], [b"slip"]]
