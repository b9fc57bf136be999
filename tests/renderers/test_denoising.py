"""The denoiser: closer to the reference than its input, and a clear error if missing."""

import sys

import numpy as np
import pytest

from gen_data.core.errors import ConfigError
from gen_data.core.scene import Body, Light, Scene
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.fake_library import DARK, MATTE, FakeLibrary, box_mesh, camera_at, room_mesh
from tests.renderers.images import drawn

DENOISED = RenderSettings(tier="pathtraced", samples=4, denoise=True)


@pytest.mark.slow
def test_a_denoised_image_is_closer_to_the_converged_one() -> None:
    """Four samples, with and without denoising, against 256."""
    pytest.importorskip("pyoidn")
    library = FakeLibrary({"room": room_mesh((2, 2, 2), (MATTE,)), "box": box_mesh()})
    bodies = (Body("room", "room"), Body("box", "box", SE3((0.3, 0.4, 0.3)), scale=0.6))
    lamp = Light("lamp", "sphere", (-0.4, 0.0, 1.6), intensity_cd=100.0, radius_m=0.1)
    scene = Scene("t", bodies, lights=(lamp,), environment=DARK)
    camera = camera_at((0.0, -0.9, 1.0), (0.0, 1.0, 0.7), (96, 72), 70.0)

    def radiance(settings: RenderSettings) -> np.ndarray:
        return drawn(scene, camera, library, settings).astype(np.float64)

    truth = radiance(RenderSettings(tier="pathtraced", samples=256))
    noisy = radiance(RenderSettings(tier="pathtraced", samples=4))
    clean = radiance(DENOISED)

    error = [np.abs(image / truth - 1.0).mean() for image in (noisy, clean)]
    assert error[1] < 0.4 * error[0]
    assert clean.mean() == pytest.approx(truth.mean(), rel=0.02)
    assert clean.tobytes() == radiance(DENOISED).tobytes()


def test_without_its_package_the_error_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyoidn", None)

    with pytest.raises(ConfigError, match=r"render\.denoise .*pip install .*\[denoise\]"):
        WarpRenderer(FakeLibrary({}), "cpu", DENOISED)
