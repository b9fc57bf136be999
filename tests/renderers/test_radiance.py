"""Radiance: anti-aliasing, environment and ambient occlusion."""

import numpy as np
import pytest

from gen_data.core.asset_types import Material
from gen_data.core.capture import Channel
from gen_data.core.scene import Body, Camera, Environment, Light, Scene
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.realtime.realtime_shading import pixel_samples
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.fake_library import (
    DARK,
    MATTE,
    FakeLibrary,
    box_mesh,
    camera_at,
    forward_camera,
    plane_mesh,
    sphere_mesh,
)
from tests.renderers.images import OPEN, drawn, seen

LIBRARY = FakeLibrary({"plane": plane_mesh(100.0), "box": box_mesh(), "ball": sphere_mesh(0.5)})


def radiance_of(scene: Scene, camera: Camera, settings: RenderSettings | None = None) -> np.ndarray:
    return drawn(scene, camera, LIBRARY, settings or RenderSettings())


def glowing(pose: SE3, asset: str = "box", scale: float = 1.0, emission: float = 100.0) -> Body:
    material = Material((0.0, 0.0, 0.0), 1.0, specular=0.0, emission_cd_m2=(emission,) * 3)
    return Body("glow", asset, pose, scale, materials=(material,))


@pytest.mark.parametrize(("share", "settings", "shown"), [
    (0.25, {"antialias": 1}, 0.0), (0.25, {"visibility": "raster"}, 75.0),
    (0.25, {"visibility": "rays"}, 75.0), *((0.5, {"antialias": k}, 150.0) for k in (2, 4, 8)),
])  # fmt: skip
def test_an_edge_is_as_grey_as_it_is_covered(
    share: float, settings: dict[str, object], shown: float
) -> None:
    """A share of a pixel on a glowing box of 300 cd/m^2 in front of black."""
    left_m = (23.0 - share - 32.0) / 50.0 * 2.0
    scene = Scene("t", (glowing(SE3((left_m + 0.5, 0.0, 2.5)), emission=300.0),), environment=DARK)

    row = radiance_of(scene, forward_camera(), RenderSettings.model_validate(settings))[24]

    np.testing.assert_allclose(row[20:25, 0], [0.0, 0.0, shown, 300.0, 300.0], rtol=1e-5)


def test_anti_aliasing_does_not_touch_labels() -> None:
    """Ids and depth belong to pixel centres, with or without it."""
    scene = Scene("t", (Body("b", "ball", SE3((0.1, 0.0, 2.0)), instance_id=3),))
    wanted = (Channel.RADIANCE, Channel.INSTANCE, Channel.Z_DEPTH)
    images = [
        seen(scene, forward_camera(), LIBRARY, *wanted, settings=RenderSettings(antialias=n))
        for n in (1, 8)
    ]

    for channel in (Channel.INSTANCE, Channel.Z_DEPTH):
        np.testing.assert_array_equal(images[0][channel], images[1][channel])
    assert (images[0][Channel.RADIANCE] != images[1][Channel.RADIANCE]).any()


@pytest.mark.parametrize("n", [2, 4, 8])
def test_parts_of_a_pixel_share_no_row_and_no_column(n: int) -> None:
    """Nearly upright and nearly level edges get n + 1 shades."""
    parts = pixel_samples(n)

    for axis in range(2):
        assert sorted(parts[:, axis]) == [(k + 0.5) / n for k in range(n)]
    assert not np.allclose(parts[:, 0], parts[:, 1])


def test_nothing_shows_the_environment_or_black() -> None:
    """Pixels without a body show the sky's image if it is visible."""
    shown = Scene("t", environment=Environment(luminance_cd_m2=300.0))
    hidden = Scene("t", environment=Environment(luminance_cd_m2=300.0, visible=False))

    np.testing.assert_allclose(radiance_of(shown, forward_camera()), 300.0, rtol=1e-5)
    assert not radiance_of(hidden, forward_camera()).any()
    assert not radiance_of(Scene("t", environment=DARK), forward_camera()).any()


def test_radiance_grows_with_the_light() -> None:
    """Ten times the light gives ten times the radiance, on edges too."""
    bodies = (Body("plane", "plane"), Body("ball", "ball", SE3((0.2, 0.1, 0.5))))
    camera = camera_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), (64, 48))
    one, ten = (
        radiance_of(
            Scene(
                "t",
                bodies,
                lights=(Light("lamp", "sphere", (1.0, 1.0, 3.0), intensity_cd=400.0 * k),),
                environment=Environment(luminance_cd_m2=20.0 * k),
            ),
            camera,
        )
        for k in (1.0, 10.0)
    )
    np.testing.assert_allclose(ten, 10.0 * one, rtol=1e-3)
    assert one.min() > 0.0


def test_a_corner_is_darker_than_the_open_floor() -> None:
    """Ambient occlusion: at the foot of a wall half of the sky is hidden, far from it none."""
    bodies = (
        Body("floor", "plane", materials=(MATTE,)),
        Body("wall", "box", SE3((0.0, 1.0, 0.5)), materials=(MATTE,)),
    )
    scene = Scene("t", bodies, environment=Environment(luminance_cd_m2=300.0))
    camera = camera_at((0.0, 0.0, 3.0), (0.0, 0.01, 0.0), (24, 384), hfov_deg=1.6)

    shaded = radiance_of(scene, camera)[:, 12, 1]
    plain = radiance_of(scene, camera, OPEN)[:, 12, 1]

    # 286 px to the metre: the wall begins 143 px above the centre, row 192.
    foot = 192 - 143 + 4
    assert shaded[foot] < 0.8 * plain[foot]
    np.testing.assert_allclose(shaded[192:], plain[192:], rtol=0.01)
    assert (np.diff(shaded[foot:192]) >= -0.01 * plain[foot]).all()
