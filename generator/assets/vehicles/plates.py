"""Licence plates: letters and digits of straight strokes, in a format that no country has.

Glyphs stand on a grid of 4 by 6. Letters that are easily taken for digits are left out, as many
countries do.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from gen_data.generator.assets.procedural.material_presets import hex_to_srgb8
from gen_data.generator.assets.procedural.textures import artwork as art
from gen_data.generator.assets.procedural.variant_rng import choose, variant_rng
from gen_data.generator.core.asset_types import TextureData
from gen_data.generator.core.streams import Rng

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

SEEDS = 500
"""Plates that vehicles draw from; others can be asked for."""
FAMILY = "texture/licence_plate"

# Strokes of each glyph; two digits are a point: x to the right, y up.
GLYPHS = {
    "A": "00 26 40,12 32", "B": "00 06 36 45 44 33 03,33 42 41 30 00",
    "C": "45 36 16 05 01 10 30 41", "D": "00 06 36 45 41 30 00", "E": "46 06 00 40,03 33",
    "F": "46 06 00,03 33", "G": "45 36 16 05 01 10 30 41 43 23", "H": "06 00,46 40,03 43",
    "J": "46 41 30 10 01", "K": "06 00,46 02,24 40", "L": "06 00 40", "M": "00 06 23 46 40",
    "N": "00 06 40 46", "P": "00 06 36 45 44 33 03", "R": "00 06 36 45 44 33 03,23 40",
    "S": "45 36 16 05 04 13 33 42 41 30 10 01", "T": "06 46,26 20", "U": "06 01 10 30 41 46",
    "V": "06 20 46", "W": "06 10 24 30 46", "X": "06 40,46 00", "Y": "06 23 46,23 20",
    "Z": "06 46 00 40",
    "0": "05 01 10 30 41 45 36 16 05", "1": "04 26 20", "2": "05 16 36 45 44 00 40",
    "3": "05 16 36 45 44 33 42 41 30 10 01,13 33", "4": "30 36 02 42",
    "5": "46 06 03 33 42 41 30 10 01", "6": "45 36 16 05 01 10 30 41 42 33 03",
    "7": "06 46 10", "8": "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33",
    "9": "01 10 30 41 45 36 16 05 04 13 43",
}  # fmt: skip
_LETTERS = "ABCDEFGHJKLMNPRSTUVWXYZ"
_DIGITS = "0123456789"
_PATTERNS = ("LL DDDD", "LLL DDD", "DD LLL D", "L DDD LL", "LL DD LL")
_SCHEMES = (
    ("#f1f1ec", "#17181a"),
    ("#f1f1ec", "#17181a"),
    ("#f1f1ec", "#1a3f7a"),
    ("#f0c419", "#17181a"),
    ("#eef2ee", "#1d6b3a"),
)
# Plates of cars are 0.52 m by 0.11 m, those of motorcycles 0.18 m by 0.15 m, in two rows.
_DRAWN_PX = {1: (1300, 275), 2: (600, 500)}
_SIZE_PX = {1: (256, 64), 2: (128, 128)}
_GLYPH_SHARE = 0.62
_STROKE = 0.95


def plate_text(seed: int) -> str:
    """What stands on a plate; groups are separated by a space."""
    rng = variant_rng("licence_plate", seed)
    pattern = choose(_PATTERNS, rng)
    return "".join(_drawn(place, rng) for place in pattern)


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
        hex_to_srgb8(c) for c in choose(_SCHEMES, variant_rng("licence_plate/colors", seed))
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


def _drawn(place: str, rng: Rng) -> str:
    if place == " ":
        return place
    return choose(_LETTERS if place == "L" else _DIGITS, rng)
