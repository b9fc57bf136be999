"""Interpolation of light from the lattice to all pixels.

A cell lies between four lattice points, and its pixels that show one face are a stretch: they share
the lattice points whose light they blend, and a texture's mapping and mip level. A row of a stretch
is shaded at once.
"""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.atmosphere.kernels.ground_weathering import (
    SNOW_BLUE,
    SNOW_GREEN,
    SNOW_RED,
    bump_visibility,
    mixed_snow,
)
from gen_data.generator.renderers.warp.realtime.kernels.lattice import (
    Lattice,
    points_agree,
    step_at,
)
from gen_data.generator.renderers.warp.realtime.kernels.lattice_lighting import (
    LatticeLight,
    is_gatherable,
)
from gen_data.generator.renderers.warp.realtime.kernels.soft_shadows import surface_tolerance
from gen_data.generator.renderers.warp.scene.kernels.environment_lighting import sky_image
from gen_data.generator.renderers.warp.scene.kernels.records import (
    GBufferRecord,
    TextureRecord,
    View,
    World,
    fast_normalize,
    pixel_direction,
    pixel_width,
    surface_index,
)
from gen_data.generator.renderers.warp.scene.kernels.texture_sampling import (
    SAMPLE_QUAD,
    Patch,
    Sampler,
    make_sampler,
    patch_at,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Light of two points may be blended if their normals differ by less than eight degrees.
SMOOTH_COSINE = wp.constant(0.99)


@wp.func
def agreement(
    images: GBufferRecord, lattice: Lattice, surface: int, i: int, p: wp.vec3, tolerance_m: float, q: int
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
        agrees: 1 for each of the cell's corners whose light is blended, 0 for others.
        turns: 1 for each corner from which the surface turns too sharply.
        texture: -1 for none; ``patch`` and ``sampler`` are then unused.
        bumpy: 1 if the texture tilts normals and there is light that depends on them.
        towards: Unit direction towards the lamps.
        half: Half vector between it and the viewer.
        lamps, shine: As in LatticeLight.
    """

    face: wp.vec2i
    first: int
    columns: int
    agrees: wp.vec4
    turns: wp.vec4
    albedo: wp.vec3
    roughness: float
    texture: int
    patch: Patch
    sampler: Sampler
    bumpy: int
    towards: wp.vec3
    half: wp.vec3
    lamps: float
    shine: float


@wp.func
def stretch_at(
    view: View,
    world: World,
    images: GBufferRecord,
    lattice: Lattice,
    lights: wp.array[LatticeLight],
    first: int,
    x: int,
    y: int,
):
    """The stretch of a pixel in the cell to the right of and below a lattice point."""
    i = y * view.width + x
    stretch = Stretch()
    stretch.face = images.hits[i]
    stretch.first = first
    stretch.columns = lattice.width
    surface = surface_index(world, stretch.face)
    d = pixel_direction(view, float(x) + 0.5, float(y) + 0.5)
    p = view.eye_m + view.R_world_camera @ (d * images.z_m[i])
    tolerance_m = surface_tolerance(view, p)
    towards = wp.vec3(0.0)
    lamps = float(0.0)
    shine = float(0.0)
    found = float(0.0)
    for k in range(4):
        q = first + (k & 1) + wp.where(k >= 2, lattice.width, 0)
        cosine = agreement(images, lattice, surface, i, p, tolerance_m, q)
        if cosine > SMOOTH_COSINE:
            stretch.agrees[k] = 1.0
            towards += lights[q].towards
            lamps += lights[q].lamps
            shine += lights[q].shine
            found += 1.0
        elif cosine > 0.0:
            stretch.turns[k] = 1.0
    stretch.albedo = world.surfaces[surface].base_color
    stretch.roughness = world.surfaces[surface].roughness
    stretch.texture = world.surfaces[surface].texture
    if stretch.texture >= 0 and found > 0.0:
        n = images.normals[i]
        v = fast_normalize(view.eye_m - p)
        stretch.patch = patch_at(world, surface, stretch.face, n)
        # Footprints are ellipses: use the level of the geometric mean of both axes.
        slant = wp.max(wp.dot(n, v), 0.05)
        width_m = pixel_width(view, i, images.z_m[i])
        texels = width_m * stretch.patch.texels_per_m / wp.sqrt(slant)
        stretch.sampler = make_sampler(world, stretch.texture, wp.log2(texels))
        if world.textures[stretch.texture].has_bumps != 0 and wp.dot(towards, towards) > 0.0:
            stretch.bumpy = 1
            stretch.towards = fast_normalize(towards)
            stretch.half = fast_normalize(stretch.towards + v)
            stretch.lamps = lamps / found
            stretch.shine = shine / found
    return stretch


@wp.struct
class Weather:
    """Water and snow on the pixels of a row.

    Attributes:
        wet: Factors on albedo.
        snow: Shares of snow, to be added to albedo.
        bumps: Visibility of the surface's own bumps.
    """

    wet: wp.vec4
    snow: wp.vec4
    bumps: wp.vec4


@wp.func
def weather_at(stretch: Stretch, coats: wp.array[wp.vec4], pixels: int, down: float, step: float):
    """Weather of a stretch's pixels, interpolated from lattice points; at most four in a row."""
    weather = Weather()
    up = 1.0 - down
    below = stretch.first + stretch.columns
    agrees = stretch.agrees
    left = coats[stretch.first] * (agrees[0] * up) + coats[below] * (agrees[2] * down)
    right = coats[stretch.first + 1] * (agrees[1] * up) + coats[below + 1] * (agrees[3] * down)
    for k in range(pixels):
        w = float(k) * step
        total = (agrees[0] * up + agrees[2] * down) * (1.0 - w)
        total += (agrees[1] * up + agrees[3] * down) * w
        coat = (left * (1.0 - w) + right * w) / wp.max(total, 1.0e-6)
        weather.snow[k] = mixed_snow(coat)
        weather.wet[k] = coat[0] * wp.max(1.0 - weather.snow[k], 0.0)
        weather.bumps[k] = bump_visibility(coat)
    return weather


_SHADE_ROW = (
    SAMPLE_QUAD
    + """
    // Blended light at the row's ends, and its change over the row; the last one is the sum of
    // weights, and that of corners from which the surface turns.
    const auto& a = lights.data[stretch.first];
    const auto& b = lights.data[stretch.first + 1];
    const auto& c = lights.data[stretch.first + stretch.columns];
    const auto& d = lights.data[stretch.first + stretch.columns + 1];
    const float up = 1.0f - down;
    auto weight = [&](const wp::vec4& corners, int k) { return corners[k] * (k < 2 ? up : down); };
    const float wa = weight(stretch.agrees, 0), wb = weight(stretch.agrees, 1);
    const float wc = weight(stretch.agrees, 2), wd = weight(stretch.agrees, 3);
    float begin[6], change[6];
    for (int k = 0; k < 3; ++k) {
        begin[k] = a.diffuse[k] * wa + c.diffuse[k] * wc;
        change[k] = b.diffuse[k] * wb + d.diffuse[k] * wd - begin[k];
        begin[3 + k] = a.rest[k] * wa + c.rest[k] * wc;
        change[3 + k] = b.rest[k] * wb + d.rest[k] * wd - begin[3 + k];
    }
    const float turn = weight(stretch.turns, 0) + weight(stretch.turns, 2);
    const float turn_change = weight(stretch.turns, 1) + weight(stretch.turns, 3) - turn;

    int done = 0;
    for (int x = x0; x < x1; x += QUAD) {
        const int row = y * view.width + x;
        int mine = 0;
        for (int k = 0; k < QUAD; ++k) {
            if (x + k < x1 && images.hits.data[row + k] == stretch.face)
                mine |= 1 << k;
        }
        if (!mine)
            continue;
        // Other lanes repeat a pixel of the stretch, so that all their values are defined.
        const int stand_in = row + first_bit(mine);
        int at[QUAD];
        for (int k = 0; k < QUAD; ++k)
            at[k] = mine >> k & 1 ? row + k : stand_in;

        const Floats part = (floats(LANE) + (float)(x - x0)) * step;
        const Floats total = (wa + wc) + (wb + wd - (wa + wc)) * part;
        const Floats turned = turn + turn_change * part;
        Floats color[3], diffuse = one, shine = one;
        for (int k = 0; k < 3; ++k)
            color[k] = stretch.albedo[k];
        if (stretch.texture >= 0) {
            const auto& texture = textures.data[stretch.texture];
            const auto& patch = stretch.patch;
            Floats p[3], n[3], z;
            for (int k = 0; k < QUAD; ++k) {
                put(z, k, images.z_m.data[at[k]]);
                for (int c = 0; c < 3; ++c)
                    put(n[c], k, images.normals.data[at[k]][c]);
            }
            if (view.lens == 0) {
                p[0] = (floats(LANE) + ((float)x + 0.5f - view.cx)) * view.inverse_fx * z;
                p[1] = ((float)y + 0.5f - view.cy) * view.inverse_fy * z;
                p[2] = z;
            } else {
                for (int k = 0; k < QUAD; ++k)
                    for (int c = 0; c < 3; ++c)
                        put(p[c], k, view.directions.data[at[k]][c]);
                for (int c = 0; c < 3; ++c)
                    p[c] = p[c] * z;
            }
            Floats at_texture[3];
            for (int k = 0; k < 3; ++k) {
                const auto& g = patch.gradients.data[k];
                at_texture[k] = patch.start[k] + (p[0] * g[0] + p[1] * g[1] + p[2] * g[2]);
            }
            // Weights of projections: eighth powers blend them in a narrow band only.
            Floats shares[3] = {zero, zero, one};
            if (patch.triplanar) {
                for (int k = 0; k < 3; ++k) {
                    const auto& m = patch.axes.data;
                    Floats w = n[0] * m[0][k] + n[1] * m[1][k] + n[2] * m[2][k];
                    w = w * w;
                    w = w * w;
                    shares[k] = w * w;
                }
                const Floats sum = 1.0f / (shares[0] + shares[1] + shares[2]);
                for (int k = 0; k < 3; ++k)
                    shares[k] = shares[k] * sum;
            }
            const bool bumpy = stretch.bumpy != 0;
            Floats albedo[3] = {zero, zero, zero}, rough = zero, m[3] = {zero, zero, zero};
            for (int axis = 0; axis < 3; ++axis) {
                // A weight below one step of 8 bits is not worth a texture lookup.
                if (!any(shares[axis] > 0.004f))
                    continue;
                const int along_u = axis == 0 ? 1 : 0, along_v = axis == 2 ? 1 : 2;
                const Floats share = shares[axis];
                const Sample s = sample(
                    texture, stretch.sampler, at_texture[along_u], at_texture[along_v], bumpy);
                for (int k = 0; k < 3; ++k)
                    albedo[k] += s.albedo[k] * share;
                rough += s.roughness * share;
                if (bumpy) {
                    Floats bump[3] = {s.bump[0], s.bump[1], s.bump[2]};
                    if (covered) {
                        Floats seen;
                        for (int k = 0; k < QUAD; ++k)
                            put(seen, k, weather.bumps[(x - x0 + k) & 3]);
                        for (int k = 0; k < 3; ++k)
                            bump[k] = bump[k] * seen;
                        bump[2] += 1.0f - seen;
                    }
                    // A texture tilts a normal by at most 84 degrees: no side of it may face away.
                    const Floats height = larger(bump[2], 0.1f);
                    for (int k = 0; k < 3; ++k) {
                        const auto& axes = patch.axes.data[k];
                        const Floats tilted =
                            bump[0] * axes[along_u] + bump[1] * axes[along_v] + n[k] * height;
                        m[k] += tilted * share;
                    }
                }
            }
            for (int k = 0; k < 3; ++k)
                color[k] = color[k] * albedo[k];
            if (bumpy) {
                auto dot = [](const Floats* u, const wp::vec3& v) {
                    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
                };
                const Floats inverse =
                    1.0f / root(larger(m[0] * m[0] + m[1] * m[1] + m[2] * m[2], 1.0e-30f));
                const Floats after = larger(dot(m, stretch.towards) * inverse, 0.0f);
                // The ratio of cosines diverges at grazing light.
                const Floats before = larger(dot(n, stretch.towards), 0.1f);
                const Floats m_h = dot(m, stretch.half) * inverse, n_h = dot(n, stretch.half);
                const Floats roughness = rough * stretch.roughness;
                const Floats alpha = roughness * roughness;
                const Floats narrow = 1.0f - alpha * alpha;
                // The ratio of two GGX densities is the square of this; alpha^2 cancels.
                const Floats lobe =
                    (1.0f - n_h * n_h * narrow) / larger(1.0f - m_h * m_h * narrow, 1.0e-4f);
                // Bounded: several lamps have no single direction, and isolated bumps would sparkle.
                diffuse = 1.0f + (smaller(after / before, 3.0f) - 1.0f) * stretch.lamps;
                shine = 1.0f + (smaller(lobe * lobe, 8.0f) - 1.0f) * stretch.shine;
            }
        }
        if (covered) {
            Floats wet, snow;
            for (int k = 0; k < QUAD; ++k) {
                put(wet, k, weather.wet[(x - x0 + k) & 3]);
                put(snow, k, weather.snow[(x - x0 + k) & 3]);
            }
            for (int k = 0; k < 3; ++k)
                color[k] = color[k] * wet + snow * white[k];
        }
        const Floats inverse = 1.0f / larger(total, 1.0e-6f);
        Floats light[3];
        for (int k = 0; k < 3; ++k) {
            const Floats lit = (begin[k] + change[k] * part) * diffuse;
            light[k] = (lit * color[k] + (begin[3 + k] + change[3 + k] * part) * shine) * inverse;
        }
        for (int k = 0; k < QUAD; ++k) {
            if (!(mine >> k & 1))
                continue;
            const int bit = 1 << (x - x0 + k);
            done |= bit;
            if (get(total, k) > 0.0f && !(get(turned, k) > 0.0f))
                radiance.data[row + k] = wp::vec3(get(light[0], k), get(light[1], k), get(light[2], k));
            else
                done |= bit << 8;
        }
    }
    return done;
"""
)


@wp.func_native(_SHADE_ROW)
def shade_row(
    view: View,
    images: GBufferRecord,
    textures: wp.array[TextureRecord],
    lights: wp.array[LatticeLight],
    stretch: Stretch,
    covered: bool,
    weather: Weather,
    white: wp.vec3,
    x0: int,
    x1: int,
    y: int,
    down: float,
    step: float,
    radiance: wp.array[wp.vec3],
) -> int:
    """Shade the pixels of a stretch in one row of its cell.

    Args:
        white: Albedo of snow.
        x0, x1: The cell's pixels.
        down: Fraction of the row towards the lower lattice points, [0, 1).
        step: Width of a pixel in units of its cell.

    Returns:
        Bits of the pixels of the stretch, from x0 on; 256 times those that cannot be interpolated,
        because the surface turns too sharply or no lattice point lies on it.
    """
    ...


@wp.func
def shade_stretch(
    view: View,
    world: World,
    images: GBufferRecord,
    lattice: Lattice,
    lights: wp.array[LatticeLight],
    coats: wp.array[wp.vec4],
    stretch: Stretch,
    x0: int,
    y0: int,
    y: int,
    count: wp.array[int],
    pixels: wp.array[int],
    radiance: wp.array[wp.vec3],
):
    """Shade a stretch from its row y on; bits of its pixels, those of each row above the last's."""
    x1 = wp.min(x0 + lattice.stride, view.width)
    y1 = wp.min(y0 + lattice.stride, view.height)
    covered = world.ground.covered != 0
    step = step_at(lattice, x0, view.width)
    weather = Weather()
    bits = int(0)
    while y < y1:
        down = float(y - y0) * step_at(lattice, y0, view.height)
        if covered:
            weather = weather_at(stretch, coats, x1 - x0, down, step)
        row = shade_row(
            view,
            images,
            world.textures,
            lights,
            stretch,
            covered,
            weather,
            wp.vec3(SNOW_RED, SNOW_GREEN, SNOW_BLUE),
            x0,
            x1,
            y,
            down,
            step,
            radiance,
        )
        bits |= (row & 255) << (8 * (y - y0))
        row = row >> 8
        x = int(x0)
        while row != 0:
            if (row & 1) != 0:
                pixels[wp.atomic_add(count, 0, 1)] = y * view.width + x
            row = row >> 1
            x += 1
        y += 1
    return bits


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
        done = int(0)
        for y in range(y0, y1):
            x = int(x0)
            while x < x1:
                i = y * view.width + x
                if ((done >> (8 * (y - y0) + x - x0)) & 1) == 0:
                    hit = images.hits[i]
                    if hit[0] < 0:
                        c = wp.vec3(0.0)
                        if world.sky.visible != 0:
                            d = pixel_direction(view, float(x) + 0.5, float(y) + 0.5)
                            c = sky_image(world.sky, view.R_world_camera @ d)
                        radiance[i] = c
                    elif is_gatherable(world, surface_index(world, hit)):
                        first = row * lattice.width + column
                        stretch = stretch_at(view, world, images, lattice, lights, first, x, y)
                        done |= shade_stretch(
                            view,
                            world,
                            images,
                            lattice,
                            lights,
                            coats,
                            stretch,
                            x0,
                            y0,
                            y,
                            count,
                            pixels,
                            radiance,
                        )
                    else:
                        # An atomic counter appends the pixel to the list.
                        pixels[wp.atomic_add(count, 0, 1)] = i
                x += 1
