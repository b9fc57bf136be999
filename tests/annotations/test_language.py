"""Language about images, checked by a reader who has only the picture's boxes and the relations."""

import colorsys
import re
from dataclasses import dataclass
from functools import cache
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.annotations.annotate import Thresholds, annotate_reading
from gen_data.annotations.color_words import cielab, color_word
from gen_data.annotations.instance_masks import InstanceMasks
from gen_data.annotations.language import Language
from gen_data.annotations.questions import words
from gen_data.annotations.questions.view import Thing, View, kin
from gen_data.annotations.relations import Relations
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.boxes import BoxPx
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.colorimetry import srgb_decode
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import ImageTruth, Utterance
from gen_data.core.scene import Camera, Scene
from gen_data.core.se3 import SE3
from tests.tiers import cases

WORDS = ("caption", "relation", "expression", "counting", "existence", "spatial", "color")


@dataclass(frozen=True)
class Picture:
    """Input of a reader: ids, their names and centres; and the relations in space."""

    truth: ImageTruth
    names: dict[int, str]
    columns: dict[int, float]
    pixels: dict[int, int]
    sizes_m: dict[int, float]
    colors: dict[int, set[str]]
    related: set[tuple[int, str, int]]
    scene: Scene

    def said(self, kind: str) -> list[Utterance]:
        return [u for u in self.truth.utterances or () if u.kind == kind]


@cache
def picture(config: str, index: int) -> Picture:
    """A sample of a shipped configuration with its text."""
    small = ("exporters=[]", "annotations=[]")
    wanted = frozenset({Channel.INSTANCE, Channel.AMODAL})
    with open_pipeline(load_config(config, overrides=small), wanted) as made:
        sample = made.sample(index)
        reading = next(iter(sample.capture.readings.values()))
        annotators = (InstanceMasks(), Relations(), Language(most=1000, kinds=WORDS))
        truth = annotate_reading(sample.scene, reading, annotators, Thresholds(), made.assets)
    image = np.asarray(reading.channels[Channel.INSTANCE])
    ids = [int(n) for n in np.unique(image) if n]
    names = {n: sample.scene.instance(n).category.replace("_", " ") for n in ids}
    columns = {n: float(np.nonzero((image == n).any(0))[0][[0, -1]].mean()) for n in ids}
    pixels = {n: int((image == n).sum()) for n in ids}
    related = {(r.subject, str(r.predicate), r.object) for r in truth.relations or ()}
    boxes = {n: sample.scene.instance(n).box3d for n in ids}
    sizes_m = {n: float(np.linalg.norm(box.size_m)) for n, box in boxes.items()}
    colors: dict[int, set[str]] = {n: set() for n in ids}
    for body in sample.scene.bodies:
        if body.instance_id in colors:
            for material in body.materials or made.assets.materials(body.asset):
                colors[body.instance_id] |= possible_words(material.base_color)
    return Picture(truth, names, columns, pixels, sizes_m, colors, related, sample.scene)


def possible_words(rgb: tuple[float, float, float]) -> set[str]:
    """Words that a surface may have by hue, saturation and value of its sRGB: wide, overlapping."""
    hue, saturation, value = colorsys.rgb_to_hsv(*(max(c, 0.0) ** (1 / 2.2) for c in rgb))
    hues = {
        "red": (335, 380), "orange": (15, 48), "yellow": (38, 72), "green": (75, 185),
        "blue": (180, 262), "purple": (255, 330), "pink": (300, 385), "brown": (355, 410),
    }  # fmt: skip
    found = {
        word
        for word, (low, high) in hues.items()
        if saturation > 0.15 and any(low <= 360 * hue + turn <= high for turn in (0, 360))
    }
    grey = {"white": value > 0.75, "gray": 0.2 < value < 0.85, "black": value < 0.35}
    return found | {
        word for word, fits in grey.items() if fits and (saturation < 0.3 or word == "black")
    }


PICTURES = [("tabletop", 0), ("tabletop", 5), ("tabletop", 11), ("bin_picking", 0)]
each = pytest.mark.parametrize(("config", "index"), cases(PICTURES, PICTURES[:1]))


def resolve(seen: Picture, text: str) -> set[int]:
    """Objects that an expression may mean, by its words alone."""
    match = re.fullmatch(
        r"the (?:(leftmost|rightmost|largest|smallest|red|green|blue|yellow|orange|purple|pink"
        r"|brown|white|black|gray) )?(.+?)"
        r"(?: (on|in|held by|to the left of|to the right of) (the .+))?",
        text,
    )
    assert match, text
    superlative, name, words, landmark = match.groups()
    found = {n for n, own in seen.names.items() if own == name}
    if superlative in ("leftmost", "rightmost"):
        pick = min if superlative == "leftmost" else max
        found = {pick(found, key=lambda n: seen.columns[n])}
    elif superlative in ("largest", "smallest"):
        pick = min if superlative == "smallest" else max
        found = {pick(found, key=lambda n: seen.sizes_m[n])}
    elif superlative:
        found = {n for n in found if superlative in seen.colors[n]}
    if landmark:
        (at,) = resolve(seen, landmark)
        spatial = {"on": "on", "in": "inside", "held by": "held_by"}
        if words in spatial:
            found = {n for n in found if (n, spatial[words], at) in seen.related}
        elif words == "to the left of":
            found = {n for n in found if seen.columns[n] < seen.columns[at]}
        else:
            found = {n for n in found if seen.columns[n] > seen.columns[at]}
    return found


@pytest.mark.slow
@each
def test_an_expression_refers_to_its_thing_and_no_other(config: str, index: int) -> None:
    """A reader who sees all visible objects, also barely visible ones, finds exactly one."""
    seen = picture(config, index)
    assert seen.said("expression")
    for said in seen.said("expression"):
        assert resolve(seen, said.text) == set(said.instances), said.text


@pytest.mark.slow
@each
def test_nothing_is_said_about_what_cannot_be_seen(config: str, index: int) -> None:
    """Every object of an utterance has at least the pixels of the threshold."""
    seen = picture(config, index)
    for said in seen.truth.utterances or ():
        assert all(seen.pixels.get(n, 0) >= 256 for n in said.instances), said


@pytest.mark.slow
@each
def test_numbers_are_those_in_the_picture(config: str, index: int) -> None:
    """Counted in the image of instance ids, with everything of that name."""
    seen = picture(config, index)
    for said in seen.said("counting"):
        assert said.instances
        (name,) = {seen.names[n] for n in said.instances}
        assert said.answer == str(sum(own == name for own in seen.names.values()))


@pytest.mark.slow
@each
def test_existence_has_both_answers_and_they_are_true(config: str, index: int) -> None:
    """An absent category is nowhere in the scene, not even hidden."""
    seen = picture(config, index)
    everywhere = {i.category.replace("_", " ") for i in seen.scene.instances}
    for said in seen.said("existence"):
        match = re.fullmatch(r"Is there an? (.+) in the image\?", said.text)
        assert match, said.text
        if said.answer == "yes":
            assert {seen.names[n] for n in said.instances} == {match[1]}
        else:
            assert not said.instances
            assert match[1] not in everywhere
    if config == "tabletop":
        assert {said.answer for said in seen.said("existence")} == {"yes", "no"}


@each
def test_answers_about_places_follow_from_relations(config: str, index: int) -> None:
    """Names resolve to one object each; sides agree with columns, places with contacts."""
    seen = picture(config, index)
    for said in seen.said("spatial"):
        if match := re.fullmatch(r"Is (the .+) to the (left|right) of (the .+)\?", said.text):
            (a,), (b,) = resolve(seen, match[1]), resolve(seen, match[3])
            left = seen.columns[a] < seen.columns[b]
            assert said.answer == ("yes" if left == (match[2] == "left") else "no")
        elif match := re.fullmatch(r"Where is (the .+)\?", said.text):
            (a,) = resolve(seen, match[1])
            words, _, place = said.answer.partition(" ")
            (b,) = resolve(seen, place)
            assert (a, {"on": "on", "in": "inside"}[words], b) in seen.related
        elif match := re.fullmatch(r"What can be seen (on|in) (the .+)\?", said.text):
            (b,) = resolve(seen, match[2])
            predicate = {"on": "on", "in": "inside"}[match[1]]
            assert set(said.instances) == {
                s for s, p, o in seen.related if (p, o) == (predicate, b)
            }
        else:
            assert re.fullmatch(
                r"Is (the .+) (closer to|farther from) the viewer than (the .+)\?", said.text
            )


@pytest.mark.slow
def test_sentences_state_relations() -> None:
    """Captions of a scene in which a hand holds an object."""
    seen = picture("tabletop", 5)
    texts = {said.text for said in seen.said("relation")}
    table = next(n for n, name in seen.names.items() if name == "table")

    assert "The jar is on the table." in texts
    jar = next(n for n, name in seen.names.items() if name == "jar")
    assert (jar, "on", table) in seen.related


def thing(number: int, category: str, x_min: int, x_max: int, **changes: Any) -> Thing:
    facts = {"clear": True, "annotated": True} | changes
    return Thing(number, category, BoxPx(x_min, 0, x_max, 10), **facts)


CAMERA = Camera("color", SE3(), Intrinsics.from_hfov(320, 240, 1.0))
READING = SensorReading("color", CAMERA, {})
PLACEABLE = ("candle", "cup")
ASSETS: Any = None


def view(*things: Thing, edges: set[tuple[int, str, int]] | None = None) -> View:
    present = {t.category for t in things}
    return View(things, frozenset(edges or ()), present, PLACEABLE, Scene("table"), READING, ASSETS)


def texts(of: View, kind: str) -> list[str]:
    return [u.text for u in getattr(words, kind)(of)]


def test_a_barely_visible_thing_takes_the_name_from_the_others() -> None:
    """Neither "the mug" nor a number of mugs is beyond doubt."""
    barely = view(thing(1, "mug", 0, 10), thing(2, "mug", 20, 30, clear=False))

    assert texts(barely, "counting") == []
    assert texts(barely, "expression") == ["the leftmost mug"]
    assert texts(view(thing(1, "mug", 0, 10)), "expression") == ["the mug"]


def test_kin_are_confused_and_are_not_asked_for() -> None:
    """A cup next to a mug may be called a mug; where there is a mug, no question names a cup."""
    both = view(thing(1, "mug", 0, 10), thing(2, "cup", 20, 30))

    assert "cup" in kin("mug")
    assert texts(both, "expression") == []
    assert texts(view(thing(1, "mug", 0, 10)), "existence") == [
        "Is there a mug in the image?",
        "Is there a candle in the image?",
    ]


def test_overlapping_boxes_have_no_leftmost_thing() -> None:
    """One must be next to all others."""
    assert texts(view(thing(1, "mug", 0, 10), thing(2, "mug", 9, 30)), "expression") == []
    assert texts(view(thing(1, "mug", 0, 10), thing(2, "mug", 10, 30)), "expression") == [
        "the leftmost mug",
        "the rightmost mug",
    ]


def test_a_side_of_a_landmark_tells_things_apart_only_if_no_other_reaches_there() -> None:
    """The second mug begins left of the bowl's centre: "to the left" might mean it."""
    edges = {(1, "left_of", 3), (3, "right_of", 1)}
    bowl = thing(3, "bowl", 40, 60)
    doubtful = view(thing(1, "mug", 0, 10), thing(2, "mug", 49, 70), bowl, edges=edges)
    certain = view(thing(1, "mug", 0, 10), thing(2, "mug", 50, 70), bowl, edges=edges)

    assert "the mug to the left of the bowl" not in texts(doubtful, "expression")
    assert "the mug to the left of the bowl" in texts(certain, "expression")


def test_a_colour_is_said_only_where_no_candidate_may_have_it() -> None:
    """For a red and a blue mug; not next to one whose colour is doubtful."""
    red, blue = thing(1, "mug", 0, 10, color="red"), thing(2, "mug", 5, 30, color="blue")

    assert texts(view(red, blue), "expression") == ["the red mug", "the blue mug"]
    assert texts(view(red, thing(2, "mug", 5, 30)), "expression") == []
    assert texts(view(red, thing(2, "cup", 5, 30, color="blue")), "expression") == [
        "the red mug", "the blue cup",
    ]  # fmt: skip
    assert texts(view(red), "color") == ["What color is the mug?"]
    assert texts(view(red, blue), "color") == []


def test_sizes_are_said_only_of_things_that_differ_clearly() -> None:
    """By a quarter at least, within one category."""
    small = thing(1, "mug", 0, 10, diagonal_m=0.1)

    for diagonal_m, said in ((0.13, ["the smallest mug", "the largest mug"]), (0.12, [])):
        other = thing(2, "mug", 5, 30, diagonal_m=diagonal_m)
        assert texts(view(small, other), "expression") == said
    assert texts(view(small, thing(2, "cup", 5, 30, diagonal_m=0.3)), "expression") == []


@pytest.mark.parametrize(
    ("srgb", "word"),
    [("DC143C", "red"), ("2E8B57", "green"), ("4682B4", "blue"), ("FFFFFF", "white"),
     ("000000", "black"), ("808080", "gray"), ("FFD700", "yellow"), ("FFC0CB", "pink"),
     ("800080", "purple"), ("FF8C00", "orange"), ("8B4513", "brown"), ("808000", ""),
     ("008080", ""), ("FF4500", ""), ("9ACD32", "")],
)  # fmt: skip
def test_web_colours_have_the_basic_word_of_their_name(srgb: str, word: str) -> None:
    """Crimson, sea green, steel blue, ...; olive, teal, orange red and yellow green have none."""
    encoded = np.array([int(srgb[k : k + 2], 16) / 255 for k in (0, 2, 4)])

    assert color_word(tuple(srgb_decode(encoded).tolist())) == word


def test_cielab_is_that_of_opencv() -> None:
    """To its single precision and its own digits of the matrix."""
    rgb = np.random.default_rng(0).uniform(0.0, 1.0, (1, 200, 3)).astype(np.float32)
    expected = cv2.cvtColor(rgb, cv2.COLOR_LRGB2LAB)

    assert np.abs(cielab(rgb[0].astype(float)) - expected[0]).max() < 0.2


def test_most_limits_each_kind() -> None:
    """Spread evenly over all possible ones."""
    row = view(*(thing(k, f"object {k}", 20 * k, 20 * k + 10) for k in range(7)))
    every = list(Language(most=100, kinds=("expression",))._utterances(row))

    assert list(Language(most=3, kinds=("expression",))._utterances(row)) == [
        every[k] for k in (0, 2, 4)
    ]
