"""Colours of vehicles as they are met on roads, and the dirt on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from generator.config.distributions import Choice, Name, Uniform, UnitInterval
from generator.core.errors import ConfigError, did_you_mean
from generator.core.geometry import Material
from generator.core.interfaces import AssetIndex
from generator.core.scene import Body, Instance, Scene
from generator.core.se3 import Vec3
from generator.core.streams import Rng
from randomizers.base import LookRandomizer, materials_of
from randomizers.color_space import linear_of_hsv

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Shade:
    """The paints that go by one name.

    Attributes:
        hue, saturation, value: Of the paint in sRGB; hues may run past 1.
        effect: Share of metallic and pearlescent paints.
    """

    hue: Range
    saturation: Range
    value: Range
    effect: float


SHADES: Mapping[str, _Shade] = {
    "white": _Shade((0.08, 0.16), (0.0, 0.05), (0.88, 0.96), 0.41),
    "black": _Shade((0.55, 0.72), (0.0, 0.25), (0.05, 0.15), 0.6),
    "grey": _Shade((0.52, 0.66), (0.02, 0.14), (0.24, 0.5), 0.8),
    "silver": _Shade((0.08, 0.62), (0.0, 0.05), (0.68, 0.8), 1.0),
    "blue": _Shade((0.56, 0.65), (0.55, 0.92), (0.22, 0.62), 0.75),
    "red": _Shade((0.975, 1.01), (0.8, 0.95), (0.4, 0.75), 0.4),
    "brown": _Shade((0.05, 0.1), (0.25, 0.6), (0.2, 0.5), 0.8),
    "green": _Shade((0.25, 0.45), (0.3, 0.75), (0.18, 0.5), 0.6),
    "yellow": _Shade((0.11, 0.145), (0.8, 0.97), (0.85, 0.98), 0.2),
    "orange": _Shade((0.035, 0.075), (0.85, 0.97), (0.8, 0.95), 0.3),
}
"""White: 14 of 34 per cent are pearlescent (Axalta 2022, see VehiclePaint); others by eye."""

_COMMERCIAL = frozenset({"van", "truck", "bus"})
_DUST: Vec3 = (0.29, 0.25, 0.2)
_COVER = {"paint": 0.12, "glass": 0.02, "trim": 0.6, "underbody": 0.8, "tyre": 0.7, "rim": 0.35}
"""How much of a slot dust covers on a vehicle as dirty as can be, by role: most of it is low."""


class VehiclePaint(LookRandomizer):
    """Paints vehicles: every slot of role ``paint`` of a vehicle takes one colour.

    The vehicle's labels get the colour's name as the attribute ``color``. Bodies without paint
    stay as they are.

    Attributes:
        color: Name of the colour: white, black, grey, silver, blue, red, brown, green, yellow or
            orange. The default are the shares of new cars world-wide (Axalta, "70th Global
            Automotive Color Popularity Report", 2022); the 4 % that it does not name are spread.
        commercial_color: The same for vans, trucks and buses, most of which are white.
        flake: How metallic an effect paint is; solid paints are not.
        roughness: Of the paint; that of a polished car is below 0.15.
        dirt: 0 is washed, 1 is as dusty as vehicles get; low parts take most of it.
    """

    type: Literal["vehicle_paint"] = "vehicle_paint"
    color: Name = Choice(
        {
            "white": 34.0,
            "black": 21.0,
            "grey": 19.0,
            "silver": 8.0,
            "blue": 8.0,
            "red": 5.0,
            "brown": 2.0,
            "green": 1.0,
            "yellow": 1.0,
            "orange": 1.0,
        }
    )
    commercial_color: Name = Choice(
        {
            "white": 60.0,
            "silver": 7.0,
            "grey": 7.0,
            "blue": 8.0,
            "red": 7.0,
            "yellow": 5.0,
            "green": 3.0,
            "black": 3.0,
        }
    )
    flake: UnitInterval = Uniform(0.25, 0.5)
    roughness: UnitInterval = Uniform(0.1, 0.25)
    dirt: UnitInterval = Uniform(0.0, 0.5)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """One paint per vehicle."""
        painted: list[Body] = []
        names: dict[int, str] = {}
        for body in self.chosen(scene):
            slots = materials_of(body, assets)
            if not any(material.role == "paint" for material in slots):
                continue
            name = self._color(assets.get(body.asset).category, rng)
            paint, dirt = self._paint(name, rng), self.dirt.draw(rng)
            coated = (_coated(material, paint) for material in slots)
            painted.append(
                replace(body, materials=tuple(_dusty(material, dirt) for material in coated))
            )
            names[body.instance_id] = name
        instances = tuple(_told(i, names.get(i.instance_id, "")) for i in scene.instances)
        return replace(scene.with_bodies(*painted), instances=instances)

    def _color(self, category: str, rng: Rng) -> str:
        field = "commercial_color" if category in _COMMERCIAL else "color"
        drawn: str = getattr(self, field).draw(rng)
        if drawn not in SHADES:
            raise ConfigError(
                f"randomizers.{self.name}.{field}: unknown colour '{drawn}'; expected one of "
                f"{', '.join(SHADES)}{did_you_mean(drawn, SHADES)}"
            )
        return drawn

    def _paint(self, name: str, rng: Rng) -> Material:
        shade = SHADES[name]
        hue, saturation, value = (
            low + (high - low) * float(rng.random())
            for low, high in (shade.hue, shade.saturation, shade.value)
        )
        effect, flake = float(rng.random()) < shade.effect, self.flake.draw(rng)
        # Flakes scatter the reflection that a clear coat alone would leave sharp.
        roughness = self.roughness.draw(rng) + (0.12 * flake if effect else 0.0)
        return Material(
            base_color=linear_of_hsv(hue, saturation, value),
            roughness=round(min(roughness, 1.0), 4),
            metallic=round(flake, 4) if effect else 0.0,
            specular=0.6,
        )


def _coated(material: Material, paint: Material) -> Material:
    """The slot under that paint, if it is painted."""
    if material.role != "paint" or material.printed:
        return material
    return replace(paint, role="paint")


def _dusty(material: Material, dirt: float) -> Material:
    """The slot under its share of the dust."""
    cover = dirt * _COVER.get(material.role, 0.0)
    if cover <= 0.0:
        return material
    r, g, b = (
        round(own + (dust - own) * cover, 6)
        for own, dust in zip(material.base_color, _DUST, strict=True)
    )
    return replace(
        material,
        base_color=(r, g, b),
        roughness=round(material.roughness + (0.9 - material.roughness) * cover, 4),
        metallic=round(material.metallic * (1.0 - cover), 4),
    )


def _told(instance: Instance, color: str) -> Instance:
    """The instance with its colour among its attributes."""
    if not color:
        return instance
    facts = {**dict(instance.attributes), "color": color}
    return replace(instance, attributes=tuple(sorted(facts.items())))
