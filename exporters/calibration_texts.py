"""Texts of calibration files: OpenCV, ROS, Kalibr and COLMAP.

Kalibr: https://github.com/ethz-asl/kalibr/wiki/yaml-formats
COLMAP: https://colmap.github.io/format.html and https://colmap.github.io/cameras.html
"""

from collections.abc import Sequence

from gen_data.core.intrinsics import Intrinsics
from gen_data.core.se3 import SE3

DECIMALS = 9
_ROS = {"pinhole": "plumb_bob", "kannala_brandt": "equidistant"}
_KALIBR = {"pinhole": "none", "brown_conrady": "radtan", "kannala_brandt": "equidistant"}
_COLMAP = {"pinhole": "PINHOLE", "kannala_brandt": "OPENCV_FISHEYE"}


def _focal_and_center(lens: Intrinsics, shift_px: float) -> list[float]:
    """Fx, fy, cx and cy; the principal point is smaller by ``shift_px``."""
    center = (round(v - shift_px, DECIMALS) for v in (lens.cx_px, lens.cy_px))
    return [lens.fx_px, lens.fy_px, *center]


def _coefficients(lens: Intrinsics) -> tuple[float, ...]:
    """Coefficients in OpenCV's order: four, five or eight."""
    values = lens.lens.coefficients
    if lens.lens.model == "pinhole":
        return (0.0,) * 5
    if lens.lens.model == "brown_conrady" and not any(values[5:]):
        return values[:5]
    return values


def _list(values: Sequence[float]) -> str:
    return "[" + ", ".join(repr(float(v) + 0.0) for v in values) + "]"


def _matrix(values: Sequence[float]) -> list[float]:
    fx, fy, cx, cy = values
    return [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]


def opencv_text(lens: Intrinsics) -> str:
    """``cv::FileStorage`` in YAML, with the names of OpenCV's sample ``camera_calibration``."""
    coefficients = _coefficients(lens)

    def matrix(name: str, rows: int, columns: int, values: Sequence[float]) -> str:
        size = f"   rows: {rows}\n   cols: {columns}\n   dt: d\n"
        return f"{name}: !!opencv-matrix\n{size}   data: {_list(values)}\n"

    return (
        f"%YAML:1.0\n---\nimage_width: {lens.width_px}\nimage_height: {lens.height_px}\n"
        f"fisheye_model: {int(lens.lens.model == 'kannala_brandt')}\n"
        + matrix("camera_matrix", 3, 3, _matrix(_focal_and_center(lens, 0.5)))
        + matrix("distortion_coefficients", len(coefficients), 1, coefficients)
    )


def camera_info_text(name: str, lens: Intrinsics) -> str:
    """``camera_info`` of ROS, as its ``camera_calibration`` writes it."""
    coefficients = _coefficients(lens)
    K = _matrix(_focal_and_center(lens, 0.5))
    rational = "rational_polynomial" if len(coefficients) == 8 else "plumb_bob"

    def matrix(key: str, rows: int, columns: int, values: Sequence[float]) -> str:
        return f"{key}:\n  rows: {rows}\n  cols: {columns}\n  data: {_list(values)}\n"

    return (
        f"image_width: {lens.width_px}\nimage_height: {lens.height_px}\ncamera_name: {name}\n"
        + matrix("camera_matrix", 3, 3, K)
        + f"distortion_model: {_ROS.get(lens.lens.model, rational)}\n"
        + matrix("distortion_coefficients", 1, len(coefficients), coefficients)
        + matrix("rectification_matrix", 3, 3, _matrix([1.0, 1.0, 0.0, 0.0]))
        + matrix("projection_matrix", 3, 4, [*K[:3], 0.0, *K[3:6], 0.0, *K[6:], 0.0])
    )


def kalibr_text(chain: Sequence[tuple[str, Intrinsics, SE3 | None, SE3 | None]]) -> str:
    """A camera chain of Kalibr.

    Args:
        chain: Name, intrinsics, ``T_cn_cnm1`` and ``T_cam_imu`` of every camera; poses may be
            None.
    """
    text = ""
    for k, (name, lens, T_cn_cnm1, T_cam_imu) in enumerate(chain):
        model = lens.lens.model
        values = lens.lens.coefficients[:4]
        text += f"cam{k}:  # {name}\n"
        if model == "brown_conrady" and any(lens.lens.coefficients[4:]):
            text += "  # radtan has no k3 to k6: its distortion is left out, see ros and opencv.\n"
            model, values = "pinhole", ()
        text += (
            f"  camera_model: pinhole\n  intrinsics: {_list(_focal_and_center(lens, 0.5))}\n"
            f"  distortion_model: {_KALIBR[model]}\n  distortion_coeffs: {_list(values)}\n"
            f"  resolution: [{lens.width_px}, {lens.height_px}]\n  rostopic: /{name}/image_raw\n"
        )
        for key, pose in (("T_cn_cnm1", T_cn_cnm1), ("T_cam_imu", T_cam_imu)):
            if pose is not None:
                rows = "".join(f"  - {_list(row.round(12))}\n" for row in pose.matrix())
                text += f"  {key}:\n{rows}"
    return text


def colmap_camera(lens: Intrinsics) -> str:
    """A line of ``cameras.txt`` without its number."""
    model, values = lens.lens.model, lens.lens.coefficients
    name = _COLMAP.get(model, "FULL_OPENCV")
    if model == "brown_conrady" and not any(values[4:]):
        name, values = "OPENCV", values[:4]
    numbers = [*_focal_and_center(lens, 0.0), *values]
    listed = " ".join(repr(float(v) + 0.0) for v in numbers)
    return f"{name} {lens.width_px} {lens.height_px} {listed}"
