"""Foliage with holes between its leaves. All are near-white: the material's colour tints them.

Each image has four tiles, each a separate spray or clump within its borders: a card shows one tile.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from gen_data.assets.family import check_option
from gen_data.content.procedural.patches import Array
from gen_data.content.procedural.textures.texture_images import color, quantize
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import uniform
from gen_data.core.variant_rng import VariantRng, variant_rng

SIZE_PX, TILES = 512, 2
_TILE_PX = SIZE_PX // TILES


@dataclass(frozen=True, slots=True)
class Blade:
    """A flat leaf, leaflet or petal in a tile, lengths in shares of the tile's side.

    Attributes:
        foot: Where it begins, (right, down).
        turn_rad: Direction in which it grows, from right to down.
        length, width: Its size.
        tone: Brightness, near 1.
        hue: From -1 = towards blue to 1 = towards yellow.
    """

    foot: tuple[float, float]
    turn_rad: float
    length: float
    width: float
    tone: float
    hue: float


def _ovate(s: Array) -> Array:
    """Broadest a third of the way along, pointed: lime, beech, cherry."""
    width: Array = np.sin(np.pi * np.clip(s, 0.0, 1.0) ** 0.75) * (1.0 - 0.25 * s)
    return width


def _lance(s: Array) -> Array:
    """Narrow and pointed at both ends: willow, olive, bamboo."""
    width: Array = np.sin(np.pi * np.clip(s, 0.0, 1.0))
    return width


def _round(s: Array) -> Array:
    """Nearly a disk: alder, hazel, ivy seen from afar, petals."""
    width: Array = np.sqrt(np.clip(1.0 - (2.0 * np.clip(s, 0.0, 1.0) - 1.0) ** 2, 0.0, 1.0))
    return width


def _lobed(s: Array) -> Array:
    """Sinuate: oak."""
    width: Array = _ovate(1.0 - s) * (0.78 + 0.22 * np.cos(7.0 * np.pi * s))
    return width


def _strip(s: Array) -> Array:
    """A needle or a blade of grass: even, tapering in its last third."""
    width: Array = np.clip(3.0 * (1.0 - s), 0.0, 1.0) * (s >= 0.0)
    return width


_OUTLINES: Mapping[str, Callable[[Array], Array]] = {
    "ovate": _ovate,
    "lance": _lance,
    "round": _round,
    "lobed": _lobed,
    "strip": _strip,
}


@dataclass(frozen=True, slots=True)
class Kind:
    """Shape and arrangement of the leaves of a texture.

    Attributes:
        outline: Shape of a blade: a key of ``_OUTLINES``.
        length, width: Size of a blade, as a share of a tile's side.
        count: Leaves per tile.
        blades: Blades per leaf.
        habit: ``palm``: blades fan out from one point; ``feather``: they stand on both sides of a
            stalk; ``tuft``: they radiate around it; ``grass``: blades rise from the tile's lower
            border.
        spray: True: leaves stand along a twig that grows up the tile; false: they fill a clump.
    """

    outline: str
    length: float
    width: float
    count: int
    blades: int = 1
    habit: str = "palm"
    spray: bool = True


KINDS: Mapping[str, Kind] = {
    "ovate": Kind("ovate", 0.16, 0.1, 110),
    "small": Kind("ovate", 0.11, 0.07, 210),
    "round": Kind("round", 0.13, 0.11, 105),
    "lobed": Kind("lobed", 0.18, 0.115, 100),
    "palmate": Kind("ovate", 0.12, 0.055, 60, 5),
    "fingered": Kind("ovate", 0.16, 0.055, 36, 6),
    "feather": Kind("ovate", 0.09, 0.04, 42, 11, "feather"),
    "lance": Kind("lance", 0.2, 0.04, 130),
    "needle": Kind("strip", 0.08, 0.011, 90, 12, "tuft"),
    "pine": Kind("strip", 0.17, 0.011, 34, 22, "tuft"),
    "scale": Kind("lance", 0.055, 0.018, 170, 7, "feather"),
    "clump": Kind("ovate", 0.066, 0.046, 620, spray=False),
    "pine_clump": Kind("strip", 0.11, 0.013, 120, 12, "tuft", spray=False),
    "ivy": Kind("round", 0.1, 0.09, 190, spray=False),
    "blades": Kind("strip", 0.62, 0.022, 90, habit="grass", spray=False),
    "twigs": Kind("strip", 0.17, 0.007, 70, 5, "feather", spray=False),
    "blossom": Kind("round", 0.042, 0.04, 130, 5),
}
"""Leaves of the texture ``leaves``."""


def leaves(seed: int, kind: str) -> TextureData:
    """Leaves of a word of ``KINDS`` with holes between them, 512 px, four tiles.

    Raises:
        AssetError: the kind is unknown.
    """
    check_option("texture/leaves", "kind", kind, tuple(KINDS))
    rng = variant_rng(f"leaves/{kind}", seed)
    tiles = [_draw_tile(KINDS[kind], rng) for _ in range(TILES * TILES)]
    return stack_tiles(tiles)


def stack_tiles(tiles: list[tuple[Float32, Float32]]) -> TextureData:
    """One texture of four tiles, each a color [n, n, 3] and a coverage [n, n] in [0, 1]."""
    rows = [tiles[k : k + TILES] for k in range(0, len(tiles), TILES)]
    albedo, cover = (
        np.concatenate([np.concatenate([tile[i] for tile in row], axis=1) for row in rows])
        for i in (0, 1)
    )
    return TextureData(quantize(albedo), alpha=quantize(cover))


def _draw_tile(kind: Kind, rng: VariantRng) -> tuple[Float32, Float32]:
    albedo = np.full((_TILE_PX, _TILE_PX, 3), 0.5, dtype=np.float32)
    cover = np.zeros((_TILE_PX, _TILE_PX), dtype=np.float32)
    outline = _OUTLINES[kind.outline]
    stalks = _twigs(rng) if kind.spray else []
    for stalk in stalks:
        draw_blade(albedo, cover, stalk, _strip)
    for share in np.arange(kind.count) / kind.count:
        foot, turn = _place(kind, float(share), rng)
        # Leaves drawn last are nearest to the light.
        tone = 0.62 + 0.3 * float(share) + rng.between(-0.08, 0.08)
        size = rng.between(0.7, 1.1)
        blade = Blade(foot, turn, size * kind.length, size * kind.width, tone, rng.between(-1, 1))
        for leaflet in _leaflets(kind, blade, rng):
            draw_blade(albedo, cover, leaflet, outline)
    return albedo, cover


def _twigs(rng: VariantRng) -> list[Blade]:
    """A twig up the tile, and side twigs."""
    sides = [
        Blade((0.5, 0.85 - 0.17 * k), -0.5 * math.pi + turn, 0.36, 0.008, 0.5, 0.6)
        for k in range(4)
        for turn in (rng.between(0.5, 0.9), -rng.between(0.5, 0.9))
    ]
    return [Blade((0.5, 1.0), -0.5 * math.pi, 0.9, 0.012, 0.45, 0.6), *sides]


def _place(kind: Kind, share: float, rng: VariantRng) -> tuple[tuple[float, float], float]:
    """Foot and direction of a leaf."""
    if kind.habit == "grass":
        across = rng.between(0.2, 0.8)
        return (across, 0.999), -0.5 * math.pi + 1.1 * (across - 0.5) + rng.between(-0.25, 0.25)
    if kind.spray:
        up = 0.06 + 0.8 * float(rng.random()) ** 0.9
        # A spray is broad at half of its length.
        reach = (0.47 - 0.6 * kind.length) * math.sqrt(max(0.0, 1.0 - (1.7 * (up - 0.46)) ** 2))
        aside = reach * rng.between(-1.0, 1.0)
        turn = -0.5 * math.pi + 2.2 * aside + rng.between(-0.9, 0.9)
        return (0.5 + aside, 1.0 - up), turn
    turn = rng.between(0.0, 2.0 * math.pi)
    # Clumps end raggedly: where leaves drawn first lie farther out.
    radius = (0.5 - 0.1 * share - 0.4 * kind.length) * math.sqrt(float(rng.random()))
    foot = (0.5 + radius * math.cos(turn), 0.5 + 0.92 * radius * math.sin(turn))
    return foot, turn + rng.between(-2.2, 2.2)


def _leaflets(kind: Kind, leaf: Blade, rng: VariantRng) -> list[Blade]:
    """The blades of one leaf."""
    if kind.blades == 1:
        return [leaf]
    made = []
    for k in range(kind.blades):
        share = k / (kind.blades - 1)
        size, turn, along = 1.0, (share - 0.5) * 2.6, 0.0
        if kind.habit == "palm":
            size = 1.0 - 0.9 * (share - 0.5) ** 2
            turn = (share - 0.5) * (2.0 * math.pi * 0.8 if kind.blades == 5 else 2.4)
        elif kind.habit == "feather":
            along, turn = 2.4 * share, 1.0 if k % 2 else -1.0
            size, turn = 1.0 - 0.35 * share, 0.0 if k == kind.blades - 1 else turn
        else:
            along, turn = 0.6 * share, rng.between(-1.5, 1.5)
        step = along * leaf.length
        x = leaf.foot[0] + step * math.cos(leaf.turn_rad)
        y = leaf.foot[1] + step * math.sin(leaf.turn_rad)
        tone = leaf.tone + rng.between(-0.04, 0.04)
        made.append(
            Blade((x, y), leaf.turn_rad + turn, size * leaf.length, leaf.width, tone, leaf.hue)
        )
    return made


def draw_blade(
    albedo: Float32, cover: Float32, blade: Blade, outline: Callable[[Array], Array]
) -> None:
    """Draw a blade over a tile in place; beyond the tile's border nothing is drawn."""
    n = len(cover)
    reach = 0.5 * blade.width + 1.5 / n
    c, s = math.cos(blade.turn_rad), math.sin(blade.turn_rad)
    ends = [blade.foot, (blade.foot[0] + c * blade.length, blade.foot[1] + s * blade.length)]
    # One pixel at the border stays clear: the neighbouring tile must not bleed in.
    x0, y0 = (max(1, math.floor((min(e[i] for e in ends) - reach) * n)) for i in (0, 1))
    x1, y1 = (min(n - 1, math.ceil((max(e[i] for e in ends) + reach) * n)) for i in (0, 1))
    if x1 <= x0 or y1 <= y0:
        return
    x = (np.arange(x0, x1) + 0.5)[None, :] / n - blade.foot[0]
    y = (np.arange(y0, y1) + 0.5)[:, None] / n - blade.foot[1]
    along, aside = (c * x + s * y) / blade.length, c * y - s * x
    half = 0.5 * blade.width * outline(along)
    inside = (along > 0.0) & (along < 1.0)
    edge = np.clip(0.5 + n * np.where(inside, half - np.abs(aside), -1.0), 0.0, 1.0)
    edge = edge.astype(np.float32)
    # A pale midrib, one half in more light than the other, the margin darker.
    rib = np.clip(1.0 - np.abs(aside) / max(0.07 * blade.width, 0.6 / n), 0.0, 1.0)
    tone = blade.tone * (1.0 + 0.1 * rib + 0.06 * np.sign(aside) - 0.12 * along * (1 - along))
    tint = np.array([1.0 + 0.1 * blade.hue, 1.0, 1.0 - 0.14 * blade.hue])
    painted = np.clip(tone[..., None] * tint, 0.0, 1.0).astype(np.float32)
    window = (slice(y0, y1), slice(x0, x1))
    albedo[window] += (painted - albedo[window]) * edge[..., None]
    cover[window] = np.maximum(cover[window], edge)


def window_grid(rng: VariantRng) -> TextureData:
    """Four storeys of four bays of a plain facade far away; the pattern repeats."""
    n, cells = 256, 4
    centre = (np.arange(n) + 0.5) / n * cells
    cell, at = np.floor(centre).astype(np.int64), centre - np.floor(centre)
    wide, high = rng.between(0.42, 0.9), rng.between(0.45, 0.72)
    across = (np.abs(at - 0.5) < 0.5 * wide)[None, :]
    down = (np.abs(at - 0.46) < 0.5 * high)[:, None]
    pane = 0.1 + 0.28 * uniform((cells, cells), rng) ** 2
    tone = 0.86 + 0.05 * (uniform((n, n), rng) - 0.5)
    slab = (np.abs(at - 0.96) < 0.04)[:, None]
    shade = np.where(across & down, pane[cell[:, None], cell[None, :]], tone - 0.12 * slab)
    tint = np.where((across & down)[..., None], np.array([0.86, 0.96, 1.06]), 1.0)
    rough = np.where(across & down, 0.3, 1.0)
    return TextureData(
        quantize((shade[..., None] * tint).astype(np.float32)), quantize(rough.astype(np.float32))
    )


_FIELDS = ("#667840", "#73854a", "#5c6e3d", "#998f5c", "#7d6b52", "#858c4f", "#6b7d45")
"""Meadow, pasture, ripe grain and ploughed earth, sRGB."""


def farmland(rng: VariantRng) -> TextureData:
    """Meadows, ploughed and ripe fields with hedgerows between them, seen from afar; tiles."""
    n, rows = 512, 6
    y, x = ((np.arange(n) + 0.5) / n * rows for _ in range(2))
    wave = 0.16 * np.sin(2 * np.pi * (x / rows + rng.between(0, 1)))[None, :]
    row = (y[:, None] + wave) % rows
    bend = 0.2 * np.sin(2 * np.pi * (y / rows + rng.between(0, 1)))[:, None]
    shift = uniform(rows, rng)[row.astype(np.int64)]
    column = (0.7 * x[None, :] * (rows - 1) / rows / 0.7 + shift + bend) % (rows - 1)
    number = row.astype(np.int64) * rows + column.astype(np.int64)
    palette = np.stack([color(code) for code in _FIELDS])
    which = (uniform(rows * rows, rng) * len(palette)).astype(np.int64)
    furrow = 0.025 * np.sin(2 * np.pi * 9.0 * row) + 0.05 * (uniform((n, n), rng) - 0.5)
    land = palette[which[number]] * (1.0 + furrow[..., None])
    gap = np.minimum(*(np.minimum(v % 1.0, 1.0 - v % 1.0) for v in (row, column)))
    hedge = np.clip(1.6 - gap / 0.018, 0.0, 1.0)[..., None] * 0.85
    land = land * (1.0 - hedge) + np.array([0.25, 0.31, 0.17]) * hedge
    return TextureData(quantize(land.astype(np.float32)))
