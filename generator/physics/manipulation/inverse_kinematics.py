"""Stateless inverse kinematics: damped least squares from a fixed sequence of starts.

Sources: Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method",
IEEE Trans. Robotics 27(5), 2011, for the damping; Roberts, "The unreasonable effectiveness of
quasirandom sequences", 2018, for the starts. Plain floats: numpy is slower on matrices of six by
seven, and a fixed order of summation gives the same bits on every processor.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gen_data.core.asset_types import Gripper, Joint, RobotModel
from gen_data.core.kinematics import arm_joints, joint_transform, leader_of, position_limits
from gen_data.core.se3 import SE3, Vec3, rotate_by_quaternion

POSITION_TOLERANCE_M = 1e-3
ANGLE_TOLERANCE_RAD = math.radians(0.5)

EXACT = 0.01
"""Share of the tolerances for grasping a body in place."""

_ITERATIONS_MAX = 40
_STARTS_MAX = 6
_LENGTH_M_PER_RAD = 0.25
"""Weight of angles against distances: about the length of a hand."""
_DAMPING = 1e-5
_STEP_MAX = 0.6
"""Largest change of a joint in one iteration [rad or m]; beyond it linearisation fails."""

Row = list[float]


@dataclass(frozen=True, slots=True)
class Chain:
    """The joints from a robot's base to its grasp frame; fixed joints are part of the offsets.

    Attributes:
        joints: From the base on, including joints that mimic an arm joint.
        offsets: Pose of each joint frame in the previous joint's child link.
        drives: Per joint: index into ``solved`` of the joint that drives it, multiplier, offset.
        T_last_grasp: Grasp frame in the last joint's child link.
        solved: The arm joints to solve for.
        limits: Lowest and highest position of each of them [rad or m].
        indices: Index of each of them among the robot's arm joints.
        rest: A position per arm joint of the robot, for joints off the chain.
    """

    joints: tuple[Joint, ...]
    offsets: tuple[SE3, ...]
    drives: tuple[tuple[int, float, float], ...]
    T_last_grasp: SE3
    solved: tuple[Joint, ...]
    limits: tuple[tuple[float, float], ...]
    indices: tuple[int, ...]
    rest: tuple[float, ...]

    @property
    def reach_m(self) -> float:
        """Upper bound of the distance between the base and the grasp frame."""
        travel = sum(max(abs(j.lower), abs(j.upper)) for j in self.joints if j.kind == "prismatic")
        offsets = (*self.offsets, self.T_last_grasp)
        return travel + sum(math.dist(o.translation_m, (0.0, 0.0, 0.0)) for o in offsets)


def make_chain(robot: RobotModel, gripper: Gripper) -> Chain:
    """The chain that moves a robot's grasp frame."""
    by_child = {joint.child: joint for joint in robot.joints}
    path: list[Joint] = []
    link = gripper.link
    while link in by_child:
        path.insert(0, by_child[link])
        link = by_child[link].parent
    arm = arm_joints(robot)
    joints, offsets, drives, pending = [], [], [], SE3()
    for joint in path:
        pending = pending @ joint.T_parent_joint
        leader, multiplier, offset = leader_of(joint, robot.joints)
        if leader in arm:
            joints.append(joint)
            offsets.append(pending)
            drives.append((leader, multiplier, offset))
            pending = SE3()
    homes = dict(zip((j.name for j in robot.movable), robot.home, strict=True))
    solved = tuple(dict.fromkeys(leader for leader, _, _ in drives))
    return Chain(
        joints=tuple(joints),
        offsets=tuple(offsets),
        drives=tuple((solved.index(leader), m, offset) for leader, m, offset in drives),
        T_last_grasp=pending @ gripper.T_link_grasp,
        solved=solved,
        limits=tuple(position_limits(joint, robot) for joint in solved),
        indices=tuple(arm.index(joint) for joint in solved),
        rest=tuple(homes[joint.name] for joint in arm),
    )


def grasp_pose(chain: Chain, positions: Sequence[float]) -> SE3:
    """``T_base_grasp`` at positions of all arm joints [rad or m]."""
    return _jacobian(chain, [positions[index] for index in chain.indices])[0]


def solve_all(chain: Chain, T_base_grasp: SE3) -> Iterator[tuple[float, ...]]:
    """Yield arm positions that put the grasp frame at a pose, one per start, home first.

    A start that does not converge yields nothing; several starts may yield the same solution.
    """
    if math.dist(T_base_grasp.translation_m, (0.0, 0.0, 0.0)) > chain.reach_m:
        return
    for number in range(_STARTS_MAX):
        found = solve(chain, T_base_grasp, _start(chain, number))
        if found is not None:
            yield _complete_positions(chain, found, chain.rest)


def solve_near(
    chain: Chain, T_base_grasp: SE3, positions: Sequence[float], share: float = EXACT
) -> tuple[float, ...] | None:
    """Arm positions that put the grasp frame at a pose, from a given start; None without solution.

    Args:
        chain: The arm.
        T_base_grasp: The pose.
        positions: The start, one per arm joint [rad or m].
        share: Share of the tolerances that the solution must meet.
    """
    found = solve(chain, T_base_grasp, [positions[index] for index in chain.indices], share)
    return None if found is None else _complete_positions(chain, found, positions)


def solve(
    chain: Chain, T_base_grasp: SE3, start: Sequence[float], share: float = 1.0
) -> tuple[float, ...] | None:
    """Positions of the solved joints within their limits; None if the descent fails to converge."""
    positions = list(start)
    for _ in range(_ITERATIONS_MAX):
        pose, columns = _jacobian(chain, positions)
        error = _error(T_base_grasp, pose)
        if _is_reached(error, share):
            return tuple(positions)
        _step(chain, positions, columns, error)
    return None


def _complete_positions(
    chain: Chain, found: Sequence[float], others: Sequence[float]
) -> tuple[float, ...]:
    """Positions of all arm joints: ``found`` on the chain, ``others`` off it."""
    positions = list(others)
    for index, value in zip(chain.indices, found, strict=True):
        positions[index] = value
    return tuple(positions)


def _start(chain: Chain, number: int) -> list[float]:
    """Start 0 is home, start 1 mid-range; the rest spread quasirandomly over the inner ranges."""
    if number == 0:
        return [chain.rest[index] for index in chain.indices]
    ratio = _spread_ratio(len(chain.solved))
    start, power = [], 1.0
    for lower, upper in chain.limits:
        power /= ratio
        fraction = (0.5 + (number - 1) * power) % 1.0
        start.append(lower + (0.15 + 0.7 * fraction) * (upper - lower))
    return start


def _spread_ratio(dimensions: int) -> float:
    """The root of ``x^(d + 1) = x + 1``: the golden ratio of ``d`` dimensions."""
    low, high = 1.0, 2.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if middle ** (dimensions + 1) < middle + 1.0 else (low, middle)
    return low


def _jacobian(chain: Chain, positions: Sequence[float]) -> tuple[SE3, list[Row]]:
    """``T_base_grasp``, and its derivative by each solved joint: 3 linear, 3 weighted angular."""
    pose = SE3()
    frames: list[tuple[Vec3, Vec3]] = []
    for joint, frame, drive in zip(chain.joints, chain.offsets, chain.drives, strict=True):
        pose = pose @ frame
        frames.append((pose.translation_m, rotate_by_quaternion(pose.quaternion_wxyz, joint.axis)))
        index, multiplier, offset = drive
        pose = pose @ joint_transform(joint, multiplier * positions[index] + offset)
    pose = pose @ chain.T_last_grasp
    px, py, pz = pose.translation_m
    columns = [[0.0] * 6 for _ in chain.solved]
    for joint, drive, (origin, (ax, ay, az)) in zip(
        chain.joints, chain.drives, frames, strict=True
    ):
        if joint.kind == "prismatic":
            motion = [ax, ay, az, 0.0, 0.0, 0.0]
        else:
            x, y, z = px - origin[0], py - origin[1], pz - origin[2]
            weighted = [_LENGTH_M_PER_RAD * a for a in (ax, ay, az)]
            motion = [ay * z - az * y, az * x - ax * z, ax * y - ay * x, *weighted]
        column = columns[drive[0]]
        for k, change in enumerate(motion):
            column[k] += drive[1] * change
    return pose, columns


def _error(target: SE3, pose: SE3) -> Row:
    """Difference to the target: metres, and weighted ``2 sin(angle / 2)`` about each axis, [6]."""
    tx, ty, tz = target.translation_m
    px, py, pz = pose.translation_m
    tw, tqx, tqy, tqz = target.quaternion_wxyz
    w, x, y, z = pose.quaternion_wxyz
    cosine = tw * w + tqx * x + tqy * y + tqz * z
    scale = math.copysign(2.0 * _LENGTH_M_PER_RAD, cosine)
    return [
        tx - px,
        ty - py,
        tz - pz,
        scale * (tqx * w - tw * x - tqy * z + tqz * y),
        scale * (tqy * w - tw * y - tqz * x + tqx * z),
        scale * (tqz * w - tw * z - tqx * y + tqy * x),
    ]


def _is_reached(error: Row, share: float) -> bool:
    # Half the tolerance: rounding the positions cannot leave it.
    distance = math.sqrt(sum(e * e for e in error[:3]))
    angle = math.sqrt(sum(e * e for e in error[3:])) / _LENGTH_M_PER_RAD
    half = 0.5 * share
    return distance < half * POSITION_TOLERANCE_M and angle < half * ANGLE_TOLERANCE_RAD


def _step(chain: Chain, positions: Row, columns: list[Row], error: Row) -> None:
    """Take one damped step in place; joints that would leave their limits are held."""
    damping = 0.5 * sum(e * e for e in error) * 1e-2 + _DAMPING
    free = list(range(len(chain.solved)))
    for _ in range(2):
        change = _solve_damped(([columns[k] for k in free]), error, damping)
        largest = max((abs(c) for c in change), default=0.0)
        scale = min(1.0, _STEP_MAX / largest) if largest > 0.0 else 0.0
        wanted = {k: positions[k] + scale * c for k, c in zip(free, change, strict=True)}
        pinned = [k for k in free if _pushes_out(chain, k, positions[k], wanted[k])]
        if not pinned:
            break
        free = [k for k in free if k not in pinned]
    for k, value in wanted.items():
        lower, upper = chain.limits[k]
        endless = chain.solved[k].kind == "continuous"
        positions[k] = value if endless else min(max(value, lower), upper)


def _pushes_out(chain: Chain, k: int, position: float, wanted: float) -> bool:
    """Whether a step takes the k-th solved joint farther beyond its limits."""
    if chain.solved[k].kind == "continuous":
        return False
    lower, upper = chain.limits[k]
    return (position <= lower and wanted < position) or (position >= upper and wanted > position)


def _solve_damped(columns: list[Row], error: Row, damping: float) -> Row:
    """``J^T (J J^T + damping I)^-1 error``, by Cholesky's decomposition."""
    size = len(error)
    matrix = [[sum(c[i] * c[j] for c in columns) for j in range(i + 1)] for i in range(size)]
    for i in range(size):
        matrix[i][i] += damping
        for j in range(i + 1):
            rest = matrix[i][j] - sum(matrix[i][k] * matrix[j][k] for k in range(j))
            matrix[i][j] = math.sqrt(rest) if i == j else rest / matrix[j][j]
    y = [0.0] * size
    for i in range(size):
        y[i] = (error[i] - sum(matrix[i][k] * y[k] for k in range(i))) / matrix[i][i]
    for i in reversed(range(size)):
        y[i] = (y[i] - sum(matrix[k][i] * y[k] for k in range(i + 1, size))) / matrix[i][i]
    return [sum(c[i] * y[i] for i in range(size)) for c in columns]
