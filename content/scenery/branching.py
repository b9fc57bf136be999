"""Branching of trees, and the wood around the branches.

Space colonization: Runions, Lane and Prusinkiewicz, "Modeling trees with a space colonization
algorithm", Eurographics Workshop on Natural Phenomena, 2007. Branch radii follow the pipe model:
Shinozaki et al., "A quantitative analysis of plant form", Japanese Journal of Ecology 14, 1964.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.content.procedural.patches import (
    Array,
    Indices,
    Patch,
    join_patches,
    round_values,
    unit,
)
from gen_data.content.procedural.surface_shapes import circle, sweep
from gen_data.core import noise, se3, streams

_PIPE_EXPONENT = 2.3
_ROUNDS_MAX = 70
# Attraction points act within this many steps, and are reached at this many.
_SEEN, _REACHED = 9.0, 1.8


@dataclass(frozen=True, slots=True)
class Lobe:
    """An ellipsoid of a crown: its centre and semi-axes [m]."""

    centre_m: se3.Vec3
    axes_m: se3.Vec3


@dataclass(frozen=True, eq=False, slots=True)
class Skeleton:
    """Nodes of a tree, each after its parent.

    Attributes:
        nodes_m: Positions, [n, 3].
        parents: Number of each node's parent, -1 for the root, [n].
        radii_m: Radius of the wood at each node, [n].
    """

    nodes_m: Array
    parents: Indices
    radii_m: Array

    def twigs(self) -> Array:
        """Positions of the nodes at the ends of branches, where leaves grow, [k, 3]."""
        thin = self.radii_m <= 2.2 * float(self.radii_m.min())
        return np.array(self.nodes_m[thin])


def points_in(lobes: Sequence[Lobe], count: int, rng: streams.Rng) -> Array:
    """Points in ellipsoids, denser towards their surfaces, [about count, 3]."""
    volume = np.array([float(np.prod(lobe.axes_m)) for lobe in lobes])
    found = []
    for lobe, share in zip(lobes, volume / volume.sum(), strict=True):
        wanted = max(4, round(count * float(share)))
        cube = 2.0 * noise.uniform((6 * wanted, 3), rng) - 1.0
        r2 = (cube**2).sum(axis=1)
        kept = cube[(r2 < 1.0) & (r2 > 0.12)][:wanted]
        found.append(np.array(lobe.centre_m) + kept * np.array(lobe.axes_m))
    return np.concatenate(found)


def grow_skeleton(
    trunk_m: Array, attractors_m: Array, step_m: float, base_radius_m: float
) -> Skeleton:
    """A tree that grows from the top of a trunk towards attraction points."""
    nodes = [*trunk_m]
    parents = [*range(-1, len(trunk_m) - 1)]
    free = attractors_m
    nearest, distance = _nearest(free, np.array(nodes), 0)
    # From the ground no point may be near: the first rounds reach as far as they must.
    sight = max(_SEEN * step_m, float(distance.min()) + step_m)
    for _ in range(_ROUNDS_MAX):
        seen = distance < sight
        if not seen.any():
            break
        fresh = _shoots(np.array(nodes), parents, free[seen], nearest[seen], step_m)
        if not fresh:
            break
        start = len(nodes)
        for parent, position in fresh:
            nodes.append(position)
            parents.append(parent)
        number, gap = _nearest(free, np.array(nodes[start:]), start)
        closer = gap < distance
        nearest, distance = np.where(closer, number, nearest), np.where(closer, gap, distance)
        kept = distance > _REACHED * step_m
        free, nearest, distance = free[kept], nearest[kept], distance[kept]
    order = np.array(parents, dtype=np.int64)
    return Skeleton(np.array(nodes), order, _radii(order, base_radius_m))


def wood(skeleton: Skeleton, thinnest_m: float, stride: int = 2) -> Patch:
    """Tapered tubes along the branches that are thicker than ``thinnest_m``."""
    tubes = []
    for chain in _chains(skeleton):
        radii = skeleton.radii_m[chain]
        thick = int((radii[1:] >= thinnest_m).sum())
        if thick < 2:
            continue
        kept = np.unique([*range(0, thick, stride), thick])
        path, r = skeleton.nodes_m[chain][kept], radii[kept].copy()
        # A branch starts with its own thickness, not with its parent's.
        r[0] = min(r[0], 1.25 * r[1])
        sides = 8 if r[0] > 0.1 else 5 if r[0] > 0.035 else 3
        up = (1.0, 0.0, 0.0) if abs(path[1, 2] - path[0, 2]) > 0.05 else (0.0, 0.0, 1.0)
        tubes.append(sweep(path, circle(1.0, sides), up=up, scale=r, capped=sides > 3))
    return join_patches(tubes)


def _nearest(points: Array, nodes: Array, start: int) -> tuple[Indices, Array]:
    """Number of the node nearest to each point, and its distance."""
    gap = np.sqrt(((points[:, None] - nodes[None]) ** 2).sum(axis=2))
    number = gap.argmin(axis=1)
    return number + start, np.take_along_axis(gap, number[:, None], axis=1)[:, 0]


def _shoots(
    nodes: Array, parents: Sequence[int], free: Array, nearest: Indices, step_m: float
) -> list[tuple[int, Array]]:
    """New nodes: one step from each node towards the mean of the points it is nearest to."""
    towards = unit(free - nodes[nearest])
    mean = np.stack([np.bincount(nearest, towards[:, i], len(nodes)) for i in range(3)], axis=1)
    shoots = []
    for k in np.unique(nearest).tolist():
        length = float(np.sqrt((mean[k] ** 2).sum()))
        if length < 1e-6:
            continue
        before = nodes[k] - nodes[parents[k]] if parents[k] >= 0 else np.array([0.0, 0.0, 1.0])
        direction = mean[k] / length + 0.25 * before / np.sqrt((before**2).sum())
        position = nodes[k] + step_m * direction / np.sqrt((direction**2).sum())
        # A coarse grid: no last bit may decide which node is nearest in a later round.
        position = np.round(round_values(position), 4)
        if float(((nodes - position) ** 2).sum(axis=1).min()) > (0.4 * step_m) ** 2:
            shoots.append((k, position))
    return shoots


def _radii(parents: Indices, base_m: float) -> Array:
    """Pipe model: the flow through a node is the sum of the flows through its children."""
    flow = np.zeros(len(parents))
    for k in range(len(parents) - 1, -1, -1):
        flow[k] = max(flow[k], 1.0)
        if parents[k] >= 0:
            flow[parents[k]] += flow[k]
    radii: Array = base_m * (flow / flow[0]) ** (1.0 / _PIPE_EXPONENT)
    return radii


def _chains(skeleton: Skeleton) -> list[Indices]:
    """Paths from a fork to a tip along the thickest child; together they cover the tree."""
    children: list[list[int]] = [[] for _ in skeleton.parents]
    for k, parent in enumerate(skeleton.parents.tolist()):
        if parent >= 0:
            children[parent].append(k)
    chains = []
    starts = [(-1, 0)]
    while starts:
        before, k = starts.pop()
        chain = [before, k] if before >= 0 else [k]
        while children[k]:
            heir = max(children[k], key=lambda c: (float(skeleton.radii_m[c]), -c))
            starts += [(k, c) for c in children[k] if c != heir]
            chain.append(heir)
            k = heir
        chains.append(np.array(chain, dtype=np.int64))
    return chains
