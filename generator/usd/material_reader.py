"""UsdPreviewSurface networks to materials."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.errors import AssetError
from gen_data.generator.core.se3 import Array, Vec3

_IDENTITY = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True, eq=False)
class BoundMaterial:
    """What a slot looks like.

    Attributes:
        name: Of its material; empty = it has none.
        material: Without its texture.
        texture: Resolved path of its colour image; empty = none.
        roughness_image, metallic_image, occlusion_image, cover_image: Resolved path and channel
            (0 red) of the images that multiply roughness, metalness, ambient light and coverage;
            empty = none.
        normal_image, emission_image: Resolved paths; empty = none.
        veil_image: As these; multiplies what hides the background, without holes.
        cutoff: Coverage from which on there is no hole.
        uv_name: Primvar that holds its texture coordinates.
        uv_matrix: Affine map [2, 3] on them.
    """

    name: str = ""
    material: Material = field(default_factory=Material)
    texture: str = ""
    roughness_image: tuple[str, int] = ("", 0)
    metallic_image: tuple[str, int] = ("", 0)
    occlusion_image: tuple[str, int] = ("", 0)
    cover_image: tuple[str, int] = ("", 0)
    veil_image: tuple[str, int] = ("", 0)
    normal_image: str = ""
    emission_image: str = ""
    cutoff: float = 0.5
    uv_name: str = "st"
    uv_matrix: Array = field(default_factory=lambda: _IDENTITY)

    @property
    def mapped(self) -> bool:
        """Whether any image says how it looks."""
        channels = (
            self.roughness_image,
            self.metallic_image,
            self.occlusion_image,
            self.cover_image,
            self.veil_image,
        )
        whole = (self.texture, self.normal_image, self.emission_image)
        return any(whole) or any(name for name, _ in channels)


PLAIN = BoundMaterial()


def read_look(prim: Any, mesh: Any, place: str) -> BoundMaterial:
    """The look of a mesh or subset by its bound material; else by the mesh's display colour.

    Raises:
        AssetError: if the material is no UsdPreviewSurface, an image is missing, or roughness or
            metalness is no share.
    """
    from pxr import UsdShade

    material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    if not material:
        return replace(PLAIN, material=_display_material(mesh))
    surface = material.ComputeSurfaceSource()[0]
    where = f"{place}: material {material.GetPath()}"
    kind = surface.GetIdAttr().Get() if surface else None
    if kind != "UsdPreviewSurface":
        raise AssetError(
            f"{where}: its surface is {kind or 'none that every renderer knows'}, which is not "
            "read; export it as UsdPreviewSurface"
        )
    return _preview_surface(material.GetPrim().GetName(), surface, where)


def _preview_surface(name: str, surface: Any, where: str) -> BoundMaterial:
    numbers = {}
    images = {}
    for key, default in _NUMBERS.items():
        numbers[key], images[key] = _number(surface, key, default, where)
    ior = numbers["ior"]
    if not 1.0 <= ior < math.inf:
        raise AssetError(f"{where}: ior is {ior:g}, not a number of at least 1; correct it")
    color, image = _color(surface, "diffuseColor", (0.18, 0.18, 0.18), where)
    glow, glow_image = _color(surface, "emissiveColor", (0.0, 0.0, 0.0), where)
    if not all(0.0 <= c < math.inf for c in glow):
        raise AssetError(f"{where}: emissiveColor is {glow}, negative or no number; correct it")
    bump = _source(surface, "normal")[1]
    cut_out = numbers["opacityThreshold"] > 0.0
    # What the threshold does not cut out lets light through, or (mode "presence") is not there.
    opacity = 1.0 if cut_out else numbers["opacity"]
    present = _source(surface, "opacityMode")[0] == "presence"
    material = Material(
        base_color=(_unit(color[0]), _unit(color[1]), _unit(color[2])),
        roughness=round(numbers["roughness"], 4),
        metallic=round(numbers["metallic"], 4),
        specular=round(_unit(((ior - 1.0) / (ior + 1.0)) ** 2 / 0.08), 4),
        emission_cd_m2=glow,
        coat=round(numbers["clearcoat"], 4),
        coat_roughness=round(numbers["clearcoatRoughness"], 4),
        transmission=0.0 if present else round(1.0 - opacity, 4),
        ior=round(ior, 4),
        opacity=round(opacity, 4) if present else 1.0,
    )
    look = BoundMaterial(
        name,
        material,
        texture=_file(image, where) if image is not None else "",
        roughness_image=images["roughness"],
        metallic_image=images["metallic"],
        occlusion_image=images["occlusion"],
        cover_image=images["opacity"] if cut_out else ("", 0),
        veil_image=("", 0) if cut_out else images["opacity"],
        normal_image=_file(bump, where) if _is_image(bump) else "",
        emission_image=_file(glow_image, where) if glow_image is not None else "",
        cutoff=numbers["opacityThreshold"] if cut_out else 0.5,
    )
    first = image if image is not None else _any_image(surface)
    if first is None:
        return look
    uv_name, uv_matrix = _coordinates(first)
    return replace(look, uv_name=uv_name, uv_matrix=uv_matrix)


_NUMBERS = {
    "roughness": 0.5,
    "metallic": 0.0,
    "ior": 1.5,
    "clearcoat": 0.0,
    "clearcoatRoughness": 0.01,
    "opacity": 1.0,
    "opacityThreshold": 0.0,
    "occlusion": 1.0,
}
"""Inputs that are numbers, and what they are where nothing is said."""
_IMAGED = ("roughness", "metallic", "occlusion", "opacity", "normal", "emissiveColor")


def _any_image(surface: Any) -> Any:
    """The node of the first image that is no colour; None if there is none."""
    nodes = (_source(surface, name)[1] for name in _IMAGED)
    return next((node for node in nodes if _is_image(node)), None)


def _source(surface: Any, name: str) -> tuple[Any, Any]:
    """The value of an input, and the node that makes it, at most one of them; else None."""
    from pxr import UsdShade

    given = surface.GetInput(name)
    made = given.GetValueProducingAttributes() if given else []
    if not made:
        return None, None
    if UsdShade.Utils.GetType(made[0].GetName()) == UsdShade.AttributeType.Input:
        return made[0].Get(), None
    return None, UsdShade.Shader(made[0].GetPrim())


def _number(surface: Any, name: str, default: float, where: str) -> tuple[float, tuple[str, int]]:
    """A number, and the image that multiplies it."""
    from pxr import UsdShade

    value, node = _source(surface, name)
    if not _is_image(node):
        number = float(default if value is None else value)
        if name != "ior" and not -1e-4 <= number <= 1.0 + 1e-4:
            raise AssetError(f"{where}: {name} is {number:g}, not in [0, 1]; correct it")
        return number if name == "ior" else _unit(number), ("", 0)
    output = str(surface.GetInput(name).GetValueProducingAttributes()[0].GetName())
    channel = "rgba".find(UsdShade.Utils.GetBaseNameAndType(output)[0][:1])
    channel = max(channel, 0)
    return _factors(node)[channel], (_file(node, where), channel)


def _color(surface: Any, name: str, default: Vec3, where: str) -> tuple[Vec3, Any]:
    """A colour, and the node of the image that it multiplies; None = there is none.

    Raises:
        AssetError: if what makes the colour is no image.
    """
    value, node = _source(surface, name)
    if _is_image(node):
        return _factors(node)[:3], node
    if node is not None:
        raise AssetError(
            f"{where}: {name} comes from {node.GetIdAttr().Get()}, which is not read; "
            "bake it to an image"
        )
    red, green, blue = (float(c) for c in (default if value is None else value))
    return (red, green, blue), None


def _is_image(node: Any) -> bool:
    return node is not None and node.GetIdAttr().Get() == "UsdUVTexture"


def _factors(node: Any) -> Any:
    scale = _source(node, "scale")[0]
    return tuple(float(c) for c in (scale or (1.0, 1.0, 1.0, 1.0)))


def _file(node: Any, where: str) -> str:
    """Raises AssetError if the image is not there."""
    asset = _source(node, "file")[0]
    if asset is None or not asset.resolvedPath:
        name = asset.path[:80] if asset is not None else ""
        raise AssetError(f"{where}: its image '{name}' is missing; put it beside the layer")
    return str(asset.resolvedPath)


def _coordinates(image: Any) -> tuple[str, Array]:
    """The primvar that an image is looked up with, and the map on its values."""
    matrix = _IDENTITY
    node = _source(image, "st")[1]
    if node is not None and node.GetIdAttr().Get() == "UsdTransform2d":
        # "UsdPreviewSurface Specification": result = in * scale * rotation + translation.
        sx, sy = _source(node, "scale")[0] or (1.0, 1.0)
        tx, ty = _source(node, "translation")[0] or (0.0, 0.0)
        turn = math.radians(float(_source(node, "rotation")[0] or 0.0))
        c, s = round(math.cos(turn), 12), round(math.sin(turn), 12)
        matrix = np.array([[c * sx, -s * sy, tx], [s * sx, c * sy, ty]])
        node = _source(node, "in")[1]
    if node is None or node.GetIdAttr().Get() != "UsdPrimvarReader_float2":
        return "st", matrix
    return str(_source(node, "varname")[0] or "st"), matrix


def _display_material(mesh: Any) -> Material:
    from pxr import UsdGeom

    colors = UsdGeom.Gprim(mesh).GetDisplayColorAttr().Get()
    if not colors:
        return Material()
    red, green, blue = (_unit(float(c)) for c in colors[0])
    return Material(base_color=(red, green, blue))


def _unit(value: float) -> float:
    return min(max(float(value), 0.0), 1.0)
