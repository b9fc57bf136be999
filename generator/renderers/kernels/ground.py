"""What weather does to surfaces: wet, under water, under snow.

Source: Lagarde, "Water drop: physically based wet surfaces", 2013 (albedo and gloss of wet
surfaces).
"""

from __future__ import annotations

import warp as wp

from generator.renderers.kernels.look import Look
from generator.renderers.kernels.records import World, floor_int, unit

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Fresh snow, a little blue; old snow is darker, but snow in towns is rarely old.
SNOW_RED = wp.constant(0.80)
SNOW_GREEN = wp.constant(0.83)
SNOW_BLUE = wp.constant(0.87)
# Walls get this share of the rain that level ground gets.
WALL_SHARE = wp.constant(0.4)


@wp.func
def smooth(low: float, high: float, x: float):
    """0 below low, 1 above high, smooth between."""
    t = wp.clamp((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


@wp.func
def scattered(x: int, y: int, seed: int):
    """A number in [0, 1) for each place of a lattice.

    Source: Jarzynski and Olano, "Hash functions for GPU rendering", JCGT 2020 (pcg).
    """
    key = wp.uint32(x) * wp.uint32(1664525) + wp.uint32(y) * wp.uint32(1013904223)
    state = (key + wp.uint32(seed)) * wp.uint32(747796405) + wp.uint32(1442695041)
    word = ((state >> ((state >> wp.uint32(28)) + wp.uint32(4))) ^ state) * wp.uint32(277803737)
    word = (word >> wp.uint32(22)) ^ word
    return float(word >> wp.uint32(8)) * (1.0 / 16777216.0)


@wp.func
def lumps(x: float, y: float, seed: int):
    """Value noise with one lump per unit, in [-1, 1]."""
    i = floor_int(x)
    j = floor_int(y)
    u = x - float(i)
    v = y - float(j)
    u = u * u * (3.0 - 2.0 * u)
    v = v * v * (3.0 - 2.0 * v)
    low = scattered(i, j, seed) * (1.0 - u) + scattered(i + 1, j, seed) * u
    high = scattered(i, j + 1, seed) * (1.0 - u) + scattered(i + 1, j + 1, seed) * u
    return 2.0 * (low * (1.0 - v) + high * v) - 1.0


@wp.func
def patches(x_m: float, y_m: float, size_m: float, seed: int):
    """Noise of four octaves; its mean is 0, its standard deviation 0.513."""
    x = x_m / size_m
    y = y_m / size_m
    # Octaves are turned, so that their lattices do not line up.
    total = lumps(x, y, seed)
    total += 0.55 * lumps(1.7 * x + 1.2 * y, 1.7 * y - 1.2 * x, seed + 1)
    total += 0.3 * lumps(4.1 * x - 1.3 * y, 4.1 * y + 1.3 * x, seed + 2)
    total += 0.17 * lumps(6.3 * x + 6.0 * y, 6.3 * y - 6.0 * x, seed + 3)
    return total


@wp.func
def porosity_of(world: World, surface: int):
    """How much water a material soaks up, from its roughness; Lagarde 2013."""
    rough = wp.clamp((world.surfaces[surface].roughness - 0.5) / 0.4, 0.0, 1.0)
    return rough * (1.0 - world.surfaces[surface].metallic)


@wp.func
def puddle_at(world: World, p: wp.vec3, n: wp.vec3, exposed: float):
    """How much of a point lies under standing water."""
    depth = float(0.0)
    if world.ground.puddles > 0.0 and n[2] > 0.985:
        level = patches(p[0], p[1], 5.0, world.ground.seed)
        depth = smooth(world.ground.puddle_level, world.ground.puddle_level + 0.12, level)
        depth *= smooth(0.985, 0.997, n[2]) * exposed
    return depth


@wp.func
def snow_at(world: World, p: wp.vec3, n: wp.vec3, exposed: float):
    """How much of a point lies under snow."""
    cover = float(0.0)
    if world.ground.snow_cover > 0.0 and n[2] > 0.2:
        level = patches(p[0], p[1], 3.0, world.ground.seed + 16)
        # On slopes it holds where there is most.
        level -= 1.6 * (1.0 - smooth(0.3, 0.85, n[2]))
        cover = smooth(world.ground.snow_level - 0.1, world.ground.snow_level + 0.15, level)
        cover *= exposed
    return cover


@wp.func
def weathered(world: World, surface: int, look: Look, n: wp.vec3, p: wp.vec3, i: int):
    """The surface at pixel i as the weather leaves it; ``n`` is its normal without bumps."""
    exposed = world.ground.exposed[i]
    porous = porosity_of(world, surface)
    puddle = puddle_at(world, p, n, exposed) * porous
    facing = WALL_SHARE + (1.0 - WALL_SHARE) * wp.clamp(n[2], 0.0, 1.0)
    wet = wp.max(world.ground.wetness * facing * exposed * smooth(-0.5, 0.2, n[2]), puddle)
    factor = 1.0 - 0.8 * porous
    gloss = 1.0 - look.roughness
    look.albedo = look.albedo * (1.0 + (factor - 1.0) * wet)
    gloss = 1.0 + (gloss - 1.0) * (1.0 + (factor - 1.0) * 0.5 * wet)
    look.roughness = 1.0 - gloss
    if puddle > 0.0:
        look.normal = unit(look.normal * (1.0 - puddle) + n * puddle)
        # Water reflects instead; the ground below it shines no more.
        look.specular *= 1.0 - puddle
    snow = snow_at(world, p, n, exposed)
    if snow > 0.0:
        white = wp.vec3(SNOW_RED, SNOW_GREEN, SNOW_BLUE)
        grain = 1.0 + 0.05 * patches(p[0], p[1], 0.35, world.ground.seed + 32)
        look.albedo = look.albedo * (1.0 - snow) + white * (grain * snow)
        look.roughness += (0.85 - look.roughness) * snow
        look.metallic *= 1.0 - snow
        look.specular += (0.3 - look.specular) * snow
        look.normal = unit(look.normal * (1.0 - 0.8 * snow) + n * (0.8 * snow))
    return look
