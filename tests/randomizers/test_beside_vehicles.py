"""People next to parked vehicles."""

import math

import numpy as np
import pytest

from gen_data.config.distributions import Constant, Uniform
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.members import Member, add_members
from gen_data.core.scene import Lane, ObjectGroup, Scene
from gen_data.core.se3 import SE3
from gen_data.randomizers.beside_vehicles import BesideVehicles
from tests.randomizers.doubles import rng_of

PEOPLE = tuple(f"simple_person?seed={k}" for k in range(4))
CAR = "car?seed=1"
YAW_RAD = 0.4
ROAD_Z_M, KERB_Z_M = 0.2, 0.35


def street(library: AssetLibrary, pavement: bool = True) -> Scene:
    """A car on a parking lane that runs at an angle, a driving lane and a pavement next to it."""
    ahead = np.array([math.cos(YAW_RAD), math.sin(YAW_RAD)])
    left = np.array([-ahead[1], ahead[0]])

    def lane(name: str, kind: str, left_m: float, width_m: float, z_m: float) -> Lane:
        ends = (-20.0 * ahead + left_m * left, 20.0 * ahead + left_m * left)
        center = tuple((float(x), float(y), z_m) for x, y in ends)
        return Lane(name, kind, center, width_m, "main")  # type: ignore[arg-type]

    lanes = [
        lane("drive", "driving", 3.0, 4.0, ROAD_Z_M),
        lane("park", "parking", 0.0, 2.0, ROAD_Z_M),
    ]
    if pavement:
        lanes.append(lane("walk", "sidewalk", -2.5, 3.0, KERB_Z_M))
    parked = ObjectGroup("parked", (), (CAR,), 0, "along", lanes=("parking",))
    people = ObjectGroup("people", (), PEOPLE, 0, "along", lanes=("sidewalk",))
    scene = Scene("test", groups=(parked, people), lanes=tuple(lanes))
    z_m = ROAD_Z_M - library.bounds_m(CAR)[0][2]
    car = Member(CAR, SE3.about_z(YAW_RAD, (0.0, 0.0, z_m)))
    return add_members(scene, parked, [car], library)


def draw(scene: Scene, library: AssetLibrary, **fields: object) -> Scene:
    given = {"name": "outside", "group": "people", "vehicles": ("parked",), "count": Constant(40)}
    return BesideVehicles(**{**given, **fields})(scene, library, rng_of("stream"))  # type: ignore[arg-type]


def test_people_stand_at_doors_and_behind_the_boot_and_look_at_the_car(
    library: AssetLibrary,
) -> None:
    """In the car's frame: outside of its body by the gap and half a person, on all three sides."""
    scene = draw(street(library), library, gap_m=Constant(0.3), turn_deg=Constant(0.0))
    (low, high) = (np.array(corner) for corner in library.body_bounds_m(CAR) or ())
    people = [body for body in scene.bodies if body.group == "people"]
    sides = set()
    for body in people:
        own = SE3.about_z(-YAW_RAD) @ body.T_world_body
        x, y, _ = own.translation_m
        ahead = own.rotation()[:2, 0]
        if x < low[0]:
            sides.add("behind")
            assert x == pytest.approx(low[0] - 0.55, abs=1e-5)
            assert low[1] < y < high[1]
            np.testing.assert_allclose(ahead, (1.0, 0.0), atol=1e-5)
        else:
            side = "left" if y > 0.0 else "right"
            sides.add(side)
            assert y == pytest.approx(
                {"left": high[1] + 0.55, "right": low[1] - 0.55}[side], abs=1e-5
            )
            assert low[0] < x < high[0]
            np.testing.assert_allclose(ahead, (0.0, -math.copysign(1.0, y)), atol=1e-5)
    assert sides == {"behind", "left", "right"}


def test_feet_are_on_the_road_or_on_the_pavement(library: AssetLibrary) -> None:
    """By the lane below; off all lanes, nobody is added."""
    scene = draw(street(library), library)
    for body in scene.bodies[1:]:
        x, y, z = body.T_world_body.translation_m
        right_m = math.sin(YAW_RAD) * x - math.cos(YAW_RAD) * y
        ground_m = KERB_Z_M if right_m > 1.0 else ROAD_Z_M
        assert z + library.bounds_m(body.asset)[0][2] == pytest.approx(ground_m, abs=1e-5)
    alone = draw(street(library, pavement=False), library, gap_m=Uniform(0.3, 0.6))
    places = np.array([body.T_world_body.translation_m for body in alone.bodies[1:]])
    assert (math.sin(YAW_RAD) * places[:, 0] - math.cos(YAW_RAD) * places[:, 1] < 1.0).all()


def test_a_group_of_vehicles_that_the_template_lacks_is_refused(library: AssetLibrary) -> None:
    """Nobody would stand anywhere, silently."""
    made = BesideVehicles(name="outside", group="people", vehicles=("parked", "parkd"))
    with pytest.raises(ConfigError, match=r"^randomizers\.outside\.vehicles: .*'parkd'.*parked"):
        made.check(street(library), library)


def test_places_are_taken_once(library: AssetLibrary) -> None:
    """Of forty at one car few find a place; without vehicles nobody is added."""
    scene = draw(street(library), library, gap_m=Constant(0.3))
    people = [body for body in scene.bodies if body.group == "people"]
    assert 3 <= len(people) <= 8
    assert len({body.name for body in scene.bodies}) == len(scene.bodies)
    places = np.array([body.T_world_body.translation_m[:2] for body in people])
    away = np.linalg.norm(places[:, None] - places, axis=2) + 9.0 * np.eye(len(places))
    assert away.min() > 0.3
    empty = draw(street(library), library, vehicles=("traffic",))
    assert empty == street(library)
