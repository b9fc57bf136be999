"""Poses and values of prims, at one instant or through time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import chain, count
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.generator.core.errors import StorageError
from gen_data.generator.core.se3 import SE3, Array

T_CAMERA_USD = SE3((0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0))
"""A USD camera looks along -Z with +Y up; ours along +Z with -Y up."""


def set_values(attribute: Any, values: Sequence[Any]) -> None:
    """Give an attribute one value per time code; one for all times where they are equal."""
    if all(value == values[0] for value in values):
        attribute.Set(values[0])
        return
    for code, value in enumerate(values):
        attribute.Set(value, code)


def set_transforms(prim: Any, matrices: Sequence[Array]) -> None:
    """Put a prim where column-vector matrices [4, 4] say, one per time code."""
    from pxr import Gf, UsdGeom

    rows = [Gf.Matrix4d(*np.asarray(m).T.ravel().tolist()) for m in matrices]
    set_values(UsdGeom.Xformable(prim).MakeMatrixXform(), rows)


def scale_pose(pose: SE3, scale: float) -> Array:
    """A pose behind a uniform scale, as a matrix [4, 4]."""
    matrix = pose.matrix()
    matrix[:3, :3] *= scale
    return matrix


def along_minus_z(direction: Sequence[float]) -> SE3:
    """The rotation that turns -Z, along which USD's lights shine, into a direction."""
    z = -np.asarray(direction, dtype=np.float64)
    z = z / np.sqrt((z * z).sum())
    helper = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = np.cross(helper, z)
    x = x / np.sqrt((x * x).sum())
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return SE3.from_matrix(matrix)


def unique_name(name: str, taken: set[str]) -> str:
    """A valid identifier that tells the name and is not taken; it is taken from now on."""
    from pxr import Tf

    base = str(Tf.MakeValidIdentifier(name))
    candidates = chain([base], (f"{base}_{k}" for k in count(2)))
    chosen = next(c for c in candidates if c not in taken)
    taken.add(chosen)
    return chosen


@contextmanager
def open_stage_for_writing(path: Path, root: str) -> Iterator[Any]:
    """An empty stage in metres, Z up, with an Xform ``root``; written when all is in it.

    Raises:
        StorageError: if it cannot be written.
    """
    from pxr import Tf, Usd, UsdGeom

    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        stage = Usd.Stage.CreateNew(str(path))
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
        stage.SetDefaultPrim(stage.DefinePrim(root, "Xform"))
        yield stage
        stage.GetRootLayer().Save()
    except Tf.ErrorException as error:
        lines = str(error).strip().splitlines() or ["unknown reason"]
        raise StorageError(
            f"{path}: cannot be written ({lines[-1][:120]}); check space and rights"
        ) from None
