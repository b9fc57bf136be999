"""Matrices and lenses that formats state, against geometry and OpenCV."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import h5py
import numpy as np
import pytest

from gen_data.core.capture import Channel
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.exporters import TABLE
from gen_data.exporters.hdf5 import fields_rad
from tests.exporters.bent import LENSES, bent_samples, opencv_rays
from tests.exporters.drives import calibration
from tests.exporters.label_readers import csv_rows, parquet, records

EYE_M = 1.6
"""Height of the level camera above the ground."""
POINTS_M = np.array([[0.1, 0.2, 1.0], [-0.6, 0.3, 1.2], [0.7, -0.5, 1.1], [0.0, 0.0, 3.0]])

Camera = tuple[Any, str, Any]
"""K [3, 3], and model and distortion of the lens; empty for formats of pinholes."""


def pinhole(fx: Any, fy: Any, cx: Any, cy: Any) -> Camera:
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], float), "", ()


def in_coco(folder: Path) -> Camera:
    """Key ``lens`` for bent ones, with the names of coefficients."""
    (image, *_) = json.loads((folder / "annotations/instances_train.json").read_text())["images"]
    lens = image.get("lens", {"model": "", "distortion": ()})
    if lens["model"] == "brown_conrady":
        assert lens["coefficients"] == ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]
    return image["K"], lens["model"], lens["distortion"]


def in_croissant(folder: Path) -> Camera:
    row = csv_rows(folder / "images.csv")[0]
    fields = json.loads((folder / "croissant.json").read_text())["recordSet"][0]["field"]
    assert ({"images/lens", "images/distortion"} <= {f["@id"] for f in fields}) == ("lens" in row)
    K, _, _ = pinhole(*(row[name] for name in ("fx", "fy", "cx", "cy")))
    return K, row.get("lens", ""), row.get("distortion", "").split()


def in_hdf5(folder: Path) -> Camera:
    """Keys ``K`` and ``lens``."""
    with h5py.File(min(folder.rglob("*.hdf5"))) as file:
        lens = json.loads(file["lens"][()]) if "lens" in file else {"model": "", "distortion": ()}
        return file["K"][()], lens["model"], lens["distortion"]


def in_parquet(folder: Path) -> Camera:
    """A struct ``lens`` for bent ones; the card names it."""
    row = parquet(min(folder.rglob("train*.parquet"))).to_pylist()[0]
    assert "`lens`" in (folder / "README.md").read_text()
    lens = row.get("lens", {"model": "", "distortion": ()})
    return row["K"], lens["model"], lens["distortion"]


def in_records(folder: Path) -> Camera:
    """Keys ``image/lens/...``, of single precision as all floats of the format."""
    record = records(min(folder.glob("train*.tfrecord")))[0]
    ((model,), distortion) = (
        record[key][1] if key in record else default
        for key, default in (("image/lens/model", [b""]), ("image/lens/distortion", []))
    )
    return record["image/intrinsics"][1], model.decode(), distortion


def document(path: Path, *names: str) -> Camera:
    """A pinhole whose focal lengths and centre have these names in a JSON file."""
    camera = json.loads(path.read_text())
    return pinhole(*(camera.get("intrinsic", camera)[name] for name in names))


def in_tum(folder: Path) -> Camera:
    lines = min(folder.rglob("calibration.txt")).read_text().splitlines()
    return pinhole(*next(line.split()[:4] for line in lines if not line.startswith("#")))


READERS: dict[str, Callable[[Path], Camera]] = {
    "bop": lambda f: document(f / "camera.json", "fx", "fy", "cx", "cy"),
    "cityscapes": lambda f: document(min(f.rglob("*_camera.json")), "fx", "fy", "u0", "v0"),
    "coco": in_coco,
    "croissant": in_croissant,
    "hdf5": in_hdf5,
    "huggingface": in_parquet,
    "kitti": lambda f: (
        calibration(f / "training/calib/000000.txt")["P2"].reshape(3, 4)[:, :3],
        "",
        (),
    ),
    "scannet": lambda f: (np.loadtxt(min(f.rglob("intrinsic_depth.txt")))[:3, :3], "", ()),
    "tfrecord": in_records,
    "tum_rgbd": in_tum,
}


@pytest.mark.parametrize("kind", READERS)
def test_the_ground_is_level_at_the_stated_pixels(kind: str, world: Any, tmp_path: Path) -> None:
    """Height of ground points below the camera: z (v - cy) / fy, with v of the pixel's centre."""
    exporter = TABLE.load(kind)()
    samples = world.with_bodies(world.samples)
    K, model, _ = READERS[kind](
        world.export(exporter, world.info(7, lidars=("top",)), samples, tmp_path)
    )
    K = np.reshape(np.array(K, float), (3, 3))
    centre = {"i": 0.0, "i + 0.5": 0.5}[exporter.conventions.pixel_centre]
    channels = world.samples[0].capture.readings["color"].channels
    rows, columns = np.nonzero(channels[Channel.INSTANCE] == 0)
    z_m = channels[Channel.Z_DEPTH][rows, columns]
    ground = np.isfinite(z_m)
    height_m = z_m[ground] * (rows[ground] + centre - K[1, 2]) / K[1, 1]
    assert ground.sum() > 1000
    np.testing.assert_allclose(height_m, EYE_M, rtol=1e-5)
    assert model in ("", "pinhole")


@pytest.mark.parametrize("model", LENSES)
@pytest.mark.parametrize("kind", ["coco", "croissant", "hdf5", "huggingface", "tfrecord"])
def test_opencv_projects_with_the_lens(kind: str, model: Any, world: Any, tmp_path: Path) -> None:
    """With K, and pixel centres where the format has them; to float32 where it holds no more."""
    exporter = TABLE.load(kind)()
    info = world.info(1, lenses={"color": model}, devices={})
    folder = world.export(exporter, info, bent_samples(world, model, 1), tmp_path)
    K, found, distortion = READERS[kind](folder)
    assert found == model
    module = cv2.fisheye if model == "kannala_brandt" else cv2
    points, still = POINTS_M.reshape(-1, 1, 3), np.zeros(3)
    K = np.reshape(np.array(K, float), (3, 3))
    image, _ = module.projectPoints(points, still, still, K, np.array(distortion, float))
    shift = {"i": 0.5, "i + 0.5": 0.0}[exporter.conventions.pixel_centre]
    true = LENSES[model].project(POINTS_M)
    np.testing.assert_allclose(image[:, 0] + shift, true, atol=1e-4 if kind == "tfrecord" else 1e-6)


def test_the_field_of_a_bent_camera_is_between_the_rays_of_its_edges() -> None:
    """In the row of the principal point, by OpenCV; 360 and 180 degrees for a panorama."""
    for k in LENSES.values():
        edges = np.array([0.0, k.width_px]) - 0.5
        left, right = opencv_rays(k, edges, np.full(2, k.cy_px - 0.5))
        expected = abs(np.arctan2(left[0], left[2])) + abs(np.arctan2(right[0], right[2]))
        assert fields_rad(k)[0] == pytest.approx(expected, abs=1e-6)
    k = Intrinsics.from_hfov(160, 80, 2 * np.pi, Lens("equirectangular"))
    np.testing.assert_allclose(fields_rad(k), [2 * np.pi, np.pi], atol=1e-6)
