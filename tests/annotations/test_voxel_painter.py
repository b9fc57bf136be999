"""Voxels of points and lines, against loops over single points in 64-bit numbers."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.annotations.voxel_box import VoxelBox
from gen_data.annotations.voxel_painter import BLOCK, BUFFER, PointBlocks, VoxelPainter
from gen_data.annotations.voxel_views import seen_by_camera, seen_by_scanner
from gen_data.core.capture import POINT, Channel, PointCloud, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Camera, Lidar, Scene
from gen_data.core.se3 import SE3, Array

Voxel = tuple[int, int, int]
SHAPE: Voxel = (20, 16, 12)
BOX = VoxelBox(SE3.about_z(0.3, (4.0, -2.0, 1.0)), (-4.0, -3.0, -2.0), 0.4, SHAPE)
POSE = SE3((1.0, 0.5, -0.2), (0.8, 0.36, -0.48, 0.0))
SCALE = 1.25


def body_points(places: Array) -> Array:
    """Points of a body that are at places of the box, in voxels from its lowest corner."""
    return POSE.inverse().apply(places * BOX.voxel_m + BOX.low_m) / SCALE


def clear_places(rng: np.random.Generator, low: Voxel, high: Voxel, count: int) -> Array:
    """Places in voxels between two of them, a tenth of a voxel or more from all faces."""
    return np.asarray(rng.integers(low, high, (count, 3)) + rng.uniform(0.1, 0.9, (count, 3)))


@pytest.mark.parametrize("count", [0, 1, BLOCK, BLOCK + 1, 2 * BUFFER + 77])
@pytest.mark.parametrize("slots", [1, 5])
def test_the_last_point_in_a_voxel_decides_and_none_in_the_box_is_missed(
    count: int, slots: int
) -> None:
    """Most blocks are outside the box, many reach across its faces."""
    rng = np.random.default_rng(count)
    places = clear_places(rng, (-60, -3, -3), (60, 19, 15), count)
    places = places[np.argsort(np.floor(places[:, 0]), kind="stable")]
    slot = rng.integers(0, slots, count)
    inks = np.arange(100, 100 + slots, dtype=np.uint32)

    expected = np.zeros(SHAPE, np.uint32)
    for (x, y, z), number in zip(np.floor(places).astype(int), slot, strict=True):
        if 0 <= x < SHAPE[0] and 0 <= y < SHAPE[1] and 0 <= z < SHAPE[2]:
            expected[x, y, z] = inks[number]
    painter = VoxelPainter(BOX)
    points = PointBlocks.of(body_points(places), slot, 0.2)
    painter.paint(points, BOX.map_from(POSE, SCALE), inks)
    painter.flush()
    assert (painter.values == expected).all()


@pytest.mark.parametrize("voxel", [(0, 0, 0), (19, 15, 11), (0, 15, 0)])
def test_blocks_that_just_reach_into_the_box_are_kept(voxel: Voxel) -> None:
    """All points are within a tenth of a voxel from the corner of the box, so are all blocks."""
    rng = np.random.default_rng(4)
    outwards = np.where(np.array(voxel) > 0, 0.95, 0.05)
    places = np.array(voxel) + outwards + rng.uniform(-0.03, 0.03, (3 * BLOCK, 3))
    painter = VoxelPainter(BOX)
    points = PointBlocks.of(body_points(places), None, 0.2)
    painter.paint(points, BOX.map_from(POSE, SCALE), np.ones(1, np.uint32))
    painter.flush()
    assert np.argwhere(painter.values).tolist() == [list(voxel)]


def test_only_points_that_are_to_be_marked_are_marked() -> None:
    rng = np.random.default_rng(1)
    painter = VoxelPainter(BOX)
    places = clear_places(rng, (0, 0, 0), SHAPE, 60)
    for part, marking in ((places[:20], False), (places[20:40], True), (places[40:], False)):
        painter.flush()
        painter.marking = marking
        points = PointBlocks.of(body_points(part), np.zeros(20, np.int16), 0.2)
        painter.paint(points, BOX.map_from(POSE, SCALE), np.ones(1, np.uint32))
    painter.flush()

    marked = {tuple(voxel) for voxel in np.argwhere(painter.marks).tolist()}
    assert marked == {tuple(voxel) for voxel in np.floor(places[20:40]).astype(int).tolist()}
    assert (painter.values > 0).sum() == len(np.unique(np.floor(places), axis=0))


def chords(start: Array, end: Array) -> Array:
    """Length of a line in each voxel of the box, in voxels, float64 ``SHAPE``."""
    along = end - start
    with np.errstate(divide="ignore"):
        crossings = [
            (np.arange(count + 1) - start[axis]) / along[axis] for axis, count in enumerate(SHAPE)
        ]
    shares = np.unique(np.clip(np.concatenate([*crossings, [0.0, 1.0]]), 0.0, 1.0))
    middle = np.floor(start + 0.5 * (shares[1:] + shares[:-1])[:, None] * along).astype(int)
    inside = ((middle >= 0) & (middle < SHAPE)).all(axis=1)
    length = np.zeros(SHAPE)
    np.add.at(length, tuple(middle[inside].T), (np.diff(shares) * np.linalg.norm(along))[inside])
    return length


def test_a_scanner_observes_the_voxels_that_lines_pass_for_half_a_voxel() -> None:
    """Lines one by one; all together observe the union. The scanner is outside the box."""
    rng = np.random.default_rng(2)
    pose = BOX.T_world_frame @ SE3((-6.0, 0.3, 0.4), SE3.about_z(0.5).quaternion_wxyz)
    ends = rng.uniform((-4, -4, -3), (5, 4, 3), (60, 3))
    points = np.zeros(len(ends), POINT)
    points["position_m"] = (pose.inverse() @ BOX.T_world_frame).apply(ends)
    lidar = Lidar("top", "", T_world_lidar=pose)

    def observed(rows: NDArray[np.void]) -> NDArray[np.bool_]:
        return seen_by_scanner(BOX, Scene("lines"), PointCloud("top", lidar, rows))

    alone = [observed(points[k : k + 1]) for k in range(len(ends))]
    origin = (np.array([-6.0, 0.3, 0.4]) - BOX.low_m) / BOX.voxel_m
    places = (ends - BOX.low_m) / BOX.voxel_m
    inside = np.asarray(((places >= 0) & (places < SHAPE)).all(axis=1))
    for seen, place, ends_inside in zip(alone, places, inside.tolist(), strict=True):
        passed = chords(origin, place)
        if ends_inside:
            voxel = tuple(np.floor(place).astype(int))
            assert seen[voxel]
            passed[voxel] = 1.0
        assert seen[passed > 0.55].all()
        assert not seen[passed < 1e-3].any()
    assert inside.sum() > 15
    assert np.logical_or.reduce(alone).sum() > 500
    assert (observed(points) == np.logical_or.reduce(alone)).all()


@pytest.mark.parametrize("width", [40, 640])
def test_a_camera_observes_the_air_before_a_wall_and_the_wall(width: int) -> None:
    """The wall is 3.1 m ahead, before the middle of its voxels. Large images take batches."""
    half_px, ahead_m = 0.5 * width, 3.1
    lens = Intrinsics(width, width * 3 // 4, half_px, half_px, half_px, 0.75 * half_px)
    # It looks along X of the box.
    pose = BOX.T_world_frame @ SE3((-5.0, 0.1, 0.2), (0.5, -0.5, 0.5, -0.5))
    camera = Camera("front", pose, lens)
    range_m = (ahead_m / lens.pixel_rays()[..., 2]).astype(np.float32)
    reading = SensorReading("front", camera, {Channel.RANGE: range_m})
    seen = seen_by_camera(BOX, Scene("wall"), reading)

    voxels = np.indices(SHAPE).reshape(3, -1).T
    center_m = (voxels + 0.5) * BOX.voxel_m + BOX.low_m - (-5.0, 0.1, 0.2)
    depth, left, up = center_m.T
    inside = (np.abs(left / depth) < 0.99) & (np.abs(up / depth) < 0.74)
    outside = (np.abs(left / depth) > 1.01) | (np.abs(up / depth) > 0.76)
    half = 0.5 * math.sqrt(3.0) * BOX.voxel_m
    flat = seen.reshape(-1)

    assert (inside & (depth < ahead_m)).sum() > 50
    assert flat[inside & (depth < ahead_m - 0.1)].all()
    assert not flat[depth > ahead_m + half].any()
    assert not flat[outside & (depth < ahead_m - half)].any()
    wall = inside & (depth > ahead_m) & (depth < ahead_m + 0.4 * BOX.voxel_m)
    assert wall.sum() > 50
    assert flat[wall].all()
