"""Rays traced together return the same hits as rays traced alone."""

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import Material
from gen_data.core.capture import LidarHits, LidarRays
from gen_data.core.motion import Trajectory
from gen_data.core.scene import Body, Lidar, Scene
from gen_data.core.se3 import SE3, Array
from gen_data.core.streams import Streams
from gen_data.renderers.warp.lidar.kernels.ray_packets import LISTED_MAX
from gen_data.renderers.warp.lidar.lidar_tracing import RUN, RUNS
from gen_data.renderers.warp.renderer import WarpRenderer
from tests.renderers.fake_library import FakeLibrary, box_mesh

SIDE_M = 0.4
WINDOW = Material((0.01, 0.01, 0.01), 0.05, role="window")
GLASS = Material((0.01, 0.01, 0.01), 0.05, role="glass")
LIBRARY = FakeLibrary({
    "cube": box_mesh((SIDE_M, SIDE_M, SIDE_M)), "window": box_mesh((0.1, 4.0, 4.0), (WINDOW,)),
    "pane": box_mesh((0.01, 4.0, 4.0), (GLASS,)),
})  # fmt: skip
LIDAR = Lidar("top", "color")


def drawn(count: int, seed: int, spread: float) -> NDArray[np.float32]:
    rng = Streams(seed=seed, scene=0).rng("rays")
    v = np.concatenate([np.ones((count, 1)), rng.uniform(-spread, spread, (count, 2))], axis=1)
    return (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)


def cubes(count: int, seed: int, asset: str = "cube") -> tuple[Body, ...]:
    places = Streams(seed=seed, scene=0).rng("cubes").uniform([4, -8, -4], [60, 8, 4], (count, 3))
    return tuple(
        Body(f"{asset}{k}", asset, SE3((x, y, z))) for k, (x, y, z) in enumerate(places.tolist())
    )


def slab_ranges_m(bodies: tuple[Body, ...], directions: NDArray[np.float32]) -> Array:
    """Entry of rays from the origin into the first of some cubes, by Kay and Kajiya's slabs."""
    middle = np.array([body.T_world_body.translation_m for body in bodies])[:, None]
    inverse = 1.0 / directions.astype(np.float64)
    a, b = (middle - 0.5 * SIDE_M) * inverse, (middle + 0.5 * SIDE_M) * inverse
    enter, leave = np.minimum(a, b).max(axis=2), np.maximum(a, b).min(axis=2)
    return np.where((enter <= leave) & (leave > 0), enter, np.inf).min(axis=0)


def scanned(scene: Scene, beams: LidarRays) -> LidarHits:
    return WarpRenderer(LIBRARY, "cpu").scan(scene, LIDAR, beams)


def same(one: LidarHits, other: LidarHits, rows: slice | NDArray[np.int64] = slice(None)) -> bool:
    """Whether the rows of two arrays are permutations of each other, bit by bit."""
    fields = ("range_m", "reflectance", "incidence_cos", "instance_id", "category_id", "surface")
    return all(
        getattr(one, name)[rows].tobytes() == getattr(other, name).tobytes() for name in fields
    )


def test_runs_that_may_meet_more_than_a_list_holds_find_the_nearest() -> None:
    """Hundreds of cubes and rays so mixed that every run may hit nearly all of them."""
    bodies = cubes(4 * int(LISTED_MAX), 1)
    directions = drawn(RUN * RUNS, 2, 0.2)

    echoes = scanned(Scene("crowd", bodies), LidarRays(directions, 0.0, 1, 100.0))

    expected_m = slab_ranges_m(bodies, directions)
    assert np.isfinite(expected_m).mean() > 0.2
    agree = np.isclose(echoes.range_m[:, 0], expected_m, atol=1e-4)
    assert agree.mean() > 0.999


def test_runs_of_neighbours_find_the_nearest() -> None:
    """The same world, rays in the order of a fan."""
    bodies = cubes(300, 3)
    directions = drawn(4000, 4, 0.2)
    order = np.lexsort((directions[:, 1], np.floor(directions[:, 2] * 40))).astype(np.int32)

    beams = LidarRays(directions, 0.0, 1, 100.0, order=order)
    echoes = scanned(Scene("crowd", bodies), beams)

    agree = np.isclose(echoes.range_m[:, 0], slab_ranges_m(bodies, directions), atol=1e-4)
    assert agree.mean() > 0.999


def test_the_order_of_beams_changes_nothing() -> None:
    """The same bytes for rays in order and shuffled, with secondary rays, subrays and motion."""
    windows = cubes(20, 5, "window") + cubes(10, 6, "pane")
    bodies = cubes(60, 7) + windows
    poses = tuple(bodies[0].T_world_body @ SE3((0.0, 0.5 * k, 0.0)) for k in range(3))
    scene = Scene("crowd", bodies, tracks=(Trajectory(bodies[0].name, 0.1, poses, -0.1),))
    directions = drawn(1000, 8, 0.3)
    time_s = np.linspace(-0.05, 0.05, 1000, dtype=np.float32)
    shuffled = Streams(seed=9, scene=0).rng("order").permutation(1000).astype(np.int32)

    for subrays in (1, 7):
        plain, mixed = (
            scanned(scene, LidarRays(directions, 0.01, subrays, 100.0, None, time_s, order))
            for order in (None, shuffled)
        )
        assert same(plain, mixed)
        assert plain.detours is not None and mixed.detours is not None
        for name in ("ray", "range_m", "reflectance", "surface"):
            one, other = getattr(plain.detours, name), getattr(mixed.detours, name)
            a, b = (np.argsort(d.ray, kind="stable") for d in (plain.detours, mixed.detours))
            assert one[a].tobytes() == other[b].tobytes(), name


def test_a_ray_alone_finds_what_it_finds_in_company() -> None:
    """One ray per run, and all in runs as long as there are: the same bytes."""
    scene = Scene("crowd", cubes(100, 10))
    count = RUN * RUNS + 5
    directions = drawn(count, 11, 0.2)
    together = scanned(scene, LidarRays(directions, 0.0, 1, 100.0))

    for i in (0, RUN - 1, RUN, count - 1):
        alone = scanned(scene, LidarRays(directions[i : i + 1], 0.0, 1, 100.0))
        assert same(together, alone, slice(i, i + 1))


def test_rays_along_the_axes_meet_what_is_there() -> None:
    """Coordinates of 0 have no reciprocal."""
    bodies = tuple(
        Body(f"c{k}", "cube", SE3(place))
        for k, place in enumerate([(5.0, 0.0, 0.0), (0.0, -6.0, 0.0), (0.0, 0.0, 7.0)])
    )
    axes = np.array([[1, 0, 0], [0, -1, 0], [0, 0, 1], [-1, 0, 0]], np.float32)

    echoes = scanned(Scene("axes", bodies), LidarRays(axes, 0.0, 1, 100.0))

    np.testing.assert_allclose(echoes.range_m[:, 0], [4.8, 5.8, 6.8, np.inf], rtol=1e-6)
