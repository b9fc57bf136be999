"""Conversion of MJCF bodies to URDF, for the part of the format that robot descriptions use.

Source: MuJoCo documentation, "XML Reference". Supported are nested bodies with at most one joint
each, hinge or slide, through their own origin; geoms of type mesh, box, cylinder and sphere;
material colours; and defaults of geoms by class. Quaternions are w x y z; sizes are half-extents.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import PurePosixPath
from xml.etree.ElementTree import Element, SubElement

from gen_data.assets.asset_folder import Folder
from gen_data.core import safe_xml, se3
from gen_data.core.errors import AssetError

_MAX_ELEMENTS = 50_000
_VISUAL_GROUP = "1"
_KINDS = {"hinge": "revolute", "slide": "prismatic"}


@dataclass(frozen=True)
class Mjcf:
    """Parsed MJCF file.

    Attributes:
        folder: Folder of the file; mesh paths are relative to it.
        body: Outermost body.
        meshes: ``{name: (file, scale)}``.
        colors: ``{material: "r g b a"}``.
        defaults: ``{class: attributes of its geoms}``.
    """

    folder: PurePosixPath
    body: Element
    meshes: dict[str, tuple[str, str]] = field(default_factory=dict)
    colors: dict[str, str] = field(default_factory=dict)
    defaults: dict[str, dict[str, str]] = field(default_factory=dict)


def read_mjcf(folder: Folder, relative: str) -> Mjcf:
    """Read an MJCF file. Raises AssetError if it is malformed."""
    place = str(folder.root / relative)
    root = safe_xml.parse_xml(folder.read(relative), place, "mujoco", "an MJCF", _MAX_ELEMENTS)
    body = root.find("worldbody/body")
    if body is None:
        raise AssetError(f"{place}: holds no body")
    assets = root.find("asset")
    children = list(assets) if assets is not None else []
    return Mjcf(
        folder=PurePosixPath(relative).parent,
        body=body,
        meshes={
            e.attrib["name"]: (e.attrib["file"], e.get("scale", "1 1 1"))
            for e in children
            if e.tag == "mesh"
        },
        colors={e.attrib["name"]: e.get("rgba", "0.5 0.5 0.5 1") for e in children
                if e.tag == "material"},
        defaults={
            e.attrib["class"]: dict(geom.attrib)
            for e in root.iter("default")
            if "class" in e.attrib and (geom := e.find("geom")) is not None
        },
    )  # fmt: skip


def add_bodies(robot: Element, mjcf: Mjcf, parent: str = "") -> tuple[str, ...]:
    """Append a description's bodies to a URDF ``<robot>`` as links and joints.

    Args:
        robot: The URDF so far.
        mjcf: Description to append.
        parent: Link to which the outermost body is fixed; empty = it is the robot's root.

    Returns:
        Mesh files used, relative to the asset folder.

    Raises:
        AssetError: if URDF cannot express a body's joints.
    """
    return tuple(dict.fromkeys(_add_body(robot, mjcf, mjcf.body, parent)))


def _add_body(robot: Element, mjcf: Mjcf, body: Element, parent: str) -> Iterator[str]:
    name = body.attrib["name"]
    link = SubElement(robot, "link", name=name)
    for geom in body.findall("geom"):
        yield from _add_shape(link, mjcf, geom)
    if parent:
        _add_joint(robot, body, parent)
    for child in body.findall("body"):
        yield from _add_body(robot, mjcf, child, name)


def _add_joint(robot: Element, body: Element, parent: str) -> None:
    name, joints = body.attrib["name"], body.findall("joint")
    moving = joints[0] if joints else None
    kind = "fixed" if moving is None else _KINDS.get(moving.get("type", "hinge"), "")
    place = "0 0 0" if moving is None else moving.get("pos", "0 0 0")
    if len(joints) > 1 or not kind or any(float(x) != 0.0 for x in place.split()):
        raise AssetError(f"body '{name}': only one hinge or slide through its origin is supported")
    joint = SubElement(
        robot, "joint", type=kind, name=f"{name}_mount" if moving is None else moving.attrib["name"]
    )
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=name)
    _add_origin(joint, body)
    if moving is not None:
        lower, upper = moving.attrib["range"].split()
        SubElement(joint, "axis", xyz=moving.get("axis", "0 0 1"))
        SubElement(joint, "limit", lower=lower, upper=upper, effort="0", velocity="0")


def _add_shape(link: Element, mjcf: Mjcf, geom: Element) -> Iterator[str]:
    attributes = {**mjcf.defaults.get(geom.get("class", ""), {}), **geom.attrib}
    seen = attributes.get("group") == _VISUAL_GROUP
    element = SubElement(link, "visual" if seen else "collision")
    _add_origin(element, geom)
    geometry = SubElement(element, "geometry")
    size = [float(x) for x in attributes.get("size", "").split()]
    kind = attributes.get("type", "sphere")
    if kind == "mesh":
        file, scale = mjcf.meshes[attributes["mesh"]]
        path = str(mjcf.folder / file)
        SubElement(geometry, "mesh", filename=path, scale=scale)
        yield path
    elif kind == "box":
        SubElement(geometry, "box", size=" ".join(repr(2.0 * x) for x in size))
    elif kind == "cylinder":
        SubElement(geometry, "cylinder", radius=repr(size[0]), length=repr(2.0 * size[1]))
    elif kind == "sphere":
        SubElement(geometry, "sphere", radius=repr(size[0]))
    else:
        raise AssetError(f"link '{link.get('name')}': geoms of type '{kind}' are not supported")
    name = attributes.get("material", "")
    color = mjcf.colors.get(name, attributes.get("rgba", ""))
    if seen and color:
        material = SubElement(element, "material", name=name or color.replace(" ", "_"))
        SubElement(material, "color", rgba=color)


def _add_origin(element: Element, source: Element) -> None:
    """Add an ``<origin>`` with position and roll, pitch, yaw from MJCF's ``pos`` and ``quat``."""
    w, x, y, z = (float(v) for v in source.get("quat", "1 0 0 0").split())
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    r = se3.SE3(quaternion_wxyz=(w / norm, x / norm, y / norm, z / norm)).rotation()
    pitch = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0]))
    if abs(float(r[2, 0])) < 1.0 - 1e-9:
        roll, yaw = math.atan2(r[2, 1], r[2, 2]), math.atan2(r[1, 0], r[0, 0])
    else:
        # Gimbal lock: only the sum or difference of roll and yaw is defined.
        roll, yaw = 0.0, math.atan2(-r[0, 1], r[1, 1])
    SubElement(
        element,
        "origin",
        xyz=source.get("pos", "0 0 0"),
        rpy=" ".join(repr(round(angle, 12)) for angle in (roll, pitch, yaw)),
    )
