"""Conversion of floating-point colours and heights to the 8-bit images of a texture."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.content.procedural.material_presets import PALETTES, hex_to_srgb8
from gen_data.core.asset_types import Float32, TextureData, UInt8
from gen_data.core.variant_rng import VariantRng, in_turn


def texture(
    albedo: Float32,
    roughness: Float32 | None = None,
    height: Float32 | None = None,
    relief: float = 1.0,
) -> TextureData:
    """A texture from sRGB colour in [0, 1], a roughness factor and a height in pixels.

    Args:
        albedo: float32 [n, n, 3].
        roughness: float32 [n, n] in [0, 1], or None.
        height: float32 [n, n]; its slope becomes the normal map; or None.
        relief: Factor on the height.
    """
    rough = None if roughness is None else quantize(roughness)
    return TextureData(quantize(albedo), rough, None if height is None else normals(height, relief))


def normals(height: Float32, relief: float) -> UInt8:
    """Tangent-space normals (OpenGL convention, +Y up) of a periodic height in pixels."""
    slope_x = 0.5 * relief * (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1))
    slope_down = 0.5 * relief * (np.roll(height, -1, axis=0) - np.roll(height, 1, axis=0))
    length = np.sqrt(slope_x**2 + slope_down**2 + 1)
    # Channel by channel: arithmetic along an axis of three takes several times as long.
    image = np.zeros((*height.shape, 3), np.uint8)
    for channel, part in enumerate((-slope_x, slope_down, np.ones_like(height))):
        image[..., channel] = quantize((0.5 + 0.5 * (part / length)).astype(np.float32))
    return image


def quantize(values: Float32) -> UInt8:
    """[0, 1] as 8 bits."""
    scaled = np.clip(values, 0.0, 1.0)
    scaled *= scaled.dtype.type(255.0)
    image: UInt8 = np.round(scaled, out=scaled).astype(np.uint8)
    return image


def color(code: str) -> Float32:
    """``#rrggbb`` as sRGB in [0, 1], shape [3]."""
    channels: Float32 = np.array(hex_to_srgb8(code), dtype=np.float32) / np.float32(255.0)
    return channels


def colors_in_turn(palette: str, seed: int) -> tuple[Float32, ...]:
    """Colours of one entry of a palette, entries taken in turn by seed; see ``color``."""
    entries = PALETTES[palette]
    return tuple(color(code) for code in in_turn(entries, seed).split())


def draw_color(codes: Sequence[str], spread: float, rng: VariantRng) -> Float32:
    """One of the colours with its brightness and tint moved a little."""
    base = color(rng.choose(codes))
    level = rng.between(-spread, spread)
    tint = np.array([rng.between(-0.3, 0.3) * spread for _ in range(3)], dtype=np.float32)
    moved: Float32 = np.clip(base * np.float32(1.0 + level) + tint, 0.01, 0.97)
    return moved


def mix_colors(a: Float32, b: Float32, t: NDArray[np.floating[Any]]) -> Float32:
    """Colours mixed per pixel: ``a`` where t is 0, ``b`` where it is 1.

    The shapes of a and b without their last axis, and of t, are broadcast: [n, n], [n, 1], [].
    """
    weight = np.clip(t, 0.0, 1.0).astype(np.float32)
    shape = np.broadcast_shapes(a.shape[:-1], b.shape[:-1], weight.shape)
    rest, blend = 1 - weight, np.zeros((*shape, 3), np.float32)
    # Channel by channel: arithmetic along an axis of three takes several times as long.
    for channel in range(3):
        blend[..., channel] = a[..., channel] * rest + b[..., channel] * weight
    return blend


def ramp(stops: Sequence[tuple[float, Float32]], t: Float32) -> Float32:
    """Colours interpolated between stops of (position, colour)."""
    positions = [position for position, _ in stops]
    channels = [np.interp(t, positions, [float(c[i]) for _, c in stops]) for i in range(3)]
    return np.stack(channels, axis=2).astype(np.float32)
