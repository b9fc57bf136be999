"""A hand and forearm: joints, poses, grasps of cylinders, and the surface around the bones.

Hand frame: metres, the wrist at the origin, X towards the fingers, Z out of the back of the hand,
Y towards the thumb of a right hand. Left hands are mirror images.

Lengths between joints and the flesh beyond the last bones are means of 66 adults in Buryanov and
Kotiuk, "Proportions of hand segments", Int. J. Morphol. 28(3), 2010, table I; the palm's breadth is
from Gordon et al., "2012 anthropometric survey of U.S. Army personnel", 2014 (means 79 mm of women,
88 mm of men). Thickness of fingers and places of the knuckles are assumed, within 10 %.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.procedural.implicit_surfaces import (
    capsule_distance,
    ellipsoid_distance,
    mesh_level_set,
    smooth_union,
)
from gen_data.content.procedural.patches import Array, Indices, Patch

FINGERS = ("index", "middle", "ring", "little")
Distance = Callable[[Array, Array], Array]
"""Distances [m] of points (x, z) in a hand's X-Z plane from a section of the held object."""
# Knuckles, then bones with the flesh of the tip [m].
_KNUCKLES = np.array([[0.0952, 0.0245, 0.0], [0.0926, 0.003, 0.0025], [0.0851, -0.0178, 0.001],
                      [0.0782, -0.0352, -0.004]])  # fmt: skip
_BONES = np.array([[0.03978, 0.02238, 0.01582 + 0.00384], [0.04463, 0.02633, 0.0174 + 0.00395],
                   [0.04137, 0.02565, 0.0173 + 0.00395],
                   [0.03274, 0.01811, 0.01596 + 0.00373]])  # fmt: skip
_THUMB_BONES = np.array([0.04622, 0.03157, 0.02167 + 0.00567])
_THUMB_FOOT = np.array([0.021, 0.021, -0.009])
# Radii at knuckle, middle joint, end joint and tip [m].
_RADII = np.array([[0.0104, 0.0092, 0.0079, 0.0064], [0.0106, 0.0095, 0.0081, 0.0066],
                   [0.01, 0.0089, 0.0077, 0.0062], [0.0089, 0.0078, 0.0068, 0.0056]])  # fmt: skip
_THUMB_RADII = np.array([0.0135, 0.0112, 0.0104, 0.0082])
_THUMB_AZIMUTHS = (math.radians(24.0), math.radians(10.0), math.radians(0.0))
# Splay of the fingers at spread 0 [degree].
_SPLAY = (2.0, 0.0, -3.0, -8.0)
# Largest bends of knuckle, middle and end joint [degree]: Bain et al., "The functional range of
# motion of the finger joints", J. Hand Surg. Eur. 40(4), 2015, within 5 degrees.
_BEND_MAX = (85.0, 100.0, 70.0)
# Flesh yields by this much where it touches.
_YIELD_M = 0.001
ARM_M = 0.42
"""Length of the arm behind the wrist [m]: beyond the elbow of most."""
STUB_M = -0.02
"""X [m] where the hand's own mesh ends inside the arm's."""


@dataclass(frozen=True, slots=True)
class HandPose:
    """A row of ``hand_poses.yaml``; angles in degrees."""

    bend: tuple[tuple[float, float, float], ...]
    thumb: tuple[tuple[float, float], ...]
    spread: float = 0.0
    lift: float = 0.0
    nail: tuple[float, float, float] = (0.0, 0.0, 1.0)


POSES: Mapping[str, HandPose] = load_table(__package__, "hand_poses", HandPose)


class Bones(NamedTuple):
    """Joints of a posed hand.

    Attributes:
        chains: Four joints of thumb, index, middle, ring and little finger, foot to tip, shape
            [5, 4, 3].
        backs: Direction out of each finger's nail, shape [5, 3].
        arm: Direction from the wrist to the elbow.
        held: Points on the axis of the held object at the index and the little finger, and its
            radius [m] at each of the four fingers; empty = nothing.
    """

    chains: Array
    backs: Array
    arm: Array
    held: tuple[Array, Sequence[float]] | tuple[()] = ()


def pose_bones(name: str) -> Bones:
    """The joints of a pose of ``POSES``."""
    pose = POSES[name]
    chains = [_thumb(pose.thumb)]
    for k in range(4):
        splay = math.radians(_SPLAY[k] * (1.0 + pose.spread / 8.0))
        chains.append(_finger(k, splay, [math.radians(b) for b in pose.bend[k]]))
    lift = math.radians(pose.lift)
    arm = np.array([-math.cos(lift), 0.0, math.sin(lift)])
    return Bones(np.array(chains), _backs(chains, np.array(pose.nail)), arm)


def grasp_bones(radii_m: Sequence[float], lift_deg: float) -> Bones:
    """The joints of a hand around a cylinder along Y that may taper.

    Every bone in turn bends until its flesh touches, as in a grasp simulator (Miller and Allen,
    "GraspIt!", IEEE Robotics and Automation Magazine 11(4), 2004).

    Args:
        radii_m: Radius of the held object at index, middle, ring and little finger.
        lift_deg: Angle of the forearm towards the thumb's side.
    """
    # It lies in the palm below the knuckles; wide ones further back.
    widest = max(radii_m)
    x = 0.0926 - 0.012 - 0.3 * widest
    z = -(0.0145 + widest + 0.08 * max(0.0, widest - 0.033))

    def away(px: Array, pz: Array) -> Array:
        return np.asarray(np.sqrt((px - x) ** 2 + (pz - z) ** 2))

    turns = [close_finger(k, away, radii_m[k]) for k in range(4)]
    thumb = close_thumb(away, max(radii_m[:2]))
    bones = closed_bones(turns, thumb, lift_deg)
    ends = np.array([[x, _KNUCKLES[0, 1], z], [x, _KNUCKLES[3, 1], z]])
    return bones._replace(held=(ends, tuple(radii_m)))


def closed_bones(
    turns: Sequence[Sequence[float]], thumb: Sequence[float], lift_deg: float
) -> Bones:
    """The joints of a hand closed on something.

    Args:
        turns: Dip [rad] below the palm of the three bones of index, middle, ring, little finger.
        thumb: The same of the thumb's bones.
        lift_deg: Angle of the forearm towards the thumb's side.
    """
    made = [_chain(_THUMB_FOOT, _THUMB_BONES, _THUMB_AZIMUTHS, thumb)]
    for k in range(4):
        splay = (math.radians(0.6 * _SPLAY[k]),) * 3
        made.append(_chain(_KNUCKLES[k], _BONES[k], splay, turns[k]))
    lift = math.radians(lift_deg)
    arm = np.array([-math.cos(lift), math.sin(lift), 0.0])
    last = made[0][3] - made[0][2]
    # Out of the bend, and a little towards the thumb's side.
    nail = np.array([last[2], 0.0, -last[0]]) / math.dist(made[0][3], made[0][2])
    return Bones(np.array(made), _backs(made, nail + np.array([0.0, 0.4, 0.0])), arm)


def _chain(
    joint: Array, lengths: Array, azimuths: Sequence[float], turns: Sequence[float]
) -> Array:
    points = [joint]
    for length, azimuth, turn in zip(lengths, azimuths, turns, strict=True):
        joint = joint + length * _direction(azimuth, turn)
        points.append(joint)
    return np.array(points)


def close_finger(k: int, away: Distance, radius_m: float = 0.0) -> list[float]:
    """Dips [rad] of the bones of a finger, 0 = index, that bends until each bone touches."""
    joint, turn, turns = _KNUCKLES[k], 0.0, []
    splay = math.radians(0.6 * _SPLAY[k])
    for bone in range(3):
        reach = radius_m, _RADII[k, bone], _RADII[k, bone + 1]
        turn = _close(joint, _BONES[k, bone], turn, math.radians(_BEND_MAX[bone]), away, reach)
        joint = joint + _BONES[k, bone] * _direction(splay, turn)
        turns.append(turn)
    return turns


def _backs(chains: Sequence[Array], nail: Array) -> Array:
    """Directions of nails: the thumb's as given, others upward where the finger is straight."""
    made = []
    for k, chain in enumerate(chains):
        along = (chain[3] - chain[2]) / math.dist(chain[3], chain[2])
        level = math.hypot(float(along[0]), float(along[1]))
        up = nail if k == 0 else np.array([0.0, 0.0, 1.0])
        if k and along[2] < -0.5:
            # Bent far: its back is where the finger comes from.
            first = chain[1] - chain[0]
            up = first / math.dist(chain[1], chain[0]) + np.array([0.0, 0.0, level])
        back = up - (up @ along) * along
        made.append(back / math.sqrt(float(back @ back)))
    return np.array(made)


def _direction(azimuth: float, dip: float) -> Array:
    """Unit vector at an azimuth from X to Y, dipping below the palm."""
    level = math.cos(dip)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), -math.sin(dip)])


def _finger(k: int, splay: float, bends: Sequence[float]) -> Array:
    joint, turn, points = _KNUCKLES[k], 0.0, [_KNUCKLES[k]]
    for bone, bend in enumerate(bends):
        turn += bend
        joint = joint + _BONES[k, bone] * _direction(splay, turn)
        points.append(joint)
    return np.array(points)


def _thumb(angles: Sequence[tuple[float, float]]) -> Array:
    joint, points = _THUMB_FOOT, [_THUMB_FOOT]
    for bone, (azimuth, dip) in enumerate(angles):
        joint = joint + _THUMB_BONES[bone] * _direction(math.radians(azimuth), math.radians(dip))
        points.append(joint)
    return np.array(points)


def close_thumb(away: Distance, radius_m: float = 0.0) -> list[float]:
    """Dips [rad] of the thumb's bones, which closes from the other side."""
    joint, turn, turns = _THUMB_FOOT, math.radians(128.0), []
    for bone, azimuth in enumerate(_THUMB_AZIMUTHS):
        reach = radius_m, _THUMB_RADII[bone], _THUMB_RADII[bone + 1]
        limit = math.radians((100.0, 62.0, 70.0)[bone])
        turn = _close(joint, _THUMB_BONES[bone], turn, -limit, away, reach, azimuth)
        joint = joint + _THUMB_BONES[bone] * _direction(azimuth, turn)
        turns.append(turn)
    return turns


def close_straight(number: int, away: Distance) -> list[float]:
    """Dips [rad] of the bones of a digit, 0 = thumb, that lies against flat sides.

    Joint by joint, the rest of the digit turns in line until any of it touches.
    """
    joint = _THUMB_FOOT if number == 0 else _KNUCKLES[number - 1]
    lengths = _THUMB_BONES if number == 0 else _BONES[number - 1]
    splay = _THUMB_AZIMUTHS if number == 0 else (math.radians(0.6 * _SPLAY[number - 1]),) * 3
    limits = (-100.0, -62.0, -70.0) if number == 0 else _BEND_MAX
    radii, turns = bone_radii(number), [math.radians(128.0 if number == 0 else 0.0)]
    share = np.linspace(0.15, 1.0, 12)
    for bone in range(3):
        swept = turns[-1] + math.radians(limits[bone]) * np.linspace(0.0, 1.0, 181)
        x, z, gap = joint[0] + 0.0 * swept, joint[2] + 0.0 * swept, np.full(len(swept), np.inf)
        for k in range(bone, 3):
            dx, dz = lengths[k] * np.cos(swept) * math.cos(splay[k]), -lengths[k] * np.sin(swept)
            flesh = radii[k] + (radii[k + 1] - radii[k]) * share
            px, pz = x[:, None] + share * dx[:, None], z[:, None] + share * dz[:, None]
            gap = np.minimum(gap, (away(px, pz) - flesh).min(axis=1))
            x, z = x + dx, z + dz
        touching = np.flatnonzero(gap < -_YIELD_M)
        last = len(swept) - 1 if not len(touching) else max(int(touching[0]) - 1, 0)
        turns.append(float(swept[last]))
        joint = joint + lengths[bone] * _direction(splay[bone], turns[-1])
    return turns[1:]


def _close(
    joint: Array, length: float, turn: float, limit: float, away: Distance,
    reach: tuple[float, float, float], azimuth: float = 0.0,
) -> float:  # fmt: skip
    """The dip [rad] of a bone that bends from ``turn`` by up to ``limit`` until it touches.

    ``reach``: radius around the held object, and of the flesh at both ends of the bone.
    """
    turns = turn + limit * np.linspace(0.0, 1.0, 91)
    share = np.linspace(0.15, 1.0, 9)
    along = length * share[None] * np.cos(turns)[:, None]
    x = joint[0] + along * math.cos(azimuth)
    z = joint[2] - length * share[None] * np.sin(turns)[:, None]
    flesh = reach[1] + (reach[2] - reach[1]) * share
    gap = (away(x, z) - flesh - reach[0]).min(axis=1)
    touching = np.flatnonzero(gap < -_YIELD_M)
    last = len(turns) - 1 if not len(touching) else max(int(touching[0]) - 1, 0)
    return float(turns[last])


def bone_radii(k: int) -> Array:
    """Radii of a digit at its joints and tip [m], shape [4]; 0 = thumb, 1 = index finger ..."""
    return np.array(_THUMB_RADII if k == 0 else _RADII[k - 1])


def tip_radii(k: int) -> tuple[float, float]:
    """Radii of a finger at its end joint and tip [m]; 0 = thumb, 1 = index finger ..."""
    radii = _THUMB_RADII if k == 0 else _RADII[k - 1]
    return float(radii[2]), float(radii[3])


class Flesh(NamedTuple):
    """Distances to parts of a hand at the same points: palm with arm, then five fingers."""

    palm: Array
    fingers: tuple[Array, ...]

    def distance(self) -> Array:
        """Distance to the whole hand: fingers blend with the palm and not with one another."""
        joined = [smooth_union(self.palm, finger, 0.009) for finger in self.fingers]
        return np.asarray(np.min(joined, axis=0))


def measure_flesh(points: Array, bones: Bones, stout: float) -> Flesh:
    """Distances [m] of points, shape [n, 3], to the parts; ``stout`` is a factor on thickness."""
    palm = _palm(points, bones, stout)
    fingers = []
    for chain, radii in zip(bones.chains, [_THUMB_RADII, *_RADII], strict=True):
        part = np.full(len(points), np.inf)
        near = _near(points, chain, 0.03)
        here = points[near]
        joined = capsule_distance(here, chain[0], chain[1], stout * radii[0], stout * radii[1])
        for bone in (1, 2):
            tip = chain[bone + 1]
            if bone == 2:
                tip = tip - (tip - chain[2]) * (radii[3] / math.dist(tip, chain[2]))
            one = capsule_distance(
                here, chain[bone], tip, stout * radii[bone], stout * radii[bone + 1]
            )
            joined = smooth_union(joined, one, 0.003)
        part[near] = joined
        # Far points need a sign only.
        part[~near] = 0.03
        fingers.append(part)
    return Flesh(palm, tuple(fingers))


def _near(points: Array, chain: Array, margin: float) -> Indices:
    low, high = chain.min(axis=0) - margin, chain.max(axis=0) + margin
    return np.asarray(((points >= low) & (points <= high)).all(axis=1))


def _palm(points: Array, bones: Bones, stout: float) -> Array:
    feet = np.array(
        [
            [0.024, 0.0125, 0.0],
            [0.024, 0.003, 0.001],
            [0.022, -0.0085, 0.0],
            [0.02, -0.0175, -0.003],
        ]
    )
    joined = np.full(len(points), 0.05)
    near = points[:, 0] > -0.03
    here = points[near]
    hand = capsule_distance(here, feet[0], _KNUCKLES[0], 0.0145 * stout, 0.0118 * stout)
    for foot, knuckle, (r0, r1) in zip(
        feet[1:], _KNUCKLES[1:], ((0.0152, 0.012), (0.0146, 0.0114), (0.0136, 0.0102)), strict=True
    ):
        hand = smooth_union(
            hand, capsule_distance(here, foot, knuckle, r0 * stout, r1 * stout), 0.012
        )
    # Pads below the little finger's side.
    heel = ellipsoid_distance(
        here, np.array([0.034, -0.022, -0.007]), stout * np.array([0.03, 0.0135, 0.0125])
    )
    hand = smooth_union(hand, heel, 0.012)
    thumb = bones.chains[0]
    ball = capsule_distance(
        here, thumb[0] * 0.85, 0.35 * thumb[0] + 0.65 * thumb[1], 0.0155 * stout, 0.0135 * stout
    )
    joined[near] = smooth_union(hand, ball, 0.012)
    return smooth_union(joined, _arm(points, bones.arm, stout), 0.016)


def _arm(points: Array, direction: Array, stout: float) -> Array:
    """The wrist: the beginning of the arm, whose rest is a loft."""
    along = points @ direction
    away = points - along[:, None] * direction
    broad, flat = _girth(along, stout)
    side = np.cross(direction, [0.0, 0.0, 1.0])
    side = side / math.sqrt(float(side @ side))
    up = np.cross(side, direction)
    u, v = away @ side / broad, away @ up / flat
    wall = (np.sqrt(u * u + v * v) - 1.0) * flat
    return np.asarray(np.maximum(wall, np.maximum(-0.02 - along, along + STUB_M)))


def make_flesh_mesh(bones: Bones, stout: float, step_m: float) -> Patch:
    """The mesh of a hand up to the wrist, on a lattice of ``step_m``."""
    joints = bones.chains.reshape(-1, 3)
    low = np.minimum(joints.min(axis=0) - 0.018, [STUB_M - 0.004, -0.052, -0.028])
    high = np.maximum(joints.max(axis=0) + 0.018, [0.0, 0.045, 0.022])
    counts = 2 * np.ceil((high - low) / (2.0 * step_m)).astype(np.int64) + 1
    fine = tuple(low[k] + step_m * np.arange(counts[k]) for k in range(3))
    coarse = tuple(ticks[::2] for ticks in fine)
    rough = _measure_lattice(coarse, bones, stout)
    # Only near the surface is the lattice needed in full.
    far = rough.repeat(2, axis=0).repeat(2, axis=1).repeat(2, axis=2)
    distance = far[: counts[0], : counts[1], : counts[2]]
    near = np.abs(distance) < 4.2 * step_m
    points = np.stack(np.meshgrid(*fine, indexing="ij"), axis=3)[near]
    distance[near] = measure_flesh(points, bones, stout).distance()
    return mesh_level_set((fine[0], fine[1], fine[2]), distance)


def _measure_lattice(ticks: Sequence[Array], bones: Bones, stout: float) -> Array:
    grid = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=3)
    distance = measure_flesh(grid.reshape(-1, 3), bones, stout).distance()
    return np.asarray(distance.reshape(grid.shape[:3]))


def arm_rings(bones: Bones, stout: float, along_m: Array, thicker_m: Array, sides: int) -> Array:
    """Ellipses around the arm at distances from the wrist, shape [rings, sides, 3].

    ``thicker_m``: added to the radius, shape [rings] or [rings, sides].
    """
    side = np.cross(bones.arm, [0.0, 0.0, 1.0])
    side = side / math.sqrt(float(side @ side))
    up = np.cross(side, bones.arm)
    turn = 2.0 * math.pi * np.arange(sides) / sides
    broad, flat = _girth(along_m, stout)
    more = np.broadcast_to(np.asarray(thicker_m).reshape(len(along_m), -1), (len(along_m), sides))
    u = (broad[:, None] + more) * np.cos(turn)
    v = (flat[:, None] + more) * np.sin(turn)
    middle = along_m[:, None, None] * bones.arm
    return np.asarray(middle + u[..., None] * side + v[..., None] * up)


def _girth(along: Array, stout: float) -> tuple[Array, Array]:
    """Half breadth and half thickness of the arm at distances from the wrist [m].

    Wrist 55 mm x 37 mm, forearm 90 mm x 78 mm (Gordon et al. 2014: circumferences of men 176 mm
    and 300 mm, of women 154 mm and 260 mm; within 10 %).
    """
    broad = stout * np.interp(along, _ALONG_M, (0.0285, 0.0275, 0.041, 0.045, 0.047))
    return broad, stout * np.interp(along, _ALONG_M, (0.0165, 0.0185, 0.033, 0.039, 0.044))


_ALONG_M = (-0.02, 0.012, 0.16, 0.24, ARM_M)
