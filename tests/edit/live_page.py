"""The live page in Chromium: its server, and how tests use the page."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tests.browser import Opened

if TYPE_CHECKING:
    from playwright.sync_api import Page

TEXT = """\
# My table.\r
extends: tabletop.yaml
without: {randomizers: [pose, distractors], sensors: [pseudo_lidar]}
elements: {arm: {present: false}, hands: {present: false}}
randomizers:
  - {name: clutter, count: 3}
views_per_scene: 1
"""
LINES = TEXT.replace("\r\n", "\n")
"""The same as the editor has it."""
WAIT_MS = 120_000
"""Other tests may hold the cores: nothing here depends on a clock."""
COUNTS = "[...document.querySelectorAll('.gd-tile')].map(tile => +tile.dataset.shown || 0)"
FRESH = f"before => {COUNTS}.every((count, slot) => count > (before[slot] || 0))"
LOADED = (
    "[...document.querySelectorAll('.gd-tile img')].length > 0 && "
    "[...document.querySelectorAll('.gd-tile img')].every(image => image.naturalWidth)"
)
DRAWN = f"{COUNTS}.length === 4 && {COUNTS}.every(n => n) && !document.querySelector('.gd-old')"
EDITOR = "getElement(+document.querySelector('.nicegui-codemirror').id.slice(1))"


@dataclass
class Live:
    """A server of the page, and a browser with a tab of ``mine.yaml``.

    Attributes:
        folder: Current folder of the server.
        cache: Its ``XDG_CACHE_HOME``.
        url: With the token.
        temporary: Its folder for temporary files.
    """

    folder: Path
    cache: Path
    url: str
    opened: Opened
    temporary: Path

    @property
    def page(self) -> Page:
        """The tab of ``mine.yaml``."""
        return self.opened.page

    @property
    def root(self) -> str:
        """Address of the start of the server."""
        return self.url.partition("?")[0]

    @contextmanager
    def tab(self, query: str) -> Iterator[Page]:
        """Another tab of the same browser."""
        page = self.opened.watch(self.page.context.new_page())
        page.set_default_timeout(WAIT_MS)
        page.goto(self.root + query)
        try:
            yield page
        finally:
            page.close()

    def read(self) -> bytes:
        """The file."""
        return (self.folder / "mine.yaml").read_bytes()

    def show_four(self) -> None:
        """Four pictures instead of eight."""
        self.page.wait_for_selector(".gd-tile")
        self.page.click("[data-grid=slots]")
        self.page.click(".q-item:has-text('4')")
        self.page.wait_for_function(DRAWN)

    def begin(self) -> Page:
        """The tab of ``mine.yaml`` with its first text and pictures, whatever was done with it."""
        page = self.page
        page.set_viewport_size({"width": 1280, "height": 900})
        while page.locator(".q-dialog").count():
            page.keyboard.press("Escape")
            page.wait_for_timeout(200)
        page.click(".q-tab:has-text('Controls')")
        if page.locator("button:has-text('All samples'):visible").count():
            page.click("button:has-text('All samples')")
        if text_of(page) != LINES:
            before = page.evaluate(COUNTS)
            set_text(page, LINES)
            wait_for_pictures(page, before)
        page.wait_for_function(f"{DRAWN} && !document.querySelector('.gd-fault')")
        return page


@contextmanager
def served(folder: Path, *arguments: str, **environment: str) -> Iterator[str]:
    """The address of a page that another process serves."""
    command = [sys.executable, "-m", "gen_data", "edit", *arguments, "--no-browser", "-w", "1"]
    # NiceGUI serves its own test port where it sees pytest.
    variables = {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST", "NICEGUI"))}
    variables |= environment
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


def wait_for_pictures(page: Page, before: list[int]) -> None:
    """Until every tile has a newer picture."""
    page.wait_for_function(FRESH, arg=before, timeout=WAIT_MS)


def text_of(page: Page) -> str:
    """Text of the editor."""
    text: str = page.evaluate(f"async () => (await {EDITOR}.editorPromise).state.doc.toString()")
    return text


def set_text(page: Page, text: str) -> None:
    """Replace the text of the editor."""
    page.evaluate(
        f"""async ([text]) => {{
          const editor = await {EDITOR}.editorPromise;
          editor.dispatch({{
            changes: {{ from: 0, to: editor.state.doc.length, insert: text }},
            selection: {{ anchor: 0 }},
          }});
        }}""",
        [text],
    )


def put_cursor(page: Page, text: str) -> None:
    """Put the cursor behind a text."""
    page.evaluate(
        f"""async ([text]) => {{
          const editor = await {EDITOR}.editorPromise;
          const at = editor.state.doc.toString().indexOf(text) + text.length;
          editor.dispatch({{ selection: {{ anchor: at }} }});
          editor.focus();
        }}""",
        [text],
    )


def type_behind(page: Page, text: str, typed: str) -> None:
    """Put the cursor behind a text of a line, and type."""
    put_cursor(page, text)
    page.keyboard.type(typed)


def wait_for_text(page: Page, text: str) -> None:
    """Until the editor shows a text."""
    shown = "document.querySelector('.cm-content').textContent"
    page.wait_for_function(f"text => {shown}.includes(text)", arg=text)


def choose_picture(page: Page, name: str) -> None:
    """Choose the kind of picture in all tiles."""
    page.click("label:has-text('picture') >> nth=0")
    page.click(f".q-item:has-text('{name}')")


def pictures(page: Page) -> list[bytes]:
    """Encoded pictures of all tiles."""
    found = page.evaluate(
        """async () => Promise.all([...document.querySelectorAll('.gd-tile img')].map(
          async (image) => [...new Uint8Array(await (await fetch(image.src)).arrayBuffer())]))"""
    )
    return [bytes(one) for one in found]
