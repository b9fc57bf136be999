"""Shading of layered surfaces: clear coats, glass, mirrors and further maps."""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.realtime.kernels import lattice_lighting
from gen_data.generator.renderers.warp.realtime.light_visibility import (
    lamp_samples,
    pixel_samples,
    sunflower,
)
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld
from gen_data.generator.renderers.warp.settings import RenderSettings
from gen_data.generator.renderers.warp.visibility.kernels import edge_detection


@dataclass(frozen=True, eq=False, slots=True)
class ListedPixels:
    """Pixels that are shaded individually.

    Attributes:
        count: Number of pixels; the arrays are longer.
        pixels: Indices of the pixels.
        lit: Visible fraction of each lamp [lamp, position in the list].
        open_sky: Visible fraction of the hemisphere, [1, position].
        exposed: Exposure to precipitation.
    """

    count: int
    pixels: wp.array
    lit: wp.array
    open_sky: wp.array
    exposed: wp.array


_PARTS = 2
"""Samples per pixel on edges in reflections or behind glass."""


def shade_layers(
    world: PackedWorld,
    view: records.View,
    images: lattice_lighting.GBufferRecord,
    listed: ListedPixels,
    radiance: wp.array,
    cache: DeviceCache,
    settings: RenderSettings,
) -> None:
    """Shade the listed pixels that show layered surfaces, in place.

    Pixels with edges in reflections or behind glass take several samples.
    """
    # A module of its own: scenes without such surfaces neither compile nor load it.
    from gen_data.generator.renderers.warp.realtime.kernels import clearcoat_glass

    device = cache.device
    probe = clearcoat_glass.Probe()
    probe.parts = cache.constant(wp.vec2, lamp_samples, 4, settings.shadows)
    probe.disc = cache.constant(wp.vec2, sunflower, 4)
    probe.radius_m = settings.ambient_occlusion_radius_m
    probe.lit = cache.scratch("lit where rays end", listed.lit.shape, float)
    frame = [view, world.record, images]
    seen = [listed.pixels, listed.lit, listed.open_sky, listed.exposed, probe]
    wp.launch(
        clearcoat_glass.shade_layers, listed.count, [*frame, *seen], [radiance], device=device
    )
    if settings.antialias == 1:
        return
    count = wp.zeros(1, dtype=wp.int32, device=device)
    places = cache.scratch("contrasts", view.width * view.height, wp.int32)
    inputs = [*frame, listed.pixels, radiance]
    wp.launch(clearcoat_glass.find_contrasts, listed.count, inputs, [count, places], device=device)
    found = int(count.numpy()[0])
    pixels = cache.scratch("contrast pixels", view.width * view.height, wp.int32)
    mixed = cache.scratch("contrast colours", view.width * view.height, wp.vec3)
    offsets = cache.constant(wp.vec2, pixel_samples, _PARTS)
    inputs = [*frame, places, *seen, offsets]
    wp.launch(clearcoat_glass.shade_contrasts, found, inputs, [pixels, mixed], device=device)
    wp.launch(edge_detection.write_mixed, found, [pixels, mixed], [radiance], device=device)
