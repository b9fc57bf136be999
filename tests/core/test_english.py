"""Singulars and plurals of every category, against a list by hand and the package inflect."""

import importlib
from functools import cache
from importlib.resources import files

import pytest
import yaml

from gen_data.content import FAMILIES
from gen_data.core.english import count, plural

MEASURES = {
    "loaf loaves": "bread", "head heads": "broccoli", "portion portions": "french fries",
    "piece pieces": "butter, chicken", "set sets": "clothes, contact wires, parts bins, utensils",
    "group groups": "fields, hills, rubbish bags, shopping bags", "bunch bunches": "grapes, keys",
    "pair pairs": "glasses, headphones, scissors, shoes, sunglasses",
}  # fmt: skip
"""One and two measures of names that are not counted by themselves."""
BY_HAND = {
    name: (f"a {one} of {name}", f"two {two} of {name}")
    for (one, two), names in ((key.split(), text.split(", ")) for key, text in MEASURES.items())
    for name in names
} | {
    "knife": ("a knife", "two knives"),
    "mouse": ("a mouse", "two mice"),
    "person": ("a person", "two people"),
    "shelf": ("a shelf", "two shelves"),
    "tomato": ("a tomato", "two tomatoes"),
    "utility pole": ("a utility pole", "two utility poles"),
    # Of users' own files.
    "leaf": ("a leaf", "two leaves"),
    "potato": ("a potato", "two potatoes"),
    "sheep": ("a sheep", "two sheep"),
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
    engine = pytest.importorskip("inflect").engine()
    plurals = {name for name in categories() if engine.singular_noun(name)}

    # inflect takes a bus for several bu.
    assert {name for name in plurals if " of " not in plural(name)} == {"bus"}
