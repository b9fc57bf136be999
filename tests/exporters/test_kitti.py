"""KITTI export, judged by the arithmetic of KITTI's own development kit."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from gen_data.annotations.annotate import Thresholds
from gen_data.core.boxes import BoxPx, OrientedBox
from gen_data.core.capture import Channel
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import ImageTruth, ObjectTruth
from gen_data.core.scene import Camera, Instance
from gen_data.core.se3 import IDENTITY, SE3
from gen_data.exporters import kitti
from tests.exporters.datasets import made_of
from tests.exporters.drives import calibration

Array = NDArray[np.float64]
CAMERA = Camera("color", IDENTITY, Intrinsics(200, 100, 150.0, 150.0, 100.0, 50.0))


def devkit_corners(row: str) -> Array:
    """Corners [8, 3] of a label row in the rectified frame, as ``computeBox3D.m`` has them."""
    h, w, length, x, y, z, ry = (float(v) for v in row.split(" ")[8:])
    c, s = math.cos(ry), math.sin(ry)
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    x_corners = length / 2 * np.array([1, 1, -1, -1, 1, 1, -1, -1])
    y_corners = np.array([0, 0, 0, 0, -h, -h, -h, -h])
    z_corners = w / 2 * np.array([1, -1, -1, 1, 1, -1, -1, 1])
    return (rotation @ np.stack([x_corners, y_corners, z_corners])).T + np.array([x, y, z])


def devkit_calib(path: Path) -> dict[str, Array]:
    found = calibration(path)
    names = ["P0", "P1", "P2", "P3", "R0_rect", "Tr_velo_to_cam", "Tr_imu_to_velo"]
    assert list(found) == names
    return {name: values.reshape(3, -1) for name, values in found.items()}


STYLE = kitti.Kitti(types="category", boxes="tight", low_px=2)


def row_of(box3d_camera: OrientedBox, style: kitti.Kitti = STYLE, **changes: Any) -> str:
    """The label row of a visible crate with the given box in the camera frame."""
    crate = Instance(1, "crate/1", "Crate box", 1, "crate")
    fields = {"visible_px": 200, "box": BoxPx(10, 20, 30, 30), "box3d_camera": box3d_camera}
    fields |= {"occlusion": 0.0, "truncation": 0.0, **changes}
    return kitti.label_row(ObjectTruth(crate, **fields), ImageTruth(CAMERA, ()), style)


dataset = made_of(kitti.Kitti(low_px=2))


unit = st.floats(-1, 1)
side_m = st.floats(0.02, 4.0)


@settings(max_examples=200, deadline=None)
@given(
    st.tuples(unit, unit, unit, unit).filter(lambda q: sum(v * v for v in q) > 0.01),
    st.tuples(side_m, side_m, side_m),
    st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(6, 30)),
)
def test_a_label_encloses_the_oriented_box_as_tightly_as_its_heading_allows(
    q: tuple[float, ...], size_m: tuple[float, ...], centre_m: tuple[float, ...]
) -> None:
    """Row -> devkit -> corners: each oriented corner is inside, and each face touches one."""
    norm = math.sqrt(sum(v * v for v in q))
    box = OrientedBox(SE3(centre_m, tuple(v / norm for v in q)), size_m)
    row = row_of(box)
    ry = float(row.split(" ")[14])
    axes = np.array([[math.cos(ry), 0, -math.sin(ry)], [0, 1, 0], [math.sin(ry), 0, math.cos(ry)]])
    inner, outer = box.corners() @ axes.T, devkit_corners(row) @ axes.T
    np.testing.assert_allclose(outer.min(axis=0), inner.min(axis=0), atol=1e-4)
    np.testing.assert_allclose(outer.max(axis=0), inner.max(axis=0), atol=1e-4)


@pytest.mark.parametrize("yaw", [0.0, 0.4, 1.6, -2.8])
def test_an_upright_object_keeps_its_box_and_one_on_end_heads_by_its_y_axis(yaw: float) -> None:
    """Length along x, width along y, height along z of the object; heading = -yaw there."""
    # Camera at the world's origin that looks along world X; the object stands 1 m lower.
    T_camera_world = SE3.from_matrix(
        np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]], float)
    )
    T_world_box = SE3.about_z(yaw, (10.0, 2.0, -0.25))
    box = OrientedBox(T_camera_world @ T_world_box, (4.0, 1.8, 1.5))
    upright = kitti.upright_box(box)
    assert upright.size_hwl_m == pytest.approx((1.5, 1.8, 4.0))
    assert upright.bottom_m == pytest.approx((-2.0, 1.0, 10.0))
    # World X is the camera's z, which KITTI calls a heading of -90 degrees.
    turn = upright.heading_rad - (-yaw - math.pi / 2)
    assert math.remainder(turn, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    # Object x is vertical, object y is the camera's z: its left, so x would head along +x.
    matrix = np.array([[0, 0, -1, 0], [-1, 0, 0, 0], [0, 1, 0, 5], [0, 0, 0, 1]], float)
    box = OrientedBox(SE3.from_matrix(matrix), (1.0, 2.0, 3.0))
    upright = kitti.upright_box(box)
    assert upright.heading_rad == pytest.approx(0.0, abs=1e-9)
    assert upright.size_hwl_m == pytest.approx((1.0, 2.0, 3.0))


@pytest.mark.parametrize(
    ("category", "pose", "kind"),
    [("car", "", "Car"), ("Van", "", "Van"), ("truck", "", "Truck"), ("bus", "", "Misc"),
     ("motorcycle", "", "Misc"), ("person", "", "Pedestrian"), ("person", "walk", "Pedestrian"),
     ("person", "sit", "Person_sitting"), ("pedestrian", "sitting", "Person_sitting"),
     ("person sitting", "", "Person_sitting"), ("cyclist", "sit", "Cyclist"), ("tram", "", "Tram")],
)  # fmt: skip
def test_categories_become_the_types_of_kittis_own(category: str, pose: str, kind: str) -> None:
    """The eight names in the devkit's readme.txt; all others are Misc."""
    attributes = (("pose", pose),) if pose else ()
    assert kitti.official_type(Instance(1, "it", category, 1, "it", attributes=attributes)) == kind


@pytest.mark.parametrize(
    ("hidden", "level"), [(0.0, 0), (0.1, 0), (0.11, 1), (0.5, 1), (0.51, 2), (1.0, 2)]
)
def test_occlusion_has_three_levels(hidden: float, level: int) -> None:
    """Visible up to a tenth hidden, partly up to a half, largely above."""
    assert kitti.occlusion_level(hidden) == level


def test_dont_care_rows_come_last_and_hidden_objects_have_none(world: Any, tmp_path: Path) -> None:
    """A car whose centre is behind the camera is written after the pedestrian before it."""
    beside = world.instance(1, "car", -0.2, 0.0, 0.0)
    away = world.instance(2, "pedestrian", 9.0, 2.0, 0.0)
    behind = world.instance(3, "car", -9.0, 0.0, 0.0)
    sample = world.sample(
        0, (beside, away, behind), [world.camera()], thresholds=Thresholds(include_invisible=True)
    )
    folder = world.export(kitti.Kitti(low_px=2), world.info(1), [sample], tmp_path)
    rows = (folder / "training/label_2/000000.txt").read_text().splitlines()
    assert [row.split(" ")[0] for row in rows] == ["Pedestrian", "DontCare"]


def test_every_frame_has_every_file_with_official_types_and_others_misc(dataset: Path) -> None:
    """An empty frame has an empty label file; splits list each frame once."""
    frames = [f"{i:06d}" for i in range(7)]
    for kind, ending in (
        ("image_2", "png"),
        ("depth_2", "png"),
        ("label_2", "txt"),
        ("calib", "txt"),
    ):
        found = sorted(p.name for p in (dataset / "training" / kind).iterdir())
        assert found == [f"{frame}.{ending}" for frame in frames]
    assert (dataset / "training/label_2/000003.txt").read_bytes() == b""
    lists = {p.stem: p.read_text().split() for p in (dataset / "ImageSets").iterdir()}
    assert (lists["val"], lists["test"]) == (["000002", "000004"], [])
    assert sorted(lists["train"] + lists["val"]) == frames
    # Cars and pedestrians have types, crates have none; heights come first.
    text = (dataset / "training/label_2/000000.txt").read_text()
    rows = [line.split(" ") for line in text.splitlines()]
    assert [row[0] for row in rows] == ["Car", "Pedestrian", "Misc", "Misc", "Pedestrian"]
    sizes_m = [tuple(map(float, row[8:11])) for row in rows]
    car, person, crate = (1.5, 1.8, 4.0), (1.8, 0.6, 0.5), (0.9, 1.4, 1.0)
    assert sizes_m == [car, person, crate, crate, person]


@pytest.mark.parametrize("depth_scale_m", [0.001, 1 / 256])
def test_depth_has_256_units_per_metre_whatever_the_data_set_has(
    depth_scale_m: float, world: Any, tmp_path: Path
) -> None:
    """As KITTI's depth benchmark and OpenPCDet read it; images in these units are linked."""
    info = world.info(7, depth_scale_m=depth_scale_m)
    folder = world.export(kitti.Kitti(), info, world.samples, tmp_path)
    for sample in world.samples:
        path = folder / f"training/depth_2/{sample.index:06d}.png"
        read_m = np.asarray(Image.open(path)) / 256.0
        true_m = sample.capture.readings["color"].channels[Channel.Z_DEPTH]
        expected_m = np.where(true_m < 65_535 * depth_scale_m, true_m, 0.0)
        np.testing.assert_allclose(read_m, expected_m, atol=0.5 / 256 + 0.5 * depth_scale_m)
        # One file in the shard and in the data set.
        assert path.stat().st_nlink == 2


def test_calibrations_and_rows_have_kittis_pixels_and_columns() -> None:
    """The centred camera of W pixels has cx = (W - 1) / 2 in KITTI."""
    rows = dict(line.split(": ") for line in kitti.calib_text(CAMERA.intrinsics).splitlines())
    p2 = np.array(rows["P2"].split(" "), float).reshape(3, 4)
    np.testing.assert_array_equal(p2, [[150, 0, 99.5, 0], [0, 150, 49.5, 0], [0, 0, 1, 0]])
    np.testing.assert_array_equal(np.array(rows["R0_rect"].split(), float), np.eye(3).ravel())
    assert len(rows["Tr_imu_to_velo"].split(" ")) == 12
    # Type in one word; 0-based pixels, the last one included; bottom centre; alpha.
    box = OrientedBox(SE3((3.0, 0.5, 4.0)), (1.0, 0.6, 2.0))
    row = row_of(box, truncation=0.256, occlusion=0.3)
    assert row == (
        "Crate_box 0.26 1 -0.643501 10.00 20.00 29.00 29.00 "
        "0.600000 2.000000 1.000000 3.000000 0.800000 4.000000 0.000000"
    )


def test_wide_boxes_of_people_leave_the_image_box_at_the_silhouette_and_a_margin() -> None:
    """10 m away at a focal length of 150 px: 5 cm are .75 px on both sides and above."""
    person = Instance(1, "person/1", "person", 1, "person", box_max_m=(0.5, 0.5, 1.7))
    wide = replace(person, body_bounds_m=((-0.3, -0.3, 0.0), (0.8, 0.8, 1.75)))
    box = OrientedBox(SE3((0.0, 0.0, 10.0)), (1.1, 1.1, 1.75))
    fields: dict[str, Any] = {"box": BoxPx(110, 20, 116, 46), "box3d_camera": box, "occlusion": 0.0}
    fields |= {"truncation": 0.0, "amodal_box": BoxPx(108, 20, 116, 46)}
    style = kitti.Kitti(types="category")
    rows = [
        kitti.label_row(ObjectTruth(one, 99, **fields), ImageTruth(CAMERA, ()), style).split()
        for one in (wide, person)
    ]
    assert rows[0][4:8] == ["107.25", "19.25", "115.75", "45.00"]
    assert rows[0][8:] == rows[1][8:]
    assert float(rows[1][6]) - float(rows[1][4]) > 16.0  # the projection of 1.1 m


def test_image_boxes_bound_the_projected_boxes_inside_the_image(dataset: Path) -> None:
    """P2 R0 x, clipped, to the hundredth of a pixel; the truncation is the share clipped off."""
    compared = 0
    for path in sorted((dataset / "training/label_2").iterdir()):
        calib = devkit_calib(dataset / f"training/calib/{path.stem}.txt")
        with Image.open(dataset / f"training/image_2/{path.stem}.png") as image:
            last_px = np.array(image.size) - 1.0
        for row in path.read_text().splitlines():
            corners = devkit_corners(row) @ calib["R0_rect"].T
            if row.startswith("DontCare") or (corners[:, 2] < 0.05).any():
                continue
            projected = np.c_[corners, np.ones(8)] @ calib["P2"].T
            whole = projected[:, :2] / projected[:, 2:]
            uv = np.clip(whole, 0.0, last_px)
            inside = np.prod(np.ptp(uv, axis=0)) / np.prod(np.ptp(whole, axis=0))
            assert float(row.split(" ")[1]) == pytest.approx(1.0 - inside, abs=0.006)
            label = [float(v) for v in row.split(" ")[4:8]]
            np.testing.assert_allclose([*uv.min(axis=0), *uv.max(axis=0)], label, atol=0.006)
            compared += 1
    assert compared >= 5


@pytest.mark.parametrize(
    ("category", "z_m", "kinds"),
    [("pedestrian", 49.0, ("Pedestrian", "Pedestrian")),
     ("pedestrian", 51.0, ("DontCare", "Pedestrian")),
     ("pedestrian", 65.0, ("DontCare", "DontCare")), ("car", 51.0, ("Car", "Car")),
     ("cyclist", 51.0, ("Cyclist", "Cyclist")), ("car", 65.0, ("DontCare", "DontCare"))],
)  # fmt: skip
def test_people_have_labels_up_to_their_own_distance_if_there_is_one(
    category: str, z_m: float, kinds: tuple[str, str]
) -> None:
    """Annotators recognise people less far than cars."""
    one = ObjectTruth(
        Instance(1, "group/1", category, 1, "group"),
        visible_px=200,
        box=BoxPx(10, 20, 30, 50),
        box3d_camera=OrientedBox(SE3((0.0, 0.0, z_m)), (1.0, 1.0, 1.7)),
        occlusion=0.0,
        truncation=0.0,
    )
    styles = kitti.Kitti(far_m=64, far_people_m=50), kitti.Kitti(far_m=64)
    rows = (kitti.label_row(one, ImageTruth(CAMERA, ()), style) for style in styles)
    assert tuple(row.split(" ")[0] for row in rows) == kinds


FAR = {"box3d_camera": OrientedBox(SE3((0.0, 0.0, 79.0)), (1.0, 1.0, 1.0))}
FARTHER = {"box3d_camera": OrientedBox(SE3((0.0, 0.0, 81.0)), (1.0, 1.0, 1.0))}
BEHIND = {"box3d_camera": OrientedBox(SE3((0.0, 0.0, -0.1)), (1, 1, 1))}
# A lorry at the side of the camera reaches behind it: readers project its corners differently.
BESIDE = {"box3d_camera": OrientedBox(SE3((-2.5, 0.0, 3.0)), (2.0, 3.0, 10.0))}


@pytest.mark.parametrize(
    ("changes", "low_px", "corners"),
    [({"box": BoxPx(10, 20, 11, 30)}, 2, "10.00 20.00 11.00 29.00"),
     ({"box": BoxPx(199, 99, 200, 100)}, 2, "198.00 98.00 199.00 99.00"),
     (BEHIND, 2, "10.00 20.00 29.00 29.00"), (BESIDE, 2, "10.00 20.00 29.00 29.00"),
     ({**FAR, "box": BoxPx(10, 20, 40, 50)}, None, ""),
     ({**FARTHER, "box": BoxPx(10, 20, 40, 50)}, None, "10.00 20.00 39.00 49.00"),
     ({"box": BoxPx(10, 20, 40, 29)}, None, "10.00 20.00 39.00 28.00")],
)  # fmt: skip
def test_what_kitti_cannot_say_is_dont_care(
    changes: dict[str, Any], low_px: int | None, corners: str
) -> None:
    """One pixel wide, partly behind the camera, beyond 80 m or lower than its annotators' limit.

    A valid box and KITTI's constants; nearer objects are labelled.
    """
    fields = {"box3d_camera": OrientedBox(SE3((0, 0, 5.0)), (1, 1, 1)), **changes}
    row = row_of(style=STYLE if low_px else kitti.Kitti(), **fields)
    constants = "-1 -1 -1 -1000 -1000 -1000 -10"
    assert row == f"DontCare -1 -1 -10 {corners} {constants}" if corners else row[:5] == "Misc "


def test_without_a_scanner_there_are_no_points(world: Any, tmp_path: Path) -> None:
    """No velodyne folder; the calibration holds the axes of one at the camera's centre."""
    info = world.info(7, media={"color": (Channel.RGB,)})
    folder = world.export(kitti.Kitti(), info, world.samples, tmp_path)
    kinds = {p.name for p in (folder / "training").iterdir()}
    assert kinds == {"image_2", "label_2", "calib"}
    velo_to_cam = devkit_calib(folder / "training/calib/000000.txt")["Tr_velo_to_cam"]
    np.testing.assert_array_equal(velo_to_cam, [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0]])


@pytest.mark.parametrize(
    ("boxes", "text"),
    [("projected", "of people with labels.box3d: annotated, around the figure with a margin of\n"
                   "            0.05 m. "),
     ("tight", "left top right bottom: around the visible pixels. ")],
)  # fmt: skip
def test_the_readme_states_the_boxes_of_figures(
    boxes: Any, text: str, world: Any, tmp_path: Path
) -> None:
    """People of shipped streets have them."""
    style = kitti.Kitti(boxes=boxes)
    folder = world.export(style, world.info(1), world.samples[:1], tmp_path)
    readme = (folder / "README.txt").read_text().replace(".\n", ". ")
    assert text in readme
