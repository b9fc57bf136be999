"""Statistics of labelled pictures, against other libraries and formulas written out."""

import contextlib
import io
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image
from pycocotools.coco import COCO

from gen_data.core.errors import StorageError
from gen_data.lab.carry_over.statistics import HEIGHTS_PX, heights_per_picture, measure
from gen_data.lab.study.real_pictures import read_real
from tests.carry_over.labelled import HEIGHT_PX, WIDTH_PX, write_coco

NAMES = {"cup": "cup", "plate": "plate"}


def test_boxes_and_brightness_agree_with_pycocotools_and_pillow(tmp_path: Path) -> None:
    """All values of one class, in the order of the pictures."""
    write_coco(tmp_path, 1, pictures=6)
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO(tmp_path / "annotations/instances_all.json")
    pictures = read_real(tmp_path).pictures
    found = measure(pictures, range(6), NAMES)
    rows = [row for k in range(6) for row in coco.loadAnns(coco.getAnnIds(k, catIds=[1]))]
    x, y, w, h = np.array([row["bbox"] for row in rows]).T
    expected = {
        "long side": np.maximum(w, h) / WIDTH_PX,
        "height px": h,
        "width / height": w / h,
        "centre x": (x + w / 2) / WIDTH_PX,
        "centre y": (y + h / 2) / HEIGHT_PX,
        "count": [len(coco.getAnnIds(k, catIds=[1])) for k in range(6)],
        "area share": [
            sum(row["area"] for row in rows if row["image_id"] == k) / (WIDTH_PX * HEIGHT_PX)
            for k in range(6)
        ],
    }
    crops = []
    for row in rows:
        image = Image.open(tmp_path / f"images/{row['image_id']}.png").convert("L")
        left, top, width, height = row["bbox"]
        corners = (left, top, left + width, top + height)
        outer = (*map(math.floor, corners[:2]), *map(math.ceil, corners[2:]))
        crops.append(np.asarray(image.crop(outer)))
    expected["grey in box"] = [crop.mean() for crop in crops]
    expected["dark in box"] = [(crop < 25).mean() for crop in crops]
    for name, values in expected.items():
        np.testing.assert_allclose(found["plate", name].values, values, rtol=1e-5, err_msg=name)
    whole = [np.asarray(Image.open(p.path).convert("L")) for p in pictures]
    np.testing.assert_allclose(found["pictures", "grey"].values, [i.mean() for i in whole], 1e-5)
    dark = [(image < 25).mean() for image in whole]
    np.testing.assert_allclose(found["pictures", "dark share"].values, dark, rtol=1e-5)
    assert found["plate", "count"].units.tolist() == list(range(6))
    assert ("plate", "occlusion") not in found


def test_all_classes_together_have_the_values_of_each(tmp_path: Path) -> None:
    write_coco(tmp_path, 2, pictures=4)
    found = measure(read_real(tmp_path).pictures, range(4), NAMES)
    both = np.concatenate([found[name, "height px"].values for name in NAMES])
    every = found["all classes", "height px"].values
    np.testing.assert_array_equal(np.sort(every), np.sort(both))
    counts = [found[name, "count"].values for name in (*NAMES, "all classes")]
    np.testing.assert_array_equal(counts[0] + counts[1], counts[2])
    bins = np.digitize(found["plate", "height px"].values, HEIGHTS_PX)
    expected = [np.sum(bins == k) / 4 for k in range(1, len(HEIGHTS_PX))]
    assert heights_per_picture(found, "plate") == expected


# A scanner 0.3 m behind the camera and 0.1 m above it: X forward, Y left, Z up.
CALIB = """\
P2: 700 0 64 0 0 700 48 0 0 0 1 0
R0_rect: 1 0 0 0 1 0 0 0 1
Tr_velo_to_cam: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3
"""
CARS = ((1.5, 1.6, 4.0, 2.0, 1.7, 12.0, 0.3), (1.4, 1.8, 4.2, -5.0, 3.1, 22.0, -1.2))


def write_kitti(folder: Path) -> np.ndarray:
    """One frame with two cars, and points around them; returns the points of the scanner."""
    for name in ("image_2", "label_2", "velodyne", "calib"):
        (folder / name).mkdir()
    cv2.imwrite(str(folder / "image_2/000000.png"), np.full((96, 128, 3), 90, np.uint8))
    lines = (
        f"Car 0.25 {level} 0 10 20 49 59 " + " ".join(map(str, car))
        for level, car in enumerate(CARS)
    )
    (folder / "label_2/000000.txt").write_text("\n".join(lines) + "\n")
    (folder / "calib/000000.txt").write_text(CALIB)
    rng = np.random.default_rng(0)
    points = np.concatenate(
        [
            np.add([z + 0.3, -x, -y - 0.1], rng.uniform(-3, 3, (500, 3)))
            for _, _, _, x, y, z, _ in CARS
        ]
    ).astype("<f4")
    np.column_stack([points, np.zeros(len(points), "<f4")]).tofile(folder / "velodyne/000000.bin")
    return points.astype(float)


def points_in(car: tuple[float, ...], points: np.ndarray) -> int:
    """KITTI's devkit: a corner is ``R_y (x, y, z) + t`` with x in +-l/2, y in -h..0, z in +-w/2."""
    h, w, length, *place, turn = car
    matrix = np.array([[0, -1, 0, 0], [0, 0, -1, -0.1], [1, 0, 0, -0.3]])
    p_camera = points @ matrix[:, :3].T + matrix[:, 3]
    R_y = np.array(
        [[math.cos(turn), 0, math.sin(turn)], [0, 1, 0], [-math.sin(turn), 0, math.cos(turn)]]
    )
    x, y, z = R_y.T @ (p_camera - place).T
    return int(((abs(x) <= length / 2) & (abs(z) <= w / 2) & (y <= 0) & (y >= -h)).sum())


def test_boxes_in_space_and_points_in_them_follow_kittis_devkit(tmp_path: Path) -> None:
    """Columns h, w, l, x, y, z and the rotation about the camera's y axis."""
    points = write_kitti(tmp_path)
    found = measure(read_real(tmp_path).pictures, [0], {"Car": "car"})
    expected = {"height m": [1.5, 1.4], "width m": [1.6, 1.8], "length m": [4.0, 4.2],
                "bottom m": [1.7, 3.1], "distance m": [math.hypot(2, 12), math.hypot(5, 22)],
                "occlusion": [0, 1], "truncation": [0.25, 0.25], "long side": [40 / 128] * 2,
                "points 5-15 m": [points_in(CARS[0], points)],
                "points 15-30 m": [points_in(CARS[1], points)]}  # fmt: skip
    for name, values in expected.items():
        np.testing.assert_allclose(found["car", name].values, values, rtol=1e-6, err_msg=name)
    assert min(expected["points 5-15 m"] + expected["points 15-30 m"]) > 10
    assert ("car", "points 30-60 m") not in found


@pytest.mark.parametrize(
    ("text", "fact"),
    [("P2: 700 0 64 0 0 700 48 0 0 0 1 0\n", "has no Tr_velo_to_cam"),
     (None, "with its calibration")],
)  # fmt: skip
def test_a_scan_without_calibration_is_refused(text: str | None, fact: str, tmp_path: Path) -> None:
    write_kitti(tmp_path)
    calib = tmp_path / "calib/000000.txt"
    calib.unlink() if text is None else calib.write_text(text)
    with pytest.raises(StorageError, match=fact):
        measure(read_real(tmp_path).pictures, [0], {"Car": "car"})
