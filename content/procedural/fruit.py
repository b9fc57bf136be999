"""Fruit: spheres pressed, pulled and bent into shape, whole or cut, with stalks and leaves.

Round fruit are rows of ``fruits.yaml``.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import (
    draw_linear,
    hex_to_linear,
    printed_material,
)
from gen_data.content.procedural.patches import (
    Array,
    Patch,
    centre_m,
    join_patches,
    make_centred_solid,
    rotate,
)
from gen_data.content.procedural.surface_shapes import Point2
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

_STALK = Material(hex_to_linear("#5a4329"), 0.8, printed=True)
_GREENS = ("#4f7a2c", "#3f6a2a", "#6b8a36")


@dataclass(frozen=True, slots=True)
class FruitStyle:
    """Ranges of the shape of one kind of round fruit; depths are shares of the radius.

    Attributes:
        slim: Half the height divided by the radius.
        dent_top, dent_low: Depths of the hollows of stalk and blossom.
        dent_width: Their width: 0.02 narrow, 0.14 wide.
        taper: Relative narrowing towards the bottom.
        tip_top, tip_low: Elongation of the ends.
        lobes, lobe_depth: Number and depth of furrows from end to end.
        cleft: Depth of a single furrow.
        lumps: Depth of irregular swellings.
        skin: Texture: a separate family, or a kind of ``fruit_skin``.
        skin_first: Seed of the texture of the first variant.
        stalk: ``twig``, ``button``, ``calyx``, ``stump``, ``crown`` or empty.
        leaf: Probability of a leaf.
        cut: Kind of ``fruit_cut`` of a cut fruit; empty = whole.
        thick_m: Thickness of a slice [m]; 0 = a half.
        lying: Whether it rests on its side, along X.
    """

    radius_m: Point2
    slim: Point2
    lumps: float
    skin: str
    roughness: Point2
    dent_top: Point2 = (0.0, 0.0)
    dent_low: Point2 = (0.0, 0.0)
    dent_width: float = 0.09
    taper: Point2 = (0.0, 0.0)
    tip_top: Point2 = (0.0, 0.0)
    tip_low: Point2 = (0.0, 0.0)
    lobes: int = 0
    lobe_depth: float = 0.0
    cleft: float = 0.0
    skin_first: int = 0
    stalk: str = ""
    leaf: float = 0.0
    cut: str = ""
    thick_m: Point2 = (0.0, 0.0)
    lying: bool = False


STYLES: Mapping[str, FruitStyle] = load_table(__package__, "fruits", FruitStyle)
_OWN_SKINS = ("apple_skin", "citrus_peel")


def fruit_kind(group: str, seed: int) -> str:
    """Key in ``fruits.yaml`` of a variant of a group."""
    kinds = [name.partition("/")[2] for name in STYLES if name.startswith(f"{group}/")]
    return f"{group}/{variant_rng(group, seed).turn(kinds, 'kind')}"


def round_fruit_facts(group: str, seed: int) -> Facts:
    """Kind, such as mandarin, or whether it is cut."""
    return Facts(fruit_kind(group, seed).partition("/")[2])


def round_fruit(group: str, seed: int) -> Solid:
    """A fruit of a group, whole, halved or a slice. Slots: skin, then flesh, stalk, leaf."""
    rng, style = variant_rng(group, seed), STYLES[fruit_kind(group, seed)]
    shape, top = _draw_shape(style, rng)
    skin = f"texture/fruit_skin?kind={style.skin}&seed={seed}"
    if style.skin in _OWN_SKINS:
        skin = f"texture/{style.skin}?seed={style.skin_first + seed}"
    materials = [printed_material(skin, rng.between(*style.roughness))]
    if style.cut:
        patches = _cut(shape, rng.between(*style.thick_m) if style.thick_m[1] else 0.0)
        flesh = f"texture/fruit_cut?kind={style.cut}&seed={seed}"
        materials.append(printed_material(flesh, 0.3))
        parts = [hulls.extreme(patches[0].corners_m)]
    else:
        patches = [shapes.ball(shape, 26, 36)]
        # Of a long fruit, most even directions would end at its tips.
        stretch = np.array([1.0, 1.0, max(1.0, 0.5 * style.slim[0])])
        parts = [hulls.extreme(patches[0].corners_m / stretch) * stretch]
    radius = style.radius_m[0]
    if style.stalk:
        stalk, material = _STALKS[style.stalk](top, radius, rng)
        patches.append(stalk.painted(len(materials)))
        materials.append(material)
        parts.append(hulls.extreme(stalk.corners_m, 24))
    if rng.chance(style.leaf):
        blade = _leaf(radius * rng.between(1.1, 1.6), rng)
        blade = blade.rotated("z", rng.between(0.0, 6.28)).moved(z=top)
        patches.append(blade.painted(len(materials)))
        materials.append(Material(draw_linear(_GREENS, 0.15, rng), 0.5, printed=True))
        parts.append(hulls.extreme(blade.corners_m, 24))
    if style.lying:
        patches = [patch.rotated("y", 0.5 * math.pi) for patch in patches]
        parts = [part[:, [2, 1, 0]] * np.array([1.0, 1.0, -1.0]) for part in parts]
    return make_centred_solid(patches, materials, parts)


def _draw_shape(style: FruitStyle, rng: VariantRng) -> tuple[Callable[[Array], Array], float]:
    """Mapping of directions to points [m], and the height of the stalk's foot [m]."""
    radius = rng.between(*style.radius_m, "radius_m")
    slim = rng.between(*style.slim, "slim")
    top, low = rng.between(*style.dent_top), rng.between(*style.dent_low)
    taper = rng.between(*style.taper)
    tips = rng.between(*style.tip_top), rng.between(*style.tip_low)
    lumps = _lumps(5, style.lumps, rng)
    phase, lean = rng.between(0.0, 6.28), rng.between(-0.05, 0.05)
    furrow = style.lobe_depth * rng.between(0.6, 1.2)

    def shape(d: Array) -> Array:
        z = d[..., 2]
        turn = np.arctan2(d[..., 1], d[..., 0])
        flank = 1 - z**2
        dent = top * np.exp(-((1 - z) / style.dent_width))
        dent = dent + low * np.exp(-((1 + z) / style.dent_width))
        wave = np.abs(np.cos(0.5 * style.lobes * turn + phase)) if style.lobes else 1.0
        # Furrows reach furthest into the lower half.
        ridges = furrow * (1.0 - wave) * np.sqrt(np.maximum(flank, 0.0)) * (1.0 - 0.4 * z)
        cleft = style.cleft * np.exp(-((turn / 0.22) ** 2)) * np.sqrt(np.maximum(flank, 0.0))
        r = radius * (1 - dent - ridges - cleft + lumps(d) * flank) * (1.0 + taper * z)
        drawn = tips[0] * np.exp(-((1 - z) / 0.05)) + tips[1] * np.exp(-((1 + z) / 0.04))
        up = slim * (r * z + radius * drawn * np.sign(z))
        return np.stack([r * d[..., 0] + lean * up, r * d[..., 1], up], axis=2)

    peak = shape(np.array([[[0.0, 0.0, 1.0]]]))[0, 0]
    return shape, float(peak[2])


def _cut(shape: Callable[[Array], Array], thick_m: float) -> list[Patch]:
    """The lower half or a slice below the middle; on a cut v runs from the rim to the middle.

    Args:
        shape: Mapping of directions to points [m].
        thick_m: Thickness of the slice [m]; 0 = a half.
    """
    rings, segments = 14, 40
    depth = _polar_of(shape, thick_m) if thick_m else 0.5 * math.pi
    polar = depth * (np.arange(rings + 1) / rings - 1.0)
    turn = 2.0 * math.pi * np.arange(segments) / segments - math.pi
    turn = np.concatenate([turn, turn[:1]])
    radius = np.cos(polar)
    if not thick_m:
        radius[0] = 0.0
    x, y = radius[:, None] * np.cos(turn), radius[:, None] * np.sin(turn)
    d = np.stack(np.broadcast_arrays(x, y, np.sin(polar)[:, None]), axis=2)
    skin = shape(d)
    lowest = 0.5 - depth / math.pi
    inward = 1.0 - _FACE_SHARES
    patches = [
        shapes.grid(skin, v=np.linspace(lowest, 0.5, rings + 1)),
        shapes.grid(_face(skin[-1]), v=inward, slot=1),
    ]
    if thick_m:
        patches.append(shapes.grid(_face(skin[0])[::-1], v=inward[::-1], slot=1))
    return patches


_FACE_SHARES = np.array([1.0, 0.9, 0.7, 0.45, 0.2, 0.0])


def _face(rim: Array) -> Array:
    """Points of the cut inside a rim [n, 3], from the rim to the middle [6, n, 3]."""
    middle = np.array([0.0, 0.0, float(rim[:, 2].mean())])
    points: Array = middle + _FACE_SHARES[:, None, None] * (rim - middle)[None]
    return points


def _polar_of(shape: Callable[[Array], Array], depth_m: float) -> float:
    """Angle below the horizon [rad] at which a fruit is this far below its middle."""
    polar = np.linspace(0.0, 1.2, 97)
    points = shape(np.stack([np.cos(polar), np.zeros(97), -np.sin(polar)], axis=1)[None])[0]
    return float(np.interp(depth_m, points[0, 2] - points[:, 2], polar))


Stalk = tuple[Patch, Material]


def _twig(top: float, radius: float, rng: VariantRng) -> Stalk:
    return _stalk((0.0, 0.0, top - 0.002), rng.between(0.3, 0.6) * radius, 0.0013, rng), _STALK


def _button(top: float, _: float, rng: VariantRng) -> Stalk:
    """The scar of a stalk."""
    button = shapes.ball(lambda d: 0.0035 * d * np.array([1.0, 1.0, 0.4]), 6, 10)
    green = Material(draw_linear(("#6d7a3a", "#8a7a4a"), 0.1, rng), 0.8, printed=True)
    return button.moved(z=top), green


def _calyx(top: float, radius: float, rng: VariantRng) -> Stalk:
    """Five to seven narrow sepals and a short stalk."""
    count, size = rng.choose((5, 6, 7), "count"), radius * rng.between(0.55, 0.8)
    blades = [_twig(top, 0.6 * radius, rng)[0]]
    for i in range(count):
        blade = _blade(size, 0.16, 0.1, -rng.between(0.0, 0.35))
        turn = 2 * math.pi * i / count + rng.between(-0.2, 0.2)
        blades.append(blade.rotated("z", turn).moved(z=top + 0.0012))
    green = Material(draw_linear(_GREENS, 0.1, rng), 0.7, printed=True)
    return join_patches(blades), green


def _stump(top: float, radius: float, rng: VariantRng) -> Stalk:
    """A thick, bent, ribbed stalk on a green plate."""
    size = 0.2 * radius
    bend = [
        (0.0, 0.0, top - 0.003),
        (0.0, 0.0, top + size),
        (rng.between(-1, 1) * size, 0.0, top + 3.2 * size),
    ]
    path = shapes.space_evenly(shapes.spline(bend, 24), 7)
    scale = np.array([1.9, 1.25, 0.9, 0.8, 0.8, 0.85, 1.0])
    stalk = shapes.sweep(path, shapes.circle(0.62 * size, 9), up=(1.0, 0.0, 0.0), scale=scale)
    return stalk, Material(draw_linear(_GREENS, 0.1, rng), 0.6, printed=True)


def _crown(top: float, radius: float, rng: VariantRng) -> Stalk:
    """Six pointed sepals around a hollow, as on pomegranates."""
    size = radius * rng.between(0.3, 0.42)
    blades = []
    for i in range(6):
        blade = _blade(size, 0.55, 0.14, 0.0).rotated("y", -rng.between(1.05, 1.4))
        blade = blade.moved(x=0.4 * size, z=top - 0.1 * size)
        blades.append(blade.rotated("z", math.pi * i / 3 + rng.between(-0.1, 0.1)))
    return join_patches(blades), Material(draw_linear(("#b0522f", "#a83a2a"), 0.1, rng), 0.6,
                                          printed=True)  # fmt: skip


_STALKS: Mapping[str, Callable[[float, float, VariantRng], Stalk]] = {
    "twig": _twig,
    "button": _button,
    "calyx": _calyx,
    "stump": _stump,
    "crown": _crown,
}


def _leaf(size: float, rng: VariantRng) -> Patch:
    return _blade(size, 0.42, 0.02, rng.between(-0.25, 0.25)).rotated("y", -rng.between(0.1, 0.7))


def _blade(length: float, width: float, thick: float, droop: float) -> Patch:
    """A pointed leaf along +X from the origin; width, thickness and droop are shares of it."""

    def shape(d: Array) -> Array:
        t = 0.5 * (1.0 + d[..., 0])
        wide = 0.5 * width * np.sign(d[..., 1]) * np.abs(d[..., 1]) ** 1.4
        lift = droop * t**2 + 0.1 * width * np.abs(d[..., 1]) + 0.5 * thick * d[..., 2]
        return length * np.stack([t, wide * (1.2 - 0.4 * t), lift], axis=2)

    return shapes.ball(shape, 6, 12)


def pear(rng: VariantRng) -> Solid:
    """A pear standing upright. Slots: skin, stalk."""
    radius, height = rng.between(0.028, 0.037, "radius_m"), rng.between(0.078, 0.108, "height_m")
    neck, lean = rng.between(0.36, 0.6), rng.between(-0.009, 0.009)
    lumps = _lumps(4, 0.05, rng)

    def shape(d: Array) -> Array:
        z = d[..., 2]
        t = 0.5 + 0.5 * z
        body = 1.0 - (1.0 - neck) * t**1.5 * (1.0 + 0.35 * np.sin(math.pi * t))
        flank = np.sqrt(np.maximum(1 - z**2, 0.0)) ** 0.85
        unit = d[..., :2] / np.maximum(np.sqrt(1 - z**2), 1e-9)[..., None]
        r = radius * flank * body * (1 + lumps(d)) * 1.12
        dent = 0.1 * np.exp(-((1 + z) / 0.06))
        up = 0.5 * height * (z + dent)
        return np.stack([r * unit[..., 0] + lean * t**2, r * unit[..., 1], up], axis=2)

    skin = printed_material(f"texture/pear_skin?seed={rng.seed}", rng.between(0.35, 0.5))
    body = shapes.ball(shape, 24, 28)
    stalk = _stalk(
        (lean, 0.0, 0.5 * height - 0.002), rng.between(0.014, 0.022, "length_m"), 0.0014, rng
    )
    points = body.corners_m.reshape(-1, 3)
    lower, upper = points[points[:, 2] < 0.12 * height], points[points[:, 2] > 0.02 * height]
    parts = [*map(hulls.extreme, (lower, upper)), hulls.extreme(stalk.corners_m, 16)]
    return make_centred_solid([body, stalk.painted(1)], (skin, _STALK), parts)


def banana(seed: int, piece: int = -1) -> Solid:
    """A banana on its side, or a hand of up to seven resting on its tips. Slots: peels, crown.

    Args:
        seed: Draws all.
        piece: Number of a single banana of the hand; -1 = the whole hand.
    """
    bananas, materials = _bananas(seed)
    if piece >= 0:
        patches, parts = bananas[piece]
        return make_centred_solid(patches, materials, parts)
    patches = [patch for own, _ in bananas for patch in own]
    return make_centred_solid(patches, materials, [part for _, own in bananas for part in own])


def banana_pieces(seed: int, piece: int = -1) -> tuple[tuple[str, Vec3], ...]:
    """Ids of the bananas of a hand, and their middles relative to the hand's middle [m]."""
    if piece >= 0 or banana_count(seed) == 1:
        return ()
    bananas, _ = _bananas(seed)
    x, y, z = centre_m(join_patches(patch for own, _ in bananas for patch in own))
    middles = [centre_m(join_patches(own)) for own, _ in bananas]
    return tuple(
        (f"banana?piece={k}&seed={seed}", (round(a - x, 6), round(b - y, 6), round(c - z, 6)))
        for k, (a, b, c) in enumerate(middles)
    )


def _bananas(seed: int) -> tuple[list[tuple[list[Patch], list[Array]]], tuple[Material, ...]]:
    """Patches and convex parts of every banana, and the materials of all."""
    rng = variant_rng("banana", seed)
    count = banana_count(seed)
    length, thick = rng.between(0.15, 0.205, "length_m"), rng.between(0.0165, 0.02, "radius_m")
    ripe = round(rng.between(0.0, 1.0), 2)
    peels = [
        printed_material(f"texture/banana_peel?ripe={ripe}&seed={seed + k}", rng.between(0.4, 0.55))
        for k in (0, 1000)
    ]
    bend = rng.between(0.7, 1.35, "bend_rad")
    if count == 1:
        skin, parts = _banana(length, thick, bend, 5)
        return [([skin], parts)], (peels[0],)
    made: list[tuple[list[Patch], list[Array]]] = []
    for i in range(count):
        at = i - 0.5 * (count - 1)
        turn = at * rng.between(0.19, 0.25) + rng.between(-0.04, 0.04)
        size, girth = length * rng.between(0.92, 1.06), thick * rng.between(0.92, 1.05)
        skin, parts = _banana(size, girth, bend * rng.between(0.88, 1.12), 24 // count)
        # From lying on its side to an arch from the crown to the tip, towards +X; neighbours
        # rise by turns, since they grow in two rows.
        shift = np.array([0.0, 0.42 * thick * at, 0.45 * thick * (i % 2)])
        skin = skin.rotated("x", 0.5 * math.pi).rotated("z", turn).moved(*shift.tolist())
        made.append(([skin.painted(i % 2)], [_turn_up(part, turn) + shift for part in parts]))
    wide = 0.45 * thick * count + 0.012
    crown = shapes.rounded_box((0.03, wide, 0.02), 0.008, 2).moved(0.008, 0.0, 0.004)
    first = made[0][1]
    first[0] = hulls.extreme(np.concatenate([first[0], crown.corners_m.reshape(-1, 3)]))
    tan = Material(draw_linear(("#8a8a3a", "#6b5a2c", "#a9a24a"), 0.1, rng), 0.7, printed=True)
    made[-1][0].append(crown.painted(2))
    return made, (*peels, tan)


def banana_count(seed: int) -> int:
    """Number of bananas of a variant: about half of all photographs show several (assumed)."""
    return in_turn((1, 4, 1, 2, 6, 1, 3, 5), seed)


def banana_facts(seed: int, piece: int = -1) -> Facts:
    """Single or of a hand, and the number in the hand."""
    del piece
    count = banana_count(seed)
    return Facts("single" if count == 1 else "hand", {"count": str(count)})


def _turn_up(points: Array, turn_rad: float) -> Array:
    """Points turned as the bananas of a hand."""
    return rotate(rotate(points, "x", 0.5 * math.pi), "z", turn_rad)


def _banana(length: float, thick: float, bend: float, count: int) -> tuple[Patch, list[Array]]:
    """A banana from the stem at the origin along +X, bent towards +Y, and its convex parts."""
    steps = 25
    arc = np.linspace(0.0, 1.0, steps)
    radius = length / bend
    # The stem leaves at half of the bend upwards, which makes both ends level.
    angle = bend * (arc - 0.5)
    rise = radius * (np.cos(angle) - math.cos(0.5 * bend))
    path = np.stack([radius * (np.sin(angle) + math.sin(0.5 * bend)), rise, 0 * arc], axis=1)
    # Five blunt edges; the stem end is long and thin, the blossom end short.
    at = (0, 0.04, 0.1, 0.18, 0.32, 0.5, 0.72, 0.88, 0.95, 0.985, 1.0)
    widths = (0.36, 0.3, 0.32, 0.62, 0.92, 1.0, 0.97, 0.78, 0.5, 0.3, 0.24)
    girth = _smooth(np.interp(arc, at, widths))
    turn = 2 * math.pi * np.arange(20) / 20
    edge = 1.0 + 0.05 * np.cos(5 * turn) + 0.01 * np.cos(10 * turn)
    section = thick * edge[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    skin = shapes.sweep(path, section, scale=girth)
    first, second = shapes.frames_along(path, (0.0, 0.0, 1.0))
    outline = shapes.circle(thick, 8)
    around = outline[:, :1] * first[:, None] + outline[:, 1:] * second[:, None]
    rings = path[:, None] + girth[:, None, None] * around
    edges = np.linspace(0, steps - 1, count + 1).round().astype(int).tolist()
    parts = [rings[sorted({a, (a + b) // 2, b})].reshape(-1, 3) for a, b in pairwise(edges)]
    return skin, [hulls.extreme(part, 40) for part in parts]


def _smooth(values: Array) -> Array:
    padded = np.concatenate([values[:1], values, values[-1:]])
    smooth: Array = 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]
    return smooth


def _lumps(count: int, size: float, rng: VariantRng) -> Callable[[Array], Array]:
    """A low-frequency swelling over directions: a sum of cosines."""
    axes = rng.random((count, 3)) - 0.5
    phases = 2 * math.pi * rng.random(count)

    def lumps(d: Array) -> Array:
        total = np.zeros(d.shape[:2])
        for axis, phase in zip(axes, phases, strict=True):
            total += np.cos(6.0 * (d * axis).sum(axis=2) + phase)
        return size * total / count

    return lumps


def _stalk(foot: tuple[float, float, float], length: float, thick: float, rng: VariantRng) -> Patch:
    """A bent, tapering twig."""
    x, y, z = foot
    lean = rng.between(-0.4, 0.4) * length
    bend = shapes.spline([(x, y, z), (x, y, z + 0.5 * length), (x + lean, y, z + length)], 24)
    path, scale = shapes.space_evenly(bend, 6), np.array([1.3, 1, 0.9, 0.9, 1.1, 1.5])
    return shapes.sweep(path, shapes.circle(thick, 8), up=(1.0, 0.0, 0.0), scale=scale)
