"""Faults of cameras: dead pixels and lines, dirt on the window, overexposed pictures."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.config.distributions import Bounds, Constant, Count, Distribution, Scalar
from gen_data.core.asset_types import Float32
from gen_data.core.capture import Channel, LidarHits, LidarRays, SensorReading
from gen_data.core.interfaces import FindTones, Renderer
from gen_data.core.scene import Camera, Lidar, Scene
from gen_data.core.streams import Rng
from gen_data.sensors.camera.image_pipeline import ImagePipeline
from gen_data.sensors.fault_draws import fault_stream
from gen_data.sensors.sensor_faults import SensorFaults

NONE = Constant(0.0)
SPOT_RADII = (0.01, 0.06)
"""Radii of spots over the picture's diagonal (assumed)."""
SPOT_OPACITY = (0.4, 0.95)
"""Share of the light that the middle of a spot takes (assumed)."""
SCATTERED = 0.1
"""Share of the light on a spot that it scatters into the picture, evenly (assumed)."""
SPOTS_MAX = 2000


class Overexposed(Strict):
    """Pictures whose exposure failed, as by a flash or a late control loop.

    Attributes:
        probability: Share of pictures.
        ev: Stops of too much light.
    """

    probability: float = Field(ge=0, le=1)
    ev: Annotated[Scalar, Bounds(0, 12)] = Constant(4.0)


class CameraFaults(SensorFaults):
    """Faults of photographs; a sequence has one camera, whose pixels and dirt stay.

    Attributes:
        dead_pixels: Share of pixels that are always black or always white.
        dead_lines: Number of rows and columns without a signal.
        dirt: Share of the picture behind spots of dirt on the window, out of focus.
        overexposed: Pictures with too much light; null = none.
    """

    dead_pixels: Annotated[Scalar, Bounds(0, 0.01)] = NONE
    dead_lines: Count = Constant(0)
    dirt: Annotated[Scalar, Bounds(0, 0.9)] = NONE
    overexposed: Overexposed | None = None

    def draw(self, camera: Camera, rng: Rng) -> "DrawnCameraFaults":
        """Faults of one picture; ``rng`` is the sensor's stream at this step."""
        own = fault_stream(rng)
        shared = own.of_sequence()
        lens = camera.intrinsics
        shape = (lens.height_px, lens.width_px)
        count = round(self.dead_pixels.draw(shared) * shape[0] * shape[1])
        places = np.sort(shared.choice(shape[0] * shape[1], count, replace=False))
        pixels = np.stack(
            [*np.divmod(places, shape[1]), 255 * shared.integers(0, 2, count)], axis=1
        )
        lines = shared.integers(0, shape[0] + shape[1], self.dead_lines.draw(shared))
        spots = _draw_spots(self.dirt.draw(shared), shape, shared)
        failed = self.overexposed
        ev = 0.0
        if failed is not None and own.uniform() < failed.probability:
            ev = float(failed.ev.draw(own))
        return DrawnCameraFaults(shape, pixels, np.unique(lines), spots, ev)


@dataclass(frozen=True, eq=False, slots=True)
class DrawnCameraFaults:
    """Faults of one picture.

    Attributes:
        shape: Height and width of the picture [px].
        pixels: Row, column and byte of dead pixels, int [n, 3].
        lines: Dead lines, int [n]: rows from 0, then columns from the height on.
        spots: Image coordinates and radius [px] of spots of dirt, and the share of the light that
            their middle takes, [n, 4].
        ev: Stops of too much light.
    """

    shape: tuple[int, int]
    pixels: NDArray[np.int64]
    lines: NDArray[np.int64]
    spots: NDArray[np.float64]
    ev: float

    def exposed(self, pipeline: ImagePipeline) -> ImagePipeline:
        """The pipeline with the error of its exposure."""
        if self.ev == 0.0:
            return pipeline
        wrong = _Raised(pipeline.exposure_error_ev, self.ev)
        return pipeline.model_copy(update={"exposure_error_ev": wrong})

    def behind_window(self, renderer: Renderer) -> Renderer:
        """The renderer as seen through the dirt."""
        return _DirtyWindow(renderer, self) if len(self.spots) else renderer

    def opacity(self) -> Float32:
        """Share of the light that dirt takes from each pixel, float32 [h, w]."""
        height, width = self.shape
        passed = np.ones(self.shape, np.float32)
        for x, y, radius, share in self.spots:
            low = max(int(y - radius), 0), max(int(x - radius), 0)
            high = min(int(y + radius) + 1, height), min(int(x + radius) + 1, width)
            window = np.s_[low[0] : high[0], low[1] : high[1]]
            rows, columns = np.mgrid[window].astype(np.float64) + 0.5
            far = np.hypot(columns - x, rows - y) / radius
            # Full in the inner half, none at the rim: the window is out of focus.
            edge = np.clip(2.0 - 2.0 * far, 0.0, 1.0)
            passed[window] *= (1.0 - share * edge * edge * (3.0 - 2.0 * edge)).astype(np.float32)
        return np.asarray(np.float32(1.0) - passed, np.float32)

    def spoil(self, reading: SensorReading) -> SensorReading:
        """The reading with dead pixels and lines in its photograph, and a record of all faults."""
        if Channel.RGB not in reading.channels:
            return reading
        rgb = reading.channels[Channel.RGB].copy()
        rows, columns, values = self.pixels.T
        rgb[rows, columns] = values[:, None]
        height = self.shape[0]
        rgb[self.lines[self.lines < height]] = 0
        rgb[:, self.lines[self.lines >= height] - height] = 0
        channels = {**reading.channels, Channel.RGB: rgb}
        return replace(reading, channels=channels, faults=self.record())

    def record(self) -> Mapping[str, Any]:
        """The present faults as plain data."""
        height = self.shape[0]
        record = {
            "dead_pixels": self.pixels.tolist(),
            "dead_rows": self.lines[self.lines < height].tolist(),
            "dead_columns": (self.lines[self.lines >= height] - height).tolist(),
            "dirt_spots": self.spots.tolist(),
            "overexposed_ev": self.ev,
        }
        return {name: value for name, value in record.items() if value}


@dataclass(frozen=True, slots=True)
class _Raised:
    """A distribution whose values are higher by a constant."""

    drawn: Distribution[float]
    by: float

    def draw(self, rng: Rng) -> float:
        return float(self.drawn.draw(rng)) + self.by


@dataclass(frozen=True, eq=False, slots=True)
class _DirtyWindow:
    """A renderer behind a window with dirt, which takes light and scatters it."""

    renderer: Renderer
    faults: DrawnCameraFaults

    def render(
        self,
        scene: Scene,
        camera: Camera,
        channels: frozenset[Channel],
        find_tones: FindTones | None = None,
    ) -> SensorReading:
        reading = self.renderer.render(scene, camera, channels, find_tones)
        radiance = reading.channels.get(Channel.RADIANCE)
        if radiance is None:
            return reading
        opacity = self.faults.opacity()[..., None]
        veil = np.float32(SCATTERED) * radiance.mean(axis=(0, 1), dtype=np.float64)
        dimmed = radiance * (np.float32(1.0) - opacity) + opacity * veil.astype(np.float32)
        return replace(reading, channels={**reading.channels, Channel.RADIANCE: dimmed})

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        return self.renderer.scan(scene, lidar, beams)


def _draw_spots(share: float, shape: tuple[int, int], rng: Rng) -> NDArray[np.float64]:
    """Spots until they cover this share of the picture, half their radius counted, [n, 4]."""
    height, width = shape
    diagonal_px, spots, left = math.hypot(height, width), list[tuple[float, ...]](), 1.0
    low, high = (math.log(radius) for radius in SPOT_RADII)
    while left > 1.0 - share and len(spots) < SPOTS_MAX:
        radius_px = diagonal_px * math.exp(float(rng.uniform(low, high)))
        place = rng.uniform(0.0, width), rng.uniform(0.0, height)
        spots.append((*place, radius_px, rng.uniform(*SPOT_OPACITY)))
        # Spots overlap by chance.
        left *= max(1.0 - math.pi * (0.75 * radius_px) ** 2 / (height * width), 0.0)
    return np.round(np.array(spots).reshape(-1, 4), 3)
