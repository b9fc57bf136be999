"""The page of a report in a browser: layers, filters, narrow windows, and its policy."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from gen_data.report.html_page import format_page
from gen_data.report.report_data import describe_dataset
from tests.browser import Opened, open_browser
from tests.report.handmade import HOSTILE, HOSTILE_NAME, make_image, make_object, write_dataset
from tests.report.test_report_layers import BORDERS, make_frame

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    folder = tmp_path_factory.mktemp("sets")
    rng = np.random.default_rng(5)
    samples = [[make_object(1, "car"), make_object(2, "bus", 40, 16)]] * 14 + [[]]
    frames = [make_frame()] * 14 + [make_frame(0)]
    sets = [
        write_dataset(folder / name, samples, ("bus", "car"), [make_image(rng)], frames, BORDERS)
        for name in ("one", "two")
    ]
    path = folder / "index.html"
    text = format_page([describe_dataset(one, scenes_max=0) for one in sets])
    path.write_text(text, encoding="utf-8")
    with open_browser(width=1440) as opened:
        opened.page.goto(path.as_uri())
        opened.page.wait_for_selector(".stage canvas[data-layers]")
        yield opened


def shown(opened: Opened) -> str:
    return opened.page.inner_text("#shown")


def pixels(opened: Opened) -> str:
    """The image with its overlays, as a data URL."""
    text: str = opened.page.evaluate("document.querySelector('.stage canvas').toDataURL()")
    return text


def test_layers_and_filters_change_the_shown_image(opened: Opened) -> None:
    """By buttons and by keys; no message and no request but for the page itself."""
    page = opened.page
    assert shown(opened).startswith("1 of 15: sample 0, color")
    for layer in ("boxes", "boxes3d", "masks", "keypoints", "points", "depth", "lanes", "tracks"):
        before = pixels(opened)
        page.click(f"button[data-layer={layer}]")
        page.wait_for_function(
            "before => document.querySelector('.stage canvas').toDataURL() !== before", arg=before
        )
    page.keyboard.press("6")
    page.wait_for_function(
        "!document.querySelector('.stage canvas').dataset.layers.includes('depth')"
    )
    caption = page.inner_text(".above figcaption")
    assert "voxels of 0.5 m. 8 with a surface, 6 within objects and the ground, 10 free." in caption
    assert "62.5 % of the surfaces observed by color, top" in caption
    assert page.evaluate("document.querySelector('.above img').naturalWidth") == 3
    page.keyboard.press("ArrowRight")
    page.wait_for_function("document.querySelector('#shown').textContent.startsWith('2 of 15')")
    page.fill("input[data-filter=size]", "100000")
    page.wait_for_selector(".stage p:not([hidden])")
    assert shown(opened) == "0 images"
    assert page.locator(".above").is_hidden()
    page.fill("input[data-filter=size]", "")
    page.select_option("select[aria-label='Category of the objects']", "bus")
    page.wait_for_function("document.querySelector('#shown').textContent.includes('1 of 14')")
    assert shown(opened).endswith("1 of 2 objects")
    assert opened.messages == []
    assert [url.partition(":")[0] for url in opened.requests if url[:5] != "data:"] == ["file"]


def test_the_page_fits_a_phone(opened: Opened) -> None:
    """It does not scroll sideways, in the light and in the dark."""
    page = opened.page
    page.set_viewport_size({"width": 390, "height": 844})
    for _ in range(2):
        page.click("button[aria-label='Dark or light']")
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.locator("#parameters, #viewpoints, #checks, #licences").count() == 4


def test_the_policy_blocks_other_scripts_and_requests(opened: Opened, tmp_path: Path) -> None:
    """Hostile names are shown as text, and scripts that are added to the file do not run."""
    image = make_image(np.random.default_rng(4))
    hostile = write_dataset(
        tmp_path / "set", [[make_object(1, HOSTILE_NAME)]], (HOSTILE_NAME,), [image]
    )
    text = format_page([describe_dataset(hostile, scenes_max=0)])
    added = "<script>window.added = 1</script><img src='http://127.0.0.1:9/x.png'>"
    path = tmp_path / "index.html"
    path.write_text(text.replace("</body>", added + "</body>"), encoding="utf-8")
    browser = opened.page.context.browser
    assert browser is not None
    page = browser.new_page()
    answered: list[str] = []
    failed: dict[str, str | None] = {}
    dialogs: list[str] = []
    page.on("requestfinished", lambda request: answered.append(request.url))
    page.on("requestfailed", lambda request: failed.update({request.url: request.failure}))
    page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
    page.goto(path.as_uri())
    page.wait_for_selector(".stage canvas[data-layers]")
    assert page.evaluate("window.added") is None
    assert [url for url in answered if url[:5] != "data:"] == [path.as_uri()]
    assert failed == {"http://127.0.0.1:9/x.png": "csp"}  # refused before any connection
    assert dialogs == []
    assert HOSTILE_NAME in page.inner_text("#balance")
    assert HOSTILE in page.inner_text("#licences")
    page.close()
