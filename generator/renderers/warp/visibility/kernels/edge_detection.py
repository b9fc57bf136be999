"""Detection of edges between surfaces, and of similar pixels next to them.

Source: Chajdas, McGuire and Luebke, "Subpixel reconstruction antialiasing", I3D 2011.
"""

import warp as wp

from gen_data.renderers.warp.native_code import native
from gen_data.renderers.warp.scene.kernels.records import GBufferRecord, View

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Faces that meet at less than 25 degrees count as one surface.
CREASE_COSINE = wp.constant(0.9)
# Share of white below which tones are proportional to radiance.
DARK = wp.constant(0.05)
# Pixels that are tested together.
GROUP_PX = wp.constant(8)
# Positions in a 3 x 3 block, row by row, as hexadecimal digits from the last: centre, sides,
# corners.
ORDER = wp.constant(wp.int64(0x862075314))


@wp.func
def clamped_pixel(view: View, x: int, y: int):
    """Index of the image's pixel nearest to (x, y)."""
    return wp.clamp(y, 0, view.height - 1) * view.width + wp.clamp(x, 0, view.width - 1)


@wp.func_native(native("visibility/kernels/edges_along.h"))
def edges_along(images: GBufferRecord, i: int, step: int, n: int, crease_cosine: float) -> int:
    """Whether an edge runs between each of ``n`` pixels from i and the pixel ``step`` further.

    Returns:
        One bit per pixel, the first lowest.
    """
    ...


@wp.kernel
def find_edges(
    view: View, images: GBufferRecord, run: int, count: wp.array[int], pixels: wp.array[int]
):
    """List the pixels that an edge may cross.

    Args:
        run: Pixels of a row for one thread.
        count: Length of the list; 0 at first.
        pixels: The list, in any order.
    """
    y, part = wp.tid()
    width = view.width
    x = int(part * run)
    end = wp.min(x + run, width)
    left = int(0)
    if x > 0:
        left = edges_along(images, y * width + x - 1, 1, 1, CREASE_COSINE)
    while x < end:
        i = y * width + x
        n = wp.min(GROUP_PX, end - x)
        right = edges_along(images, i, 1, wp.min(n, width - 1 - x), CREASE_COSINE)
        crossed = right | (right << 1) | left
        if y > 0:
            crossed |= edges_along(images, i, -width, n, CREASE_COSINE)
        if y + 1 < view.height:
            crossed |= edges_along(images, i, width, n, CREASE_COSINE)
        left = right >> (GROUP_PX - 1)
        if crossed != 0:
            for k in range(n):
                if (crossed >> k) & 1:
                    pixels[wp.atomic_add(count, 0, 1)] = i + k
        x += GROUP_PX


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


@wp.func
def to_tone(radiance: wp.vec3, white: float, brightest: float):
    """Value of which a pixel is the mean over its samples; radiance if ``white`` is 0.

    A pixel of an image reduced from a larger one is the mean of tones: they saturate, and below
    that they are nearly logarithms (as the mu-law of gen_data.sensors.camera.isp).
    """
    tone = radiance
    if white > 0.0:
        for k in range(3):
            level = wp.clamp(radiance[k], 0.0, brightest)
            tone[k] = wp.log(level + DARK * white)
    return tone


@wp.func
def from_tone(tone: wp.vec3, white: float):
    """Radiance of a value by ``to_tone``."""
    radiance = tone
    if white > 0.0:
        for k in range(3):
            radiance[k] = wp.max(wp.exp(tone[k]) - DARK * white, 0.0)
    return radiance


@wp.kernel
def write_mixed(pixels: wp.array[int], mixed: wp.array[wp.vec3], radiance: wp.array[wp.vec3]):
    """Write the mixed radiance of listed pixels into the image."""
    row = wp.tid()
    radiance[pixels[row]] = mixed[row]
