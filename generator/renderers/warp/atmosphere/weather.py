"""Weather in images: wet ground, reflections in water, and fog.

Every function returns at once if the scene's weather does not concern it.
"""

import math
from statistics import NormalDist
from typing import Any

import warp as wp

from gen_data.core.scene import LIGHT_KINDS, Weather
from gen_data.renderers.warp.atmosphere.kernels import fog as kernels
from gen_data.renderers.warp.atmosphere.kernels import ground_weathering, water_reflections
from gen_data.renderers.warp.scene.kernels import records
from gen_data.renderers.warp.scene.kernels.lattice import Lattice
from gen_data.renderers.warp.visibility.frame_context import CameraView

# Standard deviation of ground_weathering.fractal_noise, which is nearly normal.
_PATCH_DEVIATION = 0.513
# The same of ground_weathering.wet_places; value noise has 0.43.
_WET_DEVIATION = math.hypot(_PATCH_DEVIATION, 0.43 * ground_weathering.REGION_SHARE)


def expose_ground(frame: CameraView, lattice: Lattice) -> None:
    """Prepare wetness and snow of the world's surfaces."""
    weather, cache = frame.world.weather, frame.cache
    if not weather.wetness + weather.puddles + weather.snow_cover:
        return
    points = lattice.width * lattice.height
    probed = cache.scratch("probed shelter", points, float)
    exposed = cache.scratch("exposed", points, float)
    world = frame.world.record
    frame.launch(water_reflections.probe_exposure, points, [world, lattice], [probed])
    frame.launch(water_reflections.average_exposure, points, [lattice, probed], [exposed])
    world.ground = ground_record(weather, exposed)


def ground_record(weather: Weather, exposed: wp.array | None = None) -> records.GroundRecord:
    """The GroundRecord of a scene's weather.

    ``exposed`` is the exposure of each lattice point to precipitation, if there is a lattice.
    """
    ground = records.GroundRecord()
    ground.covered = int(weather.wetness + weather.puddles + weather.snow_cover > 0.0)
    ground.wetness = weather.wetness
    ground.puddles, ground.puddle_level = weather.puddles, _level(weather.puddles, _WET_DEVIATION)
    ground.snow_cover, ground.snow_level = (
        weather.snow_cover,
        _level(weather.snow_cover, _PATCH_DEVIATION),
    )
    ground.seed = weather.seed % (1 << 30)
    if exposed is not None:
        ground.exposed = exposed
    return ground


def fill_air(frame: CameraView, lattice: Lattice, radiance: wp.array) -> None:
    """Add reflections in water, then fog; in place."""
    if frame.world.weather.wetness + frame.world.weather.puddles > 0.0:
        _add_reflections(frame, lattice, radiance)
    fill_fog(frame, radiance)


def fill_fog(frame: CameraView, radiance: wp.array) -> None:
    """Attenuate radiance by fog and add the fog's own light, in place."""
    if frame.world.weather.fog_extinction_per_m > 0.0:
        inputs = [*frame.inputs, fog_record(frame.world.weather)]
        columns, glow = _lamp_glow(frame, inputs)
        frame.launch(kernels.fill_with_fog, frame.pixels, [*inputs, columns, glow], [radiance])


def _add_reflections(frame: CameraView, lattice: Lattice, radiance: wp.array) -> None:
    """Blend reflections in water on the ground over the image, in place."""
    cache, points = frame.cache, lattice.width * lattice.height
    share = cache.scratch("water", points, wp.vec2)
    films, rows = (cache.scratch(name, points, wp.vec4) for name in ("films", "film rows"))
    seen = [*frame.inputs, lattice, radiance]
    frame.launch(water_reflections.mirror_in_films, points, seen, [share, films])
    for step, source, spread in ((1, films, rows), (lattice.width, rows, films)):
        inputs = [frame.gbuffer.record, lattice, share, source, step]
        frame.launch(water_reflections.blur_films, points, inputs, [spread])
    laid = cache.scratch("laid", frame.pixels, wp.vec4)
    ripples = min(0.004 * frame.world.weather.rain_mm_h, 0.05)
    inputs = [*seen, ripples, share, films]
    frame.launch(water_reflections.mirror_in_puddles, frame.pixels, inputs, [laid])
    frame.launch(water_reflections.lay_water, frame.pixels, [laid], [radiance])


def _lamp_glow(frame: CameraView, inputs: list[Any]) -> tuple[int, wp.array]:
    """Columns and values of a grid of lamps' glow in fog; 0 columns without lamps."""
    stride, sizes = int(kernels.GLOW_STRIDE), (frame.view.width, frame.view.height)
    columns, rows = (-(-(size - 1) // stride) + 2 for size in sizes)
    glow = frame.cache.scratch("glow", columns * rows, wp.vec3)
    if not (frame.world.record.lamps.numpy()["kind"] != LIGHT_KINDS.index("sun")).any():
        return 0, glow
    frame.launch(kernels.glow_at_points, columns * rows, [*inputs, columns], [glow])
    return columns, glow


def fog_record(weather: Weather) -> kernels.Fog:
    """The Fog record of a scene's weather."""
    fog = kernels.Fog()
    fog.extinction_per_m = weather.fog_extinction_per_m
    fog.height_m = weather.fog_height_m
    return fog


def _level(share: float, deviation: float) -> float:
    """Threshold that noise of a standard deviation exceeds on the given share of the ground."""
    if share <= 0.0 or share >= 1.0:
        return 9.0 if share <= 0.0 else -9.0
    return -deviation * NormalDist().inv_cdf(share)
