"""The camera of a photograph that is the backdrop of a scene."""

from dataclasses import replace
from typing import Literal

from pydantic import model_validator

from gen_data.core import errors, plates
from gen_data.core.scene import Scene
from gen_data.sensors.camera import exposure, rgb_camera
from gen_data.sensors.camera.image_pipeline import ImagePipeline

_GIVEN_BY_THE_PHOTOGRAPH = (
    "hfov_deg", "intrinsics", "lens", "rig", "offset_m", "yaw_deg", "pitch_deg", "roll_deg",
    "stereo_with",
)  # fmt: skip


class PlateCamera(rgb_camera.RgbCamera):
    """A camera with the place, direction and lens of the photograph behind the scene.

    Its images show the largest centred part of the photograph that has their shape.

    Attributes:
        ev100: Exposure value at ISO 100; at 12 the photograph keeps its brightness. null = metered.
        image_pipeline: From radiance to photographs. With the preset ``photograph`` the tones of
            the photograph stay as they are; noise, blur and compression that are set apply to it
            and to inserted objects alike. Presets of cameras develop it a second time.
    """

    type: Literal["plate_camera"] = "plate_camera"  # type: ignore[assignment]
    ev100: float | None = plates.EV100
    image_pipeline: ImagePipeline = ImagePipeline(preset="photograph")

    @model_validator(mode="after")
    def _follows_the_photograph(self) -> "PlateCamera":
        for name in _GIVEN_BY_THE_PHOTOGRAPH:
            if name in self.model_fields_set:
                raise ValueError(f"{name}: the photograph gives it; leave it out")
        if self.image_pipeline.preset == "ideal":
            raise ValueError(
                "image_pipeline.preset: ideal has a tone curve, but the photograph was developed "
                "before; expected photograph"
            )
        return self

    def mount(self, scene: Scene) -> Scene:
        """Give the camera of the plate this camera's size and exposure.

        Raises:
            ConfigError: the scene has no plate, or its camera has another name.
        """
        known = [camera.name for camera in scene.cameras]
        if not plates.has_plate(scene) or self.name not in known:
            raise errors.ConfigError(
                f"sensor '{self.name}': there is no photograph with this camera; add an element "
                f"{{type: plate, camera: {self.name}}}, or use an rgb_camera"
            )
        shutter = exposure.make_shutter(self.exposure, self.rolling_shutter)
        cameras = []
        for camera in scene.cameras:
            if camera.name == self.name:
                lens = plates.fitted_intrinsics(camera.intrinsics, *self.size_px)
                camera = replace(camera, intrinsics=lens, ev100=self.ev100, shutter=shutter)  # noqa: PLW2901
            cameras.append(camera)
        mounted = replace(scene, cameras=tuple(cameras))
        return rgb_camera.with_layers(mounted, self.name, self.layers, self.media)
