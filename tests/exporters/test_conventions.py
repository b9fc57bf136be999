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
from gen_data.exporters.point_cloud_io import xyzi_bytes
from gen_data.exporters.pointclouds import file_points


@pytest.mark.parametrize("name", TABLE.names())
def test_every_exporter_states_its_conventions(name: str) -> None:
    """Each in its own class: a convention of a relative may be another."""
    assert isinstance(vars(TABLE.load(name)).get("conventions"), Conventions)


def test_the_page_of_formats_has_the_table_of_today() -> None:
    """``python docs/conventions.py`` writes it."""
    text = page.PAGE.read_text("utf-8")

    assert page.with_table(text) == text


def test_laser_points_have_the_stated_intensities(world: Any, tmp_path: Path) -> None:
    """A retroreflector has 1 of 0 to 1, and 255 of 0 to 255."""
    points = np.zeros(2, POINT)
    points["intensity"] = [0.0, 1.0]
    written = {
        "nuscenes": np.frombuffer(lidar_bytes(points, 0), "<f4").reshape(-1, 5)[:, 3],
        "kitti": np.frombuffer(xyzi_bytes(points), "<f4").reshape(-1, 4)[:, 3],
        "pointclouds": file_points(points)["intensity"],
    }

    for name, intensity in written.items():
        low, high = TABLE.load(name).conventions.intensity.split(" to ")
        assert intensity.tolist() == [float(low), float(high)], name


@pytest.mark.parametrize("name", ["nuscenes", "pointclouds"])
def test_the_stated_laser_is_ring_0(name: str) -> None:
    """Stored rings count from the highest: 0 is above 31."""
    points = np.zeros(2, POINT)
    points["ring"], points["position_m"][:, 2] = [0, 31], [1.0, -1.0]
    rings = (
        np.frombuffer(lidar_bytes(points, 0), "<f4").reshape(-1, 5)[:, 4]
        if name == "nuscenes"
        else file_points(points)["ring"]
    )

    first = points["position_m"][np.argmin(rings), 2]

    assert {1.0: "highest laser", -1.0: "lowest laser"}[float(first)] == (
        TABLE.load(name).conventions.ring
    )


def test_files_with_room_repeat_the_statements(world: Any, tmp_path: Path) -> None:
    """COCO's ``info``, comments of PLY, and the card of Hugging Face."""
    info = world.info(7, lidars=("top",))

    def written(name: str) -> tuple[Path, dict[str, str]]:
        exporter = TABLE.load(name)()
        return world.export(exporter, info, world.samples, tmp_path / name), (
            exporter.conventions.facts()
        )

    coco, facts = written("coco")
    assert (
        json.loads((coco / "annotations/instances_train.json").read_text())["info"]["conventions"]
        == facts
    )
    clouds, facts = written("pointclouds")
    head = (clouds / "top/000000000.ply").read_bytes().split(b"end_header")[0].decode()
    assert all(f"comment {k}: {v}\n" in head for k, v in facts.items())
    cards, facts = written("huggingface")
    card = (cards / "README.md").read_text("utf-8")
    assert all(f"* {k}: {v}\n" in card for k, v in facts.items())


def test_hdf5_files_have_them_as_attributes(world: Any, tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    exporter = TABLE.load("hdf5")()
    folder = world.export(exporter, world.info(7), world.samples, tmp_path)

    with h5py.File(folder / "train/000000000_color.hdf5") as file:
        assert dict(file.attrs) == exporter.conventions.facts()
