"""A result without labels is said, wherever it comes from; nothing is lost."""

import warnings
from pathlib import Path
from typing import Any

import pytest
import yaml

import gen_data
from gen_data.report.report_data import describe_dataset
from tests.end_to_end.running import gen_data as run

pytestmark = pytest.mark.slow

CAMERA = {"type": "rgb_camera", "size_px": [240, 180], "hfov_deg": 60}
AWAY = {**CAMERA, "rig": "cart", "offset_m": [0.5, 0, 0.9], "pitch_deg": 80}
"""A camera that looks at the ceiling."""


def room(*sensors: dict[str, Any], **sections: Any) -> dict[str, Any]:
    balls = {"ids": ["apple", "orange"]}
    elements = [
        {"type": "room", "name": "room", "size_m": [5, 4, 2.8]},
        {"type": "surface", "name": "table", "asset": "table", "top_size_m": [1.3, 0.9]},
        {"type": "objects", "name": "balls", "on": "table", "count": 4, "assets": balls,
         "placement": "scatter"},
        {"type": "carrier", "name": "cart"},
    ]  # fmt: skip
    return {
        "elements": elements,
        "splits": {"train": 1},
        "randomizers": [{"type": "objects", "name": "balls", "count": 4}],
        "sensors": [*sensors],
        "annotations": ["boxes2d", "visibility"],
        "exporters": [{"type": "coco"}],
        **sections,
    }


SEES = {**CAMERA, "name": "color"}


def test_a_camera_that_sees_nothing_is_named(tmp_path: Path) -> None:
    """The other one has labels: a warning, and the report has it too."""
    config = room(SEES, {**AWAY, "name": "left"})
    with pytest.warns(gen_data.ConfigWarning) as caught:
        gen_data.generate(config, 5, out=tmp_path / "set", workers=0)
    before, after = (str(warning.message) for warning in caught)
    assert before.startswith("sensors.left: its image shows nothing of the scene's focus")
    assert after.startswith("0 labels in 5 images of camera 'left'")

    titles = {t["title"]: t for t in describe_dataset(tmp_path / "set", scenes_max=0)["tables"]}
    (row,) = titles["Without labels"]["rows"]
    assert "0 labels in 5 images of camera 'left'" in row[0]


def test_tracked_points_are_labels_without_any_other_annotation(tmp_path: Path) -> None:
    sections = {"annotations": [{"type": "tracks", "points": 16}], "exporters": []}
    with warnings.catch_warnings():
        warnings.simplefilter("error", gen_data.ConfigWarning)
        gen_data.generate(room(SEES, **sections), 1, out=tmp_path / "set", workers=0)
    (sample,) = gen_data.open(tmp_path / "set")
    assert sample.ego is not None
    assert sample.ego.tracks is not None
    assert sample.ego.tracks.sensors["color"].visible.any()


def test_a_data_set_without_any_label_has_an_exit_code_of_its_own(tmp_path: Path) -> None:
    """9; it is finished, and the same command says so again."""
    (tmp_path / "c.yaml").write_text(yaml.safe_dump(room({**AWAY, "name": "left"})))
    command = ("--config", "c.yaml", "--n", "2", "--out", "set", "--workers", "0")
    for _ in range(2):
        done = run(*command, cwd=tmp_path)
        assert (done.returncode, "none of its 2 samples has a label" in done.stderr) == (9, True)
    assert run("verify", "set", "--full", cwd=tmp_path).returncode == 0


def test_images_without_labels_can_be_wanted(tmp_path: Path) -> None:
    """Neither annotations nor exporters: no word."""
    config = room({**AWAY, "name": "left"}, annotations=[], exporters=[])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert gen_data.generate(config, 5, out=tmp_path / "set", workers=0).samples == 5


def test_exports_and_renderings_without_labels_are_said(tmp_path: Path) -> None:
    """A label map that leaves nothing; other sensors that see nothing; a class without objects."""
    gen_data.generate(room(SEES), 5, out=tmp_path / "set", workers=0)
    (tmp_path / "map.yaml").write_text("{classes: {apple: }, min_box_px: 1000}")
    with (
        pytest.warns(gen_data.ConfigWarning, match="0 labels in 5 images"),
        pytest.raises(gen_data.NoLabels, match="none of its 5 samples has a label"),
    ):
        gen_data.export(
            tmp_path / "set", ["coco"], tmp_path / "mapped", label_map=tmp_path / "map.yaml",
            workers=0,
        )  # fmt: skip
    assert gen_data.open(tmp_path / "mapped")[0].index == 0

    (tmp_path / "away.yaml").write_text(yaml.safe_dump({"sensors": [{**AWAY, "name": "left"}]}))
    with (
        pytest.warns(gen_data.ConfigWarning, match="0 labels in 5 images of camera 'left'"),
        pytest.raises(gen_data.NoLabels),
    ):
        gen_data.rerender(
            tmp_path / "set", tmp_path / "again", sensors=tmp_path / "away.yaml", workers=0
        )


def test_a_class_that_could_occur_and_did_not_is_named(tmp_path: Path) -> None:
    """And the report counts the objects of each exported class."""
    config = room(SEES)
    config["elements"].append(
        {"type": "objects", "name": "rare", "on": "table", "count": 0, "assets": {"ids": ["mug"]}}
    )
    config["labels"] = {"map": {"classes": {"fruit": ["apple", "orange"], "cup": "mug"}}}
    with pytest.warns(gen_data.ConfigWarning, match="class 'cup' of the label map: 0 objects in 5"):
        gen_data.generate(config, 5, out=tmp_path / "set", workers=0)

    described = describe_dataset(tmp_path / "set", scenes_max=0)
    objects = {row["name"]: row["objects"] for row in described["categories"]}
    (table,) = [t for t in described["tables"] if t["title"] == "Exported classes"]
    counts = {row[0]: row[1] for row in table["rows"]}
    assert counts == {"fruit": str(objects["apple"] + objects["orange"]), "cup": "0"}


def test_plan_measures_labels_by_class(tmp_path: Path) -> None:
    """With --probe: labels per sample of each class; without it, the parts of each class."""
    config = room(SEES, labels={"map": {"classes": {"fruit": ["apple", "orange"]}}})
    (tmp_path / "c.yaml").write_text(yaml.safe_dump(config))
    done = run("plan", "c.yaml", "--n", "10", "--probe", "2", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert "class fruit" in done.stdout
    assert "apple, orange" in done.stdout
    assert "labels, measured" in done.stdout
    config["labels"]["map"]["classes"] = {"fruit": "aple"}
    (tmp_path / "c.yaml").write_text(yaml.safe_dump(config))
    done = run("plan", "c.yaml", "--n", "10", cwd=tmp_path)
    assert done.returncode == 2
    assert "labels.map.classes.fruit: no object of the data set can be 'aple'" in done.stderr
    assert "did you mean 'apple'?" in done.stderr


def test_sensors_that_an_exporter_cannot_hold_are_rendered_without_it(tmp_path: Path) -> None:
    """It is named with its reason; an exporter that the user names is refused."""
    kitti = [{"type": "coco"}, {"type": "kitti"}]
    gen_data.generate(room(SEES, exporters=kitti), 1, out=tmp_path / "set", workers=0)
    bent = {**CAMERA, "name": "wide", "lens": {"model": "brown_conrady", "k1": -0.1}}
    (tmp_path / "wide.yaml").write_text(yaml.safe_dump({"sensors": [bent]}))
    wide: dict[str, Any] = {"sensors": tmp_path / "wide.yaml", "workers": 0}
    with pytest.warns(gen_data.ConfigWarning, match="kitti of the data set is left out") as caught:
        gen_data.rerender(tmp_path / "set", tmp_path / "wide", **wide)

    assert "camera 'wide' has a lens of the model 'brown_conrady'" in str(caught[0].message)
    assert (tmp_path / "wide/coco").is_dir()
    assert gen_data.open(tmp_path / "wide").config["exporters"] == [{"type": "coco"}]
    with pytest.raises(gen_data.ConfigError, match="exporter 'kitti': camera 'wide' has a lens"):
        gen_data.rerender(
            tmp_path / "set", tmp_path / "no", overrides=["exporters=[{type: kitti}]"], **wide
        )
