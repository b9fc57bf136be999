"""The objects that mirrors show at each pixel, and where they are."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core.capture import MIRRORED, Channel
from gen_data.renderers.warp.readback import Readback
from gen_data.renderers.warp.scene import material_packing
from gen_data.renderers.warp.visibility import layers, plates
from gen_data.renderers.warp.visibility.frame_context import CameraView
from gen_data.renderers.warp.visibility.kernels import surface_layers


def trace_mirrors(
    frame: CameraView, channels: frozenset[Channel], first: NDArray[np.uint16]
) -> layers.SparseLabels:
    """Labels of the pixels that show a mirror; none if no such channel is requested.

    ``first`` is the material of the first surface at every pixel, flat.
    """
    wanted = channels & MIRRORED.keys()
    if not wanted:
        return layers.SparseLabels()
    shows = (first == material_packing.SEE_THROUGH) | (first == material_packing.MIRROR)
    pixels = np.flatnonzero(shows)
    if not len(pixels):
        return layers.SparseLabels()
    found = Readback.allocate(len(pixels), (int, int, wp.vec3), frame.cache.device)
    inputs = [*layers.ray_inputs(frame, pixels), material_packing.MIRROR]
    frame.launch(surface_layers.trace_mirrors, len(pixels), inputs, found.parts)
    mirrors, bodies, places_m = found.numpy()
    there = bodies >= 0
    if frame.context.backdrop is not None:
        there &= ~plates.is_hidden(frame, frame.context.backdrop, pixels, mirrors[:, None])[:, 0]
    instances = layers.instances_of(frame)[bodies[there]]
    values = {Channel.SEEN_IN_MIRROR: instances, Channel.MIRRORED_POSITION: places_m[there]}
    return layers.SparseLabels(pixels[there], {channel: values[channel] for channel in wanted})


def mirror_images(
    channels: frozenset[Channel], parts: Sequence[layers.SparseLabels], height: int, width: int
) -> dict[Channel, NDArray[Any]]:
    """Requested images of reflections in mirrors; ``parts`` are labels of the image's pixels."""
    images = {}
    for channel in channels & MIRRORED.keys():
        nothing = np.asarray(MIRRORED[channel])
        image = np.tile(nothing, (height * width, *[1] * nothing.ndim))
        for part in parts:
            if channel in part.values:
                image[part.pixels] = part.values[channel]
        images[channel] = image.reshape(height, width, *nothing.shape)
    return images
