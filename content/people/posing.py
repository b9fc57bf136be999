"""Poses of people who walk, run, stand or sit: joint angles, bone rotations, points that move.

Angles of ``poses.yaml`` and ``gaits.yaml`` are in degrees, as in tables of gait analysis: hip and
knee flexion, ankle dorsiflexion and shoulder flexion (arm forward) are positive. Limbs take their
direction from them, independent of the template's own pose: a bone is first turned until it hangs
straight down, and then swung from there. Linear blend skinning: Magnenat-Thalmann, Laperrière and
Thalmann, "Joint-dependent local deformations for hand animation and object grasping", Graphics
Interface 1988.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.people.body import Array, BodyTemplate, Indices

PHASES = 16
"""A stride is divided into this many steps, from one heel strike to the next of the same foot."""


@dataclass(frozen=True, slots=True)
class Leg:
    """Joint angles of one leg [deg].

    Attributes:
        toes: Bends them up against the foot.
        out: Away from the other leg.
    """

    hip: float = 0.0
    knee: float = 0.0
    ankle: float = 0.0
    toes: float = 0.0
    out: float = 0.0


@dataclass(frozen=True, slots=True)
class Arm:
    """Joint angles of one arm [deg].

    Attributes:
        swing: Upper arm forward.
        out: Upper arm away from the body.
        elbow: Flexion.
        inward: Rotation of the forearm towards the body's middle.
        curl: Flexion of each finger joint.
    """

    swing: float = 0.0
    out: float = 8.0
    elbow: float = 12.0
    inward: float = 8.0
    curl: float = 20.0


@dataclass(frozen=True, slots=True)
class Stance:
    """Joint angles of a whole body [deg].

    Attributes:
        lean: Trunk forward.
        nod: Head downward.
        twist: Pelvis to the left; the shoulders turn as far to the right.
        bow: Pelvis, and all above it, forward.
        turn: Head to the left.
        tilt: Head down to the right.
        level: Whether the pelvis drops to one side until both feet stand.
    """

    left_leg: Leg = Leg()
    right_leg: Leg = Leg()
    left_arm: Arm = Arm()
    right_arm: Arm = Arm()
    lean: float = 0.0
    nod: float = 0.0
    twist: float = 0.0
    bow: float = 0.0
    turn: float = 0.0
    tilt: float = 0.0
    level: bool = False


@dataclass(frozen=True, slots=True)
class _Gait:
    """A row of ``gaits.yaml``."""

    hip: tuple[float, ...]
    knee: tuple[float, ...]
    ankle: tuple[float, ...]
    toes: tuple[float, ...]
    arm: Arm
    arm_swing: float
    elbow_swing: float
    lean: float
    twist: float


@dataclass(frozen=True, slots=True)
class _Pose:
    """A row of ``poses.yaml``.

    Attributes:
        gait: Row of ``gaits.yaml`` that moves legs and arms; empty = the pose stands or sits.
        stride, swing: Factors on the gait's hip angles and on its swing of the arms.
        leg, arm: Angles of both sides; in a gait, arms swing about ``arm``.
        right_leg, left_arm, right_arm: Angles of one side, which replace the pose's or gait's.
        held: Item in the hands, see ``carried_things``; empty = none.
        share: Relative frequency with which it is drawn.
    """

    behaviour: str
    gait: str = ""
    stride: float = 1.0
    swing: float = 1.0
    leg: Leg = Leg()
    right_leg: Leg | None = None
    arm: Arm | None = None
    left_arm: Arm | None = None
    right_arm: Arm | None = None
    lean: float = 0.0
    nod: float = 0.0
    bow: float = 0.0
    turn: float = 0.0
    tilt: float = 0.0
    held: str = ""
    share: float = 0.0


_GAITS = load_table(__package__, "gaits", _Gait)
_POSES = load_table(__package__, "poses", _Pose)
POSES = tuple(_POSES)
BEHAVIOURS = {name: pose.behaviour for name, pose in _POSES.items()}
SHARES = {name: pose.share for name, pose in _POSES.items()}
HELD = {name: pose.held for name, pose in _POSES.items()}
MOVING_POSES = tuple(name for name, pose in _POSES.items() if pose.gait)
"""Poses with a stride: their phase changes while a person walks."""


def shorten_stride(stance: Stance, share: float) -> Stance:
    """Shorten the steps of a stride, for narrow clothes."""
    left, right = (
        replace(
            leg, hip=share * leg.hip, knee=leg.knee * (0.5 + 0.5 * share), ankle=leg.ankle * share
        )
        for leg in (stance.left_leg, stance.right_leg)
    )
    return replace(stance, left_leg=left, right_leg=right)


def stance(pose: str, step: int) -> Stance:
    """Joint angles of a pose.

    Args:
        pose: Name of the pose.
        step: Sixteenth of the stride of the left leg, 0 = its heel strikes; poses with a gait.
    """
    row = _POSES[pose]
    if row.gait:
        made = _stride(_adapted(_GAITS[row.gait], row), step % PHASES)
        if row.stride != 1.0:
            made = shorten_stride(made, row.stride)
    else:
        arm = row.arm or Arm()
        made = Stance(row.leg, row.right_leg or row.leg, arm, arm, level=row.right_leg is not None)
    return replace(
        made,
        left_arm=row.left_arm or made.left_arm,
        right_arm=row.right_arm or made.right_arm,
        lean=made.lean + row.lean,
        nod=row.nod,
        bow=row.bow,
        turn=row.turn,
        tilt=row.tilt,
    )


def _adapted(gait: _Gait, row: _Pose) -> _Gait:
    if row.arm is None and row.swing == 1.0:
        return gait
    swing, elbow = row.swing * gait.arm_swing, row.swing * gait.elbow_swing
    return replace(gait, arm=row.arm or gait.arm, arm_swing=swing, elbow_swing=elbow)


def _stride(gait: _Gait, step: int) -> Stance:
    turn = math.cos(2.0 * math.pi * step / PHASES)
    left_leg, right_leg = (
        Leg(gait.hip[k], gait.knee[k], gait.ankle[k], gait.toes[k])
        for k in (step, (step + PHASES // 2) % PHASES)
    )
    left_arm, right_arm = (
        replace(
            gait.arm,
            swing=sign * gait.arm_swing * turn + gait.arm.swing,
            elbow=gait.arm.elbow + sign * gait.elbow_swing * turn,
        )
        for sign in (-1.0, 1.0)
    )
    twist = -gait.twist * turn
    return Stance(left_leg, right_leg, left_arm, right_arm, lean=gait.lean, twist=twist)


Rotations = Mapping[str, Array]
"""``{bone: rotation [3, 3] from the template to the pose, in the body's frame}``; bones that are
not named turn with their parent."""


def bone_transforms(body: BodyTemplate, heads_m: Array, rotations: Rotations) -> Array:
    """Transform of each bone from the rest pose to the pose, float64 [bones, 3, 4].

    Args:
        body: Template with the bones.
        heads_m: Bone heads before the pose [m], shape [bones, 3]; the root's stays where it is.
        rotations: The pose.
    """
    turns = np.zeros((len(body.bones), 3, 3))
    places = np.zeros((len(body.bones), 3))
    for k, name in enumerate(body.bones):
        parent = int(body.parents[k])
        inherited = np.eye(3) if parent < 0 else turns[parent]
        turns[k] = rotations.get(name, inherited)
        places[k] = heads_m[k]
        if parent >= 0:
            places[k] = places[parent] + inherited @ (heads_m[k] - heads_m[parent])
    shifts = places - np.einsum("bij,bj->bi", turns, heads_m, optimize=False)
    return np.concatenate([turns, shifts[:, :, None]], axis=2)


def skin_points(points_m: Array, bones: Indices, weights: Array, transforms: Array) -> Array:
    """Points moved by their bones.

    Args:
        points_m: Positions before the pose [m], shape [n, 3].
        bones: Bones of each point, shape [n, 4].
        weights: Shares of these bones, shape [n, 4].
        transforms: Transforms of all bones, shape [bones, 3, 4].

    Returns:
        Positions after the pose [m], float64 [n, 3].
    """
    # Entries of matrices as rows: NumPy is slow along short axes.
    flat = np.ascontiguousarray(transforms.reshape(len(transforms), 12).T)
    shares, numbers = weights.T.copy(), bones.T.copy()
    matrices = flat.take(numbers[0], axis=1)
    matrices *= shares[0]
    for share, number in zip(shares[1:], numbers[1:], strict=True):
        part = flat.take(number, axis=1)
        part *= share
        matrices += part
    x, y, z = points_m.T.copy()
    rows = (matrices[k : k + 4] for k in (0, 4, 8))
    return np.stack([a * x + b * y + c * z + d for a, b, c, d in rows], axis=1)


def vertex_normals(points_m: Array, faces: Indices) -> Array:
    """Unit normals [n, 3], weighted by the area of the faces; (0, 0, 1) where there is none."""
    corners = np.ascontiguousarray(faces.T)
    # Column by column: rows of three numbers are slow to gather.
    (ax, bx, cx), (ay, by, cy), (az, bz, cz) = (column[corners] for column in points_m.T.copy())
    bx, by, bz = bx - ax, by - ay, bz - az
    cx, cy, cz = cx - ax, cy - ay, cz - az
    crosses = (by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx)
    ends = corners.reshape(-1)
    sums = [np.bincount(ends, np.tile(part, 3), minlength=len(points_m)) for part in crosses]
    lengths = np.sqrt(sums[0] * sums[0] + sums[1] * sums[1] + sums[2] * sums[2])
    normals: Array = np.stack(sums, axis=1) / np.maximum(lengths, 1e-12)[:, None]
    normals[lengths <= 1e-12] = (0.0, 0.0, 1.0)
    return normals


_CASCADE = {"index": 0.8, "middle": 1.0, "ring": 1.15, "pinky": 1.3}
"""Shares of the fingers in a curl: in a hand at rest flexion rises from index to little finger (the
"cascade" of hand surgery; shares assumed)."""
_SPREAD, _THUMB_SPREAD = 0.25, 0.6
"""Factors on the angles between the template's fingers, and on its thumb's (assumed)."""
_THUMB = (0.4, 0.6, 0.9)
"""How far the bones of a thumb turn before and across the palm, per radian of curl (assumed)."""
_STANCE_IN_DEG = 3.0
"""Thighs lean inward: the feet are closer together than the hips."""
_TOES_OUT_DEG = 6.0


def bone_rotations(body: BodyTemplate, heads_m: Array, stance: Stance) -> Rotations:
    """The rotation of every bone that a stance turns.

    Args:
        body: Template with the bones.
        heads_m: Bone heads before the pose [m], shape [bones, 3].
        stance: Joint angles.
    """
    body_tilt = _pitch(-stance.bow)
    drop = _roll(_pelvic_drop_deg(body, heads_m, stance)) if stance.level else np.eye(3)
    rotations: dict[str, Array] = {
        "pelvis": drop @ body_tilt @ _yaw(stance.twist),
        "spine_01": body_tilt @ _yaw(stance.twist / 3.0) @ _pitch(-stance.lean / 2.0),
        "spine_02": body_tilt @ _yaw(-stance.twist / 3.0) @ _pitch(-stance.lean),
        "spine_03": body_tilt @ _yaw(-stance.twist) @ _pitch(-stance.lean),
    }
    # The head keeps two thirds of its direction when the trunk bends.
    nod = stance.nod + stance.bow / 3.0
    half_turn = _yaw(stance.turn / 2.0)
    rotations |= {
        "neck_01": half_turn @ _pitch(-(stance.lean + 0.5 * stance.bow + nod) / 2.0),
        "head": half_turn @ half_turn @ _pitch(-nod) @ _roll(-stance.tilt),
    }
    for side, sign, leg, arm in (
        ("l", 1.0, stance.left_leg, stance.left_arm),
        ("r", -1.0, stance.right_leg, stance.right_arm),
    ):
        rotations |= _leg(body, heads_m, side, sign, leg)
        rotations |= _arm(body, heads_m, side, sign, arm, rotations["spine_03"])
    return rotations


def _pelvic_drop_deg(body: BodyTemplate, heads_m: Array, stance: Stance) -> float:
    """Drop of the pelvis to the side of the shorter leg that makes both ankles level."""
    heights = []
    for side, sign, leg in (("l", 1.0, stance.left_leg), ("r", -1.0, stance.right_leg)):
        rotations = _leg(body, heads_m, side, sign, leg)
        thigh, calf, foot = (
            heads_m[body.bone(f"{bone}_{side}")] for bone in ("thigh", "calf", "foot")
        )
        reach = rotations[f"thigh_{side}"] @ (calf - thigh)
        reach = reach + rotations[f"calf_{side}"] @ (foot - calf)
        heights.append(float(reach[2]))
    left, right = (heads_m[body.bone(f"thigh_{side}"), 1] for side in "lr")
    sine = (heights[1] - heights[0]) / float(left - right)
    return math.degrees(math.asin(max(-0.2, min(0.2, sine))))


def _leg(body: BodyTemplate, heads_m: Array, side: str, sign: float, leg: Leg) -> Rotations:
    thigh = _direction(body, heads_m, f"thigh_{side}", f"calf_{side}")
    calf = _direction(body, heads_m, f"calf_{side}", f"foot_{side}")
    inward = np.array([0.0, -sign * math.sin(math.radians(_STANCE_IN_DEG)), -1.0])
    foot = leg.hip - leg.knee + leg.ankle
    out = _yaw(sign * _TOES_OUT_DEG)
    aside = _roll(sign * leg.out)
    return {
        f"thigh_{side}": aside @ _pitch(leg.hip) @ _between(thigh, inward),
        f"calf_{side}": aside
        @ _pitch(leg.hip - leg.knee)
        @ _between(calf, inward * (1.0, 0.5, 1.0)),
        f"foot_{side}": out @ _pitch(foot),
        f"ball_{side}": out @ _pitch(foot + leg.toes),
    }


def _arm(
    body: BodyTemplate, heads_m: Array, side: str, sign: float, arm: Arm, trunk: Array
) -> Rotations:
    down = np.array([0.0, 0.0, -1.0])
    upper = _between(_direction(body, heads_m, f"upperarm_{side}", f"lowerarm_{side}"), down)
    fore_direction = upper @ _direction(body, heads_m, f"lowerarm_{side}", f"hand_{side}")
    fore = _between(fore_direction, down) @ upper
    out = trunk @ _roll(sign * arm.out)
    bend = _yaw(-sign * arm.inward) @ _pitch(arm.elbow)
    lower = out @ _pitch(arm.swing) @ bend @ fore
    return {
        f"upperarm_{side}": out @ _pitch(arm.swing) @ upper,
        f"lowerarm_{side}": lower,
        **_fingers(body, heads_m, side, sign * arm.curl, lower),
    }


def _fingers(
    body: BodyTemplate, heads_m: Array, side: str, curl: float, hand: Array
) -> dict[str, Array]:
    """Fingers gathered side by side and bent about the line of the knuckles; a thumb before them.

    The template spreads them. Bones that a body lacks are left out.
    """
    across = _direction(body, heads_m, f"index_01_{side}", f"pinky_01_{side}")
    along = _direction(body, heads_m, f"middle_01_{side}", f"middle_03_{side}")
    rotations = {}
    for name, share in _CASCADE.items():
        if f"{name}_02_{side}" not in body.bones:
            continue
        own = _direction(body, heads_m, f"{name}_01_{side}", f"{name}_03_{side}")
        gathered = _between(own, along + _SPREAD * (own - along))
        for k in (1, 2, 3):
            rotations[f"{name}_0{k}_{side}"] = hand @ _about(across, k * share * curl) @ gathered
    if f"thumb_01_{side}" in body.bones:
        own = _direction(body, heads_m, f"thumb_01_{side}", f"thumb_03_{side}")
        palm = math.copysign(1.0, curl) * np.cross(across, along)
        # Fists close: at a right angle of the fingers, the thumb lies over them.
        spread = _THUMB_SPREAD * max(0.0, 1.0 - abs(curl) / 90.0)
        beside = along + spread * (own - along)
        for k, share in enumerate(_THUMB, start=1):
            towards = beside + share * math.radians(abs(curl)) * (palm + 0.6 * across)
            rotations[f"thumb_0{k}_{side}"] = hand @ _between(own, towards)
    return rotations


def _direction(body: BodyTemplate, heads_m: Array, start: str, end: str) -> Array:
    return _unit(heads_m[body.bone(end)] - heads_m[body.bone(start)])


def _pitch(angle_deg: float) -> Array:
    """Turns front upward and down forward."""
    return _about(np.array([0.0, -1.0, 0.0]), angle_deg)


def _yaw(angle_deg: float) -> Array:
    """Turns front to the left."""
    return _about(np.array([0.0, 0.0, 1.0]), angle_deg)


def _roll(angle_deg: float) -> Array:
    """Turns down to the left."""
    return _about(np.array([1.0, 0.0, 0.0]), angle_deg)


def _about(axis: Array, angle_deg: float) -> Array:
    """Rotation about a unit axis (Rodrigues 1840)."""
    x, y, z = axis.tolist()
    angle = math.radians(angle_deg)
    s, c = math.sin(angle), 1.0 - math.cos(angle)
    # Written out: a figure takes sixty of these, and each operation of small arrays a microsecond.
    return np.array(
        [
            [1.0 - c * (z * z + y * y), c * (x * y) - s * z, c * (x * z) + s * y],
            [c * (x * y) + s * z, 1.0 - c * (z * z + x * x), c * (y * z) - s * x],
            [c * (x * z) - s * y, c * (y * z) + s * x, 1.0 - c * (y * y + x * x)],
        ]
    )


def _between(start: Array, end: Array) -> Array:
    """The smallest rotation that turns one direction into another; not for opposite ones."""
    a, b = _unit(start), _unit(end)
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    k = _cross_matrix((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))
    rotation: Array = np.eye(3) + k + (k @ k) / (1.0 + float((a * b).sum()))
    return rotation


def _cross_matrix(vector: tuple[float, float, float]) -> Array:
    """Matrix of the cross product with a vector."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _unit(vector: Array) -> Array:
    unit: Array = vector / math.sqrt(float((vector * vector).sum()))
    return unit
