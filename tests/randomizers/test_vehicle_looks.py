"""Paint and lights of vehicles, by the roles of their slots."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from generator.config.distributions import Choice, Constant
from generator.core.errors import ConfigError
from generator.core.geometry import Asset, Material
from generator.core.scene import Body, Instance, ObjectGroup, Scene
from generator.core.se3 import SE3
from randomizers.vehicle_lights import VehicleLights
from randomizers.vehicle_paint import SHADES, VehiclePaint
from tests.randomizers.doubles import FakeAssets, rng_of

ASSETS = FakeAssets()


def street(cars: int = 1, *, dark: bool = False) -> Scene:
    """Cars 10 m apart along X, heading +Y, the first at the origin; and a brick."""
    bodies = [
        Body(
            f"traffic/{k}",
            "car",
            SE3.about_z(0.5 * np.pi, (10.0 * k, 0.0, 0.0)),
            instance_id=k + 1,
            group="traffic",
        )
        for k in range(cars)
    ]
    brick = Body("traffic/brick", "brick", instance_id=cars + 1, group="traffic")
    instances = tuple(
        Instance(b.instance_id, b.name, "car", 1, b.asset, attributes=(("age", "new"),))
        for b in (*bodies, brick)
    )
    return Scene(
        "test",
        bodies=(*bodies, brick),
        instances=instances,
        groups=(ObjectGroup("traffic", (), ("car",), cars, "along", lanes=("driving",)),),
        shared=(("sun_altitude_deg", -8.0 if dark else 30.0),),
    )


def slot(scene: Scene, role: str, body: str = "traffic/0") -> Material:
    """The slot of that role of a body."""
    return next(m for m in scene.body(body).materials if m.role == role)


def facts(scene: Scene, instance_id: int = 1) -> dict[str, str]:
    """Attributes of an instance."""
    return dict(scene.instance(instance_id).attributes)


def luminance(material: Material) -> float:
    """Emitted luminance [cd/m^2], by the weights of ITU-R BT.709."""
    return float(np.dot(material.emission_cd_m2, (0.2126, 0.7152, 0.0722)))


def test_colours_follow_the_shares_of_the_paint_makers_report() -> None:
    """Chi-square against Axalta 2022: white 34, black 21, grey 19, silver 8, blue 8, red 5 %."""
    scene = street(3000)
    painted = VehiclePaint(name="paint")(scene, ASSETS, rng_of("fit"))
    counts = Counter(facts(painted, k + 1)["color"] for k in range(3000))

    named = {"white": 34, "black": 21, "grey": 19, "silver": 8, "blue": 8, "red": 5, "green": 1}
    observed = [counts[name] for name in named]
    expected = [30.0 * share for share in named.values()]
    rest = (3000 - sum(observed), 3000 - sum(expected))
    fit = stats.chisquare([*observed, rest[0]], [*expected, rest[1]])

    assert fit.pvalue > 1e-4


@pytest.mark.parametrize("name", SHADES)
def test_a_paint_looks_like_its_name(name: str) -> None:
    """Luminance and the strongest channel are those of the colour word, in 50 draws each."""
    brightness = {
        "white": (0.6, 0.95), "black": (0.0, 0.03), "grey": (0.035, 0.23), "silver": (0.38, 0.62),
        "blue": (0.003, 0.16), "red": (0.02, 0.2), "brown": (0.01, 0.2), "green": (0.01, 0.22),
        "yellow": (0.35, 0.8), "orange": (0.15, 0.5),
    }  # fmt: skip
    strongest = {"blue": 2, "red": 0, "brown": 0, "green": 1, "yellow": 0, "orange": 0}
    paint = VehiclePaint(name="paint", color=Constant(name), dirt=Constant(0.0))

    scene = paint(street(50), ASSETS, rng_of(name))

    for k in range(50):
        color = slot(scene, "paint", f"traffic/{k}").base_color
        low, high = brightness[name]
        assert low <= np.dot(color, (0.2126, 0.7152, 0.0722)) <= high
        if name in strongest:
            assert int(np.argmax(color)) == strongest[name]


def test_paint_leaves_everything_else_as_it_was() -> None:
    """Clean cars change in their paint slots only; what has no paint is no vehicle."""
    before = street()

    after = VehiclePaint(name="paint", dirt=Constant(0.0))(before, ASSETS, rng_of())

    own = ASSETS.materials("car")
    assert [m for m in after.body("traffic/0").materials if m.role != "paint"] == [
        m for m in own if m.role != "paint"
    ]
    assert after.body("traffic/brick") == before.body("traffic/brick")
    assert after.instance(2) == before.instance(2)
    assert facts(after)["age"] == "new"


def test_silver_is_always_an_effect_paint_and_solid_paint_is_no_metal() -> None:
    """Flakes make a paint metallic and less sharp; white is solid more often than not."""
    metal = {}
    for name in ("silver", "white"):
        paint = VehiclePaint(name="paint", color=Constant(name), dirt=Constant(0.0))
        scene = paint(street(400), ASSETS, rng_of(name))
        metal[name] = [slot(scene, "paint", f"traffic/{k}").metallic for k in range(400)]

    assert min(metal["silver"]) >= 0.25
    assert stats.binomtest(sum(m > 0 for m in metal["white"]), 400, 14 / 34).pvalue > 1e-4


def test_dirt_covers_low_parts_more_than_paint_and_glass() -> None:
    """Dust makes slots rougher and draws their colours together."""
    clean, dirty = (
        VehiclePaint(name="paint", color=Constant("black"), dirt=Constant(d))(
            street(), ASSETS, rng_of()
        )
        for d in (0.0, 1.0)
    )

    gain = {
        role: slot(dirty, role).roughness - slot(clean, role).roughness
        for role in ("paint", "glass", "trim")
    }
    assert gain["trim"] > gain["paint"] > gain["glass"] > 0.0
    assert slot(dirty, "paint").base_color[0] > slot(clean, "paint").base_color[0]


def test_vans_take_the_other_shares() -> None:
    """``commercial_color`` is for the categories van, truck and bus."""

    class Vans(FakeAssets):
        """The same cars, called vans."""

        def get(self, asset_id: str) -> Asset:
            return replace(super().get(asset_id), category="van")

    paint = VehiclePaint(name="paint", color=Constant("red"), commercial_color=Constant("yellow"))

    assert facts(paint(street(), Vans(), rng_of()))["color"] == "yellow"
    assert facts(paint(street(), ASSETS, rng_of()))["color"] == "red"


def test_unknown_words_are_refused_with_the_nearest_known_one() -> None:
    """The message names the field, the word and what was meant."""
    with pytest.raises(ConfigError, match=r"paint\.color: .*'gray'.*did you mean 'grey'"):
        VehiclePaint(name="paint", color=Constant("gray"))(street(), ASSETS, rng_of())
    with pytest.raises(ConfigError, match=r"lights\.indicator: .*'rigth'.*did you mean 'right'"):
        VehicleLights(name="lights", indicator=Constant("rigth"))(street(), ASSETS, rng_of())


@pytest.mark.parametrize("state", ["off", "left", "right", "hazard"])
def test_indicators_light_the_sides_they_name(state: str) -> None:
    """And the label says so."""
    scene = VehicleLights(name="lights", indicator=Constant(state))(street(), ASSETS, rng_of())

    lit = {side for side in ("left", "right") if luminance(slot(scene, f"indicator_{side}")) > 1000}
    assert lit == {"left", "right"} if state == "hazard" else lit == {state} - {"off"}
    assert facts(scene)["indicator"] == state


@pytest.mark.parametrize(("role", "field", "label", "low", "high"), [
    ("headlight", "head_lights", "head_lights", 350 / 0.03, 350 / 0.01),
    ("taillight", "head_lights", "head_lights", 400, 1700),
    ("brakelight", "brake_lights", "brake_lights", 6000, 18_500),
])  # fmt: skip
def test_lamps_glow_as_bright_as_regulations_allow_or_not_at_all(
    role: str, field: str, label: str, low: float, high: float
) -> None:
    """Luminance is allowed intensity over the lamp's area; switched off it is nothing."""
    for on in (True, False):
        lights = VehicleLights(name="lights", **{field: Constant(on)})
        scene = lights(street(), ASSETS, rng_of())
        seen = luminance(slot(scene, role))

        assert low * 0.99 <= seen <= high * 1.01 if on else seen == 0.0
        assert facts(scene)[label] == ("on" if on else "off")


def test_a_vehicle_without_brake_light_slots_brakes_with_its_tail_lights() -> None:
    """Their luminance rises to that of a stop lamp."""

    class Old(FakeAssets):
        """Cars whose stop lamps are their tail lights."""

        def materials(self, asset_id: str) -> tuple[Material, ...]:
            return tuple(m for m in super().materials(asset_id) if m.role != "brakelight")

    lights = VehicleLights(name="lights", brake_lights=Constant(True), head_lights=Constant(False))
    scene = lights(street(), Old(), rng_of())

    assert luminance(slot(scene, "taillight")) > 5000


def test_at_night_the_nearest_vehicles_light_the_road_before_them() -> None:
    """Two spots per vehicle at its head lights, level at their upper edge, and none by day."""
    lights = VehicleLights(name="lights", dark_head_lights=Constant(True), spots=Constant(2))

    by_day = lights(street(4), ASSETS, rng_of())
    by_night = lights(street(4, dark=True), ASSETS, rng_of())

    assert by_day.lights == ()
    assert [light.name for light in by_night.lights] == [
        f"lights/traffic/{k}/headlight_{side}" for k in (0, 1) for side in ("left", "right")
    ]
    left = by_night.lights[0]
    # The car heads +Y: its left head light is at (-0.7, 2.2, 0.7).
    assert np.allclose(left.position_m, (-0.7, 2.2, 0.7), atol=0.1)
    assert left.direction[1] > 0.9
    down_rad = np.arcsin(-left.direction[2])
    assert down_rad == pytest.approx(0.8 * left.cone_rad, abs=1e-4)
    assert 10_000 <= left.intensity_cd <= 20_000


def test_vehicles_whose_lights_are_off_send_no_beam() -> None:
    """Parked cars stay dark."""
    lights = VehicleLights(name="lights", dark_head_lights=Constant(False))

    assert lights(street(2, dark=True), ASSETS, rng_of()).lights == ()


def test_states_are_drawn_with_their_probabilities() -> None:
    """Binomial tests over 1000 vehicles."""
    lights = VehicleLights(name="lights", indicator=Choice({"off": 9.0, "left": 1.0}))
    scene = lights(street(1000), ASSETS, rng_of("states"))
    told = [facts(scene, k + 1) for k in range(1000)]

    for name, value, share in (
        ("head_lights", "on", 0.3),
        ("brake_lights", "on", 0.2),
        ("indicator", "left", 0.1),
    ):
        assert stats.binomtest(sum(t[name] == value for t in told), 1000, share).pvalue > 1e-4
