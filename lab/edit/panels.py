"""Panels below the grid: controls, statistics, origins; a picture at full size."""

from __future__ import annotations

import asyncio
import secrets
import sys
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol
from urllib.parse import quote

from nicegui import ui

from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.core import processes
from gen_data.core.errors import ConfigError, GenDataError
from gen_data.exporters.label_colors import id_color
from gen_data.lab.edit import controls, statistics
from gen_data.lab.edit.document import list_origins
from gen_data.lab.edit.samples import Recording
from gen_data.lab.edit.session import drawn_values, vary
from gen_data.lab.matching.match import LEAST, SCENES

if TYPE_CHECKING:
    from gen_data.lab.edit.desk import Desk
    from gen_data.lab.edit.samples import Order, Shown
    from gen_data.lab.edit.session import Session, Variation


class Tab(Protocol):
    """Parts of a tab that its panels use.

    Attributes:
        key: Name of the tab.
        client: Its connection to a browser.
        base: The sample that `vary` changes; None without pictures.
        chosen: The sample that the user has chosen for it.
    """

    key: str
    desk: Desk
    session: Session
    client: Any
    chosen: Shown | None

    @property
    def base(self) -> Shown | None: ...  # noqa: D102

    def edit(self, text: str) -> None: ...  # noqa: D102

    def vary(self, variation: Variation) -> None: ...  # noqa: D102


class ControlsPanel:
    """Controls of one item, and plots of its draws."""

    def __init__(self, tab: Tab) -> None:
        self._tab = tab
        self._item = (controls.GENERAL, "")
        self._built: tuple[str, str] | None = None
        self._controls: dict[str, controls.Control] = {}
        self._cells: dict[str, Any] = {}
        self._places: dict[str, Any] = {}
        self._plots: dict[str, Any] = {}
        self._written: str | None = None  # The latest text, if a control has produced it.
        self._select = (
            ui.select({}, on_change=self._picked, label="item")
            .props('dense options-dense aria-label="Item"')
            .style("min-width: 220px")
        )
        self._fields = ui.element("div").classes("gd-fields")
        self._is_picking = False

    def choose(self, section: str, name: str) -> None:
        """Show the item at the cursor."""
        item = (section, name) if section in controls.SECTIONS and name else (controls.GENERAL, "")
        if item != self._item:
            self._item = item
            self.refresh()

    def _picked(self, event: Any) -> None:
        if event.value is not None and not self._is_picking:
            section, _, name = event.value.partition("/")
            self._item = section, name
            self.refresh()

    def refresh(self) -> None:
        """Show the controls of the latest valid configuration."""
        config = self._tab.session.config
        if config is None:
            return
        names = ["/".join(item) for item in controls.list_items(config)]
        current = "/".join(self._item)
        self._is_picking = True
        self._select.set_options(
            {n: n.strip("/").replace("/", ": ") for n in names},
            value=current if current in names else names[0],
        )
        self._is_picking = False
        if current not in names:
            self._item = (controls.GENERAL, "")
        found = {one.field: one for one in controls.list_controls(config, *self._item)}
        old, self._controls = self._controls, found
        # A slider must not be replaced while it is dragged.
        is_own = self._tab.session.text == self._written
        self._written = self._written if is_own else None
        if list(found) != list(old) or self._item != self._built:
            self._built, self._places, self._plots = self._item, {}, {}
            self._fields.clear()
            with self._fields:
                self._cells = {
                    field: ui.element("div").classes("gd-field").props(f'data-field="{field}"')
                    for field in found
                }
            old = {}
        for field, control in found.items():
            was = old.get(field)
            if was is not None and is_own and (was.kind, was.form) == (control.kind, control.form):
                self._places[field].text = _place(control)
            elif control != was:
                self._cells[field].clear()
                with self._cells[field]:
                    self._build(control)
                self._plot_drawn(field)

    def _build(self, control: controls.Control) -> None:
        field = control.field
        with ui.element("div").classes("gd-row"):
            ui.label(field).classes("gd-name").props["title"] = control.help
            self._places[field] = ui.label(_place(control)).classes("gd-place")
            if control.kind in ("number", "range", "normal"):
                ui.button("vary", on_click=partial(self._vary, field)).props(
                    f'dense flat no-caps size=sm aria-label="Vary {field}"'
                ).props["title"] = "one sample with a low, middle and high value of this field"
        self._build_input(control)
        self._plots.pop(field, None)
        if control.form and controls.find_distribution(
            self._tab.session.config, *self._item, field
        ):
            self._plots[field] = ui.echart(_plot(None)).classes("gd-plot")

    def _build_input(self, control: controls.Control) -> None:
        change = partial(self._change, control.field)
        named = f'aria-label="{control.field}"'
        if control.kind == "flag":
            ui.switch(value=bool(control.value), on_change=lambda e: change(e.value)).props(
                f"dense {named}"
            )
        elif control.kind in ("choice", "weights"):
            self._build_chips(control, change)
        elif control.kind == "text":
            text = "" if control.value is None else to_flow_yaml(control.value)
            ui.label(text).style("overflow-wrap: anywhere")
        elif control.kind == "range":
            self._build_range(control, change)
        elif control.kind == "normal":
            for name in ("mean", "stddev"):
                ui.number(
                    name,
                    value=control.value["normal"].get(name),
                    step=control.step,
                    on_change=partial(self._change_normal, control.field, name),
                ).props("dense")
        else:
            self._build_slider(control, change)

    def _build_range(self, control: controls.Control, change: Any) -> None:
        """A slider with two thumbs, and an input field for each end."""
        low, high = control.value[control.form]
        both = {"min": low, "max": high}
        fields: dict[str, Any] = {}

        def typed(end: str, event: Any) -> None:
            ends = {**slider.value, end: event.value}
            if event.value is None or ends == slider.value or ends["min"] > ends["max"]:
                return
            slider.props["min"] = min(slider.props["min"], ends["min"])
            slider.props["max"] = max(slider.props["max"], ends["max"])
            slider.value = ends
            change((ends["min"], ends["max"]))

        def slid(event: Any) -> None:
            for end, field in fields.items():
                field.value = event.args[end]
            change((event.args["min"], event.args["max"]))

        with ui.element("div").classes("gd-range"):
            slider = (
                ui.range(min=control.low, max=control.high, step=control.step, value=both)
                .props(f'label dense aria-label="{control.field}"')
                .on("update:model-value", slid, throttle=0.1, leading_events=False)
            )
            for end, name in (("min", "least"), ("max", "greatest")):
                fields[end] = ui.number(
                    value=both[end], step=control.step, on_change=partial(typed, end)
                ).props(f'dense debounce=300 data-end="{end}" aria-label="{control.field}, {name}"')

    def _build_slider(self, control: controls.Control, change: Any) -> None:
        value = control.value["probability"] if control.form == "probability" else control.value
        with ui.element("div").style("display: grid; grid-template-columns: 1fr 84px; gap: 10px"):
            slider = ui.slider(
                min=control.low, max=control.high, step=control.step, value=value
            ).props(f'label dense aria-label="{control.field}"')

            def typed(event: Any) -> None:
                if event.value is None:
                    return
                slider.props["min"] = min(slider.props["min"], event.value)
                slider.props["max"] = max(slider.props["max"], event.value)
                change(event.value)

            ui.number(value=value, step=control.step, on_change=typed).props(
                f'dense debounce=300 aria-label="{control.field}"'
            ).bind_value(slider)
            slider.on(
                "update:model-value",
                lambda e: change(e.args),
                throttle=0.1,
                leading_events=False,
            )

    def _build_chips(self, control: controls.Control, change: Any) -> None:
        is_one = control.kind == "choice"
        chosen = {control.value} if is_one else set(controls.outcomes(control.value))
        chips: dict[Any, Any] = {}

        def toggle(option: Any, event: Any) -> None:
            if is_one:
                # Exactly one option is selected, and it cannot be deselected.
                if event.value:
                    change(option)
                for other, chip in chips.items():
                    chip.selected = other == self._controls[control.field].value
                return
            (chosen.add if event.value else chosen.discard)(option)
            if chosen:
                change([one for one in control.options if one in chosen])

        with ui.element("div").classes("gd-row").style("gap: 0"):
            for option in control.options:
                chips[option] = ui.chip(
                    str(option),
                    color=None,
                    selectable=True,
                    selected=option in chosen,
                    on_selection_change=partial(toggle, option),
                ).props("dense tabindex=0")

    def _change_normal(self, field: str, name: str, event: Any) -> None:
        if event.value is not None:
            now = {**self._controls[field].value["normal"], name: event.value}
            self._change(field, (now["mean"], now["stddev"]))

    def _change(self, field: str, value: Any) -> None:
        session, control = self._tab.session, self._controls[field]
        section, name = self._item
        try:
            if session.analysis.config is None and session.text != self._written:
                raise ConfigError("the text has faults, which controls do not show: correct it")
            plain = control.yaml(value)
            if section == controls.GENERAL:
                text = session.set_field(field, "", [], plain)
            else:
                text = session.set_field(section, name, [field], plain)
        except GenDataError as error:
            ui.notify(str(error), type="negative")
            return
        if control.value == plain or text == session.text:
            return
        self._controls[field] = replace(control, value=plain)
        self._written = session.text = text
        self._tab.edit(text)

    def _vary(self, field: str) -> None:
        """Show one sample with three values of a field."""
        session, control = self._tab.session, self._controls[field]
        section, name = self._item
        config, base = session.config, self._tab.base
        found = controls.find_distribution(config, section, name, field)
        values = controls.three_values(control, found)
        if base is None or values is None:
            ui.notify("there is no picture to vary yet, or the field is not a number")
            return
        place = "" if section == controls.GENERAL else section
        self._tab.vary(vary(base, place, name, field, values))

    def refresh_plots(self) -> None:
        """Plot draws of the shown samples over the declared densities."""
        for field in self._plots:
            self._plot_drawn(field)

    def _plot_drawn(self, field: str) -> None:
        session, chart = self._tab.session, self._plots.get(field)
        found = controls.find_distribution(session.config, *self._item, field)
        if found and chart is not None:
            drawn = drawn_values(session.shown, f"{self._item[1]}.{field}")
            chart.options.clear()
            chart.options.update(_plot(controls.density(found, drawn)))
            chart.update()


def _place(control: controls.Control) -> str:
    """Origin of a value, and the legal values."""
    legal = f"; legal: {control.legal}" if control.legal else ""
    return (control.place or "default") + legal


def _plot(shown: controls.Density | None) -> dict[str, Any]:
    """Options of a chart: declared density as an area, drawn values as bars."""
    series = (
        []
        if shown is None
        else [
            {
                "type": "line",
                "data": shown.declared,
                "areaStyle": {"opacity": 0.25},
                "symbol": "none",
                "step": "middle",
                "name": "declared",
            },
            {
                "type": "bar",
                "data": shown.drawn,
                "name": f"drawn ({shown.count})",
                "barWidth": "45%",
            },
        ]
    )
    return {
        "animation": False,
        "grid": {"left": 4, "right": 4, "top": 6, "bottom": 18},
        "tooltip": {"trigger": "axis"},
        "xAxis": {
            "type": "category",
            "data": list(shown.labels) if shown else [],
            "axisTick": {"show": False},
        },
        "yAxis": {"show": False},
        "series": series,
    }


class StatisticsPanel:
    """Statistics of the shown samples and of real pictures, and the fit to them."""

    def __init__(self, tab: Tab) -> None:
        self._tab = tab
        self._real: statistics.Summary | None = None
        self._process: asyncio.subprocess.Process | None = None
        self._is_fitting = False
        tab.client.on_delete(self._end_fit)
        self._note = ui.label("")
        if tab.desk.real is not None:
            with ui.element("div").classes("gd-row"):
                self._start = ui.button("Fit to the real pictures", on_click=self._fit)
                self._start.props("dense no-caps outline").set_enabled(False)
                self._scenes = ui.number(
                    "scenes to simulate", value=SCENES, min=LEAST, step=1, precision=0
                ).props('dense data-fit="scenes"')
                self._cancel = ui.button("Cancel", on_click=self._end_fit).props(
                    "dense no-caps flat"
                )
                self._cancel.set_visibility(False)
            self._progress = ui.label("").props('role="status"')
            self._result = ui.element("div")
            ui.timer(0.0, self._read, once=True)
        self._body = ui.element("div").classes("gd-table")

    async def _read(self) -> None:
        assert self._tab.desk.real is not None
        try:
            self._real = await asyncio.to_thread(statistics.read_summary, self._tab.desk.real)
        except GenDataError as error:
            self._progress.text = f"there is nothing to fit to: {error}"
        self.refresh()

    def _allow(self) -> None:
        """Allow a fit if there are real pictures and samples, and no fit is running."""
        if self._tab.desk.real is not None:
            is_idle = self._process is None and not self._is_fitting
            self._start.set_enabled(bool(is_idle and self._real and self._tab.session.shown))

    def refresh(self) -> None:
        """Show the statistics of the pictures that are complete."""
        shown = self._tab.session.shown
        self._allow()
        ours = statistics.summarise(shown)
        sides = [("shown", ours), *([("real", self._real)] if self._real else [])]
        lights = [f"{n} {s.brightness:.2f}" for n, s in sides if s.brightness is not None]
        self._note.text = (
            f"brightness (mean grey value, 0 to 1): {', '.join(lights)}" if lights else ""
        )
        header = ["class"]
        if self._real and not self._real.classes:
            # Columns without labels would be blank.
            self._note.text += f"; no labels found in {self._tab.desk.real}"
            sides.pop()
        for name, side in sides:
            header += [f"{name} ({side.pictures}): boxes per picture", "median px", "occlusion"]
        self._body.clear()
        with self._body:
            real = self._real if len(sides) > 1 else None
            table(tuple(header), statistics.rows(ours, real)[:60])

    async def _fit(self) -> None:
        """Run the command match on the saved file; the result is a file that extends it."""
        session, real = self._tab.session, self._tab.desk.real
        path = session.file.path
        if session.is_changed:
            self._progress.text = "save the file first: the fit extends it"
            return
        out = path.with_name(f"{path.stem}_matched.yaml")
        command = (
            sys.executable,
            "-m",
            "gen_data",
            "match",
            str(real),
            str(path),
            "--out",
            str(out),
            "--scenes",
            str(int(self._scenes.value or SCENES)),
        )
        if self._is_fitting:
            return
        self._is_fitting = True
        self._allow()
        try:
            await self._run_fit(command, out)
        finally:
            self._is_fitting = False
            self._allow()

    async def _run_fit(self, command: Sequence[str], out: Path) -> None:
        self._result.clear()
        self._progress.text = "fitting; this takes some minutes ..."
        self._cancel.set_visibility(True)
        self._process = process = await asyncio.create_subprocess_exec(
            *processes.tie(command),
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
        )
        assert process.stderr is not None
        said: deque[str] = deque(maxlen=12)
        async for line in process.stderr:
            said.append(line.decode(errors="replace").rstrip())
            self._progress.text = f"fitting: {said[-1]}"
        failed = await process.wait()
        is_ended, self._process = self._process is None, None
        self._cancel.set_visibility(False)
        if failed:
            self._progress.text = "the fit was cancelled" if is_ended else "\n".join(said)[-500:]
            return
        report = out.with_suffix(".html")
        self._progress.text = f"wrote {out.name}"
        with self._result, ui.element("div").classes("gd-row"):
            ui.link(f"open {out.name}", f"/?open={quote(str(out))}")
            address = self._tab.desk.reports.setdefault(str(report), secrets.token_urlsafe(12))
            ui.link(f"report {report.name}", f"/edit/report/{address}", new_tab=True)

    def _end_fit(self) -> None:
        """End the process of the fit, which then writes nothing."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()


class ResolvedPanel:
    """Every value of the resolved configuration with the file and line that give it."""

    def __init__(self, tab: Tab) -> None:
        self._tab = tab
        self._search = ui.input("field, value or file", on_change=self.refresh).props(
            "dense clearable"
        )
        self._body = ui.element("div").classes("gd-table")

    def refresh(self) -> None:
        """Show the values of the latest valid configuration."""
        config, wanted = self._tab.session.config, str(self._search.value or "")
        rows = [] if config is None else [(o.field, o.value, o.place) for o in list_origins(config)]
        self._body.clear()
        with self._body:
            table(
                ("field", "value", "from"), [row for row in rows if wanted in " ".join(row)][:150]
            )


def home_link() -> None:
    """A link to the start page."""
    ui.link("gen-data", "/?start=1").classes("gd-home").props["title"] = "start page"


def table(
    header: tuple[str, ...], rows: Sequence[tuple[str, ...]], colors: Sequence[str] = ()
) -> None:
    """A plain table; all cells are text.

    Args:
        header: Names of the columns.
        rows: Cells.
        colors: CSS colour of a square at the beginning of each row; empty = none.
    """
    with ui.element("table"):
        with ui.element("tr"):
            for name in header:
                with ui.element("th"):
                    ui.label(name)
        for number, row in enumerate(rows):
            with ui.element("tr"):
                for column, cell in enumerate(row):
                    with ui.element("td"):
                        if column == 0 and colors and colors[number]:
                            square = ui.element("span").classes("gd-key")
                            square.style(f"background: {colors[number]}")
                        ui.label(cell)


def object_rows(shown: Shown) -> list[tuple[str, str, str, str]]:
    """Class, name, size and occlusion of the objects of a picture."""
    return [
        (
            o.category,
            o.name,
            f"{o.width_px:.0f} x {o.height_px:.0f}",
            "" if o.occlusion is None else f"{o.occlusion:.2f}",
        )
        for o in shown.objects
    ]


def object_colors(shown: Shown) -> list[str]:
    """CSS colours of the labels drawn for the objects of a picture; empty = unknown."""
    colors = [id_color(o.number) if o.number else None for o in shown.objects]
    return [f"rgb{color}" if color else "" for color in colors]


def show_full(tab: Tab, order: Order, shown: Shown) -> None:
    """Show a sample at full size with its draws."""
    shape = tab.session.size_px
    with ui.dialog(value=True).props("maximized") as dialog, ui.card().style("width: 100%"):
        with ui.element("div").classes("gd-row"):
            ui.label(f"sample {shown.index}").classes("gd-name")
            ui.button("Close", on_click=dialog.close).props("dense no-caps flat")
            ui.button("Vary this one", on_click=partial(_choose_base, tab, shown, dialog)).props(
                "dense no-caps flat"
            ).props["title"] = "the buttons 'vary' of the controls change this sample"
            ui.button("Recording for Rerun", on_click=partial(_record, tab, order)).props(
                "dense no-caps flat"
            )
        with ui.element("div").classes("gd-full"):
            image = ui.element("img").props(f'alt="sample {shown.index}"')
            if order.view.kind == "layers":  # side by side
                image.style("width: 100%")
            else:
                image.style(f"aspect-ratio: {shape[0]} / {shape[1]}; width: {shape[0]}px")
            # Until it is rendered, the small picture is shown.
            image.props["src"] = tab.desk.pictures.put(shown.jpeg)
            progress = ui.linear_progress(show_value=False).props(
                'indeterminate aria-label="rendering"'
            )
            state = ui.label("rendering in full size ...").props('role="status"')
        with ui.element("div").classes("gd-table"):
            objects = ui.element("div")
            table(
                ("parameter", "drawn"),
                [
                    (
                        name,
                        ", ".join(to_flow_yaml(v) for v in values[:12])
                        + (" ..." if len(values) > 12 else ""),
                    )
                    for name, values in shown.draws.items()
                ],
            )

    def receive(_: Any, result: Any) -> None:
        jpeg = getattr(result, "jpeg", None)
        state.text = "" if jpeg else result.text
        progress.set_visibility(False)
        if jpeg:
            image.props["src"] = tab.desk.pictures.put(jpeg)
            image.props["data-full"] = "ready"
            image.update()
            # Sizes in the configured image: a small picture has other sizes, and misses small
            # objects.
            with objects:
                header = ("class", "object", "size px", "occlusion")
                table(header, object_rows(result), object_colors(result))

    tab.desk.order(f"{tab.key}/full", [replace(order, width_px=0)], receive)


def _choose_base(tab: Tab, shown: Shown, dialog: Any) -> None:
    tab.chosen = shown
    dialog.close()
    ui.notify(f"sample {shown.index} is the one that 'vary' changes")


def _record(tab: Tab, order: Order) -> None:
    """Hand a recording of the sample to the browser; `rerun FILE` opens it."""

    def receive(ticket: Any, result: Any) -> None:
        tab.desk.listeners.pop(ticket.client, None)
        with tab.client.content:
            if isinstance(result, bytes):
                ui.download.content(result, f"sample_{order.index:06}.rrd")
            else:
                ui.notify(result.text, type="negative")

    tab.desk.order(f"{tab.key}/rerun", [Recording(order)], receive)
