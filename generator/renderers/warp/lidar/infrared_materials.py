"""Reflectance of materials for lasers near 905 nm.

Visible colour is a poor predictor of the near infrared: a material's role on its object takes
precedence, and colour decides for all others. Sources and values are in ``infrared.yaml``.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.config.data_files import load_table
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Array
from gen_data.renderers.warp.lidar.kernels.lidar_rays import Infrared
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.renderers.warp.scene.material_packing import BodyMaterials
from gen_data.renderers.warp.scene.struct_dtypes import stack_records, struct_dtype

_TABLES = load_table(__package__, "infrared", dict[str, float])
DIFFUSE, RETRO = _TABLES["diffuse"], _TABLES["retro"]
CLEAR, MIRRORS = _TABLES["clear"], _TABLES["mirrors"]
FILLED = _TABLES["filled"]
TEXTILES = frozenset({"top", "bottom", "bag", "hat", "canvas"})
ROUGH = frozenset(
    {"asphalt", "pavement", "kerb", "grass", "marking", "leaf", "bark", "facade", "roof", *TEXTILES}
)
SLOPE_RAD = 0.5
"""Spread of the facets of rough surfaces."""
BELOW_PIGMENT = 0.45
"""Reflectance of the coats below colourful paint: aluminium flakes, filler; assumed within 0.15."""
ALPHA_MIN = 0.03
"""Smallest width of a specular lobe: no glass is flat to a milliradian."""


def infrared_surfaces(per_body: Sequence[BodyMaterials], cache: DeviceCache) -> NDArray[np.void]:
    """Infrared records of the materials of all bodies, in their order; at least one."""

    def records(entry: BodyMaterials) -> NDArray[np.void]:
        return cache.infrared.get(entry.materials, lambda: _pack_infrared(entry.materials, cache))

    # Steps of a sequence have bodies at other places with the same materials.
    known, own = cache.infrared_scene, [entry.materials for entry in per_body]
    if known is None or known[0] != own:
        known = own, stack_records([records(entry) for entry in per_body], Infrared)
        cache.infrared_scene = known
    return known[1]


def _pack_infrared(materials: Sequence[Material], cache: DeviceCache) -> NDArray[np.void]:
    values: NDArray[Any] = np.zeros(len(materials), dtype=struct_dtype(Infrared))
    for k, material in enumerate(materials):
        color = np.asarray(material.base_color, dtype=np.float64)
        if material.texture:
            color = color * mean_albedo(cache, material.texture)
        values[k] = (*infrared_fields(material, color), FILLED.get(material.role, 1.0))
    return values


def infrared_fields(material: Material, color: Array) -> tuple[float, ...]:
    """The Infrared record of a material without ``filled``.

    ``color`` is its mean linear RGB, texture included.
    """
    red = float(0.7 * color[0] + 0.2 * color[1] + 0.1 * color[2])
    diffuse = DIFFUSE.get(material.role, red)
    if material.role in TEXTILES:
        diffuse = 0.45 + 0.4 * red
    if material.role == "paint":
        diffuse = max(red, below_pigment(color))
    diffuse *= 1.0 - material.metallic
    # Panes of known roles go by their role, other clear materials by their visible transmittance.
    passed = material.transmission * red * material.opacity + 1.0 - material.opacity
    clear = CLEAR.get(material.role, passed)
    if material.role not in DIFFUSE:
        diffuse *= (1.0 - material.transmission) * material.opacity
    even, rim = oren_nayar(SLOPE_RAD if material.role in ROUGH else 0.0)
    specular = material.metallic * red + (1.0 - material.metallic) * 0.08 * material.specular
    normal = ((material.ior - 1.0) / (material.ior + 1.0)) ** 2
    mirror = MIRRORS.get(material.role, normal if material.transmission > 0.5 else 0.0)
    alpha = max(material.roughness * material.roughness, ALPHA_MIN)
    retro = RETRO.get(material.role, 0.0)
    return (diffuse * even, diffuse * rim, specular, alpha, retro, mirror, clear)


def below_pigment(color: Array) -> float:
    """Infrared reflectance of paint by its chroma; dark colours also contain carbon black."""
    brightest = float(color.max())
    if brightest <= 0.0:
        return 0.0
    chroma = 1.0 - float(color.min()) / brightest
    return BELOW_PIGMENT * chroma * math.sqrt(brightest)


def oren_nayar(slope_rad: float) -> tuple[float, float]:
    """Factors of cosine and of squared sine of incidence, for coincident source and viewer.

    Oren and Nayar 1994: ``cos(t) (A + B sin(t) tan(t)) = A cos(t) + B sin(t)^2``; Lambert: (1, 0).
    """
    s2 = slope_rad * slope_rad
    return 1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09)


def mean_albedo(cache: DeviceCache, texture_id: str) -> Array:
    """Mean linear colour of a texture: its coarsest level, a single texel."""

    def read() -> NDArray[np.uint32]:
        texel: NDArray[np.uint32] = cache.texture(texture_id).texels[-1:].numpy()
        return np.array(texel)

    roots = cache.coarsest.get(texture_id, read).view(np.uint8)[:3] / 255.0
    return np.asarray(roots * roots, dtype=np.float64)
