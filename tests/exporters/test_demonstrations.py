"""Labels of demonstrations in episodes, read by pyarrow and protobuf."""

import io
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest
from PIL import Image
from tfrecord import example_pb2
from tfrecord.reader import tfrecord_iterator

from gen_data.core.demonstrations import demonstration_step
from gen_data.core.sample import EgoTruth, Relation
from gen_data.core.scene import Assignment, ContactSpan, Episode, Span
from gen_data.core.se3 import SE3
from gen_data.exporters.lerobot import LeRobot
from gen_data.exporters.rlds import Rlds
from gen_data.exporters.step_geometry import Part
from tests.exporters.drives import drive_info
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

    def slipping(sample: Any) -> Any:
        (arm,) = sample.scene.articulations
        arm = replace(arm, assignment=Assignment("put", INSTRUCTION), episode=EPISODE)
        return replace(sample, scene=replace(sample.scene, articulations=(arm,)))

    return [slipping(sample) for sample in world.reach()]


@pytest.fixture(scope="module")
def samples(world: Any) -> Any:
    return demonstrated(world)


def values(example: Any, key: str) -> list[Any]:
    feature = example.features.feature[key]
    return list(getattr(feature, feature.WhichOneof("kind")).value)


def test_lerobot_has_what_the_arm_does_each_step(world: Any, samples: Any, tmp_path: Path) -> None:
    """At 0, 0.1, 0.2 and 0.3 s; the hand's pose follows from the step's joints."""
    folder = world.export(LeRobot(), drive_info(world), samples, tmp_path) / "train/toys_arm"
    rows = pyarrow.parquet.read_table(folder / "data/chunk-000/file-000.parquet").to_pylist()
    info = json.loads((folder / "meta/info.json").read_text())
    tasks = pyarrow.parquet.read_table(folder / "meta/tasks.parquet")
    assert tasks["__index_level_0__"].to_pylist() == [INSTRUCTION]
    assert [row["annotation.phase"] for row in rows] == ["pick", "pick", "place", "place"]
    assert [row["annotation.held"] for row in rows] == ["", "crate/0", "crate/0", ""]
    assert [row["annotation.contacts"] for row in rows] == [
        "", "arm/finger + crate/0", "arm/finger + crate/0, crate/0 + table", ""]  # fmt: skip
    assert [row["annotation.contact_forces_n"] for row in rows] == ["", "1.5", "2.5, 9.81", ""]
    assert rows[2]["annotation.contact_points_m"] == "0.1 0.2 0.3, 0 0.5 0.75"
    assert {(row["annotation.succeeded"], row["annotation.failure"]) for row in rows} == {
        (False, "slip")
    }
    assert info["features"]["observation.ee_pose"]["shape"] == [7]
    for row in rows:
        assert np.linalg.norm(row["observation.ee_pose"][3:]) == pytest.approx(1.0, abs=1e-6)


def read_episode(folder: Path) -> Any:
    """The only episode of a folder, by protobuf."""
    (record,) = tfrecord_iterator(str(folder / "episodes-00000-of-00001.tfrecord"))
    example = example_pb2.Example()
    example.ParseFromString(bytes(record))
    return example


def assert_written(folder: Path, samples: Any) -> None:
    """Lists of four steps; vectors of the steps follow one another; a failure has no reward."""
    example, described = read_episode(folder), json.loads((folder / "metadata.json").read_text())
    assert set(example.features.feature) == set(described)
    for key, fact in described.items():
        count = 4 if key.startswith("steps/") else 1
        assert len(values(example, key)) == count * fact["length"], key
    assert values(example, "steps/is_first") == [1, 0, 0, 0]
    assert values(example, "steps/is_last") == [0, 0, 0, 1]
    assert values(example, "steps/reward") == [0.0] * 4
    assert values(example, "steps/language_instruction") == [INSTRUCTION.encode()] * 4
    assert values(example, "steps/phase") == [b"pick", b"pick", b"place", b"place"]
    assert values(example, "episode_metadata/failure") == [b"slip"]
    assert values(example, "steps/contact_forces_n") == [b"", b"1.5", b"2.5, 9.81", b""]
    (arm,) = samples[0].scene.articulations
    track = arm.joint_track
    states = [track.positions(0.1 * k) for k in range(4)]
    assert values(example, "steps/observation/state") == pytest.approx(np.ravel(states), abs=1e-6)
    camera = next(iter(samples[0].truth))
    picture = values(example, f"steps/observation/image/{camera}")[2]
    (expected,) = (
        a for c, a in samples[2].capture.readings[camera].channels.items() if c.value == "rgb"
    )
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(picture))), expected)


def test_rlds_has_an_episode_per_record(world: Any, samples: Any, tmp_path: Path) -> None:
    """Of the lengths that its description states."""
    folder = world.export(Rlds(), drive_info(world), samples, tmp_path) / "train/toys_arm"
    assert_written(folder, samples)


def test_rlds_rewards_the_last_step_of_a_success(world: Any, samples: Any, tmp_path: Path) -> None:
    done = [
        replace(s, scene=replace(s.scene, articulations=(
            replace(s.scene.articulations[0], episode=replace(EPISODE, succeeded=True, failure="")),
        )))
        for s in samples
    ]  # fmt: skip
    folder = world.export(Rlds(), drive_info(world), done, tmp_path) / "train/toys_arm"
    example = read_episode(folder)
    assert values(example, "steps/reward") == [0.0, 0.0, 0.0, 1.0]
    assert values(example, "steps/is_terminal") == [0, 0, 0, 1]
    # Steps are even: a sample that does not exist ends the episode, before its success.
    cut = world.export(Rlds(), drive_info(world), done[:2] + done[3:], tmp_path / "cut")
    records = tfrecord_iterator(str(next((cut / "train/toys_arm").glob("*.tfrecord"))))
    # The iterator reads every record into the same buffer.
    parts = [example_pb2.Example.FromString(bytes(record)) for record in records]
    assert [values(part, "steps/reward") for part in parts] == [[0.0, 0.0], [1.0]]


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


@pytest.mark.parametrize("version", ["v3.0", "v2.1"])
def test_geometry_of_every_step_is_in_lerobot_as_arrays(
    world: Any, related: Any, tmp_path: Path, version: Any
) -> None:
    """Depths and ids of the images, poses, contacts, relations, K and poses of cameras.

    The crate touches a finger and then the table, too: two rows, of which the first steps fill one
    or none. Predicates count from 0 in the list of ``info.json``.
    """
    exporter = LeRobot(geometry=PARTS, version=version)
    folder = world.export(exporter, drive_info(world), related, tmp_path) / "train/toys_arm"
    (path,) = (folder / "data").rglob("*.parquet")
    rows = pyarrow.parquet.read_table(path).to_pylist()
    features = json.loads((folder / "meta/info.json").read_text())["features"]

    for row, sample in zip(rows, related, strict=False):
        objects = [i for i in sample.scene.instances if i.annotated]
        assert row["annotation.objects"] == ", ".join(i.category for i in objects)
        assert np.atleast_1d(row["annotation.object_id"]).tolist() == [
            i.instance_id for i in objects
        ]
        poses = [(*i.T_world_instance.translation_m, *i.T_world_instance.quaternion_wxyz)
                 for i in objects]  # fmt: skip
        assert np.allclose(row["annotation.object_pose"], poses, atol=1e-6)
        for camera, truth in sample.truth.items():
            channels = {c.value: a for c, a in sample.capture.readings[camera].channels.items()}
            depth = np.array(row[f"annotation.depth.{camera}"])
            unit_m = features[f"annotation.depth.{camera}"]["unit_m"]
            shown = np.isfinite(channels["depth"]) & (channels["depth"] < 65535.5 * unit_m)
            assert np.abs(depth * unit_m - channels["depth"])[shown].max() < 0.51 * unit_m
            assert not depth[~shown].any()
            ids = np.array(row[f"annotation.instance.{camera}"])
            assert np.array_equal(ids, channels["instance"])
            pose = truth.camera.T_world_camera.matrix()
            assert np.allclose(row[f"annotation.T_world_camera.{camera}"], pose, atol=1e-6)
            K = truth.camera.intrinsics.matrix()
            assert np.allclose(row[f"annotation.K.{camera}"], K, rtol=1e-6)
    touching = [np.array(row["annotation.contact"]) for row in rows]
    assert np.allclose(touching[2], [[2.5, 0.1, 0.2, 0.3], [9.81, 0.0, 0.5, 0.75]], atol=1e-6)
    assert [int(one.any(axis=1).sum()) for one in touching] == [0, 1, 2, 0]
    names = features["annotation.relation"]["predicates"]
    first = [(a, names[p], b) for a, p, b in rows[0]["annotation.relation"]]
    assert first == [(1, "on", 2), (1, "near", 3)]
    assert not np.any(rows[1]["annotation.relation"])
    for name, feature in features.items():
        if feature["dtype"] not in ("image", "string"):
            assert np.shape(rows[0][name]) in ((tuple(feature["shape"])), ()), name


def test_geometry_of_every_step_is_in_rlds_as_lists_and_images(
    world: Any, related: Any, tmp_path: Path
) -> None:
    """Arrays of the steps follow one another in the shape of ``metadata.json``."""
    exporter = Rlds(geometry=PARTS)
    folder = world.export(exporter, drive_info(world), related, tmp_path) / "train/toys_arm"
    example, facts = read_episode(folder), json.loads((folder / "metadata.json").read_text())
    assert_written(folder, related)

    contacts = np.reshape(values(example, "steps/contact"), (4, *facts["steps/contact"]["shape"]))
    assert np.allclose(contacts[2], [[2.5, 0.1, 0.2, 0.3], [9.81, 0.0, 0.5, 0.75]], atol=1e-6)
    edge = values(example, "steps/relation")[:3]
    assert (edge[0], facts["steps/relation"]["predicates"][edge[1]], edge[2]) == (1, "on", 2)
    camera = next(iter(related[0].truth))
    file = values(example, f"steps/observation/instance/{camera}")[1]
    channels = related[1].capture.readings[camera].channels
    (ids,) = (a for c, a in channels.items() if c.value == "instance")
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
def test_tensorflow_datasets_reads_geometry_of_every_step(
    world: Any, related: Any, tmp_path: Path
) -> None:
    """Images, depth, masks, poses, contacts, scene graph and cameras, of the files in a folder."""
    pytest.importorskip("tensorflow_datasets")
    given = [replace(sample, split="val") for sample in related]
    exporter = Rlds(geometry=PARTS, episodes_per_file=1)
    folder = world.export(exporter, drive_info(world), given, tmp_path) / "val/toys_arm"
    read = read_by_tfds(folder, "val")

    assert (read["episodes"], len(read["steps/is_first"])) == (2, len(given))
    assert read["steps/is_first"].dtype == bool
    assert read["episode_metadata/failure"].tolist() == [b"slip", b"slip"]
    assert read["steps/language_instruction"].tolist() == [INSTRUCTION.encode()] * len(given)
    order = read["episode_metadata/sequence"]
    expected = [given[4 * sequence + k] for sequence in order for k in range(4)]
    names = [i.instance_id for i in expected[0].scene.instances if i.annotated]
    for k, sample in enumerate(expected):
        assert read["steps/object_id"][k].tolist() == names
        poses = [(*i.T_world_instance.translation_m, *i.T_world_instance.quaternion_wxyz)
                 for i in sample.scene.instances if i.annotated]  # fmt: skip
        assert np.allclose(read["steps/object_pose"][k], poses, atol=1e-6)
        (arm,) = sample.scene.articulations
        positions = arm.joint_track.positions(sample.scene.time_s)
        assert np.allclose(read["steps/observation/state"][k], positions, atol=1e-6)
        for camera, truth in sample.truth.items():
            channels = {c.value: a for c, a in sample.capture.readings[camera].channels.items()}
            image = read[f"steps/observation/image/{camera}"][k]
            assert np.array_equal(image, channels["rgb"])
            ids = read[f"steps/observation/instance/{camera}"][k, ..., 0]
            assert np.array_equal(ids, channels["instance"])
            depth_m = read[f"steps/observation/depth/{camera}"][k, ..., 0] * read["unit_m"]
            shown = np.isfinite(channels["depth"]) & (channels["depth"] < 65535.5 * read["unit_m"])
            assert np.abs(depth_m - channels["depth"])[shown].max() < 0.51 * read["unit_m"]
            assert np.allclose(read[f"steps/K/{camera}"][k], truth.camera.intrinsics.matrix())
            pose = truth.camera.T_world_camera.matrix()
            assert np.allclose(read[f"steps/T_world_camera/{camera}"][k], pose, atol=1e-6)
    contacts = read["steps/contact"][2]
    assert np.allclose(contacts, [[2.5, 0.1, 0.2, 0.3], [9.81, 0.0, 0.5, 0.75]], atol=1e-6)
    first = [(a, read["predicates"][p], b) for a, p, b in
             read["steps/relation"][list(order).index(0) * 4]]  # fmt: skip
    assert first == [(1, "on", 2), (1, "near", 3)]


def test_a_task_of_two_arms_has_the_joints_and_hands_of_both(
    world: Any, samples: Any, tmp_path: Path
) -> None:
    """One after the other, named by arm; the episode is of the arm with the task."""

    def joined(sample: Any) -> Any:
        (arm,) = sample.scene.articulations
        other = replace(arm, name="other", task=(), assignment=None, episode=None)
        goals = (*arm.task, replace(arm.task[0], arms=("arm", "other")))
        arms = (replace(arm, task=goals), other)
        return replace(sample, scene=replace(sample.scene, articulations=arms))

    pairs = [joined(sample) for sample in samples]
    folder = world.export(LeRobot(), drive_info(world), pairs, tmp_path) / "train/toys_arm+toys_arm"
    rows = pyarrow.parquet.read_table(folder / "data/chunk-000/file-000.parquet").to_pylist()
    features = json.loads((folder / "meta/info.json").read_text())["features"]

    names = features["observation.state"]["names"]
    assert names == ["arm.shoulder", "arm.elbow", "other.shoulder", "other.elbow"]
    assert features["observation.ee_pose"]["names"][6:8] == ["arm.qz", "other.x"]
    for row, sample in zip(rows, samples, strict=False):
        positions = sample.scene.articulations[0].joint_track.positions(sample.scene.time_s)
        assert np.allclose(row["observation.state"], [*positions, *positions], atol=1e-6)
        assert len(row["observation.gripper"]) == 2
        assert row["annotation.failure"] == "slip"


def test_twins_name_the_failure_that_they_recovered_from(
    world: Any, samples: Any, tmp_path: Path
) -> None:
    """Sequence 0 fails, sequence 1 recovers; both in one data set."""

    def twin(sample: Any, k: int) -> Any:
        (arm,) = sample.scene.articulations
        episode = (
            EPISODE if k < 4 else replace(EPISODE, succeeded=True, failure="", recovered="slip")
        )
        scene = replace(sample.scene, twins=True, articulations=(replace(arm, episode=episode),))
        return replace(sample, split="train", scene=scene)

    given = [twin(sample, k) for k, sample in enumerate(samples)]
    folder = world.export(LeRobot(), drive_info(world), given, tmp_path) / "train/toys_arm"
    rows = pyarrow.parquet.read_table(folder / "data/chunk-000/file-000.parquet").to_pylist()
    assert [(row["annotation.failure"], row["annotation.recovered"]) for row in rows] == [
        *[("slip", "")] * 4, *[("", "slip")] * 4]  # fmt: skip

    records = world.export(Rlds(), drive_info(world), given, tmp_path / "rlds") / "train/toys_arm"
    found = tfrecord_iterator(str(next(records.glob("*.tfrecord"))))
    episodes = [example_pb2.Example.FromString(bytes(record)) for record in found]
    assert [values(one, "episode_metadata/recovered") for one in episodes] == [[b""], [b"slip"]]
