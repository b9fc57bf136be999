"""Shadows and ambient occlusion: visibility of each lamp and of the sky from lattice points."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import warp as wp

from gen_data.generator.core.se3 import Array
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.realtime.kernels import lattice as lattice_kernels
from gen_data.generator.renderers.warp.realtime.kernels import shadow_culling, soft_shadows
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld
from gen_data.generator.renderers.warp.settings import RenderSettings
from gen_data.generator.renderers.warp.visibility.gbuffer import GBuffer

_STRIDE_PX = 3
_TILE = int(shadow_culling.TILE)
_LIST_LENGTH = int(shadow_culling.LIST_LENGTH)
# Column of the sample in each row of a pixel, far from those of neighbouring rows (n-rooks).
_ROOKS = {1: (0,), 2: (1, 0), 4: (1, 3, 0, 2), 8: (1, 4, 7, 2, 5, 0, 3, 6)}


@dataclass(frozen=True, eq=False, slots=True)
class LightVisibility:
    """Visibility of lights from the lattice's points.

    Attributes:
        lit: Visible fraction of each lamp, [lamps, points]; UNSEEN where it has no effect.
        open_sky: Visible fraction of the hemisphere, [1, points].
    """

    lit: wp.array
    open_sky: wp.array


def make_lattice(
    world: PackedWorld, view: records.View, gbuffer: GBuffer, cache: DeviceCache
) -> lattice_kernels.Lattice:
    """Sample the lattice of a view."""
    lattice = lattice_kernels.Lattice()
    lattice.stride = _STRIDE_PX
    lattice.width = (view.width - 1) // _STRIDE_PX + 2
    lattice.height = (view.height - 1) // _STRIDE_PX + 2
    n = lattice.width * lattice.height
    lattice.body = cache.scratch("lattice body", n, wp.int32)
    lattice.surface = cache.scratch("lattice surface", n, wp.int32)
    lattice.pixel = cache.scratch("lattice pixel", n, wp.int32)
    lattice.skip = cache.scratch("lattice skip", n, wp.int32)
    lattice.p_m = cache.scratch("lattice p", n, wp.vec3)
    lattice.normal = cache.scratch("lattice normal", n, wp.vec3)
    lattice.origin_m = cache.scratch("lattice origin", n, wp.vec3)
    inputs = [
        view,
        world.record,
        gbuffer.hits,
        gbuffer.z_m,
        gbuffer.weights,
        gbuffer.normals,
        lattice,
    ]
    wp.launch(lattice_kernels.sample_lattice, n, inputs, device=cache.device)
    return lattice


def find_light_visibility(
    world: PackedWorld,
    view: records.View,
    lattice: lattice_kernels.Lattice,
    cache: DeviceCache,
    settings: RenderSettings,
) -> LightVisibility:
    """Compute shadows and ambient occlusion of all points."""
    lamps = world.record.lamps.shape[0]
    columns = -(-lattice.width // _TILE)
    tiles = columns * -(-lattice.height // _TILE)
    lists = cache.scratch("occluders", (tiles, lamps + 1, 1 + _LIST_LENGTH), wp.int32)
    radius_m = settings.ambient_occlusion_radius_m
    points = lattice.width * lattice.height
    shares = cache.scratch("shares", (max(lamps, 1), points), float)
    wp.launch(
        soft_shadows.weigh_lamps, points, [world.record, lattice], [shares], device=cache.device
    )
    inputs = [world.record, lattice, columns, radius_m, shares, lists]
    wp.launch(shadow_culling.list_occluders, tiles, inputs, device=cache.device)
    return LightVisibility(
        _lamp_visibility(world, view, lattice, lists, shares, settings, cache),
        _sky_visibility(world, view, lattice, lists, columns, radius_m, cache),
    )


def sunflower(n: int) -> Array:
    """Points evenly distributed over the unit disk, [n, 2] (Vogel, Math. Biosciences 44, 1979)."""
    k = np.arange(n)
    radius, angle = np.sqrt((k + 0.5) / n), k * math.pi * (3.0 - math.sqrt(5.0))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def lamp_samples(n: int, shadows: str) -> Array:
    """Points of a lamp's disk at which shadow rays aim, [n, 2]; its centre for hard shadows."""
    return sunflower(n) * (1.0 if shadows == "soft" else 0.0)


def pixel_samples(n: int) -> Array:
    """Sample positions in a pixel, [0, 1), [n, 2]: no two in one row or column (n-rooks)."""
    columns = _ROOKS[n]
    return (np.stack([columns, np.arange(n)], axis=-1) + 0.5) / n


def cosine_hemisphere(n: int) -> Array:
    """Unit directions about +Z distributed by the cosine (Malley), [n, 3]."""
    disc = sunflower(n)
    up = np.sqrt(1.0 - (disc * disc).sum(axis=1))
    return np.concatenate([disc, up[:, None]], axis=1)


def _lamp_visibility(
    world: PackedWorld,
    view: records.View,
    lattice: lattice_kernels.Lattice,
    lists: wp.array,
    shares: wp.array,
    settings: RenderSettings,
    cache: DeviceCache,
) -> wp.array:
    device = cache.device
    n, lamps = lattice.width * lattice.height, world.record.lamps.shape[0]
    probed = cache.scratch("probed", (max(lamps, 1), n), float)
    lit = cache.scratch("lit", (max(lamps, 1), n), float)
    if lamps == 0:
        return lit
    disc = cache.constant(wp.vec2, lamp_samples, 48, settings.shadows)
    columns = -(-lattice.width // _TILE)
    inputs = [world.record, lattice, columns, lists, disc, shares]
    for parity in (0, 1):
        wp.launch(soft_shadows.probe_lamps, n, [*inputs, parity], [probed], device=device)
    classes = _classify(lattice, probed, lamps, cache)
    wp.launch(soft_shadows.refine_lamps, n, [*inputs, classes, probed], [lit], device=device)
    _smooth(view, lattice, lit, probed, cache)
    return probed


def _sky_visibility(
    world: PackedWorld,
    view: records.View,
    lattice: lattice_kernels.Lattice,
    lists: wp.array,
    columns: int,
    radius_m: float,
    cache: DeviceCache,
) -> wp.array:
    n = lattice.width * lattice.height
    probed = cache.scratch("probed sky", (1, n), float)
    open_sky = cache.scratch("open sky", (1, n), float)
    if radius_m == 0.0:
        open_sky.fill_(1.0)
        return open_sky
    hemisphere = cache.constant(wp.vec3, cosine_hemisphere, 16)
    inputs = [world.record, lattice, columns, lists, hemisphere, radius_m]
    wp.launch(soft_shadows.probe_ambient, n, inputs, [probed], device=cache.device)
    _smooth(view, lattice, probed, open_sky, cache)
    return open_sky


def _smooth(
    view: records.View,
    lattice: lattice_kernels.Lattice,
    values: wp.array,
    smoothed: wp.array,
    cache: DeviceCache,
) -> None:
    rows, n = values.shape
    classes = _classify(lattice, values, rows, cache)
    sums = cache.scratch("row sums", (rows, n), wp.vec2)
    inputs = [view, lattice, classes, values]
    wp.launch(soft_shadows.sum_rows, n, inputs, [sums], device=cache.device)
    wp.launch(soft_shadows.smooth_lattice, n, [*inputs, sums], [smoothed], device=cache.device)


def _classify(
    lattice: lattice_kernels.Lattice, values: wp.array, rows: int, cache: DeviceCache
) -> wp.array:
    shape = (-(-lattice.height // 4), -(-lattice.width // 4), rows)
    classes = cache.scratch("classes", shape, wp.int32)
    wp.launch(
        soft_shadows.classify_blocks, shape, [lattice, values], [classes], device=cache.device
    )
    return classes
