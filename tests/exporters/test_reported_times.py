"""Formats state the times that wrong clocks report; labels are of the true instants."""

import json
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyarrow import feather

from gen_data.core.capture import Capture
from gen_data.core.sample import Sample
from gen_data.core.se3 import SE3
from gen_data.exporters import TABLE
from tests.exporters.drives import drive_info
from tests.exporters.label_readers import csv_rows, parquet, tar_samples
from tests.exporters.test_exporter_contract import files, given
from tests.exporters.test_mcap import messages
from tests.tiers import sampled

LATE_S = 0.1
"""Error of all clocks: a step of the drive, at which poses of the ego are known exactly."""


def late(sample: Sample) -> Sample:
    """The sample as sensors whose clocks are ahead report it."""

    def wrong(read: Any) -> Any:
        stamp_s = round(read.time_s + LATE_S, 9)
        return replace(read, faults={"clock": {"offset_s": LATE_S, "reported_s": stamp_s}})

    def rows(table: Any) -> Any:
        late_rows = table.rows.copy()
        late_rows["time_s"] = np.round(late_rows["time_s"] + LATE_S, 9)
        return replace(wrong(table), rows=late_rows)

    capture = sample.capture
    kinds = (capture.readings, wrong), (capture.clouds, wrong), (capture.tables, rows)
    return replace(
        sample, capture=Capture(*({n: f(r) for n, r in kind.items()} for kind, f in kinds))
    )


def found(folder: Path, pattern: str) -> list[Path]:
    paths = sorted(folder.rglob(pattern))
    assert paths, f"no file {pattern}"
    return paths


def loaded(folder: Path, pattern: str) -> Iterator[Any]:
    for path in found(folder, pattern):
        lines = path.suffix == ".jsonl"
        yield from map(json.loads, path.read_text().splitlines() if lines else [path.read_text()])


def values(document: Any, *keys: str) -> Iterator[float]:
    """Values of these keys at any depth."""
    items = document.items() if isinstance(document, dict) else enumerate(document)
    for key, value in items:
        if key in keys:
            yield float(value)
        elif isinstance(value, (dict, list)):
            yield from values(value, *keys)


def json_times(pattern: str, key: str = "time_s") -> Callable[[Path], list[float]]:
    return lambda folder: [t for document in loaded(folder, pattern) for t in values(document, key)]


def names(pattern: str, unit_s: float) -> Callable[[Path], list[float]]:
    return lambda folder: sorted(unit_s * float(path.stem) for path in found(folder, pattern))


def nuscenes(folder: Path) -> list[float]:
    tables = [json.loads(found(folder, name)[0].read_text())
              for name in ("sample.json", "sample_data.json", "ego_pose.json")]  # fmt: skip
    return [1e-6 * t for table in tables for t in values(table, "timestamp")]


def kitti_raw(folder: Path) -> list[float]:
    texts = [p for p in found(folder, "timestamps*.txt") if p.parent.name != "oxts"]
    times = [line.split()[1].split(":") for path in texts for line in path.read_text().splitlines()]
    return [3600.0 * int(h) + 60.0 * int(m) + float(s) for h, m, s in times]


def tum(folder: Path) -> list[float]:
    texts = [*found(folder, "rgb.txt"), *found(folder, "depth.txt")]
    lines = [line.split() for path in texts for line in path.read_text().splitlines()]
    listed = [(float(stamp), name) for stamp, name in (x for x in lines if x[0] != "#")]
    assert all(f"/{stamp:.6f}.png" in name for stamp, name in listed)
    return [stamp for stamp, _ in listed]


def mcap(folder: Path) -> list[float]:
    read = [m for path in found(folder, "*.mcap") for m in messages(path)]
    of_sensors = [m for t, _, _, m in read if t.startswith(("/camera", "/lidar"))]
    stamps = [m.timestamp for m in of_sensors if "timestamp" in m.DESCRIPTOR.fields_by_name]
    return sorted(stamp.seconds + 1e-9 * stamp.nanos for stamp in stamps)


def webdataset(folder: Path) -> list[float]:
    read = (labels["json"] for split in folder.iterdir() for labels in tar_samples(split))
    return [t for labels in read for t in values([labels["cameras"], labels["lidars"]], "time_s")]


def tables(folder: Path) -> list[float]:
    rows = (row for path in found(folder, "*.csv") for row in csv_rows(path))
    return [*json_times("poses.jsonl")(folder), *(float(row["time_s"]) for row in rows)]


def huggingface(folder: Path) -> list[float]:
    paths = found(folder, "*.parquet")
    return [t for path in paths for t in parquet(path)["time_s"].to_pylist()]


def argoverse2(folder: Path) -> list[float]:
    stamps = names("sensors/**/*.*", 1e-9)(folder)
    for table in ("annotations", "city_SE3_egovehicle"):
        for path in found(folder, f"{table}.feather"):
            stamps += [1e-9 * t for t in feather.read_table(path)["timestamp_ns"].to_pylist()]
    return stamps


@dataclass(frozen=True)
class Stamped:
    """A format with times of readings.

    Attributes:
        read: All these times in an export [s].
        within: Patterns of the files whose content depends on them; others depend on them by name.
    """

    read: Callable[[Path], list[float]]
    within: tuple[str, ...] = ()


STAMPED = {
    "argoverse2": Stamped(argoverse2, ("*annotations.feather", "*city_SE3_egovehicle.feather")),
    "coco": Stamped(json_times("*.json"), ("*.json",)),
    "huggingface": Stamped(huggingface, ("*.parquet",)),
    "kitti_raw": Stamped(kitti_raw, ("*timestamps*.txt",)),
    "lidar_flow": Stamped(names("av2/**/*.feather", 1e-9)),
    "mcap": Stamped(mcap, ("*.mcap",)),
    "nuscenes": Stamped(nuscenes, ("*sample.json", "*sample_data.json", "*ego_pose.json")),
    "pointclouds": Stamped(json_times("poses.jsonl"), ("*poses.jsonl",)),
    "semantickitti": Stamped(
        lambda folder: [
            float(t) for p in found(folder, "times.txt") for t in p.read_text().split()
        ],
        ("*times.txt",),
    ),
    "solo": Stamped(json_times("*.frame_data.json", "timestamp"), ("*.frame_data.json",)),
    "tables": Stamped(tables, ("*.csv", "*poses.jsonl")),
    "tum_rgbd": Stamped(tum, ("*rgb.txt", "*depth.txt")),
    "webdataset": Stamped(webdataset, ("*.tar",)),
}
OF_SAMPLES = {
    "birdseye": "of the map",
    "kitti_tracking": "number of a frame",
    "lerobot": "number of a frame over the rate",
    "map_vectors": "of the map",
    "motchallenge": "number of a frame",
    "occupancy": "of the voxels",
    "rerun": "true times; faults/ has the reported ones",
    "usd": "number of a step",
}
"""Formats whose times are not of readings."""


def test_every_format_with_times_is_in_one_of_these_tables() -> None:
    stated = {name for name in TABLE.names() if TABLE.load(name).conventions.time}
    assert stated == STAMPED.keys() | OF_SAMPLES.keys()


def exports(name: str, world: Any, folder: Path) -> tuple[Path, Path]:
    """A data set with true clocks and the same one with clocks that are ahead."""
    exporter = TABLE.load(name)(**({"layouts": ("av2",)} if name == "lidar_flow" else {}))
    own = name not in STAMPED or name in ("argoverse2", "tables", "lidar_flow")
    info, samples = given(exporter, world) if own else (drive_info(world), world.drive())
    clean = world.export(exporter, info, samples, folder / "clean")
    return clean, world.export(exporter, info, [late(s) for s in samples], folder / "late")


@pytest.mark.parametrize("name", sampled(STAMPED, 2))
def test_times_of_readings_are_the_reported_ones_and_nothing_else_differs(
    name: str, world: Any, tmp_path: Path
) -> None:
    clean, wrong = exports(name, world, tmp_path)
    stamps = STAMPED[name].read(clean)
    assert len(stamps) > 3
    assert STAMPED[name].read(wrong) == pytest.approx(
        [t + LATE_S for t in stamps], abs=2e-6, rel=1e-12
    )

    def contents(folder: Path) -> Counter[bytes]:
        listed = files(folder).items()
        patterns = STAMPED[name].within
        return Counter(d for n, d in listed if not any(fnmatchcase(n, p) for p in patterns))

    assert contents(wrong) == contents(clean)


@pytest.mark.parametrize("name", sampled([n for n in TABLE.names() if n not in STAMPED], 6))
def test_wrong_clocks_leave_other_formats_as_they_are(
    name: str, world: Any, tmp_path: Path
) -> None:
    clean, wrong = exports(name, world, tmp_path)
    if name == "rerun":
        texts = pytest.importorskip("tests.exporters.test_rerun").tables
        for path in found(wrong, "*.rrd"):
            read, before = (texts(p) for p in (path, clean / path.relative_to(wrong)))
            faults = {entity for entity in read if entity.startswith("/faults/")}
            assert faults == {"/faults/color", "/faults/imu", "/faults/top"}
            assert {e: str(t) for e, t in read.items() if e not in faults} == {
                e: str(t) for e, t in before.items()
            }
            for text in read["/faults/color"]["TextDocument:text"].values():
                assert json.loads(text[0])["clock"]["reported_s"] == LATE_S
        return
    assert files(wrong) == files(clean)


def test_labels_of_nuscenes_are_true_and_its_ego_is_where_it_was_at_the_stamp(
    world: Any, tmp_path: Path
) -> None:
    """The drive's circle, which begins at the origin, is the closed form of the trajectory."""
    clean, wrong = exports("nuscenes", world, tmp_path)
    poses, before = (
        json.loads(found(folder, "ego_pose.json")[0].read_text()) for folder in (wrong, clean)
    )
    first_us = min(pose["timestamp"] for pose in before)
    (begin,) = {tuple(p["translation"]) for p in before if p["timestamp"] == first_us}
    times_s = [1e-6 * (pose["timestamp"] - first_us) for pose in poses]
    assert min(times_s) == pytest.approx(LATE_S)
    near = [(t, p["translation"]) for t, p in zip(times_s, poses, strict=True) if t < 1.0]
    assert len(near) == 12
    for time_s, place in near:
        expected = np.add(begin, world.ego_pose(time_s).translation_m)
        assert place == pytest.approx(expected, abs=1e-5)


def test_boxes_of_argoverse_fit_the_points_and_the_city_has_the_true_trajectory(
    world: Any, tmp_path: Path
) -> None:
    clean, wrong = exports("argoverse2", world, tmp_path)

    def rows(folder: Path, table: str) -> list[dict[str, Any]]:
        return list(feather.read_table(found(folder, f"{table}.feather")[0]).to_pylist())

    def without_times(listed: list[dict[str, Any]]) -> list[dict[str, Any]]:
        return [{k: v for k, v in row.items() if k != "timestamp_ns"} for row in listed]

    boxes = (without_times(rows(folder, "annotations")) for folder in (clean, wrong))
    assert next(boxes) == next(boxes)
    before = {row["timestamp_ns"]: row for row in rows(clean, "city_SE3_egovehicle")}
    after = {row["timestamp_ns"]: row for row in rows(wrong, "city_SE3_egovehicle")}
    common = before.keys() & after.keys()
    assert len(common) == 3
    for time_ns in common:
        assert after[time_ns] == pytest.approx(before[time_ns], abs=2e-6)


def test_transforms_of_mcap_are_true_at_the_reported_times(world: Any, tmp_path: Path) -> None:
    _, wrong = exports("mcap", world, tmp_path)
    read = messages(found(wrong, "*.mcap")[0])
    begin_ns = min(log_ns for topic, _, log_ns, _ in read if topic == "/objects")
    transforms = [(log_ns, m) for topic, _, log_ns, m in read if topic == "/tf"]
    rigs = {ns: m for ns, m in transforms if m.child_frame_id == "rig/ego"}
    scans = [(ns, m.timestamp) for topic, _, ns, m in read if topic == "/lidar/top/points"]
    stamps = {stamp.seconds * 10**9 + stamp.nanos for _, stamp in scans}
    # They arrive at their true instants.
    assert {log_ns + 10**8 for log_ns, _ in scans} == stamps
    assert len(stamps) == 4
    assert stamps <= rigs.keys()
    for time_ns, message in rigs.items():
        expected: SE3 = world.ego_pose(1e-9 * (time_ns - begin_ns))
        place = (message.translation.x, message.translation.y, message.translation.z)
        assert place == pytest.approx(expected.translation_m, abs=2e-6)
