"""Lens models in a camera's configuration."""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field, model_validator

from gen_data.config import base_model, data_files
from gen_data.core.errors import did_you_mean
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import COEFFICIENTS, Lens, LensModel

SidePx = Annotated[int, Field(ge=1)]
FieldDeg = Annotated[float, Field(gt=0, le=360)]


class _LensModel(base_model.Strict):
    """Base of the models of ``gen_data.core.lens``; fields are their coefficients."""

    model: LensModel

    def lens(self) -> Lens:
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
        k1, k2, k3, k4: Coefficients of the third, fifth, seventh and ninth power of the angle to
            the axis.
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


class CalibratedLens(base_model.Strict):
    """The calibration of a real camera, scaled to the image's width and cropped to its height.

    It defines the field of view: hfov_deg must be left out. The content of a ``file`` replaces its
    name in the configuration: as ``lens``, ``intrinsics`` and, unless given, ``size_px``.

    Attributes:
        camera: Without a file, kitti_raw_02, the left colour camera of KITTI's raw recordings;
            euroc_cam0; or tum_vi_cam0, a fisheye of 195 degrees. With one, a camera in it, such as
            cam0; empty = the only one.
        file: Name of a file of OpenCV (YAML, XML, JSON), ROS (camera_info), Kalibr (camera chain),
            EuRoC (sensor.yaml), COLMAP (cameras.txt, cameras.bin), nerfstudio (transforms.json),
            ORB-SLAM, camodocal (VINS), nuScenes (calibrated_sensor.json) or KITTI.
        fisheye: Whether the four coefficients of an OpenCV file belong to its fisheye model; a
            file that does not state it and a configuration without it cause a warning.
        rectified: Whether to take the rectified pinhole: the projection matrix of the file.
        field_deg: Full field of view, outside which the image is black; null = the whole range in
            which the model is valid.
    """

    model: Literal["calibrated"]
    camera: str = ""
    file: str = ""
    fisheye: bool = False
    rectified: bool = False
    field_deg: FieldDeg | None = None

    @model_validator(mode="after")
    def _has_a_source(self) -> "CalibratedLens":
        if self.file:
            return self
        if self.camera not in CALIBRATIONS:
            known = ", ".join(sorted(CALIBRATIONS))
            near = did_you_mean(self.camera, CALIBRATIONS)
            raise ValueError(
                f"camera: expected one of {known}{near}; or name the file of a calibration: file"
            )
        if self.fisheye or self.rectified:
            raise ValueError("fisheye and rectified need a file")
        return self

    def intrinsics(self, width_px: int, height_px: int) -> Intrinsics:
        """Intrinsics at an image size.

        Raises:
            ValueError: it names a file, which only configurations can.
        """
        if self.file:
            raise ValueError("lens.file: only a configuration can name it, and not by a switch")
        known = CALIBRATIONS[self.camera]
        measured = MeasuredIntrinsics(
            fx_px=known.fx_px,
            fy_px=known.fy_px,
            cx_px=known.cx_px,
            cy_px=known.cy_px,
            size_px=known.size_px,
        )
        half_rad = (
            known.lens.half_field_rad
            if self.field_deg is None
            else math.radians(0.5 * self.field_deg)
        )
        lens = replace(known.lens, half_field_rad=half_rad)
        return measured.at_size(width_px, height_px, lens, decimals=6)


class MeasuredIntrinsics(base_model.Strict):
    """Focal lengths and principal point of a real camera.

    Attributes:
        fx_px, fy_px: Focal lengths; they may differ.
        cx_px, cy_px: Principal point.
        size_px: Width and height of the images that they were measured in; null = the sensor's
            size_px. Otherwise they are scaled to the sensor's width, and its height shows the
            middle rows: it must not exceed the scaled one.
        pixel_centers: Where the centre of the first pixel is: at ``integers``, (0, 0), as in
            OpenCV, ROS, Kalibr and KITTI; or at ``halves``, (0.5, 0.5), as in COLMAP and in the
            labels of this project, whose cx is greater by 0.5.
    """

    fx_px: float = Field(gt=0)
    fy_px: float = Field(gt=0)
    cx_px: float
    cy_px: float
    size_px: tuple[SidePx, SidePx] | None = None
    pixel_centers: Literal["integers", "halves"] = "integers"

    def at_size(
        self, width_px: int, height_px: int, lens: Lens, *, decimals: int = 9
    ) -> Intrinsics:
        """Intrinsics at an image size, rounded to decimals of a pixel."""
        measured_px = self.size_px or (width_px, height_px)
        shift_px = 0.5 if self.pixel_centers == "integers" else 0.0
        scale = width_px / measured_px[0]
        crop_px = 0.5 * (height_px - scale * measured_px[1])
        return Intrinsics(
            width_px,
            height_px,
            fx_px=round(scale * self.fx_px, decimals),
            fy_px=round(scale * self.fy_px, decimals),
            cx_px=round(scale * (self.cx_px + shift_px), decimals),
            cy_px=round(scale * (self.cy_px + shift_px) + crop_px, decimals),
            lens=lens,
        )

    def check_size(self, width_px: int, height_px: int) -> None:
        """Raise ValueError if a sensor's image is taller than the scaled measured one."""
        if self.size_px is None:
            return
        tallest_px = width_px / self.size_px[0] * self.size_px[1]
        if height_px > tallest_px + 0.5:
            width, height = self.size_px
            raise ValueError(
                f"size_px [{width_px}, {height_px}] is taller than the calibrated {width} x "
                f"{height} scaled to its width; expected a height of at most {tallest_px:.0f}"
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


CALIBRATIONS = data_files.load_table(__package__, "calibrations", Calibration)
"""Calibrations by their name in configurations."""
