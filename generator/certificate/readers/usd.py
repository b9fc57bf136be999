"""OpenUSD stages, read by usd-core."""

from __future__ import annotations

from pathlib import Path

from gen_data.generator.certificate.labelled_images import Loaded
from gen_data.generator.core.interfaces import DatasetInfo


def load_usd(root: Path, info: DatasetInfo) -> Loaded:
    """Open every stage with all its references, which must resolve."""
    from pxr import Usd, UsdGeom

    del info
    faults, meshes = [], 0
    paths = sorted(root.glob("*.usd*"))
    for path in paths:
        stage = Usd.Stage.Open(str(path))
        meshes += sum(prim.IsA(UsdGeom.Mesh) for prim in stage.TraverseAll())
        faults += [f"{path.name}: {error}" for error in stage.GetCompositionErrors()]
    return Loaded(None, {"files": len(paths), "meshes": meshes}, faults)
