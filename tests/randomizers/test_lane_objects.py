"""Things along lanes, and cameras that ride there."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gen_data.config.distributions import Constant, Probability, Uniform
from gen_data.core.errors import ConfigError, LayoutRejected
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Body, Camera, Lane, ObjectGroup, Rig, Scene
from gen_data.core.se3 import SE3, look_at
from gen_data.randomizers.camera_on_lane import CameraOnLane
from gen_data.randomizers.free_space import Footprint, Ground, hidden_share
from gen_data.randomizers.lane_objects import LaneObjects
from tests.randomizers.doubles import FakeAssets, rng_of


def street(**group: Any) -> Scene:
    there = Lane("a", "driving", ((0.0, -1.5, 0.0), (40.0, -1.5, 0.0)), 3.0, road="street")
    back = Lane("b", "driving", ((40.0, 1.5, 0.0), (0.0, 1.5, 0.0)), 3.0, road="street")
    things = ObjectGroup("things", (), ("brick",), 0, "along", lanes=("driving",), **group)
    camera = Camera("color", SE3(), Intrinsics.from_hfov(64, 48, 1.0))
    return Scene("test", groups=(things,), lanes=(there, back), cameras=(camera,))


def drawn(scene: Scene, stream: str = "stream", **fields: Any) -> Scene:
    return LaneObjects(name="things", **fields)(scene, FakeAssets(), rng_of(stream))


def test_rows_have_the_gaps_that_were_asked_for() -> None:
    """Bricks of 6 cm with 1.94 m between them: one every 2 m on both lanes."""
    scene = drawn(street(), gap_m=Constant(1.94))

    for y, sign in ((-1.5, 1), (1.5, -1)):
        row = sorted(
            b.T_world_body.translation_m[0] * sign
            for b in scene.bodies
            if b.T_world_body.translation_m[1] == pytest.approx(y)
        )
        assert len(row) in (19, 20)
        assert np.diff(row) == pytest.approx(2.0, abs=1e-5)


def test_things_face_the_way_of_their_lane_or_its_left() -> None:
    """X of the body in the world."""
    for facing, turn in (("along", 0.0), ("left", 90.0)):
        scene = drawn(street(facing=facing))
        for body in scene.bodies:
            lane_deg = 0.0 if body.T_world_body.translation_m[1] < 0 else 180.0
            ahead = body.T_world_body.rotation()[:, 0]
            yaw = math.degrees(math.atan2(ahead[1], ahead[0]))
            assert (yaw - lane_deg - turn + 180.0) % 360.0 == pytest.approx(180.0, abs=1e-3)


def test_share_of_used_places_is_that_of_the_distribution() -> None:
    """400 places at 30 %: within four standard errors."""
    full = drawn(street(), gap_m=Constant(0.14), min_clearance_m=0.1)
    some = drawn(street(), gap_m=Constant(0.14), min_clearance_m=0.1, occupancy=Probability(0.3))
    n = len(full.bodies)

    assert n == pytest.approx(400, abs=4)
    assert abs(len(some.bodies) - 0.3 * n) < 4 * (n * 0.3 * 0.7) ** 0.5


def test_count_is_a_choice_of_all_places_and_ids_are_unique() -> None:
    scene = drawn(street(), gap_m=Constant(1.94), count=Constant(10))
    ids = [i.instance_id for i in scene.instances]

    assert len(scene.bodies) == len(set(ids)) == 10
    assert {b.instance_id for b in scene.bodies} == set(ids)


@pytest.mark.parametrize("scattered", [False, True])
def test_nothing_overlaps_even_when_lanes_are_walked_often(scattered: bool) -> None:
    """Every pair of rectangles is separated along one of their axes."""
    scene = drawn(
        street(),
        gap_m=Uniform(0.0, 0.1),
        passes=4,
        lateral=Uniform(-1.0, 1.0),
        yaw_deg=Uniform(-180.0, 180.0),
        count=Constant(120),
        uniform_area=scattered,
    )
    prints = [Footprint.of(b.T_world_body, FakeAssets().bounds_m(b.asset)) for b in scene.bodies]

    assert len(prints) == 120
    for k, one in enumerate(prints):
        ground = Ground()
        ground.add(one)
        assert all(ground.is_free(other) for other in prints[k + 1 :])


def test_too_many_scattered_things_are_refused_by_name() -> None:
    """A square of 10 cm has room for few bricks."""
    lane = Lane("a", "driving", ((0.0, 0.0, 0.0), (0.1, 0.1, 0.0)), 0.1)
    with pytest.raises(LayoutRejected, match="no free place for a scattered object"):
        drawn(replace(street(), lanes=(lane,)), count=Constant(500), uniform_area=True)


def test_an_impossible_density_is_refused_by_name() -> None:
    """Two lanes of 40 m have room for 40 bricks every 2 m, not for 400."""
    assert len(drawn(street(), gap_m=Constant(1.94), min_count=38).bodies) >= 38
    with pytest.raises(LayoutRejected, match="too few free places"):
        drawn(street(), gap_m=Constant(1.94), min_count=400)


def test_a_row_of_more_things_than_a_lane_can_hold_is_refused_by_name() -> None:
    """Bricks of 60 micrometres: 666,667 of them fill a lane of 40 m."""
    with pytest.raises(ConfigError, match=r"randomizers\.things\.gap_m: .*larger gap_m or scale"):
        drawn(street(), gap_m=Constant(0.0), scale=Constant(0.001), occupancy=Constant(False))


def test_the_camera_rides_where_nothing_stands() -> None:
    """A brick on every metre but for 10 m: the camera is in that gap, 1.65 m up, looking along."""
    bodies = tuple(
        Body(f"things/{k}", "brick", SE3((float(k), y, 0.02)), instance_id=1, group="things")
        for k in range(41)
        for y in (-1.5, 1.5)
        if not (15 < k < 25 and y < 0)
    )
    scene = replace(street(), bodies=bodies)
    level = {"pitch_deg": Constant(0.0), "yaw_deg": Constant(0.0), "roll_deg": Constant(0.0)}
    for k in range(10):
        rider = CameraOnLane(name="dash", ahead_m=15.0, **level)
        camera = rider(scene, FakeAssets(), rng_of(f"{k}")).camera("color")
        x, y, z = camera.T_world_camera.translation_m
        assert (y, z) == pytest.approx((-1.5, 1.65))
        assert 15.0 < x < 25.0
        assert camera.T_world_camera.rotation()[:, 2] == pytest.approx((1.0, 0.0, 0.0), abs=1e-5)


def test_cameras_may_be_in_the_middle_of_a_turn() -> None:
    """Three lanes of 40 m leave the end of a road of 40 m: half of the views are on one of them."""
    road = Lane("in", "driving", ((0.0, 0.0, 0.0), (40.0, 0.0, 0.0)), 3.0)
    ways = [
        Lane(f"out{k}", "driving", ((40.0, 0.0, 0.0), (72.0, y, 0.0)), 3.0, junction=True)
        for k, y in enumerate((-24.0, 24.0))
    ] + [Lane("on", "driving", ((40.0, 0.0, 0.0), (80.0, 0.0, 0.0)), 3.0, junction=True)]
    scene = replace(street(), lanes=(road, *ways))
    for junctions, low, high in ((False, 0, 0), (True, 60, 140)):
        rider = CameraOnLane(name="dash", ahead_m=0.0, junctions=junctions, lateral=Constant(0.0))
        views = [rider(scene, FakeAssets(), rng_of(f"{k}")).camera("color") for k in range(200)]
        beyond = sum(view.T_world_camera.translation_m[0] > 40.0 for view in views)
        assert low <= beyond <= high


def test_a_camera_is_as_far_before_a_member_of_the_group_as_drawn() -> None:
    """One brick on the verge: the cameras of both lanes have it 12 m ahead, to their side."""
    brick = Body("things/0", "brick", SE3((20.0, -4.0, 0.0)), instance_id=1, group="things")
    scene = replace(street(), bodies=(brick,))
    rider = CameraOnLane(
        name="dash", towards="things", towards_m=Constant(12.0), yaw_deg=Constant(0.0)
    )
    seen = set()
    for k in range(12):
        view = rider(scene, FakeAssets(), rng_of(f"{k}"))
        seen.add(tuple(np.round(view.camera("color").T_world_camera.translation_m, 3).tolist()))

    assert seen == {(8.0, -1.5, 1.65), (32.0, 1.5, 1.65)}


def test_views_towards_a_group_are_as_frequent_as_drawn() -> None:
    """A brick 12 m ahead in 30 % of 400 views, give or take four standard errors."""
    brick = Body("things/0", "brick", SE3((20.0, -4.0, 0.0)), instance_id=1, group="things")
    scene = replace(street(), bodies=(brick,))
    fields: dict[str, Any] = {"towards": "things", "towards_m": Constant(12.0), "ahead_m": 1.0}
    rider = CameraOnLane(name="dash", sought=Probability(0.3), **fields)
    views = (rider(scene, FakeAssets(), rng_of(f"{k}")) for k in range(400))
    xs = np.array([view.camera("color").T_world_camera.translation_m[0] for view in views])
    aimed = np.isclose(xs, 8.0) | np.isclose(xs, 32.0)

    assert abs(aimed.sum() - 0.3 * 400) < 4 * (400 * 0.3 * 0.7) ** 0.5


def test_a_camera_is_anywhere_where_no_member_has_a_place_before_it() -> None:
    """The only brick stands beside the start of a lane of 40 m, and no camera is 60 m before it."""
    brick = Body("things/0", "brick", SE3((1.0, -4.0, 0.0)), instance_id=1, group="things")
    scene = replace(street(), bodies=(brick,))
    rider = CameraOnLane(name="dash", towards="things", towards_m=Constant(60.0))

    assert rider(scene, FakeAssets(), rng_of()).camera("color").T_world_camera != SE3()


def test_an_unknown_group_to_look_at_is_refused_by_name() -> None:
    rider = CameraOnLane(name="dash", towards="peple")
    with pytest.raises(ConfigError, match=r"randomizers\.dash\.towards: .*'peple'.*things"):
        rider.check(street(), FakeAssets())


def test_objects_become_fewer_by_a_factor_e_over_the_distance_that_fades() -> None:
    """Bricks every 0.2 m: the expected number is the sum of exp(-distance / 8 m)."""
    ego = Body("ego", "ball", SE3((0.0, -1.5, 0.0)))
    scene = replace(street(), bodies=(ego,), rigs=(Rig("ego", "ego"),))
    full, faded = (
        [b for b in drawn(scene, gap_m=Constant(0.14), min_clearance_m=0.1, fade_m=fade_m).bodies
         if b.group == "things"]
        for fade_m in (None, 8.0)
    )  # fmt: skip
    p = np.exp([-math.dist(b.T_world_body.translation_m[:2], (0.0, -1.5)) / 8.0 for b in full])

    assert len(full) > 380
    assert abs(len(faded) - p.sum()) < 4 * (p * (1.0 - p)).sum() ** 0.5


def test_fading_needs_an_ego_vehicle() -> None:
    with pytest.raises(ConfigError, match=r"randomizers\.things\.fade_m: .*no ego vehicle"):
        drawn(street(), fade_m=10.0)


def test_hidden_shares_are_those_of_boxes_seen_in_perspective() -> None:
    """A board 2 m ahead that fills the left half, the whole image or nothing of it."""
    camera = Camera(
        "color", look_at((0.0, 0.0, 1.0), (1.0, 0.0, 1.0)), Intrinsics.from_hfov(64, 48, 1.0)
    )

    def share(y_m: float, near_m: float = 4.0, ahead_m: float = 12.0) -> float:
        # A box of 20 m a side: its near face is 10 m before its middle.
        board = Body("board", "ball", SE3((ahead_m, y_m, 1.0)), scale=100.0, instance_id=1)
        return hidden_share(camera, Scene("test", bodies=(board,)), FakeAssets(), near_m)

    assert (share(10.0), share(-10.0), share(0.0), share(0.0, near_m=1.9)) == (0.5, 0.5, 1.0, 0.0)
    assert (share(0.0, ahead_m=-12.0), share(0.0, ahead_m=0.0)) == (0.0, 1.0)


def test_a_camera_on_a_pole_does_not_look_out_of_a_tree() -> None:
    """Crowns of 4 m, with gaps of 4 m, along a part of a lane: not in a gap before a crown."""
    crowns = tuple(
        Body(f"trees/{k}", "ball", SE3((8.0 * k, -1.5, 4.0)), 20.0, instance_id=k + 1)
        for k in range(4)
    )
    scene = replace(street(), bodies=crowns)
    fields = {"lanes": ("driving",), "ahead_m": 5.0, "free_m": (0.1, 0.1)}
    high = {"height_m": Constant(4.0), "pitch_deg": Constant(0.0), "yaw_deg": Constant(0.0)}
    shares = []
    for near_m in (0.0, 3.0):
        pole = CameraOnLane(name="pole", near_m=near_m, **fields, **high)
        views = [pole(scene, FakeAssets(), rng_of(f"{k}")) for k in range(30)]
        shares.append(max(hidden_share(v.camera("color"), v, FakeAssets(), 3.0) for v in views))
    assert shares[0] > 0.5
    assert shares[1] <= 0.1


def test_a_street_without_such_a_lane_is_one_clear_error() -> None:
    with pytest.raises(ConfigError, match="no lane of kind sidewalk; there is driving"):
        CameraOnLane(name="walk", lanes=("sidewalk",))(street(), FakeAssets(), rng_of())


sizes = st.floats(0.1, 3.0)


@given(
    x=st.floats(-4, 4),
    y=st.floats(-4, 4),
    yaw=st.floats(0, 6.3),
    a=sizes,
    b=sizes,
    c=sizes,
    d=sizes,
)
def test_overlap_agrees_with_points_inside_both(
    x: float, y: float, yaw: float, a: float, b: float, c: float, d: float
) -> None:
    """Where a grid of points of one rectangle meets the other, they overlap."""
    ground = Ground()
    ground.add(Footprint(0.0, 0.0, a, b, 0.0))
    other = Footprint(x, y, c, d, yaw)
    u, v = np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 41))
    px = x + c * u * math.cos(yaw) - d * v * math.sin(yaw)
    py = y + c * u * math.sin(yaw) + d * v * math.cos(yaw)
    if ((np.abs(px) < a) & (np.abs(py) < b)).any():
        assert not ground.is_free(other)
    reach = math.hypot(a, b) + math.hypot(c, d)
    if math.hypot(x, y) > reach:
        assert ground.is_free(other)


def test_runs_repeat_an_asset_without_gaps() -> None:
    """Bricks of 6 cm in runs of at least 1 m, 5 m apart."""
    scene = drawn(street(), run_m=Constant(1.0), gap_m=Constant(5.0), min_clearance_m=0.0)
    row = sorted(
        b.T_world_body.translation_m[0]
        for b in scene.bodies
        if b.T_world_body.translation_m[1] == pytest.approx(-1.5)
    )
    steps = np.diff(row)

    assert set(np.round(steps, 3)) == {0.07, 5.06}
    assert 6 <= (steps > 1.0).sum() <= 7
    # 15 bricks with 14 joints of 1 cm reach 1.04 m.
    assert np.diff(np.flatnonzero(steps > 1.0)).tolist() == [15] * ((steps > 1.0).sum() - 1)


def test_occupancy_is_drawn_once_per_run() -> None:
    """Half of the runs are missing as a whole."""
    scene = drawn(
        street(),
        run_m=Constant(1.0),
        gap_m=Constant(0.5),
        occupancy=Probability(0.5),
        min_clearance_m=0.0,
    )
    for y in (-1.5, 1.5):
        row = sorted(
            b.T_world_body.translation_m[0]
            for b in scene.bodies
            if b.T_world_body.translation_m[1] == pytest.approx(y)
        )
        ends = [0, *(np.flatnonzero(np.diff(row) > 0.1) + 1).tolist(), len(row)]
        lengths = np.diff(ends)
        assert 5 < len(lengths) < 25
        assert set(lengths[1:-1]) == {15}


def test_second_rows_stand_behind_their_lane_on_lower_land() -> None:
    """To the right of the lane, sunk by the fall of the land: 0.25 m from 6 m on."""
    for behind_m, fall_m in ((3.0, 0.125), (20.0, 0.25)):
        near = drawn(street())
        far = drawn(street(), behind_m=Constant(behind_m))
        a, b = near.bodies[0], far.bodies[0]
        local = a.T_world_body.inverse().apply(np.array([b.T_world_body.translation_m]))[0]

        assert local == pytest.approx([0.0, -behind_m, -fall_m], abs=1e-5)
