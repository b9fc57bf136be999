"""Origins of the points of a laser scan: by which path, from which instance and place.

Detection selects and merges hits by their light. Each hit therefore carries the number of its
secondary hit along, in the upper bits of its instance id.
"""

from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, errors
from gen_data.core.capture import ORIGIN, PATHS, LidarHits, SecondaryHits
from gen_data.core.scene import Lidar

_ID_BITS = 16


def number_detours(hits: LidarHits, before: SecondaryHits | None = None) -> LidarHits:
    """Hits with int64 ids: instance id, and above it 1 + number of a secondary hit, 0 for first.

    Numbers go on after the secondary hits ``before``, as in ``join_detours``.
    """
    ids: NDArray[Any] = hits.instance_id.astype(np.int64)
    detours = hits.detours
    if detours is not None:
        first = 1 + (0 if before is None else len(before.ray))
        numbers = np.arange(first, first + len(detours.ray), dtype=np.int64) << _ID_BITS
        mixed: NDArray[Any] = numbers | detours.instance_id
        detours = replace(detours, instance_id=mixed)
    return replace(hits, instance_id=ids, detours=detours)


def join_detours(first: SecondaryHits | None, more: SecondaryHits | None) -> SecondaryHits | None:
    """Secondary hits of two sets of beams, one after the other; ``ray`` counts within each set."""
    if first is None or more is None:
        return first or more
    joined: dict[str, Any] = {}
    for field in fields(SecondaryHits):
        parts = [getattr(hits, field.name) for hits in (first, more)]
        joined[field.name] = None if any(p is None for p in parts) else np.concatenate(parts)
    return SecondaryHits(**joined)


def split_numbers(mixed: NDArray[Any]) -> tuple[NDArray[np.uint16], NDArray[np.int64]]:
    """Instance ids, and numbers of secondary hits (-1 for first hits), of ``number_detours``."""
    return (mixed & ((1 << _ID_BITS) - 1)).astype(np.uint16), (mixed >> _ID_BITS) - 1


def make_origins(
    ids: NDArray[np.uint16],
    detour: NDArray[np.int64],
    straight_m: NDArray[np.float32],
    detours: SecondaryHits | None,
    lidar: Lidar,
) -> NDArray[np.void]:
    """Records of ``ORIGIN`` [n].

    Args:
        ids: Instance id of each return.
        detour: Number of its secondary hit; -1 for first hits.
        straight_m: Points at the true ranges on the pulses, lidar frame, [n, 3].
        detours: The secondary hits.
        lidar: The scanner.

    Raises:
        SampleError: the renderer does not state the mirrored surfaces.
    """
    origins: NDArray[np.void] = np.zeros(len(ids), ORIGIN)
    origins["true_instance_id"] = ids
    place_m = straight_m.astype(np.float64)
    if detours is not None:
        mirrored = detours.surface == asset_types.SURFACES.index("mirrored")
        paths = np.where(mirrored, PATHS.index("mirror"), PATHS.index("glass"))
        further = detour >= 0
        origins["path"][further] = paths[detour[further]]
        by_mirror = further & mirrored[np.maximum(detour, 0)]
        shown = detour[by_mirror]
        if detours.mirrored_id is None or detours.mirrored_m is None:
            raise errors.SampleError(
                f"sensor '{lidar.name}': origins: this renderer does not state mirrored surfaces"
            )
        origins["true_instance_id"][by_mirror] = detours.mirrored_id[shown]
        place_m[by_mirror] = detours.mirrored_m[shown]
    origins["true_position_m"] = lidar.T_world_lidar.apply(place_m)
    return origins
