"""Words on contact sheets and in Rerun."""

import numpy as np

from gen_data.core.capture import Channel
from gen_data.core.sample import CharacterTruth, Sample, TextTruth, WordTruth
from gen_data.preview.contact_sheet import make_tiles
from gen_data.preview.text_view import READABLE, UNREADABLE
from tests.preview.recorded import photograph, recorded

LEFT = ((10.5, 10.5), (30.5, 10.5), (30.5, 20.5), (10.5, 20.5))
RIGHT = ((30.5, 10.5), (50.5, 10.5), (50.5, 20.5), (30.5, 20.5))
LOW = ((10.5, 40.5), (50.5, 40.5), (50.5, 50.5), (10.5, 50.5))
BOTH = (LEFT[0], RIGHT[1], RIGHT[2], LEFT[3])


def word(text: str, quad: object, shares: tuple[float, ...], *, readable: bool) -> WordTruth:
    quads = (LEFT, RIGHT) if len(shares) == 2 else (quad,)
    characters = tuple(map(CharacterTruth, text, quads, shares))  # type: ignore[arg-type]
    return WordTruth(text, quad, characters, max(shares), 10.0, 2.0, readable)  # type: ignore[arg-type]


def sample(*words: WordTruth) -> Sample:
    text = TextTruth("AB", "zxx", "print", BOTH, "sign", 1, 1.0, True, words)
    return photograph(texts=(text,))


def drawn(*words: WordTruth, labels: bool = True) -> np.ndarray:
    (tile,) = make_tiles([sample(*words)], {"color": (Channel.RGB,)}, labels=labels)
    return tile.image


def is_drawn(pixels: np.ndarray, color: tuple[int, int, int]) -> bool:
    """Whether pixels [n, 3] have a colour; a smooth line of a pixel covers nine tenths of them."""
    return bool(
        (np.abs(pixels.astype(int) - color) <= 0.1 * np.abs(np.subtract(color, 90)) + 1).all()
    )


def test_sheets_outline_words_by_whether_they_can_be_read() -> None:
    image = drawn(
        word("AB", BOTH, (1.0, 1.0), readable=True), word("I", LOW, (0.4,), readable=False)
    )
    assert is_drawn(image[10, 12:49], READABLE)
    assert is_drawn(image[40, 12:49], UNREADABLE)
    assert (image[12:19, 30] == 90).all(), "no line between characters"
    assert (drawn(word("I", LOW, (1.0,), readable=True), labels=False) == 90).all()


def test_of_a_word_that_is_hidden_in_part_the_visible_characters_are_outlined() -> None:
    image = drawn(word("AB", BOTH, (1.0, 0.0), readable=False))
    assert is_drawn(image[12:19, 30], UNREADABLE)
    assert (image[5:25, 33:60] == 90).all()
    assert (drawn(word("AB", BOTH, (0.0, 0.0), readable=False)) == 90).all()


def test_rerun_has_visible_words_with_their_text() -> None:
    hidden = word("I", LOW, (0.0,), readable=False)
    stream = recorded(sample(word("AB", BOTH, (1.0, 1.0), readable=True), hidden))
    (words,) = stream.at("world/cameras/color/image/texts")
    strips = words.strips.as_arrow_array().to_pylist()
    assert strips == [[list(place) for place in (*BOTH, BOTH[0])]]
    assert words.labels.as_arrow_array().to_pylist() == ["AB"]
