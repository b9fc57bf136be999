"""Ray tracing of laser scans, through the same world, meshes and materials as cameras."""

from __future__ import annotations

import math

import numpy as np
import warp as wp

from gen_data.generator.core.capture import LidarHits, LidarRays
from gen_data.generator.core.intrinsics import Intrinsics
from gen_data.generator.core.scene import Camera, Lidar, Scene
from gen_data.generator.renderers.warp.atmosphere.weather import ground_record
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.lidar.infrared_materials import infrared_surfaces
from gen_data.generator.renderers.warp.lidar.kernels import lidar_rays as kernels
from gen_data.generator.renderers.warp.lidar.kernels.ray_packets import LISTED_MAX, Boxes
from gen_data.generator.renderers.warp.lidar.lidar_secondary_rays import (
    FirstHits,
    HitLabels,
    trace_secondary,
)
from gen_data.generator.renderers.warp.lidar.moving_bodies import pack_moving_bodies
from gen_data.generator.renderers.warp.scene.material_packing import body_materials
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld, pack_world
from gen_data.generator.renderers.warp.scene.struct_dtypes import to_device

RING_SHARE = math.sqrt(1.0 / 2.0)
"""Radius of the ring of rays, relative to the beam's: half the light is outside it."""


RUN = 128
"""Rays per run: neighbours hit the same few bodies."""

THREADS = 16
"""Threads of a launch on the CPU, where they run one after another, each with lists of its own."""

RUN_CUDA, THREADS_CUDA = 32, 16384


def trace_scan(scene: Scene, lidar: Lidar, beams: LidarRays, cache: DeviceCache) -> LidarHits:
    """First hits of all beams' rays, and secondary hits of some."""
    eye = Camera(lidar.name, lidar.T_world_lidar, Intrinsics(1, 1, 1.0, 1.0, 0.5, 0.5))
    world, motion = pack_moving_bodies(scene, lidar, beams, pack_world(scene, eye, cache), cache)
    world.record.ground = ground_record(scene.weather)
    per_body = body_materials(scene, cache)
    device = cache.device
    shape = (len(beams.directions), beams.subrays)
    count = shape[0] * shape[1]
    infrared = infrared_surfaces(per_body, cache)
    lights = to_device(infrared, kernels.Infrared, device)
    axes = wp.array(beams.directions, dtype=wp.vec3, device=device, copy=False)
    record = _scan(lidar, beams, cache)
    inputs = [record, world.record, motion, _boxes(world, record.threads, cache), lights, axes]
    order = np.zeros(0, np.int32) if beams.order is None else beams.order
    images = [cache.scratch(f"scan {k}", count, float) for k in range(3)]
    hits_ = cache.scratch("scan hits", count, wp.vec2i)
    covered = bool(world.record.ground.covered)
    mirrors = covered or bool((infrared["mirror"] > 0.0).any())
    normals = cache.scratch("scan normals", count if mirrors else 1, wp.vec3)
    puddles = cache.scratch("scan puddles", count if covered else 1, float)
    wp.launch(
        kernels.scan_beams,
        dim=record.threads,
        inputs=[*inputs, wp.array(order, dtype=int, device=device, copy=False)],
        outputs=[*images, hits_, normals, puddles],
        device=device,
    )
    hits = hits_.numpy()
    labels = HitLabels.of(scene, per_body)
    first = FirstHits(images[0], hits_, normals, hits, puddles.numpy() if covered else None)
    ranges_m, reflectances, cosines = (image.numpy().reshape(shape).copy() for image in images)
    instances, categories, surfaces = labels.at(hits)
    return LidarHits(
        ranges_m,
        reflectances,
        cosines,
        instances.reshape(shape),
        categories.reshape(shape),
        surfaces.reshape(shape),
        trace_secondary(inputs, first, beams.order, infrared, labels, cache),
    )


def _boxes(world: PackedWorld, threads: int, cache: DeviceCache) -> Boxes:
    boxes = Boxes()
    boxes.lows_m, boxes.highs_m = world.lows_m, world.highs_m
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
    is_cpu = cache.device.is_cpu
    scan.run, scan.threads = (RUN, THREADS) if is_cpu else (RUN_CUDA, THREADS_CUDA)
    scan.divergence_rad = beams.divergence_rad
    return scan
