"""Places, aims and lenses of cameras."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.config.distributions import Constant, Uniform
from gen_data.core import errors, intrinsics, se3
from gen_data.core.scene import Body, Camera, Region, Scene
from gen_data.randomizers import camera_intrinsics, camera_pose
from gen_data.randomizers.exposure import Exposure
from tests.randomizers.doubles import FakeAssets, rng_of

FOCUS = Region((0.3, -0.2, 0.8), (1.2, 0.8, 0.25))
LENS = intrinsics.Intrinsics.from_hfov(640, 480, math.radians(60.0))
SCENE = Scene(
    "test",
    focus=FOCUS,
    interior_m=((-2.3, -1.8, 0.1), (2.3, 1.8, 2.6)),
    cameras=(Camera("left", se3.SE3(), LENS), Camera("right", se3.SE3(), LENS)),
)


def orbit(scene: Scene = SCENE, scene_index: int = 0, **given: object) -> Scene:
    pose = camera_pose.CameraPose(name="orbit", **given)  # type: ignore[arg-type]
    return pose(scene, FakeAssets(), rng_of("orbit", scene_index, index=scene_index))


def away_m(camera: Camera) -> np.ndarray:
    """From the focus to the camera's centre, world [m]."""
    return np.subtract(camera.T_world_camera.translation_m, FOCUS.center_m)


def test_camera_orbits_at_the_distance_and_angles_that_were_asked_for() -> None:
    """Exact to the rounding of poses, one micrometre."""
    scene = orbit(distance_m=Constant(1.1), azimuth_deg=Constant(130.0),
                  elevation_deg=Constant(37.0), jitter_m=Constant(0.0))  # fmt: skip
    for camera in scene.cameras:
        x, y, z = away_m(camera)

        assert math.sqrt(x * x + y * y + z * z) == pytest.approx(1.1, abs=2e-6)
        assert math.degrees(math.atan2(y, x)) == pytest.approx(130.0, abs=2e-4)
        assert math.degrees(math.asin(z / 1.1)) == pytest.approx(37.0, abs=2e-4)


def test_camera_without_jitter_sees_the_focus_at_its_principal_point() -> None:
    """Through the projection, whatever the roll."""
    for scene_index in range(10):
        camera = orbit(scene_index=scene_index, jitter_m=Constant(0.0)).cameras[0]
        seen = LENS.project(camera.T_world_camera.inverse().apply(np.array(FOCUS.center_m)))

        assert seen == pytest.approx((320.0, 240.0), abs=1e-2)


def test_jitter_moves_what_is_looked_at_and_no_farther() -> None:
    """The optical axis passes the focus within the jitter along each axis, and not through it."""
    missed_m = []
    for scene_index in range(30):
        camera = orbit(scene_index=scene_index, jitter_m=Constant(0.08)).cameras[0]
        axis = camera.T_world_camera.rotate(np.array([0.0, 0.0, 1.0]))
        missed_m.append(float(np.linalg.norm(np.cross(axis, away_m(camera)))))

    assert min(missed_m) > 0.0
    assert 0.02 < max(missed_m) < 0.08 * math.sqrt(3.0)


def test_horizon_leans_by_the_roll() -> None:
    """The camera's X axis is level without roll, and leans by as much otherwise."""
    for roll_deg in (0.0, -7.0, 12.0):
        camera = orbit(roll_deg=Constant(roll_deg), elevation_deg=Constant(0.0)).cameras[0]
        right = camera.T_world_camera.rotate(np.array([1.0, 0.0, 0.0]))

        assert math.degrees(math.asin(-right[2])) == pytest.approx(roll_deg, abs=1e-3)


def test_camera_is_never_in_a_body_or_beyond_the_walls() -> None:
    """Boxes turned any way around the focus; the camera keeps 12 cm from each."""
    turned = se3.SE3.about_z(0.6)
    bodies = tuple(
        Body(f"box{k}", "room?size_m=1.1,0.9,1.4", place @ turned, instance_id=k + 1)
        for k, place in enumerate((se3.SE3((1.3, 0.3, 0.5)), se3.SE3((-0.8, -0.4, 0.7))))
    )
    scene = replace(SCENE, bodies=bodies)
    for scene_index in range(60):
        moved = orbit(scene, scene_index, distance_m=Uniform(0.5, 1.6), clearance_m=0.12)
        for camera in moved.cameras:
            eye = np.array(camera.T_world_camera.translation_m)

            assert (eye >= SCENE.interior_m[0]).all()
            assert (eye <= SCENE.interior_m[1]).all()
            for body in bodies:
                local = body.T_world_body.inverse().apply(eye) - (0.0, 0.0, 0.7)
                assert (np.abs(local) - (0.55, 0.45, 0.7)).max() >= 0.12 - 1e-6


def test_no_place_for_a_camera_is_told_with_a_remedy() -> None:
    """Nine metres away is outside of any room of five."""
    with pytest.raises(errors.LayoutRejected) as refused:
        orbit(distance_m=Constant(9.0))
    assert "randomizers.orbit" in refused.value.rejection.remedy


def test_one_of_several_cameras_can_be_moved_alone_and_each_is_drawn_for_itself() -> None:
    """The others stay where they are. In a room, which counts as no body."""
    room = replace(SCENE, bodies=(Body("room", "room?size_m=5,4,2.8"),))
    scene = orbit(room, camera="right")
    left, right = orbit(room).cameras

    assert scene.camera("left") == SCENE.camera("left")
    assert scene.camera("right") != SCENE.camera("right")
    assert left.T_world_camera != right.T_world_camera


def test_lens_has_the_field_of_view_and_offset_that_were_asked_for() -> None:
    """tan(hfov / 2) = W / 2f; square pixels; the image size stays."""
    lens = camera_intrinsics.CameraIntrinsics(
        name="lens", hfov_deg=Constant(47.0), principal_offset_px=Constant(-4.5)
    )
    for camera in lens(SCENE, FakeAssets(), rng_of()).cameras:
        k = camera.intrinsics

        assert 2 * math.degrees(math.atan(320.0 / k.fx_px)) == pytest.approx(47.0, abs=1e-6)
        assert (k.fx_px, k.cx_px, k.cy_px) == (k.fy_px, 315.5, 235.5)
        assert (k.width_px, k.height_px) == (640, 480)


def test_exposure_is_fixed_within_its_range() -> None:
    """Automatic before, one value per camera after."""
    scene = Exposure(name="shutter", ev100=Uniform(5.0, 9.0))(SCENE, FakeAssets(), rng_of())

    assert SCENE.cameras[0].ev100 is None
    assert all(camera.ev100 is not None and 5.0 <= camera.ev100 <= 9.0 for camera in scene.cameras)
