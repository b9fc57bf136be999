"""Pictures of the grid, rendered: they show the samples of a run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from gen_data.api.dataset import Dataset
from gen_data.lab.edit import samples
from gen_data.lab.edit.overlays import View
from gen_data.lab.edit.samples import Order, Studio
from gen_data.physics import open_engine
from gen_data.physics.engine import Engine
from gen_data.report.drawn_parameters import observe_randomizer

CONFIG = {
    "extends": "tabletop.yaml",
    "without": {"randomizers": ["pose", "distractors"], "sensors": ["pseudo_lidar"]},
    "elements": {"arm": {"present": False}},
    "views_per_scene": 1,
}
TEXT = "\n".join(f"{key}: {value}" for key, value in CONFIG.items()).replace("False", "false")


@pytest.mark.slow
def test_a_changed_text_has_the_pictures_of_a_new_process() -> None:
    """Whatever was kept of earlier texts: after changes of objects, lights, camera and labels."""
    lines = (
        "- {name: clutter, count: 3}",
        "- {name: lamps, illuminance_lux: 500}",
        "- {name: orbit, distance_m: 1.2}",
    )
    text = "\n".join([TEXT, "randomizers:", *lines, "labels: {min_visible_px: 16}", "seed: 3\n"])
    studio = Studio()
    drawn = [studio.show(Order(text, "x.yaml", 1, View())).jpeg]
    for old, new in (
        ("illuminance_lux: 500", "illuminance_lux: 900"),
        ("distance_m: 1.2", "distance_m: 1.0"),
        ("count: 3", "count: 5"),
        ("min_visible_px: 16", "min_visible_px: 4000"),
        ("seed: 3", "seed: 4"),
    ):
        text = text.replace(old, new)
        drawn.append(studio.show(Order(text, "x.yaml", 1, View())).jpeg)
        anew = Studio().show(Order(text, "x.yaml", 1, View()))
        assert drawn[-1] == anew.jpeg
        assert studio.show(Order(text, "x.yaml", 1, View())).draws == anew.draws
    assert len(set(drawn)) == len(drawn)


@pytest.mark.slow
def test_scenes_stay_when_only_a_camera_develops_differently(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """No randomizer draws again for an exposure or a limit of labels, in any of two streets.

    Pictures equal a new process's, and one physics engine serves all texts of its settings.
    """
    drawn: list[str] = []
    opened: list[Engine] = []

    def spy(randomizer: Any, *arguments: Any) -> Any:
        drawn.append(randomizer.name)
        return observe_randomizer(randomizer, *arguments)

    def spy_on_engines(*arguments: Any) -> Engine:
        opened.append(open_engine(*arguments))
        return opened[-1]

    monkeypatch.setattr(f"{samples.__name__}.observe_randomizer", spy)
    monkeypatch.setattr(f"{samples.__name__}.open_engine", spy_on_engines)
    text = (
        "extends: street.yaml\n"
        "sensors: [{name: color, image_pipeline: {exposure_compensation_ev: 0}}]\n"
        "labels: {min_visible_px: 16}\n"
    )
    studio = Studio()
    for index in (0, 5):
        studio.show(Order(text, "x.yaml", index, View()))
    assert drawn.count("buildings") == 2
    count = len(opened)
    for old, new in (("ev: 0", "ev: 1"), ("min_visible_px: 16", "min_visible_px: 900")):
        drawn.clear()
        text = text.replace(old, new)
        shown = [studio.show(Order(text, "x.yaml", index, View())) for index in (0, 5, 0)]
        assert drawn == []
        for one in shown:
            anew = Studio().show(Order(text, "x.yaml", one.index, View()))
            assert (one.jpeg, one.draws) == (anew.jpeg, anew.draws)
        count += 3
    drawn.clear()
    studio.show(
        Order(text.replace("name: color", "name: color, hfov_deg: 70"), "x.yaml", 0, View())
    )
    assert drawn.count("buildings") == 1
    assert len(opened) == count  # One of each new process.


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
    # Draws belong to this sample, whatever was drawn before.
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


@pytest.mark.slow
def test_a_varied_count_adds_objects_to_those_that_are_there() -> None:
    """Each picture begins with the objects of the smaller count; other draws stay."""
    studio = Studio()
    order = Order(TEXT, "x.yaml", 1, View(), (), 64)
    plain = studio.show(order).draws
    assets = []
    for count in (2, 5):
        opened = studio._open(replace(order, pinned=(("clutter.count", count),)))
        taken = opened.take(1, opened.choose_sensor(View()), 64)
        assets.append([b.asset for b in taken.sample.scene.bodies if b.name.startswith("clutter")])
        for name, values in taken.draws.items():
            # A camera looks for a free place between other objects.
            if not name.startswith(("clutter.", "orbit.", "lens.")):
                least = min(len(values), len(plain[name]))
                assert values[:least] == plain[name][:least], name
    assert [len(one) for one in assets] == [2, 5]
    assert assets[1][:2] == assets[0]
