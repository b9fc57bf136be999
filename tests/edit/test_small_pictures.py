"""Pictures of the grid, rendered: they show the samples of a run."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gen_data.api.dataset import Dataset
from gen_data.lab.edit.overlays import View
from gen_data.lab.edit.samples import Order, Studio

CONFIG = {
    "extends": "tabletop.yaml",
    "without": {"randomizers": ["pose", "distractors"], "sensors": ["pseudo_lidar"]},
    "elements": {"arm": {"present": False}},
    "views_per_scene": 1,
}
TEXT = "\n".join(f"{key}: {value}" for key, value in CONFIG.items()).replace("False", "false")


@pytest.mark.slow
def test_a_small_picture_shows_the_sample_of_the_run() -> None:
    """The same objects in the same places, but for a pixel of the small image on each side."""
    studio = Studio()
    shown = studio.show(Order(TEXT, "x.yaml", 1, View()))
    (sample,) = Dataset(CONFIG)[1:2]
    expected = {
        (box.category, round(box.x_max - box.x_min), round(box.y_max - box.y_min))
        for box in sample.boxes2d["color"]
    }
    assert len(shown.objects) == len(expected) > 2
    limit_px = 2 * 640 / 240
    for item in shown.objects:
        assert any(
            item.category == category
            and abs(item.width_px - width) <= limit_px
            and abs(item.height_px - height) <= limit_px
            for category, width, height in expected
        )
    # Draws are those of this sample, whatever was drawn before.
    again = Studio().show(Order(TEXT, "x.yaml", 1, View()))
    other = studio.show(Order(TEXT, "x.yaml", 2, View()))
    assert studio.show(Order(TEXT, "x.yaml", 1, View("depth"))).draws == shown.draws
    assert again.draws == shown.draws != other.draws
    # One field varies, and the others stay.
    order = Order(TEXT, "x.yaml", 1, View(), ("randomizers.orbit.distance_m=1",))
    nearer = studio.show(order).draws
    kept = {k: v for k, v in shown.draws.items() if not k.startswith("orbit.")}
    assert kept == {k: v for k, v in nearer.items() if not k.startswith("orbit.")}
    assert replace(order, width_px=0).run(studio).objects != shown.objects
