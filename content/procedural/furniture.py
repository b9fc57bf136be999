"""Furniture and other static objects.

Origin on the floor at the centre of the footprint, Z up; ``size_m`` is the extent along X, Y, Z.
All builders raise AssetError if a size, a style, a shape or a colour is not usable.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Solid, axis_symmetries, check_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import (
    ALUMINIUM,
    metal_material,
    painted_material,
    patterned_material,
)
from gen_data.content.procedural.patches import Array, Patch, join_patches, make_solid_in_place
from gen_data.core.asset_types import Material, Symmetry
from gen_data.core.errors import AssetError
from gen_data.core.se3 import Vec3

Box = tuple[Vec3, Vec3]

PANEL_SHAPES = ("rectangle", "disk")
TABLE_STYLES = ("legs", "trestle", "bench")
SHELF_STYLES = ("bookcase", "rack", "refrigerator")

COLORS = load_table(__package__, "furniture_colors", str)
_CORNERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))
_BOARD_M = 0.02
_PLINTH_M = 0.06
_BIN_WALL_M = 0.008
_PANE = Material((0.86, 0.93, 0.9), 0.05, transmission=0.85)


def table(size_m: Vec3 = (1.2, 0.8, 0.74), style: str = "legs") -> Solid:
    """A table. Slots: top, frame.

    Args:
        size_m: Length, width, height of the top's surface.
        style: ``legs`` (four of wood), ``trestle`` (two wooden end frames) or ``bench`` (steel
            workbench frame with a lower shelf).
    """
    x, y, z = check_size("table", size_m, 0.2)
    check_option("table", "style", style, TABLE_STYLES)
    thick = 0.03 if style != "bench" else 0.04
    top = (-x / 2, -y / 2, z - thick), (x / 2, y / 2, z)
    frame = {"legs": _four_legs, "trestle": _trestles, "bench": _bench}[style](x, y, z - thick)
    patches = [
        shapes.map_along_grain(shapes.block(*top, 0.003), 0.5),
        *(shapes.map_along_grain(shapes.block(low, high, 0.002, 1), 0.5) for low, high in frame),
    ]
    wood = patterned_material("texture/wood_grain?seed=1", 0.0, 0.45)
    legs = painted_material("#3b4046", 0.4) if style == "bench" else replace(wood, roughness=0.5)
    return make_solid_in_place(patches, (wood, legs), [hulls.box(*b) for b in (top, *frame)])


def shelf(size_m: Vec3 = (0.9, 0.32, 1.6), levels: int = 4, style: str = "bookcase") -> Solid:
    """A shelf open towards -Y. Slots: boards, frame.

    Args:
        size_m: Width (X), depth (Y), height.
        levels: Number of boards that carry objects; see ``shelf_levels_m``.
        style: ``bookcase`` (side and back panels), ``rack`` (steel posts, open all around) or
            ``refrigerator`` (white walls, panes of glass as boards).
    """
    x, y, z = check_size("shelf", size_m, 0.1)
    check_option("shelf", "style", style, SHELF_STYLES)
    t = _BOARD_M
    boards = [
        ((-x / 2 + t, -y / 2 + 0.002, top - t), (x / 2 - t, y / 2 - 0.008, top))
        for top in (*shelf_levels_m(size_m, levels), z)
    ]
    if style == "rack":
        frame = [_post(sx * x / 2, sy * y / 2, t, z) for sx, sy in _CORNERS]
    else:
        frame = [
            ((-x / 2, -y / 2, 0.0), (-x / 2 + t, y / 2, z)),
            ((x / 2 - t, -y / 2, 0.0), (x / 2, y / 2, z)),
            ((-x / 2 + t, y / 2 - 0.008, _PLINTH_M - t), (x / 2 - t, y / 2 - 0.002, z)),
        ]
    patches = [
        *(shapes.map_along_grain(shapes.block(*b, 0.0015), 0.5) for b in boards),
        *(shapes.map_along_grain(shapes.block(*f, 0.0015, 1), 0.5) for f in frame),
    ]
    wood = patterned_material("texture/wood_grain?seed=8", 0.0, 0.45)
    posts = painted_material("#2f3338", 0.4) if style == "rack" else wood
    if style == "refrigerator":
        wood, posts = _PANE, painted_material("#e9ecec", 0.3)
    return make_solid_in_place(patches, (wood, posts), [hulls.box(*b) for b in (*boards, *frame)])


def shelf_levels_m(size_m: Vec3, levels: int) -> tuple[float, ...]:
    """Height of the upper side of each board that carries objects, the lowest first.

    Raises:
        AssetError: if there is no room for so many boards.
    """
    if levels < 1 or shelf_pitch_m(size_m, levels) < 3 * _BOARD_M:
        raise AssetError(
            f"shelf: levels={levels} does not fit a height of {size_m[2]} m; "
            f"use between 1 and {int((size_m[2] - _PLINTH_M) / (3 * _BOARD_M))}"
        )
    pitch = shelf_pitch_m(size_m, levels)
    return tuple(_PLINTH_M + i * pitch for i in range(levels))


def shelf_pitch_m(size_m: Vec3, levels: int) -> float:
    """Distance from board to board."""
    return (size_m[2] - _PLINTH_M) / levels


def shelf_clearance_m(size_m: Vec3, levels: int) -> float:
    """Free height above every board."""
    return shelf_pitch_m(size_m, levels) - _BOARD_M


def bin_(size_m: Vec3 = (0.6, 0.4, 0.22), color: str = "blue") -> Solid:
    """An open container with ribs and a rim, walls 8 mm thick. Slot: body.

    Args:
        size_m: Outer length, width, height.
        color: One of ``COLORS``.
    """
    x, y, z = check_size("bin", size_m, 0.06)
    rim = 0.012
    shell = _bin_shell(x, y, z, rim)
    ribs = [shapes.block(low, high, 0.001) for low, high in _bin_ribs(x, y, z, rim)]
    w = _BIN_WALL_M + rim
    walls = [
        ((-x / 2, -y / 2, 0.0), (-x / 2 + w, y / 2, z)),
        ((x / 2 - w, -y / 2, 0.0), (x / 2, y / 2, z)),
        ((-x / 2, -y / 2, 0.0), (x / 2, -y / 2 + w, z)),
        ((-x / 2, y / 2 - w, 0.0), (x / 2, y / 2, z)),
        ((-x / 2, -y / 2, 0.0), (x / 2, y / 2, _BIN_WALL_M)),
    ]
    body = painted_material(_color("bin", color), 0.5)
    return make_solid_in_place([shell, *ribs], (body,), [hulls.box(*wall) for wall in walls])


def bin_interior_m(size_m: Vec3) -> tuple[float, float, float]:
    """Length and width of a bin's floor, and its height above the ground."""
    wall = 2 * (_BIN_WALL_M + 0.012)
    return (size_m[0] - wall, size_m[1] - wall, _BIN_WALL_M)


def box_(size_m: Vec3 = (0.2, 0.2, 0.2), color: str = "grey") -> Solid:
    """A plain block. Slot: body.

    Args:
        size_m: Length, width, height.
        color: One of ``COLORS``.
    """
    x, y, z = check_size("box", size_m, 0.001)
    corners = (-x / 2, -y / 2, 0.0), (x / 2, y / 2, z)
    bevel = min(0.002, 0.1 * min(x, y, z))
    body = painted_material(_color("box", color), 0.6)
    return make_solid_in_place([shapes.block(*corners, bevel)], (body,), [hulls.box(*corners)])


def box_symmetries(size_m: Vec3 = (0.2, 0.2, 0.2), color: str = "grey") -> tuple[Symmetry, ...]:
    """Turns of a cuboid about its centre: quarter turns about an axis between equal sides."""
    del color
    x, y, z = size_m
    centre_m = (0.0, 0.0, 0.5 * z)
    axes = (((1.0, 0.0, 0.0), y == z), ((0.0, 1.0, 0.0), x == z), ((0.0, 0.0, 1.0), x == y))
    return tuple(Symmetry(axis, 4 if equal else 2, centre_m) for axis, equal in axes)


def pedestal(size_m: Vec3 = (0.3, 0.3, 0.7)) -> Solid:
    """A plinth for a robot: steel column between two plates. Slots: body, plates."""
    x, y, z = check_size("pedestal", size_m, 0.05)
    t = min(0.02, 0.2 * z)
    plates = [((-x / 2, -y / 2, z0), (x / 2, y / 2, z0 + t)) for z0 in (0.0, z - t)]
    body = (-0.38 * x, -0.38 * y, t), (0.38 * x, 0.38 * y, z - t)
    profile = [(0.0, 0.0), (0.009, 0.0), (0.009, 0.007), (0.007, 0.009), (0.0, 0.009)]
    bolt = shapes.lathe(profile, 6, 1)
    bolts = [bolt.moved(sx * 0.44 * x, sy * 0.44 * y, t) for sx, sy in _CORNERS]
    patches = [shapes.block(*body, 0.006), *(shapes.block(*p, 0.002, 1) for p in plates), *bolts]
    materials = (painted_material("#d7d9d8", 0.4), metal_material((0.45, 0.46, 0.48), 0.42))
    return make_solid_in_place(patches, materials, [hulls.box(*b) for b in (body, *plates)])


def pedestal_symmetries(size_m: Vec3 = (0.3, 0.3, 0.7)) -> tuple[Symmetry, ...]:
    """Half turns about its axis, quarter turns if it is square."""
    return axis_symmetries(z=4 if size_m[0] == size_m[1] else 2)


def gantry(size_m: Vec3 = (1.6, 1.0, 1.8)) -> Solid:
    """A camera frame of aluminium profiles: four posts, a beam along X. Slots: profiles, joints."""
    x, y, z = check_size("gantry", size_m, 0.3)
    w = 0.04
    posts = [_post(sx * x / 2, sy * y / 2, w, z) for sx, sy in _CORNERS]
    rails = [
        ((sx * x / 2 - w * (sx > 0), -y / 2 + w, z - w), (sx * x / 2 + w * (sx < 0), y / 2 - w, z))
        for sx in (-1, 1)
    ]
    beam = [((-x / 2 + w, -w / 2, z - w), (x / 2 - w, w / 2, z))]
    bars = [*posts, *rails, *beam]
    patches = [piece for bar in bars for piece in _profile_bar(*bar)]
    feet = [
        _between((sx * x / 2, sy * y / 2), (sx * (x / 2 - 0.1), sy * (y / 2 - 0.1)), 0.0, 0.008)
        for sx, sy in _CORNERS
    ]
    materials = (metal_material(ALUMINIUM, 0.45), painted_material("#26282b", 0.5))
    patches += [shapes.block(*foot, 0.001, 1) for foot in feet]
    return make_solid_in_place(patches, materials, [hulls.box(*bar) for bar in bars])


def plane(size_m: Sequence[float] = (4.0, 4.0)) -> Solid:
    """Flat ground at z = 0, without sides. Slot: ground."""
    x, y, _ = check_size("plane", (*size_m, 1.0), 0.1)
    ground = rectangle((-x / 2, -y / 2, 0.0), (x, 0.0, 0.0), (0.0, y, 0.0))
    slab = hulls.box((-x / 2, -y / 2, -0.2), (x / 2, y / 2, 0.0))
    concrete = patterned_material("texture/concrete?seed=0", 2.0, 0.8)
    return make_solid_in_place([ground], (concrete,), [slab])


def light_panel(
    size_m: Sequence[float] = (0.6, 0.6), shape: str = "rectangle", depth_m: float = 0.04
) -> Solid:
    """A panel that shines down from z = 0, and its housing above. Slots: housing, lamp.

    The lamp is dark until it is given an emission.

    Args:
        size_m: Size of the bright part; the first is the diameter of a disk.
        shape: rectangle or disk.
        depth_m: Depth of the housing, which is as wide as the panel.
    """
    x, y, z = check_size("light_panel", (*size_m[:2], depth_m), 0.005)
    check_option("light_panel", "shape", shape, PANEL_SHAPES)
    if shape == "disk":
        y = x
        rim = shapes.circle(0.5 * x, 64)
        front = shapes.fan(np.concatenate([rim[::-1], np.zeros((64, 1))], axis=1), 1)
        back = shapes.lathe([(0.5 * x, 0.0), (0.5 * x, z), (0.0, z)], 64)
    else:
        front = rectangle((-x / 2, -y / 2, 0.0), (0.0, y, 0.0), (x, 0.0, 0.0)).painted(1)
        back = join_patches(_plain_shell(x, y, z))
    lamp = Material((0.8, 0.8, 0.8), 0.9, specular=0.2, role="lamp")
    hull = hulls.box((-x / 2, -y / 2, 0.0), (x / 2, y / 2, z))
    return make_solid_in_place([back, front], (painted_material("#d9dadb", 0.5), lamp), [hull])


def backdrop(size_m: Vec3 = (3.0, 3.0, 2.2), radius_m: float = 0.6, color: str = "white") -> Solid:
    """A studio sweep: floor that curves up into a wall at +Y, open elsewhere. Slot: paper.

    Args:
        size_m: Width (X), depth (Y), height.
        radius_m: Radius of the curve.
        color: One of ``COLORS``.
    """
    x, y, z = check_size("backdrop", size_m, 0.1)
    r = min(radius_m, 0.9 * y, 0.9 * z)
    turn = np.linspace(0.0, 0.5 * math.pi, 17)
    ys = np.concatenate([[-y / 2], y / 2 - r + r * np.sin(turn), [y / 2]])
    zs = np.concatenate([[0.0], r - r * np.cos(turn), [z]])
    rows = [np.stack([np.full(len(ys), s * x / 2), ys, zs], axis=1) for s in (-1.0, 1.0)]
    sheet = shapes.grid(np.stack(rows, axis=1))
    parts = [
        hulls.box((-x / 2, -y / 2, -0.2), (x / 2, y / 2, 0.0)),
        hulls.box((-x / 2, y / 2, 0.0), (x / 2, y / 2 + 0.2, z)),
        *_cove(x, y, r),
    ]
    return make_solid_in_place([sheet], (painted_material(_color("backdrop", color), 0.85),), parts)


def _four_legs(x: float, y: float, z: float) -> list[Box]:
    w, inset, rail, apron = 0.06, 0.03, 0.02, 0.08
    ax, ay = x / 2 - inset, y / 2 - inset
    legs = [_post(sx * ax, sy * ay, w, z) for sx, sy in _CORNERS]
    out_x, out_y = ax - 0.01, ay - 0.01
    along = [((-ax + w, s * out_y), (ax - w, s * (out_y - rail))) for s in (-1, 1)]
    across = [((s * out_x, -ay + w), (s * (out_x - rail), ay - w)) for s in (-1, 1)]
    return [*legs, *(_between(*span, z - apron, z) for span in (*along, *across))]


def _trestles(x: float, y: float, z: float) -> list[Box]:
    w, ax, ay = 0.05, 0.36 * x, y / 2 - 0.04
    made = []
    for s in (-1, 1):
        made += [_post(s * ax, t * ay, w, z) for t in (-1, 1)]
        span = (s * ax, -ay + w), (s * (ax - w), ay - w)
        made += [_between(*span, level - w, level) for level in (z, 0.25 * z)]
    return [*made, _between((-ax + w, -0.02), (ax - w, 0.02), 0.25 * z - w, 0.25 * z)]


def _bench(x: float, y: float, z: float) -> list[Box]:
    w, ax, ay = 0.045, x / 2 - 0.02, y / 2 - 0.02
    posts = [_post(sx * ax, sy * ay, w, z) for sx, sy in _CORNERS]
    rails = [_between((-ax + w, s * ay), (ax - w, s * (ay - w)), z - w, z) for s in (-1, 1)]
    ends = [_between((s * ax, -ay + w), (s * (ax - w), ay - w), z - w, z) for s in (-1, 1)]
    return [*posts, *rails, *ends, _between((-ax + w, -ay), (ax - w, ay), 0.15, 0.17)]


def _post(x: float, y: float, width: float, height: float) -> Box:
    """A square post whose outer corner is at (x, y)."""
    return _between((x, y), (x - math.copysign(width, x), y - math.copysign(width, y)), 0.0, height)


def _between(a: Sequence[float], b: Sequence[float], low: float, high: float) -> Box:
    """The box over the rectangle between two corners."""
    return ((min(a[0], b[0]), min(a[1], b[1]), low), (max(a[0], b[0]), max(a[1], b[1]), high))


def _bin_shell(x: float, y: float, z: float, rim: float) -> Patch:
    """Floor and wall in one sheet: outside bottom, wall, rim, inner wall, inside bottom."""
    w, lip = _BIN_WALL_M, min(0.02, 0.2 * z)
    levels = [(rim + 0.006, 0.0, 0.016), (rim, 0.006, 0.02), (rim, z - lip, 0.02),
              (0.0, z - lip, 0.03), (0.0, z - 0.002, 0.03), (0.002, z, 0.028),
              (rim + w - 0.002, z, 0.014), (rim + w, z - 0.002, 0.012),
              (rim + w, w + 0.008, 0.012), (rim + w + 0.008, w, 0.006)]  # fmt: skip
    loops = [rounded_loop(x / 2 - inset, y / 2 - inset, r, level) for inset, level, r in levels]
    rows = np.stack([np.concatenate([loop, loop[:1]]) for loop in loops])
    return join_patches([shapes.grid(rows), shapes.fan(loops[0][::-1]), shapes.fan(loops[-1])])


def _bin_ribs(x: float, y: float, z: float, rim: float) -> list[Box]:
    """Upright ribs on the four sides and one band around, between the bottom and the rim."""
    depth, top = 0.7 * rim, z - min(0.02, 0.2 * z)
    made = []
    for length, other, along_x in ((x, y, True), (y, x, False)):
        count = max(2, round(length / 0.12))
        places = [length * ((i + 0.5) / count - 0.5) for i in range(count)]
        end = length / 2 - rim - 0.02
        spans = [(p - 0.0025, p + 0.0025, 0.006, top) for p in places]
        for low, high, z0, z1 in (*spans, (-end, end, 0.68 * z, 0.68 * z + 0.005)):
            for s in (-1, 1):
                face, tip = s * (other / 2 - rim - 0.001), s * (other / 2 - rim + depth)
                a, b = ((low, face), (high, tip)) if along_x else ((face, low), (tip, high))
                made.append(_between(a, b, z0, z1))
    return made


def rounded_loop(half_x: float, half_y: float, radius: float, z: float) -> Array:
    """A level rectangle with rounded corners, counter-clockwise, [20, 3]; lengths in metres."""
    points = []
    for quarter, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        x, y = sx * (half_x - radius), sy * (half_y - radius)
        for turn in (0.5 * math.pi * (quarter + i / 4) for i in range(5)):
            points.append((x + radius * math.cos(turn), y + radius * math.sin(turn), z))
    return np.array(points)


def _profile_bar(low: Vec3, high: Vec3) -> list[Patch]:
    """An aluminium profile: four corner bars around a recessed core, which form its slots."""
    axis = max(range(3), key=lambda i: high[i] - low[i])
    sides = [i for i in range(3) if i != axis]
    made = []
    for shares in ((0.0, 0.0), (0.0, 0.6), (0.6, 0.0), (0.6, 0.6), None):
        a, b = np.array(low), np.array(high)
        width = b - a
        for side, far in zip(sides, shares or (0.25, 0.25), strict=True):
            a[side] = low[side] + far * width[side]
            b[side] = a[side] + 0.4 * width[side] if shares else high[side] - 0.25 * width[side]
        made.append(shapes.block(a, b))
    return made


def _plain_shell(x: float, y: float, z: float) -> list[Patch]:
    """Four sides and the top of a box on z = 0."""
    corners = [(-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2)]
    sides = [
        rectangle((*a, 0.0), (b[0] - a[0], b[1] - a[1], 0.0), (0.0, 0.0, z))
        for a, b in pairwise([*corners, corners[0]])
    ]
    return [*sides, rectangle((-x / 2, -y / 2, z), (x, 0.0, 0.0), (0.0, y, 0.0))]


def _cove(x: float, y: float, r: float) -> list[Array]:
    """Wedges below the curve of a backdrop."""
    turn = np.linspace(0.0, 0.5 * math.pi, 7)
    curve = np.stack([y / 2 - r + r * np.sin(turn), r - r * np.cos(turn)], axis=1)
    corner = (y / 2, 0.0)
    return [
        np.array([(s * x / 2, *p) for s in (-1.0, 1.0) for p in (a, b, corner)])
        for a, b in pairwise(curve.tolist())
    ]


def rectangle(corner: Vec3, right: Vec3, up: Vec3) -> Patch:
    """Two triangles; outward is right x up."""
    c, r, u = (np.array(v, dtype=np.float64) for v in (corner, right, up))
    return shapes.grid(np.stack([np.stack([c, c + r]), np.stack([c + u, c + r + u])]))


def check_size(name: str, size_m: Sequence[float], least: float) -> Vec3:
    """The size as floats. Raises AssetError if a side is below ``least`` or above 100 m."""
    if len(size_m) != 3 or not all(least <= float(v) <= 100.0 for v in size_m):
        raise AssetError(
            f"{name}: size_m={','.join(str(v) for v in size_m)} is not usable; "
            f"every side must be between {least} and 100 m"
        )
    return (float(size_m[0]), float(size_m[1]), float(size_m[2]))


def _color(name: str, color: str) -> str:
    check_option(name, "color", color, tuple(COLORS))
    return COLORS[color]
