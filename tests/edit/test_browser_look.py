"""How the page looks and is reached: narrow windows, contrast, keyboard, no other host."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.edit.live_page import EDITOR, Live, put_cursor

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.slow

CONTRAST = """() => {
  const parse = (text) => {
    const found = text.match(/[\\d.]+/g).map(Number), scale = text.startsWith('color(') ? 255 : 1;
    return [...found.slice(0, 3).map((c) => c * scale), found.length > 3 ? found[3] : 1];
  };
  const over = (top, under) => [0, 1, 2].map((k) => top[k] * top[3] + under[k] * (1 - top[3]));
  const light = (color) => color
    .map((c) => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
    .reduce((sum, c, k) => sum + c * [0.2126, 0.7152, 0.0722][k], 0);
  const behind = (element) => {
    const layers = [];
    for (; element; element = element.parentElement)
      layers.push(parse(getComputedStyle(element).backgroundColor));
    return layers.reverse().reduce((under, top) => over(top, under), [255, 255, 255]);
  };
  const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode.textContent.trim(), element = walker.currentNode.parentElement;
    if (!text || !element.checkVisibility({ opacityProperty: true, visibilityProperty: true })
        || element.closest('[aria-hidden=true], .q-icon, canvas, script, style')) continue;
    const under = behind(element), color = over(parse(getComputedStyle(element).color), under);
    const [low, high] = [light(color), light(under)].sort((a, b) => a - b);
    found.push([(high + 0.05) / (low + 0.05), text.slice(0, 40)]);
  }
  return found;
}"""
"""Contrast of every visible text to its background (WCAG 2.2, relative luminance)."""
PLACES = """() => {
  const element = document.activeElement, style = getComputedStyle(element);
  const name = element.ariaLabel || element.dataset.layer || element.innerText?.trim()
    || element.id || element.tagName;
  const shown = style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2
    || / 2px$| 2px,/.test(style.boxShadow);
  const field = element.closest('.q-field--focused, .q-slider--focus');
  const isPage = element === document.body;
  return [name.split('\\n')[0], Boolean(shown || field || isPage), element.className];
}"""


CONTROLS = frozenset(
    {"button", "checkbox", "combobox", "slider", "spinbutton", "switch", "tab", "textbox"}
)
"""Roles of WAI-ARIA that take input."""


def test_the_page_fits_a_phone_and_a_desk(page: Page) -> None:
    """It does not scroll sideways, and no word is cut off."""
    for width in (400, 1280):
        page.set_viewport_size({"width": width, "height": 860})
        for tab in ("Own files", "Resolved", "Statistics", "Controls"):
            page.click(f".q-tab:has-text('{tab}')")
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            assert (
                page.evaluate(
                    """() => [...document.querySelectorAll('.gd-bar *, .gd-right *')].filter((e) =>
                  e.children.length === 0 && e.innerText?.trim() && e.checkVisibility()
                  && e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0
                  && getComputedStyle(e).overflow === 'hidden').map((e) => e.innerText)"""
                )
                == []
            )


def test_every_control_has_a_name_for_screen_readers(page: Page) -> None:
    """In Chromium's accessibility tree, with the sliders of a field at the cursor."""
    put_cursor(page, "count: ")
    page.wait_for_selector("[role=slider]")
    tree = page.context.new_cdp_session(page).send("Accessibility.getFullAXTree")["nodes"]
    named: dict[str, list[str]] = {}
    for node in tree:
        role = node.get("role", {}).get("value")
        if role in CONTROLS and not node.get("ignored"):
            named.setdefault(role, []).append(node.get("name", {}).get("value", ""))
    assert set(named) >= {"button", "checkbox", "combobox", "slider", "spinbutton", "tab"}
    assert [role for role, names in named.items() if not all(names)] == []


def test_every_text_has_the_contrast_of_wcag_aa(page: Page) -> None:
    """At least 4.5 to 1, in light and in dark, with chips that are chosen and others."""
    page.click("label:has([aria-label=Item])")
    page.click(".q-item:has-text('orbit')")
    page.wait_for_selector(".q-chip:has-text('view')")
    page.add_style_tag(content="* { transition: none !important }")
    page.click("button[aria-label='Dark or light']")
    page.wait_for_selector("body.body--dark")
    dark = page.evaluate(CONTRAST)
    page.click("button[aria-label='Dark or light']")
    page.wait_for_selector("body.body--light")
    light = page.evaluate(CONTRAST)
    assert min(len(dark), len(light)) > 60
    assert [one for one in (*dark, *light) if one[0] < 4.5] == []


def test_everything_is_reached_by_the_keyboard(page: Page) -> None:
    """In the order of reading, each with a visible focus; Escape and Tab leave the editor."""
    page.evaluate("document.activeElement.blur()")
    page.evaluate(f"async () => (await {EDITOR}.editorPromise).focus()")
    page.keyboard.press("Escape")
    page.keyboard.press("Tab")
    reached = []
    for _ in range(40):
        reached.append(page.evaluate(PLACES))
        page.keyboard.press("Tab")
    names = [name for name, _, _ in reached]
    expected = ["picture", "boxes", "masks", "keypoints", "boxes3d", "pictures", "each a", "from"]
    expected += [f"Picture {k}" for k in (1, 2, 3, 4)]
    assert [name for name in names if name in expected][: len(expected)] == expected
    assert [one for one in reached if not one[1]] == []


def test_no_request_leaves_the_machine(live: Live, page: Page) -> None:
    """Every request is to its own server, without a message of the browser."""
    page.reload()
    live.show_four()
    opened = live.opened
    hosts = {url.split("/")[2].partition(":")[0] for url in opened.requests if url[:4] == "http"}
    assert hosts == {"127.0.0.1"}
    known = ("outbox rewind failed", "403 (Forbidden)", "404 (Not Found)")
    assert [one for one in opened.messages if not any(k in one for k in known)] == []
