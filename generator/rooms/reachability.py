"""Reachability: whether a person can walk from the doors of a room to its pieces."""

import math
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from gen_data.core.boxes import Rectangle
from gen_data.rooms.floor_plan import Room
from gen_data.rooms.layout import HEAD_M, Layout, Piece, is_flat

PERSON_M = 0.22
"""Half of the width that a person needs to pass; 0.45 m at the shoulders (DIN 33402-2)."""
CELL_M = 0.05


def free_floor(
    room: Room, pieces: Sequence[Piece], margin_m: float
) -> tuple[NDArray[np.bool_], float, float]:
    """Cells of ``CELL_M`` on which a disc of radius ``margin_m`` can stand; [rows y, columns x].

    Also the world coordinates of the corner of the first cell.
    """
    (mx, my), (sx, sy, _) = room.center_m, room.size_m
    columns, rows = math.ceil(sx / CELL_M), math.ceil(sy / CELL_M)
    x0, y0 = mx - 0.5 * sx, my - 0.5 * sy
    x = x0 + (np.arange(columns) + 0.5) * CELL_M
    y = (y0 + (np.arange(rows) + 0.5) * CELL_M)[:, None]
    inside = (np.abs(x - mx) < 0.5 * sx - margin_m) & (np.abs(y - my) < 0.5 * sy - margin_m)
    free: NDArray[np.bool_] = np.broadcast_to(inside, (rows, columns)).copy()
    for piece in pieces:
        if piece.low_m >= HEAD_M or is_flat(piece.family):
            continue
        px, py, c, s, a, b = piece.footprint
        along, across = c * (x - px) + s * (y - py), c * (y - py) - s * (x - px)
        free &= (np.abs(along) > a + margin_m) | (np.abs(across) > b + margin_m)
    return free, x0, y0


def find_unreachable(layout: Layout, movable: Collection[str]) -> str:
    """A door, or a piece with free floor before its front, that nobody can walk to; empty = none.

    Walking starts at the first door.

    Args:
        layout: A furnished room.
        movable: Roles of pieces that a person moves out of the way.
    """
    from scipy import ndimage

    fixed = [p for p in layout.pieces if p.role not in movable]
    free, x0, y0 = free_floor(layout.room, fixed, PERSON_M)
    regions, _ = ndimage.label(free)

    def region_at(zone: Rectangle) -> set[int]:
        x, y, c, s, a, b = zone
        found = set()
        for u in np.linspace(-0.9, 0.9, 9):
            for v in np.linspace(-0.9, 0.9, 9):
                px, py = x + c * u * a - s * v * b, y + s * u * a + c * v * b
                i, j = int((py - y0) / CELL_M), int((px - x0) / CELL_M)
                if 0 <= i < free.shape[0] and 0 <= j < free.shape[1]:
                    found.add(int(regions[i, j]))
        return found - {0}

    home: set[int] = set()
    for zone, owner in layout.zones:
        here = region_at(zone)
        if owner < 0 and not home:
            home = here
            if not home:
                return "door"
        elif not here & home:
            return "door" if owner < 0 else layout.pieces[owner].role
    return ""
