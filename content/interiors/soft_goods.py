"""Cloth in rooms: beds, cushions, blankets, towels, clothes. Sizes are assumed: usual ones."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.interiors import parts
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import (
    PALETTES,
    STAINLESS,
    draw_linear,
    metal_material,
    painted_material,
    patterned_material,
)
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Array, Vec3
from gen_data.core.variant_rng import VariantRng

_LINEN = ("#f3f1ec", "#f1f1ef", "#e8e9ea", "#e6e0d6", "#cfd3d5", "#dfe3e3", "#b9c3cb", "#a9aaa9")


def fabric(rng: VariantRng, repeat_m: float = 0.15) -> Material:
    """Plain or patterned cloth."""
    if rng.chance(0.45):
        return parts.cloth(rng)
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


_HEM_M = 0.02
"""Thickness of covers and throws at their hem."""


def rumple(x: Array, y: Array, rng: VariantRng, wave_m: float) -> Array:
    """Height, about 0 with a standard deviation near 1, of soft cloth that lies loosely.

    Bumps of many directions and sizes, bent by one another, with narrow creases between them.
    """
    total = np.zeros(np.broadcast_shapes(x.shape, y.shape))
    bend_x = 0.35 * wave_m * np.sin(2.0 * math.pi * y / (2.3 * wave_m) + rng.between(0.0, 6.3))
    bend_y = 0.35 * wave_m * np.sin(2.0 * math.pi * x / (1.9 * wave_m) + rng.between(0.0, 6.3))
    for k in range(9):
        turn = rng.between(0.0, math.pi)
        wave = wave_m * (1.0, 1.4, 0.8, 0.55, 0.4, 0.7, 0.3, 0.5, 0.24)[k]
        along = (x + bend_x) * math.cos(turn) + (y + bend_y) * math.sin(turn)
        phase = 2.0 * math.pi * along / wave + rng.between(0.0, 6.3)
        # Creases are narrower than the bumps between them.
        total = total + (wave / wave_m) ** 0.8 * (np.abs(np.sin(0.5 * phase)) - 0.64)
    return total


def padding(
    low: Vec3,
    high: Vec3,
    rng: VariantRng,
    slot: int = 0,
    power: float = 5.0,
    crease_m: float = 0.004,
) -> Patch:
    """An upholstered block whose faces bulge: a superellipsoid with creases.

    Args:
        low: Its lower corner.
        high: Its upper corner.
        rng: Draws.
        slot: Material.
        power: Exponent: 2 is an ellipsoid, large ones are boxes.
        crease_m: Size of its creases.
    """
    half = 0.5 * (np.array(high) - np.array(low))
    middle = 0.5 * (np.array(high) + np.array(low))

    def shape(d: Array) -> Array:
        # Spread towards the edges, where a box bends.
        spread = np.sign(d) * np.abs(d) ** 0.6
        size = (np.abs(spread) ** power).sum(axis=2, keepdims=True) ** (1.0 / power)
        points: Array = half * spread / size
        return points

    patch = shapes.ball(shape, 22, 44)
    p = patch.corners_m
    bump = rumple(p[..., 0] + p[..., 2], p[..., 1], rng, 0.24) * crease_m
    inwards = np.abs(p[..., 2] / half[2]) ** 3
    moved = p.copy()
    moved[..., 2] += np.minimum(bump, 0.0) * inwards * np.sign(p[..., 2])
    return replace(patch, corners_m=moved + middle).painted(slot)


def pillow(
    half_x_m: float, half_y_m: float, height_m: float, rng: VariantRng, slot: int = 0
) -> Patch:
    """A filled cover that lies flat on z = 0, with drawn-in sides and creases at its corners."""
    t = np.sin(np.linspace(-0.5 * math.pi, 0.5 * math.pi, 23))
    u, v = t[:, None], t[None, :]
    x = half_x_m * u * (1.0 - 0.07 * (1.0 - v * v) * np.abs(u))
    y = half_y_m * v * (1.0 - 0.07 * (1.0 - u * u) * np.abs(v))
    full = np.clip((1.0 - u * u) * (1.0 - v * v), 0.0, 1.0) ** 0.42
    crease = rumple(x, y, rng, 0.2) * 0.006 * full
    # A head has lain on it.
    dent_x, dent_y = rng.between(-0.3, 0.3) * half_x_m, rng.between(-0.3, 0.3) * half_y_m
    far = np.hypot((x - dent_x) / (0.75 * half_x_m), (y - dent_y) / (0.6 * half_y_m))
    dent = rng.between(0.0, 0.3) * height_m * np.exp(-(far**2))
    high = 0.35 * height_m + (0.65 * height_m - dent) * full + crease - 0.012 * full
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


def drape(
    ends_x: tuple[float, float],
    half_y: float,
    z: float,
    hang_m: float,
    rng: VariantRng,
    slot: int,
    crease_m: float = 0.016,
) -> Patch:
    """A cover over a mattress, starting near the head end; it hangs over both sides and the foot.

    Args:
        ends_x: X of its beginning and end.
        half_y: Half of the mattress's width.
        z: Height of the mattress.
        hang_m: Length that hangs down at the sides of the mattress.
        rng: Draws.
        slot: Material.
        crease_m: Size of its folds.
    """
    x0, x1 = ends_x
    rows, columns = max(14, round((x1 - x0) / 0.027)), 84
    s = np.linspace(x0, x1 + 0.06, rows)[:, None]
    uneven = [hang_m * rng.between(0.75, 1.2) for _ in range(2)]
    t = np.linspace(-half_y - uneven[0], half_y + uneven[1], columns)[None, :]
    # Hems are not straight: cloth is drawn up here and there.
    drawn = 1.0 + 0.05 * np.sin(5.0 * s + rng.between(0.0, 6.3)) + 0.03 * np.sin(13.0 * s)
    t = np.where(np.abs(t) > half_y, np.sign(t) * (half_y + (np.abs(t) - half_y) * drawn), t)
    y, down = _over_edge(t, half_y, 0.05)
    x, fall = _over_edge(s - x0, x1 - x0 - 0.02, 0.05)
    lift = rumple(s, t, rng, 0.42) * crease_m
    lift = lift - min(float(lift.min()), 0.0)
    flat = np.clip((s - x0) / 0.25, 0.25, 1.0)
    lift = lift * flat
    swell = 0.03 * np.minimum(np.abs(half_y - np.abs(t)) / 0.2, 1.0) * (np.abs(t) < half_y)
    # Folds of the hanging part run downwards and push it outwards.
    hung = np.clip(-down / 0.12, 0.0, 1.0)
    pleat = 0.012 * (1.0 + np.sin(2.0 * math.pi * s / 0.19 + 2.0 * np.sin(3.0 * s) + np.sign(t)))
    out = np.sign(t) * hung * (0.4 * lift + pleat)
    skew = rng.between(-0.02, 0.02) * (s - x0)
    axes = np.broadcast_arrays(
        x0 + x, y + out + skew, z + down + fall + (lift + swell) * (1.0 - 0.7 * hung)
    )
    points = np.stack(axes, axis=2)
    # The under side, nearer to the mattress; both meet at a round hem.
    coordinates = np.broadcast_arrays(0.0 * s, -np.sign(t) * hung * _HEM_M, (hung - 1.0) * _HEM_M)
    inward = np.stack(coordinates, axis=2)
    under = points + inward
    rim = [
        np.stack([points[0], under[0]]),
        np.stack([under[-1], points[-1]]),
        np.stack([under[:, 0], points[:, 0]]),
        np.stack([points[:, -1], under[:, -1]]),
    ]
    return join_patches(
        [
            shapes.grid(points, slot=slot).flipped(),
            shapes.grid(under, slot=slot),
            *(shapes.grid(edge, slot=slot) for edge in rim),
        ]
    )


def bed(rng: VariantRng) -> Solid:
    """A bed of 0.9 to 1.8 m, made; its head at -X. Slots: frame, mattress, duvet, pillows."""
    w = rng.turn((0.9, 1.4, 1.6, 1.8), "width_m")
    length, top = 2.0, rng.between(0.42, 0.52, "top_m")
    x0, x1, y0, y1 = -0.5 * length - 0.06, 0.5 * length + 0.04, -0.5 * w - 0.04, 0.5 * w + 0.04
    rail = rng.between(0.24, 0.32, "rail_m")
    head: parts.Box = ((x0, y0, 0.0), (x0 + 0.05, y1, rng.between(0.8, 1.15)))
    sides: list[parts.Box] = [
        ((x0 + 0.05, y0, 0.12), (x1, y0 + 0.03, rail)),
        ((x0 + 0.05, y1 - 0.03, 0.12), (x1, y1, rail)),
        ((x1 - 0.03, y0 + 0.03, 0.12), (x1, y1 - 0.03, rail)),
    ]
    soft_head = rng.chance(0.4, "soft_head")
    patches: list[Patch] = [
        parts.cushion(*head, 4, 0.03) if soft_head else parts.board(*head, 0, 0.006)
    ]
    patches += [*(parts.board(*b) for b in sides), *parts.four_legs(x1 - x0, y1 - y0, 0.2, 0.06, 0)]
    mattress: parts.Box = ((-0.5 * length, -0.5 * w, 0.14), (0.5 * length, 0.5 * w, top))
    patches.append(parts.cushion(*mattress, 1, 0.05))
    fold, hang = rng.between(0.5, 0.75, "fold_m"), rng.between(0.16, 0.26, "hang_m")
    start = -0.5 * length + fold
    patches.append(drape((start, 0.5 * length), 0.5 * w, top + 0.02, hang, rng, 2))
    back = drape(
        (start - 0.03, start + 0.24), 0.5 * w + 0.012, top + 0.085, 0.8 * hang, rng, 1, 0.006
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
        throw = drape((throw_at, throw_at + 0.55), 0.5 * w + 0.035, top + 0.11, hang, rng, 5, 0.007)
        patches.append(throw)
    linen = painted_material(rng.choose(_LINEN), 0.95)
    looks = [parts.front(rng), linen, fabric(rng), linen, fabric(rng), fabric(rng)]
    return parts.solid(patches, looks, [head, mattress])


def cushion_pillow(rng: VariantRng) -> Solid:
    """A cushion that lies flat. Slot: cloth."""
    s, h = rng.between(0.19, 0.25), rng.between(0.12, 0.16, "height_m")
    body: parts.Box = ((-0.8 * s, -0.8 * s, 0.0), (0.8 * s, 0.8 * s, h))
    return parts.solid([pillow(s, s, h, rng)], [fabric(rng)], [body])


def blanket(rng: VariantRng) -> Solid:
    """A folded blanket. Slot: cloth."""
    x = 0.5 * rng.between(0.32, 0.44, "depth_m")
    y = 0.5 * rng.between(0.4, 0.6, "width_m")
    layers = rng.whole(2, 5, "layers")
    return _folded(rng, [(x, y, rng.between(0.022, 0.035))] * layers, [fabric(rng)])


def towel_stack(rng: VariantRng) -> Solid:
    """Folded towels on each other. Slots: cloths."""
    x = 0.5 * rng.between(0.22, 0.3, "depth_m")
    y = 0.5 * rng.between(0.3, 0.4, "width_m")
    count = rng.whole(2, 7, "count")
    sizes = [(x * rng.between(0.93, 1.0), y * rng.between(0.93, 1.0), 0.045)] * count
    return _folded(rng, sizes, [parts.cloth(rng), parts.cloth(rng)])


def folded_clothes(rng: VariantRng) -> Solid:
    """Folded jumpers and shirts on each other. Slots: cloths."""
    sizes = [
        (rng.between(0.13, 0.16), rng.between(0.12, 0.16), rng.between(0.025, 0.05))
        for _ in range(rng.whole(1, 6, "count"))
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
        layer = parts.cushion((-x, -y, 0.0), (x, y, t), k % len(looks), 0.45 * t)
        patches.append(layer.rotated("z", rng.between(-0.05, 0.05)).moved(dx, dy, z))
        z += 0.97 * t
    x, y = max(s[0] for s in sizes_m), max(s[1] for s in sizes_m)
    return parts.solid(patches, looks, [((-x, -y, 0.0), (x, y, z))])


def clothes_pile(rng: VariantRng) -> Solid:
    """Clothes that were dropped. Slots: cloths."""
    patches: list[Patch] = []
    reach, top = 0.0, 0.0
    for k in range(rng.turn((2, 3), "count")):
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
    boxes = [((-0.5 * reach, -0.5 * reach, 0.0), (0.5 * reach, 0.5 * reach, top))]
    return parts.solid(patches, looks, boxes)


def laundry_basket(rng: VariantRng) -> Solid:
    """A basket with clothes in it. Slots: basket, clothes."""
    r, h = rng.between(0.19, 0.24, "radius_m"), rng.between(0.38, 0.55, "height_m")
    profile = [(0.0, 0.0), (0.85 * r, 0.0), (r, h), (r - 0.012, h), (0.84 * r, 0.02), (0.0, 0.02)]
    wall = shapes.lathe(profile, 28)
    ring = np.linspace(0.0, 1.0, 20)[:, None]
    turn = np.linspace(0.0, 2.0 * math.pi, 61)[None, :]
    x, y = 0.96 * r * ring * np.cos(turn), 0.96 * r * ring * np.sin(turn)
    z = 0.86 * h + 0.06 * (1.0 - ring**2) + 0.016 * rumple(x, y, rng, 0.17) * (1.0 - ring**6)
    z[:, -1] = z[:, 0]
    heap = shapes.grid(np.stack(np.broadcast_arrays(x, y, z), axis=2)).flipped()
    # Several garments: regions that bend about each other.
    middle = heap.corners_m.mean(axis=1)
    bent = np.arctan2(middle[:, 1], middle[:, 0]) + 9.0 * np.hypot(middle[:, 0], middle[:, 1])
    heap = replace(heap, slots=1 + np.floor((bent % (2.0 * math.pi)) / 2.1).astype(np.int64) % 3)
    look = patterned_material(f"texture/fabric?seed={int(rng.between(0, 16))}", 0.12, 0.9)
    shell = look if rng.chance(0.5) else painted_material(rng.choose(("#f0efeb", "#8a8d90")), 0.5)
    looks = [shell, painted_material(rng.choose(_LINEN), 0.95), fabric(rng, 0.3), fabric(rng, 0.3)]
    return parts.solid([wall, heap], looks, [((-0.8 * r, -0.8 * r, 0.0), (0.8 * r, 0.8 * r, h))])


def coat_hooks(rng: VariantRng) -> Solid:
    """Hooks on a board with coats and a bag; origin at its lowest point, on the wall.

    Slots: board, hooks, coats.
    """
    count = rng.turn((3, 4, 5), "hooks")
    w, drop = 0.17 * count, 1.05
    patches: list[Patch] = [parts.board((0.0, -0.5 * w, drop), (0.02, 0.5 * w, drop + 0.09))]
    lowest = drop
    for k in range(count):
        y = (k + 0.5) * 0.17 - 0.5 * w
        patches.append(parts.rod((0.02, y, drop + 0.05), (0.075, y, drop + 0.065), 0.007, 1))
        if rng.chance(0.72):
            length = rng.between(0.6, 1.0)
            lowest = min(lowest, drop - length + 0.05)
            coat = hang_garment(rng, length, 2 + k % 3).rotated("z", rng.between(-0.15, 0.15))
            patches.append(coat.moved(0.06, y, drop + 0.05))
    looks = [parts.front(rng), metal_material(STAINLESS, 0.3), *(wool(rng) for _ in range(3))]
    moved = [patch.moved(0.0, 0.0, -lowest) for patch in patches]
    top = drop + 0.09 - lowest
    return parts.solid(moved, looks, [((0.0, -0.5 * w, 0.0), (0.16, 0.5 * w, top))])


def wool(rng: VariantRng) -> Material:
    """Plain cloth of coats."""
    dark = ("#2b2f36", "#3d2f28", "#5b6157", "#1f2a3c", "#7a2f33", "#8b7558", "#46505e", "#6b705c")
    return Material(draw_linear(dark, 0.15, rng), 0.95)


def hang_garment(rng: VariantRng, length_m: float, slot: int, *, thin: bool = False) -> Patch:
    """A coat or shirt that hangs from its collar at the origin, with two sleeves; wide along Y.

    Args:
        rng: Draws.
        length_m: From collar to hem.
        slot: Material.
        thin: Whether it hangs among others, pressed flat.
    """
    s = np.linspace(0.0, 1.0, 12 if thin else 26)[:, None]
    turn = np.linspace(0.0, 2.0 * math.pi, 41 if thin else 65)[None, :]
    shoulder = rng.between(0.17, 0.2) if thin else rng.between(0.14, 0.17)
    slope = np.clip(s / 0.14, 0.0, 1.0)
    wide = 0.045 + (shoulder - 0.045) * np.sin(0.5 * math.pi * slope) + 0.035 * s
    deep = (0.015 if thin else 0.035) + (0.006 if thin else 0.03) * slope
    # Folds run down and open towards the hem; each garment has its own.
    wave = np.zeros(np.broadcast_shapes(s.shape, turn.shape))
    for number in (3, 5, 8, 11):
        start = rng.between(0.0, 6.3)
        sway = rng.between(-1.2, 1.2) * s
        wave = wave + np.sin(number * turn + start + sway) / number**0.6
    amount = (0.1 if thin else 0.2) * np.clip((s - 0.06) / 0.5, 0.0, 1.0)
    x = deep * np.cos(turn) * (1.0 + 1.4 * amount * wave)
    y = wide * np.sin(turn) * (1.0 + 0.35 * amount * wave)
    if not thin:
        x = np.maximum(x + 0.012, -0.04)
    hem = 1.0 + 0.02 * np.sin(2.0 * turn + rng.between(0.0, 6.3))
    points = np.stack(np.broadcast_arrays(x, y, -length_m * s * hem), axis=2)
    points[:, -1] = points[:, 0]
    body = shapes.grid(points, slot=slot).flipped()
    patches = [body]
    if not thin:
        patches.append(shapes.grid(points * np.array([0.93, 0.97, 1.0]), slot=slot))
    count, sides = (9, 8) if thin else (30, 14)
    arm, deep_m = min(0.62, 0.85 * length_m), 0.02 if thin else 0.045
    for sy in (-1, 1):
        way = rng.between(-0.02, 0.02)
        path = [
            (0.0, sy * 0.8 * shoulder, -0.05),
            (0.008, sy * (shoulder + 0.022), -0.12),
            (0.02 + way, sy * (shoulder + 0.045), -0.3 * arm - 0.08),
            (0.03 + 2 * way, sy * (shoulder + 0.03), -0.65 * arm - 0.06),
            (0.045 + 3 * way, sy * (shoulder + 0.01), -arm - 0.04),
        ]
        line = shapes.spline(path, count)
        t = np.linspace(0.0, 1.0, count)
        # Sleeves are flat tubes with creases at the elbow.
        crease = 1.0 + 0.1 * np.sin(34.0 * t + rng.between(0.0, 6.3)) * np.exp(
            -(((t - 0.5) / 0.2) ** 2)
        )
        size = np.stack([deep_m * crease, 0.05 * (1.0 - 0.25 * t) * crease], axis=1)
        tube = shapes.sweep(
            line, shapes.circle(1.0, sides), up=(1.0, 0.0, 0.0), scale=size, slot=slot
        )
        patches.append(tube)
    if not thin:
        ring = np.linspace(0.0, 2.0 * math.pi, 19)
        collar = np.stack(
            [0.03 * np.cos(ring) + 0.012, 0.06 * np.sin(ring), 0.012 * np.cos(ring)], axis=1
        )
        roll = shapes.sweep(
            collar, shapes.circle(0.013, 8), up=(0.0, 0.0, 1.0), capped=False, slot=slot
        )
        # Lapels: the open edge of the front.
        edge = np.array(
            [(0.045, 0.0, -0.02), (0.068, 0.012, -0.3 * length_m), (0.074, 0.016, -0.98 * length_m)]
        )
        lapel = shapes.sweep(
            shapes.spline(edge.tolist(), 14), shapes.circle(0.007, 6), up=(1.0, 0.0, 0.0), slot=slot
        )
        patches += [roll, lapel]
    return join_patches(patches)


def draped_clothes(rng: VariantRng) -> Solid:
    """A jacket, shirt or blanket over the back of a chair; origin at the back's upper edge.

    Slot: cloth.
    """
    if rng.seed % 4 == 3:
        wide = rng.between(0.34, 0.44, "width_m")
        loop = _over_rail(
            rng, wide, rng.between(0.25, 0.36, "front_m"), rng.between(0.3, 0.5, "back_m"), 0.047
        )
        patches = [loop.moved(0.0, rng.between(-0.03, 0.03), 0.002)]
    else:
        patches = _jacket(rng)
    leaned = [patch.rotated("y", -LEAN_RAD) for patch in patches]
    low = np.min([p.bounds_m()[0] for p in leaned], axis=0).tolist()
    high = np.max([p.bounds_m()[1] for p in leaned], axis=0).tolist()
    look = fabric(rng, 0.3) if rng.chance(0.5) else wool(rng)
    box: parts.Box = ((low[0], low[1], -0.02), (high[0], high[1], high[2]))
    return parts.solid(leaned, [look], [box])


LEAN_RAD = 0.14
"""Lean of the backs of chairs."""


def _jacket(rng: VariantRng) -> list[Patch]:
    """A jacket around an upright back along Y, open below, its front shorter than its back."""
    back, short = rng.between(0.42, 0.6, "back_m"), rng.between(0.28, 0.36, "short_m")
    s = np.linspace(0.0, 1.0, 24)[:, None]
    turn = np.linspace(0.0, 2.0 * math.pi, 65)[None, :]
    c, sn = np.cos(turn), np.sin(turn)
    fall = short + (back - short) * (0.5 - 0.5 * c) ** 1.5
    slope = np.sin(0.5 * math.pi * np.clip(s / 0.12, 0.0, 1.0))
    half = 0.13 + 0.115 * slope + 0.03 * s
    deep = 0.012 + 0.04 * slope + 0.012 * s
    wave = np.zeros(np.broadcast_shapes(s.shape, turn.shape))
    for number in (3, 5, 7, 11):
        sway = rng.between(-1.5, 1.5) * s
        wave = wave + np.sin(number * turn + rng.between(0.0, 6.3) + sway) / number**0.6
    fold = 0.011 * np.clip((s - 0.05) / 0.4, 0.0, 1.0) * (wave + 1.0)
    # A flat ring: the back of the chair is broad.
    flat = np.sign(c) * np.abs(c) ** 0.55
    x = flat * (deep + np.maximum(fold, 0.0))
    y = np.sign(sn) * np.abs(sn) ** 0.55 * half + sn * np.maximum(fold, 0.0)
    z = 0.035 - 0.085 * (np.abs(y) / 0.27) ** 2.2 * (1.0 - s) ** 0.5 - fall * s
    points = np.stack(np.broadcast_arrays(x, y, z), axis=2)
    points[:, -1] = points[:, 0]
    points[0, :, 0] *= 0.2
    outer = shapes.grid(points).flipped()
    patches = [outer, shapes.grid(points * np.array([0.93, 0.985, 1.0]))]
    side = [(0.03, -0.06, 0.012), (-0.004, -0.07, 0.036), (-0.026, -0.035, 0.05)]
    collar = [*side, (-0.03, 0.0, 0.053), *((a, -b, c) for a, b, c in side[::-1])]
    line = shapes.spline(collar, 25)
    width = np.sin(np.linspace(0.12, math.pi - 0.12, 25)) ** 0.5
    flat = np.stack([0.009 + 0.0 * width, 0.032 * width], axis=1)
    patches.append(shapes.sweep(line, shapes.circle(1.0, 12), up=(1.0, 0.0, 0.2), scale=flat))
    for sy in (-1, 1):
        way = rng.between(-0.025, 0.01)
        arm = rng.between(0.42, 0.54)
        path = [
            (0.0, sy * 0.17, -0.075),
            (0.3 * way, sy * 0.235, -0.1),
            (way, sy * 0.272, -0.19),
            (1.5 * way, sy * 0.285, -0.32),
            (2.2 * way, sy * 0.28, -arm),
        ]
        t = np.linspace(0.0, 1.0, 26)
        crease = 1.0 + 0.12 * np.sin(36.0 * t) * np.exp(-(((t - 0.5) / 0.25) ** 2))
        size = np.stack([0.055 * (1.0 - 0.2 * t) * crease, 0.028 * crease], axis=1)
        patch = shapes.sweep(
            shapes.spline(path, 26), shapes.circle(1.0, 14), up=(1.0, 0.0, 0.0), scale=size
        )
        patches.append(patch)
    return patches


def towel(rng: VariantRng) -> Solid:
    """A towel over a rail; origin at the middle below, on the wall. Slots: cloth, rail."""
    w, h = rng.between(0.35, 0.5, "width_m"), rng.between(0.4, 0.65, "height_m")
    rail_x, rail_z, radius = 0.062, h - 0.016, 0.009
    patches = [
        _over_rail(rng, w, rail_z, rail_z * rng.between(0.55, 0.95)).moved(rail_x, 0, rail_z)
    ]
    half = 0.5 * w + 0.06
    patches.append(parts.rod((rail_x, -half, rail_z), (rail_x, half, rail_z), radius, 1))
    for sy in (-1, 1):
        y = sy * (half - 0.01)
        patches.append(parts.rod((0.0, y, rail_z), (rail_x + 0.004, y, rail_z), radius, 1))
    boxes: list[parts.Box] = [((0.0, -half, 0.0), (0.1, half, h))]
    return parts.solid(patches, [fabric(rng), metal_material(STAINLESS, 0.2)], boxes)


def _over_rail(
    rng: VariantRng, w: float, front_m: float, back_m: float, radius_m: float = 0.0095
) -> Patch:
    """Thick cloth over a rail along Y through the origin, with folds that open downwards."""
    bend = np.linspace(0.0, math.pi, 9)
    levels = np.linspace(1.0, 0.0, 12, endpoint=False)
    y = np.linspace(-0.5 * w, 0.5 * w, 49)[None, :]
    waves = 2.0 * math.pi * rng.between(3.0, 5.0) / w
    wave = np.sin(waves * y + rng.between(0.0, 6.3)) + 0.5 * np.sin(
        0.47 * waves * y + rng.between(0.0, 6.3)
    )
    depth = rng.between(0.003, 0.009, "fold_depth_m")
    # One corner hangs lower than the other.
    tilt = rng.between(-0.06, 0.06) * y

    def sheet(radius: float) -> Array:
        """Points over the rail, from the front's hem to the back's."""
        x = np.concatenate([np.full(12, radius), radius * np.cos(bend), np.full(12, -radius)])
        z = np.concatenate([-front_m * levels, radius * np.sin(bend), -back_m * levels[::-1]])
        fall = np.clip(-z / front_m, 0.0, 1.0)[:, None]
        axes = np.broadcast_arrays(
            x[:, None] + depth * fall * wave, y, z[:, None] + fall * tilt * np.sign(x)[:, None]
        )
        return np.stack(axes, axis=2)

    outer, inner = sheet(radius_m + 0.0065), sheet(radius_m)
    loop = np.concatenate([outer, inner[::-1], outer[:1]])
    sides = [np.stack([outer[:, k], inner[:, k]]) for k in (0, -1)]
    return join_patches([shapes.grid(loop), shapes.grid(sides[0]).flipped(), shapes.grid(sides[1])])


def bath_mat(rng: VariantRng) -> Solid:
    """A mat of tufted cloth. Slot: pile."""
    x = 0.5 * rng.between(0.44, 0.56, "depth_m")
    y = 0.5 * rng.between(0.64, 0.84, "width_m")
    t = 0.016
    pile = Material(draw_linear(PALETTES["cloth"], 0.1, rng), 1.0)
    look = patterned_material(f"texture/carpet?seed={int(rng.between(0, 16))}", 0.5, 1.0)
    body: parts.Box = ((-x, -y, 0.0), (x, y, t))
    patches = [parts.cushion(*body, 0, 0.007)]
    return parts.solid(patches, [look if rng.chance(0.4) else pile], [body])


def drying_rack(rng: VariantRng) -> Solid:
    """A rack with laundry that dries. Slots: rods, cloths."""
    w, d, h = rng.between(0.95, 1.2, "width_m"), 0.5, rng.between(0.85, 0.95, "height_m")
    patches: list[Patch] = []
    for sy in (-1, 1):
        y = sy * 0.5 * w
        patches += [
            parts.rod((-0.5 * d, y, 0.0), (0.38 * d, y, h), 0.009),
            parts.rod((0.5 * d, y, 0.0), (-0.38 * d, y, h), 0.009),
            parts.rod((-0.55 * d, y, h), (0.55 * d, y, h), 0.008),
        ]
    for k in range(7):
        x = (k / 6 - 0.5) * 1.1 * d
        patches.append(parts.rod((x, -0.5 * w, h), (x, 0.5 * w, h), 0.004, 0, 6))
        if k % 2 == 0 and rng.chance(0.85):
            patches.append(_hung(rng, x, w, h, 1 + k // 2 % 3))
    looks = [painted_material("#e6e6e3", 0.4), *(fabric(rng) for _ in range(3))]
    return parts.solid(patches, looks, [((-0.5 * d, -0.5 * w, 0.0), (0.5 * d, 0.5 * w, h))])


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
