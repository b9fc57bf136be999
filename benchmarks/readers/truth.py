"""What the data set itself states, read by ``gen_data.open``: expected values for readers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import gen_data
from benchmarks.readers.views import Thing, View, cube, thing
from gen_data.api.sample import CameraReading
from gen_data.core.sample import MaskPx
from gen_data.core.scene import Instance
from gen_data.core.se3 import SE3
from gen_data.exporters import motchallenge


def image_name(index: int, sensor: str) -> str:
    """Name of a view."""
    return f"{index:09d}_{sensor}"


def readings(folder: Path, cameras: tuple[str, ...] = ()) -> Iterator[tuple[str, CameraReading]]:
    """Images of the cameras by name; of all without names."""
    for sample in gen_data.open(folder):
        for name, reading in sample.cameras.items():
            if name in cameras or not cameras:
                yield image_name(sample.index, name), reading


def lens(reading: CameraReading) -> tuple[float, ...]:
    """The camera's lens, as in ``View``."""
    inner = reading.truth.camera.intrinsics
    return (inner.fx_px, inner.fy_px, inner.cx_px, inner.cy_px, *inner.lens.coefficients)


def own_category(instance: Instance) -> str:
    """Category in the data set."""
    return instance.category


def mot_category(instance: Instance) -> str:
    """Class of MOTChallenge, with its name in the paper on MOT16 (arXiv:1603.00831)."""
    names = {1: "pedestrian", 2: "person on vehicle", 3: "car", 4: "bicycle", 5: "motorbike"}
    number = motchallenge.CLASSES.get(instance.category, 0)
    if number in motchallenge.RIDDEN and dict(instance.attributes).get("rider"):
        number = motchallenge.PERSON_ON_VEHICLE
    return names.get(number, "")


@dataclass(frozen=True)
class Boxes:
    """Boxes around visible pixels, masks and lenses.

    Attributes:
        cameras: Names; all without them.
        shift: What the reader adds to left, top, right and bottom by its convention.
        name_of: Class of an instance in the format; empty = left out.
        along_heading: Boxes around the corners of the oriented ones instead, without masks.
    """

    cameras: tuple[str, ...] = ()
    shift: tuple[float, float, float, float] = (0, 0, 0, 0)
    name_of: Callable[[Instance], str] = own_category
    along_heading: bool = False

    def __call__(self, folder: Path) -> Iterator[View]:
        """All images."""
        for name, reading in readings(folder, self.cameras):
            shape, listed = reading.channels["rgb"].shape[:2], []
            for item in reading.objects:
                category = self.name_of(item.instance)
                if item.instance.annotated and item.box is not None and category:
                    corners = (item.box.x_min, item.box.y_min, item.box.x_max, item.box.y_max)
                    mask = None if item.mask is None else whole_mask(item.mask, shape)
                    if self.along_heading:
                        points, mask = np.array(item.oriented_box), None
                        corners = (*points.min(0), *points.max(0))
                    listed.append(thing(category, np.add(corners, self.shift), mask))
            yield View(name, tuple(listed), lens(reading))


def whole_mask(mask: MaskPx, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """A mask in its image of this height and width."""
    whole = np.zeros(shape, bool)
    height, width = mask.pixels.shape
    whole[mask.y_px : mask.y_px + height, mask.x_px : mask.x_px + width] = mask.pixels
    return whole


@dataclass(frozen=True)
class Cubes:
    """Boxes in space of all annotated objects in the frames of cameras, and their lenses.

    Attributes:
        cameras: Names; without them one view per instant, in the frame of the world.
        name_of: Class of an instance in the format.
    """

    cameras: tuple[str, ...] = ()
    name_of: Callable[[Instance], str] = own_category

    def __call__(self, folder: Path) -> Iterator[View]:
        """All images of the cameras."""
        for sample in gen_data.open(folder):
            things = [one for one in sample.scene.instances if one.annotated]
            frames: dict[str, tuple[SE3, tuple[float, ...] | None]] = {
                name: (reading.truth.camera.T_world_camera.inverse(), lens(reading))
                for name, reading in sample.cameras.items()
                if name in self.cameras
            }
            for name, (T_frame_world, inner) in (frames or {"world": (SE3(), None)}).items():
                boxes = ((self.name_of(one), one.box3d.seen_from(T_frame_world)) for one in things)
                listed = (cube(category, b.T_frame_box, b.size_m) for category, b in boxes)
                yield View(image_name(sample.index, name), tuple(listed), inner)


def scans(folder: Path) -> Iterator[View]:
    """Points of every scan, in the scanner's frame [m]."""
    for sample in gen_data.open(folder):
        for name, cloud in sample.lidars.items():
            points = Thing("points", cloud.points["position_m"].astype(float).ravel())
            yield View(image_name(sample.index, name), (points,))


def scans_and_lenses(folder: Path) -> Iterator[View]:
    """Points of every scan, and the lens of every camera."""
    return chain(scans(folder), Poses(posed=False)(folder))


@dataclass(frozen=True)
class Poses:
    """Lenses of cameras, and their poses in the world as 3 x 4 matrices.

    Attributes:
        cameras: Names; all without them.
        posed: Whether the format has poses.
    """

    cameras: tuple[str, ...] = ()
    posed: bool = True

    def __call__(self, folder: Path) -> Iterator[View]:
        """All images."""
        for name, reading in readings(folder, self.cameras):
            pose = (thing("pose", reading.T_world_camera[:3]),)
            yield View(name, pose if self.posed else (), lens(reading))
