"""Pseudo-LiDAR, against the depth image of its camera and against geometry."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from gen_data.core import errors, scene_time, se3, streams
from gen_data.core.capture import POINT, Channel, PointCloud
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Body, Camera, Instance, Scene
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.sensors.lidar.pseudo_lidar import PseudoLidar, every_nth_pixel
from tests.renderers.fake_library import FakeLibrary, box_mesh, plane_mesh

BOX_M = (2.0, 1.0, 1.5)
FISHEYE = Lens("kannala_brandt", (0.02, -0.01, 0.0, 0.0), math.radians(80.0))


@cache
def renderer() -> WarpRenderer:
    return WarpRenderer(FakeLibrary({"box": box_mesh(BOX_M), "ground": plane_mesh(40.0)}), "cpu")


def scene(lens: Intrinsics) -> Scene:
    """A box on the ground before a camera that stands 2 m high and looks down at it."""
    place = se3.SE3((6.0, 0.5, 0.75))
    half = tuple(0.5 * side for side in BOX_M)
    low, high = (-half[0], -half[1], -half[2]), (half[0], half[1], half[2])
    thing = Instance(7, "box", "crate", 3, "box", True, (), place, low, high)
    pose = se3.look_at((0.0, 0.0, 2.0), (6.0, 0.0, 0.5))
    return Scene(
        "test",
        bodies=(Body("box", "box", place, instance_id=7), Body("ground", "ground")),
        instances=(thing,),
        cameras=(Camera("color", pose, lens),),
    )


def cloud_of(sensor: PseudoLidar, world: Scene) -> PointCloud:
    rng = streams.Streams(0, scene=0, view=0, step=0).rng("sensor")
    mounted = scene_time.place_sensors(sensor.mount(world))
    return sensor.capture(mounted, renderer(), frozenset(), rng)


@pytest.mark.parametrize("stride_px", [1, 3, 8])
def test_points_are_those_of_every_nth_pixel_of_the_depth_image(stride_px: int) -> None:
    """The camera's own full image, unprojected, and its labels."""
    lens = Intrinsics(70, 50, 61.0, 59.0, 33.0, 26.5)
    world = scene(lens)
    channels = frozenset({Channel.Z_DEPTH, Channel.INSTANCE, Channel.CATEGORY})
    image = renderer().render(world, world.cameras[0], channels).channels
    first = stride_px // 2
    taken = (slice(first, None, stride_px), slice(first, None, stride_px))
    p_camera = lens.unproject(image[Channel.Z_DEPTH])[taken].reshape(-1, 3)
    hit = np.isfinite(p_camera[:, 2])

    points = cloud_of(PseudoLidar(stride_px=stride_px, offset_m=(0.0, 0.0, 0.0)), world).points

    x, y, z = p_camera[hit].T
    assert points.dtype == POINT
    assert np.allclose(points["position_m"], np.stack([z, -x, -y], axis=1), atol=1e-4)
    assert np.array_equal(points["instance_id"], image[Channel.INSTANCE][taken].ravel()[hit])
    assert np.array_equal(points["category_id"], image[Channel.CATEGORY][taken].ravel()[hit])


@pytest.mark.parametrize(
    "lens", [Intrinsics.from_hfov(64, 48, 1.2), Intrinsics.from_hfov(64, 48, 2.4, FISHEYE)]
)
def test_points_lie_on_the_surfaces_of_the_world(lens: Intrinsics) -> None:
    """On the ground, or on a face of the box; behind any lens."""
    cloud = cloud_of(PseudoLidar(stride_px=2), scene(lens))
    p_world = cloud.lidar.T_world_lidar.apply(cloud.points["position_m"])
    on_box = cloud.points["instance_id"] == 7
    local = np.abs(p_world[on_box] - (6.0, 0.5, 0.75)) - 0.5 * np.array(BOX_M)

    assert on_box.sum() > 10
    assert np.abs(p_world[~on_box, 2]).max() < 1e-3
    assert np.abs(local.max(axis=1)).max() < 1e-3


def test_the_frame_looks_along_the_axis_above_the_camera_and_far_points_are_left_out() -> None:
    """X forward, Y left, Z up, 0.3 m over its centre, as KITTI's readers expect."""
    world = scene(Intrinsics.from_hfov(64, 48, 1.2))
    lidar = cloud_of(PseudoLidar(), world).lidar
    T_camera_lidar = (world.cameras[0].T_world_camera.inverse() @ lidar.T_world_lidar).matrix()

    expected = [[0, -1, 0, 0], [0, 0, -1, -0.3], [1, 0, 0, 0], [0, 0, 0, 1]]
    assert np.allclose(T_camera_lidar, expected, atol=1e-6)

    near = cloud_of(PseudoLidar(stride_px=2, range_max_m=7.0), world)
    every = cloud_of(PseudoLidar(stride_px=2), world)
    p_world = near.lidar.T_world_lidar.apply(near.points["position_m"])

    assert 0 < len(near.points) < len(every.points)
    assert np.linalg.norm(p_world - (0.0, 0.0, 2.0), axis=1).max() <= 7.0 + 1e-4


def test_pixel_centres_of_the_coarse_camera_are_those_of_the_fine_one() -> None:
    """Rays through both are the same, with whatever lens."""
    fine = Intrinsics(61, 47, 40.0, 41.0, 29.0, 24.0, FISHEYE)

    for stride_px in (1, 2, 5):
        coarse = every_nth_pixel(fine, stride_px)
        own = fine.pixel_rays()[stride_px // 2 :: stride_px, stride_px // 2 :: stride_px]
        assert np.allclose(coarse.pixel_rays(), own, atol=1e-9, equal_nan=True)


def test_a_camera_that_does_not_fit_is_refused() -> None:
    world = scene(Intrinsics.from_hfov(64, 48, 1.2))

    with pytest.raises(errors.ConfigError, match=r"no camera 'colour' .*listed so far: color"):
        PseudoLidar(camera="colour").mount(world)
    with pytest.raises(errors.ConfigError, match=r"stride_px 49 .*'color', 64 x 48 px"):
        PseudoLidar(stride_px=49).mount(world)
    with pytest.raises(errors.ConfigError, match="listed before it; cameras listed so far: none"):
        PseudoLidar().mount(replace(world, cameras=()))
