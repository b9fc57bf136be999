"""Ladders: equal scenes at several steps of one factor, and a detector judged at each step."""

import json
from pathlib import Path
from typing import Any

import pytest

from gen_data.api.open_dataset import open_dataset
from gen_data.core.errors import ConfigError, StorageError
from gen_data.lab.study import ladder as ladders

CONFIG = """
template: tabletop
seed: 3
elements: {clutter: {count: 3}}
randomizers:
  - {type: objects, name: clutter, count: 3}
  - {type: camera_pose, name: orbit, distance_m: 1}
sensors: [{type: rgb_camera, name: color, size_px: [96, 72]}]
annotations: [boxes2d]
exporters: [{type: coco}]
"""
FAR = ladders.Ladder("randomizers.orbit.distance_m", ("0.8", "1.4"))


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a.b=0..1", ("0", "0.5", "1")),
        ("a.b=-0.3..0.3", ("-0.3", "0", "0.3")),
        ("a.b=[fog, 2, {uniform: [0, 1]}]", ("fog", "2", "{uniform: [0, 1]}")),
    ],
)
def test_factors_are_ranges_or_lists(text: str, values: tuple[str, ...]) -> None:
    """Three steps, ends included; a value may be a distribution."""
    assert ladders.parse_factor(text, 3) == ladders.Ladder("a.b", values)


@pytest.mark.parametrize("text", ["a", "a=", "=0..1", "a=3", "a=x..y", "a=[1]", "a=[1, 1]", "a=["])
def test_other_factors_are_refused(text: str) -> None:
    with pytest.raises(ConfigError, match=r"expected FIELD=LOW\.\.HIGH or FIELD="):
        ladders.parse_factor(text, 3)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, list[int]]:
    """Configuration, folder, and numbers of equal scenes of a ladder of distances."""
    folder = tmp_path_factory.mktemp("ladder")
    config = folder / "small.yaml"
    config.write_text(CONFIG)
    same = ladders.build(str(config), FAR, 4, folder / "out", workers=0, report=lambda _: None)
    return config, folder / "out", same


def truth(out: Path, step: int) -> list[dict[str, Any]]:
    """Annotations of a step as detections."""
    stated = json.loads(
        (FAR.folder(out, step) / "coco/annotations/instances_test.json").read_text()
    )
    keys = ("image_id", "category_id", "bbox")
    return [{**{key: row[key] for key in keys}, "score": 1.0} for row in stated["annotations"]]


@pytest.mark.slow
def test_a_detector_that_misses_at_one_step_is_worse_there(
    made: tuple[Path, Path, list[int]], tmp_path: Path
) -> None:
    """The truth has AP 1 at the first step; nothing is found at the second one."""
    _, out, same = made
    assert same == [4, 4]
    near, far = truth(out, 0), truth(out, 1)
    distances = [open_dataset(FAR.folder(out, k)).config["randomizers"][1] for k in (0, 1)]
    assert [row["distance_m"] for row in distances] == [0.8, 1.4]
    (tmp_path / "0.json").write_text(json.dumps(near))
    (tmp_path / "1.json").write_text(json.dumps(far[:1]))

    found = ladders.judge(out, f"{tmp_path}/{{step}}.json")["variants"]

    assert list(found) == [f"{FAR.factor}={value}" for value in FAR.values]
    first, second = found.values()
    assert first["ap"]["mean"] == pytest.approx(1.0)
    assert second["ap"]["mean"] < 0.5
    assert second["difference"]["high"] < 0 and second["verdict"] == "worse"
    assert "Ladder of randomizers.orbit.distance_m" in (out / "study.html").read_text()


@pytest.mark.slow
def test_folders_and_configurations_that_do_not_fit_are_refused(
    made: tuple[Path, Path, list[int]], tmp_path: Path
) -> None:
    """Another ladder in the folder, no COCO to judge by, no step in a pattern, no ladder."""
    config, out, _ = made
    tell = lambda _: None  # noqa: E731
    with pytest.raises(StorageError, match="holds another ladder"):
        ladders.build(str(config), FAR, 5, out, report=tell)
    bare = tmp_path / "bare.yaml"
    bare.write_text(CONFIG.replace("{type: coco}", "{type: voc}"))
    with pytest.raises(ConfigError, match=r"a ladder needs \{type: coco\}"):
        ladders.build(str(bare), FAR, 5, tmp_path / "new", report=tell)
    with pytest.raises(ConfigError, match=r"path with \{step\} in it"):
        ladders.judge(out, "results.json")
    with pytest.raises(StorageError, match="no ladder"):
        ladders.judge(tmp_path, "{step}.json")
    (tmp_path / ladders.INDEX).write_text('{"factor":')
    with pytest.raises(StorageError, match="no ladder"):
        ladders.build(str(config), FAR, 4, tmp_path, report=tell)
    assert not (tmp_path / "new").exists()
