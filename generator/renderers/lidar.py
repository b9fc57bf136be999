"""Laser scanners: their rays through the same world, meshes and materials that cameras see."""

from __future__ import annotations

import math

import warp as wp

from generator.core.capture import Beams, Echoes
from generator.core.intrinsics import Intrinsics
from generator.core.scene import Camera, Lidar, Scene
from generator.renderers.detours import FirstHits, HitLabels, detours
from generator.renderers.infrared import infrared_surfaces
from generator.renderers.kernels import lidar as kernels
from generator.renderers.packing import pack_world
from generator.renderers.stock import AssetStock
from generator.renderers.travel import travelling
from generator.renderers.weather import ground_of

RING_SHARE = math.sqrt(1.0 / 2.0)
"""Radius of the ring of rays, in units of the beam's: half the light is outside it."""


RUN = 64
"""Rays per thread: neighbours mostly hit the same body."""


def scanned(scene: Scene, lidar: Lidar, beams: Beams, stock: AssetStock) -> Echoes:
    """What the rays of all beams hit first, and what some of them meet besides."""
    eye = Camera(lidar.name, lidar.T_world_lidar, Intrinsics(1, 1, 1.0, 1.0, 0.5, 0.5))
    world, travel = travelling(scene, lidar, beams, pack_world(scene, eye, stock), stock)
    world.record.ground = ground_of(scene.weather)
    own = [body.materials or stock.materials(body.asset) for body in scene.bodies]
    materials = [material for group in own for material in group]
    device = stock.device
    shape = (len(beams.directions), beams.subrays)
    count = shape[0] * shape[1]
    infrared = infrared_surfaces(materials, stock)
    lights = wp.array(infrared, dtype=kernels.Infrared, device=device)
    axes = wp.array(beams.directions, dtype=wp.vec3, device=device)
    inputs = [_scan(lidar, beams), world.record, travel, lights, axes]
    images = [stock.scratch(f"scan {k}", count, float) for k in range(3)]
    hits_ = stock.scratch("scan hits", count, wp.vec2i)
    covered = bool(world.record.ground.covered)
    puddles = stock.scratch("scan puddles", count if covered else 1, float)
    wp.launch(
        kernels.scan_beams,
        dim=(count + RUN - 1) // RUN,
        inputs=inputs,
        outputs=[*images, hits_, puddles],
        device=device,
    )
    hits = hits_.numpy()
    labels = HitLabels.of(scene, materials)
    first = FirstHits(images[0], hits_, hits, puddles.numpy() if covered else None)
    ranges_m, reflectances, cosines = (image.numpy().reshape(shape).copy() for image in images)
    instances, categories, surfaces = labels.at(hits)
    return Echoes(
        ranges_m,
        reflectances,
        cosines,
        instances.reshape(shape),
        categories.reshape(shape),
        surfaces.reshape(shape),
        detours(inputs, first, infrared, labels, stock),
    )


def _scan(lidar: Lidar, beams: Beams) -> kernels.Scan:
    scan = kernels.Scan()
    scan.R_world_lidar = wp.mat33(lidar.T_world_lidar.rotation())
    scan.eye_m = wp.vec3(*lidar.T_world_lidar.translation_m)
    scan.reach_m = beams.range_max_m
    scan.spread = RING_SHARE * math.tan(0.5 * beams.divergence_rad)
    scan.subrays = beams.subrays
    scan.run = RUN
    scan.divergence_rad = beams.divergence_rad
    return scan
