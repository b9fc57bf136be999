"""Files of nuScenes: laser scans, radar detections, point labels and map masks.

================  =================================================================================
LIDAR_*.pcd.bin   float32 ``x y z intensity ring``: x right, y forward, z up; intensity 0 to 255;
                  ring 0 is the lowest laser
RADAR_*.pcd       PCD 0.7, binary, with the 18 fields of the ARS 408: x forward, y left, z up
lidarseg .bin     uint8 per point, index of a category
panoptic .npz     ``data``: uint16 per point, 1000 times the index plus the number of the instance
map .png          8-bit grey, 0.1 m per pixel: 255 where one may drive; the last row is at y = 0
================  =================================================================================

Reference: nuscenes-devkit (``data_classes.py``, ``map_mask.py``), and Continental, "ARS 404-21 and
ARS 408-21: technical documentation" (values of ``dyn_prop``, ``ambig_state``, ``pdh0``).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core.boxes import OrientedBox
from gen_data.core.lane_geometry import border_line
from gen_data.core.scene import Lane
from gen_data.core.se3 import SE3, Array
from gen_data.exporters.png import RowFilter, encode_png

BORDER_M = 0.019
"""Tolerance of the tests for points in boxes: 2 cm, less rounding."""
PANOPTIC_STRIDE = 1000
RINGS = 32
"""Lasers of nuScenes' scanner."""

RADAR_POINT = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("dyn_prop", "i1"),
        ("id", "<i2"),
        ("rcs", "<f4"),
        ("vx", "<f4"),
        ("vy", "<f4"),
        ("vx_comp", "<f4"),
        ("vy_comp", "<f4"),
        ("is_quality_valid", "i1"),
        ("ambig_state", "i1"),
        ("x_rms", "i1"),
        ("y_rms", "i1"),
        ("invalid_state", "i1"),
        ("pdh0", "i1"),
        ("vx_rms", "i1"),
        ("vy_rms", "i1"),
    ]
)
DYN_MOVING, DYN_STATIONARY, DYN_ONCOMING = 0, 1, 2
RADAR_STILL_M_S = 0.5
"""Compensated radial speed below which a detection counts as stationary."""
UNAMBIGUOUS, RMS_UNKNOWN, RARELY_FALSE = 3, 31, 1
"""``ambig_state`` of a velocity without ambiguity; errors without a value; false alarm < 25 %."""

MAP_PX_PER_M = 10
MAP_MARGIN_M, MAP_SIDE_MAX_M, EMPTY_MAP_SIDE_M = 50, 4000, 100
DRIVEABLE = frozenset({"driving", "parking", "bicycle", "crosswalk"})
"""Kinds of lanes on the carriageway."""


def quarter_turns(T_ego_lidar: SE3) -> int:
    """Quarter turns about Z from a scanner's frame to its files' frame.

    The latter's y axis is the axis of the former that is nearest to the ego's forward axis.
    """
    rotation = T_ego_lidar.rotation()
    yaw_rad = math.atan2(rotation[1, 0], rotation[0, 0])
    return (-round(2.0 * yaw_rad / math.pi) - 1) % 4


def turned_pose(pose: SE3, turns: int) -> SE3:
    """Pose of the file's frame of a scanner with this pose."""
    half = math.sqrt(0.5)
    z_turns = ((1.0, 0.0), (half, half), (0.0, 1.0), (half, -half))
    w, z = z_turns[turns]
    return pose @ SE3((0.0, 0.0, 0.0), (w, 0.0, 0.0, z))


def lidar_bytes(points: NDArray[np.void], turns: int) -> bytes:
    """Encode a sweep.

    Args:
        points: Records of ``POINT`` [n].
        turns: Result of ``quarter_turns``.
    """
    x, y, z = points["position_m"].T
    ahead, left = ((x, y), (y, -x), (-x, -y), (-y, x))[turns]
    ring = points["ring"].astype(np.int64)
    count = max(RINGS, 1 << int(ring.max(initial=0)).bit_length())
    intensity = np.rint(255.0 * points["intensity"])
    return np.column_stack([ahead, left, z, intensity, count - 1 - ring]).astype("<f4").tobytes()


def radar_bytes(rows: NDArray[np.void]) -> bytes:
    """Encode the detections of a radar; ``rows`` have the columns of ``Radar``.

    Velocities are the radial one, along x and y; no radar measures the other component. Without
    detections there is one point of NaN, as readers expect.
    """
    if len(rows) == 0:
        nothing = np.zeros(1, RADAR_POINT)
        for name in RADAR_POINT.names or ():
            if RADAR_POINT[name].kind == "f":
                nothing[name] = np.nan
        return _pcd_bytes(nothing)
    azimuth, elevation = (rows[k].astype(np.float64) for k in ("azimuth_rad", "elevation_rad"))
    level = np.cos(elevation)
    towards = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
    # The last bits of sines depend on the processor.
    towards = np.round(towards, 9)
    points = np.zeros(len(rows), RADAR_POINT)
    points["x"], points["y"], points["z"] = towards * rows["range_m"]
    points["vx"], points["vy"] = towards[:2] * rows["velocity_m_s"]
    compensated = rows["velocity_compensated_m_s"]
    points["vx_comp"], points["vy_comp"] = towards[:2] * compensated
    moving = np.where(compensated < 0.0, DYN_ONCOMING, DYN_MOVING)
    still = np.abs(compensated) < RADAR_STILL_M_S
    points["dyn_prop"] = np.where(still, DYN_STATIONARY, moving)
    points["id"], points["rcs"] = np.arange(len(rows)), rows["rcs_dbsm"]
    points["is_quality_valid"], points["ambig_state"] = 1, UNAMBIGUOUS
    points["pdh0"] = RARELY_FALSE
    for name in ("x_rms", "y_rms", "vx_rms", "vy_rms"):
        points[name] = RMS_UNKNOWN
    return _pcd_bytes(points)


def _pcd_bytes(points: NDArray[np.void]) -> bytes:
    count = len(points)
    names = RADAR_POINT.names or ()
    kinds = [RADAR_POINT[name] for name in names]
    lines = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        "FIELDS " + " ".join(names),
        "SIZE " + " ".join(str(kind.itemsize) for kind in kinds),
        "TYPE " + " ".join(kind.kind.upper() for kind in kinds),
        "COUNT " + " ".join("1" for _ in names),
        f"WIDTH {count}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {count}",
        "DATA binary",
    ]
    # The devkit expects at least one byte after the last point.
    return ("\n".join(lines) + "\n").encode("ascii") + points.tobytes() + b"\n"


@dataclass(frozen=True, eq=False, slots=True)
class BoxPoints:
    """Points of a sweep by box.

    Attributes:
        counts: Number of points in the box of each instance.
        members: Instance of each point, int64 [n]; 0 = none.
    """

    counts: Mapping[int, int]
    members: NDArray[np.int64]


def points_in_boxes(
    points: NDArray[np.void], T_boxes_lidar: SE3, boxes: Mapping[int, OrientedBox]
) -> BoxPoints:
    """Assign points to boxes.

    Within ``BORDER_M`` of a face, on either side, a box contains the points of its instance
    only: noise-free points lie on the faces, and the road lies under all of them. Points of
    instances without a box, and of none, belong to a box that contains them.

    Args:
        points: Records of ``POINT`` [n].
        T_boxes_lidar: Pose of the scanner in the frame of the boxes.
        boxes: By instance id.
    """
    ids = points["instance_id"].astype(np.int64)
    members, counts = ids.copy(), {}
    boxed = np.zeros(1 + max([0, *boxes, int(ids.max(initial=0))]), np.bool_)
    boxed[list(boxes)] = True
    free = ~boxed[ids]
    T_lidar_frame = T_boxes_lidar.inverse()
    # By coordinate: the first test rejects most points, and sums over three columns are slow.
    xyz = [np.ascontiguousarray(points["position_m"][:, k], np.float64) for k in range(3)]
    for number in sorted(boxes):
        box = boxes[number].seen_from(T_lidar_frame)
        near, depth_m = _depths_m(xyz, box)
        own = ids[near] == number
        counts[number] = int(np.count_nonzero(depth_m >= np.where(own, -BORDER_M, BORDER_M)))
        inside = near[depth_m > BORDER_M]
        members[inside[free[inside]]] = number
    return BoxPoints(counts, members)


def _depths_m(xyz: Sequence[Array], box: OrientedBox) -> tuple[NDArray[np.intp], Array]:
    """Points near a box, and their distances to its nearest face; negative outside."""
    reach_m = 0.5 * math.hypot(*box.size_m) + BORDER_M
    center = box.T_frame_box.translation_m
    (near,) = np.nonzero(np.abs(xyz[0] - center[0]) < reach_m)
    near = near[np.abs(xyz[1][near] - center[1]) < reach_m]
    offsets = [xyz[k][near] - center[k] for k in range(3)]
    axes = box.T_frame_box.rotation()
    depth_m = np.full(len(near), np.inf)
    for k in range(3):
        along = offsets[0] * axes[0, k] + offsets[1] * axes[1, k] + offsets[2] * axes[2, k]
        np.minimum(depth_m, 0.5 * box.size_m[k] - np.abs(along), out=depth_m)
    return near, depth_m


def panoptic_labels(
    labels: NDArray[np.uint8], members: NDArray[np.int64], numbers: Mapping[int, int]
) -> NDArray[np.uint16]:
    """Combine category and instance of each point, uint16 [n].

    Args:
        labels: Indices of categories [n].
        members: Instance ids [n].
        numbers: Number within its category, 1 to 999, by instance id; others have number 0.
    """
    table = np.zeros(1 + max([int(members.max(initial=0)), *numbers]), np.uint16)
    for instance_id, number in numbers.items():
        table[instance_id] = number
    combined: NDArray[np.uint16] = (labels * np.uint16(PANOPTIC_STRIDE) + table[members]).astype(
        "<u2"
    )
    return combined


def panoptic_bytes(labels: NDArray[np.uint16]) -> bytes:
    """Encode panoptic labels; uncompressed, as bytes of zlib depend on its build."""
    file = BytesIO()
    np.savez(file, data=labels)
    return file.getvalue()


@dataclass(frozen=True, slots=True)
class MapArea:
    """Area of a map mask in the world; its lower left corner is the origin of the global frame.

    Attributes:
        low_m: Smallest x and y, whole metres.
        size_m: Extent, whole metres.
    """

    low_m: tuple[int, int]
    size_m: tuple[int, int]

    @property
    def T_global_world(self) -> SE3:  # noqa: N802
        """Pose of the world in the global frame."""
        return SE3((-float(self.low_m[0]), -float(self.low_m[1]), 0.0))


def map_area(lanes: Sequence[Lane]) -> MapArea:
    """Area around all lanes; a square around the origin if there are none."""
    points = [point for lane in lanes for point in lane.center_m]
    if not points:
        half = EMPTY_MAP_SIDE_M // 2
        return MapArea((-half, -half), (2 * half, 2 * half))
    place = np.array(points)[:, :2]
    low = np.floor(place.min(axis=0)).astype(int) - MAP_MARGIN_M
    high = np.ceil(place.max(axis=0)).astype(int) + MAP_MARGIN_M
    excess = np.maximum(high - low - MAP_SIDE_MAX_M, 0)
    low += excess // 2
    size = np.minimum(high - low, MAP_SIDE_MAX_M)
    return MapArea((int(low[0]), int(low[1])), (int(size[0]), int(size[1])))


def map_bytes(lanes: Sequence[Lane], area: MapArea) -> bytes:
    """Draw the driveable surface as PNG."""
    width, height = (MAP_PX_PER_M * side for side in area.size_m)
    mask = np.zeros((height, width), np.uint8)
    for lane in lanes:
        if lane.kind in DRIVEABLE and len(lane.center_m) > 1:
            outline = (*border_line(lane, "left"), *reversed(border_line(lane, "right")))
            x, y = (np.array(outline)[:, :2] - area.low_m).T
            # The devkit reads row height - 10 y; single bits of a pixel are drawn, too.
            uv = np.stack([MAP_PX_PER_M * x, height - MAP_PX_PER_M * y], axis=1)
            cv2.fillPoly(mask, [np.rint(uv * 16).astype(np.int32)], 255, shift=4)
    return encode_png(mask, RowFilter.UP, 2)
