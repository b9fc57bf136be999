"""Prints are on the outside of sheets: through a rear window nobody reads mirror writing."""

from typing import Literal

import numpy as np
import pytest

from gen_data.core.asset_types import Material, TextureData
from gen_data.core.scene import Body, Environment, Scene
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.fake_library import FakeLibrary, camera_at, plane_mesh
from tests.renderers.images import drawn

LIGHT = Environment(luminance_cd_m2=100.0)


def halves(tier: Literal["realtime", "pathtraced"], role: str, eye_z_m: float) -> np.ndarray:
    """Luminance of the sheet's halves at x < 0, grey, and x > 0, white, seen from a height."""
    pixels = np.full((8, 8, 3), 255, np.uint8)
    pixels[:, :4] = 90
    sheet = Material((1.0, 1.0, 1.0), 1.0, specular=0.0, texture="print", printed=True, role=role)
    library = FakeLibrary({"sheet": plane_mesh(2.0, (sheet,))}, {"print": TextureData(pixels)})
    settings = RenderSettings(ambient_occlusion_radius_m=0.0, tier=tier, samples=16)
    camera = camera_at((0.0, -0.01, eye_z_m), (0.0, 0.0, 0.0))
    scene = Scene("t", (Body("sheet", "sheet"),), environment=LIGHT)
    image = drawn(scene, camera, library, settings)[..., 1]
    # Both cameras have +x on the right.
    return np.array([float(image[24, 20]), float(image[24, 43])])


@pytest.mark.parametrize("tier", ["realtime", "pathtraced"])
@pytest.mark.parametrize("role", ["paint", "plate", "sign"])
def test_the_back_of_a_print_is_its_mean(
    tier: Literal["realtime", "pathtraced"], role: str
) -> None:
    """In uniform light: sRGB 90 is linear 0.1022 (IEC 61966-2-1), the mean with white 0.5511."""
    assert halves(tier, role, 2.0) == pytest.approx([10.2, 100.0], rel=0.05)
    assert halves(tier, role, -2.0) == pytest.approx([55.1, 55.1], rel=0.05)


def test_other_sheets_have_their_texture_on_both_sides() -> None:
    """Meshes of users may face inwards: without such a role nothing is taken away."""
    assert halves("realtime", "", -2.0) == pytest.approx([10.2, 100.0], rel=0.05)
