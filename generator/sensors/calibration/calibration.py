"""Content of a calibration file, in one form for all formats, and the reading of numbers in it."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np

from gen_data.config import problems, yaml_scalars
from gen_data.config.yaml_tree import Node
from gen_data.core import errors, lens, scene_time, se3

LARGEST = 1e9
"""Largest number of a calibration: no pixel, length or coefficient is larger."""
ROTATION_ERROR_MAX = 1e-2
"""Largest entry of ``R R^T - 1`` of matrices that were printed with few digits."""


AXES: Mapping[str, se3.SE3] = {
    "body": se3.SE3(),
    "optical": scene_time.RIG_AXES,
    "hand": scene_time.HAND_RIG_AXES,
}
"""``T_frame_rig`` of frames by their axes: a rig's are X forward, Y left, Z up."""


@dataclass(frozen=True, slots=True)
class CalibratedCamera:
    """Intrinsics of one camera as its file has them.

    Attributes:
        position: Position of its numbers in the file.
        focal_px, center_px: fx, fy and cx, cy.
        coefficients: All of ``COEFFICIENTS[model]``, in that order.
        size_px: Size of the calibrated images; None = the file does not state it.
        pixel_centers: Where pixel centres lie in its image coordinates: at integers (OpenCV, ROS,
            Kalibr, KITTI) or halves (COLMAP).
        unstated: Whether its four coefficients may be of a fisheye: the file does not state it.
    """

    position: problems.Position
    focal_px: tuple[float, float]
    center_px: tuple[float, float]
    model: lens.LensModel = "pinhole"
    coefficients: tuple[float, ...] = ()
    size_px: tuple[int, int] | None = None
    pixel_centers: str = "integers"
    unstated: bool = False


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame of a rig.

    Attributes:
        parent: Name of the frame that its pose refers to; empty = a root.
        T_parent_frame: Its pose.
        optical: Whether it is X right, Y down, Z forward; else X forward, Y left, Z up.
    """

    parent: str = ""
    T_parent_frame: se3.SE3 = se3.IDENTITY
    optical: bool = False


@dataclass(frozen=True)
class Calibration:
    """Content of a calibration file.

    Attributes:
        file: Its path, for messages.
        kind: Its format in words.
        cameras: By name; the reason why there is none here instead of a camera.
        frames: By name; an ancestor of every frame is a root.
        unused: Names of entries that have no effect here.
        choices: Names of the settings that select a camera of this format: fisheye, rectified.
    """

    file: str
    kind: str
    cameras: Mapping[str, CalibratedCamera | errors.ConfigError] = field(default_factory=dict)
    frames: Mapping[str, Frame] = field(default_factory=dict)
    unused: Sequence[str] = ()
    choices: Collection[str] = ()

    def camera(self, name: str) -> CalibratedCamera:
        """The camera of that name; an empty name stands for the only one.

        Raises:
            ValueError: there is none, or there are several.
            ConfigError: no lens here is like its lens.
        """
        if name or len(self.cameras) != 1:
            name = self._known(name, list(self.cameras), "camera")
        found = self.cameras[name] if name else next(iter(self.cameras.values()))
        if isinstance(found, errors.ConfigError):
            raise found
        return found

    def mount(
        self, frame: str, relative_to: str = "", *, axes: str | None = None,
        relative_axes: str | None = None,
    ) -> se3.SE3:  # fmt: skip
        """``T_rig_sensor`` of a frame, both X forward, Y left, Z up.

        Args:
            frame: Its name; empty = the only one that is not a root.
            relative_to: Name of the frame of the rig; empty = the root above ``frame``.
            axes: Axes of ``frame``, a key of ``AXES``; None = as the format has them.
            relative_axes: Axes of the frame of the rig, alike.

        Raises:
            ValueError: a name is unknown, or no chain of poses connects them.
        """
        frame, base = self.ends(frame, relative_to)
        root, T_root_frame = self._from_root(frame)
        base_root, T_root_base = self._from_root(base)
        if root != base_root:
            raise ValueError(f"{self.file} does not connect the frames '{base}' and '{frame}'")
        T_base_rig, T_frame_sensor = (
            AXES[stated or ("optical" if self.frames[name].optical else "body")]
            for name, stated in ((base, relative_axes), (frame, axes))
        )
        T_base_frame = T_root_base.inverse() @ T_root_frame
        return T_base_rig.inverse() @ T_base_frame @ T_frame_sensor

    def ends(self, frame: str, relative_to: str = "") -> tuple[str, str]:
        """Full names of the frames of a sensor and of its rig; see ``mount``.

        Raises:
            ValueError: a name is unknown.
        """
        inner = [name for name, one in self.frames.items() if one.parent]
        if not frame and len(inner) == 1:
            frame = inner[0]
        frame = self._known(frame, list(self.frames), "frame")
        root, _ = self._from_root(frame)
        return frame, self._known(relative_to or root, list(self.frames), "frame")

    def _from_root(self, name: str) -> tuple[str, se3.SE3]:
        """The root above a frame, and ``T_root_frame``."""
        pose, seen = se3.SE3(), {name}
        while self.frames[name].parent:
            pose = self.frames[name].T_parent_frame @ pose
            name = self.frames[name].parent
            if name in seen:
                raise ValueError(f"{self.file}: frame '{name}' is its own ancestor")
            seen.add(name)
        return name, pose

    def _known(self, name: str, known: list[str], kind: str) -> str:
        if name in known:
            return name
        place = f"{self.file}, {self.kind},"
        if not known:
            raise ValueError(f"{place} has no {kind}s; expected a file that has")
        what = f"has no {kind} '{name}'" if name else f"has several {kind}s: name one"
        near = errors.did_you_mean(name, known)
        raise ValueError(f"{place} {what}; expected one of {', '.join(known)}{near}")


def fail(node: Node, field_name: str, fact: str) -> NoReturn:
    """Raise a ConfigError at a node of a file."""
    problems.refuse(node.position, field_name, fact)


def attempt(read: Callable[[], CalibratedCamera]) -> CalibratedCamera | errors.ConfigError:
    """A camera, or the reason why there is none: others of its file, and its place, are usable."""
    try:
        return read()
    except errors.ConfigError as error:
        return error


def finite(given: object) -> float:
    """A number as Python reads it.

    Raises:
        ValueError: it is not a number, not a finite one, or beyond ``LARGEST``.
    """
    value = float(given)  # type: ignore[arg-type]
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    if abs(value) > LARGEST:
        raise ValueError(f"{value:g} is too large, expected at most {LARGEST:g}")
    return value


def numbers(node: Node, count: Sequence[int], name: str) -> list[float]:
    """Read a list of numbers, possibly nested in rows, or the ``data`` of a matrix of OpenCV.

    Args:
        node: The list or matrix.
        count: Allowed lengths.
        name: Name of the entry, in messages.

    Raises:
        ConfigError: it is not such a list.
    """
    given = node.get("data") or node
    leaves: list[Node] = []
    stack = [given]
    while stack:
        one = stack.pop()
        if one.items:
            stack.extend(reversed(one.items))
        elif one.content != ():
            leaves.append(one)
    values = []
    for leaf in leaves:
        if isinstance(leaf.content, bool) or not isinstance(leaf.content, (int, float)):
            packed = node.get("data") and len(leaves) == 1
            hint = "; write it without Base64" if packed else ""
            fact = f"expected a number, got {yaml_scalars.quote_value(leaf.plain())}"
            fail(leaf, name, fact + hint)
        try:
            values.append(finite(leaf.content))
        except ValueError as error:
            fail(leaf, name, str(error))
    if len(leaves) not in count:
        wanted = " or ".join(str(n) for n in sorted(count))
        fail(given, name, f"expected {wanted} numbers, got {len(leaves)}")
    return values


def camera_matrix(
    node: Node, name: str, columns: int = 3, *, by_columns: bool = False
) -> tuple[float, float, float, float]:
    """Fx, fy, cx and cy of a calibration matrix [3, columns].

    Args:
        node: Its numbers, row by row.
        name: Name of the entry, in messages.
        columns: 3, or 4 of a projection matrix.
        by_columns: Whether they may also be listed column by column.

    Raises:
        ConfigError: it is not the matrix of a camera without skew.
    """
    K = np.array(numbers(node, [3 * columns], name)).reshape(3, columns)
    if by_columns and not K[:2, 2].any():
        K = K.T
    check_matrix(K, node, name)
    return (float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))


def check_matrix(K: se3.Array, node: Node, name: str) -> None:
    """Raise ConfigError unless a matrix [3, 3 or 4] is ``fx 0 cx, 0 fy cy, 0 0 1``."""
    if not np.isfinite(K).all():
        fail(node, name, "has a number that is not finite")
    check_focal(K[0, 0], K[1, 1], node, name)
    if np.abs(K[2, :3] - (0.0, 0.0, 1.0)).max() > 1e-9:
        row = " ".join(f"{value:g}" for value in K[2, :3])
        hint = "; transpose it; of MATLAB, subtract 1 from cx and cy too: its first pixel is (1, 1)"
        fact = f"its third row is {row}, expected 0 0 1"
        fail(node, name, fact + (hint if max(np.abs(K[:2, 2])) == 0.0 else ""))
    if max(abs(K[0, 1]), abs(K[1, 0])) > 1e-9 * K[0, 0]:
        skew = K[0, 1] or K[1, 0]
        fact = f"skew {skew:g} has no place in a camera here; expected 0: calibrate without skew"
        fail(node, name, f"{fact} (OpenCV: CALIB_FIX_SKEW)")


def check_focal(fx: float, fy: float, node: Node, name: str) -> None:
    """Raise ConfigError for focal lengths below a thousandth of a pixel."""
    if min(fx, fy) < 1e-3:
        fail(node, name, f"focal lengths must be positive, got {fx:g} and {fy:g}")


def rigid(values: Sequence[float], node: Node, name: str) -> se3.SE3:
    """Pose of 12 or 16 numbers, the rows of a matrix.

    Raises:
        ConfigError: its first three columns are not a rotation, or its last row is not 0 0 0 1.
    """
    matrix = np.array(values).reshape(-1, 4)
    if len(matrix) == 4 and np.abs(matrix[3] - (0.0, 0.0, 0.0, 1.0)).max() > 1e-9:
        row = " ".join(f"{value:g}" for value in matrix[3])
        fail(node, name, f"its last row is {row}, expected 0 0 0 1; is the matrix transposed?")
    check_rotation(matrix[:3, :3], node, name)
    return se3.SE3.from_matrix(matrix)


def check_rotation(R: se3.Array, node: Node, name: str) -> None:
    """Raise ConfigError unless a matrix [3, 3] is a rotation, to a few digits."""
    if np.abs(R @ R.T - np.eye(3)).max() > ROTATION_ERROR_MAX or np.linalg.det(R) < 0.0:
        fail(node, name, "is not a rotation: its rows are not orthonormal and right-handed")
