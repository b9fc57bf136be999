"""Driven surfaces of one lane from above: one lane across the image, one tile along it.

All wear of a seed lies on the same base image and fades out at both ends of the tile: tiles of
different wear join without a seam. Images are 1024 pixels along and 512 across: 12 mm and 7 mm each
in a lane 3.5 m wide, because cameras see roads foreshortened.
"""

import math

import numpy as np

from gen_data.assets.family import check_option
from gen_data.content.procedural.textures.texture_images import color, mix_colors, texture
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import blur_image, fbm, rows_and_columns, smoothstep, uniform, worley
from gen_data.core.variant_rng import VariantRng, variant_rng

TILE_M = 12.0
"""Length of a tile along the road."""
_ACROSS_M = 3.5
_N = 1024
DAMAGES = ("none", "cracks", "alligator", "stains")
_TRACK = 0.85 / _ACROSS_M
"""Distance of a wheel track from the middle of the lane, as a share of its width."""
_FRESH_ALBEDO, _SETTLING_YEARS = 0.045, 2.5
"""New asphalt has an albedo of 0.04 to 0.05; within 5 years it settles at 0.12 in the mean.

Source: LBNL Heat Island Group, "Pavement albedo" (0.04 fresh, mean 0.12 within 5 years, at most
0.16; others up to 0.18); Pomerantz et al., LBNL-43442, 2000. The rate is fitted to the former.
"""
_AGGREGATES = ((0.105, "#5a5b5e"), (0.125, "#63625f"), (0.15, "#686663"), (0.175, "#6f6c66"))
"""Settled albedo and tint by stone: basalt, greywacke, granite, limestone. Tints are assumed."""


def asphalt_color(seed: int, age_years: float) -> Float32:
    """Mean sRGB colour [3] of an asphalt by the age of its surface; its stone goes by the seed."""
    settled, tint = _AGGREGATES[seed % len(_AGGREGATES)]
    bare = 1.0 - math.exp(-age_years / _SETTLING_YEARS)
    albedo = _FRESH_ALBEDO + (settled - _FRESH_ALBEDO) * bare
    # Bitumen is neutral; the stone's tint comes out as it wears off.
    tone = color(tint) / color(tint).mean()
    level = 1.055 * albedo ** (1.0 / 2.4) - 0.055
    toned: Float32 = (level * (1.0 + bare * (tone - 1.0))).astype(np.float32)
    return toned


def asphalt_lane(seed: int, age_years: float = 6.0, damage: str = "none") -> TextureData:
    """A lane of asphalt: tyre tracks, a trace of oil between them, streaks along it.

    Args:
        seed: Seed of all draws, and of the stone.
        age_years: Time since it was laid: bitumen wears off the stones, which are lighter.
        damage: A word of ``DAMAGES``.

    Raises:
        AssetError: the damage is unknown.
    """
    check_option("asphalt_lane", "damage", damage, DAMAGES)
    rng = variant_rng("asphalt_lane", seed)
    aged = 1.0 - math.exp(-age_years / _SETTLING_YEARS)
    x, tracks = _tracks(0.3 / _ACROSS_M)
    grain = (uniform((_N, _N), rng) - 0.5).astype(np.float32)
    stones = 0.5 * grain + 0.9 * blur_image(np.roll(grain, 7, axis=0))
    blotches = fbm((60, 30), 4, rng, 0.6, _N)
    clouds = fbm((4, 2), 4, rng, 0.55, _N)
    streaks = fbm((2, 48), 3, rng, 0.6, _N)
    shade = 1.0 + (0.3 + 0.6 * aged) * stones + (0.04 + 0.06 * aged) * blotches
    shade += (0.02 + 0.03 * aged) * clouds + (0.02 + 0.035 * aged) * streaks
    # Tyres uncover stones; oil drips on the middle of the lane; dust settles next to the tracks.
    polish = tracks * np.float32(0.05 + 0.05 * aged)
    oil = np.exp(-(((x - 0.5) / 0.1) ** 2)) * (0.75 + 0.25 * smoothstep(-0.6, 0.6, streaks))
    shade *= 1.0 + polish - np.float32(0.03 + 0.09 * aged) * oil
    roughness = 0.97 - 0.16 * tracks - 0.12 * oil + 0.05 * grain
    albedo = (asphalt_color(seed, age_years) * shade[..., None]).astype(np.float32)
    height = 0.5 * blur_image(grain) + 0.25 * grain
    painter = {"cracks": _crack, "alligator": _craze, "stains": _stain}.get(damage)
    if painter is not None:
        wear = variant_rng(f"asphalt_lane/{damage}", seed)
        albedo, roughness, height = painter(albedo, roughness.astype(np.float32), height, wear)
    return _narrow(albedo, roughness, height)


def concrete_lane(seed: int, age_years: float = 6.0, damage: str = "none") -> TextureData:
    """A lane of concrete slabs with brushed surface, sealed joints and traces of tyres.

    Slabs are a third of a tile long: 4 m; real ones measure 3 to 5 m (assumed).

    Args:
        seed: Seed of all draws.
        age_years: Age: concrete darkens (LBNL-43442: albedo 0.35-0.4 new, 0.25-0.3 aged).
        damage: A word of ``DAMAGES``.

    Raises:
        AssetError: the damage is unknown.
    """
    check_option("concrete_lane", "damage", damage, DAMAGES)
    rng = variant_rng("concrete_lane", seed)
    aged = 1.0 - math.exp(-age_years / 8.0)
    x, tracks = _tracks(0.33 / _ACROSS_M)
    y = rows_and_columns(_N)[0]
    grain = (uniform((_N, _N), rng) - 0.5).astype(np.float32)
    clouds, streaks = fbm((6, 3), 5, rng, 0.6, _N), fbm((2, 40), 3, rng, 0.6, _N)
    # Grooves across the lane, brushed into the fresh concrete.
    brushed = fbm((256, 4), 2, rng, 0.6, _N)
    tones = np.array([rng.between(-0.045, 0.045) for _ in range(3)], dtype=np.float32)
    slab = tones[np.minimum((y[:, 0] * 3).astype(int), 2)][:, None]
    shade = 1.0 + slab + 0.16 * grain + 0.05 * clouds + 0.03 * brushed + 0.03 * streaks
    shade *= 1.0 - np.float32(0.04 + 0.12 * aged) * tracks
    oil = np.exp(-(((x - 0.5) / 0.09) ** 2)) * smoothstep(-0.7, 0.7, clouds + streaks)
    shade *= 1.0 - np.float32(0.12 * aged) * oil
    level = 1.055 * (0.36 - 0.09 * aged) ** (1.0 / 2.4) - 0.055
    tint = color("#b0aca2") / color("#b0aca2").mean()
    albedo = (level * tint * shade[..., None]).astype(np.float32)
    from_joint = np.abs(y * 3.0 - np.round(y * 3.0)) * (TILE_M / 3.0)
    from_side = np.minimum(x, 1.0 - x) * _ACROSS_M
    ragged = 0.004 * fbm((40, 40), 3, rng, 0.6, _N)
    joint = smoothstep(0.012, 0.006, np.minimum(from_joint, from_side) + ragged)
    spread = 0.25 * smoothstep(0.09, 0.0, np.minimum(from_joint, from_side) + 4.0 * ragged)
    albedo = mix_colors(albedo, color("#2b2a29"), np.maximum(joint, spread * aged))
    roughness = (0.95 - 0.1 * tracks + 0.05 * grain).astype(np.float32)
    height = (0.3 * grain + 0.5 * brushed - 3.0 * joint).astype(np.float32)
    painter = {"cracks": _crack, "alligator": _crack, "stains": _stain}.get(damage)
    if painter is not None:
        wear = variant_rng(f"concrete_lane/{damage}", seed)
        albedo, roughness, height = painter(albedo, roughness, height, wear)
    return _narrow(albedo, roughness, height)


def track_lane(seed: int, material: str = "earth") -> TextureData:
    """An unpaved lane: two worn tracks, loose stones and weeds between and next to them.

    Args:
        seed: Seed of all draws.
        material: ``earth`` or ``gravel``.

    Raises:
        AssetError: the material is unknown.
    """
    check_option("track_lane", "material", material, ("earth", "gravel"))
    rng = variant_rng(f"track_lane/{material}", seed)
    earthy = material == "earth"
    wander = 0.03 * fbm((2, 1), 3, rng, 0.5, _N)
    _, tracks = _tracks(0.36 / _ACROSS_M, wander)
    grain = (uniform((_N, _N), rng) - 0.5).astype(np.float32)
    clouds, blotches = fbm((5, 2), 6, rng, 0.65, _N), fbm((50, 22), 4, rng, 0.6, _N)
    pebbles = worley((220, 130), rng, size_px=_N)
    share = 0.12 if earthy else 0.75
    kept = pebbles.of_each((uniform(pebbles.count, rng) < share).astype(np.float64))
    loose = np.clip(1.0 - tracks, 0.0, 1.0)
    stone = kept * smoothstep(0.42, 0.25, pebbles.nearest) * (0.4 + 0.6 * loose)
    base = color("#7a684f") if earthy else color("#8d887d")
    tone = pebbles.of_each(0.75 + 0.5 * uniform(pebbles.count, rng))
    shade = 1.0 + 0.2 * grain + 0.12 * clouds + 0.08 * blotches + 0.1 * tracks
    albedo = (base * shade[..., None]).astype(np.float32)
    pale = (color("#9a9284" if earthy else "#a29d92") * tone[..., None]).astype(np.float32)
    albedo = mix_colors(albedo, pale, 0.8 * stone)
    tufts = fbm((70, 34), 3, rng, 0.7, _N) + 0.5 * clouds - 1.1 * tracks
    weeds = smoothstep(-0.15 if earthy else 0.2, 0.5 if earthy else 0.9, tufts)
    blades = (color("#66703c") * (1.0 + 0.35 * grain + 0.2 * blotches)[..., None]).astype(
        np.float32
    )
    albedo = mix_colors(albedo, blades, 0.85 * weeds)
    height = 1.5 * clouds + 2.0 * stone + 2.5 * weeds * (0.5 + grain) - 1.0 * tracks + grain
    return _narrow(albedo, None, height.astype(np.float32))


def gutter(rng: VariantRng, age_years: float = 6.0) -> TextureData:
    """The edge of a carriageway: clean asphalt at both sides of the image, the kerb in its middle.

    Wind and water leave grit, sand and a few leaves there; 3 m per repeat along the kerb,
    0.5 m from it to clean asphalt.

    Args:
        rng: All draws, including the stone.
        age_years: Age of the asphalt below.
    """
    n = 512
    x = 1.0 - np.abs(2.0 * rows_and_columns(n)[1] - 1.0)
    grain = (uniform((n, n), rng) - 0.5).astype(np.float32)
    shade = 1.0 + 0.3 * grain + 0.05 * fbm((10, 6), 4, rng, 0.6, n)
    albedo = (asphalt_color(rng.seed, age_years) * shade[..., None]).astype(np.float32)
    drift = fbm((9, 4), 5, rng, 0.6, n)
    # Nothing at the inner edge, where the lane's own surface goes on.
    cover = smoothstep(0.25, 0.95, x + 0.28 * drift) * smoothstep(0.0, 0.3, x)
    sand = (color("#6f6658") * (1.0 + 0.4 * grain)[..., None]).astype(np.float32)
    albedo = mix_colors(albedo, sand, 0.85 * cover)
    leaves = worley((90, 30), rng, 0.9, n)
    fallen = leaves.of_each((uniform(leaves.count, rng) < 0.35).astype(np.float64))
    leaf = fallen * smoothstep(0.34, 0.26, leaves.nearest) * smoothstep(0.45, 0.9, x + 0.2 * drift)
    hues = np.array([color(c) for c in ("#6b4f2c", "#8a6a33", "#5a4a30", "#94803f")])
    which = (uniform(leaves.count, rng) * len(hues)).astype(int)
    tints = hues[which][leaves.number].astype(np.float32)
    albedo = mix_colors(albedo, tints, 0.9 * leaf)
    # Damp dirt in the corner at the kerb.
    albedo *= (1.0 - 0.35 * smoothstep(0.88, 1.0, x + 0.04 * drift))[..., None]
    return texture(albedo, None, (0.8 * grain * (1.0 + cover) + 1.5 * leaf).astype(np.float32), 0.7)


def _tracks(width: float, wander: Float32 | None = None) -> tuple[Float32, Float32]:
    """Coordinate across the lane [n, n] in [0, 1], and how much tyres have worn [n, n]."""
    row = rows_and_columns(_N)[1]
    x = np.broadcast_to(row, (_N, _N)) if wander is None else row + wander
    worn = sum(np.exp(-(((x - 0.5 - side * _TRACK) / width) ** 2)) for side in (-1.0, 1.0))
    return np.asarray(x, dtype=np.float32), np.asarray(worn, dtype=np.float32)


def _narrow(albedo: Float32, roughness: Float32 | None, height: Float32) -> TextureData:
    """A texture half as wide as high: neighbouring columns of square images averaged."""

    def halved(image: Float32) -> Float32:
        mean: Float32 = (0.5 * (image[:, ::2] + image[:, 1::2])).astype(np.float32)
        return mean

    rough = None if roughness is None else halved(np.asarray(roughness, dtype=np.float32))
    return texture(halved(albedo), rough, halved(height), 0.8)


def _fade(margin: float = 0.07) -> Float32:
    """Column [n, 1]: 1 inside a tile, 0 at both of its ends."""
    y = rows_and_columns(_N)[0]
    return smoothstep(0.01, margin, y) * smoothstep(0.99, 1.0 - margin, y)


Maps = tuple[Float32, Float32, Float32]


def _crack(albedo: Float32, roughness: Float32, height: Float32, rng: VariantRng) -> Maps:
    """Cracks across the lane and along a wheel track, some of them sealed with bitumen."""
    y, x = rows_and_columns(_N)
    wide = fbm((5, 5), 6, rng, 0.62, _N)
    open_, sealed = np.zeros((_N, _N), np.float32), np.zeros((_N, _N), np.float32)
    for number in range(3):
        wave = wide[(170 + 290 * number) % _N]
        away = np.abs(y - rng.between(0.15, 0.85) - 0.035 * wave[None, :]) * TILE_M
        _add_crack(open_, sealed, away, number == 0)
    along = wide[:, 333][:, None]
    place = 0.5 + rng.choose((-1.0, 1.0)) * rng.between(0.25, 0.42)
    away = np.abs(x - place - 0.035 * along) * _ACROSS_M + 0.03 * (1.0 - _fade(0.3))
    _add_crack(open_, sealed, away, sealed=rng.chance(0.5))
    open_, sealed = open_ * _fade(), sealed * _fade()
    albedo = mix_colors(albedo, color("#1c1b1a"), 0.85 * open_)
    albedo = mix_colors(albedo, color("#262628"), sealed)
    roughness = roughness * (1.0 - sealed) + 0.55 * sealed
    return albedo, roughness, height * (1.0 - 0.8 * sealed) - 3.0 * open_ + 0.5 * sealed


def _add_crack(open_: Float32, sealed_: Float32, away_m: Float32, sealed: bool) -> None:
    """Add a line to one of two masks, in place: a crack 12 mm wide or a seal 60 mm wide."""
    if sealed:
        np.maximum(sealed_, smoothstep(0.036, 0.026, away_m), out=sealed_)
    else:
        np.maximum(open_, smoothstep(0.011, 0.005, away_m), out=open_)


def _craze(albedo: Float32, roughness: Float32, height: Float32, rng: VariantRng) -> Maps:
    """Alligator cracks in the wheel tracks, with a few holes where pieces have come out."""
    _, tracks = _tracks(0.34 / _ACROSS_M)
    cells = worley((96, 30), rng, size_px=_N)
    where = fbm((4, 3), 3, rng, 0.5, _N)
    hurt = smoothstep(-0.05, 0.4, where + 0.5 * tracks - 0.35) * _fade(0.15)
    lines = smoothstep(0.085, 0.03, cells.second - cells.nearest + 0.02 * where) * hurt
    holes = fbm((9, 7), 5, rng, 0.6, _N) + 0.35 * tracks
    gone = smoothstep(1.0, 1.08, holes) * smoothstep(0.5, 0.9, hurt)
    darker = (albedo * (1.0 - 0.1 * hurt[..., None])).astype(np.float32)
    albedo = mix_colors(darker, color("#1d1c1b"), 0.8 * lines)
    albedo = mix_colors(albedo, color("#6d675e"), 0.5 * gone)
    return albedo, roughness, (height - 2.5 * lines - 4.0 * gone).astype(np.float32)


def _stain(albedo: Float32, roughness: Float32, height: Float32, rng: VariantRng) -> Maps:
    """Drops of oil, a wet-looking splash, and the black traces of braking tyres."""
    y, x = rows_and_columns(_N)
    drops = worley((40, 14), rng, 0.9, _N)
    fallen = drops.of_each((uniform(drops.count, rng) < 0.2).astype(np.float64))
    ragged = 0.12 * fbm((90, 40), 3, rng, 0.6, _N)
    middle = np.exp(-(((x - 0.5) / 0.16) ** 2)).astype(np.float32)
    oil = fallen * smoothstep(0.34, 0.12, drops.nearest + ragged) * middle
    splash = smoothstep(0.55, 1.0, fbm((5, 4), 5, rng, 0.6, _N)) * middle
    dark = np.clip(0.65 * oil + 0.4 * splash, 0.0, 0.75) * _fade()
    start, end = 0.15, rng.between(0.6, 0.85)
    ramp = smoothstep(start, end, y) * smoothstep(end + 0.02, end, y)
    comb = 0.7 + 0.3 * smoothstep(-0.3, 0.5, fbm((1, 90), 2, rng, 0.6, _N))
    skid = np.zeros((_N, _N), dtype=np.float32)
    drawn = rng.chance(0.5)
    for side in (-1.0, 1.0) if drawn else (rng.choose((-1.0, 1.0)),):
        at = 0.5 + side * _TRACK + 0.012 * np.sin(3.0 * y)
        skid += smoothstep(0.032, 0.022, np.abs(x - at)) * ramp * comb
    dark = np.clip(dark + 0.5 * skid, 0.0, 0.8)
    albedo = (albedo * (1.0 - dark)[..., None]).astype(np.float32)
    return albedo, (roughness - 0.25 * np.clip(oil + splash, 0.0, 1.0)).astype(np.float32), height
