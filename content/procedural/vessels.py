"""Open vessels turned about Z: outline to walls, hollow collision parts, and the choice of a kind.

Kinds of mugs, cups, glasses, bowls and vases are rows of ``vessels.yaml``.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.patches import Array, Patch, unit
from gen_data.core.variant_rng import VariantRng, variant_rng

Point2 = shapes.Point2
SEGMENTS = 48
_PLAIN_FINISHES = (
    "glass",
    "clear_plastic",
    "steel",
    "painted_steel",
    "plastic",
    "party",
    "terracotta",
)


@dataclass(frozen=True, slots=True)
class VesselStyle:
    """Ranges of the dimensions of one kind of vessel, and options of which each variant draws one.

    Attributes:
        radius_m: Radius of the outer wall where ``outline`` is 1.
        outline: Outer wall from foot to rim: radius and height as shares.
        corner: Radius of the arcs at the points of the outline, as a share of the radius.
        floor_m: Thickness of the floor.
        floor_share: Height of the floor as a share of the height, of vessels on a stem; else 0.
        finishes: Materials.
        decors: Patterns of its outside; only of ceramics and paper.
        contents: Names of drinks or food in it; empty = nothing.
        fill: Level of the contents between floor and rim.
        facets: Number of flat sides of the outer wall; 0 = round.
        lid, sleeve, straw, saucer: Probabilities of these parts.
    """

    height_m: Point2
    radius_m: Point2
    outline: tuple[Point2, ...]
    corner: float
    wall_m: Point2 = (0.0035, 0.0048)
    floor_m: Point2 = (0.0035, 0.0055)
    floor_share: float = 0.0
    handles: tuple[str, ...] = ("",)
    finishes: tuple[str, ...] = ("ceramic",)
    decors: tuple[str, ...] = ("plain",)
    contents: tuple[str, ...] = ("",)
    fill: Point2 = (0.7, 0.9)
    facets: tuple[int, ...] = (0,)
    lid: float = 0.0
    sleeve: float = 0.0
    straw: float = 0.0
    saucer: float = 0.0


class Choice(NamedTuple):
    """Draws of a variant from the options of its kind; see ``VesselStyle``."""

    kind: str
    handle: str
    finish: str
    decor: str
    content: str
    facets: int
    lid: bool
    sleeve: bool
    straw: bool
    saucer: bool


class Walls(NamedTuple):
    """Profiles of (radius, z) [m].

    Attributes:
        base: Underside, from the axis to the foot.
        outer: Outer wall from the foot to the rim.
        inner: From the rim over the inner wall to the axis.
        wall_m: Thickness.
        floor_m: Height of the floor's upper side.
    """

    base: list[Point2]
    outer: list[Point2]
    inner: list[Point2]
    wall_m: float
    floor_m: float


STYLES = load_table(__package__, "vessels", VesselStyle)


def choose(group: str, seed: int) -> Choice:
    """Draw the kind and the parts of a variant of a group: ``mug``, ``cup``, ``bowl`` ..."""
    rng = variant_rng(f"{group}/choice", seed)
    kinds = [name.partition("/")[2] for name in STYLES if name.startswith(f"{group}/")]
    kind = f"{group}/{rng.turn(kinds, 'kind')}"
    style = STYLES[kind]
    finish, decor = rng.choose(style.finishes, "finish"), rng.choose(style.decors)
    lid = rng.chance(style.lid, "lid")
    return Choice(
        kind,
        handle=rng.choose(style.handles, "handle"),
        finish=finish,
        decor="plain" if finish in (*_PLAIN_FINISHES, "wood") else decor,
        content=rng.choose(style.contents, "content"),
        facets=rng.choose(style.facets, "facets"),
        lid=lid,
        sleeve=rng.chance(style.sleeve, "sleeve"),
        straw=rng.chance(style.straw, "straw"),
        saucer=rng.chance(style.saucer, "saucer"),
    )


def draw_walls(style: VesselStyle, rng: VariantRng) -> Walls:
    """Draw the measures of a vessel that stands on z = 0."""
    height = rng.between(*style.height_m, "height_m")
    radius = rng.between(*style.radius_m, "radius_m")
    wall, floor = rng.between(*style.wall_m, "wall_m"), rng.between(*style.floor_m)
    knots = [(r * radius, z * height) for r, z in style.outline]
    foot, arc = knots[0][0], style.corner * radius
    lift = 0.0015 if style.floor_share == 0.0 else 0.0006
    under = [(0.0, lift), (0.78 * foot, lift), (0.8 * foot, 0.0)]
    rounding = min(arc, 0.3 * foot, 0.007)
    corners = [*under, *knots]
    line = shapes.fillet(corners, [0.0, 0.0, 0.0, rounding, *[arc] * (len(knots) - 2), 0.0], 4)
    base, outer = line[:3], line[3:]
    if style.floor_share:
        floor = style.floor_share * height
    inner = _inner_profile(np.array(outer), wall, max(floor, lift + 0.8 * wall))
    return Walls([*base, outer[0]], outer, inner, wall, inner[-1][1])


def _inner_profile(outer: Array, wall: float, floor: float) -> list[Point2]:
    """Rounded rim, the outer wall moved inward, and the floor."""
    step = unit(np.gradient(outer, axis=0))
    inward = np.stack([-step[:, 1], step[:, 0]], axis=1)
    moved = outer + wall * inward
    rim = []
    for turn in (45.0, 90.0, 135.0):
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        rim.append(outer[-1] + 0.5 * wall * ((1.0 - c) * inward[-1] + s * step[-1]))
    kept = [moved[-1]]
    for point in moved[-2::-1]:
        # Offsets of tight corners cross each other: keep points that descend and stay off the axis.
        if floor < point[1] < kept[-1][1] - 1e-4 and point[0] > 0.002:
            kept.append(point)
    (r1, z1), near = kept[-1], 0.86 * kept[-1][0]
    if z1 > floor + 2e-4:
        # As the outline continues below the last point that was kept.
        r0 = float(np.interp(floor, moved[:, 1], moved[:, 0])) if moved[0, 1] < floor else near
        kept.append(np.array([max(min(r0, r1), 0.2 * r1), floor]))
    points = [(float(r), float(z)) for r, z in [outer[-1], *rim, *kept]]
    return [*points, (0.0, points[-1][1])]


def make_walls(walls: Walls, segments: int = SEGMENTS) -> list[Patch]:
    """Patches: underside and outer wall in slot 0, rim and inside in slot 1.

    Along the outer wall v runs over [0, 1] from foot to rim; the underside shows its lowest row.
    Inside, it runs from the rim to the middle of the floor.
    """
    return [
        shapes.lathe(walls.base, segments, 0, v=(0.0, 0.001)),
        shapes.lathe(walls.outer, segments, 0, v=(0.001, 1.0)),
        shapes.lathe(walls.inner, segments, 1, v=(0.0, 1.0)),
    ]


def cut_facets(patch: Patch, count: int, low_m: float, high_m: float) -> Patch:
    """The patch with flat sides between two heights, round above and below."""
    corners = patch.corners_m.copy()
    turn = np.arctan2(corners[..., 1], corners[..., 0]) + 2.0 * math.pi
    wedge = 2.0 * math.pi / count
    flat = math.cos(0.5 * wedge) / np.cos(np.mod(turn, wedge) - 0.5 * wedge)
    z = corners[..., 2]
    edge = 0.08 * (high_m - low_m)
    weight = np.clip((z - low_m) / edge, 0.0, 1.0) * np.clip((high_m - z) / edge, 0.0, 1.0)
    corners[..., :2] *= (1.0 + weight * (flat - 1.0))[..., None]
    return Patch(corners, patch.uvs, patch.slots)


def subdivide(profile: Sequence[Point2], longest_m: float) -> list[Point2]:
    """The profile with points between those further apart than a length."""
    made = [profile[0]]
    for a, b in itertools.pairwise(profile):
        count = max(1, math.ceil(math.dist(a, b) / longest_m))
        made += [
            (a[0] + (b[0] - a[0]) * i / count, a[1] + (b[1] - a[1]) * i / count)
            for i in range(1, count + 1)
        ]
    return made


def radius_at(profile: Sequence[Point2], z_m: float) -> float:
    """Radius of a wall at a height; heights rise or fall along the profile."""
    line = sorted((z, r) for r, z in profile)
    return float(np.interp(z_m, [z for z, _ in line], [r for _, r in line]))


def hollow_hulls(walls: Walls, solid_to_m: float, slices: int, count: int) -> list[Array]:
    """Frustums up to the floor, or to solid contents, and two or three rings of wedges above.

    Args:
        walls: The vessel.
        solid_to_m: Height of solid contents; 0 = none.
        slices: Largest number of frustums.
        count: Largest number of all parts, at least 14.
    """
    # Wide walls need more wedges around, curved ones more rings.
    is_wide = max(r for r, _ in walls.outer) > 0.07
    rings = 3 if count - slices >= 18 and not is_wide else 2
    # An even number: wedges then reach as far along Y as along X.
    sides = min(10, (count - slices) // rings // 2 * 2)
    floor = max(walls.floor_m, solid_to_m)
    top = max(z for _, z in walls.inner)
    below = _simplify([(r, z) for r, z in walls.outer if z < floor - 1e-4], slices)
    below = [*below, (radius_at(walls.outer, floor), floor)]
    wall = [(r, z) for r, z in walls.outer if floor + 0.002 < z < top - 0.002]
    ends = [(radius_at(walls.outer, z), z) for z in (floor, top)]
    levels = [z for _, z in _simplify([ends[0], *wall, ends[1]], rings + 1)]
    outside = [(radius_at(walls.inner[4:-1], z), radius_at(walls.outer, z), z) for z in levels]
    wedges = [
        part for low, high in itertools.pairwise(outside) for part in hulls.ring(low, high, sides)
    ]
    return [*hulls.stack(below), *wedges]


def solid_hulls(walls: Walls) -> list[Array]:
    """At most 12 frustums as if the vessel were full."""
    top = max(z for _, z in walls.inner)
    return hulls.stack(_simplify([*walls.outer, (walls.outer[-1][0], top)], 13))


def _simplify(profile: Sequence[Point2], count: int) -> list[Point2]:
    """At most ``count`` points, ends included, that best keep the shape (Douglas-Peucker)."""
    kept = [0, len(profile) - 1]
    p = np.array(profile)
    while len(kept) < min(count, len(profile)):
        worst, at = 0.0, -1
        for i, j in itertools.pairwise(kept):
            if j == i + 1:
                continue
            along = unit((p[j] - p[i])[None])[0]
            # Without the ends, which rounding may place off the line between them.
            away = p[i + 1 : j] - p[i]
            off = np.abs(away[:, 1] * along[0] - away[:, 0] * along[1])
            if float(off.max()) > worst:
                worst, at = float(off.max()), i + 1 + int(off.argmax())
        if at < 0:
            break
        kept = sorted({*kept, at})
    line = [profile[i] for i in sorted(set(kept))]
    above = [*line[1:], (0.0, math.inf)]
    return [a for a, b in zip(line, above, strict=True) if b[1] > a[1] + 1e-4]
