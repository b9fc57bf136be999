"""A kind of question of the annotation ``language``."""

from collections.abc import Iterator

from gen_data.annotations.questions.view import View
from gen_data.core.sample import Utterance


def greet(view: View) -> Iterator[Utterance]:
    """One greeting per image."""
    yield Utterance("stranger_greeting", "Hello.")
