"""Panel of the user's meshes and photographs: a card each, with facts that its file lacks."""

from __future__ import annotations

import asyncio
import math
import shutil
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import ui

from gen_data.core.errors import ConfigError, GenDataError
from gen_data.lab.edit import own_files
from gen_data.lab.edit.files import ASSETS
from gen_data.lab.edit.photographs import GROUND, UNKNOWN, Corners, Standpoint, rectangle

if TYPE_CHECKING:
    from gen_data.lab.edit.panels import Tab

ASSUMED = (
    "not sure how the camera looked, as no edges confirm a horizon: set 'looks down' and 'roll' "
    "until the grid lies on the table or the ground, or the field of view, if you know it"
)
SHORTENED = "\nthe ground ends below the horizon: if the grid is tilted, change 'looks down'"
HEIGHT_HINT = "of the lens; small squares of the grid are 0.1 m"
TILT_HINT = "0: level; 30: from a chair; 60: standing at the table"
ROLL_HINT = "the horizon falls to the right; negative: to the left"
HFOV_HINT = "phones: 65 held level, 51 upright"
REACH = 0.2
"""Largest distance at which the pointer grabs a corner, as a share of the picture's edges."""
HANDLE = (
    '<circle cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}" fill="#ffdc00" stroke="#0a1923" '
    'stroke-width="{w:.1f}" /><circle cx="{x:.1f}" cy="{y:.1f}" r="{w:.1f}" fill="#0a1923" />'
)
AREA = '<polygon points="{points}" fill="none" stroke="#ffdc00" stroke-width="{w:.1f}" />'


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
                f"larger than {most // 1_000_000} MB: copy it to {ASSETS}/ and list it "
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
        folder = Path(tempfile.mkdtemp(dir=self._tab.desk.scratch))
        await event.file.save(folder / name)
        event.sender.reset()  # The list of the upload widget only repeats facts of the card.
        with self._body:
            OwnFile(self._tab, folder / name)


class OwnFile:
    """Card of one file: its picture, findings, and facts that the file does not contain."""

    def __init__(self, tab: Tab, path: Path) -> None:
        self._tab, self._path = tab, path
        self._found: own_files.Checked | None = None
        self._standpoint = UNKNOWN
        self._corners: Corners = GROUND
        self._size_px = (own_files.PHOTO_PX, own_files.PHOTO_PX)
        self._taken: int | None = None
        self._is_checked = asyncio.Event()
        self._is_seen = False
        self._ranges: list[Any] = []
        self._numbers: dict[str, Any] = {}
        self._tilt_deg, self._roll_deg = 0.0, 0.0  # State of the latest check.
        self._is_showing = self._is_assumed = False
        self._card = ui.element("div").classes("gd-field")
        self._card.props["data-file"] = path.name
        self._jobs = f"{tab.key}/file/{path}"
        with self._card:
            ui.label(path.name).classes("gd-name")
            self._image = ui.interactive_image(
                on_mouse=self._drag, events=["mousedown", "mousemove", "mouseup"], sanitize=False
            ).classes("gd-own gd-draggable" if own_files.is_photograph(path.name) else "gd-own")
            self._image.on("loaded", self._scroll)
            self._image.props["role"] = "img"
            self._image.props["aria-label"] = f"check of {path.name}"
            self._image.set_visibility(False)
            self._facts = ui.label("being checked ...").props('role="status"')
            self._choices = ui.element("div")
            ui.button("Remove", on_click=self._remove).props("dense no-caps flat").props[
                "aria-label"
            ] = f"Remove {path.name}"
        self._check(own_files.CheckFile(path))

    def _check(self, job: own_files.CheckFile) -> None:
        self._is_checked.clear()
        if self._found is not None:
            self._facts.text = "being checked again ..."
        self._tab.desk.order(self._jobs, [job], self._show)

    def _show(self, ticket: Any, found: Any) -> None:
        self._tab.desk.listeners.pop(ticket.client, None)
        self._found = found if isinstance(found, own_files.Checked) else None
        self._is_checked.set()
        has_picture = isinstance(found, own_files.Checked | own_files.Misplaced)
        self._facts.classes(add="" if self._found else "gd-refused")
        self._facts.classes(remove="gd-refused" if self._found else "")
        self._image.set_visibility(has_picture)
        self._is_assumed = has_picture and found.standpoint.tilt_deg != self._standpoint.tilt_deg
        self._facts.text = describe(found, self._is_assumed) if self._found else found.text
        if has_picture:
            self._image.set_source(self._tab.desk.pictures.put(found.jpeg))
        is_photograph = own_files.is_photograph(self._path.name)
        if has_picture and found.size_px is not None:
            scale = own_files.PHOTO_PX / max(found.size_px)
            self._size_px = (scale * found.size_px[0], scale * found.size_px[1])
            self._tilt_deg, self._roll_deg = found.tilt_roll_deg
            self._take_over(found.standpoint)
        if self._found or is_photograph:
            self._build_choices()
        if not has_picture:
            self._scroll()

    def _remove(self) -> None:
        """Remove the card and the copy of its file; the text is unchanged."""
        self._tab.desk.forget(self._jobs)
        shutil.rmtree(self._path.parent, ignore_errors=True)
        self._card.delete()

    def _take_over(self, used: Standpoint) -> None:
        """Show the ground that a check assumed."""
        is_shortened = self._standpoint.ground is None and used.ground not in (None, GROUND)
        if self._found and is_shortened and not self._is_assumed:
            self._facts.text += SHORTENED
        if self._taken is None:
            self._corners = used.ground or GROUND
            self._draw_corners()
            self._show_angles()
            for axis, one in enumerate(self._ranges):
                one.value = self._extent(axis)

    def _scroll(self) -> None:
        """Bring the card into view, once: it may begin below the edge of the window."""
        if not self._is_seen:
            self._is_seen = True
            self._tab.client.run_javascript(f"getHtmlElement({self._card.id})?.scrollIntoView()")

    def _build_choices(self) -> None:
        """Build the controls once: a slider must not be replaced while it is dragged."""
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
            for field, label, hint, value in (
                ("height_m", "camera above table or ground [m]", HEIGHT_HINT, now.height_m),
                (
                    "tilt_deg",
                    "looks down [deg], empty: from edges",
                    TILT_HINT,
                    self._shown_tilt_deg,
                ),
                ("roll_deg", "roll [deg]", ROLL_HINT, self._roll_deg),
                ("hfov_deg", "field of view across [deg], empty: EXIF", HFOV_HINT, now.hfov_deg),
            ):
                number = ui.number(
                    label, value=value, on_change=lambda e, field=field: self._stand(field, e.value)
                ).props(f'dense debounce=300 data-standpoint="{field}"')
                number.style("width: 250px").props["hint"] = hint
                self._numbers[field] = number
        for axis, label in enumerate(
            ("ground from left to right [%]", "ground from top to bottom [%]")
        ):
            ui.label(label)
            self._ranges.append(
                ui.range(min=0, max=100, value=self._extent(axis))
                .props(f'label dense aria-label="{label}"')
                .on(
                    "update:model-value",
                    partial(self._slide, axis),
                    throttle=0.2,
                    leading_events=False,
                )
            )

    @property
    def _shown_tilt_deg(self) -> float | None:
        """The tilt that was given, else the assumed one; None = estimated."""
        return self._tilt_deg if self._is_assumed else self._standpoint.tilt_deg

    def _show_angles(self) -> None:
        """Show tilt and roll of the check if the user did not give them."""
        self._is_showing = True
        is_given = self._standpoint.tilt_deg is not None
        shown = self._standpoint.roll_deg if is_given else self._roll_deg
        for field, value in (("tilt_deg", self._shown_tilt_deg), ("roll_deg", shown)):
            if field in self._numbers:
                self._numbers[field].value = value
        self._is_showing = False

    def _extent(self, axis: int) -> dict[str, float]:
        """Ends of the ground's corners along an axis [%]."""
        shares = [100.0 * corner[axis] for corner in self._corners]
        return {"min": round(min(shares)), "max": round(max(shares))}

    def _slide(self, axis: int, event: Any) -> None:
        """Make the ground the rectangle of the sliders."""
        ends = [self._extent(0), self._extent(1)]
        ends[axis] = event.args
        across, down = ((0.01 * one["min"], 0.01 * one["max"]) for one in ends)
        self._stand("ground", rectangle(across, down))

    def _drag(self, event: Any) -> None:
        """Move the corner that the pointer has grabbed."""
        if not own_files.is_photograph(self._path.name):
            return
        width, height = self._size_px
        x, y = (
            min(max(share, 0.0), 1.0) for share in (event.image_x / width, event.image_y / height)
        )
        if event.type == "mousedown":
            far = [math.hypot(a - x, b - y) for a, b in self._corners]
            self._taken = far.index(min(far)) if min(far) < REACH else None
        elif self._taken is not None:
            moved = list(self._corners)
            moved[self._taken] = (x, y)
            self._corners = tuple(moved)
            self._draw_corners()
            if event.type == "mouseup" or not event.buttons:
                self._taken = None
                self._stand("ground", self._corners)

    def _draw_corners(self) -> None:
        """Yellow handles, which can be dragged, above the picture."""
        width, height = self._size_px
        places = [(x * width, y * height) for x, y in self._corners]
        line = max(width, height) / 360.0
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        self._image.content = AREA.format(points=points, w=line) + "".join(
            HANDLE.format(x=x, y=y, r=4.0 * line, w=line) for x, y in places
        )

    def _stand(self, field: str, value: Any) -> None:
        if value is None and field in ("height_m", "roll_deg"):
            return
        old = self._standpoint
        new = replace(old, **{field: value})
        if old.tilt_deg is None and field in ("tilt_deg", "roll_deg"):
            # Either both are given or none: the other one keeps its estimate.
            found = {"tilt_deg": self._tilt_deg, "roll_deg": self._roll_deg}
            new = replace(old, **{**found, field: value})
        if self._is_showing or new == old:
            return
        self._standpoint = new
        self._show_angles()
        self._check(own_files.CheckFile(self._path, standpoint=self._standpoint))

    async def _add(self, *, walls: bool = False) -> None:
        await self._is_checked.wait()  # The latest values count.
        session, found = self._tab.session, self._found
        folder = session.file.path.parent / ASSETS
        try:
            if found is None:
                raise ConfigError(f"{self._path.name}: cannot be used as it is; see its message")
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


def describe(found: own_files.Checked, is_assumed: bool = False) -> str:
    """Findings of a check, in lines; with an assumed camera, without its horizon."""
    finding = found.finding
    facts = [finding.asset_id]
    if finding.size_m:
        size = " x ".join(f"{edge:.3g}" for edge in finding.size_m)
        facts.append(f"{size} m; unit {finding.unit}; up {finding.up}")
    if finding.note:
        room = finding.note.rpartition(", ")[2]
        facts.append(f"{ASSUMED}; {room} then" if is_assumed else finding.note)
        facts += (
            "red: horizon; yellow: ground, whose corners can be dragged; blue: a grid of 0.1 m, or "
            "1 m on large ground",
            "arrows: ahead and right of the camera. A table that stands turned has edges across "
            "them, which is right; only the horizon shows the roll",
        )
    return "\n".join([*facts, *finding.warnings])
