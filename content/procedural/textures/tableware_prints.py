"""Patterns on cups, bowls and vases, prints of paper cups, and the froth of drinks.

Patterns belong to one object: u runs around it, v from foot to rim. Froth lies on a disc: u runs
around its middle, v from the wall (0) to the middle (1).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from gen_data.assets.family import check_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural.material_presets import PALETTES, hex_to_srgb8
from gen_data.content.procedural.textures import artwork as art
from gen_data.content.procedural.textures.artwork import Color
from gen_data.content.procedural.textures.pictures import Manner, picture
from gen_data.content.procedural.textures.texture_images import color, mix_colors, quantize
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import smoothstep
from gen_data.core.variant_rng import VariantRng, variant_rng

if TYPE_CHECKING:
    from PIL.Image import Image

# A mug's wall is about 2.8 times as long as it is high.
_WIDTH_PX, _HEIGHT_PX = 720, 256
_WORDS = load_table(__package__, "tableware_prints", tuple[str, ...])
_WHITE: Color = (244, 241, 234)
_CLAY: Color = (176, 138, 104)
# Probability that the ground is white (assumed); the others have one of _GROUNDS, else a glaze.
_WHITE_SHARES = {"bands": 0.5, "rim": 0.8, "dots": 0.4, "motif": 0.75, "logo": 0.6, "words": 0.7,
                 "willow": 1.0, "brand": 0.6, "photograph": 0.7, "cartoon": 0.6,
                 "lines": 0.8}  # fmt: skip
_GROUNDS = {"speckled": (*_WORDS["creams"], *_WORDS["creams"], "#2d4f7c", "#3d6b5c"),
            "brand": (*_WORDS["creams"], *_WORDS["inks"]),
            "wrap": (*_WORDS["creams"], *_WORDS["inks"])}  # fmt: skip
# Factor on the roughness of raw clay where it is glazed.
_GLAZED = 0.22


def ceramic_decor(seed: int, kind: str = "bands") -> TextureData:
    """A painted, printed or glazed outside, 512 x 256; ``dip`` and ``drips`` have rough clay.

    Raises:
        AssetError: if there is no such kind.
    """
    check_option("ceramic_decor", "kind", kind, tuple(_DECORS))
    rng = variant_rng(f"ceramic_decor/{kind}", seed)
    image = _DECORS[kind](rng, decor_ground(seed, kind))
    made = art.resize_texture(image, 512, 256)
    if kind not in ("dip", "drips"):
        return made
    clay = np.abs(made.albedo.astype(np.float32) - np.array(_CLAY, dtype=np.float32))
    raw = smoothstep(60.0, 25.0, clay.sum(axis=2))
    return TextureData(made.albedo, quantize(np.float32(_GLAZED) + raw * np.float32(0.75)))


def decor_ground(seed: int, kind: str) -> Color:
    """The colour under a pattern, or of the glaze near the rim; handles have it too."""
    rng = variant_rng(f"ceramic_decor/{kind}/ground", seed)
    codes = _GROUNDS.get(kind, PALETTES["glazes"])
    return _WHITE if rng.chance(_WHITE_SHARES.get(kind, 0.0)) else hex_to_srgb8(rng.choose(codes))


def _ink(rng: VariantRng, ground: Color) -> Color:
    """A colour that stands out from the ground."""
    codes = rng.shuffled((*_WORDS["inks"], "#f4f1ea"))
    inks = [hex_to_srgb8(code) for code in codes]
    return next(i for i in inks if abs(art.brightness(i) - art.brightness(ground)) > 60)


def _bands(rng: VariantRng, ground: Color) -> Image:
    image = art.canvas(_WIDTH_PX, _HEIGHT_PX, ground)
    inks = [_ink(rng, ground) for _ in range(3)]
    y = rng.between(0.05, 0.35) * _HEIGHT_PX
    for i in range(int(rng.between(1, 7))):
        thick = rng.choose((3, 6, 10, 26, 60))
        art.pen(image).rectangle([0, y, _WIDTH_PX, y + thick], fill=inks[i % 3])
        y += thick + rng.choose((6, 12, 30))
    return image


def _rim(rng: VariantRng, ground: Color) -> Image:
    """A line around the rim, and sometimes around the foot."""
    image = art.canvas(_WIDTH_PX, _HEIGHT_PX, ground)
    ink, thick = _ink(rng, ground), rng.choose((7, 10, 16))
    gap = rng.choose((0, 0, 8))
    art.pen(image).rectangle([0, gap, _WIDTH_PX, gap + thick], fill=ink)
    if rng.chance(0.4):
        art.pen(image).rectangle([0, 240, _WIDTH_PX, 246], fill=ink)
    return image


def _speckled(rng: VariantRng, ground: Color) -> Image:
    """Iron spots in a pale glaze, or white ones in enamel."""
    spot = (240, 238, 230) if art.brightness(ground) < 120.0 else (92, 70, 50)
    image = art.canvas(_WIDTH_PX, _HEIGHT_PX, ground)
    pen = art.pen(image)
    for _ in range(int(rng.between(250, 700))):
        x, y = rng.between(0, _WIDTH_PX), rng.between(0, _HEIGHT_PX)
        r = 0.5 + 1.8 * rng.between(0.0, 1.0) ** 3
        fill = art.blend(ground, spot, rng.between(0.3, 0.9))
        pen.ellipse([x - r, y - 0.8 * r, x + r, y + 0.8 * r], fill=fill)
    if rng.chance(0.5):
        pen.rectangle([0, 0, _WIDTH_PX, 7], fill=art.blend(ground, (96, 60, 34), 0.8))
    return image


def _dots(rng: VariantRng, ground: Color) -> Image:
    image = art.canvas(_WIDTH_PX, _HEIGHT_PX, ground)
    inks = [_ink(rng, ground) for _ in range(rng.choose((1, 1, 3)))]
    count = rng.choose((8, 10, 12, 16))
    pitch = _WIDTH_PX / count
    r = pitch * rng.between(0.16, 0.34)
    for row in range(int(_HEIGHT_PX / pitch) + 2):
        for i in range(-1, count + 1):
            x, y = (i + 0.5 * (row % 2)) * pitch, row * pitch
            fill = inks[(row + i % count) % len(inks)]
            art.pen(image).ellipse([x - r, y - r, x + r, y + r], fill=fill)
    return image


def _motif(rng: VariantRng, ground: Color) -> Image:
    """Flowers, leaves or fruit, scattered or in a row."""
    image = art.canvas(_WIDTH_PX, _HEIGHT_PX, ground)
    kind, petal = rng.choose(("flower", "leaf", "fruit")), _ink(rng, ground)
    count, rows = rng.choose((6, 8, 10)), rng.choose((1, 2, 2))
    size = rng.between(0.26, 0.4) * min(_WIDTH_PX / count, _HEIGHT_PX / rows)
    for row in range(rows):
        for i in range(-1, count + 1):
            x = (i + 0.5 * (row % 2) + 0.5) * _WIDTH_PX / count
            y = (row + 0.5) * _HEIGHT_PX / rows
            _draw_motif(image, kind, (x, y), size, petal)
    if rng.chance(0.5):
        for y in (2, _HEIGHT_PX - 8):
            art.pen(image).rectangle([0, y, _WIDTH_PX, y + 6], fill=petal)
    return image


def _draw_motif(image: Image, kind: str, at: art.Place, size: float, ink: Color) -> None:
    pen, (x, y), green = art.pen(image), at, (74, 128, 70)
    if kind == "fruit":
        art.fruit(pen, at, 0.7 * size, ink)
        return
    petals = 7 if kind == "flower" else 5
    if kind == "flower":
        art.leaf(pen, at, (x + 1.1 * size, y + 1.3 * size), green)
        art.leaf(pen, at, (x - 1.1 * size, y + 1.3 * size), green)
    for i in range(petals):
        turn = 2.0 * math.pi * i / petals if kind == "flower" else math.pi * (1 + i / 4)
        tip = x + size * math.cos(turn), y + size * math.sin(turn)
        art.leaf(pen, at, tip, ink if kind == "flower" else art.blend(ink, green, 0.4))
    if kind == "flower":
        r = 0.25 * size
        pen.ellipse([x - r, y - r, x + r, y + r], fill=(240, 200, 70))


def _logo(rng: VariantRng, ground: Color) -> Image:
    """An emblem with a name on both sides."""
    image = art.canvas(_WIDTH_PX, _HEIGHT_PX, ground)
    ink, second = _ink(rng, ground), _ink(rng, ground)
    name = rng.choose(_WORDS["firms"])
    emblem = rng.choose(("disc", "ring", "hill", "leaf", "bars"))
    for middle in (0.25, 0.75):
        x, y, r = middle * _WIDTH_PX, 96.0, rng.choose((40.0, 48.0))
        _emblem(image, emblem, (x, y), r, (ink, second))
        box = (middle - 0.15, 0.62, middle + 0.15, 0.76)
        art.text(image, box, name, ink, 2)
    return image


def _emblem(image: Image, kind: str, at: art.Place, r: float, inks: tuple[Color, Color]) -> None:
    pen, (x, y) = art.pen(image), at
    disc = [x - r, y - r, x + r, y + r]
    if kind == "leaf":
        art.leaf(pen, (x - r, y + r), (x + r, y - r), inks[0])
        art.leaf(pen, (x, y + 0.8 * r), (x + 0.2 * r, y - 0.6 * r), inks[1])
    elif kind == "bars":
        for i, share in enumerate((0.5, 0.9, 0.7)):
            left = x + (i - 1.4) * 0.65 * r
            pen.rectangle([left, y + r - 2 * share * r, left + 0.5 * r, y + r], fill=inks[i % 2])
    elif kind == "ring":
        pen.ellipse(disc, outline=inks[0], width=9)
        pen.polygon([(x, y - 0.6 * r), (x + 0.5 * r, y + 0.4 * r), (x - 0.5 * r, y + 0.4 * r)],
                    fill=inks[1])  # fmt: skip
    else:
        pen.ellipse(disc, fill=inks[0])
        if kind == "hill":
            pen.pieslice([x - r, y - 0.4 * r, x + r, y + 1.6 * r], 200, 340, fill=inks[1])


def _words(rng: VariantRng, ground: Color) -> Image:
    """Two lines of a saying on both sides."""
    image = art.canvas(_WIDTH_PX, _HEIGHT_PX, ground)
    ink = _ink(rng, ground)
    first, second = rng.choose(_WORDS["sayings"]).split("|")
    for middle in (0.25, 0.75):
        art.text(image, (middle - 0.16, 0.24, middle + 0.16, 0.48), first, ink, rng.choose((1, 4)))
        art.text(image, (middle - 0.16, 0.52, middle + 0.16, 0.78), second, ink, 3)
    return image


def _edge(rng: VariantRng, level: float, sway: float, waves: tuple[int, ...]) -> list[art.Place]:
    """A wavy line around the wall that closes, from left to right [px]."""
    parts = [(k, rng.between(0.0, 6.3), sway * rng.between(0.4, 1.0) / (1 + i))
             for i, k in enumerate(waves)]  # fmt: skip
    return [
        (x, level + sum(a * math.sin(2 * math.pi * k * x / _WIDTH_PX + p) for k, p, a in parts))
        for x in range(0, _WIDTH_PX + 1, 4)
    ]


def _dip(rng: VariantRng, ground: Color) -> Image:
    """Raw clay below, glaze above a wavy edge."""
    image = art.canvas(_WIDTH_PX, _HEIGHT_PX, _CLAY)
    level = _HEIGHT_PX * rng.choose((0.25, 0.55, 0.75, 0.9))
    edge = _edge(rng, level, rng.choose((2.0, 8.0, 16.0)), (2, 3, 7))
    art.pen(image).polygon([(0, 0), *edge, (_WIDTH_PX, 0)], fill=ground)
    line = art.blend(ground, (60, 40, 24), 0.35)
    art.pen(image).line(edge, fill=line, width=3)
    return image


def _drips(rng: VariantRng, ground: Color) -> Image:
    """Two glazes, the upper running down in tongues."""
    upper, lower = ground, _ink(rng, ground)
    image = art.canvas(_WIDTH_PX, _HEIGHT_PX, lower)
    art.gradient(image, art.blend(lower, upper, 0.25), lower)
    edge = _edge(rng, _HEIGHT_PX * rng.between(0.25, 0.5), 20.0, (3, 11, 17))
    art.pen(image).polygon([(0, 0), *edge, (_WIDTH_PX, 0)], fill=upper)
    for shade in (0.5, 0.25):
        moved = [(x, y - 26 * shade) for x, y in edge]
        art.pen(image).line(moved, fill=art.blend(upper, lower, shade), width=5)
    return image


def _willow(rng: VariantRng, ground: Color) -> Image:
    """Blue brushwork on white: lattice borders, branches, waves."""
    blue = hex_to_srgb8(rng.choose(("#1f3f86", "#2a5298", "#3b4f7a")))
    image = art.canvas(_WIDTH_PX, _HEIGHT_PX, ground)
    pen = art.pen(image)
    pale = art.blend(ground, blue, 0.35)
    for left in range(-40, _WIDTH_PX + 40, 15):
        pen.line([(left, 4), (left + 26, 36)], fill=blue, width=2)
        pen.line([(left + 26, 4), (left, 36)], fill=blue, width=2)
    for y in (2, 38, 246):
        pen.rectangle([0, y, _WIDTH_PX, y + 4], fill=blue)
    for i in range(-1, 7):
        x, top = i * 120 + rng.between(0, 30), rng.between(100, 150)
        pen.arc([x - 60, top - 50, x + 90, top + 90], 190, 330, fill=blue, width=4)
        for k in range(7):
            turn = rng.between(0.0, 6.3)
            tip = x + 40 * k / 3 - 20, top + 24 * math.sin(turn)
            art.leaf(pen, tip, (tip[0] + 20 * math.cos(turn), tip[1] + 20 * math.sin(turn)), blue)
        for k in range(3):
            wave = [x - 50, 185 + 16 * k, x + 60, 225 + 16 * k]
            pen.arc(wave, 200, 340, fill=pale, width=3)
    return image


def _brand(rng: VariantRng, ground: Color) -> Image:
    """A coffee shop's cup: emblem and name, a band below or a plain ground."""
    image = _logo(rng, ground)
    if rng.chance(0.5):
        fill = hex_to_srgb8(rng.choose(_WORDS["inks"]))
        art.pen(image).rectangle([0, 205, _WIDTH_PX, _HEIGHT_PX], fill=fill)
    return image


def _wrap(rng: VariantRng, ground: Color) -> Image:
    """Printed all over: zigzags or slanting stripes."""
    image, ink = art.canvas(_WIDTH_PX, _HEIGHT_PX, ground), _ink(rng, ground)
    steps, slant = rng.choose((12, 18, 24)), rng.choose((0, 60, 120))
    pitch = _WIDTH_PX / steps
    for i in range(-3, steps + 3):
        x = i * pitch
        foot = [(x, _HEIGHT_PX), (x + 0.45 * pitch, _HEIGHT_PX)]
        top = [(x + 0.45 * pitch + slant, 0), (x + slant, 0)]
        art.pen(image).polygon([*foot, *top], fill=ink)
    art.panel(image, (0.36, 0.3, 0.64, 0.7), ground)
    art.text(image, (0.38, 0.36, 0.62, 0.64), rng.choose(_WORDS["firms"]), ink, 3)
    return image


def _pictures(manner: Manner) -> Callable[[VariantRng, Color], Image]:
    """A maker of a picture on both sides of the handle, or of one all around."""

    def make(rng: VariantRng, ground: Color) -> Image:
        image = art.canvas(_WIDTH_PX, _HEIGHT_PX, ground)
        if rng.chance(0.25):
            image.paste(picture(_WIDTH_PX, _HEIGHT_PX - 24, ground, rng, manner), (0, 12))
            return image
        side = rng.choose((150, 190, 220))
        panel = picture(rng.choose((side, int(1.25 * side))), side, ground, rng, manner)
        words = rng.chance(0.4)
        line, ink = " ".join(rng.choose(_WORDS["sayings"]).split("|")), _ink(rng, ground)
        for middle in (0.25, 0.75):
            left = int(middle * _WIDTH_PX) - panel.width // 2
            image.paste(panel, (left, (_HEIGHT_PX - side) // 2 - (14 if words else 0)))
            if words:
                box = (middle - 0.16, 0.88, middle + 0.16, 0.98)
                art.text(image, box, line, ink, 1)
        return image

    return make


_DECORS: Mapping[str, Callable[[VariantRng, Color], Image]] = {
    "bands": _bands, "rim": _rim, "speckled": _speckled, "dots": _dots, "motif": _motif,
    "logo": _logo, "words": _words, "dip": _dip, "drips": _drips, "willow": _willow,
    "brand": _brand, "wrap": _wrap, "photograph": _pictures("photograph"),
    "cartoon": _pictures("cartoon"), "lines": _pictures("lines"),
}  # fmt: skip

_FROTH = {"coffee": ("#1d0e06", "#6a4222"), "crema": ("#7a4a1e", "#b98042"),
          "latte": ("#a3713f", "#f0e3cc")}  # fmt: skip


def drink_surface(seed: int, kind: str = "latte") -> TextureData:
    """The top of a hot drink, 512 x 256: bubbles at the wall, marbled crema, figures in foam.

    Raises:
        AssetError: if there is no such kind.
    """
    check_option("drink_surface", "kind", kind, tuple(_FROTH))
    rng = variant_rng(f"drink_surface/{kind}", seed)
    dark, light = (color(code) for code in _FROTH[kind])
    r = ((np.arange(256) + 0.5) / 256)[:, None].astype(np.float32)
    turn = (2 * math.pi * (np.arange(512) + 0.5) / 512)[None, :].astype(np.float32)
    # The lowest row is at the wall.
    x, y = r * np.cos(turn), r * np.sin(turn)
    swirl = np.zeros_like(x)
    for k in range(1, 7):
        ax, ay, phase = (rng.between(-1.0, 1.0) for _ in range(3))
        swirl += (
            np.sin(3.5 * k**0.7 * (ax * x + ay * y) + 1.3 * np.roll(swirl, 9, 1) + 6 * phase) / k
        )
    share = {"coffee": 0.12, "crema": 0.5, "latte": 0.1}[kind] + 0.14 * swirl
    if kind == "latte":
        share = np.maximum(share, _figure(x, y, rng))
    wall = smoothstep(0.93, 0.99, r + 0.012 * swirl)
    share = np.maximum(share, wall * (0.75 if kind == "coffee" else 0.5))
    albedo = mix_colors(dark, light, np.clip(share, 0.0, 1.0))
    return TextureData(quantize(_bubbles(albedo, light, rng)))


def _figure(x: Float32, y: Float32, rng: VariantRng) -> Float32:
    """A heart, a leaf, a ring or plain foam, poured with milk: 1 where it is white."""
    kind = rng.choose(("heart", "leaf", "leaf", "rings", "foam"))
    away = np.hypot(x, y - 0.1)
    u, v = 1.5 * x, 1.5 * (y + 0.12)
    shape: Float32 = smoothstep(0.05, -0.05, (u * u + v * v - 0.7) ** 3 - 2.2 * u * u * v**3)
    if kind == "foam":
        shape = smoothstep(0.9, 0.8, np.hypot(x, y))
    elif kind == "rings":
        shape = smoothstep(0.0, 0.5, np.sin(26 * away)) * smoothstep(0.7, 0.6, away)
    elif kind == "leaf":
        ribs = np.sin(24 * (y - 0.55 * np.abs(x))) + 0.5 * (np.abs(x) < 0.02)
        inside = np.abs(x) - 0.55 * np.sqrt(np.clip(0.62 - y * y, 0, 1))
        shape = smoothstep(-0.1, 0.3, ribs) * smoothstep(0.04, -0.04, inside)
    return shape


def _bubbles(albedo: Float32, light: Float32, rng: VariantRng) -> Float32:
    made: Float32 = albedo.copy()
    for _ in range(int(rng.between(30, 160))):
        row = int(255 - 40 * rng.between(0.0, 1.0) ** 2)
        column, size = int(rng.between(0, 508)), rng.choose((1, 2, 3))
        patch = made[max(0, row - size) : row + 1, column : column + size]
        patch += np.float32(0.35) * (light - patch)
    return made
