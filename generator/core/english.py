"""English words for things and numbers."""

from __future__ import annotations

from collections.abc import Sequence

NUMBERS = (
    "no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven",
    "twelve",
)  # fmt: skip
"""Words of small numbers; ``many`` above."""

IRREGULAR = {
    "person": "people", "knife": "knives", "loaf": "loaves", "shelf": "shelves", "mouse": "mice",
}  # fmt: skip
"""Plurals without a rule."""


def article(name: str) -> str:
    """The indefinite article of a name."""
    return "an" if name[:1] in "aeiou" else "a"


def plural(name: str) -> str:
    """The plural of a name; of its last word, if it has several."""
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


def count(name: str, number: int) -> str:
    """A number of things, such as "a mug" and "two mugs"."""
    if number == 1:
        return f"{article(name)} {name}"
    word = NUMBERS[number] if number < len(NUMBERS) else "many"
    return f"{word} {plural(name)}"


def join(names: Sequence[str]) -> str:
    """An enumeration: "a", "a and b", "a, b and c"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
