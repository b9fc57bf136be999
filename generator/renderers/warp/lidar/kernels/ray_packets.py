"""Packets of coherent rays: the bodies that any ray of a run may hit, sorted by distance.

Querying the hierarchy over all bodies for every single ray takes a third of a scan's time; a run of
neighbours queries once, with interval arithmetic (Boulos, Wald and Shirley, "Geometric and
arithmetic culling methods for entire ray packets", 2006).
"""

import warp as wp

from gen_data.renderers.warp.native_code import native
from gen_data.renderers.warp.scene.kernels import records

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 3})

# Capacity of a list; a run that may hit more bodies tests all of them.
LISTED_MAX = wp.constant(96)
FAR_M = wp.constant(3.0e38)
# Boxes are enlarged, and distances to them reduced, such that rounding never excludes a body.
SLACK_M = wp.constant(1.0e-3)
SLACK = wp.constant(1.0e-4)


@wp.struct
class Boxes:
    """Boxes around bodies in the world, and memory for lists of them.

    Attributes:
        lows_m, highs_m: Their corners.
        groups: The same by eights, see box_groups.
        listed: Bodies that a run may hit [row, LISTED_MAX].
        enters_m: Smallest distance at which a ray of the run may enter the body's box, ascending.
    """

    lows_m: wp.array[wp.vec3]
    highs_m: wp.array[wp.vec3]
    groups: wp.array[wp.float32]
    listed: wp.array2d[int]
    enters_m: wp.array2d[float]


@wp.struct
class Bundle:
    """Bounds of the origins and unit directions of a run of rays, world frame."""

    origin_low_m: wp.vec3
    origin_high_m: wp.vec3
    way_low: wp.vec3
    way_high: wp.vec3


@wp.struct
class ListedBodies:
    """Bodies that a bundle may hit: a row of the lists; ``count`` is -1 on overflow."""

    row: int
    count: int


@wp.func
def empty_bundle():
    """The bundle without rays."""
    bundle = Bundle()
    bundle.origin_low_m = wp.vec3(FAR_M)
    bundle.origin_high_m = wp.vec3(-FAR_M)
    bundle.way_low = wp.vec3(FAR_M)
    bundle.way_high = wp.vec3(-FAR_M)
    return bundle


@wp.func
def extend_bundle(bundle: Bundle, origin_m: wp.vec3, way: wp.vec3):
    """The bundle extended by a ray."""
    bundle.origin_low_m = records.componentwise_min(bundle.origin_low_m, origin_m)
    bundle.origin_high_m = records.componentwise_max(bundle.origin_high_m, origin_m)
    bundle.way_low = records.componentwise_min(bundle.way_low, way)
    bundle.way_high = records.componentwise_max(bundle.way_high, way)
    return bundle


@wp.func
def slab_entry(near_m: float, far_m: float, way_low: float, way_high: float):
    """Smallest distance at which any ray can be between two planes; FAR_M for never.

    Args:
        near_m, far_m: Coordinates of the planes relative to the nearest origins.
        way_low, way_high: Bounds of the directions' component.
    """
    enter = float(0.0)
    if near_m > 0.0:
        # The fastest approach bounds the distance from below.
        enter = wp.where(way_high > 0.0, near_m / way_high, FAR_M)
    elif far_m < 0.0:
        enter = wp.where(way_low < 0.0, far_m / way_low, FAR_M)
    return enter


@wp.func
def slab_exit(near_m: float, far_m: float, way_low: float, way_high: float):
    """Largest distance at which any ray can still be between two planes."""
    leave = float(FAR_M)
    if way_low > 0.0:
        leave = far_m / way_low
    elif way_high < 0.0:
        leave = near_m / way_high
    return leave


@wp.func
def entry_distance(bundle: Bundle, low_m: wp.vec3, high_m: wp.vec3):
    """Smallest distance at which a ray of a bundle may enter a box; FAR_M for never."""
    slack = wp.vec3(SLACK_M)
    a = low_m - slack - bundle.origin_high_m
    c = high_m + slack - bundle.origin_low_m
    low, high = bundle.way_low, bundle.way_high
    enter = slab_entry(a[0], c[0], low[0], high[0])
    enter = records.max_of_two(enter, slab_entry(a[1], c[1], low[1], high[1]))
    enter = records.max_of_two(enter, slab_entry(a[2], c[2], low[2], high[2]))
    leave = slab_exit(a[0], c[0], low[0], high[0])
    leave = records.min_of_two(leave, slab_exit(a[1], c[1], low[1], high[1]))
    leave = records.min_of_two(leave, slab_exit(a[2], c[2], low[2], high[2]))
    enter = enter * (1.0 - SLACK)
    return wp.where(enter > leave * (1.0 + SLACK), FAR_M, enter)


@wp.func_native(native("lidar/kernels/next_entered.h", FAR=FAR_M, SLACK_M=SLACK_M, SLACK=SLACK))
def next_entered(
    groups: wp.array[wp.float32],
    origin_low_m: wp.vec3,
    origin_high_m: wp.vec3,
    way_low: wp.vec3,
    way_high: wp.vec3,
    reach_m: float,
    after: int,
) -> int:
    """The first box behind number ``after`` that a bundle may enter within reach; -1 for none.

    The bundle is given by the fields of a Bundle.
    """
    ...


@wp.func
def list_bodies(boxes: Boxes, row: int, bundle: Bundle, reach_m: float):
    """List the bodies that a bundle may hit within reach, the nearest first."""
    count = int(0)
    low, high = bundle.origin_low_m, bundle.origin_high_m
    ways_low, ways_high = bundle.way_low, bundle.way_high
    b = next_entered(boxes.groups, low, high, ways_low, ways_high, reach_m, -1)
    while b >= 0 and count >= 0:
        if count == LISTED_MAX:
            count = -1
        else:
            enter = entry_distance(bundle, boxes.lows_m[b], boxes.highs_m[b])
            # Insertion sort: lists are short.
            k = int(count)
            moving = bool(True)
            while moving:
                moving = False
                if k > 0:
                    if boxes.enters_m[row, k - 1] > enter:
                        boxes.enters_m[row, k] = boxes.enters_m[row, k - 1]
                        boxes.listed[row, k] = boxes.listed[row, k - 1]
                        k -= 1
                        moving = True
            boxes.enters_m[row, k] = enter
            boxes.listed[row, k] = b
            count += 1
        b = next_entered(boxes.groups, low, high, ways_low, ways_high, reach_m, b)
    listed = ListedBodies()
    listed.row = row
    listed.count = count
    return listed


@wp.func
def is_box_entered(boxes: Boxes, b: int, origin_m: wp.vec3, inverse: wp.vec3, reach_m: float):
    """Whether a ray may enter a body's box within its reach."""
    low_m = boxes.lows_m[b] - origin_m
    enter, leave = records.slab_interval(low_m, boxes.highs_m[b] - origin_m, inverse)
    return leave >= 0.0 and leave >= enter and enter < reach_m
