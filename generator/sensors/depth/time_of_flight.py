"""Continuous-wave time of flight, as in the second Kinect: depth from the phase of modulated light.

* **Phase**: four samples a quarter period apart, with the noise of the electrons they count
  (Lange and Seitz, "Solid-state time-of-flight range camera", IEEE JQE 2001):
  ``sigma = L / (2 pi) * sqrt(samples' variance / 2) / amplitude``, L the unambiguous range.
* **Flying pixels**: surfaces in a pixel's footprint add up as phasors.
* **Wrap-around**: distances are ambiguous modulo ``c / (2 f)``; several frequencies extend this to
  the range of their greatest common divisor, by the wrap count on which they agree best (as in
  Jaremo
  Lawin et al., "Efficient multi-frequency phase unwrapping using kernel density estimation", ECCV
  2016, without their spatial propagation). Disagreement leaves a hole.
* **Multi-path**: light by way of nearby surfaces, added as one low-passed bounce, after Fuchs,
  "Multipath Interference Compensation in Time-of-Flight Camera Images", ICPR 2010: proportional to
  the surface's reflectance, with a longer path.
* **Holes** where too little light returns and where pixels overflow.
"""

import math
from typing import Annotated, Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.core.asset_types import Float32
from gen_data.core.streams import Rng
from gen_data.sensors.depth.view import Hits, Measured, View

LIGHT_M_S = 299_792_458.0
SUBRAYS = 7
"""Rays that sample a pixel's footprint."""
TURN = 2.0 * math.pi

Complex = NDArray[np.complex64]
Frequency = Annotated[int, Field(ge=1, le=1000)]


class TimeOfFlight(Strict):
    """Continuous-wave time of flight.

    Attributes:
        modulation_mhz: Modulation frequencies, the highest last.
        electrons: Amplitude of a white matte surface, square on, at 1 m.
        contrast: Amplitude over offset of a correlation.
        ambient: Electrons per sample by ambient light.
        read_noise: Standard deviation of the read noise of a sample [electrons].
        full_well: Larger samples are saturated [electrons].
        least: Smaller amplitudes are holes [electrons].
        disagreement_rad: Largest root mean square disagreement of phases; more leaves a hole.
        bounce: Share of the surrounding light that a white surface receives indirectly.
        bounce_deg: Extent of the surroundings, as a standard deviation.
        flying: Whether pixels have a footprint; costs seven rays instead of one.
    """

    kind: Literal["time_of_flight"]
    modulation_mhz: tuple[Frequency, ...] = Field((16, 80, 120), min_length=1, max_length=8)
    electrons: float = Field(30_000.0, gt=0)
    contrast: float = Field(0.6, gt=0, le=1)
    ambient: float = Field(200.0, ge=0)
    read_noise: float = Field(20.0, ge=0)
    full_well: float = Field(500_000.0, gt=0)
    least: float = Field(60.0, ge=0)
    disagreement_rad: float = Field(0.6, gt=0)
    bounce: float = Field(0.04, ge=0, le=1)
    bounce_deg: float = Field(2.5, gt=0, le=30)
    flying: bool = True

    @property
    def ambiguity_m(self) -> float:
        """Unambiguous range: distances are known modulo this."""
        return LIGHT_M_S / (2e6 * math.gcd(*self.modulation_mhz))

    def measure(self, view: View, rng: Rng) -> Measured:
        """Measure the depth and infrared images of a view."""
        hits = view.trace(subrays=SUBRAYS if self.flying else 1)
        sigma_px = view.focal_px * math.radians(self.bounce_deg)
        phases, amplitude = [], np.zeros(hits.range_m.shape[:2], np.float32)
        ok = np.ones(amplitude.shape, bool)
        for mhz in self.modulation_mhz:
            phasor = self._phasor(hits, mhz, sigma_px, view.focal_px)
            samples = self._samples(phasor, rng)
            ok &= samples.max(axis=0) < self.full_well
            cosine, sine = samples[0] - samples[2], samples[3] - samples[1]
            phases.append(np.arctan2(sine, cosine) % np.float32(TURN))
            amplitude += 0.5 * np.hypot(cosine, sine) / len(self.modulation_mhz)
        range_m, disagreement = unwrap_phases(np.stack(phases), self.modulation_mhz)
        ok &= (amplitude >= self.least) & (disagreement <= self.disagreement_rad)
        forward = view.camera.intrinsics.pixel_rays()[..., 2].astype(np.float32)
        z_m = np.where(ok, range_m * forward, np.float32(np.inf))
        infrared = np.rint(np.clip(amplitude, 0, 65_535)).astype(np.uint16)
        return Measured(np.asarray(z_m, np.float32), infrared)

    def _phasor(self, hits: Hits, mhz: int, sigma_px: float, focal_px: float) -> Complex:
        """Amplitude [electrons] and phase of the light on each pixel, complex64 [h, w]."""
        there = np.isfinite(hits.range_m)
        range_m = np.where(there, hits.range_m, np.float32(1.0))
        strength = np.float32(self.electrons) * hits.reflectance / np.square(range_m)
        strength = np.where(there, strength, np.float32(0.0))
        per_m = _phase_per_m(mhz)
        direct = (strength * np.exp(1j * per_m * range_m)).mean(axis=-1)
        if self.bounce == 0.0:
            return np.asarray(direct, np.complex64)
        # Light that reaches the surroundings has half of the phase of its echo.
        half = (strength * np.exp(0.5j * per_m * range_m)).mean(axis=-1)
        around = _low_pass(half.real, sigma_px) + 1j * _low_pass(half.imag, sigma_px)
        near_m = range_m.min(axis=-1)
        reflectance = hits.reflectance.mean(axis=-1)
        detour_m = near_m * np.float32(1.0 + sigma_px / focal_px)
        bounced = self.bounce * reflectance * around * np.exp(0.5j * per_m * detour_m)
        return np.asarray(direct + bounced, np.complex64)

    def _samples(self, phasor: Complex, rng: Rng) -> Float32:
        """Electrons of the four correlations, float32 [4, h, w]."""
        offset = np.abs(phasor) / np.float32(self.contrast) + np.float32(self.ambient)
        waves = np.stack([phasor.real, -phasor.imag, -phasor.real, phasor.imag])
        electrons = np.maximum(offset + waves, 0.0)
        sigma = np.sqrt(electrons + np.float32(self.read_noise**2))
        noise = rng.standard_normal(electrons.shape, dtype=np.float32)
        return np.asarray(electrons + sigma * noise, np.float32)


def unwrap_phases(phases: Float32, modulation_mhz: tuple[int, ...]) -> tuple[Float32, Float32]:
    """Distances [m] on which phases agree best, and their root mean square disagreement [rad].

    Phases are in [0, 2 pi), one image per frequency, [n, h, w]; the highest frequency is the last.
    """
    finest_m = LIGHT_M_S / (2e6 * modulation_mhz[-1])
    wraps = modulation_mhz[-1] // math.gcd(*modulation_mhz)
    best_m = np.zeros(phases.shape[1:], np.float32)
    best = np.full(phases.shape[1:], np.inf, np.float32)
    slopes = [_phase_per_m(mhz) for mhz in modulation_mhz]
    weight = sum(slope * slope for slope in slopes)
    for wrap in range(wraps):
        range_m = (phases[-1] / np.float32(TURN) + np.float32(wrap)) * np.float32(finest_m)
        square, correction = np.zeros_like(best), np.zeros_like(best)
        for phase, slope in zip(phases, slopes, strict=True):
            gap = (phase - np.float32(slope) * range_m + np.float32(math.pi)) % np.float32(TURN)
            gap -= np.float32(math.pi)
            square += gap * gap
            correction += np.float32(slope) * gap
        better = square < best
        best = np.where(better, square, best)
        best_m = np.where(better, range_m + correction / np.float32(weight), best_m)
    ambiguity_m = np.float32(LIGHT_M_S / (2e6 * math.gcd(*modulation_mhz)))
    return np.asarray(best_m % ambiguity_m), np.sqrt(best / np.float32(len(slopes)))


def _phase_per_m(mhz: int) -> float:
    return 2.0 * TURN * mhz * 1e6 / LIGHT_M_S


def _low_pass(image: NDArray[Any], sigma_px: float) -> Float32:
    """Blur an image by a Gaussian, at reduced resolution where it is wide."""
    height, width = image.shape
    factor = max(1, int(sigma_px / 3.0))
    size = (max(width // factor, 1), max(height // factor, 1))
    small = cv2.resize(image.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    small = cv2.GaussianBlur(small, (0, 0), sigma_px / factor, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR))
