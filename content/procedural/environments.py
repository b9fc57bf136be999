"""Light from all around: equirectangular images of relative luminance.

float32 [height, 2 * height, 3], linear RGB, mean luminance 1 over the sphere. Row 0 is the zenith;
column 0 is the direction -X, the centre column +X, and columns grow clockwise seen from above
(towards -Y).
"""

import math

import numpy as np
from numpy.typing import NDArray

from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.core import asset_types, colorimetry
from gen_data.core.noise import fbm, smoothstep, uniform
from gen_data.core.variant_rng import VariantRng
from gen_data.sky.equirectangular import normalize_luminance, pixel_directions

Array = NDArray[np.float64]


def neutral(rng: VariantRng) -> asset_types.Float32:
    """Grey, a little brighter from above: a light tent."""
    d = pixel_directions(64)
    slope = 0.25 if rng.seed == 0 else rng.between(0.0, 0.6)
    return normalize_luminance(np.repeat(1.0 + slope * d[..., 2:], 3, axis=2))


def studio(rng: VariantRng) -> asset_types.Float32:
    """A dim grey room with two to five soft boxes."""
    d = pixel_directions(128)
    image = np.repeat(0.16 + 0.1 * d[..., 2:] + 0.05 * smoothstep(0.0, -0.3, d[..., 2:]), 3, axis=2)
    for _ in range(rng.choose((2, 3, 3, 4, 5))):
        azimuth, height = rng.between(-math.pi, math.pi), rng.between(0.25, 1.3)
        size = rng.between(0.2, 0.6), rng.between(0.15, 0.45)
        tint = np.array(rng.choose(((1.0, 0.98, 0.95), (1.0, 0.92, 0.82), (0.9, 0.96, 1.0))))
        image += rng.between(4.0, 14.0) * _panel(d, azimuth, height, size)[..., None] * tint
    return normalize_luminance(image)


def indoor(rng: VariantRng) -> asset_types.Float32:
    """A room with a window, ceiling lamps and a wooden floor, seen from its middle."""
    d = pixel_directions(128)
    half = np.array([rng.between(2.0, 4.0), rng.between(1.8, 3.5), 1.3])
    reach = half / np.maximum(np.abs(d), 1e-6)
    hit = d * reach.min(axis=2, keepdims=True)
    side = reach.argmin(axis=2)
    walls = ("#e8e2d6", "#dfe3e3", "#d9cbb5", "#c9d3cf", "#efeae0")
    floors = ("#8a6242", "#6b4a33", "#9a9a97", "#a9865e")
    wall, floor = (np.array(hex_to_linear(rng.choose(codes))) for codes in (walls, floors))
    # Light falls off towards corners.
    corner = np.prod(1.0 - 0.5 * (np.abs(hit) / half) ** 6, axis=2)[..., None]
    image = np.where((side == 2)[..., None], np.where(d[..., 2:] > 0, 0.9, floor), wall) * corner
    image = image * rng.between(0.5, 0.8)
    image += _window(hit, side, half, rng.choose((0, 1)), rng.choose((-1.0, 1.0)), rng)
    warm = np.array(rng.choose(((1.0, 0.78, 0.52), (1.0, 0.86, 0.68), (1.0, 0.95, 0.9))))
    spacing, lamp = rng.between(1.0, 1.6), rng.between(10.0, 25.0)
    from_lamp = hit[..., :2] - np.round(hit[..., :2] / spacing) * spacing
    disc = smoothstep(0.2, 0.14, np.sqrt((from_lamp**2).sum(axis=2)))
    image += lamp * (disc * ((side == 2) & (d[..., 2] > 0)))[..., None] * warm
    return normalize_luminance(image)


def overcast(rng: VariantRng) -> asset_types.Float32:
    """A cloud deck over plain ground: three times brighter at the zenith than at the horizon.

    Moon and Spencer's overcast sky, CIE S 011/E:2003 type 1 in its traditional form.
    """
    d = pixel_directions(128)
    up = d[..., 2]
    clouds = 1 + rng.between(0.1, 0.3) * _clouds(d, rng)
    sky = (1 + 2 * np.maximum(up, 0)) / 3 * clouds
    tint = np.array((0.93, 0.98, 1.06))
    return normalize_luminance(_over_ground(sky[..., None] * tint, d, rng))


def clear_sky(rng: VariantRng) -> asset_types.Float32:
    """A blue sky without the sun's disc; add the sun as a light."""
    d = pixel_directions(128)
    sun = _direction(rng.between(-math.pi, math.pi), rng.between(0.5, 1.2))
    light = _perez(d, sun, (-1.0, -0.32, 10.0, -3.0, 0.45))
    up = np.maximum(d[..., 2:], 0.0)
    blue, pale = np.array((0.32, 0.62, 1.35)), np.array((0.86, 0.98, 1.12))
    haze = (1 - up) ** rng.between(3.0, 6.0)
    bright = smoothstep(1.0, 4.0, light / light.mean())[..., None]
    tint = blue + (pale - blue) * np.maximum(haze, bright)
    sky = light[..., None] * tint
    cover = smoothstep(rng.between(0.1, 0.9), 1.3, _clouds(d, rng))[..., None]
    sky = sky * (1 - cover) + cover * light.mean() * 2.2
    return normalize_luminance(_over_ground(sky, d, rng))


def sunset(rng: VariantRng) -> asset_types.Float32:
    """A low sun's glow, its disc left out."""
    d = pixel_directions(128)
    azimuth = rng.between(-math.pi, math.pi)
    sun = _direction(azimuth, rng.between(0.01, 0.12))
    towards = np.clip((d * sun).sum(axis=2), -1, 1)[..., None]
    up = np.maximum(d[..., 2:], 0.0)
    zenith = np.array(rng.choose(((0.1, 0.16, 0.34), (0.14, 0.17, 0.31), (0.07, 0.13, 0.29))))
    glow = np.array(rng.choose(((2.4, 0.95, 0.22), (2.6, 0.75, 0.25), (2.1, 1.15, 0.42))))
    far = np.array((0.32, 0.22, 0.28))
    low = np.exp(-up / rng.between(0.16, 0.3))
    horizon = far + (glow - far) * (0.5 + 0.5 * towards) ** 3
    sky = zenith * (0.6 + 0.4 * (0.5 + 0.5 * towards)) + horizon * low
    sky += 6.0 * glow * np.exp((towards - 1) / 0.02)
    lit = smoothstep(0.0, 1.0, _clouds(d, rng))[..., None] * smoothstep(0.0, 0.15, up)
    sky = sky * (1 - 0.5 * lit) + 0.5 * lit * (0.5 * glow * (0.5 + 0.5 * towards) ** 2 + 0.15)
    return normalize_luminance(_over_ground(sky, d, rng))


def night_city(rng: VariantRng) -> asset_types.Float32:
    """A dark sky over a skyline of lit windows and street lamps."""
    d = pixel_directions(128)
    rows, columns = d.shape[:2]
    elevation = np.arcsin(np.clip(d[..., 2], -1, 1))
    glow = np.exp(-np.maximum(elevation, 0) / 0.35)[..., None] * np.array((0.5, 0.36, 0.22))
    image = np.array((0.012, 0.018, 0.04)) + 0.22 * glow
    blocks = 64
    skyline = 0.05 + 0.38 * uniform(blocks, rng) ** 2
    roof = skyline[np.arange(columns) * blocks // columns]
    building = (elevation < roof) & (elevation > -0.02)
    window = uniform((rows, columns), rng)
    shade = np.array((0.05, 0.05, 0.06))
    cold = uniform((rows, columns), rng)[..., None] > 0.8
    warm = np.array((1.0, 0.72, 0.4)) + np.array((-0.25, 0.15, 0.5)) * cold
    lit = (window > rng.between(0.75, 0.9))[..., None] * 6.0 * warm
    image = np.where(building[..., None], shade + lit, image)
    below = d[..., 2] < -0.02
    street = 0.1 + 0.5 * np.exp(elevation / 0.25)
    image = np.where(below[..., None], street[..., None] * np.array((0.5, 0.36, 0.22)), image)
    for _ in range(rng.choose((5, 8, 12))):
        lamp = _direction(rng.between(-math.pi, math.pi), rng.between(0.08, 0.5))
        away = np.arccos(np.clip((d * lamp).sum(axis=2), -1, 1))
        glow = rng.between(20.0, 50.0) * np.exp(-((away / 0.035) ** 2))[..., None]
        tint = rng.choose(((1.0, 0.66, 0.3), (1.0, 0.85, 0.62), (0.85, 0.95, 1.0)))
        image += glow * np.array(tint)
    return normalize_luminance(image)


def _direction(azimuth_rad: float, elevation_rad: float) -> Array:
    flat = math.cos(elevation_rad)
    x, y = flat * math.cos(azimuth_rad), flat * math.sin(azimuth_rad)
    return np.array([x, y, math.sin(elevation_rad)])


def _panel(d: Array, azimuth: float, height: float, half_size: tuple[float, float]) -> Array:
    """Coverage of a rectangle at unit distance that faces the centre."""
    forward = _direction(azimuth, height)
    right = np.array([math.sin(azimuth), -math.cos(azimuth), 0.0])
    up = np.cross(right, forward)
    depth = (d * forward).sum(axis=2)
    u = (d * right).sum(axis=2) / np.maximum(depth, 1e-6)
    v = (d * up).sum(axis=2) / np.maximum(depth, 1e-6)
    w, h = half_size
    soft = 0.03
    across = smoothstep(w + soft, w - soft, np.abs(u))
    along = smoothstep(h + soft, h - soft, np.abs(v))
    inside: Array = (depth > 0) * across * along
    return inside


def _window(hit: Array, side: Array, half: Array, axis: int, sign: float, rng: VariantRng) -> Array:
    """Daylight through two panes in one wall."""
    along, z = hit[..., 1 - axis], hit[..., 2]
    width, centre = (0.5 * float(half[1 - axis]), rng.between(-0.3, 0.3) * float(half[1 - axis]))
    on_wall = (side == axis) & (hit[..., axis] * sign > 0)
    u = np.abs(along - centre)
    pane = smoothstep(width, width - 0.04, u) * smoothstep(0.03, 0.07, u)
    pane = pane * smoothstep(-0.4, -0.34, z) * smoothstep(0.85, 0.79, z)
    outside = rng.between(4.0, 14.0) * (0.45 + 0.55 * smoothstep(-0.1, 0.25, z))
    daylight: Array = (pane * on_wall * outside)[..., None] * np.array((0.85, 0.97, 1.12))
    return daylight


def _clouds(d: Array, rng: VariantRng) -> Array:
    """Noise on a flat layer above, in about [-1, 1]; fades towards the horizon."""
    size = 512
    field = fbm((4, 4), 6, rng, 0.55, size).astype(np.float64)
    up = np.maximum(d[..., 2], 0.0)
    scale = 0.12 * size / (up + 0.12)
    row, column = ((np.floor(d[..., i] * scale).astype(np.int64)) % size for i in (0, 1))
    clouds: Array = field[row, column] * smoothstep(0.0, 0.25, up) / 0.6
    return clouds


def _perez(d: Array, sun: Array, c: tuple[float, float, float, float, float]) -> Array:
    """Relative luminance of the sky: CIE S 011/E:2003; sun's surroundings limited."""
    up = np.maximum(d[..., 2], 0.02)
    angle = np.arccos(np.clip((d * sun).sum(axis=2), -1.0, 1.0))
    gradation = 1 + c[0] * np.exp(c[1] / up)
    forward = c[2] * (np.exp(c[3] * angle) - math.exp(c[3] * math.pi / 2))
    light = gradation * (1 + forward + c[4] * np.cos(angle) ** 2)
    sky: Array = np.minimum(light, 8.0 * float(light.mean()))
    return sky


def _over_ground(sky: Array, d: Array, rng: VariantRng) -> Array:
    """The sky above the horizon, and ground below that reflects a fifth or so of its mean."""
    above = smoothstep(-0.01, 0.01, d[..., 2:])
    soil = np.array(hex_to_linear(rng.choose(("#8c8a84", "#7d7f73", "#94866f", "#8b9094"))))
    # The ground is lit by the sky and by a sun outside the image: light whiter than the sky.
    mean = sky[: sky.shape[0] // 2].mean(axis=(0, 1))
    upper = 0.35 * mean + 0.65 * float(colorimetry.luminance(mean))
    ground = soil * upper * (1.0 - 0.25 * smoothstep(0.0, -1.0, d[..., 2:]))
    mixed: Array = sky * above + ground * (1 - above)
    return mixed
