"""Horizons: tree lines, forests and hills, in pieces that stand side by side.

Pieces run along Y and face +X, the side from which they are seen; their origin is below their
middle. They are meant for distances from 40 m on; ``townscapes`` has towns.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gen_data.assets.family import Solid, check_option
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import hex_to_linear, patterned_material
from gen_data.content.procedural.patches import Array, Patch, finish_mesh, join_patches
from gen_data.content.procedural.surface_shapes import ball, cone, grid
from gen_data.content.scenery.foliage import directions, merge_meshes
from gen_data.content.scenery.leaf_cards import (
    Cards,
    card_mesh,
    cards_about,
    drop_unused_slots,
    join_cards,
    leaf_material,
)
from gen_data.core.asset_types import ConvexParts, Material, MeshData
from gen_data.core.noise import uniform
from gen_data.core.variant_rng import VariantRng, variant_rng

SEASONS = ("spring", "summer", "autumn", "winter")
TREE_LINE_M, FOREST_M, HILL_M = 32.0, 48.0, 240.0
"""Lengths of the pieces along Y."""
_COLORS = {
    "spring": ("#93a85c", "#a1b364", "#879c54", "#b0c074"),
    "summer": ("#708749", "#7d9250", "#667b45", "#8b9e5a"),
    "autumn": ("#b0954a", "#bf8a44", "#8f8c4a", "#cda552"),
    "winter": ("#8d8477", "#988f82", "#827a6f", "#a39a8c"),
}
_EVERGREEN = ("#52694a", "#5d7350")
_SOFTNESS = 0.72


@dataclass(frozen=True, slots=True)
class _Crown:
    """A tree far away: where it stands, its height and radius [m]."""

    x: float
    y: float
    height: float
    radius: float
    is_conifer: bool
    slot: int


def tree_line(seed: int, season: str) -> Solid:
    """A row of trees over bushes, 32 m long and 9-17 m high.

    Raises:
        AssetError: the season is unknown.
    """
    check_option("horizon/trees", "season", season, SEASONS)
    rng = variant_rng("horizon/trees", seed)
    crowns, y = [], -0.5 * TREE_LINE_M
    tall = rng.between(9.0, 14.0, "height_m")
    while y < 0.5 * TREE_LINE_M:
        height = tall * rng.between(0.7, 1.25)
        radius = height * rng.between(0.24, 0.36)
        y += 0.8 * radius
        conifer = rng.chance(0.12)
        if conifer:
            radius *= 0.6
        at = -rng.between(0.5, 6.0) - radius
        crowns.append(_Crown(at, y, height, radius, conifer, int(rng.between(0, 4))))
        y += rng.between(0.6, 1.5) * radius
    bushes = _draw_bushes(TREE_LINE_M, 0.9, (1.5, 4.0), 0.75, 5.0, rng)
    return _stand(crowns, bushes, season, (1.9, 38), rng)


def forest(seed: int, season: str) -> Solid:
    """An edge of a forest with the tops behind it, 48 m long and 14-24 m high.

    Raises:
        AssetError: the season is unknown.
    """
    check_option("horizon/forest", "season", season, SEASONS)
    rng = variant_rng("horizon/forest", seed)
    firs = rng.choose((0.08, 0.3, 0.75), "firs_m")
    crowns = []
    for row in range(3):
        y = -0.5 * FOREST_M
        while y < 0.5 * FOREST_M:
            conifer = rng.chance(firs)
            height = (13.0 + 2.5 * row) * rng.between(0.8, 1.25)
            radius = height * (rng.between(0.15, 0.2) if conifer else rng.between(0.2, 0.3))
            y += 0.75 * radius
            x = -3.0 - 7.0 * row - rng.between(0.0, 4.0)
            crowns.append(_Crown(x, y, height, radius, conifer, int(rng.between(0, 4))))
            y += rng.between(0.5, 0.9) * radius
    edge = _draw_bushes(FOREST_M, 0.5, (2.0, 6.0), 0.8, 4.0, rng)
    return _stand(crowns, edge, season, (2.8, 22), rng)


def _draw_bushes(
    length_m: float,
    per_m: float,
    heights_m: tuple[float, float],
    radius_share: float,
    depth_m: float,
    rng: VariantRng,
) -> list[_Crown]:
    """Bushes evenly along the front; their radius is a share of their height."""
    count = round(per_m * length_m)
    return [
        _Crown(-rng.between(0.5, depth_m), (k / count - 0.5) * length_m, height,
               radius_share * height, False, int(rng.between(0, 4)))
        for k, height in enumerate(rng.between(*heights_m) for _ in range(count))
    ]  # fmt: skip


def hill(seed: int, season: str) -> Solid:
    """Rising land with fields, hedgerows and woods, 240 m long, 25-85 m high, 260 m deep.

    Raises:
        AssetError: the season is unknown.
    """
    check_option("horizon/hills", "season", season, SEASONS)
    rng = variant_rng("horizon/hills", seed)
    across, along = 27, 33
    peak = rng.between(25.0, 85.0, "peak_m")
    x = -260.0 * np.linspace(0.0, 1.0, across)[:, None]
    y = np.linspace(-0.75, 0.75, along)[None, :] * HILL_M
    lumps = [
        (rng.between(-180.0, -90.0), rng.between(-0.3, 0.3) * HILL_M, rng.between(50.0, 90.0),
         rng.between(0.5, 1.0))
        for _ in range(4)
    ]  # fmt: skip
    z = np.zeros((across, along))
    for cx, cy, r, share in lumps:
        z = np.maximum(z, share * np.exp(-(((x - cx) / r) ** 2 + ((y - cy) / (1.6 * r)) ** 2)))
    # The land falls to its foot on all four sides.
    sides = np.clip((0.75 * HILL_M - np.abs(y)) / (0.4 * HILL_M), 0.0, 1.0)
    z = peak * z * sides * sides * (3.0 - 2.0 * sides) * np.clip(-x / 70.0, 0.0, 1.0)
    points = np.stack(np.broadcast_arrays(x, y, z), axis=2)
    # Fields of about 50 m.
    land = grid(points[:, ::-1], np.linspace(1.2, 0.0, along), np.linspace(0.0, 0.9, across))
    level = {"spring": 1.05, "summer": 1.0, "autumn": 0.9, "winter": 0.72}[season]
    fields = Material(
        (level, level, level), 0.95, specular=0.2, role="grass",
        texture=f"texture/farmland?seed={seed % 2}",
    )  # fmt: skip
    green = {"spring": "#6f8248", "summer": "#566b3b", "autumn": "#86733f", "winter": "#6b6459"}
    # Crowns this far away need no holes, which cost every ray a test.
    crowns = Material(hex_to_linear(green[season]), 0.95, specular=0.2, role="leaf")
    patch = join_patches([land, *(wood.painted(1) for wood in _woods_on(points, rng))])
    return centred_piece(finish_mesh(patch, (fields, crowns), 60.0))


def _stand(
    crowns: Sequence[_Crown],
    bushes: Sequence[_Crown],
    season: str,
    clumps: tuple[float, int],
    rng: VariantRng,
) -> Solid:
    """Trees with opaque cores over bushes; clumps as (size [m], number per tree)."""
    size, count = clumps
    is_bare = season == "winter"
    # Trunks of rows behind the first are hidden.
    trunks = [_trunk(crown) for crown in crowns if crown.x > -9.0]
    cores = [
        _core(crown, 0.62 if crown in bushes else 0.7).painted(1)
        for crown in (*crowns, *bushes)
        if not is_bare or crown.is_conifer
    ]
    bark = Material(hex_to_linear("#5b5046"), 0.95, specular=0.2, role="bark")
    dark = patterned_material("texture/foliage?seed=0", 1.6, 0.95, hex_to_linear("#6d8049"))
    pieces = [*trunks, *cores]
    wood = finish_mesh(join_patches(pieces), (bark, replace(dark, specular=0.2, role="leaf")), 70.0)
    parts = [_clumps(c, size, count * 2 // 3 if c.is_conifer else count, rng) for c in crowns]
    parts += [_clumps(bush, 0.75 * size, 8, rng) for bush in bushes]
    leaves = card_mesh(join_cards(parts), _foliage(season, rng), _SOFTNESS, rng)
    return centred_piece(merge_meshes(wood, leaves))


def centred_piece(mesh: MeshData) -> Solid:
    """The mesh with its middle above the origin and without unused slots, and a box around it."""
    (x0, _, _), (x1, _, _) = mesh.bounds_m()
    shift = np.array([round(0.5 * (x0 + x1), 2), 0.0, 0.0])
    moved = replace(mesh, vertices_m=(mesh.vertices_m - shift).astype(np.float32))
    (x0, y0, z0), (x1, y1, z1) = moved.bounds_m()
    hull = hulls.box((x0, y0, z0), (x1, y1, z1))
    return Solid(drop_unused_slots(moved), ConvexParts((np.round(hull, 6),)))


def _foliage(season: str, rng: VariantRng) -> tuple[Material, ...]:
    """Four shades of deciduous trees, then two of conifers."""
    level, warm = rng.between(0.88, 1.12), rng.between(0.92, 1.1)
    kind = "twigs" if season == "winter" else "clump"
    return (
        *(leaf_material(kind, color, level, warm) for color in _COLORS[season]),
        *(leaf_material("pine_clump", color, level) for color in _EVERGREEN),
    )


def _trunk(crown: _Crown) -> Patch:
    foot, top = 0.02 * crown.height, 0.45 * crown.height
    return cone((foot, 0.0), (0.6 * foot, top), 5).moved(crown.x, crown.y)


def _core(crown: _Crown, share: float) -> Patch:
    """The opaque depth of a crown, within its clumps."""
    low, r = _crown_foot(crown), share * crown.radius
    half = 0.5 * (crown.height - low)
    if crown.is_conifer:
        return cone((r, low + 0.1 * half), (0.05, crown.height - 0.3 * half), 7).moved(
            crown.x, crown.y
        )
    axes = np.array([r, r, share * half])
    middle = np.array([crown.x, crown.y, low + half])
    return ball(lambda d: d * axes + middle, 4, 7)


def _crown_foot(crown: _Crown) -> float:
    if crown.radius > 0.6 * crown.height:
        return 0.0
    return (0.08 if crown.is_conifer else 0.25) * crown.height


def _clumps(crown: _Crown, size: float, count: int, rng: VariantRng) -> Cards:
    """Cards over the surface of a crown."""
    low = _crown_foot(crown)
    half = 0.5 * (crown.height - low)
    at = directions(count, rng)
    depth = 0.72 + 0.28 * uniform(count, rng)
    if crown.is_conifer:
        up = uniform(count, rng) ** 1.4
        reach = crown.radius * (1.0 - 0.95 * up) * depth
        place = np.stack([reach * at[:, 0], reach * at[:, 1], low + 2.0 * half * up], axis=1)
        outward = at * np.array([1.0, 1.0, 0.0]) + np.array([0.0, 0.0, 0.45])
        slots = 4 + (uniform(count, rng) < 0.5).astype(np.int64)
        scale = size * (0.9 - 0.4 * up)
    else:
        # Boughs: a crown of several lobes and not an egg.
        lobe = 1.0 + 0.16 * np.sin(3.0 * np.arctan2(at[:, 1], at[:, 0]) + 2.0 * crown.height)
        lobe *= 1.0 + 0.12 * np.sin(5.0 * at[:, 2] + crown.y)
        axes = np.array([crown.radius, crown.radius, half])
        place = at * axes * (depth * lobe)[:, None] + np.array([0.0, 0.0, low + half])
        outward = at
        lit = (uniform(count, rng) < 0.5).astype(np.int64)
        slots = (crown.slot + lit) % 4
        scale = np.full(count, size)
    scale = scale * (0.75 + 0.5 * uniform(count, rng))
    place[:, 2] = np.maximum(place[:, 2], 0.3 * scale)
    middle = place + np.array([crown.x, crown.y, 0.0])
    return cards_about(middle, outward, scale, slots, 0.35, rng)


def _woods_on(points: Array, rng: VariantRng) -> list[Patch]:
    """Crowns on a hill: along hedgerows, and in woods near its top."""
    rows, columns = points.shape[:2]
    places = []
    for _ in range(5):
        column = int(rng.between(2, columns - 2))
        drift = rng.between(-0.35, 0.35)
        t = np.linspace(rng.between(0.05, 0.2), rng.between(0.5, 0.9), 16)
        places.append(_points_on(points, t * (rows - 1), column + drift * t * rows))
    for _ in range(3):
        u = rng.between(0.25, 0.55) * (rows - 1)
        v = rng.between(0.15, 0.85) * (columns - 1)
        turn, r = 2.0 * math.pi * uniform(36, rng), np.sqrt(uniform(36, rng))
        wide, deep = rng.between(2.0, 6.0), rng.between(1.5, 4.0)
        places.append(_points_on(points, u + deep * r * np.sin(turn), v + wide * r * np.cos(turn)))
    return [_lump(at, rng.between(3.0, 6.5), rng) for at in np.concatenate(places)]


def _lump(foot_m: Array, radius_m: float, rng: VariantRng) -> Patch:
    """A crown of few faces that stands on a slope; no two are alike."""
    x, y, z = foot_m.tolist()
    high = rng.between(0.9, 1.5)
    made = ball(lambda d: d * radius_m * np.array([1.0, 1.0, high]), 3, 5)
    placed = made.rotated("z", rng.between(0.0, 6.2)).moved(x, y, z + 0.6 * radius_m)
    return replace(placed, corners_m=np.maximum(placed.corners_m, np.array([-1e3, -1e3, 0.0])))


def _points_on(points: Array, row: Array, column: Array) -> Array:
    """Points of a grid [rows, columns, 3] at fractional rows and columns, clamped to it."""
    r = np.clip(row, 0.0, points.shape[0] - 1.001)
    c = np.clip(column, 0.0, points.shape[1] - 1.001)
    i, j = r.astype(np.int64), c.astype(np.int64)
    u, v = (r - i)[:, None], (c - j)[:, None]
    upper = points[i, j] * (1 - v) + points[i, j + 1] * v
    lower = points[i + 1, j] * (1 - v) + points[i + 1, j + 1] * v
    on: Array = upper * (1 - u) + lower * u
    return on
