"""Material evaluation: colour, roughness and normal of a surface from its textures."""

import warp as wp

from gen_data.renderers.warp.scene.kernels import alpha_test, records
from gen_data.renderers.warp.scene.kernels.texture_sampling import make_sampler, texel_at

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# A footprint as large as any texture: its mean.
EVERYTHING_M = wp.constant(1.0e6)


@wp.struct
class SurfaceMaterial:
    """Material parameters at a point, textures included; ``normal`` in the world frame.

    ``translucency`` is the ratio of diffuse transmittance to ``albedo``.
    """

    albedo: wp.vec3
    roughness: float
    metallic: float
    specular: float
    normal: wp.vec3
    translucency: wp.vec3


@wp.func
def is_translucent(world: records.World, surface: int):
    """Whether a surface scatters light to its other side."""
    return wp.max(world.surfaces[surface].translucency) > 0.0


@wp.func
def sheet_normal(world: records.World, surface: int, hit: wp.vec2i, weight: wp.vec2):
    """Geometric normal of a translucent surface on its visible side; 0 for opaque surfaces.

    Smooth normals of foliage lean out of the crown: they do not separate the sides of a leaf.
    """
    n = wp.vec3(0.0)
    if is_translucent(world, surface):
        n = records.flat_normal(world, hit)
        if records.is_back_face(weight):
            n = -n
    return n


@wp.func
def print_footprint(world: records.World, surface: int, weight: wp.vec2, width_m: float):
    """Width over which a texture is averaged: the back of a print shows its mean."""
    prints = world.surfaces[surface].one_sided != 0
    if prints and records.is_back_face(weight) and world.surfaces[surface].texture_scale_m == 0.0:
        return EVERYTHING_M
    return width_m


@wp.func
def apply_uv_texture(
    material: SurfaceMaterial,
    world: records.World,
    texture: int,
    hit: wp.vec2i,
    weight: wp.vec2,
    footprint_m: float,
):
    """Apply a texture by the mesh's own UVs."""
    b = hit[0]
    g = world.bodies[b].geometry
    corner = records.face_vertices(world, g, hit[1])
    uv0 = world.geometries[g].uvs[corner[0]]
    d1 = world.geometries[g].uvs[corner[1]] - uv0
    d2 = world.geometries[g].uvs[corner[2]] - uv0
    u = records.first_weight(weight)
    uv = uv0 + d1 * u + d2 * weight[1]
    p = records.vertex_at(world, g, corner[0])
    scale = world.bodies[b].scale
    e1 = (records.vertex_at(world, g, corner[1]) - p) * scale
    e2 = (records.vertex_at(world, g, corner[2]) - p) * scale
    area_uv = d1[0] * d2[1] - d1[1] * d2[0]
    area_m2 = wp.length(wp.cross(e1, e2))
    size = float(world.textures[texture].width * world.textures[texture].height)
    # Area of the pixel's footprint in texels; a mip level halves sides, hence half the logarithm.
    texels = wp.abs(area_uv) * size * footprint_m * footprint_m / wp.max(area_m2, 1.0e-12)
    level = 0.5 * wp.log2(wp.max(texels, 1.0e-6))
    bumpy = world.textures[texture].has_bumps != 0
    texel = texel_at(world, texture, make_sampler(world, texture, level), uv[0], uv[1], bumpy)
    material.albedo = wp.cw_mul(material.albedo, texel.albedo)
    material.roughness *= texel.roughness
    # Without an area in UV space there are no tangents: the normal stays.
    if bumpy and area_uv != 0.0:
        bump = texel.bump
        tangent = world.bodies[b].R_world_mesh @ ((e1 * d2[1] - e2 * d1[1]) / area_uv)
        bitangent = world.bodies[b].R_world_mesh @ ((e2 * d1[0] - e1 * d2[0]) / area_uv)
        n = material.normal
        # Gram-Schmidt: interpolated normals are not perpendicular to the face's tangents.
        tangent = records.fast_normalize(tangent - n * wp.dot(n, tangent))
        bitangent = records.fast_normalize(bitangent - n * wp.dot(n, bitangent))
        material.normal = records.fast_normalize(
            tangent * bump[0] + bitangent * bump[1] + n * bump[2]
        )
    return material


@wp.func
def tilt_normal(bump: wp.vec3, axis: int, n: wp.vec3):
    """Perturbed normal of one projection, in the mesh frame.

    Source: Golus, "Normal mapping for a triplanar shader", 2017 (tangent offsets added).
    """
    offset = wp.vec3(bump[0], bump[1], 0.0)
    if axis == 0:
        offset = wp.vec3(0.0, bump[0], bump[1])
    elif axis == 1:
        offset = wp.vec3(bump[0], 0.0, bump[1])
    # A texture tilts a normal by at most 84 degrees: no side of it may face away.
    return n * wp.max(bump[2], 0.1) + offset


@wp.func
def apply_triplanar_texture(
    material: SurfaceMaterial,
    world: records.World,
    texture: int,
    b: int,
    p_mesh: wp.vec3,
    scale_m: float,
    footprint_m: float,
):
    """Apply a texture projected along the body's three axes, blended by the normal."""
    n = wp.transpose(world.bodies[b].R_world_mesh) @ material.normal
    p = p_mesh * (world.bodies[b].scale / scale_m)
    texels = footprint_m / scale_m * float(world.textures[texture].width)
    sampler = make_sampler(world, texture, wp.log2(wp.max(texels, 1.0e-3)))
    bumpy = world.textures[texture].has_bumps != 0
    # Weights are eighth powers of the normal: projections blend in a narrow band only.
    w = wp.cw_mul(n, n)
    w = wp.cw_mul(w, w)
    w = wp.cw_mul(w, w)
    w = w * (1.0 / (w[0] + w[1] + w[2]))
    albedo = wp.vec3(0.0)
    roughness = float(0.0)
    m = wp.vec3(0.0)
    for axis in range(3):
        # A weight below one step of 8 bits is not worth a texture lookup.
        if w[axis] > 0.004:
            uv = alpha_test.project_uv(p, axis)
            texel = texel_at(world, texture, sampler, uv[0], uv[1], bumpy)
            albedo += texel.albedo * w[axis]
            roughness += texel.roughness * w[axis]
            m += tilt_normal(texel.bump, axis, n) * w[axis]
    material.albedo = wp.cw_mul(material.albedo, albedo)
    material.roughness *= roughness
    if bumpy:
        material.normal = records.fast_normalize(world.bodies[b].R_world_mesh @ m)
    return material


@wp.func
def plain_material(world: records.World, surface: int, normal: wp.vec3):
    """Material of a surface without its textures."""
    material = SurfaceMaterial()
    material.albedo = world.surfaces[surface].base_color
    material.roughness = world.surfaces[surface].roughness
    material.metallic = world.surfaces[surface].metallic
    material.specular = world.surfaces[surface].specular
    material.normal = normal
    material.translucency = world.surfaces[surface].translucency
    return material


@wp.func
def evaluate_material(
    world: records.World,
    surface: int,
    hit: wp.vec2i,
    weight: wp.vec2,
    normal: wp.vec3,
    width_m: float,
    v: wp.vec3,
):
    """Material at a pixel of the given width, textures included; ``v`` points to the viewer."""
    material = plain_material(world, surface, normal)
    texture = world.surfaces[surface].texture
    if texture >= 0:
        # Geometric mean of the axes of the footprint's ellipse; bounded at grazing angles.
        slant = wp.sqrt(wp.max(wp.dot(normal, v), 0.05))
        footprint_m = width_m / slant
        scale_m = world.surfaces[surface].texture_scale_m
        if scale_m > 0.0:
            p_mesh = records.mesh_point(world, hit, weight)
            material = apply_triplanar_texture(
                material, world, texture, hit[0], p_mesh, scale_m, footprint_m
            )
        else:
            footprint_m = print_footprint(world, surface, weight, footprint_m)
            material = apply_uv_texture(material, world, texture, hit, weight, footprint_m)
    return material
