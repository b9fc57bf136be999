"""Real mesh files against an independent reader: sizes, triangles, areas and colours.

    python -m benchmarks.own_meshes FOLDER... [--limit 60] [--before CHECKOUT]

Every OBJ, PLY, STL, glTF and USD file below the folders is read by this project and by trimesh
(USD: by OpenUSD itself), in the units and axes of the file. With ``--before``, a checkout of
another version reads the same files for a comparison of times. Nothing is installed or fetched:
give folders of any package or repository with meshes, such as trimesh's ``models``, assimp's
``test/models``, usd-wg's ``assets`` or pybullet's data.
"""

import argparse
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers import read_mesh
from gen_data.core.errors import AssetError

SUFFIXES = (".obj", ".ply", ".stl", ".glb", ".gltf", ".usd", ".usda", ".usdc", ".usdz")
SAME = 0.01
"""Largest difference of extents and areas that counts as equal, as a share."""
_TIMES = """
import sys, time
from pathlib import Path
from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers import read_mesh
from gen_data.core.errors import AssetError
for line in sys.stdin:
    path = Path(line.strip())
    best = 1e9
    for _ in range(3):
        start = time.process_time()
        try:
            read_mesh(Folder(path.parent), path.name)
        except AssetError:
            best = -1.0
            break
        best = min(best, time.process_time() - start)
    print(best, flush=True)
"""


@dataclass(frozen=True)
class Measured:
    """What two readers can agree on.

    Attributes:
        extents: Edges of the bounding box, in the file's unit.
        color: Mean linear RGB over all triangles by area, before images; None = none is given.
    """

    triangles: int
    extents: np.ndarray
    area: float
    color: np.ndarray | None


def main() -> None:
    """Print a row per file and a summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--limit", type=int, default=1000, help="read so many files at most")
    parser.add_argument("--before", type=Path, help="checkout to compare times with")
    options = parser.parse_args()
    files = [path for folder in options.folders for path in find_meshes(folder)][: options.limit]
    rows = [compare(path) for path in files]
    width = max((len(path.name) for path in files), default=0)
    for path, row in zip(files, rows, strict=True):
        print(f"{path.name:<{width}}  {row}")
    for verdict in ("equal", "differs", "both refuse", "refused here", "read here only"):
        print(f"{verdict:<16} {sum(row.startswith(verdict) for row in rows)}")
    if options.before is not None:
        now, before = (measure_times(files, at) for at in (Path.cwd(), options.before))
        both = [k for k in range(len(files)) if now[k] >= 0.0 and before[k] >= 0.0]
        print(f"{len(both)} files that both versions read, best of three, processor time:")
        print(f"now {sum(now[k] for k in both):.2f} s, before {sum(before[k] for k in both):.2f} s")


def find_meshes(folder: Path) -> Iterator[Path]:
    """Yield the mesh files below a folder, sorted."""
    yield from sorted(p for p in folder.rglob("*") if p.suffix.lower() in SUFFIXES and p.is_file())


def compare(path: Path) -> str:
    """A verdict on one file, and both measurements."""
    try:
        ours = measure_ours(path)
        refusal = ""
    except AssetError as error:
        ours, refusal = None, str(error).removeprefix(f"{path}: ")
    theirs = measure_theirs(path)
    if ours is None or theirs is None:
        if theirs is None and ours is None:
            return f"both refuse: {refusal[:70]}"
        return f"refused here: {refusal[:70]}" if ours is None else f"read here only: {shown(ours)}"
    close = np.allclose(
        ours.extents, theirs.extents, rtol=SAME, atol=1e-9 + SAME * ours.extents.max()
    )
    close &= abs(ours.area - theirs.area) <= SAME * max(ours.area, theirs.area) + 1e-12
    if ours.color is not None and theirs.color is not None:
        close &= np.allclose(ours.color, theirs.color, atol=0.02)
    return f"{'equal' if close else 'differs'}: {shown(ours)}" + (
        "" if close else f"; reference {shown(theirs)}"
    )


def shown(one: Measured) -> str:
    """A measurement in one line."""
    color = "" if one.color is None else f", colour {np.round(one.color, 2).tolist()}"
    extents = " x ".join(f"{edge:.4g}" for edge in one.extents)
    return f"{one.triangles} triangles, {extents}, area {one.area:.5g}{color}"


def measure_ours(path: Path) -> Measured:
    """Read a file with this project's reader. Raises AssetError if it cannot."""
    soup = read_mesh(Folder(path.parent), path.name).soup
    colors = None
    if soup.colors is not None and not any(slot.material.texture for slot in soup.slots):
        base = np.array([slot.material.base_color for slot in soup.slots])[soup.face_slots]
        colors = soup.colors * base[:, None]
    return measure(soup.corners, colors)


def measure(corners: np.ndarray, colors: np.ndarray | None) -> Measured:
    """Measure triangles [m, 3, 3] with linear RGB [m, 3, 3] at their corners."""
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = 0.5 * np.sqrt((crosses**2).sum(axis=1))
    color = None
    if colors is not None:
        color = (colors.mean(axis=1) * areas[:, None]).sum(axis=0) / max(areas.sum(), 1e-30)
    return Measured(len(corners), np.ptp(corners.reshape(-1, 3), axis=0), float(areas.sum()), color)


def measure_theirs(path: Path) -> Measured | None:
    """Read a file with the reference; None if it cannot, or finds no triangle."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            is_usd = path.suffix.lower().startswith(".usd")
            return _measure_usd(path) if is_usd else _measure_trimesh(path)
    except Exception:
        return None


def _measure_trimesh(path: Path) -> Measured | None:
    import trimesh

    scene = trimesh.load_scene(path, process=False)
    parts = [
        (mesh.triangles, _trimesh_colors(mesh, path))
        for mesh in scene.dump()
        if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)
    ]
    if not parts:
        return None
    corners = np.concatenate([triangles for triangles, _ in parts])
    known = all(colors is not None for _, colors in parts)
    return measure(corners, np.concatenate([c for _, c in parts]) if known else None)


def _trimesh_colors(mesh: Any, path: Path) -> np.ndarray | None:
    """Linear RGB at the corners of a mesh with colours per vertex or face."""
    if mesh.visual.kind not in ("vertex", "face"):
        return None
    if mesh.visual.kind == "vertex":
        values = mesh.visual.vertex_colors[mesh.faces][..., :3]
    else:
        values = np.repeat(mesh.visual.face_colors[:, None, :3], 3, axis=1)
    shares = values / 255.0
    if path.suffix.lower() in (".glb", ".gltf"):
        return np.asarray(shares)
    return np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)


def _measure_usd(path: Path) -> Measured | None:
    """Visible meshes as OpenUSD places them, in metres, Z up; primitive shapes are not counted."""
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    scale = UsdGeom.GetStageMetersPerUnit(stage)
    is_y_up = UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y
    cache, found = UsdGeom.XformCache(Usd.TimeCode.EarliestTime()), []
    shapes = (UsdGeom.PointInstancer, UsdGeom.Sphere, UsdGeom.Cube, UsdGeom.Cylinder,
              UsdGeom.Cone, UsdGeom.Capsule, UsdGeom.Plane)  # fmt: skip
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        if any(prim.IsA(shape) for shape in shapes):
            return None
        if not prim.IsA(UsdGeom.Mesh):
            continue
        imageable = UsdGeom.Imageable(prim)
        if imageable.ComputeVisibility() == UsdGeom.Tokens.invisible:
            continue
        if imageable.ComputePurpose() not in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render):
            continue
        mesh, time_code = UsdGeom.Mesh(prim), Usd.TimeCode.EarliestTime()
        rows = np.array(cache.GetLocalToWorldTransform(prim))
        points = np.array(mesh.GetPointsAttr().Get(time_code)) @ rows[:3, :3] + rows[3, :3]
        start, index = 0, list(mesh.GetFaceVertexIndicesAttr().Get(time_code))
        for count in mesh.GetFaceVertexCountsAttr().Get(time_code):
            own = points[index[start : start + count]]
            found += [own[[0, k, k + 1]] for k in range(1, count - 1)]
            start += count
    corners = np.array(found) * scale
    if is_y_up:
        corners = corners[..., [0, 2, 1]]
    return measure(corners, None)


def measure_times(files: list[Path], checkout: Path) -> list[float]:
    """Processor seconds per file with the code of a checkout; -1 where it refuses."""
    text = "\n".join(str(path.resolve()) for path in files)
    done = subprocess.run(
        [sys.executable, "-c", _TIMES],
        input=text, text=True, stdout=subprocess.PIPE, check=True, cwd=checkout,
        env={"PYTHONPATH": str(checkout.resolve()), "PATH": "/usr/bin:/bin"},
    )  # fmt: skip
    return [float(line) for line in done.stdout.split()]


if __name__ == "__main__":
    started_s = time.perf_counter()
    main()
    print(f"{time.perf_counter() - started_s:.0f} s")
