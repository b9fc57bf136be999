"""Texture sampling: bilinear taps of mip levels chosen by a pixel's footprint."""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.scene.kernels.records import World, floor_int

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
