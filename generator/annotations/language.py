"""Language about images: captions, referring expressions, and questions with their answers.

Everything is a function of the scene and of its image: nothing is drawn at random, and no text is
about invisible objects. ``questions`` has one function per kind and the grammar.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import ClassVar, Literal

from pydantic import Field, field_validator

from gen_data.annotations import color_words, instance_extents, questions, relations, visibility
from gen_data.annotations.questions.view import Thing, View, grammar, in_words
from gen_data.config import base_model
from gen_data.core import errors
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.sample import ImageTruth, ObjectTruth, Utterance, both_ways
from gen_data.core.scene import Body, ObjectGroup, Scene

TRIES = 3
"""Groups of objects that are tried for each utterance of a kind: margins leave some out."""


class Language(base_model.Strict):
    """Captions, relations, referring expressions, and questions with their answers.

    An object is spoken of if it is clearly visible. A category is countable, and an object has a
    name ("the mug"), only if that is true with every barely visible object, and with similar
    categories (``kin`` in ``grammar.yaml``). An expression is true of one object in the image;
    "leftmost" and "to the left" mean separate boxes, and no other candidate is near enough to be
    meant. Colours are true base colours (``color_words``), stated only where the colour of every
    candidate is beyond doubt; "largest" and "smallest" compare true sizes of one category. Objects
    without an expression are named by one of their pixels. Questions about absent objects name
    categories that the template could have placed and the scene does not have.

    Questions in metres and pixels carry their numbers, unit and margin; they are left out where the
    margin is below the resolution of the camera at that place (``questions.resolution``). Questions
    with the answers yes and no are turned to their opposite in half of all pictures.

    Attributes:
        min_visible_px: Smallest number of visible pixels of an object to be spoken of.
        min_visible_fraction: Smallest visible share of its silhouette.
        most: Largest number of utterances of one kind per image; they are spread evenly over all
            possible ones.
        kinds: Kinds of sentences and questions, such as ``[expression, distance]``; null = all.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE, Channel.AMODAL})
    type: Literal["language"] = "language"
    min_visible_px: int = Field(256, ge=1)
    min_visible_fraction: float = Field(0.5, ge=0, le=1)
    most: int = Field(12, ge=1)
    kinds: tuple[str, ...] | None = Field(None, min_length=1)

    @field_validator("kinds")
    @classmethod
    def _are_known(cls, kinds: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for name in kinds or ():
            if name not in questions.TABLE:
                known = errors.one_of(name, questions.all_names(), 30)
                raise ValueError(f"unknown kind {name[:60]!r}; {known}")
        return kinds

    def annotate_image(
        self, scene: Scene, assets: AssetLibrary, reading: SensorReading, truth: ImageTruth
    ) -> ImageTruth:
        """Fill in ``utterances``."""
        graph = truth
        if graph.relations is None:
            graph = relations.Relations().annotate_image(scene, assets, reading, truth)
        things = tuple(self._things(scene, assets, reading, truth))
        present = {in_words(i.category) for i in scene.instances}
        edges = frozenset(both_ways(graph.relations or ()))
        placeable = _placeable(scene.groups, assets)
        view = View(things, edges, present, placeable, scene, reading, assets, TRIES * self.most)
        return replace(truth, utterances=tuple(self._utterances(view)))

    def _utterances(self, view: View) -> Iterator[Utterance]:
        """At most ``most`` of each kind, evenly spaced."""
        for name in questions.all_names():
            if self.kinds is None or name in self.kinds:
                found = list(questions.load(name)(view))
                kept = min(len(found), self.most)
                yield from (found[k * len(found) // kept] for k in range(kept))

    def _things(
        self, scene: Scene, assets: AssetLibrary, reading: SensorReading, truth: ImageTruth
    ) -> Iterator[Thing]:
        """Everything with a visible pixel; annotated objects are clear only if they are listed."""
        listed = {t.instance.instance_id: t for t in truth.objects}
        extents = instance_extents.find_extents(reading.channels[Channel.INSTANCE])
        bodies: dict[int, list[Body]] = {}
        for body in scene.bodies:
            bodies.setdefault(body.instance_id, []).append(body)
        for instance in scene.instances:
            number = instance.instance_id
            if number not in extents:
                continue
            extent = extents[number]
            clear = extent.visible_px >= self.min_visible_px
            if instance.annotated:
                clear = (
                    clear and number in listed and self._is_whole(scene, reading, listed[number])
                )
            yield Thing(
                number,
                in_words(instance.category),
                extent.box,
                clear,
                instance.annotated,
                color_words.color_of(bodies.get(number, ()), assets),
                math.dist(instance.box_min_m, instance.box_max_m),
                extent.visible_px,
                instance.tight_box3d,
            )

    def _is_whole(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> bool:
        share = truth.visible_fraction
        if share is None:
            share = visibility.Visibility().annotate(scene, reading, truth).visible_fraction
        return (share or 0.0) >= self.min_visible_fraction


@lru_cache(maxsize=4)
def _placeable(groups: tuple[ObjectGroup, ...], assets: AssetLibrary) -> tuple[str, ...]:
    """Categories of the annotated objects that a template may place, in words, sorted."""
    found = {assets.get(a).category for group in groups if group.annotated for a in group.assets}
    return tuple(sorted({in_words(c) for c in found} - set(grammar()["unspoken"])))
