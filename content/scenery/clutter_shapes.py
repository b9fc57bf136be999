"""Shapes that several kinds of street clutter share.

Frame of everything here: metres, Z up, front +X, origin on the ground.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gen_data.content.procedural.material_presets import draw_linear, jitter_color, metal_material
from gen_data.content.procedural.patches import Array, Patch, join_patches
from gen_data.content.procedural.surface_shapes import ball, block, circle, grid, sweep
from gen_data.content.scenery.basic_shapes import quad
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng


def worn_steel(rng: VariantRng) -> Material:
    """Galvanised steel, more or less weathered."""
    return metal_material(jitter_color((0.42, 0.43, 0.44), 0.15, rng), rng.between(0.45, 0.65))


def worn_paint(colors: Sequence[str], roughness: float, rng: VariantRng) -> Material:
    """One of several sRGB paints, faded or dirty by chance."""
    return Material(draw_linear(colors, 0.15, rng), roughness * rng.between(0.9, 1.15))


class Rectangle(NamedTuple):
    """A level rectangle [m]: its smallest and largest x and y."""

    x0: float
    x1: float
    y0: float
    y1: float

    @classmethod
    def about(cls, x_m: float, y_m: float, length_m: float, width_m: float) -> "Rectangle":
        """The rectangle about a point."""
        return cls(x_m - 0.5 * length_m, x_m + 0.5 * length_m, y_m - 0.5 * width_m,
                   y_m + 0.5 * width_m)  # fmt: skip

    def corners(self, z_m: float) -> list[Vec3]:
        """The corners at a height, counter-clockwise from above."""
        return [
            (self.x0, self.y0, z_m),
            (self.x1, self.y0, z_m),
            (self.x1, self.y1, z_m),
            (self.x0, self.y1, z_m),
        ]


def hopper(
    low: Rectangle,
    high: Rectangle,
    z_m: tuple[float, float],
    slot: int = 0,
    open_above: bool = False,
) -> Patch:
    """A solid between two rectangles at two heights, as of a bin with slanted walls."""
    below, above = low.corners(z_m[0]), high.corners(z_m[1])
    walls = [quad([below[k - 1], below[k], above[k], above[k - 1]], slot) for k in range(4)]
    lids = [quad(below[::-1], slot)]
    if not open_above:
        lids.append(quad(above, slot))
    return join_patches([*walls, *lids])


def on_ground(parts: Sequence[Patch]) -> list[Patch]:
    """The parts, moved until the lowest point of all is at z = 0."""
    low = min(float(part.bounds_m()[0][2]) for part in parts)
    return [part.moved(z=-low) for part in parts]


def bar(start: Vec3, end: Vec3, radius_m: float, sides: int = 4, slot: int = 0) -> Patch:
    """A straight round (or square) bar between two points."""
    return rod([start, end], radius_m, sides, slot)


def rod(path: Sequence[Vec3], radius_m: float, sides: int = 6, slot: int = 0) -> Patch:
    """A bar along a path whose section never lies along the path's start."""
    points = np.array(path, dtype=np.float64)
    start = np.abs(points[1] - points[0])
    up = [0.0, 0.0, 0.0]
    up[int(np.argmin(start))] = 1.0
    # Half a side's turn: square bars lie flat.
    section = circle(radius_m, sides, phase=0.5)
    return sweep(points, section, up=(up[0], up[1], up[2]), slot=slot)


def wire(start: Vec3, end: Vec3, radius_m: float, slot: int = 0) -> Patch:
    """A thin straight wire of three sides without ends."""
    points = np.array([start, end], dtype=np.float64)
    along = np.abs(points[1] - points[0])
    up = [0.0, 0.0, 0.0]
    up[int(np.argmin(along))] = 1.0
    return sweep(points, circle(radius_m, 3), up=(up[0], up[1], up[2]), capped=False, slot=slot)


def chair(kind: str, seat_m: float, frame: int, seat: int) -> list[Patch]:
    """A chair that faces +X, its seat ``seat_m`` high; slots of its frame and of seat and back.

    Kinds: ``slats``, ``woven`` (with arms) and ``shell``.
    """
    half, deep, back = 0.21, 0.21, 0.4
    parts = [
        rod([(deep, y, 0.0), (deep - 0.02, y, seat_m)], 0.012, 5, frame) for y in (-half, half)
    ]
    posts = [(-deep - 0.04, 0.0), (-deep, seat_m), (-deep - 0.09, seat_m + back)]
    parts += [rod([(x, y, z) for x, z in posts], 0.012, 5, frame) for y in (-half, half)]
    if kind == "slats":
        xs = np.linspace(-deep, deep - 0.07, 5)
        parts += [block((x, -half, seat_m), (x + 0.06, half, seat_m + 0.015), 0, seat) for x in xs]
        for k in range(3):
            z = seat_m + 0.16 + 0.085 * k
            x = -deep - 0.09 * (z - seat_m) / back
            parts.append(block((x, -half, z), (x + 0.014, half, z + 0.06), 0.0, seat))
        return parts
    cushion = block((-deep, -half, seat_m - 0.02), (deep, half, seat_m + 0.025), 0.02, seat)
    rest = block((-0.016, -half, 0.0), (0.016, half, back - 0.06), 0.012, seat)
    parts += [cushion, rest.rotated("y", -0.21).moved(-deep - 0.02, 0.0, seat_m + 0.08)]
    if kind == "woven":
        for y in (-half - 0.02, half + 0.02):
            arm = [(-deep - 0.04, y, seat_m + 0.22), (deep - 0.04, y, seat_m + 0.22),
                   (deep, y, seat_m + 0.1), (deep, y, seat_m)]  # fmt: skip
            parts.append(rod(arm, 0.016, 5, seat))
    return parts


def lump(half_m: Vec3, roughness: float, rng: VariantRng, rings: int = 12) -> Patch:
    """A crumpled ball with a flat foot on the ground, as of a full bag; its middle above x = y = 0.

    ``roughness`` is the size of its dents as a share of the radius.
    """
    # Large dents first, then the folds of the foil, less deep.
    waves = [
        ([rng.between(-k, k) for _ in range(3)], rng.between(0.0, 2.0 * math.pi), 6.0 / (k + 5.0))
        for k in (3.0, 4.0, 9.0, 10.0, 11.0, 12.0)
    ]

    def shape(direction: Array) -> Array:
        dent = np.zeros(direction.shape[:2])
        for k, phase, depth in waves:
            dent += depth * np.sin((direction * np.array(k)).sum(axis=2) + phase)
        points = direction * (1.0 + roughness * dent[..., None] / 3.0) * np.array(half_m)
        floor = -0.62 * half_m[2]
        points[..., 2] = np.maximum(points[..., 2], floor) - floor
        return np.array(points)

    return ball(shape, rings, rings + 4)


def mound(
    size_m: tuple[float, float], height_m: float, cells: tuple[int, int], rng: VariantRng
) -> Patch:
    """A rough heap over a rectangle about the origin, its border at z = 0."""
    rows, columns = cells
    y, x = np.meshgrid(
        np.linspace(-0.5, 0.5, rows + 1), np.linspace(-0.5, 0.5, columns + 1), indexing="ij"
    )
    noise = rng.random((rows + 1, columns + 1))
    crown = (1.0 - (2.0 * x) ** 4) * (1.0 - (2.0 * y) ** 4)
    z = height_m * crown * (0.55 + 0.45 * noise)
    return grid(np.stack([x * size_m[0], y * size_m[1], z], axis=2))
