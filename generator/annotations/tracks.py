"""Points on surfaces, followed over a sequence in every sensor."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.annotations.sight_lines import MIRRORED, SightLines, cast_rays, trace_sight_lines
from gen_data.config.base_model import Strict
from gen_data.core import capture, errors, interfaces, se3
from gen_data.core.rolling_shutter_projection import camera_poses, project_moving_points
from gen_data.core.sample import TRACK_STATES, EgoTruth, PointTracks, SensorTracks
from gen_data.core.scene import Camera, Lidar, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.streams import Rng
from gen_data.core.surface_points import SurfacePoints, find_surface_points

INSTANTS = 3
"""Steps of a sequence at which points are chosen, evenly spread from the first to the last."""
CANDIDATES = 16
"""Rays per point: a ray that hits nothing or glass finds no point."""
FAR_M = 2000.0
OUTSIDE, BEHIND = TRACK_STATES.index("outside"), TRACK_STATES.index("behind")


@dataclass(frozen=True, eq=False, slots=True)
class ChosenPoints:
    """The points of a sequence, and the instance that each is on, uint16 [n]."""

    points: SurfacePoints
    instance_id: NDArray[np.uint16]


class Tracks(Strict):
    """Points on surfaces, followed over a sequence: place, image, and why it is not seen.

    Rays through random places of all cameras' images at the first, middle and last step find the
    points; instances, and the background as one, share them evenly as far as the rays have found
    enough. Panes of glass have none. Points keep to their place on a triangle of the mesh: on
    people also while they walk. Fewer points than asked for are found where little is in view.

    A ray from each camera and laser scanner to each point decides whether it is seen; scanners look
    all around, from the origin of their frame in the middle of the sweep. With a rolling shutter
    image coordinates and states refer to the instant of the point's row, camera coordinates to the
    image's instant.

    Attributes:
        points: Number of points in a sequence.
    """

    channels: ClassVar[frozenset[capture.Channel]] = frozenset()
    type: Literal["tracks"] = "tracks"
    points: int = Field(256, ge=1, le=65_536)

    def begin(self, view: interfaces.ViewSequence) -> ChosenPoints:
        """Choose the points.

        Raises:
            ConfigError: the scene has no camera.
        """
        first = view.at(0.0)
        if not first.cameras:
            raise errors.ConfigError(
                f"annotation '{self.type}': points are chosen in images, but there is no camera;"
                " add an rgb_camera"
            )
        rng = view.streams.rng(f"annotation/{self.type}")
        chosen = sorted(
            {round(float(k)) for k in np.linspace(0, len(view.instants_s) - 1, INSTANTS)}
        )
        # Boxes of instances, which scenes of ``view.at`` have, do not matter to rays.
        scenes = [scene_at(first, view.instants_s[k]) for k in chosen]
        count = math.ceil(CANDIDATES * self.points / (len(scenes) * len(first.cameras)))
        found = [_find_places(scene, count, view.renderer, rng) for scene in scenes]
        order = _share_evenly(np.concatenate([ids for _, ids in found]), rng)
        return _locate(scenes, found, order[: self.points], view.assets)

    def annotate_step(
        self,
        view: interfaces.ViewSequence,
        begun: ChosenPoints,
        scene: Scene,
        capture: capture.Capture,
        truth: EgoTruth,
    ) -> EgoTruth:
        """Fill in ``tracks``."""
        points = begun.points
        # Scenes are kept: their ids must not be used again.
        placed: dict[int, _Placed] = {}

        def at(then: Scene) -> _Placed:
            if id(then) not in placed:
                p_body = points.on_bodies(then, view.assets)
                placed[id(then)] = _Placed(then, p_body, points.in_world(then, p_body))
            return placed[id(then)]

        views: dict[int, dict[str, _Projected]] = {}
        for name, reading in sorted(capture.readings.items()):
            then = at(view.at(reading.time_s))
            projected = _project(points, then, reading.camera)
            views.setdefault(id(then.scene), {})[name] = projected
        for name, cloud in sorted(capture.clouds.items()):
            then = at(view.at(cloud.time_s))
            views.setdefault(id(then.scene), {})[name] = _in_lidar(then, cloud.lidar)
        sensors: dict[str, SensorTracks] = {}
        for number, seen in views.items():
            sensors |= _trace(placed[number].scene, seen, view.renderer)
        p_world = at(scene).p_world.astype(np.float32)
        tracks = PointTracks(begun.instance_id, p_world, dict(sorted(sensors.items())))
        return replace(truth, tracks=tracks)


Places = tuple[se3.Array, NDArray[np.uint16]]
"""World coordinates [m], [n, 3], and instance ids [n]."""


def _find_places(scene: Scene, count: int, renderer: interfaces.Renderer, rng: Rng) -> Places:
    """Surfaces on rays through ``count`` random places of each camera's image."""
    origins, directions = [], []
    for camera in scene.cameras:
        size_px = (camera.intrinsics.width_px, camera.intrinsics.height_px)
        rays = camera.intrinsics.rays(rng.uniform(size=(count, 2)) * size_px)
        rays = camera.T_world_camera.rotate(rays[np.isfinite(rays).all(axis=1)])
        directions.append(rays)
        origins.append(np.broadcast_to(camera.T_world_camera.translation_m, rays.shape))
    eyes, rays = np.concatenate(origins), np.concatenate(directions)
    hits = cast_rays(scene, eyes, rays, FAR_M, renderer)
    range_m = hits.range_m[:, 0].astype(np.float64)
    solid = np.isfinite(range_m)
    if hits.detours is not None:
        solid[hits.detours.ray[hits.detours.surface != MIRRORED]] = False
    return (eyes + rays * range_m[:, None])[solid], hits.instance_id[solid, 0]


def _share_evenly(instance_id: NDArray[np.uint16], rng: Rng) -> NDArray[np.intp]:
    """Rows in the order in which to take them: one of each instance, a second one of each, ..."""
    shuffled = rng.permutation(len(instance_id))
    ids = instance_id[shuffled]
    grouped = np.argsort(ids, kind="stable")
    _, starts, counts = np.unique(ids[grouped], return_index=True, return_counts=True)
    turn = np.zeros(len(ids), np.intp)
    turn[grouped] = np.arange(len(ids)) - np.repeat(starts, counts)
    return np.asarray(shuffled[np.argsort(turn, kind="stable")])


def _locate(
    scenes: list[Scene],
    found: list[Places],
    taken: NDArray[np.intp],
    assets: interfaces.AssetLibrary,
) -> ChosenPoints:
    """Some of the places, as points on triangles."""
    p_world, ids = (np.concatenate(parts) for parts in zip(*found, strict=True))
    of_scene = np.repeat(np.arange(len(scenes)), [len(ids) for _, ids in found])
    parts, instances = [], []
    for number, scene in enumerate(scenes):
        rows = taken[of_scene[taken] == number]
        points, kept = find_surface_points(scene, assets, p_world[rows], ids[rows])
        parts.append(points)
        instances.append(ids[rows[kept]])
    instance_id = np.concatenate(instances)
    merged = SurfacePoints(
        np.concatenate([p.body for p in parts]),
        tuple(name for p in parts for name in p.asset),
        np.concatenate([p.face for p in parts]),
        np.concatenate([p.weights for p in parts]),
        np.concatenate([p.p_mesh for p in parts]),
    )
    order = np.argsort(merged.body, kind="stable")
    return ChosenPoints(merged.take(order), instance_id[order])


@dataclass(frozen=True, eq=False, slots=True)
class _Placed:
    """The points at one instant: in the frames of their bodies and in the world [m], [n, 3]."""

    scene: Scene
    p_body: se3.Array
    p_world: se3.Array


@dataclass(frozen=True, eq=False, slots=True)
class _Projected:
    """The points in one reading: sensor frame [m], image [px], rays to them, which to trace."""

    p_sensor: se3.Array
    image_px: se3.Array
    lines: SightLines
    inside: NDArray[np.bool_]


def _project(points: SurfacePoints, then: _Placed, camera: Camera) -> _Projected:
    """Project the points as they are at the image's instant."""
    p_world = then.p_world
    p_camera = camera.T_world_camera.inverse().apply(p_world)
    lens = camera.intrinsics
    if camera.shutter.rolls:
        lines, image_px = _rolling_lines(points, then, camera)
    else:
        eye = np.broadcast_to(camera.T_world_camera.translation_m, p_world.shape)
        lines, image_px = SightLines(eye, p_world), lens.project(p_camera)
    u, v = image_px.T
    inside = (u >= 0.0) & (u < lens.width_px) & (v >= 0.0) & (v < lens.height_px)
    return _Projected(p_camera, image_px, lines, inside)


def _in_lidar(then: _Placed, lidar: Lidar) -> _Projected:
    """The points at the scan's instant in the frame of a scanner, all around it."""
    p_world = then.p_world
    p_lidar = lidar.T_world_lidar.inverse().apply(p_world)
    eye = np.broadcast_to(lidar.T_world_lidar.translation_m, p_world.shape)
    nowhere = np.full((len(p_world), 2), np.nan)
    return _Projected(p_lidar, nowhere, SightLines(eye, p_world), np.ones(len(p_world), np.bool_))


def _trace(
    scene: Scene, views: Mapping[str, _Projected], renderer: interfaces.Renderer
) -> dict[str, SensorTracks]:
    """The points as several sensors have them at one instant."""
    lines = [one.lines.take(np.flatnonzero(one.inside)) for one in views.values()]
    found = trace_sight_lines(scene, lines, renderer)
    tracks = {}
    for (name, one), (state, hidden_by) in zip(views.items(), found, strict=True):
        states = np.where(np.isfinite(one.image_px[:, 0]), OUTSIDE, BEHIND).astype(np.uint8)
        hidden = np.zeros(len(states), np.uint16)
        states[one.inside], hidden[one.inside] = state, hidden_by
        p_sensor, image_px = (a.astype(np.float32) for a in (one.p_sensor, one.image_px))
        tracks[name] = SensorTracks(p_sensor, image_px, states, hidden)
    return tracks


def _rolling_lines(
    points: SurfacePoints, then: _Placed, camera: Camera
) -> tuple[SightLines, se3.Array]:
    """Rays at the instants of the rows that show the points, and image coordinates [px]."""
    world = points.moving(then.scene, then.p_body)
    _, image_px, delays_s = project_moving_points(then.scene, camera, world, len(then.p_body))
    _, eyes = camera_poses(then.scene, camera, delays_s)
    return SightLines(eyes, world(delays_s), delays_s), image_px
