"""Materials as the records that kernels read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from generator.core.geometry import Material
from generator.renderers.kernels import records
from generator.renderers.textures import DeviceTexture

MIRROR_ROUGHNESS = 0.15
"""Smoother surfaces than this mirror what is around them; on others an environment will do."""


def surface_records(
    materials: Sequence[Material], textures: Mapping[str, DeviceTexture]
) -> NDArray[np.void]:
    """Surface records of materials, in their order; at least one.

    Args:
        materials: Any.
        textures: All that the materials name, in the order of the device's textures.
    """
    values = np.zeros(max(len(materials), 1), dtype=records.Surface.numpy_dtype())
    if not materials:
        return values
    places = {"": -1, **{texture_id: k for k, texture_id in enumerate(textures)}}
    # Column by column: there are thousands in a street, and filling in one record takes long.
    values["texture"] = [places[m.texture] for m in materials]
    for name in ("base_color", "roughness", "metallic", "specular", "texture_scale_m"):
        values[name] = [getattr(m, name) for m in materials]
    for name in ("emission_cd_m2", "coat", "coat_roughness", "transmission", "ior", "thin"):
        values[name] = [getattr(m, name) for m in materials]
    values["opacity"] = [m.opacity for m in materials]
    mapped = np.array([*(texture.layered for texture in textures.values()), False])
    values["layered"] = (
        (values["coat"] > 0.0)
        | (values["transmission"] > 0.0)
        | (values["opacity"] < 1.0)
        | ((values["metallic"] >= 0.5) & (values["roughness"] < MIRROR_ROUGHNESS))
        | mapped[values["texture"]]
    )
    return values


def pierced_slots(
    surfaces: NDArray[np.void], textures: Mapping[str, DeviceTexture]
) -> NDArray[np.int32]:
    """By surface, HOLES where its texture has any, and CLEAR where it casts no shadow."""
    holes = np.array([*(texture.pierced for texture in textures.values()), False])
    clear = (surfaces["transmission"] > 0.5) | (surfaces["opacity"] < 0.5)
    flags = holes[surfaces["texture"]] * int(records.HOLES) + clear * int(records.CLEAR)
    slots: NDArray[np.int32] = flags.astype(np.int32)
    return slots


def pierced_bodies(slots: NDArray[np.int32], counts: NDArray[np.int64]) -> NDArray[np.int32]:
    """The union of the flags of each body's slots.

    Args:
        slots: Of all bodies' materials, body after body.
        counts: Materials of each body.
    """
    if not slots.any():
        return np.zeros(len(counts), np.int32)
    of_slots = np.repeat(np.arange(len(counts)), counts)
    bodies = np.zeros(len(counts), np.int32)
    np.bitwise_or.at(bodies, of_slots, slots[: len(of_slots)])
    return bodies
