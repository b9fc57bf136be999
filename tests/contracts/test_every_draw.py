"""Named draws of every family: sizes and choices that asset ids may ask for."""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256

import numpy as np
import pytest

from gen_data.assets import asset_arrays, asset_ids, families, importer
from gen_data.assets.family import Family
from gen_data.core.variant_rng import Draw, VariantRng, drawing
from tests.tiers import cases

FAMILIES = {
    name: family
    for name, family in families.own_families().items()
    if isinstance(family, Family) and family.variants
}
QUICK = {"desk", "chair", "mug", "gear", "wardrobe/door", "cone", "wheelie_bin", "building/shed"}
PRINTED = "its print is an image made for the size or the kind of the same seed"
STANDARD = "it is made in the sizes of a standard, in turn"
FIXED = "it has one shape; seeds change its colours"
PARAMETRIC = "its sizes are parameters; seeds change its colours"
MIXED = "it consists of things, each of which is drawn"
WITHOUT = {
    **dict.fromkeys(("can", "carton", "milk_carton", "ball"), PRINTED),
    **dict.fromkeys(("toy_block", "nut", "washer", "kitchen_unit", "kitchen_unit/door"), STANDARD),
    **dict.fromkeys(("gimbal", "router", "shoes", "vacuum_cleaner", "iron", "vise", "knife_block",
                     "toilet_brush", "bathroom_scale", "guitar", "drill"), FIXED),
    **dict.fromkeys(("overpass", "embankment"), PARAMETRIC),
    **dict.fromkeys(("crockery", "groceries", "hanging_clothes", "horizon/skyline"), MIXED),
    **dict.fromkeys(("door_stairs", "door_ramp"), "its sizes are parameters"),
    "bicycle": "frames take turns by seed; its other draws are pedals, colours and luggage",
    "motorcycle": "styles and riders take turns by seed, in step with their facts",
    "cyclist": "styles and riders take turns by seed, in step with their facts",
    "simple_person": "traits of one person depend on each other; poses are parameters",
}  # fmt: skip
"""Families without a named draw, and the reason."""


SEEDS = 6
"""Variants whose draws are read: no draw of a shipped family shows later for the first time."""
MORE_SEEDS = 16


@dataclass(frozen=True)
class Made:
    """One object of a family.

    Attributes:
        draws: Its named draws.
        twice: Names that one stream draws twice: a value asked for would go to both.
        digest: Digest of its geometry and materials.
    """

    draws: Mapping[str, Draw]
    twice: tuple[str, ...]
    digest: bytes


class Variants:
    """Objects of one family; variants without values asked for are made once for all tests."""

    def __init__(self, name: str) -> None:
        self.name, self.family = name, FAMILIES[name]
        self._made: dict[int, Made] = {}

    def first(self, most: int = SEEDS) -> Iterator[tuple[int, Made]]:
        for seed in range(min(most, self.family.variants)):
            if seed not in self._made:
                self._made[seed] = self.make(seed)
            yield seed, self._made[seed]

    def make(self, seed: int, **asked: asset_ids.ParameterValue) -> Made:
        """An object with values asked for, after checks."""
        with drawing(asked) as draws, names_drawn_twice() as twice:
            solid = self.family.build(**{**self.family.parameters, "seed": seed})
        assert np.isfinite(solid.mesh.vertices_m).all()
        assert len(solid.mesh.faces)
        assert len(solid.collision.parts_m)
        for key, value in asked.items():
            assert draws[key].value == pytest.approx(value)
        arrays = asset_arrays.pack_imported(importer.ImportedMesh(solid.mesh, solid.collision, {}))
        parts = b"".join(array.tobytes() for _, array in sorted(arrays.items()))
        return Made(draws, tuple(twice), sha256(parts).digest())


@contextmanager
def names_drawn_twice() -> Iterator[list[str]]:
    """Record names that a stream draws once more."""
    settle, alive = VariantRng._settle, list[VariantRng]()
    seen: set[tuple[int, str]] = set()
    twice: list[str] = []

    def once(rng: VariantRng, key: str, *arguments: object, **options: bool) -> object:
        if key:
            if (id(rng), key) in seen:
                twice.append(key)
            seen.add((id(rng), key))
            # Else another generator may take its id.
            alive.append(rng)
        return settle(rng, key, *arguments, **options)  # type: ignore[arg-type]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(VariantRng, "_settle", once)
        yield twice


@pytest.fixture(scope="module")
def variants(request: pytest.FixtureRequest) -> Variants:
    """Objects of one family; tests of one family follow each other."""
    return Variants(request.param)


def every(names: Iterable[str]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("variants", cases(sorted(names), QUICK), indirect=True)


def some_values(draw: Draw) -> tuple[asset_ids.ParameterValue, ...]:
    """The lowest, middle and highest value; of a range, the ends and the value drawn."""
    if draw.is_range:
        low, high = (float(end) for end in draw.options if isinstance(end, (int, float)))
        return (low, draw.value, high) if high > low else (low,)
    return tuple({0: draw.options[0], 1: draw.options[len(draw.options) // 2],
                  2: draw.options[-1]}.values())  # fmt: skip


@every(FAMILIES)
def test_every_family_has_a_named_draw_or_a_reason(variants: Variants) -> None:
    """Names are keys of ids that hide no parameter; values are written as in ids."""
    found = [made.draws for _, made in variants.first()]
    assert any(found) == (variants.name not in WITHOUT)
    for key, draw in ((key, draw) for draws in found for key, draw in draws.items()):
        assert re.fullmatch("[a-z][a-z0-9_]*", key)
        assert key not in {"seed", *variants.family.parameters}
        for value in draw.options:
            asked = asset_ids.parse_asset_id(str(asset_ids.AssetId(variants.name, {key: value})))
            assert asked.parameters[key] == value


@every(FAMILIES.keys() - WITHOUT)
def test_every_value_of_a_named_draw_makes_a_valid_object(variants: Variants) -> None:
    """Both ends and a value between; in some variant two differ in shape or material.

    A house without a wing has a width of its wing, which nothing shows. Parts draw what their
    piece needs.
    """
    named: set[str] = set()
    shown: set[str] = set()
    for seed, made in variants.first(MORE_SEEDS):
        if seed >= SEEDS and shown == named:
            break
        new = made.draws.keys() - named
        named |= made.draws.keys()
        for key in new | (made.draws.keys() - shown):
            draw = made.draws[key]
            values = dict.fromkeys(some_values(draw))
            others = [variants.make(seed, **{key: one}) for one in values if one != draw.value]
            if len(values) == 1 or {other.digest for other in others} - {made.digest}:
                shown.add(key)
    assert "part_of" in variants.family.tags or shown == named


@every(FAMILIES)
def test_no_stream_draws_a_name_twice(variants: Variants) -> None:
    """A value asked for would go to both draws."""
    assert [made.twice for _, made in variants.first() if made.twice] == []


@every(name for name, family in FAMILIES.items() if "part_of" in family.tags)
def test_parts_draw_what_their_piece_draws(variants: Variants) -> None:
    """A piece's id with other parameters is its part's id: the door fits."""
    piece = Variants(variants.name.rpartition("/")[0])
    for (_, whole), (_, part) in zip(piece.first(), variants.first(), strict=True):
        assert whole.draws.keys() <= part.draws.keys()
