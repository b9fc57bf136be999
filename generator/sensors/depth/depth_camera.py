"""Depth camera: its data sheet; measured depth and infrared images, besides the true ones."""

import math
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from gen_data.config.base_model import NAME_PATTERN, Strict
from gen_data.core import errors, streams
from gen_data.core.capture import LAYERS_USUAL, Channel, SensorReading
from gen_data.core.interfaces import Modality, Renderer, SensorInfo
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import PINHOLE
from gen_data.core.scene import Scene
from gen_data.sensors.camera import lens_models, rgb_camera
from gen_data.sensors.camera.image_pipeline import ImagePipeline, capture_photograph
from gen_data.sensors.depth.active_stereo import ActiveStereo
from gen_data.sensors.depth.structured_light import StructuredLight
from gen_data.sensors.depth.time_of_flight import TimeOfFlight
from gen_data.sensors.depth.view import Measured, View
from gen_data.sensors.device_presets import check_preset, load_preset
from gen_data.sensors.mounting import Mounted

SidePx = Annotated[int, Field(ge=8, le=4096)]


class Ideal(Strict):
    """Depth without errors."""

    kind: Literal["ideal"] = "ideal"

    def measure(self, view: View, rng: streams.Rng) -> Measured:
        """Measure true depth; white surfaces have an infrared value of 1000 at 1 m."""
        del rng
        hits = view.trace()
        signal = 1000.0 * hits.reflectance[..., 0] / np.square(hits.range_m[..., 0])
        infrared = np.rint(np.clip(signal, 0, 65_535)).astype(np.uint16)
        return Measured(view.z_depth_m(0.0), infrared)


class DepthModel(Strict):
    """Data sheet of a depth camera.

    Attributes:
        size_px: Width and height of its images.
        hfov_deg: Horizontal field of view.
        range_m: Smallest and largest reported depth.
        principle: Principle of measurement: ``ideal``, ``structured_light``, ``active_stereo`` or
            ``time_of_flight``.
    """

    size_px: tuple[SidePx, SidePx] = (640, 480)
    hfov_deg: float = Field(60.0, ge=1, le=150)
    range_m: tuple[float, float] = (0.2, 10.0)
    principle: Annotated[
        Ideal | StructuredLight | ActiveStereo | TimeOfFlight, Field(discriminator="kind")
    ] = Ideal()

    @model_validator(mode="after")
    def _range_rises(self) -> "DepthModel":
        low, high = self.range_m
        if not 0.0 <= low < high:
            raise ValueError(f"range_m must rise from 0 or more, got [{low:g}, {high:g}]")
        return self


MODELS = "gen_data.sensors.depth"
IDEAL = ImagePipeline()
OWN = frozenset({Channel.MEASURED_DEPTH, Channel.INFRARED})

DepthImage = Literal[
    Channel.MEASURED_DEPTH, Channel.INFRARED, Channel.RGB, Channel.Z_DEPTH, Channel.RANGE,
    Channel.NORMALS, Channel.INSTANCE, Channel.PART, Channel.CATEGORY, Channel.OBJECT_COORDINATES,
    Channel.DEPTH_LAYERS, Channel.INSTANCE_LAYERS, Channel.MATERIAL_LAYERS, Channel.SEEN_IN_MIRROR,
    Channel.MIRRORED_POSITION,
]  # fmt: skip
"""Channels that can be written as images; all but the first two are ground truth."""


class DepthCamera(Mounted):
    """A depth camera; randomizers vary its pose like any camera's.

    ``measured_depth`` is the device's output; ``depth`` and all labels are ground truth.

    Attributes:
        name: Its name in labels, files and randomizers.
        model: A file of ``generator/sensors/depth``, or the content of one.
        size_px: Width and height of its images; null = the model's.
        hfov_deg: Horizontal field of view; null = the model's.
        intrinsics: Focal lengths and principal point, in place of hfov_deg.
        channels: Channels to write as images.
        layers: Number of surfaces along each ray in channels of layers, as of rgb_camera.
    """

    type: Literal["depth_camera"] = "depth_camera"
    name: str = Field("depth_camera", pattern=NAME_PATTERN)
    model: str | DepthModel = "kinect_v2"
    size_px: tuple[SidePx, SidePx] | None = None
    hfov_deg: float | None = Field(None, ge=1, le=150)
    intrinsics: lens_models.MeasuredIntrinsics | None = None
    channels: tuple[DepthImage, ...] = Field(
        (Channel.MEASURED_DEPTH, Channel.INFRARED, Channel.Z_DEPTH), min_length=1
    )
    layers: rgb_camera.LayerCount = LAYERS_USUAL

    @field_validator("model")
    @classmethod
    def _is_known(cls, model: str | DepthModel) -> str | DepthModel:
        return check_preset(MODELS, model) if isinstance(model, str) else model

    @model_validator(mode="after")
    def _has_one_lens(self) -> "DepthCamera":
        if self.intrinsics is not None:
            if self.hfov_deg is not None:
                raise ValueError("intrinsics: excludes hfov_deg")
            self.intrinsics.check_size(*(self.size_px or self.device.size_px))
        return self

    @model_validator(mode="after")
    def _has_layers(self) -> "DepthCamera":
        rgb_camera.check_layers(self.model_fields_set, self.media)
        return self

    @property
    def device(self) -> DepthModel:
        """The data sheet."""
        model = self.model
        return load_preset(MODELS, model, DepthModel) if isinstance(model, str) else model

    @property
    def media(self) -> tuple[Channel, ...]:
        """Channels to write as images, in the order of ``Channel``."""
        return tuple(channel for channel in Channel if channel in self.channels)

    def nominal_intrinsics(self) -> Intrinsics:
        """Nominal intrinsics."""
        device = self.device
        width_px, height_px = self.size_px or device.size_px
        if self.intrinsics is not None:
            return self.intrinsics.at_size(width_px, height_px, PINHOLE)
        hfov_deg = device.hfov_deg if self.hfov_deg is None else self.hfov_deg
        return Intrinsics.from_hfov(width_px, height_px, math.radians(hfov_deg))

    def describe(self) -> SensorInfo:
        """Describe a camera with the channels that it writes."""
        lens = self.nominal_intrinsics().lens.model
        return self._info(self.name, Modality.CAMERA, channels=self.media, lens=lens)

    def mount(self, scene: Scene) -> Scene:
        """Add this camera, on its rig or looking at the scene's focus, unless it exists.

        Raises:
            ConfigError: the scene has no such rig.
        """
        mounted = rgb_camera.add_camera(scene, self.name, self, self.nominal_intrinsics())
        return rgb_camera.with_layers(mounted, self.name, self.layers, self.media)

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: streams.Rng
    ) -> SensorReading:
        """Capture its own channels and the requested ones; labels are ground truth.

        Raises:
            SampleError: a randomizer gave it a lens other than a pinhole.
        """
        requested = channels | set(self.media)
        camera = scene.camera(self.name)
        if not camera.intrinsics.straight:
            raise errors.SampleError(
                f"sensor '{self.name}': a depth camera is a pinhole, got the lens "
                f"{camera.intrinsics.lens.model}; exclude it from randomizers of lenses"
            )
        reading = capture_photograph(scene, renderer, camera, requested - OWN, IDEAL, rng)
        if not OWN & requested:
            return reading
        device = self.device
        measured = device.principle.measure(View(scene, renderer, camera), rng)
        low_m, high_m = device.range_m
        within = (measured.z_m >= low_m) & (measured.z_m <= high_m)
        own: dict[Channel, NDArray[Any]] = {
            Channel.MEASURED_DEPTH: np.where(within, measured.z_m, np.float32(np.inf)),
            Channel.INFRARED: measured.infrared,
        }
        kept = {channel: image for channel, image in own.items() if channel in requested}
        return replace(reading, channels={**reading.channels, **kept})
