"""Where points on surfaces are at a later instant: with their body, and on its mesh."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gen_data.core import se3
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import Scene
from gen_data.core.surface_points import REACH_M, find_surface_points

REACHES_M = (REACH_M, 0.02, 0.2)
"""Distances at which to look for a point's triangle, one after the other: ranges have errors."""


def moved_points(
    now: Scene,
    then: Scene,
    assets: AssetLibrary,
    p_world: se3.Array,
    instance_id: NDArray[np.integer],
    delays_s: se3.Array,
) -> tuple[se3.Array, NDArray[np.bool_]]:
    """Where points are as much later as one scene is after another.

    A point keeps its place in the frame of its body. Where the body's mesh changes, it moves with
    the nearest triangle. The nearest triangle also determines the body, if an instance has several,
    or if bodies without an instance move. Meshes are as in the two scenes, poses as at the instants
    of the points.

    Args:
        now: A scene.
        then: The same at another instant.
        assets: Meshes of its bodies.
        p_world: Points, each as at its instant [m], [n, 3].
        instance_id: Instance of each; 0 = none, [n].
        delays_s: Instant of each point minus the instant of ``now`` [s], [n].

    Returns:
        World coordinates [m], [n, 3], and whether each is known, [n]: points on nothing that moves
        stay where they are, those whose body is not found too, and these are unknown.
    """
    found, known = p_world.copy(), np.ones(len(p_world), np.bool_)
    tracked = {track.body for track in now.tracks}
    members: dict[int, list[int]] = {}
    movers: dict[int, list[int]] = {}
    for k, (body, later) in enumerate(zip(now.bodies, then.bodies, strict=True)):
        members.setdefault(body.instance_id, []).append(k)
        if body.name in tracked or body.asset != later.asset:
            movers.setdefault(body.instance_id, []).append(k)
    for number in sorted(set(np.unique(instance_id).tolist()) & movers.keys()):
        rows = np.flatnonzero(instance_id == number)
        one, *others = members[number] if number else movers[number]
        if number and not others and now.bodies[one].asset == then.bodies[one].asset:
            p_body = _to_body(now, one, p_world[rows], delays_s[rows])
            found[rows] = _to_world(now, then, one, p_body, delays_s[rows])
            continue
        # Points without an instance stay, unless they are on the mesh of a moving body.
        for reach_m in REACHES_M if number else REACHES_M[:2]:
            p_then, on_mesh = _on_nearest(
                now, then, assets, [one, *others], p_world[rows], delays_s[rows], reach_m
            )
            found[rows[on_mesh]] = p_then[on_mesh]
            rows = rows[~on_mesh]
        known[rows] = number == 0
    return found, known


def _on_nearest(
    now: Scene,
    then: Scene,
    assets: AssetLibrary,
    bodies: list[int],
    p_world: se3.Array,
    delays_s: se3.Array,
    reach_m: float,
) -> tuple[se3.Array, NDArray[np.bool_]]:
    """World coordinates [m] as the nearest triangles move, and whether one is in reach."""
    found, best_m = p_world.copy(), np.full(len(p_world), np.inf)
    for k in bodies:
        own = np.full(len(p_world), now.bodies[k].instance_id)
        p_body = _to_body(now, k, p_world, delays_s)
        here, there = (_alone(scene, k) for scene in (now, then))
        points, rows = find_surface_points(here, assets, p_body, own, reach_m)
        p_mesh = points.on_bodies(here, assets)
        distance_m = np.sqrt(((p_mesh - p_body[rows]) ** 2).sum(axis=1))
        nearer = distance_m < best_m[rows]
        rows, shift = rows[nearer], (points.on_bodies(there, assets) - p_mesh)[nearer]
        best_m[rows] = distance_m[nearer]
        found[rows] = _to_world(now, then, k, p_body[rows] + shift, delays_s[rows])
    return found, np.isfinite(best_m)


def _alone(scene: Scene, number: int) -> Scene:
    """A scene of one body, in its own frame."""
    return replace(scene, bodies=(replace(scene.bodies[number], T_world_body=se3.IDENTITY),))


def _poses(scene: Scene, number: int, times_s: se3.Array) -> tuple[se3.Array, se3.Array]:
    """Rotations [n, 3, 3] and translations [n, 3] of a body."""
    body = scene.bodies[number]
    track = scene.track(body.name)
    if track is not None and len(times_s):
        return track.poses(times_s)
    pose = body.T_world_body
    shape = (len(times_s), 3)
    return np.broadcast_to(pose.rotation(), (*shape, 3)), np.broadcast_to(pose.translation_m, shape)


def _to_body(now: Scene, number: int, p_world: se3.Array, delays_s: se3.Array) -> se3.Array:
    R, t = _poses(now, number, now.time_s + delays_s)
    return np.asarray(np.einsum("nji,nj->ni", R, p_world - t, optimize=False))


def _to_world(
    now: Scene, then: Scene, number: int, p_body: se3.Array, delays_s: se3.Array
) -> se3.Array:
    R, t = _poses(now, number, then.time_s + delays_s)
    return np.asarray(np.einsum("nij,nj->ni", R, p_body, optimize=False) + t)
