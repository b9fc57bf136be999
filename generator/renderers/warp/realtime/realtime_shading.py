"""Shading: dispatch to the tier; lighting, weather and anti-aliasing of the realtime one.

Shadows and ambient occlusion are the visibility of each lamp and of the sky from lattice points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from gen_data.core.asset_types import Float32
from gen_data.core.interfaces import Tones
from gen_data.core.se3 import Array
from gen_data.renderers.warp.atmosphere import precipitation, weather
from gen_data.renderers.warp.device import launch
from gen_data.renderers.warp.realtime.kernels import (
    lattice_interpolation,
    lattice_lighting,
    shadow_culling,
    soft_shadows,
)
from gen_data.renderers.warp.realtime.light_selection import extract_sky_lights, keep_main_lamps
from gen_data.renderers.warp.scene.kernels import distortion, ray_queries, records
from gen_data.renderers.warp.scene.kernels.lattice import Lattice, sample_lattice
from gen_data.renderers.warp.scene.struct_dtypes import take_rows
from gen_data.renderers.warp.visibility import gbuffer, plates
from gen_data.renderers.warp.visibility.frame_context import (
    CameraState,
    CameraView,
    RenderContext,
    render_view,
)
from gen_data.renderers.warp.visibility.kernels import edge_antialiasing, edge_detection, rasterizer
from gen_data.renderers.warp.visibility.kernels import msaa as mixing
from gen_data.renderers.warp.visibility.multisampling import draw_samples

_PARTS = 2
"""Positions of further samples of pixels on edges in reflections or behind glass."""
_THIN_LAYERS = 3
"""Surfaces that no pixel centre nearby shows, in one pixel: both rims of a gap, and its ground."""
_COVERAGE_SAMPLES = 8
"""Samples per pixel on edges, which determine the coverage of a photograph."""


@dataclass(frozen=True, eq=False, slots=True)
class LightVisibility:
    """Visibility of lights from the lattice's points.

    Attributes:
        lit: Visible fraction of each lamp, [lamps, points]; UNSEEN where it has no effect.
        open_sky: Visible fraction of the hemisphere, [1, points].
    """

    lit: wp.array
    open_sky: wp.array


@dataclass(frozen=True, eq=False, slots=True)
class Shading:
    """Shaded pixels, and the light in which more points of their surfaces can be shaded.

    Attributes:
        frame: The view, with the selected lights.
        radiance: Radiance of all pixels [cd/m^2], linear RGB, flat; scratch memory.
        lattice: Points at which light was computed; None in the path-traced tier.
        around: Light at these points.
    """

    frame: CameraView
    radiance: wp.array
    lattice: Lattice | None = None
    around: LightVisibility | None = None


def shade_pixels(frame: CameraView) -> Shading:
    """Radiance of all pixels through the air.

    The realtime tier shades pixel centres, which ``smooth_edges`` anti-aliases.
    """
    shading = _shade_world(frame)
    backdrop = frame.context.backdrop
    if backdrop is None:
        return shading
    if frame.context.paths is None:
        plates.show_photo(frame, backdrop, shading.radiance)
    else:
        plates.mix_photo(frame, backdrop, _coverage(frame), shading.radiance)
    return shading


def render_bare_ground(state: CameraState, context: RenderContext) -> wp.array:
    """Radiance of the ground of a photograph without the objects on it, flat."""
    bare = CameraState.of(plates.without_things(state.scene), state.camera)
    frame = render_view(bare, replace(context, backdrop=None))
    return _copy(shade_pixels(frame).radiance)


def _shade_world(frame: CameraView) -> Shading:
    """As ``shade_pixels``, without a photograph."""
    if frame.context.paths is not None:
        return Shading(frame, frame.context.paths.light(frame))
    if frame.settings.environment_shadow == "auto":
        frame = replace(frame, world=extract_sky_lights(frame))
    keep_main_lamps(frame)
    lattice = make_lattice(frame)
    weather.expose_ground(frame, lattice)
    around = find_light_visibility(frame, lattice)
    radiance = _shade(frame, lattice, around)
    weather.fill_air(frame, lattice, radiance)
    darken_outside(frame.view, radiance)
    return Shading(frame, radiance, lattice, around)


def smooth_edges(shading: Shading) -> None:
    """Anti-alias radiance that is not averaged over pixels yet, in place.

    Pixels on edges become the mean of their samples. Then the foreground of a photograph covers the
    image.
    """
    frame, radiance = shading.frame, shading.radiance
    samples, backdrop = frame.settings.antialias, frame.context.backdrop
    centres = None if backdrop is None else _copy(radiance)
    if frame.context.paths is None and samples > 1:
        find = frame.context.find_tones
        if find is None:
            _average_samples(frame, radiance, samples)
        else:
            _average_tones(shading, samples, find(radiance_image(radiance, frame.view)))
    if backdrop is not None and centres is not None:
        plates.restore_photo(frame, centres, radiance)
        plates.cover_by_foreground(frame, backdrop, radiance)


def _coverage(frame: CameraView) -> Float32:
    """Share of each pixel that is not background or a photograph's ground, float32 [h, w]."""
    things = np.repeat(plates.things_in(frame).reshape(-1, 1), 3, axis=1).astype(np.float32)
    values = wp.array(things, dtype=wp.vec3, device=frame.cache.device)
    _average_samples(frame, values, max(frame.settings.antialias, _COVERAGE_SAMPLES))
    return np.ascontiguousarray(radiance_image(values, frame.view)[..., 0])


def _average_samples(frame: CameraView, radiance: wp.array, samples: int) -> None:
    """Replace the values of pixels on edges by the means of their samples, in place."""
    cache, projected = frame.cache, frame.gbuffer.projected
    edges = _find_edges(frame)
    mixed = wp.zeros(max(len(edges), 1), dtype=wp.vec3, device=cache.device)
    inputs = [*frame.inputs, radiance, edges]
    if projected is not None:
        hits = draw_samples(frame, projected, edges, pixel_samples(samples))
        nothing = [wp.empty((0, 0), dtype=t, device=cache.device) for t in (wp.vec2i, wp.vec3)]
        frame.launch(mixing.mix_samples, len(edges), [*inputs, hits, *nothing, 0.0, 0.0], [mixed])
    else:
        inputs += [cache.constant(wp.vec2, pixel_samples, samples), rasterizer.Z_NEAR_M]
        frame.launch(edge_antialiasing.antialias, len(edges), inputs, [mixed])
    frame.launch(edge_detection.write_mixed, len(edges), [edges, mixed], [radiance])


def _average_tones(shading: Shading, samples: int, tones: Tones) -> None:
    """As ``_average_samples``, for pixels that are means of photosites, each with its own tone.

    Surfaces that no centre nearby shows, such as the rounded edges of boards, are shaded.
    """
    frame, radiance, cache = shading.frame, shading.radiance, shading.frame.cache
    edges = _find_edges(frame)
    offsets = cache.constant(wp.vec2, pixel_samples, samples)
    if frame.gbuffer.projected is not None:
        hits = draw_samples(frame, frame.gbuffer.projected, edges, pixel_samples(samples))
    else:
        shape = (max(len(edges), 1), samples)
        hits = cache.scratch("sample hits", shape, wp.vec2i)
        inputs = [frame.view, frame.world.record, edges, offsets, rasterizer.Z_NEAR_M]
        frame.launch(ray_queries.trace_samples, (len(edges), samples), inputs, [hits])
    thin, thin_radiance = _shade_thin(shading, edges, hits, offsets)
    mixed = wp.zeros(max(len(edges), 1), dtype=wp.vec3, device=cache.device)
    inputs = [*frame.inputs, radiance, edges, hits, thin, thin_radiance]
    limits = [tones.white_cd_m2, tones.brightest_cd_m2]
    frame.launch(mixing.mix_samples, len(edges), [*inputs, *limits], [mixed])
    frame.launch(edge_detection.write_mixed, len(edges), [edges, mixed], [radiance])


def _find_edges(frame: CameraView) -> wp.array:
    """Numbers of the pixels that edges may cross; scratch memory."""
    cache = frame.cache
    count = wp.zeros(1, dtype=wp.int32, device=cache.device)
    pixels = cache.scratch("listed pixels", frame.pixels, wp.int32)
    view = frame.view
    run = view.width if cache.device.is_cpu else int(edge_detection.GROUP_PX)
    shape = (view.height, -(-view.width // run))
    frame.launch(
        edge_detection.find_edges, shape, [view, frame.gbuffer.record, run], [count, pixels]
    )
    return pixels[: int(count.numpy()[0])]


def _shade_thin(
    shading: Shading, edges: wp.array, hits: wp.array, offsets: wp.array
) -> tuple[wp.array, wp.array]:
    """Surfaces within pixels on edges that no centre nearby shows, and their radiance.

    Returns:
        (body, face) and radiance, [layers, pixels], written for the edges; (-1, -1) if there is no
        further surface.
    """
    frame, cache, n = shading.frame, shading.frame.cache, shading.frame.pixels
    layers = cache.scratch("thin layers", (_THIN_LAYERS, n), wp.vec2i)
    radiance = cache.scratch("thin radiance", (_THIN_LAYERS, n), wp.vec3)
    thin = gbuffer.GBuffer(
        cache.scratch("thin hits", n, wp.vec2i),
        cache.scratch("thin z", n, float),
        cache.scratch("thin weights", n, wp.vec2),
        cache.scratch("thin normals", n, wp.vec3),
        None,
    )
    pixels = cache.scratch("thin pixels", n, wp.int32)
    view = replace(frame, gbuffer=thin)
    assert shading.lattice is not None, "the realtime tier has a lattice"
    assert shading.around is not None, "light was found there"
    for layer in range(_THIN_LAYERS):
        count = wp.zeros(1, dtype=wp.int32, device=cache.device)
        inputs = [*frame.inputs, edges, hits, offsets, layer, layers, thin.record]
        frame.launch(mixing.find_thin, len(edges), inputs, [count, pixels])
        number = int(count.numpy()[0])
        if number:
            _shade_listed(view, shading.lattice, shading.around, pixels, number, radiance[layer])
    return layers, radiance


def add_precipitation(frame: CameraView, z_m: wp.array, radiance: wp.array) -> None:
    """Draw falling rain and snow in front of the surfaces, in place; depths as of GBuffer."""
    if precipitation.draw_precipitation(frame, z_m, radiance):
        darken_outside(frame.view, radiance)


def radiance_image(radiance: wp.array, view: records.View) -> Float32:
    """Radiance [cd/m^2], linear RGB, float32 [h, w, 3]; a copy of the flat array."""
    return np.asarray(radiance.numpy().reshape(view.height, view.width, 3).copy())


def _copy(radiance: wp.array) -> wp.array:
    copy = wp.empty_like(radiance)
    wp.copy(copy, radiance)
    return copy


def darken_outside(view: records.View, radiance: wp.array) -> None:
    """Set radiance to zero where the lens shows nothing, in place."""
    if view.lens != records.PINHOLE:
        n = view.width * view.height
        launch(distortion.darken_outside, n, [view], [radiance], device=radiance.device)


def _shade(frame: CameraView, lattice: Lattice, around: LightVisibility) -> wp.array:
    """Radiance at all pixel centres [cd/m^2], linear RGB, flat."""
    cache = frame.cache
    radiance = cache.scratch("radiance", frame.pixels, wp.vec3)
    corners = lattice.width * lattice.height
    lights = cache.scratch("lights", corners, lattice_lighting.LatticeLight)
    coats = cache.scratch("coats", corners, wp.vec4)
    seen = [*frame.inputs, lattice, around.lit, around.open_sky]
    frame.launch(lattice_lighting.light_lattice, corners, seen, [lights, coats])
    count = wp.zeros(1, dtype=wp.int32, device=cache.device)
    pixels = cache.scratch("listed pixels", frame.pixels, wp.int32)
    # One thread per row on the CPU, where threads run one after the other anyway.
    cells = lattice.width - 1
    run = cells if cache.device.is_cpu else 1
    inputs, shape = [*frame.inputs, lattice, lights, coats, run], (lattice.height - 1, cells // run)
    frame.launch(lattice_interpolation.gather_light, shape, inputs, [count, pixels, radiance])
    number = int(count.numpy()[0])
    listed, probe = _shade_listed(frame, lattice, around, pixels, number, radiance)
    if frame.world.layered and frame.settings.antialias > 1:
        _refine_layers(frame, number, listed, probe, radiance)
    return radiance


def _shade_listed(
    frame: CameraView,
    lattice: Lattice,
    around: LightVisibility,
    pixels: wp.array,
    number: int,
    radiance: wp.array,
) -> tuple[lattice_lighting.ListedPixels, lattice_lighting.Probe]:
    """Shade ``number`` listed pixels individually, into an image; as ``_light_listed``."""
    listed, probe = _light_listed(frame, lattice, around, pixels, number)
    frame.launch(lattice_lighting.shade_points, number, [*frame.inputs, listed], [radiance])
    if frame.world.layered:
        _shade_layers(frame, number, listed, probe, radiance)
    return listed, probe


def _light_listed(
    frame: CameraView, lattice: Lattice, around: LightVisibility, pixels: wp.array, number: int
) -> tuple[lattice_lighting.ListedPixels, lattice_lighting.Probe]:
    """Light at those ``number`` pixels, and how rays from there find more."""
    cache, settings = frame.cache, frame.settings
    listed = lattice_lighting.ListedPixels()
    listed.pixels = pixels
    # An odd number of cache lines: rows of lamps a power of two apart would collide in the
    # processor's cache.
    room = (number // 32 + 1) * 32 + 16
    listed.lit = cache.scratch("listed lit", (around.lit.shape[0], room), float)
    listed.open_sky = cache.scratch("listed sky", (1, room), float)
    listed.exposed = cache.scratch("listed exposed", room, float)
    probe = lattice_lighting.Probe()
    probe.parts = cache.constant(wp.vec2, lamp_samples, 4, settings.shadows)
    probe.disc = cache.constant(wp.vec2, sunflower, 4)
    probe.centre = cache.constant(wp.vec2, lamp_samples, 1, "hard")
    probe.few = cache.constant(wp.vec2, _dealt_sunflower, 2, 1)
    probe.radius_m = settings.ambient_occlusion_radius_m
    if frame.world.layered:
        probe.lit = cache.scratch("lit where rays end", listed.lit.shape, float)
    inputs = [*frame.inputs, lattice, around.lit, around.open_sky, probe, listed]
    frame.launch(lattice_lighting.find_pixel_visibility, number, inputs)
    return listed, probe


def _shade_layers(
    frame: CameraView,
    number: int,
    listed: lattice_lighting.ListedPixels,
    probe: lattice_lighting.Probe,
    radiance: wp.array,
) -> None:
    """Shade the pixels that show layered surfaces among ``number`` listed ones, in place."""
    # A separate module: scenes without such surfaces neither compile nor load it.
    from gen_data.renderers.warp.realtime.kernels import clearcoat_glass

    inputs = [*frame.inputs, listed, probe]
    frame.launch(clearcoat_glass.shade_layers, number, inputs, [radiance])


def _refine_layers(
    frame: CameraView,
    number: int,
    listed: lattice_lighting.ListedPixels,
    probe: lattice_lighting.Probe,
    radiance: wp.array,
) -> None:
    """Take more samples of layered pixels with edges in reflections or behind glass, in place."""
    from gen_data.renderers.warp.realtime.kernels import clearcoat_glass

    cache = frame.cache
    count = wp.zeros(1, dtype=wp.int32, device=cache.device)
    places = cache.scratch("contrasts", max(number, 1), wp.int32)
    inputs = [*frame.inputs, listed, radiance]
    frame.launch(clearcoat_glass.find_contrasts, number, inputs, [count, places])
    found = int(count.numpy()[0])
    if not found:
        return
    pixels = cache.scratch("contrast pixels", found, wp.int32)
    mixed = cache.scratch("contrast colours", found, wp.vec3)
    offsets = cache.constant(wp.vec2, pixel_samples, _PARTS)
    probe.few = cache.constant(wp.vec2, _dealt_sunflower, _PARTS, _PARTS)
    find = frame.context.find_tones
    tones = Tones(0.0, 0.0) if find is None else find(radiance_image(radiance, frame.view))
    limits = [tones.white_cd_m2, tones.brightest_cd_m2]
    inputs = [*frame.inputs, places, listed, probe, offsets, *limits, radiance]
    frame.launch(clearcoat_glass.shade_contrasts, found, inputs, [pixels, mixed])
    frame.launch(edge_detection.write_mixed, found, [pixels, mixed], [radiance])


_STRIDE_PX = 3
_TILE = int(shadow_culling.TILE)
_BLOCK = int(soft_shadows.BLOCK)
_LIST_LENGTH = int(shadow_culling.LIST_LENGTH)
_ENOUGH_FOR_LAMPS, _ENOUGH_FOR_SKY = 8.0, 20.0
"""Points of a window of 25 below which a higher one is averaged: shadows keep their edges."""
# Column of the sample in each row of a pixel, far from columns of neighbouring rows (n-rooks).
_ROOKS = {1: (0,), 2: (1, 0), 4: (1, 3, 0, 2), 8: (1, 4, 7, 2, 5, 0, 3, 6)}


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
    """Compute shadows and ambient occlusion of all points.

    Lamps that are faint everywhere are removed from the world, in place.
    """
    cache, world = frame.cache, frame.world.record
    shares = _weigh_lamps(frame, lattice)
    columns = -(-lattice.width // _TILE)
    tiles = columns * -(-lattice.height // _TILE)
    lamps = world.lamps.shape[0]
    lists = cache.scratch("occluders", (tiles, lamps + 1, 1 + _LIST_LENGTH), wp.int32)
    radius_m = frame.settings.ambient_occlusion_radius_m
    inputs = [world, lattice, columns, radius_m, shares, lists]
    frame.launch(shadow_culling.list_occluders, tiles, inputs)
    inputs = [world, lattice, columns, lists]
    return LightVisibility(
        _lamp_visibility(frame, lattice, inputs, shares), _sky_visibility(frame, lattice, inputs)
    )


def _weigh_lamps(frame: CameraView, lattice: Lattice) -> wp.array:
    """Shares of the lamps that matter at any point, [lamps, points]; others are removed."""
    cache, world = frame.cache, frame.world.record
    count, points = world.lamps.shape[0], lattice.width * lattice.height
    shares = cache.scratch("shares", (max(count, 1), points), float)
    matters = wp.zeros(max(count, 1), dtype=wp.int32, device=cache.device)
    frame.launch(soft_shadows.weigh_lamps, points, [world, lattice], [shares, matters])
    kept = np.flatnonzero(matters.numpy())
    if len(kept) < count:
        world.lamps = take_rows(world.lamps, kept)
        if len(kept):
            shares = take_rows(shares, kept)
    return shares


def sunflower(n: int) -> Array:
    """Points evenly distributed over the unit disk, [n, 2] (Vogel, Math. Biosciences 44, 1979)."""
    k = np.arange(n)
    radius, angle = np.sqrt((k + 0.5) / n), k * math.pi * (3.0 - math.sqrt(5.0))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def _dealt_sunflower(n: int, samples: int) -> Array:
    """``sunflower`` points dealt out to the samples of a pixel, [samples, n / samples, 2]."""
    dealt: Array = sunflower(n).reshape(-1, samples, 2).swapaxes(0, 1)
    return dealt


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
    cache = frame.cache
    probed, lit = (cache.scratch(name, shares.shape, float) for name in ("probed", "lit"))
    if frame.world.record.lamps.shape[0] == 0:
        return lit
    disc = cache.constant(wp.vec2, lamp_samples, 48, frame.settings.shadows)
    shape, run = _blocks(frame, lattice, len(shares))
    inputs = [*inputs, disc, shares, run]
    for parity in (0, 1):
        frame.launch(soft_shadows.probe_lamps, shape, [*inputs, parity], [probed])
    classes = _classify(frame, lattice, probed)
    frame.launch(soft_shadows.refine_lamps, shape, [*inputs, classes, probed], [lit])
    _smooth(frame, lattice, lit, _ENOUGH_FOR_LAMPS, probed)
    return probed


def _sky_visibility(frame: CameraView, lattice: Lattice, inputs: list[Any]) -> wp.array:
    cache, radius_m = frame.cache, frame.settings.ambient_occlusion_radius_m
    n = lattice.width * lattice.height
    probed, open_sky = (cache.scratch(name, (1, n), float) for name in ("probed sky", "open sky"))
    if radius_m == 0.0:
        open_sky.fill_(1.0)
        return open_sky
    hemisphere = cache.constant(wp.vec3, cosine_hemisphere, 16)
    shape, run = _blocks(frame, lattice, 1)
    frame.launch(soft_shadows.probe_ambient, shape, [*inputs, hemisphere, radius_m, run], [probed])
    _smooth(frame, lattice, probed, _ENOUGH_FOR_SKY, open_sky)
    inputs = [frame.world.record, lattice, probed]
    frame.launch(soft_shadows.restore_strips, n, inputs, [open_sky])
    return open_sky


def _smooth(
    frame: CameraView, lattice: Lattice, values: wp.array, enough: float, smoothed: wp.array
) -> None:
    lights, points = values.shape
    sums = frame.cache.scratch("row sums", (lights, 2, points), float)
    lanes = 8 if frame.cache.device.is_cpu else 1
    shape = (lattice.height, -(-lattice.width // lanes), lights)
    inputs = [frame.view, lattice, lanes, _classify(frame, lattice, values), values]
    frame.launch(soft_shadows.sum_rows, shape, inputs, [sums])
    frame.launch(soft_shadows.smooth_lattice, shape, [*inputs, enough, sums], [smoothed])


def _classify(frame: CameraView, lattice: Lattice, values: wp.array) -> wp.array:
    shape = _blocks(frame, lattice, len(values))[0][:3]
    classes = frame.cache.scratch("classes", shape, wp.int32)
    frame.launch(soft_shadows.classify_blocks, shape, [lattice, values], [classes])
    return classes


def _blocks(
    frame: CameraView, lattice: Lattice, lights: int
) -> tuple[tuple[int, int, int, int], int]:
    """Shape of a launch on the blocks of lights: rows, columns, lights, threads; and the run."""
    points = _BLOCK * _BLOCK
    # One thread per block on the CPU, where threads run one after the other anyway.
    run = points if frame.cache.device.is_cpu else 1
    shape = (-(-lattice.height // _BLOCK), -(-lattice.width // _BLOCK), lights, points // run)
    return shape, run
