"""Bottles, cans, cartons and jars, with printed labels.

Labels are texture families of the same seed; where a drawing needs the object's proportions, both
take them from the pure functions here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from generator.assets.procedural import hulls
from generator.assets.procedural.draw import between, chance, pick, rng_of
from generator.assets.procedural.family import Solid
from generator.assets.procedural.materials import (
    ALUMINIUM,
    STEEL,
    jittered,
    linear,
    metal,
    plastic,
    printed,
)
from generator.assets.procedural.mesh import Patch, centred
from generator.assets.procedural.shapes import (
    Point2,
    UvRect,
    circle,
    extruded,
    fillet,
    grid,
    lathe,
    rounded_box,
)
from generator.core.geometry import Material
from generator.core.se3 import Vec3

# Where each face of a carton lies in its image: four sides above, top and bottom below.
CARTON_ATLAS: Mapping[str, UvRect] = {
    "front": (0.002, 0.252, 0.338, 0.998),
    "left": (0.342, 0.252, 0.498, 0.998),
    "back": (0.502, 0.252, 0.838, 0.998),
    "right": (0.842, 0.252, 0.998, 0.998),
    "top": (0.002, 0.002, 0.498, 0.248),
    "bottom": (0.502, 0.002, 0.998, 0.248),
}

# Label paper stands this much proud of the wall.
_PROUD_M = 0.0003


@dataclass(frozen=True, slots=True)
class _BottleStyle:
    """Ranges of one kind of bottle; ``shoulder`` and ``flank`` are fractions.

    Attributes:
        shoulder: (radius as a share of the body's beyond the neck's, height as a share of the way
            from label to neck) of the points between body and neck.
        depth: Extent along Y as a share of that along X.
        colors: Of the body.
        caps: Of the cap.
    """

    height_m: tuple[float, float]
    radius_m: tuple[float, float]
    neck_m: float
    neck_share: tuple[float, float]
    label_share: tuple[float, float]
    shoulder: tuple[Point2, ...]
    cap_m: tuple[float, float]
    depth: float
    colors: tuple[str, ...]
    caps: tuple[str, ...]
    gloss: tuple[float, float] = (0.06, 0.15)


_DARK_GLASS = ("#1d3320", "#26331c", "#3a2413", "#142a25", "#2d1a10", "#4a5a34")
_CLEAR = ("#b9d3dc", "#c9dfe4", "#a9cbd8", "#cfe3dc", "#9fc4d6")
_CAPS = ("#f2f2ee", "#1f6fb5", "#c62828", "#2e9e4f", "#202124", "#e8b21c")
BOTTLES: Mapping[str, _BottleStyle] = {
    "wine": _BottleStyle(
        (0.29, 0.32),
        (0.036, 0.039),
        0.0145,
        (0.70, 0.74),
        (0.12, 0.42),
        ((1.0, 0.25), (0.93, 0.45), (0.45, 0.72), (0.08, 0.92)),
        (0.0155, 0.055),
        1.0,
        _DARK_GLASS,
        ("#5a1020", "#1a1a1a", "#b08d3a", "#23402f", "#c9c5ba"),
    ),
    "beer": _BottleStyle(
        (0.22, 0.25),
        (0.029, 0.032),
        0.0135,
        (0.68, 0.74),
        (0.14, 0.42),
        ((1.0, 0.3), (0.85, 0.5), (0.4, 0.75), (0.1, 0.93)),
        (0.0145, 0.009),
        1.0,
        ("#3a2010", "#2a1508", "#16361d", "#52300f"),
        _CAPS,
    ),
    "water": _BottleStyle(
        (0.2, 0.235),
        (0.031, 0.0345),
        0.0125,
        (0.80, 0.84),
        (0.38, 0.62),
        ((1.0, 0.12), (0.92, 0.4), (0.55, 0.75), (0.15, 0.96)),
        (0.0148, 0.016),
        1.0,
        _CLEAR,
        _CAPS,
    ),
    "soda": _BottleStyle(
        (0.215, 0.25),
        (0.0325, 0.036),
        0.0125,
        (0.80, 0.84),
        (0.33, 0.58),
        ((1.02, 0.15), (0.9, 0.45), (0.5, 0.75), (0.12, 0.95)),
        (0.0148, 0.015),
        1.0,
        ("#2b120a", "#b34a12", "#2f7a3a", "#1c0d08", "#c9a21a"),
        _CAPS,
    ),
    "ketchup": _BottleStyle(
        (0.17, 0.2),
        (0.034, 0.038),
        0.02,
        (0.78, 0.82),
        (0.2, 0.62),
        ((0.97, 0.3), (0.75, 0.7), (0.3, 0.97)),
        (0.022, 0.03),
        0.66,
        ("#a3150f", "#c5281a", "#d9a514", "#e9e4d0", "#5f2a16"),
        ("#f2f2ee", "#c62828", "#2e7d32", "#e0c020"),
        (0.2, 0.35),
    ),
    "detergent": _BottleStyle(
        (0.22, 0.26),
        (0.042, 0.047),
        0.016,
        (0.8, 0.85),
        (0.16, 0.6),
        ((1.0, 0.25), (0.8, 0.55), (0.35, 0.9)),
        (0.018, 0.035),
        0.6,
        ("#1f6fb5", "#f0f0ec", "#2e9e4f", "#e8629a", "#f2c417", "#7b3fa0"),
        ("#f2f2ee", "#1f6fb5", "#e8b21c", "#c62828"),
        (0.2, 0.4),
    ),
}


@dataclass(frozen=True, slots=True)
class _Can:
    """Radius and height [m] of a common size; ``food`` cans have beaded ends."""

    radius_m: float
    height_m: float
    food: bool


CANS = (
    _Can(0.0331, 0.1152, False),
    _Can(0.0331, 0.1152, False),
    _Can(0.0265, 0.1345, False),
    _Can(0.0331, 0.168, False),
    _Can(0.0365, 0.109, True),
    _Can(0.0365, 0.109, True),
    _Can(0.0495, 0.118, True),
    _Can(0.0425, 0.036, True),
)
_CARTONS: tuple[tuple[float, float, float], ...] = (
    (0.065, 0.19, 0.28),
    (0.055, 0.17, 0.25),
    (0.07, 0.125, 0.075),
    (0.06, 0.09, 0.125),
    (0.035, 0.155, 0.21),
    (0.05, 0.1, 0.17),
    (0.04, 0.13, 0.18),
    (0.075, 0.15, 0.07),
)


def label_aspect(family: str, seed: int) -> float:
    """Width by height of the unrolled label of a bottle, can or jar."""
    if family == "can":
        can_ = can_size(seed)
        return 2 * np.pi * can_.radius_m / (can_.height_m * (0.9 if can_.food else 0.8))
    return 2.6


def can_size(seed: int) -> _Can:
    """Which of ``CANS`` a variant is."""
    return CANS[seed % len(CANS)]


def carton_size_m(seed: int) -> Vec3:
    """Depth (X), width (Y) and height of a carton; its front faces +X."""
    rng = rng_of("carton/size", seed)
    x, y, z = (side * between(0.92, 1.08, rng) for side in _CARTONS[seed % len(_CARTONS)])
    return (x, y, z)


def milk_size_m(seed: int) -> Vec3:
    """Depth, width and height of a milk carton without its gable."""
    rng = rng_of("milk_carton/size", seed)
    side = between(0.066, 0.075, rng)
    return (side, side, side * pick((1.4, 2.4, 2.7), rng))


def bottle(seed: int) -> Solid:
    """A bottle of one of the styles in ``BOTTLES``. Slots: body, label, cap."""
    rng = rng_of("bottle", seed)
    style = BOTTLES[tuple(BOTTLES)[seed % len(BOTTLES)]]
    height, radius = between(*style.height_m, rng), between(*style.radius_m, rng)
    cap_radius, cap_height = style.cap_m
    neck_top, neck_start = height - 0.4 * cap_height, height * between(*style.neck_share, rng)
    z0, z1 = (height * share for share in style.label_share)
    z1 = min(z1, neck_start - 0.01)
    shoulder = [
        (style.neck_m + r * (radius - style.neck_m), z1 + t * (neck_start - z1))
        for r, t in style.shoulder
    ]
    lower = fillet(
        [
            (0.0, 0.004),
            (0.6 * radius, 0.003),
            (0.72 * radius, 0.0),
            (0.93 * radius, 0.0),
            (radius, 0.008),
            (radius, z0 - _PROUD_M),
            (radius + _PROUD_M, z0),
        ],
        [0.0, 0.0, 0.0, 0.004, 0.01, 0.0, 0.0],
        3,
    )
    upper = [
        (radius + _PROUD_M, z1),
        (radius, z1 + _PROUD_M),
        *shoulder,
        (style.neck_m, neck_start),
        (style.neck_m, neck_top),
    ]
    upper = fillet(upper, [0.0, 0.0, *[0.06] * (len(upper) - 3), 0.0], 3)
    cap = fillet(
        [
            (style.neck_m, height - cap_height),
            (cap_radius, height - cap_height),
            (cap_radius * 0.97, height),
            (0.0, height),
        ],
        [0.0, 0.0008, 0.002, 0.0],
        2,
    )
    patches = [
        lathe(lower, 32, 0),
        lathe([(radius + _PROUD_M, z0), (radius + _PROUD_M, z1)], 32, 1, v=(0.0, 1.0)),
        lathe(upper, 32, 0),
        lathe(_closed_below(cap), 24, 2),
        lathe([upper[-1], (0.0, neck_top)], 32, 0),
    ]
    patches = [patch.scaled(1.0, style.depth, 1.0) for patch in patches]
    stages = [
        (0.93 * radius, 0.0),
        (radius, 0.008),
        (radius, z1),
        *shoulder,
        (max(style.neck_m, 0.96 * cap_radius), neck_start + 0.004),
        (cap_radius, height - cap_height),
        (0.97 * cap_radius, height),
    ]
    flat = np.array([1.0, style.depth, 1.0])
    parts = [hull * flat for hull in hulls.stack(_climbing(stages))]
    body = Material(jittered(linear(pick(style.colors, rng)), 0.1, rng), between(*style.gloss, rng))
    label = printed(f"texture/label?seed={seed}", between(0.35, 0.6, rng))
    return centred(patches, (body, label, plastic(rng, style.caps)), parts)


def can(seed: int) -> Solid:
    """A drink can or food can. Slots: print, metal, tab."""
    rng = rng_of("can", seed)
    size = can_size(seed)
    r, h = size.radius_m, size.height_m
    texture = f"texture/can_label?seed={seed}"
    if size.food:
        print_ = printed(texture, between(0.5, 0.7, rng))
        patches, stages = _food_can(r, h)
        lid: list[Patch] = []
    else:
        print_ = printed(texture, between(0.25, 0.38, rng), 0.35)
        patches, stages = _drink_can(r, h)
        lid = _tab(0.68 * r)
        lid = [piece.moved(z=h - 0.0045) for piece in lid]
    materials = (
        print_,
        metal(STEEL if size.food else ALUMINIUM, between(0.22, 0.35, rng)),
        metal(ALUMINIUM, 0.3),
    )
    return centred([*patches, *lid], materials, hulls.stack(stages))


def carton(seed: int) -> Solid:
    """A printed folding box; its front faces +X. Slot: print."""
    rng = rng_of("carton", seed)
    size = carton_size_m(seed)
    body = rounded_box(size, 0.0012, 1, uv=CARTON_ATLAS)
    half = tuple(0.5 * side for side in size)
    print_ = printed(f"texture/carton?seed={seed}", between(0.35, 0.65, rng))
    low, high = (-half[0], -half[1], -half[2]), (half[0], half[1], half[2])
    return centred([body], (print_,), [hulls.box(low, high)])


def milk_carton(seed: int) -> Solid:
    """A gable-top carton with a screw cap; its front faces +X. Slots: print, cap."""
    rng = rng_of("milk_carton", seed)
    x, y, z = milk_size_m(seed)
    body = rounded_box((x, y, z), 0.0015, 1, uv=CARTON_ATLAS).moved(z=z / 2)
    rise, fin = 0.33 * x, 0.016
    roof = _gable(x, y, rise, fin).moved(z=z)
    print_ = printed(f"texture/milk_label?seed={seed}", between(0.35, 0.5, rng))
    patches = [body, roof]
    if chance(0.7, rng):
        screw = lathe(
            fillet(
                [(0.0, -0.004), (0.013, -0.004), (0.013, 0.009), (0.0, 0.009)],
                [0.0, 0.0, 0.0015, 0.0],
                2,
            ),
            24,
            1,
        )
        tilt = float(np.arctan2(rise, 0.5 * x))
        patches.append(screw.rotated("y", tilt).moved(0.27 * x, 0.0, z + 0.46 * rise))
    ridge = z + rise
    prism = np.array(
        [(sx * 0.5 * x, sy * 0.5 * y, z) for sx in (-1, 1) for sy in (-1, 1)]
        + [(sx * 0.002, sy * 0.5 * y, ridge) for sx in (-1, 1) for sy in (-1, 1)]
    )
    parts = [
        hulls.box((-x / 2, -y / 2, 0.0), (x / 2, y / 2, z)),
        prism,
        hulls.box((-0.002, -y / 2, ridge), (0.002, y / 2, ridge + fin)),
    ]
    return centred(patches, (print_, plastic(rng, _CAPS)), parts)


def jar(seed: int) -> Solid:
    """A filled preserving jar with a twist-off lid. Slots: body, label, lid."""
    rng = rng_of("jar", seed)
    radius, height = between(0.031, 0.043, rng), between(0.085, 0.14, rng)
    lid_radius, lid_height = 0.9 * radius, 0.014
    z0, z1 = 0.2 * height, 0.66 * height
    top = height - lid_height
    lower = fillet(
        [
            (0.0, 0.002),
            (0.7 * radius, 0.002),
            (0.78 * radius, 0.0),
            (0.92 * radius, 0.0),
            (radius, 0.008),
            (radius, z0 - _PROUD_M),
            (radius + _PROUD_M, z0),
        ],
        [0.0, 0.0, 0.0, 0.004, 0.01, 0.0, 0.0],
        3,
    )
    upper = fillet(
        [
            (radius + _PROUD_M, z1),
            (radius, z1 + _PROUD_M),
            (radius, 0.8 * height),
            (0.86 * radius, top - 0.003),
            (0.86 * radius, top + 0.004),
            (0.0, top + 0.004),
        ],
        [0.0, 0.0, 0.02, 0.006, 0.0, 0.0],
        4,
    )
    lid = fillet(
        [
            (0.0, top),
            (lid_radius, top),
            (lid_radius, height),
            (lid_radius - 0.006, height),
            (lid_radius - 0.008, height - 0.0012),
            (0.0, height - 0.0012),
        ],
        [0.0, 0.001, 0.002, 0.0, 0.0, 0.0],
        2,
    )
    patches = [
        lathe(lower, 32, 0),
        lathe([(radius + _PROUD_M, z0), (radius + _PROUD_M, z1)], 32, 1, v=(0.0, 1.0)),
        lathe(upper, 32, 0),
        lathe(lid, 32, 2),
    ]
    fill = pick(("#6d0f1c", "#b34a12", "#d9a02a", "#3b1a12", "#7a8a2a", "#c9b48a", "#4a1030"), rng)
    materials = (
        Material(jittered(linear(fill), 0.15, rng), between(0.06, 0.12, rng)),
        printed(f"texture/label?seed={seed + 1000}", between(0.45, 0.65, rng)),
        pick((metal((0.83, 0.69, 0.35), 0.3), metal(STEEL, 0.3), plastic(rng, _CAPS)), rng),
    )
    stages = [
        (0.92 * radius, 0.0),
        (radius, 0.008),
        (radius, 0.8 * height),
        (lid_radius, top),
        (lid_radius, height),
    ]
    return centred(patches, materials, hulls.stack(stages))


def _drink_can(r: float, h: float) -> tuple[list[Patch], list[Point2]]:
    """Two-piece aluminium can: domed base, necked top, recessed lid."""
    neck, rim = r - 0.0062, r - 0.006
    z0, z1 = 0.1 * h, h - 0.024
    v1 = (z1 - z0) / (h - 0.004 - z0)
    bottom = fillet(
        [(0.0, 0.009), (0.55 * r, 0.006), (0.72 * r, 0.0), (0.76 * r, 0.0), (r, 0.012), (r, z0)],
        [0.0, 0.03, 0.001, 0.002, 0.012, 0.0],
        2,
    )
    side = [(r, z0), (r, z1)]
    top = fillet(
        [
            (r, z1),
            (r, h - 0.014),
            (neck, h - 0.0035),
            (neck, h - 0.002),
            (rim, h),
            (rim - 0.002, h),
            (rim - 0.0028, h - 0.005),
            (0.0, h - 0.005),
        ],
        [0.0, 0.02, 0.004, 0.0, 0.0006, 0.0006, 0.0008, 0.0],
        2,
    )
    split = next(i for i, (_, z) in enumerate(top) if z > h - 0.0045)
    patches = [
        lathe(bottom, 32, 1),
        lathe(side, 32, 0, v=(0.0, v1)),
        lathe(top[: split + 1], 32, 0, v=(v1, 1.0)),
        lathe(top[split:], 32, 1),
    ]
    stages = [(0.76 * r, 0.0), (r, 0.012), (r, h - 0.015), (neck, h - 0.0035), (rim, h)]
    return patches, stages


def _food_can(r: float, h: float) -> tuple[list[Patch], list[Point2]]:
    """Three-piece steel can: seamed ends, paper label between."""
    seam = 0.0035
    end = [
        (0.0, 0.003),
        (0.8 * r, 0.003),
        (0.82 * r, 0.004),
        (0.9 * r, 0.004),
        (0.93 * r, 0.0),
        (r, 0.0),
        (r, seam),
        (r - 0.001, seam + 0.001),
    ]
    z0, z1 = seam + 0.001, h - seam - 0.001
    wall = r - 0.001
    body = [(wall, z0), (wall, z1)]
    top = [(radius, h - z) for radius, z in end[::-1]]
    patches = [lathe(end, 36, 1), lathe(body, 36, 0, v=(0.0, 1.0)), lathe(top, 36, 1)]
    return patches, [(r, 0.0), (r, h)]


def _tab(length: float) -> list[Patch]:
    """Pull tab lying on the lid, its origin at the rivet."""
    ring_ = circle(1.0, 14) * np.array([0.5 * length, 0.3 * length])
    hole = circle(1.0, 10) * np.array([0.22 * length, 0.17 * length]) + np.array(
        [0.18 * length, 0.0]
    )
    plate = extruded(ring_, 0.0012, 0.0003, [hole], 2)
    rivet = lathe([(0.0, 0.0), (0.0035, 0.0), (0.0033, 0.002), (0.0, 0.0022)], 12, 2)
    return [plate.moved(x=0.18 * length), rivet.moved(x=-0.12 * length)]


def _gable(x: float, y: float, rise: float, fin: float) -> Patch:
    """Roof of two slopes that meet in an upright fin along Y; the ends are tucked in."""
    top = CARTON_ATLAS["top"]
    u0, v0, u1, v1 = top
    t, tuck = 0.0012, 0.12 * y
    made = []
    for s in (1.0, -1.0):
        foot = [(s * x / 2, -s * y / 2, 0.0), (s * x / 2, s * y / 2, 0.0)]
        head = [(s * t, -s * y / 2, rise), (s * t, s * y / 2, rise)]
        tip = [(s * t, -s * y / 2, rise + fin), (s * t, s * y / 2, rise + fin)]
        made.append(
            grid(np.array([foot, head, tip]), np.array([u0, u1]), np.array([v0, 0.8 * v1, v1]))
        )
    crest = [
        [(t, -y / 2, rise + fin), (t, y / 2, rise + fin)],
        [(-t, -y / 2, rise + fin), (-t, y / 2, rise + fin)],
    ]
    made.append(grid(np.array(crest), np.array([u0, u0]), np.array([v0, v0])))
    for s in (1.0, -1.0):
        inner = (0.0, s * (y / 2 - tuck), 0.55 * rise)
        a, b = (-s * -x / 2, s * y / 2, 0.0), (-s * x / 2, s * y / 2, 0.0)
        c, d = (-s * t, s * y / 2, rise), (s * t, s * y / 2, rise)
        loop = [a, b, c, d]
        e, f = (-s * t, s * y / 2, rise + fin), (s * t, s * y / 2, rise + fin)
        corners = [(loop[i], loop[(i + 1) % 4], inner) for i in (0, 1, 3)]
        corners += [(c, d, inner), (d, c, e), (d, e, f)]
        n = len(corners)
        uvs = np.broadcast_to(np.array([u0 + 0.1, 0.5 * v1]), (n, 3, 2))
        made.append(Patch(np.array(corners), uvs.copy(), np.zeros(n, dtype=np.int64)))
    return Patch(
        np.concatenate([m.corners_m for m in made]),
        np.concatenate([m.uvs for m in made]),
        np.concatenate([m.slots for m in made]),
    )


def _closed_below(profile: list[Point2]) -> list[Point2]:
    return [(0.0, profile[0][1]), *profile]


def _climbing(stages: list[Point2]) -> list[Point2]:
    """The stages without those that do not rise."""
    kept = stages[:1]
    for stage in stages[1:]:
        if stage[1] > kept[-1][1] + 1e-4:
            kept.append(stage)
    return kept
