"""Captions of scenes."""

import math
from dataclasses import replace
from typing import Any

import pytest

from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Environment, Lane, Light, Scene, Weather
from gen_data.core.se3 import look_at
from gen_data.exporters.captions import (
    caption,
    describe_light,
    describe_view,
    describe_weather,
    list_objects,
)

STREET = Lane("lane", "driving", ((0.0, 0.0, 0.0), (9.0, 0.0, 0.0)), 3.0)


def test_a_caption_is_one_sentence_without_hidden_and_ignored_objects(world: Any) -> None:
    """Place, objects, weather, light and view of the first frame."""
    assert caption(world.samples[0], "color") == (
        "A street with two crates, two pedestrians and a car, seen at eye level."
    )
    assert caption(world.samples[3], "color") == "A street with no objects, seen at eye level."
    car, *others = world.samples[0].truth["color"].objects
    assert list_objects([replace(car, box=None), others[0]]) == "a pedestrian"
    assert list_objects([replace(car, ignored=True)]) == "no objects"


@pytest.mark.parametrize(
    ("category", "count", "words"),
    [("person", 2, "two people"), ("bus", 3, "three buses"), ("knife", 2, "two knives"),
     ("toy block", 12, "twelve toy blocks"), ("berry", 2, "two berries"), ("tray", 2, "two trays"),
     ("traffic_light", 13, "many traffic lights"), ("apple", 1, "an apple")],
)  # fmt: skip
def test_numbers_and_plurals(world: Any, category: str, count: int, words: str) -> None:
    thing = world.samples[0].truth["color"].objects[0]
    things = [replace(thing, instance=replace(thing.instance, category=category))] * count
    assert list_objects(things) == words


@pytest.mark.parametrize(
    ("weather", "words"),
    [
        (Weather(), ""), (Weather(rain_mm_h=1.0, wetness=0.5), "in light rain, on wet ground"),
        (Weather(rain_mm_h=30.0, puddles=0.2, wetness=1.0),
         "in heavy rain, with puddles on the ground"),
        (Weather(snow_mm_h=1.0, snow_cover=0.8), "in falling snow, on snow-covered ground"),
        (Weather(fog_extinction_per_m=0.03), "in dense fog"),
        (Weather(fog_extinction_per_m=0.005), "in fog"), (Weather(fog_extinction_per_m=0.0005), ""),
    ],
)  # fmt: skip
def test_weather(weather: Weather, words: str) -> None:
    """A haze of several kilometres is not called fog."""
    assert describe_weather(weather) == words


def sun(altitude_deg: float) -> Light:
    angle = math.radians(altitude_deg)
    return Light("sun", "sun", direction=(math.cos(angle), 0.0, -math.sin(angle)))


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (Scene("street", lights=(sun(50.0),)), "in bright daylight"),
        (Scene("street", lights=(sun(5.0),)), "in the light of a low sun"),
        (Scene("street", environment=Environment("environment/sky?seed=1&sun_altitude_deg=40.5")),
         "in daylight under clouds"),
        (Scene("street", environment=Environment("environment/sky?sun_altitude_deg=3.35&seed=1")),
         "in dim daylight under clouds"),
        (Scene("street", environment=Environment("environment/sky?sun_altitude_deg=-3")),
         "at dusk"),
        (Scene("street", environment=Environment("environment/sky?sun_altitude_deg=-20")),
         "at night"),
        (Scene("street", lanes=(STREET,), environment=Environment("night", 0.1)), "at night"),
        (Scene("street", lanes=(STREET,), environment=Environment("field", 2000.0)), "in daylight"),
        (Scene("tabletop", lights=(Light("lamp", "sphere"),)), "lit by lamps"),
        (Scene("tabletop"), ""),
    ],
)  # fmt: skip
def test_light(scene: Scene, words: str) -> None:
    """By the sun where there is one, by the sky's luminance otherwise."""
    assert describe_light(scene) == words


@pytest.mark.parametrize(
    ("target", "hfov_deg", "words"),
    [((1.0, 0.0, 1.6), 60, "seen at eye level"), ((1.0, 0.0, 1.42), 60, "seen at eye level"),
     ((1.0, 0.0, 1.0), 60, "seen from above"),
     ((0.1, 0.0, 0.6), 60, "seen steeply from above"), ((1.0, 0.0, 3.0), 60, "seen from below"),
     ((1.0, 0.0, 1.6), 100, "seen at eye level through a wide-angle lens"),
     ((1.0, 0.0, 1.6), 20, "seen at eye level through a long lens")],
)  # fmt: skip
def test_view(world: Any, target: Any, hfov_deg: float, words: str) -> None:
    """By the optical axis and the horizontal field of view."""
    lens = Intrinsics.from_hfov(160, 120, hfov_rad=math.radians(hfov_deg))
    pose = look_at((0.0, 0.0, 1.6), target)
    assert describe_view(replace(world.camera(), T_world_camera=pose, intrinsics=lens)) == words
