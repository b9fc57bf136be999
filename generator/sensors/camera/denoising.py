"""In-camera noise reduction: non-local means of luma and of coarser chroma, in units of the noise.

Photon noise grows with the signal; Anscombe's transform makes its standard deviation 1 everywhere
(with read noise: Foi et al., "Practical Poissonian-Gaussian noise modeling and fitting for
single-image raw-data", 2008). There one strength of non-local means suits lights and shadows
(Buades, Coll and Morel, "A non-local algorithm for image denoising", 2005). As in cameras, chroma
is filtered at half the resolution and more strongly than luma: blotches of colour disturb more
than grain, and eyes resolve less colour.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import Float32
from gen_data.core.colorimetry import MIDDLE_GREY, REC709_LUMINANCE

VISIBLE_NOISE = 0.05
"""Noise over signal at middle grey below which cameras leave pictures alone (assumed)."""
_STEPS = 16.0
"""Integers per standard deviation: integer sums are the same on all processors."""
_TEMPLATE_PX, _SEARCH_PX = 5, 9
# Mean differences of patches with equal content are 1.13 standard deviations; demosaicing lowers
# luma's to about 0.7, white balance and colour matrix raise chroma's.
_LUMA, _CHROMA = 1.1, 2.2


def is_noisy(white_e: float) -> bool:
    """Whether middle grey shows photon noise, if this many electrons are white."""
    return white_e * MIDDLE_GREY * VISIBLE_NOISE**2 < 1.0


def denoise(image: Float32, white_e: float, read_noise_e: float, strength: float) -> Float32:
    """Reduce the noise of a demosaiced, linear image, float32 [h, w, 3] with 1 = white.

    Args:
        image: Values of any range.
        white_e: Electrons of a white pixel.
        read_noise_e: Standard deviation of the read noise [electrons].
        strength: 1 averages pixels that differ by no more than noise.
    """
    stable = _stabilize(image, white_e, read_noise_e)
    luma = cv2.transform(stable, REC709_LUMINANCE[None])
    chroma = stable - luma[..., None]
    height, width = luma.shape
    half = cv2.resize(chroma, (-(-width // 2), -(-height // 2)), interpolation=cv2.INTER_AREA)
    chroma = cv2.resize(_average_alike(half, _CHROMA * strength), (width, height))
    chroma += _average_alike(luma, _LUMA * strength)[..., None]
    return _linearize(chroma, white_e, read_noise_e)


def _stabilize(image: Float32, white_e: float, read_noise_e: float) -> Float32:
    """Values whose noise has a standard deviation of 1 everywhere (generalised Anscombe)."""
    offset = np.float32(0.375 + read_noise_e**2)
    stable: Float32 = np.maximum(image * np.float32(white_e) + offset, np.float32(0.0))
    np.sqrt(stable, out=stable)
    stable *= np.float32(2.0)
    return stable


def _linearize(stable: Float32, white_e: float, read_noise_e: float) -> Float32:
    """Inverse of ``_stabilize`` for means, asymptotically unbiased; negative values become 0."""
    electrons = 0.25 * np.maximum(stable, 0.0) ** 2 - (0.125 + read_noise_e**2)
    return np.asarray(np.maximum(electrons, 0.0) / white_e, np.float32)


def _average_alike(values: Float32, strength: float) -> Float32:
    """Non-local means of values with noise of standard deviation 1, [h, w] or [h, w, 3]."""
    low = float(values.min())
    steps: NDArray[np.uint16] = np.rint((values - low) * _STEPS).clip(0, 65_535).astype(np.uint16)
    mean = cv2.fastNlMeansDenoising(
        steps, [strength * _STEPS], None, _TEMPLATE_PX, _SEARCH_PX, cv2.NORM_L1
    )
    return np.asarray(mean / np.float32(_STEPS) + np.float32(low), np.float32)
