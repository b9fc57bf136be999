"""Fiducials: OpenCV, which did not draw the scenes, reads every print and finds its corners."""

from typing import Any

import cv2
import numpy as np
import pytest

from gen_data import Dataset
from gen_data.assets.library import Library
from gen_data.content.procedural import fiducials

CELL_PX = 8


def scan(library: Library, asset_id: str, dots_per_m: float) -> Any:
    """The print of an asset as a scanner sees it, and (x, y) [m] of the image's top left corner."""
    mesh = library.mesh(asset_id)
    (x0, y0, _), (x1, y1, top) = mesh.bounds_m()
    image = np.full((round((y1 - y0) * dots_per_m), round((x1 - x0) * dots_per_m)), 255, np.uint8)
    faces = mesh.vertices_m[mesh.faces[mesh.face_slots == 1]]
    assert (faces[..., 2] == np.float32(top)).all()
    for face in faces:
        points = np.round((face[:, :2] - (x0, y1)) * (dots_per_m, -dots_per_m)).astype(np.int32)
        cv2.fillConvexPoly(image, points - (points == points.max(axis=0)), 0)
    return image, np.array([x0, y1])


def found_m(corners_px: Any, dots_per_m: float, origin_m: Any) -> Any:
    """Corners of a detector in the frame of the print; its pixel centres are whole numbers."""
    return origin_m + (corners_px.reshape(-1, 2) + 0.5) / (dots_per_m, -dots_per_m)


def points_m(library: Library, asset_id: str) -> Any:
    return np.array([point.position_m[:2] for point in library.keypoints(asset_id)])


@pytest.mark.parametrize("dictionary", fiducials.DICTIONARIES)
def test_a_detector_reads_the_number_of_a_marker_and_finds_its_corners(
    library: Library, dictionary: str
) -> None:
    """In the order top left, top right, bottom right, bottom left."""
    asset_id = f"marker?dictionary={dictionary}&number=17&side_m=0.1"
    known = cv2.aruco.getPredefinedDictionary(
        getattr(cv2.aruco, fiducials.DICTIONARIES[dictionary])
    )
    dots_per_m = CELL_PX * (known.markerSize + 2) / 0.1
    image, origin_m = scan(library, asset_id, dots_per_m)

    corners, numbers, _ = cv2.aruco.ArucoDetector(known).detectMarkers(image)

    assert numbers.ravel().tolist() == [17]
    assert found_m(corners[0], dots_per_m, origin_m) == pytest.approx(
        points_m(library, asset_id), abs=1.0 / dots_per_m
    )
    attributes = dict(library.get(asset_id).attributes)
    assert attributes == {"dictionary": dictionary, "number": "17", "side_m": "0.1"}


@pytest.mark.parametrize(("columns", "rows"), [(5, 4), (8, 5), (9, 6), (12, 9)])
def test_a_board_has_the_cells_of_opencvs_and_its_corners(
    library: Library, columns: int, rows: int
) -> None:
    """Even and odd numbers of rows; a square has 40 pixels, a marker 30."""
    asset_id = (
        f"calibration_board?pattern=charuco&columns={columns}&rows={rows}&square_m=0.04"
        "&marker_share=0.75&dictionary=aruco_6x6_250&margin_squares=0.5"
    )
    known = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
    board = cv2.aruco.CharucoBoard((columns, rows), 0.04, 0.03, known)
    size_px = ((columns + 1) * 40, (rows + 1) * 40)
    drawn = board.generateImage(size_px, marginSize=20)
    image, _ = scan(library, asset_id, 1000.0)

    away = cv2.dilate(cv2.morphologyEx(drawn, cv2.MORPH_GRADIENT, np.ones((3, 3))), np.ones((3, 3)))
    assert image.shape == drawn.shape
    assert (image == drawn)[away == 0].all()  # edges fall between pixels
    corners_m = board.getChessboardCorners()[:, :2] - (0.02 * columns, 0.02 * rows)
    assert points_m(library, asset_id) == pytest.approx(corners_m * (1, -1), abs=1e-6)


def test_a_detector_finds_the_inner_corners_of_a_chessboard(library: Library) -> None:
    asset_id = "calibration_board?pattern=chessboard&columns=8&rows=6&square_m=0.03"
    image, origin_m = scan(library, asset_id, 1000.0)

    found, corners = cv2.findChessboardCornersSB(image, (7, 5))

    assert found
    rows = sorted(found_m(corners, 1000.0, origin_m), key=lambda p: (-round(p[1], 2), p[0]))
    assert np.array(rows) == pytest.approx(points_m(library, asset_id), abs=0.0011)  # a pixel


@pytest.mark.parametrize("number", [0, 42, 999_999])
def test_a_detector_reads_the_text_of_a_qr_code(library: Library, number: int) -> None:
    asset_id = f"qr_code?number={number}&side_m=0.084"
    image, origin_m = scan(library, asset_id, 2000.0)

    text, corners, _ = cv2.QRCodeDetector().detectAndDecode(image)

    assert text == f"GD-{number:06d}" == dict(library.get(asset_id).attributes)["text"]
    assert found_m(corners, 2000.0, origin_m) == pytest.approx(
        points_m(library, asset_id), abs=0.002
    )


@pytest.mark.parametrize(
    ("asset_id", "message"),
    [
        ("marker?dictionary=apriltag_36h12", "dictionary is none of apriltag_36h11"),
        ("marker?dictionary=aruco_4x4_50&number=50", "number expects a whole number from 0 to 49"),
        ("marker?side_m=2", "side_m expects a number from 0.02 to 0.6"),
        ("calibration_board?columns=12&rows=9&dictionary=aruco_4x4_50", "dictionary is none of"),
    ],
)
def test_a_print_that_cannot_be_made_is_refused(
    library: Library, asset_id: str, message: str
) -> None:
    """A dictionary must have a marker for each white square."""
    with pytest.raises(Exception, match=message):
        library.mesh(asset_id)


@pytest.mark.slow
def test_views_of_a_board_give_back_the_camera_that_took_them() -> None:
    """A detector finds corners where labels state them, and these give OpenCV the lens.

    OpenCV's image coordinates are 0.5 smaller. Its detector scatters by .2 px in such views.
    """
    views = Dataset("calibration_target.yaml", overrides=["sensors.color.size_px=[640,480]"])
    known = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36H11)
    board = cv2.aruco.CharucoBoard((9, 6), 0.04, 0.03, known)
    places, offsets, stated = board.getChessboardCorners().astype(np.float32), [], []
    for sample in views[:6]:
        camera = sample.cameras["color"]
        (truth,) = (o for o in camera.objects if o.instance.category == "calibration board")
        found, numbers, *_ = cv2.aruco.CharucoDetector(board).detectBoard(
            cv2.cvtColor(camera.rgb, cv2.COLOR_RGB2GRAY)
        )
        stated.append(np.array([point.image_px for point in truth.keypoints], np.float32) - 0.5)
        offsets.append(found.reshape(-1, 2) - stated[-1][numbers.ravel()])
    size, flags = (640, 480), cv2.CALIB_FIX_K3
    _, K, lens, *_ = cv2.calibrateCamera([places] * 6, stated, size, None, None, flags=flags)

    assert np.median(np.concatenate(offsets), axis=0) == pytest.approx([0, 0], abs=0.03)
    assert pytest.approx(camera.K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]], abs=0.01) == K
    assert lens.ravel() == pytest.approx([-0.24, 0.07, 0.0006, -0.0004, 0], abs=1e-3)
