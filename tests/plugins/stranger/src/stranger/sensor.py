"""Sensor that measures the mean luminance in the image of a camera."""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, Measurements
from gen_data.core.interfaces import Modality, Renderer, Sensor, SensorInfo
from gen_data.core.measurement_dtypes import TIME, Column, columns_dtype
from gen_data.core.scene import Device, Scene
from gen_data.core.streams import Rng

COLUMNS = (TIME, Column("luminance_cd_m2", "<f8", "mean over the image, with noise"))
VIEW = "stranger.sensor:draw_bar"


class LightMeter(Strict):
    """A light meter mounted on a camera.

    Attributes:
        name: Unique name, also of its files.
        camera: Name of the camera that carries it.
        noise: Relative standard deviation of a reading.
    """

    type: Literal["stranger_light_meter"] = "stranger_light_meter"
    name: str = "meter"
    camera: str = "color"
    noise: float = 0.01

    def describe(self) -> SensorInfo:
        """Describe a device with its own columns."""
        return SensorInfo(self.name, Modality.DEVICE, "light_meter", columns=COLUMNS, view=VIEW)

    def mount(self, scene: Scene) -> Scene:
        """Return the scene with the device at its camera."""
        device = Device(self.name, "light_meter", "", camera=self.camera)
        return replace(scene, devices=(*scene.devices, device))

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """Measure once: one row."""
        del channels
        reading = renderer.render(scene, scene.camera(self.camera), frozenset({Channel.RADIANCE}))
        mean = float(reading.channels[Channel.RADIANCE].mean(dtype=np.float64))
        rows = np.zeros(1, columns_dtype(COLUMNS))
        rows["time_s"] = scene.time_s
        rows["luminance_cd_m2"] = mean * (1.0 + self.noise * rng.standard_normal())
        return Measurements(self.name, scene.device(self.name), rows, scene.time_s)


def draw_bar(table: Measurements, scene: Scene, aspect: float) -> NDArray[np.uint8]:
    """Draw a bar as wide as the share of 50 cd/m^2, uint8 [h, w, 3]."""
    del scene
    width_px = 96
    image = np.zeros((round(width_px / aspect), width_px, 3), np.uint8)
    image[:, : round(width_px * float(table.rows["luminance_cd_m2"][0]) / 50.0)] = 255
    return image


PLUGIN: type[Sensor] = LightMeter
