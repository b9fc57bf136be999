"""Refuse: bins on wheels, bags put out for collection, skips."""

import math
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import (
    painted_material,
    patterned_material,
    printed_material,
)
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.procedural.surface_shapes import block, cone, lathe, rounded_box
from gen_data.content.scenery.basic_shapes import facing_rectangle, make_solid, quad
from gen_data.content.scenery.clutter_shapes import Rectangle, bar, hopper, lump, mound
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

_BINS: dict[int, tuple[float, float, float]] = {
    120: (0.603, 0.49, 0.935),
    240: (0.741, 0.58, 1.08),
    1100: (1.08, 1.36, 1.47),
}
"""Depth, width and height [m] by volume [l], of bins after EN 840-1 to EN 840-3 as a German county
lists them (amtfa.de, "Bauarten der Abfallbehälter")."""
_SCHEMES = ("#3c4042 #3c4042", "#3c4042 #1f5fa8", "#3c4042 #e0b61e", "#5c4433 #5c4433",
            "#2f5f3a #2f5f3a", "#3c4042 #2f6f3a", "#1f4f8f #1f4f8f", "#e0b61e #e0b61e",
            "#3c4042 #a8261f", "#7d8284 #7d8284")  # fmt: skip
"""Body and lid."""
_LOADS = ("rubble", "wood", "green", "empty")
_BAGS = ("#17181a", "#17181a", "#212327", "#2c4f86", "#c9ad4a", "#bfc2c0", "#47604c")


def wheelie_bin(seed: int) -> Solid:
    """A refuse bin on wheels, hinge and wheels at -X; closed, overfull or open.

    Slots: body, lid, rubber, steel, inside, bag.
    """
    size, state = _bin_kind(seed)
    rng = variant_rng("wheelie_bin", seed)
    d, w, h = _BINS[size]
    body_color, lid_color = in_turn(_SCHEMES, seed).split()
    parts = _big_bin(d, w, h, state) if size == 1100 else _small_bin(d, w, h, state)
    if state != "closed":
        bag = lump((0.3 * d, 0.3 * w, 0.2), 0.12, rng, 7).moved(0.0, 0.0, 0.84 * h).painted(5)
        parts.append(bag)
    rough = rng.between(0.45, 0.65)
    materials = (
        painted_material(body_color, rough),
        painted_material(lid_color, rough),
        painted_material("#151515", 0.85),
        painted_material("#55585a", 0.5),
        painted_material("#0c0c0c", 0.9),
        painted_material(rng.choose(_BAGS), 0.4),
    )
    hull = hulls.box((-0.45 * d, -0.45 * w, 0.0), (0.45 * d, 0.45 * w, 0.9 * h))
    return make_solid(parts, materials, [hull])


def wheelie_bin_facts(seed: int) -> Facts:
    """Its volume [l], and whether its lid is closed."""
    size, state = _bin_kind(seed)
    return Facts("wheelie_bin", {"volume_l": str(size), "lid": state})


def _bin_kind(seed: int) -> tuple[int, str]:
    sizes, states = (240, 120, 240, 1100), ("closed", "closed", "overfull", "open")
    rng = variant_rng("wheelie_bin", seed)
    return rng.turn(sizes, "volume_l"), rng.turn(states, "lid", seed // 4 + seed % 3)


def _small_bin(d: float, w: float, h: float, state: str) -> list[Patch]:
    """Two wheels, a tapering body with a rim, a domed lid with a handle behind."""
    top, x0, x1 = 0.9 * h, -0.5 * d + 0.09, 0.5 * d
    foot = Rectangle(x0 + 0.06, x1 - 0.13, -0.39 * w, 0.39 * w)
    neck = Rectangle(x0, x1 - 0.03, -0.47 * w, 0.47 * w)
    rim = Rectangle(x0 - 0.015, x1, -0.5 * w, 0.5 * w)
    parts = [
        hopper(foot, neck, (0.03, top - 0.07), open_above=True),
        block((rim.x0, rim.y0, top - 0.075), (rim.x1, rim.y1, top - 0.02), 0.012),
        _floor(neck, top - 0.019),
        *_lid((x0 - 0.04, x1 + 0.012), w, (top - 0.02, h), state),
    ]
    y = 0.41 * w
    parts.append(bar((x0 - 0.07, -y, top), (x0 - 0.07, y, top), 0.015, 6))
    for side in (-y, y):
        parts.append(bar((x0 - 0.07, side, top), (x0 + 0.04, side, top - 0.05), 0.014, 4))
        # Wheels of 200 mm (EN 840-6, 6.3).
        tyre = cone((0.1, -0.025), (0.1, 0.025), 14, 2).rotated("x", 0.5 * math.pi)
        parts.append(tyre.moved(x0 + 0.02, side, 0.1))
    parts.append(bar((x0 + 0.02, -y, 0.1), (x0 + 0.02, y, 0.1), 0.012, 6, 3))
    # The step with which it is tilted, and the foot in front.
    parts.append(block((x1 - 0.2, -0.3 * w, 0.0), (x1 - 0.15, 0.3 * w, 0.04)))
    return parts


def _big_bin(d: float, w: float, h: float, state: str) -> list[Patch]:
    """Four castors, ribbed body, a rounded lid that slides or lifts."""
    foot_z, top, x, y = 0.26, 1.15, 0.5 * d, 0.5 * w
    foot = Rectangle.about(0.0, 0.0, 0.78 * d, 0.86 * w)
    neck = Rectangle.about(0.0, 0.0, 0.92 * d, 0.94 * w)
    parts = [
        hopper(foot, neck, (foot_z, top), open_above=True),
        block((-x, -y, top), (x, y, top + 0.06), 0.02),
        _floor(neck, top + 0.061),
    ]
    for side in (-1.0, 1.0):
        for k in range(3):
            at = (k - 1) * 0.22 * w
            low = (0.39 * d * side, at, foot_z + 0.05)
            parts.append(bar(low, (0.46 * d * side, at, top), 0.025, 4))
        part = bar((-0.25, side * (y + 0.02), 0.98), (0.25, side * (y + 0.02), 0.98), 0.02, 6, 3)
        parts.append(part)
        for front in (-0.3, 0.3):
            tyre = cone((0.1, -0.025), (0.1, 0.025), 12, 2).rotated("x", 0.5 * math.pi)
            parts.append(tyre.moved(front * d, side * 0.33 * w, 0.1))
            fork = block((-0.04, -0.04, 0.1), (0.04, 0.04, foot_z + 0.01), 0.0, 3)
            parts.append(fork.moved(front * d, side * 0.33 * w))
    return [*parts, *_lid((-x, x), w, (top + 0.06, h), state)]


def _floor(area: Rectangle, z: float) -> Patch:
    """The dark inside, as seen from above."""
    return quad(area.corners(z), 4)


def _lid(x_m: tuple[float, float], w: float, z_m: tuple[float, float], state: str) -> list[Patch]:
    """A vaulted lid hinged at the smaller x; slot 1."""
    (x0, x1), (z0, z1) = x_m, z_m
    low = Rectangle(0.0, x1 - x0, -0.51 * w, 0.51 * w)
    high = Rectangle(0.1, x1 - x0 - 0.12, -0.4 * w, 0.4 * w)
    shell = hopper(low, low, (0.0, 0.3 * (z1 - z0)), 1)
    vault = hopper(low, high, (0.3 * (z1 - z0), z1 - z0), 1)
    lid = join_patches([shell, vault])
    # Lids of small bins fall back until they hang; lids of large ones stand.
    turn = {"closed": 0.0, "overfull": -0.42, "open": -4.1 if w < 1.0 else -1.9}[state]
    return [lid.rotated("y", turn).moved(x0, 0.0, z0)]


def rubbish_bags(rng: VariantRng) -> Solid:
    """A heap of full bags put out for collection; on some, cardboard boxes next to them.

    Slots: bags in two colours, cardboard, printed cardboard.
    """
    count = rng.turn((1, 3, 5, 2, 4, 6, 3, 5), "count")
    parts, r = [], 0.0
    for k in range(count):
        high = rng.between(0.22, 0.34)
        wide = rng.between(0.2, 0.29)
        turn = 2.399963 * k + rng.between(-0.3, 0.3)
        r = 0.3 * math.sqrt(k) if k < 4 else 0.2
        bag = lump((wide, 0.92 * wide, high), rng.between(0.16, 0.28), rng)
        knot = lathe([(0.07, -0.06), (0.018, 0.0), (0.05, 0.07), (0.0, 0.05)], 6)
        bag = join_patches([bag, knot.moved(0.0, 0.0, 1.62 * high)]).rotated("z", turn)
        low = 0.3 if k >= 4 else 0.0
        bag = bag.moved(r * math.cos(turn), r * math.sin(turn), low)
        parts.append(bag.painted(int(rng.chance(0.25))))
    if rng.seed % 2:
        parts += _boxes(r + 0.42, rng)
    color, other = rng.choose(_BAGS), rng.choose(_BAGS)
    materials = (
        Material(painted_material(color, 0.35).base_color, roughness=rng.between(0.25, 0.4)),
        Material(painted_material(other, 0.35).base_color, roughness=rng.between(0.25, 0.4)),
        patterned_material("texture/cardboard?seed=1", 0.6, 0.9),
        printed_material(f"texture/poster?seed={rng.seed % 12}", 0.6),
    )
    corners = np.concatenate([p.corners_m.reshape(-1, 3) for p in parts])
    return make_solid(parts, materials, [hulls.extreme(corners, 32)])


def _boxes(x: float, rng: VariantRng) -> list[Patch]:
    """One or two cardboard boxes about y = 0, printed on the front."""
    made = []
    for k in range(rng.choose((1, 2))):
        d, w, h = rng.between(0.25, 0.4), rng.between(0.3, 0.5), rng.between(0.2, 0.45)
        box = block((-0.5 * d, -0.5 * w, 0.0), (0.5 * d, 0.5 * w, h), 0.0, 2)
        face = facing_rectangle(0.5 * d + 0.001, (-0.2 * w, 0.2 * w), (0.3 * h, 0.8 * h), 3)
        both = join_patches([box, face]).rotated("z", rng.between(-0.5, 0.5))
        made.append(both.moved(x, (k - 0.5) * 0.6))
    return made


def skip_container(rng: VariantRng) -> Solid:
    """A skip along Y, empty or heaped with rubble, wood or greenery.

    Slots: paint, inside, load, planks, reflectors. Sizes of skips of 5-10 m^3: assumed, 10 %.
    """
    half, top_half, wide, high = in_turn(((1.15, 1.7, 0.87, 1.2), (1.3, 1.85, 0.9, 1.45)), rng.seed)
    shape = [(-half, 0.12), (half, 0.12), (top_half, high - 0.35), (top_half, high),
             (-top_half, high), (-top_half, high - 0.35)]  # fmt: skip
    parts = _trough(shape, wide, 0) + _trough(shape, wide - 0.05, 1, inside=True)
    for sign in (-1.0, 1.0):
        rim = block((-0.05, -top_half, high - 0.09), (0.05, top_half, high))
        parts.append(rim.moved(sign * wide))
        y = sign * (top_half - 0.03)
        parts.append(block((-wide, y - 0.03, high - 0.09), (wide, y + 0.03, high)))
        for y in (-0.6 * half, 0.6 * half):
            pin = cone((0.05, 0.0), (0.05, 0.12), 8).rotated("y", sign * 0.5 * math.pi)
            parts.append(pin.moved(sign * wide, y, 0.75 * high))
            piece = bar((sign * (wide + 0.02), y, 0.12), (sign * (wide + 0.02), y, high), 0.04)
            parts.append(piece)
        part = block((sign * wide * 0.8 - 0.06, -half, 0.0), (sign * wide * 0.8 + 0.06, half, 0.13))
        parts.append(part)
        for y in (-top_half + 0.1, top_half - 0.1):
            mark = block((-0.012, -0.07, high - 0.3), (0.012, 0.07, high - 0.1), 0.0, 4)
            parts.append(mark.moved(sign * wide, y))
    load = rng.turn(_LOADS, "load")
    if load != "empty":
        heap = mound((2 * wide - 0.12, 2 * top_half - 0.12), rng.between(0.2, 0.5), (8, 14), rng)
        parts.append(heap.moved(0.0, 0.0, high - 0.12).painted(2))
    if load in {"wood", "rubble"}:
        parts += [_plank(rng, high, wide, top_half) for _ in range(7 if load == "wood" else 3)]
    fill = {
        "rubble": patterned_material("texture/concrete?seed=3", 0.8, 0.95, (0.75, 0.66, 0.6)),
        "wood": patterned_material("texture/wood_planks?seed=2", 0.9, 0.9, (0.8, 0.7, 0.6)),
        "green": patterned_material("texture/foliage?seed=0", 0.6, 0.9, (0.22, 0.25, 0.12)),
    }.get(load, painted_material("#5a4b40", 0.9))
    paint = rng.choose(("#d9a520", "#2f6f9f", "#b8462b", "#4a5a4a", "#7d8284", "#2f5fa0"))
    materials = (
        painted_material(paint, 0.6),
        painted_material("#4a4038", 0.8),
        fill,
        patterned_material("texture/wood_grain?seed=5", 1.2, 0.85, (0.7, 0.6, 0.5)),
        painted_material("#c8281f", 0.3),
    )
    floor: Vec3 = (-wide, -half, 0.0)
    return make_solid(parts, materials, [hulls.box(floor, (wide, half, high))])


def _trough(
    shape: list[tuple[float, float]], wide: float, slot: int, *, inside: bool = False
) -> list[Patch]:
    """Sides and bottom of an outline of (y, z), open above: its fifth and fourth corners."""
    shrink = 0.96 if inside else 1.0
    points = [(y * shrink, z + (0.03 if inside and z < 0.2 else 0.0)) for y, z in shape]
    corners = {x: [(x, y, z) for y, z in points] for x in (-wide, wide)}
    parts = []
    order = [4, 5, 0, 1, 2, 3]
    for a, b in pairwise(order):
        left, right = corners[-wide], corners[wide]
        parts.append(quad([left[a], left[b], right[b], right[a]], slot))
    for x, turn in ((wide, 1), (-wide, -1)):
        side = corners[x]
        rows = [[side[0], side[1], side[2], side[5]], [side[5], side[2], side[3], side[4]]]
        parts += [quad(row[::turn] if turn > 0 else row[::-1], slot) for row in rows]
    return [part.flipped() for part in parts] if inside else parts


def _plank(rng: VariantRng, high: float, wide: float, half: float) -> Patch:
    """A board that sticks out of a load."""
    board = rounded_box((rng.between(0.9, 1.6), rng.between(0.1, 0.2), 0.025), 0.0, 1)
    board = board.rotated("y", rng.between(-0.5, 0.5)).rotated("z", rng.between(0.0, 3.1))
    at = (rng.between(-0.3, 0.3) * wide, rng.between(-0.6, 0.6) * half, high + 0.2)
    return board.moved(*at).painted(3)
