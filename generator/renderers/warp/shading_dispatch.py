"""Dispatch of shading to the realtime or the path-traced tier."""

from __future__ import annotations

import warp as wp

from gen_data.generator.core.scene import Camera, Scene
from gen_data.generator.renderers.warp.frame_context import RenderContext
from gen_data.generator.renderers.warp.realtime.realtime_shading import mix_edges, surface_light
from gen_data.generator.renderers.warp.scene.envmap_lights import extract_sky_lights
from gen_data.generator.renderers.warp.scene.kernels.records import View
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld
from gen_data.generator.renderers.warp.visibility.gbuffer import GBuffer


def shade_pixels(
    scene: Scene,
    camera: Camera,
    world: PackedWorld,
    view: View,
    gbuffer: GBuffer,
    context: RenderContext,
) -> wp.array:
    """Radiance of all pixels through the air [cd/m^2], linear RGB, flat; scratch memory.

    The realtime tier shades pixel centres, which ``smooth_edges`` anti-aliases.
    """
    cache, settings = context.cache, context.settings
    if context.paths is not None:
        return context.paths.light(scene, camera, world, view, gbuffer)
    if settings.environment_shadow == "auto":
        world = extract_sky_lights(world, scene, cache)
    return surface_light(world, view, gbuffer, cache, settings)


def smooth_edges(
    world: PackedWorld, view: View, gbuffer: GBuffer, radiance: wp.array, context: RenderContext
) -> None:
    """Anti-alias radiance that is not averaged over pixels yet, in place."""
    if context.paths is None:
        mix_edges(world, view, gbuffer, radiance, context.cache, context.settings)
