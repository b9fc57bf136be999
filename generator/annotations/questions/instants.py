"""Questions about two images: of another camera at this instant, and of the same camera before.

The other instant is the beginning of the sequence, evaluated from this sample's scene: samples stay
functions of their index. Exporters leave out questions whose objects the other image does not show.
"""

import math
from collections.abc import Iterator

import numpy as np

from gen_data.annotations.questions.metres import TOLERANCE, along, length_text
from gen_data.annotations.questions.resolution import COVERAGE, Sight, expanded
from gen_data.annotations.questions.view import Thing, View, grammar, measure, stated
from gen_data.core import scene_time, se3
from gen_data.core.sample import FIRST, Utterance
from gen_data.core.scene import Camera, Scene

ROUND_S = 1e-6
"""Instants closer than this are equal: times of steps are products of floats."""


def views(view: View) -> Iterator[Utterance]:
    """Distance of two cameras, and which of them is closer to an object."""
    forms = grammar()["questions"]["views"]
    here = view.reading.camera
    for camera in view.scene.cameras:
        if camera.name == here.name or not view.sighted:
            continue
        baseline = _position(camera) - _position(here)
        near = min((s for _, s in view.sighted), key=lambda s: s.range_m)
        yield from _length("views", forms["baseline"], (), baseline, (near, near), camera.name)
        for ((thing, sight),) in view.picks(f"views {camera.name}", 1):
            there_m, there_m2 = along(thing.center_m - _position(camera), sight)
            words = {"a": view.titles[thing.instance_id]}
            closer = sight.range_m < there_m
            text = view.asked("views", ("closer", "farther"), (thing,), words, closer)
            margin, least = abs(there_m - sight.range_m), expanded((sight.depth_m**2, there_m2))
            measured = measure((sight.range_m, there_m), "m", margin, least)
            yield from stated("views", text, (thing,), measured, other=camera.name)


def change(view: View) -> Iterator[Utterance]:
    """How far objects moved since the first image, and whether they came closer to the camera."""
    before = first_scene(view)
    if before is None:
        return
    forms = grammar()["questions"]["change"]
    then = before.camera(view.reading.camera.name)
    assets = {i.instance_id: (i.asset, i.tight_box3d) for i in before.instances}
    rigid = {i.instance_id: i.asset for i in view.scene.instances}
    several = {a.instance_id for a in view.scene.articulations}
    for ((thing, sight),) in view.picks("change", 1):
        number = thing.instance_id
        asset, box = assets[number]
        if asset != rigid[number] or number in several:
            continue
        words = {"a": view.titles[number]}
        center_m = np.array(box.T_frame_box.translation_m)
        moved = thing.center_m - center_m
        yield from _length(
            "change", forms["moved"].format(**words), (thing,), moved, (sight, sight), FIRST
        )
        then_m, then_m2 = along(center_m - _position(then), sight)
        closer = sight.range_m < then_m
        text = view.asked("change", ("closer", "farther"), (thing,), words, closer)
        margin, least = abs(then_m - sight.range_m), expanded((sight.depth_m**2, then_m2))
        measured = measure((sight.range_m, then_m), "m", margin, least)
        yield from stated("change", text, (thing,), measured, other=FIRST)


def ego_motion(view: View) -> Iterator[Utterance]:
    """How far the camera moved since the first image, and in which direction it turned."""
    before = first_scene(view)
    if before is None or not view.sighted:
        return
    forms = grammar()["questions"]["ego_motion"]
    here, then = view.reading.camera, before.camera(view.reading.camera.name)
    moved = _position(here) - _position(then)
    near = min((s for _, s in view.sighted), key=lambda s: s.range_m)
    yield from _length("ego_motion", forms["moved"], (), moved, (near, near), FIRST)
    ahead = then.T_world_camera.rotation().T @ here.T_world_camera.rotation()[:, 2]
    turn_deg = math.degrees(math.atan2(ahead[0], ahead[2]))
    least_deg = math.degrees(COVERAGE * math.sqrt(2.0) * near.edge_m / near.range_m)
    text = view.asked("ego_motion", ("right", "left"), (), {}, turn_deg > 0.0)
    measured = measure((turn_deg,), "deg", abs(turn_deg), least_deg)
    yield from stated("ego_motion", text, (), measured, other=FIRST)


def first_scene(view: View) -> Scene | None:
    """The scene at the camera's first image of the sequence; None if this image is the first."""
    step_s, time_s = view.scene.step_s, view.scene.time_s
    steps = math.floor(time_s / step_s + ROUND_S)
    if steps == 0:
        return None
    return scene_time.scene_at(view.scene, round(time_s - steps * step_s, 9))


def _position(camera: Camera) -> se3.Array:
    return np.array(camera.T_world_camera.translation_m)


def _length(
    kind: str,
    text: str,
    things: tuple[Thing, ...],
    offset: se3.Array,
    sights: tuple[Sight, ...],
    other: str,
) -> Iterator[Utterance]:
    """A question for the length of a vector between two images."""
    length_m, variance_m2 = along(offset, *sights)
    measured = measure((length_m,), "m", TOLERANCE * length_m, expanded([variance_m2]))
    yield from stated(kind, (text, length_text(length_m)), things, measured, other=other)
