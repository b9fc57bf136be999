"""Weathering of surfaces: wetness, puddles and snow.

Source: Lagarde, "Water drop: physically based wet surfaces", 2013 (albedo and gloss of wet
surfaces).
"""

import warp as wp

from gen_data.renderers.warp.scene.kernels.material_eval import SurfaceMaterial
from gen_data.renderers.warp.scene.kernels.records import View, World, fast_normalize, floor_int

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Albedo of fresh snow, slightly blue; old snow is darker, but snow in towns is rarely old.
SNOW_RED = wp.constant(0.80)
SNOW_GREEN = wp.constant(0.83)
SNOW_BLUE = wp.constant(0.87)
# Share of the rain on level ground that walls receive.
WALL_SHARE = wp.constant(0.4)
# Size of puddles; relative size of the noise that groups them in regions; drainage, in units of the
# noise (standard deviation 0.56): per metre above the gutter, and on soil.
# Assumed: of the puddles of gutters, crowns of roads (0.06 m) have a third, soil an eighth.
PUDDLE_M = wp.constant(5.0)
REGION_SHARE = wp.constant(0.5)
DRAINS_PER_M = wp.constant(6.0)
SOAKED = wp.constant(0.6)


@wp.func
def smooth_ramp(low: float, high: float, x: float):
    """Smoothstep: 0 below low, 1 above high."""
    t = wp.clamp((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


@wp.func
def hash_to_unit(x: int, y: int, seed: int):
    """A pseudo-random number in [0, 1) for each point of an integer grid.

    Source: Jarzynski and Olano, "Hash functions for GPU rendering", JCGT 2020 (pcg).
    """
    key = wp.uint32(x) * wp.uint32(1664525) + wp.uint32(y) * wp.uint32(1013904223)
    state = (key + wp.uint32(seed)) * wp.uint32(747796405) + wp.uint32(1442695041)
    word = ((state >> ((state >> wp.uint32(28)) + wp.uint32(4))) ^ state) * wp.uint32(277803737)
    word = (word >> wp.uint32(22)) ^ word
    # 24 bits are exact in single precision: 1 is never reached by rounding.
    return float(word >> wp.uint32(8)) * (1.0 / 16777216.0)


@wp.func
def value_noise(x: float, y: float, seed: int):
    """Value noise with one feature per unit, in [-1, 1]."""
    i = floor_int(x)
    j = floor_int(y)
    u = x - float(i)
    v = y - float(j)
    # Zero slope at the grid lines, where creases would be visible.
    u = u * u * (3.0 - 2.0 * u)
    v = v * v * (3.0 - 2.0 * v)
    low = hash_to_unit(i, j, seed) * (1.0 - u) + hash_to_unit(i + 1, j, seed) * u
    high = hash_to_unit(i, j + 1, seed) * (1.0 - u) + hash_to_unit(i + 1, j + 1, seed) * u
    return 2.0 * (low * (1.0 - v) + high * v) - 1.0


@wp.func
def fractal_noise(x_m: float, y_m: float, size_m: float, seed: int):
    """Noise of four octaves with mean 0 and standard deviation 0.513."""
    x = x_m / size_m
    y = y_m / size_m
    # Octaves are rotated: their grids must not line up.
    total = value_noise(x, y, seed)
    total += 0.55 * value_noise(1.7 * x + 1.2 * y, 1.7 * y - 1.2 * x, seed + 1)
    total += 0.3 * value_noise(4.1 * x - 1.3 * y, 4.1 * y + 1.3 * x, seed + 2)
    total += 0.17 * value_noise(6.3 * x + 6.0 * y, 6.3 * y - 6.0 * x, seed + 3)
    return total


@wp.func
def estimate_porosity(world: World, surface: int):
    """Porosity of a material, estimated from its roughness (Lagarde 2013)."""
    rough = wp.clamp((world.surfaces[surface].roughness - 0.5) / 0.4, 0.0, 1.0)
    return rough * (1.0 - world.surfaces[surface].metallic)


@wp.func
def footprint(view: View, p: wp.vec3, n: wp.vec3, pixels: float):
    """Length on a surface of a number of pixels, along the viewing direction [m]."""
    to_eye = view.eye_m - p
    # Footprints diverge at the horizon; fifty pixels are blurred enough.
    slant = wp.max(wp.abs(wp.dot(fast_normalize(to_eye), n)), 0.02)
    return pixels * view.pixel_rad * wp.length(to_eye) / slant


@wp.func
def edge_width(footprint_m: float, size_m: float):
    """Widening of the edges of patches by large footprints: antialiases the noise's threshold."""
    return wp.min(0.3 * footprint_m / size_m, 1.2)


@wp.func
def wet_places(world: World, surface: int, p: wp.vec3):
    """Tendency of water to stand at a point, normal noise minus drainage: 0 on a level pavement.

    Water runs from the crowns of roads and from pavements to gutters, the lowest places of streets,
    which lie at z = 0; on hills and decks the rule fades out. Soil and turf let it seep away.
    """
    level = fractal_noise(p[0], p[1], PUDDLE_M, world.ground.seed)
    # Some regions of the ground hold more water than others.
    level += REGION_SHARE * value_noise(p[0] / 31.0, p[1] / 31.0, world.ground.seed + 48)
    rise_m = wp.clamp(p[2], 0.0, 0.2) * wp.clamp(2.0 - p[2], 0.0, 1.0)
    return level - DRAINS_PER_M * rise_m - SOAKED * world.surfaces[surface].soaks


@wp.func
def puddle_at(
    world: World, surface: int, p: wp.vec3, n: wp.vec3, exposed: float, footprint_m: float
):
    """Share of standing water at a point, averaged over a footprint."""
    depth = float(0.0)
    # Standing water needs slopes below ten degrees.
    if world.ground.puddles > 0.0 and n[2] > 0.985:
        level = wet_places(world, surface, p)
        wide = edge_width(footprint_m, PUDDLE_M)
        edge = world.ground.puddle_level
        depth = smooth_ramp(edge - wide, edge + 0.12 + wide, level)
        depth *= smooth_ramp(0.985, 0.997, n[2]) * exposed
    return depth


@wp.func
def snow_rise(world: World, p: wp.vec3, n: wp.vec3, footprint_m: float):
    """Position between the edge of snow, 0, and full cover, 1; within [-2, 3]."""
    rise = float(-2.0)
    # No snow holds on slopes above 78 degrees.
    if world.ground.snow_cover > 0.0 and n[2] > 0.2:
        level = fractal_noise(p[0], p[1], 3.0, world.ground.seed + 16)
        # On slopes only the thickest snow holds.
        level -= 1.6 * (1.0 - smooth_ramp(0.3, 0.85, n[2]))
        wide = edge_width(footprint_m, 3.0)
        rise = (level - world.ground.snow_level + 0.1 + wide) / (0.25 + 2.0 * wide)
    return wp.clamp(rise, -2.0, 3.0)


@wp.func
def snow_at(world: World, p: wp.vec3, n: wp.vec3, exposed: float, footprint_m: float):
    """Share of snow at a point, averaged over a footprint."""
    return smooth_ramp(0.0, 1.0, snow_rise(world, p, n, footprint_m)) * exposed


@wp.struct
class Coat:
    """Water and snow on a surface at a point.

    Attributes:
        wet, puddle, snow: Shares of the point that are wet, under water and under snow.
        mixable: Values that interpolate linearly, for albedo_below_coat and bump_visibility: factor
            of wetness on albedo, visibility of the surface's own bumps next to snow, snow_rise, and
            brightness of full snow.
    """

    wet: float
    puddle: float
    snow: float
    mixable: wp.vec4


@wp.func
def coat_at(world: World, surface: int, p: wp.vec3, n: wp.vec3, exposed: float, footprint_m: float):
    """The coat of a footprint at a point; ``n`` is the normal without bumps."""
    coat = Coat()
    porous = estimate_porosity(world, surface)
    coat.puddle = puddle_at(world, surface, p, n, exposed, footprint_m) * porous
    facing = WALL_SHARE + (1.0 - WALL_SHARE) * wp.clamp(n[2], 0.0, 1.0)
    film = world.ground.wetness * facing * exposed * smooth_ramp(-0.5, 0.2, n[2])
    coat.wet = wp.max(film, coat.puddle)
    rise = snow_rise(world, p, n, footprint_m)
    coat.snow = smooth_ramp(0.0, 1.0, rise) * exposed
    full = exposed
    if coat.snow > 0.0:
        # Grain of five percent: uniform white looks artificial.
        full *= 1.0 + 0.05 * fractal_noise(p[0], p[1], 0.35, world.ground.seed + 32)
    coat.mixable = wp.vec4(1.0 - 0.8 * porous * coat.wet, 1.0 - coat.puddle, rise, full)
    return coat


@wp.func
def mixed_snow(mixable: wp.vec4):
    """Share of snow in interpolated coats, including the grain of its brightness."""
    # The ramp is applied after interpolation: edges of snow stay sharp between lattice points.
    return smooth_ramp(0.0, 1.0, mixable[2]) * mixable[3]


@wp.func
def albedo_below_coat(mixable: wp.vec4, albedo: wp.vec3):
    """Albedo below interpolated coats."""
    snow = mixed_snow(mixable)
    white = wp.vec3(SNOW_RED, SNOW_GREEN, SNOW_BLUE)
    return albedo * (mixable[0] * wp.max(1.0 - snow, 0.0)) + white * snow


@wp.func
def bump_visibility(mixable: wp.vec4):
    """Visibility of a surface's own bumps through interpolated coats."""
    return mixable[1] * (1.0 - 0.8 * wp.min(mixed_snow(mixable), 1.0))


@wp.func
def apply_coat(world: World, surface: int, material: SurfaceMaterial, coat: Coat, n: wp.vec3):
    """The material under water and snow; ``n`` is its normal without bumps."""
    own = material.albedo
    material.albedo = albedo_below_coat(coat.mixable, material.albedo)
    if coat.snow > 0.0 and wp.max(material.translucency) > 0.0:
        # Snow lets no light through: the share of the sheet's own albedo still transmits.
        bare = own * (coat.mixable[0] * wp.max(1.0 - mixed_snow(coat.mixable), 0.0))
        material.translucency = wp.cw_mul(
            material.translucency, wp.cw_div(bare, wp.max(material.albedo, wp.vec3(1.0e-6)))
        )
    bumps = bump_visibility(coat.mixable)
    material.roughness *= 1.0 - 0.4 * estimate_porosity(world, surface) * coat.wet
    # The water reflects instead; the ground below it has no highlights.
    material.specular *= 1.0 - coat.puddle
    if coat.snow > 0.0:
        material.roughness += (0.85 - material.roughness) * coat.snow
        material.metallic *= 1.0 - coat.snow
        material.specular += (0.3 - material.specular) * coat.snow
    if bumps < 1.0:
        material.normal = fast_normalize(material.normal * bumps + n * (1.0 - bumps))
    return material
