"""Lenses that differ from sample to sample."""

import json
import math
from dataclasses import replace
from typing import Any

import pytest

from gen_data.config.distributions import Constant, Uniform
from gen_data.core.errors import ConfigError, LayoutRejected
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Camera, Scene
from gen_data.core.se3 import SE3
from gen_data.randomizers.camera_intrinsics import CameraIntrinsics, Coefficients
from tests.randomizers.doubles import FakeAssets, rng_of

BARREL = Lens("brown_conrady", (-0.2, 0.03, 0.001, 0.0, 0.0, 0.0, 0.0, 0.0))
SCENE = Scene(
    "test",
    cameras=(
        Camera("bent", SE3(), Intrinsics(640, 480, 500.0, 505.0, 322.0, 236.0, BARREL)),
        Camera("straight", SE3(), Intrinsics(640, 480, 500.0, 505.0, 320.0, 240.0)),
    ),
)


def drawn(camera: str = "bent", stream: str = "lens", **given: Any) -> Intrinsics:
    lens = CameraIntrinsics(name="lens", camera=camera, principal_offset_px=Constant(0.0), **given)
    return lens(SCENE, FakeAssets(), rng_of(stream)).camera(camera).intrinsics


def test_coefficients_are_drawn_and_the_others_stay() -> None:
    """Within their ranges; focal lengths and principal point as they were."""
    before = SCENE.camera("bent").intrinsics
    draws = [
        drawn(hfov_deg=None, stream=f"s{i}", lens=Coefficients(k1=Uniform(-0.25, -0.15)))
        for i in range(8)
    ]

    assert len({k.lens.coefficients[0] for k in draws}) == 8
    for k in draws:
        assert -0.25 <= k.lens.coefficients[0] <= -0.15
        assert k.lens.coefficients[1:] == BARREL.coefficients[1:]
        assert replace(k, lens=before.lens) == before


def test_the_field_of_view_is_drawn_through_the_lens() -> None:
    """At the image's left edge, in its middle row, half the angle from the axis."""
    k = drawn(hfov_deg=Constant(64.0))

    # By hand: r = tan(32 deg), r (1 + k1 r^2 + k2 r^4) f = 320.
    r = math.tan(math.radians(32.0))
    assert k.fx_px * (r - 0.2 * r**3 + 0.03 * r**5) == pytest.approx(320.0, abs=1e-3)
    assert k.lens == BARREL


def test_only_the_named_camera_is_drawn() -> None:
    lens = CameraIntrinsics(name="lens", camera="straight", hfov_deg=Constant(50.0))

    scene = lens(SCENE, FakeAssets(), rng_of())

    assert scene.camera("bent") == SCENE.camera("bent")
    assert scene.camera("straight") != SCENE.camera("straight")


def test_a_lens_that_folds_over_is_drawn_again() -> None:
    with pytest.raises(LayoutRejected, match="folds over"):
        drawn(lens=Coefficients(k1=Constant(-0.9), k2=Constant(0.0)))


@pytest.mark.parametrize(("given", "message"), [
    ({"camera": "bend"}, "no camera 'bend'.*did you mean 'bent'"),
    ({"camera": "straight", "lens": Coefficients(k1=Constant(0.1))},
     "camera 'straight' has a lens of the model 'pinhole' with no coefficients, not k1"),
    ({"camera": "straight", "hfov_deg": Uniform(100.0, 200.0)},
     "200 degrees is too wide for the pinhole"),
])  # fmt: skip
def test_what_no_camera_has_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        drawn(**given)


def test_the_principal_point_is_offset_along_each_axis_by_its_own() -> None:
    """2 px to the left, 3.5 px down, from the sensor's centre."""
    given = {"name": "lens", "camera": "bent", "hfov_deg": None, "principal_offset_px": [-2, 3.5]}
    lens = CameraIntrinsics.model_validate_json(json.dumps(given))
    k = lens(SCENE, FakeAssets(), rng_of("lens")).camera("bent").intrinsics

    assert (k.cx_px, k.cy_px) == (320.0, 239.5)
    assert (k.fx_px, k.fy_px) == (500.0, 505.0)


@pytest.mark.parametrize(
    ("value", "found"),
    [(3.3, Constant(3.3)), ([-1.3, {"uniform": [3, 4]}], (Constant(-1.3), Uniform(3.0, 4.0)))],
)
def test_offsets_are_read_as_one_or_as_two(value: Any, found: Any) -> None:
    given = {"name": "lens", "principal_offset_px": value}
    assert CameraIntrinsics.model_validate_json(json.dumps(given)).principal_offset_px == found
