"""Captions, relations, expressions, and questions about number, existence, place and colour."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from gen_data.annotations.questions.view import Thing, View, grammar, kin
from gen_data.core import english
from gen_data.core.sample import Utterance


def caption(view: View) -> Iterator[Utterance]:
    """A sentence about all objects whose number is beyond doubt."""
    if view.countable:
        parts = [english.count(name, len(found)) for name, found in view.countable.items()]
        shown = tuple(sorted(n for found in view.countable.values() for n in found))
        text = grammar()["caption"].format(list=english.join(parts))
        yield Utterance("caption", text, instances=shown)


def relation(view: View) -> Iterator[Utterance]:
    """Sentences about contacts and nearness of named objects."""
    for thing in view.spoken:
        for predicate, form in grammar()["sentences"].items():
            for other in view.objects(thing.instance_id, predicate):
                name = view.names.get(thing.instance_id)
                if name and (predicate != "near" or thing.instance_id < other):
                    text = english.sentence(form.format(a=name, b=view.names[other]))
                    yield Utterance("relation", text, instances=(thing.instance_id, other))


def expression(view: View) -> Iterator[Utterance]:
    """Every expression that refers to one object and no other."""
    for thing in view.spoken:
        for text in view.expressions(thing):
            yield Utterance("expression", text, instances=(thing.instance_id,))


def counting(view: View) -> Iterator[Utterance]:
    """Numbers of objects beyond doubt."""
    for category, ids in view.countable.items():
        text = grammar()["questions"]["counting"].format(things=english.plural(category))
        yield Utterance("counting", text, str(len(ids)), ids)


def existence(view: View) -> Iterator[Utterance]:
    """As many categories that the image shows as ones that the scene lacks, in turn."""
    form = grammar()["questions"]["existence"]
    shown = sorted({t.category for t in view.spoken})
    absent = [c for c in view.placeable if not kin(c) & view.present]
    asked = min(len(absent), len(shown))
    for k in range(asked):
        # Which categories are asked for follows from the picture: it varies, and is not random.
        here, gone = (c[(view.salt + k * len(c) // asked) % len(c)] for c in (shown, absent))
        seen = tuple(t.instance_id for t in view.spoken if t.category == here)
        yield Utterance("existence", form.format(thing=english.singular(here)), "yes", seen)
        yield Utterance("existence", form.format(thing=english.singular(gone)), "no")


def spatial(view: View) -> Iterator[Utterance]:
    """Places of named objects, contents of landmarks, and sides and nearness to the viewer."""
    forms = grammar()["questions"]
    named = [t for t in view.spoken if t.instance_id in view.names]
    yield from _whereabouts(view, forms["where"], named)
    yield from _contents(view, forms["what"])
    yield from _sides(view, forms["sides"], named)


def _whereabouts(view: View, form: str, named: Sequence[Thing]) -> Iterator[Utterance]:
    for thing in named:
        number = thing.instance_id
        for predicate, place in grammar()["places"].items():
            objects = view.objects(number, predicate)
            if len(objects) == 1:
                answer = place.format(b=view.names[objects[0]])
                yield Utterance(
                    "spatial", form.format(a=view.names[number]), answer, (number, objects[0])
                )


def _contents(view: View, forms: Mapping[str, str]) -> Iterator[Utterance]:
    for landmark, name in view.names.items():
        for predicate, form in forms.items():
            held = [t for t in view.things if view.has(t, predicate, landmark)]
            if held and all(t in view.spoken for t in held):
                counts = sorted(Counter(t.category for t in held).items())
                answer = english.join([english.count(category, n) for category, n in counts])
                ids = tuple(t.instance_id for t in held)
                yield Utterance("spatial", form.format(b=name), answer, ids)


def _sides(view: View, forms: Mapping[str, str], named: Sequence[Thing]) -> Iterator[Utterance]:
    ids = {t.instance_id for t in named}
    for thing in named:
        for predicate, form in forms.items():
            for other in view.objects(thing.instance_id, predicate):
                # Of each pair one question is asked; half of them have the answer no.
                if thing.instance_id > other or other not in ids:
                    continue
                pair = (thing.instance_id, other)
                turned = view.is_turned("spatial", *pair, predicate)
                names = [view.names[n] for n in (reversed(pair) if turned else pair)]
                text = form.format(a=names[0], b=names[1])
                yield Utterance("spatial", text, "no" if turned else "yes", pair)


def color(view: View) -> Iterator[Utterance]:
    """Colours of named objects."""
    for thing in view.spoken:
        if thing.color and thing.instance_id in view.names:
            text = grammar()["questions"]["color"].format(a=view.names[thing.instance_id])
            yield Utterance("color", text, thing.color, (thing.instance_id,))
