"""Queries of lanes: border lines under a footprint, and the traffic light of a lane."""

from __future__ import annotations

import numpy as np

from gen_data.generator.core.lane_geometry import LaneLine
from gen_data.generator.core.scene import Instance, Lane, Scene
from gen_data.generator.core.se3 import SE3, Array

SIGNAL_M = 15.0
"""Largest distance between a traffic light and the end of its lane."""
FACING_COSINE_MAX = -np.sqrt(0.5)
"""Largest cosine between a light's front and the direction of its lane: 45 degrees off."""


def lane_border_pieces(scene: Scene) -> Array:
    """Segments of the lines on both sides of driving lanes outside junctions, world, [n, 2, 2]."""
    pieces = [
        line
        for lane in scene.lanes
        if lane.kind == "driving" and not lane.junction
        for line in _side_segments(lane)
    ]
    return np.concatenate(pieces) if pieces else np.zeros((0, 2, 2))


def is_crossed(pieces: Array, T_world_box: SE3, half_m: tuple[float, float, float]) -> Array:
    """Whether a line lies under the left and the right half of a footprint, bool [2].

    Args:
        pieces: As returned by ``lane_border_pieces``.
        T_world_box: Pose of the box.
        half_m: Half extents of the box.
    """
    forward = T_world_box.rotation()[:2, 0]
    forward = forward / np.sqrt(forward @ forward)
    axes = np.stack([forward, np.array([-forward[1], forward[0]])])
    local = (pieces - np.array(T_world_box.translation_m[:2])) @ axes.T
    start, span = local[:, 0], local[:, 1] - local[:, 0]
    # Slab test of segments against the footprint; the epsilon avoids 0 / 0 for parallel ones.
    span = np.where(np.abs(span) < 1e-12, 1e-12, span)
    bounds = np.array([half_m[0], half_m[1]])
    times = np.stack([(-bounds - start) / span, (bounds - start) / span])
    enter = np.maximum(times.min(axis=0).max(axis=1), 0.0)
    leave = np.minimum(times.max(axis=0).min(axis=1), 1.0)
    under = enter <= leave
    aside = (start + 0.5 * (enter + leave)[:, None] * span)[under, 1]
    return np.array([bool((aside >= 0.0).any()), bool((aside < 0.0).any())])


def governing_light(scene: Scene, T_world_box: SE3, within_m: float) -> Instance | None:
    """The traffic light of the lane that a box is on; None if there is none.

    It is the nearest light to the lane's end that has a state and faces the lane's traffic; the
    end must be within ``within_m`` of the box, along the lane.
    """
    found = _find_lane(scene, T_world_box)
    if found is None:
        return None
    line, at_m = found
    if line.length_m - at_m > within_m:
        return None
    end = line.pose(line.length_m)
    direction, position = end.rotation()[:2, 0], np.array(end.translation_m[:2])
    lights = []
    for instance in scene.instances:
        state = dict(instance.attributes).get("state", "")
        if instance.category != "traffic_light" or instance.subcategory == "pedestrian":
            continue
        front = instance.T_world_instance.rotation()[:2, 0]
        gap = np.array(instance.T_world_instance.translation_m[:2]) - position
        away_m = float(np.sqrt(gap @ gap))
        if state and away_m < SIGNAL_M and float(front @ direction) < FACING_COSINE_MAX:
            lights.append((away_m, instance.instance_id, instance))
    return min(lights, key=lambda light: light[:2])[2] if lights else None


def _side_segments(lane: Lane) -> tuple[Array, Array]:
    """Segments of the left and the right border of a lane, [n, 2, 2] each."""
    centre = np.asarray(lane.center_m, dtype=np.float64)[:, :2]
    along = np.gradient(centre, axis=0)
    along /= np.sqrt(np.sum(along**2, axis=1, keepdims=True))
    left = 0.5 * lane.width_m * np.stack([-along[:, 1], along[:, 0]], axis=1)
    lines = (centre + left, centre - left)
    one, other = (np.stack([line[:-1], line[1:]], axis=1) for line in lines)
    return one, other


def _find_lane(scene: Scene, T_world_box: SE3) -> tuple[LaneLine, float] | None:
    """The nearest driving lane below a box with its heading, and the arc length [m] on it."""
    position = np.array(T_world_box.translation_m[:2])
    heading = T_world_box.rotation()[:2, 0]
    best: tuple[float, Lane, float] | None = None
    for lane in scene.lanes:
        if lane.kind != "driving" or lane.junction:
            continue
        centre = np.asarray(lane.center_m, dtype=np.float64)[:, :2]
        span = np.diff(centre, axis=0)
        share = np.sum((position - centre[:-1]) * span, axis=1) / np.sum(span**2, axis=1)
        gaps = position - centre[:-1] - np.clip(share, 0.0, 1.0)[:, None] * span
        distances = np.sqrt(np.sum(gaps**2, axis=1))
        k = int(distances.argmin())
        beyond = (k == len(span) - 1 and share[k] > 1.0) or (k == 0 and share[k] < 0.0)
        if beyond or distances[k] > 0.5 * lane.width_m or span[k] @ heading <= 0.0:
            continue
        if best is None or distances[k] < best[0]:
            at_m = LaneLine(lane).at_m
            along_m = at_m[k] + float(np.clip(share[k], 0.0, 1.0)) * (at_m[k + 1] - at_m[k])
            best = (float(distances[k]), lane, along_m)
    return None if best is None else (LaneLine(best[1]), best[2])
