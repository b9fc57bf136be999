"""Depth, ids, normals and coordinates against geometry computed by hand."""

import numpy as np
import pytest

from gen_data.core.asset_types import Material, MeshData
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.scene import Body, Camera, Instance, Scene
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers import fake_library

LABELS = frozenset(Channel) - {Channel.RGB, Channel.RADIANCE, Channel.AMODAL}
MESHES = {
    "box": fake_library.box_mesh(), "plane": fake_library.plane_mesh(100.0),
    "sphere": fake_library.sphere_mesh(1.0, rings=256),
    "coarse_sphere": fake_library.sphere_mesh(0.5, rings=12), "room": fake_library.room_mesh(),
}  # fmt: skip


@pytest.fixture(params=["raster", "rays"])
def renderer(request: pytest.FixtureRequest) -> WarpRenderer:
    settings = RenderSettings(visibility=request.param)
    return WarpRenderer(fake_library.FakeLibrary(MESHES), "cpu", settings)


def scene_of(*bodies: Body, instances: tuple[Instance, ...] = ()) -> Scene:
    return Scene("test", bodies, instances)


def facing_plane(z_m: float) -> Body:
    return Body("plane", "plane", SE3((0.0, 0.0, z_m), (0.0, 1.0, 0.0, 0.0)))


def seen(renderer: WarpRenderer, scene: Scene, camera: Camera) -> SensorReading:
    return renderer.render(scene, camera, LABELS)


def test_range_of_a_facing_plane_grows_with_the_angle_from_the_axis(renderer: WarpRenderer) -> None:
    """Range is measured along the ray of the pixel's centre, and z-depth along the axis."""
    camera = fake_library.forward_camera((4, 2), focal_px=2.0)

    channels = seen(renderer, scene_of(facing_plane(2.0)), camera).channels

    x = (np.array([0.5, 1.5, 2.5, 3.5]) - 2.0) / 2.0
    y = (np.array([0.5, 1.5]) - 1.0) / 2.0
    expected = 2.0 * np.sqrt(1.0 + x[None] ** 2 + y[:, None] ** 2)
    np.testing.assert_allclose(channels[Channel.RANGE], expected, rtol=1e-6)
    np.testing.assert_allclose(channels[Channel.Z_DEPTH], 2.0, atol=1e-5)


def test_normals_of_a_sphere_point_outwards_and_to_the_camera(renderer: WarpRenderer) -> None:
    """Normals are unit, in the camera frame, and zero in the background."""
    camera = fake_library.forward_camera((64, 64), focal_px=60.0)
    reading = seen(renderer, scene_of(Body("ball", "sphere", SE3((0.0, 0.0, 3.0)))), camera)

    normals, depth = reading.channels[Channel.NORMALS], reading.channels[Channel.Z_DEPTH]
    points = camera.intrinsics.unproject(depth)
    hit = np.isfinite(depth)
    expected = points[hit] - [0.0, 0.0, 3.0]
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    assert (normals[hit] * expected).sum(axis=1).min() > 0.9999
    assert (normals[hit] * points[hit]).sum(axis=1).max() <= 1e-5
    assert not normals[~hit].any()


def test_the_inside_of_a_surface_has_its_normal_turned_round(renderer: WarpRenderer) -> None:
    scene = scene_of(Body("plane", "plane", SE3((0.0, 0.0, 2.0))))

    normals = seen(renderer, scene, fake_library.forward_camera()).channels[Channel.NORMALS]

    np.testing.assert_allclose(normals, np.broadcast_to([0.0, 0.0, -1.0], normals.shape), atol=1e-6)


def two_boxes() -> Scene:
    """A unit box at 4 m and another one at 2.5 m in front of its right half."""
    near = Body("near", "box", SE3((0.5, 0.0, 2.5)), instance_id=7, part_id=2)
    far = Body("far", "box", SE3((0.0, 0.0, 4.0)), instance_id=65535)
    instances = (
        Instance(7, "near", "a", 3, "box", parts=("x", "y")), Instance(65535, "far", "b", 4, "box"),
    )  # fmt: skip
    return scene_of(near, far, instances=instances)


def test_the_nearer_of_two_boxes_hides_the_other(renderer: WarpRenderer) -> None:
    """Ids of instance, part and category all follow the visible body; 0 is the background."""
    camera = fake_library.forward_camera((64, 48), focal_px=48.0)

    channels = seen(renderer, two_boxes(), camera).channels

    # The near face lies at z = 2 from x = 0 on, the far one at z = 3.5 from x = -0.5 to 0.5.
    row = channels[Channel.INSTANCE][24]
    assert row[32 : 32 + 24].tolist() == [7] * 24
    assert row[26:32].tolist() == [65535] * 6
    assert row[:25].tolist() == [0] * 25
    assert channels[Channel.INSTANCE].dtype == np.uint16
    assert (channels[Channel.PART][24, 40], channels[Channel.PART][24, 30]) == (2, 0)
    assert channels[Channel.CATEGORY][24, [20, 30, 40]].tolist() == [0, 4, 3]


@pytest.mark.parametrize(("edge_px", "first"), [(22.45, 22), (22.55, 23), (22.0, 22), (23.0, 23)])
def test_a_pixel_belongs_to_its_centre(renderer: WarpRenderer, edge_px: float, first: int) -> None:
    """The centre of pixel i is at i + 0.5."""
    camera = fake_library.forward_camera((64, 48), focal_px=50.0)
    left_m = (edge_px - 32.0) / 50.0 * 2.0
    box = Body("box", "box", SE3((left_m + 0.5, 0.0, 2.5)), instance_id=1)

    ids = seen(renderer, scene_of(box), camera).channels[Channel.INSTANCE]

    assert int(np.flatnonzero(ids[24])[0]) == first


def test_object_coordinates_run_from_0_to_1_over_the_instance_box(renderer: WarpRenderer) -> None:
    """The instance may be scaled, rotated and away from the origin; the background is 0."""
    pose = SE3.about_z(0.7, (0.3, -0.2, 3.0))
    body = Body("box", "box", pose, scale=0.5, instance_id=1)
    box = Instance(
        1, "box", "a", 1, "box", T_world_instance=pose,
        box_min_m=(-0.25, -0.25, -0.25), box_max_m=(0.25, 0.25, 0.25),
    )  # fmt: skip
    camera = fake_library.forward_camera()

    channels = seen(renderer, scene_of(body, instances=(box,)), camera).channels

    depth, coordinates = channels[Channel.Z_DEPTH], channels[Channel.OBJECT_COORDINATES]
    hit = np.isfinite(depth)
    p_box = pose.inverse().apply(camera.intrinsics.unproject(depth)[hit])
    np.testing.assert_allclose(coordinates[hit], p_box / 0.5 + 0.5, atol=1e-5)
    assert np.ptp(coordinates[hit], axis=0).min() >= 0.0
    assert not coordinates[~hit].any()


def test_a_room_around_the_camera_fills_the_image(renderer: WarpRenderer) -> None:
    """Walls that extend past the camera are clipped at its plane and leave no hole."""
    camera = fake_library.camera_at((0.5, -1.0, 1.2), (2.0, 2.5, 0.7), (96, 72), hfov_deg=100.0)

    depth = seen(renderer, scene_of(Body("room", "room")), camera).channels[Channel.Z_DEPTH]

    points = camera.T_world_camera.apply(camera.intrinsics.unproject(depth))
    to_wall = np.abs(np.abs(points[..., :2]).max(axis=-1) - 3.0)
    to_floor = np.minimum(np.abs(points[..., 2]), np.abs(points[..., 2] - 3.0))
    assert np.minimum(to_wall, to_floor).max() < 1e-5


def test_surfaces_nearer_than_a_centimetre_are_not_seen(renderer: WarpRenderer) -> None:
    """A plane 5 mm in front of the camera is clipped."""
    scene = scene_of(facing_plane(3.0), Body("near", "plane", SE3((0.0, 0.0, 0.005))))

    depth = seen(renderer, scene, fake_library.forward_camera()).channels[Channel.Z_DEPTH]

    assert np.abs(depth - 3.0).max() < 1e-5


def scattered(seed: int, count: int = 12) -> Scene:
    rng = np.random.default_rng(seed)
    bodies = [Body("room", "room")]
    for k in range(count):
        pose = fake_library.scattered_pose(rng, (-1, -1, 0.2), (1, 1, 1.5))
        asset = ("box", "coarse_sphere")[k % 2]
        scale = float(rng.uniform(0.1, 0.5))
        bodies.append(Body(f"b{k}", asset, pose, scale, instance_id=k + 1))
    return scene_of(*bodies)


def test_raster_and_rays_agree_but_for_pixels_at_silhouettes() -> None:
    """Two independent methods give the same ids; snapping may move an edge by 1/512 px."""
    library = fake_library.FakeLibrary(MESHES)
    camera = fake_library.camera_at((2.0, -1.5, 1.8), (0.0, 0.0, 0.7), (160, 120))
    for seed in range(3):
        readings = [
            WarpRenderer(library, "cpu", RenderSettings(visibility=v)).render(
                scattered(seed), camera, LABELS
            )
            for v in ("raster", "rays")
        ]
        ids = [r.channels[Channel.INSTANCE] for r in readings]
        depths = [r.channels[Channel.Z_DEPTH] for r in readings]
        same = ids[0] == ids[1]
        assert same.mean() > 0.999
        assert np.quantile(np.abs(depths[0] - depths[1])[same], 0.999) < 1e-5
        assert (depths[0] == depths[1]).mean() > 0.97, "both use one formula"


def test_triangles_that_share_an_edge_neither_overlap_nor_leave_a_gap() -> None:
    """A fan of slivers around a pixel centre covers a disk exactly once, by the top-left rule."""
    angles = np.sort(np.random.default_rng(0).uniform(0.0, 2 * np.pi, 200))
    rim = np.stack([np.cos(angles), np.sin(angles), np.zeros(200)], axis=1)
    vertices = np.concatenate([np.zeros((1, 3)), rim]).astype(np.float32)
    faces = np.array([(0, k, k % 200 + 1) for k in range(1, 201)], np.int32)
    fan = MeshData(
        vertices, faces, np.tile(np.float32([0, 0, 1]), (201, 1)), np.zeros((201, 2), np.float32),
        np.zeros(200, np.int32), (Material(),),
    )  # fmt: skip
    renderer = WarpRenderer(
        fake_library.FakeLibrary({"fan": fan}), "cpu", RenderSettings(visibility="raster")
    )
    scene = scene_of(Body("fan", "fan", SE3((0.0, 0.0, 2.0)), instance_id=1))

    ids = seen(renderer, scene, fake_library.forward_camera((64, 64), focal_px=50.0)).channels[
        Channel.INSTANCE
    ]

    x = np.arange(64) + 0.5 - 32.0
    well_inside = x[None] ** 2 + x[:, None] ** 2 < 23.0**2
    assert ids[well_inside].all()


def test_depth_of_slivers_is_that_of_their_plane() -> None:
    """Ground 1.5 m below the camera, of triangles 38 m long and millimetres to centimetres wide.

    Snapping leaves centres of pixels outside of the slivers drawn there: the plane has their
    depth within 1/256 px up or down, a far corner never has.
    """
    rng = np.random.default_rng(5)
    right_m = np.cumsum(rng.uniform(0.001, 0.02, 1600)) - 8.0
    corners = [(x, 1.5, z) for x in right_m for z in (2.0, 40.0)]
    first = 2 * np.arange(len(right_m) - 1)[:, None]
    faces = (first + np.array([(0, 1, 3, 0, 3, 2)])).reshape(-1, 3).astype(np.int32)
    strips = MeshData(
        np.array(corners, np.float32), faces, np.tile(np.float32([0, -1, 0]), (len(corners), 1)),
        np.zeros((len(corners), 2), np.float32), np.zeros(len(faces), np.int32), (Material(),),
    )  # fmt: skip
    renderer = WarpRenderer(
        fake_library.FakeLibrary({"strips": strips}), "cpu", RenderSettings(visibility="raster")
    )
    camera = fake_library.forward_camera((320, 240), focal_px=200.0)

    depth = seen(renderer, scene_of(Body("ground", "strips")), camera).channels[Channel.Z_DEPTH]

    down = (np.arange(240) + 0.5 - 120.0)[:, None]
    met = np.isfinite(depth) & (down > 8.0) & (down < 100.0)
    least, most = (200.0 * 1.5 / np.maximum(down + by, 1.0) for by in (1 / 256, -1 / 256))
    assert met.sum() > 10000
    assert (depth > least - 1e-4)[met].all()
    assert (depth < most + 1e-4)[met].all()
