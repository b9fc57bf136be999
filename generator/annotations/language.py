"""Language about images: captions, referring expressions, and questions with their answers.

Everything is a function of the scene graph and of what the image shows: nothing is drawn at random,
and nothing is said about what cannot be seen. The grammar is the table ``language.yaml``.
"""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache
from typing import Any, ClassVar, Literal

from pydantic import Field

from gen_data.annotations import color_words, instance_extents, relations, visibility
from gen_data.config import base_model, data_files
from gen_data.core.boxes import BoxPx
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.english import count, join, plural, singular
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.sample import ImageTruth, ObjectTruth, Utterance, both_ways
from gen_data.core.scene import ObjectGroup, Scene

Words = Mapping[str, str]
"""Words by their places in a form."""
CONTACTS = ("inside", "on", "held_by")
"""Predicates that say where a thing is, the most telling one first."""
SIDES = ("left_of", "right_of")
LARGER = 1.25
"""Smallest ratio of the diagonals of two boxes of which one thing is called the larger."""


class Language(base_model.Strict):
    """Captions, relations, referring expressions, and questions about number, existence and place.

    A thing is spoken of if it is clearly visible. A category is countable, and a thing has a name
    of its own ("the mug"), only if that is true with every barely visible thing, and with those of
    similar categories (``kin`` in ``language.yaml``). An expression is true of one thing in the
    image; "leftmost" and "to the left" mean separate boxes, and no other candidate is near enough
    to be meant. Colours are true base colours (``color_words``), said only where that of every
    candidate is beyond doubt; "largest" and "smallest" compare true sizes of one category.
    Questions about absent things name categories that the template could have placed and the scene
    does not have.

    Attributes:
        min_visible_px: Smallest number of visible pixels of a thing to be spoken of.
        min_visible_fraction: Smallest visible share of its silhouette.
        most: Largest number of utterances of one kind per image; they are spread evenly over those
            that are possible.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE, Channel.AMODAL})
    type: Literal["language"] = "language"
    min_visible_px: int = Field(256, ge=1)
    min_visible_fraction: float = Field(0.5, ge=0, le=1)
    most: int = Field(12, ge=1)

    def annotate_image(
        self, scene: Scene, assets: AssetLibrary, reading: SensorReading, truth: ImageTruth
    ) -> ImageTruth:
        """Fill in ``utterances``."""
        graph = truth
        if graph.relations is None:
            graph = relations.Relations().annotate_image(scene, assets, reading, truth)
        things = tuple(self._things(scene, assets, reading, truth))
        present = {_in_words(i.category) for i in scene.instances}
        edges = frozenset(both_ways(graph.relations or ()))
        view = View(things, edges, present, _placeable(scene.groups, assets))
        return replace(truth, utterances=tuple(self._spread(view.utterances())))

    def _things(
        self, scene: Scene, assets: AssetLibrary, reading: SensorReading, truth: ImageTruth
    ) -> "Iterator[Thing]":
        """Everything with a visible pixel; annotated things are clear only if they are listed."""
        listed = {t.instance.instance_id: t for t in truth.objects}
        extents = instance_extents.find_extents(reading.channels[Channel.INSTANCE])
        for instance in scene.instances:
            number = instance.instance_id
            if number not in extents:
                continue
            clear = extents[number].visible_px >= self.min_visible_px
            if instance.annotated:
                clear = (
                    clear and number in listed and self._is_whole(scene, reading, listed[number])
                )
            category, box = _in_words(instance.category), extents[number].box
            color = color_words.color_of(
                [b for b in scene.bodies if b.instance_id == number], assets
            )
            diagonal_m = math.dist(instance.box_min_m, instance.box_max_m)
            yield Thing(number, category, box, clear, instance.annotated, color, diagonal_m)

    def _is_whole(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> bool:
        share = truth.visible_fraction
        if share is None:
            share = visibility.Visibility().annotate(scene, reading, truth).visible_fraction
        return (share or 0.0) >= self.min_visible_fraction

    def _spread(self, utterances: Iterable[Utterance]) -> Iterator[Utterance]:
        """At most ``most`` of each kind, evenly spaced."""
        kinds: dict[str, list[Utterance]] = {}
        for utterance in utterances:
            kinds.setdefault(utterance.kind, []).append(utterance)
        for found in kinds.values():
            kept = min(len(found), self.most)
            yield from (found[k * len(found) // kept] for k in range(kept))


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
    """

    instance_id: int
    category: str
    box: BoxPx
    clear: bool
    annotated: bool
    color: str = ""
    diagonal_m: float = 0.0

    @property
    def middle(self) -> float:
        """Column of the box's centre, doubled."""
        return self.box.x_min + self.box.x_max


@dataclass(frozen=True)
class View:
    """What an image shows.

    Attributes:
        things: All with a visible pixel, also barely visible ones.
        edges: Subject, predicate, object: relations in both directions.
        present: Categories of all things of the scene, visible or not.
        placeable: Categories that the template may place, sorted.
    """

    things: tuple[Thing, ...]
    edges: frozenset[tuple[int, str, int]]
    present: set[str]
    placeable: tuple[str, ...]

    def utterances(self) -> Iterator[Utterance]:
        """Everything that can be said, in a fixed order."""
        if self.countable:
            parts = [count(name, len(found)) for name, found in self.countable.items()]
            shown = tuple(sorted(n for found in self.countable.values() for n in found))
            text = grammar()["caption"].format(list=join(parts))
            yield Utterance("caption", text, instances=shown)
        yield from self._relations()
        for thing in self.spoken:
            for text in self.expressions(thing):
                yield Utterance("expression", text, instances=(thing.instance_id,))
        yield from self._numbers()
        yield from self._places()
        for thing in self.spoken:
            if thing.color and thing.instance_id in self.names:
                text = grammar()["questions"]["color"].format(a=self.names[thing.instance_id])
                yield Utterance("color", text, thing.color, (thing.instance_id,))

    @cached_property
    def spoken(self) -> tuple[Thing, ...]:
        """Annotated things to speak of."""
        silent = grammar()["unspoken"]
        return tuple(t for t in self.things if t.annotated and t.clear and t.category not in silent)

    @cached_property
    def countable(self) -> dict[str, tuple[int, ...]]:
        """Ids of the things of each category whose number is beyond doubt, by its name."""
        found: dict[str, tuple[int, ...]] = {}
        for category in sorted({t.category for t in self.spoken}):
            doubtful = self._candidates(category)
            if all(t.clear and t.annotated and t.category == category for t in doubtful):
                found[category] = tuple(t.instance_id for t in doubtful)
        return found

    @cached_property
    def names(self) -> dict[int, str]:
        """Definite names of the things that need no other word than their category, by id."""
        form = grammar()["expressions"]["only"]
        return {
            t.instance_id: form.format(thing=t.category)
            for t in self.things
            if t.clear
            and t.category not in grammar()["unspoken"]
            and len(self._candidates(t.category)) == 1
        }

    def expressions(self, thing: Thing) -> Iterator[str]:
        """Expressions that refer to one spoken thing and no other."""
        forms = grammar()["expressions"]
        if thing.instance_id in self.names:
            yield self.names[thing.instance_id]
        others = [t for t in self._candidates(thing.category) if t != thing]
        yield from (
            forms[form].format(thing=thing.category, **words)
            for form, words in (
                *((word, {}) for word in (*_ends(thing, others), *_sizes(thing, others))),
                *_colors(thing, others),
                *self._contacts(thing, others),
                *self._landmarks(thing, others),
            )
        )

    def _contacts(self, thing: Thing, others: Sequence[Thing]) -> Iterator[tuple[str, Words]]:
        """Contacts with named things that no other thing of the name has."""
        for predicate in CONTACTS if others else ():
            for landmark in self._objects(thing.instance_id, predicate):
                if all(t.clear and not self._has(t, predicate, landmark) for t in others):
                    yield predicate, {"b": self.names[landmark]}

    def _landmarks(self, thing: Thing, others: Sequence[Thing]) -> Iterator[tuple[str, Words]]:
        """Sides of named things on which no other thing of the name is: the nearest of each."""
        by_id = {t.instance_id: t for t in self.things}
        for side in SIDES if others else ():
            beside = [by_id[n] for n in self._objects(thing.instance_id, side)]
            beside = [t for t in beside if all(_is_across(o, side, t) for o in others)]
            if beside:
                nearest = min(beside, key=lambda t: abs(t.middle - thing.middle))
                yield side, {"b": self.names[nearest.instance_id]}

    def _relations(self) -> Iterator[Utterance]:
        forms = grammar()["sentences"]
        for thing in self.spoken:
            for predicate, form in forms.items():
                for other in self._objects(thing.instance_id, predicate):
                    name = self.names.get(thing.instance_id)
                    if name and (predicate != "near" or thing.instance_id < other):
                        text = _sentence(form.format(a=name, b=self.names[other]))
                        yield Utterance("relation", text, instances=(thing.instance_id, other))

    def _numbers(self) -> Iterator[Utterance]:
        forms = grammar()["questions"]
        for category, ids in self.countable.items():
            text = forms["counting"].format(things=plural(category))
            yield Utterance("counting", text, str(len(ids)), ids)
        shown = {t.category: t for t in reversed(self.spoken)}
        for category in sorted(shown):
            seen = tuple(t.instance_id for t in self.spoken if t.category == category)
            yield Utterance("existence", self._exists(category), "yes", seen)
        absent = [c for c in self.placeable if not kin(c) & self.present]
        asked = min(len(absent), len(shown))
        # Which categories are asked for follows from the picture: it varies, and is not random.
        first = sum(t.box.x_min + t.box.y_min for t in self.things)
        for k in range(asked):
            category = absent[(first + k * len(absent) // asked) % len(absent)]
            yield Utterance("existence", self._exists(category), "no")

    def _places(self) -> Iterator[Utterance]:
        forms = grammar()["questions"]
        named = [t for t in self.spoken if t.instance_id in self.names]
        yield from self._whereabouts(forms["where"], named)
        yield from self._contents(forms["what"])
        yield from self._views(forms["views"], named)

    def _whereabouts(self, form: str, named: Sequence[Thing]) -> Iterator[Utterance]:
        for thing in named:
            number = thing.instance_id
            for predicate, place in grammar()["places"].items():
                objects = self._objects(number, predicate)
                if len(objects) == 1:
                    text = form.format(a=self.names[number])
                    answer = place.format(b=self.names[objects[0]])
                    yield Utterance("spatial", text, answer, (number, objects[0]))

    def _contents(self, forms: Mapping[str, str]) -> Iterator[Utterance]:
        for landmark, name in self.names.items():
            for predicate, form in forms.items():
                held = [t for t in self.things if self._has(t, predicate, landmark)]
                if held and all(t in self.spoken for t in held):
                    counts = sorted(Counter(t.category for t in held).items())
                    answer = join([count(category, n) for category, n in counts])
                    ids = tuple(t.instance_id for t in held)
                    yield Utterance("spatial", form.format(b=name), answer, ids)

    def _views(self, forms: Mapping[str, str], named: Sequence[Thing]) -> Iterator[Utterance]:
        ids = {t.instance_id for t in named}
        for thing in named:
            for predicate, form in forms.items():
                for other in self._objects(thing.instance_id, predicate):
                    # Of each pair one question is asked; half of them have the answer no.
                    if thing.instance_id > other or other not in ids:
                        continue
                    pair = (thing.instance_id, other)
                    turned = sum(pair) % 2 == 1
                    names = [self.names[n] for n in (reversed(pair) if turned else pair)]
                    text = form.format(a=names[0], b=names[1])
                    yield Utterance("spatial", text, "no" if turned else "yes", pair)

    def _exists(self, category: str) -> str:
        form: str = grammar()["questions"]["existence"]
        return form.format(thing=singular(category))

    def _candidates(self, category: str) -> tuple[Thing, ...]:
        """All things that someone may call by a category's name."""
        return tuple(t for t in self.things if t.category in kin(category))

    def _has(self, thing: Thing, predicate: str, other: int) -> bool:
        return (thing.instance_id, predicate, other) in self.edges

    def _objects(self, subject: int, predicate: str) -> list[int]:
        """Named things that a thing has a relation to, in order of id."""
        return [n for n in sorted(self.names) if (subject, predicate, n) in self.edges]


def _is_beside(one: Thing, side: str, other: Thing) -> bool:
    """Whether the boxes of two things are separate, the first one on that side."""
    left, right = (one, other) if side == "left_of" else (other, one)
    return left.box.x_max <= right.box.x_min


def _ends(thing: Thing, others: Sequence[Thing]) -> Iterator[str]:
    """Ends of a row that a thing is at, of things of one category."""
    # "The leftmost mug" is said of mugs, not of a mug and a cup.
    if {t.category for t in others} == {thing.category}:
        for side, word in (("left_of", "leftmost"), ("right_of", "rightmost")):
            if all(_is_beside(thing, side, t) for t in others):
                yield word


def _colors(thing: Thing, others: Sequence[Thing]) -> Iterator[tuple[str, Words]]:
    """The colour of a thing, if all others certainly have another one."""
    if others and thing.color and all(t.color not in ("", thing.color) for t in others):
        yield "color", {"color": thing.color}


def _sizes(thing: Thing, others: Sequence[Thing]) -> Iterator[str]:
    """Superlatives of size that are true of a thing beyond doubt."""
    if {t.category for t in others} == {thing.category}:
        if all(thing.diagonal_m > LARGER * t.diagonal_m for t in others):
            yield "largest"
        if all(t.diagonal_m > LARGER * thing.diagonal_m for t in others):
            yield "smallest"


def _is_across(one: Thing, side: str, landmark: Thing) -> bool:
    """Whether a thing is not even partly on a side of a landmark's centre: nobody means it."""
    if side == "left_of":
        return 2 * one.box.x_min >= landmark.middle
    return 2 * one.box.x_max <= landmark.middle


def _in_words(category: str) -> str:
    return category.replace("_", " ")


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}"


@cache
def grammar() -> Mapping[str, Any]:
    """The table ``language.yaml``."""
    found: Mapping[str, Any] = data_files.load_data(__package__, "language")
    return found


@lru_cache(maxsize=256)
def kin(category: str) -> frozenset[str]:
    """Categories, in words, that may be meant by the name of one: itself and its kin."""
    groups: Sequence[Sequence[str]] = grammar()["kin"]
    named = ([_in_words(name) for name in group] for group in groups)
    return frozenset({category}.union(*(group for group in named if category in group)))


@lru_cache(maxsize=4)
def _placeable(groups: tuple[ObjectGroup, ...], assets: AssetLibrary) -> tuple[str, ...]:
    """Categories of the annotated objects that a template may place, in words, sorted."""
    found = {assets.get(a).category for group in groups if group.annotated for a in group.assets}
    return tuple(sorted({_in_words(c) for c in found} - set(grammar()["unspoken"])))
