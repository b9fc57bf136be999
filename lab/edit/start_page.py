"""The start page: shipped configurations as pictures, files and data sets of the folders."""

from __future__ import annotations

import hashlib
import itertools
import secrets
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from nicegui import context, ui

from gen_data.core.version import __version__
from gen_data.core.whole_files import write_whole
from gen_data.lab.edit.data_sets import find_data_sets
from gen_data.lab.edit.overlays import View
from gen_data.lab.edit.samples import Order, Shown

if TYPE_CHECKING:
    from gen_data.lab.edit.desk import Desk

WIDTH_PX = 280


def shipped_configurations() -> dict[str, str]:
    """Text of every shipped configuration by file name."""
    from gen_data import configs

    folder = Path(str(configs.__path__[0]))
    return {path.name: path.read_text("utf-8") for path in sorted(folder.glob("*.yaml"))}


def headline(text: str) -> str:
    """First sentence of the comment at the head of a configuration."""
    head = itertools.takewhile(lambda line: line.startswith("#"), text.splitlines())
    lines = [line.removeprefix("#").strip() for line in head]
    own = itertools.dropwhile(lambda line: not line or line.startswith("yaml-language"), lines)
    paragraph = " ".join(itertools.takewhile(bool, own))
    first, stop, _ = paragraph.partition(". ")
    return first + stop.strip()


def picture_name(name: str, text: str) -> str:
    """File name of the picture of a configuration of this version."""
    digest = hashlib.sha256(f"{__version__}\n{text}".encode()).hexdigest()[:16]
    return f"{name}.{digest}.jpg"


def _cache_file(name: str, text: str) -> Path:
    import platformdirs

    folder = Path(platformdirs.user_cache_path("gen-data")) / "gallery"
    folder.mkdir(parents=True, exist_ok=True)
    return folder / picture_name(name, text)


def _is_kept(gallery: dict[str, bytes], name: str, text: str) -> bool:
    """Whether the picture was rendered by an earlier server; it is read then."""
    with suppress(OSError):
        gallery[name] = _cache_file(name, text).read_bytes()
    return name in gallery


class StartPage:
    """The start page of one tab; pictures are rendered one after another, and kept."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.key = f"start/{secrets.token_urlsafe(8)}"
        self._tiles: dict[str, tuple[Any, Any]] = {}

    def build(self) -> None:
        """Make all widgets, and begin."""
        context.client.on_delete(partial(self.desk.forget, self.key))
        with ui.element("header").classes("gd-bar"):
            ui.label("gen-data: begin with").classes("gd-title")
        with ui.element("main").style("padding: 8px 12px"):
            self._list("Files in the folder", self._files())
            self._list("Finished data sets", find_data_sets(self.desk.folders.roots))
            ui.label("Shipped configurations").classes("gd-name")
            with ui.element("div").classes("gd-grid"):
                for name, text in shipped_configurations().items():
                    self._tile(name, headline(text))
        self._order()

    def _files(self) -> list[Path]:
        return sorted(path for root in self.desk.folders.roots for path in root.glob("*.yaml"))

    def _list(self, title: str, paths: list[Path]) -> None:
        if not paths:
            return
        ui.label(title).classes("gd-name")
        with ui.element("div").classes("gd-row").style("margin-bottom: 10px"):
            for path in paths[:60]:
                ui.link(path.name, f"/?open={quote(str(path))}")

    def _tile(self, name: str, about: str) -> None:
        with (
            ui.link(target=f"/?open={quote(name)}").classes("gd-tile").props(f'data-name="{name}"')
        ):
            image = ui.element("img").props('alt=""')
            with ui.element("small"):
                ui.label(name.removesuffix(".yaml")).classes("gd-name")
                note = ui.label(about)
        self._tiles[name] = image, note

    def _order(self) -> None:
        waiting = []
        for name, text in shipped_configurations().items():
            if name in self.desk.gallery or _is_kept(self.desk.gallery, name, text):
                self._show(name)
            else:
                waiting.append((name, Order(text, name, 0, View(layers=frozenset()), (), WIDTH_PX)))
        # Short configurations first: their scenes tend to be simple.
        waiting.sort(key=lambda one: len(one[1].text))
        receive = partial(self._receive, [name for name, _ in waiting])
        self.desk.order(self.key, [order for _, order in waiting], receive)

    def _receive(self, names: list[str], ticket: Any, result: Any) -> None:
        name = names[ticket.slot]
        if isinstance(result, Shown):
            self.desk.gallery[name] = result.jpeg
            with suppress(OSError):
                write_whole({_cache_file(name, shipped_configurations()[name]): result.jpeg})
            self._show(name)
        else:
            self._tiles[name][1].text = result.text[:300]

    def _show(self, name: str) -> None:
        image = self._tiles[name][0]
        image.props["src"] = self.desk.pictures.put(self.desk.gallery[name])
        image.update()
