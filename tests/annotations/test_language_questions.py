"""Questions with numbers: resolutions, margins, balance, and kinds of other packages."""

import math
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import EntryPoint
from typing import Any

import numpy as np
import pytest

from gen_data.annotations import questions
from gen_data.annotations.language import Language
from gen_data.annotations.questions import instants, metres
from gen_data.annotations.questions.resolution import sight
from gen_data.annotations.questions.view import Thing, View
from gen_data.core import plugins
from gen_data.core.boxes import BoxPx, OrientedBox
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import Utterance
from gen_data.core.scene import Camera, Scene
from gen_data.core.se3 import SE3

FOCAL_PX = 200.0
LENS = Intrinsics(320, 240, FOCAL_PX, FOCAL_PX, 160.0, 120.0)
CAMERA = Camera("color", SE3(), LENS)
ASSETS: Any = None


def reading(**channels: Any) -> SensorReading:
    images = {Channel.INSTANCE: np.zeros((240, 320), np.uint16)}
    return SensorReading("color", CAMERA, images | {Channel(k): v for k, v in channels.items()})


def thing(number: int, category: str, x_m: float, z_m: float, side_m: float = 0.2) -> Thing:
    """A cube that the camera at the origin sees along Z."""
    middle, half = round(160 + FOCAL_PX * x_m / z_m), round(0.5 * FOCAL_PX * side_m / z_m)
    box = BoxPx(middle - half, 120 - half, middle + half, 120 + half)
    solid = OrientedBox(SE3((x_m, 0.0, z_m)), (side_m, side_m, side_m))
    return Thing(number, category, box, True, True, visible_px=4 * half * half, solid=solid)


def view(*things: Thing, scene: Scene | None = None, seen: SensorReading | None = None) -> View:
    here = scene or Scene("table")
    return View(things, frozenset(), set(), (), here, seen or reading(), ASSETS)


def test_edges_are_as_fine_as_pixels_and_depth_as_the_apparent_size() -> None:
    """Of a cube of 40 px at 2 m; by hand: 2 m / 200 px / sqrt(12), and 2 m sqrt(2 / 12) / 56.6."""
    cube = thing(1, "mug", 0.0, 2.0, side_m=0.4)
    found = sight(reading(), 1, cube.box, cube.center_m)

    assert found is not None
    assert found.edge_m == pytest.approx(2.0 / 200.0 / math.sqrt(12.0), rel=1e-4)
    assert found.depth_m == pytest.approx(2.0 * math.sqrt(2.0 / 12.0) / math.hypot(40, 40))
    assert found.variance_m2(np.array([1.0, 0.0, 0.0])) == pytest.approx(found.edge_m**2)
    assert found.variance_m2(np.array([0.0, 0.0, -1.0])) == pytest.approx(found.depth_m**2)


def test_a_depth_camera_is_as_fine_as_its_readings() -> None:
    """Root mean square of its errors on the object; it measures nothing where half is missing."""
    cube = thing(1, "mug", 0.0, 2.0, side_m=0.4)
    ids = np.zeros((240, 320), np.uint16)
    ids[cube.box.window()] = 1
    true_m = np.full((240, 320), 2.0, np.float32)
    measured_m = true_m + np.where(np.indices(ids.shape).sum(0) % 2, 0.03, -0.03)
    noisy = reading(instance=ids, depth=true_m, measured_depth=measured_m)
    found = sight(noisy, 1, cube.box, cube.center_m)
    measured_m[100:125] = np.inf

    assert found is not None
    assert found.depth_m == pytest.approx(0.03, rel=1e-5)
    assert sight(noisy, 1, cube.box, cube.center_m) is None


@pytest.mark.parametrize(("apart_m", "asked"), [(0.08, 0), (0.09, 1)])
def test_a_difference_below_the_resolution_is_not_asked_for(apart_m: float, asked: int) -> None:
    """Two cubes of 20 px, at 2 m and behind: by hand 2 * 0.0289 * sqrt(1 + 1.04^2) = 83 mm."""
    pair = view(thing(1, "mug", 0.0, 2.0), thing(2, "bowl", 0.0, 2.0 + apart_m))
    said = [u for u in metres.comparison(pair) if "camera" in u.text]

    assert len(said) == asked
    assert all(
        u.measured and u.measured.resolution == pytest.approx(0.0835, abs=2e-4) for u in said
    )


def test_yes_is_as_frequent_as_no_whatever_the_truth_is() -> None:
    """In 2,000 pictures of one truth; three standard deviations of a fair coin."""
    answers = []
    for k in range(2000):
        one, two = thing(1, "mug", 0.001 * k, 1.0), thing(2, "bowl", 0.0, 3.0)
        one = replace(one, visible_px=k)
        pair = view(one, two)
        words = {"a": "the mug", "b": "the bowl"}
        answers.append(pair.asked("comparison", ("closer", "farther"), (one, two), words, True)[1])

    assert abs(answers.count("yes") - 1000) <= 3.0 * math.sqrt(500)


@pytest.mark.parametrize(
    ("b", "expected_m"),
    [([(2, 0), (3, 0), (3, 1), (2, 1)], 1.0), ([(2, 2), (3, 2), (3, 3), (2, 3)], math.sqrt(2.0)),
     ([(0.4, -1), (0.6, -1), (0.6, 2), (0.4, 2)], 0.0), ([(0.2, 0.2), (0.4, 0.2), (0.3, 0.4)], 0.0),
     ([(1, 0), (2, 0), (2, 1)], 0.0)],
    ids=["beside", "corner to corner", "cross", "inside", "touching"],
)  # fmt: skip
def test_the_gap_of_two_outlines(b: list[tuple[float, float]], expected_m: float) -> None:
    """From a unit square; outlines that cross without a corner in one another have none."""
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    ring = np.array(b, float)

    for one, two in ((square, ring), (ring, square), (square[::-1], ring)):
        assert metres.gap(one, two)[0] == pytest.approx(expected_m)


def test_the_narrowest_width_of_an_outline() -> None:
    """Of a turned rectangle: its shorter side; of an equilateral triangle: its height."""
    c, s = math.cos(0.4), math.sin(0.4)
    rectangle = np.array([(0, 0), (3, 0), (3, 1), (0, 1)]) @ np.array([[c, s], [-s, c]])
    triangle = np.array([(0, 0), (1, 0), (0.5, math.sqrt(0.75))])

    assert metres.least_width_m(rectangle) == pytest.approx(1.0)
    assert metres.least_width_m(triangle) == pytest.approx(math.sqrt(0.75))


def test_the_reach_of_a_panda_follows_from_its_dimensions(library: Any) -> None:
    """By Franka Robotics' parameters: 0.333 m to the shoulder, then three links in one line."""
    found = metres.shoulder_and_reach("franka_panda", library)

    links_m = (
        math.hypot(0.316, 0.0825), math.hypot(0.384, 0.0825), math.hypot(0.088, 0.107 + 0.1034),
    )  # fmt: skip
    assert found is not None
    assert found[0] == pytest.approx((0.0, 0.0, 0.333), abs=1e-6)
    assert found[1] == pytest.approx(sum(links_m), abs=1e-3)


@pytest.mark.parametrize(
    ("time_s", "first_s"), [(0.0, None), (0.03, None), (0.5, 0.0), (0.53, 0.03)]
)
def test_the_first_image_is_at_the_delay_of_the_camera(
    time_s: float, first_s: float | None
) -> None:
    """Steps of 0.25 s; a camera may read 30 ms after each."""
    scene = Scene("street", time_s=time_s, step_s=0.25, cameras=(CAMERA,))
    found = instants.first_scene(view(scene=scene))

    assert (found and found.time_s) == first_s


@pytest.mark.parametrize(
    ("value_m", "text"),
    [(0.0342, "3.4 cm"), (0.3421, "34 cm"), (3.4211, "3.42 m"), (34.211, "34.2 m")],
)
def test_lengths_have_about_three_digits(value_m: float, text: str) -> None:
    assert metres.length_text(value_m) == text


def greet(_: View) -> Iterator[Utterance]:
    """A kind of another package."""
    yield Utterance("greeting", "Hello.")


def test_packages_add_kinds_by_an_entry_point(monkeypatch: pytest.MonkeyPatch) -> None:
    """Third-party questions follow, and have their own names in ``kinds``."""
    entry = EntryPoint("greeting", f"{__name__}:greet", "gen_data.question")
    monkeypatch.setattr(plugins, "third_party", lambda kind: {"greeting": entry})

    assert questions.all_names() == (*questions.TABLE.entries, "greeting")
    said = list(Language(kinds=("greeting",))._utterances(view()))
    assert [u.text for u in said] == ["Hello."]
