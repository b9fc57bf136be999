"""Placed meshes of a glTF scene: transforms, instances and skins."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gen_data.assets.readers.gltf_document import Document, get_item, read_accessor
from gen_data.assets.triangle_soup import Float64

MAX_PARTS = 50_000
"""Bound on nodes, and on primitives of all nodes: each takes about 0.1 ms."""
_NAME_MAX = 400
"""Bound on the characters kept of names of nodes."""


@dataclass(frozen=True, eq=False)
class PlacedMesh:
    """A mesh in the scene.

    Attributes:
        matrix: [4, 4] to the scene's frame.
        name: Names of the node's ancestors, the node and the mesh.
        joints: [j, 4, 4]: matrices of the joints of its skin, which take the place of ``matrix``;
            None = not skinned.
        weights: Weights of its morph targets.
    """

    matrix: Float64
    mesh: Mapping[str, Any]
    name: str
    joints: Float64 | None = None
    weights: tuple[float, ...] = ()


def placed_meshes(document: Document) -> list[PlacedMesh]:
    """Meshes of the default scene, in document order.

    Raises:
        ValueError, KeyError: if nodes are missing, form a cycle, or are too many.
    """
    nodes = document.list_of("nodes")
    if len(nodes) > MAX_PARTS:
        raise ValueError(f"{len(nodes)} nodes, at most {MAX_PARTS}; join them")
    matrices: dict[int, Float64] = {}
    found: list[tuple[int, str]] = []
    for index, path, matrix, seen in _walk(document, _roots(document)):
        matrices[index] = matrix
        if seen and "mesh" in nodes[index]:
            found.append((index, path))
    placed: list[PlacedMesh] = []
    for index, path in found:
        node = nodes[index]
        mesh = document.item("meshes", node["mesh"], "mesh")
        name = f"{path}/{str(mesh.get('name', ''))[:_NAME_MAX]}"
        weights = tuple(float(w) for w in node.get("weights", mesh.get("weights", ())))
        joints = None
        if "skin" in node:
            skin = document.item("skins", node["skin"], "skin")
            joints = _joint_matrices(document, skin, matrices)
        for matrix in _instances(document, node):
            whole = _product(matrices[index], matrix)
            placed.append(PlacedMesh(whole, mesh, name, joints, weights))
            if len(placed) > MAX_PARTS:
                raise ValueError(f"more than {MAX_PARTS} instances; join them")
    return placed


def _roots(document: Document) -> list[int]:
    """Root nodes of the default scene or, without scenes, all nodes without a parent."""
    scenes = document.list_of("scenes")
    if scenes:
        if len(scenes) > 1:
            document.remarks.append(f"{len(scenes) - 1} further scenes are not read")
        return list(get_item(scenes, document.tree.get("scene", 0), "scene").get("nodes", []))
    nodes = document.list_of("nodes")
    children = {c for node in nodes for c in node.get("children", [])}
    return [k for k in range(len(nodes)) if k not in children]


def _walk(document: Document, roots: list[int]) -> Iterator[tuple[int, str, Float64, bool]]:
    """Yield index, path, matrix to the scene, and visibility of all nodes, depth first."""
    nodes = document.list_of("nodes")
    visited: set[int] = set()
    pending = [(index, np.eye(4), "", True) for index in reversed(roots)]
    while pending:
        index, parent, path, seen = pending.pop()
        node = get_item(nodes, index, "node")
        if index in visited:
            raise ValueError(f"node {index} has two parents or is its own ancestor")
        visited.add(index)
        matrix = _product(parent, _local_matrix(node))
        path = f"{path}/{str(node.get('name', ''))[:_NAME_MAX]}"[-_NAME_MAX:]
        shown = node.get("extensions", {}).get("KHR_node_visibility", {}).get("visible", True)
        seen = seen and bool(shown)
        yield index, path, matrix, seen
        pending += [(child, matrix, path, seen) for child in reversed(node.get("children", []))]


def _joint_matrices(
    document: Document, skin: Mapping[str, Any], matrices: Mapping[int, Float64]
) -> Float64:
    """Matrices [j, 4, 4] from the mesh's frame, bound to the joints, to the scene's."""
    joints = skin["joints"]
    if not joints:
        raise ValueError("a skin without joints")
    missing = next((joint for joint in joints if joint not in matrices), None)
    if missing is not None:
        raise ValueError(f"joint {missing} of a skin is not in the scene")
    bind = np.broadcast_to(np.eye(4), (len(joints), 4, 4))
    if "inverseBindMatrices" in skin:
        columns = read_accessor(document, skin["inverseBindMatrices"], 16).astype(np.float64)
        if len(columns) < len(joints):
            raise ValueError("a skin with fewer bind matrices than joints")
        bind = columns[: len(joints)].reshape(-1, 4, 4).swapaxes(1, 2)
    world = np.stack([matrices[joint] for joint in joints])
    product: Float64 = np.einsum("nij,njk->nik", world, bind, optimize=False)
    return product


def _instances(document: Document, node: Mapping[str, Any]) -> Iterator[Float64]:
    """Matrices of a node's instances (EXT_mesh_gpu_instancing); without any, the identity."""
    extension = node.get("extensions", {}).get("EXT_mesh_gpu_instancing")
    if extension is None:
        yield np.eye(4)
        return
    widths = {"TRANSLATION": 3, "ROTATION": 4, "SCALE": 3}
    values = {
        key.lower(): read_accessor(document, extension["attributes"][key], width)
        for key, width in widths.items()
        if key in extension["attributes"]
    }
    for k in range(min((len(rows) for rows in values.values()), default=1)):
        yield _local_matrix({key: rows[k].astype(np.float64) for key, rows in values.items()})


def _local_matrix(node: Mapping[str, Any]) -> Float64:
    if "matrix" in node:
        rows: Float64 = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
        return rows
    turn = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64)
    # Exporters round, and some write quaternions of any length.
    x, y, z, w = (turn / (math.sqrt((turn * turn).sum()) or 1.0)).tolist()
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix


def _product(a: Float64, b: Float64) -> Float64:
    product: Float64 = np.einsum("ij,jk->ik", a, b, optimize=False)
    return product
