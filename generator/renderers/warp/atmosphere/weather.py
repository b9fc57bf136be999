"""Weather in images: wet ground, reflections in water, and fog.

Every function returns at once if the scene's weather does not concern it.
"""

from __future__ import annotations

from statistics import NormalDist
from typing import Any

import warp as wp

from gen_data.generator.core.scene import LIGHT_KINDS, Weather
from gen_data.generator.renderers.warp.atmosphere.kernels import fog as kernels
from gen_data.generator.renderers.warp.atmosphere.kernels import water_reflections
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.realtime.kernels import lattice_lighting
from gen_data.generator.renderers.warp.realtime.kernels.lattice import Lattice
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld

# Standard deviation of ground_weathering.fractal_noise, which is nearly normal.
_PATCH_DEVIATION = 0.513


def expose_ground(world: PackedWorld, lattice: Lattice, cache: DeviceCache) -> None:
    """Prepare wetness and snow of the world's surfaces."""
    weather = world.weather
    if not weather.wetness + weather.puddles + weather.snow_cover:
        return
    points = lattice.width * lattice.height
    probed = cache.scratch("probed shelter", points, float)
    exposed = cache.scratch("exposed", points, float)
    inputs = [world.record, lattice]
    wp.launch(water_reflections.probe_exposure, points, inputs, [probed], device=cache.device)
    inputs = [lattice, probed]
    wp.launch(water_reflections.average_exposure, points, inputs, [exposed], device=cache.device)
    world.record.ground = ground_record(weather, exposed)


def ground_record(weather: Weather, exposed: wp.array | None = None) -> records.GroundRecord:
    """The GroundRecord of a scene's weather.

    Args:
        weather: Weather of the scene.
        exposed: Exposure of each lattice point to precipitation, if there is a lattice.
    """
    ground = records.GroundRecord()
    ground.covered = int(weather.wetness + weather.puddles + weather.snow_cover > 0.0)
    ground.wetness = weather.wetness
    ground.puddles, ground.puddle_level = weather.puddles, _level(weather.puddles)
    ground.snow_cover, ground.snow_level = weather.snow_cover, _level(weather.snow_cover)
    ground.seed = weather.seed % (1 << 30)
    if exposed is not None:
        ground.exposed = exposed
    return ground


def fill_air(
    world: PackedWorld,
    view: records.View,
    images: lattice_lighting.GBufferRecord,
    lattice: Lattice,
    radiance: wp.array,
    cache: DeviceCache,
) -> None:
    """Add reflections in water, then fog; in place."""
    if world.weather.wetness + world.weather.puddles > 0.0:
        _add_reflections(world, view, images, lattice, radiance, cache)
    fill_fog(world, view, images, radiance, cache)


def fill_fog(
    world: PackedWorld,
    view: records.View,
    images: lattice_lighting.GBufferRecord,
    radiance: wp.array,
    cache: DeviceCache,
) -> None:
    """Attenuate radiance by fog and add the fog's own light, in place."""
    if world.weather.fog_extinction_per_m > 0.0:
        frame = [view, world.record, images, fog_record(world.weather)]
        columns, glow = _lamp_glow(world, view, frame, cache)
        inputs, n = [*frame, columns, glow], view.width * view.height
        wp.launch(kernels.fill_with_fog, n, inputs, [radiance], device=cache.device)


def _add_reflections(
    world: PackedWorld,
    view: records.View,
    images: lattice_lighting.GBufferRecord,
    lattice: Lattice,
    radiance: wp.array,
    cache: DeviceCache,
) -> None:
    """Blend reflections in water on the ground over the image, in place."""
    device, n = cache.device, view.width * view.height
    points = lattice.width * lattice.height
    share = cache.scratch("water", points, wp.vec2)
    films, rows = (cache.scratch(name, points, wp.vec4) for name in ("films", "film rows"))
    frame = [view, world.record, images, lattice, radiance]
    wp.launch(water_reflections.mirror_in_films, points, frame, [share, films], device=device)
    for step, source, spread in ((1, films, rows), (lattice.width, rows, films)):
        inputs = [images, lattice, share, source, step]
        wp.launch(water_reflections.blur_films, points, inputs, [spread], device=device)
    laid = cache.scratch("laid", n, wp.vec4)
    ripples = min(0.004 * world.weather.rain_mm_h, 0.05)
    inputs = [*frame, ripples, share, films]
    wp.launch(water_reflections.mirror_in_puddles, n, inputs, [laid], device=device)
    wp.launch(water_reflections.lay_water, n, [laid], [radiance], device=device)


def _lamp_glow(
    world: PackedWorld, view: records.View, frame: list[Any], cache: DeviceCache
) -> tuple[int, wp.array]:
    """Columns and values of a grid of lamps' glow in fog; 0 columns without lamps."""
    stride = int(kernels.GLOW_STRIDE)
    columns, rows = (-(-(size - 1) // stride) + 2 for size in (view.width, view.height))
    glow = cache.scratch("glow", columns * rows, wp.vec3)
    if not (world.record.lamps.numpy()["kind"] != LIGHT_KINDS.index("sun")).any():
        return 0, glow
    inputs = [*frame, columns]
    wp.launch(kernels.glow_at_points, columns * rows, inputs, [glow], device=cache.device)
    return columns, glow


def fog_record(weather: Weather) -> kernels.Fog:
    """The Fog record of a scene's weather."""
    fog = kernels.Fog()
    fog.extinction_per_m = weather.fog_extinction_per_m
    fog.height_m = weather.fog_height_m
    return fog


def _level(share: float) -> float:
    """Threshold that the noise exceeds on the given share of the ground."""
    if share <= 0.0 or share >= 1.0:
        return 9.0 if share <= 0.0 else -9.0
    return -_PATCH_DEVIATION * NormalDist().inv_cdf(share)
