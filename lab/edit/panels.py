"""Panels below the grid: controls of an item, statistics of the pictures, a picture in full size."""

from __future__ import annotations

from collections import Counter
from functools import partial
from typing import TYPE_CHECKING, Any

from nicegui import run, ui

from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.core.errors import GenDataError
from gen_data.lab.edit import controls
from gen_data.lab.edit.document import list_origins
from gen_data.lab.edit.session import drawn_values, vary

if TYPE_CHECKING:
    from gen_data.lab.edit.page import EditorTab
    from gen_data.lab.edit.samples import Order, Shown


class ControlsPanel:
    """Controls of one item, and plots of what it draws."""

    def __init__(self, tab: EditorTab) -> None:
        self._tab = tab
        self._item = (controls.GENERAL, "")
        self._shown: list[controls.Control] = []
        self._plots: dict[str, Any] = {}
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
        found = controls.list_controls(config, *self._item)
        if found == self._shown:
            return
        # While a slider is dragged, it must not be replaced under the hand.
        same = [(c.field, c.kind, c.form) for c in found] == [
            (c.field, c.kind, c.form) for c in self._shown
        ]
        self._shown = found
        if same and self._fields.default_slot.children:
            return
        self._fields.clear()
        self._plots = {}
        with self._fields:
            for control in found:
                self._build(control)
        self.refresh_plots()

    def _build(self, control: controls.Control) -> None:
        with ui.element("div").classes("gd-field").props(f'data-field="{control.field}"'):
            with ui.element("div").classes("gd-row"):
                ui.label(control.field).classes("gd-name").tooltip(control.help)
                ui.label(control.place or "default").classes("gd-place")
            self._build_input(control)
            if control.form and controls.find_distribution(
                self._tab.session.config, *self._item, control.field
            ):  # type: ignore[arg-type]
                self._plots[control.field] = ui.echart(_plot(None)).classes("gd-plot")

    def _build_input(self, control: controls.Control) -> None:
        change = partial(self._change, control)
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
            low, high = control.value[control.form]
            ui.range(
                min=control.low,
                max=control.high,
                step=control.step,
                value={"min": low, "max": high},
            ).props(f"label dense {named}").on(
                "update:model-value",
                lambda e: change((e.args["min"], e.args["max"])),
                throttle=0.1,
                leading_events=False,
            )
        elif control.kind == "normal":
            now = control.value["normal"]
            for name in ("mean", "stddev"):
                ui.number(
                    name,
                    value=now.get(name),
                    step=control.step,
                    on_change=lambda e, name=name: (
                        e.value is not None
                        and change(tuple(({**now, name: e.value})[k] for k in ("mean", "stddev")))
                    ),
                ).props("dense")
        else:
            value = control.value["probability"] if control.form == "probability" else control.value
            with ui.element("div").style(
                "display: grid; grid-template-columns: 1fr 84px; gap: 10px"
            ):
                slider = ui.slider(
                    min=control.low, max=control.high, step=control.step, value=value
                ).props(f"label dense {named}")
                number = ui.number(value=value, step=control.step).props("dense").bind_value(slider)
                del number
                slider.on(
                    "update:model-value",
                    lambda e: change(e.args),
                    throttle=0.1,
                    leading_events=False,
                )

    def _build_chips(self, control: controls.Control, change: Any) -> None:
        chosen = (
            set(controls.outcomes(control.value)) if control.kind == "weights" else {control.value}
        )
        with ui.element("div").classes("gd-row").style("gap: 0"):
            for option in control.options:

                def toggle(event: Any, option: Any = option) -> None:
                    if control.kind == "choice":
                        change(option)
                        return
                    (chosen.add if event.value else chosen.discard)(option)
                    if chosen:
                        change([one for one in control.options if one in chosen])

                ui.chip(
                    str(option),
                    selectable=True,
                    selected=option in chosen,
                    on_selection_change=toggle,
                ).props("dense tabindex=0")

    def _change(self, control: controls.Control, value: Any) -> None:
        session = self._tab.session
        section, name = self._item
        try:
            plain = control.yaml(value)
            if section == controls.GENERAL:
                text = session.set_field(control.field, "", [], plain)
            else:
                text = session.set_field(section, name, [control.field], plain)
        except GenDataError as error:
            ui.notify(str(error), type="negative")
            return
        session.text = text
        self._tab.edit(text)

    def refresh_plots(self) -> None:
        """Draw what the shown samples drew beside the declared densities."""
        config = self._tab.session.config
        for field, chart in self._plots.items():
            found = config and controls.find_distribution(config, *self._item, field)
            if not found:
                continue
            drawn = drawn_values(self._tab.session.shown, f"{self._item[1]}.{field}")
            chart.options.clear()
            chart.options.update(_plot(controls.density(found, drawn)))
            chart.update()


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


class ObjectsPanel:
    """Statistics of the shown samples."""

    def __init__(self, tab: EditorTab) -> None:
        self._tab = tab
        self._body = ui.element("div").classes("gd-table")

    def refresh(self) -> None:
        """Show the statistics of the pictures that are complete."""
        shown = self._tab.session.shown
        objects = [item for one in shown for item in one.objects]
        counts = Counter(item.category for item in objects)
        self._body.clear()
        with self._body:
            lights = [one.brightness for one in shown if one.brightness is not None]
            if lights:
                ui.label(f"brightness {sum(lights) / len(lights):.2f} (mean grey value, 0 to 1)")
            table(
                ("category", "objects", "width px", "height px", "occlusion"),
                [
                    (
                        name,
                        str(count),
                        _mean([o.width_px for o in objects if o.category == name]),
                        _mean([o.height_px for o in objects if o.category == name]),
                        _mean(
                            [
                                o.occlusion
                                for o in objects
                                if o.category == name and o.occlusion is not None
                            ],
                            2,
                        ),
                    )
                    for name, count in counts.most_common(40)
                ],
            )


def _mean(values: list[float], digits: int = 0) -> str:
    return f"{sum(values) / len(values):.{digits}f}" if values else ""


def table(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    """A plain table; all cells are text."""
    with ui.element("table"):
        with ui.element("tr"):
            for name in header:
                with ui.element("th"):
                    ui.label(name)
        for row in rows:
            with ui.element("tr"):
                for cell in row:
                    with ui.element("td"):
                        ui.label(cell)


def show_full(tab: EditorTab, order: Order, shown: Shown) -> None:
    """Show a sample in full size with its draws."""
    from dataclasses import replace

    assert tab.desk.workers is not None
    with ui.dialog(value=True).props("maximized") as dialog, ui.card().style("width: 100%"):
        with ui.element("div").classes("gd-row"):
            ui.label(f"sample {shown.index}").classes("gd-name")
            ui.button("Close", on_click=dialog.close).props("dense no-caps flat")
        with ui.element("div").classes("gd-full"):
            image = ui.element("img").props(f'alt="sample {shown.index}"')
            state = ui.label("rendering ...")
        with ui.element("div").classes("gd-table"):
            table(
                ("category", "size px", "occlusion"),
                [
                    (
                        o.category,
                        f"{o.width_px:.0f} x {o.height_px:.0f}",
                        "" if o.occlusion is None else f"{o.occlusion:.2f}",
                    )
                    for o in shown.objects
                ],
            )
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

    def receive(ticket: Any, result: Any) -> None:
        jpeg = getattr(result, "jpeg", None)
        state.text = "" if jpeg else result.text
        if jpeg:
            image.props["src"] = tab.desk.pictures.put(jpeg)
            image.update()

    client = f"{tab.key}/full"
    tab.desk.listeners[client] = receive
    tab.desk.workers.submit(client, [replace(order, width_px=0)])
