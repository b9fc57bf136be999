"""Two infrared cameras and a dot projector, as in RealSense D400: depth by matching blocks.

Nothing is modelled but the images: what surrounding light shows, the projector's dots by the place
of each point, shot and read noise, 8 bits. Fattened edges, holes and wrong matches come out of the
matching itself: semi-global, Hirschmueller, "Stereo Processing by Semiglobal Matching and Mutual
Information", TPAMI 2008, in OpenCV's form with a left-right check. What devices do: Keselman et
al., "Intel RealSense Stereoscopic Depth Cameras", CVPR Workshops 2017.
"""

from __future__ import annotations

import math
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.asset_types import Float32
from gen_data.generator.core.stereo import disparity_px, is_seen_by_both
from gen_data.generator.core.streams import Rng
from gen_data.generator.sensors.depth.dot_pattern import Dots
from gen_data.generator.sensors.depth.view import Measured, View

UInt8 = NDArray[np.uint8]

BITS = 4
"""Binary places of OpenCV's disparities."""
SMOOTHING_PX = 1.0
"""Of images whose gradients are taken."""
WHITE, WHITE_QUANTILE = 200.0, 0.98
"""The exposure puts the brightest fiftieth of the image here."""


class ActiveStereo(Strict):
    """Block matching between two infrared cameras, helped by projected dots.

    Attributes:
        baseline_m: From the left camera, whose depth is reported, to the right one.
        projector_m: From the left camera to the projector between them.
        projector_cd: Its intensity, in the units in which surrounding light is given; 0 = none.
        dots: Its pattern.
        nearest_m: Larger disparities are not looked for.
        block_px: Width of the blocks that are matched; odd.
        smoothness: Factor on what changes of disparity cost.
        uniqueness_pct: The best match has to be better by this than any other.
        check_px: Largest difference between left-right and right-left disparities; -1 = unchecked.
        speckle_px: Smaller patches are taken for wrong; 0 = none is.
        steps_per_px: Disparities are whole multiples of a pixel over this.
        full_well: Electrons of a white pixel.
        read_noise: Of a pixel [electrons].
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

    def measure(self, view: View, rng: Rng) -> Measured:
        """The depth image and the left infrared image of a view."""
        lights = [self._light(view, right_m) for right_m in (0.0, self.baseline_m)]
        white = max(float(np.quantile(lights[0], WHITE_QUANTILE)), 1e-6)
        left, right = (self._photo(light / np.float32(white), rng) for light in lights)
        focal_baseline = view.focal_px * self.baseline_m
        most_px = math.ceil(focal_baseline / self.nearest_m / 16.0) * 16
        disparity = self._matched(left, right, most_px)
        z_m = np.where(disparity > 0.0, focal_baseline / np.maximum(disparity, 1e-3), np.inf)
        return Measured(z_m.astype(np.float32), left.astype(np.uint16))

    def _light(self, view: View, right_m: float) -> Float32:
        """Luminance that one camera sees, dots included."""
        light = view.luminance_cd_m2(right_m)
        if self.projector_cd == 0.0:
            return light
        met = view.lit(right_m)
        z_m, range_m = met.z_m[..., 0], met.range_m[..., 0]
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
            pair_px = (disparity_px(depth_m, focal_baseline) for depth_m in depths_m)
            lux *= is_seen_by_both(*pair_px, beyond=True)
        return np.asarray(light + lux * met.reflectance[..., 0] / np.float32(np.pi), np.float32)

    def _photo(self, exposed: Float32, rng: Rng) -> UInt8:
        """Eight bits of an image in which 1 is ``WHITE``."""
        electrons = np.minimum(exposed * np.float32(WHITE / 255.0), 1.0) * self.full_well
        noise = rng.standard_normal(exposed.shape, dtype=np.float32)
        electrons = electrons + np.sqrt(electrons + self.read_noise**2) * noise
        steps = np.rint(electrons * (255.0 / self.full_well))
        return np.asarray(np.clip(steps, 0, 255), np.uint8)

    def _matched(self, left: UInt8, right: UInt8, most_px: int) -> Float32:
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
        # OpenCV leaves out columns whose farthest match lies outside: it is given more of them.
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
    """Disparities to a small part of a pixel, float32 [h, w]; 0 = none.

    Lucas and Kanade, "An Iterative Image Registration Technique", IJCAI 1981: the shift under which
    blocks differ least, with the gradients of both images, from where semi-global matching ended,
    whose own parabolas lean towards whole pixels. Twice: from whole pixels, then from halves.
    """
    here = _smoothed(left)
    there = _smoothed(right)
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
            shift[window] += at[window] * _shift(here[window], moved, block_px)
        fine = np.where(found > 0.0, start / np.float32(per_px) + shift, np.float32(0.0))
    return np.asarray(np.where(np.abs(fine - found) <= 1.0, fine, found), np.float32)


def _shift(here: Float32, there: Float32, block_px: int) -> Float32:
    """By how much blocks of the second image have to move to the right, at most a pixel."""
    slope = 0.5 * (_slope(here) + _slope(there))
    size = (block_px, block_px)
    pull = cv2.boxFilter(slope * (there - here), -1, size, normalize=False)
    stiff = cv2.boxFilter(slope * slope, -1, size, normalize=False)
    shift = np.clip(pull / np.maximum(stiff, np.float32(1e-3)), -1.0, 1.0)
    return np.asarray(shift, np.float32)


def _slope(image: Float32) -> Float32:
    wide = np.pad(image, ((0, 0), (1, 1)), mode="edge")
    return np.asarray(0.5 * (wide[:, 2:] - wide[:, :-2]), np.float32)


def _smoothed(image: UInt8) -> Float32:
    return np.asarray(cv2.GaussianBlur(image.astype(np.float32), (0, 0), SMOOTHING_PX), np.float32)
