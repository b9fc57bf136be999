"""PLY and PCD files, read by Open3D."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gen_data.generator.certificate.labelled_images import Loaded
from gen_data.generator.core.interfaces import DatasetInfo


def load_pointclouds(root: Path, info: DatasetInfo) -> Loaded:
    """Read every file; coordinates must be finite."""
    import open3d

    del info
    faults, points = [], 0
    paths = sorted(p for p in root.rglob("*") if p.suffix in (".ply", ".pcd"))
    for path in paths:
        at_m = open3d.t.io.read_point_cloud(str(path)).point.positions.numpy()
        points += len(at_m)
        if not np.isfinite(at_m).all():
            faults.append(f"{path.relative_to(root)}: a coordinate is not finite")
    return Loaded(None, {"files": len(paths), "points": points}, faults)
