"""Views from windows: ground, houses, trees and hedges around a building, in true size."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gen_data.assets.families import declared
from gen_data.core import se3, streams
from gen_data.rooms.floor_plan import Room, between, draw_count, outer_radius_m

_STOREY_M = 3.0
_STEP_M = 0.3
"""Height of a ground floor over the ground."""
_NEAR = (("tree/young", 4), ("tree/round", 8), ("tree/birch", 8), ("hedge", 18), ("tree/apple", 4))
"""Families that stand before the houses, and numbers of their variants."""
_HOUSES = (
    ("building/house", 96),
    ("building/farmhouse", 64),
    ("building/residential", 96),
    ("building/house", 96),
    ("building/old_town", 96),
)
_FAR = (("horizon/trees", 8, 75.0), ("horizon/town", 8, 105.0), ("horizon/forest", 6, 110.0))
"""Families that close the view, numbers of their variants, distances of pieces [m]."""
_GROUNDS = ("texture/grass", "texture/grass", "texture/paving", "texture/asphalt")
_VARIANTS = 24
"""Of the variants of each family, so many are used: the first rooms of a data set know them all."""


@dataclass(frozen=True, slots=True)
class Outlook:
    """The surroundings of a building.

    Attributes:
        ground: Texture of the ground.
        ground_m: Its height below the floor.
        things: Assets and their poses.
    """

    ground: str
    ground_m: float
    things: tuple[tuple[str, se3.SE3], ...] = ()


def outlook_assets() -> tuple[str, ...]:
    """Ids of everything that may stand outside, and of its ground's textures."""
    families = {*_NEAR, *_HOUSES, *((family, variants) for family, variants, *_ in _FAR)}
    things = sorted(
        f"{family}?seed={seed}"
        for family, variants in families
        for seed in range(min(variants, _VARIANTS))
    )
    return (*things, *sorted({f"{ground}?seed={k}" for ground in _GROUNDS for k in range(4)}))


def draw_outlook(rooms: Sequence[Room], rng: streams.Rng) -> Outlook:
    """Draw houses around the rooms and greenery before them, each in a separate sector."""
    radius_m = outer_radius_m(tuple(rooms))
    storey = draw_count(rng, (0, 3)) if rooms[0].kind != "warehouse" else 0
    ground_m = _STEP_M + storey * _STOREY_M
    things = []
    for families, count, away_m in (
        (_HOUSES, draw_count(rng, (5, 8)), (18.0, 36.0)),
        (_NEAR, draw_count(rng, (5, 10)), (6.0, 16.0)),
    ):
        first = between(rng, (0.0, 2.0 * math.pi))
        for k in range(count):
            family, variants = families[draw_count(rng, (0, len(families) - 1))]
            seed = draw_count(rng, (0, min(variants, _VARIANTS) - 1))
            turn = first + 2.0 * math.pi * (k + between(rng, (-0.25, 0.25))) / count
            away = radius_m + between(rng, away_m)
            at = (away * math.cos(turn), away * math.sin(turn), -ground_m)
            # Fronts face the building, roughly, as along streets.
            yaw = turn + math.pi + between(rng, (-0.3, 0.3))
            things.append((f"{family}?seed={seed}", se3.SE3.about_z(yaw, at).rounded()))
    things += _end_of_view(ground_m, rng)
    ground = f"{_GROUNDS[draw_count(rng, (0, len(_GROUNDS) - 1))]}?seed={draw_count(rng, (0, 3))}"
    return Outlook(ground, ground_m, tuple(things))


def _end_of_view(ground_m: float, rng: streams.Rng) -> list[tuple[str, se3.SE3]]:
    """Pieces of a wood all around, which hide where the ground ends."""
    family, variants, far_m = _FAR[draw_count(rng, (0, len(_FAR) - 1))]
    length_m: float = declared(family, "length_m")
    count = math.ceil(2.0 * math.pi * far_m / length_m)
    first, pieces = between(rng, (0.0, 2.0 * math.pi)), []
    for k in range(count):
        turn = first + 2.0 * math.pi * k / count
        at = (far_m * math.cos(turn), far_m * math.sin(turn), -ground_m)
        seed = draw_count(rng, (0, variants - 1))
        pieces.append((f"{family}?seed={seed}", se3.SE3.about_z(turn + math.pi, at).rounded()))
    return pieces
