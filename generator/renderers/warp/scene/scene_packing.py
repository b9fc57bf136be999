"""Packing of a Scene and a Camera into the records that kernels read."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core import lens, scene_time, se3
from gen_data.core.scene import (
    LIGHT_KINDS,
    PANEL_KINDS,
    Body,
    Camera,
    Environment,
    IrradianceVolume,
    Light,
    Scene,
    Weather,
)
from gen_data.renderers.warp.scene import bvh, device_assets, environment_maps, material_packing
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.renderers.warp.scene.kernels import records
from gen_data.renderers.warp.scene.struct_dtypes import (
    copy_struct,
    stack_records,
    struct_dtype,
    to_device,
)

_LENSES: dict[lens.LensModel, int] = {
    "pinhole": records.PINHOLE,
    "brown_conrady": records.BROWN_CONRADY,
    "kannala_brandt": records.KANNALA_BRANDT,
    "equirectangular": records.EQUIRECTANGULAR,
}


@dataclass(frozen=True, eq=False, slots=True)
class PackedWorld:
    """One scene on the device.

    Attributes:
        record: The World record.
        keep: Device memory that the record points to.
        body_records: Body records on the host, structured array [n].
        vertex_count: Vertices of all bodies.
        weather: Weather of the scene.
        layered: Whether any surface is layered, see MaterialRecord.
        lows_m, highs_m: Corners of the bodies' boxes in the world; at least one.
    """

    record: records.World
    keep: tuple[object, ...]
    body_records: NDArray[np.void]
    vertex_count: int
    weather: Weather
    layered: bool
    lows_m: wp.array
    highs_m: wp.array


@dataclass(frozen=True, eq=False, slots=True)
class _Placement:
    """Poses of a scene's bodies, independent of the camera.

    Attributes:
        body_records: Body records without the fields that depend on the camera.
        R_world_mesh, t_world_mesh, scale: Poses of the bodies, float64 [n, 3, 3], [n, 3] and [n].
        vertex_count, lows_m, highs_m: As of PackedWorld.
        hierarchy: Kept alive for the World record, which has only its id; None without cut-outs.
    """

    body_records: NDArray[np.void]
    R_world_mesh: se3.Array
    t_world_mesh: se3.Array
    scale: se3.Array
    vertex_count: int
    lows_m: wp.array
    highs_m: wp.array
    hierarchy: wp.Bvh | None


@dataclass(frozen=True, eq=False, slots=True)
class _PackedScene:
    """Data that all cameras and scanners of one scene share.

    Attributes:
        record: The World record, without bodies.
        assets: Meshes, textures and environment that the record points to.
        placement: Poses of the bodies.
        layered: As of PackedWorld.
    """

    record: records.World
    assets: tuple[object, ...]
    placement: _Placement
    layered: bool


def pack_world(scene: Scene, camera: Camera, cache: DeviceCache) -> PackedWorld:
    """Pack a scene for one camera. Cheap enough for every frame."""
    cache.limit_pages()
    packed: _PackedScene = cache.scenes.get(scene, lambda: _pack_scene(scene, cache))
    return _pack_for_camera(camera, packed, scene.weather, cache)


def repack_moved(
    world: PackedWorld, scene: Scene, camera: Camera, cache: DeviceCache
) -> PackedWorld:
    """Pack another instant of a packed scene: the same assets and materials at other poses.

    Poses of bodies, lights and camera may differ from the poses in ``world``.
    """
    _, *assets = world.keep
    meshes = assets[0]
    assert isinstance(meshes, list)
    body_meshes = [meshes[k] for k in world.body_records["geometry"]]
    record = copy_struct(world.record, records.World)
    placement = _place_bodies(record, world.body_records.copy(), scene.bodies, body_meshes, cache)
    record.lamps = to_device(lamp_records(scene.lights), records.LightRecord, cache.device)
    packed = _PackedScene(record, tuple(assets), placement, world.layered)
    return _pack_for_camera(camera, packed, world.weather, cache)


def copy_world(world: PackedWorld) -> PackedWorld:
    """Copy of the world whose lamps, ground and sky can be changed independently."""
    return replace(world, record=copy_struct(world.record, records.World))


def _pack_for_camera(
    camera: Camera, packed: _PackedScene, weather: Weather, cache: DeviceCache
) -> PackedWorld:
    """Complete a packed scene with the fields that depend on the camera."""
    placement = packed.placement
    body_records = placement.body_records.copy()
    if len(body_records):
        _fill_camera_poses(body_records, placement, camera)
    # A separate record: weather and lamps are set for one view.
    record = copy_struct(packed.record, records.World)
    record.bodies = to_device(body_records, records.BodyRecord, cache.device)
    return PackedWorld(
        record,
        (placement.hierarchy, *packed.assets),
        body_records,
        placement.vertex_count,
        weather,
        packed.layered,
        placement.lows_m,
        placement.highs_m,
    )


def _pack_scene(scene: Scene, cache: DeviceCache) -> _PackedScene:
    """Pack a scene; its bodies are packed once for all views that have the same ones."""
    bodies: _PackedScene = cache.bodies.get(scene.bodies, lambda: _pack_bodies(scene.bodies, cache))
    environment = cache.environment(scene.environment.image)
    world = copy_struct(bodies.record, records.World)
    world.lamps = to_device(lamp_records(scene.lights), records.LightRecord, cache.device)
    world.sky = sky_record(scene.environment, environment)
    _fill_volumes(world, scene.environment.volumes, cache.device)
    placement = replace(bodies.placement, body_records=bodies.placement.body_records.copy())
    moving = scene_time.moving_bodies(scene)
    moves = np.array([body.name in moving for body in scene.bodies], dtype=bool)
    placement.body_records["cutouts"][moves] |= int(records.MOVES)
    assets = (*bodies.assets, environment)
    return replace(bodies, record=world, assets=assets, placement=placement)


def _pack_bodies(bodies: tuple[Body, ...], cache: DeviceCache) -> _PackedScene:
    asset_ids = sorted({body.asset for body in bodies})
    place = {asset_id: k for k, asset_id in enumerate(asset_ids)}
    meshes = [cache.mesh(asset_id) for asset_id in asset_ids]
    cache.limit_pages()
    per_body = material_packing.body_materials(bodies, cache)
    texture_ids = sorted({texture_id for entry in per_body for texture_id in entry.textures})
    textures = {texture_id: cache.texture(texture_id) for texture_id in texture_ids}
    cache.limit_pages()
    surfaces = material_packing.surface_records(per_body, textures)
    body_records = np.zeros(len(bodies), dtype=struct_dtype(records.BodyRecord))
    body_records["geometry"] = [place[body.asset] for body in bodies]
    counts = np.array([len(entry.materials) for entry in per_body], dtype=np.int64)
    body_records["first_material"] = np.cumsum(counts) - counts
    body_records["cutouts"] = material_packing.cutout_bodies(
        material_packing.cutout_slots(surfaces, textures), counts
    )
    body_meshes = [meshes[place[body.asset]] for body in bodies]
    world = records.World()
    placement = _place_bodies(world, body_records, bodies, body_meshes, cache)
    geometries = stack_records([mesh.record for mesh in meshes], records.Geometry)
    images = stack_records([texture.record for texture in textures.values()], records.TextureRecord)
    # Steps of a sequence have other poses and the same assets.
    world.geometries = cache.latest("geometries", geometries, records.Geometry)
    world.surfaces = cache.latest("surfaces", surfaces, records.MaterialRecord)
    world.textures = cache.latest("textures", images, records.TextureRecord)
    world.lobes = cache.lobes
    layered = bool(surfaces["layered"].any())
    return _PackedScene(world, (meshes, textures), placement, layered)


def _place_bodies(
    record: records.World,
    body_records: NDArray[np.void],
    bodies: Sequence[Body],
    meshes: Sequence[device_assets.DeviceMesh],
    cache: DeviceCache,
) -> _Placement:
    """Fill in the bodies' poses, and the hierarchies of the World record over them."""
    R, t, scale, vertex_count = _fill_poses(body_records, bodies, meshes)
    body_records["low_m"], body_records["high_m"] = _world_boxes(body_records, meshes)
    # Kernels over boxes need at least one; no ray hits this one.
    nowhere = np.full((1, 3), 1e9, np.float32)
    low = body_records["low_m"] if len(body_records) else nowhere
    high = body_records["high_m"] if len(body_records) else nowhere
    lows_m, highs_m = (
        wp.array(np.ascontiguousarray(corner), dtype=wp.vec3, device=cache.device)
        for corner in (low, high)
    )
    hierarchy = _build_hierarchies(record, body_records, cache.device)
    return _Placement(body_records, R, t, scale, vertex_count, lows_m, highs_m, hierarchy)


def _build_hierarchies(
    record: records.World, body_records: NDArray[np.void], device: wp.Device
) -> wp.Bvh | None:
    low, high = (np.ascontiguousarray(body_records[name]) for name in ("low_m", "high_m"))
    flags = body_records["cutouts"] & int(records.HOLES | records.CLEAR)
    # Shadow rays pass these bodies as a whole.
    flags[(body_records["cutouts"] & int(records.UNSHADED)) != 0] &= int(records.HOLES)
    cutouts = np.flatnonzero(flags).astype(np.int32)
    corners = (wp.array(of[cutouts], dtype=wp.vec3, device=device) for of in (low, high))
    cutout_hierarchy = wp.Bvh(*corners) if len(cutouts) else None
    record.boxes = wp.array(bvh.group_boxes(low, high), dtype=wp.float32, device=device)
    record.tree = wp.array(bvh.body_tree(low, high), dtype=wp.float32, device=device)
    record.cutouts = wp.array(cutouts, dtype=wp.int32, device=device)
    record.cutout_hierarchy = cutout_hierarchy.id if cutout_hierarchy else 0
    record.cutout_flags = int(np.bitwise_or.reduce(flags))
    return cutout_hierarchy


def pack_view(camera: Camera, cache: DeviceCache) -> records.View:
    """Pack a camera."""
    k = camera.intrinsics
    view = records.View()
    view.width, view.height = k.width_px, k.height_px
    view.fx, view.fy, view.cx, view.cy = k.fx_px, k.fy_px, k.cx_px, k.cy_px
    view.inverse_fx, view.inverse_fy = 1.0 / k.fx_px, 1.0 / k.fy_px
    view.R_world_camera = wp.mat33(camera.T_world_camera.rotation())
    view.eye_m = wp.vec3(*camera.T_world_camera.translation_m)
    view.pixel_rad = 1.0 / k.fx_px
    if not k.straight:
        view.lens = _LENSES[k.lens.model]
        coefficients = (*k.lens.coefficients, *[0.0] * 8)[:8]
        view.coefficients = records.Coefficients(*coefficients)
        view.directions = cache.optics(k).directions
    return view


def _fill_poses(
    values: NDArray[np.void], bodies: Sequence[Body], meshes: Sequence[device_assets.DeviceMesh]
) -> tuple[se3.Array, se3.Array, se3.Array, int]:
    """Fill in poses and vertex ranges; returns rotations, positions, scales, vertex count."""
    if not bodies:
        return np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros(0), 0
    R = se3.unit_quaternions_to_rotations(
        np.array([body.T_world_body.quaternion_wxyz for body in bodies])
    )
    t = np.array([body.T_world_body.translation_m for body in bodies])
    scale = np.array([body.scale for body in bodies])
    counts = np.array([mesh.vertex_count for mesh in meshes])
    values["first_vertex"] = np.cumsum(counts) - counts
    values["scale"] = scale
    values["R_world_mesh"] = R
    values["t_world_mesh"] = t
    values["B_mesh_world"] = R.transpose(0, 2, 1) / scale[:, None, None]
    values["t_mesh_world"] = -np.einsum("nji,nj->ni", R, t, optimize=False) / scale[:, None]
    return R, t, scale, int(counts.sum())


def _fill_camera_poses(values: NDArray[np.void], placement: _Placement, camera: Camera) -> None:
    """Fill in the bodies' poses relative to a camera.

    Products are computed in float64: a camera far from the world's origin loses no precision.
    """
    R_camera_world = camera.T_world_camera.rotation().T
    away = placement.t_world_mesh - np.asarray(camera.T_world_camera.translation_m)
    R, scale = placement.R_world_mesh, placement.scale
    A = np.einsum("ij,njk->nik", R_camera_world, R, optimize=False)
    values["A_camera_mesh"] = A * scale[:, None, None]
    values["t_camera_mesh"] = np.einsum("ij,nj->ni", R_camera_world, away, optimize=False)
    values["B_mesh_camera"] = A.transpose(0, 2, 1) / scale[:, None, None]
    values["eye_mesh"] = np.einsum("nji,nj->ni", R, -away, optimize=False) / scale[:, None]


def _world_boxes(
    body_records: NDArray[np.void], meshes: Sequence[device_assets.DeviceMesh]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    if not meshes:
        return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)
    scale = body_records["scale"].astype(np.float64)[:, None]
    R = body_records["R_world_mesh"].astype(np.float64)
    low = np.stack([mesh.low_m for mesh in meshes]) * scale
    high = np.stack([mesh.high_m for mesh in meshes]) * scale
    centre = body_records["t_world_mesh"] + np.einsum(
        "nij,nj->ni", R, (low + high) / 2, optimize=False
    )
    half = np.einsum("nij,nj->ni", np.abs(R), (high - low) / 2, optimize=False)
    # Slack keeps flat boxes traversable after rounding to float32.
    half = half + 1e-6 * (1.0 + np.abs(centre))
    return (centre - half).astype(np.float32), (centre + half).astype(np.float32)


def sky_record(
    environment: Environment, light: environment_maps.DeviceEnvironment
) -> records.EnvironmentRecord:
    """The EnvironmentRecord of an environment."""
    sky = records.EnvironmentRecord()
    sky.irradiance, sky.glossy = light.irradiance, light.glossy
    sky.image, sky.rest = light.image, light.rest
    sky.luminance = environment.luminance_cd_m2
    sky.cos_yaw, sky.sin_yaw = math.cos(environment.yaw_rad), math.sin(environment.yaw_rad)
    sky.visible = int(environment.visible)
    return sky


def _fill_volumes(
    world: records.World, volumes: Sequence[IrradianceVolume], device: wp.Device
) -> None:
    values = np.zeros(len(volumes), dtype=struct_dtype(records.VolumeRecord))
    probes = [np.array(volume.light_cd_m2, np.float32).reshape(-1, 6, 3) for volume in volumes]
    for value, volume in zip(values, volumes, strict=True):
        value["low_m"], value["high_m"] = volume.low_m, volume.high_m
        value["counts"] = volume.counts
    if volumes:
        values["first"] = np.cumsum([0, *(len(part) for part in probes[:-1])])
    world.volumes = to_device(values, records.VolumeRecord, device)
    joined = np.concatenate([np.zeros((0, 6, 3), np.float32), *probes])
    world.probes = wp.array(joined, dtype=wp.vec3, device=device)


def lamp_records(lights: Sequence[Light]) -> NDArray[np.void]:
    """LightRecord records, in the order of the lights."""
    values = np.zeros(len(lights), dtype=struct_dtype(records.LightRecord))
    for value, light in zip(values, lights, strict=True):
        strength = light.illuminance_lux if light.kind == "sun" else light.intensity_cd
        value["kind"] = LIGHT_KINDS.index(light.kind)
        value["position_m"] = light.position_m
        value["direction"] = light.direction
        value["power"] = np.asarray(light.color) * strength
        sun = light.kind == "sun"
        value["radius"] = math.tan(light.angular_radius_rad) if sun else light.radius_m
        value["cos_outer"] = math.cos(light.cone_rad)
        value["cos_inner"] = math.cos(light.even * light.cone_rad)
        value["cutoff"] = light.cutoff
        if light.kind in PANEL_KINDS:
            _fill_panel(value, light)
    return values


def _fill_panel(value: NDArray[np.void], light: Light) -> None:
    normal = np.asarray(light.direction, dtype=np.float64)
    if light.kind == "rectangle":
        half_m = 0.5 * np.asarray(light.size_m, dtype=np.float64)
        # Re-orthogonalised: rounding may have tilted it.
        side = np.asarray(light.side) - normal * float((normal * light.side).sum())
        side = side / math.sqrt(float((side * side).sum()))
        area_m2 = 4.0 * half_m[0] * half_m[1]
        value["radius"] = math.hypot(*half_m)
    else:
        half_m = np.full(2, light.radius_m)
        least = np.eye(3)[int(np.abs(normal).argmin())]
        side = np.cross(normal, least)
        side = side / math.sqrt(float((side * side).sum()))
        area_m2 = math.pi * light.radius_m**2
    value["shown"] = int(light.body != "")
    value["along"] = side * half_m[0]
    value["across"] = np.cross(normal, side) * half_m[1]
    value["radiance"] = np.asarray(light.color) * (light.intensity_cd / area_m2)
