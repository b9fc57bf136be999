"""Structured light: a dot projector and one camera, as in the first Kinect.

* **Shadow**: surfaces occluded from the projector have no dots.
* **Noise**: Nguyen, Izadi and Lovell, "Modeling Kinect Sensor Noise for Improved 3D Reconstruction
  and Tracking", 3DIMPVT 2012, axial and lateral, by distance and angle. They measured the device's
  output, so the variance of quantisation is subtracted from the variance of axial noise.
* **Quantisation**: disparities are whole multiples of 1/8 px (Khoshelham and Oude Elberink,
  "Accuracy and Resolution of Kinect Depth Data for Indoor Mapping Applications", Sensors 2012).
* **Lost edges and thin objects**: dots are recognised by a window of 9 x 9 px (ibid.), a large part
  of which must show one surface.
* **Dots** form a pattern that is fixed to the projector, and the same for all devices.
* **Holes** where too little light returns, where glints saturate the camera, and at grazing angles.
"""

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.core.asset_types import Float32
from gen_data.core.stereo import disparity_px, is_seen_by_both
from gen_data.core.streams import Rng
from gen_data.sensors.depth.view import Hits, Measured, View, smooth_noise
from gen_data.sensors.lidar.scan_pattern import Sensitivity

UInt32 = NDArray[np.uint32]


class Dots(Strict):
    """One dot at a random position in each cell of a grid.

    Attributes:
        pitch_mrad: Pitch of the grid in the middle of the field.
        dot_mrad: Standard deviation of a dot's profile.
    """

    pitch_mrad: float = Field(20.0, gt=0.1, le=500)
    dot_mrad: float = Field(2.0, gt=0.05, le=100)

    def at(self, x: Float32, y: Float32) -> Float32:
        """Intensity of the pattern over its mean, float32 of the shape of ``x``.

        ``x`` and ``y`` are tangents of directions from the projector, to the right and downwards.
        """
        pitch, sigma = 1e-3 * self.pitch_mrad, 1e-3 * self.dot_mrad
        u, v = x / np.float32(pitch), y / np.float32(pitch)
        column, row = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
        falloff = np.float32(0.5 * (pitch / sigma) ** 2)
        total = np.zeros(u.shape, np.float32)
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                du, dv = _dot_offset(column + right, row + down)
                away2 = (u - (column + right) - du) ** 2 + (v - (row + down) - dv) ** 2
                total += np.exp(-falloff * away2.astype(np.float32))
        return np.asarray(total * np.float32(falloff / np.pi), np.float32)


def _dot_offset(column: NDArray[np.int64], row: NDArray[np.int64]) -> tuple[Float32, Float32]:
    """Position of the dot in its cell, [0, 1) each."""
    cell: UInt32 = (column & 0xFFFF).astype(np.uint32) | (
        (row & 0xFFFF).astype(np.uint32) << np.uint32(16)
    )
    bits = _hash(cell)
    return _to_unit(bits & np.uint32(0xFFFF)), _to_unit(bits >> np.uint32(16))


def _hash(x: UInt32) -> UInt32:
    """A hash of 32 bits: ``lowbias32`` of Wellons, "Prospecting for hash functions", 2018."""
    x = (x ^ (x >> np.uint32(16))) * np.uint32(0x7FEB352D)
    x = (x ^ (x >> np.uint32(15))) * np.uint32(0x846CA68B)
    mixed: UInt32 = x ^ (x >> np.uint32(16))
    return mixed


def _to_unit(bits: NDArray[Any]) -> Float32:
    return np.asarray(bits.astype(np.float32) / np.float32(65536.0), np.float32)


Mask = NDArray[np.bool_]

STEEP_RAD = math.radians(85.0)
"""Bound of angles: the formulas have a pole at a right angle."""
WINDOW_RADIUS_PX, WINDOW_STEP_PX = 4, 2
SAME_PX = 1.0
"""Disparities in a window that differ by less belong to one surface."""
NOISE_PX = 0.8
"""Correlation length of noise: windows of neighbouring pixels overlap."""
SIGNAL_SPREAD = 0.2
"""Relative standard deviation of received light by speckle."""
INFRARED_BITS = 10


class StructuredLight(Strict):
    """Triangulation between a dot projector and one camera.

    Attributes:
        baseline_m: From the camera to the projector, to the right; negative = to the left.
        step_px: Quantisation of disparities; 0 = none.
        noise: Factor on the published noise.
        seen: The darkest matte surface, square on, that is recognised at a distance.
        blinded: The nearest such surface that does not saturate the camera.
        grazing_deg: Largest angle of incidence with a depth.
        window_share: Share of the window that must show one illuminated surface.
        dots: Pattern in the infrared image.
    """

    kind: Literal["structured_light"]
    baseline_m: float = Field(0.075, ge=-2, le=2)
    step_px: float = Field(0.125, ge=0, le=4)
    noise: float = Field(1.0, ge=0, le=100)
    seen: Sensitivity = Sensitivity(reflectance=0.05, range_m=4.0)
    blinded: Sensitivity = Sensitivity(reflectance=1.0, range_m=0.3)
    grazing_deg: float = Field(82.0, gt=0, le=90)
    window_share: float = Field(0.4, ge=0, le=1)
    dots: Dots = Dots()

    def measure(self, view: View, rng: Rng) -> Measured:
        """Measure the depth and infrared images of a view."""
        hits = view.trace()
        z_m = hits.z_m[..., 0]
        lateral, axial, speckle = (smooth_noise(rng, z_m.shape, NOISE_PX) for _ in range(3))
        infrared = self._infrared(view, hits)
        if self.baseline_m == 0.0:
            lit = np.isfinite(z_m)
        else:
            focal_baseline = view.focal_px * self.baseline_m
            there_m = view.z_depth_m(self.baseline_m)
            here_px, there_px = (disparity_px(d, focal_baseline) for d in (z_m, there_m))
            lit = is_seen_by_both(here_px, there_px, beyond=True) & self._is_recognised(here_px)
        signal = hits.reflectance[..., 0] / np.square(hits.range_m[..., 0])
        exposed = self._is_well_exposed(signal * (1.0 + SIGNAL_SPREAD * speckle))
        angle = np.arccos(np.clip(hits.cosine[..., 0], 0.0, 1.0))
        kept = lit & exposed & (angle < math.radians(self.grazing_deg))
        place = _displace(z_m.shape, self.noise * lateral_noise_px(angle) * lateral, rng)
        measured_m = self._triangulate(z_m[place], angle[place], axial, view.focal_px)
        return Measured(np.where(kept & kept[place], measured_m, np.float32(np.inf)), infrared)

    def _is_well_exposed(self, signal: Float32) -> Mask:
        """Whether dots are neither too dark nor saturated, bool [h, w]."""
        low = self.seen.reflectance / self.seen.range_m**2
        high = self.blinded.reflectance / self.blinded.range_m**2
        return np.asarray((signal >= low) & (signal <= high))

    def _is_recognised(self, here_px: Float32) -> Mask:
        """Whether enough of the window around each pixel shows the same surface, bool [h, w]."""
        height, width = here_px.shape
        reach, step = WINDOW_RADIUS_PX, WINDOW_STEP_PX
        wide = np.pad(here_px, reach, mode="edge")
        same = np.zeros(here_px.shape, np.float32)
        shifts = range(0, 2 * reach + 1, step)
        for down in shifts:
            for right in shifts:
                other = wide[down : down + height, right : right + width]
                same += np.abs(other - here_px) < SAME_PX
        return np.asarray(same >= self.window_share * len(shifts) ** 2)

    def _triangulate(self, z_m: Float32, angle: Float32, noise: Float32, f_px: float) -> Float32:
        """Depths with axial noise, quantised in disparity."""
        per_px = f_px * abs(self.baseline_m)
        there = np.isfinite(z_m)
        z = np.where(there, z_m, np.float32(1.0))
        sigma_m = self.noise * axial_noise_m(z, angle)
        if self.step_px == 0.0 or per_px == 0.0:
            return np.asarray(np.where(there, z + sigma_m * noise, np.inf), np.float32)
        step_m = z * z * np.float32(self.step_px / per_px)
        sigma_m = np.sqrt(np.maximum(sigma_m**2 - step_m**2 / 12.0, 0.0))
        noisy_m = np.maximum(z + sigma_m * noise, 1e-3)
        steps = np.maximum(np.rint(per_px / noisy_m / self.step_px), 1.0)
        return np.asarray(np.where(there, per_px / (steps * self.step_px), np.inf), np.float32)

    def _infrared(self, view: View, hits: Hits) -> NDArray[np.uint16]:
        """Infrared image of the dots; the light that saturates the camera is white on average."""
        points = view.camera.intrinsics.unproject(hits.z_m[..., 0])
        x = (points[..., 0] - self.baseline_m) / points[..., 2]
        y = points[..., 1] / points[..., 2]
        there = np.isfinite(x)
        dots = self.dots.at(*(np.where(there, t, 0.0).astype(np.float32) for t in (x, y)))
        signal = hits.reflectance[..., 0] / np.square(hits.range_m[..., 0])
        white = self.blinded.reflectance / self.blinded.range_m**2
        most = 2**INFRARED_BITS - 1
        return np.asarray(np.rint(np.clip(dots * signal / white, 0, 1) * most), np.uint16)


def axial_noise_m(z_m: Float32, angle_rad: Float32) -> Float32:
    """Standard deviation along the axis, Nguyen et al. 2012, equation 5."""
    angle = np.minimum(angle_rad, np.float32(STEEP_RAD))
    flat = 0.0012 + 0.0019 * (z_m - 0.4) ** 2
    lean = 0.0001 / np.sqrt(z_m) * angle**2 / (0.5 * np.pi - angle) ** 2
    return np.asarray(flat + np.where(angle > np.pi / 3.0, lean, 0.0), np.float32)


def lateral_noise_px(angle_rad: Float32) -> Float32:
    """Standard deviation across the axis, Nguyen et al. 2012, equation 2."""
    angle = np.minimum(angle_rad, np.float32(STEEP_RAD))
    return np.asarray(0.8 + 0.035 * angle / (0.5 * np.pi - angle), np.float32)


def _displace(
    shape: tuple[int, int], along_px: Float32, rng: Rng
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows and columns of the pixels whose dots each pixel measures in place of its dot."""
    down_px = smooth_noise(rng, shape, NOISE_PX) * np.abs(along_px).mean()
    rows, columns = np.indices(shape)
    return (
        np.clip(np.rint(rows + down_px), 0, shape[0] - 1).astype(np.int64),
        np.clip(np.rint(columns + along_px), 0, shape[1] - 1).astype(np.int64),
    )
