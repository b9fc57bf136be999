"""Head, tail, brake and indicator lights of vehicles."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gen_data.generator.config.distributions import (
    Choice,
    Flag,
    Name,
    Positive,
    Probability,
    Uniform,
)
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Body, Instance, Light, Scene
from gen_data.generator.core.se3 import SE3, Vec3
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.base import LookRandomizer, body_materials
from gen_data.randomizers.daylight import is_dark

_WHITE: Vec3 = (1.02, 1.0, 0.94)
RED: Vec3 = (4.2, 0.14, 0.06)
AMBER: Vec3 = (2.35, 0.66, 0.02)
"""Linear RGB of luminance 1."""
_CUTOFF = 0.01
"""UN R48: headlights of cars are aimed 1 to 1.5 % down."""
_CONE_RAD = 0.9
_EVEN = 0.5
_OUTSIDE_M = 0.06


class VehicleLights(LookRandomizer):
    """Switches lights of vehicles on, by the roles of their slots, and labels their state.

    Attributes:
        headlights: Whether head and tail lights are on by day; in the dark they always are.
        braking: Whether the brake lights are on.
        indicator: Which indicator blinks: none, left, right or both.
        headlight_cd_m2: Luminance of headlight slots: what a lens shows on average off its beam.
        taillight_cd_m2, brakelight_cd_m2, indicator_cd_m2: Luminance of the other slots. UN R7
            and R6 ask for 4 to 17 cd, 60 to 260 cd and 175 to 1000 cd; lenses have 50 to 100 cm^2.
        beam_cd: Luminous intensity of a dipped beam where it is brightest; with 9 to 14 kcd the
            whole beam is as UN R112 asks for.
        beams: Whether headlights cast light on the street in the dark.
    """

    type: Literal["vehicle_lights"] = "vehicle_lights"
    headlights: Flag = Probability(0.35)
    braking: Flag = Probability(0.2)
    indicator: Name = Choice({"none": 0.9, "left": 0.05, "right": 0.05})
    headlight_cd_m2: Positive = Uniform(15_000.0, 40_000.0)
    taillight_cd_m2: Positive = Uniform(600.0, 1500.0)
    brakelight_cd_m2: Positive = Uniform(6000.0, 15_000.0)
    indicator_cd_m2: Positive = Uniform(15_000.0, 40_000.0)
    beam_cd: Positive = Uniform(9000.0, 14_000.0)
    beams: bool = Field(True)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene with the lights of its vehicles as drawn."""
        dark = is_dark(scene)
        bodies, lights, states = [], list(scene.lights), {}
        for body in self.chosen(scene):
            on, braking = self.headlights.draw(rng), self.braking.draw(rng)
            side, beam_cd = self.indicator.draw(rng), self.beam_cd.draw(rng)
            on = on or dark
            glow = self._glow(on, braking, side, rng)
            bodies.append(set_emission(body, assets, glow))
            states[body.instance_id] = (
                ("brake_lights", _word(braking)),
                ("head_lights", _word(on)),
                ("indicator", side),
            )
            if dark and self.beams:
                lights += _beams(self.name, body, assets, beam_cd)
        return replace(
            scene.with_bodies(*bodies),
            lights=tuple(lights),
            instances=tuple(_label(i, states.get(i.instance_id, ())) for i in scene.instances),
        )

    def _glow(self, on: bool, braking: bool, side: str, rng: Rng) -> dict[str, Vec3]:
        """Emission by role; one draw of every luminance, so that switches move no other draw."""
        head, tail, brake, blink = (
            luminance.draw(rng)
            for luminance in (
                self.headlight_cd_m2,
                self.taillight_cd_m2,
                self.brakelight_cd_m2,
                self.indicator_cd_m2,
            )
        )
        glow: dict[str, Vec3] = {}
        if on:
            glow |= {
                "headlight": scale_emission(_WHITE, head),
                "taillight": scale_emission(RED, tail),
            }
        if braking:
            glow["brakelight"] = scale_emission(RED, brake)
        for name in ("left", "right"):
            if side in (name, "both"):
                glow[f"indicator_{name}"] = scale_emission(AMBER, blink)
        return glow


def set_emission(body: Body, assets: AssetIndex, glow: dict[str, Vec3]) -> Body:
    """The body with the emission of some roles exchanged."""

    def set_emission(material: Material) -> Material:
        return replace(material, emission_cd_m2=glow.get(material.role, material.emission_cd_m2))

    return replace(body, materials=tuple(set_emission(m) for m in body_materials(body, assets)))


def dipped_beam(name: str, T_world_lens: SE3, beam_cd: float) -> Light:
    """The dipped beam of a lens, which faces +X: dark above its cut-off."""
    x, y, z = (round(part, 6) for part in T_world_lens.translation_m)
    dx, dy, dz = (round(float(part), 6) for part in T_world_lens.rotation()[:, 0])
    return Light(
        name,
        "spot",
        position_m=(x, y, z),
        direction=(dx, dy, dz),
        color=_WHITE,
        intensity_cd=round(beam_cd, 3),
        radius_m=0.05,
        cone_rad=_CONE_RAD,
        even=_EVEN,
        cutoff=_CUTOFF,
    )


def _beams(name: str, body: Body, assets: AssetIndex, beam_cd: float) -> list[Light]:
    """One spot per headlight, just before its lens."""
    lights = []
    for point in assets.keypoints(body.asset):
        if point.name.startswith("headlight"):
            x, y, z = (body.scale * part for part in point.position_m)
            place = body.T_world_body @ SE3((x + _OUTSIDE_M, y, z))
            beam = dipped_beam(f"{name}/{body.name}/{point.name}", place, beam_cd)
            lights.append(replace(beam, body=body.name))
    return lights


def _label(instance: Instance, states: tuple[tuple[str, str], ...]) -> Instance:
    attributes = {**dict(instance.attributes), **dict(states)}
    return replace(instance, attributes=tuple(sorted(attributes.items())))


def _word(on: bool) -> str:
    return "on" if on else "off"


def scale_emission(color: Vec3, luminance_cd_m2: float) -> Vec3:
    """Emission of a colour of luminance 1."""
    red, green, blue = (round(part * luminance_cd_m2, 3) for part in color)
    return (red, green, blue)
