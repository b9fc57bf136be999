"""Widgets of the page; their data is in the session."""

from __future__ import annotations

import asyncio
import json
import secrets
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from nicegui import context, ui
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response

from gen_data.assemble.documents import shipped_text
from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.core.errors import GenDataError
from gen_data.lab.edit import completion
from gen_data.lab.edit.browse_page import BrowsePage
from gen_data.lab.edit.data_sets import is_data_set
from gen_data.lab.edit.document import Fault, find_item
from gen_data.lab.edit.files import ChangedError, read_file
from gen_data.lab.edit.own_files_panel import OwnFilesPanel
from gen_data.lab.edit.panels import (
    ControlsPanel,
    ResolvedPanel,
    StatisticsPanel,
    home_link,
    show_full,
)
from gen_data.lab.edit.photographs import is_empty
from gen_data.lab.edit.samples import Check, Shown
from gen_data.lab.edit.session import BEGIN, BEGINNINGS, EACH, SLOTS, Session, Variation
from gen_data.lab.edit.start_page import StartPage
from gen_data.lab.edit.workers import Activity, Refused, Ticket

if TYPE_CHECKING:
    from gen_data.lab.edit.desk import Desk

HERE = Path(__file__).parent
PAUSE_S = 0.02
"""Pause in typing after which a text is read."""
LOOK_S = 2.0
"""Time between two checks of the file on disk."""
VIEWS = {
    "photo": "photograph",
    "depth": "depth",
    "normals": "normals",
    "layers": "layers through glass",
    "mirrors": "surfaces seen in mirrors",
    "scan": "LiDAR from above",
}
LAYER_NAMES = {
    "boxes": "boxes",
    "masks": "masks",
    "keypoints": "keypoints",
    "boxes3d": "3D boxes",
    "names": "names",
    "lanes": "lanes",
    "text": "words",
}
TABS: dict[str, EditorTab] = {}
"""Open tabs by key."""


def add_routes(app: Any, desk: Desk) -> None:
    """Pictures, and help of the editor."""
    for name in ("editor.js", "editor.css"):
        app.add_static_file(local_file=HERE / name, url_path=f"/edit/{name}", max_cache_age=0)

    @app.get("/edit/picture/{name}")  # type: ignore[untyped-decorator]
    def picture(name: str) -> Response:
        data = desk.pictures.held.get(name)
        if data is None:
            return Response(status_code=404)
        return Response(data, media_type="image/jpeg")

    @app.get("/edit/report/{name}")  # type: ignore[untyped-decorator]
    def report(name: str) -> Response:
        path = next((path for path, known in desk.reports.items() if known == name), None)
        return FileResponse(path) if path else Response(status_code=404)

    @app.post("/edit/complete")  # type: ignore[untyped-decorator]
    async def complete(request: Request) -> Response:
        text, offset, inherited = await _asked(request)
        start, found = await asyncio.to_thread(completion.complete, text, offset, inherited)
        return JSONResponse(
            {"start": start, "proposals": [_plain_proposal(one) for one in found[:200]]}
        )

    @app.post("/edit/explain")  # type: ignore[untyped-decorator]
    async def explain(request: Request) -> Response:
        text, offset, inherited = await _asked(request)
        name, found = await asyncio.to_thread(completion.explain, text, offset, inherited)
        return JSONResponse({"name": name, "text": found})


async def _asked(request: Request) -> tuple[str, int, Any]:
    asked = await request.json()
    tab = TABS.get(str(asked.get("tab")))
    config = tab.session.config if tab is not None else None
    text, offset = str(asked.get("text", "")), int(asked.get("offset", 0))
    return text, min(max(offset, 0), len(text)), None if config is None else config.document


def _plain_proposal(one: completion.Proposal) -> dict[str, str]:
    names = ("label", "insert", "kind", "detail", "info")
    return {name: getattr(one, name) for name in names}


def build(desk: Desk) -> None:
    """Build the page of one tab: an editor, a data set, or the start page."""
    ui.add_head_html('<link rel="stylesheet" href="/edit/editor.css">')
    query = context.client.request.query_params
    asked = query.get("open", "")
    source = Path(asked) if asked else None if "start" in query else desk.source
    if asked and not _may_open(desk, source):
        ui.label(f"{asked} is outside of the folders of this page, or no shipped configuration")
        return
    if source is None:
        StartPage(desk).build()
    elif is_data_set(source):
        BrowsePage(desk, source).build()
    else:
        try:
            tab = EditorTab(desk, open_session(desk, source))
        except GenDataError as error:
            ui.label(str(error)).classes("gd-refused")
            return
        TABS[tab.key] = tab
        tab.build()


def _may_open(desk: Desk, source: Path | None) -> bool:
    is_shipped = (
        source is not None and source.name == str(source) and bool(shipped_text(str(source)))
    )
    return source is not None and (is_shipped or desk.folders.contains(source))


def open_session(desk: Desk, source: Path) -> Session:
    """Read the file of a tab; a shipped configuration begins a new file of its name."""
    file = read_file(source)
    text = shipped_text(source.name) if file.content is None else ""
    return Session(file, desk.folders.with_references(file.text, source), text)


class EditorTab:
    """One tab with an editor and a grid."""

    def __init__(self, desk: Desk, session: Session) -> None:
        self.desk, self.session = desk, session
        self.key = secrets.token_urlsafe(8)
        self._changed = asyncio.Event()
        self._orders: list[Any] = []
        self._tiles: list[Tile] = []
        self.chosen: Shown | None = None
        self._on_disk = ""

    def build(self) -> None:
        """Make all widgets, and begin."""
        self.client = context.client
        self.client.on_delete(self._leave)
        with ui.element("header").classes("gd-bar"):
            self._build_bar()
        with ui.element("main").classes("gd-main"):
            with ui.element("section").classes("gd-left").props('aria-label="Configuration"'):
                self.editor = ui.codemirror(
                    self.session.text,
                    language="YAML",
                    indent="  ",
                    on_change=self._typed,
                    line_wrapping=True,
                    keymap={"Mod-s": self._save},
                )
                self._faults = ui.element("div").classes("gd-faults").props('role="status"')
            with ui.element("section").classes("gd-right").props('aria-label="Samples"'):
                self._build_view_bar()
                self._busy = ui.label("").classes("gd-busy").props('role="status"')
                self._empty = ui.label("").classes("gd-empty").props('role="status"')
                self._grid = ui.element("div").classes("gd-grid").props("data-grid=pictures")
                self._build_panels()
        ui.add_body_html('<script type="module" src="/edit/editor.js"></script>')
        ui.on("gd-line", self._moved)
        ui.timer(0.0, self._begin, once=True)
        ui.timer(LOOK_S, self._look)

    def _build_bar(self) -> None:
        home_link()
        self._title = ui.label(self.session.file.path.name).classes("gd-title")
        self._state = ui.label("").props('role="status"')
        ui.button("Save", on_click=self._save).props("dense no-caps outline")
        ui.button("Save as", on_click=self._save_as).props("dense no-caps flat")
        dark = ui.dark_mode()
        ui.button(icon="contrast", on_click=dark.toggle).props(
            'dense flat round aria-label="Dark or light"'
        )

    def _build_view_bar(self) -> None:
        grid = self.session.grid
        with ui.element("div").classes("gd-row"):
            ui.select(VIEWS, value=grid.view.kind, label="picture", on_change=self._set_kind).props(
                "dense options-dense"
            ).style("min-width: 110px")
            for layer, name in LAYER_NAMES.items():
                ui.checkbox(
                    name, value=layer in grid.view.layers, on_change=partial(self._set_layer, layer)
                ).props(f'dense data-layer="{layer}"')
            ui.select(
                list(SLOTS),
                value=grid.slots,
                label="pictures",
                on_change=lambda e: self._set_grid(slots=e.value),
            ).props('dense options-dense data-grid="slots"').style("min-width: 70px")
            ui.select(
                list(EACH),
                value=grid.each,
                label="each a",
                on_change=lambda e: self._set_grid(each=e.value),
            ).props("dense options-dense")
            ui.number(
                "from",
                value=0,
                min=0,
                step=1,
                precision=0,
                on_change=lambda e: self._set_grid(first=max(0, int(e.value or 0))),
            ).props("dense").style("width: 70px")
            self._all = ui.button("All samples", on_click=self._all_samples).props(
                "dense no-caps flat"
            )
            self._all.set_visibility(False)

    def _build_panels(self) -> None:
        with ui.tabs().props("dense no-caps align=left") as tabs:
            for name in ("Controls", "Statistics", "Own files", "Resolved"):
                ui.tab(name)
        panels = ui.tab_panels(tabs, value="Controls").props("animated=false keep-alive")
        with panels.style("width: 100%"):
            with ui.tab_panel("Controls"):
                self.controls = ControlsPanel(self)
            with ui.tab_panel("Statistics"):
                self.statistics = StatisticsPanel(self)
            with ui.tab_panel("Own files"):
                OwnFilesPanel(self)
            with ui.tab_panel("Resolved"):
                self.resolved = ResolvedPanel(self)
        self._tabs = tabs
        tabs.on_value_change(self._refresh_panel)

    def _refresh_panel(self) -> None:
        """Refresh the panel that is shown; others wait until they are."""
        shown = {"Controls": self.controls.refresh_plots, "Statistics": self.statistics.refresh}
        shown.get(str(self._tabs.value), self.resolved.refresh)()

    @property
    def base(self) -> Shown | None:
        """The sample that `vary` changes: the chosen one, else the first."""
        return self.chosen or next(iter(self.session.shown), None)

    def vary(self, variation: Variation) -> None:
        """Show one sample with several values of a field."""
        self._set_grid(variation=variation)

    async def _begin(self) -> None:
        await self.client.connected()
        key = f"gen-data:{self.session.name}"
        script = (
            "new Promise((done) => { const go = () => done(window.genDataEdit.attach("
            f"{self.editor.id}, {self.key!r}, {key!r})); "
            "window.genDataEdit ? go() : window.addEventListener('gd-ready', go); })"
        )
        draft = await ui.run_javascript(f"return await {script}", timeout=20.0)
        if isinstance(draft, str) and draft != self.session.text:
            self.editor.set_value(draft)
            ui.notify("unsaved text of this file was restored; Ctrl-Z brings back the file's")
        self._changed.set()
        self.desk.hearers[self.key] = self._hear
        self._task = asyncio.create_task(self._follow())

    async def _follow(self) -> None:
        """Read the text whenever it has changed; only the newest version."""
        while True:
            await self._changed.wait()
            await asyncio.sleep(PAUSE_S)
            self._changed.clear()
            text = self.editor.value
            await asyncio.to_thread(self.session.set_text, text)
            if self._changed.is_set():
                continue
            self._order()
            self._show_faults()
            if self.desk.schema is not None:
                await asyncio.shield(self.desk.schema)
            with self._grid:
                self.controls.refresh()

    def _order(self) -> None:
        """Order all pictures of the current text."""
        orders = self.session.orders()
        self.desk.order(self.key, orders, self._receive)
        # A text with faults has nothing else to check.
        checks = [Check(orders[0].text, orders[0].file)] if orders else []
        self.desk.order(f"{self.key}/check", checks, self._receive_check, later=True)
        self._orders = orders or self._orders
        if not orders:
            self._busy.text = ""
        elif self.session.results:
            self._busy.text = f"drawing {len(orders)} samples ..."
        else:
            self._busy.text = "starting a process that renders ..."
        self._show_tiles()

    def _receive(self, ticket: Ticket, result: Shown | Refused) -> None:
        self.session.accept(ticket, result)
        self._busy.text = ""
        if ticket.slot < len(self._tiles):
            self._tiles[ticket.slot].show(result, self.desk, self._caption(ticket.slot))
        if isinstance(result, Refused):
            self._show_faults()
        if not self.session.outdated and len(self.session.results) == len(self._orders):
            self._empty.text = describe_empty(self.session.empty)
            self._refresh_panel()

    def _hear(self, heard: Activity) -> None:
        self._busy.text = f"preparing the first picture ({heard.count}): {heard.text}"

    def _receive_check(self, ticket: Ticket, result: tuple[Fault, ...] | Refused) -> None:
        assert isinstance(ticket.job, Check)
        if not isinstance(result, Refused) and result:
            self.session.accept_check(ticket.job, result)
            self._order()
            self._show_faults()

    def _caption(self, slot: int) -> str:
        varied = self.session.grid.variation
        if varied is None or slot >= len(varied.values):
            return ""
        name = varied.field.rpartition(".")[2]
        return f"sample {varied.index}, {name}: {to_flow_yaml(varied.values[slot])}"

    def _show_tiles(self) -> None:
        while len(self._tiles) > max(len(self._orders), 1):
            self._tiles.pop().delete()
        with self._grid:
            while len(self._tiles) < len(self._orders):
                self._tiles.append(Tile(len(self._tiles), self._open_full))
        width_px, height_px = self.session.size_px
        self._grid.style(f"--gd-shape: {width_px} / {height_px}")
        for k, tile in enumerate(self._tiles):
            tile.mark(k in self.session.outdated)

    def _show_faults(self) -> None:
        faults = self.session.faults
        self._faults.clear()
        with self._faults:
            if is_empty(self.session.text):
                self._show_beginnings()
            for fault in faults[:30]:
                with (
                    ui.element("button")
                    .classes("gd-fault")
                    .on("click", partial(self.editor.reveal_line, max(fault.line, 1)))
                ):
                    ui.label(fault.text)
        listed = [{"line": f.line, "column": f.column, "text": f.text} for f in faults if f.line]
        self.client.run_javascript(
            f"window.genDataEdit.mark({self.editor.id}, {json.dumps(listed)})"
        )
        count = len(faults)
        self._state.text = f"{count} fault{'s' * (count != 1)}" if count else self._saved_words()

    def _show_beginnings(self) -> None:
        """Show how an empty file begins."""
        ui.label(BEGIN).classes("gd-begin")
        with ui.element("div").classes("gd-row"):
            for name in BEGINNINGS:
                ui.button(
                    f"extends: {name}", on_click=partial(self.edit, f"extends: {name}\n")
                ).props("dense no-caps outline size=sm")

    def _saved_words(self) -> str:
        if self._on_disk:
            return f"not saved: the file {self._on_disk}"
        return "not saved" if self.session.is_changed else "saved"

    async def _look(self) -> None:
        """Report whether another program has changed or removed the file."""
        found = await asyncio.to_thread(self.session.find_change)
        if found != self._on_disk:
            self._on_disk = found
            if not self.session.faults:
                self._state.text = self._saved_words()

    def _typed(self) -> None:
        self._changed.set()

    def edit(self, text: str) -> None:
        """Accept a text that a control has changed."""
        self.editor.set_value(text)
        self._changed.set()

    def _moved(self, event: Any) -> None:
        found = find_item(self.editor.value, self.session.name, int(event.args))
        if found is not None:
            self.controls.choose(*found)

    def _set_kind(self, event: Any) -> None:
        self._set_grid(view=replace(self.session.grid.view, kind=event.value, sensor=""))

    def _set_layer(self, layer: str, event: Any) -> None:
        layers = self.session.grid.view.layers
        layers = layers | {layer} if event.value else layers - {layer}
        self._set_grid(view=replace(self.session.grid.view, layers=layers))

    def _set_grid(self, **changes: Any) -> None:
        self.session.grid = replace(self.session.grid, **changes)
        self._all.set_visibility(self.session.grid.variation is not None)
        self._order()

    def _all_samples(self) -> None:
        self._set_grid(variation=None)

    def _open_full(self, slot: int) -> None:
        result = self.session.results.get(slot)
        if isinstance(result, Shown) and slot < len(self._orders):
            with self.client.content:
                show_full(self, self._orders[slot], result)

    async def _save(self, *, overwrite: bool = False) -> None:
        try:
            self.session.text = self.editor.value
            self.session.save(overwrite=overwrite)
        except ChangedError as error:
            self._refuse_save(str(error))
            return
        except GenDataError as error:
            ui.notify(f"not saved: {error}", type="negative", multi_line=True, timeout=10_000)
            return
        self._on_disk = ""
        self._title.text = self.session.file.path.name
        self._state.text = self._saved_words()
        ui.run_javascript(f"window.genDataEdit.forget({f'gen-data:{self.session.name}'!r})")

    def _refuse_save(self, text: str) -> None:
        with self.client.content, ui.dialog(value=True) as dialog, ui.card().classes("gd-dialog"):

            def reload() -> None:
                self._reload()
                dialog.close()

            async def overwrite() -> None:
                await self._save(overwrite=True)
                dialog.close()

            ui.label(text)
            with ui.element("div").classes("gd-row"):
                ui.button("Reload the file", on_click=reload).props("no-caps flat")
                ui.button("Overwrite", on_click=overwrite).props("no-caps outline")
                ui.button("Cancel", on_click=dialog.close).props("no-caps flat")

    def _reload(self) -> None:
        self.session.file = read_file(self.session.file.path)
        self._on_disk = ""
        self.edit(self.session.file.text)

    def _save_as(self) -> None:
        with self.client.content, ui.dialog(value=True) as dialog, ui.card().classes("gd-dialog"):
            name = ui.input("File", value=self.session.file.path.name).props("autofocus")
            name.style("width: 100%")

            def save() -> None:
                old, path = self.session.name, Path(name.value).expanduser()
                try:
                    self.session.text = self.editor.value
                    self.session.save_as(self.session.file.path.parent / path)
                except GenDataError as error:
                    ui.notify(str(error), type="negative")
                    return
                # The address and the key of unsaved text contain the name of the file.
                ui.run_javascript(f"window.genDataEdit.forget({f'gen-data:{old}'!r})")
                ui.navigate.to(f"/?open={quote(self.session.name)}")

            name.on("keydown.enter", save)
            with ui.element("div").classes("gd-row"):
                ui.button("Save", on_click=save).props("no-caps outline")
                ui.button("Cancel", on_click=dialog.close).props("no-caps flat")

    def _leave(self) -> None:
        TABS.pop(self.key, None)
        self.desk.forget(self.key)
        self._task.cancel()


def describe_empty(names: list[str]) -> str:
    """Labels and pictures that the shown samples lack, in words; empty if none."""
    words = [LAYER_NAMES.get(name) or VIEWS[name] for name in names]
    return f"these samples have no {', no '.join(words)}" if words else ""


class Tile:
    """One picture of the grid."""

    def __init__(self, slot: int, open_full: Callable[[int], None]) -> None:
        self._button = (
            ui.element("button")
            .classes("gd-tile")
            .props(f'type="button" aria-label="Picture {slot + 1}" data-slot="{slot}"')
        )
        self._button.on("click", lambda: open_full(slot))
        with self._button:
            with ui.element("div").classes("gd-frame"):
                self._image = ui.element("img").props('alt=""')
                self._refused = ui.label().classes("gd-refused")
            with ui.element("small"):
                self._caption = ui.label("...")

    def show(self, result: Shown | Refused, desk: Desk, caption: str = "") -> None:
        """Show a result."""
        if isinstance(result, Shown):
            self._image.props["src"] = desk.pictures.put(result.jpeg)
            self._image.update()
            self._caption.text = caption or f"sample {result.index}"
            self._refused.text = ""
        else:
            self._refused.text = result.text
        self._button.props["data-shown"] = str(int(self._button.props.get("data-shown", 0)) + 1)
        self._image.set_visibility(isinstance(result, Shown))
        self.mark(False)

    def mark(self, is_old: bool) -> None:
        """Show whether the picture is of an older text."""
        self._button.classes(add="gd-old" if is_old else "", remove="" if is_old else "gd-old")

    def delete(self) -> None:
        """Remove the widget."""
        self._button.delete()
