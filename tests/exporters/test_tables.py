"""Rows of devices as files that spreadsheets and NumPy read."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.errors import StorageError
from gen_data.core.interfaces import Modality, SensorInfo, table_path
from gen_data.exporters.image_files import write_media
from gen_data.exporters.measurement_tables import Tables, read_rows
from gen_data.sensors.navigation.imu import Imu
from tests.exporters.label_readers import csv_rows, json_lines

IMU = SensorInfo("imu", Modality.DEVICE, "imu", columns=Imu.columns)


def test_csv_holds_every_digit_that_counts_by_sequence(world: Any, tmp_path: Path) -> None:
    """All that was measured is read back, row by row, with the index of its sample."""
    folder = world.export(Tables(), world.info(7, steps_per_scene=2), world.samples, tmp_path)
    rows = csv_rows(folder / "imu/000001.csv")
    assert [int(row["sample"]) for row in rows] == [2, 2, 2, 3, 3, 3]
    assert [float(row["force_x_m_s2"]) for row in rows[:3]] == [0.0, 1.0 / 3.0, -2.5e-7]
    assert rows[0]["time_s"] == "0.2"
    assert list(rows[0]) == ["sample", *(column.name for column in Imu.columns)]
    # Seven samples in sequences of two and shards of three.
    names = sorted(path.name for path in (folder / "imu").glob("*.csv"))
    assert names == ["000000.csv", "000001.csv", "000002.csv", "000003.csv"]
    lengths = [len((folder / "imu" / name).read_text().splitlines()) for name in names]
    assert lengths == [7, 7, 7, 4]


def test_numpy_files_hold_the_same_rows(world: Any, tmp_path: Path) -> None:
    info = world.info(7, steps_per_scene=7)
    folder = world.export(Tables(format="npy"), info, world.samples, tmp_path)
    rows = np.load(folder / "imu/000000.npy")
    measured = np.concatenate([s.capture.tables["imu"].rows for s in world.samples])
    assert rows["sample"].tolist() == [k for k in range(7) for _ in range(3)]
    for name in measured.dtype.names:
        assert np.array_equal(rows[name], measured[name])


def test_columns_and_poses_are_told(world: Any, tmp_path: Path) -> None:
    """The meaning of each column, and the place of the device."""
    folder = world.export(Tables(), world.info(7), world.samples, tmp_path)
    columns = json.loads((folder / "columns.json").read_text())["imu"]
    poses = json_lines(folder / "imu/poses.jsonl")
    assert columns["kind"] == "imu"
    assert all(column["meaning"] for column in columns["columns"])
    assert [pose["index"] for pose in poses] == list(range(7))
    assert poses[3]["T_world_device"][2][3] == 0.5
    assert poses[3]["model"] == "RT3003"


def test_a_device_may_skip_samples(world: Any, tmp_path: Path) -> None:
    """One that is slower than the sequence leaves no rows and no pose between its readings."""
    info, exporter = world.info(7, steps_per_scene=7), Tables()
    for sample in world.samples[:4]:
        write_media(info, sample, tmp_path)
    table_path(tmp_path, "imu", 2).unlink()
    exporter.write_shard(info, world.samples[:4], tmp_path)
    exporter.finalize(info, [tmp_path], tmp_path / "dataset")
    lines = (tmp_path / "dataset/imu/000000.csv").read_text().splitlines()
    assert sorted({line.split(",")[0] for line in lines[1:]}) == ["0", "1", "3"]
    assert len((tmp_path / "dataset/imu/poses.jsonl").read_text().splitlines()) == 3


def test_damaged_rows_are_named(tmp_path: Path) -> None:
    path = tmp_path / "000000000.npy"
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(StorageError, match=r"000000000\.npy"):
        read_rows(path, IMU)
    np.save(path, np.zeros(3))
    with pytest.raises(StorageError, match=r"no rows of kind .imu"):
        read_rows(path, IMU)
