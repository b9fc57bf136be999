"""KITTI object detection: images, calibration, labels and laser scans, one frame per sample.

::

    training/image_2/000012.png     RGB                    training/label_2/000012.txt
    training/depth_2/000012.png     z-depth, 1/256 m       training/calib/000012.txt
    training/velodyne/000012.bin    float32 x y z reflectance
    training/velodyne_labels/000012.label   uint32 category | row in label_2 << 16, from 1
    ImageSets/{train,val,test}.txt  frame names            README.txt

Where KITTI's conventions differ from ours (https://www.cvlibs.net/datasets/kitti, object devkit):

* **Pixel centres** are whole numbers: the principal point of ``P2`` is ours minus 0.5, and image
  boxes hold the first and the *last* pixel.
* **Boxes turn about the camera's y axis only.** A label is the smallest such box, with the heading
  of the object's x axis, that encloses the object's own oriented box; both are equal when the
  object stands upright before a level camera. Exact poses are in the COCO export.
* **Image boxes** bound the projection of the 3D box, as KITTI's own do (frame 000001's car, 1.67 m
  wide at 46.7 m, is labelled 27 pixels wide: 721 x 1.67 / 44.9); ``boxes: tight`` writes the tight
  box of the visible pixels, which COCO has. With ``labels.box3d: annotated`` people have the
  box of their silhouette and the margin instead: KITTI's are narrower than .38 of their height in
  the median, which is less than any projection of 3D boxes of .67 x .9 m.
* **Distant objects** are not labelled, as KITTI's annotators worked on laser scans. They become
  ``DontCare`` regions; so do objects without laser points, in rain or behind others.
* **Depth** has 256 units per metre, as KITTI's depth benchmark; images of data sets with another
  ``depth_scale_m`` are converted.
* **Truncation** is the fraction of that projection outside the image; for tight boxes, of the
  silhouette. KITTI computed its own "via backprojecting a car/pedestrian model into the image
  plane" (readme of its object devkit).
* **Occlusion** is a judgement of KITTI's annotators (the same readme), who had no numbers: 0 fully
  visible, 1 partly, 2 largely occluded, 3 unknown. Here it follows from the hidden share of the
  silhouette inside the image, with limits defined here; nothing is unknown, and 3 is not used.
  COCO's key ``occlusion`` has the share itself.
* **Points** come from the data set's laser scanner, or of its ``pseudo_lidar``; without either
  there is no velodyne folder, which some readers require. They are turned about the scanner's z
  where its x axis does not point along the camera's optical axis (``gen_data.exporters.velodyne``).
* **Point labels** are an extension. They follow KITTI's rule that an object is the content of its
  box: a point of an object has no row if noise, or the object's motion between the pulse and the
  instant of its box, moved it more than 3 cm out of the box; every point as deep inside has the
  row, even of the road between the wheels, where the box of a car on a cambered street reaches
  below the surface. The lower half is the category that reflected the pulse.
* **Location** is the centre of the box's bottom face (largest y) in the rectified camera frame,
  which is the camera frame itself: ``R0_rect`` is the identity and ``P0 = P1 = P2 = P3``.

Readers index ``calib`` by line number and need all printed digits of a rotation.
"""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.core import capture, intrinsics, scene, scene_time, se3
from gen_data.core.boxes import BoxPx
from gen_data.core.interfaces import DatasetInfo, media_path
from gen_data.core.sample import ImageTruth, ObjectTruth, Sample
from gen_data.exporters import (
    base,
    image_files,
    point_cloud_io,
    rgbd_sequences,
    sensor_selection,
    velodyne,
)
from gen_data.exporters.conventions import PINHOLE, Conventions
from gen_data.exporters.kitti_boxes import UprightBox, members_in_box, upright_box
from gen_data.exporters.sequences import check_frame_names, write_bytes, write_text

OFFICIAL_TYPES = {
    "car": "Car",
    "van": "Van",
    "truck": "Truck",
    "pedestrian": "Pedestrian",
    "person": "Pedestrian",
    "person_sitting": "Person_sitting",
    "cyclist": "Cyclist",
    "tram": "Tram",
}
"""KITTI's types by category. All other categories are ``Misc``, including buses, motorcycles and
bicycles without riders, for which KITTI has no type."""

PEOPLE = frozenset({"Pedestrian", "Person_sitting"})
"""Types of people without a vehicle."""

SITTING = frozenset({"sit", "sitting"})
"""Values of the attribute ``pose`` that turn a person into ``Person_sitting``."""

SPLITS = ("train", "val", "test")

DONT_CARE = "DontCare"

T_CAMERA_FORWARD = np.array([[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0]])
"""Calibration without a scanner, [3, 4]: scanner axes (X forward, Y left, Z up) at the camera."""

DEPTH_UNITS_PER_M = 256
"""Of KITTI's depth images (readme of its depth benchmark); OpenPCDet reads ``depth_2`` by it."""

NEAR_M = 0.05
"""Boxes with a corner nearer than this depth are not projected."""

PARTLY_OCCLUDED = 0.1
"""Hidden fraction of the silhouette above which ``occluded`` is 1; assumed, see below."""
LARGELY_OCCLUDED = 0.5
"""Hidden fraction of the silhouette above which ``occluded`` is 2; assumed.

KITTI publishes no limit. Annotators overlook a tenth, and "largely" is taken as more than half;
limits of 0.05 to 0.2 and of 0.4 to 0.6 would be as plausible.
"""


class KittiLabels(base.ExporterBase):
    """Contents of KITTI's label rows, and which objects have one."""

    annotators: ClassVar[frozenset[str]] = frozenset({"boxes3d", "visibility"})
    types: Literal["official", "category"] = "official"
    """KITTI's eight types, or the data set's category names (blanks become underscores)."""
    boxes: Literal["projected", "tight"] = "projected"
    """Image boxes: around the projected 3D box (people with ``labels.box3d: annotated``: around the
    figure), or around the visible pixels."""
    far_m: float = Field(80.0, gt=0)
    """Objects farther than this along the optical axis become DontCare."""
    far_people_m: float | None = Field(None, gt=0)
    """As ``far_m``, for people, whom annotators recognise less far; None = ``far_m``."""
    low_px: int = Field(10, ge=2)
    """Objects with fewer visible pixel rows than this become DontCare."""

    @property
    def has_own_classes(self) -> bool:
        """Whether the types are KITTI's."""
        return self.types == "official"

    def check_types(self, info: DatasetInfo, exporter: str) -> None:
        """Reject categories that would be one type. Raises ConfigError."""
        if self.types == "category":
            base.check_distinct(exporter, info, _join_words)

    def labelled_m(self, kind: str) -> float:
        """Depth up to which objects of one of KITTI's types have labels."""
        people_m = self.far_people_m if kind in PEOPLE else None
        return self.far_m if people_m is None else people_m


class Kitti(KittiLabels):
    """KITTI object detection: the images of one camera, with labels in its frame."""

    type: Literal["kitti"] = "kitti"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i",
        box="first and last pixel (i), of the projected 3D box, or of annotated figures; "
        "`boxes: tight` of visible pixels",
        lens=PINHOLE,
        intensity="0 to 1",
    )
    camera: str = ""
    """Sensor that becomes camera 2; empty = the first one, by name, with the rgb channel."""
    lidar: str = ""
    """Sensor of the points, lidar or pseudo_lidar; empty = the first one by name, if any."""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no such camera or lidar, the camera is not a pinhole or does not write the
                rgb channel, two categories are written alike, or too many samples for six digits.
        """
        self._camera(info)
        self._lidar(info)
        self.check_types(info, self.type)
        check_frame_names(info, self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write label, calibration, points and split of each sample.

        Raises:
            ConfigError: see ``check``.
        """
        self.check(info)
        camera = self._camera(info)
        folder = shard_dir / self.type
        frames = []
        for sample in samples:
            if camera not in sample.truth:
                continue
            truth = sample.truth[camera]
            frame = _frame_name(sample.index)
            rows = label_rows(truth, self)
            T_camera_lidar = self._scanner_pose(info, sample, true=True)
            turn = velodyne.turn_ahead(T_camera_lidar.rotation()[2])
            T_camera_velo = velodyne.turned_pose(self._scanner_pose(info, sample), turn)
            calib = calib_text(truth.camera.intrinsics, T_camera_velo.matrix()[:3])
            write_text(folder / f"calib/{frame}.txt", calib)
            lidar = self._lidar(info)
            if sensor_selection.has_scans(shard_dir, lidar, sample.index):
                points = point_cloud_io.with_classes(
                    point_cloud_io.read_points(shard_dir, lidar, sample.index),
                    point_cloud_io.class_facts(info, sample.scene).get("classes"),
                )
                write_bytes(folder / f"velodyne/{frame}.bin", velodyne.scan_bytes(points, turn))
                members, unseen = point_members(points, truth, rows, T_camera_lidar.matrix()[:3])
                rows = without_returns(rows, unseen, truth)
                labels = point_labels(points, members, rows)
                write_bytes(folder / f"velodyne_labels/{frame}.label", labels.tobytes())
            write_text(folder / f"label_2/{frame}.txt", "".join(f"{row}\n" for row, _ in rows))
            if self._converts_depth(info):
                depth = rgbd_sequences.depth_png(
                    info, shard_dir, camera, sample.index, DEPTH_UNITS_PER_M
                )
                write_bytes(folder / f"depth_2/{frame}.png", depth)
            frames.append(f"{sample.index} {sample.split}\n")
        write_text(folder / "frames.txt", "".join(frames))

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link all files of the shards into one tree and list the frames of each split."""
        camera = self._camera(info)
        frames_of: dict[str, list[str]] = {split: [] for split in SPLITS}
        for shard_dir in shard_dirs:
            for line in (shard_dir / self.type / "frames.txt").read_text("utf-8").splitlines():
                index, split = line.split(" ", 1)
                frames_of.setdefault(split, []).append(_frame_name(int(index)))
                for source, target in self._links(info, camera, shard_dir, int(index)):
                    image_files.link_or_copy(source, dataset_dir / f"training/{target}")
        for split, frames in frames_of.items():
            listing = "".join(f"{frame}\n" for frame in frames)
            write_text(dataset_dir / "ImageSets" / f"{split}.txt", listing)
        write_text(dataset_dir / "README.txt", self._readme(info, camera))

    def _camera(self, info: DatasetInfo) -> str:
        return sensor_selection.pinhole_camera(info, self.camera, self.type)

    def _lidar(self, info: DatasetInfo) -> str:
        return sensor_selection.laser_scanner(info, self.lidar, self.type)

    def _scanner_pose(self, info: DatasetInfo, sample: Sample, *, true: bool = False) -> se3.SE3:
        """``T_camera_lidar``, as calibrated or ``true``; without a scanner, one at the camera."""
        lidar = self._lidar(info)
        if lidar:
            camera = self._camera(info)
            return point_cloud_io.T_camera_lidar(sample, camera, lidar, true=true)
        return scene_time.RIG_AXES

    def _links(
        self, info: DatasetInfo, camera: str, shard_dir: Path, index: int
    ) -> list[tuple[Path, str]]:
        """Files of one frame, each with its path below ``training``."""
        frame = _frame_name(index)
        names = [f"label_2/{frame}.txt", f"calib/{frame}.txt"]
        if sensor_selection.has_scans(shard_dir, self._lidar(info), index):
            names += [f"velodyne/{frame}.bin", f"velodyne_labels/{frame}.label"]
        links = [(shard_dir / f"{self.type}/{name}", name) for name in names]
        rgb = media_path(shard_dir, camera, capture.Channel.RGB, index)
        links.append((rgb, f"image_2/{frame}.png"))
        if self._converts_depth(info):
            links.append((shard_dir / f"{self.type}/depth_2/{frame}.png", f"depth_2/{frame}.png"))
        elif capture.Channel.Z_DEPTH in info.media[camera]:
            depth = media_path(shard_dir, camera, capture.Channel.Z_DEPTH, index)
            links.append((depth, f"depth_2/{frame}.png"))
        return links

    def _converts_depth(self, info: DatasetInfo) -> bool:
        """Whether there are images of depth, in units other than KITTI's."""
        has_depth = capture.Channel.Z_DEPTH in info.media[self._camera(info)]
        return has_depth and info.depth_scale_m != 1.0 / DEPTH_UNITS_PER_M

    def _readme(self, info: DatasetInfo, camera: str) -> str:
        return _README.format(
            name=info.name,
            camera=camera,
            points=_SCANNED.format(lidar=self._lidar(info)) if self._lidar(info) else "",
            boxes=_BOXES[self.boxes],
            truncated="unclipped box" if self.boxes == "projected" else "silhouette",
            far=self.far_m,
            people="" if self.far_people_m is None else f" (people: {self.far_people_m:g} m)",
            low=self.low_px,
            partly=PARTLY_OCCLUDED,
            largely=LARGELY_OCCLUDED,
        )


LabelRow = tuple[str, int]
"""A row of a label file, and the id of its instance."""


def label_rows(truth: ImageTruth, style: KittiLabels) -> list[LabelRow]:
    """Rows of a label file; DontCare rows come last, as readers expect."""
    rows = [
        (label_row(thing, truth, style), thing.instance.instance_id)
        for thing in truth.objects
        if thing.box is not None
    ]
    return sorted(rows, key=_is_dont_care)


def without_returns(
    rows: Sequence[LabelRow], unseen: frozenset[int], truth: ImageTruth
) -> list[LabelRow]:
    """The rows, with rows of the ``unseen`` instances, which no laser pulse hit, as DontCare."""
    boxes = {thing.instance.instance_id: thing.box for thing in truth.objects}
    changed = []
    for row, number in rows:
        box = boxes[number] if number in unseen and not row.startswith(DONT_CARE) else None
        changed.append((row if box is None else dont_care(box, truth.camera.intrinsics), number))
    return sorted(changed, key=_is_dont_care)


def _is_dont_care(row: LabelRow) -> bool:
    return row[0].startswith(DONT_CARE)


def point_members(
    points: NDArray[np.void], truth: ImageTruth, rows: Sequence[LabelRow], T_camera_velo: se3.Array
) -> tuple[NDArray[np.int64], frozenset[int]]:
    """Assign points to instances; also return the labelled instances without a point.

    Args:
        points: Records of ``POINT`` [n].
        truth: Truth of the image; DontCare objects keep the points that they reflect.
        rows: Result of ``label_rows``.
        T_camera_velo: Transform of the points to the camera frame, [3, 4].
    """
    labelled = {number for row, number in rows if not row.startswith(DONT_CARE)}
    boxes = {
        thing.instance.instance_id: upright_box(thing.box3d_camera)
        for thing in truth.objects
        if thing.instance.instance_id in labelled and thing.box3d_camera is not None
    }
    # Coordinate by coordinate: a sum over the short last axis takes three times as long.
    x, y, z = points["position_m"].T.astype(np.float64)
    p_camera = np.stack([a * x + b * y + c * z + d for a, b, c, d in T_camera_velo], axis=1)
    ids = points["instance_id"].astype(np.int64)
    members = members_in_box(ids, p_camera, boxes)
    hit = np.flatnonzero(np.bincount(ids[members == ids]))
    return members, frozenset(labelled) - frozenset(hit.tolist())


def point_labels(
    points: NDArray[np.void], members: NDArray[np.int64], rows: Sequence[LabelRow]
) -> NDArray[np.uint32]:
    """Label each point: category id in the lower half, row in label_2 in the upper half.

    Args:
        points: Records of ``POINT`` [n].
        members: Result of ``point_members`` [n].
        rows: Result of ``label_rows``; rows count from 1, 0 = no row.
    """
    table = np.zeros(1 + int(members.max(initial=0)), np.uint32)
    for number, (_, instance_id) in enumerate(rows, 1):
        if instance_id < len(table):
            table[instance_id] = number
    labels: NDArray[np.uint32] = (points["category_id"] | (table[members] << np.uint32(16))).astype(
        "<u4"
    )
    return labels


def label_row(thing: ObjectTruth, truth: ImageTruth, style: KittiLabels) -> str:
    """Format the fifteen columns of one visible object.

    The row is DontCare if the object is ignored, too far or too small for ``style``, less than two
    pixels wide, or if its box reaches behind the camera: readers disagree about that projection.
    """
    assert thing.box is not None, "invisible objects are not listed"
    assert thing.box3d_camera is not None, "the annotation boxes3d is in `needs`"
    assert thing.occlusion is not None, "the annotation visibility is in `needs`"
    assert thing.truncation is not None, "the annotation visibility is in `needs`"
    box = upright_box(thing.box3d_camera)
    x, y, z = box.bottom_m
    k = truth.camera.intrinsics
    tiny = thing.box.width_px < 2 or thing.box.height_px < style.low_px
    instance = thing.instance
    official = official_type(instance)
    unlabelled = thing.ignored or tiny or not 0 < z <= style.labelled_m(official)
    if unlabelled or box.corners()[:, 2].min() < NEAR_M:
        return dont_care(thing.box, k)
    kind = official if style.types == "official" else _join_words(instance.category)
    alpha_rad = math.remainder(box.heading_rad - math.atan2(x, z), 2.0 * math.pi)
    metric = (*box.size_hwl_m, x, y, z, box.heading_rad)
    truncation, corners = thing.truncation, _format_corners(thing.box)
    if style.boxes == "projected":
        if instance.tight_box3d != instance.box3d and thing.amodal_box is not None:
            truncation, corners = figure_box(thing.amodal_box, scene.PERSON_MARGIN_M / z, k)
        else:
            truncation, corners = projected_box(box, k)
    return " ".join(
        (
            kind,
            f"{truncation:.2f}",
            str(occlusion_level(thing.occlusion)),
            _format_decimal(alpha_rad),
            corners,
            *map(_format_decimal, metric),
        )
    )


def dont_care(box: BoxPx, camera: intrinsics.Intrinsics) -> str:
    """Format the row of an unlabelled region."""
    corners = _format_corners(_widen(box, camera))
    return f"{DONT_CARE} -1 -1 -10 {corners} -1 -1 -1 -1000 -1000 -1000 -10"


def projected_box(box: UprightBox, camera: intrinsics.Intrinsics) -> tuple[float, str]:
    """Truncation of a box's projection, and the columns of the part inside the image.

    The latter as left, top, right and bottom, with pixel centres at whole numbers.
    """
    uv = camera.project(box.corners()) - 0.5
    (left, top), (right, bottom) = uv.min(axis=0), uv.max(axis=0)
    x = np.clip([left, right], 0.0, camera.width_px - 1.0)
    y = np.clip([top, bottom], 0.0, camera.height_px - 1.0)
    inside = (x[1] - x[0]) * (y[1] - y[0]) / ((right - left) * (bottom - top))
    return max(1.0 - float(inside), 0.0), f"{x[0]:.2f} {y[0]:.2f} {x[1]:.2f} {y[1]:.2f}"


def figure_box(
    silhouette: BoxPx, margin: float, camera: intrinsics.Intrinsics
) -> tuple[float, str]:
    """Truncation and columns, as of ``projected_box``, of a silhouette's box with a margin.

    The margin, on both sides and above, is in units of the focal lengths.
    """
    wide_px, high_px = margin * camera.fx_px, margin * camera.fy_px
    left, right = silhouette.x_min - wide_px, silhouette.x_max + wide_px
    top, bottom = silhouette.y_min - high_px, float(silhouette.y_max)
    x = np.clip([left, right - 1.0], 0.0, camera.width_px - 1.0)
    y = np.clip([top, bottom - 1.0], 0.0, camera.height_px - 1.0)
    inside = (x[1] - x[0] + 1.0) * (y[1] - y[0] + 1.0) / ((right - left) * (bottom - top))
    return max(1.0 - float(inside), 0.0), f"{x[0]:.2f} {y[0]:.2f} {x[1]:.2f} {y[1]:.2f}"


def official_type(instance: scene.Instance) -> str:
    """KITTI's type of an object, one of eight."""
    kind = OFFICIAL_TYPES.get(_join_words(instance.category.lower()), "Misc")
    sits = kind == "Pedestrian" and dict(instance.attributes).get("pose") in SITTING
    return "Person_sitting" if sits else kind


def occlusion_level(occlusion: float) -> int:
    """KITTI's level 0 visible, 1 partly or 2 largely occluded, by hidden fraction."""
    return int(occlusion > PARTLY_OCCLUDED) + int(occlusion > LARGELY_OCCLUDED)


def calib_text(camera: intrinsics.Intrinsics, T_camera_velo: se3.Array = T_CAMERA_FORWARD) -> str:
    """Format the seven lines of a calibration file, in the order that readers expect."""
    return matrix_lines(calib_matrices(camera, T_camera_velo))


def calib_matrices(camera: intrinsics.Intrinsics, T_camera_velo: se3.Array) -> dict[str, se3.Array]:
    """Matrices of a calibration file by name; pixel centres are integers."""
    projection = np.zeros((3, 4))
    projection[:, :3] = camera.matrix()
    projection[:2, 2] -= 0.5
    rows: dict[str, se3.Array] = {f"P{k}": projection for k in range(4)}
    rows["R0_rect"] = np.eye(3)
    rows["Tr_velo_to_cam"] = T_camera_velo
    rows["Tr_imu_to_velo"] = np.eye(3, 4)
    return rows


def matrix_lines(rows: dict[str, se3.Array]) -> str:
    """Format matrices as lines of ``name: numbers``, row by row."""
    return "".join(
        f"{name}: " + " ".join(f"{value:.12e}" for value in matrix.ravel()) + "\n"
        for name, matrix in rows.items()
    )


def _widen(box: BoxPx, camera: intrinsics.Intrinsics) -> BoxPx:
    """Widen a box to at least two pixels in each direction, inside the image."""
    x_min = max(min(box.x_min, camera.width_px - 2), 0)
    y_min = max(min(box.y_min, camera.height_px - 2), 0)
    return BoxPx(x_min, y_min, max(box.x_max, x_min + 2), max(box.y_max, y_min + 2))


def _format_corners(box: BoxPx) -> str:
    return f"{box.x_min:.2f} {box.y_min:.2f} {box.x_max - 1:.2f} {box.y_max - 1:.2f}"


def _format_decimal(value: float) -> str:
    # Micrometres: with KITTI's own two decimals, small objects lose precision. No "-0.000000".
    return f"{round(value, 6) + 0.0:.6f}"


def _join_words(name: str) -> str:
    return "_".join(name.split())


def _frame_name(index: int) -> str:
    return f"{index:06d}"


_BOXES = {
    "projected": "around the projection of the 3D box, clipped to the image;\n"
    "            of people with labels.box3d: annotated, around the figure with a margin of\n"
    f"            {scene.PERSON_MARGIN_M:g} m",
    "tight": "around the visible pixels",
}
_SCANNED = """\
velodyne    Points of '{lidar}'; float32 x y z reflectance [0, 1]. X is ahead of the camera, Y
            left, Z up: a scanner that looks elsewhere is turned about its z axis.
velodyne_labels  One uint32 per point: lower half the category id of the reflector, upper half
            row in label_2, from 1; 0 = no row. A point belongs to the object whose box it is in:
            points that range noise took more than 3 cm out have no row.
"""
_README = """\
{name}: KITTI object detection format, sensor '{camera}'

training/   All frames; ImageSets/*.txt say which split each belongs to.
image_2     RGB.
depth_2     z-depth, 16-bit: metres = value / 256; 0 = nothing or out of range. Present when the
            data set keeps depth images.
calib       P0 = P1 = P2 = P3, pixel centres at whole numbers; R0_rect = identity, so the rectified
            frame is the camera's: X right, Y down, Z forward. The virtual IMU is at the scanner.
{points}label_2     type truncated occluded alpha left top right bottom h w l x y z rotation_y
            Objects without a KITTI type (buses, motorcycles) are Misc; sitting people, by
            their attribute pose, are Person_sitting; scenery that is not annotated has no row.
            Boxes turn about the camera's y axis only: each is the smallest such box, headed like
            the object's x axis, around the object's own oriented box.
            left top right bottom: {boxes}.
            DontCare: farther than {far:g} m{people}, lower than {low} pixels, or without a
            laser point.
            truncated: share of the {truncated} outside the image. occluded, by the hidden share of
            the silhouette inside the image: 0 up to {partly}, 1 up to {largely}, 2 above.
            Metres and radians have six decimals.
"""
