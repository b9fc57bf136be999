"""Meshes of rigid objects as files, with their size and symmetries.

A model is the geometry of an instance in millimetres: all its bodies, in an object frame whose axes
are the instance's and whose origin is the centre of the bounding box. Instances with equal bodies,
at equal scales and poses, share a model. An articulated robot has none.

Sources: Turk, "The PLY Polygon File Format", 1994; ``models_info.json`` of Hodan et al., "BOP:
Benchmark for 6D Object Pose Estimation", ECCV 2018.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core import colorimetry, errors, serialization
from gen_data.core.asset_types import Material, MeshData, Symmetry
from gen_data.core.interfaces import AssetLibrary, FileFrames
from gen_data.core.scene import Body, Instance, Scene
from gen_data.core.se3 import IDENTITY, SE3, Array, Vec3
from gen_data.exporters import symmetry_search

MM_PER_M = 1000.0
_SHARES = ((symmetry_search.POINTS, 0.5), (symmetry_search.PROBES, 0.25))

VERTEX = np.dtype(
    [(name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz")]
    + [(name, "u1") for name in ("red", "green", "blue")]
)
TRIANGLE = np.dtype([("count", "u1"), ("vertices", "<i4", (3,))])

SYMMETRIES_MAX = 120
"""Discrete symmetries of one model; the largest group of rotations of a solid has 60."""

SYMMETRY_TOLERANCE = np.full((4, 4), 1e-4)
SYMMETRY_TOLERANCE[:3, 3] = 0.1
"""Difference of two poses that count as equal: of rotations, and of translations [mm]."""


@dataclass(frozen=True, slots=True)
class Piece:
    """One body of a model: its mesh, scale, and pose in the instance frame."""

    asset: str
    scale: float
    T_instance_body: SE3


@dataclass(frozen=True, eq=False, slots=True)
class Model:
    """Geometry in the object frame [mm].

    Attributes:
        center_m: Origin of the object frame in the instance frame [m].
        vertices: ``VERTEX`` [n].
        faces: int32 [m, 3], counter-clockwise outward.
        info: Entry of ``models_info.json``.
    """

    center_m: Vec3
    vertices: NDArray[np.void]
    faces: NDArray[np.int32]
    info: Mapping[str, Any]

    @property
    def nbytes(self) -> int:
        """Bytes of its arrays."""
        return self.vertices.nbytes + self.faces.nbytes


def rigid_pieces(scene: Scene) -> dict[int, tuple[Piece, ...]]:
    """Pieces of every instance with a body, by instance id; without robots, which bend."""
    bodies: dict[int, list[Body]] = {}
    for body in scene.bodies:
        bodies.setdefault(body.instance_id, []).append(body)
    robots = {robot.instance_id for robot in scene.articulations}
    return {
        thing.instance_id: _pieces(thing, bodies[thing.instance_id])
        for thing in scene.instances
        if thing.instance_id in bodies and thing.instance_id not in robots
    }


def model_key(pieces: Sequence[Piece]) -> str:
    """Digest of a geometry; equal for equal pieces."""
    return sha256(serialization.canonical_json(pieces).encode("utf-8")).hexdigest()[:16]


def build_model(pieces: Sequence[Piece], assets: AssetLibrary) -> Model:
    """Join the pieces, move the origin to the centre of the box, and measure the result.

    Raises:
        AssetError: the asset's symmetries are not a finite group.
    """
    parts, faces, count = [], [], 0
    for piece in pieces:
        mesh = assets.mesh(piece.asset)
        vertices, triangles = _split_slots(mesh)
        parts.append(_placed(mesh, vertices, piece, assets))
        faces.append(triangles + count)
        count += len(vertices)
    points_m, normals, colors = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    center_m = 0.5 * (points_m.min(axis=0) + points_m.max(axis=0))
    origin_m = _file_origin_m(pieces, assets)
    if origin_m is not None and not origin_m.any():
        # An asset in the frame of its file keeps it, as ground truth of the same file does.
        center_m = origin_m
    rows: NDArray[np.void] = np.zeros(count, VERTEX)
    for k, axis in enumerate("xyz"):
        rows[axis] = (points_m[:, k] - center_m[k]) * MM_PER_M
        rows[f"n{axis}"] = normals[:, k]
    for k, name in enumerate(("red", "green", "blue")):
        rows[name] = colors[:, k]
    stated = assets.get(pieces[0].asset).symmetries if len(pieces) == 1 else ()
    symmetries = [_scaled(symmetry, pieces[0].scale) for symmetry in stated]
    if not symmetries:
        symmetries += symmetry_search.find_symmetries(
            *(_samples(pieces, assets, *share) for share in _SHARES)
        )
    info = _size_info(rows) | _symmetry_info(symmetries, pieces[0].asset, center_m)
    if origin_m is not None:
        offset_mm = np.round((origin_m - center_m) * MM_PER_M, 6) + 0.0
        info["file_origin_mm"] = offset_mm.tolist()
    x, y, z = (float(value) for value in center_m)
    return Model((x, y, z), rows, np.concatenate(faces).astype(np.int32), info)


def _scaled(symmetry: Symmetry, scale: float) -> Symmetry:
    x, y, z = symmetry.offset_m
    return replace(symmetry, offset_m=(scale * x, scale * y, scale * z))


def _samples(
    pieces: Sequence[Piece], assets: AssetLibrary, count: int, shift: float
) -> symmetry_search.Samples:
    """Points in the instance frame [m] on all pieces, with their colours."""
    meshes = [assets.mesh(piece.asset) for piece in pieces]
    placed = [
        p.T_instance_body.apply(m.vertices_m.astype(np.float64) * p.scale)[m.faces]
        for p, m in zip(pieces, meshes, strict=True)
    ]
    chosen, weights = symmetry_search.sample_triangles(np.concatenate(placed), count, shift)
    points = np.einsum("nk,nkc->nc", weights, np.concatenate(placed)[chosen])
    colors = np.zeros((len(chosen), 3))
    first = 0
    for mesh, corners in zip(meshes, placed, strict=True):
        own = (chosen >= first) & (chosen < first + len(corners))
        faces = chosen[own] - first
        uvs = np.einsum("nk,nkc->nc", weights[own], mesh.uvs[mesh.faces[faces]]).astype(np.float32)
        found = np.zeros((len(faces), 3))
        for slot, material in enumerate(mesh.materials):
            here = mesh.face_slots[faces] == slot
            found[here] = _colors(material, uvs[here], assets)
        colors[own] = found
        first += len(corners)
    return symmetry_search.Samples(points, colors)


def _file_origin_m(pieces: Sequence[Piece], assets: AssetLibrary) -> Array | None:
    """Origin of a user's file in the frame of its only piece, [3]; None for other objects."""
    if len(pieces) != 1 or not isinstance(assets, FileFrames):
        return None
    shift_m = assets.file_shift_m(pieces[0].asset)
    if shift_m is None:
        return None
    placed: Array = pieces[0].T_instance_body.apply(np.array([shift_m]) * pieces[0].scale)[0]
    return placed


def ply_bytes(model: Model) -> bytes:
    """Encode a model as a binary PLY file with normals and colours."""
    types = {"f": "float", "u": "uchar"}
    properties = [f"property {types[VERTEX[n].kind]} {n}" for n in VERTEX.names or ()]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(model.vertices)}",
        *properties,
        f"element face {len(model.faces)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    triangles: NDArray[np.void] = np.zeros(len(model.faces), TRIANGLE)
    triangles["count"], triangles["vertices"] = 3, model.faces
    text = ("\n".join(header) + "\n").encode("ascii")
    return text + model.vertices.tobytes() + triangles.tobytes()


def _pieces(thing: Instance, bodies: Sequence[Body]) -> tuple[Piece, ...]:
    if len(bodies) == 1:
        # The frame of an instance with one body is the body's own.
        return (Piece(bodies[0].asset, bodies[0].scale, IDENTITY),)
    T_instance_world = thing.T_world_instance.inverse()
    return tuple(
        Piece(b.asset, b.scale, (T_instance_world @ b.T_world_body).rounded()) for b in bodies
    )


def _split_slots(mesh: MeshData) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of vertex and material slot [n, 2], and the triangles' indices into them [m, 3]."""
    slots = np.repeat(mesh.face_slots, 3).astype(np.int64)
    width = int(slots.max(initial=0)) + 1
    pairs, indices = np.unique(mesh.faces.reshape(-1) * width + slots, return_inverse=True)
    return np.stack([pairs // width, pairs % width], axis=1), indices.reshape(-1, 3)


def _placed(
    mesh: MeshData, vertices: NDArray[np.int64], piece: Piece, assets: AssetLibrary
) -> tuple[Array, Array, NDArray[np.uint8]]:
    """Positions [m] and normals in the instance frame, and sRGB colours."""
    chosen, slots = vertices.T
    points_m = mesh.vertices_m[chosen].astype(np.float64) * piece.scale
    normals = piece.T_instance_body.rotate(mesh.normals[chosen].astype(np.float64))
    colors = np.zeros((len(chosen), 3), np.uint8)
    for slot, material in enumerate(mesh.materials):
        here = slots == slot
        colors[here] = _colors(material, mesh.uvs[chosen[here]], assets)
    return piece.T_instance_body.apply(points_m), normals, colors


def _colors(material: Material, uvs: NDArray[np.float32], assets: AssetLibrary) -> Array:
    """SRGB colours [n, 3] in [0, 255]: of the texture's nearest pixel, or its mean if projected."""
    linear = np.broadcast_to(np.asarray(material.base_color, np.float64), (len(uvs), 3))
    if material.texture:
        albedo = assets.texture(material.texture).albedo
        if material.texture_scale_m:
            texels = np.broadcast_to(albedo.mean(axis=(0, 1)), (len(uvs), 3))
        else:
            height, width = albedo.shape[:2]
            u, v = uvs.T.astype(np.float64)
            texels = albedo[
                np.floor((1.0 - v) * height).astype(int) % height,
                np.floor(u * width).astype(int) % width,
            ]
        linear = linear * colorimetry.srgb_decode(texels / 255.0)
    return np.rint(255.0 * colorimetry.srgb_encode(np.clip(linear, 0.0, 1.0)))


def _size_info(vertices: NDArray[np.void]) -> dict[str, float]:
    """Bounds, extents and diameter of the written vertices [mm]."""
    points = np.stack([vertices[axis] for axis in "xyz"], axis=1).astype(np.float64)
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    info = {f"min_{axis}": float(low[k]) for k, axis in enumerate("xyz")}
    info |= {f"size_{axis}": float(size[k]) for k, axis in enumerate("xyz")}
    return {"diameter": _diameter(points), **info}


def _diameter(points: Array) -> float:
    """Largest distance between two of the points [n, 3]."""
    from scipy.spatial.distance import cdist

    outer = _hull_points(np.unique(points, axis=0))
    parts = (outer[k : k + 256] for k in range(0, len(outer), 256))
    return max(float(cdist(part, outer).max()) for part in parts)


def _hull_points(points: Array) -> Array:
    """Corners of the convex hull; all points if they lie in a plane."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners: Array = points[ConvexHull(points).vertices]
    except QhullError:
        return points
    return corners


def _symmetry_info(
    symmetries: Sequence[Symmetry], asset: str, center_m: Array
) -> dict[str, list[Any]]:
    """Symmetries in the instance frame [m], in the object frame [mm]; no key without one."""
    continuous, generators = [], []
    for symmetry in symmetries:
        offset = (np.asarray(symmetry.offset_m) - center_m) * MM_PER_M
        if symmetry.fold == 0:
            row = {"axis": list(symmetry.axis), "offset": np.round(offset, 6).tolist()}
            continuous.append(row)
        else:
            generators.append(_turn(symmetry.axis, 2.0 * math.pi / symmetry.fold, offset))
    info: dict[str, list[Any]] = {}
    group = _closure(generators, asset)
    if group:
        info["symmetries_discrete"] = [(np.round(m, 9) + 0.0).ravel().tolist() for m in group]
    if continuous:
        info["symmetries_continuous"] = continuous
    return info


def _turn(axis: Vec3, angle_rad: float, offset: Array) -> Array:
    """Rotation about an axis through a point, [4, 4]."""
    half = 0.5 * angle_rad
    x, y, z = (math.sin(half) * value for value in axis)
    turn = SE3((0.0, 0.0, 0.0), (math.cos(half), x, y, z)).matrix()
    turn[:3, 3] = offset - turn[:3, :3] @ offset
    return turn


def _closure(generators: Sequence[Array], asset: str) -> list[Array]:
    """All products of the generators except the identity, in order of discovery.

    Readers apply each listed matrix once: they do not multiply them.
    """
    found = [np.eye(4)]
    for known in found:
        for generator in generators:
            product = generator @ known
            differences = np.abs(np.stack(found) - product) > SYMMETRY_TOLERANCE
            if differences.any(axis=(1, 2)).all():
                # The list grows while it is read, until no product is new.
                found.append(product)
        if len(found) > SYMMETRIES_MAX:
            raise errors.AssetError(
                f"asset '{asset}': its symmetries generate more than {SYMMETRIES_MAX} poses; "
                "expected axes through one point, at the angles of a prism or a regular solid"
            )
    return found[1:]
