"""Wavefront OBJ and MTL.

Source: Wavefront Advanced Visualizer manual, appendix B1 (polygonal elements) and MTL 5.0; the
keys ``Pr``, ``Pm``, ``Pc``, ``Pcr`` (roughness, metallic, clear coat and its roughness), ``norm``
and their images are the widespread PBR extension.
"""

import codecs
import math
import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers import mesh_source
from gen_data.assets.texture_maps import TextureMaps
from gen_data.assets.triangle_soup import Float64, Int64, MaterialSlot, TriangleSoup
from gen_data.core import asset_types, colorimetry, errors, polygon_triangles


@dataclass
class _Statements:
    positions: list[str] = field(default_factory=list)
    texcoords: list[str] = field(default_factory=list)
    normals: list[str] = field(default_factory=list)
    others: set[str] = field(default_factory=set)
    corners: list[str] = field(default_factory=list)
    polygon_sizes: list[int] = field(default_factory=list)
    polygon_materials: list[int] = field(default_factory=list)
    polygon_objects: list[int] = field(default_factory=list)
    polygon_groups: list[int] = field(default_factory=list)
    materials: dict[str, int] = field(default_factory=dict)
    libraries: list[str] = field(default_factory=list)
    object_names: list[str] = field(default_factory=lambda: [""])
    group_names: list[str] = field(default_factory=lambda: [""])


def read_obj(folder: Folder, relative: str, materials: bool) -> mesh_source.MeshSource:
    """Read an OBJ file with the materials of its MTL files.

    Polygons become triangles. Each ``o`` (or, where there is none, each ``g``) is a group.
    Numbers after the coordinates of a vertex are its sRGB (MeshLab, MeshMixer, ZBrush).

    Raises:
        AssetError: on malformed numbers, indices out of range, or forbidden references.
    """
    try:
        statements = _parse_statements(decode_text(folder.read(relative)))
        if not materials:
            statements.libraries.clear()
        slots, transforms, remarks = _read_slots(folder, relative, statements)
        soup = _build_soup(statements, slots)
    except ValueError as error:
        raise errors.AssetError(
            f"{folder.root / relative}: malformed OBJ ({error}); export it again"
        ) from None
    if not materials:
        return mesh_source.MeshSource(replace(soup, colors=None))
    soup, more = _color_untextured(_transform_uvs(soup, transforms))
    return mesh_source.MeshSource(soup, {}, (*remarks, *more, *_unread(statements)))


def decode_text(data: bytes) -> str:
    """Text of a file whose encoding is not stated, with line feeds at the ends of its lines.

    It is UTF-8 or, with such a byte order mark, UTF-16; Latin-1 if it is neither.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    text = text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text
    if "\\" in text:
        # A comment may end with the backslash of a path; it continues nothing.
        text = _CONTINUED.sub(" ", _COMMENT.sub("", text))
    return text


_COMMENT = re.compile(r"^[ \t]*#[^\n]*", re.MULTILINE)
_CONTINUED = re.compile(r"\\[ \t]*\n")


def _parse_statements(text: str) -> _Statements:  # noqa: PLR0912  (a branch per statement)
    s = _Statements()
    material = 0
    s.materials[""] = 0
    for line in text.split("\n"):
        words = line.split(None, 1)
        if not words:
            continue
        key, rest = words if len(words) == 2 else (words[0], "")
        if key == "v":
            s.positions.append(rest)
        elif key == "vt":
            s.texcoords.append(rest)
        elif key == "vn":
            s.normals.append(rest)
        elif key == "f":
            tokens = rest.split()
            if "#" in rest:
                tokens = rest.partition("#")[0].split()
            if len(tokens) == 2:
                # A stray edge, as some exporters write.
                continue
            if "-" in rest:
                tokens = [_make_absolute(token, s) for token in tokens]
            s.corners += tokens
            s.polygon_sizes.append(len(tokens))
            s.polygon_materials.append(material)
            s.polygon_objects.append(len(s.object_names) - 1)
            s.polygon_groups.append(len(s.group_names) - 1)
        elif key == "usemtl":
            material = s.materials.setdefault(rest.strip(), len(s.materials))
        elif key == "mtllib":
            s.libraries.append(rest.strip())
        elif key == "o":
            s.object_names.append(rest.strip())
        elif key == "g":
            s.group_names.append(rest.strip())
        else:
            s.others.add(key)
    return s


_UNREAD = {
    "l": "lines", "p": "points", "curv": "curves", "curv2": "curves", "surf": "free-form surfaces",
}  # fmt: skip


def _unread(s: _Statements) -> tuple[str, ...]:
    return tuple(sorted({f"{_UNREAD[key]} are not read" for key in s.others & set(_UNREAD)}))


def _make_absolute(token: str, s: _Statements) -> str:
    """Replace the negative indices of a corner, which count backwards, by positive ones."""
    counts = (len(s.positions), len(s.texcoords), len(s.normals))
    parts = token.split("/")
    for k, (part, count) in enumerate(zip(parts, counts, strict=False)):
        if part.startswith("-"):
            index = int(part) + count + 1
            if index < 1:
                raise ValueError(f"index {part[:20]} out of range")
            parts[k] = str(index)
    return "/".join(parts)


def _build_soup(s: _Statements, slots: tuple[MaterialSlot, ...]) -> TriangleSoup:
    sizes = np.array(s.polygon_sizes, dtype=np.int64)
    if (sizes < 3).any():
        raise ValueError("a face with fewer than three corners")
    if (sizes - 2).sum() > mesh_source.MAX_FACES:
        raise ValueError(f"more than {mesh_source.MAX_FACES} triangles")
    corners = _parse_indices(s.corners)
    positions, colors = _parse_positions(s.positions)
    _check_range(positions, corners[:, 0], "vertex", required=True)
    fans, polygon = polygon_triangles.split_polygons(sizes, positions, corners[:, 0] - 1)
    indices = corners[fans]
    texcoords = _parse_table(s.texcoords, 2, "vt")
    normals = _parse_table(s.normals, 3, "vn")
    groups, names = s.polygon_groups, s.group_names
    if max(s.polygon_objects, default=0):
        groups, names = s.polygon_objects, s.object_names
    return TriangleSoup(
        corners=positions[indices[..., 0] - 1],
        uvs=_look_up(texcoords, indices[..., 1], "vt") if len(texcoords) else None,
        normals=_look_up(normals, indices[..., 2], "vn") if len(normals) else None,
        face_slots=np.array(s.polygon_materials, dtype=np.int64)[polygon],
        face_groups=np.array(groups, dtype=np.int64)[polygon],
        slots=slots,
        group_names=tuple(names),
        colors=None if colors is None else colors[indices[..., 0] - 1],
    )


def _parse_positions(lines: list[str]) -> tuple[Float64, Float64 | None]:
    """Coordinates [n, 3], and linear RGB [n, 3] if any vertex has a colour; others are white."""
    rows = [line.split() for line in lines]
    if any("#" in line for line in lines):
        rows = [line.partition("#")[0].split() for line in lines]
    if any(len(row) < 3 for row in rows):
        raise ValueError("a 'v' with too few numbers")
    table = np.array([float(x) for row in rows for x in row[:3]], dtype=np.float64)
    # Four numbers are x, y, z and a weight.
    colored = [k for k, row in enumerate(rows) if len(row) >= 6]
    if not colored:
        return table.reshape(-1, 3), None
    srgb = np.array([[float(x) for x in rows[k][3:6]] for k in colored], dtype=np.float64)
    srgb = np.where(np.isfinite(srgb), srgb, 1.0)
    if srgb.max() > 1.0:
        # Some exporters count to 255.
        srgb = srgb / 255.0
    colors = np.ones((len(rows), 3))
    colors[colored] = colorimetry.srgb_decode(np.clip(srgb, 0.0, 1.0))
    return table.reshape(-1, 3), colors


def _color_untextured(soup: TriangleSoup) -> tuple[TriangleSoup, tuple[str, ...]]:
    """Keep vertex colours where no image is; they replace the grey of undefined materials."""
    if soup.colors is None:
        return soup, ()
    textured = np.array([bool(slot.material.texture) for slot in soup.slots])[soup.face_slots]
    slots = tuple(
        slot if slot.from_file else replace(slot, material=mesh_source.WHITE, missing="")
        for slot in soup.slots
    )
    colors = np.where(textured[:, None, None], 1.0, soup.colors)
    remarks = ("vertex colours are not used where an image is",) if textured.any() else ()
    return replace(soup, colors=colors, slots=slots), remarks


def _transform_uvs(soup: TriangleSoup, transforms: "Mapping[int, UvTransform]") -> TriangleSoup:
    """Apply scale and offset of each slot's image to its texture coordinates."""
    if soup.uvs is None or not transforms:
        return soup
    uvs = soup.uvs.copy()
    for number, (scale, offset) in transforms.items():
        chosen = soup.face_slots == number
        uvs[chosen] = uvs[chosen] * scale + offset
    return replace(soup, uvs=uvs)


def _parse_indices(tokens: list[str]) -> Int64:
    """Parse ``v/vt/vn`` tokens to index triples [n, 3]; 0 where a part is absent."""
    rows = [(token + "//").split("/", 3)[:3] for token in tokens]
    flat = [int(part) if part else 0 for row in rows for part in row]
    if flat and max(flat) >= 2**31:
        raise ValueError("index out of range")
    return np.array(flat, dtype=np.int64).reshape(-1, 3)


def _parse_table(lines: list[str], width: int, name: str) -> Float64:
    """Parse the numbers [n, width] of one kind of statement; extra numbers are ignored."""
    rows = [line.split(None, width)[:width] for line in lines]
    if any(len(row) < min(width, 2) for row in rows):
        raise ValueError(f"a '{name}' with too few numbers")
    table = np.array([float(x) for row in rows for x in row], dtype=np.float64)
    if table.size != len(rows) * width:
        raise ValueError(f"a '{name}' with too few numbers")
    return table.reshape(-1, width)


def _check_range(table: Float64, indices: Int64, name: str, *, required: bool = False) -> None:
    if (indices < 0).any() or (indices > len(table)).any() or (required and (indices < 1).any()):
        raise ValueError(f"a face with a {name} index out of range 1..{len(table)}")


def _look_up(table: Float64, indices: Int64, name: str) -> Float64:
    _check_range(table, indices, name)
    # Index 0 means absent and selects the row of zeros prepended here.
    looked_up: Float64 = np.concatenate([np.zeros((1, table.shape[1])), table])[indices]
    return looked_up


def _read_slots(
    folder: Folder, relative: str, s: _Statements
) -> "tuple[tuple[MaterialSlot, ...], dict[int, UvTransform], tuple[str, ...]]":
    """Materials by number, how their images are placed, and remarks."""
    defined: dict[str, _Definition] = {}
    remarks: list[str] = []
    missing, found = "", list[str]()
    for library in s.libraries:
        for path in _library_files(folder, relative, library):
            if folder.exists(path):
                found.append(PurePosixPath(path).name)
                defined |= _read_mtl(folder, path, remarks)
            else:
                missing = path
    composed = {_compose(name): name for name in reversed(defined)}
    used, slots = set(s.polygon_materials), list[MaterialSlot]()
    transforms: dict[int, UvTransform] = {}
    for number, name in enumerate(s.materials):
        known = name if name in defined else composed.get(_compose(name), "")
        if known:
            material = defined[known].build_material()
            tint = material.base_color
            slots.append(
                MaterialSlot(name, _drop_tint(material), from_file=True, declared_color=tint)
            )
            if defined[known].placement != _UNPLACED:
                transforms[number] = defined[known].placement
            if known != name:
                remarks.append(f"material '{name}' is not defined; '{known}' is used instead")
            continue
        reason = ""
        if number in used and name.casefold() not in _NO_MATERIAL:
            reason = _why_missing(name, missing, found, defined)
            if not reason:
                remarks.append(f"material '{name}' is not defined: no mtllib is given")
        slots.append(MaterialSlot(name, missing=reason))
    if used and all(slots[k].material.opacity == 0.0 for k in used):
        # Some exporters write the transparency where the opacity belongs.
        slots = [replace(x, material=replace(x.material, opacity=1.0)) for x in slots]
        remarks.append("all its materials are fully transparent (d 0); they are read as opaque")
    return tuple(slots), transforms, tuple(dict.fromkeys(remarks))


def _why_missing(name: str, missing: str, found: list[str], defined: Iterable[str]) -> str:
    """Why a material is not defined; empty if the file names no library."""
    if missing:
        return f"belongs to the missing file {missing}"
    if not found:
        return ""
    return f"is not defined in {', '.join(found)}{errors.did_you_mean(name, defined)}"


_NO_MATERIAL = frozenset({"", "none", "(null)", "null"})
"""Names that exporters give to faces without a material."""


def _compose(name: str) -> str:
    """A name without the form of its accents, which file systems and editors change."""
    return unicodedata.normalize("NFC", name)


def _library_files(folder: Folder, relative: str, names: str) -> tuple[str, ...]:
    """Paths of an ``mtllib`` statement: one name, which may hold spaces, or several."""
    whole = mesh_source.locate_file(folder, relative, names)
    parts = names.split()
    if folder.exists(whole) or len(parts) < 2:
        return (whole,)
    paths = tuple(mesh_source.locate_file(folder, relative, part) for part in parts)
    return paths if any(folder.exists(path) for path in paths) else (whole,)


def obj_references(data: bytes) -> tuple[str, ...]:
    """Names of the MTL files of an OBJ file, also the parts of names with spaces."""
    names = [n.decode("utf-8", "surrogateescape").strip() for n in _MTLLIB.findall(data)]
    return tuple(dict.fromkeys([*names, *(part for name in names for part in name.split())]))


def mtl_references(data: bytes) -> tuple[str, ...]:
    """Names of the images of an MTL file."""
    lines = (line.split(None, 1) for line in decode_text(data).split("\n"))
    return tuple(_image_name(x[1])[0] for x in lines if len(x) == 2 and _is_image_key(x[0].lower()))


# Matches the rest of its line as a whole: splitting it in the pattern takes quadratic time.
_MTLLIB = re.compile(rb"^(?:\xef\xbb\xbf)?[ \t]*mtllib[ \t]([^\n\r]*)", re.MULTILINE)


def _is_image_key(key: str) -> bool:
    return key.startswith("map_") or key in (*_IMAGES, *_UNUSED_IMAGES)


UvTransform = tuple[tuple[float, float], tuple[float, float]]
"""Scale and offset of texture coordinates."""
_UNPLACED: UvTransform = ((1.0, 1.0), (0.0, 0.0))


@dataclass
class _Definition:
    material: asset_types.Material = field(default_factory=asset_types.Material)
    maps: TextureMaps = field(default_factory=TextureMaps)
    dissolved: bool = False
    placement: UvTransform = _UNPLACED

    def build_material(self) -> asset_types.Material:
        maps = self.maps
        if maps.alpha:
            # The coverage is in the alpha channel if colour and coverage share an image.
            own = maps.alpha == maps.albedo
            maps = replace(maps, alpha=f"{maps.alpha}!{3 if own else 0}")
        return replace(self.material, texture=maps.name())


def _read_mtl(folder: Folder, relative: str, remarks: list[str]) -> dict[str, _Definition]:
    """Definitions by name; their unused contents are added to the remarks."""
    definitions: dict[str, _Definition] = {}
    name = ""
    for line in decode_text(folder.read(relative)).split("\n"):
        words = line.split(None, 1)
        if not words:
            continue
        # Exporters write some keys in lower case.
        key, rest = words[0].lower(), words[1].strip() if len(words) == 2 else ""
        if key == "newmtl":
            name = rest
            definitions[name] = _Definition()
        elif name in definitions and key in _UNUSED_IMAGES:
            remarks.append(f"material '{name}': {words[0]} ({_UNUSED_IMAGES[key]}) is not used")
        elif name in definitions and (key in _NUMBERS or key in _IMAGES):
            try:
                _apply_statement(definitions[name], words[0], rest, folder, relative, remarks)
            except (ValueError, IndexError) as error:
                reason = f" ({error})" if str(error).startswith(f"{words[0]} is") else ""
                raise errors.AssetError(
                    f"{folder.root / relative}: material '{name}': malformed '{words[0]}'{reason}; "
                    "export it again"
                ) from None
    return definitions


_NUMBERS = frozenset({"kd", "ke", "ns", "ni", "pr", "pm", "pc", "pcr", "d", "tr"})
_IMAGES = {
    "map_kd": "albedo",
    "map_ke": "emission",
    "map_d": "alpha",
    "map_pr": "roughness",
    "map_pm": "metallic",
    "norm": "normal",
}
_UNUSED_IMAGES = {
    "map_ks": "an image of specular colours",
    "map_ns": "an image of exponents",
    "map_bump": "a height image",
    "bump": "a height image",
    "disp": "a displacement image",
    "decal": "a decal",
    "refl": "a reflection image",
}


def _apply_statement(
    known: _Definition, word: str, rest: str, folder: Folder, relative: str, remarks: list[str]
) -> None:
    """Apply one statement. Raises ValueError or IndexError if it is malformed."""
    key = word.lower()
    if key in _IMAGES:
        name, placement = _image_name(rest)
        path = mesh_source.locate_file(folder, relative, name, remarks)
        image: dict[str, Any] = {_IMAGES[key]: path}
        known.maps = replace(known.maps, **image)
        if key == "map_kd":
            known.placement = placement
        elif placement not in (_UNPLACED, known.placement):
            remarks.append(f"{key} '{name}': its own scale and offset are not used")
        return
    numbers = [float(x) for x in rest.partition("#")[0].split()]
    if key == "kd":
        red, green, blue = (numbers * 3)[:3]
        color = mesh_source.srgb_to_linear((red, green, blue))
        known.material = replace(known.material, base_color=color)
    elif key == "ke":
        red, green, blue = (mesh_source.clamp_min(0.0, c, word) for c in (numbers * 3)[:3])
        known.material = replace(known.material, emission_cd_m2=(red, green, blue))
    elif key == "ns":
        if numbers[0] > 0.0:
            roughness = mesh_source.shininess_to_roughness(numbers[0])
            known.material = replace(known.material, roughness=roughness)
    elif key == "ni":
        # Exporters write values below 1 for an unknown index.
        known.material = replace(known.material, ior=numbers[0] if numbers[0] > 1.0 else 1.5)
    elif key in ("d", "tr"):
        _set_opacity(known, word, numbers[-1])
    else:
        names = {"pr": "roughness", "pm": "metallic", "pc": "coat", "pcr": "coat_roughness"}
        share: dict[str, Any] = {names[key]: mesh_source.fraction(numbers[0], word)}
        known.material = replace(known.material, **share)


def _set_opacity(known: _Definition, word: str, number: float) -> None:
    """Set opacity from ``d`` or, without one, from its complement ``Tr``.

    ``Tr 1`` is read as opaque, because some exporters swap the two (MeshLab).
    """
    key = word.lower()
    opacity = (
        mesh_source.fraction(number, word)
        if key == "d"
        else 1.0 - mesh_source.fraction(number, word)
    )
    if key == "d" or not known.dissolved:
        opacity = 1.0 if key == "tr" and opacity == 0.0 else opacity
        known.material = replace(known.material, opacity=opacity)
    known.dissolved = known.dissolved or key == "d"


def _image_name(rest: str) -> tuple[str, UvTransform]:
    """File of a ``map_`` statement, after its options (a word and numbers each), and its placement.

    ``-s`` multiplies texture coordinates and ``-o`` is added, as in Blender and three.js.
    """
    tokens = rest.split()
    options: dict[str, list[float]] = {}
    while len(tokens) > 1 and tokens[0].startswith("-"):
        option = tokens.pop(0)
        values = options.setdefault(option, [])
        # The last word is the file, though it may look like a number.
        while len(tokens) > 1 and (_is_number(tokens[0]) or tokens[0] in ("on", "off")):
            word = tokens.pop(0)
            values += [float(word)] if _is_number(word) else []
    scale = ([*options.get("-s", ()), 1.0, 1.0])[:2]
    offset = ([*options.get("-o", ()), 0.0, 0.0])[:2]
    name = " ".join(tokens).replace("\\", "/")
    name = name if "://" in name else str(PurePosixPath(name))
    return name, ((scale[0], scale[1]), (offset[0], offset[1]))


def _is_number(token: str) -> bool:
    try:
        return math.isfinite(float(token))
    except ValueError:
        return False


def _drop_tint(material: asset_types.Material) -> asset_types.Material:
    """Make a textured material white: exporters write arbitrary greys next to an image."""
    return replace(material, base_color=(1.0, 1.0, 1.0)) if material.texture else material
