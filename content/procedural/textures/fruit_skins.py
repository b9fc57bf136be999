"""Skins and cut faces of fruit.

Skins: u runs around the fruit, v from blossom to stalk. Cut faces: v from the rim to the middle.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from gen_data.assets.family import check_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural.textures.texture_images import (
    color,
    colors_in_turn,
    draw_color,
    mix_colors,
    texture,
)
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import SIZE_PX, fbm, perlin, rows_and_columns, smoothstep, uniform, worley
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

# Soft patterns are computed at this size and enlarged, which takes a tenth of the time.
_SOFT_PX = 128
# Paper and ink of grocers' labels, sRGB.
_LABELS = (
    ((240, 240, 235), (30, 60, 140)),
    ((200, 30, 30), (250, 240, 220)),
    ((30, 110, 60), (245, 240, 200)),
    ((250, 200, 40), (160, 30, 30)),
)
_PACKAGE = "gen_data.content.procedural"


@dataclass(frozen=True, slots=True)
class SkinStyle:
    """A kind of skin; shares and depths in [0, 1], 0 = none.

    Attributes:
        grounds: Colours, of which seeds take one in turn.
        blushes: Colours of the patches over it.
        cover: Range of the share that patches cover.
        top, top_share: Colour around the stalk, and its weight.
        fibres: Contrast of fine hair along the fruit.
        rings: Contrast of creases around it.
        pebbles: Depth of bumps.
        bloom: Weight of pale wax.
        specks, speck: Number and colour of small spots.
        seeds: Rows of seeds in hollows.
    """

    grounds: tuple[str, ...]
    blushes: tuple[str, ...]
    cover: tuple[float, float]
    top: str = "#6d7a3a"
    top_share: float = 0.0
    fibres: float = 0.0
    rings: float = 0.0
    pebbles: float = 0.0
    bloom: float = 0.0
    specks: int = 0
    speck: str = "#6f5a2c"
    seeds: int = 0


SKINS: Mapping[str, SkinStyle] = load_table(_PACKAGE, "fruit_skins", SkinStyle)


def apple_skin(rng: VariantRng) -> TextureData:
    """Streaks from stalk to blossom over a paler ground, with pores, scars and a grocer's label."""
    ground, blush = colors_in_turn("apples", rng.seed)
    y, _ = rows_and_columns()
    streaks = 0.6 * fbm((2, 40), 2, rng) + 0.3 * perlin((6, 90), rng)
    # The side that faced the sun is redder.
    patches = 0.7 * _soft(2, 3, rng) + rng.between(-0.3, 0.5) + 0.35 * _sunny_side(rng)
    cover = smoothstep(-0.5, 0.6, patches + rng.between(0.2, 0.8) * streaks)
    albedo = mix_colors(ground, blush, cover)
    hollow = smoothstep(0.12, 0.02, y) + smoothstep(0.9, 1.0, y)
    albedo = mix_colors(albedo, color("#9a8f4a"), 0.7 * hollow * (0.7 + 0.3 * streaks))
    pores = _specks(rng.choose((80, 250, 500)), (0.6, 1.8), rng)
    albedo = mix_colors(albedo, np.minimum(ground + 0.12, 0.95), 0.6 * pores)
    scars = _specks(rng.choose((0, 0, 3, 8)), (2.0, 9.0), rng)
    albedo = mix_colors(albedo, color("#7a5a34"), 0.7 * scars)
    albedo = albedo * (1 + 0.04 * _soft(12, 2, rng))[..., None]
    return texture(_label(albedo, rng) if rng.chance(0.2) else albedo)


def citrus_peel(rng: VariantRng) -> TextureData:
    """Dimpled by oil glands. Seeds below 1000 are oranges, below 2000 lemons, others limes.

    The last lemon is from a spectrum (Vrhel et al. 1994); the other colours are assumed.
    """
    codes = (
        ("#e8791a", "#f08c1e", "#e06a12", "#eb9a2a", "#e6a032", "#d96012"),
        ("#f0cf2c", "#f4da45", "#e6c21f", "#e2b811"),
        ("#4f7a24", "#6b8f2c", "#3f6a20", "#93a534"),
    )[min(rng.seed // 1000, 2)]
    base = draw_color(codes, 0.05, rng)
    green = color(rng.choose(("#a9a23a", "#7f8f34")))
    unripe = rng.choose((0.0, 0.0, 0.15, 0.35)) * smoothstep(0.0, 0.9, _soft(2, 2, rng))
    albedo = mix_colors(base * (1 + 0.06 * _soft(3, 3, rng))[..., None], green, unripe)
    glands = _enlarged(worley((48, 72), rng, 0.9, 256).nearest)
    dimple = smoothstep(0.5, 0.1, glands)
    y, _ = rows_and_columns()
    ends = smoothstep(0.08, 0.0, y) + smoothstep(0.95, 1.0, y)
    albedo = mix_colors(albedo * (1 - 0.08 * dimple)[..., None], green, 0.5 * ends)
    scars = _specks(rng.choose((0, 4, 12, 40)), (1.0, 6.0), rng)
    albedo = mix_colors(albedo, color("#9a7a4a"), 0.6 * scars)
    return texture(_label(albedo, rng) if rng.chance(0.15) else albedo, None, -1.3 * dimple)


def banana_peel(rng: VariantRng, ripe: float = -1.0) -> TextureData:
    """From green over yellow to spotted brown, with dark tips; ``ripe`` in [0, 1], below 0 = drawn.

    The stem is at the lower end of the image. Ringer and Blanke (2021) measured the hues of
    ripeness stages R2 to R7; green, the peel that has just turned and brown spots are
    from Kajuna et al. (1995; a*) and from spectra of Vrhel et al. (1994). Lightness and chroma of
    the other stages are assumed.
    """
    drawn = rng.between(0.0, 1.0)
    ripe = drawn if ripe < 0.0 else ripe
    stops = ((0.0, "#8a9e4c"), (0.15, "#bfb25b"), (0.25, "#caba5f"), (0.35, "#d4c062"),
             (0.45, "#d8be61"), (0.6, "#dcbb59"), (0.8, "#d7b24f"), (1.0, "#c49a49"))  # fmt: skip
    base = np.array(
        [np.interp(ripe, [s for s, _ in stops], [float(color(c)[i]) for _, c in stops])
         for i in range(3)], dtype=np.float32,
    )  # fmt: skip
    y, _ = rows_and_columns()
    wander = 0.02 * _soft(5, 2, rng)
    ends = smoothstep(0.24, 0.03, y + wander) + smoothstep(0.78, 0.97, y + wander)
    albedo = mix_colors(base * (1 + 0.05 * _soft(3, 3, rng))[..., None], color("#8a9e4c"),
                        ends * (0.8 - 0.75 * ripe))  # fmt: skip
    lines = smoothstep(0.55, 0.8, perlin((4, 70), rng)) * 0.1
    count = int(900 * max(0.0, ripe - 0.35) ** 1.5) + rng.choose((0, 6))
    spots = _specks(count, (0.8, 5.0 + 5.0 * max(0.0, ripe - 0.6)), rng)
    bruise = smoothstep(0.8, 1.3, _soft(5, 3, rng) + 0.6 * np.float32(ripe))
    brown = np.clip(0.85 * spots + lines + 0.6 * bruise, 0, 1)
    albedo = mix_colors(albedo, color("#564339"), brown)
    tips = smoothstep(0.03, 0.012, y + 0.5 * wander) + smoothstep(0.955, 0.985, y + 0.5 * wander)
    albedo = mix_colors(albedo, color("#3f3119"), (0.5 + 0.45 * ripe) * tips)
    return texture(_label(albedo, rng) if rng.chance(0.25) else albedo)


def pear_skin(rng: VariantRng) -> TextureData:
    """Green to yellow, red or brown, freckled with lenticels.

    The third colour is from a spectrum (Vrhel et al. 1994); the others are assumed.
    """
    codes = ("#b5b83a", "#c7b548", "#9e9a45", "#9c7a45", "#b8bd58", "#8a6a34", "#a35a34")
    base = draw_color(codes, 0.05, rng)
    blush = color(rng.choose(("#b0583a", "#a88a3a", "#8f9a3a", "#9a3a2c")))
    cover = 0.7 * smoothstep(0.0, 0.9, _soft(2, 3, rng) + 0.5 * _sunny_side(rng))
    albedo = mix_colors(base, blush, cover)
    freckles = _specks(rng.choose((300, 900, 1600)), (0.6, 1.8), rng)
    albedo = mix_colors(albedo, color("#6f5a2c"), 0.55 * freckles)
    y, _ = rows_and_columns()
    russet = smoothstep(0.12, 0.0, y) + smoothstep(0.88, 1.0, y)
    russet = russet + smoothstep(0.5, 1.2, _soft(6, 3, rng))
    return texture(mix_colors(albedo, color("#8a6a3a"), 0.6 * russet))


def fruit_skin(seed: int, kind: str = "plum") -> TextureData:
    """A skin of ``SKINS``. Raises AssetError if there is no such kind."""
    check_option("fruit_skin", "kind", kind, tuple(SKINS))
    style, rng = SKINS[kind], variant_rng(f"fruit_skin/{kind}", seed)
    y, x = rows_and_columns()
    ground, blush = color(in_turn(style.grounds, seed)), color(rng.choose(style.blushes))
    cover = rng.between(*style.cover)
    patches = _soft(2, 3, rng) + 0.5 * _sunny_side(rng) + 2.4 * cover - 1.2
    albedo = mix_colors(ground, blush, 0.85 * smoothstep(-0.2, 0.7, patches))
    albedo = albedo * (1 + 0.05 * _soft(6, 2, rng))[..., None]
    if style.fibres:
        albedo = albedo * (1 + style.fibres * fbm((10, 120), 1, rng))[..., None]
    if style.rings:
        creases = smoothstep(0.35, 0.8, perlin((46, 5), rng))
        albedo = mix_colors(albedo, blush * 0.7, style.rings * creases)
    albedo = mix_colors(albedo, color(style.speck), 0.7 * _specks(style.specks, (0.7, 1.8), rng))
    wax = smoothstep(-0.4, 0.8, _soft(4, 3, rng))
    albedo = mix_colors(albedo, color("#9a9ab0"), style.bloom * wax)
    top = smoothstep(0.16, 0.0, y + 0.04 * _soft(6, 2, rng))
    albedo = mix_colors(albedo, color(style.top), style.top_share * top)
    if style.seeds:
        return _with_seeds(albedo, style.seeds, x, y)
    if style.pebbles:
        bumps = _enlarged(worley((34, 40), rng, 1.0, 256).nearest)
        return texture(albedo * (1.1 - 0.3 * bumps)[..., None], None, -4.0 * style.pebbles * bumps)
    return texture(albedo)


def _with_seeds(albedo: Float32, rows: int, x: Float32, y: Float32) -> TextureData:
    """Seeds in hollows, in staggered rows, fewer around where the fruit is narrower."""
    row = np.floor(y * rows)
    shift = 0.5 * np.mod(row, 2)
    fy = y * rows - row - 0.5
    fx = np.mod(x * rows + shift, 1.0) - 0.5
    away = np.sqrt((1.1 * fx) ** 2 + (0.9 * fy) ** 2)
    seeds = smoothstep(0.16, 0.1, away)
    hollow = smoothstep(0.42, 0.1, away)
    made = mix_colors(albedo * (1 - 0.25 * hollow)[..., None], color("#d9b45a"), seeds)
    return texture(made, None, (-3.0 * hollow + 1.5 * seeds).astype(np.float32))


_CUTS: Mapping[str, tuple[str, str, str]] = {
    "orange": ("#e8861e", "#f2a43a", "#f6d9a0"),
    "lemon": ("#ead24a", "#f0e08a", "#f4efd0"),
    "lime": ("#5f8a2c", "#b9cf7a", "#e3ecc0"),
    "kiwi": ("#7a6038", "#7fae2e", "#e6e8b8"),
    "apple": ("#d9c48a", "#f3ecd0", "#e6d7a8"),
}
"""Rim, flesh and middle."""


def fruit_cut(seed: int, kind: str = "orange") -> TextureData:
    """The face of a halved fruit. Raises AssetError if there is no such kind."""
    check_option("fruit_cut", "kind", kind, tuple(_CUTS))
    rng = variant_rng(f"fruit_cut/{kind}", seed)
    rim, flesh, core = (color(code) for code in _CUTS[kind])
    up, x = rows_and_columns()
    v = 1.0 - up
    y = np.broadcast_to(v, (SIZE_PX, SIZE_PX))
    grain = fbm((6, 90), 2, rng)
    albedo = mix_colors(flesh, np.minimum(flesh * 1.15, 1.0), 0.5 + 0.5 * grain)
    if kind in ("orange", "lemon", "lime"):
        count = rng.choose((9, 10, 11, 12))
        wave = np.abs(np.mod(x * count + 0.06 * _soft(8, 2, rng), 1.0) - 0.5)
        membrane = smoothstep(0.46, 0.49, wave) + smoothstep(0.13, 0.1, y)
        albedo = mix_colors(albedo, core, np.clip(membrane + smoothstep(0.86, 0.93, y), 0, 1))
        albedo = mix_colors(albedo, rim, smoothstep(0.05, 0.03, y))
    elif kind == "kiwi":
        rays = smoothstep(0.2, 0.9, perlin((2, 60), rng)) * smoothstep(0.75, 0.4, y)
        albedo = mix_colors(albedo, core, np.clip(0.4 * rays + smoothstep(0.66, 0.8, y), 0, 1))
        wave = np.abs(np.mod(x * 26 + 0.2 * _soft(16, 1, rng), 1.0) - 0.5)
        band = smoothstep(0.1, 0.04, np.abs(y - 0.56 - 0.05 * _soft(30, 1, rng)))
        albedo = mix_colors(albedo, color("#1d1a12"), smoothstep(0.2, 0.1, wave) * band)
        albedo = mix_colors(albedo, rim, smoothstep(0.03, 0.015, y))
    else:
        wave = np.abs(np.mod(x * 5, 1.0) - 0.5)
        line = smoothstep(0.03, 0.01, np.abs(y - 0.72 + 0.12 * wave))
        albedo = mix_colors(albedo, core, 0.6 * line + 0.5 * smoothstep(0.9, 0.97, y))
        seeds = smoothstep(0.12, 0.08, np.hypot(1.2 * (wave - 0.1), 2.2 * (y - 0.84)))
        albedo = mix_colors(albedo, color("#4a2a14"), seeds)
        browning = rng.choose((0.0, 0.2, 0.5))
        albedo = mix_colors(
            albedo, color("#b58a4a"), browning * smoothstep(-0.3, 0.8, _soft(4, 3, rng))
        )
        albedo = mix_colors(albedo, rim, smoothstep(0.04, 0.02, y))
    return texture(albedo)


def _soft(cells: int, octaves: int, rng: VariantRng) -> Float32:
    """Perlin octaves without fine detail, float32 [512, 512]."""
    return _enlarged(fbm((cells, cells), octaves, rng, size_px=_SOFT_PX))


def _enlarged(image: Float32) -> Float32:
    """The image at full size; it still repeats: its border is continued before it is cut off."""
    pad = 4
    framed = np.pad(image, pad, mode="wrap")
    scale = SIZE_PX // len(image)
    side = scale * len(framed)
    large = cv2.resize(framed, (side, side), interpolation=cv2.INTER_LINEAR)
    cut = scale * pad
    return np.ascontiguousarray(large[cut:-cut, cut:-cut], dtype=np.float32)


def _sunny_side(rng: VariantRng) -> Float32:
    """1 on one side of the fruit, -1 on the other."""
    _, x = rows_and_columns()
    wave = np.cos(2 * math.pi * (x - np.float32(rng.between(0.0, 1.0))))
    return np.broadcast_to(wave, (SIZE_PX, SIZE_PX)).astype(np.float32)


def _specks(count: int, radius_px: tuple[float, float], rng: VariantRng) -> Float32:
    """Round specks, most of them small, in [0, 1]."""
    mask = np.zeros((SIZE_PX, SIZE_PX), np.uint8)
    low, high = radius_px
    places = uniform((count, 2), rng) * SIZE_PX * 16
    sizes = (low + (high - low) * uniform(count, rng) ** 3) * 16
    for (x, y), r in zip(places.astype(int).tolist(), sizes.astype(int).tolist(), strict=True):
        cv2.circle(mask, (x, y), r, 255, -1, cv2.LINE_AA, 4)
    specks: Float32 = mask.astype(np.float32) / np.float32(255.0)
    return specks


def _label(albedo: Float32, rng: VariantRng) -> Float32:
    """The fruit with an oval label stuck on, as grocers do; its code is invented."""
    made = np.round(np.clip(albedo, 0, 1) * 255).astype(np.uint8)
    x, y = int(rng.between(80, 430)), int(rng.between(200, 300))
    paper, ink = rng.choose(_LABELS)
    cv2.ellipse(made, (x, y), (30, 22), 0, 0, 360, paper, -1, cv2.LINE_AA)
    cv2.ellipse(made, (x, y), (26, 18), 0, 0, 360, ink, 2, cv2.LINE_AA)
    code = str(int(rng.between(3000, 4999)))
    cv2.putText(made, code, (x - 19, y + 5), cv2.FONT_HERSHEY_DUPLEX, 0.45, ink, 1, cv2.LINE_AA)
    labelled: Float32 = made.astype(np.float32) / np.float32(255.0)
    return labelled
