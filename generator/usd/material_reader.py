"""Import of UsdPreviewSurface networks."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gen_data.core import asset_types, se3
from gen_data.core.errors import AssetError

_IDENTITY = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True, slots=True)
class Transfer:
    """How the texels of an image become values: ``texel * scale + bias``.

    Attributes:
        scale, bias: By channel.
        space: ``raw`` (linear), ``sRGB`` or ``auto``: colours are sRGB, other values linear.
    """

    scale: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    bias: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    space: str = "auto"


@dataclass(frozen=True, eq=False)
class BoundMaterial:
    """Material of a slot, with its images.

    Attributes:
        name: Name of the material; empty = none.
        material: Material without its texture.
        texture: Resolved path of its colour image; empty = none.
        roughness_image, metallic_image, occlusion_image, alpha_image: Resolved path and channel
            (0 = red) of the images that multiply roughness, metalness, ambient light and coverage;
            empty = none.
        normal_image, emission_image: Resolved paths; empty = none.
        opacity_image: Path and channel of the image that multiplies opacity, without cut-outs.
        cutoff: Coverage below which there is a hole.
        uv_name: Primvar of its texture coordinates.
        uv_matrix: Affine map [2, 3] of the texture coordinates.
        color_name: Primvar that is its colour; empty = it has a colour.
        transfers: Functions of images whose values are not texels times a factor, by attribute.
        unused: Unused contents of the material.
    """

    name: str = ""
    material: asset_types.Material = field(default_factory=asset_types.Material)
    texture: str = ""
    roughness_image: tuple[str, int] = ("", 0)
    metallic_image: tuple[str, int] = ("", 0)
    occlusion_image: tuple[str, int] = ("", 0)
    alpha_image: tuple[str, int] = ("", 0)
    opacity_image: tuple[str, int] = ("", 0)
    normal_image: str = ""
    emission_image: str = ""
    cutoff: float = 0.5
    uv_name: str = "st"
    uv_matrix: se3.Array = field(default_factory=lambda: _IDENTITY)
    color_name: str = ""
    transfers: Mapping[str, Transfer] = field(default_factory=dict)
    unused: tuple[str, ...] = ()

    @property
    def has_images(self) -> bool:
        """Whether it uses any image."""
        channels = (self.roughness_image, self.metallic_image, self.occlusion_image)
        cover = (self.alpha_image, self.opacity_image)
        whole = (self.texture, self.normal_image, self.emission_image)
        return any(whole) or any(name for name, _ in (*channels, *cover))


PLAIN = BoundMaterial(color_name="displayColor")
"""Of meshes without a material."""


def read_bound_material(prim: Any, place: str) -> BoundMaterial:
    """Read the bound material of a mesh or subset; ``PLAIN`` if there is none.

    Raises:
        AssetError: if the material is not a UsdPreviewSurface, an image is missing, or a value is
            out of range.
    """
    from pxr import UsdShade

    bindings, tokens = UsdShade.MaterialBindingAPI(prim), UsdShade.Tokens
    # Either falls back to the binding for all purposes.
    bound = (bindings.ComputeBoundMaterial(p)[0] for p in (tokens.preview, tokens.full))
    material = next((found for found in bound if found), None)
    if material is None:
        return PLAIN
    surface = material.ComputeSurfaceSource()[0]
    where = f"{place}: material {material.GetPath()}"
    kind = surface.GetIdAttr().Get() if surface else None
    if kind != "UsdPreviewSurface":
        raise AssetError(
            f"{where}: its surface is {kind or 'not a universal shader'}, which is not "
            "supported; export it as UsdPreviewSurface"
        )
    return _read_preview_surface(material.GetPrim().GetName(), surface, where)


def _read_preview_surface(name: str, surface: Any, where: str) -> BoundMaterial:
    numbers, images = {}, {}
    for key, default in _NUMBERS.items():
        numbers[key], images[key] = _read_number(surface, key, default, where)
    ior = numbers["ior"]
    if not 1.0 <= ior < math.inf:
        raise AssetError(f"{where}: ior is {ior:g}, expected at least 1; correct it")
    primvar = _color_primvar(surface)
    color, image = (
        (_primvar_fallback(surface), None)
        if primvar
        else _read_color(surface, "diffuseColor", (0.18, 0.18, 0.18), where)
    )
    glow, glow_image = _read_color(surface, "emissiveColor", (0.0, 0.0, 0.0), where)
    if not all(0.0 <= c < math.inf for c in glow):
        raise AssetError(f"{where}: emissiveColor is {glow}, negative or not finite; correct it")
    bump = _find_source(surface, "normal")[1]
    is_cutout = numbers["opacityThreshold"] > 0.0
    # Without a threshold, opacity means transmission or, in mode "presence", coverage.
    opacity = 1.0 if is_cutout else numbers["opacity"]
    # Glass states its refractive index; without one, opacity 0 hides a helper.
    hidden = opacity == 0.0 and _find_source(surface, "ior") == (None, None)
    present = hidden or _find_source(surface, "opacityMode")[0] == "presence"
    material = asset_types.Material(
        base_color=_clamp_color(color),
        roughness=round(numbers["roughness"], 4),
        metallic=round(numbers["metallic"], 4),
        specular=round(_clamp_unit(((ior - 1.0) / (ior + 1.0)) ** 2 / 0.08), 4),
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
        texture=_image_path(image, where),
        roughness_image=images["roughness"],
        metallic_image=images["metallic"],
        occlusion_image=images["occlusion"],
        alpha_image=images["opacity"] if is_cutout else ("", 0),
        opacity_image=("", 0) if is_cutout else images["opacity"],
        normal_image=_image_path(bump, where),
        emission_image=_image_path(glow_image, where),
        cutoff=numbers["opacityThreshold"] if is_cutout else 0.5,
        color_name=primvar,
        unused=tuple(
            f"material '{name}': {key} is not used"
            for key in ("specularColor", "displacement")
            if _has_effect(surface, key)
        ),
    )
    nodes = {"diffuseColor": image} | {key: _find_source(surface, key)[1] for key in _IMAGED}
    placed = {key: _read_coordinates(node) for key, node in nodes.items() if _is_image(node)}
    if not placed:
        return look
    uv_name, uv_matrix = next(iter(placed.values()))
    given = ((key, _read_transfer(nodes[key], key)) for key in placed)
    look = replace(look, transfers={key: found for key, found in given if found is not None})
    unused = look.unused + tuple(
        f"material '{name}': the texture coordinates of {key} differ from the ones of "
        f"{next(iter(placed))} and are not used"
        for key, (other, matrix) in placed.items()
        if other != uv_name or not np.array_equal(matrix, uv_matrix)
    )
    return replace(look, uv_name=uv_name, uv_matrix=uv_matrix, unused=unused)


def _has_effect(surface: Any, key: str) -> bool:
    """Whether an input that is not used has an effect on other renderers."""
    value, node = _find_source(surface, key)
    if key == "specularColor" and not _find_source(surface, "useSpecularWorkflow")[0]:
        return False
    return node is not None or bool(np.any(value if value is not None else 0.0))


_NUMBERS = {
    "roughness": 0.5, "metallic": 0.0, "ior": 1.5, "clearcoat": 0.0, "clearcoatRoughness": 0.01,
    "opacity": 1.0, "opacityThreshold": 0.0, "occlusion": 1.0,
}  # fmt: skip
"""Scalar inputs and their default values."""
_IMAGED = ("roughness", "metallic", "occlusion", "opacity", "normal", "emissiveColor")


def _find_source(surface: Any, name: str) -> tuple[Any, Any]:
    """Value of an input, or the node connected to it; the other is None."""
    from pxr import UsdShade

    given = surface.GetInput(name)
    made = given.GetValueProducingAttributes() if given else []
    if not made:
        return None, None
    if UsdShade.Utils.GetType(made[0].GetName()) == UsdShade.AttributeType.Input:
        return made[0].Get(), None
    return None, UsdShade.Shader(made[0].GetPrim())


def _read_number(
    surface: Any, name: str, default: float, where: str
) -> tuple[float, tuple[str, int]]:
    """Read a scalar input and the image (path, channel) that it multiplies."""
    from pxr import UsdShade

    value, node = _find_source(surface, name)
    if not _is_image(node):
        number = float(default if value is None else value)
        if name != "ior" and not -1e-4 <= number <= 1.0 + 1e-4:
            raise AssetError(f"{where}: {name} is {number:g}, not in [0, 1]; correct it")
        return number if name == "ior" else _clamp_unit(number), ("", 0)
    output = str(surface.GetInput(name).GetValueProducingAttributes()[0].GetName())
    channel = max("rgba".find(UsdShade.Utils.GetBaseNameAndType(output)[0][:1]), 0)
    factor = 1.0 if _read_transfer(node, name) is not None else _read_scale(node)[channel]
    return factor, (_image_path(node, where), channel)


def _read_color(surface: Any, name: str, default: se3.Vec3, where: str) -> tuple[se3.Vec3, Any]:
    """Read a colour input and the node of the image that it multiplies; None = no image."""
    value, node = _find_source(surface, name)
    if _is_image(node):
        whole = _read_transfer(node, name) is not None
        return (1.0, 1.0, 1.0) if whole else _read_scale(node)[:3], node
    if node is not None:
        raise AssetError(
            f"{where}: {name} comes from {node.GetIdAttr().Get()}, which is not supported; "
            "bake it to an image"
        )
    red, green, blue = (float(c) for c in (default if value is None else value))
    return (red, green, blue), None


def _color_primvar(surface: Any) -> str:
    """Primvar that the diffuse colour is read from; empty = none."""
    node = _find_source(surface, "diffuseColor")[1]
    if node is None or not str(node.GetIdAttr().Get()).startswith("UsdPrimvarReader_float"):
        return ""
    return str(_find_source(node, "varname")[0] or "displayColor")


def _primvar_fallback(surface: Any) -> se3.Vec3:
    """Colour of meshes that lack the primvar of the diffuse colour; white if none is stated."""
    value = _find_source(_find_source(surface, "diffuseColor")[1], "fallback")[0]
    try:
        red, green, blue = (float(c) for c in value)
    except (TypeError, ValueError):
        return (1.0, 1.0, 1.0)
    return (red, green, blue)


def _is_image(node: Any) -> bool:
    return node is not None and node.GetIdAttr().Get() == "UsdUVTexture"


def _read_scale(node: Any) -> Any:
    scale = _find_source(node, "scale")[0]
    return tuple(float(c) for c in (scale or (1.0, 1.0, 1.0, 1.0)))


_NORMAL = ((2.0, 2.0, 2.0), (-1.0, -1.0, -1.0))
"""Scale and bias of an image of normals, without which its texels would be read as directions."""


def _read_transfer(node: Any, key: str) -> Transfer | None:
    """Transfer of an image; None if its values are its texels times factors of at least 0."""
    bias = tuple(float(c) for c in (_find_source(node, "bias")[0] or (0.0,) * 4))
    space = str(_find_source(node, "sourceColorSpace")[0] or "auto")
    scale = _read_scale(node)
    if key == "normal":
        given = (scale[:3], bias[:3])
        usual = given in (_NORMAL, ((1.0,) * 3, (0.0,) * 3)) and space != "sRGB"
    else:
        other = "raw" if key in ("diffuseColor", "emissiveColor") else "sRGB"
        usual = not any(bias) and min(scale) >= 0.0 and space != other
    return None if usual else Transfer(scale, bias, space)


def _image_path(node: Any, where: str) -> str:
    """Resolved path of an image node; empty for any other. Raises AssetError if it is missing."""
    if not _is_image(node):
        return ""
    asset = _find_source(node, "file")[0]
    if asset is None or not asset.resolvedPath:
        name = asset.path[:80] if asset is not None else ""
        raise AssetError(f"{where}: its image '{name}' is missing; put it next to the layer")
    return str(asset.resolvedPath)


def _read_coordinates(image: Any) -> tuple[str, se3.Array]:
    """Primvar of an image's texture coordinates, and the affine map of its values."""
    matrix = _IDENTITY
    node = _find_source(image, "st")[1]
    if node is not None and node.GetIdAttr().Get() == "UsdTransform2d":
        # "UsdPreviewSurface Specification": result = in * scale * rotation + translation.
        sx, sy = _find_source(node, "scale")[0] or (1.0, 1.0)
        tx, ty = _find_source(node, "translation")[0] or (0.0, 0.0)
        turn = math.radians(float(_find_source(node, "rotation")[0] or 0.0))
        c, s = round(math.cos(turn), 12), round(math.sin(turn), 12)
        matrix = np.array([[c * sx, -s * sy, tx], [s * sx, c * sy, ty]])
        node = _find_source(node, "in")[1]
    if node is None or node.GetIdAttr().Get() != "UsdPrimvarReader_float2":
        return "st", matrix
    return str(_find_source(node, "varname")[0] or "st"), matrix


def _clamp_color(color: Any) -> se3.Vec3:
    return (_clamp_unit(color[0]), _clamp_unit(color[1]), _clamp_unit(color[2]))


def _clamp_unit(value: float) -> float:
    return min(max(float(value), 0.0), 1.0)
