"""STEP (ISO 10303-21), meshed by OpenCASCADE through the package cascadio; in metres, Z up."""

import os

from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers.gltf import read_gltf_bytes
from gen_data.assets.readers.mesh_source import MeshSource
from gen_data.core.errors import AssetError
from gen_data.core.optional_packages import missing_packages
from gen_data.core.temporary_folders import temporary_folder

_TOLERANCE, _ANGLE_RAD = 0.001, 0.3
"""Largest distance from the surface, as a share of an edge's length, and between normals."""


def read_step(folder: Folder, relative: str, materials: bool) -> MeshSource:
    """Mesh the solids of a STEP file, with their colours.

    Raises:
        AssetError: if the package is not installed, or the file holds no shape.
    """
    place = str(folder.root / relative)
    data = folder.read(relative)
    missing = missing_packages("cascadio")
    if missing:
        raise AssetError(f"{place}: {missing}")
    if b"ISO-10303-21" not in data[:1024]:
        raise AssetError(f"{place}: not a STEP file; export it again")
    import cascadio

    with temporary_folder("step") as scratch:
        source, target = scratch / "shape.step", scratch / "shape.glb"
        source.write_bytes(data)
        failed = cascadio.step_to_glb(
            os.fspath(source),
            os.fspath(target),
            tol_linear=_TOLERANCE,
            tol_angular=_ANGLE_RAD,
            tol_relative=True,
            use_parallel=False,
        )
        if failed or not target.is_file():
            raise AssetError(f"{place}: holds no shape that can be meshed; export it again")
        return read_gltf_bytes(folder, relative, target.read_bytes(), materials)
