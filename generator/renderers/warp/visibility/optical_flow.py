"""Optical flow and scene flow: positions of visible points one step later or earlier.

Only occlusion requires an image of that instant.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, intrinsics
from gen_data.core.capture import Channel
from gen_data.renderers.warp.visibility import frame_context, plates, reprojection

FORWARD = frozenset({Channel.FLOW_FORWARD, Channel.FLOW_OCCLUDED_FORWARD, Channel.SCENE_FLOW})
BACKWARD = frozenset({Channel.FLOW_BACKWARD, Channel.FLOW_OCCLUDED_BACKWARD})
FLOW = FORWARD | BACKWARD

_NEARER = 2e-3
"""Relative depth tolerance: a surface hides a point only if it is nearer by more than this."""


def flow_images(
    reference: frame_context.CameraView,
    gbuffer: reprojection.BandedGBuffer,
    channels: frozenset[Channel],
) -> dict[Channel, NDArray[Any]]:
    """All requested flow channels, as documented at Channel.

    ``reference`` is the world at the image's instant; each row of the G-buffer is at its own.
    """
    images: dict[Channel, NDArray[Any]] = {}
    if not channels & FLOW:
        return images
    middle = reference.state
    step_s = middle.scene.step_s
    carriers = reprojection.find_carriers(middle.scene)
    points = reprojection.gather_points(gbuffer, carriers)
    if channels & FORWARD:
        images |= _flow_channels(
            points, gbuffer, middle.later(step_s), channels & FORWARD, reference
        )
    if channels & BACKWARD and middle.scene.time_s < step_s - 1e-9:
        images |= _undefined_flow(points.carriers.shape, channels)
    elif channels & BACKWARD:
        images |= _flow_channels(
            points, gbuffer, middle.later(-step_s), channels & BACKWARD, reference
        )
    if reference.context.backdrop is not None:
        plates.hide_flow(reference.context.backdrop, images)
    return images


def _flow_channels(
    points: reprojection.ScenePoints,
    gbuffer: reprojection.BandedGBuffer,
    then: frame_context.CameraState,
    channels: frozenset[Channel],
    reference: frame_context.CameraView,
) -> dict[Channel, NDArray[Any]]:
    images: dict[Channel, NDArray[Any]] = {}
    carriers = reprojection.find_carriers(then.scene)
    bands: Sequence[frame_context.RowBand] = (reprojection.full_band(then),)
    if then.camera.shutter.rolls:
        reference = frame_context.render_view(then, reference.context, None, reference)
        bands = reprojection.split_bands(reference)
    points = reprojection.deform_points(points, gbuffer, then.scene, reference.cache.assets)
    found = reprojection.reproject(points, bands, carriers)
    for channel in sorted(channels, key=lambda c: c.value):
        if channel in (Channel.FLOW_FORWARD, Channel.FLOW_BACKWARD):
            images[channel] = _flow(found)
        elif channel is Channel.SCENE_FLOW:
            images[channel] = _scene_flow(points, found)
        else:
            seen = frozenset({Channel.RANGE, Channel.NORMALS})
            # Bands four times as high allow one pixel of motion: as accurate as the occlusion test.
            starts = [band.first for band in bands[::4]]
            other = reprojection.render_bands(
                reprojection.make_bands(then, starts), seen, reference
            ).images
            if reference.context.backdrop is not None:
                # The foreground is nearer than everything.
                other[Channel.RANGE][reference.context.backdrop.hidden] = 0.0
            images[channel] = find_occluded(points, found, other, gbuffer.intrinsics)
    return images


def _flow(found: reprojection.ReprojectedPoints) -> asset_types.Float32:
    height, width = found.image_px.shape[:2]
    centres = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), axis=-1)
    return np.asarray((found.image_px - centres).astype(np.float32))


def _scene_flow(
    points: reprojection.ScenePoints, found: reprojection.ReprojectedPoints
) -> asset_types.Float32:
    there = (points.places[..., 3] > 0.0)[..., None]
    return np.asarray(np.where(there, found.p_camera - points.p_camera, np.nan).astype(np.float32))


def find_occluded(
    points: reprojection.ScenePoints,
    found: reprojection.ReprojectedPoints,
    then: Mapping[Channel, NDArray[Any]],
    camera: intrinsics.Intrinsics,
) -> NDArray[np.uint8]:
    """Occlusion of points in another image, uint8 [h, w]: 1 if hidden or outside it.

    A point is visible if the pixel that it lies in shows no nearer surface; surfaces are
    extrapolated from the centre of the pixel along their tangent plane. ``found`` are the points,
    ``then`` range and normals of the image at the other instant.
    """
    u, v = found.image_px[..., 0], found.image_px[..., 1]
    inside = (u >= 0) & (u < camera.width_px) & (v >= 0) & (v < camera.height_px)
    column, row = (np.where(inside, x, 0.0).astype(np.intp) for x in (u, v))
    distance = np.sqrt((found.p_camera * found.p_camera).sum(axis=-1))
    towards = found.p_camera / np.where(distance > 0.0, distance, 1.0)[..., None]
    limit = np.where(points.places[..., 3] > 0.0, distance * (1.0 - _NEARER), np.inf)
    normal = then[Channel.NORMALS][row, column]
    steep = _dot(normal, camera.pixel_rays()[row, column])
    tilt = _dot(normal, towards)
    # Tangent planes seen edge-on cannot be extrapolated: use the depth itself.
    usable = (tilt < -0.02) & (steep < -0.02)
    factor = np.clip(np.where(usable, steep / np.where(usable, tilt, 1.0), 1.0), 0.8, 1.25)
    seen = then[Channel.RANGE][row, column] * factor >= limit
    return np.asarray(~(seen & inside), np.uint8)


def _undefined_flow(
    shape: tuple[int, ...], channels: frozenset[Channel]
) -> dict[Channel, NDArray[Any]]:
    values: dict[Channel, NDArray[Any]] = {
        Channel.FLOW_BACKWARD: np.full((*shape, 2), np.nan, np.float32),
        Channel.FLOW_OCCLUDED_BACKWARD: np.ones(shape, np.uint8),
    }
    return {channel: image for channel, image in values.items() if channel in channels}


def _dot(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])
