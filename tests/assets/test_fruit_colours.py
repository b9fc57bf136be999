"""Colours of fruit, as colorimeters and spectrometers measured them.

CIELAB under D65, converted by OpenCV. Sources: docs/decisions/assets.md.
"""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.content.procedural import TEXTURES
from gen_data.content.procedural.textures.fruit_skins import SKINS, banana_peel
from gen_data.content.procedural.textures.texture_images import color
from gen_data.core.variant_rng import variant_rng

Floats = NDArray[np.float64]

STAGES = {0.15: 98.7, 0.25: 97.3, 0.45: 92.7, 0.6: 89.4, 0.8: 87.5, 1.0: 82.0}
"""Hue [deg] of banana peel at stages R2 to R7 by ripeness (Ringer and Blanke 2021)."""

SPECTRA = {
    "kiwi": (37.5, 7.5, 23.7),
    "peach": (69.5, 11.5, 50.4),
    "carrot": (60.5, 40.8, 53.5),
}
"""L*, a*, b* of the first ground (Vrhel, Gershon and Iwan 1994, CIE 1931, D65)."""


def _lab(image: NDArray[np.uint8]) -> Floats:
    """Pixels of an image [h, w, 3] as L*, a*, b* [h w, 3]."""
    lab: Floats = cv2.cvtColor(image.astype(np.float32) / 255.0, cv2.COLOR_RGB2LAB)
    return lab.reshape(-1, 3).astype(np.float64)


def _peel(ripe: float) -> Floats:
    """Median colour of the middle of an unspotted peel."""
    image = banana_peel(variant_rng("banana_peel", 3), ripe).albedo
    middle: Floats = np.median(_lab(image[230:280]), axis=0)
    return middle


def _skins(family: str, count: int) -> Floats:
    """Pixels of skins, every 97th."""
    images = (TEXTURES[family].build(seed).albedo for seed in range(count))
    return np.concatenate([_lab(image)[::97] for image in images])


@pytest.mark.parametrize(("ripe", "hue_deg"), STAGES.items())
def test_bananas_ripen_through_the_measured_hues(ripe: float, hue_deg: float) -> None:
    _, a, b = _peel(ripe)

    assert np.degrees(np.arctan2(b, a)) == pytest.approx(hue_deg, abs=2.5)


def test_a_banana_that_has_just_turned_has_the_colour_of_its_spectrum() -> None:
    assert np.linalg.norm(_peel(0.35) - (77.6, -4.5, 49.4)) < 5.0


@pytest.mark.parametrize(("kind", "lab"), SPECTRA.items())
def test_first_grounds_are_those_of_spectra(kind: str, lab: tuple[float, float, float]) -> None:
    ground = np.round(np.array(color(SKINS[kind].grounds[0])) * 255.0).astype(np.uint8)

    np.testing.assert_allclose(_lab(ground.reshape(1, 1, 3))[0], lab, atol=0.7)


@pytest.mark.slow
def test_reds_of_apples_are_within_those_of_cultivars() -> None:
    """a* of most cultivars is up to 40, L* 30 to 70 (Polish Academy of Sciences, after storage)."""
    lightness, a, _ = _skins("apple_skin", 50).T

    assert np.quantile(a, 0.99) < 42.0
    assert np.quantile(lightness, 0.02) > 28.0


@pytest.mark.slow
def test_apples_and_oranges_share_only_the_colours_of_ripe_yellow_apples() -> None:
    """Golden Delicious reaches hue 77 and chroma 58 on a shelf; its blush is duller than peel."""
    apples, oranges = _skins("apple_skin", 50), _skins("citrus_peel", 48)

    def is_orange(lab: Floats, hues_deg: tuple[float, float]) -> float:
        hue, chroma = np.degrees(np.arctan2(lab[:, 2], lab[:, 1])), np.hypot(*lab[:, 1:].T)
        return float(((hue > hues_deg[0]) & (hue < hues_deg[1]) & (chroma > 57.0)).mean())

    assert is_orange(oranges, (50.0, 70.0)) > 0.4
    assert is_orange(apples, (50.0, 70.0)) < 0.002
    assert is_orange(apples, (70.0, 85.0)) > 0.001
