"""Printed matter: labels, folding boxes and book covers with invented names.

These belong to one object and follow its UVs. Drawn at the proportions of the object and then
squeezed into the image, so that letters look right on the object.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from generator.assets.procedural import containers
from generator.assets.procedural.draw import between, chance, pick, rng_of
from generator.assets.procedural.materials import srgb
from generator.assets.procedural.shapes import UvRect
from generator.core.geometry import TextureData
from generator.core.streams import Rng

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

_SIZE_PX = 512

Color = tuple[int, int, int]
Place = tuple[float, float]
# Left, top, right, bottom as fractions of an image, y down.
Box = tuple[float, float, float, float]

# Ground, second colour, accent, ink.
_SCHEMES = (
    ("#f6f2e7", "#c8202f", "#f2b705", "#2a1a14"),
    ("#12355b", "#f2f2ee", "#e94f37", "#f2f2ee"),
    ("#1f7a4d", "#f3f0df", "#f2c14e", "#f3f0df"),
    ("#f4d35e", "#d1495b", "#2e4057", "#2e2420"),
    ("#ffffff", "#0f6fb8", "#7ac143", "#12324a"),
    ("#c1121f", "#fdf0d5", "#f2b705", "#fdf0d5"),
    ("#3d2a5c", "#e7c6ff", "#f7b801", "#ffffff"),
    ("#f7ede2", "#84a59d", "#f28482", "#3a3a3a"),
    ("#111417", "#c9a24b", "#8d1b24", "#f0e9d8"),
    ("#e76f51", "#264653", "#f4e3b2", "#fff6e0"),
    ("#9fd3e6", "#ffffff", "#e63946", "#1d3557"),
    ("#f2a6c0", "#ffffff", "#7a1f4b", "#5a1236"),
    ("#5c3a21", "#e8c99b", "#d98e04", "#fff1d6"),
    ("#0b8f8c", "#ffffff", "#ffd23f", "#ffffff"),
    ("#ff8c1a", "#ffffff", "#3a2a8c", "#2b1a10"),
    ("#dfe5e8", "#4a5a66", "#d62828", "#1f2a30"),
)
_STARTS = (
    "Sol",
    "Ver",
    "Kin",
    "Bra",
    "Lun",
    "Mar",
    "Tol",
    "Fen",
    "Ori",
    "Zan",
    "Pel",
    "Gra",
    "Nor",
    "Cas",
    "Dul",
    "Ha",
    "Riv",
    "Ost",
    "Quil",
    "Tam",
)
_ENDS = (
    "ara",
    "ello",
    "ix",
    "on",
    "ita",
    "berg",
    "ova",
    "ette",
    "um",
    "ino",
    "ay",
    "eva",
    "or",
    "ula",
    "ano",
    "is",
    "enda",
    "ik",
    "ora",
    "ey",
)
_PRODUCTS = (
    "CRISPY FLAKES",
    "GREEN TEA",
    "TOMATO SOUP",
    "SEA SALT",
    "ORANGE & LIME",
    "DARK ROAST",
    "WHOLE OATS",
    "RED BEANS",
    "FRESH CITRUS",
    "CLASSIC COLA",
    "PEACH ICED TEA",
    "BASIL PESTO",
    "CORN & PEAS",
    "WILD BERRY",
    "COCOA CRUNCH",
    "SPARKLING",
    "HONEY NUT",
    "SOFT CARE",
    "MOUNTAIN",
    "GINGER ALE",
)
_NOTES = (
    "new recipe",
    "no added sugar",
    "since 1926",
    "100% natural",
    "family size",
    "extra fresh",
    "original",
    "with real fruit",
    "crunchy!",
    "light",
)
_VOLUMES = ("330 ml", "500 ml", "750 ml", "1 L")
_WEIGHTS = ("250 g", "375 g", "400 g", "500 g")
_TITLES = (
    "THE LONG",
    "A QUIET",
    "WINTER",
    "THE LAST",
    "BEYOND THE",
    "NORTH OF",
    "THE PAPER",
    "SEVEN",
    "NIGHT",
    "THE GLASS",
)
_SUBJECTS = (
    "HARBOUR",
    "GARDEN",
    "RIVER",
    "MACHINE",
    "LETTERS",
    "ISLAND",
    "ORCHARD",
    "SIGNAL",
    "HOUSE",
    "MEADOW",
)


@dataclass(frozen=True, slots=True)
class _Design:
    """What all faces of one product share."""

    ground: Color
    second: Color
    accent: Color
    ink: Color
    brand: str
    product: str
    note: str
    size: str
    layout: int
    picture: int
    bold: int


def label(seed: int) -> TextureData:
    """Wrap-around label of a bottle or jar; the front is in the middle. 512 x 256."""
    rng = rng_of("label", seed)
    image = _wrap(
        int(_SIZE_PX * 1.5),
        containers.label_aspect("label", seed),
        _design(seed, rng, _VOLUMES),
        rng,
    )
    return _squeezed(image, _SIZE_PX, _SIZE_PX // 2)


def can_label(seed: int) -> TextureData:
    """All around a can; the front is in the middle."""
    rng = rng_of("can_label", seed)
    sizes = _WEIGHTS if containers.can_size(seed).food else ("330 ml", "500 ml")
    image = _wrap(
        int(_SIZE_PX * 1.5), containers.label_aspect("can", seed), _design(seed, rng, sizes), rng
    )
    return _squeezed(image, _SIZE_PX, _SIZE_PX)


def carton(seed: int) -> TextureData:
    """The six faces of a folding box, laid out by ``containers.CARTON_ATLAS``."""
    return _box_print("carton", seed, containers.carton_size_m(seed))


def milk_label(seed: int) -> TextureData:
    """The faces of a milk carton, laid out by ``containers.CARTON_ATLAS``."""
    return _box_print("milk_label", seed, containers.milk_size_m(seed))


def book_cover(seed: int) -> TextureData:
    """Back, spine and front of a book, laid out by ``books.COVER_ATLAS``."""
    from generator.assets.procedural import books

    rng = rng_of("book_cover", seed)
    design = _design(seed, rng)
    length, width, thickness = books.book_size_m(seed)
    scale = 560.0 / length
    h = int(length * scale)
    faces = {
        "front": _front_cover(int(width * scale), h, design, rng),
        "spine": _spine(max(24, int(thickness * scale)), h, design),
        "back": _back_cover(int(width * scale), h, design, rng),
    }
    return _atlas(faces, books.COVER_ATLAS, design.ground)


def _design(seed: int, rng: Rng, sizes: Sequence[str] = _WEIGHTS) -> _Design:
    ground, second, accent, ink = (srgb(code) for code in _SCHEMES[seed % len(_SCHEMES)])
    if chance(0.3, rng):
        second, accent = accent, second
    name = pick(_STARTS, rng) + pick(_ENDS, rng)
    return _Design(
        ground,
        second,
        accent,
        ink,
        brand=name.upper() if chance(0.5, rng) else name,
        product=pick(_PRODUCTS, rng),
        note=pick(_NOTES, rng),
        size=pick(sizes, rng),
        layout=int(between(0, 5, rng)),
        picture=int(between(0, 5, rng)),
        bold=int(between(1, 5, rng)),
    )


def _box_print(name: str, seed: int, size_m: tuple[float, float, float]) -> TextureData:
    rng = rng_of(name, seed)
    design = _design(seed, rng)
    depth, width, height = size_m
    scale = 460.0 / max(size_m)
    w, d, h = (max(24, int(side * scale)) for side in (width, depth, height))
    faces = {
        "front": _front(w, h, design, rng),
        "back": _front(w, h, design, rng_of(f"{name}/back", seed)),
        "left": _info(d, h, design, rng),
        "right": _side(d, h, design, rng),
        "top": _canvas(w, d, design.second) if name == "milk_label" else _strip(w, d, design),
        "bottom": _strip(w, d, design),
    }
    return _atlas(faces, containers.CARTON_ATLAS, design.ground)


def _wrap(width: int, aspect: float, design: _Design, rng: Rng) -> Image:
    """Front in the middle, information half on each end; the ends meet in the plain ground."""
    height = max(48, int(width / aspect))
    canvas = _canvas(width, height, design.ground)
    front = _front(width // 2, height, design, rng)
    canvas.paste(front, (width // 4, 0))
    info = _info(int(0.2 * width), height, design, rng)
    canvas.paste(info, (int(0.78 * width), 0))
    canvas.paste(_side(int(0.2 * width), height, design, rng), (int(0.02 * width), 0))
    _bands(canvas, design)
    return canvas


def _front(w: int, h: int, design: _Design, rng: Rng) -> Image:
    """The face that sells: ground, picture, brand, product, note, size."""
    image = _canvas(w, h, design.ground)
    _ground(image, design, rng)
    tall = h > 0.8 * w
    brand = (0.1, 0.06, 0.9, 0.24) if tall else (0.05, 0.08, 0.62, 0.42)
    product = (0.12, 0.345, 0.88, 0.42) if tall else (0.05, 0.5, 0.6, 0.66)
    picture = (0.2, 0.46, 0.8, 0.88) if tall else (0.64, 0.12, 0.97, 0.88)
    _picture(image, picture, design, rng)
    on_ground = design.layout in (0, 3)
    if design.layout in (1, 4):
        _panel(image, brand, design.second)
    _text(
        image,
        brand,
        design.brand,
        design.ink if on_ground else _readable(design, design.second),
        design.bold,
    )
    _text(image, product, design.product, design.ink, 1)
    note = (0.05, 0.9, 0.5, 0.97) if tall else (0.05, 0.76, 0.4, 0.88)
    size = (0.68, 0.91, 0.95, 0.97) if tall else (0.44, 0.78, 0.6, 0.88)
    _text(image, note, design.note, design.ink, 0)
    _text(image, size, design.size, design.ink, 1)
    if tall and chance(0.5, rng):
        _burst(image, (0.85, 0.5), 0.11 * w, design)
    return image


def _ground(image: Image, design: _Design, rng: Rng) -> None:
    """Gradient, split, wave, diagonal or plain."""
    w, h = image.size
    draw = _pen(image)
    if design.layout == 0:
        _gradient(image, design.ground, _blend(design.ground, design.second, 0.45))
    elif design.layout == 1:
        draw.rectangle([0, 0, w, int(0.31 * h)], fill=design.second)
    elif design.layout == 2:
        bend, phase = between(0.01, 0.035, rng), between(0.0, 6.0, rng)
        edge = [(x, h * (0.27 + bend * math.sin(phase + 5.0 * x / w))) for x in range(0, w + 8, 4)]
        draw.polygon([(0, 0), (w + 8, 0), *edge[::-1]], fill=design.second)
        draw.line([(x, y + 0.015 * h) for x, y in edge], fill=design.accent, width=max(2, h // 60))
    elif design.layout == 3:
        draw.polygon([(0, h), (w, 0.62 * h), (w, h)], fill=design.accent)
        draw.polygon([(0, h), (w, 0.72 * h), (w, h)], fill=design.second)
    else:
        draw.ellipse([-0.35 * w, -0.35 * h, 1.35 * w, 0.33 * h], fill=design.second)


def _picture(image: Image, box: Box, design: _Design, rng: Rng) -> None:
    """A simple picture of what is inside: bowl, fruit, leaves, sun over hills, or rings."""
    draw = _pen(image)
    x0, y0, x1, y1 = _pixels(image, box)
    cx, cy, r = (x0 + x1) // 2, (y0 + y1) // 2, min(x1 - x0, y1 - y0) // 2
    if design.picture == 0:
        draw.ellipse(
            [cx - r, cy - 0.35 * r, cx + r, cy + 0.25 * r],
            fill=_blend(design.accent, (255, 255, 255), 0.5),
        )
        for _ in range(26):
            turn, reach = between(0, 2 * math.pi, rng), between(0, 0.8, rng) * r
            px, py, s = (
                cx + reach * math.cos(turn),
                cy - 0.1 * r + 0.28 * reach * math.sin(turn),
                0.13 * r,
            )
            shade = _blend((214, 150, 60), (120, 60, 20), between(0.0, 0.7, rng))
            draw.ellipse([px - s, py - 0.7 * s, px + s, py + 0.7 * s], fill=shade)
        draw.pieslice([cx - r, cy - 0.95 * r, cx + r, cy + 0.95 * r], 2, 178, fill=design.accent)
    elif design.picture == 1:
        for dx, dy in ((-0.42, 0.2), (0.4, 0.25), (0.0, -0.25)):
            _fruit(draw, cx + dx * r, cy + dy * r, 0.5 * r, pick(_FRUIT, rng))
    elif design.picture == 2:
        for i in range(7):
            turn = math.pi * (i / 6 + 1)
            tip = cx + r * math.cos(turn), cy + 0.5 * r + r * math.sin(turn)
            _leaf(
                draw,
                (cx, cy + 0.5 * r),
                tip,
                _blend((60, 130, 60), (20, 80, 40), between(0, 1, rng)),
            )
    elif design.picture == 3:
        draw.ellipse([cx - 0.5 * r, cy - 0.9 * r, cx + 0.5 * r, cy + 0.1 * r], fill=design.accent)
        for i, shade in enumerate((0.2, 0.5, 0.8)):
            top = cy + (0.0 + 0.3 * i) * r
            hills = [
                (x, top + 0.14 * r * math.sin(3.0 * x / r + 2 * i)) for x in range(x0, x1 + 1, 3)
            ]
            draw.polygon(
                [(x0, y1), *hills, (x1, y1)], fill=_blend((150, 190, 90), (30, 90, 60), shade)
            )
    else:
        for i in range(5, 0, -1):
            s = r * i / 5
            draw.ellipse(
                [cx - s, cy - s, cx + s, cy + s], fill=design.accent if i % 2 else design.second
            )


_FRUIT = ((200, 40, 40), (240, 150, 30), (120, 40, 110), (235, 200, 50), (110, 160, 50))


def _info(w: int, h: int, design: _Design, rng: Rng) -> Image:
    """Small print, a table of nutrition and a bar code."""
    image = _canvas(w, h, _blend(design.ground, (255, 255, 255), 0.25))
    paper = _blend(design.ground, (255, 255, 255), 0.25)
    ink = (25, 25, 28) if sum(paper) > 330 else (240, 240, 240)
    _text(image, (0.08, 0.03, 0.92, 0.11), design.brand, ink, 1)
    _lines(image, (0.08, 0.14, 0.92, 0.32), ink, rng)
    _table(image, (0.08, 0.36, 0.92, 0.66), ink, rng)
    _barcode(image, (0.1, 0.72, 0.9, 0.95), rng)
    return image


def _side(w: int, h: int, design: _Design, rng: Rng) -> Image:
    """Brand upright along the side, some small print below."""
    image = _canvas(w, h, design.second)
    ink = _readable(design, design.second)
    turned = _canvas(int(0.62 * h), max(8, int(0.7 * w)), design.second)
    _text(turned, (0.0, 0.1, 1.0, 0.9), design.brand, ink, design.bold)
    image.paste(turned.rotate(90, expand=True), (int(0.15 * w), int(0.04 * h)))
    _lines(image, (0.1, 0.72, 0.9, 0.95), ink, rng)
    return image


def _strip(w: int, h: int, design: _Design) -> Image:
    image = _canvas(w, h, design.second)
    _text(image, (0.1, 0.2, 0.9, 0.8), design.brand, _readable(design, design.second), design.bold)
    return image


def _front_cover(w: int, h: int, design: _Design, rng: Rng) -> Image:
    image = _canvas(w, h, design.ground)
    _ground(image, design, rng)
    _picture(image, (0.12, 0.4, 0.88, 0.82), design, rng)
    _panel(image, (0.06, 0.07, 0.94, 0.35), design.ground)
    _text(image, (0.1, 0.09, 0.9, 0.2), pick(_TITLES, rng), design.ink, 2)
    _text(image, (0.1, 0.22, 0.9, 0.34), pick(_SUBJECTS, rng), design.ink, 3)
    _panel(image, (0.0, 0.87, 1.0, 0.97), design.second)
    _text(
        image,
        (0.2, 0.895, 0.8, 0.945),
        f"{design.brand} {pick(_ENDS, rng).title()}",
        _readable(design, design.second),
        1,
    )
    return image


def _spine(w: int, h: int, design: _Design) -> Image:
    """Title along the spine, read from the top down."""
    strip = _canvas(h, w, design.second)
    ink = _readable(design, design.second)
    _text(strip, (0.06, 0.2, 0.6, 0.8), design.product, ink, 1)
    _text(strip, (0.68, 0.25, 0.94, 0.75), design.brand, ink, 1)
    return strip.rotate(-90, expand=True)


def _back_cover(w: int, h: int, design: _Design, rng: Rng) -> Image:
    image = _canvas(w, h, design.ground)
    _text(image, (0.1, 0.08, 0.9, 0.15), f"“{design.note.capitalize()}”", design.ink, 1)
    _lines(image, (0.1, 0.2, 0.9, 0.62), design.ink, rng)
    _barcode(image, (0.52, 0.8, 0.92, 0.94), rng)
    return image


def _bands(image: Image, design: _Design) -> None:
    """Lines along both edges, all around."""
    w, h = image.size
    draw = _pen(image)
    t = max(2, h // 40)
    for y in (0, h - t):
        draw.rectangle([0, y, w, y + t], fill=design.accent)


def _panel(image: Image, box: Box, fill: Color) -> None:
    x0, y0, x1, y1 = _pixels(image, box)
    _pen(image).rounded_rectangle([x0, y0, x1, y1], radius=max(1, (y1 - y0) // 6), fill=fill)


def _burst(image: Image, centre: tuple[float, float], radius: float, design: _Design) -> None:
    """A star with a word in it."""
    cx, cy = centre[0] * image.width, centre[1] * image.height
    points = [
        (
            cx + radius * (1.0 if i % 2 else 0.8) * math.cos(math.pi * i / 12),
            cy + radius * (1.0 if i % 2 else 0.8) * math.sin(math.pi * i / 12),
        )
        for i in range(24)
    ]
    _pen(image).polygon(points, fill=design.accent)
    w, h = image.size
    _text(
        image,
        (
            (cx - 0.6 * radius) / w,
            (cy - 0.3 * radius) / h,
            (cx + 0.6 * radius) / w,
            (cy + 0.3 * radius) / h,
        ),
        "NEW",
        design.ground,
        2,
    )


def _lines(image: Image, box: Box, ink: Color, rng: Rng) -> None:
    """Text too small to read: words as dashes."""
    draw = _pen(image)
    x0, y0, x1, y1 = _pixels(image, box)
    pitch = max(5, image.height // 45)
    for y in range(y0, y1 - pitch, pitch):
        x = float(x0)
        while x < x1 - 6:
            word = between(4, 22, rng)
            draw.rectangle(
                [x, y, min(x + word, x1), y + max(1, pitch // 3)],
                fill=_blend(ink, image.getpixel((x0, y0))[:3], 0.25),
            )
            x += word + 4


def _table(image: Image, box: Box, ink: Color, rng: Rng) -> None:
    """Nutrition facts."""
    draw = _pen(image)
    x0, y0, x1, y1 = _pixels(image, box)
    draw.rectangle([x0, y0, x1, y1], outline=ink, fill=(248, 248, 246))
    rows = 7
    for i in range(1, rows):
        y = y0 + (y1 - y0) * i // rows
        draw.line([x0, y, x1, y], fill=(40, 40, 40), width=1)
        h = max(1, (y1 - y0) // rows // 4)
        draw.rectangle(
            [x0 + 4, y + h, x0 + 4 + between(0.2, 0.5, rng) * (x1 - x0), y + 2 * h],
            fill=(60, 60, 60),
        )
        draw.rectangle([x1 - 0.2 * (x1 - x0), y + h, x1 - 4, y + 2 * h], fill=(60, 60, 60))


def _barcode(image: Image, box: Box, rng: Rng) -> None:
    draw = _pen(image)
    x0, y0, x1, y1 = _pixels(image, box)
    draw.rectangle([x0, y0, x1, y1], fill=(250, 250, 250))
    x, end, unit = x0 + 0.08 * (x1 - x0), x1 - 0.08 * (x1 - x0), max(1.0, (x1 - x0) / 75)
    foot = y1 - 0.18 * (y1 - y0)
    while x < end:
        bar, gap = unit * int(between(1, 4, rng)), unit * int(between(1, 4, rng))
        draw.rectangle([x, y0 + 0.08 * (y1 - y0), x + bar - 1, foot], fill=(15, 15, 15))
        x += bar + gap
    digits = "".join(str(int(between(0, 10, rng))) for _ in range(13))
    _text(
        image,
        (x0 / image.width + 0.02, foot / image.height, x1 / image.width - 0.02, y1 / image.height),
        digits,
        (15, 15, 15),
        0,
    )


def _text(image: Image, box: Box, text: str, fill: Color, bold: int) -> None:
    """Text fitted into a box (fractions, y down), centred, at most a quarter narrower or wider."""
    from PIL import ImageFont
    from PIL.Image import Resampling

    x0, y0, x1, y1 = _pixels(image, box)
    if x1 - x0 < 4 or y1 - y0 < 3:
        return
    font = ImageFont.load_default(size=72)
    left, top, right, bottom = font.getbbox(text, stroke_width=bold)
    mask = _canvas(int(right - left) + 2, int(bottom - top) + 2, (0, 0, 0))
    _pen(mask).text((1 - left, 1 - top), text, fill=(255, 255, 255), font=font, stroke_width=bold)
    mask = mask.convert("L")
    scale = min((x1 - x0) / mask.width, (y1 - y0) / mask.height)
    w = int(min(x1 - x0, 1.3 * scale * mask.width))
    h = int(min(y1 - y0, 1.5 * scale * mask.height))
    small = mask.resize(
        (max(1, w), max(1, h)), Resampling.BOX if scale < 0.5 else Resampling.BILINEAR
    )
    image.paste(fill, ((x0 + x1 - w) // 2, (y0 + y1 - h) // 2), small)


def _fruit(pen: ImageDraw, x: float, y: float, r: float, fill: Color) -> None:
    pen.ellipse([x - r, y - r, x + r, y + r], fill=fill)
    light = _blend(fill, (255, 255, 255), 0.45)
    pen.ellipse([x - 0.55 * r, y - 0.6 * r, x - 0.15 * r, y - 0.2 * r], fill=light)
    pen.line(
        [x, y - 0.8 * r, x + 0.1 * r, y - 1.25 * r], fill=(70, 50, 30), width=max(1, int(0.09 * r))
    )
    _leaf(pen, (x + 0.05 * r, y - r), (x + 0.7 * r, y - 1.3 * r), (60, 130, 60))


def _leaf(pen: ImageDraw, foot: Place, tip: Place, fill: Color) -> None:
    """A pointed oval."""
    dx, dy = tip[0] - foot[0], tip[1] - foot[1]
    edges = []
    for side in (1.0, -1.0):
        for i in range(9):
            t = i / 8 if side > 0 else 1 - i / 8
            out = side * 0.22 * math.sin(math.pi * t)
            edges.append((foot[0] + t * dx - out * dy, foot[1] + t * dy + out * dx))
    pen.polygon(edges, fill=fill)


def _gradient(image: Image, top: Color, bottom: Color) -> None:
    pen = _pen(image)
    for y in range(image.height):
        pen.line([0, y, image.width, y], fill=_blend(top, bottom, y / image.height))


def _readable(design: _Design, ground: Color) -> Color:
    """The design's colour that stands out most from a ground."""
    options: Sequence[Color] = (design.ink, design.ground, (255, 255, 255), (20, 20, 22))
    return max(options, key=lambda c: abs(_brightness(c) - _brightness(ground)))


def _brightness(c: Color) -> float:
    return 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2]


def _blend(a: Color, b: Color, t: float) -> Color:
    r, g, bl = (round(x + (y - x) * t) for x, y in zip(a, b, strict=True))
    return (r, g, bl)


def _pixels(image: Image, box: Box) -> tuple[int, int, int, int]:
    w, h = image.size
    return (int(box[0] * w), int(box[1] * h), int(box[2] * w), int(box[3] * h))


def _pen(image: Image) -> ImageDraw:
    from PIL.ImageDraw import Draw

    return Draw(image)


def _canvas(w: int, h: int, fill: Color) -> Image:
    from PIL.Image import new

    return new("RGB", (w, h), fill)


def _squeezed(image: Image, w: int, h: int) -> TextureData:
    from PIL.Image import Resampling

    return TextureData(np.array(image.resize((w, h), Resampling.LANCZOS), dtype=np.uint8))


def _atlas(faces: Mapping[str, Image], places: Mapping[str, UvRect], ground: Color) -> TextureData:
    """The faces squeezed into their places; v points up, rows down."""
    from PIL.Image import Resampling

    sheet = _canvas(_SIZE_PX, _SIZE_PX, ground)
    for name, (u0, v0, u1, v1) in places.items():
        x0, x1 = math.floor(u0 * _SIZE_PX), math.ceil(u1 * _SIZE_PX)
        y0, y1 = math.floor((1 - v1) * _SIZE_PX), math.ceil((1 - v0) * _SIZE_PX)
        face = faces[name].resize((x1 - x0, y1 - y0), Resampling.LANCZOS)
        sheet.paste(face, (x0, y0))
    return TextureData(np.array(sheet, dtype=np.uint8))
