"""Optical flow and scene flow against homographies, OpenCV and individually traced rays."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from gen_data.core.asset_types import MeshData
from gen_data.core.capture import Channel
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.motion import StateChange
from gen_data.core.scene import Body, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.se3 import SE3
from gen_data.core.shutter import Shutter
from gen_data.renderers.warp.renderer import WarpRenderer
from tests import opencv
from tests.renderers.fake_library import FakeLibrary, box_mesh
from tests.renderers.moving import FACING, LENS, MESHES, STEP_S, even_track, world

ALL = frozenset({
    Channel.FLOW_FORWARD, Channel.FLOW_BACKWARD, Channel.FLOW_OCCLUDED_FORWARD,
    Channel.FLOW_OCCLUDED_BACKWARD, Channel.SCENE_FLOW, Channel.INSTANCE, Channel.Z_DEPTH,
})  # fmt: skip
WALL = Body("wall", "wall", replace(FACING, translation_m=(0.0, 0.0, 6.0)))


@pytest.fixture(scope="module")
def renderer() -> WarpRenderer:
    return WarpRenderer(MESHES, "cpu")


def images(renderer: WarpRenderer, scene: Scene) -> dict[Channel, np.ndarray]:
    return dict(renderer.render(scene, scene.cameras[0], ALL).channels)


def centres(lens: Intrinsics = LENS) -> np.ndarray:
    u, v = np.meshgrid(np.arange(lens.width_px) + 0.5, np.arange(lens.height_px) + 0.5)
    return np.stack([u, v, np.ones_like(u)], axis=-1)


def through(homography: np.ndarray) -> np.ndarray:
    """The flow that a homography of the image induces."""
    moved = np.einsum("ij,hwj->hwi", homography, centres())
    return moved[..., :2] / moved[..., 2:] - centres()[..., :2]


def camera_motion(scene: Scene, step_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and translation from the camera's frame to the one of another instant."""
    other = scene_at(scene, scene.time_s + step_s)
    pose = other.cameras[0].T_world_camera.inverse() @ scene.cameras[0].T_world_camera
    return pose.rotation(), np.asarray(pose.translation_m)


@pytest.mark.parametrize("step_s", [STEP_S, -STEP_S])
def test_a_plane_flows_by_its_homography(renderer: WarpRenderer, step_s: float) -> None:
    """K (R + t n^T / d) K^-1 for the plane n . x = d, forward and backward."""
    scene = world(WALL, camera_velocity_m_s=(0.8, -0.3, 1.1), camera_turn_rad_s=0.4)
    seen = images(renderer, scene)
    R, t = camera_motion(scene, step_s)
    T_camera_world = scene.cameras[0].T_world_camera.inverse()
    n = T_camera_world.rotate(np.array([0.0, 0.0, 1.0]))
    d = 6.0 - scene.cameras[0].T_world_camera.translation_m[2]
    K = LENS.matrix()
    expected = through(K @ (R + np.outer(t, n) / d) @ np.linalg.inv(K))

    channel = Channel.FLOW_FORWARD if step_s > 0 else Channel.FLOW_BACKWARD
    assert np.abs(expected).max() > 3.0
    np.testing.assert_allclose(seen[channel], expected, atol=2e-4)


def test_the_sky_is_at_infinity_and_flows_by_rotation_alone(renderer: WarpRenderer) -> None:
    """K R K^-1, independent of the camera's translation; no scene flow."""
    scene = world(camera_velocity_m_s=(5.0, 0.0, 5.0), camera_turn_rad_s=0.5)
    seen = images(renderer, scene)
    K = LENS.matrix()
    R, _ = camera_motion(scene, STEP_S)

    expected = through(K @ R @ np.linalg.inv(K))
    np.testing.assert_allclose(seen[Channel.FLOW_FORWARD], expected, atol=2e-4)
    assert np.isnan(seen[Channel.SCENE_FLOW]).all()
    place = centres()[..., :2] + expected
    inside = ((place >= 0) & (place < [LENS.width_px, LENS.height_px])).all(axis=-1)
    assert np.array_equal(seen[Channel.FLOW_OCCLUDED_FORWARD] == 0, inside)


@pytest.mark.parametrize("lens", [
    Lens("brown_conrady", (-0.2, 0.05, 0.001, -0.002, 0.0, 0.0, 0.0, 0.0), 1.2),
    Lens("kannala_brandt", (-0.02, 0.01, -0.004, 0.0005), 1.4),
])  # fmt: skip
def test_a_moving_box_flows_through_a_lens_as_in_opencv(renderer: WarpRenderer, lens: Lens) -> None:
    """Points of a face, located by OpenCV's undistortion, moved and projected by OpenCV."""
    intrinsics = replace(LENS, lens=lens)
    start = SE3((0.0, 0.0, 3.0))
    box = Body("box", "box", start, instance_id=1)
    track = even_track("box", start, (0.6, 0.4, -0.5))
    scene = world(box, tracks=(track,), camera_velocity_m_s=(-0.3, 0.0, 0.2), lens=intrinsics)
    seen = images(renderer, scene)

    eye_m = np.array(scene.cameras[0].T_world_camera.translation_m)
    face_m = scene.body("box").T_world_body.translation_m[2] - 0.5 - eye_m[2]
    front = (seen[Channel.INSTANCE] == 1) & (np.abs(seen[Channel.Z_DEPTH] - face_m) < 1e-4)
    assert front.sum() > 300
    K = intrinsics.matrix()
    K[:2, 2] -= 0.5
    pixels = np.argwhere(front)[:, ::-1].astype(np.float64)[:, None]
    vector = np.array(lens.coefficients)
    fisheye = lens.model == "kannala_brandt"
    undistort = cv2.fisheye.undistortPoints if fisheye else cv2.undistortPoints
    plane = undistort(pixels, K, vector)[:, 0]
    p_camera = np.column_stack([plane, np.ones(len(plane))]) * face_m
    moved = p_camera + STEP_S * (np.array([0.6, 0.4, -0.5]) - [-0.3, 0.0, 0.2])

    expected = opencv.project(moved, K, vector, fisheye=fisheye) - pixels[:, 0]
    assert np.abs(seen[Channel.FLOW_FORWARD][front] - expected).max() < 2e-3
    np.testing.assert_allclose(seen[Channel.SCENE_FLOW][front], moved - p_camera, atol=1e-5)


def test_going_there_and_back_leads_to_the_same_pixel(renderer: WarpRenderer) -> None:
    """Where a point is visible at both steps, its backward flow there cancels the forward flow."""
    start = SE3((0.3, 0.1, 3.0))
    box = Body("box", "box", start, instance_id=1)
    scene = world(
        WALL, box, tracks=(even_track("box", start, (-0.7, 0.2, 0.3), 0.6),),
        camera_velocity_m_s=(0.4, 0.1, 0.5), camera_turn_rad_s=-0.2,
    )  # fmt: skip
    now, then = images(renderer, scene), images(renderer, scene_at(scene, scene.time_s + STEP_S))
    flow = now[Channel.FLOW_FORWARD].astype(np.float64)
    place = centres()[..., :2] - 0.5 + flow
    first = np.floor(place).astype(int)
    part = place - first
    seen = now[Channel.FLOW_OCCLUDED_FORWARD] == 0
    seen &= (first >= 0).all(-1) & (first + 1 < [LENS.width_px, LENS.height_px]).all(-1)
    x, y = np.where(seen, first[..., 0], 0), np.where(seen, first[..., 1], 0)
    corners = [(0, 0), (1, 0), (0, 1), (1, 1)]
    # On the same face of the same object, where flow is smooth between pixels.
    depths = np.stack([then[Channel.Z_DEPTH][y + b, x + a] for a, b in corners])
    for a, b in corners:
        seen &= then[Channel.INSTANCE][y + b, x + a] == now[Channel.INSTANCE]
    seen &= np.ptp(depths, axis=0) < 0.02
    back = np.zeros_like(flow)
    for a, b in corners:
        weight = np.abs(1 - a - part[..., 0]) * np.abs(1 - b - part[..., 1])
        back += weight[..., None] * then[Channel.FLOW_BACKWARD][y + b, x + a]

    assert seen.sum() > 3000
    assert np.abs(flow + back)[seen].max() < 0.01


def test_points_are_occluded_where_a_ray_meets_something(renderer: WarpRenderer) -> None:
    """Every pixel's point, traced by a separate ray a step later; edges are a pixel wide."""
    start = SE3((-0.6, 0.0, 3.0))
    box = Body("box", "box", start, instance_id=1)
    scene = world(
        WALL, box, tracks=(even_track("box", start, (4.0, 1.0, 0.0)),),
        camera_velocity_m_s=(-1.0, 0.0, 0.0),
    )  # fmt: skip
    seen = images(renderer, scene)
    later = scene_at(scene, scene.time_s + STEP_S)

    z = seen[Channel.Z_DEPTH].astype(np.float64)
    p = np.einsum("ij,hwj->hwi", np.linalg.inv(LENS.matrix()), centres()) * z[..., None]
    p += scene.cameras[0].T_world_camera.translation_m
    own = seen[Channel.INSTANCE] == 1
    p[own] += STEP_S * np.array([4.0, 1.0, 0.0])
    eye = np.array(later.cameras[0].T_world_camera.translation_m)
    centre = np.array(later.body("box").T_world_body.translation_m)
    way = p - eye
    with np.errstate(divide="ignore"):
        ends = np.stack([(centre - 0.5 - eye) / way, (centre + 0.5 - eye) / way])
    enters, leaves = ends.min(axis=0).max(axis=-1), ends.max(axis=0).min(axis=-1)
    hidden = (enters < leaves) & (enters < 1.0 - 1e-6)
    image = np.einsum("ij,hwj->hwi", LENS.matrix(), way)
    image = image[..., :2] / image[..., 2:]
    hidden |= ((image < 0) | (image >= [LENS.width_px, LENS.height_px])).any(axis=-1)

    found = seen[Channel.FLOW_OCCLUDED_FORWARD] == 1
    edge = cv2.dilate(hidden.astype(np.uint8), np.ones((3, 3))) != cv2.erode(
        hidden.astype(np.uint8), np.ones((3, 3))
    )
    assert hidden.sum() > 500
    assert np.array_equal(found[~edge], hidden[~edge])
    assert (found != hidden).mean() < 0.01


def test_scene_flow_leads_to_where_optical_flow_ends(renderer: WarpRenderer) -> None:
    """The image of p + scene flow is the pixel plus its flow."""
    start = SE3((0.2, 0.0, 2.5))
    box = Body("box", "box", start, instance_id=1)
    scene = world(
        WALL, box, tracks=(even_track("box", start, (1.0, -0.5, 0.7), 1.0),),
        camera_velocity_m_s=(0.0, 0.2, 2.0), camera_turn_rad_s=0.3,
    )  # fmt: skip
    seen = images(renderer, scene)
    z = seen[Channel.Z_DEPTH].astype(np.float64)
    p = np.einsum("ij,hwj->hwi", np.linalg.inv(LENS.matrix()), centres()) * z[..., None]
    image = np.einsum("ij,hwj->hwi", LENS.matrix(), p + seen[Channel.SCENE_FLOW])

    expected = image[..., :2] / image[..., 2:] - centres()[..., :2]
    np.testing.assert_allclose(seen[Channel.FLOW_FORWARD], expected, atol=1e-3)


def test_what_changes_its_shape_flows_with_its_triangles() -> None:
    """A box that is a quarter larger a step later: points of its face move away from the middle."""
    small = box_mesh()
    large = MeshData(
        small.vertices_m * np.float32(1.25), small.faces, small.normals, small.uvs,
        small.face_slots, small.materials,
    )  # fmt: skip
    library = FakeLibrary({**MESHES.meshes, "large": large})
    box = Body("box", "box", SE3((0.0, 0.0, 3.0)), instance_id=1)
    scene = world(box, changes=(StateChange(0.25, "box", asset="large"),))
    seen = images(WarpRenderer(library, "cpu"), scene)

    own = seen[Channel.INSTANCE] == 1
    x = (centres()[..., 0] - 48.0) / 80.0 * 2.5
    expected = 80.0 * 1.25 * x / (3.0 - 0.625) + 48.0 - centres()[..., 0]
    np.testing.assert_allclose(seen[Channel.FLOW_FORWARD][own][:, 0], expected[own], atol=1e-3)
    assert np.abs(seen[Channel.FLOW_BACKWARD][own]).max() < 1e-4


def test_there_is_nothing_to_look_back_on_in_the_first_step(renderer: WarpRenderer) -> None:
    """NaN, and occluded; one step later defined."""
    first = images(renderer, world(WALL, camera_velocity_m_s=(1.0, 0.0, 0.0), time_s=0.0))

    assert np.isnan(first[Channel.FLOW_BACKWARD]).all()
    assert (first[Channel.FLOW_OCCLUDED_BACKWARD] == 1).all()
    second = images(renderer, world(WALL, camera_velocity_m_s=(1.0, 0.0, 0.0), time_s=0.1))
    assert np.isfinite(second[Channel.FLOW_BACKWARD]).all()


@pytest.mark.parametrize("readout_s", [0.08, -0.08])
def test_a_rolling_shutter_changes_the_flow(renderer: WarpRenderer, readout_s: float) -> None:
    """A wall that sinks by c px/s: v' - v = c (step + (v' - v) readout / height)."""
    start = WALL.T_world_body
    speed_px_s = 80.0 * 3.0 / 6.0
    scene = world(
        WALL, tracks=(even_track("wall", start, (0.0, 3.0, 0.0)),), shutter=Shutter(0.0, readout_s)
    )
    flow = images(renderer, scene)[Channel.FLOW_FORWARD]

    expected = speed_px_s * STEP_S / (1.0 - speed_px_s * readout_s / LENS.height_px)
    assert abs(expected - speed_px_s * STEP_S) > 0.15
    # Bands of rows share an instant; bodies move by a quarter of a pixel in them at most.
    np.testing.assert_allclose(flow[..., 1], expected, atol=0.26)
    assert flow[..., 1].mean() == pytest.approx(expected, abs=0.03)
    np.testing.assert_allclose(flow[..., 0], 0.0, atol=1e-4)


def test_a_pixel_that_a_moving_thing_covers_is_occluded(renderer: WarpRenderer) -> None:
    """Before a camera at rest, the wall has no flow: the same pixel of the next image decides."""
    start = SE3((-0.6, 0.0, 3.0))
    box = Body("box", "box", start, instance_id=1)
    scene = world(WALL, box, tracks=(even_track("box", start, (4.0, 1.0, 0.0)),))
    now = images(renderer, scene)
    then = images(renderer, scene_at(scene, scene.time_s + STEP_S))

    wall = (now[Channel.INSTANCE] == 0) & (now[Channel.FLOW_FORWARD] == 0.0).all(axis=-1)
    covered = wall & (then[Channel.INSTANCE] == 1)

    assert covered.sum() > 100
    hidden = now[Channel.FLOW_OCCLUDED_FORWARD] == 1
    np.testing.assert_array_equal(hidden[wall], covered[wall])
