"""Detection of edges between surfaces, and of similar pixels beside them.

Source: Chajdas, McGuire and Luebke, "Subpixel reconstruction antialiasing", I3D 2011.
"""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.scene.kernels.records import (
    GBufferRecord,
    View,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

# Faces that meet at less than 25 degrees count as one surface.
CREASE_COSINE = wp.constant(0.9)
# Positions in a 3 x 3 block, row by row, as hexadecimal digits from the last: centre, sides,
# corners.
ORDER = wp.constant(wp.int64(0x862075314))


@wp.func
def clamped_pixel(view: View, x: int, y: int):
    """Index of the image's pixel nearest to (x, y)."""
    return wp.clamp(y, 0, view.height - 1) * view.width + wp.clamp(x, 0, view.width - 1)


@wp.func
def is_edge_between(images: GBufferRecord, i: int, j: int):
    """Whether an edge runs between two neighbouring pixels."""
    a = images.hits[i]
    b = images.hits[j]
    edge = bool(False)
    if a[0] != b[0]:
        edge = True
    elif a[1] != b[1]:
        edge = wp.dot(images.normals[i], images.normals[j]) < CREASE_COSINE
        # Self-occlusion: depths that a continuous surface would not have.
        nearer = wp.min(images.z_m[i], images.z_m[j])
        # Floors seen at more than two degrees change less between rows (640 x 480, 60 degrees).
        if wp.abs(images.z_m[i] - images.z_m[j]) > 0.05 * nearer:
            edge = True
    return edge


@wp.kernel
def find_edges(view: View, images: GBufferRecord, count: wp.array[int], pixels: wp.array[int]):
    """List the pixels that an edge may cross.

    Args:
        count: Length of the list; 0 at first.
        pixels: The list, in any order.
    """
    y = wp.tid()
    left = bool(False)
    for x in range(view.width):
        i = y * view.width + x
        right = is_edge_between(images, i, clamped_pixel(view, x + 1, y))
        if (
            left
            or right
            or is_edge_between(images, i, clamped_pixel(view, x, y + 1))
            or is_edge_between(images, i, clamped_pixel(view, x, y - 1))
        ):
            pixels[wp.atomic_add(count, 0, 1)] = i
        left = right


@wp.func
def neighbour_pixel(view: View, x: int, y: int, k: int):
    """The k-th pixel of the 3 x 3 block around (x, y): itself, then sides, then corners."""
    # Four bits per position: a shift replaces a table.
    m = int((ORDER >> wp.int64(4 * k)) & wp.int64(15))
    return clamped_pixel(view, x + m % 3 - 1, y + m / 3 - 1)


@wp.func
def most_similar_normal(
    view: View, images: GBufferRecord, x: int, y: int, source: int, normal: wp.vec3
):
    """The pixel around (x, y) on the body of ``source`` with the most similar normal."""
    best = float(-1.0)
    found = source
    for k in range(9):
        j = neighbour_pixel(view, x, y, k)
        if images.hits[j][0] == images.hits[source][0]:
            cosine = wp.abs(wp.dot(images.normals[j], normal))
            # A margin keeps the nearer pixel among nearly equal normals: rounding noise causes no
            # flicker.
            if cosine > best + 0.05:
                best = cosine
                found = j
    return found


@wp.kernel
def write_mixed(pixels: wp.array[int], mixed: wp.array[wp.vec3], radiance: wp.array[wp.vec3]):
    """Write the mixed radiance of listed pixels into the image."""
    row = wp.tid()
    radiance[pixels[row]] = mixed[row]
