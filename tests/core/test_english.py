"""Singulars and plurals of every category, against a list by hand and the package inflect."""

import importlib
from functools import cache
from importlib.resources import files

import pytest
import yaml

from gen_data.content import FAMILIES
from gen_data.core.english import count, plural

BY_HAND = {
    "bread": ("a loaf of bread", "two loaves of bread"),
    "broccoli": ("a head of broccoli", "two heads of broccoli"),
    "butter": ("a piece of butter", "two pieces of butter"),
    "chicken": ("a piece of chicken", "two pieces of chicken"),
    "clothes": ("a set of clothes", "two sets of clothes"),
    "contact wires": ("a set of contact wires", "two sets of contact wires"),
    "fields": ("a group of fields", "two groups of fields"),
    "french fries": ("a portion of french fries", "two portions of french fries"),
    "glasses": ("a pair of glasses", "two pairs of glasses"),
    "grapes": ("a bunch of grapes", "two bunches of grapes"),
    "headphones": ("a pair of headphones", "two pairs of headphones"),
    "hills": ("a group of hills", "two groups of hills"),
    "keys": ("a bunch of keys", "two bunches of keys"),
    "knife": ("a knife", "two knives"),
    "mouse": ("a mouse", "two mice"),
    "parts bins": ("a set of parts bins", "two sets of parts bins"),
    "person": ("a person", "two people"),
    "rubbish bags": ("a group of rubbish bags", "two groups of rubbish bags"),
    "scissors": ("a pair of scissors", "two pairs of scissors"),
    "shelf": ("a shelf", "two shelves"),
    "shoes": ("a pair of shoes", "two pairs of shoes"),
    "shopping bags": ("a group of shopping bags", "two groups of shopping bags"),
    "tomato": ("a tomato", "two tomatoes"),
    "utensils": ("a set of utensils", "two sets of utensils"),
    "utility pole": ("a utility pole", "two utility poles"),
    # Of users' own files.
    "leaf": ("a leaf", "two leaves"),
    "potato": ("a potato", "two potatoes"),
    "sheep": ("a sheep", "two sheep"),
    "sunglasses": ("a pair of sunglasses", "two pairs of sunglasses"),
    "umbrella": ("an umbrella", "two umbrellas"),
    "unicorn": ("a unicorn", "two unicorns"),
    "hourglass": ("an hourglass", "two hourglasses"),
    "wine glass": ("a wine glass", "two wine glasses"),
    "woman": ("a woman", "two women"),
    "piano": ("a piano", "two pianos"),
    "photo": ("a photo", "two photos"),
}


@cache
def categories() -> frozenset[str]:
    modules = [importlib.import_module(name) for name in FAMILIES]
    found = {f.category for m in modules for f in getattr(m, "FAMILIES", {}).values()}
    for path in files("gen_data.packs").iterdir():
        if path.name.endswith(".yaml"):
            found |= named_in(yaml.safe_load(path.read_text("utf-8")))
    return frozenset(name.replace("_", " ") for name in found)


def named_in(value: object) -> set[str]:
    if isinstance(value, dict):
        own = {str(v) for k, v in value.items() if k == "category" and isinstance(v, str)}
        return own.union(*map(named_in, value.values()))
    return set().union(*map(named_in, value)) if isinstance(value, list) else set()


@pytest.mark.parametrize("name", sorted(BY_HAND))
def test_one_and_two_of_irregular_names(name: str) -> None:
    """As a reader of English expects them."""
    assert (count(name, 1), count(name, 2)) == BY_HAND[name]


@pytest.mark.slow
def test_no_category_is_a_plural_without_a_measure() -> None:
    """A pair of scissors: a name that inflect takes for a plural is counted in something."""
    inflect = pytest.importorskip("inflect")
    engine = inflect.engine()
    plurals = {name for name in categories() if engine.singular_noun(name)}

    # inflect takes a bus for several bu.
    assert {name for name in plurals if " of " not in plural(name)} == {"bus"}
