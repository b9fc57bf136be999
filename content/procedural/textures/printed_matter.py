"""Printed matter: labels, folding boxes and book covers with invented names.

These belong to one object and follow its UVs. They are drawn at the proportions of the object and
then squeezed into the image: letters have the right shape on the object.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from gen_data.config.data_files import load_table
from gen_data.content.procedural import bottles, material_presets, packaging
from gen_data.content.procedural.textures import artwork as art
from gen_data.content.procedural.textures.artwork import Box, Color, Place
from gen_data.content.procedural.textures.pictures import MANNERS, picture
from gen_data.core.asset_types import TextureData
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng
from gen_data.core.writing import UNDETERMINED

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

_FRUIT = ((200, 40, 40), (240, 150, 30), (120, 40, 110), (235, 200, 50), (110, 160, 50))
_WORDS = load_table(__package__, "printed_matter", tuple[str, ...])


@dataclass(frozen=True, slots=True)
class _Design:
    """Colours, words and layout that all faces of one product share."""

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
    rng = variant_rng("label", seed)
    image = _wrap(
        int(art.SIZE_PX * 1.5), bottles.LABEL_ASPECT, _design(seed, rng, _WORDS["volumes"]), rng
    )
    return art.resize_texture(image, art.SIZE_PX, art.SIZE_PX // 2)


def can_label(seed: int) -> TextureData:
    """All around a can; the front is in the middle."""
    rng = variant_rng("can_label", seed)
    sizes = _WORDS["weights"] if packaging.can_size(seed).food else ("330 ml", "500 ml")
    image = _wrap(
        int(art.SIZE_PX * 1.5), packaging.label_aspect(seed), _design(seed, rng, sizes), rng
    )
    return art.resize_texture(image, art.SIZE_PX, art.SIZE_PX)


def carton(seed: int) -> TextureData:
    """The six faces of a folding box, laid out by ``packaging.CARTON_ATLAS``."""
    return _box_print("carton", seed, packaging.carton_size_m(seed))


def milk_label(seed: int) -> TextureData:
    """The faces of a milk carton, laid out by ``packaging.CARTON_ATLAS``."""
    return _box_print("milk_label", seed, packaging.milk_size_m(seed))


def book_cover(seed: int) -> TextureData:
    """Back, spine and front of a book, laid out by ``books.COVER_ATLAS``."""
    from gen_data.content.procedural import books

    rng = variant_rng("book_cover", seed)
    words = rng.choose(_WORDS["titles"]), rng.choose(_WORDS["subjects"])
    design = replace(_design(seed, rng), product=" ".join(words), note=rng.choose(_WORDS["praise"]))
    length, width, thickness = books.book_size_m(seed)
    scale = 560.0 / length
    w, h = int(width * scale), int(length * scale)
    faces = {
        "front": _front_cover(w, h, words, design, rng),
        "spine": _spine(max(24, int(thickness * scale)), h, design),
        "back": _back_cover(w, h, design, rng),
    }
    return art.atlas(faces, books.COVER_ATLAS, design.ground)


def front_label(seed: int) -> TextureData:
    """A label on the front of a bottle: of wine or spirits, cosmetics, or as on packages."""
    rng = variant_rng("front_label", seed)
    design = _design(seed, rng, _WORDS["volumes"])
    make = in_turn((_estate_label, _plain_label, _front, _badge_label), seed // 2)
    return art.resize_texture(make(512, 560, design, rng), art.SIZE_PX, art.SIZE_PX)


def _estate_label(w: int, h: int, design: _Design, rng: VariantRng) -> Image:
    """Paper with a frame, a picture, a name in serifs, region, year and volume."""
    paper = rng.choose(((245, 240, 226), (250, 248, 242), (232, 224, 204), (28, 26, 26)))
    dark = art.brightness(paper) < 90
    ink = (226, 206, 150) if dark else rng.choose(((40, 30, 26), (110, 24, 34), (30, 52, 40)))
    image = art.canvas(w, h, paper)
    draw = art.pen(image)
    for inset in rng.choose(((14,), (10, 18), ())):
        draw.rectangle([inset, inset, w - inset, h - inset], outline=ink, width=3)
    top = rng.chance(0.5)
    picture = (0.28, 0.1, 0.72, 0.42) if top else (0.2, 0.36, 0.8, 0.66)
    _picture(image, picture, replace(design, picture=rng.choose((2, 3, 3, 4)), accent=ink), rng)
    face = rng.choose(("serif", "script", "serif"))
    name = design.brand.title() if face == "script" else design.brand.upper()
    brand = (0.1, 0.45, 0.9, 0.6) if top else (0.1, 0.12, 0.9, 0.3)
    art.lettering(image, brand, name, ink, face, 4, UNDETERMINED)
    region = rng.choose(_WORDS["regions"])
    art.lettering(image, (0.15, 0.68, 0.85, 0.75), region, ink, "serif", 2)
    art.lettering(
        image, (0.35, 0.78, 0.65, 0.86), str(int(rng.between(1998, 2026))), ink, "serif", 3
    )
    art.text(image, (0.12, 0.89, 0.42, 0.935), design.size, ink, 0)
    art.text(image, (0.58, 0.89, 0.88, 0.935), f"{rng.between(4.0, 15.0):.1f} % vol", ink, 0)
    return image


def _plain_label(w: int, h: int, design: _Design, rng: VariantRng) -> Image:
    """Text of cosmetics and medicine: a name, a line, a description, small print."""
    paper = rng.choose(((250, 250, 248), (245, 243, 238), design.ground))
    ink = max(
        (design.ink, (40, 42, 46)), key=lambda c: abs(art.brightness(c) - art.brightness(paper))
    )
    image = art.canvas(w, h, paper)
    if rng.chance(0.6):
        y = int(rng.choose((0.0, 0.34, 0.8)) * h)
        art.pen(image).rectangle([0, y, w, y + int(0.09 * h)], fill=design.second)
    face = rng.choose(("wide", "serif"))
    art.lettering(image, (0.1, 0.14, 0.9, 0.3), design.brand, ink, face, 5, UNDETERMINED)
    art.text(image, (0.15, 0.46, 0.85, 0.53), rng.choose(_WORDS["products"]), ink, 1)
    art.text(image, (0.2, 0.55, 0.8, 0.6), design.note, ink, 0)
    art.lines(image, (0.14, 0.63, 0.86, 0.79), ink, paper, _small_print(rng))
    art.text(image, (0.35, 0.91, 0.65, 0.96), design.size, ink, 0)
    return image


def _badge_label(w: int, h: int, design: _Design, rng: VariantRng) -> Image:
    """As on beer: an oval badge with the name across."""
    image = art.canvas(w, h, design.ground)
    draw = art.pen(image)
    draw.ellipse([0.06 * w, 0.08 * h, 0.94 * w, 0.92 * h], fill=design.second)
    draw.ellipse([0.1 * w, 0.115 * h, 0.9 * w, 0.885 * h], outline=design.accent, width=8)
    _picture(image, (0.36, 0.16, 0.64, 0.4), design, rng)
    draw.rectangle([0, 0.43 * h, w, 0.63 * h], fill=design.accent)
    ink = _readable(design, design.accent)
    face = rng.choose(("serif", "wide", "script"))
    art.lettering(image, (0.06, 0.44, 0.94, 0.62), design.brand, ink, face, 6, UNDETERMINED)
    under = _readable(design, design.second)
    art.text(image, (0.24, 0.67, 0.76, 0.73), rng.choose(_WORDS["beers"]), under, 1)
    art.text(image, (0.38, 0.77, 0.62, 0.82), design.size, under, 0)
    return image


def _small_print(rng: VariantRng) -> list[str]:
    """Words of a list of ingredients and of advice."""
    listed = ", ".join(rng.shuffled(_WORDS["ingredients"])[:14])
    advice = ". ".join(rng.shuffled(_WORDS["advice"])[:3])
    return f"INGREDIENTS: {listed}. {advice}.".split()


def _design(seed: int, rng: VariantRng, sizes: Sequence[str] = _WORDS["weights"]) -> _Design:
    scheme = in_turn(_WORDS["schemes"], seed)
    ground, second, accent, ink = (material_presets.hex_to_srgb8(code) for code in scheme.split())
    if rng.chance(0.3):
        second, accent = accent, second
    name = rng.choose(_WORDS["starts"]) + rng.choose(_WORDS["ends"])
    return _Design(
        ground,
        second,
        accent,
        ink,
        brand=name.upper() if rng.chance(0.5) else name,
        product=rng.choose(_WORDS["products"]),
        note=rng.choose(_WORDS["notes"]),
        size=rng.choose(sizes),
        layout=int(rng.between(0, 5)),
        picture=int(rng.between(0, 8)),
        bold=int(rng.between(1, 5)),
    )


def _box_print(name: str, seed: int, size_m: tuple[float, float, float]) -> TextureData:
    rng = variant_rng(name, seed)
    design = _design(seed, rng)
    depth, width, height = size_m
    scale = 460.0 / max(size_m)
    w, d, h = (max(24, int(side * scale)) for side in (width, depth, height))
    faces = {
        "front": _front(w, h, design, rng),
        "back": _front(w, h, design, variant_rng(f"{name}/back", seed)),
        "left": _info(d, h, design, rng),
        "right": _side(d, h, design, rng),
        "top": art.canvas(w, d, design.second) if name == "milk_label" else _strip(w, d, design),
        "bottom": _strip(w, d, design),
    }
    return art.atlas(faces, packaging.CARTON_ATLAS, design.ground)


def _wrap(width: int, aspect: float, design: _Design, rng: VariantRng) -> Image:
    """Front in the middle, information half on each end; the ends meet in the plain ground."""
    height = max(48, int(width / aspect))
    canvas = art.canvas(width, height, design.ground)
    # Less than half of a cylinder is visible at once.
    front = _front(int(0.42 * width), height, design, rng)
    art.paste(canvas, front, (int(0.29 * width), 0))
    end = int(0.25 * width)
    art.paste(canvas, _info(end, height, design, rng), (int(0.74 * width), 0))
    art.paste(canvas, _side(end, height, design, rng), (int(0.01 * width), 0))
    _bands(canvas, design)
    return canvas


def _front(w: int, h: int, design: _Design, rng: VariantRng) -> Image:
    """Front of a package: ground, picture, brand, product, note, size."""
    image = art.canvas(w, h, design.ground)
    _ground(image, design, rng)
    tall = h > 0.8 * w
    brand = (0.1, 0.06, 0.9, 0.24) if tall else (0.05, 0.08, 0.62, 0.42)
    product = (0.12, 0.345, 0.88, 0.42) if tall else (0.05, 0.5, 0.6, 0.66)
    picture = (0.2, 0.46, 0.8, 0.88) if tall else (0.64, 0.12, 0.97, 0.88)
    _picture(image, picture, design, rng)
    on_ground = design.layout in (0, 3)
    if design.layout in (1, 4):
        art.panel(image, brand, design.second)
    ink = design.ink if on_ground else _readable(design, design.second)
    art.text(image, brand, design.brand, ink, design.bold, UNDETERMINED)
    art.text(image, product, design.product, design.ink, 1)
    note = (0.05, 0.9, 0.5, 0.97) if tall else (0.05, 0.76, 0.4, 0.88)
    size = (0.68, 0.91, 0.95, 0.97) if tall else (0.44, 0.78, 0.6, 0.88)
    art.text(image, note, design.note, design.ink, 0)
    art.text(image, size, design.size, design.ink, 1)
    if tall and rng.chance(0.5):
        art.burst(image, (0.85, 0.5), 0.11 * w, design.accent, design.ground)
    return image


def _ground(image: Image, design: _Design, rng: VariantRng) -> None:
    """Gradient, split, wave, diagonal or plain."""
    w, h = image.size
    draw = art.pen(image)
    if design.layout == 0:
        art.gradient(image, design.ground, art.blend(design.ground, design.second, 0.45))
    elif design.layout == 1:
        draw.rectangle([0, 0, w, int(0.31 * h)], fill=design.second)
    elif design.layout == 2:
        bend, phase = rng.between(0.01, 0.035), rng.between(0.0, 6.0)
        edge = [(x, h * (0.27 + bend * math.sin(phase + 5.0 * x / w))) for x in range(0, w + 8, 4)]
        draw.polygon([(0, 0), (w + 8, 0), *edge[::-1]], fill=design.second)
        draw.line([(x, y + 0.015 * h) for x, y in edge], fill=design.accent, width=max(2, h // 60))
    elif design.layout == 3:
        draw.polygon([(0, h), (w, 0.62 * h), (w, h)], fill=design.accent)
        draw.polygon([(0, h), (w, 0.72 * h), (w, h)], fill=design.second)
    else:
        draw.ellipse([-0.35 * w, -0.35 * h, 1.35 * w, 0.33 * h], fill=design.second)


def _picture(image: Image, box: Box, design: _Design, rng: VariantRng) -> None:
    x0, y0, x1, y1 = art.pixels(image, box)
    radius = min(x1 - x0, y1 - y0) // 2
    if design.picture >= len(_DRAWN):
        manner = MANNERS[design.picture - len(_DRAWN)]
        image.paste(picture(x1 - x0, y1 - y0, design.ground, rng, manner), (x0, y0))
        return
    centre = (x0 + x1) // 2, (y0 + y1) // 2
    _DRAWN[design.picture](art.pen(image), centre, radius, design, rng)


def _bowl(pen: ImageDraw, at: Place, r: float, design: _Design, rng: VariantRng) -> None:
    cx, cy = at
    rim = art.blend(design.accent, (255, 255, 255), 0.5)
    pen.ellipse([cx - r, cy - 0.35 * r, cx + r, cy + 0.25 * r], fill=rim)
    for _ in range(26):
        turn, reach = rng.between(0, 2 * math.pi), rng.between(0, 0.8) * r
        x, y = cx + reach * math.cos(turn), cy - 0.1 * r + 0.28 * reach * math.sin(turn)
        shade = art.blend((214, 150, 60), (120, 60, 20), rng.between(0.0, 0.7))
        pen.ellipse([x - 0.13 * r, y - 0.09 * r, x + 0.13 * r, y + 0.09 * r], fill=shade)
    pen.pieslice([cx - r, cy - 0.95 * r, cx + r, cy + 0.95 * r], 2, 178, fill=design.accent)


def _fruits(pen: ImageDraw, at: Place, r: float, _: _Design, rng: VariantRng) -> None:
    for dx, dy in ((-0.42, 0.2), (0.4, 0.25), (0.0, -0.25)):
        art.fruit(pen, (at[0] + dx * r, at[1] + dy * r), 0.5 * r, rng.choose(_FRUIT))


def _leaves(pen: ImageDraw, at: Place, r: float, _: _Design, rng: VariantRng) -> None:
    foot = at[0], at[1] + 0.5 * r
    for i in range(7):
        turn = math.pi * (i / 6 + 1)
        tip = foot[0] + r * math.cos(turn), foot[1] + r * math.sin(turn)
        art.leaf(pen, foot, tip, art.blend((60, 130, 60), (20, 80, 40), rng.between(0, 1)))


def _landscape(pen: ImageDraw, at: Place, r: float, design: _Design, _: VariantRng) -> None:
    cx, cy = at
    pen.ellipse([cx - 0.5 * r, cy - 0.9 * r, cx + 0.5 * r, cy + 0.1 * r], fill=design.accent)
    for i in range(3):
        top = cy + 0.3 * i * r
        hills = [
            (x, top + 0.14 * r * math.sin(3.0 * x / max(r, 1.0) + 2 * i))
            for x in range(int(cx - r), int(cx + r) + 1, 3)
        ]
        grass = art.blend((150, 190, 90), (30, 90, 60), 0.2 + 0.3 * i)
        pen.polygon([(cx - r, cy + r), *hills, (cx + r, cy + r)], fill=grass)


def _rings(pen: ImageDraw, at: Place, r: float, design: _Design, _: VariantRng) -> None:
    cx, cy = at
    for i in range(5, 0, -1):
        s = r * i / 5
        fill = design.accent if i % 2 else design.second
        pen.ellipse([cx - s, cy - s, cx + s, cy + s], fill=fill)


_DRAWN = (_bowl, _fruits, _leaves, _landscape, _rings)


def _info(w: int, h: int, design: _Design, rng: VariantRng) -> Image:
    """Small print, a table of nutrition and a bar code."""
    paper = art.blend(design.ground, (255, 255, 255), 0.25)
    image = art.canvas(w, h, paper)
    ink = (25, 25, 28) if sum(paper) > 330 else (240, 240, 240)
    art.text(image, (0.08, 0.03, 0.92, 0.11), design.brand, ink, 1, UNDETERMINED)
    art.lines(image, (0.08, 0.13, 0.92, 0.34), ink, paper, _small_print(rng))
    art.table(image, (0.08, 0.36, 0.92, 0.66), ink, rng)
    art.barcode(image, (0.1, 0.72, 0.9, 0.95), rng)
    return image


def _side(w: int, h: int, design: _Design, rng: VariantRng) -> Image:
    """Brand upright along the side, some small print below."""
    image = art.canvas(w, h, design.second)
    ink = _readable(design, design.second)
    turned = art.canvas(int(0.62 * h), max(8, int(0.7 * w)), design.second)
    art.text(turned, (0.0, 0.1, 1.0, 0.9), design.brand, ink, design.bold, UNDETERMINED)
    art.paste(image, art.turn(turned, 1), (int(0.15 * w), int(0.04 * h)))
    art.lines(image, (0.1, 0.7, 0.9, 0.97), ink, design.second, _small_print(rng))
    return image


def _strip(w: int, h: int, design: _Design) -> Image:
    image = art.canvas(w, h, design.second)
    ink = _readable(design, design.second)
    art.text(image, (0.1, 0.2, 0.9, 0.8), design.brand, ink, design.bold, UNDETERMINED)
    return image


def _front_cover(w: int, h: int, words: tuple[str, str], design: _Design, rng: VariantRng) -> Image:
    image = art.canvas(w, h, design.ground)
    _ground(image, design, rng)
    _picture(image, (0.12, 0.4, 0.88, 0.82), design, rng)
    art.panel(image, (0.06, 0.07, 0.94, 0.35), design.ground)
    art.text(image, (0.1, 0.09, 0.9, 0.2), words[0], design.ink, 2)
    art.text(image, (0.1, 0.22, 0.9, 0.34), words[1], design.ink, 3)
    art.panel(image, (0.0, 0.87, 1.0, 0.97), design.second)
    author = f"{design.brand} {rng.choose(_WORDS['ends']).title()}"
    art.text(
        image, (0.2, 0.895, 0.8, 0.945), author, _readable(design, design.second), 1, UNDETERMINED
    )
    return image


def _spine(w: int, h: int, design: _Design) -> Image:
    """Title along the spine, read from the top down."""
    strip = art.canvas(h, w, design.second)
    ink = _readable(design, design.second)
    art.text(strip, (0.06, 0.2, 0.6, 0.8), design.product, ink, 1)
    art.text(strip, (0.68, 0.25, 0.94, 0.75), design.brand, ink, 1, UNDETERMINED)
    return art.turn(strip, -1)


def _back_cover(w: int, h: int, design: _Design, rng: VariantRng) -> Image:
    image = art.canvas(w, h, design.ground)
    art.text(image, (0.1, 0.08, 0.9, 0.15), f"“{design.note}”", design.ink, 1)
    words = " ".join(rng.shuffled(_WORDS["blurbs"])).split()
    art.lines(image, (0.1, 0.2, 0.9, 0.62), design.ink, design.ground, words)
    art.barcode(image, (0.52, 0.8, 0.92, 0.94), rng)
    return image


def _bands(image: Image, design: _Design) -> None:
    """Lines along both edges, all around."""
    w, h = image.size
    draw = art.pen(image)
    t = max(2, h // 40)
    for y in (0, h - t):
        draw.rectangle([0, y, w, y + t], fill=design.accent)


def _readable(design: _Design, ground: Color) -> Color:
    """The design's colour that stands out most from a ground."""
    options: Sequence[Color] = (design.ink, design.ground, (255, 255, 255), (20, 20, 22))
    return max(options, key=lambda c: abs(art.brightness(c) - art.brightness(ground)))
