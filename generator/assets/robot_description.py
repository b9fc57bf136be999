"""Links, joints and geometry of a robot or another jointed object, whatever file describes it.

Readers: ``urdf``, ``mjcf``, ``sdf``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from gen_data.core import asset_types, kinematics
from gen_data.core.se3 import SE3, Vec3

MAX_LINKS = 500
FORMAT_ROOTS = ("world", "__model__")
"""Root links of MJCF and SDF, which no body of the file stands for."""


@dataclass(frozen=True)
class Look:
    """Material that a description gives to a shape.

    Attributes:
        name: Its name; empty = unnamed.
        color: sRGB; None = not given.
        opacity: Share in (0, 1] of the background that it hides.
        texture: Image, relative to the folder; empty = none.
        roughness, metallic: In [0, 1]; None = not given.
        whole: Whether materials of the mesh file itself have no effect.
    """

    name: str = ""
    color: Vec3 | None = None
    opacity: float = 1.0
    texture: str = ""
    roughness: float | None = None
    metallic: float | None = None
    whole: bool = False


@dataclass(frozen=True)
class Shape:
    """One visual or collision element.

    Attributes:
        kind: ``mesh``, ``box``, ``cylinder``, ``capsule``, ``sphere`` or ``ellipsoid``.
        file: Mesh file relative to the folder; empty for primitives.
        size: Scale of a mesh; edges of a box; (radius, length, 0), of a capsule without its caps;
            (radius, 0, 0); radii of an ellipsoid.
        T_link_shape: Its pose.
        look: Its material.
        part: Name of the object of the mesh file that alone is used; empty = all of them.
        centered: Whether the middle of that part is moved to the origin of the file.
    """

    kind: str
    file: str
    size: Vec3
    T_link_shape: SE3
    look: Look = Look()
    part: str = ""
    centered: bool = False


@dataclass(frozen=True)
class Link:
    """A rigid link and its geometry."""

    name: str
    visuals: tuple[Shape, ...]
    collisions: tuple[Shape, ...]


@dataclass(frozen=True)
class DescriptionParts:
    """A ``RobotDescription`` without mappings, whose order JSON would lose."""

    links: tuple[Link, ...]
    joints: tuple[asset_types.Joint, ...]
    home: tuple[tuple[str, float], ...]
    included: tuple[str, ...]
    remarks: tuple[str, ...]

    def whole(self) -> "RobotDescription":
        """The description."""
        links, home = {link.name: link for link in self.links}, dict(self.home)
        return RobotDescription(links, self.joints, home, self.included, self.remarks)


@dataclass(frozen=True)
class RobotDescription:
    """Content of a description.

    Attributes:
        links: ``{name: link}``, root first, each after its parent.
        joints: In the order of their child links.
        home: Positions [rad or m] by joint that the file itself proposes.
        included: Further files of the description, relative to the folder.
        remarks: Unused contents of the file, for the user.
    """

    links: dict[str, Link]
    joints: tuple[asset_types.Joint, ...]
    home: dict[str, float] = field(default_factory=dict)
    included: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def parts(self) -> DescriptionParts:
        """Itself, to be stored."""
        links, home = tuple(self.links.values()), tuple(self.home.items())
        return DescriptionParts(links, self.joints, home, self.included, self.remarks)

    def files(self) -> tuple[str, ...]:
        """Every other file that it consists of, sorted and without duplicates."""
        shapes = [s for link in self.links.values() for s in (*link.visuals, *link.collisions)]
        return tuple(
            sorted({f for s in shapes for f in (s.file, s.look.texture) if f} | {*self.included})
        )

    def poses_at_rest(self) -> dict[str, SE3]:
        """``T_root_link`` of every link, as a rigid object.

        Joints are at 0, or in the middle of limits that exclude 0; mimic joints follow others.
        """
        free = {j.name: rest_position(j) for j in self.joints if j.movable and not j.mimic}
        movable = [joint.name for joint in self.joints if joint.movable]
        positions = dict(zip(movable, kinematics.positions_of(self.joints, free), strict=True))
        poses = {next(iter(self.links)): SE3()}
        for joint in self.joints:
            pose = poses[joint.parent] @ joint.T_parent_joint
            position = positions.get(joint.name, 0.0)
            if position:
                turned = kinematics.joint_transform(joint, position)
                pose = (pose @ turned).rounded(_DECIMALS)
            poses[joint.child] = pose
        return poses


def rest_position(joint: asset_types.Joint) -> float:
    """Position [rad or m] of a joint that nothing sets: 0, or the middle of its limits."""
    return 0.0 if joint.lower <= 0.0 <= joint.upper else 0.5 * (joint.lower + joint.upper)


class MisplacedJoint(ValueError):
    """A joint that keeps links from forming a tree."""

    def __init__(self, joint: asset_types.Joint, reason: str) -> None:
        super().__init__(f"joint '{joint.name[:40]}' {reason}")
        self.joint = joint


def sort_links(links: Mapping[str, Link], joints: Sequence[asset_types.Joint]) -> RobotDescription:
    """Sort links depth first from the root.

    Raises:
        MisplacedJoint: a joint closes a loop, or refers to a missing link.
        ValueError: not exactly one link has no parent.
    """
    by_parent: dict[str, list[asset_types.Joint]] = {}
    for joint in joints:
        if joint.parent not in links or joint.child not in links:
            raise MisplacedJoint(joint, "refers to a missing link")
        by_parent.setdefault(joint.parent, []).append(joint)
    children = [joint.child for joint in joints]
    for k, joint in enumerate(joints):
        if joint.child in children[:k]:
            reason = f"closes a loop: link '{joint.child[:40]}' has another parent already"
            raise MisplacedJoint(joint, reason)
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
        raise MisplacedJoint(loop, "is part of a loop")
    return RobotDescription({name: links[name] for name in order}, tuple(ordered_joints))


@dataclass(frozen=True)
class PlacedJoint:
    """A joint of a format that gives axes apart from the frames of links.

    Attributes:
        joint: Without ``T_parent_joint`` and ``axis``.
        anchor_m: A point on its axis, in the frame of the root.
        axis: Unit axis in the frame of the root.
        position: Its position [rad or m] in the poses of the links.
    """

    joint: asset_types.Joint
    anchor_m: Vec3
    axis: Vec3
    position: float = 0.0


def jointed(
    links: Mapping[str, Link], poses: Mapping[str, SE3], joints: Sequence[PlacedJoint]
) -> RobotDescription:
    """A description from poses ``T_root_link`` and joints in the frame of the root.

    A turning link's frame moves to its joint's anchor, and keeps the directions of its axes.

    Raises:
        ValueError: as ``sort_links``.
    """
    frames = dict(poses)
    for placed in joints:
        if placed.joint.kind in ("revolute", "continuous"):
            child = placed.joint.child
            frames[child] = SE3(placed.anchor_m, poses[child].quaternion_wxyz)
    finished = []
    for placed in joints:
        parent, child = placed.joint.parent, placed.joint.child
        if parent not in frames or child not in frames:
            raise MisplacedJoint(placed.joint, "refers to a missing link")
        axis = _rounded(frames[child].inverse().rotate(placed.axis))  # type: ignore[arg-type]
        joint = replace(placed.joint, axis=axis)
        T_parent_child = frames[parent].inverse() @ frames[child]
        if placed.position:
            T_parent_child = T_parent_child @ kinematics.joint_transform(joint, -placed.position)
        finished.append(replace(joint, T_parent_joint=T_parent_child.rounded(_DECIMALS)))
    moved = {
        name: _moved(link, frames[name].inverse() @ poses[name]) for name, link in links.items()
    }
    return sort_links(moved, finished)


_DECIMALS = 9
"""Of lengths [m] and axes that another library computed: its last bits depend on the processor."""


def _moved(link: Link, T_frame_link: SE3) -> Link:
    """A link whose geometry is stated in another frame."""
    visuals, collisions = (
        tuple(
            replace(s, T_link_shape=(T_frame_link @ s.T_link_shape).rounded(_DECIMALS)) for s in k
        )
        for k in (link.visuals, link.collisions)
    )
    return Link(link.name, visuals, collisions)


def _rounded(vector: Sequence[float]) -> Vec3:
    x, y, z = (round(float(v), _DECIMALS) + 0.0 for v in vector)
    return (x, y, z)
