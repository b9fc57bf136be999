"""Images whose rows are exposed at several instants, or for a while.

Labels are those of each row's own instant, the middle of its exposure. Light is averaged over the
exposure: time is cut into slices, every slice is rendered at its middle as far as rows are exposed
then, and every row is the mean of its slices. Both take no more instants than motion in the image
makes necessary.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from generator.core.capture import Channel, Reading, Silhouette
from generator.core.geometry import Float32
from generator.core.scene import Camera, Scene
from generator.core.shutter import INSTANT
from generator.renderers.color import (
    LitImage,
    color_image,
    lit_image,
    mix_edges,
    pass_lens,
    radiance_image,
    surface_light,
)
from generator.renderers.flow import FLOW, flow_images
from generator.renderers.lamps import main_lamp_numbers
from generator.renderers.moments import Band, Moment, moves, sight
from generator.renderers.outlines import rolled_silhouettes
from generator.renderers.pace import bands_of, pace_of
from generator.renderers.shown import Studio, drawn_bands, shown_in

_LIT = frozenset({Channel.RGB, Channel.RADIANCE})
_METERING = 4
# Light on the lattice is smoothed over as many rows; its pattern repeats after as many.
_MARGIN_PX = 12


@dataclass(frozen=True, eq=False, slots=True)
class Slice:
    """A slice of time, and the rows that are exposed in it.

    Attributes:
        band: The rows, and the slice's middle.
        weights: Share of each row's exposure that falls into the slice, shape [rows].
    """

    band: Band
    weights: Float32


def exposed(
    scene: Scene, camera: Camera, channels: frozenset[Channel], studio: Studio
) -> Reading | None:
    """The image of a camera whose shutter is open for a while; None if nothing moves meanwhile."""
    middle = Moment.of(scene, camera)
    open_s = camera.shutter.open_s
    if not open_s > 0.0 or not moves(middle, open_s):
        return None
    see = sight(middle, studio.stock, studio.settings.visibility)
    pace = pace_of(middle, shown_in(middle, see))
    bands = bands_of(middle, studio, pace)
    if len(bands) == 1 and pace.samples == 1:
        return None
    lamps = main_lamp_numbers(see.world, see.view, see.seen, studio.settings.max_lamps)
    drawn = channels - FLOW - _LIT - {Channel.AMODAL}
    if Channel.AMODAL in channels:
        drawn = drawn | {Channel.INSTANCE}
    shown, images = drawn_bands(bands, drawn, studio)
    ev100 = camera.ev100
    if channels & _LIT:
        ev100 = _metered(middle, studio) if ev100 is None else ev100
        slices = slices_of(middle, pace.samples) if pace.samples > 1 else _single(bands)
        kept = None if lamps is None else tuple(int(k) for k in lamps)
        radiance = _averaged(slices, ev100, kept, studio)
        images |= _developed(radiance, shown.z_m, middle, ev100, channels, studio)
    outlines: dict[int, Silhouette] = {}
    if Channel.AMODAL in channels:
        outlines = rolled_silhouettes(middle, bands, images[Channel.INSTANCE], studio)
    images |= flow_images(middle, shown, channels, studio)
    return Reading(camera.name, camera, images, outlines, scene.time_s, ev100)


def slices_of(middle: Moment, samples: int) -> list[Slice]:
    """Slices of time, ``samples`` to an exposure, that together hold every row's exposure once."""
    shutter, height = middle.camera.shutter, middle.camera.intrinsics.height_px
    step_s = shutter.exposure_s / samples
    count = max(math.ceil(round(shutter.open_s / step_s, 6)), 1)
    offsets = (np.arange(count) - 0.5 * (count - 1)) * step_s
    delays, half_s = shutter.row_delays_s(height), 0.5 * shutter.exposure_s
    starts, ends = offsets[:, None] - 0.5 * step_s, offsets[:, None] + 0.5 * step_s
    shares = np.minimum(ends, delays + half_s) - np.maximum(starts, delays - half_s)
    # What rounding leaves of a slice is not worth rendering.
    shares = np.where(shares > 1e-6 * step_s, shares, 0.0)
    shares /= shares.sum(axis=0)
    slices = []
    for offset_s, share in zip(offsets, shares, strict=True):
        rows = np.flatnonzero(share)
        if len(rows):
            first, end = int(rows[0]), int(rows[-1]) + 1
            band = Band(first, end, middle.later(float(offset_s)))
            slices.append(Slice(band, share[first:end].astype(np.float32)))
    return slices


def _single(bands: Sequence[Band]) -> list[Slice]:
    """Every band as a slice of its own."""
    return [Slice(band, np.ones(band.end - band.first, np.float32)) for band in bands]


def _averaged(
    slices: Sequence[Slice], ev100: float, lamps: tuple[int, ...] | None, studio: Studio
) -> Float32:
    """Means over slices of what comes from every pixel [cd/m^2], float32 [h, w, 3].

    Args:
        slices: Of the exposure.
        ev100: At which edges are mixed.
        lamps: Numbers of those that matter in the middle of the exposure, and light every slice;
            None = all.
        studio: Assets and settings.
    """
    lens = slices[0].band.moment.camera.intrinsics
    mean = np.zeros((lens.height_px, lens.width_px, 3), np.float32)
    for part in slices:
        band = part.band
        first, end = _with_margin(band, lens.height_px)
        moment = _lit_by(band.moment, lamps)
        see = sight(moment, studio.stock, studio.settings.visibility, (first, end))
        light = surface_light(see.world, see.view, see.seen, studio.stock, studio.settings)
        lit = LitImage(light, ev100)
        mix_edges(see.world, see.view, see.seen, lit, studio.stock, studio.settings)
        rows = light.numpy().reshape(end - first, lens.width_px, 3)[band.first - first :]
        rows = rows[: band.end - band.first]
        mean[band.first : band.end] += part.weights[:, None, None] * rows
    return mean


def _with_margin(band: Band, height_px: int) -> tuple[int, int]:
    """Rows to render so that light in the band is as it is in the whole image."""
    first = max(band.first - _MARGIN_PX, 0) // _MARGIN_PX * _MARGIN_PX
    end = -(-(band.end + _MARGIN_PX) // _MARGIN_PX) * _MARGIN_PX + 1
    return first, min(end, height_px)


def _lit_by(moment: Moment, lamps: tuple[int, ...] | None) -> Moment:
    if lamps is None:
        return moment
    kept = tuple(moment.scene.lights[k] for k in lamps)
    return replace(moment, scene=replace(moment.scene, lights=kept))


def _developed(
    radiance: Float32,
    z_m: Float32,
    middle: Moment,
    ev100: float,
    channels: frozenset[Channel],
    studio: Studio,
) -> dict[Channel, NDArray[Any]]:
    """What the lens adds, and the response of the camera."""
    stock, settings = studio.stock, studio.settings
    see = sight(middle, stock, settings.visibility)
    light = wp.array(radiance.reshape(-1, 3), dtype=wp.vec3, device=stock.device)
    depth = wp.array(z_m.reshape(-1), dtype=float, device=stock.device)
    lit = LitImage(light, ev100)
    pass_lens(see.world, middle.camera, see.view, depth, lit, stock, settings)
    images: dict[Channel, NDArray[Any]] = {}
    if Channel.RADIANCE in channels:
        images[Channel.RADIANCE] = radiance_image(lit, see.view)
    if Channel.RGB in channels:
        images[Channel.RGB] = color_image(lit, see.view, stock, settings)
    return images


def _metered(middle: Moment, studio: Studio) -> float:
    """The exposure value for the middle, from an image of a quarter of the size."""
    lens = middle.camera.intrinsics
    small = replace(
        lens,
        width_px=max(lens.width_px // _METERING, 1),
        height_px=max(lens.height_px // _METERING, 1),
        fx_px=lens.fx_px / _METERING,
        fy_px=lens.fy_px / _METERING,
        cx_px=lens.cx_px / _METERING,
        cy_px=lens.cy_px / _METERING,
    )
    camera = replace(middle.camera, intrinsics=small, shutter=INSTANT)
    see = sight(replace(middle, camera=camera), studio.stock, studio.settings.visibility)
    return lit_image(camera, see.world, see.view, see.seen, studio.stock, studio.settings).ev100
