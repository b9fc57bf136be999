"""Materials as the records that kernels read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.renderers.warp.scene.body_materials import BodyMaterials
from gen_data.generator.renderers.warp.scene.device_textures import DeviceTexture
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.scene.struct_dtypes import stack_records


def surface_records(
    looks: Sequence[BodyMaterials], textures: Mapping[str, DeviceTexture]
) -> NDArray[np.void]:
    """Surface records of all bodies, body after body; at least one.

    Args:
        looks: Of the bodies.
        textures: All that the bodies name, in the order of the device's textures.
    """
    values = stack_records([look.surfaces for look in looks], records.MaterialRecord)
    place = {texture_id: k for k, texture_id in enumerate(textures)}
    listed = np.array([*(place[t] for look in looks for t in look.textures), -1], np.int32)
    counts = np.array([len(look.textures) for look in looks], np.int64)
    first = np.repeat(np.cumsum(counts) - counts, [len(look.materials) for look in looks])
    if not len(first):
        return values
    local = values["texture"]
    values["texture"] = np.where(local < 0, -1, listed[first + np.maximum(local, 0)])
    mapped = np.array([*(texture.layered for texture in textures.values()), False])
    values["layered"] = (
        (values["coat"] > 0.0)
        | (values["transmission"] > 0.0)
        | (values["opacity"] < 1.0)
        | ((values["metallic"] >= 0.5) & (values["roughness"] < records.MIRROR_ROUGHNESS))
        | mapped[values["texture"]]
    )
    return values


def cutout_slots(
    surfaces: NDArray[np.void], textures: Mapping[str, DeviceTexture]
) -> NDArray[np.int32]:
    """By surface, HOLES where its texture has any, and CLEAR where it casts no shadow."""
    holes = np.array([*(texture.has_cutouts for texture in textures.values()), False])
    clear = (surfaces["transmission"] > 0.5) | (surfaces["opacity"] < 0.5)
    flags = holes[surfaces["texture"]] * int(records.HOLES) + clear * int(records.CLEAR)
    slots: NDArray[np.int32] = flags.astype(np.int32)
    return slots


def cutout_bodies(slots: NDArray[np.int32], counts: NDArray[np.int64]) -> NDArray[np.int32]:
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
