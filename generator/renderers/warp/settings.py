"""The section ``render:`` of configurations."""

from typing import Literal

from pydantic import Field

from gen_data.config.base_model import Strict


class RenderSettings(Strict):
    """Computation of radiance. Labels do not depend on it; cameras have separate settings.

    Attributes:
        tier: ``realtime`` is free of noise and takes a tenth of a second; ``pathtraced`` simulates
            light transport and converges to the physical result.
        samples: Paths per pixel (path-traced tier), averaged over the pixel's square.
        max_bounces: Maximum number of scattering events along a path (path-traced tier).
        denoise: Whether Open Image Denoise removes the noise of few samples (path-traced tier;
            package extra ``denoise``). Bytes then depend on the kind of processor.
        antialias: Samples per pixel on edges; 1 disables anti-aliasing.
        shadows: ``soft`` respects the size of every light, ``hard`` treats lights as points.
        ambient_occlusion_radius_m: Distance up to which surfaces occlude ambient light; 0 disables
            ambient occlusion.
        environment_shadow: ``auto`` lets the brightest parts of a panorama cast shadows if the
            scene is open to it and has no separate sun; ``off`` treats all of it as light without
            shadows.
        max_lamps: Maximum number of a scene's lights; the ones that contribute most to the visible
            surfaces are kept.
        visibility: Method that finds the surface at a pixel centre: ``raster`` (CPU only),
            ``rays``, or the faster one on the device.
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
