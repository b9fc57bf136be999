"""An event camera: where and when pixels become brighter or darker."""

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
    known_camera,
    window_s,
)

SidePx = Annotated[int, Field(ge=8, le=2048)]
KIND = "event_camera"
CHANNELS = frozenset({Channel.RADIANCE, Channel.INSTANCE})


class EventCamera(Mounted):
    """An event camera: time, pixel and polarity of every change of brightness since the last step.

    It sees luminance, unexposed and in full precision. Several images are rendered per step: choose
    small ones.

    Attributes:
        name: What files call it.
        camera: Without a rig: name of the camera whose place and axis it shares, listed before it.
        size_px: Width and height.
        hfov_deg: Horizontal field of view.
        frames_per_step: Images from one reading to the next, between which brightness changes
            evenly; things should move by about a pixel from one to the next.
        threshold: Change of the logarithm of intensity that makes an event.
        threshold_spread: Its standard deviation over the pixels.
        refractory_s: Time for which a pixel is silent after an event.
        leak_hz: Events per pixel and second that leakage makes, all brighter.
        shot_noise_hz: Events per pixel and second that noise makes in the dark.
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
        """A device that sees nothing from inside the body that carries it."""
        return self._device_info(self.name, KIND, needs_clear_view=not self.inside)

    def mount(self, scene: Scene) -> Scene:
        """The scene with this device on its rig, or at its camera.

        Raises:
            ConfigError: the scene has no such rig or camera, or the rate does not fit.
        """
        check_rate(self.name, self.rate_hz, scene.step_s)
        rig = check_rig(scene, self.name, self.rig) if self.rig else ""
        if not rig:
            known_camera(scene, self.name, self.camera)
        device = Device(
            self.name,
            KIND,
            rig,
            self.T_rig_sensor,
            camera="" if rig else self.camera,
        )
        return replace(scene, devices=(*scene.devices, device))

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """Events since the last reading, by time; none at time 0."""
        del channels
        start_s, end_s = window_s(scene, self.rate_hz)
        device = scene.device(self.name)
        if end_s <= start_s:
            return Measurements(self.name, device, table_rows("event_camera", 0), scene.time_s)
        times_s = start_s + (end_s - start_s) * np.linspace(0.0, 1.0, self.frames_per_step + 1)
        luminances, shown = self._frames(scene, times_s, renderer)
        width_px, height_px = self.size_px
        shape = (height_px, width_px)
        pixels = Pixels.drawn(shape, self.threshold, self.threshold_spread, rng.of_sequence())
        told = signal_events([pixels.levels(log_response(image)) for image in luminances], times_s)
        noise = noise_events(luminances[-1], start_s, end_s, self.leak_hz, self.shot_noise_hz, rng)
        events = apply_refractory_period(Events.joined([told, noise]), self.refractory_s)
        frame = np.rint((events.time_s - start_s) / (times_s[1] - start_s)).astype(np.int64)
        rows = table_rows(
            "event_camera",
            len(events.pixel),
            time_s=events.time_s,
            x_px=events.pixel % width_px,
            y_px=events.pixel // width_px,
            polarity=events.polarity,
            instance_id=shown.reshape(len(times_s), -1)[frame, events.pixel],
        )
        return Measurements(self.name, device, rows, scene.time_s)

    def _frames(
        self, scene: Scene, times_s: Array, renderer: Renderer
    ) -> tuple[list[Array], np.ndarray]:
        """Luminance, and instance ids [frames, h, w], at each of several instants.

        Nothing is rendered again while nothing moves.
        """
        width_px, height_px = self.size_px
        lens = Intrinsics.from_hfov(width_px, height_px, math.radians(self.hfov_deg))
        luminances: list[Array] = []
        shown: list[np.ndarray] = []
        before: Scene | None = None
        for time_s in times_s:
            then = scene_at(scene, float(time_s))
            if before is not None and _looks_alike(before, then, self.name):
                luminances.append(luminances[-1])
                shown.append(shown[-1])
                continue
            pose = then.device(self.name).T_world_device @ RIG_AXES.inverse()
            seen = renderer.render(then, Camera(self.name, pose, lens), CHANNELS)
            luminances.append(luminance(seen.channels[Channel.RADIANCE].astype(np.float64)))
            shown.append(seen.channels[Channel.INSTANCE])
            before = then
        return luminances, np.stack(shown)


def _looks_alike(one: Scene, other: Scene, device: str) -> bool:
    """Whether a device sees the same at two instants of a scene."""
    falling = one.weather.rain_mm_h > 0.0 or one.weather.snow_mm_h > 0.0
    still = one.device(device) == other.device(device) and one.lights == other.lights
    return still and not falling and one.bodies == other.bodies
