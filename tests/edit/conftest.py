"""One server of the live page and one browser for the tests of a file: both take seconds to start.

They end with the file: a browser that stays open keeps an event loop, which other tests of the
process may not have.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest

from tests.browser import open_browser
from tests.carry_over.labelled import write_coco
from tests.edit.live_page import TEXT, WAIT_MS, Live, served

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Live]:
    """``gen-data edit mine.yaml --real real`` with four pictures."""
    pytest.importorskip("nicegui")
    folder = tmp_path_factory.mktemp("edit")
    (folder / "mine.yaml").write_bytes(TEXT.encode())
    write_coco(folder / "real", 1, pictures=3, names=("mug", "bowl"))
    for picture in (folder / "real").rglob("*.png"):  # A fit leaves out pictures without colours.
        pixels = cv2.imread(str(picture)) * (0.8, 1.0, 0.9)
        cv2.imwrite(str(picture), pixels.astype(np.uint8))
    temporary = tmp_path_factory.mktemp("temporary")
    cache = make_cache(tmp_path_factory.mktemp("cache"))
    arguments = ("mine.yaml", "--real", "real")
    with (
        open_browser() as opened,
        served(folder, *arguments, XDG_CACHE_HOME=str(cache), TMPDIR=str(temporary)) as url,
    ):
        page = opened.page
        page.set_default_timeout(WAIT_MS)
        page.goto(url)
        live = Live(folder, cache, url, opened, temporary)
        live.show_four()
        yield live
    assert list(temporary.iterdir()) == []  # A server that has ended leaves no copies of files.


@pytest.fixture
def page(live: Live) -> Page:
    """Its tab as it was first."""
    return live.begin()


def make_cache(folder: Path) -> Path:
    """The cache of the user with its own empty gallery."""
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    (user / "gen-data").mkdir(parents=True, exist_ok=True)
    (folder / "gen-data/gallery").mkdir(parents=True)
    for path in user.iterdir():
        if path.name != "gen-data":
            (folder / path.name).symlink_to(path)
    for path in (user / "gen-data").iterdir():
        if path.name != "gallery":
            (folder / "gen-data" / path.name).symlink_to(path)
    return folder
