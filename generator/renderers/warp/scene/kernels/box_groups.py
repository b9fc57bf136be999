"""Tests of eight boxes at once: a flat array of groups, each with low x, high x, low y, ... [6, 8].

Boxes keep their order; the last group is filled with boxes that nothing touches.
"""

import warp as wp

from gen_data.renderers.warp.native_code import native

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Coordinate of the boxes that fill the last group [m].
NOWHERE_M = 1.0e9


@wp.func
def low_corner(boxes: wp.array[wp.float32], k: int):
    """Low corner of box k."""
    first = 48 * (k / 8) + k % 8
    return wp.vec3(boxes[first], boxes[first + 16], boxes[first + 32])


@wp.func
def high_corner(boxes: wp.array[wp.float32], k: int):
    """High corner of box k."""
    first = 48 * (k / 8) + k % 8 + 8
    return wp.vec3(boxes[first], boxes[first + 16], boxes[first + 32])


@wp.func_native(native("scene/kernels/next_in_shaft.h"))
def next_in_shaft(
    boxes: wp.array[wp.float32],
    start: wp.vec3,
    inverse: wp.vec3,
    radius: float,
    end_radius: float,
    after: int,
) -> int:
    """The first box behind number ``after`` that a cone frustum may touch; -1 if there is none.

    Args:
        start, inverse: Start of its axis and ``reciprocals`` of the way to its end.
        radius, end_radius: Its radii at both ends.
    """
    ...
