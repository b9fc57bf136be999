"""Construction of eight-wide bounding volume hierarchies by the surface area heuristic.

Source: Wald, "On fast construction of SAH-based bounding volume hierarchies", IEEE RT 2007, with
nodes of eight as in Wald, Benthin and Boulos 2008: the largest part of a node is split until there
are eight.
"""

from __future__ import annotations

import warp as wp

from gen_data.generator.renderers.warp.scene.kernels.records import (
    componentwise_max,
    componentwise_min,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 3})

WIDTH = wp.constant(8)
# Wald 2007: with 16 bins, trees are nearly as good as those of a full sweep.
BINS = wp.constant(16)
# Deeper nodes are split at the median, which bounds the depth by the stack of the traversal.
EVEN_DEPTH = wp.constant(8)
FARTHEST = wp.constant(3.0e38)
# Bounds of an empty lane, which no ray enters.
NOWHERE = wp.constant(1.0e30)

Bounds = wp.types.vector(length=9, dtype=wp.int32)
Worths = wp.types.vector(length=9, dtype=wp.float32)


@wp.struct
class Boxes:
    """Boxes to build a tree over, and scratch memory.

    Attributes:
        lows, highs: Corners [n].
        order: Permutation of the boxes; those of a node are contiguous [n].
        bin_lows, bin_highs, bin_counts: Of one axis [BINS].
        costs: SAH cost to the right of each split plane [BINS].
    """

    lows: wp.array[wp.vec3]
    highs: wp.array[wp.vec3]
    order: wp.array[wp.int32]
    bin_lows: wp.array[wp.vec3]
    bin_highs: wp.array[wp.vec3]
    bin_counts: wp.array[wp.int32]
    costs: wp.array[wp.float32]


@wp.func
def half_area(low: wp.vec3, high: wp.vec3):
    """Half the surface area of a box."""
    e = high - low
    return e[0] * e[1] + e[1] * e[2] + e[2] * e[0]


@wp.func
def doubled_centre(boxes: Boxes, i: int):
    """Twice the centre of a box."""
    # Only the order matters: halving would add a rounding for nothing.
    return boxes.lows[i] + boxes.highs[i]


@wp.func
def bin_index(x: float, origin: float, scale: float):
    """Bin of a centre along an axis."""
    return wp.clamp(int((x - origin) * scale), 0, BINS - 1)


@wp.func
def range_bounds(boxes: Boxes, begin: int, end: int):
    """Corners of the bounding box of a range."""
    low = wp.vec3(FARTHEST, FARTHEST, FARTHEST)
    high = -low
    i = int(begin)
    while i < end:
        low = componentwise_min(low, boxes.lows[boxes.order[i]])
        high = componentwise_max(high, boxes.highs[boxes.order[i]])
        i += 1
    return low, high


@wp.func
def best_cut(boxes: Boxes, begin: int, end: int, axis: int, origin: float, scale: float, leaf: int):
    """Cost and split plane (number of bins to its left) of the best split across an axis."""
    nothing = wp.vec3(FARTHEST, FARTHEST, FARTHEST)
    for k in range(BINS):
        boxes.bin_lows[k] = nothing
        boxes.bin_highs[k] = -nothing
        boxes.bin_counts[k] = 0
    # Bin the boxes by their centres.
    i = int(begin)
    while i < end:
        box = boxes.order[i]
        k = bin_index(doubled_centre(boxes, box)[axis], origin, scale)
        boxes.bin_lows[k] = componentwise_min(boxes.bin_lows[k], boxes.lows[box])
        boxes.bin_highs[k] = componentwise_max(boxes.bin_highs[k], boxes.highs[box])
        boxes.bin_counts[k] = boxes.bin_counts[k] + 1
        i += 1
    low = nothing
    high = -nothing
    count = int(0)
    # Sweep from the right: costs to the right of each plane.
    k = int(BINS - 1)
    while k > 0:
        low = componentwise_min(low, boxes.bin_lows[k])
        high = componentwise_max(high, boxes.bin_highs[k])
        count += boxes.bin_counts[k]
        boxes.costs[k] = FARTHEST
        if count > 0:
            # Surface area heuristic; leaves are intersected eight faces at once, so leaves count,
            # not faces.
            boxes.costs[k] = half_area(low, high) * float((count + leaf - 1) / leaf)
        k -= 1
    # Sweep from the left: add the costs to the left and keep the cheapest plane.
    best = float(FARTHEST)
    cut = int(0)
    low = nothing
    high = -nothing
    count = int(0)
    k = int(1)
    while k < BINS:
        low = componentwise_min(low, boxes.bin_lows[k - 1])
        high = componentwise_max(high, boxes.bin_highs[k - 1])
        count += boxes.bin_counts[k - 1]
        if count > 0 and boxes.costs[k] < FARTHEST:
            cost = boxes.costs[k] + half_area(low, high) * float((count + leaf - 1) / leaf)
            if cost < best:
                best = cost
                cut = k
        k += 1
    return best, cut


@wp.func
def partition(boxes: Boxes, begin: int, end: int, leaf: int):
    """Partition a range by the best split; returns where the second group begins."""
    low = wp.vec3(FARTHEST, FARTHEST, FARTHEST)
    high = -low
    # In-place partition as in quicksort.
    i = int(begin)
    while i < end:
        low = componentwise_min(low, doubled_centre(boxes, boxes.order[i]))
        high = componentwise_max(high, doubled_centre(boxes, boxes.order[i]))
        i += 1
    best = float(FARTHEST)
    best_axis = int(-1)
    split_at = int(0)
    for axis in range(3):
        size = high[axis] - low[axis]
        if size > 0.0:
            scale = float(BINS) / size
            cost, cut = best_cut(boxes, begin, end, axis, low[axis], scale, leaf)
            if cost < best:
                best = cost
                best_axis = axis
                split_at = cut
    # All centres coincide: any split is as good, and the median keeps the depth logarithmic.
    if best_axis < 0:
        return (begin + end) / 2
    scale = float(BINS) / (high[best_axis] - low[best_axis])
    i = int(begin)
    j = int(end)
    while i < j:
        box = boxes.order[i]
        if bin_index(doubled_centre(boxes, box)[best_axis], low[best_axis], scale) < split_at:
            i += 1
        else:
            j -= 1
            boxes.order[i] = boxes.order[j]
            boxes.order[j] = box
    return i


@wp.func
def split_priority(boxes: Boxes, begin: int, end: int, leaf: int, depth: int):
    """Priority of splitting a range: its area, or its size in deep nodes; -1 for a leaf."""
    size = float(-1.0)
    if end - begin > leaf:
        size = float(end - begin)
        if depth < EVEN_DEPTH:
            low, high = range_bounds(boxes, begin, end)
            size = half_area(low, high)
    return size


@wp.func
def split_node(boxes: Boxes, begin: int, end: int, leaf: int, depth: int):
    """Bounds of a node's parts, and their number."""
    bounds = Bounds()
    worths = Worths()
    bounds[0] = begin
    bounds[1] = end
    parts = int(1)
    chosen = int(0)
    while chosen >= 0:
        first = bounds[chosen]
        last = bounds[chosen + 1]
        cut = (first + last) / 2
        if depth < EVEN_DEPTH:
            cut = partition(boxes, first, last, leaf)
        # Insert the new bound and keep the parts in order.
        k = int(parts)
        while k > chosen:
            bounds[k + 1] = bounds[k]
            worths[k] = worths[k - 1]
            k -= 1
        bounds[chosen + 1] = cut
        worths[chosen] = split_priority(boxes, first, cut, leaf, depth)
        worths[chosen + 1] = split_priority(boxes, cut, last, leaf, depth)
        parts += 1
        # Continue with the part of highest priority until the node is full.
        chosen = int(-1)
        most = float(-1.0)
        k = int(0)
        while k < parts < WIDTH:
            if worths[k] > most:
                most = worths[k]
                chosen = k
            k += 1
    return bounds, parts


@wp.kernel
def grow_tree(
    boxes: Boxes,
    leaf: int,
    todo: wp.array[wp.vec4i],
    nodes: wp.array3d[float],
    codes: wp.array2d[int],
    leaves: wp.array[wp.vec2i],
    counts: wp.array[int],
):
    """Build one tree; launched with a single thread.

    Args:
        leaf: Maximum number of boxes in a leaf.
        todo: Stack of ranges to split: (begin, end, depth, 8 * node + lane).
        nodes: Bounds: low x, high x, low y, ... [., 6, 8]; no ray enters unused lanes.
        codes: Child of each lane: the number of a node, or -1 - number of a leaf [., 8].
        leaves: (begin, end) into ``order``.
        counts: (nodes, leaves).
    """
    node_count = int(0)
    leaf_count = int(0)
    n = boxes.order.shape[0]
    todo[0] = wp.vec4i(0, n, 0, -1)
    waiting = int(1)
    while waiting > 0:
        waiting -= 1
        task = todo[waiting]
        code = node_count
        if task[1] - task[0] <= leaf:
            leaves[leaf_count] = wp.vec2i(task[0], task[1])
            leaf_count += 1
            code = -leaf_count
        else:
            bounds, parts = split_node(boxes, task[0], task[1], leaf, task[2])
            for k in range(WIDTH):
                low = wp.vec3(NOWHERE, NOWHERE, NOWHERE)
                high = -low
                if k < parts:
                    low, high = range_bounds(boxes, bounds[k], bounds[k + 1])
                    lane = WIDTH * node_count + k
                    todo[waiting] = wp.vec4i(bounds[k], bounds[k + 1], task[2] + 1, lane)
                    waiting += 1
                for axis in range(3):
                    nodes[node_count, 2 * axis, k] = low[axis]
                    nodes[node_count, 2 * axis + 1, k] = high[axis]
            node_count += 1
        if task[3] >= 0:
            # A node's number is known only now: write it into its parent's lane.
            codes[task[3] / WIDTH, task[3] % WIDTH] = code
    counts[0] = node_count
    counts[1] = leaf_count
