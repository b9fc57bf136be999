"""The page in Chromium: typing, faults, controls, layers, lost processes and connections."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from gen_data.exporters.label_colors import id_color
from gen_data.lab.edit.overlays import View
from gen_data.lab.edit.samples import Order, Studio
from tests.edit.live_page import (
    COUNTS,
    DRAWN,
    LINES,
    TEXT,
    Live,
    choose_picture,
    pictures,
    put_cursor,
    set_text,
    text_of,
    type_behind,
    wait_for_pictures,
    wait_for_text,
)

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.slow


def save(page: Page) -> None:
    """By the key, until the page shows it."""
    page.keyboard.press("Control+s")
    page.wait_for_selector("[role=status]:text-is('saved')")


def erase(page: Page, count: int) -> None:
    """Characters before the cursor."""
    for _ in range(count):
        page.keyboard.press("Backspace")


def test_pictures_follow_the_text(live: Live, page: Page) -> None:
    """A fault is told with its place, and pictures stay; a valid text draws all of them again."""
    type_behind(page, "count: 3", ", cuont: 1")
    page.wait_for_selector(".gd-fault:has-text('mine.yaml:6:31: randomizers[0].cuont')")
    page.wait_for_selector(".gd-wrong:has-text('cuont')")
    page.wait_for_function("document.querySelectorAll('.gd-old img[src]').length === 4")
    before = page.evaluate(COUNTS)
    erase(page, len(", cuont: 1"))
    page.keyboard.type(", sc")
    # Not by Enter, which is a line break until the list has been open for a moment.
    page.click(".cm-tooltip-autocomplete li:has-text('scale')")
    page.keyboard.type("1.5")
    page.wait_for_function("!document.querySelector('.gd-fault')")
    wait_for_pictures(page, before)
    save(page)
    assert live.read() == TEXT.replace("count: 3}", "count: 3, scale: 1.5}").encode()


def test_a_text_that_is_no_yaml_has_its_fault(page: Page) -> None:
    """With the words of the parser at its line; pictures stay."""
    type_behind(page, "views_per_scene: 1", ": [")
    page.wait_for_selector(".gd-fault:has-text('mine.yaml:7:')")
    assert page.locator(".gd-tile img[src]").count() == 4
    erase(page, 3)
    page.wait_for_function("!document.querySelector('.gd-fault')")


def test_fast_keys_arrive_in_order_and_the_last_text_is_drawn(page: Page) -> None:
    """Thirty keys while pictures are rendered; the page takes each at once."""
    before = page.evaluate(COUNTS)
    type_behind(page, "count: 3", ", scale: 1.1")
    wait_for_pictures(page, before)
    page.wait_for_function(DRAWN)
    expected, text = pictures(page), text_of(page)
    before = page.evaluate(COUNTS)
    erase(page, 1)
    page.keyboard.type("8")
    wait_for_pictures(page, before)
    page.wait_for_function(DRAWN)
    assert all(a != b for a, b in zip(pictures(page), expected, strict=True))
    for digit in "234567892345671":
        erase(page, 1)
        page.keyboard.type(digit)
    assert text_of(page) == text
    while pictures(page) != expected:
        page.wait_for_timeout(200)


def test_controls_and_layers_change_the_pictures(page: Page) -> None:
    """A slider edits the text; labels are drawn again."""
    put_cursor(page, "count: 3")
    thumb = page.locator(".gd-field[data-field=scale] .q-slider__thumb")
    thumb.scroll_into_view_if_needed()
    before = page.evaluate(COUNTS)
    place = thumb.bounding_box()
    assert place is not None
    page.mouse.move(place["x"] + 5, place["y"] + 5)
    page.mouse.down()
    page.mouse.move(place["x"] + 60, place["y"] + 5, steps=4)
    page.mouse.up()
    wait_for_text(page, "scale: ")
    wait_for_pictures(page, before)
    # Values on the way of the slider have pictures, too; pictures of the last value stay.
    drawn: list[bytes] = []
    while drawn != pictures(page):
        page.wait_for_function(DRAWN)
        drawn = pictures(page)
        page.wait_for_timeout(1500)
    for _ in range(2):
        before = page.evaluate(COUNTS)
        page.click("[data-layer=masks]")
        wait_for_pictures(page, before)
        page.wait_for_function(DRAWN)
        assert (pictures(page) == drawn) == (
            page.locator("[data-layer=masks][aria-checked=true]").count() == 0
        )


def test_sliders_follow_a_text_that_is_typed(page: Page) -> None:
    """Key by key, also beyond their ends; then a key on one thumb keeps the value of the other."""
    put_cursor(page, "count: 3")
    slider = page.locator("[data-field=scale] .q-slider")
    slider.wait_for()
    page.keyboard.type(", scale: {uniform: [0.9, 1.2")
    page.wait_for_selector("[data-field=scale] [aria-valuenow='0.9|1.2']")
    slider.locator(".q-slider__thumb").first.press("ArrowRight")
    wait_for_text(page, "{uniform: [0.91, 1.2]}")
    put_cursor(page, "[0.91, 1.2")
    page.keyboard.type("5")
    page.wait_for_selector("[data-field=scale] [aria-valuenow='0.91|1.25']")
    put_cursor(page, "[0.91, 1")
    page.keyboard.type("7")
    page.wait_for_selector("[data-field=scale] [aria-valuenow='0.91|17.25']")
    assert float(slider.get_attribute("aria-valuemax") or 0) >= 17.25
    # Each end has a field for the keyboard.
    least = page.locator("[data-field=scale] [data-end=min]")
    assert least.input_value() == "0.91"
    least.fill("0.8")
    wait_for_text(page, "{uniform: [0.8, 17.25]}")
    page.locator("[data-field=scale] [data-end=max]").fill("1.5")
    wait_for_text(page, "{uniform: [0.8, 1.5]}")
    page.wait_for_selector("[data-field=scale] [aria-valuenow='0.8|1.5']")
    # A number that is typed next to a slider goes into the text, too.
    count = page.locator("[data-field=count] input")
    count.fill("21")
    wait_for_text(page, "count: 21,")
    assert float(page.locator("[data-field=count] .q-slider").get_attribute("aria-valuemax")) >= 21


def test_controls_do_not_overwrite_a_text_with_faults(page: Page) -> None:
    """They show the latest valid text: the message asks to correct the faulty one."""
    put_cursor(page, "count: 3")
    slider = page.locator("[data-field=scale] .q-slider")
    slider.wait_for()
    page.keyboard.type(", cuont: 1")
    page.wait_for_selector(".gd-fault:has-text('cuont')")
    text = text_of(page)
    slider.locator("[tabindex]").press("ArrowRight")
    page.wait_for_selector(".q-notification:has-text('the text has faults')")
    assert text_of(page) == text


def test_each_view_has_the_pictures_that_the_library_draws(live: Live, page: Page) -> None:
    """Depth, normals, and keypoints and 3D boxes on the photograph, in the order of the tiles."""
    studio, start = Studio(), View()
    order = Order(text_of(page), str(live.folder / "mine.yaml"), 0, start)

    def expect(view: View, act: Callable[[], None]) -> None:
        before = page.evaluate(COUNTS)
        act()
        wait_for_pictures(page, before)
        page.wait_for_function(DRAWN)
        shown = [studio.show(replace(order, index=k, view=view)).jpeg for k in range(4)]
        assert pictures(page) == shown

    expect(replace(start, kind="depth"), partial(choose_picture, page, "depth"))
    expect(replace(start, kind="normals"), partial(choose_picture, page, "normals"))
    expect(start, partial(choose_picture, page, "photograph"))
    layers: frozenset[str] = start.layers
    for layer in ("keypoints", "boxes3d") * 2:
        layers ^= {layer}
        expect(replace(start, layers=layers), partial(page.click, f"[data-layer={layer}]"))


def test_kinds_of_labels_without_any_are_told(page: Page) -> None:
    """Tables have neither lanes nor mirrors; the note goes with the choice."""
    for act, told in (
        ("[data-layer=lanes]", "these samples have no lanes"),
        ("[data-layer=text]", "these samples have no lanes, no words"),
    ):
        page.click(act)
        page.wait_for_selector(f".gd-empty:text-is('{told}')")
    page.click("[data-layer=lanes]")
    page.click("[data-layer=text]")
    page.wait_for_selector(".gd-empty", state="hidden")
    choose_picture(page, "LiDAR from above")
    page.wait_for_selector(".gd-empty:text-is('these samples have no LiDAR from above')")
    choose_picture(page, "photograph")
    page.wait_for_selector(".gd-empty", state="hidden")


def test_a_file_that_another_program_changes_or_deletes_is_told(live: Live, page: Page) -> None:
    """Within a few seconds; saving asks, and writes the page's text."""
    (live.folder / "mine.yaml").write_text("seed: 3\n")
    page.wait_for_selector("[role=status]:text-is('not saved: the file has changed on disk')")
    (live.folder / "mine.yaml").unlink()
    page.wait_for_selector("[role=status]:text-is('not saved: the file is gone from disk')")
    put_cursor(page, "# My table")
    page.keyboard.press("Control+s")
    page.wait_for_selector(".q-dialog:has-text('is gone since it was read')")
    page.click("button:has-text('Overwrite')")
    page.wait_for_selector("[role=status]:text-is('saved')")
    assert live.read().decode().replace("\r\n", "\n") == LINES
    (live.folder / "mine.yaml").write_text("seed: 4\n")
    page.wait_for_selector("[role=status]:text-is('not saved: the file has changed on disk')")
    page.keyboard.press("Control+s")
    page.click("button:has-text('Overwrite')")
    page.wait_for_selector("[role=status]:text-is('saved')")
    assert live.read().decode().replace("\r\n", "\n") == LINES


def test_a_scanner_has_its_view_from_above(live: Live, page: Page) -> None:
    """The pictures that the library draws of the same sweeps."""
    text = LINES.replace(", sensors: [pseudo_lidar]", "")
    before = page.evaluate(COUNTS)
    set_text(page, text)
    wait_for_pictures(page, before)
    before = page.evaluate(COUNTS)
    choose_picture(page, "LiDAR from above")
    wait_for_pictures(page, before)
    page.wait_for_function(DRAWN)
    studio, order = Studio(), Order(text, str(live.folder / "mine.yaml"), 0, View("scan"))
    shown = [studio.show(replace(order, index=k)) for k in range(4)]
    assert {one.sensors["pseudo_lidar"] for one in shown} == {"scan"}
    assert pictures(page) == [one.jpeg for one in shown]
    choose_picture(page, "photograph")


def test_a_text_is_saved_under_another_name(live: Live, page: Page) -> None:
    """Which the page then has; the first file stays, and names that are taken are refused."""
    with live.tab("?open=mine.yaml") as other:
        other.wait_for_selector(".gd-tile")
        saved = live.read()
        expected = text_of(other).replace("# My table", "# My table, again")
        type_behind(other, "# My table", ", again")
        for name, told in (("mine.yaml", "is there"), ("../x.yaml", "outside of the folders")):
            other.click("button:has-text('Save as')")
            other.wait_for_selector("input[aria-label=File]:focus")
            other.fill("input[aria-label=File]", name)
            other.keyboard.press("Enter")
            other.wait_for_selector(f".q-notification:has-text('{told}')")
            other.keyboard.press("Escape")
            other.wait_for_selector(".q-dialog", state="detached")
        other.click("button:has-text('Save as')")
        card = other.locator(".q-dialog .q-card")
        assert card.evaluate(
            "e => e.scrollWidth <= e.clientWidth && e.scrollHeight <= e.clientHeight"
            " && e.clientWidth <= 420"
        )
        card.locator("button:has-text('Cancel')").click()
        other.wait_for_selector(".q-dialog", state="detached")
        other.click("button:has-text('Save as')")
        other.fill("input[aria-label=File]", "copy.yaml")
        other.click(".q-dialog button:has-text('Save')")
        other.wait_for_selector(".gd-title:text-is('copy.yaml')")
        assert other.url.endswith("?open=copy.yaml")
        assert text_of(other) == expected
        assert (live.folder / "copy.yaml").read_text() == expected
        assert live.read() == saved
    (live.folder / "copy.yaml").unlink()


def test_a_sample_in_full_size_has_its_draws_and_a_recording(live: Live, page: Page) -> None:
    """The recording is a file for the Rerun viewer."""
    page.click(".gd-tile >> nth=1")
    page.wait_for_selector(".q-dialog td:has-text('clutter.upright')")
    # Before the full size is rendered, the small picture takes its place.
    page.wait_for_function("document.querySelector('.q-dialog img')?.naturalWidth > 0")
    page.wait_for_selector(".q-dialog img[data-full=ready]")
    from gen_data.lab.edit.panels import object_rows  # It needs NiceGUI.

    # Sizes are as in the picture in full size.
    shown = Studio().show(Order(text_of(page), str(live.folder / "mine.yaml"), 1, View(), (), 0))
    cells = page.locator(".q-dialog table").first.locator("td").all_inner_texts()
    assert cells == [cell for row in object_rows(shown) for cell in row]
    assert page.locator(".q-dialog img").evaluate("e => e.naturalWidth") == 640
    assert page.locator(".q-dialog .q-linear-progress:visible").count() == 0
    keys = page.locator(".q-dialog .gd-key").evaluate_all("all => all.map(e => e.style.background)")
    assert keys == [f"rgb{id_color(o.number)}" for o in shown.objects]
    with page.expect_download() as download:
        page.click("button:has-text('Recording for Rerun')")
    assert download.value.suggested_filename == "sample_000001.rrd"
    assert Path(download.value.path()).read_bytes()[:4] == b"RRF2"
    page.click(".q-dialog button:has-text('Close')")


def test_one_sample_has_a_low_a_middle_and_a_high_value(page: Page) -> None:
    """Of the sample that was chosen; then all samples come back."""
    put_cursor(page, "count: 3")
    page.click(".gd-tile >> nth=1")
    page.click("button:has-text('Vary this one')")
    page.click("button[aria-label='Vary count']")
    for slot, count in enumerate((2, 3, 6)):
        page.wait_for_selector(f"[data-slot='{slot}'] :text-is('sample 1, count: {count}')")
    assert page.locator(".gd-tile").count() == 3
    page.click(".gd-tile >> nth=2")
    page.wait_for_selector(".q-dialog .gd-name:text-is('sample 1')")
    page.wait_for_selector(".q-dialog img[data-full=ready]")
    assert page.locator(".q-dialog table").first.locator("tr").count() == 1 + 6
    page.click(".q-dialog button:has-text('Close')")
    page.click("button:has-text('All samples')")
    page.wait_for_function(DRAWN)


def test_real_pictures_stand_beside_the_shown_ones(page: Page) -> None:
    """By class, with the brightness of both; the fit wants a saved file."""
    page.click(".q-tab:has-text('Statistics')")
    page.wait_for_selector(".gd-table th:has-text('real (3): boxes per picture')")
    row = page.locator(".gd-table tr", has=page.locator("td", has_text="mug")).first
    assert float(row.locator("td").nth(4).inner_text()) >= 1
    page.wait_for_selector("text=/brightness .*: shown 0[.]\\d\\d, real 0[.]\\d\\d/")
    type_behind(page, "# My table", ", changed")
    page.click("button:has-text('Fit to the real pictures')")
    page.wait_for_selector("[role=status]:has-text('save the file first')")


def test_a_scene_that_cannot_settle_is_told_and_the_page_lives(page: Page) -> None:
    """Its reasons and fields to change are in its tile and in the list of faults."""
    text = text_of(page)
    crowded = text.replace("elements: {", "elements: {table: {top_size_m: [0.3, 0.3]}, ")
    crowded = crowded.replace("count: 3", "count: 40") + "physics: {layout_attempts_max: 1}\n"
    before = page.evaluate(COUNTS)
    set_text(page, crowded)
    page.wait_for_selector(".gd-tile .gd-refused:has-text('no valid layout in 1 attempt')")
    page.wait_for_selector(".gd-fault:has-text('Try: 1.')")
    wait_for_pictures(page, before)
    before = page.evaluate(COUNTS)
    set_text(page, text)
    page.wait_for_function("!document.querySelector('.gd-fault')")
    wait_for_pictures(page, before)


def test_keys_of_a_lost_connection_are_not_lost(live: Live, page: Page) -> None:
    """The page begins anew with the typed text when the server is within reach again."""
    page.evaluate("window.socket.disconnect()")
    type_behind(page, "# My table", " again")
    page.evaluate("window.socket.connect()")
    page.wait_for_selector(".q-notification:has-text('unsaved text of this file was restored')")
    live.show_four()
    put_cursor(page, "# My table")
    save(page)
    # A line that was edited ends as most others do.
    assert live.read() == TEXT.replace("# My table.\r", "# My table again.").encode()


def test_the_page_keeps_its_place_while_pictures_come(live: Live) -> None:
    """Tiles have the shape of their pictures before these are rendered."""
    with live.tab("?open=mine.yaml") as other:
        other.wait_for_selector(".gd-tile")
        place = "document.querySelector('.q-tabs').getBoundingClientRect().top"
        before = other.evaluate(place)
        other.wait_for_function(f"{COUNTS}.every(n => n)")
        assert abs(other.evaluate(place) - before) <= 1.0


def test_unsaved_text_outlives_a_reload(live: Live, page: Page) -> None:
    """With a notice; the file is as it was saved."""
    saved = live.read()
    type_behind(page, "# My table", ", once")
    page.reload()
    page.wait_for_selector(".q-notification:has-text('unsaved text of this file was restored')")
    assert text_of(page).startswith("# My table, once")
    assert live.read() == saved
    live.show_four()


def test_the_second_of_two_tabs_to_save_is_asked(live: Live, page: Page) -> None:
    """Each keeps a text; the second may take the file's, or write over it."""
    with live.tab("?open=mine.yaml") as other:
        other.wait_for_selector(".gd-tile[data-shown]")
        type_behind(other, "# My table", ", other")
        save(other)
        assert "other" not in text_of(page)
        page.bring_to_front()  # A tab in the background has no focus that keys reach.
        put_cursor(page, "# My table")
        page.keyboard.press("Control+s")
        page.wait_for_selector(".q-dialog:has-text('has changed since it was read')")
        assert b"# My table, other" in live.read()
        page.click("button:has-text('Overwrite')")
        page.wait_for_selector(".q-dialog", state="detached")
        assert live.read().decode().replace("\r\n", "\n") == LINES


def test_a_killed_process_costs_nothing(live: Live, page: Page) -> None:
    """The job is done by the next process; the page stays."""
    children = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children")
    if not children.exists():
        pytest.skip("needs /proc")
    before = page.evaluate(COUNTS)
    type_behind(page, "# My table", "s")
    (server,) = (int(pid) for pid in children.read_text().split() if _is_server(pid))
    workers = Path(f"/proc/{server}/task/{server}/children").read_text().split()
    for tid in Path(f"/proc/{server}/task").iterdir():
        with contextlib.suppress(FileNotFoundError):  # A thread that has ended meanwhile.
            workers += (tid / "children").read_text().split()
    for pid in set(workers):
        os.kill(int(pid), signal.SIGKILL)
    wait_for_pictures(page, before)


def _is_server(pid: str) -> bool:
    return b"edit" in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
