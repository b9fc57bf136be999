"""COCO instances and keypoints, with 3D boxes, poses, visibility and attributes as extra keys.

::

    annotations/instances_<split>.json              none for a split without images
    annotations/<category>_keypoints_<split>.json   if the annotation keypoints is enabled
    <split>/000000012_color.png             images{file_name}; one name per sample and sensor
    <channel>/<split>/000000012_color.png   the other images of the data set: depth, instance, ...

COCOeval compares keypoints of one skeleton at a time, so each category with keypoints has its own
file, such as COCO's ``person_keypoints_train.json``. It lists all images and the objects of its
category, with ``keypoints`` and ``num_keypoints`` (0 if an object has no keypoints); the category
has ``keypoints`` and the 1-based ``skeleton``.

Masks are polygons, 0.02 px inside the edges of pixels, of which pycocotools, OpenCV and PIL draw
exactly the mask, or run lengths (``segmentation: rle``), which torchvision's reference recipe for
detection, SAHI and DETR's processor in transformers do not read. Regions that a label map ignores
have ``iscrowd`` 1, and run lengths in either case. As COCOeval ignores regions class by class, a
region whose class the label map leaves out is listed once under each class, with ids that count
down from ``LABEL_IDS_MAX`` in place of the instance id.

Boxes are whole numbers of pixels, written as floats: torchvision makes integers of integers, and
then cuts the boxes of resized or rotated images.

Every annotation has COCO's own keys, and ``attributes``: the object's name, asset, subcategory and
the attributes of its asset. Images have ``attributes`` too, the shared values of their scene, and
the values of ``weather`` other than zero. Annotators that are enabled add these keys:

``amodal_bbox``, ``amodal_segmentation``
    The whole silhouette. The box may leave the image, the mask is clipped to it. With
    ``bbox: amodal``, the key ``bbox`` is that box too, clipped to the image; ``segmentation`` and
    ``area`` refer to the visible pixels, as in data sets of amodal detection.
``visible_fraction``, ``occlusion``, ``truncation``
    Fractions in [0, 1]: visible pixels of the silhouette; hidden pixels of its part inside the
    image; silhouette pixels outside the image.
``detectability``
    d' of the ideal observer: contrast over noise, from 0.
``box3d``
    Camera frame: ``center_m``, full ``size_m``, ``quaternion_wxyz``.
``T_camera_object``
    Pose of the object's own frame, 4 x 4, row by row.
``oriented_bbox``
    Four corners ``[x, y]`` along the object's heading, from the front left one, clockwise.
``part_px``
    Visible pixels by part.
``motion``
    Velocity, acceleration and angular velocity over the ground, along the axes of ``world``,
    ``camera`` and ``ego`` (the rig; absent without one), and ``speed_m_s``.
``keypoints_camera_m``
    In keypoint files: by name, positions in the camera frame.

If views are sequences of several instants, images also have ``sequence_id``, ``frame_id`` (number
of the instant in its sequence, from 0) and ``time_s``, and annotations have ``track_id``: the same
for one object in all images of its sequence, of all cameras, and unique in the data set.

Images have ``K`` and, unless their camera is a pinhole, ``lens``: its ``model`` (one in
``gen_data.core.lens``), OpenCV's ``distortion`` vector with the names of its
``coefficients``, to be applied before ``K``, and ``half_field_rad``, the angle to the axis at which
the image ends.

Images of a camera with a shutter have ``exposure_s``, the exposure time of a row, and
``readout_s``, the time from the exposure of the upper edge to the lower edge's (negative =
upwards, 0 = global shutter): row ``v`` is exposed around ``readout_s * ((v + 0.5) / height - 0.5)``
after the image's instant. Masks, boxes and keypoints refer to the instants of their rows, all 3D
values to the instant of the image.

If enabled, images have ``lane_borders``, lists of image points in the direction of travel with
their visibility (0 = hidden), ``free_space``, run-length encoded, and ``relationships``: triples
of subject, predicate and object, both by ``instance_id``. An object may be without
annotation, such as a table; ``others`` has the categories of those, by ``instance_id``.

Camera frames are X right, Y down, Z forward. ``K`` is for image coordinates in which pixel ``i``
covers ``[i, i + 1)``, as COCO's boxes do; OpenCV's principal point is 0.5 px less.

References: https://cocodataset.org/#format-data and pycocotools. Its COCOeval treats annotation
id 0 as "no match", so ids start at 1.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Literal

from gen_data.core import boxes, intrinsics, se3, serialization
from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.motion import Twist
from gen_data.core.reported import reported
from gen_data.core.sample import (
    ANNOTATION_STRIDE,
    ImageTruth,
    KeypointTruth,
    MotionTruth,
    ObjectTruth,
    Sample,
    both_ways,
)
from gen_data.core.scene import Instance, Scene, Weather
from gen_data.core.shutter import Shutter
from gen_data.core.skeletons import Skeleton, find_skeleton
from gen_data.exporters import base, ignored_regions, image_files, mask_polygons, rle, sequences
from gen_data.exporters.conventions import EDGES, READING, Conventions
from gen_data.exporters.fragments import (
    fragment_lines,
    fragment_rows,
    image_splits,
    write_fragments,
)
from gen_data.exporters.lens_fields import lens_fields
from gen_data.exporters.sensor_selection import check_channels, photographs, stamp_s

DECIMALS = 9
"""Decimals of metres, matrices and fractions: far below any measurement error."""


class Coco(base.ExporterBase):
    """COCO instances, one JSON file per split; images of all sensors with the rgb channel."""

    type: Literal["coco"] = "coco"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5", box=EDGES, lens="any; `images[].lens`", time=READING
    )

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    segmentation: Literal["polygon", "rle", "none"] = "polygon"
    """Visible masks as polygons, of which readers draw exactly the mask, as run lengths, which are
    shorter and which some trainers do not read, or none."""
    bbox: Literal["visible", "amodal"] = "visible"
    """Boxes around the visible pixels, or around the whole silhouette within the image."""
    keypoints: Literal["places", "pixels"] = "places"
    """Keypoints in the image coordinates of boxes, or as numbers of pixels, 0.5 less, for which
    Detectron2, MMPose and Albumentations take them."""
    amodal: bool = True
    """Also write the box of the silhouette and, with the annotation amodal_masks, its mask."""

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators that it requires."""
        silhouettes = self.amodal or self.bbox == "amodal"
        return frozenset({"instance_masks", "boxes2d"} if silhouettes else {"instance_masks"})

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no sensor writes the rgb channel.
        """
        check_channels(info, (), self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write one JSON line per image and per annotation, by split.

        Raises:
            ConfigError: no sensor writes the rgb channel.
        """
        self.check(info)
        rows: dict[str, list[dict[str, Any]]] = {}
        for sample, sensor in photographs(info, samples):
            images = rows.setdefault(f"{sample.split}.images", [])
            annotations = rows.setdefault(f"{sample.split}.annotations", [])
            images.append(_image(info, sample, sensor))
            visible = [thing for thing in sample.truth[sensor].objects if thing.box is not None]
            for thing, number in ignored_regions.numbered(info, visible):
                row = self._annotation(info, sample, sensor, thing)
                row["id"] = sample.annotation_id(sensor, number)
                annotations.append(row)
                if thing.keypoints is not None and number == thing.instance.instance_id:
                    stem = f"{sample.split}.keypoints.{thing.instance.category_id}"
                    rows.setdefault(stem, []).append(row | _named_points(thing.keypoints))
        write_fragments(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Join the lines of all shards, given in index order, and link the images."""
        fragments = [shard_dir / self.type for shard_dir in shard_dirs]
        splits = image_splits(fragments)
        skeletons = _skeletons(fragments)
        folder = dataset_dir / "annotations"
        folder.mkdir(parents=True, exist_ok=True)
        for split in splits:
            images = partial(fragment_lines, fragments, f"{split}.images")
            rows = fragment_lines(fragments, f"{split}.annotations")
            header = dataset_header(info, _categories(info), self.conventions)
            write_dataset(folder / f"instances_{split}.json", header, images(), rows)
            for category_id, skeleton in skeletons.items():
                lines = fragment_lines(fragments, f"{split}.keypoints.{category_id}")
                name = info.categories[category_id - 1]
                path = folder / f"{'_'.join(name.split())}_keypoints_{split}.json"
                category = _keypoint_category(category_id, name, skeleton)
                header = dataset_header(info, [category], self.conventions)
                if self.keypoints == "pixels":
                    header["info"]["keypoints"] = "numbers of pixels: 0.5 less than places in boxes"
                shift_px = 0.5 if self.keypoints == "pixels" else 0.0
                write_dataset(path, header, images(), _keypoint_rows(lines, skeleton, shift_px))
            for shard_dir, image in fragment_rows(shard_dirs, self.type, f"{split}.images"):
                _link_images(info, image, split, shard_dir, dataset_dir)

    def _annotation(
        self, info: DatasetInfo, sample: Sample, sensor: str, thing: ObjectTruth
    ) -> dict[str, Any]:
        assert thing.box is not None, "invisible objects are not listed"
        camera = sample.truth[sensor].camera.intrinsics
        instance = thing.instance
        row: dict[str, Any] = {
            "id": sample.annotation_id(sensor, instance.instance_id),
            "image_id": sample.image_id(sensor),
            "category_id": instance.category_id,
            "bbox": box_xywh(self._box(thing, camera) or thing.box),
            "area": thing.visible_px,
            "iscrowd": int(thing.ignored),
            "segmentation": [],
            "instance_id": instance.instance_id,
            "attributes": _facts(instance),
        }
        if info.steps_per_scene > 1:
            sequence = sequences.sequence_number(info, sample.index)
            row["track_id"] = sequence * ANNOTATION_STRIDE + instance.instance_id
        if self.segmentation != "none":
            assert thing.mask is not None, "the annotation instance_masks is in `needs`"
            # COCO's crowds have run lengths in either case.
            if self.segmentation == "polygon" and not thing.ignored:
                row["segmentation"] = [
                    p.ravel().tolist() for p in mask_polygons.drawable_polygons(thing.mask)
                ]
            else:
                row["segmentation"] = rle.encode_rle(thing.mask, camera.height_px, camera.width_px)
        if self.amodal and thing.amodal_box is not None:
            row["amodal_bbox"] = box_xywh(thing.amodal_box)
        if self.amodal and thing.amodal_mask is not None:
            mask = thing.amodal_mask
            row["amodal_segmentation"] = rle.encode_rle(mask, camera.height_px, camera.width_px)
        return row | _optional_keys(thing)

    def _box(self, thing: ObjectTruth, camera: intrinsics.Intrinsics) -> boxes.BoxPx | None:
        """Content of ``bbox``; None if its silhouette is unknown."""
        if self.bbox == "visible" or thing.amodal_box is None:
            return thing.box
        return thing.amodal_box.clipped(camera.width_px, camera.height_px)


def image_labels(info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
    """Labels of one image, without paths: the row of ``images`` and its ``annotations``.

    For formats that keep the labels of each image next to it. Annotations also have the name of
    their ``category``.
    """
    row = _image(info, sample, sensor)
    visible = [thing for thing in sample.truth[sensor].objects if thing.box is not None]
    style = Coco(segmentation="rle")
    annotations = [
        style._annotation(info, sample, sensor, thing)
        | {"id": sample.annotation_id(sensor, number), "category": thing.instance.category}
        for thing, number in ignored_regions.numbered(info, visible)
    ]
    without_paths = {k: v for k, v in row.items() if k not in ("file_name", "files")}
    return without_paths | {"annotations": annotations}


def _optional_keys(thing: ObjectTruth) -> dict[str, Any]:
    keys: dict[str, Any] = {
        name: round(share, DECIMALS)
        for name in ("visible_fraction", "occlusion", "truncation", "detectability")
        if (share := getattr(thing, name)) is not None
    }
    if thing.box3d_camera is not None:
        keys["box3d"] = _box3d(thing.box3d_camera)
    if thing.T_camera_object is not None:
        keys["T_camera_object"] = _rows(thing.T_camera_object.matrix())
    if thing.oriented_box is not None:
        keys["oriented_bbox"] = [list(corner) for corner in thing.oriented_box]
    if thing.part_px is not None:
        keys["part_px"] = thing.part_px
    if thing.motion is not None:
        keys["motion"] = motion_facts(thing.motion)
    return keys


def motion_facts(motion: MotionTruth) -> dict[str, Any]:
    """Motion of an object, along the axes of each frame."""
    frames = {"world": motion.world, "camera": motion.camera, "ego": motion.ego}
    facts: dict[str, Any] = {
        name: {f.name: _round_values(getattr(twist, f.name)) for f in fields(Twist)}
        for name, twist in frames.items()
        if twist is not None
    }
    return {**facts, "speed_m_s": round(motion.speed_m_s, DECIMALS)}


def scene_graph(scene: Scene, truth: ImageTruth) -> dict[str, Any]:
    """Relations of an image in both directions, and categories of unannotated instances in them."""
    both = both_ways(truth.relations or ())
    known = {thing.instance.instance_id for thing in truth.objects}
    others = sorted({number for s, _, o in both for number in (s, o)} - known)
    return {
        "relationships": [list(triple) for triple in sorted(both)],
        "others": {str(number): scene.instance(number).category for number in others},
    }


def _image_keys(scene: Scene, truth: ImageTruth, camera: intrinsics.Intrinsics) -> dict[str, Any]:
    keys: dict[str, Any] = {}
    if truth.borders is not None:
        keys["lane_borders"] = [
            {
                "name": b.border,
                "kind": b.kind,
                "points_px": b.points_px,
                "visible": [int(seen) for seen in b.visible],
            }
            for b in truth.borders
        ]
    if truth.free_space is not None:
        keys["free_space"] = rle.encode_rle(truth.free_space, camera.height_px, camera.width_px)
    if truth.relations is not None:
        keys |= scene_graph(scene, truth)
    return keys


def image_name(index: int, sensor: str, suffix: str = ".png") -> str:
    """File name of a camera's image of one sample."""
    return f"{index:09d}_{sensor}{suffix}"


def _image(info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
    camera = sample.truth[sensor].camera
    name = image_name(sample.index, sensor)
    others = [c for c in info.media[sensor] if c is not Channel.RGB]
    row = {
        "id": sample.image_id(sensor),
        "file_name": image_name(sample.index, sensor, info.encoding(sensor, Channel.RGB).suffix),
        "width": camera.intrinsics.width_px,
        "height": camera.intrinsics.height_px,
        "files": {c.value: f"{c.value}/{sample.split}/{name}" for c in others},
        "sample": sample.index,
        "scene": sample.scene_index,
        "view": sample.view_index,
        "sensor": sensor,
        "K": _rows(camera.intrinsics.matrix()),
        **lens_fields(camera.intrinsics.lens),
        **_shutter(camera.shutter),
        "T_world_camera": _rows(reported(camera).T_world_camera.matrix()),
        "attributes": dict(sample.scene.shared),
        "weather": _weather(sample.scene.weather),
    } | _image_keys(sample.scene_of(sensor), sample.truth[sensor], camera.intrinsics)
    if info.steps_per_scene > 1:
        row["sequence_id"] = sequences.sequence_number(info, sample.index)
        row["frame_id"] = sample.index % info.steps_per_scene
        row["time_s"] = round(stamp_s(sample, sensor), DECIMALS)
    return row


def _shutter(shutter: Shutter) -> dict[str, Any]:
    """Keys of a shutter; empty for an instantaneous one."""
    if not shutter.open_s > 0.0:
        return {}
    return {"exposure_s": shutter.exposure_s, "readout_s": shutter.readout_s}


def _weather(weather: Weather) -> dict[str, float]:
    values = ((f.name, getattr(weather, f.name)) for f in fields(weather) if f.name != "seed")
    return {name: round(value, DECIMALS) for name, value in values if value}


def _facts(instance: Instance) -> dict[str, str]:
    facts = {"name": instance.name, "asset": instance.asset}
    if instance.subcategory:
        facts["subcategory"] = instance.subcategory
    return {**dict(instance.attributes), **facts}


def _named_points(points: Sequence[KeypointTruth]) -> dict[str, Any]:
    """Keypoints as in fragments; a category's skeleton is known only after all shards."""
    return {
        "points": [
            [p.name, *(round(x, 3) for x in p.image_px), p.visibility, _round_values(p.position_m)]
            for p in points
        ]
    }


def _skeletons(fragments: Sequence[Path]) -> dict[int, Skeleton]:
    """Find the skeletons of the categories with keypoints, by category id in order."""
    names: dict[int, dict[str, None]] = {}
    for fragment in fragments:
        for path in sorted(fragment.glob("*.keypoints.*.jsonl")):
            listed = names.setdefault(int(path.name.split(".")[2]), {})
            for line in fragment_lines([fragment], path.stem):
                listed.update(dict.fromkeys(point[0] for point in json.loads(line)["points"]))
    return {number: find_skeleton(names[number]) for number in sorted(names) if names[number]}


def _keypoint_rows(lines: Iterable[str], skeleton: Skeleton, shift_px: float) -> Iterator[str]:
    """Complete annotations to the whole skeleton; absent points are COCO's (0, 0, 0).

    ``shift_px`` is subtracted from the coordinates of all others.
    """
    for line in lines:
        row = json.loads(line)
        points = {
            name: (*_shifted((u, v), shift_px if seen else 0.0), seen, place)
            for name, u, v, seen, place in row.pop("points")
        }
        found = [points.get(name, (0, 0, 0, None)) for name in skeleton.names]
        row["keypoints"] = [value for u, v, seen, _ in found for value in (u, v, seen)]
        row["num_keypoints"] = sum(seen > 0 for _, _, seen, _ in found)
        row["keypoints_camera_m"] = {name: place for name, (*_, place) in points.items()}
        yield serialization.canonical_json(row)


def _shifted(place_px: Sequence[float], shift_px: float) -> Iterator[float]:
    return (round(value - shift_px, 3) if shift_px else value for value in place_px)


def _categories(info: DatasetInfo) -> list[dict[str, Any]]:
    return [
        {"id": k, "name": name, "supercategory": "object"}
        for k, name in enumerate(info.categories, 1)
    ]


def _keypoint_category(category_id: int, name: str, skeleton: Skeleton) -> dict[str, Any]:
    return {
        "id": category_id,
        "name": name,
        "supercategory": "object",
        "keypoints": list(skeleton.names),
        "skeleton": [[a + 1, b + 1] for a, b in skeleton.bones],
    }


def dataset_header(
    info: DatasetInfo, categories: Sequence[Mapping[str, Any]], conventions: Conventions
) -> dict[str, Any]:
    """Sections of a COCO file other than images and annotations."""
    return {
        "info": {
            "description": info.name,
            "version": "1.0",
            "seed": info.seed,
            "depth_scale_m": info.depth_scale_m,
            "camera_frame": "X right, Y down, Z forward; metres",
            "pixel_centre": 0.5,
            "conventions": conventions.facts(),
        },
        "licenses": [],
        "categories": list(categories),
    }


def write_dataset(
    path: Path, header: Mapping[str, Any], images: Iterable[str], annotations: Iterable[str]
) -> None:
    """One JSON document, streamed: annotations of all images are never in memory together."""
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(serialization.canonical_json(header)[:-1])
        for section, lines in (("images", images), ("annotations", annotations)):
            file.write(f',\n"{section}":[')
            separator = "\n"
            for line in lines:
                file.write(separator + line)
                separator = ",\n"
            file.write("\n]")
        file.write("}\n")


def _link_images(
    info: DatasetInfo, image: Mapping[str, Any], split: str, shard_dir: Path, dataset_dir: Path
) -> None:
    targets = {Channel.RGB.value: f"{split}/{image['file_name']}", **image["files"]}
    for channel, target in targets.items():
        source = info.media_path(shard_dir, image["sensor"], Channel(channel), image["sample"])
        image_files.link_or_copy(source, dataset_dir / target)


def box_xywh(box: boxes.BoxPx) -> list[float]:
    """COCO's box: left, top, width, height [px]; floats in JSON, see the top of this module."""
    return [float(box.x_min), float(box.y_min), float(box.width_px), float(box.height_px)]


def _box3d(box: boxes.OrientedBox) -> dict[str, list[float]]:
    return {
        "center_m": _round_values(box.T_frame_box.translation_m),
        "size_m": _round_values(box.size_m),
        "quaternion_wxyz": _round_values(box.T_frame_box.quaternion_wxyz),
    }


def _rows(matrix: se3.Array) -> list[list[float]]:
    return [_round_values(row) for row in matrix.tolist()]


def _round_values(values: Iterable[float]) -> list[float]:
    # Adding 0.0 turns -0.0 into 0.0.
    return [round(value, DECIMALS) + 0.0 for value in values]
