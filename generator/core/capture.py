"""Readings of sensors: images, point clouds and measurements."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core.scene import Camera, Device, Lidar

ImageFormat = Literal["png", "jpeg", "webp", "webp_lossless"]


@dataclass(frozen=True, slots=True)
class ImageEncoding:
    """Encoding of image files.

    Attributes:
        format: File format.
        quality: Quality of jpeg and webp, from 1 to 100; 0 for lossless formats.
    """

    format: ImageFormat = "png"
    quality: int = 0

    @property
    def suffix(self) -> str:
        """Ending of the files' names."""
        return {"png": ".png", "jpeg": ".jpg"}.get(self.format, ".webp")


PNG = ImageEncoding()


class Channel(str, Enum):
    """An image of a scene. Label channels come from the pixel-centre ray alone.

    ====================  ======================  ==========================================
    channel               array                   meaning; value for "nothing"
    ====================  ======================  ==========================================
    RGB                   uint8 [h, w, 3]         sRGB: a photograph, which a camera develops from
                                                  RADIANCE; a renderer ends there
    RADIANCE              float32 [h, w, 3]       luminance, linear RGB [cd/m^2]: means over pixels
    Z_DEPTH               float32 [h, w]          along the optical axis [m]; inf, also next to and
                                                  behind the camera, where wide lenses look
    RANGE                 float32 [h, w]          along the ray [m]; inf
    NORMALS               float32 [h, w, 3]       unit, camera frame, towards the camera; 0
    INSTANCE              uint16 [h, w]           instance id; 0
    PART                  uint16 [h, w]           part id within the instance; 0
    CATEGORY              uint16 [h, w]           category id; 0
    OBJECT_COORDINATES    float32 [h, w, 3]       position in the instance's box, [0, 1]; 0
    AMODAL                (silhouettes)           each instance alone, also outside the image
    SIGNAL                (expected signal)       a photograph before its noise; none without RGB
    MEASURED_DEPTH        float32 [h, w]          depth as a device reports it [m]; inf
    INFRARED              uint16 [h, w]           image of the device's own light, device units; 0
    DISPARITY             float32 [h, w]          to the camera on the right [px]; 0
    DISPARITY_VISIBLE     float32 [h, w]          the same where that camera sees it too; 0
    FLOW_FORWARD          float32 [h, w, 2]       to where the seen point is in this camera's
                                                  image a step later [px]; NaN
    FLOW_BACKWARD         float32 [h, w, 2]       the same a step earlier; NaN
    FLOW_OCCLUDED_...     uint8 [h, w]            1 where that point cannot be seen then: it is
                                                  not in the image, or the pixel that it lies in
                                                  shows a nearer surface; 1
    SCENE_FLOW            float32 [h, w, 3]       where the seen point is a step later, in the
                                                  camera frame of then, minus where it is now, in
                                                  the current camera frame [m]; NaN
    DEPTH_LAYERS          float32 [h, w, k]       Z_DEPTH of the surfaces along a ray; inf
    INSTANCE_LAYERS       uint16 [h, w, k]        their instance ids; 0
    MATERIAL_LAYERS       uint16 [h, w, k]        their materials: numbers in
                                                  ``asset_types.LAYER_MATERIALS``; 0
    SEEN_IN_MIRROR        uint16 [h, w]           id of the instance that a mirror shows; 0
    MIRRORED_POSITION     float32 [h, w, 3]       where the point is that a mirror shows, in the
                                                  world frame [m]; NaN
    ====================  ======================  ==========================================

    Layers are the surfaces that a straight ray meets up to the first one that nothing is seen
    through, that one included: both sides of glass, but not the back of a box. The first layer is
    Z_DEPTH or INSTANCE; there are as many as ``Camera.layers`` states. Mirrors are the mirrors of
    LAYER_MATERIALS that a ray ends at, also behind glass, and show the first surface on the ray
    that they reflect.

    A sky is at infinity and has the flow that the camera's rotation gives it; ``u + FLOW`` is the
    image of ``p + SCENE_FLOW``. Flow is NaN where the lens has no image of the point then, and
    FLOW_BACKWARD everywhere before a whole step has passed. Behind a rolling shutter "now" and
    "then" are the instants of the rows that the point is on.
    """

    RGB = "rgb"
    RADIANCE = "radiance"
    Z_DEPTH = "depth"
    RANGE = "range"
    NORMALS = "normals"
    INSTANCE = "instance"
    PART = "part"
    CATEGORY = "category"
    OBJECT_COORDINATES = "object_coordinates"
    AMODAL = "amodal"
    SIGNAL = "signal"
    MEASURED_DEPTH = "measured_depth"
    INFRARED = "infrared"
    DISPARITY = "disparity"
    DISPARITY_VISIBLE = "disparity_visible"
    FLOW_FORWARD = "flow_forward"
    FLOW_BACKWARD = "flow_backward"
    FLOW_OCCLUDED_FORWARD = "flow_occluded_forward"
    FLOW_OCCLUDED_BACKWARD = "flow_occluded_backward"
    SCENE_FLOW = "scene_flow"
    DEPTH_LAYERS = "depth_layers"
    INSTANCE_LAYERS = "instance_layers"
    MATERIAL_LAYERS = "material_layers"
    SEEN_IN_MIRROR = "seen_in_mirror"
    MIRRORED_POSITION = "mirrored_position"

    def __str__(self) -> str:
        """The name in YAML and of folders."""
        return self.value

    @property
    def is_image(self) -> bool:
        """Whether it is one of ``SensorReading.channels``."""
        return self not in (Channel.AMODAL, Channel.SIGNAL)


LAYERS: Mapping[Channel, float] = {
    Channel.DEPTH_LAYERS: math.inf,
    Channel.INSTANCE_LAYERS: 0,
    Channel.MATERIAL_LAYERS: 0,
}
"""Channels of several surfaces along each ray, with the value where there is no further one."""

MIRRORED: Mapping[Channel, NDArray[Any]] = {
    Channel.SEEN_IN_MIRROR: np.zeros((), np.uint16),
    Channel.MIRRORED_POSITION: np.full(3, np.nan, np.float32),
}
"""Channels of mirrored surfaces, with the value of a pixel without a mirrored surface."""

LAYERS_MAX = 8
"""Largest number of layers."""
LAYERS_USUAL = 4
"""Layers of cameras that state no number: a drinking glass has four surfaces."""


@dataclass(frozen=True, eq=False, slots=True)
class Silhouette:
    """An instance without occlusion, on a canvas three images wide and high.

    The canvas extends the image as a larger sensor would, within the lens's field: it is empty
    outside the image of a lens whose whole field is in the image.

    Attributes:
        x_px, y_px: Image coordinates of the mask's first pixel; may be negative.
        mask: bool [h, w], tight around the silhouette; [0, 0] = not in the canvas.
    """

    instance_id: int
    x_px: int
    y_px: int
    mask: NDArray[np.bool_]


@dataclass(frozen=True, eq=False, slots=True)
class ExpectedSignal:
    """A photograph's noise-free expectation, as its sensor reads it, and its noise.

    Both are shares of saturation, float32 [h, w, c]: one value of a pixel behind a colour filter
    (the pattern repeats after two pixels) or on a monochrome sensor, three of others.

    Attributes:
        mean: Mean of repeated photographs.
        stddev: Standard deviation of one photograph about the mean, the sensor's fixed pattern
            included.
    """

    mean: NDArray[np.float32]
    stddev: NDArray[np.float32]


@dataclass(frozen=True, eq=False, slots=True)
class SensorReading:
    """Reading of one camera.

    Attributes:
        channels: Arrays by channel, as listed in Channel.
        silhouettes: By instance id; empty unless AMODAL was requested.
        time_s: The instant that depth, ids and boxes refer to; with a rolling shutter, the instant
            of the image's middle row (see ``camera.shutter``).
        ev100: Exposure value that was set or metered; None without a photograph.
        signal: Expected signal of the photograph; None without one, or unless SIGNAL was requested.
        faults: Faults in the photograph, as plain data; see ``sensors.fault_draws``.
    """

    sensor: str
    camera: Camera
    channels: Mapping[Channel, NDArray[Any]]
    silhouettes: Mapping[int, Silhouette] = field(default_factory=dict)
    time_s: float = 0.0
    ev100: float | None = None
    signal: ExpectedSignal | None = None
    faults: Mapping[str, Any] = field(default_factory=dict)


POINT = np.dtype(
    [
        ("position_m", "<f4", (3,)),
        ("intensity", "<f4"),
        ("time_s", "<f4"),
        ("ring", "<u2"),
        ("instance_id", "<u2"),
        ("category_id", "<u2"),
        ("surface", "u1"),
        ("return_number", "u1"),
        ("return_count", "u1"),
    ]
)
"""One point of a laser scan.

========================  ====================================================================
position_m                lidar frame: X forward, Y left, Z up [m]
intensity                 [0, 1], as the device reports it after range compensation
time_s                    when the pulse left, from the start of the sweep
ring                      row of the model's table, from 0, the highest first
instance_id, category_id  the reflector's; 0 for air and objects without a label
surface                   kind of surface, a number of ``asset_types.SURFACES``
return_number             1 the first of its pulse, 2 the second
return_count              how many returns its pulse has
========================  ====================================================================
"""


PATHS = ("direct", "glass", "mirror")
"""Path of light from a surface to a laser scanner: straight, through panes of glass, or by way of a
mirror, a window or a puddle."""

ORIGIN = np.dtype([("path", "u1"), ("true_instance_id", "<u2"), ("true_position_m", "<f4", (3,))])
"""Origin of a point of a laser scan.

================  ============================================================================
path              number in ``PATHS``
true_instance_id  instance that reflected the light, also in a mirror; 0 as in ``POINT``
true_position_m   where, in the world frame at the pulse's instant [m]: without the error of the
                  range, and the place of the object itself rather than of its mirror image
================  ============================================================================
"""


@dataclass(frozen=True, eq=False, slots=True)
class PointCloud:
    """Points of one sweep of a laser scanner, in the order of firing.

    Attributes:
        points: Records of ``POINT`` [n].
        time_s: The instant that ``lidar`` and the boxes refer to: the middle of the sweep.
        origins: Records of ``ORIGIN`` [n] of the points; None unless ``lidar.origins``.
        faults: Faults of the scan, as plain data; see ``sensors.fault_draws``.
    """

    sensor: str
    lidar: Lidar
    points: NDArray[np.void]
    time_s: float = 0.0
    origins: NDArray[np.void] | None = None
    faults: Mapping[str, Any] = field(default_factory=dict)

    @property
    def start_s(self) -> float:
        """When the sweep began."""
        return self.time_s - 0.5 * self.lidar.sweep_s


@dataclass(frozen=True, eq=False, slots=True)
class Measurements:
    """Measurements of a device: radar, IMU, GNSS receiver, odometer, event detector.

    Attributes:
        rows: Records [n] of ``columns_dtype(SensorInfo.columns)``; may be empty.
        time_s: The instant that ``device`` refers to.
        faults: Faults in the rows, as plain data; see ``sensors.fault_draws``.
    """

    sensor: str
    device: Device
    rows: NDArray[np.void]
    time_s: float = 0.0
    faults: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, slots=True)
class LidarRays:
    """Rays of a laser scanner; the lidar frame is taken at the scene's instant.

    Attributes:
        directions: Unit vectors in the lidar frame, float32 [n, 3].
        divergence_rad: Full divergence angle of a beam.
        subrays: Rays per beam: 1, or 7, the axis and six around it.
        range_max_m: Hits farther away are ignored.
        origins_m: Origins of the beams in the lidar frame, float32 [n, 3]; None = its origin.
        time_s: Emission times relative to the scene's instant, float32 [n]: bodies with
            trajectories are hit where they are then. None = all 0.
        order: Permutation of the beams, int32 [n], that makes neighbours nearly parallel, which
            speeds up tracing; None = they already are.
        mirrored: Whether secondary hits state the mirrored surfaces.
    """

    directions: NDArray[np.float32]
    divergence_rad: float
    subrays: int
    range_max_m: float
    origins_m: NDArray[np.float32] | None = None
    time_s: NDArray[np.float32] | None = None
    order: NDArray[np.int32] | None = None
    mirrored: bool = False


@dataclass(frozen=True, eq=False, slots=True)
class SecondaryHits:
    """Hits of rays through panes of glass or by way of a mirror; arrays are [m].

    Attributes:
        ray: Index of the ray: beam times subrays plus subray, int64; each at most twice.
        range_m, reflectance: As in LidarHits; length of the whole path, and the reflectance after
            losses in glass or mirror.
        instance_id, category_id, surface: As in LidarHits. Mirrored objects have no ids, as they
            are not at the position of the point.
        mirrored_id: Instance that a mirror shows, uint16; 0 elsewhere. None unless requested.
        mirrored_m: Where it is, within 2 mm, lidar frame, float32 [m, 3]; NaN elsewhere. None
            unless requested.
    """

    ray: NDArray[np.int64]
    range_m: NDArray[np.float32]
    reflectance: NDArray[np.float32]
    instance_id: NDArray[np.uint16]
    category_id: NDArray[np.uint16]
    surface: NDArray[np.uint8]
    mirrored_id: NDArray[np.uint16] | None = None
    mirrored_m: NDArray[np.float32] | None = None


@dataclass(frozen=True, eq=False, slots=True)
class LidarHits:
    """First hits of the rays of beams; arrays are [n, subrays].

    Attributes:
        range_m: float32; inf = no hit.
        reflectance: Reflectance of the matte surface, square on, that returns as much light: it
            includes the angle of incidence. Glossy and retro-reflecting surfaces exceed 1.
            float32; 0.
        incidence_cos: Cosine of the angle of incidence, float32; 0.
        instance_id, category_id: uint16; 0.
        surface: Index in ``gen_data.core.asset_types.SURFACES``, uint8; 0.
        detours: Secondary hits; None = none.
    """

    range_m: NDArray[np.float32]
    reflectance: NDArray[np.float32]
    incidence_cos: NDArray[np.float32]
    instance_id: NDArray[np.uint16]
    category_id: NDArray[np.uint16]
    surface: NDArray[np.uint8]
    detours: SecondaryHits | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Capture:
    """Readings of all sensors at one step, by sensor name.

    Cameras have readings, lidars clouds, other devices tables. A sensor slower than the sequence is
    missing in the steps between its readings.
    """

    readings: Mapping[str, SensorReading]
    clouds: Mapping[str, PointCloud] = field(default_factory=dict)
    tables: Mapping[str, Measurements] = field(default_factory=dict)

    def faults(self) -> Iterator[tuple[str, Mapping[str, Any]]]:
        """Name of each sensor, and the faults of its reading; empty = none."""
        read: Mapping[str, SensorReading | PointCloud | Measurements]
        for read in (self.readings, self.clouds, self.tables):
            for name in sorted(read):
                yield name, read[name].faults
