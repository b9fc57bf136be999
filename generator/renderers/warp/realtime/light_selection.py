"""Selection of the lights that matter in a view: each costs the same, however dim.

The brightest parts of a panorama become lamps where their shadows would be visible.
"""

import math
from collections.abc import Sequence

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core.colorimetry import luminance
from gen_data.core.scene import LIGHT_KINDS, PANEL_KINDS, Environment, Light, Scene
from gen_data.core.se3 import Array
from gen_data.renderers.warp.realtime.kernels.soft_shadows import count_free_paths
from gen_data.renderers.warp.scene import environment_maps, scene_packing, struct_dtypes
from gen_data.renderers.warp.scene.kernels import analytic_lights, records
from gen_data.renderers.warp.visibility.frame_context import CameraView
from gen_data.renderers.warp.visibility.gbuffer import GBuffer

_STRIDE_PX = 11
# Assumed background illuminance: lamps must not be ranked by their effect in the dark [lx].
_DIM_LUX = 0.05
# Minimum cosine: a lamp also matters for surfaces turned away from it, by its glow and reflections.
_TURNED_AWAY = 0.1


def keep_main_lamps(frame: CameraView) -> None:
    """Restrict the world to the lamps that contribute most to the visible surfaces, in place."""
    chosen = main_lamp_numbers(frame)
    if chosen is not None:
        frame.world.record.lamps = struct_dtypes.take_rows(frame.world.record.lamps, chosen)


def main_lamp_numbers(frame: CameraView) -> NDArray[np.int64] | None:
    """Numbers of the lamps that ``keep_main_lamps`` keeps, ascending; None = all."""
    lamps, lamps_max = frame.world.record.lamps, frame.settings.max_lamps
    if len(lamps) <= lamps_max:
        return None
    return main_lamps(lamps.numpy(), *_sparse_points(frame.view, frame.gbuffer), lamps_max)


def main_lamps(
    lamps: NDArray[np.void], points_m: Array, normals: Array, lamps_max: int
) -> NDArray[np.int64]:
    """Numbers of the selected lamp records, ascending: suns first, then by share of light.

    Visible points and their unit normals are in the world frame, [n, 3].
    """
    lux = np.stack([_illuminance(lamp, points_m, normals) for lamp in lamps])
    shares = (lux / (_DIM_LUX + lux.sum(axis=0))).sum(axis=1)
    shares = np.where(lamps["kind"] == LIGHT_KINDS.index("sun"), np.inf, shares)
    order = np.argsort(-shares, kind="stable")
    return np.sort(order[:lamps_max])


def _illuminance(lamp: NDArray[np.void], points_m: Array, normals: Array) -> Array:
    """Unshadowed illuminance of one lamp at points [lx]."""
    kind = LIGHT_KINDS[lamp["kind"]]
    if kind == "sun":
        return np.zeros(len(points_m))
    # Axis by axis: a reduction over a short last axis takes three times as long.
    away = [float(lamp["position_m"][k]) - points_m[:, k] for k in range(3)]
    squared = np.maximum(away[0] * away[0] + away[1] * away[1] + away[2] * away[2], 1e-2)
    distance = np.sqrt(squared)
    direction = [along / distance for along in away]
    cosine = np.maximum(_dot(direction, list(normals.T)), _TURNED_AWAY)
    lux: Array = float(luminance(lamp["power"].astype(np.float64))) * cosine / squared
    if kind == "spot":
        down = -_dot(direction, [float(along) for along in lamp["direction"]])
        span = max(float(lamp["cos_inner"] - lamp["cos_outer"]), 1e-4)
        fade = np.clip((down - lamp["cos_outer"]) / span, 0.0, 1.0)
        lux = lux * fade * fade * (3.0 - 2.0 * fade)
        if lamp["cutoff"] > 0.0:
            lux = lux * dipped_share(lamp, [-along for along in direction])
    elif kind in PANEL_KINDS:
        lux = lux * np.maximum(-_dot(direction, [float(along) for along in lamp["direction"]]), 0.0)
    return lux


def dipped_share(lamp: NDArray[np.void], d: Sequence[Array]) -> Array:
    """As kernels.analytic_lights.dipped_share, for many directions, given axis by axis."""
    axis = [float(along) for along in lamp["direction"]]
    level = math.hypot(axis[0], axis[1])
    right = [axis[1] / level, -axis[0] / level, 0.0]
    up = np.cross(right, axis).tolist()
    ahead = np.maximum(_dot(d, axis), 1e-3)
    side, down = _dot(d, right) / ahead, -_dot(d, up) / ahead
    rise = np.clip(analytic_lights.CUTOFF_RISE * side, 0.0, analytic_lights.CUTOFF_RISE_MAX)
    below = down - float(lamp["cutoff"]) + rise
    t = np.clip(0.5 + 0.5 * below / analytic_lights.CUTOFF_HALF_WIDTH, 0.0, 1.0)
    s = (side - analytic_lights.HOT_SIDE) / analytic_lights.SIDE_WIDTH
    v = np.maximum(below, 0.0) / analytic_lights.DOWN_WIDTH
    lit = t * t * (3.0 - 2.0 * t) / ((1.0 + s * s) * (1.0 + v * v))
    return np.asarray(np.maximum(lit, analytic_lights.STRAY))


def _dot(a: Sequence[Array], b: Sequence[Array] | Sequence[float]) -> Array:
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _sparse_points(view: records.View, gbuffer: GBuffer) -> tuple[Array, Array]:
    """Visible points and normals at a sparse grid of pixels, world frame."""
    z = _every_few_pixels(view, gbuffer.z_m).astype(np.float64)
    normals = _every_few_pixels(view, gbuffer.normals)
    rows, columns = np.nonzero(np.isfinite(z))
    directions = _directions(view, rows, columns)
    p_camera = directions * z[rows, columns, None]
    R = np.array(view.R_world_camera, dtype=np.float64).reshape(3, 3)
    eye = np.array(view.eye_m, dtype=np.float64)
    points = np.einsum("ij,nj->ni", R, p_camera, optimize=False) + eye
    return points, normals[rows, columns].astype(np.float64)


def _every_few_pixels(view: records.View, image: wp.array) -> NDArray[np.float32]:
    """A sparse grid of pixels of a flat image, which alone leaves the device."""
    grid = image.reshape((view.height, view.width))[::_STRIDE_PX, ::_STRIDE_PX]
    return np.asarray(grid.numpy())


def _directions(view: records.View, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Array:
    """As kernels.records.pixel_direction, at pixel centres of the sparse grid."""
    if view.lens != records.PINHOLE:
        return _every_few_pixels(view, view.directions)[rows, columns, :3].astype(np.float64)
    x = (columns * _STRIDE_PX + 0.5 - view.cx) * view.inverse_fx
    y = (rows * _STRIDE_PX + 0.5 - view.cy) * view.inverse_fy
    return np.stack([x, y, np.ones_like(x)], axis=-1)


# Parts with a smaller share of the light at the focus cast no visible shadows.
_SHARE = 0.1
_FAR_M = 1e3


def extract_sky_lights(frame: CameraView) -> scene_packing.PackedWorld:
    """The world with lamps for the brightest parts of its panorama.

    Unchanged if the scene has a sun, which its panorama then lacks; if walls block the panorama,
    whose light is then the room's; or if other lamps outshine it.
    """
    world, scene, cache = frame.world, frame.state.scene, frame.cache
    environment = scene.environment
    if environment.luminance_cd_m2 <= 0.0 or any(light.kind == "sun" for light in scene.lights):
        return world
    points = _viewpoints(scene)
    if not _is_open(frame, points, _directions_around()):
        return world
    split = cache.split_environment(environment.image)
    if not split.lamps or not _is_significant(split.lamps[0], scene):
        return world
    suns = [_sun(lamp, environment) for lamp in split.lamps]
    towards = np.array([np.negative(sun.direction) for sun in suns])
    if not _is_open(frame, points, towards):
        return world
    lit = scene_packing.copy_world(world)
    lit.record.sky = scene_packing.sky_record(environment, split)
    added = scene_packing.lamp_records(suns)
    # Reflected rays hit them in the panorama itself.
    added["shown"] = 1
    lamps = np.concatenate([scene_packing.lamp_records(scene.lights), added])
    lit.record.lamps = struct_dtypes.to_device(lamps, records.LightRecord, cache.device)
    return lit


def _sun(lamp: environment_maps.SkyLamp, environment: Environment) -> Light:
    """The lamp as a light in the world."""
    x, y, z = lamp.towards
    c, s = math.cos(environment.yaw_rad), math.sin(environment.yaw_rad)
    power = np.asarray(lamp.power)
    relative = float(luminance(power))
    red, green, blue = (float(v) for v in power / relative)
    return Light(
        "",
        "sun",
        direction=(s * y - c * x, -s * x - c * y, -z),
        color=(red, green, blue),
        illuminance_lux=relative * environment.luminance_cd_m2,
        angular_radius_rad=lamp.angular_radius_rad,
    )


def _is_significant(lamp: environment_maps.SkyLamp, scene: Scene) -> bool:
    """Whether a part of the panorama contributes noticeably to the light at the focus."""
    lux = float(luminance(np.asarray(lamp.power))) * scene.environment.luminance_cd_m2
    others = sum(
        light.intensity_cd / max(math.dist(light.position_m, scene.focus.center_m) ** 2, 1e-4)
        for light in scene.lights
    )
    return lux > _SHARE * (lux / lamp.share + others)


def _viewpoints(scene: Scene) -> Array:
    """Points above the focus and at the cameras, [n, 3]."""
    center, half = np.asarray(scene.focus.center_m), 0.5 * np.asarray(scene.focus.size_m)
    corners = [center + half * (x, y, 1.0) for x in (-1, 0, 1) for y in (-1, 0, 1)]
    eyes = [np.asarray(camera.T_world_camera.translation_m) for camera in scene.cameras]
    return np.array([*corners, *eyes])


def _directions_around() -> Array:
    """Twelve directions above the horizon, evenly distributed (Fibonacci spiral), [12, 3]."""
    k = np.arange(12)
    up = (k + 0.5) / 12.0
    level, azimuth = np.sqrt(1.0 - up * up), k * math.pi * (3.0 - math.sqrt(5.0))
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), up], axis=-1)


def _is_open(frame: CameraView, points: Array, towards: Array) -> bool:
    """Whether any of the directions is unobstructed at any of the points."""
    device = frame.cache.device
    free = wp.zeros(1, dtype=wp.int32, device=device)
    ends = (wp.array(a, dtype=wp.vec3, device=device) for a in (points, towards * _FAR_M))
    frame.launch(count_free_paths, len(points), [frame.world.record, *ends], [free])
    return int(free.numpy()[0]) > 0
