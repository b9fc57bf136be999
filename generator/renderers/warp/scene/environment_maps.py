"""Environments on the device: irradiance, prefiltered reflections and the image itself.

The brightest parts of a panorama are extracted as lamps at infinity. Environment light casts no
shadows here, but a sun, a window or a softbox in a panorama should. Each such part becomes a disk
in the sky with the part's vector irradiance: a surface with the whole part above its horizon
receives exactly the same light, whatever the part's shape.

Source of the idea: Debevec, "A median cut algorithm for light probe sampling", SIGGRAPH 2005
posters; here only outstanding parts are extracted, and the rest remains an image.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core.asset_types import Float32
from gen_data.core.colorimetry import luminance
from gen_data.core.mapped_files import owned_bytes
from gen_data.core.se3 import Array, Vec3
from gen_data.renderers.warp.device import launch
from gen_data.renderers.warp.scene.kernels.environment_lighting import prefilter, weigh_texels


def texel_directions(height: int) -> tuple[Array, Array]:
    """Unit directions [h, 2h, 3] and solid angles [h, 2h] of an equirectangular image.

    Row 0 is the zenith; column 0 is -X, the centre is +X, columns grow clockwise from above.
    """
    width = 2 * height
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    polar = np.pi * (np.arange(height) + 0.5) / height
    azimuth = np.pi - 2.0 * np.pi * (np.arange(width) + 0.5) / width
    x = np.sin(polar)[:, None] * np.cos(azimuth)[None]
    y = np.sin(polar)[:, None] * np.sin(azimuth)[None]
    z = np.broadcast_to(np.cos(polar)[:, None], x.shape)
    solid = np.broadcast_to((edges[:-1] - edges[1:])[:, None] * 2.0 * np.pi / width, x.shape)
    return np.stack([x, y, z], axis=-1), solid


LAMPS_MAX = 3
# Rows of the reduced image in which parts are detected.
_SEARCH_ROWS = 128
# Thresholds in units of the mean luminance, highest first: a sun is found before its halo.
_LEVELS = (2048.0, 256.0, 32.0, 4.0)
# Panes of one window are closer together than this.
_GAP_RAD = math.radians(3.0)
# Minimum share of the light on a surface that faces the part, and of the strongest part's.
_SHARE = 0.1
# Quantile of the luminance around a part, which remains in the image.
_RIM = 0.25
# Parts with less light than this, per mean luminance, are skipped.
_FAINT = 0.08
# Shadows of wider parts are invisible.
_RADIUS_RAD_MAX = math.radians(25.0)


@dataclass(frozen=True, slots=True)
class SkyLamp:
    """A bright part of a panorama, in the panorama's frame.

    Attributes:
        towards: Unit vector from the scene to it.
        power: Linear RGB illuminance of a surface that faces it, per mean luminance of the
            panorama.
        share: Its share of the panorama's light on such a surface.
        angular_radius_rad: Angular radius of a disk with the same spread.
    """

    towards: Vec3
    power: Vec3
    share: float
    angular_radius_rad: float


def remove_peaks(image: Float32) -> tuple[Float32, tuple[SkyLamp, ...]]:
    """The panorama without its brightest parts, and those parts, the strongest first.

    The panorama itself if there are none. It is equirectangular, of mean luminance 1, [h, 2h, 3].
    """
    if float(_search_luminance(image).max()) <= _LEVELS[-1]:
        return image, ()
    sphere = _Sphere(*texel_directions(image.shape[0]), luminance(image.astype(np.float64)))
    rest, found = image.astype(np.float64), []
    for level in _LEVELS:
        for part, floor in _find_parts(_search_luminance(rest), level, sphere.luminance.shape):
            excess = _excess(rest, part, floor)
            lamp = _fit_lamp(excess, sphere)
            if lamp.share > _SHARE and lamp.angular_radius_rad < _RADIUS_RAD_MAX:
                found.append((lamp, excess))
                rest = rest - excess
    found.sort(key=lambda pair: -_strength(pair[0]))
    kept = [lamp for lamp, _ in found if _strength(lamp) > _SHARE * _strength(found[0][0])]
    kept = kept[:LAMPS_MAX]
    for _, excess in found[len(kept) :]:
        rest = rest + excess
    return (rest.astype(np.float32), tuple(kept)) if kept else (image, ())


@dataclass(frozen=True, eq=False, slots=True)
class _Sphere:
    """Unit directions, solid angles and luminance of an image's texels."""

    directions: Array
    solid: Array
    luminance: Array


def _search_luminance(image: Array | Float32) -> Array:
    height = image.shape[0]
    if height > _SEARCH_ROWS:
        size = (2 * _SEARCH_ROWS, _SEARCH_ROWS)
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return luminance(image.astype(np.float64))


def _find_parts(
    small: Array, level: float, shape: tuple[int, ...]
) -> Iterator[tuple[NDArray[np.bool_], float]]:
    """Connected parts above a level in units of the mean: masks of a shape, luminance around them.

    ``small`` is a result of ``_search_luminance``.
    """
    bright = small > level
    if not bright.any():
        return
    rows = small.shape[0]
    reach = max(round(_GAP_RAD / math.pi * rows), 1)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    # The image wraps around horizontally.
    around = np.pad(bright.astype(np.uint8), ((0, 0), (reach, reach)), mode="wrap")
    grown = np.ascontiguousarray(cv2.dilate(around, kernel)[:, reach:-reach])
    count, labels = cv2.connectedComponents(grown, connectivity=8)
    labels = np.asarray(_merge_labels(labels, count), dtype=np.int32)[labels]
    flux = small * texel_directions(rows)[1] * bright
    totals = np.bincount(labels.reshape(-1), weights=flux.reshape(-1), minlength=count)
    size = (shape[1], shape[0])
    for label in np.flatnonzero(totals > _FAINT).tolist():
        mask = labels == label
        whole = cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
        rim = small[mask & ~bright]
        floor = float(np.quantile(rim, _RIM)) if rim.size else float(small[mask].min())
        yield whole.astype(bool), floor


def _merge_labels(labels: NDArray[np.int32], count: int) -> list[int]:
    """Representative of each label, merging parts that meet across the image's ends."""
    first = list(range(count))
    for left, right in zip(labels[:, 0].tolist(), labels[:, -1].tolist(), strict=True):
        if left and right:
            low, high = sorted((first[left], first[right]))
            first = [low if label == high else label for label in first]
    return first


def _excess(image: Array, part: NDArray[np.bool_], floor: float) -> Array:
    """The part above the floor, in its own colours; 0 elsewhere. Shape of the image."""
    bright = luminance(image.astype(np.float64))
    brighter = part & (bright > floor)
    share = np.where(brighter, 1.0 - floor / np.where(brighter, bright, 1.0), 0.0)
    return np.asarray(image * share[..., None])


def _fit_lamp(excess: Array, sphere: _Sphere) -> SkyLamp:
    weights = luminance(excess) * sphere.solid
    flow = np.array([float((weights * sphere.directions[..., k]).sum()) for k in range(3)])
    towards = flow / math.sqrt(float((flow * flow).sum()))
    cosine = _cosine(towards, sphere)
    projected = sphere.solid * cosine
    red, green, blue = (float((excess[..., k] * projected).sum()) for k in range(3))
    # For a disk of radius r in the sky, the mean of 1 - cos of the angle from its centre is (1 -
    # cos r) / 2. The texels' own extent is subtracted.
    total = float(weights.sum())
    spread = 2.0 * float((weights * (1.0 - cosine)).sum()) / total
    texel = float((weights * sphere.solid).sum()) / total / (2.0 * math.pi)
    radius_rad = math.acos(max(1.0 - spread - texel, -1.0))
    lux = float((sphere.luminance * sphere.solid * np.maximum(cosine, 0.0)).sum())
    share = float((weights * cosine).sum()) / lux
    x, y, z = (float(v) for v in towards)
    return SkyLamp((x, y, z), (red, green, blue), share, radius_rad)


def _cosine(towards: Vec3 | Array, sphere: _Sphere) -> Array:
    x, y, z = (sphere.directions[..., k] * float(towards[k]) for k in range(3))
    return np.asarray(x + y + z)


def _strength(lamp: SkyLamp) -> float:
    return float(luminance(np.asarray(lamp.power)))


_GLOSSY_LEVELS = 4
_GLOSSY_SIZE = 24
_LANES = 8
# Source resolution of each level: its lobe is wider than a texel of that size.
_SOURCE_HEIGHTS = (48, 24, 24, 24)
_IRRADIANCE_HEIGHT = 32
# Finer images are split at this resolution: time and memory grow with the texels.
_SPLIT_HEIGHT = 512


@dataclass(frozen=True, eq=False, slots=True)
class DeviceEnvironment:
    """One environment of mean luminance 1; arrays as of EnvironmentRecord.

    Attributes:
        lamps: Lamps that replace the parts missing from ``rest``.
        nbytes: Bytes owned: on the CPU, without mapped files.
    """

    irradiance: wp.array
    glossy: wp.array
    image: wp.array
    rest: wp.array
    lamps: tuple[SkyLamp, ...]
    nbytes: int


def upload_environment(image: Float32, device: wp.Device) -> DeviceEnvironment:
    """Upload an equirectangular image [h, 2h, 3] as light without shadows.

    On the CPU, the environment refers to the image itself: it must not change.
    """
    image = np.ascontiguousarray(image, np.float32)
    shown = wp.array(image, dtype=wp.vec3, device=device, copy=not device.is_cpu)
    owned = owned_bytes(image) if device.is_cpu else image.nbytes
    return _upload(image, (), shown, shown, owned)


def upload_split(image: Float32, whole: DeviceEnvironment) -> DeviceEnvironment:
    """The same environment with its brightest parts as lamps; ``whole`` itself without any."""
    light = _shrink(image, _SPLIT_HEIGHT)
    rest, lamps = remove_peaks(light)
    if not lamps:
        return whole
    dimmed = _dim(image, light, rest)
    mirrored = wp.array(dimmed, dtype=wp.vec3, device=whole.image.device)
    return _upload(rest, lamps, whole.image, mirrored, dimmed.nbytes)


def _dim(image: Float32, light: Float32, rest: Float32) -> Float32:
    """Darken the image as its reduced copy ``light`` is darkened in ``rest``."""
    if image.shape == rest.shape:
        return rest
    before = luminance(light)
    left = luminance(rest) / np.where(before > 0.0, before, 1.0)
    size = (image.shape[1], image.shape[0])
    part = cv2.resize(left.astype(np.float32), size, interpolation=cv2.INTER_NEAREST)
    return np.asarray(image * part[..., None])


def _upload(
    light: Float32, lamps: tuple[SkyLamp, ...], image: wp.array, rest: wp.array, nbytes: int
) -> DeviceEnvironment:
    device = image.device
    sources = {height: _shrink(light, height) for height in {*_SOURCE_HEIGHTS}}
    maps = np.stack(
        [
            add_border(_prefilter_level(sources[height], level, device).numpy())
            for level, height in enumerate(_SOURCE_HEIGHTS, start=1)
        ]
    )
    irradiance = irradiance_coefficients(_shrink(light, _IRRADIANCE_HEIGHT))
    return DeviceEnvironment(
        wp.array(irradiance, dtype=wp.vec3, device=device),
        wp.array(maps, dtype=wp.vec3, device=device),
        image,
        rest,
        lamps,
        maps.nbytes + nbytes,
    )


def irradiance_coefficients(image: Float32) -> Array:
    """Nine RGB coefficients of irradiance over pi, with the basis constants included.

    Source: Ramamoorthi and Hanrahan 2001, equations 3, 8 and 10.
    """
    directions, solid = texel_directions(image.shape[0])
    x, y, z = np.moveaxis(directions, -1, 0)
    one = np.ones_like(x)
    basis = np.stack([one, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y])
    norm = np.array([0.282095, *[0.488603] * 3, 1.092548, 1.092548, 0.315392, 1.092548, 0.546274])
    transfer = np.array([1.0, *[2.0 / 3.0] * 3, *[0.25] * 5])
    moments = np.einsum("khw,hw,hwc->kc", basis, solid, image.astype(np.float64), optimize=False)
    return np.asarray(moments * (norm * norm * transfer)[:, None])


def add_border(maps: Float32) -> Float32:
    """An octahedral map [n, n, 3] with a border across its folds, [n + 2, n + 2, 3]."""
    wide = np.pad(maps, ((1, 1), (1, 1), (0, 0)), mode="edge")
    wide[0, 1:-1], wide[-1, 1:-1] = maps[0, ::-1], maps[-1, ::-1]
    wide[1:-1, 0], wide[1:-1, -1] = maps[::-1, 0], maps[::-1, -1]
    wide[0, 0], wide[-1, -1] = maps[-1, -1], maps[0, 0]
    wide[0, -1], wide[-1, 0] = maps[-1, 0], maps[0, -1]
    return wide


def _prefilter_level(source: Float32, level: int, device: wp.Device) -> wp.array:
    shares = _texel_weights(source.shape[0], level, device.alias)
    smoothed = wp.zeros(_GLOSSY_SIZE**2, dtype=wp.vec3, device=device)
    radiance = wp.array(source.reshape(-1, 3), dtype=wp.vec3, device=device)
    lanes = _LANES if device.is_cpu else 1
    inputs = [shares, radiance, lanes]
    launch(prefilter, _GLOSSY_SIZE**2 // lanes, inputs, [smoothed], device=device)
    return smoothed.reshape((_GLOSSY_SIZE, _GLOSSY_SIZE))


# Environments of one size share these weights, and every view may have another environment.
@lru_cache(maxsize=_GLOSSY_LEVELS)
def _texel_weights(height: int, level: int, device: str) -> wp.array:
    """Weights computed by ``weigh_texels``, float [groups of map texels, texels, lanes]."""
    directions, solid = texel_directions(height)
    roughness = level / _GLOSSY_LEVELS
    shape = (_GLOSSY_SIZE**2 // _LANES, solid.size, _LANES)
    shares = wp.zeros(shape, dtype=float, device=device)
    inputs = [
        wp.array(directions.reshape(-1, 3), dtype=wp.vec3, device=device),
        wp.array(solid.reshape(-1), dtype=float, device=device),
        roughness * roughness,
        _GLOSSY_SIZE,
    ]
    launch(weigh_texels, _GLOSSY_SIZE**2, inputs, [shares], device=wp.get_device(device))
    return shares


def _shrink(image: Float32, height: int) -> Float32:
    if image.shape[0] <= height:
        return image
    size = (2 * height, height)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
