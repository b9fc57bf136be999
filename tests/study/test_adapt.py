"""A curriculum draws more of what was missed, and says exactly what it did."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml

import gen_data
from gen_data.assemble.config import load_config
from gen_data.core.errors import ConfigError, StorageError
from gen_data.lab.study.adapt import Round, adapt, tabulate
from gen_data.report.drawn_parameters import replay_scenes
from gen_data.runner.stored import StoredSamples

CONFIG = """\
extends: tabletop.yaml
without:
  sensors: [pseudo_lidar]
  exporters: all
  randomizers: [distractors, tabletop, cover, finish]
views_per_scene: 1
randomizers:
  - {name: clutter, count: {uniform_integer: [1, 4]}}
sensors:
  - {name: color, size_px: [64, 48], channels: [rgb]}
annotations: [boxes2d, visibility]
exporters: [{type: coco}]
splits: {train: 1, val: 0, test: 0}
"""


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("config") / "small.yaml"
    path.write_text(CONFIG)
    return path


@pytest.fixture(scope="module")
def data(config: Path) -> Path:
    out = config.parent / "data"
    gen_data.generate(config, 40, out=out, workers=0)
    return out


def weak_results(data: Path) -> list[dict[str, Any]]:
    """A detector that finds nothing beyond 1.2 m; the configuration draws 0.9 to 1.5 m."""
    stored = StoredSamples(data)
    draws = replay_scenes(stored, stored.n).draws
    near = {d.samples[0] for d in draws if d.name == "orbit.distance_m" and d.value < 1.2}
    truth = json.loads((data / "coco/annotations/instances_train.json").read_text())
    return [
        {key: row[key] for key in ("image_id", "category_id", "bbox")} | {"score": 0.9}
        for row in truth["annotations"]
        if row["image_id"] - 1 in near
    ]


@pytest.fixture(scope="module")
def results(data: Path) -> Path:
    path = data.parent / "results.json"
    path.write_text(json.dumps(weak_results(data)))
    return path


@pytest.fixture(scope="module")
def made(config: Path, data: Path, results: Path) -> Round:
    """The first round, in a folder of its own."""
    return adapt(str(config), data, data.parent / "first", results=results)


@pytest.mark.slow
def test_the_next_round_draws_more_of_what_was_missed(made: Round, results: Path) -> None:
    """Only the distance changes; the file loads, and most of its weight is beyond 1.2 m."""
    assert made.changed == ("orbit.distance_m",)
    document = yaml.safe_load(made.config.read_text())
    assert (document["seed"], list(document)) == (8, ["extends", "seed", "randomizers"])
    (orbit,) = document["randomizers"]
    far = sum(w for w, part in orbit["distance_m"]["mixture"] if part["uniform"][0] >= 1.2)
    assert 0.6 < far < 1.0
    loaded = load_config(str(made.config))
    (distance,) = [r for r in loaded.probes[0].randomizers if r.name == "orbit"]
    assert distance.distance_m.support() == (0.9, 1.5)
    # So that results of a part of the data set, or of another one, show.
    images = {row["image_id"] for row in json.loads(results.read_text())}
    assert made.images == (len(images), 40)
    assert tabulate(made, 1.0)["note"].endswith(f"{len(images)} of 40 images have detections")


@pytest.mark.slow
def test_equal_input_equal_bytes(config: Path, data: Path, results: Path, made: Round) -> None:
    """Of the configuration and of the curriculum, which names what was judged."""
    first, second = made.config.parent, made.config.parent.with_name("again")
    adapt(str(config), data, second, results=results)
    for name in ("round_1.yaml", "curriculum.yaml"):
        assert (first / name).read_bytes() == (second / name).read_bytes()
    (entry,) = yaml.safe_load((first / "curriculum.yaml").read_text())["rounds"]
    assert entry["judged"] == StoredSamples(data).dataset_id
    assert (entry["round"], entry["config"], entry["seed"]) == (1, "round_1.yaml", 8)
    assert list(entry["weights"]) == ["orbit.distance_m"]


@pytest.mark.slow
def test_a_second_round_extends_the_first(made: Round, tmp_path: Path) -> None:
    """Its parts are those of the mixture of the first round."""
    rounds_folder = made.config.parent.with_name("rounds")
    shutil.copytree(made.config.parent, rounds_folder)
    first = rounds_folder / made.config.name
    judged = tmp_path / "judged"
    gen_data.generate(str(first), 20, out=judged, workers=0)
    path = tmp_path / "second.json"
    path.write_text(json.dumps(weak_results(judged)))
    second = adapt(str(first), judged, rounds_folder, results=path)
    assert second.config.name == "round_2.yaml"
    assert yaml.safe_load(second.config.read_text())["extends"] == "round_1.yaml"
    rounds = yaml.safe_load((rounds_folder / "curriculum.yaml").read_text())["rounds"]
    assert [entry["seed"] for entry in rounds] == [8, 9]


@pytest.mark.slow
def test_what_a_detector_cannot_be_judged_by_is_refused(
    config: Path, data: Path, results: Path, tmp_path: Path
) -> None:
    """Results of other data and of other images than 1 to 40, and the truth, without a miss."""
    rows = json.loads(results.read_text())
    truth = json.loads((data / "coco/annotations/instances_train.json").read_text())["annotations"]
    path, none = tmp_path / "other.json", tmp_path / "none"
    name = StoredSamples(data).dataset_id
    another = (
        f"^{path}: has results of the data set 0123456789abcdef; expected results of {name} in "
    )
    for content, fact in (
        ({"dataset": "0123456789abcdef", "results": []}, rf"{another}{data}$"),
        ([*rows, rows[0] | {"image_id": 41}], "of another data set: the image_id 41 is not in"),
        ([r | {"score": 1.0} for r in truth], r"found all \d+ objects; expected misses to learn"),
    ):
        path.write_text(json.dumps(content))
        with pytest.raises(ConfigError, match=fact):
            adapt(str(config), data, tmp_path / "out", results=path)
        assert not (tmp_path / "out").exists()
    # A folder that is no data set is not looked for among configurations.
    with pytest.raises(StorageError, match="there is no folder"):
        adapt(str(config), none, tmp_path, results=none)
    with pytest.raises(ConfigError, match=r"not generated from tabletop: the sections .*sensors"):
        adapt("tabletop.yaml", data, tmp_path, results=none)


@pytest.mark.slow
@pytest.mark.parametrize("content", [b"[]", b"", b"PK"])
def test_a_file_that_is_no_detector_is_refused(
    config: Path, data: Path, tmp_path: Path, content: bytes
) -> None:
    """With what was expected, and not with torch's own words alone."""
    path = tmp_path / "detector.pt"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=r"cannot be read as a detector .* expected a file"):
        adapt(str(config), data, tmp_path / "out", detector=path)


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Configuration and twelve samples of two colour cameras and one without colours."""
    config = tmp_path_factory.mktemp("pair") / "pair.yaml"
    more = (
        "  - {name: behind, type: rgb_camera, size_px: [64, 48], channels: [rgb]}\n"
        "  - {name: ids, type: rgb_camera, size_px: [64, 48], channels: [instance]}\n"
    )
    config.write_text(CONFIG.replace("annotations:", f"{more}annotations:"))
    out = config.parent / "data"
    gen_data.generate(config, 12, out=out, workers=0)
    return config, out


@pytest.mark.slow
def test_results_of_every_colour_camera_count(pair: tuple[Path, Path], tmp_path: Path) -> None:
    """One camera finds all, the other nothing: the recall is the first one's share of objects."""
    config, data = pair
    truth = json.loads((data / "coco/annotations/instances_train.json").read_text())
    sensors = {image["id"]: image["sensor"] for image in truth["images"]}
    rows = [row | {"score": 1.0} for row in truth["annotations"]]
    found = [row for row in rows if sensors[row["image_id"]] == "behind"]
    path = tmp_path / "results.json"
    path.write_text(json.dumps(found))
    made = adapt(str(config), data, tmp_path / "out", results=path)
    assert made.images == (len({row["image_id"] for row in found}), 24)
    assert made.recall == pytest.approx(len(found) / len(rows))


@pytest.mark.slow
def test_the_size_of_shards_is_no_part_of_what_was_drawn(
    config: Path, data: Path, results: Path, tmp_path: Path
) -> None:
    """A set of the same scenes in other shards is of the same configuration."""
    other = tmp_path / "other.yaml"
    other.write_text(f"extends: {config}\nshard_size: 7\n")
    made = adapt(str(other), data, tmp_path / "out", results=results)
    assert made.changed == ("orbit.distance_m",)
