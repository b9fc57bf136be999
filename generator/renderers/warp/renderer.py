"""The Warp renderer: from a Scene and a Camera to a SensorReading."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from numpy.typing import NDArray

from gen_data.core.capture import Channel, LidarHits, LidarRays, SensorReading
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetLibrary, FindTones
from gen_data.core.scene import Camera, Lidar, Scene
from gen_data.renderers.warp.device import compile_kernels, open_device
from gen_data.renderers.warp.lidar.lidar_tracing import trace_scan
from gen_data.renderers.warp.realtime import realtime_shading
from gen_data.renderers.warp.scene import device_cache, scene_packing
from gen_data.renderers.warp.settings import RenderSettings
from gen_data.renderers.warp.shutter_integration import expose_shutter
from gen_data.renderers.warp.visibility import amodal, plates, reprojection
from gen_data.renderers.warp.visibility.frame_context import CameraState, CameraView, RenderContext
from gen_data.renderers.warp.visibility.gbuffer import find_visible
from gen_data.renderers.warp.visibility.label_images import label_images
from gen_data.renderers.warp.visibility.optical_flow import FLOW, flow_images

Images = Mapping[Channel, NDArray[Any]]

_KEPT = frozenset({Channel.Z_DEPTH, Channel.RANGE, Channel.INSTANCE, Channel.CATEGORY})
"""Label channels that sensors ask for again."""


class WarpRenderer:
    """Renders on the CPU or on a CUDA device with the same kernels.

    A pure function of its arguments: between calls it keeps only assets, scratch memory and the
    label images of the latest scene. A call uses one core; run several processes to use more.

    Args:
        assets: Source of meshes, textures and environments.
        device: ``cpu``, ``cuda:N``, or ``auto`` for the first CUDA device if there is one.
        settings: How radiance is computed.

    Raises:
        ConfigError: the device does not exist, or the denoiser is requested but not installed.
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
        self._cache = device_cache.DeviceCache(assets, self._device)
        self._labels = _LatestLabels()
        self._context = RenderContext(self._cache, self._settings)
        if self._settings.tier == "pathtraced":
            # Its kernels take long to compile, and the realtime tier does not need them.
            from gen_data.renderers.warp.pathtraced.path_tracer import PathTracer

            tracer = PathTracer(self._cache, self._settings)
            self._context = replace(self._context, paths=tracer)

    def keep_scenes(self, count: int) -> None:
        """Keep packed scenes for a program that renders several in turn; a run has one at a time.

        Args:
            count: The latest ones; each holds some megabytes, and its assets.
        """
        self._cache.keep_scenes(count)

    def prepare_asset(self, asset_id: str) -> None:
        """See ``AssetPreparation``: hierarchies of meshes, levels of textures."""
        self._cache.prepare(asset_id)

    def render(
        self,
        scene: Scene,
        camera: Camera,
        channels: frozenset[Channel],
        find_tones: FindTones | None = None,
    ) -> SensorReading:
        """All requested channels of one camera."""
        known = self._labels.of(scene, camera)
        if channels <= known.keys():
            images = {channel: known[channel] for channel in sorted(channels)}
            return SensorReading(camera.name, camera, images, {}, scene.time_s)
        reading = self._render(scene, camera, channels, find_tones)
        self._labels.keep(scene, camera, reading)
        # Photographs are developed now, which takes as much memory as rendering.
        self._cache.limit_pages()
        return reading

    def _render(
        self, scene: Scene, camera: Camera, channels: frozenset[Channel], tones: FindTones | None
    ) -> SensorReading:
        """As ``render``, in any case."""
        context = replace(self._with_photo(scene, camera, channels), find_tones=tones)
        reading = expose_shutter(scene, camera, channels, context)
        return reading or self._render_instant(scene, camera, channels, context)

    def _with_photo(
        self, scene: Scene, camera: Camera, channels: frozenset[Channel]
    ) -> RenderContext:
        """The context with the photograph behind the scene, if there is one."""
        backdrop = plates.open_backdrop(scene, camera, self._cache.assets)
        if backdrop is None:
            return self._context
        if Channel.RADIANCE in channels:
            bare = realtime_shading.render_bare_ground(CameraState.of(scene, camera), self._context)
            backdrop = replace(backdrop, unshaded=bare)
        return replace(self._context, backdrop=backdrop)

    def _render_instant(
        self, scene: Scene, camera: Camera, channels: frozenset[Channel], context: RenderContext
    ) -> SensorReading:
        world = scene_packing.pack_world(scene, camera, self._cache)
        view = scene_packing.pack_view(camera, self._cache)
        gbuffer = find_visible(world, view, self._cache, self._settings.visibility)
        frame = CameraView(CameraState(scene, camera), world, view, gbuffer, context)
        if Channel.AMODAL in channels:
            channels = channels | {Channel.INSTANCE}
        images = label_images(frame, channels)
        if Channel.RADIANCE in channels:
            shading = realtime_shading.shade_pixels(frame)
            realtime_shading.smooth_edges(shading)
            realtime_shading.add_precipitation(frame, gbuffer.z_m, shading.radiance)
            images[Channel.RADIANCE] = realtime_shading.radiance_image(shading.radiance, view)
        outlines = {}
        if Channel.AMODAL in channels:
            outlines = amodal.render_silhouettes(frame, images[Channel.INSTANCE])
        if channels & FLOW:
            reference = replace(frame, state=CameraState.of(scene, camera))
            images |= flow_images(reference, reprojection.copy_gbuffer(reference), channels)
        return SensorReading(camera.name, camera, images, outlines, scene.time_s)

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        """First hits of a laser scanner's rays, and the reflectance of the surfaces."""
        return trace_scan(scene, lidar, beams, self._cache)


class _LatestLabels:
    """Label images of one scene's cameras, for sensors that look through them again.

    Scene and cameras are recognised by identity: equal ones are rendered again.
    """

    def __init__(self) -> None:
        self._scene: Scene | None = None
        self._known: dict[str, tuple[Camera, Images]] = {}

    def of(self, scene: Scene, camera: Camera) -> Images:
        """Images of the camera by channel; empty if there are none."""
        seen, images = self._known.get(camera.name, (None, {}))
        return images if scene is self._scene and camera is seen else {}

    def keep(self, scene: Scene, camera: Camera, reading: SensorReading) -> None:
        """Keep the label images of a reading, and drop label images of other scenes."""
        if scene is not self._scene:
            self._scene, self._known = scene, {}
        images = {c: image for c, image in reading.channels.items() if c in _KEPT}
        self._known[camera.name] = (camera, images)
