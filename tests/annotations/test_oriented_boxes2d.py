"""Boxes along headings, held against OpenCV's and the projection of 3D boxes."""

import itertools
import math
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.annotations.annotate import Thresholds, annotate_objects
from gen_data.annotations.oriented_boxes2d import OrientedBoxes2d, mask_corners
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import ObjectTruth
from gen_data.core.scene import Camera, Instance, Scene
from gen_data.core.se3 import SE3, Array, look_at

LENS = Intrinsics.from_hfov(640, 480, math.radians(60.0))
TARGET = (0.0, 0.0, 0.5)
LENGTH_M, WIDTH_M, HEIGHT_M = 4.4, 1.8, 1.5


def car(yaw_rad: float) -> Instance:
    low, high = (-LENGTH_M / 2, -WIDTH_M / 2, 0.0), (LENGTH_M / 2, WIDTH_M / 2, HEIGHT_M)
    pose = SE3.about_z(yaw_rad)
    return Instance(1, "car", "car", 1, "car", T_world_instance=pose, box_min_m=low, box_max_m=high)


def drawn(eye: tuple[float, float, float], yaw_rad: float) -> Any:
    """Instance ids of an image that looks at the car, drawn as the hull of its box."""
    thing = car(yaw_rad)
    T_camera_car = look_at(eye, TARGET).inverse() @ thing.T_world_instance
    low, high = thing.box_min_m, thing.box_max_m
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    uv = LENS.project(T_camera_car.apply(corners))
    ids = np.zeros((480, 640), np.uint16)
    cv2.fillConvexPoly(ids, cv2.convexHull(np.round(uv).astype(np.int32)), 1)
    return ids


def seen(eye: tuple[float, float, float], yaw_rad: float) -> tuple[ObjectTruth, Array]:
    """Truth of the car, and the corners of its box's floor in the image.

    Corners are front left, front right, rear right, rear left.
    """
    thing, camera = car(yaw_rad), Camera("drone", look_at(eye, TARGET), LENS)
    reading = SensorReading("drone", camera, {Channel.INSTANCE: drawn(eye, yaw_rad)})
    scene = Scene("air", instances=(thing,), cameras=(camera,))
    (truth,) = annotate_objects(scene, reading, [OrientedBoxes2d()], Thresholds()).objects
    x, y = LENGTH_M / 2, WIDTH_M / 2
    floor = np.array([(x, y, 0.0), (x, -y, 0.0), (-x, -y, 0.0), (-x, y, 0.0)])
    T_camera_car = camera.T_world_camera.inverse() @ thing.T_world_instance
    return truth, LENS.project(T_camera_car.apply(floor))


def pixel_corners(eye: tuple[float, float, float], yaw_deg: float) -> Array:
    """Corners of the car's pixels, [n, 2]."""
    rows, columns = np.nonzero(drawn(eye, math.radians(yaw_deg)))
    return np.concatenate([np.stack([columns + a, rows + b], 1) for a in (0, 1) for b in (0, 1)])


def rectangle(truth: ObjectTruth) -> Array:
    assert truth.oriented_box is not None
    return np.array(truth.oriented_box)


@pytest.mark.parametrize("yaw_deg", range(-170, 190, 40))
@pytest.mark.parametrize("eye", [(0.0, 0.01, 60.0), (20.0, 15.0, 50.0)])
def test_it_goes_clockwise_from_the_front_left(
    eye: tuple[float, float, float], yaw_deg: float
) -> None:
    """Each corner is nearest to that corner of the projected box."""
    truth, floor = seen(eye, math.radians(yaw_deg))
    corners = rectangle(truth)

    apart = np.sqrt(((corners[:, None] - floor[None]) ** 2).sum(-1))
    assert apart.argmin(axis=1).tolist() == [0, 1, 2, 3]
    area = cv2.contourArea(corners.astype(np.float32), oriented=True)
    assert area > 0.0  # clockwise, as Y points down
    sides = np.roll(corners, -1, axis=0) - corners
    assert np.allclose((sides * np.roll(sides, -1, axis=0)).sum(1), 0.0, atol=0.5)


@pytest.mark.parametrize("yaw_deg", [0, 30, 77, 120])
def test_straight_from_above_it_is_the_smallest_rectangle(yaw_deg: float) -> None:
    """OpenCV's around all corners of all pixels, within a pixel on each side."""
    eye = (0.0, 0.01, 60.0)
    truth, _ = seen(eye, math.radians(yaw_deg))
    sides = np.sqrt(((rectangle(truth)[1:3] - rectangle(truth)[:2]) ** 2).sum(1))
    smallest = cv2.minAreaRect(pixel_corners(eye, yaw_deg).astype(np.float32))[1]

    assert np.allclose(np.sort(sides), np.sort(smallest), atol=1.0)


@pytest.mark.parametrize("yaw_deg", range(0, 360, 25))
def test_it_is_tight_around_the_pixels(yaw_deg: float) -> None:
    """No corner of a pixel outside, and one on each side."""
    eye = (25.0, -30.0, 40.0)
    truth, _ = seen(eye, math.radians(yaw_deg))
    corners = rectangle(truth)
    pixels = pixel_corners(eye, yaw_deg)
    for k in range(4):
        side = corners[(k + 1) % 4] - corners[k]
        inward = np.array([-side[1], side[0]]) / np.sqrt(side @ side)
        depth_px = (pixels - corners[k]) @ inward
        assert abs(depth_px.min()) < 0.01


def test_the_hull_of_a_mask_is_that_of_its_rows_ends() -> None:
    """OpenCV's hull of all corners of all pixels."""
    mask = np.random.default_rng(3).random((17, 23)) < 0.05
    rows, columns = np.nonzero(mask)
    every = np.concatenate([np.stack([columns + a, rows + b], 1) for a in (0, 1) for b in (0, 1)])

    def hull(points: Any) -> set[tuple[int, int]]:
        return {tuple(p) for p in cv2.convexHull(points.astype(np.int32))[:, 0].tolist()}

    assert hull(mask_corners(mask)) == hull(every)


def test_a_thing_seen_from_the_front_has_an_upright_box() -> None:
    """Its heading points at the camera: the Y axis decides, and the front is below."""
    truth, _ = seen((40.0, 0.0, 0.75), 0.0)
    corners = rectangle(truth)

    assert np.allclose(corners[0] - corners[1], [corners[0][0] - corners[1][0], 0.0], atol=0.5)
    assert truth.box is not None
    low, high = corners.min(0), corners.max(0)
    assert np.allclose(
        [*low, *high],
        [truth.box.x_min, truth.box.y_min, truth.box.x_max, truth.box.y_max],
        atol=0.5,
    )


def test_a_hidden_thing_has_none() -> None:
    truth, _ = seen((0.0, 0.01, 60.0), 0.0)
    hidden = ObjectTruth(truth.instance, 0, None)
    camera = Camera("drone", look_at((0.0, 0.01, 60.0), (0.0, 0.0, 0.0)), LENS)
    reading = SensorReading("drone", camera, {Channel.INSTANCE: np.zeros((480, 640), np.uint16)})

    assert OrientedBoxes2d().annotate(Scene("air"), reading, hidden).oriented_box is None
