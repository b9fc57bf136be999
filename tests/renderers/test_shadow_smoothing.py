"""Smoothing of shadows, by eight points at a time on the CPU and by single ones on a GPU."""

from typing import Any

import numpy as np
import pytest
import warp as wp

from gen_data.renderers.warp.device import launch, open_device
from gen_data.renderers.warp.native_code import LANES
from gen_data.renderers.warp.realtime.kernels import soft_shadows
from gen_data.renderers.warp.scene.kernels.lattice import Lattice
from gen_data.renderers.warp.scene.kernels.records import View

CPU = open_device("cpu")
WIDTH, HEIGHT = 37, 22


def lattice_of_a_plane() -> Lattice:
    """Points one unit apart on one surface."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    points = np.stack([u, v, np.zeros_like(u)], axis=-1).reshape(-1, 3)
    lattice = Lattice()
    lattice.width, lattice.height, lattice.stride = WIDTH, HEIGHT, 3
    lattice.surface = wp.zeros(WIDTH * HEIGHT, dtype=wp.int32, device=CPU)
    lattice.p_m = wp.array(points, dtype=wp.vec3, device=CPU)
    lattice.normal = wp.array(np.tile((0.0, 0.0, 1.0), (len(points), 1)), wp.vec3, device=CPU)
    return lattice


def smoothed(values: np.ndarray, lanes: int) -> np.ndarray:
    """The values of a lattice after smoothing, some points per thread."""
    view = View()
    view.eye_m, view.pixel_rad = wp.vec3(18.0, 11.0, 30.0), 0.01
    lattice = lattice_of_a_plane()

    def zeros(*shape: int, dtype: Any = float) -> wp.array:
        return wp.zeros(shape, dtype=dtype, device=CPU)

    given = wp.array(values.reshape(1, -1), dtype=float, device=CPU)
    blocks = (-(-HEIGHT // soft_shadows.BLOCK), -(-WIDTH // soft_shadows.BLOCK), 1)
    classes, points = zeros(*blocks, dtype=wp.int32), WIDTH * HEIGHT
    launch(soft_shadows.classify_blocks, blocks, [lattice, given], [classes], device=CPU)
    shape = (HEIGHT, -(-WIDTH // lanes), 1)
    sums, result = zeros(1, 2, points), zeros(1, points)
    inputs = [view, lattice, lanes, classes, given]
    launch(soft_shadows.sum_rows, shape, inputs, [sums], device=CPU)
    launch(soft_shadows.smooth_lattice, shape, [*inputs, 20.0, sums], [result], device=CPU)
    return np.asarray(result.numpy().reshape(HEIGHT, WIDTH))


@pytest.mark.parametrize("seed", range(8))
def test_shadows_have_the_same_rims_on_each_device(seed: int) -> None:
    """Some small shadows in the light, or bright spots in the shade.

    Sums of rows amid equal values are left out, also for points around whose windows reach there.
    """
    rng = np.random.default_rng(seed)
    shadows = np.ones((HEIGHT, WIDTH), np.float32)
    for row, column in zip(rng.integers(HEIGHT, size=6), rng.integers(WIDTH, size=6), strict=True):
        shadows[row : row + 2, column : column + 2] = 0.0

    for values in (shadows, 1.0 - shadows):
        by_eights, by_points = (smoothed(values, lanes) for lanes in (LANES, 1))
        np.testing.assert_array_equal(by_points, by_eights)
        assert not np.array_equal(by_eights, values)
