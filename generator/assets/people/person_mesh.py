"""Meshes of people: shaped, dressed, posed and placed on the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gen_data.generator.assets.people import props
from gen_data.generator.assets.people.animation import Stance, shorten_stride, stance
from gen_data.generator.assets.people.body import LANDMARKS, Array, BodyTemplate, Indices
from gen_data.generator.assets.people.bone_rotations import bone_rotations
from gen_data.generator.assets.people.clothes import displace_layer, layers
from gen_data.generator.assets.people.person import Person
from gen_data.generator.assets.people.skinning import bone_transforms, skin_points, vertex_normals
from gen_data.generator.assets.procedural.collision_hulls import extreme
from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.variant_rng import variant_rng
from gen_data.generator.core.asset_types import ConvexParts, Keypoint, Material, MeshData

_GRID_M = 1e-5
"""Vertices lie on this grid, so that the last bits of sines do not reach the mesh."""
_PHASES = 7
_NARROW_STRIDE = 0.7
"""What a long skirt leaves of a stride."""
_HULL_POINTS = 40

KEYPOINTS = load_table(__package__, "keypoints", tuple[str, float])


@dataclass(frozen=True, eq=False, slots=True)
class _Sheet:
    """A finished piece of surface."""

    vertices_m: Array
    normals: Array
    faces: Indices
    slots: Indices
    materials: tuple[Material, ...]


@dataclass(frozen=True, eq=False, slots=True)
class _Piece:
    """Skin, a garment or hair before any pose.

    Attributes:
        used: Points of the body that its vertices move with, [n].
        vertices_m, faces, slots, materials: As of a sheet.
    """

    used: Indices
    vertices_m: Array
    faces: Indices
    slots: Indices
    materials: tuple[Material, ...]


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
        phases = 2.0 * math.pi * np.array([rng.random() for _ in range(_PHASES)])
        materials = tuple(material for _, material in layer.zones)
        made.append(_Piece(*displace_layer(body, layer, points, phases), materials))
    return Figure(body, points, scale, tuple(made))


def build_person(person: Person, figure: Figure) -> Solid:
    """The mesh of a person; the origin is on the ground between the feet, +X is ahead."""
    body, points, scale = figure.body, figure.points_m, figure.scale
    bones = len(body.bones)
    rotations = bone_rotations(body, points[:bones], _stance(person))
    transforms = bone_transforms(body, points[:bones], rotations)
    sheets = [_pose_piece(piece, body, transforms) for piece in figure.pieces]
    marks = slice(0, bones + len(LANDMARKS))
    posed = skin_points(points[marks], body.weight_bones[marks], body.weights[marks], transforms)
    sheets += [
        _Sheet(prop.vertices_m, prop.normals, prop.faces, prop.slots, prop.materials)
        for prop in props.make_props(person, body, posed, transforms, scale)
    ]
    mesh, shift = _join_on_ground(sheets, body, posed)
    keypoints = tuple(
        Keypoint(name, _vec(posed[_index(body, mark)] + shift), round(radius * scale, 4))
        for name, (mark, radius) in KEYPOINTS.items()
    )
    hull = extreme(mesh.vertices_m.astype(np.float64), _HULL_POINTS)
    return Solid(mesh, ConvexParts((hull,)), keypoints)


def _stance(person: Person) -> Stance:
    made = stance(person.pose, person.step)
    outfit = person.outfit
    narrow = outfit.skirt_zones > 1 and (outfit.bottom in ("skirt", "none") or outfit.top == "coat")
    return shorten_stride(made, _NARROW_STRIDE) if narrow and person.pose != "sit" else made


def _pose_piece(piece: _Piece, body: BodyTemplate, transforms: Array) -> _Sheet:
    bones, weights = body.weight_bones[piece.used], body.weights[piece.used]
    moved = skin_points(piece.vertices_m, bones, weights, transforms)
    normals = vertex_normals(moved, piece.faces)
    return _Sheet(moved, normals, piece.faces, piece.slots, piece.materials)


def _join_on_ground(
    sheets: list[_Sheet], body: BodyTemplate, posed: Array
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
    return (
        MeshData(
            vertices_m=(np.rint((vertices + shift) / _GRID_M) * _GRID_M + 0.0).astype(np.float32),
            faces=np.concatenate(faces).astype(np.int32),
            normals=_round_normals(np.concatenate([sheet.normals for sheet in sheets])),
            uvs=np.zeros((len(vertices), 2), np.float32),
            face_slots=np.concatenate(slots).astype(np.int32),
            materials=tuple(material for sheet in sheets for material in sheet.materials),
        ),
        shift,
    )


def _round_normals(normals: Array) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    return (np.round(normals, 5) + 0.0).astype(np.float32)


def _index(body: BodyTemplate, mark: str) -> int:
    return body.landmark(mark) if mark in LANDMARKS else body.bone(mark)


def _vec(values: Array) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 5) + 0.0 for v in values)
    return (x, y, z)
