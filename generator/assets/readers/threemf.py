"""3MF (3MF Consortium, "3D Manufacturing Format: Core Specification", 1.3), in metres.

Read are meshes, components and build items with their transforms, and colours of base materials
and of colour groups; images, slices and beams are not.
"""

import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from xml.etree.ElementTree import Element

import numpy as np

from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers.mesh_source import MAX_FACES, WHITE, MeshSource
from gen_data.assets.triangle_soup import Float64, MaterialSlot, TriangleSoup, join_soups
from gen_data.core import colorimetry, errors, safe_xml

_METRES = {
    "micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048,
    "meter": 1.0,
}  # fmt: skip
_MAX_ELEMENTS = 4 * MAX_FACES
_MAX_BYTES = 512 * 1024 * 1024
_MAX_PARTS = 10_000
_MAX_DEPTH = 16
_OPAQUE = 250
"""Least alpha [1/255] that counts as opaque."""
_UNUSED = {
    "texture2dgroup": "images are not used",
    "compositematerials": "mixed materials are not used",
    "beamlattice": "lattices of beams are not read",
    "displacementmesh": "displaced meshes are not read",
}


@dataclass(frozen=True)
class _Model:
    """Resources of one model file of the archive, by id.

    Attributes:
        colors: Linear RGB [n, 3] of each group of properties.
    """

    name: str
    unit: str
    objects: Mapping[str, Element]
    colors: Mapping[str, Float64]
    items: tuple[Element, ...]


@dataclass
class _Package:
    """An archive; its model files are parsed on first use."""

    archive: zipfile.ZipFile
    place: str
    models: dict[str, _Model] = field(default_factory=dict)
    remarks: set[str] = field(default_factory=set)
    soups: list[TriangleSoup] = field(default_factory=list)

    def model(self, name: str) -> _Model:
        name = name.lstrip("/")
        if name not in self.models:
            self.models[name] = _parse_model(self, name)
        return self.models[name]


def read_3mf(folder: Folder, relative: str, materials: bool) -> MeshSource:
    """Read the objects that a 3MF file builds.

    Raises:
        AssetError: if it is not an archive with a model, malformed, or larger than the limits.
    """
    place = str(folder.root / relative)
    try:
        with zipfile.ZipFile(io.BytesIO(folder.read(relative))) as archive:
            package = _Package(archive, place)
            names = [name for name in archive.namelist() if name.lower().endswith(".model")]
            if not names:
                raise ValueError("no model in the archive")
            root = package.model(
                next((name for name in names if name.lower() == "3d/3dmodel.model"), names[0])
            )
            for item in root.items:
                model = package.model(_attribute(item, "path") or root.name)
                _collect(package, model, item.attrib["objectid"], _transform(item), _MAX_DEPTH)
            scale = _METRES[root.unit]
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, OSError, EOFError):
        raise errors.AssetError(f"{place}: unreadable 3MF archive; export it again") from None
    except (KeyError, ValueError, IndexError) as error:
        reason = f"missing {error}" if isinstance(error, KeyError) else str(error)[:120]
        raise errors.AssetError(f"{place}: malformed 3MF ({reason}); export it again") from None
    if not package.soups:
        raise errors.AssetError(f"{place}: builds no object; export it again with its mesh")
    whole = join_soups(package.soups)
    colors = whole.colors if materials else None
    whole = replace(whole, corners=whole.corners * scale, colors=colors)
    return MeshSource(whole, {}, tuple(sorted(package.remarks)))


def _parse_model(package: _Package, name: str) -> _Model:
    size = package.archive.getinfo(name).file_size
    if size > _MAX_BYTES:
        raise ValueError(f"a model of {size} bytes, at most {_MAX_BYTES}")
    data = package.archive.read(name)
    place = f"{package.place}: {name}"
    root = safe_xml.parse_xml(data, place, "model", "a 3MF model", _MAX_ELEMENTS)
    objects: dict[str, Element] = {}
    colors: dict[str, Float64] = {}
    items: list[Element] = []
    for part in (child for top in root for child in top):
        kind = _local(part)
        if kind == "object":
            objects[part.attrib["id"]] = part
        elif kind in ("basematerials", "colorgroup"):
            values = [e.get("displaycolor") or e.get("color") or "#FFFFFF" for e in part]
            if any(len(v.strip()) == 9 and int(v.strip()[7:], 16) < _OPAQUE for v in values):
                package.remarks.add("the opacity of colours is not used")
            colors[part.attrib["id"]] = _linear_colors(values)
        elif kind == "item":
            items.append(part)
        elif kind in _UNUSED:
            package.remarks.add(_UNUSED[kind])
    return _Model(name, root.get("unit", "millimeter"), objects, colors, tuple(items))


def _local(element: Element) -> str:
    return element.tag.rpartition(":")[2]


def _attribute(element: Element, name: str) -> str:
    """An attribute of an extension, whatever its prefix; empty if it is absent."""
    return next((v for k, v in element.attrib.items() if k.rpartition(":")[2] == name), "")


def _find(element: Element, name: str) -> list[Element]:
    return [child for child in element if _local(child) == name]


def _linear_colors(values: list[str]) -> Float64:
    """Linear RGB [n, 3] of texts ``#RRGGBB`` or ``#RRGGBBAA``."""
    rows = [[int(v.strip()[k : k + 2], 16) / 255.0 for k in (1, 3, 5)] for v in values]
    return colorimetry.srgb_decode(np.array(rows, np.float64).reshape(-1, 3))


def _transform(element: Element) -> Float64:
    """Affine map [4, 4] of a transform, whose text lists it column by column."""
    matrix = np.eye(4)
    if "transform" in element.attrib:
        numbers = [float(word) for word in element.attrib["transform"].split()]
        matrix[:3] = np.array(numbers, np.float64).reshape(4, 3).T
    return matrix


def _collect(package: _Package, model: _Model, object_id: str, matrix: Float64, depth: int) -> None:
    """Add the triangles of an object and of its components to the package."""
    if not depth or len(package.soups) > _MAX_PARTS:
        raise ValueError(f"more than {_MAX_DEPTH} levels or {_MAX_PARTS} parts")
    element = model.objects[object_id]
    for mesh in _find(element, "mesh"):
        soup = _read_mesh(package, model, element, mesh)
        if soup is not None:
            package.soups.append(soup.transformed(matrix[:3]))
    for component in (c for group in _find(element, "components") for c in group):
        own = package.model(_attribute(component, "path") or model.name)
        whole = np.einsum("ij,jk->ik", matrix, _transform(component), optimize=False)
        _collect(package, own, component.attrib["objectid"], whole, depth - 1)


def _read_mesh(
    package: _Package, model: _Model, element: Element, mesh: Element
) -> TriangleSoup | None:
    """Triangles of a mesh with the colours of its properties; None if there are none."""
    (vertices,), (triangles,) = _find(mesh, "vertices"), _find(mesh, "triangles")
    for child in mesh:
        if _local(child) in _UNUSED:
            package.remarks.add(_UNUSED[_local(child)])
    points = np.array([[float(v.attrib[a]) for a in "xyz"] for v in vertices], np.float64)
    faces = np.array([[int(t.attrib[a]) for a in ("v1", "v2", "v3")] for t in triangles], np.int64)
    if not len(faces):
        return None
    if faces.min() < 0 or faces.max() >= len(points):
        raise ValueError("a vertex index out of range")
    rows = [_corner_colors(model, element, triangle) for triangle in triangles]
    zeros = np.zeros(len(faces), np.int64)
    colored = any(row is not None for row in rows)
    plain = np.full((3, 3), MaterialSlot().material.base_color[0])
    colors = np.array([plain if row is None else row for row in rows]) if colored else None
    slot = MaterialSlot(material=WHITE, from_file=True) if colored else MaterialSlot()
    name = (element.get("name", ""),)
    return TriangleSoup(points[faces], None, None, zeros, zeros, (slot,), name, colors)


def _corner_colors(model: _Model, element: Element, triangle: Element) -> Float64 | None:
    """Linear RGB [3, 3] of a triangle's corners; None if it has no colours."""
    colors = model.colors.get(triangle.get("pid") or element.get("pid") or "")
    if colors is None:
        return None
    first = triangle.get("p1") or element.get("pindex") or "0"
    numbers = [int(first), *(int(triangle.get(key) or first) for key in ("p2", "p3"))]
    if min(numbers) < 0:
        raise ValueError("a negative index of a colour")
    return colors[numbers]
