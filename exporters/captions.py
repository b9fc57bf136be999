"""Captions of images: a sentence about place, objects, weather, light and camera.

Every word is a function of the scene and its labels: equal scenes have equal captions. An
object counts if it is visible in the image.
"""

import math
import re
from collections import Counter
from collections.abc import Sequence

from gen_data.core.english import article, count, join
from gen_data.core.sample import ObjectTruth, Sample
from gen_data.core.scene import Camera, Scene, Weather

LIGHT_RAIN_MM_H, HEAVY_RAIN_MM_H = 2.5, 10.0
"""WMO's limits of light and heavy rain (Guide to Instruments and Methods of Observation, 2018)."""
FOG_EXTINCTION_PER_M = 3.912 / 1000.0
"""Fog has a meteorological range below a kilometre (WMO, International Cloud Atlas)."""
DENSE_FOG_EXTINCTION_PER_M = 3.912 / 200.0

HIGH_SUN_RAD = math.radians(15.0)
NIGHT_RAD = math.radians(-6.0)
"""End of civil twilight."""
NIGHT_CD_M2 = 1.0
"""Mean luminance of a sky below which it is night, for skies without a known sun."""

STEEP_RAD, LEVEL_RAD = math.radians(35.0), math.radians(15.0)
WIDE_RAD, NARROW_RAD = math.radians(85.0), math.radians(30.0)


def caption(sample: Sample, camera: str) -> str:
    """One sentence about the image of a camera."""
    truth = sample.truth[camera]
    scene = sample.scene_of(camera)
    place = scene.template.replace("_", " ") or "place"
    parts = [
        f"{article(place)} {place} with {list_objects(truth.objects)}",
        describe_weather(scene.weather),
        describe_light(scene),
        describe_view(truth.camera),
    ]
    sentence = ", ".join(part for part in parts if part)
    return f"{sentence[0].upper()}{sentence[1:]}."


def list_objects(objects: Sequence[ObjectTruth]) -> str:
    """Visible objects by category, the most frequent ones first."""
    seen = (t.instance.category for t in objects if t.box is not None and not t.ignored)
    counts = sorted(Counter(seen).items(), key=lambda item: (-item[1], item[0]))
    names = [count(name.replace("_", " "), number) for name, number in counts]
    return join(names) or "no objects"


def describe_weather(weather: Weather) -> str:
    """Rain, snow, fog and the state of the ground; empty in dry and clear weather."""
    facts = []
    if weather.rain_mm_h > 0.0:
        heavy, light = weather.rain_mm_h >= HEAVY_RAIN_MM_H, weather.rain_mm_h < LIGHT_RAIN_MM_H
        facts.append("in heavy rain" if heavy else "in light rain" if light else "in rain")
    if weather.snow_mm_h > 0.0:
        facts.append("in falling snow")
    if weather.fog_extinction_per_m >= DENSE_FOG_EXTINCTION_PER_M:
        facts.append("in dense fog")
    elif weather.fog_extinction_per_m >= FOG_EXTINCTION_PER_M:
        facts.append("in fog")
    if weather.snow_cover > 0.0:
        facts.append("on snow-covered ground")
    elif weather.puddles > 0.0:
        facts.append("with puddles on the ground")
    elif weather.wetness > 0.0:
        facts.append("on wet ground")
    return ", ".join(facts)


def describe_light(scene: Scene) -> str:
    """Time of day outdoors, lamps indoors."""
    altitude_rad = sun_altitude_rad(scene)
    if altitude_rad is None:
        if not scene.lanes:
            return "lit by lamps" if scene.lights else ""
        return "at night" if scene.environment.luminance_cd_m2 < NIGHT_CD_M2 else "in daylight"
    if altitude_rad < NIGHT_RAD:
        return "at night"
    if altitude_rad < 0.0:
        return "at dusk"
    sun = any(light.kind == "sun" for light in scene.lights)
    if altitude_rad < HIGH_SUN_RAD:
        return "in the light of a low sun" if sun else "in dim daylight under clouds"
    return "in bright daylight" if sun else "in daylight under clouds"


def sun_altitude_rad(scene: Scene) -> float | None:
    """Altitude of the sun, by its light or by the name of the sky; None without either."""
    for light in scene.lights:
        if light.kind == "sun":
            return math.asin(max(-1.0, min(1.0, -light.direction[2])))
    named = re.search(r"[?&]sun_altitude_deg=(-?[0-9.]+)", scene.environment.image)
    return math.radians(float(named[1])) if named else None


def describe_view(camera: Camera) -> str:
    """Direction of view and field of view."""
    pitch_rad = math.asin(max(-1.0, min(1.0, camera.T_world_camera.rotation()[2, 2])))
    if pitch_rad < -STEEP_RAD:
        view = "seen steeply from above"
    elif pitch_rad < -LEVEL_RAD:
        view = "seen from above"
    elif pitch_rad > LEVEL_RAD:
        view = "seen from below"
    else:
        view = "seen at eye level"
    lens = camera.intrinsics
    field_rad = 2.0 * math.atan(0.5 * lens.width_px / lens.fx_px)
    if lens.lens.model != "pinhole" or field_rad > WIDE_RAD:
        return f"{view} through a wide-angle lens"
    return f"{view} through a long lens" if field_rad < NARROW_RAD else view
