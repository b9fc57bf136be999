"""Formats whose images are rectified refuse cameras that are not; others state the lens with K."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from tfrecord import example_pb2
from tfrecord.reader import tfrecord_iterator

from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.exporters import TABLE
from gen_data.exporters.hdf5 import fields_rad
from tests.exporters.bent import LENSES, bent_samples, opencv_rays

POINTS_M = np.array([[0.1, 0.2, 1.0], [-0.6, 0.3, 1.2], [0.7, -0.5, 1.1], [0.0, 0.0, 3.0]])


def opencv_image(model: str, K: Any, distortion: Any) -> Any:
    """Image of ``POINTS_M`` by OpenCV, with pixel centres where K has them, [n, 2]."""
    points, still = POINTS_M.reshape(-1, 1, 3), np.zeros(3)
    module = cv2.fisheye if model == "kannala_brandt" else cv2
    K, D = np.array(K, float).reshape(3, 3), np.array(distortion, float)
    return module.projectPoints(points, still, still, K, D)[0][:, 0]


@pytest.fixture(params=["brown_conrady", "kannala_brandt"])
def model(request: pytest.FixtureRequest) -> str:
    """Lenses with OpenCV's coefficients."""
    return str(request.param)


def written(world: Any, kind: str, model: Any, folder: Path) -> tuple[Path, Any]:
    """A data set of one bent camera in a format, and the image of ``POINTS_M`` in it."""
    samples = bent_samples(world, model, 1)
    info = world.info(1, lenses={"color": model}, devices={})
    exporter = TABLE.load(kind).model_validate({"type": kind})
    return world.export(exporter, info, samples, folder), LENSES[model].project(POINTS_M)


def test_hdf5_has_the_lens_of_a_bent_camera(world: Any, model: str, tmp_path: Path) -> None:
    """OpenCV's function with K and ``distortion``; pixel centres at whole numbers, as K."""
    h5py = pytest.importorskip("h5py")
    folder, true = written(world, "hdf5", model, tmp_path)
    with h5py.File(next(folder.rglob("*.hdf5"))) as file:
        lens, K = json.loads(file["lens"][()]), file["K"][()]
        pose = json.loads(file["campose"][()])[0]
    assert lens["model"] == model
    np.testing.assert_allclose(opencv_image(model, K, lens["distortion"]) + 0.5, true, atol=1e-6)

    k = LENSES[model]
    # From the left edge of the image to the right one, in the row of the principal point.
    edges = np.array([0.0, k.width_px]) - 0.5
    left, right = opencv_rays(k, edges, np.full(2, k.cy_px - 0.5))
    expected = abs(np.arctan2(left[0], left[2])) + abs(np.arctan2(right[0], right[2]))
    assert pose["fov_x"] == pytest.approx(expected, abs=1e-6)


def test_huggingface_has_the_lens_of_a_bent_camera(world: Any, model: str, tmp_path: Path) -> None:
    """A struct ``lens``; pixel centres at i + 0.5, as K."""
    pq = pytest.importorskip("pyarrow.parquet")
    folder, true = written(world, "huggingface", model, tmp_path)
    (row,) = pq.read_table(next(folder.rglob("*.parquet"))).to_pylist()
    assert row["lens"]["model"] == model
    np.testing.assert_allclose(
        opencv_image(model, row["K"], row["lens"]["distortion"]), true, atol=1e-6
    )
    assert "`lens`" in (folder / "README.md").read_text()


def test_tfrecord_has_the_lens_of_a_bent_camera(world: Any, model: str, tmp_path: Path) -> None:
    """Keys ``image/lens/...``, of single precision as all floats of the format."""
    pytest.importorskip("google_crc32c")
    folder, true = written(world, "tfrecord", model, tmp_path)
    (record,) = tfrecord_iterator(str(next(folder.glob("*.tfrecord"))))
    example = example_pb2.Example()
    example.ParseFromString(bytes(record))
    values = example.features.feature
    assert list(values["image/lens/model"].bytes_list.value) == [model.encode()]
    K, distortion = (
        values[f"image/{name}"].float_list.value for name in ("intrinsics", "lens/distortion")
    )
    image = opencv_image(model, K, distortion)
    np.testing.assert_allclose(image, true, atol=1e-4)


def test_croissant_has_the_lens_of_a_bent_camera(world: Any, model: str, tmp_path: Path) -> None:
    """Columns ``lens`` and ``distortion``, described in the metadata."""
    folder, true = written(world, "croissant", model, tmp_path)
    (row,) = csv.DictReader(io.StringIO((folder / "images.csv").read_text()))
    assert row["lens"] == model
    fx, fy, cx, cy = (float(row[name]) for name in ("fx", "fy", "cx", "cy"))
    image = opencv_image(model, [fx, 0, cx, 0, fy, cy, 0, 0, 1], row["distortion"].split())
    np.testing.assert_allclose(image, true, atol=1e-6)
    fields = json.loads((folder / "croissant.json").read_text())["recordSet"][0]["field"]
    assert {"images/lens", "images/distortion"} <= {f["@id"] for f in fields}


def test_the_field_of_a_panorama_is_all_around(world: Any) -> None:
    """``fov_x`` of 360 degrees, ``fov_y`` of 180."""
    lens = Lens("equirectangular")
    k = Intrinsics.from_hfov(160, 80, 2 * np.pi, lens)
    np.testing.assert_allclose(fields_rad(k), [2 * np.pi, np.pi], atol=1e-6)
