"""Two cameras side by side: disparities, and the points that only one of them sees.

Both look the same way through the same pinhole, the second to the right of the first: the images
are rectified. A point at column ``x`` of the left image is at ``x - disparity`` of the right one.
"""

import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, scene

ALIGNED = 1e-6
"""Largest deviation, in metres and as a sine, of cameras that look the same way."""
NEARER_PX = 0.5
"""Occluders are nearer by more than this disparity: on a surface that both cameras see, disparity
changes by no more than that between a point and the centre of its column."""


def baseline_m(left: scene.Camera, right: scene.Camera) -> float:
    """How far the right camera is to the right of the left one.

    Raises:
        ValueError: they are not a rectified pair.
    """
    if left.intrinsics != right.intrinsics or not left.intrinsics.straight:
        raise ValueError("they are not the same pinhole")
    T_left_right = left.T_world_camera.inverse() @ right.T_world_camera
    x, y, z = T_left_right.translation_m
    if left.rig and left.rig == right.rig:
        # Poses in the world are rounded: on a rig that leans, the pair would not look exact.
        T_left_right = left.T_rig_camera.inverse() @ right.T_rig_camera
        _, y, z = T_left_right.translation_m
    if np.abs(T_left_right.rotation() - np.eye(3)).max() > ALIGNED:
        raise ValueError("they do not look the same way")
    if max(abs(y), abs(z)) > ALIGNED or x <= 0.0:
        raise ValueError(
            f"one is {x:.6g} m to the right of, {y:.6g} m below and {z:.6g} m before the other, "
            "not straight to its right"
        )
    return float(x)


def disparity_px(z_depth_m: asset_types.Float32, focal_baseline: float) -> asset_types.Float32:
    """``focal * baseline / z`` [px]; 0 where the depth is inf.

    ``focal_baseline`` is the focal length [px] times the baseline [m]; negative = the other camera
    is to the left.
    """
    return np.asarray(np.divide(focal_baseline, z_depth_m, dtype=np.float32))


def is_seen_by_both(
    here_px: asset_types.Float32, there_px: asset_types.Float32, *, beyond: bool = False
) -> NDArray[np.bool_]:
    """Whether the other camera sees the points that this one does, bool [h, w].

    It does if the point is in its image and the column that the point lies in shows nothing nearer.
    Disparities of both images have the same sign; 0 = nothing.

    ``beyond``: the other one, such as a projector, also sees points outside its image.
    """
    height, width = here_px.shape
    column = np.floor(np.arange(width, dtype=np.float32) + 0.5 - here_px).astype(np.int64)
    inside = (column >= 0) & (column < width)
    other_px = there_px[np.arange(height)[:, None], np.clip(column, 0, width - 1)]
    is_free = np.abs(other_px) <= np.abs(here_px) + NEARER_PX
    return np.asarray(np.where(inside, is_free, beyond) & (here_px != 0.0))
