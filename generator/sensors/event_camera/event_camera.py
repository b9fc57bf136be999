"""Event camera: time, pixel and polarity of changes of brightness."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gen_data.generator.core.capture import Channel, Measurements
from gen_data.generator.core.colorimetry import luminance
from gen_data.generator.core.interfaces import Renderer, SensorInfo
from gen_data.generator.core.intrinsics import Intrinsics
from gen_data.generator.core.measurement_dtypes import table_rows
from gen_data.generator.core.scene import Camera, Device, Scene
from gen_data.generator.core.scene_time import RIG_AXES, scene_at
from gen_data.generator.core.se3 import Array
from gen_data.generator.core.streams import Rng
from gen_data.generator.sensors.event_camera.event_pixels import (
    Events,
    Pixels,
    apply_refractory_period,
    log_response,
    noise_events,
    signal_events,
)
from gen_data.generator.sensors.mounting import (
    Mounted,
    check_rate,
    check_rig,
    find_camera,
    window_s,
)

SidePx = Annotated[int, Field(ge=8, le=2048)]
KIND = "event_camera"
CHANNELS = frozenset({Channel.RADIANCE, Channel.INSTANCE})


class EventCamera(Mounted):
    """An event camera: time, pixel and polarity of every change of brightness since the last step.

    Events come from luminance in full precision, without exposure. Several images are rendered per
    step: choose small ones.

    Attributes:
        name: Its name in files.
        camera: Without a rig: name of a camera listed before it, whose position and axis it
            shares.
        size_px: Width and height.
        hfov_deg: Horizontal field of view.
        frames_per_step: Images from one reading to the next; brightness is interpolated between
            them, so objects should move by about a pixel from one to the next.
        threshold: Change of the logarithm of intensity that triggers an event.
        threshold_spread: Standard deviation of the threshold over the pixels.
        refractory_s: Dead time of a pixel after an event.
        leak_hz: Rate of events by leakage, per pixel; all are positive.
        shot_noise_hz: Rate of noise events in the dark, per pixel.
    """

    type: Literal["event_camera"] = "event_camera"
    name: str = Field("events", pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    camera: str = "color"
    size_px: tuple[SidePx, SidePx] = (346, 260)
    hfov_deg: float = Field(60.0, ge=1, le=170)
    frames_per_step: int = Field(5, ge=1, le=1000)
    threshold: float = Field(0.2, ge=0.01, le=5)
    threshold_spread: float = Field(0.03, ge=0, le=1)
    refractory_s: float = Field(0.0005, ge=0, le=1)
    leak_hz: float = Field(0.1, ge=0, le=1000)
    shot_noise_hz: float = Field(0.5, ge=0, le=1000)

    def describe(self) -> SensorInfo:
        """Describe a device whose view its carrier may occlude."""
        return self._device_info(self.name, KIND, needs_clear_view=not self.inside)

    def mount(self, scene: Scene) -> Scene:
        """Add this device to its rig, or to its camera.

        Raises:
            ConfigError: the scene has no such rig or camera, or the rate does not fit.
        """
        check_rate(self.name, self.rate_hz, scene.step_s)
        rig = check_rig(scene, self.name, self.rig) if self.rig else ""
        if not rig:
            find_camera(scene, self.name, self.camera)
        device = Device(self.name, KIND, rig, self.T_rig_sensor, camera="" if rig else self.camera)
        return replace(scene, devices=(*scene.devices, device))

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """Detect the events since the last reading, sorted by time; none at time 0."""
        del channels
        start_s, end_s = window_s(scene, self.rate_hz)
        device = scene.device(self.name)
        if end_s <= start_s:
            return Measurements(self.name, device, table_rows("event_camera", 0), scene.time_s)
        times_s = start_s + (end_s - start_s) * np.linspace(0.0, 1.0, self.frames_per_step + 1)
        luminances, ids = self._render_frames(scene, times_s, renderer)
        width_px, height_px = self.size_px
        shape = (height_px, width_px)
        pixels = Pixels.draw(shape, self.threshold, self.threshold_spread, rng.of_sequence())
        levels = [pixels.levels(log_response(image)) for image in luminances]
        signal = signal_events(levels, times_s)
        noise = noise_events(luminances[-1], start_s, end_s, self.leak_hz, self.shot_noise_hz, rng)
        events = apply_refractory_period(Events.merge([signal, noise]), self.refractory_s)
        frame = np.rint((events.time_s - start_s) / (times_s[1] - start_s)).astype(np.int64)
        rows = table_rows(
            "event_camera",
            len(events.pixel),
            time_s=events.time_s,
            x_px=events.pixel % width_px,
            y_px=events.pixel // width_px,
            polarity=events.polarity,
            instance_id=ids.reshape(len(times_s), -1)[frame, events.pixel],
        )
        return Measurements(self.name, device, rows, scene.time_s)

    def _render_frames(
        self, scene: Scene, times_s: Array, renderer: Renderer
    ) -> tuple[list[Array], np.ndarray]:
        """Luminance [h, w] at each instant, and instance ids [frames, h, w].

        A frame that equals the one before is not rendered again.
        """
        width_px, height_px = self.size_px
        lens = Intrinsics.from_hfov(width_px, height_px, math.radians(self.hfov_deg))
        luminances: list[Array] = []
        ids: list[np.ndarray] = []
        before: Scene | None = None
        for time_s in times_s:
            then = scene_at(scene, float(time_s))
            if before is not None and _is_same_view(before, then, self.name):
                luminances.append(luminances[-1])
                ids.append(ids[-1])
                continue
            pose = then.device(self.name).T_world_device @ RIG_AXES.inverse()
            images = renderer.render(then, Camera(self.name, pose, lens), CHANNELS).channels
            luminances.append(luminance(images[Channel.RADIANCE].astype(np.float64)))
            ids.append(images[Channel.INSTANCE])
            before = then
        return luminances, np.stack(ids)


def _is_same_view(one: Scene, other: Scene, device: str) -> bool:
    """Whether a device's view is the same at two instants of a scene."""
    falling = one.weather.rain_mm_h > 0.0 or one.weather.snow_mm_h > 0.0
    still = one.device(device) == other.device(device) and one.lights == other.lights
    return still and not falling and one.bodies == other.bodies
