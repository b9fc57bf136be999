"""English words for things and numbers."""

import re
from collections.abc import Sequence

NUMBERS = (
    "no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven",
    "twelve",
)  # fmt: skip
"""Words of small numbers; ``many`` above."""

IRREGULAR = {
    "person": "people", "man": "men", "woman": "women", "child": "children", "foot": "feet",
    "tooth": "teeth", "goose": "geese", "mouse": "mice", "knife": "knives", "loaf": "loaves",
    "leaf": "leaves", "shelf": "shelves", "half": "halves", "calf": "calves", "wolf": "wolves",
    "tomato": "tomatoes", "potato": "potatoes", "mango": "mangoes", "sheep": "sheep",
    "deer": "deer", "fish": "fish", "aircraft": "aircraft",
}  # fmt: skip
"""Plurals without a rule."""

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
_AN = re.compile(r"hour|heir|honest|x-ray|(?!uni[cfqtv]|u[st][aei]|eu|one\b|once)[aeiou]", re.I)
"""Begins with the sound of a vowel: an hour, an umbrella, but a unicorn, a utensil."""


def article(name: str) -> str:
    """The indefinite article of a name."""
    return "an" if _AN.match(name) else "a"


def plural(name: str) -> str:
    """The plural of a name; of its last word, if it has several: "mugs", "pairs of scissors"."""
    if name in _MEASURE_OF:
        return f"{plural(_MEASURE_OF[name])} of {name}"
    head, _, last = name.rpartition(" ")
    if last in IRREGULAR:
        form = IRREGULAR[last]
    elif last.endswith(("s", "x", "ch", "sh")):
        form = f"{last}es"
    elif last.endswith("y") and last[-2:-1] not in "aeiou":
        form = f"{last[:-1]}ies"
    else:
        form = f"{last}s"
    return f"{head} {form}".strip()


def singular(name: str) -> str:
    """One of a name with its article: "a mug", "a pair of scissors"."""
    noun = f"{_MEASURE_OF[name]} of {name}" if name in _MEASURE_OF else name
    return f"{article(noun)} {noun}"


def count(name: str, number: int) -> str:
    """A number of things, such as "a mug", "two mugs" and "two pairs of scissors"."""
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
