"""Posters, advertisements and street names. All names are invented or plain words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from gen_data.config.data_files import load_table
from gen_data.content.procedural.material_presets import hex_to_srgb8
from gen_data.content.procedural.textures import artwork as art
from gen_data.core.asset_types import TextureData
from gen_data.core.variant_rng import VariantRng, in_turn

if TYPE_CHECKING:
    from PIL.Image import Image

    from gen_data.content.procedural.textures.artwork import Color

_WORDS = load_table(__package__, "posters", tuple[str, ...])


def poster(rng: VariantRng) -> TextureData:
    """A poster, upright, drawn at 1 to 1.41; 256 x 362."""
    colors = _colors(_WORDS["schemes"], rng.seed)
    image = art.canvas(512, 724, colors[0])
    (_skyline, _discs, _hills, _bottle)[rng.seed % 4](image, colors, rng)
    ink = colors[2]
    art.text(image, (0.06, 0.05, 0.94, 0.2), rng.choose(_WORDS["titles"]), ink, 3)
    art.text(image, (0.1, 0.8, 0.9, 0.88), rng.choose(_WORDS["lines"]), ink, 2)
    art.text(image, (0.2, 0.9, 0.8, 0.95), rng.choose(_WORDS["dates"]), ink, 1)
    if rng.chance(0.4):
        art.burst(image, (rng.between(0.2, 0.8), 0.34), 60, colors[1], ink)
    return art.resize_texture(image, 256, 362)


def wide_poster(rng: VariantRng) -> TextureData:
    """An advertisement for a hoarding, drawn at 1.41 to 1; 512 x 362."""
    colors = _colors(_WORDS["schemes"], rng.seed + 3)
    image = art.canvas(1024, 724, colors[0])
    (_hills, _skyline, _discs)[rng.seed % 3](image, colors, rng)
    x0, x1 = (0.04, 0.58) if rng.chance(0.5) else (0.42, 0.96)
    art.text(image, (x0, 0.08, x1, 0.34), rng.choose(_WORDS["brands"]), colors[2], 5)
    art.text(image, (x0, 0.38, x1, 0.48), rng.choose(_WORDS["lines"]), colors[2], 2)
    art.panel(image, (0.58, 0.86, 0.96, 0.96), colors[0])
    art.text(image, (0.6, 0.87, 0.94, 0.95), rng.choose(_WORDS["dates"]), colors[2], 2)
    return art.resize_texture(image, 512, 362)


def street_name(seed: int) -> TextureData:
    """A street's name on enamel, four times as wide as high; 256 x 64."""
    ground, ink = _colors(_WORDS["plates"], seed)
    image = art.canvas(1024, 256, ground)
    art.pen(image).rounded_rectangle([14, 14, 1009, 241], radius=24, outline=ink, width=8)
    art.text(image, (0.07, 0.22, 0.93, 0.78), in_turn(_WORDS["streets"], seed), ink, 2)
    return art.resize_texture(image, 256, 64)


def _colors(schemes: Sequence[str], seed: int) -> tuple[Color, ...]:
    return tuple(hex_to_srgb8(code) for code in in_turn(schemes, seed).split())


def _skyline(image: Image, colors: Sequence[Color], rng: VariantRng) -> None:
    art.gradient(image, colors[0], colors[1])
    (w, h), x = image.size, 0.0
    while x < w:
        wide, high = rng.between(0.06, 0.16) * w, rng.between(0.15, 0.42) * h
        shade = art.blend(colors[1], (20, 20, 24), rng.between(0.3, 0.8))
        art.pen(image).rectangle([x, 0.78 * h - high, x + wide, 0.78 * h], fill=shade)
        x += wide


def _discs(image: Image, colors: Sequence[Color], rng: VariantRng) -> None:
    w, h = image.size
    for k in range(7):
        r = (0.42 - 0.055 * k) * w
        x, y = w * rng.between(0.35, 0.65), h * rng.between(0.45, 0.6)
        fill = art.blend(colors[1], colors[k % 2 * 2], rng.between(0.0, 0.5))
        art.pen(image).ellipse([x - r, y - r, x + r, y + r], fill=fill)


def _hills(image: Image, colors: Sequence[Color], rng: VariantRng) -> None:
    w, h = image.size
    x, r = rng.between(0.2, 0.8) * w, 0.09 * w
    art.pen(image).ellipse([x - r, 0.36 * h - r, x + r, 0.36 * h + r], fill=colors[2])
    for k in range(4):
        phase, bend = rng.between(0.0, 6.0), rng.between(4.0, 9.0)
        top = [
            (px, h * (0.5 + 0.09 * k + 0.04 * math.sin(phase + bend * px / w)))
            for px in range(0, w + 8, 8)
        ]
        fill = art.blend(colors[1], (12, 30, 24), 0.2 * k)
        art.pen(image).polygon([(0, h), *top, (w, h)], fill=fill)


def _bottle(image: Image, colors: Sequence[Color], rng: VariantRng) -> None:
    w, h = image.size
    draw, x = art.pen(image), rng.between(0.35, 0.5) * w
    draw.rectangle([0, 0.66 * h, w, h], fill=art.blend(colors[0], (30, 20, 10), 0.35))
    glass = art.blend(colors[1], (10, 40, 20), 0.3)
    draw.rounded_rectangle([x - 60, 0.36 * h, x + 60, 0.72 * h], radius=40, fill=glass)
    draw.rectangle([x - 20, 0.24 * h, x + 20, 0.42 * h], fill=glass)
    draw.rectangle([x - 58, 0.5 * h, x + 58, 0.62 * h], fill=colors[2])
    for k in range(3):
        at = (x + 110 + 62 * k, 0.69 * h)
        art.fruit(draw, at, 36.0, art.blend(colors[1], (200, 60, 30), rng.between(0.3, 0.9)))
