"""Lens models in a camera's configuration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.intrinsics import Intrinsics
from gen_data.generator.core.lens import COEFFICIENTS, PINHOLE, Lens

FieldDeg = Annotated[float, Field(gt=0, le=360)]


class Pinhole(Strict):
    """A pinhole: no distortion."""

    model: Literal["pinhole"] = "pinhole"

    def lens(self) -> Lens:
        """The lens as renderers use it."""
        return PINHOLE


class BrownConrady(Strict):
    """A lens with OpenCV's rational distortion model, with its names and signs.

    Attributes:
        k1, k2, k3: Radial terms of the numerator; k1 < 0 is barrel distortion.
        k4, k5, k6: Radial terms of the denominator.
        p1, p2: Tangential terms.
        field_deg: Full field of view, outside which the image is black; null = the whole range in
            which the model is valid.
    """

    model: Literal["brown_conrady"]
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    field_deg: FieldDeg | None = None

    def lens(self) -> Lens:
        """The lens as renderers use it."""
        return _polynomial(self)


class KannalaBrandt(Strict):
    """A fisheye with OpenCV's model and names; all coefficients 0 is an equidistant lens.

    Attributes:
        k1, k2, k3, k4: Of the third, fifth, seventh and ninth power of the angle to the axis.
        field_deg: Full field of view, outside which the image is black; null = the whole range in
            which the model is valid.
    """

    model: Literal["kannala_brandt"]
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    field_deg: FieldDeg | None = None

    def lens(self) -> Lens:
        """The lens as renderers use it."""
        return _polynomial(self)


class Equirectangular(Strict):
    """A panorama: columns are longitudes, rows latitudes; hfov_deg 360 and 2:1 is a full sphere."""

    model: Literal["equirectangular"]

    def lens(self) -> Lens:
        """The lens as renderers use it."""
        return Lens("equirectangular")


class CalibratedLens(Strict):
    """The calibration of a real camera, scaled to the image's width and cropped to its height.

    It defines the field of view: hfov_deg must be left out.

    Attributes:
        camera: kitti_raw_02, the left colour camera of KITTI's raw recordings; euroc_cam0; or
            tum_vi_cam0, a fisheye of 195 degrees.
    """

    model: Literal["calibrated"]
    camera: Literal["euroc_cam0", "kitti_raw_02", "tum_vi_cam0"]

    def intrinsics(self, width_px: int, height_px: int) -> Intrinsics:
        """Intrinsics at an image size."""
        known = CALIBRATIONS[self.camera]
        scale = width_px / known.size_px[0]
        crop_px = 0.5 * (height_px - scale * known.size_px[1])
        return Intrinsics(
            width_px,
            height_px,
            fx_px=round(scale * known.fx_px, 6),
            fy_px=round(scale * known.fy_px, 6),
            cx_px=round(scale * (known.cx_px + 0.5), 6),
            cy_px=round(scale * (known.cy_px + 0.5) + crop_px, 6),
            lens=known.lens,
        )


LensConfig = Annotated[
    Pinhole | BrownConrady | KannalaBrandt | Equirectangular | CalibratedLens,
    Field(discriminator="model"),
]


@dataclass(frozen=True, slots=True)
class Calibration:
    """Published intrinsics, with pixel centres at integers.

    Attributes:
        source: Publication or file.
    """

    size_px: tuple[int, int]
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    lens: Lens
    source: str


CALIBRATIONS: dict[str, Calibration] = {
    "kitti_raw_02": Calibration(
        (1392, 512),
        959.7910,
        956.9251,
        696.0217,
        224.1806,
        Lens(
            "brown_conrady",
            (-3.691481e-01, 1.968681e-01, 1.353473e-03, 5.677587e-04, -6.770705e-02, 0.0, 0.0, 0.0),
        ),
        "KITTI raw data, 2011_09_26/calib_cam_to_cam.txt, lines S_02, K_02, D_02 (Geiger et al., "
        "'Vision meets robotics', IJRR 2013)",
    ),
    "euroc_cam0": Calibration(
        (752, 480),
        458.654,
        457.296,
        367.215,
        248.375,
        Lens(
            "brown_conrady",
            (-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0, 0.0, 0.0, 0.0),
        ),
        "EuRoC MAV data set, mav0/cam0/sensor.yaml (Burri et al., IJRR 2016)",
    ),
    "tum_vi_cam0": Calibration(
        (512, 512),
        190.97847715128717,
        190.9733070521226,
        254.93170605935475,
        256.8974428996504,
        Lens(
            "kannala_brandt",
            (
                0.0034823894022493434,
                0.0007150348452162257,
                -0.0020532361418706202,
                0.00020293673591811182,
            ),
            math.radians(97.5),
        ),
        "TUM VI benchmark, camera 0 at 512 x 512 (Schubert et al., IROS 2018); the lens shows 195 "
        "degrees",
    ),
}
"""Calibrations by their name in configurations."""


def _polynomial(config: BrownConrady | KannalaBrandt) -> Lens:
    values = tuple(float(getattr(config, name)) for name in COEFFICIENTS[config.model])
    half_rad = math.pi if config.field_deg is None else math.radians(0.5 * config.field_deg)
    return Lens(config.model, values, half_rad)
