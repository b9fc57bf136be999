"""Tests of eight boxes at once: a flat array of groups, each with low x, high x, low y, ... [6, 8].

Boxes keep their order; the last group is filled with boxes that nothing touches.
"""

from __future__ import annotations

import warp as wp

from gen_data.renderers.warp.scene.kernels.simd import SIMD

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


_NEXT_IN_SHAFT = (
    SIMD
    + """
    const int count = boxes.shape[0] / 6;
    for (int b = after + 1; b < count; b += LANES - b % LANES) {
        const float* group = boxes.data + 48 * (b / 8) + (LANES == 8 ? 0 : b % 8);
        // Parameters between which the axis is inside of the boxes, enlarged by a radius.
        auto overlap = [&](Floats grown, Floats& enters, Floats& leaves) {
            enters = 0.0f;
            leaves = 1.0f;
            for (int k = 0; k < 3; ++k) {
                const Floats from = load(group + 16 * k, Floats()) - start[k];
                const Floats to = load(group + 16 * k + 8, Floats()) - start[k];
                const Floats low = (from - grown) * inverse[k];
                const Floats high = (to + grown) * inverse[k];
                enters = larger(enters, smaller(low, high));
                leaves = smaller(leaves, larger(low, high));
            }
        };
        // First with the wider end's radius, then with that where the shaft may touch them.
        const Floats widest = larger(radius, end_radius), widening = end_radius - radius;
        Floats enters, leaves;
        overlap(widest, enters, leaves);
        const Floats grown = radius + larger(widening * enters, widening * leaves);
        overlap(smaller(grown, widest), enters, leaves);
        const unsigned hits = bits(enters <= leaves) & ~0u << b % LANES;
        if (hits)
            return b - b % LANES + first_bit(hits);
    }
    return -1;
"""
)


@wp.func_native(_NEXT_IN_SHAFT)
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
