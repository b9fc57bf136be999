"""Beams at whose rims there may be something else than on their axes.

Pulses of a scanner lie as close as its beams are wide (an HDL-64E fires every 0.17 degrees, its
beams have 0.11): most edges in a scene go through a beam. Where a beam and its neighbours end on
one plane, all its rays do.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gen_data.core.capture import LidarRays
from gen_data.sensors.lidar.scan_pattern import LidarModel

Float32 = NDArray[np.float32]
STEP_MIN_RAD = 1e-4
"""Least angle between rings: a table of beams may have equal elevations."""


def find_edges(range_m: Float32, model: LidarModel) -> NDArray[np.intp]:
    """Indices of the beams next to an edge, by the ranges of their axes [n].

    Neighbours are the pulses before and after in the same ring and, for rotating scanners, in the
    rings above and below. Next to an edge a range deviates from the plane through its neighbours by
    more than a pulse length, within which echoes merge; on a plane 1 / range is linear in a small
    angle. A range of inf is nothing within reach.
    """
    elevation_rad = np.zeros(1) if model.prisms is not None else model.elevations_rad()
    rings = len(elevation_rad)
    near = (np.float32(1.0) / np.maximum(range_m, np.float32(1e-3))).reshape(-1, rings)
    around = np.concatenate([near[-1:], near, near[:1]])
    marked = _bends(around, np.ones((len(near) + 1, 1), np.float32), model.pulse_m)
    if rings > 2:
        order = np.argsort(elevation_rad)
        column = (np.arange(len(near))[:, None] + _shifts(model, rings)) % len(near)
        step = np.maximum(np.diff(elevation_rad[order]), STEP_MIN_RAD).astype(np.float32)
        beside = np.take_along_axis(near, column, axis=0)[:, order].T
        inner = order[1:-1]
        marked[column[:, inner], inner] |= _bends(beside, step[:, None], model.pulse_m).T
    return np.flatnonzero(marked)


def _shifts(model: LidarModel, rings: int) -> NDArray[np.int64]:
    """Columns by which each ring fires later at the same azimuth, [rings]."""
    offset_deg = np.resize(np.asarray(model.azimuth_offsets_deg or (0.0,)), rings)
    return np.rint(offset_deg / 360.0 * model.columns).astype(np.int64)


def _bends(near: Float32, step: Float32, pulse_m: float) -> NDArray[np.bool_]:
    """Which rows of 1 / range [1/m] but the first and the last are off their neighbours' plane.

    Args:
        near: By angle and direction across it, [n + 2, k].
        step: Angles between rows, [n + 1, 1].
        pulse_m: Largest deviation of a range.
    """
    slope = np.diff(near, axis=0) / step
    bend = np.abs(np.diff(slope, axis=0)) * np.minimum(step[1:], step[:-1])
    nearest = np.maximum(np.maximum(near[:-2], near[2:]), near[1:-1])
    return np.asarray(bend > np.float32(pulse_m) * nearest * nearest)


def choose_beams(beams: LidarRays, which: NDArray[np.intp], subrays: int) -> LidarRays:
    """The beams at ascending indices ``which`` [m], of several rays each."""
    order = None
    if beams.order is not None:
        number = np.full(len(beams.directions), -1, np.int32)
        number[which] = np.arange(len(which), dtype=np.int32)
        order = number[beams.order]
        order = order[order >= 0]
    origins_m, time_s = (
        None if part is None else part[which] for part in (beams.origins_m, beams.time_s)
    )
    return replace(
        beams,
        directions=beams.directions[which],
        subrays=subrays,
        origins_m=origins_m,
        time_s=time_s,
        order=order,
    )
