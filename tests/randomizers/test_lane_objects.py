"""Objects along lanes, and cameras that ride there."""

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


def row_of(scene: Scene, y_m: float) -> np.ndarray:
    """Places along X of the bodies at that Y, sorted [m]."""
    places = [body.T_world_body.translation_m for body in scene.bodies]
    return np.sort([x for x, y, _ in places if y == pytest.approx(y_m)])


def with_brick(x_m: float) -> Scene:
    """A member of the group on the verge of the street."""
    brick = Body("things/0", "brick", SE3((x_m, -4.0, 0.0)), instance_id=1, group="things")
    return replace(street(), bodies=(brick,))


def ridden(scene: Scene, stream: str = "stream", **fields: Any) -> SE3:
    """Pose of a camera that rides along a lane."""
    rider = CameraOnLane(name="dash", **fields)
    return rider(scene, FakeAssets(), rng_of(stream)).camera("color").T_world_camera


@pytest.mark.parametrize("y_m", [-1.5, 1.5])
def test_rows_have_the_gaps_that_were_asked_for(y_m: float) -> None:
    """Bricks of 6 cm with 1.94 m between them: one every 2 m on both lanes."""
    row = row_of(drawn(street(), gap_m=Constant(1.94)), y_m)

    assert len(row) in (19, 20)
    assert np.diff(row) == pytest.approx(2.0, abs=1e-5)


def test_lanes_that_taper_have_things_where_they_are_wide_enough() -> None:
    """Bricks are 3 cm wide: the lane of 40 m, which widens to 12 cm, is as wide at 10 m."""
    taper = replace(street().lanes[0], width_m=0.06, widths_m=(0.0, 0.12))
    row = row_of(drawn(replace(street(), lanes=(taper,)), gap_m=Constant(0.44)), -1.5)

    assert 10.0 <= row[0] < 10.5
    assert row[-1] > 39.0
    assert np.diff(row) == pytest.approx(0.5, abs=1e-5)


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


TINY = Lane("a", "driving", ((0.0, 0.0, 0.0), (0.1, 0.1, 0.0)), 0.1)


@pytest.mark.parametrize(("make", "error", "message"), [
    (lambda: drawn(replace(street(), lanes=(TINY,)), count=Constant(500), uniform_area=True),
     LayoutRejected, "no free place for a scattered object"),
    # Two lanes of 40 m have room for 40 bricks every 2 m.
    (lambda: drawn(street(), gap_m=Constant(1.94), min_count=400),
     LayoutRejected, "too few free places"),
    # 666,667 bricks of 60 micrometres fill a lane of 40 m.
    (lambda: drawn(street(), gap_m=Constant(0.0), scale=Constant(0.001), occupancy=Constant(False)),
     ConfigError, r"randomizers\.things\.gap_m: .*larger gap_m or scale"),
    (lambda: drawn(street(), fade_m=10.0),
     ConfigError, r"randomizers\.things\.fade_m: .*no ego vehicle"),
    (lambda: CameraOnLane(name="dash", towards="peple").check(street(), FakeAssets()),
     ConfigError, r"randomizers\.dash\.towards: .*'peple'.*things"),
    (lambda: ridden(street(), lanes=("sidewalk",)),
     ConfigError, "no lane of kind sidewalk; there is driving"),
], ids=["too many scattered objects", "an impossible density", "more than a lane can hold",
        "fading without an ego vehicle", "an unknown group", "no such lane"])  # fmt: skip
def test_what_cannot_be_drawn_is_refused_by_name(make: Any, error: Any, message: str) -> None:
    with pytest.raises(error, match=message):
        make()


def test_the_smallest_count_may_be_reached() -> None:
    assert len(drawn(street(), gap_m=Constant(1.94), min_count=38).bodies) >= 38


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
        pose = ridden(scene, f"{k}", ahead_m=15.0, **level)
        x, y, z = pose.translation_m
        assert (y, z) == pytest.approx((-1.5, 1.65))
        assert 15.0 < x < 25.0
        assert pose.rotation()[:, 2] == pytest.approx((1.0, 0.0, 0.0), abs=1e-5)


TOWARDS = {"towards": "things", "towards_m": Constant(12.0)}


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
    aimed = {"yaw_deg": Constant(0.0), **TOWARDS}
    poses = (ridden(with_brick(20.0), f"{k}", **aimed) for k in range(12))
    seen = {tuple(np.round(pose.translation_m, 3).tolist()) for pose in poses}

    assert seen == {(8.0, -1.5, 1.65), (32.0, 1.5, 1.65)}


def test_views_towards_a_group_are_as_frequent_as_drawn() -> None:
    """A brick 12 m ahead in 30 % of 400 views, give or take four standard errors."""
    fields = {"ahead_m": 1.0, "sought": Probability(0.3), **TOWARDS}
    xs = [ridden(with_brick(20.0), f"{k}", **fields).translation_m[0] for k in range(400)]
    aimed = np.isclose(xs, 8.0) | np.isclose(xs, 32.0)

    assert abs(aimed.sum() - 0.3 * 400) < 4 * (400 * 0.3 * 0.7) ** 0.5


def test_a_camera_is_anywhere_where_no_member_has_a_place_before_it() -> None:
    """The only brick stands at the start of a lane of 40 m, and no camera is 60 m before it."""
    assert ridden(with_brick(1.0), towards="things", towards_m=Constant(60.0)) != SE3()


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


sizes = st.floats(0.1, 3.0)


@given(
    x=st.floats(-4, 4), y=st.floats(-4, 4), yaw=st.floats(0, 6.3), a=sizes, b=sizes, c=sizes,
    d=sizes,
)  # fmt: skip
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
    steps = np.diff(row_of(scene, -1.5))

    assert set(np.round(steps, 3)) == {0.07, 5.06}
    assert 6 <= (steps > 1.0).sum() <= 7
    # 15 bricks with 14 joints of 1 cm reach 1.04 m.
    assert np.diff(np.flatnonzero(steps > 1.0)).tolist() == [15] * ((steps > 1.0).sum() - 1)


def test_pieces_of_a_run_overlap_on_the_inside_of_a_bend_but_not_other_runs() -> None:
    """Bricks on an arc of 1 m: each 6 cm of lane turns by 4 degrees, and no piece is missing."""
    turns = np.linspace(0.0, 1.5, 60)
    arc = tuple((float(math.sin(t)), float(1.0 - math.cos(t)), 0.0) for t in turns)
    bent = replace(street(), lanes=(Lane("a", "driving", arc, 3.0, road="street"),))
    half = Constant(0.5)
    joined = drawn(bent, run_m=half, gap_m=half, min_clearance_m=0.0)
    steps = np.linalg.norm(
        np.diff([b.T_world_body.translation_m for b in joined.bodies], axis=0), axis=1
    )

    assert (steps < 0.075).sum() > 5
    assert set(np.round(steps[steps > 0.1], 1)) <= {0.5, 0.6}
    apart = drawn(bent, run_m=half, gap_m=half, min_clearance_m=0.05)
    assert len(apart.bodies) < len(joined.bodies)


def test_occupancy_is_drawn_once_per_run() -> None:
    """Half of the runs are missing as a whole."""
    scene = drawn(
        street(), run_m=Constant(1.0), gap_m=Constant(0.5), occupancy=Probability(0.5),
        min_clearance_m=0.0,
    )  # fmt: skip
    for y in (-1.5, 1.5):
        row = row_of(scene, y)
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
