"""Skin in the ten tones of Monk's scale."""

from gen_data.config.data_files import load_table
from gen_data.content.procedural.material_presets import hex_to_linear, jitter_color
from gen_data.core import se3, variant_rng

SKIN = load_table(__package__, "skin_tones", tuple[str, ...])
TONES = len(SKIN["monk"])


def skin_color(tone: int, rng: variant_rng.VariantRng) -> se3.Vec3:
    """Linear RGB of bare skin.

    The scale's swatches are lighter than skin, whose lightest tones reflect some six tenths of the
    light, and blood makes skin redder than makeup; both corrections are assumed.

    Args:
        tone: Index of the tone, from 0, the lightest, to ``TONES - 1``.
        rng: Draws how it differs from the swatch.
    """
    r, g, b = jitter_color(hex_to_linear(SKIN["monk"][tone]), 0.06, rng)
    share = 1.0 / (1.0 + 0.55 * g)
    return (min(1.0, 1.1 * share * r), 0.94 * share * g, 0.82 * share * b)
