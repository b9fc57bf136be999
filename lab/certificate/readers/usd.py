"""OpenUSD stages, read by usd-core."""

from pathlib import Path

from gen_data.lab.certificate.labelled_images import Loaded
from gen_data.runner.stored import StoredSamples


def load_usd(root: Path, stored: StoredSamples) -> Loaded:
    """Open the stage of every view, with all its references, which must resolve."""
    from pxr import Usd, UsdGeom

    faults, meshes = [], 0
    paths = sorted(root.glob("*.usd*"))
    for path in paths:
        stage = Usd.Stage.Open(str(path))
        meshes += sum(prim.IsA(UsdGeom.Mesh) for prim in stage.TraverseAll())
        faults += [f"{path.name}: {error}" for error in stage.GetCompositionErrors()]
    expected = len({index // stored.info.steps_per_scene for index in stored.indices})
    if len(paths) != expected:
        faults.append(f"there are {len(paths)} stages, expected {expected}")
    return Loaded(None, {"files": len(paths), "meshes": meshes}, faults)
