"""Eight boxes are tested at once as they would be one by one."""

import numpy as np
import pytest
import warp as wp

from gen_data.core.se3 import Array
from gen_data.core.streams import Streams
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.scene.bvh import group_boxes
from gen_data.renderers.warp.scene.kernels.box_groups import high_corner, low_corner, next_in_shaft
from gen_data.renderers.warp.scene.kernels.records import reciprocals

wp.set_module_options({"enable_backward": False, "max_unroll": 3})


@wp.kernel
def mark_touched(
    boxes: wp.array[float], start: wp.vec3, way: wp.vec3, radii: wp.vec2, touched: wp.array[int]
) -> None:
    b = next_in_shaft(boxes, start, reciprocals(way), radii[0], radii[1], -1)
    while b >= 0:
        touched[b] += 1
        b = next_in_shaft(boxes, start, reciprocals(way), radii[0], radii[1], b)


@wp.kernel
def read_corners(boxes: wp.array[float], lows: wp.array[wp.vec3], highs: wp.array[wp.vec3]) -> None:
    b = wp.tid()
    lows[b] = low_corner(boxes, b)
    highs[b] = high_corner(boxes, b)


def drawn_boxes(count: int) -> tuple[Array, Array]:
    """Low and high corners [n, 3] of boxes within five metres."""
    rng = Streams(seed=3, scene=count).rng("boxes")
    middle, half = rng.uniform(-5.0, 5.0, (count, 3)), rng.uniform(0.0, 0.8, (count, 3))
    return (middle - half).astype(np.float32), (middle + half).astype(np.float32)


def touched_by(lows: Array, highs: Array, start: Array, way: Array, radii: Array) -> Array:
    boxes = wp.array(group_boxes(lows, highs), dtype=float, device=open_device("cpu"))
    touched = wp.zeros(len(lows), dtype=int, device="cpu")
    given = [boxes, wp.vec3(*start), wp.vec3(*way), wp.vec2(*radii), touched]
    wp.launch(mark_touched, 1, given, device="cpu")
    return touched.numpy()


@pytest.mark.parametrize("count", [1, 7, 8, 9, 200])
@pytest.mark.parametrize("ends", ["a widening shaft", "a narrowing shaft", "a sphere"])
def test_every_box_that_a_shaft_touches_is_found_once(count: int, ends: str) -> None:
    """Balls along the axis against the nearest points of the boxes; boxes far off are left out."""
    lows, highs = drawn_boxes(count)
    rng = Streams(seed=4, scene=count).rng(ends)
    t = np.linspace(0.0, 1.0, 1001)[:, None, None]
    for _ in range(20):
        start, way = rng.uniform(-6.0, 6.0, (2, 3)).astype(np.float32)
        if ends == "a sphere":
            way = np.zeros(3, np.float32)
        radii = np.sort(rng.uniform(0.0, 1.0, 2))
        radii = radii[::-1] if ends == "a narrowing shaft" else radii

        touched = touched_by(lows, highs, start, way, radii)

        ball = start + t * way
        apart = np.maximum(np.maximum(lows - ball, ball - highs), 0.0)
        radius = radii[0] + (radii[1] - radii[0]) * t[..., 0]
        meets = (np.sqrt((apart**2).sum(axis=-1)) <= radius).any(axis=0)
        assert (touched[meets] == 1).all()
        # Boxes are enlarged by the wider end's radius at most; 0.02 m are steps along the axis.
        near = (apart.max(axis=-1) <= radii.max() + 0.02).any(axis=0)
        assert (touched[~near] == 0).all()


def test_groups_hold_the_corners_in_order() -> None:
    lows, highs = drawn_boxes(19)
    device = open_device("cpu")
    boxes = wp.array(group_boxes(lows, highs), dtype=float, device=device)
    read = [wp.zeros(19, dtype=wp.vec3, device=device) for _ in range(2)]

    wp.launch(read_corners, 19, [boxes, *read], device=device)

    np.testing.assert_array_equal(read[0].numpy(), lows)
    np.testing.assert_array_equal(read[1].numpy(), highs)
