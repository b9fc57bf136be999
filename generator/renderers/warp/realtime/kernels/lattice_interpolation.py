"""Interpolation of light from the lattice to all pixels.

A cell lies between four lattice points, and its pixels that show one face are a stretch: they share
the lattice points whose light they blend, and a texture's mapping and mip level. Four of them are
shaded at once.
"""

import warp as wp

from gen_data.renderers.warp.atmosphere.kernels.ground_weathering import (
    SNOW_BLUE,
    SNOW_GREEN,
    SNOW_RED,
)
from gen_data.renderers.warp.native_code import native
from gen_data.renderers.warp.realtime.kernels import lattice_lighting, soft_shadows
from gen_data.renderers.warp.scene.kernels import (
    environment_lighting,
    material_eval,
    records,
    texture_sampling,
)
from gen_data.renderers.warp.scene.kernels.lattice import Lattice, points_agree, step_at

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Light of two points may be blended if their normals differ by less than eight degrees.
SMOOTH_COSINE = wp.constant(0.99)
# Least extrapolated light, as a share of the nearest point's. It may fall towards a corner but not
# rise: the edge of a shadow next to a rim must not shine.
CONTINUED_MIN = wp.constant(0.4)


@wp.func
def agreement(
    images: records.GBufferRecord,
    lattice: Lattice,
    surface: int,
    i: int,
    p: wp.vec3,
    tolerance_m: float,
    q: int,
):
    """Cosine between the normals of pixel i and lattice point q; 0 on different surfaces.

    Two points of one triangle count as coplanar.
    """
    cosine = float(0.0)
    if lattice.surface[q] == surface:
        hit = images.hits[lattice.pixel[q]]
        if hit[0] == images.hits[i][0] and hit[1] == images.hits[i][1]:
            cosine = 1.0
        else:
            cosine = points_agree(
                p, images.normals[i], lattice.p_m[q], lattice.normal[q], tolerance_m
            )
    return cosine


@wp.struct
class Stretch:
    """The pixels of a cell that show one face.

    Light that depends on the normal is approximated by one lamp in the mean direction of all.

    Attributes:
        first: The cell's upper left lattice point.
        columns: Lattice points per row.
        agrees: Bits of the cell's corners whose light is blended.
        turns: Bits of the corners from which the surface turns too sharply.
        beyond: Per corner off the surface, the lattice point from which light is continued to it
            over a corner that agrees; -1 for none.
        texture: -1 for none.
        bumpy: 1 if the texture tilts normals and there is light that depends on them.
        towards: Unit direction towards the lamps.
        half: Half vector between it and the viewer.
        lamps, shine: As in LatticeLight.
    """

    face: wp.vec2i
    first: int
    columns: int
    agrees: int
    turns: int
    beyond: wp.vec4i
    albedo: wp.vec3
    roughness: float
    texture: int
    bumpy: int
    towards: wp.vec3
    half: wp.vec3
    lamps: float
    shine: float


@wp.func
def point_beyond(lattice: Lattice, stretch: Stretch, first: int, k: int):
    """The lattice point behind the agreeing neighbour of a cell's corner off the surface; or -1.

    The neighbour below or above comes first, then the one to the side of the corner.
    """
    corners = stretch.agrees | stretch.turns
    x = first % lattice.width + (k & 1)
    y = first / lattice.width + k / 2
    if (corners >> k) & 1 != 0:
        x = -1
    elif (stretch.agrees >> (k ^ 2)) & 1 != 0:
        y += wp.where(k < 2, 2, -2)
    elif (stretch.agrees >> (k ^ 1)) & 1 != 0:
        x += wp.where((k & 1) == 0, 2, -2)
    else:
        x = -1
    inside = x >= 0 and y >= 0 and x < lattice.width and y < lattice.height
    return wp.where(inside, y * lattice.width + x, -1)


@wp.func
def stretch_at(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    lattice: Lattice,
    lights: wp.array[lattice_lighting.LatticeLight],
    surface: int,
    first: int,
    x: int,
    y: int,
):
    """The stretch of a pixel with a surface in the cell to the right of and below a lattice point.

    Its texture's patch and sampler come second and third, undefined without a texture.
    """
    i = y * view.width + x
    stretch = Stretch()
    patch = texture_sampling.Patch()
    sampler = texture_sampling.Sampler()
    stretch.face = images.hits[i]
    stretch.first = first
    stretch.columns = lattice.width
    d = records.pixel_direction(view, float(x) + 0.5, float(y) + 0.5)
    p = view.eye_m + view.R_world_camera @ (d * images.z_m[i])
    tolerance_m = soft_shadows.surface_tolerance(view, p)
    towards = wp.vec3(0.0)
    lamps = float(0.0)
    shine = float(0.0)
    found = float(0.0)
    for k in range(4):
        q = first + (k & 1) + wp.where(k >= 2, lattice.width, 0)
        cosine = agreement(images, lattice, surface, i, p, tolerance_m, q)
        if cosine > SMOOTH_COSINE:
            stretch.agrees |= 1 << k
            towards += lights[q].towards
            lamps += lights[q].lamps
            shine += lights[q].shine
            found += 1.0
        elif cosine > 0.0:
            stretch.turns |= 1 << k
    stretch.beyond = wp.vec4i(-1)
    if stretch.agrees > 0 and stretch.agrees < ALL_CORNERS:
        for k in range(4):
            q = point_beyond(lattice, stretch, first, k)
            if q >= 0 and agreement(images, lattice, surface, i, p, tolerance_m, q) > SMOOTH_COSINE:
                stretch.beyond[k] = q
    stretch.albedo = world.surfaces[surface].base_color
    stretch.roughness = world.surfaces[surface].roughness
    stretch.texture = world.surfaces[surface].texture
    if stretch.texture >= 0 and found > 0.0:
        patch = texture_sampling.patch_at(world, surface, stretch.face)
        n = images.normals[i]
        v = records.fast_normalize(view.eye_m - p)
        # Footprints are ellipses: use the level of the geometric mean of both axes.
        slant = wp.max(wp.dot(n, v), 0.05)
        width_m = records.pixel_width(view, i, images.z_m[i])
        width_m = material_eval.print_footprint(world, surface, images.weights[i], width_m)
        texels = width_m * patch.texels_per_m / wp.sqrt(slant)
        sampler = texture_sampling.make_sampler(world, stretch.texture, wp.log2(texels))
        if world.textures[stretch.texture].has_bumps != 0 and wp.dot(towards, towards) > 0.0:
            stretch.bumpy = 1
            stretch.towards = records.fast_normalize(towards)
            stretch.half = records.fast_normalize(stretch.towards + v)
            stretch.lamps = lamps / found
            stretch.shine = shine / found
    return stretch, patch, sampler


ALL_CORNERS = wp.constant(15)
# Bits of a cell's pixels: column in the lower two of their numbers, row in the upper two.
CELL_ROW = wp.constant(4)


@wp.func_native(native("realtime/kernels/shade_stretch.h", CONTINUED_MIN=CONTINUED_MIN))
def shade_stretch(
    view: records.View,
    images: records.GBufferRecord,
    textures: wp.array[records.TextureRecord],
    lights: wp.array[lattice_lighting.LatticeLight],
    coats: wp.array[wp.vec4],
    covered: bool,
    white: wp.vec3,
    stretch: Stretch,
    patch: texture_sampling.Patch,
    sampler: texture_sampling.Sampler,
    stride: int,
    x0: int,
    y0: int,
    step_x: float,
    step_y: float,
    radiance: wp.array[wp.vec3],
) -> int:
    """Shade the pixels of a stretch.

    Args:
        covered: Whether ``coats`` count, see GroundRecord; ``white`` is the albedo of snow.
        stride, x0, y0: Size of the cell and its first pixel.
        step_x, step_y: Size of a pixel in units of its cell.

    Returns:
        Bits of the stretch's pixels in the cell, and 2^16 times the bits of pixels that cannot be
        interpolated, because the surface turns too sharply or no lattice point lies on it.
    """
    ...


@wp.func
def background(view: records.View, world: records.World, x: int, y: int):
    """Radiance of a pixel without a surface."""
    c = wp.vec3(0.0)
    if world.sky.visible != 0:
        d = records.pixel_direction(view, float(x) + 0.5, float(y) + 0.5)
        c = environment_lighting.sky_image(world.sky, view.R_world_camera @ d)
    return c


@wp.kernel
def gather_light(
    view: records.View,
    world: records.World,
    images: records.GBufferRecord,
    lattice: Lattice,
    lights: wp.array[lattice_lighting.LatticeLight],
    coats: wp.array[wp.vec4],
    run: int,
    count: wp.array[int],
    pixels: wp.array[int],
    radiance: wp.array[wp.vec3],
):
    """Shade every pixel from lattice points, or list it for individual shading.

    Args:
        coats: As written by light_lattice.
        run: Cells in a row per thread.
        count: Length of the list; 0 at first.
        pixels: The list, in any order.
    """
    row, segment = wp.tid()
    y0 = row * lattice.stride
    y1 = wp.min(y0 + lattice.stride, view.height)
    step_y = step_at(lattice, y0, view.height)
    covered = world.ground.covered != 0
    for column in range(segment * run, wp.min((segment + 1) * run, lattice.width - 1)):
        first = row * lattice.width + column
        x0 = column * lattice.stride
        x1 = wp.min(x0 + lattice.stride, view.width)
        step_x = step_at(lattice, x0, view.width)
        done = int(0)
        missed = int(0)
        for y in range(y0, y1):
            x = int(x0)
            while x < x1:
                i = y * view.width + x
                bit = 1 << (CELL_ROW * (y - y0) + x - x0)
                if (done & bit) == 0:
                    hit = images.hits[i]
                    if hit[0] >= 0:
                        surface = records.surface_index(world, hit)
                        missed |= bit
                        if lattice_lighting.is_gatherable(world, surface):
                            stretch, patch, sampler = stretch_at(
                                view, world, images, lattice, lights, surface, first, x, y
                            )
                            bits = shade_stretch(
                                view,
                                images,
                                world.textures,
                                lights,
                                coats,
                                covered,
                                wp.vec3(SNOW_RED, SNOW_GREEN, SNOW_BLUE),
                                stretch,
                                patch,
                                sampler,
                                lattice.stride,
                                x0,
                                y0,
                                step_x,
                                step_y,
                                radiance,
                            )
                            done |= bits & 65535
                            missed = (missed & ~bit) | (bits >> 16)
                    else:
                        radiance[i] = background(view, world, x, y)
                if (missed & bit) != 0:
                    # An atomic counter appends the pixel to the list.
                    pixels[wp.atomic_add(count, 0, 1)] = i
                x += 1
