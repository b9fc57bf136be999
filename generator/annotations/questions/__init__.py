"""Kinds of sentences and questions about an image, one function each.

A kind is a function ``(View) -> Iterator[Utterance]`` and a line in this table, or an entry point
``gen_data.question`` of another package. It states an answer only if its margin is at least the
resolution of the sensor (``stated``), and wants yes and no equally often (``View.asked``).
"""

from collections.abc import Callable, Iterator
from typing import Any, cast

from gen_data.annotations.questions.view import View
from gen_data.core.plugins import PluginTable
from gen_data.core.sample import Utterance

Question = Callable[[View], Iterator[Utterance]]

TABLE = PluginTable[Any](
    "question",
    {
        "caption": "gen_data.annotations.questions.words:caption",
        "relation": "gen_data.annotations.questions.words:relation",
        "expression": "gen_data.annotations.questions.words:expression",
        "counting": "gen_data.annotations.questions.words:counting",
        "existence": "gen_data.annotations.questions.words:existence",
        "spatial": "gen_data.annotations.questions.words:spatial",
        "color": "gen_data.annotations.questions.words:color",
        "distance": "gen_data.annotations.questions.metres:distance",
        "size": "gen_data.annotations.questions.metres:size",
        "height": "gen_data.annotations.questions.metres:height",
        "order": "gen_data.annotations.questions.metres:order",
        "nearest": "gen_data.annotations.questions.metres:nearest",
        "comparison": "gen_data.annotations.questions.metres:comparison",
        "clearance": "gen_data.annotations.questions.metres:clearance",
        "reach": "gen_data.annotations.questions.metres:reach",
        "pointing": "gen_data.annotations.questions.pixels:pointing",
        "free_spot": "gen_data.annotations.questions.pixels:free_spot",
        "occlusion": "gen_data.annotations.questions.pixels:occlusion",
        "hidden_counting": "gen_data.annotations.questions.pixels:hidden_counting",
        "views": "gen_data.annotations.questions.instants:views",
        "change": "gen_data.annotations.questions.instants:change",
        "ego_motion": "gen_data.annotations.questions.instants:ego_motion",
    },
)
"""In the order of their utterances; third-party kinds follow."""


def load(name: str) -> Question:
    """The function of a kind. Raises ConfigError if there is none."""
    return cast(Question, TABLE.load(name))


def all_names() -> tuple[str, ...]:
    """Names of all kinds: of this table in its order, then of other packages."""
    return (*TABLE.entries, *(name for name in TABLE if name not in TABLE.entries))
