"""Active stereo: two infrared cameras and a dot projector, as in RealSense D400.

Only the images are modelled: ambient light, the projected dots, shot and read noise, 8 bits.
Fattened edges, holes and wrong matches result from the matching itself: semi-global matching
(Hirschmueller, "Stereo Processing by Semiglobal Matching and Mutual Information", TPAMI 2008) as
implemented in OpenCV, with a left-right check. Design of devices: Keselman et al., "Intel RealSense
Stereoscopic Depth Cameras", CVPR Workshops 2017.
"""

import math
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.core import stereo, streams
from gen_data.core.asset_types import Float32
from gen_data.sensors.depth.structured_light import Dots
from gen_data.sensors.depth.view import Measured, View

UInt8 = NDArray[np.uint8]

BITS = 4
"""Fractional bits of OpenCV's disparities."""
SMOOTHING_PX = 1.0
"""Standard deviation of the blur before gradients are computed."""
WHITE, WHITE_QUANTILE = 200.0, 0.98
"""Auto-exposure maps this quantile of an image to this value."""


class ActiveStereo(Strict):
    """Block matching between two infrared cameras, helped by projected dots.

    Attributes:
        baseline_m: From the left camera, which reports depth, to the right one.
        projector_m: From the left camera to the projector between them.
        projector_cd: Intensity of the projector, on the scale of ambient light; 0 = no projector.
        dots: Pattern of the projector.
        nearest_m: Nearest depth that is searched.
        block_px: Width of the matched blocks; odd.
        smoothness: Factor on the penalties for changes of disparity.
        uniqueness_pct: Margin by which the best match must beat all others.
        check_px: Largest difference between left-right and right-left disparities; -1 = unchecked.
        speckle_px: Smaller patches of disparity are removed; 0 = none.
        steps_per_px: Steps of disparity per pixel.
        full_well: Electrons of a white pixel.
        read_noise: Read noise of a pixel [electrons].
    """

    kind: Literal["active_stereo"]
    baseline_m: float = Field(0.05, gt=0, le=2)
    projector_m: float = Field(0.03, ge=-2, le=2)
    projector_cd: float = Field(70.0, ge=0)
    dots: Dots = Dots()
    nearest_m: float = Field(0.2, gt=0)
    block_px: int = Field(7, ge=3, le=21)
    smoothness: float = Field(1.0, gt=0, le=100)
    uniqueness_pct: int = Field(5, ge=0, le=100)
    check_px: int = Field(1, ge=-1, le=16)
    speckle_px: int = Field(60, ge=0)
    steps_per_px: int = Field(32, ge=1, le=256)
    full_well: float = Field(8000.0, gt=0)
    read_noise: float = Field(6.0, ge=0)

    def measure(self, view: View, rng: streams.Rng) -> Measured:
        """Measure the depth image and the left infrared image of a view."""
        lights = [self._light(view, right_m) for right_m in (0.0, self.baseline_m)]
        white = max(float(np.quantile(lights[0], WHITE_QUANTILE)), 1e-6)
        left, right = (self._expose(light / np.float32(white), rng) for light in lights)
        focal_baseline = view.focal_px * self.baseline_m
        most_px = math.ceil(focal_baseline / self.nearest_m / 16.0) * 16
        disparity = self._match(left, right, most_px)
        z_m = np.where(disparity > 0.0, focal_baseline / np.maximum(disparity, 1e-3), np.inf)
        return Measured(z_m.astype(np.float32), left.astype(np.uint16))

    def _light(self, view: View, right_m: float) -> Float32:
        """Luminance in the image of one camera, including the dots, float32 [h, w]."""
        light = view.luminance_cd_m2(right_m)
        if self.projector_cd == 0.0:
            return light
        hits = view.trace(right_m)
        z_m, range_m = hits.z_m[..., 0], hits.range_m[..., 0]
        away_m = self.projector_m - right_m
        points = view.camera.intrinsics.unproject(z_m)
        there = np.isfinite(z_m)
        x, y = (
            np.where(there, p / points[..., 2], 0.0).astype(np.float32)
            for p in (points[..., 0] - away_m, points[..., 1])
        )
        lux = np.float32(self.projector_cd) * self.dots.at(x, y) / np.square(range_m)
        if away_m != 0.0:
            focal_baseline = view.focal_px * away_m
            depths_m = (z_m, view.z_depth_m(self.projector_m))
            pair_px = (stereo.disparity_px(depth_m, focal_baseline) for depth_m in depths_m)
            lux *= stereo.is_seen_by_both(*pair_px, beyond=True)
        return np.asarray(light + lux * hits.reflectance[..., 0] / np.float32(np.pi), np.float32)

    def _expose(self, exposed: Float32, rng: streams.Rng) -> UInt8:
        """Eight-bit image with noise; input of 1 becomes ``WHITE``."""
        electrons = np.minimum(exposed * np.float32(WHITE / 255.0), 1.0) * self.full_well
        noise = rng.standard_normal(exposed.shape, dtype=np.float32)
        electrons = electrons + np.sqrt(electrons + self.read_noise**2) * noise
        steps = np.rint(electrons * (255.0 / self.full_well))
        return np.asarray(np.clip(steps, 0, 255), np.uint8)

    def _match(self, left: UInt8, right: UInt8, most_px: int) -> Float32:
        """Disparities of the left image, float32 [h, w]; 0 = none."""
        block = self.block_px | 1
        cost = self.smoothness * block * block
        matcher = cv2.StereoSGBM.create(
            minDisparity=0,
            numDisparities=most_px,
            blockSize=block,
            P1=round(8 * cost),
            P2=round(32 * cost),
            disp12MaxDiff=self.check_px,
            preFilterCap=31,
            uniquenessRatio=self.uniqueness_pct,
            speckleWindowSize=self.speckle_px,
            speckleRange=2,
            mode=cv2.STEREO_SGBM_MODE_SGBM,
        )
        # OpenCV skips columns whose farthest match lies outside: the images are padded.
        wide = [
            cv2.copyMakeBorder(i, 0, 0, most_px, 0, cv2.BORDER_REPLICATE) for i in (left, right)
        ]
        found = matcher.compute(*wide)[:, most_px:].astype(np.float32) / np.float32(1 << BITS)
        columns = np.arange(left.shape[1], dtype=np.float32)
        found = np.where((found > 0) & (columns >= found), found, np.float32(0.0))
        fine = refine_disparity(left, right, found, block)
        per_px = np.float32(self.steps_per_px)
        return np.asarray(np.rint(fine * per_px) / per_px, np.float32)


def refine_disparity(left: UInt8, right: UInt8, found: Float32, block_px: int) -> Float32:
    """Refine disparities to subpixel accuracy, float32 [h, w]; 0 = none.

    Lucas and Kanade, "An Iterative Image Registration Technique", IJCAI 1981: the shift with the
    smallest difference between blocks, by the gradients of both images, starting from semi-global
    matching, whose parabola fit is biased towards whole pixels. Two passes: from whole pixels, then
    from halves.
    """
    here = _smooth(left)
    there = _smooth(right)
    between = 0.5 * (there + np.pad(there, ((0, 0), (1, 0)), mode="edge")[:, :-1])
    fine = found
    for images in ((there,), (there, between)):
        per_px = len(images)
        start = np.where(found > 0.0, np.maximum(np.rint(fine * per_px), 1.0), 0.0).astype(np.int64)
        shift = np.zeros_like(found)
        for step in np.flatnonzero(np.bincount(start.ravel()))[1:]:
            at = start == step
            rows = np.flatnonzero(at.any(axis=1))
            window = slice(max(rows[0] - block_px, 0), rows[-1] + block_px + 1)
            image = images[step % per_px][window]
            by = step // per_px
            moved = np.pad(image, ((0, 0), (by, 0)), mode="edge")[:, : image.shape[1]]
            shift[window] += at[window] * _find_shift(here[window], moved, block_px)
        fine = np.where(found > 0.0, start / np.float32(per_px) + shift, np.float32(0.0))
    return np.asarray(np.where(np.abs(fine - found) <= 1.0, fine, found), np.float32)


def _find_shift(here: Float32, there: Float32, block_px: int) -> Float32:
    """Shift to the right that aligns blocks of the second image, at most a pixel."""
    slope = 0.5 * (_slope(here) + _slope(there))
    size = (block_px, block_px)
    pull = cv2.boxFilter(slope * (there - here), -1, size, normalize=False)
    stiff = cv2.boxFilter(slope * slope, -1, size, normalize=False)
    shift = np.clip(pull / np.maximum(stiff, np.float32(1e-3)), -1.0, 1.0)
    return np.asarray(shift, np.float32)


def _slope(image: Float32) -> Float32:
    wide = np.pad(image, ((0, 0), (1, 1)), mode="edge")
    return np.asarray(0.5 * (wide[:, 2:] - wide[:, :-2]), np.float32)


def _smooth(image: UInt8) -> Float32:
    return np.asarray(cv2.GaussianBlur(image.astype(np.float32), (0, 0), SMOOTHING_PX), np.float32)
