"""Images of the realtime tier for tests."""

from collections.abc import Mapping

import numpy as np

from gen_data.core.capture import Channel
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import Camera, Scene
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.settings import RenderSettings

OPEN = RenderSettings(ambient_occlusion_radius_m=0.0)
"""Nothing near hides the sky."""
SHARP = RenderSettings(ambient_occlusion_radius_m=0.0, antialias=1)


def seen(
    scene: Scene,
    camera: Camera,
    library: AssetLibrary,
    *channels: Channel,
    settings: RenderSettings = OPEN,
) -> Mapping[Channel, np.ndarray]:
    return (
        WarpRenderer(library, "cpu", settings).render(scene, camera, frozenset(channels)).channels
    )


def drawn(
    scene: Scene, camera: Camera, library: AssetLibrary, settings: RenderSettings = OPEN
) -> np.ndarray:
    """Radiance [cd/m^2], [h, w, 3]."""
    return seen(scene, camera, library, Channel.RADIANCE, settings=settings)[Channel.RADIANCE]
