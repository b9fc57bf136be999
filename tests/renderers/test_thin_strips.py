"""Light on strips that are narrower than the distance of lattice points, and at rims."""

import math

import numpy as np
import pytest
import warp as wp

from gen_data.core.asset_types import Material
from gen_data.core.capture import Channel
from gen_data.core.interfaces import FindTones, Tones
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Body, Camera, Environment, Light, Scene
from gen_data.core.se3 import SE3, Vec3, look_at
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.renderer import Images, WarpRenderer
from gen_data.renderers.warp.scene.kernels.ambient_light import interreflected_share
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.fake_library import DARK, MATTE, FakeLibrary, box_mesh, plane_mesh

CHANNELS = frozenset({Channel.RADIANCE, Channel.Z_DEPTH, Channel.NORMALS, Channel.INSTANCE})


def render(scene: Scene, camera: Camera, library: FakeLibrary, radius_m: float) -> Images:
    settings = RenderSettings(ambient_occlusion_radius_m=radius_m, antialias=1)
    return WarpRenderer(library, "cpu", settings).render(scene, camera, CHANNELS).channels


def camera_rolled(eye_m: Vec3, target_m: Vec3, roll_deg: float) -> Camera:
    """A camera in which level edges cross rows of pixels."""
    lens = Intrinsics.from_hfov(240, 120, math.radians(50.0))
    return Camera("camera", look_at(eye_m, target_m, math.radians(roll_deg)), lens)


def points_m(camera: Camera, depth: np.ndarray) -> np.ndarray:
    """World points of pixel centres, [h, w, 3]."""
    k = camera.intrinsics
    v, u = np.mgrid[: k.height_px, : k.width_px] + 0.5
    ways = np.stack([(u - k.cx_px) / k.fx_px, (v - k.cy_px) / k.fy_px, np.ones_like(u)], axis=-1)
    return camera.T_world_camera.apply((ways * depth[..., None]).reshape(-1, 3)).reshape(ways.shape)


@pytest.mark.parametrize("roll_deg", [0.0, 3.0])
def test_light_that_falls_towards_a_rim_falls_evenly(roll_deg: float) -> None:
    """I cos / d^2 in the last rows before the far rim of a floor; there it falls by the row."""
    lamp = Light("lamp", "sphere", (0.0, 0.0, 0.5), intensity_cd=800.0, radius_m=0.02)
    scene = Scene("t", (Body("p", "plane", instance_id=1),), lights=(lamp,), environment=DARK)
    camera = camera_rolled((-2.0, 0.0, 0.5), (2.0, 0.0, 0.0), roll_deg)

    images = render(scene, camera, FakeLibrary({"plane": plane_mesh(4.0, (MATTE,))}), 0.0)

    seen = images[Channel.INSTANCE] > 0
    p = points_m(camera, np.where(seen, images[Channel.Z_DEPTH], 0.0))
    d2 = ((p - np.array(lamp.position_m)) ** 2).sum(axis=-1)
    expected = 800.0 * 0.5 / d2**1.5 * 0.5 / math.pi
    near_rim = seen & (np.roll(seen, 3, axis=0) != seen)
    error = np.abs(images[Channel.RADIANCE][..., 1] / expected - 1.0)[near_rim]
    assert near_rim.sum() > 150
    assert error.max() < 0.2


@pytest.mark.parametrize("roll_deg", [0.0, 2.0, -5.0, 20.0])
@pytest.mark.parametrize(("high_m", "high_px"), [(0.014, 3), (0.06, 7)])
def test_a_strip_of_few_pixels_is_evenly_lit(roll_deg: float, high_m: float, high_px: int) -> None:
    """The front of a board on a floor, under an even sky: no column differs from the others."""
    size_m = (1.0, 6.0, high_m)
    library = FakeLibrary(
        {"plane": plane_mesh(20.0, (MATTE,)), "board": box_mesh(size_m, (MATTE,))}
    )
    board = Body("b", "board", SE3((0.5, 0.0, 0.5 * high_m)), instance_id=1)
    sky = Environment(luminance_cd_m2=100.0, visible=False)
    scene = Scene("t", (Body("p", "plane"), board), environment=sky)
    camera = camera_rolled((-2.5, 0.0, 0.6), (0.0, 0.0, 0.0), roll_deg)

    images = render(scene, camera, library, 0.25)

    normals = images[Channel.NORMALS] @ camera.T_world_camera.rotation().T
    front = (images[Channel.INSTANCE] == 1) & (normals[..., 0] < -0.9)
    light = images[Channel.RADIANCE][..., 1]
    tall = front.sum(axis=0)
    columns = np.where(front, light, 0.0).sum(axis=0)[tall > 0] / tall[tall > 0]
    assert front.sum() > 100
    assert tall.max() <= high_px
    assert columns.std() / columns.mean() < 0.05
    if high_px <= 3:
        assert light[front].std() / light[front].mean() < 0.05


@wp.kernel
def share_kernel(shares: wp.array[float], results: wp.array[float]) -> None:
    """Evaluate ``interreflected_share``."""
    i = wp.tid()
    results[i] = interreflected_share(shares[i])


def test_the_corner_of_a_room_has_the_light_of_radiosity() -> None:
    """Two walls of albedo 0.6 that hide half of the room from each other: E = 0.5 + 0.5 * 0.6 E."""
    device = open_device("cpu")
    shares = wp.array([0.0, 0.5, 1.0], dtype=float, device=device)
    results = wp.zeros(3, dtype=float, device=device)

    wp.launch(share_kernel, 3, [shares], [results], device=device)

    assert results.numpy() == pytest.approx([0.0, 0.5 / (1.0 - 0.5 * 0.6), 1.0], abs=0.02)


RIM_PX = 0.4
RIM_M = RIM_PX * 2.0 / Intrinsics.from_hfov(240, 120, math.radians(50.0)).fx_px
RADIANCE = frozenset({Channel.RADIANCE})


def rim_library() -> FakeLibrary:
    """A glowing rim of RIM_PX pixels, as ``rim_camera`` sees it, and a board."""
    glow = Material((0.0, 0.0, 0.0), 1.0, specular=0.0, emission_cd_m2=(100.0,) * 3)
    return FakeLibrary(
        {"rim": box_mesh((0.1, 9.0, RIM_M), (glow,)), "board": box_mesh((0.1, 9.0, 0.4), (MATTE,))}
    )


def rim_camera() -> Camera:
    """The rim rises by a row in 20 columns."""
    return camera_rolled((-2.05, 0.0, 0.0), (0.0, 0.0, 0.0), math.degrees(1.0 / 20.0))


def board(name: str, z_m: float) -> Body:
    """A board whose rim towards z = 0 is half a rim away from it, above or below."""
    return Body(name, "board", SE3((0.0, 0.0, z_m + math.copysign(0.5 * RIM_M, z_m))))


def test_the_rim_of_a_board_is_seen_between_pixel_centres_by_cameras_with_many_photosites() -> None:
    """A glowing rim of 0.4 px that rises by a row in 20 columns: each has 0.4 of its light."""
    scene = Scene("t", (board("b", -0.2), Body("r", "rim", instance_id=2)), environment=DARK)
    renderer = WarpRenderer(rim_library(), "cpu", RenderSettings(antialias=8))

    def columns(find_tones: FindTones | None) -> np.ndarray:
        reading = renderer.render(scene, rim_camera(), RADIANCE, find_tones)
        return reading.channels[Channel.RADIANCE][..., 1].sum(axis=0)[20:-20] / 100.0

    # Far below white, the mean of tones is the mean of radiance.
    seen = columns(lambda _: Tones(1e6, 1e6))

    assert seen.mean() == pytest.approx(RIM_PX, rel=0.05)
    assert seen.std() < 0.12
    assert columns(None).std() > 0.2


def test_a_gap_between_boards_does_not_show_what_an_earlier_picture_had_there() -> None:
    """The sky in a gap that no pixel centre shows: light of a rim there must not be left over."""
    glowing = Scene("t", (board("b", -0.2), Body("r", "rim")), environment=DARK)
    gap = Scene("t", (board("b", -0.2), board("c", 0.2)), environment=DARK)
    used, fresh = (WarpRenderer(rim_library(), "cpu", RenderSettings(antialias=8)) for _ in "ab")

    def radiance(renderer: WarpRenderer, scene: Scene) -> np.ndarray:
        reading = renderer.render(scene, rim_camera(), RADIANCE, lambda _: Tones(1e6, 1e6))
        return reading.channels[Channel.RADIANCE]

    assert radiance(used, glowing).max() > 10.0

    np.testing.assert_array_equal(radiance(used, gap), radiance(fresh, gap))
