#!/usr/bin/env bash
# trimesh.triangles.closest_point depends on the unit of length.
#
# Common guess: the closest point of a triangle scales with its coordinates, so metres and millimetres give the same point.
# What happens: products of four lengths are compared with an absolute 2.2e-14. For triangles of about 1 mm in metres some
#   points, for 0.3 mm a third of them, are put on a corner or an edge although a nearer point exists, up to 100 times nearer.
# Why it matters: meshes of screws, washers and gears in metres (URDF, glTF, BOP after scaling) have such triangles. Distances,
#   signed distances and proximity queries that end in this function are too large, silently. Scale coordinates first.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q trimesh==5.2.0 numpy==2.4.6 scipy==1.17.1
"$work/venv/bin/python" - <<'PYTHON'
import numpy as np
import trimesh

print("trimesh", trimesh.__version__, "numpy", np.__version__)
rng = np.random.default_rng(0)
triangles, points = rng.normal(size=(2000, 3, 3)), rng.normal(size=(2000, 3))
true = np.linalg.norm(trimesh.triangles.closest_point(triangles, points) - points, axis=1)
wrong = {}
for size_m in (1.0, 1e-2, 1e-3, 3e-4):
    found = trimesh.triangles.closest_point(triangles * size_m, points * size_m) / size_m
    ratio = np.linalg.norm(found - points, axis=1) / true
    wrong[size_m] = float((ratio > 1.01).mean())
    print(f"triangles of {size_m:g} m: {wrong[size_m]:.1%} of distances too large, at most {ratio.max():.1f} times")
assert wrong[1.0] == wrong[1e-2] == 0.0, wrong
assert wrong[1e-3] > 0.0 and wrong[3e-4] > 0.2, wrong
PYTHON
