"""Radiance and labels of images exposed at several instants, or over an interval.

The camera's shutter defines the instants. Labels refer to each row's own instant, the middle of its
exposure. Radiance is averaged over the exposure: time is divided into slices, each slice is
rendered at its middle for the rows exposed then, and each row is the weighted mean of its slices.
Both use no more instants than the motion in the image requires.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core.asset_types import Float32
from gen_data.core.capture import Channel, SensorReading, Silhouette
from gen_data.core.scene import Camera, Scene
from gen_data.renderers.warp.realtime import light_selection, realtime_shading
from gen_data.renderers.warp.scene.scene_packing import copy_world, repack_moved
from gen_data.renderers.warp.visibility import amodal, frame_context, optical_flow, reprojection
from gen_data.renderers.warp.visibility.kernels.exposure import add_rows


@dataclass(frozen=True, eq=False, slots=True)
class Slice:
    """A time slice, and the rows exposed during it.

    Attributes:
        band: The rows, and the state at the slice's middle.
        weights: Share of each row's exposure that falls into the slice, shape [rows].
    """

    band: frame_context.RowBand
    weights: Float32


def expose_shutter(
    scene: Scene, camera: Camera, channels: frozenset[Channel], context: frame_context.RenderContext
) -> SensorReading | None:
    """Image of a camera with a finite exposure; None if nothing moves during it."""
    open_s = camera.shutter.open_s
    if not open_s > 0.0:
        return None
    state = frame_context.CameraState.of(scene, camera)
    if not frame_context.is_moving(state, open_s):
        return None
    reference = frame_context.render_view(state, context)
    sampling = reprojection.plan_sampling(reference)
    bands = reprojection.split_bands(reference, sampling)
    if len(bands) == 1 and sampling.samples == 1:
        return None
    reference = _keep_main_lamps(reference)
    drawn = channels - optical_flow.FLOW - {Channel.AMODAL}
    if Channel.AMODAL in channels:
        drawn = drawn | {Channel.INSTANCE}
    gbuffer, images = _render_images(reference, bands, drawn, sampling)
    outlines: dict[int, Silhouette] = {}
    if Channel.AMODAL in channels:
        outlines = amodal.rolling_silhouettes(bands, images[Channel.INSTANCE], reference)
    images |= optical_flow.flow_images(reference, gbuffer, channels)
    return SensorReading(camera.name, camera, images, outlines, scene.time_s)


def _render_images(
    reference: frame_context.CameraView,
    bands: Sequence[frame_context.RowBand],
    channels: frozenset[Channel],
    sampling: reprojection.ShutterSampling,
) -> tuple[reprojection.BandedGBuffer, dict[Channel, NDArray[Any]]]:
    """G-buffer, label images and, if requested, radiance."""
    labels = channels - {Channel.RADIANCE}
    if Channel.RADIANCE not in channels:
        drawn = reprojection.render_bands(bands, labels, reference)
        return drawn.gbuffer, drawn.images
    if sampling.samples > 1:
        drawn = reprojection.render_bands(bands, labels, reference)
        slices = split_slices(reference.state, sampling.samples, sampling.blurred)
        radiance = _average_slices(slices, reference)
    else:
        drawn = reprojection.render_bands(bands, labels, reference, integrate_light)
        radiance = drawn.radiance
    realtime_shading.add_precipitation(reference, drawn.gbuffer.depths, radiance)
    image = realtime_shading.radiance_image(radiance, reference.view)
    return drawn.gbuffer, drawn.images | {Channel.RADIANCE: image}


def split_slices(
    middle: frame_context.CameraState, samples: int, blurred: NDArray[np.bool_] | None = None
) -> list[Slice]:
    """Time slices that together cover every row's exposure once, some per exposure.

    ``middle`` is the state at the middle of the image's exposure. Rows that are not ``blurred`` are
    rendered in the slice nearest to their own instant; None = all are.
    """
    shutter, height = middle.camera.shutter, middle.camera.intrinsics.height_px
    step_s = shutter.exposure_s / samples
    count = max(math.ceil(round(shutter.open_s / step_s, 6)), 1)
    offsets = (np.arange(count) - 0.5 * (count - 1)) * step_s
    delays, half_s = shutter.row_delays_s(height), 0.5 * shutter.exposure_s
    starts, ends = offsets[:, None] - 0.5 * step_s, offsets[:, None] + 0.5 * step_s
    shares = np.minimum(ends, delays + half_s) - np.maximum(starts, delays - half_s)
    # Slivers left by rounding are not worth rendering.
    shares = np.where(shares > 1e-6 * step_s, shares, 0.0)
    shares /= shares.sum(axis=0)
    if blurred is not None:
        nearest = np.abs(offsets[:, None] - delays).argmin(axis=0)
        alone = np.arange(count)[:, None] == nearest
        shares = np.where(blurred, shares, alone)
    slices = []
    for offset_s, share in zip(offsets, shares, strict=True):
        rows = np.flatnonzero(share)
        if len(rows):
            first, end = int(rows[0]), int(rows[-1]) + 1
            band = frame_context.RowBand(first, end, middle.later(float(offset_s)))
            slices.append(Slice(band, share[first:end].astype(np.float32)))
    return slices


def _average_slices(slices: Sequence[Slice], reference: frame_context.CameraView) -> wp.array:
    """Mean radiance over slices [cd/m^2], flat."""
    lens, device = reference.state.camera.intrinsics, reference.cache.device
    mean = wp.zeros(lens.height_px * lens.width_px, dtype=wp.vec3, device=device)
    for part in slices:
        band = part.band
        first, end = reprojection.add_margin(band, lens.height_px)
        rendered = reference = frame_context.render_view(
            band.state, reference.context, (first, end), reference
        )
        weights = wp.array(part.weights, dtype=float, device=device)
        places = [lens.width_px, band.first - first, band.first, weights]
        shape = (band.end - band.first, lens.width_px)
        rendered.launch(add_rows, shape, [*places, integrate_light(rendered)], [mean])
    return mean


def integrate_light(rendered: frame_context.CameraView) -> wp.array:
    """Radiance of every pixel, anti-aliased, flat; valid until the next call."""
    # Shading changes the world's record, from which other instants start.
    rendered = replace(rendered, world=copy_world(rendered.world))
    shading = realtime_shading.shade_pixels(rendered)
    realtime_shading.smooth_edges(shading)
    return shading.radiance


def _keep_main_lamps(reference: frame_context.CameraView) -> frame_context.CameraView:
    """The view with only the lamps that matter at the middle of the exposure."""
    chosen = light_selection.main_lamp_numbers(reference)
    if chosen is None:
        return reference
    scene, camera = reference.state.scene, reference.state.camera
    scene = replace(scene, lights=tuple(scene.lights[k] for k in chosen))
    world = repack_moved(reference.world, scene, camera, reference.cache)
    return replace(reference, state=frame_context.CameraState(scene, camera), world=world)
