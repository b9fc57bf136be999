"""Streets with bends on hills: labels agree with rays of Embree against the meshes.

The reference line is found by summing small steps of the curvature that the road's id states; the
same street without relief tells how high a lane or a wheel is above level ground.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.assets.asset_ids import parse_asset_id
from gen_data.core.capture import Channel
from gen_data.core.lane_geometry import LaneLine, border_line
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.core.scene_time import scene_at
from gen_data.pipeline import Pipeline
from tests.embree import RayCaster
from tests.street_ground import Street, wheels_m
from tests.streets import thin_street

Array = NDArray[np.float64]

HILLS = ("randomizers.relief.grade={uniform: [-0.08, 0.08]}", "shared.landmark=none")
TOWN = (
    "shared.district=residential", "shared.junction=none", "shared.course=s_left",
    "shared.course_on=right", "shared.radius=40", "shared.turn=50", "randomizers.parked.count=8",
    "randomizers.traffic.count=12", "randomizers.people.count=12",
    "sensors.color.size_px=[160, 96]", *HILLS,
)  # fmt: skip
COUNTRY = (
    "shared.district=country_road", "shared.junction=none", "shared.course=left",
    "shared.radius=250", "shared.turn=35", *HILLS,
)  # fmt: skip
YAW = "randomizers.traffic.yaw_deg=0"


@pytest.fixture(scope="module")
def streets() -> dict[str, Street]:
    made = {}
    for name, where, without in (
        ("town", TOWN, ()), ("level town", TOWN, ("relief",)),
        ("country", COUNTRY, ()), ("level country", COUNTRY, ("relief",)),
    ):  # fmt: skip
        with open_pipeline(thin_street("street.yaml", *where, YAW, without=without)) as pipeline:
            made[name] = Street.first(pipeline)
    return made


def _main_line(scene: Scene) -> Array:
    """Points and headings [n, 3] of the main road's reference line, 5 cm apart."""
    body = next(b for b in scene.bodies if b.name == "main")
    given = parse_asset_id(body.asset).parameters
    length_m, bends = given["length_m"], given["bends"]
    assert isinstance(length_m, int | float)
    assert isinstance(bends, tuple)
    step = 0.05
    s = step * (np.arange(round(length_m / step)) + 0.5)
    curvature = np.zeros(len(s))
    for start, spiral, arc, at_most in zip(*(bends[k::4] for k in range(4)), strict=True):
        ends = np.cumsum([start, spiral, arc, spiral])
        curvature += np.interp(s, ends, [0.0, at_most, at_most, 0.0])
    heading = step * (np.cumsum(curvature) - 0.5 * curvature)
    xy = step * np.cumsum(np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
    return np.column_stack([xy + body.T_world_body.translation_m[:2], heading])


def _beside(line: Array, places: Array) -> tuple[Array, Array]:
    """Distances to the left of a line, and its headings, at the points nearest to places."""
    delta = places[:, None, :2] - line[None, :, :2]
    k = (delta * delta).sum(axis=2).argmin(axis=1)
    heading = line[k, 2]
    across = np.column_stack([-np.sin(heading), np.cos(heading)])
    left: Array = (delta[np.arange(len(k)), k] * across).sum(axis=1)
    return left, heading


@pytest.mark.slow
@pytest.mark.parametrize("where", ["town", "country"])
def test_lanes_and_their_borders_lie_on_the_drawn_surface(
    streets: dict[str, Street], where: str
) -> None:
    """Centre lines and borders of driving lanes are as high above it as on level ground.

    Within 5 mm at centre lines, and 15 mm at borders, which carry the cross slope by straight
    pieces; a slope of 5 % left out would be 80 mm there.
    """
    here, level = streets[where], streets[f"level {where}"]
    assert here.scene.relief is not None
    flat = {lane.name: lane for lane in level.scene.lanes}
    twisted = 0
    for lane in here.scene.lanes:
        if lane.kind != "driving":
            continue
        for side, limit in ((None, 0.005), ("left", 0.015), ("right", 0.015)):
            ground = []
            for street, one in ((here, lane), (level, flat[lane.name])):
                ends = one.center_m if side is None else border_line(one, side)
                points = np.array(ends)
                s, at = np.linspace(0.03, 0.97, 60), _length_shares(points)
                places = np.column_stack([np.interp(s, at, points[:, k]) for k in range(3)])
                ground.append(places[:, 2] - street.ground_m(places))
            assert np.abs(ground[0] - ground[1]).max() < limit, (lane.name, side)
        twisted += bool(lane.banks)
    assert twisted >= (2 if where == "country" else 0)


def _length_shares(points: Array) -> Array:
    steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
    at: Array = np.concatenate([[0.0], np.cumsum(steps)])
    return at / at[-1]


@pytest.mark.slow
def test_country_roads_slope_down_to_the_inside_of_bends(streets: dict[str, Street]) -> None:
    """R = 250 m at 90 km/h: 6 % (2.5 / 6)^x, x = ln(250 / 190) / ln(700 / 190), is 4.98 %."""
    line = _main_line(streets["country"].scene)
    middle = line[len(line) // 2]
    across = 3.0 * np.array([-math.sin(middle[2]), math.cos(middle[2])])
    left, right = streets["country"].ground_m([middle[:2] + across, middle[:2] - across])
    assert (right - left) / 6.0 == pytest.approx(0.0498, abs=0.002)


@pytest.mark.slow
def test_cars_head_along_the_bend_and_stand_on_the_ground(streets: dict[str, Street]) -> None:
    """Headings are tangents within 1.5 degrees: lanes are chords of 2 m, at R = 40 m of 2.9.

    Wheels are as high above the ground as on level roads, to 15 mm, where its planes meet.
    """
    town, level = streets["town"], streets["level town"]
    line = _main_line(town.scene)
    before = {i.name: i for i in level.vehicles()}
    turned = 0
    for car in town.vehicles():
        wheels, flat = wheels_m(car), wheels_m(before[car.name])
        assert wheels is not None
        assert flat is not None
        gap_m, flat_gap_m = wheels[:, 2] - town.ground_m(wheels), flat[:, 2] - level.ground_m(flat)
        np.testing.assert_allclose(gap_m, flat_gap_m, atol=0.015)
        place = np.array([car.T_world_instance.translation_m])
        left, heading = _beside(line, place)
        if not car.name.startswith("traffic") or abs(left[0]) > 4.0:
            continue
        ahead = car.T_world_instance.rotate(np.array([1.0, 0.0, 0.0]))
        off = math.remainder(math.atan2(ahead[1], ahead[0]) - heading[0], math.pi)
        if (place - line[-1])[0, :2] @ [np.cos(line[-1, 2]), np.sin(line[-1, 2])] < -5.0:
            assert abs(off) < math.radians(1.5)
            turned += abs(heading[0]) > 0.1
    assert turned >= 2


@pytest.mark.slow
def test_people_stand_on_the_ground_of_bends(streets: dict[str, Street]) -> None:
    """Within 20 mm of their height above level pavements."""
    town, level = streets["town"], streets["level town"]
    before = {i.name: i.T_world_instance for i in level.scene.instances if i.category == "person"}
    people = [i for i in town.scene.instances if i.category == "person"]
    assert len(people) >= 3
    for person in people:
        here, flat = (np.array([T.translation_m]) for T in (person.T_world_instance,
                                                            before[person.name]))  # fmt: skip
        gap_m = here[0, 2] - town.ground_m(here)[0] - flat[0, 2] + level.ground_m(flat)[0]
        assert abs(gap_m) < 0.02


@pytest.fixture(scope="module")
def sample() -> Iterator[tuple[Pipeline, Sample]]:
    sets = (*TOWN, "shared.parking=none", "views_per_scene=1", "randomizers.people.count=0",
            "annotations=[boxes3d, instance_masks, free_space, poses, visibility]")  # fmt: skip
    channels = frozenset({Channel.RANGE, Channel.INSTANCE})
    with open_pipeline(thin_street("street.yaml", *sets), channels) as pipeline:
        yield pipeline, pipeline.sample(0)


def _rays(pipeline: Pipeline, sample: Sample) -> tuple[NDArray[np.int64], Array]:
    """Numbers of the bodies [h, w] that rays through pixels meet, and the points, in the world."""
    camera = sample.capture.readings["color"].camera
    here, bodies = camera.T_world_camera.inverse(), sample.scene.bodies
    rays = camera.intrinsics.pixel_rays()
    caster = RayCaster(*(
        ((here @ b.T_world_body).apply(m.vertices_m * np.float64(b.scale)), m.faces)
        for b, m in ((b, pipeline.assets.mesh(b.asset)) for b in bodies)
    ))  # fmt: skip
    hits = caster.cast((0.0, 0.0, 0.0), rays)
    met = np.isfinite(hits.distance)
    points = camera.T_world_camera.apply(
        rays.reshape(-1, 3) * np.where(met, hits.distance, 0.0).reshape(-1, 1)
    )
    return np.where(met, hits.mesh, -1).astype(np.int64), points.reshape(*met.shape, 3)


@pytest.mark.slow
def test_boxes_enclose_the_points_that_rays_meet(sample: tuple[Pipeline, Sample]) -> None:
    """All points of a car's surface are within its 3D box, to 1 mm."""
    pipeline, made = sample
    bodies, points = _rays(pipeline, made)
    checked = 0
    for truth in made.truth["color"].objects:
        instance = truth.instance
        own_id = [b.instance_id == instance.instance_id for b in made.scene.bodies]
        numbers = np.flatnonzero(own_id)
        seen = points[np.isin(bodies, numbers)]
        own = instance.T_world_instance.inverse().apply(seen)
        assert (own > np.array(instance.box_min_m) - 1e-3).all()
        assert (own < np.array(instance.box_max_m) + 1e-3).all()
        checked += len(seen)
    assert checked > 300


@pytest.mark.slow
def test_free_space_is_the_carriageway_that_rays_meet(sample: tuple[Pipeline, Sample]) -> None:
    """Points on the road up to its gutters, 2.75 m from its middle, and 55 m ahead."""
    pipeline, made = sample
    bodies, points = _rays(pipeline, made)
    line = _main_line(made.scene)
    eye = made.capture.readings["color"].camera.T_world_camera.translation_m
    is_road = np.array([b.name == "main" for b in made.scene.bodies])[bodies] & (bodies >= 0)
    near = np.hypot(*(points[..., :2] - np.array(eye[:2])).T).T < 55.0
    left, _ = _beside(line, points.reshape(-1, 3))
    inside = (np.abs(left).reshape(bodies.shape) < 2.65) & is_road & near
    outside = (np.abs(left).reshape(bodies.shape) > 2.95) & is_road & near
    free = made.truth["color"].free_space
    assert free is not None
    mask = np.zeros(bodies.shape, bool)
    height, width = free.pixels.shape
    mask[free.y_px : free.y_px + height, free.x_px : free.x_px + width] = free.pixels
    assert inside.sum() > 500
    assert mask[inside].mean() > 0.99
    assert mask[outside].mean() < 0.01


@pytest.mark.slow
def test_traffic_stays_in_its_lane_and_on_the_ground_through_bends() -> None:
    """Rear axles within .6 m of the middle of a lane; wheels within 25 mm, with ruts."""
    config = thin_street("street_sequence.yaml", *TOWN[:-3], *HILLS, "steps_per_scene=1",
                         "sensors.color.size_px=[64, 32]")  # fmt: skip
    with open_pipeline(config) as pipeline:
        street = Street.first(pipeline)
    lines = [LaneLine(lane) for lane in street.scene.lanes if lane.kind == "driving"]
    middles = np.concatenate([np.array(line.lane.center_m) for line in lines])
    dense = np.concatenate([middles[:-1] + k / 20 * np.diff(middles, axis=0) for k in range(20)])
    tracks = {track.body for track in street.scene.tracks}
    checked, rolled = 0, []
    for time_s in np.linspace(0.0, 4.0, 9):
        scene = scene_at(street.scene, float(time_s))
        for car in scene.instances:
            wheels = wheels_m(car)
            if wheels is None or car.name not in tracks:
                continue
            assert np.abs(wheels[:, 2] - street.ground_m(wheels)).max() < 0.025
            rear = wheels[np.argsort(car.T_world_instance.inverse().apply(wheels)[:, 0])[:2]]
            away = np.hypot(*(dense[:, :2] - rear.mean(axis=0)[:2]).T).min()
            assert away < 0.6
            rolled.append(car.T_world_instance.rotate(np.array([0.0, 1.0, 0.0]))[2])
            checked += 1
    assert checked >= 30
    assert np.ptp(rolled) > math.sin(math.radians(1.0))
