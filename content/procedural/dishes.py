"""Prepared food on tables and plates: sandwiches, pizzas, cakes, donuts, hot dogs.

Dimensions as stated by shops and recipes (assumed, within 15 %).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.food_shapes import (
    food_material,
    mound,
    plain_food,
    puck,
    sector,
    sheet,
    spread,
    wobble,
    wrap,
)
from gen_data.content.procedural.patches import Array, Patch, join_patches, make_centred_solid
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

_GREENS = ("#5f8f2e", "#7fae44", "#8fb84a")
_REDS = ("#c4302a", "#b8281f", "#d0452c")
_SPRINKLES = ("#e5484d", "#f2c81b", "#3f8fd2", "#f4efe6", "#5fae4a", "#d86fae")


class Dish(NamedTuple):
    """Food on z = 0 around the Z axis.

    Attributes:
        patches: Their slots count from 0; of helpings on a plate, from the first free one.
        materials: One per slot.
        hulls: Convex parts in physics; none of crumbs and smears.
    """

    patches: list[Patch]
    materials: list[Material]
    hulls: list[Array]


def sandwich(seed: int) -> Solid:
    """A sandwich, toast, roll or burger. Slots: bread, crumb, then fillings."""
    return _solid(SANDWICHES[_kind(SANDWICHES, seed)](seed, variant_rng("sandwich", seed)))


def pizza(seed: int) -> Solid:
    """A pizza, whole, without a slice, or a slice. Slots: crust, top, then toppings."""
    return _solid(PIZZAS[_kind(PIZZAS, seed)](seed, variant_rng("pizza", seed)))


def cake(seed: int) -> Solid:
    """A cake, a slice, a cupcake or a square. Slots: outside, layers, then decoration."""
    return _solid(CAKES[_kind(CAKES, seed)](seed, variant_rng("cake", seed)))


def donut(seed: int) -> Solid:
    """A ring of fried dough. Slots: dough, then glaze, sprinkles."""
    return _solid(make_donut(seed, variant_rng("donut", seed)))


def hot_dog(seed: int) -> Solid:
    """A sausage in a long roll. Slots: crust, crumb, sausage, sauce."""
    return _solid(_hot_dog(seed, variant_rng("hot_dog", seed)))


def _kind(kinds: Mapping[str, object], seed: int) -> str:
    return in_turn(tuple(kinds), seed)


def _solid(dish: Dish) -> Solid:
    return make_centred_solid(dish.patches, dish.materials, dish.hulls)


def _slice_outline(size: float, rng: VariantRng) -> Array:
    """Outline of a slice of tin loaf, shape [n, 2]: square below, domed above."""
    crown = size * rng.between(0.04, 0.1)
    turn = np.linspace(0.0, math.pi, 9)
    top = np.stack([0.5 * size * np.cos(turn), 0.42 * size + crown * np.sin(turn)], axis=1)
    low = np.array([[-0.46 * size, -0.5 * size], [0.46 * size, -0.5 * size]])
    points = np.concatenate([top, low])
    closed = np.concatenate([points, points[:1]])
    rounded = shapes.fillet([(float(x), float(y)) for x, y in closed], 0.06 * size, 3)
    return np.array(rounded[:-1])


def _bread(outline: Array, thick: float) -> tuple[Patch, Patch]:
    """A slice on z = 0: its crust, and its two faces."""
    slice_ = shapes.extrude(outline, thick, 0.0012)
    faces = np.abs(
        np.cross(
            slice_.corners_m[:, 1] - slice_.corners_m[:, 0],
            slice_.corners_m[:, 2] - slice_.corners_m[:, 0],
        )
    )
    level = faces[:, 2] > 5.0 * (faces[:, 0] + faces[:, 1])
    slots = np.where(level, 1, 0).astype(np.int64)
    return Patch(slice_.corners_m, slice_.uvs, slots), slice_


def _fillings(width: Array, rng: VariantRng) -> tuple[list[Patch], list[Material], float]:
    """Layers between slices on z = 0: patches with slots from 0, and their height.

    Args:
        width: Half extents of the bread along X and Y [m].
        rng: Draws the layers.
    """
    half_x, half_y = float(width[0]), float(width[1])

    def oval(scale: float, waves: int) -> Callable[[Array], Array]:
        ripple = wobble(waves, 0.03, rng)

        def outline(turn: Array) -> Array:
            # A superellipse keeps to the corners of the slice.
            p = 4.0
            r = ((np.abs(np.cos(turn)) / half_x) ** p + (np.abs(np.sin(turn)) / half_y) ** p) ** (
                -1.0 / p
            )
            return np.asarray(scale * r * ripple(turn))

        return outline

    made: list[Patch] = []
    tints: list[Material] = []
    z = 0.0
    for layer in rng.shuffled(("lettuce", "tomato", "cheese", "ham", "egg"))[
        : rng.choose((2, 3, 4))
    ]:
        slot = len(tints)
        if layer == "lettuce":
            part = sheet(oval(1.02, 5), 0.0012, 9, 0.0035, rng).moved(z=z + 0.003).painted(slot)
            made.append(part)
            tints.append(plain_food(_GREENS, 0.4, rng))
            z += 0.004
        elif layer in ("cheese", "ham"):
            made.append(
                sheet(oval(1.0, 3), 0.0025, 4, 0.0022, rng).moved(z=z + 0.002).painted(slot)
            )
            codes = (
                ("#eebc3a", "#f0cf6a", "#f3e2a4") if layer == "cheese" else ("#d98a86", "#c9736a")
            )
            tints.append(plain_food(codes, 0.35, rng))
            z += 0.0028
        else:
            r = 0.42 * min(half_x, half_y)
            discs = [
                puck(r * rng.between(0.85, 1.05), 0.005, rng).moved(*at, z)
                for at in shapes.at_corners(0.48 * half_x, 0.48 * half_y)
            ]
            made.append(join_patches(discs).painted(slot))
            tints.append(
                plain_food(_REDS if layer == "tomato" else ("#f4edd8", "#f0d890"), 0.25, rng)
            )
            z += 0.005
    return made, tints, z


def _stacked(
    lower: Sequence[Patch],
    upper: Sequence[Patch],
    bread: Sequence[Material],
    thick: float,
    half: Array,
    rng: VariantRng,
) -> Dish:
    """Fillings between two pieces of bread; both stand on z = 0."""
    layers, tints, height = _fillings(half, rng)
    raised = [p.moved(z=thick - 0.0008) for p in layers]
    raised = [Patch(p.corners_m, p.uvs, p.slots + len(bread)) for p in raised]
    tilt = rng.between(-0.03, 0.03)
    lid = [p.rotated("y", tilt).moved(z=thick + height - 0.0006) for p in upper]
    patches = [*lower, *lid, *raised]
    points = np.concatenate([p.corners_m.reshape(-1, 3) for p in patches])
    return Dish(patches, [*bread, *tints], [wrap(points)])


def sliced_sandwich(seed: int, rng: VariantRng, *, half: bool = False) -> Dish:
    """Two slices of tin loaf with fillings; ``half`` is cut from corner to corner."""
    size, thick = rng.between(0.095, 0.12, "size_m"), rng.between(0.011, 0.015, "bread_m")
    outline = _slice_outline(size, rng)
    if half:
        points = [[-0.5, -0.5], [0.5, -0.5], [0.5, -0.46], [-0.46, 0.5], [-0.5, 0.5]]
        outline = size * np.array(points)
        outline = outline + 0.17 * size
    breads = ("toast",) if rng.chance(0.3) else ("bread",)
    materials = [
        food_material("crust", seed, 0.7, 0.08),
        food_material(breads[0], seed, 0.85, 0.12),
    ]
    reach = size * np.array([0.36, 0.36] if half else [0.47, 0.47])
    piece = [_bread(outline, thick)[0]]
    if not half:
        return _stacked(piece, piece, materials, thick, reach, rng)
    return _stacked(piece, piece, materials, thick, reach * 0.95, rng)


def _round_roll(seed: int, rng: VariantRng) -> Dish:
    radius = rng.between(0.045, 0.058, "radius_m")
    foot = puck(radius, rng.between(0.013, 0.018), rng, soft=0.12)
    thick = float(foot.bounds_m()[1][2])
    crown = mound(radius * 1.02, rng.between(0.03, 0.04), rng, rough=0.012, flat=0.72).painted(0)
    seeds = []
    if rng.chance(0.7):
        grain = shapes.ball(lambda d: d * np.array([0.0017, 0.0011, 0.0008]), 4, 6)
        top = float(crown.bounds_m()[1][2])
        for x, y in spread(60, 0.72 * radius, rng):
            slope = 1.0 - (x * x + y * y) / (1.02 * radius) ** 2
            z = top * max(slope, 0.0) ** 0.36
            seeds.append(grain.rotated("z", rng.between(0.0, 3.1)).moved(float(x), float(y), z))
    materials = [food_material("dough", seed, 0.35, 0.12), plain_food(("#f2e6c8",), 0.6, rng)]
    patty = puck(radius * 1.03, rng.between(0.012, 0.018), rng)
    high = float(patty.bounds_m()[1][2])
    layers, tints, height = _fillings(np.array([0.82 * radius, 0.82 * radius]), rng)
    raised = [Patch(p.moved(z=thick + high - 0.001).corners_m, p.uvs, p.slots + 3) for p in layers]
    lid = thick + high + height - 0.001
    patches = [
        foot.painted(0),
        patty.moved(z=thick - 0.001).painted(2),
        *raised,
        crown.moved(z=lid),
        *(s.moved(z=lid).painted(1) for s in seeds),
    ]
    points = np.concatenate([p.corners_m.reshape(-1, 3) for p in patches])
    meat = food_material("meat", seed, 0.6, 0.1)
    return Dish(patches, [*materials, meat, *tints], [wrap(points)])


def _baguette(seed: int, rng: VariantRng) -> Dish:
    length, radius = rng.between(0.14, 0.2, "length_m"), rng.between(0.026, 0.033, "radius_m")
    return _long_roll(seed, rng, length, radius)


def _long_roll(seed: int, rng: VariantRng, length: float, radius: float) -> Dish:
    loaf = _loaf(length, radius)
    half = np.array([0.44 * length, 0.86 * radius])
    materials = [food_material("crust", seed, 0.55, 0.1), food_material("bread", seed, 0.85, 0.1)]
    lower = [loaf.rotated("x", math.pi).moved(z=0.8 * radius).painted(0)]
    return _stacked(lower, [loaf.painted(0)], materials, 0.8 * radius, half, rng)


def _loaf(length: float, radius: float) -> Patch:
    """The upper half of a long roll, flat on z = 0."""

    def shape(d: Array) -> Array:
        # Straight in the middle, round at the ends.
        x = 0.5 * length * np.sign(d[..., 0]) * np.abs(d[..., 0]) ** 0.6
        y = radius * np.sign(d[..., 1]) * np.abs(d[..., 1]) ** 0.8
        return np.stack([x, y, 0.8 * radius * np.maximum(d[..., 2], 0.0) ** 0.8], axis=2)

    return shapes.ball(shape, 14, 32)


SANDWICHES: Mapping[str, Callable[[int, VariantRng], Dish]] = {
    "sliced": sliced_sandwich,
    "burger": _round_roll,
    "half": lambda seed, rng: sliced_sandwich(seed, rng, half=True),
    "baguette": _baguette,
}


def make_pizza(seed: int, rng: VariantRng, radius: float, turn_rad: float) -> Dish:
    """A pizza around Z, from angle 0 to ``turn_rad``; 2 pi is a whole one."""
    thick, rim = rng.between(0.005, 0.009, "base_m"), rng.between(0.013, 0.02, "rim_m")
    width, outline = rng.between(0.014, 0.022, "crust_m"), wobble(6, 0.012, rng)
    edge = [
        (radius - width, thick),
        (radius - 0.75 * width, rim),
        (radius - 0.2 * width, rim),
        (radius, 0.45 * rim),
        (radius - 0.1 * width, 0.0),
    ]
    crust = shapes.fillet([(0.0, 0.0), *edge[::-1], (0.0, thick)], 0.005, 3)
    whole = turn_rad > 6.28
    if whole:
        base = shapes.lathe(crust, 56)
        base = base.painted(0)
    else:
        base = sector(crust, turn_rad, max(6, round(10 * turn_rad)), (0.0, 0.0))
    inner = radius - 0.8 * width
    corners = [
        (0.0, thick - 0.002),
        (inner, thick - 0.002),
        (inner, thick + 0.0016),
        (0.0, thick + 0.0022),
    ]
    disc = shapes.fillet(corners, [0.0, 0.0, 0.001, 0.0], 2)
    top = (
        shapes.lathe(disc, 56).painted(1)
        if whole
        else sector(disc, turn_rad, max(6, round(10 * turn_rad)), (1.0, 1.0))
    )
    patches = [_warped(base, outline), _warped(top, outline)]
    materials = [food_material("dough", seed, 0.6, 0.16), food_material("pizza", seed, 0.35, 0.22)]
    extras, tints = _toppings(seed, inner - 0.012, turn_rad, thick + 0.0012, rng)
    patches += [Patch(p.corners_m, p.uvs, p.slots + 2) for p in extras]
    points = np.concatenate([p.corners_m.reshape(-1, 3) for p in patches])
    if turn_rad <= 3.1:
        return Dish(patches, [*materials, *tints], [wrap(points)])
    # Wedges, since a pizza without a slice is not convex.
    count = 8
    parts = []
    for i in range(count):
        a, b = turn_rad * i / count, turn_rad * (i + 1) / count
        angle = np.mod(np.arctan2(points[:, 1], points[:, 0]), 2.0 * math.pi)
        inside = (angle >= a - 0.02) & (angle <= b + 0.02)
        parts.append(wrap(np.concatenate([points[inside], [[0.0, 0.0, 0.0], [0.0, 0.0, thick]]])))
    return Dish(patches, [*materials, *tints], parts)


def _warped(patch: Patch, outline: Callable[[Array], Array]) -> Patch:
    corners = patch.corners_m.copy()
    away = np.sqrt((corners[..., :2] ** 2).sum(axis=2))
    turn = np.where(away > 1e-6, np.arctan2(corners[..., 1], corners[..., 0]), 0.0)
    corners[..., :2] *= outline(turn)[..., None]
    return Patch(corners, patch.uvs, patch.slots)


def _toppings(
    seed: int, radius: float, turn_rad: float, z: float, rng: VariantRng
) -> tuple[list[Patch], list[Material]]:
    """Slices, rings and leaves on a pizza, within its sector."""
    options = (
        ("salami",),
        ("salami", "olive"),
        ("basil",),
        ("mushroom", "pepper"),
        ("basil", "olive"),
        (),
    )
    drawn = rng.choose(options)
    made: list[Patch] = []
    tints: list[Material] = []
    for kind in drawn:
        count, size, height, codes = _TOPPINGS[kind]
        piece = _topping(kind, size, height, rng)
        spots = []
        for x, y in spread(count, radius, rng):
            angle, away = math.atan2(y, x) % (2.0 * math.pi), math.hypot(x, y)
            margin = math.asin(min(1.0, 1.1 * size / max(away, 1e-6)))
            is_whole = turn_rad > 6.28
            if not is_whole and not margin < angle < turn_rad - margin:
                continue
            spots.append(piece.rotated("z", rng.between(0.0, 6.28)).moved(float(x), float(y), z))
        if spots:
            made.append(join_patches(spots).painted(len(tints)))
            tints.append(
                food_material("salami", seed, 0.4, 0.08)
                if kind == "salami"
                else plain_food(codes, 0.4, rng)
            )
    return made, tints


_TOPPINGS: Mapping[str, tuple[int, float, float, tuple[str, ...]]] = {
    "salami": (18, 0.018, 0.0022, ()),
    "olive": (26, 0.0065, 0.003, ("#2a2420", "#4a4a24")),
    "basil": (9, 0.02, 0.0016, ("#3f7a2c", "#2f6a24")),
    "mushroom": (20, 0.014, 0.003, ("#d9c8a8", "#c9b48c")),
    "pepper": (18, 0.016, 0.003, ("#b5281a", "#d9a514", "#3f7a2a")),
}


def _topping(kind: str, size: float, height: float, rng: VariantRng) -> Patch:
    if kind == "basil":
        return sheet(lambda t: size * (0.55 + 0.45 * np.cos(t) ** 2), height, 3, 0.003, rng).moved(
            z=0.003
        )
    if kind in ("olive", "pepper"):
        wide = 0.3 if kind == "olive" else 0.16
        return torus(size * (1.0 - wide), (size * wide, 0.5 * height), 12, 6).moved(z=0.4 * height)
    return puck(size, height, rng)


def torus(radius: float, halves: "Point", around: int, section: int) -> Patch:
    """A ring about Z with an elliptical section of half axes (across, up)."""
    turn = np.concatenate([np.arange(section), [0]]) * (2.0 * math.pi / section)
    profile = [(radius + halves[0] * math.cos(t), halves[1] * math.sin(t)) for t in turn.tolist()]
    return shapes.lathe(profile, around)


Point = tuple[float, float]


def _whole_pizza(seed: int, rng: VariantRng) -> Dish:
    return make_pizza(seed, rng, rng.between(0.125, 0.16, "radius_m"), 2.0 * math.pi)


def _started_pizza(seed: int, rng: VariantRng) -> Dish:
    missing = rng.choose((1, 1, 2, 3)) / 8.0
    return make_pizza(
        seed, rng, rng.between(0.125, 0.16, "radius_m"), 2.0 * math.pi * (1.0 - missing)
    )


def pizza_slice(seed: int, rng: VariantRng) -> Dish:
    """An eighth or a sixth, with its middle at the origin and its tip towards -X."""
    radius, turn = rng.between(0.14, 0.19, "radius_m"), 2.0 * math.pi / rng.choose((6, 8, 8))
    dish = make_pizza(seed, rng, radius, turn)

    def place(points: Array) -> Array:
        c, s = math.cos(0.5 * turn), math.sin(0.5 * turn)
        spin = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        middle = np.array([0.55 * radius, 0.0, 0.0])
        moved: Array = np.einsum("ij,...j->...i", spin, points) - middle
        return moved

    patches = [Patch(place(p.corners_m), p.uvs, p.slots) for p in dish.patches]
    return Dish(patches, dish.materials, [place(h) for h in dish.hulls])


PIZZAS: Mapping[str, Callable[[int, VariantRng], Dish]] = {
    "whole": _whole_pizza,
    "slice": pizza_slice,
    "started": _started_pizza,
}


def _tiers(radius: float, height: float, layers: int) -> list[tuple[Point, Point, int]]:
    """Layers of a round cake as ((radius, low), (radius, high), slot): sponge 1, cream 2."""
    cream = 0.006
    each = (height - cream * (layers - 1)) / layers
    made, z = [], 0.0
    for i in range(layers):
        made.append(((radius, z), (radius, z + each), 1))
        z += each
        if i < layers - 1:
            made.append(((0.997 * radius, z), (0.997 * radius, z + cream), 2))
            z += cream
    return made


def _cake_piece(seed: int, rng: VariantRng, radius: float, turn_rad: float) -> Dish:
    """A layer cake from angle 0 to ``turn_rad``; its coat is icing, its cut faces show layers."""
    height, layers = rng.between(0.055, 0.085, "height_m"), rng.choose((2, 3, 3), "layers")
    is_whole, steps = turn_rad > 6.28, max(5, round(10 * turn_rad))
    patches: list[Patch] = []
    for low, high, slot in _tiers(radius - 0.006, height, layers):
        profile = [(0.0, low[1]), low, high, (0.0, high[1])]
        if not is_whole:
            patches.append(sector(profile, turn_rad, steps, (float(slot), float(slot))))
    corners = [
        (0.0, -0.0 + height),
        (radius - 0.0062, height),
        (radius - 0.0062, 0.0),
        (radius, 0.0),
        (radius, height + 0.005),
        (0.0, height + 0.005),
    ]
    coat = shapes.fillet(corners, [0.0, 0.0, 0.0, 0.0, 0.006, 0.0], 3)
    if is_whole:
        outline = [(0.0, 0.0), (radius, 0.0), (radius, height + 0.005), (0.0, height + 0.005)]
        solid = shapes.fillet(outline, [0.0, 0.0, 0.006, 0.0], 4)
        patches.append(shapes.lathe(solid, 56).painted(0))
    else:
        patches.append(sector(coat, turn_rad, steps, (0.0, 0.0)))
    materials = [
        food_material("icing", seed, 0.4, 0.15),
        food_material("sponge", seed, 0.85, 0.09),
        plain_food(("#f6efe0", "#f2d9c0", "#5a2f1c", "#e9a5ad"), 0.45, rng),
    ]
    extras = _decoration(radius, turn_rad, height + 0.004, rng)
    patches += [p.painted(3) for p in extras]
    materials.append(plain_food((*_REDS, "#f6efe0", "#4a2414"), 0.3, rng))
    points = np.concatenate([p.corners_m.reshape(-1, 3) for p in patches])
    body = points[points[:, 2] < height + 0.008]
    return Dish(
        patches,
        materials,
        [
            wrap(body),
            *(
                [wrap(np.concatenate([p.corners_m.reshape(-1, 3) for p in extras]))]
                if extras
                else []
            ),
        ],
    )


def _decoration(radius: float, turn_rad: float, z: float, rng: VariantRng) -> list[Patch]:
    """Dots of cream or berries in a ring near the edge."""
    if rng.chance(0.25):
        return []
    count = max(1, round(rng.choose((8, 10, 12)) * turn_rad / (2.0 * math.pi)))
    size = rng.between(0.009, 0.014, "size_m")
    made = []
    for i in range(count):
        angle = turn_rad * (i + 0.5) / count
        r = radius - 1.5 * size
        tip = shapes.ball(lambda d: size * d * np.array([1.0, 1.0, 0.9]), 7, 10)
        made.append(tip.moved(r * math.cos(angle), r * math.sin(angle), z + 0.5 * size))
    return made


def cake_slice(seed: int, rng: VariantRng) -> Dish:
    """A slice with its middle at the origin, its tip towards -X."""
    radius, turn = rng.between(0.1, 0.13, "radius_m"), rng.between(0.5, 0.8)
    dish = _cake_piece(seed, rng, radius, turn)
    c, s = math.cos(0.5 * turn), math.sin(0.5 * turn)
    spin = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    shift = np.array([0.55 * radius, 0.0, 0.0])
    patches = [
        Patch(np.einsum("ij,ntj->nti", spin, p.corners_m) - shift, p.uvs, p.slots)
        for p in dish.patches
    ]
    return Dish(patches, dish.materials, [h @ spin.T - shift for h in dish.hulls])


def _whole_cake(seed: int, rng: VariantRng) -> Dish:
    return _cake_piece(seed, rng, rng.between(0.085, 0.12, "radius_m"), 2.0 * math.pi)


def _cupcake(seed: int, rng: VariantRng) -> Dish:
    """A cup of paper with a swirl of icing."""
    foot = rng.between(0.022, 0.026, "foot_m")
    rim = rng.between(0.032, 0.037, "rim_m")
    high = rng.between(0.036, 0.044, "height_m")
    pleats = 28
    outline = [(0.0, 0.0), (foot, 0.0), (rim, high), (0.0, high + 0.003)]
    profile = shapes.fillet(outline, [0.0, 0.002, 0.002, 0.0], 2)
    cup = shapes.lathe(profile, 2 * pleats)
    corners = cup.corners_m.copy()
    turn = np.arctan2(corners[..., 1], corners[..., 0])
    wall = np.sqrt((corners[..., :2] ** 2).sum(axis=2)) > 0.9 * foot
    corners[..., :2] *= (1.0 + 0.025 * wall * np.cos(pleats * turn))[..., None]
    swirl = np.linspace(0.0, 1.0, 70)
    wide = (rim - 0.009) * (1.0 - swirl) ** 0.8
    angle = 2.0 * math.pi * rng.between(2.6, 3.4) * swirl
    path = np.stack(
        [wide * np.cos(angle), wide * np.sin(angle), high + 0.006 + 0.034 * swirl], axis=1
    )
    thick = rng.between(0.0095, 0.0115) * (1.0 - 0.55 * swirl)
    rope = shapes.sweep(path, shapes.circle(1.0, 9), scale=thick)
    patches = [Patch(corners, cup.uvs, cup.slots).painted(0), rope.painted(1)]
    paper = plain_food(("#f2ede2", "#d98fa5", "#4a2c1c", "#6fae9f", "#e3c25a"), 0.7, rng)
    materials = [paper, food_material("icing", seed, 0.45, 0.1)]
    if rng.chance(0.6):
        cherry = shapes.ball(lambda d: 0.0085 * d, 9, 12).moved(
            0.0, 0.0, float(rope.bounds_m()[1][2]) + 0.004
        )
        patches.append(cherry.painted(2))
        materials.append(plain_food(_REDS, 0.15, rng))
    points = np.concatenate([p.corners_m.reshape(-1, 3) for p in patches])
    low, top = points[points[:, 2] < high + 0.004], points[points[:, 2] > high - 0.002]
    return Dish(patches, materials, [wrap(low), wrap(top)])


def _square(seed: int, rng: VariantRng) -> Dish:
    """A brownie or a piece of tray bake: crust below, icing above."""
    x, y = 0.5 * rng.between(0.11, 0.16, "depth_m"), 0.5 * rng.between(0.1, 0.14, "width_m")
    z, top = rng.between(0.025, 0.038, "height_m"), rng.between(0.003, 0.008, "top_m")
    body = shapes.block((-x / 2, -y / 2, 0.0), (x / 2, y / 2, z), 0.003).painted(1)
    coat = shapes.block(
        (-x / 2 - 0.0005, -y / 2 - 0.0005, z - 0.001),
        (x / 2 + 0.0005, y / 2 + 0.0005, z + top),
        0.0025,
    ).painted(0)
    nuts = [
        mound(0.004, 0.003, rng).moved(float(a), float(b), z + top - 0.0005).painted(2)
        for a, b in spread(rng.choose((0, 7, 12)), 0.4 * min(x, y), rng)
    ]
    materials = [
        food_material("icing", seed + 2, 0.4, 0.12),
        food_material("sponge", seed + 1, 0.85, 0.07),
        plain_food(("#a9713c", "#e6d2a4", "#5a2f1c"), 0.6, rng),
    ]
    patches = [body, coat, *nuts]
    return Dish(
        patches, materials, [wrap(np.concatenate([p.corners_m.reshape(-1, 3) for p in patches]))]
    )


CAKES: Mapping[str, Callable[[int, VariantRng], Dish]] = {
    "slice": cake_slice,
    "whole": _whole_cake,
    "cupcake": _cupcake,
    "square": _square,
}


def make_donut(seed: int, rng: VariantRng) -> Dish:
    """A ring on z = 0, half of them with glaze and of these half with sprinkles."""
    across, up = rng.between(0.0165, 0.02), rng.between(0.014, 0.018)
    radius = rng.between(0.026, 0.031, "radius_m")
    ring = torus(radius, (across, up), 40, 20).moved(z=up)
    outline = wobble(4, 0.02, rng)
    patches = [_warped(ring, outline).painted(0)]
    materials = [food_material("dough", seed, 0.5, 0.12)]
    if rng.chance(0.75):
        patches.append(_warped(_glaze(radius, across, up, rng).moved(z=up), outline).painted(1))
        materials.append(food_material("glaze", seed, rng.between(0.12, 0.3), 0.1))
        if rng.chance(0.55):
            slots = len(materials)
            for k, some in enumerate(_sprinkles(radius, across, up, rng)):
                patches.append(_warped(some, outline).painted(slots + k))
                materials.append(plain_food((_SPRINKLES[(seed + k) % 6],), 0.35, rng))
    elif rng.chance(0.5):
        materials = [food_material("dough", seed, 0.8, 0.12, (1.0, 0.98, 0.94))]
    points = np.concatenate([p.corners_m.reshape(-1, 3) for p in patches])
    low, high = points[:, 2].min(), points[:, 2].max()
    middle = 0.5 * (low + high)
    # The wedges leave the hole open.
    angle = np.mod(np.arctan2(points[:, 1], points[:, 0]), 2.0 * math.pi)
    count = 12
    parts = []
    for i in range(count):
        away = np.abs(
            np.mod(angle - 2.0 * math.pi * (i + 0.5) / count + math.pi, 2.0 * math.pi) - math.pi
        )
        near = points[(away < math.pi / count + 0.08) & np.isfinite(middle)]
        parts.append(wrap(near, 30))
    return Dish(patches, materials, parts)


def _glaze(radius: float, across: float, up: float, rng: VariantRng) -> Patch:
    """A shell over the upper side; its edge runs down unevenly."""
    around, steps = 56, 9
    turn = np.concatenate([np.arange(around), [0]]) * (2.0 * math.pi / around)
    outer, inner = wobble(8, 0.16, rng), wobble(5, 0.1, rng)
    rows = []
    ends = (-0.12 * outer(turn) * math.pi + 0.15, math.pi + 0.12 * inner(turn) * math.pi - 0.2)
    for over in (1.0, -1.0):
        for share in np.linspace(0.0, 1.0, steps):
            t = ends[0] + (ends[1] - ends[0]) * (share if over > 0 else 1.0 - share)
            skin = over * 0.0016 * (1.0 - (2.0 * share - 1.0) ** 6) - (0.0006 if over < 0 else 0.0)
            r = radius + (across + skin) * np.cos(t)
            z = (up + skin) * np.sin(t)
            rows.append(np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1))
    rows.append(rows[0])
    return shapes.grid(np.array(rows))


def _sprinkles(radius: float, across: float, up: float, rng: VariantRng) -> list[Patch]:
    """Three colours of short rods that lie on the glaze, for a ring around z = ``up``."""
    rod = shapes.cone((0.0008, -0.003), (0.0008, 0.003), 5).rotated("y", 0.5 * math.pi)
    made: list[list[Patch]] = [[], [], []]
    for i in range(66):
        turn = 2.399963 * i + rng.between(0.0, 0.6)
        t = rng.between(0.25 * math.pi, 0.78 * math.pi)
        one = rod.rotated("z", rng.between(0.0, 3.1)).rotated("y", 0.5 * math.pi - t)
        one = one.moved(
            radius + (across + 0.0019) * math.cos(t), 0.0, up + (up + 0.0019) * math.sin(t)
        )
        made[i % 3].append(one.rotated("z", turn))
    return [join_patches(some) for some in made]


def _hot_dog(seed: int, rng: VariantRng) -> Dish:
    length, radius = rng.between(0.14, 0.18, "length_m"), rng.between(0.022, 0.027, "radius_m")
    loaf = _loaf(length, radius)
    thick = rng.between(0.0105, 0.0125, "sausage_radius_m")
    reach = 0.5 * length * rng.between(1.0, 1.08)
    body = np.linspace(-1.0, 1.0, 25)
    path = np.stack([reach * body, 0.0 * body, 0.004 * body**2], axis=1)
    ends = np.maximum(1.0 - np.abs(body) ** 14, 0.12)
    sausage = shapes.sweep(path, shapes.circle(thick, 14), scale=ends).moved(
        z=0.74 * radius + 0.6 * thick
    )
    halves = [
        loaf.rotated("x", s * 1.05).moved(0.0, -s * 0.62 * radius, 0.78 * radius).painted(0)
        for s in (-1.0, 1.0)
    ]
    low = min(float(h.bounds_m()[0][2]) for h in halves)
    halves = [h.moved(z=-low) for h in halves]
    bread = np.concatenate([h.corners_m.reshape(-1, 3) for h in halves])
    base = mound(0.9 * radius, 0.4 * radius, rng, rough=0.01).scaled(
        0.42 * length / (0.9 * radius), 1.0, 1.0
    )
    sausage = sausage.moved(
        z=float(bread[:, 2].max()) * 0.86 - float(sausage.bounds_m()[1][2]) + 0.35 * thick
    )
    wave = np.linspace(-0.86, 0.86, 90)
    top = float(sausage.bounds_m()[1][2])
    line = np.stack([reach * wave, 0.0055 * np.sin(38.0 * wave), top - 0.0015 + 0.0 * wave], axis=1)
    line[:, 2] -= (line[:, 1] ** 2) / (2.0 * thick)
    sauce = shapes.sweep(line, shapes.circle(0.0022, 6))
    materials = [
        food_material("dough", seed, 0.5, 0.12),
        food_material("sausage", seed, 0.25, 0.1),
        plain_food(("#d9a514", "#b8281f", "#e0b52a"), 0.25, rng),
    ]
    patches = [*halves, base.painted(0), sausage.painted(1), sauce.painted(2)]
    points = np.concatenate([p.corners_m.reshape(-1, 3) for p in patches])
    return Dish(patches, materials, [wrap(points)])
