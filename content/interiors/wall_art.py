"""Framed pictures: paintings, prints, drawings, photographs and maps, portrait or landscape.

All motifs consist of noise and a few curves; none shows an existing work or place.
"""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from gen_data.content.procedural.textures import artwork as art
from gen_data.content.procedural.textures.texture_images import color, quantize, ramp
from gen_data.core.asset_types import Float32, TextureData, UInt8
from gen_data.core.noise import fbm, smoothstep, worley
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

LONG_PX, SHORT_PX = 512, 384
"""Sides of a picture: four to three."""
_SIZE_PX = 512
_PAPERS = ("#f4efe2", "#f1ede4", "#ece3d0", "#e9ebe6")
_SCHEMES = (
    "#23395b #c8553d #f28f3b #f6e7cb #588b8b",
    "#2b2d42 #8d99ae #edf2f4 #d90429 #c9ada7",
    "#264653 #2a9d8f #e9c46a #f4a261 #e76f51",
    "#1d1d1b #e8e1d3 #b08968 #7f5539 #ddb892",
    "#344e41 #588157 #a3b18a #dad7cd #bc6c25",
    "#3d405b #81b29a #f2cc8f #e07a5f #f4f1de",
    "#0b2545 #13315c #8da9c4 #eef4ed #d6a461",
    "#5f0f40 #9a031e #fb8b24 #e8d5b7 #0f4c5c",
)


MOTIFS = 14
"""Number of kinds of motifs."""
PHOTOGRAPHS = (3, 5, 7, 11)
"""Seeds below ``MOTIFS`` that show photographs."""


def is_upright(seed: int) -> bool:
    """Whether the motif of a seed is higher than wide."""
    return seed // MOTIFS % 2 == 0


def wall_art(seed: int) -> TextureData:
    """A motif, whose kind follows the seed in turn; 384 x 512 upright, 512 x 384 lying."""
    rng = variant_rng("wall_art", seed)
    w, h = (SHORT_PX, LONG_PX) if is_upright(seed) else (LONG_PX, SHORT_PX)
    return TextureData(in_turn(_MOTIFS, seed)(w, h, rng))


def whiteboard_notes(rng: VariantRng) -> TextureData:
    """Writing with markers on a whiteboard: lists, boxes with arrows, a curve; 512 x 384."""
    image = art.canvas(2 * LONG_PX, 2 * SHORT_PX, (245, 246, 245))
    draw = art.pen(image)
    inks = ((31, 42, 90), (163, 38, 29), (30, 30, 32), (30, 98, 62))

    def write(x: float, y: float, wide: float, high: float, ink: art.Color) -> None:
        # Letters are loops of a pen that moves on; words end where it lifts.
        reach = 0.12 * high, 0.35 * high + 1.5
        ink_px = (x - reach[0], y - reach[1], x + wide + reach[0], y + reach[1])
        art.note(image, "", [ink_px], 3.0)
        while wide > 0.0:
            word = min(wide, rng.between(2.0, 5.5) * high)
            t = np.linspace(0.0, 1.0, max(6, int(word / high * 9)))
            phase = rng.between(0.0, 6.3)
            up = 0.35 * high * np.sin(55.0 * t * word / (9.0 * high) + phase)
            up = up * (0.7 + 0.3 * np.sin(7.0 * t + phase))
            along = x + word * t + 0.12 * high * np.cos(55.0 * t * word / (9.0 * high))
            draw.line(list(zip(along.tolist(), (y + up).tolist(), strict=True)), fill=ink, width=3)
            x, wide = x + word + 0.6 * high, wide - word - 0.6 * high

    for k in range(int(rng.between(1, 4))):
        x, y, ink = 60.0 + 320.0 * k, rng.between(60.0, 130.0), inks[int(rng.random() * 4)]
        kind = rng.random()
        if kind < 0.5:
            write(x, y, 180.0, 30.0, ink)
            for row in range(int(rng.between(3, 9))):
                at = y + 60.0 + 48.0 * row
                draw.ellipse([x, at - 4, x + 8, at + 4], fill=ink)
                write(x + 24.0, at, rng.between(90.0, 250.0), 20.0, inks[int(rng.random() * 4)])
        elif kind < 0.8:
            for row in range(int(rng.between(2, 5))):
                at = y + 130.0 * row
                draw.rectangle([x, at, x + 190, at + 76], outline=ink, width=4)
                write(x + 24.0, at + 38.0, 130.0, 22.0, inks[2])
                if row:
                    draw.line([x + 95, at - 54, x + 95, at], fill=inks[1], width=4)
                    draw.line(
                        [x + 85, at - 14, x + 95, at, x + 105, at - 14], fill=inks[1], width=4
                    )
        else:
            draw.line([x, y, x, y + 260, x + 260, y + 260], fill=inks[2], width=4)
            t = np.linspace(0.0, 1.0, 40)
            bow = y + 240.0 - 200.0 * t ** rng.between(0.5, 2.2) + 14.0 * np.sin(9.0 * t)
            points = list(zip((x + 10 + 240 * t).tolist(), bow.tolist(), strict=True))
            draw.line(points, fill=inks[1], width=5)
            write(x + 40.0, y + 300.0, 180.0, 20.0, inks[0])
    return art.resize_texture(image, LONG_PX, SHORT_PX)


def _axes(w: int, h: int) -> tuple[Float32, Float32]:
    """Columns to the right and rows upwards, in [0, 1]."""
    x = ((np.arange(w) + 0.5) / w).astype(np.float32)[None, :]
    y = (1.0 - (np.arange(h) + 0.5) / h).astype(np.float32)[:, None]
    return x, y


def _noise(w: int, h: int, cells: tuple[int, int], octaves: int, rng: VariantRng) -> Float32:
    """Fractal noise about 0, with a standard deviation of 1."""
    field = fbm(cells, octaves, rng, size_px=_SIZE_PX)[:h, :w]
    made: Float32 = ((field - field.mean()) / max(float(field.std()), 1e-6)).astype(np.float32)
    return made


def _colors(rng: VariantRng) -> list[Float32]:
    return rng.shuffled([color(code) for code in rng.choose(_SCHEMES).split()])


def _over(image: Float32, tint: Float32, cover: Float32) -> None:
    """Lay a colour over an image where ``cover`` [h, w] is above 0."""
    share = np.clip(cover, 0.0, 1.0)[..., None].astype(np.float32)
    image *= 1.0 - share
    image += share * tint


def _canvas_weave(image: Float32, rng: VariantRng, amount: float = 0.05) -> UInt8:
    """The image as paint on cloth: uneven strokes."""
    h, w = image.shape[:2]
    strokes = _noise(w, h, (64, 24), 2, rng) + 0.6 * _noise(w, h, (16, 90), 2, rng)
    return quantize(np.clip(image * (1.0 + 0.4 * amount * strokes[..., None]), 0.0, 1.0))


def _fields(w: int, h: int, rng: VariantRng) -> UInt8:
    """An abstract painting: soft fields of colour above one another."""
    x, y = _axes(w, h)
    shades = _colors(rng)
    image = np.broadcast_to(shades[0], (h, w, 3)).astype(np.float32).copy()
    rough = 0.012 * _noise(w, h, (14, 14), 4, rng)
    low = 0.06
    for k in range(2 + int(rng.random() * 2)):
        high = min(low + rng.between(0.18, 0.45), 0.95)
        side = rng.between(0.05, 0.1)
        inside = np.minimum(np.minimum(x - side, 1.0 - side - x), np.minimum(y - low, high - y))
        _over(image, shades[1 + k % 4], smoothstep(-0.012, 0.02, inside + rough))
        low = high + 0.03
        if low > 0.8:
            break
    return _canvas_weave(image, rng, 0.06)


def _brushed(w: int, h: int, rng: VariantRng) -> UInt8:
    """An abstract painting: broad strokes and splashes."""
    x, y = _axes(w, h)
    shades = _colors(rng)
    image = np.broadcast_to(shades[0], (h, w, 3)).astype(np.float32).copy()
    for k in range(9):
        turn, at = rng.between(-1.2, 1.2), (rng.between(0.1, 0.9), rng.between(0.1, 0.9))
        dx, dy = (x - at[0]) * w / h, y - at[1]
        along = dx * math.cos(turn) + dy * math.sin(turn)
        across = dy * math.cos(turn) - dx * math.sin(turn) + rng.between(-0.9, 0.9) * along**2
        bristle = 0.02 * _noise(w, h, (6, 60), 3, rng) * (1.0 + 2.0 * np.abs(along))
        half = rng.between(0.02, 0.11)
        inside = np.minimum(half - np.abs(across), rng.between(0.15, 0.5) - np.abs(along))
        cover = smoothstep(0.0, 0.012, np.asarray(inside + bristle, np.float32))
        _over(image, shades[1 + k % 4], cover)
    return _canvas_weave(image, rng, 0.08)


def _poured(w: int, h: int, rng: VariantRng) -> UInt8:
    """An abstract painting: poured colours in bands that run around each other."""
    field = _noise(w, h, (3, 3), 4, rng) + 0.5 * _noise(w, h, (2, 2), 2, rng)
    stops = [(k / 4.0, shade) for k, shade in enumerate(_colors(rng))]
    wave = 0.5 + 0.5 * np.sin(rng.between(1.6, 3.2) * field)
    image = ramp(stops, wave.astype(np.float32))
    return _canvas_weave(image, rng, 0.03)


def _shapes(w: int, h: int, rng: VariantRng) -> UInt8:
    """A print: discs, arches and bars on paper."""
    x, y = _axes(w, h)
    shades = _colors(rng)
    image = np.broadcast_to(color(rng.choose(_PAPERS)), (h, w, 3)).astype(np.float32).copy()
    for k in range(5):
        cx, cy, r = rng.between(0.2, 0.8), rng.between(0.2, 0.8), rng.between(0.1, 0.26)
        dx, dy = (x - cx) * w / h, y - cy
        far = np.hypot(dx, dy)
        inside = (
            r - far,
            np.minimum(r - far, dy),
            np.minimum(np.minimum(r - far, far - 0.55 * r), dy),
            np.minimum(0.35 * r - np.abs(dx), 1.4 * r - np.abs(dy)),
        )[(k + int(rng.random() * 4)) % 4]
        _over(image, shades[k], smoothstep(0.0, 0.004, np.broadcast_to(inside, (h, w))))
    grain = 0.012 * _noise(w, h, (90, 90), 2, rng)[..., None]
    return quantize(np.clip(image + grain, 0.0, 1.0))


def _sky(y: Float32, w: int, h: int, horizon: float, rng: VariantRng, *, evening: bool) -> Float32:
    low, high = (
        (rng.choose(("#f4b07a", "#f0c9a8", "#e8977c")), rng.choose(("#5a6f9c", "#41557f")))
        if evening
        else (rng.choose(("#dfeaf0", "#e9ece8")), rng.choose(("#6f9fce", "#4d86bd", "#92b3cc")))
    )
    up = np.clip((y - horizon) / (1.0 - horizon), 0.0, 1.0)[..., None]
    image = np.broadcast_to(color(low) * (1.0 - up) + color(high) * up, (h, w, 3)).copy()
    clouds = _noise(w, h, (8, 3), 5, rng) + rng.between(-1.2, 0.6)
    pale = np.array([0.97, 0.95, 0.92], np.float32) if not evening else color("#f8d9b8")
    _over(image, pale, 0.8 * smoothstep(0.1, 1.6, clouds) * (1.0 - 0.4 * up[..., 0]))
    made: Float32 = image.astype(np.float32)
    return made


def _landscape(w: int, h: int, rng: VariantRng, *, painted: bool) -> UInt8:
    x, y = _axes(w, h)
    horizon = rng.between(0.36, 0.52)
    image = _sky(y, w, h, horizon, rng, evening=rng.chance(0.35))
    haze = image[int((1.0 - horizon) * h)].mean(axis=0)
    count = 4
    near = color(rng.choose(("#5b6b34", "#4a5a2c", "#7a7a3c", "#8b7b42", "#3f5b3a")))
    rock = rng.chance(0.45)
    for k in range(count):
        depth = k / (count - 1)
        rough = _noise(w, h, (1, 3 + 2 * k), 5, rng)[:1]
        high = (0.12 if rock and k < 2 else 0.035) * (1.0 - 0.55 * depth)
        top = horizon + 0.09 * (1.0 - depth) - 0.14 * k + high * rough
        cover = smoothstep(-0.003, 0.003, top - y)
        far = color("#6d7c93") if rock and k < 2 else near
        tint = haze + (far - haze) * (0.35 + 0.65 * depth)
        light = _noise(w, h, (10 + 12 * k, 14), 5, rng)
        spread = (0.05 + 0.14 * depth) * light[..., None]
        share = cover[..., None]
        image[:] = image * (1.0 - share) + share * np.clip(tint * (1.0 + spread), 0.0, 1.0)
    for _ in range(int(rng.random() * 3) + (0 if rock else 2)):
        _tree(image, x, y, (rng.between(0.05, 0.95), rng.between(0.12, horizon - 0.12)), rng)
    return _canvas_weave(image, rng, 0.07) if painted else _photograph(image, rng)


def _tree(
    image: Float32, x: Float32, y: Float32, foot: tuple[float, float], rng: VariantRng
) -> None:
    h, w = image.shape[:2]
    high = rng.between(0.14, 0.28)
    dx, dy = (x - foot[0]) * w / h, y - foot[1]
    trunk = np.minimum(0.012 * (1.3 - dy / high) - np.abs(dx), np.minimum(dy, 0.6 * high - dy))
    _over(image, color("#3b2f26"), smoothstep(0.0, 0.003, trunk))
    crown = 0.38 * high - np.hypot(dx, (dy - 0.68 * high) * 0.85)
    leaves = _noise(w, h, (30, 30), 4, rng)
    cover = smoothstep(0.0, 0.012, crown + 0.025 * leaves)
    shade = np.clip(0.75 + 0.9 * (dy - 0.6 * high) / high + 0.12 * leaves, 0.3, 1.3)
    tint = color(rng.choose(("#49622c", "#3c5a33", "#7d6a2b", "#93552a"))) * shade[..., None]
    share = cover[..., None]
    image[:] = image * (1.0 - share) + share * np.clip(tint, 0.0, 1.0)


def _photograph(image: Float32, rng: VariantRng, *, grey: bool | None = None) -> UInt8:
    """The image with the contrast, vignette and grain of a photographic print."""
    h, w = image.shape[:2]
    x, y = _axes(w, h)
    if rng.chance(0.3) if grey is None else grey:
        image = np.repeat((image @ np.array([0.3, 0.6, 0.1], np.float32))[..., None], 3, axis=2)
    image = smoothstep(-0.08, 1.06, image).astype(np.float32)
    corner = 1.0 - 0.45 * ((x - 0.5) ** 2 + (y - 0.5) ** 2)
    grain = 0.012 * _noise(w, h, (128, 128), 1, rng)
    return quantize(np.clip(image * corner[..., None] + grain[..., None], 0.0, 1.0))


def _hills_painted(w: int, h: int, rng: VariantRng) -> UInt8:
    return _landscape(w, h, rng, painted=True)


def _hills_taken(w: int, h: int, rng: VariantRng) -> UInt8:
    return _landscape(w, h, rng, painted=False)


def _sea(w: int, h: int, rng: VariantRng) -> UInt8:
    x, y = _axes(w, h)
    horizon = rng.between(0.38, 0.6)
    image = _sky(y, w, h, horizon, rng, evening=rng.chance(0.5))
    glow = image[int((1.0 - horizon) * h)].mean(axis=0)
    down = np.clip((horizon - y) / horizon, 0.0, 1.0)
    waves = _noise(w, h, (60, 5), 4, rng) * (0.35 + down) + 0.6 * _noise(w, h, (24, 4), 3, rng)
    deep = color(rng.choose(("#1f4a66", "#2d6a7a", "#33556b")))
    water = glow * 0.75 + (deep - glow * 0.75) * np.clip(0.25 + 1.1 * down, 0.0, 1.0)[..., None]
    water = np.clip(water * (1.0 + 0.13 * waves[..., None]), 0.0, 1.0)
    below = smoothstep(-0.001, 0.002, horizon - y)[..., None]
    image[:] = image * (1.0 - below) + water * below
    if rng.chance(0.5):
        sand = 0.12 + 0.03 * _noise(w, h, (1, 3), 3, rng)[:1] - y
        _over(image, color("#d9c6a0"), smoothstep(0.0, 0.004, sand))
        foam = np.exp(-((sand / 0.008) ** 2))
        _over(image, color("#f6f4ee"), 0.8 * foam)
    if rng.chance(0.5):
        sx, size = rng.between(0.25, 0.75), rng.between(0.06, 0.12)
        dx, dy = (x - sx) * w / h, y - horizon + 0.01
        sail = np.minimum(np.minimum(dy - 0.12 * size, dx), size * 0.5 - dx - 0.45 * dy)
        hull = np.minimum(
            0.1 * size - np.abs(dy - 0.02 * size), 0.45 * size - np.abs(dx - 0.1 * size)
        )
        _over(image, color("#f3efe4"), smoothstep(0.0, 0.002, sail))
        _over(image, color("#57362a"), smoothstep(0.0, 0.002, hull))
    return _photograph(image, rng) if rng.chance(0.6) else _canvas_weave(image, rng)


def _town(w: int, h: int, rng: VariantRng) -> UInt8:
    """A photograph of a town: houses with windows before a sky, at day or in the evening."""
    x, y = _axes(w, h)
    evening = rng.chance(0.5)
    image = _sky(y, w, h, 0.3, rng, evening=evening)
    for depth in range(3):
        left = -0.05
        while left < 1.0:
            wide, top = rng.between(0.07, 0.17), rng.between(0.28, 0.62) - 0.13 * depth
            stone = color(rng.choose(("#b8a58c", "#a06a52", "#c9c2b4", "#7d7f86", "#8e7b63")))
            haze = image[: h // 3].mean(axis=(0, 1))
            tint = haze + (stone * (0.4 if evening else 0.95) - haze) * (0.45 + 0.27 * depth)
            peak = top + rng.choose((0.0, 0.35)) * (0.5 * wide - np.abs(x - left - 0.5 * wide))
            inside = np.minimum(np.minimum(x - left, left + wide - x), peak - y)
            _over(image, tint, smoothstep(0.0, 0.003, inside))
            if depth:
                columns, rows = max(2, round(wide / 0.03)), max(2, round(top / 0.055))
                u, v = (x - left) / wide * columns, (top - y) / top * rows
                pane = np.minimum(0.28 - np.abs(u % 1.0 - 0.5), 0.32 - np.abs(v % 1.0 - 0.5))
                lit = (np.sin(12.9 * np.floor(u) + 78.2 * np.floor(v) + 9.0 * left) > 0.2) & evening
                wall = (inside > 0.004) & (y < top - 0.01) & (v < rows)
                image[(pane > 0.0) & wall & lit] = color("#f6cf86")
                image[(pane > 0.0) & wall & ~lit] = tint * 0.45
            left += wide
    return _photograph(image, rng)


def _forest(w: int, h: int, rng: VariantRng) -> UInt8:
    x, y = _axes(w, h)
    mist = color(rng.choose(("#dde4e4", "#e6e2d2", "#cfd8dc")))
    image = np.broadcast_to(mist, (h, w, 3)).astype(np.float32).copy()
    bark = color(rng.choose(("#2e2a26", "#3a3129", "#232a2a")))
    for depth in range(4):
        share = 0.25 + 0.25 * depth
        ground = 0.3 - 0.07 * depth + 0.015 * _noise(w, h, (1, 12), 4, rng)[:1]
        soil = color(rng.choose(("#5e5a36", "#6d5132", "#4f5f3c")))
        _over(image, mist + (soil - mist) * share, smoothstep(-0.01, 0.01, ground - y))
        for _ in range(9 - depth):
            at, half, lean = rng.between(0.0, 1.0), 0.004 + 0.006 * depth, rng.between(-0.03, 0.03)
            edge = 0.15 * half * _noise(w, h, (40, 3), 3, rng)
            inside = half * (1.25 - 0.5 * y) - np.abs(x - at - lean * y) + edge
            trunk = np.minimum(inside, y - ground)
            _over(image, mist + (bark - mist) * share, smoothstep(0.0, 0.003, trunk))
        leaves = _noise(w, h, (26 - 4 * depth, 26 - 4 * depth), 5, rng) + 3.2 * (y - 0.82)
        green = color(rng.choose(("#56683c", "#3f5a44", "#86702f")))
        _over(image, mist + (green - mist) * share, 0.7 * smoothstep(0.4, 1.3, leaves))
    return _photograph(image, rng)


def _botanical(w: int, h: int, rng: VariantRng) -> UInt8:
    """A botanical plate: a stalk with leaves, some with flowers, and a caption."""
    image = art.canvas(2 * w, 2 * h, _rgb(color(rng.choose(_PAPERS))))
    draw = art.pen(image)
    green = _rgb(color(rng.choose(("#4e6b3a", "#35573f", "#7c8a4c", "#5d7a68"))))
    scale = 2.0 * min(w, h)
    for k in range(1 if w < h else 3):
        foot = (w * (2.0 * (k + 0.5) / (1 if w < h else 3)), 1.72 * h)
        bend = rng.between(-0.12, 0.12) * scale
        stalk = [(foot[0] + bend * t * t, foot[1] - t * 1.5 * h) for t in np.linspace(0.0, 1.0, 24)]
        draw.line(stalk, fill=art.blend(green, (40, 40, 20), 0.3), width=max(3, int(0.008 * scale)))
        pairs, long = int(rng.between(4, 9)), rng.between(0.16, 0.3) * scale
        droop = rng.between(-0.5, 0.3)
        for i in range(pairs):
            x, y = stalk[3 + (20 * i) // pairs]
            size = long * (1.0 - 0.55 * i / pairs)
            for side in (-1, 1):
                tip = (x + side * size * math.cos(droop), y - size * (0.55 - math.sin(droop)))
                tint = art.blend(green, (235, 230, 190), rng.between(0.0, 0.35))
                art.leaf(draw, (x, y), tip, tint)
                draw.line([(x, y), tip], fill=art.blend(tint, (30, 40, 20), 0.45), width=2)
        if rng.chance(0.6):
            petal = _rgb(color(rng.choose(("#c8553d", "#d9a441", "#8c6aa8", "#d98ca0", "#e6e0d0"))))
            x, y = stalk[-1]
            for i in range(8):
                turn = math.pi * i / 4
                tip = (x + 0.09 * scale * math.cos(turn), y + 0.09 * scale * math.sin(turn))
                art.leaf(draw, (x, y), tip, petal)
            r = 0.022 * scale
            draw.ellipse([x - r, y - r, x + r, y + r], fill=(190, 150, 60))
    names = ("Folium", "Herba", "Flora", "Ramus", "Planta")
    word = f"{rng.choose(names)} {int(rng.between(1, 90))}"
    art.lettering(image, (0.3, 0.91, 0.7, 0.95), word, (70, 62, 50), "serif", 1)
    return art.resize_texture(image, w, h).albedo


def _line_drawing(w: int, h: int, rng: VariantRng) -> UInt8:
    """A line that is drawn in one go, on paper with a few flat colours."""
    image = art.canvas(2 * w, 2 * h, _rgb(color(rng.choose(_PAPERS))))
    draw = art.pen(image)
    shades = [_rgb(shade) for shade in _colors(rng)]
    for k in range(int(rng.random() * 3)):
        x, y, r = w * rng.between(0.5, 1.5), h * rng.between(0.5, 1.5), w * rng.between(0.2, 0.5)
        draw.ellipse([x - r, y - r, x + r, y + r], fill=art.blend(shades[k], (240, 235, 225), 0.35))
    t = np.linspace(0.0, 2.0 * math.pi, 400)
    for _ in range(1 + int(rng.random() * 2)):
        across, up = np.zeros_like(t), np.zeros_like(t)
        for wave in range(1, 5):
            across += rng.between(-1.0, 1.0) / wave * np.cos(wave * t + rng.between(0.0, 6.3))
            up += rng.between(-1.0, 1.0) / wave * np.sin(wave * t + rng.between(0.0, 6.3))
        reach = max(float(np.abs(across).max()), float(np.abs(up).max()), 0.1)
        points = [
            (w + 0.72 * w * a / reach, h + 0.72 * h * b / reach)
            for a, b in zip(across.tolist(), up.tolist(), strict=True)
        ]
        draw.line(points, fill=(30, 28, 28), width=int(rng.between(5, 10)), joint="curve")
    return art.resize_texture(image, w, h).albedo


def _rgb(shade: Float32) -> art.Color:
    r, g, b = (round(255 * float(v)) for v in shade)
    return (r, g, b)


def _map(w: int, h: int, rng: VariantRng) -> UInt8:
    """A town map: blocks between streets, a river and parks."""
    cells = worley((9, 9), rng, size_px=_SIZE_PX)
    fine = worley((26, 26), rng, size_px=_SIZE_PX)
    paper = color(rng.choose(_PAPERS))
    image = np.broadcast_to(paper * 0.93, (h, w, 3)).astype(np.float32).copy()
    lanes = (fine.second - fine.nearest)[:h, :w]
    roads = (cells.second - cells.nearest)[:h, :w]
    _over(image, color("#fbfaf6"), smoothstep(0.12, 0.06, lanes))
    green = _noise(w, h, (7, 7), 3, rng)
    _over(image, color("#c3d3a4"), smoothstep(1.05, 1.12, green))
    options = ("#e9b96a", "#d98f7a", "#ffffff")
    _over(image, color(rng.choose(options)), smoothstep(0.06, 0.035, roads))
    river = _noise(w, h, (2, 2), 3, rng)
    _over(image, color(rng.choose(("#8fb8cf", "#6f9db8"))), smoothstep(0.14, 0.1, np.abs(river)))
    if rng.chance(0.3):
        image = 0.12 + 0.16 * (1.0 - image)
    return quantize(np.clip(image, 0.0, 1.0))


def _child_drawing(w: int, h: int, rng: VariantRng) -> UInt8:
    """A child's drawing: house, sun, tree and people in wax crayon."""
    image = art.canvas(2 * w, 2 * h, (246, 244, 238))
    draw = art.pen(image)
    s = 2.0 * min(w, h)

    def stroke(points: list[tuple[float, float]], tint: art.Color, wide: float) -> None:
        dense = [
            (x0 + (x1 - x0) * t + rng.between(-0.006, 0.006) * s,
             y0 + (y1 - y0) * t + rng.between(-0.006, 0.006) * s)
            for (x0, y0), (x1, y1) in pairwise(points)
            for t in np.linspace(0.0, 1.0, 5)
        ]  # fmt: skip
        draw.line(dense, fill=tint, width=int(wide * s), joint="curve")

    def filled(x0: float, y0: float, x1: float, y1: float, tint: art.Color) -> None:
        for k in range(14):
            t = (k + 0.5) / 14
            stroke([(x0 + (x1 - x0) * t, y0), (x0 + (x1 - x0) * (t + 0.04), y1)], tint, 0.016)

    ground = 1.62 * h
    for k in range(40):
        x = 2.0 * w * k / 40
        stroke([(x, 2.0 * h), (x + 0.01 * s, ground)], (86, 160, 74), 0.014)
    sun = (rng.choose((0.25, 1.75)) * w, 0.3 * h)
    r = 0.09 * s
    draw.ellipse([sun[0] - r, sun[1] - r, sun[0] + r, sun[1] + r], fill=(248, 202, 46))
    for k in range(9):
        a = 2.0 * math.pi * k / 9
        ends = [(sun[0] + f * r * math.cos(a), sun[1] + f * r * math.sin(a)) for f in (1.2, 1.8)]
        stroke(ends, (248, 180, 40), 0.012)
    x, wide = rng.between(0.5, 1.0) * w, 0.34 * s
    wall = _rgb(color(rng.choose(("#c8553d", "#4a7fb5", "#d9a441", "#9a6aa8"))))
    filled(x, ground - 0.8 * wide, x + wide, ground, wall)
    eaves = ground - 0.8 * wide
    ridge = (x + 0.5 * wide, ground - 1.5 * wide)
    roof = [(x - 0.1 * wide, eaves), ridge, (x + 1.1 * wide, eaves), (x - 0.1 * wide, eaves)]
    stroke(roof, (120, 52, 40), 0.02)
    filled(x + 0.4 * wide, ground - 0.35 * wide, x + 0.6 * wide, ground, (92, 62, 40))
    for k in range(2 + int(rng.random() * 2)):
        px, tall = (0.2 + 0.35 * k) * w + (0.2 * w if k else 0.0), rng.between(0.14, 0.26) * s
        tint = _rgb(color(rng.choose(("#263c78", "#b3323c", "#2f7a4a", "#5d3a78"))))
        top = ground - tall
        q = 0.2 * tall
        draw.ellipse([px - q, top - q, px + q, top + q], outline=tint, width=int(0.012 * s))
        stroke([(px, top + q), (px, ground - 0.3 * tall)], tint, 0.013)
        stroke([(px - q, ground), (px, ground - 0.3 * tall), (px + q, ground)], tint, 0.013)
        stroke([(px - 1.4 * q, top + 1.6 * q), (px + 1.4 * q, top + 1.6 * q)], tint, 0.013)
    return art.resize_texture(image, w, h).albedo


def _still_life(w: int, h: int, rng: VariantRng) -> UInt8:
    """A still life in oils: a vase with flowers on a table."""
    x, y = _axes(w, h)
    back = color(rng.choose(("#5d5347", "#39463f", "#8a7f6a", "#2f3a4a", "#a89a86")))
    image = np.broadcast_to(back, (h, w, 3)).astype(np.float32).copy()
    image *= (1.0 + 0.16 * _noise(w, h, (4, 4), 4, rng) + 0.3 * (x - 0.4))[..., None]
    table = color(rng.choose(("#7a5236", "#a88a62", "#d9d0bd")))
    _over(image, table, np.broadcast_to(smoothstep(0.0, 0.01, 0.24 - y), (h, w)))
    dx = (x - rng.between(0.42, 0.58)) * w / h
    body = np.clip((y - 0.14) / 0.26, 0.0, 1.0)
    wide = (0.05 + 0.05 * np.sin(math.pi * body**0.8)) * ((y > 0.14) & (y < 0.42))
    light = np.clip(1.0 - 3.5 * np.abs(dx + 0.035) / 0.1, -0.6, 0.8)
    glaze = color(rng.choose(("#3d5f8a", "#d8d2c2", "#6b8f84", "#7a2f2a")))
    share = smoothstep(0.0, 0.006, wide - np.abs(dx))[..., None]
    image[:] = image * (1.0 - share) + share * np.clip(glaze * (1.0 + 0.4 * light[..., None]), 0, 1)
    for k in range(26):
        cx, cy = rng.between(-0.2, 0.2), rng.between(0.44, 0.8)
        cx *= 0.4 + 1.4 * (cy - 0.4)
        r = rng.between(0.025, 0.06)
        far = np.hypot(dx - cx, y - cy)
        ripple = r * (1.0 + 0.22 * np.sin(7.0 * np.arctan2(y - cy, dx - cx) + k)) - far
        bloom = ("#c94f4f", "#e3b34c", "#e9d8d0", "#b05a86", "#4d6a3c", "#3a5433", "#dd8a5a")
        tint = color(rng.choose(bloom)) * np.clip(1.15 - 0.5 * far / r, 0.5, 1.2)[..., None]
        share = smoothstep(0.0, 0.008, ripple)[..., None]
        image[:] = image * (1.0 - share) + share * np.clip(tint, 0.0, 1.0)
    return _canvas_weave(np.clip(image, 0.0, 1.0), rng, 0.09)


_MOTIFS: tuple[Callable[[int, int, VariantRng], UInt8], ...] = (
    _hills_painted,
    _botanical,
    _fields,
    _sea,
    _line_drawing,
    _town,
    _brushed,
    _forest,
    _map,
    _poured,
    _still_life,
    _hills_taken,
    _shapes,
    _child_drawing,
)
