"""Franka Panda as a RobotModel, read from the URDF that pybullet installs."""

import math
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pybullet_data

from gen_data.core.asset_types import Gripper, Joint, RobotModel
from gen_data.core.se3 import SE3, multiply_quaternions

HOME = (0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.785398, 0.04, 0.04)
HAND, GRASP = "panda_hand", "panda_grasptarget"


@cache
def urdf_path() -> Path:
    """The file of pybullet, or of its pack."""
    return Path(pybullet_data.getDataPath()) / "franka_panda" / "panda.urdf"


def panda() -> RobotModel:
    """The arm with its hand: seven joints and two fingers."""
    root = ElementTree.parse(urdf_path()).getroot()
    joints = tuple(_joint(element) for element in root.findall("joint"))
    meshes = {
        link.attrib["name"]: mesh.attrib["filename"].removeprefix("package://")
        for link in root.findall("link")
        if (mesh := link.find("collision/geometry/mesh")) is not None
    }
    assets = {name: f"panda/{name}" for name in meshes}
    chain = [name for name in ("panda_link0", *(j.child for j in joints)) if name in meshes]
    neighbours = {(a, b) for k, a in enumerate(chain) for b in chain[k + 1 : k + 3]}
    return RobotModel(
        links=("panda_link0", *(j.child for j in joints)),
        joints=joints,
        visuals=assets,
        collisions=assets,
        home=HOME,
        gripper=Gripper(
            HAND, SE3((0.0, 0.0, 0.105)), ("panda_finger_joint1", "panda_finger_joint2"), 0.08
        ),
        no_collide=frozenset({*neighbours, ("panda_hand", "panda_rightfinger")}),
    )


def mesh_vertices(link: str) -> np.ndarray:
    """Vertices of a link's collision mesh in the link frame [m], shape [n, 3]."""
    element = ElementTree.parse(urdf_path()).getroot().find(f"link[@name='{link}']/collision")
    assert element is not None
    name = element.find("geometry/mesh").attrib["filename"].removeprefix("package://")  # type: ignore[union-attr]
    lines = (urdf_path().parent / name).read_text().splitlines()
    rows = [[float(v) for v in line.split()[1:4]] for line in lines if line.startswith("v ")]
    return _origin(element.find("origin")).apply(np.array(rows))


def _joint(element: ElementTree.Element) -> Joint:
    def attributes(name: str) -> dict[str, str]:
        found = element.find(name)
        return {} if found is None else dict(found.attrib)

    limit, axis = attributes("limit"), attributes("axis").get("xyz", "1 0 0")
    x, y, z = (float(v) for v in axis.split())
    return Joint(
        name=element.attrib["name"],
        kind=element.attrib["type"],  # type: ignore[arg-type]
        parent=attributes("parent")["link"],
        child=attributes("child")["link"],
        T_parent_joint=_origin(element.find("origin")),
        axis=(x, y, z),
        lower=float(limit.get("lower", 0.0)),
        upper=float(limit.get("upper", 0.0)),
        mimic=attributes("mimic").get("joint", ""),
        speed_max=float(limit.get("velocity", 0.0)),
    )


def _origin(element: ElementTree.Element | None) -> SE3:
    if element is None:
        return SE3()
    x, y, z = (float(v) for v in element.attrib.get("xyz", "0 0 0").split())
    roll, pitch, yaw = (float(v) / 2 for v in element.attrib.get("rpy", "0 0 0").split())
    about_z = (math.cos(yaw), 0.0, 0.0, math.sin(yaw))
    about_y = (math.cos(pitch), 0.0, math.sin(pitch), 0.0)
    about_x = (math.cos(roll), math.sin(roll), 0.0, 0.0)
    turn = multiply_quaternions(multiply_quaternions(about_z, about_y), about_x)
    return SE3((x, y, z), turn)
