"""Views of occupancy: voxels with a surface, coloured by category, else by surface."""

import numpy as np

from gen_data.core.sample import VOXEL_STATES, Occupancy
from gen_data.core.scene import Scene
from gen_data.exporters.label_parts import categories_of, surface_voxels, voxel_colors
from gen_data.preview.overlay import Image
from gen_data.preview.sensor_views import empty_view

DOWN, AROUND = np.radians(40.0), np.radians(-70.0)
"""Pitch of the view, and its direction over the ground, from X: from behind, from the left."""
FACES = ((2, 1.0), (0, 0.78), (1, 0.6))
"""Axes of the visible faces of a voxel, and their shades."""
ASPECT = 1.6
"""Width over height."""
UNSEEN = 0.35
"""Brightness of voxels that no sensor observes."""


def view_from_above(grid: Occupancy, scene: Scene) -> Image:
    """Draw a pixel per column of voxels, uint8 [x, y, 3]: X upwards, Y to the left.

    It has the colour of the highest surface that a sensor observes below air that it observes:
    below ceilings, too. Elsewhere it is dark: the highest surface; black without any.
    """
    surface = grid.state == VOXEL_STATES.index("surface")
    # Without a sensor, none is dark.
    seen = np.logical_or.reduce([*grid.observed.values()] or [np.ones(surface.shape, np.bool_)])
    air = seen & (grid.state == VOXEL_STATES.index("free"))
    above = np.concatenate([air[..., 1:], np.ones_like(air[..., :1])], axis=2)
    chosen = surface & seen & above
    bright = chosen.any(axis=2)
    chosen[~bright] = surface[~bright]
    top = chosen.shape[2] - 1 - chosen[..., ::-1].argmax(axis=2)
    x, y = np.indices(top.shape)
    shade = np.where(bright, 1.0, UNSEEN)[..., None]
    colors = voxel_colors(grid, categories_of(scene))[x, y, top] * shade
    colors[~chosen.any(axis=2)] = 0
    return np.ascontiguousarray(colors.astype(np.uint8)[::-1, ::-1])


def oblique_view(grid: Occupancy, scene: Scene) -> Image:
    """Draw voxels with a surface from behind and above, uint8 [h, w, 3]; unobserved ones dark."""
    image = empty_view(ASPECT)
    height, width = image.shape[:2]
    centers, colors = surface_voxels(grid, categories_of(scene))
    if not len(centers):
        return image
    shown = grid.state == VOXEL_STATES.index("surface")
    # Without a sensor, none is dark.
    masks = [mask[shown] for mask in grid.observed.values()]
    seen = np.logical_or.reduce(masks) if masks else np.ones(len(centers), np.bool_)
    shade = np.where(seen, 1.0, UNSEEN)[:, None]
    c, s = np.cos(AROUND), np.sin(AROUND)
    right = np.array([-s, c, 0.0]) * -1.0
    up = np.array([-c * np.sin(DOWN), -s * np.sin(DOWN), np.cos(DOWN)]) * np.array([-1, -1, 1])
    near = np.cross(right, up)
    scale = 0.97 * min(width / np.ptp(centers @ right), height / np.ptp(centers @ up))
    steps = int(np.ceil(scale * grid.voxel_m)) + 1
    across = (np.arange(steps) + 0.5) / steps - 0.5
    parts = []
    for axis, brightness in FACES:
        one, other = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
        out = np.sign(near[axis]) * 0.5 * np.eye(3)[axis]
        places = out + across[:, None, None] * one + across[:, None] * other
        parts.append((places.reshape(-1, 3) * grid.voxel_m, brightness))
    middle = 0.5 * (centers.max(axis=0) + centers.min(axis=0))
    depth = np.full((height, width), -np.inf)
    for places, brightness in parts:
        ink = (brightness * shade * colors).astype(np.uint8)
        for place in places:
            p = centers + place - middle
            column = np.floor(0.5 * width + scale * (p @ right)).astype(np.intp)
            row = np.floor(0.5 * height - scale * (p @ up)).astype(np.intp)
            away = p @ near
            inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
            order = np.flatnonzero(inside)[np.argsort(away[inside], kind="stable")]
            u, v, z = column[order], row[order], away[order]
            nearest = z >= depth[v, u]
            u, v, z, order = u[nearest], v[nearest], z[nearest], order[nearest]
            depth[v, u] = z
            image[v, u] = ink[order]
    return image
