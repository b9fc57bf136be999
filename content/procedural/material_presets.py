"""Materials of common surfaces: colour, roughness and metalness within their usual range.

Base colours are linear; the metals' are the reflectances at normal incidence that are usual in
the field (Karis, "Real shading in Unreal Engine 4", 2013; Hoffman, "Background: physics and math
of shading", 2015).
"""

from collections.abc import Sequence

from gen_data.config.data_files import load_table
from gen_data.core import colorimetry, variant_rng
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3

STEEL: Vec3 = (0.56, 0.57, 0.58)
STAINLESS: Vec3 = (0.66, 0.65, 0.63)
ALUMINIUM: Vec3 = (0.91, 0.92, 0.92)
ZINC: Vec3 = (0.66, 0.68, 0.70)

METALS = load_table(__package__, "metals", tuple[tuple[Vec3, float], ...])
PALETTES = load_table(__package__, "palettes", tuple[str, ...])
GLAZES, PLASTICS, CAPS, WOODS = (PALETTES[name] for name in ("glazes", "plastics", "caps", "woods"))


def hex_to_linear(code: str) -> Vec3:
    """Linear RGB of an sRGB colour ``#rrggbb`` (IEC 61966-2-1)."""
    r, g, b = (colorimetry.srgb_decode(int(code[i : i + 2], 16) / 255.0) for i in (1, 3, 5))
    return (r, g, b)


def hex_to_srgb8(code: str) -> tuple[int, int, int]:
    """8-bit channels of ``#rrggbb``."""
    r, g, b = (int(code[i : i + 2], 16) for i in (1, 3, 5))
    return (r, g, b)


def lighten(color: Vec3, amount: float) -> Vec3:
    """The colour mixed with white."""
    r, g, b = (c + (0.85 - c) * amount for c in color)
    return (r, g, b)


def jitter_color(color: Vec3, amount: float, rng: variant_rng.VariantRng) -> Vec3:
    """The colour with brightness and tint moved by up to the given fraction."""
    level = 1.0 + rng.between(-amount, amount)
    r, g, b = (
        min(1.0, max(0.0, c * level * (1.0 + rng.between(-0.3, 0.3) * amount))) for c in color
    )
    return (r, g, b)


def draw_linear(codes: Sequence[str], amount: float, rng: variant_rng.VariantRng) -> Vec3:
    """One of several sRGB colours, jittered; linear RGB."""
    return jitter_color(hex_to_linear(rng.choose(codes)), amount, rng)


def ceramic_material(rng: variant_rng.VariantRng, colors: Sequence[str] = GLAZES) -> Material:
    """Glazed stoneware or porcelain."""
    color = draw_linear(colors, 0.08, rng)
    return Material(base_color=color, roughness=rng.between(0.1, 0.3))


def plastic_material(rng: variant_rng.VariantRng, colors: Sequence[str] = PLASTICS) -> Material:
    """Injection-moulded plastic."""
    color = draw_linear(colors, 0.06, rng)
    return Material(base_color=color, roughness=rng.between(0.25, 0.5))


def metal_material(color: Vec3, roughness: float) -> Material:
    """A bare metal."""
    return Material(base_color=color, roughness=roughness, metallic=1.0)


def painted_material(color: str, roughness: float) -> Material:
    """A lacquered or painted surface of an sRGB colour."""
    return Material(base_color=hex_to_linear(color), roughness=roughness)


def printed_material(texture_id: str, roughness: float, metallic: float = 0.0) -> Material:
    """A label or cover: the texture belongs to the object and follows its UVs."""
    return Material((1.0, 1.0, 1.0), roughness, metallic, texture=texture_id, printed=True)


def patterned_material(
    texture_id: str, scale_m: float, roughness: float, color: Vec3 = (1.0, 1.0, 1.0)
) -> Material:
    """A material texture projected along the axes, one repeat per ``scale_m``."""
    return Material(color, roughness, texture=texture_id, texture_scale_m=scale_m)
