"""A Scene and a Camera as the records that kernels read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from generator.core.geometry import Material
from generator.core.scene import Body as SceneBody
from generator.core.scene import Camera, Light
from generator.core.se3 import Array
from generator.renderers.kernels import records
from generator.renderers.meshes import DeviceMesh

_LAMP_KINDS = {"sphere": 0, "spot": 1, "sun": 2}


@dataclass(frozen=True, eq=False, slots=True)
class PlacedBodies:
    """Body records of one view.

    Attributes:
        values: Structured array of Body records.
        vertex_count: Of all bodies together.
        low_m, high_m: World boxes, float32 [n, 3].
    """

    values: np.ndarray
    vertex_count: int
    low_m: np.ndarray
    high_m: np.ndarray


def pack_view(camera: Camera) -> records.View:
    """The camera."""
    k = camera.intrinsics
    view = records.View()
    view.width, view.height = k.width_px, k.height_px
    view.fx, view.fy, view.cx, view.cy = k.fx_px, k.fy_px, k.cx_px, k.cy_px
    view.inverse_fx, view.inverse_fy = 1.0 / k.fx_px, 1.0 / k.fy_px
    view.R_world_camera = wp.mat33(camera.T_world_camera.rotation())
    view.eye_m = wp.vec3(*camera.T_world_camera.translation_m)
    view.pixel_rad = 1.0 / k.fx_px
    return view


def pack_bodies(
    bodies: Sequence[SceneBody],
    meshes: Sequence[DeviceMesh],
    geometry_indices: Sequence[int],
    first_materials: Sequence[int],
    camera: Camera,
) -> PlacedBodies:
    """Records of all bodies, as seen by a camera.

    Products are taken in float64, so that a camera far from the world's origin loses nothing.
    """
    n = len(bodies)
    values = np.zeros(n, dtype=records.Body.numpy_dtype())
    R_cw = camera.T_world_camera.rotation().T
    eye = np.asarray(camera.T_world_camera.translation_m)
    if n == 0:
        return PlacedBodies(values, 0, np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32))
    R = np.stack([body.T_world_body.rotation() for body in bodies])
    t = np.array([body.T_world_body.translation_m for body in bodies])
    scale = np.array([body.scale for body in bodies])
    counts = np.array([mesh.vertex_count for mesh in meshes])
    A = np.einsum("ij,njk->nik", R_cw, R, optimize=False)
    values["geometry"] = geometry_indices
    values["first_vertex"] = np.cumsum(counts) - counts
    values["first_material"] = first_materials
    values["scale"] = scale
    values["A_camera_mesh"] = A * scale[:, None, None]
    values["t_camera_mesh"] = np.einsum("ij,nj->ni", R_cw, t - eye, optimize=False)
    values["B_mesh_camera"] = A.transpose(0, 2, 1) / scale[:, None, None]
    values["eye_mesh"] = np.einsum("nji,nj->ni", R, eye - t, optimize=False) / scale[:, None]
    values["R_world_mesh"] = R
    values["t_world_mesh"] = t
    low, high = _world_boxes(R, t, scale, meshes)
    return PlacedBodies(values, int(counts.sum()), low, high)


def _world_boxes(
    R: Array, t: Array, scale: Array, meshes: Sequence[DeviceMesh]
) -> tuple[np.ndarray, np.ndarray]:
    low = np.stack([mesh.low_m for mesh in meshes]) * scale[:, None]
    high = np.stack([mesh.high_m for mesh in meshes]) * scale[:, None]
    centre = t + np.einsum("nij,nj->ni", R, 0.5 * (low + high), optimize=False)
    half = np.einsum("nij,nj->ni", np.abs(R), 0.5 * (high - low), optimize=False)
    # A hair of slack keeps flat boxes traversable after rounding to float32.
    half = half + 1e-6 * (1.0 + np.abs(centre))
    return (centre - half).astype(np.float32), (centre + half).astype(np.float32)


def pack_surfaces(materials: Sequence[Material], textures: dict[str, int]) -> np.ndarray:
    """Surface records; ``textures`` maps texture ids to their place among the textures."""
    values = np.zeros(max(len(materials), 1), dtype=records.Surface.numpy_dtype())
    for value, material in zip(values, materials, strict=False):
        value["base_color"] = material.base_color
        value["roughness"] = material.roughness
        value["metallic"] = material.metallic
        value["specular"] = material.specular
        value["texture"] = textures[material.texture] if material.texture else -1
        value["texture_scale_m"] = material.texture_scale_m
        value["emission_cd_m2"] = material.emission_cd_m2
    return values


def pack_lamps(lights: Sequence[Light]) -> np.ndarray:
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
        value["cos_inner"] = math.cos(0.8 * light.cone_rad)
    return values
