"""Path-traced radiance images: importance sampling of environments, and denoising.

The denoiser is Intel's Open Image Denoise (package ``pyoidn``).
"""

from dataclasses import dataclass

import cv2
import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core import bounded_cache, colorimetry, distribution, errors, se3, streams
from gen_data.core.asset_types import Float32
from gen_data.core.scene import Camera, Scene
from gen_data.renderers.warp.atmosphere.weather import fill_fog, ground_record
from gen_data.renderers.warp.device import launch
from gen_data.renderers.warp.pathtraced.kernels import emitters, integrator
from gen_data.renderers.warp.realtime.realtime_shading import darken_outside
from gen_data.renderers.warp.scene import brdf_albedo_lut, device_cache
from gen_data.renderers.warp.scene.environment_maps import irradiance_coefficients
from gen_data.renderers.warp.scene.kernels import records
from gen_data.renderers.warp.scene.scene_packing import PackedWorld, lamp_records
from gen_data.renderers.warp.settings import RenderSettings
from gen_data.renderers.warp.visibility.frame_context import CameraView


def require_denoiser() -> None:
    """Check that the denoiser is installed before anything is rendered.

    Raises:
        ConfigError: it is not installed.
    """
    try:
        import pyoidn  # noqa: F401
    except ImportError as error:
        raise errors.ConfigError(
            f"render.denoise needs the package 'pyoidn', which cannot be loaded ({error}). "
            f"Install it with: {distribution.install_command('denoise')}, or switch it off."
        ) from error


def denoise(light: Float32, albedo: Float32, normal: Float32) -> Float32:
    """Denoise an image, linear RGB [h, w, 3], by albedo [0, 1] and normals [-1, 1] of its surfaces.

    Single-threaded like the whole renderer: processes use the cores. The bytes are reproducible on
    processors of one kind; others round differently.

    Raises:
        ConfigError: the denoiser reports an error.
    """
    import pyoidn

    # Normalise to a mean of 1, independent of the unit of light.
    scale = np.float32(1.0 / max(float(light.mean()), 1e-12))
    color, result = np.ascontiguousarray(light * scale), np.zeros_like(light)
    with pyoidn.Device(pyoidn.OIDN_DEVICE_TYPE_CPU) as device:
        device.set_int("numThreads", 1)
        device.commit()
        with pyoidn.Filter(device, pyoidn.OIDN_FILTER_TYPE_RT) as chosen:
            for name, image in (
                (pyoidn.OIDN_IMAGE_COLOR, color),
                (pyoidn.OIDN_IMAGE_ALBEDO, np.ascontiguousarray(albedo)),
                (pyoidn.OIDN_IMAGE_NORMAL, np.ascontiguousarray(normal)),
                (pyoidn.OIDN_IMAGE_OUTPUT, result),
            ):
                chosen.set_image(name, image, pyoidn.OIDN_FORMAT_FLOAT3)
            chosen.set_bool("hdr", True)
            chosen.commit()
            chosen.execute()
        fault = device.get_error()
    if fault is not None:
        raise errors.ConfigError(f"render.denoise: Open Image Denoise reports: {fault}")
    return np.asarray(result * np.float32(1.0 / scale))


# Launches are short: a device that also drives a screen stays responsive.
_SAMPLES_AT_ONCE = 32
_GUIDE_SAMPLES = 16
_TABLE_BYTES = 16 << 20
_IRRADIANCE_SIZE = (64, 32)


@dataclass(frozen=True, eq=False, slots=True)
class _SkyLight:
    """An environment for the path tracer: its table, and its irradiance as of EnvironmentRecord."""

    table: emitters.SkyTable
    irradiance: wp.array
    nbytes: int


class PathTracer:
    """Renders radiance by path tracing; caches tables of environments.

    Args:
        cache: Assets on the device.
        settings: Settings of the renderer.
    """

    def __init__(self, cache: device_cache.DeviceCache, settings: RenderSettings) -> None:
        self._cache = cache
        self._settings = settings
        if settings.denoise:
            require_denoiser()
        self._lobes = wp.array(brdf_albedo_lut.smith_albedo(), dtype=wp.vec2, device=cache.device)
        self._skies: bounded_cache.ByteCache[_SkyLight] = bounded_cache.ByteCache(_TABLE_BYTES)

    def light(self, frame: CameraView) -> wp.array:
        """As ``radiance``, denoised and through fog, at the depths of the pixel centres."""
        state = frame.state
        radiance = self.radiance(state.scene, state.camera, frame.world, frame.view)
        if self._settings.denoise:
            self._denoise(frame, radiance)
        fill_fog(frame, radiance)
        darken_outside(frame.view, radiance)
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

        The world receives all lights and the path tracer's tables, in place. The camera's name and
        the seed key the noise. ``lights``: 1 light sampling, 2 BSDF sampling, 3 both.
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
            launch(integrator.trace_paths, n, inputs, [radiance], device=self._cache.device)
        share = 1.0 / self._settings.samples
        launch(integrator.scale_light, n, [share], [radiance], device=self._cache.device)
        return radiance

    def _denoise(self, frame: CameraView, radiance: wp.array) -> None:
        from gen_data.renderers.warp.pathtraced.kernels.denoise_aovs import trace_guides

        n, shape = frame.pixels, (frame.view.height, frame.view.width, 3)
        albedo, normal = (wp.zeros(n, dtype=wp.vec3, device=self._cache.device) for _ in range(2))
        inputs = [frame.view, frame.world.record, _GUIDE_SAMPLES]
        frame.launch(trace_guides, n, inputs, [albedo, normal])
        clean = denoise(*(image.numpy().reshape(shape) for image in (radiance, albedo, normal)))
        radiance.assign(clean.reshape(-1, 3))

    def _budget(
        self, scene: Scene, camera: Camera, world: PackedWorld, seed: int, lights: int
    ) -> integrator.Budget:
        rng = streams.Streams(seed=seed, scene=0).rng(f"paths {camera.name} {scene.time_s!r}")
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
            table = emitters.SkyTable()
            table.part = part
            table.rows = wp.array(rows, dtype=float, device=device)
            table.columns = wp.array(columns, dtype=float, device=device)
            small = cv2.resize(image, _IRRADIANCE_SIZE, interpolation=cv2.INTER_AREA)
            irradiance = wp.array(irradiance_coefficients(small), dtype=wp.vec3, device=device)
            return _SkyLight(table, irradiance, rows.nbytes + columns.nbytes)

        return self._skies.get(f"{environment_id} {whole}", make)


_HEIGHT_MAX = 512


def sky_shares(image: Float32, *, whole: bool) -> tuple[float, Float32, Float32]:
    """Cumulative distribution of light over an equirectangular image, for bilinear lookup.

    The image is [h, 2h, 3]. If not ``whole``, only the excess over the mean is sampled: BSDF
    sampling finds the rest as well. Source: Karlik et al., "MIS compensation", SIGGRAPH Asia 2019,
    section 5.

    Returns:
        Share of the light that is sampled; its cumulative distribution over rows, [rows + 1]; and
        over the columns of each row, [rows, columns + 1]. Images of more than 512 rows are reduced
        to that. If ``whole``, the density is positive wherever there is light.
    """
    light = _mean_of_texels(np.maximum(colorimetry.luminance(image.astype(np.float64)), 0.0))
    if len(light) > _HEIGHT_MAX:
        size = (2 * _HEIGHT_MAX, _HEIGHT_MAX)
        light = np.asarray(cv2.resize(light, size, interpolation=cv2.INTER_AREA), np.float64)
    edges = np.cos(np.pi * np.arange(len(light) + 1) / len(light))
    areas = (edges[:-1] - edges[1:])[:, None]
    taken = light * areas
    if not whole:
        mean = float(taken.sum()) / (float(areas.sum()) * light.shape[1])
        taken = np.maximum(light - mean, 0.0) * areas
    part = float(taken.sum()) / max(float((light * areas).sum()), 1e-300)
    # An even sky leaves rounding errors only.
    part = part if part > 1e-6 else 0.0
    return part, _cumulate(taken.sum(axis=1)), _cumulate(taken)


def _mean_of_texels(values: se3.Array) -> se3.Array:
    """Means of the bilinear interpolation over each texel; columns wrap around."""
    beside = np.roll(values, 1, axis=1) + np.roll(values, -1, axis=1)
    values = 0.75 * values + 0.125 * beside
    padded = np.pad(values, ((1, 1), (0, 0)), "edge")
    return np.asarray(0.75 * values + 0.125 * (padded[:-2] + padded[2:]))


def _cumulate(light: se3.Array) -> NDArray[np.float32]:
    """Cumulative shares at each edge along the last axis; uniform where there is no light."""
    total = light.sum(axis=-1, keepdims=True)
    share = np.where(total > 0.0, light / np.maximum(total, 1e-300), 1.0 / light.shape[-1])
    sums = np.cumsum(share, axis=-1)
    first = np.zeros((*light.shape[:-1], 1))
    return np.concatenate([first, np.minimum(sums / sums[..., -1:], 1.0)], axis=-1).astype(
        np.float32
    )
