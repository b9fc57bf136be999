"""The camera of a photograph that is the backdrop of a scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

from pydantic import model_validator

from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.plates import EV100, fitted_intrinsics, has_plate
from gen_data.generator.core.scene import Scene
from gen_data.generator.sensors.camera.exposure import make_shutter
from gen_data.generator.sensors.camera.image_pipeline import ImagePipeline
from gen_data.generator.sensors.camera.rgb_camera import RgbCamera

_GIVEN_BY_THE_PHOTOGRAPH = (
    "hfov_deg", "lens", "rig", "offset_m", "yaw_deg", "pitch_deg", "roll_deg", "stereo_with",
)  # fmt: skip


class PlateCamera(RgbCamera):
    """A camera with the place, direction and lens of the photograph behind the scene.

    Its images show the largest centred part of the photograph that has their shape.

    Attributes:
        ev100: Exposure value at ISO 100; at 12 the photograph keeps its brightness. null = metered.
        image_pipeline: From radiance to photographs. The photograph has been developed before: by
            default it keeps its tones, and noise, blur and compression that are set apply to the
            photograph and to what is inserted alike. A ``preset`` develops it a second time.
    """

    type: Literal["plate_camera"] = "plate_camera"  # type: ignore[assignment]
    ev100: float | None = EV100
    image_pipeline: ImagePipeline = ImagePipeline(tone="srgb")

    @model_validator(mode="before")
    @classmethod
    def _follows_the_photograph(cls, given: Any) -> Any:
        if not isinstance(given, Mapping):
            return given
        for name in _GIVEN_BY_THE_PHOTOGRAPH:
            if name in given:
                raise ValueError(
                    f"{name}: the photograph gives the camera's geometry; leave it out"
                )
        pipeline = given.get("image_pipeline")
        if isinstance(pipeline, Mapping) and not {"tone", "preset"} & set(pipeline):
            return {**given, "image_pipeline": {**pipeline, "tone": "srgb"}}
        return given

    def mount(self, scene: Scene) -> Scene:
        """Give the camera of the plate this camera's size and exposure.

        Raises:
            ConfigError: the scene has no plate, or its camera has another name.
        """
        known = [camera.name for camera in scene.cameras]
        if not has_plate(scene) or self.name not in known:
            raise ConfigError(
                f"sensor '{self.name}': there is no photograph with this camera; add an element "
                f"{{type: plate, camera: {self.name}}}, or use an rgb_camera"
            )
        shutter = make_shutter(self.exposure, self.rolling_shutter)
        cameras = []
        for camera in scene.cameras:
            if camera.name == self.name:
                lens = fitted_intrinsics(camera.intrinsics, *self.size_px)
                camera = replace(camera, intrinsics=lens, ev100=self.ev100, shutter=shutter)  # noqa: PLW2901
            cameras.append(camera)
        return replace(scene, cameras=tuple(cameras))
