"""The renderer: Scene and Camera in, Reading out, on NVIDIA Warp."""

from __future__ import annotations

from dataclasses import replace

from generator.core.capture import Beams, Channel, Echoes, Reading
from generator.core.errors import ConfigError
from generator.core.interfaces import AssetLibrary
from generator.core.scene import Camera, Lidar, Scene
from generator.renderers.color import add_falling, radiance_image
from generator.renderers.compiling import compile_kernels
from generator.renderers.device import open_device
from generator.renderers.flow import FLOW, flow_images
from generator.renderers.labels import label_images
from generator.renderers.lidar import scanned
from generator.renderers.moments import Moment, Sight, Studio
from generator.renderers.packing import pack_view, pack_world
from generator.renderers.settings import RenderSettings
from generator.renderers.shown import shown_in
from generator.renderers.shutter import exposed
from generator.renderers.silhouettes import silhouettes
from generator.renderers.stock import AssetStock
from generator.renderers.tiers import smooth_edges, tier_light
from generator.renderers.visibility import see


class WarpRenderer:
    """Renders on the CPU or on a CUDA device with the same kernels.

    A pure function of its arguments: what it keeps between calls are assets and scratch memory.
    One call uses one core; run several processes to use more.

    Args:
        assets: Where meshes, textures and environments come from.
        device: ``cpu``, ``cuda:N``, or ``auto`` for the first CUDA device if there is one.
        settings: How radiance is computed.

    Raises:
        ConfigError: if the device does not exist, or a denoiser is asked for and not there.
    """

    def __init__(
        self, assets: AssetLibrary, device: str = "auto", settings: RenderSettings | None = None
    ) -> None:
        self._device = open_device(device)
        self._settings = settings or RenderSettings()
        if self._settings.visibility == "raster" and not self._device.is_cpu:
            raise ConfigError(
                f"render.visibility: 'raster' works on the CPU only, not on '{self._device}';"
                " choose 'auto' or 'rays'."
            )
        compile_kernels(self._device.alias)
        self._stock = AssetStock(assets, self._device)
        self._studio = Studio(self._stock, self._settings)
        if self._settings.tier == "pathtraced":
            # Its kernels take long to compile and are of no use to the other tier.
            from generator.renderers.pathtracer import PathTracer

            tracer = PathTracer(self._stock, self._settings)
            self._studio = replace(self._studio, paths=tracer)

    def render(self, scene: Scene, camera: Camera, channels: frozenset[Channel]) -> Reading:
        """Every asked channel of one camera."""
        reading = exposed(scene, camera, channels, self._studio)
        return reading or self._at_once(scene, camera, channels)

    def _at_once(self, scene: Scene, camera: Camera, channels: frozenset[Channel]) -> Reading:
        """The image of one instant."""
        world = pack_world(scene, camera, self._stock)
        view = pack_view(camera, self._stock)
        seen = see(world, view, self._stock, self._settings.visibility)
        if Channel.AMODAL in channels:
            channels = channels | {Channel.INSTANCE}
        images = label_images(scene, world, view, seen, channels)
        if Channel.RADIANCE in channels:
            radiance = tier_light(scene, camera, world, view, seen, self._studio)
            smooth_edges(world, view, seen, radiance, self._studio)
            add_falling(world, camera, view, seen.z_m, radiance, self._stock)
            images[Channel.RADIANCE] = radiance_image(radiance, view)
        outlines = {}
        if Channel.AMODAL in channels:
            ids = images[Channel.INSTANCE]
            outlines = silhouettes(scene, camera, world, view, self._stock, seen, ids)
        if channels & FLOW:
            near = Sight(Moment.of(scene, camera), world, view, seen)
            images |= flow_images(near, shown_in(near), channels, self._studio)
        return Reading(camera.name, camera, images, outlines, scene.time_s)

    def scan(self, scene: Scene, lidar: Lidar, beams: Beams) -> Echoes:
        """What the rays of a laser scanner's beams hit first, and how well it reflects."""
        return scanned(scene, lidar, beams, self._stock)
