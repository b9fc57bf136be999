"""Interpolation of light from the lattice to all pixels.

A cell lies between four lattice points. Where all four lie on one smooth stretch of surface, the
cell's pixels share the work: light takes a few multiplications per pixel, and a texture only its
addresses and texels. Elsewhere each pixel tests each point.
"""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.atmosphere.kernels.ground_weathering import (
    albedo_below_coat,
    bump_visibility,
)
from gen_data.generator.renderers.warp.realtime.kernels.lattice import (
    Cell,
    Lattice,
    cell_at,
    cell_corner,
    points_agree,
    step_at,
)
from gen_data.generator.renderers.warp.realtime.kernels.lattice_lighting import (
    LatticeLight,
    is_gatherable,
)
from gen_data.generator.renderers.warp.realtime.kernels.soft_shadows import surface_tolerance
from gen_data.generator.renderers.warp.scene.kernels.environment_lighting import sky_image
from gen_data.generator.renderers.warp.scene.kernels.material_eval import evaluate_material
from gen_data.generator.renderers.warp.scene.kernels.records import (
    GBufferRecord,
    View,
    World,
    fast_normalize,
    pixel_direction,
    pixel_width,
    surface_index,
)
from gen_data.generator.renderers.warp.scene.kernels.texture_sampling import (
    Patch,
    Sampler,
    make_sampler,
    patch_at,
    texel_at,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Light of two points may be blended if their normals differ by less than eight degrees.
SMOOTH_COSINE = wp.constant(0.99)


@wp.func
def agreement(
    view: View, images: GBufferRecord, lattice: Lattice, surface: int, i: int, p: wp.vec3, q: int
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
            tolerance_m = surface_tolerance(view, p)
            cosine = points_agree(
                p, images.normals[i], lattice.p_m[q], lattice.normal[q], tolerance_m
            )
    return cosine


@wp.struct
class Quad:
    """A cell whose corners lie on one smooth stretch of surface, if ``smooth``.

    Attributes:
        face: (body, face) of the first corner.
        normal: Mean unit normal of the corners, world frame.
        to_viewer: Unit direction to the viewer from the middle.
    """

    smooth: int
    face: wp.vec2i
    normal: wp.vec3
    to_viewer: wp.vec3


@wp.func
def quad_at(view: View, world: World, images: GBufferRecord, lattice: Lattice, q: int):
    """The cell to the right of and below lattice point q."""
    quad = Quad()
    surface = lattice.surface[q]
    if surface < 0:
        return quad
    if not is_gatherable(world, surface):
        return quad
    quad.face = images.hits[lattice.pixel[q]]
    p = lattice.p_m[q]
    n = lattice.normal[q]
    tolerance_m = surface_tolerance(view, p)
    middle = p
    mean = n
    smooth = bool(True)
    for k in range(1, 4):
        r = q + (k & 1) + wp.where(k >= 2, lattice.width, 0)
        if smooth:
            smooth = False
            if lattice.surface[r] == surface:
                other = images.hits[lattice.pixel[r]]
                # One face is flat, whatever its vertex normals.
                smooth = other[0] == quad.face[0] and other[1] == quad.face[1]
                if not smooth:
                    cosine = points_agree(p, n, lattice.p_m[r], lattice.normal[r], tolerance_m)
                    smooth = cosine > SMOOTH_COSINE
                middle += lattice.p_m[r]
                mean += lattice.normal[r]
    if smooth:
        quad.smooth = 1
        middle = middle * 0.25
        quad.normal = fast_normalize(mean)
        quad.to_viewer = fast_normalize(view.eye_m - middle)
    return quad


@wp.struct
class Tilt:
    """Dependence of a cell's light on the normal: see bump_factors.

    Attributes:
        towards: Unit direction towards the lamps; 0 for none.
        half: Half vector between it and the viewer.
        before: Cosine between ``towards`` and the surface's normal.
        n_h: Cosine between ``half`` and the surface's normal.
        lamps, shine: As in LatticeLight.
    """

    towards: wp.vec3
    half: wp.vec3
    before: float
    n_h: float
    lamps: float
    shine: float


@wp.func
def make_tilt(towards: wp.vec3, lamps: float, shine: float, n: wp.vec3, v: wp.vec3):
    """Tilt from the sum of the light's directions, the normal and the viewer."""
    tilt = Tilt()
    if wp.dot(towards, towards) > 0.0:
        tilt.towards = fast_normalize(towards)
        tilt.half = fast_normalize(tilt.towards + v)
        # The ratio of cosines diverges at grazing light.
        tilt.before = wp.max(wp.dot(n, tilt.towards), 0.1)
        tilt.n_h = wp.dot(n, tilt.half)
        tilt.lamps = lamps
        tilt.shine = shine
    return tilt


@wp.func
def bump_factors(tilt: Tilt, roughness: float, m: wp.vec3):
    """Factors on diffuse light and on the rest where a texture tilts the normal to m.

    All lamps are approximated by one in their mean direction.
    """
    after = wp.max(wp.dot(m, tilt.towards), 0.0)
    alpha = roughness * roughness
    narrow = 1.0 - alpha * alpha
    m_h = wp.dot(m, tilt.half)
    # The ratio of two GGX densities is the square of this; alpha^2 cancels.
    lobe = (1.0 - tilt.n_h * tilt.n_h * narrow) / wp.max(1.0 - m_h * m_h * narrow, 1.0e-4)
    # Bounded: several lamps have no single direction, and isolated bumps would sparkle.
    diffuse = 1.0 + tilt.lamps * (wp.min(after / tilt.before, 3.0) - 1.0)
    return wp.vec2(diffuse, 1.0 + tilt.shine * (wp.min(lobe * lobe, 8.0) - 1.0))


@wp.func
def quad_tilt(lattice: Lattice, lights: wp.array[LatticeLight], q: int, quad: Quad):
    """The tilt of a whole cell, from the mean of its corners."""
    a = lights[q]
    b = lights[q + 1]
    c = lights[q + lattice.width]
    d = lights[q + lattice.width + 1]
    towards = a.towards + b.towards + c.towards + d.towards
    lamps = 0.25 * (a.lamps + b.lamps + c.lamps + d.lamps)
    shine = 0.25 * (a.shine + b.shine + c.shine + d.shine)
    return make_tilt(towards, lamps, shine, quad.normal, quad.to_viewer)


@wp.func
def gathered_radiance(
    view: View,
    world: World,
    images: GBufferRecord,
    lattice: Lattice,
    lights: wp.array[LatticeLight],
    coats: wp.array[wp.vec4],
    cell: Cell,
    i: int,
    d: wp.vec3,
):
    """Radiance of a pixel interpolated from lattice points; negative if that is impossible.

    That is where the surface turns too sharply, or where no point lies on the pixel's surface;
    points on other surfaces are left out.
    """
    hit = images.hits[i]
    surface = surface_index(world, hit)
    p = view.eye_m + d * images.z_m[i]
    texture = world.surfaces[surface].texture
    bumpy = texture >= 0
    if bumpy:
        bumpy = world.textures[texture].has_bumps != 0
    covered = world.ground.covered != 0
    coat = wp.vec4(0.0)
    light = LatticeLight()
    total = float(0.0)
    turns = bool(False)
    if is_gatherable(world, surface):
        for k in range(4):
            q, w = cell_corner(lattice, cell, k)
            if w > 0.0:
                cosine = agreement(view, images, lattice, surface, i, p, q)
                if cosine > 0.0 and cosine <= SMOOTH_COSINE:
                    turns = True
                if cosine > SMOOTH_COSINE:
                    total += w
                    light.diffuse += lights[q].diffuse * w
                    light.rest += lights[q].rest * w
                    if covered:
                        coat += coats[q] * w
                    if bumpy:
                        light.towards += lights[q].towards * w
                        light.lamps += lights[q].lamps * w
                        light.shine += lights[q].shine * w
    if turns or total == 0.0:
        return wp.vec3(-1.0)
    share = 1.0 / total
    albedo = world.surfaces[surface].base_color
    if texture >= 0:
        v = fast_normalize(-d)
        n = images.normals[i]
        width_m = pixel_width(view, i, images.z_m[i])
        material = evaluate_material(world, surface, hit, images.weights[i], n, width_m, v)
        albedo = material.albedo
        if bumpy:
            if covered:
                material.normal = fast_normalize(
                    n + (material.normal - n) * bump_visibility(coat * share)
                )
            tilt = make_tilt(light.towards, light.lamps * share, light.shine * share, n, v)
            factors = bump_factors(tilt, material.roughness, material.normal)
            light.diffuse *= factors[0]
            light.rest *= factors[1]
    if covered:
        albedo = albedo_below_coat(coat * share, albedo)
    return (wp.cw_mul(light.diffuse, albedo) + light.rest) * share


@wp.func
def is_one_face(
    view: View, images: GBufferRecord, face: wp.vec2i, x0: int, x1: int, y0: int, y1: int
):
    """Whether all pixels of a rectangle show one face."""
    same = bool(True)
    y = int(y0)
    while y < y1 and same:
        i = int(y * view.width + x0)
        while i < y * view.width + x1 and same:
            hit = images.hits[i]
            same = hit[0] == face[0] and hit[1] == face[1]
            i += 1
        y += 1
    return same


@wp.func
def quad_sampler(world: World, texture: int, quad: Quad, patch: Patch, footprint_m: float):
    """The texture sampler of a cell whose pixels have the given footprint."""
    # Footprints are ellipses: use the level of the geometric mean of both axes.
    slant = wp.max(wp.dot(quad.normal, quad.to_viewer), 0.05)
    return make_sampler(world, texture, wp.log2(footprint_m * patch.texels_per_m / wp.sqrt(slant)))


@wp.func
def bump_normal(patch: Patch, bump: wp.vec3, covered: bool, coat: wp.vec4):
    """Normal of a patch with the texture's bumps, attenuated by water and snow on them."""
    b = bump
    if covered:
        bumps = bump_visibility(coat)
        b = b * bumps + wp.vec3(0.0, 0.0, 1.0 - bumps)
    m = patch.tangent * b[0] + patch.bitangent * b[1]
    # The floor keeps the normal on the outer side, as in material_eval.tilt_normal.
    return fast_normalize(m + patch.normal * wp.max(b[2], 0.1))


@wp.func
def light_patch(
    view: View,
    world: World,
    images: GBufferRecord,
    lattice: Lattice,
    lights: wp.array[LatticeLight],
    coats: wp.array[wp.vec4],
    quad: Quad,
    patch: Patch,
    column: int,
    row: int,
    radiance: wp.array[wp.vec3],
):
    """Shade a smooth cell all of whose pixels show one face."""
    q = row * lattice.width + column
    x0 = column * lattice.stride
    y0 = row * lattice.stride
    x1 = wp.min(x0 + lattice.stride, view.width)
    y1 = wp.min(y0 + lattice.stride, view.height)
    right_step = step_at(lattice, x0, view.width)
    surface = lattice.surface[q]
    texture = world.surfaces[surface].texture
    albedo = world.surfaces[surface].base_color
    roughness = world.surfaces[surface].roughness
    sampler = Sampler()
    tilt = Tilt()
    if texture >= 0:
        width_m = pixel_width(view, lattice.pixel[q], images.z_m[lattice.pixel[q]])
        sampler = quad_sampler(world, texture, quad, patch, width_m)
        if world.textures[texture].has_bumps != 0:
            tilt = quad_tilt(lattice, lights, q, quad)
    bumpy = tilt.before > 0.0
    covered = world.ground.covered != 0
    coat, coat_step = wp.vec4(0.0), wp.vec4(0.0)
    below = q + lattice.width
    for y in range(y0, y1):
        down = float(y - y0) * step_at(lattice, y0, view.height)
        up = 1.0 - down
        # Bilinear interpolation by steps: the row's ends once, then one addition per pixel.
        diffuse = lights[q].diffuse * up + lights[below].diffuse * down
        rest = lights[q].rest * up + lights[below].rest * down
        diffuse_step = lights[q + 1].diffuse * up + lights[below + 1].diffuse * down
        rest_step = lights[q + 1].rest * up + lights[below + 1].rest * down
        diffuse_step = (diffuse_step - diffuse) * right_step
        rest_step = (rest_step - rest) * right_step
        if covered:
            coat = coats[q] * up + coats[below] * down
            coat_step = (coats[q + 1] * up + coats[below + 1] * down - coat) * right_step
        x = int(x0)  # While: Warp's range loops cost more than this body.
        while x < x1:
            color = albedo
            lit, shine = diffuse, rest
            if texture >= 0:
                p = pixel_direction(view, float(x) + 0.5, float(y) + 0.5)
                p = p * images.z_m[y * view.width + x]
                u = patch.u + wp.dot(patch.to_u, p)
                v = patch.v + wp.dot(patch.to_v, p)
                texel = texel_at(world, texture, sampler, u, v, bumpy)
                color = wp.cw_mul(albedo, texel.albedo)
                if bumpy:
                    m = bump_normal(patch, texel.bump, covered, coat)
                    factors = bump_factors(tilt, roughness * texel.roughness, m)
                    lit = lit * factors[0]
                    shine = shine * factors[1]
            if covered:
                color = albedo_below_coat(coat, color)
            coat += coat_step
            radiance[y * view.width + x] = wp.cw_mul(lit, color) + shine
            diffuse += diffuse_step
            rest += rest_step
            x += 1


@wp.kernel
def gather_light(
    view: View,
    world: World,
    images: GBufferRecord,
    lattice: Lattice,
    lights: wp.array[LatticeLight],
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
    for column in range(segment * run, wp.min((segment + 1) * run, lattice.width - 1)):
        x0 = column * lattice.stride
        x1 = wp.min(x0 + lattice.stride, view.width)
        quad = quad_at(view, world, images, lattice, row * lattice.width + column)
        # Fast path: the whole cell shows one smooth, flat face.
        whole = quad.smooth != 0
        if whole:
            whole = is_one_face(view, images, quad.face, x0, x1, y0, y1)
        if whole:
            surface = lattice.surface[row * lattice.width + column]
            patch = Patch()
            if world.surfaces[surface].texture >= 0:
                patch = patch_at(world, surface, quad.face, quad.normal)
                whole = patch.flat != 0
            if whole:
                light_patch(
                    view, world, images, lattice, lights, coats, quad, patch, column, row, radiance
                )
        if not whole:
            for y in range(y0, y1):
                x = int(x0)
                while x < x1:
                    i = y * view.width + x
                    d = pixel_direction(view, float(x) + 0.5, float(y) + 0.5)
                    d_world = view.R_world_camera @ d
                    c = wp.vec3(0.0)
                    if images.hits[i][0] >= 0:
                        cell = cell_at(view, lattice, x, y)
                        c = gathered_radiance(
                            view, world, images, lattice, lights, coats, cell, i, d_world
                        )
                    elif world.sky.visible != 0:
                        c = sky_image(world.sky, d_world)
                    # Not interpolable: an atomic counter appends the pixel to the list.
                    if c[0] < 0.0:
                        pixels[wp.atomic_add(count, 0, 1)] = i
                    else:
                        radiance[i] = c
                    x += 1
