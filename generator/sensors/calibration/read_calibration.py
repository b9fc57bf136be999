"""Reads calibration files, whose format follows from their content."""

import json
import re
from pathlib import Path
from xml.etree.ElementTree import Element

from gen_data.config import problems, yaml_scalars
from gen_data.config.yaml_tree import Node, parse_yaml
from gen_data.core import errors, safe_xml
from gen_data.sensors.calibration import frame_formats
from gen_data.sensors.calibration.calibration import Calibration
from gen_data.sensors.calibration.camera_formats import camera_file, colmap_cameras, kalibr_chain

MAX_BYTES = 64 << 20
_MAX_ELEMENTS = 100_000
_TAG = re.compile(r"!!(opencv-[a-z-]+|[a-z]+)")
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
    text = _text(path)
    file, start = str(path), text.lstrip()[:200]
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
    root = parse_yaml(_plain_json(text) if start.startswith("{") else _plain_yaml(text), file)
    if any(node.get("camera_model") for node in root.entries.values()):
        return kalibr_chain(root)
    if root.get("transforms") or root.get("child_frame_id"):
        return frame_formats.tf_frames(root)
    return camera_file(root, fisheye=fisheye, rectified=rectified)


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise errors.ConfigError(f"{path}: cannot be read: {error.strerror or error}") from None
    if len(data) > MAX_BYTES:
        raise errors.ConfigError(f"{path}: is larger than {MAX_BYTES >> 20} MiB")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise errors.ConfigError(f"{path}: is not UTF-8 text") from None


def _plain_json(text: str) -> str:
    """JSON without tabs, and without OpenCV's comments. Lines and columns stay."""
    return re.sub(r"^ *//[^\n]*", "", text.replace("\t", " "), flags=re.MULTILINE)


def _plain_yaml(text: str) -> str:
    """YAML without the syntax of OpenCV and ROS: ``%YAML:1.0``, tags, an empty last document.

    Lines and columns stay.
    """
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
        return Node(place, {child.tag: _storage(child, file) for child in element})
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
