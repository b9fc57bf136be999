"""The page in Chromium: typing, faults, help, controls, layers, own files, narrow windows."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from tests.browser import Opened, open_browser
from tests.report.handmade import HOSTILE_NAME, make_image, make_object, write_dataset

pytestmark = pytest.mark.slow

TEXT = """\
# My table.\r
extends: tabletop.yaml
without: {randomizers: [pose, distractors], sensors: [pseudo_lidar]}
elements: {arm: {present: false}, hands: {present: false}}
randomizers:
  - {name: clutter, count: 3}
views_per_scene: 1
"""
WAIT_MS = 120_000
"""Other tests may hold the cores: nothing here depends on a clock."""
COUNTS = "[...document.querySelectorAll('.gd-tile')].map(tile => +tile.dataset.shown || 0)"
FRESH = f"before => {COUNTS}.every((count, slot) => count > (before[slot] || 0))"


@contextmanager
def served(folder: Path, *arguments: str) -> Iterator[str]:
    """The address of a page of its own process."""
    command = [sys.executable, "-m", "gen_data", "edit", *arguments, "--no-browser", "-w", "1"]
    # NiceGUI serves its own test port where it sees pytest.
    variables = {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST", "NICEGUI"))}
    with subprocess.Popen(
        command, cwd=folder, env=variables, stdout=subprocess.PIPE, text=True
    ) as server:
        assert server.stdout is not None
        found = re.search(r"http://\S+", server.stdout.readline())
        assert found is not None
        try:
            yield found[0]
        finally:
            server.send_signal(signal.SIGINT)
            assert server.wait(30) == 130


def wait_for_pictures(opened: Opened, before: list[int]) -> None:
    """Until every tile has a newer picture."""
    opened.page.wait_for_function(FRESH, arg=before, timeout=WAIT_MS)


def type_behind(opened: Opened, text: str, typed: str) -> None:
    """Put the cursor behind a text of a line, and type."""
    opened.page.evaluate(
        """async ([text]) => {
          const element = document.querySelector('.nicegui-codemirror');
          const editor = await getElement(+element.id.slice(1)).editorPromise;
          const at = editor.state.doc.toString().indexOf(text) + text.length;
          editor.dispatch({ selection: { anchor: at } });
          editor.focus();
        }""",
        [text],
    )
    opened.page.keyboard.type(typed)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("nicegui")
    folder = tmp_path_factory.mktemp("edit")
    (folder / "mine.yaml").write_bytes(TEXT.encode())
    return folder


@pytest.fixture(scope="module")
def opened(folder: Path) -> Iterator[Opened]:
    with open_browser() as opened, served(folder, "mine.yaml") as url:
        page = opened.page
        page.set_default_timeout(WAIT_MS)
        page.goto(url)
        page.wait_for_selector(".gd-tile")
        page.click("[data-grid=slots]")
        page.click(".q-item:has-text('4')")
        page.wait_for_function(f"{COUNTS}.length === 4 && {COUNTS}.every(n => n > 0)")
        yield opened


def test_pictures_follow_the_text(opened: Opened, folder: Path) -> None:
    """A fault is told with its place, and pictures stay; a valid text draws all of them again."""
    page = opened.page
    before = page.evaluate(COUNTS)
    type_behind(opened, "count: 3", ", cuont: 1")
    page.wait_for_selector(".gd-fault:has-text('mine.yaml:6:31: randomizers[0].cuont')")
    page.wait_for_selector(".gd-wrong:has-text('cuont')")
    assert page.locator(".gd-old").count() == 4
    assert page.evaluate(COUNTS) == before
    for _ in ", cuont: 1":
        page.keyboard.press("Backspace")
    page.keyboard.type(", sc")
    # Not by Enter, which is a line break until the list has been open for a moment.
    page.click(".cm-tooltip-autocomplete li:has-text('scale')")
    page.keyboard.type("1.5")
    page.wait_for_function("!document.querySelector('.gd-fault')")
    wait_for_pictures(opened, before)
    page.keyboard.press("Control+s")
    page.wait_for_selector("[role=status]:has-text('saved')")
    saved = TEXT.replace("count: 3}", "count: 3, scale: 1.5}").encode()
    assert (folder / "mine.yaml").read_bytes() == saved


def test_controls_layers_and_kinds_change_the_pictures(opened: Opened) -> None:
    """A slider edits the text; labels are drawn again; depth is rendered."""
    page = opened.page
    page.wait_for_selector(".gd-field[data-field=scale]")
    before = page.evaluate(COUNTS)
    thumb = page.locator(".gd-field[data-field=scale] .q-slider__thumb")
    place = thumb.bounding_box()
    assert place is not None
    page.mouse.move(place["x"] + 5, place["y"] + 5)
    page.mouse.down()
    page.mouse.move(place["x"] + 60, place["y"] + 5, steps=4)
    page.mouse.up()
    page.wait_for_function("!document.querySelector('.cm-content').textContent.includes('1.5}')")
    wait_for_pictures(opened, before)
    before = page.evaluate(COUNTS)
    page.click("[data-layer=masks]")
    wait_for_pictures(opened, before)
    page.click(".gd-tile >> nth=1")
    page.wait_for_selector(".q-dialog td:has-text('clutter.upright')")
    page.wait_for_selector(".q-dialog img[src]")
    page.click("button:has-text('Close')")


def test_a_killed_process_costs_nothing(opened: Opened) -> None:
    """The job is done by the next process; the page stays."""
    children = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children")
    if not children.exists():
        pytest.skip("needs /proc")
    page = opened.page
    before = page.evaluate(COUNTS)
    type_behind(opened, "# My table", "s")
    (server,) = (int(pid) for pid in children.read_text().split() if _is_server(pid))
    workers = Path(f"/proc/{server}/task/{server}/children").read_text().split()
    for tid in Path(f"/proc/{server}/task").iterdir():
        workers += (tid / "children").read_text().split()
    for pid in set(workers):
        os.kill(int(pid), signal.SIGKILL)
    wait_for_pictures(opened, before)


def _is_server(pid: str) -> bool:
    return b"edit" in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")


def test_the_page_fits_a_phone_and_asks_nobody_else(opened: Opened) -> None:
    """It does not scroll sideways; every request is to its own server, without a message."""
    page = opened.page
    page.set_viewport_size({"width": 400, "height": 860})
    for _ in range(2):
        page.click("button[aria-label='Dark or light']")
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
    hosts = {url.split("/")[2].partition(":")[0] for url in opened.requests if url[:4] == "http"}
    assert hosts == {"127.0.0.1"}
    assert opened.messages == []


def test_a_data_set_is_filtered_and_shown(opened: Opened, folder: Path) -> None:
    """By class; names are shown as text."""
    samples = [
        [make_object(1, HOSTILE_NAME), make_object(2, "bus", 40, 16)],
        [make_object(1, "car")],
    ]
    image = make_image(np.random.default_rng(5))
    write_dataset(folder / "set", samples, ("bus", "car", HOSTILE_NAME), [image])
    page = opened.page
    page.set_viewport_size({"width": 1280, "height": 900})
    page.goto(f"{page.url}?open=set")
    page.wait_for_function(
        "[...document.querySelectorAll('.gd-tile img')].every(i => i.naturalWidth)"
    )
    page.click("label:has([data-filter=category])")
    page.click(".q-item:has-text('bus')")
    page.wait_for_selector("[role=status]:has-text('set: 1 of 2 images')")
    assert HOSTILE_NAME in page.inner_text(".gd-table")
    assert page.evaluate("document.querySelector('img[onerror]')") is None
