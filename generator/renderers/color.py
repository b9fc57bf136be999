"""The RGB image: light, shade, exposure."""

from __future__ import annotations

import numpy as np
import warp as wp
from numpy.typing import NDArray

from generator.core.scene import Camera
from generator.renderers.exposure import automatic_ev100, exposure_of, tone_curve
from generator.renderers.kernels import records, shade, tone
from generator.renderers.packing import PackedWorld
from generator.renderers.settings import RenderSettings
from generator.renderers.stock import AssetStock
from generator.renderers.visibility import Seen


def color_image(
    camera: Camera,
    world: PackedWorld,
    view: records.View,
    seen: Seen,
    stock: AssetStock,
    settings: RenderSettings,
) -> NDArray[np.uint8]:
    """sRGB, uint8 [h, w, 3]."""
    n = view.width * view.height
    lamps = max(len(world.record.lamps), 1)
    lit = stock.scratch("lit", (lamps, n), float)
    lit.fill_(1.0)
    open_sky = stock.scratch("open_sky", n, float)
    open_sky.fill_(1.0)
    radiance = stock.scratch("radiance", n, wp.vec3)
    inputs = [view, world.record, seen.hits, seen.z_m, seen.weights, seen.normals, lit, open_sky]
    wp.launch(shade.shade_pixels, n, inputs, [radiance], device=stock.device)
    ev100 = camera.ev100
    if ev100 is None:
        ev100 = automatic_ev100(radiance.numpy().reshape(view.height, view.width, 3))
    exposure = exposure_of(ev100 - settings.exposure_compensation_ev)
    curve = wp.array(tone_curve(settings.tone), dtype=wp.uint8, device=stock.device)
    rgb = wp.zeros((n, 3), dtype=wp.uint8, device=stock.device)
    wp.launch(tone.develop, n, [radiance, exposure, curve], [rgb], device=stock.device)
    image: NDArray[np.uint8] = rgb.numpy().reshape(view.height, view.width, 3)
    return image
