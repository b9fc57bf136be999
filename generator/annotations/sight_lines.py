"""Which points a sensor sees: one ray to each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core import se3
from gen_data.core.asset_types import SURFACES
from gen_data.core.capture import LidarHits, LidarRays
from gen_data.core.interfaces import Renderer
from gen_data.core.sample import TRACK_STATES
from gen_data.core.scene import Lidar, Scene

SLACK_M, SLACK = 5e-4, 2e-5
"""A surface hides a point if it is nearer by more than this, and this share of the distance:
ranges are 32-bit floats."""
MIRRORED = SURFACES.index("mirrored")
VISIBLE, GLASS, OCCLUDED = (TRACK_STATES.index(name) for name in ("visible", "glass", "occluded"))


@dataclass(frozen=True, eq=False, slots=True)
class SightLines:
    """Rays from sensors to points, in the world.

    Attributes:
        origins_m: Where each begins [m], [n, 3].
        ends_m: Its point [m], [n, 3].
        delays_s: Instants of the rays relative to the scene's [s], [n]; None = the scene's.
    """

    origins_m: se3.Array
    ends_m: se3.Array
    delays_s: se3.Array | None = None

    def take(self, rows: NDArray[np.intp]) -> "SightLines":
        """Some of the rays."""
        delays_s = None if self.delays_s is None else self.delays_s[rows]
        return SightLines(self.origins_m[rows], self.ends_m[rows], delays_s)


def trace_sight_lines(
    scene: Scene, lines: Sequence[SightLines], renderer: Renderer
) -> list[tuple[NDArray[np.uint8], NDArray[np.uint16]]]:
    """State of each point, one of the first three of ``TRACK_STATES``, and the id of its occluder.

    Args:
        scene: At the instant of the readings.
        lines: Sight lines of each sensor; no ray has a length of 0. All are traced at once.
        renderer: Traces them.

    Returns:
        For each sensor states, uint8 [n], and instance ids as ``SensorTracks.hidden_by``, uint16.
    """
    ends = np.cumsum([len(one.ends_m) for one in lines])
    state = np.full(ends[-1], VISIBLE, np.uint8)
    hidden_by = np.zeros(ends[-1], np.uint16)
    if len(state):
        ways_m = np.concatenate([one.ends_m - one.origins_m for one in lines])
        distance_m = np.sqrt((ways_m * ways_m).sum(axis=1))
        hits = cast_rays(
            scene,
            np.concatenate([one.origins_m for one in lines]),
            ways_m / distance_m[:, None],
            float(distance_m.max()) + 1.0,
            renderer,
            _delays(lines),
        )
        limit_m = distance_m * (1.0 - SLACK) - SLACK_M
        hidden = hits.range_m[:, 0] < limit_m
        state[hidden] = OCCLUDED
        hidden_by[hidden] = hits.instance_id[hidden, 0]
        if hits.detours is not None:
            through = hits.detours.surface != MIRRORED
            ray = hits.detours.ray[through]
            seen = hidden[ray] & (hits.detours.range_m[through] >= limit_m[ray])
            state[ray[seen]] = GLASS
            blocked = hidden[ray] & ~seen
            hidden_by[ray[blocked]] = hits.detours.instance_id[through][blocked]
    return list(zip(np.split(state, ends[:-1]), np.split(hidden_by, ends[:-1]), strict=True))


def cast_rays(
    scene: Scene,
    origins_m: se3.Array,
    directions: se3.Array,
    reach_m: float,
    renderer: Renderer,
    delays_s: se3.Array | None = None,
) -> LidarHits:
    """First surfaces on rays from origins [n, 3] along unit directions [n, 3] in the world.

    Computed relative to the first origin, as 32-bit floats are coarse far from the world's.
    """
    x, y, z = origins_m[0].tolist()
    eye = Lidar("sight lines", "", T_world_lidar=se3.SE3((x, y, z)))
    shifts_m = (origins_m - origins_m[0]).astype(np.float32)
    rays = LidarRays(
        directions.astype(np.float32),
        0.0,
        1,
        reach_m,
        shifts_m if shifts_m.any() else None,
        None if delays_s is None else delays_s.astype(np.float32),
        _neighbours(origins_m, directions),
    )
    return renderer.scan(scene, eye, rays)


SECTOR_RAD = math.radians(5.0)
"""Angle around Z of the rays that are traced together."""


def _neighbours(origins_m: se3.Array, directions: se3.Array) -> NDArray[np.int32]:
    """Order of rays in which neighbours begin nearby and have nearly one direction.

    Cubic metres of origins, sectors around Z, and in each from below to above.
    """
    sector = np.floor(np.arctan2(directions[:, 1], directions[:, 0]) / SECTOR_RAD)
    keys = (directions[:, 2], sector, *np.rint(origins_m).T)
    return np.lexsort(keys).astype(np.int32)


def _delays(lines: Sequence[SightLines]) -> se3.Array | None:
    """Delays of all rays; None if all rays are at the scene's instant."""
    if all(one.delays_s is None for one in lines):
        return None
    parts = (np.zeros(len(o.ends_m)) if o.delays_s is None else o.delays_s for o in lines)
    return np.concatenate(list(parts))
