"""Environment lighting: irradiance, prefiltered reflections and the image itself.

Sources: Ramamoorthi and Hanrahan, "An efficient representation for irradiance environment maps",
SIGGRAPH 2001; Karis, "Real shading in Unreal Engine 4", 2013 (prefiltered reflections); Cigolle et
al., "A survey of efficient representations for independent unit vectors", JCGT 2014 (octahedral).
"""

import warp as wp

from gen_data.renderers.warp.native_code import native
from gen_data.renderers.warp.scene.kernels import records

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})


@wp.func
def to_sky(sky: records.EnvironmentRecord, d: wp.vec3):
    """Rotate a world direction into the frame of the image."""
    return wp.vec3(
        sky.cos_yaw * d[0] + sky.sin_yaw * d[1], sky.cos_yaw * d[1] - sky.sin_yaw * d[0], d[2]
    )


@wp.func
def sky_irradiance(sky: records.EnvironmentRecord, n_world: wp.vec3):
    """Irradiance over pi from the hemisphere around a normal [cd/m^2]."""
    n = to_sky(sky, n_world)
    c = sky.irradiance
    e = c[0] + c[1] * n[1] + c[2] * n[2] + c[3] * n[0]
    e += c[4] * (n[0] * n[1]) + c[5] * (n[1] * n[2]) + c[6] * (3.0 * n[2] * n[2] - 1.0)
    e += c[7] * (n[0] * n[2]) + c[8] * (n[0] * n[0] - n[1] * n[1])
    # Second-order harmonics may ring below zero opposite to a strong source.
    return wp.max(e, wp.vec3(0.0, 0.0, 0.0)) * sky.luminance


@wp.func
def sky_image(sky: records.EnvironmentRecord, d_world: wp.vec3):
    """Luminance of the image in one direction of any length [cd/m^2]."""
    return sample_panorama(sky.image, to_sky(sky, d_world)) * sky.luminance


@wp.func
def sky_rest(sky: records.EnvironmentRecord, d_world: wp.vec3):
    """As sky_image, without the parts that lamps represent."""
    return sample_panorama(sky.rest, to_sky(sky, d_world)) * sky.luminance


@wp.func
def sample_panorama(image: wp.array2d[wp.vec3], direction: wp.vec3):
    """An equirectangular image in one direction of its own frame, bilinear; any length."""
    d = records.fast_normalize(direction)
    height = image.shape[0]
    width = image.shape[1]
    # Row 0 is the zenith and columns run clockwise from -X; texel centres are at halves.
    x = (0.5 - wp.atan2(d[1], d[0]) * (0.5 / wp.pi)) * float(width) - 0.5
    # Clamped: rounding may leave a unit vector's z at 1 + 1e-7, whose arc cosine is NaN.
    y = wp.acos(wp.clamp(d[2], -1.0, 1.0)) / wp.pi * float(height) - 0.5
    return blend_texels(image, x, y)


@wp.func
def blend_texels(image: wp.array2d[wp.vec3], x: float, y: float):
    """An equirectangular image at a position in texels from the centre of the first, bilinear."""
    height = image.shape[0]
    width = image.shape[1]
    x0 = records.floor_int(x)
    y0 = records.floor_int(y)
    fx = x - float(x0)
    fy = y - float(y0)
    # Around the horizon columns wrap; rows end at the poles.
    xa = (x0 + width) % width
    xb = (x0 + 1 + width) % width
    ya = wp.clamp(y0, 0, height - 1)
    yb = wp.clamp(y0 + 1, 0, height - 1)
    top = image[ya, xa] * (1.0 - fx) + image[ya, xb] * fx
    bottom = image[yb, xa] * (1.0 - fx) + image[yb, xb] * fx
    return top * (1.0 - fy) + bottom * fy


@wp.func
def octahedral(d: wp.vec3):
    """Project a direction to the square [-1, 1] x [-1, 1]."""
    # Onto the octahedron |x| + |y| + |z| = 1 (Meyer et al., "On floating-point normal vectors",
    # 2010).
    s = 1.0 / (wp.abs(d[0]) + wp.abs(d[1]) + wp.abs(d[2]))
    x = d[0] * s
    y = d[1] * s
    # The lower half is folded outwards over the diagonals.
    if d[2] < 0.0:
        fold_x = (1.0 - wp.abs(y)) * wp.where(x >= 0.0, 1.0, -1.0)
        y = (1.0 - wp.abs(x)) * wp.where(y >= 0.0, 1.0, -1.0)
        x = fold_x
    return wp.vec2(x, y)


@wp.func
def glossy_level(sky: records.EnvironmentRecord, level: int, p: wp.vec2):
    """One prefiltered map at a point of the square; maps have a border of one texel."""
    # The border repeats texels across the fold: bilinear taps need no special cases.
    inner = float(sky.glossy.shape[1] - 2)
    x = (p[0] * 0.5 + 0.5) * inner + 0.5
    y = (p[1] * 0.5 + 0.5) * inner + 0.5
    x0 = int(x)
    y0 = int(y)
    fx = x - float(x0)
    fy = y - float(y0)
    top = sky.glossy[level, y0, x0] * (1.0 - fx) + sky.glossy[level, y0, x0 + 1] * fx
    bottom = sky.glossy[level, y0 + 1, x0] * (1.0 - fx) + sky.glossy[level, y0 + 1, x0 + 1] * fx
    return top * (1.0 - fy) + bottom * fy


@wp.func
def sky_reflection(sky: records.EnvironmentRecord, d_world: wp.vec3, roughness: float):
    """Radiance averaged over the lobe of a roughness around a mirrored direction."""
    levels = sky.glossy.shape[0]
    level = roughness * float(levels) - 1.0
    p = octahedral(to_sky(sky, d_world))
    lower = wp.clamp(records.floor_int(level), 0, levels - 1)
    upper = wp.min(lower + 1, levels - 1)
    part = wp.clamp(level - float(lower), 0.0, 1.0)
    rough = glossy_level(sky, lower, p)
    if part > 0.0:
        rough = rough * (1.0 - part) + glossy_level(sky, upper, p) * part
    rough = rough * sky.luminance
    if level < 0.0:
        # Between the sharp image and the first map.
        rough = sky_rest(sky, d_world) * (-level) + rough * (1.0 + level)
    return rough


@wp.func
def octahedral_direction(x: float, y: float):
    """The inverse of ``octahedral``; unit length."""
    # On the octahedron; negative in the folded corners, the lower half.
    z = 1.0 - wp.abs(x) - wp.abs(y)
    if z < 0.0:
        fold_x = (1.0 - wp.abs(y)) * wp.where(x >= 0.0, 1.0, -1.0)
        y = (1.0 - wp.abs(x)) * wp.where(y >= 0.0, 1.0, -1.0)
        x = fold_x
    return records.fast_normalize(wp.vec3(x, y, z))


@wp.kernel
def weigh_texels(
    directions: wp.array[wp.vec3],
    solid_angles: wp.array[float],
    alpha: float,
    size: int,
    shares: wp.array3d[float],
):
    """Weights of an environment's texels in the GGX lobe around each direction of a map.

    The lobe of a surface viewed head-on, weighted by the cosine to the light (Karis 2013).

    Args:
        directions, solid_angles: Directions and solid angles of the environment's texels.
        size: Texels along the octahedral map's edge, without its border.
        shares: By groups of eight texels of the map, texels of the environment, and lanes.
    """
    texel = wp.tid()
    x = float(texel % size) + 0.5
    y = float(texel / size) + 0.5
    n = octahedral_direction(x / float(size) * 2.0 - 1.0, y / float(size) * 2.0 - 1.0)
    weight = float(0.0)
    a2 = alpha * alpha
    # The GGX constant cancels in the normalisation below.
    for i in range(directions.shape[0]):
        c = wp.dot(n, directions[i])
        share = float(0.0)
        if c > 0.0:
            # With the viewer along n, cos^2 of the half angle is (1 + c) / 2.
            q = 0.5 * (1.0 + c) * (a2 - 1.0) + 1.0
            share = c / (q * q) * solid_angles[i]
        shares[texel / 8, i, texel % 8] = share
        weight += share
    for i in range(directions.shape[0]):
        shares[texel / 8, i, texel % 8] = shares[texel / 8, i, texel % 8] / weight


@wp.func_native(native("scene/kernels/weighted_means.h"))
def weighted_means(
    shares: wp.array3d[wp.float32],
    radiance: wp.array[wp.vec3],
    first: int,
    means: wp.array[wp.vec3],
):
    """Write the weighted means of eight texels of a map; of one on CUDA."""
    ...


@wp.kernel
def prefilter(
    shares: wp.array3d[float], radiance: wp.array[wp.vec3], lanes: int, smoothed: wp.array[wp.vec3]
):
    """Average an environment over the lobe around each direction of an octahedral map.

    Args:
        shares: Weights as written by ``weigh_texels``.
        lanes: Texels of the map per thread: 8 on the CPU, 1 on CUDA.
    """
    weighted_means(shares, radiance, wp.tid() * lanes, smoothed)
