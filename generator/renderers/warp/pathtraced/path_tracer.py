"""Path-traced radiance images."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import warp as wp

from gen_data.generator.core.bounded_cache import ByteCache
from gen_data.generator.core.scene import Camera, Scene
from gen_data.generator.core.streams import Streams
from gen_data.generator.renderers.warp.atmosphere.weather import fill_fog, ground_record
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.pathtraced.denoising import denoise, require_denoiser
from gen_data.generator.renderers.warp.pathtraced.envmap_importance import sky_shares
from gen_data.generator.renderers.warp.pathtraced.kernels import integrator
from gen_data.generator.renderers.warp.pathtraced.kernels.emitters import SkyTable
from gen_data.generator.renderers.warp.realtime.realtime_shading import (
    darken_outside,
    gbuffer_record,
)
from gen_data.generator.renderers.warp.scene.brdf_albedo_lut import smith_albedo
from gen_data.generator.renderers.warp.scene.environment_maps import irradiance_coefficients
from gen_data.generator.renderers.warp.scene.kernels import records
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld, lamp_records
from gen_data.generator.renderers.warp.settings import RenderSettings
from gen_data.generator.renderers.warp.visibility.gbuffer import GBuffer

# Launches are short, so that a device that also drives a screen stays responsive.
_SAMPLES_AT_ONCE = 32
_GUIDE_SAMPLES = 16
_TABLE_BYTES = 16 << 20
_IRRADIANCE_SIZE = (64, 32)


@dataclass(frozen=True, eq=False, slots=True)
class _SkyLight:
    """An environment for the path tracer: its table, and its irradiance as of EnvironmentRecord."""

    table: SkyTable
    irradiance: wp.array
    nbytes: int


class PathTracer:
    """Renders radiance by path tracing; caches tables of environments.

    Args:
        cache: Assets on the device.
        settings: Settings of the renderer.
    """

    def __init__(self, cache: DeviceCache, settings: RenderSettings) -> None:
        self._cache = cache
        self._settings = settings
        if settings.denoise:
            require_denoiser()
        self._lobes = wp.array(smith_albedo(), dtype=wp.vec2, device=cache.device)
        self._skies: ByteCache[_SkyLight] = ByteCache(_TABLE_BYTES)

    def light(
        self, scene: Scene, camera: Camera, world: PackedWorld, view: records.View, gbuffer: GBuffer
    ) -> wp.array:
        """As ``radiance``, denoised and through fog, at the depths of the pixel centres."""
        radiance = self.radiance(scene, camera, world, view)
        if self._settings.denoise:
            self._denoise(world, view, radiance)
        fill_fog(world, view, gbuffer_record(gbuffer), radiance, self._cache)
        darken_outside(view, radiance)
        return radiance

    def radiance(
        self,
        scene: Scene,
        camera: Camera,
        world: PackedWorld,
        view: records.View,
        *,
        seed: int = 0,
        lights: int = 3,
    ) -> wp.array:
        """Mean radiance of each pixel's square [cd/m^2], linear RGB, flat; scratch memory.

        Args:
            scene: The scene of ``world``.
            camera: Its name keys the noise.
            world: Modified in place: receives all lights and the path tracer's tables.
            view: View of the camera.
            seed: Seed of the noise.
            lights: Techniques: 1 light sampling, 2 BSDF sampling, 3 both.
        """
        sky = self._sky_light(scene.environment.image, whole=lights == 1)
        record = world.record
        record.lobes = self._lobes
        record.lamps = wp.array(
            lamp_records(scene.lights), dtype=records.LightRecord, device=self._cache.device
        )
        record.ground = ground_record(world.weather)
        record.sky.irradiance = sky.irradiance
        n = view.width * view.height
        radiance = self._cache.scratch("radiance", n, wp.vec3)
        radiance.zero_()
        budget = self._budget(scene, camera, world, seed, lights)
        for first in range(0, self._settings.samples, _SAMPLES_AT_ONCE):
            budget.first = first
            budget.samples = min(_SAMPLES_AT_ONCE, self._settings.samples - first)
            inputs = [view, record, sky.table, budget]
            wp.launch(integrator.trace_paths, n, inputs, [radiance], device=self._cache.device)
        share = 1.0 / self._settings.samples
        wp.launch(integrator.scale_light, n, [share], [radiance], device=self._cache.device)
        return radiance

    def _denoise(self, world: PackedWorld, view: records.View, radiance: wp.array) -> None:
        """Denoise in place."""
        from gen_data.generator.renderers.warp.pathtraced.kernels.denoise_aovs import trace_guides

        device, n = self._cache.device, view.width * view.height
        shape = (view.height, view.width, 3)
        albedo, normal = (wp.zeros(n, dtype=wp.vec3, device=device) for _ in range(2))
        inputs = [view, world.record, _GUIDE_SAMPLES]
        wp.launch(trace_guides, n, inputs, [albedo, normal], device=device)
        clean = denoise(*(image.numpy().reshape(shape) for image in (radiance, albedo, normal)))
        radiance.assign(clean.reshape(-1, 3))

    def _budget(
        self, scene: Scene, camera: Camera, world: PackedWorld, seed: int, lights: int
    ) -> integrator.Budget:
        rng = Streams(seed=seed, scene=0).rng(f"paths {camera.name} {scene.time_s!r}")
        surfaces = world.record.surfaces.numpy()
        budget = integrator.Budget()
        budget.whole = self._settings.samples
        budget.sample_bits = (self._settings.samples - 1).bit_length()
        budget.bounces = self._settings.max_bounces
        budget.key = int(rng.integers(1 << 32))
        panes = (surfaces["transmission"] > 0.0) & (surfaces["thin"] != 0)
        panes &= surfaces["roughness"] < float(integrator.CLEAR_ROUGHNESS)
        budget.clear = int((panes | (surfaces["opacity"] < 1.0)).any())
        budget.lights = lights
        return budget

    def _sky_light(self, environment_id: str, *, whole: bool) -> _SkyLight:
        def make() -> _SkyLight:
            device = self._cache.device
            image = self._cache.assets.environment(environment_id)
            part, rows, columns = sky_shares(image, whole=whole)
            table = SkyTable()
            table.part = part
            table.rows = wp.array(rows, dtype=float, device=device)
            table.columns = wp.array(columns, dtype=float, device=device)
            small = cv2.resize(image, _IRRADIANCE_SIZE, interpolation=cv2.INTER_AREA)
            irradiance = wp.array(irradiance_coefficients(small), dtype=wp.vec3, device=device)
            return _SkyLight(table, irradiance, rows.nbytes + columns.nbytes)

        return self._skies.get(f"{environment_id} {whole}", make)
