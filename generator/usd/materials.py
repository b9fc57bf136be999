"""Materials as UsdPreviewSurface networks ("UsdPreviewSurface Specification", version 2.6)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from generator.core.geometry import Material

UV, BOX_UV = "st", "stBox"
"""Texture coordinates of a mesh, and those in metres that stand for triplanar mapping."""


@dataclass(frozen=True, slots=True)
class TextureFiles:
    """Images of a texture, as the layer at hand refers to them; empty = there is none."""

    albedo: str
    roughness: str = ""
    normal: str = ""


TextureFinder = Callable[[str], TextureFiles]


def define_material(stage: Any, path: str, material: Material, textures: TextureFinder) -> Any:
    """A material prim with its network; returned as ``UsdShade.Material``."""
    from pxr import Sdf, UsdShade

    shade = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    color = Sdf.ValueTypeNames.Color3f
    shader.CreateInput("useSpecularWorkflow", Sdf.ValueTypeNames.Int).Set(0)
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(material.metallic)
    shader.CreateInput("ior", Sdf.ValueTypeNames.Float).Set(_index_of(material.specular))
    if any(material.emission_cd_m2):
        shader.CreateInput("emissiveColor", color).Set(material.emission_cd_m2)
    diffuse = shader.CreateInput("diffuseColor", color)
    roughness = shader.CreateInput("roughness", Sdf.ValueTypeNames.Float)
    if not material.texture:
        diffuse.Set(material.base_color)
        roughness.Set(material.roughness)
    else:
        images = _Images(stage, path, material)
        files = textures(material.texture)
        image = images.add("Albedo", files.albedo, "sRGB", (*material.base_color, 1.0))
        diffuse.ConnectToSource(image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
        if files.normal:
            image = images.add("Normal", files.normal, "raw", (2.0, 2.0, 2.0, 1.0))
            image.CreateInput("bias", Sdf.ValueTypeNames.Float4).Set((-1.0, -1.0, -1.0, 0.0))
            bump = shader.CreateInput("normal", Sdf.ValueTypeNames.Normal3f)
            bump.ConnectToSource(image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
        if files.roughness:
            image = images.add("Roughness", files.roughness, "raw", (material.roughness,) * 4)
            roughness.ConnectToSource(image.CreateOutput("r", Sdf.ValueTypeNames.Float))
        else:
            roughness.Set(material.roughness)
    shade.CreateSurfaceOutput().ConnectToSource(
        shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    )
    return shade


class _Images:
    """Texture nodes of one material, all at the same coordinates."""

    def __init__(self, stage: Any, path: str, material: Material) -> None:
        from pxr import Sdf, UsdShade

        self._stage, self._path = stage, path
        boxed = material.texture_scale_m > 0.0
        reader = UsdShade.Shader.Define(stage, f"{path}/Coordinates")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        name = BOX_UV if boxed else UV
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(name)
        self._uvs = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        if boxed:
            scale = UsdShade.Shader.Define(stage, f"{path}/Repeats")
            scale.CreateIdAttr("UsdTransform2d")
            scale.CreateInput("in", Sdf.ValueTypeNames.Float2).ConnectToSource(self._uvs)
            repeats = 1.0 / material.texture_scale_m
            scale.CreateInput("scale", Sdf.ValueTypeNames.Float2).Set((repeats, repeats))
            self._uvs = scale.CreateOutput("result", Sdf.ValueTypeNames.Float2)

    def add(self, name: str, file: str, space: str, factors: tuple[float, ...]) -> Any:
        """A node that reads one image and multiplies it."""
        from pxr import Sdf, UsdShade

        node = UsdShade.Shader.Define(self._stage, f"{self._path}/{name}")
        node.CreateIdAttr("UsdUVTexture")
        node.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(file)
        node.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set(space)
        node.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(self._uvs)
        node.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(factors)
        for axis in ("wrapS", "wrapT"):
            node.CreateInput(axis, Sdf.ValueTypeNames.Token).Set("repeat")
        return node


def _index_of(specular: float) -> float:
    """Index of refraction whose reflectance at normal incidence is ``0.08 * specular``.

    Source: Fresnel at normal incidence, F0 = ((n - 1) / (n + 1))^2, solved for n.
    """
    root = math.sqrt(0.08 * specular)
    return (1.0 + root) / (1.0 - root)
