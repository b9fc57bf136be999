"""Names above shops, all invented or plain words of the trade."""

from __future__ import annotations

from gen_data.generator.assets.procedural.material_presets import hex_to_srgb8
from gen_data.generator.assets.procedural.textures import artwork as art
from gen_data.generator.assets.procedural.variant_rng import choose, variant_rng
from gen_data.generator.core.asset_types import TextureData

_TRADES = (
    "BAKERY",
    "CAFE LINDEN",
    "PHARMACY",
    "FLOWERS",
    "BOOKS",
    "Optik Sander",
    "HAIR STUDIO",
    "KIOSK",
    "Pizzeria Oro",
    "BICYCLES",
    "Textil & Co",
    "TRAVEL",
)
_SCHEMES = (
    ("#7a2420", "#f3e9d2", "#d8b25a"),
    ("#2f4a3c", "#f4efe2", "#c9a45c"),
    ("#f2efe8", "#b3261e", "#b3261e"),
    ("#e9e4d6", "#3a3a3a", "#4f7a4a"),
    ("#22364f", "#ffffff", "#e0b040"),
    ("#33363a", "#e8e6e1", "#8fb3c9"),
    ("#d9a520", "#2a2119", "#7a2420"),
    ("#1f5f7a", "#ffffff", "#ffffff"),
)


def shop_sign(seed: int) -> TextureData:
    """A word on a coloured board about five times as wide as high."""
    rng = variant_rng("shop_sign", seed)
    ground, ink, line = (hex_to_srgb8(code) for code in choose(_SCHEMES, rng))
    image = art.canvas(1024, 200, ground)
    draw = art.pen(image)
    if choose((True, False), rng):
        draw.rectangle([14, 14, 1009, 185], outline=line, width=6)
    else:
        draw.rectangle([0, 176, 1024, 190], fill=line)
    art.text(image, (0.12, 0.18, 0.88, 0.8), _TRADES[seed % len(_TRADES)], ink, 1)
    return art.resize_texture(image, 512, 128)
