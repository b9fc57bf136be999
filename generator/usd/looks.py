"""UsdPreviewSurface networks to materials."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from generator.core.errors import AssetError
from generator.core.geometry import Material
from generator.core.se3 import Array, Vec3

_IDENTITY = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True, eq=False)
class SurfaceLook:
    """What a slot looks like.

    Attributes:
        name: Of its material; empty = it has none.
        material: Without its texture.
        texture: Resolved path of its colour image; empty = none.
        roughness_image, metallic_image: Resolved path and channel (0 red) of the images that
            multiply roughness and metalness; empty = none.
        uv_name: Primvar that holds its texture coordinates.
        uv_matrix: Affine map [2, 3] on them.
    """

    name: str = ""
    material: Material = field(default_factory=Material)
    texture: str = ""
    roughness_image: tuple[str, int] = ("", 0)
    metallic_image: tuple[str, int] = ("", 0)
    uv_name: str = "st"
    uv_matrix: Array = field(default_factory=lambda: _IDENTITY)


PLAIN = SurfaceLook()


def read_look(prim: Any, mesh: Any, place: str) -> SurfaceLook:
    """The look of a mesh or subset by its bound material; else by the mesh's display colour.

    Raises:
        AssetError: if the material is no UsdPreviewSurface, or an image is missing.
    """
    from pxr import UsdShade

    material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    if not material:
        return replace(PLAIN, material=_displayed(mesh))
    surface = material.ComputeSurfaceSource()[0]
    where = f"{place}: material {material.GetPath()}"
    kind = surface.GetIdAttr().Get() if surface else None
    if kind != "UsdPreviewSurface":
        raise AssetError(
            f"{where}: its surface is {kind or 'none that every renderer knows'}, which is not "
            "read; export it as UsdPreviewSurface"
        )
    return _preview_surface(material.GetPrim().GetName(), surface, where)


def _preview_surface(name: str, surface: Any, where: str) -> SurfaceLook:
    rough, rough_image = _number(surface, "roughness", 0.5, where)
    metallic, metallic_image = _number(surface, "metallic", 0.0, where)
    ior, _ = _number(surface, "ior", 1.5, where)
    color, image = _color(surface, "diffuseColor", (0.18, 0.18, 0.18), where)
    glow, _ = _color(surface, "emissiveColor", (0.0, 0.0, 0.0), where)
    look = SurfaceLook(
        name,
        Material(
            base_color=(_unit(color[0]), _unit(color[1]), _unit(color[2])),
            roughness=round(_unit(rough), 4),
            metallic=round(_unit(metallic), 4),
            specular=round(_unit(((ior - 1.0) / (ior + 1.0)) ** 2 / 0.08), 4),
            emission_cd_m2=glow,
        ),
        roughness_image=rough_image,
        metallic_image=metallic_image,
    )
    if image is None:
        return look
    uv_name, uv_matrix = _coordinates(image)
    return replace(look, texture=_file(image, where), uv_name=uv_name, uv_matrix=uv_matrix)


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
        return float(default if value is None else value), ("", 0)
    output = str(surface.GetInput(name).GetValueProducingAttributes()[0].GetName())
    channel = "rgba".find(UsdShade.Utils.GetBaseNameAndType(output)[0][:1])
    channel = max(channel, 0) % 3
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


def _displayed(mesh: Any) -> Material:
    from pxr import UsdGeom

    colors = UsdGeom.Gprim(mesh).GetDisplayColorAttr().Get()
    if not colors:
        return Material()
    red, green, blue = (_unit(float(c)) for c in colors[0])
    return Material(base_color=(red, green, blue))


def _unit(value: float) -> float:
    return min(max(float(value), 0.0), 1.0)
