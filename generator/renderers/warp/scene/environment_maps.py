"""Environments on the device: irradiance, prefiltered reflections and the image itself."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import warp as wp

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.core.colorimetry import luminance
from gen_data.generator.core.se3 import Array
from gen_data.generator.renderers.warp.scene.envmap_peaks import (
    SkyLamp,
    remove_peaks,
    texel_directions,
)
from gen_data.generator.renderers.warp.scene.kernels.environment_lighting import (
    prefilter,
    weigh_texels,
)

_GLOSSY_LEVELS = 4
_GLOSSY_SIZE = 24
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
    """

    irradiance: wp.array
    glossy: wp.array
    image: wp.array
    rest: wp.array
    lamps: tuple[SkyLamp, ...]
    nbytes: int


def upload_environment(image: Float32, device: wp.Device) -> DeviceEnvironment:
    """Upload an equirectangular image [h, 2h, 3] as light without shadows."""
    shown = wp.array(image, dtype=wp.vec3, device=device)
    return _upload(image, (), shown, shown)


def upload_split(image: Float32, whole: DeviceEnvironment) -> DeviceEnvironment:
    """The same environment with its brightest parts as lamps; ``whole`` itself without any."""
    light = _shrink(image, _SPLIT_HEIGHT)
    rest, lamps = remove_peaks(light)
    if not lamps:
        return whole
    mirrored = wp.array(_dim(image, light, rest), dtype=wp.vec3, device=whole.image.device)
    return _upload(rest, lamps, whole.image, mirrored)


def _dim(image: Float32, light: Float32, rest: Float32) -> Float32:
    """Darken the image as its reduced copy ``light`` is darkened in ``rest``."""
    if image.shape == rest.shape:
        return rest
    before = luminance(light)
    left = luminance(rest) / np.where(before > 0.0, before, 1.0)
    size = (image.shape[1], image.shape[0])
    part = cv2.resize(left.astype(np.float32), size, interpolation=cv2.INTER_NEAREST)
    dimmed: Float32 = image * part[..., None]
    return dimmed


def _upload(
    light: Float32, lamps: tuple[SkyLamp, ...], image: wp.array, rest: wp.array
) -> DeviceEnvironment:
    device = image.device
    maps = np.stack(
        [
            add_border(_prefilter_level(light, level, device).numpy())
            for level in range(1, _GLOSSY_LEVELS + 1)
        ]
    )
    irradiance = irradiance_coefficients(_shrink(light, _IRRADIANCE_HEIGHT))
    return DeviceEnvironment(
        wp.array(irradiance, dtype=wp.vec3, device=device),
        wp.array(maps, dtype=wp.vec3, device=device),
        image,
        rest,
        lamps,
        maps.nbytes + 12 * int(rest.size),
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
    coefficients: Array = moments * (norm * norm * transfer)[:, None]
    return coefficients


def add_border(maps: Float32) -> Float32:
    """An octahedral map [n, n, 3] with a border across its folds, [n + 2, n + 2, 3]."""
    wide = np.pad(maps, ((1, 1), (1, 1), (0, 0)), mode="edge")
    wide[0, 1:-1], wide[-1, 1:-1] = maps[0, ::-1], maps[-1, ::-1]
    wide[1:-1, 0], wide[1:-1, -1] = maps[::-1, 0], maps[::-1, -1]
    wide[0, 0], wide[-1, -1] = maps[-1, -1], maps[0, 0]
    wide[0, -1], wide[-1, 0] = maps[-1, 0], maps[0, -1]
    return wide


def _prefilter_level(image: Float32, level: int, device: wp.Device) -> wp.array:
    source = _shrink(image, _SOURCE_HEIGHTS[level - 1])
    shares = _texel_weights(source.shape[0], level, device.alias)
    smoothed = wp.zeros(_GLOSSY_SIZE**2, dtype=wp.vec3, device=device)
    radiance = wp.array(source.reshape(-1, 3), dtype=wp.vec3, device=device)
    wp.launch(prefilter, _GLOSSY_SIZE**2 // 4, [shares, radiance], [smoothed], device=device)
    return smoothed.reshape((_GLOSSY_SIZE, _GLOSSY_SIZE))


# Environments of one size share these weights, and every view may have another environment.
@lru_cache(maxsize=_GLOSSY_LEVELS)
def _texel_weights(height: int, level: int, device: str) -> wp.array:
    """Weights computed by ``weigh_texels``, float [map texels, texels]."""
    directions, solid = texel_directions(height)
    roughness = level / _GLOSSY_LEVELS
    shares = wp.zeros((_GLOSSY_SIZE**2, solid.size), dtype=float, device=device)
    inputs = [
        wp.array(directions.reshape(-1, 3), dtype=wp.vec3, device=device),
        wp.array(solid.reshape(-1), dtype=float, device=device),
        roughness * roughness,
        _GLOSSY_SIZE,
    ]
    wp.launch(weigh_texels, _GLOSSY_SIZE**2, inputs, [shares], device=device)
    return shares


def _shrink(image: Float32, height: int) -> Float32:
    if image.shape[0] <= height:
        return image
    size = (2 * height, height)
    shrunk: Float32 = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return shrunk
