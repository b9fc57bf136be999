"""Asset family of striped textures."""

import numpy as np

from gen_data.assets.family import Provenance, TextureFamily
from gen_data.core.asset_types import TextureData


def stripes(seed: int) -> TextureData:
    """Draw vertical stripes in two shades of red; their number grows with the seed."""
    columns = np.arange(64) * (seed + 1) // 16 % 2
    row = np.where(columns[:, None] == 1, [200, 40, 40], [90, 20, 20]).astype(np.uint8)
    return TextureData(np.ascontiguousarray(np.broadcast_to(row, (64, 64, 3))))


STRIPES = TextureFamily(
    name="stranger_stripes",
    tags=("stranger_pattern",),
    variants=2,
    version=1,
    build=stripes,
    origin=Provenance("CC0-1.0", "A stranger", "stranger"),
)
