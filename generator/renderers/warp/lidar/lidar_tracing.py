"""Ray tracing of laser scans, through the same world, meshes and materials as cameras.

Secondary hits are those behind glass and by reflection in mirrors. Few rays hit a pane, a mirror or
a puddle; only these are traced further, after all first hits. Bodies may move during a scan, whose
pulses are emitted one after another.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core import asset_types, intrinsics, se3
from gen_data.core.capture import LidarHits, LidarRays, SecondaryHits
from gen_data.core.motion import interpolate_poses
from gen_data.core.scene import Body, Camera, Lidar, Scene
from gen_data.renderers.warp.atmosphere.weather import ground_record
from gen_data.renderers.warp.device import launch
from gen_data.renderers.warp.lidar.infrared_materials import infrared_surfaces
from gen_data.renderers.warp.lidar.kernels import lidar_rays as kernels
from gen_data.renderers.warp.lidar.kernels.ray_packets import LISTED_MAX, Boxes
from gen_data.renderers.warp.readback import Readback
from gen_data.renderers.warp.scene import bvh, material_packing
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.renderers.warp.scene.scene_packing import PackedWorld, pack_world
from gen_data.renderers.warp.visibility.label_images import category_ids

KEYS = 9
"""Poses over a sweep, interpolated linearly: within 0.2 mm at 10 m/s^2 and 0.1 s."""

SLACK_M = 2e-3
"""Margin by which a body may leave its boxes between keys."""


@dataclass(frozen=True, eq=False, slots=True)
class Mover:
    """A moving body: its number, rotation matrices [KEYS, 3, 3] and positions [KEYS, 3]."""

    number: int
    body: Body
    R_world_mesh: se3.Array
    t_world_mesh: se3.Array


def pack_moving_bodies(
    scene: Scene, lidar: Lidar, beams: LidarRays, world: PackedWorld, cache: DeviceCache
) -> tuple[PackedWorld, kernels.BodyMotion]:
    """The world with boxes around the bodies' whole motion, and that motion."""
    device = cache.device
    motion = kernels.BodyMotion()
    motion.keys = 0
    movers = _find_movers(scene, beams.time_s)
    if not movers and beams.origins_m is None:
        return world, motion
    time_s = beams.time_s
    if time_s is None:
        time_s = np.zeros(len(beams.directions), np.float32)
    rows = np.full(max(len(scene.bodies), 1), -1, np.int32)
    rows[[mover.number for mover in movers]] = np.arange(len(movers))
    start_s, end_s = float(time_s.min()), float(time_s.max())
    phases = (time_s - start_s) * np.float32((KEYS - 1) / max(end_s - start_s, 1e-9))
    origins_m = beams.origins_m
    if origins_m is None:
        origins_m = np.zeros((len(time_s), 3), np.float32)
    B_mesh_lidar, eye_mesh = _lidar_in_mesh_frames(lidar, movers)
    motion.keys = KEYS
    motion.rows = wp.array(rows, dtype=int, device=device)
    motion.B_mesh_lidar = wp.array(B_mesh_lidar, dtype=wp.mat33, device=device)
    motion.eye_mesh = wp.array(eye_mesh, dtype=wp.vec3, device=device)
    motion.phases = cache.latest(f"phases {lidar.name}", phases, float)
    motion.origins_m = cache.latest(f"origins {lidar.name}", origins_m, wp.vec3)
    return _enclose(world, movers, cache), motion


def _find_movers(scene: Scene, time_s: NDArray[np.float32] | None) -> list[Mover]:
    if time_s is None or not scene.tracks:
        return []
    keys_s = scene.time_s + np.linspace(float(time_s.min()), float(time_s.max()), KEYS)
    numbers = {body.name: k for k, body in enumerate(scene.bodies)}
    tracks = [
        track
        for track in scene.tracks
        if track.end_s > keys_s[0] and track.start_s < keys_s[-1] and track.body in numbers
    ]
    R, t = interpolate_poses(tracks, keys_s)
    moves = (t != t[:, :1]).any(axis=(1, 2)) | (R[:, :1] != R).any(axis=(1, 2, 3))
    moving = sorted((numbers[tracks[k].body], int(k)) for k in np.flatnonzero(moves))
    return [Mover(number, scene.bodies[number], R[k], t[k]) for number, k in moving]


def _lidar_in_mesh_frames(
    lidar: Lidar, movers: list[Mover]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Directions and origin of the lidar frame in each mover's mesh frame, at each key."""
    if not movers:
        return np.zeros((1, KEYS, 3, 3), np.float32), np.zeros((1, KEYS, 3), np.float32)
    R_world_lidar = lidar.T_world_lidar.rotation()
    R = np.stack([mover.R_world_mesh for mover in movers])
    t = np.stack([mover.t_world_mesh for mover in movers])
    scale = np.array([mover.body.scale for mover in movers])[:, None, None]
    away = np.asarray(lidar.T_world_lidar.translation_m) - t
    B = np.einsum("nkji,jl->nkil", R, R_world_lidar, optimize=False) / scale[..., None]
    eye = np.einsum("nkji,nkj->nki", R, away, optimize=False) / scale
    return B.astype(np.float32), eye.astype(np.float32)


def _enclose(world: PackedWorld, movers: list[Mover], cache: DeviceCache) -> PackedWorld:
    """The world with boxes that contain the movers at all keys."""
    if not movers:
        return world
    body_records = world.body_records.copy()
    numbers = [mover.number for mover in movers]
    meshes = [cache.mesh(mover.body.asset) for mover in movers]
    scale = np.array([mover.body.scale for mover in movers])[:, None]
    low, high = (
        np.stack(corner) for corner in zip(*((m.low_m, m.high_m) for m in meshes), strict=True)
    )
    R = np.stack([mover.R_world_mesh for mover in movers])
    t = np.stack([mover.t_world_mesh for mover in movers])
    centre = t + np.einsum("nkij,nj->nki", R, 0.5 * (low + high) * scale, optimize=False)
    half = 0.5 * (high - low) * scale
    reach = np.einsum("nkij,nj->nki", np.abs(R), half, optimize=False) + SLACK_M
    body_records["low_m"][numbers] = (centre - reach).min(axis=1)
    body_records["high_m"][numbers] = (centre + reach).max(axis=1)
    lows_m, highs_m = (
        wp.array(np.ascontiguousarray(body_records[name]), dtype=wp.vec3, device=cache.device)
        for name in ("low_m", "high_m")
    )
    return replace(world, body_records=body_records, lows_m=lows_m, highs_m=highs_m)


PUDDLE_MIN = 0.05
"""Smallest share of standing water that reflects."""

Labels = tuple[NDArray[np.uint16], NDArray[np.uint16], NDArray[np.uint8]]


@dataclass(frozen=True, eq=False, slots=True)
class HitLabels:
    """Lookup tables from body and material to labels; the first entry is the background's."""

    instances: NDArray[np.uint16]
    categories: NDArray[np.uint16]
    surfaces: NDArray[np.uint8]

    @classmethod
    def of(cls, scene: Scene, per_body: Sequence[material_packing.BodyMaterials]) -> "HitLabels":
        """Tables of a scene with the given materials of its bodies."""
        instances = [0, *(body.instance_id for body in scene.bodies)]
        nothing = np.zeros(1, np.uint8)
        return cls(
            np.array(instances, np.uint16),
            np.array([0, *category_ids(scene)], np.uint16),
            np.concatenate([nothing, *(entry.roles for entry in per_body)]),
        )

    def at(self, hits: NDArray[np.int32]) -> Labels:
        """Instance, category and surface of (body, material) pairs [n, 2]."""
        bodies, materials = hits[:, 0] + 1, hits[:, 1] + 1
        return self.instances[bodies], self.categories[bodies], self.surfaces[materials]


@dataclass(frozen=True, eq=False, slots=True)
class FirstHits:
    """First hits of all rays: ranges and (body, material) on the device, hits also on the host.

    Attributes:
        normals: Normals at mirrors, on the device, lidar frame.
        puddles: Share of standing water at each ray's end; None if everything is dry.
    """

    ranges_m: wp.array
    on_device: wp.array
    normals: wp.array
    hits: NDArray[np.int32]
    puddles: NDArray[np.float32] | None


def trace_secondary(
    inputs: Sequence[Any],
    first: FirstHits,
    beams: LidarRays,
    infrared: NDArray[np.void],
    labels: HitLabels,
    cache: DeviceCache,
) -> SecondaryHits | None:
    """Secondary hits of all rays; None without any.

    ``inputs`` are the inputs of the kernel that found the first hits, ``infrared`` the Infrared
    records of the materials.
    """
    order = beams.order
    material = first.hits[:, 1]
    clear = np.append(infrared["clear"] > 0.0, False)[material]
    mirror = np.append(infrared["mirror"] > 0.0, False)[material]
    if first.puddles is not None:
        mirror = mirror | (first.puddles > PUDDLE_MIN)
    panes, mirrors = (_select_rays(which, order) for which in (clear, mirror))
    selected = np.concatenate([panes, mirrors])
    if not len(selected):
        return None
    found = Readback.allocate(len(selected), _SECONDARY, cache.device)
    places = wp.zeros(len(mirrors) if beams.mirrored else 0, dtype=wp.vec3, device=cache.device)
    threads = inputs[0].threads
    if len(panes):
        given = [wp.array(panes, dtype=int, device=cache.device), first.ranges_m]
        outputs = [part[: len(panes)] for part in found.parts]
        launch(kernels.trace_behind_panes, threads, [*inputs, *given], outputs, device=cache.device)
    if len(mirrors):
        water = np.zeros(len(mirrors), np.float32)
        if first.puddles is not None:
            water = np.where(first.puddles[mirrors] > PUDDLE_MIN, first.puddles[mirrors], 0.0)
        given = [
            wp.array(mirrors, dtype=int, device=cache.device),
            first.ranges_m,
            first.on_device,
            first.normals,
            wp.array(water, dtype=float, device=cache.device),
        ]
        outputs = [part[len(panes) :] for part in found.parts]
        outputs.append(places)
        launch(kernels.trace_mirrors, threads, [*inputs, *given], outputs, device=cache.device)
    ranges_m, reflectances, hits = found.numpy()
    there = hits[:, 0] >= 0
    instances, categories, surfaces = labels.at(hits[there])
    mirrored = there[: len(panes)].sum()
    ids, shown_m = None, None
    if beams.mirrored:
        ids, shown_m = _mirrored(instances, mirrored, places.numpy()[there[len(panes) :]])
    instances[mirrored:], categories[mirrored:] = 0, 0
    surfaces[mirrored:] = asset_types.SURFACES.index("mirrored")
    rays = selected[there].astype(np.int64)
    return SecondaryHits(
        rays, ranges_m[there], reflectances[there], instances, categories, surfaces, ids, shown_m
    )


def _mirrored(
    instances: NDArray[np.uint16], first: np.integer, places_m: NDArray[np.float32]
) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """Instances and places in mirrors of hits that are mirrored from the ``first`` one on."""
    ids, shown_m = np.zeros_like(instances), np.full((len(instances), 3), np.nan, np.float32)
    ids[first:], shown_m[first:] = instances[first:], places_m
    return ids, shown_m


def _select_rays(which: NDArray[np.bool_], order: NDArray[np.int32] | None) -> NDArray[np.int32]:
    """Numbers of the marked rays, with neighbouring beams adjacent."""
    if order is None or not which.any():
        return np.flatnonzero(which).astype(np.int32)
    subrays = len(which) // len(order)
    rays = order if subrays == 1 else (subrays * order[:, None] + np.arange(subrays)).ravel()
    return rays[which[rays]].astype(np.int32, copy=False)


_FIRST = (float, float, float, wp.vec2i)
"""Types of ranges, reflectances, cosines and hits."""
_SECONDARY = (float, float, wp.vec2i)
"""Types of ranges, reflectances and hits."""

RING_SHARE = math.sqrt(1.0 / 2.0)
"""Radius of the ring of rays, relative to the beam's: half the light is outside it."""


RUN, RUN_MIN, RUNS = 128, 8, 64
"""Rays per run: neighbours hit the same few bodies. Few rays are farther from one another: they
make about ``RUNS`` runs of at least ``RUN_MIN``."""

THREADS = 16
"""Threads of a launch on the CPU, where they run one after another, each with separate lists."""

RUN_CUDA, THREADS_CUDA = 32, 16384


def trace_scan(scene: Scene, lidar: Lidar, beams: LidarRays, cache: DeviceCache) -> LidarHits:
    """First hits of all beams' rays, and secondary hits of some."""
    eye = Camera(lidar.name, lidar.T_world_lidar, intrinsics.Intrinsics(1, 1, 1.0, 1.0, 0.5, 0.5))
    world, motion = pack_moving_bodies(scene, lidar, beams, pack_world(scene, eye, cache), cache)
    world.record.ground = ground_record(scene.weather)
    per_body = material_packing.body_materials(scene.bodies, cache)
    device = cache.device
    shape = (len(beams.directions), beams.subrays)
    count = shape[0] * shape[1]
    infrared = infrared_surfaces(per_body, cache)
    lights = cache.latest("infrared", infrared, kernels.Infrared)
    axes = cache.latest(f"beams {lidar.name}", beams.directions, wp.vec3)
    record = _scan(lidar, beams, cache)
    inputs = [record, world.record, motion, _boxes(world, record.threads, cache), lights, axes]
    order = np.zeros(0, np.int32) if beams.order is None else beams.order
    covered = bool(world.record.ground.covered)
    found = Readback.allocate(count, [*_FIRST, float] if covered else _FIRST, device)
    mirrors = covered or bool((infrared["mirror"] > 0.0).any())
    normals = cache.scratch("scan normals", count if mirrors else 1, wp.vec3)
    puddles = found.parts[4] if covered else cache.scratch("no puddles", 1, float)
    launch(
        kernels.scan_beams,
        dim=record.threads,
        inputs=[*inputs, cache.latest(f"order {lidar.name}", order, int)],
        outputs=[*found.parts[:4], normals, puddles],
        device=device,
    )
    labels = HitLabels.of(scene, per_body)
    ranges_m, reflectances, cosines, hits, *water = found.numpy()
    first = FirstHits(found.parts[0], found.parts[3], normals, hits, water[0] if covered else None)
    instances, categories, surfaces = labels.at(hits)
    return LidarHits(
        ranges_m.reshape(shape),
        reflectances.reshape(shape),
        cosines.reshape(shape),
        instances.reshape(shape),
        categories.reshape(shape),
        surfaces.reshape(shape),
        trace_secondary(inputs, first, beams, infrared, labels, cache),
    )


def _boxes(world: PackedWorld, threads: int, cache: DeviceCache) -> Boxes:
    boxes = Boxes()
    boxes.lows_m, boxes.highs_m = world.lows_m, world.highs_m
    low_m, high_m = (np.ascontiguousarray(world.body_records[k]) for k in ("low_m", "high_m"))
    boxes.groups = cache.latest("box groups", bvh.group_boxes(low_m, high_m), float)
    shape = (threads, int(LISTED_MAX))
    boxes.listed = cache.scratch("listed bodies", shape, int)
    boxes.enters_m = cache.scratch("listed distances", shape, float)
    return boxes


def _scan(lidar: Lidar, beams: LidarRays, cache: DeviceCache) -> kernels.Scan:
    scan = kernels.Scan()
    scan.R_world_lidar = wp.mat33(lidar.T_world_lidar.rotation())
    scan.eye_m = wp.vec3(*lidar.T_world_lidar.translation_m)
    scan.reach_m = beams.range_max_m
    scan.spread = RING_SHARE * math.tan(0.5 * beams.divergence_rad)
    scan.subrays = beams.subrays
    scan.run, scan.threads = RUN_CUDA, THREADS_CUDA
    if cache.device.is_cpu:
        rays = len(beams.directions) * beams.subrays
        scan.run, scan.threads = min(max(rays // RUNS, RUN_MIN), RUN), THREADS
    scan.divergence_rad = beams.divergence_rad
    return scan
