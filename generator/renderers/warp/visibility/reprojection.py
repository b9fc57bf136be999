"""G-buffers assembled from bands of rows, and reprojection of their points to other instants.

Every point is expressed in the frame of its carrier, a body or the world: no search is needed. The
motion of points determines the number of instants that an image requires.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core import asset_types, capture, interfaces
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Scene
from gen_data.core.se3 import Array
from gen_data.core.shutter import INSTANT
from gen_data.renderers.warp.readback import Readback
from gen_data.renderers.warp.visibility import label_images
from gen_data.renderers.warp.visibility.frame_context import (
    CameraState,
    CameraView,
    RowBand,
    is_moving,
    render_view,
)
from gen_data.renderers.warp.visibility.layers import SparseLabels

RadianceFunction = Callable[[CameraView], wp.array]
"""Radiance of every pixel of a view [cd/m^2], flat, on the device."""

# Spacing of the lattice of realtime shading; period of its sampling pattern; and half width of its
# smoothing.
_STRIDE_PX, _PATTERN_PX, _MARGIN_PX = 3, 12, 6


_IMAGES = (wp.vec2i, float, wp.vec2)
"""Types of hits, depths and weights."""


@dataclass(frozen=True, eq=False)
class BandedGBuffer:
    """G-buffer of an image whose rows may differ in time; the host reads it on first use.

    Attributes:
        bands: Bands in order of rows, covering the image.
        memory: Hits, depths and, if ``stride`` is 1, weights as of GBuffer, on the device.
        stride: Distance of its pixels in the image, along rows and columns.
    """

    bands: Sequence[RowBand]
    memory: Readback
    stride: int = 1

    @cached_property
    def _images(self) -> list[NDArray[Any]]:
        shape = sparse_shape(self.intrinsics, self.stride)
        return [image.reshape(*shape, *image.shape[1:]) for image in self.memory.numpy()]

    @property
    def hits(self) -> asset_types.Int32:
        """As of GBuffer, [h, w, 2]."""
        return self._images[0]

    @property
    def z_m(self) -> asset_types.Float32:
        """As of GBuffer, [h, w]."""
        return self._images[1]

    @property
    def weights(self) -> asset_types.Float32:
        """As of GBuffer, [h, w, 2]."""
        return self._images[2]

    @property
    def depths(self) -> wp.array:
        """As of GBuffer, on the device."""
        return self.memory.parts[1]

    @property
    def intrinsics(self) -> Intrinsics:
        """Intrinsics of the camera; the bands hold its poses."""
        return self.bands[0].state.camera.intrinsics


def full_band(state: CameraState) -> RowBand:
    """All rows at one instant."""
    return RowBand(0, state.camera.intrinsics.height_px, state)


def sparse_shape(lens: Intrinsics, stride: int) -> tuple[int, int]:
    """Rows and columns of the grid of every ``stride``-th pixel."""
    return -(-lens.height_px // stride), -(-lens.width_px // stride)


def copy_gbuffer(rendered: CameraView, stride: int = 1) -> BandedGBuffer:
    """Copy of the G-buffer of an image of one instant; without weights if ``stride`` exceeds 1."""
    lens, gbuffer = rendered.state.camera.intrinsics, rendered.gbuffer
    whole, shape = sparse_shape(lens, 1), sparse_shape(lens, stride)
    dtypes = _IMAGES if stride == 1 else _IMAGES[:2]
    memory = Readback.allocate(shape[0] * shape[1], dtypes, rendered.cache.device)
    images = (gbuffer.hits, gbuffer.z_m, gbuffer.weights)
    for copy, image in zip(memory.parts, images, strict=False):
        wp.copy(copy.reshape(shape), image.reshape(whole)[::stride, ::stride])
    return BandedGBuffer((full_band(rendered.state),), memory, stride)


@dataclass(frozen=True, eq=False, slots=True)
class RenderedBands:
    """An image made of bands.

    Attributes:
        images: Its label channels, on the host.
        radiance: As of RadianceFunction; None if not requested.
    """

    gbuffer: BandedGBuffer
    images: dict[capture.Channel, NDArray[Any]]
    radiance: wp.array | None


def render_bands(
    bands: Sequence[RowBand],
    channels: frozenset[capture.Channel],
    reference: CameraView,
    light: RadianceFunction | None = None,
) -> RenderedBands:
    """Render G-buffer and label images of bands that cover the image, each at its own instant.

    ``reference`` is the world at a nearby instant; ``light`` computes radiance, None = not
    requested.
    """
    lens, device = reference.state.camera.intrinsics, reference.cache.device
    pixels = lens.height_px * lens.width_px
    memory = Readback.allocate(pixels, _IMAGES, device)
    labels = label_images.empty_labels(channels, pixels, device)
    radiance = wp.empty(pixels, dtype=wp.vec3, device=device) if light else None
    further: list[SparseLabels] = []
    for band in bands:
        first, end = (band.first, band.end) if light is None else add_margin(band, lens.height_px)
        # Neighbouring bands share the most packed data.
        rendered = reference = render_view(band.state, reference.context, (first, end), reference)
        gbuffer = rendered.gbuffer
        seen = (gbuffer.hits, gbuffer.z_m, gbuffer.weights)
        drawn = label_images.draw_labels(rendered, channels)
        copies = list(zip(memory.parts, seen, strict=True))
        copies += zip(labels.memory.parts, drawn.memory.parts, strict=True)
        if light is not None:
            copies.append((radiance, light(rendered)))
        place, begin = band.first * lens.width_px, (band.first - first) * lens.width_px
        count = (band.end - band.first) * lens.width_px
        for image, part in copies:
            wp.copy(image, part, place, begin, count)
        parts = label_images.trace_further(rendered, channels, drawn)
        further += (part.moved(begin, count, place) for part in parts)
    images = label_images.read_images(labels, lens.height_px, lens.width_px)
    images |= label_images.further_images(reference, images, further, channels)
    return RenderedBands(BandedGBuffer(tuple(bands), memory), images, radiance)


def add_margin(band: RowBand, height_px: int) -> tuple[int, int]:
    """Rows to render for light in a band that equals the light in the whole image."""
    first = max(band.first - _MARGIN_PX, 0) // _PATTERN_PX * _PATTERN_PX
    end = -(-(band.end + _MARGIN_PX) // _STRIDE_PX) * _STRIDE_PX + 1
    return first, min(end, height_px)


_ROWS_AT_ONCE = 32
_ITERATIONS = 4
"""Fixed-point iterations for rolling shutters: position and time of exposure are coupled."""


@dataclass(frozen=True, eq=False, slots=True)
class ScenePoints:
    """Points of a grid of pixels, each in the frame of its carrier.

    Attributes:
        places: Homogeneous coordinates [m], [h, w, 4]; the fourth is 0 for points at infinity. NaN
            where a lens shows nothing.
        carriers: 0 = the world, else a number that ``find_carriers`` gives, [h, w].
        p_camera: The points in the camera frame at their own instant, [h, w, 3].
    """

    places: Array
    carriers: NDArray[np.intp]
    p_camera: Array


@dataclass(frozen=True, eq=False, slots=True)
class ReprojectedPoints:
    """Positions at other instants: camera frame [m] [h, w, 3] and image [px] [h, w, 2]."""

    p_camera: Array
    image_px: Array


def find_carriers(scene: Scene) -> dict[int, int]:
    """Numbers, from 1, of the bodies that may move or change shape, by body index."""
    names = {track.body for track in scene.tracks} | {c.body for c in scene.changes if c.asset}
    moving = [k for k, body in enumerate(scene.bodies) if body.name in names]
    return {k: number for number, k in enumerate(moving, 1)}


def gather_points(gbuffer: BandedGBuffer, carriers: Mapping[int, int]) -> ScenePoints:
    """The visible points at the G-buffer's pixels."""
    hits, stride = gbuffer.hits, gbuffer.stride
    places = np.zeros((*hits.shape[:2], 4))
    numbers = np.zeros(hits.shape[:2], np.intp)
    p_camera = _seen_points(gbuffer)
    known = np.zeros(int(hits[..., 0].max(initial=-1)) + 2, np.intp)
    for body, number in carriers.items():
        if body + 1 < len(known):
            known[body + 1] = number
    for band in gbuffer.bands:
        rows = slice(-(-band.first // stride), -(-band.end // stride))
        scene, T_world_camera = band.state.scene, band.state.camera.T_world_camera
        there = hits[rows, :, 0] >= 0
        shift = np.where(there[..., None], np.asarray(T_world_camera.translation_m), 0.0)
        place = T_world_camera.rotate(p_camera[rows]) + shift
        numbers[rows] = known[hits[rows, :, 0] + 1]
        for body in np.unique(hits[rows, :, 0][numbers[rows] > 0]):
            own = hits[rows, :, 0] == body
            place[own] = scene.bodies[body].T_world_body.inverse().apply(place[own])
        places[rows, :, :3], places[rows, :, 3] = place, there
    return ScenePoints(places, numbers, p_camera)


def reproject(
    points: ScenePoints, bands: Sequence[RowBand], carriers: Mapping[int, int], stride: int = 1
) -> ReprojectedPoints:
    """Positions of points in an image of the same camera at other instants."""
    camera = bands[0].state.camera
    ways = _carrier_transforms(bands, carriers)
    shape = points.carriers.shape
    p_camera, image_px = np.zeros((*shape, 3)), np.zeros((*shape, 2))
    band_of_row = np.repeat(np.arange(len(bands)), [band.end - band.first for band in bands])
    for first in range(0, shape[0], _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        carrier, place = points.carriers[rows], points.places[rows]
        row = stride * np.arange(first, first + len(carrier))[:, None] + np.zeros_like(carrier)
        for _ in range(_ITERATIONS if len(bands) > 1 else 1):
            moved = np.einsum("hwij,hwj->hwi", ways[carrier, band_of_row[row]], place)
            image = camera.intrinsics.project(moved)
            # Points outside the lens's field at one instant keep their previous row.
            v = np.where(np.isfinite(image[..., 1]), image[..., 1], row)
            row = np.clip(np.floor(v), 0, len(band_of_row) - 1).astype(np.intp)
        p_camera[rows], image_px[rows] = moved, image
    return ReprojectedPoints(p_camera, image_px)


def deform_points(
    points: ScenePoints, gbuffer: BandedGBuffer, then: Scene, assets: interfaces.AssetLibrary
) -> ScenePoints:
    """The points on the bodies' shapes at another instant, where the triangles are the same."""
    places = points.places.copy()
    for band in gbuffer.bands:
        rows = slice(band.first, band.end)
        numbers = gbuffer.hits[rows, :, 0]
        for body in np.unique(numbers[points.carriers[rows] > 0]):
            now, other = band.state.scene.bodies[body], then.bodies[body]
            if now.asset == other.asset:
                continue
            one, two = assets.mesh(now.asset), assets.mesh(other.asset)
            if np.array_equal(one.faces, two.faces):
                own = numbers == body
                corners = one.faces[gbuffer.hits[rows, :, 1][own]]
                steps = (two.vertices_m.astype(np.float64) - one.vertices_m)[corners] * now.scale
                places[rows][own, :3] += _interpolate(steps, gbuffer.weights[rows][own])
    return replace(points, places=places)


def _seen_points(gbuffer: BandedGBuffer) -> Array:
    """Visible points in the camera frame; directions for the background, NaN if not shown."""
    camera, stride = gbuffer.intrinsics, gbuffer.stride
    depth_m = np.where(gbuffer.hits[..., 0] >= 0, gbuffer.z_m.astype(np.float64), 1.0)
    if not camera.straight:
        return np.asarray(camera.pixel_rays()[::stride, ::stride] * depth_m[..., None])
    u = np.arange(0, camera.width_px, stride) + 0.5
    v = np.arange(0, camera.height_px, stride) + 0.5
    x = (u[None, :] - camera.cx_px) / camera.fx_px * depth_m
    y = (v[:, None] - camera.cy_px) / camera.fy_px * depth_m
    return np.stack([x, y, depth_m], axis=-1)


def _carrier_transforms(bands: Sequence[RowBand], carriers: Mapping[int, int]) -> Array:
    """Carrier frame to camera frame, by carrier and band: [carriers + 1, bands, 3, 4]."""
    ways = np.zeros((len(carriers) + 1, len(bands), 3, 4))
    for k, band in enumerate(bands):
        T_camera_world = band.state.camera.T_world_camera.inverse()
        ways[0, k] = T_camera_world.matrix()[:3]
        for body, number in carriers.items():
            pose = T_camera_world @ band.state.scene.bodies[body].T_world_body
            ways[number, k] = pose.matrix()[:3]
    return ways


def _interpolate(corners: Array, weights: asset_types.Float32) -> Array:
    """Interpolation over triangle corners [n, 3, 3] by stored barycentric weights [n, 2]."""
    u = np.where(weights[:, 0] > 1.5, weights[:, 0] - 2.0, weights[:, 0]).astype(np.float64)
    v = weights[:, 1].astype(np.float64)
    shares = np.stack([1.0 - u - v, u, v], axis=-1)
    return np.asarray(np.einsum("nk,nki->ni", shares, corners, optimize=False))


BAND_PX = 0.25
"""Largest motion of visible points within a band of rows."""
BLUR_PX = 0.3
"""Largest motion within a slice of an exposure, if the camera's number of samples allows."""
_SPARSE_PX = 4


@dataclass(frozen=True, eq=False, slots=True)
class ShutterSampling:
    """Sampling in time that an image requires.

    Attributes:
        speeds_px_s: Speed of the fastest point in or near each row, shape [height].
        samples: Slices per exposure.
        blurred: Rows with visible motion during their exposure, shape [height].
    """

    speeds_px_s: Array
    samples: int
    blurred: NDArray[np.bool_]


def plan_sampling(rendered: CameraView) -> ShutterSampling:
    """Plan the sampling of an image, given at the middle of the time its shutter is open."""
    middle, gbuffer = rendered.state, copy_gbuffer(rendered, _SPARSE_PX)
    shutter = middle.camera.shutter
    ends = [_global_shutter_band(middle.later(side * shutter.open_s)) for side in (-0.5, 0.5)]
    carriers = find_carriers(middle.scene)
    points = gather_points(gbuffer, carriers)
    before, after = (reproject(points, [end], carriers, _SPARSE_PX).image_px for end in ends)
    way = after - before
    length = np.where(np.isfinite(way).all(axis=-1), np.sqrt((way * way).sum(axis=-1)), 0.0)
    vertical = np.where(length > 0.0, np.abs(way[..., 1]), 0.0)
    height = middle.camera.intrinsics.height_px
    speeds = _dilate_rows(length.max(axis=1) / shutter.open_s, vertical.max(axis=1), height)
    wanted = math.ceil(float(speeds.max()) * shutter.exposure_s / BLUR_PX)
    blurred = speeds * shutter.exposure_s > BLUR_PX
    return ShutterSampling(speeds, min(max(wanted, 1), shutter.samples), blurred)


def split_bands(
    rendered: CameraView, sampling: ShutterSampling | None = None
) -> tuple[RowBand, ...]:
    """Bands of rows, each at its instant, within which nothing moves farther than ``BAND_PX``.

    ``rendered`` is the image at the middle of its exposure; without ``sampling``, plan it.
    """
    middle = rendered.state
    shutter = middle.camera.shutter
    if not shutter.rolls or not is_moving(middle, shutter.open_s):
        return (full_band(middle),)
    sampling = sampling or plan_sampling(rendered)
    per_row_s = abs(shutter.readout_s) / len(sampling.speeds_px_s)
    return make_bands(middle, band_starts(sampling.speeds_px_s * per_row_s))


def make_bands(middle: CameraState, starts: Sequence[int]) -> tuple[RowBand, ...]:
    """Bands that begin at the given rows, each at the instant of its middle."""
    height = middle.camera.intrinsics.height_px
    delay_s = middle.camera.shutter.delay_s
    return tuple(
        RowBand(first, end, middle.later(delay_s(0.5 * (first + end), height)))
        for first, end in zip(starts, [*starts[1:], height], strict=True)
    )


def band_starts(motion_px: Array) -> list[int]:
    """First rows of bands, each as high as the motion from row to row [height] allows."""
    travelled = np.concatenate([[0.0], np.cumsum(motion_px)])[:-1]
    begins: NDArray[np.bool_] = np.diff(np.floor(travelled / BAND_PX), prepend=-1.0) > 0.0
    return [int(row) for row in np.flatnonzero(begins)]


def _dilate_rows(speeds: Array, travels_px: Array, height: int) -> Array:
    """Highest speed of anything that may reach each row while the shutter is open, [height].

    Given speeds in every few rows, and the vertical motion of the same points in that time.
    """
    highest = np.zeros(height)
    reaches = np.ceil(0.5 * np.minimum(travels_px, 2.0 * height)).astype(int) + 2 * _SPARSE_PX
    for k, (speed, reach) in enumerate(zip(speeds, reaches, strict=True)):
        rows = slice(max(k * _SPARSE_PX - reach, 0), (k + 1) * _SPARSE_PX + reach)
        highest[rows] = np.maximum(highest[rows], speed)
    return highest


def _global_shutter_band(state: CameraState) -> RowBand:
    """The whole image with all rows exposed at one instant."""
    camera = replace(state.camera, shutter=INSTANT)
    return full_band(replace(state, camera=camera))
