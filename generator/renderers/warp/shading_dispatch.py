"""Light and shade by the tier that settings ask for."""

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
    seen: GBuffer,
    studio: RenderContext,
) -> wp.array:
    """What comes from the pixels through the air [cd/m^2], linear RGB, flat; scratch memory.

    From their centres in the realtime tier, which is anti-aliased by ``smooth_edges``.
    """
    stock, settings = studio.stock, studio.settings
    if studio.paths is not None:
        return studio.paths.light(scene, camera, world, view, seen)
    if settings.environment_shadow == "auto":
        world = extract_sky_lights(world, scene, stock)
    return surface_light(world, view, seen, stock, settings)


def smooth_edges(
    world: PackedWorld, view: View, seen: GBuffer, radiance: wp.array, studio: RenderContext
) -> None:
    """Anti-alias what has not been averaged over pixels, in place."""
    if studio.paths is None:
        mix_edges(world, view, seen, radiance, studio.stock, studio.settings)
