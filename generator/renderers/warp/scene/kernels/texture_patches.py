"""Patches: flat faces whose texture coordinates are linear in space, for fast lookups."""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.scene.kernels.records import (
    World,
    face_vertices,
    fast_normalize,
    normal_at,
    vertex_at,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})


@wp.struct
class Patch:
    """A face with linear texture coordinates and a single normal, if ``flat``.

    The coordinate u of the point at depth z along a direction d of the camera frame (with z = 1) is
    ``u + dot(to_u, d) * z``; v likewise.

    Attributes:
        face: (body, face).
        texels_per_m: Square root of texels per area, at the finest mip level.
        tangent, bitangent, normal: Tangent frame of the normal map, world.
    """

    face: wp.vec2i
    flat: int
    u: float
    v: float
    to_u: wp.vec3
    to_v: wp.vec3
    texels_per_m: float
    tangent: wp.vec3
    bitangent: wp.vec3
    normal: wp.vec3


@wp.func
def set_mapping(
    patch: Patch, world: World, b: int, g_u: wp.vec3, c_u: float, g_v: wp.vec3, c_v: float
):
    """Patch with coordinates ``c_u + dot(g_u, p)`` at points p of the mesh frame; v likewise."""
    eye = world.bodies[b].eye_mesh
    to_camera = wp.transpose(world.bodies[b].B_mesh_camera)
    # Folding the camera's pose into the gradients leaves one dot product per pixel.
    patch.u = c_u + wp.dot(g_u, eye)
    patch.v = c_v + wp.dot(g_v, eye)
    patch.to_u = to_camera @ g_u
    patch.to_v = to_camera @ g_v
    patch.flat = 1
    return patch


@wp.func
def triplanar_patch(patch: Patch, world: World, surface: int, b: int, n: wp.vec3):
    """Patch of a projected texture where one projection dominates."""
    # As material_eval.apply_triplanar_texture, which blends all three.
    squared = wp.cw_mul(n, n)
    x = wp.vec3(1.0, 0.0, 0.0)
    y = wp.vec3(0.0, 1.0, 0.0)
    z = wp.vec3(0.0, 0.0, 1.0)
    along_u = x
    along_v = z
    largest = squared[1]
    if squared[0] > largest:
        largest = squared[0]
        along_u = y
    if squared[2] > largest:
        largest = squared[2]
        along_u = x
        along_v = y
    # The other two projections then have weights below 0.004 (eighth powers), which are skipped.
    if wp.dot(n, n) - largest < 0.2 * largest:
        scale_m = world.surfaces[surface].texture_scale_m
        texture = world.surfaces[surface].texture
        scale = world.bodies[b].scale / scale_m
        patch = set_mapping(patch, world, b, along_u * scale, 0.0, along_v * scale, 0.0)
        patch.texels_per_m = float(world.textures[texture].width) / scale_m
        patch.tangent = world.bodies[b].R_world_mesh @ along_u
        patch.bitangent = world.bodies[b].R_world_mesh @ along_v
    return patch


@wp.func
def uv_patch(patch: Patch, world: World, texture: int, b: int, corner: wp.vec3i):
    """Patch of a texture mapped by the mesh's own UVs, as material_eval.apply_uv_texture."""
    g = world.bodies[b].geometry
    p = vertex_at(world, g, corner[0])
    e1 = vertex_at(world, g, corner[1]) - p
    e2 = vertex_at(world, g, corner[2]) - p
    uv0 = world.geometries[g].uvs[corner[0]]
    d1 = world.geometries[g].uvs[corner[1]] - uv0
    d2 = world.geometries[g].uvs[corner[2]] - uv0
    area_uv = d1[0] * d2[1] - d1[1] * d2[0]
    n = wp.cross(e1, e2)
    squared = wp.dot(n, n)
    if squared > 0.0 and area_uv != 0.0:
        # Gradients of the barycentric weights of the second and third corner.
        along_1 = wp.cross(e2, n) * (1.0 / squared)
        along_2 = wp.cross(n, e1) * (1.0 / squared)
        g_u = along_1 * d1[0] + along_2 * d2[0]
        g_v = along_1 * d1[1] + along_2 * d2[1]
        patch = set_mapping(
            patch, world, b, g_u, uv0[0] - wp.dot(g_u, p), g_v, uv0[1] - wp.dot(g_v, p)
        )
        scale = world.bodies[b].scale
        size = float(world.textures[texture].width * world.textures[texture].height)
        texels_per_area = wp.abs(area_uv) * size / wp.sqrt(squared)
        patch.texels_per_m = wp.sqrt(texels_per_area) / scale
        tangent = world.bodies[b].R_world_mesh @ ((e1 * d2[1] - e2 * d1[1]) * wp.sign(area_uv))
        bitangent = world.bodies[b].R_world_mesh @ ((e2 * d1[0] - e1 * d2[0]) * wp.sign(area_uv))
        normal = patch.normal
        patch.tangent = fast_normalize(tangent - normal * wp.dot(normal, tangent))
        patch.bitangent = fast_normalize(bitangent - normal * wp.dot(normal, bitangent))
    return patch


@wp.func
def patch_at(world: World, surface: int, hit: wp.vec2i, normal: wp.vec3):
    """The patch of a textured (body, face) at a point with the given normal."""
    patch = Patch()
    patch.face = hit
    patch.normal = normal
    b = hit[0]
    g = world.bodies[b].geometry
    corner = face_vertices(world, g, hit[1])
    n = normal_at(world, g, corner[0])
    turn = wp.dot(n, normal_at(world, g, corner[1]))
    turn = wp.min(turn, wp.dot(n, normal_at(world, g, corner[2])))
    # Vertex normals within 0.8 degrees: shading treats the face as flat.
    if turn > 0.9999:
        if world.surfaces[surface].texture_scale_m > 0.0:
            patch = triplanar_patch(patch, world, surface, b, n)
        else:
            patch = uv_patch(patch, world, world.surfaces[surface].texture, b, corner)
    return patch
