"""Camera with photographs and all label channels."""

import math
from collections.abc import Collection
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from gen_data.config.base_model import NAME_PATTERN
from gen_data.core import errors, scene_time, se3, streams
from gen_data.core.capture import (
    LAYERS,
    LAYERS_MAX,
    LAYERS_USUAL,
    Channel,
    SensorReading,
)
from gen_data.core.interfaces import Modality, Renderer, SensorInfo
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Camera, Region, Scene
from gen_data.core.shutter import INSTANT, Shutter
from gen_data.core.stereo import baseline_m, disparity_px, is_seen_by_both
from gen_data.sensors.camera import lens_models
from gen_data.sensors.camera.camera_faults import CameraFaults
from gen_data.sensors.camera.exposure import ExposureTime, RollingShutter, make_shutter
from gen_data.sensors.camera.image_pipeline import ImagePipeline, capture_photograph
from gen_data.sensors.camera.rgb_encoding import RgbEncoding
from gen_data.sensors.mounting import Mounted, check_rig
from gen_data.sensors.sensor_faults import check_most

Image = Literal[
    Channel.RGB, Channel.Z_DEPTH, Channel.RANGE, Channel.NORMALS, Channel.INSTANCE, Channel.PART,
    Channel.CATEGORY, Channel.OBJECT_COORDINATES, Channel.DISPARITY, Channel.DISPARITY_VISIBLE,
    Channel.FLOW_FORWARD, Channel.FLOW_BACKWARD, Channel.FLOW_OCCLUDED_FORWARD,
    Channel.FLOW_OCCLUDED_BACKWARD, Channel.SCENE_FLOW, Channel.DEPTH_LAYERS,
    Channel.INSTANCE_LAYERS, Channel.MATERIAL_LAYERS, Channel.SEEN_IN_MIRROR,
    Channel.MIRRORED_POSITION,
]  # fmt: skip
"""Channels that can be written as images; see ``gen_data.core.capture.Channel``."""

PAIRED = frozenset({Channel.DISPARITY, Channel.DISPARITY_VISIBLE})
"""Channels that need a second camera."""

SidePx = Annotated[int, Field(ge=8, le=8192)]
LayerCount = Annotated[int, Field(ge=1, le=LAYERS_MAX)]

PINHOLE_MAX_DEG = 170.0
NOMINAL_AZIMUTH_RAD = math.radians(-60.0)
NOMINAL_ELEVATION_RAD = math.radians(35.0)


class RgbCamera(Mounted):
    """A camera, by default without distortion; randomizers vary its pose and lens.

    Attributes:
        name: Its name in labels, files and randomizers.
        size_px: Width and height of its images.
        hfov_deg: Nominal horizontal field of view, along the middle row; tangential terms are
            left out, and black pixels outside a lens's field count.
        lens: Projection: a pinhole; brown_conrady, OpenCV's standard model with k1 to k6, p1 and
            p2; kannala_brandt, its fisheye with k1 to k4; both with field_deg, the full field of
            view outside which images are black; equirectangular, a panorama; or calibrated, a
            known ``camera`` or one of a calibration ``file``, with its own field of view.
        intrinsics: Focal lengths and principal point, in place of hfov_deg; null = as hfov_deg.
        channels: Channels to write as images.
        layers: Number of surfaces along each ray in depth_layers, instance_layers and
            material_layers, which show all see-through ones and the first that is not.
        ev100: Fixed exposure value at ISO 100; null = metered.
        exposure: Exposure time; null = an instant. Labels refer to the middle of the exposure,
            which is the instant of the step.
        rolling_shutter: Rows are read one after the other; null = all at once. Labels in the
            image, including keypoints, refer to the instant of their row, labels in space to that
            of the middle row, which is the instant of the step.
        image_pipeline: From radiance to photographs: lens, exposure, sensor, tone, JPEG.
        rgb_encoding: Files of the rgb channel: lossless PNG, or smaller JPEG or WebP.
        stereo_with: For the channels ``disparity`` and ``disparity_visible``: name of the camera
            to its right that forms a rectified pair with it.
        settings_of: Name of the camera whose drawn settings of the image pipeline it shares, as
            the cameras of one rig do; each meters its own image. Empty = separate settings.
        faults: Dead pixels and lines, dirt, overexposed pictures; null = none.
    """

    type: Literal["rgb_camera"] = "rgb_camera"
    name: str = Field("color", pattern=NAME_PATTERN)
    size_px: tuple[SidePx, SidePx] = (640, 480)
    hfov_deg: float = Field(60.0, ge=1, le=360)
    lens: lens_models.LensConfig = lens_models.Pinhole()
    intrinsics: lens_models.MeasuredIntrinsics | None = None
    channels: tuple[Image, ...] = Field(
        (Channel.RGB, Channel.Z_DEPTH, Channel.INSTANCE, Channel.CATEGORY), min_length=1
    )
    layers: LayerCount = LAYERS_USUAL
    ev100: float | None = None
    exposure: ExposureTime | None = None
    rolling_shutter: RollingShutter | None = None
    image_pipeline: ImagePipeline = ImagePipeline()
    rgb_encoding: RgbEncoding = RgbEncoding()
    stereo_with: str = ""
    settings_of: str = ""
    faults: CameraFaults | None = None

    @model_validator(mode="after")
    def _has_a_partner(self) -> "RgbCamera":
        if not self.stereo_with and PAIRED & set(self.media):
            raise ValueError("disparity needs a second camera: name it with stereo_with")
        return self

    @model_validator(mode="after")
    def _has_layers(self) -> "RgbCamera":
        check_layers(self.model_fields_set, self.media)
        return self

    @model_validator(mode="after")
    def _has_the_lines(self) -> "RgbCamera":
        if self.faults is not None:
            _, most = self.faults.dead_lines.support()
            check_most("faults.dead_lines", most, sum(self.size_px), "rows and columns")
        return self

    @model_validator(mode="after")
    def _has_a_lens(self) -> "RgbCamera":
        if isinstance(self.lens, lens_models.Pinhole) and self.hfov_deg > PINHOLE_MAX_DEG:
            raise ValueError(
                f"hfov_deg: {self.hfov_deg:g} is too wide for a pinhole; expected at most "
                f"{PINHOLE_MAX_DEG:g}, or another lens, such as {{model: kannala_brandt}}"
            )
        calibrated = isinstance(self.lens, lens_models.CalibratedLens)
        if calibrated and "hfov_deg" in self.model_fields_set:
            raise ValueError("a calibrated lens has its own field of view: leave out hfov_deg")
        if self.intrinsics is not None:
            if calibrated or "hfov_deg" in self.model_fields_set:
                other = "a calibrated lens" if calibrated else "hfov_deg"
                raise ValueError(f"intrinsics: excludes {other}, which defines the focal lengths")
            self.intrinsics.check_size(*self.size_px)
        if self.nominal_intrinsics().folds_over():
            raise ValueError(
                f"lens {self.lens.model}: its polynomial folds over inside the image; check the "
                "signs and magnitudes of its coefficients, reduce hfov_deg, or limit its field "
                f"with field_deg{_widest_field(self.nominal_intrinsics().lens)}"
            )
        return self

    def nominal_intrinsics(self) -> Intrinsics:
        """Nominal intrinsics.

        Raises:
            ValueError: the lens's field is narrower than ``hfov_deg``.
        """
        width_px, height_px = self.size_px
        if isinstance(self.lens, lens_models.CalibratedLens):
            return self.lens.intrinsics(width_px, height_px)
        if self.intrinsics is not None:
            return self.intrinsics.at_size(width_px, height_px, self.lens.lens())
        hfov_rad = math.radians(self.hfov_deg)
        return Intrinsics.from_hfov(width_px, height_px, hfov_rad, self.lens.lens())

    @property
    def media(self) -> tuple[Channel, ...]:
        """Channels to write as images, in the order of ``Channel``."""
        return tuple(channel for channel in Channel if channel in self.channels)

    def describe(self) -> SensorInfo:
        """Describe a camera with the channels that it writes."""
        lens = self.nominal_intrinsics().lens.model
        encoding = self.rgb_encoding.described()
        partner = self.stereo_with if PAIRED & set(self.media) else ""
        return self._info(
            self.name,
            Modality.CAMERA,
            channels=self.media,
            lens=lens,
            rgb_encoding=encoding,
            stereo_with=partner,
        )

    def mount(self, scene: Scene) -> Scene:
        """Add this camera, on its rig or looking at the scene's focus, unless it exists."""
        shutter = make_shutter(self.exposure, self.rolling_shutter)
        lens = self.nominal_intrinsics()
        mounted = add_camera(scene, self.name, self, lens, ev100=self.ev100, shutter=shutter)
        return with_layers(mounted, self.name, self.layers, self.media)

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: streams.Rng
    ) -> SensorReading:
        """Capture its own channels and the requested ones; RGB passes the image pipeline.

        Raises:
            SampleError: it forms no rectified pair with ``stereo_with``.
        """
        requested = channels | set(self.media)
        paired = bool(self.stereo_with and PAIRED & requested)
        seen = (requested - PAIRED) | {Channel.Z_DEPTH} if paired else requested
        camera = scene.camera(self.name)
        settings_rng = self._settings_rng(scene, rng)
        faults, lens, pipeline = None, renderer, self.image_pipeline
        if self.faults is not None:
            faults = self.faults.draw(camera, rng)
            lens, pipeline = faults.behind_window(renderer), faults.exposed(pipeline)
        reading = capture_photograph(scene, lens, camera, seen, pipeline, rng, settings_rng)
        reading = reading if faults is None else faults.spoil(reading)
        return self._add_disparity(scene, renderer, reading) if paired else reading

    def _settings_rng(self, scene: Scene, rng: streams.Rng) -> streams.Rng:
        if not self.settings_of:
            return rng
        known = [camera.name for camera in scene.cameras]
        check_camera(self.name, "settings_of", self.settings_of, known)
        return rng.streams.rng(f"{rng.name.rpartition('/')[0]}/{self.settings_of}")

    def _add_disparity(
        self, scene: Scene, renderer: Renderer, reading: SensorReading
    ) -> SensorReading:
        known = {camera.name: camera for camera in scene.cameras}
        check_camera(self.name, "stereo_with", self.stereo_with, known)
        left, right = known[self.name], known[self.stereo_with]
        try:
            scale = left.intrinsics.fx_px * baseline_m(left, right)
        except ValueError as error:
            raise errors.SampleError(
                f"sensors '{left.name}' and '{right.name}' are not a rectified pair: {error};"
                " mount them on one rig with the same size, field of view, lens and angles, the"
                " second straight to the right of the first, and vary neither alone by a randomizer"
            ) from error
        other = renderer.render(scene, right, frozenset({Channel.Z_DEPTH}))
        left_px = disparity_px(reading.channels[Channel.Z_DEPTH], scale)
        visible = is_seen_by_both(left_px, disparity_px(other.channels[Channel.Z_DEPTH], scale))
        pair = {
            Channel.DISPARITY: left_px,
            Channel.DISPARITY_VISIBLE: np.where(visible, left_px, np.float32(0.0)),
        }
        return replace(reading, channels={**reading.channels, **pair})


def check_layers(fields: Collection[str], channels: Collection[Channel]) -> None:
    """Raise ValueError if the field ``layers`` is set, but no channel has layers."""
    if "layers" in fields and not LAYERS.keys() & set(channels):
        raise ValueError(f"layers: no channel has any; add one of {', '.join(LAYERS)}")


def with_layers(scene: Scene, name: str, layers: int, channels: Collection[Channel]) -> Scene:
    """The scene with a camera's number of layers, if it writes channels that have any."""
    if not LAYERS.keys() & set(channels):
        return scene
    cameras = (replace(c, layers=layers) if c.name == name else c for c in scene.cameras)
    return replace(scene, cameras=tuple(cameras))


def check_camera(name: str, field: str, other: str, known: Collection[str]) -> None:
    """Raise ConfigError if the camera that a camera's field names is not among the known ones."""
    if other not in known:
        raise errors.ConfigError(
            f"sensor '{name}': {field}: there is no camera '{other}'; "
            f"expected one of {', '.join(known)}{errors.did_you_mean(other, known)}"
        )


def add_camera(
    scene: Scene,
    name: str,
    mounted: Mounted,
    intrinsics: Intrinsics,
    *,
    ev100: float | None = None,
    shutter: Shutter = INSTANT,
) -> Scene:
    """Add a camera on its rig, or looking at the scene's focus, unless one of its name exists.

    Raises:
        ConfigError: the scene has no such rig.
    """
    if any(camera.name == name for camera in scene.cameras):
        return scene
    if mounted.rig:
        rig = check_rig(scene, name, mounted.rig)
        T_rig_camera = mounted.T_rig_sensor @ scene_time.RIG_AXES.inverse()
        camera = Camera(name, se3.SE3(), intrinsics, ev100, rig, T_rig_camera, shutter)
    else:
        pose = _nominal_pose(scene.focus, _narrower_half_rad(intrinsics))
        camera = Camera(name, pose, intrinsics, ev100, shutter=shutter)
    return replace(scene, cameras=(*scene.cameras, camera))


def _narrower_half_rad(intrinsics: Intrinsics) -> float:
    """Half the field of view along the image's shorter side, at most pi / 2."""
    narrower_px = 0.5 * min(intrinsics.width_px, intrinsics.height_px)
    if intrinsics.straight:
        return math.atan(narrower_px / intrinsics.fx_px)
    rim = intrinsics.rays(np.array([intrinsics.cx_px + narrower_px, intrinsics.cy_px]))
    seen_rad = float(np.arccos(np.clip(rim[2], 0.0, 1.0))) if np.isfinite(rim[2]) else math.pi
    return min(seen_rad, intrinsics.lens.half_field_rad, 0.5 * math.pi)


def _nominal_pose(focus: Region, half_angle_rad: float) -> se3.SE3:
    """``T_world_camera`` with the whole focus in view."""
    radius_m = 0.5 * math.hypot(*focus.size_m)
    distance_m = radius_m / math.sin(min(half_angle_rad, math.radians(45.0)))
    level_m = distance_m * math.cos(NOMINAL_ELEVATION_RAD)
    x, y, z = focus.center_m
    eye = (
        x + level_m * math.cos(NOMINAL_AZIMUTH_RAD),
        y + level_m * math.sin(NOMINAL_AZIMUTH_RAD),
        z + distance_m * math.sin(NOMINAL_ELEVATION_RAD),
    )
    return se3.look_at(eye, focus.center_m).rounded()


def _widest_field(lens: Lens) -> str:
    """The largest field of view of a lens before its radial polynomial folds over, in words."""
    if lens.fold_rad is None:
        return ""
    return f" of at most {math.floor(20.0 * math.degrees(lens.fold_rad)) / 10.0:g}"
