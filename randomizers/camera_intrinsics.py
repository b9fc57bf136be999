"""Field of view, principal point and distortion of cameras."""

import math
from dataclasses import replace
from typing import Annotated, Literal

from gen_data.config import distributions as dist
from gen_data.config.base_model import Strict
from gen_data.core.errors import ConfigError, LayoutRejected, Rejection
from gen_data.core.interfaces import AssetIndex
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import COEFFICIENTS, Lens
from gen_data.core.scene import Camera, Scene
from gen_data.core.streams import Rng
from gen_data.randomizers.base import RandomizerBase, check_known

PINHOLE_MAX_DEG = 170.0


class Coefficients(Strict):
    """Distortion coefficients of a camera's lens; null = value of the sensor.

    Attributes:
        k1, k2, k3, k4, k5, k6: Radial terms, as far as the lens model has them.
        p1, p2: Tangential terms.
    """

    k1: dist.Scalar | None = None
    k2: dist.Scalar | None = None
    k3: dist.Scalar | None = None
    k4: dist.Scalar | None = None
    k5: dist.Scalar | None = None
    k6: dist.Scalar | None = None
    p1: dist.Scalar | None = None
    p2: dist.Scalar | None = None


class CameraIntrinsics(RandomizerBase):
    """Draws the field of view, the principal point and the distortion of cameras.

    Attributes:
        camera: Name of a sensor; empty = every camera, drawn independently.
        hfov_deg: Horizontal field of view; null = field of view and principal point of the sensor.
        principal_offset_px: Offset of the principal point: one distribution, drawn for each axis,
            or two, ``[x, y]``.
        lens: Distortion coefficients for the sensor's lens model.
    """

    type: Literal["camera_intrinsics"] = "camera_intrinsics"
    stage: Literal["scene", "view"] = "view"
    camera: str = ""
    hfov_deg: Annotated[dist.Scalar, dist.Bounds(1, 360)] | None = dist.Uniform(50.0, 70.0)
    principal_offset_px: dist.Scalar | tuple[dist.Scalar, dist.Scalar] = dist.Normal(
        0.0, 3.0, clip=(-10.0, 10.0)
    )
    lens: Coefficients = Coefficients()

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Raise ConfigError if there is no such camera, or its lens has no such coefficients."""
        del assets
        known = [camera.name for camera in scene.cameras]
        if self.camera:
            check_known(self.camera, known, f"randomizers.{self.name}.camera: there is no camera")
        for camera in scene.cameras:
            if self.camera in ("", camera.name):
                self._check_lens_model(camera)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with drawn lenses; lens models and image sizes stay."""
        self.check(scene, assets)
        cameras = tuple(
            self._draw_intrinsics(camera, rng) if self.camera in ("", camera.name) else camera
            for camera in scene.cameras
        )
        return replace(scene, cameras=cameras)

    def _draw_intrinsics(self, camera: Camera, rng: Rng) -> Camera:
        before = camera.intrinsics
        hfov_deg = None if self.hfov_deg is None else self.hfov_deg.draw(rng)
        given = self.principal_offset_px
        axes = given if isinstance(given, tuple) else (given, given)
        offset_x, offset_y = (axis.draw(rng) for axis in axes)
        lens = self._draw_lens(before.lens, rng)
        try:
            drawn = replace(before, lens=lens)
            if hfov_deg is not None:
                hfov_rad = math.radians(hfov_deg)
                drawn = Intrinsics.from_hfov(before.width_px, before.height_px, hfov_rad, lens)
        except ValueError as error:
            raise self._rejection() from error
        cx_px, cy_px = round(drawn.cx_px + offset_x, 4), round(drawn.cy_px + offset_y, 4)
        drawn = replace(drawn, cx_px=cx_px, cy_px=cy_px)
        if drawn.folds_over():
            raise self._rejection()
        return replace(camera, intrinsics=drawn)

    def _draw_lens(self, before: Lens, rng: Rng) -> Lens:
        drawn = []
        for name, default in zip(COEFFICIENTS[before.model], before.coefficients, strict=True):
            given: dist.Scalar | None = getattr(self.lens, name)
            drawn.append(default if given is None else round(given.draw(rng), 9))
        return replace(before, coefficients=tuple(drawn))

    def _check_lens_model(self, camera: Camera) -> None:
        lens = camera.intrinsics.lens
        given = [name for name, value in self.lens if value is not None]
        missing = [name for name in given if name not in COEFFICIENTS[lens.model]]
        if missing:
            known = " ".join(COEFFICIENTS[lens.model]) or "no coefficients"
            raise ConfigError(
                f"randomizers.{self.name}.lens: camera '{camera.name}' has a lens of the model "
                f"'{lens.model}' with {known}, not {' '.join(missing)}; expected "
                f"another lens of sensor '{camera.name}', or the name of another camera"
            )
        widest_deg = 0.0 if self.hfov_deg is None else self.hfov_deg.support()[1]
        if lens.model == "pinhole" and widest_deg > PINHOLE_MAX_DEG:
            raise ConfigError(
                f"randomizers.{self.name}.hfov_deg: {widest_deg:g} degrees is too wide for the "
                f"pinhole of camera '{camera.name}'; expected at most {PINHOLE_MAX_DEG:g}"
            )

    def _rejection(self) -> LayoutRejected:
        return LayoutRejected(
            Rejection(
                "the distortion of the drawn lens folds over inside the image",
                f"narrow hfov_deg or the coefficients of randomizers.{self.name}.lens, or limit "
                "the sensor's lens with field_deg",
            )
        )
