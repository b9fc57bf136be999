"""Helpers for writing stages: files, prim names, values and transforms over time."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import chain, count
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.core.errors import StorageError
from gen_data.core.se3 import SE3, Array

T_CAMERA_USD = SE3((0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0))
"""USD's camera looks along -Z with +Y up, this project's along +Z with -Y up."""


def set_values(attribute: Any, values: Sequence[Any], codes: Sequence[float]) -> None:
    """Set an attribute at time codes, or once for all times if all values are equal."""
    if all(value == values[0] for value in values):
        attribute.Set(values[0])
        return
    for code, value in zip(codes, values, strict=True):
        attribute.Set(value, code)


def set_transforms(prim: Any, matrices: Sequence[Array], codes: Sequence[float]) -> None:
    """Set a prim's transform to column-vector matrices [4, 4], one per time code."""
    from pxr import Gf, UsdGeom

    rows = [Gf.Matrix4d(*np.asarray(m).T.ravel().tolist()) for m in matrices]
    set_values(UsdGeom.Xformable(prim).MakeMatrixXform(), rows, codes)


def scale_pose(pose: SE3, scale: float) -> Array:
    """Matrix [4, 4] that scales uniformly, then applies the pose."""
    matrix = pose.matrix()
    matrix[:3, :3] *= scale
    return matrix


def along_minus_z(direction: Sequence[float]) -> SE3:
    """Rotation from -Z, the direction of USD's lights, to the given direction."""
    z = -np.asarray(direction, dtype=np.float64)
    z = z / np.sqrt((z * z).sum())
    helper = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = np.cross(helper, z)
    return rotation_from_axes(x / np.sqrt((x * x).sum()), z)


def rotation_from_axes(x: Array, z: Array) -> SE3:
    """Rotation whose columns are a unit X axis, the cross product, and a unit Z axis."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return SE3.from_matrix(matrix)


def unique_name(name: str, taken: set[str]) -> str:
    """Make a valid, unused prim name from a name, and add it to ``taken``."""
    from pxr import Tf

    base = str(Tf.MakeValidIdentifier(name))
    candidates = chain([base], (f"{base}_{k}" for k in count(2)))
    chosen = next(c for c in candidates if c not in taken)
    taken.add(chosen)
    return chosen


@contextmanager
def open_stage_for_writing(path: Path, root: str) -> Iterator[Any]:
    """Create a stage in metres, Z up, with an Xform ``root``; save it when the block ends.

    Raises:
        StorageError: if it cannot be written.
    """
    from pxr import Usd, UsdGeom

    path.parent.mkdir(parents=True, exist_ok=True)
    with _storage_errors(path):
        stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    stage.SetDefaultPrim(stage.DefinePrim(root, "Xform"))
    yield stage
    with _storage_errors(path):
        stage.GetRootLayer().Save()


@contextmanager
def _storage_errors(path: Path) -> Iterator[None]:
    from pxr import Tf

    try:
        yield
    except Tf.ErrorException as error:
        lines = str(error).strip().splitlines() or ["unknown reason"]
        raise StorageError(
            f"{path}: cannot be written ({lines[-1][:120]}); check space and rights"
        ) from None
