"""Paint, dirt and licence plates of vehicles."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

from pydantic import Field

from gen_data.assets.families import declared
from gen_data.config import distributions as dist
from gen_data.config.data_files import load_table
from gen_data.core.asset_types import Material
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Body, Scene
from gen_data.core.se3 import Vec3
from gen_data.core.streams import Rng
from gen_data.randomizers.base import SurfaceRandomizer, body_materials
from gen_data.randomizers.color_space import hsv_to_linear

PAINT = "paint"
_GATHERED = 3.2
"""Dirt along sills and behind wheels over that on the paint; assumed, within a half."""
_PIGMENT = 0.45
"""Roughness of the pigment below a clear coat."""
_WORN = 0.4
"""Ratio of a clear coat's roughness to the roughness of an uncoated paint of similar appearance."""
_WEATHERED = (0.42, 0.65)
"""Roughness of paint whose clear coat has gone; assumed."""
_PALER = 0.02
"""Share of white in it: chalked pigment; assumed, within a half."""
_SOILED = {
    "paint": 1.0, "glass": 0.35, "rim": 1.5, "tyre": 1.6, "trim": 1.3, "chrome": 1.0,
    "plate": 0.8, "headlight": 0.8, "taillight": 1.0, "brakelight": 1.0, "lens": 0.8,
    "canvas": 1.2,
}  # fmt: skip
"""Dust over that on the paint, by role: wheels, sills and bumpers are near the road, panes are
wiped; assumed, within a half."""


@dataclass(frozen=True, slots=True)
class Paint:
    """A family of paints: ranges of hue, saturation and value (HSV in sRGB); its frequency."""

    hue: tuple[float, float]
    saturation: tuple[float, float]
    value: tuple[float, float]
    weight: float


PAINTS = load_table("gen_data.randomizers", "vehicle_paint", Paint)
ON_ROADS = {name: paint.weight for name, paint in PAINTS.items()}
_PLATE, _DIRT = "texture/licence_plate", "texture/road_dirt"
IN_EUROPE: dict[str, float] = declared(_PLATE, "weights")
"""Relative frequency of plates by country."""


class VehiclePaint(SurfaceRandomizer):
    """Draws the paint, the dirt and the licence plate of every vehicle.

    Attributes:
        weights: Relative frequency by colour: white, black, grey, silver, blue, red, green, brown,
            yellow, orange.
        probability: Probability that a vehicle is repainted; others keep their model's paint.
        roughness: Roughness of the finish: 0.1 waxed, 0.3 weathered.
        metallic: Whether the paint contains metal flakes; white never does.
        dirt: Fraction of dust on the vehicle's surfaces; more gathers along sills, around and
            behind wheels and on the rear.
        weathered: Probability that the clear coat of a vehicle has gone: its paint is matt
            and paler, without flakes.
        plates: Whether every vehicle gets its own licence plate instead of its model's.
        countries: Relative frequency by country of licence plates, drawn once per scene: de, fr,
            gb, ..., us_ca, us_tx, jp, cn. Plates that are not 520 mm by 110 mm are drawn smaller,
            in a dark holder.
        foreign: Probability that a vehicle's plate is of another of the countries.
        coat: Weight of a separate clear coat, traced with one ray per pixel; ``roughness`` then
            sets the wear of the coat. 0 = no separate coat.
    """

    type: Literal["vehicle_paint"] = "vehicle_paint"
    weights: dict[str, Annotated[float, Field(ge=0)]] = Field(ON_ROADS)
    probability: dist.Chance = dist.Probability(0.85)
    roughness: dist.UnitInterval = dist.LogUniform(0.1, 0.3)
    metallic: dist.Flag = dist.Probability(0.6)
    dirt: dist.UnitInterval = dist.Uniform(0.0, 0.25)
    weathered: dist.Chance = dist.Probability(0.06)
    plates: bool = Field(True)
    countries: dict[str, Annotated[float, Field(ge=0)]] = Field(IN_EUROPE)
    foreign: dist.Chance = dist.Probability(0.05)
    coat: dist.UnitInterval = dist.Constant(0.0)

    def model_post_init(self, context: object) -> None:
        """Reject unknown colours and countries, and weights that are all 0."""
        del context
        for kind, given, known in (
            ("colour", self.weights, PAINTS),
            ("country", self.countries, declared(_PLATE, "countries")),
        ):
            unknown = sorted(set(given) - set(known))
            if unknown:
                raise ValueError(f"unknown {kind} '{unknown[0]}'; expected {', '.join(known)}")
            if not any(given.values()):
                raise ValueError(f"every weight of a {kind} is 0; expected one above 0")

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with its vehicles painted; the same number of draws for each."""
        painted = []
        for body in self.find_targets(scene, assets):
            paint = self._draw_paint(rng)
            anew, dirt = self.probability.draw(rng), self.dirt.draw(rng)
            painted.append(_finish(body, assets, paint if anew else None, dirt))
        if self.plates:
            home = _pick(self.countries, rng)
            painted = [self._change_plates(body, home, rng) for body in painted]
        return scene.with_bodies(*painted)

    def _change_plates(self, body: Body, home: str, rng: Rng) -> Body:
        """Return the body with another licence plate, if it has one."""
        seed, other = int(rng.integers(declared(_PLATE, "seeds"))), _pick(self.countries, rng)
        country = other if self.foreign.draw(rng) else home
        reseed = declared(_PLATE, "reseed")
        textures = (reseed(m.texture, seed, country) for m in body.materials)
        slots = (
            m if m.texture == texture else replace(m, texture=texture)
            for m, texture in zip(body.materials, textures, strict=True)
        )
        return replace(body, materials=tuple(slots))

    def _draw_paint(self, rng: Rng) -> dict[str, Any]:
        """Draw the fields of a paint's material: colour, gloss and coat."""
        name = _pick(self.weights, rng)
        paint = PAINTS[name]
        hue, saturation, value = (
            float(rng.uniform(low, high))
            for low, high in (paint.hue, paint.saturation, paint.value)
        )
        flakes = self.metallic.draw(rng) and name != "white"
        roughness, coat = round(self.roughness.draw(rng), 4), round(self.coat.draw(rng), 4)
        color, matt = hsv_to_linear(hue, saturation, value), float(rng.uniform(*_WEATHERED))
        if self.weathered.draw(rng):
            flakes, coat, roughness = False, 0.0, round(matt, 4)
            red, green, blue = (round(c + _PALER * (1.0 - c), 6) for c in color)
            color = (red, green, blue)
        return {
            "base_color": color,
            "roughness": _PIGMENT if coat else roughness,
            "metallic": 0.25 if flakes else 0.0,
            "specular": 0.6,
            "coat": coat,
            "coat_roughness": round(_WORN * roughness, 4) if coat else Material().coat_roughness,
            "texture": "",
        }


def _finish(body: Body, assets: AssetIndex, paint: dict[str, Any] | None, dirt: float) -> Body:
    """Return the body with dust on it, and painted unless the paint is None."""
    is_soiled, cleaned, soiled, dust = (
        declared(_DIRT, fact) for fact in ("is_soiled", "cleaned", "soiled", "dust")
    )

    def finish(material: Material) -> Material:
        gathers, seed = is_soiled(material), 0
        if gathers:
            material, seed = cleaned(material)
        if paint is not None and material.role == PAINT and not material.printed:
            material = replace(material, **paint)
        if material.role in _SOILED:
            material = _soil(material, dirt, dust)
        if not gathers or dirt <= 0.0:
            return material
        dirty: Material = soiled(material, _GATHERED * dirt, seed)
        return dirty

    slots = body_materials(body, assets)
    return replace(body, materials=tuple(finish(material) for material in slots))


def _pick(weights: Mapping[str, float], rng: Rng) -> str:
    """Draw a name in proportion to its weight; independent of the order of the names."""
    names = sorted(weights)
    ends = [sum(weights[n] for n in names[: k + 1]) for k in range(len(names))]
    draw = float(rng.uniform()) * ends[-1]
    return next(n for n, end in zip(names, ends, strict=True) if draw < end)


def _soil(material: Material, dirt: float, dust: Vec3) -> Material:
    """Return the material under a thin layer of dust: blended with its colour, and rougher."""
    share = min(_SOILED[material.role] * dirt, 1.0)
    red, green, blue = (
        round(clean * (1.0 - share) + dusty * share, 6)
        for clean, dusty in zip(material.base_color, dust, strict=True)
    )
    return replace(
        material,
        base_color=(red, green, blue),
        roughness=round(material.roughness + (0.8 - material.roughness) * share, 4),
        coat=round(material.coat * (1.0 - share), 6),
    )
