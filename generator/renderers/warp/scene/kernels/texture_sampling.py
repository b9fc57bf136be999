"""Texture sampling: bilinear taps of mip levels chosen by a pixel's footprint.

Patches are flat faces whose texture coordinates are linear in space, for fast lookups.
"""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.scene.kernels.records import (
    World,
    face_vertices,
    fast_normalize,
    floor_int,
    normal_at,
    vertex_at,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Mask of every second byte: two bytes are weighted by one multiplication without overlapping.
EVEN_BYTES = wp.constant(wp.uint32(0x00FF00FF))
LOW_HALF = wp.constant(wp.uint32(0xFFFF))
# 255 times the weights' sum of 256: full scale of a weighted sum of bytes.
FULL = wp.constant(65280.0)


@wp.struct
class Taps:
    """Addresses of the four texels around a point, with weights in 1/256."""

    a: int
    b: int
    c: int
    d: int
    wa: wp.uint32
    wb: wp.uint32
    wc: wp.uint32
    wd: wp.uint32


@wp.struct
class Texel:
    """Values of a texture at a point: linear albedo, factor on roughness, tangent-space normal."""

    albedo: wp.vec3
    roughness: float
    bump: wp.vec3


@wp.struct
class Sampler:
    """A texture's mip levels for one size of footprint.

    Attributes:
        first, width, height: First texel and size of the finer mip level.
        coarser_first: Of the next level, blended with weight ``part``; unused if that is 0.
    """

    first: int
    width: int
    height: int
    coarser_first: int
    part: float


@wp.func
def make_sampler(world: World, texture: int, level: float):
    """The sampler of a fractional mip level."""
    bounded = wp.clamp(level, 0.0, float(world.textures[texture].levels - 1))
    lower = int(bounded)
    # Levels blend over the middle half of their distance only: elsewhere half the taps suffice.
    part = wp.clamp(2.0 * (bounded - float(lower)) - 0.5, 0.0, 1.0)
    if part == 1.0:
        lower += 1
        part = 0.0
    s = Sampler()
    s.first = world.textures[texture].offsets[lower]
    s.width = wp.max(world.textures[texture].width >> lower, 1)
    s.height = wp.max(world.textures[texture].height >> lower, 1)
    s.part = part
    if part > 0.0:
        s.coarser_first = world.textures[texture].offsets[lower + 1]
    return s


@wp.func
def taps_at(first: int, width: int, height: int, u: float, v: float):
    """Texels of a level around (u, v), which repeats; v grows upwards, rows downwards."""
    # Beyond this, single precision holds no position within a texel.
    u = wp.clamp(u, -1.0e6, 1.0e6)
    v = wp.clamp(v, -1.0e6, 1.0e6)
    x = (u - float(floor_int(u))) * float(width) - 0.5
    y = (1.0 - (v - float(floor_int(v)))) * float(height) - 0.5
    x0 = floor_int(x)
    y0 = floor_int(y)
    right = wp.uint32(int((x - float(x0)) * 256.0))
    down = wp.uint32(int((y - float(y0)) * 256.0))
    # After rounding, x may be a hair outside [-0.5, width - 0.5].
    x1 = wp.where(x0 + 1 >= width, 0, x0 + 1)
    y1 = wp.where(y0 + 1 >= height, 0, y0 + 1)
    x0 = wp.where(x0 < 0, width - 1, wp.where(x0 < width, x0, width - 1))
    y0 = wp.where(y0 < 0, height - 1, wp.where(y0 < height, y0, height - 1))
    t = Taps()
    t.a = first + y0 * width + x0
    t.b = first + y0 * width + x1
    t.c = first + y1 * width + x0
    t.d = first + y1 * width + x1
    # Three weights are derived from one product, so that all four sum to exactly 256.
    t.wd = (right * down) >> wp.uint32(8)
    t.wb = right - t.wd
    t.wc = down - t.wd
    t.wa = wp.uint32(256) - right - t.wc
    return t


@wp.func
def mix_texels(texels: wp.array[wp.uint32], t: Taps):
    """Weighted sum of four texels of four bytes each."""
    a = texels[t.a]
    b = texels[t.b]
    c = texels[t.c]
    d = texels[t.d]
    # A byte times 256 fits the 16 bits of its lane: no carry reaches the next one.
    even = (a & EVEN_BYTES) * t.wa + (b & EVEN_BYTES) * t.wb
    even += (c & EVEN_BYTES) * t.wc + (d & EVEN_BYTES) * t.wd
    shift = wp.uint32(8)
    odd = ((a >> shift) & EVEN_BYTES) * t.wa + ((b >> shift) & EVEN_BYTES) * t.wb
    odd += ((c >> shift) & EVEN_BYTES) * t.wc + ((d >> shift) & EVEN_BYTES) * t.wd
    half = wp.uint32(16)
    return wp.vec4(
        float(int(even & LOW_HALF)),
        float(int(odd & LOW_HALF)),
        float(int(even >> half)),
        float(int(odd >> half)),
    )


@wp.func
def texel_at(world: World, texture: int, s: Sampler, u: float, v: float, bumpy: bool):
    """The texture at a point; normals only on request."""
    taps = taps_at(s.first, s.width, s.height, u, v)
    c = mix_texels(world.textures[texture].texels, taps)
    texel = Texel()
    if bumpy:
        # Normals come from the finer level alone: blending them is not worth four more taps.
        m = mix_texels(world.textures[texture].bumps, taps) * (2.0 / FULL)
        texel.bump = wp.vec3(m[0] - 1.0, m[1] - 1.0, m[2] - 1.0)
    if s.part > 0.0:
        width = wp.max(s.width >> 1, 1)
        height = wp.max(s.height >> 1, 1)
        upper = taps_at(s.coarser_first, width, height, u, v)
        c = c * (1.0 - s.part) + mix_texels(world.textures[texture].texels, upper) * s.part
    c = c * (1.0 / FULL)
    # Colours are stored as square roots of linear values.
    texel.albedo = wp.vec3(c[0] * c[0], c[1] * c[1], c[2] * c[2])
    texel.roughness = c[3]
    return texel


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
