"""English words for objects and numbers; plurals and articles by inflect."""

from collections.abc import Sequence
from functools import cache, lru_cache
from typing import Any

NUMBERS = (
    "no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven",
    "twelve",
)  # fmt: skip
"""Words of small numbers; ``many`` above."""

MEASURES = {
    "bunch": ("grapes", "keys"),
    "group": ("fields", "hills", "rubbish bags", "shopping bags"),
    "head": ("broccoli",),
    "loaf": ("bread",),
    "pair": (
        "binoculars", "glasses", "headphones", "jeans", "pliers", "scissors", "shoes", "shorts",
        "sunglasses", "tongs", "trousers", "tweezers",
    ),
    "piece": ("butter", "chicken"),
    "portion": ("french fries",),
    "set": ("clothes", "contact wires", "parts bins", "utensils"),
}  # fmt: skip
"""Names that are plurals or cannot be counted, by the word that counts them."""

_MEASURE_OF = {name: measure for measure, names in MEASURES.items() for name in names}


@cache
def _engine() -> Any:
    """The library of English inflections; it takes a second or two to import."""
    import inflect

    return inflect.engine()


@lru_cache(maxsize=1024)
def article(name: str) -> str:
    """The indefinite article of a name."""
    return str(_engine().a(name)).partition(" ")[0]


@lru_cache(maxsize=1024)
def plural(name: str) -> str:
    """The plural of a name; of its last word, if it has several: "mugs", "pairs of scissors"."""
    if name in _MEASURE_OF:
        return f"{plural(_MEASURE_OF[name])} of {name}"
    return str(_engine().plural_noun(name))


def singular(name: str) -> str:
    """One of a name with its article: "a mug", "a pair of scissors"."""
    noun = f"{_MEASURE_OF[name]} of {name}" if name in _MEASURE_OF else name
    return f"{article(noun)} {noun}"


def count(name: str, number: int) -> str:
    """A number of objects, such as "a mug", "two mugs" and "two pairs of scissors"."""
    if number == 1:
        return singular(name)
    word = NUMBERS[number] if number < len(NUMBERS) else "many"
    return f"{word} {plural(name)}"


def join(names: Sequence[str], word: str = "and") -> str:
    """An enumeration: "a", "a and b", "a, b and c"; with another word than "and"."""
    return f" {word} ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def sentence(text: str) -> str:
    """A text with a capital letter."""
    return f"{text[0].upper()}{text[1:]}"
