"""Stages as files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gen_data.generator.core.errors import StorageError


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
