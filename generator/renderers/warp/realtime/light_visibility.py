"""Shadows and ambient occlusion: visibility of each lamp and of the sky from lattice points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from gen_data.generator.core.se3 import Array
from gen_data.generator.renderers.warp.frame_context import CameraView
from gen_data.generator.renderers.warp.realtime.kernels import shadow_culling, soft_shadows
from gen_data.generator.renderers.warp.realtime.kernels.lattice import Lattice, sample_lattice

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


def make_lattice(frame: CameraView) -> Lattice:
    """Sample the lattice of a view."""
    lattice = Lattice()
    lattice.stride = _STRIDE_PX
    lattice.width = (frame.view.width - 1) // _STRIDE_PX + 2
    lattice.height = (frame.view.height - 1) // _STRIDE_PX + 2
    n = lattice.width * lattice.height
    for name in ("body", "surface", "pixel", "skip"):
        setattr(lattice, name, frame.cache.scratch(f"lattice {name}", n, wp.int32))
    for name in ("p_m", "normal", "origin_m"):
        setattr(lattice, name, frame.cache.scratch(f"lattice {name}", n, wp.vec3))
    frame.launch(sample_lattice, n, [*frame.inputs, lattice])
    return lattice


def find_light_visibility(frame: CameraView, lattice: Lattice) -> LightVisibility:
    """Compute shadows and ambient occlusion of all points."""
    world, cache = frame.world.record, frame.cache
    lamps = world.lamps.shape[0]
    columns = -(-lattice.width // _TILE)
    tiles = columns * -(-lattice.height // _TILE)
    lists = cache.scratch("occluders", (tiles, lamps + 1, 1 + _LIST_LENGTH), wp.int32)
    radius_m = frame.settings.ambient_occlusion_radius_m
    points = lattice.width * lattice.height
    shares = cache.scratch("shares", (max(lamps, 1), points), float)
    frame.launch(soft_shadows.weigh_lamps, points, [world, lattice], [shares])
    inputs = [world, lattice, columns, radius_m, shares, lists]
    frame.launch(shadow_culling.list_occluders, tiles, inputs)
    inputs = [world, lattice, columns, lists]
    return LightVisibility(
        _lamp_visibility(frame, lattice, inputs, shares), _sky_visibility(frame, lattice, inputs)
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
    frame: CameraView, lattice: Lattice, inputs: list[Any], shares: wp.array
) -> wp.array:
    cache, lamps = frame.cache, frame.world.record.lamps.shape[0]
    n = lattice.width * lattice.height
    probed, lit = (cache.scratch(name, (max(lamps, 1), n), float) for name in ("probed", "lit"))
    if lamps == 0:
        return lit
    disc = cache.constant(wp.vec2, lamp_samples, 48, frame.settings.shadows)
    inputs = [*inputs, disc, shares]
    for parity in (0, 1):
        frame.launch(soft_shadows.probe_lamps, n, [*inputs, parity], [probed])
    classes = _classify(frame, lattice, probed)
    frame.launch(soft_shadows.refine_lamps, n, [*inputs, classes, probed], [lit])
    _smooth(frame, lattice, lit, probed)
    return probed


def _sky_visibility(frame: CameraView, lattice: Lattice, inputs: list[Any]) -> wp.array:
    cache, radius_m = frame.cache, frame.settings.ambient_occlusion_radius_m
    n = lattice.width * lattice.height
    probed, open_sky = (cache.scratch(name, (1, n), float) for name in ("probed sky", "open sky"))
    if radius_m == 0.0:
        open_sky.fill_(1.0)
        return open_sky
    hemisphere = cache.constant(wp.vec3, cosine_hemisphere, 16)
    frame.launch(soft_shadows.probe_ambient, n, [*inputs, hemisphere, radius_m], [probed])
    _smooth(frame, lattice, probed, open_sky)
    return open_sky


def _smooth(frame: CameraView, lattice: Lattice, values: wp.array, smoothed: wp.array) -> None:
    sums = frame.cache.scratch("row sums", values.shape, wp.vec2)
    inputs = [frame.view, lattice, _classify(frame, lattice, values), values]
    frame.launch(soft_shadows.sum_rows, values.shape[1], inputs, [sums])
    frame.launch(soft_shadows.smooth_lattice, values.shape[1], [*inputs, sums], [smoothed])


def _classify(frame: CameraView, lattice: Lattice, values: wp.array) -> wp.array:
    shape = (-(-lattice.height // 4), -(-lattice.width // 4), values.shape[0])
    classes = frame.cache.scratch("classes", shape, wp.int32)
    frame.launch(soft_shadows.classify_blocks, shape, [lattice, values], [classes])
    return classes
