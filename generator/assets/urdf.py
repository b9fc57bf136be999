"""URDF reader: links, joints and geometry.

Source: ROS wiki, urdf/XML. Document type declarations are refused: no entity is ever
expanded. Inertia is not used: arms move as planned, and masses of objects have their own field.
"""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import PurePosixPath
from xml.etree.ElementTree import Element

from gen_data.assets import robot_description
from gen_data.assets.asset_folder import Folder
from gen_data.assets.robot_files import resolve_uri
from gen_data.core.asset_types import Joint
from gen_data.core.errors import AssetError
from gen_data.core.kinematics import leader_of
from gen_data.core.safe_xml import format_position, parse_xml
from gen_data.core.se3 import SE3, Quaternion, Vec3

_MAX_ELEMENTS = 50_000
_KINDS = {"fixed", "revolute", "continuous", "prismatic"}
_HELD = {"floating", "planar"}
"""Kinds that have no single position; such a joint stays where the file places it."""
_ENDLESS_RAD = 100.0
"""Revolute joints with limits beyond this turn without end."""
_ENDLESS_M = 1e3
"""Prismatic joints with limits beyond this have none."""
_UNUSED = ("gazebo", "transmission", "sensor", "ros2_control")
_UNUSED_OF_JOINTS = ("safety_controller", "calibration")


class _Fault(ValueError):
    def __init__(self, element: Element, reason: str) -> None:
        super().__init__(reason)
        self.element = element


def read_urdf(folder: Folder, relative: str) -> robot_description.RobotDescription:
    """Read a URDF file.

    Raises:
        AssetError: if it is malformed, an xacro file, its links form no tree, or it refers outside
            the folder.
    """
    place = str(folder.root / relative)
    root = parse_xml(folder.read(relative), place, "robot", "a URDF", _MAX_ELEMENTS)
    _refuse_xacro(root, place)
    remarks: list[str] = []
    at = root
    try:
        looks = dict(_named_looks(folder, relative, root))
        remarks += _clamped_colors(root)
        links: dict[str, robot_description.Link] = {}
        for name, at in _iterate_unique(root, "link"):
            visuals, collisions = (
                tuple(_read_shapes(folder, relative, at, tag, looks, remarks))
                for tag in ("visual", "collision")
            )
            link = _link_name(name)
            links[link] = robot_description.Link(link, visuals, collisions)
        elements = [element for _, element in _iterate_unique(root, "joint")]
        joints = []
        for at in elements:
            joints.append(_read_joint(at, remarks))
        for k, joint in enumerate(joints):
            at = elements[k]
            leader_of(joint, joints)
        joints = [
            _follow_limits(joint, joints, element)
            for joint, element in zip(joints, elements, strict=True)
        ]
        at = root
        described = robot_description.sort_links(links, joints)
    except robot_description.MisplacedJoint as error:
        at = next(e for e in elements if e.get("name") == error.joint.name)
        raise AssetError(
            f"{place}{format_position(at)}: malformed URDF ({error}); correct it"
        ) from None
    except (ValueError, KeyError) as error:
        reason = f"missing {error}" if isinstance(error, KeyError) else error
        at = error.element if isinstance(error, _Fault) else at
        raise AssetError(
            f"{place}{format_position(at)}: malformed URDF ({reason}); correct it"
        ) from None
    counts = Counter(element.tag for element in root if element.tag in _UNUSED)
    counts += Counter(e.tag for joint in elements for e in joint if e.tag in _UNUSED_OF_JOINTS)
    if counts:
        remarks.append("not used: " + ", ".join(f"{n} <{tag}>" for tag, n in counts.items()))
    return replace(described, remarks=tuple(remarks))


def _refuse_xacro(root: Element, place: str) -> None:
    """Raise AssetError at the first macro, expression or include."""
    for element in root.iter():
        macro = element.tag.startswith("xacro:")
        if macro or any("${" in text or "$(" in text for text in element.attrib.values()):
            found = f"<{element.tag[:40]}>" if macro else "an expression in ${} or $()"
            name = PurePosixPath(place).name
            stem = name.removesuffix(".xacro").removesuffix(".urdf")
            source = name if name.endswith(".xacro") else f"{stem}.urdf.xacro"
            raise AssetError(
                f"{place}{format_position(element)}: {found} is xacro, which is a program and not "
                f"yet a robot; expand it: pip install xacro; xacro {source} > {stem}.urdf"
            )


def _iterate_unique(root: Element, tag: str) -> Iterator[tuple[str, Element]]:
    """Yield name and element of every child of a kind. Raises ValueError for duplicate names."""
    seen: set[str] = set()
    for element in root.findall(tag):
        name = element.get("name", "")
        if not name:
            raise _Fault(element, f"a {tag} without a name")
        if name in seen:
            raise _Fault(element, f"two {tag}s named '{name[:40]}'")
        seen.add(name)
        yield name, element
    if len(seen) > robot_description.MAX_LINKS:
        raise ValueError(f"more than {robot_description.MAX_LINKS} {tag}s")


def _link_name(name: str) -> str:
    """Name of a link in ids of assets, where a slash separates it from its robot."""
    return name.replace("/", "_")


def _named_looks(
    folder: Folder, relative: str, root: Element
) -> Iterator[tuple[str, robot_description.Look]]:
    """Yield all named materials; the last one of a name wins.

    That is the robot's own, as in urdfdom, else the first definition inside a link.
    """
    shared = root.findall("material")
    for material in reversed([*shared, *root.findall("*//material")]):
        look = _read_look(folder, relative, material)
        if look.name and look != robot_description.Look(look.name):
            yield look.name, look


def _clamped_colors(root: Element) -> Iterator[str]:
    """Remarks on colours beyond [0, 1], such as numbers up to 255."""
    for color in root.iter("color"):
        values = _parse_numbers(color.get("rgba", "0 0 0 0"), 4)
        if not all(0.0 <= value <= 1.0 for value in values):
            text = " ".join(f"{value:g}" for value in values)
            yield f"rgba '{text}'{format_position(color)} is limited to [0, 1]"


def _read_look(folder: Folder, relative: str, material: Element) -> robot_description.Look:
    """A material as its element defines it. Raises _Fault."""
    color, texture = material.find("color"), material.find("texture")
    look = robot_description.Look(material.get("name", ""))
    try:
        if color is not None:
            red, green, blue, alpha = (
                min(max(v, 0.0), 1.0) for v in _parse_numbers(color.attrib["rgba"], 4)
            )
            look = replace(look, color=(red, green, blue), opacity=alpha)
        if texture is not None and texture.get("filename"):
            look = replace(look, texture=resolve_uri(folder, relative, texture.attrib["filename"]))
    except (ValueError, KeyError) as error:
        reason = f"missing {error}" if isinstance(error, KeyError) else error
        raise _Fault(material, f"material '{look.name[:40]}': {reason}") from None
    return look


def _read_shapes(
    folder: Folder,
    relative: str,
    link: Element,
    tag: str,
    looks: dict[str, robot_description.Look],
    remarks: list[str],
) -> Iterator[robot_description.Shape]:
    """Yield the shapes of a link that there is something of; remark on the others."""
    for element in link.findall(tag):
        geometry = element.find("geometry")
        where = f"link '{link.get('name', '')[:40]}'{format_position(element)}: <{tag}>"
        if geometry is None or not len(geometry):
            remarks.append(f"{where} without geometry is left out")
            continue
        try:
            shape = _read_shape(folder, relative, geometry[0], _read_pose(element.find("origin")))
            material = element.find("material")
            if material is not None:
                look = _read_look(folder, relative, material)
                if look == robot_description.Look(look.name):
                    look = looks.get(look.name, look)
                shape = replace(shape, look=look)
        except (ValueError, KeyError) as error:
            at = error.element if isinstance(error, _Fault) else element
            reason = f"missing {error}" if isinstance(error, KeyError) else error
            name = link.get("name", "")[:40]
            raise _Fault(at, f"link '{name}': <{tag}>: {reason}") from None
        zeros = shape.size[: _EXTENTS.get(shape.kind, 0)].count(0.0)
        # A flat box is seen: decals and markers.
        if zeros > (tag == "visual" and shape.kind == "box"):
            remarks.append(f"{where} is a {shape.kind} of size 0 and is left out")
        elif tag == "visual" and shape.look.opacity == 0.0:
            remarks.append(f"{where} is invisible (alpha 0) and is left out")
        else:
            yield shape


_EXTENTS = {"box": 3, "cylinder": 2, "capsule": 1, "sphere": 1}
"""Number of sizes that must not be 0."""


def _read_shape(
    folder: Folder, relative: str, element: Element, pose: SE3
) -> robot_description.Shape:
    get = element.attrib
    if element.tag == "mesh":
        file = resolve_uri(folder, relative, get["filename"])
        scale = get.get("scale", "1 1 1").split()
        size = _parse_vector(" ".join(scale * 3 if len(scale) == 1 else scale))
        if 0.0 in size:
            raise ValueError(f"scale '{get['scale'][:40]}' is 0 along an axis")
        return robot_description.Shape("mesh", file, size, pose)
    if element.tag == "box":
        size = _parse_vector(get["size"])
    elif element.tag in ("cylinder", "capsule"):
        size = (_parse_number(get["radius"]), _parse_number(get["length"]), 0.0)
    elif element.tag == "sphere":
        size = (_parse_number(get["radius"]), 0.0, 0.0)
    else:
        raise ValueError(f"unknown geometry <{element.tag[:40]}>")
    if min(size) < 0.0:
        raise ValueError(f"<{element.tag}> of negative size {min(size):g}")
    return robot_description.Shape(element.tag, "", size, pose)


def _read_joint(element: Element, remarks: list[str]) -> Joint:
    name, kind = element.attrib["name"], element.attrib["type"]
    if kind in _HELD:
        remarks.append(
            f"joint '{name[:40]}'{format_position(element)} is {kind} and stays at its origin"
        )
        kind = "fixed"
    if kind not in _KINDS:
        raise ValueError(
            f"joint '{name[:40]}' is of type '{kind[:40]}', not {sorted(_KINDS | _HELD)}"
        )
    limit, axis, mimic = element.find("limit"), element.find("axis"), element.find("mimic")
    lower = upper = 0.0
    if kind in ("revolute", "prismatic") and limit is not None:
        lower, upper = float(limit.get("lower", 0.0)), float(limit.get("upper", 0.0))
        if not lower <= upper:
            raise ValueError(f"joint '{name[:40]}' has lower limit {lower} above upper {upper}")
        where = f"joint '{name[:40]}'{format_position(element)}"
        if kind == "revolute" and max(-lower, upper) > _ENDLESS_RAD:
            remarks.append(f"joint '{name[:40]}': limits of {lower:g} and {upper:g} rad are none")
            kind = "continuous"
        elif kind == "prismatic" and max(-lower, upper) > _ENDLESS_M:
            remarks.append(
                f"{where}: limits of {lower:g} and {upper:g} m are none; it stays at its origin"
            )
            kind, lower, upper = "fixed", 0.0, 0.0
        elif lower == upper and mimic is None:
            remarks.append(f"{where} does not move: its limits are both {lower:g}")
    if kind == "continuous":
        lower, upper = -math.pi, math.pi
    return Joint(
        name=name,
        kind=kind,  # type: ignore[arg-type]
        parent=_linked_name(element, "parent"),
        child=_linked_name(element, "child"),
        T_parent_joint=_read_pose(element.find("origin")),
        axis=(1.0, 0.0, 0.0)
        if kind == "fixed" or axis is None
        else _parse_axis(axis.attrib["xyz"]),
        lower=lower,
        upper=upper,
        mimic="" if mimic is None or kind == "fixed" else mimic.attrib["joint"],
        speed_max=0.0 if limit is None else abs(float(limit.get("velocity", 0.0))),
        mimic_multiplier=1.0 if mimic is None else _parse_number(mimic.get("multiplier", "1")),
        mimic_offset=0.0 if mimic is None else _parse_number(mimic.get("offset", "0")),
    )


def _follow_limits(joint: Joint, joints: list[Joint], element: Element) -> Joint:
    """The joint with limits: a joint that mimics another may leave them to that one.

    Raises:
        _Fault: it has no limits.
    """
    limit = element.find("limit")
    stated = limit is not None and ("lower" in limit.attrib or "upper" in limit.attrib)
    if joint.kind in ("fixed", "continuous") or stated or (limit is not None and not joint.mimic):
        return joint
    if not joint.mimic:
        raise _Fault(
            element,
            f"joint '{joint.name[:40]}' has no limits; give it a <limit>, or the type 'continuous'",
        )
    leader, multiplier, offset = leader_of(joint, joints)
    ends = (multiplier * leader.lower + offset, multiplier * leader.upper + offset)
    return replace(joint, lower=min(ends), upper=max(ends))


def _linked_name(element: Element, tag: str) -> str:
    child = element.find(tag)
    if child is None:
        raise ValueError(f"joint '{element.attrib['name'][:40]}' has no {tag}")
    return _link_name(child.attrib["link"])


def _read_pose(origin: Element | None) -> SE3:
    if origin is None:
        return SE3()
    return SE3(
        _parse_vector(origin.get("xyz", "0 0 0")),
        rpy_to_quaternion(*_parse_vector(origin.get("rpy", "0 0 0"))),
    )


def rpy_to_quaternion(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Quaternion (w, x, y, z) of fixed-axis roll, pitch, yaw [rad].

    Rounded, because the last bits of sine and cosine differ between C libraries.
    """
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    w, x = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
    y, z = cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy
    return (round(w, 12), round(x, 12), round(y, 12), round(z, 12))


def _parse_axis(text: str) -> Vec3:
    x, y, z = _parse_vector(text)
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-9:
        raise ValueError("a joint axis of length zero")
    return (x / length, y / length, z / length)


def _parse_number(text: str) -> float:
    return _parse_numbers(text, 1)[0]


def _parse_vector(text: str) -> Vec3:
    x, y, z = _parse_numbers(text, 3)
    return (x, y, z)


def _parse_numbers(text: str, count: int) -> tuple[float, ...]:
    numbers = tuple(float(word) for word in text.split())
    if len(numbers) != count or not all(math.isfinite(n) for n in numbers):
        raise ValueError(f"'{text[:40]}' is not {'a number' if count == 1 else f'{count} numbers'}")
    return numbers
