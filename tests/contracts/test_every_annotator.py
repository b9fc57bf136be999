"""The contract of every annotator in the table, and of a third party's.

The truth classes document each field with its annotator's name in brackets at the end: that is what
an annotator may fill in, and nothing else.
"""

import inspect
import pickle
import re
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from stranger.annotation import Distance

from gen_data.annotations import TABLE
from gen_data.annotations.annotate import Thresholds, annotate_ego, annotate_reading
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core import capture, errors, interfaces, serialization
from gen_data.core.sample import EgoTruth, ImageTruth, ObjectTruth
from gen_data.core.scene import Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.streams import Streams
from tests.streets import thin_street

# All of them label one street, of which assets and kernels are made first.
pytestmark = pytest.mark.slow

ANNOTATORS: dict[str, type[interfaces.AnyAnnotator]] = {
    **{name: TABLE.load(name) for name in TABLE}, "stranger_distance": Distance,
}  # fmt: skip
each = pytest.mark.parametrize("name", ANNOTATORS)

CONFIG = "street_sequence"
SMALL = ("sensors[0].size_px=[160, 90]", "exporters=[]", "annotations=[]")
DISTANCES = frozenset({capture.Channel.Z_DEPTH, capture.Channel.RANGE})
NEED_A_RIG = ("bev_map",)
FEW_PX = Thresholds(min_visible_px=1, min_box_px=1)


@dataclass(frozen=True)
class World:
    """A sample's scene, one reading of it, the assets of both, and the sequence that it is in."""

    scene: Scene
    reading: capture.SensorReading
    assets: interfaces.AssetLibrary
    view: interfaces.ViewSequence


@cache
def world() -> World:
    """A street in motion, with vehicles, people, lanes, a rig and a camera on it."""
    channels = frozenset(c for name in ANNOTATORS for c in made(name).channels)
    with open_pipeline(thin_street(CONFIG, *SMALL), channels) as pipeline:
        sample = pipeline.sample(1)
        (reading,) = sample.capture.readings.values()
        view = interfaces.ViewSequence(
            lambda time_s: scene_at(sample.scene, time_s),
            (0.0, 0.1, 0.2),
            pipeline.assets,
            pipeline.renderer,
            Streams(1, 0, view=0),
        )
        return World(sample.scene, reading, pipeline.assets, view)


def made(name: str) -> interfaces.AnyAnnotator:
    return ANNOTATORS[name]()


def annotated(name: str, of: World | None = None) -> tuple[ImageTruth, EgoTruth | None]:
    given = of or world()
    image = annotate_reading(given.scene, given.reading, [made(name)], FEW_PX, given.assets)
    annotator = made(name)
    frame = annotate_ego({"": given.scene}, [annotator], given.assets)
    if frame is not None and isinstance(annotator, interfaces.SequenceAnnotator):
        seen = capture.Capture({given.reading.sensor: given.reading})
        begun = annotator.begin(given.view)
        frame = annotator.annotate_step(given.view, begun, given.scene, seen, frame)
    return image, frame


def documented(truth: type) -> dict[str, set[str]]:
    """Fields of a truth class by the annotator that its docstring names for them."""
    section = inspect.cleandoc(truth.__doc__ or "").partition("Attributes:\n")[2]
    entries = re.findall(r"^ {4}(\S.*?): (.*?)(?=^ {4}\S|\Z)", section, re.MULTILINE | re.DOTALL)
    found: dict[str, set[str]] = {}
    for names, meaning in entries:
        owner = re.search(r"\((\w+)\)\.\s*\Z", meaning)
        if owner:
            found.setdefault(owner.group(1), set()).update(names.split(", "))
    return found


def changed(before: Any, after: Any) -> set[str]:
    """Names of the fields that an annotator has filled in."""
    names = {f.name for f in fields(before)} - {"objects"}
    return {n for n in names if plain(getattr(before, n)) != plain(getattr(after, n))}


def plain(value: Any) -> Any:
    """A value that can be compared, arrays included."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if hasattr(value, "__dataclass_fields__"):
        return type(value).__name__, {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    return value


def test_every_documented_field_has_an_annotator_and_the_other_way_round() -> None:
    """All except semantic masks, which are images only."""
    owners = {n for t in (ObjectTruth, ImageTruth, EgoTruth) for n in documented(t)}

    assert owners == set(TABLE) - {"semantic_masks"}


@each
def test_it_fills_in_its_own_fields_and_no_other(name: str) -> None:
    """A third party's results are under its own name in ``extra``."""
    image, frame = annotated(name)
    allowed = documented(ObjectTruth).get(name, {"extra"} if name not in TABLE else set())
    for truth in image.objects:
        bare = ObjectTruth(truth.instance, truth.visible_px, truth.box)
        assert changed(bare, truth) == allowed - empty_fields(truth, allowed)
        assert set(truth.extra) == ({name} - set(TABLE))
    assert isinstance(made(name), interfaces.Annotator) == bool(image.objects)
    assert changed(ImageTruth(image.camera, ()), image) == documented(ImageTruth).get(name, set())
    if frame is not None:
        bare_frame = EgoTruth(frame.rig, frame.T_world_ego, frame.twist)
        assert changed(bare_frame, frame) == documented(EgoTruth).get(name, set())
    assert (frame is not None) == (name in documented(EgoTruth))


def empty_fields(truth: ObjectTruth, names: set[str]) -> set[str]:
    """Fields that stay None: parts of an object that has none."""
    return {n for n in names if n == "part_px" and not truth.instance.parts}


@each
def test_it_says_the_same_every_time_and_in_every_process(name: str) -> None:
    """Annotators have no rng; a copy from another process gives equal results."""
    copy = pickle.loads(pickle.dumps(made(name)))
    given = world()
    image = annotate_reading(given.scene, given.reading, [copy], FEW_PX, given.assets)

    assert copy == made(name)
    assert plain(image) == plain(annotated(name)[0]) == plain(annotated(name)[0])
    assert plain(annotated(name)[1]) == plain(annotated(name)[1])


@each
def test_its_arguments_stay_as_they_are(name: str) -> None:
    """Scene and pixels."""
    given = world()
    pixels = {channel: image.copy() for channel, image in given.reading.channels.items()}
    before = serialization.canonical_json(given.scene)
    annotated(name)

    assert serialization.canonical_json(given.scene) == before
    for channel, image in given.reading.channels.items():
        assert image.tobytes() == pixels[channel].tobytes()


@each
def test_it_needs_no_other_channel_than_it_names(name: str) -> None:
    """Other channels need not be rendered."""
    given, channels = world(), made(name).channels
    images = {c: image for c, image in given.reading.channels.items() if c in channels}
    outlines = given.reading.silhouettes if capture.Channel.AMODAL in channels else {}
    lean = replace(given.reading, channels=images, silhouettes=outlines)

    assert plain(annotated(name, replace(given, reading=lean))[0].objects) == plain(
        annotated(name)[0].objects
    )


@each
def test_an_empty_scene_has_empty_truth(name: str) -> None:
    """No object; an annotator that needs a rig refuses with its own name."""
    given = world()
    nothing = {c: np.zeros_like(image) for c, image in given.reading.channels.items()}
    nothing |= {c: np.full_like(nothing[c], np.inf) for c in DISTANCES & nothing.keys()}
    camera = replace(given.reading.camera, rig="")
    scene = Scene("empty", cameras=(camera,))
    reading = replace(given.reading, camera=camera, channels=nothing, silhouettes={})
    empty = World(scene, reading, given.assets, replace(given.view, at=lambda _: scene))
    if name in NEED_A_RIG:
        with pytest.raises(errors.ConfigError, match=f"annotation '{name}': the scene has no rig"):
            annotated(name, empty)
        return
    image, frame = annotated(name, empty)
    assert image.objects == ()
    assert not image.borders
    assert image.free_space is None or not image.free_space.pixels.any()
    assert frame is None or not (frame.boxes3d or frame.borders or frame.birdseye)
    assert frame is None or frame.tracks is None or not len(frame.tracks.instance_id)


def test_images_are_annotated_as_a_whole_where_objects_are_not() -> None:
    """The scene of these tests gives annotators of images and of samples non-empty results."""
    image, _ = annotated("lanes")

    assert isinstance(made("lanes"), interfaces.ImageAnnotator)
    assert image.borders
    assert serialization.to_plain(world().scene)["rigs"]
