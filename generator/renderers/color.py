"""Radiance of the realtime tier: light and shade, weather, anti-aliasing."""

from __future__ import annotations

import numpy as np
import warp as wp
from numpy.typing import NDArray

from generator.core.geometry import Float32
from generator.core.scene import Camera
from generator.renderers.kernels import antialias, gather, optics, raster, records, shade
from generator.renderers.kernels import samples as mixing
from generator.renderers.kernels.edges import find_edges, put_mixed
from generator.renderers.kernels.lattice import Lattice
from generator.renderers.kernels.raster import Z_NEAR_M
from generator.renderers.lamps import keep_main_lamps
from generator.renderers.layers import ListedPixels, shade_layers
from generator.renderers.occlusion import (
    lamp_parts,
    openness,
    pixel_parts,
    sampled_lattice,
    sunflower,
)
from generator.renderers.packing import PackedWorld
from generator.renderers.pierced import has_holes, trace_over_samples
from generator.renderers.precipitation import draw_precipitation
from generator.renderers.settings import RenderSettings
from generator.renderers.stock import AssetStock
from generator.renderers.visibility import Projected, Seen
from generator.renderers.weather import expose_ground, fill_air


def surface_light(
    world: PackedWorld,
    view: records.View,
    seen: Seen,
    stock: AssetStock,
    settings: RenderSettings,
) -> wp.array:
    """What comes from pixel centres through the air [cd/m^2], linear RGB, flat; scratch memory."""
    images = images_of(seen)
    keep_main_lamps(world, view, seen, stock, settings.max_lamps)
    lattice = sampled_lattice(world, view, seen, stock)
    radiance = _shaded(world, view, images, lattice, stock, settings)
    fill_air(world, view, images, lattice, radiance, stock)
    darken_outside(view, radiance)
    return radiance


def add_falling(
    world: PackedWorld, camera: Camera, view: records.View, z_m: wp.array, radiance: wp.array,
    stock: AssetStock,
) -> None:  # fmt: skip
    """Draw rain and snow between the camera and what it sees, in place; depths as of Seen."""
    if draw_precipitation(world, camera, view, z_m, radiance, stock):
        darken_outside(view, radiance)


def radiance_image(radiance: wp.array, view: records.View) -> Float32:
    """Luminance in linear RGB [cd/m^2], float32 [h, w, 3]; a copy of the flat array."""
    image: Float32 = radiance.numpy().reshape(view.height, view.width, 3).copy()
    return image


def mix_edges(
    world: PackedWorld,
    view: records.View,
    seen: Seen,
    radiance: wp.array,
    stock: AssetStock,
    settings: RenderSettings,
) -> None:
    """Anti-alias in place: pixels on edges become the mean of their samples' radiance."""
    samples = settings.antialias
    if samples == 1:
        return
    device, images = stock.device, images_of(seen)
    count = wp.zeros(1, dtype=wp.int32, device=device)
    pixels = stock.scratch("listed pixels", view.width * view.height, wp.int32)
    wp.launch(find_edges, view.height, [view, images], [count, pixels], device=device)
    edges = pixels[: int(count.numpy()[0])]
    mixed = wp.zeros(max(len(edges), 1), dtype=wp.vec3, device=device)
    frame = [view, world.record, images, radiance, edges]
    if seen.projected is not None:
        drawn = _drawn_samples(world, view, seen, seen.projected, edges, samples, stock)
        inputs = [*frame, drawn]
        wp.launch(mixing.mix_samples, len(edges), inputs, [mixed], device=device)
    else:
        parts = stock.constant(wp.vec2, pixel_parts, samples)
        inputs = [*frame, parts, Z_NEAR_M]
        wp.launch(antialias.antialias, len(edges), inputs, [mixed], device=device)
    wp.launch(put_mixed, len(edges), [edges, mixed], [radiance], device=device)


def darken_outside(view: records.View, radiance: wp.array) -> None:
    """Leave no light where the lens shows nothing, in place."""
    if view.lens != records.PINHOLE:
        n = view.width * view.height
        wp.launch(optics.darken_outside, n, [view], [radiance], device=radiance.device)


def _drawn_samples(
    world: PackedWorld,
    view: records.View,
    seen: Seen,
    projected: Projected,
    pixels: wp.array,
    samples: int,
    stock: AssetStock,
) -> wp.array:
    """What the parts of listed pixels see: (body, face), shape [pixels, parts]; (-1, -1)."""
    device = stock.device
    numbers = stock.scratch("numbers", view.width * view.height, wp.int32)
    floors = stock.scratch("floors", view.width * view.height, float)
    floors.fill_(mixing.UNLISTED)
    inputs = [view, images_of(seen), pixels]
    wp.launch(mixing.number_pixels, len(pixels), inputs, [numbers, floors], device=device)
    shape = (max(len(pixels), 1), samples)
    nearness = wp.zeros(shape, dtype=float, device=device)
    hits = wp.full(shape, wp.vec2i(-1, -1), dtype=wp.vec2i, device=device)
    offsets = stock.constant(wp.vec2i, _offsets, samples)
    window = raster.Window()
    window.width, window.height = view.width, view.height
    pierced = has_holes(world.placed)[projected.in_view]
    bodies = wp.array(projected.in_view[~pierced], dtype=wp.int32, device=device)
    inputs = [view, window, world.record, bodies, projected.p_camera, projected.xy]
    inputs += [numbers, floors, offsets]
    wp.launch(mixing.draw_samples, len(bodies), inputs, [nearness, hits], device=device)
    if pierced.any():
        listed = projected.in_view[pierced]
        parts = pixel_parts(samples)
        trace_over_samples(world, view, listed, pixels, parts, nearness, hits)
    return hits


def _offsets(samples: int) -> NDArray[np.int32]:
    """Of a pixel's parts from its centre, in steps of 1/256 pixel, shape [samples, 2]."""
    return (pixel_parts(samples) * 256.0 - 128.0).astype(np.int32)


def images_of(seen: Seen) -> shade.Images:
    """What kernels read of the surfaces that are seen."""
    images = shade.Images()
    images.hits, images.z_m = seen.hits, seen.z_m
    images.weights, images.normals = seen.weights, seen.normals
    return images


def _shaded(
    world: PackedWorld,
    view: records.View,
    images: shade.Images,
    lattice: Lattice,
    stock: AssetStock,
    settings: RenderSettings,
) -> wp.array:
    """Luminance at all pixel centres [cd/m^2], linear RGB, flat."""
    device, n = stock.device, view.width * view.height
    expose_ground(world, lattice, stock)
    radiance = stock.scratch("radiance", n, wp.vec3)
    around = openness(world, view, lattice, stock, settings)
    corners = lattice.width * lattice.height
    lights = stock.scratch("lights", corners, shade.Light)
    coats = stock.scratch("coats", corners, wp.vec4)
    frame = [view, world.record, images]
    inputs = [*frame, lattice, around.lit, around.open_sky]
    wp.launch(shade.light_lattice, corners, inputs, [lights, coats], device=device)
    count = wp.zeros(1, dtype=wp.int32, device=device)
    pixels = stock.scratch("listed pixels", n, wp.int32)
    # One thread per row on the CPU, where threads run one after the other anyway.
    cells = lattice.width - 1
    run = cells if device.is_cpu else 1
    inputs = [*frame, lattice, lights, coats, run]
    shape = (lattice.height - 1, cells // run)
    wp.launch(gather.gather_light, shape, inputs, [count, pixels, radiance], device=device)
    listed = int(count.numpy()[0])
    # In powers of two, so that few sizes are kept, and a little more: lamps a power of two apart
    # would share their places in the processor's cache.
    room = (1 << listed.bit_length()) + 48
    lit = stock.scratch("listed lit", (around.lit.shape[0], room), float)
    open_sky = stock.scratch("listed sky", (1, room), float)
    exposed = stock.scratch("listed exposed", room, float)
    parts = stock.constant(wp.vec2, lamp_parts, 4, settings.shadows)
    disc = stock.constant(wp.vec2, sunflower, 4)
    radius_m = settings.ambient_occlusion_radius_m
    inputs = [*frame, lattice, around.lit, around.open_sky, parts, disc, radius_m, pixels]
    wp.launch(shade.look_around, listed, inputs, [lit, open_sky, exposed], device=device)
    inputs = [*frame, pixels, lit, open_sky, exposed]
    wp.launch(shade.shade_points, listed, inputs, [radiance], device=device)
    if world.layered:
        points = ListedPixels(listed, pixels, lit, open_sky, exposed)
        shade_layers(world, view, images, points, radiance, stock, settings)
    return radiance
