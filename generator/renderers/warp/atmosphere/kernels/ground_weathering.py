"""What weather does to surfaces: wet, under water, under snow.

Source: Lagarde, "Water drop: physically based wet surfaces", 2013 (albedo and gloss of wet
surfaces).
"""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.scene.kernels.material_eval import SurfaceMaterial
from gen_data.generator.renderers.warp.scene.kernels.records import (
    View,
    World,
    fast_normalize,
    floor_int,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Fresh snow, a little blue; old snow is darker, but snow in towns is rarely old.
SNOW_RED = wp.constant(0.80)
SNOW_GREEN = wp.constant(0.83)
SNOW_BLUE = wp.constant(0.87)
# Walls get this share of the rain that level ground gets.
WALL_SHARE = wp.constant(0.4)


@wp.func
def smooth_ramp(low: float, high: float, x: float):
    """0 below low, 1 above high, smooth between."""
    t = wp.clamp((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


@wp.func
def hash_to_unit(x: int, y: int, seed: int):
    """A number in [0, 1) for each place of a lattice.

    Source: Jarzynski and Olano, "Hash functions for GPU rendering", JCGT 2020 (pcg).
    """
    key = wp.uint32(x) * wp.uint32(1664525) + wp.uint32(y) * wp.uint32(1013904223)
    state = (key + wp.uint32(seed)) * wp.uint32(747796405) + wp.uint32(1442695041)
    word = ((state >> ((state >> wp.uint32(28)) + wp.uint32(4))) ^ state) * wp.uint32(277803737)
    word = (word >> wp.uint32(22)) ^ word
    # 24 bits: as many as single precision holds, so that 1 is never reached.
    return float(word >> wp.uint32(8)) * (1.0 / 16777216.0)


@wp.func
def value_noise(x: float, y: float, seed: int):
    """Value noise with one lump per unit, in [-1, 1]."""
    i = floor_int(x)
    j = floor_int(y)
    u = x - float(i)
    v = y - float(j)
    # Without a slope at the lattice's lines, where creases would show.
    u = u * u * (3.0 - 2.0 * u)
    v = v * v * (3.0 - 2.0 * v)
    low = hash_to_unit(i, j, seed) * (1.0 - u) + hash_to_unit(i + 1, j, seed) * u
    high = hash_to_unit(i, j + 1, seed) * (1.0 - u) + hash_to_unit(i + 1, j + 1, seed) * u
    return 2.0 * (low * (1.0 - v) + high * v) - 1.0


@wp.func
def fractal_noise(x_m: float, y_m: float, size_m: float, seed: int):
    """Noise of four octaves; its mean is 0, its standard deviation 0.513."""
    x = x_m / size_m
    y = y_m / size_m
    # Octaves are turned, so that their lattices do not line up.
    total = value_noise(x, y, seed)
    total += 0.55 * value_noise(1.7 * x + 1.2 * y, 1.7 * y - 1.2 * x, seed + 1)
    total += 0.3 * value_noise(4.1 * x - 1.3 * y, 4.1 * y + 1.3 * x, seed + 2)
    total += 0.17 * value_noise(6.3 * x + 6.0 * y, 6.3 * y - 6.0 * x, seed + 3)
    return total


@wp.func
def estimate_porosity(world: World, surface: int):
    """How much water a material soaks up, from its roughness; Lagarde 2013."""
    rough = wp.clamp((world.surfaces[surface].roughness - 0.5) / 0.4, 0.0, 1.0)
    return rough * (1.0 - world.surfaces[surface].metallic)


@wp.func
def footprint(view: View, p: wp.vec3, n: wp.vec3, pixels: float):
    """Length on a surface of as many pixels, along the way to the viewer [m]."""
    to_eye = view.eye_m - p
    # At the horizon footprints are boundless; fifty pixels long is blurred enough.
    slant = wp.max(wp.abs(wp.dot(fast_normalize(to_eye), n)), 0.02)
    return pixels * view.pixel_rad * wp.length(to_eye) / slant


@wp.func
def edge_width(footprint_m: float, size_m: float):
    """How far the edges of patches spread where footprints are not small to them."""
    return wp.min(0.3 * footprint_m / size_m, 1.2)


@wp.func
def puddle_at(world: World, p: wp.vec3, n: wp.vec3, exposed: float, footprint_m: float):
    """How much of a point lies under standing water, in the mean over a footprint."""
    depth = float(0.0)
    # Water stands on what slopes by less than ten degrees.
    if world.ground.puddles > 0.0 and n[2] > 0.985:
        level = fractal_noise(p[0], p[1], 5.0, world.ground.seed)
        wide = edge_width(footprint_m, 5.0)
        edge = world.ground.puddle_level
        depth = smooth_ramp(edge - wide, edge + 0.12 + wide, level)
        depth *= smooth_ramp(0.985, 0.997, n[2]) * exposed
    return depth


@wp.func
def snow_rise(world: World, p: wp.vec3, n: wp.vec3, footprint_m: float):
    """Where a point is between the edge of snow, 0, and full cover, 1; more within [-2, 3]."""
    rise = float(-2.0)
    # Nothing holds on what is steeper than 78 degrees.
    if world.ground.snow_cover > 0.0 and n[2] > 0.2:
        level = fractal_noise(p[0], p[1], 3.0, world.ground.seed + 16)
        # On slopes it holds where there is most.
        level -= 1.6 * (1.0 - smooth_ramp(0.3, 0.85, n[2]))
        wide = edge_width(footprint_m, 3.0)
        rise = (level - world.ground.snow_level + 0.1 + wide) / (0.25 + 2.0 * wide)
    return wp.clamp(rise, -2.0, 3.0)


@wp.func
def snow_at(world: World, p: wp.vec3, n: wp.vec3, exposed: float, footprint_m: float):
    """How much of a point lies under snow, in the mean over a footprint."""
    return smooth_ramp(0.0, 1.0, snow_rise(world, p, n, footprint_m)) * exposed


@wp.struct
class Coat:
    """What the weather lays on a surface at a point.

    Attributes:
        wet, puddle, snow: Shares of the point.
        mixable: What neighbours may mix, for laid_on and bumps_through: factor of wetness on the
            albedo, how much of the surface's own bumps shows beside snow, the rise of snow, and
            its brightness where it is full.
    """

    wet: float
    puddle: float
    snow: float
    mixable: wp.vec4


@wp.func
def coat_at(world: World, surface: int, p: wp.vec3, n: wp.vec3, exposed: float, footprint_m: float):
    """The coat of a footprint at a point; ``n`` is its normal without bumps."""
    coat = Coat()
    porous = estimate_porosity(world, surface)
    coat.puddle = puddle_at(world, p, n, exposed, footprint_m) * porous
    facing = WALL_SHARE + (1.0 - WALL_SHARE) * wp.clamp(n[2], 0.0, 1.0)
    film = world.ground.wetness * facing * exposed * smooth_ramp(-0.5, 0.2, n[2])
    coat.wet = wp.max(film, coat.puddle)
    rise = snow_rise(world, p, n, footprint_m)
    coat.snow = smooth_ramp(0.0, 1.0, rise) * exposed
    full = exposed
    if coat.snow > 0.0:
        full *= 1.0 + 0.05 * fractal_noise(p[0], p[1], 0.35, world.ground.seed + 32)
    coat.mixable = wp.vec4(1.0 - 0.8 * porous * coat.wet, 1.0 - coat.puddle, rise, full)
    return coat


@wp.func
def mixed_snow(mixable: wp.vec4):
    """The share of snow that a mix of coats says, with the grain of its brightness."""
    return smooth_ramp(0.0, 1.0, mixable[2]) * mixable[3]


@wp.func
def albedo_below_coat(mixable: wp.vec4, albedo: wp.vec3):
    """An albedo below a mix of coats."""
    snow = mixed_snow(mixable)
    white = wp.vec3(SNOW_RED, SNOW_GREEN, SNOW_BLUE)
    return albedo * (mixable[0] * wp.max(1.0 - snow, 0.0)) + white * snow


@wp.func
def bump_visibility(mixable: wp.vec4):
    """How much of a surface's own bumps shows through a mix of coats."""
    return mixable[1] * (1.0 - 0.8 * wp.min(mixed_snow(mixable), 1.0))


@wp.func
def apply_coat(world: World, surface: int, material: SurfaceMaterial, coat: Coat, n: wp.vec3):
    """The surface as the weather leaves it; ``n`` is its normal without bumps."""
    material.albedo = albedo_below_coat(coat.mixable, material.albedo)
    bumps = bump_visibility(coat.mixable)
    material.roughness *= 1.0 - 0.4 * estimate_porosity(world, surface) * coat.wet
    # Water reflects instead; the ground below it shines no more.
    material.specular *= 1.0 - coat.puddle
    if coat.snow > 0.0:
        material.roughness += (0.85 - material.roughness) * coat.snow
        material.metallic *= 1.0 - coat.snow
        material.specular += (0.3 - material.specular) * coat.snow
    if bumps < 1.0:
        material.normal = fast_normalize(material.normal * bumps + n * (1.0 - bumps))
    return material
