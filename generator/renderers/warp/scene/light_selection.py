"""Selection of the lights that matter in a view: each costs the same, however dim."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.colorimetry import luminance
from gen_data.generator.core.scene import LIGHT_KINDS, PANEL_KINDS
from gen_data.generator.core.se3 import Array
from gen_data.generator.renderers.warp.frame_context import CameraView
from gen_data.generator.renderers.warp.scene.kernels import analytic_lights, records
from gen_data.generator.renderers.warp.visibility.gbuffer import GBuffer

_STRIDE_PX = 11
# Assumed background illuminance, so that lamps are not ranked by their effect in the dark [lx].
_DIM_LUX = 0.05
# Minimum cosine: a lamp also matters for surfaces turned away from it, by its glow and reflections.
_TURNED_AWAY = 0.1


def keep_main_lamps(frame: CameraView) -> None:
    """Restrict the world to the lamps that contribute most to the visible surfaces, in place."""
    chosen = main_lamp_numbers(frame)
    if chosen is not None:
        lamps = frame.world.record.lamps.numpy()[chosen]
        frame.world.record.lamps = wp.array(
            lamps, dtype=records.LightRecord, device=frame.cache.device
        )


def main_lamp_numbers(frame: CameraView) -> NDArray[np.int64] | None:
    """Numbers of the lamps that ``keep_main_lamps`` keeps, ascending; None = all."""
    lamps, lamps_max = frame.world.record.lamps.numpy(), frame.settings.max_lamps
    if len(lamps) <= lamps_max:
        return None
    return main_lamps(lamps, *_sparse_points(frame.view, frame.gbuffer), lamps_max)


def main_lamps(
    lamps: NDArray[np.void], points_m: Array, normals: Array, lamps_max: int
) -> NDArray[np.int64]:
    """Numbers of the selected lamp records, ascending: suns first, then by share of light.

    Visible points and their unit normals are in the world frame, [n, 3].
    """
    lux = np.stack([_illuminance(lamp, points_m, normals) for lamp in lamps])
    shares = (lux / (_DIM_LUX + lux.sum(axis=0))).sum(axis=1)
    shares = np.where(lamps["kind"] == LIGHT_KINDS.index("sun"), np.inf, shares)
    order = np.argsort(-shares, kind="stable")
    return np.sort(order[:lamps_max])


def _illuminance(lamp: NDArray[np.void], points_m: Array, normals: Array) -> Array:
    """Unshadowed illuminance of one lamp at points [lx]."""
    kind = LIGHT_KINDS[lamp["kind"]]
    if kind == "sun":
        return np.zeros(len(points_m))
    # Axis by axis: a reduction over a short last axis takes three times as long.
    away = [float(lamp["position_m"][k]) - points_m[:, k] for k in range(3)]
    squared = np.maximum(away[0] * away[0] + away[1] * away[1] + away[2] * away[2], 1e-2)
    distance = np.sqrt(squared)
    direction = [along / distance for along in away]
    cosine = np.maximum(_dot(direction, list(normals.T)), _TURNED_AWAY)
    lux: Array = float(luminance(lamp["power"].astype(np.float64))) * cosine / squared
    if kind == "spot":
        down = -_dot(direction, [float(along) for along in lamp["direction"]])
        span = max(float(lamp["cos_inner"] - lamp["cos_outer"]), 1e-4)
        fade = np.clip((down - lamp["cos_outer"]) / span, 0.0, 1.0)
        lux = lux * fade * fade * (3.0 - 2.0 * fade)
        if lamp["cutoff"] > 0.0:
            lux = lux * dipped_share(lamp, [-along for along in direction])
    elif kind in PANEL_KINDS:
        lux = lux * np.maximum(-_dot(direction, [float(along) for along in lamp["direction"]]), 0.0)
    return lux


def dipped_share(lamp: NDArray[np.void], d: Sequence[Array]) -> Array:
    """As kernels.analytic_lights.dipped_share, for many directions, given axis by axis."""
    axis = [float(along) for along in lamp["direction"]]
    level = math.hypot(axis[0], axis[1])
    right = [axis[1] / level, -axis[0] / level, 0.0]
    up = np.cross(right, axis).tolist()
    ahead = np.maximum(_dot(d, axis), 1e-3)
    side, down = _dot(d, right) / ahead, -_dot(d, up) / ahead
    rise = np.clip(analytic_lights.CUTOFF_RISE * side, 0.0, analytic_lights.CUTOFF_RISE_MAX)
    below = down - float(lamp["cutoff"]) + rise
    t = np.clip(0.5 + 0.5 * below / analytic_lights.CUTOFF_HALF_WIDTH, 0.0, 1.0)
    s = (side - analytic_lights.HOT_SIDE) / analytic_lights.SIDE_WIDTH
    v = np.maximum(below, 0.0) / analytic_lights.DOWN_WIDTH
    lit = t * t * (3.0 - 2.0 * t) / ((1.0 + s * s) * (1.0 + v * v))
    share: Array = np.maximum(lit, analytic_lights.STRAY)
    return share


def _dot(a: Sequence[Array], b: Sequence[Array] | Sequence[float]) -> Array:
    product: Array = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


def _sparse_points(view: records.View, gbuffer: GBuffer) -> tuple[Array, Array]:
    """Visible points and normals at a sparse grid of pixels, world frame."""
    shape = (view.height, view.width)
    z = gbuffer.z_m.numpy().reshape(shape)[::_STRIDE_PX, ::_STRIDE_PX].astype(np.float64)
    normals = gbuffer.normals.numpy().reshape(*shape, 3)[::_STRIDE_PX, ::_STRIDE_PX]
    rows, columns = np.nonzero(np.isfinite(z))
    directions = _directions(view, rows * _STRIDE_PX, columns * _STRIDE_PX)
    p_camera = directions * z[rows, columns, None]
    R = np.array(view.R_world_camera, dtype=np.float64).reshape(3, 3)
    eye = np.array(view.eye_m, dtype=np.float64)
    points = np.einsum("ij,nj->ni", R, p_camera, optimize=False) + eye
    return points, normals[rows, columns].astype(np.float64)


def _directions(view: records.View, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Array:
    """As kernels.records.pixel_direction, at pixel centres."""
    if view.lens != records.PINHOLE:
        directions: Array = view.directions.numpy()[rows * view.width + columns, :3]
        return directions.astype(np.float64)
    x = (columns + 0.5 - view.cx) * view.inverse_fx
    y = (rows + 0.5 - view.cy) * view.inverse_fy
    return np.stack([x, y, np.ones_like(x)], axis=-1)
