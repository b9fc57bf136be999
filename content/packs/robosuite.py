"""Converter of the robots pack: robosuite's arms with a parallel gripper, from MJCF to URDF."""

import shutil
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from gen_data.assets import asset_folder, folder_index, installed_packs
from gen_data.config.data_files import load_data
from gen_data.content.packs.mjcf import add_bodies, read_mjcf
from gen_data.core.errors import AssetError

_ROOT = "robosuite/models/assets"
_GRIPPER = "grippers/rethink_gripper.xml"
_FLANGE = "right_hand"
_HAND = "gripper_base"
_FINGERS = ("l_finger_joint", "r_finger_joint")
_CLOSED_M = 0.01855
"""Distance of a pad's inner face from the middle at joint position 0: 0.01 + 0.01725 (finger, tip)
- 0.0047 - 0.004 (pad)."""
_STROKE_M = 0.078
"""Twice a pad's distance from the middle at the joint's upper limit, 0.020833."""
_GRASP_M = 0.114
"""Distance from the hand's origin to 9 mm behind the ends of the finger tips, at 0.1229."""


@dataclass(frozen=True, slots=True)
class Arm:
    """An arm of the package.

    Attributes:
        home: Joint positions [rad] at home.
        touching: Link pairs in permanent contact.
    """

    name: str
    author: str
    home: dict[str, float]
    touching: tuple[tuple[str, str], ...] = ()


ARMS = tuple(Arm(**arm) for arm in load_data(__package__, "robosuite"))


def convert(source: Path, target: Path) -> None:
    """Write a URDF per arm, its meshes, and the index.

    Raises:
        AssetError: if a description is missing or unsupported.
    """
    folder = asset_folder.Folder(source / _ROOT)
    for arm in ARMS:
        robot = Element("robot", name=arm.name)
        files = add_bodies(robot, read_mjcf(folder, f"robots/{arm.name}/robot.xml"))
        files += add_bodies(robot, read_mjcf(folder, _GRIPPER), _FLANGE)
        for joint in _FINGERS:
            _shift_finger_zero(robot, joint)
        indent(robot)
        (target / f"{arm.name}.urdf").write_bytes(tostring(robot, encoding="utf-8"))
        for file in files:
            path = target / file
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(folder.path(file), path)
    index = folder_index.FolderIndex(
        licence="MIT (package robosuite)",
        source="PyPI robosuite 1.5.2",
        robots=tuple(_index_entry(arm) for arm in ARMS),
    )
    installed_packs.write_index(target, index)


def _index_entry(arm: Arm) -> folder_index.RobotEntry:
    fingers = dict.fromkeys(_FINGERS, _STROKE_M / 2.0)
    return folder_index.RobotEntry(
        id=arm.name,
        file=f"{arm.name}.urdf",
        tags=("arm", "gripper", installed_packs.TAG),
        author=arm.author,
        home={**arm.home, **fingers},
        gripper=folder_index.GripperEntry(
            link=_HAND, grasp_offset_m=_GRASP_M, finger_joints=_FINGERS, stroke_m=_STROKE_M
        ),
        touching=arm.touching,
        max_faces=1500,
        materials={"*": folder_index.Finish(roughness=0.4)},
    )


def _shift_finger_zero(robot: Element, name: str) -> None:
    """Redefine a finger joint: 0 is closed and positive opens, as for the project's grippers."""
    joint = next((j for j in robot.findall("joint") if j.get("name") == name), None)
    origin = joint.find("origin") if joint is not None else None
    if joint is None or origin is None:
        raise AssetError(f"gripper: no joint '{name}'")
    x, y, z = (float(v) for v in origin.attrib["xyz"].split())
    side = 1.0 if y > 0.0 else -1.0
    origin.set("xyz", f"{x!r} {round(y - side * _CLOSED_M, 9)!r} {z!r}")
    for tag in ("axis", "limit"):
        joint.remove(next(iter(joint.findall(tag))))
    SubElement(joint, "axis", xyz=f"0 {side!r} 0")
    SubElement(joint, "limit", lower="0", upper=repr(_STROKE_M / 2.0), effort="0", velocity="0")
