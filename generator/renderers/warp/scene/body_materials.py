"""Materials as records, made once per body and remembered."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import SURFACES, Material
from gen_data.generator.core.scene import Scene
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.scene.kernels.records import MaterialRecord
from gen_data.generator.renderers.warp.scene.struct_dtypes import struct_dtype

_COLUMNS = (
    "base_color", "roughness", "metallic", "specular", "texture_scale_m", "emission_cd_m2", "coat",
    "coat_roughness", "transmission", "ior", "thin", "opacity",
)  # fmt: skip
_SURFACE = {role: number for number, role in enumerate(SURFACES)}


@dataclass(frozen=True, eq=False, slots=True)
class BodyMaterials:
    """The materials of one body.

    Attributes:
        materials: One per slot of its mesh.
        surfaces: Their MaterialRecord records; ``texture`` is the place in ``textures``, or -1.
        textures: Ids, sorted.
        roles: Numbers in ``gen_data.generator.core.asset_types.SURFACES``.
    """

    materials: tuple[Material, ...]
    surfaces: NDArray[np.void]
    textures: tuple[str, ...]
    roles: NDArray[np.uint8]


def body_materials(scene: Scene, cache: DeviceCache) -> list[BodyMaterials]:
    """The materials of every body."""
    own = [body.materials or cache.materials(body.asset) for body in scene.bodies]
    return [
        cache.material_records.get(materials, partial(_pack_materials, materials))
        for materials in own
    ]


def _pack_materials(materials: tuple[Material, ...]) -> BodyMaterials:
    textures = tuple(sorted({m.texture for m in materials if m.texture}))
    values = np.zeros(len(materials), dtype=struct_dtype(MaterialRecord))
    if materials:
        values["texture"] = [textures.index(m.texture) if m.texture else -1 for m in materials]
        for name in _COLUMNS:
            values[name] = [getattr(m, name) for m in materials]
    roles = np.array([_SURFACE.get(m.role, 0) for m in materials], np.uint8)
    return BodyMaterials(materials, values, textures, roles)
