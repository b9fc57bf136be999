"""Lights of vehicles: beams, brake lights, indicators."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np

from generator.config.distributions import (
    Bounds,
    Choice,
    Constant,
    Count,
    Flag,
    LogUniform,
    Name,
    Positive,
    Probability,
    Scalar,
    Uniform,
)
from generator.core.errors import ConfigError, did_you_mean
from generator.core.geometry import Material
from generator.core.interfaces import AssetIndex
from generator.core.scene import Body, Instance, Light, Scene
from generator.core.se3 import Vec3
from generator.core.streams import Rng
from randomizers.base import LookRandomizer, materials_of
from randomizers.color_space import linear_of_temperature
from randomizers.daylight import is_dark

ROLES = frozenset({"headlight", "taillight", "brakelight", "indicator_left", "indicator_right"})
"""Roles of the slots that glow."""
INDICATORS: Mapping[str, tuple[str, ...]] = {
    "off": (),
    "left": ("indicator_left",),
    "right": ("indicator_right",),
    "hazard": ("indicator_left", "indicator_right"),
}
_RED: Vec3 = (4.35, 0.1, 0.03)
_AMBER: Vec3 = (2.55, 0.64, 0.0)
_AHEAD_M = 0.06
"""How far before the lens a spot stands, so that the lens does not shade it."""


@dataclass(frozen=True, slots=True)
class _State:
    """What one vehicle shows."""

    on: bool
    brake: bool
    indicator: str
    color: Vec3


class VehicleLights(LookRandomizer):
    """Switches the lights of vehicles: slots by role, and the beams of the nearest ones.

    The labels get the attributes ``head_lights``, ``brake_lights`` (on, off) and ``indicator``.
    Default luminances are intensities that UN regulations allow, over the areas of real lamps.

    Attributes:
        head_lights: Whether a vehicle has its lights on by day.
        dark_head_lights: The same when time_of_day or weather, listed before it, has put the sun
            below the horizon.
        brake_lights: Whether it brakes.
        indicator: off, left, right or hazard: what is lit at this instant.
        temperature_k: Of head lights: 3200 halogen, 4300 xenon, 5500 LED.
        head_luminance_cd_m2: Of a head light, seen from outside its beam, where UN Regulation
            112 allows 350 cd, from 0.01 to 0.03 m^2.
        tail_luminance_cd_m2: Of a rear position lamp: 4 to 17 cd (UN Regulation 7).
        brake_luminance_cd_m2: Of a stop lamp: 60 to 185 cd (UN Regulation 7).
        indicator_luminance_cd_m2: Of a direction indicator: 50 to 500 cd (UN Regulation 6).
        spots: How many vehicles, those nearest to the cameras (or to the focus of a scene without
            any), light the road when it is dark.
        beam_cd: Of one head light; at least 10100 cd at point 75R (UN Regulation 112, class B).
        cone_deg: Half angle of a beam; its upper edge is level.
    """

    type: Literal["vehicle_lights"] = "vehicle_lights"
    head_lights: Flag = Probability(0.3)
    dark_head_lights: Flag = Probability(0.98)
    brake_lights: Flag = Probability(0.2)
    indicator: Name = Choice({"off": 86.0, "left": 6.0, "right": 6.0, "hazard": 2.0})
    temperature_k: Annotated[Scalar, Bounds(1667, 25_000)] = Choice(
        {3200.0: 3.0, 4300.0: 1.0, 5500.0: 3.0}
    )
    head_luminance_cd_m2: Positive = LogUniform(12_000.0, 35_000.0)
    tail_luminance_cd_m2: Positive = LogUniform(400.0, 1700.0)
    brake_luminance_cd_m2: Positive = LogUniform(6000.0, 18_000.0)
    indicator_luminance_cd_m2: Positive = LogUniform(5000.0, 20_000.0)
    spots: Count = Constant(3)
    beam_cd: Positive = Uniform(10_000.0, 20_000.0)
    cone_deg: Annotated[Scalar, Bounds(2, 60)] = Uniform(16.0, 20.0)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene with every lamp of its vehicles on or off."""
        dark = is_dark(scene)
        shown: list[tuple[Body, _State]] = []
        for body in self.chosen(scene):
            if any(material.role in ROLES for material in materials_of(body, assets)):
                state = self._state(dark, rng)
                shown.append((self._lit(body, assets, state, rng), state))
        told = {body.instance_id: state for body, state in shown}
        lit = [(body, state) for body, state in shown if state.on]
        nearest = sorted(lit, key=lambda pair: _squared_distance_m2(pair[0], scene))
        count = self.spots.draw(rng) if dark else 0
        beams = [
            light
            for body, state in nearest[:count]
            for light in self._beams(body, assets, state.color, rng)
        ]
        return replace(
            scene.with_bodies(*(body for body, _ in shown)),
            lights=(*scene.lights, *beams),
            instances=tuple(_told(i, told.get(i.instance_id)) for i in scene.instances),
        )

    def _state(self, dark: bool, rng: Rng) -> _State:
        on = (self.dark_head_lights if dark else self.head_lights).draw(rng)
        brake, indicator = self.brake_lights.draw(rng), self.indicator.draw(rng)
        if indicator not in INDICATORS:
            raise ConfigError(
                f"randomizers.{self.name}.indicator: unknown state '{indicator}'; expected one of "
                f"{', '.join(INDICATORS)}{did_you_mean(indicator, INDICATORS)}"
            )
        color = linear_of_temperature(self.temperature_k.draw(rng))
        return _State(bool(on), bool(brake), indicator, color)

    def _lit(self, body: Body, assets: AssetIndex, state: _State, rng: Rng) -> Body:
        slots = materials_of(body, assets)
        head = _times(state.color, self.head_luminance_cd_m2.draw(rng) * state.on)
        tail = _times(_RED, self.tail_luminance_cd_m2.draw(rng) * state.on)
        brake = _times(_RED, self.brake_luminance_cd_m2.draw(rng) * state.brake)
        amber = _times(_AMBER, self.indicator_luminance_cd_m2.draw(rng))
        # Some vehicles brake with their tail lights.
        if state.brake and not any(material.role == "brakelight" for material in slots):
            tail = brake
        glow = {"headlight": head, "taillight": tail, "brakelight": brake}
        glow |= {role: _times(amber, role in INDICATORS[state.indicator])
                 for role in ("indicator_left", "indicator_right")}  # fmt: skip

        def lit(material: Material) -> Material:
            return replace(material, emission_cd_m2=glow[material.role])

        return replace(body, materials=tuple(lit(m) if m.role in ROLES else m for m in slots))

    def _beams(self, body: Body, assets: AssetIndex, color: Vec3, rng: Rng) -> Iterator[Light]:
        """A spot before each of the vehicle's head lights."""
        cone_rad, beam_cd = math.radians(self.cone_deg.draw(rng)), self.beam_cd.draw(rng)
        # A spot is even up to 0.8 of its cone: that much below the level, little light dazzles.
        dip_rad = 0.8 * cone_rad
        along = np.array([math.cos(dip_rad), 0.0, -math.sin(dip_rad)])
        direction = _vector(body.T_world_body.rotate(along))
        for keypoint in assets.keypoints(body.asset):
            if not keypoint.name.startswith("headlight"):
                continue
            at_body = body.scale * np.asarray(keypoint.position_m) + [_AHEAD_M, 0.0, 0.0]
            yield Light(
                f"{self.name}/{body.name}/{keypoint.name}",
                "spot",
                position_m=_vector(body.T_world_body.apply(at_body)),
                direction=direction,
                color=color,
                intensity_cd=round(beam_cd, 2),
                radius_m=0.05,
                cone_rad=round(cone_rad, 6),
            )


def _squared_distance_m2(body: Body, scene: Scene) -> float:
    """To the nearest camera; to the scene's focus if there is none."""
    x, y, _ = body.T_world_body.translation_m
    eyes = [c.T_world_camera.translation_m for c in scene.cameras] or [scene.focus.center_m]
    return min((x - eye[0]) ** 2 + (y - eye[1]) ** 2 for eye in eyes)


def _told(instance: Instance, state: _State | None) -> Instance:
    """The instance with its lights among its attributes."""
    if state is None:
        return instance
    facts = {
        **dict(instance.attributes),
        "head_lights": "on" if state.on else "off",
        "brake_lights": "on" if state.brake else "off",
        "indicator": state.indicator,
    }
    return replace(instance, attributes=tuple(sorted(facts.items())))


def _times(color: Vec3, luminance_cd_m2: float) -> Vec3:
    red, green, blue = (round(part * luminance_cd_m2, 2) for part in color)
    return (red, green, blue)


def _vector(values: np.ndarray) -> Vec3:
    x, y, z = (round(float(value), 6) + 0.0 for value in values)
    return (x, y, z)
