"""Meals on plates: freshly served, or leftovers.

Sizes of portions are assumed from cookbooks, within 25 %; a meal is scaled to its plate.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.dishes import Dish, cake_slice, pizza_slice, sliced_sandwich
from gen_data.content.procedural.food_shapes import (
    crumbs,
    food_material,
    mound,
    plain_food,
    puck,
    sheet,
    smear,
    spread,
    wobble,
    wrap,
)
from gen_data.content.procedural.patches import Array, Patch, join_patches
from gen_data.content.procedural.vessel_contents import CONTENTS
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, in_turn

Helping = tuple[Patch, Material]
"""Part of a meal and its material."""
_GREENS = ("#5f8f2e", "#7fae44", "#4f7a2a")
_SAUCES = ("#a8321a", "#8a4a1c", "#c98a24", "#6a2a14", "#7a8a3a")


def serve(name: str, seed: int, radius: float, slot: int, rng: VariantRng) -> Dish:
    """A meal on a plate.

    Args:
        name: One of the meals.
        seed: Seed of its textures.
        radius: Radius of the plate's well [m]; the meal is scaled to fit.
        slot: First material slot that is free.
        rng: Draws everything else.
    """
    helpings = _MEALS[name](seed, radius, rng)
    points = np.concatenate([p.corners_m.reshape(-1, 3) for p, _ in helpings])
    reach = float(np.sqrt((points[:, :2] ** 2).sum(axis=1).max()))
    size = min(1.0, radius / reach)
    turn = rng.between(0.0, 2.0 * math.pi)
    patches = [
        patch.scaled(size, size, size).rotated("z", turn).painted(slot + k)
        for k, (patch, _) in enumerate(helpings)
    ]
    materials = [material for _, material in helpings]
    if name in _LEFT_OVER:
        return Dish(patches, [replace(m, role=CONTENTS) for m in materials], [])
    return Dish(
        patches, materials, [wrap(np.concatenate([p.corners_m.reshape(-1, 3) for p in patches]))]
    )


def _helpings(dish: Dish, turn: float = 0.0, x: float = 0.0, y: float = 0.0) -> list[Helping]:
    """A dish as helpings, turned and moved on the plate."""
    joined = join_patches(dish.patches).rotated("z", turn).moved(x, y)
    return [
        (Patch(joined.corners_m[mine], joined.uvs[mine], joined.slots[mine]), material)
        for k, material in enumerate(dish.materials)
        if (mine := joined.slots == k).any()
    ]


def _strand(length: float, height: float, rng: VariantRng) -> Patch:
    """A long noodle that curls over a heap."""
    share = np.linspace(0.0, 1.0, 10)
    turn = rng.between(0.0, 6.28) + rng.between(1.5, 4.5) * share
    r = length * (
        0.35 + 0.65 * np.abs(np.sin(rng.between(0.0, 3.1) + rng.between(1.0, 2.6) * share))
    )
    z = height * (1.0 - (r / (1.12 * length)) ** 2) + 0.0012 + 0.003 * rng.random(10)
    path = np.stack([r * np.cos(turn), r * np.sin(turn), np.maximum(z, 0.0012)], axis=1)
    return shapes.sweep(path, shapes.circle(0.0011, 5), up=(0.1, 0.2, 0.97))


def _spaghetti(seed: int, radius: float, rng: VariantRng) -> list[Helping]:
    wide, high = 0.82 * radius, rng.between(0.024, 0.034, "height_m")
    pasta = plain_food(("#e6c878", "#dfbd68", "#ead08a"), 0.4, rng)
    strands = join_patches([_strand(wide, 0.94 * high, rng) for _ in range(52)])
    heap = mound(0.9 * wide, 0.86 * high, rng, rough=0.05)
    made = [(join_patches([heap, strands]), pasta)]
    sauce = food_material(rng.choose(("sauce", "sauce", "meat")), seed, 0.35, 0.12)
    made.append(
        (mound(0.5 * wide, 0.5 * high, rng, rough=0.12, flat=0.7).moved(z=0.7 * high), sauce)
    )
    return [*made, *_basil(1.18 * high, rng)]


def _basil(z: float, rng: VariantRng) -> list[Helping]:
    leaves = [
        sheet(lambda t: 0.014 * (0.5 + 0.5 * np.cos(t) ** 2), 0.0009, 3, 0.003, rng)
        .rotated("z", 2.1 * k)
        .moved(0.008 * math.cos(2.1 * k), 0.008 * math.sin(2.1 * k), z)
        for k in range(3)
    ]
    return [(join_patches(leaves), plain_food(_GREENS, 0.5, rng))]


def _grains(count: int, radius: float, high: float, rng: VariantRng) -> Patch:
    grain = shapes.ball(lambda d: d * np.array([0.0042, 0.0014, 0.0014]), 4, 5)
    made = []
    for x, y in spread(count, 0.95 * radius, rng):
        z = high * max(0.0, 1.0 - (x * x + y * y) / radius**2) ** 0.5
        one = grain.rotated("y", rng.between(-0.7, 0.7)).rotated("z", rng.between(0.0, 3.14))
        made.append(one.moved(float(x), float(y), z))
    return join_patches(made)


def _rice_and_curry(seed: int, radius: float, rng: VariantRng) -> list[Helping]:
    wide, high = 0.52 * radius, rng.between(0.024, 0.032, "height_m")
    white = plain_food(("#f2eee2", "#efe6cf", "#f0d990"), 0.55, rng)
    rice = join_patches([mound(wide, high, rng, rough=0.03), _grains(190, wide, high, rng)])
    stew = mound(0.62 * radius, 0.4 * high, rng, rough=0.12, flat=0.5).moved(0.34 * radius)
    cubes = []
    for x, y in spread(11, 0.42 * radius, rng):
        cube = shapes.rounded_box((0.017, 0.014, 0.012), 0.004, 1).rotated(
            "z", rng.between(0.0, 3.1)
        )
        cubes.append(
            cube.rotated("x", rng.between(-0.4, 0.4)).moved(
                0.36 * radius + float(x), float(y), 0.42 * high
            )
        )
    sauce = food_material("curry", seed, 0.25, 0.1)
    pieces = food_material(rng.choose(("meat", "curry")), seed + 1, 0.4, 0.06)
    herbs = crumbs(26, 0.4 * radius, 0.0022, rng).moved(0.36 * radius, 0.0, 0.44 * high)
    made = [(rice.moved(-0.36 * radius), white), (stew, sauce), (join_patches(cubes), pieces)]
    return [*made, (herbs, plain_food(_GREENS, 0.6, rng))]


def _salad(_: int, radius: float, rng: VariantRng) -> list[Helping]:
    wide, high = 0.8 * radius, rng.between(0.03, 0.042, "height_m")
    made: list[Helping] = [
        (
            mound(0.85 * wide, 0.6 * high, rng, rough=0.14),
            plain_food(("#3f6a24", "#4f7a2a"), 0.6, rng),
        )
    ]
    for codes in (("#6c9a36", "#86b04a"), ("#4f7d2a", "#9cbf58", "#7a2f3a")):
        leaves = []
        for x, y in spread(9, 0.72 * wide, rng):
            size = rng.between(0.02, 0.032)
            outline = wobble(6, 0.18, rng)
            leaf = sheet(_leaf_outline(size, outline), 0.001, 5, 0.006, rng)
            leaf = leaf.rotated("y", rng.between(-0.6, 0.6)).rotated("z", rng.between(0.0, 6.28))
            z = high * (0.9 - 0.6 * (x * x + y * y) / wide**2)
            leaves.append(leaf.moved(float(x), float(y), z))
        made.append((join_patches(leaves), plain_food(codes, 0.4, rng)))
    for codes, size, count in (
        (("#c4302a", "#b8281f"), 0.0145, 6),
        (("#c9d99a", "#b5c97a"), 0.018, 5),
    ):
        discs = []
        for x, y in spread(count, 0.62 * wide, rng):
            disc = (
                puck(size, 0.004, rng)
                .rotated("x", rng.between(-0.5, 0.5))
                .rotated("y", rng.between(-0.5, 0.5))
            )
            discs.append(
                disc.moved(float(x), float(y), high * (1.02 - 0.55 * (x * x + y * y) / wide**2))
            )
        made.append((join_patches(discs), plain_food(codes, 0.25, rng)))
    return made


def _leaf_outline(size: float, outline: Callable[[Array], Array]) -> Callable[[Array], Array]:
    return lambda turn: size * outline(turn) * (0.7 + 0.3 * np.cos(turn))


def _sandwiches(seed: int, radius: float, rng: VariantRng) -> list[Helping]:
    first = sliced_sandwich(seed, rng, half=True)
    gap, turn = 0.2 * radius, rng.between(-0.2, 0.2)
    other = [
        (patch.rotated("z", math.pi + turn).moved(gap, gap), material)
        for patch, material in _helpings(first, 0.0, -gap, -gap)
    ]
    return _merged([*_helpings(first, 0.0, -gap, -gap), *other])


def _merged(helpings: Sequence[Helping]) -> list[Helping]:
    """Helpings with one entry per material."""
    by_material: dict[Material, list[Patch]] = {}
    for patch, material in helpings:
        by_material.setdefault(material, []).append(patch)
    return [(join_patches(patches), material) for material, patches in by_material.items()]


def _cake(seed: int, radius: float, rng: VariantRng) -> list[Helping]:
    made = _helpings(cake_slice(seed, rng))
    crumb = plain_food(("#d9b878", "#5a3420"), 0.8, rng)
    return [*made, (crumbs(22, 0.8 * radius, 0.0022, rng), crumb)]


def _pizza(seed: int, _: float, rng: VariantRng) -> list[Helping]:
    return _helpings(pizza_slice(seed, rng))


def _breakfast(seed: int, radius: float, rng: VariantRng) -> list[Helping]:
    made: list[Helping] = []
    white = food_material("egg", seed, 0.3, 0.12)
    yolk = plain_food(("#f0a81e", "#f2b83a", "#e8941a"), 0.15, rng)
    for x, y in ((-0.42, 0.3), (-0.34, -0.36))[: rng.choose((1, 2, 2))]:
        egg = smear(rng.between(0.036, 0.044), rng, thick=0.0035).moved(x * radius, y * radius)
        dome = mound(0.0155, 0.0105, rng, rough=0.01).moved(x * radius, y * radius, 0.002)
        made += [(egg, white), (dome, yolk)]
    bean = shapes.ball(lambda d: d * np.array([0.0062, 0.0042, 0.004]), 5, 7)
    beans = []
    for x, y in spread(46, 0.36 * radius, rng):
        one = bean.rotated("z", rng.between(0.0, 3.14)).rotated("x", rng.between(-0.5, 0.5))
        z = 0.004 + 0.008 * max(0.0, 1.0 - (x * x + y * y) / (0.36 * radius) ** 2)
        beans.append(one.moved(0.4 * radius + float(x), -0.3 * radius + float(y), z))
    pool = mound(0.4 * radius, 0.007, rng, rough=0.1, flat=0.5).moved(0.4 * radius, -0.3 * radius)
    red = plain_food(("#b8531c", "#a8461a"), 0.2, rng)
    made.append((join_patches([*beans, pool]), red))
    body = np.linspace(-1.0, 1.0, 15)
    path = np.stack([0.045 * body, 0.006 * body**2, 0.0 * body], axis=1)
    ends = np.maximum(1.0 - np.abs(body) ** 10, 0.15)
    sausage = shapes.sweep(path, shapes.circle(0.0105, 12), scale=ends)
    links = [
        sausage.rotated("z", 0.5 + 0.1 * k).moved(0.3 * radius, (0.28 + 0.26 * k) * radius, 0.0105)
        for k in (0, 1)
    ]
    made.append((join_patches(links), food_material("sausage", seed, 0.3, 0.1)))
    return _merged(made)


def _roast(seed: int, radius: float, rng: VariantRng) -> list[Helping]:
    steak = mound(0.045, rng.between(0.014, 0.02), rng, rough=0.1, flat=0.45).scaled(
        1.25, 0.85, 1.0
    )
    made = [(steak.moved(-0.35 * radius, 0.25 * radius), food_material("meat", seed, 0.35, 0.09))]
    chips = []
    if rng.chance(0.6):
        for k, (x, y) in enumerate(spread(26, 0.42 * radius, rng)):
            size = (rng.between(0.04, 0.068), 0.008, 0.008)
            chip = shapes.rounded_box(size, 0.0012, 1).rotated("y", rng.between(-0.3, 0.3))
            chip = chip.rotated("z", rng.between(0.0, 3.1))
            chips.append(
                chip.moved(
                    0.3 * radius + float(x), 0.2 * radius + float(y), 0.014 + 0.0008 * (k % 12)
                )
            )
        golden = plain_food(("#e0b04a", "#d9a23a", "#e8c46c"), 0.5, rng)
    else:
        for x, y in spread(7, 0.34 * radius, rng):
            chips.append(
                mound(0.02, 0.024, rng, rough=0.06, flat=0.6).moved(
                    0.34 * radius + float(x), 0.24 * radius + float(y)
                )
            )
        golden = food_material("toast", seed, 0.45, 0.06)
    made.append((join_patches(chips), golden))
    ball = shapes.ball(lambda d: 0.0045 * d, 5, 7)
    coins = rng.chance(0.4, "coins")
    side = [
        (puck(0.0095, 0.005, rng) if coins else ball.moved(z=0.0045)).moved(
            -0.1 * radius + float(x), -0.48 * radius + float(y), 0.003 * (k % 3)
        )
        for k, (x, y) in enumerate(spread(20 if coins else 60, 0.36 * radius, rng))
    ]
    codes = ("#d9761f", "#cf6a1a") if coins else ("#6f9a2e", "#5f8a2a")
    made.append((join_patches(side), plain_food(codes, 0.35, rng)))
    gravy = smear(0.035, rng, thick=0.0012, stretch=1.4).moved(-0.3 * radius, 0.1 * radius)
    return [*made, (gravy, plain_food(("#5a2f14", "#6a3a1c", "#8a4a1c"), 0.15, rng))]


def _pancakes(seed: int, radius: float, rng: VariantRng) -> list[Helping]:
    made: list[Helping] = []
    z, size = 0.0, min(0.06, 0.72 * radius)
    cakes = []
    for _ in range(rng.choose((2, 3, 4))):
        cake = puck(size * rng.between(0.95, 1.03), 0.009, rng)
        cakes.append(cake.moved(rng.between(-0.004, 0.004), rng.between(-0.004, 0.004), z))
        z += 0.0086
    made.append((join_patches(cakes), food_material("toast", seed, 0.6, 0.14)))
    syrup = smear(0.6 * size, rng, thick=0.0016).moved(z=z)
    made.append((syrup, plain_food(("#8a4a14", "#6a2a10", "#a81c2a"), 0.08, rng)))
    if rng.chance(0.5):
        butter = shapes.rounded_box((0.018, 0.016, 0.007), 0.0015, 1).moved(0.0, 0.0, z + 0.004)
        made.append((butter, plain_food(("#f2dc8a",), 0.35, rng)))
    berries = [
        shapes.ball(lambda d: 0.0065 * d, 7, 9).moved(
            0.72 * size * math.cos(t), 0.72 * size * math.sin(t), z + 0.005
        )
        for t in (0.3, 0.7, 2.4, 4.1, 4.6)
    ]
    made.append((join_patches(berries), plain_food(("#2c2f5a", "#a31424"), 0.4, rng)))
    return made


def _toast(seed: int, radius: float, rng: VariantRng) -> list[Helping]:
    size, thick = rng.between(0.09, 0.105, "size_m"), rng.between(0.011, 0.014, "thickness_m")
    body = shapes.rounded_box((size, 0.96 * size, thick), 0.0035, 2).moved(z=0.5 * thick)
    made = [(body, food_material("toast", seed, 0.8, 0.13))]
    layer = mound(0.44 * size, 0.0035, rng, rough=0.07, flat=0.3).moved(z=thick - 0.0004)
    made.append(
        (layer, plain_food(("#7a1020", "#c9641e", "#8fae4a", "#f0e2b0", "#6a4020"), 0.25, rng))
    )
    crumb = plain_food(("#c08a4a",), 0.8, rng)
    return [*made, (crumbs(26, 0.9 * radius, 0.002, rng), crumb)]


def _crumbs(_: int, radius: float, rng: VariantRng) -> list[Helping]:
    """Crumbs of bread or cake, and a smear of jam or cream."""
    dry = crumbs(rng.choose((40, 60, 80)), 0.85 * radius, rng.between(0.002, 0.0034), rng)
    made = [(dry, plain_food(("#c99a5a", "#8a5a2c", "#5a3420", "#e0c48c"), 0.8, rng))]
    streaks = [
        smear(rng.between(0.006, 0.014), rng, thick=0.0006, stretch=rng.between(1.2, 3.0))
        .rotated("z", rng.between(0.0, 6.28))
        .moved(rng.between(-0.5, 0.5) * radius, rng.between(-0.5, 0.5) * radius)
        for _ in range(rng.choose((2, 3, 5)))
    ]
    made.append((join_patches(streaks), plain_food(("#7a1020", "#f2e8d4", "#5a2c14"), 0.3, rng)))
    return made


def _eaten(seed: int, radius: float, rng: VariantRng) -> list[Helping]:
    """Streaks of sauce, a few peas, grains, a leaf."""
    del seed
    sauce = plain_food(_SAUCES, 0.25, rng)
    streaks = []
    for _ in range(rng.choose((5, 7, 9))):
        one = smear(rng.between(0.006, 0.02), rng, thick=0.0005, stretch=rng.between(1.0, 3.2))
        turn, away = rng.between(0.0, 6.28), radius * rng.between(0.1, 0.66)
        streaks.append(
            one.rotated("z", turn + 1.6).moved(away * math.cos(turn), away * math.sin(turn))
        )
    bits = crumbs(rng.choose((16, 28, 40)), 0.85 * radius, rng.between(0.0022, 0.0042), rng)
    made = [
        (join_patches(streaks), sauce),
        (bits, plain_food(("#e6d9b8", "#6f9a2e", "#d9761f", "#8a5228"), 0.5, rng)),
    ]
    if rng.chance(0.6):
        leaf = sheet(lambda t: 0.02 * (0.6 + 0.4 * np.cos(t) ** 2), 0.001, 4, 0.004, rng)
        made.append((leaf.moved(0.4 * radius, 0.3 * radius, 0.006), plain_food(_GREENS, 0.5, rng)))
    return made


_MEALS: Mapping[str, Callable[[int, float, VariantRng], list[Helping]]] = {
    "spaghetti": _spaghetti,
    "eaten": _eaten,
    "salad": _salad,
    "cake": _cake,
    "breakfast": _breakfast,
    "rice": _rice_and_curry,
    "sandwich": _sandwiches,
    "crumbs": _crumbs,
    "roast": _roast,
    "pizza": _pizza,
    "pancakes": _pancakes,
    "toast": _toast,
}
_LEFT_OVER: Sequence[str] = ("eaten", "crumbs")
SMALL: Sequence[str] = ("cake", "crumbs", "toast", "pancakes")
"""Meals that are served on side plates."""
EMPTY_PLATES = 42
"""Number of the first plate with a meal; those before are clean."""


def meal_on_plate(seed: int) -> str:
    """The meal of a variant of the family ``plate``; empty = none."""
    return in_turn(tuple(_MEALS), seed - EMPTY_PLATES) if seed >= EMPTY_PLATES else ""
