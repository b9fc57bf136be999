"""Licence plates: letters and digits of straight strokes, in a format that no country has.

Glyphs stand on a grid of 4 by 6. Letters that are easily confused with digits are left out, as
in many countries.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.assets.procedural.material_presets import hex_to_srgb8
from gen_data.generator.assets.procedural.textures import artwork as art
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.core.asset_types import TextureData

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

SEEDS = 500
"""Plates that vehicles draw from; others can be asked for."""
FAMILY = "texture/licence_plate"

GLYPHS = load_table(__package__, "glyphs", str)
_LETTERS = "ABCDEFGHJKLMNPRSTUVWXYZ"
_DIGITS = "0123456789"
_PATTERNS = ("LL DDDD", "LLL DDD", "DD LLL D", "L DDD LL", "LL DD LL")
_SCHEMES = (("#f1f1ec", "#17181a"), ("#f1f1ec", "#17181a"), ("#f1f1ec", "#1a3f7a"),
            ("#f0c419", "#17181a"), ("#eef2ee", "#1d6b3a"))  # fmt: skip
# Plates of cars are 0.52 m by 0.11 m, those of motorcycles 0.18 m by 0.15 m, in two rows.
_DRAWN_PX = {1: (1300, 275), 2: (600, 500)}
_SIZE_PX = {1: (256, 64), 2: (128, 128)}
_GLYPH_SHARE = 0.62
_STROKE = 0.95


def plate_text(seed: int) -> str:
    """Text of a plate; groups are separated by a space."""
    rng = variant_rng("licence_plate", seed)
    pattern = rng.choose(_PATTERNS)
    return "".join(_draw_character(place, rng) for place in pattern)


def plate_id(seed: int, rows: int) -> str:
    """The asset id of a plate."""
    return f"{FAMILY}?rows={rows}&seed={seed}"


def reseed_plate(texture: str, seed: int) -> str:
    """The id of another plate of the same size; other textures stay as they are."""
    if not texture.startswith(FAMILY + "?"):
        return texture
    return f"{texture.rpartition('seed=')[0]}seed={seed}"


def licence_plate(seed: int, rows: int) -> TextureData:
    """The face of a plate.

    Args:
        seed: Of the text and the colours.
        rows: 1, or 2 with the first group above the others.
    """
    if rows not in _DRAWN_PX:
        raise ValueError(f"a licence plate has 1 or 2 rows, not {rows}")
    ground, ink = (
        hex_to_srgb8(c) for c in variant_rng("licence_plate/colors", seed).choose(_SCHEMES)
    )
    width, height = _DRAWN_PX[rows]
    image = art.canvas(width, height, ground)
    draw = art.pen(image)
    draw.rounded_rectangle([8, 8, width - 9, height - 9], radius=30, outline=ink, width=9)
    first, _, rest = plate_text(seed).partition(" ")
    lines = (f"{first} {rest}",) if rows == 1 else (first, rest)
    pitch = height / rows
    for k, line in enumerate(lines):
        _write(draw, line, ink, width, k * pitch, pitch)
    return art.resize_texture(image, *_SIZE_PX[rows])


def _write(
    draw: ImageDraw, line: str, ink: art.Color, width: int, top: float, height: float
) -> None:
    """Glyphs in the middle of a row; a space is half as wide as a glyph."""
    tall = _GLYPH_SHARE * height
    advances = [0.5 if letter == " " else 1.0 for letter in line]
    pitch = min(0.85 * tall, 0.88 * width / sum(advances))
    x = 0.5 * (width - pitch * sum(advances))
    unit = (0.66 * pitch / 4.0, tall / 6.0)
    pen_px = _STROKE * min(unit)
    bottom = top + 0.5 * (height + tall)
    for letter, advance in zip(line, advances, strict=True):
        for stroke in _strokes(letter):
            path = [(x + 0.17 * pitch + u * unit[0], bottom - v * unit[1]) for u, v in stroke]
            draw.line(path, fill=ink, width=round(pen_px))
            for px, py in path:
                r = 0.5 * pen_px
                draw.ellipse([px - r, py - r, px + r, py + r], fill=ink)
        x += pitch * advance


def _strokes(letter: str) -> Iterator[list[tuple[int, int]]]:
    for stroke in GLYPHS.get(letter, "").split(","):
        if stroke:
            yield [(int(point[0]), int(point[1])) for point in stroke.split()]


def _draw_character(place: str, rng: VariantRng) -> str:
    if place == " ":
        return place
    return rng.choose(_LETTERS if place == "L" else _DIGITS)
