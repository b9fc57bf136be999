"""Shading: dispatch to the tier; lighting, weather and anti-aliasing of the realtime one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.renderers.warp.atmosphere.precipitation import draw_precipitation
from gen_data.generator.renderers.warp.atmosphere.weather import expose_ground, fill_air
from gen_data.generator.renderers.warp.frame_context import CameraView
from gen_data.generator.renderers.warp.realtime.kernels import (
    lattice_interpolation,
    lattice_lighting,
)
from gen_data.generator.renderers.warp.realtime.kernels.lattice import Lattice
from gen_data.generator.renderers.warp.realtime.light_visibility import (
    find_light_visibility,
    lamp_samples,
    make_lattice,
    pixel_samples,
    sunflower,
)
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.scene.light_selection import (
    extract_sky_lights,
    keep_main_lamps,
)
from gen_data.generator.renderers.warp.visibility.gbuffer import (
    Projected,
    has_cutouts,
    trace_over_samples,
)
from gen_data.generator.renderers.warp.visibility.kernels import (
    distortion,
    edge_antialiasing,
    rasterizer,
)
from gen_data.generator.renderers.warp.visibility.kernels import msaa as mixing
from gen_data.generator.renderers.warp.visibility.kernels.edge_detection import (
    find_edges,
    write_mixed,
)

_PARTS = 2
"""Samples per pixel on edges in reflections or behind glass."""


def shade_pixels(frame: CameraView) -> wp.array:
    """Radiance of all pixels through the air [cd/m^2], linear RGB, flat; scratch memory.

    The realtime tier shades pixel centres, which ``smooth_edges`` anti-aliases.
    """
    if frame.context.paths is not None:
        return frame.context.paths.light(frame)
    if frame.settings.environment_shadow == "auto":
        frame = replace(frame, world=extract_sky_lights(frame))
    keep_main_lamps(frame)
    lattice = make_lattice(frame)
    radiance = _shade(frame, lattice)
    fill_air(frame, lattice, radiance)
    darken_outside(frame.view, radiance)
    return radiance


def smooth_edges(frame: CameraView, radiance: wp.array) -> None:
    """Anti-alias radiance that is not averaged over pixels yet, in place.

    Pixels on edges become the mean of their samples' radiance.
    """
    samples = frame.settings.antialias
    if frame.context.paths is not None or samples == 1:
        return
    cache, projected = frame.cache, frame.gbuffer.projected
    count = wp.zeros(1, dtype=wp.int32, device=cache.device)
    pixels = cache.scratch("listed pixels", frame.pixels, wp.int32)
    inputs = [frame.view, frame.gbuffer.record]
    frame.launch(find_edges, frame.view.height, inputs, [count, pixels])
    edges = pixels[: int(count.numpy()[0])]
    mixed = wp.zeros(max(len(edges), 1), dtype=wp.vec3, device=cache.device)
    inputs = [*frame.inputs, radiance, edges]
    if projected is not None:
        inputs.append(_draw_samples(frame, projected, edges, samples))
        frame.launch(mixing.mix_samples, len(edges), inputs, [mixed])
    else:
        inputs += [cache.constant(wp.vec2, pixel_samples, samples), rasterizer.Z_NEAR_M]
        frame.launch(edge_antialiasing.antialias, len(edges), inputs, [mixed])
    frame.launch(write_mixed, len(edges), [edges, mixed], [radiance])


def add_precipitation(frame: CameraView, z_m: wp.array, radiance: wp.array) -> None:
    """Draw falling rain and snow in front of the surfaces, in place; depths as of GBuffer."""
    if draw_precipitation(frame, z_m, radiance):
        darken_outside(frame.view, radiance)


def radiance_image(radiance: wp.array, view: records.View) -> Float32:
    """Radiance [cd/m^2], linear RGB, float32 [h, w, 3]; a copy of the flat array."""
    image: Float32 = radiance.numpy().reshape(view.height, view.width, 3).copy()
    return image


def darken_outside(view: records.View, radiance: wp.array) -> None:
    """Set radiance to zero where the lens shows nothing, in place."""
    if view.lens != records.PINHOLE:
        n = view.width * view.height
        wp.launch(distortion.darken_outside, n, [view], [radiance], device=radiance.device)


def _draw_samples(
    frame: CameraView, projected: Projected, pixels: wp.array, samples: int
) -> wp.array:
    """Visible (body, face) at samples of listed pixels, [pixels, samples]; (-1, -1) for none."""
    cache, view, world = frame.cache, frame.view, frame.world
    numbers = cache.scratch("numbers", frame.pixels, wp.int32)
    floors = cache.scratch("floors", frame.pixels, float)
    floors.fill_(mixing.UNLISTED)
    inputs = [view, frame.gbuffer.record, pixels]
    frame.launch(mixing.number_pixels, len(pixels), inputs, [numbers, floors])
    shape = (max(len(pixels), 1), samples)
    nearness = wp.zeros(shape, dtype=float, device=cache.device)
    hits = wp.full(shape, wp.vec2i(-1, -1), dtype=wp.vec2i, device=cache.device)
    window = rasterizer.Window()
    window.width, window.height = view.width, view.height
    cutouts = has_cutouts(world.body_records)[projected.in_view]
    bodies = wp.array(projected.in_view[~cutouts], dtype=wp.int32, device=cache.device)
    inputs = [view, window, world.record, bodies, projected.p_camera, projected.xy]
    inputs += [numbers, floors, cache.constant(wp.vec2i, _offsets, samples)]
    frame.launch(mixing.draw_samples, len(bodies), inputs, [nearness, hits])
    if cutouts.any():
        listed, parts = projected.in_view[cutouts], pixel_samples(samples)
        trace_over_samples(world, view, listed, pixels, parts, nearness, hits)
    return hits


def _offsets(samples: int) -> NDArray[np.int32]:
    """Offsets of samples from a pixel's centre, in steps of 1/256 pixel, [samples, 2]."""
    return (pixel_samples(samples) * 256.0 - 128.0).astype(np.int32)


def _shade(frame: CameraView, lattice: Lattice) -> wp.array:
    """Radiance at all pixel centres [cd/m^2], linear RGB, flat."""
    cache, settings = frame.cache, frame.settings
    expose_ground(frame, lattice)
    radiance = cache.scratch("radiance", frame.pixels, wp.vec3)
    around = find_light_visibility(frame, lattice)
    corners = lattice.width * lattice.height
    lights = cache.scratch("lights", corners, lattice_lighting.LatticeLight)
    coats = cache.scratch("coats", corners, wp.vec4)
    seen = [*frame.inputs, lattice, around.lit, around.open_sky]
    frame.launch(lattice_lighting.light_lattice, corners, seen, [lights, coats])
    count = wp.zeros(1, dtype=wp.int32, device=cache.device)
    listed = lattice_lighting.ListedPixels()
    listed.pixels = cache.scratch("listed pixels", frame.pixels, wp.int32)
    # One thread per row on the CPU, where threads run one after the other anyway.
    cells = lattice.width - 1
    run = cells if cache.device.is_cpu else 1
    inputs, shape = [*frame.inputs, lattice, lights, coats, run], (lattice.height - 1, cells // run)
    outputs = [count, listed.pixels, radiance]
    frame.launch(lattice_interpolation.gather_light, shape, inputs, outputs)
    number = int(count.numpy()[0])
    # Sizes are powers of two, so that few are kept, plus a little: rows of lamps a power of two
    # apart would collide in the processor's cache.
    room = (1 << number.bit_length()) + 48
    listed.lit = cache.scratch("listed lit", (around.lit.shape[0], room), float)
    listed.open_sky = cache.scratch("listed sky", (1, room), float)
    listed.exposed = cache.scratch("listed exposed", room, float)
    probe = lattice_lighting.Probe()
    probe.parts = cache.constant(wp.vec2, lamp_samples, 4, settings.shadows)
    probe.disc = cache.constant(wp.vec2, sunflower, 4)
    probe.radius_m = settings.ambient_occlusion_radius_m
    frame.launch(lattice_lighting.find_pixel_visibility, number, [*seen, probe, listed])
    frame.launch(lattice_lighting.shade_points, number, [*frame.inputs, listed], [radiance])
    if frame.world.layered:
        probe.lit = cache.scratch("lit where rays end", listed.lit.shape, float)
        _shade_layers(frame, number, listed, probe, radiance)
    return radiance


def _shade_layers(
    frame: CameraView,
    number: int,
    listed: lattice_lighting.ListedPixels,
    probe: lattice_lighting.Probe,
    radiance: wp.array,
) -> None:
    """Shade those of ``number`` listed pixels that show layered surfaces, in place.

    Pixels with edges in reflections or behind glass take several samples.
    """
    # A module of its own: scenes without such surfaces neither compile nor load it.
    from gen_data.generator.renderers.warp.realtime.kernels import clearcoat_glass

    cache = frame.cache
    frame.launch(clearcoat_glass.shade_layers, number, [*frame.inputs, listed, probe], [radiance])
    if frame.settings.antialias == 1:
        return
    count = wp.zeros(1, dtype=wp.int32, device=cache.device)
    places = cache.scratch("contrasts", frame.pixels, wp.int32)
    inputs = [*frame.inputs, listed, radiance]
    frame.launch(clearcoat_glass.find_contrasts, number, inputs, [count, places])
    found = int(count.numpy()[0])
    pixels = cache.scratch("contrast pixels", frame.pixels, wp.int32)
    mixed = cache.scratch("contrast colours", frame.pixels, wp.vec3)
    offsets = cache.constant(wp.vec2, pixel_samples, _PARTS)
    inputs = [*frame.inputs, places, listed, probe, offsets]
    frame.launch(clearcoat_glass.shade_contrasts, found, inputs, [pixels, mixed])
    frame.launch(write_mixed, found, [pixels, mixed], [radiance])
