"""Where one may drive, in images."""

from dataclasses import replace
from functools import lru_cache
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.annotations.bev_raster import Float32, Grid, heights_m
from gen_data.config.base_model import Strict
from gen_data.core import boxes, rolling_shutter_projection, se3
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.sample import ImageTruth, MaskPx
from gen_data.core.scene import Body, Scene
from gen_data.roads.carriageway import carriageway

TILE_M = 16.0
"""Grids are centred on multiples of this, for the cameras of a rig to share one."""
CELL_M = 0.1
ON_IT_M = 0.03
"""Points this near the carriageway's surface are on it: half the rise within a cell of the
steepest streets, and lower than any kerb."""


class FreeSpace(Strict):
    """Pixels that show unoccupied carriageway, decided by the hit point of each pixel.

    Attributes:
        far_m: Pixels with points farther away than this, over the ground, are left out.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.RANGE, Channel.INSTANCE})
    type: Literal["free_space"] = "free_space"
    far_m: float = Field(60.0, gt=0, le=200)

    def annotate_image(
        self, scene: Scene, assets: AssetLibrary, reading: SensorReading, truth: ImageTruth
    ) -> ImageTruth:
        """Fill in ``free_space``; an empty mask if no pixel is free."""
        ranges_m = reading.channels[Channel.RANGE]
        # The range exceeds the distance over the ground: the factor allows for high cameras.
        free = (reading.channels[Channel.INSTANCE] == 0) & (ranges_m < 2.0 * self.far_m)
        rows, columns = np.nonzero(free)
        x, y, _ = reading.camera.T_world_camera.translation_m
        middle = (TILE_M * round(x / TILE_M), TILE_M * round(y / TILE_M))
        background = tuple(b for b in scene.bodies if b.instance_id == 0 and b.motion == "static")
        grid = Grid(se3.SE3((*middle, 0.0)), CELL_M, 2 * round((self.far_m + TILE_M) / CELL_M))
        ground = _ground(background, assets, grid)
        p_camera = reading.camera.intrinsics.pixel_rays()[rows, columns]
        p_camera = p_camera * ranges_m[rows, columns, None].astype(np.float64)
        p_world = rolling_shutter_projection.world_points(scene, reading.camera, p_camera, rows)
        here = (p_world[:, 0] - x) ** 2 + (p_world[:, 1] - y) ** 2 < self.far_m**2
        cells = grid.cells(p_world)
        on = np.where(here[:, None], np.floor(cells[:, :2]), 0.0).astype(np.intp)
        free[rows, columns] = here & (np.abs(cells[:, 2] - ground[on[:, 0], on[:, 1]]) < ON_IT_M)
        return replace(truth, free_space=_crop_mask(free))


@lru_cache(maxsize=2)
def _ground(background: tuple[Body, ...], assets: AssetLibrary, grid: Grid) -> Float32:
    """Height of the carriageway above the world's origin; -inf = none."""
    parts = [np.zeros((0, 3, 3)), *(carriageway(body, assets) for body in background)]
    return heights_m(grid, np.concatenate(parts))


def _crop_mask(mask: NDArray[np.bool_]) -> MaskPx:
    box = boxes.tight_box(mask)
    if box is None:
        return MaskPx(0, 0, np.zeros((0, 0), dtype=bool))
    return MaskPx(box.x_min, box.y_min, mask[box.window()].copy())
