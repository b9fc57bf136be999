"""Kinds of surfaces behind pixels without an instance: ground of streets, and sky.

The instance images of a renderer name objects and scenery; ground and sky have instance 0 there.
The ground is looked up by the position of each pixel's point, from its depth, on a map of the
background bodies, drawn from above by the roles of their materials. Its resolution is 1 cm within
12 m around the camera, 5 cm within 64 m and 25 cm beyond; depths come from the 16-bit image.
Overpasses are not told from the road below. Ground beyond the range of the depth image is unknown.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core.capture import Channel
from gen_data.core.interfaces import AssetLibrary, DatasetInfo, media_path
from gen_data.core.rolling_shutter_projection import world_points
from gen_data.core.sample import Sample
from gen_data.core.scene import Body, Camera, Scene
from gen_data.core.se3 import Array
from gen_data.exporters.image_files import DEPTH_UNITS_MAX, read_image

UInt8 = NDArray[np.uint8]
UInt16 = NDArray[np.uint16]

SURFACES = ("", "asphalt", "marking", "pavement", "kerb", "grass", "sky")
"""Values of surface images: roles of materials of the ground, and the sky; 0 = unknown."""
SKY = SURFACES.index("sky")
SKY_FROM_M = 100.0
"""Depth images that end nearer than this do not tell the sky from a distant wall."""
MAPS = ((0.01, 12.0, 4.0), (0.05, 64.0, 32.0), (0.25, 320.0, 128.0))
"""Side of a cell, reach and step [m] of each map, the finest first. Maps are centred on multiples
of the step: the cameras of a rig and many views of a scene share them."""
_SUBPIXEL_BITS = 4
_BLOCK_BITS = 5
_BLOCK = 1 << _BLOCK_BITS
"""Cells along a side of the blocks that are drawn at once."""
_MARGIN = 2
"""Cells around a triangle that its drawing may touch."""


def read_surfaces(
    info: DatasetInfo, sample: Sample, camera: str, shard_dir: Path, assets: AssetLibrary
) -> tuple[UInt16, UInt8]:
    """Read the instance image of a camera, and find the surfaces behind it.

    Args:
        info: The data set.
        sample: Its scene and the truth of the camera are used.
        camera: Sensor that writes the instance channel; without the depth channel, nothing is
            known of the background.
        shard_dir: Folder of the images.
        assets: Meshes and materials of the background.

    Returns:
        Instance ids, uint16 [h, w], 0 = none; and indices of ``SURFACES`` where there is no
        instance, uint8 [h, w].

    Raises:
        StorageError: an image is missing.
    """
    path = media_path(shard_dir, camera, Channel.INSTANCE, sample.index)
    instances = read_image(path, Channel.INSTANCE, info.depth_scale_m).astype(np.uint16, copy=False)
    surfaces = np.zeros(instances.shape, np.uint8)
    free = instances == 0
    ground = _ground_of(sample.scene_of(camera).bodies, assets)
    sky_known = DEPTH_UNITS_MAX * info.depth_scale_m >= SKY_FROM_M
    known = Channel.Z_DEPTH in info.media[camera] and free.any()
    if not (known and (ground or sky_known)):
        return instances, surfaces
    path = media_path(shard_dir, camera, Channel.Z_DEPTH, sample.index)
    depth_m = read_image(path, Channel.Z_DEPTH, info.depth_scale_m)
    view, far = sample.truth[camera].camera, ~np.isfinite(depth_m)
    if sky_known:
        surfaces[free & far & _shows_sky(view)] = SKY
    if ground:
        places = np.flatnonzero(free & ~far)
        points_m = _ground_points(sample.scene_of(camera), view, depth_m, places)
        surfaces.ravel()[places] = _look_up(ground, view, points_m)
    return instances, surfaces


def _ground_points(
    scene: Scene, view: Camera, depth_m: NDArray[np.float32], places: NDArray[np.intp]
) -> tuple[Array, Array]:
    """World X and Y [m] of the points at some pixels, given by their places in the flat image."""
    rows, columns = np.divmod(places, depth_m.shape[1])
    if view.shutter.rolls or not view.intrinsics.straight:
        p_camera = view.intrinsics.unproject(depth_m)[rows, columns]
        p_world = world_points(scene, view, p_camera, rows)
        return p_world[:, 0], p_world[:, 1]
    # Without a rolling shutter, rays are sums of one term by column and one by row.
    k, R = view.intrinsics, view.T_world_camera.rotation()
    u = (np.arange(k.width_px) + 0.5 - k.cx_px) / k.fx_px
    v = (np.arange(k.height_px) + 0.5 - k.cy_px) / k.fy_px
    z = depth_m.ravel()[places].astype(np.float64)
    x_m, y_m = (
        ((R[axis, 0] * u)[columns] + (R[axis, 1] * v + R[axis, 2])[rows]) * z
        + view.T_world_camera.translation_m[axis]
        for axis in range(2)
    )
    return x_m, y_m


def _shows_sky(view: Camera) -> NDArray[np.bool_]:
    """Pixels that look forwards and above the horizon, [h, w]."""
    up = view.T_world_camera.inverse().rotate(np.array([0.0, 0.0, 1.0]))
    k = view.intrinsics
    if k.straight:
        # Rays are sums of one term by column and one by row, whatever their length.
        u = (np.arange(k.width_px) + 0.5 - k.cx_px) / k.fx_px
        v = (np.arange(k.height_px) + 0.5 - k.cy_px) / k.fy_px
        above: NDArray[np.bool_] = u * up[0] + (v * up[1] + up[2])[:, None] > 0.0
        return above
    rays = k.pixel_rays()
    rises = rays[..., 0] * up[0] + rays[..., 1] * up[1] + rays[..., 2] * up[2]
    shown: NDArray[np.bool_] = (rays[..., 2] > 0.0) & (rises > 0.0)
    return shown


@dataclass(frozen=True, eq=False, slots=True)
class _Piece:
    """Triangles of one surface of one body from above.

    Attributes:
        number: Index of ``SURFACES``.
        corners_m: World X and Y, [n, 3, 2].
    """

    number: int
    corners_m: Array


def _ground_of(bodies: Sequence[Body], assets: AssetLibrary) -> tuple[_Piece, ...]:
    """Pieces of the ground; wide bodies first, as others lie on them."""
    pieces: list[_Piece] = []
    for body in bodies:
        if body.instance_id == 0 and body.motion == "static":
            pieces += _pieces(body, assets)
    return tuple(sorted(pieces, key=_extent_m2, reverse=True))


@lru_cache(maxsize=64)
def _pieces(body: Body, assets: AssetLibrary) -> tuple[_Piece, ...]:
    """Pieces of a body with a ground surface, markings last; empty for most bodies."""
    materials = body.materials or assets.materials(body.asset)
    numbers = [SURFACES.index(m.role) if m.role in SURFACES[1:SKY] else 0 for m in materials]
    if not any(numbers):
        return ()
    mesh = assets.mesh(body.asset)
    vertices = body.T_world_body.apply(mesh.vertices_m.astype(np.float64) * body.scale)
    triangles = vertices[mesh.faces]
    u, v = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    up = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0.0
    of_face = np.array(numbers)[mesh.face_slots]
    marking = SURFACES.index("marking")
    order = sorted(set(numbers) - {0}, key=lambda number: number == marking)
    return tuple(_Piece(k, triangles[up & (of_face == k)][..., :2]) for k in order)


def _extent_m2(piece: _Piece) -> float:
    """Area of the rectangle around a piece, rounded to whole hectares; ties keep their order."""
    if not len(piece.corners_m):
        return 0.0
    size = np.ptp(piece.corners_m.reshape(-1, 2), axis=0)
    return float(round(size[0] * size[1] / 1e4))


def _look_up(ground: tuple[_Piece, ...], view: Camera, points_m: tuple[Array, Array]) -> UInt8:
    """Surfaces below points of world X and Y, [n] each; 0 outside all maps."""
    x, y, _ = view.T_world_camera.translation_m
    found = np.zeros(len(points_m[0]), np.uint8)
    left = np.arange(len(found))
    for cell_m, reach_m, step_m in MAPS:
        middle = (step_m * round(x / step_m), step_m * round(y / step_m))
        count = 2 * round((reach_m + 0.5 * step_m) / cell_m)
        column, row = (
            np.floor((values[left] - middle[axis]) / cell_m + 0.5 * count)
            for axis, values in enumerate(points_m)
        )
        inside = (column >= 0) & (column < count) & (row >= 0) & (row < count)
        if inside.any():
            ground_map = _map_of(ground, middle, cell_m, count)
            rows, columns = row[inside].astype(np.intp), column[inside].astype(np.intp)
            found[left[inside]] = ground_map.look_up(rows, columns)
        left = left[~inside]
    return found


@lru_cache(maxsize=6)
def _map_of(
    ground: tuple[_Piece, ...], middle_m: tuple[float, float], cell_m: float, count: int
) -> "_GroundMap":
    return _GroundMap(_triangles_of(ground), middle_m, cell_m, count)


@dataclass(frozen=True, eq=False, slots=True)
class _Triangles:
    """All triangles of the ground, in the order in which they are drawn.

    Attributes:
        corners_m: World X and Y, [n, 3, 2].
        numbers: Indices of ``SURFACES``, [n].
        low_m: Least X and Y of each, [n, 2].
        high_m: Largest X and Y of each, [n, 2].
    """

    corners_m: Array
    numbers: NDArray[np.intp]
    low_m: Array
    high_m: Array


@lru_cache(maxsize=2)
def _triangles_of(ground: tuple[_Piece, ...]) -> _Triangles:
    corners_m = np.concatenate([piece.corners_m for piece in ground])
    numbers = np.repeat([p.number for p in ground], [len(p.corners_m) for p in ground])
    return _Triangles(corners_m, numbers, corners_m.min(axis=1), corners_m.max(axis=1))


class _GroundMap:
    """Surface of each cell of a square map; rows along Y, columns along X.

    Cameras see a small part of it: blocks of cells are drawn when they are looked up.
    """

    def __init__(
        self, triangles: _Triangles, middle_m: tuple[float, float], cell_m: float, count: int
    ) -> None:
        self._triangles, self._middle_m, self._cell_m = triangles, middle_m, cell_m
        self._blocks = -(-count // _BLOCK)
        self._count, self._offset = count, 0.5 * count
        self._cells = np.zeros((0, 0), np.uint8)
        self._known = np.zeros((self._blocks, self._blocks), np.bool_)

    def look_up(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> UInt8:
        """Surfaces of some cells, [n] each."""
        needed = np.zeros(self._known.size, np.bool_)
        needed[(rows >> _BLOCK_BITS) * self._blocks + (columns >> _BLOCK_BITS)] = True
        missing = needed.reshape(self._known.shape) & ~self._known
        if missing.any():
            drawn = self._draw(missing)
            if self._known.any():
                for row, column in np.argwhere(missing) * _BLOCK:
                    block = np.s_[row : row + _BLOCK, column : column + _BLOCK]
                    self._cells[block] = drawn[block]
            else:
                self._cells = drawn
            self._known |= missing
        found: UInt8 = self._cells.ravel()[rows * self._count + columns]
        return found

    def _draw(self, blocks: NDArray[np.bool_]) -> UInt8:
        """Draw all triangles that may reach some blocks; others are incomplete."""
        drawn = np.zeros((self._count, self._count), np.uint8)
        reached = self._reached(blocks)
        # OpenCV has the centres of pixels at whole numbers.
        cells = (self._triangles.corners_m[reached] - self._middle_m) / self._cell_m
        cells += self._offset - 0.5
        # Corners of large triangles stay far below the limit of 2^31 sixteenths of a cell.
        corners = np.rint(cells * (1 << _SUBPIXEL_BITS)).astype(np.int32)
        numbers = self._triangles.numbers[reached].tolist()
        for points, number in zip(corners, numbers, strict=True):
            cv2.fillConvexPoly(drawn, points, number, cv2.LINE_8, _SUBPIXEL_BITS)
        return drawn

    def _reached(self, blocks: NDArray[np.bool_]) -> NDArray[np.intp]:
        """Numbers of the triangles whose rectangles meet some of the blocks, with a margin."""
        sums = np.zeros((self._blocks + 1, self._blocks + 1), np.intp)
        sums[1:, 1:] = blocks.cumsum(axis=0).cumsum(axis=1)
        size_m = _BLOCK * self._cell_m
        low, high = (
            np.floor((corner_m - self._middle_m) / size_m + self._offset / _BLOCK + margin)
            for corner_m, margin in (
                (self._triangles.low_m, -_MARGIN / _BLOCK),
                (self._triangles.high_m, 1.0 + _MARGIN / _BLOCK),
            )
        )
        x0, y0 = np.clip(low, 0, self._blocks).astype(np.intp).T
        x1, y1 = np.clip(high, 0, self._blocks).astype(np.intp).T
        met = sums[y1, x1] - sums[y0, x1] - sums[y1, x0] + sums[y0, x0]
        return np.flatnonzero(met > 0)
