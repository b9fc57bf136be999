"""Frames of rigs of ROS, nuScenes and KITTI.

* ROS: ``TransformStamped`` in YAML, as ``ros2 topic echo /tf_static`` prints it, and URDF. By REP
  103, frames whose names end with ``_optical``, ``_optical_frame`` or ``_optical_link`` have Z
  forward, others X. Autoware's ``sensor_kit_calibration.yaml``: frames below their parents.
* nuScenes: ``calibrated_sensor.json`` next to ``sensor.json``; frames are channels, the root is the
  ego vehicle's: on the ground below the middle of the rear axle. Cameras have Z forward; the
  laser scanner has Y forward.
* KITTI: ``calib/000000.txt`` of the benchmarks and ``calib_*.txt`` of raw data. Frames are
  ``camera_2`` (0 to 3), ``velodyne`` and ``imu``; X forward but for cameras. The root of the
  rectified cameras of raw data is ``unrectified``: camera 0 before its rectification.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from gen_data.config.problems import Position, refuse
from gen_data.config.yaml_tree import Node
from gen_data.core.errors import ConfigError
from gen_data.core.safe_xml import format_position
from gen_data.core.se3 import SE3, turned
from gen_data.sensors.calibration import calibration, camera_formats

_NAMES = {
    "R_rect": "R0_rect",
    "Tr_velo_cam": "Tr_velo_to_cam",
    "Tr_imu_velo": "Tr_imu_to_velo",
    "Tr": "Tr_velo_to_cam",
}
"""Names of the tracking and the odometry benchmark, by which they differ from the object one."""
_NUSCENES = {"token", "sensor_token", "translation", "rotation", "camera_intrinsic"}
"""Keys of a record. nuImages has \
``camera_distortion`` of the camera, but its images are undistorted."""
_OPTICAL = ("_optical", "_optical_frame", "_optical_link")


def is_optical(name: str) -> bool:
    """Whether a frame of ROS is X right, Y down, Z forward by its name (REP 103)."""
    return name.endswith(_OPTICAL)


def tf_frames(root: Node) -> calibration.Calibration:
    """Frames of ROS transforms: ``transforms:`` with a list, or one of them.

    Raises:
        ConfigError: a transform is malformed, or two have the same child.
    """
    listed = root.get("transforms")
    frames: dict[str, calibration.Frame] = {}
    for one in listed.items if listed else (root,):
        child, parent = one.get("child_frame_id"), one.get("header", "frame_id")
        shift, turn = one.get("transform", "translation"), one.get("transform", "rotation")
        if child is None or parent is None or shift is None or turn is None:
            calibration.fail(one, "", "expected header.frame_id, child_frame_id and transform")
        values = {}
        for part, keys in ((shift, "xyz"), (turn, "xyzw")):
            for key in keys:
                number = part.get(key)
                if number is None:
                    calibration.fail(part, key, "is missing")
                (values[f"{key}{len(keys)}"],) = calibration.numbers(number, [1], key)
        q = np.array([values[f"{key}4"] for key in "wxyz"])
        if abs(float(np.linalg.norm(q)) - 1.0) > 1e-3:
            calibration.fail(
                turn, "rotation", f"is not a unit quaternion, its length is {np.linalg.norm(q):g}"
            )
        w, x, y, z = (float(v) for v in q / np.linalg.norm(q))
        name, above = child.text.strip("/"), parent.text.strip("/")
        if frames.get(name, calibration.Frame()).parent:
            calibration.fail(child, "child_frame_id", f"'{name}' has two parents")
        place = SE3((values["x3"], values["y3"], values["z3"]), (w, x, y, z))
        frames[name] = calibration.Frame(above, place, is_optical(name))
        frames.setdefault(above, calibration.Frame(optical=is_optical(above)))
    return calibration.Calibration(root.position.file, "transforms of ROS", {}, frames)


_PLACE = ("x", "y", "z", "roll", "pitch", "yaw")


def is_autoware(root: Node) -> bool:
    """Whether a file lists frames by their parents, with the six numbers of Autoware."""
    groups = [group.entries.values() for group in root.entries.values()]
    return bool(groups) and all(
        group and all(set(_PLACE) <= set(one.entries) for one in group) for group in groups
    )


def autoware_frames(root: Node) -> calibration.Calibration:
    """Frames of Autoware: position [m] and angles [rad] below the name of the parent, as in URDF.

    Raises:
        ConfigError: a number is malformed, or a frame has two parents.
    """
    frames = {name: calibration.Frame(optical=is_optical(name)) for name in root.entries}
    for parent, group in root.entries.items():
        for name, node in group.entries.items():
            x, y, z, roll, pitch, yaw = (
                calibration.numbers(node.entries[key], [1], key)[0] for key in _PLACE
            )
            if frames.get(name, calibration.Frame()).parent:
                calibration.fail(node, name, "has two parents")
            place = turned((x, y, z), yaw, -pitch, roll)
            frames[name] = calibration.Frame(parent, place, is_optical(name))
    return calibration.Calibration(root.position.file, "places of Autoware", {}, frames)


def urdf_frames(robot: Element, file: str) -> calibration.Calibration:
    """Links of a URDF at the zero of its joints.

    Raises:
        ConfigError: a joint is malformed.
    """
    frames: dict[str, calibration.Frame] = {
        link.get("name", ""): calibration.Frame(optical=is_optical(link.get("name", "")))
        for link in robot.iter("link")
    }
    moving = []
    for joint in robot.findall("joint"):
        name = joint.get("name", "")
        place = f"{file}{format_position(joint)}: joint '{name}'"
        above, link = (
            "" if found is None else found.get("link", "")
            for found in (joint.find("parent"), joint.find("child"))
        )
        for end in (above, link):
            if end not in frames:
                raise ConfigError(f"{place}: there is no link '{end}'; expected parent and child")
        if frames[link].parent:
            raise ConfigError(f"{place}: the link '{link}' has two parents")
        origin = joint.find("origin")
        texts = origin.attrib if origin is not None else {}
        try:
            x, y, z = map(calibration.finite, texts.get("xyz", "0 0 0").split())
            roll, pitch, yaw = map(calibration.finite, texts.get("rpy", "0 0 0").split())
        except ValueError as error:
            fact = f"expected three numbers each in xyz and rpy ({error})"
            raise ConfigError(f"{place}: origin: {fact}") from None
        if joint.get("type") != "fixed":
            moving.append(name)
        # A pitch of URDF turns X downwards.
        pose = turned((x, y, z), yaw, -pitch, roll)
        frames[link] = calibration.Frame(above, pose, is_optical(link))
    unused = [f"joint {name} (at 0)" for name in moving]
    return calibration.Calibration(file, "a URDF", {}, frames, unused)


def nuscenes_frames(records: Any, path: Path) -> calibration.Calibration:
    """Channels of nuScenes' ``calibrated_sensor.json``; records that differ go by their token.

    Raises:
        ConfigError: ``sensor.json`` is missing, or a record is malformed.
    """
    table = path.parent / "sensor.json"
    try:
        sensors = {one["token"]: one for one in json.loads(table.read_bytes())}
        by_channel: dict[str, list[Mapping[str, Any]]] = {}
        for record in records:
            channel = sensors[record["sensor_token"]]["channel"]
            by_channel.setdefault(channel, []).append(record)
        cameras: dict[str, calibration.CalibratedCamera] = {}
        frames = {"ego": calibration.Frame()}
        for channel, listed in by_channel.items():
            distinct = {json.dumps({**r, "token": ""}, sort_keys=True): r for r in listed}
            for record in distinct.values():
                name = channel if len(distinct) == 1 else record["token"]
                modality = sensors[record["sensor_token"]]["modality"]
                frames[name] = _nuscenes_frame(record, modality, path)
                if modality == "camera":
                    cameras[name] = _nuscenes_camera(record, path)
    except OSError as error:
        fact = f"needs the names of channels in {table}: {error.strerror}"
        raise ConfigError(f"{path}: {fact}") from None
    except (KeyError, TypeError, ValueError) as error:
        kind = f"{type(error).__name__}: {error}"
        raise ConfigError(f"{path}: is not a calibrated_sensor.json of nuScenes ({kind})") from None
    unused = sorted({key for record in records for key in record} - _NUSCENES)
    kind = "calibrated sensors of nuScenes"
    return calibration.Calibration(str(path), kind, cameras, frames, unused, {"rectified"})


def _nuscenes_frame(record: Mapping[str, Any], modality: str, path: Path) -> calibration.Frame:
    w, x, y, z = map(calibration.finite, record["rotation"])
    tx, ty, tz = map(calibration.finite, record["translation"])
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if abs(norm - 1.0) > 1e-3:
        raise ConfigError(f"{path}: the rotation of {record['token']} is not a unit quaternion")
    pose = SE3((tx, ty, tz), (w / norm, x / norm, y / norm, z / norm))
    # The scanner's frame is X right, Y forward; a sensor here has X forward.
    ahead = SE3.about_z(0.5 * math.pi) if modality == "lidar" else SE3()
    return calibration.Frame("ego", pose @ ahead, optical=modality == "camera")


def _nuscenes_camera(record: Mapping[str, Any], path: Path) -> calibration.CalibratedCamera:
    K = np.array(record["camera_intrinsic"], np.float64).reshape(3, 3)
    place = Position(str(path), 1, 1)
    calibration.check_matrix(K, Node(place, ()), f"camera_intrinsic of {record['token']}")
    return calibration.CalibratedCamera(
        place, (float(K[0, 0]), float(K[1, 1])), (float(K[0, 2]), float(K[1, 2]))
    )


def kitti_calibration(text: str, file: str, *, rectified: bool = False) -> calibration.Calibration:
    """One file of KITTI's calibration: cameras, and frames as far as the file has them.

    The benchmarks' files have rectified cameras. Of raw data, ``calib_cam_to_cam.txt`` has both:
    ``rectified`` selects the cameras of ``P_rect``.

    Raises:
        ConfigError: a line is malformed, or the file has nothing of it.
    """
    lines: dict[str, Node] = {}
    for k, line in enumerate(text.splitlines(), 1):
        key, _, rest = line.strip().partition(" ")  # Files of tracking lack some of the colons.
        place = Position(file, k, 1, line)
        cells = tuple(Node(place, _number(word), text=word) for word in rest.split())
        key = _NAMES.get(key.rstrip(":"), key.rstrip(":"))
        if key in lines:
            refuse(place, key, f"is stated twice, first in line {lines[key].position.line}")
        if key:
            lines[key] = Node(place, cells, text=rest.strip())
    raw = rectified and any(key.startswith("P_rect_") for key in lines)
    root = "unrectified" if raw else "camera_0"
    frames, cameras = {root: calibration.Frame(optical=True)}, {}
    used = {"calib_time", "corner_dist"}
    for number in "0123":
        name = f"camera_{number}"
        for camera, frame, keys in _kitti_camera(lines, number, rectified=rectified):
            cameras[name], used = camera, used | keys
            if name != root:
                frames[name] = frame
    used |= _kitti_devices(lines, frames)
    if not cameras and len(frames) < 2:
        refuse(Position(file, 1, 1), "", "no calibration of KITTI found")
    unused = [key for key in lines if key not in used]
    kind = "a calibration of KITTI"
    return calibration.Calibration(file, kind, cameras, frames, unused, {"rectified"})


def _number(word: str) -> float | str:
    try:
        value = float(word)
    except ValueError:
        return word
    return value if math.isfinite(value) else word


def _kitti_camera(lines: Mapping[str, Node], number: str, *, rectified: bool) -> Any:
    """The camera of a number, its frame and the lines used; nothing if there is none."""
    P = lines.get(f"P{number}") or (lines.get(f"P_rect_0{number}") if rectified else None)
    S = lines.get(f"S_rect_0{number}" if rectified else f"S_0{number}")
    size = tuple(int(v) for v in calibration.numbers(S, [2], "S")) if S else None
    if P is not None:
        name = f"P{number}" if f"P{number}" in lines else f"P_rect_0{number}"
        fx, fy, cx, cy = calibration.camera_matrix(P, name, 4)
        keys = {f"P{number}", f"P_rect_0{number}", f"S_rect_0{number}"}
        camera = calibration.CalibratedCamera(P.position, (fx, fy), (cx, cy), size_px=size)  # type: ignore[arg-type]
        frame = camera_formats.shifted(P, "camera_0")
        if f"P{number}" not in lines:
            frame = _kitti_unrectified(lines, frame)
            keys |= {f"R_rect_0{k}" for k in "0123"}
        yield camera, frame, keys
        return
    K, D = lines.get(f"K_0{number}"), lines.get(f"D_0{number}")
    R, T = lines.get(f"R_0{number}"), lines.get(f"T_0{number}")
    if K is None or D is None or R is None or T is None:
        return
    names = [f"{name}_0{number}" for name in "KDRT"]
    fx, fy, cx, cy = calibration.camera_matrix(K, names[0])
    coefficients = calibration.numbers(D, [5], names[1])
    lens = camera_formats.lens_of("brown_conrady", coefficients, D, names[1])
    rows = np.array(calibration.numbers(R, [9], names[2])).reshape(3, 3)
    calibration.check_rotation(rows, R, names[2])
    # Points of camera 0 are mapped to points of the camera.
    shift = calibration.numbers(T, [3], names[3])
    pose = SE3.from_matrix(np.column_stack([rows, shift])).inverse()
    keys = {f"S_0{number}", *names}
    camera = calibration.CalibratedCamera(K.position, (fx, fy), (cx, cy), *lens, size_px=size)  # type: ignore[arg-type]
    yield camera, calibration.Frame("camera_0", pose, optical=True), keys


def _kitti_unrectified(lines: Mapping[str, Node], frame: calibration.Frame) -> calibration.Frame:
    """Frame of a rectified camera of raw data in camera 0 as it is, which the scanner refers to.

    Source: KITTI's raw development kit: ``P_rect_xx R_rect_00 Tr_velo_to_cam`` takes points of the
    scanner to image ``xx``, so ``R_rect_00`` rectifies all cameras.
    """
    turn = lines.get("R_rect_00")
    if turn is None:
        return replace(frame, parent="unrectified")
    rows = np.array(calibration.numbers(turn, [9], "R_rect_00")).reshape(3, 3)
    calibration.check_rotation(rows, turn, "R_rect_00")
    T_rect_0 = SE3.from_matrix(np.column_stack([rows, np.zeros(3)]))
    pose = T_rect_0.inverse() @ frame.T_parent_frame
    return replace(frame, parent="unrectified", T_parent_frame=pose)


def _kitti_devices(lines: Mapping[str, Node], frames: dict[str, calibration.Frame]) -> set[str]:
    """Add the scanner and the navigation unit to the frames; names of the lines used."""
    used = set()
    for key, inner, outer in (
        ("Tr_velo_to_cam", "velodyne", "camera_0"),
        ("Tr_imu_to_velo", "imu", "velodyne"),
    ):
        if key in lines:
            # Benchmarks: to camera 0 before its rectification R0_rect, which is the frame of P.
            pose = calibration.rigid(calibration.numbers(lines[key], [12], key), lines[key], key)
            if outer == "camera_0" and "R0_rect" in lines:
                rect = np.array(calibration.numbers(lines["R0_rect"], [9], "R0_rect")).reshape(3, 3)
                pose = SE3.from_matrix(np.column_stack([rect, np.zeros(3)])) @ pose
                used.add("R0_rect")
            frames[inner] = calibration.Frame(outer, pose)
            frames.setdefault(outer, calibration.Frame())
            used.add(key)
    if "R" in lines and "T" in lines:
        # Raw data: one pose per file, named by the file.
        file = Path(lines["R"].position.file).name
        inner, outer = ("imu", "velodyne") if "imu_to_velo" in file else ("velodyne", "camera_0")
        rows = np.array(calibration.numbers(lines["R"], [9], "R")).reshape(3, 3)
        calibration.check_rotation(rows, lines["R"], "R")
        shift = calibration.numbers(lines["T"], [3], "T")
        frames[inner] = calibration.Frame(outer, SE3.from_matrix(np.column_stack([rows, shift])))
        frames.setdefault(outer, calibration.Frame(optical=outer == "camera_0"))
        used |= {"R", "T"}
    return used
