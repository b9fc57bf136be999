"""STEP (ISO 10303-21), meshed by OpenCASCADE through the package cascadio; in metres, Z up."""

import os

from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers import gltf, mesh_source
from gen_data.core import errors, optional_packages, temporary_folders

_TOLERANCE, _ANGLE_RAD = 0.001, 0.3
"""Largest distance from the surface, as a share of an edge's length, and between normals."""


def read_step(folder: Folder, relative: str, materials: bool) -> mesh_source.MeshSource:
    """Mesh the solids of a STEP file, with their colours.

    Raises:
        AssetError: if the package is not installed, or the file holds no shape.
    """
    place = str(folder.root / relative)
    data = folder.read(relative)
    missing = optional_packages.missing_packages("cascadio")
    if missing:
        raise errors.AssetError(f"{place}: {missing}")
    if b"ISO-10303-21" not in data[:1024]:
        raise errors.AssetError(f"{place}: not a STEP file; export it again")
    import cascadio

    with temporary_folders.temporary_folder("step") as scratch:
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
            raise errors.AssetError(f"{place}: holds no shape that can be meshed; export it again")
        return gltf.read_gltf_bytes(folder, relative, target.read_bytes(), materials)
