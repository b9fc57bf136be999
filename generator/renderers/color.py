"""The RGB image: light, shade, exposure."""

from __future__ import annotations

import numpy as np
import warp as wp
from numpy.typing import NDArray

from generator.core.scene import Camera
from generator.renderers.exposure import automatic_ev100, exposure_of, tone_curve
from generator.renderers.kernels import records, shade, tone
from generator.renderers.occlusion import openness, sampled_lattice, sunflower
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
    radiance = shaded(world, view, seen, stock, settings)
    ev100 = camera.ev100
    if ev100 is None:
        ev100 = automatic_ev100(radiance.numpy().reshape(view.height, view.width, 3))
    exposure = exposure_of(ev100 - settings.exposure_compensation_ev)
    curve = wp.array(tone_curve(settings.tone), dtype=wp.uint8, device=stock.device)
    n = view.width * view.height
    rgb = wp.zeros((n, 3), dtype=wp.uint8, device=stock.device)
    wp.launch(tone.develop, n, [radiance, exposure, curve], [rgb], device=stock.device)
    image: NDArray[np.uint8] = rgb.numpy().reshape(view.height, view.width, 3)
    return image


def shaded(
    world: PackedWorld,
    view: records.View,
    seen: Seen,
    stock: AssetStock,
    settings: RenderSettings,
) -> wp.array:
    """Luminance at all pixel centres [cd/m^2], linear RGB, flat."""
    device, n = stock.device, view.width * view.height
    radiance = stock.scratch("radiance", n, wp.vec3)
    lattice = sampled_lattice(world, view, seen, stock)
    around = openness(world, view, lattice, stock, settings)
    images = shade.Images()
    images.hits, images.z_m = seen.hits, seen.z_m
    images.weights, images.normals = seen.weights, seen.normals
    points = lattice.width * lattice.height
    lights = stock.scratch("lights", points, shade.Light)
    frame = [view, world.record, images]
    inputs = [*frame, lattice.pixel, around.lit, around.open_sky]
    wp.launch(shade.shade_points, points, inputs, [lights, radiance], device=device)
    count = wp.zeros(1, dtype=wp.int32, device=device)
    pixels = stock.scratch("listed pixels", n, wp.int32)
    inputs = [*frame, lattice, lights]
    wp.launch(shade.gather_light, n, inputs, [count, pixels, radiance], device=device)
    listed = int(count.numpy()[0])
    lit = stock.scratch("listed lit", (around.lit.shape[0], n), float)
    open_sky = stock.scratch("listed sky", (1, n), float)
    disc = wp.array(sunflower(4), dtype=wp.vec2, device=device)
    radius_m = settings.ambient_occlusion_radius_m
    inputs = [*frame, lattice, around.lit, around.open_sky, disc, radius_m, pixels]
    wp.launch(shade.look_around, listed, inputs, [lit, open_sky], device=device)
    lights = stock.scratch("listed lights", n, shade.Light)
    inputs = [*frame, pixels, lit, open_sky]
    wp.launch(shade.shade_points, listed, inputs, [lights, radiance], device=device)
    return radiance
