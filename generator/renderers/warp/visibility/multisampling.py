"""Samples of pixels on edges, found by the rasteriser."""

import numpy as np
import warp as wp

from gen_data.core.se3 import Array
from gen_data.renderers.warp.native_code import LANES
from gen_data.renderers.warp.visibility.frame_context import CameraView
from gen_data.renderers.warp.visibility.gbuffer import Projected
from gen_data.renderers.warp.visibility.kernels import msaa, rasterizer

_QUAD = 4


def draw_samples(
    frame: CameraView, projected: Projected, pixels: wp.array, positions: Array
) -> wp.array:
    """Visible (body, face) at samples of listed pixels, [pixels, samples]; (-1, -1) for none.

    Args:
        frame: The image.
        projected: Its rasterised vertices.
        pixels: Flat numbers of the pixels.
        positions: Positions of the samples in a pixel, [0, 1), [2, 4 or 8, 2]. Two are drawn twice:
            the rasteriser takes multiples of four.
    """
    cache, view, world = frame.cache, frame.view, frame.world
    numbers = cache.scratch("numbers", frame.pixels, wp.int32)
    floors = cache.scratch("floors", frame.pixels + LANES, float)
    floors.fill_(msaa.UNLISTED)
    inputs = [view, frame.gbuffer.record, pixels]
    frame.launch(msaa.number_pixels, len(pixels), inputs, [numbers, floors])
    repeats = -(-_QUAD // len(positions))
    offsets = np.tile((positions * 256.0 - 128.0).astype(np.int32).T, repeats)
    shape = (max(len(pixels), 1), offsets.shape[1])
    nearness = cache.scratch("sample nearness", shape, float)
    nearness.zero_()
    hits = cache.scratch("sample hits", shape, wp.vec2i)
    hits.fill_(wp.vec2i(-1, -1))
    window = rasterizer.Window()
    window.width, window.height = view.width, view.height
    inputs = [view, window, world.record, projected.in_view, projected.p_camera, projected.xy]
    inputs += [numbers, floors, wp.array(offsets, dtype=wp.int32, device=cache.device)]
    frame.launch(msaa.draw_samples, len(projected.in_view), inputs, [nearness, hits])
    return hits
