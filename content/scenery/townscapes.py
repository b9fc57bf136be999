"""Towns at the end of a view: roofs of old quarters, skylines; frame as in ``horizons``."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural.material_presets import hex_to_linear, patterned_material
from gen_data.content.procedural.patches import Array, Patch, finish_mesh, join_patches
from gen_data.content.procedural.surface_shapes import ball, block, cone, grid
from gen_data.content.scenery import basic_shapes, horizons
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng

TOWN_M, SKYLINE_M = 60.0, 90.0
"""Lengths of the pieces along Y."""
_BAY_M = 3.2
_FACADES = 5
_ROOF, _TILES, _DARK_TILES, _WINDOW, _CROWN = range(_FACADES, _FACADES + 5)
_LIT = 0.2
"""Share of the windows that a lamp may light; by day these are dark panes."""


@dataclass(frozen=True, slots=True)
class _Block:
    """A building over a rectangle.

    Attributes:
        x0, y0, x1, y1: The rectangle; the front is at x1.
        base_m: Height of its foot.
        storeys: Number of storeys.
        storey_m: Height of each.
        slot: Facade.
    """

    x0: float
    y0: float
    x1: float
    y1: float
    base_m: float
    storeys: int
    storey_m: float
    slot: int

    @property
    def top_m(self) -> float:
        """Height of the eaves."""
        return self.base_m + self.storeys * self.storey_m


def skyline(rng: VariantRng) -> Solid:
    """Blocks and towers of a city, 90 m long and 12-80 m high, some with a narrower top.

    By night, a lamp may light each piece's windows (role ``window``).
    """
    tall = rng.choose((0.15, 0.4, 0.7))
    parts: list[Patch] = []
    for row in range(2):
        y = -0.5 * SKYLINE_M
        while y < 0.5 * SKYLINE_M - 9.0:
            width = min(rng.between(12.0, 32.0), 0.5 * SKYLINE_M - y)
            is_tower = row > 0 and rng.chance(tall)
            storeys = round(rng.between(9.0, 21.0) if is_tower else rng.between(3.6, 9.0))
            width = min(width, 22.0) if is_tower else width
            x = -22.0 * row - rng.between(0.0, 5.0)
            plan = _Block(x - rng.between(12.0, 18.0), y, x, y + width, 0.0, storeys,
                          rng.between(2.9, 3.7), int(rng.between(0, _FACADES)))  # fmt: skip
            parts += _city_block(plan, rng)
            y += width + rng.between(-0.5, 9.0)
    colors = ("#c9c2b4", "#b3a596", "#d6d2c8", "#9c9c9c", "#b98f78", "#a7adb0", "#8f8a80")
    return _piece(parts, colors, rng)


def town(rng: VariantRng) -> Solid:
    """Houses of two to four storeys under steep roofs, 60 m long; every fourth piece has a church.

    Gables, hips, chimneys and trees between the houses break the line of the roofs.
    """
    parts: list[Patch] = []
    for row in range(2):
        y = -0.5 * TOWN_M
        while y < 0.5 * TOWN_M - 6.0:
            width = min(rng.between(8.0, 15.0), 0.5 * TOWN_M - y)
            x = -17.0 * row - rng.between(0.0, 4.0)
            plan = _Block(x - rng.between(9.0, 12.0), y, x, y + width, 0.0,
                          round(rng.between(1.6, 3.6)), rng.between(2.7, 3.2),
                          int(rng.between(0, _FACADES)))  # fmt: skip
            parts += [*_walls(plan), *_house_roof(plan, rng), *_lit_windows(plan, rng)]
            y += width + (rng.between(2.0, 8.0) if rng.chance(0.5) else 0.0)
    for _ in range(5):
        parts.append(_crown((-rng.between(4.0, 28.0), rng.between(-0.48, 0.48) * TOWN_M), rng))
    if rng.seed % 4 == 0:
        parts += _church(rng)
    colors = ("#e0d8c6", "#d2c3a4", "#c9a98a", "#dcdad2", "#c4b7a8", "#b5876b", "#d8cfae")
    return _piece(parts, colors, rng)


def _piece(parts: list[Patch], colors: tuple[str, ...], rng: VariantRng) -> Solid:
    """The parts with facades in five of the colours."""
    facades = [
        Material(
            hex_to_linear(color), 0.85, specular=0.4, role="facade",
            texture=f"texture/window_grid?seed={k % 4}",
        )
        for k, color in enumerate(rng.shuffled(colors)[:_FACADES])
    ]  # fmt: skip
    tiles = patterned_material("texture/roof_tiles?seed=0", 1.8, 0.85, hex_to_linear("#9a5a44"))
    slate = patterned_material("texture/roof_tiles?seed=1", 1.8, 0.8, hex_to_linear("#6b6259"))
    materials = (
        *facades,
        Material(hex_to_linear("#6d6a68"), 0.9, role="roof"),
        replace(tiles, role="roof"),
        replace(slate, role="roof"),
        Material((0.035, 0.04, 0.045), roughness=0.15, role="window"),
        Material(hex_to_linear("#5a6b40"), 0.95, specular=0.2, role="leaf"),
    )
    return horizons.centred_piece(finish_mesh(join_patches(parts), materials, 30.0))


def _walls(plan: _Block) -> Iterator[Patch]:
    """Four walls; the facade's texture has four bays and four storeys, none of which is cut."""
    corners = [(plan.x1, plan.y0), (plan.x1, plan.y1), (plan.x0, plan.y1), (plan.x0, plan.y0)]
    low, top = plan.base_m, plan.top_m
    for (ax, ay), (bx, by) in pairwise([*corners, corners[0]]):
        bays = max(1, round(math.hypot(bx - ax, by - ay) / _BAY_M)) / 4.0
        wall = np.array([[(ax, ay, low), (bx, by, low)], [(ax, ay, top), (bx, by, top)]])
        yield grid(wall, np.array([0.0, bays]), np.array([0.0, plan.storeys / 4.0]), plan.slot)


def _lit_windows(plan: _Block, rng: VariantRng) -> Iterator[Patch]:
    """Panes within some windows of the front."""
    bays = max(1, round((plan.y1 - plan.y0) / _BAY_M))
    bay = (plan.y1 - plan.y0) / bays
    for storey in range(plan.storeys):
        for k in range(bays):
            if rng.chance(_LIT):
                y = plan.y0 + (k + 0.5) * bay
                # The texture's windows have their middle at 0.54 of a storey.
                z = plan.base_m + (storey + 0.54) * plan.storey_m
                span = (y - 0.2 * bay, y + 0.2 * bay)
                high = (z - 0.21 * plan.storey_m, z + 0.21 * plan.storey_m)
                yield basic_shapes.facing_rectangle(plan.x1 + 0.03, span, high, _WINDOW)


def _city_block(plan: _Block, rng: VariantRng) -> Iterator[Patch]:
    """A block with a flat or a low pitched roof; high ones may have a narrower top."""
    yield from _walls(plan)
    yield from _lit_windows(plan, rng)
    if plan.storeys < 7 and rng.chance(0.45):
        yield from _house_roof(plan, rng)
        return
    yield _flat_roof(plan)
    if plan.storeys > 8 and rng.chance(0.5):
        inset = rng.between(1.5, 3.5)
        plan = _Block(plan.x0 + inset, plan.y0 + inset, plan.x1 - inset, plan.y1 - inset,
                      plan.top_m, round(rng.between(1.0, 4.0)), plan.storey_m,
                      plan.slot)  # fmt: skip
        yield from _walls(plan)
        yield _flat_roof(plan)
    top = plan.top_m
    x, y = 0.5 * (plan.x0 + plan.x1), plan.y0 + rng.between(0.25, 0.75) * (plan.y1 - plan.y0)
    reach, high = rng.between(1.2, 2.6), rng.between(1.8, 3.2)
    yield block((x - 2.0, y - reach, top), (x + 2.0, y + reach, top + high), 0.0, _ROOF)
    if plan.storeys > 6 and rng.chance(0.4):
        yield cone((0.18, top + high), (0.05, top + high + rng.between(4.0, 9.0)), 5, _ROOF).moved(
            x, y
        )


def _flat_roof(plan: _Block) -> Patch:
    top = plan.top_m
    return grid(
        np.array(
            [[(plan.x1, plan.y0, top), (plan.x1, plan.y1, top)],
             [(plan.x0, plan.y0, top), (plan.x0, plan.y1, top)]]
        ),
        slot=_ROOF,
    )  # fmt: skip


def _house_roof(plan: _Block, rng: VariantRng) -> Iterator[Patch]:
    """A steep roof with its ridge along or across the front, hipped or not, and chimneys."""
    slot = _DARK_TILES if rng.chance(0.35) else _TILES
    along = plan.y1 - plan.y0 >= 0.8 * (plan.x1 - plan.x0) or rng.chance(0.5)
    span = (plan.x1 - plan.x0) if along else (plan.y1 - plan.y0)
    rise = span * rng.between(0.3, 0.5)
    hip = rng.between(0.3, 0.5) * span if rng.chance(0.3) else 0.0
    yield from _ridged(plan, rise, hip, along=along, slot=slot)
    for _ in range(1 + rng.chance(0.6)):
        y = plan.y0 + rng.between(0.2, 0.8) * (plan.y1 - plan.y0)
        x, top = 0.5 * (plan.x0 + plan.x1) + rng.between(-0.8, 0.8), plan.top_m + rise
        yield block((x - 0.4, y - 0.3, top - 0.9), (x + 0.4, y + 0.3, top + 0.7), 0.0, _ROOF)


def _ridged(plan: _Block, rise: float, hip: float, *, along: bool, slot: int) -> Iterator[Patch]:
    """Two slopes to a ridge, and hips or gables at its ends."""
    h, top, over = plan.top_m, plan.top_m + rise, 0.3
    size = (plan.y1 - plan.y0, plan.x1 - plan.x0)
    long, wide = size if along else size[::-1]
    a, b = 0.5 * long + over, 0.5 * wide + over
    ends = a - max(hip, 0.0) if hip else a
    # In a local frame with the ridge along Y, then turned and moved.
    right = np.array([[(b, -a, h), (b, a, h)], [(0.0, -ends, top), (0.0, ends, top)]])
    slopes = [grid(right, slot=slot), grid(right * np.array([-1.0, -1.0, 1.0]), slot=slot)]
    gable = np.array([[(b, a, h), (-b, a, h)], [(0.0, ends, top), (0.0, ends, top)]])
    plain = np.array([0.0, 0.02])
    for turn in (1.0, -1.0):
        corners = gable * np.array([turn, turn, 1.0])
        if hip:
            slopes.append(grid(corners, slot=slot))
        else:
            inner = corners - np.array([0.0, turn * over, 0.0])
            slopes.append(grid(inner, plain, plain, plan.slot))
    x, y = 0.5 * (plan.x0 + plan.x1), 0.5 * (plan.y0 + plan.y1)
    for slope in slopes:
        yield (slope if along else slope.rotated("z", 0.5 * math.pi)).moved(x, y)


def _church(rng: VariantRng) -> Iterator[Patch]:
    """A nave with a tower under a spire or an onion dome, 25 to 45 m high, behind the houses."""
    y = rng.between(-18.0, 18.0)
    width = rng.between(5.5, 7.0, "width_m")
    storey = rng.between(3.4, 4.2, "storey_m")
    tower = _Block(-46.0, y, -46.0 + width, y + width, 0.0, round(rng.between(4.6, 6.4)), storey, 0)
    nave = _Block(-44.0, y + width, -32.0, y + width + rng.between(16.0, 24.0), 0.0, 2, 5.0, 0)
    yield from _walls(tower)
    yield from _walls(nave)
    yield from _ridged(nave, 7.0, 0.0, along=True, slot=_TILES)
    x, middle, top = -46.0 + 0.5 * width, y + 0.5 * width, tower.top_m
    if rng.chance(0.5):
        spire = cone((0.75 * width, 0.0), (0.05, rng.between(9.0, 16.0)), 8, _DARK_TILES)
        yield spire.moved(x, middle, top)
        return
    axes = np.array([0.6 * width, 0.6 * width, 0.55 * width])
    yield ball(lambda d: d * axes, 6, 8).painted(_DARK_TILES).moved(x, middle, top + 0.3 * width)
    yield cone((0.8, 0.0), (0.03, 4.5), 6, _DARK_TILES).moved(x, middle, top + 0.8 * width)


def _crown(at_m: tuple[float, float], rng: VariantRng) -> Patch:
    """A treetop between the houses."""
    radius, high = rng.between(2.5, 4.0), rng.between(0.9, 1.3)

    def shape(d: Array) -> Array:
        lobe = 1.0 + 0.2 * np.sin(3.0 * np.arctan2(d[..., 1:2], d[..., :1]) + 5.0 * d[..., 2:])
        points: Array = d * lobe * radius * np.array([1.0, 1.0, high])
        return points

    foot = high * radius * 1.2
    return ball(shape, 5, 8).painted(_CROWN).moved(*at_m, foot)
