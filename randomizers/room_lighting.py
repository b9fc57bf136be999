"""Light in rooms: lamps that are on or off, daylight and sun through windows."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np

from gen_data.config import distributions as dist
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetIndex
from gen_data.core.photometry import remove_lights, scale_to_flux
from gen_data.core.scene import Body, Environment, Light, Scene
from gen_data.core.se3 import Vec3
from gen_data.core.streams import Rng
from gen_data.randomizers import base, color_space
from gen_data.rooms import interreflection, lit_rooms, window_niches
from gen_data.rooms.bodies import OUTSIDE, keypoint_m

LAMP = "lamp"
_SHADE_M2 = 0.35
"""Assumed luminous area of a lamp: a shade of 0.2 m radius and 0.25 m height."""
_BULB_M = 0.06
_VIEW_MEAN = 0.7
"""Light from windows, relative to the mean outside: houses hide some sky, and panes reflect."""
_DAYLIGHT: Vec3 = (0.95, 1.0, 1.07)
"""Colour of light from windows: between overcast and clear skies."""
_SKIES = 8
_NIGHT_CD_M2 = 0.2
"""Assumed mean outdoors by night in towns: a lit street has 1 cd/m^2 (EN 13201-2), a sky 0.01."""


class RoomLighting(base.RandomizerBase):
    """Replaces the lights of a furnished room: lamps, daylight from windows, and the sun.

    Each window is a panel with the luminance of the view outside; light between surfaces
    is found by radiosity. Labels of lamps carry ``state``: on or off.

    Attributes:
        room: Name of the template's ``room_layout`` element.
        daylight_cd_m2: Mean luminance of sky and surroundings by day.
        night: Whether it is night; the view outside is nearly black then, and the lamps of all
            ceilings are on, as in rooms without windows.
        is_on: Whether a lamp is on; drawn for each, and once for all on the ceiling of a room.
        luminous_flux_lm: Flux of each lamp.
        temperature_k: Colour temperature of all lamps.
        sun: Whether the sun shines in by day.
        sun_lux: Its illuminance on a surface that faces it.
        sun_altitude_deg: Its height above the horizon.
    """

    type: Literal["room_lighting"] = "room_lighting"
    stage: Literal["scene", "view"] = "view"
    room: str = "room"
    daylight_cd_m2: dist.Positive = dist.LogUniform(400.0, 3000.0)
    night: dist.Flag = dist.Probability(0.2)
    is_on: dist.Flag = dist.Probability(0.6)
    luminous_flux_lm: dist.Positive = dist.LogUniform(500.0, 2500.0)
    temperature_k: color_space.Temperature = dist.Uniform(2700.0, 5000.0)
    sun: dist.Flag = dist.Probability(0.4)
    sun_lux: dist.NonNegative = dist.LogUniform(8000.0, 60000.0)
    sun_altitude_deg: Annotated[dist.Scalar, dist.Bounds(0, 90)] = dist.Uniform(40.0, 62.0)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with the room's lights drawn.

        Raises:
            ConfigError: there is no such room.
        """
        own = [b for b in scene.bodies if b.name.partition("/")[0] == self.room]
        if not any(b.name == f"{self.room}/{OUTSIDE}" for b in own):
            raise ConfigError(
                f"randomizers.{self.name}.room: the template has no element '{self.room}' of type "
                "room_layout"
            )
        windows = [b for b in own if "/window_" in b.name]
        night, bright = self.night.draw(rng), self.daylight_cd_m2.draw(rng)
        outside = _NIGHT_CD_M2 if night else round(bright, 1)
        scene = remove_lights(scene)
        lamps, scene = self._switch_lamps(scene, own, assets, rng, must=night or not windows)
        panels = (
            [_window_light(w, own, assets, _VIEW_MEAN * outside) for w in windows]
            if not night
            else []
        )
        sun = self._draw_sun(windows, rng, shines=not night)
        lights = (*sun, *panels, *lamps)
        rooms = lit_rooms.find_lit_rooms(scene, self.room, assets)
        volumes = interreflection.find_interreflection(rooms, lights)
        r, g, b = (_VIEW_MEAN * outside * c for c in _DAYLIGHT)
        volumes += window_niches.find_niches(rooms, volumes, (r, g, b))
        sky = "night_city" if night else "clear_sky" if sun else "overcast"
        image = f"environment/{sky}?seed={int(rng.random() * _SKIES)}"
        yaw = round(2.0 * math.pi * float(rng.random()), 6)
        ambience = Environment(image, outside, yaw, visible=True, volumes=volumes)
        return replace(scene, lights=lights, environment=ambience)

    def _switch_lamps(
        self, scene: Scene, own: Sequence[Body], assets: AssetIndex, rng: Rng, *, must: bool
    ) -> tuple[list[Light], Scene]:
        color = color_space.temperature_to_linear(self.temperature_k.draw(rng))
        found = [(b, at_m) for b in own if (at_m := keypoint_m(assets, b.asset, LAMP)) is not None]
        lights, changed = [], []
        attributes: dict[int, list[tuple[str, str]]] = {}
        shared_lm = self.luminous_flux_lm.draw(rng)
        switches: dict[str, bool] = {}
        for number, (body, at_m) in enumerate(found):
            is_on, flux_lm = self.is_on.draw(rng), 0.5 * self.luminous_flux_lm.draw(rng)
            if at_m[2] < 0.0:
                # The lamps of a ceiling have one switch.
                is_on, flux_lm = must or switches.setdefault(_room_of(body), is_on), shared_lm
            lit = flux_lm if is_on else 0.0
            # A lamp that is off shows its shade alone.
            glow = base.scale_emission(color, lit / (math.pi * _SHADE_M2))
            changed.append(base.set_emission(body, assets, {LAMP: glow}))
            attributes[body.instance_id] = [("state", "on" if is_on else "off")]
            if is_on:
                lights.append(_lamp_light(f"{self.name}/{number}", body, at_m, flux_lm, color))
        return lights, base.add_attributes(scene.with_bodies(*changed), attributes)

    def _draw_sun(self, windows: Sequence[Body], rng: Rng, *, shines: bool) -> tuple[Light, ...]:
        """The sun, from a direction in which it shines through one of the windows."""
        wanted = self.sun.draw(rng)
        lux = self.sun_lux.draw(rng)
        altitude = self.sun_altitude_deg.draw(rng)
        number, aside = int(rng.random() * max(1, len(windows))), 2.0 * float(rng.random()) - 1.0
        if not (shines and wanted and windows):
            return ()
        w, _, _, z = windows[number].T_world_body.quaternion_wxyz
        azimuth, up = 2.0 * math.atan2(z, w) + math.radians(50.0 * aside), math.radians(altitude)
        direction = (
            round(math.cos(up) * math.cos(azimuth), 6),
            round(math.cos(up) * math.sin(azimuth), 6),
            round(-math.sin(up), 6),
        )
        return (
            Light(
                "sun",
                "sun",
                direction=direction,
                color=(1.06, 0.99, 0.9),
                illuminance_lux=round(lux, 1),
            ),
        )


def _room_of(body: Body) -> str:
    """Name of the room that a body is in: ``room/<name>/lamp_0``."""
    return body.name.split("/")[1]


def _lamp_light(name: str, body: Body, at_m: Vec3, flux_lm: float, color: Vec3) -> Light:
    x, y, z = (round(float(v), 5) for v in body.T_world_body.apply(np.array(at_m)))
    return scale_to_flux(Light(name, "sphere", (x, y, z), color=color, radius_m=_BULB_M), flux_lm)


def _window_light(
    window: Body, own: Sequence[Body], assets: AssetIndex, luminance_cd_m2: float
) -> Light:
    """A panel before a window's sill that shines into the room, below its blind.

    Sill and reveals lie behind it. So near to a panel, light would change several times within a
    pixel or two: strips of dashes.
    """
    low, high = assets.bounds_m(window.asset)
    blind = next((b for b in own if b.name == window.name.replace("window_", "blind_")), None)
    drop = -assets.bounds_m(blind.asset)[0][2] if blind else 0.06
    width, height = round(high[1] - low[1] - 0.2, 4), round(high[2] - 0.06 - drop, 4)
    x, y, z = window.T_world_body.apply(np.array((high[0] + 0.002, 0.0, 0.06 + 0.5 * height)))
    w, _, _, qz = window.T_world_body.quaternion_wxyz
    c, s = round(1.0 - 2.0 * qz * qz, 6), round(2.0 * w * qz, 6)
    return Light(
        f"daylight/{window.name}",
        "rectangle",
        (round(float(x), 5), round(float(y), 5), round(float(z), 5)),
        (c, s, 0.0),
        _DAYLIGHT,
        size_m=(width, height),
        side=(-s, c, 0.0),
        intensity_cd=round(luminance_cd_m2 * width * height, 3),
    )
