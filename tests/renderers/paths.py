"""Path-traced radiance for tests: by the renderer, or by one technique and seed at a time."""

import numpy as np

from gen_data.core.capture import Channel
from gen_data.core.scene import Camera, Scene
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.pathtraced.path_tracer import PathTracer
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.renderers.warp.scene.scene_packing import pack_view, pack_world
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.fake_library import FakeLibrary

BOTH, ASKED, MET = 3, 1, 2
"""Techniques: next-event estimation and BSDF sampling, either alone."""


def settings_of(samples: int, max_bounces: int = 16) -> RenderSettings:
    return RenderSettings(tier="pathtraced", samples=samples, max_bounces=max_bounces)


def radiance_of(
    scene: Scene, camera: Camera, library: FakeLibrary, samples: int, max_bounces: int = 16
) -> np.ndarray:
    renderer = WarpRenderer(library, "cpu", settings_of(samples, max_bounces))
    reading = renderer.render(scene, camera, frozenset({Channel.RADIANCE}))
    return reading.channels[Channel.RADIANCE].astype(np.float64)


def replicates_of(
    scene: Scene,
    camera: Camera,
    library: FakeLibrary,
    samples: int,
    count: int,
    lights: int = BOTH,
    max_bounces: int = 16,
) -> np.ndarray:
    """Independent images with different seeds, [count, h, w, 3]: their spread is the true error."""
    cache = DeviceCache(library, open_device("cpu"))
    tracer = PathTracer(cache, settings_of(samples, max_bounces))
    view = pack_view(camera, cache)
    shape = (view.height, view.width, 3)
    images = []
    for seed in range(count):
        world = pack_world(scene, camera, cache)
        traced = tracer.radiance(scene, camera, world, view, seed=seed, lights=lights)
        images.append(traced.numpy().reshape(shape).astype(np.float64))
    return np.stack(images)
