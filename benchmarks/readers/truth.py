"""Content of the data set, read by ``gen_data.open``: expected values for readers."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

import gen_data
from benchmarks.readers.views import Thing, View, cube, of_pixels, thing
from gen_data.api.sample import CameraReading
from gen_data.core.sample import TRACK_STATES, MaskPx, Predicate, SensorTracks
from gen_data.core.scene import Instance, Scene
from gen_data.core.se3 import SE3
from gen_data.exporters import argoverse2, motchallenge
from gen_data.exporters.nuscenes_classes import category_of

DEPTH_UNIT_M = 0.0001
"""Of 16-bit depth images, the default of ``DatasetInfo``."""


def image_name(index: int, sensor: str) -> str:
    """Name of a view."""
    return f"{index:09d}_{sensor}"


def readings(
    folder: Path, cameras: tuple[str, ...] = ()
) -> Iterator[tuple[str, CameraReading, Scene]]:
    """Images of the cameras by name, and the world; of all without names."""
    for sample in gen_data.open(folder):
        for name, reading in sample.cameras.items():
            if name in cameras or not cameras:
                yield image_name(sample.index, name), reading, sample.scene


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
        shift: Offsets that the reader adds to left, top, right and bottom by its convention.
        name_of: Class of an instance in the format; empty = left out.
        along_heading: Boxes around the corners of the oriented ones instead, without masks.
    """

    cameras: tuple[str, ...] = ()
    shift: tuple[float, float, float, float] = (0, 0, 0, 0)
    name_of: Callable[[Instance], str] = own_category
    along_heading: bool = False

    def __call__(self, folder: Path) -> Iterator[View]:
        """All images."""
        for name, reading, _ in readings(folder, self.cameras):
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
        upright: The smallest boxes that turn about the camera's y axis only instead.
    """

    cameras: tuple[str, ...] = ()
    name_of: Callable[[Instance], str] = own_category
    upright: bool = False

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
                listed = [cube(category, b.T_frame_box, b.size_m) for category, b in boxes]
                if self.upright:
                    listed = list(map(upright_around, listed))
                yield View(image_name(sample.index, name), tuple(listed), inner)


def city_cubes(folder: Path) -> Iterator[View]:
    """Boxes in the world with the classes of Argoverse 2, and the lenses of all cameras."""
    classes = Cubes((), lambda one: argoverse2.CLASSES.get(category_of(one), ""))
    return chain(classes(folder), Images()(folder))


def upright_around(box: Thing) -> Thing:
    """The smallest box around one in space that shares its centre and heading; y points down."""
    centre, *axes = box.numbers.reshape(4, 3)
    forward = axes[0] * (1, 0, 1) / np.hypot(*axes[0][[0, 2]])
    up = np.array([0.0, -1.0, 0.0])
    # A box reaches as far along a direction as its half axes do together.
    sides = [d * np.abs(np.array(axes) @ d).sum() for d in (forward, np.cross(up, forward), up)]
    return thing(box.category, np.vstack([centre, *sides]))


def scans(folder: Path) -> Iterator[View]:
    """Points of every scan, in the scanner's frame [m]."""
    for sample in gen_data.open(folder):
        for name, cloud in sample.lidars.items():
            points = Thing("points", cloud.points["position_m"].astype(float).ravel())
            yield View(image_name(sample.index, name), (points,))


def scanned_instances(folder: Path) -> Iterator[View]:
    """Points of every instance with a class of SemanticKITTI in the scans."""
    for sample in gen_data.open(folder):
        for name, cloud in sample.lidars.items():
            ids, points = cloud.points["instance_id"], cloud.points["position_m"]
            known = [(one, scan_class(one)) for one in sample.scene.instances]
            things = (
                thing(f"{label} {one.instance_id}", points[ids == one.instance_id])
                for one, label in known
                if label and (ids == one.instance_id).any()
            )
            yield View(image_name(sample.index, name), tuple(things))


def scan_class(instance: Instance) -> str:
    """Class of SemanticKITTI that its benchmark judges; empty for objects that do not count."""
    rider = instance.category in SCAN_RIDERS and dict(instance.attributes).get("rider") == "yes"
    return (SCAN_RIDERS if rider else SCAN_CLASSES).get(instance.category, "")


SCAN_RIDERS = {"bicycle": "bicyclist", "motorcycle": "motorcyclist"}
SCAN_CLASSES = {
    **dict.fromkeys(("car", "van"), "car"), **dict.fromkeys(("bus", "tram"), "other-vehicle"),
    **dict.fromkeys(("pedestrian", "person"), "person"),
    **{name: name for name in ("bicycle", "motorcycle", "truck")}, "cyclist": "bicyclist",
    "motorcyclist": "motorcyclist",
}  # fmt: skip


def measurements(folder: Path) -> Iterator[View]:
    """Columns of every device; 0 where there is no number."""
    for sample in gen_data.open(folder):
        for name, rows in sample.measurements.items():
            things = (thing(key, np.nan_to_num(rows[key])) for key in rows.dtype.names or ())
            yield View(image_name(sample.index, name), tuple(things))


def birdseye(folder: Path) -> Iterator[View]:
    """Boxes in the world, and layers of the map around the ego."""
    for view, sample in zip(Cubes()(folder), gen_data.open(folder), strict=True):
        frame = sample.core.frame
        assert frame is not None
        assert frame.birdseye is not None
        layers = (thing(name, (), mask) for name, mask in frame.birdseye.layers.items())
        yield View(view.name, (*view.things, *layers))


def voxels(folder: Path) -> Iterator[View]:
    """States, and voxels of each instance and of each sensor, in the grid around the ego."""
    for sample in gen_data.open(folder):
        assert sample.core.frame is not None
        grid = sample.core.frame.occupancy
        assert grid is not None
        masks = {f"state {k}": grid.state == k for k in range(3)}
        masks |= {f"instance {k}": grid.instance_id == k for k in np.unique(grid.instance_id)}
        masks |= {f"observed by {name}": mask for name, mask in grid.observed.items()}
        things = (thing(name, grid.low_m, mask) for name, mask in masks.items())
        yield View(image_name(sample.index, "world"), tuple(things))


def tracks(folder: Path) -> Iterator[View]:
    """Places of tracked points in the frames of cameras, whether they are seen, and lenses.

    All samples are one sequence. Points that a camera never sees in it are left out.
    """
    steps: dict[str, dict[int, SensorTracks]] = defaultdict(dict)
    lenses = {}
    for sample in gen_data.open(folder):
        assert sample.core.frame is not None
        assert sample.core.frame.tracks is not None
        for name, reading in sample.cameras.items():
            steps[name][sample.index] = sample.core.frame.tracks.sensors[name]
            lenses[name] = lens(reading)
    for name, seen in steps.items():
        visible = {k: t.state <= TRACK_STATES.index("glass") for k, t in seen.items()}
        kept = np.any(list(visible.values()), axis=0)
        for index, found in seen.items():
            points = thing("points", found.position_m[kept].ravel(), visible[index][kept][None])
            yield View(image_name(index, name), (points,), lenses[name])


def grasps(folder: Path) -> Iterator[View]:
    """Score, width between open fingers, rotation and place of the grasps of each object seen."""
    for sample in gen_data.open(folder):
        assert sample.core.frame is not None
        for name in ("color",):
            reading, rows = sample.cameras[name], defaultdict(list)
            seen = {box.instance_id for box in reading.boxes2d}
            T_camera_world = np.linalg.inv(reading.T_world_camera)
            for grasp in sample.core.frame.grasps or ():
                pose = T_camera_world @ grasp.T_world_grasp.matrix()
                # The exporter's clearance on both sides.
                size = (grasp.score, grasp.width_m + 2 * 0.003)
                rows[grasp.instance_id].append((*size, *pose[:3, :3].ravel(), *pose[:3, 3]))
            things = (thing(str(k), np.array(row)) for k, row in rows.items() if k in seen)
            yield View(image_name(sample.index, name), tuple(things))


def joints(folder: Path) -> Iterator[View]:
    """Positions of an arm's joints [rad, m], and photographs."""
    for sample in gen_data.open(folder):
        (arm,) = sample.scene.articulations
        yield View(image_name(sample.index, "arm"), (thing("state", arm.joint_positions),))
    yield from Images((), {"rgb": lambda reading: reading.rgb})(folder)


def step_geometry(folder: Path) -> Iterator[View]:
    """Surroundings of an arm: poses, contacts, relations, depths, instances and cameras."""
    for sample in gen_data.open(folder):
        (arm,) = sample.scene.articulations
        things = [
            thing(f"pose {i.instance_id}", (*at.translation_m, *at.quaternion_wxyz))
            for i in sample.scene.instances
            if i.annotated and (at := i.T_world_instance)
        ]
        assert sample.core.frame is not None
        edges = [
            (r.subject, get_args(Predicate).index(r.predicate), r.object)
            for r in sample.core.frame.relations or ()
        ]
        at_s = min(sample.scene.time_s, arm.episode.phases[-1].end_s - 1e-3) if arm.episode else 0
        touching = [
            (force_n, *point_m)
            for span in (arm.episode.contacts if arm.episode else ())
            if span.start_s - 1e-6 <= at_s < span.end_s - 1e-6
            for force_n, point_m in (span.at(at_s),)
        ]
        things += [thing("relations", np.ravel(edges)), thing("contacts", np.ravel(touching))]
        yield View(image_name(sample.index, "world"), tuple(things))
    stated = {
        "depth": lambda r: np.where(np.isfinite(r.depth_m), r.depth_m / DEPTH_UNIT_M, 0).round(),
        "ids": lambda r: r.instance_ids.astype(float),
        "pose": pose,
    }
    yield from Images((), stated)(folder)


def scans_and_lenses(folder: Path) -> Iterator[View]:
    """Points of every scan, and the lens of every camera."""
    return chain(scans(folder), Images()(folder))


@dataclass(frozen=True)
class Images:
    """Numbers of images, and their lenses.

    Attributes:
        cameras: Names; all without them.
        numbers: Numbers of a reading by name.
        name_of: Name of an instance, each of which is a mask; empty = left out. None = no masks.
    """

    cameras: tuple[str, ...] = ()
    numbers: Mapping[str, Callable[[CameraReading], NDArray[Any]]] = field(default_factory=dict)
    name_of: Callable[[Instance], str] | None = None

    def __call__(self, folder: Path) -> Iterator[View]:
        """All images."""
        for name, reading, scene in readings(folder, self.cameras):
            things = [thing(key, values(reading)) for key, values in self.numbers.items()]
            for instance in scene.instances if self.name_of else ():
                mask = reading.instance_ids == instance.instance_id
                category = self.name_of(instance) if self.name_of else ""
                if category and mask.any():
                    things.append(of_pixels(category, mask))
            yield View(name, tuple(things), lens(reading))


def pose(reading: CameraReading) -> NDArray[np.float64]:
    """Of the camera in the world, 3 x 4."""
    return reading.T_world_camera[:3]


POSES = Images((), {"pose": pose})


def millimetres(reading: CameraReading) -> NDArray[np.float64]:
    """Depth; 0 where there is none."""
    return np.where(np.isfinite(reading.depth_m), 1000.0 * reading.depth_m, 0.0)


def grey_depth(reading: CameraReading) -> NDArray[np.float64]:
    """Inverse depth between 0.3 m, 255, and 3 m, 0."""
    share = (1 / reading.depth_m.astype(float) - 1 / 3) / (1 / 0.3 - 1 / 3)
    return 255.0 * np.clip(share, 0.0, 1.0)
