"""Exporters state their conventions; page and files repeat them, and the numbers follow them."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from docs import conventions as page
from gen_data.core.capture import POINT, Channel
from gen_data.exporters import TABLE
from gen_data.exporters.conventions import Conventions
from gen_data.exporters.nuscenes_files import lidar_bytes
from gen_data.exporters.point_cloud_io import xyzi_bytes
from gen_data.exporters.pointclouds import file_points
from tests.exporters.drives import calibration

EYE_M = 1.6
"""Height of the level camera above the ground."""


@pytest.mark.parametrize("name", TABLE.names())
def test_every_exporter_states_its_conventions(name: str) -> None:
    """Each in its own class: a convention of a relative may be another."""
    assert isinstance(vars(TABLE.load(name)).get("conventions"), Conventions)


def test_the_page_of_formats_has_the_table_of_today() -> None:
    """``python docs/conventions.py`` writes it."""
    text = page.PAGE.read_text("utf-8")

    assert page.with_table(text) == text


def _json(path: Path) -> Any:
    return json.loads(path.read_text("utf-8"))


def _numbers(path: Path) -> list[float]:
    return [float(word) for word in path.read_text().split()]


def _kitti(folder: Path) -> tuple[float, float]:
    matrix = calibration(folder / "training/calib/000000.txt")["P2"].reshape(3, 4)
    return matrix[1, 1], matrix[1, 2]


def _coco(folder: Path) -> tuple[float, float]:
    K = _json(folder / "annotations/instances_train.json")["images"][0]["K"]
    return K[1][1], K[1][2]


def _hdf5(folder: Path) -> tuple[float, float]:
    K = np.load(folder / "train/000000000_color.npz")["K"]
    return K[1, 1], K[1, 2]


def _croissant(folder: Path) -> tuple[float, float]:
    with (folder / "images.csv").open() as file:
        row = next(csv.DictReader(file))
    return float(row["fy"]), float(row["cy"])


def _bop(folder: Path) -> tuple[float, float]:
    camera = _json(folder / "camera.json")
    return camera["fy"], camera["cy"]


def _cityscapes(folder: Path) -> tuple[float, float]:
    camera = _json(min(folder.rglob("*_camera.json")))["intrinsic"]
    return camera["fy"], camera["v0"]


def _tum_rgbd(folder: Path) -> tuple[float, float]:
    lines = min(folder.rglob("calibration.txt")).read_text().splitlines()
    fx_fy_cx_cy = next(line.split() for line in lines if not line.startswith("#"))
    return float(fx_fy_cx_cy[1]), float(fx_fy_cx_cy[3])


def _scannet(folder: Path) -> tuple[float, float]:
    numbers = _numbers(min(folder.rglob("intrinsic_depth.txt")))
    return numbers[5], numbers[6]


def _huggingface(folder: Path) -> tuple[float, float]:
    from pyarrow import parquet

    K = parquet.read_table(min(folder.rglob("train*.parquet")))["K"][0].as_py()
    return K[4], K[5]


VERTICAL: Mapping[str, Callable[[Path], tuple[float, float]]] = {
    "bop": _bop,
    "cityscapes": _cityscapes,
    "coco": _coco,
    "croissant": _croissant,
    "hdf5": _hdf5,
    "huggingface": _huggingface,
    "kitti": _kitti,
    "scannet": _scannet,
    "tum_rgbd": _tum_rgbd,
}
"""Readers of vertical focal length and principal point by format."""


@pytest.mark.parametrize("name", VERTICAL)
def test_the_ground_is_level_where_pixels_are_as_stated(
    name: str, world: Any, tmp_path: Path
) -> None:
    """Height of ground points below the camera: z (v - cy) / fy, with v of the pixel's centre."""
    options = {"container": "npz"} if name == "hdf5" else {}
    exporter = TABLE.load(name).model_validate({"type": name, **options})
    samples = world.with_bodies(world.samples) if name == "bop" else world.samples
    folder = world.export(exporter, world.info(7, lidars=("top",)), samples, tmp_path)
    fy, cy = VERTICAL[name](folder)
    centre = {"i": 0.0, "i + 0.5": 0.5}[exporter.conventions.pixel_centre]
    channels = world.samples[0].capture.readings["color"].channels
    rows, columns = np.nonzero(channels[Channel.INSTANCE] == 0)
    z_m = channels[Channel.Z_DEPTH][rows, columns]
    ground = np.isfinite(z_m)

    height_m = z_m[ground] * (rows[ground] + centre - cy) / fy

    assert ground.sum() > 1000
    np.testing.assert_allclose(height_m, EYE_M, rtol=1e-5)


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
    assert _json(coco / "annotations/instances_train.json")["info"]["conventions"] == facts
    clouds, facts = written("pointclouds")
    head = (clouds / "top/000000000.ply").read_bytes().split(b"end_header")[0].decode()
    assert all(f"comment {k}: {v}\n" in head for k, v in facts.items())
    cards, facts = written("huggingface")
    card = (cards / "README.md").read_text("utf-8")
    assert all(f"* {k}: {v}\n" in card for k, v in facts.items())


def test_hdf5_files_have_them_as_attributes(world: Any, tmp_path: Path) -> None:
    """Of the file itself."""
    h5py = pytest.importorskip("h5py")
    exporter = TABLE.load("hdf5")()
    folder = world.export(exporter, world.info(7), world.samples, tmp_path)

    with h5py.File(folder / "train/000000000_color.hdf5") as file:
        assert dict(file.attrs) == exporter.conventions.facts()
