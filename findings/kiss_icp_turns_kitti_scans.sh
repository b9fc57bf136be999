#!/usr/bin/env bash
# Common guess: the KITTI loader of KISS-ICP returns the points of sequences/NN/velodyne/*.bin, as its
#   other loaders return the points of their files.
# Behaviour: it turns every point upwards by 0.205 degrees, each in its vertical plane: a correction of
#   the calibration of the scanner of KITTI's car. The loader kitti-raw does the same. No option turns
#   it off, and neither help nor output mentions it; only a comment in the source does.
# Why it matters: the format is used by SemanticKITTI, by simulators and by recordings with other
#   scanners. A wall at 50 m is 18 cm too high, flat ground becomes a bowl, and poses, maps and errors
#   belong to scans that nobody recorded: for such data, write PLY or PCD files and use the loader generic.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q kiss-icp==1.3.0 numpy==2.4.6
cd "$work"
"$work/venv/bin/python" - <<'PY'
from importlib.metadata import version
from pathlib import Path

import numpy as np
from kiss_icp.datasets.kitti import KITTIOdometryDataset

print(f"kiss-icp {version('kiss-icp')}, numpy {np.__version__}")

# Level ground 1.73 m below the scanner, and points at its height. Sequences from 11 on need no poses.
away_m = np.array([5.0, 10.0, 20.0, 50.0])
level = np.column_stack([away_m, 0 * away_m, 0 * away_m])
ground = np.column_stack([0 * away_m, away_m, 0 * away_m - 1.73])
points = np.concatenate([level, ground])
folder = Path("data/sequences/11")
(folder / "velodyne").mkdir(parents=True)
rows = np.column_stack([points, np.ones(len(points))]).astype("<f4")
(folder / "velodyne/000000.bin").write_bytes(rows.tobytes())
(folder / "calib.txt").write_text("Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n")

read, _ = KITTIOdometryDataset("data", "11")[0]


def elevation_deg(p):
    return np.degrees(np.arctan2(p[:, 2], np.hypot(p[:, 0], p[:, 1])))


turned = elevation_deg(read) - elevation_deg(points)
print("distance [m]:              ", away_m)
print("height read at height 0 [m]:", read[:4, 2].round(3))
print("ground of -1.73 m read [m]: ", read[4:, 2].round(3))
print("turned upwards [deg]:      ", turned.round(4))
assert np.allclose(turned, 0.205, atol=1e-3), f"behaviour changed: {turned}"
assert np.allclose(np.linalg.norm(read, axis=1), np.linalg.norm(points, axis=1), atol=1e-5)
PY
echo "as described"
