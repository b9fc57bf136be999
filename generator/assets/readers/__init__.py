"""Readers of mesh files, one per format; all return triangle soup."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import PurePosixPath

from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers.dae import read_dae
from gen_data.assets.readers.gltf import read_gltf
from gen_data.assets.readers.mesh_source import MeshSource, check_face_count
from gen_data.assets.readers.obj import read_obj
from gen_data.assets.readers.ply import read_ply
from gen_data.assets.readers.step import read_step
from gen_data.assets.readers.stl import read_stl
from gen_data.assets.readers.threemf import read_3mf
from gen_data.assets.readers.usd import read_usd
from gen_data.assets.triangle_soup import without_degenerate
from gen_data.core.errors import AssetError, did_you_mean

__all__ = ["MESH_SUFFIXES", "MeshSource", "read_mesh"]

_READERS: dict[str, Callable[[Folder, str, bool], MeshSource]] = {
    ".dae": read_dae,
    **dict.fromkeys((".glb", ".gltf"), read_gltf),
    ".obj": read_obj,
    ".ply": read_ply,
    ".stl": read_stl,
    ".3mf": read_3mf,
    **dict.fromkeys((".step", ".stp"), read_step),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), read_usd),
}
MESH_SUFFIXES = frozenset(_READERS)


def read_mesh(folder: Folder, relative: str, *, materials: bool = True) -> MeshSource:
    """Read a mesh file with the reader for its suffix.

    Args:
        folder: Folder of the file.
        relative: Its path in the folder.
        materials: Whether to read materials, too.

    Raises:
        AssetError: if the file is missing, malformed, empty, or too large.
    """
    path = folder.root / relative
    suffix = PurePosixPath(relative).suffix.lower()
    if suffix not in _READERS:
        raise AssetError(
            f"{path}: meshes of type '{suffix}' are not supported{did_you_mean(suffix, _READERS)}; "
            f"convert it to one of {', '.join(sorted(_READERS))}"
        )
    source = _READERS[suffix](folder, relative, materials)
    if not len(source.soup):
        raise AssetError(f"{path}: holds no triangles; export it again with its faces")
    check_face_count(len(source.soup), str(path))
    return replace(source, soup=without_degenerate(source.soup))
