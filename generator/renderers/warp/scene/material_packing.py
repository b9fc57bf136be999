"""Materials of bodies as the records that kernels read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import LAYER_MATERIALS, SURFACES, Material
from gen_data.core.scene import Body
from gen_data.renderers.warp.scene import device_assets, device_cache
from gen_data.renderers.warp.scene.kernels import records
from gen_data.renderers.warp.scene.struct_dtypes import stack_records, struct_dtype

_COLUMNS = (
    "base_color", "roughness", "metallic", "specular", "texture_scale_m", "emission_cd_m2", "coat",
    "coat_roughness", "transmission", "ior", "thin", "opacity",
)  # fmt: skip
_REFLECTANCE_MIN = 1e-3
"""Smallest reflectance of a sheet that transmits: kernels know the ratio of both only."""
_PRINTS = frozenset({"paint", "plate", "sign"})
"""Roles of sheets with print on the outside: from within, a livery would be in mirror writing."""
_SURFACE = {role: number for number, role in enumerate(SURFACES)}
_LAYER_MATERIAL = np.array(
    [LAYER_MATERIALS.index(role if role in LAYER_MATERIALS[1:] else "other") for role in SURFACES],
    np.uint16,
)
SEE_THROUGH = LAYER_MATERIALS.index("see_through")
MIRROR = LAYER_MATERIALS.index("mirror")
"""Numbers of materials behind which a ray continues, and that reflect it."""


@dataclass(frozen=True, eq=False, slots=True)
class BodyMaterials:
    """Materials of one body.

    Attributes:
        materials: Materials, one per slot of its mesh.
        surfaces: Their MaterialRecord records; ``texture`` is an index into ``textures``, or -1.
        textures: Texture ids, sorted.
        roles: Role of each, as an index into ``gen_data.core.asset_types.SURFACES``.
    """

    materials: tuple[Material, ...]
    surfaces: NDArray[np.void]
    textures: tuple[str, ...]
    roles: NDArray[np.uint8]


def body_materials(bodies: Sequence[Body], cache: device_cache.DeviceCache) -> list[BodyMaterials]:
    """Materials of every body, packed once and cached."""

    def pack() -> list[BodyMaterials]:
        own = (body.materials or cache.materials(body.asset) for body in bodies)
        return [
            cache.material_records.get(materials, partial(_pack_materials, materials))
            for materials in own
        ]

    packed: list[BodyMaterials] = cache.body_materials.get(bodies, pack)
    return packed


def _pack_materials(materials: tuple[Material, ...]) -> BodyMaterials:
    textures = tuple(sorted({m.texture for m in materials if m.texture}))
    values = np.zeros(len(materials), dtype=struct_dtype(records.MaterialRecord))
    if materials:
        values["texture"] = [textures.index(m.texture) if m.texture else -1 for m in materials]
        for name in _COLUMNS:
            values[name] = [getattr(m, name) for m in materials]
        values["soaks"] = [m.role == "grass" for m in materials]
        values["one_sided"] = [m.printed and m.role in _PRINTS for m in materials]
        for k, material in enumerate(materials):
            if any(material.diffuse_transmission):
                _pack_transmission(material, values[k])
    roles = np.array([_SURFACE.get(m.role, 0) for m in materials], np.uint8)
    return BodyMaterials(materials, values, textures, roles)


def _pack_transmission(material: Material, record: np.void) -> None:
    """Set colour and translucency of a thin sheet; it scatters at most the light it receives."""
    reflected = np.maximum(material.base_color, _REFLECTANCE_MIN)
    passed = np.minimum(material.diffuse_transmission, np.maximum(1.0 - reflected, 0.0))
    record["base_color"] = reflected
    record["translucency"] = passed / reflected * (1.0 - material.metallic)


def surface_records(
    per_body: Sequence[BodyMaterials], textures: Mapping[str, device_assets.DeviceTexture]
) -> NDArray[np.void]:
    """Material records of all bodies, body after body; at least one.

    ``textures`` are all that the bodies name, in the order of the device's textures.
    """
    values = stack_records([entry.surfaces for entry in per_body], records.MaterialRecord)
    place = {texture_id: k for k, texture_id in enumerate(textures)}
    listed = np.array([*(place[t] for entry in per_body for t in entry.textures), -1], np.int32)
    counts = np.array([len(entry.textures) for entry in per_body], np.int64)
    first = np.repeat(np.cumsum(counts) - counts, [len(entry.materials) for entry in per_body])
    if not len(first):
        return values
    local = values["texture"]
    values["texture"] = np.where(local < 0, -1, listed[first + np.maximum(local, 0)])
    mapped = np.array([*(texture.layered for texture in textures.values()), False])
    values["layered"] = (
        (values["coat"] > 0.0)
        | (values["transmission"] > 0.0)
        | (values["opacity"] < 1.0)
        | is_mirror(values)
        | mapped[values["texture"]]
    )
    return values


def is_see_through(surfaces: NDArray[np.void]) -> NDArray[np.bool_]:
    """Whether cameras see anything behind each of MaterialRecords."""
    clear = surfaces["transmission"] * (1.0 - surfaces["metallic"])
    return np.asarray((clear > 0.0) | (surfaces["opacity"] < 1.0))


def is_mirror(surfaces: NDArray[np.void]) -> NDArray[np.bool_]:
    """Whether each of MaterialRecords is metal that shows reflections of the scene."""
    smooth = surfaces["roughness"] < records.MIRROR_ROUGHNESS
    return np.asarray((surfaces["metallic"] >= 0.5) & smooth)


def layer_materials(per_body: Sequence[BodyMaterials]) -> NDArray[np.uint16]:
    """Number in ``LAYER_MATERIALS`` of each material of all bodies, in their order."""
    surfaces = stack_records([entry.surfaces for entry in per_body], records.MaterialRecord)
    numbers = np.zeros(len(surfaces), np.uint16)
    if sum(len(entry.roles) for entry in per_body):
        numbers = _LAYER_MATERIAL[np.concatenate([entry.roles for entry in per_body])]
    numbers[is_mirror(surfaces)] = MIRROR
    numbers[is_see_through(surfaces)] = SEE_THROUGH
    return numbers


def cutout_slots(
    surfaces: NDArray[np.void], textures: Mapping[str, device_assets.DeviceTexture]
) -> NDArray[np.int32]:
    """Per material: HOLES if its texture has any, and CLEAR if it casts no shadow."""
    holes = np.array([*(texture.has_cutouts for texture in textures.values()), False])
    clear = (surfaces["transmission"] > 0.5) | (surfaces["opacity"] < 0.5)
    flags = holes[surfaces["texture"]] * int(records.HOLES) + clear * int(records.CLEAR)
    return np.asarray(flags.astype(np.int32))


def cutout_bodies(slots: NDArray[np.int32], counts: NDArray[np.int64]) -> NDArray[np.int32]:
    """Per body: the union of its slots' flags, and UNSHADED if all of them are CLEAR.

    ``counts`` are the bodies' numbers of materials.
    """
    bodies = np.zeros(len(counts), np.int32)
    if not slots.any():
        return bodies
    of_slots = np.repeat(np.arange(len(counts)), counts)
    own = slots[: len(of_slots)]
    np.bitwise_or.at(bodies, of_slots, own)
    clear = np.bincount(of_slots, own & int(records.CLEAR) != 0, len(counts))
    bodies[(clear == counts) & (counts > 0)] |= int(records.UNSHADED)
    return bodies
