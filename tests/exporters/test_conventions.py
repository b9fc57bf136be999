"""Exporters state their conventions; page and files repeat them, and the numbers follow them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from docs import conventions as page
from gen_data.core.capture import POINT
from gen_data.exporters import TABLE
from gen_data.exporters.conventions import Conventions
from gen_data.exporters.nuscenes_files import lidar_bytes
from gen_data.exporters.pointclouds import file_points
from gen_data.exporters.velodyne import scan_bytes


def test_every_exporter_states_its_conventions_and_the_page_has_their_table() -> None:
    """Each in its own class: a convention of a relative may be another.

    ``python docs/conventions.py`` writes the page.
    """
    for name in TABLE.names():
        assert isinstance(vars(TABLE.load(name)).get("conventions"), Conventions), name
    text = page.PAGE.read_text("utf-8")
    assert page.with_table(text) == text


def test_laser_points_have_the_stated_intensities_and_rings() -> None:
    """A retroreflector has 1 of 0 to 1, and 255 of 0 to 255; rings count from the highest."""
    points = np.zeros(2, POINT)
    points["intensity"] = [0.0, 1.0]
    written = {"nuscenes": np.frombuffer(lidar_bytes(points, 0), "<f4").reshape(-1, 5)[:, 3],
               "kitti": np.frombuffer(scan_bytes(points), "<f4").reshape(-1, 4)[:, 3],
               "pointclouds": file_points(points)["intensity"]}  # fmt: skip
    for name, intensity in written.items():
        low, high = TABLE.load(name).conventions.intensity.split(" to ")
        assert intensity.tolist() == [float(low), float(high)], name
    points = np.zeros(2, POINT)
    points["ring"], points["position_m"][:, 2] = [0, 31], [1.0, -1.0]
    rows = np.frombuffer(lidar_bytes(points, 0), "<f4").reshape(-1, 5)
    for name, rings in (("nuscenes", rows[:, 4]), ("pointclouds", file_points(points)["ring"])):
        first = float(points["position_m"][np.argmin(rings), 2])
        stated = TABLE.load(name).conventions.ring
        assert {1.0: "highest laser", -1.0: "lowest laser"}[first] == stated


def test_files_with_room_repeat_the_statements(world: Any, tmp_path: Path) -> None:
    """COCO's ``info``, comments of PLY, the card of Hugging Face and attributes of HDF5."""
    info = world.info(7, lidars=("top",))

    def written(name: str) -> tuple[Path, dict[str, str]]:
        exporter = TABLE.load(name)()
        return world.export(exporter, info, world.samples, tmp_path / name), (
            exporter.conventions.facts()
        )

    coco, facts = written("coco")
    truth = json.loads((coco / "annotations/instances_train.json").read_text())
    assert truth["info"]["conventions"] == facts
    clouds, facts = written("pointclouds")
    head = (clouds / "top/000000000.ply").read_bytes().split(b"end_header")[0].decode()
    assert all(f"comment {k}: {v}\n" in head for k, v in facts.items())
    cards, facts = written("huggingface")
    card = (cards / "README.md").read_text("utf-8")
    assert all(f"* {k}: {v}\n" in card for k, v in facts.items())
    boxes, facts = written("hdf5")
    with pytest.importorskip("h5py").File(boxes / "train/000000000_color.hdf5") as file:
        assert dict(file.attrs) == facts
