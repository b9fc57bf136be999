"""Local tone mapping: bright and dark parts of one picture are both shown."""

import numpy as np
import pytest

from gen_data.core.streams import Streams
from gen_data.sensors.camera.isp import display_values
from gen_data.sensors.camera.local_tone import fuse_exposures

WHITE = 16.0


def patches(levels: np.ndarray, side_px: int = 64) -> np.ndarray:
    """Grey patches of these linear values, float32 [h, w, 3]."""
    rows = np.kron(levels, np.ones((side_px, side_px)))
    return np.repeat(rows[..., None], 3, axis=-1).astype(np.float32)


def bytes_of(image: np.ndarray, contrast: float = 1.0) -> np.ndarray:
    return 255.0 * fuse_exposures(image, 1.0, WHITE, contrast)


@pytest.mark.parametrize("level", [0.02, 0.1, 0.4])
def test_an_even_picture_has_the_tone_of_its_brighter_exposure(level: float) -> None:
    """The knee of 1.3 times the value; nothing is near to being white."""
    shown = fuse_exposures(patches(np.array([[level]])), 1.0, WHITE, 1.2)

    expected = float(display_values(np.array(1.3 * level), "knee", contrast=1.2))
    assert shown == pytest.approx(expected, abs=0.004)


def test_a_window_shows_what_is_outside_and_the_room_stays_as_bright() -> None:
    """Two patches outdoors of 5 and 8 times white would both be white under the curve alone."""
    levels = np.full((5, 5), 0.15)
    levels[1:3, 2:4] = [[5.0, 8.0], [8.0, 5.0]]
    image = patches(levels)

    shown = bytes_of(image)[..., 1]
    plain = 255.0 * display_values(1.3 * image.astype(np.float64), "knee")[..., 1]
    outside = np.s_[80:176, 144:240]
    corner = np.s_[260:, :60]

    assert plain[outside].min() > 254.0
    assert np.percentile(shown[outside], 90) - np.percentile(shown[outside], 10) > 5.0
    assert shown[outside].min() > shown[corner].max()
    assert shown[corner] == pytest.approx(plain[corner], abs=4.0)


def test_a_lit_wall_stays_brighter_than_one_in_shade() -> None:
    """Wide patches that rise by factors of 1.5 up to the brightest do not become darker."""
    levels = 0.05 * 1.5 ** np.arange(9)
    middles = bytes_of(patches(levels[None], 128))[64, 64::128, 1]

    assert (np.diff(middles) > 0.0).all()


def test_grey_stays_grey_and_colours_keep_their_order() -> None:
    """Noise of any brightness and a size that no power of two divides; and a single pixel."""
    rng = Streams(seed=3, scene=0).rng("image")
    image = (rng.uniform(0.0, 2.5, (37, 61, 3)) ** 3).astype(np.float32)
    grey = np.repeat(image[..., :1], 3, axis=-1)

    assert np.ptp(fuse_exposures(grey, 1.0, WHITE, 1.3), axis=-1).max() == 0.0
    shown = fuse_exposures(image, 1.0, WHITE, 1.3)
    assert shown.min() >= 0.0
    assert shown.max() <= 1.0
    ordered = np.take_along_axis(shown, np.argsort(image), axis=-1)
    assert (np.diff(ordered, axis=-1) >= 0.0).all()

    assert fuse_exposures(patches(np.array([[0.1]]), 1), 1.0, WHITE, 1.0).shape == (1, 1, 3)
