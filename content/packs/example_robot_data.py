"""Converter of the arms pack: arms of Universal Robots from the package example-robot-data.

Their visible meshes are COLLADA files, which become OBJ. The arms end at the flange, on which
``robot_tools`` makes fingers.
"""

import shutil
import warnings
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from xml.etree.ElementTree import Element, tostring

import numpy as np

from gen_data.assets import asset_folder, folder_index, installed_packs
from gen_data.config.data_files import load_data
from gen_data.core import asset_types, colorimetry, errors, safe_xml, se3

_ROOT = "cmeel.prefix/share/example-robot-data/robots/ur_description"
_PACKAGE = "package://example-robot-data/robots/ur_description/"
_MAX_ELEMENTS = 50_000
_FINGERS = folder_index.ToolEntry(kind="fingers", flange="tool0", instead_of="ee_link")
"""On the flange as the controller sees it, instead of a box that marks it."""


@dataclass(frozen=True, slots=True)
class Arm:
    """An arm of the package.

    Attributes:
        home: Joint positions [rad] at home.
        workspace_from_m: Where its workspace on a table begins.
    """

    name: str
    home: dict[str, float]
    workspace_from_m: float = asset_types.WORKSPACE_FROM_M


ARMS = tuple(Arm(**arm) for arm in load_data(__package__, "example_robot_data"))


def convert(source: Path, target: Path) -> None:
    """Write a URDF per arm, its meshes, and the index.

    Raises:
        AssetError: if a description or a mesh is missing or unreadable.
    """
    folder = asset_folder.Folder(source / _ROOT)
    for arm in ARMS:
        file = f"urdf/{arm.name}_robot.urdf"
        robot = safe_xml.parse_xml(
            folder.read(file), str(folder.root / file), "robot", "a URDF", _MAX_ELEMENTS
        )
        for mesh in robot.iter("mesh"):
            _take_mesh(mesh, folder, target)
        (target / f"{arm.name}.urdf").write_bytes(tostring(robot, encoding="utf-8"))
    index = folder_index.FolderIndex(
        licence="BSD-3-Clause (ROS-Industrial ur_description)",
        author="Universal Robots; ROS-Industrial contributors",
        source="PyPI example-robot-data 6.0.0",
        robots=tuple(_index_entry(arm) for arm in ARMS),
    )
    installed_packs.write_index(target, index)


def _index_entry(arm: Arm) -> folder_index.RobotEntry:
    return folder_index.RobotEntry(
        id=arm.name,
        file=f"{arm.name}.urdf",
        tags=("arm", "gripper", installed_packs.TAG),
        home=arm.home,
        tool=_FINGERS,
        workspace_from_m=arm.workspace_from_m,
        max_faces=6000,
        materials={"*": folder_index.Finish(roughness=0.4)},
    )


def _take_mesh(mesh: Element, folder: asset_folder.Folder, target: Path) -> None:
    """Copy or convert the file of a mesh, and refer to it by its path in the pack."""
    file = PurePosixPath(mesh.attrib["filename"].removeprefix(_PACKAGE))
    stored = file.with_suffix(".obj") if file.suffix == ".dae" else file
    mesh.set("filename", str(stored))
    path = target / stored
    if path.exists():
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    if file.suffix == ".dae":
        collada_to_obj(folder.path(str(file)), path)
    else:
        shutil.copyfile(folder.path(str(file)), path)


def collada_to_obj(source: Path, target: Path) -> None:
    """Write the triangles of a COLLADA file, with a diffuse colour per material, as OBJ and MTL.

    Raises:
        AssetError: if it is malformed.
    """
    colors: dict[str, str] = {}
    lines, count = [f"mtllib {target.stem}.mtl"], 0
    for name, color, corners in _read_collada(source):
        # Blender, which wrote these files, writes linear values; values of MTL are sRGB.
        colors[name] = " ".join(f"{c:.4f}" for c in colorimetry.srgb_encode(color))
        points, numbers = np.unique(corners, axis=0, return_inverse=True)
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points]
        lines.append(f"usemtl {name}")
        lines += [f"f {a} {b} {c}" for a, b, c in numbers.reshape(-1, 3) + count + 1]
        count += len(points)
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")
    text = "".join(f"newmtl {name}\nKd {color}\n" for name, color in colors.items())
    target.with_suffix(".mtl").write_text(text, encoding="utf-8")


def _read_collada(path: Path) -> list[tuple[str, se3.Array, se3.Array]]:
    """Name and diffuse colour of the material, and corners [3 n, 3], of all triangles."""
    from collada import Collada
    from collada.common import DaeError
    from collada.polylist import BoundPolylist
    from collada.triangleset import BoundTriangleSet

    found = []
    with warnings.catch_warnings():
        # It multiplies by numpy.matrix, and sets the shapes of arrays.
        for category in (PendingDeprecationWarning, DeprecationWarning):
            warnings.simplefilter("ignore", category)
        try:
            geometries = list(Collada(str(path)).scene.objects("geometry"))
        except DaeError as error:
            raise errors.AssetError(f"{path}: malformed COLLADA ({error})") from None
        for part in (part for geometry in geometries for part in geometry.primitives()):
            triangles = part.triangleset() if isinstance(part, BoundPolylist) else part
            # Other primitives are stray lines.
            if isinstance(triangles, BoundTriangleSet) and len(triangles):
                effect = triangles.material.effect
                corners = np.asarray(triangles.vertex)[triangles.vertex_index].reshape(-1, 3)
                found.append((effect.id, np.array(effect.diffuse[:3], np.float64), corners))
    return found
