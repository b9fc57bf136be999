"""Laser scanners: their rays through the same world, meshes and materials that cameras see."""

from __future__ import annotations

import math

import numpy as np
import warp as wp
from numpy.typing import NDArray

from generator.core.capture import Beams, Echoes
from generator.core.geometry import SURFACES
from generator.core.intrinsics import Intrinsics
from generator.core.scene import Camera, Lidar, Scene
from generator.renderers.infrared import infrared_surfaces
from generator.renderers.kernels import lidar as kernels
from generator.renderers.labels import category_ids
from generator.renderers.packing import pack_world
from generator.renderers.stock import AssetStock
from generator.renderers.travel import travelling

_SURFACE = {role: number for number, role in enumerate(SURFACES)}

RING_SHARE = math.sqrt(1.0 / 2.0)
"""Radius of the ring of rays, in units of the beam's: half the light is outside it."""


RUN = 64
"""Rays per thread: neighbours mostly hit the same body."""


def scanned(scene: Scene, lidar: Lidar, beams: Beams, stock: AssetStock) -> Echoes:
    """What the rays of all beams hit first."""
    eye = Camera(lidar.name, lidar.T_world_lidar, Intrinsics(1, 1, 1.0, 1.0, 0.5, 0.5))
    world, travel = travelling(scene, lidar, beams, pack_world(scene, eye, stock), stock)
    own = [body.materials or stock.materials(body.asset) for body in scene.bodies]
    materials = [material for group in own for material in group]
    device = stock.device
    shape = (len(beams.directions), beams.subrays)
    count = shape[0] * shape[1]
    lights = wp.array(infrared_surfaces(materials, stock), dtype=kernels.Infrared, device=device)
    axes = wp.array(beams.directions, dtype=wp.vec3, device=device)
    images = [stock.scratch(f"scan {k}", count, float) for k in range(3)]
    hits_ = stock.scratch("scan hits", count, wp.vec2i)
    wp.launch(
        kernels.scan_beams,
        dim=(count + RUN - 1) // RUN,
        inputs=[_scan(lidar, beams), world.record, travel, lights, axes],
        outputs=[*images, hits_],
        device=device,
    )
    ranges_m, reflectances, cosines = (image.numpy().reshape(shape).copy() for image in images)
    hits = hits_.numpy().reshape(*shape, 2)
    bodies = hits[..., 0]
    return Echoes(
        ranges_m,
        reflectances,
        cosines,
        _ids([body.instance_id for body in scene.bodies], bodies),
        _ids(category_ids(scene), bodies),
        _ids([_SURFACE.get(m.role, 0) for m in materials], hits[..., 1]).astype(np.uint8),
    )


def _scan(lidar: Lidar, beams: Beams) -> kernels.Scan:
    scan = kernels.Scan()
    scan.R_world_lidar = wp.mat33(lidar.T_world_lidar.rotation())
    scan.eye_m = wp.vec3(*lidar.T_world_lidar.translation_m)
    scan.reach_m = beams.range_max_m
    scan.spread = RING_SHARE * math.tan(0.5 * beams.divergence_rad)
    scan.subrays = beams.subrays
    scan.run = RUN
    return scan


def _ids(known: list[int], hits: NDArray[np.int32]) -> NDArray[np.uint16]:
    """The id of what is at every hit; 0 where there is nothing."""
    table = np.array([0, *known], dtype=np.uint16)
    ids: NDArray[np.uint16] = table[hits + 1]
    return ids
