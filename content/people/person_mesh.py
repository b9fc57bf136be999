"""Meshes of people: shaped, dressed, posed, with all they carry, and placed on the ground."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from gen_data.assets import family, paths
from gen_data.config.data_files import load_table
from gen_data.content.people import analytic_body, posing
from gen_data.content.people.body import FILE, LANDMARKS, Array, BodyTemplate, Indices, load
from gen_data.content.people.carried_things import STRAPPED, Carrier, Sheet, make_things
from gen_data.content.people.clothes import displace_layer, layers
from gen_data.content.people.garment_layout import lay_out
from gen_data.content.people.layer import Layer
from gen_data.content.people.person import Person, draw_person
from gen_data.content.procedural.collision_hulls import extreme
from gen_data.core.asset_types import ConvexParts, Float32, Keypoint, Material, MeshData
from gen_data.core.variant_rng import VariantRng, variant_rng

_GRID_M = 1e-5
"""Grid of the vertices [m]: the last bits of sines must not reach the mesh."""
_NARROW_STRIDE = 0.7
"""Factor on the stride under a long skirt."""
_HULL_POINTS = 40

KEYPOINTS = load_table(__package__, "keypoints", tuple[str, float])


@dataclass(frozen=True, eq=False, slots=True)
class _Piece:
    """Skin, a garment or hair before any pose.

    Attributes:
        used: Points of the body that its vertices move with, [n].
        vertices_m, faces, slots, materials: As of a sheet.
        corners: Vertex that each corner shows, [k]; a vertex has one per field of its texture.
        corner_faces: Triangles of corners, [m, 3].
        uvs: Texture coordinates of the corners, [k, 2].
    """

    used: Indices
    vertices_m: Array
    faces: Indices
    slots: Indices
    materials: tuple[Material, ...]
    corners: Indices
    corner_faces: Indices
    uvs: Float32


@dataclass(frozen=True, eq=False, slots=True)
class Figure:
    """A shaped and dressed person before any pose; shared by all poses.

    Attributes:
        body: The template.
        points_m: The template's points in the person's shape, [n, 3].
        scale: From the template's size to the person's.
        pieces: From the skin outwards.
    """

    body: BodyTemplate
    points_m: Array
    scale: float
    pieces: tuple[_Piece, ...]


def dress_person(person: Person, body: BodyTemplate) -> Figure:
    """A person's figure, whatever their pose."""
    points = body.shaped(person.figure)
    scale = person.height_m / float(
        points[body.landmark("crown"), 2] - points[body.landmark("sole"), 2]
    )
    points *= scale
    rng = variant_rng("person/folds", person.seed)
    made = []
    for layer in layers(person):
        made.append(_make_piece(body, layer, points, rng))
    return Figure(body, points, scale, tuple(made))


def _make_piece(body: BodyTemplate, layer: Layer, points: Array, rng: VariantRng) -> _Piece:
    sheet = displace_layer(body, layer, points, rng)
    zones, materials = zip(*layer.zones, strict=True)
    corners, corner_faces = np.arange(len(sheet.used)), sheet.faces
    uvs = np.zeros((len(sheet.used), 2))
    if layer.layout:
        uvs = layer.layout(sheet.template_m)
    elif layer.mapped:
        corners, corner_faces, uvs = lay_out(sheet.template_m, sheet.faces, zones, sheet.slots)
    rounded = np.round(uvs, 5).astype(np.float32)
    return _Piece(
        sheet.used, sheet.places_m, sheet.faces, sheet.slots, materials, corners, corner_faces,
        rounded,
    )  # fmt: skip


def build_person(person: Person, figure: Figure) -> family.Solid:
    """The mesh of a person; the origin is on the ground between the feet, +X is ahead."""
    body, points, scale = figure.body, figure.points_m, figure.scale
    bones = len(body.bones)
    rotations = posing.bone_rotations(body, points[:bones], _stance(person))
    transforms = posing.bone_transforms(body, points[:bones], rotations)
    sheets = [_pose_piece(piece, body, transforms) for piece in figure.pieces]
    marks = slice(0, bones + len(LANDMARKS))
    posed = posing.skin_points(
        points[marks], body.weight_bones[marks], body.weights[marks], transforms
    )
    surface = _surface(figure, sheets) if person.outfit.bag in STRAPPED else _NO_SURFACE
    ground_m = min(float(sheet.vertices_m[:, 2].min()) for sheet in sheets)
    sheets += make_things(Carrier(person, body, posed, transforms, scale, ground_m, surface))
    mesh, shift = _join_on_ground(sheets, body, posed)
    keypoints = tuple(
        Keypoint(name, _vec(posed[_index(body, mark)] + shift), round(radius * scale, 4))
        for name, (mark, radius) in KEYPOINTS.items()
    )
    hull = extreme(mesh.vertices_m.astype(np.float64), _HULL_POINTS)
    return family.Solid(mesh, ConvexParts((hull,)), keypoints)


_NO_SURFACE = (np.zeros((0, 3)),) * 3


def _surface(figure: Figure, sheets: list[Sheet]) -> tuple[Array, Array, Array]:
    """Garment vertices in the template frame and in the pose [m], and their normals."""
    template, posed, normals = [], [], []
    for piece, sheet in zip(figure.pieces, sheets, strict=True):
        if piece.materials[0].role == "top":
            template.append(figure.body.points_m[piece.used][piece.corners])
            posed.append(sheet.vertices_m)
            normals.append(sheet.normals)
    return np.concatenate(template), np.concatenate(posed), np.concatenate(normals)


def _stance(person: Person) -> posing.Stance:
    made = posing.stance(person.pose, person.step)
    outfit = person.outfit
    narrow = outfit.skirt_zones > 1 and (outfit.bottom in ("skirt", "none") or outfit.top == "coat")
    return (
        posing.shorten_stride(made, _NARROW_STRIDE)
        if narrow and posing.BEHAVIOURS[person.pose] != "sitting"
        else made
    )


def _pose_piece(piece: _Piece, body: BodyTemplate, transforms: Array) -> Sheet:
    bones = body.weight_bones.take(piece.used, axis=0)
    weights = body.weights.take(piece.used, axis=0)
    moved = posing.skin_points(piece.vertices_m, bones, weights, transforms)
    normals = posing.vertex_normals(moved, piece.faces)
    # Normals come from the whole surface: fields of the texture must not show in its shading.
    return Sheet(
        moved.take(piece.corners, axis=0),
        normals.take(piece.corners, axis=0),
        piece.corner_faces,
        piece.slots,
        piece.materials,
        piece.uvs,
    )


def _join_on_ground(
    sheets: list[Sheet], body: BodyTemplate, posed: Array
) -> tuple[MeshData, Array]:
    """Join the sheets into one mesh whose lowest vertex has z = 0; also return its shift [m]."""
    vertices = np.concatenate([sheet.vertices_m for sheet in sheets])
    # Between the ankles lies the origin: a stride reaches as far ahead as behind.
    middle = 0.5 * (posed[body.bone("foot_l")] + posed[body.bone("foot_r")])
    shift = np.array([-middle[0], -middle[1], -vertices[:, 2].min()])
    counts = np.cumsum([0, *(len(sheet.vertices_m) for sheet in sheets)])
    first_slots = np.cumsum([0, *(len(sheet.materials) for sheet in sheets)])
    faces = [sheet.faces + first for sheet, first in zip(sheets, counts[:-1], strict=True)]
    slots = [sheet.slots + first for sheet, first in zip(sheets, first_slots[:-1], strict=True)]
    normals = np.concatenate([sheet.normals for sheet in sheets])
    return (
        MeshData(
            vertices_m=(np.rint((vertices + shift) / _GRID_M) * _GRID_M + 0.0).astype(np.float32),
            faces=np.concatenate(faces).astype(np.int32),
            normals=(np.round(normals, 5) + 0.0).astype(np.float32),
            uvs=np.concatenate([_uvs(sheet) for sheet in sheets]),
            face_slots=np.concatenate(slots).astype(np.int32),
            materials=tuple(material for sheet in sheets for material in sheet.materials),
        ),
        shift,
    )


def _uvs(sheet: Sheet) -> Float32:
    if sheet.uvs is None:
        return np.zeros((len(sheet.vertices_m), 2), np.float32)
    return sheet.uvs


def _index(body: BodyTemplate, mark: str) -> int:
    return body.landmark(mark) if mark in LANDMARKS else body.bone(mark)


def _vec(values: Array) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 5) + 0.0 for v in values)
    return (x, y, z)


_FIGURES = 64
"""Kept in memory: as many as one scene shows, half a megabyte each."""


def pack_file() -> Path:
    """Path of the people pack's body; the file exists only if the pack is installed."""
    return paths.packs_dir() / "people" / FILE


def person(seed: int, pose: str, phase: float) -> family.Solid:
    """A person from the pack. Raises AssetError if the pack cannot be read."""
    return build_person(draw_person(seed, pose, phase), _figure(seed, str(pack_file())))


def simple_person(seed: int, pose: str, phase: float) -> family.Solid:
    """A person from formulas."""
    return build_person(draw_person(seed, pose, phase), _figure(seed, ""))


@lru_cache(maxsize=_FIGURES)
def _figure(seed: int, path: str) -> Figure:
    """Figure of a seed; someone who walks takes many poses in the same figure."""
    return dress_person(draw_person(seed), _body(path) if path else analytic_body.simple_body())


@lru_cache(maxsize=2)
def _body(path: str) -> BodyTemplate:
    return load(Path(path))
