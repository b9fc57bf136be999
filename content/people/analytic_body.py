"""A body from formulas: lofted limbs with tabulated proportions, used if no pack is installed.

It shares the template frame, the zones and the shape names of the pack's body: the same clothes and
poses apply to both.

Lengths are shares of stature from Drillis and Contini, "Body segment parameters", New York
University 1966, as drawn in Winter, "Biomechanics and motor control of human movement", fig. 4.1;
breadths are from Gordon et al., "2012 anthropometric survey of U.S. Army personnel", 2014.
"""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import product

import numpy as np

from gen_data.content.people import body as template
from gen_data.content.people import body_regions
from gen_data.content.people.body import LANDMARKS, ZONES, Array, BodyTemplate, Indices
from gen_data.content.people.body_regions import OUTLINES, Level, MeshRows, grid_faces, make_rows
from gen_data.core.se3 import Vec3

_HEIGHT_M = 1.67
_SOLE_Z_M = -0.82


def _z(share: float) -> float:
    """Height in the template frame of a share of stature."""
    return round(_SOLE_Z_M + share * _HEIGHT_M, 4)


_ANKLE_Z, _KNEE_Z, _HIP_Z = _z(0.045), _z(0.285), _z(0.53)
_SHOULDER = np.array([0.01, 0.168, _z(0.808)])
_DOWN_OUT = np.array([0.0, math.sin(math.radians(35.0)), -math.cos(math.radians(35.0))])
_ELBOW = _SHOULDER + 0.186 * _HEIGHT_M * _DOWN_OUT
_WRIST = _ELBOW + 0.146 * _HEIGHT_M * _DOWN_OUT
_HAND_M = 0.108 * _HEIGHT_M
_LEG_Y = 0.088

_SPINE = ("Root", "pelvis", "spine_01", "spine_02", "spine_03", "neck_01", "head")
Bones = Mapping[str, tuple[str, Array]]
"""``{bone: (parent or "", head [m])}``, each after its parent."""
_SIDE_BONES: Bones = {
    "clavicle": ("spine_03", np.array([0.03, 0.03, 0.52])),
    "upperarm": ("clavicle", _SHOULDER),
    "lowerarm": ("upperarm", _ELBOW),
    "hand": ("lowerarm", _WRIST),
    "index_01": ("hand", _WRIST + 0.09 * _DOWN_OUT + (0.03, 0.0, 0.0)),
    "middle_01": ("hand", _WRIST + 0.09 * _DOWN_OUT),
    "pinky_01": ("hand", _WRIST + 0.08 * _DOWN_OUT - (0.035, 0.0, 0.0)),
    "middle_03": ("middle_01", _WRIST + 0.14 * _DOWN_OUT),
    "thumb_03": ("hand", _WRIST + 0.07 * _DOWN_OUT + (0.05, 0.0, 0.0)),
    "thigh": ("pelvis", np.array([0.0, _LEG_Y, _HIP_Z])),
    "calf": ("thigh", np.array([0.005, _LEG_Y, _KNEE_Z])),
    "foot": ("calf", np.array([-0.01, _LEG_Y, _ANKLE_Z])),
    "ball": ("foot", np.array([0.115, _LEG_Y, -0.8])),
}


_POINT_M = 0.02
_SMOOTH_M = 0.05
"""Half length of the stretch over which weights go over from one bone to the next."""


@lru_cache(maxsize=1)
def simple_body() -> BodyTemplate:
    """The template body that needs no file."""
    bones = _bones()
    parts = list(_parts(bones))
    heads = np.array([head for _, head in bones.values()])
    names = list(bones)
    marks = np.zeros((len(LANDMARKS), len(names)))
    marks[:, names.index("head")] = 1.0
    points = np.concatenate([heads, OUTLINES["landmarks"], *(p.values[:, :3] for p in parts)])
    table = np.concatenate([np.eye(len(names)), marks, *(p.values[:, 3:] for p in parts)])
    weight_bones, weights = template.strongest_weights(table)
    faces: dict[str, list[Indices]] = {}
    first = len(names) + len(LANDMARKS)
    for part in parts:
        for zone in ZONES:
            if (part.zones == zone).any():
                faces.setdefault(zone, []).append(part.faces[part.zones == zone] + first)
        first += len(part.values)
    shapes = {"-".join(words): _warp(points, *words) for words in _SHAPES}
    return BodyTemplate(
        bones=tuple(names),
        parents=np.array([names.index(parent) if parent else -1 for parent, _ in bones.values()]),
        points_m=points,
        targets=tuple(shapes),
        deltas=np.stack([template.encode_deltas(shape - points) for shape in shapes.values()]),
        weight_bones=weight_bones,
        weights=weights,
        faces={zone: np.concatenate(faces[zone]) for zone in ZONES if zone in faces},
    )


_WEIGHTS = ("minweight", "averageweight", "maxweight")
_SHAPES = tuple(product(("female", "male"), ("child", "young", "old"), _WEIGHTS))


def _warp(p: Array, sex: str, age: str, weight: str) -> Array:
    """The points in the shape of a sex, an age and a weight."""
    x, y, z = p.T
    heights = (-0.3, 0.0, 0.17, 0.4, 0.52, 0.56)
    widths = {"female": (1.03, 0.9, 0.94, 0.9), "male": (0.96, 0.97, 1.03, 1.03)}
    hips, waist, bust, shoulders = widths[sex]
    girth = dict(zip(_WEIGHTS, (0.86, 1.0, 1.24), strict=True))[weight]
    if age == "child":
        hips, bust, shoulders = 0.9 * hips, 0.86 * bust, 0.84 * shoulders
    half = 0.5 + 0.5 * girth
    factors = (1.0, hips * half, waist * girth, bust * half, shoulders, 1.0)
    across = np.interp(z, heights, factors, left=1.0, right=1.0)
    # Arms are moved, not widened.
    moved_y = y + (across - 1.0) * np.clip(y, -0.16, 0.16)
    trunk = np.clip((0.21 - np.abs(y)) / 0.04, 0.0, 1.0)
    deep = np.interp(z, heights, (1.0, half, girth, half, 1.0, 1.0), left=1.0, right=1.0)
    moved_x = x + (deep - 1.0) * trunk * x
    if sex == "female" and age != "child":
        moved_x = moved_x + 0.03 * np.exp(-(((z - 0.4) / 0.06) ** 2)) * trunk * (x > 0.05)
    moved_z = z
    if age == "child":
        head = np.clip((z - 0.6) / 0.02, 0.0, 1.0)
        moved_x, moved_y = moved_x * (1.0 + 0.2 * head), moved_y * (1.0 + 0.2 * head)
        legs = np.where(z < 0.06, 0.06 + 0.93 * (z - 0.06), z)
        moved_z = np.where(z > 0.6, 0.6 + 1.2 * (z - 0.6), legs)
    return np.stack([moved_x, moved_y, moved_z], axis=1)


def _bones() -> Bones:
    spine = zip(_SPINE, ("", *_SPINE), OUTLINES["spine"], strict=False)
    made = {name: (parent, np.array(head)) for name, parent, head in spine}
    for side, sign in (("l", 1.0), ("r", -1.0)):
        for name, (parent, head) in _SIDE_BONES.items():
            above = parent if parent in _SPINE else f"{parent}_{side}"
            made[f"{name}_{side}"] = (above, head * (1.0, sign, 1.0))
    return made


def _parts(bones: Bones) -> Sequence[MeshRows]:
    spine = ("pelvis", "spine_01", "spine_02", "spine_03")
    neck = ("spine_03", "neck_01", "head")
    head = _upright(bones, OUTLINES["head"], 28, neck)
    _model_face(head)
    trunk = _upright(bones, OUTLINES["trunk"], 24, spine)
    lips = _ball(bones, (0.1515, 0.0, 0.661), (0.008, 0.023, 0.009))
    skirt = _upright(bones, OUTLINES["skirt"], 24, ("pelvis",), split=True)
    made = [
        _divide(head, "face", (body_regions.HAIRLINE, body_regions.SHOULDERS)),
        _divide(trunk, "hips", (body_regions.WAIST, *body_regions.FRONT)),
        _divide(lips, "lips", ()),
        _divide(skirt, "skirt_top", body_regions.SKIRT),
        _curtain(bones),
    ]
    for side, sign in (("l", 1.0), ("r", -1.0)):
        made += _limbs(bones, side, sign)
    return made


def _limbs(bones: Bones, side: str, sign: float) -> Sequence[MeshRows]:
    arm, hand = _arm(bones, side), _hand(bones, side)
    leg = (f"thigh_{side}", f"calf_{side}", f"foot_{side}")
    bare = _upright(bones, OUTLINES["leg"], 12, leg, middle_y_m=_LEG_Y)
    foot = _foot(bones, side)
    eye = _ball(bones, (0.1335, 0.031, 0.728), (0.0145, 0.0145, 0.0075))
    brow = _ball(bones, (0.137, 0.033, 0.75), (0.008, 0.021, 0.0045))
    ear = _ball(bones, (0.045, 0.079, 0.715), (0.017, 0.007, 0.028))
    short = body_regions.Cut("torso", "sleeves", _level_beyond(0.145))
    made = [
        _divide(arm, "", (body_regions.Cut("", "arms", _level_beyond(0.1)),)),
        _divide(arm, "torso", (short,)),
        _divide(hand, "hands", ()),
        _divide(bare, "legs", (body_regions.THIGH,)),
        _divide(bare, "thighs", (body_regions.KNEE, body_regions.CUFF)),
        _divide(foot, "shoes", (body_regions.SOLE,)),
        _divide(eye, "eyes", (body_regions.Cut("eyes", "irises", _pupil),)),
        _divide(brow, "brows", ()),
        _divide(ear, "face", ()),
    ]
    return made if sign > 0.0 else [_mirror(rows) for rows in made]


def _mirror(rows: MeshRows) -> MeshRows:
    """Mirror left limbs; they already follow the right bones."""
    values = rows.values.copy()
    values[:, 1] *= -1.0
    return MeshRows(values, rows.faces[:, ::-1], rows.zones)


def _level_beyond(distance_m: float) -> Level:
    def level(p: Array) -> Array:
        return np.asarray(((p - _SHOULDER) * _DOWN_OUT).sum(axis=1) - distance_m)

    return level


def _pupil(p: Array) -> Array:
    return np.asarray(0.0065 - np.abs(p[:, 1] - 0.031))


def _divide(loft: tuple[Array, Indices], zone: str, cuts: Sequence[body_regions.Cut]) -> MeshRows:
    return body_regions.apply_cuts(make_rows(*loft, zone), cuts)


def _upright(
    bones: Bones,
    outline: Sequence[Sequence[float]],
    columns: int,
    chain: Sequence[str],
    *,
    middle_y_m: float = 0.0,
    split: bool = False,
) -> tuple[Array, Indices]:
    """A loft of level ellipses; with ``split``, its lower halves follow the thighs."""
    z, x, depth, width = np.array(outline).T
    middles = np.stack([x, np.full_like(x, middle_y_m), z], axis=1)
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    values, faces = _loft(middles, axes, np.stack([depth, width], axis=1), columns)
    # Rings run downward for the trunk and upward for the head: outward either way.
    faces = faces if z[0] > z[-1] else faces[:, ::-1]
    weights = _along_chain(bones, values[:, 2], chain, 2)
    if split:
        names = list(bones)
        legs = np.clip((0.1 - values[:, 2]) / 0.25, 0.0, 1.0)
        left = np.clip(0.5 + values[:, 1] / 0.16, 0.0, 1.0)
        weights *= 1.0 - legs[:, None]
        weights[:, names.index("thigh_l")] += legs * left
        weights[:, names.index("thigh_r")] += legs * (1.0 - left)
    return np.concatenate([values, weights], axis=1), faces


def _arm(bones: Bones, side: str) -> tuple[Array, Indices]:
    chain = ("spine_03", f"upperarm_{side}", f"lowerarm_{side}")
    length = float((_WRIST - _SHOULDER) @ _DOWN_OUT)
    share, across, depth = np.array(OUTLINES["arm"]).T
    return _along_arm(bones, _SHOULDER, share * length, np.stack([depth, across], 1), chain)


def _hand(bones: Bones, side: str) -> tuple[Array, Indices]:
    share, thick, broad = np.array(OUTLINES["hand"]).T
    halves = np.stack([broad, thick], axis=1)
    values, faces = _along_arm(bones, _WRIST, share * _HAND_M, halves, (f"hand_{side}",))
    thumb, thumb_faces = _ball(bones, (0.0, 0.0, 0.0), (0.014, 0.014, 0.036), f"hand_{side}")
    thumb[:, :3] += _WRIST + 0.35 * _HAND_M * _DOWN_OUT + (0.045, 0.0, 0.0)
    return np.concatenate([values, thumb]), np.concatenate([faces, thumb_faces + len(values)])


def _along_arm(
    bones: Bones, start: Array, along_m: Array, halves_m: Array, chain: Sequence[str]
) -> tuple[Array, Indices]:
    across = np.cross(_DOWN_OUT, [1.0, 0.0, 0.0])
    middles = start + along_m[:, None] * _DOWN_OUT
    values, faces = _loft(middles, np.array([[1.0, 0.0, 0.0], -across]), halves_m, 10)
    # Bones change by the distance along the arm, measured downwards like heights are.
    heights = -((values - _SHOULDER) @ _DOWN_OUT)
    weights = _along_chain(bones, heights, chain, -1)
    return np.concatenate([values, weights], axis=1), faces


def _foot(bones: Bones, side: str) -> tuple[Array, Indices]:
    x, z, width, height = np.array(OUTLINES["foot"]).T
    middles = np.stack([x, np.full_like(x, _LEG_Y), z], axis=1)
    axes = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    values, faces = _loft(middles, axes, np.stack([width, height], axis=1), 12)
    values[:, 2] = np.maximum(values[:, 2], _SOLE_Z_M)
    names = list(bones)
    toes = np.clip((values[:, 0] - 0.1) / 0.04, 0.0, 1.0)
    weights = np.zeros((len(values), len(names)))
    weights[:, names.index(f"ball_{side}")] = toes
    weights[:, names.index(f"foot_{side}")] = 1.0 - toes
    return np.concatenate([values, weights], axis=1), faces[:, ::-1]


def _ball(bones: Bones, middle_m: Vec3, radii_m: Vec3, bone: str = "head") -> tuple[Array, Indices]:
    """An ellipsoid that moves with one bone."""
    polar = np.linspace(0.0, math.pi, 6)
    rings = np.stack([np.sin(polar)] * 2, axis=1) * radii_m[:2]
    middles = np.array(middle_m) + np.cos(polar)[:, None] * np.array([0.0, 0.0, radii_m[2]])
    values, faces = _loft(middles, np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), rings, 9)
    weights = np.zeros((len(values), len(bones)))
    weights[:, list(bones).index(bone)] = 1.0
    return np.concatenate([values, weights], axis=1), faces


def _curtain(bones: Bones) -> MeshRows:
    places = body_regions.curtain_points()
    weights = _along_chain(bones, places[:, 2], ("spine_03", "neck_01", "head"), 2)
    columns = body_regions.CURTAIN_COLUMNS
    faces = grid_faces(len(places) // columns, columns)
    return _divide((np.concatenate([places, weights], axis=1), faces), "hair", body_regions.HAIR)


def _loft(middles: Array, axes: Array, halves: Array, columns: int) -> tuple[Array, Indices]:
    """Ellipses joined ring by ring, and closed at ends that are nearly points.

    Faces look outward if the rings run against the cross product of the axes.
    """
    turn = 2.0 * math.pi * np.arange(columns) / columns
    spread = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    offsets = (halves[:, None, :] * spread[None]) @ axes
    places = (middles[:, None] + offsets).reshape(-1, 3)
    row, column = np.divmod(grid_faces(len(middles), columns + 1), columns + 1)
    faces = [row * columns + column % columns]
    ring = np.arange(columns)
    for end, order in ((0, (2, 0, 1)), (len(middles) - 1, (0, 2, 1))):
        if halves[end].max() < _POINT_M:
            fan = np.stack([ring, (ring + 1) % columns, np.full(columns, len(places))], axis=1)
            fan[:, :2] += end * columns
            faces.append(fan[:, order])
            places = np.concatenate([places, middles[end : end + 1]])
    return places, np.concatenate(faces)


def _along_chain(bones: Bones, heights: Array, chain: Sequence[str], axis: int) -> Array:
    """Bone weights of points along a chain, blended around the head of each next bone.

    Args:
        bones: All bones.
        heights: Coordinate ``axis`` of the points, or minus the distance along the arm for -1.
        chain: Bones from one end to the other.
        axis: 2 for heights in z, -1 for distances along the arm.
    """
    names = list(bones)
    weights = np.zeros((len(heights), len(names)))
    joints = []
    for name in chain:
        head = bones[name][1] * (1.0, 1.0 if bones[name][1][1] >= 0 else -1.0, 1.0)
        joints.append(head[2] if axis == 2 else -float((head - _SHOULDER) @ _DOWN_OUT))
    share = np.ones(len(heights))
    for k in range(len(chain) - 1, 0, -1):
        up = 1.0 if axis == 2 and joints[k] > joints[k - 1] else -1.0
        past = np.clip(0.5 + up * (heights - joints[k]) / (2.0 * _SMOOTH_M), 0.0, 1.0)
        weights[:, names.index(chain[k])] += share * past
        share = share * (1.0 - past)
    weights[:, names.index(chain[0])] += share
    return weights


def _model_face(head: tuple[Array, Indices]) -> None:
    """A nose, and hollows for the eyes."""
    p = head[0]
    front = p[:, 0] > 0.1
    nose = 0.026 * np.exp(-(((p[:, 2] - 0.697) / 0.02) ** 2) - (p[:, 1] / 0.013) ** 2)
    p[:, 0] += np.where(front, nose, 0.0)
