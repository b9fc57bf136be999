"""Dropped photographs as backgrounds: their entries, and the scenes that show them."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml

from gen_data.assemble.config import parse_config
from gen_data.assets.folder_index import PlateEntry
from gen_data.assets.plates.plate_import import locate_camera
from gen_data.core.errors import AssetError, ConfigError
from gen_data.lab.edit.own_files import Checked, CheckFile, Misplaced, add_to_scene, keep_file
from gen_data.lab.edit.photographs import (
    GROUND,
    LOWEST_DEG,
    UNKNOWN,
    Standpoint,
    is_empty,
    rectangle,
    show_behind,
)
from gen_data.lab.edit.samples import Studio
from gen_data.preview.plate_overlay import axes_px, plate_overlay


def test_a_dropped_picture_of_a_telephone_is_refused_with_a_remedy(tmp_path: Path) -> None:
    path = tmp_path / "IMG_1.HEIC"
    path.write_bytes(b"content")
    with pytest.raises(AssetError, match=r"IMG_1\.HEIC: HEIC files are not read: save them as JPE"):
        CheckFile(path).run(Studio())


def test_an_entry_has_the_horizon_of_the_tilt() -> None:
    """Fields of 90 degrees have a focal length of half the width: 45 degrees are 400 px up."""
    standpoint = Standpoint(0.6, 45.0, 90.0, rectangle((0.25, 0.75), (0.5, 1.0)))
    assert standpoint.entry("a.jpg", b"", (800, 600)) == {
        "file": "a.jpg",
        "camera_height_m": 0.6,
        "hfov_deg": 90.0,
        "horizon": {"height_px": -100.0},
        "ground": [[200, 600], [200, 300], [600, 300], [600, 600]],
    }
    assert "horizon" not in Standpoint(hfov_deg=90.0).entry("a.jpg", b"", (800, 600))
    entry = Standpoint(0.6, 45.0, 90.0, roll_deg=60.0).entry("a.jpg", b"", (800, 600))
    assert entry["horizon"] == {"height_px": -500.0, "roll_deg": 60.0}
    # Without a tilt and EXIF data, both it and the field of view are found, or neither.
    data = cv2.imencode(".png", np.zeros((6, 8), np.uint8))[1].tobytes()
    assert "hfov_deg" not in UNKNOWN.entry("a.jpg", data, (800, 600))
    assert UNKNOWN.tilted().entry("a.jpg", data, (800, 600))["hfov_deg"] == 65.0
    assert UNKNOWN.tilted().tilt_deg == 30.0


def below_deg(x: float, y: float, tilt_deg: float) -> float:
    """Angle below the horizon of a place in a photograph of 320 x 240 px and 90 degrees across."""
    right, down, tilt = 2.0 * x - 1.0, 0.75 * (2.0 * y - 1.0), math.radians(tilt_deg)
    drop = math.sin(tilt) + down * math.cos(tilt)
    return math.degrees(math.atan2(drop, math.hypot(right, math.cos(tilt) - down * math.sin(tilt))))


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A photograph without edges."""
    path = tmp_path / "desk.png"
    cv2.imwrite(str(path), np.full((240, 320, 3), 130, np.uint8))
    return path


def check(desk: Path, **given: Any) -> Checked | Misplaced:
    return CheckFile(desk, standpoint=Standpoint(hfov_deg=90.0, **given)).run(Studio())


def test_a_ground_that_was_not_given_ends_below_the_horizon(desk: Path) -> None:
    """Of a camera that looks a little upwards; one that looks down keeps the whole of it."""
    found = check(desk, tilt_deg=-3.0)
    assert isinstance(found, Checked)
    assert found.standpoint.ground is not None
    near_left, far_left, *_ = found.standpoint.ground
    assert near_left == GROUND[0]
    assert LOWEST_DEG <= below_deg(*far_left, -3.0) < LOWEST_DEG + 0.5
    found = check(desk, tilt_deg=30.0)
    assert isinstance(found, Checked)
    assert found.standpoint.ground == GROUND


def test_a_ground_above_the_horizon_is_shown_with_the_values_that_mend_it(desk: Path) -> None:
    """Both values of the message work: the angle with this ground, and the ground's new end."""
    ground = rectangle((0.1, 0.9), (0.3, 0.9))
    found = check(desk, tilt_deg=5.0, ground=ground)
    assert isinstance(found, Misplaced)
    assert cv2.imdecode(np.frombuffer(found.jpeg, np.uint8), 1).shape == (540, 720, 3)
    numbers = re.search(
        r"give 'looks down' (\d+) or more, or begin 'ground from top to bottom' at (\d+) or more",
        found.text,
    )
    assert numbers is not None
    tilt_deg, top = map(int, numbers.groups())
    # The middle of the upper edge is the highest place: -atan(0.75 * (2 * 0.3 - 1)) = 16.7 degrees.
    assert tilt_deg == 20
    assert isinstance(check(desk, tilt_deg=float(tilt_deg), ground=ground), Checked)
    ground = rectangle((0.1, 0.9), (0.01 * top, 0.9))
    assert isinstance(check(desk, tilt_deg=5.0, ground=ground), Checked)


def test_a_photograph_without_ground_has_the_angle_that_gives_it_some(desk: Path) -> None:
    """Of a camera that looks steeply upwards."""
    found = check(desk, tilt_deg=-60.0)
    assert isinstance(found, Misplaced)
    assert "give 'looks down' 8 or more" in found.text
    assert isinstance(check(desk, tilt_deg=8.0), Checked)


def test_a_photograph_that_is_added_again_replaces_its_entry(desk: Path, tmp_path: Path) -> None:
    """Its camera looked down more; another photograph of that name is refused."""
    folder, ground = tmp_path / "assets", rectangle((0.2, 0.8), (0.6, 0.9))
    texts = [""]
    for tilt_deg in (20.0, 40.0):
        found = check(desk, tilt_deg=tilt_deg, ground=ground)
        assert isinstance(found, Checked)
        keep_file(folder, desk, found)
        text = texts[-1]
        config = parse_config(text, str(tmp_path / "a.yaml"), "a") if text else None
        texts.append(add_to_scene(text, config, found))
    index = yaml.safe_load((folder / "assets.yaml").read_text())
    assert [entry["file"] for entry in index["plates"]] == ["desk.png"]
    # A focal length of 160 px: row 120 less 160 tan 40 deg.
    assert index["plates"][0]["horizon"]["height_px"] == pytest.approx(-14.3, abs=0.1)
    assert "user/desk" in texts[1]
    assert texts[2] == texts[1]
    cv2.imwrite(str(desk), np.full((240, 320, 3), 90, np.uint8))
    with pytest.raises(AssetError, match=r"another file of that name is there; rename one"):
        keep_file(folder, desk, found)


def test_an_own_photograph_replaces_those_that_come_with_gen_data() -> None:
    """A second one joins the first; the element and its randomizer have the same."""
    text = "extends: photo_plates.yaml\n"
    for photo, listed in (("user/a", "[user/a]"), ("user/b", "[user/a, user/b]")):
        text = show_behind(text, parse_config(text, "x.yaml", "x").document, photo)
        assert text.count(listed) == 2
        assert "rendered" not in text
    config = parse_config(text, "x.yaml", "x").document
    assert config.entries["elements"].items[0].get("photos").plain() == ["user/a", "user/b"]


def test_a_scene_without_a_plate_is_told() -> None:
    """The message names both ways out."""
    document = parse_config("extends: tabletop.yaml\n", "x.yaml", "x").document
    with pytest.raises(ConfigError, match=r"no {type: plate}.*empty file.*or cover the walls"):
        show_behind("extends: tabletop.yaml\n", document, "user/a")
    assert is_empty("# only\n\n  # comments\n")
    assert not is_empty("# a\nseed: 1\n")


@pytest.mark.parametrize("roll_deg", [0.0, 12.0])
def test_arrows_on_the_ground_follow_the_camera_and_the_horizon_its_roll(roll_deg: float) -> None:
    """The arrow to the right is parallel to the horizon; the one ahead leads up."""
    standpoint = Standpoint(0.6, 45.0, 90.0, roll_deg=roll_deg)
    image = np.full((600, 800, 3), 90, np.uint8)
    data = cv2.imencode(".png", image)[1].tobytes()
    entry = PlateEntry.model_validate_json(json.dumps(standpoint.entry("a.png", data, (800, 600))))
    plate = replace(
        locate_camera(entry, data, image, "a.png"),
        ground_px=((300.0, 400.0), (300.0, 200.0), (500.0, 200.0), (500.0, 400.0)),
    )
    (x, y), (end_x, end_y) = axes_px(plate)["right"]
    assert end_x > x
    assert math.degrees(math.atan2(end_y - y, end_x - x)) == pytest.approx(roll_deg, abs=1e-6)
    (x, y), (end_x, end_y) = axes_px(plate)["ahead"]
    assert end_y < y
    shown = plate_overlay(plate, image)
    assert (shown != image).any()
