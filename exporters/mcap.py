"""MCAP: one file per sequence with Foxglove's messages, for Foxglove, Lichtblick and ROS tools.

::

    train/street-000003.mcap      sequence 3; a data set of stills has one file per sample

==============================  =================================================================
topic                           message (Protobuf schema ``foxglove.*``)
==============================  =================================================================
/tf                             FrameTransform: ``world`` -> rigs, cameras and scanners without
                                a rig; rigs -> their cameras and scanners
/camera/<name>/<channel>        CompressedImage: the shards' files
/camera/<name>/calibration      CameraCalibration; none for equirectangular lenses
/camera/<name>/annotations      ImageAnnotations: boxes of the visible pixels, with categories
/lidar/<name>/points            PointCloud with all fields of ``POINT``
/objects                        SceneUpdate: a cube per object that a camera sees, at the instant of
                                the step; frame ``world``, with category, name and instance id as
                                metadata
==============================  =================================================================

Every sequence starts at 0:00 UTC of 1 January 2020. Log times, publish times and times in messages
are equal: each sensor has the instant of its reading, a scanner the middle of its sweep. ``time_s``
of points counts from there: stamp plus time is the instant of the pulse, or from the start of the
sweep (``point_time``). With a wrong clock, publish times and times in messages are the reported
ones, and the transforms of that time are the true ones then; log times are arrivals by a true
clock, and doubled readings arrive twice. Messages are in order of log time. Frames are called
``camera/<name>`` (X right, Y down, Z forward), ``lidar/<name>`` and ``rig/<name>`` (X forward,
Y left, Z up).

Calibrations follow ROS and OpenCV, where the centre of the first pixel is (0, 0): the principal
point is ours minus 0.5. Annotations are in Foxglove's image coordinates, which are ours.

Chunks are not compressed unless ``compression: zstd`` is set, because images already are; sums
guard every chunk. Bytes depend on the release of the Foxglove schemas, which are part of each file,
and of zstandard.

References: https://mcap.dev/spec; https://docs.foxglove.dev/docs/sdk/schemas.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from gen_data.core import capture, errors, intrinsics, se3, serialization
from gen_data.core.boxes import OrientedBox
from gen_data.core.capture import PointCloud, SensorReading
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.reported import arrived_s, copies, reported, reported_s
from gen_data.core.sample import ImageTruth, Sample
from gen_data.core.scene import Camera, Instance, Lidar
from gen_data.core.scene_time import scene_at
from gen_data.exporters import base, fragments
from gen_data.exporters.conventions import POINT_TIME, Conventions
from gen_data.exporters.point_cloud_io import (
    PointTime,
    class_facts,
    count_times_from,
    read_points,
    with_classes,
)
from gen_data.exporters.sequences import FRAMES, Frame, frame_facts, write_frames

if TYPE_CHECKING:
    from google.protobuf.message import Message
    from mcap.writer import Writer

WORLD = "world"
DECIMALS = 9
START_NS = 1_577_836_800_000_000_000
"""1 January 2020. Times are unsigned, and a sensor may read before its sequence's first instant."""
NUMERIC_TYPES = {"|u1": 1, "<u2": 3, "<f4": 7}
"""Numbers of ``foxglove.PackedElementField.NumericType`` by NumPy type."""
DISTORTION = {
    "pinhole": "plumb_bob",
    "brown_conrady": "rational_polynomial",
    "kannala_brandt": "kannala_brandt",
}
"""Foxglove's distortion model by lens model; its coefficients are in OpenCV's order."""
FORMATS = {"png": "png", "jpeg": "jpeg", "webp": "webp", "webp_lossless": "webp"}
"""Foxglove's name by image format."""
BOX_COLOR = {"r": 0.2, "g": 0.9, "b": 0.4, "a": 0.35}
LINE_COLOR = {"r": 0.2, "g": 0.9, "b": 0.4, "a": 1.0}
LINE_PX = 2.0
TEXT_PX = 12.0


class Mcap(base.ExporterBase):
    """MCAP files of sequences: images, calibrations, scans, transforms and boxes.

    Attributes:
        compression: Compression of the files' chunks: ``zstd`` for smaller files, mostly of points.
        point_time: Instant from which ``time_s`` of points counts: the ``sweep_middle``, which is
            the message's stamp, or the ``sweep_start``.
    """

    type: Literal["mcap"] = "mcap"
    holds_twice: ClassVar[bool] = True
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i in calibrations, i + 0.5 in annotations",
        box="corners along the edges of pixels",
        lens="any; `distortion_model` and `D` of calibrations",
        time="ns; sequences begin on 1 January 2020; middle of the exposure or sweep; "
        f"{POINT_TIME}",
        ring="highest laser",
        intensity="0 to 1",
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"boxes3d"})

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    compression: Literal["none", "zstd"] = "none"
    point_time: PointTime = "sweep_middle"

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: there is neither camera nor laser scanner, or a library is missing.
        """
        base.check_installed(self.type, "mcap", "mcap_protobuf", "foxglove_schemas_protobuf")
        if not info.cameras and not info.lidars:
            raise errors.ConfigError(
                f"exporter '{self.type}': there is neither camera nor lidar; add such a sensor"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a line per sample: times, poses, calibrations and boxes."""
        self.check(info)
        rows = (
            frame_facts(info, sample) | _frame_row(sample) | class_facts(info, sample.scene)
            for sample in samples
        )
        write_frames(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the file of each sequence."""
        stem = "_".join(info.name.split())
        lines = fragments.fragment_rows(shard_dirs, self.type, FRAMES)
        frames = (Frame(shard_dir, row) for shard_dir, row in lines)
        for number, group in groupby(frames, key=lambda frame: frame.row["sequence"]):
            sequence = list(group)
            path = dataset_dir / sequence[0].row["split"] / f"{stem}-{number:06d}.mcap"
            path.parent.mkdir(parents=True, exist_ok=True)
            _write_file(info, path, sequence, self)


def _frame_row(sample: Sample) -> dict[str, Any]:
    """Times, poses, calibrations and boxes of a sample."""
    readings, clouds = sample.capture.readings, sample.capture.clouds
    scene = sample.scene
    cameras = {name: reported_s(readings[name]) for name in sorted(sample.truth)}
    transforms: list[tuple[float, str, str, se3.SE3]] = []
    for name, stamp_s in cameras.items():
        camera = sample.truth[name].camera
        camera = (
            camera if stamp_s == readings[name].time_s else scene_at(scene, stamp_s).camera(name)
        )
        transforms += _camera_transforms(camera, stamp_s)
    for name, cloud in clouds.items():
        stamp_s, lidar = reported_s(cloud), cloud.lidar
        lidar = lidar if stamp_s == cloud.time_s else scene_at(scene, stamp_s).lidar(name)
        transforms += _lidar_transforms(lidar, stamp_s)
    transforms += [
        (scene.time_s, WORLD, f"rig/{rig.name}", scene.rig_pose(rig.name)) for rig in scene.rigs
    ]
    # Several sensors may state the pose of one rig at one instant.
    unique = {(_ns(time_s), child): (parent, pose) for time_s, parent, child, pose in transforms}
    return {
        "time_ns": _ns(scene.time_s),
        "transforms": [
            [time_ns, parent, child, *_pose_numbers(pose)]
            for (time_ns, child), (parent, pose) in sorted(unique.items(), key=itemgetter(0))
        ],
        "cameras": {n: _camera_row(sample.truth[n], stamp_s) for n, stamp_s in cameras.items()},
        "lidars": {
            name: [_ns(reported_s(cloud)), cloud.lidar.sweep_s]
            for name, cloud in sorted(clouds.items())
        },
        "objects": [_object_row(thing, box) for thing, box in world_boxes(sample)],
        **_arrivals({**readings, **clouds}),
    }


def _arrivals(read: Mapping[str, SensorReading | PointCloud]) -> dict[str, dict[str, list[int]]]:
    """``arrivals``: log times of readings, by sensor, unless they arrive once, at their stamp."""
    times = {
        name: [_ns(arrived_s(reading))] * copies(reading)
        for name, reading in sorted(read.items())
        if copies(reading) > 1 or arrived_s(reading) != reported_s(reading)
    }
    return {"arrivals": times} if times else {}


def _camera_transforms(camera: Camera, time_s: float) -> list[tuple[float, str, str, se3.SE3]]:
    frame = f"camera/{camera.name}"
    if not camera.rig:
        return [(time_s, WORLD, frame, reported(camera).T_world_camera)]
    rig, T_rig_camera = f"rig/{camera.rig}", camera.T_rig_camera
    T_world_rig = camera.T_world_camera @ T_rig_camera.inverse()
    return [(time_s, WORLD, rig, T_world_rig), (time_s, rig, frame, reported(camera).T_rig_camera)]


def _lidar_transforms(lidar: Lidar, time_s: float) -> list[tuple[float, str, str, se3.SE3]]:
    frame = f"lidar/{lidar.name}"
    if not lidar.rig:
        return [(time_s, WORLD, frame, reported(lidar).T_world_lidar)]
    rig, T_world_rig = f"rig/{lidar.rig}", lidar.T_world_lidar @ lidar.T_rig_lidar.inverse()
    return [(time_s, WORLD, rig, T_world_rig), (time_s, rig, frame, reported(lidar).T_rig_lidar)]


def world_boxes(sample: Sample) -> list[tuple[Instance, OrientedBox]]:
    """World boxes of the objects that any camera sees; of all annotated ones without a camera.

    They are at the sample's instant: cameras that read later have boxes of objects that moved on.
    """
    things = sorted(sample.scene.instances, key=lambda thing: thing.instance_id)
    if not sample.truth:
        return [(thing, thing.box3d) for thing in things if thing.annotated]
    seen = {
        thing.instance.instance_id: thing.instance
        for truth in sample.truth.values()
        for thing in truth.objects
        if thing.box is not None and not thing.ignored
    }
    return [(seen[i.instance_id], i.box3d) for i in things if i.instance_id in seen]


def _camera_row(truth: ImageTruth, time_s: float) -> dict[str, Any]:
    camera = truth.camera.intrinsics
    return {
        "time_ns": _ns(time_s),
        "size_px": [camera.width_px, camera.height_px],
        "model": DISTORTION.get(camera.lens.model, ""),
        "D": camera.lens.coefficients or [0.0] * 5,
        "K": _opencv_matrix(camera),
        "boxes": [
            [thing.box.x_min, thing.box.y_min, thing.box.x_max, thing.box.y_max,
             thing.instance.category]
            for thing in truth.objects
            if thing.box is not None and not thing.ignored
        ],
    }  # fmt: skip


def _opencv_matrix(camera: intrinsics.Intrinsics) -> list[float]:
    """K row by row for pixel centres at integers."""
    matrix = camera.matrix()
    matrix[:2, 2] -= 0.5
    return [float(value) for value in matrix.ravel()]


def _object_row(thing: Instance, box: OrientedBox) -> dict[str, Any]:
    return {
        "id": thing.instance_id,
        "category": thing.category,
        "name": thing.name,
        "pose": _pose_numbers(box.T_frame_box),
        "size_m": [round(edge, DECIMALS) for edge in box.size_m],
    }


def _pose_numbers(pose: se3.SE3) -> list[float]:
    """Translation and quaternion x y z w."""
    w, x, y, z = pose.quaternion_wxyz
    return [round(v, DECIMALS) + 0.0 for v in (*pose.translation_m, x, y, z, w)]


def _ns(time_s: float) -> int:
    return START_NS + round(time_s * 1e9)


@dataclass(frozen=True, slots=True)
class _Event:
    """Messages of one kind at one instant; their content is read when they are written.

    Attributes:
        time_ns: Time stamp.
        logged_ns: Arrival.
        kind: ``transform``, ``camera``, ``lidar`` or ``objects``.
        key: Number of a transform, or name of a sensor.
    """

    time_ns: int
    logged_ns: int
    frame: Frame
    kind: str
    key: Any


def _events(frame: Frame) -> Iterator[_Event]:
    """Everything that happens at a sample, transforms first."""
    row = frame.row
    for number, transform in enumerate(row["transforms"]):
        yield _Event(transform[0], transform[0], frame, "transform", number)
    stamps = [("camera", name, camera["time_ns"]) for name, camera in row["cameras"].items()]
    stamps += [("lidar", name, time_ns) for name, (time_ns, _) in row["lidars"].items()]
    for kind, name, time_ns in stamps:
        for logged_ns in row.get("arrivals", {}).get(name, [time_ns]):
            yield _Event(time_ns, logged_ns, frame, kind, name)
    yield _Event(row["time_ns"], row["time_ns"], frame, "objects", None)


def _write_file(info: DatasetInfo, path: Path, sequence: Sequence[Frame], exporter: Mcap) -> None:
    from mcap.writer import CompressionType, Writer

    # Sorting is stable: transforms stay before the messages that need them.
    events = sorted((e for f in sequence for e in _events(f)), key=lambda e: e.logged_ns)
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType[exporter.compression.upper()])
        writer.start(profile="", library="gen-data")
        facts = {"name": info.name, "seed": str(info.seed)}
        facts["categories"] = serialization.canonical_json(info.categories)
        facts["depth_scale_m"] = repr(info.depth_scale_m)
        facts |= {**exporter.conventions.facts(), "point_time": exporter.point_time}
        writer.add_metadata("gen-data", facts)
        channels = _Channels(writer)
        for event in events:
            for topic, message in _messages(info, event, exporter.point_time):
                channels.write(topic, message, event)
        writer.finish()


class _Channels:
    """Channels of a file, registered with their first message."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._ids: dict[str, int] = {}
        self._schemas: dict[str, int] = {}

    def write(self, topic: str, message: Message, event: _Event) -> None:
        if topic not in self._ids:
            schema = self._schema(message)
            self._ids[topic] = self._writer.register_channel(topic, "protobuf", schema)
        data = message.SerializeToString(deterministic=True)
        self._writer.add_message(self._ids[topic], event.logged_ns, data, event.time_ns)

    def _schema(self, message: Message) -> int:
        from mcap_protobuf.schema import register_schema

        name = message.DESCRIPTOR.full_name
        if name not in self._schemas:
            self._schemas[name] = register_schema(self._writer, type(message))
        return self._schemas[name]


def _messages(
    info: DatasetInfo, event: _Event, point_time: PointTime
) -> Iterator[tuple[str, Message]]:
    row = event.frame.row
    if event.kind == "transform":
        yield "/tf", _transform_message(row["transforms"][event.key])
    elif event.kind == "camera":
        yield from _camera_messages(info, event)
    elif event.kind == "lidar":
        yield f"/lidar/{event.key}/points", _cloud_message(event, point_time)
    else:
        yield "/objects", _objects_message(row["objects"], event.time_ns)


def _transform_message(row: Sequence[Any]) -> Message:
    from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform

    time_ns, parent, child, x, y, z, qx, qy, qz, qw = row
    return FrameTransform(
        timestamp=_timestamp(time_ns),
        parent_frame_id=parent,
        child_frame_id=child,
        translation={"x": x, "y": y, "z": z},
        rotation={"x": qx, "y": qy, "z": qz, "w": qw},
    )


def _camera_messages(info: DatasetInfo, event: _Event) -> Iterator[tuple[str, Message]]:
    from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
    from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

    name, frame = event.key, event.frame
    row = frame.row["cameras"][name]
    common = {"timestamp": _timestamp(event.time_ns), "frame_id": f"camera/{name}"}
    width, height = row["size_px"]
    k = row["K"]
    if row["model"]:
        yield (
            f"/camera/{name}/calibration",
            CameraCalibration(
                **common,
                width=width,
                height=height,
                distortion_model=row["model"],
                D=row["D"],
                K=k,
                R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
                P=[*k[0:3], 0, *k[3:6], 0, *k[6:9], 0],
            ),
        )
    for channel in info.media[name]:
        path = info.media_path(frame.shard_dir, name, channel, frame.index)
        image = CompressedImage(
            **common, data=path.read_bytes(), format=FORMATS[info.encoding(name, channel).format]
        )
        yield f"/camera/{name}/{channel.value}", image
    if capture.Channel.RGB in info.media[name]:
        yield f"/camera/{name}/annotations", _annotations_message(row["boxes"], event.time_ns)


def _annotations_message(boxes: Iterable[Sequence[Any]], time_ns: int) -> Message:
    from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations

    message = ImageAnnotations(timestamp=_timestamp(time_ns))
    for left, top, right, bottom, category in boxes:
        corners = ((left, top), (right, top), (right, bottom), (left, bottom))
        message.points.add(
            timestamp=_timestamp(time_ns),
            type=2,  # LINE_LOOP
            points=[{"x": x, "y": y} for x, y in corners],
            outline_color=LINE_COLOR,
            thickness=LINE_PX,
        )
        message.texts.add(
            timestamp=_timestamp(time_ns),
            position={"x": left, "y": top},
            text=category,
            font_size=TEXT_PX,
            text_color=LINE_COLOR,
        )
    return message


def _cloud_message(event: _Event, point_time: PointTime) -> Message:
    from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud

    frame = event.frame
    stored = read_points(frame.shard_dir, event.key, frame.index)
    points = count_times_from(point_time, stored, frame.row["lidars"][event.key][1])
    points = with_classes(points, frame.row.get("classes"))
    return PointCloud(
        timestamp=_timestamp(event.time_ns),
        frame_id=f"lidar/{event.key}",
        pose={"position": {}, "orientation": {"w": 1.0}},
        point_stride=capture.POINT.itemsize,
        fields=list(point_fields()),
        data=points.tobytes(),
    )


def point_fields() -> Iterator[dict[str, Any]]:
    """Yield name, offset and type of each number of a ``POINT`` record."""
    for name in capture.POINT.names or ():
        dtype, offset = capture.POINT.fields[name][:2]  # type: ignore[index]
        if name == "position_m":
            for k, axis in enumerate("xyz"):
                yield {"name": axis, "offset": offset + 4 * k, "type": NUMERIC_TYPES["<f4"]}
        else:
            yield {"name": name, "offset": offset, "type": NUMERIC_TYPES[dtype.str]}


def _objects_message(objects: Iterable[Mapping[str, Any]], time_ns: int) -> Message:
    """Cubes that replace the cubes of the instant before."""
    from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

    message = SceneUpdate()
    message.deletions.add(timestamp=_timestamp(time_ns), type=1)  # ALL
    for thing in objects:
        x, y, z, qx, qy, qz, qw = thing["pose"]
        length, width, height = thing["size_m"]
        pose = {
            "position": {"x": x, "y": y, "z": z},
            "orientation": {"x": qx, "y": qy, "z": qz, "w": qw},
        }
        facts = {"category": thing["category"], "name": thing["name"]}
        message.entities.add(
            timestamp=_timestamp(time_ns),
            frame_id=WORLD,
            id=str(thing["id"]),
            metadata=[{"key": key, "value": value} for key, value in facts.items()],
            cubes=[
                {"pose": pose, "size": {"x": length, "y": width, "z": height}, "color": BOX_COLOR}
            ],
        )
    return message


def _timestamp(time_ns: int) -> Message:
    from google.protobuf.timestamp_pb2 import Timestamp

    seconds, nanos = divmod(time_ns, 1_000_000_000)
    return Timestamp(seconds=seconds, nanos=nanos)
