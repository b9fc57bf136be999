"""Claim: an independent ray caster meets the surfaces that sampled laser points lie on.

A ray goes from the laser's place at the instant of the pulse towards the point, and must meet the
point's object at its distance: within the noise of the device, and without a solid one before it.
A point of a beam that diverges may be of the axis or of one of six rays around it; one must agree.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import SURFACES
from gen_data.core.capture import PointCloud
from gen_data.core.distribution import install_command
from gen_data.core.interfaces import Sensor
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.core.se3 import Array
from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Finding, not_checked
from gen_data.lab.certificate.ray_casting import Agreement, RayCaster, Seen, lets_light_through
from gen_data.sensors.lidar import lidar_atmosphere, lidar_sensor, pseudo_lidar, scan_pattern

ELSEWHERE = tuple(SURFACES.index(name) for name in ("air", "mirrored"))
"""Surfaces of points at whose place there is nothing."""

INSTANTS = 4
"""Instants of a scan that are examined if the world moves: each is a separate world."""

NOISE_MAX = 6.0
"""Standard deviations of the range; a normal deviate exceeds them twice in a billion."""

TOLERANCE_M, RELATIVE_TOLERANCE = 2e-3, 1e-4
"""Of ranges: 32-bit coordinates, and poses that files round to a micrometre (assumed)."""


def check_points(examined: Examined) -> Iterator[Finding]:
    """Cast rays to points of random scans of every laser scanner."""
    sensors = {sensor.name: sensor for sensor in examined.config.sensors}
    judged = {}
    for name in examined.stored.info.lidars:
        if reason := _unable(sensors.get(name)):
            yield not_checked(name, reason)
        else:
            judged[name] = Agreement()
    try:
        for sample in examined.chosen_samples() if judged else ():
            for name in sorted({*judged} & {*sample.capture.clouds}):
                cloud = sample.capture.clouds[name]
                _compare(examined, sample, cloud, sensors[name], judged[name])
    except ImportError as error:
        yield from (
            not_checked(name, f"install open3d: {install_command('certify')} ({error})")
            for name in sorted(judged)
        )
        return
    for name, agreement in sorted(judged.items()):
        yield agreement.finding(name, "scans", "points")


def _unable(sensor: Sensor | None) -> str:
    """Why the points of a sensor cannot be compared; empty if they can."""
    if isinstance(sensor, lidar_sensor.LidarSensor):
        return ""
    return "" if isinstance(sensor, pseudo_lidar.PseudoLidar) else "a sensor of another package"


@dataclass(frozen=True, eq=False)
class Pulses:
    """Points of one instant with the places of their lasers; arrays [n, 3], world.

    Attributes:
        scene: The world at the instant.
        which: Numbers of the points in their cloud, [n].
        R_world_lidar: Axes of the scanner then, [3, 3].
    """

    scene: Scene
    which: NDArray[np.intp]
    origins_m: Array
    points_m: Array
    R_world_lidar: Array


def _compare(
    examined: Examined, sample: Sample, cloud: PointCloud, sensor: Sensor, agreement: Agreement
) -> None:
    points = cloud.points
    there = ~np.isin(points["surface"], ELSEWHERE)
    agreement.readings += 1
    agreement.others["points in the air or mirrored"] += int((~there).sum())
    noise_m, step_m = _spread_m(sensor)
    for pulses in _choose_pulses(examined, sample, cloud, sensor, np.flatnonzero(there)):
        origin_m = pulses.origins_m.mean(axis=0)
        passes = lets_light_through(examined.library)
        caster = RayCaster(pulses.scene, examined.library, origin_m, passes)
        away = pulses.points_m - pulses.origins_m
        range_m = np.linalg.norm(away, axis=1)
        rain_m = lidar_atmosphere.rain_noise_m(
            pulses.scene.weather.rain_mm_h, range_m.astype(np.float32)
        )
        noisy_m = NOISE_MAX * (noise_m + rain_m) if noise_m else np.zeros(1)
        tolerance_m = noisy_m + 0.5 * step_m + TOLERANCE_M + RELATIVE_TOLERANCE * range_m
        ids = points["instance_id"][pulses.which].astype(np.int64)
        seen = Seen(range_m, tolerance_m, ids, np.full(len(ids), np.inf))
        axes = away / range_m[:, None]
        agreed = caster.agrees(pulses.origins_m, axes, seen)
        for rays in _rays_around(axes, pulses.R_world_lidar, sensor):
            left = np.flatnonzero(~agreed)
            if not len(left):
                break
            agreed[left] = caster.agrees(pulses.origins_m[left], rays[left], seen.at(left))
        agreement.rays += len(ids)
        for k in np.flatnonzero(~agreed):
            agreement.contradictions.add(
                f"sample {sample.index}, point {pulses.which[k]}: a ray does not meet instance "
                f"{ids[k]} within {tolerance_m[k]:.3f} m of {range_m[k]:.3f} m"
            )


def _rays_around(axes: Array, R_world_lidar: Array, sensor: Sensor) -> Iterator[Array]:
    """Unit vectors [n, 3] of the rays around the axes of beams, world; none without divergence.

    They are where half of a beam's light is farther from its axis, every 60 degrees from the
    horizontal of the scanner.
    """
    if not isinstance(sensor, lidar_sensor.LidarSensor) or not sensor.divergence:
        return
    spread = math.sqrt(0.5) * math.tan(0.5e-3 * sensor.device.divergence_mrad)
    steep = np.abs(axes @ R_world_lidar[:, 2]) >= 0.9
    helper = np.where(steep[:, None], R_world_lidar[:, 0], R_world_lidar[:, 2])
    across = np.cross(helper, axes)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(axes, across)
    for turn in np.arange(6) * (math.pi / 3.0):
        rays = axes + spread * (math.cos(turn) * across + math.sin(turn) * up)
        yield rays / np.linalg.norm(rays, axis=1, keepdims=True)


def _spread_m(sensor: Sensor) -> tuple[float, float]:
    """Standard deviation and quantisation of a sensor's ranges [m]; 0 = none."""
    if not isinstance(sensor, lidar_sensor.LidarSensor) or sensor.ideal:
        return 0.0, 0.0
    return sensor.device.range_noise_m, sensor.device.range_step_m


def _choose_pulses(
    examined: Examined, sample: Sample, cloud: PointCloud, sensor: Sensor, there: NDArray[np.intp]
) -> Iterator[Pulses]:
    """Random points of a scan, instant by instant; none if there are no points."""
    rng = examined.rng(f"points/{sample.index}/{cloud.sensor}")
    timeline, points, count = examined.timeline(sample), cloud.points, examined.scope.rays
    middle = timeline.at(cloud.time_s)
    T_world_middle = middle.lidar(cloud.sensor).T_world_lidar
    if isinstance(sensor, pseudo_lidar.PseudoLidar):
        which = np.sort(rng.permutation(there)[:count])
        eye_m = middle.camera(sensor.camera).T_world_camera.translation_m
        at_m = T_world_middle.apply(points["position_m"][which].astype(np.float64))
        if len(which):
            yield Pulses(
                middle, which, np.broadcast_to(eye_m, at_m.shape), at_m, T_world_middle.rotation()
            )
        return
    assert isinstance(sensor, lidar_sensor.LidarSensor)
    moves = bool(sample.scene.tracks) and sensor.motion_distortion != "none"
    times_s = points["time_s"][there]
    chosen_s = rng.permutation(np.unique(times_s))[:INSTANTS] if moves else [None]
    for instant_s in chosen_s:
        now = there if instant_s is None else there[times_s == instant_s]
        which = np.sort(rng.permutation(now)[: count if instant_s is None else count // INSTANTS])
        if not len(which):
            continue
        after_s = 0.0 if instant_s is None else float(instant_s) - 0.5 * cloud.lidar.sweep_s
        scene = timeline.at(cloud.time_s + after_s)
        T_world_lidar = scene.lidar(cloud.sensor).T_world_lidar
        T_world_points = T_world_lidar if sensor.motion_distortion == "raw" else T_world_middle
        lasers_m = laser_places_m(sensor.device, points[which])
        at_m = T_world_points.apply(points["position_m"][which].astype(np.float64))
        R_world_lidar = T_world_lidar.rotation()
        yield Pulses(scene, which, T_world_lidar.apply(lasers_m), at_m, R_world_lidar)


def laser_places_m(model: scan_pattern.LidarModel, points: NDArray[np.void]) -> Array:
    """Where the beams of points leave the scanner, lidar frame of their instant [m], [n, 3].

    Lasers of a rotating scanner are at different heights, and next to its axis; its azimuth
    follows from the time.
    """
    if model.prisms is not None:
        return np.zeros((len(points), 3))
    ring = points["ring"].astype(np.intp)
    rings = len(model.heights_m())
    azimuth = np.pi * (1.0 - 2.0 * points["time_s"].astype(np.float64) * model.rotation_hz)
    if model.azimuth_offsets_deg:
        azimuth += np.radians(np.resize(model.azimuth_offsets_deg, rings))[ring]
    left = np.resize(model.lateral_offsets_m or (0.0,), rings)[ring]
    return np.stack(
        [-np.sin(azimuth) * left, np.cos(azimuth) * left, model.heights_m()[ring]], axis=-1
    )
