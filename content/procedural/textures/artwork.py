"""Pens and stamps for printed matter: text that fits, bar codes, small print, simple shapes.

Boxes are (left, top, right, bottom) as fractions of the image, y down. While a texture's writing is
recorded, images carry their lines of text along; ``paste`` and ``turn`` take them to other images.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.procedural.surface_shapes import UvRect
from gen_data.core import writing
from gen_data.core.asset_types import TextureData
from gen_data.core.variant_rng import VariantRng

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont

SIZE_PX = 512

Color = tuple[int, int, int]
Place = tuple[float, float]
Box = tuple[float, float, float, float]

_WRITING = "writing"
"""Key of an image's lines of text."""
_WORDS_OF = load_table(__package__, "languages", tuple[str, ...])


def canvas(w: int, h: int, fill: Color) -> Image:
    """A plain RGB image."""
    from PIL.Image import new

    return new("RGB", (w, h), fill)


def pen(image: Image) -> ImageDraw:
    """Drawing context of an image; coordinates in pixels."""
    from PIL.ImageDraw import Draw

    return Draw(image)


def pixels(image: Image, box: Box) -> tuple[int, int, int, int]:
    """Left, top, right, bottom of a box in pixels."""
    w, h = image.size
    return (int(box[0] * w), int(box[1] * h), int(box[2] * w), int(box[3] * h))


def language_of(text: str) -> str:
    """Language of a line, by ``languages.yaml``: a code as in ``Writing``.

    Letters alone and numbers have none; names take the language of the words around them.
    """
    if text.casefold() in _LANGUAGE:
        return _LANGUAGE[text.casefold()]
    words = [word.strip('.,;:!?()“”"').casefold() for word in text.split()]
    found = {_LANGUAGE.get(w, "en") for w in words if sum(map(str.isalpha, w)) > 1}
    found -= {writing.NO_LANGUAGE}
    found = found - {writing.UNDETERMINED} or found or {writing.NO_LANGUAGE}
    return found.pop() if len(found) == 1 else writing.SEVERAL


_LANGUAGE = {word.casefold(): code for code, words in _WORDS_OF.items() for word in words}


def note(
    image: Image, text: str, boxes: Sequence[Box], stroke_px: float, language: str = ""
) -> None:
    """Note a line of text while writing is recorded.

    Args:
        image: Image that it is on.
        text: The line.
        boxes: Left, top, right and bottom [px] of the ink of each character that is not a space;
            one box if the text is empty.
        stroke_px: Width of its strokes.
        language: Its language; empty = found by its words.
    """
    if not boxes or not writing.is_recorded():
        return
    places = np.array(boxes, np.float64)
    high = float((places[:, 3] - places[:, 1]).max())
    shares = writing.boxes_to_quads(places) / image.size
    language = language or language_of(text)
    kind: writing.Kind = "print" if text else "scribble"
    line = writing.Writing(text.strip(), language, shares, stroke_px / max(high, 1.0), kind)
    image.info[_WRITING] = (*_noted(image), line)


def _noted(image: Image) -> tuple[writing.Writing, ...]:
    lines: tuple[writing.Writing, ...] = image.info.get(_WRITING, ())
    return lines


def paste(sheet: Image, part: Image, at: tuple[int, int]) -> None:
    """Paste an image with its writing, its top left corner at a pixel."""
    sheet.paste(part, at)
    scale, shift = np.divide(part.size, sheet.size), np.divide(at, sheet.size)
    moved = (line.moved(scale, shift) for line in _noted(part))
    sheet.info[_WRITING] = (*_noted(sheet), *moved)


def turn(image: Image, quarters: int) -> Image:
    """The image with its writing after quarter turns counter-clockwise."""
    turned, lines = image.rotate(90 * quarters, expand=True), _noted(image)
    for _ in range(quarters % 4):
        lines = tuple(line.turned() for line in lines)
    turned.info[_WRITING] = lines
    return turned


def join(image: Image, step: int = 1) -> None:
    """Join every ``step``-th line noted on an image to one, and drop the others."""
    lines = _noted(image)[::step]
    if lines:
        quads, text = np.concatenate([line.quads for line in lines]), "".join(w.text for w in lines)
        stroke = lines[0].stroke
        image.info[_WRITING] = (writing.Writing(text, writing.NO_LANGUAGE, quads, stroke),)


def record(image: Image, box: Box = (0.0, 0.0, 1.0, 1.0)) -> None:
    """Record the writing on an image that fills a box of the texture."""
    left, top, right, bottom = box
    scale, shift = np.array((right - left, bottom - top)), np.array((left, top))
    writing.record(line.moved(scale, shift) for line in _noted(image))


def resize_texture(image: Image, w: int, h: int) -> TextureData:
    """The whole image as a texture of another size; records its writing."""
    from PIL.Image import Resampling

    record(image)
    return TextureData(np.array(image.resize((w, h), Resampling.LANCZOS), dtype=np.uint8))


def atlas(faces: Mapping[str, Image], places: Mapping[str, UvRect], ground: Color) -> TextureData:
    """The faces squeezed into their places; v points up, rows down."""
    from PIL.Image import Resampling

    sheet = canvas(SIZE_PX, SIZE_PX, ground)
    for name, (u0, v0, u1, v1) in places.items():
        x0, x1 = math.floor(u0 * SIZE_PX), math.ceil(u1 * SIZE_PX)
        y0, y1 = math.floor((1 - v1) * SIZE_PX), math.ceil((1 - v0) * SIZE_PX)
        face = faces[name].resize((x1 - x0, y1 - y0), Resampling.LANCZOS)
        paste(sheet, face, (x0, y0))
    record(sheet)
    return TextureData(np.array(sheet, dtype=np.uint8))


def text(image: Image, box: Box, text: str, fill: Color, bold: int, language: str = "") -> None:
    """Text fitted into a box (fractions, y down), centred, at most a quarter narrower or wider.

    ``language`` is the text's; empty = found by its words.
    """
    from PIL.Image import Resampling

    x0, y0, x1, y1 = pixels(image, box)
    if x1 - x0 < 4 or y1 - y0 < 3:
        return
    font = _font(72)
    left, top, right, bottom = font.getbbox(text, stroke_width=bold)
    mask = canvas(int(right - left) + 2, int(bottom - top) + 2, (0, 0, 0))
    pen(mask).text((1 - left, 1 - top), text, fill=(255, 255, 255), font=font, stroke_width=bold)
    mask = mask.convert("L")
    scale = min((x1 - x0) / mask.width, (y1 - y0) / mask.height)
    w = int(min(x1 - x0, 1.3 * scale * mask.width))
    h = int(min(y1 - y0, 1.5 * scale * mask.height))
    small = mask.resize(
        (max(1, w), max(1, h)), Resampling.BOX if scale < 0.5 else Resampling.BILINEAR
    )
    at = (x0 + x1 - w) // 2, (y0 + y1 - h) // 2
    image.paste(fill, at, small)
    if writing.is_recorded():
        resized = small.width / mask.width, small.height / mask.height
        boxes = _ink_boxes(text, font, (1 - left, 1 - top), bold)
        note(image, text, _placed(boxes, resized, at), _stem_px(font, bold) * resized[0], language)


def _font(size: float) -> FreeTypeFont:
    """Pillow's own typeface."""
    from PIL import ImageFont

    font = ImageFont.load_default(size=size)
    assert isinstance(font, ImageFont.FreeTypeFont), "of a size"
    return font


def _ink_boxes(text: str, font: FreeTypeFont, at: Place, bold: int = 0) -> list[Box]:
    """Boxes of the ink of the characters of a text that Pillow draws at a place [px]."""
    boxes = []
    for k, letter in enumerate(text):
        if not letter.isspace():
            x = at[0] + font.getlength(text[: k + 1]) - font.getlength(letter)
            left, top, right, bottom = _ink_box(font, letter, bold)
            boxes.append((x + left, at[1] + top, x + right, at[1] + bottom))
    return boxes


def _ink_box(font: FreeTypeFont, letter: str, bold: int) -> Box:
    """Box of the ink of a character drawn at the origin [px]; ``getbbox`` is wider."""
    mask, (x, y) = font.getmask2(letter, "L", stroke_width=bold)
    left, top, right, bottom = mask.getbbox() or (0, 0, *mask.size)
    return (x + left, y + top, x + right, y + bottom)


def _stem_px(font: FreeTypeFont, bold: int = 0) -> float:
    """Width of upright strokes."""
    left, _, right, _ = _ink_box(font, "I", bold)
    return right - left


def _placed(boxes: Sequence[Box], scale: Place, at: Place) -> list[Box]:
    """Boxes of a stamp after it was scaled and pasted at a place [px]."""
    (sx, sy), (x, y) = scale, at
    return [(x + sx * a, y + sy * b, x + sx * c, y + sy * d) for a, b, c, d in boxes]


def lettering(
    image: Image, box: Box, text: str, fill: Color, face: str, bold: int, language: str = ""
) -> None:
    """Text of another face, fitted into a box like ``text``: ``serif``, ``script`` or ``wide``."""
    import cv2
    from PIL.Image import Resampling, fromarray

    x0, y0, x1, y1 = pixels(image, box)
    if x1 - x0 < 4 or y1 - y0 < 3:
        return
    font = {
        "serif": cv2.FONT_HERSHEY_TRIPLEX,
        "script": cv2.FONT_HERSHEY_SCRIPT_COMPLEX,
        "wide": cv2.FONT_HERSHEY_DUPLEX,
    }[face]
    (w, h), below = cv2.getTextSize(text, font, 2.0, bold)
    mask = np.zeros((h + below + 16, w + 16), np.uint8)
    cv2.putText(mask, text, (8, h + 8), font, 2.0, 255, bold, cv2.LINE_AA)
    scale = min((x1 - x0) / mask.shape[1], (y1 - y0) / mask.shape[0])
    size = max(1, int(scale * mask.shape[1])), max(1, int(scale * mask.shape[0]))
    small = fromarray(mask).resize(size, Resampling.BOX)
    at = (x0 + x1 - size[0]) // 2, (y0 + y1 - size[1]) // 2
    image.paste(fill, at, small)
    if writing.is_recorded():
        boxes = []
        for k, letter in enumerate(text):
            if not letter.isspace():
                # Both widths include the thickness of a stroke.
                x = cv2.getTextSize(text[: k + 1], font, 2.0, bold)[0][0]
                x -= cv2.getTextSize(letter, font, 2.0, bold)[0][0]
                alone = np.zeros_like(mask)
                cv2.putText(alone, letter, (8 + x, h + 8), font, 2.0, 255, bold, cv2.LINE_AA)
                left, top, wide, high = cv2.boundingRect((alone > 127).astype(np.uint8))
                boxes.append((left, top, left + wide, top + high))
        resized = size[0] / mask.shape[1], size[1] / mask.shape[0]
        note(image, text, _placed(boxes, resized, at), bold * resized[1], language)


def lines(image: Image, box: Box, ink: Color, ground: Color, words: Sequence[str]) -> None:
    """Small print: words set in lines that fill a box; they begin again where they end."""
    draw = pen(image)
    x0, y0, x1, y1 = pixels(image, box)
    pitch = max(8, image.height // 26)
    font = _font(pitch - 1)
    fill, i = blend(ink, ground, 0.15), 0
    for y in range(y0, y1 - pitch + 1, pitch):
        line = words[i % len(words)]
        i += 1
        while font.getlength(f"{line} {words[i % len(words)]}") < x1 - x0:
            line, i = f"{line} {words[i % len(words)]}", i + 1
        draw.text((x0, y), line, fill=fill, font=font)
        _note_plain(image, line, font, (x0, y))


def _note_plain(image: Image, text: str, font: FreeTypeFont, at: Place) -> None:
    """Note a text that Pillow draws at a place [px]."""
    if writing.is_recorded():
        note(image, text, _ink_boxes(text, font, at), _stem_px(font))


NUTRIENTS = ("Energy", "Fat", "  saturates", "Carbohydrate", "  sugars", "Protein", "Salt")


def table(image: Image, box: Box, ink: Color, rng: VariantRng) -> None:
    """Nutrition facts: names and drawn amounts."""
    draw = pen(image)
    x0, y0, x1, y1 = pixels(image, box)
    draw.rectangle([x0, y0, x1, y1], outline=ink, fill=(248, 248, 246))
    pitch = (y1 - y0) / (len(NUTRIENTS) + 1)
    font = _font(max(5.0, 0.8 * pitch))
    for i, name in enumerate(("per 100 g", *NUTRIENTS)):
        y = y0 + i * pitch
        draw.line([x0, y + pitch, x1, y + pitch], fill=(60, 60, 60), width=1)
        draw.text((x0 + 3, y), name, fill=(30, 30, 30), font=font)
        _note_plain(image, name, font, (x0 + 3, y))
        amount = f"{int(rng.between(20, 2200))} kJ" if i == 1 else f"{rng.between(0, 60):.1f} g"
        if i:
            at = x1 - 3 - font.getlength(amount)
            draw.text((at, y), amount, fill=(30, 30, 30), font=font)
            _note_plain(image, amount, font, (at, y))


def barcode(image: Image, box: Box, rng: VariantRng) -> None:
    """Bars of one to three units and thirteen digits."""
    draw = pen(image)
    x0, y0, x1, y1 = pixels(image, box)
    draw.rectangle([x0, y0, x1, y1], fill=(250, 250, 250))
    x, end, unit = x0 + 0.08 * (x1 - x0), x1 - 0.08 * (x1 - x0), max(1.0, (x1 - x0) / 75)
    foot = y1 - 0.18 * (y1 - y0)
    while x < end:
        bar, gap = unit * int(rng.between(1, 4)), unit * int(rng.between(1, 4))
        # Of a bar one unit wide, rounding may leave less than nothing.
        draw.rectangle([x, y0 + 0.08 * (y1 - y0), max(x, x + bar - 1), foot], fill=(15, 15, 15))
        x += bar + gap
    digits = "".join(str(int(rng.between(0, 10))) for _ in range(13))
    w, h = image.size
    below = (x0 / w + 0.02, foot / h, x1 / w - 0.02, y1 / h)
    text(image, below, digits, (15, 15, 15), 0)


def panel(image: Image, box: Box, fill: Color) -> None:
    """A rectangle with rounded corners."""
    x0, y0, x1, y1 = pixels(image, box)
    pen(image).rounded_rectangle([x0, y0, x1, y1], radius=max(1, (y1 - y0) // 6), fill=fill)


def burst(image: Image, centre: Place, radius: float, fill: Color, ink: Color) -> None:
    """A star with a word in it."""
    cx, cy = centre[0] * image.width, centre[1] * image.height
    rays = [(radius * (1.0 if i % 2 else 0.8), math.pi * i / 12) for i in range(24)]
    star = [(cx + r * math.cos(turn), cy + r * math.sin(turn)) for r, turn in rays]
    pen(image).polygon(star, fill=fill)
    (w, h), x, y = image.size, 0.6 * radius, 0.3 * radius
    text(image, ((cx - x) / w, (cy - y) / h, (cx + x) / w, (cy + y) / h), "NEW", ink, 2)


def gradient(image: Image, top: Color, bottom: Color) -> None:
    """The whole image from one colour above to another below."""
    from PIL.Image import Resampling, fromarray

    above, below = np.array(top), np.array(bottom)
    share = np.arange(image.height)[:, None] / image.height
    rows = np.rint(above + (below - above) * share).astype(np.uint8)
    image.paste(fromarray(rows[:, None]).resize(image.size, Resampling.NEAREST))


def fruit(draw: ImageDraw, at: Place, r: float, fill: Color) -> None:
    """A round fruit with a highlight, a stalk and a leaf."""
    x, y = at
    draw.ellipse([x - r, y - r, x + r, y + r], fill=fill)
    light = blend(fill, (255, 255, 255), 0.45)
    draw.ellipse([x - 0.55 * r, y - 0.6 * r, x - 0.15 * r, y - 0.2 * r], fill=light)
    stalk = [x, y - 0.8 * r, x + 0.1 * r, y - 1.25 * r]
    draw.line(stalk, fill=(70, 50, 30), width=max(1, int(0.09 * r)))
    leaf(draw, (x + 0.05 * r, y - r), (x + 0.7 * r, y - 1.3 * r), (60, 130, 60))


def leaf(draw: ImageDraw, foot: Place, tip: Place, fill: Color) -> None:
    """A pointed oval."""
    dx, dy = tip[0] - foot[0], tip[1] - foot[1]
    edges = []
    for side in (1.0, -1.0):
        for i in range(9):
            t = i / 8 if side > 0 else 1 - i / 8
            out = side * 0.22 * math.sin(math.pi * t)
            edges.append((foot[0] + t * dx - out * dy, foot[1] + t * dy + out * dx))
    draw.polygon(edges, fill=fill)


def blend(a: Color, b: Color, t: float) -> Color:
    """``a`` where t is 0, ``b`` where it is 1."""
    r, g, bl = (round(x + (y - x) * t) for x, y in zip(a, b, strict=True))
    return (r, g, bl)


def brightness(c: Color) -> float:
    """Luma (Rec. 601) in [0, 255]."""
    return 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2]
