"""Lines of lanes in an image: pixels, places, visibility, paint, and their order around the camera.

Pixels and visibility are from the annotation ``lanes``. Places follow from the borders of the
scene, which are projected again.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gen_data.core.interfaces import AssetLibrary
from gen_data.core.lane_geometry import lane_borders
from gen_data.core.lane_projection import project_borders
from gen_data.core.sample import BorderTruth, Sample
from gen_data.core.scene import Camera, Lane, Scene
from gen_data.core.se3 import SE3, Array
from gen_data.exporters.road_map import Divider, Paint, PaintIndex, find_paint

NEAR_M, ALONG = 30.0, 0.7
"""Lines of the ego's road: they begin this near to the camera, and the cosine between their
direction and its view is at least this."""
ABSENT = -2
"""Column at a row that a line does not cross."""
SIDES = {-2: "left-left", -1: "left", 1: "right", 2: "right-right"}
"""Names of the lines next to the camera, by their number from it; the left ones are negative."""


@dataclass(frozen=True, eq=False, slots=True)
class LaneLine:
    """A stretch of a border in one image, from its nearest point on.

    Attributes:
        name: Name of the ``LaneBorder``.
        number: Number of the border in its world, from 1.
        points_px: Image coordinates [n, 2].
        points_m: Points in the level frame below the camera, X along its view, Y left [n, 3].
        visible: Whether each point is visible, bool [n].
        paint: Its paint: the most frequent one of its points.
        is_edge: Whether it is an edge of the carriageway.
        side: Key of ``SIDES``; 0 = it is not one of the four lines next to the camera.
    """

    name: str
    number: int
    points_px: Array
    points_m: Array
    visible: NDArray[np.bool_]
    paint: Paint
    is_edge: bool
    side: int

    @property
    def left_m(self) -> float:
        """Distance of its nearest point to the left of the camera's view."""
        return float(self.points_m[0, 1])


class PaintedWorlds:
    """Borders of the latest world with their paint, which all its images share."""

    def __init__(self, assets: AssetLibrary) -> None:
        """Keep the library."""
        self._assets = assets
        self._lanes: tuple[int, tuple[Lane, ...]] = (-1, ())
        self._paint: PaintIndex | None = None
        self._dividers: dict[str, Divider] = {}

    def dividers(self, sample: Sample, sensor: str) -> Mapping[str, Divider]:
        """At least the borders in an image, by name."""
        scene = sample.scene_of(sensor)
        names = {stretch.border for stretch in sample.truth[sensor].borders or ()}
        if self._paint is None or self._lanes != (sample.scene_index, scene.lanes):
            self._lanes, self._dividers = (sample.scene_index, scene.lanes), {}
            self._paint = find_paint(scene, self._assets)
        for border in lane_borders(scene.lanes):
            if border.name in names and border.name not in self._dividers:
                self._dividers[border.name] = self._paint.divider(border)
        return self._dividers


def vehicle_pose(scene: Scene, camera: Camera) -> SE3:
    """``T_camera_vehicle``: X forward, Y left, Z up, its origin on the ground.

    The vehicle is the rig of the camera. A camera without one has a level vehicle below it, on the
    ground of the nearest lane.
    """
    if camera.rig:
        return camera.T_rig_camera.inverse()
    x_m, y_m, _ = camera.T_world_camera.translation_m
    ahead = camera.T_world_camera.rotate(np.array([0.0, 0.0, 1.0]))
    points = np.array([point for lane in scene.lanes for point in lane.center_m] or [(x_m, y_m, 0)])
    nearest = np.argmin(((points[:, :2] - (x_m, y_m)) ** 2).sum(axis=1))
    yaw = float(np.arctan2(ahead[1], ahead[0]))
    T_world_vehicle = SE3.about_z(yaw, (x_m, y_m, float(points[nearest, 2])))
    return camera.T_world_camera.inverse() @ T_world_vehicle


def level_pose(scene: Scene, camera: Camera) -> SE3:
    """``T_level_camera``: X along the view, Y left, Z up; the origin is below the camera.

    Up and the ground (Z = 0) are the vehicle's, but the view may be to its side or back.
    """
    T_vehicle_camera = vehicle_pose(scene, camera).inverse()
    x_m, y_m, _ = T_vehicle_camera.translation_m
    ahead = T_vehicle_camera.rotate(np.array([0.0, 0.0, 1.0]))
    yaw = float(np.arctan2(ahead[1], ahead[0]))
    return SE3.about_z(yaw, (x_m, y_m, 0.0)).inverse() @ T_vehicle_camera


def lane_lines(
    sample: Sample, sensor: str, dividers: Mapping[str, Divider], *, edges: bool = True
) -> tuple[LaneLine, ...]:
    """Lines of an image, with their numbers from the camera.

    Args:
        sample: Sample with the annotation ``lanes``.
        sensor: Name of the camera.
        dividers: Borders with paint, by name; see ``PaintedWorlds``.
        edges: Whether edges of the carriageway without paint are lines.
    """
    truth, scene = sample.truth[sensor], sample.scene_of(sensor)
    T_level_camera = level_pose(scene, truth.camera)
    borders = {b.name: (k, b) for k, b in enumerate(lane_borders(scene.lanes), 1)}
    lines = []
    for stretch, p_camera in _places(sample, sensor):
        number, border = borders[stretch.border]
        points_m = T_level_camera.apply(p_camera)
        order = slice(None) if points_m[0, 0] <= points_m[-1, 0] else slice(None, None, -1)
        paint = _common_paint(dividers[border.name], truth.camera.T_world_camera.apply(p_camera))
        is_edge = border.kind == "edge"
        if paint.style == "none" and not (is_edge and edges):
            continue
        points_px = np.array(stretch.points_px)[order]
        visible = np.array(stretch.visible)[order]
        lines.append(
            LaneLine(border.name, number, points_px, points_m[order], visible, paint, is_edge, 0)
        )
    return tuple(_numbered(lines))


def columns_at(points_px: Array, rows: Sequence[int]) -> list[float]:
    """Columns at which a line [n, 2] crosses image rows, with integer pixel centres; -2 = none.

    Of several crossings of a row, the one nearest to the start of the line is listed.
    """
    u, v = (np.asarray(points_px)[:, k] - 0.5 for k in (0, 1))
    wanted = np.array(rows)
    crossing = (v[:-1] - wanted[:, None]) * (v[1:] - wanted[:, None]) <= 0.0
    k = crossing.argmax(axis=1)
    rise = v[k + 1] - v[k]
    share = np.where(rise != 0.0, (wanted - v[k]) / np.where(rise != 0.0, rise, 1.0), 0.0)
    found = (u[k] + share * (u[k + 1] - u[k])).tolist()
    return [round(c, 2) + 0.0 if is_met else ABSENT
            for c, is_met in zip(found, crossing.any(axis=1).tolist(), strict=True)]  # fmt: skip


def _places(sample: Sample, sensor: str) -> Iterator[tuple[BorderTruth, Array]]:
    """Stretches of an image, and their points in the camera frame, where these are projected to."""
    scene, truth = sample.scene_of(sensor), sample.truth[sensor]
    shown = {stretch.border for stretch in truth.borders or ()}
    borders = [border for border in lane_borders(scene.lanes) if border.name in shown]
    numbers, p_camera, uv = project_borders(scene, truth.camera, borders, math.inf)
    keys = _keys(uv)
    ends = np.searchsorted(numbers, [k << 32 for k in range(len(borders) + 1)]).tolist()
    ranges = {b.name: slice(*e) for b, e in zip(borders, pairwise(ends), strict=True)}
    for stretch in truth.borders or ():
        one = ranges[stretch.border]
        wanted = np.array(stretch.points_px)
        known, own = keys[one], _keys(wanted)
        order = np.argsort(known, kind="stable")
        rows = order[np.minimum(np.searchsorted(known, own, sorter=order), len(known) - 1)]
        for k in np.flatnonzero(known[rows] != own):
            rows[k] = ((uv[one] - wanted[k]) ** 2).sum(axis=1).argmin()
        yield stretch, p_camera[one][rows]


def _keys(uv: Array) -> NDArray[np.int64]:
    """A number per place, in hundredths of pixels, as annotations state them."""
    places = np.clip(np.rint(uv * 100.0), -(2**30), 2**30).astype(np.int64)
    return np.asarray(places[:, 0] * 2**32 + places[:, 1])


def _common_paint(divider: Divider, p_world: Array) -> Paint:
    """The most frequent paint at points [n, 3]."""
    corners = np.asarray(divider.border.points_m)
    gaps = ((p_world[:, None, :2] - corners[None, :, :2]) ** 2).sum(axis=2)
    counts: Counter[Paint] = Counter()
    for corner, count in Counter(gaps.argmin(axis=1).tolist()).items():
        counts[divider.paint[corner]] += count
    return max(counts, key=lambda paint: counts[paint])


def _numbered(lines: Sequence[LaneLine]) -> Iterator[LaneLine]:
    """The lines, with the numbers of the two nearest ones on each side of the camera."""
    near = [line for line in lines if _is_own(line)]
    left = sorted((k for k in near if k.left_m >= 0.0), key=lambda k: k.left_m)
    right = sorted((k for k in near if k.left_m < 0.0), key=lambda k: -k.left_m)
    sides = {id(k): -n for n, k in enumerate(left[:2], 1)}
    sides |= {id(k): n for n, k in enumerate(right[:2], 1)}
    for line in lines:
        yield replace(line, side=sides.get(id(line), 0))


def _is_own(line: LaneLine) -> bool:
    """Whether a line begins near the camera and leads away from it."""
    step = line.points_m[min(5, len(line.points_m) - 1)] - line.points_m[0]
    ahead = step[0] / np.hypot(step[0], step[1]) if step[:2].any() else 0.0
    return bool(0.0 < line.points_m[0, 0] < NEAR_M and ahead > ALONG)
