"""Texture sampling: bilinear taps of mip levels chosen by a pixel's footprint.

Patches are flat faces whose texture coordinates are linear in space, for fast lookups.
"""

import warp as wp

from gen_data.renderers.warp.scene.kernels import records

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

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
        coarser_first: First texel of the next level, blended with weight ``part``; unused if that
            is 0.
    """

    first: int
    width: int
    height: int
    coarser_first: int
    part: float


@wp.func
def make_sampler(world: records.World, texture: int, level: float):
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
    x = (u - float(records.floor_int(u))) * float(width) - 0.5
    y = (1.0 - (v - float(records.floor_int(v)))) * float(height) - 0.5
    x0 = records.floor_int(x)
    y0 = records.floor_int(y)
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
    # Three weights are derived from one product: all four sum to exactly 256.
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
def texel_at(world: records.World, texture: int, s: Sampler, u: float, v: float, bumpy: bool):
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
    """The mapping of a face's texture: three texture coordinates that are linear in space.

    Coordinate k of the point at depth z along a direction d of the camera frame (with z = 1) is
    ``start[k] + dot(row k of gradients, d) * z``. A projection along one of three axes takes the
    other two coordinates, as alpha_test.project_uv; UVs are the projection along the third.

    Attributes:
        triplanar: 1 if all three projections count, weighted by the normal.
        axes: Unit directions in which the coordinates grow, in columns; world.
        texels_per_m: Square root of texels per area, at the finest mip level.
    """

    triplanar: int
    start: wp.vec3
    gradients: wp.mat33
    axes: wp.mat33
    texels_per_m: float


@wp.func
def triplanar_patch(world: records.World, surface: int, b: int):
    """Patch of a texture projected along the body's axes, as apply_triplanar_texture."""
    scale_m = world.surfaces[surface].texture_scale_m
    texture = world.surfaces[surface].texture
    scale = world.bodies[b].scale / scale_m
    patch = Patch()
    patch.triplanar = 1
    patch.start = world.bodies[b].eye_mesh * scale
    patch.gradients = world.bodies[b].B_mesh_camera * scale
    patch.axes = world.bodies[b].R_world_mesh
    patch.texels_per_m = float(world.textures[texture].width) / scale_m
    return patch


@wp.func
def uv_patch(world: records.World, texture: int, hit: wp.vec2i):
    """Patch of a texture mapped by the mesh's own UVs, as material_eval.apply_uv_texture."""
    b = hit[0]
    g = world.bodies[b].geometry
    corner = records.face_vertices(world, g, hit[1])
    p = records.vertex_at(world, g, corner[0])
    e1 = records.vertex_at(world, g, corner[1]) - p
    e2 = records.vertex_at(world, g, corner[2]) - p
    uv0 = world.geometries[g].uvs[corner[0]]
    d1 = world.geometries[g].uvs[corner[1]] - uv0
    d2 = world.geometries[g].uvs[corner[2]] - uv0
    area_uv = d1[0] * d2[1] - d1[1] * d2[0]
    n = wp.cross(e1, e2)
    squared = wp.dot(n, n)
    patch = Patch()
    patch.start = wp.vec3(uv0[0], uv0[1], 0.0)
    if squared > 0.0:
        # Gradients of the barycentric weights of the second and third corner.
        inverse = 1.0 / squared
        along_1 = wp.cross(e2, n) * inverse
        along_2 = wp.cross(n, e1) * inverse
        g_u = along_1 * d1[0] + along_2 * d2[0]
        g_v = along_1 * d1[1] + along_2 * d2[1]
        # Folding the camera's pose into the gradients leaves one dot product per pixel.
        to_camera = wp.transpose(world.bodies[b].B_mesh_camera)
        eye = world.bodies[b].eye_mesh - p
        patch.start = wp.vec3(uv0[0] + wp.dot(g_u, eye), uv0[1] + wp.dot(g_v, eye), 0.0)
        patch.gradients = wp.matrix_from_rows(to_camera @ g_u, to_camera @ g_v, wp.vec3(0.0))
        size = float(world.textures[texture].width * world.textures[texture].height)
        texels_per_area = wp.abs(area_uv) * size * wp.sqrt(inverse)
        patch.texels_per_m = wp.sqrt(texels_per_area) / world.bodies[b].scale
    # Without an area in UV space there are no tangents: the normal stays.
    if world.textures[texture].has_bumps != 0 and area_uv != 0.0:
        sign = wp.where(area_uv < 0.0, -1.0, 1.0)
        tangent = records.fast_normalize(e1 * d2[1] - e2 * d1[1]) * sign
        bitangent = records.fast_normalize(e2 * d1[0] - e1 * d2[0]) * sign
        patch.axes = world.bodies[b].R_world_mesh @ wp.matrix_from_cols(
            tangent, bitangent, wp.vec3(0.0)
        )
    return patch


@wp.func
def patch_at(world: records.World, surface: int, hit: wp.vec2i):
    """The patch of a textured (body, face)."""
    patch = Patch()
    if world.surfaces[surface].texture_scale_m > 0.0:
        patch = triplanar_patch(world, surface, hit[0])
    else:
        patch = uv_patch(world, world.surfaces[surface].texture, hit)
    return patch
