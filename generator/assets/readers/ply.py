"""Stanford PLY, parsed by trimesh after a check of the header."""

from __future__ import annotations

import io
import re
import warnings

import numpy as np

from gen_data.generator.assets.asset_folder import Folder
from gen_data.generator.assets.readers.mesh_source import MeshSource
from gen_data.generator.assets.triangle_soup import TriangleSoup
from gen_data.generator.config.yaml_scalars import abbreviate
from gen_data.generator.core.errors import AssetError

_MAX_HEADER_BYTES = 65536
_ELEMENT = re.compile(rb"^element\s+(\S+)\s+(\S+)\s*$", re.MULTILINE)


def read_ply(folder: Folder, relative: str, _materials: bool) -> MeshSource:
    """Read a PLY file; vertex colours are ignored.

    Raises:
        AssetError: if the header states more elements than the file can hold, or parsing fails.
    """
    data = folder.read(relative)
    path = folder.root / relative
    header, end, _ = data[:_MAX_HEADER_BYTES].partition(b"end_header")
    counts = [count for _, count in _ELEMENT.findall(header.replace(b"\r", b""))]
    if not header.startswith(b"ply") or not end:
        raise AssetError(f"{path}: not a PLY file; export it again")
    # Every element takes at least one byte, so a larger count is false.
    if not all(c.isdigit() and len(c) < 12 and int(c) <= len(data) for c in counts):
        raise AssetError(f"{path}: its header states more elements than it holds; export it again")
    return MeshSource(TriangleSoup.of(_parse_triangles(data, str(path))))


def _parse_triangles(data: bytes, path: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    import trimesh

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh = trimesh.load_mesh(io.BytesIO(data), file_type="ply", process=False)
            vertices = np.asarray(mesh.vertices, dtype=np.float64)
            faces = np.asarray(mesh.faces, dtype=np.int64)
    except Exception as error:
        raise AssetError(f"{path}: malformed PLY ({_reason(error)}); export it again") from None
    if faces.ndim != 2 or len(faces) == 0:
        raise AssetError(f"{path}: holds no triangles; export it again with its faces")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise AssetError(f"{path}: a face with a vertex index out of range; export it again")
    return vertices[faces]


def _reason(error: Exception) -> str:
    """The parser's own words, where they are about the file."""
    if isinstance(error, KeyError):
        return f"unknown type or property {abbreviate(str(error))}"
    if isinstance(error, ValueError):
        return abbreviate(str(error), 80).rstrip("!. ")
    return "an incomplete line in its header"
