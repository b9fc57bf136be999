"""Textures: bilinear taps of mip levels chosen by the footprint of a pixel."""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.records import World, floor_int

wp.set_module_options({"enable_backward": False, "max_unroll": 3})


@wp.func
def unpacked(texel: wp.uint32):
    """Four bytes as floats; the lowest first."""
    return wp.vec4(
        float(texel & wp.uint32(255)),
        float((texel >> wp.uint32(8)) & wp.uint32(255)),
        float((texel >> wp.uint32(16)) & wp.uint32(255)),
        float(texel >> wp.uint32(24)),
    )


@wp.struct
class Taps:
    """Addresses and fractions of one bilinear lookup that wraps around."""

    a: int
    b: int
    c: int
    d: int
    fx: float
    fy: float


@wp.func
def taps_at(world: World, texture: int, u: float, v: float, level: int):
    """The four texels around (u, v); v grows upwards, rows downwards."""
    width = wp.max(world.textures[texture].width >> level, 1)
    height = wp.max(world.textures[texture].height >> level, 1)
    x = (u - float(floor_int(u))) * float(width) - 0.5
    y = (1.0 - (v - float(floor_int(v)))) * float(height) - 0.5
    x0 = floor_int(x)
    y0 = floor_int(y)
    t = Taps()
    t.fx = x - float(x0)
    t.fy = y - float(y0)
    x1 = wp.where(x0 + 1 >= width, 0, x0 + 1)
    y1 = wp.where(y0 + 1 >= height, 0, y0 + 1)
    x0 = wp.where(x0 < 0, width - 1, x0)
    y0 = wp.where(y0 < 0, height - 1, wp.min(y0, height - 1))
    x0 = wp.min(x0, width - 1)
    first = world.textures[texture].offsets[level]
    t.a = first + y0 * width + x0
    t.b = first + y0 * width + x1
    t.c = first + y1 * width + x0
    t.d = first + y1 * width + x1
    return t


@wp.func
def squared_rgb(c: wp.vec4):
    """Colours are stored as square roots."""
    return wp.vec4(c[0] * c[0], c[1] * c[1], c[2] * c[2], c[3] * 255.0)


@wp.func
def albedo_at_level(world: World, texture: int, u: float, v: float, level: int):
    """Linear albedo and roughness factor, both in [0, 255^2]."""
    t = taps_at(world, texture, u, v, level)
    top = squared_rgb(unpacked(world.textures[texture].texels[t.a])) * (1.0 - t.fx)
    top += squared_rgb(unpacked(world.textures[texture].texels[t.b])) * t.fx
    bottom = squared_rgb(unpacked(world.textures[texture].texels[t.c])) * (1.0 - t.fx)
    bottom += squared_rgb(unpacked(world.textures[texture].texels[t.d])) * t.fx
    return top * (1.0 - t.fy) + bottom * t.fy


@wp.func
def albedo_at(world: World, texture: int, u: float, v: float, level: float):
    """Linear albedo and roughness factor in [0, 1], between two mip levels."""
    bounded = wp.clamp(level, 0.0, float(world.textures[texture].levels - 1))
    lower = int(bounded)
    # Levels are blended over the middle half of their distance only: half the taps elsewhere.
    part = wp.clamp(2.0 * (bounded - float(lower)) - 0.5, 0.0, 1.0)
    if part == 1.0:
        lower += 1
    c = albedo_at_level(world, texture, u, v, lower)
    if part > 0.0 and part < 1.0:
        c = c * (1.0 - part) + albedo_at_level(world, texture, u, v, lower + 1) * part
    return c * (1.0 / 65025.0)


@wp.func
def bump_at(world: World, texture: int, u: float, v: float, level: float):
    """Tangent-space normal at the nearest mip level, not normalised."""
    t = taps_at(world, texture, u, v, int(wp.clamp(level + 0.5, 0.0, float(world.textures[texture].levels - 1))))
    top = unpacked(world.textures[texture].bumps[t.a]) * (1.0 - t.fx) + unpacked(world.textures[texture].bumps[t.b]) * t.fx
    bottom = unpacked(world.textures[texture].bumps[t.c]) * (1.0 - t.fx) + unpacked(world.textures[texture].bumps[t.d]) * t.fx
    c = (top * (1.0 - t.fy) + bottom * t.fy) * (2.0 / 255.0)
    return wp.vec3(c[0] - 1.0, c[1] - 1.0, c[2] - 1.0)
