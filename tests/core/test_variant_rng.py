"""Draws of variants: the same stream for every asset id."""

import re

import pytest

from gen_data.core.variant_rng import Draw, DrawnValue, VariantRng, drawing, variant_rng


def draw_desk(seed: int) -> dict[str, object]:
    """A family in small: a range, a whole number, an option, a chance, and their consequences."""
    rng = variant_rng("desk", seed)
    return {
        "width_m": rng.between(1.2, 1.8, "width_m"),
        "shelves": rng.whole(2, 6, "shelves"),
        "style": rng.choose(("oak", "steel", "oak"), "style"),
        "drawers": rng.chance(0.5, "drawers"),
        "panel": rng.turn((False, True), "panel"),
        "rest": rng.between(0.0, 1.0),
    }


@pytest.mark.parametrize(
    ("name", "asked", "value"),
    [
        ("width_m", 1.6, 1.6), ("width_m", 1.8, 1.8), ("width_m", 1.2, 1.2), ("shelves", 5, 5),
        ("style", "steel", "steel"), ("drawers", "true", True), ("drawers", "false", False),
        ("panel", "true", True),
    ],
)  # fmt: skip
def test_a_value_asked_for_moves_no_other(name: str, asked: DrawnValue, value: object) -> None:
    """It replaces the number drawn; the number is taken from the stream all the same."""
    free = draw_desk(4)
    with drawing({name: asked}) as drawn:
        found = draw_desk(4)
    assert found == {**free, name: value}
    assert drawn[name].value == asked


def test_names_change_no_draw_and_outside_of_assets_nothing_is_recorded() -> None:
    """A stream with names is the stream without them."""
    named, plain = variant_rng("desk", 7), variant_rng("desk", 7)
    assert named.between(2.0, 3.0, "a") == plain.between(2.0, 3.0)
    assert named.choose("xyz", "b") == plain.choose("xyz")
    assert named.chance(0.3, "c") == plain.chance(0.3)
    assert named.whole(2, 7, "d") == int(plain.between(2, 7))
    assert named.turn("xyz", "e") == "y"
    assert named.random() == plain.random()

    rng = variant_rng("square", 0)
    assert isinstance(rng, VariantRng)
    assert rng.drawing is None


def test_draws_are_recorded_in_order_with_all_possible_values() -> None:
    """Ranges by both ends, options once each, truth values as words of ids."""
    with drawing({}) as drawn:
        found = draw_desk(0)
    assert list(drawn) == ["width_m", "shelves", "style", "drawers", "panel"]
    assert drawn["width_m"] == Draw((1.2, 1.8), True, found["width_m"])  # type: ignore[arg-type]
    assert drawn["shelves"].options == (2, 3, 4, 5)
    assert drawn["style"].options == ("oak", "steel")
    assert drawn["drawers"].options == drawn["panel"].options == ("false", "true")


@pytest.mark.parametrize(("name", "asked", "message"), [
    ("width_m", 1.81, "width_m expects a number from 1.2 to 1.8"),
    ("width_m", "wide", "width_m expects a number from 1.2 to 1.8"),
    ("width_m", (1.3, 1.4), "width_m expects a number from 1.2 to 1.8"),
    ("shelves", 6, "shelves is none of 2, 3, 4, 5"),
    ("shelves", 2.5, "shelves is none of 2, 3, 4, 5"),
    ("style", "steal", "style is none of oak, steel (did you mean 'steel'?)"),
    ("drawers", 1, "drawers is none of false, true"),
])  # fmt: skip
def test_impossible_values_are_refused(name: str, asked: DrawnValue, message: str) -> None:
    """The message has the range, or all options and the nearest."""
    with drawing({name: asked}), pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        draw_desk(0)


@pytest.mark.parametrize("asked", [0, 17, 999_999, 17.0])
def test_many_whole_numbers_are_recorded_by_their_ends(asked: DrawnValue) -> None:
    with drawing({"number": asked}) as drawn:
        found = variant_rng("code", 1).whole(0, 1_000_000, "number")
    assert (found, type(found)) == (asked, int)
    assert drawn["number"] == Draw((0, 999_999), True, asked)


@pytest.mark.parametrize("asked", [-1, 1_000_000, 0.5, "many"])
def test_others_than_many_whole_numbers_are_refused(asked: DrawnValue) -> None:
    message = "^number expects a whole number from 0 to 999999$"
    with drawing({"number": asked}), pytest.raises(ValueError, match=message):
        variant_rng("code", 1).whole(0, 1_000_000, "number")


def test_the_first_stream_decides_which_streams_belong_to_the_asset() -> None:
    """A bowl's contents keep their own height, as do later assets."""
    with drawing({"height_m": 0.2}) as drawn:
        own = variant_rng("bowl/choice", 1).between(0.1, 0.3, "height_m")
        content = variant_rng("apple", 1).between(0.1, 0.3, "height_m")
        again = variant_rng("bowl", 1).between(0.1, 0.3, "height_m")
    after = variant_rng("bowl", 1).between(0.1, 0.3, "height_m")
    assert own == again == 0.2
    assert 0.2 not in (content, after)
    assert list(drawn) == ["height_m"]
