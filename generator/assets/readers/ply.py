"""Stanford PLY (Turk, "The PLY polygon file format", 1994), with MeshLab's textures.

Read are polygons and triangle strips, colours of vertices or faces, and the images that comments
``TextureFile`` name, with texture coordinates per vertex or per corner.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers.mesh_source import (
    MAX_FACES,
    WHITE,
    MeshSource,
    locate_file,
)
from gen_data.assets.triangle_soup import Float64, Int64, MaterialSlot, TriangleSoup
from gen_data.config.yaml_scalars import abbreviate
from gen_data.core.asset_types import Material
from gen_data.core.colorimetry import srgb_decode
from gen_data.core.errors import AssetError
from gen_data.core.polygon_triangles import split_polygons

_MAX_HEADER_BYTES = 65536
_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float16": "f2",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_COLORS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"),
           ("r", "g", "b"))  # fmt: skip
_TEXCOORDS = (("texture_u", "texture_v"), ("s", "t"), ("u", "v"))


@dataclass(frozen=True)
class _Property:
    """A property; ``counted`` is the type of a list's length, empty for a single value."""

    name: str
    kind: str
    counted: str = ""


@dataclass(frozen=True)
class _Header:
    """Statements before ``end_header``, and where the data begin."""

    order: str
    elements: tuple[tuple[str, int, tuple[_Property, ...]], ...]
    images: tuple[str, ...]
    end: int


@dataclass(frozen=True, eq=False)
class _Lists:
    """A list property: the length of every row's list, and all values one after another."""

    sizes: Int64
    values: NDArray[np.generic]


_Columns = Mapping[str, "NDArray[np.generic] | _Lists"]


def read_ply(folder: Folder, relative: str, materials: bool) -> MeshSource:
    """Read a PLY file.

    Raises:
        AssetError: if the header states more elements than the file can hold, or parsing fails.
    """
    data = folder.read(relative)
    path = folder.root / relative
    remarks: list[str] = []
    try:
        header = _parse_header(data)
        elements = dict(_read_elements(header, data))
        images = [locate_file(folder, relative, name, remarks) for name in header.images]
        soup = _build_soup(elements, images if materials else [], remarks)
    except ValueError as error:
        raise AssetError(
            f"{path}: malformed PLY ({abbreviate(str(error), 80)}); export it again"
        ) from None
    if soup is None:
        raise AssetError(f"{path}: holds no triangles; export it again with its faces")
    return MeshSource(soup, {}, tuple(remarks))


def ply_references(data: bytes) -> tuple[str, ...]:
    """Names of the images of a PLY file; none if it is malformed, which its reader reports."""
    try:
        return _parse_header(data).images
    except ValueError:
        return ()


def _parse_header(data: bytes) -> _Header:
    head, found, _ = data[:_MAX_HEADER_BYTES].partition(b"end_header")
    if not head.startswith(b"ply") or not found:
        raise ValueError("not a PLY file: it lacks 'ply' or 'end_header'")
    end = len(head) + len(found)
    end += 2 if data[end : end + 2] == b"\r\n" else 1
    order, elements, images = None, list[tuple[str, int, list[_Property]]](), list[str]()
    for line in head.decode("utf-8", "replace").replace("\r", "\n").split("\n")[1:]:
        words = line.split()
        if not words:
            continue
        if words[0] == "format" and len(words) > 1:
            order = _ORDERS.get(words[1].lower())
            if order is None:
                raise ValueError(f"unknown format '{words[1][:40]}'")
        elif words[0] == "comment" and len(words) > 2 and words[1].lower() == "texturefile":
            images.append(line.split(None, 2)[2].strip().strip('"'))
        elif words[0] == "element":
            if len(words) != 3:
                raise ValueError(f"an incomplete line in its header: '{line[:40]}'")
            # Every element takes at least one byte, so a larger count is false.
            if not words[2].isdigit() or len(words[2]) > 12 or int(words[2]) > len(data):
                raise ValueError("its header states more elements than it holds")
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property":
            if not elements:
                raise ValueError("a property before any element in its header")
            elements[-1][2].append(_parse_property(words, line))
    if order is None:
        raise ValueError("its header states no format")
    return _Header(order, tuple((n, c, tuple(p)) for n, c, p in elements), tuple(images), end)


def _parse_property(words: list[str], line: str) -> _Property:
    kinds = words[2:4] if words[1:2] == ["list"] else words[1:2]
    if len(words) != len(kinds) + (3 if len(kinds) == 2 else 2) or not kinds:
        raise ValueError(f"an incomplete line in its header: '{line[:40]}'")
    unknown = next((kind for kind in kinds if kind.lower() not in _TYPES), "")
    if unknown:
        raise ValueError(f"unknown type or property '{unknown[:40]}' in its header")
    *counted, kind = (_TYPES[kind.lower()] for kind in kinds)
    return _Property(words[-1], kind, *counted)


def _read_elements(header: _Header, data: bytes) -> Iterator[tuple[str, _Columns]]:
    if not header.order:
        # A text becomes binary numbers, in the same order.
        words = np.array(_ascii_words(header, data[header.end :]) or [b"0"])
        numbers, at = words.astype(np.float64).view(np.uint8), 0
        for name, count, properties in header.elements:
            wide = tuple(_Property(p.name, "f8", p.counted and "f8") for p in properties)
            columns, at = _read_rows(numbers, at, count, wide, "=")
            kinds = {p.name: p.kind for p in properties if not p.counted}
            yield (
                name,
                {
                    key: column.astype(kinds[key]) if isinstance(column, np.ndarray) else column
                    for key, column in columns.items()
                },
            )
        return
    bytes_, at = np.frombuffer(data, np.uint8), header.end
    for name, count, properties in header.elements:
        columns, at = _read_rows(bytes_, at, count, properties, header.order)
        yield name, columns


def _ascii_words(header: _Header, body: bytes) -> list[bytes]:
    """Words of the elements of a text: one element per line, of which exporters write more words.

    Where lines are shorter than their elements, all words in sequence.
    """
    lines = [words for line in body.split(b"\n") if (words := line.split())]
    found: list[bytes] = []
    at = 0
    for _, count, properties in header.elements:
        rows, at = lines[at : at + count], at + count
        lists = [k for k, p in enumerate(properties) if p.counted]
        for row in rows:
            used = len(properties)
            try:
                for k in lists:
                    # Words before this list, of lists before it, are counted already.
                    used += int(float(row[k + used - len(properties)]))
            except IndexError:
                return body.split()
            if used > len(row):
                return body.split()
            found += row[:used]
    return found


def _read_rows(
    data: NDArray[np.uint8], at: int, count: int, properties: tuple[_Property, ...], order: str
) -> tuple[_Columns, int]:
    """Columns of ``count`` rows that begin at a byte, and the byte after them.

    Raises:
        ValueError: if the data end before.
    """
    if not count or not properties:
        return {}, at
    sizes = _list_sizes(data, at, properties, order)
    row = _row_type(properties, sizes, order)
    even = at + count * row.itemsize <= len(data)
    if even:
        rows = data[at : at + count * row.itemsize].view(row)
        even = all((rows[f"{k} count"] == size).all() for k, size in sizes.items())
    if even:
        columns: dict[str, NDArray[np.generic] | _Lists] = {}
        for k, p in enumerate(properties):
            if p.counted:
                columns[p.name] = _Lists(np.full(count, sizes[k]), rows[str(k)].reshape(-1))
            else:
                columns[p.name] = rows[str(k)]
        return columns, at + count * row.itemsize
    return _read_uneven(data, at, count, properties, order)


def _list_sizes(
    data: NDArray[np.uint8], at: int, properties: tuple[_Property, ...], order: str
) -> dict[int, int]:
    """Lengths of the lists in the first row, by number of the property."""
    sizes: dict[int, int] = {}
    for k, p in enumerate(properties):
        if p.counted:
            start = at + (_row_type(properties[:k], sizes, order).itemsize if k else 0)
            sizes[k] = _number_at(data, start, order + p.counted)
    return sizes


def _number_at(data: NDArray[np.uint8], at: int, kind: str) -> int:
    dtype = np.dtype(kind)
    part = data[at : at + dtype.itemsize]
    if len(part) < dtype.itemsize:
        raise ValueError("unexpected length: it ends before its last element")
    value = float(part.view(dtype)[0])
    if not 0 <= value <= len(data):
        raise ValueError("a list longer than the file")
    return int(value)


def _row_type(
    properties: tuple[_Property, ...], sizes: Mapping[int, int], order: str
) -> np.dtype[np.void]:
    fields: list[tuple[object, ...]] = []
    for k, p in enumerate(properties):
        if p.counted:
            fields += [(f"{k} count", order + p.counted), (str(k), order + p.kind, (sizes[k],))]
        else:
            fields.append((str(k), order + p.kind))
    return np.dtype(fields)


def _read_uneven(
    data: NDArray[np.uint8], at: int, count: int, properties: tuple[_Property, ...], order: str
) -> tuple[_Columns, int]:
    raw = data.tobytes()
    kinds = [np.dtype(order + p.kind) for p in properties]
    counts = [np.dtype(order + p.counted) if p.counted else None for p in properties]
    pieces: list[list[bytes]] = [[] for _ in properties]
    sizes: list[list[int]] = [[] for _ in properties]
    for _ in range(count):
        for k, (kind, counted) in enumerate(zip(kinds, counts, strict=True)):
            size = 1
            if counted is not None:
                if at + counted.itemsize > len(raw):
                    raise ValueError("unexpected length: it ends before its last element")
                size = int(np.frombuffer(raw, counted, 1, at)[0])
                at += counted.itemsize
                sizes[k].append(size)
            end = at + size * kind.itemsize
            if size < 0 or end > len(raw):
                raise ValueError("unexpected length: it ends before its last element")
            pieces[k].append(raw[at:end])
            at = end
    columns: dict[str, NDArray[np.generic] | _Lists] = {}
    for k, p in enumerate(properties):
        values = np.frombuffer(b"".join(pieces[k]), kinds[k])
        columns[p.name] = _Lists(np.array(sizes[k], np.int64), values) if p.counted else values
    return columns, at


def _build_soup(
    elements: Mapping[str, _Columns], images: list[str], remarks: list[str]
) -> TriangleSoup | None:
    """Triangles with their looks; None if there are none."""
    vertex, face = elements.get("vertex", {}), elements.get("face", {})
    positions = _columns(vertex, ("x", "y", "z"))
    faces = _find_lists(face, ("vertex_indices", "vertex_index"))
    if positions is None:
        return None
    if faces is None or not len(faces.sizes):
        strips = _find_lists(elements.get("tristrips", {}), ("vertex_indices", "vertex_index"))
        faces, face = (None if strips is None else _split_strips(strips)), {}
    if faces is None:
        return None
    count = int(np.maximum(faces.sizes - 2, 0).sum())
    if count > MAX_FACES:
        raise ValueError(f"more than {MAX_FACES} triangles")
    index = faces.values.astype(np.int64)
    if not count:
        return None
    if index.min() < 0 or index.max() >= len(positions):
        raise ValueError("a face with a vertex index out of range")
    fans, polygon = split_polygons(faces.sizes, positions, index)
    corner = index[fans]
    uvs = _read_uvs(vertex, face, faces, fans, corner) if images else None
    textured = uvs is not None
    colors = None if textured else _read_colors(vertex, face, corner, polygon, remarks)
    if textured and (_is_colored(_srgb(vertex)) or _is_colored(_srgb(face))):
        remarks.append("vertex and face colours are not used next to an image")
    if colors is not None and _is_transparent(vertex):
        remarks.append("the opacity of vertices (alpha) is not used")
    if images and not textured:
        remarks.append(f"the image {images[0]} is not used: there are no texture coordinates")
    plain = MaterialSlot() if colors is None else MaterialSlot(material=WHITE, from_file=True)
    slots: tuple[MaterialSlot, ...] = (plain,)
    numbers = np.zeros(len(fans), np.int64)
    if textured:
        slots = tuple(
            MaterialSlot(f"texture_{k}", Material((1.0, 1.0, 1.0), texture=name), from_file=True)
            for k, name in enumerate(images)
        )
        which = face.get("texnumber")
        if isinstance(which, np.ndarray) and len(images) > 1:
            numbers = np.clip(which.astype(np.int64), 0, len(images) - 1)[polygon]
    zeros = np.zeros(len(fans), np.int64)
    return TriangleSoup(positions[corner], uvs, None, numbers, zeros, slots, (), colors)


def _columns(element: _Columns, names: tuple[str, ...]) -> Float64 | None:
    """Single values by name [n, len(names)]; None if one is missing."""
    found = [element.get(name) for name in names]
    arrays = [values.astype(np.float64) for values in found if isinstance(values, np.ndarray)]
    return np.stack(arrays, axis=1) if len(arrays) == len(names) else None


def _find_lists(element: _Columns, names: tuple[str, ...]) -> _Lists | None:
    found = (element.get(name) for name in names)
    return next((values for values in found if isinstance(values, _Lists)), None)


def _split_strips(strips: _Lists) -> _Lists:
    """Triangles of strips, in which -1 starts another one."""
    triangles: list[tuple[int, int, int]] = []
    index, ends = strips.values.astype(np.int64), np.cumsum(strips.sizes)
    for strip in np.split(index, ends[:-1]):
        for run in np.split(strip, np.flatnonzero(strip < 0)):
            run = run[run >= 0]  # noqa: PLW2901
            rows = np.stack([run[:-2], run[1:-1], run[2:]], axis=1)
            rows[1::2] = rows[1::2, [1, 0, 2]]
            triangles += map(tuple, rows.tolist())
    corners = np.array(triangles, np.int64).reshape(-1, 3)
    return _Lists(np.full(len(corners), 3), corners.reshape(-1))


def _read_uvs(
    vertex: _Columns, face: _Columns, faces: _Lists, fans: Int64, corner: Int64
) -> Float64 | None:
    """Texture coordinates [m, 3, 2], per corner where there are any, else per vertex."""
    own = _find_lists(face, ("texcoord",))
    if own is not None and (own.sizes == 2 * faces.sizes).all():
        wedges: Float64 = own.values.astype(np.float64).reshape(-1, 2)[fans]
        return wedges
    found = (_columns(vertex, names) for names in _TEXCOORDS)
    table = next((values for values in found if values is not None), None)
    return None if table is None else table[corner]


def _read_colors(
    vertex: _Columns, face: _Columns, corner: Int64, polygon: Int64, remarks: list[str]
) -> Float64 | None:
    """Linear RGB [m, 3, 3] of vertices or, without them, of faces."""
    by_vertex, by_face = _srgb(vertex), _srgb(face)
    if by_vertex is not None and (by_face is None or not _varies(by_face) or _varies(by_vertex)):
        if by_face is not None and _varies(by_face):
            remarks.append("face colours are not used next to vertex colours")
        return by_vertex[corner]
    return None if by_face is None else np.repeat(by_face[polygon][:, None], 3, axis=1)


def _is_transparent(vertex: _Columns) -> bool:
    """Whether some vertices, but not all, have less opacity than others."""
    alpha = vertex.get("alpha")
    return isinstance(alpha, np.ndarray) and bool(alpha.max() - alpha.min() > 0.02 * alpha.max())


def _varies(colors: Float64 | None) -> bool:
    return colors is not None and bool(np.ptp(colors, axis=0).any())


def _is_colored(colors: Float64 | None) -> bool:
    """Whether there is more than one even grey, which scanners write as a placeholder."""
    return colors is not None and bool((colors != colors[:1, :1]).any())


def _srgb(element: _Columns) -> Float64 | None:
    """Linear RGB [n, 3] of an element's colours; None if it has none."""
    for names in _COLORS:
        table = _columns(element, names)
        if table is None:
            continue
        table = np.where(np.isfinite(table), table, 1.0)
        first = element[names[0]]
        assert isinstance(first, np.ndarray)
        if first.dtype.kind in "iu":
            wide = first.dtype.itemsize > 1 and float(table.max(initial=0.0)) > 255.0
            table = table / (float(np.iinfo(first.dtype.str).max) if wide else 255.0)
        elif table.max(initial=0.0) > 1.0:
            # Floating-point colours count to 1, but for some exporters' that count to 255.
            table = table / 255.0
        return srgb_decode(np.clip(table, 0.0, 1.0))
    return None
