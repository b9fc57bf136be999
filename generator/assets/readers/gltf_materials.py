"""Materials of glTF 2.0 and of its extensions that this project's materials have words for.

Read are pbrMetallicRoughness, normal, occlusion and emissive textures, alpha modes, and
KHR_materials_emissive_strength, _clearcoat, _transmission, _volume and _ior. Strengths of
extensions that have an image are multiplied by its mean. An image that says the same everywhere
becomes a number.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gen_data.generator.assets.readers.mesh_source import EVEN, clamp_min, fraction
from gen_data.generator.assets.texture_maps import TextureMaps
from gen_data.generator.core.asset_types import Material, UInt8

_GONE = 8
"""What is covered less than this [1/255] in a blended image is a hole."""


@dataclass(frozen=True)
class Images:
    """How a document's textures are found.

    Attributes:
        name: Of the image behind a texture reference.
        pixels: Of an image, uint8 [height, width, 3 or 4].
    """

    name: Callable[[Mapping[str, Any]], str]
    pixels: Callable[[str], UInt8]


def gltf_material(description: Mapping[str, Any], images: Images) -> Material:
    """The material that a glTF document describes.

    Raises:
        ValueError: naming a value that is out of its range.
    """
    pbr = description.get("pbrMetallicRoughness", {})
    further = description.get("extensions", {})
    *color, alpha = (float(c) for c in pbr.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0)))
    red, green, blue = (fraction(c, "baseColorFactor") for c in color)
    surface = _surface(pbr, images)
    cover, cutoff, opacity = _alpha(description, pbr, alpha, images)
    emission, glow = _emission(description, further, images)
    coat = further.get("KHR_materials_clearcoat", {})
    clear = further.get("KHR_materials_transmission", {})
    thickness = float(further.get("KHR_materials_volume", {}).get("thicknessFactor", 0.0))
    ior = clamp_min(1.0, further.get("KHR_materials_ior", {}).get("ior", 1.5), "ior")
    maps = TextureMaps(
        albedo=_named(pbr, "baseColorTexture", images),
        alpha=cover,
        normal=_named(description, "normalTexture", images),
        roughness=surface.roughness_map,
        metallic=surface.metallic_map,
        occlusion=_occlusion(description, images),
        emission=glow,
        cutoff=cutoff,
    )
    return Material(
        base_color=(red, green, blue),
        roughness=surface.roughness,
        metallic=surface.metallic,
        specular=round(min(((ior - 1.0) / (ior + 1.0)) ** 2 / 0.08, 1.0), 4),
        texture=maps.name(),
        emission_cd_m2=emission,
        coat=_factor(coat, "clearcoat", 0.0, 0, images),
        coat_roughness=_factor(coat, "clearcoatRoughness", 0.0, 1, images),
        transmission=_factor(clear, "transmission", 0.0, 0, images),
        ior=ior,
        thin=not thickness > 0.0,
        opacity=opacity,
    )


@dataclass(frozen=True)
class _Surface:
    roughness: float
    metallic: float
    roughness_map: str = ""
    metallic_map: str = ""


def _surface(pbr: Mapping[str, Any], images: Images) -> _Surface:
    roughness = fraction(pbr.get("roughnessFactor", 1.0), "roughnessFactor")
    metallic = fraction(pbr.get("metallicFactor", 1.0), "metallicFactor")
    name = _named(pbr, "metallicRoughnessTexture", images)
    if not name:
        return _Surface(round(roughness, 4), round(metallic, 4))
    pixels = images.pixels(name)
    maps = ["", ""]
    for k, at in enumerate((1, 2)):
        channel = pixels[..., at]
        if float(channel.std()) < EVEN:
            mean = float(channel.mean()) / 255.0
            roughness, metallic = (
                (roughness * mean, metallic) if k == 0 else (roughness, metallic * mean)
            )
        else:
            maps[k] = f"{name}!{at}"
    return _Surface(round(roughness, 4), round(metallic, 4), maps[0], maps[1])


def _alpha(
    description: Mapping[str, Any], pbr: Mapping[str, Any], factor: float, images: Images
) -> tuple[str, float, float]:
    """Image of coverage, its cutoff, and opacity.

    A blended image is opaque to the mean of what it covers, and has holes where it covers nothing.
    """
    mode = description.get("alphaMode", "OPAQUE")
    name = _named(pbr, "baseColorTexture", images)
    factor = fraction(factor, "baseColorFactor's alpha")
    cutoff = fraction(description.get("alphaCutoff", 0.5), "alphaCutoff")
    cover = images.pixels(name) if name and mode != "OPAQUE" else None
    seen = cover is not None and cover.shape[2] == 4
    if mode == "MASK":
        # Coverage is the product with the factor: a smaller one asks for more of the image.
        needed = min(cutoff / max(factor, 1e-6), 1.0)
        return (f"{name}!3" if seen else "", needed, 1.0)
    if mode != "BLEND":
        return "", 0.5, 1.0
    if cover is None or not seen:
        return "", 0.5, round(factor, 4)
    covered = cover[..., 3][cover[..., 3] >= _GONE]
    mean = float(covered.mean()) / 255.0 if covered.size else 1.0
    holes = bool(covered.size < cover[..., 3].size)
    return (f"{name}!3" if holes else "", _GONE / 255.0, round(factor * mean, 4))


def _emission(
    description: Mapping[str, Any], further: Mapping[str, Any], images: Images
) -> tuple[tuple[float, float, float], str]:
    """Luminance [cd/m^2] (nits, as KHR_materials_emissive_strength counts) and its image."""
    strength = further.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    strength = clamp_min(0.0, strength, "emissiveStrength")
    factors = description.get("emissiveFactor", (0.0, 0.0, 0.0))
    red, green, blue = (clamp_min(0.0, c, "emissiveFactor") * strength for c in factors)
    glows = max(red, green, blue) > 0.0
    return (red, green, blue), _named(description, "emissiveTexture", images) if glows else ""


def _occlusion(description: Mapping[str, Any], images: Images) -> str:
    name = _named(description, "occlusionTexture", images)
    strength = description.get("occlusionTexture", {}).get("strength", 1.0)
    # Weaker than half, it is rather not there.
    if not name or fraction(strength, "occlusion strength") < 0.5:
        return ""
    return f"{name}!0" if float(images.pixels(name)[..., 0].std()) >= EVEN else ""


def _factor(
    extension: Mapping[str, Any], key: str, default: float, channel: int, images: Images
) -> float:
    value = fraction(extension.get(f"{key}Factor", default), f"{key}Factor")
    name = _named(extension, f"{key}Texture", images)
    if name:
        value *= float(np.mean(images.pixels(name)[..., channel])) / 255.0
    return round(value, 4)


def _named(holder: Mapping[str, Any], key: str, images: Images) -> str:
    return images.name(holder[key]) if key in holder else ""
