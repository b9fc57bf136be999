"""Multisampling of edge pixels by the rasteriser (CPU device only).

Triangles are drawn again into samples of the pixels that edges cross; colour is taken from nearby
pixel centres that show the same surface, as in
gen_data.renderers.warp.visibility.kernels.edge_antialiasing.
"""

import warp as wp

from gen_data.renderers.warp.native_code import native
from gen_data.renderers.warp.scene.kernels.records import (
    GBufferRecord,
    View,
    World,
    face_vertices,
    flat_normal,
    pixel_direction,
    pixel_ray,
    pixel_width,
    surface_index,
    vertex_at,
)
from gen_data.renderers.warp.visibility.kernels import edge_detection, label_resolve, rasterizer
from gen_data.renderers.warp.visibility.kernels.alpha_cutouts import Cutout, make_cutout

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Larger than the nearness of any surface.
UNLISTED = wp.constant(1.0e30)
# Half a pixel [1/256 px].
HALF = wp.constant(128)
# Distance of parallel surfaces that count as one, in widths of a pixel.
PLANE_PX = wp.constant(2.0)


@wp.func_native(native("visibility/kernels/farthest_nearby.h"))
def farthest_nearby(view: View, images: GBufferRecord, x: int, y: int) -> float:
    """The largest depth of the nine pixels around (x, y) [m]."""
    ...


@wp.kernel
def number_pixels(
    view: View,
    images: GBufferRecord,
    pixels: wp.array[int],
    numbers: wp.array[int],
    floors: wp.array[float],
):
    """Position in the list of every listed pixel, and the least nearness that matters there.

    A surface behind all surfaces of the surrounding centres finds no colour.

    Args:
        floors: 1/z [1/m]; must be UNLISTED on entry.
    """
    k = wp.tid()
    i = pixels[k]
    numbers[i] = k
    # Two percent of slack: a surface's depth changes within a pixel.
    floors[i] = 0.98 / farthest_nearby(view, images, i % view.width, i / view.width)


@wp.func_native(native("visibility/kernels/draw_face_samples.h"))
def draw_face_samples(
    world: World,
    edges: rasterizer.Edges,
    plane: rasterizer.DepthPlane,
    cutout: Cutout,
    body: int,
    face: int,
    stride: int,
    numbers: wp.array[int],
    floors: wp.array[float],
    offsets: wp.array2d[int],
    nearness: wp.array2d[float],
    hits: wp.array2d[wp.vec2i],
):
    """Write (body, face) into the samples of numbered pixels where a triangle is nearest.

    Args:
        edges: Over all pixels in which the triangle may cover a sample.
    """
    ...


@wp.kernel
def draw_samples(
    view: View,
    window: rasterizer.Window,
    world: World,
    bodies: wp.array[rasterizer.DrawnBody],
    p_camera: wp.array[wp.vec3],
    xy: wp.array[wp.vec2i],
    numbers: wp.array[int],
    floors: wp.array[float],
    offsets: wp.array2d[int],
    nearness: wp.array2d[float],
    hits: wp.array2d[wp.vec2i],
):
    """Z-buffer of listed bodies over samples of numbered pixels, as draw_bodies over centres.

    Args:
        numbers: Row of each pixel in the outputs.
        floors: Nearness below which a pixel takes nothing; UNLISTED for unlisted pixels. It is
            LANES longer than the image. Raised where all samples of a pixel are nearer.
        offsets: x and y of sample positions, from the middle of a pixel [1/256 px], [2, samples];
            a multiple of four, at most eight.
        nearness: 1/z [1/m]; must be 0 on entry.
        hits: Unchanged where nothing is hit.
    """
    drawn = bodies[wp.tid()]
    stride = window.width
    whole = rasterizer.window_in_image(drawn.window, window)
    if rasterizer.is_hidden(whole, drawn.nearness_max, stride, floors):
        return
    b = drawn.body
    geometry = world.geometries[world.bodies[b].geometry]
    first = world.bodies[b].first_vertex
    for f in range(geometry.face_slots.shape[0]):
        i = first + geometry.faces[3 * f]
        j = first + geometry.faces[3 * f + 1]
        k = first + geometry.faces[3 * f + 2]
        if (
            xy[i][0] != rasterizer.UNSNAPPED
            and xy[j][0] != rasterizer.UNSNAPPED
            and xy[k][0] != rasterizer.UNSNAPPED
        ):
            box = rasterizer.pixel_box(xy[i], xy[j], xy[k], window, HALF)
            if not rasterizer.is_empty(box):
                nearest = rasterizer.largest_nearness(p_camera[i], p_camera[j], p_camera[k])
                if not rasterizer.is_hidden(box, nearest, stride, floors):
                    e = rasterizer.make_edges(xy[i], xy[j], xy[k], window, box)
                    if e.covers != 0:
                        plane = rasterizer.depth_plane(
                            view, p_camera[i], p_camera[j], p_camera[k], window
                        )
                        cutout = make_cutout(view, world, b, f)
                        draw_face_samples(
                            world, e, plane, cutout, b, f, stride, numbers, floors, offsets,
                            nearness, hits,
                        )  # fmt: skip
        elif not rasterizer.is_beyond_guard(view, p_camera[i], p_camera[j], p_camera[k]):
            polygon, corners = rasterizer.clip(view, p_camera[i], p_camera[j], p_camera[k])
            plane = rasterizer.depth_plane(view, p_camera[i], p_camera[j], p_camera[k], window)
            plane.high = 1.0 / rasterizer.Z_NEAR_M
            cutout = make_cutout(view, world, b, f)
            for t in range(1, corners - 1):
                e = rasterizer.fan_edges(view, polygon, t, window, HALF)
                if e.covers != 0:
                    draw_face_samples(
                        world, e, plane, cutout, b, f, stride, numbers, floors, offsets,
                        nearness, hits,
                    )  # fmt: skip


@wp.func_native(native("visibility/kernels/pixel_showing.h"))
def pixel_showing(view: View, images: GBufferRecord, x: int, y: int, hit: wp.vec2i) -> wp.vec2i:
    """The first of the nine pixels around (x, y) that shows a (body, face).

    Returns:
        It and 0; else the first that shows the body, -1 for none, and the number of those.
    """
    ...


@wp.func
def color_source(view: View, world: World, images: GBufferRecord, x: int, y: int, hit: wp.vec2i):
    """The pixel around (x, y) that provides the colour of a sample; -1 if none shows its body."""
    found = pixel_showing(view, images, x, y, hit)
    source = found[0]
    if found[1] > 1:
        # Several faces of the body are near, none of them the sample's: choose by orientation.
        source = edge_detection.most_similar_normal(
            view, images, x, y, source, flat_normal(world, hit)
        )
    return source


@wp.func
def shows_like(view: View, world: World, images: GBufferRecord, source: int, hit: wp.vec2i):
    """Whether a pixel's colour suits a (body, face): it shows that, or a like continuation of it.

    A like continuation has the same material and orientation and lies in the same plane: the front
    of a door does not replace the frame in the gap next to it.
    """
    alike = bool(False)
    if source >= 0:
        shown = images.hits[source]
        alike = shown[0] == hit[0] and shown[1] == hit[1]
        if not alike and shown[0] == hit[0]:
            n = flat_normal(world, hit)
            if (
                surface_index(world, shown) == surface_index(world, hit)
                and wp.abs(wp.dot(images.normals[source], n)) > edge_detection.CREASE_COSINE
            ):
                b = hit[0]
                g = world.bodies[b].geometry
                corner = vertex_at(world, g, face_vertices(world, g, hit[1])[0])
                corner = world.bodies[b].R_world_mesh @ (corner * world.bodies[b].scale)
                z = images.z_m[source]
                point = view.eye_m + pixel_ray(view, source) * z - world.bodies[b].t_world_mesh
                apart_m = wp.abs(wp.dot(n, point - corner))
                alike = apart_m < PLANE_PX * pixel_width(view, source, z)
    return alike


@wp.func
def thin_layer(world: World, thin: wp.array2d[wp.vec2i], layers: int, i: int, hit: wp.vec2i):
    """The first of the layers of thin surfaces whose colour suits a (body, face); -1 for none."""
    found = int(-1)
    for layer in range(layers):
        at = thin[layer, i]
        if found < 0 and at[0] == hit[0]:
            alike = at[1] == hit[1]
            if not alike:
                cosine = wp.dot(flat_normal(world, at), flat_normal(world, hit))
                alike = wp.abs(cosine) > edge_detection.CREASE_COSINE
            if alike:
                found = layer
    return found


@wp.kernel
def find_thin(
    view: View,
    world: World,
    images: GBufferRecord,
    pixels: wp.array[int],
    hits: wp.array2d[wp.vec2i],
    offsets: wp.array[wp.vec2],
    layer: int,
    layers: wp.array2d[wp.vec2i],
    thin: GBufferRecord,
    count: wp.array[int],
    listed: wp.array[int],
):
    """Find a further surface in each listed pixel whose colour no centre nearby can provide.

    Args:
        pixels: The pixels.
        hits: Their samples, which repeat the samples of ``offsets``.
        offsets: Sample positions within a pixel, [0, 1).
        layer: Number of surfaces found before, at most.
        layers: The (body, face) of all layers; (-1, -1) if there is none in ``layer``.
        thin: The surfaces of this layer; written where there is one.
        count: Number of pixels with such a surface; 0 at first.
        listed: The pixels, in any order.
    """
    row = wp.tid()
    i = pixels[row]
    x = i % view.width
    y = i / view.width
    layers[layer, i] = wp.vec2i(-1, -1)
    if layer > 0:
        # The layer before is the last: there is nothing more to be found.
        if layers[layer - 1, i][0] < 0:
            return
    last = wp.vec2i(-2, -2)
    for s in range(hits.shape[1]):
        hit = hits[row, s]
        if layers[layer, i][0] < 0 and hit[0] >= 0 and (hit[0] != last[0] or hit[1] != last[1]):
            last = hit
            if thin_layer(world, layers, layer, i, hit) < 0:
                source = color_source(view, world, images, x, y, hit)
                if not shows_like(view, world, images, source, hit):
                    offset = offsets[s % offsets.shape[0]]
                    x_px = float(x) + offset[0]
                    y_px = float(y) + offset[1]
                    point = label_resolve.point_at(view, world, hit, x_px, y_px)
                    d = view.R_world_camera @ pixel_direction(view, x_px, y_px)
                    thin.hits[i] = hit
                    thin.z_m[i] = wp.dot(point.way, d) / wp.dot(d, d)
                    thin.weights[i] = point.weight
                    thin.normals[i] = point.normal
                    layers[layer, i] = hit
                    listed[wp.atomic_add(count, 0, 1)] = i


@wp.kernel
def mix_samples(
    view: View,
    world: World,
    images: GBufferRecord,
    radiance: wp.array[wp.vec3],
    pixels: wp.array[int],
    hits: wp.array2d[wp.vec2i],
    thin: wp.array2d[wp.vec2i],
    thin_radiance: wp.array2d[wp.vec3],
    white: float,
    brightest: float,
    mixed: wp.array[wp.vec3],
):
    """Radiance of listed pixels: the mean over their samples, in the order of the list.

    Args:
        thin: Layers of surfaces by ``find_thin``; none if surfaces shown by no centre are omitted.
        thin_radiance: Radiance of these surfaces.
        white: Radiance that saturates one exposure; 0 = the mean is one of radiance.
        brightest: Radiance that saturates all exposures.
    """
    row = wp.tid()
    i = pixels[row]
    x = i % view.width
    y = i / view.width
    total = wp.vec3(0.0)
    lit = int(0)
    last = wp.vec2i(-2, -2)
    source = int(-1)
    layer = int(-1)
    for s in range(hits.shape[1]):
        hit = hits[row, s]
        if hit[0] != last[0] or hit[1] != last[1]:
            source = color_source(view, world, images, x, y, hit)
            last = hit
            layer = -1
            # The sky is never thin.
            if thin.shape[0] > 0 and hit[0] >= 0:
                if not shows_like(view, world, images, source, hit):
                    layer = thin_layer(world, thin, thin.shape[0], i, hit)
        if layer >= 0:
            total += edge_detection.to_tone(thin_radiance[layer, i], white, brightest)
            lit += 1
        elif source >= 0:
            total += edge_detection.to_tone(radiance[source], white, brightest)
            lit += 1
    mixed[row] = radiance[i]
    if lit > 0:
        mixed[row] = edge_detection.from_tone(total * (1.0 / float(lit)), white)
