"""Paint and lights of vehicles, by the roles of their slots."""

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chisquare

from gen_data.config.distributions import Constant
from gen_data.core import asset_types, colorimetry, se3
from gen_data.core.scene import Body, Instance, Light, ObjectGroup, Scene
from gen_data.randomizers import daylight, vehicle_lights
from gen_data.randomizers.vehicle_paint import ON_ROADS, PAINTS, VehiclePaint
from gen_data.sky.sky import SkyModel
from tests.randomizers.doubles import FakeAssets, rng_of


def road(count: int = 1, dark: bool = False) -> Scene:
    """Wagons in a row, facing +Y, by day or at night."""
    bodies = tuple(
        Body(
            f"traffic/{k}",
            "wagon",
            se3.SE3.about_z(0.5 * np.pi, (3.0 * k, 0.0, 0.75)),
            instance_id=k + 1,
            group="traffic",
        )
        for k in range(count)
    )
    instances = tuple(Instance(k + 1, b.name, "car", 0, "wagon") for k, b in enumerate(bodies))
    group = ObjectGroup("traffic", (), ("wagon",), count, "along", lanes=("driving",))
    scene = Scene("test", bodies=bodies, instances=instances, groups=(group,))
    return daylight.set_daylight(scene, SkyModel(1, -30.0 if dark else 40.0, 2.5, 0.0), 0.0)


def slots(body: Body) -> dict[str, asset_types.Material]:
    return {material.role: material for material in body.materials}


def lit(scene: Scene, **fields: Any) -> Scene:
    return vehicle_lights.VehicleLights(name="lights", **fields)(scene, FakeAssets(), rng_of())


def named(color: tuple[float, float, float]) -> str:
    """The paint whose ranges a linear colour lies in."""
    import colorsys

    srgb = [1.055 * c ** (1 / 2.4) - 0.055 if c > 0.0031308 else 12.92 * c for c in color]
    hue, saturation, value = colorsys.rgb_to_hsv(*srgb)
    for name in ("yellow", "orange", "red", "blue", "green", "brown"):
        paint = PAINTS[name]
        low, high = paint.hue
        in_hue = any(low - 1e-3 <= hue + turn <= high + 1e-3 for turn in (0.0, 1.0))
        in_saturation = paint.saturation[0] - 0.01 <= saturation <= paint.saturation[1] + 0.01
        if in_hue and in_saturation and paint.value[0] - 0.01 <= value <= paint.value[1] + 0.01:
            return name
    return min(
        ("white", "silver", "grey", "black"),
        key=lambda name: max(PAINTS[name].value[0] - value, value - PAINTS[name].value[1]),
    )


def test_colours_have_the_weights_they_are_given() -> None:
    """Chi-squared over 1,500 cars; the rare ones are taken together."""
    painter = VehiclePaint(
        name="paint", targets=("traffic",), probability=Constant(True), dirt=Constant(0.0)
    )
    scene = painter(road(1500), FakeAssets(), rng_of())
    seen = Counter(named(slots(body)["paint"].base_color) for body in scene.bodies)
    common = ["white", "black", "grey", "silver", "blue", "red"]
    total = sum(ON_ROADS.values())
    expected = [1500 * ON_ROADS[name] / total for name in common]
    observed = [seen[name] for name in common]

    assert (
        chisquare([*observed, 1500 - sum(observed)], [*expected, 1500 - sum(expected)]).pvalue
        > 1e-3
    )


def test_only_paint_is_painted_and_dust_takes_everything_towards_its_colour() -> None:
    """Glass keeps its colour without dirt; with it, everything is duller."""
    clean, dirty = (
        VehiclePaint(name="paint", targets=("traffic",), dirt=Constant(dirt))(
            road(), FakeAssets(), rng_of()
        ).bodies[0]
        for dirt in (0.0, 0.8)
    )

    assert slots(clean)["glass"] == asset_types.Material(role="glass")
    assert slots(clean)["paint"] != asset_types.Material(role="paint")
    for role in ("paint", "glass", "tyre"):
        assert slots(dirty)[role].roughness > slots(clean)[role].roughness


def test_a_coat_lies_over_paint_alone_and_dust_dulls_it() -> None:
    """Weight 1 on clean paint, 0.6 under 40 % dust; other roles have none; colours stay."""
    plain, clean, dusty = (
        VehiclePaint(
            name="paint",
            targets=("traffic",),
            probability=Constant(True),
            dirt=Constant(dirt),
            coat=Constant(coat),
        )(road(), FakeAssets(), rng_of()).bodies[0]
        for coat, dirt in ((0.0, 0.0), (1.0, 0.0), (1.0, 0.4))
    )

    assert {m.role for m in clean.materials if m.coat} == {"paint"}
    assert slots(clean)["paint"].coat == 1.0 and slots(plain)["paint"].coat == 0.0
    assert slots(dusty)["paint"].coat == pytest.approx(0.6)
    assert slots(clean)["paint"].base_color == slots(plain)["paint"].base_color
    assert slots(clean)["paint"].coat_roughness < 0.15 < slots(clean)["paint"].roughness


def test_lights_glow_by_role_and_are_labelled() -> None:
    """Braking to the left by day with head lights off."""
    scene = lit(
        road(), headlights=Constant(False), braking=Constant(True), indicator=Constant("left"),
        brakelight_cd_m2=Constant(9000.0),
    )  # fmt: skip
    glowing = {m.role for m in scene.bodies[0].materials if max(m.emission_cd_m2) > 0.0}

    assert glowing == {"brakelight", "indicator_left"}
    emission = np.array(slots(scene.bodies[0])["brakelight"].emission_cd_m2)
    assert float(colorimetry.luminance(emission)) == pytest.approx(9000.0, rel=0.01)
    assert dict(scene.instances[0].attributes) == {
        "brake_lights": "on",
        "head_lights": "off",
        "indicator": "left",
    }
    assert [light.name for light in scene.lights] == [light.name for light in road().lights]


def test_beams_light_the_street_in_the_dark_only() -> None:
    """Two spots per vehicle, just before the lenses, ahead and cut off below the horizon."""
    night = lit(road(3, dark=True), headlights=Constant(False))
    beams: list[Light] = [light for light in night.lights if light.kind == "spot"]

    assert len(beams) == 6
    for beam in beams:
        assert beam.direction[1] > 0.98
        assert abs(beam.direction[2]) < 0.02
        assert 0.01 <= beam.cutoff <= 0.015
        assert beam.position_m[1] == pytest.approx(2.26)
    assert dict(night.instances[0].attributes)["head_lights"] == "on"
    without = replace(night, lights=())
    assert not [x for x in lit(without, beams=False).lights if x.kind == "spot"]
