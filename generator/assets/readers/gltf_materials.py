"""Materials of glTF 2.0 and of the extensions that this project's materials can express.

Supported are pbrMetallicRoughness, normal, occlusion and emissive textures, alpha modes, and
KHR_materials_emissive_strength, _clearcoat, _transmission, _diffuse_transmission, _volume, _ior,
_specular and _pbrSpecularGlossiness.
An extension's factor is multiplied by the mean of its image, if it has one. Uniform images become a
number. Whatever has no equivalent is named.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gen_data.assets.readers.mesh_source import EVEN, clamp_min, fraction
from gen_data.assets.texture_maps import TextureMaps
from gen_data.core import asset_types, colorimetry

_MIN_COVERAGE = 8
"""Texels of a blended image with less coverage [1/255] are holes."""
_LINEAR = np.array([colorimetry.srgb_decode(level / 255.0) for level in range(256)])
"""Linear values of sRGB in eight bits."""


@dataclass(frozen=True)
class Images:
    """Access to a document's images.

    Attributes:
        name: Returns the name of a texture reference's image.
        pixels: Returns the pixels of an image, uint8 [height, width, 3 or 4].
        remark: Takes a phrase on a part of the material that is not used as it is.
    """

    name: Callable[[Mapping[str, Any]], str]
    pixels: Callable[[str], asset_types.UInt8]
    remark: Callable[[str], None]


def gltf_material(description: Mapping[str, Any], images: Images) -> asset_types.Material:
    """Convert a glTF material.

    Raises:
        ValueError: if a value is out of range; the message names it.
    """
    further = description.get("extensions", {})
    _name_unused(further, images)
    if "KHR_materials_unlit" in further:
        description, further = _as_matte(description), {}
    glossy = further.get("KHR_materials_pbrSpecularGlossiness")
    if glossy is None:
        pbr = description.get("pbrMetallicRoughness", {})
        ior, reflected = _read_reflection(further, images)
    else:
        ior, (pbr, reflected) = 1.5, _read_glossy(glossy, images)
    cover, cutoff, opacity = _read_alpha(description, pbr, images)
    surface = _image_name(pbr, "metallicRoughnessTexture", images)
    roughness, roughness_map = _read_channel(pbr, "roughnessFactor", surface, 1, images)
    metallic, metallic_map = _read_channel(pbr, "metallicFactor", surface, 2, images)
    clear = further.get("KHR_materials_transmission", {})
    transmission = _read_factor(clear, "transmission", 0.0, 0, images)
    if metallic == 0.0 == transmission and _looks_metallic(pbr, reflected, images):
        # A metal: it has the colour of its reflection.
        pbr, metallic = {"baseColorFactor": [*reflected, 1.0]}, 1.0
    *color, _ = (float(c) for c in pbr.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0)))
    passed, transmitted = _read_diffuse_transmission(further, pbr, images)
    # Light that a thin sheet transmits is missing in its reflection.
    red, green, blue = (fraction(c, "baseColorFactor") * (1.0 - passed) for c in color)
    emission, glow = _read_emission(description, further, images)
    coat = further.get("KHR_materials_clearcoat", {})
    thickness = float(further.get("KHR_materials_volume", {}).get("thicknessFactor", 0.0))
    if metallic < 1.0 or metallic_map:
        _name_reflection(reflected, transmission, images)
    tilts = description.get("normalTexture", {})
    occlusion, strength = _read_occlusion(description, images)
    maps = TextureMaps(
        albedo=_image_name(pbr, "baseColorTexture", images),
        alpha=cover,
        normal=_image_name(description, "normalTexture", images),
        roughness=roughness_map,
        metallic=metallic_map,
        occlusion=occlusion,
        emission=glow,
        cutoff=cutoff,
        normal_scale=clamp_min(-1e3, tilts.get("scale", 1.0), "scale of normalTexture"),
        occlusion_strength=strength,
    )
    return asset_types.Material(
        base_color=(red, green, blue),
        roughness=roughness,
        metallic=metallic,
        specular=round(min(sum(reflected) / 3.0 / _REFLECTED_MAX, 1.0), 4),
        texture=maps.name(),
        emission_cd_m2=emission,
        coat=_read_factor(coat, "clearcoat", 0.0, 0, images),
        coat_roughness=_read_factor(coat, "clearcoatRoughness", 0.0, 1, images),
        transmission=transmission,
        ior=ior,
        thin=not thickness > 0.0,
        opacity=opacity,
        diffuse_transmission=transmitted,
    )


_UNUSED = {
    "KHR_materials_anisotropy": "is not used",
    "KHR_materials_dispersion": "is not used",
    "KHR_materials_iridescence": "is not used",
    "KHR_materials_sheen": "is not used",
    "KHR_materials_unlit": "is not used: it is lit like other matte surfaces",
}
"""Extensions of materials that have no equivalent here."""
_REFLECTED_MAX = 0.08
"""Largest reflectance of a dielectric at normal incidence that a material states."""


def _name_unused(further: Mapping[str, Any], images: Images) -> None:
    for key in sorted(further.keys() & _UNUSED):
        images.remark(f"{key} {_UNUSED[key]}")
    if "clearcoatNormalTexture" in further.get("KHR_materials_clearcoat", {}):
        images.remark("clearcoatNormalTexture is not used")
    volume = further.get("KHR_materials_volume", {})
    if "attenuationDistance" in volume and min(volume.get("attenuationColor", (1.0,))) < 1.0:
        images.remark("attenuationColor is not used")


def _as_matte(description: Mapping[str, Any]) -> dict[str, Any]:
    """A material with the properties that an unlit one has: base colour and alpha."""
    pbr = description.get("pbrMetallicRoughness", {})
    kept = {key: pbr[key] for key in ("baseColorFactor", "baseColorTexture") if key in pbr}
    alpha = {key: description[key] for key in ("alphaMode", "alphaCutoff") if key in description}
    return {**alpha, "pbrMetallicRoughness": {**kept, "metallicFactor": 0.0}}


def _read_reflection(further: Mapping[str, Any], images: Images) -> tuple[float, list[float]]:
    """Refractive index, and a dielectric's reflectance at normal incidence, linear RGB.

    Source: KHR_materials_ior, where 0 stands for infinity, and KHR_materials_specular.
    """
    ior, whole = further.get("KHR_materials_ior", {}).get("ior", 1.5), 1.0
    if ior == 0:
        ior = 1.5
    else:
        ior = clamp_min(1.0, ior, "ior")
        whole = ((ior - 1.0) / (ior + 1.0)) ** 2
    specular = further.get("KHR_materials_specular", {})
    strength = fraction(specular.get("specularFactor", 1.0), "specularFactor")
    strength *= _read_mean(specular, "specularTexture", 3, images)
    tint = _read_mean_color(specular, "specularColorTexture", images)
    colors = specular.get("specularColorFactor", (1.0, 1.0, 1.0))
    return ior, [
        min(whole * clamp_min(0.0, c, "specularColorFactor") * t, 1.0) * strength
        for c, t in zip(colors, tint, strict=True)
    ]


def _name_reflection(reflected: Sequence[float], transmission: float, images: Images) -> None:
    """Name properties that ``Material.specular`` lacks; glass reflects by its ``ior``."""
    if max(reflected) - min(reflected) > 0.01 * max(reflected):
        images.remark("the colour of its reflection is not used")
    if transmission == 0.0 and max(reflected) > 1.01 * _REFLECTED_MAX:
        images.remark(f"its reflectance of {max(reflected):.0%} counts as {_REFLECTED_MAX:.0%}")


def _read_glossy(glossy: Mapping[str, Any], images: Images) -> tuple[dict[str, Any], list[float]]:
    """The pbrMetallicRoughness of KHR_materials_pbrSpecularGlossiness, and its reflectance."""
    specular = [fraction(c, "specularFactor") for c in glossy.get("specularFactor", (1.0,) * 3)]
    gloss = fraction(glossy.get("glossinessFactor", 1.0), "glossinessFactor")
    mean = _read_mean_color(glossy, "specularGlossinessTexture", images)
    gloss *= _read_mean(glossy, "specularGlossinessTexture", 3, images)
    described = {
        "baseColorFactor": glossy.get("diffuseFactor", (1.0,) * 4),
        "metallicFactor": 0.0,
        "roughnessFactor": round(1.0 - gloss, 4),
    }
    if "diffuseTexture" in glossy:
        described["baseColorTexture"] = glossy["diffuseTexture"]
    return described, [a * b for a, b in zip(specular, mean, strict=True)]


def _looks_metallic(pbr: Mapping[str, Any], reflected: Sequence[float], images: Images) -> bool:
    """Whether a metal looks more like a surface of this base colour and reflectance.

    Source: Khronos, KHR_materials_pbrSpecularGlossiness, "convert between workflows": the metalness
    solves the equality of brightness; images enter by their means.
    """
    if max(reflected) <= _REFLECTED_MAX:
        return False
    base = _mean_color(_image_name(pbr, "baseColorTexture", images), images)
    colors = pbr.get("baseColorFactor", (1.0,) * 4)[:3]
    whole = [float(a) * b for a, b in zip(colors, base, strict=True)]
    return _solve_metallic(_brightness(whole), _brightness(reflected), 1.0 - max(reflected)) > 0.5


def _brightness(color: Sequence[float]) -> float:
    """Perceived brightness (weights of Rec. 601), as in the source."""
    r, g, b = color
    return math.sqrt(0.299 * r * r + 0.587 * g * g + 0.114 * b * b)


def _solve_metallic(diffuse: float, specular: float, kept: float) -> float:
    """Metalness for brightnesses of both reflections and the share of light not reflected."""
    dielectric = 0.04
    if specular < dielectric:
        return 0.0
    b = diffuse * kept / (1.0 - dielectric) + specular - 2.0 * dielectric
    root = math.sqrt(max(b * b - 4.0 * dielectric * (dielectric - specular), 0.0))
    return min(max((-b + root) / (2.0 * dielectric), 0.0), 1.0)


def _read_channel(
    pbr: Mapping[str, Any], factor: str, image: str, channel: int, images: Images
) -> tuple[float, str]:
    """A factor and the channel of its image; a uniform channel is multiplied into the factor."""
    value = fraction(pbr.get(factor, 1.0), factor)
    if not image:
        return round(value, 4), ""
    pixels = images.pixels(image)[..., channel]
    if float(pixels.std()) < EVEN:
        return round(value * (float(pixels.mean()) / 255.0), 4), ""
    return round(value, 4), f"{image}!{channel}"


def _read_alpha(
    description: Mapping[str, Any], pbr: Mapping[str, Any], images: Images
) -> tuple[str, float, float]:
    """Coverage channel, its cutoff, and opacity.

    A blended image gets its mean coverage outside its holes as opacity; uncovered texels are holes.
    """
    mode = description.get("alphaMode", "OPAQUE")
    if mode not in ("BLEND", "MASK"):
        return "", 0.5, 1.0
    name = _image_name(pbr, "baseColorTexture", images)
    factor = fraction(pbr.get("baseColorFactor", (1.0,) * 4)[3], "baseColorFactor's alpha")
    cover = images.pixels(name) if name else None
    seen = cover is not None and cover.shape[2] == 4
    if mode == "MASK":
        # Beyond 1, nothing is seen.
        cutoff = clamp_min(0.0, description.get("alphaCutoff", 0.5), "alphaCutoff")
        # The threshold applies to image times factor; here the image alone is compared.
        needed = min(cutoff / max(factor, 1e-6), 1.0)
        return (f"{name}!3" if seen else "", needed, 1.0 if factor >= cutoff else 0.0)
    if cover is None or not seen:
        return "", 0.5, round(factor, 4)
    covered = cover[..., 3][cover[..., 3] >= _MIN_COVERAGE]
    mean = float(covered.mean()) / 255.0 if covered.size else 0.0
    if covered.size and float(covered.std()) >= EVEN:
        images.remark("the opacity of its image counts by its mean")
    holes = bool(covered.size < cover[..., 3].size)
    return (f"{name}!3" if holes else "", _MIN_COVERAGE / 255.0, round(factor * mean, 4))


def _read_emission(
    description: Mapping[str, Any], further: Mapping[str, Any], images: Images
) -> tuple[tuple[float, float, float], str]:
    """Luminance [cd/m^2] (nits, as KHR_materials_emissive_strength counts) and its image."""
    strength = further.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    strength = clamp_min(0.0, strength, "emissiveStrength")
    factors = description.get("emissiveFactor", (0.0, 0.0, 0.0))
    red, green, blue = (clamp_min(0.0, c, "emissiveFactor") * strength for c in factors)
    glows = max(red, green, blue) > 0.0
    return (red, green, blue), _image_name(description, "emissiveTexture", images) if glows else ""


def _read_diffuse_transmission(
    further: Mapping[str, Any], pbr: Mapping[str, Any], images: Images
) -> tuple[float, tuple[float, float, float]]:
    """Share of the diffuse light that is transmitted, and the albedo of transmission.

    Materials multiply that albedo by the image of the base colour, glTF by a separate image: the
    albedo is scaled such that its mean is the file's.
    """
    extension = further.get("KHR_materials_diffuse_transmission", {})
    share = _read_factor(extension, "diffuseTransmission", 0.0, 3, images)
    if share == 0.0:
        return 0.0, (0.0, 0.0, 0.0)
    factors = extension.get("diffuseTransmissionColorFactor", (1.0, 1.0, 1.0))
    own = _read_mean_color(extension, "diffuseTransmissionColorTexture", images)
    base = _mean_color(_image_name(pbr, "baseColorTexture", images), images)
    red, green, blue = (
        round(min(share * fraction(c, "diffuseTransmissionColorFactor") * part / whole, 1.0), 4)
        for c, part, whole in zip(factors, own, base, strict=True)
    )
    return share, (red, green, blue)


def _mean_color(name: str, images: Images) -> tuple[float, float, float]:
    """Mean linear colour of an image where it covers, at least 1/255; white for none."""
    if not name:
        return (1.0, 1.0, 1.0)
    pixels = images.pixels(name)
    covered = pixels[..., 3] >= _MIN_COVERAGE if pixels.shape[2] == 4 else np.True_
    colors = pixels[..., :3][covered].reshape(-1, 3)
    if not len(colors):
        return (1.0, 1.0, 1.0)
    counts = (np.bincount(channel, minlength=256) for channel in colors.T)
    red, green, blue = (max(float(c @ _LINEAR) / len(colors), 1.0 / 255.0) for c in counts)
    return (red, green, blue)


def _read_occlusion(description: Mapping[str, Any], images: Images) -> tuple[str, float]:
    """Channel of the occlusion image, if it has an effect, and its strength."""
    name = _image_name(description, "occlusionTexture", images)
    strength = description.get("occlusionTexture", {}).get("strength", 1.0)
    share = fraction(strength, "strength of occlusionTexture")
    if not name or share == 0.0:
        return "", 1.0
    levels = images.pixels(name)[..., 0]
    applies = float(levels.std()) >= EVEN or float(levels.mean()) <= 255.0 - EVEN
    return (f"{name}!0", share) if applies else ("", 1.0)


def _read_factor(
    extension: Mapping[str, Any], key: str, default: float, channel: int, images: Images
) -> float:
    value = fraction(extension.get(f"{key}Factor", default), f"{key}Factor")
    return (
        round(value * _read_mean(extension, f"{key}Texture", channel, images), 4) if value else 0.0
    )


def _read_mean(holder: Mapping[str, Any], key: str, channel: int, images: Images) -> float:
    """Mean of an image's channel in [0, 1]; 1 = none. A channel that varies is named."""
    name = _image_name(holder, key, images)
    if not name or channel >= images.pixels(name).shape[2]:
        return 1.0
    values = images.pixels(name)[..., channel]
    if float(values.std()) >= EVEN:
        images.remark(f"{key} counts by its mean")
    return float(np.mean(values)) / 255.0


def _read_mean_color(
    holder: Mapping[str, Any], key: str, images: Images
) -> tuple[float, float, float]:
    """Mean linear colour of an image; white = none. An image that varies is named."""
    name = _image_name(holder, key, images)
    if name and float(images.pixels(name)[..., :3].std(axis=(0, 1)).max()) >= EVEN:
        images.remark(f"{key} counts by its mean")
    return _mean_color(name, images)


def _image_name(holder: Mapping[str, Any], key: str, images: Images) -> str:
    return images.name(holder[key]) if key in holder else ""
