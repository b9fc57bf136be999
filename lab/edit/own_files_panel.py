"""Panel of the user's meshes and photographs: each has a card, with what its file does not tell."""

from __future__ import annotations

import asyncio
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import ui

from gen_data.core.errors import ConfigError, GenDataError
from gen_data.lab.edit import own_files
from gen_data.lab.edit.photographs import UNKNOWN

if TYPE_CHECKING:
    from gen_data.lab.edit.panels import Tab

ASSUMED = (
    "\nno horizon was found: change 'looks down' until the grid lies on the table or the ground"
)


class OwnFilesPanel:
    """Drop of meshes and photographs."""

    def __init__(self, tab: Tab) -> None:
        self._tab = tab
        ui.label(
            "Drop a mesh or a photograph here, or choose one with +. It is checked first; 'Add to "
            "the scene' copies it to assets/ next to the file."
        )
        most = own_files.SIZE_MAX_BYTES
        ui.upload(
            on_upload=self._take,
            on_rejected=lambda: ui.notify(
                f"larger than {most // 1_000_000} MB: copy it to {own_files.ASSETS}/ and list it "
                "in assets.yaml",
                type="negative",
            ),
            max_file_size=most,
            auto_upload=True,
            multiple=True,
            label="meshes and photographs",
        ).style("width: 100%").props(
            'flat bordered no-thumbnails color=grey-9 aria-label="Meshes and photographs"'
        )
        self._body = ui.element("div")

    async def _take(self, event: Any) -> None:
        name = own_files.plain_name(event.file.name)
        if not name:
            ui.notify("the file has no name that could be kept", type="negative")
            return
        folder = Path(tempfile.mkdtemp(prefix="gen-data-edit-"))
        self._tab.scratch.append(folder)
        await event.file.save(folder / name)
        event.sender.reset()  # Its own list of files says nothing that the card does not.
        with self._body:
            OwnFile(self._tab, folder / name)


class OwnFile:
    """Card of one file: its picture, what was found, and what the file does not tell."""

    def __init__(self, tab: Tab, path: Path) -> None:
        self._tab, self._path = tab, path
        self._found: own_files.Checked | None = None
        self._standpoint = UNKNOWN
        self._card = ui.element("div").classes("gd-field")
        self._card.props["data-file"] = path.name
        with self._card:
            ui.label(path.name).classes("gd-name")
            self._image = ui.element("img").classes("gd-own")
            self._image.props["alt"] = f"check of {path.name}"
            self._image.set_visibility(False)
            self._facts = ui.label("being checked ...").props('role="status"')
            self._choices = ui.element("div")
        self._check(own_files.CheckFile(path))

    def _check(self, job: own_files.CheckFile) -> None:
        self._tab.desk.order(f"{self._tab.key}/file/{self._path}", [job], self._show)

    def _show(self, ticket: Any, found: Any) -> None:
        self._tab.desk.listeners.pop(ticket.client, None)
        is_checked = isinstance(found, own_files.Checked)
        self._facts.classes(add="" if is_checked else "gd-refused")
        self._facts.classes(remove="gd-refused" if is_checked else "")
        self._image.set_visibility(is_checked)
        if not is_checked:
            self._facts.text = found.text
            self._found = None
            if own_files.is_photograph(self._path.name):
                self._build_choices()
            return
        self._image.props["src"] = self._tab.desk.pictures.put(found.jpeg)
        self._image.update()
        is_assumed = found.standpoint.tilt_deg is not None and self._standpoint.tilt_deg is None
        self._facts.text = describe(found) + (ASSUMED if is_assumed else "")
        if is_assumed and not self._choices.default_slot.children:
            self._standpoint = found.standpoint
        self._found = found
        self._build_choices()

    def _build_choices(self) -> None:
        """What may be changed, once: a slider must not be replaced under the hand."""
        if self._choices.default_slot.children:
            return
        with self._choices:
            if own_files.is_photograph(self._path.name):
                self._build_standpoint()
            elif self._found is not None:
                self._build_axes(self._found.entry)
            with ui.element("div").classes("gd-row"):
                ui.button("Add to the scene", on_click=self._add).props("dense no-caps outline")
                if own_files.is_photograph(self._path.name):
                    ui.button(
                        "Cover the walls with it", on_click=partial(self._add, walls=True)
                    ).props("dense no-caps flat")

    def _build_axes(self, entry: dict[str, Any]) -> None:
        now = {key: entry.get(key) for key in ("unit", "up")}

        def again(key: str, event: Any) -> None:
            now[key] = event.value
            chosen = tuple((k, v) for k, v in now.items() if v)
            self._check(own_files.CheckFile(self._path, chosen))

        with ui.element("div").classes("gd-row"):
            for key, options in (
                ("unit", ["mm", "cm", "m", "in", "ft"]),
                ("up", ["z", "y", "x", "-z", "-y", "-x"]),
            ):
                ui.select(options, value=now[key], label=key, on_change=partial(again, key)).props(
                    "dense options-dense"
                ).style("min-width: 70px")

    def _build_standpoint(self) -> None:
        now = self._standpoint
        with ui.element("div").classes("gd-row"):
            for field, label, value in (
                ("height_m", "camera above table or ground [m]", now.height_m),
                ("tilt_deg", "looks down [deg], empty: from edges", now.tilt_deg),
                ("hfov_deg", "field of view across [deg], empty: EXIF", now.hfov_deg),
            ):
                ui.number(
                    label, value=value, on_change=lambda e, field=field: self._stand(field, e.value)
                ).props(f'dense debounce=300 data-standpoint="{field}"').style("width: 250px")
        for field, label, share in (
            ("across", "ground from left to right [%]", now.across),
            ("down", "ground from top to bottom [%]", now.down),
        ):
            ui.label(label)
            ends = dict(zip(("min", "max"), (100.0 * one for one in share), strict=True))
            ui.range(
                min=0,
                max=100,
                value=ends,
                on_change=lambda e, field=field: self._stand(
                    field, (0.01 * e.value["min"], 0.01 * e.value["max"])
                ),
            ).props(f'label dense aria-label="{label}" data-standpoint="{field}"')

    def _stand(self, field: str, value: Any) -> None:
        if value is None and field == "height_m":
            return
        self._standpoint = replace(self._standpoint, **{field: value})
        self._check(own_files.CheckFile(self._path, standpoint=self._standpoint))

    async def _add(self, *, walls: bool = False) -> None:
        session, found = self._tab.session, self._found
        folder = session.file.path.parent / own_files.ASSETS
        try:
            if found is None:
                raise ConfigError(f"{self._path.name}: is being checked, or cannot be used")
            if not session.folders.contains(folder):
                raise ConfigError(f"{folder} is outside of the folders of this page")
            found = own_files.as_walls(found) if walls else found
            text = own_files.add_to_scene(session.text, session.config, found)
            await asyncio.to_thread(own_files.keep_file, folder, self._path, found)
        except GenDataError as error:
            ui.notify(str(error), type="negative", multi_line=True, timeout=10_000)
            return
        self._tab.edit(text)
        self._choices.clear()
        self._facts.text = "added to the scene"


def describe(found: own_files.Checked) -> str:
    """What a check has found, in lines."""
    finding = found.finding
    facts = [finding.asset_id]
    if finding.size_m:
        size = " x ".join(f"{edge:.3g}" for edge in finding.size_m)
        facts.append(f"{size} m; unit {finding.unit}; up {finding.up}")
    if finding.note:
        facts.append(finding.note)
        facts.append("red: horizon; yellow: ground; blue: a grid of 0.1 m, or 1 m on large ground")
    return "\n".join([*facts, *finding.warnings])
