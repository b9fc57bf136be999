"""LeRobot export, read by pyarrow as LeRobot 0.4.4 and 0.3.2 read it, and by LeRobot 0.4.4."""

import io
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest
from PIL import Image

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.scene import ArmGoal
from gen_data.exporters import lerobot_files
from gen_data.exporters.lerobot import LeRobot, task_sentence
from gen_data.exporters.lerobot_statistics import image_sums
from tests.exporters.datasets import with_sensor
from tests.exporters.drives import drive_info
from tests.exporters.label_readers import json_lines, parquet


@pytest.fixture(scope="module")
def reach(world: Any) -> Any:
    return world.reach()


@pytest.fixture(scope="module", params=["v3.0", "v2.1"])
def dataset(request: Any, world: Any, reach: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    exporter = LeRobot(version=request.param)
    return world.export(exporter, drive_info(world), reach, tmp_path_factory.mktemp("lerobot"))


@pytest.fixture
def shared_files(world: Any, tmp_path: Path) -> Path:
    """Data set of two episodes of the same split, in format v3.0."""
    samples = [replace(sample, split="train") for sample in world.reach()]
    return world.export(LeRobot(), drive_info(world), samples, tmp_path) / "train/toys_arm"


def tasks_of(folder: Path) -> dict[int, str]:
    """Sentences by number; they are the index of the table that pandas reads."""
    path = folder / "meta/tasks.parquet"
    if path.exists():
        table = parquet(path)
        (index,) = json.loads(table.schema.metadata[b"pandas"])["index_columns"]
        return dict(zip(table["task_index"].to_pylist(), table[index].to_pylist(), strict=True))
    return {row["task_index"]: row["task"] for row in json_lines(folder / "meta/tasks.jsonl")}


def episodes_of(folder: Path) -> list[dict[str, Any]]:
    path = folder / "meta/episodes/chunk-000/file-000.parquet"
    if not path.exists():
        stats = json_lines(folder / "meta/episodes_stats.jsonl")
        pairs = zip(json_lines(folder / "meta/episodes.jsonl"), stats, strict=True)
        return [episode | line for episode, line in pairs]
    rows = parquet(path).to_pylist()
    for row in rows:
        row["stats"] = {}
        for name in [name for name in row if name.startswith("stats/")]:
            _, feature, key = name.split("/")
            row["stats"].setdefault(feature, {})[key] = row.pop(name)
    return rows


def rows_of(folder: Path) -> list[dict[str, Any]]:
    paths = sorted((folder / "data").rglob("*.parquet"))
    return [row for path in paths for row in parquet(path).to_pylist()]


def faults(folder: Path, samples: Any) -> list[str]:
    info = json.loads((folder / "meta/info.json").read_text())
    episodes, tasks = episodes_of(folder), tasks_of(folder)
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
            data = row[f"observation.images.{camera}"]["bytes"]
            pixels = np.asarray(Image.open(io.BytesIO(data)))
            shape = info["features"][f"observation.images.{camera}"]["shape"]
            if list(pixels.shape) != shape:
                found.append(f"{camera} shape")
            reading = sample.capture.readings[camera]
            if not np.array_equal(pixels, reading.channels[Channel.RGB]):
                found.append(f"{camera} pixels")
    return found + stats_faults(folder, rows)


def stats_faults(folder: Path, rows: list[dict[str, Any]]) -> list[str]:
    """Differences between the statistics and the values of each episode, and of all."""
    found = []
    for episode in episodes_of(folder):
        mine = [row for row in rows if row["episode_index"] == episode["episode_index"]]
        found += differences(episode["stats"], mine)
    whole = folder / "meta/stats.json"
    return found + (differences(json.loads(whole.read_text()), rows) if whole.exists() else [])


def differences(stats: dict[str, Any], rows: list[dict[str, Any]]) -> list[str]:
    """Statistics of features that differ from the rows."""
    found = []
    for name, one in stats.items():
        if name.startswith("observation.images"):
            images = [np.asarray(Image.open(io.BytesIO(row[name]["bytes"]))) for row in rows]
            values = np.stack(images).reshape(-1, 3) / 255.0
        else:
            values = np.array([row[name] for row in rows]).reshape(len(rows), -1)
        for key in ("min", "max", "mean", "std"):
            expected = getattr(values, key)(axis=0)
            if not np.allclose(np.ravel(one[key]), expected, atol=1e-6):
                found.append(f"{key} of {name}")
        if one["count"] != [len(rows)]:
            found.append(f"count of {name}")
    return found


def test_episodes_have_states_actions_images_and_named_features(dataset: Path, reach: Any) -> None:
    """Actions are the positions one step later; the arm rests after the last step."""
    assert faults(dataset / "train/toys_arm", reach[:4]) == []
    assert faults(dataset / "val/toys_arm", reach[4:]) == []
    last = rows_of(dataset / "train/toys_arm")[-1]
    assert last["action"] == pytest.approx([0.3, 0.2])
    # Features of the files, in the forms of LeRobot and of datasets.
    folder = dataset / "train/toys_arm"
    info = json.loads((folder / "meta/info.json").read_text())
    (path,) = (folder / "data").rglob("*.parquet")
    described = json.loads(pyarrow.parquet.read_schema(path).metadata[b"huggingface"])
    action = {"dtype": "float32", "shape": [2], "names": ["shoulder", "elbow"]}
    assert action.items() <= info["features"]["action"].items()
    assert (info["fps"], info["robot_type"]) == (10, "toys/arm")
    assert set(described["info"]["features"]) == set(info["features"])


def test_episodes_share_files_as_far_as_these_have_room(
    shared_files: Path, world: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In files of one byte every episode has its own; the rows are the same."""
    samples = [replace(sample, split="train") for sample in world.reach()]
    monkeypatch.setattr(lerobot_files, "FILE_BYTES", 1)
    apart = world.export(LeRobot(), drive_info(world), samples, tmp_path / "apart")
    apart /= "train/toys_arm"

    def places(folder: Path) -> list[tuple[int, ...]]:
        names = ("data/file_index", "dataset_from_index", "dataset_to_index")
        return [tuple(episode[name] for name in names) for episode in episodes_of(folder)]

    assert places(shared_files) == [(0, 0, 4), (0, 4, 8)]
    assert places(apart) == [(0, 0, 4), (1, 4, 8)]
    assert rows_of(apart) == rows_of(shared_files)
    assert stats_faults(shared_files, rows_of(shared_files)) == []


def test_quantiles_are_those_of_the_stored_values(shared_files: Path) -> None:
    """For all episodes they are means of the episodes', as LeRobot merges them."""
    rows, whole = rows_of(shared_files), json.loads((shared_files / "meta/stats.json").read_text())
    states = np.array([row["observation.state"] for row in rows], np.float64).reshape(2, 4, -1)
    for key, share in {"q01": 0.01, "q50": 0.5, "q99": 0.99}.items():
        expected = np.quantile(states, share, axis=1)
        found = [one["stats"]["observation.state"][key] for one in episodes_of(shared_files)]
        assert np.allclose(found, expected, atol=1e-8)
        assert np.allclose(whole["observation.state"][key], expected.mean(axis=0), atol=1e-8)


READ = """
import json, sys
import torch
try:
    import torchvision
except RuntimeError:
    # Its compiled operators do not load with a build of torch for processors only. LeRobot needs
    # none of them; once they are declared, the rest can be imported.
    library = torch.library.Library("torchvision", "DEF")
    library.define("nms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
    library.define("qnms(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
    library.define("roi_align(Tensor input, Tensor rois, float spatial_scale, SymInt pooled_height,"
                   " SymInt pooled_width, int sampling_ratio, bool aligned) -> Tensor")
from lerobot.datasets.lerobot_dataset import LeRobotDataset
data = LeRobotDataset("local/test", root=sys.argv[1], delta_timestamps={"action": [0.0, 0.1]})
rows = [data[k] for k in range(len(data))]
print(json.dumps({
    "episodes": [int(row["episode_index"]) for row in rows],
    "tasks": sorted({row["task"] for row in rows}),
    "actions": [row["action"].tolist() for row in rows],
    "means": [row["observation.images.left"].mean(dim=(1, 2)).tolist() for row in rows],
    "mean": data.meta.stats["action"]["mean"].tolist(),
}))
"""


@pytest.mark.slow
def test_lerobot_reads_what_was_written(shared_files: Path) -> None:
    """Release 0.4.4: rows, images, tasks, statistics, and windows over time within episodes."""
    env = os.environ | {"HF_HUB_OFFLINE": "1"}
    command = [sys.executable, "-c", READ, shared_files]
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    read, rows = json.loads(done.stdout), rows_of(shared_files)
    actions = np.array([row["action"] for row in rows])
    key = "observation.images.left"
    images = [np.asarray(Image.open(io.BytesIO(row[key]["bytes"]))) for row in rows]
    assert read["episodes"] == [0] * 4 + [1] * 4
    assert read["tasks"] == ["Pick up the crate, then put it down."]
    # The window of an episode's last frame repeats its last action.
    assert np.allclose(
        read["actions"], actions[[[k, min(k + 1, k // 4 * 4 + 3)] for k in range(8)]]
    )
    assert np.allclose(read["means"], [one.mean(axis=(0, 1)) / 255.0 for one in images], atol=1e-6)
    assert np.allclose(read["mean"], actions.mean(axis=0), atol=1e-6)


def test_images_of_statistics_are_thinned_as_lerobot_does(tmp_path: Path) -> None:
    """Every fourth pixel of 640 columns: 640 // 150 = 4."""
    pixels = np.zeros((480, 640, 3), np.uint8)
    pixels[::4, ::4] = (10, 20, 30)
    path = tmp_path / "image.png"
    Image.fromarray(pixels).save(path)
    sums = image_sums(path)
    n = 160 * 120
    assert sums["count"] == n
    assert sums["min"] == sums["max"] == [10, 20, 30]
    assert (sums["sum"], sums["squares"]) == ([10 * n, 20 * n, 30 * n], [100 * n, 400 * n, 900 * n])


def test_tasks_are_sentences(reach: Any) -> None:
    """Of the arm's goals and the one object that moves."""
    scene = reach[0].scene
    (arm,) = scene.articulations
    reaching = replace(arm, task=(ArmGoal("reach"), ArmGoal("reach"), ArmGoal("joints")))
    assert task_sentence(scene, arm) == "Pick up the crate, then put it down."
    assert task_sentence(replace(scene, tracks=()), arm) == "Pick up an object, then put it down."
    assert task_sentence(scene, reaching) == "Reach a pose, then move to a posture."
    assert task_sentence(scene, replace(arm, task=())) == "Stay in place."


def test_data_sets_without_arms_and_cameras_that_skip_steps_are_refused(
    world: Any, samples: Any, tmp_path: Path
) -> None:
    """Of a scene of the data set, and with the field to set."""
    with pytest.raises(ConfigError, match="the scene has no arm; add an element of type robot"):
        world.export(LeRobot(), drive_info(world), samples, tmp_path / "a")
    with pytest.raises(ConfigError, match="has no arm 'leg'; expected one of: arm"):
        world.export(LeRobot(arm="leg"), drive_info(world), world.reach(), tmp_path / "b")
    # Every frame has an image of every camera.
    info = with_sensor(drive_info(world), "right", rate_hz=5.0)
    with pytest.raises(ConfigError, match="camera 'right' reads 5 times per second"):
        LeRobot().check(info)
    LeRobot(cameras=("left",)).check(info)


@pytest.mark.parametrize("version", ["v3.0", "v2.1"])
def test_a_missing_sample_ends_the_episode(world: Any, tmp_path: Path, version: Any) -> None:
    """Frames are 1 / fps apart by definition: after a gap comes another episode."""
    samples = [replace(sample, split="train") for sample in world.reach()]
    kept = [sample for sample in samples if sample.index != 1]
    folder = world.export(LeRobot(version=version), drive_info(world), kept, tmp_path)
    rows = rows_of(folder / "train/toys_arm")
    fps = json.loads((folder / "train/toys_arm/meta/info.json").read_text())["fps"]
    assert [(row["episode_index"], row["frame_index"]) for row in rows] == [
        (0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2), (2, 3),
    ]  # fmt: skip
    assert [row["index"] for row in rows] == list(range(7))
    for row in rows:
        assert row["timestamp"] == pytest.approx(row["frame_index"] / fps, rel=1e-6)
