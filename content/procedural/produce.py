"""Grapes, broccoli and mushrooms: many berries, florets and caps that grow on one stalk."""

import math

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.food_shapes import food_material, plain_food, turned, wobble, wrap
from gen_data.content.procedural.material_presets import printed_material
from gen_data.content.procedural.patches import Array, Patch, join_patches, make_centred_solid, unit
from gen_data.core.variant_rng import VariantRng, in_turn

# Steps in which berries push each other apart; overlaps are then below a tenth of a berry.
_RELAXATIONS = 28
_TWIG = ("#7a7a3a", "#6b5a34", "#8a8a4a")


def grapes(rng: VariantRng) -> Solid:
    """A bunch of 30 to 80 grapes lying along X, its stalk towards +X. Slots: skins, stalk.

    Berries are 15 mm to 23 mm thick, bunches 0.1 m to 0.19 m long (assumed, within 10 % of fruit on
    sale).
    """
    count = grape_count(rng.seed)
    thick = rng.between(0.0075, 0.0115, "berry_radius_m")
    slim = rng.choose((1.0, 1.05, 1.15, 1.35), "slim")
    places = _packed(count, thick, rng)
    berry = shapes.ball(lambda d: thick * d * np.array([1.0, 1.0, slim]), 7, 10)
    groups: tuple[list[Patch], ...] = ([], [], [])
    for i, place in enumerate(places):
        away = np.array([0.0, place[1], place[2] - 0.4 * places[:, 2].max()])
        lean = np.cross([0.0, 0.0, 1.0], away + 1e-9)
        angle = math.atan2(float(np.hypot(away[0], away[1])), float(away[2])) + rng.between(
            -0.4, 0.4
        )
        one = turned(berry.rotated("z", rng.between(0.0, 6.28)), lean, angle)
        size = rng.between(0.88, 1.06)
        groups[i % 3].append(one.scaled(size, size, size).moved(*place.tolist()))
    patches = [join_patches(group).painted(k) for k, group in enumerate(groups)]
    # Skins of one kind: textures take their grounds in turn by seed, and there are four.
    skins = [
        printed_material(
            f"texture/fruit_skin?kind=grape&seed={rng.seed + 40 * k}", rng.between(0.25, 0.4)
        )
        for k in range(3)
    ]
    berries = np.concatenate([p.corners_m.reshape(-1, 3) for p in patches])
    stalk, twigs = _stalk(places, rng)
    patches.append(join_patches([stalk, *twigs]).painted(3))
    materials = [*skins, plain_food(_TWIG, 0.8, rng)]
    cuts = np.quantile(places[:, 0], np.linspace(0.0, 1.0, 6))
    owner = np.clip(np.searchsorted(cuts, places[:, 0]) - 1, 0, 4)
    order = np.concatenate([np.arange(count)[k::3] for k in range(3)])
    label = np.repeat(owner[order], len(berry.corners_m) * 3)
    parts = [wrap(berries[label == k]) for k in range(5) if (label == k).any()]
    return make_centred_solid(patches, materials, [*parts, wrap(stalk.corners_m, 16)])


def grape_count(seed: int) -> int:
    """Number of berries of a variant."""
    return in_turn((44, 68, 34, 80, 52, 30, 60, 74, 38), seed)


def grapes_facts(seed: int) -> Facts:
    """Number of berries."""
    return Facts("", {"count": str(grape_count(seed))})


def _packed(count: int, radius: float, rng: VariantRng) -> Array:
    """Centres of berries in a bunch that lies on z = 0, shape [count, 3]; broad towards +X."""
    length = radius * 2.0 * (count / rng.between(2.3, 3.2)) ** 0.5 * rng.between(1.0, 1.25)
    x = rng.random(count) ** 0.8
    wide = radius * (count / 11.0) ** 0.5 * (0.35 + 1.0 * np.sin(0.35 + 2.0 * x) * x**0.5) * 1.3
    turn, out = 2.0 * math.pi * rng.random(count), np.sqrt(rng.random(count))
    y, z = wide * out * np.cos(turn), wide * (1.0 + 0.8 * out * np.sin(turn))
    p = np.stack([length * (x - 0.5), y, z], axis=1)
    reach = 1.88 * radius
    for _ in range(_RELAXATIONS):
        gap = p[:, None] - p[None]
        away = np.sqrt((gap**2).sum(axis=2)) + np.eye(count)
        push = np.maximum(reach - away, 0.0) / away * (1.0 - np.eye(count))
        p = p + 0.35 * np.einsum("ij,ijk->ik", push, gap)
        # Gravity and the table: the bunch is flatter than it hung.
        p[:, 2] = np.maximum(p[:, 2] - 0.02 * radius, radius)
        p[:, 1] *= 0.998
    return p


def _stalk(places: Array, rng: VariantRng) -> tuple[Patch, list[Patch]]:
    """The main stalk, out of the bunch towards +X, and short side twigs inside."""
    end = places[:, 0].max()
    middle = places[places[:, 0] > np.quantile(places[:, 0], 0.7)].mean(axis=0)
    start = np.quantile(places[:, 0], 0.25)
    out = rng.between(0.02, 0.04)
    knots = [
        (start, 0.0, float(middle[2])),
        (0.5 * (start + end), 0.0, float(middle[2]) * 1.05),
        (end, float(middle[1]), float(middle[2])),
        (end + out, float(middle[1]) + rng.between(-0.012, 0.012), float(middle[2]) * 1.1),
    ]
    path = shapes.space_evenly(shapes.spline(knots, 30), 14)
    swell = np.concatenate([np.linspace(0.6, 1.0, 13), [1.5]])
    main = shapes.sweep(path, shapes.circle(0.0019, 7), scale=swell)
    twigs = []
    for place in places[:: max(1, len(places) // 14)]:
        foot = path[int(np.argmin(((path - place) ** 2).sum(axis=1)))]
        if math.dist(foot, place) > 0.004:
            line = np.linspace(foot, place, 4)
            twigs.append(shapes.sweep(line, shapes.circle(0.001, 5), up=(0.3, 0.5, 0.81)))
    return main, twigs


def broccoli(rng: VariantRng) -> Solid:
    """A head or a floret of broccoli standing on its stalk. Slots: florets, stalk.

    Heads are 0.09 m to 0.15 m wide, florets 0.04 m to 0.07 m (assumed, within 15 %).
    """
    is_head = broccoli_kind(rng.seed) == "head"
    radius = (
        rng.between(0.045, 0.07, "radius_m") if is_head else rng.between(0.02, 0.034, "radius_m")
    )
    count = rng.choose((22, 26, 30), "count") if is_head else rng.choose((7, 9, 11), "count")
    high = radius * rng.between(0.75, 0.95)
    rise = radius * rng.between(0.9, 1.2)
    florets, arms = [], []
    i = np.arange(count) + 0.5
    turn = math.pi * (3.0 - math.sqrt(5.0)) * i
    slope = np.arccos(1.0 - 1.05 * i / count)
    size = radius * 1.45 / count**0.5
    for angle, lean in zip(turn.tolist(), slope.tolist(), strict=True):
        way = np.array(
            [math.sin(lean) * math.cos(angle), math.sin(lean) * math.sin(angle), math.cos(lean)]
        )
        reach = np.array([radius - 0.6 * size, radius - 0.6 * size, high])
        tip = way * reach * rng.between(0.93, 1.07)
        florets.append(
            _floret(size * rng.between(0.9, 1.15), way, rng).moved(
                float(tip[0]), float(tip[1]), float(tip[2]) + rise
            )
        )
        foot = np.array([0.2 * tip[0], 0.2 * tip[1], 0.55 * rise])
        path = np.linspace(foot, tip + np.array([0.0, 0.0, rise - 0.1 * size]), 3)
        arms.append(shapes.sweep(path, shapes.circle(0.3 * size, 6), up=(0.6, 0.8, 0.0)))
    girth = radius * (0.32 if is_head else 0.28)
    corners = [
        (0.0, 0.0),
        (0.9 * girth, 0.0),
        (girth, 0.35 * rise),
        (1.3 * girth, 0.9 * rise),
        (0.0, 1.1 * rise),
    ]
    trunk = shapes.lathe(shapes.fillet(corners, [0.0, 0.003, 0.01, 0.01, 0.0], 3), 18)
    crown = join_patches(florets).painted(0)
    stalk = join_patches([trunk, *arms]).painted(1)
    materials = [
        food_material("broccoli", rng.seed, 0.75, 0.05),
        plain_food(("#9fb56a", "#b5c484", "#8fa85a"), 0.55, rng),
    ]
    points = crown.corners_m.reshape(-1, 3)
    parts = [wrap(points), wrap(stalk.corners_m)]
    return make_centred_solid([crown, stalk], materials, parts, 80.0)


def broccoli_kind(seed: int) -> str:
    """Whether it is a whole head."""
    return in_turn(("head", "floret"), seed)


def broccoli_facts(seed: int) -> Facts:
    """Head or floret."""
    return Facts(broccoli_kind(seed))


def _floret(size: float, way: Array, rng: VariantRng) -> Patch:
    """A cluster of buds around the origin, thickest towards ``way``."""
    buds = 7
    i = np.arange(buds) + 0.5
    z = 1.0 - 1.25 * i / buds
    turn = 2.399963 * i + rng.between(0.0, 6.28)
    r = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    places = 0.62 * size * np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)
    bumps = wobble(3, 0.1, rng)

    def shape(d: Array) -> Array:
        swell = bumps(2.0 * np.arctan2(d[..., 1], d[..., 0]) + 4.0 * d[..., 2])
        return np.asarray(0.52 * size * d * swell[..., None])

    bud = shapes.ball(shape, 5, 6)
    cluster = join_patches(
        bud.rotated("z", rng.between(0.0, 6.28)).moved(*place.tolist()) for place in places
    )
    axis = np.cross([0.0, 0.0, 1.0], way + np.array([1e-9, 0.0, 0.0]))
    return turned(cluster, axis, math.acos(max(-1.0, min(1.0, float(unit(way[None])[0, 2])))))


def mushroom(rng: VariantRng) -> Solid:
    """A button mushroom standing on its stalk. Slots: cap, gills, stalk.

    Caps are 30 mm to 65 mm wide (UNECE FFV-24: from 15 mm; above, assumed).
    """
    radius = rng.between(0.015, 0.032, "radius_m")
    high, stem = radius * rng.between(0.8, 1.15), radius * rng.between(0.5, 0.9)
    foot = radius * rng.between(0.34, 0.46)
    veil = radius * rng.between(0.2, 0.45)
    dome = shapes.fillet(
        [
            (foot, stem),
            (0.88 * radius, stem - 0.35 * veil),
            (radius, stem + 0.3 * veil),
            (0.86 * radius, stem + 0.72 * high),
            (0.4 * radius, stem + high),
            (0.0, stem + high),
        ],
        [0.0, 0.1 * radius, 0.3 * radius, 0.4 * radius, 0.4 * radius, 0.0],
        5,
    )
    outline = wobble(4, 0.025, rng)
    gills = [(0.0, stem + 0.002), (foot, stem)]
    patches = [
        shapes.lathe(dome, 36).painted(0),
        shapes.lathe(gills, 36).painted(1),
        shapes.lathe(
            shapes.fillet(
                [(0.0, 0.0), (1.08 * foot, 0.0), (0.92 * foot, stem), (0.0, stem + 0.004)],
                [0.0, 0.2 * foot, 0.1 * foot, 0.0],
                3,
            ),
            24,
        ).painted(2),
    ]
    warped = []
    for patch in patches[:2]:
        corners = patch.corners_m.copy()
        away = np.sqrt((corners[..., :2] ** 2).sum(axis=2))
        angle = np.where(away > 1e-6, np.arctan2(corners[..., 1], corners[..., 0]), 0.0)
        corners[..., :2] *= outline(angle)[..., None]
        warped.append(Patch(corners, patch.uvs, patch.slots))
    tone = food_material("mushroom", rng.seed, 0.6, 0.06)
    pale = plain_food(("#efe6d6", "#e6dac4"), 0.7, rng)
    lean = rng.between(0.0, 0.06, "lean_rad")
    parts = [wrap(warped[0].corners_m), wrap(patches[2].corners_m, 24)]
    if rng.seed % 2:
        # Picked ones lie on their side as often as they stand.
        turn = 0.5 * math.pi + lean
        warped = [p.rotated("y", turn) for p in warped]
        patches[2] = patches[2].rotated("y", turn)
        parts = [wrap(warped[0].corners_m), wrap(patches[2].corners_m, 24)]
    return make_centred_solid([*warped, patches[2]], [tone, pale, pale], parts)
