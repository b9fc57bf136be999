"""Contents of vessels: drinks with froth and ice, and heaps of small pieces of food."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import draw_linear, hex_to_linear, jitter_color
from gen_data.content.procedural.patches import Array, Patch, join_patches, unit
from gen_data.content.procedural.vessels import Point2, Walls, radius_at, subdivide
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng

CONTENTS = "contents"
"""Role of the slots of contents of vessels; contents are not obstacles in physics."""
# Contents keep this distance from walls: surfaces must not coincide.
_GAP_M = 0.0003
_WATER_IOR, _ICE_IOR = 1.33, 1.31


@dataclass(frozen=True, slots=True)
class Drink:
    """A row of ``drinks.yaml``."""

    color: str
    clear: bool = False
    surface: str = ""
    foam: float = 0.0
    ice: float = 0.0


@dataclass(frozen=True, slots=True)
class Food:
    """A row of ``foods.yaml``."""

    shape: str
    count: int
    size_m: float
    colors: tuple[str, ...]
    heap: float
    ground: str


class Filling(NamedTuple):
    """Patches with slots from the first free one, their materials, and solid parts in physics.

    Attributes:
        solid_to_m: Height up to which the vessel is solid in physics; 0 for drinks.
    """

    patches: list[Patch]
    materials: list[Material]
    parts: list[Array]
    solid_to_m: float


DRINKS: Mapping[str, Drink] = load_table(__package__, "drinks", Drink)
FOODS: Mapping[str, Food] = load_table(__package__, "foods", Food)


def fill(
    content: str, walls: Walls, level: float, rng: VariantRng, slot: int, see_through: bool
) -> Filling:
    """Contents of a vessel.

    Args:
        content: Name of a drink or food; empty = nothing.
        walls: The vessel.
        level: Level between floor and rim, as a share.
        rng: Draws colours, ice, and positions of pieces.
        slot: First material slot that is free.
        see_through: Whether the wall is transparent and the sides of a drink are visible.
    """
    if not content:
        return Filling([], [], [], 0.0)
    rim = walls.outer[-1][1]
    height = walls.floor_m + level * (rim - walls.floor_m)
    if content in DRINKS:
        return _pour(DRINKS[content], walls, height, rng, slot, see_through)
    return _heap(FOODS[content], walls, height, rng, slot)


def _pour(
    drink: Drink, walls: Walls, level: float, rng: VariantRng, slot: int, see_through: bool
) -> Filling:
    top = min(level, walls.outer[-1][1] - 0.004 - drink.foam)
    low = walls.floor_m if see_through or drink.clear else max(walls.floor_m, top - 0.003)
    side = _side(walls, low + _GAP_M, top)
    edge = side[-1][0]
    profile = [(0.0, side[0][1]), *side]
    patches = [shapes.lathe(profile, 40, slot), shapes.lathe(_surface(edge, top), 40, slot + 1)]
    body = liquid(drink, rng)
    above = body
    if drink.surface:
        seed = int(rng.between(0, 24))
        rough = 0.12 if drink.surface == "coffee" else 0.35
        froth = f"texture/drink_surface?kind={drink.surface}&seed={seed}"
        above = Material((1.0, 1.0, 1.0), rough, texture=froth, printed=True, role=CONTENTS)
    materials = [body, above]
    if drink.foam:
        patches.append(_foam(walls, top, drink.foam * rng.between(0.5, 1.4), slot + 2))
        materials.append(Material(hex_to_linear("#f3ead2"), 0.8, printed=True, role=CONTENTS))
    elif rng.chance(drink.ice):
        patches += _ice(edge, top, rng, slot + 2)
        materials.append(
            Material((0.96, 0.98, 0.98), 0.05, transmission=1.0, ior=_ICE_IOR, thin=False,
                     printed=True, role=CONTENTS)
        )  # fmt: skip
    return Filling(patches, materials, [], 0.0)


def liquid(drink: Drink, rng: VariantRng) -> Material:
    """Material of a drink."""
    color = jitter_color(hex_to_linear(drink.color), 0.12, rng)
    if not drink.clear:
        return Material(color, 0.1, printed=True, role=CONTENTS)
    return Material(
        color, 0.04, transmission=1.0, ior=_WATER_IOR, thin=False, printed=True, role=CONTENTS
    )


def _side(walls: Walls, low: float, high: float) -> list[Point2]:
    """The inner wall between two heights, upward, at a distance from it."""
    rising = walls.inner[-2:3:-1]
    between = [p for p in rising if low + 5e-4 < p[1] < high - 5e-4]
    ends = [(radius_at(rising, z), z) for z in (low, high)]
    return [(r - _GAP_M, z) for r, z in (ends[0], *between, ends[1])]


def _surface(edge: float, top: float) -> list[Point2]:
    """From the wall to the axis, raised at the wall by surface tension; six rings for the UVs."""
    rest = np.linspace(edge - min(0.0022, 0.3 * edge), 0.0, 6)
    return [(edge, top), *((float(r), top - 0.0007) for r in rest)]


def _foam(walls: Walls, low: float, height: float, slot: int) -> Patch:
    side = _side(walls, low + _GAP_M, low + height)
    r, z = side[-1]
    crown = [(0.8 * r, z + 0.002), (0.4 * r, z + 0.0028), (0.0, z + 0.003)]
    return shapes.lathe([(0.0, side[0][1]), *side, *crown], 40, slot)


def _ice(edge: float, top: float, rng: VariantRng, slot: int) -> list[Patch]:
    """Cubes that float, a fifth above the surface; in narrow glasses one."""
    size = min(0.024, 0.72 * edge) * rng.between(0.85, 1.05)
    count = 3 if edge > 0.034 else 2 if edge > 0.028 else 1
    made = []
    for i in range(count):
        turn = 2.0 * math.pi * (i / count + rng.between(0.0, 0.15))
        reach = 0.0 if count == 1 else edge - 0.72 * size
        cube = shapes.rounded_box((size, size, size), 0.2 * size, 2).painted(slot)
        cube = cube.rotated("x", rng.between(-0.4, 0.4)).rotated("z", rng.between(0.0, 1.5))
        drop = rng.between(0.2, 0.45) * size
        made.append(cube.moved(reach * math.cos(turn), reach * math.sin(turn), top - drop))
    return made


def _heap(food: Food, walls: Walls, level: float, rng: VariantRng, slot: int) -> Filling:
    """A bed of the food's ground with pieces strewn on it."""
    low = max(walls.floor_m + _GAP_M, level - 0.02)
    side = subdivide(_side(walls, low, level), 0.01)
    edge = side[-1][0]
    size = min(food.size_m * rng.between(0.9, 1.1), 0.36 * edge)
    rise = food.heap * edge
    share = np.linspace(1.0, 0.0, 7)[1:]
    crown = [(float(s * edge), level + rise * float(1.0 - s * s)) for s in share]
    bed = shapes.lathe([(0.0, side[0][1]), *side, *crown], 40, slot)
    ground = Material(draw_linear((food.ground,), 0.1, rng), 0.45, printed=True)
    pieces, tints = [], []
    shape = _SHAPES[food.shape]
    for i, code in enumerate(food.colors):
        count = food.count // len(food.colors)
        places = _places(count, edge - 0.9 * size, level, rise, rng)
        pieces.append(_strew(shape(size), places, food.shape in _LYING, rng).painted(slot + 1 + i))
        tints.append(Material(draw_linear((code,), 0.1, rng), rng.between(0.3, 0.6), printed=True))
    high = float(join_patches(pieces).corners_m[..., 2].max())
    crest = [(s, level + (high - level) * (1.0 - s * s)) for s in (0.95, 0.62, 0.3)]
    hull = [np.insert(shapes.circle(s * edge, 14), 2, z, axis=1) for s, z in crest]
    peak = np.array([[0.0, 0.0, high]])
    return Filling([bed, *pieces], [ground, *tints], [np.concatenate([*hull, peak])], level)


def _places(count: int, radius: float, level: float, rise: float, rng: VariantRng) -> Array:
    """Places on the heap, shape [count, 3], evenly spread with some disorder."""
    i = np.arange(count) + rng.between(0.0, 1.0)
    turn = math.pi * (3.0 - math.sqrt(5.0)) * i + 6.0 * rng.between(0.0, 1.0)
    r = radius * np.sqrt(i / (count + 0.5)) * (0.92 + 0.08 * rng.random(count))
    z = level + rise * (1.0 - (r / radius) ** 2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def _strew(piece: Patch, places: Array, lying: bool, rng: VariantRng) -> Patch:
    """Copies of a piece at places, turned at random; lying ones tilt by less than a radian."""
    count = len(places)
    q = np.stack([rng.random(count) - 0.5 for _ in range(4)], axis=1)
    if lying:
        q[:, 1:3] *= 0.5
        q[:, 0] = 0.6 * np.sign(q[:, 0])
    w, x, y, z = unit(q).T
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]  # fmt: skip
    turn = np.stack([np.stack(row, axis=1) for row in rows], axis=1)
    sizes = 0.8 + 0.4 * rng.random(count)
    corners = np.einsum("nij,tkj->ntki", turn * sizes[:, None, None], piece.corners_m,
                        optimize=False)  # fmt: skip
    corners = corners + places[:, None, None, :]
    return Patch(
        corners.reshape(-1, 3, 3), np.tile(piece.uvs, (count, 1, 1)), np.tile(piece.slots, count)
    )


def _lens(x: float, y: float, z: float, bend: float = 0.0) -> Callable[[float], Patch]:
    """An ellipsoid with the given half axes as shares of the size; ``bend`` dishes it."""

    def make(size: float) -> Patch:
        def shape(d: Array) -> Array:
            lift = bend * (d[..., 0] ** 2 - 0.5 * d[..., 1] ** 2)
            return size * np.stack([x * d[..., 0], y * d[..., 1], z * d[..., 2] + lift], axis=2)

        return shapes.ball(shape, 4, 7)

    return make


def _ring(size: float) -> Patch:
    """A torus of square section."""
    turn = 2.0 * math.pi * np.arange(8) / 8
    turn = np.concatenate([turn, turn[:1]])
    rows = []
    for i in (0, 1, 2, 3, 0):
        r = size * (0.75 + 0.3 * math.cos(0.5 * math.pi * i))
        z = size * 0.3 * math.sin(0.5 * math.pi * i)
        rows.append(np.stack([r * np.cos(turn), r * np.sin(turn), np.full(9, z)], axis=1))
    return shapes.grid(np.array(rows))


def _tube(size: float) -> Patch:
    """A short noodle, cut straight."""
    return shapes.cone((0.34 * size, -size), (0.34 * size, size), 7).rotated("y", 0.5 * math.pi)


def _strand(size: float) -> Patch:
    """An arc of a long noodle."""
    turn = np.linspace(0.0, 3.6, 9)
    path = np.stack([size * np.cos(turn), size * np.sin(turn), 0.12 * size * np.cos(2 * turn)],
                    axis=1)  # fmt: skip
    return shapes.sweep(path, shapes.circle(0.0014, 5))


_SHAPES: Mapping[str, Callable[[float], Patch]] = {
    "flake": _lens(1.0, 0.75, 0.12, 0.35),
    "nugget": _lens(1.0, 0.8, 0.6),
    "ball": _lens(1.0, 1.0, 0.95),
    "leaf": _lens(1.0, 0.7, 0.05, 0.4),
    "grain": _lens(1.0, 0.42, 0.38),
    "chip": _lens(1.0, 0.85, 0.05, 0.3),
    "ring": _ring,
    "tube": _tube,
    "strand": _strand,
}
_LYING: Sequence[str] = ("leaf", "chip", "strand", "tube", "ring", "flake")
