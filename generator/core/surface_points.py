"""Points on surfaces that stay with the material: on a triangle of a body's mesh, by its corners.

A body that changes its mesh, such as a person who walks, carries its points along if both meshes
have the same triangles; otherwise they keep their places in the body's frame.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core import se3
from gen_data.core.asset_types import MeshData
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import Scene

Rows = NDArray[np.intp]
REACH_M = 1e-3
"""Largest distance from a triangle, for points within a metre; grows in proportion to theirs."""


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
        p = item.T_world_body.inverse().apply(p_world[rows]) / item.scale
        low, high = assets.bounds_m(item.asset)
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


def _nearest_triangles(
    mesh: MeshData, p_mesh: se3.Array, reach_m: float
) -> tuple[se3.Array, Rows, se3.Array, se3.Array]:
    """Distance [m], index, weights and place of the nearest point on a mesh; inf if none is near.

    Few points in large meshes: their triangles are found axis by axis.
    """
    n = len(p_mesh)
    distance_m, face = np.full(n, np.inf), np.zeros(n, np.intp)
    weights, places = np.zeros((n, 3)), np.zeros((n, 3))
    x = np.ascontiguousarray(mesh.vertices_m[:, 0])[mesh.faces.T]
    low, high = x.min(axis=0), x.max(axis=0)
    for k, p in enumerate(p_mesh):
        around_m = reach_m * max(1.0, 0.1 * float(np.abs(p).max()))
        near = np.flatnonzero((low <= p[0] + around_m) & (high >= p[0] - around_m))
        triangles = mesh.vertices_m[mesh.faces[near]]
        for axis in (1, 2):
            side = triangles[:, :, axis]
            inside = (side.min(axis=1) <= p[axis] + around_m) & (
                side.max(axis=1) >= p[axis] - around_m
            )
            near, triangles = near[inside], triangles[inside]
        if not len(near):
            continue
        corners = triangles.astype(np.float64)
        shares = _barycentric(corners, p)
        found = np.einsum("nk,nki->ni", shares, corners, optimize=False)
        away = np.sqrt(((found - p) ** 2).sum(axis=1))
        best = int(away.argmin())
        if away[best] <= 2.0 * around_m:
            distance_m[k], face[k] = away[best], near[best]
            weights[k], places[k] = shares[best], found[best]
    return distance_m, face, weights, places


def _barycentric(triangles: se3.Array, p: se3.Array) -> se3.Array:
    """Weights [n, 3] of a point's projections on triangles [n, 3, 3], clipped to them."""
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
