"""Light and shade by the tier that settings ask for."""

from __future__ import annotations

import warp as wp

from generator.core.scene import Camera, Scene
from generator.renderers.color import mix_edges, surface_light
from generator.renderers.kernels.records import View
from generator.renderers.moments import Studio
from generator.renderers.packing import PackedWorld
from generator.renderers.skylight import split_sky
from generator.renderers.visibility import Seen


def tier_light(
    scene: Scene, camera: Camera, world: PackedWorld, view: View, seen: Seen, studio: Studio
) -> wp.array:
    """What comes from the pixels through the air [cd/m^2], linear RGB, flat; scratch memory.

    From their centres in the realtime tier, which is anti-aliased by ``smooth_edges``.
    """
    stock, settings = studio.stock, studio.settings
    if studio.paths is not None:
        return studio.paths.light(scene, camera, world, view, seen)
    if settings.environment_shadow == "auto":
        world = split_sky(world, scene, stock)
    return surface_light(world, view, seen, stock, settings)


def smooth_edges(
    world: PackedWorld, view: View, seen: Seen, radiance: wp.array, studio: Studio
) -> None:
    """Anti-alias what has not been averaged over pixels, in place."""
    if studio.paths is None:
        mix_edges(world, view, seen, radiance, studio.stock, studio.settings)
