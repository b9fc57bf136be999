"""Edges of sheets before any pose: tufts of hair and collars that grow out of them, calm hems."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gen_data.content.people.body import Array, Indices
from gen_data.content.procedural.patches import unit
from gen_data.core.variant_rng import VariantRng

_CALM_PASSES, _NECKLINE_PASSES = 6, 10
_HEAD_RADIUS_M = 0.09


@dataclass(frozen=True, eq=False, slots=True)
class Surface:
    """A sheet on an unposed body.

    Attributes:
        used: Point of the body that each vertex moves with, [n]; several may share one.
        places_m: Vertices in the person's shape [m], [n, 3].
        template_m: Vertices in the template frame [m], [n, 3].
        normals: Normals of the body under the vertices, [n, 3].
        faces: Triangles, [m, 3].
        slots: Material of each triangle, [m].
    """

    used: Indices
    places_m: Array
    template_m: Array
    normals: Array
    faces: Indices
    slots: Indices


@dataclass(frozen=True, slots=True)
class Tufts:
    """Locks of hair on the edge of a sheet.

    Attributes:
        length_m: Length of the locks at positions in the template frame [n, 3] -> [n]; 0 = none.
        lift_m: How far their tips stand off.
        spread: How far tips lie aside, in lengths of a lock.
        down: Share of downward in their direction, the rest is away from the sheet.
    """

    length_m: Callable[[Array], Array]
    lift_m: float = 0.003
    spread: float = 0.5
    down: float = 0.0


@dataclass(frozen=True, slots=True)
class Collar:
    """A strip along an edge around the neck.

    Attributes:
        rise_m: Height of the strip.
        inward: Share in [0, 1] of the way to the neck's axis that its upper edge is nearer.
    """

    rise_m: float
    inward: float


def border_edges(faces: Indices) -> Indices:
    """Directed edges that only one face has, in that face's direction, int64 [k, 2]."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    size = int(faces.max()) + 1
    keys = edges[:, 0] * size + edges[:, 1]
    alone = ~np.isin(keys, edges[:, 1] * size + edges[:, 0])
    return edges[alone]


def calm(vectors: Array, edges: Indices, passes: int = _CALM_PASSES) -> Array:
    """Vectors [n, 3] whose course along borders is smooth: slivers at a hem point anywhere."""
    border, local = np.unique(edges, return_inverse=True)
    start, end = local.reshape(-1, 2).T
    both, across = np.concatenate([start, end]), np.concatenate([end, start])
    counts = np.bincount(both, minlength=len(border))[:, None]
    course = vectors[border]
    for _ in range(passes):
        sums = [np.bincount(both, course[across, k], len(border)) for k in range(3)]
        course = 0.5 * course + 0.5 * np.stack(sums, axis=1) / counts
    smooth: Array = vectors.copy()
    smooth[border] = course
    return smooth


def add_tufts(sheet: Surface, tufts: Tufts, edges: Indices, rng: VariantRng) -> Surface:
    """The sheet with a lock on each edge of its border, [k, 2]."""
    a, b = edges.T
    p, t = sheet.places_m, sheet.template_m
    length = tufts.length_m(0.5 * (t[a] + t[b]))
    keep = length > 0.0
    a, b, length = a[keep], b[keep], length[keep]
    noise = np.array([rng.random() for _ in range(2 * len(a))]).reshape(-1, 2)
    length = length * (0.45 + 0.95 * noise[:, 0])
    along = p[b] - p[a]
    up = unit(sheet.normals[a] + sheet.normals[b])
    away = unit(np.cross(along, up)) * (1.0 - tufts.down) - (0.0, 0.0, tufts.down)
    away = unit(away + tufts.spread * (2.0 * noise[:, 1:] - 1.0) * unit(along))
    # The head is round: a straight lock would dip into it.
    lift = tufts.lift_m + length**2 / (2.0 * _HEAD_RADIUS_M)
    step = length[:, None] * away + lift[:, None] * up
    tips = 0.5 * (p[a] + p[b]) + step
    first = len(p)
    made = np.stack([b, a, first + np.arange(len(a))], axis=1)
    slot = int(sheet.slots[-1])
    return Surface(
        np.concatenate([sheet.used, sheet.used[a]]),
        np.concatenate([p, tips]),
        np.concatenate([t, 0.5 * (t[a] + t[b]) + step]),
        np.concatenate([sheet.normals, up]),
        np.concatenate([sheet.faces, made]),
        np.concatenate([sheet.slots, np.full(len(made), slot)]),
    )


def add_collar(sheet: Surface, collar: Collar, edges: Indices, neck_z_m: float) -> Surface:
    """The sheet with a strip along the edges of its border above a height of the template."""
    edges = edges[(sheet.template_m[edges, 2] > neck_z_m).all(axis=1)]
    if not len(edges):
        return sheet
    # The neckline's cut zigzags where its level line bends.
    places = calm(sheet.places_m, edges, _NECKLINE_PASSES)
    ring, local = np.unique(edges, return_inverse=True)
    p = places[ring]
    inward = (p.mean(axis=0) - p) * (1.0, 1.0, 0.0)
    step = collar.inward * inward + (0.0, 0.0, collar.rise_m)
    b0, b1 = edges.T
    a0, a1 = local.reshape(-1, 2).T + len(places)
    made = np.concatenate([np.stack([b1, b0, a0], axis=1), np.stack([b1, a0, a1], axis=1)])
    return Surface(
        np.concatenate([sheet.used, sheet.used[ring]]),
        np.concatenate([places, p + step]),
        np.concatenate([sheet.template_m, sheet.template_m[ring] + step]),
        np.concatenate([sheet.normals, sheet.normals[ring]]),
        np.concatenate([sheet.faces, made]),
        np.concatenate([sheet.slots, np.zeros(len(made), dtype=np.int64)]),
    )
