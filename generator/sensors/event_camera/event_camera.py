"""Event camera: time, pixel and polarity of changes of brightness.

A pixel triggers an event whenever the logarithm of its intensity has changed by a threshold since
its last event (Lichtsteiner, Posch and Delbruck 2008). Events are interpolated between frames as in
Rebecq et al., "ESIM", CoRL 2018; the spread of thresholds and the noise follow Hu, Liu and
Delbruck, "v2e", CVPRW 2021.

The trigger levels of each pixel lie on a grid that is fixed for a sequence. Events between two
instants therefore do not depend on earlier events: none is lost or repeated at the border of two
steps as long as the change continues in one direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config.base_model import NAME_PATTERN
from gen_data.core import intrinsics, scene_time
from gen_data.core.capture import Channel, Measurements
from gen_data.core.colorimetry import luminance
from gen_data.core.interfaces import Modality, Renderer, SensorInfo
from gen_data.core.measurement_dtypes import TIME, Column, table_rows
from gen_data.core.scene import Camera, Device, Scene
from gen_data.core.se3 import Array
from gen_data.core.streams import Rng
from gen_data.sensors.mounting import Mounted, check_rate, check_rig, find_camera, window_s

DARK_CD_M2 = 0.005
"""Luminance equivalent of the dark current. White paper under 0.1 lx, the least illuminance for a
DVS128 (Lichtsteiner et al. 2008), is six times as bright."""
COLUMNS = (
    TIME,
    Column("x_px", "<u2", "column of the pixel"),
    Column("y_px", "<u2", "row of the pixel"),
    Column("polarity", "|i1", "1 brighter, -1 darker"),
    Column("instance_id", "<u2", "instance at the pixel in the nearest frame; 0"),
)
THRESHOLD_MIN = 0.01
BRIGHT_SHARE = 0.25
"""Shot noise of the brightest pixels over that in the dark (v2e)."""


@dataclass(frozen=True, eq=False, slots=True)
class Pixels:
    """Fixed pattern of a device: threshold and offset of the levels of each pixel, [h, w]."""

    threshold: Array
    phase: Array

    @classmethod
    def draw(cls, shape: tuple[int, int], threshold: float, spread: float, rng: Rng) -> Pixels:
        """Draw the pixels of one device."""
        thresholds = threshold + spread * rng.standard_normal(shape)
        return cls(np.maximum(thresholds, THRESHOLD_MIN), rng.uniform(0.0, 1.0, shape))

    def levels(self, logarithm: Array) -> Array:
        """Log intensity in units of the threshold; whole numbers are the trigger levels."""
        return np.asarray(logarithm / self.threshold + self.phase)


@dataclass(frozen=True, eq=False, slots=True)
class Events:
    """Events, arrays [n]; ``pixel`` is the row-major index, ``polarity`` 1 or -1."""

    time_s: Array
    pixel: NDArray[np.int64]
    polarity: NDArray[np.int64]

    def take(self, which: NDArray[np.intp] | NDArray[np.bool_]) -> Events:
        """Select events by index or mask."""
        return Events(self.time_s[which], self.pixel[which], self.polarity[which])

    @staticmethod
    def merge(parts: list[Events]) -> Events:
        """All events with times rounded to the microsecond, sorted by time, then by pixel."""
        events = Events.concatenate(parts)
        time_s = np.round(events.time_s, 6)
        ticks = np.rint(time_s * 1e6).astype(np.int64)
        places = 2 * events.pixel + (events.polarity > 0)
        order = stable_order(ticks, stable_order(places))
        return Events(time_s, events.pixel, events.polarity).take(order)

    @staticmethod
    def concatenate(parts: list[Events]) -> Events:
        """All events in the given order."""
        return Events(
            *(np.concatenate([getattr(part, name) for part in parts]) for name in Events.__slots__)
        )


def stable_order(
    numbers: NDArray[np.int64], before: NDArray[np.intp] | None = None
) -> NDArray[np.intp]:
    """Indices that sort integers [n] stably: a radix sort by 16 bits, linear in their count.

    Ties keep the order ``before``; None = the given order.
    """
    order = np.arange(len(numbers)) if before is None else before
    if len(numbers) == 0:
        return order
    left = numbers - numbers.min()
    for shift in range(0, int(left.max()).bit_length(), 16):
        digits = ((left >> shift) & 0xFFFF).astype(np.uint16)
        order = order[np.argsort(digits[order], kind="stable")]
    return order


def log_response(luminance: Array) -> Array:
    """Logarithm of luminance [cd/m^2] plus dark current."""
    return np.asarray(np.log(np.maximum(luminance, 0.0) + DARK_CD_M2))


def signal_events(levels: list[Array], times_s: Array) -> Events:
    """Events between frames: one per crossed level, at its linearly interpolated time.

    They are grouped by frame and not sorted by time. ``levels`` are ``Pixels.levels`` of at least
    two frames, ``times_s`` their instants.
    """
    flat = [level.ravel() for level in levels]
    # The last level reported is the nearest one behind, seen in the direction of the first change.
    state = np.where(flat[1] >= flat[0], np.floor(flat[0]), np.ceil(flat[0]))
    parts = []
    for k in range(len(flat) - 1):
        before, after = flat[k], flat[k + 1]
        up = np.maximum(np.floor(after) - state, 0.0)
        down = np.maximum(state - np.ceil(after), 0.0)
        for sign, crossed in ((1, up), (-1, down)):
            active = np.flatnonzero(crossed)
            count = crossed[active].astype(np.int64)
            pixel = np.repeat(active, count)
            rank = np.arange(len(pixel)) - np.repeat(np.cumsum(count) - count, count) + 1
            level = state[pixel] + sign * rank
            share = (level - before[pixel]) / (after[pixel] - before[pixel])
            time_s = times_s[k] + np.clip(share, 0.0, 1.0) * (times_s[k + 1] - times_s[k])
            parts.append(Events(time_s, pixel, np.full(len(pixel), sign)))
        state = state + up - down
    return Events.concatenate(parts)


def noise_events(
    luminance: Array, start_s: float, end_s: float, leak_hz: float, shot_hz: float, rng: Rng
) -> Events:
    """Noise events: positive ones by leakage, both polarities by shot noise, more in the dark.

    The rate of shot noise falls linearly with ``I / (I + mean I)`` of the intensity I.
    """
    duration_s = end_s - start_s
    intensity = luminance.ravel() + DARK_CD_M2
    brightness = intensity / (intensity + intensity.mean())
    shot = shot_hz * (1.0 - (1.0 - BRIGHT_SHARE) * brightness)
    parts = []
    for rate_hz, sign in ((leak_hz + 0.5 * shot, 1), (0.5 * shot, -1)):
        count = rng.poisson(rate_hz * duration_s)
        pixel = np.repeat(np.arange(len(count)), count)
        time_s = rng.uniform(start_s, end_s, len(pixel))
        parts.append(Events(time_s, pixel, np.full(len(pixel), sign)))
    return Events.concatenate(parts)


def apply_refractory_period(events: Events, refractory_s: float) -> Events:
    """Drop events in the dead time after their pixel's last kept event; they are sorted by time."""
    if refractory_s <= 0.0 or len(events.pixel) == 0:
        return events
    order = stable_order(events.pixel)
    pixel, time_s = events.pixel[order], events.time_s[order]
    soon = (np.diff(pixel) == 0) & (np.diff(time_s) < refractory_s)
    hasty: NDArray[np.bool_] = np.zeros(int(pixel[-1]) + 1, np.bool_)
    hasty[pixel[1:][soon]] = True
    # Most pixels have no two events so close and keep all of them: only the others are simulated.
    kept = ~hasty[events.pixel]
    order = order[hasty[pixel]]
    pixel = events.pixel[order]
    starts = np.flatnonzero(np.diff(pixel, prepend=-1))
    rank = np.arange(len(pixel)) - np.repeat(starts, np.diff(starts, append=len(pixel)))
    awake_s = np.full(len(hasty), -np.inf)
    by_rank = np.argsort(rank, kind="stable")
    for places in np.split(by_rank, np.cumsum(np.bincount(rank))[:-1]):
        time_s = events.time_s[order[places]]
        awake = time_s >= awake_s[pixel[places]]
        kept[order[places]] = awake
        awake_s[pixel[places][awake]] = time_s[awake] + refractory_s
    return events.take(kept)


SidePx = Annotated[int, Field(ge=8, le=2048)]
KIND = "event_camera"
VIEW = "gen_data.preview.sensor_views:event_view"
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

    columns: ClassVar[tuple[Column, ...]] = COLUMNS
    type: Literal["event_camera"] = "event_camera"
    name: str = Field("events", pattern=NAME_PATTERN)
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
        return self._info(self.name, Modality.DEVICE, KIND, columns=self.columns, view=VIEW)

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
            return Measurements(self.name, device, table_rows(COLUMNS, 0), scene.time_s)
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
            COLUMNS,
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
        lens = intrinsics.Intrinsics.from_hfov(width_px, height_px, math.radians(self.hfov_deg))
        luminances: list[Array] = []
        ids: list[np.ndarray] = []
        before: Scene | None = None
        for time_s in times_s:
            then = scene_time.scene_at(scene, float(time_s))
            if before is not None and _is_same_view(before, then, self.name):
                luminances.append(luminances[-1])
                ids.append(ids[-1])
                continue
            pose = then.device(self.name).T_world_device @ scene_time.RIG_AXES.inverse()
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
