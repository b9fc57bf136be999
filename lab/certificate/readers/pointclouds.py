"""PLY and PCD files, read by Open3D."""

from pathlib import Path

import numpy as np

from gen_data.core.reported import copies
from gen_data.lab.certificate.labelled_images import Loaded
from gen_data.runner.stored import StoredSamples


def load_pointclouds(root: Path, stored: StoredSamples) -> Loaded:
    """Read every file; there must be as many points as in the scans of the data set."""
    import open3d

    faults, points = [], 0
    paths = sorted(p for p in root.rglob("*") if p.suffix in (".ply", ".pcd"))
    for path in paths:
        at_m = open3d.t.io.read_point_cloud(path).point.positions.numpy()
        points += len(at_m)
        if not np.isfinite(at_m).all():
            faults.append(f"{path.relative_to(root)}: a coordinate is not finite")
    expected = sum(
        len(cloud.points) * copies(cloud)
        for index in stored.indices
        for cloud in stored.labelled(index).capture.clouds.values()
    )
    if points != expected:
        faults.append(f"there are {points} points, expected {expected}")
    return Loaded(None, {"files": len(paths), "points": points}, faults)
