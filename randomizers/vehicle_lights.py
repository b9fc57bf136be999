"""Head, tail, brake and indicator lights of vehicles."""

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Body, Light, Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.core.streams import Rng
from gen_data.randomizers import base, daylight

INDICATORS = ("none", "left", "right", "both")
_WHITE: Vec3 = (1.02, 1.0, 0.94)
RED: Vec3 = (4.2, 0.14, 0.06)
AMBER: Vec3 = (2.35, 0.66, 0.02)
"""Linear RGB of luminance 1."""
_CUTOFF = 0.01
"""UN R48: headlights of cars are aimed 1 to 1.5 % down."""
_CONE_RAD = 0.9
_EVEN = 0.5
"""The beam is uniform up to this fraction of its cone."""
_OUTSIDE_M = 0.06
"""A beam starts this far in front of its lens, which therefore does not shade it."""


class VehicleLights(base.SurfaceRandomizer):
    """Switches the lights of vehicles and adds their states to the labels.

    Attributes:
        headlights: Whether head and tail lights are on by day; they always are in the dark.
        braking: Whether the brake lights are on.
        indicator: Indicators that are on: none, left, right or both.
        headlight_cd_m2: Mean luminance of a headlight's lens outside its beam: UN R112 requires 62
            to 437 cd there (zone III), and lenses have 40 to 490 cm^2.
        taillight_cd_m2, brakelight_cd_m2, indicator_cd_m2: Luminance of the other lamps. UN R7 and
            R6 require 4 to 17 cd, 60 to 260 cd and 175 to 1000 cd; lenses have about 340, 100 and
            100 cm^2.
        beam_cd: Peak luminous intensity of a dipped beam; 9 to 14 kcd conforms to UN R112.
        beams: Whether headlights illuminate the scene in the dark.
    """

    type: Literal["vehicle_lights"] = "vehicle_lights"
    headlights: dist.Flag = dist.Probability(0.35)
    braking: dist.Flag = dist.Probability(0.2)
    indicator: Annotated[dist.Name, dist.OneOf(INDICATORS)] = dist.Choice(
        {"none": 0.9, "left": 0.05, "right": 0.05}
    )
    headlight_cd_m2: dist.Positive = dist.Uniform(5000.0, 14_000.0)
    taillight_cd_m2: dist.Positive = dist.Uniform(120.0, 500.0)
    brakelight_cd_m2: dist.Positive = dist.Uniform(6000.0, 15_000.0)
    indicator_cd_m2: dist.Positive = dist.Uniform(15_000.0, 40_000.0)
    beam_cd: dist.Positive = dist.Uniform(9000.0, 14_000.0)
    beams: bool = Field(True)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with drawn states of all vehicle lights."""
        dark = daylight.is_dark(scene)
        bodies, lights, states = [], list(scene.lights), {}
        for body in self.find_targets(scene, assets):
            on, braking = self.headlights.draw(rng), self.braking.draw(rng)
            side, beam_cd = self.indicator.draw(rng), self.beam_cd.draw(rng)
            on = on or dark
            glow = self._draw_emission(on, braking, side, rng)
            bodies.append(base.set_emission(body, assets, glow))
            states[body.instance_id] = (
                ("brake_lights", "on" if braking else "off"),
                ("head_lights", "on" if on else "off"),
                ("indicator", side),
            )
            if dark and self.beams:
                lights += _beams(self.name, body, assets, beam_cd)
        lit = replace(scene.with_bodies(*bodies), lights=tuple(lights))
        return base.add_attributes(lit, states)

    def _draw_emission(self, on: bool, braking: bool, side: str, rng: Rng) -> dict[str, Vec3]:
        """Draw emission by role; every luminance is drawn: switches shift no other draw."""
        head, tail = self.headlight_cd_m2.draw(rng), self.taillight_cd_m2.draw(rng)
        brake, blink = self.brakelight_cd_m2.draw(rng), self.indicator_cd_m2.draw(rng)
        glow: dict[str, Vec3] = {}
        if on:
            glow["headlight"] = base.scale_emission(_WHITE, head)
            glow["taillight"] = base.scale_emission(RED, tail)
        if braking:
            glow["brakelight"] = base.scale_emission(RED, brake)
        for name in ("left", "right"):
            if side in (name, "both"):
                glow[f"indicator_{name}"] = base.scale_emission(AMBER, blink)
        return glow


def dipped_beam(name: str, T_world_lens: SE3, beam_cd: float) -> Light:
    """Dipped beam of a lens that faces +X, with a cut-off."""
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
    lights = []
    for point in assets.keypoints(body.asset):
        if point.name.startswith("headlight"):
            x, y, z = (body.scale * part for part in point.position_m)
            place = body.T_world_body @ SE3((x + _OUTSIDE_M, y, z))
            beam = dipped_beam(f"{name}/{body.name}/{point.name}", place, beam_cd)
            lights.append(replace(beam, body=body.name))
    return lights
