"""Questions about pixels: pointing, free spots, occluders, and counts of partly hidden objects."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gen_data.annotations import amodal_masks
from gen_data.annotations.questions.resolution import EDGE_PX, area_px
from gen_data.annotations.questions.view import (
    Thing,
    View,
    deepest,
    grammar,
    measure,
    pixel_text,
    stated,
)
from gen_data.core import english
from gen_data.core.boxes import tight_box
from gen_data.core.capture import Channel
from gen_data.core.sample import MaskPx, Utterance
from gen_data.core.scene import SupportSurface

Mask = NDArray[np.bool_]
HALF = 0.5
"""Share of its silhouette of which an object is hidden by more than half."""


def pointing(view: View) -> Iterator[Utterance]:
    """A pixel of an object; its mask is the region."""
    form = grammar()["questions"]["pointing"]["object"]
    for thing in view.spoken:
        point_px, inside_px = view.spot(thing)
        name = next(view.expressions(thing), "")
        if name:
            measured = measure(point_px, "px", inside_px - 0.5, 2.0 * EDGE_PX)
            text = (form.format(a=name), pixel_text(point_px))
            yield from stated("pointing", text, (thing,), measured, points_px=(point_px,))


def free_spot(view: View) -> Iterator[Utterance]:
    """A pixel of the bare top of a named support: of all, and on each side of the objects on it."""
    forms = grammar()["questions"]["free_spot"]
    instances = {b.name: b.instance_id for b in view.scene.bodies}
    tops: dict[int, list[SupportSurface]] = {}
    for surface in view.scene.surfaces:
        tops.setdefault(instances.get(surface.body, 0), []).append(surface)
    for number, (top, *others) in sorted(tops.items()):
        if number not in view.names or others:
            continue
        bare = _bare(view, number, top)
        on_it = [t for t in view.spoken if view.has(t, "on", number)]
        sides: list[tuple[str, tuple[Thing, ...], slice]] = [("all", (), slice(None))]
        for thing in on_it:
            x0, x1 = thing.box.x_min, thing.box.x_max
            width = x1 - x0
            sides.append(("left", (thing,), slice(max(x0 - width, 0), x0)))
            sides.append(("right", (thing,), slice(x1, x1 + width)))
        for side, about, columns in sides:
            part = np.zeros_like(bare)
            rows = slice(about[0].box.y_min, about[0].box.y_max) if about else slice(None)
            part[rows, columns] = bare[rows, columns]
            words = {
                "b": view.names[number],
                "a": view.titles[about[0].instance_id] if about else "",
            }
            yield from _spot(view, number, about, forms[side].format(**words), part)


def _spot(
    view: View, number: int, about: tuple[Thing, ...], text: str, part: Mask
) -> Iterator[Utterance]:
    box = tight_box(part)
    if box is not None:
        mask = part[box.window()]
        point_px, inside_px = deepest(mask, box.x_min, box.y_min)
        measured = measure(point_px, "px", inside_px - 0.5, 2.0 * EDGE_PX)
        support = view.by_id[number]
        region = MaskPx(box.x_min, box.y_min, mask)
        answer = (text, pixel_text(point_px))
        things = (*about, support)
        yield from stated(
            "free_spot", answer, things, measured, points_px=(point_px,), region=region
        )


def _bare(view: View, number: int, top: SupportSurface) -> Mask:
    """Pixels that show the top of a support, bool [h, w]: their rays meet its rectangle first."""
    camera = view.reading.camera
    ids = view.reading.channels[Channel.INSTANCE]
    shown = ids == number
    rows, columns = np.nonzero(shown)
    rays = camera.intrinsics.rays(np.stack([columns + 0.5, rows + 0.5], axis=1))
    T_top_camera = top.T_world_surface.inverse() @ camera.T_world_camera
    origin, rays = np.array(T_top_camera.translation_m), T_top_camera.rotate(rays)
    ahead = rays[:, 2] < -1e-9
    meets = origin[:2] - rays[:, :2] * (origin[2] / np.where(ahead, rays[:, 2], -1.0))[:, None]
    half = 0.5 * np.array(top.size_m)
    bare = np.zeros(shown.shape, np.bool_)
    bare[rows, columns] = ahead & (origin[2] > 0.0) & (np.abs(meets) <= half).all(1)
    return bare


def occlusion(view: View) -> Iterator[Utterance]:
    """Which object hides another, and whether any does."""
    forms = grammar()["questions"]["occlusion"]
    for thing in view.spoken:
        hiders, whole_px, least = _hiders(view, thing)
        name = {"a": view.titles[thing.instance_id]}
        hidden_px = sum(hiders.values())
        text = view.asked("occlusion", ("partly", "whole"), (thing,), name, hidden_px > 0)
        # Of a whole object, a part that could be noticed would have to be hidden.
        measured = measure((hidden_px, whole_px), "px", hidden_px or least, least)
        yield from stated("occlusion", text, (thing,), measured)
        known = [n for n in hiders if n in view.titles or n in view.names]
        if hiders and len(known) == len(hiders):
            first = sorted(hiders, key=lambda n: (-hiders[n], n))
            answer = english.join([view.titles.get(n) or view.names[n] for n in first])
            measured = measure(
                tuple(float(hiders[n]) for n in first), "px", min(hiders.values()), least
            )
            things = (thing, *(view.by_id[n] for n in first))
            question = forms["what"].format(**name)
            yield from stated("occlusion", (question, answer), things, measured)


def _hiders(view: View, thing: Thing) -> tuple[dict[int, int], int, float]:
    """Pixels of an object that each other instance hides, of its silhouette, and the resolution.

    The silhouette is inside the image; instances without id hide as number 0.
    """
    silhouette = view.reading.silhouettes[thing.instance_id]
    lens = view.reading.camera.intrinsics
    inside = amodal_masks.clip_mask(silhouette, lens.width_px, lens.height_px)
    height, width = inside.pixels.shape
    window = (slice(inside.y_px, inside.y_px + height), slice(inside.x_px, inside.x_px + width))
    seen = view.reading.channels[Channel.INSTANCE][window][inside.pixels]
    numbers, counts = np.unique(seen[seen != thing.instance_id], return_counts=True)
    hiders = {int(n): int(c) for n, c in zip(numbers, counts, strict=True)}
    return hiders, int(inside.pixels.sum()), area_px(2.0 * (height + width))


def hidden_counting(view: View) -> Iterator[Utterance]:
    """How many objects of a category show at least a part, and of how many most is hidden."""
    forms = grammar()["questions"]["hidden_counting"]
    for category in sorted({t.category for t in view.spoken}):
        group = view.candidates(category)
        if any(t.category != category or not t.annotated for t in group) or len(group) < 2:
            continue
        least = max(area_px(2.0 * (t.box.width_px + t.box.height_px)) for t in group)
        words = {"things": english.plural(category)}
        smallest = min(t.visible_px for t in group)
        text = (forms["shown"].format(**words), str(len(group)))
        measured = measure((float(len(group)),), "px", smallest, least)
        yield from stated("hidden_counting", text, group, measured)
        shares = [_hidden_share(view, t) for t in group]
        margin = min(abs(share - HALF) for share, _ in shares)
        number = sum(share > HALF for share, _ in shares)
        text = (forms["most"].format(**words), str(number))
        numbers = (float(number), *(share for share, _ in shares))
        measured = measure(numbers, "1", margin, max(u for _, u in shares))
        yield from stated("hidden_counting", text, group, measured)


def _hidden_share(view: View, thing: Thing) -> tuple[float, float]:
    """Share of the silhouette inside the image that is hidden, and its resolution."""
    hiders, whole_px, least = _hiders(view, thing)
    return sum(hiders.values()) / max(whole_px, 1), least / max(whole_px, 1)
