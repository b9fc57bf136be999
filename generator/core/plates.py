"""Plates: photographs as backdrops, with a matched camera and the ground that they show.

World frame of a plate: the ground is the plane Z = 0, the camera is above the origin, and X is its
viewing direction, levelled. Photographs are taken for images of a pinhole with a centred principal
point. Linear values of a photograph are relative to its white: 1 is ``WHITE_CD_M2``.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import Asset, Material
from gen_data.core.colorimetry import luminance
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Body, Camera, Environment, Lane, Light, Scene, SupportSurface
from gen_data.core.se3 import SE3, Array, Vec3, rotation_to_quaternion

PointPx = tuple[float, float]

EV100 = 12.0
"""Exposure value of cameras that look through a plate: its white then saturates them."""
WHITE_CD_M2 = 1.2 * 2.0**EV100
"""Luminance of a photograph's white [cd/m^2]: ``L_max = 1.2 * 2^EV100`` (ISO 12232)."""
CATCHER = "shadow_catcher"
"""Role of the material of a plate's ground, which shows the photograph under its shadows."""
CLEARANCE_M = 30.0
"""Free height above a plate's ground."""
FARTHEST_M = 300.0
"""Ground farther away is taken for the horizon."""
_GRID = 96
"""Cells along each side of the raster in which the largest rectangle is searched."""
_CELLS_MIN = 3


@dataclass(frozen=True, slots=True)
class PlateSun:
    """The sun of a photograph.

    Attributes:
        azimuth_rad: About the vertical from the viewing direction, positive to the left.
        elevation_rad: Above the horizon.
        share: Its share of the light on level ground; the sky gives the rest.
    """

    azimuth_rad: float
    elevation_rad: float
    share: float


@dataclass(frozen=True, slots=True)
class Plate:
    """A photograph with its camera, ground and light.

    Attributes:
        size_px: Width and height of the photograph.
        focal_px: Focal length.
        T_world_camera: Pose of the camera in the plate's world.
        ground_px: Corners of the ground on which objects may stand.
        lanes: Lanes on the ground, in the plate's world, without ``road``.
        ground_color: Mean colour of the ground in the photograph, linear RGB.
        ground_albedo: Luminous reflectance of the ground.
        ground_roughness: As of ``Material.roughness``.
        sky_mean: Mean luminance over the sphere of its surroundings, as of the environment of the
            same id, relative to the photograph's white.
        sun: None = the sky is the only light.
        mask: Name of the image of the foreground, an image of the asset; empty = none.
        estimated: Whether the horizon was estimated from the photograph.
        horizon_error_rad: Standard deviation of an estimated horizon's direction; 0 = given.
    """

    size_px: tuple[int, int]
    focal_px: float
    T_world_camera: SE3
    ground_px: tuple[PointPx, ...]
    lanes: tuple[Lane, ...] = ()
    ground_color: Vec3 = (0.2, 0.2, 0.2)
    ground_albedo: float = 0.15
    ground_roughness: float = 0.9
    sky_mean: float = 0.5
    sun: PlateSun | None = None
    mask: str = ""
    estimated: bool = False
    horizon_error_rad: float = 0.0

    @property
    def intrinsics(self) -> Intrinsics:
        """Intrinsics of the whole photograph."""
        width_px, height_px = self.size_px
        center = (0.5 * width_px, 0.5 * height_px)
        return Intrinsics(width_px, height_px, self.focal_px, self.focal_px, *center)


@dataclass(frozen=True, slots=True)
class Crop:
    """The part of a photograph that an image shows, in whole pixels of the photograph."""

    x_px: int
    y_px: int
    width_px: int
    height_px: int


def upright_pose(up: Array, height_m: float) -> SE3:
    """``T_world_camera`` of a camera by the direction of the zenith, [3], in the camera frame.

    Raises:
        ValueError: it looks straight up or down.
    """
    axis = np.array([0.0, 0.0, 1.0])
    up = np.asarray(up, np.float64) / math.sqrt(float(np.dot(up, up)))
    ahead = axis - float(up @ axis) * up
    length = math.sqrt(float(ahead @ ahead))
    if length < 0.02:
        raise ValueError("the camera looks straight up or down")
    ahead = ahead / length
    rotation = np.stack([ahead, np.cross(up, ahead), up])
    return SE3((0.0, 0.0, height_m), rotation_to_quaternion(rotation)).rounded(9)


def zenith_from_horizon(intrinsics: Intrinsics, first: PointPx, second: PointPx) -> Array:
    """Direction of the zenith in the camera frame, unit, [3], from two points of the horizon."""
    a, b = intrinsics.rays(np.array([first, second]))
    normal = np.cross(b, a)
    length = math.sqrt(float(normal @ normal))
    if length < 1e-9:
        raise ValueError("the two points of the horizon are the same")
    normal = normal / length
    return np.asarray(normal if normal[1] < 0.0 else -normal)


def horizon_px(plate: Plate) -> tuple[PointPx, PointPx]:
    """The horizon at the left and at the right border of the photograph."""
    width_px = plate.size_px[0]
    camera = plate.intrinsics
    x, y, z = plate.T_world_camera.inverse().rotate(np.array([0.0, 0.0, 1.0])).tolist()
    rows = []
    for column in (0.0, float(width_px)):
        across = (column - camera.cx_px) / camera.fx_px
        rows.append(camera.cy_px - camera.fy_px * (x * across + z) / y)
    return (0.0, rows[0]), (float(width_px), rows[1])


def tilt_and_roll(plate: Plate) -> tuple[float, float]:
    """How far the camera looks down, and how the horizon falls to the right [rad]."""
    up = plate.T_world_camera.inverse().rotate(np.array([0.0, 0.0, 1.0]))
    (left_px, left_row), (right_px, right_row) = horizon_px(plate)
    slope = math.atan((right_row - left_row) / (right_px - left_px))
    return math.asin(-float(up[2])), slope


def ground_points(plate: Plate, points_px: Array) -> Array:
    """Points of the ground, world [m], [n, 2], that image points [n, 2] show.

    NaN for points above the horizon, and for those farther away than ``FARTHEST_M``.
    """
    rays = plate.T_world_camera.rotate(plate.intrinsics.rays(np.asarray(points_px, np.float64)))
    height_m = plate.T_world_camera.translation_m[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(rays[..., 2] < 0.0, -height_m / rays[..., 2], np.nan)
        points = rays[..., :2] * reach[..., None]
    distance = np.sqrt((points * points).sum(axis=-1))
    return np.asarray(np.where((distance <= FARTHEST_M)[..., None], points, np.nan))


def is_inside(polygon: Array, points: Array) -> NDArray[np.bool_]:
    """Whether points [..., 2] are inside a polygon [n, 2], by the even-odd rule."""
    x, y = points[..., 0], points[..., 1]
    inside = np.zeros(x.shape, np.bool_)
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        crosses = (y0 > y) != (y1 > y)
        if y0 != y1:
            inside ^= crosses & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return inside


def ground_rectangle(plate: Plate) -> tuple[SE3, tuple[float, float]]:
    """The largest rectangle on the ground along the viewing direction: centre and size [m].

    Raises:
        ValueError: the ground is above the horizon or too narrow.
    """
    polygon = ground_points(plate, np.array(plate.ground_px))
    if not np.isfinite(polygon).all():
        raise ValueError("a corner of the ground is at or above the horizon, or too far away")
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    steps = (high - low) / _GRID
    axes = [low[k] + (np.arange(_GRID) + 0.5) * steps[k] for k in range(2)]
    cells = is_inside(polygon, np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))
    first, end = _largest_rectangle(cells, float(steps[0]), float(steps[1]))
    # A line through the middle of single cells is not an area.
    if min(end[0] - first[0], end[1] - first[1]) < _CELLS_MIN:
        raise ValueError("no rectangle fits into the ground")
    a, b = low + np.array(first) * steps, low + np.array(end) * steps
    center = 0.5 * (a + b)
    size = (round(float(b[0] - a[0]), 4), round(float(b[1] - a[1]), 4))
    return SE3((float(center[0]), float(center[1]), 0.0)).rounded(), size


def _largest_rectangle(
    cells: NDArray[np.bool_], step_x: float, step_y: float
) -> tuple[tuple[int, int], tuple[int, int]]:
    """First and end cell of the rectangle of set cells with the largest area."""
    best, found = 0.0, ((0, 0), (0, 0))
    runs = np.zeros(cells.shape[1], np.int64)
    for row, line in enumerate(cells):
        runs = np.where(line, runs + 1, 0)
        stack: list[tuple[int, int]] = []
        for column, height in enumerate((*runs.tolist(), 0)):
            start = column
            while stack and stack[-1][1] >= height:
                start, tall = stack.pop()
                area = tall * step_x * (column - start) * step_y
                if area > best:
                    best, found = area, ((row + 1 - tall, start), (row + 1, column))
            stack.append((start, height))
    return found


def crop_to(whole_px: tuple[int, int], width_px: int, height_px: int) -> Crop:
    """The largest centred part of a photograph with the shape of an image of another size."""
    whole_w, whole_h = whole_px
    scale = min(whole_w / width_px, whole_h / height_px)
    part_w, part_h = min(round(width_px * scale), whole_w), min(round(height_px * scale), whole_h)
    return Crop((whole_w - part_w) // 2, (whole_h - part_h) // 2, part_w, part_h)


def fitted_intrinsics(whole: Intrinsics, width_px: int, height_px: int) -> Intrinsics:
    """Intrinsics of an image of a size that shows ``crop_to`` of a photograph."""
    part = crop_to((whole.width_px, whole.height_px), width_px, height_px)
    scale_x, scale_y = width_px / part.width_px, height_px / part.height_px
    return Intrinsics(
        width_px,
        height_px,
        round(whole.fx_px * scale_x, 6),
        round(whole.fy_px * scale_y, 6),
        (whole.cx_px - part.x_px) * scale_x,
        (whole.cy_px - part.y_px) * scale_y,
    )


def find_plates(plates: Iterable[Asset], names: tuple[str, ...], field: str) -> tuple[str, ...]:
    """Ids of the given photographs with any of these ids or tags, sorted.

    Raises:
        ConfigError: a name matches none.
    """
    every = tuple(plates)
    found: set[str] = set()
    for name in names:
        fitting = {a.asset_id for a in every if name == a.asset_id or name in a.tags}
        if not fitting:
            known = sorted({tag for a in every for tag in (a.asset_id, *a.tags)})
            raise ConfigError(
                f"{field}: there is no photograph '{name}'; expected one of {', '.join(known)}"
                f"{did_you_mean(name, known)}, or add a folder whose assets.yaml lists plates"
            )
        found |= fitting
    return tuple(sorted(found))


def is_catcher(body: Body) -> bool:
    """Whether a body is the ground of a plate."""
    return any(material.role == CATCHER for material in body.materials)


def has_plate(scene: Scene) -> bool:
    """Whether the backdrop of a scene is a photograph."""
    return any(is_catcher(body) for body in scene.bodies)


def show_plate(scene: Scene, element: str, asset_id: str, plate: Plate) -> Scene:
    """The scene with the ground, light, lanes and camera of a photograph.

    Args:
        scene: It has a body and a camera of the element's name, or a camera that a sensor made
            from it; lights, surfaces and lanes of an earlier photograph are replaced.
        element: Name of the template's element.
        asset_id: Id of the photograph.
        plate: Its content.

    Raises:
        ConfigError: nothing can stand on its ground.
    """
    try:
        center, size_m = ground_rectangle(plate)
    except ValueError as error:
        raise ConfigError(f"asset '{asset_id}': ground: {error}; move its corners") from None
    surface = SupportSurface(element, element, center, size_m, CLEARANCE_M)
    lanes = tuple(
        replace(lane, name=f"{element}/{lane.name}", road=element) for lane in plate.lanes
    )
    return replace(
        scene.with_bodies(_shade_ground(scene.body(element), plate)),
        surfaces=(*(s for s in scene.surfaces if s.body != element), surface),
        lanes=(*(lane for lane in scene.lanes if lane.road != element), *lanes),
        lights=(*(x for x in scene.lights if x.name != f"{element}/sun"), *_sun(element, plate)),
        environment=Environment(asset_id, round(plate.sky_mean * WHITE_CD_M2, 4)),
        cameras=tuple(fit_camera(camera, plate) for camera in scene.cameras),
    )


def fit_camera(camera: Camera, plate: Plate) -> Camera:
    """A camera of the same size and exposure that looks as the camera of a photograph."""
    size = (camera.intrinsics.width_px, camera.intrinsics.height_px)
    intrinsics = fitted_intrinsics(plate.intrinsics, *size)
    return replace(camera, T_world_camera=plate.T_world_camera, intrinsics=intrinsics)


def ground_illuminance(plate: Plate) -> float:
    """Illuminance of level ground in units of the photograph's white, ``E = pi L / albedo``."""
    return math.pi * _ground_luminance(plate) / plate.ground_albedo


def _ground_luminance(plate: Plate) -> float:
    return float(luminance(np.array(plate.ground_color)))


def _shade_ground(body: Body, plate: Plate) -> Body:
    """The ground with the colour and reflectance of a photograph's."""
    factor = plate.ground_albedo / max(_ground_luminance(plate), 1e-6)
    r, g, b = (round(min(factor * part, 1.0), 6) for part in plate.ground_color)
    material = Material(base_color=(r, g, b), roughness=plate.ground_roughness, role=CATCHER)
    return replace(body, materials=(material,))


def _sun(element: str, plate: Plate) -> tuple[Light, ...]:
    """The sun of a photograph as a light, if it has one."""
    sun = plate.sun
    if sun is None:
        return ()
    level = math.cos(sun.elevation_rad)
    x, y = level * math.cos(sun.azimuth_rad), level * math.sin(sun.azimuth_rad)
    z = math.sin(sun.elevation_rad)
    lux = sun.share * ground_illuminance(plate) * WHITE_CD_M2 / z
    direction = (round(-x, 9), round(-y, 9), round(-z, 9))
    return (Light(f"{element}/sun", "sun", direction=direction, illuminance_lux=round(lux, 3)),)
