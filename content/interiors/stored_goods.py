"""Goods behind doors, on racks and in workshops. Typical sizes, assumed."""

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.interiors.cartons import carton_looks, tape_carton
from gen_data.content.interiors.parts import Box, board, disc, front, rod, solid, wood
from gen_data.content.interiors.soft_goods import fabric, hang_garment, wool
from gen_data.content.interiors.storage import RAIL_M
from gen_data.content.procedural import bottles, packaging, tableware
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import (
    CAPS,
    GLAZES,
    PLASTICS,
    STAINLESS,
    STEEL,
    draw_linear,
    metal_material,
    painted_material,
)
from gen_data.content.procedural.patches import Patch
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng

_DARK = painted_material("#1d1e20", 0.5)


class _Group:
    def __init__(self) -> None:
        self.patches: list[Patch] = []
        self.looks: list[Material] = []

    def add(self, made: Solid, x: float, y: float, z: float, yaw_rad: float = 0.0) -> float:
        """Put a solid with its lowest point at a place; its height [m]."""
        mesh = made.mesh
        low, high = float(mesh.vertices_m[:, 2].min()), float(mesh.vertices_m[:, 2].max())
        corners = mesh.vertices_m[mesh.faces].astype(np.float64)
        uvs = mesh.uvs[mesh.faces].astype(np.float64)
        slots = mesh.face_slots.astype(np.int64) + len(self.looks)
        self.patches.append(Patch(corners, uvs, slots).rotated("z", yaw_rad).moved(x, y, z - low))
        self.looks += mesh.materials
        return high - low


def _plates(rng: VariantRng, radius_m: float, count: int, slot: int) -> list[Patch]:
    r, made = radius_m, []
    for k in range(count):
        profile = [
            (0.0, 0.0),
            (0.6 * r, 0.0),
            (r, 0.016),
            (r, 0.019),
            (0.58 * r, 0.004),
            (0.0, 0.004),
        ]
        plate = shapes.lathe(profile, 28, slot)
        shift = rng.between(-0.004, 0.004) if k else 0.0
        made.append(plate.moved(shift, shift, 0.0065 * k))
    return made


def _bowls(radius_m: float, count: int, slot: int) -> list[Patch]:
    r, made = radius_m, []
    outer = [(0.0, 0.0), (0.5 * r, 0.0), (0.85 * r, 0.3 * r), (r, 0.62 * r)]
    profile = [*outer, (0.96 * r, 0.62 * r), (0.8 * r, 0.32 * r), (0.45 * r, 0.03), (0.0, 0.03)]
    made += [shapes.lathe(profile, 28, slot).moved(0.0, 0.0, 0.02 * k) for k in range(count)]
    return made


def _glass(radius_m: float, height_m: float, slot: int) -> Patch:
    r, h = radius_m, height_m
    profile = [(0.0, 0.0), (0.8 * r, 0.0), (r, h), (0.95 * r, h), (0.76 * r, 0.008), (0.0, 0.008)]
    return shapes.lathe(profile, 20, slot)


def _cup(radius_m: float, height_m: float, slot: int) -> list[Patch]:
    """A mug with its handle to +Y."""
    r, h = radius_m, height_m
    turn = np.linspace(-0.45 * math.pi, 0.45 * math.pi, 7)
    path = np.stack(
        [np.zeros(7), 0.93 * r + 0.5 * r * np.cos(turn), 0.5 * h + 0.34 * h * np.sin(turn)], axis=1
    )
    bow = shapes.sweep(path, shapes.circle(0.0045, 8), up=(1.0, 0.0, 0.0), slot=slot)
    return [_glass(r, h, slot), bow]


def crockery(rng: VariantRng) -> Solid:
    """Plates, bowls, cups and glasses in rows, as in cupboards. Slots: glazes, glass."""
    patches: list[Patch] = []
    y, half = -0.25, 0.25
    common = ["plates", "bowls", "cups", "glasses", "small plates", "cups", "packets"]
    kinds = [*rng.shuffled(common), *rng.shuffled(common)]
    for kind in kinds:
        slot = int(rng.random() * 3)
        if kind in ("plates", "small plates"):
            r = rng.between(0.115, 0.13) if kind == "plates" else rng.between(0.085, 0.1)
            made = [p.moved(0.0, r, 0.0) for p in _plates(rng, r, int(rng.between(4, 12)), slot)]
            wide = 2.0 * r
        elif kind == "bowls":
            r = rng.between(0.06, 0.08)
            made = [p.moved(0.03, r, 0.0) for p in _bowls(r, int(rng.between(2, 6)), slot)]
            wide = 2.0 * r
        elif kind == "packets":
            made, wide = _packets(rng), 0.2
        else:
            r, h = rng.between(0.034, 0.042), rng.between(0.085, 0.13)
            made, wide = [], 0.0
            for row in range(2):
                for deep in range(3):
                    x, at = 0.09 - 0.095 * deep, r + row * (2.5 * r)
                    if kind == "cups":
                        turn = rng.between(-0.8, 0.8)
                        made += [
                            p.rotated("z", turn).moved(x, at, 0.0)
                            for p in _cup(r, 0.8 * h + 0.015, slot)
                        ]
                    else:
                        made.append(_glass(r, h, 3).moved(x, at, 0.0))
            wide = 5.0 * r
        if y + wide > half:
            continue
        patches += [p.moved(0.0, y, 0.0) for p in made]
        y += wide + rng.between(0.008, 0.03)
    glazes = [Material(draw_linear(GLAZES, 0.06, rng), 0.15) for _ in range(2)]
    clear = Material((0.95, 0.97, 0.97), 0.03, transmission=1.0, role="glass")
    looks = [painted_material("#f2f1ec", 0.14), *glazes, clear, *_packet_looks(rng)]
    return _boxed(patches, looks)


def _packets(rng: VariantRng) -> list[Patch]:
    """Packets and tins of provisions, in slots 4 to 7."""
    made: list[Patch] = []
    for deep in range(2):
        y = 0.0
        while y < 0.15:
            a, b, h = rng.between(0.03, 0.055), rng.between(0.05, 0.1), rng.between(0.11, 0.23)
            slot = 4 + int(rng.random() * 4)
            x = 0.06 - 0.11 * deep
            if rng.chance(0.3):
                made.append(disc(x, y + 0.03, 0.0, 0.11, 0.03, slot, 20))
                y += 0.065
                continue
            packet = shapes.block((-a, 0.0, 0.0), (a, min(b, 0.2 - y), h), 0.002, slot)
            made.append(packet.moved(x, y, 0.0))
            y += b + 0.004
    return made


def _packet_looks(rng: VariantRng) -> list[Material]:
    return [Material(draw_linear(PLASTICS, 0.1, rng), 0.45) for _ in range(4)]


def _boxed(patches: Sequence[Patch], looks: Sequence[Material]) -> Solid:
    """A solid with the box around it for collisions, its middle at the origin of its footprint."""
    low = np.min([p.bounds_m()[0] for p in patches], axis=0)
    high = np.max([p.bounds_m()[1] for p in patches], axis=0)
    x, y, z = (-0.5 * (low[0] + high[0]), -0.5 * (low[1] + high[1]), -low[2])
    half_x, half_y = 0.5 * float(high[0] - low[0]), 0.5 * float(high[1] - low[1])
    box: Box = ((-half_x, -half_y, 0.0), (half_x, half_y, float(high[2] - low[2])))
    return solid([p.moved(float(x), float(y), float(z)) for p in patches], looks, [box])


def groceries(rng: VariantRng) -> Solid:
    """Food as it stands in refrigerators: cartons, bottles, jars, bowls and boxes."""
    group = _Group()
    makers: tuple[Callable[[int], Solid], ...] = (
        packaging.milk_carton, packaging.carton, packaging.carton, bottles.jar, bottles.jar,
        bottles.bottle, partial(tableware.vessel, "bowl"),
    )  # fmt: skip
    for x in (0.1, -0.08):
        y = -0.2
        while y < 0.2:
            made = rng.choose(makers)(int(rng.random() * 16))
            size = np.ptp(made.mesh.vertices_m, axis=0)
            reach = 0.5 * float(max(size[0], size[1]))
            if y + 2.0 * reach > 0.21 or size[2] > 0.26:
                y += 0.03
                continue
            group.add(made, x + rng.between(-0.02, 0.02), y + reach, 0.0)
            y += 2.0 * reach + rng.between(0.004, 0.04)
    return _boxed(group.patches, group.looks)


def hanging_clothes(rng: VariantRng) -> Solid:
    """Clothes on hangers under a rail 1.2 m high, over folded ones. Slots: cloths, hangers."""
    patches: list[Patch] = []
    wide = 0.3
    y = -0.5 * wide + 0.02
    while y < 0.5 * wide - 0.02:
        long, slot = rng.between(0.55, 0.98), int(rng.random() * 5)
        garment = hang_garment(rng, long, slot, thin=True).scaled(1.0, 0.8, 1.0)
        patch = garment.rotated("z", 0.5 * math.pi + rng.between(-0.12, 0.12)).moved(
            0.0, y, RAIL_M - 0.09
        )
        patches.append(patch)
        patches.append(rod((0.0, y, RAIL_M - 0.1), (0.0, y, RAIL_M + 0.012), 0.0025, 5, 6))
        y += rng.between(0.028, 0.05)
    for k in range(int(rng.between(2, 6))):
        x, b, t = rng.between(0.14, 0.17), 0.15, 0.035
        layer = shapes.block((-x, -b, 0.0), (x, b, t), 0.012, int(rng.random() * 5))
        patches.append(layer.moved(0.0, 0.0, 0.034 * k))
    cloths = [fabric(rng, 0.3) if rng.chance(0.6) else wool(rng) for _ in range(5)]
    return _boxed(patches, [*cloths, metal_material(STAINLESS, 0.3)])


def carton_stack(rng: VariantRng) -> Solid:
    """One to three closed cartons on one another. Slots: card, tape, label, print."""
    patches: list[Patch] = []
    x, y, z = 0.5 * rng.between(0.26, 0.38, "depth_m"), 0.5 * rng.between(0.3, 0.52, "width_m"), 0.0
    for k in range(rng.turn((1, 2, 3), "count")):
        h = rng.between(0.1, 0.24) if rng.seed % 3 else rng.between(0.14, 0.28)
        part: list[Patch] = []
        tape_carton(part, (-x, -y, 0.0), (x, y, h), rng, (0, 1, 2, 3))
        turn = rng.between(-0.06, 0.06) if k else 0.0
        patches += [p.rotated("z", turn).moved(0.0, 0.0, z) for p in part]
        z += h + 0.0007
        x, y = x * rng.between(0.8, 1.0), y * rng.between(0.75, 1.0)
    return _boxed(patches, carton_looks(rng, rng.seed))


def screw_jars(rng: VariantRng) -> Solid:
    """Jars with screws and nails, in a row or two. Slots: glass, lids, steel, brass."""
    patches: list[Patch] = []
    r, h = rng.between(0.032, 0.042, "radius_m"), rng.between(0.08, 0.12, "height_m")
    for i in range(rng.turn((1, 2), "rows")):
        for j in range(2 + rng.seed % 4):
            x, y = 2.15 * r * i, 2.15 * r * j
            fill = rng.between(0.25, 0.8) * h
            patches += [
                _glass(r, h, 0).moved(x, y, 0.0),
                disc(x, y, 0.009, fill, 0.7 * r, 2 + int(rng.random() * 2), 16),
                disc(x, y, h, h + 0.014, 1.02 * r, 1, 24),
            ]
    looks = [
        Material((0.93, 0.96, 0.95), 0.04, transmission=1.0, role="glass"),
        Material(draw_linear(CAPS, 0.1, rng), 0.4),
        metal_material(STEEL, 0.5),
        metal_material((0.72, 0.56, 0.32), 0.45),
    ]
    return _boxed(patches, looks)


def cable_coil(rng: VariantRng) -> Solid:
    """Cable, wire or hose, wound up and lying. Slots: cable, ties."""
    r, wire = rng.between(0.08, 0.15, "radius_m"), rng.between(0.004, 0.008, "wire_m")
    turns = rng.whole(5, 11, "turns")
    t = np.linspace(0.0, 2.0 * math.pi * turns, 22 * turns)
    layer = np.floor(t / (2.0 * math.pi))
    reach = r + wire * 1.6 * (layer % 3) + 0.004 * np.sin(2.3 * t)
    height = wire + 1.5 * wire * np.minimum(t / (2.0 * math.pi) / 2.5, 4.0)
    path = np.stack([reach * np.cos(t), reach * np.sin(t), height], axis=1)
    patches = [shapes.sweep(path, shapes.circle(wire, 7), slot=0)]
    top = float(height.max()) + wire
    for turn in (0.3, 2.4, 4.5):
        tie = shapes.block(
            (r - 2.0 * wire, -0.006, 0.0), (r + 6.0 * wire, 0.006, top + 0.001), 0.0, 1
        )
        patches.append(tie.rotated("z", turn))
    cable = Material(
        draw_linear(("#e8742c", "#1d1e20", "#e6c229", "#b3261e", "#d8d6d0", "#2f7d4f"), 0.1, rng),
        0.45,
    )
    return _boxed(patches, [cable, _DARK])


def timber(rng: VariantRng) -> Solid:
    """Boards, battens, pipes and a sheet that lean against a wall. Slots: woods, steel, sheet."""
    patches: list[Patch] = []
    y, wide = 0.0, rng.between(0.45, 1.0, "width_m")
    if rng.seed % 3 == 0:
        h = rng.between(1.0, 1.5, "height_m")
        sheet = shapes.block((0.0, 0.0, 0.0), (0.014, wide, h), 0.0015, 3)
        patches.append(sheet.rotated("y", -0.13).moved(0.0, 0.0, 0.0))
    while y < wide:
        kind = rng.random()
        lean = -rng.between(0.09, 0.14)
        high = rng.between(1.25, 2.1)
        ahead = 0.03 + rng.between(0.0, 0.05)
        if kind < 0.5:
            w, t = rng.between(0.06, 0.19), rng.between(0.018, 0.03)
            piece = board((0.0, 0.0, 0.0), (t, w, high), int(rng.random() * 2))
        elif kind < 0.8:
            w = rng.between(0.03, 0.06)
            piece = board((0.0, 0.0, 0.0), (w, w, high), int(rng.random() * 2))
        else:
            w = rng.between(0.025, 0.05)
            r = 0.5 * w
            piece = rod((r, r, 0.0), (r, r, high), r, 2, 14)
        turned = piece.rotated("x", rng.between(-0.02, 0.02)).rotated("y", lean)
        patches.append(turned.moved(ahead, y, 0.0))
        y += w + rng.between(0.003, 0.04)
    # Feet on the floor, upper ends at the wall.
    placed = []
    for patch in patches:
        low, high_m = patch.bounds_m()
        placed.append(patch.moved(0.3 - float(high_m[0]), 0.0, -float(low[2])))
    looks = [wood(rng, 0.75), wood(rng, 0.8), metal_material(STEEL, 0.4), front(rng)]
    return _boxed(placed, looks)


def pedal_bin(rng: VariantRng) -> Solid:
    """A bin with a lid and a pedal. Slots: body, dark parts."""
    r, h = {"tall": (0.13, 0.6), "wide": (0.145, 0.42), "small": (0.1, 0.27)}[
        rng.turn(("tall", "wide", "small"), "size")
    ]
    r, h = r * rng.between(0.95, 1.05, "width_scale"), h * rng.between(0.95, 1.05, "height_scale")
    body = shapes.lathe([(0.0, 0.012), (r, 0.012), (r, 0.9 * h), (0.0, 0.9 * h)], 40)
    dome = [
        (1.02 * r, 0.9 * h + 0.012),
        (0.98 * r, 0.94 * h),
        (0.75 * r, 0.985 * h),
        (0.3 * r, h),
        (0.0, h),
    ]
    lid = shapes.lathe([(0.0, 0.9 * h), (1.02 * r, 0.9 * h), *dome], 40)
    profile = [(0.0, 0.0), (0.97 * r, 0.0), (1.01 * r, 0.02), (r, 0.022), (0.0, 0.022)]
    patches = [
        body,
        lid,
        shapes.lathe(profile, 40, 1),
        shapes.block((0.95 * r, -0.035, 0.008), (1.32 * r, 0.035, 0.018), 0.004, 1),
        shapes.block((-1.1 * r, -0.03, 0.86 * h), (-0.95 * r, 0.03, 0.93 * h), 0.004, 1),
    ]
    shell = (
        metal_material(STAINLESS, 0.28)
        if rng.seed % 2
        else painted_material(rng.choose(("#f0efeb", "#2b2d30", "#d9d2c3", "#7d8a86")), 0.3)
    )
    return solid(patches, [shell, _DARK], [((-0.9 * r, -0.9 * r, 0.0), (0.9 * r, 0.9 * r, h))])
