"""Streets on their relief in images, scans and labels, against rays of Embree."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.annotations.lanes import Lanes
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory, open_pipeline
from gen_data.core import errors, se3, serialization
from gen_data.core.capture import Channel
from gen_data.core.sample import Sample
from gen_data.exporters.lane_lines import PaintedWorlds, lane_lines, vehicle_pose
from gen_data.pipeline import Pipeline
from tests.embree import Hits, RayCaster, placed
from tests.pipeline.test_everything_on_the_ground import BENDS, left_of, main_line
from tests.street_ground import Street
from tests.streets import HILLS, STRAIGHT, thin_street

STREET = (*STRAIGHT, "sensors.color.size_px=[160, 96]")
HILLY_STREET = (*STREET, *HILLS, "views_per_scene=1", "randomizers.people.count=0")
"""Without people: one far away is narrower than a pixel, which shows the ground behind."""
FLAT = ("relief",)


@pytest.fixture(scope="module")
def hilly_samples() -> Iterator[tuple[Pipeline, list[Sample]]]:
    config = thin_street("street.yaml", *HILLY_STREET)
    with open_pipeline(config, frozenset({Channel.RANGE, Channel.INSTANCE})) as pipeline:
        yield pipeline, [pipeline.sample(number) for number in range(3)]


def _cast(
    pipeline: Pipeline, sample: Sample, T_world_eye: se3.SE3, rays: NDArray[np.float64]
) -> Hits:
    """First surfaces along unit rays [..., 3] of an eye."""
    here = T_world_eye.inverse()
    caster = RayCaster(*(
        ((here @ b.T_world_body).apply(m.vertices_m * np.float64(b.scale)), m.faces)
        for b, m in ((b, pipeline.assets.mesh(b.asset)) for b in sample.scene.bodies)
    ))  # fmt: skip
    return caster.cast((0.0, 0.0, 0.0), rays)


def _cast_to_ground(
    pipeline: Pipeline, sample: Sample, T_world_eye: se3.SE3, rays: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distances along unit rays [..., 3] of an eye to the ground that it sees; NaN = none."""
    hits = _cast(pipeline, sample, T_world_eye, rays)
    names = [b.asset.partition("?")[0] for b in sample.scene.bodies]
    is_ground = np.array([name in ("road", "ground") for name in names])
    met = is_ground[np.maximum(hits.mesh, 0)] & (hits.mesh >= 0)
    return np.where(met, hits.distance.astype(np.float64), np.nan)


@pytest.mark.slow
def test_ground_of_hills_in_depth_images_is_where_rays_meet_it(
    hilly_samples: tuple[Pipeline, list[Sample]],
) -> None:
    """Points of pixels are on it, to 6 mm: layers of paint and covers are up to 5 mm thick.

    On the edge of a layer, a point may be as high as the ground 5 mm next to it. On silhouettes of
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
    """A scanner without noise and with narrow beams measures where its rays meet the ground."""
    sensors = (
        "sensors.image_02.size_px=[64, 32]", "sensors.image_03.size_px=[64, 32]",
        "sensors.velodyne.ideal=true", "sensors.velodyne.motion_distortion=none",
        "sensors.velodyne.model=VLP-16", "sensors.velodyne.divergence=false",
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
    config = thin_street("street.yaml", *HILLY_STREET)
    with open_pipeline(config, frozenset({Channel.RANGE, Channel.INSTANCE})) as pipeline:
        again = pipeline.sample(1)
    assert serialization.to_plain(again.scene) == serialization.to_plain(samples[1].scene)
    for channel, values in samples[1].capture.readings["color"].channels.items():
        np.testing.assert_array_equal(again.capture.readings["color"].channels[channel], values)


@pytest.mark.slow
def test_level_relief_equals_none() -> None:
    """Grades and slopes of 0 give the scene of a configuration without relief."""
    level = ("randomizers.relief.grade=0", "randomizers.relief.side_slope=0")
    with open_pipeline(thin_street("street.yaml", *STREET, *level)) as pipeline:
        one = Street.first(pipeline).scene
    with open_pipeline(thin_street("street.yaml", *STREET, without=FLAT)) as pipeline:
        assert serialization.to_plain(one) == serialization.to_plain(Street.first(pipeline).scene)


@pytest.fixture(scope="module")
def bent() -> Iterator[tuple[Pipeline, Sample]]:
    """A sample of a street with bends on hills."""
    sets = (
        *BENDS, "sensors.color.size_px=[160, 96]", "shared.parking=none", "views_per_scene=1",
        "randomizers.people.count=0",
        "annotations=[boxes3d, instance_masks, free_space, poses, visibility]",
    )  # fmt: skip
    channels = frozenset({Channel.RANGE, Channel.INSTANCE})
    with open_pipeline(thin_street("street.yaml", *sets), channels) as pipeline:
        yield pipeline, pipeline.sample(0)


def _rays(pipeline: Pipeline, sample: Sample) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Numbers of the bodies [h, w] that rays through pixels meet, and the points, in the world."""
    camera = sample.capture.readings["color"].camera
    rays = camera.intrinsics.pixel_rays()
    hits = _cast(pipeline, sample, camera.T_world_camera, rays)
    met = np.isfinite(hits.distance)
    points = camera.T_world_camera.apply(
        rays.reshape(-1, 3) * np.where(met, hits.distance, 0.0).reshape(-1, 1)
    )
    return np.where(met, hits.mesh, -1).astype(np.int64), points.reshape(*met.shape, 3)


@pytest.mark.slow
def test_boxes_enclose_the_points_that_rays_meet(bent: tuple[Pipeline, Sample]) -> None:
    """All points of a car's surface are within its 3D box, to 1 mm."""
    pipeline, made = bent
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
def test_free_space_is_the_carriageway_that_rays_meet(bent: tuple[Pipeline, Sample]) -> None:
    """Points on the road up to its gutters, 2.75 m from its middle, and 55 m ahead."""
    pipeline, made = bent
    bodies, points = _rays(pipeline, made)
    line = main_line(made.scene)
    eye = made.capture.readings["color"].camera.T_world_camera.translation_m
    is_road = np.array([b.name == "main" for b in made.scene.bodies])[bodies] & (bodies >= 0)
    near = np.hypot(*(points[..., :2] - np.array(eye[:2])).T).T < 55.0
    left, _ = left_of(line, points.reshape(-1, 3))
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


def test_relief_without_roads_is_refused(tmp_path: Path) -> None:
    """At its place in the file."""
    path = tmp_path / "table.yaml"
    path.write_text("extends: tabletop.yaml\nrandomizers:\n  - {type: relief, name: hills}\n")
    config = load_config(str(path))
    with pytest.raises(errors.ConfigError, match=r"table\.yaml:3:5: .*no element of type road"):
        PipelineFactory(config, n=1).check()
