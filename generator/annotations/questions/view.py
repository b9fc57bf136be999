"""Objects that an image shows, and words that refer to one of them and no other."""

import itertools
import math
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import Any

import cv2
import numpy as np

from gen_data.annotations.questions import resolution
from gen_data.config import data_files
from gen_data.core.boxes import BoxPx, OrientedBox
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.sample import Measured, PointPx, Utterance
from gen_data.core.scene import Scene
from gen_data.core.se3 import SE3, Array

Words = Mapping[str, str]
"""Words by their places in a form."""
CONTACTS = ("inside", "on", "held_by")
"""Predicates that state where an object is, the most telling one first."""
SIDES = ("left_of", "right_of")
LARGER = 1.25
"""Smallest ratio of the diagonals of two boxes of which one object is called the larger."""
DECIMALS = 6
POINT = OrientedBox(SE3(), (0.0, 0.0, 0.0))
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True)
class Thing:
    """An instance with a visible pixel.

    Attributes:
        category: Its category, in words.
        box: Around its visible pixels.
        clear: Whether it is visible enough to be spoken of.
        annotated: Whether it is annotated; others are landmarks only.
        color: Its colour word; empty = none is beyond doubt.
        diagonal_m: Diagonal of its 3D box.
        visible_px: Number of its visible pixels.
        solid: Its 3D box as far as geometry fills it, world.
    """

    instance_id: int
    category: str
    box: BoxPx
    clear: bool
    annotated: bool
    color: str = ""
    diagonal_m: float = 0.0
    visible_px: int = 0
    solid: OrientedBox = POINT

    @property
    def middle(self) -> float:
        """Column of the box's centre, doubled."""
        return self.box.x_min + self.box.x_max

    @property
    def center_m(self) -> Array:
        """Centre of its 3D box, world."""
        return np.array(self.solid.T_frame_box.translation_m)


@dataclass(frozen=True)
class View:
    """An image and the objects in it.

    Attributes:
        things: All with a visible pixel, also barely visible ones.
        edges: Subject, predicate, object: relations in both directions.
        present: Categories of all objects of the scene, visible or not.
        placeable: Categories that the template may place, sorted.
        scene: At the image's instant.
        reading: With the channels INSTANCE and AMODAL.
        assets: Geometry.
        tries: Groups of objects that a kind of question tries at most.
    """

    things: tuple[Thing, ...]
    edges: frozenset[tuple[int, str, int]]
    present: set[str]
    placeable: tuple[str, ...]
    scene: Scene
    reading: SensorReading
    assets: AssetLibrary
    tries: int = 36

    @cached_property
    def by_id(self) -> Mapping[int, Thing]:
        """All objects, by instance id."""
        return {t.instance_id: t for t in self.things}

    @cached_property
    def spoken(self) -> tuple[Thing, ...]:
        """Annotated objects to speak of."""
        silent = grammar()["unspoken"]
        return tuple(t for t in self.things if t.annotated and t.clear and t.category not in silent)

    @cached_property
    def countable(self) -> dict[str, tuple[int, ...]]:
        """Ids of the objects of each category whose number is beyond doubt, by its name."""
        found: dict[str, tuple[int, ...]] = {}
        for category in sorted({t.category for t in self.spoken}):
            doubtful = self.candidates(category)
            if all(t.clear and t.annotated and t.category == category for t in doubtful):
                found[category] = tuple(t.instance_id for t in doubtful)
        return found

    @cached_property
    def names(self) -> dict[int, str]:
        """Definite names of the objects that need no other word than their category, by id."""
        form = grammar()["expressions"]["only"]
        return {
            t.instance_id: form.format(thing=t.category)
            for t in self.things
            if t.clear
            and t.category not in grammar()["unspoken"]
            and len(self.candidates(t.category)) == 1
        }

    @cached_property
    def titles(self) -> dict[int, str]:
        """An expression for each spoken object, by id; with one of its pixels if no words fit."""
        form = grammar()["expressions"]["pixel"]
        return {
            t.instance_id: next(self.expressions(t), "")
            or form.format(thing=t.category, point=pixel_text(self.spot(t)[0]))
            for t in self.spoken
        }

    def expressions(self, thing: Thing) -> Iterator[str]:
        """Expressions that refer to one spoken object and no other."""
        forms = grammar()["expressions"]
        if thing.instance_id in self.names:
            yield self.names[thing.instance_id]
        others = [t for t in self.candidates(thing.category) if t != thing]
        for rule in RULES if others else ():
            for form, words in rule(self, thing, others):
                yield forms[form].format(thing=thing.category, **words)

    def candidates(self, category: str) -> tuple[Thing, ...]:
        """All objects that someone may call by a category's name."""
        return tuple(t for t in self.things if t.category in kin(category))

    def has(self, thing: Thing, predicate: str, other: int) -> bool:
        """Whether a relation holds."""
        return (thing.instance_id, predicate, other) in self.edges

    def objects(self, subject: int, predicate: str) -> list[int]:
        """Named objects that an object has a relation to, in order of id."""
        return [n for n in sorted(self.names) if (subject, predicate, n) in self.edges]

    @cached_property
    def sighted(self) -> tuple[tuple[Thing, resolution.Sight], ...]:
        """The spoken objects whose place the camera could measure."""
        found = (
            (t, resolution.sight(self.reading, t.instance_id, t.box, t.center_m))
            for t in self.spoken
        )
        return tuple((t, s) for t, s in found if s is not None)

    @cached_property
    def _spots(self) -> dict[int, tuple[PointPx, float]]:
        return {}

    def spot(self, thing: Thing) -> tuple[PointPx, float]:
        """The visible pixel farthest from the object's outline, and that distance [px]."""
        if thing.instance_id not in self._spots:
            ids = self.reading.channels[Channel.INSTANCE][thing.box.window()]
            mask = ids == thing.instance_id
            self._spots[thing.instance_id] = deepest(mask, thing.box.x_min, thing.box.y_min)
        return self._spots[thing.instance_id]

    @cached_property
    def salt(self) -> int:
        """A number that follows from the picture: it varies, and is not random."""
        facts = [(t.instance_id, t.box.x_min, t.box.y_min, t.visible_px) for t in self.things]
        return zlib.crc32(repr((facts, self.reading.camera.name)).encode())

    def key(self, kind: str, *about: object) -> int:
        """A number that follows from the picture, a kind of question and its objects."""
        return zlib.crc32(f"{self.salt} {kind} {about}".encode())

    def is_turned(self, kind: str, *about: object) -> bool:
        """Whether to ask for the opposite: for half of all pictures, whatever they show."""
        return bool(self.key(kind, *about) >> 13 & 1)

    def picks(
        self, kind: str, size: int, ordered: bool = False
    ) -> list[tuple[tuple[Thing, resolution.Sight], ...]]:
        """Groups of sighted objects in an order that follows from the picture, cut to a length."""
        choose = itertools.permutations if ordered else itertools.combinations
        groups = list(choose(self.sighted, size))
        groups.sort(key=lambda group: self.key(kind, *(t.instance_id for t, _ in group)))
        return groups[: self.tries]

    def asked(
        self, kind: str, forms: tuple[str, str], things: Sequence[Thing], words: Words, holds: bool
    ) -> tuple[str, str]:
        """A question with the answer yes or no, in the first form or in the opposite one."""
        turned = self.is_turned(kind, forms, *(t.instance_id for t in things))
        text = grammar()["questions"][kind][forms[turned]].format(**words)
        return text, "yes" if holds != turned else "no"


def measure(numbers: Iterable[float], unit: str, margin: float, least: float) -> Measured:
    """The numbers behind an answer, to six decimals: processors differ in the last bits."""
    found = tuple(round(float(n), DECIMALS) for n in numbers)
    return Measured(found, unit, round(float(margin), DECIMALS), round(least, DECIMALS))


def stated(
    kind: str, text: tuple[str, str], things: Sequence[Thing], measured: Measured, **more: Any
) -> Iterator[Utterance]:
    """A question with its answer, if its margin is at least the resolution of the sensor."""
    if measured.margin >= measured.resolution > 0.0:
        ids = tuple(t.instance_id for t in things)
        yield Utterance(kind, *text, ids, measured, **more)


def deepest(mask: Any, x_px: int, y_px: int) -> tuple[PointPx, float]:
    """The pixel of a mask farthest from its outside: its centre, and that distance [px]."""
    inner = cv2.distanceTransform(
        np.pad(mask.astype(np.uint8), 1), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
    )
    row, column = np.unravel_index(int(inner.argmax()), inner.shape)
    return (x_px + int(column) - 0.5, y_px + int(row) - 0.5), float(inner[row, column])


def pixel_text(point_px: PointPx) -> str:
    """A pixel in texts, by its number from 0."""
    return f"({math.floor(point_px[0])}, {math.floor(point_px[1])})"


def _ends(_view: View, thing: Thing, others: Sequence[Thing]) -> Iterator[tuple[str, Words]]:
    """Ends of a row of objects of one category: a mug next to a cup is not the leftmost mug."""
    if {t.category for t in others} == {thing.category}:
        for side, word in (("left_of", "leftmost"), ("right_of", "rightmost")):
            if all(is_beside(thing, side, t) for t in others):
                yield word, {}


def _sizes(_view: View, thing: Thing, others: Sequence[Thing]) -> Iterator[tuple[str, Words]]:
    """Superlatives of size that are true of an object beyond doubt."""
    if {t.category for t in others} == {thing.category}:
        if all(thing.diagonal_m > LARGER * t.diagonal_m for t in others):
            yield "largest", {}
        if all(t.diagonal_m > LARGER * thing.diagonal_m for t in others):
            yield "smallest", {}


def _colors(_view: View, thing: Thing, others: Sequence[Thing]) -> Iterator[tuple[str, Words]]:
    """The colour of an object, if all others certainly have another one."""
    if thing.color and all(t.color not in ("", thing.color) for t in others):
        yield "color", {"color": thing.color}


def _contacts(view: View, thing: Thing, others: Sequence[Thing]) -> Iterator[tuple[str, Words]]:
    """Contacts with named objects that no other object of the name has."""
    for predicate in CONTACTS:
        for landmark in view.objects(thing.instance_id, predicate):
            if all(t.clear and not view.has(t, predicate, landmark) for t in others):
                yield predicate, {"b": view.names[landmark]}


def _landmarks(view: View, thing: Thing, others: Sequence[Thing]) -> Iterator[tuple[str, Words]]:
    """Sides of named objects on which no other object of the name is: the nearest of each."""
    for side in SIDES:
        beside = [view.by_id[n] for n in view.objects(thing.instance_id, side)]
        beside = [t for t in beside if all(_is_across(o, side, t) for o in others)]
        if beside:
            nearest = min(beside, key=lambda t: abs(t.middle - thing.middle))
            yield side, {"b": view.names[nearest.instance_id]}


Rule = Callable[[View, Thing, Sequence[Thing]], Iterator[tuple[str, Words]]]
RULES: tuple[Rule, ...] = (_ends, _sizes, _colors, _contacts, _landmarks)
"""How objects are told from others of their name: forms of the grammar, and their words."""


def is_beside(one: Thing, side: str, other: Thing) -> bool:
    """Whether the boxes of two objects are separate, the first one on that side."""
    left, right = (one, other) if side == "left_of" else (other, one)
    return left.box.x_max <= right.box.x_min


def _is_across(one: Thing, side: str, landmark: Thing) -> bool:
    """Whether an object is not even partly on a side of a landmark's centre: nobody means it."""
    if side == "left_of":
        return 2 * one.box.x_min >= landmark.middle
    return 2 * one.box.x_max <= landmark.middle


def in_words(category: str) -> str:
    """A category as text."""
    return category.replace("_", " ")


@cache
def grammar() -> Mapping[str, Any]:
    """The table ``grammar.yaml``."""
    found: Mapping[str, Any] = data_files.load_data(__package__, "grammar")
    return found


@lru_cache(maxsize=256)
def kin(category: str) -> frozenset[str]:
    """Categories, in words, that may be meant by the name of one: itself and its kin."""
    groups: Sequence[Sequence[str]] = grammar()["kin"]
    named = ([in_words(name) for name in group] for group in groups)
    return frozenset({category}.union(*(group for group in named if category in group)))
