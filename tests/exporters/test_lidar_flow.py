"""Scene flow of laser points: by closed formulas, posed meshes, and the formulas of readers."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.core.asset_types import SURFACES, MeshData
from gen_data.core.capture import POINT
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.motion import StateChange
from gen_data.core.scene import Body, Lidar, Scene
from gen_data.core.scene_time import place_sensors, scene_at
from gen_data.core.se3 import SE3, Array
from gen_data.exporters.lidar_flow import LidarFlow, SceneFlow, scene_flow
from gen_data.sensors.lidar.lidar_sensor import LidarSensor
from tests.exporters.datasets import scanning, with_sensor
from tests.exporters.drives import drive_info
from tests.libraries import library
from tests.renderers.fake_library import FakeLibrary, box_mesh
from tests.renderers.moving import MESHES, even_track, world

STEP_S = 0.1
SQUASHED = (1.0, 1.5, 0.5)


def stretched(mesh: MeshData) -> MeshData:
    return replace(mesh, vertices_m=mesh.vertices_m * np.array(SQUASHED, np.float32))


SHAPES = FakeLibrary(MESHES.meshes | {"tall": stretched(box_mesh())})


def turned_y(angle: NDArray[np.floating]) -> Array:
    """Rotations about Y, [n, 3, 3]."""
    c, s, zero, one = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    rows = [[c, zero, s], [zero, one, zero], [-s, zero, c]]
    return np.array(rows).transpose(2, 0, 1)


def flow_of(
    scene: Scene,
    p_world: Array,
    ids: NDArray[np.integer],
    delays_s: Array,
    assets: AssetLibrary = SHAPES,
) -> tuple[SceneFlow, Array]:
    """Flow of points of a scanner on the eye of a scene, and the points in its frame."""
    lidar = Lidar("top", "", SE3((0.3, 0.1, -0.2), (0.8, 0.0, 0.6, 0.0)), rig="eye")
    now = scene_at(place_sensors(replace(scene, lidars=(lidar,))), 0.2)
    points = np.zeros(len(p_world), POINT)
    points["position_m"] = now.lidar("top").T_world_lidar.inverse().apply(p_world)
    points["instance_id"] = ids
    then = scene_at(now, now.time_s + STEP_S)
    return scene_flow(now, then, assets, "top", points, delays_s), points["position_m"]


def expected_flow(p_now: Array, p_then: Array, speed: Array, turn: float) -> Array:
    """From 0.2 s to 0.3 s, between frames of a scanner that drives and turns about Y."""
    places = []
    for time_s, p in ((0.2, p_now), (0.3, p_then)):
        R_eye = turned_y(np.array([turn * time_s]))[0]
        R_mount = np.array([[0.28, 0, 0.96], [0, 1, 0], [-0.96, 0, 0.28]])
        origin = speed * time_s + R_eye @ [0.3, 0.1, -0.2]
        places.append((p - origin) @ (R_eye @ R_mount))
    return np.asarray(places[1] - places[0])


def test_points_move_with_bodies_that_drive_and_turn_as_the_ego_does_from_their_own_pulses() -> (
    None
):
    """p(t) = c + v t + R(w t) m, at the instants of the pulses; the rest of the world stays."""
    start, velocity, turn = SE3((0.0, 0.0, 3.0)), np.array([0.6, 0.2, -0.5]), 0.8
    box = Body("box", "box", start, instance_id=1)
    speed, ego_turn = np.array([-3.0, 0.0, 2.0]), 0.5
    scene = world(
        box, Body("wall", "wall", SE3((0.0, 0.0, 6.0))),
        tracks=(even_track("box", start, (0.6, 0.2, -0.5), turn),),
        camera_velocity_m_s=(-3.0, 0.0, 2.0), camera_turn_rad_s=ego_turn,
    )  # fmt: skip
    rng = np.random.default_rng(5)
    material, delays_s = rng.uniform(-0.5, 0.5, (50, 3)), rng.uniform(-0.05, 0.05, 50)
    ids = np.repeat([1, 0], 25)

    def at(time_s: float) -> Array:
        t = time_s + delays_s
        rides = np.array(start.translation_m) + velocity * t[:, None]
        rides = rides + np.einsum("nij,nj->ni", turned_y(turn * t), material)
        return np.where(ids[:, None] == 1, rides, material + np.array([0.0, 0.0, 6.0]))

    flow, _ = flow_of(scene, at(0.2), ids, delays_s)
    expected = expected_flow(at(0.2), at(0.3), speed, ego_turn)
    np.testing.assert_allclose(flow.flow_m, expected, atol=2e-5)
    np.testing.assert_allclose(flow.moved_m, np.linalg.norm(at(0.3) - at(0.2), axis=1), atol=2e-5)
    assert flow.moved_m[25:].max() == 0.0
    assert flow.valid.all()


@pytest.mark.parametrize("noise_m", [0.0, 0.015, 0.15])
def test_points_of_a_mesh_that_deforms_move_with_the_nearest_triangle(noise_m: float) -> None:
    """A box is stretched within the step: its faces by the factors; farther points move along."""
    box = Body("box", "box", SE3((0.0, 0.0, 3.0)), instance_id=1)
    scene = world(box, changes=(StateChange(0.25, "box", "tall"),), time_s=0.0)
    q = np.array([[0.1, 0.2, -0.5], [-0.3, -0.4, -0.5], [0.2, 0.5, 0.1], [0.0, -0.5, 0.3]])
    outward = np.where(np.abs(q) == 0.5, np.sign(q), 0.0)
    p_world = q + noise_m * outward + [0.0, 0.0, 3.0]
    flow, p_lidar = flow_of(scene, p_world, np.ones(4, int), np.zeros(4))
    p_then = p_world + q * (np.array(SQUASHED) - 1.0)
    np.testing.assert_allclose(
        flow.flow_m, expected_flow(p_world, p_then, np.zeros(3), 0.0), atol=2e-5
    )
    assert p_lidar.shape == (4, 3)


def test_points_take_the_motion_of_the_body_that_they_are_on() -> None:
    """An instance of two bodies, and a moving body without an instance before a wall."""
    places = {"left": (-2.0, 0.0, 3.0), "right": (2.0, 0.0, 3.0), "free": (0.0, 3.0, 3.0)}
    ids = {"left": 1, "right": 1, "free": 0}
    bodies = [Body(n, "box", SE3(p), instance_id=ids[n]) for n, p in places.items()]
    speeds = {"right": (0.0, 1.0, 0.0), "free": (0.0, 0.0, 2.0)}
    tracks = tuple(even_track(n, SE3(places[n]), v) for n, v in speeds.items())
    wall = Body("wall", "wall", SE3((0.0, 0.0, 6.0)))
    scene = world(*bodies, wall, tracks=tracks)
    on = [[-2.0, 0.2, 2.5], [2.1, 0.2, 2.5], [0.1, 3.3, 2.9], [1.0, 1.0, 6.0], [9.0, 9.0, 9.0]]
    flow, _ = flow_of(scene, np.array(on), np.array([1, 1, 0, 0, 1]), np.zeros(5))
    np.testing.assert_allclose(flow.moved_m, [0.0, 0.1, 0.2, 0.0, 0.0], atol=1e-6)
    assert flow.valid.tolist() == [True, True, True, True, False]


@pytest.mark.slow
def test_points_on_a_person_who_walks_follow_the_posed_mesh() -> None:
    """The triangle and weights of Embree's hits, on the mesh that is posed a step later."""
    from tests.embree import RayCaster, placed

    assets, start = library(), SE3((0.0, 0.0, 3.0))
    walker = "simple_person?phase={}&pose=walk&seed=3"
    velocity = np.array([0.0, 1.3, 0.0])
    body = Body("walker", walker.format(0.0), start, instance_id=1)
    changes = (StateChange(0.2, "walker", walker.format(0.25)),
               StateChange(0.3, "walker", walker.format(0.375)))  # fmt: skip
    scene = world(body, tracks=(even_track("walker", start, (0.0, 1.3, 0.0)),), changes=changes,
                  time_s=0.0)  # fmt: skip
    corners, faces = placed(scene_at(scene, 0.2).bodies[0], assets)
    rng = np.random.default_rng(2)
    # A pulse that leaves later meets the same posed mesh farther on its way.
    delays_s = rng.uniform(-0.05, 0.05, 200)
    eye, ends = np.array([6.0, 0.0, 3.2]), rng.choice(corners, 200) + rng.normal(0, 0.01, (200, 3))
    hits = RayCaster((corners, faces)).cast(eye, ends - eye)
    met = np.isfinite(hits.distance)
    p, triangles = (eye + hits.distance[:, None] * (ends - eye))[met], faces[hits.face[met]]
    mesh = assets.mesh(walker.format(0.375))
    assert np.array_equal(mesh.faces, faces)
    weights = np.linalg.solve(corners[triangles].transpose(0, 2, 1), p[:, :, None])[:, :, 0]
    posed = mesh.vertices_m.astype(float) + start.translation_m + velocity * 0.3
    late = velocity * delays_s[met, None]
    p_now, p_then = p + late, np.einsum("nk,nki->ni", weights, posed[triangles]) + late
    flow, _ = flow_of(scene, p_now, np.ones(len(p), int), delays_s[met], assets)
    expected = expected_flow(p_now, p_then, np.zeros(3), 0.0)
    assert len(p) > 80
    deformed_m = np.linalg.norm(p_then - p_now - velocity * STEP_S, axis=1)
    assert deformed_m.max() > 0.05
    np.testing.assert_allclose(flow.flow_m, expected, atol=2e-4)
    assert flow.valid.all()


CLASSES = {0: 0, 1: 19, 2: 17, 3: 0}
"""Argoverse 2's numbers of REGULAR_VEHICLE and PEDESTRIAN, by category id of the drive."""


def truth(world: Any, sample: Any) -> dict[str, Array]:
    """Points and flow of a sample of the drive in its scanner's frame, above the ego's origin."""
    points = sample.capture.clouds["top"].points
    p = points["position_m"].astype(float)
    up = SE3((0.0, 0.0, 1.73))
    now, then = (world.ego_pose(sample.scene.time_s + k * STEP_S) @ up for k in (0, 1))
    speeds = {1: (0.05, 8.0), 2: (1.5, 1.5)}
    moved = np.zeros_like(p)
    for number, (yaw, speed) in speeds.items():
        way = speed * STEP_S * np.array([np.cos(yaw), np.sin(yaw), 0.0])
        moved[points["instance_id"] == number] = way
    flow = then.inverse().apply(now.apply(p) + moved) - p
    kinds = {i.instance_id: i.category_id for i in sample.scene.instances} | {0: 0}
    numbers = [1 if kinds[k] == 1 else 2 if kinds[k] == 3 else 0 for k in points["instance_id"]]
    valid = ~np.isin(points["surface"], [SURFACES.index("air"), SURFACES.index("mirrored")])
    return {"p": p, "flow": flow, "moved": moved, "valid": valid,
            "classes": np.array([CLASSES[k] for k in numbers])}  # fmt: skip


def in_the_air(samples: Any) -> list[Any]:
    """The samples of a drive; each tenth point of the ground is a return from the air."""
    changed = []
    for sample in samples:
        points = sample.capture.clouds["top"].points.copy()
        ground = np.flatnonzero(points["instance_id"] == 0)
        points["surface"][ground[::10]] = SURFACES.index("air")
        changed.append(scanning(sample, points))
    return changed


def end_point_error(predicted: Array, true: Array) -> float:
    """EPE of Argoverse 2: the mean distance [m]."""
    return float(np.linalg.norm(predicted - true, axis=-1).mean())


def problems(world: Any, folder: Path, samples: Any) -> list[str]:
    """Facts in the files that are not the samples'."""
    from pyarrow import feather

    found = []
    pairs = [(a, b) for a, b in pairwise(samples) if b.step_index]
    scans = sorted((folder / "kitti").glob("*/*.npz"))
    rows = sorted((folder / "av2").glob("*/*/*.feather"))
    if (len(scans), len(rows)) != (len(pairs),) * 2:
        return [f"{len(scans)} and {len(rows)} files"]
    names = [f"{s.scene_index:06d}_{s.step_index:06d}" for s, _ in pairs]
    if [path.stem for path in scans] != names:
        found.append("names")
    for (sample, later), scan, path in zip(pairs, scans, rows, strict=True):
        true = truth(world, sample)
        valid, dynamic = true["valid"], np.linalg.norm(true["moved"], axis=1) >= 0.05
        pair = np.load(scan)
        table = feather.read_table(path)
        flow = np.stack([table[f"flow_t{axis}_m"].to_numpy() for axis in "xyz"], axis=1)
        start_ns = int(path.stem) - round(1e9 * sample.scene.time_s)
        checks = {
            "pos1": np.array_equal(pair["pos1"], true["p"][valid].astype("f4")),
            "pos2": np.array_equal(pair["pos2"], later.capture.clouds["top"].points["position_m"]),
            "gt": end_point_error(pair["gt"], true["flow"][valid]) < 2e-6,
            "flow": end_point_error(flow[valid], true["flow"][valid]) < 2e-6,
            "types": flow.dtype == pair["gt"].dtype == np.float32,
            "valid": np.array_equal(table["is_valid"].to_numpy(), valid),
            "dynamic": np.array_equal(table["is_dynamic"].to_numpy()[valid], dynamic[valid]),
            "classes": np.array_equal(table["category_indices"].to_numpy(), true["classes"]),
            "close": np.array_equal(
                table["is_close"].to_numpy(), np.abs(true["p"][:, :2]).max(axis=1) <= 35.0
            ),
            "time": start_ns % 1_000_000_000 == 0 and path.parts[-3] == sample.split,
        }
        found += [f"{sample.index}: {name}" for name, right in checks.items() if not right]
    return found


def test_files_hold_the_motion_of_the_drive_for_each_pair_of_scans(
    world: Any, tmp_path: Path
) -> None:
    """A car at 8 m/s, a person at 1.5 m/s and an ego in a curve; the truth has an EPE of 0."""
    samples = in_the_air(world.drive())
    true = truth(world, samples[0])
    assert set(true["classes"]) == {0, 17, 19}
    assert not true["valid"].all()
    folder = world.export(LidarFlow(), drive_info(world), samples, tmp_path)
    assert problems(world, folder, samples) == []


def test_a_slower_scanner_has_its_flow_to_its_next_scan(world: Any, tmp_path: Path) -> None:
    """Scans at every second step: the only pair of a sequence is 0.2 s apart."""
    info = with_sensor(drive_info(world), "top", rate_hz=5.0)
    samples = [
        s if s.step_index % 2 == 0 else replace(s, capture=replace(s.capture, clouds={}))
        for s in world.drive()
    ]
    folder = world.export(LidarFlow(layouts=("kitti",)), info, samples, tmp_path)
    assert not (folder / "av2").exists()
    scans = sorted((folder / "kitti").glob("*/*.npz"))
    assert [path.stem for path in scans] == ["000000_000000", "000001_000000"]
    points = samples[0].capture.clouds["top"].points
    ground = points["instance_id"] == 0
    p = points["position_m"].astype(float)
    T_then_now = world.ego_pose(0.2).inverse() @ world.ego_pose(0.0)
    gt = np.load(scans[0])["gt"]
    np.testing.assert_allclose(gt[ground], (T_then_now.apply(p) - p)[ground], atol=5e-6)


@pytest.mark.parametrize(("motion", "moves"), [("deskewed", False), ("none", True)])
def test_points_are_as_old_as_their_pulses_unless_all_leave_at_once(
    world: Any, tmp_path: Path, motion: str, moves: bool
) -> None:
    """Pulses that left nine seconds before the car and the person set off meet them at rest."""
    samples = []
    for sample in world.drive()[:2]:
        points = sample.capture.clouds["top"].points.copy()
        points["time_s"][points["instance_id"] > 0] = -9.0
        samples.append(scanning(sample, points))
    info = with_sensor(drive_info(world), "top", motion_distortion=motion)
    folder = world.export(LidarFlow(layouts=("kitti",)), info, samples, tmp_path)
    (scan,) = (folder / "kitti").glob("*/*.npz")
    true = truth(world, samples[0])
    expected = true["flow"] if moves else true["flow"] - true["moved"] @ turn_of(world, 0.1)
    np.testing.assert_allclose(np.load(scan)["gt"], expected, atol=5e-6)


def turn_of(world: Any, time_s: float) -> Array:
    """Rotation of the ego on its drive."""
    return np.asarray(world.ego_pose(time_s).rotation())


@pytest.mark.parametrize(
    ("changes", "sensor", "text"),
    [
        ({"sensors": ()}, {}, "there is no lidar; add a sensor of that type"),
        ({}, {"motion_distortion": "raw"}, "'top' has motion_distortion: raw, .*expected deskewed"),
        ({"steps_per_scene": 1}, {}, "scans once in a sequence; expected steps_per_scene above 1"),
        ({}, {"rate_hz": 2.5}, "scans once in a sequence; expected steps_per_scene above 4"),
    ],
)
def test_data_sets_without_a_next_scan_or_a_common_frame_are_refused(
    world: Any, changes: dict[str, Any], sensor: dict[str, Any], text: str
) -> None:
    info = with_sensor(replace(drive_info(world), **changes), "top", **sensor)
    with pytest.raises(ConfigError, match=f"exporter 'lidar_flow'.*{text}"):
        LidarFlow().check(info)


@pytest.mark.parametrize("motion", ["raw", "deskewed", "none"])
def test_a_scanner_tells_the_frame_of_its_points(motion: Any) -> None:
    assert LidarSensor(motion_distortion=motion).describe().motion_distortion == motion
