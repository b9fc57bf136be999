"""Wavefront OBJ and MTL.

Source: Wavefront Advanced Visualizer manual, appendix B1 (polygonal elements) and MTL 5.0; the
keys ``Pr``, ``Pm``, ``Pc``, ``Pcr`` (roughness, metallic, clear coat and its roughness), ``norm``
and their images are the widespread PBR extension.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from gen_data.generator.assets.asset_folder import Folder
from gen_data.generator.assets.readers.mesh_source import (
    MAX_FACES,
    MeshSource,
    clamp_min,
    fraction,
    shininess_to_roughness,
    srgb_to_linear,
)
from gen_data.generator.assets.texture_maps import TextureMaps
from gen_data.generator.assets.triangle_soup import Float64, Int64, MaterialSlot, TriangleSoup
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.errors import AssetError


@dataclass
class _Statements:
    """Statements of an OBJ file by kind."""

    positions: list[str] = field(default_factory=list)
    texcoords: list[str] = field(default_factory=list)
    normals: list[str] = field(default_factory=list)
    corners: list[str] = field(default_factory=list)
    polygon_sizes: list[int] = field(default_factory=list)
    polygon_materials: list[int] = field(default_factory=list)
    polygon_objects: list[int] = field(default_factory=list)
    polygon_groups: list[int] = field(default_factory=list)
    materials: dict[str, int] = field(default_factory=dict)
    libraries: list[str] = field(default_factory=list)
    object_names: list[str] = field(default_factory=lambda: [""])
    group_names: list[str] = field(default_factory=lambda: [""])


def read_obj(folder: Folder, relative: str, materials: bool) -> MeshSource:
    """Read an OBJ file with the materials of its MTL files.

    Polygons become triangle fans. Each ``o`` (or, where there is none, each ``g``) is a group.

    Raises:
        AssetError: on malformed numbers, indices out of range, or forbidden references.
    """
    text = folder.read(relative).decode("utf-8", errors="replace").replace("\\\n", " ")
    try:
        statements = _parse_statements(text)
        if not materials:
            statements.libraries.clear()
        soup = _build_soup(statements, _read_slots(folder, relative, statements))
    except ValueError as error:
        raise AssetError(
            f"{folder.root / relative}: malformed OBJ ({error}); export it again"
        ) from None
    return MeshSource(soup)


def _parse_statements(text: str) -> _Statements:
    s = _Statements()
    material = 0
    s.materials[""] = 0
    for line in text.split("\n"):
        key, _, rest = line.strip().partition(" ")
        if key == "v":
            s.positions.append(rest)
        elif key == "vt":
            s.texcoords.append(rest)
        elif key == "vn":
            s.normals.append(rest)
        elif key == "f":
            tokens = rest.split()
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
    return s


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
    if (sizes - 2).sum() > MAX_FACES:
        raise ValueError(f"more than {MAX_FACES} triangles")
    fans = _split_fans(sizes)
    polygon = np.repeat(np.arange(len(sizes)), sizes - 2)
    indices = _parse_indices(s.corners)[fans]
    positions = _parse_table(s.positions, 3, "v")
    texcoords = _parse_table(s.texcoords, 2, "vt")
    normals = _parse_table(s.normals, 3, "vn")
    groups, names = s.polygon_groups, s.group_names
    if max(s.polygon_objects, default=0):
        groups, names = s.polygon_objects, s.object_names
    return TriangleSoup(
        corners=_look_up(positions, indices[..., 0], "vertex", required=True),
        uvs=_look_up(texcoords, indices[..., 1], "vt") if len(texcoords) else None,
        normals=_look_up(normals, indices[..., 2], "vn")
        if len(normals) and (indices[..., 2] > 0).all()
        else None,
        face_slots=np.array(s.polygon_materials, dtype=np.int64)[polygon],
        face_groups=np.array(groups, dtype=np.int64)[polygon],
        slots=slots,
        group_names=tuple(names),
    )


def _split_fans(sizes: Int64) -> Int64:
    """Corner indices [m, 3] of the fan triangles of polygons with the given corner counts."""
    starts = np.cumsum(sizes) - sizes
    counts = sizes - 2
    first = np.repeat(starts, counts)
    step = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.stack([first, first + step + 1, first + step + 2], axis=1)


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


def _look_up(table: Float64, indices: Int64, name: str, *, required: bool = False) -> Float64:
    if (indices < 0).any() or (indices > len(table)).any() or (required and (indices < 1).any()):
        raise ValueError(f"a face with a {name} index out of range 1..{len(table)}")
    # Index 0 means absent and selects the row of zeros prepended here.
    looked_up: Float64 = np.concatenate([np.zeros((1, table.shape[1])), table])[indices]
    return looked_up


def _read_slots(folder: Folder, relative: str, s: _Statements) -> tuple[MaterialSlot, ...]:
    defined: dict[str, Material] = {}
    missing = ""
    for library in s.libraries:
        path = folder.refer(relative, library)
        if folder.exists(path):
            defined |= _read_mtl(folder, path)
        else:
            missing = path
    slots = []
    for name in s.materials:
        slot = MaterialSlot(name, missing_library=missing if name else "")
        if name in defined:
            tint, shown = defined[name].base_color, _drop_tint(defined[name])
            slot = MaterialSlot(name, shown, from_file=True, declared_color=tint)
        slots.append(slot)
    return tuple(slots)


@dataclass
class _Definition:
    """Definition of one material in an MTL file."""

    material: Material = field(default_factory=Material)
    maps: TextureMaps = field(default_factory=TextureMaps)
    dissolved: bool = False

    def build_material(self) -> Material:
        maps = self.maps
        if maps.alpha:
            # The coverage is in the alpha channel if colour and coverage share an image.
            own = maps.alpha == maps.albedo
            maps = replace(maps, alpha=f"{maps.alpha}!{3 if own else 0}")
        return replace(self.material, texture=maps.name())


def _read_mtl(folder: Folder, relative: str) -> dict[str, Material]:
    definitions: dict[str, _Definition] = {}
    name = ""
    for line in folder.read(relative).decode("utf-8", errors="replace").split("\n"):
        key, _, rest = line.strip().partition(" ")
        if key == "newmtl":
            name = rest.strip()
            definitions[name] = _Definition()
        elif name in definitions and (key in _NUMBERS or key in _IMAGES):
            try:
                _apply_statement(
                    definitions[name], key, rest, lambda file: folder.refer(relative, file)
                )
            except (ValueError, IndexError) as error:
                reason = f" ({error})" if str(error).startswith(f"{key} is") else ""
                raise AssetError(
                    f"{folder.root / relative}: material '{name}': malformed '{key}'{reason}; "
                    "export it again"
                ) from None
    return {name: definition.build_material() for name, definition in definitions.items()}


_NUMBERS = frozenset({"Kd", "Ke", "Ns", "Ni", "Pr", "Pm", "Pc", "Pcr", "d", "Tr"})
_IMAGES = {
    "map_Kd": "albedo",
    "map_Ke": "emission",
    "map_d": "alpha",
    "map_Pr": "roughness",
    "map_Pm": "metallic",
    "norm": "normal",
}


def _apply_statement(known: _Definition, key: str, rest: str, refer: Callable[[str], str]) -> None:
    """Apply one statement. Raises ValueError or IndexError if it is malformed."""
    if key in _IMAGES:
        image: dict[str, Any] = {_IMAGES[key]: refer(_image_name(rest))}
        known.maps = replace(known.maps, **image)
        return
    numbers = [float(x) for x in rest.split()]
    if key == "Kd":
        red, green, blue = (numbers * 3)[:3]
        color = srgb_to_linear((red, green, blue))
        known.material = replace(known.material, base_color=color)
    elif key == "Ke":
        red, green, blue = (clamp_min(0.0, c, key) for c in (numbers * 3)[:3])
        known.material = replace(known.material, emission_cd_m2=(red, green, blue))
    elif key == "Ns":
        if numbers[0] > 0.0:
            roughness = shininess_to_roughness(numbers[0])
            known.material = replace(known.material, roughness=roughness)
    elif key == "Ni":
        # Exporters write values below 1 for an unknown index.
        known.material = replace(known.material, ior=numbers[0] if numbers[0] > 1.0 else 1.5)
    elif key in ("d", "Tr"):
        _set_opacity(known, key, numbers[-1])
    else:
        names = {"Pr": "roughness", "Pm": "metallic", "Pc": "coat", "Pcr": "coat_roughness"}
        share: dict[str, Any] = {names[key]: fraction(numbers[0], key)}
        known.material = replace(known.material, **share)


def _set_opacity(known: _Definition, key: str, number: float) -> None:
    """Set opacity from ``d`` or, without one, from its complement ``Tr``.

    Full transparency is read as opaque, because some exporters swap the two.
    """
    opacity = fraction(number, key) if key == "d" else 1.0 - fraction(number, key)
    if key == "d" or not known.dissolved:
        known.material = replace(known.material, opacity=opacity if opacity > 0.0 else 1.0)
    known.dissolved = known.dissolved or key == "d"


def _image_name(rest: str) -> str:
    """File of a ``map_`` statement, after its options (a word and numbers each)."""
    tokens = rest.split()
    while len(tokens) > 1 and tokens[0].startswith("-"):
        tokens.pop(0)
        while len(tokens) > 1 and (_is_number(tokens[0]) or tokens[0] in ("on", "off")):
            tokens.pop(0)
    return str(PurePosixPath(" ".join(tokens).replace("\\", "/")))


def _is_number(token: str) -> bool:
    try:
        float(token)
    except ValueError:
        return False
    return True


def _drop_tint(material: Material) -> Material:
    """Make a textured material white: exporters write arbitrary greys beside an image."""
    return replace(material, base_color=(1.0, 1.0, 1.0)) if material.texture else material
