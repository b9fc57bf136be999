"""Radiance of the realtime tier: lighting, weather, anti-aliasing."""

from __future__ import annotations

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.core.scene import Camera
from gen_data.generator.renderers.warp.atmosphere.precipitation import draw_precipitation
from gen_data.generator.renderers.warp.atmosphere.weather import expose_ground, fill_air
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.realtime.clearcoat_glass import ListedPixels, shade_layers
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
from gen_data.generator.renderers.warp.scene.light_selection import keep_main_lamps
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld
from gen_data.generator.renderers.warp.settings import RenderSettings
from gen_data.generator.renderers.warp.visibility.alpha_cutouts import (
    has_cutouts,
    trace_over_samples,
)
from gen_data.generator.renderers.warp.visibility.gbuffer import GBuffer, Projected
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
from gen_data.generator.renderers.warp.visibility.kernels.rasterizer import Z_NEAR_M


def surface_light(
    world: PackedWorld,
    view: records.View,
    gbuffer: GBuffer,
    cache: DeviceCache,
    settings: RenderSettings,
) -> wp.array:
    """Radiance at pixel centres through the air [cd/m^2], linear RGB, flat; scratch memory."""
    images = gbuffer_record(gbuffer)
    keep_main_lamps(world, view, gbuffer, cache, settings.max_lamps)
    lattice = make_lattice(world, view, gbuffer, cache)
    radiance = _shade(world, view, images, lattice, cache, settings)
    fill_air(world, view, images, lattice, radiance, cache)
    darken_outside(view, radiance)
    return radiance


def add_precipitation(
    world: PackedWorld, camera: Camera, view: records.View, z_m: wp.array, radiance: wp.array,
    cache: DeviceCache,
) -> None:  # fmt: skip
    """Draw falling rain and snow in front of the surfaces, in place; depths as of GBuffer."""
    if draw_precipitation(world, camera, view, z_m, radiance, cache):
        darken_outside(view, radiance)


def radiance_image(radiance: wp.array, view: records.View) -> Float32:
    """Radiance [cd/m^2], linear RGB, float32 [h, w, 3]; a copy of the flat array."""
    image: Float32 = radiance.numpy().reshape(view.height, view.width, 3).copy()
    return image


def mix_edges(
    world: PackedWorld,
    view: records.View,
    gbuffer: GBuffer,
    radiance: wp.array,
    cache: DeviceCache,
    settings: RenderSettings,
) -> None:
    """Anti-alias in place: pixels on edges become the mean of their samples' radiance."""
    samples = settings.antialias
    if samples == 1:
        return
    device, images = cache.device, gbuffer_record(gbuffer)
    count = wp.zeros(1, dtype=wp.int32, device=device)
    pixels = cache.scratch("listed pixels", view.width * view.height, wp.int32)
    wp.launch(find_edges, view.height, [view, images], [count, pixels], device=device)
    edges = pixels[: int(count.numpy()[0])]
    mixed = wp.zeros(max(len(edges), 1), dtype=wp.vec3, device=device)
    frame = [view, world.record, images, radiance, edges]
    if gbuffer.projected is not None:
        drawn = _draw_samples(world, view, gbuffer, gbuffer.projected, edges, samples, cache)
        inputs = [*frame, drawn]
        wp.launch(mixing.mix_samples, len(edges), inputs, [mixed], device=device)
    else:
        parts = cache.constant(wp.vec2, pixel_samples, samples)
        inputs = [*frame, parts, Z_NEAR_M]
        wp.launch(edge_antialiasing.antialias, len(edges), inputs, [mixed], device=device)
    wp.launch(write_mixed, len(edges), [edges, mixed], [radiance], device=device)


def darken_outside(view: records.View, radiance: wp.array) -> None:
    """Set radiance to zero where the lens shows nothing, in place."""
    if view.lens != records.PINHOLE:
        n = view.width * view.height
        wp.launch(distortion.darken_outside, n, [view], [radiance], device=radiance.device)


def _draw_samples(
    world: PackedWorld,
    view: records.View,
    gbuffer: GBuffer,
    projected: Projected,
    pixels: wp.array,
    samples: int,
    cache: DeviceCache,
) -> wp.array:
    """Visible (body, face) at samples of listed pixels, [pixels, samples]; (-1, -1) for none."""
    device = cache.device
    numbers = cache.scratch("numbers", view.width * view.height, wp.int32)
    floors = cache.scratch("floors", view.width * view.height, float)
    floors.fill_(mixing.UNLISTED)
    inputs = [view, gbuffer_record(gbuffer), pixels]
    wp.launch(mixing.number_pixels, len(pixels), inputs, [numbers, floors], device=device)
    shape = (max(len(pixels), 1), samples)
    nearness = wp.zeros(shape, dtype=float, device=device)
    hits = wp.full(shape, wp.vec2i(-1, -1), dtype=wp.vec2i, device=device)
    offsets = cache.constant(wp.vec2i, _offsets, samples)
    window = rasterizer.Window()
    window.width, window.height = view.width, view.height
    cutouts = has_cutouts(world.body_records)[projected.in_view]
    bodies = wp.array(projected.in_view[~cutouts], dtype=wp.int32, device=device)
    inputs = [view, window, world.record, bodies, projected.p_camera, projected.xy]
    inputs += [numbers, floors, offsets]
    wp.launch(mixing.draw_samples, len(bodies), inputs, [nearness, hits], device=device)
    if cutouts.any():
        listed = projected.in_view[cutouts]
        parts = pixel_samples(samples)
        trace_over_samples(world, view, listed, pixels, parts, nearness, hits)
    return hits


def _offsets(samples: int) -> NDArray[np.int32]:
    """Offsets of samples from a pixel's centre, in steps of 1/256 pixel, [samples, 2]."""
    return (pixel_samples(samples) * 256.0 - 128.0).astype(np.int32)


def gbuffer_record(gbuffer: GBuffer) -> lattice_lighting.GBufferRecord:
    """The G-buffer as kernels read it."""
    images = lattice_lighting.GBufferRecord()
    images.hits, images.z_m = gbuffer.hits, gbuffer.z_m
    images.weights, images.normals = gbuffer.weights, gbuffer.normals
    return images


def _shade(
    world: PackedWorld,
    view: records.View,
    images: lattice_lighting.GBufferRecord,
    lattice: Lattice,
    cache: DeviceCache,
    settings: RenderSettings,
) -> wp.array:
    """Radiance at all pixel centres [cd/m^2], linear RGB, flat."""
    device, n = cache.device, view.width * view.height
    expose_ground(world, lattice, cache)
    radiance = cache.scratch("radiance", n, wp.vec3)
    around = find_light_visibility(world, view, lattice, cache, settings)
    corners = lattice.width * lattice.height
    lights = cache.scratch("lights", corners, lattice_lighting.LatticeLight)
    coats = cache.scratch("coats", corners, wp.vec4)
    frame = [view, world.record, images]
    inputs = [*frame, lattice, around.lit, around.open_sky]
    wp.launch(lattice_lighting.light_lattice, corners, inputs, [lights, coats], device=device)
    count = wp.zeros(1, dtype=wp.int32, device=device)
    pixels = cache.scratch("listed pixels", n, wp.int32)
    # One thread per row on the CPU, where threads run one after the other anyway.
    cells = lattice.width - 1
    run = cells if device.is_cpu else 1
    inputs = [*frame, lattice, lights, coats, run]
    shape = (lattice.height - 1, cells // run)
    wp.launch(
        lattice_interpolation.gather_light, shape, inputs, [count, pixels, radiance], device=device
    )
    listed = int(count.numpy()[0])
    # Sizes are powers of two, so that few are kept, plus a little: rows of lamps a power of two
    # apart would collide in the processor's cache.
    room = (1 << listed.bit_length()) + 48
    lit = cache.scratch("listed lit", (around.lit.shape[0], room), float)
    open_sky = cache.scratch("listed sky", (1, room), float)
    exposed = cache.scratch("listed exposed", room, float)
    parts = cache.constant(wp.vec2, lamp_samples, 4, settings.shadows)
    disc = cache.constant(wp.vec2, sunflower, 4)
    radius_m = settings.ambient_occlusion_radius_m
    inputs = [*frame, lattice, around.lit, around.open_sky, parts, disc, radius_m, pixels]
    wp.launch(
        lattice_lighting.find_pixel_visibility,
        listed,
        inputs,
        [lit, open_sky, exposed],
        device=device,
    )
    inputs = [*frame, pixels, lit, open_sky, exposed]
    wp.launch(lattice_lighting.shade_points, listed, inputs, [radiance], device=device)
    if world.layered:
        points = ListedPixels(listed, pixels, lit, open_sky, exposed)
        shade_layers(world, view, images, points, radiance, cache, settings)
    return radiance
