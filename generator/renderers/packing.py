"""A Scene and a Camera as the records that kernels read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from generator.core.geometry import Material
from generator.core.lens import LensModel
from generator.core.scene import Body, Camera, Environment, Light, Scene, Weather
from generator.renderers.environments import DeviceEnvironment
from generator.renderers.kernels import records
from generator.renderers.meshes import DeviceMesh
from generator.renderers.stock import AssetStock

_LENSES: dict[LensModel, int] = {
    "pinhole": records.PINHOLE,
    "brown_conrady": records.BROWN_CONRADY,
    "kannala_brandt": records.KANNALA_BRANDT,
    "equirectangular": records.EQUIRECTANGULAR,
}
_LAMP_KINDS = {"sphere": 0, "spot": 1, "sun": 2}


@dataclass(frozen=True, eq=False, slots=True)
class PackedWorld:
    """One scene on the device.

    Attributes:
        record: The World record.
        keep: Everything on the device that the record points to.
        placed: Body records on the host, structured array [n].
        vertex_count: Of all bodies together.
        weather: Of the scene.
        lows_m, highs_m: Corners of boxes in the world around the bodies, one at least.
    """

    record: records.World
    keep: tuple[object, ...]
    placed: NDArray[np.void]
    vertex_count: int
    weather: Weather
    lows_m: wp.array
    highs_m: wp.array


def pack_world(scene: Scene, camera: Camera, stock: AssetStock) -> PackedWorld:
    """The scene as one camera sees it. Cheap enough to be done for every frame."""
    asset_ids = sorted({body.asset for body in scene.bodies})
    place = {asset_id: k for k, asset_id in enumerate(asset_ids)}
    meshes = [stock.mesh(asset_id) for asset_id in asset_ids]
    own = [body.materials or stock.materials(body.asset) for body in scene.bodies]
    materials = [material for group in own for material in group]
    texture_ids = sorted({m.texture for m in materials if m.texture})
    textures = [stock.texture(texture_id) for texture_id in texture_ids]
    environment = stock.environment(scene.environment.image)
    placed = np.zeros(len(scene.bodies), dtype=records.Body.numpy_dtype())
    placed["geometry"] = [place[body.asset] for body in scene.bodies]
    counts = np.array([len(group) for group in own], dtype=np.int64)
    placed["first_material"] = np.cumsum(counts) - counts
    body_meshes = [meshes[place[body.asset]] for body in scene.bodies]
    vertex_count = _place(placed, scene.bodies, body_meshes, camera)
    placed["low_m"], placed["high_m"] = _world_boxes(placed, body_meshes)

    def upload(values: NDArray[np.void] | list[object], dtype: Any) -> wp.array:
        return wp.array(values, dtype=dtype, device=stock.device)

    # A hierarchy needs a box; rays never meet this one.
    nowhere = np.full((1, 3), 1e9, np.float32)
    low = placed["low_m"] if len(placed) else nowhere
    high = placed["high_m"] if len(placed) else nowhere
    lows_m, highs_m = (upload(np.ascontiguousarray(corner), wp.vec3) for corner in (low, high))
    tree = wp.Bvh(lows_m, highs_m)
    world = records.World()
    world.tree = tree.id
    world.geometries = upload(_stacked(meshes, records.Geometry), records.Geometry)
    world.bodies = upload(placed, records.Body)
    world.surfaces = upload(
        _surfaces(materials, {t: k for k, t in enumerate(texture_ids)}), records.Surface
    )
    world.textures = upload(_stacked(textures, records.Texture), records.Texture)
    world.lamps = upload(_lamps(scene.lights), records.Lamp)
    world.lobes = stock.lobes
    world.sky = _sky(scene.environment, environment)
    return PackedWorld(
        world,
        (tree, meshes, textures, environment),
        placed,
        vertex_count,
        scene.weather,
        lows_m,
        highs_m,
    )


def pack_view(camera: Camera, stock: AssetStock) -> records.View:
    """The camera."""
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
        view.directions = stock.optics(k).directions
    return view


def _place(
    values: NDArray[np.void], bodies: Sequence[Body], meshes: Sequence[DeviceMesh], camera: Camera
) -> int:
    """Fill in poses and vertex ranges; returns the number of vertices.

    Products are taken in float64, so that a camera far from the world's origin loses nothing.
    """
    if not bodies:
        return 0
    R_camera_world = camera.T_world_camera.rotation().T
    eye = np.asarray(camera.T_world_camera.translation_m)
    R = np.stack([body.T_world_body.rotation() for body in bodies])
    t = np.array([body.T_world_body.translation_m for body in bodies])
    scale = np.array([body.scale for body in bodies])
    counts = np.array([mesh.vertex_count for mesh in meshes])
    A = np.einsum("ij,njk->nik", R_camera_world, R, optimize=False)
    values["first_vertex"] = np.cumsum(counts) - counts
    values["scale"] = scale
    values["A_camera_mesh"] = A * scale[:, None, None]
    values["t_camera_mesh"] = np.einsum("ij,nj->ni", R_camera_world, t - eye, optimize=False)
    values["B_mesh_camera"] = A.transpose(0, 2, 1) / scale[:, None, None]
    values["eye_mesh"] = np.einsum("nji,nj->ni", R, eye - t, optimize=False) / scale[:, None]
    values["R_world_mesh"] = R
    values["t_world_mesh"] = t
    values["B_mesh_world"] = R.transpose(0, 2, 1) / scale[:, None, None]
    values["t_mesh_world"] = -np.einsum("nji,nj->ni", R, t, optimize=False) / scale[:, None]
    return int(counts.sum())


def _world_boxes(
    placed: NDArray[np.void], meshes: Sequence[DeviceMesh]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    if not meshes:
        return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)
    scale = placed["scale"].astype(np.float64)[:, None]
    R = placed["R_world_mesh"].astype(np.float64)
    low = np.stack([mesh.low_m for mesh in meshes]) * scale
    high = np.stack([mesh.high_m for mesh in meshes]) * scale
    centre = placed["t_world_mesh"] + np.einsum("nij,nj->ni", R, (low + high) / 2, optimize=False)
    half = np.einsum("nij,nj->ni", np.abs(R), (high - low) / 2, optimize=False)
    # A hair of slack keeps flat boxes traversable after rounding to float32.
    half = half + 1e-6 * (1.0 + np.abs(centre))
    return (centre - half).astype(np.float32), (centre + half).astype(np.float32)


def _stacked(items: Sequence[Any], kind: Any) -> NDArray[np.void]:
    values = np.zeros(max(len(items), 1), dtype=kind.numpy_dtype())
    for k, item in enumerate(items):
        values[k] = item.record
    return values


def _sky(environment: Environment, light: DeviceEnvironment) -> records.Sky:
    sky = records.Sky()
    sky.irradiance, sky.glossy, sky.image = light.irradiance, light.glossy, light.image
    sky.luminance = environment.luminance_cd_m2
    sky.cos_yaw, sky.sin_yaw = math.cos(environment.yaw_rad), math.sin(environment.yaw_rad)
    sky.visible = int(environment.visible)
    return sky


def _surfaces(materials: Sequence[Material], textures: dict[str, int]) -> NDArray[np.void]:
    """Surface records; ``textures`` maps texture ids to their place among the textures."""
    values = np.zeros(max(len(materials), 1), dtype=records.Surface.numpy_dtype())
    if not materials:
        return values
    # Column by column: there are thousands in a street, and filling in one record takes long.
    values["base_color"] = [m.base_color for m in materials]
    values["roughness"] = [m.roughness for m in materials]
    values["metallic"] = [m.metallic for m in materials]
    values["specular"] = [m.specular for m in materials]
    values["texture"] = [textures[m.texture] if m.texture else -1 for m in materials]
    values["texture_scale_m"] = [m.texture_scale_m for m in materials]
    values["emission_cd_m2"] = [m.emission_cd_m2 for m in materials]
    return values


def _lamps(lights: Sequence[Light]) -> NDArray[np.void]:
    """Lamp records."""
    values = np.zeros(len(lights), dtype=records.Lamp.numpy_dtype())
    for value, light in zip(values, lights, strict=True):
        strength = light.illuminance_lux if light.kind == "sun" else light.intensity_cd
        value["kind"] = _LAMP_KINDS[light.kind]
        value["position_m"] = light.position_m
        value["direction"] = light.direction
        value["power"] = np.asarray(light.color) * strength
        sun = light.kind == "sun"
        value["radius"] = math.tan(light.angular_radius_rad) if sun else light.radius_m
        value["cos_outer"] = math.cos(light.cone_rad)
        value["cos_inner"] = math.cos(light.even * light.cone_rad)
    return values
