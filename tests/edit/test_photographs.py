"""Dropped photographs as backgrounds: their entries, and the scenes that show them."""

from __future__ import annotations

import pytest

from gen_data.assemble.config import parse_config
from gen_data.core.errors import ConfigError
from gen_data.lab.edit.photographs import UNKNOWN, Standpoint, is_empty, show_behind


def test_an_entry_has_the_horizon_of_the_tilt() -> None:
    """Fields of 90 degrees have a focal length of half the width: 45 degrees are 400 px up."""
    standpoint = Standpoint(0.6, 45.0, 90.0, (0.25, 0.75), (0.5, 1.0))
    assert standpoint.entry("a.jpg", b"", (800, 600)) == {
        "file": "a.jpg",
        "camera_height_m": 0.6,
        "hfov_deg": 90.0,
        "horizon": {"height_px": -100.0},
        "ground": [[200, 600], [200, 300], [600, 300], [600, 600]],
    }
    assert "horizon" not in Standpoint(hfov_deg=90.0).entry("a.jpg", b"", (800, 600))
    assert UNKNOWN.tilted().tilt_deg == 30.0


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
