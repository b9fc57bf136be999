"""Lens models in a camera's configuration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.intrinsics import Intrinsics
from gen_data.generator.core.lens import COEFFICIENTS, Lens, LensModel

FieldDeg = Annotated[float, Field(gt=0, le=360)]


class _LensModel(Strict):
    """Base of the models of ``gen_data.generator.core.lens``; fields are their coefficients."""

    model: LensModel

    def lens(self) -> Lens:
        """The lens as renderers use it."""
        values = tuple(float(getattr(self, name)) for name in COEFFICIENTS[self.model])
        field_deg = getattr(self, "field_deg", None)
        half_rad = math.pi if field_deg is None else math.radians(0.5 * field_deg)
        return Lens(self.model, values, half_rad)


class Pinhole(_LensModel):
    """A pinhole: no distortion."""

    model: Literal["pinhole"] = "pinhole"


class BrownConrady(_LensModel):
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


class KannalaBrandt(_LensModel):
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


class Equirectangular(_LensModel):
    """A panorama: columns are longitudes, rows latitudes; hfov_deg 360 and 2:1 is a full sphere."""

    model: Literal["equirectangular"]


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
    """Published intrinsics, with pixel centres at integers."""

    size_px: tuple[int, int]
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    lens: Lens


CALIBRATIONS = load_table(__package__, "calibrations", Calibration)
"""Calibrations by their name in configurations."""
