"""What a user can choose about rendering."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gen_data.generator.config.base_model import Strict


class RenderSettings(Strict):
    """How radiance is computed. Labels do not depend on it; cameras have settings of their own.

    Attributes:
        tier: ``realtime`` has no noise and takes a tenth of a second; ``pathtraced`` follows light
            from surface to surface and converges to what physics says.
        samples: Paths per pixel (path-traced tier); their mean over the pixel's square.
        max_bounces: How often a path is scattered at most (path-traced tier).
        denoise: Whether the noise of few samples is taken out by Open Image Denoise (path-traced
            tier; package extra ``denoise``). Bytes are then those of one kind of processor.
        antialias: Samples per pixel on edges; 1 switches anti-aliasing off.
        shadows: ``soft`` follows the size of every light, ``hard`` takes lights for points.
        ambient_occlusion_radius_m: How far away a surface still darkens its neighbourhood; 0
            switches ambient occlusion off.
        environment_shadow: ``auto`` lets the brightest parts of a panorama throw shadows, where
            the scene is open to it and has no sun of its own; ``off`` takes all of it for light
            without shadows.
        max_lamps: Of a scene's lights, as many as give most of the light at what is seen.
        visibility: How the surface at a pixel centre is found: ``raster`` (CPU only), ``rays``,
            or the faster one on the device.
    """

    tier: Literal["realtime", "pathtraced"] = "realtime"
    samples: int = Field(64, ge=1, le=65536)
    max_bounces: int = Field(16, ge=1, le=256)
    denoise: bool = False
    antialias: Literal[1, 2, 4, 8] = 4
    shadows: Literal["soft", "hard"] = "soft"
    ambient_occlusion_radius_m: float = Field(0.25, ge=0.0)
    environment_shadow: Literal["auto", "off"] = "auto"
    max_lamps: int = Field(16, ge=1)
    visibility: Literal["auto", "raster", "rays"] = "auto"
