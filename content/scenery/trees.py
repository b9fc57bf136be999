"""Trees: trunk and branches that grow into a crown, and sprays of leaves at the twigs' ends.

Each spray is a card that shows some hundred leaves of their true size (``leaf_cards``), with holes
between them: light falls through a crown in spots, and the sky shows through.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from gen_data.assets.family import Facts, Solid, check_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets as presets
from gen_data.content.procedural.patches import Array, Patch, finish_mesh, unit
from gen_data.content.procedural.surface_shapes import circle, sweep
from gen_data.content.scenery import leaf_cards
from gen_data.content.scenery.branching import Lobe, Skeleton, grow_skeleton, points_in, wood
from gen_data.content.scenery.foliage import (
    OUTWARD,
    Habit,
    Sprays,
    directions,
    merge_meshes,
    sprays_about,
)
from gen_data.core import asset_types, errors
from gen_data.core.noise import uniform
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

SEASONS = ("spring", "summer", "autumn", "winter")
_CARDS_MAX = 2600
"""Sprays on a tree in full leaf; larger crowns have larger ones."""
_TWIGS = 1100
_COVER = 0.58
"""Share of a card that counts as leaf, fitted to 0.9 to 0.99 of horizontal rays through the middle
of a crown that hit one."""
_LEAF_LEVEL = 1.2
"""Leaves in the textures have this part of the surface's colours in ``species.yaml``, inverted."""
_ATTRACTORS = 900
_STEP = 0.12
"""Length of an internode, of the widest lobe's radius."""


@dataclass(frozen=True, slots=True)
class Species:
    """A row of ``species.yaml``: how trees of a kind vary, as (low, high).

    Attributes:
        overlap_m: How far the crown reaches below its lowest branches.
        width: Radius of the crown, as a share of its height (of half of it for one lobe).
        greens: Alternatives for ``Shape.green``.
        boughs: Number of lobes around a body, whose middle lies ``middle`` of the crown below
            the top; 0 = none.
        stacked: (height, width) of lobes above one another, as shares of the crown's.
        leader: How far the trunk runs up into the crown, as a share of the crown's height.
        leaf: Kind of leaves: a word of ``textures.leaves.KINDS``.
        spray_m: Length of a spray of leaves.
        depth: Layers of leaves that a line of sight meets on its way through the crown.
        autumn: Colours as in ``greens``; empty = they stay green.
        blossom: Colour of the flowers in spring; empty = none that are seen from afar.
        evergreen: Whether it keeps its leaves in winter.
    """

    height_m: tuple[float, float]
    clear_m: tuple[float, float]
    overlap_m: float
    width: tuple[float, float]
    trunk_m: tuple[float, float]
    greens: tuple[tuple[str, ...], ...]
    bark: str
    droop: float = 0.15
    boughs: int = 0
    middle: float = 0.5
    stacked: tuple[tuple[float, float], ...] = ()
    leader: float = 0.4
    leaf: str = "ovate"
    spray_m: float = 0.5
    depth: float = 2.2
    autumn: tuple[str, ...] = ()
    blossom: str = ""
    evergreen: bool = False


_SPECIES = load_table(__package__, "species", Species)
SPECIES = (*_SPECIES, "conifer")


@dataclass(frozen=True, slots=True)
class Shape:
    """Measures and colours of one tree.

    Attributes:
        height_m: Overall.
        clear_m: From the ground to the lowest branches.
        trunk_m: Radius of the trunk at its foot.
        lobes: Ellipsoids that the crown fills.
        green: sRGB of the leaves, from the crown's depth to its surface.
        bark: sRGB of the bark.
    """

    height_m: float
    clear_m: float
    trunk_m: float
    lobes: tuple[Lobe, ...]
    green: tuple[str, ...]
    bark: str
    droop: float


def tree(seed: int, species: str, leaves: float, season: str = "summer") -> Solid:
    """A tree; its trunk stands on the origin. Slots: bark, then shades of leaf, then blossom.

    Args:
        seed: Variant.
        species: One of ``SPECIES``.
        leaves: Share of the leaves that it wears, 0 to 1, on top of the season's.
        season: One of ``SEASONS``; deciduous trees are bare in winter.

    Raises:
        AssetError: for an unknown species or season, or a share outside of [0, 1].
    """
    check_option("tree", "species", species, SPECIES)
    check_option("tree", "season", season, SEASONS)
    if not 0.0 <= leaves <= 1.0:
        raise errors.AssetError(f"tree: leaves={leaves} is not a share between 0 and 1")
    rng = variant_rng(f"tree/{species}", seed)
    if species == "conifer":
        return _conifer(rng)
    kind = _SPECIES[species]
    share = leaves * _worn(kind, season)
    return _broadleaf(kind, _draw_shape(kind, rng), share, season, rng)


def tree_facts(seed: int, species: str, leaves: float, season: str = "summer") -> Facts:  # noqa: ARG001
    """Species, and whether it is bare."""
    kind = _SPECIES.get(species)
    share = leaves * (_worn(kind, season) if kind else 1.0)
    return Facts(species, {"foliage": "bare" if share < 0.05 else "leafy"})


def seasonal_tree(seed: int, season: str) -> Solid:
    """A tree of a season; species take turns. Raises AssetError for an unknown season."""
    return tree(seed, _species_of(seed, season), 1.0, season)


def seasonal_tree_facts(seed: int, season: str) -> Facts:
    """Species, and whether it is bare."""
    return tree_facts(seed, _species_of(seed, season), 1.0, season)


def _species_of(seed: int, season: str) -> str:
    """Deciduous species in turn; in spring, a blossoming one every other time."""
    listed = [name for name, kind in _SPECIES.items() if not kind.evergreen]
    blossoming = [name for name in listed if _SPECIES[name].blossom]
    if season == "spring" and seed % 2 == 0:
        return in_turn(blossoming, seed // 2)
    return in_turn(listed, seed)


def _worn(kind: Species, season: str) -> float:
    """Share of the leaves that a species wears in a season."""
    if kind.evergreen:
        return 1.0
    return {"spring": 0.8, "autumn": 0.8, "winter": 0.0}.get(season, 1.0)


def _broadleaf(kind: Species, shape: Shape, leaves: float, season: str, rng: VariantRng) -> Solid:
    trunk = _trunk(shape, kind.leader, rng)
    points = _without_gaps(points_in(shape.lobes, _ATTRACTORS, rng), shape, rng)
    step_m = min(max(0.1, _STEP * max(lobe.axes_m[0] for lobe in shape.lobes)), 0.35)
    skeleton = grow_skeleton(trunk, points, step_m, shape.trunk_m)
    bark = _bark(shape.bark)
    # Thin twigs hide behind leaves; without leaves they are the crown.
    thinnest = 0.0 if leaves < 0.05 else 0.13 * shape.trunk_m
    mesh = finish_mesh(_flare_roots(wood(skeleton, thinnest, 2)), (bark,), 60.0)
    hull = hulls.frustum((shape.trunk_m, 0.0), (0.7 * shape.trunk_m, shape.clear_m), 10)
    foliage = _season_leaves(kind, shape, season, rng)
    cards = _crown(kind, shape, skeleton, len(foliage) - bool(kind.blossom), rng)
    count = round(leaves * len(cards.slots))
    if count:
        if season == "spring" and kind.blossom:
            cards = replace(cards, slots=np.where(np.arange(len(cards.slots)) % 4 < 2,
                                                  len(foliage) - 1, cards.slots))  # fmt: skip
        crown = leaf_cards.card_mesh(leaf_cards.first_cards(cards, count), foliage, OUTWARD, rng)
        mesh = merge_meshes(mesh, crown)
    else:
        mesh = merge_meshes(mesh, _bare_twigs(shape, skeleton, rng))
    return Solid(leaf_cards.drop_unused_slots(mesh), asset_types.ConvexParts((np.round(hull, 6),)))


def _season_leaves(
    kind: Species, shape: Shape, season: str, rng: VariantRng
) -> tuple[asset_types.Material, ...]:
    """Shades of leaf from the crown's depth to its surface, then blossom where there is any."""
    warm, level = rng.between(0.88, 1.14), rng.between(0.88, 1.14) * _LEAF_LEVEL
    codes = kind.autumn if season == "autumn" and kind.autumn else shape.green
    if season == "spring":
        level *= 1.25
    made = list(leaf_cards.crown_shades(kind.leaf, codes, level, warm))
    if kind.blossom:
        made.append(leaf_cards.leaf_material("blossom", kind.blossom, 1.1))
    return tuple(made)


def _without_gaps(points: Array, shape: Shape, rng: VariantRng) -> Array:
    """Attraction points outside a few holes at the crown's surface."""
    low, high = points.min(axis=0), points.max(axis=0)
    kept = np.ones(len(points), dtype=np.bool_)
    for at in directions(6, rng):
        centre = 0.5 * (low + high) + 0.42 * (high - low) * at
        radius = rng.between(0.1, 0.19) * float((high - low).min())
        kept &= ((points - centre) ** 2).sum(axis=1) > radius * radius
    return points[kept] if int(kept.sum()) > len(shape.lobes) * 8 else points


def _crown(
    kind: Species, shape: Shape, skeleton: Skeleton, shades: int, rng: VariantRng
) -> leaf_cards.Cards:
    """Sprays at the twigs' ends, as many as it takes to fill the crown."""
    outer = np.array([lobe.centre_m for lobe in shape.lobes]).mean(axis=0)
    radius = math.sqrt(math.prod(max(lobe.axes_m[i] for lobe in shape.lobes) for i in (0, 2)))
    width = max(abs(lobe.centre_m[0]) + lobe.axes_m[0] for lobe in shape.lobes)
    area = math.pi * max(radius, 0.7 * width) ** 2
    # Half of a leaf's area faces a line of sight, on average.
    wanted = 2.0 * kind.depth * area / _COVER
    count = min(_CARDS_MAX, max(300, round(wanted / kind.spray_m**2)))
    length = min(math.sqrt(wanted / count), 1.8 * kind.spray_m)
    middle = outer - np.array([0.0, 0.0, 0.25 * radius])
    habit = Habit(count, length, 1.1 * length, shades, kind.droop)
    return leaf_cards.spray_cards(sprays_about(skeleton.twigs(), middle, habit, rng), rng)


def _bare_twigs(shape: Shape, skeleton: Skeleton, rng: VariantRng) -> asset_types.MeshData:
    """The finest twigs of a winter crown."""
    middle = np.array([0.0, 0.0, shape.clear_m])
    length = min(0.11 * (shape.height_m - shape.clear_m), 1.1)
    habit = Habit(_TWIGS, length, 0.25 * length, 1, -0.3)
    cards = leaf_cards.spray_cards(sprays_about(skeleton.twigs(), middle, habit, rng), rng)
    twigs = replace(leaf_cards.leaf_material("twigs", shape.bark, 0.8), role="bark")
    return leaf_cards.card_mesh(cards, (twigs,), 0.5, rng)


def _trunk(shape: Shape, leader: float, rng: VariantRng) -> Array:
    """Centre line from the ground up into the crown, gently bent."""
    length = shape.clear_m + 0.85 * leader * (shape.height_m - shape.clear_m)
    count = max(5, round(length / 0.4))
    t = np.linspace(0.0, 1.0, count)
    sway = 0.12 * shape.clear_m
    x = sway * (uniform(1, rng) - 0.5) * np.sin(3.4 * t + 6.0 * uniform(1, rng)) * t
    y = sway * (uniform(1, rng) - 0.5) * np.sin(4.1 * t + 6.0 * uniform(1, rng)) * t
    return np.stack([np.round(axis, 4) for axis in (x, y, t * length)], axis=1)


def _flare_roots(patch: Patch) -> Patch:
    """Wood with a root flare: wider by half at the ground, on which it stands level."""
    z = patch.corners_m[..., 2]
    factor = 1.0 + 0.45 * np.clip(1.0 - z / 0.5, 0.0, 1.0) ** 2
    x, y = factor * patch.corners_m[..., 0], factor * patch.corners_m[..., 1]
    return replace(patch, corners_m=np.stack([x, y, np.where(z < 0.05, 0.0, z)], axis=2))


def _conifer(rng: VariantRng) -> Solid:
    """A spruce: whorls of drooping branches along a straight trunk, evergreen."""
    height, base_m = rng.between(6.0, 12.0, "height_m"), rng.between(0.1, 0.17, "base_m")
    clear, spread = rng.between(0.2, 0.9), rng.between(0.17, 0.24) * height
    line = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 0.6 * height), (0.0, 0.0, height)])
    trunk = sweep(line, circle(base_m, 8), up=(1.0, 0.0, 0.0), scale=np.array([1.0, 0.5, 0.08]))
    whorls = 20
    fans: list[tuple[Array, Array, Array]] = []
    for level in range(whorls):
        share = (level + 0.2 * uniform(1, rng)[0]) / whorls
        z = clear + (height - clear) * share**0.9
        reach = spread * (1.0 - share) ** 0.85 + 0.12
        for k in range(9):
            turn = 2.0 * math.pi * (k + 0.5 * (level % 2) + 0.5 * rng.between(-0.5, 0.5)) / 9
            fans.append(_fan(z, turn, reach * rng.between(0.75, 1.1), 0.5 - share, rng))
    fans.append(_tip(height, rng))
    places, growth, reach_m = (np.concatenate(part) for part in zip(*fans, strict=True))
    # The lowest sprays rest on the ground.
    growth[:, 2] = np.maximum(growth[:, 2], (0.03 - places[:, 2]) / reach_m)
    axis = places * np.array([1.0, 1.0, 0.0])
    outward = unit(axis) * 0.85 + np.array([0, 0, 0.53])
    depth = np.sqrt((axis**2).sum(axis=1)) / (spread * np.clip(1 - places[:, 2] / height, 0.1, 1.0))
    slots = np.clip(np.floor(depth * 3.2 + uniform(len(depth), rng) - 0.5), 0, 3).astype(np.int64)
    sprays = Sprays(places, outward, growth, reach_m, slots)
    warm = rng.between(0.9, 1.1)
    codes = ("#2a3926", "#364a30", "#435839", "#526845")
    greens = leaf_cards.crown_shades("needle", codes, _LEAF_LEVEL, warm)
    wooden = finish_mesh(trunk, (_bark("#6a5a4c"),), 60.0)
    mesh = merge_meshes(
        wooden, leaf_cards.card_mesh(leaf_cards.spray_cards(sprays, rng), greens, OUTWARD, rng)
    )
    hull = hulls.frustum((base_m, 0.0), (0.6 * base_m, 0.5 * height), 10)
    return Solid(mesh, asset_types.ConvexParts((np.round(hull, 6),)))


def _tip(height: float, rng: VariantRng) -> tuple[Array, Array, Array]:
    """Sprays that rise around the top of a spruce: feet, directions and lengths."""
    count = 10
    t = np.arange(count) / count
    around = directions(count, rng) * np.array([1.0, 1.0, 0.0])
    at = np.stack([0.0 * t, 0.0 * t, height - 1.1 + 0.8 * t], axis=1)
    return at, unit(0.35 * around + np.array([0.0, 0.0, 1.0])), 0.75 - 0.35 * t


def _fan(
    z: float, turn: float, reach: float, sag: float, rng: VariantRng
) -> tuple[Array, Array, Array]:
    """Sprays of needles along one branch: feet, directions and lengths."""
    count = 15
    t = np.sqrt(np.arange(1, count + 1) / count)
    out = np.array([math.cos(turn), math.sin(turn), 0.0])
    side = np.array([-math.sin(turn), math.cos(turn), 0.0])
    dip = np.maximum(-0.28 * (0.6 + sag) * reach * t**1.5, 0.15 - z)
    wing = np.where(np.arange(count) % 2 == 0, 1.0, -1.0) * (0.3 + 0.7 * uniform(count, rng))
    spread = (0.26 * reach * t * (1.15 - t))[:, None] * (wing[:, None] * side)
    at = (reach * t)[:, None] * out + spread + np.stack([0 * t, 0 * t, z + dip], axis=1)
    fall = np.array([0.0, 0.0, -0.45]) * (0.4 + uniform((count, 1), rng))
    growth = unit(out + 0.9 * wing[:, None] * side + fall)
    return at, growth, (0.34 + 0.26 * reach) * (0.7 + 0.5 * uniform(count, rng))


def _bark(code: str) -> asset_types.Material:
    bark = presets.patterned_material("texture/bark?seed=0", 0.8, 0.95, presets.hex_to_linear(code))
    return replace(bark, role="bark")


def leaf_greens(codes: tuple[str, ...], rng: VariantRng) -> tuple[asset_types.Material, ...]:
    """Shades of leaf that vary together from tree to tree."""
    r, g, b = presets.jitter_color((1.0, 1.0, 1.0), 0.0, rng)
    warm, level = rng.between(0.85, 1.18), rng.between(0.85, 1.15)
    colors = (
        (k * level * warm * c[0] * r, k * level * c[1] * g, k * level * c[2] * b)
        for c, k in zip(
            map(presets.hex_to_linear, codes), leaf_cards.depth_levels(codes), strict=True
        )
    )
    plain = (asset_types.Material(c, roughness=0.75, specular=0.35, role="leaf") for c in colors)
    return tuple(leaf_cards.transmitting(leaf, leaf_cards.BROAD) for leaf in plain)


def _draw_shape(species: Species, rng: VariantRng) -> Shape:
    height = rng.between(*species.height_m, "height_m")
    clear = rng.between(*species.clear_m, "clear_m")
    crown = height - clear + species.overlap_m
    wide = (
        rng.between(*species.width, "width")
        if species.width[0] < species.width[1]
        else species.width[0]
    )
    if species.boughs:
        centre_z = height - species.middle * crown
        lobes = _draw_boughs(crown * wide, crown, centre_z, species.boughs, rng)
    elif species.stacked:
        r = crown * wide
        lobes = tuple(
            Lobe((0.0, 0.0, clear + crown * z), (w * r, w * r, 0.24 * crown))
            for z, w in species.stacked
        )
    else:
        r = 0.5 * crown
        lobes = (Lobe((0.0, 0.0, height - r), (wide * r, wide * r, r)),)
    green = rng.choose(species.greens) if len(species.greens) > 1 else species.greens[0]
    trunk = rng.between(*species.trunk_m, "trunk_m")
    return Shape(height, clear, trunk, lobes, green, species.bark, species.droop)


def _draw_boughs(
    radius: float, height: float, centre_z: float, count: int, rng: VariantRng
) -> tuple[Lobe, ...]:
    """A crown of one body and several overlapping boughs around it."""
    lobes = [Lobe((0.0, 0.0, centre_z), (0.72 * radius, 0.72 * radius, 0.42 * height))]
    for k in range(count):
        turn = 2.0 * math.pi * (k + rng.between(-0.3, 0.3)) / count
        away, r = rng.between(0.42, 0.6) * radius, rng.between(0.4, 0.55) * radius
        z = centre_z + rng.between(-0.24, 0.26) * height
        lobes.append(Lobe((away * math.cos(turn), away * math.sin(turn), z), (r, r, 0.8 * r)))
    return tuple(lobes)
