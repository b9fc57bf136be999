"""Walls with openings, and windows, doors, shop fronts and railings for them.

A wall's own frame: its outer plane is x = 0, +X points outward, y to the right of a viewer
in front of it, z up. Recesses lie at negative x.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.procedural.surface_shapes import block, grid
from gen_data.content.scenery.basic_shapes import Span, facing_rectangle, quad
from gen_data.content.scenery.facade_shapes import (
    Bounds,
    ledges,
    polygon,
    rectangles,
    without_slivers,
)
from gen_data.content.scenery.textures.window_views import CELLS
from gen_data.core.variant_rng import VariantRng

(
    FACADE, BASE, TRIM, FRAME, GLASS, VIEW, VIEW_TOO, DISPLAY, DOOR, METAL, ROOF, SIGN, AWNING,
    CHIMNEY, ACCENT, PLANT, FLOWER, PRINT, GRAFFITI, DARK, CEMENT, WHITE,
) = range(22)  # fmt: skip

GLASS_SETBACK_M = 0.03
"""Panes lie this far behind the front of their frame."""
_FRAME_WIDTH_M = 0.07


@dataclass(frozen=True, slots=True)
class Opening:
    """A rectangular hole in a wall.

    Attributes:
        y_m, z_m: Its extent in the wall's frame.
        recess_m: Depth of the frame behind the wall's plane.
        upright, level: Number of columns and rows of panes.
        arch_m: Rise of the arch at its top; 0 = flat.
    """

    y_m: Span
    z_m: Span
    recess_m: float = 0.16
    upright: int = 2
    level: int = 1
    arch_m: float = 0.0

    @property
    def width_m(self) -> float:
        """Clear width."""
        return self.y_m[1] - self.y_m[0]

    @property
    def height_m(self) -> float:
        """Clear height."""
        return self.z_m[1] - self.z_m[0]


def cut_openings(
    y_m: Span,
    z_m: Span,
    openings: Sequence[Opening] = (),
    slot: int = FACADE,
    base: tuple[float, int] | None = None,
) -> Patch:
    """A wall without its openings.

    Args:
        y_m: Extent to the sides.
        z_m: Extent in height.
        openings: Holes, apart from one another.
        slot: Material slot.
        base: Height up to which the wall has another slot, and that slot.
    """
    levels = [z for o in openings for z in o.z_m] + ([base[0]] if base else [])
    y = np.unique([*y_m, *(side for o in openings for side in o.y_m)])
    z = np.unique([*z_m, *(level for level in levels if z_m[0] < level < z_m[1])])
    cells: dict[int, list[Bounds]] = {slot: []}
    for z0, z1 in pairwise(z.tolist()):
        row = base[1] if base and z1 <= base[0] + 1e-9 else slot
        middle = 0.5 * (z0 + z1)
        holes = [o.y_m for o in openings if o.z_m[0] < middle < o.z_m[1]]
        # Cells of a row that touch are one rectangle.
        for y0, y1 in _gaps(y.tolist(), holes):
            cells.setdefault(row, []).append((y0, y1, z0, z1))
    parts = [rectangles(0.0, places, of) for of, places in cells.items() if places]
    return join_patches([*parts, *(_spandrels(o, slot) for o in openings if o.arch_m > 0.0)])


def _gaps(y: Sequence[float], holes: Sequence[Span]) -> list[Span]:
    """Stretches between neighbouring values of y that no hole covers."""
    return [
        (y0, y1) for y0, y1 in pairwise(y) if not any(a < 0.5 * (y0 + y1) < b for a, b in holes)
    ]


def _spandrels(opening: Opening, slot: int) -> Patch:
    """The wall above an arch in the two upper corners of a hole, and the arch's underside."""
    (y0, y1), top = opening.y_m, opening.z_m[1]
    turn = np.linspace(math.pi, 0.0, 7)
    y = 0.5 * (y0 + y1) + 0.5 * (y1 - y0) * np.cos(turn)
    z = top - opening.arch_m * (1.0 - np.sin(turn))
    rows = [[(0.0, a, b) for a, b in zip(y, z, strict=True)], [(0.0, a, top) for a in y]]
    # The two triangles at the sides have no upper edge, the middle one no height.
    face = grid(np.array(rows), slot=slot)
    depth_m = opening.recess_m + 0.5 * GLASS_SETBACK_M
    soffit = [[(x, a, b) for a, b in zip(y, z, strict=True)] for x in (-depth_m, 0.0)]
    return join_patches([without_slivers(face), grid(np.array(soffit), slot=slot)])


def reveal(opening: Opening, depth_m: float, slot: int = FACADE) -> Patch:
    """The four sides of a hole, from the wall's plane inwards."""
    (y0, y1), (z0, z1) = opening.y_m, opening.z_m
    loop = [(y0, z0), (y1, z0), (y1, z1), (y0, z1), (y0, z0)]
    return grid(np.array([[(x, y, z) for y, z in loop] for x in (0.0, -depth_m)]), slot=slot)


def window(opening: Opening, rng: VariantRng) -> Patch:
    """Reveal, frame with bars, and panes; behind some of them hang curtains."""
    depth_m = opening.recess_m + GLASS_SETBACK_M
    sides = reveal(opening, depth_m)
    return join_patches([sides, frame(opening), panes(opening, rng, -depth_m)])


def frame(opening: Opening) -> Patch:
    """The window's frame and glazing bars, flat at the bottom of the recess."""
    (y0, y1), (z0, z1) = opening.y_m, opening.z_m
    x, w = -opening.recess_m, min(_FRAME_WIDTH_M, 0.2 * opening.width_m)
    across, upright = (y0 + w, y1 - w), (z0 + w, z1 - w)
    bars = [(y0, y0 + w, z0, z1), (y1 - w, y1, z0, z1), (*across, z0, z0 + w),
            (*across, z1 - w, z1)]  # fmt: skip
    for k in range(1, opening.upright):
        y = y0 + opening.width_m * k / opening.upright
        bars.append((y - 0.4 * w, y + 0.4 * w, *upright))
    transoms = []
    for k in range(1, opening.level):
        # Transoms sit high: the lower sash is the tall one.
        z = z0 + opening.height_m * (0.42 + 0.58 * k / opening.level)
        transoms.append((*across, z - 0.4 * w, z + 0.4 * w))
    parts = [rectangles(x, bars, FRAME)]
    parts += [rectangles(x + 0.004, transoms, FRAME)] if transoms else []
    return join_patches(parts)


def panes(opening: Opening, rng: VariantRng, x: float, slot: int | None = None) -> Patch:
    """Glass with a view of a room, or of goods if ``slot`` is ``DISPLAY``."""
    (y0, y1), z = opening.y_m, opening.z_m
    if slot is None:
        slot = rng.choose((VIEW, VIEW, VIEW_TOO))
        if rng.chance(0.05):
            return rectangles(x, [(y0, y1, *z)], GLASS)
    count = max(1, round((y1 - y0) / (2.0 if slot == DISPLAY else 1.7)))
    cells = CELLS["shop" if slot == DISPLAY else "home"]
    edges = np.linspace(y0, y1, count + 1).tolist()
    places = [(a, b, *z) for a, b in pairwise(edges)]
    return rectangles(x, places, slot, [_draw_cell(cells, rng) for _ in places])


def _draw_cell(cells: int, rng: VariantRng) -> Bounds:
    """One cell of an atlas of ``cells`` by ``cells``, mirrored or not, without its rim."""
    column, row = int(rng.random() * cells), int(rng.random() * cells)
    left, right = (column + 0.02) / cells, (column + 0.98) / cells
    if rng.chance(0.5):
        left, right = right, left
    return (left, right, (row + 0.02) / cells, (row + 0.98) / cells)


def sill(opening: Opening) -> Patch:
    """A ledge below a window; its back lies in the recess."""
    (y0, y1), z0 = opening.y_m, opening.z_m[0]
    x, top = -opening.recess_m, z0 + 0.005
    ledge = ledges([(0.0, 0.05, y0 - 0.06, y1 + 0.06, z0 - 0.06, top)], TRIM)
    back = quad([(0.0, y0, top), (0.0, y1, top), (x, y1, top), (x, y0, top)], TRIM)
    return join_patches([ledge, back])


def lintel(opening: Opening) -> Patch:
    """A stone band above an opening."""
    (y0, y1), z1 = opening.y_m, opening.z_m[1]
    return ledges([(0.0, 0.05, y0 - 0.12, y1 + 0.12, z1, z1 + 0.16)], TRIM)


def surround(opening: Opening, wide_m: float) -> Patch:
    """A flat border around an opening."""
    (y0, y1), (z0, z1) = opening.y_m, opening.z_m
    x, w = 0.035, wide_m
    boxes = [(0.0, x, y0 - w, y0, z0, z1), (0.0, x, y1, y1 + w, z0, z1),
             (0.0, x, y0 - w, y1 + w, z1, z1 + w)]  # fmt: skip
    return ledges(boxes, TRIM)


def pediment(opening: Opening) -> Patch:
    """A shallow gable on a ledge above an opening."""
    (y0, y1), z = opening.y_m, opening.z_m[1] + 0.14
    a, b, rise = y0 - 0.15, y1 + 0.15, 0.2 * (y1 - y0)
    peak, x = (0.5 * (a + b), z + 0.08 + rise), 0.12
    ledge = ledges([(0.0, 0.16, a, b, z, z + 0.08)], TRIM)
    face = polygon(x, np.array([(a, z + 0.08), (b, z + 0.08), peak]), TRIM)
    left = quad([(0.0, a, z + 0.08), (x, a, z + 0.08), (x, *peak), (0.0, *peak)], TRIM)
    right = quad([(x, b, z + 0.08), (0.0, b, z + 0.08), (0.0, *peak), (x, *peak)], TRIM)
    return join_patches([ledge, face, left, right])


def leaves(opening: Opening) -> Patch:
    """Hinged shutters, folded back against the wall on both sides."""
    (y0, y1), z = opening.y_m, opening.z_m
    w = 0.5 * opening.width_m
    sides = ((y0 - w, y0 - 0.02), (y1 + 0.02, y1 + w))
    return ledges([(0.005, 0.045, a, b, *z) for a, b in sides], AWNING)


def roller(opening: Opening, share: float) -> Patch:
    """A roller shutter, lowered over the given share of the window, just before the frame."""
    z1 = opening.z_m[1]
    x = 0.03 - opening.recess_m
    foot = z1 - share * opening.height_m
    low, high = (x - 0.015, opening.y_m[0] + 0.01, foot), (x, opening.y_m[1] - 0.01, z1)
    return block(low, high, slot=AWNING)


def door(opening: Opening, rng: VariantRng, slot: int = FACADE) -> Patch:
    """An entrance: reveal, leaf with a glazed or panelled field, light above, handle, step."""
    (y0, y1), (z0, z1) = opening.y_m, opening.z_m
    x = -opening.recess_m
    head = min(z1 - 0.12, z0 + 2.15)
    inset = 0.2 * opening.width_m
    field = GLASS if rng.chance(0.5) else DOOR
    low = z0 + (0.25 if field == GLASS and rng.chance(0.5) else 1.0)
    step = block((x, y0, 0.0), (0.25, y1, z0 + 0.01), slot=BASE)
    parts = [
        reveal(opening, opening.recess_m + GLASS_SETBACK_M, slot),
        facing_rectangle(x, (y0, y1), (z0, head), DOOR),
        facing_rectangle(x, (y0, y1), (head, head + 0.06), FRAME),
        facing_rectangle(x - GLASS_SETBACK_M, (y0, y1), (head + 0.06, z1), GLASS),
        block((x, y0 + inset, low), (x + 0.012, y1 - inset, head - 0.2), slot=field),
        block((x, y1 - 0.16, z0 + 0.95), (x + 0.06, y1 - 0.12, z0 + 1.2), slot=METAL),
    ]
    return join_patches([step, *parts] if z0 > 0.05 else parts)


def garage_door(opening: Opening) -> Patch:
    """An up-and-over door of level panels."""
    x, rows = -opening.recess_m, 5
    edges = [opening.z_m[0] + opening.height_m * k / rows for k in range(rows + 1)]
    panels = [
        facing_rectangle(x + (0.0 if k % 2 else 0.012), opening.y_m, (a, b - 0.012), DOOR)
        for k, (a, b) in enumerate(pairwise(edges))
    ]
    back = facing_rectangle(x - 0.01, opening.y_m, opening.z_m, METAL)
    return join_patches([reveal(opening, opening.recess_m + 0.01), back, *panels])


def railing(y_m: Span, z0: float, x: float, pitch_m: float = 0.2) -> Patch:
    """Upright bars between two rails, in the plane x."""
    (y0, y1), top = y_m, z0 + 0.95
    at = np.linspace(y0 + 0.02, y1 - 0.02, max(2, round((y1 - y0) / pitch_m)))
    bars = [rectangles(x, [(y - 0.008, y + 0.008, z0 + 0.08, top) for y in at.tolist()], METAL)]
    for z in (z0 + 0.06, top):
        bars.append(block((x - 0.02, y0, z), (x + 0.02, y1, z + 0.035), slot=METAL))
    return join_patches(bars)


def balcony(y_m: Span, z0: float, out_m: float, *, solid: bool) -> Patch:
    """A slab with a parapet or a railing on its three open sides; its back is the wall."""
    (y0, y1), t = y_m, 0.06
    slab = ledges([(0.0, out_m, y0, y1, z0 - 0.18, z0)], TRIM)
    if solid:
        x, top = out_m - t, z0 + 0.95
        sides = [(x, out_m, y0, y1, z0, top), (0.0, x, y0, y0 + t, z0, top),
                 (0.0, x, y1 - t, y1, z0, top)]  # fmt: skip
        return join_patches([slab, ledges(sides, AWNING)])
    side = railing((-out_m + 0.04, 0.0), z0, 0.0, pitch_m=0.25).rotated("z", 0.5 * math.pi)
    ends = [side.moved(y=y) for y in (y0 + 0.02, y1 - 0.02)]
    return join_patches([slab, railing(y_m, z0, out_m - 0.04), *ends])


def oriel(
    y_m: Span, z_m: Span, out_m: float, openings: Sequence[Opening], rng: VariantRng
) -> Patch:
    """A box before the wall, with windows in its front, a corbel below and a lid."""
    (y0, y1), (z0, z1) = y_m, z_m
    front = [cut_openings(y_m, z_m, openings), *(window(o, rng) for o in openings)]
    front += [sill(o) for o in openings]
    lid = block((0.0, y0 - 0.08, z1), (out_m + 0.1, y1 + 0.08, z1 + 0.14), slot=TRIM)
    corbel = block((0.0, y0 + 0.1, z0 - 0.3), (0.7 * out_m, y1 - 0.1, z0), slot=TRIM)
    sides = [
        quad([(0.0, y0, z0), (out_m, y0, z0), (out_m, y0, z1), (0.0, y0, z1)]),
        quad([(out_m, y1, z0), (0.0, y1, z0), (0.0, y1, z1), (out_m, y1, z1)]),
        quad([(0.0, y0, z0), (0.0, y1, z0), (out_m, y1, z0), (out_m, y0, z0)], TRIM),
    ]
    return join_patches([join_patches(front).moved(out_m), *sides, lid, corbel])


def attic_window(y_m: Span, z_m: Span, rng: VariantRng) -> Patch:
    """A small window set on a gable: pane between the bars of a frame that stands out."""
    (y0, y1), (z0, z1) = y_m, z_m
    bars = [((y0, y0 + 0.08), z_m), ((y1 - 0.08, y1), z_m)]
    bars += [((y0 + 0.08, y1 - 0.08), span) for span in ((z0, z0 + 0.08), (z1 - 0.08, z1))]
    frames = [block((0.0, a, c), (0.06, b, d), slot=FRAME) for (a, b), (c, d) in bars]
    return join_patches([*frames, panes(Opening(y_m, z_m, 0.0), rng, 0.012)])
