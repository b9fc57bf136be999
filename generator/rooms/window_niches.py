"""Ambient light of window niches: part of it comes from outdoors."""

from collections.abc import Sequence

import numpy as np

from gen_data.core.scene import VOLUME_REACH_M, IrradianceVolume
from gen_data.core.se3 import Array, Vec3
from gen_data.rooms.interreflection import AXES, Hole, LitRoom

_SILL_M = 0.06
"""Reach into the room: sills stand out of the wall by 0.05 m."""
_REVEAL_M = 0.005
"""Beyond the hole, for its own sides to count."""
_ASIDE = 0.3
"""Share of outdoors in the light on surfaces across the wall; frames hide some of the half."""


def find_niches(
    rooms: Sequence[LitRoom], volumes: Sequence[IrradianceVolume], outside_cd_m2: Vec3
) -> tuple[IrradianceVolume, ...]:
    """The volumes of all windows, which replace their rooms' volumes there.

    Args:
        rooms: The rooms.
        volumes: Light in each of them.
        outside_cd_m2: Mean luminance of the view from the windows, linear RGB.
    """
    return tuple(
        _niche(hole, np.array(volume.light_cd_m2).reshape(-1, 6, 3).mean(axis=0), outside_cd_m2)
        for room, volume in zip(rooms, volumes, strict=True)
        for hole in room.holes
        if hole.twin is None
    )


def _niche(hole: Hole, room_cd_m2: Array, outside_cd_m2: Vec3) -> IrradianceVolume:
    """A flat box whose reach fills the niche, from the end of its sill to beyond the frame."""
    axis, way = hole.side // 2, AXES[hole.side]
    reach_m = VOLUME_REACH_M - _REVEAL_M
    low, high = np.array(hole.low_m) + reach_m, np.array(hole.high_m) - reach_m
    middle = 0.5 * (low + high)
    low, high = np.minimum(low, middle - 1e-3), np.maximum(high, middle + 1e-3)
    plane = hole.low_m[axis] + (VOLUME_REACH_M - _SILL_M) * float(way[axis])
    low[axis], high[axis] = plane - 5e-4, plane + 5e-4
    facing = AXES @ way
    share = np.where(facing == 0.0, _ASIDE, np.maximum(facing, 0.0))
    light = share[:, None] * np.array(outside_cd_m2) + (1.0 - share)[:, None] * room_cd_m2
    values = tuple(float(f"{v:.3g}") for v in light.ravel().tolist())
    return IrradianceVolume(_rounded(low), _rounded(high), (1, 1, 1), values)


def _rounded(corner: Array) -> Vec3:
    x, y, z = (round(float(v), 5) for v in corner)
    return (x, y, z)
