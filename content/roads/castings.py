"""Iron castings in streets, once across the image: manhole covers, hatches, gratings of gullies."""

import math

import numpy as np

from gen_data.content.procedural.textures.texture_images import color, mix_colors, texture
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import blur_image, fbm, rows_and_columns, smoothstep, uniform
from gen_data.core.variant_rng import VariantRng, in_turn

_PX = 256


def manhole(rng: VariantRng) -> TextureData:
    """A round cover in its frame: studded iron, a ring filled with concrete, or ribs with vents.

    Args:
        rng: Draws; seeds take the three kinds in turn.
    """
    y, x = (2.0 * v - 1.0 for v in rows_and_columns(_PX))
    radius, turn = np.sqrt(x * x + y * y), np.arctan2(y, x)
    kind = in_turn(("studs", "concrete", "ribs"), rng.seed)
    inner = smoothstep(0.74, 0.7, radius)
    rings = _line(radius, 0.77, 0.02) + _line(radius, 0.93, 0.04)
    gap = _line(radius, 0.84, 0.015)
    if kind == "studs":
        holes = _line(radius, 0.55, 0.04) * smoothstep(0.9, 0.97, np.cos(6.0 * turn))
        raised = smoothstep(0.1, 0.5, np.sin(24.0 * x) * np.sin(24.0 * y)) * inner + rings
    elif kind == "ribs":
        holes = _line(radius, 0.62, 0.06) * smoothstep(0.93, 0.98, np.cos(16.0 * turn))
        spokes = smoothstep(0.6, 0.9, np.cos(16.0 * turn)) * smoothstep(0.2, 0.25, radius)
        raised = spokes * smoothstep(0.5, 0.46, radius) + rings + _line(radius, 0.5, 0.04)
    else:
        holes = _line(radius, 0.72, 0.03) * smoothstep(0.96, 0.985, np.cos(8.0 * turn))
        raised = rings
    grit = fbm((20, 20), 4, rng, 0.7, _PX)
    raised, open_ = np.clip(raised, 0.0, 1.0), np.clip(gap + holes, 0.0, 1.0)
    albedo = _iron(raised, grit, open_)
    if kind == "concrete":
        grain = (uniform((_PX, _PX), rng) - 0.5).astype(np.float32)
        filled = (color("#8b8780") * (1.0 + 0.3 * grain + 0.08 * grit)[..., None]).astype(
            np.float32
        )
        albedo = mix_colors(albedo, filled, smoothstep(0.66, 0.64, radius))
    roughness = (0.95 - 0.25 * raised).astype(np.float32)
    return texture(albedo, roughness, blur_image((3.0 * raised - 4.0 * open_).astype(np.float32)))


def hatch(rng: VariantRng) -> TextureData:
    """A rectangular cover of cables or valves: chequered plates, or iron with a concrete field.

    Args:
        rng: Draws; seeds take the two kinds in turn.
    """
    y, x = rows_and_columns(_PX)
    side = np.minimum(np.minimum(x, 1.0 - x), np.minimum(y, 1.0 - y))
    gap = _line(side, 0.07, 0.012) + _line(x, 0.5, 0.008) * smoothstep(0.07, 0.08, side)
    inside = smoothstep(0.1, 0.12, side)
    grit = fbm((20, 20), 4, rng, 0.7, _PX)
    if in_turn(("plates", "concrete"), rng.seed) == "plates":
        raised = smoothstep(0.3, 0.6, np.sin(44.0 * (x + y)) * np.sin(44.0 * (x - y))) * inside
        albedo = _iron(raised, grit, np.clip(gap, 0.0, 1.0))
    else:
        raised = np.zeros((_PX, _PX), dtype=np.float32)
        field = (color("#8d897f") * (1.0 + 0.1 * grit)[..., None]).astype(np.float32)
        albedo = mix_colors(
            _iron(raised, grit, np.clip(gap, 0.0, 1.0)), field, inside * (gap < 0.1)
        )
    return texture(albedo, None, blur_image((2.0 * raised - 4.0 * gap).astype(np.float32)))


def drain(rng: VariantRng) -> TextureData:
    """A grating of a street gully; slots run across the gutter, or it is a grid.

    Args:
        rng: Draws; seeds take the two kinds in turn.
    """
    y, x = rows_and_columns(_PX)
    inside = (
        smoothstep(0.07, 0.09, x) * smoothstep(0.93, 0.91, x)
        * smoothstep(0.08, 0.1, y) * smoothstep(0.92, 0.9, y)
    )  # fmt: skip
    slots = smoothstep(0.1, 0.35, np.sin(2.0 * math.pi * 7.0 * x)) * inside
    if in_turn(("slots", "grid"), rng.seed) == "slots":
        slots = slots * smoothstep(0.03, 0.05, np.abs(y - 0.5))
    else:
        slots = slots * smoothstep(-0.5, -0.1, np.sin(2.0 * math.pi * 5.0 * y))
    grit = fbm((20, 20), 4, rng, 0.7, _PX)
    level = (0.34 + 0.04 * grit) * (1.0 - 0.93 * slots)
    albedo: Float32 = (level[..., None] * color("#fff2e2")).astype(np.float32)
    return texture(albedo, None, blur_image((-4.0 * slots).astype(np.float32)))


def _line(x: Float32, at: float, half: float) -> Float32:
    """1 where x is near a value, 0 beyond ``half``."""
    return smoothstep(half, 0.4 * half, np.abs(x - np.float32(at)))


def _iron(raised: Float32, grit: Float32, open_: Float32) -> Float32:
    """Cast iron [n, n, 3]: traffic polishes raised parts, dirt fills the rest."""
    level = (0.27 + 0.1 * raised + 0.03 * grit) * (1.0 - 0.85 * open_)
    albedo: Float32 = (level[..., None] * color("#fff4e6")).astype(np.float32)
    return albedo
