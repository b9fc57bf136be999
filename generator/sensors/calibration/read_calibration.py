"""Reads calibration files, whose format follows from their content."""

import json
import re
import struct
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element

from gen_data.config import problems, yaml_scalars
from gen_data.config.yaml_tree import Node, parse_yaml
from gen_data.core import errors, safe_xml
from gen_data.sensors.calibration import frame_formats
from gen_data.sensors.calibration.calibration import Calibration
from gen_data.sensors.calibration.camera_formats import (
    camera_file,
    colmap_cameras,
    colmap_text,
    euroc_sensor,
    kalibr_chain,
)
from gen_data.sensors.calibration.named_formats import named_cameras

MAX_BYTES = 64 << 20
_MAX_ELEMENTS = 100_000
_MAX_NODES = 500_000
"""Values of a file: of nerfstudio 19 for each of its images, of OpenCV 2 for each corner."""
_TAG = re.compile(r"!!(opencv-[a-z-]+|[a-z]+)")
_WRITE = "write camera_matrix and dist_coeffs with cv2.FileStorage"
_TYPE = "type its fx_px, fy_px, cx_px and cy_px as intrinsics, and its coefficients as lens"
_BEAMS = "list the elevations of its beams as elevations_deg, in the model of a lidar"
_UNREAD: Mapping[bytes, tuple[str, str]] = {
    rb"(?m)^\[image\]\s*$": ("a calibration of ROS as INI", "give ost.yaml of the same archive"),
    rb"\A\s*\[[A-Za-z]\w*\]\s": ("an INI file, as of ZED cameras", _TYPE),
    rb"\A(PK\x03\x04|\x93NUMPY|\x80[\x02-\x05])": ("an archive of NumPy or Python", _WRITE),
    rb"\A(MATLAB |\x89HDF)": ("a MAT-file", f"use cameraIntrinsicsToOpenCV, and {_WRITE}"),
    rb"\A\s*(<\?xml[^>]*>\s*)?<(calibration|document)\b": (
        "XML of Metashape", "export the calibration as OpenCV",
    ),
    rb"\AParGroup": (
        "a file of HALCON",
        "undistort the images, and type Focus / Sx, Focus / Sy, Cx and Cy as intrinsics",
    ),
    rb"(?m)^model_type:\s*(MEI|SCARAMUZZA)": (
        "a camera of camodocal without a lens here", "calibrate it as KANNALA_BRANDT",
    ),
    rb'\A\s*\{\s*"value0"': (
        "JSON of Basalt", "type kb4 or radtan8 as intrinsics and lens; ds and eucm have none here",
    ),
    rb"\A(#usda|PXR-USDC)": (
        "an OpenUSD stage", "type hfov_deg: 2 atan(horizontalAperture / (2 focalLength))",
    ),
    rb"\A(ARROW1|PAR1)": ("a table of Arrow, as of Argoverse", _TYPE),
    rb"beam_altitude_angles": ("metadata of an Ouster scanner", _BEAMS),
    rb"boost_serialization": ("a calibration of a Velodyne scanner", _BEAMS),
}  # fmt: skip
"""Formats that people have and that are not read here, by their first bytes: names, remedies."""
_KITTI = re.compile(r"^(P\d|P_rect_\d\d|R|R0_rect|Tr_\w+|calib_time):", re.MULTILINE)


def read_calibration(path: Path, *, fisheye: bool = False, rectified: bool = False) -> Calibration:
    """Read a calibration file.

    Args:
        path: The file.
        fisheye: Whether four coefficients of OpenCV belong to its fisheye model.
        rectified: Whether to take rectified pinholes, from projection matrices.

    Raises:
        ConfigError: it cannot be read, or is of no known format.
    """
    data, file = _read(path), str(path)
    _refuse_unread(data, path)
    if path.suffix.lower() == ".bin":
        try:
            return colmap_cameras(colmap_text(data), file)
        except (ValueError, struct.error) as error:
            raise errors.ConfigError(f"{path}: is not a cameras.bin of COLMAP ({error})") from None
    text = _text(data, path)
    start = text.lstrip()[:200]
    if start.startswith("<"):
        return _read_xml(text, path, fisheye=fisheye, rectified=rectified)
    if start.startswith("["):
        try:
            return frame_formats.nuscenes_frames(json.loads(text), path)
        except ValueError as error:
            raise errors.ConfigError(f"{path}: is not valid JSON ({error})") from None
    if path.suffix.lower() == ".txt":
        if _KITTI.search(text):
            return frame_formats.kitti_calibration(text, file, rectified=rectified)
        return colmap_cameras(text, file)
    plain = _plain_json(text) if start.startswith("{") else _plain_yaml(text)
    root = parse_yaml(plain, file, _MAX_NODES)
    return _read_tree(root, fisheye=fisheye, rectified=rectified)


def _read_tree(root: Node, *, fisheye: bool, rectified: bool) -> Calibration:
    if any(node.get("camera_model") for node in root.entries.values()):
        return kalibr_chain(root)
    if root.get("T_BS") or (root.get("camera_model") and root.get("intrinsics")):
        return euroc_sensor(root)
    if root.get("transforms") or root.get("child_frame_id"):
        return frame_formats.tf_frames(root)
    if frame_formats.is_autoware(root):
        return frame_formats.autoware_frames(root)
    inner = root.get("intrinsic")
    if inner is not None and inner.get("intrinsic_matrix"):
        # Open3D: PinholeCameraParameters.
        others = [key for key in root.entries if key != "intrinsic"]
        found = camera_file(inner, fisheye=fisheye, rectified=rectified)
        return replace(found, unused=[*found.unused, *others])
    return named_cameras(root) or camera_file(root, fisheye=fisheye, rectified=rectified)


def _refuse_unread(data: bytes, path: Path) -> None:
    """Raise ConfigError for formats that people have, but that are not read here."""
    for pattern, (name, remedy) in _UNREAD.items():
        if re.search(pattern, data[:4096]):
            raise errors.ConfigError(f"{path}: is {name}, which is not read here; {remedy}")


def _read(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise errors.ConfigError(f"{path}: cannot be read: {error.strerror or error}") from None
    if len(data) > MAX_BYTES:
        raise errors.ConfigError(f"{path}: is larger than {MAX_BYTES >> 20} MiB")
    return data


def _text(data: bytes, path: Path) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise errors.ConfigError(f"{path}: is not UTF-8 text") from None


def _plain_json(text: str) -> str:
    """JSON without tabs, and without OpenCV's comments. Lines and columns stay."""
    return re.sub(r"^ *//[^\n]*", "", text.replace("\t", " "), flags=re.MULTILINE)


def _plain_yaml(text: str) -> str:
    """YAML without the syntax of OpenCV and ROS: ``%YAML:1.0``, tags, an empty last document.

    Lines and columns stay. Transforms that ROS prints one after the other are one list.
    """
    text = re.sub(r"\n---[ \t]*\ntransforms:[ \t]*(?=\n)", "\n\n", text)
    text = text.replace("\t", " ")
    text = re.sub(r"\A\s*%YAML[^\n]*", "", text)
    text = re.sub(r"\n(---|\.\.\.)\s*\Z", "\n", text)
    return _TAG.sub(lambda match: " " * len(match[0]), text)


def _read_xml(text: str, path: Path, *, fisheye: bool, rectified: bool) -> Calibration:
    is_urdf = re.search(r"<robot[\s>]", text) is not None
    tag, kind = (
        ("robot", "a URDF") if is_urdf else ("opencv_storage", "a file of OpenCV, or a URDF")
    )
    try:
        root = safe_xml.parse_xml(text.encode(), str(path), tag, kind, _MAX_ELEMENTS)
    except errors.AssetError as error:
        raise errors.ConfigError(str(error)) from None
    if is_urdf:
        return frame_formats.urdf_frames(root, str(path))
    return camera_file(_storage(root, str(path)), fisheye=fisheye, rectified=rectified)


def _storage(element: Element, file: str) -> Node:
    """The tree of an element of OpenCV's XML: its children by name, or its numbers."""
    assert isinstance(element, safe_xml.PlacedElement)
    place = problems.Position(file, element.line, element.column)
    if len(element):
        entries: dict[str, Node] = {}
        for child in element:
            node = _storage(child, file)
            if child.tag in entries and child.tag != "_":
                problems.refuse(node.position, child.tag, "is stated twice")
            entries[child.tag] = node
        return Node(place, entries)
    text = (element.text or "").strip()
    words = text.split()
    if len(words) != 1 and all(_is_number(word) for word in words):
        return Node(place, tuple(_scalar(place, word) for word in words), text=text)
    return _scalar(place, text.strip('"'))


def _is_number(word: str) -> bool:
    try:
        return isinstance(yaml_scalars.resolve_scalar(word), (int, float))
    except ValueError:
        return False


def _scalar(place: problems.Position, text: str) -> Node:
    return Node(place, yaml_scalars.resolve_scalar(text) if _is_number(text) else text, text=text)
