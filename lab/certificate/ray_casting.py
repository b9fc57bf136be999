"""An independent ray caster: Intel Embree, through Open3D, over the same meshes and poses.

It shares scenes, meshes and materials with the renderer, and none of the renderer's results:
hierarchies, rasteriser, intersections, labels, encoding. Rays list all surfaces they cross; holes
in textures and panes of glass need no textures here: a surface that a ray may pass hides nothing
behind it.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, interfaces, se3
from gen_data.core.scene import Scene
from gen_data.lab.certificate.finding import Contradictions, Finding, not_checked

DISAGREEING_SHARE = 0.001
"""Largest share of rays that may disagree: rays through edges, where either surface is right."""
UNSTATED = -1
"""Instance id where none is stated."""
FALSE_ALARM = 1e-6
"""Probability that a sensor whose rays disagree in this share is refused."""
CONFIDENCE = 0.99
"""Of the stated limit to the share of rays of the whole data set that disagree."""

Passes = Callable[[asset_types.Material], bool]
"""Whether rays may go through surfaces of a material."""


@dataclass(frozen=True, eq=False)
class Seen:
    """Stated contents of rays, in units of the lengths of their directions; arrays [n].

    Attributes:
        distance: To the first surface; inf = nothing, NaN = not stated.
        tolerance: Tolerance of the distance.
        instance_id: Id of the surface's instance; ``UNSTATED`` = not stated.
        reach: Farthest distance that would have been stated.
    """

    distance: se3.Array
    tolerance: se3.Array
    instance_id: NDArray[np.int64]
    reach: se3.Array

    def at(self, rays: NDArray[np.intp]) -> "Seen":
        """Statements about the rays at these indices."""
        return Seen(
            self.distance[rays], self.tolerance[rays], self.instance_id[rays], self.reach[rays]
        )


@dataclass
class Agreement:
    """Agreement of the rays of one sensor.

    Attributes:
        readings: Number of images or scans.
        rays: Number of pixels or points.
        contradictions: The rays that disagree.
        others: Further counts, by name.
    """

    readings: int = 0
    rays: int = 0
    contradictions: Contradictions = field(default_factory=Contradictions)
    others: Counter[str] = field(default_factory=Counter)

    def finding(self, sensor: str, reading: str, ray: str) -> Finding:
        """The finding about a sensor, whose readings and rays have these names in the plural.

        Disagreements fail a sensor if so many are improbable at ``DISAGREEING_SHARE`` (binomial
        test).
        """
        from scipy import stats

        if not self.rays:
            return not_checked(sensor, f"none of the {reading} of the sampled steps has {ray}")
        tolerated = int(stats.binom.isf(FALSE_ALARM, self.rays, DISAGREEING_SHARE))
        figures = {
            reading: self.readings,
            ray: self.rays,
            **dict(sorted(self.others.items())),
            "disagreeing share, at most (99 %)": share_limit(self.contradictions.count, self.rays),
        }
        return self.contradictions.judge(sensor, figures, tolerated)


def share_limit(k: int, n: int) -> float:
    """Upper limit, at ``CONFIDENCE``, to a share of which k of n independent draws were found.

    The limit of Clopper and Pearson (Biometrika 26, 1934).
    """
    from scipy import stats

    return 1.0 if k >= n else round(float(stats.beta.ppf(CONFIDENCE, k + 1, n - k)), 5)


class RayCaster:
    """The bodies of a scene at its instant.

    Args:
        scene: The world.
        library: Its assets.
        origin_m: Coordinates are counted from here, world: 32 bits suffice for nearby points.
        passes: Whether rays may go through surfaces of a material.

    Raises:
        ImportError: Open3D is not installed, or a library of the system is missing.
    """

    def __init__(
        self, scene: Scene, library: interfaces.AssetLibrary, origin_m: se3.Array, passes: Passes
    ) -> None:
        try:
            open3d: Any = import_module("open3d")
        except OSError as error:
            raise ImportError(f"open3d cannot be loaded: {error}") from error
        self._tensor = open3d.core.Tensor
        self._caster: Any = open3d.t.geometry.RaycastingScene(nthreads=1)
        self._origin_m = np.asarray(origin_m, np.float64)
        ids, passable = [], []
        for body in scene.bodies:
            mesh = library.mesh(body.asset)
            placed = body.T_world_body.apply(mesh.vertices_m.astype(np.float64) * body.scale)
            self._caster.add_triangles(
                self._tensor((placed - self._origin_m).astype(np.float32)),
                self._tensor(mesh.faces.astype(np.uint32)),
            )
            ids.append(body.instance_id)
            slots = np.array([passes(m) for m in body.materials or mesh.materials], bool)
            passable.append(slots[mesh.face_slots])
        self._instance_id = np.array(ids, np.int64)
        self._first_face = np.cumsum([0, *map(len, passable)])[:-1]
        self._passable = np.concatenate(passable) if passable else np.zeros(0, bool)

    def agrees(self, origins_m: se3.Array, directions: se3.Array, seen: Seen) -> NDArray[np.bool_]:
        """Whether surfaces that rays cross are as the data set states, bool [n].

        A ray agrees if one of the surfaces that it can reach is at the stated distance and belongs
        to the stated object. Where nothing is stated, nothing within reach may stop the ray;
        without a distance, no object may stand for a background or for nothing.

        Args:
            origins_m: Origins of the rays, world, [n, 3].
            directions: World, of any length, [n, 3].
            seen: Statements of the data set.
        """
        ray, distance, ids, solid = self._crossings(origins_m, directions)
        within = distance < seen.reach[ray]
        stopped = np.zeros(len(seen.distance), bool)
        stopped[ray[solid & within]] = True
        deviation = np.abs(distance - seen.distance[ray])
        near = (deviation <= seen.tolerance[ray]) | np.isnan(deviation)
        here = (seen.instance_id[ray] == UNSTATED) | (ids == seen.instance_id[ray])
        met = np.zeros(len(seen.distance), bool)
        met[ray[near & here & (_solids_before(ray, solid) == 0)]] = True
        vacant = np.isinf(seen.distance) | (np.isnan(seen.distance) & (seen.instance_id == 0))
        return np.asarray(met | (vacant & ~stopped), np.bool_)

    def _crossings(
        self, origins_m: se3.Array, directions: se3.Array
    ) -> tuple[NDArray[np.intp], se3.Array, NDArray[np.int64], NDArray[np.bool_]]:
        """All crossings, ordered by ray and distance.

        Number of the ray, distance, instance id, and whether nothing passes, [crossings] each.
        """
        rays = np.concatenate([origins_m - self._origin_m, directions], axis=1)
        found = self._caster.list_intersections(self._tensor(rays.astype(np.float32)))
        ray = found["ray_ids"].numpy().astype(np.intp)
        distance = found["t_hit"].numpy().astype(np.float64)
        body = found["geometry_ids"].numpy().astype(np.intp)
        face = found["primitive_ids"].numpy().astype(np.intp)
        order = np.lexsort((distance, ray))
        ray, distance, body, face = ray[order], distance[order], body[order], face[order]
        solid = ~self._passable[self._first_face[body] + face]
        return ray, distance, self._instance_id[body], solid


def _solids_before(ray: NDArray[np.intp], solid: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Number of solid crossings before each crossing on its ray."""
    total: NDArray[np.intp] = np.cumsum(solid) - solid
    first = np.searchsorted(ray, ray)
    return np.asarray(total - total[first], np.intp)


def has_holes(library: interfaces.AssetLibrary) -> Passes:
    """Whether the texture of a material has holes, which labels of cameras go through."""

    def passes(material: asset_types.Material) -> bool:
        return bool(material.texture) and library.texture(material.texture).alpha is not None

    return passes


GLASS = "glass"
"""Role of panes that stop sight and let laser light through; house windows do not."""


def lets_light_through(library: interfaces.AssetLibrary) -> Passes:
    """Whether a laser may go through a material: panes, other clear ones, textures with holes."""
    holes = has_holes(library)

    def passes(material: asset_types.Material) -> bool:
        clear = material.transmission > 0.0 or material.opacity < 1.0
        return clear or material.role == GLASS or holes(material)

    return passes
