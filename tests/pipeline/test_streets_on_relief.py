"""Streets on their relief: everything stands on the ground, in views, images and scans.

The ground is found by rays of Embree that fall onto the meshes of a scene; the same street without
relief tells how high a surface or an object is above level ground.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.annotations.lanes import Lanes
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory, open_pipeline
from gen_data.core import errors, lane_geometry, scene_time, se3, serialization
from gen_data.core.capture import Channel
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.exporters.lane_lines import PaintedWorlds, lane_lines, vehicle_pose
from gen_data.pipeline import Pipeline
from tests.embree import RayCaster, placed
from tests.street_ground import Street, wheels_m
from tests.streets import thin_street

STREET = (
    "shared.district=residential", "shared.junction=none", "shared.course=straight",
    "shared.course_on=straight",
    "shared.landmark=none", "randomizers.parked.count=8", "randomizers.traffic.count=8",
    "randomizers.people.count=12", "sensors.color.size_px=[160, 96]",
)  # fmt: skip
GRADE = 0.08
SLOPE = ("randomizers.relief.grade=0.08", "randomizers.relief.side_slope=0")
HILLS = (
    "randomizers.relief.grade={uniform: [-0.12, 0.12]}",
    "randomizers.relief.side_slope={uniform: [-0.15, 0.15]}",
)
FLAT = ("relief",)


@pytest.fixture(scope="module")
def streets() -> dict[str, Street]:
    """The same street level, on a slope of 8 %, and on hills."""
    configs = {
        "flat": thin_street("street.yaml", *STREET, without=FLAT),
        "slope": thin_street("street.yaml", *STREET, *SLOPE),
        "hills": thin_street("street.yaml", *STREET, *HILLS),
    }
    made = {}
    for name, config in configs.items():
        with open_pipeline(config) as pipeline:
            made[name] = Street.first(pipeline)
    return made


def _places(scene: Scene, kinds: Sequence[str] = ("driving", "sidewalk")) -> NDArray[np.float64]:
    """Places on the lanes of a level street, [n, 3]."""
    rng = np.random.default_rng(0)
    lines = [lane_geometry.LaneLine(lane) for lane in scene.lanes if lane.kind in kinds]
    poses = [
        line.pose(float(at), float(0.4 * line.lane.width_m * side))
        for line in lines
        for at, side in zip(
            rng.uniform(1.0, line.length_m - 1.0, 60), rng.uniform(-1, 1, 60), strict=True
        )
    ]
    return np.array([pose.translation_m for pose in poses])


@pytest.mark.slow
def test_carriageways_and_pavements_rise_with_the_grade(streets: dict[str, Street]) -> None:
    """The main road starts at x = -150 m: at x it is 0.08 (x + 150) higher than a level one."""
    places = _places(streets["flat"].scene)
    places = places[places[:, 0] < -1.0]
    rise_m = streets["slope"].ground_m(places) - streets["flat"].ground_m(places)
    assert len(places) > 150
    np.testing.assert_allclose(rise_m, GRADE * (places[:, 0] + 150.0), atol=0.001)


@pytest.mark.slow
def test_ground_of_hills_is_the_level_ground_raised_by_the_relief(
    streets: dict[str, Street],
) -> None:
    """Rays meet all layers, paint, asphalt and kerbs, as far apart as on level ground."""
    hills = streets["hills"]
    assert hills.scene.relief is not None
    places = _places(streets["flat"].scene)
    rise_m = hills.ground_m(places) - streets["flat"].ground_m(places)
    np.testing.assert_allclose(rise_m, hills.scene.relief.height(places), atol=0.001)
    assert np.ptp(rise_m) > 2.0


@pytest.mark.slow
@pytest.mark.parametrize("relief", ["slope", "hills"])
def test_all_wheels_of_cars_stand_on_the_ground(streets: dict[str, Street], relief: str) -> None:
    """Within 2 mm of their place on level ground; 15 mm where planes of the ground meet."""
    level = {i.name: i for i in streets["flat"].vehicles()}
    on = streets[relief]
    cars = on.vehicles()
    assert len(cars) >= 8
    assert {i.name for i in cars} == set(level)
    for car in cars:
        before, after = wheels_m(level[car.name]), wheels_m(car)
        assert before is not None
        assert after is not None
        gap_m = after[:, 2] - on.ground_m(after)
        flat_gap_m = before[:, 2] - streets["flat"].ground_m(before)
        np.testing.assert_allclose(gap_m, flat_gap_m, atol=0.002 if relief == "slope" else 0.015)


@pytest.mark.slow
def test_cars_pitch_with_the_grade(streets: dict[str, Street]) -> None:
    """Up axes of all cars on the slope are its normal: (-0.08, 0, 1) / |...|."""
    normal = np.array([-GRADE, 0.0, 1.0]) / math.hypot(GRADE, 1.0)
    cars = [
        i
        for i in streets["slope"].vehicles()
        if -140.0 < i.T_world_instance.translation_m[0] < -5.0
    ]
    assert len(cars) >= 4
    for car in cars:
        up = car.T_world_instance.rotate(np.array([0.0, 0.0, 1.0]))
        np.testing.assert_allclose(up, normal, atol=1e-5)


@pytest.mark.slow
def test_people_walk_upright_on_the_ground(streets: dict[str, Street]) -> None:
    """As high above the ground at their middle as on level ground."""
    level = {i.name: i for i in streets["flat"].scene.instances if i.category == "person"}
    hills = streets["hills"]
    people = [i for i in hills.scene.instances if i.category == "person"]
    assert len(people) >= 3
    for person in people:
        before = level[person.name].T_world_instance
        _, pitch, roll = se3.turns_of(person.T_world_instance)
        assert (pitch, roll) == se3.turns_of(before)[1:]
        places = [before.translation_m, person.T_world_instance.translation_m]
        flat = places[0][2] - streets["flat"].ground_m(places[:1])[0]
        assert places[1][2] - hills.ground_m(places[1:])[0] == pytest.approx(flat, abs=0.025)


@pytest.mark.slow
def test_lanes_lie_on_the_ground(streets: dict[str, Street]) -> None:
    """Centre lines are within 5 mm as high above the meshes as on level ground."""
    hills, flat = streets["hills"], streets["flat"]
    level = {lane.name: lane for lane in flat.scene.lanes}
    checked = 0
    for lane in hills.scene.lanes:
        if lane.kind not in ("driving", "sidewalk"):
            continue
        line = lane_geometry.LaneLine(lane)
        at = np.linspace(0.5, line.length_m - 0.5, 80)
        points = np.array([line.pose(float(s)).translation_m for s in at])
        gap_m = points[:, 2] - hills.ground_m(points)
        # Level lanes have one height; their ground has ruts and joints.
        flat_gap_m = level[lane.name].center_m[0][2] - flat.ground_m(points)
        np.testing.assert_allclose(gap_m, flat_gap_m, atol=0.005)
        checked += 1
    assert checked >= 6


@pytest.mark.slow
def test_view_of_a_dash_camera_pitches_with_its_car(streets: dict[str, Street]) -> None:
    """The axis of the camera climbs by atan(0.08) more than on level ground, along +X."""
    slope, flat = (streets[name].scene.cameras[0].T_world_camera for name in ("slope", "flat"))
    ahead, before = (T.rotate(np.array([0.0, 0.0, 1.0])) for T in (slope, flat))
    uphill = math.copysign(1.0, before[0])
    turned = math.asin(ahead[2]) - math.asin(before[2])
    assert turned == pytest.approx(uphill * math.atan(GRADE), abs=0.003)


@pytest.fixture(scope="module")
def hilly_samples() -> Iterator[tuple[Pipeline, list[Sample]]]:
    config = thin_street("street.yaml", *STREET, *HILLS, "views_per_scene=1")
    with open_pipeline(config, frozenset({Channel.RANGE, Channel.INSTANCE})) as pipeline:
        yield pipeline, [pipeline.sample(0), pipeline.sample(1)]


def _cast_to_ground(
    pipeline: Pipeline, sample: Sample, T_world_eye: se3.SE3, rays: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distances along unit rays [..., 3] of an eye to the ground that it sees; NaN = none."""
    here, bodies = T_world_eye.inverse(), sample.scene.bodies
    meshes = [pipeline.assets.mesh(b.asset) for b in bodies]
    caster = RayCaster(*(
        ((here @ b.T_world_body).apply(m.vertices_m * np.float64(b.scale)), m.faces)
        for b, m in zip(bodies, meshes, strict=True)
    ))  # fmt: skip
    hits = caster.cast((0.0, 0.0, 0.0), rays)
    is_ground = np.array([b.asset.partition("?")[0] in ("road", "ground") for b in bodies])
    met = is_ground[np.maximum(hits.mesh, 0)] & (hits.mesh >= 0)
    return np.where(met, hits.distance.astype(np.float64), np.nan)


@pytest.mark.slow
def test_ground_of_hills_in_depth_images_is_where_rays_meet_it(
    hilly_samples: tuple[Pipeline, list[Sample]],
) -> None:
    """Points of pixels are on it, to 6 mm: layers of paint and covers are up to 5 mm thick.

    On the edge of a layer, a point may be as high as the ground 5 mm beside it. On silhouettes of
    crests, one ray in hundreds may meet the ground behind them.
    """
    pipeline, samples = hilly_samples
    for sample in samples:
        reading = sample.capture.readings["color"]
        rays = reading.camera.intrinsics.pixel_rays()
        met_m = _cast_to_ground(pipeline, sample, reading.camera.T_world_camera, rays)
        ground = np.isfinite(met_m)
        seen = rays[ground] * reading.channels[Channel.RANGE][ground][:, None]
        points = reading.camera.T_world_camera.apply(seen)
        street = Street(sample.scene, pipeline.assets)
        places = [points + 0.005 * np.array((x, y, 0)) for x in (-1, 0, 1) for y in (-1, 0, 1)]
        off_m = np.abs(points[:, 2] - [street.ground_m(place) for place in places]).min(axis=0)
        assert ground.sum() > 2000
        assert off_m.max() < 0.006
        apart = np.abs(np.linalg.norm(seen, axis=1) / met_m[ground] - 1.0)
        assert (apart > 0.005).mean() < 0.002


@pytest.mark.slow
def test_borders_are_hidden_by_crests_and_by_cars_uphill_and_downhill(
    hilly_samples: tuple[Pipeline, list[Sample]],
) -> None:
    """As rays to points just above and 30 cm above them are blocked."""
    pipeline, samples = hilly_samples
    wrong = hidden = 0
    for sample in samples:
        scene, reading = sample.scene, sample.capture.readings["color"]
        caster = RayCaster(*(placed(b, pipeline.assets) for b in scene.bodies))
        eye = np.array(reading.camera.T_world_camera.translation_m)
        image = Lanes().annotate_image(scene, pipeline.assets, reading, sample.truth["color"])
        dividers = PaintedWorlds(pipeline.assets).dividers(
            replace(sample, truth={"color": image}), "color"
        )
        T_world_vehicle = reading.camera.T_world_camera @ vehicle_pose(scene, reading.camera)
        for line in lane_lines(replace(sample, truth={"color": image}), "color", dividers):
            points = T_world_vehicle.apply(line.points_m)
            low, high = (
                caster.is_blocked(eye, points + np.array((0.0, 0.0, above_m)) - eye, 0.0, 1.0)
                for above_m in (0.02, 0.3)
            )
            wrong += int(((line.visible == low) & (low == high)).sum())
            hidden += int((low & high).sum())
    assert hidden > 4 and wrong == 0


@pytest.mark.slow
def test_points_of_a_scan_lie_on_the_ground_of_hills() -> None:
    """A scanner without noise measures the distance at which its rays meet the ground."""
    sensors = (
        "sensors.image_02.size_px=[64, 32]", "sensors.image_03.size_px=[64, 32]",
        "sensors.velodyne.ideal=true", "sensors.velodyne.motion_distortion=none",
        "sensors.velodyne.model=VLP-16",
    )  # fmt: skip
    config = thin_street("kitti_rig.yaml", *STREET[:-1], *HILLS, *sensors, "steps_per_scene=1")
    with open_pipeline(config) as pipeline:
        sample = pipeline.sample(0)
        points = sample.capture.clouds["velodyne"].points["position_m"].astype(np.float64)
        range_m = np.linalg.norm(points, axis=1)
        scanner = sample.scene.lidar("velodyne").T_world_lidar
        met_m = _cast_to_ground(pipeline, sample, scanner, points / range_m[:, None])
    ground = np.isfinite(met_m)
    off_m = np.abs(range_m - met_m)[ground]
    heights_m = scanner.apply(points[ground])[:, 2]
    assert ground.sum() > 3000
    assert (off_m > 0.005).mean() < 0.002
    assert np.ptp(heights_m) > 2.0


@pytest.mark.slow
def test_samples_on_relief_do_not_depend_on_the_order_of_their_making(
    hilly_samples: tuple[Pipeline, list[Sample]],
) -> None:
    """Sample 1 of a pipeline that made no other one has the same scene and the same pixels."""
    _, samples = hilly_samples
    config = thin_street("street.yaml", *STREET, *HILLS, "views_per_scene=1")
    with open_pipeline(config, frozenset({Channel.RANGE, Channel.INSTANCE})) as pipeline:
        again = pipeline.sample(1)
    assert serialization.to_plain(again.scene) == serialization.to_plain(samples[1].scene)
    for channel, values in samples[1].capture.readings["color"].channels.items():
        np.testing.assert_array_equal(again.capture.readings["color"].channels[channel], values)


@pytest.mark.slow
def test_level_relief_is_no_relief() -> None:
    """A scene whose grades and slopes are 0 is that of a configuration without relief."""
    level = ("randomizers.relief.grade=0", "randomizers.relief.side_slope=0")
    with open_pipeline(thin_street("street.yaml", *STREET, *level)) as pipeline:
        one = Street.first(pipeline).scene
    with open_pipeline(thin_street("street.yaml", *STREET, without=FLAT)) as pipeline:
        assert serialization.to_plain(one) == serialization.to_plain(Street.first(pipeline).scene)


@pytest.mark.slow
def test_traffic_follows_the_ground_at_every_instant() -> None:
    """Wheels of the ego vehicle and of others, at seven instants of two seconds."""
    small = (*STREET[:-1], "steps_per_scene=1")
    config = thin_street("street_sequence.yaml", *small, *HILLS)
    with open_pipeline(config) as pipeline:
        street = Street.first(pipeline)
    names = {track.body for track in street.scene.tracks}
    travelled, checked = [], 0
    for time_s in np.linspace(0.0, 2.0, 7):
        scene = scene_time.scene_at(street.scene, float(time_s))
        moved = replace(scene, instances=scene.instances)
        for instance in moved.instances:
            wheels = wheels_m(instance)
            if wheels is None or instance.name not in names:
                continue
            gap_m = wheels[:, 2] - street.ground_m(wheels)
            # Ruts are up to 5 mm deep; planes of the ground meet below cars.
            assert np.abs(gap_m).max() < 0.03
            travelled.append(float(wheels[0, 2]))
            checked += 1
    assert checked >= 14
    assert np.ptp(travelled) > 0.2


def test_relief_without_roads_is_refused(tmp_path: Path) -> None:
    """At its place in the file."""
    path = tmp_path / "table.yaml"
    path.write_text("extends: tabletop.yaml\nrandomizers:\n  - {type: relief, name: hills}\n")
    config = load_config(str(path))
    with pytest.raises(errors.ConfigError, match=r"table\.yaml:3:5: .*no element of type road"):
        PipelineFactory(config, n=1).check()
