"""Views through panes: rooms with curtains, blinds, lamps and plants; offices; shop displays.

A texture is an atlas of square cells, one per pane. By day a room is far darker than its window's
surroundings: light reaches only objects close to the pane. The glass over it is the material's
specular layer.

Emission shows the same rooms with their lamps on: some panes are dark, and lit ones differ in
brightness and colour.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.family import check_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural.textures.texture_images import color, quantize
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import fbm
from gen_data.core.variant_rng import VariantRng, variant_rng

CELLS = {"home": 4, "office": 4, "shop": 3, "hall": 1}
"""Cells along each side of an atlas."""
_ATLAS_PX = 512
_LIT = {"home": 0.4, "office": 0.3, "shop": 0.75, "hall": 0.25}
"""Shares of panes with light behind them in the evening (assumed)."""
_COLORS = load_table(__package__, "window_views", tuple[str, ...])


def window_view(seed: int, kind: str) -> TextureData:
    """An atlas of views into rooms of a ``kind`` of ``CELLS``. Raises AssetError for others."""
    check_option("window_view", "kind", kind, CELLS)
    rng = variant_rng(f"window_view/{kind}", seed)
    count = CELLS[kind]
    draw = {"home": _home, "office": _office, "shop": _shop, "hall": _hall}[kind]
    edges = [_ATLAS_PX * k // count for k in range(count + 1)]
    sheet = np.zeros((_ATLAS_PX, _ATLAS_PX, 3), dtype=np.float32)
    lamps, lit = variant_rng(f"window_view/{kind}/lamps", seed), np.zeros_like(sheet)
    haze = 1.0 + 0.05 * fbm((6, 6), 4, rng)
    for row in range(count):
        for column in range(count):
            place = np.s_[edges[row] : edges[row + 1], edges[column] : edges[column + 1]]
            draw(View(sheet[place]), rng)
            if lamps.chance(_LIT[kind]):
                lit[place] = _by_lamplight(sheet[place], kind, lamps)
    return TextureData(quantize(sheet * haze[..., None]), emission=quantize(lit))


def _by_lamplight(view: Float32, kind: str, rng: VariantRng) -> Float32:
    """A view as it shines at night, 1 at its bright parts: brightest below the ceiling's lamp."""
    tint = color(rng.choose(_COLORS[f"lamps_{kind}"]))
    y = np.linspace(1.0, 0.55, len(view))[:, None, None]
    bright = float(np.quantile(view, 0.9))
    level = rng.between(0.2, 1.0) ** 1.5
    lit: Float32 = np.clip(level * y * tint * view / bright, 0.0, 1.0).astype(np.float32)
    return lit


class View:
    """One cell, painted over from back to front; places are fractions, (0, 0) at the top left."""

    def __init__(self, pixels: Float32) -> None:
        self.pixels = pixels
        n, m = pixels.shape[:2]
        self.y = ((np.arange(n) + 0.5) / n).astype(np.float32)[:, None]
        self.x = ((np.arange(m) + 0.5) / m).astype(np.float32)[None, :]

    def paint(self, cover: Float32, paint: Float32 | float, share: float = 1.0) -> None:
        """Mix a colour, or an image of colours, where ``cover`` is 1."""
        covered = cover > 0.0
        rows, columns = (_extent(np.any(covered, axis=axis)) for axis in (1, 0))
        weight = (np.clip(cover[rows, columns], 0.0, 1.0) * share)[..., None]
        window = self.pixels[rows, columns]
        if isinstance(paint, np.ndarray) and paint.ndim == 3:
            paint = np.broadcast_to(paint, self.pixels.shape)[rows, columns]
        window[:] = window * (1.0 - weight) + weight * paint

    def box(self, x0: float, y0: float, x1: float, y1: float) -> Float32:
        """Cover of a rectangle."""
        inside = ((self.x >= x0) & (self.x < x1)) & ((self.y >= y0) & (self.y < y1))
        cover: Float32 = inside.astype(np.float32)
        return cover

    def disc(self, x: float, y: float, rx: float, ry: float) -> Float32:
        """Cover of an ellipse with a soft rim."""
        cover: Float32 = np.zeros(self.pixels.shape[:2], np.float32)
        rows, columns = _extent(np.abs(self.y - y) < ry), _extent(np.abs(self.x - x) < rx)
        away = ((self.x[:, columns] - x) / rx) ** 2 + ((self.y[rows] - y) / ry) ** 2
        cover[rows, columns] = np.clip((1.0 - away) * 3.0, 0.0, 1.0)
        return cover

    def glow(self, x: float, y: float, radius: float, level: float, tint: Float32) -> None:
        """Add light around a lamp."""
        away = ((self.x - x) ** 2 + (self.y - y) ** 2) / radius**2
        self.pixels += (level * np.exp(-away))[..., None] * tint


def _extent(covered: NDArray[np.bool_]) -> slice:
    """From the first to the last true value; empty if there is none."""
    places = np.flatnonzero(covered)
    return slice(places[0], places[-1] + 1) if len(places) else slice(0, 0)


def _room(view: View, rng: VariantRng, level: float) -> None:
    """Ceiling, floor and three walls of a room, with furniture against the back wall."""
    tint = color(rng.choose(_COLORS["rooms"]))
    x0, x1 = rng.between(0.1, 0.3), rng.between(0.7, 0.9)
    y0, y1 = rng.between(0.15, 0.3), rng.between(0.66, 0.8)
    view.pixels[:] = level * 0.8 * tint
    view.paint(view.box(0.0, 0.0, 1.0, y0), 1.25 * level * tint)
    view.paint(view.box(0.0, y1, 1.0, 1.0), 0.55 * level * tint)
    view.paint(view.box(x0, y0, x1, y1), level * tint)
    for _ in range(rng.choose((1, 2, 3))):
        a = rng.between(x0, x1 - 0.1)
        top, wide = rng.between(y0 + 0.05, y1 - 0.1), rng.between(0.08, 0.3)
        shade = rng.between(0.3, 1.6) * level
        view.paint(view.box(a, top, a + wide, y1), shade * color(rng.choose(_COLORS["things"])))
    if rng.chance(0.4):
        a, top = rng.between(x0, x1 - 0.15), y0 + rng.between(0.03, 0.12)
        frame = view.box(a, top, a + rng.between(0.08, 0.16), top + 0.12)
        view.paint(frame, 1.7 * level * color(rng.choose(_COLORS["things"])))
    if rng.chance(0.3):
        a, top = rng.between(0.3, 0.7), rng.between(0.12, 0.35)
        warm = np.array([1.0, 0.8, 0.5], dtype=np.float32)
        view.paint(view.disc(a, top, 0.05, 0.045), np.minimum(1.0, 1.3 * warm))
        view.glow(a, top, 0.25, 0.22, warm)


def _home(view: View, rng: VariantRng) -> None:
    """A room of a flat; something on the sill, something before the pane."""
    _room(view, rng, rng.between(0.16, 0.34))
    if rng.chance(0.35):
        _sill_plants(view, rng)
    dress: Callable[[View, VariantRng], None] = rng.choose(
        (_open, _side_curtains, _side_curtains, _net, _net, _blind, _slats, _drapes, _half_net)
    )
    dress(view, rng)


def _open(view: View, rng: VariantRng) -> None:
    """Nothing hangs before the room, which is darker still."""
    view.pixels[:] *= rng.between(0.6, 1.0)


def _folds(view: View, rng: VariantRng) -> Float32:
    """Brightness of hanging cloth, about 1."""
    count, phase = rng.between(6.0, 16.0), rng.between(0.0, 6.0)
    bend = phase + 0.8 * np.sin(6.0 * view.x + phase)
    wave: Float32 = 0.84 + 0.13 * np.sin(6.28 * count * view.x + bend) + 0.0 * view.y
    return wave


def _side_curtains(view: View, rng: VariantRng) -> None:
    cloth = color(rng.choose(_COLORS["cloth"])) * rng.between(0.5, 0.8)
    left, right = rng.between(0.1, 0.3), rng.between(0.1, 0.3)
    taper = 0.06 * np.sin(3.1 * view.y)
    cover = ((view.x < left - taper) | (view.x > 1.0 - right + taper)).astype(np.float32)
    view.paint(cover, _folds(view, rng)[..., None] * cloth)
    if rng.chance(0.4):
        view.paint(view.box(0.0, 0.0, 1.0, 0.12), 0.8 * cloth)


def _net(view: View, rng: VariantRng) -> None:
    """Net curtains over all of the pane; the room shows through dimly."""
    white = color(rng.choose(_COLORS["nets"])) * rng.between(0.6, 0.9)
    cover = np.ones_like(view.x + view.y)
    if rng.chance(0.5):
        gap, wide = rng.between(0.3, 0.7), rng.between(0.05, 0.16)
        cover = (np.abs(view.x - gap) > wide * view.y**2).astype(np.float32) + 0.0 * view.y
    view.paint(cover, _folds(view, rng)[..., None] * white, rng.between(0.6, 0.9))


def _half_net(view: View, rng: VariantRng) -> None:
    """A short curtain across the lower half."""
    white = color(rng.choose(_COLORS["nets"])) * rng.between(0.6, 0.9)
    top = rng.between(0.4, 0.6)
    view.paint(view.box(0.0, top, 1.0, 1.0), _folds(view, rng)[..., None] * white, 0.85)


def _blind(view: View, rng: VariantRng) -> None:
    cloth = color(rng.choose(_COLORS["cloth"])) * rng.between(0.55, 0.8)
    foot = rng.between(0.15, 0.9)
    view.paint(view.box(0.0, 0.0, 1.0, foot), cloth * (1.0 - 0.15 * view.y)[..., None])
    view.paint(view.box(0.0, foot - 0.02, 1.0, foot), 0.6 * cloth)


def _slats(view: View, rng: VariantRng) -> None:
    white = color(rng.choose(_COLORS["nets"])) * rng.between(0.5, 0.75)
    foot, count = rng.choose((0.4, 0.7, 1.0)), rng.between(14.0, 22.0)
    lit = 0.6 + 0.4 * np.sin(6.28 * count * view.y)
    shape = view.box(0.0, 0.0, 1.0, foot) * np.where(lit > rng.between(0.2, 0.5), 1.0, 0.35)
    view.paint(shape.astype(np.float32), (0.75 + 0.25 * lit)[..., None] * white)


def _drapes(view: View, rng: VariantRng) -> None:
    cloth = color(rng.choose(_COLORS["cloth"])) * rng.between(0.45, 0.75)
    seam = np.where(np.abs(view.x - rng.between(0.4, 0.6)) < 0.012, 0.5, 1.0) + 0.0 * view.y
    view.pixels[:] = (_folds(view, rng) * seam)[..., None] * cloth


def _sill_plants(view: View, rng: VariantRng) -> None:
    for _ in range(rng.choose((1, 2, 3))):
        x, high = rng.between(0.12, 0.88), rng.between(0.12, 0.32)
        green = color(rng.choose(_COLORS["greens"]))
        for _ in range(9):
            a, b = x + rng.between(-0.09, 0.09), 0.9 - high * rng.between(0.1, 1.0)
            shade = rng.between(0.5, 1.1)
            view.paint(view.disc(a, b, rng.between(0.015, 0.05), 0.05), shade * green)
        pot = color(rng.choose(_COLORS["pots"])) * 0.7
        view.paint(view.box(x - 0.045, 0.88, x + 0.045, 1.0), pot)


def _office(view: View, rng: VariantRng) -> None:
    """A ceiling with lines of lamps, desks, screens; blinds at some heights."""
    level = rng.between(0.2, 0.36)
    tint = color(rng.choose(_COLORS["offices"]))
    view.pixels[:] = level * (1.15 - 0.6 * view.y + 0.0 * view.x)[..., None] * tint
    lit = rng.chance(0.6)
    for k in range(4):
        y = 0.05 + 0.09 * k
        inset = 0.1 + 0.09 * k
        lamp = view.box(inset, y, 1.0 - inset, y + 0.025)
        view.paint(lamp, (2.6 if lit else 1.2) * level * tint)
    for _ in range(rng.choose((1, 2, 3))):
        x = rng.between(0.0, 0.8)
        shade = rng.between(0.3, 1.5) * level
        thing = color(rng.choose(_COLORS["things"]))
        view.paint(
            view.box(x, rng.between(0.5, 0.7), x + rng.between(0.1, 0.3), 1.0), shade * thing
        )
    if rng.chance(0.4):
        view.paint(view.box(0.0, 0.74, 1.0, 0.78), 1.4 * level * tint)
        x = rng.between(0.1, 0.7)
        view.paint(view.box(x, 0.6, x + 0.17, 0.73), 0.3 * level * tint)
    if rng.chance(0.45):
        rng.choose((_blind, _slats, _slats))(view, rng)


def _hall(view: View, rng: VariantRng) -> None:
    """A stairwell behind a glazed door, darker towards its floor."""
    level = rng.between(0.03, 0.07)
    view.pixels[:] = level * (1.3 - 0.6 * view.y + 0.0 * view.x)[..., None]
    view.pixels[:] *= color(rng.choose(_COLORS["rooms"]))


def _shop(view: View, rng: VariantRng) -> None:
    """A lit sales room behind goods close to the pane."""
    _room(view, rng, rng.between(0.28, 0.5))
    for _ in range(rng.choose((2, 4, 6))):
        view.glow(rng.between(0.1, 0.9), rng.between(0.05, 0.2), 0.1, 0.5, color("#fff0d8"))
    show: Callable[[View, VariantRng], None] = rng.choose(
        (_shelves, _shelves, _figures, _figures, _posters, _tables, _flowers, _covered)
    )
    show(view, rng)


def _shelves(view: View, rng: VariantRng) -> None:
    rows, tall = rng.choose((3, 4, 5)), rng.between(0.5, 0.9)
    colors = [color(rng.choose(_COLORS["goods"])) for _ in range(4)]
    for row in range(rows):
        foot = 1.0 - tall * row / rows - 0.03
        view.paint(view.box(0.02, foot, 0.98, foot + 0.025), 0.6)
        x = 0.04
        while x < 0.94:
            wide, high = rng.between(0.015, 0.07), rng.between(0.35, 0.8) * tall / rows
            shade = rng.between(0.55, 0.95)
            view.paint(view.box(x, foot - high, x + wide, foot), shade * rng.choose(colors))
            x += wide + rng.between(0.004, 0.03)


def _figures(view: View, rng: VariantRng) -> None:
    """Two or three mannequins."""
    count = rng.choose((2, 3))
    view.paint(view.box(0.0, 0.92, 1.0, 1.0), 0.7)
    for k in range(count):
        x = (k + rng.between(0.35, 0.65)) / count
        top, skin = rng.between(0.16, 0.24), color(rng.choose(_COLORS["figures"]))
        upper, lower = (color(rng.choose(_COLORS["goods"])) * 0.85 for _ in range(2))
        view.paint(view.disc(x, top, 0.035, 0.055), skin)
        for side in (-1.0, 1.0):
            view.paint(view.disc(x + 0.09 * side, top + 0.27, 0.025, 0.2), 0.85 * upper)
            view.paint(view.disc(x + 0.035 * side, top + 0.56, 0.045, 0.28), lower)
        view.paint(view.disc(x, top + 0.23, 0.09, 0.2), upper)


def _posters(view: View, rng: VariantRng) -> None:
    for _ in range(rng.choose((2, 3, 4))):
        x, y = rng.between(0.05, 0.7), rng.between(0.15, 0.6)
        wide, high = rng.between(0.15, 0.3), rng.between(0.15, 0.35)
        paper, ink = (color(rng.choose(_COLORS["goods"])) for _ in range(2))
        view.paint(view.box(x, y, x + wide, y + high), paper)
        view.paint(view.box(x + 0.02, y + 0.03, x + wide - 0.02, y + 0.4 * high), ink)
        view.paint(
            view.box(x + 0.03, y + 0.6 * high, x + wide - 0.04, y + 0.68 * high), 0.4 * paper
        )


def _tables(view: View, rng: VariantRng) -> None:
    """A cafe: lamps that hang over tables and chairs."""
    warm = color("#ffd9a0")
    for k in range(3):
        x = 0.2 + 0.3 * k + rng.between(-0.05, 0.05)
        view.paint(view.box(x - 0.003, 0.0, x + 0.003, 0.24), 0.05)
        view.paint(view.disc(x, 0.26, 0.06, 0.04), 0.95 * warm)
        view.glow(x, 0.3, 0.16, 0.25, warm)
        wood = color(rng.choose(_COLORS["rooms"])) * 0.6
        view.paint(view.box(x - 0.11, 0.68, x + 0.11, 0.71), wood)
        view.paint(view.box(x - 0.012, 0.7, x + 0.012, 0.95), 0.5 * wood)
        for side in (-1.0, 1.0):
            seat = x + 0.15 * side
            view.paint(view.box(seat - 0.025, 0.58, seat + 0.025, 0.95), 0.4 * wood)


def _flowers(view: View, rng: VariantRng) -> None:
    for row in range(3):
        foot = 0.6 + 0.18 * row
        for k in range(7):
            x = (k + rng.between(0.3, 0.7)) / 7
            for _ in range(6):
                paint = color(rng.choose(_COLORS["greens" if rng.chance(0.5) else "petals"]))
                a, b = x + rng.between(-0.05, 0.05), foot - rng.between(0.02, 0.18)
                view.paint(view.disc(a, b, 0.03, 0.03), rng.between(0.6, 1.0) * paint)
            view.paint(view.box(x - 0.04, foot, x + 0.04, foot + 0.11), 0.35)


def _covered(view: View, rng: VariantRng) -> None:
    """Empty premises: the pane is papered or whitewashed."""
    paper = color(rng.choose(_COLORS["papers"])) * 0.75
    top = rng.choose((0.0, 0.0, 0.3))
    sheets = 0.92 + 0.08 * np.sign(np.sin(6.28 * 2.3 * view.x) * np.sin(6.28 * 1.6 * view.y))
    view.paint(view.box(0.0, top, 1.0, 1.0), sheets[..., None] * paper)
