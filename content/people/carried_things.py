"""Items that people carry, push and pull, fitted to their hands, shoulders and heads.

Sizes are of common products: a phone of 150 x 75 mm, a cabin suitcase of 55 x 40 x 23 cm, an
umbrella of 1 m across, a pram of 0.8 x 0.5 m; assumed, +/- 15 %.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gen_data.content.people.body import Array, BodyTemplate, Indices
from gen_data.content.people.body_regions import grid_faces
from gen_data.content.people.hair import hair_material
from gen_data.content.people.person import Person
from gen_data.content.people.posing import HELD, vertex_normals
from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.core.asset_types import Float32, Material

_PHONE = Material((0.012, 0.012, 0.014), 0.15, role="bag")
_PAPER = Material(hex_to_linear("#e4e0d6"), 0.8, role="bag")
_CARDBOARD = Material(hex_to_linear("#a67f55"), 0.9, role="bag")
_RUBBER = Material((0.02, 0.02, 0.021), 0.85, role="bag")
_BAR = Material((0.25, 0.25, 0.26), 0.4, 0.9, role="bag")


STRAPPED = ("backpack", "shoulder_bag")
"""Bags with straps that lie on clothes."""


@dataclass(frozen=True, eq=False, slots=True)
class Sheet:
    """A finished piece of surface."""

    vertices_m: Array
    normals: Array
    faces: Indices
    slots: Indices
    materials: tuple[Material, ...]
    uvs: Float32 | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Carrier:
    """A posed person, reduced to the data that carried items need.

    Attributes:
        posed_m: Bone heads and landmarks [m], shape [bones + landmarks, 3].
        transforms: Transforms of all bones, shape [bones, 3, 4].
        scale: Size of the person divided by the size of the template.
        ground_m: Height of the lowest vertex.
        surface: Positions of the top's vertices in the template frame and in the pose, and their
            normals; empty unless the bag is one of ``STRAPPED``.
    """

    person: Person
    body: BodyTemplate
    posed_m: Array
    transforms: Array
    scale: float
    ground_m: float
    surface: tuple[Array, Array, Array]

    def at(self, bone: str) -> Array:
        """Head of a bone [m]."""
        place: Array = self.posed_m[self.body.bone(bone)]
        return place

    def axes(self, bone: str) -> Array:
        """Rotation of a bone from the template's pose [3, 3]."""
        turn: Array = self.transforms[self.body.bone(bone), :, :3]
        return turn

    def grip(self, side: str) -> Array:
        """Middle of a hand [m]."""
        middle: Array = 0.5 * (self.at(f"hand_{side}") + self.at(f"middle_03_{side}"))
        return middle

    def before_palm(self, side: str, away_m: float) -> Array:
        """Place before the roots of the fingers, at a distance from the bones [m]."""
        wrist, knuckle = self.at(f"hand_{side}"), self.at(f"middle_01_{side}")
        across = self.at(f"pinky_01_{side}") - self.at(f"index_01_{side}")
        palm = np.cross(across, knuckle - wrist) * (1.0 if side == "l" else -1.0)
        place: Array = 0.2 * wrist + 0.8 * knuckle + away_m * palm / float(np.linalg.norm(palm))
        return place


def make_things(carrier: Carrier) -> list[Sheet]:
    """All that a person wears on the back, holds, pushes or pulls."""
    outfit, held = carrier.person.outfit, HELD[carrier.person.pose]
    made = _visor(carrier) if outfit.headwear == "cap" else _tied_hair(carrier)
    if outfit.bag == "backpack":
        made += _backpack(carrier)
    elif outfit.bag == "shoulder_bag":
        made += _shoulder_bag(carrier)
    elif outfit.bag and not held:
        sides = "lr" if outfit.bag == "shopping_both" else "r"
        for side in sides:
            if outfit.bag.startswith("shopping"):
                made += _hanging_bag(carrier, side, _sack, _PAPER)
            else:
                made += _hanging_bag(carrier, side, _soft_case, outfit.bag_material)
    return made + (_HELD[held](carrier) if held else [])


def _phone(carrier: Carrier) -> list[Sheet]:
    place = 0.6 * carrier.at("middle_01_r") + 0.4 * carrier.at("thumb_03_r")
    return [pillow(place, np.array([0.15, 0.075, 0.01]), carrier.axes("hand_r"), _PHONE)]


def _cup(carrier: Carrier) -> list[Sheet]:
    place = carrier.before_palm("r", 0.045)
    cup = pillow(place, np.array([0.08, 0.08, 0.12]), np.eye(3), _PAPER)
    lid = pillow(_moved(place, z=0.06), np.array([0.086, 0.086, 0.018]), np.eye(3), _RUBBER)
    return [cup, lid]


def _carrier_bag(carrier: Carrier) -> list[Sheet]:
    return _hanging_bag(carrier, "r", _sack, carrier.person.outfit.bag_material)


def _carrier_bags(carrier: Carrier) -> list[Sheet]:
    return [*_hanging_bag(carrier, "l", _sack, _PAPER), *_carrier_bag(carrier)]


def _hanging_bag(
    carrier: Carrier, side: str, body: Callable[[Array, Array, Material], Sheet], material: Material
) -> list[Sheet]:
    """A bag that hangs from a hand by two cords and keeps upright.

    Args:
        carrier: Person who holds it.
        side: ``l`` or ``r``.
        body: Makes the bag from its middle and size [m].
        material: Material of all parts.
    """
    grip, scale = carrier.grip(side), carrier.scale
    room_m = float(grip[2]) - carrier.ground_m
    size = np.minimum(np.array([0.32, 0.12, 0.34]) * scale, (1.0, 1.0, 0.75 * room_m))
    drop = 0.1 * scale + 0.5 * float(size[2])
    middle = grip - (0.0, 0.0, drop)
    bag = body(middle, size, material)
    made = [bag]
    for y in (-0.35, 0.35):
        low = middle + size * (0.0, y, 0.46)
        away = size * (0.22, 0.0, 0.0)
        bend = 0.5 * (low + grip)
        course = (low - away, bend - 0.7 * away, grip, bend + 0.7 * away, low + away)
        made.append(_cord(np.stack(course), 0.009 * carrier.scale, material))
    return made


def _soft_case(middle: Array, size_m: Array, material: Material) -> Sheet:
    return pillow(middle, size_m, np.eye(3), material)


def _sack(middle: Array, size_m: Array, material: Material) -> Sheet:
    """An open bag of paper or film whose mouth is pressed together."""
    corners = np.array([(1, -1), (1, 0), (1, 1), (0.4, 1), (-0.4, 1), (-1, 1), (-1, 0), (-1, -1),
                        (-0.4, -1), (0.4, -1), (1, -1)], dtype=float)  # fmt: skip
    rows = []
    for z, x, y, fold in _SACK:
        ring = corners * (x, y)
        # The narrow sides fold inwards.
        ring[[1, 6], 0] *= 1.0 - fold
        rows.append(np.column_stack([ring, np.full(len(ring), z)]))
    places = 0.5 * np.concatenate(rows) * size_m + middle
    faces = grid_faces(len(rows), len(corners))[:, ::-1]
    normals = vertex_normals(places, faces)
    return Sheet(places, normals, faces, np.zeros(len(faces), np.int64), (material,))


_SACK = ((-0.98, 0.0, 0.0, 0.0), (-1.0, 0.95, 0.9, 0.0), (-0.9, 1.0, 1.0, 0.02),
         (0.1, 0.99, 0.85, 0.16), (1.0, 1.0, 0.6, 0.3), (0.98, 0.97, 0.54, 0.32),
         (0.3, 0.9, 0.7, 0.2))  # fmt: skip
"""Rings of a sack from its floor over the mouth into its inside: height, half length, half width
as shares of half of its size, and how far the narrow sides fold in."""


def _cord(course: Array, width_m: float, material: Material) -> Sheet:
    """A thin cord in a plane of constant Y, along points [n, 3]."""
    along = np.gradient(course, axis=0)
    along /= np.sqrt((along * along).sum(axis=1, keepdims=True))
    side = np.array([0.0, 1.0, 0.0])
    up = np.cross(along, side)
    turn = 2.0 * math.pi * np.arange(4) / 3.0
    ring = [np.cos(t) * side + np.sin(t) * up for t in turn.tolist()]
    places = (course[:, None] + 0.5 * width_m * np.stack(ring, axis=1)).reshape(-1, 3)
    faces = grid_faces(len(course), len(turn))
    normals = vertex_normals(places, faces)
    return Sheet(places, normals, faces, np.zeros(len(faces), np.int64), (material,))


def _box(carrier: Carrier) -> list[Sheet]:
    middle = 0.5 * (carrier.grip("l") + carrier.grip("r")) + (0.02, 0.0, 0.08)
    across = abs(float(carrier.grip("l")[1] - carrier.grip("r")[1]))
    size = np.array([0.28, max(0.2, across - 0.04), 0.26])
    return [pillow(middle, size, np.eye(3), _CARDBOARD)]


def _suitcase(carrier: Carrier) -> list[Sheet]:
    grip = carrier.before_palm("r", 0.02)
    foot = np.array([grip[0] - 0.42, grip[1] - 0.06, carrier.ground_m + 0.03])
    axes = _axes_along(grip - foot)
    length = math.sqrt(float(((grip - foot) ** 2).sum()))
    case_m = min(0.55, 0.7 * length)
    middle, cloth = (
        foot + axes @ (0.0, 0.0, 0.5 * case_m + 0.03),
        carrier.person.outfit.bag_material,
    )
    case = pillow(middle, np.array([0.23, 0.4, case_m]), axes, cloth)
    bars = [_bar(foot + axes @ (0.0, y, case_m), grip + axes @ (0.0, y, 0.0), 0.014, _BAR)
            for y in (-0.07, 0.07)]  # fmt: skip
    handle = _bar(grip + axes @ (0.0, -0.09, 0.0), grip + axes @ (0.0, 0.09, 0.0), 0.025, _RUBBER)
    wheels = [_wheel(_moved(foot, y=y), 0.06, 0.03) for y in (-0.16, 0.16)]
    return [case, *bars, handle, *wheels]


def _pram(carrier: Carrier) -> list[Sheet]:
    left, right = (carrier.before_palm(side, 0.024) for side in "lr")
    hand, ground = 0.5 * (left + right), carrier.ground_m
    middle = np.array([hand[0] + 0.62, hand[1], ground + 0.62])
    cloth = carrier.person.outfit.bag_material
    basket = pillow(middle, np.array([0.8, 0.42, 0.3]), np.eye(3), cloth)
    hood = pillow(_moved(middle, x=-0.2, z=0.2), np.array([0.42, 0.42, 0.4]), np.eye(3), cloth)
    bar = _bar(_moved(hand, y=-0.24), _moved(hand, y=0.24), 0.03, _RUBBER)
    frame = []
    for y in (-0.22, 0.22):
        side = np.array([0.0, y, 0.0])
        front = np.array([middle[0] + 0.28, hand[1], ground + 0.12])
        back = np.array([middle[0] - 0.3, hand[1], ground + 0.12])
        frame += [_bar(hand + side, front + side, 0.022, _BAR),
                  _bar(back + side, middle + side + (0.1, 0.0, -0.1), 0.022, _BAR)]  # fmt: skip
        frame += [_wheel(at + side, 0.24, 0.04) for at in (front, back)]
    return [basket, hood, bar, *frame]


_RIBS = 8
_OPEN_M, _RISE_M, _DROP_M = 0.5, 0.84, 0.2
"""Radius of a canopy, height of its top above the hand, and of its top above its edge."""


def _umbrella(carrier: Carrier) -> list[Sheet]:
    """Eight panels that hang between their ribs, on a shaft that leans back over the shoulder."""
    grip, rise = carrier.before_palm("r", 0.024), _RISE_M * carrier.scale
    axes = _axes_along(np.array([-0.12, 0.1, 1.0]))
    # Rings of ribs and middles of panels by turns; cloth curves in between ribs.
    reach = np.array([0.02, 0.25, 0.5, 0.75, 1.0])[:, None]
    steps = 4 * _RIBS
    turn = 2.0 * math.pi * np.arange(steps + 1)[None] / steps
    slack = np.sin(0.5 * _RIBS * turn) ** 2 * reach**2
    radius = _OPEN_M * (1.0 - 0.11 * slack) * reach
    height = rise - _DROP_M * reach**1.8 - 0.012 * slack
    dome = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=2)
    places = dome.reshape(-1, 3) @ axes.T + grip
    faces = grid_faces(len(reach), steps + 1)
    both = np.concatenate([faces, faces[:, ::-1] + len(places)])
    normals = vertex_normals(places, faces)
    # Rings run outward: the upper side is the one whose normals rise.
    normals = normals * np.sign(normals[:, 2].mean() + 1e-9)
    canopy = Sheet(np.concatenate([places, places - 0.003 * normals]),
                   np.concatenate([normals, -normals]), both, np.zeros(len(both), np.int64),
                   (_umbrella_cloth(carrier),))  # fmt: skip
    top = grip + axes @ (0.0, 0.0, rise)
    ribs = []
    for k in range(_RIBS):
        angle = 2.0 * math.pi * k / _RIBS
        out = np.array([math.cos(angle), math.sin(angle), 0.0])
        end = grip + axes @ (0.98 * _OPEN_M * out + (0.0, 0.0, rise - _DROP_M - 0.006))
        middle = grip + axes @ (0.5 * _OPEN_M * out + (0.0, 0.0, rise - 0.29 * _DROP_M - 0.008))
        ribs += [_rod(top - axes @ (0.0, 0.0, 0.01), middle), _rod(middle, end),
                 _rod(grip + axes @ (0.0, 0.0, rise - 0.26), middle)]  # fmt: skip
    shaft = _bar(grip - axes @ (0.0, 0.0, 0.06), top + axes @ (0.0, 0.0, 0.05), 0.012, _BAR)
    handle = _bar(grip - axes @ (0.0, 0.0, 0.12), grip + axes @ (0.0, 0.0, 0.05), 0.026, _RUBBER)
    return [canopy, *ribs, shaft, handle]


def _closed_umbrella(carrier: Carrier) -> list[Sheet]:
    """A furled umbrella that hangs from the hand, its tip above the ground."""
    grip = carrier.before_palm("r", 0.024)
    length = min(0.78, float(grip[2]) - carrier.ground_m - 0.06)
    axes = _axes_along(np.array([0.1, 0.02, -1.0]))
    along = np.array([0.1, 0.13, 0.3, 0.6, 0.86, 0.9])[:, None] * length
    widths = np.array([0.004, 0.017, 0.026, 0.034, 0.03, 0.007])[:, None]
    turn = 2.0 * math.pi * np.arange(2 * _RIBS + 1)[None] / (2 * _RIBS)
    # Folds of the cloth lie around the shaft in a spiral.
    radius = widths * (1.0 + 0.16 * np.cos(_RIBS * turn + 3.0 * along))
    rows = np.stack([radius * np.cos(turn), radius * np.sin(turn), along + 0.0 * turn], axis=2)
    places = rows.reshape(-1, 3) @ axes.T + grip
    faces = grid_faces(len(along), 2 * _RIBS + 1)[:, ::-1]
    cloth = Sheet(places, vertex_normals(places, faces), faces, np.zeros(len(faces), np.int64),
                  (_umbrella_cloth(carrier),))  # fmt: skip
    tip = _bar(
        grip + axes @ (0.0, 0.0, 0.85 * length), grip + axes @ (0.0, 0.0, length), 0.01, _BAR
    )
    handle = _bar(grip - axes @ (0.0, 0.0, 0.05), grip + axes @ (0.0, 0.0, 0.11), 0.026, _RUBBER)
    return [cloth, tip, handle]


def _umbrella_cloth(carrier: Carrier) -> Material:
    """Two of three umbrellas are black or navy (assumed); the others have a strong colour."""
    code = _UMBRELLAS[7 * carrier.person.seed % len(_UMBRELLAS)]
    return Material(hex_to_linear(code), 0.6, specular=0.4, role="bag")


_UMBRELLAS = ("#15161a", "#1c2438", "#15161a", "#7d1f26", "#20242a", "#2d5a4a", "#15161a",
              "#c9a42c", "#1c2438", "#15161a", "#3a6ea5", "#20242a")  # fmt: skip


def _rod(start: Array, end: Array) -> Sheet:
    axes = _axes_along(end - start)
    turn = 2.0 * math.pi * np.arange(3) / 3.0
    ring = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1) @ axes.T
    places = np.concatenate([start + 0.0025 * ring, end + 0.0025 * ring])
    faces = np.array([(i, (i + 1) % 3, 3 + (i + 1) % 3) for i in range(3)]
                     + [(i, 3 + (i + 1) % 3, 3 + i) for i in range(3)])  # fmt: skip
    normals = np.concatenate([ring, ring])
    return Sheet(places, normals, faces, np.zeros(len(faces), np.int64), (_BAR,))


def _backpack(carrier: Carrier) -> list[Sheet]:
    scale, trunk = carrier.scale, carrier.axes("spine_03")
    middle = carrier.at("spine_03") + trunk @ (np.array([-0.172, 0.0, 0.03]) * scale)
    material = carrier.person.outfit.bag_material
    pack = pillow(middle, np.array([0.17, 0.3, 0.42]) * scale, trunk, material)
    pocket = pillow(middle + trunk @ (np.array([-0.08, 0.0, -0.07]) * scale),
                    np.array([0.07, 0.22, 0.2]) * scale, trunk, material, steps=3)  # fmt: skip
    straps = [
        _strap(carrier, [(x, sign * y, z) for x, y, z in _BACKPACK_STRAP], 0.055)
        for sign in (-1.0, 1.0)
    ]
    return [pack, pocket, *straps]


_BACKPACK_STRAP = ((-0.07, 0.09, 0.5), (0.0, 0.1, 0.56), (0.07, 0.1, 0.52), (0.12, 0.105, 0.45),
                   (0.13, 0.11, 0.38), (0.1, 0.13, 0.31), (0.04, 0.155, 0.25),
                   (-0.04, 0.15, 0.2), (-0.1, 0.12, 0.18))  # fmt: skip
_SHOULDER_STRAP = ((-0.06, -0.08, 0.5), (0.0, -0.085, 0.57), (0.08, -0.07, 0.5), (0.13, -0.02, 0.4),
                   (0.13, 0.05, 0.28), (0.11, 0.1, 0.17), (0.06, 0.15, 0.06))  # fmt: skip
"""Courses of straps over a shoulder, in the template frame [m]."""


def _shoulder_bag(carrier: Carrier) -> list[Sheet]:
    scale = carrier.scale
    middle = carrier.at("thigh_l") + np.array([-0.05, 0.15, 0.03]) * scale
    material = carrier.person.outfit.bag_material
    bag = pillow(middle, np.array([0.3, 0.1, 0.24]) * scale, np.eye(3), material)
    return [bag, _strap(carrier, _SHOULDER_STRAP, 0.035)]


def _strap(carrier: Carrier, course: Sequence[tuple[float, float, float]], width_m: float) -> Sheet:
    """A padded band on the clothes along a course in the template frame [m]."""
    template, posed, normals = carrier.surface
    # The course passes the armpits: it lies on the trunk, never on a sleeve.
    trunk = np.abs(template[:, 1]) < _TRUNK_M
    template, posed, normals = template[trunk], posed[trunk], normals[trunk]
    knots = np.array(course)
    at = np.linspace(0.0, len(knots) - 1.0, _STRAP_ROWS)
    way = np.stack([np.interp(at, np.arange(len(knots)), axis) for axis in knots.T], axis=1)
    nearest = np.argsort(_squared_m(way, template), axis=1, kind="stable")[:, :6]
    up = _smooth(normals[nearest].mean(axis=1), 2)
    up /= np.maximum(np.sqrt((up * up).sum(axis=1, keepdims=True)), 1e-9)
    places = _smooth(posed[nearest].mean(axis=1), 2)
    # It rests on whatever stands out most below it.
    rise = ((posed[None] - places[:, None]) * up[:, None]).sum(axis=2)
    below = _squared_m(places, posed) < (0.6 * width_m * carrier.scale) ** 2
    lift = np.where(below & (rise < 0.03), rise, 0.0).max(axis=1)
    lift = np.maximum(lift, np.maximum(np.roll(lift, 1), np.roll(lift, -1)))
    places += _smooth(lift[:, None], 3) * up
    along = np.gradient(places, axis=0)
    side = np.cross(up, along)
    side *= 0.5 * width_m / np.maximum(np.sqrt((side * side).sum(axis=1, keepdims=True)), 1e-9)
    # A third of the cross-sections is enough once they are smooth.
    places, side, up = places[::3], side[::3], up[::3]
    band = np.stack([places + x * side + z * up for x, z in _BAND], axis=1).reshape(-1, 3)
    faces = grid_faces(len(places), len(_BAND))
    material = carrier.person.outfit.bag_material
    slots = np.zeros(len(faces), np.int64)
    return Sheet(band, vertex_normals(band, faces), faces, slots, (material,))


_STRAP_ROWS, _TRUNK_M = 31, 0.185
"""Cross-sections of a strap; half of the trunk's width in the template frame [m]."""
_BAND = ((-1.0, -0.012), (-0.9, 0.008), (0.9, 0.008), (1.0, -0.012))
"""Cross-section of a strap: shares of half of its width, and height above the clothes [m]."""


def _squared_m(a: Array, b: Array) -> Array:
    """Squared distances of points [n, 3] and [m, 3] from each other, [n, m]."""
    squared: Array = ((b[None] - a[:, None]) ** 2).sum(axis=2)
    return squared


def _smooth(rows: Array, passes: int) -> Array:
    """Rows averaged with their neighbours; the ends stay."""
    for _ in range(passes):
        rows = np.concatenate(
            [rows[:1], 0.5 * rows[1:-1] + 0.25 * (rows[:-2] + rows[2:]), rows[-1:]]
        )
    return rows


def _visor(carrier: Carrier) -> list[Sheet]:
    """The peak of a cap, above the eyes."""
    head, body = carrier.axes("head"), carrier.body
    eyes = [carrier.posed_m[body.landmark(f"{side}_eye")] for side in ("left", "right")]
    middle = 0.5 * (eyes[0] + eyes[1]) + head @ (np.array([0.035, 0.0, 0.058]) * carrier.scale)
    size = np.array([0.13, 0.15, 0.014]) * carrier.scale
    return [pillow(middle, size, head, carrier.person.outfit.hat_material, steps=3)]


def _tied_hair(carrier: Carrier) -> list[Sheet]:
    """A bun, or a ponytail that hangs from the back of the head."""
    haircut, headwear = carrier.person.haircut, carrier.person.outfit.headwear
    if haircut not in ("bun", "ponytail") or headwear:
        return []
    head, scale = carrier.axes("head"), carrier.scale
    crown = carrier.posed_m[carrier.body.landmark("crown")]
    knot = crown + head @ (np.array([-0.118, 0.0, -0.075]) * scale)
    hair = replace(hair_material(carrier.person), texture_scale_m=0.2)
    if haircut == "bun":
        return [_lock(knot, head @ np.array([-1.0, 0.0, 0.0]), _BUN, scale, hair)]
    # It falls freely: only its root turns with the head.
    back = head @ np.array([-1.0, 0.0, 0.0]) * (1.0, 1.0, 0.0)
    return [_lock(knot, back, _PONYTAIL, scale, hair)]


_BUN = ((0.0, -0.038, 0.006), (0.0, -0.03, 0.026), (0.0, -0.012, 0.038), (0.0, 0.012, 0.038),
        (0.0, 0.03, 0.026), (0.0, 0.038, 0.006))  # fmt: skip
_PONYTAIL = ((-0.03, 0.0, 0.012), (0.015, 0.0, 0.018), (0.035, 0.03, 0.028), (0.035, 0.1, 0.032),
             (0.028, 0.18, 0.026), (0.022, 0.24, 0.012), (0.02, 0.26, 0.002))  # fmt: skip
"""Rings of tied hair [m]: behind the knot, below it, half their width."""


def _lock(
    knot: Array, back: Array, rings: Sequence[tuple[float, float, float]], scale: float,
    hair: Material,
) -> Sheet:  # fmt: skip
    """Hair in rings around a course that begins at a knot."""
    drop = np.array([0.0, 0.0, -1.0])
    side = np.cross(back, drop)
    turn = 2.0 * math.pi * np.arange(9)[:, None] / 8.0
    around = np.cos(turn) * back + 1.2 * np.sin(turn) * side
    rows = [
        knot + scale * (behind * back + below * drop + half * around)
        for behind, below, half in rings
    ]
    places, faces = np.concatenate(rows), grid_faces(len(rows), 9)
    normals = vertex_normals(places, faces)
    return Sheet(places, normals, faces, np.zeros(len(faces), np.int64), (hair,))


def _moved(place: Array, *, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Array:
    moved: Array = place + np.array([x, y, z])
    return moved


def _wheel(middle: Array, diameter_m: float, width_m: float) -> Sheet:
    """A wheel about the Y axis."""
    profile = ((0.02, -0.5), (0.92, -0.5), (1.0, 0.0), (0.92, 0.5), (0.02, 0.5))
    turn = 2.0 * math.pi * np.arange(13) / 12.0
    rows = [
        np.stack([0.5 * diameter_m * r * np.cos(turn), np.full_like(turn, w * width_m),
                  0.5 * diameter_m * r * np.sin(turn)], axis=1)
        for r, w in profile
    ]  # fmt: skip
    places = np.concatenate(rows) + middle
    faces = grid_faces(len(profile), 13)[:, ::-1]
    normals = vertex_normals(places, faces)
    return Sheet(places, normals, faces, np.zeros(len(faces), np.int64), (_RUBBER,))


def _bar(start: Array, end: Array, width_m: float, material: Material) -> Sheet:
    length = math.sqrt(float(((end - start) ** 2).sum()))
    size = np.array([width_m, width_m, length])
    return pillow(0.5 * (start + end), size, _axes_along(end - start), material, steps=2)


def _axes_along(direction: Array) -> Array:
    """Axes whose third is a direction and whose second is as level and as far left as can be."""
    z = direction / math.sqrt(float((direction * direction).sum()))
    hint = np.array([0.0, 1.0, 0.0]) if abs(float(z[1])) < 0.9 else np.array([1.0, 0.0, 0.0])
    x = np.cross(hint, z)
    x = x / math.sqrt(float((x * x).sum()))
    return np.stack([x, np.cross(z, x), z], axis=1)


def pillow(
    middle: Array, size_m: Array, axes: Array, material: Material, *, steps: int = 4
) -> Sheet:
    """A box with round edges; ``steps`` squares along each edge."""
    n = steps + 1
    t = np.linspace(-1.0, 1.0, n)
    u, v = (grid.ravel() for grid in np.meshgrid(t, t, indexing="ij"))
    quads = [
        (i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1)
        for i in range(n - 1)
        for j in range(n - 1)
    ]
    faces = np.array([tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))])
    places: list[Array] = []
    triangles: list[Indices] = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            p = np.zeros((n * n, 3))
            p[:, axis], p[:, (axis + 1) % 3], p[:, (axis + 2) % 3] = sign, u, v
            triangles.append((faces if sign > 0 else faces[:, ::-1]) + n * n * len(places))
            places.append(p)
    cube = np.concatenate(places)
    # A superellipsoid of degree six: flat sides, soft edges.
    around = cube / ((cube**6).sum(axis=1, keepdims=True) ** (1.0 / 6.0))
    vertices = (0.5 * size_m * around) @ axes.T + middle
    index = np.concatenate(triangles)
    normals = _across_seams(around, vertices, index)
    return Sheet(vertices, normals, index, np.zeros(len(index), np.int64), (material,))


def _across_seams(around: Array, vertices: Array, faces: Indices) -> Array:
    """Normals that vertices in the same place share."""
    _, first, inverse = np.unique(
        np.rint(around * 1e6), axis=0, return_index=True, return_inverse=True
    )
    normals: Array = vertex_normals(vertices[first], inverse.reshape(-1)[faces])
    return normals[inverse.reshape(-1)]


_HELD: Mapping[str, Callable[[Carrier], list[Sheet]]] = {
    "phone": _phone,
    "cup": _cup,
    "carrier_bag": _carrier_bag,
    "carrier_bags": _carrier_bags,
    "box": _box,
    "suitcase": _suitcase,
    "pram": _pram,
    "umbrella": _umbrella,
    "closed_umbrella": _closed_umbrella,
}
