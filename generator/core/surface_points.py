"""Points on surfaces that stay with the material: on a triangle of a body's mesh, by its corners.

A body that changes its mesh, such as a person who walks, carries its points along if both meshes
have the same triangles; otherwise they keep their places in the body's frame.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core import se3
from gen_data.core.asset_types import MeshData
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import Body, Scene

Rows = NDArray[np.intp]
REACH_M = 1e-3
"""Largest distance from a triangle, for points within a metre; grows in proportion to theirs."""
PAIRS = 1 << 18
"""Points times triangles that are compared at once."""


@dataclass(frozen=True, eq=False, slots=True)
class SurfacePoints:
    """Points on the bodies of a scene, in ascending order of bodies.

    Attributes:
        body: Index of the body, [n].
        asset: Mesh that the point was found on, [n].
        face: Index of the triangle, [n].
        weights: Barycentric weights of its corners, [n, 3].
        p_mesh: Position in the frame of that mesh [m], [n, 3], without the body's scale.
    """

    body: Rows
    asset: tuple[str, ...]
    face: Rows
    weights: se3.Array
    p_mesh: se3.Array

    def take(self, rows: Rows) -> "SurfacePoints":
        """Some of the points, in the order of their bodies."""
        rows = rows[np.argsort(self.body[rows], kind="stable")]
        asset = tuple(self.asset[k] for k in rows.tolist())
        return SurfacePoints(
            self.body[rows], asset, self.face[rows], self.weights[rows], self.p_mesh[rows]
        )

    def by_body(self) -> Iterator[tuple[int, slice]]:
        """Index of each body with points, and their rows."""
        bodies, starts, counts = np.unique(self.body, return_index=True, return_counts=True)
        for body, start, count in zip(*(a.tolist() for a in (bodies, starts, counts)), strict=True):
            yield body, slice(start, start + count)

    def on_bodies(self, scene: Scene, assets: AssetLibrary) -> se3.Array:
        """Positions in the frames of the bodies as they are in a scene [m], scaled, [n, 3]."""
        found = self.p_mesh.copy()
        scales = np.ones((len(self.body), 1))
        for number, rows in self.by_body():
            body = scene.bodies[number]
            scales[rows] = body.scale
            known = self.asset[rows]
            if any(asset != body.asset for asset in known):
                now = assets.mesh(body.asset)
                for asset in sorted({*known} - {body.asset}):
                    if _same_triangles(assets.mesh(asset), now):
                        own = rows.start + np.flatnonzero(np.array(known) == asset)
                        found[own] = _interpolate(now, self.face[own], self.weights[own])
        return np.asarray(found * scales)

    def in_world(self, scene: Scene, p_body: se3.Array) -> se3.Array:
        """World coordinates [m] of ``on_bodies``, [n, 3]."""
        if not len(self.body):
            return p_body
        numbers, inverse = np.unique(self.body, return_inverse=True)
        poses = [scene.bodies[k].T_world_body for k in numbers.tolist()]
        R = se3.unit_quaternions_to_rotations(np.array([p.quaternion_wxyz for p in poses]))
        t = np.array([p.translation_m for p in poses])
        turned = np.einsum("nij,nj->ni", R[inverse], p_body, optimize=False)
        return np.asarray(turned + t[inverse])

    def moving(self, scene: Scene, p_body: se3.Array) -> Callable[[se3.Array], se3.Array]:
        """World coordinates [m] of ``on_bodies``, [n, 3], as a function of delays [s], [n].

        Delays count from the scene's time. Meshes remain as they are then; bodies move.
        """
        p_world = self.in_world(scene, p_body)
        tracks = {track.body: track for track in scene.tracks}
        bodies = ((tracks.get(scene.bodies[k].name), rows) for k, rows in self.by_body())
        movers = [(track, rows) for track, rows in bodies if track is not None]

        def places(delays_s: se3.Array) -> se3.Array:
            found = p_world.copy()
            for track, rows in movers:
                R, t = track.poses(scene.time_s + delays_s[rows])
                found[rows] = np.einsum("nij,nj->ni", R, p_body[rows], optimize=False) + t
            return np.asarray(found)

        return places


def find_surface_points(
    scene: Scene,
    assets: AssetLibrary,
    p_world: se3.Array,
    instance_id: NDArray[np.integer],
    reach_m: float = REACH_M,
) -> tuple[SurfacePoints, Rows]:
    """Find the triangles that places on surfaces [n, 3] belong to.

    Args:
        scene: The scene.
        assets: Meshes of its bodies.
        p_world: Places, up to the error of a ray [m].
        instance_id: Instance of each, 0 = bodies without one, [n].
        reach_m: Largest distance from a triangle; see ``REACH_M``.

    Returns:
        The points, and the row of each; places without a triangle are left out.
    """
    n = len(p_world)
    best_m = np.full(n, np.inf)
    body, face = np.zeros(n, np.intp), np.zeros(n, np.intp)
    weights, p_mesh = np.zeros((n, 3)), np.zeros((n, 3))
    wanted = {number: np.flatnonzero(instance_id == number) for number in np.unique(instance_id)}
    for number, item in enumerate(scene.bodies):
        rows = wanted.get(item.instance_id)
        if rows is None:
            continue
        low, high = assets.bounds_m(item.asset)
        rows = rows[_are_around(item, low, high, p_world[rows], reach_m)]
        if not len(rows):
            continue
        p = item.T_world_body.inverse().apply(p_world[rows]) / item.scale
        near = ((p >= np.subtract(low, reach_m)) & (p <= np.add(high, reach_m))).all(axis=1)
        if not near.any():
            continue
        rows, mesh = rows[near], assets.mesh(item.asset)
        distance_m, faces, shares, places = _nearest_triangles(mesh, p[near], reach_m)
        closer = distance_m * item.scale < best_m[rows]
        rows = rows[closer]
        best_m[rows] = distance_m[closer] * item.scale
        body[rows], face[rows] = number, faces[closer]
        weights[rows], p_mesh[rows] = shares[closer], places[closer]
    kept = np.flatnonzero(np.isfinite(best_m))
    kept = kept[np.argsort(body[kept], kind="stable")]
    names = tuple(scene.bodies[k].asset for k in body[kept].tolist())
    points = SurfacePoints(body[kept], names, face[kept], weights[kept], p_mesh[kept])
    return points, kept


def _are_around(
    body: Body, low: se3.Vec3, high: se3.Vec3, p_world: se3.Array, reach_m: float
) -> NDArray[np.bool_]:
    """Whether places are in the ball around a body's bounds, or near it: a quick test."""
    x, y, z = (0.5 * body.scale * (a + b) for a, b in zip(low, high, strict=True))
    pose = body.T_world_body
    turned = se3.rotate_by_quaternion(pose.quaternion_wxyz, (x, y, z))
    away = p_world - np.add(turned, pose.translation_m)
    radius_m = body.scale * (0.5 * math.dist(low, high) + 2.0 * reach_m) + REACH_M
    return np.asarray((away * away).sum(axis=1) < radius_m**2)


def _nearest_triangles(
    mesh: MeshData, p_mesh: se3.Array, reach_m: float
) -> tuple[se3.Array, Rows, se3.Array, se3.Array]:
    """Distance [m], index, weights and place of the nearest point on a mesh; inf if none is near.

    Few points in large meshes: their triangles are found axis by axis.
    """
    n = len(p_mesh)
    distance_m, face = np.full(n, np.inf), np.zeros(n, np.intp)
    weights, places = np.zeros((n, 3)), np.zeros((n, 3))
    around_m = reach_m * np.maximum(1.0, 0.1 * np.abs(p_mesh).max(axis=1))
    lows, highs = p_mesh - around_m[:, None], p_mesh + around_m[:, None]
    x = np.take(mesh.vertices_m[:, 0].copy(), mesh.faces)
    low, high = (
        choose(choose(x[:, 0], x[:, 1]), x[:, 2]).astype(np.float64)
        for choose in (np.minimum, np.maximum)
    )
    step = max(1, PAIRS // max(1, len(low)))
    for start in range(0, n, step):
        own = slice(start, start + step)
        point, near = np.nonzero((low <= highs[own, :1]) & (high >= lows[own, :1]))
        point += start
        for axis in (1, 2):
            side = mesh.vertices_m[mesh.faces[near].T, axis]
            inside = side.min(axis=0) <= highs[point, axis]
            inside &= side.max(axis=0) >= lows[point, axis]
            point, near = point[inside], near[inside]
        if not len(point):
            continue
        corners = mesh.vertices_m[mesh.faces[near]].astype(np.float64)
        p = p_mesh[point]
        shares = _barycentric(corners, p)
        found = np.einsum("nk,nki->ni", shares, corners, optimize=False)
        away = np.sqrt(((found - p) ** 2).sum(axis=1))
        order = np.lexsort((away, point))
        best = order[np.flatnonzero(np.diff(point[order], prepend=-1))]
        best = best[away[best] <= 2.0 * around_m[point[best]]]
        rows = point[best]
        distance_m[rows], face[rows] = away[best], near[best]
        weights[rows], places[rows] = shares[best], found[best]
    return distance_m, face, weights, places


def _barycentric(triangles: se3.Array, p: se3.Array) -> se3.Array:
    """Weights [n, 3] of projections of points [n, 3] on triangles [n, 3, 3], clipped to them."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    u, v, w = b - a, c - a, p - a
    uu, uv, vv = (u * u).sum(axis=1), (u * v).sum(axis=1), (v * v).sum(axis=1)
    wu, wv = (w * u).sum(axis=1), (w * v).sum(axis=1)
    area = np.maximum(uu * vv - uv * uv, 1e-30)
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    shares = np.clip(np.stack([1.0 - s - t, s, t], axis=1), 0.0, 1.0)
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))


def _same_triangles(one: MeshData, other: MeshData) -> bool:
    return one.faces is other.faces or np.array_equal(one.faces, other.faces)


def _interpolate(mesh: MeshData, faces: Rows, weights: se3.Array) -> se3.Array:
    corners = mesh.vertices_m[mesh.faces[faces]].astype(np.float64)
    return np.asarray(np.einsum("nk,nki->ni", weights, corners, optimize=False))
