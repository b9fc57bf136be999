"""Calibrations in the documents of configurations: files are replaced by their content.

Plans are therefore self-contained, and errors name the file and line that they come from.
"""

import math
import warnings
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, TypeVar

from gen_data.config import base_model, paths, validation
from gen_data.config.problems import Position, Problems, refuse
from gen_data.config.yaml_tree import Node
from gen_data.core import errors, se3
from gen_data.core.lens import COEFFICIENTS
from gen_data.sensors.calibration.calibration import CalibratedCamera, Calibration
from gen_data.sensors.calibration.read_calibration import read_calibration
from gen_data.sensors.camera.lens_models import CalibratedLens
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.mounting import Mounting

M = TypeVar("M", bound=base_model.Strict)
_UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_FAR_M = 20.0
"""A longer distance of a sensor from its rig is probably in another unit."""
_EXCLUDED = {
    "lens": ("hfov_deg", "intrinsics"),
    "mounting": ("offset_m", "yaw_deg", "pitch_deg", "roll_deg"),
}


def load_calibrations(sensor: Node, field: str, wrists: Collection[str]) -> Node:
    """Replace the names of calibration files in a sensor's document by their content.

    Args:
        sensor: The document; a sensor without such names is returned unchanged.
        field: Path of the sensor in messages: ``sensors[0]``.
        wrists: Names of the rigs on hands of robots: X points out of the hand.

    Raises:
        ConfigError: a file cannot be read, has another layout, or describes a sensor without
            counterpart here.
    """
    if not isinstance(sensor.content, Mapping):
        return sensor
    _warn_of_unfit_numbers(sensor, field)
    content = dict(sensor.content)
    lens, mounting = content.get("lens"), content.get("mounting")
    if lens is not None and lens.get("file") is not None:
        content |= _load_lens(sensor, lens, field)
    if mounting is not None and mounting.get("file") is not None:
        content |= _load_mounting(sensor, mounting, field, wrists)
        del content["mounting"]
    return replace(sensor, content=content)


def _load_lens(sensor: Node, lens: Node, field: str) -> dict[str, Node]:
    """The lens, intrinsics and size of a camera in a calibration file."""
    _check_alone(sensor, "lens", field)
    asked = _validated(lens, CalibratedLens, f"{field}.lens")
    file = lens.entries["file"]
    calibration = _read(
        file, f"{field}.lens.file", fisheye=asked.fisheye, rectified=asked.rectified
    )
    try:
        camera = calibration.camera(asked.camera)
    except ValueError as error:
        refuse((lens.get("camera") or file).position, f"{field}.lens.camera", str(error))
    _warn_of_swapped_size(camera, file.text)
    if camera.unstated and lens.get("fisheye") is None:
        message = (
            f"{camera.position}: four coefficients count as k1 k2 p1 p2; state fisheye: true if "
            "they are of OpenCV's fisheye module, which writes four, else fisheye: false"
        )
        warnings.warn(message, errors.ConfigWarning, stacklevel=3)
    _check_known_size(sensor, camera, f"{field}.lens.file", file)
    place = camera.position
    if asked.field_deg is not None and not camera.coefficients:
        fact = f"a lens '{camera.model}', as in {file.text}, has no limit to its field"
        refuse(lens.entries["field_deg"].position, f"{field}.lens.field_deg", fact)
    found = {
        "lens": _node(place, _lens_entries(camera, asked.field_deg)),
        "intrinsics": _node(place, _numbers_of(camera)),
    }
    if sensor.get("size_px") is None and camera.size_px is not None:
        found["size_px"] = _node(place, list(camera.size_px))
    return found


def _load_mounting(
    sensor: Node, mounting: Node, field: str, wrists: Collection[str]
) -> dict[str, Node]:
    """The place on its rig of a sensor in a calibration file."""
    _check_alone(sensor, "mounting", field)
    asked = _validated(mounting, Mounting, f"{field}.mounting")
    file = mounting.entries["file"]
    calibration = _read(file, f"{field}.mounting.file", rectified=asked.rectified)
    try:
        frame, base = calibration.ends(asked.frame, asked.relative_to)
        pose = calibration.mount(frame, base, axes=asked.axes, relative_axes=asked.relative_axes)
    except ValueError as error:
        refuse(mounting.position, f"{field}.mounting", str(error))
    rig = sensor.get("rig")
    is_unstated = asked.relative_axes is None and not calibration.frames[base].optical
    if rig is not None and rig.text in wrists and is_unstated:
        fact = (
            f"the rig '{rig.text}' has X out of the hand; state the axes of '{base}': "
            "relative_axes: hand (Z out of it, as of the link of a gripper) or body"
        )
        refuse(mounting.position, f"{field}.mounting.relative_axes", fact)
    place = place_of(pose, _UNITS[asked.unit])
    distance_m = math.hypot(*place["offset_m"])
    if distance_m > _FAR_M:
        message = (
            f"{file.position}: {field}.mounting: '{frame}' is {distance_m:g} m from '{base}'; if "
            f"the lengths in {file.text} are millimetres, state unit: mm"
        )
        warnings.warn(message, errors.ConfigWarning, stacklevel=3)
    return {name: _node(file.position, value) for name, value in place.items()}


def place_of(T_rig_sensor: se3.SE3, unit_m: float = 1.0) -> dict[str, Any]:
    """A pose on a rig as the fields of a sensor."""
    angles = (round(math.degrees(a), 9) + 0.0 for a in se3.turns_of(T_rig_sensor))
    offset_m = [round(unit_m * v, 9) + 0.0 for v in T_rig_sensor.translation_m]
    return {
        "offset_m": offset_m,
        **dict(zip(("yaw_deg", "pitch_deg", "roll_deg"), angles, strict=True)),
    }


def _read(file: Node, field: str, *, fisheye: bool = False, rectified: bool = False) -> Calibration:
    """Read a file that a configuration names, and warn of entries without effect."""
    path = paths.find_path(file.text, file.position, field, "file")
    calibration = read_calibration(path, fisheye=fisheye, rectified=rectified)
    for choice, is_stated in (("fisheye", fisheye), ("rectified", rectified)):
        if is_stated and choice not in calibration.choices:
            fact = f"selects nothing in {path}, {calibration.kind}; leave it out"
            refuse(file.position, field.replace(".file", f".{choice}"), fact)
    if calibration.unused:
        listed = ", ".join(calibration.unused)
        message = f"{path}: {calibration.kind}; not used: {listed}"
        warnings.warn(message, errors.ConfigWarning, stacklevel=2)
    return calibration


def _check_known_size(sensor: Node, camera: CalibratedCamera, field: str, file: Node) -> None:
    """Refuse a calibration of images of unknown size, or whose middle is not in the sensor's.

    Raises:
        ConfigError: the size is unknown, or does not fit the principal point.
    """
    size = sensor.get("size_px")
    if camera.size_px is not None:
        return
    if size is None:
        fact = f"{file.text} does not state the size of its images; give size_px, its width first"
        refuse(file.position, field, fact)
    fact = _unfit_center(camera.center_px, size)
    if fact:
        fact = (
            f"{fact}; expected size_px of the calibrated images, which {file.text} does not state"
        )
        refuse(size.position, field, fact)


def _unfit_center(center_px: tuple[float, float], size: Node) -> str:
    """The fact that a principal point is far from the middle of images; empty if it is not."""
    sides = [one.content for one in size.items]
    whole = [side for side in sides if isinstance(side, int) and side > 0]
    if len(whole) != 2 or len(sides) != 2:
        return ""
    (cx, cy), (width, height) = center_px, whole
    if max(abs(cx / width - 0.5), abs(cy / height - 0.5)) <= _OFF_CENTER:
        return ""
    place = f"the principal point ({cx:g}, {cy:g})"
    return f"{place} is far from the middle of {width} x {height} pixels"


def _warn_of_unfit_numbers(sensor: Node, field: str) -> None:
    """Warn of typed intrinsics of images of another size than the sensor's."""
    numbers, size = sensor.get("intrinsics"), sensor.get("size_px")
    if numbers is None or numbers.get("size_px") is not None:
        return
    if size is None and (sensor.get("type") or sensor).content == "rgb_camera":
        size = _node(numbers.position, list(RgbCamera.model_fields["size_px"].default))
    center = [numbers.entries[key].content for key in ("cx_px", "cy_px") if numbers.get(key)]
    if size is None or len(center) != 2 or not all(isinstance(c, (int, float)) for c in center):
        return
    cx, cy = (float(c) for c in center if isinstance(c, (int, float)))
    fact = _unfit_center((cx, cy), size)
    if fact:
        message = (
            f"{numbers.position}: {field}.intrinsics: {fact}; state size_px of the calibration"
        )
        warnings.warn(message, errors.ConfigWarning, stacklevel=3)


_OFF_CENTER = 0.3
"""Largest distance of a principal point from the middle, as a share of a side."""


def _warn_of_swapped_size(camera: CalibratedCamera, file: str) -> None:
    """Warn of a size that is far from its principal point and near to it with its sides swapped.

    numpy states the height of an image first.
    """
    if camera.size_px is None or camera.size_px[0] == camera.size_px[1]:
        return
    (cx, cy), (width, height) = camera.center_px, camera.size_px
    given = max(abs(cx / width - 0.5), abs(cy / height - 0.5))
    swapped = max(abs(cx / height - 0.5), abs(cy / width - 0.5))
    if given > 0.12 and swapped < 0.06:
        message = (
            f"{file}: the principal point ({cx:g}, {cy:g}) is far from the middle of {width} x "
            f"{height} pixels; is the size height before width?"
        )
        warnings.warn(message, errors.ConfigWarning, stacklevel=2)


def _check_alone(sensor: Node, key: str, field: str) -> None:
    for other in _EXCLUDED[key]:
        if sensor.get(other) is not None:
            place = sensor.key_position(other)
            refuse(place, f"{field}.{other}", f"the file that {key} names gives it: leave it out")


def _validated(node: Node, model: type[M], field: str) -> M:
    problems = Problems()
    found = validation.validate(node, model, problems, field)
    problems.raise_if_any()
    assert found is not None
    return found


def _lens_entries(camera: CalibratedCamera, field_deg: float | None) -> dict[str, Any]:
    names = COEFFICIENTS[camera.model]
    limit = {} if field_deg is None else {"field_deg": field_deg}
    return {"model": camera.model, **dict(zip(names, camera.coefficients, strict=True)), **limit}


def _numbers_of(camera: CalibratedCamera) -> dict[str, Any]:
    (fx, fy), (cx, cy) = camera.focal_px, camera.center_px
    numbers: dict[str, Any] = {"fx_px": fx, "fy_px": fy, "cx_px": cx, "cy_px": cy}
    size = {} if camera.size_px is None else {"size_px": list(camera.size_px)}
    return {**numbers, **size, "pixel_centers": camera.pixel_centers}


def _node(place: Position, value: Any) -> Node:
    """Plain data as a document, all at one place."""
    if isinstance(value, dict):
        return Node(place, {key: _node(place, one) for key, one in value.items()})
    if isinstance(value, list):
        return Node(place, tuple(_node(place, one) for one in value))
    return Node(place, value, text=str(value))
