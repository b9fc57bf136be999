"""Grasps of loose objects, by parallel grippers and suction cups, from meshes and final poses."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.annotations.surface_contacts import Rows, first_hits, hits_by_rays, triangle_normals
from gen_data.config.base_model import Strict
from gen_data.core import capture, interfaces
from gen_data.core.sample import EgoTruth, Grasp, Suction
from gen_data.core.scene import Instance, Scene
from gen_data.core.se3 import SE3, Array

PLASTIC = 1.32471795724474602596
"""Additive steps 1/p and 1/p^2 fill a square evenly (Roberts, "The unreasonable effectiveness of
quasirandom sequences", 2018)."""
SPACING_M = 0.004
"""Distance of the points on surfaces that grippers must not contain."""
AROUND = 12
"""Directions of approach per pair of contacts."""
SAMPLED = 16
"""Every so many points are tested first: most grippers that are not free contain some of these."""
RIM = 8
"""Points of a cup's rim that are tested."""
LEAST_WIDTH_M = 0.001
"""A smaller width is within the rounding of a surface."""
PALM_M = (0.05, 0.03)
"""Length and half height of the part of a gripper that carries the fingers (assumed)."""


class Grasps(Strict):
    """Antipodal grasps and suction points that the scene leaves room for.

    Points spread evenly over an object's surface are first contacts; the second one is where the
    line along the inward normal leaves the object. The pair holds if the line is within both
    friction cones (Nguyen, "Constructing force-closure grasps", 1988): ``score`` is 1.1 minus the
    least coefficient of friction. Of the directions of approach around the line, the most
    downward one is taken whose open gripper, two fingers and a palm, contains no point of any
    surface.

    A suction cup needs a flat rim, room above it, and a surface that faces up.

    Nothing is drawn at random.

    Attributes:
        opening_m: Largest distance between the fingers.
        friction: Largest coefficient of friction to rely on.
        finger_m: Thickness, height and length of a finger.
        reach_m: How far fingers reach beyond the contacts.
        clearance_m: Distance between fingers and contacts before they close.
        cup_m: Radius of the suction cup.
        seal_m: Largest deviation of the rim from a plane.
        lever_m: Horizontal distance from the object's centre at which a suction scores 0 (assumed).
        tried: Number of first contacts per object.
        most: Largest number of grasps, and of suctions, per object.
    """

    channels: ClassVar[frozenset[capture.Channel]] = frozenset()
    type: Literal["grasps"] = "grasps"
    opening_m: float = Field(0.08, gt=0)
    friction: float = Field(0.6, gt=0, le=1)
    finger_m: tuple[float, float, float] = (0.01, 0.02, 0.04)
    reach_m: float = Field(0.015, ge=0)
    clearance_m: float = Field(0.003, gt=0)
    cup_m: float = Field(0.01, gt=0)
    seal_m: float = Field(0.0015, gt=0)
    lever_m: float = Field(0.05, gt=0)
    tried: int = Field(96, ge=1)
    most: int = Field(12, ge=1)

    def annotate_frame(
        self, scenes: Mapping[str, Scene], assets: interfaces.AssetLibrary, truth: EgoTruth
    ) -> EgoTruth:
        """Fill in ``grasps`` and ``suctions``."""
        scene = scenes[""]
        meshes = world_meshes(scene, assets)
        loose = {b.instance_id for b in scene.bodies if b.motion == "dynamic"}
        things = {
            instance: np.concatenate([t for owner, t in meshes if owner == instance.instance_id])
            for instance in sorted(scene.instances, key=lambda i: i.instance_id)
            if instance.annotated and instance.instance_id in loose
        }
        if not things:
            return replace(truth, grasps=(), suctions=())
        margin_m = self.opening_m + self.finger_m[2] + PALM_M[0]
        nearby = points_near([t for _, t in meshes], list(things.values()), margin_m)
        grasps: list[Grasp] = []
        suctions: list[Suction] = []
        for (instance, mesh), around in zip(things.items(), nearby, strict=True):
            points, normals = spread_points(mesh, self.tried)
            grasps += self._grasps(instance, mesh, points, normals, around)
            suctions += self._suctions(instance, mesh, points, normals, around)
        return replace(truth, grasps=tuple(grasps), suctions=tuple(suctions))

    def _grasps(
        self, instance: Instance, mesh: Array, points: Array, normals: Array, around: Array
    ) -> list[Grasp]:
        hits = hits_by_rays(points, -normals, mesh)
        # Fingers come from outside: the last point within the opening is the second contact.
        widest_m = self.opening_m - 2.0 * self.clearance_m
        within = np.where((hits < LEAST_WIDTH_M) | (hits > widest_m), 0.0, hits)
        widths, faces = within.max(axis=1), within.argmax(axis=1)
        # Nothing of the object lies between a contact and its finger.
        apart_m = self.clearance_m + self.finger_m[0]
        beyond = ((hits > widths[:, None] + 1e-6) & (hits < widths[:, None] + apart_m)).any(axis=1)
        before = first_hits(points + 1e-6 * normals, normals, mesh) < apart_m
        cosines = -(normals * triangle_normals(mesh[faces])).sum(axis=1)
        needs = np.sqrt(np.maximum(1.0 - cosines**2, 0.0)) / np.maximum(cosines, 1e-9)
        holding = (widths > 0.0) & (needs <= self.friction) & ~beyond & ~before
        found: list[Grasp] = []
        for k in sorted(np.flatnonzero(holding).tolist(), key=lambda k: needs[k]):
            pose = self._approach(points[k], points[k] - widths[k] * normals[k], around)
            if pose is not None:
                width_m, score = float(widths[k]), min(1.0, 1.1 - float(needs[k]))
                number = instance.instance_id
                found.append(Grasp(number, pose.rounded(), round(width_m, 6), round(score, 6)))
            if len(found) == self.most:
                break
        return found

    def _approach(self, one: Array, other: Array, around: Array) -> SE3 | None:
        """Pose of the first free gripper, from above on; None if there is none."""
        line = (other - one) / math.dist(one, other)
        down = np.array([0.0, 0.0, -1.0]) - line * -line[2]
        if float(down @ down) < 1e-6:
            down = np.array([1.0, 0.0, 0.0]) - line * line[0]
        down /= math.sqrt(float(down @ down))
        side = np.cross(line, down)
        middle = 0.5 * (one + other)
        turns = np.array(sorted(range(AROUND), key=lambda k: (min(k, AROUND - k), k)))
        for part in (around[::SAMPLED], around):
            points = (part - middle) @ np.stack([down, line, side], axis=1)
            turns = turns[self._are_free(turns, points, math.dist(one, other))]
            if not len(turns):
                return None
        angle = 2.0 * math.pi * float(turns[0]) / AROUND
        forward = math.cos(angle) * down + math.sin(angle) * side
        columns = [forward, line, np.cross(forward, line)]
        return SE3.from_rotation(np.stack(columns, axis=1), middle)

    def _are_free(self, turns: Rows, points: Array, width_m: float) -> NDArray[np.bool_]:
        """Whether open grippers, turned about the line of the contacts, contain no points.

        Points are along the downward direction, along the line, and across both.
        """
        thick_m, height_m, length_m = self.finger_m
        inner = 0.5 * width_m + self.clearance_m
        outer = max(inner, 0.5 * self.opening_m) + thick_m
        longest_m = max(self.reach_m, length_m + PALM_M[0])
        reach_m = math.hypot(longest_m, max(0.5 * height_m, PALM_M[1]))
        points = points[np.abs(points[:, 1]) < outer]
        points = points[points[:, 0] ** 2 + points[:, 2] ** 2 < reach_m**2]
        angles = turns[:, None] * 2.0 * math.pi / AROUND
        x = np.cos(angles) * points[:, 0] + np.sin(angles) * points[:, 2]
        z = np.abs(np.sin(angles) * points[:, 0] - np.cos(angles) * points[:, 2])
        y = np.abs(points[:, 1])
        in_finger = (x > -length_m) & (x < self.reach_m) & (z < 0.5 * height_m)
        in_finger &= (y > inner) & (y < inner + thick_m)
        in_palm = (x <= -length_m) & (x > -length_m - PALM_M[0]) & (z < PALM_M[1])
        in_palm &= y < 0.5 * self.opening_m + thick_m
        return np.asarray(~(in_finger | in_palm).any(axis=1))

    def _suctions(
        self, instance: Instance, mesh: Array, points: Array, normals: Array, around: Array
    ) -> list[Suction]:
        center = np.array(instance.box3d.T_frame_box.translation_m)
        levers_m = np.hypot(points[:, 0] - center[0], points[:, 1] - center[1])
        fit = (normals[:, 2] > 0.0) & (levers_m < self.lever_m)
        points, normals, levers_m = points[fit], normals[fit], levers_m[fit]
        rims = rim_points(points, normals, self.cup_m) + 2.0 * self.seal_m * normals[:, None]
        downs = np.repeat(-normals, RIM, axis=0)
        depths = first_hits(rims.reshape(-1, 3), downs, mesh).reshape(-1, RIM)
        deviations_m = np.abs(depths - 2.0 * self.seal_m).max(axis=1)
        scores = (1.0 - deviations_m / self.seal_m) * (1.0 - levers_m / self.lever_m)
        found = []
        for k in np.flatnonzero(deviations_m < self.seal_m):
            if self._has_room(points[k], normals[k], around):
                x, y, z = (round(float(v), 6) for v in points[k])
                nx, ny, nz = (round(float(v), 6) for v in normals[k])
                score = round(float(scores[k]), 6)
                found.append(Suction(instance.instance_id, (x, y, z), (nx, ny, nz), score))
        return sorted(found, key=lambda s: -s.score)[: self.most]

    def _has_room(self, point: Array, normal: Array, around: Array) -> bool:
        """Whether a cup, and the tube behind it, contain no point of any surface."""
        offsets = around - point
        height = offsets @ normal
        beside = (height > 2.0 * self.seal_m) & (height < self.finger_m[2] + PALM_M[0])
        apart = offsets[beside] - height[beside, None] * normal
        return not ((apart * apart).sum(1) < self.cup_m**2).any()


def world_meshes(scene: Scene, assets: interfaces.AssetLibrary) -> list[tuple[int, Array]]:
    """Instance id and triangles [n, 3, 3] of all bodies, world."""
    found = []
    for body in scene.bodies:
        mesh = assets.mesh(body.asset)
        corners = body.T_world_body.apply(mesh.vertices_m.astype(np.float64) * body.scale)
        found.append((body.instance_id, corners[mesh.faces]))
    return found


def spread_points(mesh: Array, count: int) -> tuple[Array, Array]:
    """Points spread evenly over a mesh, [count, 3], and their normals."""
    sides = np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0])
    total = np.cumsum(np.sqrt((sides * sides).sum(1)))
    k = np.arange(count)
    faces = np.searchsorted(total, (k + 0.5) / count * total[-1])
    u, v = (0.5 + (k + 1) / PLASTIC) % 1.0, (0.5 + (k + 1) / PLASTIC**2) % 1.0
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = (mesh[faces, i] for i in range(3))
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    return points, triangle_normals(mesh[faces])


def points_near(meshes: Sequence[Array], things: Sequence[Array], margin_m: float) -> list[Array]:
    """Points on all meshes about ``SPACING_M`` apart, in each object's bounds plus a margin."""
    low = np.array([thing.min((0, 1)) for thing in things]) - margin_m
    high = np.array([thing.max((0, 1)) for thing in things]) + margin_m
    found = [np.zeros((0, 3))]
    for triangles in meshes:
        near = (triangles.max(1) >= low.min(0)).all(1) & (triangles.min(1) <= high.max(0)).all(1)
        points = lattice(triangles[near])
        found.append(points[((points >= low.min(0)) & (points <= high.max(0))).all(1)])
    points = np.concatenate(found)
    # Fine meshes have many points per cell: one is enough.
    cells = np.floor((points - low.min(0)) / (0.5 * SPACING_M)).astype(np.int64)
    keys = (cells[:, 0] << 40) + (cells[:, 1] << 20) + cells[:, 2]
    points = points[np.unique(keys, return_index=True)[1]]
    return [points[((points >= a) & (points <= b)).all(1)] for a, b in zip(low, high, strict=True)]


def lattice(triangles: Array) -> Array:
    """Points on triangles at most ``SPACING_M`` apart along and across each, [n, 3].

    They are on lines from a corner to points of the opposite edge, the shortest one: a sliver has
    few lines.
    """
    edges_m = np.sqrt(((np.roll(triangles, -1, axis=1) - triangles) ** 2).sum(2))
    rows, first = np.arange(len(triangles)), edges_m.argmin(axis=1)
    a, b, c = (triangles[rows, (first + k) % 3] for k in range(3))
    across = np.clip(np.ceil(edges_m.min(1) / SPACING_M), 1, 1024).astype(int)
    along = np.clip(np.ceil(edges_m.max(1) / SPACING_M), 1, 1024).astype(int)
    counts = (across + 1) * (along + 1)
    owner = np.repeat(rows, counts)
    number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    u = (number % (across + 1)[owner] / across[owner])[:, None]
    v = (number // (across + 1)[owner] / along[owner])[:, None]
    return np.asarray((1.0 - v) * (a[owner] + u * (b - a)[owner]) + v * c[owner])


def rim_points(points: Array, normals: Array, radius_m: float) -> Array:
    """Points on circles around points, across their normals, [n, RIM, 3]."""
    helpers = np.eye(3)[np.abs(normals).argmin(axis=1)]
    u = np.cross(normals, helpers)
    u /= np.sqrt((u * u).sum(axis=1))[:, None]
    angles = np.arange(RIM) * 2.0 * math.pi / RIM
    v = np.cross(normals, u)
    around = np.cos(angles)[:, None] * u[:, None] + np.sin(angles)[:, None] * v[:, None]
    return np.asarray(points[:, None] + radius_m * around)
