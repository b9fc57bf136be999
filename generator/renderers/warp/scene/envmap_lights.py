"""Shadows of panoramas: their brightest parts become lamps where shadows would be visible."""

from __future__ import annotations

import math

import numpy as np
import warp as wp

from gen_data.generator.core.colorimetry import luminance
from gen_data.generator.core.scene import Environment, Light, Scene
from gen_data.generator.core.se3 import Array
from gen_data.generator.renderers.warp.frame_context import CameraView
from gen_data.generator.renderers.warp.realtime.kernels.soft_shadows import count_free_paths
from gen_data.generator.renderers.warp.scene.envmap_peaks import SkyLamp
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.scene.scene_packing import (
    PackedWorld,
    copy_world,
    lamp_records,
    sky_record,
)

# Parts with a smaller share of the light at the focus cast no visible shadows.
_SHARE = 0.1
_FAR_M = 1e3


def extract_sky_lights(frame: CameraView) -> PackedWorld:
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
    lit = copy_world(world)
    lit.record.sky = sky_record(environment, split)
    added = lamp_records(suns)
    # Reflected rays hit them in the panorama itself.
    added["shown"] = 1
    lamps = np.concatenate([world.record.lamps.numpy(), added])
    lit.record.lamps = wp.array(lamps, dtype=records.LightRecord, device=cache.device)
    return lit


def _sun(lamp: SkyLamp, environment: Environment) -> Light:
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


def _is_significant(lamp: SkyLamp, scene: Scene) -> bool:
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
