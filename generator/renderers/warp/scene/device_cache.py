"""Cache of a renderer between frames: assets, lenses, scratch memory and the latest scene."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core import asset_types, interfaces, mapped_files
from gen_data.core.bounded_cache import ByteCache, CountCache, HeldCache, ObjectCache
from gen_data.core.intrinsics import Intrinsics
from gen_data.renderers.warp.scene import brdf_albedo_lut, device_assets, environment_maps
from gen_data.renderers.warp.scene.distortion_lut import DeviceOptics, upload_optics
from gen_data.renderers.warp.scene.struct_dtypes import to_device

_MESH_BYTES, _TEXTURE_BYTES = 88 << 20, 192 << 20
"""Of a GPU."""
_OWN_MESH_BYTES, _OWN_TEXTURE_BYTES = 24 << 20, 8 << 20
"""On the CPU, where most are views of files, whose pages the system can drop."""
_MESHES, _TEXTURES = 4096, 2048
"""Some kilobytes each in addition to their arrays, and up to two maps of files."""
_ENVIRONMENT_BYTES, _ENVIRONMENTS = 16 << 20, 64
"""Two of the skies that scenes draw; on the CPU, stored panoramas are views of files."""
_OPTICS_BYTES = 192 << 20
_FILE_BYTES = 16 << 20
"""Pages of files that are read until all are dropped. They come back from the system's page cache,
16 at a time, which takes no measurable time in streets."""
_LENSES = 64
"""Capacity of the cache of lenses: a randomized one is new in every scene."""
_SCRATCH_RESERVE = 8
"""Scratch memory grows by one part in this number more than it must."""
_BODIES = 2048
"""Capacity of the caches of material records."""


@dataclass(frozen=True, eq=False, slots=True)
class _Scratch:
    """Memory of one name, and the part of it that was last requested."""

    whole: wp.array
    part: wp.array


@dataclass(frozen=True, eq=False, slots=True)
class _Latest:
    """Values that were uploaded, and where they are."""

    values: NDArray[Any]
    array: wp.array


def _is_same(one: NDArray[Any], other: NDArray[Any]) -> bool:
    same_form = one.dtype == other.dtype and one.shape == other.shape
    return same_form and one.tobytes() == other.tobytes()


class DeviceCache:
    """Meshes, textures and environments on one device, each cache bounded in bytes.

    Attributes:
        bodies: The latest packed bodies, which all views of a scene share.
        scenes: The latest packed scene, which all cameras and scanners of a sample share.
        layer_materials: Numbers in ``LAYER_MATERIALS`` of the latest bodies' materials.
        body_materials: Materials of the latest bodies.
        material_records, infrared: Records of a body's materials, by their tuple.
        infrared_scene: Materials of the latest bodies that were scanned, and all their records.
        coarsest: The coarsest texel of textures, on the host.
        pages: Returns pages of files to the system.
        shares_memory: Whether the device is the CPU, so that nothing has to cross.
    """

    def __init__(self, assets: interfaces.AssetLibrary, device: wp.Device) -> None:
        self.assets = assets
        # Asked once: it takes as long as loading a small mesh.
        self._store = assets if isinstance(assets, interfaces.DerivedArrays) else None
        self.device = device
        self.shares_memory = bool(device.is_cpu)
        self.pages = mapped_files.PageLimiter()
        self.lobes = wp.array(brdf_albedo_lut.lobe_albedo(), dtype=wp.vec2, device=device)
        self.bodies: ObjectCache[Any] = ObjectCache(1)
        self.body_materials: ObjectCache[Any] = ObjectCache(1)
        self.scenes: ObjectCache[Any] = ObjectCache(1)
        self.layer_materials: ObjectCache[wp.array] = ObjectCache(1)
        self.material_records: ObjectCache[Any] = ObjectCache(_BODIES)
        self.infrared: ObjectCache[NDArray[np.void]] = ObjectCache(_BODIES)
        self.infrared_scene: tuple[list[Any], NDArray[np.void]] | None = None
        self.coarsest: CountCache[NDArray[np.uint32]] = CountCache(_TEXTURES)
        mesh_bytes = _OWN_MESH_BYTES if device.is_cpu else _MESH_BYTES
        texture_bytes = _OWN_TEXTURE_BYTES if device.is_cpu else _TEXTURE_BYTES
        self._meshes: ByteCache[device_assets.DeviceMesh] = ByteCache(mesh_bytes, _MESHES)
        self._textures: ByteCache[device_assets.DeviceTexture] = ByteCache(texture_bytes, _TEXTURES)
        # Of assets that are not stored, such as roads: their scene alone has them, and in one cache
        # they would drive out all others.
        self._passing_meshes: HeldCache[device_assets.DeviceMesh] = HeldCache()
        self._passing_textures: HeldCache[device_assets.DeviceTexture] = HeldCache()
        self._environments: ByteCache[environment_maps.DeviceEnvironment] = ByteCache(
            _ENVIRONMENT_BYTES, _ENVIRONMENTS
        )
        self._optics: ByteCache[DeviceOptics] = ByteCache(_OPTICS_BYTES, _LENSES)
        self._scratch: dict[str, _Scratch] = {}
        self._constants: dict[tuple[object, ...], wp.array] = {}
        self._latest: dict[str, list[_Latest]] = {}

    def limit_pages(self) -> None:
        """Drop the pages of asset files if many were read; the next reader gets them again."""
        self.pages.limit_growth(_FILE_BYTES)

    def keep_scenes(self, count: int) -> None:
        """Keep the packed data of that many of the latest scenes instead of one."""
        self.bodies, self.body_materials = ObjectCache(count), ObjectCache(count)
        self.scenes = ObjectCache(count)

    def mesh(self, asset_id: str) -> device_assets.DeviceMesh:
        """Geometry of an asset on the device."""
        lasts = self._lasts(asset_id)

        def make() -> device_assets.DeviceMesh:
            data = self.assets.mesh(asset_id)
            # The sizes, too: a tree of another mesh would lead rays out of its arrays, if somebody
            # changed a family and not its version.
            sizes = f"{len(data.vertices_m)} {len(data.faces)}"
            prepared = self._derived(
                asset_id,
                f"device mesh {sizes}",
                lambda: device_assets.prepare_mesh(data, quick=not lasts),
            )
            return device_assets.upload_mesh(data, prepared, self.device)

        return (self._meshes if lasts else self._passing_meshes).get(asset_id, make)

    def materials(self, asset_id: str) -> tuple[asset_types.Material, ...]:
        """An asset's own materials, one per slot."""
        return self.mesh(asset_id).materials

    def texture(self, texture_id: str) -> device_assets.DeviceTexture:
        """A texture on the device."""

        def make() -> device_assets.DeviceTexture:
            prepared = self._derived(
                texture_id,
                "device texture",
                lambda: device_assets.prepare_texture(self.assets.texture(texture_id)),
            )
            return device_assets.upload_texture(prepared, self.device)

        lasts = self._lasts(texture_id)
        return (self._textures if lasts else self._passing_textures).get(texture_id, make)

    def _lasts(self, asset_id: str) -> bool:
        """Whether an asset is one of those that scenes share."""
        return self._store is None or self._store.is_stored(asset_id)

    def _derived(
        self, asset_id: str, name: str, compute: Callable[[], device_assets.Arrays]
    ) -> device_assets.Arrays:
        """Arrays computed from an asset by the present code; stored if the library can do so."""
        if self._store is None:
            return compute()
        return self._store.derived(asset_id, f"{name} {device_assets.arrays_version()}", compute)

    def prepare(self, asset_id: str) -> None:
        """Store what an object with its textures, a texture or an environment needs."""
        kind = self.assets.get(asset_id).kind
        if kind == "environment":
            self.assets.environment(asset_id)
        elif kind == "texture":
            self.texture(asset_id)
        elif kind == "object":
            for texture in sorted({m.texture for m in self.materials(asset_id)} - {""}):
                self.texture(texture)

    def environment(self, environment_id: str) -> environment_maps.DeviceEnvironment:
        """Light of an environment, as an image."""
        return self._environments.get(
            environment_id,
            lambda: environment_maps.upload_environment(
                self.assets.environment(environment_id), self.device
            ),
        )

    def split_environment(self, environment_id: str) -> environment_maps.DeviceEnvironment:
        """Light of an environment whose brightest parts are lamps."""
        whole = self.environment(environment_id)
        return self._environments.get(
            f"split {environment_id}",
            lambda: environment_maps.upload_split(self.assets.environment(environment_id), whole),
        )

    def optics(self, intrinsics: Intrinsics) -> DeviceOptics:
        """Directions through the pixels of a camera with lens distortion."""
        return self._optics.get(repr(intrinsics), lambda: upload_optics(intrinsics, self.device))

    def constant(
        self, dtype: Any, make: Callable[..., NDArray[Any]], *arguments: object
    ) -> wp.array:
        """An array computed from the arguments alone, kept for good."""
        key = (make.__name__, *arguments)
        if key not in self._constants:
            self._constants[key] = wp.array(make(*arguments), dtype=dtype, device=self.device)
        return self._constants[key]

    def latest(self, name: str, values: NDArray[Any], dtype: Any) -> wp.array:
        """Values on the device, read-only; those of a name cross only when they change.

        The last two of a name are kept: a rig also scans its scene without itself. On the CPU, the
        array may be a view of the values.
        """
        kept = [] if self.shares_memory else self._latest.get(name, [])
        for held in kept:
            if _is_same(held.values, values):
                return held.array
        if values.dtype.names:
            array = to_device(values, dtype, self.device)
        else:
            array = wp.array(values, dtype=dtype, device=self.device, copy=not self.device.is_cpu)
        if not self.shares_memory:
            self._latest[name] = [_Latest(values.copy(), array), *kept[:1]]
        return array

    def scratch(self, name: str, shape: int | tuple[int, ...], dtype: Any) -> wp.array:
        """Uninitialised memory; reused, because touching fresh pages costs as much as filling them.

        It is valid until the same name is requested again. There is as much of each name as the
        largest frame took: sizes change with every scene.
        """
        sizes = shape if isinstance(shape, tuple) else (shape,)
        count = int(np.prod(sizes))
        held = self._scratch.get(name)
        if held is None or held.whole.size < count:
            reserved = count + count // _SCRATCH_RESERVE
            whole = wp.zeros(reserved, dtype=dtype, device=self.device)
            held = _Scratch(whole, whole[:count].reshape(sizes))
        elif held.part.shape != sizes:
            held = replace(held, part=held.whole[:count].reshape(sizes))
        self._scratch[name] = held
        return held.part
