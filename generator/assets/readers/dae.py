"""COLLADA 1.4 and 1.5 (``.dae``), by pycollada.

Geometry of the scene's nodes in metres, in the axes of the file; ``MeshSource.up`` names the
axis that it states as up. Colours of vertices are sRGB factors on the colour of a material.
Animations, skins, lights and cameras are not read.
"""

import io
import warnings
from collections.abc import Iterator
from dataclasses import replace
from typing import Any
from urllib.parse import unquote
from xml.etree.ElementTree import fromstring, tostring

import numpy as np

from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers.mesh_source import WHITE, MeshSource, locate_file, srgb_to_linear
from gen_data.assets.triangle_soup import Float64, MaterialSlot, TriangleSoup, join_soups
from gen_data.core import (
    asset_types,
    colorimetry,
    errors,
    polygon_triangles,
    safe_xml,
    se3,
)

_MAX_ELEMENTS = 1_000_000
_UP = {"X_UP": "x", "Y_UP": "y", "Z_UP": "z"}
_LINEAR_WRITER = "Blender"
"""Blender writes linear colours; other tools write displayed colours, which are sRGB."""


def read_dae(folder: Folder, relative: str, materials: bool) -> MeshSource:
    """Read the triangles of a COLLADA file with their colours and diffuse images.

    Raises:
        AssetError: if it is malformed, or refers outside the folder.
    """
    data, place = folder.read(relative), str(folder.root / relative)
    # Checked first, because pycollada's parser would expand entities.
    safe_xml.parse_xml(data, place, "COLLADA", "a COLLADA file", _MAX_ELEMENTS)
    from collada import Collada
    from collada.common import DaeBrokenRefError, DaeError, DaeIncompleteError, DaeUnsupportedError

    remarks: list[str] = []
    try:
        with warnings.catch_warnings():
            # It multiplies by numpy.matrix, and sets the shapes of arrays.
            for category in (PendingDeprecationWarning, DeprecationWarning):
                warnings.simplefilter("ignore", category)
            tolerated = [DaeUnsupportedError, DaeBrokenRefError, DaeIncompleteError]
            document = Collada(io.BytesIO(data), ignore=tolerated)
            if document.errors:
                remarks += [f"ignored: {error.msg[:120]}" for error in document.errors]
                mended = _without_broken_materials(data, {m.id for m in document.materials})
                document = Collada(io.BytesIO(mended), ignore=tolerated)
            soups = [
                _make_soup(folder, relative, document, *part, remarks if materials else None)
                for part in enumerate(_placed_geometries(document, remarks))
            ]
    except (DaeError, ValueError, LookupError, TypeError, AttributeError) as error:
        reason = str(error).strip().split("\n")[0][:200] or type(error).__name__
        raise errors.AssetError(f"{place}: malformed COLLADA ({reason}); export it again") from None
    parts = [soup for group in soups for soup in group]
    if not parts:
        skinned = " (skins are not read)" if _SKINNED in " ".join(remarks) else ""
        raise errors.AssetError(
            f"{place}: holds no triangles{skinned}; export it again with its faces"
        )
    up = _UP.get(str(document.assetInfo.upaxis), "y")
    return MeshSource(join_soups(parts), remarks=tuple(dict.fromkeys(remarks)), up=up)


def _without_broken_materials(data: bytes, known: set[str]) -> bytes:
    """The file without uses of unknown materials: pycollada drops the geometry that uses one."""
    root = fromstring(data)
    for parent in list(root.iter()):
        for child in list(parent):
            use = str(child.tag).endswith("}instance_material")
            if use and child.get("target", "").removeprefix("#") not in known:
                parent.remove(child)
    return tostring(root)


_SKINNED = "is skinned and is not read"


def _placed_geometries(
    document: Any, remarks: list[str]
) -> Iterator[tuple[str, Any, Float64, dict[str, Any]]]:
    """Yield name, geometry, its affine map [3, 4] to the scene and its bound materials by symbol.

    The name is the node's, which tools show and descriptions refer to.
    """
    if document.scene is None:
        for geometry in document.geometries:
            yield "", geometry, np.eye(4)[:3], {}
        return
    for name, bound in _bound_geometries(document.scene.nodes, None, "", remarks):
        matrix = np.asarray(bound.matrix, np.float64)[:3]
        yield name, bound.original, matrix, dict(bound.materialnodebysymbol)


def _bound_geometries(
    nodes: Any, matrix: Any, name: str, remarks: list[str]
) -> Iterator[tuple[str, Any]]:
    """Geometries below nodes, each with the name of the nearest node around it that has one."""
    from collada.scene import ControllerNode, Node, NodeNode

    for node in nodes:
        if isinstance(node, NodeNode):
            yield from _bound_geometries([node.node], matrix, name, remarks)
        elif isinstance(node, Node):
            here = node.matrix if matrix is None else np.dot(matrix, node.matrix)
            inner = str(node.name or node.id or name)
            yield from _bound_geometries(node.children, here, inner, remarks)
        elif isinstance(node, ControllerNode):
            remarks.append(f"'{name[:60]}' {_SKINNED}")
        else:
            for bound in node.objects("geometry", matrix):
                yield name, bound


def _make_soup(
    folder: Folder,
    relative: str,
    document: Any,
    number: int,
    placed: tuple[str, Any, Float64, dict[str, Any]],
    remarks: list[str] | None,
) -> list[TriangleSoup]:
    """Soups of one geometry's sets of polygons; they are one group.

    Without ``remarks`` it has no materials.
    """
    from collada.polylist import Polylist
    from collada.triangleset import TriangleSet

    node, geometry, matrix, bound = placed
    matrix = matrix * float(document.assetInfo.unitmeter or 1.0)
    soups = []
    for primitive in geometry.primitives:
        # Polygons derive from polylists; other primitives are stray lines.
        triangles = _triangles(primitive) if isinstance(primitive, Polylist) else primitive
        if not isinstance(triangles, TriangleSet) or not len(triangles):
            continue
        slot, node_of = MaterialSlot(), bound.get(triangles.material)
        target = None if node_of is None else node_of.target
        if remarks is not None and target is not None:
            linear = any(
                _LINEAR_WRITER in (c.authoring_tool or "") for c in document.assetInfo.contributors
            )
            slot = _read_material(folder, relative, target, remarks, linear=linear)
        soup = TriangleSoup.of(_rows(triangles.vertex, triangles.vertex_index), slot)
        uvs = normals = None
        if triangles.texcoordset:
            k = _texture_set(triangles, node_of)
            uvs = _rows(triangles.texcoordset[k], triangles.texcoord_indexset[k])[..., :2]
        if triangles.normal is not None:
            normals = _rows(triangles.normal, triangles.normal_index)
        colors = None if remarks is None else _vertex_colors(triangles, slot, remarks)
        if colors is not None and not slot.from_file:
            soup = replace(soup, slots=(replace(slot, material=WHITE, from_file=True),))
        name = node or str(geometry.name or geometry.id or f"geometry_{number}")
        soup = replace(soup, uvs=uvs, normals=normals, colors=colors, group_names=(name,))
        soups.append(soup.transformed(matrix))
    if len(soups) < 2:
        return soups
    joined = join_soups(soups)
    one = np.zeros_like(joined.face_groups)
    return [replace(joined, face_groups=one, group_names=soups[0].group_names)]


def _triangles(polygons: Any) -> Any:
    """The set of triangles of polygons of pycollada, whose own is of fans."""
    from collada.triangleset import TriangleSet

    if not len(polygons.index):
        return polygons.triangleset()
    corners = np.asarray(polygons.vertex_index, np.int64)
    points = np.asarray(polygons.vertex, np.float64)
    if corners.min() < 0 or corners.max() >= len(points):
        raise ValueError(f"an index out of range 0..{len(points) - 1}")
    sizes = np.asarray(polygons.vcounts, np.int64)
    triangles, _ = polygon_triangles.split_polygons(sizes, points, corners)
    indices = np.ascontiguousarray(polygons.index[triangles]).reshape(-1)
    return TriangleSet(polygons.sources, polygons.material, indices, polygons.xmlnode)


def _texture_set(triangles: Any, bound: Any) -> int:
    """Number of the set of texture coordinates that the diffuse image of a material is bound to."""
    wanted = getattr(bound.target.effect.diffuse, "texcoord", None) if bound is not None else None
    for symbol, semantic, number in bound.inputs if bound is not None else ():
        if (symbol, semantic) == (wanted, "TEXCOORD"):
            sets = [one[3] or "0" for one in triangles.sources["TEXCOORD"]]
            return sets.index(number or "0") if (number or "0") in sets else 0
    return 0


def _vertex_colors(triangles: Any, slot: MaterialSlot, remarks: list[str]) -> Float64 | None:
    """Linear RGB [m, 3, 3] of corners; None without colours, or where an image is."""
    inputs = triangles.sources.get("COLOR")
    if not inputs:
        return None
    if slot.material.texture:
        remarks.append("vertex colours are not used where an image is")
        return None
    offset, _, _, _, source = inputs[0]
    srgb = _rows(source.data, triangles.index[:, :, offset])[..., :3]
    if srgb.shape[-1] < 3 or not np.isfinite(srgb).all():
        raise ValueError("a vertex colour that is not three finite numbers")
    return colorimetry.srgb_decode(np.clip(srgb, 0.0, 1.0))


def _rows(table: Any, indices: Any) -> Float64:
    """Rows of a table by corner, [m, 3, k]."""
    values, numbers = np.asarray(table, np.float64), np.asarray(indices)
    if numbers.size and (numbers.min() < 0 or numbers.max() >= len(values)):
        raise ValueError(f"an index out of range 0..{len(values) - 1}")
    rows: Float64 = values[numbers]
    return rows


def _read_material(
    folder: Folder, relative: str, target: Any, remarks: list[str], *, linear: bool
) -> MaterialSlot:
    effect = target.effect
    name = str(target.name or target.id or "")
    material = asset_types.Material(opacity=_read_opacity(effect))
    glow = effect.emission
    if getattr(glow, "sampler", None) is not None or any((glow or ())[:3]):
        remarks.append(f"material '{name[:40]}': its emission is not used")
    image = getattr(effect.diffuse, "sampler", None)
    if image is not None:
        path = unquote(image.surface.image.path.removeprefix("file://"))
        texture = locate_file(folder, relative, path, remarks)
        material = replace(material, base_color=(1.0, 1.0, 1.0), texture=texture)
    elif isinstance(effect.diffuse, tuple):
        red, green, blue = (round(min(max(float(c), 0.0), 1.0), 6) for c in effect.diffuse[:3])
        color: se3.Vec3 = (red, green, blue)
        material = replace(material, base_color=color if linear else srgb_to_linear(color))
    return MaterialSlot(name, material, from_file=True)


def _read_opacity(effect: Any) -> float:
    """Share of the background that a material hides.

    Source: COLLADA 1.5, chapter 8, "Determining transparency". Many exporters write the factor or
    the colour inverted, which makes all of a material vanish: such a material is opaque.
    """
    factor = 1.0 if effect.transparency is None else float(effect.transparency)
    color = effect.transparent
    if not isinstance(color, tuple) or len(color) < 4:
        opacity = factor
    elif effect.opaque_mode == "RGB_ZERO":
        opacity = 1.0 - (0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2]) * factor
    else:
        opacity = float(color[3]) * factor
    opacity = round(min(max(opacity, 0.0), 1.0), 6)
    return opacity if opacity > 0.0 else 1.0
