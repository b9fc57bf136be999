"""Finished data sets: filter, sort, compare two."""

from __future__ import annotations

import asyncio
import secrets
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import context, ui

from gen_data.core.errors import GenDataError
from gen_data.lab.edit import data_sets, statistics
from gen_data.lab.edit.overlays import View
from gen_data.lab.edit.panels import home_link, table
from gen_data.lab.edit.samples import Shown

if TYPE_CHECKING:
    from gen_data.lab.edit.desk import Desk

PAGE = 24
"""Pictures shown at once, of one data set; half of it of each of two."""
LAYERS = {"boxes": "boxes", "masks": "masks", "keypoints": "keypoints", "boxes3d": "3D boxes"}
KINDS = {"photo": "photograph", "depth": "depth", "normals": "normals"}


class BrowsePage:
    """One tab with one or two data sets."""

    def __init__(self, desk: Desk, folder: Path) -> None:
        self.desk, self.folders = desk, [folder]
        self.key = f"browse/{secrets.token_urlsafe(8)}"
        self.rows: dict[Path, list[data_sets.Row]] = {}
        self.filter: dict[str, Any] = {"category": "", "split": "", "least": 0, "order": "number"}
        self.view, self.start = View(), 0
        self._tiles: list[tuple[Any, Any]] = []

    def build(self) -> None:
        """Make all widgets, and begin."""
        context.client.on_delete(partial(self.desk.forget, self.key))
        with ui.element("header").classes("gd-bar"):
            home_link()
            ui.label(str(self.folders[0])).classes("gd-title")
            others = [
                p for p in data_sets.find_data_sets(self.desk.folders.roots) if p != self.folders[0]
            ]
            names = {"": "none", **{str(path): path.name for path in others}}
            ui.select(names, value="", label="compare with", on_change=self._compare).props(
                "dense options-dense"
            ).style("min-width: 140px")
            dark = ui.dark_mode()
            ui.button(icon="contrast", on_click=dark.toggle).props(
                'dense flat round aria-label="Dark or light"'
            )
        with ui.element("main").style("padding: 8px 12px"):
            self._bar = ui.element("div").classes("gd-row")
            self._state = ui.label("reading labels ...").props('role="status"')
            self._body = ui.element("div")
            self._table = ui.element("div").classes("gd-table")
        ui.timer(0.0, self._read, once=True)

    async def _read(self) -> None:
        for folder in self.folders:
            if folder in self.rows:
                continue
            try:
                self.rows[folder] = await asyncio.to_thread(data_sets.list_rows, folder)
            except GenDataError as error:
                self._state.text = str(error)
                return
        self._build_bar()
        self._refresh()

    async def _compare(self, event: Any) -> None:
        self.folders = [self.folders[0], *([Path(event.value)] if event.value else [])]
        self.start = 0
        await self._read()

    def _build_bar(self) -> None:
        every = [row for rows in self.rows.values() for row in rows]
        categories = ["", *sorted(data_sets.count_categories(every))]
        splits = ["", *sorted({row.split for row in every})]
        self._bar.clear()
        with self._bar:
            for key, options, name in (
                ("category", categories, "class"),
                ("split", splits, "split"),
                ("order", list(data_sets.ORDERS), "order"),
            ):
                ui.select(
                    {option: option or "all" for option in options},
                    value=self.filter[key],
                    label=name,
                    on_change=lambda e, key=key: self._filter(key, e.value),
                ).props(f'dense options-dense data-filter="{key}"').style("min-width: 110px")
            ui.number(
                "objects at least", value=0, min=0, precision=0,
                on_change=lambda e: self._filter("least", int(e.value or 0)),
            ).props('dense data-filter="least"').style("width: 110px")  # fmt: skip
            ui.select(
                KINDS,
                value=self.view.kind,
                label="picture",
                on_change=lambda e: self._look(replace(self.view, kind=e.value)),
            ).props("dense options-dense").style("min-width: 110px")
            for layer, name in LAYERS.items():
                ui.checkbox(
                    name, value=layer in self.view.layers, on_change=partial(self._layer, layer)
                ).props("dense")
            ui.button("Back", on_click=lambda: self._turn(-1)).props("dense no-caps flat")
            ui.button("Next", on_click=lambda: self._turn(1)).props("dense no-caps flat")

    def _filter(self, key: str, value: Any) -> None:
        self.filter[key], self.start = value, 0
        self._refresh()

    def _look(self, view: View) -> None:
        self.view = view
        self._refresh()

    def _layer(self, layer: str, event: Any) -> None:
        layers = self.view.layers | {layer} if event.value else self.view.layers - {layer}
        self._look(replace(self.view, layers=layers))

    def _turn(self, pages: int) -> None:
        step = PAGE // len(self.folders)
        last = max(len(self._chosen(folder)) for folder in self.folders) - 1
        self.start = min(max(0, self.start + pages * step), max(0, last // step * step))
        self._refresh()

    def _chosen(self, folder: Path) -> list[data_sets.Row]:
        return data_sets.choose(self.rows[folder], **self.filter)

    def _refresh(self) -> None:
        step = PAGE // len(self.folders)
        chosen = {folder: self._chosen(folder) for folder in self.folders}
        counts = ", ".join(
            f"{f.name}: {len(c)} of {len(self.rows[f])} images" for f, c in chosen.items()
        )
        self._state.text = f"{counts}; from {self.start + 1}"
        jobs = []
        self._tiles = []
        self._body.clear()
        with self._body:
            for folder, rows in chosen.items():
                ui.label(folder.name).classes("gd-name")
                with ui.element("div").classes("gd-grid"):
                    for row in rows[self.start : self.start + step]:
                        jobs.append(
                            data_sets.StoredOrder(str(folder), row.index, row.camera, self.view)
                        )
                        self._build_tile(jobs[-1], row)
        self._show_table(chosen)
        self.desk.order(self.key, jobs, self._receive)

    def _build_tile(self, job: data_sets.StoredOrder, row: data_sets.Row) -> None:
        tile = ui.element("button").classes("gd-tile").props('type="button"')
        tile.on("click", partial(self._open_full, job))
        with tile:
            image = ui.element("img").props('alt=""')
            with ui.element("small"):
                note = ui.label(f"{row.index} {row.camera}: {len(row.objects)} objects")
        self._tiles.append((image, note))

    def _receive(self, ticket: Any, result: Any) -> None:
        if ticket.slot >= len(self._tiles):
            return
        image, note = self._tiles[ticket.slot]
        if isinstance(result, Shown):
            image.props["src"] = self.desk.pictures.put(result.jpeg)
            image.update()
        else:
            note.text = result.text

    def _open_full(self, job: data_sets.StoredOrder) -> None:
        with self._body, ui.dialog(value=True).props("maximized") as dialog, ui.card():
            with ui.element("div").classes("gd-row"):
                ui.label(f"sample {job.index}, {job.camera}").classes("gd-name")
                ui.button("Close", on_click=dialog.close).props("dense no-caps flat")
            with ui.element("div").classes("gd-full"):
                image = ui.element("img").props(f'alt="sample {job.index}"')
            body = ui.element("div").classes("gd-table")

        def receive(_: Any, result: Any) -> None:
            if not isinstance(result, Shown):
                return
            image.props["src"] = self.desk.pictures.put(result.jpeg)
            image.update()
            with body:
                table(
                    ("category", "size px", "occlusion"),
                    [
                        (
                            o.category,
                            f"{o.width_px:.0f} x {o.height_px:.0f}",
                            "" if o.occlusion is None else f"{o.occlusion:.2f}",
                        )
                        for o in result.objects
                    ],
                )

        self.desk.order(f"{self.key}/full", [replace(job, width_px=0)], receive)

    def _show_table(self, chosen: dict[Path, list[data_sets.Row]]) -> None:
        found = [statistics.summarise_rows(rows) for rows in chosen.values()]
        header = ["class"]
        for folder in chosen:
            header += [f"{folder.name}: boxes per image", "median px", "occlusion"]
        self._table.clear()
        with self._table:
            table(
                tuple(header), statistics.rows(found[0], found[1] if len(found) > 1 else None)[:60]
            )
