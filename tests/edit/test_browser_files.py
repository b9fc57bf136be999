"""Files in the page: own meshes and photographs, the gallery, data sets, and refusals."""

from __future__ import annotations

import json
import os
import urllib.error
import urllib.request
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest

from gen_data.core.temporary_folders import remove_abandoned
from gen_data.lab.edit.own_files import SIZE_MAX_BYTES
from gen_data.lab.edit.start_page import picture_name, shipped_configurations
from tests.edit.live_page import COUNTS, LOADED, Live, set_text, text_of, wait_for_pictures
from tests.report.handmade import HOSTILE_NAME, make_image, make_object, write_dataset

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

pytestmark = pytest.mark.slow

TETRAHEDRON = """\
v 0 0 0
v 80 0 0
v 0 60 0
v 0 0 50
f 1 3 2
f 1 2 4
f 2 3 4
f 3 1 4
"""
DROP = """async ([name, text]) => {
  const data = new DataTransfer();
  data.items.add(new File([text], name));
  const uploader = document.querySelector('.q-uploader');
  const event = (kind) => new DragEvent(kind, { dataTransfer: data, bubbles: true });
  uploader.dispatchEvent(event('dragover'));
  while (!uploader.querySelector('.q-uploader__dnd')) await new Promise(requestAnimationFrame);
  uploader.querySelector('.q-uploader__dnd').dispatchEvent(event('drop'));
}"""


IN_VIEW = """name => {
  const card = document.querySelector(`[data-file='${name}']`).getBoundingClientRect();
  return card.top >= 0 && card.top < innerHeight - 100;
}"""


def photograph() -> bytes:
    """A plain table seen from above its edge: no straight edge shows its horizon."""
    image = np.full((240, 320, 3), (150, 170, 190), np.uint8)
    image[60:] = (90, 110, 130)
    encoded: bytes = cv2.imencode(".jpg", image)[1].tobytes()
    return encoded


def test_a_photograph_begins_a_scene_and_a_mesh_joins_it(live: Live) -> None:
    """In an empty file: the photograph stands behind four classes; a dropped mesh is the fifth."""
    with live.tab("?open=mine_too.yaml") as page:
        # Not a fault, but ways to begin.
        page.wait_for_selector(".gd-begin:has-text('Begin with a shipped configuration')")
        assert page.locator("button:has-text('extends: rooms.yaml')").count() == 1
        assert page.locator(".gd-fault").count() == 0
        page.click("[data-grid=slots]")
        page.click(".q-item:has-text('4')")
        page.click(".q-tab:has-text('Own files')")
        file = {"name": "desk.jpg", "mimeType": "image/jpeg", "buffer": photograph()}
        page.set_input_files("input[type=file]", [file])
        card = page.locator("[data-file='desk.jpg']")
        card.locator("[role=status]:has-text('not sure how the camera looked')").wait_for()
        tilt = card.locator("[data-standpoint=tilt_deg]")
        assert tilt.input_value() == "30"
        card.locator("[data-standpoint=height_m]").fill("1")
        card.locator("[role=status]:has-text('room for objects 1.2 m')").wait_for()
        # It stays unsure, and shows no horizon, until the angle is given.
        status = card.locator("[role=status]").inner_text()
        assert "not sure how the camera looked" in status
        assert "horizon from row" not in status
        # A minute of thought, in which another process clears up.
        for folder in live.temporary.glob("gen-data-edit-*"):
            os.utime(folder, (0, 0))
        remove_abandoned(live.temporary)
        picture = card.locator("img")

        def await_another(drawn: str | None) -> None:
            page.wait_for_function(
                "old => document.querySelector('[data-file] img').getAttribute('src') !== old",
                arg=drawn,
            )

        for given, told in (
            (
                "2",
                "give 'looks down' 9 or more, or begin 'ground from top to bottom' at 53",
            ),
            ("40", "a grid of 0.1 m"),
        ):
            drawn = picture.get_attribute("src")
            drag(page, card, (0.1, 0.45), (0.1, 0.4)) if given == "2" else None
            tilt.fill(given)
            card.locator(f'[role=status]:has-text("{told}")').wait_for()
            await_another(drawn)
        card.locator("[data-standpoint=roll_deg]").fill("4")
        card.locator("[role=status]:has-text('looks down 40.0 deg and rolls 4.0 deg')").wait_for()
        drag(page, card, (0.1, 0.4), (0.25, 0.5))
        page.wait_for_selector(
            "[aria-label='ground from top to bottom [%]'][aria-valuenow='45|95']"
        )
        card.locator("button:has-text('Add to the scene')").click()
        page.wait_for_function(f"{COUNTS}.length === 4 && {COUNTS}.every(n => n)")
        assert "{type: plate, name: plate, photos: [user/desk]}" in text_of(page)
        page.evaluate(DROP, ["my wedge.obj", TETRAHEDRON])
        card = page.locator("[data-file='my wedge.obj']")
        card.locator("[role=status]:has-text('0.08 x 0.06 x 0.05 m; unit mm')").wait_for()
        before = page.evaluate(COUNTS)
        card.locator("button:has-text('Add to the scene')").click()
        wait_for_pictures(page, before)
        assert page.evaluate(IN_VIEW, "my wedge.obj")
        page.click(".q-tab:has-text('Statistics')")
        page.wait_for_selector(".gd-table td:has-text('my wedge')")
        assert {p.name for p in (live.folder / "assets").iterdir()} == {
            "assets.yaml", "desk.jpg", "my wedge.obj"
        }  # fmt: skip
        kept = (live.folder / "assets/assets.yaml").read_text()
        assert "[32, 228], [80, 120], [288, 108], [288, 228]" in kept
        assert "roll_deg: 4" in kept
        page.click(".gd-tile >> nth=0")
        page.wait_for_selector(".q-dialog td >> text=/^(clutter|own_my_wedge)/")
        page.click(".q-dialog button:has-text('Close')")
        page.get_by_role("button", name="Save", exact=True).click()
        page.wait_for_selector("[role=status]:text-is('saved')")
        fit(page)
        with page.expect_popup() as popup:
            page.click("a:has-text('report mine_too_matched.html')")
        assert popup.value.locator("h1, title").first.inner_text() or popup.value.title()
        popup.value.close()
        page.click("a:has-text('open mine_too_matched.yaml')")
        page.wait_for_selector(".gd-title:text-is('mine_too_matched.yaml')")
        page.wait_for_function(f"{COUNTS}.some(n => n)")
        assert page.locator(".gd-fault").count() == 0
        assert "\n      preset: photograph\n" in text_of(page)


def fit(page: Page) -> None:
    """With few scenes, until it names the written file."""
    page.click(".q-tab:has-text('Statistics')")
    page.fill("[data-fit=scenes]", "4")
    page.click("button:has-text('Fit to the real pictures')")
    page.wait_for_selector("[role=status]:has-text('fitting: ')")
    assert page.locator("button:has-text('Fit to the real pictures')").is_disabled()
    page.click("button:has-text('Cancel'):visible")
    page.wait_for_selector("[role=status]:has-text('the fit was cancelled')")
    page.click("button:has-text('Fit to the real pictures')")
    page.wait_for_selector("[role=status]:has-text('wrote mine_too_matched.yaml')")


def drag(page: Page, card: Locator, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Drag a place of a card's picture to another one, by their shares of its edges."""
    picture = card.locator("img")
    picture.scroll_into_view_if_needed()
    box = picture.bounding_box()
    assert box is not None
    place = [(box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in (start, end)]
    page.mouse.move(*place[0])
    page.mouse.down()
    page.mouse.move(*place[1], steps=3)
    page.mouse.up()


def test_a_scene_of_meshes_has_no_place_for_a_photograph_behind_it(live: Live, page: Page) -> None:
    """The message says so; the walls of its room can have it, and too large a file is refused."""
    page.click(".q-tab:has-text('Own files')")
    file = {"name": "wall.jpg", "mimeType": "image/jpeg", "buffer": photograph()}
    page.set_input_files("input[type=file]", [file])
    page.click("[data-file='wall.jpg'] button:has-text('Add to the scene')")
    page.wait_for_selector(".q-notification:has-text('this scene is built of meshes')")
    before = page.evaluate(COUNTS)
    page.click("button:has-text('Cover the walls with it')")
    wait_for_pictures(page, before)
    assert "{name: room, walls: [photo_wall], painted: false" in text_of(page)
    large = live.folder / "large.stl"
    with large.open("wb") as file:
        file.truncate(SIZE_MAX_BYTES + 1)
    page.set_input_files("input[type=file]", large)
    page.wait_for_selector(".q-notification:has-text('larger than 200 MB')")
    large.unlink()


def test_the_start_page_shows_every_shipped_configuration(live: Live) -> None:
    """As a picture each: from earlier servers at once, the missing one when it is rendered."""
    jpeg = cv2.imencode(".jpg", np.zeros((30, 40, 3), np.uint8))[1].tobytes()
    shipped = shipped_configurations()
    for name, text in shipped.items():
        if name != "tabletop.yaml":
            (live.cache / "gen-data/gallery" / picture_name(name, text)).write_bytes(jpeg)
    with live.tab("?start=1") as page:
        page.wait_for_function(LOADED)
        assert page.locator(".gd-tile").count() == len(shipped)
        page.wait_for_function(
            "document.querySelector('[data-name=\"tabletop.yaml\"] img').naturalWidth === 280"
        )
        assert "mine.yaml" in page.locator(".gd-row").first.inner_text()
        page.click("[data-name='tabletop.yaml']")
        page.wait_for_selector(".gd-title:text-is('tabletop.yaml')")


def test_a_data_set_is_filtered_and_compared(live: Live) -> None:
    """By class; a second one stands next to it; names are shown as text."""
    samples = [
        [make_object(1, HOSTILE_NAME), make_object(2, "bus", 40, 16)],
        [make_object(1, "car")],
    ]
    image = make_image(np.random.default_rng(5))
    write_dataset(live.folder / "set", samples, ("bus", "car", HOSTILE_NAME), [image])
    write_dataset(live.folder / "set2", [[make_object(1, "car")]], ("car",), [image])
    with live.tab("?open=set") as page:
        page.wait_for_function(LOADED)
        page.click("label:has([data-filter=category])")
        page.click(".q-item:has-text('bus')")
        page.wait_for_selector("[role=status]:has-text('set: 1 of 2 images')")
        assert HOSTILE_NAME in page.inner_text(".gd-table")
        assert page.evaluate("document.querySelector('img[onerror]')") is None
        page.click("label:has-text('compare with')")
        page.click(".q-item:has-text('set2')")
        page.wait_for_selector("[role=status]:has-text('set: 1 of 2 images, set2: 0 of 1 images')")
        page.click("label:has([data-filter=category])")
        page.click(".q-item:has-text('car')")
        page.wait_for_function(f"{LOADED} && document.querySelectorAll('.gd-tile').length === 2")
        header = page.locator(".gd-table th").all_inner_texts()
        assert [name for name in header if "boxes" in name] == [
            "set: boxes per image", "set2: boxes per image"
        ]  # fmt: skip


def test_files_outside_of_the_folders_are_refused(live: Live, page: Page) -> None:
    """In the address, in the text and through a link; user text in messages stays text."""
    (live.folder / "link.yaml").symlink_to("/etc/hostname")
    for asked in ("/etc/hostname", "../secret.yaml", "link.yaml"):
        with live.tab(f"?open={asked}") as other:
            other.wait_for_selector("text=is outside of the folders of this page")
    set_text(page, "extends: /etc/hostname\n")
    page.wait_for_selector(".gd-fault:has-text('is outside of the folders of this page')")
    set_text(page, "extends: link.yaml\n")
    page.wait_for_selector(".gd-fault:has-text('link.yaml'):has-text('outside of the folders')")
    set_text(page, "extends: tabletop.yaml\n'<img src=x onerror=alert(1)>': 1\n")
    page.wait_for_selector(".gd-fault:has-text('<img src=x onerror')")
    assert page.evaluate("document.querySelector('img[onerror]')") is None


def test_a_name_of_an_uploaded_file_has_no_folders(live: Live, page: Page) -> None:
    """Whatever a client sends: nothing is written above the folder of the upload."""
    page.click(".q-tab:has-text('Own files')")
    page.wait_for_selector(".q-uploader")
    status = page.evaluate(
        """async () => {
          const uploader = document.querySelector('.q-uploader').id.slice(1);
          const form = new FormData();
          form.append('file', new Blob(['v 0 0 0']), '../../../escaped.obj');
          const url = getElement(+uploader).$props.url ?? getElement(+uploader).url;
          return (await fetch(url, { method: 'POST', body: form })).status;
        }"""
    )
    assert status == 200
    page.wait_for_selector("[data-file='escaped.obj'] .gd-refused")
    assert not list(Path("/tmp").glob("escaped.obj"))
    assert not (live.folder.parent / "escaped.obj").exists()


def test_routes_have_no_other_files(live: Live, page: Page) -> None:
    """Encoded parents lead to no file; without the token, or with another origin, nothing does."""
    places = (
        "edit/picture/..%2f..%2f..%2fetc%2fhostname",
        "edit/editor.js%2f..%2f..%2fserver.py",
        "edit/..%2fserver.py",
        "_nicegui/..%2f..%2f..%2fetc%2fhostname",
        "_nicegui/3.18.0/static/..%2f..%2fserver.py",
        "_nicegui/3.18.0/components/..%2f..%2fserver.py",
    )
    hostname = Path("/etc/hostname").read_text().strip()
    for place in places:
        reply = page.request.get(live.root + place)
        # An unknown path is answered by the page itself.
        assert reply.status == 404 or "text/html" in reply.headers["content-type"], place
        assert "import asyncio" not in reply.text()
        assert reply.text().strip() != hostname
    assert page.request.get(f"{live.root}edit/editor.js").ok
    origin = {"Origin": "http://evil.example"}
    assert page.request.get(f"{live.root}edit/editor.js", headers=origin).status == 403
    socket = "_nicegui_ws/socket.io/?EIO=4&transport=polling"
    for place in ("", *places, "edit/editor.js", socket):
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(live.root + place)
    body = json.dumps({"tab": "", "text": "", "offset": 0}).encode()
    with pytest.raises(urllib.error.HTTPError, match="403"):
        urllib.request.urlopen(f"{live.root}edit/complete", body)
