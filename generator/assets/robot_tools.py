"""Tools made by code for arms whose description ends at the flange: fingers, or a suction cup.

A tool is a few links of boxes and cylinders, joined to the flange; the arm with its tool is read
from then on like any other robot. Its frame is the flange's, with Z out of the arm.
"""

import math
from dataclasses import replace

from gen_data.assets.folder_index import ToolEntry
from gen_data.assets.robot_description import FORMAT_ROOTS, Link, Look, RobotDescription, Shape
from gen_data.core.asset_types import Gripper, Joint, SuctionCup
from gen_data.core.errors import AssetError, did_you_mean
from gen_data.core.se3 import SE3, Vec3

VERSION = 2
"""Increased whenever a tool gets another geometry."""
BASE = "tool"
FINGERS = ("tool_left_finger", "tool_right_finger")
STROKE_M = 0.084
"""Stroke of the fingers, like a Panda hand's (0.08) or a Robotiq 2F-85's (0.085)."""
VACUUM_PA = 60_000.0
"""Below the pressure of the air: usual for airtight surfaces (assumed)."""

_PALM_M: Vec3 = (0.06, 0.11, 0.05)
"""Short enough for a camera next to it to see the fingers."""
_FINGER_M: Vec3 = (0.02, 0.014, 0.09)
_TIP_M = 0.009
"""The finger tips are this far beyond the grasp frame's origin."""
_FINGER_SPEED_M_S = 0.1
_TUBE_M, _LIP_M = 0.1, 0.02
"""Lengths of the tube of a cup and of its bellows."""
_CUP_RADIUS_M, _TUBE_RADIUS_M = 0.015, 0.011
_DARK: Vec3 = (0.34, 0.34, 0.35)
_RUBBER: Vec3 = (0.12, 0.16, 0.3)


def with_tool(
    arm: RobotDescription, tool: ToolEntry, place: str, hand: RobotDescription | None = None
) -> RobotDescription:
    """The robot with a tool on its flange; its links come last.

    Args:
        arm: The robot.
        tool: Where the tool is, and its kind.
        place: Name of the robot in error messages.
        hand: Description of a tool of the kind ``file``.

    Raises:
        AssetError: there is no such flange, or it or a link of the tool's names exists already.
    """
    for name in (tool.flange, *([tool.instead_of] if tool.instead_of else [])):
        if name not in arm.links:
            raise AssetError(
                f"{place}: no link '{name}'{did_you_mean(name, list(arm.links))}; correct the "
                "entry 'tool' of the asset index"
            )
    kept = _without(arm, tool.instead_of)
    if tool.flange not in kept.links:
        raise AssetError(
            f"{place}: 'instead_of: {tool.instead_of}' removes the flange '{tool.flange}' too; "
            "correct the entry 'tool' of the asset index"
        )
    T_flange_tool = SE3.about_z(math.radians(tool.yaw_deg), (0.0, 0.0, tool.offset_m))
    if hand is None:
        links, joints = _suction_cup() if tool.kind == "suction" else _fingers()
    else:
        links, joints = _with_own_root(hand)
        kept = replace(
            kept,
            home={**kept.home, **hand.home},
            included=(*kept.included, *hand.included),
            remarks=(*kept.remarks, *hand.remarks),
        )
    base = _fixed_joint(tool.flange, links[0].name, T_flange_tool)
    taken = sorted({*kept.links} & {link.name for link in links})
    taken += sorted({j.name for j in kept.joints} & {j.name for j in joints})
    if taken:
        raise AssetError(
            f"{place}: it has a link or joint '{taken[0]}', as its tool has; rename one of them"
        )
    every = {**kept.links, **{x.name: x for x in links}}
    return replace(kept, links=every, joints=(*kept.joints, base, *joints))


def _with_own_root(hand: RobotDescription) -> tuple[list[Link], list[Joint]]:
    """Links and joints of a tool; a root that only its format has is called ``tool``."""
    links, joints = list(hand.links.values()), list(hand.joints)
    root = links[0].name
    if root in FORMAT_ROOTS:
        links[0] = replace(links[0], name=BASE)
        joints = [replace(j, parent=BASE) if j.parent == root else j for j in joints]
    return links, joints


def tool_gripper(tool: ToolEntry) -> Gripper:
    """The gripper of a tool."""
    if tool.kind == "suction":
        tip = SE3((0.0, 0.0, _TUBE_M + _LIP_M))
        # Difference of pressures times the area within the rim.
        force_n = VACUUM_PA * math.pi * _CUP_RADIUS_M**2
        return Gripper(BASE, tip, (), 0.0, cup=SuctionCup(_CUP_RADIUS_M, round(force_n, 1)))
    between = SE3((0.0, 0.0, _PALM_M[2] + _FINGER_M[2] - _TIP_M))
    return Gripper(BASE, between, tuple(f"{name}_joint" for name in FINGERS), STROKE_M)


def _without(arm: RobotDescription, link: str) -> RobotDescription:
    gone = {link}
    for joint in arm.joints:
        if joint.parent in gone:
            gone.add(joint.child)
    joints = tuple(joint for joint in arm.joints if joint.child not in gone)
    links = {name: x for name, x in arm.links.items() if name not in gone}
    return replace(arm, links=links, joints=joints)


def _fingers() -> tuple[list[Link], list[Joint]]:
    """A palm with two fingers that open along Y."""
    links, joints = [_link(BASE, _box(_PALM_M, (0.0, 0.0, 0.5 * _PALM_M[2])))], []
    for name, side in zip(FINGERS, (1.0, -1.0), strict=True):
        middle = (0.0, 0.5 * side * _FINGER_M[1], 0.5 * _FINGER_M[2])
        links.append(_link(name, _box(_FINGER_M, middle)))
        joint = _fixed_joint(BASE, name, SE3((0.0, 0.0, _PALM_M[2])))
        joints.append(
            replace(
                joint,
                kind="prismatic",
                axis=(0.0, side, 0.0),
                upper=0.5 * STROKE_M,
                speed_max=_FINGER_SPEED_M_S,
            )
        )
    return links, joints


def _suction_cup() -> tuple[list[Link], list[Joint]]:
    """A tube with a bellows whose lip ends at the grasp frame."""
    tube = Shape(
        "cylinder",
        "",
        (_TUBE_RADIUS_M, _TUBE_M, 0.0),
        SE3((0.0, 0.0, 0.5 * _TUBE_M)),
        Look("tool", _DARK),
    )
    lip = Shape(
        "cylinder",
        "",
        (_CUP_RADIUS_M + 0.002, _LIP_M, 0.0),
        SE3((0.0, 0.0, _TUBE_M + 0.5 * _LIP_M)),
        Look("rubber", _RUBBER),
    )
    return [_link(BASE, tube, lip)], []


def _box(size_m: Vec3, middle_m: Vec3) -> Shape:
    return Shape("box", "", size_m, SE3(middle_m), Look("tool", _DARK))


def _link(name: str, *shapes: Shape) -> Link:
    return Link(name, shapes, shapes)


def _fixed_joint(parent: str, child: str, T_parent_joint: SE3) -> Joint:
    return Joint(
        f"{child}_joint", "fixed", parent, child, T_parent_joint, (1.0, 0.0, 0.0), 0.0, 0.0
    )
