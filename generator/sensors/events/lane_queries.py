"""Lines beside lanes, and what stands over them."""

from __future__ import annotations

import numpy as np

from gen_data.generator.core.lane_geometry import LaneLine
from gen_data.generator.core.scene import Instance, Lane, Scene
from gen_data.generator.core.se3 import SE3, Array

SIGNAL_M = 15.0
"""A light belongs to a lane that ends no farther from it than this."""
OPPOSITE = -np.sqrt(0.5)
"""Cosine of the most that a light may be turned away from those who come."""


def lane_border_pieces(scene: Scene) -> Array:
    """Pieces of the lines on both sides of driving lanes outside junctions, [n, 2, 2], world."""
    pieces = [
        line
        for lane in scene.lanes
        if lane.kind == "driving" and not lane.junction
        for line in _sides(lane)
    ]
    return np.concatenate(pieces) if pieces else np.zeros((0, 2, 2))


def is_crossed(pieces: Array, T_world_box: SE3, half_m: tuple[float, float, float]) -> Array:
    """Whether a line lies under the left and under the right half of a footprint, bool [2].

    Args:
        pieces: As of ``lane_border_pieces``.
        T_world_box: Middle of the box whose footprint it is.
        half_m: Half its edges.
    """
    forward = T_world_box.rotation()[:2, 0]
    forward = forward / np.sqrt(forward @ forward)
    axes = np.stack([forward, np.array([-forward[1], forward[0]])])
    local = (pieces - np.array(T_world_box.translation_m[:2])) @ axes.T
    start, way = local[:, 0], local[:, 1] - local[:, 0]
    way = np.where(np.abs(way) < 1e-12, 1e-12, way)
    bounds = np.array([half_m[0], half_m[1]])
    times = np.stack([(-bounds - start) / way, (bounds - start) / way])
    enter = np.maximum(times.min(axis=0).max(axis=1), 0.0)
    leave = np.minimum(times.max(axis=0).min(axis=1), 1.0)
    under = enter <= leave
    aside = (start + 0.5 * (enter + leave)[:, None] * way)[under, 1]
    return np.array([bool((aside >= 0.0).any()), bool((aside < 0.0).any())])


def governing_light(scene: Scene, T_world_box: SE3, within_m: float) -> Instance | None:
    """The traffic light at the end of the lane that a box is on; None if there is none.

    It stands near the lane's end, shows a state to those who come along the lane, and lies no
    farther ahead than ``within_m``.
    """
    found = _lane_under(scene, T_world_box)
    if found is None:
        return None
    line, at_m = found
    if line.length_m - at_m > within_m:
        return None
    end = line.pose(line.length_m)
    direction, place = end.rotation()[:2, 0], np.array(end.translation_m[:2])
    lights = []
    for instance in scene.instances:
        state = dict(instance.attributes).get("state", "")
        if instance.category != "traffic_light" or instance.subcategory == "pedestrian":
            continue
        front = instance.T_world_instance.rotation()[:2, 0]
        gap = np.array(instance.T_world_instance.translation_m[:2]) - place
        away_m = float(np.sqrt(gap @ gap))
        if state and away_m < SIGNAL_M and float(front @ direction) < OPPOSITE:
            lights.append((away_m, instance.instance_id, instance))
    return min(lights, key=lambda light: light[:2])[2] if lights else None


def _sides(lane: Lane) -> tuple[Array, Array]:
    """Pieces of the left and the right border of a lane, [n, 2, 2] each."""
    centre = np.asarray(lane.center_m, dtype=np.float64)[:, :2]
    along = np.gradient(centre, axis=0)
    along /= np.sqrt(np.sum(along**2, axis=1, keepdims=True))
    left = 0.5 * lane.width_m * np.stack([-along[:, 1], along[:, 0]], axis=1)
    lines = (centre + left, centre - left)
    one, other = (np.stack([line[:-1], line[1:]], axis=1) for line in lines)
    return one, other


def _lane_under(scene: Scene, T_world_box: SE3) -> tuple[LaneLine, float] | None:
    """The driving lane whose centre line is nearest, run its way, and how far along it."""
    place = np.array(T_world_box.translation_m[:2])
    heading = T_world_box.rotation()[:2, 0]
    best: tuple[float, Lane, float] | None = None
    for lane in scene.lanes:
        if lane.kind != "driving" or lane.junction:
            continue
        centre = np.asarray(lane.center_m, dtype=np.float64)[:, :2]
        way = np.diff(centre, axis=0)
        share = np.sum((place - centre[:-1]) * way, axis=1) / np.sum(way**2, axis=1)
        gaps = place - centre[:-1] - np.clip(share, 0.0, 1.0)[:, None] * way
        distances = np.sqrt(np.sum(gaps**2, axis=1))
        k = int(distances.argmin())
        beyond = (k == len(way) - 1 and share[k] > 1.0) or (k == 0 and share[k] < 0.0)
        if beyond or distances[k] > 0.5 * lane.width_m or way[k] @ heading <= 0.0:
            continue
        if best is None or distances[k] < best[0]:
            at_m = LaneLine(lane).at_m
            along_m = at_m[k] + float(np.clip(share[k], 0.0, 1.0)) * (at_m[k + 1] - at_m[k])
            best = (float(distances[k]), lane, along_m)
    return None if best is None else (LaneLine(best[1]), best[2])
