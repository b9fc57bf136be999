"""Import of stages: meshes with materials, lights and cameras, in metres, Z up.

Everything is read at the earliest time code. Meshes are read as polygons, whatever their
subdivision scheme, and primitive shapes and copies of instancers as meshes; invisible prims,
guides and proxies are skipped.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.core import errors, optional_packages, scene
from gen_data.core.se3 import SE3, Array
from gen_data.usd.cameras import read_camera_pose
from gen_data.usd.lights import check_light, read_light
from gen_data.usd.mesh_reader import MeshPrim, read_mesh_prim, read_primitive
from gen_data.usd.primitives import KINDS
from gen_data.usd.prims import unique_name

SUFFIXES = (".usd", ".usda", ".usdc")
"""Suffixes of layers; ``.usdz`` is an archive of layers."""
_MAX_INSTANCES = 5_000
"""Bound on the copies of a PointInstancer: each is a piece with a name."""
_OLD_LABEL = re.compile(r"semantic:(.+):params:semanticType")
"""Attribute of the label schema before UsdSemantics (``SemanticsAPI``, Isaac Sim up to 4)."""


@dataclass(frozen=True, slots=True)
class Label:
    """Semantic label of a prim.

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
        label: Label of the prim or its nearest labelled ancestor; None if there is none.
    """

    name: str
    label: Label | None
    prim: Any
    T_stage_prim: Array


class OpenStage:
    """A stage that is open for reading.

    Raises:
        AssetError: if the file is not a stage, or OpenUSD is not installed.
    """

    def __init__(self, path: Path, place: str) -> None:
        check_usd(place)
        from pxr import Tf, Usd, UsdGeom

        self.place = place
        self.remarks: dict[str, str] = {}
        try:
            with _collect_warnings():
                self._stage = Usd.Stage.Open(str(path))
        except Tf.ErrorException as error:
            raise errors.AssetError(
                f"{place}: unreadable USD, or it refers to a layer that is"
                f"{_reason(error)}; export it again"
            ) from None
        metres = float(UsdGeom.GetStageMetersPerUnit(self._stage))
        y_up = UsdGeom.GetStageUpAxis(self._stage) == UsdGeom.Tokens.y
        turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) if y_up else np.eye(3)
        self._to_metres = np.eye(4)
        self._to_metres[:3, :3] = metres * turn

    def layers(self) -> tuple[str, ...]:
        """Paths of all files it is composed of; layers in an archive follow the archive's path."""
        return tuple(str(x.realPath) for x in self._stage.GetUsedLayers() if x.realPath)

    def pieces(self) -> tuple[StagePart, ...]:
        """Every visible mesh and primitive shape, in the stage's order.

        Raises:
            AssetError: if there is none.
        """
        from pxr import UsdGeom

        taken: set[str] = set()
        found: list[StagePart] = []
        for prim in self._visible():
            if prim.IsA(UsdGeom.PointInstancer):
                found += self._instances(prim, taken)
            elif prim.IsA(UsdGeom.Mesh) or prim.GetTypeName() in KINDS:
                name = unique_name(_flat_name(prim), taken)
                found.append(StagePart(name, _find_label(prim), prim, self._pose(prim)))
            elif prim.IsA(UsdGeom.Gprim):
                self._remark(f"{prim.GetTypeName()} is not read, such as {prim.GetPath()}")
        if not found:
            raise errors.AssetError(f"{self.place}: holds no mesh; export it with its meshes")
        return tuple(found)

    def _remark(self, text: str) -> None:
        self.remarks[text.partition(",")[0]] = text

    def _instances(self, prim: Any, taken: set[str]) -> Iterator[StagePart]:
        """Yield the meshes of every copy of an instancer.

        Raises:
            AssetError: if they are too many, or a prototype is missing.
        """
        from pxr import Usd, UsdGeom

        time = Usd.TimeCode.EarliestTime()
        instancer = UsdGeom.PointInstancer(prim)
        matrices = instancer.ComputeInstanceTransformsAtTime(
            time, time, UsdGeom.PointInstancer.IncludeProtoXform, UsdGeom.PointInstancer.ApplyMask
        )
        mask = instancer.ComputeMaskAtTime(time)
        numbers = list(instancer.GetProtoIndicesAttr().Get(time) or [])
        kinds = [k for place, k in enumerate(numbers) if not mask or mask[place]]
        stage = prim.GetStage()
        roots = [stage.GetPrimAtPath(p) for p in instancer.GetPrototypesRel().GetTargets()]
        if len(kinds) > _MAX_INSTANCES or any(not 0 <= k < len(roots) for k in kinds):
            raise errors.AssetError(
                f"{self.place}: {prim.GetPath()} has {len(kinds)} copies of {len(roots)} "
                f"prototypes; at most {_MAX_INSTANCES} copies are read, correct it"
            )
        to_stage = self._pose(prim)
        cache = UsdGeom.XformCache(time)
        for kind, rows in zip(kinds, matrices, strict=False):
            root = roots[kind]
            place = np.einsum("ij,jk->ik", to_stage, np.array(rows).T, optimize=False)
            for part in Usd.PrimRange(root, Usd.TraverseInstanceProxies()):
                if not (part.IsA(UsdGeom.Mesh) or part.GetTypeName() in KINDS):
                    continue
                relative, _ = cache.ComputeRelativeTransform(part, root)
                own = np.eye(4) if part == root else np.array(relative).T
                matrix = np.einsum("ij,jk->ik", place, own, optimize=False)
                name = unique_name(f"{_flat_name(prim)}_{_flat_name(part)}", taken)
                label = _find_label(part) or _find_label(prim)
                yield StagePart(name, label, part, matrix)

    def mesh(self, piece: StagePart) -> MeshPrim:
        """Triangles and materials of a piece, in its prim's own frame and unit.

        Raises:
            AssetError: if they are inconsistent, or its material is unsupported.
        """
        with _collect_warnings():
            read = read_primitive if piece.prim.GetTypeName() in KINDS else read_mesh_prim
            return read(piece.prim, self.place)

    def lights(self) -> tuple[scene.Light, ...]:
        """Sphere, panel and distant lights; domes and other kinds are skipped.

        Raises:
            AssetError: if a light is negative or not finite.
        """
        read = [read_light(prim, _flat_name(prim), self._pose(prim)) for prim in self._visible()]
        return tuple(check_light(light, self.place) for light in read if light is not None)

    def cameras(self) -> tuple[tuple[str, SE3], ...]:
        """Names and ``T_stage_camera`` of all cameras."""
        from pxr import UsdGeom

        return tuple(
            (_flat_name(prim), read_camera_pose(self._pose(prim)))
            for prim in self._visible()
            if prim.IsA(UsdGeom.Camera)
        )

    def _visible(self) -> Iterator[Any]:
        from pxr import Usd, UsdGeom

        tokens = UsdGeom.Tokens
        prims = iter(Usd.PrimRange.Stage(self._stage, Usd.TraverseInstanceProxies()))
        for prim in prims:
            if not prim.IsA(UsdGeom.Imageable):
                continue
            if prim.IsA(UsdGeom.PointInstancer):
                # Prototypes below it are seen in its copies only.
                prims.PruneChildren()
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


def check_usd(place: str) -> None:
    """Raise AssetError, which begins with ``place``, if OpenUSD is not installed."""
    missing = optional_packages.missing_packages("pxr")
    if missing:
        raise errors.AssetError(f"{place}: {missing}")


def layer_references(path: Path) -> Sequence[str]:
    """References of one layer, verbatim: layers, and files named by attributes.

    Empty if the layer is unreadable, which its reader reports.

    Raises:
        AssetError: if OpenUSD is not installed.
    """
    check_usd(str(path))
    from pxr import Tf, UsdUtils

    try:
        with _collect_warnings():
            lists = UsdUtils.ExtractExternalReferences(str(path))
    except Tf.ErrorException:
        return ()
    return sorted({str(name) for names in lists for name in names if name})


@contextmanager
def _collect_warnings() -> Iterator[None]:
    """Keep the library's warnings off the terminal; its errors are still raised."""
    from pxr import UsdUtils

    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        delegate.TakeUncoalescedDiagnostics()


def _reason(error: Exception) -> str:
    """The cause in brackets, as far as the library's first error states it; else nothing."""
    text = str(getattr(error.args[0], "commentary", "")) if error.args else ""
    place = re.search(r"\.usd[ac]?:(\d+):(\d+): ", text)
    if place:
        return f" (syntax error at line {place[1]}, column {place[2]})"
    causes = {"truncated": "damaged or cut off", "is not a valid": "its content is not USD"}
    return next((f" ({cause})" for sign, cause in causes.items() if sign in text), "")


def _flat_name(prim: Any) -> str:
    return str(prim.GetPath()).strip("/").replace("/", "_")


def _find_label(prim: Any) -> Label | None:
    from pxr import UsdSemantics

    while prim and not prim.IsPseudoRoot():
        names = [str(name) for name in UsdSemantics.LabelsAPI.GetDirectTaxonomies(prim)]
        chosen = [n for n in ("category", "class") if n in names]
        if chosen:
            labels = UsdSemantics.LabelsAPI(prim, chosen[0]).GetLabelsAttr().Get()
            if labels:
                return Label(_flat_name(prim), str(labels[0]))
        old = _find_old_label(prim)
        if old:
            return Label(_flat_name(prim), old)
        prim = prim.GetParent()
    return None


def _find_old_label(prim: Any) -> str:
    """Label of the schema before UsdSemantics, of the type class or category; empty = none."""
    for attribute in prim.GetAuthoredPropertiesInNamespace("semantic"):
        found = _OLD_LABEL.fullmatch(attribute.GetName())
        if found and str(attribute.Get()) in ("class", "category"):
            data = prim.GetAttribute(f"semantic:{found[1]}:params:semanticData").Get()
            if data:
                return str(data)
    return ""
