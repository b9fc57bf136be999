"""Textures on the device, with their mip chains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from generator.core.geometry import TextureData
from generator.core.se3 import Array
from generator.renderers.kernels.records import Texture


@dataclass(frozen=True, eq=False, slots=True)
class DeviceTexture:
    """One texture on the device.

    Attributes:
        record: Value of a Texture record.
        keep: The device arrays that the record points to.
    """

    record: object
    keep: tuple[object, ...]
    nbytes: int


def upload_texture(data: TextureData, device: wp.Device) -> DeviceTexture:
    """A texture, ready for kernels."""
    levels = mip_levels(_linear_with_roughness(data))
    # Square roots spend the eight bits as evenly for the eye as sRGB does, and are quick to undo.
    texels = np.concatenate(
        [
            _packed(np.concatenate([np.sqrt(level[..., :3]), level[..., 3:]], axis=-1))
            for level in levels
        ]
    )
    sizes = [level.shape[0] * level.shape[1] for level in levels]
    record = Texture()
    record.height, record.width = data.albedo.shape[:2]
    record.levels = len(levels)
    offsets = wp.array(np.cumsum([0, *sizes[:-1]]), dtype=wp.int32, device=device)
    bumps = np.zeros(1, np.uint32) if data.normal is None else _packed_bumps(data.normal)
    on_device = [wp.array(values, dtype=wp.uint32, device=device) for values in (texels, bumps)]
    record.texels, record.bumps = on_device
    record.offsets = offsets
    record.has_bumps = int(data.normal is not None)
    return DeviceTexture(record.numpy_value(), (*on_device, offsets), texels.nbytes + bumps.nbytes)


def mip_levels(image: Array) -> list[Array]:
    """The image, halved again and again down to one texel, shape [h, w, channels] each.

    Odd sizes drop their last row or column: of a tiling image that is a shift nobody sees.
    """
    levels = [image]
    while max(levels[-1].shape[:2]) > 1:
        last = levels[-1]
        height, width = max(last.shape[0] // 2, 1), max(last.shape[1] // 2, 1)
        rows = last[: 2 * height].reshape(height, -1, last.shape[1], last.shape[2]).mean(axis=1)
        halved = rows[:, : 2 * width].reshape(height, width, -1, last.shape[2]).mean(axis=2)
        levels.append(halved)
    return levels


def srgb_to_linear(values: Array) -> Array:
    """IEC 61966-2-1, [0, 1] to [0, 1]."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def _linear_with_roughness(data: TextureData) -> Array:
    table = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)
    shape = data.albedo.shape[:2]
    roughness = np.full(shape, 255, np.uint8) if data.roughness is None else data.roughness
    grey = roughness.astype(np.float32)[..., None] / np.float32(255)
    return np.concatenate([table[data.albedo], grey], axis=-1)


def _packed_bumps(normal: NDArray[np.uint8]) -> NDArray[np.uint32]:
    opaque = np.full((*normal.shape[:2], 1), 255, np.uint8)
    image = np.concatenate([normal, opaque], axis=-1).astype(np.float32) / np.float32(255)
    return np.concatenate([_packed(level) for level in mip_levels(image)])


def _packed(level: Array) -> NDArray[np.uint32]:
    """Four channels in [0, 1] as one integer per texel, flat; the first channel lowest."""
    steps = np.clip(np.floor(level * 255.0 + 0.5), 0, 255).astype(np.uint8)
    return np.ascontiguousarray(steps).reshape(-1, 4).view("<u4").reshape(-1)
