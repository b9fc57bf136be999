"""The report of a generated data set: drawn parameters, and the page in a browser."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from gen_data.generator.report.drawn_parameters import DrawnParameters, draw_parameters
from gen_data.generator.report.html_page import format_page
from gen_data.generator.report.report_data import describe_dataset
from gen_data.generator.runner.stored import StoredSamples
from tests.report.handmade import HOSTILE, make_image, make_object, write_dataset

if TYPE_CHECKING:
    from playwright.sync_api import Page

CHROMIUM = ("/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome")


@pytest.fixture(scope="module")
def drawn(dataset: Path) -> DrawnParameters:
    """All three scenes of the data set, drawn again."""
    with threadpool_limits(limits=1):
        return draw_parameters(StoredSamples(dataset), 3)


def test_scenes_that_are_drawn_again_are_the_stored_ones(drawn: DrawnParameters) -> None:
    """To the last bit."""
    assert (drawn.scenes, drawn.different) == (3, 0)


def test_drawn_values_are_those_of_the_stored_scenes(drawn: DrawnParameters, dataset: Path) -> None:
    """Fields of view follow from stored focal lengths, and robots from stored shared values."""
    values = {p.name: p.values for p in drawn.parameters}
    scenes = [StoredSamples(dataset).kept_scene(index).scene for index in range(15)]

    lenses = [scene.cameras[0].intrinsics for scene in scenes]
    hfov_deg = [math.degrees(2 * math.atan(lens.width_px / 2 / lens.fx_px)) for lens in lenses]
    assert np.abs(np.array(values["lens.hfov_deg"]) - hfov_deg).max() < 1e-4
    lights = [sum(light.kind == "sphere" for light in scene.lights) for scene in scenes]
    assert values["lamps.count"] == lights
    assert values["shared.robot"] == [dict(scenes[k].shared)["robot"] for k in (0, 5, 10)]


def test_declared_values_are_drawn_from_the_declared_distribution(drawn: DrawnParameters) -> None:
    """The expected mean and limits of {uniform: [0.9, 1.5]}."""
    (distance,) = (p for p in drawn.parameters if p.name == "orbit.distance_m")

    assert list(distance.declared) == ["{uniform: [0.9, 1.5]}"]
    assert distance.limits == (0.9, 1.5)
    assert np.mean(distance.expected) == pytest.approx(1.2, abs=0.005)


@dataclass
class Opened:
    """A page in a browser, with all its messages and requests."""

    page: Page
    messages: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    @property
    def shown(self) -> str:
        """The line about the image that is shown."""
        return self.page.inner_text("#shown")

    def pixels(self) -> str:
        """The image with its overlays, as a data URL."""
        text: str = self.page.evaluate("document.querySelector('.stage canvas').toDataURL()")
        return text


@pytest.fixture(scope="module")
def opened(dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    """The page of the data set beside itself, in headless Chromium."""
    playwright = pytest.importorskip("playwright.sync_api")
    program = next((path for path in CHROMIUM if Path(path).exists()), None)
    if program is None:
        pytest.skip("needs Chromium")
    described = describe_dataset(dataset, scenes_max=0)
    path = tmp_path_factory.mktemp("page") / "index.html"
    path.write_text(format_page([described, described]), encoding="utf-8")
    flags = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=flags)
        opened = Opened(browser.new_page(viewport={"width": 1440, "height": 900}))
        opened.page.on("console", lambda message: opened.messages.append(message.text))
        opened.page.on("pageerror", lambda error: opened.messages.append(str(error)))
        opened.page.on("request", lambda request: opened.requests.append(request.url))
        opened.page.goto(path.as_uri())
        opened.page.wait_for_selector(".stage canvas[data-layers]")
        yield opened
        browser.close()


@pytest.mark.slow
def test_layers_and_filters_change_the_shown_image(opened: Opened) -> None:
    """By buttons and by keys; no message and no request but for the page itself."""
    page = opened.page
    assert opened.shown.startswith("1 of 15: sample 0, color")
    for layer in ("boxes", "names", "masks", "boxes3d", "points", "depth"):
        before = opened.pixels()
        page.click(f"button[data-layer={layer}]")
        page.wait_for_function(
            "before => document.querySelector('.stage canvas').toDataURL() !== before", arg=before
        )
    assert page.is_disabled("button[data-layer=keypoints]")
    page.keyboard.press("6")
    page.wait_for_function(
        "!document.querySelector('.stage canvas').dataset.layers.includes('depth')"
    )
    page.keyboard.press("ArrowRight")
    page.wait_for_function("document.querySelector('#shown').textContent.startsWith('2 of 15')")
    page.fill("input[data-filter=size]", "100000")
    page.wait_for_selector(".stage p:not([hidden])")
    assert opened.shown == "0 images"
    page.fill("input[data-filter=size]", "")
    page.select_option("select[aria-label='Category of the objects']", "robot_arm")
    page.wait_for_function("document.querySelector('#shown').textContent.includes('1 of ')")
    assert " 1 of " in opened.shown
    assert opened.messages == []
    assert [url.partition(":")[0] for url in opened.requests if url[:5] != "data:"] == ["file"]


@pytest.mark.slow
def test_the_page_fits_a_phone(opened: Opened) -> None:
    """It does not scroll sideways, in the light and in the dark."""
    page = opened.page
    page.set_viewport_size({"width": 390, "height": 844})
    for _ in range(2):
        page.click("button[aria-label='Dark or light']")
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.locator("#parameters, #viewpoints, #checks, #licences").count() == 4


@pytest.mark.slow
def test_the_policy_blocks_other_scripts_and_requests(opened: Opened, tmp_path: Path) -> None:
    """Names of a hostile data set are shown as text, and what is added to the file does not run."""
    image = make_image(np.random.default_rng(4))
    hostile = write_dataset(tmp_path / "set", [[make_object(1, HOSTILE)]], (HOSTILE,), [image])
    text = format_page([describe_dataset(hostile, scenes_max=0)])
    added = "<script>window.added = 1</script><img src='http://127.0.0.1:9/x.png'>"
    path = tmp_path / "index.html"
    path.write_text(text.replace("</body>", added + "</body>"), encoding="utf-8")
    browser = opened.page.context.browser
    assert browser is not None
    page = browser.new_page()
    requests: list[str] = []
    dialogs: list[str] = []
    page.on("request", lambda request: requests.append(request.url))
    page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))

    page.goto(path.as_uri())
    page.wait_for_selector(".stage canvas[data-layers]")

    assert page.evaluate("window.added") is None
    assert [url for url in requests if url[:5] != "data:"] == [path.as_uri()]
    assert dialogs == []
    assert HOSTILE in page.inner_text("#balance")
    assert HOSTILE in page.inner_text("#licences")
    page.close()
