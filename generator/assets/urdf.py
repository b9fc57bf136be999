"""URDF reader: links, joints and geometry.

Source: ROS wiki, urdf/XML. Document type declarations are refused, so that no entity is ever
expanded. Elements that describe neither kinematics nor geometry are ignored.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import PurePosixPath
from xml.etree.ElementTree import Element

from gen_data.generator.assets.asset_folder import Folder
from gen_data.generator.core.asset_types import Joint
from gen_data.generator.core.errors import AssetError
from gen_data.generator.core.kinematics import leader_of
from gen_data.generator.core.safe_xml import format_position, parse_xml
from gen_data.generator.core.se3 import SE3, Vec3

_MAX_ELEMENTS = 50_000
_MAX_LINKS = 500
_KINDS = {"fixed", "revolute", "continuous", "prismatic"}


@dataclass(frozen=True)
class Shape:
    """One visual or collision element.

    Attributes:
        kind: ``mesh``, ``box``, ``cylinder`` or ``sphere``.
        file: Mesh file relative to the folder; empty for primitives.
        size: Scale of a mesh; edges of a box; (radius, length, 0); (radius, 0, 0).
        T_link_shape: Its pose.
        material: Name of the material; empty = unnamed.
        color: sRGB of the material; None = not given.
    """

    kind: str
    file: str
    size: Vec3
    T_link_shape: SE3
    material: str = ""
    color: Vec3 | None = None


@dataclass(frozen=True)
class Link:
    """A rigid link and its geometry."""

    name: str
    visuals: tuple[Shape, ...]
    collisions: tuple[Shape, ...]


@dataclass(frozen=True)
class Urdf:
    """A robot description.

    Attributes:
        links: ``{name: link}``, root first, each after its parent.
        joints: In the order of their child links.
    """

    links: dict[str, Link]
    joints: tuple[Joint, ...]

    def files(self) -> tuple[str, ...]:
        """Every mesh file it refers to, sorted and without duplicates."""
        shapes = [s for link in self.links.values() for s in (*link.visuals, *link.collisions)]
        return tuple(sorted({s.file for s in shapes if s.file}))

    def poses_at_zero(self) -> dict[str, SE3]:
        """``T_root_link`` of every link with all joints at position 0."""
        poses = {next(iter(self.links)): SE3()}
        for joint in self.joints:
            poses[joint.child] = poses[joint.parent] @ joint.T_parent_joint
        return poses


class _MisplacedJoint(ValueError):
    """A joint that keeps links from forming a tree."""

    def __init__(self, joint: Joint, reason: str) -> None:
        super().__init__(f"joint '{joint.name[:40]}' {reason}")
        self.joint = joint


def read_urdf(folder: Folder, relative: str) -> Urdf:
    """Read a URDF file.

    Raises:
        AssetError: if it is malformed, its links form no tree, or it refers outside the folder.
    """
    place = str(folder.root / relative)
    root = parse_xml(folder.read(relative), place, "robot", "a URDF", _MAX_ELEMENTS)
    at = root
    try:
        colors = dict(_named_colors(root))
        links: dict[str, Link] = {}
        for name, at in _iterate_unique(root, "link"):
            shapes = (
                tuple(_read_shapes(folder, relative, at, tag, colors))
                for tag in ("visual", "collision")
            )
            links[name] = Link(name, *shapes)
        elements = [element for _, element in _iterate_unique(root, "joint")]
        joints = []
        for at in elements:
            joints.append(_read_joint(at))
        for k, joint in enumerate(joints):
            at = elements[k]
            leader_of(joint, joints)
        at = root
        return _sort_links(links, joints)
    except _MisplacedJoint as error:
        at = elements[joints.index(error.joint)]
        raise AssetError(
            f"{place}{format_position(at)}: malformed URDF ({error}); correct it"
        ) from None
    except (ValueError, KeyError) as error:
        reason = f"missing {error}" if isinstance(error, KeyError) else error
        raise AssetError(
            f"{place}{format_position(at)}: malformed URDF ({reason}); correct it"
        ) from None


def _iterate_unique(root: Element, tag: str) -> Iterator[tuple[str, Element]]:
    """Yield name and element of every child of a kind. Raises ValueError for duplicate names."""
    seen: set[str] = set()
    for element in root.findall(tag):
        name = element.attrib["name"]
        if name in seen or not name:
            raise ValueError(f"two {tag}s named '{name[:40]}'")
        seen.add(name)
        yield name, element
    if len(seen) > _MAX_LINKS:
        raise ValueError(f"more than {_MAX_LINKS} {tag}s")


def _named_colors(root: Element) -> Iterator[tuple[str, Vec3]]:
    """Yield name and sRGB of all named materials; the first definition comes last and wins."""
    for material in reversed(root.findall(".//material")):
        color = material.find("color")
        if color is not None and material.get("name"):
            yield material.attrib["name"], _parse_numbers(color.attrib["rgba"], 4)[:3]  # type: ignore[misc]


def _read_shapes(
    folder: Folder, relative: str, link: Element, tag: str, colors: dict[str, Vec3]
) -> Iterator[Shape]:
    for element in link.findall(tag):
        geometry = element.find("geometry")
        if geometry is None or not len(geometry):
            continue
        shape = _read_shape(folder, relative, geometry[0], _read_pose(element.find("origin")))
        material = element.find("material")
        if material is not None:
            color = material.find("color")
            name = material.get("name", "")
            own = None
            if color is not None:
                own = _parse_vector(color.attrib["rgba"].rsplit(None, 1)[0])
            shape = replace(shape, material=name, color=own or colors.get(name))
        yield shape


def _read_shape(folder: Folder, relative: str, element: Element, pose: SE3) -> Shape:
    get = element.attrib
    if element.tag == "mesh":
        file = _resolve_mesh(folder, relative, get["filename"])
        scale = get.get("scale", "1 1 1").split()
        size = _parse_vector(" ".join(scale * 3 if len(scale) == 1 else scale))
        return Shape("mesh", file, size, pose)
    if element.tag == "box":
        return Shape("box", "", _parse_vector(get["size"]), pose)
    if element.tag in ("cylinder", "capsule"):
        return Shape("cylinder", "", (float(get["radius"]), float(get["length"]), 0.0), pose)
    if element.tag == "sphere":
        return Shape("sphere", "", (float(get["radius"]), 0.0, 0.0), pose)
    raise ValueError(f"unknown geometry <{element.tag[:40]}>")


def _resolve_mesh(folder: Folder, relative: str, name: str) -> str:
    """Resolve ``package://x/y`` or a relative path to a file below the folder.

    A package is the folder of that name beside or above the URDF. Older descriptions omit the
    package's name, so the path is also tried unchanged.
    """
    if not name.startswith("package://"):
        return folder.refer(relative, name)
    path = name.removeprefix("package://")
    base = PurePosixPath(relative).parent
    candidates = []
    for ancestor in (base, *base.parents):
        at = str(ancestor / "x.urdf")
        candidates.append(folder.refer(at, path))
        if ancestor.name == PurePosixPath(path).parts[0]:
            candidates.append(folder.refer(at, "/".join(PurePosixPath(path).parts[1:])))
    return next((c for c in candidates if folder.exists(c)), candidates[0])


def _read_joint(element: Element) -> Joint:
    name, kind = element.attrib["name"], element.attrib["type"]
    if kind not in _KINDS:
        raise ValueError(f"joint '{name[:40]}' is of type '{kind[:40]}', not {sorted(_KINDS)}")
    limit, axis, mimic = element.find("limit"), element.find("axis"), element.find("mimic")
    lower = upper = 0.0
    if kind == "continuous":
        lower, upper = -math.pi, math.pi
    elif kind != "fixed":
        if limit is None:
            raise ValueError(f"joint '{name[:40]}' has no limits")
        lower, upper = float(limit.get("lower", 0.0)), float(limit.get("upper", 0.0))
        if not lower <= upper:
            raise ValueError(f"joint '{name[:40]}' has lower limit {lower} above upper {upper}")
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


def _linked_name(element: Element, tag: str) -> str:
    child = element.find(tag)
    if child is None:
        raise ValueError(f"joint '{element.attrib['name'][:40]}' has no {tag}")
    return child.attrib["link"]


def _sort_links(links: dict[str, Link], joints: list[Joint]) -> Urdf:
    """Sort links depth first from the root. Raises ValueError if they form no tree."""
    by_parent: dict[str, list[Joint]] = {}
    for joint in joints:
        if joint.parent not in links or joint.child not in links:
            raise _MisplacedJoint(joint, "refers to a missing link")
        by_parent.setdefault(joint.parent, []).append(joint)
    children = [joint.child for joint in joints]
    for k, joint in enumerate(joints):
        if joint.child in children[:k]:
            reason = f"closes a loop: link '{joint.child[:40]}' has another parent already"
            raise _MisplacedJoint(joint, reason)
    roots = [name for name in links if name not in set(children)]
    if len(roots) != 1:
        raise ValueError(f"its links form no tree: {len(roots)} of them have no parent")
    order, ordered_joints, pending = [roots[0]], [], list(reversed(by_parent.get(roots[0], [])))
    while pending:
        joint = pending.pop()
        ordered_joints.append(joint)
        order.append(joint.child)
        pending += reversed(by_parent.get(joint.child, []))
    if len(order) != len(links):
        loop = next(joint for joint in joints if joint.child not in order)
        raise _MisplacedJoint(loop, "is part of a loop")
    return Urdf({name: links[name] for name in order}, tuple(ordered_joints))


def _read_pose(origin: Element | None) -> SE3:
    if origin is None:
        return SE3()
    return SE3(
        _parse_vector(origin.get("xyz", "0 0 0")),
        _quaternion(*_parse_vector(origin.get("rpy", "0 0 0"))),
    )


def _quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
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
