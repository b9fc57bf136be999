"""Boards above shops, adverts on walls, and painted walls of the young.

Names are invented or plain words of a trade.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.procedural.material_presets import hex_to_srgb8
from gen_data.content.procedural.textures import artwork as art
from gen_data.core.asset_types import TextureData
from gen_data.core.noise import fbm, smoothstep
from gen_data.core.variant_rng import VariantRng

if TYPE_CHECKING:
    from PIL.Image import Image

BOARDS, ADVERTS = 4, 2
"""Boards above one another in ``shop_sign``; adverts along each side of ``wall_advert``."""
_WORDS = load_table(__package__, "shop_signs", tuple[str, ...])


def shop_sign(rng: VariantRng) -> TextureData:
    """Four boards above one another, each four times as wide as it is high."""
    sheet = art.canvas(1024, 1024, (0, 0, 0))
    for row in range(BOARDS):
        art.paste(sheet, _board(rng), (0, 256 * row))
    return _soiled(art.resize_texture(sheet, 512, 512), 0.06, rng)


def _board(rng: VariantRng) -> "Image":
    """One board: a name, and a frame, a line or a mark."""
    ground, ink, line = (hex_to_srgb8(code) for code in rng.choose(_WORDS["schemes"]).split())
    image = art.canvas(1024, 256, ground)
    draw = art.pen(image)
    look = rng.choose(("frame", "line", "plain", "mark", "mark", "halves"))
    left, right = 0.08, 0.92
    if look == "frame":
        draw.rectangle([18, 18, 1005, 237], outline=line, width=8)
    elif look == "line":
        draw.rectangle([0, 218, 1024, 236], fill=line)
    elif look == "mark":
        draw.ellipse([50, 48, 210, 208], fill=line)
        art.text(image, (0.075, 0.32, 0.18, 0.68), rng.choose(_WORDS["names"])[0], ground, 3)
        left = 0.24
    elif look == "halves":
        draw.rectangle([0, 0, 1024, int(rng.between(40, 70))], fill=line)
    text = rng.choose(_WORDS["patterns"]).format(
        name=rng.choose(_WORDS["names"]),
        trade=rng.choose(_WORDS["trades"]),
        number=1 + int(rng.random() * 98),
    )
    art.text(image, (left, 0.3, right, 0.78), text, ink, rng.choose((0, 1, 3, 5)))
    return image


def wall_advert(rng: VariantRng) -> TextureData:
    """Four square adverts: shapes in strong colours, a large word, small print."""
    sheet = art.canvas(1024, 1024, (0, 0, 0))
    for k in range(ADVERTS**2):
        art.paste(sheet, _advert(rng), (512 * (k % ADVERTS), 512 * (k // ADVERTS)))
    return _soiled(art.resize_texture(sheet, 512, 512), 0.12, rng)


def _advert(rng: VariantRng) -> "Image":
    ground, other, ink = (hex_to_srgb8(code) for code in rng.choose(_WORDS["boards"]).split())
    image = art.canvas(512, 512, ground)
    art.gradient(image, ground, other if rng.chance(0.5) else ground)
    draw = art.pen(image)
    for _ in range(rng.choose((1, 3, 5))):
        x, y, r = rng.between(40, 470), rng.between(150, 470), rng.between(40, 150)
        fill = art.blend(other, ink, rng.between(0.0, 0.5))
        corners = [(x + r * math.cos(t), y + r * math.sin(t)) for t in (0.4, 2.5, 4.6)]
        kind = rng.choose(("disc", "fruit", "bar", "triangle"))
        if kind == "disc":
            draw.ellipse([x - r, y - r, x + r, y + r], fill=fill)
        elif kind == "fruit":
            art.fruit(draw, (x, y), 0.7 * r, fill)
        elif kind == "bar":
            draw.rectangle([x - r, y - 0.3 * r, x + r, y + 0.3 * r], fill=fill)
        else:
            draw.polygon(corners, fill=fill)
    art.text(image, (0.06, 0.06, 0.94, 0.27), rng.choose(_WORDS["adverts"]), ink, 6)
    words = [rng.choose(_WORDS["adverts"]).capitalize() for _ in range(12)]
    art.lines(image, (0.08, 0.86, 0.7, 0.95), ink, ground, words)
    return image


def graffiti(rng: VariantRng) -> TextureData:
    """A painted piece: letters with outlines before a cloud of colour, over the whole image."""
    cloud, fill, edge = (hex_to_srgb8(code) for code in rng.choose(_PAINTS).split())
    image = art.canvas(1024, 512, cloud)
    draw = art.pen(image)
    for _ in range(40):
        x, y, r = rng.between(0, 1024), rng.between(0, 512), rng.between(20, 90)
        draw.ellipse([x - r, y - r, x + r, y + r], fill=art.blend(cloud, edge, rng.between(0, 0.2)))
    count = rng.choose((3, 4, 4, 5))
    for k in range(count):
        letter = "ABCEKMNORSTXZ"[int(13 * rng.random())]
        left, right = (k + 0.0) / count, (k + 1.15) / count
        low = rng.between(0.02, 0.12)
        for grow, paint, bold in ((0.0, edge, 26), (0.0, fill, 12)):
            art.text(image, (left + grow, low, min(right, 1.0), 0.95), letter, paint, bold)
    art.join(image, 2)
    for _ in range(14):
        x, y = rng.between(40, 980), rng.between(60, 440)
        draw.line([x, y, x + rng.between(-30, 30), y + 60], fill=(245, 245, 245), width=6)
    return _soiled(art.resize_texture(image, 512, 256), 0.1, rng)


_PAINTS = (
    "#3a8fc8 #e8e8ea #1a1a1c", "#c83a5a #f0c818 #1c1c2a", "#7a4a9c #8fd0c0 #201828",
    "#2e7d4f #e8e0c8 #14241a", "#e9722a #3a3a3c #f4f4f0", "#c8c8c8 #3a5fa8 #141414",
    "#1c1c1e #c8d0d4 #e8e8e8", "#e0b0c8 #5a8fd0 #2a1a3a",
)  # fmt: skip


def _soiled(clean: TextureData, amount: float, rng: VariantRng) -> TextureData:
    """The image with faint streaks of rain, of any size."""
    height, width = clean.albedo.shape[:2]
    streaks = smoothstep(0.1, 0.9, fbm((3, 24), 4, rng))[:height, :width]
    dirt = 1.0 - amount * streaks
    return TextureData(np.round(clean.albedo * dirt[..., None]).astype(np.uint8))
