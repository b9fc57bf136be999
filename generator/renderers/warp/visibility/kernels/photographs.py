"""Photographs behind rendered objects, at pixel centres."""

from typing import Any

import warp as wp

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Content of a pixel's centre, by the number of its body plus one.
EMPTY = wp.constant(0)
GROUND = wp.constant(1)
THING = wp.constant(2)
# Content of the photograph there.
BACKGROUND = wp.constant(0)
STANDING_GROUND = wp.constant(1)
FOREGROUND = wp.constant(2)


@wp.kernel
def show_photo(
    hits: wp.array[wp.vec2i],
    kinds: wp.array[int],
    first: int,
    photo: wp.array[wp.vec3],
    unshaded: wp.array[wp.vec3],
    darkest: float,
    ratio_max: float,
    radiance: wp.array[wp.vec3],
):
    """Replace background and ground by the photograph.

    Args:
        hits: (body, face) of the pixels.
        kinds: EMPTY, GROUND or THING, by body plus one.
        first: Pixel of the photograph that the first one of these shows.
        photo: Radiance of the photograph.
        unshaded: Radiance of the ground without objects.
        darkest: Radiance without objects below which the ground has no ratio.
        ratio_max: Largest ratio.
        radiance: Radiance of the pixels, changed in place.
    """
    i = wp.tid()
    kind = kinds[hits[i][0] + 1]
    if kind == EMPTY:
        radiance[i] = photo[first + i]
    elif kind == GROUND:
        lit = radiance[i]
        bare = unshaded[first + i]
        ratio = wp.vec3(1.0)
        for c in range(3):
            if bare[c] > darkest:
                ratio[c] = wp.min(lit[c] / bare[c], ratio_max)
        radiance[i] = wp.cw_mul(photo[first + i], ratio)


@wp.kernel
def restore_photo(
    hits: wp.array[wp.vec2i],
    kinds: wp.array[int],
    width: int,
    height: int,
    centres: wp.array[wp.vec3],
    radiance: wp.array[wp.vec3],
):
    """Take the radiance of pixel centres where none of the nine pixels around shows an object."""
    y, x = wp.tid()
    if radiance[y * width + x] == centres[y * width + x]:
        return
    near = int(0)
    for row in range(wp.max(y - 1, 0), wp.min(y + 2, height)):
        for column in range(wp.max(x - 1, 0), wp.min(x + 2, width)):
            if kinds[hits[row * width + column][0] + 1] == THING:
                near = 1
    if near == 0:
        radiance[y * width + x] = centres[y * width + x]


@wp.kernel
def cover_by_foreground(
    first: int, mask: wp.array[float], photo: wp.array[wp.vec3], radiance: wp.array[wp.vec3]
):
    """Mix in the photograph by the share of its foreground."""
    i = wp.tid()
    share = mask[first + i]
    radiance[i] = radiance[i] * (1.0 - share) + photo[first + i] * share


@wp.kernel
def hide_labels(
    hits: wp.array[wp.vec2i],
    kinds: wp.array[int],
    first: int,
    shown: wp.array[wp.uint8],
    nothing: Any,
    image: wp.array(dtype=Any),
):
    """Write nothing at the foreground, or where there is neither an object nor ground to stand on.

    Args:
        shown: BACKGROUND, STANDING_GROUND or FOREGROUND, by pixel of the photograph.
    """
    i = wp.tid()
    place = int(shown[first + i])
    thing = kinds[hits[i][0] + 1] == THING
    if place == FOREGROUND or (place == BACKGROUND and not thing):
        image[i] = nothing


# All types of label images: the module is compiled once, and not again for each further type.
for _dtype in (wp.uint16, float, wp.vec3):
    wp.overload(hide_labels, {"nothing": _dtype, "image": wp.array(dtype=_dtype)})
