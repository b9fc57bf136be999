"""Consumers add the time of a point to the stamp of its sweep, and find the pulse's instant."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from gen_data.core.capture import Capture, PointCloud
from gen_data.core.scene_time import scene_at
from gen_data.core.se3 import SE3
from gen_data.exporters.mcap import Mcap
from gen_data.exporters.pointclouds import PointClouds
from tests.exporters.conftest import driving_scene, ego_pose, scan
from tests.exporters.drives import drive_info, read_ply
from tests.exporters.test_mcap import messages

SWEEP_S, STAMP_S = 0.1, 0.2
MOUNT = SE3((0.0, 0.0, 1.73))
CRATE, CAR = 4, 1


@pytest.fixture(scope="module")
def sample(world: Any) -> Any:
    """A raw sweep at 10 m/s: eleven parts, each in the scanner's frame at its own instant."""
    parts = []
    for share in np.linspace(0.0, 1.0, 11):
        scene = scene_at(driving_scene(), STAMP_S + (share - 0.5) * SWEEP_S)
        points = scan(scene, scene.lidars[0])
        points["time_s"] = share * SWEEP_S
        parts.append(points)
    first = world.drive()[2]
    scanner = replace(first.scene.lidars[0], sweep_s=SWEEP_S)
    cloud = PointCloud("top", scanner, np.concatenate(parts), STAMP_S)
    return replace(first, index=0, capture=Capture(first.capture.readings, {"top": cloud}))


def placed(position_m: Any, time_s: Any) -> Any:
    """World positions, with the vehicle where it was at the time of each point."""
    return np.stack(
        [
            (ego_pose(float(t)) @ MOUNT).apply(p[None])[0]
            for p, t in zip(position_m, time_s, strict=True)
        ]
    )


def share_inside(points_m: Any, T_world_box: SE3, size_m: Any) -> float:
    """Share of points that are in a box or within 2 cm of it."""
    local = T_world_box.inverse().apply(points_m.astype(float))
    return float((np.abs(local) <= 0.5 * np.array(size_m) + 0.02).all(axis=1).mean())


def test_static_points_of_ply_files_lie_in_boxes(sample: Any, world: Any, tmp_path: Path) -> None:
    """``time_s`` of ``poses.jsonl`` plus ``time`` is the instant of a pulse."""
    folder = world.export(PointClouds(), drive_info(world), [sample], tmp_path)
    row = json.loads((folder / "top/poses.jsonl").read_text())
    points = read_ply(folder / "top/000000000.ply")
    mine = points[points["instance"] == CRATE]
    where = placed(np.stack([mine[a] for a in "xyz"], -1), row["time_s"] + mine["time"])
    box = next(box for box in row["boxes"] if box["instance"] == CRATE)
    T_world_box = SE3.from_matrix(np.array(row["T_world_lidar"])) @ SE3(
        tuple(box["center_m"]), tuple(box["quaternion_wxyz"])
    )
    assert len(mine) > 50
    assert share_inside(where, T_world_box, box["size_m"]) >= 0.99
    assert (row["point_time"], row["sweep_s"]) == ("sweep_middle", SWEEP_S)


def test_static_points_of_mcap_files_lie_in_cubes(sample: Any, world: Any, tmp_path: Path) -> None:
    """The stamp of the message plus ``time_s``; metadata state the base."""
    (path,) = world.export(Mcap(), drive_info(world), [sample], tmp_path).rglob("*.mcap")
    found = {topic: message for topic, _, _, message in messages(path)}
    with path.open("rb") as file:
        (facts,) = [m.metadata for m in make_reader(file).iter_metadata() if m.name == "gen-data"]
    cloud = found["/lidar/top/points"]
    # Sequences begin at 1 January 2020, 1,577,836,800 s.
    stamp_s = cloud.timestamp.seconds - 1_577_836_800 + cloud.timestamp.nanos * 1e-9
    points = sample.capture.clouds["top"].points
    (offset,) = [f.offset for f in cloud.fields if f.name == "time_s"]
    raw = np.frombuffer(cloud.data, np.uint8).reshape(-1, cloud.point_stride)
    time_s = raw[:, offset : offset + 4].copy().view("<f4")[:, 0]
    mine = points["instance_id"] == CRATE
    (entity,) = [e for e in found["/objects"].entities if e.id == str(CRATE)]
    (cube,) = entity.cubes
    p, q = cube.pose.position, cube.pose.orientation
    where = placed(points["position_m"][mine], stamp_s + time_s[mine])
    T_world_box = SE3((p.x, p.y, p.z), (q.w, q.x, q.y, q.z))
    size_m = (cube.size.x, cube.size.y, cube.size.z)
    assert share_inside(where, T_world_box, size_m) >= 0.99
    assert facts["point_time"] == "sweep_middle"


def test_times_may_count_from_the_sweeps_start(sample: Any, world: Any, tmp_path: Path) -> None:
    """Poses and boxes stay at its middle, ``time_s`` of the row."""
    chosen = PointClouds(point_time="sweep_start")
    folder = world.export(chosen, drive_info(world), [sample], tmp_path)
    row = json.loads((folder / "top/poses.jsonl").read_text())
    times = read_ply(folder / "top/000000000.ply")["time"]
    assert (row["time_s"], row["point_time"]) == (STAMP_S, "sweep_start")
    assert times.min() == 0.0
    assert times.max() == np.float32(SWEEP_S)
