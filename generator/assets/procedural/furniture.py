"""Furniture and other things that stand still.

Origin on the floor at the centre of the footprint, Z up; ``size_m`` is the extent along X, Y, Z.
``SLOTS`` names the material slots of each family's mesh, in order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from generator.assets.procedural import hulls
from generator.assets.procedural.family import Solid
from generator.assets.procedural.materials import (
    ALUMINIUM,
    metal,
    painted,
    patterned,
)
from generator.assets.procedural.mesh import Array, Patch, in_place
from generator.assets.procedural.shapes import block, fan, grid, lathe
from generator.core.errors import AssetError
from generator.core.geometry import Material
from generator.core.se3 import Vec3

SLOTS: Mapping[str, tuple[str, ...]] = {
    "table": ("top", "frame"),
    "shelf": ("boards", "frame"),
    "bin": ("body",),
    "gantry": ("profiles", "joints"),
    "plane": ("ground",),
    "backdrop": ("paper",),
    "box": ("body",),
    "pedestal": ("body", "plates"),
    "room": ("floor", "ceiling", "walls", "skirting", "door", "frames", "window"),
}
TABLE_STYLES = ("legs", "trestle", "bench")
SHELF_STYLES = ("bookcase", "rack")

_BOARD_M = 0.02
_PLINTH_M = 0.06
_BIN_WALL_M = 0.008


def table(size_m: Vec3 = (1.2, 0.8, 0.74), style: str = "legs") -> Solid:
    """A table. Slots: top, frame.

    Args:
        size_m: Length, width, height of the top's surface.
        style: ``legs`` (four of wood), ``trestle`` (two wooden end frames) or ``bench`` (steel
            workbench frame with a lower shelf).

    Raises:
        AssetError: if a size or the style is not usable.
    """
    x, y, z = _checked("table", size_m, 0.2)
    _known("table", "style", style, TABLE_STYLES)
    thick = 0.03 if style != "bench" else 0.04
    top = (-x / 2, -y / 2, z - thick), (x / 2, y / 2, z)
    frame = {"legs": _four_legs, "trestle": _trestles, "bench": _bench}[style](x, y, z - thick)
    patches = [block(*top, 0.003), *(block(low, high, 0.002, 1) for low, high in frame)]
    wood = patterned("texture/wood_planks?seed=3", 0.9, 0.45)
    legs = painted("#3b4046", 0.4) if style == "bench" else patterned(
        "texture/wood_grain?seed=3", 0.4, 0.5
    )
    return in_place(patches, (wood, legs), [hulls.box(*top), *(hulls.box(*f) for f in frame)])


def shelf(
    size_m: Vec3 = (0.9, 0.32, 1.6), levels: int = 4, style: str = "bookcase"
) -> Solid:
    """A shelf open towards -Y. Slots: boards, frame.

    Args:
        size_m: Width (X), depth (Y), height.
        levels: Boards to stand things on; see ``shelf_levels_m``.
        style: ``bookcase`` (side and back panels) or ``rack`` (steel posts, open all around).

    Raises:
        AssetError: if a size, the style or the number of levels is not usable.
    """
    x, y, z = _checked("shelf", size_m, 0.1)
    _known("shelf", "style", style, SHELF_STYLES)
    t = _BOARD_M
    boards = [
        ((-x / 2 + t, -y / 2 + 0.002, top - t), (x / 2 - t, y / 2 - 0.008, top))
        for top in (*shelf_levels_m(size_m, levels), z)
    ]
    if style == "rack":
        frame = [((sx - 0.02 * (sx > 0), sy - 0.02 * (sy > 0), 0.0),
                  (sx + 0.02 * (sx < 0), sy + 0.02 * (sy < 0), z))
                 for sx in (-x / 2, x / 2) for sy in (-y / 2, y / 2)]
    else:
        frame = [((-x / 2, -y / 2, 0.0), (-x / 2 + t, y / 2, z)),
                 ((x / 2 - t, -y / 2, 0.0), (x / 2, y / 2, z)),
                 ((-x / 2 + t, y / 2 - 0.008, _PLINTH_M - t), (x / 2 - t, y / 2 - 0.002, z))]
    patches = [*(block(*b, 0.0015) for b in boards), *(block(*f, 0.0015, 1) for f in frame)]
    wood = patterned("texture/wood_grain?seed=1", 0.5, 0.45)
    posts = painted("#2f3338", 0.4) if style == "rack" else wood
    return in_place(patches, (wood, posts), [hulls.box(*b) for b in (*boards, *frame)])


def shelf_levels_m(size_m: Vec3, levels: int) -> tuple[float, ...]:
    """Height of the upper side of each board that things can stand on, from below.

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


def bin_(size_m: Vec3 = (0.6, 0.4, 0.22), color: str = "#3f5f8f") -> Solid:
    """An open container with ribs and a rim, walls 8 mm thick. Slot: body.

    Args:
        size_m: Outer length, width, height.
        color: sRGB colour ``#rrggbb``.

    Raises:
        AssetError: if a size is not usable.
    """
    x, y, z = _checked("bin", size_m, 0.06)
    rim = 0.012
    shell = _bin_shell(x, y, z, rim)
    ribs = [block(low, high, 0.001) for low, high in _bin_ribs(x, y, z, rim)]
    w = _BIN_WALL_M + rim
    walls = [
        ((-x / 2, -y / 2, 0.0), (-x / 2 + w, y / 2, z)),
        ((x / 2 - w, -y / 2, 0.0), (x / 2, y / 2, z)),
        ((-x / 2, -y / 2, 0.0), (x / 2, -y / 2 + w, z)),
        ((-x / 2, y / 2 - w, 0.0), (x / 2, y / 2, z)),
        ((-x / 2, -y / 2, 0.0), (x / 2, y / 2, _BIN_WALL_M)),
    ]
    return in_place([shell, *ribs], (painted(color, 0.5),), [hulls.box(*wall) for wall in walls])


def bin_interior_m(size_m: Vec3) -> tuple[float, float, float]:
    """Length and width of a bin's floor, and its height above the ground."""
    wall = 2 * (_BIN_WALL_M + 0.012)
    return (size_m[0] - wall, size_m[1] - wall, _BIN_WALL_M)


def box_(size_m: Vec3 = (0.2, 0.2, 0.2), color: str = "#8a8f94") -> Solid:
    """A plain block. Slot: body.

    Raises:
        AssetError: if a size is not usable.
    """
    x, y, z = _checked("box", size_m, 0.001)
    corners = (-x / 2, -y / 2, 0.0), (x / 2, y / 2, z)
    bevel = min(0.002, 0.1 * min(x, y, z))
    return in_place([block(*corners, bevel)], (painted(color, 0.6),), [hulls.box(*corners)])


def pedestal(size_m: Vec3 = (0.3, 0.3, 0.7)) -> Solid:
    """A plinth for a robot: steel column between two plates. Slots: body, plates.

    Raises:
        AssetError: if a size is not usable.
    """
    x, y, z = _checked("pedestal", size_m, 0.05)
    t = min(0.02, 0.2 * z)
    plates = [((-x / 2, -y / 2, z0), (x / 2, y / 2, z0 + t)) for z0 in (0.0, z - t)]
    body = (-0.38 * x, -0.38 * y, t), (0.38 * x, 0.38 * y, z - t)
    bolts = [
        lathe([(0.0, 0.0), (0.009, 0.0), (0.009, 0.007), (0.007, 0.009), (0.0, 0.009)], 6, 1)
        .moved(sx * 0.44 * x, sy * 0.44 * y, t)
        for sx in (-1, 1) for sy in (-1, 1)
    ]
    patches = [block(*body, 0.006), *(block(*p, 0.002, 1) for p in plates), *bolts]
    materials = (painted("#d7d9d8", 0.4), metal((0.45, 0.46, 0.48), 0.42))
    return in_place(patches, materials, [hulls.box(*body), *(hulls.box(*p) for p in plates)])


def gantry(size_m: Vec3 = (1.6, 1.0, 1.8)) -> Solid:
    """A camera frame of aluminium profiles: four posts and a beam along X. Slots: profiles, joints.

    Raises:
        AssetError: if a size is not usable.
    """
    x, y, z = _checked("gantry", size_m, 0.3)
    w = 0.04
    posts = [((sx * x / 2 - w * (sx > 0), sy * y / 2 - w * (sy > 0), 0.0),
              (sx * x / 2 + w * (sx < 0), sy * y / 2 + w * (sy < 0), z))
             for sx in (-1, 1) for sy in (-1, 1)]
    rails = [((sx * x / 2 - w * (sx > 0), -y / 2 + w, z - w),
              (sx * x / 2 + w * (sx < 0), y / 2 - w, z)) for sx in (-1, 1)]
    beam = [((-x / 2 + w, -w / 2, z - w), (x / 2 - w, w / 2, z))]
    bars = [*posts, *rails, *beam]
    patches = [piece for bar in bars for piece in _profile_bar(*bar)]
    plates = [((px - 0.05, py - 0.05, 0.0), (px + 0.05, py + 0.05, 0.008))
              for px, py in ((0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])) for a, b in posts)]
    feet = [block(_clipped(a, x, y, -1), _clipped(b, x, y, 1), 0.001, 1) for a, b in plates]
    materials = (metal(ALUMINIUM, 0.45), painted("#26282b", 0.5))
    return in_place([*patches, *feet], materials, [hulls.box(*bar) for bar in bars])


def plane(size_m: Sequence[float] = (4.0, 4.0)) -> Solid:
    """Flat ground at z = 0, without sides. Slot: ground.

    Raises:
        AssetError: if a size is not usable.
    """
    x, y, _ = _checked("plane", (*size_m, 1.0), 0.1)
    ground = _rectangle((-x / 2, -y / 2, 0.0), (x, 0.0, 0.0), (0.0, y, 0.0))
    slab = hulls.box((-x / 2, -y / 2, -0.2), (x / 2, y / 2, 0.0))
    return in_place([ground], (patterned("texture/concrete?seed=0", 2.0, 0.8),), [slab])


def backdrop(
    size_m: Vec3 = (3.0, 3.0, 2.2), radius_m: float = 0.6, color: str = "#d9d9d6"
) -> Solid:
    """A studio sweep: floor that curves up into a wall at +Y, open elsewhere. Slot: paper.

    Args:
        size_m: Width (X), depth (Y), height.
        radius_m: Radius of the curve.
        color: sRGB colour ``#rrggbb``.

    Raises:
        AssetError: if a size is not usable.
    """
    x, y, z = _checked("backdrop", size_m, 0.1)
    r = min(radius_m, 0.9 * y, 0.9 * z)
    turn = np.linspace(0.0, 0.5 * math.pi, 17)
    ys = np.concatenate([[-y / 2], y / 2 - r + r * np.sin(turn), [y / 2]])
    zs = np.concatenate([[0.0], r - r * np.cos(turn), [z]])
    rows = [np.stack([np.full(len(ys), s * x / 2), ys, zs], axis=1) for s in (-1.0, 1.0)]
    sheet = grid(np.stack(rows, axis=1))
    parts = [hulls.box((-x / 2, -y / 2, -0.2), (x / 2, y / 2, 0.0)),
             hulls.box((-x / 2, y / 2, 0.0), (x / 2, y / 2 + 0.2, z)),
             *_cove(x, y, r)]
    return in_place([sheet], (painted(color, 0.85),), parts)


def room(size_m: Vec3 = (5.0, 4.0, 2.8), door: bool = True, window: bool = True) -> Solid:
    """The inside of a room, seen from within.

    Slots: floor, ceiling, walls, skirting, door, frames, window. The door is in the wall at -X,
    the window in the wall at +Y; both are left out where the wall is too small for them.

    Args:
        size_m: Inner length, width, height; the floor is at z = 0.
        door: Whether there is a door.
        window: Whether there is a window.

    Raises:
        AssetError: if a size is not usable.
    """
    x, y, z = _checked("room", size_m, 1.0)
    has_door = door and y > 1.6 and z > 2.2
    has_window = window and x > 2.0 and z > 2.0
    patches = [
        _rectangle((-x / 2, -y / 2, 0.0), (x, 0.0, 0.0), (0.0, y, 0.0)),
        _rectangle((-x / 2, y / 2, z), (x, 0.0, 0.0), (0.0, -y, 0.0)).painted(1),
        _rectangle((x / 2, -y / 2, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)).flipped().painted(2),
        _rectangle((-x / 2, -y / 2, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)).painted(2),
        _rectangle((-x / 2, -y / 2, 0.0), (x, 0.0, 0.0), (0.0, 0.0, z)).flipped().painted(2),
        *_skirting(x, y, 0.55 if has_door else 0.0),
        *(_door(-x / 2) if has_door else ()),
        *_window_wall(x, y / 2, z, has_window),
    ]
    t = 0.2
    slabs = [
        ((-x / 2 - t, -y / 2 - t, -t), (x / 2 + t, y / 2 + t, 0.0)),
        ((-x / 2 - t, -y / 2 - t, z), (x / 2 + t, y / 2 + t, z + t)),
        ((-x / 2 - t, -y / 2 - t, 0.0), (-x / 2, y / 2 + t, z)),
        ((x / 2, -y / 2 - t, 0.0), (x / 2 + t, y / 2 + t, z)),
        ((-x / 2, -y / 2 - t, 0.0), (x / 2, -y / 2, z)),
        ((-x / 2, y / 2, 0.0), (x / 2, y / 2 + t, z)),
    ]
    return in_place(patches, _room_materials(), [hulls.box(*slab) for slab in slabs])


def _room_materials() -> tuple[Material, ...]:
    pane = Material((0.6, 0.7, 0.8), 0.08, emission_cd_m2=(230.0, 255.0, 290.0))
    return (
        patterned("texture/wood_planks?seed=0", 1.6, 0.45),
        painted("#f2f1ed", 0.9),
        patterned("texture/plaster?seed=0", 1.5, 0.9),
        painted("#eceae4", 0.5),
        painted("#e9e7e1", 0.45),
        painted("#f3f2ee", 0.4),
        pane,
    )


def _four_legs(x: float, y: float, z: float) -> list[tuple[Vec3, Vec3]]:
    w, inset, apron = 0.06, 0.03, 0.08
    ax, ay = x / 2 - inset, y / 2 - inset
    legs = [((sx * ax - w * (sx > 0), sy * ay - w * (sy > 0), 0.0),
             (sx * ax + w * (sx < 0), sy * ay + w * (sy < 0), z))
            for sx in (-1, 1) for sy in (-1, 1)]
    aprons = [
        *(((-ax + w, s * ay - 0.022 - 0.01 * (s > 0), z - apron),
           (ax - w, s * ay + 0.022 * (s < 0) + 0.012 * (s < 0), z)) for s in (-1, 1)),
    ]
    return [*legs, *_apron_boards(ax, ay, w, z, apron, len(aprons))]


def _apron_boards(
    ax: float, ay: float, w: float, z: float, apron: float, _count: int
) -> list[tuple[Vec3, Vec3]]:
    return []
