"""What a stage holds: meshes with their looks, lights, cameras; in metres, Z up.

Everything is read at the earliest time code. Meshes are taken as polygons whatever their
subdivision scheme; what is invisible or a guide or proxy is left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.generator.core.errors import AssetError
from gen_data.generator.core.scene import Light
from gen_data.generator.core.se3 import SE3, Array
from gen_data.generator.usd.cameras import read_camera_pose
from gen_data.generator.usd.lights import check_light, read_light
from gen_data.generator.usd.mesh_reader import MeshPrim, read_mesh_prim
from gen_data.generator.usd.prims import unique_name

SUFFIXES = (".usd", ".usda", ".usdc")
"""Of layers; ``.usdz`` is an archive of them."""
_UNREAD = ("PointInstancer", "Cube", "Sphere", "Cylinder", "Cone", "Capsule", "BasisCurves")


@dataclass(frozen=True, slots=True)
class Label:
    """What a labelled prim is.

    Attributes:
        prim: Its path without the leading slash.
        category: The label of the taxonomy ``category``, ``class`` or, failing these, the first.
    """

    prim: str
    category: str


@dataclass(frozen=True, eq=False)
class StagePart:
    """A mesh prim of a stage.

    Attributes:
        name: Its path as one identifier, unique in the stage.
        label: Of the nearest labelled prim above it; None if there is none.
    """

    name: str
    label: Label | None
    prim: Any
    T_stage_prim: Array


class OpenStage:
    """A stage that is open for reading.

    Raises:
        AssetError: if the file is no stage.
    """

    def __init__(self, path: Path, place: str) -> None:
        from pxr import Tf, Usd, UsdGeom

        self.place = place
        try:
            with _quiet():
                self._stage = Usd.Stage.Open(str(path))
        except Tf.ErrorException:
            raise AssetError(
                f"{place}: unreadable USD, or it refers to a layer that is; export it again"
            ) from None
        metres = float(UsdGeom.GetStageMetersPerUnit(self._stage))
        y_up = UsdGeom.GetStageUpAxis(self._stage) == UsdGeom.Tokens.y
        turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) if y_up else np.eye(3)
        self._to_metres = np.eye(4)
        self._to_metres[:3, :3] = metres * turn

    def layers(self) -> tuple[str, ...]:
        """Paths of all files that it was composed of, those in archives behind the archive's."""
        return tuple(str(x.realPath) for x in self._stage.GetUsedLayers() if x.realPath)

    def pieces(self) -> tuple[StagePart, ...]:
        """Every visible mesh, in the stage's order.

        Raises:
            AssetError: if there is none, or geometry that is not read.
        """
        from pxr import UsdGeom

        taken: set[str] = set()
        found = []
        for prim in self._visible():
            if prim.GetTypeName() in _UNREAD:
                raise AssetError(
                    f"{self.place}: {prim.GetPath()} is of type {prim.GetTypeName()}, which is not "
                    "read; export it as meshes"
                )
            if prim.IsA(UsdGeom.Mesh):
                name = unique_name(_flat(prim), taken)
                found.append(StagePart(name, _label_of(prim), prim, self._pose(prim)))
        if not found:
            raise AssetError(f"{self.place}: holds no mesh; export it with its meshes")
        return tuple(found)

    def mesh(self, piece: StagePart) -> MeshPrim:
        """Polygons and looks of a piece, in its prim's own frame and unit.

        Raises:
            AssetError: if they are inconsistent, or its material is not read.
        """
        with _quiet():
            return read_mesh_prim(piece.prim, self.place)

    def lights(self) -> tuple[Light, ...]:
        """Lamps, panels and suns; skies and other kinds are left out.

        Raises:
            AssetError: a light is negative or not finite.
        """
        read = [read_light(prim, _flat(prim), self._pose(prim)) for prim in self._visible()]
        return tuple(check_light(light, self.place) for light in read if light is not None)

    def cameras(self) -> tuple[tuple[str, SE3], ...]:
        """Names and ``T_stage_camera`` of all cameras."""
        from pxr import UsdGeom

        return tuple(
            (_flat(prim), read_camera_pose(self._pose(prim)))
            for prim in self._visible()
            if prim.IsA(UsdGeom.Camera)
        )

    def _visible(self) -> Iterator[Any]:
        from pxr import Usd, UsdGeom

        tokens = UsdGeom.Tokens
        for prim in Usd.PrimRange.Stage(self._stage, Usd.TraverseInstanceProxies()):
            if not prim.IsA(UsdGeom.Imageable):
                continue
            imageable = UsdGeom.Imageable(prim)
            hidden = imageable.ComputeVisibility(Usd.TimeCode.EarliestTime()) == tokens.invisible
            if not hidden and imageable.ComputePurpose() in (tokens.default_, tokens.render):
                yield prim

    def _pose(self, prim: Any) -> Array:
        """Column-vector matrix [4, 4] from a prim's frame to metres, Z up."""
        from pxr import Usd, UsdGeom

        rows = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.EarliestTime())
        matrix: Array = np.einsum("ij,jk->ik", self._to_metres, np.array(rows).T, optimize=False)
        return matrix


def layer_references(path: Path) -> Sequence[str]:
    """What one layer refers to, as it says it: layers, and files that attributes name.

    Empty if the layer is unreadable, which its reader will tell.
    """
    from pxr import Tf, UsdUtils

    try:
        with _quiet():
            lists = UsdUtils.ExtractExternalReferences(str(path))
    except Tf.ErrorException:
        return ()
    return sorted({str(name) for names in lists for name in names if name})


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep what the library warns of from the terminal; its errors are raised all the same."""
    from pxr import UsdUtils

    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        delegate.TakeUncoalescedDiagnostics()


def _flat(prim: Any) -> str:
    return str(prim.GetPath()).strip("/").replace("/", "_")


def _label_of(prim: Any) -> Label | None:
    from pxr import UsdSemantics

    while prim and not prim.IsPseudoRoot():
        names = [str(name) for name in UsdSemantics.LabelsAPI.GetDirectTaxonomies(prim)]
        chosen = [n for n in ("category", "class") if n in names]
        if chosen:
            labels = UsdSemantics.LabelsAPI(prim, chosen[0]).GetLabelsAttr().Get()
            if labels:
                return Label(_flat(prim), str(labels[0]))
        prim = prim.GetParent()
    return None
