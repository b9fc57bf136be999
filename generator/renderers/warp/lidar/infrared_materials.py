"""Reflectance of materials for lasers near 905 nm.

Visible colour says little about the near infrared, so a material's role on its object takes
precedence, and colour decides for all others.

* **Leaves** reflect about half (Jacquemoud and Baret, "PROSPECT", 1990), bark and wood about 0.4.
* **Asphalt, concrete, brick, stone**: ECOSTRESS spectral library (Meerdink et al. 2019): asphalt
  0.1 to 0.2, concrete 0.3 to 0.4, glass beads of markings aside.
* **Skin** about 0.55 (Cooksey and Allen, "Reflectance measurements of human skin", NIST 2013); dyed
  **textiles** are bright, dark ones too: dyes absorb visible light only.
* **Car paint, rubber** follow their colour: carbon black is black in the infrared as well.
* **Ground, walls and plants** are rough: Oren and Nayar 1994 with slopes of 0.5 rad, which keeps
  distant road visible to scanners.
* **Signs and plates**: coefficients of retro-reflection of ASTM D4956, 250 cd/lx/m^2 for type III
  and 70 for type I. A white Lambertian surface has 1 / pi, so they are 785 and 220 times as bright.
* **Glass**: tinted panes of vehicles transmit about half (Rubin, "Optical properties of soda lime
  silica glasses", 1985); panes of buildings reflect about a third with their silver coatings, and
  have no rooms behind them here.
* **Markings** return some hundred mcd/lx/m^2 in 30 m geometry (EN 1436); a scanner's steeper view
  yields about twice white paint.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.se3 import Array
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.lidar.kernels.lidar_rays import Infrared
from gen_data.generator.renderers.warp.scene.material_packing import BodyMaterials
from gen_data.generator.renderers.warp.scene.struct_dtypes import stack_records, struct_dtype

DIFFUSE = {
    "leaf": 0.50,
    "grass": 0.45,
    "bark": 0.40,
    "skin": 0.55,
    "hair": 0.30,
    "asphalt": 0.17,
    "pavement": 0.32,
    "kerb": 0.35,
    "glass": 0.01,
    "window": 0.02,
    "headlight": 0.10,
    "chrome": 0.05,
    "underbody": 0.08,
}
"""Diffuse reflectance of roles whose visible colour is irrelevant."""

TEXTILES = frozenset({"top", "bottom", "bag"})
RETRO = {"sign": 785.0, "plate": 220.0, "taillight": 40.0, "marking": 1.0}
"""Retro-reflectance of roles, relative to a white Lambertian surface; tail lights reflect."""

ROUGH = frozenset(
    {"asphalt", "pavement", "kerb", "grass", "marking", "leaf", "bark", "facade", "roof", *TEXTILES}
)
SLOPE_RAD = 0.5
"""Spread of the facets of rough surfaces."""

CLEAR = {"glass": 0.5}
"""Transmittance of panes, one way, at normal incidence."""

MIRRORS = {"glass": 0.06, "window": 0.3}
"""Reflectance at normal incidence of surfaces that are flat enough to mirror a beam."""

ALPHA_MIN = 0.03
"""Smallest width of a specular lobe: no glass is flat to a milliradian."""


def infrared_surfaces(per_body: Sequence[BodyMaterials], cache: DeviceCache) -> NDArray[np.void]:
    """Infrared records of the materials of all bodies, in their order; at least one."""

    def records(entry: BodyMaterials) -> NDArray[np.void]:
        return cache.infrared.get(entry.materials, lambda: _pack_infrared(entry.materials, cache))

    return stack_records([records(entry) for entry in per_body], Infrared)


def _pack_infrared(materials: Sequence[Material], cache: DeviceCache) -> NDArray[np.void]:
    values: NDArray[Any] = np.zeros(len(materials), dtype=struct_dtype(Infrared))
    for k, material in enumerate(materials):
        color = np.asarray(material.base_color, dtype=np.float64)
        if material.texture:
            color = color * mean_albedo(cache, material.texture)
        values[k] = infrared_fields(material, color)
    return values


def infrared_fields(material: Material, color: Array) -> tuple[float, ...]:
    """The fields of one material's Infrared record.

    Args:
        material: The material.
        color: Its mean linear RGB, texture included.
    """
    red = float(0.7 * color[0] + 0.2 * color[1] + 0.1 * color[2])
    diffuse = DIFFUSE.get(material.role, red)
    if material.role in TEXTILES:
        diffuse = 0.45 + 0.4 * red
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


def oren_nayar(slope_rad: float) -> tuple[float, float]:
    """Factors of cosine and of squared sine of incidence, for coincident source and viewer.

    Oren and Nayar 1994: ``cos(t) (A + B sin(t) tan(t)) = A cos(t) + B sin(t)^2``; Lambert: (1, 0).
    """
    s2 = slope_rad * slope_rad
    return 1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09)


def mean_albedo(cache: DeviceCache, texture_id: str) -> Array:
    """Mean linear colour of a texture: its coarsest level, a single texel."""
    texels = cache.texture(texture_id).texels.numpy()
    roots = texels[-1:].view(np.uint8)[:3] / 255.0
    return np.asarray(roots * roots, dtype=np.float64)
