"""LeRobot export, read by pyarrow as LeRobot 0.3.2 reads it."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
from PIL import Image

from gen_data.exporters import lerobot
from gen_data.exporters.lerobot import LeRobot, task_sentence
from gen_data.generator.assemble.config import load_config
from gen_data.generator.assemble.pipeline_factory import PipelineFactory
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.scene import ArmGoal
from tests.exporters.drives import drive_info


@pytest.fixture(scope="module")
def reach(world: Any) -> Any:
    """Two sequences of four steps, the first for training."""
    return world.reach()


@pytest.fixture(scope="module")
def dataset(world: Any, reach: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Data sets of both splits."""
    return world.export(LeRobot(), drive_info(world), reach, tmp_path_factory.mktemp("lerobot"))


def lines(path: Path) -> list[Any]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def rows_of(folder: Path) -> list[dict[str, Any]]:
    """Rows of all episodes, in order."""
    rows = []
    for path in sorted((folder / "data").rglob("*.parquet")):
        with pyarrow.parquet.ParquetFile(path) as file:
            rows += file.read().to_pylist()
    return rows


def faults(folder: Path, samples: Any) -> list[str]:
    """Differences between a data set and the samples of its episodes."""
    info = json.loads((folder / "meta/info.json").read_text())
    episodes = lines(folder / "meta/episodes.jsonl")
    tasks = {row["task_index"]: row["task"] for row in lines(folder / "meta/tasks.jsonl")}
    rows, found = rows_of(folder), []
    if (info["total_episodes"], info["total_frames"]) != (len(episodes), len(rows)):
        found.append("totals")
    if [row["index"] for row in rows] != list(range(len(rows))) or len(rows) != len(samples):
        return [*found, "index"]
    if [e["length"] for e in episodes] != [
        sum(row["episode_index"] == e["episode_index"] for row in rows) for e in episodes
    ]:
        found.append("lengths")
    for row, sample in zip(rows, samples, strict=True):
        if abs(row["timestamp"] - row["frame_index"] / info["fps"]) > 1e-4:
            found.append("timestamp")
        if row["frame_index"] != sample.step_index or tasks[row["task_index"]] != (
            "Pick up the crate, then put it down."
        ):
            found.append("frame or task")
        (arm,) = sample.scene.articulations
        time_s = sample.scene.time_s
        for name, at_s in (("observation.state", time_s), ("action", time_s + 0.1)):
            if not np.allclose(row[name], arm.joint_track.positions(at_s), atol=1e-6):
                found.append(name)
        for camera in sample.truth:
            pixels = np.asarray(
                Image.open(io.BytesIO(row[f"observation.images.{camera}"]["bytes"]))
            )
            shape = info["features"][f"observation.images.{camera}"]["shape"]
            if list(pixels.shape) != shape:
                found.append(f"{camera} shape")
            reading = sample.capture.readings[camera]
            (expected,) = (a for c, a in reading.channels.items() if c.value == "rgb")
            if not np.array_equal(pixels, expected):
                found.append(f"{camera} pixels")
    return found + stats_faults(folder, rows)


def stats_faults(folder: Path, rows: list[dict[str, Any]]) -> list[str]:
    """Differences between the statistics and the values of each episode."""
    found = []
    for line in lines(folder / "meta/episodes_stats.jsonl"):
        mine = [row for row in rows if row["episode_index"] == line["episode_index"]]
        for name, stats in line["stats"].items():
            if name.startswith("observation.images"):
                images = [np.asarray(Image.open(io.BytesIO(row[name]["bytes"]))) for row in mine]
                values = np.stack(images).reshape(-1, 3) / 255.0
            else:
                values = np.array([row[name] for row in mine]).reshape(len(mine), -1)
            for key in ("min", "max", "mean", "std"):
                expected = getattr(values, key)(axis=0)
                if not np.allclose(np.ravel(stats[key]), expected, atol=1e-6):
                    found.append(f"{key} of {name}")
            if stats["count"] != [len(mine)]:
                found.append(f"count of {name}")
    return found


def test_episodes_have_states_actions_and_images(dataset: Path, reach: Any) -> None:
    """Actions are the positions one step later; the arm rests after the last step."""
    assert faults(dataset / "train/toys_arm", reach[:4]) == []
    assert faults(dataset / "val/toys_arm", reach[4:]) == []
    last = rows_of(dataset / "train/toys_arm")[-1]
    assert last["action"] == pytest.approx([0.3, 0.2])


def test_joints_and_features_are_named(dataset: Path) -> None:
    """Features of the files, in the forms of LeRobot and of datasets."""
    folder = dataset / "train/toys_arm"
    info = json.loads((folder / "meta/info.json").read_text())
    path = folder / "data/chunk-000/episode_000000.parquet"
    described = json.loads(pyarrow.parquet.read_schema(path).metadata[b"huggingface"])

    assert info["features"]["action"] == {
        "dtype": "float32",
        "shape": [2],
        "names": ["shoulder", "elbow"],
    }
    assert (info["codebase_version"], info["fps"], info["robot_type"]) == ("v2.1", 10, "toys/arm")
    assert set(described["info"]["features"]) == set(info["features"])


def test_images_of_statistics_are_thinned_as_lerobot_does(tmp_path: Path) -> None:
    """Every fourth pixel of 640 columns: 640 // 150 = 4."""
    pixels = np.zeros((480, 640, 3), np.uint8)
    pixels[::4, ::4] = (10, 20, 30)
    path = tmp_path / "image.png"
    Image.fromarray(pixels).save(path)

    sums = lerobot._image_sums(path)

    n = 160 * 120
    assert sums["count"] == n
    assert sums["min"] == sums["max"] == [10, 20, 30]
    assert sums["sum"] == [10 * n, 20 * n, 30 * n]
    assert sums["squares"] == [100 * n, 400 * n, 900 * n]


def change_json(path: Path, change: Callable[[Any], Any]) -> None:
    rows = lines(path)
    for row in rows:
        change(row)
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))


def change_rows(path: Path, change: Callable[[list[dict[str, Any]]], Any]) -> None:
    table = pyarrow.parquet.read_table(path)
    rows = table.to_pylist()
    change(rows)
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(rows, table.schema), path)


EPISODE = "data/chunk-000/episode_000000.parquet"


@pytest.mark.damage("lerobot")
@pytest.mark.parametrize(
    "damage",
    [
        lambda d: change_rows(d / EPISODE, lambda rows: rows.pop()),
        lambda d: change_rows(
            d / EPISODE, lambda rows: [r.update(action=r["observation.state"]) for r in rows]
        ),
        lambda d: change_rows(
            d / EPISODE, lambda rows: [r.update(timestamp=2 * r["timestamp"]) for r in rows]
        ),
        lambda d: change_json(d / "meta/episodes.jsonl", lambda row: row.update(length=5)),
        lambda d: change_json(
            d / "meta/episodes_stats.jsonl",
            lambda row: row["stats"]["action"].update(mean=[0.0, 0.0]),
        ),
    ],
    ids=["row missing", "action is state", "timestamps", "length", "statistics"],
)
def test_damage_is_found(
    damage: Callable[[Path], Any], dataset: Path, reach: Any, tmp_path: Path
) -> None:
    """The same reader finds faults in damaged copies."""
    copy = tmp_path / "copy"
    shutil.copytree(dataset / "train/toys_arm", copy)
    damage(copy)

    assert faults(copy, reach[:4])


def test_tasks_are_sentences(reach: Any) -> None:
    """Of the arm's goals and the one object that moves."""
    scene = reach[0].scene
    (arm,) = scene.articulations
    reaching = replace(arm, task=(ArmGoal("reach"), ArmGoal("reach"), ArmGoal("joints")))

    assert task_sentence(scene, arm) == "Pick up the crate, then put it down."
    assert task_sentence(replace(scene, tracks=()), arm) == "Pick up an object, then put it down."
    assert task_sentence(scene, reaching) == "Reach a pose, then move to a posture."
    assert task_sentence(scene, replace(arm, task=())) == "Stay in place."


def test_a_configuration_without_arm_is_refused_before_rendering() -> None:
    """The nominal scene decides, so that no shard is lost."""
    config = load_config("kitti_stereo.yaml", overrides=['exporters=[{"type": "lerobot"}]'])

    with pytest.raises(ConfigError, match="exporter 'lerobot': the scene has no arm; add an elem"):
        PipelineFactory(config, n=20).check()


def test_data_sets_without_sequences_or_arms_are_refused(
    world: Any, samples: Any, tmp_path: Path
) -> None:
    """With the field to set."""
    with pytest.raises(ConfigError, match="steps_per_scene is 1; set steps_per_scene"):
        LeRobot().check(world.info(7))
    with pytest.raises(ConfigError, match="the scene has no arm; add an element of type robot"):
        world.export(LeRobot(), drive_info(world), samples, tmp_path / "a")
    with pytest.raises(ConfigError, match="has no arm 'leg'; expected one of: arm"):
        world.export(LeRobot(arm="leg"), drive_info(world), world.reach(), tmp_path / "b")


def test_cameras_that_skip_steps_are_refused(world: Any) -> None:
    """Every frame has an image of every camera."""
    info = drive_info(world)
    slow = tuple(replace(s, rate_hz=5.0) if s.name == "right" else s for s in info.sensors)
    info = replace(info, sensors=slow)

    with pytest.raises(ConfigError, match="camera 'right' reads 5 times per second"):
        LeRobot().check(info)
    LeRobot(cameras=("left",)).check(info)
