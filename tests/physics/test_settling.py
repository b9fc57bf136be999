"""Places where objects come to rest."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.core.scene import Body, ObjectGroup, Scene, SupportSurface
from gen_data.core.se3 import SE3
from gen_data.physics import PhysicsConfig
from gen_data.physics.engine import Engine
from gen_data.physics.physics_config import EngineName
from tests.physics.doubles import (
    HOUSEHOLD,
    TABLE_TOP_Z_M,
    Solids,
    accepted,
    dropped_clutter,
    refusal,
    table_scene,
    thing,
    world_vertices,
)

HALF_A_MM = 0.0005


def lowest_m(body: Body) -> float:
    """World height of a body's lowest vertex [m]."""
    return float(world_vertices(body)[:, 2].min())


def tilt_rad(body: Body) -> float:
    """Angle between the body's Z axis and the vertical."""
    return math.acos(min(1.0, float(body.T_world_body.rotation()[2, 2])))


def test_a_dropped_box_rests_at_half_its_height_above_the_table(engine: Engine) -> None:
    """A cube of 10 cm: its centre is 5 cm above the top, within half a millimetre."""
    scene = accepted(engine, table_scene(thing("cube", "box 0.1 0.1 0.1", x=0.2)))

    x, y, z = scene.body("cube").T_world_body.translation_m
    assert z == pytest.approx(TABLE_TOP_Z_M + 0.05, abs=HALF_A_MM)
    assert (x, y) == pytest.approx((0.2, 0.0), abs=0.001)


@pytest.mark.parametrize("asset", HOUSEHOLD)
@pytest.mark.parametrize("scale", [0.7, 1.5])
def test_nothing_floats_above_or_sinks_into_its_support(
    engine: Engine, asset: str, scale: float
) -> None:
    """The lowest vertex of whatever came to rest alone is at the table's height."""
    scene = accepted(engine, table_scene(thing("it", asset, scale=scale)))

    assert lowest_m(scene.body("it")) == pytest.approx(TABLE_TOP_Z_M, abs=HALF_A_MM)


def test_what_rests_on_an_edge_before_tipping_over_lies_flat_afterwards(engine: Engine) -> None:
    """A book that starts at 40 degrees ends on its cover; no damping holds it up."""
    book = thing("book", "box 0.15 0.22 0.025", turn_deg=40)

    assert tilt_rad(accepted(engine, table_scene(book)).body("book")) < math.radians(0.5)


def test_a_cone_on_its_tip_falls_over(engine: Engine) -> None:
    """The centre of mass is a quarter of the height from the base, and the tip no support."""
    scene = accepted(engine, table_scene(thing("cone", "cone 0.04 0.12", turn_deg=176)))

    assert math.radians(45) < tilt_rad(scene.body("cone")) < math.radians(135)


def test_a_stack_of_three_boxes_stays_a_stack(engine: Engine) -> None:
    """Centres one above another at half, one and a half and two and a half edges."""
    boxes = [thing(f"b{k}", "box 0.08 0.08 0.08", above_m=0.041 + 0.082 * k) for k in range(3)]

    scene = accepted(engine, table_scene(*boxes, placement="stack"))

    for k in range(3):
        expected = (0.0, 0.0, TABLE_TOP_Z_M + 0.04 + 0.08 * k)
        body = scene.body(f"b{k}")
        assert body.T_world_body.translation_m == pytest.approx(expected, abs=0.001)
        assert tilt_rad(body) < math.radians(0.5)


def test_nothing_leans_on_a_wall_that_is_not_there(engine: Engine) -> None:
    """A board that would lean on a guard wall is dropped again farther in, and lies flat."""
    board = thing("board", "box 0.02 0.12 0.30", x=0.54, above_m=0.17, turn_deg=16, axis=1)

    scene = accepted(engine, table_scene(board))

    assert tilt_rad(scene.body("board")) == pytest.approx(math.pi / 2, abs=math.radians(0.5))
    assert lowest_m(scene.body("board")) == pytest.approx(TABLE_TOP_Z_M, abs=HALF_A_MM)


def test_a_body_dropped_beside_the_table_is_refused_as_fallen_off(engine: Engine) -> None:
    """The floor catches it, but its group belongs on the table."""
    found = refusal(engine, table_scene(thing("cup", "mug 0.04 0.1", x=0.9)))

    assert found.reason == "object fell off"
    assert "things" in found.remedy
    assert "count" in found.remedy


def ball_on_a_slope() -> Scene:
    slope = thing("slope", "box 0.2 0.2 0.01", x=0.45, above_m=0.06, turn_deg=30, axis=1)
    scene = table_scene(thing("ball", "ball 0.035", x=0.45, above_m=0.2))
    return replace(scene, bodies=(*scene.bodies, slope))


def test_guard_walls_stop_what_would_roll_off(engine: Engine) -> None:
    """The ball comes to rest on the table at the wall, and stays when the wall is gone."""
    scene = accepted(engine, ball_on_a_slope())

    assert 0.5 < scene.body("ball").T_world_body.translation_m[0] < 0.6
    # The ball has faces, on which its centre is lower than its radius.
    assert lowest_m(scene.body("ball")) == pytest.approx(TABLE_TOP_Z_M, abs=HALF_A_MM)


def test_without_guard_walls_what_rolls_off_is_refused(engine_name: EngineName) -> None:
    """The ball leaves the table; the remedy is named."""
    with Engine(Solids(), PhysicsConfig(engine=engine_name, guard_walls=False)) as engine:
        found = refusal(engine, ball_on_a_slope())

    assert found.reason == "object fell off"
    assert "physics.guard_walls" in found.remedy


def test_too_many_objects_for_a_bin_are_refused(engine: Engine) -> None:
    """Sixteen cubes of 8 cm cannot be in a bin of 12 cm, nor stand on one another off centre."""
    cubes = [
        Body(f"c{k}", "box 0.08 0.08 0.08", SE3((0.05 * (k % 2), 0, 0.2 + 0.1 * k)), mass_kg=0.2)
        for k in range(16)
    ]

    found = refusal(engine, bin_scene((0.14, 0.14, 0.1), cubes))

    assert found.reason in {"object fell off", "objects interpenetrate"}


def test_a_few_objects_in_a_bin_stay_inside(engine: Engine) -> None:
    """Six balls in a bin of 30 cm lie within its walls, on its floor or on each other."""
    balls = [
        Body(f"c{k}", "ball 0.03", SE3((0.05 * (k % 3) - 0.05, 0, 0.3 + 0.1 * k)), mass_kg=0.2)
        for k in range(6)
    ]

    scene = accepted(engine, bin_scene((0.3, 0.2, 0.12), balls))

    for k in range(6):
        x, y, z = scene.body(f"c{k}").T_world_body.translation_m
        assert abs(x) < 0.15
        assert abs(y) < 0.10
        assert z > 0.01 + 0.03 - 0.001


def bin_scene(size_m: tuple[float, float, float], bodies: list[Body]) -> Scene:
    x, y, z = size_m
    surface = SupportSurface(
        "bin", "bin", SE3((0, 0, 0.01)), (x - 0.02, y - 0.02), 3.0, walled=True
    )
    furniture = (
        Body("floor", "box 6 6 0.1", SE3((0, 0, -0.05))),
        Body("bin", f"bin {x} {y} {z}", SE3((0, 0, z / 2))),
    )
    things = tuple(replace(body, group="fill", motion="dynamic") for body in bodies)
    group = ObjectGroup("fill", ("bin",), (), len(bodies), "drop")
    return Scene("bin", furniture + things, surfaces=(surface,), groups=(group,))


def test_bodies_that_start_inside_one_another_are_put_apart(engine: Engine) -> None:
    """Two cubes at the same place come to rest without overlap."""
    one = thing("one", "box 0.06 0.06 0.06", above_m=0.03)
    scene = accepted(engine, table_scene(one, replace(one, name="two")))

    a, b = (np.array(scene.body(n).T_world_body.translation_m) for n in ("one", "two"))
    assert np.abs(a - b).max() > 0.06 - 0.001


def test_bodies_that_cannot_be_parted_are_refused(engine: Engine) -> None:
    """A ball as wide as the closed box around it has nowhere to go."""
    walls = [
        Body("lid", "box 0.3 0.3 0.05", SE3((0, 0, TABLE_TOP_Z_M + 0.08))),
        Body("west", "box 0.05 0.3 0.3", SE3((-0.055, 0, TABLE_TOP_Z_M))),
        Body("east", "box 0.05 0.3 0.3", SE3((0.055, 0, TABLE_TOP_Z_M))),
        Body("north", "box 0.3 0.05 0.3", SE3((0, 0.055, TABLE_TOP_Z_M))),
        Body("south", "box 0.3 0.05 0.3", SE3((0, -0.055, TABLE_TOP_Z_M))),
    ]
    scene = table_scene(thing("ball", "ball 0.035", above_m=0.03))
    outcome = engine.settle(replace(scene, bodies=(*walls, *scene.bodies)))

    assert outcome.rejection is not None
    assert outcome.rejection.reason in {"objects interpenetrate", "still moving after 4.0 s"}
    assert outcome.scene.body("ball") == scene.body("ball")


def test_what_still_moves_when_time_is_up_is_refused(engine_name: EngineName) -> None:
    """A twentieth of a second is too short for a fall; the remedy names the time."""
    with Engine(Solids(), PhysicsConfig(engine=engine_name, settle_time_s_max=0.05)) as engine:
        found = refusal(engine, table_scene(thing("cup", "mug 0.04 0.1", above_m=0.4)))

    assert found.reason == "still moving after 0.05 s"
    assert "physics.settle_time_s_max" in found.remedy


def test_objects_on_neighbouring_tables_do_not_meet_each_others_walls(engine: Engine) -> None:
    """The wall of one table stands on the other, but is there for its own objects only."""
    scene = table_scene(thing("near", "box 0.05 0.05 0.05", x=-0.2))
    other = SupportSurface("annex", "annex", SE3((0.9, 0, TABLE_TOP_Z_M)), (0.6, 0.8), 2.0)
    group = ObjectGroup("more", ("annex",), (), 1, "drop")
    far = Body("far", "box 0.05 0.05 0.05", SE3((0.63, 0, 0.9)), group="more", motion="dynamic")
    scene = replace(
        scene,
        bodies=(
            *scene.bodies,
            Body("annex", "box 0.6 0.8 0.04", SE3((0.9, 0, TABLE_TOP_Z_M - 0.02))),
            far,
        ),
        surfaces=(*scene.surfaces, other),
        groups=(*scene.groups, group),
    )

    x, y, z = accepted(engine, scene).body("far").T_world_body.translation_m

    assert (x, y) == pytest.approx((0.63, 0.0), abs=0.001)
    assert z == pytest.approx(TABLE_TOP_Z_M + 0.025, abs=HALF_A_MM)


def test_a_crowd_at_one_place_is_spread_out(engine: Engine) -> None:
    """Four cans that start inside one another are lifted free before they fall."""
    scene = accepted(
        engine, table_scene(*[thing(f"can{k}", "cylinder 0.033 0.12", 0.01 * k) for k in range(4)])
    )

    centers = [np.array(scene.body(f"can{k}").T_world_body.translation_m) for k in range(4)]
    for k, one in enumerate(centers):
        for other in centers[k + 1 :]:
            assert np.linalg.norm(one - other) > 2 * 0.033 - 0.001


def test_a_scene_in_which_nothing_can_move_costs_nothing(engine: Engine) -> None:
    """A street of parked cars comes back as it is; not one hull is asked for."""
    scene = Scene("street", (Body("car", "no such asset"),))

    outcome = engine.settle(scene)

    assert outcome.rejection is None
    assert outcome.scene is scene


def test_only_dynamic_bodies_move(engine: Engine) -> None:
    """Furniture and bodies that physics does not see keep their exact poses."""
    ghost = Body("ghost", "box 0.1 0.1 0.1", SE3((0.1234567891, 0, 2)), collides=False)
    scene = table_scene(thing("cube", "box 0.1 0.1 0.1"))
    scene = replace(scene, bodies=(*scene.bodies, ghost))

    after = accepted(engine, scene)

    assert [body.name for body in after.bodies] == [body.name for body in scene.bodies]
    for name in ("floor", "table", "ghost"):
        assert after.body(name) == scene.body(name)


def test_poses_leave_physics_on_the_decimal_grid(engine: Engine) -> None:
    """Rounding again changes nothing."""
    scene = accepted(engine, dropped_clutter(3, count=4))

    for body in scene.bodies:
        if body.motion == "dynamic":
            assert body.T_world_body.rounded() == body.T_world_body


def test_clutter_on_a_table_is_accepted_nearly_always(engine: Engine) -> None:
    """Ten household objects in any orientation, each dropped from above the one before."""
    outcomes = [engine.settle(dropped_clutter(seed)) for seed in range(20)]

    assert sum(outcome.rejection is None for outcome in outcomes) >= 18
    for outcome in outcomes:
        for body in outcome.scene.bodies if outcome.rejection is None else ():
            if body.motion == "dynamic":
                assert lowest_m(body) > TABLE_TOP_Z_M - 0.001
