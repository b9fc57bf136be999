"""Rerun recordings: images, scans, poses and labels of a number of samples, to be played.

::

    <split>/000000.rrd           the first samples of a split (``samples_per_file``), and so on

Timelines are ``sample``, the index of the sample, and for sequences ``time`` [s], with one sequence
after the other. Times are true, also of sensors with a wrong clock. Entities:

===================================  ==============================================================
``world``                            right-handed, Z up; ``/`` has the names of the classes
``world/boxes``                      3D boxes of all objects that some camera sees
``world/rigs/<name>``                poses of rigs
``world/cameras/<name>``             pose; ``image``: pinhole, if the lens is one
``world/cameras/<name>/image/...``   ``rgb``, ``depth`` and ``measured_depth`` as PNG files,
                                     ``category``, ``boxes``, and ``keypoints/<instance id>``
``world/lidars/<name>``              pose, and points in its frame with classes
``faults/<sensor>``                  true faults of a reading, as JSON; empty without any
``world/lanes``                      borders of lanes, in each image as ``image/lanes``
``world/tracks``                     tracked points, in each image as ``image/tracks``
``world/occupancy``                  pose; ``voxels``: boxes of the voxels with a surface
``.../image/depth_layers/<k>``       layers of depth, as PNG files
``channels/<name>/...``              coloured: ``instance_layers/<k>``, ``material_layers/<k>`` and
                                     ``seen_in_mirror``
===================================  ==============================================================

Class ids are category ids, 0 is the background. Quaternions are x y z w, boxes have half sizes, and
principal points have pixel centres at i + 0.5. Ignored objects have no boxes and keypoints. Lanes,
tracks, occupancy, layers and mirrors are in it where the data set has them, in the colours of
``gen-data preview``. Other channels and devices are not in it; ``gen-data preview`` shows meshes.

Reference: https://rerun.io/docs/reference/types.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.core import capture, se3
from gen_data.core.boxes import OrientedBox
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import ObjectTruth, Sample
from gen_data.core.serialization import canonical_json
from gen_data.core.skeletons import Skeleton, find_skeleton
from gen_data.exporters import (
    base,
    image_files,
    label_colors,
    label_parts,
    point_cloud_io,
    rerun_labels,
    rrd_container,
)
from gen_data.exporters.conventions import READING, Conventions
from gen_data.exporters.fragments import fragment_rows, write_fragment

DEPTHS = (capture.Channel.Z_DEPTH, capture.Channel.MEASURED_DEPTH)
Row = Mapping[str, Any]
"""Facts about one sample, as ``_sample_row`` makes them, with the folder of its shard."""


class Rerun(base.ExporterBase):
    """Rerun recordings of all cameras and laser scanners.

    Attributes:
        samples_per_file: Samples of a recording, which a viewer loads as a whole.
    """

    type: Literal["rerun"] = "rerun"
    shows_truth: ClassVar[bool] = True
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5",
        box="left, top, right, bottom along the edges of pixels",
        lens="any; pinholes have a projection",
        time=READING,
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"boxes2d", "boxes3d"})

    image_formats: ClassVar[frozenset[str]] = base.PNG_OR_JPEG
    samples_per_file: int = Field(100, ge=1, le=10_000)

    def check(self, info: DatasetInfo) -> None:
        """Refuse a machine without the format's library.

        Raises:
            ConfigError: it is not installed.
        """
        del info
        base.check_installed(self.type, "rerun", "xxhash")

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a JSON line per sample; images and points are read when files are merged."""
        rows = [_sample_row(info, sample) for sample in samples]
        folder = shard_dir / self.type
        folder.mkdir(parents=True, exist_ok=True)
        for split in sorted({row["split"] for row in rows}):
            write_fragment(folder, f"{split}.samples", [r for r in rows if r["split"] == split])

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the recordings of every split, one after the other."""
        folders = [shard_dir / self.type for shard_dir in shard_dirs]
        splits = sorted({p.name.split(".")[0] for f in folders for p in f.glob("*.samples.jsonl")})
        keypoints = _collect_keypoints(shard_dirs, self.type, splits)
        for split in splits:
            rows = fragment_rows(shard_dirs, self.type, f"{split}.samples")
            (dataset_dir / split).mkdir(parents=True, exist_ok=True)
            number = 0
            while members := list(islice(rows, self.samples_per_file)):
                path = dataset_dir / split / f"{number:06d}.rrd"
                listed = [{**row, "shard": shard_dir} for shard_dir, row in members]
                name = f"{info.name}-{info.seed}-{split}-{number:06d}"
                rrd_container.write_recording(path, list(_chunks(info, listed, keypoints)), name)
                number += 1


def _sample_row(info: DatasetInfo, sample: Sample) -> dict[str, Any]:
    begins_s = (sample.index - sample.step_index) * info.step_s
    tracks = None if sample.frame is None else sample.frame.tracks
    seen = {
        item.instance.instance_id: item
        for truth in sample.truth.values()
        for item in truth.objects
        if item.box3d_world is not None and not item.ignored
    }
    # At the sample's instant: cameras that read later have boxes of objects that moved on.
    boxes = {thing.instance_id: thing.box3d for thing in sample.scene.instances}
    faults = {name: canonical_json(found) for name, found in sample.capture.faults() if found}
    return {
        "index": sample.index,
        "split": sample.split,
        **({"faults": faults} if faults else {}),
        "time_s": round(begins_s + sample.scene.time_s, 9),
        "boxes": [_box_row(seen[number], boxes[number]) for number in sorted(seen)],
        "rigs": {rig.name: _pose(sample.scene.rig_pose(rig.name)) for rig in sample.scene.rigs},
        "cameras": {
            name: {
                "time_s": round(begins_s + sample.capture.readings[name].time_s, 9),
                **_delivery_row(info, name, sample.capture.readings[name]),
                **_image_row(sample, name),
                **rerun_labels.image_row(
                    sample.truth[name], None if tracks is None else tracks.sensors.get(name)
                ),
            }
            for name in info.cameras
            if name in sample.truth
        },
        "lidars": {
            name: {
                "time_s": round(begins_s + cloud.time_s, 9),
                **_delivery_row(info, name, cloud),
                "pose": _pose(cloud.lidar.T_world_lidar),
            }
            for name, cloud in sorted(sample.capture.clouds.items())
        },
        **rerun_labels.frame_row(sample.frame, sample.scene),
        **point_cloud_io.class_facts(info, sample.scene),
    }


def _delivery_row(
    info: DatasetInfo, name: str, reading: capture.SensorReading | capture.PointCloud
) -> dict[str, Any]:
    found = label_parts.delivery(info, name, reading)
    return {} if found is None else {"delivery": found}


def _box_row(item: ObjectTruth, box: OrientedBox) -> dict[str, Any]:
    return {
        "class": item.instance.category_id,
        "pose": _pose(box.T_frame_box),
        "half": [0.5 * size for size in box.size_m],
    }


def _image_row(sample: Sample, name: str) -> dict[str, Any]:
    truth = sample.truth[name]
    camera = truth.camera.intrinsics
    items = [item for item in truth.objects if item.box is not None and not item.ignored]
    return {
        "pose": _pose(truth.camera.T_world_camera),
        "size": [camera.width_px, camera.height_px],
        "K": camera.matrix().tolist() if camera.straight else None,
        "boxes": [
            [item.instance.category_id, b.x_min, b.y_min, b.width_px, b.height_px]
            for item in items
            if (b := item.box) is not None
        ],
        "keypoints": {
            f"{item.instance.instance_id}": {
                "class": item.instance.category_id,
                "names": [point.name for point in points],
                "places": [point.image_px for point in points],
            }
            for item in items
            if (points := [p for p in item.keypoints or () if p.visibility])
        },
    }


def _pose(pose: se3.SE3) -> list[float]:
    """Position [m], and quaternion x y z w."""
    w, x, y, z = pose.quaternion_wxyz
    return [*pose.translation_m, x, y, z, w]


def _collect_keypoints(
    shard_dirs: Sequence[Path], exporter: str, splits: Iterable[str]
) -> dict[int, Skeleton]:
    """Skeletons by category id, of all keypoints that occur in the data set."""
    names: dict[int, dict[str, None]] = {}
    for split in splits:
        for _, row in fragment_rows(shard_dirs, exporter, f"{split}.samples"):
            for image in row["cameras"].values():
                for item in image["keypoints"].values():
                    names.setdefault(item["class"], {}).update(dict.fromkeys(item["names"]))
    return {number: find_skeleton(sorted(found)) for number, found in sorted(names.items())}


def _chunks(
    info: DatasetInfo, rows: Sequence[Row], skeletons: Mapping[int, Skeleton]
) -> Iterator[Any]:
    """Chunks of a recording: one per entity and archetype."""
    import rerun as rr
    from rerun.chunk import Chunk

    axes = rr.ViewCoordinates.columns(xyz=[rr.components.ViewCoordinates([3, 5, 1])])
    yield Chunk.from_columns("world", indexes=[], columns=axes)
    (classes,) = rr.AnnotationContext(_describe_classes(info, skeletons)).as_component_batches()
    context = rr.ComponentColumn(classes.component_descriptor(), classes, lengths=[1])
    yield Chunk.from_columns("/", indexes=[], columns=[context])
    if any(row["boxes"] for row in rows):
        yield _box_chunk(info, rows)
    for rig in sorted({name for row in rows for name in row["rigs"]}):
        mine = [{**row, "pose": row["rigs"][rig]} for row in rows if rig in row["rigs"]]
        yield _poses(info, f"world/rigs/{rig}", mine)
    for path, found, columns in rerun_labels.frame_entities(rows):
        yield _chunk(info, path, found, columns)
    for name in info.cameras:
        if images := _readings(rows, "cameras", name):
            yield from _camera_chunks(info, name, images, skeletons)
    for name in info.lidars:
        if scans := _readings(rows, "lidars", name):
            yield from _lidar_chunks(info, name, scans)
    for kind in ("cameras", "lidars"):
        for name in sorted({name for row in rows for name in row[kind]}):
            for path, found, columns in rerun_labels.delivery_entities(
                name, _readings(rows, kind, name)
            ):
                yield _chunk(info, path, found, columns)
    for name in sorted({name for row in rows for name in row.get("faults", ())}):
        yield _fault_chunk(info, name, rows)


def _readings(rows: Sequence[Row], kind: str, sensor: str) -> list[Row]:
    """Rows of the samples that a sensor reads, with the fields of its reading."""
    return [{**row, **row[kind][sensor]} for row in rows if sensor in row[kind]]


def _fault_chunk(info: DatasetInfo, name: str, rows: Sequence[Row]) -> Any:
    import rerun as rr

    texts = [row.get("faults", {}).get(name, "") for row in rows]
    return _chunk(info, f"faults/{name}", rows, rr.TextDocument.columns(text=texts))


def _box_chunk(info: DatasetInfo, rows: Sequence[Row]) -> Any:
    import rerun as rr

    boxes = [box for row in rows for box in row["boxes"]]
    columns = rr.Boxes3D.columns(
        half_sizes=[box["half"] for box in boxes],
        centers=[box["pose"][:3] for box in boxes],
        quaternions=[box["pose"][3:] for box in boxes],
        class_ids=[box["class"] for box in boxes],
    )
    return _chunk(info, "world/boxes", rows, columns.partition([len(r["boxes"]) for r in rows]))


def _describe_classes(info: DatasetInfo, skeletons: Mapping[int, Skeleton]) -> list[Any]:
    import rerun as rr

    palette = label_colors.voc_palette()
    described = [rr.ClassDescription(info=rr.AnnotationInfo(id=0, label="background"))]
    for number, name in enumerate(info.categories, 1):
        color = palette[1 + (number - 1) % 255].tolist()
        skeleton = skeletons.get(number, Skeleton(()))
        described.append(
            rr.ClassDescription(
                info=rr.AnnotationInfo(id=number, label=name, color=color),
                keypoint_annotations=[
                    rr.AnnotationInfo(id=k, label=label, color=color)
                    for k, label in enumerate(skeleton.names)
                ],
                keypoint_connections=skeleton.bones,
            )
        )
    return described


def _camera_chunks(
    info: DatasetInfo, name: str, rows: Sequence[Row], skeletons: Mapping[int, Skeleton]
) -> Iterator[Any]:
    import rerun as rr

    path = f"world/cameras/{name}"
    yield _poses(info, path, rows)
    if rows[0]["K"] is not None:
        pinhole = rr.Pinhole.columns(
            image_from_camera=[rr.components.PinholeProjection(row["K"]) for row in rows],
            resolution=[row["size"] for row in rows],
            camera_xyz=[rr.components.ViewCoordinates([3, 2, 5])] * len(rows),
        )
        yield _chunk(info, f"{path}/image", rows, pinhole)
    for channel in info.media[name]:
        if channel is capture.Channel.DEPTH_LAYERS or channel in rerun_labels.COLORED:
            files = _files(info, name, channel, rows)
            for entity, mine, columns in rerun_labels.channel_entities(
                name, channel, rows, files, info.depth_scale_m
            ):
                yield _chunk(info, entity, mine, columns)
        columns = _channel_columns(info, name, channel, rows)
        if columns is not None:
            yield _chunk(info, f"{path}/image/{channel.value}", rows, columns)
    counts = [len(row["boxes"]) for row in rows]
    if any(counts):
        numbers = np.array([box for row in rows for box in row["boxes"]], np.float64)
        half = 0.5 * numbers[:, 3:]
        boxes = rr.Boxes2D.columns(
            half_sizes=half,
            centers=numbers[:, 1:3] + half,
            class_ids=numbers[:, 0].astype(np.uint16),
        )
        yield _chunk(info, f"{path}/image/boxes", rows, boxes.partition(counts))
    for entity, mine, columns in rerun_labels.image_entities(f"{path}/image", rows):
        yield _chunk(info, entity, mine, columns)
    for instance in sorted({key for row in rows for key in row["keypoints"]}, key=int):
        columns = _keypoint_columns([row["keypoints"].get(instance) for row in rows], skeletons)
        yield _chunk(info, f"{path}/image/keypoints/{instance}", rows, columns)


def _channel_columns(
    info: DatasetInfo, name: str, channel: capture.Channel, rows: Sequence[Row]
) -> Any | None:
    """Columns of the images of a channel; None for channels that are left out."""
    import rerun as rr
    from rerun.components import ImageFormat
    from rerun.encodings import ChannelDatatype

    paths = _files(info, name, channel, rows)
    types = [f"image/{info.encoding(name, channel).format}"] * len(paths)
    if channel is capture.Channel.RGB:
        return rr.EncodedImage.columns(blob=_blobs(paths), media_type=types)
    if channel in DEPTHS:
        units_per_m = [1.0 / info.depth_scale_m] * len(paths)
        return rr.EncodedDepthImage.columns(blob=_blobs(paths), media_type=types, meter=units_per_m)
    if channel is capture.Channel.CATEGORY:
        return rr.SegmentationImage.columns(
            buffer=[np.frombuffer(_read_ids(path).tobytes(), np.uint8) for path in paths],
            format=[
                ImageFormat(width=w, height=h, channel_datatype=ChannelDatatype.U16)
                for w, h in (row["size"] for row in rows)
            ],
        )
    return None


def _files(
    info: DatasetInfo, camera: str, channel: capture.Channel, rows: Sequence[Row]
) -> list[Path]:
    return [info.media_path(row["shard"], camera, channel, row["index"]) for row in rows]


def _read_ids(path: Path) -> NDArray[np.uint16]:
    """Category ids, uint16 [h, w]."""
    return np.asarray(image_files.read_pixels(path), np.uint16)


def _blobs(paths: Iterable[Path]) -> list[np.ndarray]:
    return [np.frombuffer(path.read_bytes(), np.uint8) for path in paths]


def _keypoint_columns(items: Sequence[Row | None], skeletons: Mapping[int, Skeleton]) -> Any:
    """Columns of the keypoints of one object; none where it is not seen, which clears them."""
    import rerun as rr

    known = [item for item in items if item is not None]
    return rr.Points2D.columns(
        positions=[place for item in known for place in item["places"]],
        class_ids=[item["class"] for item in known for _ in item["names"]],
        keypoint_ids=[
            skeletons[item["class"]].names.index(name) for item in known for name in item["names"]
        ],
    ).partition([0 if item is None else len(item["names"]) for item in items])


def _lidar_chunks(info: DatasetInfo, name: str, rows: Sequence[Row]) -> Iterator[Any]:
    import rerun as rr

    path = f"world/lidars/{name}"
    yield _poses(info, path, rows)
    stored = (point_cloud_io.read_points(row["shard"], name, row["index"]) for row in rows)
    points = [
        point_cloud_io.with_classes(scan, row.get("classes"))
        for scan, row in zip(stored, rows, strict=True)
    ]
    joined = np.concatenate(points)
    if len(joined):
        columns = rr.Points3D.columns(
            positions=joined["position_m"], class_ids=joined["category_id"]
        )
        yield _chunk(info, path, rows, columns.partition([len(scan) for scan in points]))


def _poses(info: DatasetInfo, path: str, rows: Sequence[Row]) -> Any:
    import rerun as rr

    poses = np.array([row["pose"] for row in rows], np.float64)
    columns = rr.Transform3D.columns(translation=poses[:, :3], quaternion=poses[:, 3:])
    return _chunk(info, path, rows, columns)


def _chunk(info: DatasetInfo, path: str, rows: Sequence[Row], columns: Any) -> Any:
    import rerun as rr
    from rerun.chunk import Chunk

    indexes = [rr.TimeColumn("sample", sequence=[row["index"] for row in rows])]
    if info.steps_per_scene > 1:
        indexes.append(rr.TimeColumn("time", duration=[row["time_s"] for row in rows]))
    return Chunk.from_columns(path, indexes=indexes, columns=columns)
