"""What a surface looks like at a point: colour, roughness and normal from its textures."""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.records import (
    Body,
    Geometry,
    Texture,
    View,
    World,
    unit,
)
from generator.renderers.kernels.surface import mesh_point
from generator.renderers.kernels.texturing import albedo_at, bump_at

wp.set_module_options({"enable_backward": False, "max_unroll": 3})


@wp.struct
class Look:
    """A surface with its textures looked up."""

    albedo: wp.vec3
    roughness: float
    normal: wp.vec3


@wp.func
def mesh_mapped(
    look: Look,
    texture: Texture,
    body: Body,
    geometry: Geometry,
    face: int,
    weight: wp.vec2,
    footprint_m: float,
):
    """Textures by the mesh's own UVs."""
    i = geometry.faces[3 * face]
    j = geometry.faces[3 * face + 1]
    k = geometry.faces[3 * face + 2]
    u = wp.where(weight[0] > 1.5, weight[0] - 2.0, weight[0])
    uv0 = geometry.uvs[i]
    d1 = geometry.uvs[j] - uv0
    d2 = geometry.uvs[k] - uv0
    uv = uv0 + d1 * u + d2 * weight[1]
    e1 = (geometry.vertices_m[j] - geometry.vertices_m[i]) * body.scale
    e2 = (geometry.vertices_m[k] - geometry.vertices_m[i]) * body.scale
    area_uv = d1[0] * d2[1] - d1[1] * d2[0]
    area_m2 = wp.length(wp.cross(e1, e2))
    texels = wp.abs(area_uv) * float(texture.width) * float(texture.height)
    level = 0.5 * wp.log2(wp.max(texels * footprint_m * footprint_m / area_m2, 1.0e-6))
    c = albedo_at(texture, uv[0], uv[1], level)
    look.albedo = wp.cw_mul(look.albedo, wp.vec3(c[0], c[1], c[2]))
    look.roughness *= c[3]
    if texture.has_bumps != 0 and area_uv != 0.0:
        bump = bump_at(texture, uv[0], uv[1], level)
        tangent = body.R_world_mesh @ ((e1 * d2[1] - e2 * d1[1]) / area_uv)
        bitangent = body.R_world_mesh @ ((e2 * d1[0] - e1 * d2[0]) / area_uv)
        n = look.normal
        tangent = unit(tangent - n * wp.dot(n, tangent))
        bitangent = unit(bitangent - n * wp.dot(n, bitangent))
        look.normal = unit(tangent * bump[0] + bitangent * bump[1] + n * bump[2])
    return look


@wp.func
def axis_texel(texture: Texture, p: wp.vec3, axis: int, level: float):
    """One of the three projections of triplanar mapping; X and Y faces keep Z upright."""
    u = p[0]
    v = p[1]
    if axis == 0:
        u = p[1]
        v = p[2]
    elif axis == 1:
        u = p[0]
        v = p[2]
    return albedo_at(texture, u, v, level)


@wp.func
def axis_bump(texture: Texture, p: wp.vec3, axis: int, level: float, n: wp.vec3):
    """Normal of one projection, in the mesh frame.

    Source: Golus, "Normal mapping for a triplanar shader", 2017 (tangent offsets added).
    """
    u = p[0]
    v = p[1]
    if axis == 0:
        u = p[1]
        v = p[2]
    elif axis == 1:
        u = p[0]
        v = p[2]
    bump = bump_at(texture, u, v, level)
    tilted = wp.vec3(bump[0], bump[1], 0.0)
    if axis == 0:
        tilted = wp.vec3(0.0, bump[0], bump[1])
    elif axis == 1:
        tilted = wp.vec3(bump[0], 0.0, bump[1])
    return n * wp.max(bump[2], 0.1) + tilted


@wp.func
def box_mapped(
    look: Look, texture: Texture, body: Body, scale_m: float, p_mesh: wp.vec3, footprint_m: float
):
    """Textures projected along the body's three axes, blended where the surface turns."""
    n = wp.transpose(body.R_world_mesh) @ look.normal
    p = p_mesh * (body.scale / scale_m)
    level = wp.log2(wp.max(footprint_m / scale_m * float(texture.width), 1.0e-3))
    w = wp.vec3(n[0] * n[0], n[1] * n[1], n[2] * n[2])
    # Fourth powers of the squares: projections meet in a narrow band only.
    w = wp.cw_mul(w, w)
    w = wp.cw_mul(w, w)
    w = w / (w[0] + w[1] + w[2])
    c = wp.vec4(0.0)
    m = wp.vec3(0.0)
    for axis in range(3):
        if w[axis] > 0.004:
            c += axis_texel(texture, p, axis, level) * w[axis]
            if texture.has_bumps != 0:
                m += axis_bump(texture, p, axis, level, n) * w[axis]
    look.albedo = wp.cw_mul(look.albedo, wp.vec3(c[0], c[1], c[2]))
    look.roughness *= c[3]
    if texture.has_bumps != 0:
        look.normal = unit(body.R_world_mesh @ m)
    return look


@wp.func
def look_at_hit(
    view: View,
    world: World,
    hit: wp.vec2i,
    weight: wp.vec2,
    normal: wp.vec3,
    z_m: float,
    v: wp.vec3,
):
    """The material at a pixel, with its textures looked up; ``v`` points to the viewer."""
    body = world.bodies[hit[0]]
    geometry = world.geometries[body.geometry]
    material = world.surfaces[body.first_material + geometry.face_slots[hit[1]]]
    look = Look()
    look.albedo = material.base_color
    look.roughness = material.roughness
    look.normal = normal
    if material.texture >= 0:
        # Half-way between the short and the long axis of the footprint's ellipse.
        slant = wp.sqrt(wp.max(wp.dot(normal, v), 0.05))
        footprint_m = z_m * view.pixel_rad / slant
        texture = world.textures[material.texture]
        if material.texture_scale_m > 0.0:
            p_mesh = mesh_point(geometry, hit[1], weight)
            look = box_mapped(look, texture, body, material.texture_scale_m, p_mesh, footprint_m)
        else:
            look = mesh_mapped(look, texture, body, geometry, hit[1], weight, footprint_m)
    return look
