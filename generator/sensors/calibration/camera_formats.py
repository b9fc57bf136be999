"""Cameras of OpenCV, ROS, Kalibr and COLMAP.

* OpenCV's ``FileStorage`` (YAML, XML, JSON): a camera matrix and distortion coefficients under the
  names of its samples and of ``stereoCalibrate``; ``R`` and ``T`` of a pair.
* ROS ``camera_info``: the file of ``camera_calibration``, or the printed message.
* Kalibr's camera chain: https://github.com/ethz-asl/kalibr/wiki/yaml-formats
* COLMAP's ``cameras.txt``: https://colmap.github.io/cameras.html

Pixel centres are at integers in all but COLMAP's, where they are at halves, as in this project.
"""

import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from gen_data.config.problems import Position, refuse
from gen_data.config.yaml_tree import Node
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.core.lens import COEFFICIENTS, LensModel
from gen_data.core.se3 import SE3
from gen_data.sensors.calibration.calibration import (
    CalibratedCamera,
    Calibration,
    Frame,
    attempt,
    camera_matrix,
    check_focal,
    check_rotation,
    fail,
    finite,
    numbers,
    rigid,
)

_MATRICES = (
    "camera_matrix", "cameraMatrix", "Camera_Matrix", "intrinsic_matrix", "mtx", "K", "k", "M",
)  # fmt: skip
_DISTORTIONS = (
    "distortion_coefficients", "Distortion_Coefficients", "distortion_coeffs", "dist_coeffs",
    "distCoeffs", "dist_coeff", "dist_coefs", "distortion", "dist", "D", "d",
)  # fmt: skip
_MODELS: Mapping[str, LensModel] = {
    "": "brown_conrady",
    "plumb_bob": "brown_conrady",
    "rational_polynomial": "brown_conrady",
    "radtan": "brown_conrady",
    "radial-tangential": "brown_conrady",
    "equidistant": "kannala_brandt",
    "fisheye": "kannala_brandt",
    "none": "pinhole",
}
_BROWN = COEFFICIENTS["brown_conrady"]
_FISHEYE = COEFFICIENTS["kannala_brandt"]
_COLMAP: Mapping[str, tuple[str, ...]] = {
    "SIMPLE_PINHOLE": ("f", "cx", "cy"),
    "PINHOLE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL": ("f", "cx", "cy", "k1"),
    "RADIAL": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"),
    "FULL_OPENCV": ("fx", "fy", "cx", "cy", *_BROWN),
    "OPENCV_FISHEYE": ("fx", "fy", "cx", "cy", *_FISHEYE),
    "SIMPLE_FISHEYE": ("f", "cx", "cy"),
    "FISHEYE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL_FISHEYE": ("f", "cx", "cy", "k1"),
    "RADIAL_FISHEYE": ("f", "cx", "cy", "k1", "k2"),
}
"""Parameters of COLMAP's models that have a counterpart here, in order."""


_COLMAP_IDS = (
    ("SIMPLE_PINHOLE", 3), ("PINHOLE", 4), ("SIMPLE_RADIAL", 4), ("RADIAL", 5), ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8), ("FULL_OPENCV", 12), ("FOV", 5), ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5), ("THIN_PRISM_FISHEYE", 12), ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
    ("SIMPLE_DIVISION", 4), ("DIVISION", 5), ("SIMPLE_FISHEYE", 3), ("FISHEYE", 4), ("EUCM", 6),
    ("EQUIRECTANGULAR", 2),
)  # fmt: skip
"""Models of ``cameras.bin`` by their number, with the number of their parameters."""


def lens_of(
    model: LensModel, given: Sequence[float], node: Node, name: str
) -> tuple[LensModel, tuple[float, ...]]:
    """Model and all coefficients of a lens; a Brown-Conrady lens of zeros is a pinhole.

    Raises:
        ConfigError: there are coefficients that no lens here has.
    """
    names = COEFFICIENTS[model]
    beyond = [value for value in given[len(names) :] if value != 0.0]
    if beyond:
        extra = "s1 to s4 (thin prism)" if len(given) <= 12 else "thin prism and tilted sensor"
        fail(node, name, f"{extra} other than 0 have no lens here; calibrate with 8 or fewer")
    values = (*given[: len(names)], *[0.0] * (len(names) - len(given)))
    if model == "brown_conrady" and not any(values):
        return "pinhole", ()
    return model, values


class Entries:
    """Entries of a mapping, under any of several names; it remembers which were taken."""

    def __init__(self, root: Node) -> None:
        self.root = root
        self.used = {"camera_name"}

    def take(self, names: Sequence[str], number: str = "") -> Node | None:
        """The first entry of one of the names, with the number of a camera of a pair."""
        for name in names:
            for key in (f"{name}{number}", f"{name}_{number}")[: 2 if number else 1]:
                found = self.root.entries.get(key)
                # k1 and p1 are coefficients, K1 and P1 the matrices of a pair.
                if found is None or (key[:-1] in ("k", "p", "d") and number and not found.children):
                    continue
                self.used.add(key)
                return found
        return None

    def unused(self) -> list[str]:
        """Names of the entries that were not taken."""
        return [key for key in self.root.entries if key not in self.used]

    def group(self, name: str) -> str:
        """The part of a name before its first dot, if no name with that part was taken."""
        first, dot, _ = name.partition(".")
        return name if any(key.startswith(first + dot) for key in self.used) else first


def camera_file(root: Node, *, fisheye: bool = False, rectified: bool = False) -> Calibration:
    """One camera or a pair, of OpenCV or ROS.

    Args:
        root: The mapping in the file.
        fisheye: Whether OpenCV's four coefficients belong to its fisheye model.
        rectified: Whether to take the pinholes of projection matrices, behind which distortion and
            rotation are removed; their frames then have one origin, ``rectified``.

    Raises:
        ConfigError: there is no camera matrix, or an entry is malformed.
    """
    entries = Entries(root)
    size_px = size_px_of(entries)
    named = root.get("camera_name")
    single = named.text if named else "camera"
    read = _read_rectified if rectified else _read_camera
    cameras: dict[str, CalibratedCamera] = {}
    frames: dict[str, Frame] = {}
    fisheye = fisheye or _states_fisheye(entries)
    for number in ("", "1", "2"):
        found = read(entries, number, size_px, fisheye)
        if found is not None:
            camera, frame = found
            cameras[number or single] = _read_out(camera, entries)
            frames |= {} if frame is None else {"rectified": Frame(optical=True)}
            frames |= {} if frame is None else {number or single: frame}
    if not cameras and not rectified:
        # OpenCV's sample stereo_calib writes R and T to a separate file.
        frames = _pair_frames(entries)
    if not cameras and not frames:
        pair = f"camera matrix such as K, {_MATRICES[0]} or M1, or R and T of a pair"
        known = "projection matrix such as P or P1" if rectified else pair
        fact = f"no camera found; expected a {known}; "
        fail(root, "", f"{fact}of other formats, type fx_px, fy_px, cx_px, cy_px as intrinsics")
    if "2" in cameras and not rectified:
        frames = _pair_frames(entries)
    kind, choices = "a calibration of OpenCV or ROS", {"fisheye", "rectified"}
    return Calibration(root.position.file, kind, cameras, frames, entries.unused(), choices)


def _states_fisheye(entries: Entries) -> bool:
    flag = entries.take(("fisheye_model",))
    return flag is not None and flag.content not in (0, False, "0", "false")


def _read_camera(
    entries: Entries, number: str, size_px: tuple[int, int] | None, fisheye: bool
) -> tuple[CalibratedCamera, None] | None:
    K, D = entries.take(_MATRICES, number), entries.take(_DISTORTIONS, number)
    if K is None:
        return None
    # Open3D lists this one column by column.
    by_columns = K is entries.root.get("intrinsic_matrix")
    fx, fy, cx, cy = camera_matrix(K, "camera matrix", by_columns=by_columns)
    stated = entries.take(("distortion_model", "distortion_type"))
    name = stated.text if stated else ""
    if stated is not None and name not in _MODELS:
        known = ", ".join(key for key in _MODELS if key)
        fact = f"'{name}' is not a known lens; expected one of {known}{did_you_mean(name, _MODELS)}"
        fail(stated, "distortion_model", fact)
    model = "kannala_brandt" if fisheye else _MODELS[name]
    if name and model != _MODELS[name]:
        fail(stated or K, "distortion_model", f"is '{name}', but fisheye: true is stated too")
    _refuse_omnidirectional(entries, number)
    if D is None and (name or fisheye) and model != "pinhole":
        fact = f"has none, but the lens is '{name or 'fisheye'}'; expected one of the keys"
        fail(entries.root, "distortion coefficients", f"{fact} {', '.join(_DISTORTIONS)}")
    lens: tuple[LensModel, tuple[float, ...]] = ("pinhole", ())
    unstated = False
    if D is not None and model != "pinhole":
        count = (4,) if model == "kannala_brandt" else (0, 4, 5, 8, 12, 14)
        values = numbers(D, count, "distortion coefficients")
        lens = lens_of(model, values, D, "distortion")
        # calibrateCamera writes five or more, its fisheye module four.
        unstated = len(values) == 4 and not name and not fisheye and lens[0] != "pinhole"
        unstated &= entries.root.get("fisheye_model") is None
    elif D is not None:
        _refuse_coefficients(D, "distortion coefficients")
    camera = CalibratedCamera(
        K.position, (fx, fy), (cx, cy), *lens, size_px=size_px, unstated=unstated
    )
    return camera, None


def _refuse_omnidirectional(entries: Entries, number: str) -> None:
    """Raise ConfigError for a camera of OpenCV's omnidir module, whose parameter xi is not 0."""
    xi = entries.take(("xi", "Xi", "XI"), number)
    if xi is not None and any(numbers(xi, [1], "xi")):
        fact = "omnidirectional lenses have no lens here; calibrate with the fisheye module"
        fail(xi, "xi", fact)


def _refuse_coefficients(D: Node, name: str) -> None:
    """Raise ConfigError for coefficients other than 0 of a lens that is stated to have none."""
    values = numbers(D, range(15), name) if D.items or D.get("data") else []
    if any(values):
        fail(D, name, "are not 0, but the lens is 'none'; state the model that they belong to")


def _read_out(camera: CalibratedCamera, entries: Entries) -> CalibratedCamera:
    """A camera of which a region of interest is read out, or blocks of pixels together.

    Source: ROS, sensor_msgs/CameraInfo: matrices and the region refer to all pixels. Pixel i of
    binned images covers the pixels ``[i * b, (i + 1) * b)``, so its edges scale, not its centres.
    """
    bins = [_whole(entries.root, f"binning_{axis}") or 1 for axis in "xy"]
    entries.used |= {"binning_x", "binning_y"}
    region = entries.take(("roi",))
    corner, size = [0, 0], camera.size_px
    if region is not None:
        corner = [_whole(region, f"{axis}_offset") for axis in "xy"]
        width, height = (_whole(region, side) for side in ("width", "height"))
        size = (width, height) if width and height else size
        whole = camera.size_px or size
        if size and whole and any(at + n > m for at, n, m in zip(corner, size, whole, strict=True)):
            fact = f"{size[0]} x {size[1]} at ({corner[0]}, {corner[1]}) is not inside"
            fail(region, "roi", f"{fact} the image of {whole[0]} x {whole[1]} pixels")
    if size is not None:
        size = (size[0] // bins[0], size[1] // bins[1])
    (fx, fy), (cx, cy) = camera.focal_px, camera.center_px
    centers = [(c - at + 0.5) / b - 0.5 for c, at, b in zip((cx, cy), corner, bins, strict=True)]
    if bins == [1, 1] and corner == [0, 0]:
        return replace(camera, size_px=size)
    focal = (fx / bins[0], fy / bins[1])
    return replace(camera, focal_px=focal, center_px=(centers[0], centers[1]), size_px=size)


def _whole(node: Node, key: str) -> int:
    """A count of pixels; 0 if it is absent."""
    found = node.get(key)
    if found is None:
        return 0
    (value,) = numbers(found, [1], key)
    if value < 0 or value != int(value):
        fail(found, key, f"expected a whole number of at least 0, got {value:g}")
    return int(value)


def _read_rectified(
    entries: Entries, number: str, size_px: tuple[int, int] | None, _fisheye: bool
) -> tuple[CalibratedCamera, Frame] | None:
    P = entries.take(("projection_matrix", "P", "p"), number)
    if P is None:
        return None
    fx, fy, cx, cy = camera_matrix(P, "projection matrix", 4)
    return CalibratedCamera(P.position, (fx, fy), (cx, cy), size_px=size_px), shifted(
        P, "rectified"
    )


def shifted(P: Node, parent: str) -> Frame:
    """Frame of a rectified camera with a projection matrix: ``P = K [1 | -origin]``."""
    values = numbers(P, [12], "projection matrix")
    fx, fy = values[0], values[5]
    z = -values[11]
    x, y = (-values[3] - values[2] * z) / fx, (-values[7] - values[6] * z) / fy
    return Frame(parent, SE3((x, y, z)), optical=True)


def size_px_of(entries: Entries) -> tuple[int, int] | None:
    """Size of the calibrated images; None if the file does not state it."""
    width, height = (
        entries.take((f"image_{side}", side, f"image_{side.title()}", f"Camera.{side}", *others))
        for side, *others in (("width", "w", "Camera.cols"), ("height", "h", "Camera.rows"))
    )
    whole = entries.take(
        ("cameraResolution", "image_size", "imageSize", "img_size", "resolution", "size_px")
    )
    if whole is not None:
        w, h = numbers(whole, [2], "image size")
    elif width is not None and height is not None:
        (w,), (h,) = numbers(width, [1], "image_width"), numbers(height, [1], "image_height")
    else:
        return None
    if w != int(w) or h != int(h):
        fail(
            whole or width or entries.root,
            "image size",
            f"expected whole numbers, got {w:g} x {h:g}",
        )
    if min(w, h) < 1:
        # ROS drivers without a calibration send sizes of 0.
        fail(whole or width or entries.root, "image size", f"is empty, got {w:g} x {h:g}")
    return (int(w), int(h))


def _pair_frames(entries: Entries) -> dict[str, Frame]:
    """Frames of ``stereoCalibrate``: ``R``, ``T`` map points of camera 1 to camera 2."""
    R, T = entries.take(("R", "rotation")), entries.take(("T", "translation"))
    if R is None or T is None:
        return {}
    rows = np.array(numbers(R, [9], "R")).reshape(3, 3)
    check_rotation(rows, R, "R")
    shift = numbers(T, [3], "T")
    T_2_1 = SE3.from_matrix(np.column_stack([rows, shift]))
    return {"1": Frame(optical=True), "2": Frame("1", T_2_1.inverse(), optical=True)}


def kalibr_chain(root: Node) -> Calibration:
    """Kalibr's camera chain, with or without an IMU.

    Without ``relative_to``, mounts refer to the first camera. ``T_cn_cnm1`` takes points of the
    camera before to a camera, ``T_cam_imu`` points of the IMU. Cameras ``cam0``, ``cam1``, ... are
    in the order of their numbers: files list them by the alphabet, ``cam10`` before ``cam2``.

    Raises:
        ConfigError: a camera's model has no counterpart here, or an entry is malformed.
    """
    cameras: dict[str, CalibratedCamera | ConfigError] = {}
    frames: dict[str, Frame] = {}
    unused: list[str] = []
    named = [name for name, node in root.entries.items() if node.get("camera_model")]
    numbered = all(_NUMBERED.fullmatch(name) for name in named)
    chain = sorted(named, key=lambda name: int(name[3:])) if numbered else named
    for name in chain:
        node = root.entries[name]
        entries = Entries(node)
        cameras[name] = attempt(partial(_kalibr_camera, entries))
        imu, before = entries.take(("T_cam_imu",)), entries.take(("T_cn_cnm1",))
        inverse = entries.take(("T_imu_cam",))
        frames.setdefault(name, Frame(optical=True))
        if before is not None and name != chain[0]:
            pose = rigid(numbers(before, [12, 16], "T_cn_cnm1"), before, "T_cn_cnm1").inverse()
            parent = chain[chain.index(name) - 1]
            if numbered and int(parent[3:]) != int(name[3:]) - 1:
                fact = f"refers to cam{int(name[3:]) - 1}, which the file lacks"
                fail(before, f"{name}.T_cn_cnm1", fact)
            frames[name] = Frame(parent, pose, optical=True)
        T_cam_imu = _imu_pose(imu, inverse)
        if T_cam_imu is not None and "imu" not in frames:
            frames["imu"] = Frame(name, T_cam_imu)
        elif T_cam_imu is not None and before is None:
            frames[name] = Frame("imu", T_cam_imu.inverse(), optical=True)
        unused += [f"{name}.{key}" for key in entries.unused()]
    unused += [key for key in root.entries if key not in chain]
    return Calibration(root.position.file, "a camera chain of Kalibr", cameras, frames, unused)


def euroc_sensor(root: Node) -> Calibration:
    """``sensor.yaml`` of EuRoC and others; ``T_BS`` is the pose of the sensor in the body's frame.

    A camera and its frame are ``camera``; the frame of another sensor has its ``sensor_type``.

    Raises:
        ConfigError: the pose is malformed.
    """
    entries = Entries(root)
    is_camera = root.get("camera_model") is not None
    cameras = {"camera": attempt(partial(_kalibr_camera, entries))} if is_camera else {}
    frames: dict[str, Frame] = {}
    pose, kind = entries.take(("T_BS",)), entries.take(("sensor_type",))
    name = "camera" if is_camera or kind is None else kind.text
    if pose is not None:
        place = rigid(numbers(pose, [12, 16], "T_BS"), pose, "T_BS")
        frames = {"body": Frame(), name: Frame("body", place, optical=is_camera)}
    return Calibration(root.position.file, "a sensor of EuRoC", cameras, frames, entries.unused())


_NUMBERED = re.compile(r"cam\d+")


def _imu_pose(T_cam_imu: Node | None, T_imu_cam: Node | None) -> SE3 | None:
    if T_cam_imu is not None:
        return rigid(numbers(T_cam_imu, [12, 16], "T_cam_imu"), T_cam_imu, "T_cam_imu")
    if T_imu_cam is not None:
        return rigid(numbers(T_imu_cam, [12, 16], "T_imu_cam"), T_imu_cam, "T_imu_cam").inverse()
    return None


def _kalibr_camera(entries: Entries) -> CalibratedCamera:
    projection, distortion = entries.take(("camera_model",)), entries.take(("distortion_model",))
    given = entries.take(("intrinsics",))
    coefficients = entries.take(("distortion_coeffs", "distortion_coefficients"))
    size_px = size_px_of(entries)
    if projection is None or given is None:
        fail(entries.root, "", "expected camera_model and intrinsics")
    if projection.text == "omni":
        xi, *rest = numbers(given, [5], "intrinsics")
        if xi != 0.0:
            fact = (
                f"omni with xi {xi:g} has no lens here; calibrate as pinhole-equi or pinhole-radtan"
            )
            fail(projection, "camera_model", fact)
    elif projection.text == "pinhole":
        rest = numbers(given, [4], "intrinsics")
    else:
        fact = f"'{projection.text}' has no lens here; expected pinhole, or omni with xi 0"
        fail(projection, "camera_model", fact)
    fx, fy, cx, cy = rest
    check_focal(fx, fy, given, "intrinsics")
    name = distortion.text if distortion else "none"
    lens: tuple[LensModel, tuple[float, ...]] = ("pinhole", ())
    if name not in ("radtan", "radial-tangential", "equidistant", "none"):
        fact = f"'{name}' has no lens here; expected radtan, equidistant or none"
        fail(distortion or projection, "distortion_model", fact)
    if name != "none":
        if coefficients is None:
            fail(entries.root, "distortion_coeffs", "is missing")
        values = numbers(coefficients, [4], "distortion_coeffs")
        lens = lens_of(_MODELS[name], values, coefficients, "distortion_coeffs")
    elif coefficients is not None:
        _refuse_coefficients(coefficients, "distortion_coeffs")
    return CalibratedCamera(given.position, (fx, fy), (cx, cy), *lens, size_px=size_px)


def colmap_text(data: bytes) -> str:
    """The lines of ``cameras.txt`` of the content of COLMAP's ``cameras.bin``.

    Source: the description of the binary format at https://colmap.github.io/format.html

    Raises:
        ValueError: it ends too early, or has a model of a later version.
    """
    lines, at = [], 8
    for _ in range(struct.unpack_from("<Q", data)[0]):
        number, model, *size = struct.unpack_from("<IiQQ", data, at)
        if not 0 <= model < len(_COLMAP_IDS):
            raise ValueError(f"the model {model} is not known")
        name, count = _COLMAP_IDS[model]
        values = struct.unpack_from(f"<{count}d", data, at + 24)
        lines.append(" ".join(map(str, (number, name, *size, *values))))
        at += 24 + 8 * count
    return "\n".join(lines)


def colmap_cameras(text: str, file: str) -> Calibration:
    """COLMAP's ``cameras.txt``: a camera per line, by its number.

    Raises:
        ConfigError: a model has no counterpart here, or a line is malformed.
    """
    cameras: dict[str, CalibratedCamera | ConfigError] = {}
    for k, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        place = Position(file, k, 1, line)
        if len(words) < 4 or not words[0].isdecimal():
            fact = "expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS[] of COLMAP, or lines of KITTI"
            refuse(place, "", fact)
        if words[0] in cameras:
            refuse(place, "CAMERA_ID", f"there are two cameras {words[0]}")
        cameras[words[0]] = attempt(partial(_colmap_camera, place, words[1:]))
    if not cameras:
        refuse(Position(file, 1, 1), "", "no camera found; expected lines of COLMAP's cameras.txt")
    return Calibration(file, "cameras of COLMAP", cameras)


def _colmap_camera(place: Position, words: Sequence[str]) -> CalibratedCamera:
    model, names = words[0], _COLMAP.get(words[0])
    if names is None:
        fact = f"'{model}' has no lens here; expected one of {', '.join(_COLMAP)}"
        refuse(place, "MODEL", fact + did_you_mean(model, _COLMAP))
    try:
        width, height, *values = int(words[1]), int(words[2]), *map(finite, words[3:])
    except ValueError as error:
        refuse(place, "", f"expected numbers after the model ({error})")
    if len(values) != len(names):
        fact = f"expected {len(names)} numbers {' '.join(names)}, got {len(values)}"
        refuse(place, "PARAMS", fact)
    given = dict(zip(names, values, strict=True))
    kind: LensModel = "kannala_brandt" if "FISHEYE" in model else "brown_conrady"
    coefficients = [given.get(name, 0.0) for name in COEFFICIENTS[kind]]
    lens = lens_of(kind, coefficients, Node(place, ()), "PARAMS")
    focal = (given.get("fx", given.get("f", 0.0)), given.get("fy", given.get("f", 0.0)))
    check_focal(*focal, Node(place, ()), "PARAMS")
    if min(width, height) < 1:
        refuse(place, "", f"the size must be positive, got {width} x {height}")
    return CalibratedCamera(
        place, focal, (given["cx"], given["cy"]), *lens, (width, height), "halves"
    )
