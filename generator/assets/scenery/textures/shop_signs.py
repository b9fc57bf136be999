"""Names above shops, all invented or plain words of the trade."""

from __future__ import annotations

from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.assets.procedural.material_presets import hex_to_srgb8
from gen_data.generator.assets.procedural.textures import artwork as art
from gen_data.generator.assets.procedural.variant_rng import in_turn, variant_rng
from gen_data.generator.core.asset_types import TextureData

_WORDS = load_table(__package__, "shop_signs", tuple[str, ...])


def shop_sign(seed: int) -> TextureData:
    """A word on a coloured board about five times as wide as high."""
    rng = variant_rng("shop_sign", seed)
    ground, ink, line = (hex_to_srgb8(code) for code in rng.choose(_WORDS["schemes"]).split())
    image = art.canvas(1024, 200, ground)
    draw = art.pen(image)
    if rng.choose((True, False)):
        draw.rectangle([14, 14, 1009, 185], outline=line, width=6)
    else:
        draw.rectangle([0, 176, 1024, 190], fill=line)
    art.text(image, (0.12, 0.18, 0.88, 0.8), in_turn(_WORDS["trades"], seed), ink, 1)
    return art.resize_texture(image, 512, 128)
