"""Cloth in rooms: beds, cushions, blankets, towels, clothes. Sizes are assumed: usual ones."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gen_data.generator.assets.interiors.parts import (
    Box,
    board,
    cloth,
    cushion,
    four_legs,
    front,
    rod,
    solid,
)
from gen_data.generator.assets.procedural import surface_shapes as shapes
from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.material_presets import (
    PALETTES,
    STAINLESS,
    draw_linear,
    metal_material,
    painted_material,
    patterned_material,
)
from gen_data.generator.assets.procedural.patches import Patch, join_patches
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.se3 import Array

_LINEN = ("#f3f1ec", "#f1f1ef", "#e8e9ea", "#e6e0d6", "#cfd3d5", "#dfe3e3", "#b9c3cb", "#a9aaa9")


def fabric(rng: VariantRng, repeat_m: float = 0.15) -> Material:
    """Plain or patterned cloth."""
    if rng.chance(0.45):
        return cloth(rng)
    return patterned_material(f"texture/fabric?seed={int(rng.between(0, 16))}", repeat_m, 0.95)


def folds(x: Array, y: Array, rng: VariantRng, wave_m: float, height_m: float) -> Array:
    """Height [m] of creases in cloth: ridges of a few waves in all directions."""
    total = np.zeros(np.broadcast_shapes(x.shape, y.shape))
    for k in range(5):
        turn, wave = rng.between(0.0, math.pi), wave_m * rng.between(0.6, 1.6)
        along = x * math.cos(turn) + y * math.sin(turn)
        across = y * math.cos(turn) - x * math.sin(turn)
        bent = along + 0.25 * wave * np.sin(2.2 * across / wave + rng.between(0.0, 6.3))
        ridge = 1.0 - np.abs(np.sin(math.pi * bent / wave + rng.between(0.0, 6.3)))
        total = total + ridge**2 / (1.0 + 0.5 * k)
    return total * (height_m / 1.5)


def pillow(
    half_x_m: float, half_y_m: float, height_m: float, rng: VariantRng, slot: int = 0
) -> Patch:
    """A filled cover that lies flat on z = 0, with drawn-in sides and creases at its corners."""
    t = np.sin(np.linspace(-0.5 * math.pi, 0.5 * math.pi, 15))
    u, v = t[:, None], t[None, :]
    x = half_x_m * u * (1.0 - 0.07 * (1.0 - v * v) * np.abs(u))
    y = half_y_m * v * (1.0 - 0.07 * (1.0 - u * u) * np.abs(v))
    full = np.clip((1.0 - u * u) * (1.0 - v * v), 0.0, 1.0) ** 0.42
    crease = folds(x, y, rng, 0.16, 0.012) * full
    high = 0.35 * height_m + 0.65 * height_m * full + crease - 0.012 * full
    low = 0.35 * height_m * (1.0 - np.minimum(3.0 * full, 1.0))
    top = np.stack(np.broadcast_arrays(x, y, high), axis=2)
    base = np.stack(np.broadcast_arrays(x, y, low), axis=2)
    return join_patches([shapes.grid(top, slot=slot).flipped(), shapes.grid(base, slot=slot)])


def _over_edge(t: Array, edge_m: float, radius_m: float) -> tuple[Array, Array]:
    """Where cloth of length t from the middle is: outwards and down, over a round edge."""
    beyond = np.maximum(np.abs(t) - edge_m, 0.0)
    turn = np.minimum(beyond / radius_m, 0.5 * math.pi)
    rest = np.maximum(beyond - 0.5 * math.pi * radius_m, 0.0)
    out = np.minimum(np.abs(t), edge_m) + radius_m * np.sin(turn)
    return np.sign(t) * out, -radius_m * (1.0 - np.cos(turn)) - rest


def _duvet(
    ends_x: tuple[float, float],
    half_y: float,
    z: float,
    hang_m: float,
    rng: VariantRng,
    slot: int,
    crease_m: float = 0.035,
) -> Patch:
    """A cover over a mattress, from the head's end on: it hangs over both sides and the foot."""
    x0, x1 = ends_x
    s = np.linspace(x0, x1 + 0.06, 44)[:, None]
    t = np.linspace(-half_y - hang_m, half_y + hang_m, 56)[None, :]
    y, down = _over_edge(t, half_y, 0.05)
    x, fall = _over_edge(s - x0, x1 - x0 - 0.02, 0.05)
    crease = folds(s, t, rng, 0.42, crease_m) * np.clip((s - x0) / 0.4, 0.1, 1.0)
    swell = 0.035 * np.minimum(np.abs(half_y - np.abs(t)) / 0.2, 1.0) * (np.abs(t) < half_y)
    hem = 1.0 + 0.16 * np.sin(t * 0.0 + s * 9.0 + np.sign(t)) * (np.abs(t) > half_y)
    points = np.stack(
        np.broadcast_arrays(
            x0 + x, y + np.sign(t) * crease * (down < -0.04), z + down * hem + fall + crease + swell
        ),
        axis=2,
    )
    sheet = shapes.grid(points, slot=slot).flipped()
    return join_patches([sheet, sheet.flipped().moved(0.0, 0.0, -0.004)])


def bed(seed: int = 0) -> Solid:
    """A bed of 0.9 to 1.8 m, made; its head at -X. Slots: frame, mattress, duvet, pillows."""
    rng = variant_rng("bed", seed)
    w = (0.9, 1.4, 1.6, 1.8)[seed % 4]
    length, top = 2.0, rng.between(0.42, 0.52)
    x0, x1, y0, y1 = -0.5 * length - 0.06, 0.5 * length + 0.04, -0.5 * w - 0.04, 0.5 * w + 0.04
    rail = rng.between(0.24, 0.32)
    head: Box = ((x0, y0, 0.0), (x0 + 0.05, y1, rng.between(0.8, 1.15)))
    sides: list[Box] = [
        ((x0 + 0.05, y0, 0.12), (x1, y0 + 0.03, rail)),
        ((x0 + 0.05, y1 - 0.03, 0.12), (x1, y1, rail)),
        ((x1 - 0.03, y0 + 0.03, 0.12), (x1, y1 - 0.03, rail)),
    ]
    soft_head = rng.chance(0.4)
    patches: list[Patch] = [cushion(*head, 4, 0.03) if soft_head else board(*head, 0, 0.006)]
    patches += [board(*b) for b in sides]
    patches += four_legs(x1 - x0, y1 - y0, 0.2, 0.06, 0)
    mattress: Box = ((-0.5 * length, -0.5 * w, 0.14), (0.5 * length, 0.5 * w, top))
    patches.append(cushion(*mattress, 1, 0.05))
    fold, hang = rng.between(0.5, 0.75), rng.between(0.16, 0.26)
    start = -0.5 * length + fold
    patches.append(_duvet((start, 0.5 * length), 0.5 * w, top + 0.02, hang, rng, 2))
    back = _duvet(
        (start - 0.03, start + 0.24), 0.5 * w + 0.02, top + 0.085, 0.9 * hang, rng, 1, 0.012
    )
    patches.append(back)
    for y in (0.0,) if w < 1.2 else (-0.25 * w, 0.25 * w):
        lying = pillow(0.22, 0.36, 0.17, rng, 3).rotated("y", rng.between(-0.3, -0.12))
        turned = lying.rotated("z", rng.between(-0.1, 0.1))
        patches.append(turned.moved(-0.5 * length + 0.26, y, top + 0.02))
        if rng.chance(0.5):
            small = pillow(0.17, 0.24, 0.13, rng, 5).rotated("y", rng.between(-0.7, -0.45))
            patches.append(small.moved(-0.5 * length + 0.5, y + rng.between(-0.1, 0.1), top + 0.07))
    if rng.chance(0.5):
        throw_at = rng.between(0.05, 0.25) * length
        throw = _duvet((throw_at, throw_at + 0.55), 0.5 * w + 0.04, top + 0.11, hang, rng, 5, 0.012)
        patches.append(throw)
    linen = painted_material(rng.choose(_LINEN), 0.95)
    looks = [front(rng), linen, fabric(rng), linen, fabric(rng), fabric(rng)]
    return solid(patches, looks, [head, mattress])


def cushion_pillow(seed: int = 0) -> Solid:
    """A cushion that lies flat. Slot: cloth."""
    rng = variant_rng("cushion_pillow", seed)
    s, h = rng.between(0.19, 0.25), rng.between(0.12, 0.16)
    body: Box = ((-0.8 * s, -0.8 * s, 0.0), (0.8 * s, 0.8 * s, h))
    return solid([pillow(s, s, h, rng)], [fabric(rng)], [body])


def blanket(seed: int = 0) -> Solid:
    """A folded blanket. Slot: cloth."""
    rng = variant_rng("blanket", seed)
    x, y, layers = rng.between(0.16, 0.22), rng.between(0.2, 0.3), int(rng.between(2, 5))
    return _folded(rng, [(x, y, rng.between(0.022, 0.035))] * layers, [fabric(rng)])


def towel_stack(seed: int = 0) -> Solid:
    """Folded towels on each other. Slots: cloths."""
    rng = variant_rng("towel_stack", seed)
    x, y, count = rng.between(0.11, 0.15), rng.between(0.15, 0.2), int(rng.between(2, 7))
    sizes = [(x * rng.between(0.93, 1.0), y * rng.between(0.93, 1.0), 0.045)] * count
    return _folded(rng, sizes, [cloth(rng), cloth(rng)])


def folded_clothes(seed: int = 0) -> Solid:
    """Folded jumpers and shirts on each other. Slots: cloths."""
    rng = variant_rng("folded_clothes", seed)
    sizes = [
        (rng.between(0.13, 0.16), rng.between(0.12, 0.16), rng.between(0.025, 0.05))
        for _ in range(int(rng.between(1, 6)))
    ]
    return _folded(rng, sizes, [fabric(rng) for _ in range(3)])


def _folded(
    rng: VariantRng, sizes_m: Sequence[tuple[float, float, float]], looks: Sequence[Material]
) -> Solid:
    """Layers of half width, half depth and thickness, one on the other, a little askew."""
    patches: list[Patch] = []
    z = 0.0
    for k, (x, y, t) in enumerate(sizes_m):
        dx, dy = (rng.between(-0.008, 0.008) if k else 0.0 for _ in range(2))
        layer = cushion((-x, -y, 0.0), (x, y, t), k % len(looks), 0.45 * t)
        patches.append(layer.rotated("z", rng.between(-0.05, 0.05)).moved(dx, dy, z))
        z += 0.97 * t
    x, y = max(s[0] for s in sizes_m), max(s[1] for s in sizes_m)
    return solid(patches, looks, [((-x, -y, 0.0), (x, y, z))])


def clothes_pile(seed: int = 0) -> Solid:
    """Clothes that were dropped. Slots: cloths."""
    rng = variant_rng("clothes_pile", seed)
    patches: list[Patch] = []
    reach, top = 0.0, 0.0
    for k in range(2 + seed % 2):
        r = rng.between(0.16, 0.26)
        ring = np.linspace(0.0, 1.0, 12)[:, None]
        turn = np.linspace(0.0, 2.0 * math.pi, 41)[None, :]
        lobes = 1.0 + 0.22 * np.sin(3.0 * turn + rng.between(0.0, 6.3))
        lobes = lobes + 0.13 * np.sin(7.0 * turn + rng.between(0.0, 6.3))
        x, y = r * ring * lobes * np.cos(turn), r * ring * lobes * np.sin(turn)
        height = rng.between(0.05, 0.09) * (1.0 - ring**2) + folds(x, y, rng, 0.12, 0.035)
        z = np.maximum(height * np.minimum(4.0 * (1.0 - ring), 1.0), 0.0) + 0.004 * (ring < 0.999)
        # Both ends of the turn are one point.
        z[:, -1] = z[:, 0]
        dx, dy = (rng.between(-0.07, 0.07) if k else 0.0 for _ in range(2))
        points = np.stack(np.broadcast_arrays(x, y, z), axis=2)
        patches.append(shapes.grid(points, slot=k).flipped().moved(dx, dy, 0.012 * k))
        reach, top = max(reach, 1.3 * r), max(top, float(z.max()) + 0.012 * k)
    looks = [fabric(rng) for _ in range(3)]
    return solid(
        patches, looks, [((-0.5 * reach, -0.5 * reach, 0.0), (0.5 * reach, 0.5 * reach, top))]
    )


def laundry_basket(seed: int = 0) -> Solid:
    """A basket with clothes in it. Slots: basket, clothes."""
    rng = variant_rng("laundry_basket", seed)
    r, h = rng.between(0.19, 0.24), rng.between(0.38, 0.55)
    wall = shapes.lathe(
        [(0.0, 0.0), (0.85 * r, 0.0), (r, h), (r - 0.012, h), (0.84 * r, 0.02), (0.0, 0.02)], 28
    )
    ring = np.linspace(0.0, 1.0, 9)[:, None]
    turn = np.linspace(0.0, 2.0 * math.pi, 33)[None, :]
    x, y = 0.96 * r * ring * np.cos(turn), 0.96 * r * ring * np.sin(turn)
    z = 0.86 * h + 0.07 * (1.0 - ring**2) + folds(x, y, rng, 0.14, 0.06) * (1.0 - ring**4)
    z[:, -1] = z[:, 0]
    heap = shapes.grid(np.stack(np.broadcast_arrays(x, y, z), axis=2), slot=1).flipped()
    look = patterned_material(f"texture/fabric?seed={int(rng.between(0, 16))}", 0.12, 0.9)
    shell = look if rng.chance(0.5) else painted_material(rng.choose(("#f0efeb", "#8a8d90")), 0.5)
    return solid(
        [wall, heap], [shell, fabric(rng)], [((-0.8 * r, -0.8 * r, 0.0), (0.8 * r, 0.8 * r, h))]
    )


def coat_hooks(seed: int = 0) -> Solid:
    """Hooks on a board with coats and a bag; origin at its lowest point, on the wall.

    Slots: board, hooks, coats.
    """
    rng = variant_rng("coat_hooks", seed)
    count = 3 + seed % 3
    w, drop = 0.17 * count, 1.05
    patches: list[Patch] = [board((0.0, -0.5 * w, drop), (0.02, 0.5 * w, drop + 0.09))]
    lowest = drop
    for k in range(count):
        y = (k + 0.5) * 0.17 - 0.5 * w
        patches.append(rod((0.02, y, drop + 0.05), (0.075, y, drop + 0.065), 0.007, 1))
        if rng.chance(0.72):
            length = rng.between(0.6, 1.0)
            lowest = min(lowest, drop - length + 0.05)
            patches.append(_coat(rng, length, 2 + k % 3).moved(0.05, y, drop + 0.05))
    looks = [front(rng), metal_material(STAINLESS, 0.3), *(_wool(rng) for _ in range(3))]
    moved = [patch.moved(0.0, 0.0, -lowest) for patch in patches]
    top = drop + 0.09 - lowest
    return solid(moved, looks, [((0.0, -0.5 * w, 0.0), (0.16, 0.5 * w, top))])


def _wool(rng: VariantRng) -> Material:
    dark = ("#2b2f36", "#3d2f28", "#5b6157", "#1f2a3c", "#7a2f33", "#8b7558", "#46505e")
    return Material(draw_linear(dark, 0.15, rng), 0.95)


def _coat(rng: VariantRng, length_m: float, slot: int) -> Patch:
    """A coat that hangs from its collar at the origin, with two sleeves."""
    s = np.linspace(0.0, 1.0, 18)[:, None]
    turn = np.linspace(0.0, 2.0 * math.pi, 33)[None, :]
    wide = 0.05 + 0.1 * np.minimum(5.0 * s, 1.0) + 0.06 * s
    deep = 0.025 + 0.03 * np.minimum(4.0 * s, 1.0) + 0.012 * s
    wave = 1.0 + (0.05 + 0.14 * s) * np.sin(6.0 * turn + rng.between(0.0, 6.3))
    x, y = deep * np.cos(turn) * wave + 0.012, wide * np.sin(turn) * wave
    x = np.maximum(x, -0.045)
    points = np.stack(np.broadcast_arrays(x, y, -length_m * s), axis=2)
    patches = [shapes.grid(points, slot=slot).flipped()]
    for sy in (-1, 1):
        path = np.array(
            [
                (0.012, sy * 0.1, -0.12 * length_m),
                (0.02, sy * 0.17, -0.35 * length_m),
                (0.025, sy * 0.18, -0.72 * length_m),
            ]
        )
        tube = shapes.sweep(
            shapes.spline(path.tolist(), 8), shapes.circle(0.045, 12), up=(1.0, 0.0, 0.0), slot=slot
        )
        patches.append(tube)
    return join_patches(patches)


def towel(seed: int = 0) -> Solid:
    """A towel over a rail; origin at the middle below, on the wall. Slots: cloth, rail."""
    rng = variant_rng("towel", seed)
    w, h = rng.between(0.35, 0.5), rng.between(0.4, 0.65)
    rail_x, rail_z, radius = 0.062, h - 0.016, 0.009
    patches = [
        _over_rail(rng, w, rail_z, rail_z * rng.between(0.55, 0.95)).moved(rail_x, 0, rail_z)
    ]
    half = 0.5 * w + 0.06
    patches.append(rod((rail_x, -half, rail_z), (rail_x, half, rail_z), radius, 1))
    for sy in (-1, 1):
        y = sy * (half - 0.01)
        patches.append(rod((0.0, y, rail_z), (rail_x + 0.004, y, rail_z), radius, 1))
    boxes: list[Box] = [((0.0, -half, 0.0), (0.1, half, h))]
    return solid(patches, [fabric(rng), metal_material(STAINLESS, 0.2)], boxes)


def _over_rail(rng: VariantRng, w: float, front_m: float, back_m: float) -> Patch:
    """Thick cloth over a rail along Y through the origin, with folds that open downwards."""
    bend = np.linspace(0.0, math.pi, 9)
    levels = np.linspace(1.0, 0.0, 12, endpoint=False)
    y = np.linspace(-0.5 * w, 0.5 * w, 49)[None, :]
    waves = 2.0 * math.pi * rng.between(3.0, 5.0) / w
    wave = np.sin(waves * y + rng.between(0.0, 6.3)) + 0.5 * np.sin(
        0.47 * waves * y + rng.between(0.0, 6.3)
    )
    depth = rng.between(0.003, 0.009)

    def sheet(radius: float) -> Array:
        """Points over the rail, from the front's hem to the back's."""
        x = np.concatenate([np.full(12, radius), radius * np.cos(bend), np.full(12, -radius)])
        z = np.concatenate([-front_m * levels, radius * np.sin(bend), -back_m * levels[::-1]])
        fall = np.clip(-z / front_m, 0.0, 1.0)[:, None]
        return np.stack(
            np.broadcast_arrays(x[:, None] + depth * fall * wave, y, z[:, None]), axis=2
        )

    outer, inner = sheet(0.016), sheet(0.0095)
    loop = np.concatenate([outer, inner[::-1], outer[:1]])
    sides = [np.stack([outer[:, k], inner[:, k]]) for k in (0, -1)]
    return join_patches([shapes.grid(loop), shapes.grid(sides[0]).flipped(), shapes.grid(sides[1])])


def bath_mat(seed: int = 0) -> Solid:
    """A mat of tufted cloth. Slot: pile."""
    rng = variant_rng("bath_mat", seed)
    x, y, t = rng.between(0.22, 0.28), rng.between(0.32, 0.42), 0.016
    pile = Material(draw_linear(PALETTES["cloth"], 0.1, rng), 1.0)
    look = patterned_material(f"texture/carpet?seed={int(rng.between(0, 16))}", 0.5, 1.0)
    body: Box = ((-x, -y, 0.0), (x, y, t))
    return solid([cushion(*body, 0, 0.007)], [look if rng.chance(0.4) else pile], [body])


def drying_rack(seed: int = 0) -> Solid:
    """A rack with laundry that dries. Slots: rods, cloths."""
    rng = variant_rng("drying_rack", seed)
    w, d, h = rng.between(0.95, 1.2), 0.5, rng.between(0.85, 0.95)
    patches: list[Patch] = []
    for sy in (-1, 1):
        y = sy * 0.5 * w
        patches += [
            rod((-0.5 * d, y, 0.0), (0.38 * d, y, h), 0.009),
            rod((0.5 * d, y, 0.0), (-0.38 * d, y, h), 0.009),
            rod((-0.55 * d, y, h), (0.55 * d, y, h), 0.008),
        ]
    for k in range(7):
        x = (k / 6 - 0.5) * 1.1 * d
        patches.append(rod((x, -0.5 * w, h), (x, 0.5 * w, h), 0.004, 0, 6))
        if k % 2 == 0 and rng.chance(0.85):
            patches.append(_hung(rng, x, w, h, 1 + k // 2 % 3))
    looks = [painted_material("#e6e6e3", 0.4), *(fabric(rng) for _ in range(3))]
    return solid(patches, looks, [((-0.5 * d, -0.5 * w, 0.0), (0.5 * d, 0.5 * w, h))])


def _hung(rng: VariantRng, x: float, w: float, h: float, slot: int) -> Patch:
    """A cloth over a rod along Y."""
    half, fall = rng.between(0.22, 0.42) * w, rng.between(0.28, 0.5)
    y = np.linspace(-half, half, 25)[None, :] + rng.between(-0.05, 0.05) * w
    s = np.linspace(-1.0, 1.0, 15)[:, None]
    wave = 0.012 * np.sin(14.0 * y + rng.between(0.0, 6.3)) * np.abs(s)
    across = x + np.tanh(6.0 * s) * 0.014 + wave
    points = np.stack(np.broadcast_arrays(across, y, h + 0.006 - fall * np.abs(s)), axis=2)
    sheet = shapes.grid(points, slot=slot)
    return join_patches([sheet, sheet.flipped()])
