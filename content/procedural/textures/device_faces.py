"""Screens of telephones and letters on keys."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gen_data.assets.family import check_option
from gen_data.content.procedural.electronics import KEY_CELLS
from gen_data.content.procedural.textures import artwork as art
from gen_data.content.procedural.textures.artwork import Color
from gen_data.content.procedural.textures.texture_images import quantize
from gen_data.core.asset_types import TextureData
from gen_data.core.noise import fbm, smoothstep
from gen_data.core.variant_rng import VariantRng, variant_rng

if TYPE_CHECKING:
    from PIL.Image import Image

_BRIGHT: tuple[Color, ...] = (
    (52, 120, 246), (52, 199, 89), (255, 149, 0), (255, 59, 48), (175, 82, 222), (88, 86, 214),
    (255, 204, 0), (90, 200, 250), (240, 240, 245), (40, 40, 44),
)  # fmt: skip
_WORDS = ("Hi! Are you home?", "On my way", "See you at 8", "Can you get milk?", "Great photo!",
          "Call me later", "Train is late", "OK", "Happy birthday!", "Thanks a lot")  # fmt: skip


def phone_screen(seed: int, kind: str = "lit") -> TextureData:
    """A screen, its top towards the image's right: dark with fingerprints, or lit.

    Raises:
        AssetError: if there is no such kind.
    """
    check_option("phone_screen", "kind", kind, ("lit", "off"))
    rng = variant_rng(f"phone_screen/{kind}", seed)
    if kind == "off":
        smudge = smoothstep(
            0.1, 1.1, fbm((3, 3), 3, rng, size_px=256) + 0.5 * fbm((24, 12), 1, rng, size_px=256)
        )
        smudge = np.repeat(np.repeat(smudge, 2, axis=0), 2, axis=1)
        albedo = np.full((512, 512, 3), 0.045, np.float32) + 0.02 * smudge[..., None]
        return TextureData(quantize(albedo), quantize(0.15 + 0.7 * smudge))
    make = rng.choose((_home, _home, _chat, _lock, _map, _page))
    image = art.turn(make(rng), -1)
    made = art.resize_texture(image, 512, 512)
    dark: TextureData = TextureData((made.albedo // 12 + 9).astype(np.uint8), emission=made.albedo)
    return dark


def _wallpaper(rng: VariantRng) -> Image:
    image = art.canvas(280, 600, (20, 20, 24))
    top, bottom = rng.shuffled(_BRIGHT)[:2]
    art.gradient(image, art.blend(top, (20, 20, 30), 0.4), art.blend(bottom, (10, 10, 20), 0.3))
    for _ in range(3):
        r, x, y = rng.between(40, 160), rng.between(0, 280), rng.between(0, 600)
        art.pen(image).ellipse(
            [x - r, y - r, x + r, y + r], fill=art.blend(bottom, top, rng.between(0, 1))
        )
    return image


def _home(rng: VariantRng) -> Image:
    """A grid of symbols."""
    image = _wallpaper(rng)
    pen = art.pen(image)
    rows = int(rng.between(3, 7))
    for row in (*range(rows), 8.4):
        for column in range(4):
            x, y = 16 + 64 * column, 50 + 60 * row
            fill, ink = rng.shuffled(_BRIGHT)[:2]
            pen.rounded_rectangle([x, y, x + 46, y + 46], radius=11, fill=fill)
            kind = rng.choose(("disc", "bar", "tick"))
            if kind == "disc":
                pen.ellipse([x + 13, y + 13, x + 33, y + 33], fill=ink)
            elif kind == "bar":
                pen.rectangle([x + 11, y + 18, x + 35, y + 29], fill=ink)
            else:
                pen.line([(x + 12, y + 24), (x + 21, y + 33), (x + 35, y + 13)], fill=ink, width=5)
    return image


def _lock(rng: VariantRng) -> Image:
    image = _wallpaper(rng)
    time = f"{int(rng.between(6, 23))}:{int(rng.between(10, 59))}"
    art.text(image, (0.15, 0.14, 0.85, 0.26), time, (250, 250, 250), 1)
    art.text(image, (0.3, 0.28, 0.7, 0.31), "Monday, 4 May", (240, 240, 240), 0)
    return image


def _chat(rng: VariantRng) -> Image:
    image = art.canvas(280, 600, rng.choose(((250, 250, 252), (18, 18, 20), (229, 221, 213))))
    pen, y = art.pen(image), 70
    pen.rectangle([0, 0, 280, 52], fill=rng.choose(((7, 94, 84), (240, 240, 244), (40, 60, 90))))
    while y < 520:
        mine, high = rng.chance(0.5), rng.choose((34, 34, 62))
        left = int(rng.between(70, 130)) if mine else 12
        right = 268 if mine else int(rng.between(150, 220))
        fill = (52, 120, 246) if mine else (229, 229, 234)
        pen.rounded_rectangle([left, y, right, y + high], radius=14, fill=fill)
        ink = (255, 255, 255) if mine else (20, 20, 20)
        box = ((left + 10) / 280, (y + 8) / 600, (right - 10) / 280, (y + 26) / 600)
        art.text(image, box, rng.choose(_WORDS), ink, 0)
        y += high + 12
    return image


def _map(rng: VariantRng) -> Image:
    image = art.canvas(280, 600, (240, 238, 230))
    pen = art.pen(image)
    water = [(rng.between(0, 280), rng.between(0, 600)) for _ in range(5)]
    pen.polygon(water, fill=(170, 211, 223))
    for _ in range(14):
        a = (rng.between(-40, 320), rng.between(-40, 640))
        turn, reach = rng.choose((0.3, 1.87)) + rng.between(-0.1, 0.1), 500.0
        step = (reach * math.cos(turn), reach * math.sin(turn))
        ends = [(a[0] - step[0], a[1] - step[1]), (a[0] + step[0], a[1] + step[1])]
        options = ((255, 255, 255), (255, 255, 255), (252, 214, 164))
        pen.line(ends, fill=rng.choose(options), width=rng.choose((5, 9)))
    route = [(140.0, 560.0), (150.0, 420.0), (90.0, 300.0), (190.0, 120.0)]
    pen.line(route, fill=(66, 133, 244), width=8)
    pen.ellipse([180, 106, 204, 130], fill=(219, 68, 55))
    return image


def _page(rng: VariantRng) -> Image:
    image = art.canvas(280, 600, (252, 252, 252))
    art.text(image, (0.06, 0.08, 0.9, 0.13), rng.choose(_WORDS), (20, 20, 20), 2)
    scene = art.canvas(250, 150, rng.choose(_BRIGHT))
    art.gradient(scene, (140, 190, 230), rng.choose(_BRIGHT))
    image.paste(scene, (15, 95))
    words = " ".join(rng.shuffled(_WORDS)).split()
    art.lines(image, (0.06, 0.45, 0.94, 0.95), (60, 60, 64), (252, 252, 252), words)
    return image


_KEYS = (
    *("Esc", *"1234567890-=", "Bksp", "Tab", *"QWERTYUIOP[]", "Entr", "Caps", *"ASDFGHJKL;'"),
    *("Shft", *"ZXCVBNM,./", "Up", "Fn", "Ctrl", "Alt", "F1", "F2", "F3", "F4", "F5", "F6"),
    *("Home", "End"),
)


def key_legends(seed: int, kind: str = "dark") -> TextureData:
    """Letters of keys in a grid of cells; on dark or light keys.

    Raises:
        AssetError: if there is no such kind.
    """
    check_option("key_legends", "kind", kind, ("dark", "light"))
    rng = variant_rng(f"key_legends/{kind}", seed)
    shade = int(rng.between(22, 52)) if kind == "dark" else int(rng.between(196, 238))
    ground = (shade, shade, shade + 2)
    ink = (232, 232, 232) if kind == "dark" else (48, 50, 54)
    image, cell = art.canvas(512, 512, ground), 512 // KEY_CELLS
    for i in range(KEY_CELLS * KEY_CELLS):
        x, y = i % KEY_CELLS * cell, i // KEY_CELLS * cell
        word = _KEYS[i % len(_KEYS)]
        high = 0.38 if len(word) == 1 else 0.24
        box = (x + 0.24 * cell, y + 0.16 * cell, x + 0.76 * cell, y + (0.16 + high) * cell)
        a, b, c, d = (v / 512 for v in box)
        art.text(image, (a, b, c, d), word, ink, 1)
    return art.resize_texture(image, 512, 512)
