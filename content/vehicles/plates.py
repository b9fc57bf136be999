"""Licence plates of several countries: letters and digits of straight strokes, in random order.

Glyphs stand on a grid of 4 by 6. Letters that are easily confused with digits are left out, as
in many countries.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gen_data.assets.family import check_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural.material_presets import hex_to_srgb8
from gen_data.content.procedural.textures import artwork as art
from gen_data.core.asset_types import TextureData
from gen_data.core.variant_rng import VariantRng, variant_rng
from gen_data.core.writing import NO_LANGUAGE

if TYPE_CHECKING:
    from PIL.Image import Image


@dataclass(frozen=True)
class PlateFormat:
    """Licence plates of one country.

    Attributes:
        ground, ink: Colours of the plate and of the glyphs, sRGB.
        patterns: Orders of letters (L), consonants (C), digits (D) and symbols (S).
        glyph: Height of the glyphs over the plate's.
        size_mm: Width and height.
        rear: Colour of the plate behind, if it is another one.
        code: In the blue field at the left border; empty = there is none.
        right: Colour of a field at the right border.
        border: Colour of lines along the upper and lower edge.
        title, title_ink: Name of the state above the glyphs.
        over: Order of small glyphs above the others.
        weight: Relative frequency in Europe; 0 = elsewhere.
    """

    ground: str
    ink: str
    patterns: tuple[str, ...]
    glyph: float
    size_mm: tuple[float, float] = (520.0, 110.0)
    rear: str = ""
    code: str = ""
    right: str = ""
    border: str = ""
    title: str = ""
    title_ink: str = ""
    over: str = ""
    weight: float = 0.0


SEEDS = 500
"""Plates that vehicles draw from; others can be asked for."""
FAMILY = "texture/licence_plate"
ANY = "any"
"""As a country: one of Europe's, drawn by the seed in proportion to the weights."""

GLYPHS = load_table(__package__, "glyphs", str)
SYMBOLS = load_table(__package__, "symbols", tuple[str, ...])
FORMATS = load_table(__package__, "plate_formats", PlateFormat)
IN_EUROPE = {name: plate.weight for name, plate in FORMATS.items() if plate.weight}
_LETTERS = "ABCDEFGHJKLMNPRSTUVWXYZ"
_CONSONANTS = "BCDFGHJKLMNPRSTVWXYZ"
_DIGITS = "0123456789"
# Car plates are 0.52 m by 0.11 m, motorcycle plates 0.18 m by 0.15 m, in two rows. Plates of other
# proportions are centred on a dark holder of that size.
_DRAWN_PX = {1: (1300, 275), 2: (600, 500)}
_SIZE_PX = {1: (256, 64), 2: (128, 128)}
_BLUE, _YELLOW, _HOLDER = "#003399", "#ffcc00", "#101012"
_FIELD_SHARE = 0.42
"""Width of the blue field over the plate's height: 46 mm of 110 mm."""
_STROKE = 0.95


def plate_country(seed: int) -> str:
    """Country of a plate that may be from any in Europe."""
    draw = float(variant_rng("licence_plate/country", seed).random()) * sum(IN_EUROPE.values())
    for name, weight in IN_EUROPE.items():
        draw -= weight
        if draw < 0.0:
            return name
    return next(iter(IN_EUROPE))


def plate_text(seed: int, country: str = ANY) -> str:
    """Text of a plate; groups are separated by a space or a hyphen, ``*`` stands for a symbol."""
    country = plate_country(seed) if country == ANY else country
    rng = variant_rng("licence_plate", seed)
    pattern = rng.choose(FORMATS[country].patterns)
    return "".join(_draw_character(place, rng) for place in pattern)


def plate_id(seed: int, rows: int, country: str = ANY, rear: int = 0) -> str:
    """The asset id of a plate."""
    return f"{FAMILY}?country={country}&rear={rear}&rows={rows}&seed={seed}"


def reseed_plate(texture: str, seed: int, country: str = "") -> str:
    """The id of another plate of the same size, and place; other textures stay as they are.

    Without a country, the plate remains one of the same country.
    """
    if not texture.startswith(FAMILY + "?"):
        return texture
    fields = dict(field.split("=") for field in texture.partition("?")[2].split("&"))
    return plate_id(
        seed,
        int(fields.get("rows", 1)),
        country or fields.get("country", ANY),
        int(fields.get("rear", 0)),
    )


def licence_plate(seed: int, rows: int, country: str, rear: int) -> TextureData:
    """The face of a plate.

    Args:
        seed: Seed of the text.
        rows: 1, or 2 with the first group above the others.
        country: A key of ``plate_formats.yaml``, or ``any``.
        rear: 1 for the plate behind the vehicle.

    Raises:
        ValueError: if there are neither 1 nor 2 rows.
        AssetError: if the country is unknown.
    """
    if rows not in _DRAWN_PX:
        raise ValueError(f"a licence plate has 1 or 2 rows, not {rows}")
    check_option("licence_plate", "country", country, (ANY, *FORMATS))
    country = plate_country(seed) if country == ANY else country
    plate = FORMATS[country]
    width, height = _DRAWN_PX[rows]
    wide = min(width, round(height * plate.size_mm[0] / plate.size_mm[1])) if rows == 1 else width
    face = art.canvas(wide, height, hex_to_srgb8((rear and plate.rear) or plate.ground))
    lettering = _Lettering(country, variant_rng("licence_plate/symbols", seed))
    _draw_face(face, plate, plate_text(seed, country), rows, lettering)
    image = art.canvas(width, height, hex_to_srgb8(_HOLDER))
    art.paste(image, face, ((width - wide) // 2, 0))
    return art.resize_texture(image, *_SIZE_PX[rows])


@dataclass(frozen=True)
class _Lettering:
    """Strokes of characters: symbols by country, drawn at random."""

    country: str
    rng: VariantRng

    def strokes(self, letter: str, *, small: bool = False) -> Iterator[list[tuple[int, int]]]:
        lines = GLYPHS.get(letter, "")
        if letter == "*":
            key = self.country.partition("_")[0]
            lines = self.rng.choose(SYMBOLS[f"{key}_over" if small else key])
        elif letter == "-":
            lines = "13 33"
        for stroke in lines.split(","):
            if stroke:
                yield [(int(point[0]), int(point[1])) for point in stroke.split()]


def _draw_face(
    face: Image, plate: PlateFormat, text: str, rows: int, lettering: _Lettering
) -> None:
    """Fields at the borders, edge, title and glyphs."""
    draw, ink = art.pen(face), hex_to_srgb8(plate.ink)
    width, height = face.size
    left, right = 0.0, float(width)
    if plate.code and rows == 1:
        left = _FIELD_SHARE * height
        _draw_field(face, left, plate.code)
    if plate.right and rows == 1:
        right = width - 0.9 * _FIELD_SHARE * height
        draw.rectangle([right, 0, width, height], fill=hex_to_srgb8(plate.right))
    edge = hex_to_srgb8(plate.border or plate.ink)
    draw.rounded_rectangle([5, 5, width - 6, height - 6], radius=26, outline=edge, width=7)
    if rows == 2:
        first, _, rest = text.replace("-", " ").partition(" ")
        for k, line in enumerate((first, rest)):
            _write(face, line, ink, (0.0, k * 0.5 * height, right, 0.5 * height), 0.62, lettering)
        return
    top = 0.0
    if plate.title:
        art.text(face, (0.2, 0.06, 0.8, 0.24), plate.title, hex_to_srgb8(plate.title_ink), 2)
        top = 0.16 * height
    if plate.over:
        line = "".join(_draw_character(place, lettering.rng) for place in plate.over)
        box = (0.2 * width, 0.05 * height, 0.8 * width, 0.3 * height)
        _write(face, line, ink, box, 0.85, lettering, small=True)
        top = 0.26 * height
    box = (left, top, right, height - top)
    _write(face, text, ink, box, plate.glyph * height / (height - top), lettering)


def _draw_field(face: Image, width: float, code: str) -> None:
    """The blue field: a ring of twelve stars above the country's code."""
    draw, height = art.pen(face), face.size[1]
    draw.rectangle([0, 0, width, height], fill=hex_to_srgb8(_BLUE))
    for k in range(12):
        turn = math.pi * k / 6.0
        x, y = (
            0.5 * width + 0.3 * width * math.sin(turn),
            0.36 * height - 0.3 * width * math.cos(turn),
        )
        draw.ellipse([x - 5, y - 5, x + 5, y + 5], fill=hex_to_srgb8(_YELLOW))
    share = width / face.size[0]
    art.text(face, (0.2 * share, 0.62, 0.8 * share, 0.9), code, (240, 240, 240), 2)


def _write(
    face: Image,
    line: str,
    ink: art.Color,
    box: tuple[float, float, float, float],
    glyph: float,
    lettering: _Lettering,
    *,
    small: bool = False,
) -> None:
    """Glyphs in the middle of a box (left, top, right, height); a space is half a glyph wide."""
    draw, boxes = art.pen(face), list[art.Box]()
    left, top, right, height = box
    tall, width = glyph * height, right - left
    advances = [0.5 if letter in " -" else 1.0 for letter in line]
    pitch = min(0.85 * tall, 0.88 * width / sum(advances))
    x = left + 0.5 * (width - pitch * sum(advances))
    unit = (0.66 * pitch / 4.0, tall / 6.0)
    pen_px = _STROKE * min(unit)
    bottom = top + 0.5 * (height + tall)
    for letter, advance in zip(line, advances, strict=True):
        inset = 0.17 * pitch if advance == 1.0 else -0.08 * pitch
        ink_px: list[art.Place] = []
        for stroke in lettering.strokes(letter, small=small):
            path = [(x + inset + u * unit[0], bottom - v * unit[1]) for u, v in stroke]
            draw.line(path, fill=ink, width=round(pen_px))
            for px, py in path:
                r = 0.5 * pen_px
                draw.ellipse([px - r, py - r, px + r, py + r], fill=ink)
            ink_px += path
        if ink_px:
            (us, vs), half = zip(*ink_px, strict=True), 0.5 * pen_px
            boxes.append((min(us) - half, min(vs) - half, max(us) + half, max(vs) + half))
        x += pitch * advance
    art.note(face, line, boxes, pen_px, NO_LANGUAGE)


def _draw_character(place: str, rng: VariantRng) -> str:
    sets = {"L": _LETTERS, "C": _CONSONANTS, "D": _DIGITS, "S": "*"}
    return rng.choose(sets[place]) if place in sets else place
