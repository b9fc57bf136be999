"""Skin of hands and arms: blood, pores, creases of joints.

Kind ``hand`` is an atlas: its left half is the palm, u across it and v from the wrist to the
fingers; its right half is a finger, v from its foot (0) over its joints (1/3, 2/3) to its tip.
Kind ``arm`` tiles.
"""

import numpy as np

from gen_data.assets.family import check_option
from gen_data.content.procedural.textures.texture_images import texture
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import SIZE_PX, fbm, rows_and_columns, smoothstep, worley
from gen_data.core.variant_rng import VariantRng, variant_rng

# Creases of the middle and the end joint: place along the finger, depth.
_CREASES = (
    (0.305, 0.5),
    (0.326, 0.9),
    (0.342, 1.0),
    (0.362, 0.6),
    (0.655, 0.8),
    (0.675, 0.9),
    (0.02, 0.5),
)
# Knuckles: place across the palm, and along it.
_KNUCKLES = ((0.36, 0.89), (0.265, 0.875), (0.17, 0.82), (0.09, 0.77))


def hand_skin(seed: int, kind: str = "hand") -> TextureData:
    """Factors on the colour of skin, 512 x 512, and its relief.

    Raises:
        AssetError: if there is no such kind.
    """
    check_option("hand_skin", "kind", kind, ("hand", "arm"))
    rng = variant_rng(f"hand_skin/{kind}", seed)
    blood = fbm((7, 7), 3, rng)
    pores = worley((72, 72), rng, 1.0).nearest
    spots = smoothstep(0.62, 0.9, fbm((34, 34), 1, rng)) * np.float32(rng.choose((0.02, 0.05, 0.1)))
    redness = 0.5 + 0.35 * blood
    shade = 0.93 + 0.03 * smoothstep(0.1, 0.6, pores) - spots
    height = 0.8 * pores + 0.5 * blood
    if kind == "hand":
        creases, flush = _joints(rng)
        redness = redness + flush
        shade = shade - 0.16 * creases
        height = height - 2.6 * creases
    warm = np.array([0.01, -0.085, -0.095], np.float32)
    albedo = shade[..., None] * (1.0 + np.clip(redness, 0.0, 1.6)[..., None] * warm)
    return texture(albedo.astype(np.float32), None, height.astype(np.float32), 0.7)


def _joints(rng: VariantRng) -> tuple[Float32, Float32]:
    """Depth of creases, and where blood shows: joints and fingertips."""
    down, x = rows_and_columns()
    y = np.float32(1.0) - down
    is_finger = np.asarray(x > 0.5, dtype=np.float32)
    wander = 0.008 * fbm((3, 9), 2, rng)
    creases = np.zeros((SIZE_PX, SIZE_PX), np.float32)
    for place, depth in _CREASES:
        bow = np.float32(rng.between(-0.02, 0.02)) * (4.0 * (x - 0.75)) ** 2
        line = np.exp(-(((y - place - bow + wander) / 0.0045) ** 2))
        creases = np.maximum(creases, np.float32(depth) * line)
    flush = 0.7 * smoothstep(0.74, 0.98, y) + 0.35 * np.exp(-(((y - 0.335) / 0.05) ** 2))
    knuckles = np.zeros_like(creases)
    for at_x, at_y in _KNUCKLES:
        knuckles += np.exp(-(((x - at_x) / 0.035) ** 2) - ((y - at_y) / 0.05) ** 2)
    wrinkles = np.abs(fbm((60, 14), 1, rng)) < 0.07
    palm = 0.4 * knuckles * wrinkles
    of_palm = np.float32(1.0) - is_finger
    relief: Float32 = np.asarray(is_finger * creases + of_palm * palm, dtype=np.float32)
    blood: Float32 = np.asarray(is_finger * flush + 0.5 * of_palm * knuckles, dtype=np.float32)
    return relief, blood
