"""Folders of recordings: what is read, and what is skipped with which reason."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from gen_data.core.capture import POINT
from gen_data.core.errors import StorageError
from gen_data.exporters.pointclouds import file_points, pcd_bytes, ply_bytes
from gen_data.lab.matching import real_files
from gen_data.lab.matching.inventory_table import inventory_rows
from gen_data.lab.matching.point_files import read_point_file


def save(path: Path, width: int = 96, height: int = 80, mode: str = "RGB", **options: int) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new(mode, (width, height), 100).save(path, **options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_photographs_are_read_and_all_else_is_counted_with_reasons(tmp_path: Path) -> None:
    """Damaged, tiny, grey and label images; depth folders and second links are no photographs."""
    save(tmp_path / "a.png")
    save(tmp_path / "deep" / "b.JPG", width=200, quality=80)
    save(tmp_path / "tiny.png", width=20)
    save(tmp_path / "grey.png", mode="L")
    save(tmp_path / "labels.png", mode="I;16")
    save(tmp_path / "cam" / "depth" / "c.png")
    (tmp_path / "broken.jpg").write_bytes(b"\xff\xd8 no image")
    (tmp_path / "linked.png").hardlink_to(tmp_path / "a.png")
    inventory = real_files.Inventory()
    photos = list(real_files.read_photos(real_files.find_files(tmp_path), 100, inventory))
    assert [photo.name for photo in photos] == ["a.png", "deep/b.JPG"]
    assert photos[0].quantisation is None
    assert photos[1].quantisation is not None
    assert photos[1].size_px == (200, 80)
    assert inventory.used["photographs"] == 2
    reasons = {why.split(" (")[0]: n for (_, why), n in inventory.skipped.items()}
    assert reasons == {
        "unreadable image": 1,
        "smaller than 64 px": 1,
        "without colours": 1,
        "a label or depth image": 1,
    }
    table = inventory_rows(inventory)
    assert table[0] == ("photographs", "6", "2", "4", "1 of 96 x 80 px, 1 of 200 x 80 px")


def test_large_photographs_are_cropped_to_their_middle_on_the_grid_of_jpeg(tmp_path: Path) -> None:
    """Four megapixels remain; the size of the whole is kept."""
    save(tmp_path / "large.png", width=4000, height=3000)
    (photo,) = real_files.read_photos(real_files.find_files(tmp_path), 1, real_files.Inventory())
    assert photo.size_px == (4000, 3000)
    assert 3.9e6 < photo.rgb.shape[0] * photo.rgb.shape[1] <= 4.0e6
    assert photo.rgb.shape[0] % 8 == photo.rgb.shape[1] % 8 == 0


def test_a_limit_chooses_files_evenly_and_folders_without_any_are_refused(tmp_path: Path) -> None:
    """From the first on, at equal distances. The message names what was expected."""
    files = [Path(str(k)) for k in range(10)]
    assert real_files.choose_evenly(files, 4) == [files[0], files[2], files[5], files[7]]
    assert real_files.choose_evenly(files, 100) == files
    with pytest.raises(StorageError, match="is not a folder"):
        real_files.find_files(tmp_path / "absent")
    (tmp_path / "notes.txt").write_text("nothing")
    with pytest.raises(
        StorageError, match=r"holds no photographs \(.*\.png.*\) and no laser scans"
    ):
        real_files.find_files(tmp_path)


def test_a_photograph_that_is_gone_is_counted(tmp_path: Path) -> None:
    """Removed after the folder was listed."""
    save(tmp_path / "a.png")
    files, inventory = real_files.find_files(tmp_path), real_files.Inventory()
    (tmp_path / "a.png").unlink()
    assert list(real_files.read_photos(files, 9, inventory)) == []
    assert inventory.skipped == {("photographs", "No such file or directory"): 1}


def test_photographs_in_floating_point_are_read(tmp_path: Path) -> None:
    """A TIFF of three colours, which Pillow does not open; it ended the command."""
    cv2.imwrite(str(tmp_path / "a.tif"), np.full((80, 96, 3), (0.2, 0.4, 1.0), np.float32))
    (photo,) = real_files.read_photos(real_files.find_files(tmp_path), 9, real_files.Inventory())
    assert (photo.rgb[0, 0].tolist(), photo.quantisation) == ([255, 102, 51], None)


def test_pictures_and_films_in_other_formats_are_counted_with_a_remedy(tmp_path: Path) -> None:
    """As telephones and cameras name them, next to a JPEG that is read."""
    for name in ("IMG_1.HEIC", "IMG_2.heic", "IMG_1.MOV", "_DSC1.NEF", "notes.txt"):
        (tmp_path / name).write_bytes(b"content")
    reasons = {
        "HEIC files are not read: save them as JPEG or PNG": 2,
        "MOV files are not read: save their frames as PNG": 1,
        "NEF files are not read: develop them to JPEG or TIFF": 1,
    }
    with pytest.raises(StorageError) as refused:
        real_files.find_files(tmp_path)
    assert all(f"; {count} {why}" in str(refused.value) for why, count in reasons.items())
    save(tmp_path / "_DSC1.JPG")
    inventory = real_files.Inventory()
    photos = list(real_files.read_photos(real_files.find_files(tmp_path), 100, inventory))
    assert [photo.name for photo in photos] == ["_DSC1.JPG"]
    assert inventory.skipped == {("photographs", why): n for why, n in reasons.items()}
    assert inventory_rows(inventory)[0][:4] == ("photographs", "5", "1", "4")


def points(n: int = 200) -> np.ndarray:
    rng = np.random.default_rng(1)
    made = np.zeros(n, POINT)
    made["position_m"] = rng.normal(0.0, 10.0, (n, 3))
    made["intensity"] = rng.random(n)
    return made


@pytest.mark.parametrize("name", ["scan.ply", "scan.pcd", "scan.bin", "scan.pcd.bin", "scan.npy"])
def test_scans_of_every_format_have_the_same_points(tmp_path: Path, name: str) -> None:
    """Ranges and intensities of our exporters' files, of KITTI's and of nuScenes' layout."""
    made = points()
    flat = np.column_stack([made["position_m"], made["intensity"]]).astype("<f4")
    if name.endswith(".npy"):
        np.save(tmp_path / name, made)
    elif name.endswith("ply"):
        (tmp_path / name).write_bytes(ply_bytes(file_points(made), {}))
    elif name.endswith(".pcd"):
        (tmp_path / name).write_bytes(pcd_bytes(file_points(made), {}))
    else:
        ring = np.zeros((len(flat), 1), "<f4")
        five = np.hstack([flat, ring]) if name == "scan.pcd.bin" else flat
        (tmp_path / name).write_bytes(five.astype("<f4").tobytes())
    (scan,) = real_files.read_scans(real_files.find_files(tmp_path), 10, real_files.Inventory())
    np.testing.assert_allclose(scan.range_m, np.linalg.norm(flat[:, :3], axis=1), rtol=1e-5)
    np.testing.assert_allclose(scan.intensity, flat[:, 3], rtol=1e-5)


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.bin", b"\0" * 30, "30 bytes are not 4 float32 a point"),
        ("a.ply", b"ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\n"
         b"end_header\n", "encoded as binary_big_endian"),
        ("a.ply", b"solid", "no header of PLY"),
        ("a.pcd", b"VERSION 0.7\n", "a PCD file without DATA"),
        ("a.pcd", b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n",
         "expected x, y, z and intensity"),
        ("a.pcd", b"FIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nPOINTS 9\nDATA binary\n1",
         "shorter than its 9 points"),
    ],
)  # fmt: skip
def test_damaged_scans_state_why(tmp_path: Path, name: str, content: bytes, reason: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=reason):
        read_point_file(tmp_path / name)


def test_bytes_of_intensity_become_shares(tmp_path: Path) -> None:
    """Devices report 0 to 255, KITTI's files 0 to 1."""
    flat = np.ones((200, 4), "<f4") * 51.0
    flat.tofile(tmp_path / "a.bin")
    inventory = real_files.Inventory()
    (scan,) = real_files.read_scans(real_files.find_files(tmp_path), 10, inventory)
    np.testing.assert_allclose(scan.intensity, 0.2)
    assert inventory.notes["scans"] == "intensities of 1 divided by 255"


def test_boxes_of_coco_and_kitti_are_the_same(tmp_path: Path) -> None:
    """KITTI's corners are pixel centres; sizes come from photographs; DontCare is no object."""
    coco, kitti = tmp_path / "one", tmp_path / "two"
    for folder in (coco / "annotations", kitti / "label_2"):
        folder.mkdir(parents=True)
    content = {
        "images": [{"id": 1, "width": 96, "height": 80}],
        "categories": [{"id": 7, "name": "Car"}],
        "annotations": [{"image_id": 1, "category_id": 7, "bbox": [10, 20, 31, 41]}],
    }
    (coco / "annotations" / "instances_val.json").write_text(json.dumps(content))
    (coco / "annotations" / "broken.json").write_text("{")
    save(coco / "a.png")
    line = "Car 0 0 0 10 20 40 60 1 1 1 0 0 9 0\nDontCare -1 -1 -10 0 0 9 9 -1 -1 -1 -1 -1 -1 -1\n"
    (kitti / "label_2" / "a.txt").write_text(line)
    save(kitti / "a.png")
    (one,) = real_files.read_labels(real_files.find_files(coco), {}, real_files.Inventory())
    (two,) = real_files.read_labels(
        real_files.find_files(kitti), {"a.png": (96, 80)}, real_files.Inventory()
    )
    assert one == two
    assert one.boxes == (("Car", 10.0, 20.0, 31.0, 41.0),)


def test_boxes_outside_of_their_images_are_counted_and_not_fitted(tmp_path: Path) -> None:
    (tmp_path / "label_2").mkdir()
    inside, outside = "Car 0 0 0 10 20 40 60\n", "Car 0 0 0 96 20 120 60\nCar 0 0 0 1 90 9 99\n"
    (tmp_path / "label_2/a.txt").write_text(inside + outside)
    save(tmp_path / "a.png")
    inventory = real_files.Inventory()
    files = real_files.find_files(tmp_path)
    (labels,) = real_files.read_labels(files, {"a.png": (96, 80)}, inventory)
    assert labels.boxes == (("Car", 10.0, 20.0, 31.0, 41.0),)
    assert inventory.notes == {"label files": "2 boxes outside of their images left out"}
