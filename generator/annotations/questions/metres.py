"""Questions in metres: distances, sizes, heights, orders, clearances, and the reach of arms.

Places are centres of 3D boxes, sizes their edges; resolutions are as in ``resolution``.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np

from gen_data.annotations.questions.resolution import PIXEL, Sight, expanded
from gen_data.annotations.questions.view import UP, Thing, View, grammar, measure, stated
from gen_data.core import english, kinematics, se3
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.sample import Utterance

TOLERANCE = 0.1
"""Largest error of an answer in metres that counts as right, as share of it: its margin."""
UPRIGHT = math.cos(math.radians(1.0))
"""Smallest cosine between the vertical and an edge of an upright box."""
SWEEPS = 8
"""Passes over all joints of an arm in search of its reach."""
Seen = tuple[Thing, Sight]


def length_text(value_m: float) -> str:
    """A length with about three digits: "3.4 cm", "34 cm", "3.41 m", "34.1 m"."""
    if value_m < 1.0:
        return f"{100.0 * value_m:.{0 if value_m >= 0.1 else 1}f} cm"
    return f"{value_m:.{2 if value_m < 10.0 else 1}f} m"


def length(
    kind: str, text: str, things: Sequence[Thing], value_m: float, variances: Sequence[float]
) -> Iterator[Utterance]:
    """A question whose answer is a length, right within a tenth."""
    measured = measure((value_m,), "m", TOLERANCE * value_m, expanded(variances))
    yield from stated(kind, (text, length_text(value_m)), things, measured)


def distance(view: View) -> Iterator[Utterance]:
    """From the camera to an object, and between two."""
    forms = grammar()["questions"]["distance"]
    for ((one, sight),) in view.picks("distance", 1):
        text = forms["camera"].format(a=view.titles[one.instance_id])
        yield from length("distance", text, (one,), sight.range_m, [sight.depth_m**2])
    for (a, at_a), (b, at_b) in view.picks("distance", 2):
        apart_m, variance_m2 = along(b.center_m - a.center_m, at_a, at_b)
        text = forms["pair"].format(a=view.titles[a.instance_id], b=view.titles[b.instance_id])
        yield from length("distance", text, (a, b), apart_m, [variance_m2])


def size(view: View) -> Iterator[Utterance]:
    """Height, and the longer and the shorter horizontal side, of upright objects."""
    forms = grammar()["questions"]["size"]
    for ((thing, sight),) in view.picks("size", 1):
        for name, edge_m, axis in _edges(thing):
            text = forms[name].format(a=view.titles[thing.instance_id])
            yield from length("size", text, (thing,), edge_m, [2.0 * sight.variance_m2(axis)])


def _edges(thing: Thing) -> list[tuple[str, float, se3.Array]]:
    """Name, length [m] and direction of the edges of an upright box; none of a tilted one."""
    axes = thing.solid.T_frame_box.rotation().T
    upright = [k for k in range(3) if abs(axes[k][2]) >= UPRIGHT]
    if not upright:
        return []
    level = sorted(set(range(3)) - set(upright), key=lambda k: -thing.solid.size_m[k])
    named = zip(("tall", "long", "wide"), (upright[0], *level), strict=True)
    return [(name, thing.solid.size_m[k], axes[k]) for name, k in named]


def height(view: View) -> Iterator[Utterance]:
    """Height of the top of upright objects above level ground."""
    if view.scene.relief is not None:
        return
    ground = "road" if view.scene.lanes else "floor"
    for ((thing, sight),) in view.picks("height", 1):
        if _edges(thing):
            top_m = _heights_m(thing)[1]
            form = grammar()["questions"]["height"]["top"]
            text = form.format(a=view.titles[thing.instance_id], ground=ground)
            yield from length("height", text, (thing,), top_m, [sight.variance_m2(UP)])


def order(view: View) -> Iterator[Utterance]:
    """Three objects from left to right, from near to far, and from low to high."""
    forms = grammar()["questions"]["order"]
    for (name, form), group in itertools.product(forms.items(), view.picks("order", 3)):
        rows = [(*_along(name, thing, sight), thing) for thing, sight in group]
        rows.sort(key=lambda row: row[0])
        steps = [(b[0] - a[0], a[1] + b[1]) for a, b in itertools.pairwise(rows)]
        margin, variance_m2 = min(steps)
        unit, least = "m", expanded([variance_m2])
        things = [row[2] for row in rows]
        if name == "left_to_right":
            unit, least = "px", PIXEL
            margin = min(b.box.x_min - a.box.x_max for a, b in itertools.pairwise(things))
        named = english.join([view.titles[t.instance_id] for t, _ in group])
        answer = ", ".join(view.titles[t.instance_id] for t in things)
        measured = measure((row[0] for row in rows), unit, margin, least)
        yield from stated("order", (form.format(list=named), answer), things, measured)


def _along(name: str, thing: Thing, sight: Sight) -> tuple[float, float]:
    """Coordinate of an object along a direction, and its variance."""
    if name == "left_to_right":
        return 0.5 * thing.middle, 0.0
    if name == "near_to_far":
        return sight.range_m, sight.depth_m**2
    return float(thing.center_m[2]), sight.variance_m2(UP)


def nearest(view: View) -> Iterator[Utterance]:
    """The k-th nearest of three objects to the camera, and the nearest of two to a third."""
    forms = grammar()["questions"]["nearest"]
    for group in view.picks("nearest", 3):
        things = [t for t, _ in group]
        k = view.key("nearest", *(t.instance_id for t in things)) // 7 % 3
        rank = ("nearest to", "second nearest to", "farthest from")[k]
        rows = sorted(group, key=lambda row: row[1].range_m)
        ranges_m = [s.range_m for _, s in rows]
        gaps = [(b - a, i) for i, (a, b) in enumerate(itertools.pairwise(ranges_m))]
        margin, i = min(g for g in gaps if k in (g[1], g[1] + 1))
        least = expanded(rows[j][1].depth_m ** 2 for j in (i, i + 1))
        listed = english.join([view.titles[t.instance_id] for t in things], "or")
        text = forms["camera"].format(rank=rank, list=listed)
        answer = view.titles[rows[k][0].instance_id]
        found = [rows[k][0], *(t for t in things if t is not rows[k][0])]
        measured = measure(tuple(ranges_m), "m", margin, least)
        yield from stated("nearest", (text, answer), found, measured)
    for (to, at), *pair in view.picks("nearest to", 3, ordered=True):
        ends = [(*along(t.center_m - to.center_m, at, s), t) for t, s in pair]
        (near_m, near_m2, one), (far_m, far_m2, two) = sorted(ends, key=lambda end: end[0])
        listed = english.join([view.titles[t.instance_id] for t, _ in pair], "or")
        text = forms["object"].format(b=view.titles[to.instance_id], list=listed)
        answer = view.titles[one.instance_id]
        measured = measure((near_m, far_m), "m", far_m - near_m, expanded((near_m2, far_m2)))
        yield from stated("nearest", (text, answer), (one, two, to), measured)


def along(offset: se3.Array, *sights: Sight) -> tuple[float, float]:
    """Length of a vector between places, and its variance."""
    length_m = float(np.linalg.norm(offset))
    direction = offset / length_m if length_m > 0.0 else UP
    return length_m, math.fsum(s.variance_m2(direction) for s in sights)


def comparison(view: View) -> Iterator[Utterance]:
    """Whether one of two objects is closer, or taller, than the other."""
    for about, opposite in (("closer", "farther"), ("taller", "shorter"), ("higher", "lower")):
        for (a, at_a), (b, at_b) in view.picks(about, 2):
            first, second = _compared(about, a, at_a), _compared(about, b, at_b)
            if first is None or second is None:
                continue
            words = {"a": view.titles[a.instance_id], "b": view.titles[b.instance_id]}
            margin = abs(first[0] - second[0])
            holds = first[0] < second[0] if about == "closer" else first[0] > second[0]
            text = view.asked("comparison", (about, opposite), (a, b), words, holds)
            measured = measure((first[0], second[0]), "m", margin, expanded((first[1], second[1])))
            yield from stated("comparison", text, (a, b), measured)


def _compared(about: str, thing: Thing, sight: Sight) -> tuple[float, float] | None:
    """The compared number of an object and its variance; None if it has none."""
    if about == "closer":
        return sight.range_m, sight.depth_m**2
    if about == "higher":
        return float(thing.center_m[2]), sight.variance_m2(UP)
    tall = [e for e in _edges(thing) if e[0] == "tall"]
    return (tall[0][1], 2.0 * sight.variance_m2(UP)) if tall else None


def clearance(view: View) -> Iterator[Utterance]:
    """Whether the horizontal gap between two objects at one height is wide enough for a third."""
    for (a, at_a), (b, at_b), (c, at_c) in _gaps(view):
        gap_m, across = gap(footprint(a), footprint(b))
        width_m = least_width_m(footprint(c))
        if gap_m <= 0.0:
            continue
        words = {k: view.titles[t.instance_id] for k, t in zip("abc", (a, b, c), strict=True)}
        text = view.asked("clearance", ("wide", "narrow"), (a, b, c), words, width_m <= gap_m)
        variances = [s.variance_m2(across) for s in (at_a, at_b, at_c, at_c)]
        measured = measure((gap_m, width_m), "m", abs(gap_m - width_m), expanded(variances))
        yield from stated("clearance", text, (a, b, c), measured)


def _gaps(view: View) -> Iterator[tuple[Seen, Seen, Seen]]:
    """Pairs of objects that overlap in height, and a third, upright one."""
    robots = {arm.instance_id for arm in view.scene.articulations}
    for a, b, c in view.picks("clearance", 3, ordered=True):
        low_m, high_m = zip(*(_heights_m(t) for t, _ in (a, b)), strict=True)
        ids = {t.instance_id for t, _ in (a, b, c)}
        if max(low_m) < min(high_m) and _edges(c[0]) and not ids & robots:
            yield a, b, c


def _heights_m(thing: Thing) -> tuple[float, float]:
    z_m = thing.solid.corners()[:, 2]
    return float(z_m.min()), float(z_m.max())


def footprint(thing: Thing) -> se3.Array:
    """Corners of the horizontal outline of a 3D box [m] in their order, [n, 2]."""
    import cv2

    corners = thing.solid.corners()[:, :2]
    hull = cv2.convexHull(corners.astype(np.float32), returnPoints=False)[:, 0]
    return np.asarray(corners[hull])


def gap(a: se3.Array, b: se3.Array) -> tuple[float, se3.Array]:
    """Distance of two convex outlines [m] and its direction, world; 0 and up if they overlap."""
    normals = np.concatenate([_normals(a), _normals(b)])
    along_a, along_b = normals @ a.T, normals @ b.T
    between = np.maximum(along_b.min(1) - along_a.max(1), along_a.min(1) - along_b.max(1))
    if between.max() <= 0.0:
        return 0.0, UP
    away = np.concatenate([_from_edges(a, b), _from_edges(b, a)])
    lengths = np.hypot(away[:, 0], away[:, 1])
    k = int(lengths.argmin())
    return float(lengths[k]), np.array([*away[k] / lengths[k], 0.0])


def _from_edges(points: se3.Array, ring: se3.Array) -> se3.Array:
    """Vectors from the nearest points of all edges of an outline to some points, [n, 2]."""
    edges = np.roll(ring, -1, axis=0) - ring
    offsets = points[:, None] - ring
    share = (offsets * edges).sum(-1) / np.maximum((edges * edges).sum(-1), 1e-18)
    away: se3.Array = offsets - np.clip(share, 0.0, 1.0)[..., None] * edges
    return away.reshape(-1, 2)


def _normals(ring: se3.Array) -> se3.Array:
    """Unit normals of the edges of an outline, [n, 2]."""
    edges = np.roll(ring, -1, axis=0) - ring
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    normals: se3.Array = np.stack([-edges[:, 1], edges[:, 0]], axis=1)[lengths > 0.0]
    return normals / lengths[lengths > 0.0, None]


def least_width_m(ring: se3.Array) -> float:
    """Smallest distance of two parallel lines that enclose a convex outline [m]."""
    along = ring @ _normals(ring).T
    return float((along.max(0) - along.min(0)).min())


def reach(view: View) -> Iterator[Utterance]:
    """Whether objects are nearer to an arm's shoulder than its hand gets; the question states both.

    Distances decide, no inverse kinematics.
    """
    if len(view.scene.articulations) != 1:
        return
    (arm,) = view.scene.articulations
    found = shoulder_and_reach(arm.asset, view.assets)
    if found is None:
        return
    shoulder, reach_m = arm.T_world_base.apply(np.array(found[0])), found[1]
    for ((thing, sight),) in view.picks("reach", 1):
        if thing.instance_id == arm.instance_id:
            continue
        apart_m, variance_m2 = along(thing.center_m - shoulder, sight)
        words = {"a": view.titles[thing.instance_id], "reach": length_text(reach_m)}
        text = view.asked("reach", ("within", "out"), (thing,), words, apart_m <= reach_m)
        margin, least = abs(apart_m - reach_m), expanded([variance_m2])
        measured = measure((apart_m, reach_m), "m", margin, least)
        yield from stated("reach", text, (thing,), measured)


@lru_cache(maxsize=64)
def shoulder_and_reach(asset: str, assets: AssetLibrary) -> tuple[se3.Vec3, float] | None:
    """Shoulder of an arm in its base's frame, and the reach of its hand from there [m].

    The shoulder is the point of the first joint's axis next to the second joint. The reach is the
    distance that no turn of one joint exceeds, from the home posture on. None for robots without
    a gripper or with less than three joints.
    """
    robot = assets.robot(asset)
    joints = kinematics.arm_joints(robot)
    if robot.gripper is None or len(joints) < 3 or joints[0].kind == "prismatic":
        return None
    grip, positions = robot.gripper, list(robot.home)
    poses = kinematics.link_poses(robot, se3.IDENTITY, positions)
    base, second = poses[joints[0].child], poses[joints[1].child]
    axis = base.rotate(np.array(joints[0].axis))
    origin = np.array(base.translation_m)
    shoulder = origin + axis * float((np.array(second.translation_m) - origin) @ axis)

    def squared_m2(k: int, position: float) -> float:
        turned = [*positions[:k], position, *positions[k + 1 :]]
        hand = kinematics.link_poses(robot, se3.IDENTITY, turned)[grip.link] @ grip.T_link_grasp
        return float(((np.array(hand.translation_m) - shoulder) ** 2).sum())

    for _, joint in itertools.product(range(SWEEPS), joints):
        k = robot.movable.index(joint)
        low, high = kinematics.position_limits(joint, robot)
        ends = [low, high]
        if joint.kind != "prismatic":
            # The squared distance is a sinusoid of the angle: three values determine its maximum.
            at_0, at_90, at_180 = (squared_m2(k, turn) for turn in (0.0, 0.5 * math.pi, math.pi))
            best = math.atan2(at_90 - 0.5 * (at_0 + at_180), 0.5 * (at_0 - at_180))
            ends += [q for q in (best - math.tau, best, best + math.tau) if low <= q <= high]
        positions[k] = max(ends, key=lambda q: squared_m2(k, q))
    x, y, z = (round(float(v), 6) for v in shoulder)
    return (x, y, z), round(math.sqrt(squared_m2(0, positions[0])), 3)
