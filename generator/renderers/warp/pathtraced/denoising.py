"""Denoising of path-traced images by Intel's Open Image Denoise (package ``pyoidn``)."""

from __future__ import annotations

import numpy as np

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.core.errors import ConfigError


def require_denoiser() -> None:
    """Check that the denoiser is installed before anything is rendered.

    Raises:
        ConfigError: it is not installed.
    """
    try:
        import pyoidn  # noqa: F401
    except ImportError as error:
        raise ConfigError(
            "render.denoise needs the package 'pyoidn', which cannot be loaded"
            f" ({error}). Install it with: pip install 'gen-data[denoise]', or switch it off."
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
        raise ConfigError(f"render.denoise: Open Image Denoise reports: {fault}")
    clean: Float32 = result * np.float32(1.0 / scale)
    return clean
