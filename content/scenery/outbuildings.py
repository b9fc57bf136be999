"""Garages, rows of garages and sheds. Origin: the centre of the footprint; doors face +X."""

import math

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.procedural.surface_shapes import block
from gen_data.content.scenery import facade, roofs
from gen_data.content.scenery import facade_fittings as fittings
from gen_data.content.scenery.basic_shapes import make_solid, quad
from gen_data.content.scenery.building_designs import building_materials, draw_design
from gen_data.content.scenery.facade import BASE, METAL, Opening
from gen_data.core.variant_rng import VariantRng, variant_rng


def garage(rng: VariantRng) -> Solid:
    """A garage for one or two cars."""
    return _garage(rng.seed, rng.choose((1, 1, 2), "doors"), rng)


def garage_row(seed: int) -> Solid:
    """Two to seven garages side by side, some of their doors sprayed on."""
    rng = variant_rng("garage_row", seed)
    return _garage(seed, rng.choose((2, 3, 4, 5, 7), "doors"), rng)


def _garage(seed: int, doors: int, rng: VariantRng) -> Solid:
    deep, high = rng.between(5.6, 6.5, "depth_m"), rng.between(2.5, 2.9, "height_m")
    half = 0.5 * (doors * 3.0 + 0.2)
    holes = [
        Opening((-half + 0.35 + 3.0 * k, -half + 2.85 + 3.0 * k), (0.02, 2.15), 0.12)
        for k in range(doors)
    ]
    front = [facade.cut_openings((-half, half), (0.0, high), holes)]
    front += [facade.garage_door(hole) for hole in holes]
    front += [p.moved(-0.1, 0.0, 0.0) for p in fittings.graffiti((-half, half), rng)[1:]]
    walls = _box_walls(join_patches(front), (deep, 2.0 * half, high), rng)
    x = 0.5 * deep
    roof = block((-x - 0.05, -half - 0.05, high), (x + 0.12, half + 0.05, high + 0.16), slot=METAL)
    hull = hulls.box((-x, -half, 0.0), (x, half, high + 0.16))
    materials = building_materials(draw_design("house", seed), seed)
    return make_solid([*walls, roof], materials, [hull])


def shed(seed: int) -> Solid:
    """A garden shed or a hut of boards, sheet or brick, 1.8-4.5 m wide."""
    rng = variant_rng("shed", seed)
    wide = rng.between(1.8, 4.5, "width_m")
    deep = rng.between(1.8, 3.4, "depth_m")
    high = rng.between(1.95, 2.4, "height_m")
    options = ("farmhouse", "warehouse", "house")
    plan = draw_design(rng.choose(options), seed + int(40 * rng.random()))
    half = 0.5 * wide
    door = rng.between(-half + 0.15, half - 1.05)
    holes = [Opening((door, door + 0.85), (0.06, 1.85), 0.06)]
    parts = [facade.door(holes[0], rng)]
    window = -0.75 if door > 0.0 else half - 0.9
    if rng.chance(0.6) and abs(window + 0.35 - door - 0.42) > 0.95 and window > 0.1 - half:
        holes.append(Opening((window, window + 0.7), (1.1, 1.7), 0.06, rng.choose((1, 2))))
        parts.append(facade.window(holes[1], rng))
    front = facade.cut_openings((-half, half), (0.0, high), holes)
    walls = _box_walls(join_patches([front, *parts]), (deep, wide, high), rng)
    roof = _shed_roof(deep, wide, rng).moved(z=high)
    hull = hulls.box((-0.5 * deep, -half, 0.0), (0.5 * deep, half, high))
    return make_solid([*walls, roof], building_materials(plan, seed), [hull])


def _shed_roof(deep: float, wide: float, rng: VariantRng) -> Patch:
    """A gable either way round, or a flat lid."""
    kind = rng.choose(("gable", "gable", "front", "lid"), "kind")
    pitch = rng.between(0.25, 0.7, "pitch_m")
    if kind == "lid":
        x, y = 0.5 * deep + 0.15, 0.5 * wide + 0.15
        return block((-x, -y, 0.0), (x, y, 0.1), slot=METAL)
    if kind == "gable":
        return roofs.over_profile(roofs.gable_profile(deep, pitch, 0.15), wide, 0.15, 0.08)
    shell = roofs.over_profile(roofs.gable_profile(wide, pitch, 0.15), deep, 0.15, 0.08)
    return shell.rotated("z", 0.5 * math.pi)


def _box_walls(front: Patch, size_m: tuple[float, float, float], rng: VariantRng) -> list[Patch]:
    """Four walls and a floor, of a depth, width and height; the front is given."""
    deep, wide, high = size_m
    x, y = 0.5 * deep, 0.5 * wide
    plain = facade.cut_openings((-y, y), (0.0, high))
    walls = [front.moved(x), plain.moved(x).rotated("z", math.pi)]
    for turn in (1, -1):
        extras = fittings.graffiti((-x, x), rng) if rng.chance(0.25) else []
        side = join_patches([facade.cut_openings((-x, x), (0.0, high)), *extras])
        walls.append(side.moved(y).rotated("z", turn * 0.5 * math.pi))
    return [*walls, quad([(-x, -y, 0.0), (-x, y, 0.0), (x, y, 0.0), (x, -y, 0.0)], BASE)]
